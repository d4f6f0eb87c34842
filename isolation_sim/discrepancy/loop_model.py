"""A law with effects, held against a loop table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..effects.effect import REFERENCE_TEMPERATURE
from .loop_table import LoopTable
from .measured import Measured
from .model import Model

ACCURACY = 0.05
"""Relative error of stiffness and damping up to which a table counts as reproduced: what tests of
one device agree to, since a table says nothing of its own noise."""
CYCLES = 16
"""Cycles of each test; the last one counts."""
SAMPLES = 64
"""A cycle."""


@dataclass(frozen=True, eq=False)
class LoopModel(Model):
    """A model whose loops are reduced to stiffness and damping.

    Attributes
    ----------
    table : LoopTable or None
        What was measured.
    """

    table: LoopTable | None = None

    @np.errstate(all="ignore")
    def loops(self, values: NDArray, derivatives: bool = False) -> tuple[NDArray, NDArray]:
        """Stiffness and damping of the simulated loops over the measured ones.

        Parameters
        ----------
        values : (n_values,) array
            As of ``forces``.
        derivatives : bool
            Whether these are wanted.

        Returns
        -------
        ratios : (2 n,) array
            All stiffnesses, then all damping ratios; 1 where the model agrees.
        jacobian : (2 n, n_values) array
            No rows if they are not wanted.
        """
        table = self.table
        assert table is not None
        force, jacobian = self.forces(values, derivatives)
        n = len(table.amplitude)
        last = (np.arange(n)[:, np.newaxis] + 1) * CYCLES * SAMPLES - SAMPLES + np.arange(SAMPLES)
        dt = 1 / (SAMPLES * table.frequency)

        def reduced(columns: NDArray) -> tuple[NDArray, NDArray]:
            """Stiffness and energy of a cycle: both are linear in the forces."""
            loops = columns[last]
            # the sine starts at its zero: extremes at a quarter and at three quarters
            rise = loops[:, SAMPLES // 4] - loops[:, 3 * SAMPLES // 4]
            shape = (n,) + (1,) * (columns.ndim - 1)
            work = np.einsum("ns,ns...->n...", self.data.v[last], loops) * dt.reshape(shape)
            return rise / (2 * table.amplitude).reshape(shape), work

        stiffness, work = reduced(force)
        over = 2 * np.pi * table.amplitude**2
        damping = work / (over * stiffness)
        ratios = np.concatenate([stiffness / table.stiffness, damping / table.damping])
        if not derivatives:
            return ratios, np.empty((0, len(values)))
        d_stiffness, d_work = reduced(jacobian)
        d_damping = (d_work / over[:, None] - damping[:, None] * d_stiffness) / stiffness[:, None]
        return ratios, np.concatenate(
            [d_stiffness / table.stiffness[:, None], d_damping / table.damping[:, None]]
        )

    @np.errstate(all="ignore")
    def residuals(self, values: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
        """Relative errors of the fitted rows over the accuracy, and their derivatives."""
        ratios, jacobian = self.loops(values, derivatives)
        kept = np.tile(~self.table.held_out, 2)  # type: ignore[union-attr]
        residual = (ratios - 1)[kept] / ACCURACY
        return residual, jacobian[kept] / ACCURACY if derivatives else jacobian


def loop_motion(table: LoopTable) -> Measured:
    """Motion of a table's tests: sinusoids from rest, at steady current.

    Parameters
    ----------
    table : LoopTable
        The table.

    Returns
    -------
    Measured
        Without forces.
    """
    n, each = len(table.amplitude), CYCLES * SAMPLES
    omega = 2 * np.pi * table.frequency
    dt = 1 / (SAMPLES * table.frequency)
    phase = omega[:, None] * dt[:, None] * np.arange(each)
    x = table.amplitude[:, None] * np.sin(phase)
    v = (table.amplitude * omega)[:, None] * np.cos(phase)
    force = np.repeat(table.stiffness, each) * x.ravel()
    return Measured(
        names=tuple(f"row {k + 1}" for k in range(n)),
        starts=np.arange(n + 1) * each,
        dt=dt,
        x=x.ravel(),
        v=v.ravel(),
        a=(-(omega**2)[:, None] * x).ravel(),
        force=force,
        current=np.repeat(table.current, each),
        temperature=np.full(n * each, REFERENCE_TEMPERATURE),
        fitted=np.repeat(~table.held_out, each),
        force_noise=np.zeros(n),
        displacement_noise=np.zeros(n),
        velocity_measured=np.ones(n, bool),
        has_temperature=False,
    )
