"""The search for the best constant current."""

import numpy as np
import pytest

from controllers import controller
from controllers.best_constant import CRITERIA
from isolation_sim.errors import InputError
from isolation_sim.simulation.control import CoilDriver
from isolation_sim.simulation.run import simulate

from .conftest import context_of


@pytest.mark.parametrize("criterion", CRITERIA)
def test_no_other_constant_is_better(isolated, record, criterion):
    best = controller("best_constant", criterion=criterion)
    run = simulate(isolated, record, best)
    off = simulate(isolated, record, controller("passive_off"))
    score = CRITERIA[criterion]
    assert score(run, off) == pytest.approx(best.score, rel=1e-12)
    assert np.all(run.current == best.optimum)
    assert best.report.startswith(f"{best.optimum:.3g} A")
    for amperes in np.linspace(0, 3, 40):
        other = simulate(isolated, record, controller("constant", amperes=amperes))
        assert score(other, off) >= best.score * (1 - 1e-6)


def test_finds_a_minimum_that_a_local_search_would_miss(isolated, monkeypatch):
    best = controller("best_constant", criterion="peak_base_displacement_m")
    context = context_of(best, isolated)

    def trial(one):
        """Stands for a run: the current is all that the criterion below looks at."""
        return one.held(context)

    def two_valleys(i, off):
        return (i - 0.6) ** 2 - 6.0 * np.exp(-(((i - 2.53) / 0.2) ** 2))

    monkeypatch.setitem(CRITERIA, "peak_base_displacement_m", two_valleys)
    best.prepare(context, trial)
    grid = np.linspace(0, 3, 30001)
    assert best.optimum == pytest.approx(grid[np.argmin(two_valleys(grid, None))], abs=2e-3)


def test_stays_within_the_limits(isolated, record):
    best = controller("best_constant", criterion="peak_base_displacement_m")
    simulate(isolated, record, best, driver=CoilDriver(high=2.0))
    assert 0 <= best.optimum <= 2.0


def test_a_supply_of_one_current_leaves_no_choice(isolated, record):
    best = controller("best_constant")
    simulate(isolated, record.cut(0.0, 1.0), best, driver=CoilDriver(low=1.0, high=1.0))
    assert best.optimum == 1.0


def test_refusals(isolated):
    best = controller("best_constant")
    with pytest.raises(InputError, match="has not searched yet"):
        best.reset(context_of(best, isolated))
    with pytest.raises(InputError, match="criterion: given 'peak'; expected: 'weighted_peak' or"):
        controller("best_constant", criterion="peak")
    narrow = controller("best_constant", lowest=2, highest=1)
    with pytest.raises(InputError, match="currents from 2 to 1 A"):
        narrow.prepare(context_of(narrow, isolated), None)


def test_a_motion_of_zeros_is_refused(isolated, record):
    with pytest.raises(InputError, match="nothing moves without current"):
        simulate(isolated, record.cut(0.0, 1.0).scaled(0.0), controller("best_constant"))
