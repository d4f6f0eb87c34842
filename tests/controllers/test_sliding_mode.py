"""Sliding mode."""

from collections import namedtuple

import numpy as np
import pytest

from controllers import CurrentMap, controller
from controllers.sliding_mode import carried_masses
from isolation_sim.laws import law
from isolation_sim.structures import reference_building, reference_isolators

from .conftest import both_forms, context_of

MEASUREMENT = namedtuple("Measurement", "x v coil")


@pytest.mark.parametrize(("x", "v", "pull"), [(0.05, 0.3, 1.0), (0.02, 0.03, 0.35), (0.0, -1, -1)])
def test_target_force_leads_to_the_surface(isolated, x, v, pull):
    one = controller("sliding_mode", slope=2.0, gain=0.5, layer=0.2)
    one.reset(context_of(one, isolated))
    mass = isolated.structure.total_mass
    expected = mass * (2.0 * v + 0.5 * pull)
    command = one.current(0.0, MEASUREMENT(x, v, 0.0))[0]
    # at the first instant the states are still those of rest
    assert one._step.memory[3] == pytest.approx(expected, rel=1e-12)
    mapped = CurrentMap(isolated.elements[0].device, 0, 3)(expected, x, v, (0.0, 0.0))
    assert command == pytest.approx(mapped.current, abs=1e-9)


def test_slides_where_the_force_is_free():
    """A rigid mass under that force comes to the surface and stays, whatever shakes it less."""
    slope, gain, layer, h = 2.0, 0.5, 0.01, 1e-4
    x, v, peaks = 0.1, 0.3, []
    for k in range(60000):
        distance = v + slope * x
        force = slope * v + gain * min(max(distance / layer, -1), 1)
        v += h * (-force - 0.4 * np.sin(5 * k * h))
        x += h * v
        peaks.append(abs(distance))
    assert max(peaks[20000:]) <= 1.01 * layer and abs(x) < 0.01


def test_masses_are_shared_by_stiffness():
    device = reference_isolators().scaled(force=0.2)
    nominal = reference_building().with_element(device, "base", 0, "a")
    nominal = nominal.with_element(device.scaled(force=3), "base", 1, "b")
    masses = carried_masses(nominal, np.array([1.5, 1.5]))
    assert masses == pytest.approx(nominal.structure.total_mass * np.array([0.25, 0.75]))
    one = controller("sliding_mode")
    context = context_of(one, nominal)
    t = np.arange(50) * 0.02
    motion = np.column_stack([0.05 * np.sin(3 * t), 0.15 * np.cos(3 * t)] * 2 + [t, 1 + t])
    plain, fast = both_forms(one, context, motion)
    assert np.abs(plain - fast).max() <= 1e-9 and np.ptp(plain, axis=0).min() > 0.5


def test_plain_and_compiled_form_agree_where_the_force_bends_with_the_current():
    """A table's kinks, a Gaussian, and two devices on one coil."""
    nominal = reference_building().on(reference_isolators(law("hybrid")))
    pulled = law("improved_bouc_wen").scaled(length=100, force=30)
    for name, channel, device in (("b", 1, pulled), ("c", 1, pulled.scaled(force=2))):
        nominal = nominal.with_element(device, "base", channel, name)
    one, t = controller("sliding_mode", gain=1.5), np.arange(60) * 0.02
    motion = [0.08 * np.sin(3 * t), 0.24 * np.cos(3 * t)]
    seen = np.column_stack([*motion * 3, 1 + np.sin(t), 1 + np.cos(t)])
    plain, fast = both_forms(one, context_of(one, nominal, high=2.5), seen)
    # where the force is largest, rounding leaves the current open to half of the digits
    assert np.abs(plain - fast).max() <= 1e-6 and np.ptp(plain, axis=0).min() > 1.0
    assert len(np.unique(plain[:, 1].round(6))) > 10
