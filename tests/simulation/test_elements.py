"""Several nonlinear elements at once, against SciPy.

All plants here have the same four laws, so that one kernel serves them; numbers of zero take an
element out.
"""

import numpy as np
import pytest

from isolation_sim.laws import Law, Quantity
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import reference_building, reference_isolators


def quantities(text):
    return tuple(Quantity(name, "SI", name) for name in text.split())


def yielding_force(x, v, states, parameters):
    k, share, _, _ = parameters
    return share * k * x + (1 - share) * k * states[0]


def yielding_rates(x, v, states, parameters):
    _, _, yield_drift, beta = parameters
    z = states[0] / yield_drift
    return (v - beta * np.fabs(v) * z * np.fabs(z) - (1 - beta) * v * z * z,)


YIELDING = Law(
    "yielding", "Bouc-Wen storey", quantities("k share yield_drift beta"), yielding_force,
    quantities("hysteresis"), yielding_rates,
)  # fmt: skip


def wall_force(x, v, states, parameters):
    k, gap = parameters
    return k * ((x - gap) * (x > gap) + (x + gap) * (x < -gap))


WALL = Law("wall", "Moat wall", quantities("k gap"), wall_force)


def friction_force(x, v, states, parameters):
    slip, smoothing = parameters
    return slip * np.tanh(v / smoothing)


FRICTION = Law("friction", "Smooth Coulomb friction", quantities("slip smoothing"), friction_force)


@pytest.fixture(scope="module")
def plant(constant_device):
    """The reference building with a stiffened storey, isolators, moat walls and friction.

    The storey's stiffening stays linear unless it has a yield drift.
    """

    def build(isolator=1.0, yield_drift=0.0, wall=0.0, slip=0.0):
        device = reference_isolators()
        if not isolator:
            device = device.with_parameters(k1=0.0, alpha=0.0)
        share, limit = (0.1, yield_drift) if yield_drift else (1.0, 1.0)
        first = constant_device(YIELDING, k=2e8, share=share, yield_drift=limit, beta=0.6)
        moat = constant_device(WALL, k=wall, gap=0.06)
        sliding = constant_device(FRICTION, slip=slip, smoothing=0.02)
        return (
            reference_building()
            .with_element(first, "storey1", name="storey")
            .with_element(device, "base", channel=0, name="isolator")
            .with_element(moat, "base", name="wall")
            .with_element(sliding, "base", name="friction")
        )

    return build


@pytest.mark.parametrize(
    "numbers",
    [
        {"yield_drift": 1.2e-3, "wall": 3e7},
        {"yield_drift": 1.2e-3, "slip": 8e5},
        {"isolator": 0, "slip": 8e5},
    ],
    ids=lambda numbers: "-".join(numbers) or "isolator",
)
def test_elements_together_follow_scipy(
    numbers, plant, strong_motion, by_scipy, held, worst, motion
):
    isolated = plant(**numbers)
    run = simulate(isolated, strong_motion, held(1.5))
    q, v, states = by_scipy(isolated, [strong_motion], lambda start, t: (1.5,), rtol=1e-10)
    assert worst(motion(run), np.concatenate([q, v], axis=1)) < 1e-5
    if "yield_drift" in numbers:
        assert worst(run.states[:, 0, 0], states[:, 0]) < 1e-4  # |v| bends its rate
        assert np.abs(states[:, 0]).max() > 0.9 * numbers["yield_drift"]
    if "wall" in numbers:
        assert np.abs(q[:, 0]).max() > 0.06


def test_wall_pushes_only_while_it_is_touched(plant, strong_motion, held):
    run = simulate(plant(wall=3e7), strong_motion, held(0.5))
    force, x = run.output("wall_force_N"), run.output("wall_deformation_m")
    assert np.abs(force).max() > 0
    np.testing.assert_array_equal(force != 0, np.abs(x) > 0.06)
    np.testing.assert_allclose(force, 3e7 * np.sign(x) * np.maximum(np.abs(x) - 0.06, 0))


def test_iteration_ends_when_every_element_has_converged(plant, strong_motion, held, worst, motion):
    """The first element is linear, hence converged at once; the isolators are not."""
    isolated = plant()
    loose = simulate(isolated, strong_motion, held())
    tight = simulate(isolated, strong_motion, held(), tolerance=1e-11)
    assert worst(motion(loose), motion(tight)) < 2e-6
    assert loose.energy.closure_error < 1e-6
