"""Least squares within bounds against SciPy's, on textbook problems."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from isolation_sim.identification.least_squares import levenberg_marquardt, unit_columns

T = np.linspace(0.0, 3.0, 60)
NOISE = 0.02 * np.random.default_rng(1).standard_normal(T.size)
FREE = np.inf


def rosenbrock(x):
    return np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]]), np.array([[-20 * x[0], 10], [-1, 0]])


def powell(x):
    """Powell's singular function: the Jacobian loses rank at the optimum."""
    a, b, c, d = x
    residual = [a + 10 * b, np.sqrt(5) * (c - d), (b - 2 * c) ** 2, np.sqrt(10) * (a - d) ** 2]
    p, q = 2 * (b - 2 * c), 2 * np.sqrt(10) * (a - d)
    rows = [[1, 10, 0, 0], [0, 0, np.sqrt(5), -np.sqrt(5)], [0, p, -2 * p, 0], [q, 0, 0, -q]]
    return np.array(residual), np.array(rows)


def decay(x):
    """Two exponentials in noise."""
    a, b, c, d = x
    first, second = np.exp(-b * T), np.exp(-d * T)
    data = 3 * np.exp(-0.7 * T) + 1.5 * np.exp(-4 * T) + NOISE
    rows = np.stack([first, -a * T * first, second, -c * T * second], axis=1)
    return a * first + c * second - data, rows


def damped(x):
    """A damped oscillation in noise."""
    a, zeta, omega = x
    wave = np.exp(-zeta * T)
    data = 2 * np.exp(-0.4 * T) * np.sin(3 * T) + NOISE
    sine, cosine = wave * np.sin(omega * T), wave * np.cos(omega * T)
    return a * sine - data, np.stack([sine, -a * T * sine, a * T * cosine], axis=1)


CASES = {
    "rosenbrock": (rosenbrock, [-1.2, 1.0], [-FREE] * 2, [FREE] * 2),
    "rosenbrock, upper bound": (rosenbrock, [-1.2, 1.0], [-FREE] * 2, [0.5, FREE]),
    "rosenbrock, lower bound": (rosenbrock, [3.0, 3.0], [-FREE, 1.5], [FREE] * 2),
    "powell": (powell, [3.0, -1.0, 0.0, 1.0], [-FREE] * 4, [FREE] * 4),
    "decay": (decay, [1.0, 0.2, 1.0, 2.0], [0.0] * 4, [FREE] * 4),
    "decay, two bounds": (decay, [1.0, 0.2, 1.0, 2.0], [0.0] * 4, [2.5, FREE, FREE, 3.0]),
    "damped": (damped, [1.0, 0.1, 2.6], [-FREE, 0.0, 0.0], [FREE] * 3),
    "damped, start at a bound": (damped, [1.0, 0.0, 2.6], [-FREE, 0.0, 0.0], [1.6, 2.0, 9.0]),
}


def minimised(problem, start, lower, upper, **options):
    start = np.array(start, float)
    return levenberg_marquardt(
        lambda x, _: problem(x), start, np.array(lower), np.array(upper), **options
    )


@pytest.mark.parametrize("case", CASES)
def test_the_optimum_is_scipys(case):
    problem, start, lower, upper = CASES[case]
    ours = minimised(problem, start, lower, upper, most=300, tolerance=1e-14)
    theirs = least_squares(
        lambda x: problem(x)[0], start, lambda x: problem(x)[1], (lower, upper), "trf",
        1e-14, 1e-14, 1e-14, max_nfev=2000,
    )  # fmt: skip
    # towards a sum of zero squares the decrease stays the same share of what is left
    assert ours.converged or ours.cost < 1e-25
    assert np.all((np.array(lower) <= ours.x) & (ours.x <= np.array(upper)))
    assert ours.cost <= theirs.cost * (1 + 1e-8) + 1e-12
    residual, jacobian = problem(ours.x)
    assert ours.cost == pytest.approx(0.5 * residual @ residual)
    np.testing.assert_array_equal(ours.jacobian, jacobian)
    if case != "powell":
        np.testing.assert_allclose(ours.x, theirs.x, rtol=1e-4, atol=1e-6)


def test_a_bound_that_holds_the_optimum_is_met_exactly():
    problem, start, lower, upper = CASES["decay, two bounds"]
    solution = minimised(problem, start, lower, upper, most=300)
    assert solution.x[0] == 2.5 or solution.x[3] == 3.0


def test_scales_of_the_parameters_do_not_matter():
    def stretched(x, _):
        residual, jacobian = decay(x / size)
        return residual, jacobian / size

    size = np.array([1e9, 1e-6, 1e3, 1e-3])
    start, free = np.array(CASES["decay"][1]), np.full(4, FREE)
    plain = levenberg_marquardt(lambda x, _: decay(x), start, -free, free)
    other = levenberg_marquardt(stretched, start * size, -free, free)
    np.testing.assert_allclose(other.x / size, plain.x, rtol=1e-8)
    assert other.iterations == plain.iterations


def test_a_linear_problem_takes_few_steps():
    matrix = np.random.default_rng(0).standard_normal((30, 4))
    data = matrix @ [1.0, -2.0, 3.0, 0.5] + 0.1
    solution = minimised(
        lambda x: (matrix @ x - data, matrix), np.zeros(4), [-FREE] * 4, [FREE] * 4
    )
    np.testing.assert_allclose(solution.x, np.linalg.lstsq(matrix, data)[0], rtol=1e-5)
    assert solution.converged and solution.iterations <= 8


def test_what_no_residual_depends_on_stays_where_it_is():
    def flat(x):
        residual, jacobian = rosenbrock(x[:2])
        return residual, np.column_stack([jacobian, np.zeros(2)])

    solution = minimised(flat, [-1.2, 1.0, 7.0], [-FREE] * 3, [FREE] * 3, most=300)
    assert solution.converged and solution.cost < 1e-8
    assert solution.x[2] == 7.0


def test_steps_into_infinity_are_taken_back():
    def walled(x):
        residual, jacobian = rosenbrock(x)
        return (residual if x[0] < 1.3 else np.full(2, np.nan)), jacobian

    solution = minimised(walled, [-1.2, 1.0], [-FREE] * 2, [FREE] * 2, most=300, tolerance=1e-12)
    np.testing.assert_allclose(solution.x, [1.0, 1.0], rtol=1e-4)


def test_a_start_that_is_not_finite_says_so():
    solution = minimised(
        lambda x: (np.full(2, np.inf), np.eye(2)), [1.0, 1.0], [0.0] * 2, [2.0] * 2
    )
    assert solution.cost == np.inf and not solution.converged


def test_too_few_steps_say_so():
    solution = minimised(rosenbrock, [-1.2, 1.0], [-FREE] * 2, [FREE] * 2, most=2)
    assert not solution.converged and solution.iterations == 2


def test_everything_at_a_bound_is_an_optimum():
    solution = minimised(lambda x: (x, np.eye(2)), [3.0, 3.0], [1.0, 1.0], [5.0, 5.0])
    np.testing.assert_array_equal(solution.x, [1.0, 1.0])
    assert solution.converged


@pytest.mark.parametrize("case", CASES)
def test_asking_for_derivatives_early_changes_only_the_number_of_calls(case):
    problem, start, lower, upper = CASES[case]
    asked = []

    def counted(x, derivatives):
        asked.append(derivatives)
        residual, jacobian = problem(x)
        return residual, jacobian if derivatives else np.zeros((0, len(x)))

    results, calls, steps = [], [], []
    for eager in (True, False):
        asked.clear()
        limits = np.array(lower), np.array(upper)
        results.append(levenberg_marquardt(counted, np.array(start), *limits, eager=eager))
        calls.append(len(asked))
        steps.append(sum(asked))
    np.testing.assert_array_equal(results[0].x, results[1].x)
    assert calls[0] < calls[1] and steps[0] >= steps[1]


@pytest.mark.parametrize("case", CASES)
def test_secants_end_at_the_same_optimum_with_fewer_derivatives(case):
    problem, start, lower, upper = CASES[case]
    limits, asked = (np.array(lower), np.array(upper)), []

    def counted(x, derivatives):
        asked.append(derivatives)
        return problem(x)

    optima, counts = [], []
    for secants in (False, True):
        asked.clear()
        optimum = levenberg_marquardt(
            counted, np.array(start), *limits, 200, eager=False, secants=secants
        )
        optima.append(optimum)
        counts.append(sum(asked))
        np.testing.assert_allclose(optimum.jacobian, problem(optimum.x)[1], atol=1e-4)
    assert optima[1].converged or optima[1].cost < 1e-25
    assert optima[1].cost <= optima[0].cost * (1 + 1e-6) + 1e-25
    assert counts[1] <= counts[0]


def test_a_search_along_a_flat_valley_ends():
    def banana(x, _):  # Rosenbrock's valley, under a misfit that nothing changes
        residual = np.array([100 * (x[1] - x[0] ** 2), 1 - x[0], 30.0])
        return residual, np.array([[-200 * x[0], 100.0], [-1.0, 0.0], [0.0, 0.0]])

    start, free = np.array([-1.2, 1.44]), np.full(2, 10.0)
    whole = levenberg_marquardt(banana, start, -free, free, 1000, 1e-13)
    early = levenberg_marquardt(banana, start, -free, free, 1000, 1e-13, valley=1e-4)
    assert whole.converged and whole.x == pytest.approx([1, 1], abs=1e-5)
    assert early.converged and early.iterations < 0.9 * whole.iterations
    assert early.cost < whole.cost * (1 + 1e-5)


def test_columns_that_overflow_or_diverge_do_not_spoil_the_others():
    columns = np.array([[3.0, 3e200, np.nan, np.inf, 0.0], [4.0, 4e200, 1e300, 1.0, 0.0]])
    scaled, length = unit_columns(columns)
    np.testing.assert_allclose(scaled[:, :2], [[0.6, 0.6], [0.8, 0.8]])
    np.testing.assert_array_equal(scaled[:, 2:], 0.0)
    np.testing.assert_allclose(length, [5.0, 5e200, 1.0, 1.0, 1.0])
