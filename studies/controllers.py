"""All controllers: how much of what is physically possible each achieves.

Every registered controller runs under El Centro and under random motions that no setting was tuned
on: as it should be, with noise, delay and a wrong belief, and on isolators that switch by the
passive rule. Score: J, the peak base displacement and the peak floor acceleration, each over its
value without current, added. What is possible is the clairvoyant optimum, what must be beaten the
best constant current; both know the motion.

Tuned were the feedback laws on random motions of Kanai and Tajimi, ``mpc`` on those of Clough and
Penzien with seeds 0 to 7 and 100 to 102, its margin on 0 to 80; judged is on seeds from 200 on.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from controllers import Controller, available_controllers, controller
from controllers.clairvoyant import share_of_gap
from isolation_sim.scenario import Scenario

from . import controller_runs as runs
from .study import EL_CENTRO, Outcome, Step, far_field

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from ground_motions import Record

TITLE = "Controllers: how much of what is possible each achieves"
FIRST_SEED, COUNT = 200, 20
"""Random motions."""
N_BOUNDS = 6
"""Motions for which the clairvoyant bound is solved, El Centro the first."""
PREVIEW = 0.8
"""Warning time of the controller that has one, s."""
CERTIFIED = 1e-3
"""Largest relative difference between engine and optimisation with which a bound counts."""
NOT_JUDGED = ("clairvoyant", "constant", "prescribed")
"""The bound, and what has nothing to decide."""
SHORT = ("passive_off", "best_constant", "clipped_lqr", "on_off")
NOMINAL, PASSIVE = "nominal", "passive"
HOME = "El Centro"

Rows = list[dict[str, Any]]


@dataclass(frozen=True)
class Judgement:
    """What all the runs gave.

    Attributes
    ----------
    rows : dict of (str, str) to list of dict
        By case and motion, as ``controller_runs.judged`` gives them.
    constants : dict of str to list of dict
        By motion, the constant currents.
    possible : dict of str to dict
        By motion, the clairvoyant bound, for some of them.
    """

    rows: dict[tuple[str, str], Rows]
    constants: dict[str, Rows]
    possible: dict[str, dict[str, Any]]

    def of(self, name: str, case: str, key: str, motions: Iterable[str]) -> NDArray:
        """One number of one controller in one case, a value a motion."""
        found = (self.rows[case, m] for m in motions)
        rows = [next(row for row in some if row["controller"] == name) for some in found]
        return np.array([row.get(key, np.nan) for row in rows])

    @property
    def entrants(self) -> list[str]:
        """Names of the controllers."""
        return [row["controller"] for row in next(iter(self.rows.values()))]

    @property
    def solved(self) -> list[str]:
        """Motions whose bound is certified and that no controller passes: local optima are left."""
        least = {
            motion: min(row["J"] for row in self.rows[NOMINAL, motion] if np.isfinite(row["J"]))
            for motion in self.possible
        }
        return [
            motion for motion, one in self.possible.items()
            if one["certified"] <= CERTIFIED and one["J"] <= least[motion]
        ]  # fmt: skip

    @property
    def random(self) -> list[str]:
        """Names of the motions that the ranking is by: all but El Centro."""
        return [motion for motion in self.constants if motion != HOME]


def entrants(short: bool) -> dict[str, Controller]:
    """Return the controllers to judge, by the name to print.

    Parameters
    ----------
    short : bool
        Whether to take few.

    Returns
    -------
    dict
        With all of the registry's that decide something, and ``mpc`` with a warning time.
    """
    if short:
        return {name: controller(name) for name in SHORT}
    names = [name for name in available_controllers() if name not in NOT_JUDGED]
    warned = {f"mpc, {PREVIEW:g} s preview": controller("mpc", preview=PREVIEW)}
    return {name: controller(name) for name in names} | warned


def motions(short: bool) -> dict[str, Record]:
    """Return the ground motions by name.

    Parameters
    ----------
    short : bool
        Whether to take 8 s of El Centro and of two random motions.

    Returns
    -------
    dict
    """
    sections = {HOME: EL_CENTRO} | {
        f"random {seed}": far_field(seed)
        for seed in range(FIRST_SEED, FIRST_SEED + (2 if short else COUNT))
    }
    records = {}
    for name, section in sections.items():
        (record,) = Scenario.model_validate({"ground": section}).build().records
        records[name] = record.cut(0.0, 8.0) if short else record
    return records


def judge(
    given: Mapping[str, Controller],
    records: Mapping[str, Record],
    n_bounds: int = N_BOUNDS,
    workers: int = 1,
    step: Step = lambda what, share=0.0: None,
) -> Judgement:
    """Run controllers under motions, in every case.

    Parameters
    ----------
    given : mapping of str to Controller
        By the name to print, any of one's own among them.
    records : mapping of str to Record
        Motions by name; the bound is solved for the first ones.
    n_bounds : int
        For how many.
    workers : int
        Processes; with one, everything runs in this process.
    step : callable
        Told the share of the work that has just been done.

    Returns
    -------
    Judgement
    """
    tasks: dict[tuple[str, str], runs.Task] = {}
    # what takes longest first, so that no process is left with it at the end
    for motion in list(records)[:n_bounds]:
        tasks["bound", motion] = runs.possible, (records[motion],)
    for motion, record in records.items():
        tasks["constants", motion] = runs.constants, (record,)
        for name, case in runs.CASES.items():
            tasks[name, motion] = runs.judged, (given, record, case)
    done = runs.in_processes(
        tasks, workers, lambda key: step(": ".join(key), 1 / len(tasks))
    )
    return Judgement(
        {(c, m): done[c, m] for c in runs.CASES for m in records},
        {m: done["constants", m] for m in records},
        {m: done["bound", m] for m in list(records)[:n_bounds]},
    )


def interval(differences: NDArray) -> tuple[float, float]:
    """95 % bounds of a mean, by drawing the motions anew.

    Parameters
    ----------
    differences : numpy.ndarray, shape (n_motions,)
        Finite, one a motion.

    Returns
    -------
    low, high : float
    """
    draw = np.random.default_rng(0)
    means = draw.choice(differences, (10_000, len(differences))).mean(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    return float(low), float(high)


def ranking(found: Judgement, case: str) -> Rows:
    """Rank the controllers in one case by their mean J over the random motions.

    Parameters
    ----------
    found : Judgement
        Of all controllers.
    case : str
        One of ``controller_runs.CASES``.

    Returns
    -------
    list of dict
        A row a controller, the best first: medians of the peaks over all motions, mean J over the
        random ones and its excess over the best constant current's with 95 % bounds, share of the
        clairvoyant gap closed where the bound, which is that of the papers' rule, is known; then
        medians of field work, mean squared current and time a decision, simulation included, and
        the number of motions that it is not bounded under. None where a run diverged.
    """
    every, random, solved = list(found.constants), found.random, found.solved
    table = []
    for name in found.entrants:

        def over(key: str, among: list[str], one: str = name) -> NDArray:
            return found.of(one, case, key, among)

        excess = over("J", random) - over("constant", random)
        known = bool(np.isfinite(over("J", every)).all())
        low, high = map(_known, interval(excess)) if known else (None, None)
        row = {
            "case": case, "controller": name,
            "base_m": _known(np.median(over(runs.BASE, every)), 4),
            "floor_m_s2": _known(np.median(over(runs.FLOOR, every))),
            "J": _known(over("J", random).mean()), "excess": _known(excess.mean()),
            "from": low, "to": high, "El Centro": _known(over("J", [HOME])[0]),
        }  # fmt: skip
        if solved and case != PASSIVE:
            best = np.mean([found.possible[m]["J"] for m in solved])
            scores, least = (over(key, solved).mean() for key in ("J", "constant"))
            row["closed"] = _known(share_of_gap(scores, least, best))
        row |= {
            "field_J": _known(np.median(over("field_work_J", every)), 0),
            "A²": _known(np.median(over("mean_squared_current_A2", every))),
            "ms": _known(1e3 * np.median(over("time_a_decision_s", every)), 2),
            "unbounded": int(np.sum(over("bounded", every) == 0)),
        }
        table.append(row)
    return sorted(table, key=lambda row: np.inf if row["J"] is None else row["J"])


def _known(value: float, digits: int = 3) -> float | None:
    return round(float(value), digits) if np.isfinite(value) else None


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study.

    Parameters
    ----------
    folder : pathlib.Path
        Not used: the runs are not kept.
    short : bool
        Whether to take four controllers, three motions of 8 s and no bound.
    step : callable
        Told what has just been done, and its share.

    Returns
    -------
    Outcome
        Table: the ranking in each case.
    """
    n_bounds, workers = (0, 1) if short else (N_BOUNDS, os.cpu_count() or 1)
    found = judge(entrants(short), motions(short), n_bounds, workers, step)
    table = [row for case in runs.CASES for row in ranking(found, case)]
    return Outcome(table, finding(found, table), {"pareto": figure(found)})


def finding(found: Judgement, table: Rows) -> str:
    """Say what the ranking says.

    Parameters
    ----------
    found : Judgement
        Of all controllers.
    table : list of dict
        Rankings, one case after another.

    Returns
    -------
    str
    """
    by_case = {case: [row for row in table if row["case"] == case] for case in runs.CASES}
    sentences = [
        f"J is the mean over {len(found.random)} random motions that no setting was tuned on; "
        "intervals are 95 %, by drawing the motions anew."
    ]
    for case in (NOMINAL, PASSIVE):
        better = [row for row in by_case[case] if row["to"] is not None and row["to"] < 0]
        told = ", ".join(
            f"{row['controller']} by {-row['excess']:.3f} ({-row['to']:.3f} to {-row['from']:.3f})"
            for row in better
        )
        where = "By the papers' switching rule" if case == NOMINAL else "By the passive rule"
        sentences.append(
            f"{where} J is surely less than the best constant current's, which knows the motion, "
            f"with {told or 'no controller'}."
        )
    if found.solved:
        shares = [row for row in by_case[NOMINAL] if row.get("closed") is not None]
        first = max(shares, key=lambda row: row["closed"])
        told = ", ".join(
            f"{row['controller']} {100 * row['closed']:.0f} %"
            for row in shares
            if row is first or row["controller"] == "mpc"
        )
        bounds = [found.possible[motion] for motion in found.solved]
        scores = np.array([one["J"] for one in bounds])
        worst = max(one["certified"] for one in bounds)
        sentences.append(
            f"Under {len(scores)} motions ({', '.join(found.solved)}) the clairvoyant optimum "
            f"has J {scores.min():.2f} to {scores.max():.2f} (engine and optimisation differ by "
            f"{worst:.1e} at most); of the gap between the best constant current and it, {told}."
        )
    missed = [motion for motion in found.possible if motion not in found.solved]
    if missed:
        sentences.append(
            f"No bound for {', '.join(missed)}: a controller is better than the local optimum "
            f"found, or engine and optimisation differ by more than {CERTIFIED:g}."
        )
    for name in [case for case in runs.CASES if case not in (NOMINAL, PASSIVE)]:
        astray = [
            f"{row['controller']} ({row['unbounded']})" for row in by_case[name] if row["unbounded"]
        ]
        still = [
            row["controller"] for row in by_case[name] if row["to"] is not None and row["to"] < 0
        ]
        sentences.append(
            f"With noise, 20 ms of delay and a {name} belief, not bounded, with how many motions: "
            f"{', '.join(astray) or 'none'}; surely better than constant: "
            f"{', '.join(still) or 'none'}."
        )
    return " ".join(sentences)


def figure(found: Judgement) -> Figure:
    """Draw base displacement against floor acceleration, nominal.

    Parameters
    ----------
    found : Judgement
        Of all controllers.

    Returns
    -------
    matplotlib.figure.Figure
        El Centro, and the means over the random motions, the bound's over those with one; both
        peaks over those without current, so that J is the same along a dotted line.
    """
    from isolation_sim.reports.style import DOUBLE_COLUMN, legend, new_figure, style

    with style():
        drawing = new_figure(DOUBLE_COLUMN, 4.2)
        panels = list(drawing.subplots(1, 2))
        for axes, among in zip(panels, ([HOME], found.random), strict=True):
            _draw(axes, found, among)
        panels[0].set_title(HOME)
        panels[1].set_title(f"mean of {len(found.random)} random motions")
        legend(drawing, panels[0], "outside lower center")
    return drawing


def _draw(axes: Axes, found: Judgement, among: list[str]) -> None:
    from isolation_sim.reports.style import line_styles

    line = np.array([[(row["base"], row["floor"]) for row in found.constants[m]] for m in among])
    axes.plot(*line.mean(axis=0).T, color="0.45", linewidth=1.4, label="constant currents")
    looks = line_styles(len(found.entrants), markers=True)
    for k, (name, look) in enumerate(zip(found.entrants, looks, strict=True)):
        place = [found.of(name, NOMINAL, key, among).mean() for key in ("base", "floor")]
        axes.plot(
            *place, color=look["color"], marker=look["marker"], linestyle="", markersize=5.5,
            fillstyle=("full", "none")[k // 7 % 2], label=name, zorder=3,
        )  # fmt: skip
    solved = [found.possible[m] for m in among if m in found.solved]
    if solved:
        place = [np.mean([one[key] for one in solved]) for key in ("base", "floor")]
        axes.plot(*place, "*", color="black", markersize=10, label="clairvoyant")
    axes.margins(0.08)
    axes.autoscale_view()
    axes.set_autoscale_on(False)
    for score in np.arange(0.5, 6.0, 0.5):
        axes.axline((0.0, score), slope=-1.0, color="0.75", linewidth=0.6, linestyle=":", zorder=0)
    axes.grid(False)
    axes.set(xlabel="base displacement over off", ylabel="floor acceleration over off")
