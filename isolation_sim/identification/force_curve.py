"""The force along a cycle as a curve: harmonics of a smooth loop, or a series beside a corner.

A smooth loop's force is a short sum of harmonics. Where the velocity reverses a force may jump
(friction), and its slope may (damping that differs between loading and unloading); about such a
corner the force is a series in the time's sine and cosine with terms for either side. These terms
are taken in where all cycles together show them beyond doubt: with noise they cost accuracy, and a
largest force would always lie on their higher side. A term that is missed is of the size of the
mean's standard error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

REACH = 0.12
"""Half width of a window beside a corner, in periods; wider where the samples are few."""
_WIDEST, _SAMPLES_A_SIDE = 0.25, 12
_HARMONICS, _HARMONICS_A_SAMPLE = 15, 0.45
_DOUBT = 1e-3
"""Significance level of a term: the probability that noise alone causes it."""
_ROUNDING = 1e-13
_CLEARLY = 0.5
"""Part of the harmonics' mean square that a series without corner must leave to be preferred."""


class Peak(NamedTuple):
    """Where the mean cycle's force is largest: force (N), phase (rad) and side of a corner."""

    force: float
    phase: float
    side: float


class Terms(NamedTuple):
    """Number of terms of each kind, each times the powers 0, 1, … of cos - 1."""

    even: int
    odd: int
    jump: int = 0
    kink: int = 0

    def rows(self, phase: NDArray, side: NDArray) -> NDArray:
        """Terms, along a last axis, at phases (rad) before (-1) or after (1) the corner."""
        power = np.ones((*phase.shape, max(self)))
        power[..., 1:] = (np.cos(phase) - 1)[..., np.newaxis]
        np.multiply.accumulate(power, axis=-1, out=power)
        sine, side = np.sin(phase)[..., np.newaxis], side[..., np.newaxis]
        return np.concatenate(
            [
                power[..., : self.even],
                sine * power[..., : self.odd],
                side * power[..., : self.jump],
                side * sine * power[..., : self.kink],
            ],
            axis=-1,
        )


class Window(NamedTuple):
    """Samples of several cycles about a phase, one row each, filled up to the longest."""

    phase: NDArray  # (n_cycles, most), rad: from the centre
    force: NDArray  # (n_cycles, most), N
    inside: NDArray  # (n_cycles, most): False where a row is filled up

    @classmethod
    def of(cls, phase: NDArray, force: NDArray, chosen: NDArray) -> Window:
        """The chosen samples of each row, in their order."""
        most = int(chosen.sum(axis=1).max())
        first = np.argsort(~chosen, axis=1, kind="stable")[:, :most]
        return cls(*(np.take_along_axis(one, first, axis=1) for one in (phase, force, chosen)))

    def fitted(self, rows: NDArray) -> NDArray:
        """Coefficients of each cycle's least-squares fit, by the terms at each sample."""
        rows, force = rows * self.inside[..., np.newaxis], self.force * self.inside
        if np.min(np.count_nonzero(self.inside, axis=1)) < rows.shape[-1]:
            return np.asarray((np.linalg.pinv(rows) @ force[..., np.newaxis])[..., 0])
        q, r = np.linalg.qr(rows)
        return np.asarray(np.linalg.solve(r, np.swapaxes(q, 1, 2) @ force[..., np.newaxis])[..., 0])


_JUMP, _KINK = Terms(5, 3, 2), Terms(5, 3, 2, 1)
_RICH_JUMP, _RICH_KINK = Terms(7, 6, 3), Terms(6, 5, 3, 1)
"""Of a loop with little noise: it leaves a hundredth of what the usual terms leave."""
_MUCH = 0.01


class Cycles:
    """Force of several cycles, as samples and as harmonics."""

    # Starts (s) are phase zero of each cycle, at a peak of the displacement; a cycle reaches from a
    # quarter of a period before its start to three quarters after.

    def __init__(self, time: NDArray, force: NDArray, starts: NDArray, frequency: float):
        omega = 2 * np.pi * frequency
        self.step = omega * (time[-1] - time[0]) / (time.size - 1)
        """Between samples, rad."""
        phases = omega * np.subtract.outer(time, starts).T
        own = (phases >= -np.pi / 2) & (phases < 1.5 * np.pi)
        self._all = Window.of(phases, np.broadcast_to(force, phases.shape), own)
        count = min(_HARMONICS, int(_HARMONICS_A_SAMPLE * 2 * np.pi / self.step))
        self.order = np.arange(1, count + 1)
        self.harmonics = self._all.fitted(_waves(self._all.phase, self.order))

    def at(self, phase: float, side: float = 0.0) -> NDArray:
        """Force of each cycle at a phase (rad), by its harmonics."""
        return self.harmonics @ _waves(np.array([phase]), self.order)[0]

    def window(self, centre: float, low: float, high: float, gap: float) -> Window:
        """Each cycle's samples between two phases about a centre, off a gap."""
        # A cycle is taken for a closed loop, so that none lacks samples.
        away = (self._all.phase - centre + np.pi) % (2 * np.pi) - np.pi
        chosen = (away >= low) & (away <= high) & (np.abs(away) > gap) & self._all.inside
        return Window.of(away, self._all.force, chosen)

    def largest(self, sign: float = 1.0) -> Peak:
        """Where the mean cycle of a smooth loop, times a sign, is largest: by what it shows."""
        keep = 2 * self._shown() + 1
        mean = sign * np.mean(self.harmonics, axis=0)[:keep]

        def curve(phase: NDArray) -> NDArray:
            return _waves(phase, self.order)[:, :keep] @ mean

        return _searched(curve, -np.pi, np.pi, 0.0)

    def _shown(self) -> int:
        """Number of harmonics that are beyond doubt."""
        phase, force, inside = self._all
        force, rows = force[inside], _waves(phase[inside], self.order)
        for count in range(self.order.size, 1, -1):
            few, many = (_left(force, rows[:, : 2 * n + 1]) for n in (count - 1, count))
            if _needed(few, many, force):
                return count
        return 1


class CornerCurve:
    """Force about one phase, where it and its slope may jump, cycle by cycle."""

    def __init__(
        self,
        cycles: Cycles,  # The samples
        centre: float,  # The phase, rad
        # Phases relative to the centre, rad, that the window may not pass
        limits: tuple[float, float] = (-np.pi, np.pi),
        corner: bool = True,  # Whether force and slope may jump at the centre
        # Half width of the window in periods; wider where the samples are few
        reach: float = REACH,
        terms: Terms | None = None,  # By default those that the samples need
    ):
        fewest = sum(terms) if terms else _SAMPLES_A_SIDE
        reach = min(max(2 * np.pi * reach, fewest * cycles.step), 2 * np.pi * _WIDEST)
        self.cycles, self.centre, self.corner = cycles, centre, corner
        self.has_own_terms = terms is not None
        low, high = (float(np.clip(limit, -reach, reach)) for limit in limits)
        self.low, self.high = low, high
        """Phases relative to the centre between which the curve holds, rad."""
        # a sample on the corner has neither side
        samples = cycles.window(centre, low, high, cycles.step / 4 if corner else -1.0)
        inside = samples.inside
        fewest = int(inside.sum(axis=1).min())
        self.terms = terms or self._chosen(fewest, samples.phase[inside], samples.force[inside])
        rows = self.terms.rows(samples.phase, np.sign(samples.phase))
        self.coefficients = samples.fitted(rows)
        misfits = (samples.force - (rows @ self.coefficients[..., np.newaxis])[..., 0])[inside]
        self.left = float(misfits @ misfits) / max(misfits.size - self.coefficients.size, 1)
        self._samples = samples

    @cached_property
    def left_by_harmonics(self) -> float:
        """Variance that the harmonics of the whole cycle leave of the window's samples, N^2."""
        cycles, (phase, force, inside) = self.cycles, self._samples
        rows = _waves(self.centre + phase, cycles.order)
        misfits = (force - (rows @ cycles.harmonics[..., np.newaxis])[..., 0])[inside]
        a_sample = cycles.harmonics.shape[1] * cycles.step / (2 * np.pi)
        return float(np.mean(misfits**2)) / max(1 - a_sample, 0.05)

    @property
    def smooth(self) -> bool:
        """Whether the harmonics describe the force here as well."""
        if self.has_own_terms:
            return self.left_by_harmonics < _MUCH * self.left
        return self.left_by_harmonics * (1.0 if self.terms.jump else _CLEARLY) < self.left

    def at(self, phase: float, side: float = 0.0) -> NDArray:
        """Force of each cycle at a phase (rad); at the corner the mean of its limits, or a side."""
        row = self.terms.rows(np.array([phase - self.centre]), np.array([side]))
        return self.coefficients @ row[0]

    def jump(self) -> float:
        """Mean force after the corner less that before it, N."""
        return float(np.mean(self.at(self.centre, 1.0) - self.at(self.centre, -1.0)))

    def largest(self, low: float, high: float, sign: float = 1.0) -> Peak:
        """Where the mean cycle, times a sign, is largest between two phases off the centre."""
        low, high = max(low, self.low), min(high, self.high)
        mean = sign * np.mean(self.coefficients, axis=0)
        peaks = []
        parts = [(-1.0, low, 0.0), (1.0, 0.0, high)] if self.corner else [(0.0, low, high)]
        for side, a, b in parts:

            def curve(away: NDArray, side: float = side) -> NDArray:
                return self.terms.rows(away, np.full(away.size, side)) @ mean

            result = _searched(curve, a, b, side)
            peaks.append(result._replace(phase=self.centre + result.phase))
        return max(peaks)

    def _chosen(self, fewest: int, away: NDArray, force: NDArray) -> Terms:
        """Terms that the fewest samples of a cycle carry and that all cycles together need."""
        even = min(_RICH_JUMP.even, fewest // 3 + 1)
        smooth = Terms(even, even - 1)
        if not self.corner or sum(_KINK) >= fewest:
            return smooth

        def left(terms: Terms) -> tuple[float, int]:
            return _left(force, terms.rows(away, np.sign(away)))

        # few terms of one parity, or those for either side could hardly be distinguished from them
        if not _needed(left(_KINK._replace(jump=0, kink=0)), left(_KINK), force):
            return smooth
        usual, rich = _KINK, _RICH_KINK
        # a rounded jump leaves an odd misfit, which samples beside the corner may take for a kink
        odd = left(_JUMP._replace(jump=_JUMP.jump + _KINK.kink))
        if not _needed(left(_JUMP), left(_KINK), force) or left(_KINK) > odd:
            usual, rich = _JUMP, _RICH_JUMP
        enough = sum(rich) < fewest and left(rich)[0] < _MUCH * left(usual)[0]
        return rich if enough else usual


def widest(curves: Sequence[CornerCurve]) -> CornerCurve:
    """Return the widest of some curves, the widest first, that leaves no more than noise."""
    chosen = curves[0]
    for curve in curves[1:]:
        if curve.left < _CLEARLY * chosen.left:
            chosen = curve
    return chosen


def _waves(phase: NDArray, order: NDArray) -> NDArray:
    """Offset, then cosine and sine of each order 1, 2, …, at phases (rad)."""
    turns = np.ones((*phase.shape, order.size + 1), complex)
    turns[..., 1:] = np.exp(1j * phase)[..., np.newaxis]
    np.multiply.accumulate(turns, axis=-1, out=turns)
    return np.delete(turns.view(float), 1, axis=-1)


def _searched(curve: Callable[[NDArray], NDArray], low: float, high: float, side: float) -> Peak:
    """Largest value of a curve between two phases."""
    for _ in range(3):
        phase = np.linspace(low, high, 201)
        value = curve(phase)
        k = int(np.argmax(value))
        low, high = phase[max(k - 1, 0)], phase[min(k + 1, 200)]
    return Peak(float(value[k]), float(phase[k]), side)


def _left(force: NDArray, rows: NDArray) -> tuple[float, int]:
    """Sum of squares that the columns leave of the force, and their number."""
    fitted = rows @ np.linalg.lstsq(rows, force, rcond=None)[0]
    return float(np.sum((force - fitted) ** 2)), rows.shape[1]


def _needed(few: tuple[float, int], many: tuple[float, int], force: NDArray) -> bool:
    """Whether further columns explain more of the force than noise would (F test)."""
    from scipy.special import fdtri

    (before, fewer), (after, more) = few, many
    if before <= _ROUNDING**2 * float(np.sum(force**2)):
        return False
    added, free = more - fewer, force.size - more
    return bool((before - after) * free > after * added * fdtri(added, free, 1 - _DOUBT))
