"""Every form of every cause, with numbers that suit the papers' isolator."""

import numpy as np
import pytest

from isolation_sim.effects import EFFECTS
from isolation_sim.identification.characteristic_scales import characteristic_scale
from isolation_sim.laws import law

from ..splines import of_one_number

FORMS = {form.name: form for forms in EFFECTS.values() for form in forms}
X, FORCE, CURRENT, OMEGA = 8e-3, 300.0, 2.0, 2 * np.pi
"""Sizes of a test of the papers' isolator: m, N, A, rad/s."""


def size(quantity):
    """What a parameter's starts are multiples of."""
    if quantity.unit in ("s", "1"):
        return 1.0
    return characteristic_scale(quantity.unit, FORCE, X, 1 / OMEGA, CURRENT)


def numbers(form, magnitude=None, place=0):
    """An effect's parameters at one of their starts, its strength replaced if given."""
    results = {}
    for q in form.parameters:
        value = q.starts[min(place, len(q.starts) - 1)] * size(q)
        results[q.name] = min(max(value, q.lower), q.upper)
    if magnitude is not None:
        results[form.parameters[form.magnitude].name] = magnitude
    return results


@pytest.fixture(params=FORMS)
def form(request):
    """Every form of every cause in turn."""
    return FORMS[request.param]


@pytest.fixture
def isolator():
    """The papers' isolator, in its own scale."""
    return law("strain_stiffening")


@pytest.fixture
def draw():
    """Random x, v, states and currents of a device, each of shape (n,)."""

    def sample(device, n=200, seed=0):
        rng = np.random.default_rng(seed)
        x, v = 2 * X * rng.uniform(-1, 1, n), 2 * OMEGA * X * rng.uniform(-1, 1, n)
        states = tuple(X * rng.uniform(-1, 1, (len(device.law.states), n)))
        return x, v, states, rng.uniform(0, 3, n)

    return sample


def motion(duration=0.6, step=2e-3, seed=3):
    """Time (s), smooth random deformation (m), velocity (m/s) and acceleration (m/s^2)."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, duration, step)
    x, v, a = np.zeros((3, t.size))
    for f in (0.4, 1.0, 1.7, 3.1):
        size, phase, w = rng.uniform(0.2, 0.5) * X / f, rng.uniform(0, 2 * np.pi), 2 * np.pi * f
        x += size * (np.sin(w * t + phase) - np.sin(phase))
        v += size * w * np.cos(w * t + phase)
        a -= size * w**2 * np.sin(w * t + phase)
    return t, x, v, a


def respond(device, t, x, v, current, first=None, tolerance=1e-7, longest_step=0.02):
    """Force (N) and states of a device along a motion, by LSODA."""
    from scipy.integrate import solve_ivp
    from scipy.interpolate import CubicHermiteSpline, CubicSpline

    path, speed = of_one_number(CubicHermiteSpline(t, x, v)), of_one_number(CubicSpline(t, v))
    inputs = (lambda s: np.interp(s, t, current)) if np.ndim(current) else (lambda s: current)
    n = len(device.law.states)
    if first is None:
        rest = device.law.rest
        first = np.zeros(n) if rest is None else rest(device.parameters_at(inputs(t[0])))
    if n == 0:
        return device.force(x, v, (), inputs(t)) + 0.0 * t, np.zeros((0, t.size))
    solution = solve_ivp(
        lambda s, z: device.rates(path(s), speed(s), tuple(z), inputs(s)), t[[0, -1]],
        np.asarray(first, float), method="LSODA", t_eval=t, rtol=tolerance,
        atol=1e-3 * tolerance, max_step=longest_step,
    )  # fmt: skip
    assert solution.success
    return device.force(x, v, tuple(solution.y), inputs(t)), solution.y
