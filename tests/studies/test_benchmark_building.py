"""The benchmark building: supplied periods, an independent solution, and the nine indices."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.signal import lsim

import isolation_sim as iso
from isolation_sim.errors import InputError
from studies import benchmark_building as study
from studies.study import perform

pytestmark = pytest.mark.usefixtures("no_drawing")

OF_THE_MATRICES = (0.897, 0.780, 0.658, 0.283, 0.267, 0.214)
OF_THE_EIGENVALUES = (0.892, 0.775, 0.658, 0.282, 0.266, 0.214)
"""s, as the shared data's README lists them."""


@pytest.fixture(scope="module")
def data(shared_data):
    return shared_data / "benchmark_8_storey"


@pytest.fixture(scope="module")
def matrices(data):
    with np.load(data / "structure.npz") as arrays:
        # R is stored unsigned: -R would wrap
        return {key: arrays[key].astype(float) for key in arrays}


@pytest.fixture(scope="module")
def linear(data):
    return study.on_bearings(data, study.linear_bearing())


def test_fixed_base_periods(data, matrices):
    periods = study.structure(data).fixed_base_periods()
    exact = 2 * np.pi / np.sqrt(eigh(matrices["K"], matrices["M"], eigvals_only=True))
    np.testing.assert_allclose(periods, exact, rtol=1e-9)
    np.testing.assert_array_equal(periods[:6].round(3), OF_THE_MATRICES)
    # the eigenvalues supplied beside the matrices are others, by up to 0.6 % in period
    supplied = 2 * np.pi / np.sqrt(study.EIGENVALUES)
    np.testing.assert_array_equal(supplied.round(3), OF_THE_EIGENVALUES)
    assert 0.005 < np.abs(periods[:6] / supplied - 1).max() < 0.007


def test_positions_of_the_bearings_are_those_of_the_supplied_sums(matrices):
    x, y = np.array(study.BEARINGS).T
    assert len(set(study.BEARINGS)) == 92
    np.testing.assert_allclose(
        matrices["H"],
        [[92, 0, -y.sum()], [0, 92, x.sum()], [-y.sum(), x.sum(), (x**2 + y**2).sum()]],
        rtol=1e-12,
    )


def test_four_groups_are_the_bearings_to_the_last_digit(linear, matrices):
    count, places = study.groups()
    rows = linear.element_rows[:, :3]
    np.testing.assert_allclose(count * rows.T @ rows, matrices["H"], rtol=1e-12, atol=1e-9)
    assert count == 23 and places.shape == (4, 2)


@pytest.mark.parametrize("name", ["elcentro", "rinaldi"])
def test_linear_bearings_equal_an_independent_solution(linear, matrices, data, name):
    """Against SciPy's matrix exponential in physical coordinates, built from the file alone."""
    ground = study.records(data, name)
    run = iso.simulate(linear, ground)
    M, C, K, R, m, H = (matrices[key] for key in ("M", "C", "K", "R", "m", "H"))
    # coordinates relative to the ground, base first, in Mg, kN and m
    mass = np.block([[m, np.zeros((3, 24))], [np.zeros((24, 3)), M]])
    relative = np.hstack([-R, np.eye(24)])
    stiffness, damping = relative.T @ K @ relative, relative.T @ C @ relative
    stiffness[:3, :3] += 919.422 * H
    damping[:3, :3] += 27.717 * H
    shaken = np.tile(np.eye(3)[:, :2], (9, 1))
    A = np.block([
        [np.zeros((27, 27)), np.eye(27)],
        [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)],
    ])  # fmt: skip
    B = np.vstack([np.zeros((27, 2)), -shaken])
    moved = np.stack([record.acceleration for record in ground], axis=1)
    _, states, _ = lsim((A, B, np.eye(54), np.zeros((54, 2))), moved, run.time)
    acceleration = states @ A[27:].T
    for quantity, expected in (
        ("displacement_m", states[:, :27]), ("acceleration_m_s2", acceleration)
    ):  # fmt: skip
        dofs = run.isolated.structure.names
        computed = np.stack([run.output(f"{dof}_{quantity}") for dof in dofs], axis=1)
        assert (np.abs(computed - expected).max(0) / np.abs(expected).max(0)).max() < 1e-6


def test_both_orientations_of_a_record(data):
    along = {name: study.records(data, "kobe", name) for name in study.COMPONENTS}
    first, second = along.values()
    for one, other in zip(first, reversed(second), strict=True):
        np.testing.assert_array_equal(one.acceleration, other.acceleration)
    assert not np.array_equal(first[0].acceleration, second[0].acceleration)


def test_displacements_of_the_92_bearings(linear, data):
    """Over all positions, from the base's own motion: the outermost decide."""
    run = iso.simulate(linear, study.records(data, "elcentro"))
    u, v, turn = (run.output(f"base_{axis}_displacement_m") for axis in ("x", "y", "rotation"))
    moved = [np.hypot(u - y * turn, v + x * turn) for x, y in study.BEARINGS]
    expected = np.max(moved)
    assert run.criteria["peak_isolator_displacement_m"] == pytest.approx(expected, rel=1e-3)
    rms = np.sqrt(np.max(np.mean(np.square(moved), axis=1)))
    assert run.criteria["rms_isolator_displacement_m"] == pytest.approx(rms, rel=1e-3)


def test_mr_isolators_are_as_stiff_as_the_bearings_at_the_design_displacement():
    period = 3.0
    device = study.mr_isolator(1 / period)
    assert device.deformation_scale == pytest.approx(study.DESIGN_DISPLACEMENT)
    # an independent loop: the force in phase with a sinusoid, over its amplitude
    omega, n = 2 * np.pi / period, 4000
    time = np.linspace(0, 8 * period, 8 * n + 1)
    x = study.DESIGN_DISPLACEMENT * np.sin(omega * time)
    v = study.DESIGN_DISPLACEMENT * omega * np.cos(omega * time)
    states, h, force = np.zeros(2), time[1], np.zeros(len(time))
    for k in range(len(time)):
        force[k] = device.force(x[k], v[k], states, study.DESIGN_CURRENT)
        states = states + h * np.array(device.rates(x[k], v[k], states, study.DESIGN_CURRENT))
    in_phase = 2 * np.mean(force[-n:] * np.sin(omega * time[-n:])) / study.DESIGN_DISPLACEMENT
    assert in_phase == pytest.approx(study.BEARING_STIFFNESS, rel=0.1)


def test_nonlinear_bearings_have_the_linear_stiffness_after_yielding_or_slip():
    weight, far = 2.5e6, 0.3
    for device, strength in (
        (study.lead_rubber_bearing(weight), study.CHARACTERISTIC_STRENGTH * weight),
        (study.friction_bearing(weight), study.SLIDING["mu_max"] * weight),
    ):
        states = (1.0,) if device.law.name == "park_wen_ang" else (study.SLIDING["mu_max"],)
        force = device.force(far, 1.0, states, 0.0)
        assert force == pytest.approx(study.BEARING_STIFFNESS * far + strength, rel=1e-12)


def test_short_form(tmp_path, data):
    outcome, path = perform("benchmark_building", tmp_path / "study", True)
    with (path / "runs.csv").open(newline="", encoding="utf-8") as file:
        runs = list(csv.DictReader(file))
    assert len(runs) == 2 * 2 * 6
    for row in runs:
        values = np.array([float(row[index]) for index in study.INDICES])
        assert np.all(values > 0) and np.all(values < 10)
        if row["controller"] == study.LINEAR:
            np.testing.assert_allclose(values[[0, 1, 2, 3, 4, 6, 7]], 1.0)
        # the building turns, so that some isolator moves farther than the centre
        assert float(row["peak_isolator_displacement_m"]) > float(row["peak_base_displacement_m"])
    assert "0.8974" in outcome.finding and "0.8920" in outcome.finding
    # the second orientation is another motion
    peaks = {
        (row["record"], row["along_x"]): row["peak_base_displacement_m"]
        for row in runs if row["controller"] == study.LINEAR
    }  # fmt: skip
    assert len(set(peaks.values())) == 4
    assert (path / "figures" / "indices.svg").is_file()


def test_absent_data_are_reported(monkeypatch, tmp_path):
    monkeypatch.setenv("ISOLATION_SIM_DATA", str(tmp_path))
    with pytest.raises(InputError, match="ISOLATION_SIM_DATA"):
        perform("benchmark_building", tmp_path / "study", True)
