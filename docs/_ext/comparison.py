"""Runs the programs of the page that compares tools, and writes tables of their results."""

from __future__ import annotations

import runpy
import sys
import warnings
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from markdown import table

from studies.benchmarks.peers import load_opensees

PROGRAMS = Path(__file__).parents[1] / "examples" / "tools"
ABSENT = "*{} was not installed when this page was built: its column is missing.*\n"
QUANTITIES = {
    "base": ("peak base displacement, mm", 1e3),
    "drift": ("peak storey drift, mm", 1e3),
    "force": ("peak control device force, kN", 1e-3),
}
"""What both programs of the storey leave, with its heading and factor."""
STEPS = (1, 10, 40)
"""Steps per sample in OpenSees; the last number is the program's own."""


def write_tables(folder: Path) -> None:
    """Run the programs, and write a table of each task.

    Parameters
    ----------
    folder : pathlib.Path
        Where to.
    """
    (folder / "tools_storey.txt").write_text(storey_table(), encoding="utf-8")
    (folder / "tools_step.txt").write_text(step_table(), encoding="utf-8")


def storey() -> tuple[dict[str, Any], dict[int, dict[str, Any]]]:
    """Run the isolated storey here and in OpenSeesPy.

    Returns
    -------
    tuple
        What the program here leaves, and what that of OpenSeesPy leaves by the number of steps per
        sample, the program's own last; empty where OpenSeesPy does not load.
    """
    here = runpy.run_path(str(PROGRAMS / "storey_here.py"))
    there: dict[int, dict[str, Any]] = {}
    if load_opensees() is not None:
        text = (PROGRAMS / "storey_opensees.py").read_text(encoding="utf-8")
        for steps in STEPS:
            there[steps] = {}
            exec(text.replace(f"FINER = {STEPS[-1]} ", f"FINER = {steps} "), there[steps])
            assert there[steps]["FINER"] == steps
    return here, there


def step() -> tuple[dict[str, Any], dict[str, Any] | None]:
    """Take the decision here and in do-mpc.

    Returns
    -------
    tuple of dict
        What each program leaves; None where do-mpc is not installed.
    """
    sys.path.insert(0, str(PROGRAMS))
    try:
        here = vars(__import__("step_here"))
        if find_spec("do_mpc") is None:
            return here, None
        with warnings.catch_warnings():
            # it warns of every optional package that is not there
            warnings.simplefilter("ignore")
            return here, runpy.run_path(str(PROGRAMS / "step_do_mpc.py"))
    finally:
        sys.path.remove(str(PROGRAMS))


def difference(here: dict[str, Any], there: dict[str, Any], name: str) -> float:
    """Largest difference of a history over its peak.

    Parameters
    ----------
    here, there : dict
        What the programs leave.
    name : str
        Of the history.

    Returns
    -------
    float
    """
    return float(np.abs(here[name] - there[name]).max() / np.abs(here[name]).max())


def storey_table() -> str:
    """Peaks of the isolated storey in both programs, and the differences of the histories.

    Returns
    -------
    str
        MyST text.
    """
    here, there = storey()
    columns = {"isolation-sim": here}
    if there:
        columns["OpenSeesPy"] = there[STEPS[-1]]
    rows = [
        (heading, *(f"{factor * np.abs(one[name]).max():.3f}" for one in columns.values()))
        for name, (heading, factor) in QUANTITIES.items()
    ]
    peaks = table(("quantity", *columns), rows)
    if not there:
        return peaks + ABSENT.format("OpenSeesPy")
    rows = [
        (str(steps), *(f"{100 * difference(here, one, name):.2g} %" for name in QUANTITIES))
        for steps, one in there.items()
    ]
    headings = ("OpenSees steps per sample", *(heading.split(",")[0].removeprefix("peak ")
                                               for heading, _ in QUANTITIES.values()))  # fmt: skip
    return (
        peaks + "\nLargest difference of the histories over their peak:\n\n" + table(headings, rows)
    )


def step_table() -> str:
    """Commands of both programs at the decision.

    Returns
    -------
    str
        MyST text.
    """
    here, there = step()
    at, command = here["at"], here["command"]
    headings = ["command before", "command of isolation-sim"]
    row = [f"{command[at - 1]:.4f} A", f"{command[at]:.4f} A"]
    if there is None:
        return table(headings, [row]) + ABSENT.format("do-mpc")
    headings += ["command of do-mpc", "difference"]
    row += [f"{there['command']:.4f} A", f"{abs(there['command'] - command[at]):.1g} A"]
    return table(headings, [row])
