"""Plants under the passive switching rule: energy, response, and what controllers are told."""

import numpy as np
import pytest

import isolation_sim as iso
from controllers import controller
from isolation_sim.errors import Diverged
from isolation_sim.simulation.control import CoilDriver
from isolation_sim.simulation.run import simulate


@pytest.fixture(scope="module")
def passive_plant():
    return iso.reference_building().on(iso.passive(iso.reference_isolators()))


@pytest.fixture(scope="module")
def histories():
    """Random currents, held for random times."""
    results = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        time = np.cumsum(rng.uniform(0.02, 0.3, 12 * (seed + 1)))
        time = np.append(0.0, time[time < 3.9])
        results.append((rng.uniform(0, 3, len(time)), time))
    return results


@pytest.mark.parametrize("driver", [CoilDriver(), CoilDriver(lag=0.05, slew=40.0, step=0.25)])
def test_no_current_history_adds_energy(
    driver, passive_plant, stiffening, strong_motion, scheduled, histories
):
    papers_gain = 0.0
    for current, time in histories:
        energy = simulate(
            passive_plant, strong_motion, scheduled(current, time), driver=driver
        ).energy
        size = np.abs(energy.input_J).max()
        assert energy.closure_error < 1e-5
        assert np.diff(energy.field_work_J).max() < 1e-5 * size
        assert np.diff(energy.device_dissipation_J).min() > -1e-5 * size
        assert energy.field_work_J[-1] < -1e-3 * size
        papers = simulate(stiffening, strong_motion, scheduled(current, time), driver=driver)
        papers_gain = max(papers_gain, np.diff(papers.energy.field_work_J).max() / size)
    assert papers_gain > 0.01  # the same histories do add energy under the papers' rule


def test_follows_scipy(passive_plant, strong_motion, scheduled, by_scipy, worst, motion):
    amperes, time = np.array([0.5, 3.0, 1.0, 2.5]), np.array([0.0, 1.7, 2.4, 3.1])
    run = simulate(passive_plant, strong_motion, scheduled(amperes, time))

    def current(start, t):
        return (amperes[np.searchsorted(time, start + 1e-9, side="right") - 1],)

    q, v, states = by_scipy(passive_plant, [strong_motion], current, time, rtol=1e-8)
    assert worst(motion(run), np.concatenate([q, v], axis=1)) < 1e-5
    assert worst(run.states[:, 0], states) < 1e-4


def test_held_current_is_the_papers_law(
    passive_plant, stiffening, strong_motion, held, motion, worst
):
    # both start at 0 A; the field is late by 5 ms, at rest
    passive = motion(simulate(passive_plant, strong_motion, held()))
    assert worst(passive, motion(simulate(stiffening, strong_motion, held()))) < 1e-4


def test_both_rules_under_el_centro(passive_plant, stiffening, el_centro):
    """Much of the benefit of switching at the extremes is energy that the field puts in or out."""
    papers = iso.compare(stiffening, el_centro, ["on_off"])
    passive = iso.compare(passive_plant, el_centro, ["on_off"])
    for comparison in (papers, passive):
        row = next(line for line in str(comparison).splitlines() if "field work" in line)
        work = comparison.energy["on_off"]["field_work_J"]
        assert f"{work / 1e3:#.4g}" in row
    gains = [np.diff(c.runs["on_off"].energy.field_work_J).max() for c in (papers, passive)]
    assert gains[0] > 1e4 and abs(gains[1]) < 1.0  # J in one sample


def test_switching_the_wrong_way_diverges_by_the_papers_rule_alone(
    passive_plant, stiffening, el_centro
):
    wrong = controller("on_off", on=0.0, off=3.0)
    with pytest.raises(Diverged, match="puts energy into the building"):
        simulate(stiffening, el_centro, wrong)
    run = simulate(passive_plant, el_centro, wrong)
    energy = run.energy
    stored = energy.kinetic_J + energy.strain_J + energy.device_stored_J
    assert np.all(stored <= energy.input_J + 1e-5 * energy.input_J.max())
    # bounded, though the springs creep: stiffened off centre, they come to rest there
    assert 0.2 < run.criteria["peak_base_displacement_m"] < 2.0


def test_controllers_predict_instantaneous_switching_by_default(
    passive_plant, stiffening, strong_motion, rule
):
    class Curious(rule):
        def reset(self, context):
            super().reset(context)
            self.nominal = context.nominal

    curious = Curious(lambda t, m: 1.5, 0.5)
    simulate(passive_plant, strong_motion, curious)
    nominal = curious.nominal.elements[0].device
    assert nominal.law is stiffening.elements[0].device.law
    assert nominal.current == stiffening.elements[0].device.current
    simulate(passive_plant, strong_motion, curious, nominal=passive_plant)
    assert curious.nominal is passive_plant
    simulate(stiffening, strong_motion, curious)
    assert curious.nominal is stiffening
    curious.predicts_switching = True
    simulate(passive_plant, strong_motion, curious)
    assert curious.nominal is passive_plant
