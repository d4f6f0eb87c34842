"""Force to current and back."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers import CurrentMap
from isolation_sim.errors import InputError
from isolation_sim.laws import law
from isolation_sim.laws.hybrid import condition
from isolation_sim.structures import reference_isolators

DEVICES = {
    "strain_stiffening": reference_isolators(),
    "hybrid": reference_isolators(law("hybrid")),
    "hybrid between tests": condition(8, 1).scaled(length=10, force=300),
    "linear": law("linear", {"k": (2e4, 3e3)}),
    "no current": reference_isolators(law("strain_stiffening", "base_model")),
}
unit = st.floats(-1, 1)


@pytest.fixture(params=DEVICES)
def device(request):
    return DEVICES[request.param]


def drawn(device, x, v, y, z):
    """Deformation, velocity and states from numbers between -1 and 1."""
    scale = device.deformation_scale
    states = [s * scale / device.length for s in (y, z)][: len(device.law.states)]
    return scale * x, 10 * scale * v, states


@given(unit, unit, unit, unit, st.floats(0, 1), st.floats(0, 3), st.floats(0, 3))
@settings(max_examples=60, deadline=None)
@pytest.mark.parametrize("which", DEVICES)
def test_map_then_law_gives_the_force_back(which, x, v, y, z, share, end, other_end):
    device = DEVICES[which]
    low, high = min(end, other_end), max(end, other_end)
    x, v, states = drawn(device, x, v, y, z)
    wanted = device.force(x, v, states, low + share * (high - low))
    found = CurrentMap(device, low, high)(wanted, x, v, states)
    forces = device.force(x, v, states, np.linspace(low, high, 50))
    assert low <= found.current <= high
    assert found.force == device.force(x, v, states, found.current)
    assert abs(found.force - wanted) <= 1e-9 * np.abs(forces).max()
    assert not found.saturated


@given(unit, unit, unit, unit, st.floats(-3, 3))
@settings(max_examples=60, deadline=None)
@pytest.mark.parametrize("which", DEVICES)
def test_out_of_reach_it_returns_the_nearest(which, x, v, y, z, factor):
    device = DEVICES[which]
    x, v, states = drawn(device, x, v, y, z)
    forces = device.force(x, v, states, np.linspace(0, 3, 2001))
    size = np.abs(forces).max()
    wanted = factor * size
    found = CurrentMap(device, 0, 3)(wanted, x, v, states)
    assert abs(found.force - wanted) <= np.abs(forces - wanted).min() + 1e-9 * size
    assert found.saturated == (abs(found.force - wanted) > 1e-9 * size)


def test_a_law_without_current_is_always_saturated_unless_equal():
    device = DEVICES["no current"]
    force = device.force(0.01, 0.1, (1e-3, 1e-3), 0.0)
    current_map = CurrentMap(device, 0, 3)
    assert current_map(force, 0.01, 0.1, (1e-3, 1e-3)) == (0.0, force, False)
    assert current_map(2 * force, 0.01, 0.1, (1e-3, 1e-3)) == (0.0, force, True)


def test_of_two_currents_the_lower():
    # gamma rises to 2.73 A and falls again: at x = 0 two currents give the same force
    device = DEVICES["hybrid"]
    wanted = device.force(0.0, 0.3, (), 2.6)
    assert device.force(0.0, 0.3, (), 3.0) < device.force(0.0, 0.3, (), 2.7)
    assert CurrentMap(device, 0, 3)(wanted, 0.0, 0.3, ()).current == pytest.approx(2.6, abs=1e-6)


def test_a_peak_between_samples_is_reached():
    device = DEVICES["hybrid"]
    forces = device.force(0.0, 0.3, (), np.linspace(2.6, 2.9, 30001))
    found = CurrentMap(device, 0, 3)(2 * forces.max(), 0.0, 0.3, ())
    assert found.saturated and found.force == pytest.approx(forces.max(), rel=1e-9)
    just_below = forces.max() * (1 - 1e-5)
    assert not CurrentMap(device, 0, 3)(just_below, 0.0, 0.3, ()).saturated


def test_bad_range_is_refused(device):
    for low, high in ((1, 0), (0, np.inf), (np.nan, 1)):
        with pytest.raises(InputError, match=r"current map of .*: range"):
            CurrentMap(device, low, high)
