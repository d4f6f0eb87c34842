"""Hidden effects that add a force, or that the force channel makes."""

from __future__ import annotations

import numpy as np
from scipy.signal import bessel, sosfilt, sosfilt_zi

from .effect import FORCE, SENSOR, about, form
from .signals import bristle, grunwald, hereditary, lag, smooth_abs, stick_slip


@form("force_offset", FORCE)
def _same_everywhere(rng):
    """One offset for all runs, N."""
    side = rng.choice((-1.0, 1.0))
    return lambda s, q: s * side * np.ones_like(q.force)


@form("force_offset", FORCE)
def _zeroed_each_morning(rng):
    """An offset that differs a little between runs, N."""
    side, scatter = rng.choice((-1.0, 1.0)), 0.3 * rng.standard_normal(64)
    return lambda s, q: s * side * (1 + scatter[q.motion.number]) * np.ones_like(q.force)


@form("coulomb_friction", FORCE)
def _stribeck(rng):
    """Sliding friction, higher near rest (Stribeck), through a narrow tanh."""
    rest, fade, corner = about(rng, 0.25), about(rng, 10.0), about(rng, 0.8)

    def act(s, q):
        v = q.motion.v
        return s * (1 + rest * np.exp(-((v / fade) ** 2))) * np.tanh(v / corner)

    return act


@form("coulomb_friction", FORCE)
def _bristles(rng):
    """Dahl's bristles beside a stick-slip spring: presliding over some hundredths of mm."""
    short, long = about(rng, 0.05), about(rng, 0.15)
    return lambda s, q: s * (0.6 * bristle(q.motion.x, short) + 0.4 * stick_slip(q.motion.x, long))


@form("inertia_force", FORCE)
def _plate(rng):
    """A top plate between load cell and device; severity in kg."""
    return lambda s, q: s * 1e-3 * q.motion.a


@form("inertia_force", FORCE)
def _plate_on_bolts(rng):
    """The same on a mount that is not rigid."""
    tau = 1 / (2 * np.pi * about(rng, 60.0))
    return lambda s, q: s * 1e-3 * lag(q.motion.a, q.motion.step, tau)


@form("sensor_delay", SENSOR, limit=0.04)
def _late_channel(rng):
    """The force channel is sampled late; severity in s."""

    def act(s, q):
        t = q.motion.time
        return np.interp(t - s, t, q.force)

    return act


@form("sensor_delay", SENSOR, limit=0.04)
def _anti_aliasing(rng):
    """Bessel filter of fourth order in the force channel; severity is its delay in s."""

    def act(s, q):
        if s <= 0:
            return q.force
        corner = min(1 / (2 * np.pi * s), 0.4 / q.motion.step)
        sections = bessel(4, corner, norm="delay", fs=1 / q.motion.step, output="sos")
        return sosfilt(sections, q.force, zi=sosfilt_zi(sections) * q.force[0])[0]

    return act


@form("extra_relaxation", FORCE)
def _stretched(rng):
    """Stretched exponential relaxation beside the device; severity in N/mm."""
    tau, power = about(rng, 0.8), about(rng, 0.6, 0.1)

    def act(s, q):
        kernel = np.exp(-((q.motion.time / tau) ** power))
        return s * hereditary(kernel, q.motion.v, q.motion.step)

    return act


@form("extra_relaxation", FORCE)
def _two_arms(rng):
    """Two Maxwell arms, a fast and a slow one, field dependent; severity in N/mm."""
    fast, slow, field = about(rng, 0.12), about(rng, 2.0), about(rng, 0.3)

    def act(s, q):
        arms = 0.0
        for tau, share in ((fast, 0.5), (slow, 0.5)):
            arms = arms + share * (q.motion.x - lag(q.motion.x, q.motion.step, tau))
        return s * (1 + field * q.current) * arms

    return act


@form("weak_rate_dependence", FORCE)
def _fractional(rng):
    """A fractional derivative in parallel, N s^a / mm."""
    order = about(rng, 0.25)
    return lambda s, q: s * grunwald(q.motion.x, order, q.motion.step)


@form("weak_rate_dependence", FORCE)
def _power_of_velocity(rng):
    """A dashpot whose force grows with a low power of the velocity."""
    power, corner = about(rng, 0.4), about(rng, 1.0)

    def act(s, q):
        u = q.motion.v / corner
        return s * u * (1 + u**2) ** ((power - 1) / 2)

    return act


@form("end_stop", FORCE)
def _hertz(rng):
    """Rubber buffer touched as Hertz has it; severity in N/mm^1.5."""
    gap = about(rng, 9.5, 0.06)

    def act(s, q):
        beyond = np.maximum(np.abs(q.motion.x) - gap, 0.0)
        return s * np.sign(q.motion.x) * beyond**1.5

    return act


@form("end_stop", FORCE)
def _locking(rng):
    """Chains that lock: exponential beyond a gap, no corner; severity in N."""
    gap, depth = about(rng, 10.0, 0.05), about(rng, 0.7)

    def act(s, q):
        beyond = smooth_abs(q.motion.x, 0.2) - gap
        return s * np.sign(q.motion.x) * np.log1p(np.exp(beyond / depth)) ** 1.5

    return act
