"""The energy ledger: that it closes, and each term against an independent account."""

import numpy as np
import pytest
from scipy.integrate import simpson

from ground_motions import Record
from isolation_sim.laws import CurrentDependence, Device
from isolation_sim.laws.kelvin_voigt import LAW as KELVIN_VOIGT
from isolation_sim.simulation.control import CoilDriver, Sensors
from isolation_sim.simulation.run import simulate


def on_off(t, m):
    return 3.0 if m.base_displacement_m * m.base_velocity_m_s > 0 else 0.0


CASES = {
    "switching": {},
    "lag": {"driver": CoilDriver(lag=0.05)},
    "slew": {"driver": CoilDriver(slew=20.0)},
    "lag and slew": {"driver": CoilDriver(lag=0.03, slew=30.0)},
    "delayed": {
        "sensors": Sensors(delay=0.013, noise={"displacement_m": 1e-4}),
        "computation_delay": 0.007,
    },
}


@pytest.mark.parametrize("plant", ["stiffening", "hybrid", "viscous"])
def test_closes_under_a_held_current(plant, request, el_centro, held, no_coil):
    plant = request.getfixturevalue(plant)
    energy = simulate(plant, el_centro, held() if plant.n_channels else no_coil).energy
    assert energy.closure_error < 1e-6
    assert not energy.field_work_J.any()
    assert energy.device_dissipation_J[-1] > 0.5 * energy.input_J[-1] > 0


@pytest.mark.parametrize("case", [*CASES, "slew that ends between samples"])
@pytest.mark.parametrize("plant", ["stiffening", "hybrid"])
def test_closes_while_the_current_changes(plant, case, request, strong_motion, rule):
    run = simulate(
        request.getfixturevalue(plant), strong_motion, rule(on_off, 0.1),
        **CASES.get(case, {"driver": CoilDriver(slew=61.0)}),
    )  # fmt: skip
    assert run.energy.closure_error < 1e-6
    assert np.abs(run.energy.field_work_J).max() > 1e-3 * run.energy.input_J.max()


def test_balance_is_that_of_the_terms(stiffening, strong_motion, rule):
    """The reported closure is what a reader works out from the terms."""
    e = simulate(stiffening, strong_motion, rule(on_off, 0.1)).energy
    stored = e.kinetic_J + e.strain_J + e.device_stored_J
    lost = e.structural_damping_J + e.device_dissipation_J
    mismatch = np.abs(e.input_J + e.field_work_J - stored - lost).max()
    assert mismatch <= e.closure_error * np.abs(e.input_J).max() * (1 + 1e-6)


@pytest.fixture(scope="module")
def fine(stiffening, strong_motion, held):
    """A run with samples close enough for quadrature, kinks at samples."""
    return simulate(stiffening, strong_motion.resampled(0.0025), held(), tolerance=1e-9)


def running_integral(run, power):
    """Simpson's rule to every eighth sample (0.02 s), where the ground has its kinks."""
    pieces = np.stack([power[k : len(power) - 8 + k : 8] for k in range(9)])
    return np.append(0.0, np.cumsum(simpson(pieces, dx=run.time[1], axis=0)))


def test_input_is_the_integral_over_ground_motion(fine, stiffening, strong_motion, held):
    structure = stiffening.structure
    v, a = fine.history.velocity.values, fine.history.ground_acceleration.values[:, 0]
    exact = running_integral(fine, -a * (v @ structure.mass @ structure.influence[:, 0]))
    expected = simulate(stiffening, strong_motion, held()).energy.input_J
    assert np.abs(expected - exact).max() < 1e-5 * np.abs(exact).max()


def test_damping_and_device_losses_are_integrals_of_power(fine, stiffening, strong_motion, held):
    energy = simulate(stiffening, strong_motion, held()).energy
    v = fine.history.velocity.values
    damped = running_integral(fine, np.einsum("ti,ij,tj->t", v, stiffening.structure.damping, v))
    assert np.abs(energy.structural_damping_J - damped).max() < 1e-4 * damped[-1]
    work = running_integral(
        fine, fine.output("isolator_force_N") * fine.output("isolator_velocity_m_s")
    )
    device = energy.device_dissipation_J + energy.device_stored_J
    assert np.abs(device - work).max() < 1e-5 * np.abs(work).max()


def test_stored_energy_is_that_of_the_state(stiffening, strong_motion, held):
    run = simulate(stiffening, strong_motion, held(2.0))
    device = stiffening.elements[0].device
    stored = device.stored_energy(
        run.output("isolator_deformation_m"), tuple(run.states[:, 0].T), 2.0
    )
    np.testing.assert_allclose(run.energy.device_stored_J, stored, rtol=1e-9, atol=1e-6)


def test_raising_the_current_of_a_stretched_device_is_work(stiffening, strong_motion, scheduled):
    """And its amount is the jump of the stored energy at the same deformation and states."""
    run = simulate(stiffening, strong_motion, scheduled([0.5, 3.0, 1.0], [0.0, 2.2, 3.0]))
    device, field = stiffening.elements[0].device, run.energy.field_work_J
    expected = np.zeros(len(run.time))
    for t, before, after in ((2.2, 0.5, 3.0), (3.0, 3.0, 1.0)):
        k = round(t / 0.02)
        x, s = run.output("isolator_deformation_m")[k], tuple(run.states[k, 0])
        expected[k:] += device.stored_energy(x, s, after) - device.stored_energy(x, s, before)
    np.testing.assert_allclose(field, expected, rtol=1e-9, atol=1e-6 * np.abs(expected).max())
    assert field[109] == 0 < field[110] and field[150] < field[149]


def spring(scheduled_stiffness):
    """Spring whose stiffness is a polynomial of the current."""
    table = CurrentDependence.polynomial({"k": scheduled_stiffness, "c": 0.0}, ("k", "c"))
    return Device(KELVIN_VOIGT, table, (0.0, 5.0))


def test_field_work_along_a_moving_current_is_its_integral(viscous, strong_motion, scheduled):
    """For a spring, half x squared times the rate of the stiffness."""
    isolated = viscous.structure.on(spring((5e6, 4e6)))
    driver = CoilDriver(lag=0.4)
    fine = simulate(isolated, strong_motion.resampled(0.0025), scheduled([3.0]), driver=driver,
                    tolerance=1e-9)  # fmt: skip
    rate = 4e6 * (3.0 - fine.current[:, 0]) / 0.4
    exact = running_integral(fine, 0.5 * fine.output("isolator_deformation_m") ** 2 * rate)
    expected = simulate(isolated, strong_motion, scheduled([3.0]), driver=driver).energy
    assert np.abs(expected.field_work_J - exact).max() < 1e-5 * exact[-1]
    assert expected.device_dissipation_J[-1] < 1e-6 * expected.input_J.max()


def test_free_vibration_after_a_pulse_keeps_or_loses_its_energy(viscous, no_coil):
    """Undamped, the total stays; with the dashpot alone, what is lost is the device's."""
    pulse = Record(np.concatenate([np.sin(np.linspace(0, np.pi, 26)), np.zeros(375)]), 0.02)
    structure = viscous.structure
    undamped = type(structure)(
        **{
            **{f: getattr(structure, f) for f in structure.__dataclass_fields__},
            "damping": np.zeros_like(structure.damping),
        }
    )
    energy = simulate(undamped.on(spring((1.5e7,))), pulse, no_coil).energy
    total = energy.kinetic_J + energy.strain_J + energy.device_stored_J
    np.testing.assert_allclose(total[26:], total[26], rtol=1e-9)
    np.testing.assert_allclose(energy.input_J[26:], total[26], rtol=1e-9)
    lossy = simulate(viscous, pulse, no_coil).energy
    assert np.all(np.diff(lossy.device_dissipation_J) >= 0)
    assert np.all(np.diff(lossy.structural_damping_J) >= 0)
    assert np.ptp(lossy.input_J[26:]) < 1e-9 * lossy.input_J.max()
