"""Devices of two directions: interaction circle, energy, cost, and against OpenSees."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import isolation_sim as iso
from controllers.passive_off import PassiveOff
from ground_motions import STANDARD_GRAVITY, Record, el_centro_1940
from isolation_sim.errors import InputError
from isolation_sim.laws import law
from isolation_sim.simulation.batch import Case, simulate_many
from isolation_sim.simulation.one_step import StepState, step
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import (
    from_matrices,
    load_change_rows,
    overturning_rows,
    plan_building,
    with_vertical_motion,
)
from studies.benchmarks.peers import load_opensees

MASS, GRAVITY = 3e5, 9.81
STRENGTH, YIELD = 0.05 * MASS * GRAVITY, 0.01
STIFFNESS = MASS * (2 * np.pi / 2.5) ** 2
BOUC_WEN = {
    "k": STIFFNESS, "c": 0.0, "alpha": STRENGTH / YIELD, "A": 1.0, "beta": 0.5 / YIELD**2,
    "gamma": 0.5 / YIELD**2, "n": 2.0, "F0": 0.0,
}  # fmt: skip
PENDULUM = {
    "W": MASS * GRAVITY, "R": 1.5, "mu_max": 0.08, "mu_min": 0.04, "a": 50.0, "u_y": 0.002,
    "n": 1000.0,
    "tau": 2e-5,
}  # fmt: skip


def slab(device):
    """A rigid slab that moves in two directions, on one biaxial device."""
    zero = np.zeros((2, 2))
    structure = from_matrices(
        MASS * np.eye(2), zero, zero, influence=np.eye(2), base=(0, 1), names=["x", "y"]
    )
    return structure.on(device, biaxial=True)


@pytest.fixture(scope="module")
def pair():
    """Two records of the same length, of different content."""
    record = el_centro_1940().cut(0.0, 12.0)
    return record, dataclasses.replace(record, acceleration=0.7 * np.roll(record.acceleration, 37))


@pytest.fixture(scope="module")
def bouc_wen():
    return slab(law("bouc_wen", BOUC_WEN))


def test_steady_circular_motion(bouc_wen):
    """|z| is the yield deformation; radius and lag follow from the equations in the complex plane.

    With z at the angle phi behind the velocity, sin phi = yield deformation / radius, and the
    motion R exp(i w t) balances: (k - m w^2 + i w c) R + i Q exp(-i phi) = -m a.
    """
    omega, amplitude, damping = 2 * np.pi * 0.8, 4.0, 1.5e5
    t = np.arange(0.0, 60.0, 0.005)
    ramp = np.minimum(t / 10, 1.0)
    records = tuple(
        Record(amplitude * ramp * wave(omega * t), 0.005, name)
        for wave, name in ((np.cos, "cos"), (np.sin, "sin"))
    )
    plant = slab(law("bouc_wen", BOUC_WEN | {"c": damping}))
    run = iso.simulate(plant, records, "passive_off", tolerance=1e-10)
    last = run.history.isel(time=slice(-400, None))
    z = last.isolator_z_x.values + 1j * last.isolator_z_y.values
    assert np.abs(np.abs(z) / YIELD - 1).max() < 1e-9
    motion = last.displacement.values @ [1, 1j]
    radius = np.abs(motion)
    dynamic = STIFFNESS - MASS * omega**2 + 1j * omega * damping
    phi = np.arcsin(YIELD / radius)
    needed = np.abs(dynamic * radius + 1j * STRENGTH * np.exp(-1j * phi))
    # the ground is a polygon: its first harmonic is smaller by this factor
    polygon = np.sinc(omega * 0.005 / (2 * np.pi)) ** 2
    np.testing.assert_allclose(needed, MASS * amplitude * polygon, rtol=2e-5)
    lag = np.angle(1j * motion / z)
    np.testing.assert_allclose(np.sin(lag), YIELD / radius, rtol=1e-4)


def test_energy_closes_and_motion_along_a_line_stays_there(bouc_wen, pair):
    run = iso.simulate(bouc_wen, pair, "passive_off")
    assert run.energy.closure_error < 1e-6
    assert run.energy.device_dissipation_J[-1] > 0.5 * run.energy.input_J[-1] > 0
    alone = (pair[0], dataclasses.replace(pair[1], acceleration=0 * pair[1].acceleration))
    along = iso.simulate(bouc_wen, alone, "passive_off").history
    assert not along.displacement.sel(dof="y").values.any()


def test_compiled_steps_are_the_readable_ones(bouc_wen, pair):
    records = tuple(record.cut(0.0, 2.5).resampled(0.004) for record in pair)
    run = simulate(bouc_wen, records, PassiveOff(), tolerance=1e-9)
    x, cuts = run.values[:, :4], run.work.cuts[run.grid.samples, 0]
    modes, states = run.modes, run.states[:, 0]
    ground = np.stack([record.acceleration for record in records], axis=1)
    compared = 0
    for k in np.flatnonzero(cuts[:-1] == -1)[::3]:
        state = StepState(x[k], (states[k],))
        after = step(
            bouc_wen, (modes.stiffness, modes.damping), state, 0.004, ground[k : k + 2],
            np.zeros(2),
        )  # fmt: skip
        np.testing.assert_allclose(after.x, x[k + 1], atol=1e-10 * np.abs(x).max())
        np.testing.assert_allclose(
            after.devices[0], states[k + 1], atol=1e-8 * np.abs(states).max()
        )
        compared += 1
    assert compared > 100


def test_a_batch_is_its_single_runs(bouc_wen, pair):
    weak = tuple(
        dataclasses.replace(record, acceleration=0.3 * record.acceleration) for record in pair
    )
    both = simulate_many([Case(bouc_wen, records, PassiveOff()) for records in (pair, weak)])
    for k, records in enumerate((pair, weak)):
        alone = iso.simulate(bouc_wen, records, "passive_off").criteria
        peak = "peak_base_displacement_m"
        assert both.criteria[peak][k] == pytest.approx(alone[peak], rel=1e-5)


def test_a_law_without_a_form_in_plan_is_refused():
    with pytest.raises(InputError, match="'dynamic_stiffness' has no form in two directions"):
        slab(law("dynamic_stiffness"))


def test_four_biaxial_isolators_under_an_eccentric_building(pair):
    building = plan_building(
        [2.5e5] * 3, [3e8] * 3, [3e8] * 3, base_mass=MASS, plan=(20.0, 12.0),
        eccentricity=(1.0, 0.5),
    )  # fmt: skip
    plant = building.on(law("bouc_wen", BOUC_WEN), biaxial=True)
    assert len(plant.elements) == 8
    run = iso.simulate(plant, pair, "passive_off")
    assert run.energy.closure_error < 1e-6
    assert np.abs(run.history.displacement.sel(dof="base_rotation")).max() > 1e-5


@pytest.mark.skipif(load_opensees() is None, reason="OpenSeesPy does not load here")
def test_bouc_wen_is_that_of_opensees(bouc_wen, pair):
    """Its Newmark steps converge to our motion at first order, as its rates are integrated."""
    ours = iso.simulate(bouc_wen, pair, "passive_off").history.displacement.values
    total = STRENGTH / YIELD + STIFFNESS
    coarse, fine = (
        opensees_motion(
            pair, n, False, "elastomericBearingBoucWen", 1, 1, 2, total, STRENGTH,
            STIFFNESS / total, 0.0, 1.0, 2.0, 0.5, 0.5,
        )
        for n in (8, 32)
    )  # fmt: skip
    peak = np.abs(ours).max()
    own_error = np.abs(coarse - fine).max() / 3
    assert own_error < 1e-3 * peak
    assert np.abs(fine - ours).max() < 1.1 * own_error


@pytest.fixture(scope="module")
def pendulum_motion(pair):
    """Displacements of the slab on friction pendulums, by the engine."""
    run = iso.simulate(slab(law("friction_pendulum", PENDULUM)), pair, "passive_off")
    assert run.energy.closure_error < 1e-6
    return run.history.displacement.values


def test_friction_pendulum_with_a_sharp_corner(pendulum_motion, pair):
    """A separate program returns friction onto its circle at once."""
    coarse, fine = (sharp_pendulum(pair, n, inclined=False) for n in (64, 256))
    peak = np.abs(fine).max()
    assert np.abs(coarse - fine).max() / 3 < 3.5e-4 * peak  # its own step error
    assert np.abs(pendulum_motion - fine).max() < 6e-4 * peak


@pytest.mark.skipif(load_opensees() is None, reason="OpenSeesPy does not load here")
def test_friction_pendulum_is_that_of_opensees(pendulum_motion, pair):
    """Friction of a flat singleFPBearing, beside springs with the stiffness of the pendulum."""
    flat = 1e4 * PENDULUM["R"]
    beside = MASS * GRAVITY * (1 / PENDULUM["R"] - 1 / flat)
    fine, coarse = (
        opensees_motion(pair, n, True, *single_fp(flat), beside=beside) for n in (64, 16)
    )
    own_error = np.abs(coarse - fine).max() / 3
    assert own_error < 2e-3 * np.abs(fine).max()
    assert np.abs(pendulum_motion - fine).max() < 3 * own_error


@pytest.mark.skipif(load_opensees() is None, reason="OpenSeesPy does not load here")
def test_the_inclined_normal_force_is_the_only_difference_to_opensees(pendulum_motion, pair):
    """Its singleFPBearing on a curved surface: a separate program with its inclination agrees."""
    fine, coarse = (opensees_motion(pair, n, True, *single_fp(PENDULUM["R"])) for n in (64, 16))
    peak = np.abs(fine).max()
    own_error = np.abs(coarse - fine).max() / 3
    assert np.abs(sharp_pendulum(pair, 256, inclined=True) - fine).max() < own_error
    assert own_error < np.abs(pendulum_motion - fine).max() < 0.005 * peak


def sharp_pendulum(pair, steps, inclined):
    """Leapfrog steps of the slab; friction returns radially onto its circle, x + i y."""
    h = pair[0].dt / steps
    at = np.arange((len(pair[0]) - 1) * steps) / steps
    ground = sum(
        axis * np.interp(at, np.arange(len(record)), record.acceleration)
        for axis, record in zip((1, 1j), pair, strict=True)
    )
    stiffness, radius = PENDULUM["mu_max"] / PENDULUM["u_y"], PENDULUM["R"]
    u = v = friction = 0j
    motion = [u]
    for k, a in enumerate(ground.tolist(), start=1):
        push = u / radius + friction
        normal = 1 / (1 - (push * u.conjugate()).real / radius) if inclined else 1.0
        v -= h * (a + GRAVITY * normal * push)
        u += h * v
        friction += stiffness * h * v
        slow = np.exp(-PENDULUM["a"] * abs(v))
        mu = PENDULUM["mu_max"] - (PENDULUM["mu_max"] - PENDULUM["mu_min"]) * slow
        friction *= min(1.0, mu / abs(friction)) if friction else 1.0
        if k % steps == 0:
            motion.append(u)
    return np.stack([np.real(motion), np.imag(motion)], axis=1)


def single_fp(radius):
    """Its stiffness before slip is that of friction and pendulum together."""
    stiffness = MASS * GRAVITY * (PENDULUM["mu_max"] / PENDULUM["u_y"] + 1 / radius)
    return "singleFPBearing", 1, 1, 2, 1, radius, stiffness


def opensees_motion(pair, steps, loaded, kind, *numbers, beside=0.0):
    """Displacements of a mass on a bearing and springs, by so many Newmark steps a sample."""
    ops = load_opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    ops.node(1, 0.0, 0.0, 0.0)
    ops.node(2, 0.0, 0.0, 0.0)
    ops.fix(1, *[1] * 6)
    ops.fix(2, 0, 0, 0 if loaded else 1, 1, 1, 1)
    ops.mass(2, MASS, MASS, MASS, 1.0, 1.0, 1.0)
    ops.uniaxialMaterial("Elastic", 1, 1e12)
    ops.uniaxialMaterial("Elastic", 2, 1e3)
    numbers = [*numbers, "-P", 1, "-T", 2, "-My", 2, "-Mz", 2, "-orient", 0, 0, 1, 1, 0, 0]
    if loaded:
        ops.frictionModel("VelDependent", 1, PENDULUM["mu_min"], PENDULUM["mu_max"], PENDULUM["a"])
        numbers += ["-iter", 100, 1e-10]
    ops.element(kind, *numbers)
    if beside:
        ops.uniaxialMaterial("Elastic", 3, beside)
        ops.element("zeroLength", 2, 1, 2, "-mat", 3, 3, "-dir", 1, 2)
    if loaded:
        _set_up(ops)
        ops.timeSeries("Constant", 9)
        ops.pattern("Plain", 9, 9)
        ops.load(2, 0.0, 0.0, -MASS * GRAVITY, 0.0, 0.0, 0.0)
        ops.integrator("LoadControl", 1.0)
        ops.analysis("Static")
        assert ops.analyze(1) == 0
        ops.loadConst("-time", 0.0)
        ops.wipeAnalysis()
    for k, record in enumerate(pair, start=1):
        ops.timeSeries("Path", k, "-dt", record.dt, "-values", *record.acceleration.tolist())
        ops.pattern("UniformExcitation", k, k, "-accel", k)
    _set_up(ops)
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    motion = [[0.0, 0.0]]
    for _ in range(len(pair[0]) - 1):
        assert ops.analyze(steps, pair[0].dt / steps) == 0
        motion.append([ops.nodeDisp(2, 1), ops.nodeDisp(2, 2)])
    return np.array(motion)


def _set_up(ops):
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("BandGeneral")
    ops.test("NormUnbalance", 1e-9 * MASS, 100)
    ops.algorithm("Newton")


def test_overturning_changes_the_friction(pair):
    """A device in the corner of a storey: its forces follow its present load."""
    building = plan_building(
        [2.5e5], [3e8], [3e8], base_mass=MASS, plan=(20.0, 12.0), heights=[4.0]
    )
    device = law("friction_pendulum", PENDULUM | {"n": 2.0, "mu_min": 0.08})
    plant = building.with_element(law("linear", {"k": 1e9}), "base_rotation", name="held")
    plant = plant.with_biaxial(
        device, ["base_x", "base_y"], load_change=overturning_rows(building)[-1]
    )
    assert [law.directions for law in plant.group_laws] == [1, 3]
    run = iso.simulate(plant, tuple(record.cut(0.0, 6.0) for record in pair), "passive_off")
    assert run.energy.closure_error < 1e-6
    history = run.history
    change = history.deformation.sel(element="isolator_load").values
    assert 0.02 < np.abs(change).max() < 1.0
    # the storey's moments over the base: shears by the arm, shared by four corners
    shear = 3e8 * 4.0 * history.drift.sel(storey=["storey1_x", "storey1_y"]).values
    expected = (shear @ [1 / 40, 1 / 24]) / (building.total_mass * STANDARD_GRAVITY / 4)
    np.testing.assert_allclose(change, expected, atol=1e-9)
    for axis in "xy":
        x = history.deformation.sel(element=f"isolator_{axis}").values
        f = history[f"isolator_f_{axis}"].values
        force = history.force.sel(element=f"isolator_{axis}").values
        expected = PENDULUM["W"] * (1 + change) * (x / PENDULUM["R"] + f)
        np.testing.assert_allclose(force, expected, atol=1e-9 * np.abs(force).max())


def test_vertical_ground_motion_changes_the_friction(pair):
    """Against SciPy: a slab, its vertical oscillator, and a pendulum under the present load."""
    from scipy.integrate import solve_ivp

    smooth = PENDULUM | {"n": 2.0, "tau": 0.5}
    period, ratio = 0.1, 0.05
    x, y = (record.cut(0.0, 4.0) for record in pair)
    up = x.scaled_to_pga(1.2 * STANDARD_GRAVITY)  # the slab lifts off and lands again
    structure = with_vertical_motion(slab(law("linear", {"k": 0.0})).structure, period, ratio)
    assert (structure.horizontal, structure.superstructure) == (("x", "y"), ())
    plant = structure.on(
        law("friction_pendulum", smooth), biaxial=True, load_changes=load_change_rows(structure)
    )
    run = simulate(plant, (x, y, up), PassiveOff(), tolerance=1e-9)
    many = simulate_many([Case(plant, (x, y, up), PassiveOff())], tolerance=1e-9)
    assert {k: v[0] for k, v in many.criteria.items()} == pytest.approx(run.criteria, rel=1e-7)
    assert run.energy.closure_error < 1e-6

    frequency = 2 * np.pi / period

    def rates(t, q):
        u, v, f, z, w = q[0:2], q[2:4], q[4:6], q[6], q[7]
        ground = [np.interp(t, each.time, each.acceleration) for each in (x, y, up)]
        load = PENDULUM["W"] * max(1 - frequency**2 * z / STANDARD_GRAVITY, 0.0)
        mu = PENDULUM["mu_max"] - (PENDULUM["mu_max"] - PENDULUM["mu_min"]) * np.exp(
            -PENDULUM["a"] * np.hypot(*v)
        )
        loading, size = f @ v, np.hypot(*f) + 1e-300
        slip = f * (abs(loading) + loading) / (2 * mu**2) * (PENDULUM["mu_max"] / PENDULUM["u_y"])
        back = f * max(0.0, 1 - mu / size) / smooth["tau"]
        return np.concatenate(
            [
                v,
                -np.array(ground[:2]) - load / MASS * (u / PENDULUM["R"] + f),
                PENDULUM["mu_max"] / PENDULUM["u_y"] * v - slip - back,
                [w, -ground[2] - 2 * ratio * frequency * w - frequency**2 * z],
            ]
        )

    motion = solve_ivp(
        rates, (0.0, x.duration), np.zeros(8), "LSODA", x.time, rtol=1e-8, atol=1e-10,
        max_step=x.dt,
    ).y  # fmt: skip
    change = run.history.deformation.sel(element="isolator_load").values
    np.testing.assert_allclose(change, -(frequency**2) * motion[6] / STANDARD_GRAVITY, atol=1e-5)
    assert change.min() < -1.2
    ours = run.history.displacement.sel(dof=["x", "y"]).values.T
    assert np.abs(ours - motion[:2]).max() < 2e-5 * np.abs(motion[:2]).max()


def test_quick_vertical_motion_is_the_ground_acceleration_over_g(pair):
    """A stiff bearing: N = W (1 + a_v / g)."""
    structure = with_vertical_motion(slab(law("linear", {"k": 0.0})).structure, 0.005)
    plant = structure.on(
        law("friction_pendulum", PENDULUM | {"n": 2.0}), biaxial=True,
        load_changes=load_change_rows(structure),
    )  # fmt: skip
    x, y = (record.cut(0.0, 3.0) for record in pair)
    run = simulate(plant, (x, y, x), PassiveOff())
    change = run.history.deformation.sel(element="isolator_load").values
    expected = x.acceleration / STANDARD_GRAVITY
    assert np.abs(change - expected).max() < 0.01 * np.abs(expected).max()
