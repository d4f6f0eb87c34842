"""Files of results: of a comparison, a diagnosis and a suite of records."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from ground_motions.files import atomic_write
from ground_motions.registry import copy_code

from ..archive import FILE, save_archive
from ..comparison import Comparison, json_report
from ..discrepancy.diagnosis import Diagnosis, relative_error
from ..discrepancy.tiers.law_file import text_beside
from ..effects.serialisation import device_places, device_section
from ..io.csv_table import write_table
from ..io.files import json_text, write_text
from ..io.results_folder import file_name, files_into, write_contents
from ..simulation.run_files import write_run
from . import diagnosis_figures
from .diagnosis import markdown
from .drawing import structure_drawing
from .html.diagnosis_report import diagnosis_report
from .html.suite_report import suite_report
from .style import save
from .suite_figures import spectra
from .suite_tables import over_motions

if TYPE_CHECKING:
    from ..sweeps.suites.result import Suite

LAW_FILE = "extended_law.py"


def write_comparison(
    comparison: Comparison, folder: str | Path, scenario: str = "", figures: bool = True
) -> None:
    """Write tables, figures and the report of a comparison."""
    folder = Path(folder)
    for name, run in comparison.runs.items():
        write_run(run, folder / f"{file_name(name)}.nc", scenario)
    save_archive(comparison, folder / FILE)
    write_table(comparison.to_records(), folder / "criteria.csv")
    write_text(json_text(json_report(comparison)) + "\n", folder / "criteria.json")
    write_text(f"{comparison}\n", folder / "table.txt")
    if scenario:
        write_text(scenario, folder / "scenario.toml")
    if figures:
        _write_figures(comparison, folder / "figures")
    comparison.to_html(folder / "report.html", scenario)
    write_contents(folder, comparison.title)


def _write_figures(comparison: Comparison, folder: Path) -> None:
    isolated = next(iter(comparison.runs.values())).isolated
    kinds = ["time_histories", "floor_envelopes", "energy"]
    kinds += ["loops"] * bool(isolated.elements) + ["currents"] * bool(isolated.n_channels)
    kinds += ["loops_in_plan"] * any(len(group) > 1 for group in isolated.groups)
    for kind in kinds:
        save(comparison.plot(kind), folder, kind)
    for direction in isolated.structure.horizontal[1:]:
        kind = "time_histories"
        save(comparison.plot(kind, direction=direction), folder, f"{kind}_{direction}")
    save(structure_drawing(isolated), folder, "structure")


def save_diagnosis(diagnosis: Diagnosis, folder: Path, overwrite: bool) -> list[Path]:
    """Write report, JSON, text, figures and extended law to a folder; return the files."""
    with files_into(folder, overwrite) as place:
        written = _write_files(diagnosis, place)
    return [folder / path.relative_to(place) for path in written]


def _write_files(diagnosis: Diagnosis, folder: Path) -> list[Path]:
    texts = {"diagnosis.json": diagnosis.to_json() + "\n", "report.md": markdown(diagnosis)}
    section = ""
    if diagnosis.extended is not None:
        comment = f"{diagnosis.model}, extended by a diagnosis of {diagnosis.data}"
        law, *effects = device_places(diagnosis.extended)
        if diagnosis.ladder is not None and diagnosis.ladder.law_text:
            texts[LAW_FILE] = text_beside(diagnosis.ladder.law_text, folder)
            places = {law: f"{LAW_FILE}:LAW"} | copy_code(effects, folder)
        else:
            places = copy_code([law, *effects], folder)
        section = device_section(diagnosis.extended, comment, places=places)
        texts["extended_law.toml"] = section
    written = [diagnosis_report(diagnosis, section).write(folder / "report.html")]
    written += [write_text(text, folder / name) for name, text in texts.items()]
    errors = [
        {"run": each.name, "held_out": each.held_out,
         "error_before": relative_error(each, each.before),
         "error_after": relative_error(each, each.after)}
        for each in diagnosis.traces
    ]  # fmt: skip
    written.append(write_table(errors, folder / "errors.csv"))
    if diagnosis.causes:
        causes = [
            {"cause": each.name, "form": each.form, "place": each.place, "share": each.share,
             "p_value": each.p_value,
             **{f"{name}, {one.unit}": one.value for name, one in each.parameters.items()}}
            for each in diagnosis.causes
        ]  # fmt: skip
        written.append(write_table(causes, folder / "causes.csv"))
    if diagnosis.traces:
        for stem, draw in (
            ("loops", diagnosis_figures.overview),
            ("residuals", diagnosis_figures.residuals),
            ("errors", diagnosis_figures.errors_by_run),
        ):
            written += save(draw(diagnosis), folder, stem)
    written.append(save_archive(diagnosis, folder / FILE))
    written.append(write_contents(folder, f"Diagnosis of {diagnosis.data}"))
    return written


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
