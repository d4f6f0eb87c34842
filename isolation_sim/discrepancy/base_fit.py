"""Fit the law alone to measured runs, as the start of a diagnosis."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..identification.campaign import Campaign
from ..identification.current_basis import currents_of
from ..identification.least_squares import Optimum
from ..identification.multistart import promising
from ..identification.sensitivities import Simulator
from ..identification.unknowns import Unknowns
from ..laws.law import Law
from .candidates import Fitted, fitted
from .measured import Measured
from .model import Model

STARTS = 20
_SAFETY = 2
"""Times as many integration steps as resolve the law, for the outcome: effects and noise ask for
more. The search does without."""
_MOST = 16
"""Integration steps a sample that are tried."""
SEARCHED = 24_000
"""Samples, about, on which a law and its effects are searched; the outcome is fitted to all."""
_LAST = 3
"""Starts that get so many samples."""
_ROUGH = 5000
"""Samples on which starts are sorted out."""


def law_model(campaign: Campaign, law: Law, data: Measured, degree: int | None = None) -> Model:
    """Put a law's unknowns and measured runs together.

    Parameters
    ----------
    campaign : Campaign
        Where the runs are from.
    law : Law
        The law.
    data : Measured
        The runs.
    degree : int, optional
        Degree of the parameters' polynomials of the current; the highest that the fitted runs
        determine, 2 at most, by default.

    Returns
    -------
    Model
        Without effects.
    """
    kept = data.fitted
    x, v, force = (float(np.sqrt(np.mean(y[kept] ** 2))) for y in (data.x, data.v, data.force))
    fitted_runs = campaign.fitted
    unknowns = Unknowns(law, currents_of(campaign, fitted_runs, degree), (force, x, x / v))
    return Model(data, unknowns, 1)


def fitted_law(
    model: Model, pool: ThreadPoolExecutor, seed: int, advance: Callable[[], None]
) -> Fitted:
    """Fit the law from many starts.

    Starts are sorted out on a part of the samples and with parameters that do not depend on the
    current; the best few then get their dependence, the best three of these more samples, and the
    best one all of them.

    Parameters
    ----------
    model : Model
        Without effects.
    pool : concurrent.futures.ThreadPoolExecutor
        Who computes.
    seed : int
        Of the random starts.
    advance : callable
        Called after each start.

    Returns
    -------
    Fitted

    Raises
    ------
    InputError
        If no start gives finite forces.
    """
    u = model.unknowns
    data = model.data.thinned(max(_ROUGH, len(model.data.x) // 6))

    def minimised(
        unknowns: Unknowns, start: NDArray, most: int = 25, expected: NDArray | None = None
    ) -> Optimum:
        for n_steps in (2, 8):
            here = Model(data, unknowns, n_steps, expected=expected)
            found = here.minimised(start, most, 1e-4)
            if np.isfinite(found.cost):
                break
        advance()
        return found

    begin = promising(u, minimised, pool, STARTS, seed)
    model = replace(model, expected=begin[0])
    tried = pool.map(lambda s: minimised(u, s, 40, begin[0]), begin)
    ready = sorted((o for o in tried if np.isfinite(o.cost)), key=lambda o: o.cost)
    if not ready:
        raise InputError(f"no start gives {u.law.name} finite forces under these data")
    part = replace(model, data=model.data.thinned(SEARCHED))
    last = pool.map(lambda o: fitted(resolved(part, o.x, 1), o.x, 100, 1e-6), ready[:_LAST])
    best = min(last, key=_rank).values
    return fitted(resolved(model, best), best)


def _rank(found: Fitted) -> tuple[bool, float]:
    """A law that runs away under any of the motions, held out or not, comes last."""
    runs_away = not np.array_equal(found.force, found.model.data.bounded(found.force))
    return runs_away or not np.isfinite(found.cost), found.cost


def given_law(model: Model, start: NDArray) -> Fitted:
    """Fit the law from given numbers.

    Parameters
    ----------
    model : Model
        Without effects.
    start : (n_unknowns,) array
        The numbers.

    Returns
    -------
    Fitted
    """
    return fitted(resolved(replace(model, expected=start), start), start, 100, 1e-8)


def resolved(model: Model, values: NDArray, safety: int = _SAFETY) -> Model:
    """Take as many integration steps a sample as the law needs.

    Parameters
    ----------
    model : Model
        Without effects.
    values : (n_values,) array
        Where to look: the law's unknowns come first.
    safety : int
        Times as many as the law needs.

    Returns
    -------
    Model
    """
    u = model.unknowns
    simulator = Simulator(u.law, model.data.motion, u.owner, u.power, 1)
    n_steps = simulator.resolved(u.coefficients(values[: model.n_law]), 2e-4, most=_MOST).n_steps
    # the most was not held against a finer one
    return replace(model, n_steps=n_steps * (safety if n_steps < _MOST else _SAFETY))
