"""Against trajectories of SciPy's DOP853 at a relative tolerance of 1e-11."""

import numpy as np
import pytest

from isolation_sim.simulation.run import simulate

LIMITS = {"constant_1.5A": 1e-6, "switching_0.1s": 1e-6, "random_0.02s": 1e-5}


def schedule_of(scheduled, amperes):
    """Commands where the reference's current changes."""
    changes = np.flatnonzero(np.diff(amperes, prepend=np.nan) != 0)
    return scheduled(amperes[changes], changes * 0.02)


@pytest.mark.parametrize("name", LIMITS)
def test_all_states_follow_the_reference(
    name, shared_data, stiffening, el_centro, scheduled, worst, motion
):
    reference = np.load(shared_data / "engine_reference" / f"strain_stiffening_{name}.npz")
    run = simulate(stiffening, el_centro, schedule_of(scheduled, reference["current_A"]))
    exact = np.concatenate([reference["displacement_m"], reference["velocity_m_s"]], axis=1)
    assert worst(motion(run), exact) < LIMITS[name]
    assert worst(run.states[:, 0, 0], reference["y_m"]) < LIMITS[name]
    assert worst(run.states[:, 0, 1], reference["z_m"]) < LIMITS[name]


def test_smoothed_hybrid_law_follows_the_reference(
    shared_data, hybrid, el_centro, held, worst, motion
):
    reference = np.load(shared_data / "engine_reference" / "hybrid_tanh_1.5A.npz")
    run = simulate(hybrid, el_centro, held())
    exact = np.concatenate([reference["displacement_m"], reference["velocity_m_s"]], axis=1)
    assert worst(motion(run), exact) < 1e-5


def test_reference_building_is_the_one_that_the_trajectories_were_computed_for(
    shared_data, stiffening
):
    data = np.load(shared_data / "engine_reference" / "building.npz")
    structure, device = stiffening.structure, stiffening.elements[0].device
    np.testing.assert_allclose(structure.mass, data["M"], rtol=1e-12)
    np.testing.assert_allclose(structure.stiffness, data["K"], rtol=1e-12)
    np.testing.assert_allclose(structure.damping, data["C"], rtol=1e-9, atol=1e-6)
    assert device.length == data["length_scale"]
    assert device.force_scale == pytest.approx(float(data["force_scale"]), rel=1e-12)
