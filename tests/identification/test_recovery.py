"""Every law's parameters come back from noisy data within the intervals that the fit states."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.stats import binom, chi2

from isolation_sim.identification.fit import fit
from isolation_sim.laws import LAWS

from .conftest import HELD, NUMBERS, noisy_campaign

SEEDS, STARTS = 3, 6
STATED = 0.95
RISK = 1e-4
"""Chance that a bound below is passed by accident."""


def fewest(tries):
    """As few intervals as may hold the truth by chance."""
    return binom.ppf(RISK, tries, STATED)


def test_the_bounds_of_chance():
    # 16 or fewer of 24 at 95 % have a chance of 1.4e-5, 17 or fewer one of 1.3e-4
    assert fewest(24) == 17
    assert binom.cdf(16, 24, STATED) < RISK < binom.cdf(17, 24, STATED)


@cache
def recovered(name):
    """Estimates of every seed and the true values, (seeds, 3, n) and (n,); the fits are checked."""
    results = []
    for seed in range(SEEDS):
        result = fit(
            noisy_campaign(name, seed), name, current_degree=1, fixed=HELD.get(name),
            starts=STARTS, threads=1,
        )  # fmt: skip
        assert result.converged
        assert result.error == pytest.approx(0.01, rel=0.1)
        assert result.noise == pytest.approx(0.01, rel=0.15)
        assert all(e.determined for e in result.estimates)
        results.append(np.array([(e.low, e.value, e.high) for e in result.estimates]).T)
    truth = [NUMBERS[name][e.name][0] + NUMBERS[name][e.name][1] * e.current
             for e in result.estimates]  # fmt: skip
    return np.array(results), np.array(truth)


def held_and_tries(name):
    """Share of intervals that hold the truth, and the number of independent ones."""
    (low, _, high), truth = np.moveaxis(recovered(name)[0], 1, 0), recovered(name)[1]
    # the parameters of one noise are not independent: their number counts as its square root
    return np.mean((low <= truth) & (truth <= high)), SEEDS * int(np.sqrt(len(truth)))


LONG = (
    "friction_pendulum", "gamota_filisko", "rate_dependent_bouc_wen", "spencer", "spring_pot",
    "strain_stiffening_power",
)  # fmt: skip
"""Laws whose fits take longest."""


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] if n in LONG else []) for n in LAWS]
)
def test_a_law_comes_back_within_its_intervals(name):
    result, truth = recovered(name)
    low, value, high = np.moveaxis(result, 1, 0)
    # ten half-widths off is no accident
    assert np.all(np.abs(value - truth) < 5 * (high - low) + 1e-3 * np.abs(truth))
    share, tries = held_and_tries(name)
    assert share * tries >= fewest(tries)


@pytest.mark.parametrize(
    "laws",
    [
        pytest.param([name for name in LAWS if name not in LONG], id="most"),
        pytest.param(list(LAWS), id="all", marks=pytest.mark.slow),
    ],
)
def test_intervals_of_laws_together_hold_the_truth_as_often_as_stated(laws):
    held, tries = np.array([held_and_tries(name) for name in laws]).T
    assert held @ tries >= fewest(tries.sum())
    # nor are the intervals wider than the estimates are spread
    spread = []
    for name in laws:
        low, value, high = np.moveaxis(recovered(name)[0], 1, 0)
        ratio = np.std(value, axis=0, ddof=1) / (np.mean(high - low, axis=0) / (2 * 1.96))
        spread.append(np.median(ratio**2))
    degrees = (SEEDS - 1) * len(spread)
    chance = np.sqrt(chi2.ppf([RISK, 1 - RISK], degrees) / degrees)
    assert chance[0] < np.sqrt(np.mean(spread)) < chance[1]
