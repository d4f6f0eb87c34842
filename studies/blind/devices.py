"""Devices written anew from the papers' equations, in N, mm, s, A: the truth of the blind tests.

Nothing here comes from the library, so an error shared with it cannot hide. Parameters are
polynomials of the current; ``factors`` that an effect puts on stiffness or loss multiply them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from .motion import Motion

STIFFNESS, LOSS, SHAPE = "stiffness", "loss", "shape"


@dataclass(frozen=True)
class Device:
    """A law with its parameters' polynomials of the current.

    ``coefficients`` maps a parameter to ascending powers of the current, ``kinds`` to what it is;
    ``law`` is the name of the same law in the library.
    """

    law: str
    coefficients: dict[str, tuple[float, ...]]
    kinds: dict[str, str]
    integrate: Callable[..., tuple[np.ndarray, np.ndarray]]

    def respond(self, motion: Motion, current, stiffness=1.0, loss=1.0):
        """Force (N) and dissipated power (N mm/s) on the motion's grid."""
        factor = {STIFFNESS: stiffness, LOSS: loss, SHAPE: 1.0}
        ones = np.ones(motion.time.size)
        values = [
            factor[self.kinds[name]] * np.polynomial.polynomial.polyval(current, c) * ones
            for name, c in self.coefficients.items()
        ]
        return self.integrate(motion.x, motion.v, motion.step, np.array(values))

    def shifted(self, name: str, power: int, change: float) -> Device:
        """The device with one coefficient changed; missing powers are zero."""
        row = list(self.coefficients[name])
        row += [0.0] * (power + 1 - len(row))
        row[power] += change
        return replace(self, coefficients=self.coefficients | {name: tuple(row)})


@njit(cache=True)
def _strain_stiffening(x, v, step, p):
    """Li & Li, Eqs 10-14: y stretches k1; z stretches the cubic spring. Runge-Kutta 4."""
    force, power = np.empty_like(x), np.empty_like(x)
    y, z = 0.0, 0.0
    for i in range(x.size):
        c0, k0, c1, k1, alpha = p[:, i]
        cubic = alpha * z**3
        force[i] = k1 * y + cubic
        slip = (k1 * y - k0 * (x[i] - y)) / c0
        power[i] = c0 * slip**2 + cubic**2 / c1
        if i + 1 == x.size:
            break
        y0, z0, dy, dz, ky, kz = y, z, 0.0, 0.0, 0.0, 0.0
        for stage in range(4):
            part = 0.5 * ((stage + 1) // 2)
            q = (1 - part) * p[:, i] + part * p[:, i + 1]
            if stage == 0:
                xs, vs = x[i], v[i]
            elif stage < 3:
                xs = (x[i] + x[i + 1]) / 2 + step * (v[i] - v[i + 1]) / 8
                vs = 1.5 * (x[i + 1] - x[i]) / step - (v[i] + v[i + 1]) / 4
            else:
                xs, vs = x[i + 1], v[i + 1]
            ys, zs = y0 + part * step * ky, z0 + part * step * kz
            ky = vs - (q[3] * ys - q[1] * (xs - ys)) / q[0]
            kz = vs - q[4] / q[2] * zs**3
            weight = 1 / 6 if stage in (0, 3) else 1 / 3
            dy += weight * ky
            dz += weight * kz
        y, z = y0 + step * dy, z0 + step * dz
    return force, power


@njit(cache=True)
def _bouc_wen(x, v, step, p):
    """Yu et al., Eqs 19-20, with a hysteretic variable in mm. Runge-Kutta 4."""
    force, power = np.empty_like(x), np.empty_like(x)
    z = 0.0
    for i in range(x.size):
        k, c, theta, a, beta, gamma, n, f0 = p[:, i]
        force[i] = k * x[i] + c * v[i] + theta * z + f0
        yielding = (beta * abs(v[i]) * z + gamma * v[i] * abs(z)) * abs(z) ** (n - 1)
        power[i] = c * v[i] ** 2 + theta * z * yielding / a
        if i + 1 == x.size:
            break
        middle = 1.5 * (x[i + 1] - x[i]) / step - (v[i] + v[i + 1]) / 4
        rate, total = 0.0, 0.0
        for stage in range(4):
            part = 0.5 * ((stage + 1) // 2)
            q = (1 - part) * p[:, i] + part * p[:, i + 1]
            vs = v[i] if stage == 0 else (middle if stage < 3 else v[i + 1])
            zs = z + part * step * rate
            rate = q[3] * vs - (q[4] * abs(vs) * zs + q[5] * vs * abs(zs)) * abs(zs) ** (q[6] - 1)
            total += rate * (1 / 6 if stage in (0, 3) else 1 / 3)
        z += step * total
    return force, power


def _kelvin_voigt(x, v, step, p):
    k, c = p
    return k * x + c * v, c * v**2


def _hybrid(x, v, step, p):
    """Yu et al., Eq 30, the jump at reversals smoothed over a velocity."""
    alpha, beta, gamma, width, f0, smoothing = p
    loop = gamma * np.exp(-(x**2) / (2 * width)) * np.tanh(v / smoothing)
    return alpha * np.sinh(beta * x) + loop + f0, loop * v


def _strain_stiffening_device() -> Device:
    # Li & Li, Table 2
    table = {
        "c0": (14.521, -0.9687),
        "k0": (22.108, 38.565),
        "c1": (1.4895, 0.0489),
        "k1": (35.927, 55.439),
        "alpha": (0.1332, -0.0256),
    }
    kinds = {name: LOSS if name.startswith("c") else STIFFNESS for name in table}
    return Device("strain_stiffening", table, kinds, _strain_stiffening)


def _bouc_wen_device() -> Device:
    # the size of Li & Li's Table 1, with a yield deformation of about 1.5 mm
    table = {
        "k": (4.0, 9.0),
        "c": (0.10, 0.12),
        "alpha": (3.0, 14.0, -1.5),
        "A": (1.0,),
        "beta": (0.35,),
        "gamma": (0.15,),
        "n": (1.6,),
        "F0": (0.0,),
    }
    kinds = dict.fromkeys(table, SHAPE) | {"k": STIFFNESS, "alpha": STIFFNESS, "c": LOSS}
    return Device("bouc_wen", table, kinds, _bouc_wen)


def _kelvin_voigt_device() -> Device:
    table = {"k": (5.0, 15.0), "c": (0.35, 0.75)}
    return Device("kelvin_voigt", table, {"k": STIFFNESS, "c": LOSS}, _kelvin_voigt)


def _hybrid_device() -> Device:
    # Yu et al., refitted means of Tables 1-4 (ERRATA), softened to stay in the force of the others
    table = {
        "alpha": (35.78, 8.883),
        "beta": (0.20, 0.012),
        "gamma": (5.248, 26.557, -4.803),
        "sigma_squared": (12.8058,),
        "F0": (0.0,),
        "v_s": (4.0,),
    }
    kinds = dict.fromkeys(table, SHAPE) | {"alpha": STIFFNESS, "gamma": LOSS}
    return Device("hybrid", table, kinds, _hybrid)


BASES: dict[str, Callable[[], Device]] = {
    "strain_stiffening": _strain_stiffening_device,
    "bouc_wen": _bouc_wen_device,
    "kelvin_voigt": _kelvin_voigt_device,
    "hybrid": _hybrid_device,
}


def perturbed(law: str, rng: np.random.Generator, spread: float = 0.15) -> Device:
    """A base device with every coefficient off by up to ``spread``.

    ``A`` and ``v_s`` stay: one is redundant in Bouc-Wen, the other is a convention.
    """
    device = BASES[law]()
    table = {
        name: tuple(c * rng.uniform(1 - spread, 1 + spread) for c in row)
        for name, row in device.coefficients.items()
        if name not in ("A", "v_s")
    }
    return replace(device, coefficients=device.coefficients | table)
