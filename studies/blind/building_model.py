"""A base-isolated shear building on soil, integrated anew: Runge-Kutta 4 on forces, no matrices.

Displacements are relative to the free field. The foundation may sway and rock; floors move with it.
Superstructure damping is Rayleigh's on a held base, between floors and base only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

N_STOREYS = 5
RATE = 200
"""Samples a second of the record."""
SUBSTEPS = 8
CONTROL = 4
"""Samples between decisions of the on-off rule."""
RAMP = 12.0
"""The rule moves the current at this rate, A/s, and never jumps: a jump of the stiffness under a
deformed device would strike the building, and make half a sample's delay matter."""


@dataclass(frozen=True, eq=False)
class Building:
    """SI throughout. What a fault may change is a field here, the nominal value its default.

    ``isolator`` holds polynomials of the current (rows k, c, alpha, A, beta, gamma, n of Bouc-Wen).
    """

    masses: np.ndarray
    base_mass: float
    stiffnesses: np.ndarray
    rayleigh: tuple[float, float]
    isolator: np.ndarray
    largest_current: float = 3.0
    cracked_storey: int = 0
    crack: float = 0.0
    crack_drift: float = 0.0
    base_mass_factor: float = 1.0
    softening: float = 0.0
    softening_amplitude: float = 0.03
    softening_memory: float = 1.0
    extra_damping: float = 0.0
    extra_damping_power: float = 1.0
    delay: float = 0.0
    lag: float = 0.0
    limit: float = 1e9
    slew: float = 1e9
    sway: float = 0.0
    rock: float = 0.0
    wall: float = 0.0
    wall_gap: float = 1e9
    wall_power: float = 1.5
    wall_loss: float = 0.0
    squeeze: float = 0.0
    field_drag: float = 0.0
    one_sided: float = 0.0

    def respond(self, ground: np.ndarray, command: np.ndarray | None = None) -> Response:
        """Answer to a ground acceleration (m/s^2 at ``RATE``, linear between samples).

        Without a command the on-off rule sets the current: high while the isolators load.
        """
        has_command = command is not None
        scalars = np.array(
            [
                self.base_mass,
                *self.rayleigh,
                self.largest_current,
                self.crack,
                self.crack_drift,
                self.base_mass_factor,
                self.softening,
                self.softening_amplitude,
                self.softening_memory,
                self.extra_damping,
                self.extra_damping_power,
                self.lag,
                self.limit,
                self.slew,
                self.sway,
                self.rock,
                self.wall,
                self.wall_gap,
                self.wall_power,
                self.wall_loss,
                self.squeeze,
                self.field_drag,
                self.one_sided,
            ]
        )
        currents, accelerations, deformation = _integrate(
            ground,
            np.array(command) if has_command else np.zeros(ground.size),
            has_command,
            self.masses,
            self.stiffnesses,
            self.isolator,
            scalars,
            self.cracked_storey,
            self.delay * RATE,
        )
        return Response(currents, accelerations, deformation)


@dataclass(frozen=True, eq=False)
class Response:
    """Commanded current (A), absolute accelerations (base first), isolator deformation (m)."""

    current: np.ndarray
    accelerations: np.ndarray
    deformation: np.ndarray

    @property
    def channels(self) -> np.ndarray:
        """Accelerations and deformation, a row each."""
        return np.vstack([self.accelerations, self.deformation])


HEIGHT = 3.5
SOIL_STIFFNESS = 2e8
"""Sway stiffness for a sway of 1, N/m; rocking has it times ``ARM`` squared."""
ARM = 12.0
FOUNDATION_MASS = 4e5
SOIL_DAMPING = 0.10


@njit(cache=True)
def _polynomial(row, current):
    return row[0] + current * (row[1] + current * row[2])


@njit(cache=True)
def _rates(s, ground, current, peak, cracked, m, k, isolator, scalars, storey, out, acceleration):
    """State: y (base, floors), sway, rock; their velocities; z. Fills rates and accelerations."""
    n = m.size
    base_mass, mass_part, stiffness_part = scalars[0], scalars[1], scalars[2]
    crack, softening, amplitude = scalars[4], scalars[7], scalars[8]
    sway, rock = scalars[15], scalars[16]
    v0 = n + 3
    u, angle, uv, anglev, z = s[n + 1], s[n + 2], s[v0 + n + 1], s[v0 + n + 2], s[2 * v0]
    x, xv = s[0] - u - HEIGHT * angle, s[v0] - uv - HEIGHT * anglev

    kb, c = _polynomial(isolator[0], current), _polynomial(isolator[1], current)
    alpha, a = _polynomial(isolator[2], current), isolator[3, 0]
    beta, gamma, power = isolator[4, 0], isolator[5, 0], isolator[6, 0]
    soft = 1 - softening + softening / (1 + (peak / amplitude) ** 1.2)
    force = soft * (kb * x + alpha * z) + c * xv
    force += scalars[10] * np.sign(xv) * abs(xv) ** scalars[11]
    force += (scalars[21] * x * x + scalars[22] * current * abs(xv)) * xv
    force += scalars[23] * x * abs(x) * (x > 0)
    beyond = abs(x) - scalars[18]
    if beyond > 0:
        contact = scalars[17] * beyond ** scalars[19]
        force += np.sign(x) * max(0.0, contact * (1 + scalars[20] * xv * np.sign(x)))
    out[2 * v0] = a * xv - (beta * abs(xv) * z + gamma * xv * abs(z)) * abs(z) ** (power - 1)

    moment = force * HEIGHT
    for i in range(n + 1):
        out[i] = s[v0 + i]
        acceleration[i] = 0.0
    acceleration[0] = -force
    for i in range(n):
        drift = s[i + 1] - s[i] - HEIGHT * angle
        rate = s[v0 + i + 1] - s[v0 + i] - HEIGHT * anglev
        elastic = k[i] * (1 - crack) if (i + 1 == storey and cracked) else k[i]
        shear = elastic * drift + stiffness_part * k[i] * rate
        moment += shear * HEIGHT
        acceleration[i] += shear
        acceleration[i + 1] -= shear
        relative = s[v0 + i + 1] - s[v0] - (i + 1) * HEIGHT * anglev
        drag = mass_part * m[i] * relative
        acceleration[i + 1] -= drag
        acceleration[0] += drag
        moment += drag * (i + 1) * HEIGHT
    acceleration[0] /= base_mass * scalars[6]
    for i in range(n):
        acceleration[i + 1] /= m[i]
    for i in range(n + 1):
        out[v0 + i] = acceleration[i] - ground
    out[n + 1], out[n + 2] = uv, anglev
    out[v0 + n + 1], out[v0 + n + 2] = 0.0, 0.0
    if sway > 0:
        stiff = SOIL_STIFFNESS / sway
        damp = 2 * SOIL_DAMPING * np.sqrt(stiff * FOUNDATION_MASS)
        out[v0 + n + 1] = (force - stiff * u - damp * uv) / FOUNDATION_MASS - ground
    if rock > 0:
        stiff, inertia = SOIL_STIFFNESS * ARM**2 / rock, FOUNDATION_MASS * ARM**2 / 3
        damp = 2 * SOIL_DAMPING * np.sqrt(stiff * inertia)
        out[v0 + n + 2] = (moment - stiff * angle - damp * anglev) / inertia


@njit(cache=True)
def _asked(command, moment, limit):
    """What the supply is asked for at a moment (in samples), limited, linear between samples."""
    moment = min(max(moment, 0.0), command.size - 1.0)
    whole = min(int(moment), command.size - 2)
    return min(command[whole] + (moment - whole) * (command[whole + 1] - command[whole]), limit)


@njit(cache=True)
def _supplied(current, begin, end, duration, lag, slew):
    """Current at the end of a time in which what is asked for goes straight from one to another."""
    target = end
    if lag > 0:
        trail = (end - begin) / duration * lag
        target = end - trail + (current - begin + trail) * np.exp(-duration / lag)
    return current + min(max(target - current, -slew * duration), slew * duration)


@njit(cache=True)
def _integrate(ground, command, has_command, m, k, isolator, scalars, storey, delay):
    n, samples = m.size, ground.size
    size = 2 * (n + 3) + 1
    h = 1 / (RATE * SUBSTEPS)
    s, trial, total = np.zeros(size), np.zeros(size), np.zeros(size)
    rate, acceleration = np.zeros(size), np.zeros(n + 1)
    accelerations, deformation = np.zeros((n + 1, samples)), np.zeros(samples)
    v0, target, peak = n + 3, 0.0, 0.0
    currents = np.full(3, min(command[0], scalars[13]))
    # a crack without a threshold has been there before the record
    cracked = scalars[5] == 0.0
    for j in range(samples):
        x = s[0] - s[n + 1] - HEIGHT * s[n + 2]
        xv = s[v0] - s[v0 + n + 1] - HEIGHT * s[v0 + n + 2]
        if not has_command and j + 1 < samples:
            if j % CONTROL == 0:
                target = scalars[3] if x * xv > 0 else 0.0
            move = RAMP / RATE
            command[j + 1] = command[j] + min(max(target - command[j], -move), move)
        for sub in range(SUBSTEPS):
            # the current at the substep's start, middle and end
            currents[0] = currents[2]
            for half in range(2):
                moment = j + (sub + half / 2) / SUBSTEPS - delay
                begin = _asked(command, moment, scalars[13])
                end = _asked(command, moment + 0.5 / SUBSTEPS, scalars[13])
                currents[half + 1] = _supplied(
                    currents[half], begin, end, h / 2, scalars[12], scalars[14]
                )
            x = s[0] - s[n + 1] - HEIGHT * s[n + 2]
            peak = max(abs(x), peak * np.exp(-h / scalars[9]))
            if storey > 0 and not cracked:
                drift = s[storey] - s[storey - 1] - HEIGHT * s[n + 2]
                cracked = abs(drift) > scalars[5]
            after = ground[min(j + 1, samples - 1)]
            total[:] = 0.0
            for stage in range(4):
                part = 0.5 * ((stage + 1) // 2)
                g = ground[j] + (after - ground[j]) * (sub + part) / SUBSTEPS
                trial[:] = s + part * h * rate if stage > 0 else s
                _rates(
                    trial, g, currents[(stage + 1) // 2], peak, cracked, m, k, isolator, scalars,
                    storey, rate, acceleration,
                )  # fmt: skip
                if stage == 0 and sub == 0:
                    accelerations[:, j] = acceleration
                    deformation[j] = x
                total += rate * (1 / 6 if stage in (0, 3) else 1 / 3)
            s += h * total
    return command, accelerations, deformation
