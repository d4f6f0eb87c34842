"""Runs that cannot be finished say when and why, in one error."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from isolation_sim.errors import AccuracyWarning, Diverged, InputError
from isolation_sim.laws.law import Law, Quantity
from isolation_sim.simulation.run import simulate


@pytest.fixture
def unbounded(stiffening):
    """The isolators with any numbers: the law without its bounds."""

    def build(**numbers):
        element = stiffening.elements[0]
        law = element.device.law
        free = replace(law, parameters=tuple(replace(q, lower=-np.inf) for q in law.parameters))
        device = replace(element.device, law=free).with_parameters(**numbers)
        return replace(stiffening, elements=(replace(element, device=device),))

    return build


BLOW_UPS = {
    "stiffening that pushes": {"alpha": -3e9},
    "spring that pushes": {"k1": -8e5, "k0": 1e5},
    "dashpot that drives": {"c0": -2e4},
}


@pytest.mark.parametrize("numbers", BLOW_UPS.values(), ids=BLOW_UPS)
def test_a_law_that_blows_up_is_diverged_with_time_and_cause(numbers, unbounded, el_centro, held):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(Diverged, match=r"diverged at t = [\d.]+ s: .*(law|number|tested)"):
            simulate(unbounded(**numbers), el_centro, held())


def test_a_strong_motion_ends_at_fifty_times_what_was_tested(stiffening, el_centro, held):
    text = r"deform 50 times further than they were tested; the ground motion peaks at .* its unit"
    with pytest.raises(Diverged, match=text):
        simulate(stiffening, el_centro.scaled(1e3), held())


def test_time_of_divergence_is_when_the_limit_was_passed(stiffening, el_centro, held):
    """The same plant with a larger limit runs on and shows when that was."""
    with pytest.raises(Diverged) as caught:
        simulate(stiffening, el_centro.scaled(100.0), held())
    t = float(str(caught.value).split("t = ")[1].split(" s")[0])
    element = stiffening.elements[0]
    tougher = replace(element, device=replace(element.device, tested_deformation=1.0))
    run = simulate(replace(stiffening, elements=(tougher,)), el_centro.scaled(100.0), held())
    passed = run.time[np.argmax(np.abs(run.output("isolator_deformation_m")) > 4.0)]
    assert abs(t - passed) <= 0.081  # to a segment of four samples


@pytest.mark.parametrize("amperes", [np.nan, np.inf, -np.inf])
def test_a_held_command_that_is_no_number_is_refused(amperes, stiffening, strong_motion, held):
    with pytest.raises(InputError, match=f"current {amperes:g} A at t = 0 s"):
        simulate(stiffening, strong_motion, held(amperes))


def test_a_failed_run_leaves_nothing_behind(stiffening, unbounded, strong_motion, held):
    before = simulate(stiffening, strong_motion, held()).values
    with pytest.raises(Diverged):
        simulate(unbounded(alpha=-3e9), strong_motion.scaled(3.0), held())
    with pytest.raises(Diverged):
        simulate(stiffening, strong_motion.scaled(1e3), held())
    np.testing.assert_array_equal(simulate(stiffening, strong_motion, held()).values, before)


@pytest.mark.parametrize(
    ("options", "part"),
    [({"tolerance": 0.0}, "tolerance"), ({"tolerance": np.nan}, "tolerance"),
     ({"current_outside": "clip"}, "current_outside: given 'clip'"),
     ({"computation_delay": -0.01}, "computation_delay")],
)  # fmt: skip
def test_options_that_cannot_be_are_refused(options, part, stiffening, strong_motion, held):
    with pytest.raises(InputError, match=part):
        simulate(stiffening, strong_motion, held(), **options)


def test_ground_motions_must_fit_the_structure(stiffening, strong_motion, held):
    with pytest.raises(InputError, match=r"takes 1 ground motions \(x\); 2 given"):
        simulate(stiffening, [strong_motion, strong_motion], held())


def test_a_structure_without_elements_is_refused_in_words(stiffening, strong_motion, no_coil):
    with pytest.raises(InputError, match="element"):
        simulate(replace(stiffening, elements=()), strong_motion, no_coil)


def test_a_force_that_jumps_ends_in_bounded_work_and_says_what_was_attained(
    stiffening, strong_motion, no_coil, constant_device
):
    """Where the jump is passed, no step is short enough: the smallest is taken as it is."""
    names = [Quantity(name, "", "") for name in ("k", "jump")]
    law = Law("step", "Step", tuple(names), lambda x, v, s, p: p[0] * x + p[1] * (x > 0.01))
    plant = stiffening.structure.on(constant_device(law, k=1.5e7, jump=1e5))
    for tolerance in (1e-6, 1e-10):
        with pytest.warns(AccuracyWarning, match=f"missed the tolerance {tolerance:.3g}"):
            run = simulate(plant, strong_motion, no_coil, tolerance=tolerance)
        assert run.unresolved > 0
        assert tolerance < run.accuracy < 1e-4
        assert run.steps < 50 * len(run.time)
        assert run.energy.closure_error < 1e-6
