"""Tune a controller on some motions and evaluate it on other motions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked
from ground_motions.registry import code_files, package_code

from ..errors import InputError, check_name
from ..io.results_folder import write_contents
from ..registry import CONTROLLERS, controller
from ..scenario import Scenario
from ..scenario.job import Job
from ..search_range import SearchRange
from ..validation import names_in
from ..version import __version__
from ..workers import Processes, processors
from .candidate_runs import Candidate
from .motions import MIXTURE, Motions, MotionSet, motion_set
from .search import Settings, Trial, search
from .trials import CRITERIA, Trials
from .tuning import Evaluation, Tuning, begin, check_place

EVALUATIONS = 400
_PROFILE = 7
"""Number of values of a setting, over its range, for its sensitivity."""


@checked
def tune(
    name: Annotated[
        str,
        "a name, a place such as my_controllers.py:Outwards, or the name of a class after "
        'iso.register("controller", Outwards)',
    ],
    scenario: Scenario | str | Path | None = None,
    *,
    motions: Motions = MIXTURE,
    unseen: Motions | Mapping[str, Motions] = MIXTURE,
    criteria: Mapping[str, float] | None = None,
    settings: Sequence[str] | None = None,
    fixed: Mapping[str, Any] | None = None,
    evaluations: int = EVALUATIONS,
    seed: int = 0,
    pga_g: float | None = None,
    out: str | Path | None = None,
    resume: bool = False,
    workers: int | None = None,
    progress: Callable[[str, int], None] | None = None,
) -> Tuning:
    """Find the best settings of a controller on some motions, and evaluate them on other motions.

    The score of a run is J minus the smallest J of any constant current on the same motion. J is
    the weighted sum of the criteria, each over its value without current. CMA-ES minimises the mean
    score over the motions within the search ranges of the controller.

    Parameters
    ----------
    name : str
        Name of a controller, a place such as ``"my_controllers.py:Outwards"``, or the name of a
        class of your own after ``isolation_sim.register("controller", Outwards)``.
    scenario : Scenario, str or pathlib.Path, optional
        Plant, nominal model, sensors and driver; the main job's by default. Its controllers are not
        used. Its ground motion is used only with ``"scenario"`` as motions.
    motions : str, pathlib.Path, Record or sequence of Record, default "mixture"
        Motions for tuning: ``"mixture"``, or ``"mixture:40"`` for another number of motions;
        ``"scenario"``; a folder of records; a record; or records, each one per direction.
    unseen : as ``motions``, or a mapping of names to motions
        Motions for evaluation. A mixture has another seed than that of ``motions``.
    criteria : mapping of str to float, optional
        Weights by criterion; 1 for the peaks of base displacement and floor acceleration by
        default.
    settings : sequence of str, optional
        Settings to tune; all with a search range by default.
    fixed : mapping of str to object, optional
        Constant settings by name, if not at their defaults.
    evaluations : int, default 400
        Largest number of candidates, each run on all motions.
    seed : int, default 0
        Random seed of the search, the mixtures and the intervals.
    pga_g : float, optional
        Peak ground acceleration of a folder's motions after scaling, g.
    out : str or pathlib.Path, optional
        Folder for the results: the state after every generation, then scenario section and report.
        None keeps nothing.
    resume : bool, default False
        Whether to continue an interrupted tuning in ``out``.
    workers : int, optional
        Threads for compiled decisions, processes for those in plain Python; as many as there are
        processors by default.
    progress : callable, optional
        Called with the present step and the number of candidates run since the last call.

    Returns
    -------
    Tuning

    Raises
    ------
    InputError
        If an argument cannot be used, the initial controller fails on every motion, or the folder
        contains another tuning.

    Notes
    -----
    Compiled controllers run in parallel vector lanes on several threads. Controllers in plain
    Python run in several processes, unless they are registered only in this process.
    """
    progress = progress or (lambda what, done: None)
    check_place(out, resume)
    scenario_file = scenario
    if not isinstance(scenario, Scenario):
        scenario = Scenario() if scenario is None else Scenario.read(scenario)
    job, held = scenario.build(), dict(fixed or {})
    weights = dict(CRITERIA if criteria is None else criteria)
    _check(weights, evaluations, seed, workers)
    ranges, present = search_space(name, settings, held)
    groups = unseen if isinstance(unseen, Mapping) else {"": unseen}
    sets = _motion_sets(motions, groups, job, seed, pga_g)
    tuned_on = next(iter(sets.values()))
    used = [name, *names_in(scenario.model_dump(mode="json"))]
    declared = CONTROLLERS[name].settings  # type: ignore[attr-defined]
    tuning = begin(out, {
        "isolation_sim": __version__,
        "command": _command(name, scenario_file, motions, groups, weights, settings, held,
                            evaluations, seed, pga_g), "controller": name, "fixed": held,
        "scenario": scenario.to_toml(), "criteria": weights, "evaluations": evaluations,
        "seed": seed, "motions": {key: each.digest for key, each in sets.items()},
        "settings": {
            key: asdict(one) | {"present": present[key], "unit": declared[key].unit,
                                "meaning": declared[key].meaning}
            for key, one in ranges.items()
        },
        "code": code_files([name]) | package_code(used),
    }, resume)  # fmt: skip
    progress("constant currents", 0)
    with Processes(processors(workers)) as processes:
        trials = Trials(scenario, tuned_on, weights, processes)
        _ = trials.constant  # refuses what cannot be tuned, before there is a folder
        if out is not None:
            tuning.save_state(out)
            # marks the folder as results, even if the search is killed
            write_contents(Path(out), f"Tuning of {tuning.controller}")

        def evaluate(candidates: Sequence[Settings], on: Trials = trials) -> NDArray:
            return on.scores([Candidate(name, held | each) for each in candidates])

        def save(result: list[Trial]) -> None:
            progress("searching", len(result) - len(tuning.trials))
            tuning.trials = list(result)
            if out is not None:
                tuning.save_state(out)

        progress("searching", len(tuning.trials))
        tuning.trials = search(ranges, present, evaluate, evaluations, seed, tuning.trials, save)
        best = tuning.best.settings
        progress("sensitivity", 0)
        for key, one in ranges.items():
            values = [one.value(place) for place in np.linspace(0, 1, _PROFILE)]
            scores = evaluate([best | {key: value} for value in values]).mean(axis=1)
            tuning.sensitivity[key] = values, scores.tolist()
        progress("evaluating", 0)
        for key, group in sets.items():
            on = trials if group is tuned_on else Trials(scenario, group, weights, processes)
            before, after = evaluate([{}, best], on).tolist()
            current, constant = (values.tolist() for values in on.constant)
            tuning.outcomes.append(Evaluation(key, group.names, current, constant, before, after))
    if out is not None:
        tuning.save(out, overwrite=True)
    return tuning


def _motion_sets(
    motions: Motions, unseen: Mapping[str, Motions], job: Job, seed: int, pga_g: float | None
) -> dict[str, MotionSet]:
    """The motions to tune on, then the unseen ones, by the names to print."""
    tuned_on = motion_set(motions, job, 2 * seed, pga_g)
    sets = {tuned_on.name: tuned_on}
    for key, each in unseen.items():
        group = motion_set(each, job, 2 * seed + 1, pga_g)
        if group.digest == tuned_on.digest:
            raise InputError(f"unseen motions, {key or group.name}", "those tuned on", "others")
        # the command line names each set by its source
        drawn = key == str(each) and key.startswith(MIXTURE)
        sets[f"unseen: {group.name if drawn or not key else key}"] = group
    return sets


def search_space(
    name: str, target: Sequence[str] | None, held: Mapping[str, Any]
) -> tuple[dict[str, SearchRange], dict[str, Any]]:
    """Search ranges of a controller's settings, and their present values."""
    one = controller(name, **held)
    ranges = {
        key: declared.search
        for key, declared in getattr(one, "settings", {}).items()
        if getattr(declared, "search", None) is not None
    }
    if not ranges:
        raise InputError(
            f"{name}: no setting has a search range; expected: a controller that declares one, as "
            "setting(default, meaning, accepts, unit, SearchRange(low, high))"
        )
    for key in target or ():
        check_name(f"setting of {name} with a search range", key, ranges)
    chosen = [key for key in ranges if (not target or key in target) and key not in held]
    if not chosen:
        raise InputError(f"{name}: all settings are fixed; expected: one or more to tune")
    return {key: ranges[key] for key in chosen}, {key: getattr(one, key) for key in chosen}


def _command(
    name: str, scenario: Any, motions: Motions, unseen: Mapping[str, Motions],
    criteria: Mapping[str, float], settings: Sequence[str] | None, held: Mapping[str, Any],
    evaluations: int, seed: int, pga_g: float | None,
) -> str:  # fmt: skip
    """The command of this tuning; Python objects are in angle brackets."""
    words = ["isolation-sim tune", name]
    if scenario is not None:
        words.append(f"--scenario {scenario if isinstance(scenario, str | Path) else '<scenario>'}")
    for option, each in (("motions", motions), *(("unseen", one) for one in unseen.values())):
        words.append(f"--{option} {each if isinstance(each, str | Path) else '<records>'}")
    if criteria != CRITERIA:
        words += [f"--criterion {key}={weight:g}" for key, weight in criteria.items()]
    words += [f"--setting {key}" for key in settings or ()]
    words += [f"--fix {key}={value}" for key, value in held.items()]
    words += [] if pga_g is None else [f"--pga-g {pga_g:g}"]
    return " ".join([*words, f"--evaluations {evaluations} --seed {seed}"])


def _check(criteria: Mapping[str, float], evaluations: int, seed: int, workers: int | None) -> None:
    """Check the numbers among the arguments."""
    if not criteria or not all(0 < weight < np.inf for weight in criteria.values()):
        raise InputError("criteria", repr(dict(criteria)), "finite weights above 0 by criterion")
    count = 1 if workers is None else workers
    least_values = ("evaluations", evaluations, 1), ("seed", seed, 0), ("workers", count, 1)
    for what, value, least in least_values:
        if value != int(value) or value < least:
            raise InputError(what, repr(value), f"a whole number, {least} or more")
