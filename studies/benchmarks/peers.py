"""The reference building as other tools would integrate it: SciPy and OpenSeesPy.

Each is written as well as its users would write it, from the matrices and the published law.
"""

from __future__ import annotations

import ctypes
import importlib.util
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import odeint, solve_ivp

from ground_motions import Record
from isolation_sim.structures import IsolatedStructure


class FirstOrder:
    """The building on strain-stiffening isolators at a held current, as y' = f(t, y)."""

    def __init__(self, plant: IsolatedStructure, record: Record, current: float):
        structure, device = plant.structure, plant.elements[0].device
        self.n = structure.n_dofs
        inverse = np.linalg.inv(structure.mass)
        self.on_displacement = -inverse @ structure.stiffness
        self.on_velocity = -inverse @ structure.damping
        self.on_force = -inverse @ plant.elements[0].direction * device.force_scale
        self.length = device.length
        self.parameters = np.array(device.parameters_at(current))
        self.ground, self.dt = np.array(record.acceleration), record.dt
        self.time = np.array(record.time)
        self.start = np.zeros(2 * self.n + 2)

    def rate(self) -> Callable[[float, NDArray], NDArray]:
        """Make the right-hand side, as it is written in NumPy; Numba compiles it as it stands."""
        n, length, ground, dt = self.n, self.length, self.ground, self.dt
        c0, k0, c1, k1, alpha = self.parameters.tolist()
        on_q, on_v, on_f = self.on_displacement, self.on_velocity, self.on_force

        def rate(t, y):
            k = min(int(t / dt), len(ground) - 2)
            a = ground[k] + (ground[k + 1] - ground[k]) * (t / dt - k)
            q, v, s, z = y[:n], y[n : 2 * n], y[2 * n], y[2 * n + 1]
            x, speed = q[0] / length, v[0] / length
            out = np.empty(2 * n + 2)
            out[:n] = v
            out[n : 2 * n] = on_q @ q + on_v @ v + on_f * (k1 * s + alpha * z**3) - a
            out[2 * n] = speed + (k0 * x - (k0 + k1) * s) / c0
            out[2 * n + 1] = speed - alpha / c1 * z**3
            return out

        return rate

    def rate_in_products(self) -> Any:
        """Compile the right-hand side with Numba as it is written in NumPy, for ``odeint``."""
        from numba import njit

        rate = njit(self.rate())
        rate(0.0, self.start)
        return rate

    def rate_in_loops(self) -> Any:
        """Compile the right-hand side with Numba, loops written out, for ``odeint``."""
        from numba import njit

        n, length, ground, dt = self.n, self.length, self.ground, self.dt
        c0, k0, c1, k1, alpha = self.parameters.tolist()
        on_q, on_v, on_f = self.on_displacement, self.on_velocity, self.on_force

        @njit
        def rate(t, y):
            out = np.empty(2 * n + 2)
            k = min(int(t / dt), len(ground) - 2)
            a = ground[k] + (ground[k + 1] - ground[k]) * (t / dt - k)
            x, v = y[0] / length, y[n] / length
            force = k1 * y[2 * n] + alpha * y[2 * n + 1] ** 3
            for i in range(n):
                total = on_f[i] * force - a
                for j in range(n):
                    total += on_q[i, j] * y[j] + on_v[i, j] * y[n + j]
                out[i], out[n + i] = y[n + i], total
            out[2 * n] = v + (k0 * x - (k0 + k1) * y[2 * n]) / c0
            out[2 * n + 1] = v - alpha / c1 * y[2 * n + 1] ** 3
            return out

        rate(0.0, self.start)
        return rate

    def by_solve_ivp(self, tolerance: float) -> NDArray:
        """States at the samples by ``solve_ivp``'s RK45, (n_samples, n_states)."""
        solution = solve_ivp(
            self.rate(),
            (0.0, self.time[-1]),
            self.start,
            t_eval=self.time,
            rtol=tolerance,
            atol=tolerance * 1e-3,
        )
        return solution.y.T

    def by_odeint(self, rate: Any, tolerance: float) -> NDArray:
        """States at the samples by ``odeint`` (LSODA), (n_samples, n_states)."""
        return odeint(
            rate, self.start, self.time, rtol=tolerance, atol=tolerance * 1e-3, tfirst=True
        )


def load_opensees() -> Any | None:
    """OpenSeesPy, or None where it is not installed or does not load."""
    result = importlib.util.find_spec("openseespylinux")
    if result is None or not result.submodule_search_locations:
        return None
    # its wheel does not find the libraries that it ships
    folder = Path(result.submodule_search_locations[0]) / "lib"
    for name in ("libquadmath.so.0", "libgfortran.so.4", "libblas.so.3", "liblapack.so.3"):
        if (folder / name).exists():
            ctypes.CDLL(str(folder / name), mode=ctypes.RTLD_GLOBAL)
    try:
        import openseespy.opensees as opensees
    except (ImportError, RuntimeError):
        return None
    return opensees


def opensees_analysis(
    ops: Any, plant: IsolatedStructure, record: Record, current: float
) -> tuple[Any, Path]:
    """Set the building up in OpenSeesPy on the nearest isolator that it has.

    The upper branch of the law is the standard solid, which is a spring beside a Maxwell element;
    of the lower branch OpenSees has only the dashpot: it is left out.
    """
    structure, device = plant.structure, plant.elements[0].device
    scale = device.force_scale / device.length
    c0, k0, _, k1, _ = (np.array(device.parameters_at(current)) * scale).tolist()
    masses = np.diag(structure.mass)
    stiffness = -structure.stiffness[0, 1]
    on_mass = -structure.damping[0, -1] / masses[-1]  # Rayleigh, relative to the base
    on_stiffness = -structure.damping[1, 2] / stiffness
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(0, 0.0)
    ops.fix(0, 1)
    for i, mass in enumerate(masses):
        ops.node(i + 1, 0.0, "-mass", float(mass))
    ops.uniaxialMaterial("Elastic", 1, k0 * k1 / (k0 + k1))
    ops.uniaxialMaterial("Maxwell", 2, k1**2 / (k0 + k1), c0 * (k1 / (k0 + k1)) ** 2, 1.0, 1.0)
    ops.uniaxialMaterial("Parallel", 3, 1, 2)
    ops.uniaxialMaterial("Elastic", 4, float(stiffness), float(on_stiffness * stiffness))
    ops.uniaxialMaterial("Elastic", 5, 0.0, float(on_mass * masses[-1]))
    ops.element("zeroLength", 1, 0, 1, "-mat", 3, "-dir", 1)
    for i in range(1, len(masses)):
        ops.element("zeroLength", 1 + i, i, i + 1, "-mat", 4, "-dir", 1, "-doRayleigh", 0)
        ops.element("zeroLength", 100 + i, 1, i + 1, "-mat", 5, "-dir", 1, "-doRayleigh", 0)
    ops.timeSeries("Path", 1, "-dt", record.dt, "-values", *record.acceleration.tolist())
    ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
    handle, name = tempfile.mkstemp(suffix=".out")
    os.close(handle)
    nodes = list(range(1, len(masses) + 1))
    ops.recorder("Node", "-file", name, "-time", "-node", *nodes, "-dof", 1, "disp")
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("BandGeneral")
    ops.test("NormDispIncr", 1e-10, 20)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")

    def run() -> None:
        if ops.analyze(len(record.acceleration) - 1, record.dt) != 0:
            raise RuntimeError("OpenSees did not converge")

    return run, Path(name)
