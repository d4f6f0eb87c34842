"""Every law's parameters come back from noisy data within the intervals that the fit states."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom, chi2

from isolation_sim.identification.fit import fit
from isolation_sim.laws import LAWS

SEEDS, STARTS = 8, 8
STATED = 0.95
RISK = 1e-4
"""Chance that a bound below is passed by accident, a law."""


def fewest(tries):
    """As few intervals as may hold the truth by chance."""
    return binom.ppf(RISK, tries, STATED)


def test_the_bounds_of_chance():
    # 16 or fewer of 24 at 95 % have a chance of 1.4e-5, 17 or fewer one of 1.3e-4
    assert fewest(24) == 17
    assert binom.cdf(16, 24, STATED) < RISK < binom.cdf(17, 24, STATED)


@pytest.mark.parametrize("name", LAWS)
def test_intervals_hold_the_truth_as_often_as_stated(name, campaign_of, held, true_value):
    hits, values, widths = [], [], []
    for seed in range(SEEDS):
        result = fit(
            campaign_of(name, seed), name, current_degree=1, fixed=held.get(name), starts=STARTS,
            threads=1,
        )  # fmt: skip
        assert result.converged
        assert result.error == pytest.approx(0.01, rel=0.1)
        assert result.noise == pytest.approx(0.01, rel=0.15)
        truth = np.array([true_value(name, e.name, e.current) for e in result.estimates])
        low, value, high = np.array([(e.low, e.value, e.high) for e in result.estimates]).T
        # ten half-widths off is no accident
        assert np.all(np.abs(value - truth) < 5 * (high - low) + 1e-3 * np.abs(truth))
        assert all(e.determined for e in result.estimates)
        hits.append((low <= truth) & (truth <= high))
        values.append(value)
        widths.append(high - low)
    # the parameters of one noise are not independent: their number counts as its square root
    tries = SEEDS * int(np.sqrt(len(truth)))
    assert np.mean(hits) * tries >= fewest(tries)
    # nor are the intervals wider than the estimates are spread
    spread = np.std(values, axis=0, ddof=1) / (np.mean(widths, axis=0) / (2 * 1.96))
    chance = np.sqrt(chi2.ppf([RISK, 1 - RISK], SEEDS - 1) / (SEEDS - 1))
    assert chance[0] < np.median(spread) < chance[1]
