"""The tests that would best tell rival causes apart, computed from their own predictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...identification.current_basis import tested_currents
from ...identification.measured_runs import MeasuredRuns
from ..decisions import BEYOND_TESTED
from ..planned_tests import PlannedTest
from .effect_search import EffectSearch
from .model import FittedModel

DURATION, REST = 12.0, 60.0
"""Of a test, and of a rest between two equal parts of it, s."""
_STEP = 2.0
"""Time between steps of the current, s."""
_NO_CURRENT = 1e-3
"""Current below which it is noise of its sensor, A. Convention."""
_SAMPLING = 256.0
_AT_REST = 0.9
"""Share of a test in motion below which it has a rest."""


def rival_tests(
    final: FittedModel,
    search: EffectSearch,
    result: FittedModel,
    confusable: Mapping[str, Sequence[str]],
) -> tuple[PlannedTest, ...]:
    """Find for each confusable cause and its rivals the test in which they differ most."""
    rivals = {}
    for cause, others in confusable.items():
        fitted = search.rivals(result, result.causes.index(cause))[1]
        for other in others:
            first = next((f for f in fitted if f.causes[-1] == other), None)
            if first is not None and (other, cause) not in rivals:
                rivals[cause, other] = first
    data = final.model.data
    noise = float(np.median(data.force_noise)) or 1e-12
    best: dict[tuple[str, str], tuple[float, MeasuredRuns, str]] = {}
    for test, words in _tests(data) if rivals else ():
        if not _within(data, test):
            continue
        force = _force(result, test)
        moves = test.v != 0
        for pair, rival in rivals.items():
            forces = [force, _force(rival, test)]
            if not np.max(np.abs(forces)) <= BEYOND_TESTED * np.max(np.abs(data.force)):
                continue  # a law that diverges, or a force that the rig may not reach
            differ = float(np.sqrt(np.mean((forces[0] - forces[1])[moves] ** 2))) / noise
            if differ > best.get(pair, (0.0,))[0]:
                best[pair] = differ, test, words
    rate = float(np.median(1 / data.dt))
    return tuple(_planned(pair, *best[pair], rate) for pair in rivals if pair in best)


def _planned(
    pair: tuple[str, str], differ: float, test: MeasuredRuns, words: str, rate: float
) -> PlannedTest:
    amplitude, moves = float(np.max(np.abs(test.x))), test.v != 0
    currents = tuple(np.unique(test.current).tolist())
    return PlannedTest(
        amplitude, float(np.max(np.abs(test.v))) / (2 * np.pi * amplitude), currents,
        float(moves.sum()) / _SAMPLING, rate, f"tells {pair[0]} from {pair[1]}",
        step=_STEP if len(currents) > 1 else 0.0, rest=REST if moves.mean() < _AT_REST else 0.0,
        tells=pair, difference=differ, words=words,
    )  # fmt: skip


def _within(data: MeasuredRuns, test: MeasuredRuns) -> bool:
    """Whether a test is little faster than those that were made."""
    return all(
        np.max(np.abs(new)) <= BEYOND_TESTED * np.max(np.abs(old))
        for new, old in ((test.v, data.v), (test.a, data.a))
    )


def _force(fitted: FittedModel, test: MeasuredRuns) -> NDArray:
    """Force in a test, with as many steps as any run takes."""
    data = fitted.model.data
    model = replace(fitted.model, data=test.with_steps(data.n_steps.max(), bool(data.stiff.any())))
    return model.forces(fitted.values, False)[0]


def _tests(data: MeasuredRuns) -> list[tuple[MeasuredRuns, str]]:
    """Sinusoids within the tested ranges and a little beyond, at steady and at stepped current."""
    # One has a rest between two equal parts: heat goes, wear and remanence stay.
    largest = float(np.max(np.abs(data.x)))
    levels = tested_currents([data.current[run] for run in data.runs])
    low, high = (0.0 if abs(one) < _NO_CURRENT else float(one) for one in levels[[0, -1]])
    fastest = float(np.max(np.abs(data.v))) / largest / (2 * np.pi)
    time = np.arange(0.0, DURATION, 1 / _SAMPLING)
    schedules = [(np.full(len(time), high), f"{high:.3g} A")]
    if high > low:
        schedules += [
            (np.full(len(time), low), f"{low:.3g} A"),
            (
                np.where((time // _STEP) % 2 == 0, low, high),
                f"the current stepping between {low:.3g} and {high:.3g} A every {_STEP:g} s",
            ),
        ]
    result = []
    parts = ((0.25, "small"), (1.0, "as large as before"), (1.3, "larger than before"))
    for (part, size), speed, (current, words) in product(parts, (0.25, 1.0, 3.0), schedules):
        frequency = max(speed * fastest, 0.05)
        test = _sinusoid(data, part * largest, frequency, time, current)
        result.append((test, f"{_words(part * largest, size, frequency)}, {words}"))
    frequency = max(fastest, 0.05)
    again = max(round(DURATION * frequency), 1) / frequency + REST
    twice = np.arange(0.0, 2 * again - REST, 1 / _SAMPLING)
    test = _sinusoid(data, largest, frequency, np.where(twice < again, twice, twice - again), high)
    moves = (twice < again - REST) | (twice >= again)
    test = replace(test, x=test.x * moves, v=test.v * moves, a=test.a * moves)
    words = f"{schedules[0][1]}, and the same again after {REST:g} s of rest"
    return [*result, (test, f"{_words(largest, parts[1][1], frequency)}, {words}")]


def _words(amplitude: float, size: str, frequency: float) -> str:
    return f"a sinusoid of {1e3 * amplitude:.3g} mm ({size}) at {frequency:.2g} Hz"


def _sinusoid(
    data: MeasuredRuns, amplitude: float, frequency: float, time: NDArray, current: NDArray | float
) -> MeasuredRuns:
    omega = 2 * np.pi * frequency
    x = amplitude * np.sin(omega * time)
    return replace(
        data,
        names=("next test",),
        starts=np.array([0, len(time)]),
        dt=np.array([1 / _SAMPLING]),
        x=x,
        v=amplitude * omega * np.cos(omega * time),
        a=-(omega**2) * x,
        force=np.ones_like(x),
        current=np.broadcast_to(np.asarray(current, float), x.shape).copy(),
        temperature=np.full(len(time), float(np.mean(data.temperature))),
        fitted=np.ones(len(time), bool),
        beside_jump=np.zeros(len(time), bool),
        clipped=np.zeros(len(time), bool),
        force_noise=np.ones(1),
        force_corner=np.full(1, np.inf),
        displacement_noise=np.zeros(1),
        sigma=np.ones(1),
        velocity_noise=np.zeros(1),
        averaging=np.zeros(1),
        periods=np.zeros(1),
        return_times=np.zeros((1, 1)),
        n_steps=np.ones(1, np.int64),
        stiff=np.zeros(1, bool),
        past=None,  # on a device that has rested
    )
