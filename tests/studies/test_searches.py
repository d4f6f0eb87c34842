"""The comparison of searches: equal budgets, equal knowledge, and what it says of the numbers."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pymoo")

from isolation_sim.laws import law
from studies import searches
from studies.search_convergence import LEAST_SQUARES, Convergence, run_search

BUDGET = 400


@pytest.fixture(scope="module")
def problem():
    return searches.synthetic_loops()


@pytest.fixture(scope="module")
def comparison(problem):
    return searches.compare_methods(problem, BUDGET, 3)


def test_the_box_holds_what_is_looked_for(problem):
    truth = np.array(law("strain_stiffening").parameters_at(1.0)) * (1.3, 0.8, 0.7, 1.2, 1.4)
    low, high = (problem.values(np.array(edge)) for edge in zip(*problem.bounds(), strict=True))
    assert np.all((low < truth) & (truth < high))
    # only the noise is left there
    assert problem.cost(truth) == pytest.approx(0.02, rel=0.05)


def test_the_derivatives_are_those_of_the_residuals(problem):
    place = np.array([0.3, -0.2, -0.5, 0.1, -1.5])
    values = problem.values(place)
    derivatives = problem.residuals(values, True)[1]
    for k, value in enumerate(values):
        step = 1e-5 * value * np.eye(len(values))[k]
        ahead, behind = (problem.residuals(values + s, False)[0] for s in (step, -step))
        slope = (ahead - behind) / (2e-5 * value)
        np.testing.assert_allclose(derivatives[:, k], slope, atol=1e-5 * np.abs(slope).max())


def test_a_course_is_read_by_evaluations_and_by_time():
    convergence = Convergence(
        np.array([1.0, 5.0, 9.0]), np.array([0.1, 0.2, 0.4]), np.array([3.0, 2.0, 1.0]), 0.5
    )
    assert convergence.best() == 1.0
    assert convergence.best(spent=8) == 2.0
    assert convergence.best(seconds=0.15) == 3.0
    assert convergence.best(spent=0) == np.inf
    assert convergence.arrival(2.5) == (5.0, 0.2)
    assert convergence.arrival(0.5) == (np.inf, np.inf)


@pytest.mark.parametrize("method", [LEAST_SQUARES, "fruit_fly", "cma_es"])
def test_no_search_spends_more_than_its_budget(problem, method):
    one, two = (run_search(problem, method, BUDGET, 1) for _ in range(2))
    assert one.evaluations.max() <= BUDGET
    assert np.all(np.diff(one.costs) < 0) and np.all(np.diff(one.evaluations) > 0)
    np.testing.assert_array_equal(one.costs, two.costs)


def test_derivatives_are_paid_for(problem):
    # the first evaluation of least squares is one with derivatives by five parameters
    convergence = run_search(problem, LEAST_SQUARES, BUDGET, 1)
    assert convergence.evaluations[0] % 6 == 0
    assert run_search(problem, "fruit_fly", BUDGET, 1).evaluations[0] < 6


@pytest.mark.slow
def test_every_method_is_compared(comparison, problem):
    assert set(comparison.searches) == set(searches.TITLES)
    rows = {row["method"]: row for row in comparison.records()}
    ours = rows.pop("least squares")
    # one of three may still be on its way from a far start
    assert ours["success"] >= 2 / 3 and ours["evaluations"] < BUDGET
    assert ours["excess_median"] < 1e-6
    # so few evaluations are not enough for a search without derivatives
    assert all(row["excess_median"] > searches.NEAR for row in rows.values())
    assert comparison.best_known == pytest.approx(0.02, rel=0.05)


def test_the_finding_follows_from_the_numbers(comparison):
    said = searches.finding(comparison)
    ours, *others = comparison.records()
    assert f"after {ours['evaluations']:.0f} evaluations" in said
    least = min(others, key=lambda row: (-row["success"], row["excess_median"]))
    assert f"{1 + least['excess_median']:.3g} times the best known cost" in said
    assert "nan" not in said and "inf" not in said


def test_the_figure_has_a_line_a_method(comparison):
    (axes,) = searches.figure([comparison]).axes
    lines = [line for line in axes.lines if line.get_label() in searches.TITLES.values()]
    assert len(lines) == len(searches.TITLES)
    ours = next(line for line in lines if line.get_label() == "least squares")
    assert ours.get_ydata()[-1] == min(line.get_ydata()[-1] for line in lines)


@pytest.mark.slow
def test_without_the_damper_the_study_says_so(monkeypatch, tmp_path):
    monkeypatch.setenv("ISOLATION_SIM_DATA", str(tmp_path / "absent"))
    monkeypatch.setattr(searches, "SHORT_BUDGET", BUDGET)
    monkeypatch.setattr(searches, "SHORT_SEEDS", 1)
    shares = []
    outcome = searches.outcome(tmp_path, True, lambda what, share=0.0: shares.append(share))
    assert outcome.finding.startswith("Without the measured damper: ")
    assert {row["problem"] for row in outcome.table} == {"strain stiffening, synthetic"}
    assert sum(shares) == pytest.approx(1.0)


@pytest.mark.slow
def test_the_measured_damper_is_one_current_of_the_campaign(shared_data):
    problem = searches.measured_damper(shared_data / "mr_damper")
    assert np.unique(problem.simulator.motion.current).tolist() == [1.0]
    assert problem.parameterisation.fixed == {"A": 200.0, "n": 2.0}
    # one start in four ends in a poorer minimum
    peaks = [run_search(problem, LEAST_SQUARES, 1500, seed).best() for seed in range(3)]
    assert np.median(peaks) < 0.13
