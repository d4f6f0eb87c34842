"""Inverse current map: the current at which a device gives a wanted force."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from isolation_sim.errors import InputError
from isolation_sim.laws import Device

SAMPLES = 17
"""Currents at which a force that is not affine in the current is sampled for brackets."""
REACHED = 1e-9
"""Within this, relative to the largest force met, the wanted force counts as reached."""
GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def nearest_between(
    force_at: Callable, wanted: float, a: float, b: float, arguments: Any
) -> tuple[float, float]:
    """Current in a bracket at which a force comes nearest to the wanted one, by golden section.

    Where the force crosses the wanted one, the distance between them has a kink, which golden
    section finds to rounding.

    Parameters
    ----------
    force_at : callable
        ``force_at(current, arguments)`` -> N.
    wanted : float, N
        Wanted force.
    a, b : float, A
        The bracket; the distance should have one minimum in it.
    arguments : object
        Passed on.

    Returns
    -------
    current : float, A
        Within the bracket.
    force : float, N
        The force there.

    References
    ----------
    Kiefer 1953.
    """
    width = b - a
    left, right = b - GOLDEN * width, a + GOLDEN * width
    at_left, at_right = force_at(left, arguments), force_at(right, arguments)
    # golden section loses a bit and a half every two rounds: 80 are more than rounding allows
    for _ in range(80):
        goes_left = abs(at_left - wanted) < abs(at_right - wanted)
        if goes_left:
            b, right, at_right = right, left, at_left
        else:
            a, left, at_left = left, right, at_right
        if right <= a or left >= b:
            break
        new = b - GOLDEN * (b - a) if goes_left else a + GOLDEN * (b - a)
        at_new = force_at(new, arguments)
        if goes_left:
            left, at_left = new, at_new
        else:
            right, at_right = new, at_new
        if at_new == wanted:
            break
    if abs(at_left - wanted) < abs(at_right - wanted):
        return left, at_left
    return right, at_right


def nearest_current(
    force_at: Callable, wanted: float, low: float, high: float, is_affine: bool, arguments: Any
) -> tuple[float, float, bool]:
    """Lowest current at which a force is reached, or comes nearest to the wanted one.

    Written so that Numba compiles it too.

    Parameters
    ----------
    force_at : callable
        ``force_at(current, arguments)`` -> N.
    wanted : float, N
        Wanted force.
    low, high : float, A
        Range of the current.
    is_affine : bool
        Whether the force is affine in the current; if not, it is sampled for brackets.
    arguments : object
        Passed on to ``force_at``.

    Returns
    -------
    current : float, A
        Within the range.
    force : float, N
        The force there.
    saturated : bool
        Whether it misses the wanted one.
    """
    before, here = low, low
    at_before = at_here = force_at(low, arguments)
    best, force, scale = low, at_here, abs(at_here)
    n_samples = 2 if is_affine else SAMPLES
    step = (high - low) / (n_samples - 1)
    # one round more than there are samples: the last one looks at the end of the range
    for k in range(1, n_samples + 1):
        after = high if k >= n_samples - 1 else low + k * step
        at_after = force_at(after, arguments)
        scale = max(scale, abs(at_after))
        crosses = (at_here < wanted) != (at_after < wanted)
        candidate, at_candidate = here, at_here
        if is_affine and crosses:
            share = (wanted - at_here) / (at_after - at_here)
            candidate = min(max(here + share * (after - here), low), high)
            at_candidate = force_at(candidate, arguments)
        elif not is_affine:
            miss = abs(at_here - wanted)
            is_valley = miss <= min(abs(at_before - wanted), abs(at_after - wanted))
            if miss < abs(force - wanted):
                best, force = here, at_here
            if crosses or is_valley:
                start = here if crosses else before
                candidate, at_candidate = nearest_between(force_at, wanted, start, after, arguments)
        if abs(at_candidate - wanted) < abs(force - wanted):
            best, force = candidate, at_candidate
        if abs(force - wanted) <= REACHED * scale:
            break
        before, here, at_before, at_here = here, after, at_here, at_after
    return best, force, abs(force - wanted) > REACHED * scale


class MappedCurrent(NamedTuple):
    """What the map returns.

    Attributes
    ----------
    current : float, A
        Within the map's range.
    force : float, N
        The force there.
    saturated : bool
        Whether the wanted force is out of reach.
    """

    current: float
    force: float
    saturated: bool


@dataclass(frozen=True)
class CurrentMap:
    """Inverse of a device's force in the current.

    Attributes
    ----------
    device : Device
        The device believed in.
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
                f"current map of {self.device.name}: range {self.low} to {self.high} A; accepted: "
                "finite, the lowest first"
            )

    @cached_property
    def _is_affine(self) -> bool:
        return self.device.is_affine_in_current

    def __call__(self, force: float, x: float, v: float, states: Sequence[float]) -> MappedCurrent:
        """Find the current for a force.

        Parameters
        ----------
        force : float, N
            Wanted force, in the structure's scale.
        x : float, m
            Deformation in the structure's scale.
        v : float, m/s
            Its velocity.
        states : sequence of float, one entry a state
            Internal states in the device's units.

        Returns
        -------
        MappedCurrent
            The lowest current that reaches the force, or the one that comes nearest.
        """
        arguments = (float(x), float(v), tuple(map(float, states)))
        return MappedCurrent(
            *nearest_current(
                self._force_at, float(force), self.low, self.high, self._is_affine, arguments
            )
        )

    def _force_at(self, current: float, arguments: tuple) -> float:
        x, v, states = arguments
        return float(self.device.force(x, v, states, current))
