"""Effects on the current in either order: a lag before a gap that was found earlier, or behind."""

import numpy as np
import pytest

from isolation_sim.discrepancy.device.acting_order import act_first, either_order
from isolation_sim.discrepancy.device.carried_history import of_device_in_order
from isolation_sim.discrepancy.device.model import Model
from isolation_sim.effects import effect
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.law_fit import parameterise
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.laws import LAWS
from isolation_sim.laws import law as published

LAG, GAP, STOP = effect("current_lag"), effect("field_gap_coupling"), effect("end_stop")


def test_an_effect_that_acts_first_is_as_if_it_had_been_found_first():
    t = np.arange(0.0, 2.0, 0.01)
    x, current = 5e-3 * np.sin(6 * t), 1.0 + (t > 1.0)
    run = TestRun("a", t, x, np.gradient(x, 0.01), 3e4 * current * x, current)
    campaign = Campaign("coil", "made", (run,))
    data = measured_runs(campaign.runs)
    law = Model(data, parameterise(campaign, LAWS["linear"], data, 1))

    stiffness = law.parameterisation.of(published("linear", {"k": (1e4, 2e4)}))

    def force(**numbers):
        order, values = zip(*numbers.values(), strict=True)
        own = np.concatenate([stiffness, values])
        return law.with_effects(*order).forces(own, False)[0]

    lag, gap = (LAG, 0.05), (GAP, 100.0)
    right = force(lag=lag, gap=gap)
    assert force(gap=gap, lag=(act_first(LAG), 0.05)) == pytest.approx(right)
    assert np.abs(force(gap=gap, lag=lag) - right).max() > 0.01 * np.abs(right).max()


def test_either_order_is_tried_beside_effects_on_the_current_alone():
    first = act_first(LAG)
    assert either_order([LAG, STOP], [STOP]) == [LAG, STOP]
    assert either_order([LAG, STOP], [GAP]) == [LAG, STOP, first]
    assert first.form == f"{LAG.form}, first"
    # the law that is written has the effects of the catalogue, in the order in which they act
    applied = of_device_in_order([GAP, first], [{"loss": 1.0}, {"lag": 0.1}])
    assert applied == [(LAG, {"lag": 0.1}), (GAP, {"loss": 1.0})]
