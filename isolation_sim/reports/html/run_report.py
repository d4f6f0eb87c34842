"""The report of a comparison of controllers, and the files of its results."""

from __future__ import annotations

import platform
import tomllib
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ground_motions import STANDARD_GRAVITY

from ...archive import FILE, save_archive
from ...comparison import Comparison, json_report
from ...io.csv_table import write_table
from ...io.files import json_text, write_text
from ...io.results_folder import file_name, write_contents
from ...simulation.run import FIXED_BASE
from ...simulation.run_files import write_run
from ...version import __version__
from ...written_names import as_written
from ..chart import FIXED_BASE_LOOK
from ..drawing import drawing_title, structure_drawing
from ..references import of_runs
from ..style import save, svg_text
from ..tables import best_note, criteria_lines, ratios_note
from ..verdict import unknown_energies, verdict
from .animation import animation
from .charts import looks
from .page import (
    Block,
    Bullets,
    Facts,
    LineChoice,
    Listing,
    Page,
    Picture,
    Prose,
    Row,
    Section,
    Table,
    TimeRange,
    marked_row,
    table_note,
)
from .run_charts import energies, envelopes, loops, time_histories, trade_off


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


def run_report(comparison: Comparison, scenario: str = "") -> Page:
    """Report of a comparison: verdict, tables, charts, animation and inputs."""
    comparison = _in_words(comparison)
    runs = comparison.runs
    first = next(iter(runs.values()))
    look = looks(list(runs))
    left, right = _sides(comparison)
    key, ledgers = energies(runs)
    beside = {} if comparison.fixed_base is None else {FIXED_BASE: comparison.fixed_base}
    points = comparison.criteria | comparison.baseline
    warnings = (*comparison.failures(), *comparison.warnings())
    sections = [
        Section("Verdict", [
            *(trade_off(points, look, comparison.optima, beside) if len(points) > 1 else ()),
            Prose((*verdict(comparison), *unknown_energies(comparison.runs)), "verdict"),
            *([Prose(tuple(f"Warning: {each}." for each in warnings), "warning")]
              if warnings else []),
        ]),
        Section("Criteria", [criteria_table(comparison)]),
        Section("Animation", [animation(runs, left, right)]),
        Section("Time histories", [
            LineChoice(look | dict.fromkeys(beside, FIXED_BASE_LOOK), "Lines of all charts"),
            TimeRange(float(first.time[0]), float(first.time[-1])),
            *time_histories(runs, look),
        ]),
        Section("Isolator loops", [
            Prose(("Force over deformation of one isolator of each kind, of moat walls that are "
                   "touched, and of all elements at the base together; darker colours mean a "
                   "larger coil current.",)),
            *loops(runs),
        ]),
        Section("Floor envelopes", [envelopes(runs | beside, look)]),
        Section("Energy", [
            Prose(("The input energy of the ground plus the work of the magnetic field equals the "
                   "stored plus the dissipated energy. The closure error is the largest mismatch "
                   "over the peak input energy.",)),
            key, ledgers,
        ]),
        Section("Structure", [Picture(
            drawing_title(first.isolated),
            svg=svg_text(structure_drawing(first.isolated)),
        )]),
        Section("Inputs and versions", [*_inputs(comparison, scenario)]),
        Section("References", [Bullets(tuple(
            citation.line for citation in of_runs(runs)
        ))]),
    ]  # fmt: skip
    return Page(f"Isolation report: {comparison.title}", _subtitle(comparison), sections)


def _in_words(comparison: Comparison) -> Comparison:
    """The same runs, with controller names in words."""
    reference = comparison.reference
    result = Comparison(
        {as_written(name): run for name, run in comparison.runs.items()},
        None if reference is None else as_written(reference),
        {as_written(name): error for name, error in comparison.diverged.items()},
        comparison.fixed_base,
    )
    return result if len(result.runs) == len(comparison.runs) else comparison


def criteria_table(comparison: Comparison) -> Table:
    """Criteria and energies, one column per controller; the best of each row is marked."""
    baseline = comparison.baseline
    groups = criteria_lines(comparison.criteria, comparison.energy, baseline, comparison.optima)
    rows, marked = [], []
    for group, lines in groups.items():
        rows.append(Row(group))
        rows += [marked_row(label, cells) for label, cells in lines]
        marked += [cell for _, cells in lines for cell in cells]
    ratios = next(iter(comparison.criteria.values())) if "Benchmark" in groups else ()
    return Table(
        "Criteria and energies of each run, with units",
        ("Quantity", *comparison.runs, *baseline),
        tuple(rows),
        table_note(best_note(marked), ratios_note(ratios, comparison.reference)),
    )


def _sides(comparison: Comparison) -> tuple[str, str]:
    """Initial runs of the animation: uncontrolled, and the smallest base displacement."""
    values = comparison.criteria
    left = comparison.reference or next(iter(values))
    others = [name for name in values if name != left] or [left]
    return left, min(others, key=lambda name: values[name]["peak_base_displacement_m"])


def _subtitle(comparison: Comparison) -> str:
    first = next(iter(comparison.runs.values()))
    motion = ", ".join(
        f"{record.name}, peak {record.pga / STANDARD_GRAVITY:.3g} g, {record.duration:.3g} s"
        for record in first.records
    )
    count = len(comparison.runs)
    return f"{count} controller{'s' * (count > 1)}; ground motion {motion}"


def _inputs(comparison: Comparison, scenario: str) -> Iterator[Block]:
    first = next(iter(comparison.runs.values()))
    isolated, settings = first.isolated, tomllib.loads(scenario)
    facts = {}
    if "name" in settings:
        facts["Scenario"] = settings["name"]
    facts["Structure"] = (
        f"{isolated.structure.name}, {isolated.structure.n_dofs} degrees of freedom, "
        f"{1e-3 * isolated.structure.total_mass:.5g} t"
    )
    facts |= {key: value for key, value in isolated.facts().items() if key != "Mass"}
    facts["Ground motion"] = "; ".join(
        f"{record.name}: {record.source or 'no source given'}; {len(record)} points at "
        f"{record.dt:g} s, peak {record.pga:.4g} m/s²"
        for record in first.records
    )
    for element in isolated.elements:
        device = element.device
        own = device.name if device.name != device.law.name else ""
        parts = [f"{device.law.title} ({device.law.name})", device.source or own]
        if (device.length, device.force_scale) != (1.0, 1.0):
            parts.append(
                f"{device.length:.4g} times the tested device's deformation, "
                f"{device.force_scale:.4g} times its force"
            )
        facts[element.name.capitalize()] = "; ".join(part for part in parts if part)
    facts["Controllers"] = ", ".join(
        name if name == run.controller else f"{name} ({run.controller})"
        for name, run in comparison.runs.items()
    )
    seeds = [f"{where}.seed = {seed}" for where, seed in _seeds(settings)]
    facts["Random seeds"] = ", ".join(seeds) or "set by the Python program of the runs"
    facts["Versions"] = versions()
    yield Facts(facts)
    if scenario:
        yield Listing("The scenario file", scenario)


def code_facts(files: Mapping[str, str]) -> dict[str, str]:
    """The user's code files, with their SHA-256 digests."""
    text = "; ".join(f"{path}, SHA-256 {digest}" for path, digest in files.items())
    return {"Code": text} if text else {}


def versions() -> str:
    """Versions of the software."""
    packages = [f"{name} {version(name)}" for name in ("numpy", "scipy", "numba")]
    return ", ".join(
        [f"isolation-sim {__version__}", f"Python {platform.python_version()}", *packages]
    )


def _seeds(settings: dict[str, Any], where: str = "") -> Iterator[tuple[str, int]]:
    for key, value in settings.items():
        if key == "seed":
            yield where, value
        for number, part in enumerate(value if isinstance(value, list) else [value]):
            if isinstance(part, dict):
                place = f"{key}[{number}]" if isinstance(value, list) else key
                yield from _seeds(part, f"{where}.{place}".strip("."))
