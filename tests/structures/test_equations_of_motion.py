"""Structure, elements and laws integrated together by SciPy, against the reference runs."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isolation_sim.laws import law
from isolation_sim.structures import reference_building, reference_isolators


def trajectory(isolated, ground, currents, dt):
    """Displacements at the samples; acceleration linear and current held within a sample."""
    structure = isolated.structure
    n = structure.n_dofs
    (element,) = isolated.elements
    device, row = element.device, element.direction
    inverse = np.linalg.inv(structure.mass)
    y = np.zeros(2 * n + len(device.law.states))
    rows = [y[:n]]
    for start, end, current in zip(ground[:-1], ground[1:], currents, strict=False):

        def rate(t, y, start=start, end=end, current=current):
            q, v, states = y[:n], y[n : 2 * n], tuple(y[2 * n :])
            force = row * device.force(row @ q, row @ v, states, current)
            inner = inverse @ (-structure.damping @ v - structure.stiffness @ q - force)
            shaking = structure.influence[:, 0] * (start + (end - start) * t / dt)
            rates = device.rates(row @ q, row @ v, states, current)
            return np.concatenate([v, inner - shaking, rates])

        y = solve_ivp(rate, (0, dt), y, method="DOP853", rtol=1e-8, atol=1e-11).y[:, -1]
        rows.append(y[:n])
    return np.array(rows)


@pytest.mark.parametrize(
    ("device", "file"),
    [
        (law("strain_stiffening"), "strain_stiffening_random_0.02s"),
        (law("hybrid", "generalised_printed"), "hybrid_tanh_1.5A"),
    ],
)
def test_reference_trajectories(shared_data, device, file):
    folder = shared_data / "engine_reference"
    building, expected = np.load(folder / "building.npz"), np.load(folder / f"{file}.npz")
    samples = 150
    isolated = reference_building().on(reference_isolators(device))
    result = trajectory(
        isolated, building["ground_m_s2"][: samples + 1], expected["current_A"], building["dt_s"]
    )
    error = np.abs(result - expected["displacement_m"][: samples + 1]).max()
    assert error < 1e-7 * np.abs(expected["displacement_m"][: samples + 1]).max()
