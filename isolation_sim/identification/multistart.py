"""Starts from which it is worth while to fit a law whose parameters depend on the current."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from ..laws import Device
from .least_squares import Optimum
from .unknowns import Unknowns

KEPT = 4
"""Starts that get their dependence on the current."""


def promising(
    unknowns: Unknowns,
    minimised: Callable[[Unknowns, NDArray], Optimum],
    pool: ThreadPoolExecutor,
    number: int,
    seed: int,
) -> list[NDArray]:
    """Search from many starts with parameters that do not depend on the current.

    These have a third of the unknowns, or half, and far fewer places where a search gets stuck.

    Parameters
    ----------
    unknowns : Unknowns
        Those of the law, over the currents.
    minimised : callable
        Search of given unknowns from a start.
    pool : concurrent.futures.ThreadPoolExecutor
        Who computes.
    number : int
        How many starts.
    seed : int
        Of the random ones.

    Returns
    -------
    list of (n_unknowns,) array
        Where the best few different searches ended, the best first; then the published numbers with
        their dependence on the current, or random ones.
    """
    steady = unknowns.steady()
    found = pool.map(lambda start: minimised(steady, start), steady.starts(number, seed))
    kept = different(found)[:KEPT]
    begin = [unknowns.of(Device(unknowns.law, steady.dependence(o.x))) for o in kept]
    return begin + unknowns.starts(1, seed)


def different(found: Iterable[Optimum]) -> list[Optimum]:
    """Leave out searches without a finite cost, and those that ended where a better one did.

    Parameters
    ----------
    found : iterable of Optimum
        Outcomes of searches.

    Returns
    -------
    list of Optimum
        The best first; the costs differ by a thousandth.
    """
    kept: list[Optimum] = []
    for one in sorted(found, key=lambda o: o.cost):
        if np.isfinite(one.cost) and not any(one.cost < 1.001 * o.cost for o in kept):
            kept.append(one)
    return kept
