"""Common parts of the studies: running one, its results, and the motions that they use.

A study is a module with a ``TITLE`` and a function ``outcome(folder, short, step)``, which runs the
study and returns what it found; its docstring's first line says what it is about. Its name is an
entry point ``isolation_sim.studies``; a file of your own may be named by its path instead.
"""

from __future__ import annotations

import ast
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ground_motions.registry import code_files
from isolation_sim.errors import InputError
from isolation_sim.io.csv_table import write_table
from isolation_sim.io.files import write_text
from isolation_sim.io.results_folder import ResultsFolder, write_contents
from isolation_sim.registry import CONTROLLERS, STUDIES
from isolation_sim.reports.sweep_tables import Records, study_texts

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from isolation_sim.sweeps import Estimate, Sweep

Step = Callable[..., None]
"""``step(what, share)``: what is being done, and which share of the study has just been done."""

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
"""Measured data beside the checkout, unless ISOLATION_SIM_DATA says where they are."""

EL_CENTRO = {"name": "el_centro_1940_ns", "quiet_after_s": 5.0}
"""Ground section of the record that ships with the project."""

NEAR_FAULT = {
    "kind": "mavroeidis_papageorgiou_pulse", "peak_velocity_m_s": 0.6, "pulse_period_s": 2.0,
    "quiet_after_s": 15.0,
}  # fmt: skip
"""A near-fault pulse as long as the isolated building's period."""

PUBLISHED = "published"
"""Preset of controllers whose defaults are tuned."""

MOTIONS = {"El Centro": EL_CENTRO, "near-fault pulse": NEAR_FAULT}
"""The two, by the name to print."""


def data_folder(name: str) -> Path:
    """Find a folder of measured data."""
    folder = Path(os.environ.get("ISOLATION_SIM_DATA") or DATA) / name
    if not folder.is_dir():
        raise InputError(
            f"{folder}: no such folder of measured data; expected: ISOLATION_SIM_DATA set to the "
            f"folder that holds {name}"
        )
    return folder


def far_field(seed: int, soil: str = "medium", pga: float = 3.0) -> dict[str, Any]:
    """Ground section of a random motion with the spectrum of Clough and Penzien.

    Without their second filter it would have no end at long periods.
    """
    return {
        "kind": "clough_penzien", "soil": soil, "pga_m_s2": pga, "seed": seed,
        "quiet_after_s": 5.0,
    }  # fmt: skip


def along_motions(motions: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Axis of a plan: one motion after the other."""
    return {
        "field": "ground", "label": "motion", "names": list(motions),
        "values": list(motions.values()),
    }  # fmt: skip


def published_entry(name: str) -> dict[str, str]:
    """Controller entry of a scenario, with the published settings where defaults are tuned ones."""
    presets = getattr(CONTROLLERS[name], "presets", {})
    return {"name": name} | ({"preset": PUBLISHED} if PUBLISHED in presets else {})


@dataclass(frozen=True)
class Outcome:
    """What a study found."""

    table: Records  # A row per case; a heading ends in the SI unit; None where there is no value
    finding: str  # What the numbers say, a paragraph a line
    figures: dict[str, Figure]  # By file name


def perform(
    name: str,
    out: str | Path | None = None,
    short: bool = False,
    step: Step = lambda what, share=0.0: None,
    overwrite: bool = False,
) -> tuple[Outcome, Path]:
    """Run a study and write what it found."""
    from isolation_sim.reports.style import save

    from .report import study_report

    study = STUDIES[name]
    with ResultsFolder(out or default_folder(name), overwrite) as folder:
        step("preparing", 1.0)  # from -1, where the progress begins, to 0
        result: Outcome = study.outcome(folder.unfinished, short, step)
        write_table(result.table, folder.unfinished / "table.csv")
        code = code_files([name])
        paragraphs = [study.TITLE, result.finding]
        paragraphs += [f"code: {path}, SHA-256 {digest}" for path, digest in code.items()]
        write_text("\n\n".join(paragraphs) + "\n", folder.unfinished / "finding.txt")
        drawn = [
            save(figure, folder.unfinished / "figures", stem)
            for stem, figure in result.figures.items()
        ]
        study_report(
            study.TITLE, result.finding.splitlines(), {"Results": study_texts(result.table)},
            [svg for svg, _ in drawn], about(name),
            f"isolation-sim study {name}{' --short' * short}", code,
        ).write(folder.unfinished / "report.html")  # fmt: skip
        write_contents(folder.unfinished, study.TITLE)
    return result, folder.path


def default_folder(name: str) -> Path:
    """Return where a study's results go unless it is said."""
    return Path("results") / Path(name).stem


def about(name: str) -> str:
    """Return what a study is about: the first line of its docstring, read without running it."""
    place = STUDIES.place(name)
    if place.endswith(".py"):
        path: str | None = place
    else:
        spec = find_spec(place.partition(":")[0]) if place else None
        path = spec.origin if spec else None
    text = Path(path).read_text(encoding="utf-8") if path and Path(path).is_file() else ""
    said = (ast.get_docstring(ast.parse(text)) or "").partition("\n")[0]
    return said[:1].lower() + said[1:].rstrip(".")


def swept(plan: Mapping[str, Any], folder: Path, step: Step) -> Sweep:
    """Run a study's plan; every run must end well."""
    from isolation_sim.sweeps import sweep

    total = 1

    def announce(expected: Estimate) -> None:
        nonlocal total
        total = expected.n_runs

    def progress(done: int, failed: int) -> None:
        step("running", done / total)

    return sweep(dict(plan), folder / "sweep", announce=announce, progress=progress)
