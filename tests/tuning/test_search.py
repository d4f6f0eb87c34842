"""The search on functions whose optimum is known, its ranges, and its intervals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import t as student

from isolation_sim.errors import InputError
from isolation_sim.search_range import SearchRange
from isolation_sim.tuning.search import search
from isolation_sim.tuning.tuning import mean_interval

RANGES = {"a": SearchRange(0.01, 10.0), "b": SearchRange(-1.0, 3.0, "linear")}


def valley(candidates):
    """Least at a = 0.1, b = 2; the start has b = 0 and a = 1."""
    rows = [{"a": 1.0, "b": 0.0} | each for each in candidates]
    return np.array([[np.log(r["a"] / 0.1) ** 2 + (r["b"] - 2) ** 2 - 1] for r in rows])


def run_search(evaluate, ranges=RANGES, evaluations=400, known=(), saved=None, seed=3):
    start = {"a": 1.0, "b": 0.0}
    save = (lambda trials: None) if saved is None else lambda t: saved.append(list(t))
    return search(ranges, start, evaluate, evaluations, seed, known, save)


def test_search_ends_at_the_least_of_a_valley():
    trials = run_search(valley)
    assert trials[0].settings == {} and len(trials) <= 400
    best = min(trials, key=lambda trial: trial.mean)
    assert best.settings["a"] == pytest.approx(0.1, rel=0.02)
    assert best.settings["b"] == pytest.approx(2.0, abs=0.02)


def test_search_ends_at_an_optimum_on_the_bounds():
    def slope(candidates):
        return np.array([[each.get("a", 1.0) - each.get("b", 0.0)] for each in candidates])

    best = min(run_search(slope, evaluations=200), key=lambda trial: trial.mean)
    assert best.settings == {"a": 0.01, "b": 3.0}


def test_known_trials_are_reported_and_not_run_again():
    saved = []
    whole = run_search(valley, saved=saved, evaluations=150)
    half = saved[len(saved) // 2]
    assert 1 < len(half) < len(whole)
    counted = []

    def counting(candidates):
        counted.extend(candidates)
        return valley(candidates)

    assert run_search(counting, known=half, evaluations=150) == whole
    assert len(counted) == len(whole) - len(half)
    with pytest.raises(InputError, match="do not belong to this search"):
        run_search(valley, known=half, evaluations=150, seed=4)


def test_a_converged_search_begins_anew_elsewhere():
    def flat(candidates):
        return np.zeros((len(candidates), 1))

    trials = run_search(flat, {"b": RANGES["b"]}, evaluations=1500)
    sizes = [len(trials[k].settings) for k in (0, 1)]
    assert sizes == [0, 1]
    # the larger population of the second search asks beyond where the first one stayed
    assert np.ptp([trial.settings["b"] for trial in trials[1:]]) > 3.0


@pytest.mark.parametrize("one", [SearchRange(0.02, 2.0), SearchRange(-1.0, 3.0, "linear")])
def test_places_and_values_of_a_range_belong_together(one):
    assert (one.value(0.0), one.value(1.0)) == (one.low, one.high)
    for place in (0.1, 0.5, 0.77):
        assert one.place(one.value(place)) == pytest.approx(place, abs=1e-4)
    assert one.place(one.low - 1) == 0 and one.place(one.high + 1) == 1
    assert one.place(None) == one.place(np.inf) == 0.5


@pytest.mark.parametrize("bounds", [(0.0, 1.0), (2.0, 1.0), (1.0, np.inf), (1.0, 2.0, "cubic")])
def test_a_range_that_cannot_be_searched_is_refused(bounds):
    with pytest.raises(InputError, match="expected: finite bounds that increase"):
        SearchRange(*bounds)


def test_intervals_of_many_normal_values_are_student_s():
    values = np.random.default_rng(1).normal(0.3, 1.0, 200)
    mean, low, high = mean_interval(values)
    half = student.ppf(0.975, 199) * values.std(ddof=1) / np.sqrt(200)
    assert mean == pytest.approx(values.mean())
    np.testing.assert_allclose((low, high), (mean - half, mean + half), atol=0.02)
    assert mean_interval(values) == mean_interval(values)


@pytest.mark.parametrize("n", [5, 8, 20])
def test_intervals_of_few_normal_values_are_as_wide_as_student_s(n):
    """Those of a plain bootstrap have 65, 78 and 91 % of this width."""
    shares = []
    for values in np.random.default_rng(7).normal(0.3, 1.0, (20, n)):
        _, low, high = mean_interval(values)
        half = student.ppf(0.975, n - 1) * values.std(ddof=1) / np.sqrt(n)
        shares.append((high - low) / 2 / half)
    assert 0.9 < np.mean(shares) < 1.05
    assert mean_interval([1.0, 2.0]) == (1.5, 1.0, 2.0)


def test_intervals_of_equal_values_and_of_one():
    assert mean_interval([0.5, 0.5]) == (0.5, 0.5, 0.5)
    assert np.isnan(mean_interval([0.5])[1:]).all()
