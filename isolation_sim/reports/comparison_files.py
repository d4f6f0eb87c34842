"""Files of a comparison."""

from __future__ import annotations

from pathlib import Path

from ..archive import FILE, save_archive
from ..comparison import Comparison, json_report
from ..io.csv_table import write_table
from ..io.files import json_text, write_text
from ..io.results_folder import file_name, write_contents
from ..simulation.run_files import write_run
from .drawing import structure_drawing
from .style import save


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
    save(structure_drawing(isolated), folder, "structure")
