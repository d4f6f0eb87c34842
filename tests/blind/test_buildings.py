"""Building records of the blind generator: right motion, every fault at its size, right columns."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import sawtooth

from studies.blind import building_model as model
from studies.blind.buildings import (
    CHANNELS,
    DAMPING_RATIO,
    Fault,
    faults,
    ground_motion,
    make_record,
    misfit,
    nominal_building,
)

NAMES = """storey_stiffness_loss base_mass_error isolator_amplitude_softening
extra_isolator_damping actuation_delay current_supply_limit soil_flexibility moat_impact
sensor_bias""".split()
N_FAULTS = 18


def matrices(building):
    """M, C, K over base, floors, sway, rock by stretch vectors; the isolators' vector."""
    n = model.N_STOREYS
    storeys = np.zeros((n, n + 3))
    lifted = np.zeros((n, n + 3))
    for i in range(n):
        storeys[i, [i, i + 1, n + 2]] = -1.0, 1.0, -model.HEIGHT
        lifted[i, 0], lifted[i, i + 1], lifted[i, n + 2] = -1.0, 1.0, -(i + 1) * model.HEIGHT
    layer = np.zeros(n + 3)
    layer[[0, n + 1, n + 2]] = 1.0, -1.0, -model.HEIGHT
    arm = model.ARM**2
    soil = model.SOIL_STIFFNESS * np.array([1 / building.sway, arm / building.rock])
    lumps = model.FOUNDATION_MASS * np.array([1.0, arm / 3])
    mass = np.diag([building.base_mass, *building.masses, *lumps])
    elastic = storeys.T @ np.diag(building.stiffnesses) @ storeys
    damping = building.rayleigh[0] * lifted.T @ np.diag(building.masses) @ lifted
    damping += building.rayleigh[1] * elastic
    stiffness = elastic.copy()
    stiffness[-2:, -2:] += np.diag(soil)
    damping[-2:, -2:] += np.diag(2 * model.SOIL_DAMPING * np.sqrt(soil * lumps))
    return mass, damping, stiffness, layer


@pytest.mark.parametrize("lag", [0.0, pytest.param(0.05, marks=pytest.mark.slow)])
def test_motion_agrees_with_scipy_on_soil_under_a_current_that_moves(lag):
    building = replace(nominal_building(3), sway=1.0, rock=0.5, lag=lag)
    ground = ground_motion(3, duration=3.0)
    time = np.arange(ground.size) / model.RATE
    # up and down between samples, never steeper than the rule's ramp
    command = 1.5 + 1.5 * sawtooth(2 * np.pi * 1.7 * time, 0.5)
    mass, damping, stiffness, layer = matrices(building)
    size = mass.shape[0]
    a, beta, gamma, power = building.isolator[3:, 0]
    # the ground moves every translation, not the rocking
    pushed = np.append(np.ones(size - 1), 0.0)

    def rates(t, s):
        y, v, z, current = s[:size], s[size:-2], s[-2], s[-1]
        asked = np.interp(t, time, command)
        supplied = current if lag else asked
        k, c, alpha = (np.polynomial.polynomial.polyval(supplied, row)
                       for row in building.isolator[:3])  # fmt: skip
        slip = layer @ v
        force = damping @ v + stiffness @ y + (k * layer @ y + c * slip + alpha * z) * layer
        rate = a * slip - (beta * abs(slip) * z + gamma * slip * abs(z)) * abs(z) ** (power - 1)
        moved = -np.linalg.solve(mass, force) - pushed * np.interp(t, time, ground)
        return np.concatenate([v, moved, [rate, (asked - current) / lag if lag else 0.0]])

    start = np.append(np.zeros(2 * size + 1), command[0])
    solution = solve_ivp(
        rates, (0, time[-1]), start, t_eval=time, rtol=1e-8, atol=1e-10,
        max_step=1 / model.RATE,
    )  # fmt: skip
    response = building.respond(ground, command)
    deformation = layer @ solution.y[:size]
    error = np.max(np.abs(response.deformation - deformation)) / np.max(np.abs(deformation))
    assert error < 1e-5
    roof = ground + np.array(
        [rates(t, s)[size + model.N_STOREYS] for t, s in zip(time, solution.y.T, strict=True)]
    )
    error = np.max(np.abs(response.accelerations[-1] - roof)) / np.max(np.abs(roof))
    assert error < 1e-4


def test_rayleigh_damping_is_as_described():
    building = nominal_building(4)
    n = model.N_STOREYS
    stretch = np.eye(n) - np.eye(n, k=-1)
    stiffness = stretch.T @ np.diag(building.stiffnesses) @ stretch
    values = np.sqrt(np.linalg.eigvals(np.diag(1 / building.masses) @ stiffness))
    omega = np.sort(values.real)
    ratio = building.rayleigh[0] / (2 * omega) + building.rayleigh[1] * omega / 2
    np.testing.assert_allclose(ratio[[0, 2]], DAMPING_RATIO, rtol=1e-9)


@pytest.fixture(scope="module")
def every_fault():
    return faults(1)


def test_every_name_has_two_forms(every_fault):
    assert {fault.name for fault in every_fault} == set(NAMES)
    assert all(sum(fault.name == name for fault in every_fault) >= 2 for name in NAMES)
    assert len(every_fault) == N_FAULTS
    assert {fault.storey for seed in range(30) for fault in faults(seed)[:1]} == {1, 2, 3, 4, 5}


@pytest.mark.usefixtures("short_motion")
@pytest.mark.parametrize(
    "k",
    # every name has two forms, one after the other
    [pytest.param(k, marks=[pytest.mark.slow] if k % 2 else []) for k in range(N_FAULTS)],
)
def test_fault_reaches_its_size_and_is_nothing_at_severity_zero(every_fault: list[Fault], k: int):
    fault = every_fault[k]
    record = make_record(1, [fault], 0.06, noise=0.0)
    assert record.size == pytest.approx(0.06, rel=0.1)
    assert 0 < record.severities[0] <= fault.limit
    still = fault.change(record.nominal, 0.0).respond(record.ground)
    channels = fault.reading(still, 0.0)
    assert misfit(record.nominal, record.ground, still.current, channels) < 1e-9


def test_clean_record_is_the_nominal_building_and_noise():
    record = make_record(2)
    response = record.nominal.respond(ground_motion(2), record.current)
    share = np.std(record.channels - response.channels, axis=1)
    np.testing.assert_allclose(
        share / np.sqrt(np.mean(response.channels**2, axis=1)), 0.01, rtol=0.1
    )
    assert np.ptp(record.current) == pytest.approx(record.nominal.largest_current)
    assert 0.05 < np.max(np.abs(response.deformation)) < 0.5


def test_files(tmp_path):
    record = make_record(2)
    folder = record.write(tmp_path / "r")
    lines = (folder / "record.csv").read_text().splitlines()
    header = lines[0].split(",")
    assert header[:3] == ["time_s", "ground_acceleration_m_s2", "base_acceleration_m_s2"]
    assert header[-2:] == ["isolator_displacement_m", "current_A"]
    assert header[2:-1] == list(CHANNELS)
    data = np.loadtxt(folder / "record.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(data[:, 2:-1].T, record.channels, rtol=1e-6, atol=1e-9)
    content = tomllib.loads((folder / "building.toml").read_text())
    assert content["building"]["base_mass_kg"] == record.nominal.base_mass
    assert content["isolation_layer"]["parameters"]["A"] == [1.0]
