"""The text that a decision is compiled from."""

from collections.abc import Callable

import numpy as np
import pytest

from controllers import controller
from controllers.compiled import collect
from controllers.device_model import DeviceModel
from controllers.fuzzy import Fuzzy
from isolation_sim import reference_building
from isolation_sim.errors import InputError
from isolation_sim.laws import LAWS, law
from isolation_sim.simulation.batch import Case, simulate_many
from isolation_sim.simulation.control import CoilDriver

from .conftest import context_of


def twice(x: float, rule: Callable) -> float:
    return rule(rule(x))


def shifted(x: float, before: float, rule: Callable, after: float) -> float:
    return twice(x + before, rule) + after


def root(x: float, combined_force: Callable, state_rates: Callable) -> float:
    return shifted(x, 1.0, combined_force, 2.0) + state_rates(x)


def two_sided(x: float, combined_force: Callable, state_rates: Callable) -> float:
    return twice(x, combined_force) + twice(x, state_rates)


def test_functions_as_arguments_are_written_in_by_name():
    parts: dict[str, str] = {}
    collect(root, parts, ("combined_force", "state_rates"))
    assert list(parts) == ["twice", "shifted", "root"]
    assert "Callable" not in "".join(parts.values())
    names = {"plain": lambda f: f, "np": np, "combined_force": lambda x: 3 * x,
             "state_rates": lambda x: -x}  # fmt: skip
    exec("\n".join(["from __future__ import annotations", *parts.values()]), names)
    here = root(0.5, names["combined_force"], names["state_rates"])
    assert names["root"](0.5) == here == 9 * 1.5 + 2.0 - 0.5


def test_functions_as_arguments_are_called_through_their_addresses():
    parts: dict[str, str] = {}
    collect(root, parts, ("combined_force", "state_rates"), lambda function, passed: "")
    text = "\n".join(["from __future__ import annotations", *parts.values()])
    assert "return call_combined_force(rule, (call_combined_force(rule, (x,)),))" in text
    addresses = {7: lambda x: 3 * x, 8: lambda x: -x}

    def call(address, arguments):
        return addresses[address](*arguments)

    names = {"plain": lambda f: f, "call_combined_force": call, "call_state_rates": call}
    exec(text, names)
    assert names["root"](0.5, 7, 8) == root(0.5, addresses[7], addresses[8])


def test_a_decision_is_compiled_once_for_all_laws(isolated):
    other = reference_building().on(law("hybrid").scaled(length=10, force=3000))
    each = [(controller("clipped_lqr"), one) for one in (isolated, other)]
    compiled = [one.compiled(context_of(one, nominal)) for one, nominal in each]
    assert len({one.address for one in compiled}) == 1
    assert len({one.numbers for one in compiled}) == 2


def test_a_function_cannot_have_two_different_ones():
    with pytest.raises(InputError, match="twice cannot be compiled: it is given different"):
        collect(two_sided, {}, ("combined_force", "state_rates"))


class Counting(Fuzzy):
    """Counts how often it is designed."""

    designs = 0

    def decision(self, context):
        self.designs += 1
        return super().decision(context)


class Learning(Counting):
    """Learns from a trial before it is designed."""

    def prepare(self, context, trial):
        self.large_deformation = 0.1


def test_runs_that_differ_in_the_ground_motion_share_a_design(isolated, record):
    motions = [record.scaled(factor).cut(0.0, 2.0) for factor in np.linspace(0.2, 1.0, 9)]
    one, learning = Counting(fast=0.3), Learning()
    driver = CoilDriver(lag=0.05, high=3.0)

    def peaks(each, driver=driver):
        cases = [Case(isolated, motion, each) for motion in motions]
        return simulate_many(cases, driver=driver).criteria["peak_floor_acceleration_m_s2"]

    shared = peaks(one)
    assert one.designs == 1
    alone = [peaks(controller("fuzzy", fast=0.3))[k] for k in range(len(motions))]
    assert np.array_equal(shared, alone)
    # another setting, or another range of the current, is another design
    one.fast = 0.2
    assert not np.array_equal(peaks(one), shared) and one.designs == 2
    weak = peaks(one, CoilDriver(lag=0.05, high=1.0))
    expected = peaks(Counting(fast=0.2), CoilDriver(lag=0.05, high=1.0))
    assert one.designs == 3 and np.array_equal(weak, expected)
    peaks(learning)
    assert learning.designs >= len(motions)


@pytest.mark.parametrize("name", [name for name in LAWS if LAWS[name].sets])
def test_forces_and_rates_of_a_decision_are_those_of_the_device(name):
    """The text, in plain Python, against the law itself."""
    device, rng = law(name).scaled(length=10, force=3000), np.random.default_rng(7)
    model, size, n = DeviceModel([device]), 0.02, len(device.law.states)
    low, high = device.current_range
    for _ in range(5):
        x, v, current = *rng.uniform(-size, size, 2), rng.uniform(max(low, 0.0), min(high, 3.0))
        states, rates = 0.1 * rng.uniform(-size, size, n), np.zeros(n)
        one = np.ones(1)
        force = model.combined_force(current, (one, x * one, v * one, states, model.numbers))
        own = device.force(x, v, states.tolist(), current)
        assert force == pytest.approx(own, rel=1e-12, abs=1e-9)
        model.state_rates(0, x, v, states, current, model.numbers, rates)
        expected = device.rates(x, v, states.tolist(), current)
        np.testing.assert_allclose(rates, expected, rtol=1e-12, atol=1e-12)
