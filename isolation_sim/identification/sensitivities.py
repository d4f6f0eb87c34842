"""Forces of a law under measured motion, with exact derivatives by its coefficients."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from ..laws.emit import symbols
from ..laws.law import Law
from ..laws.registry import LAWS
from ..workers import Task
from .kernel.device_arguments import workspace
from .kernel.device_kernel_text import compiled, is_compiled
from .measured.run_starts import Runs, lead_in

_LARGEST_CHANGE = 1e3
"""Change of a run's force over the relative change of a coefficient, in units of the force, beyond
which the derivative is the integration's and not the law's."""
_DIVERGING = 0.5
"""Relative change of a run's largest force by twice the steps from which it still diverges."""
_MANY_SAMPLES = 10_000
"""Samples from which Rosenbrock steps are worth their compilation."""
_MANY_STEPS = 16
"""Runge-Kutta steps a sample at which Rosenbrock steps are tried."""
_FEW_STIFF_STEPS = 8
"""Rosenbrock steps a sample up to which they cost less."""
_STIFF_STATES = 4
"""Coupled states up to which their equations are solved in a Rosenbrock step."""


@dataclass(frozen=True)
class Motion:
    """Measured motion of several test runs, one after another."""

    starts: NDArray  # (n_runs + 1,) int: First sample of each run, and the end
    # displacement, velocity, current: (n_samples,): m, m/s, A
    displacement: NDArray
    velocity: NDArray
    current: NDArray
    dt: NDArray  # (n_runs,): Sample interval of each run, s
    # (n_runs,), s: Period of each run whose first cycle is steady; 0, or None for all, from rest
    periods: NDArray | None = None

    @cached_property
    def runs(self) -> Runs:
        """Where the runs lie, each with the motion that leads into it."""
        periods = np.zeros_like(self.dt) if self.periods is None else self.periods
        return lead_in(self.starts, self.dt, periods, self.displacement)

    @cached_property
    def runs_at_rest(self) -> Runs:
        """The same if every run begins at rest."""
        return lead_in(self.starts, self.dt, np.zeros_like(self.dt), self.displacement)

    def with_current(self, current: NDArray) -> Motion:
        """Return the same motion under another current, (n_samples,), A."""
        other = replace(self, current=current)
        other.__dict__["runs"] = self.runs  # they do not depend on it
        return other

    def slower(self, scales: NDArray) -> Motion:
        """Return the motion for a law whose times are all longer by a factor, (n_runs,)."""
        velocity = self.velocity * np.repeat(scales, np.diff(self.starts))
        other = replace(self, velocity=velocity, dt=self.dt / scales)
        runs = self.runs
        other.__dict__["runs"] = runs._replace(dt=runs.dt / scales, join=runs.join / scales)
        return other


class Simulator:
    """A law under measured motion.

    Parameters
    ----------
    law : Law
        The law.
    motion : Motion
        The motion.
    n_powers : int
        Coefficients of each parameter: ascending powers of the current.
    n_steps : int or (n_runs,) array of int
        Integration steps a sample, of all runs or of each.
    stiff : bool or (n_runs,) array of bool
        Whether these are Rosenbrock steps, which a state far faster than a step leaves stable.
    """

    def __init__(
        self,
        law: Law,
        motion: Motion,
        n_powers: int = 1,
        n_steps: int | NDArray = 1,
        stiff: bool | NDArray = False,
    ):
        self.law, self.motion, self.n_powers = law, motion, n_powers
        self.n_steps = np.broadcast_to(np.asarray(n_steps, np.int64), motion.dt.shape).copy()
        self.stiff = np.broadcast_to(np.asarray(stiff, bool), motion.dt.shape).copy()

    def run(self, theta: NDArray, derivatives: bool = True) -> tuple[NDArray, NDArray]:
        """Simulate all runs; ``theta``: one parameter's coefficients after another's."""
        law, motion, n_samples = self.law, self.motion, len(self.motion.displacement)
        # without memory any run may begin
        runs = motion.runs if law.states else motion.runs_at_rest
        whole = self.n_steps.all()
        force = np.empty(n_samples) if whole else np.full(n_samples, np.nan)
        jacobian = np.empty((n_samples if derivatives else 0, len(theta)))
        rows = np.ascontiguousarray(theta, float).reshape(-1, self.n_powers)
        for stiff in (False, True):
            n_steps = np.where(self.stiff == stiff, self.n_steps, 0)
            if not n_steps.any():
                continue
            compiled(law, stiff).simulate(
                runs,
                motion.displacement,
                motion.velocity,
                motion.current,
                n_steps,
                rows,
                workspace(len(law.states), len(law.parameters), self.n_powers),
                force,
                jacobian,
            )
        return force, jacobian

    def with_steps(self, n_steps: NDArray, stiff: NDArray) -> Simulator:
        """Return the simulator with other steps; runs with none are left out."""
        other = copy(self)
        other.n_steps, other.stiff = n_steps, stiff
        return other

    def resolved(self, theta: NDArray, tolerance: float = 1e-4, most: int = 64) -> Simulator:
        """Return the simulator with as many steps a sample as each run's accuracy needs.

        The force of each run then changes by less than ``tolerance`` with twice the steps, and no
        derivative diverges. A run that would need too many steps gets Rosenbrock steps where a few
        of them are enough; if there are many samples, one that would need many.
        """
        every = np.full(len(self.n_steps), bool(self.law.states))
        few = len(self.motion.displacement) < _MANY_SAMPLES
        result, left = self._doubled(
            theta, every, tolerance, most if few else min(_MANY_STEPS, most)
        )
        result = result._stiff_where(theta, left & ~self.stiff, tolerance)
        result, _ = result._doubled(theta, left & (result.stiff == self.stiff), tolerance, most)
        # a force that saturates is bounded by itself, while its derivatives may grow at every step
        while (more := result._diverging(theta) & (result.n_steps < most)).any():
            n_steps = np.where(more, 2 * result.n_steps, result.n_steps)
            result = result.with_steps(n_steps, result.stiff)
        return result

    def _doubled(
        self, theta: NDArray, chosen: NDArray, tolerance: float, most: int
    ) -> tuple[Simulator, NDArray]:
        """Double the steps of some runs until that changes no force; runs it does at the end."""
        unresolved, runs = chosen & (self.n_steps < most), self.motion.starts[:-1]
        left = chosen & ~unresolved
        if not unresolved.any():
            return self, left
        force, n_steps = self.run(theta, derivatives=False)[0], self.n_steps
        while unresolved.any():
            trial = np.where(unresolved, 2 * n_steps, n_steps)
            finer = self.with_steps(trial, self.stiff).run(theta, derivatives=False)[0]
            with np.errstate(all="ignore"):
                size = np.maximum.reduceat(np.abs(finer), runs)
                change = np.maximum.reduceat(np.abs(finer - force), runs)
                # a run that still diverges has no size
                largest = np.max(size[change < _DIVERGING * size], initial=1e-150)
                unresolved &= ~(change < tolerance * largest)
            n_steps, force = np.where(unresolved, trial, n_steps), finer
            left |= unresolved & (n_steps >= most)
            unresolved &= n_steps < most
        return self.with_steps(n_steps, self.stiff), left

    def _stiff_where(self, theta: NDArray, chosen: NDArray, tolerance: float) -> Simulator:
        """Take Rosenbrock steps in those of the chosen runs where a few of them are enough."""
        if not chosen.any() or not has_stiff_steps(self.law):
            return self
        trial = self.with_steps(np.where(chosen, 1, 0), chosen)
        trial, left = trial._doubled(theta, chosen, tolerance, _FEW_STIFF_STEPS)
        taken = chosen & ~left
        if taken.any():
            trial = self.with_steps(np.where(taken, trial.n_steps, 0), taken)
            taken &= ~trial._diverging(theta)
        n_steps = np.where(taken, trial.n_steps, self.n_steps)
        return self.with_steps(n_steps, self.stiff | taken)

    @np.errstate(all="ignore")
    def _diverging(self, theta: NDArray) -> NDArray:
        """Whether derivatives of each run diverge though its force does not, (n_runs,) bool."""
        runs = self.motion.starts[:-1]
        if not self.law.states:
            return np.zeros(len(runs), bool)
        force, jacobian = self.run(theta)
        change = np.maximum.reduceat(np.max(np.abs(jacobian * theta), axis=1), runs)
        size = np.maximum.reduceat(np.abs(force), runs)
        return np.isfinite(size) & ~(change <= _LARGEST_CHANGE * size)


@lru_cache(maxsize=64)
def has_stiff_steps(law: Law) -> bool:
    """Whether Rosenbrock steps of a law are cheap: of few states, or of many that go alone."""
    import casadi

    if not law.states or len(law.states) <= _STIFF_STATES:
        return bool(law.states)
    states, numbers = (symbols([q.name for q in some]) for some in (law.states, law.parameters))
    rates = law.rates(*symbols(["x", "v"]), tuple(states), tuple(numbers))
    by_states = casadi.jacobian(casadi.vertcat(*rates), casadi.vertcat(*states))
    return bool(by_states.sparsity().is_diag())


def compile_law(law: Law) -> None:
    """Compile the simulation of a law to the cache folder."""
    n, time = len(law.parameters), np.linspace(0.0, 1.0, 8)
    motion = Motion(np.array([0, 8]), time, time, time, np.array([0.1]))
    with np.errstate(all="ignore"):
        Simulator(law, motion).run(np.ones(n))


def laws_to_compile(laws: Iterable[str] = LAWS) -> list[Task[None]]:
    """Tasks of further processes for the laws that are not compiled, the one needed last first."""
    names = (name for name in reversed([*laws]) if not is_compiled(LAWS[name]))
    return [partial(_compile, name) for name in names]


def _compile(law: str) -> None:
    with suppress(Exception):  # the fit says what is wrong
        compile_law(LAWS[law])
