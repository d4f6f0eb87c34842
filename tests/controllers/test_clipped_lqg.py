"""The regulator on an observer's estimate."""

import numpy as np
import pytest

from controllers import controller
from controllers.force_tracking import MOTION
from controllers.observers import ExtendedKalmanFilter, GroundNoise, KalmanFilter, Noise
from isolation_sim.errors import InputError
from isolation_sim.laws import law
from isolation_sim.simulation.control import CoilDriver, Sensors
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import reference_building

from .conftest import both_forms, context_of

OBSERVERS = {"kalman": KalmanFilter, "extended": ExtendedKalmanFilter}


def seen_in(isolated, record, **options):
    """Measurements at each decision of a run, and the run."""
    one = controller("clipped_lqg", **options)
    run = simulate(isolated, record, one, driver=CoilDriver(lag=0.05))
    names = one.measures(isolated)
    return np.column_stack([*(run.output(name) for name in names), run.current]), run


@pytest.mark.parametrize("which", OBSERVERS)
def test_target_forces_are_the_regulators_on_the_estimate(isolated, record, which):
    seen, _ = seen_in(isolated, record, filter=which)
    seen = seen[: 25 if which == "extended" else 100]
    one = controller("clipped_lqg", filter=which)
    context = context_of(one, isolated)
    one.reset(context)
    observer = OBSERVERS[which](
        isolated, context.period, GroundNoise(0.1), Noise(0.02, 2e-4),
        limits=(context.low, context.high), jump=0.0,
    )  # fmt: skip
    estimate = observer.run(seen)
    gains = one.force_gains(isolated, np.array([1.5]))
    for k, row in enumerate(seen):
        one.current(k * context.period, row)
        first = len(one._step.memory) - len(observer.tracking.memory)
        z = np.concatenate([estimate.displacement[k], estimate.velocity[k]])
        expected = one._step.memory[first + MOTION + 2]
        assert expected == pytest.approx(float(gains[0] @ z), rel=1e-6, abs=1.0)


def test_both_forms_agree_with_the_extended_filter(isolated, record):
    seen, _ = seen_in(isolated, record)
    one = controller("clipped_lqg", filter="extended")
    plain, fast = both_forms(one, context_of(one, isolated), seen[60:80])
    assert np.abs(plain - fast).max() <= 1e-7 and np.ptp(fast) > 0.5


@pytest.mark.parametrize("which", OBSERVERS)
def test_commands_come_near_those_of_measured_states(isolated, record, which):
    """With good sensors the estimate is good enough to decide nearly the same."""
    sensors = Sensors(noise={"acceleration_m_s2": 0.01, "deformation_m": 1e-4})
    driver = CoilDriver(lag=0.05)
    one = controller("clipped_lqg", filter=which)
    shared = {k: getattr(one, k) for k in controller("clipped_lqr").settings}
    right = simulate(isolated, record, controller("clipped_lqr", **shared), driver=driver)
    run = simulate(isolated, record, one, driver=driver, sensors=sensors)
    a, b = (r.output("base_displacement_m") for r in (right, run))
    assert np.abs(a - b).max() <= 0.1 * np.abs(a).max()


def test_needs_a_coil(record):
    nominal = reference_building().on(law("linear", {"k": 1e7}))
    with pytest.raises(
        InputError, match="clipped_lqg: no element of the nominal model is driven by a"
    ):
        simulate(nominal, record, controller("clipped_lqg"))
