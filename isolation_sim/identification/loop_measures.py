"""Stiffness and damping of a measured loop, with their uncertainty from cycle to cycle.

Li & Li, Eqs 1-5, and the complex modulus of Tao et al., from the time series of a sinusoidal test.
How each is kept from the usual errors:

- Offset and slow drift: displacement and force are measured from their means over one period,
  taken about every sample. What is removed is given back as the two offsets.
- Asymmetric devices and preloads: Eqs 1 and 3 take the force from that at the mean deformation,
  the mean of both branches there. The force's mean over time would be wrong: a device that pulls
  harder than it pushes has one of its own. A sensor's offset and a preload's force drop out.
- Partial cycles: the frequency is fitted, and whole cycles are cut from a quarter of a period
  before a peak of the displacement to three quarters after.
- Noise: energy and complex modulus come from the harmonics of each cycle, the force at a point
  from a curve through many samples (`force_curve`). The largest force of each cycle is its curve's
  value where the mean cycle is largest: each cycle's own maximum would be too high.
- Jumps: a friction-like force jumps where the velocity reverses. The force at an end is the mean
  of its limits before and after, which for a symmetric loop is the same as taking both ends at one
  sign of the velocity. Where the force does not jump the two limits agree.
- Rest and ramps: cycles whose amplitude differs from the median of those that move by more than
  5 % are left out.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ..errors import InputError
from .force_curve import REACH, CornerCurve, Cycles, Terms, widest
from .loop_cycles import (
    centre_line,
    find_frequency,
    harmonics,
    require_cycles,
    steady_cycles,
    whole_cycles,
)

_MINIMUM_SAMPLES = 16
# harmonics fitted, and those that the displacement may have
_HARMONICS_FITTED, _HARMONICS = 15, 5
# share of a period about an end of the stroke in which the displacement is fitted
_PEAK_REACH = 0.2
# parts of a branch between its ends that are searched for the largest force
_PARTS = 8
_REACHES = (REACH, REACH / 2)
# reach and terms about the mean deformation, where stiffness may change
_HALF_WAY = [
    (REACH, Terms(3, 2, kink=1)),
    (REACH / 2, Terms(4, 3, kink=1)),
    (REACH / 6, Terms(2, 2, kink=1)),
    (REACH / 10, Terms(1, 1, kink=1)),
]


@dataclass(frozen=True, eq=False)
class Measure:
    """A number measured once a cycle.

    Attributes
    ----------
    value : float
        Mean over the cycles, in the measure's unit.
    uncertainty : float
        Standard error of the mean, in the same unit.
    cycles : numpy.ndarray, shape (n_cycles,)
        The cycles' own values, in the same unit.
    """

    value: float
    uncertainty: float
    cycles: np.ndarray

    @property
    def n_cycles(self) -> int:
        """Number of cycles behind the mean."""
        return self.cycles.size


@dataclass(frozen=True, eq=False)
class LoopMeasures:
    """Measures of a sinusoidal test.

    Attributes
    ----------
    frequency : float, Hz
        Given or found.
    n_cycles : int
        Whole cycles measured.
    n_left_out : int
        Whole cycles left out because their amplitude differs.
    amplitude : Measure, m
        Half the stroke, X.
    effective_stiffness : Measure, N/m
        Li & Li, Eq 2: difference of the forces at both ends of the stroke over the stroke.
    effective_stiffness_half : Measure, N/m
        Li & Li, Eq 1 (AASHTO): force at the positive end over the positive displacement, both from
        the mean deformation.
    dynamic_stiffness : Measure, N/m
        Li & Li, Eq 3: largest force over the largest displacement, both from the mean deformation.
    energy_per_cycle : Measure, J
        Area of the loop, positive where the device dissipates.
    equivalent_damping : Measure, N s/m
        Li & Li, Eq 4: energy / (pi omega X^2).
    damping_ratio : Measure, dimensionless
        Li & Li, Eq 5: energy / (2 pi K_eff X^2); nan where a cycle's effective stiffness
        is not positive.
    storage_stiffness : Measure, N/m
        Tao et al., k': part of the force's first harmonic in phase with the displacement's.
    loss_stiffness : Measure, N/m
        Tao et al., k'': part of the force's first harmonic a quarter of a period ahead.
    loss_damping : Measure, N s/m
        Tao et al., C_MR = k'' / (2 pi f).
    displacement_offset : Measure, m
        Mean over a cycle; drift shows in its uncertainty.
    force_offset : Measure, N
        Mean over a cycle.
    """

    frequency: float
    n_cycles: int
    n_left_out: int
    amplitude: Measure
    effective_stiffness: Measure
    effective_stiffness_half: Measure
    dynamic_stiffness: Measure
    energy_per_cycle: Measure
    equivalent_damping: Measure
    damping_ratio: Measure
    storage_stiffness: Measure
    loss_stiffness: Measure
    loss_damping: Measure
    displacement_offset: Measure
    force_offset: Measure

    @property
    def measures(self) -> dict[str, Measure]:
        """The measures by name, in order."""
        pairs = ((field.name, getattr(self, field.name)) for field in fields(self))
        return {name: value for name, value in pairs if isinstance(value, Measure)}


_MEASURES = [field.name for field in fields(LoopMeasures) if field.type == "Measure"]


def loop_measures(
    time: Any, displacement: Any, force: Any, frequency: float | None = None, skip: int = 0
) -> LoopMeasures:
    """Measure the loop of a sinusoidal test, cycle by cycle.

    Parameters
    ----------
    time : array_like, shape (n,), s
        Uniform.
    displacement : array_like, shape (n,), m
        A sinusoid with any offset, slow drift and noise; 16 samples a cycle or more.
    force : array_like, shape (n,), N
    frequency : float, optional, Hz
        Of the test; found from the displacement by default.
    skip : int
        Whole cycles to leave out at the beginning, while the device settles.

    Returns
    -------
    LoopMeasures

    Raises
    ------
    InputError
        If the arrays differ in shape or hold what is not finite, the time is not uniform, the
        displacement is not sinusoidal or too coarsely sampled, or fewer than 3 whole cycles of
        one amplitude are left.
    """
    t, x, f = _checked(time, displacement, force)
    if frequency is None:
        frequency = find_frequency(t, x)
    elif not (np.isfinite(frequency) and frequency > 0):
        raise InputError(f"frequency {frequency!r} Hz; accepted: a positive number")
    if not (isinstance(skip, int | np.integer) and skip >= 0):
        raise InputError(f"skip {skip!r}; accepted: a whole number of cycles, 0 or more")
    require_cycles(t, frequency, skip)
    period = 1.0 / frequency
    centres = [centre_line(t, y, period) for y in (x, f)]
    moved = x - centres[0]
    peaks = whole_cycles(t, moved, frequency, skip)
    steady = peaks[steady_cycles(t, moved, frequency, peaks)]
    ends = _Ends.of(t, moved, steady, frequency)

    curves = _ForceCurves(t, f - centres[1], steady, ends, frequency)
    jumps = curves.jumps(t)
    if np.any(jumps):  # a jump spoils sums over samples: its part is added in closed form
        centres[1] = centre_line(t, f - jumps, period)
        curves = _ForceCurves(t, f - centres[1], steady, ends, frequency)
        jumps = curves.jumps(t)
    found = _over_the_cycles(t, moved, f - centres[1] - jumps, centres, steady, frequency)
    found = _complete(found, ends, curves, frequency)
    return LoopMeasures(
        frequency=float(frequency),
        n_cycles=steady.size,
        n_left_out=peaks.size - steady.size,
        **{name: _measure(found[name]) for name in _MEASURES},
    )


def _measure(cycles: np.ndarray) -> Measure:
    cycles.flags.writeable = False
    error = np.std(cycles, ddof=1) / np.sqrt(cycles.size)
    return Measure(float(np.mean(cycles)), float(error), cycles)


def _checked(time: Any, displacement: Any, force: Any) -> tuple[np.ndarray, ...]:
    arrays = tuple(np.asarray(a, dtype=float) for a in (time, displacement, force))
    t = arrays[0]
    if t.ndim != 1 or t.size < _MINIMUM_SAMPLES or any(a.shape != t.shape for a in arrays):
        shapes = ", ".join(str(a.shape) for a in arrays)
        raise InputError(
            f"time, displacement and force of shapes {shapes}; accepted: one shape (n,), n at "
            f"least {_MINIMUM_SAMPLES}"
        )
    for what, array in zip(("time", "displacement", "force"), arrays, strict=True):
        if not np.all(np.isfinite(array)):
            worst = int(np.argmin(np.isfinite(array)))
            raise InputError(f"{what}: sample {worst} is {array[worst]}; accepted: finite numbers")
    step = (t[-1] - t[0]) / (t.size - 1)
    off = np.abs(t - t[0] - step * np.arange(t.size))
    if not step > 0 or np.max(off) > 0.5 * step or not np.all(np.diff(t) > 0):
        raise InputError(
            f"time: steps from {np.min(np.diff(t)):.4g} to {np.max(np.diff(t)):.4g} s; accepted: "
            "one step throughout, each time within half a step of its place"
        )
    return arrays


class _Ends(NamedTuple):
    """Both ends of the stroke: displacement (m) in each cycle, and mean phase (rad)."""

    top: np.ndarray
    bottom: np.ndarray
    at_top: float
    at_bottom: float

    @classmethod
    def of(cls, t: np.ndarray, x: np.ndarray, peaks: np.ndarray, frequency: float) -> _Ends:
        omega = 2 * np.pi * frequency
        tops = np.array([_end(t, x, peak, omega) for peak in peaks])
        bottoms = np.array([_end(t, x, peak + 0.5 / frequency, omega) for peak in peaks])
        phases = (omega * (ends[:, 1] - peaks) for ends in (tops, bottoms))
        return cls(tops[:, 0], bottoms[:, 0], *(float(np.mean(phase)) for phase in phases))


class _ForceCurves:
    """Force of each cycle at the ends of the stroke, half way between them, and where largest."""

    def __init__(
        self, t: np.ndarray, f: np.ndarray, peaks: np.ndarray, ends: _Ends, frequency: float
    ):
        self.cycles = Cycles(t, f, peaks, frequency)
        self.phases = ends.at_top, ends.at_bottom
        self.frequency, self.start = frequency, peaks[0]
        self.corners = [self._curve(phase) for phase in self.phases]
        self.smooth = all(corner.smooth for corner in self.corners)

    def at_ends(self) -> list[np.ndarray]:
        """At the top and the bottom: the mean of the limits before and after."""
        return [self._at(corner) for corner in self.corners]

    def half_way(self) -> np.ndarray:
        """At the mean deformation, where the stiffness may change: the mean of both branches."""
        up, down = (
            widest(
                [CornerCurve(self.cycles, phase, reach=r, terms=terms) for r, terms in _HALF_WAY]
            )
            for phase in (-np.pi / 2, np.pi / 2)
        )
        return (self._at(up) + self._at(down)) / 2

    def largest(self) -> np.ndarray:
        """Where the mean cycle's force is largest."""
        if self.smooth:
            return self.cycles.at(self.cycles.largest().phase)
        top, bottom = self.corners
        found = [(corner.largest(), corner) for corner in self.corners]
        for before, after in ((top, bottom), (bottom, top)):  # each branch between them in parts
            edges = np.linspace(before.high, np.pi + after.low, _PARTS + 1)
            for low, high in pairwise(edges):
                middle = (low + high) / 2
                limits = (-middle, np.pi - middle)
                curve = self._curve(before.centre + middle, limits, corner=False)
                found.append((curve.largest(low - middle, high - middle), curve))
        peak, curve = max(found, key=lambda pair: pair[0])
        return curve.at(peak.phase, peak.side)

    def jump_sizes(self) -> tuple[float, float]:
        """Constant and slope over the stroke of the force that changes sign with the velocity."""
        if self.smooth:
            return 0.0, 0.0
        top, bottom = -self.corners[0].jump() / 2, self.corners[1].jump() / 2
        return (top + bottom) / 2, (top - bottom) / 2

    def jumps(self, t: np.ndarray) -> np.ndarray:
        """The force that changes sign with the velocity, at the samples."""
        constant, slope = self.jump_sizes()
        phase = 2 * np.pi * self.frequency * (t - self.start) - self.phases[0]
        return -np.sign(np.sin(phase)) * (constant + slope * np.cos(phase))

    def _curve(
        self, phase: float, limits: tuple[float, float] = (-np.pi, np.pi), corner: bool = True
    ) -> CornerCurve:
        """The force about a phase."""
        return widest([CornerCurve(self.cycles, phase, limits, corner, r) for r in _REACHES])

    def _at(self, curve: CornerCurve) -> np.ndarray:
        return (self.cycles if curve.smooth else curve).at(curve.centre)


def _over_the_cycles(
    t: np.ndarray,
    x: np.ndarray,
    f: np.ndarray,
    centres: list[np.ndarray],
    peaks: np.ndarray,
    frequency: float,
) -> dict[str, np.ndarray]:
    """Energy, complex modulus and offsets of each cycle, of a force without jumps."""
    rows = []
    for peak in peaks:
        inside = (t >= peak - 0.25 / frequency) & (t < peak + 0.75 / frequency)
        count = min(_HARMONICS_FITTED, int(inside.sum()) // 4)
        xs = harmonics(t[inside], x[inside], frequency, peak, count)[:_HARMONICS]
        fs = harmonics(t[inside], f[inside], frequency, peak, count)[:_HARMONICS]
        energy = np.pi * np.arange(1, xs.size + 1) @ (np.conj(fs) * xs).imag
        modulus = np.conj(fs[0] / xs[0])
        offsets = (np.mean(centre[inside]) for centre in centres)
        rows.append((energy, modulus.real, modulus.imag, *offsets))
    names = (
        "energy_per_cycle", "storage_stiffness", "loss_stiffness", "displacement_offset",
        "force_offset",
    )  # fmt: skip
    return dict(zip(names, np.array(rows).T, strict=True))


def _complete(
    found: dict[str, np.ndarray], ends: _Ends, curves: _ForceCurves, frequency: float
) -> dict[str, np.ndarray]:
    """Add the jumps' part and the measures that need the force at a point."""
    omega, amplitude = 2 * np.pi * frequency, (ends.top - ends.bottom) / 2
    constant, _ = curves.jump_sizes()
    energy = found["energy_per_cycle"] + 4 * constant * amplitude
    loss = found["loss_stiffness"] + 4 * constant / (np.pi * amplitude)
    f_top, f_bottom = curves.at_ends()
    middle = curves.half_way()
    stiffness = (f_top - f_bottom) / (2 * amplitude)
    positive = np.where(stiffness > 0, stiffness, np.nan)
    return found | {
        "amplitude": amplitude,
        "effective_stiffness": stiffness,
        "effective_stiffness_half": (f_top - middle) / ends.top,
        "dynamic_stiffness": (curves.largest() - middle) / ends.top,
        "energy_per_cycle": energy,
        "equivalent_damping": energy / (np.pi * omega * amplitude**2),
        "damping_ratio": energy / (2 * np.pi * positive * amplitude**2),
        "loss_stiffness": loss,
        "loss_damping": loss / omega,
    }


def _end(t: np.ndarray, x: np.ndarray, near: float, omega: float) -> tuple[float, float]:
    """Extreme displacement near a time, and its time."""
    chosen = np.abs(t - near) <= _PEAK_REACH * 2 * np.pi / omega
    phase = omega * (t[chosen] - near)
    basis = np.stack([np.ones_like(phase), np.cos(phase), np.sin(phase)], axis=1)
    value, cosine, sine = np.linalg.lstsq(basis, x[chosen], rcond=None)[0]
    size = np.copysign(np.hypot(cosine, sine), cosine)
    later = np.arctan2(sine * np.sign(cosine), abs(cosine)) / omega
    return float(value + size), near + float(later)
