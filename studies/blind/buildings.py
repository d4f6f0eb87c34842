"""Building records with hidden faults, in the record format; what the engineer knows of them.

The recorded current is the command. The description that goes with the record is the nominal
building (TOML), in which the faults are absent. The size of a fault is the misfit of the nominal
building under the recorded ground and command, were it alone: RMS over RMS, mean over the channels.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from scipy.signal import lfilter

from .building_model import N_STOREYS, RAMP, RATE, Building, Response
from .effect import about

CHANNELS = (
    "base_acceleration_m_s2",
    *(f"floor{i}_acceleration_m_s2" for i in range(1, N_STOREYS + 1)),
    "isolator_displacement_m",
)
ISOLATOR = ("k", "c", "alpha", "A", "beta", "gamma", "n")
DAMPING_RATIO = 0.02
SENSOR = "sensor_bias"


def nominal_building(seed: int) -> Building:
    """Five storeys on Bouc-Wen isolators that a current stiffens; perturbed by the seed."""
    rng = np.random.default_rng([seed, 40])
    masses = np.array([about(rng, 2.5e5, 0.1) for _ in range(N_STOREYS)])
    taper = np.linspace(1.15, 0.85, N_STOREYS)
    stiffnesses = np.array([about(rng, 4.9e8 * t, 0.1) for t in taper])
    yielding = about(rng, 0.02)
    power = about(rng, 1.5, 0.1)
    isolator = np.zeros((len(ISOLATOR), 3))
    isolator[0, :2] = about(rng, 6e6, 0.1), about(rng, 2.0e6, 0.1)
    isolator[1, 0] = about(rng, 2.5e5)
    isolator[2, :2] = about(rng, 4e6), about(rng, 2.5e6)
    isolator[3, 0] = 1.0
    isolator[4, 0] = 0.65 * yielding**-power
    isolator[5, 0] = 0.35 * yielding**-power
    isolator[6, 0] = power
    return Building(
        masses, about(rng, 3e5, 0.1), stiffnesses, _rayleigh(masses, stiffnesses), isolator
    )


def _rayleigh(masses: np.ndarray, stiffnesses: np.ndarray) -> tuple[float, float]:
    """Coefficients for ``DAMPING_RATIO`` at the first and third modes on a held base."""
    above = np.append(stiffnesses[1:], 0.0)
    matrix = np.diag(stiffnesses + above) - np.diag(above[:-1], 1) - np.diag(above[:-1], -1)
    root = np.sqrt(masses)
    omega = np.sqrt(np.linalg.eigvalsh(matrix / np.outer(root, root)))
    first, third = omega[0], omega[2]
    scale = 2 * DAMPING_RATIO / (first + third)
    return float(scale * first * third), float(scale)


def ground_motion(seed: int, duration: float = 25.0, peak: float = 3.0) -> np.ndarray:
    """White noise through a Kanai-Tajimi and a high-pass filter, in an envelope; m/s^2."""
    rng = np.random.default_rng([seed, 41])
    t = np.arange(round(duration * RATE)) / RATE
    omega, zeta = about(rng, 12.0), 0.6
    decay, ring = np.exp(-zeta * omega / RATE), omega * np.sqrt(1 - zeta**2) / RATE
    soil = [1.0, -2 * decay * np.cos(ring), decay**2]
    motion = lfilter([1.0, -decay], soil, rng.standard_normal(t.size))
    slow = np.exp(-2 * np.pi * 0.15 / RATE)
    for _ in range(2):
        motion = lfilter([1.0, -1.0], [1.0, -slow], motion)
    motion *= np.minimum(t / 2.0, 1.0) ** 2 * np.exp(-np.maximum(t - 9.0, 0.0) / 4.0)
    return peak * motion / np.max(np.abs(motion))


Change = Callable[[Building, float], Building]
Reading = Callable[[Response, float], np.ndarray]


@dataclass(frozen=True)
class Fault:
    """One way a building differs: ``change`` on the building, or ``reading`` on its sensors."""

    name: str
    form: str
    limit: float
    change: Change = lambda building, _: building
    reading: Reading = lambda response, _: response.channels
    storey: int | None = None


def _biased(channel: int, drifting: bool) -> Reading:
    """A constant offset, or one that drifts in, as a share of the channel's RMS."""

    def read(response: Response, s: float) -> np.ndarray:
        channels = response.channels.copy()
        n = channels.shape[1]
        course = np.linspace(0.0, 2.0, n) if drifting else np.ones(n)
        channels[channel] += s * np.sqrt(np.mean(channels[channel] ** 2)) * course
        return channels

    return read


def faults(seed: int) -> list[Fault]:
    """Every fault of the design's list in every form, shapes and storeys by the seed."""
    rng = np.random.default_rng([seed, 42])
    storey = int(rng.integers(1, N_STOREYS + 1))
    sensor = int(rng.integers(len(CHANNELS)))
    made: list[Fault] = []

    def add(name: str, form: str, limit: float, build: Callable[[float], dict], **more) -> None:
        made.append(Fault(name, form, limit, lambda b, s: replace(b, **build(s)), **more))

    at = {"cracked_storey": storey}
    nominal = nominal_building(seed)
    calm = nominal.respond(ground_motion(seed))
    above = nominal.masses[storey - 1 :] @ calm.accelerations[storey:]
    drift = about(rng, 0.6) * float(np.max(np.abs(above))) / nominal.stiffnesses[storey - 1]
    name = "storey_stiffness_loss"
    add(name, "weak_from_the_start", 0.8, lambda s: at | {"crack": s}, storey=storey)
    add(name, "cracks_in_the_record", 0.8, lambda s: at | {"crack": s, "crack_drift": drift},
        storey=storey)  # fmt: skip
    add("base_mass_error", "heavier", 4.0, lambda s: {"base_mass_factor": 1 + s})
    add("base_mass_error", "lighter", 0.8, lambda s: {"base_mass_factor": 1 - s})
    critical = about(rng, 0.03)
    for form, memory in (("fading_envelope", 3.0), ("present_peak", 0.4)):
        fixed = {"softening_amplitude": critical, "softening_memory": memory}
        add("isolator_amplitude_softening", form, 0.8, lambda s, f=fixed: f | {"softening": s})
    damping = 1e6
    add("extra_isolator_damping", "viscous", 10.0, lambda s: {"extra_damping": s * damping})
    add("extra_isolator_damping", "power_of_velocity", 10.0,
        lambda s: {"extra_damping": s * damping / 3, "extra_damping_power": 0.6})  # fmt: skip
    add("actuation_delay", "late", 0.6, lambda s: {"delay": s})
    add("actuation_delay", "sluggish", 0.8, lambda s: {"lag": s})
    largest = nominal.largest_current
    add("current_supply_limit", "clipped", 1.0, lambda s: {"limit": largest * (1 - s)})
    add("current_supply_limit", "slow", 1.0, lambda s: {"slew": RAMP * (1 - s)})
    add("soil_flexibility", "sway", 20.0, lambda s: {"sway": s})
    add("soil_flexibility", "rocking", 20.0, lambda s: {"rock": s})
    gap = float(np.max(np.abs(calm.deformation)) * rng.uniform(0.65, 0.75))
    for form, power, stiffness in (("hertz", 1.5, 5e8), ("bumper", 1.0, 5e7)):
        fixed = {"wall_gap": gap, "wall_power": power, "wall_loss": about(rng, 0.5)}
        add("moat_impact", form, 10.0, lambda s, f=fixed, k=stiffness: f | {"wall": s * k})
    for form, drifting in (("offset", False), ("drift", True)):
        made.append(Fault(SENSOR, form, 10.0, reading=_biased(sensor, drifting)))
    return made


def outside_faults() -> list[Fault]:
    """Forces of the isolators that no cause of the design's list describes."""
    made = (
        ("squeeze_film", 1e9, "squeeze"),  # x^2 v, N s/m^3
        ("field_drag", 1e8, "field_drag"),  # I v |v|, N s^2/m^2/A
        ("one_sided_stiffening", 1e9, "one_sided"),  # x^2 on one side, N/m^2
    )
    return [
        Fault("outside", form, limit, lambda b, s, name=field: replace(b, **{name: s}))
        for form, limit, field in made
    ]


@dataclass(frozen=True, eq=False)
class Record:
    """A record with noise, the nominal building, and what is hidden."""

    time: np.ndarray
    ground: np.ndarray
    channels: np.ndarray
    current: np.ndarray
    nominal: Building
    faults: tuple[Fault, ...]
    severities: tuple[float, ...]
    size: float

    def write(self, folder: Path) -> Path:
        """Write ``record.csv`` and ``building.toml``; the folder must not exist."""
        folder.mkdir(parents=True)
        header = ("time_s", "ground_acceleration_m_s2", *CHANNELS, "current_A")
        rows = np.column_stack([self.time, self.ground, *self.channels, self.current]).tolist()
        text = "\n".join(",".join(f"{value:.8g}" for value in row) for row in rows)
        (folder / "record.csv").write_text(f"{','.join(header)}\n{text}\n")
        (folder / "building.toml").write_text(description(self.nominal))
        return folder


def description(building: Building) -> str:
    """TOML of what an engineer knows of the building; SI."""
    lines = [
        "[building]",
        f"floor_masses_kg = {building.masses.tolist()}",
        f"base_mass_kg = {building.base_mass!r}",
        f"storey_stiffnesses_N_per_m = {building.stiffnesses.tolist()}",
        f"damping_ratio = {DAMPING_RATIO}",
        "rayleigh_modes = [1, 3]",
        "",
        "[isolation_layer]",
        'law = "bouc_wen"',
        "",
        "# ascending powers of the current in A; the law's SI units",
        "[isolation_layer.parameters]",
    ]
    rows = zip(ISOLATOR, building.isolator, strict=True)
    lines += [f"{name} = {np.trim_zeros(row, 'b').tolist()}" for name, row in rows]
    return "\n".join(lines) + "\n"


def misfit(nominal: Building, ground: np.ndarray, current: np.ndarray, channels) -> float:
    """RMS error of the nominal building over the channels' RMS, mean over the channels."""
    model = nominal.respond(ground, current).channels
    error = np.linalg.norm(channels - model, axis=1) / np.linalg.norm(channels, axis=1)
    return float(np.mean(error))


def make_record(
    seed: int, hidden: Sequence[Fault] = (), size: float = 0.0, noise: float = 0.01,
    nominal: Building | None = None,
) -> Record:  # fmt: skip
    """A record whose faults each make a misfit of ``size``, or what their limit lets them make.

    Noise is a share of each channel's RMS. One fault at most may be a sensor's.
    """
    nominal, ground = nominal or nominal_building(seed), ground_motion(seed)

    def run(faults: Sequence[Fault], severities: Sequence[float]) -> tuple[Response, np.ndarray]:
        building = nominal
        for fault, severity in zip(faults, severities, strict=True):
            building = fault.change(building, severity)
        response = building.respond(ground)
        channels = response.channels
        for fault, severity in zip(faults, severities, strict=True):
            if fault.name == SENSOR:
                channels = fault.reading(response, severity)
        return response, channels

    def misfit_of(fault: Fault, severity: float) -> float:
        response, channels = run([fault], [severity])
        return misfit(nominal, ground, response.current, channels)

    severities = tuple(_severity(partial(misfit_of, fault), size, fault.limit) for fault in hidden)
    response, channels = run(hidden, severities)
    rng = np.random.default_rng([seed, 43])
    level = np.sqrt(np.mean(channels**2, axis=1, keepdims=True))
    return Record(
        time=np.arange(ground.size) / RATE,
        ground=ground + noise * np.std(ground) * rng.standard_normal(ground.size),
        channels=channels + noise * level * rng.standard_normal(channels.shape),
        current=response.current,
        nominal=nominal,
        faults=tuple(hidden),
        severities=severities,
        size=misfit(nominal, ground, response.current, channels),
    )


def _severity(misfit_of: Callable[[float], float], size: float, limit: float) -> float:
    """Smallest severity on a ladder that reaches the size, refined; the limit if none does."""
    ladder = limit * np.geomspace(1e-3, 1.0, 9)
    below = 0.0
    for severity in ladder:
        if misfit_of(severity) >= size:
            return float(
                brentq(lambda s: misfit_of(s) - size, below, severity, xtol=1e-2 * severity)
            )
        below = float(severity)
    return limit
