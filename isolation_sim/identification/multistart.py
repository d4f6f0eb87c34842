"""Screen the starts of a fit with parameters that do not depend on the current."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from ..laws import Device
from .least_squares import Optimum
from .parameterisation import Parameterisation

SCREENED = 4
"""Starts that get their dependence on the current."""


def screen_starts(
    parameterisation: Parameterisation,
    minimise: Callable[[Parameterisation, NDArray], Optimum],
    pool: ThreadPoolExecutor,
    number: int,
    seed: int,
) -> list[NDArray]:
    """Search from many starts with parameters that do not depend on the current."""
    # These have a third of the unknowns, or half, and far fewer local minima. Returned are the ends
    # of the best few different searches, the best first, then the published numbers with their
    # dependence on the current, or random ones.
    steady, law = parameterisation.steady(), parameterisation.law
    result = pool.map(lambda start: minimise(steady, start), steady.starts(number, seed))
    keep = distinct(result)[:SCREENED]
    begin = [parameterisation.of(Device(law, steady.dependence(o.x))) for o in keep]
    return begin + parameterisation.starts(1, seed)


def distinct(result: Iterable[Optimum]) -> list[Optimum]:
    """Leave out searches without a finite cost and repeated ends; costs differ by a thousandth."""
    keep: list[Optimum] = []
    for one in sorted(result, key=lambda o: o.cost):
        if np.isfinite(one.cost) and not any(one.cost < 1.001 * o.cost for o in keep):
            keep.append(one)
    return keep
