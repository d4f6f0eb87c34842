"""The OpenSees material closest to a device at one coil current."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked

from ..errors import InputError
from ..laws.device import Device
from ..simulation.substructure import DeviceSimulator

if TYPE_CHECKING:
    from ..structures.structure import IsolatedStructure

SAMPLES = 240
"""Steps per cycle, as of an analysis of 2.4 s in steps of 10 ms: a material integrates in one each.

Numbers fitted at coarse steps make up for their error of integration, and are wrong at others."""
RISING, STEADY = 4, 2
"""Cycles with rising amplitude, and cycles at full amplitude."""
USUAL = 1.0
"""Frequency of the loops of a device without a building, Hz."""
Command = tuple[Any, ...]


def _elastic_bilinear(x: NDArray, stiffness: float, beyond: float, knee: float) -> NDArray:
    """Nonlinear elastic spring of two slopes."""
    size = np.abs(x)
    return np.sign(x) * (stiffness * np.minimum(size, knee) + beyond * np.maximum(size - knee, 0.0))


def _steel01(x: NDArray, yield_force: float, stiffness: float, ratio: float) -> NDArray:
    """Bilinear spring with kinematic hardening."""
    knee, z, slip = yield_force / stiffness, 0.0, np.zeros(len(x))
    for k, dx in enumerate(np.diff(x, prepend=0.0).tolist()):
        z = min(max(z + dx, -knee), knee)
        slip[k] = z
    return stiffness * (ratio * x + (1.0 - ratio) * slip)


def _bouc_wen(x: NDArray, ratio: float, stiffness: float, n: float, knee: float) -> NDArray:
    """Bouc and Wen's spring with equal gamma and beta, by the backward Euler rule."""
    z, slip = 0.0, np.zeros(len(x))
    for k, dx in enumerate(np.diff(x, prepend=0.0).tolist()):
        start = z
        for _ in range(30):
            loading = dx * z > 0.0
            size = (abs(z) / knee) ** n if loading else 0.0
            change = (start + dx * (1.0 - size) - z) / (
                1.0 + (abs(dx) * n * size / abs(z) if size else 0.0)
            )
            z += change
            if abs(change) <= 1e-12 * knee:
                break
        slip[k] = z
    return stiffness * (ratio * x + (1.0 - ratio) * slip)


class Spring(NamedTuple):
    """An OpenSees material parallel to a viscous one."""

    name: str
    force: Callable[..., NDArray]
    start: Callable[[float, float], tuple[float, ...]]
    bounds: Callable[[float, float], tuple[tuple[float, float], ...]]
    arguments: Callable[..., tuple[float, ...]]


SPRINGS = (
    Spring(
        "ElasticBilin",
        _elastic_bilinear,
        lambda k, a: (k, k, 0.5 * a),
        lambda k, a: ((1e-3 * k, 1e3 * k), (1e-3 * k, 1e3 * k), (0.02 * a, a)),
        lambda k, beyond, knee: (k, beyond, knee),
    ),
    Spring(
        "Steel01",
        _steel01,
        lambda k, a: (0.3 * k * a, 2.0 * k, 0.3),
        lambda k, a: ((1e-3 * k * a, 10 * k * a), (1e-2 * k, 1e3 * k), (1e-4, 0.999)),
        lambda yield_force, k, ratio: (yield_force, k, ratio),
    ),
    Spring(
        "BoucWen",
        _bouc_wen,
        lambda k, a: (0.3, 2.0 * k, 1.2, 0.15 * a),
        lambda k, a: ((1e-4, 0.999), (1e-2 * k, 1e3 * k), (1.0, 4.0), (1e-3 * a, 10 * a)),
        lambda ratio, k, n, knee: (
            ratio, k, n, 0.5 / knee**n, 0.5 / knee**n, 1.0, 0.0, 0.0, 0.0,
        ),
    ),
)  # fmt: skip
"""Start and bounds of the numbers by the secant stiffness, N/m, and the amplitude, m."""


@dataclass(frozen=True, eq=False)
class OpenSeesMaterial:
    """The closest OpenSees material to a device at one coil current.

    Attributes
    ----------
    device : Device
        The device.
    current : float, A
        Coil current.
    name : str
        Name of the materials, such as ``"BoucWen and Viscous"``.
    commands : tuple of tuple
        Arguments of ``uniaxialMaterial``, of the parts and of the two in parallel, whose tag is 3;
        in N, m and s.
    frequency : float, Hz
        Frequency of the loops.
    error : float
        RMS of the residual force over the RMS of the device's, on the loops below.
    errors : dict of str to float
        The error of every material that was tried.
    displacement, velocity, force, fitted : numpy.ndarray, shape (n,), m, m/s and N
        Loops: a sinusoid whose amplitude rises over four cycles and then stays for two; the
        device's force and the material's.
    """

    device: Device
    current: float
    name: str
    commands: tuple[Command, ...]
    frequency: float
    error: float
    errors: dict[str, float]
    displacement: NDArray
    velocity: NDArray
    force: NDArray
    fitted: NDArray

    def _comment(self) -> str:
        others = ", ".join(
            f"{name} {100 * error:.3g} %"
            for name, error in self.errors.items()
            if name != self.name
        )
        return (
            f"# {self.device.law.title} at {self.current:g} A as {self.name}, in N, m and s\n"
            f"# error of the force up to {np.abs(self.displacement).max():.3g} m at "
            f"{self.frequency:.3g} Hz: {100 * self.error:.3g} % RMS ({others})\n"
        )

    def python(self) -> str:
        """Write the material for OpenSeesPy.

        Returns
        -------
        str
            Lines of Python, the error above them.
        """
        lines = (f"ops.uniaxialMaterial({', '.join(map(repr, c))})\n" for c in self.commands)
        return f"{self._comment()}import openseespy.opensees as ops\n\n{''.join(lines)}"

    def tcl(self) -> str:
        """Write the material for OpenSees' Tcl interpreter.

        Returns
        -------
        str
            Lines of Tcl, the error above them.
        """
        lines = (f"uniaxialMaterial {' '.join(map(str, c))}\n" for c in self.commands)
        return f"{self._comment()}{''.join(lines)}"


@checked
def opensees_material(
    device: Device, current: float, amplitude: float | None = None, frequency: float = USUAL
) -> OpenSeesMaterial:
    """Find the OpenSees material closest to a device at one coil current.

    Steel01, BoucWen and ElasticBilin, each parallel to a linear Viscous material, are fitted to the
    device's loops by least squares; the result is the one with the smallest error. OpenSees has no
    material that depends on a coil current.

    Parameters
    ----------
    device : Device
        Device in its scale, such as ``reference_isolators()``.
    current : float, A
        Coil current.
    amplitude : float, optional, m
        Largest deformation of the loops; the tested one by default.
    frequency : float, default 1
        Frequency of the loops, Hz. For a building, that of its isolated mode at this current, such
        as ``1 / isolated.effective(amplitude, current).period``: the force depends on the rate.

    Returns
    -------
    OpenSeesMaterial
        Material with its error.

    Raises
    ------
    InputError
        If the current is outside the device's range, or an argument cannot be used.
    """
    from scipy.optimize import least_squares

    amplitude = _amplitude(device, amplitude)
    for what, value, unit in (("amplitude", amplitude, "m"), ("frequency", frequency, "Hz")):
        if not 0 < value < np.inf:
            raise InputError(what, f"{value} {unit}", "above 0")
    current = float(device.checked_current(current))
    step, omega = 1.0 / (SAMPLES * frequency), 2.0 * np.pi * frequency
    time = step * np.arange(1, SAMPLES * (RISING + STEADY) + 1)
    size = amplitude * np.minimum(time * frequency / RISING, 1.0)
    rise = np.where(time * frequency < RISING, amplitude * frequency / RISING, 0.0)
    x = size * np.sin(omega * time)
    v = rise * np.sin(omega * time) + size * omega * np.cos(omega * time)
    simulator = DeviceSimulator(device, step)
    force = np.array([simulator.step(a, current, b) for a, b in zip(x, v, strict=True)])
    scale = float(np.sqrt(np.mean(force**2)))
    if not 0 < scale < np.inf:
        raise InputError(f"the device's force at {current:g} A", f"{scale} N", "some force")
    stiffness = float(np.abs(force).max()) / amplitude
    damping, results = stiffness / omega, {}
    for spring in SPRINGS:
        bounds = (*spring.bounds(stiffness, amplitude), (1e-9 * damping, 10 * damping))
        start = (*spring.start(stiffness, amplitude), 0.1 * damping)

        def model(logs: NDArray, spring: Spring = spring) -> NDArray:
            *numbers, viscosity = np.exp(logs).tolist()
            return spring.force(x, *numbers) + viscosity * v

        low, high = np.log(np.array(bounds)).T
        best = least_squares(
            lambda logs, model=model: (model(logs) - force) / scale,
            np.clip(np.log(start), low + 1e-6, high - 1e-6), bounds=(low, high),
        )  # fmt: skip
        *numbers, viscosity = np.exp(best.x).tolist()
        commands = (
            (spring.name, 1, *spring.arguments(*numbers)),
            ("Viscous", 2, viscosity, 1.0),
            ("Parallel", 3, 1, 2),
        )
        error = float(np.sqrt(np.mean(best.fun**2)))
        results[f"{spring.name} and Viscous"] = error, commands, model(best.x)
    errors = {name: error for name, (error, _, _) in results.items()}
    name = min(errors, key=lambda each: errors[each])
    error, commands, fitted = results[name]
    return OpenSeesMaterial(
        device, current, name, commands, frequency, error, errors, x, v, force, fitted
    )


def isolated_frequency(
    isolated: IsolatedStructure, current: float, amplitude: float | None = None
) -> float:
    """Frequency, Hz, of a building on its isolators at the amplitude; `USUAL` without a period."""
    size = _amplitude(isolated.elements[0].device, amplitude)
    try:
        return float(1.0 / isolated.effective(size, current).period)
    except InputError:
        return USUAL


def _amplitude(device: Device, amplitude: float | None) -> float:
    """The amplitude given, or the tested deformation."""
    if amplitude is not None:
        return amplitude
    tested = float(device.length * device.tested_deformation)
    if not np.isfinite(tested):
        raise InputError("the device has no tested deformation; expected: an amplitude, m")
    return tested
