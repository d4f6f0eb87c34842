"""Limit of control without preview: near-fault pulses that are equal until they are cut.

A controller that measures the same gives the same commands. A long pulse, for which the highest
current is best, is cut at several moments: the ground velocity returns to zero at once, and no
current is best. The commands are optimised for all motions together, equal as long as the motions
are, each motion known from the moment at which it parts. The score is J, the peak base displacement
and the peak floor acceleration, each over its value without current, added, minus that of the best
constant current. The largest of them over the motions is minimised: no controller without preview
keeps all of them below it, as far as the local optimum is the global one.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from controllers import controller
from controllers.clairvoyant import Plant, causal_bound
from ground_motions import Record, mavroeidis_papageorgiou_pulse

from . import controller_runs as runs
from .cache import cached_result
from .controllers import PREVIEW
from .study import Outcome, Step

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

TITLE = "Limit of control without preview: pulses that are equal until they are cut"
STEP, DURATION = 0.02, 6.0
"""Sampling interval and length of the motions, s."""
PEAK_VELOCITY, PERIOD, CYCLES, BEFORE = 0.5, 4.5, 1.2, 0.2
"""Of the whole pulse: peak velocity, m/s; period, s; length in periods; rest before it, s."""
CUTS = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.2)
"""Times at which the pulse is cut, s."""
RETURN = 0.4
"""Time in which the ground velocity returns to zero after a cut, s."""
COMMAND = 0.04
"""Time from one command to the next, s."""
WHOLE = "whole pulse"

Rows = list[dict[str, Any]]


def motions(short: bool) -> dict[str, tuple[float, Record]]:
    """Return the time at which each motion parts from the first one, and the motion, by name."""
    pulse = mavroeidis_papageorgiou_pulse(
        PEAK_VELOCITY, PERIOD, CYCLES, 0.0, STEP, before=BEFORE, after=DURATION
    ).cut(0.0, 2.0 if short else DURATION)
    cuts = CUTS[2:3] if short else CUTS
    return {WHOLE: (0.0, pulse)} | {f"cut at {t:g} s": (t, cut(pulse, t)) for t in cuts}


def cut(pulse: Record, time: float) -> Record:
    """Let the ground velocity return to zero, along half a cosine."""
    acceleration, k = pulse.acceleration.copy(), round(time / pulse.dt)
    velocity = pulse.dt * (acceleration[:k] + acceleration[1 : k + 1]).sum() / 2
    since = np.arange(1, len(acceleration) - k) * pulse.dt
    rate = -velocity * np.pi / (2 * RETURN) * np.sin(np.pi * since / RETURN)
    acceleration[k + 1 :] = np.where(since < RETURN, rate, 0.0)
    return Record(acceleration, pulse.dt, name=f"{pulse.name}, cut at {time:g} s")


def limit(
    records_by_name: dict[str, tuple[float, Record]], constant: list[float], starts: int
) -> dict:
    """Optimise the commands of all motions together; the result is kept in the cache folder."""
    apart, records = zip(*records_by_name.values(), strict=True)

    def find() -> dict[str, Any]:
        plants = [Plant(runs.plant(), (record,), runs.DRIVER) for record in records]
        best = causal_bound(plants, apart, constant, COMMAND, starts)
        return {
            "J": [one.score for one in best], "difference": max(one.difference for one in best),
            "current": [one.current[:, 0].tolist() for one in best],
        }  # fmt: skip

    samples = np.concatenate([record.acceleration for record in records])
    content = np.concatenate([samples, apart, constant, [STEP, COMMAND, starts]]).tobytes()
    return cached_result("causal_limit", content, find)


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    records_by_name = motions(short)
    candidates = {
        "mpc": controller("mpc"), f"mpc, {PREVIEW:g} s preview": controller("mpc", preview=PREVIEW),
    }  # fmt: skip
    rows: Rows = []
    for name, (apart, record) in records_by_name.items():
        constants = runs.constants(record)
        best = min(constants, key=lambda row: row["J"])
        row = {"motion": name, "parts_at_s": apart} | {
            "best_constant_A": runs.CONSTANTS[constants.index(best)], "J_of_constant": best["J"],
        }  # fmt: skip
        for own in runs.run_candidates(candidates, record, runs.Case()):
            row["J_of_constant"] = min(row["J_of_constant"], own["constant"])
            row[own["controller"]] = own["J"]
        rows.append(row)
        step(name, 0.2 / len(records_by_name))
    optimum = limit(records_by_name, [row["J_of_constant"] for row in rows], 1 if short else 2)
    step("commands", 0.8)
    for row, J in zip(rows, optimum["J"], strict=True):
        for one in candidates:
            row[one] -= row["J_of_constant"]
        row["limit"] = J - row["J_of_constant"]
    table = [
        {key: round(value, 3) if isinstance(value, float) else value for key, value in row.items()}
        for row in rows
    ]
    currents = [np.array(one) for one in optimum["current"]]
    return Outcome(
        table,
        finding(table, optimum["difference"]),
        {"causal_limit": figure(records_by_name, currents)},
    )


def finding(rows: Rows, difference: float) -> str:
    """Describe the results of the table."""
    worst = max(row["limit"] for row in rows)
    others = "; ".join(
        f"{name}: mean {np.mean([row[name] for row in rows]):+.2f}, "
        f"worst {max(row[name] for row in rows):+.2f}"
        for name in rows[0]
        if name.startswith("mpc")
    )
    return (
        f"{len(rows)} motions are equal until they part. J minus the J of the best constant "
        "current: with commands that are equal as long as the motions are, its largest value over "
        f"the motions is {worst:+.2f} at least, as far as the local optimum is the global one. The "
        f"engine's peaks agree within {100 * difference:.1g} %. {others}."
    )


def figure(records_by_name: dict[str, tuple[float, Record]], currents: list[NDArray]) -> Figure:
    """Draw the ground velocities, and the commands of the optimum."""
    from isolation_sim.reports.style import DOUBLE_COLUMN, legend, line_styles, new_figure, style

    with style():
        drawing = new_figure(DOUBLE_COLUMN, 3.0)
        ground, command = drawing.subplots(1, 2)
        looks = line_styles(len(records_by_name))
        for (name, (_, record)), current, look in zip(
            records_by_name.items(), currents, looks, strict=True
        ):
            time = np.arange(len(record)) * record.dt
            velocity = np.cumsum(record.acceleration) * record.dt
            ground.plot(time, velocity, label=name, **look)
            command.step(np.arange(len(current)) * COMMAND, current, where="post", **look)
        ground.set(xlabel="time, s", ylabel="ground velocity, m/s")
        command.set(xlabel="time, s", ylabel="command, A")
        legend(drawing, ground, "outside lower center")
    return drawing
