"""Bounds on a force and its slope over an interval of the current."""

import re
import sys

import numpy as np
import pytest

from controllers.device_model import DeviceModel
from isolation_sim.effects import EFFECTS, extend
from isolation_sim.identification.characteristic_scales import characteristic_scale
from isolation_sim.laws import CurrentDependence, Device, law, trace_check
from isolation_sim.laws.emit import NotTraceable
from isolation_sim.laws.law import Law, Quantity

contract = sys.modules[Law.__module__]

FUNCTIONS = {
    "sinh": lambda p, q: np.sinh(p),
    "cosh": lambda p, q: np.cosh(p),
    "tanh": lambda p, q: np.tanh(p),
    "exp": lambda p, q: np.exp(p),
    "expm1": lambda p, q: np.expm1(p),
    "log": lambda p, q: np.log(p + 2.5),
    "log1p": lambda p, q: np.log1p(p + 1.5),
    "sqrt": lambda p, q: np.sqrt(p + 2.0),
    "sin": lambda p, q: np.sin(4 * p),
    "cos": lambda p, q: np.cos(4 * p),
    "arctan": lambda p, q: np.arctan(p),
    "arcsinh": lambda p, q: np.arcsinh(p),
    "sign": lambda p, q: np.sign(p),
    "fabs": lambda p, q: np.fabs(p),
    "fmax": lambda p, q: np.fmax(p, q),
    "fmin": lambda p, q: np.fmin(p, q),
    "hypot": lambda p, q: np.hypot(p, q),
    "copysign": lambda p, q: np.copysign(p, q),
    "floor": lambda p, q: np.floor(3 * p),
    "power": lambda p, q: np.power(q + 2.0, p),
    "**": lambda p, q: (p + 2.5) ** 1.7,
    "whole power": lambda p, q: p**5 - p**4,
    "negative power": lambda p, q: (p + 2.5) ** -2,
    "+": lambda p, q: p + q,
    "-": lambda p, q: 1.0 - p * q,
    "*": lambda p, q: p * q * p,
    "/": lambda p, q: p / (q + 2.0) + 1.0 / (p + 3.0),
    "<": lambda p, q: p * (p < q),
    "<=": lambda p, q: p * (p <= 0.3),
    "==": lambda p, q: p * (q == 5.0),
    "!=": lambda p, q: p * (q != 5.0),
}
"""What a law may use, of two parameters that change with the current from -1.5 to 1.5."""


def device_of(function):
    def force(x, v, states, parameters):
        return function(*parameters)

    names = Quantity("p", "1", ""), Quantity("q", "1", "")
    # over 0 to 3 A: p rises, q falls and rises again
    current = CurrentDependence.polynomial({"p": (-1.5, 1.0), "q": (1.3, -3.2, 1.05)})
    return Device(Law("one function", "", names, force), current)


def bounds(device, motion, low, high):
    model = DeviceModel([device])
    x, v, states = motion
    inputs = np.ones(1), np.array([x]), np.array([v]), np.array(states, float), model.numbers
    return model.combined_range(low, high, inputs)


def check(device, motion, low, high):
    lowest, highest, fall, rise = bounds(device, motion, low, high)
    currents = np.linspace(low, high, 401)
    # what lies just beyond a break belongs to the next piece
    currents[-1] = np.nextafter(high, low)
    forces = device.force(*motion, currents) + np.zeros(len(currents))
    slack = 1e-12 * (1 + np.abs(forces).max())
    assert lowest - slack <= forces.min() and forces.max() <= highest + slack
    slopes = np.diff(forces) / np.diff(currents)
    slack = slack * 1e3 / (high - low) + 1e-9 * np.abs(slopes).max()
    assert fall - slack <= slopes.min() and slopes.max() <= rise + slack


@pytest.mark.parametrize("name", FUNCTIONS)
def test_no_value_or_slope_is_outside(name):
    device, rng = device_of(FUNCTIONS[name]), np.random.default_rng(1)
    motion = 0.0, 0.0, ()
    for _ in range(30):
        low = rng.uniform(0, 3)
        check(device, motion, low, low + (3 - low) * 10 ** rng.uniform(-3, 0))
    check(device, motion, 0.0, 3.0)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_bounds_close_in_on_value_and_slope(name):
    device, motion, step = device_of(FUNCTIONS[name]), (0.0, 0.0, ()), 1e-6
    for current in (0.4, 1.7, 2.6):
        lowest, highest, fall, rise = bounds(device, motion, current, current + step)
        before, after = device.force(*motion, current), device.force(*motion, current + step)
        assert highest - lowest <= 1e-4 and rise - fall <= 1e-3
        assert lowest == pytest.approx(before, abs=1e-4)
        assert fall == pytest.approx((after - before) / step, abs=1e-3)


def test_all_that_a_law_may_use_is_tried():
    promised = re.search(r"``np\.(sinh\s.*?)``", contract.__doc__ or "", re.DOTALL)
    assert promised is not None and set(promised[1].split()) <= set(FUNCTIONS)
    advised = set(re.findall(r"np\.(\w+)", " ".join(trace_check._INSTEAD.values())))
    assert advised <= set(promised[1].split())


def test_what_has_no_range_is_refused_by_name():
    with pytest.raises(NotTraceable, match=r"tan has no range.* force of one function"):
        DeviceModel.range_text([device_of(lambda p, q: np.tan(p)).law])


@pytest.mark.parametrize("form", [form for forms in EFFECTS.values() for form in forms])
def test_forces_of_laws_with_effects_keep_within_their_bounds(form):
    isolator = law("strain_stiffening")
    sizes = {q.name: q.starts[0] * size_of(q.unit) for q in form.parameters}
    device, rng = extend(isolator, [(form, sizes)]), np.random.default_rng(4)
    for _ in range(3):
        x, v, *states = 8e-3 * rng.uniform(-1, 1, 2 + len(device.law.states)) * (1, 6, *[1] * len(
            device.law.states))  # fmt: skip
        check(device, (x, v, tuple(states)), 0.4, 2.9)


def size_of(unit):
    """What an effect's starts are multiples of."""
    return 1.0 if unit in ("s", "1") else characteristic_scale(unit, 300.0, 8e-3, 0.16, 2.0)
