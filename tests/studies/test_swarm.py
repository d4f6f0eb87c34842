"""Every search behind one function: equal budgets, seeds, refusals."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from isolation_sim.errors import InputError
from studies.swarm import (
    OBJECTIVES,
    available_methods,
    force_objective,
    search,
)

LIBRARY = ("genetic", "particle_swarm", "cma_es")
BOUNDS = [(0.0, 10.0), (-5.0, 5.0)]


def bowl(x):
    return float((x[0] - 3) ** 2 + (x[1] - 1) ** 2)


@pytest.fixture(params=available_methods())
def method(request):
    if request.param in LIBRARY:
        pytest.importorskip("pymoo")
    return request.param


def test_budget_is_respected_and_history_falls(method):
    seen = []

    def counted(x):
        seen.append(x)
        return bowl(x)

    result = search(method, counted, BOUNDS, 437, seed=1)
    assert len(seen) == result.evaluations == result.history.size == 437
    assert np.all(np.diff(result.history) <= 0)
    assert result.value == result.history[-1] == bowl(result.x)
    assert result.method == method
    points, bounds = np.array(seen), np.array(BOUNDS)
    assert np.all((points >= bounds[:, 0]) & (points <= bounds[:, 1]))


def test_finds_the_bottom(method):
    peaks = {"fish_swarm": 0.05, "fruit_fly_fixed": 1.0, "genetic": 0.01}  # they stay coarse
    values = [search(method, bowl, BOUNDS, 3000, seed).value for seed in range(3)]
    assert np.median(values) < peaks.get(method, 1e-5)


def test_a_seed_repeats(method):
    a, b, c = (search(method, bowl, BOUNDS, 300, seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(a.history, b.history)
    np.testing.assert_array_equal(a.x, b.x)
    assert not np.array_equal(a.history, c.history)


def test_values_that_are_not_finite_are_worst(method):
    def holed(x):
        return bowl(x) if x[0] > 2 else np.nan

    result = search(method, holed, BOUNDS, 800, seed=0)
    assert result.x[0] > 2 and np.isfinite(result.value)
    with pytest.raises(InputError, match="not finite at any of 100 points"):
        search(method, lambda x: np.inf, BOUNDS, 100, seed=0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"method": "fruit_flies"}, "did you mean 'fruit_fly'"),
        ({"bounds": [(0, 1, 2)]}, "shape"),
        ({"bounds": [(1, 0)]}, "the lower first"),
        ({"bounds": [(0, np.inf)]}, "finite"),
        ({"budget": 0}, "budget 0"),
        ({"budget": 10.5}, "budget: given 10.5"),
        ({"scal": 3}, "did you mean 'scale'"),
        ({"scale": [1, -1]}, "2 positive numbers"),
        ({"step": 0}, "step 0"),
        ({"method": "fish_swarm", "crowding": 2}, "crowding 2"),
    ],
)
def test_refused(arguments, message):
    settings = {"method": "fruit_fly", "bounds": BOUNDS, "budget": 10} | arguments
    with pytest.raises(InputError, match=message) as caught:
        search(objective=bowl, seed=0, **settings)
    assert "expected" in str(caught.value) and "\n" not in str(caught.value)


def test_without_pymoo_the_message_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymoo", None)
    with pytest.raises(InputError, match="pip install pymoo"):
        search("genetic", bowl, BOUNDS, 10, 0)


def test_objectives():
    time = np.linspace(0, 1, 50)
    force = 3 * np.sin(6 * time) + 1
    for name in OBJECTIVES:
        objective = force_objective(name, force, lambda p: p[0] * force)
        assert objective(np.array([1.0])) == pytest.approx(0, abs=1e-9)
        assert objective(np.array([1.5])) > 0.1
        assert objective(np.array([np.nan])) == np.inf
    # the defect of Li & Li, Eq 16
    assert force_objective("squared_force", force, lambda p: -force)(np.zeros(1)) == 0
    with pytest.raises(InputError, match="did you mean 'rms'"):
        force_objective("rsm", force, lambda p: force)
    with pytest.raises(InputError, match="finite"):
        force_objective("rms", [np.nan], lambda p: force)
