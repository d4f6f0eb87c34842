"""Stiffness and damping of a measured loop, with their uncertainty from cycle to cycle.

Li & Li, Eqs 1-5, and the complex modulus of Tao et al., from the time series of a sinusoidal test.
How each is kept from the usual errors:

- Offset and slow drift: displacement and force are measured from their means over one period,
  taken about every sample. What is removed is given back as the two offsets. A device that pulls
  harder than it pushes therefore has a force offset, which is its own and not the sensor's.
- Partial cycles: the frequency is fitted, and whole cycles are cut from a quarter of a period
  before a peak of the displacement to three quarters after.
- Noise: energy and complex modulus come from the harmonics of each cycle; the force at the ends of
  the stroke from curves fitted beside them, never from single samples.
- Jumps: a friction-like force jumps where the velocity reverses. The force at an end is the mean
  of its limits before and after, which for a symmetric loop is the same as taking both ends at one
  sign of the velocity. Where the force does not jump the two limits agree.
- Rest and ramps: cycles whose amplitude differs from the median of those that move by more than
  5 % are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ..errors import InputError
from .loop_cycles import (
    centre_line,
    find_frequency,
    harmonics,
    require_cycles,
    steady_cycles,
    whole_cycles,
)

_MINIMUM_SAMPLES = 16
_HARMONICS = 5
# share of a period about an end of the stroke in which displacement and force are fitted
_PEAK_REACH, _FORCE_REACH = 0.2, 0.12
_SMOOTHING = 0.1
# about an end, samples that carry a curve with one term more
_MANY = 6


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
        Li & Li, Eq 1 (AASHTO): force at the positive end over the positive displacement.
    dynamic_stiffness : Measure, N/m
        Li & Li, Eq 3: largest force over the largest displacement.
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
    from scipy.interpolate import PchipInterpolator

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
    x, f = x - centres[0], f - centres[1]

    peaks = whole_cycles(t, x, frequency, skip)
    steady = peaks[steady_cycles(t, x, frequency, peaks)]
    smooth = _smoothed(f, period * (t.size - 1) / (t[-1] - t[0]))
    between = PchipInterpolator(t, f)
    rows = [_one_cycle(t, x, f, smooth, between, centres, peak, frequency) for peak in steady]
    return LoopMeasures(
        frequency=float(frequency),
        n_cycles=steady.size,
        n_left_out=peaks.size - steady.size,
        **{name: _measure(np.array([row[name] for row in rows])) for name in rows[0]},
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


def _smoothed(force: np.ndarray, samples_a_cycle: float) -> np.ndarray:
    from scipy.signal import savgol_filter

    window = max(5, int(_SMOOTHING * samples_a_cycle) // 2 * 2 + 1)
    return np.asarray(savgol_filter(force, window, 2))


def _one_cycle(
    t: np.ndarray,
    x: np.ndarray,
    f: np.ndarray,
    smooth: np.ndarray,
    between: Callable[[np.ndarray], np.ndarray],
    centres: list[np.ndarray],
    peak: float,
    frequency: float,
) -> dict[str, float]:
    """Every measure of the cycle about a peak of the displacement, by name."""
    period, omega = 1.0 / frequency, 2 * np.pi * frequency
    inside = (t >= peak - period / 4) & (t < peak + 3 * period / 4)
    count = min(_HARMONICS, int(inside.sum()) // 4)
    xs = harmonics(t[inside], x[inside], frequency, peak, count)
    fs = harmonics(t[inside], f[inside], frequency, peak, count)
    energy = np.pi * float(np.sum(np.arange(1, count + 1) * (np.conj(fs) * xs).imag))
    modulus = np.conj(fs[0] / xs[0])

    top, t_top = _end(t, x, peak, omega)
    bottom, t_bottom = _end(t, x, peak + period / 2, omega)
    step = (t[-1] - t[0]) / (t.size - 1)
    f_top, near_top = _force_at_end(between, t_top, omega, step)
    f_bottom, _ = _force_at_end(between, t_bottom, omega, step)
    away = inside.copy()  # a smoothed force is too low at a corner
    for end in (t_top, t_bottom):
        away &= np.abs(t - end) > _SMOOTHING / 2 * period
    largest = max(float(np.max(smooth[away])), near_top)

    amplitude = (top - bottom) / 2
    stiffness = (f_top - f_bottom) / (top - bottom)
    return {
        "amplitude": amplitude,
        "effective_stiffness": stiffness,
        "effective_stiffness_half": f_top / top,
        "dynamic_stiffness": largest / top,
        "energy_per_cycle": energy,
        "equivalent_damping": energy / (np.pi * omega * amplitude**2),
        "damping_ratio": (
            energy / (2 * np.pi * stiffness * amplitude**2) if stiffness > 0 else np.nan
        ),
        "storage_stiffness": float(modulus.real),
        "loss_stiffness": float(modulus.imag),
        "loss_damping": float(modulus.imag) / omega,
        "displacement_offset": float(np.mean(centres[0][inside])),
        "force_offset": float(np.mean(centres[1][inside])),
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


def _force_at_end(
    force: Callable[[np.ndarray], np.ndarray], end: float, omega: float, step: float
) -> tuple[float, float]:
    """Mean of the force's limits before and after an end of the stroke, and its largest near it.

    Samples mirrored about the end are added and subtracted: a jump is in the difference alone.
    """
    period = 2 * np.pi / omega
    past = step * np.arange(1, max(int(_FORCE_REACH * period / step), 4) + 1)
    before, after = force(end - past), force(end + past)

    def even(phase: np.ndarray) -> np.ndarray:
        c = np.cos(phase) - 1
        terms = [np.ones_like(phase), c, c**2] if past.size >= _MANY else [np.ones_like(phase), c]
        return np.stack(terms, axis=1)

    def odd(phase: np.ndarray) -> np.ndarray:
        return np.stack([np.ones_like(phase), np.sin(phase)], axis=1)

    nearby = omega * period * _SMOOTHING / 2 * np.linspace(0, 1, 20)
    parts = []
    for basis, part in ((even, (after + before) / 2), (odd, (after - before) / 2)):
        coefficients = np.linalg.lstsq(basis(omega * past), part, rcond=None)[0]
        parts.append(basis(nearby) @ coefficients)
    return float(parts[0][0]), float(np.max(parts[0] + np.abs(parts[1])))
