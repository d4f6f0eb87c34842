"""Yu et al., Section 4: the cosine test function, and identification with a declared scale."""

from __future__ import annotations

import numpy as np
import pytest

from isolation_sim.laws import law
from studies.papers.search_002 import RUNS, cosine, flights, share_that_prints
from studies.swarm import force_objective, search

SEEDS = [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))]
GLOBAL, LOCAL = -21.143447, -6.704658


def test_minima_of_the_cosine_function():
    x = np.linspace(0.02, 1.0, 2_000_001)
    values = cosine(x[:, None])
    first, second = values[x < 0.1], values[(x > 0.1) & (x < 0.2)]
    assert first.min() == pytest.approx(GLOBAL, abs=1e-6)
    assert x[x < 0.1][first.argmin()] == pytest.approx(0.044538, abs=1e-6)
    assert second.min() == pytest.approx(LOCAL, abs=1e-6)
    assert x[(x > 0.1) & (x < 0.2)][second.argmin()] == pytest.approx(0.148298, abs=1e-6)


def test_adaptive_step_finds_the_global_minimum():
    flight = flights(20.0, adaptive=True)
    assert share_that_prints(flight.values, -21.143) >= 0.99
    assert np.max(flight.values) <= LOCAL + 1e-3  # the worst run is in the next minimum
    best = flight.coefficients[np.argmin(flight.values), 0]
    assert best == pytest.approx(0.044538, abs=1e-5)
    assert np.all(np.diff(flight.history, axis=1) <= 0)


def test_fixed_step_20_stays_coarse():
    flight = flights(20.0, adaptive=False)
    assert share_that_prints(flight.values, -21.143) == pytest.approx(0.90, abs=0.02)
    assert np.max(flight.values) < -21.0  # in the right minimum, not at its bottom


def test_fixed_step_2_is_caught_in_the_next_minimum():
    near_local = np.mean(np.abs(flights(2.0, adaptive=False).values - LOCAL) < 0.1)
    assert near_local == pytest.approx(0.83, abs=0.02)
    centre = flights(2.0, adaptive=False, starts=np.zeros((RUNS, 1, 2)))
    assert np.mean(np.abs(centre.values - LOCAL) < 0.1) > 0.999


def test_search_is_the_same_method():
    def objective(x):
        return float(np.cos(20 * np.pi * x[0]) / x[0])

    for seed in range(10):
        result = search(
            "fruit_fly", objective, [(1e-3, 1.0)], 500, seed, population=10, scale=[1.0]
        )
        assert result.value == pytest.approx(GLOBAL, abs=1e-3)


class TestIdentification:
    """The hybrid law of one condition, from its own force: 2 Hz, 4 mm, 2 A; N and mm."""

    EXACT = np.array([60.76, 0.42, 37.04, 7.28])
    BOUNDS = ((0.0, 200.0), (0.0, 2.0), (0.0, 200.0), (0.1, 60.0))
    SCALE = (400.0, 4.0, 400.0, 80.0)  # about ten times what is expected

    def setup_method(self):
        t = np.arange(0, 1, 1 / 64) + 1e-4
        x = 4 * np.sin(2 * np.pi * 2 * t)
        sign = np.sign(np.cos(2 * np.pi * 2 * t))

        def model(p):
            return p[0] * np.sinh(p[1] * x) + p[2] * np.exp(-(x**2) / (2 * p[3])) * sign

        device = law("hybrid").law
        si = (60.76, 420.0, 37.04, 7.28e-6, 0.0, 1e-9)
        self.force = device.force(1e-3 * x, sign, (), si)
        np.testing.assert_allclose(self.force, model(self.EXACT), rtol=1e-9)
        self.objective = force_objective("rms", self.force, model)

    @pytest.mark.parametrize("seed", SEEDS)
    def test_a_declared_scale_recovers_the_law(self, seed):
        result = search("fruit_fly", self.objective, self.BOUNDS, 25_000, seed, scale=self.SCALE)
        assert result.value < 2e-5 * np.std(self.force)
        np.testing.assert_allclose(result.x, self.EXACT, rtol=5e-4)

    @pytest.mark.parametrize("seed", SEEDS)
    def test_the_reciprocal_alone_fails(self, seed):
        result = search("fruit_fly", self.objective, self.BOUNDS, 25_000, seed, scale=1.0)
        assert result.value > 0.15 * np.std(self.force)
        assert np.max(np.abs(result.x / self.EXACT - 1)) > 0.5

    @pytest.mark.slow
    def test_the_adaptive_step_beats_the_fixed_one(self):
        def median_cost(method):
            runs = (search(method, self.objective, self.BOUNDS, 5000, seed) for seed in range(5))
            return np.median([run.value for run in runs])

        assert median_cost("fruit_fly") < 0.1 * median_cost("fruit_fly_fixed")
