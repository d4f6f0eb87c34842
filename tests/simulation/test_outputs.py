"""Outputs agree with each other and with the equations of motion."""

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.simulation.run import simulate


@pytest.fixture(scope="module")
def run(stiffening, sine, held):
    """A finely sampled run."""
    return simulate(stiffening, sine(0.0025), held(), tolerance=1e-10)


def derivative(values, dt):
    """Fourth order, for the third sample to the third from last."""
    return (values[:-4] - 8 * values[1:-3] + 8 * values[3:-1] - values[4:]) / (12 * dt)


def test_velocity_and_acceleration_are_derivatives(run):
    """Away from the ground's corners, every 0.08 s."""
    h, dt = run.history, run.time[1]
    away = np.abs((np.arange(len(run.time)) + 16) % 32 - 16)[2:-2] > 2
    velocity, absolute = h.velocity.values, h.acceleration.values
    result = derivative(h.displacement.values, dt)[away]
    assert np.abs(result - velocity[2:-2][away]).max() < 1e-6 * np.abs(velocity).max()
    result = (derivative(velocity, dt) + h.ground_acceleration.values[2:-2])[away]
    assert np.abs(result - absolute[2:-2][away]).max() < 1e-5 * np.abs(absolute).max()


def test_all_inertia_is_carried_by_the_isolators(run):
    """The base shear, from absolute accelerations, equals the isolators' force at any time."""
    rows = run.isolated.structure.base_shear_rows(above_base=False)
    shear = -(run.history.acceleration.values @ rows.T)[:, 0]
    force = run.output("isolator_force_N")
    assert np.abs(shear - force).max() < 1e-9 * np.abs(force).max()


def test_force_is_the_law_of_the_deformation(run):
    device = run.isolated.elements[0].device
    x, v = run.output("isolator_deformation_m"), run.output("isolator_velocity_m_s")
    expected = device.force(x, v, tuple(run.states[:, 0].T), 1.5)
    np.testing.assert_allclose(run.output("isolator_force_N"), expected, rtol=1e-9, atol=1e-3)


def test_drifts_and_deformations_are_differences(run):
    q = run.history.displacement.values
    np.testing.assert_allclose(run.history.drift, np.diff(q, axis=1), atol=1e-12)
    np.testing.assert_allclose(run.output("isolator_deformation_m"), q[:, 0], atol=1e-12)


def test_ground_and_time_are_the_record_s(run):
    record = run.records[0]
    np.testing.assert_allclose(run.output("ground_acceleration_m_s2"), record.acceleration)
    np.testing.assert_array_equal(run.history.time, record.time)


def test_history_names_what_it_holds(run):
    history = run.history
    assert list(history.dof.values) == ["base", *(f"floor{k}" for k in range(1, 6))]
    assert list(history.element.values) == ["isolator"]
    assert {"isolator_y", "isolator_z", "current", "command"} <= set(history)
    for name, variable in history.data_vars.items():
        assert variable.dims[0] == "time" and variable.attrs["units"], name
        assert np.all(np.isfinite(variable)), name
    for k, name in enumerate(run.outputs.names):
        np.testing.assert_array_equal(run.output(name), run.values[:, k])


def test_unknown_output_names_the_nearest(run):
    with pytest.raises(InputError, match="did you mean 'floor5_displacement_m'"):
        run.output("floor5_displacment_m")


def test_runs_do_not_share_their_arrays(stiffening, strong_motion, held):
    first = simulate(stiffening, strong_motion, held())
    values = first.values.copy()
    simulate(stiffening, strong_motion.scaled(0.5), held(3.0))
    again = simulate(stiffening, strong_motion, held())
    np.testing.assert_array_equal(first.values, values)
    np.testing.assert_array_equal(again.values, values)
