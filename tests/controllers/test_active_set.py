"""The solver of quadratic programmes, against others and against the conditions of optimality."""

import daqp
import numpy as np
import pytest
from scipy.optimize import nnls

from controllers.compiled import collect
from controllers.predictive import active_set
from isolation_sim.compilation.generated import load_text

HEADER = """from __future__ import annotations

import math
from numba import njit

plain = njit(error_model="numpy")
run = njit(error_model="numpy", cache=True)"""


@pytest.fixture(scope="module")
def solve():
    parts = {}
    collect(active_set.solve, parts)
    parts["solve"] = parts["solve"].replace("@plain", "@run")
    module = load_text("test", "\n\n\n".join([HEADER, *parts.values()]))

    def solve(hessian, gradient, rows, upper, lower):
        n = len(gradient)
        x, square = np.zeros(n), (n, n)
        work = np.zeros(square), np.zeros(square), np.zeros((4, n + 1)), np.zeros(n + 1)
        return x, module.solve(hessian, gradient, rows, len(rows), upper, lower, x, work)

    return solve


def random_programme(rng, around=None):
    """Up to 23 unknowns and 120 rows; around a point that lies within all constraints or not."""
    n, m = rng.integers(1, 24), rng.integers(0, 121)
    root = rng.normal(size=(n, n))
    hessian = root @ root.T / n + 0.05 * np.eye(n)
    gradient, rows = 3.0 * rng.normal(size=n), rng.normal(size=(m, n))
    middle = np.concatenate([np.eye(n), rows]) @ rng.normal(size=n)
    if around == "infeasible":
        middle += 3.0 * rng.normal(size=n + m)
    above, below = rng.exponential(size=(2, n + m))
    above[rng.random(n + m) < 0.3] = below[rng.random(n + m) < 0.3] = 1e30
    upper, lower = middle + above, middle - below
    return hessian, gradient, rows, np.minimum(upper, 1e30), np.maximum(lower, -1e30)


def test_solutions_are_those_of_daqp_and_no_other_has_one_where_it_has_none(solve):
    rng, infeasible = np.random.default_rng(1), 0
    for k in range(4000):
        programme = random_programme(rng, "infeasible" if k % 4 == 0 else None)
        x, iterations = solve(*programme)
        sense = np.zeros(len(programme[-1]), dtype=np.int32)
        other, _, flag, _ = daqp.solve(*programme, sense, primal_tol=1e-10, dual_tol=1e-10)
        assert (iterations < 0) == (flag < 0), k
        infeasible += flag < 0
        if flag > 0:
            np.testing.assert_allclose(x, other, rtol=0, atol=1e-8)
    assert 500 < infeasible < 1000


def test_solutions_meet_the_conditions_of_optimality(solve):
    """The gradient is a combination of the active constraints' normals, none of them pulling."""
    rng = np.random.default_rng(2)
    for _ in range(300):
        hessian, gradient, rows, upper, lower = programme = random_programme(rng)
        x, _ = solve(*programme)
        normals = np.concatenate([np.eye(len(x)), rows])
        above, below = normals @ x - upper, lower - normals @ x
        assert max(above.max(), below.max()) < 1e-8
        active = np.concatenate([normals[above > -1e-8], -normals[below > -1e-8]])
        slope = hessian @ x + gradient
        left = nnls(active.T, -slope)[1] if len(active) else np.linalg.norm(slope)
        assert left < 1e-7


def test_nearly_dependent_constraints_are_met_and_cost_no_more_than_one_of_them(solve):
    rng = np.random.default_rng(3)
    for k in range(300):
        hessian, gradient, rows, upper, lower = programme = random_programme(rng)
        n, m = len(gradient), len(rows)
        by = 10.0 ** rng.uniform(-15, -6)
        moved = rows + by * rng.normal(size=rows.shape)
        # the copies' bounds are as near: they cut off as little
        twice = (
            hessian, gradient, np.concatenate([rows, moved, rows]),
            np.concatenate([upper, upper[n:] + by, upper[n:]]),
            np.concatenate([lower, lower[n:] - by, lower[n:]]),
        )  # fmt: skip
        (one, _), (x, iterations) = solve(*programme), solve(*twice)
        assert iterations >= 0, k
        value = np.concatenate([x, twice[2] @ x])
        assert max((value - twice[3]).max(), (twice[4] - value).max()) < 1e-8
        cost, least = (p @ hessian @ p / 2 + gradient @ p for p in (x, one))
        assert cost >= least - 1e-8 and cost <= least + 1e3 * by * (1 + m) + 1e-8


def test_far_bounds_of_nearly_flat_variables_are_met_to_the_last_bit(solve):
    """The slacks of the predictive controller: curvature 1e-6, slope 2.4, bound 0."""
    hessian, gradient = np.diag([1.0, 1e-6]), np.array([-1.0, 2.4])
    rows, upper = np.array([[1.0, -1.0]]), np.array([1e30, 1e30, 2.0])
    x, iterations = solve(hessian, gradient, rows, upper, np.array([-1e30, 0.0, -1e30]))
    assert iterations > 0 and x[1] == 0.0 and x[0] == pytest.approx(1.0, abs=1e-15)
