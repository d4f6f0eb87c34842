"""The steady cycles of a sinusoidal test: their measures, and the force along them."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ..errors import InputError
from .force_curve import REACH, CornerCurve, Cycles, Terms, widest
from .measured.loop_cycles import (
    centre_line,
    find_frequency,
    require_cycles,
    steady_cycles,
    whole_cycles,
)

_MINIMUM_SAMPLES = 16
# share of a period about an end of the stroke in which the displacement is fitted
_PEAK_REACH = 0.2
# windows beside an end, and parts of a branch between its ends
_REACHES = (REACH, REACH / 2)
_PARTS, _OVERLAP = 8, 1e-3
# reach and terms about the mean deformation, where stiffness may change
_HALF_WAY = [
    (REACH, Terms(3, 2, kink=1)),
    (REACH / 2, Terms(4, 3, kink=1)),
    (REACH / 6, Terms(2, 2, kink=1)),
    (REACH / 10, Terms(1, 1, kink=1)),
]


class SteadyLoops(NamedTuple):
    """Steady cycles of a sinusoidal test."""

    # time, displacement, force: (n,), s, m and N: About the centre lines
    time: np.ndarray
    displacement: np.ndarray
    force: np.ndarray
    # displacement_centre, force_centre: (n,), m and N: Centre lines: offset and drift
    displacement_centre: np.ndarray
    force_centre: np.ndarray
    peaks: np.ndarray  # (n_cycles,), s: Peak of the displacement in each steady cycle
    n_left_out: int  # Whole cycles whose amplitude differs
    frequency: float  # Hz
    ends: Ends  # Of the stroke
    curves: ForceCurves  # Force along the cycles


def steady_loops(
    time: Any, displacement: Any, force: Any, frequency: float | None, skip: int
) -> SteadyLoops:
    """Find the steady cycles of a sinusoidal test; arguments as of `loop_measures`."""
    t, x, f = _checked(time, displacement, force)
    if frequency is None:
        frequency = find_frequency(t, x)
    elif not (np.isfinite(frequency) and frequency > 0):
        raise InputError(f"frequency {frequency!r} Hz; expected: a positive number")
    if not (isinstance(skip, int | np.integer) and skip >= 0):
        raise InputError(f"skip {skip!r}; expected: a whole number of cycles, 0 or more")
    require_cycles(t, frequency, skip)
    period = 1.0 / frequency
    x_centre, f_centre = (centre_line(t, y, period) for y in (x, f))
    moved = x - x_centre
    peaks = whole_cycles(t, moved, frequency, skip)
    steady = peaks[steady_cycles(t, moved, frequency, peaks)]
    ends = Ends.of(t, moved, steady, frequency)

    curves = ForceCurves(t, f - f_centre, steady, ends, frequency)
    jumps = curves.jumps(t)
    if np.any(jumps):  # a jump spoils sums over samples: its part is added in closed form
        f_centre = centre_line(t, f - jumps, period)
        curves = ForceCurves(t, f - f_centre, steady, ends, frequency)
    left_out = peaks.size - steady.size
    return SteadyLoops(
        t, moved, f - f_centre, x_centre, f_centre, steady, left_out, frequency, ends, curves
    )


def _checked(time: Any, displacement: Any, force: Any) -> tuple[np.ndarray, ...]:
    arrays = tuple(np.asarray(a, dtype=float) for a in (time, displacement, force))
    t = arrays[0]
    if t.ndim != 1 or t.size < _MINIMUM_SAMPLES or any(a.shape != t.shape for a in arrays):
        shapes = ", ".join(str(a.shape) for a in arrays)
        raise InputError(
            f"time, displacement and force of shapes {shapes}; expected: one shape (n,), n at "
            f"least {_MINIMUM_SAMPLES}"
        )
    for what, array in zip(("time", "displacement", "force"), arrays, strict=True):
        if not np.all(np.isfinite(array)):
            worst = int(np.argmin(np.isfinite(array)))
            raise InputError(f"{what}: sample {worst}", f"{array[worst]}", "finite numbers")
    step = (t[-1] - t[0]) / (t.size - 1)
    off = np.abs(t - t[0] - step * np.arange(t.size))
    if not step > 0 or np.max(off) > 0.5 * step or not np.all(np.diff(t) > 0):
        raise InputError(
            f"time: steps from {np.min(np.diff(t)):.4g} to {np.max(np.diff(t)):.4g} s; expected: "
            "one step throughout, each time within half a step of its place"
        )
    return arrays


class Ends(NamedTuple):
    """Both ends of the stroke: displacement (m) in each cycle, and mean phase (rad)."""

    top: np.ndarray
    bottom: np.ndarray
    at_top: float
    at_bottom: float

    @property
    def amplitude(self) -> np.ndarray:
        """Half the stroke in each cycle, m."""
        return (self.top - self.bottom) / 2

    @classmethod
    def of(cls, t: np.ndarray, x: np.ndarray, peaks: np.ndarray, frequency: float) -> Ends:
        """Ends of the stroke in the cycles about some peaks."""
        omega = 2 * np.pi * frequency
        tops = np.array([_end(t, x, peak, omega) for peak in peaks])
        bottoms = np.array([_end(t, x, peak + 0.5 / frequency, omega) for peak in peaks])
        phases = (omega * (ends[:, 1] - peaks) for ends in (tops, bottoms))
        return cls(tops[:, 0], bottoms[:, 0], *(float(np.mean(phase)) for phase in phases))


class _Piece(NamedTuple):
    """A curve, and the phases relative to its centre (rad) between which it replaces the loop."""

    curve: CornerCurve
    low: float
    high: float


class ForceCurves:
    """Force of each cycle at the ends of the stroke, half way between them, and where largest."""

    def __init__(
        self, t: np.ndarray, f: np.ndarray, peaks: np.ndarray, ends: Ends, frequency: float
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

    def extreme(self, sign: float) -> np.ndarray:
        """Where the mean cycle's force is largest, or with a negative sign where smallest."""
        if self.smooth:
            return self.cycles.at(self.cycles.largest(sign).phase)
        result = [(p.curve.largest(p.low, p.high, sign), p.curve) for p in self.pieces]
        peak, curve = max(result, key=lambda pair: pair[0])
        return curve.at(peak.phase, peak.side)

    def at(self, phase: float) -> np.ndarray:
        """At a phase, rad; at an end of the stroke the limit before it."""
        if self.smooth:
            return self.cycles.at(phase)
        for piece in self.pieces:
            away = (phase - piece.curve.centre + np.pi) % (2 * np.pi) - np.pi
            if piece.low <= away <= piece.high:
                break
        else:
            raise AssertionError("the pieces do not cover the cycle")
        side = 0.0 if not piece.curve.corner else 1.0 if away > 0 else -1.0
        return piece.curve.at(piece.curve.centre + away, side)

    @cached_property
    def pieces(self) -> list[_Piece]:
        """Curves that cover the cycle: both ends, and each branch between them in parts."""
        top, bottom = self.corners
        result = [_Piece(corner, corner.low, corner.high) for corner in self.corners]
        for before, after in ((top, bottom), (bottom, top)):
            edges = np.linspace(before.high, np.pi + after.low, _PARTS + 1)
            for low, high in pairwise(edges):
                middle = (low + high) / 2
                limits = (-middle, np.pi - middle)
                curve = self._curve(before.centre + middle, limits, corner=False)
                result.append(_Piece(curve, low - middle - _OVERLAP, high - middle + _OVERLAP))
        return result

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


def _end(t: np.ndarray, x: np.ndarray, near: float, omega: float) -> tuple[float, float]:
    """Extreme displacement near a time, and its time."""
    chosen = np.abs(t - near) <= _PEAK_REACH * 2 * np.pi / omega
    phase = omega * (t[chosen] - near)
    basis = np.stack([np.ones_like(phase), np.cos(phase), np.sin(phase)], axis=1)
    value, cosine, sine = np.linalg.lstsq(basis, x[chosen], rcond=None)[0]
    size = np.copysign(np.hypot(cosine, sine), cosine)
    later = np.arctan2(sine * np.sign(cosine), abs(cosine)) / omega
    return float(value + size), near + float(later)
