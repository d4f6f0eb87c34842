"""The report of a suite of records, and the files of its results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ground_motions.files import atomic_write

from ...sweeps.suites.result import SCENARIO
from ...written_names import as_written, capital
from ..style import BAND, save
from ..suite_figures import (
    floor_panels,
    floor_spectra_panels,
    spectra,
    spectra_key,
    spectra_panel,
)
from ..suite_tables import (
    comparison_table,
    floor_tables,
    motions_text,
    over_motions,
    records_table,
    statistics_table,
    verdict,
)
from ..sweep_tables import heading
from .page import Block, Cell, Facts, Key, Listing, Page, Prose, Row, Section, Table
from .panels import panel_chart
from .run_report import versions
from .sweep_report import warnings_of

if TYPE_CHECKING:
    from ...sweeps.suites.result import Suite
    from ..chart import Panel

_SHOWN = ("peak_base_displacement_m", "peak_floor_acceleration_m_s2", "peak_drift_m")
_CHANGES = {
    "scale_factor": "Scale factor",
    "largest_misfit": "Largest distance from the target",
    "arias_ratio": "Arias intensity over that of the scaled original",
    "duration_change_s": "Change of the 5-95 % duration, s",
}


def write_suite(suite: Suite) -> None:
    """Write tables, figure and report to a suite's folder."""
    plotted = suite.index["spectra"]["plotted"]
    tables = {
        "runs": suite.table.set_index("motion"),
        "statistics": suite.statistics,
        "motions": pd.DataFrame(suite.index["motions"]).drop(columns="files").set_index("name"),
        "spectra": pd.DataFrame(
            {
                "period_s": plotted["period_s"],
                "target_psa_m_s2": plotted["target_m_s2"],
                "suite_mean_psa_m_s2": pd.DataFrame(plotted["psa_m_s2"]).mean(axis=1),
            }
            | {f"{name}_psa_m_s2": row for name, row in plotted["psa_m_s2"].items()}
        ).set_index("period_s"),
    }
    if suite.floors is not None:
        tables |= {str(name): over_motions(values) for name, values in suite.floors.items()}
    for name, table in tables.items():
        with atomic_write(suite.folder / f"{name}.csv") as unfinished:
            table.to_csv(unfinished)
    save(spectra(suite), suite.folder / "figures", "spectra")
    if suite.floors is not None:
        save(suite.plot_floors(), suite.folder / "figures", "floors")
        for direction in suite.floors.direction.to_numpy():
            figure = suite.plot_floor_spectra(str(direction))
            save(figure, suite.folder / "figures", f"floor_spectra_{direction}")
    if len(suite.controllers) > 1:
        save(suite.plot(), suite.folder / "figures", "comparison")
    suite_report(suite).write(suite.folder / "report.html")


def suite_report(suite: Suite) -> Page:
    """Report of a suite."""
    panel = spectra_panel(suite)
    assert panel.band is not None
    low, high = panel.band
    band = f"periods of the rule, {low:.2g} to {high:.2g} s"
    statistics: list[Block] = [Table.of(comparison_table(suite), "All controllers")] * (
        len(suite.controllers) > 1
    )
    statistics += [
        Table.of(statistics_table(suite, label), as_written(label)) for label in suite.controllers
    ]
    shown = [name for name in _SHOWN if name in suite.criteria]
    parts: list[tuple[str, Sequence[Block]]] = [
        ("Verdict", [Prose(tuple(verdict(suite)), "verdict"), *warnings_of(suite.sweep)]),
        ("Spectra", [
            Key({band: (BAND, "")}, spectra_key(panel)),
            panel_chart(panel, _spectra_text(panel), height=400),
        ]),
        ("Statistics over the suite", statistics),
        ("Floors and storeys", _floors(suite)),
        ("Results by record", [
            Table.of(records_table(suite, name), capital(heading(name))) for name in shown
        ]),
        ("The records as used", [*_components(suite), _changes(suite)]),
        ("Inputs and versions", [
            Facts({
                "Suite": suite.name,
                "Motions": motions_text(suite),
                "Rule": f"{suite.rule.name}: {suite.rule.clause}; {suite.rule.response_clause}",
                "Scaling": suite.index["scaling"],
                "Controllers": ", ".join(map(as_written, suite.controllers)),
                "All numbers": "runs.csv and statistics.csv, in SI units",
                "Versions": versions(),
            }),
            *_scenario(suite),
        ]),
    ]  # fmt: skip
    sections = [Section(title, blocks) for title, blocks in parts if blocks]
    return Page(f"Suite: {suite.name}", motions_text(suite), sections)


def _floors(suite: Suite) -> list[Block]:
    """Peaks of each level and storey, and floor spectra along each direction."""
    if suite.floors is None:
        return []
    peaks = floor_panels(suite)
    blocks: list[Block] = [Key({}, peaks[0].looks)]
    blocks += [panel_chart(panel, height=260) for panel in peaks]
    blocks += [Table.of(table) for table in floor_tables(suite)]
    periods = suite.floors.period_s.to_numpy()
    # so that on a narrow page the first label is not below that of the other axis
    beyond = {"range": np.log10([0.8 * periods[0], 1.1 * periods[-1]]).tolist()}
    for direction in suite.floors.direction.to_numpy():
        panels = floor_spectra_panels(suite, str(direction))
        for panel in panels[:1] + panels[1:][-1:]:
            titled = replace(panel, title=f"Floor spectra: {panel.title}")
            blocks.append(panel_chart(titled, xaxis=beyond))
    files = "floor_spectrum_m_s2.csv and the figures floor_spectra have all levels."
    return [*blocks, Prose((files,))]


def _scenario(suite: Suite) -> list[Block]:
    """The scenario file; none for a suite of Python objects."""
    file = suite.folder / SCENARIO
    if not file.is_file():
        return []
    title = "The scenario file: building, isolators, records and target"
    return [Listing(title, file.read_text(encoding="utf-8"))]


def _spectra_text(panel: Panel) -> str:
    """Contents of the chart of spectra in words."""
    periods, mean = panel.lines["mean"]
    k = int(mean.argmax())
    return f"Largest mean {mean[k]:.3g} m/s² at {periods[k]:.2g} s; spectra.csv has all ordinates."


def _components(suite: Suite) -> list[Block]:
    """Files or names of the components, and the peak of the horizontal ones after scaling."""
    rows = tuple(
        Row(each["name"], (Cell(each["components"]), Cell(f"{each['pga_m_s2']:.4g}")))
        for each in suite.index["motions"]
        if "components" in each  # not of a suite that an earlier version saved
    )
    headings = ("Motion", "Along each direction", "Peak, m/s²")
    return [Table("Components", headings, rows)] if rows else []


def _changes(suite: Suite) -> Table:
    motions = suite.index["motions"]
    keys = [key for key in _CHANGES if key in motions[0]]
    rows = tuple(
        Row(each["name"], tuple(Cell(f"{each[key]:.4g}") for key in keys)) for each in motions
    )
    return Table("Changes", ("Motion", *(_CHANGES[key] for key in keys)), rows)
