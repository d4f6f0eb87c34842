"""An effect along measured runs: its functions, compiled once whatever law they stand around.

Motion, current and force of a test are known at every sample, so that an effect can be evaluated
by itself, one after another, before or after the law. Without states that is NumPy's work. States
take one compiled Rosenbrock step a sample (two stages, second order, L-stable), since an effect's
lag may be far shorter than a sample.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...effects import Effect, Signals
from ...identification.measured.run_table import TestRun
from ...identification.measured_runs import MeasuredRuns, measured_runs
from .carried_history import (
    Weakened,
    WeakenedSlopes,
    after_rests,
    by_inputs,
    first_states,
    has_unknown_starts,
)
from .effect_kernel_text import HOOKS, compiled
from .late_motion import late_motion

_STEPS_TO_START = 3
"""Steps to the unknown state at the start of a run. Convergence: the last one changes it by 2 %."""
_LARGE = 0.5
"""Share of its largest value from which a part of the force tells what is left of it."""


def evaluate(
    effect: Effect,
    data: MeasuredRuns,
    force: NDArray,
    parameters: NDArray,
    motion: tuple[NDArray, NDArray] | None = None,
    current: NDArray | None = None,
) -> dict[str, Any]:
    """Evaluate an effect along runs, under the law's ``force`` (N)."""
    # ``motion`` (m, m/s) and ``current`` (A) may take the place of the measured ones. Returned are,
    # by function, "motion" (2, n_samples), "current", "factor" and "force" (n_samples,).
    x, v = (data.x, data.v) if motion is None else motion
    if effect.delay is not None:
        late = float(effect.delay(tuple(parameters)))
        longest = max(max(abs(q.lower), abs(q.upper)) for q in effect.parameters if q.unit == "s")
        return {"motion": late_motion(data, x, v, late, longest)}
    current = data.current if current is None else current
    signals = Signals(x, v, data.a, current, force, data.temperature)
    if not effect.states:
        return _at_once(effect, signals, tuple(parameters))
    return _Runs(effect, data, signals, parameters).evaluate()


def time_scales(effect: Effect, data: MeasuredRuns, parameters: NDArray) -> NDArray:
    """Factors of the law's times in each run, (n_runs,): means of an effect's, without states."""
    signals = Signals(data.x, data.v, data.a, data.current, 0.0, data.temperature)
    assert effect.time_scale is not None
    every = effect.time_scale(signals, (), tuple(parameters)) + np.zeros_like(data.x)
    return np.add.reduceat(every, data.starts[:-1]) / data.lengths


def differentiate(
    effect: Effect, data: MeasuredRuns, force: NDArray, parameters: NDArray, by_force: NDArray,
    own: int, motion: tuple[NDArray, NDArray] | None = None,
) -> tuple[dict[str, Any], dict[str, NDArray]]:  # fmt: skip
    """Evaluate an effect that follows the law's ``force`` (N), and its derivatives.

    Of the directions of ``by_force``, the force's own derivatives, (n_samples, n_directions), those
    from ``own`` on are the effect's parameters.
    """
    x, v = (data.x, data.v) if motion is None else motion
    signals = Signals(x, v, data.a, data.current, force, data.temperature)
    return _Runs(effect, data, signals, parameters).differentiate(by_force, own)


class _Runs:
    """An effect along runs, through its compiled functions."""

    def __init__(
        self, effect: Effect, data: MeasuredRuns, signals: Signals, parameters: NDArray
    ) -> None:
        self.effect, self.data, self.signals = effect, data, signals
        self.parameters = np.ascontiguousarray(parameters, float)
        # a slow effect begins at the first sample: before it the device may have rested for long
        motion = data.motion
        if signals.x is not data.x:
            motion = replace(motion, displacement=signals.x)
        self.runs = motion.runs_at_rest if effect.gradual else motion.runs
        self.rows = [name for name in HOOKS for _ in range(_width(effect, name))]
        self.out = np.empty((len(self.rows), len(signals.x)))

    def evaluate(self) -> dict[str, Any]:
        first, _ = self._fresh()

        def follow(first: NDArray, slope: NDArray | None) -> NDArray | None:
            state = np.zeros(len(self.effect.states))
            compiled(self.effect).trajectory(
                self.runs, self.signals, self.parameters, first, state, self.out
            )
            return None

        self._from_start(first, None, follow)
        return self._by_function(self.out)

    def differentiate(
        self, by_force: NDArray, own: int
    ) -> tuple[dict[str, Any], dict[str, NDArray]]:
        n, n_own, n_directions = len(self.effect.states), len(self.parameters), by_force.shape[1]
        by_out = np.empty((len(self.rows), *by_force.shape))
        state, new_slope = np.zeros(n), np.empty((n, n_directions))
        by = np.empty((max(n, len(self.rows)), n + n_own + 2))

        def follow(first: NDArray, slope: NDArray | None) -> NDArray | None:
            assert slope is not None
            compiled(self.effect).trajectory_with_slopes(
                self.runs, self.signals, self.parameters, first, state, self.out, by_force, own,
                slope.copy(), new_slope, by, by_out,
            )  # fmt: skip
            return by_out

        first, by_signals = self._fresh()
        slope = np.zeros((*first.shape, n_directions))
        for run, (of_force, of_own) in enumerate(by_signals):
            slope[run] = of_force * by_force[self._at(run)]
            slope[run, :, own : own + n_own] += of_own
        self._from_start(first, (by_force, slope, own), follow)
        return self._by_function(self.out), self._by_function(by_out)

    def _from_start(
        self, first: NDArray, by: tuple[NDArray, Any, int] | None, follow: Callable[..., Any]
    ) -> None:
        """Follow each run from the states that the runs before have left, from fresh ones."""
        effect, data, p = self.effect, self.data, self.parameters
        slope: Any
        slope, own = (None, 0) if by is None else by[1:]
        if has_unknown_starts(effect) and data.past is not None:
            for _ in range(_STEPS_TO_START):
                by_out = follow(first, slope)
                now, known = self._weakened(), None
                if by is not None:
                    known = WeakenedSlopes(
                        *self._weakened_slopes(now, by[0], by_out, own), slope, own
                    )
                first, slope = after_rests(effect, data, now, first, p, known)
        else:
            first, slope = first_states(effect, data, first, p, slope, own)
        follow(first, slope)

    def _weakened(self) -> Weakened:
        """The law's force with an effect that weakens it, or a part of it."""
        law = self.signals.force
        if self.effect.spared is None:
            left = self.out[self.rows.index("factor")]
            return Weakened(law * left, law * left, left)
        spared = self.effect.spared(self.signals, tuple(self.parameters))
        force = law + self.out[self.rows.index("force")]
        part, weak = law - spared, force - spared
        with np.errstate(divide="ignore", invalid="ignore"):
            left = weak / part
        for run in self.data.runs:
            size = np.abs(part[run])
            left[run][size < _LARGE * size.max()] = np.nan
        return Weakened(force, weak, left)

    def _weakened_slopes(
        self, now: Weakened, by_law: NDArray, by_out: NDArray, own: int
    ) -> tuple[NDArray, NDArray, NDArray]:
        """Derivatives of these."""
        law = self.signals.force
        if self.effect.spared is None:
            by_left = by_out[self.rows.index("factor")]
            by_force = now.left[:, np.newaxis] * by_law + law[:, np.newaxis] * by_left
            return by_force, by_force, by_left
        by_spared = np.zeros_like(by_law)
        units = np.eye(len(self.parameters))
        for place, unit in enumerate(units):
            by_spared[:, own + place] = self.effect.spared(self.signals, tuple(unit))
        by_force = by_law + by_out[self.rows.index("force")]
        by_weak, by_part = by_force - by_spared, by_law - by_spared
        part = law - self.effect.spared(self.signals, tuple(self.parameters))
        left = now.left[:, np.newaxis]
        with np.errstate(divide="ignore", invalid="ignore"):
            by_left = (by_weak - left * by_part) / part[:, np.newaxis]
        return by_force, by_weak, by_left

    def _fresh(self) -> tuple[NDArray, list[tuple[NDArray, NDArray]]]:
        """First states of a fresh device in each run; their derivatives by force and parameters."""
        effect, p = self.effect, tuple(self.parameters)
        first = np.zeros((len(self.data.dt), len(effect.states)))
        if effect.start is None:
            return first, []
        by_signals = []
        for run in range(len(first)):
            at = self._at(run)
            here = Signals(*(one[at] for one in self.signals))
            first[run] = effect.start(here, p)
            if "force" in effect.needs:
                by = by_inputs(effect.start, here, p)
                n = len(here)
                by_signals.append((by[:, Signals._fields.index("force"), np.newaxis], by[:, n:]))
        return first, by_signals

    def _at(self, run: int) -> int:
        """Sample at which the device goes into a run from rest."""
        return int(self.data.starts[run] + self.runs.lead[run])

    def _by_function(self, rows: NDArray) -> dict[str, Any]:
        return {
            name: rows[:2] if name == "motion" else rows[self.rows.index(name)]
            for name in dict.fromkeys(self.rows)
        }


def _at_once(effect: Effect, signals: Signals, parameters: tuple) -> dict[str, Any]:
    """An effect without states, at all samples."""
    result = {}
    with np.errstate(all="ignore"):
        for hook in HOOKS:
            function = getattr(effect, hook)
            if function is not None:
                value = function(signals, (), parameters)
                result[hook] = value if hook == "motion" else value + np.zeros_like(signals.x)
    return result


def _width(effect: Effect, hook: str) -> int:
    if getattr(effect, hook) is None:
        return 0
    return 2 if hook == "motion" else 1


def compile_effect(effect: Effect, differentiated: bool) -> None:
    """Compile an effect, or its derivatives, to the cache folder."""
    wave = np.sin(np.linspace(0.0, 1.0, 32))
    zero, parameters = np.zeros_like(wave), np.ones(len(effect.parameters))
    data = measured_runs([TestRun("wave", np.arange(32) / 32, wave, wave, wave, zero)])
    with np.errstate(all="ignore"):
        if differentiated:
            by_force = np.zeros((len(wave), len(parameters)))
            differentiate(effect, data, data.force, parameters, by_force, 0)
        else:
            evaluate(effect, data, data.force, parameters)
