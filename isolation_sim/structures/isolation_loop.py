"""Loops of all isolators together, and their effective stiffness and damping at a displacement."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ground_motions.checks import positive

from ..errors import InputError
from ..laws.law import Law
from .element import isolation_elements

_CYCLES, _POINTS = 3, 241


class Effective(NamedTuple):
    """Equivalent linear isolation at a displacement."""

    stiffness: float  # (F+ - F-) / (2 D), N/m
    damping: float  # loop area / (2 pi stiffness D^2), dimensionless
    period: float  # of the mass above the isolators on the stiffness, s


def effective_at(isolated: Any, displacement: float, currents: float | NDArray) -> Effective:
    """Effective properties at a displacement, in a cycle of the effective period."""
    positive("displacement", displacement)
    result = effective(isolated, displacement, 2.0, currents)
    for _ in range(50):
        before = result.period
        result = effective(isolated, displacement, before, currents)
        if abs(result.period - before) < 1e-9 * before:
            break
    return result


def effective(
    isolated: Any, displacement: float, period: float, currents: float | NDArray
) -> Effective:
    """Effective properties in a cycle of a displacement and a period (ASCE 7-22, 17.2.8)."""
    x, force = isolation_loop(isolated, displacement, period, currents)
    stiffness = float(force[0] - force[len(x) // 2]) / (2 * displacement)
    if not stiffness > 0:
        raise InputError(
            f"{isolated.structure.name}: its isolators have no restoring force at "
            f"{1e3 * displacement:.3g} mm; expected: a stiffness above 0"
        )
    # over the phase: exact for a smooth loop, whose polygon in the plane is too small
    phase = np.linspace(0.0, 2 * np.pi, len(x))
    area = float(np.trapezoid(-displacement * np.sin(phase) * force, phase))
    damping = area / (2 * np.pi * stiffness * displacement**2)
    mass = isolated.structure.isolated_mass
    return Effective(stiffness, damping, 2 * np.pi * float(np.sqrt(mass / stiffness)))


def isolation_loop(
    isolated: Any, amplitude: float, period: float, currents: float | NDArray
) -> tuple[NDArray, NDArray]:
    """Steady loop of all isolators under a sinusoidal displacement along the first direction."""
    from scipy.integrate import solve_ivp

    omega = 2 * np.pi / period
    time = period * (_CYCLES + np.linspace(0.0, 1.0, _POINTS))
    amperes = np.broadcast_to(currents, (max(isolated.n_channels, 1),))
    x, v = amplitude * np.cos(omega * time), -amplitude * omega * np.sin(omega * time)
    rigid = isolated.structure.above_foundation[:, 0]
    force = (rigid @ isolated.structure.stiffness @ rigid) * x
    followed: dict[tuple, NDArray] = {}  # states of equal isolators
    for e in isolation_elements(isolated):
        element, along = isolated.elements[e], isolated.holding[e, 0]
        if along == 0.0:
            continue
        device = element.device
        at = 0.0 if element.channel is None else float(amperes[element.channel])
        law, parameters, amount = device.law, device.parameters_at(at), along / device.length
        key = id(law), parameters, amount
        if not law.states:
            followed[key] = np.zeros((0, _POINTS))
        if key not in followed:
            # from rest, to the amplitude in the first quarter of a cycle
            def rates(t: float, s: NDArray, law: Law = law, size: float = amount * amplitude,
                      parameters: tuple = parameters) -> tuple:  # fmt: skip
                at_x, at_v = size * np.sin(omega * t), size * omega * np.cos(omega * t)
                return tuple(law.rates(at_x, at_v, tuple(s), parameters))

            # Radau where the trial steps of LSODA overflow, as at a sharp corner of friction
            for method in ("LSODA", "Radau"):
                solution = solve_ivp(
                    rates, (0.0, time[-1] + period / 4), device.initial_states(), method,
                    t_eval=time + period / 4, rtol=1e-7, atol=1e-10, max_step=period / 50,
                )  # fmt: skip
                if np.all(np.isfinite(solution.y)):
                    break
            followed[key] = solution.y
        force = force + along * device.force(along * x, along * v, tuple(followed[key]), at)
    return x, np.asarray(force)
