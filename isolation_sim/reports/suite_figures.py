"""Figures of a suite: spectra of the records and their target, peaks and spectra of the floors."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError, check_name
from ..simulation.floors import SPECTRA
from .chart import Panel, floor_spectrum
from .panels import draw, grid
from .style import Look, legend, line_looks, new_figure, style
from .suite_tables import floor_columns
from .units import unit_of

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from ..sweeps.suites.result import Suite

COMBINATIONS = {
    "srss": "SRSS of the components",
    "rotd100": "RotD100",
    "geometric_mean": "geometric mean of the components",
    "mean": "mean of the components",
    "larger": "larger component",
}
"""Combination of the components' spectra, in words."""


_LOOKS = {
    "mean": Look("#000000", width=1.6),
    "target": Look("#D55E00", (4, 1.2), width=1.6),
    "least mean by the rule": Look("#0072B2", (1, 1)),
}
_RECORD = Look("#a6a6a6", width=0.6)


def spectra_panel(suite: Suite) -> Panel:
    """Spectra of the scaled records, their mean, the target and the rule's least mean."""
    result = suite.index["spectra"]
    periods = np.array(result["plotted"]["period_s"])
    # a record may have the name of another line
    records = {
        f"record {name}" if name in _LOOKS else name: (periods, np.array(row))
        for name, row in result["plotted"]["psa_m_s2"].items()
    }
    target = np.array(result["plotted"]["target_m_s2"], dtype=float)
    lines = dict(records)
    lines["mean"] = periods, np.mean([row for _, row in records.values()], axis=0)
    if not np.isnan(target).all():
        lines["target"] = periods, target
    if result["target"] is not None:
        inside = np.array(result["range"]["period_s"]) > 0.0
        at = np.array(result["range"]["period_s"])[inside]
        range_target = np.array(result["range"]["target_m_s2"], dtype=float)[inside]
        floor = np.array(result["range"]["floor"])[inside]
        lines["least mean by the rule"] = at, floor * range_target
    isolated = suite.index["isolated_period_s"]
    return Panel(
        f"Spectra of the scaled records: {COMBINATIONS[result['combination']]}",
        "period (s)", "pseudo-acceleration (m/s²)", lines,
        _LOOKS | dict.fromkeys(records, _RECORD), unit="m/s²", log_x=True, log_y=True,
        groups=dict.fromkeys(records, "records"),
        band=(suite.rule.low * isolated, suite.rule.high * isolated),
    )  # fmt: skip


def _floors(suite: Suite) -> xarray.Dataset:
    """Floors of a suite that has them."""
    if suite.floors is None:
        raise InputError(
            f"{suite.name}: the floors were not computed; expected: floors = true in [ground]"
        )
    return suite.floors


def floor_panels(suite: Suite) -> list[Panel]:
    """Peaks of each level and storey."""
    floors = _floors(suite)
    result = []
    for name, title, x, unit, place in (
        ("peak_floor_acceleration_m_s2", "Floor acceleration", "Peak abs. acceleration", "m/s²",
         "level"),
        ("peak_drift_m", "Storey drift", "Peak storey drift", "mm", "storey"),
    ):  # fmt: skip
        if name not in floors:
            continue
        lines = floor_columns(floors[name], unit_of(name)[1])
        rows = floors[place].to_numpy().tolist()
        looks = dict(zip(lines, line_looks(len(lines), markers=True), strict=True))
        of_rows = {line: (values, np.arange(len(rows))) for line, values in lines.items()}
        most = np.nanmax(np.concatenate([[0.0], *lines.values()]))
        if len(suite.controllers) > 1:
            title += ": mean over the motions"
        result.append(Panel(
            title, f"{x} ({unit})", "", of_rows, looks, unit, rows=rows,
            reach=1.06 * most or None,
        ))  # fmt: skip
    return result


def floor_spectra_panels(suite: Suite, direction: str | None = None) -> list[Panel]:
    """Spectra of each level along a direction."""
    floors = _floors(suite)
    directions = floors.direction.to_numpy().tolist()
    along = directions[0] if direction is None else direction
    check_name("direction", along, directions)
    behind = f" along {along}" if len(directions) > 1 else ""
    periods = floors.period_s.to_numpy()
    result = []
    for level in floors.level.to_numpy().tolist():
        lines = floor_columns(floors[SPECTRA].sel(direction=along, level=level))
        looks = dict(zip(lines, line_looks(len(lines)), strict=True))
        looks = {line: replace(look, marker="") for line, look in looks.items()}
        of_periods = {line: (periods, values) for line, values in lines.items()}
        result.append(floor_spectrum(f"{level}{behind}", of_periods, looks))
    return result


def floors(suite: Suite) -> Figure:
    """Draw the peaks of each level and storey."""
    return grid(floor_panels(suite), 2, 2.6)


def floor_spectra(suite: Suite, direction: str | None = None) -> Figure:
    """Draw the spectra of each level along a direction."""
    return grid(floor_spectra_panels(suite, direction), 3, 2.0)


def spectra_key(panel: Panel) -> dict[str, Look]:
    """Look of each name in the legend."""
    return {panel.groups.get(name, name): panel.looks[name] for name in panel.lines}


def spectra(suite: Suite) -> Figure:
    """Draw the spectra of a suite."""
    with style():
        figure = new_figure(5.2, 3.4)
        axes = figure.add_subplot()
        draw(axes, spectra_panel(suite), width=1.0)
        legend(figure, axes, "outside upper center")
    return figure
