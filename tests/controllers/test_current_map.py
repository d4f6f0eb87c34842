"""Force to current and back, for every registered law with a current."""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from controllers import CurrentMap
from controllers.device_model import DeviceModel
from isolation_sim.errors import InputError
from isolation_sim.identification.characteristic_scales import characteristic_scale
from isolation_sim.laws import (
    LAWS,
    CurrentDependence,
    Device,
    available_conditions,
    available_laws,
    available_sets,
    law,
)
from isolation_sim.laws.hybrid import condition
from isolation_sim.laws.law import Law, Quantity
from isolation_sim.structures import reference_isolators

SCALES = {"force": 300.0, "length": 8e-3, "time": 0.16, "current": 1.0}
"""Of a laboratory device, for the numbers of laws that have none of their own."""
KNOTS = (0.0, 0.4, 1.1, 1.5, 2.3, 3.0)
"""A, of made-up tables."""


def made_up(name, tabulated, seed):
    """A device of a law whose every parameter follows the current in some way of its own."""
    one, rng = LAWS[name], np.random.default_rng(seed)
    if available_sets(name):
        typical = law(name).parameters_at(1.2)
    else:
        typical = [characteristic_scale(q.unit, **SCALES) for q in one.parameters]
    lower, upper = np.array([(q.lower, q.upper) for q in one.parameters]).T
    sizes = rng.uniform(0.5, 1.5, (len(KNOTS), len(typical))) * np.array(typical)
    sizes = np.clip(sizes, lower, upper)
    if tabulated:
        current = CurrentDependence.table(
            KNOTS, dict(zip(one.parameter_names, sizes.T, strict=True))
        )
    else:
        # quadratic between its control points, from 0 to 3 A
        a, b, c = sizes[:3]
        rows = np.array([a, 2 * (b - a) / 3.0, (a - 2 * b + c) / 9.0]).T
        current = CurrentDependence.polynomial(dict(zip(one.parameter_names, rows, strict=True)))
    return Device(one, current, (0.0, 3.0), tested_deformation=8e-3)


def devices():
    """Every law with a current: its published sets, then made-up numbers."""
    results = {f"{name}-{chosen}": law(name, chosen)
             for name in available_laws()
             for chosen in (*available_sets(name), *available_conditions(name))}  # fmt: skip
    results["hybrid-tabulated"] = condition(8, 1).scaled(length=10, force=300)
    results["reference"] = reference_isolators()
    results = {name: device for name, device in results.items() if device.depends_on_current}
    for name in available_laws():
        for tabulated in (True, False):
            results[f"{name}-made-up-{tabulated:d}"] = made_up(name, tabulated, 7)
    return results


DEVICES = devices()


def drawn(device, rng):
    """Deformation, velocity and states."""
    scale = device.deformation_scale
    x, v = scale * rng.uniform(-1, 1), 10 ** rng.uniform(-1, 1.5) * scale * rng.uniform(-1, 1)
    inner = scale / device.length
    states = [rng.uniform(-1, 1) * (inner if q.unit == "m" else 1.0) for q in device.law.states]
    return x, v, tuple(states)


class Oracle:
    """Forces over a range by a dense scan, refined by SciPy wherever they come near a force."""

    def __init__(self, device, motion, low, high):
        self.force = lambda current: device.force(*motion, current)
        inner = device.current.breaks[1:-1]
        inner = inner[(inner > low) & (inner < high)]
        ends = [np.linspace(low, high, 2001), inner, np.nextafter(inner, low)]
        self.currents = np.unique(np.concatenate(ends))
        self.forces = np.broadcast_to(self.force(self.currents), self.currents.shape)
        self.size = np.abs(self.forces).max()

    def crossings(self, target):
        """Where the force crosses the wanted one, and the currents at which it comes nearest."""
        i, miss = self.currents, self.forces - target
        near = [i[k] for k in (0, int(np.abs(miss).argmin()))]
        crossed = [(i[k], i[k + 1]) for k in np.flatnonzero(miss[:-1] * miss[1:] < 0)]
        inside = np.abs(miss[1:-1])
        valleys = (inside <= np.abs(miss[:-2])) & (inside <= np.abs(miss[2:]))
        for k in np.flatnonzero(valleys) + 1:
            if miss[k] == 0:
                continue
            minimum = minimize_scalar(
                lambda c, side: side * (self.force(c) - target), args=(np.sign(miss[k]),),
                bounds=(i[k - 1], i[k + 1]), method="bounded", options={"xatol": 1e-13},
            )  # fmt: skip
            near.append(minimum.x)
            # deep enough to be more than rounding: two crossings between samples
            if minimum.fun < -1e-9 * self.size and miss[k - 1] * miss[k + 1] > 0:
                crossed.append((i[k - 1], minimum.x))
        roots = [self.root(target, *pair) for pair in crossed]
        return sorted([*roots, *i[miss == 0]]), near

    def root(self, target, a, b):
        """Crossing between two currents; an end where rounding alone makes the difference."""
        if (self.force(a) - target) * (self.force(b) - target) >= 0:
            return min(a, b, key=lambda c: abs(self.force(c) - target))
        return brentq(lambda c: self.force(c) - target, a, b, xtol=1e-15)


def check(device, motion, target, low, high, oracle):
    current = CurrentMap(device, low, high)(target, *motion)
    size, miss = oracle.size, abs(current.force - target)
    roots, near = oracle.crossings(target)
    assert low <= current.current <= high
    # the map's text has the device's operations in another order
    assert abs(current.force - device.force(*motion, current.current)) <= 1e-14 * size
    assert current.saturated == (miss > 1e-9 * size)
    assert miss <= min(abs(oracle.force(c) - target) for c in near) + 1e-9 * size
    roots = [c for c in roots if abs(oracle.force(c) - target) <= 1e-9 * size]
    if roots:
        assert not current.saturated
        # what rounding of the force leaves open, where it hardly depends on the current
        step = 1e-7 * (high - low)
        beside = abs(oracle.force(roots[0] - step) - target)
        beside = max(beside, abs(oracle.force(roots[0] + step) - target))
        slack = 1e-9 * (high - low) + 1e-14 * size / (beside + 1e-300) * step
        assert current.current <= roots[0] + slack
        # a lower one must be one that the scan passed over
        assert current.current >= roots[0] - slack or miss <= 1e-9 * size
    return current


@pytest.mark.parametrize("name", DEVICES)
def test_lowest_current_that_gives_the_force_or_the_nearest(name):
    device, rng = DEVICES[name], np.random.default_rng(11)
    for _ in range(8):
        motion = drawn(device, rng)
        low, high = np.sort(rng.uniform(*device.current_range, 2)) if rng.random() < 0.3 else (
            device.current_range[0], min(device.current_range[1], 3.0)
        )  # fmt: skip
        oracle = Oracle(device, motion, low, high)
        lowest, highest = oracle.forces.min(), oracle.forces.max()
        inner = oracle.currents[rng.integers(len(oracle.currents))]
        for target in (
            device.force(*motion, rng.uniform(low, high)),
            device.force(*motion, inner),
            lowest - rng.uniform(0, 1) * oracle.size,
            highest + rng.uniform(0, 1) * oracle.size,
            lowest + 1e-6 * (highest - lowest),
            highest - 1e-6 * (highest - lowest),
            highest + 1e-6 * (highest - lowest),
        ):
            check(device, motion, target, low, high, oracle)


def test_the_reported_force_of_improved_bouc_wen_is_attained():
    """On the flank of a peak between two samples of a coarse scan."""
    motion = 0.000768753876739613, 0.006563612229046289, (-0.899172205299096,)
    current = CurrentMap(law("improved_bouc_wen"), 0.0, 2.5)(3712.8646898228517, *motion)
    assert current.current == pytest.approx(0.47892200543, abs=1e-9) and not current.saturated


def test_of_two_currents_the_lower():
    # gamma rises to 2.76 A and falls again: at x = 0 two currents give the same force
    device = reference_isolators(law("hybrid"))
    motion = 0.0, 0.3, ()
    assert device.force(*motion, 3.0) < device.force(*motion, 2.7)
    target = device.force(*motion, 2.9)
    lower = brentq(lambda c: device.force(*motion, c) - target, 2.0, 2.7, xtol=1e-14)
    assert CurrentMap(device, 0, 3)(target, *motion).current == pytest.approx(lower, abs=1e-9)


def linear(*coefficients):
    """A spring whose force at 1 m is this polynomial of the current."""
    return law("linear", {"k": coefficients})


def test_a_peak_is_attained_and_nothing_above_it():
    # 1 + c (2 - c) touches 2 at 1 A, in an interval's middle; the other peak is at 0.7 A
    for device, at in ((linear(1.0, 2.0, -1.0), 1.0), (linear(1.0, 1.4, -1.0), 0.7)):
        peak = 1.0 + at**2
        top = CurrentMap(device, 0, 3)(peak, 1.0, 0.0, ())
        assert not top.saturated and top.current == pytest.approx(at, abs=1e-4)
        above = CurrentMap(device, 0, 3)(1.1 * peak, 1.0, 0.0, ())
        assert above.saturated and above.force == pytest.approx(peak, rel=1e-11)
        below = CurrentMap(device, 0, 3)(peak - 1e-8, 1.0, 0.0, ())
        assert not below.saturated and below.current == pytest.approx(at - 1e-4, abs=1e-9)


def test_every_root_of_a_high_polynomial_is_the_lowest_of_some_range():
    roots = np.array([0.3, 0.31, 1.2, 1.9, 1.9005, 2.7])
    coefficients = np.polynomial.polynomial.polyfromroots(roots)
    coefficients[0] += 50.0
    device = linear(*coefficients)
    for k, root in enumerate(roots):
        low = 0.0 if k == 0 else roots[k - 1] + 1e-4
        current = CurrentMap(device, low, 3.0)(50.0, 1.0, 0.0, ())
        assert current.current == pytest.approx(root, abs=1e-7) and not current.saturated


def stepped(*values):
    """A spring whose stiffness is constant between 1 A, 2 A, …"""
    breaks = [-np.inf, *range(1, len(values)), np.inf]
    current = CurrentDependence(("k",), np.array(breaks), np.array(values).reshape(-1, 1, 1))
    return Device(LAWS["linear"], current)


def test_a_jump_past_the_force_saturates_on_its_nearer_side():
    current_map = CurrentMap(stepped(1.0, 2.0, 5.0), 0.0, 3.0)
    assert current_map(2.0, 1.0, 0.0, ()) == (1.0, 2.0, False)
    assert current_map(1.4, 1.0, 0.0, ()) == (0.0, 1.0, True)
    assert current_map(3.0, 1.0, 0.0, ()) == (1.0, 2.0, True)
    assert current_map(4.0, 1.0, 0.0, ()) == (2.0, 5.0, True)


def test_a_jump_inside_the_law_saturates_on_its_nearer_side():
    def force(x, v, states, parameters):
        return x * (1 + (parameters[0] > 2))

    jumping = Law("jumping", "Jumping", (Quantity("p", "1", ""),), force)
    device = Device(jumping, CurrentDependence.polynomial({"p": (0.0, 2.0 / 0.7)}))
    current_map = CurrentMap(device, 0.0, 3.0)
    assert current_map(2.0, 1.0, 0.0, ()) == (pytest.approx(0.7, abs=1e-9), 2.0, False)
    assert current_map(1.4, 1.0, 0.0, ()) == (0.0, 1.0, True)
    assert current_map(1.6, 1.0, 0.0, ())[1:] == (2.0, True)


def test_of_a_plateau_the_lowest_current():
    table = CurrentDependence.table((0.0, 1.3, 3.0), {"k": (1.0, 2.0, 2.0)})
    current_map = CurrentMap(Device(LAWS["linear"], table), 0.0, 3.0)
    assert current_map(2.0, 1.0, 0.0, ()).current == pytest.approx(1.3, abs=1e-12)
    assert current_map(2.5, 1.0, 0.0, ()) == (pytest.approx(1.3), 2.0, True)


def test_a_law_without_current_is_always_saturated_unless_equal():
    device = reference_isolators(law("strain_stiffening", "base_model"))
    force = device.force(0.01, 0.1, (1e-3, 1e-3), 0.0)
    current_map = CurrentMap(device, 0, 3)
    assert current_map(force, 0.01, 0.1, (1e-3, 1e-3)) == (0.0, force, False)
    assert current_map(2 * force, 0.01, 0.1, (1e-3, 1e-3)) == (0.0, force, True)


def test_the_search_stays_far_below_its_bound(monkeypatch):
    """Intervals looked at in all pieces together; at most 4096 are in one."""
    looked_at, inner = [], DeviceModel.combined_range

    def counted(*arguments):
        looked_at[-1] += 1
        return inner(*arguments)

    monkeypatch.setattr(DeviceModel, "combined_range", counted)
    for device in DEVICES.values():
        rng = np.random.default_rng(2)
        for _ in range(4):
            motion = drawn(device, rng)
            forces = device.force(*motion, np.linspace(*device.current_range, 9)) + np.zeros(9)
            for target in (forces.mean(), forces.max(), 1.1 * forces.max(), 1.1 * forces.min()):
                looked_at.append(0)
                CurrentMap(device, *device.current_range)(target, *motion)
    assert max(looked_at) < 1000 and np.mean(looked_at) < 20


@pytest.mark.parametrize("name", DEVICES)
def test_bad_range_is_refused(name):
    for low, high in ((1, 0), (0, np.inf), (np.nan, 1)):
        with pytest.raises(InputError, match=r"current map of .*: range"):
            CurrentMap(DEVICES[name], low, high)
