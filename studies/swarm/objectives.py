"""Objectives of the papers, from a measured force and a model of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ground_motions.argument_types import checked
from isolation_sim.errors import InputError, check_name

from ..force_comparison import fitness, half_range_error, rms_error, squared_force_error


def misfit(measured: Any, modelled: Any) -> float:
    """Return 100 less the fitness of the linearised Bouc-Wen paper (Eq 13, mended)."""
    return 100.0 - fitness(measured, modelled)


OBJECTIVES: dict[str, Callable[[Any, Any], float]] = {
    "rms": rms_error,
    "squared_force": squared_force_error,
    "misfit": misfit,
    "half_range": half_range_error,
}
"""Objectives to minimise by name: ``rms`` (Yu et al., Eq 6, N), ``squared_force`` (Li & Li, Eq 16,
which cannot see the sign of a force; by samples of 1 s), ``misfit`` (linearised Bouc-Wen, %),
``half_range`` (Tao et al., Eq 24, dimensionless)."""


@checked
def force_objective(
    name: str, measured: ArrayLike, model: Callable[[np.ndarray], Any]
) -> Callable[[np.ndarray], float]:
    """Build an objective of the parameters from a measured force and a model.

    Parameters
    ----------
    name : str
        One of `OBJECTIVES`.
    measured : array_like, shape (n,), N
        Measured force.
    model : callable
        Parameters, shape (n_parameters,), to the force that they give, shape (n,), N.

    Returns
    -------
    callable
        Parameters to a number to minimise; inf where the model's force is not finite.

    Raises
    ------
    InputError
        If there is no such objective, or the measured force has a number that is not finite.
    """
    check_name("objective", name, OBJECTIVES)
    force = np.array(measured, dtype=float)
    if force.ndim != 1 or force.size == 0 or not np.all(np.isfinite(force)):
        raise InputError(f"measured force of shape {force.shape}; expected: (n,), finite numbers")
    compare = OBJECTIVES[name]

    def objective(parameters: np.ndarray) -> float:
        with np.errstate(all="ignore"):
            modelled = np.asarray(model(parameters), dtype=float)
        return compare(force, modelled) if np.all(np.isfinite(modelled)) else np.inf

    return objective
