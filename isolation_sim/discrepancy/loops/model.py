"""A law with effects, whose loops are fitted to a table of stiffness and damping."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...effects.effect import REFERENCE_TEMPERATURE
from ...identification.least_squares import Optimum
from ...identification.measured_runs import MeasuredRuns
from ..decisions import LOOP_ACCURACY
from ..device.model import Model
from .table import LoopTable

CYCLES = 16
"""Cycles of each test; the last one counts."""
_FINER, _REFINED, _SAME = 4, 2, 0.01
"""Factor on either, how often it may be applied, and change of relative stiffness and damping up to
which it is not."""
STEPS = 40
"""Steps of a fit."""
_TOLERANCE, _VALLEY = 1e-4, 1e-2
"""Relative decrease of the cost in one step, and in ten, below which a fit ends. Effort: 1e-6 and 0
take 1.6 times as long on Li & Li's table and name the same effects (left out 3.66 %, now 3.58)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LoopModel(Model):
    """A model whose loops are reduced to stiffness and damping."""

    table: LoopTable  # Measured loops
    cycles: int = CYCLES  # Simulated cycles of each test

    @property
    def samples(self) -> int:
        """Samples of a cycle."""
        return len(self.data.x) // (len(self.table.amplitude) * self.cycles)

    def on(self, table: LoopTable, cycles: int, samples: int = 1, steps: int = 1) -> Self:
        """Return the model on other loops, with factors on its samples and integration steps."""
        n_steps = steps * int(self.data.n_steps[0])
        data = loop_motion(table, samples * self.samples, n_steps, cycles)
        return replace(self, table=table, cycles=cycles, data=data)

    @np.errstate(all="ignore")
    def loops(self, values: NDArray, derivatives: bool = False) -> tuple[NDArray, NDArray]:
        """Simulated over measured stiffnesses, then damping ratios, (2 n,), and their derivatives.

        A ratio is 1 where the model agrees.
        """
        table, each = self.table, self.samples
        force, jacobian = self.forces(values, derivatives)
        n = len(table.amplitude)
        last = (np.arange(n)[:, np.newaxis] + 1) * self.cycles * each - each + np.arange(each)
        dt = 1 / (each * table.frequency)

        def reduce(columns: NDArray) -> tuple[NDArray, NDArray]:
            """Stiffness and energy of a cycle: both are linear in the forces."""
            loops = columns[last]
            # a constant force does no work in a cycle, but would by the rounding of the velocities
            loops = loops - loops.mean(axis=1, keepdims=True)
            # the sine starts at zero: extremes at a quarter and at three quarters
            rise = loops[:, each // 4] - loops[:, 3 * each // 4]
            shape = (n,) + (1,) * (columns.ndim - 1)
            work = np.einsum("ns,ns...->n...", self.data.v[last], loops) * dt.reshape(shape)
            return rise / (2 * table.amplitude).reshape(shape), work

        stiffness, work = reduce(force)
        over = 2 * np.pi * table.amplitude**2
        damping = work / (over * stiffness)
        ratios = np.concatenate([stiffness / table.stiffness, damping / table.damping])
        if not derivatives:
            return ratios, np.empty((0, len(values)))
        d_stiffness, d_work = reduce(jacobian)
        d_damping = (d_work / over[:, None] - damping[:, None] * d_stiffness) / stiffness[:, None]
        return ratios, np.concatenate(
            [d_stiffness / table.stiffness[:, None], d_damping / table.damping[:, None]]
        )

    @np.errstate(all="ignore")
    def residuals(self, values: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
        """Relative errors of the fitted rows over the accuracy, and their derivatives."""
        ratios, jacobian = self.loops(values, derivatives)
        fitted = np.tile(~self.table.held_out, 2)
        residual = (ratios - 1)[fitted] / LOOP_ACCURACY
        return residual, jacobian[fitted] / LOOP_ACCURACY if derivatives else jacobian

    def fit(self, start: NDArray, most: int = STEPS) -> Optimum:
        """Fit, in so many steps at most."""
        return self.minimise(start, most, _TOLERANCE, _VALLEY)

    def fit_further(self, start: NDArray) -> tuple[Self, Optimum]:
        """Fit, and fit again with more steps or samples while the loops have not settled."""
        model, result = self, self.fit(start)
        for _ in range(_REFINED):
            finer = model._refined(result.x)
            if finer is None:
                break
            model, result = finer, finer.fit(result.x)
        return model, result

    def _refined(self, values: NDArray) -> Self | None:
        """Model with more steps, or else samples, if they change its loops."""
        loops = self.loops(values)[0]
        for samples, steps in ((1, _FINER), (_FINER, 1)):
            finer = self.on(self.table, self.cycles, samples, steps)
            if not np.all(np.abs(finer.loops(values)[0] - loops) < _SAME):
                return finer
        return None


def loop_motion(table: LoopTable, samples: int, n_steps: int, cycles: int = CYCLES) -> MeasuredRuns:
    """Motion of a table's tests: sinusoids from rest, at steady current; the forces are linear."""
    n, each = len(table.amplitude), cycles * samples
    omega = 2 * np.pi * table.frequency
    dt = 1 / (samples * table.frequency)
    phase = omega[:, None] * dt[:, None] * np.arange(each)
    x = table.amplitude[:, None] * np.sin(phase)
    v = (table.amplitude * omega)[:, None] * np.cos(phase)
    force = np.repeat(table.stiffness, each) * x.ravel()
    return MeasuredRuns(
        names=tuple(f"row {k + 1}" for k in range(n)),
        starts=np.arange(n + 1) * each,
        dt=dt,
        x=x.ravel(),
        v=v.ravel(),
        a=(-(omega**2)[:, None] * x).ravel(),
        force=force,
        current=np.repeat(table.current, each),
        temperature=np.full(n * each, REFERENCE_TEMPERATURE),
        fitted=np.ones(n * each, bool),  # the table says which rows are held out
        beside_jump=np.zeros(n * each, bool),
        clipped=np.zeros(n * each, bool),
        force_noise=np.zeros(n),
        force_corner=np.full(n, np.inf),
        displacement_noise=np.zeros(n),
        sigma=np.ones(n),
        velocity_noise=np.zeros(n),
        has_temperature=False,
        averaging=np.zeros(n),
        periods=np.zeros(n),
        return_times=np.zeros((n, 1)),
        n_steps=np.full(n, n_steps),
        stiff=np.zeros(n, bool),
    )


@dataclass(frozen=True, eq=False)
class FittedLoops:
    """A model that fits a loop table best."""

    model: LoopModel  # The model
    optimum: Optimum  # Its fit
    left_out: float  # RMS of the relative errors on rows left out of the fit
    # tuple of (n_unknowns,): Other parameters of the law that were nearly as good without effects
    others: tuple[NDArray, ...] = ()

    @property
    def causes(self) -> tuple[str, ...]:
        """Causes of the model's effects."""
        return self.model.causes

    @property
    def ratios(self) -> NDArray:
        """Simulated over measured stiffness, then damping, (2 n,)."""
        return self.model.loops(self.optimum.x)[0]


def rms(values: NDArray) -> float:
    """Root mean square; infinite where a value is not a number."""
    size = float(np.sqrt(np.mean(values**2)))
    return size if np.isfinite(size) else np.inf
