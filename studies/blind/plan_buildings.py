"""A base-isolated building in plan, integrated anew: frames, bearings and forces, no library.

Floors are rigid rectangles that move along x and y and turn. Frames stand along their four edges.
Bearings under two corners have a circular yield surface (Bouc-Wen with an exponent of 2).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.linalg import eigh

from .building_model import RATE as MOTION_RATE
from .buildings import ground_motion
from .effect import about

RATE = 50
"""Samples a second of the record."""
SUBSTEPS = 8
DURATION = 20.0
"""s, of which the last ten are quiet: there the noise of the ground motion shows."""
DAMPING_RATIO = 0.02
N_STOREYS = 2
AXES = ("x", "y", "rotation")


@dataclass(frozen=True, eq=False)
class PlanBuilding:
    """SI throughout. What a fault may change is a field here, the nominal value its default."""

    masses: np.ndarray  # Floors
    base_mass: float
    sides: tuple[float, float]  # Of the plan
    eccentricity: tuple[float, float]  # Centre of mass of all levels
    stiffnesses: np.ndarray  # (n_storeys, 2): Along x and y, both frames together
    bearing: dict[str, float]  # All bearings together: k, c, yield force q, yield displacement u
    lost: tuple[int, str, float] = (0, "", 0.0)  # Storey, direction, share of its stiffness
    one_frame: bool = False  # Whether one frame alone lost all of it
    added_mass: float = 0.0  # On the base
    added_at: tuple[float, float] = (0.0, 0.0)
    friction: float = 0.0  # N, all bearings together

    @property
    def corners(self) -> np.ndarray:
        """Positions of the bearings, (2, 2)."""
        return np.array([self.sides, self.sides]) * [[-0.5], [0.5]]

    def frames(self, faulty: bool = True) -> np.ndarray:
        """Stiffness of the storeys, (n_storeys, 3, 3), from their frames."""
        a, b = self.sides
        result = np.zeros((len(self.masses), 3, 3))
        for number, (k_x, k_y) in enumerate(self.stiffnesses, start=1):
            frames = [("x", k_x, (1.0, 0.0, -side * b / 2)) for side in (-1, 1)]
            frames += [("y", k_y, (0.0, 1.0, side * a / 2)) for side in (-1, 1)]
            for count, (axis, stiffness, row) in enumerate(frames):
                k = stiffness / 2
                storey, weak, share = self.lost
                if faulty and (number, axis) == (storey, weak):
                    if self.one_frame:
                        k -= stiffness * share * (count % 2)
                    else:
                        k *= 1 - share
                result[number - 1] += k * np.outer(row, row)
        return result

    def level(self, mass: float) -> np.ndarray:
        """Mass matrix of a level, (3, 3)."""
        (a, b), (x, y) = self.sides, self.eccentricity
        return _rigid(mass, mass * (a**2 + b**2) / 12, x, y)

    def fixed_base(self, faulty: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Mass and stiffness of the floors over a base that is held."""
        n = 3 * len(self.masses)
        mass, stiffness = np.zeros((n, n)), np.zeros((n, n))
        for i, storey in enumerate(self.frames(faulty)):
            here = slice(3 * i, 3 * i + 3)
            mass[here, here] = self.level(self.masses[i])
            stiffness[here, here] += storey
            if i:
                below = slice(3 * i - 3, 3 * i)
                stiffness[below, below] += storey
                stiffness[here, below] -= storey
                stiffness[below, here] -= storey
        return mass, stiffness

    def respond(self, ground: np.ndarray) -> Response:
        """Answer to ground accelerations (2, n), linear between samples."""
        mass, stiffness = self.fixed_base()
        # damping is that of the building without a fault
        sound_mass, sound = self.fixed_base(faulty=False)
        squares, shapes = eigh(sound, sound_mass)
        weighted = sound_mass @ shapes
        damping = (weighted * (2 * DAMPING_RATIO * np.sqrt(squares))) @ weighted.T
        base = self.level(self.base_mass) + _rigid(self.added_mass, 0.0, *self.added_at)
        base_inverse, inverse = np.linalg.inv(base), np.linalg.inv(mass)
        carried = np.tile(np.eye(3), (len(self.masses), 1))
        corners, n = self.corners, 3 * len(self.masses)
        k, c, q = (self.bearing[name] / len(corners) for name in ("k", "c", "q"))
        u = self.bearing["u"]

        def rates(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """Rates of base, floors, velocities and bearings; absolute accelerations."""
            x, v = s[: n + 3], s[n + 3 : 2 * n + 6]
            z = s[2 * n + 6 :].reshape(-1, 2)
            drift, rate = x[3:] - carried @ x[:3], v[3:] - carried @ v[:3]
            inner = stiffness @ drift + damping @ rate
            moved = x[:2] + x[2] * corners[:, ::-1] * (-1, 1)
            speed = v[:2] + v[2] * corners[:, ::-1] * (-1, 1)
            force = k * moved + c * speed + q * z
            if self.friction:
                size = np.sqrt((speed**2).sum(axis=1, keepdims=True) + 0.03**2)
                force = force + self.friction / len(corners) * speed / size
            power = (speed * z).sum(axis=1, keepdims=True)
            bent = (speed - 0.5 * (np.abs(power) + power) * z) / u
            torque = corners[:, 0] @ force[:, 1] - corners[:, 1] @ force[:, 0]
            pushed = carried.T @ inner - np.array([*force.sum(axis=0), torque])
            accelerated = np.concatenate([base_inverse @ pushed, -inverse @ inner])
            return np.concatenate([v, accelerated, bent.ravel()]), accelerated

        return _integrate(rates, ground, n + 3, corners.size)


@dataclass(frozen=True, eq=False)
class Response:
    """Absolute accelerations of base and floors (x, y, rotation each), displacement of the base."""

    accelerations: np.ndarray  # (3 (n_storeys + 1), n)
    displacement: np.ndarray  # (3, n)


def _rigid(mass: float, inertia: float, x: float, y: float) -> np.ndarray:
    """Mass matrix about the origin of a rigid body with its centre of mass at (x, y)."""
    about = inertia + mass * (x**2 + y**2)
    return np.array([[mass, 0, -mass * y], [0, mass, mass * x], [-mass * y, mass * x, about]])


def _integrate(rates: Callable, ground: np.ndarray, n: int, n_bearing: int) -> Response:
    """Kutta's fourth-order method; displacements are relative to the ground."""
    samples, h = ground.shape[1], 1 / (RATE * SUBSTEPS)
    s = np.zeros(2 * n + n_bearing)
    accelerations, displacement = np.zeros((n, samples)), np.zeros((3, samples))
    along = np.zeros((n, 2))
    along[::3, 0] = along[1::3, 1] = 1.0
    for j in range(samples):
        after = ground[:, min(j + 1, samples - 1)]
        for sub in range(SUBSTEPS):
            total, slope = np.zeros_like(s), np.zeros_like(s)
            for part, weight in ((0.0, 1 / 6), (0.5, 1 / 3), (0.5, 1 / 3), (1.0, 1 / 6)):
                a_g = ground[:, j] + (after - ground[:, j]) * (sub + part) / SUBSTEPS
                slope, absolute = rates(s + part * h * slope)
                slope[n : 2 * n] -= along @ a_g
                if sub == 0 and part == 0.0:
                    accelerations[:, j], displacement[:, j] = absolute, s[:3]
                total += weight * slope
            s = s + h * total
    return Response(accelerations, displacement)


def nominal_building(seed: int) -> PlanBuilding:
    """Two storeys on lead-rubber bearings, eccentric in plan; perturbed by the seed."""
    rng = np.random.default_rng([seed, 50])
    masses = np.array([about(rng, 2.5e5, 0.1) for _ in range(N_STOREYS)])
    base_mass, total = about(rng, 3e5, 0.1), 8e5
    stiffnesses = np.array([[about(rng, 1.2e8, 0.1), about(rng, 0.9e8, 0.1)] for _ in masses])
    sides = about(rng, 20.0, 0.1), about(rng, 14.0, 0.1)
    eccentricity = about(rng, 0.8), -about(rng, 0.5)
    bearing = {
        "k": total * (2 * np.pi / about(rng, 2.2, 0.1)) ** 2, "c": about(rng, 2e5),
        "q": about(rng, 0.06 * 9.81 * total), "u": about(rng, 0.012),
    }  # fmt: skip
    return PlanBuilding(masses, base_mass, sides, eccentricity, stiffnesses, bearing)


BIASED = "floor2_y_acceleration_m_s2"
FORMS = (
    ("storey_stiffness_loss", "along_x"),
    ("storey_stiffness_loss", "along_y"),
    ("storey_stiffness_loss", "one_frame"),
    ("base_mass_error", "centred"),
    ("base_mass_error", "eccentric"),
    ("coulomb_friction", "smooth"),
    ("extra_isolator_damping", "viscous"),
    ("sensor_bias", "constant"),
)
"""Name and form of every fault."""


def storey_of(seed: int) -> int:
    """Storey that a fault weakens."""
    return int(np.random.default_rng([seed, 51]).integers(1, N_STOREYS + 1))


def faulty(building: PlanBuilding, form: str, severity: float, seed: int) -> PlanBuilding:
    """A building with a fault; a biased sensor is none of its own."""
    a, b = building.sides
    storey, mass = storey_of(seed), severity * building.base_mass
    changes: dict[str, dict] = {
        "along_x": {"lost": (storey, "x", severity)},
        "along_y": {"lost": (storey, "y", severity)},
        "one_frame": {"lost": (storey, "x", severity), "one_frame": True},
        "centred": {"added_mass": mass, "added_at": building.eccentricity},
        "eccentric": {"added_mass": mass, "added_at": (0.3 * a, 0.3 * b)},
        "smooth": {"friction": severity * building.bearing["q"]},
        "viscous": {"bearing": building.bearing | {"c": (1 + severity) * building.bearing["c"]}},
        "constant": {},
    }
    return replace(building, **changes[form])


def severity_for(building: PlanBuilding, form: str, size: float, seed: int) -> float:
    """Severity at which a fault makes a misfit, RMS over RMS, mean over the channels."""
    nominal = signals(building, seed)
    measured = [name for name in nominal if not name.startswith("ground")]
    if form == "constant":
        return size * len(measured)
    severity = size
    for _ in range(4):
        there = signals(faulty(building, form, severity, seed), seed)
        errors = [
            np.linalg.norm(there[n] - nominal[n]) / np.linalg.norm(there[n]) for n in measured
        ]
        severity = min(
            severity * size / float(np.mean(errors)), 0.45 if form == "one_frame" else 3.0
        )
    return severity


def signals(building: PlanBuilding, seed: int, duration: float = DURATION) -> dict[str, np.ndarray]:
    """Channels of a record without noise; the second ground motion is 0.7 of another one."""
    thinned = round(MOTION_RATE / RATE)
    ground = np.array(
        [
            share * ground_motion(2 * seed + k, duration)[::thinned]
            for k, share in enumerate((1.0, 0.7))
        ]
    )
    response = building.respond(ground)
    result = {f"ground_{axis}_acceleration_m_s2": ground[k] for k, axis in enumerate("xy")}
    levels = ("base", *(f"floor{i}" for i in range(1, N_STOREYS + 1)))
    for k, values in enumerate(response.accelerations):
        axis = AXES[k % 3]
        unit = "rad_s2" if axis == "rotation" else "m_s2"
        result[f"{levels[k // 3]}_{axis}_acceleration_{unit}"] = values
    for axis, values in zip("xy", response.displacement, strict=False):
        result[f"isolator_{axis}_displacement_m"] = values
    return result


def record(
    building: PlanBuilding,
    seed: int,
    bias: float = 0.0,
    duration: float = DURATION,
    noise: float = 0.01,
) -> dict[str, np.ndarray]:
    """Columns of a record; noise and bias are shares of each channel's RMS."""
    rng = np.random.default_rng([seed, 52])
    columns = {}
    for name, values in signals(building, seed, duration).items():
        size = np.sqrt(np.mean(values**2))
        columns[name] = values + noise * size * rng.standard_normal(values.size)
        if name == BIASED:
            columns[name] += bias * size
    return {"time_s": np.arange(values.size) / RATE} | columns


def write(building: PlanBuilding, columns: dict[str, np.ndarray], folder: Path) -> Path:
    """Write ``record.csv`` and the nominal building's ``building.toml``."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = np.column_stack(list(columns.values())).tolist()
    text = "\n".join(",".join(f"{value:.8g}" for value in row) for row in rows)
    (folder / "record.csv").write_text(f"{','.join(columns)}\n{text}\n")
    (folder / "building.toml").write_text(description(building))
    return folder


def description(building: PlanBuilding) -> str:
    """Scenario of what an engineer knows of the building."""
    k, c, q, u = (building.bearing[name] for name in ("k", "c", "q", "u"))
    columns = building.stiffnesses.T.tolist()
    motion = '[[ground]]\nname = "el_centro_1940_ns"\nstop_s = 8.0\n'
    return f"""
{motion}
{motion}scale_factor = 0.7

[structure]
kind = "plan"
floor_masses_kg = {building.masses.tolist()}
storey_stiffnesses_x_N_per_m = {columns[0]}
storey_stiffnesses_y_N_per_m = {columns[1]}
base_mass_kg = {building.base_mass!r}
plan_m = {list(building.sides)}
eccentricity_m = {list(building.eccentricity)}
isolator_positions_m = {building.corners.tolist()}
damping_ratio = {DAMPING_RATIO}

[isolator]
law = "bouc_wen"
length_scale = 1.0
force_scale = 1.0
biaxial = true

[isolator.parameters]
k = {k!r}
c = {c!r}
alpha = {q / u!r}
A = 1.0
beta = {0.5 / u**2!r}
gamma = {0.5 / u**2!r}
n = 2.0
F0 = 0.0

[[controller]]
name = "passive_off"
"""
