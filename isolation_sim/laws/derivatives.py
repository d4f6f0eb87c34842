"""Exact derivatives of a law by CasADi."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from ..errors import InputError
from .current_dependence import CurrentDependence
from .emit import symbols
from .law import Law

_BESIDE_REST = -1e-12
"""Deformation on the other side of a corner at rest, m."""


@lru_cache(maxsize=64)
def _jacobian_at_rest(law: Law, x_at_rest: float) -> Any:
    """CasADi function: parameters -> d(force, rates) / d(x, v, states) at rest."""
    import casadi

    arguments = symbols(["x", "v", *law.state_names])
    parameters = symbols(list(law.parameter_names))
    x, v, *states = arguments
    outputs = [
        law.force(x, v, tuple(states), tuple(parameters)),
        *law.rates(x, v, tuple(states), tuple(parameters)),
    ]
    jacobian = casadi.jacobian(casadi.vertcat(*outputs), casadi.vertcat(*arguments))
    zeros = (0.0,) * len(states)
    rest = [x_at_rest, 0.0, *(zeros if law.rest is None else law.rest(tuple(parameters)))]
    at_rest = casadi.substitute(jacobian, casadi.vertcat(*arguments), casadi.vertcat(*rest))
    return casadi.Function("jacobian_at_rest", [casadi.vertcat(*parameters)], [at_rest])


def complex_stiffness(law: Law, parameters: Sequence[float], omega: float) -> complex:
    """Complex stiffness of a law for small vibrations about rest."""
    jacobian, beside = (
        np.array(_jacobian_at_rest(law, x)(np.array(parameters, dtype=float)))
        for x in (0.0, _BESIDE_REST)
    )
    if not np.all(np.isfinite(jacobian + beside)):
        raise InputError(f"{law.name} has no finite derivatives at rest: it cannot be linearised")
    # the first harmonic of a force with another slope on either side is that of their mean
    if np.any(np.abs(jacobian - beside) > 1e-6 * np.abs(jacobian).max(axis=1, keepdims=True)):
        jacobian = (jacobian + beside) / 2
    by_motion = jacobian[:, 0] + 1j * omega * jacobian[:, 1]
    by_states = jacobian[:, 2:]
    resolvent = 1j * omega * np.eye(len(law.states)) - by_states[1:]
    return complex(by_motion[0] + by_states[0] @ np.linalg.solve(resolvent, by_motion[1:]))


@lru_cache(maxsize=64)
def _energy_gradient(law: Law, dependence: CurrentDependence) -> Any:
    """CasADi function: deformations, current, states -> gradient of the stored energy by each."""
    import casadi

    assert law.stored_energy is not None
    n = law.directions
    names = [f"x{k}" for k in range(n)]
    arguments = symbols([*names, "current", *law.state_names])
    x, current, states = tuple(arguments[:n]), arguments[n], arguments[n + 1 :]
    energy = law.stored_energy(x[0] if n == 1 else x, tuple(states), dependence.at(current))
    gradients = [casadi.gradient(energy, a) for a in arguments]
    return casadi.Function("energy_gradient", arguments, gradients)


@lru_cache(maxsize=64)
def _energy_gradients(law: Law, dependence: CurrentDependence, count: int) -> Any:
    """The gradient at several points; a call without a map takes seven times as long."""
    return _energy_gradient(law, dependence).map(count)


def energy_gradients(
    law: Law, dependence: CurrentDependence, x: Sequence, states: Sequence, current: np.ndarray
) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...], np.ndarray]:
    """Derivatives of a law's stored energy by deformations, states and current."""
    rows = [np.asarray(a, float)[np.newaxis] for a in (*x, current, *states)]
    mapped = _energy_gradients(law, dependence, rows[0].size)
    gradients = [np.asarray(row).ravel() for row in mapped.call(rows)]
    n = law.directions
    return tuple(gradients[:n]), tuple(gradients[n + 1 :]), gradients[n]
