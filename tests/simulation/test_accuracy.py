"""Order of convergence, and that the tolerance is what it says."""

from dataclasses import replace

import numpy as np
import pytest

from ground_motions import Record
from isolation_sim.simulation.control import CoilDriver, Sensors
from isolation_sim.simulation.plan import Plan
from isolation_sim.simulation.result import Run
from isolation_sim.simulation.run import prepare_lane, simulate


def one_step_a_sample(isolated, record, controller):
    """A run in which every step is exactly one sample long."""
    lane = prepare_lane(isolated, record, controller, None, CoilDriver(), (0.0, 0.0), None)
    plan = Plan([lane], Sensors(), 0.0, alike=True)
    work = plan.workspace(1e-6, False, True)
    work.limits = work.limits._replace(iteration=1e-14, error=np.inf, defect=0.0)
    work.arguments = (work.position, work.sizes, work.limits, *work._grouped())
    work.integrate()
    run = Run(isolated, lane.records, "", plan.modes[0], plan.outputs[0], work)
    assert work.step_count[0] == len(record) - 1
    return run


@pytest.fixture(scope="module")
def exact_sine(by_scipy, stiffening, sine):
    """Displacements, velocities and states every 0.08 s."""
    q, v, s = by_scipy(stiffening, [sine(0.08)], lambda start, t: (1.5,), rtol=3e-14)
    return np.concatenate([q, v, s], axis=1)


def test_displacements_converge_at_fifth_order_or_more(
    stiffening, sine, held, exact_sine, motion, worst
):
    n = stiffening.structure.n_dofs
    errors = []
    for refined in (1, 2, 4):
        run = one_step_a_sample(stiffening, sine(0.08 / refined), held())
        errors.append(worst(motion(run)[::refined, :n], exact_sine[:, :n]))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert errors[-1] < 1e-8
    assert np.all(orders > 5), (errors, orders)


def test_error_follows_the_tolerance(stiffening, sine, held, exact_sine, motion, worst):
    tolerances = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
    errors = []
    for tolerance in tolerances:
        run = simulate(stiffening, sine(0.02), held(), tolerance=tolerance)
        states = run.states.reshape(len(run.time), -1)
        errors.append(worst(np.concatenate([motion(run), states], axis=1)[::4], exact_sine))
    assert np.all(np.array(errors) < 25 * np.array(tolerances)), errors
    assert errors[-1] < 1e-3 * errors[0]


def test_error_follows_the_tolerance_for_the_hybrid_law(
    shared_data, hybrid, el_centro, held, motion, worst
):
    data = np.load(shared_data / "engine_reference" / "hybrid_tanh_1.5A.npz")
    exact = np.concatenate([data["displacement_m"], data["velocity_m_s"]], axis=1)
    tolerances = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
    errors = [
        worst(motion(simulate(hybrid, el_centro, held(), tolerance=t)), exact) for t in tolerances
    ]
    assert np.all(np.array(errors) < 30 * np.array(tolerances)), errors
    assert errors[-1] < 1e-2 * errors[0]


def test_finely_sampled_record_takes_fewer_steps_than_samples(
    stiffening, el_centro, held, motion, worst
):
    fine = el_centro.resampled(0.005)
    run = simulate(stiffening, fine, held())
    same = simulate(stiffening, el_centro, held())
    assert run.steps < len(fine) - 1
    assert worst(motion(run)[::4], motion(same)) < 2e-6


def test_samples_inside_a_long_step_are_as_accurate_as_its_end(
    stiffening, sine, held, exact_sine, motion, worst
):
    long = simulate(stiffening, sine(0.0025), held(), tolerance=1e-5)
    exact = simulate(stiffening, sine(0.0025), held(), tolerance=1e-11)
    assert long.steps < 0.6 * len(long.time)
    assert worst(motion(exact)[::32], exact_sine[:, :12]) < 1e-9
    assert worst(motion(long), motion(exact)) < 2e-5
    assert worst(long.states, exact.states) < 2e-5


def test_small_motion_is_as_accurate_as_large_motion(
    stiffening, strong_motion, held, worst, motion
):
    """A thousandth of the ground motion, relative to its own peaks; the law is then linear."""
    small = simulate(stiffening, strong_motion.scaled(1e-3), held())
    exact = simulate(stiffening, strong_motion.scaled(1e-3), held(), tolerance=1e-11)
    assert worst(motion(small), motion(exact)) < 5e-6


@pytest.mark.parametrize("quiet", [0.02, 0.04, 1.0])
@pytest.mark.parametrize("plant", ["stiffening", "hybrid"])
def test_quiet_start_changes_nothing(plant, quiet, strong_motion, held, motion, worst, request):
    plant = request.getfixturevalue(plant)
    padded = simulate(plant, strong_motion.padded(before=quiet), held())
    late = motion(padded)[-len(strong_motion) :]
    assert worst(late, motion(simulate(plant, strong_motion, held()))) < 1e-5


def test_no_ground_motion_no_response(stiffening, strong_motion, held):
    run = simulate(stiffening, Record(np.zeros(50), strong_motion.dt), held())
    assert not run.values.any()


def test_a_state_that_relaxes_within_a_step_costs_hardly_more_steps(
    stiffening, strong_motion, held, worst, motion
):
    element = stiffening.elements[0]

    def runs(relaxation):
        """At two tolerances; the spring beside dashpot c0 relaxes in so many seconds."""
        spring = sum(element.device.parameters_at(1.5)[k] for k in (1, 3))
        device = element.device.with_parameters(c0=spring * relaxation)
        plant = replace(stiffening, elements=(replace(element, device=device),))
        return [simulate(plant, strong_motion, held(), tolerance=t) for t in (1e-6, 1e-10)]

    slow, _ = runs(0.02)
    fast, exact = runs(0.001)
    assert worst(motion(fast), motion(exact)) < 1e-6
    assert fast.steps < 1.5 * slow.steps
