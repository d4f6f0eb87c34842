"""The test that would best tell rival explanations apart, computed from their own predictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ...identification.measured_runs import MeasuredRuns
from .effect_search import EffectSearch
from .model import FittedModel

DURATION = 12.0
"""s."""
_SAMPLING = 256.0


def next_test(
    final: FittedModel,
    search: EffectSearch,
    result: FittedModel,
    confusable: Mapping[str, Sequence[str]],
) -> str | None:
    """Propose the test that best tells the first confusable cause from its nearest rival."""
    if not confusable:
        return None
    cause, others = next(iter(confusable.items()))
    place = result.causes.index(cause)
    rivals = [f for f in search.rivals(result, place)[1] if f.causes[-1] == others[0]]
    if not rivals:
        return None
    best, words = 0.0, ""
    for test, description in _tests(final.model.data):
        forces = [
            replace(f.model, data=test).forces(f.values, False)[0] for f in (result, rivals[0])
        ]
        with np.errstate(over="ignore"):  # a law that diverges in this test
            difference = float(np.sqrt(np.mean((forces[0] - forces[1]) ** 2)))
        noise = float(np.median(final.model.data.force_noise)) or 1e-12
        if np.isfinite(difference) and difference / noise > best:
            best, words = difference / noise, description
    if not words:
        return None
    return (
        f"To distinguish {cause} from {others[0]}: {words}; their predictions differ there by "
        f"{best:.2g} times the force's noise (RMS)."
    )


def _tests(data: MeasuredRuns) -> list[tuple[MeasuredRuns, str]]:
    """Sinusoids within the tested ranges and a little beyond, at steady and at stepped current."""
    largest = float(np.max(np.abs(data.x)))
    low, high = float(data.current.min()), float(data.current.max())
    fastest = float(np.max(np.abs(data.v))) / largest / (2 * np.pi)
    result = []
    time = np.arange(0.0, DURATION, 1 / _SAMPLING)
    schedules = [(np.full(len(time), high), f"{high:.3g} A")]
    if high > low:
        schedules += [
            (np.full(len(time), low), f"{low:.3g} A"),
            (
                np.where((time // 2.0) % 2 == 0, low, high),
                f"the current stepping between {low:.3g} and {high:.3g} A every 2 s",
            ),
        ]
    parts = ((0.25, "small"), (1.0, "as large as before"), (1.3, "larger than before"))
    for (part, size), speed, (current, words) in product(parts, (0.25, 1.0, 3.0), schedules):
        frequency = max(speed * fastest, 0.05)
        omega = 2 * np.pi * frequency
        x = part * largest * np.sin(omega * time)
        test = replace(
            data,
            names=("next test",),
            starts=np.array([0, len(time)]),
            dt=np.array([1 / _SAMPLING]),
            x=x,
            v=part * largest * omega * np.cos(omega * time),
            a=-(omega**2) * x,
            force=np.ones_like(x),
            current=current.astype(float),
            temperature=np.full(len(time), float(np.mean(data.temperature))),
            fitted=np.ones(len(time), bool),
            force_noise=np.ones(1),
            displacement_noise=np.zeros(1),
            sigma=np.ones(1),
            velocity_measured=np.ones(1, bool),
        )
        result.append(
            (test, f"a sinusoid of {1e3 * part * largest:.3g} mm ({size}) at {frequency:.2g} Hz, "
                   f"{words}")
        )  # fmt: skip
    return result
