"""A second family of hidden effects, in SI units: a device and all of its effects in one ODE.

Nothing of the first family is used: every cause has other forms, memories are states of the same
system (or relays), and Kutta's third-order method integrates all of it. An effect is a set of
numbers in ``Effects``; the numbers that stay 0 switch it off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.signal import butter, sosfilt

N_STATES = 21
RELAYS = 24
"""Relays of the Preisach operator along each axis."""
RATED = 2.2
"""A: all relays are up at this current."""


class Effects(NamedTuple):
    """Numbers of all effects. A length, time or scale may be 1 where its effect is off."""

    lag: float = 0.0  # s, of a second-order field
    lag_damping: float = 1.0
    saturation: float = 0.0  # 1/A
    preisach: float = 0.0  # share
    coercive: float = 0.5  # A
    trailing: float = 0.0  # A, of a field that trails the current
    trailing_width: float = 1.0  # A
    gap: float = 0.0  # share lost at gap_reach
    gap_reach: float = 1.0  # m
    heat: float = 0.0  # kelvin for a joule, times the softening for a kelvin
    heat_loss: float = 1.0  # softening of losses over that of stiffness
    heat_path: float = 0.0  # 1/s, core to plates
    heat_room: float = 0.0  # 1/s, plates to room
    heat_ratio: float = 1.0  # heat capacity of the core over that of the plates
    mullins: float = 0.0
    mullins_length: float = 1.0  # m
    payne: float = 0.0
    payne_length: float = 1.0  # m
    payne_time: float = 1.0  # s
    cold: float = 0.0  # 1/K
    damage: float = 0.0
    damage_scale: float = 1.0  # m^2
    work_damage: float = 0.0
    work_scale: float = 1.0  # J
    asymmetry: float = 0.0
    asymmetry_force: float = 1.0  # N
    bending: float = 0.0  # N/m^2, a force in x^2
    eyring: float = 0.0  # N
    eyring_velocity: float = 1.0  # m/s
    arms: float = 0.0  # N/m
    arm_exponent: float = 0.0  # of the times in the arms' stiffness
    arm_time: float = 1.0  # s, of the middle arm
    arm_ratio: float = 1.0  # from arm to arm
    relaxation: float = 0.0  # N/m, of each of two arms
    relaxation_time: float = 1.0  # s, of the first; that of the second is four times as long
    creep: float = 0.0  # N/m
    creep_time: float = 1.0  # s
    creep_length: float = 1.0  # m
    friction: float = 0.0  # N
    stribeck: float = 0.0  # static over sliding friction, minus 1
    stribeck_velocity: float = 1.0  # m/s
    bristle: float = 1.0  # m
    stop: float = 0.0  # N/m^1.5
    stop_gap: float = 1.0  # m
    stop_loss: float = 0.0  # s/m
    offset: float = 0.0  # N
    offset_drift: float = 0.0  # 1/s
    mass: float = 0.0  # kg
    mount: float = 300.0  # rad/s
    delay: float = 0.0  # s, of the force channel
    filter: float = 0.0  # s, delay of an analogue filter in the force channel


class Signals(NamedTuple):
    """Motion, current and room of a run; every other point lies within a step."""

    step: float  # s, between points
    x: np.ndarray  # m
    v: np.ndarray  # m/s
    a: np.ndarray  # m/s^2
    current: np.ndarray  # A
    warmer: float  # K, room over the temperature of the parameters


@njit(error_model="numpy", cache=True)
def _rates(k, s, relay, largest, u, bouc_wen, c, e, out):
    """Rates of all states at point ``k``, and the force, N."""
    x, v, current = u.x[k], u.v[k], u.current[k]
    # field
    sought = np.arctan(e.saturation * current) / e.saturation if e.saturation > 0 else current
    sought += e.preisach * (relay - sought) - e.trailing * s[15]
    slope = (u.current[min(k + 1, u.x.size - 1)] - u.current[max(k - 1, 0)]) / (2 * u.step)
    out[15] = (slope - abs(slope) * s[15]) / e.trailing_width
    sought *= 1 - e.gap * np.sin(min(abs(x) / e.gap_reach, 1.0) * np.pi / 2) ** 2
    field = sought
    out[2], out[3] = 0.0, 0.0
    if e.lag > 0:
        field = s[2]
        out[2] = s[3]
        time = max(e.lag, 1e-3)
        out[3] = ((sought - s[2]) / time - 2 * e.lag_damping * s[3]) / time
    # softening
    g = np.exp(-e.heat * s[4]) / (1 + np.exp(e.cold * u.warmer)) * 2
    g /= 1 + e.mullins * np.log1p((largest / e.mullins_length) ** 2)
    g *= 1 - e.payne * (1 - np.exp(-np.sqrt(abs(s[6])) / e.payne_length))
    g /= (1 + s[7] / e.damage_scale) ** e.damage
    g *= 1 - e.work_damage * np.tanh(s[8] / e.work_scale)
    h = g * np.exp(-(e.heat_loss - 1) * e.heat * s[4])
    p = c[:, 0] + c[:, 1] * field + c[:, 2] * field**2
    if bouc_wen:
        z = s[0]
        yielding = (p[4] * abs(v) * z + p[5] * v * abs(z)) * abs(z) ** (p[6] - 1)
        out[0], out[1] = p[3] * v - yielding, 0.0
        force = g * (p[0] * x + p[2] * z) + h * p[1] * v + p[7]
        power = h * p[1] * v**2 + g * p[2] * z * yielding / p[3]
    else:
        slip = g * (p[3] * s[0] - p[1] * (x - s[0])) / (h * p[0])
        cubic = g * p[4] * s[1] ** 3
        out[0], out[1] = v - slip, v - cubic / (h * p[2])
        force = g * p[3] * s[0] + cubic
        power = h * p[0] * slip**2 + cubic**2 / (h * p[2])
    out[4] = power - e.heat_path * (s[4] - s[5])
    out[5] = e.heat_path * e.heat_ratio * (s[4] - s[5]) - e.heat_room * s[5]
    out[6] = (2 * x**2 - s[6]) / e.payne_time
    out[7] = abs(v * x)
    out[8] = power
    force *= 1 + e.asymmetry * np.tanh(force / e.asymmetry_force)
    # forces beside the device
    force += e.bending * x**2 + e.eyring * np.arcsinh(v / e.eyring_velocity)
    for j in range(5):
        decades = (j - 2) * np.log10(e.arm_ratio)
        out[16 + j] = v - s[16 + j] / (e.arm_time * 10**decades)
        force += e.arms * 10 ** (-e.arm_exponent * decades) * s[16 + j]
    for j in range(2):
        out[9 + j] = v - s[9 + j] / (e.relaxation_time * 4**j)
        force += e.relaxation * s[9 + j]
    out[12] = v - s[12] / e.creep_time * np.sqrt(abs(s[12]) / e.creep_length)
    force += e.creep * s[12]
    level = 1 + e.stribeck * np.exp(-((v / e.stribeck_velocity) ** 2))
    out[13] = (v - abs(v) * s[13] / level) / e.bristle
    force += e.friction * s[13]
    beyond = max(abs(x) - e.stop_gap, 0.0)
    force += e.stop * np.sign(x) * beyond**1.5 * max(1 + e.stop_loss * v * np.sign(x), 0.0)
    out[14] = e.mount * (u.a[k] - s[14])
    force += e.mass * s[14] + e.offset * (1 + e.offset_drift * k * u.step)
    return force


@njit(error_model="numpy", cache=True)
def _run(u, bouc_wen, c, e):
    """Force at every second point, N: Kutta's third-order method."""
    n = (u.x.size + 1) // 2
    force, s = np.empty(n), np.zeros(N_STATES)
    k1, k2, k3 = np.zeros(N_STATES), np.zeros(N_STATES), np.zeros(N_STATES)
    up = np.zeros((RELAYS, RELAYS))
    weight, whole = np.zeros((RELAYS, RELAYS)), 0.0
    levels = (np.arange(RELAYS) + 0.5) / RELAYS * RATED
    for i in range(RELAYS):
        for j in range(i + 1):
            weight[i, j] = np.exp(-(levels[i] - levels[j]) / e.coercive)
            whole += weight[i, j]
    largest, h, relay = 0.0, 2 * u.step, 0.0
    s[2] = u.current[0]
    for i in range(n):
        k = 2 * i
        largest = max(largest, abs(u.x[k]))
        if e.preisach > 0:
            total = 0.0
            for row in range(RELAYS):
                for column in range(row + 1):
                    if u.current[k] >= levels[row]:
                        up[row, column] = 1.0
                    elif u.current[k] < levels[column]:
                        up[row, column] = 0.0
                    total += weight[row, column] * up[row, column]
            relay = total / whole * RATED
        if i == 0:
            # a steady field to start with
            _rates(k, s, relay, largest, u, bouc_wen, c, e, k1)
            s[2] += k1[3] * max(e.lag, 1e-3) ** 2
            s[6] = 0.0
        force[i] = _rates(k, s, relay, largest, u, bouc_wen, c, e, k1)
        if i + 1 == n:
            break
        _rates(k + 1, s + h / 2 * k1, relay, largest, u, bouc_wen, c, e, k2)
        _rates(k + 2, s - h * k1 + 2 * h * k2, relay, largest, u, bouc_wen, c, e, k3)
        s = s + h / 6 * (k1 + 4 * k2 + k3)
    return force


@dataclass(frozen=True, eq=False)
class SecondDevice:
    """A law with its parameters as polynomials of the field, (n_parameters, 3), SI."""

    law: str
    coefficients: np.ndarray

    def respond(self, motion: Signals, effects: Effects) -> np.ndarray:
        """Force as the channel shows it, N."""
        force = _run(motion, self.law == "bouc_wen", self.coefficients, effects)
        step = 2 * motion.step
        time = step * np.arange(force.size)
        force = np.interp(time - effects.delay, time, force)
        if effects.filter > 0:
            # two Butterworth poles delay by sqrt(2) over their corner
            corner = np.sqrt(2) / (2 * np.pi * effects.filter)
            sections = butter(2, min(corner, 0.4 / step), fs=1 / step, output="sos")
            force = sosfilt(sections, force)
        return force

    def shifted(self, row: int, power: int) -> SecondDevice:
        """The device with one coefficient moved by a little."""
        table = self.coefficients.copy()
        table[row, power] += 1e-4 * (np.max(np.abs(table[row])) or 1.0) / 2.0**power
        return replace(self, coefficients=table)


_BASES = {
    # k, c, alpha, A, beta, gamma, n, F0
    "bouc_wen": [(2e4, 8e3), (800, 300), (3e4, 2.5e4, -2e3), (1,), (480,), (290,), (1.3,), (0,)],
    # c0, k0, c1, k1, alpha
    "strain_stiffening": [
        (7.2e4, -5e3), (1.1e5, 1.9e5), (7.4e3, 250), (1.8e5, 2.8e5), (7.4e7, -1.4e7),
    ],
}  # fmt: skip


def second_device(law: str, rng: np.random.Generator) -> SecondDevice:
    """A base device with every coefficient off by up to 15 %; A stays, for it is redundant."""
    table = np.array([[*row, *[0.0] * (3 - len(row))] for row in _BASES[law]], float)
    factor = rng.uniform(0.85, 1.15, table.shape)
    if law == "bouc_wen":
        factor[3] = 1.0
    return SecondDevice(law, table * factor)


class SecondForm(NamedTuple):
    """The number of ``Effects`` that is the severity, its limit, and the shape's numbers."""

    severity: str
    limit: float
    shape: dict[str, float]

    def draw(self, rng: np.random.Generator) -> SecondForm:
        """The form with its shape off by up to 20 %."""
        return self._replace(
            shape={name: value * rng.uniform(0.8, 1.2) for name, value in self.shape.items()}
        )

    def at(self, severity: float, effects: Effects) -> Effects:
        """Add the effect to others."""
        return effects._replace(**{self.severity: severity}, **self.shape)


def _form(severity: str, limit: float = np.inf, **shape: float) -> SecondForm:
    return SecondForm(severity, limit, shape)


SECOND_FORMS: dict[str, dict[str, SecondForm]] = {
    "current_lag": {
        "second_order": _form("lag", 0.4, lag_damping=0.9),
        "oscillating": _form("lag", 0.3, lag_damping=0.5),
    },
    "field_saturation": {"arctan": _form("saturation", 3.0)},
    "magnetic_remanence": {
        "preisach": _form("preisach", 0.9, coercive=2.0),
        "trailing": _form("trailing", 0.6, trailing_width=0.4),
    },
    "field_gap_coupling": {"cosine": _form("gap", 0.9, gap_reach=0.045)},
    "self_heating": {
        "core_and_plates": _form(
            "heat", 1e-2, heat_loss=1.0, heat_path=0.25, heat_room=0.05, heat_ratio=0.5
        ),
        "losses_more": _form("heat", 1e-2, heat_loss=2.0, heat_path=0.15, heat_room=0.03,
                             heat_ratio=0.2),
    },
    "stress_softening": {"logarithmic": _form("mullins", 2.0, mullins_length=0.012)},
    "amplitude_softening": {
        "exponential": _form("payne", 0.8, payne_length=0.012, payne_time=1.2),
    },
    "ambient_temperature": {"logistic": _form("cold", 0.1)},
    "cyclic_degradation": {
        "power_of_travel": _form("damage", 1.0, damage_scale=0.003),
        "work": _form("work_damage", 0.8, work_scale=600.0),
    },
    "tension_compression_asymmetry": {
        "by_force": _form("asymmetry", 0.6, asymmetry_force=800.0),
        "square": _form("bending"),
    },
    "weak_rate_dependence": {
        "eyring": _form("eyring", eyring_velocity=0.02),
        "prony": _form("arms", arm_exponent=0.2, arm_time=0.3, arm_ratio=5.0),
    },
    "extra_relaxation": {
        "nonlinear_creep": _form("creep", creep_time=0.5, creep_length=0.01),
        "two_times": _form("relaxation", relaxation_time=0.3),
    },
    "coulomb_friction": {
        "lugre": _form("friction", stribeck=0.3, stribeck_velocity=0.01, bristle=3e-4),
        "smooth": _form("friction", stribeck=0.0, stribeck_velocity=0.01, bristle=1e-3),
    },
    "end_stop": {"hunt_crossley": _form("stop", stop_gap=0.029, stop_loss=1.0)},
    "force_offset": {"drifting": _form("offset", offset_drift=0.04)},
    "inertia_force": {"on_a_mount": _form("mass", mount=300.0)},
    "sensor_delay": {"shifted": _form("delay", 0.05), "butterworth": _form("filter", 0.05)},
}  # fmt: skip


def with_effects(forms: Sequence[tuple[SecondForm, float]]) -> Effects:
    """The numbers of several effects with their severities."""
    effects = Effects()
    for form, severity in forms:
        effects = form.at(severity, effects)
    return effects
