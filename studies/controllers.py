"""All controllers: the share of the possible benefit that each achieves.

Every registered controller runs under El Centro and under random motions that no setting was tuned
on: as it should be, with noise, delay and a wrong nominal model, and on isolators that switch by
the passive rule. Score: J, the peak base displacement and the peak floor acceleration, each over
its value without current, added. The clairvoyant optimum bounds what is possible; the best constant
current must be beaten. Both know the motion.

The feedback laws were tuned on random motions of Kanai and Tajimi, ``mpc`` on those of Clough and
Penzien with seeds 300 to 399, its margin on 0 to 80. The evaluation uses seeds 200 to 219.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from controllers import Controller, available_controllers, controller
from controllers.clairvoyant import share_of_gap
from isolation_sim.scenario import Scenario
from isolation_sim.tuning.tuning import mean_interval
from isolation_sim.written_names import as_written

from . import controller_runs as runs
from .controller_runs import HOME, NOMINAL, PASSIVE, Evaluation, Rows, evaluate
from .study import EL_CENTRO, Outcome, Step, far_field, published_entry

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from ground_motions import Record

TITLE = "Controllers: the share of the possible benefit that each achieves"
FIRST_SEED, COUNT = 200, 20
"""Random motions."""
PREVIEW = 0.8
"""Warning time of the controller that has one, s."""
OBSERVING = {"filter": "extended", "learning": 20.0}
"""Settings of the predictive controller that estimates its state and learns."""
NOT_EVALUATED = ("clairvoyant", "constant", "prescribed")
"""The bound, and what has nothing to decide."""
SHORT = ("passive_off", "best_constant", "clipped_lqr", "on_off")


def candidates(short: bool) -> dict[str, Controller]:
    """Return the controllers to evaluate, by the name to print."""
    if short:
        return {name: controller(**published_entry(name)) for name in SHORT}
    names = [name for name in available_controllers() if name not in NOT_EVALUATED]
    predictive = {
        f"{name}{warned}": controller("mpc", preview=preview, **settings)
        for name, settings in (("mpc", {}), ("mpc, observing", OBSERVING))
        for preview, warned in ((0.0, ""), (PREVIEW, f", {PREVIEW:g} s preview"))
    }
    predictive[f"trained policy, {PREVIEW:g} s preview"] = controller(
        "trained_policy", preview=PREVIEW
    )
    return {name: controller(**published_entry(name)) for name in names} | predictive


def motions(short: bool) -> dict[str, Record]:
    """Return the ground motions by name; if short, 5 s of El Centro and of two random motions."""
    sections = {HOME: EL_CENTRO} | {
        f"random {seed}": far_field(seed)
        for seed in range(FIRST_SEED, FIRST_SEED + (2 if short else COUNT))
    }
    records = {}
    for name, section in sections.items():
        (record,) = Scenario.model_validate({"ground": section}).build().records
        records[name] = record.cut(0.0, 5.0) if short else record
    return records


def interval(differences: NDArray) -> tuple[float, float]:
    """95 % bounds of a mean over other such motions, by bootstrap."""
    return mean_interval(differences)[1:]


def ranking(result: Evaluation, case: str) -> Rows:
    """Rank the controllers in one case by their mean J over the random motions, the best first."""
    # Of each: medians of the peaks over all motions, mean J over the random ones and its excess
    # over the best constant current's with 95 % bounds; mean share of the clairvoyant gap closed,
    # with 95 % bounds, over the motions whose bound, which is that of the papers' rule, is known;
    # then medians of field work, mean squared current and time a decision, simulation included,
    # and the number of motions that it is not bounded under. None where a run diverged.
    every, random, solved = list(result.constants), result.random, result.solved
    table = []
    for name in result.candidates:

        def over(key: str, among: list[str], one: str = name) -> NDArray:
            return result.of(one, case, key, among)

        excess, low, high = _mean(over("J", random) - over("constant", random))
        row = {
            "case": case, "controller": name,
            "base_m": _known(np.median(over(runs.BASE, every)), 4),
            "floor_m_s2": _known(np.median(over(runs.FLOOR, every))),
            "J": _known(over("J", random).mean()), "excess": excess, "from": low, "to": high,
        }  # fmt: skip
        if HOME in every:
            row["El Centro"] = _known(over("J", [HOME])[0])
        if solved and case != PASSIVE:
            best = [result.possible[m]["J"] for m in solved]
            gaps = zip(over("J", solved), over("constant", solved), best, strict=True)
            shares = np.array([share_of_gap(*gap) for gap in gaps])
            row |= zip(("closed", "closed_from", "closed_to"), _mean(shares), strict=True)
        row |= {
            "field_J": _known(np.median(over("field_work_J", every)), 0),
            "A²": _known(np.median(over("mean_squared_current_A2", every))),
            "ms": _known(1e3 * np.median(over("time_a_decision_s", every)), 2),
            "unbounded": int(np.sum(over("bounded", every) == 0)),
        }
        table.append(row)
    return sorted(table, key=lambda row: np.inf if row["J"] is None else row["J"])


def _mean(values: NDArray) -> tuple[float | None, float | None, float | None]:
    """Mean over motions with its 95 % bounds; None where a run diverged."""
    if not np.isfinite(values).all():
        return None, None, None
    low, high = interval(values)
    return _known(values.mean()), _known(low), _known(high)


def _known(value: float, digits: int = 3) -> float | None:
    # adding 0 makes a negative zero a zero
    return round(float(value), digits) + 0.0 if np.isfinite(value) else None


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    n_bounds, workers = (0, 1) if short else (None, os.cpu_count() or 1)
    result = evaluate(candidates(short), motions(short), n_bounds, workers, step)
    table = [row for case in runs.CASES for row in ranking(result, case)]
    return Outcome(table, finding(result, table), {"pareto": figure(result)})


def finding(result: Evaluation, table: Rows) -> str:
    """Say what the ranking says."""
    by_case = {case: [row for row in table if row["case"] == case] for case in runs.CASES}
    better = {
        case: [row for row in rows if row["to"] is not None and row["to"] < 0]
        for case, rows in by_case.items()
    }
    sentences = [
        f"J is the mean over {len(result.random)} random motions that no setting was tuned on; "
        "intervals are 95 %, bootstrapped over the motions."
    ]
    for case, where in ((NOMINAL, "papers' switching"), (PASSIVE, "passive")):
        names = ", ".join(
            f"{as_written(row['controller'])} by {-row['excess']:.3f} "
            f"({-row['to']:.3f} to {-row['from']:.3f})"
            for row in better[case]
        )
        sentences.append(
            f"By the {where} rule J is surely less than the best constant current's, which knows "
            f"the motion, with {names or 'no controller'}."
        )
    if result.solved:
        sentences.append(_closed(result, by_case[NOMINAL]))
    missed = [motion for motion in result.possible if motion not in result.solved]
    if missed:
        sentences.append(
            f"No bound for {', '.join(missed)}: a controller is better than the local optimum "
            f"found, or engine and optimisation differ by more than {runs.CERTIFIED:g}."
        )
    for case in [case for case in runs.CASES if case not in (NOMINAL, PASSIVE)]:
        astray = [
            f"{as_written(row['controller'])} ({row['unbounded']})"
            for row in by_case[case]
            if row["unbounded"]
        ]
        sentences.append(
            f"With noise, 20 ms of delay and a {case} nominal model, not bounded, with how many "
            "motions: "
            f"{', '.join(astray) or 'none'}; surely better than constant: "
            f"{', '.join(as_written(row['controller']) for row in better[case]) or 'none'}."
        )
    return "\n".join(sentences)


def _closed(result: Evaluation, rows: Rows) -> str:
    """Say how much of what is possible ``mpc`` and the best controller achieve."""
    shares = [row for row in rows if row.get("closed") is not None]
    first = max(shares, key=lambda row: row["closed"])
    closed = ", ".join(
        f"{as_written(row['controller'])} {100 * row['closed']:.0f} %{_bounds(row)}"
        for row in shares
        if row is first or row["controller"] == "mpc"
    )
    bounds = [result.possible[motion] for motion in result.solved]
    scores = [one["J"] for one in bounds]
    return (
        f"Under {len(bounds)} motions the clairvoyant optimum has J {min(scores):.2f} to "
        f"{max(scores):.2f} (engine and optimisation differ by "
        f"{max(one['certified'] for one in bounds):.1e} at most); of the gap between the best "
        f"constant current and it, {closed}."
    )


def _bounds(row: dict[str, Any]) -> str:
    """Bounds of a share of the gap; a single motion has none."""
    if row["closed_from"] is None:
        return ""
    return f" ({100 * row['closed_from']:.0f} to {100 * row['closed_to']:.0f})"


def figure(result: Evaluation) -> Figure:
    """Draw base displacement against floor acceleration, nominal."""
    from isolation_sim.reports.style import DOUBLE_COLUMN, legend, new_figure, style

    with style():
        drawing = new_figure(DOUBLE_COLUMN, 4.2)
        panels = list(drawing.subplots(1, 2))
        for axes, among in zip(panels, ([HOME], result.random), strict=True):
            _draw(axes, result, among)
        panels[0].set_title(HOME)
        panels[1].set_title(f"mean of {len(result.random)} random motions")
        legend(drawing, panels[0], "outside lower center")
    return drawing


def _draw(axes: Axes, result: Evaluation, among: list[str]) -> None:
    from isolation_sim.reports.style import line_styles

    line = np.array([[(row["base"], row["floor"]) for row in result.constants[m]] for m in among])
    axes.plot(*line.mean(axis=0).T, color="0.45", linewidth=1.4, label="constant currents")
    looks = line_styles(len(result.candidates), markers=True)
    for k, (name, look) in enumerate(zip(result.candidates, looks, strict=True)):
        place = [result.of(name, NOMINAL, key, among).mean() for key in ("base", "floor")]
        axes.plot(
            *place, color=look["color"], marker=look["marker"], linestyle="", markersize=5.5,
            fillstyle=("full", "none", "left")[k // 7 % 3], label=name, zorder=3,
        )  # fmt: skip
    solved = [result.possible[m] for m in among if m in result.solved]
    if solved:
        place = [np.mean([one[key] for one in solved]) for key in ("base", "floor")]
        axes.plot(*place, "*", color="black", markersize=10, label="clairvoyant")
    axes.margins(0.08)
    axes.autoscale_view()
    axes.set_autoscale_on(False)
    for k, score in enumerate(np.arange(0.5, 6.0, 0.5)):
        axes.axline(
            (0.0, score), slope=-1.0, color="0.75", linewidth=0.6, linestyle=":", zorder=0,
            label=None if k else "equal J",
        )  # fmt: skip
    axes.grid(False)
    axes.set(xlabel="base displacement over off", ylabel="floor acceleration over off")
