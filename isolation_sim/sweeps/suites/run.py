"""Run all records of a suite with all controllers of a scenario."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from ground_motions.argument_types import checked

from ...errors import InputError
from ...io.files import write_text
from ...io.results_folder import check_free, file_name, is_results, removed_if_empty, write_contents
from ...scenario import Scenario
from ...workers import processors
from .prepare import INDEX, MOTIONS, prepare_of
from .result import SCENARIO, SWEEP, Suite

if TYPE_CHECKING:
    from ..run import Estimate

MOTION = "motion"
FILES = (SCENARIO, INDEX, MOTIONS, SWEEP)
"""Files and folders of a suite, finished or not."""


@checked
def run_suite(
    scenario: Scenario | str | Path,
    out: str | Path | None = None,
    *,
    resume: bool = False,
    workers: int | None = None,
    step: Callable[..., None] | None = None,
    announce: Callable[[Estimate], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Suite:
    """Run a scenario with a suite of records; finished runs are saved.

    Parameters
    ----------
    scenario : Scenario, str or pathlib.Path
        A scenario with a suite in ``[ground]``, or its file.
    out : str or pathlib.Path, optional
        Folder for the results; ``results/`` and the scenario's name by default.
    resume : bool, default False
        Whether to continue an interrupted suite in the folder.
    workers : int, optional
        Processes on this machine, for matching too; one per processor by default.
    step : callable, optional
        Called with the name of each step before the runs, and then with their number as ``total``.
    announce, progress
        As in `isolation_sim.sweep`.

    Returns
    -------
    Suite

    Raises
    ------
    InputError
        If the ground is no suite, a record cannot be used, or the folder contains other files.
    """
    from ..run import sweep

    if not isinstance(scenario, Scenario):
        scenario = Scenario.read(scenario)
    section = scenario.suite
    if section is None:
        raise InputError(
            f"{scenario.name}: [ground] is no suite of records; expected: folder, files or peer, "
            "or isolation-sim run for one motion"
        )
    processors(workers)  # refuses a wrong number before any file is written
    folder = Path("results") / file_name(scenario.name) if out is None else Path(out)
    if not resume:
        check_free(folder, resumable=is_results(folder))
    folder = folder.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    # marks the folder as results, even if the process is killed
    write_contents(folder, f"Suite {scenario.name}", FILES)
    step = step or (lambda text, total=None: None)
    step("building")
    with removed_if_empty(folder):
        index = prepare_of(scenario, section, folder, step, workers)
    write_text(scenario.to_toml(), folder / SCENARIO)
    grounds = [
        [{"kind": "record_file", "file": str(folder / file)} for file in motion["files"]]
        for motion in index["motions"]
    ]
    base = scenario.model_dump(mode="json") | {"ground": grounds[0]}
    names = [motion["name"] for motion in index["motions"]]
    plan = {
        "name": scenario.name,
        "scenario": base,
        "vary": [{"field": "ground", "label": MOTION, "values": grounds, "names": names}],
        "floors": section.floors,
    }
    step("running", total=len(names) * len(scenario.controller))
    sweep(
        plan, folder / SWEEP, resume=resume, workers=workers, announce=announce, progress=progress
    )
    suite = Suite(folder)
    suite.save()
    write_contents(folder, f"Suite {scenario.name}")
    return suite
