"""Inverse current map: the lowest current at which a device gives a target force.

Bounds on the force and on its slope over an interval of the current (``enclosure``) say whether the
target force can be inside, and whether the force is monotone there. An interval in which it can be
and is not is halved, from the lowest current on (Hansen and Walster 2004, chapters 9 and 12): no
crossing is passed over, and where there is none, nothing nearer is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ground_motions.argument_types import checked
from isolation_sim.errors import InputError
from isolation_sim.laws import Device

from .device_model import DeviceModel, next_break
from .enclosure import Range

TOLERANCE = 1e-9
"""Within this, relative to the largest force met, the target force counts as reached."""
NEARER = 1e-6
"""An interval that could hold a force nearer by more than this, in the same measure, is halved."""
FINEST = 1e-11
"""One that could hold a force nearer by no more than this, in the same measure, is done with."""
PRECISION = 1e-12
"""Of an interval: to which a crossing in it is located, unless rounding of the force is more."""
ROUNDING = 4e-16
"""Of a force."""
SHORTEST = 2.0**-20
"""Of a piece of the range: an interval this short is not halved."""
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
SECTIONS = 24
"""Steps of golden section: what ``NEARER`` leaves open becomes ``FINEST``, even at a kink."""
MOST_INTERVALS = 4096
"""Looked at in a piece, so that a decision ends even where the bounds are of no use."""


def crossing(
    force_at: Callable, target: float, low: float, high: float, at_low: float, at_high: float,
    least_slope: float, arguments: Any,
) -> tuple[float, float]:  # fmt: skip
    """Lowest current at which a monotone force is the target.

    References
    ----------
    Dowell and Jarratt 1971: the Illinois method; here every third step is a bisection.
    """
    enough = max(least_slope * PRECISION * (high - low), ROUNDING * max(abs(at_low), abs(at_high)))
    if least_slope > 0.0 and abs(at_high - target) <= enough:
        return high, at_high
    # the ends' distances from the target force, halved where the other end moves twice in a row
    miss_low, miss_high, moved = at_low - target, at_high - target, 0
    for step in range(200):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        between = middle
        if step % 3 < 2 and at_high != target:
            secant = (low * miss_high - high * miss_low) / (miss_high - miss_low)
            if low < secant < high:
                between = secant
        force = force_at(between, arguments)
        if least_slope > 0.0 and abs(force - target) <= enough:
            return between, force
        if force != target and (force < target) == (at_low < target):
            low, at_low, miss_low = between, force, force - target
            miss_high, moved = (0.5 * miss_high if moved == 1 else miss_high), 1
        else:
            high, at_high, miss_high = between, force, force - target
            miss_low, moved = (0.5 * miss_low if moved == 2 else miss_low), 2
    return (low, at_low) if abs(at_low - target) < abs(at_high - target) else (high, at_high)


def excursion(bounds: Range, width: float, at_low: float, at_high: float, target: float) -> float:
    """How far the force in an interval may come towards the target, and beyond."""
    lowest, highest, fall, rise = bounds
    if at_low < target:
        # up from the lower end as steeply as may be, then down to the upper end
        peak = at_low + rise * (at_high - at_low - fall * width) / (rise - fall)
        return min(highest, peak) - target
    valley = at_low + fall * (at_low - at_high + rise * width) / (rise - fall)
    return target - max(lowest, valley)


def extremum(
    force_at: Callable, range_of: Callable, target: float, low: float, high: float, at_low: float,
    at_high: float, arguments: Any,
) -> tuple[float, float]:  # fmt: skip
    """Where in a short interval the force comes nearest to the target, or past it.

    References
    ----------
    Kiefer 1953: golden section.
    """
    sign = 1.0 if at_low > target else -1.0
    slope_low, slope_high = range_of(low, low, arguments)[2], range_of(high, high, arguments)[3]
    if sign * slope_low >= 0.0:
        return low, at_low
    if sign * slope_high <= 0.0:
        return high, at_high
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left, at_right = force_at(left, arguments), force_at(right, arguments)
    for _ in range(SECTIONS):
        if sign * at_left <= sign * at_right:
            if sign * (at_left - target) <= 0.0:
                break
            high, right, at_right = right, left, at_left
            left = high - GOLDEN * (high - low)
            at_left = force_at(left, arguments)
        else:
            if sign * (at_right - target) <= 0.0:
                break
            low, left, at_left = left, right, at_right
            right = low + GOLDEN * (high - low)
            at_right = force_at(right, arguments)
    return (left, at_left) if sign * at_left <= sign * at_right else (right, at_right)


def nearest_in_piece(
    force_at: Callable, range_of: Callable, target: float, start: float, end: float,
    at_start: float, best: float, force: float, scale: float, arguments: Any,
) -> tuple[float, float, float, float, bool]:  # fmt: skip
    """Lowest current at which a force is the target, or comes nearest to it, between breaks."""
    # an interval is known by its place among those of its level, each half as wide as one above
    level = place = looked_at = 0
    low, at_low = start, at_start
    while place < 1 << level:
        share = 0.5**level
        high = start + (place + 1) * share * (end - start) if place + 1 < 1 << level else end
        at_high = force_at(high, arguments)
        bounds = range_of(low, high, arguments)
        looked_at += 1
        scale = max(scale, abs(at_high))
        if abs(at_high - target) < abs(force - target):
            best, force = high, at_high
        is_monotone = bounds[2] >= 0.0 or bounds[3] <= 0.0
        is_done = is_monotone or share <= SHORTEST or looked_at > MOST_INTERVALS
        until, at_until = high, at_high
        if at_high != target and (at_low < target) == (at_high < target) and not is_monotone:
            nearer = excursion(bounds, high - low, at_low, at_high, target) + abs(force - target)
            is_done = is_done or nearer <= NEARER * scale
            if is_done and nearer > FINEST * scale:
                until, at_until = extremum(
                    force_at, range_of, target, low, high, at_low, at_high, arguments
                )
                if abs(at_until - target) < abs(force - target):
                    best, force = until, at_until
        if is_done and (at_until == target or (at_low < target) != (at_until < target)):
            least_slope = max(bounds[2], -bounds[3], 0.0)
            at, at_force = crossing(
                force_at, target, low, until, at_low, at_until, least_slope, arguments
            )
            if abs(at_force - target) <= TOLERANCE * scale:
                return at, at_force, scale, at_high, True
            if abs(at_force - target) < abs(force - target):
                best, force = at, at_force
        if not is_done:
            level, place = level + 1, 2 * place
            continue
        # two halves done are one interval done of the level above
        low, at_low, place = high, at_high, place + 1
        while level > 0 and place % 2 == 0:
            level, place = level - 1, place // 2
    return best, force, scale, at_low, False


def nearest_current(
    force_at: Callable, range_of: Callable, target: float, low: float, high: float, arguments: Any
) -> tuple[float, float, bool]:
    """Lowest current at which a force is the target, or comes nearest to it.

    Written so that Numba compiles it too.
    """
    at_end = at_start = force_at(low, arguments)
    start, best, force, scale = low, low, at_start, abs(at_start)
    # what comes nearest of the pieces' ends: the nearer it is, the less has to be halved
    end = low
    while end < high:
        end = min(next_break(end, arguments), high)
        at_break = force_at(end, arguments)
        scale = max(scale, abs(at_break))
        if abs(at_break - target) < abs(force - target):
            best, force = end, at_break
    while True:
        # from one piece to the next the force may jump, or cross the target by rounding
        crosses = at_start == target or (at_end < target) != (at_start < target)
        if crosses and abs(at_start - target) <= TOLERANCE * scale:
            return start, at_start, False
        following = next_break(start, arguments)
        # a piece holds from its lower break on, but not at its upper one
        end = high if following > high else np.nextafter(following, low)
        if end > start:
            best, force, scale, at_end, is_crossing = nearest_in_piece(
                force_at, range_of, target, start, end, at_start, best, force, scale, arguments
            )
            if is_crossing:
                return best, force, False
        if following > high:
            return best, force, abs(force - target) > TOLERANCE * scale
        start, at_start = following, force_at(following, arguments)


class MappedCurrent(NamedTuple):
    """Result of the map."""

    current: float  # Within the map's range, A
    force: float  # The force there, N
    saturated: bool  # Whether no current in the range gives the target force


@checked
@dataclass(frozen=True)
class CurrentMap:
    """Inverse of a device's force in the current.

    Attributes
    ----------
    device : Device
        The nominal model of the device.
    low, high : float, A
        Range of the current.

    Raises
    ------
    InputError
        If the range is not finite, or empty.
    """

    device: Device
    low: float
    high: float

    def __post_init__(self) -> None:
        if not (np.isfinite([self.low, self.high]).all() and self.low <= self.high):
            raise InputError(
                f"current map of {self.device.name}: range {self.low} to {self.high} A; expected: "
                "finite, the lowest first"
            )

    @cached_property
    def _model(self) -> DeviceModel:
        return DeviceModel([self.device])

    def __call__(self, force: float, x: float, v: float, states: Sequence[float]) -> MappedCurrent:
        """Find the current for a force.

        Parameters
        ----------
        force : float, N
            Target force, in the structure's scale.
        x : float, m
            Deformation in the structure's scale.
        v : float, m/s
            Its velocity.
        states : sequence of float, one entry per state
            Internal states in the device's units.

        Returns
        -------
        MappedCurrent
            The lowest current that gives the force; where no current of the range does, the one
            whose force is nearest.
        """
        model = self._model
        motion = [np.array([number], dtype=float) for number in (1.0, x, v)]
        arguments = (*motion, np.array(states, dtype=float), model.numbers)
        low, high = float(self.low), float(self.high)
        current, attained, saturated = nearest_current(
            model.combined_force, model.combined_range, float(force), low, high, arguments
        )
        return MappedCurrent(float(current), float(attained), bool(saturated))
