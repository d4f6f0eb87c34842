"""Effects outside the catalogue, with the variables that each depends on.

Variables: ``x`` deformation, ``v`` velocity, ``a`` acceleration, ``I`` current, ``t`` time,
``history`` of the deformation. Strengths are shares of a force of 100 N, the same for every device,
for the size is set by the gauge anyway.
"""

from __future__ import annotations

import numpy as np

from .effect import CURRENT, FORCE, MATERIAL, about, form
from .signals import lag, play

REFERENCE_FORCE = 100.0
FREQUENCIES = {"outside:pump": 11.3, "outside:mains_modulation": 16.7}
"""Frequency of the periodic ones, Hz; neither is a multiple of a test frequency."""


@form("outside:squared_position_velocity", FORCE, depends_on="x v")
def _squeeze_flow(rng):
    """Fluid squeezed harder when deformed: x^2 v."""
    return lambda s, q: s * REFERENCE_FORCE * (q.motion.x / 8) ** 2 * q.motion.v / 30


@form("outside:current_velocity_squared", FORCE, depends_on="I v")
def _field_drag(rng):
    """Quadratic drag that needs the field: I v |v|."""
    return lambda s, q: (
        s * REFERENCE_FORCE * q.current / 3 * q.motion.v * np.abs(q.motion.v) / 30**2
    )


@form("outside:pump", FORCE, depends_on="t")
def _pump(rng):
    """A pump shakes the load cell, at one frequency, whatever the test."""
    phase = rng.uniform(0, 2 * np.pi, 64)
    omega = 2 * np.pi * FREQUENCIES["outside:pump"]
    return lambda s, q: s * REFERENCE_FORCE * np.sin(omega * q.motion.time + phase[q.motion.number])


@form("outside:mains_modulation", MATERIAL, limit=0.5, depends_on="t", tolerated="x v I history")
def _mains_modulation(rng):
    """The supply's traction-mains ripple (16.7 Hz) modulates the stiffness."""
    phase = rng.uniform(0, 2 * np.pi, 64)
    omega = 2 * np.pi * FREQUENCIES["outside:mains_modulation"]

    return lambda s, q: 1 + s * np.sin(omega * q.motion.time + phase[q.motion.number])


@form("outside:linkage_backlash", FORCE, depends_on="x", tolerated="v history")
def _linkage_backlash(rng):
    """A side spring in a slot whose frame is dragged along by friction: a gap that remembers."""
    drag, gap = about(rng, 4.5), about(rng, 2.0)

    def act(s, q):
        slip = q.motion.x - play(q.motion.x, drag)
        return s * REFERENCE_FORCE / 8 * np.sign(slip) * np.maximum(np.abs(slip) - gap, 0.0)

    return act


@form("outside:wandering_stiffness", MATERIAL, limit=0.3, depends_on="t", tolerated="x v I history")
def _wandering_stiffness(rng):
    """Conditioning electronics age and warm: gain wanders within a run, each run otherwise."""
    rates = rng.uniform(0.05, 0.12, (64, 3))
    phases = rng.uniform(0, 2 * np.pi, (64, 3))

    def act(s, q):
        angle = 2 * np.pi * np.outer(q.motion.time, rates[q.motion.number])
        angle += phases[q.motion.number]
        return np.exp(s * np.sin(angle).sum(axis=1))

    return act


@form("outside:squared_acceleration", FORCE, depends_on="a")
def _squared_acceleration(rng):
    """A tilting top plate couples vertical load in: a^2, one-sided."""
    return lambda s, q: s * REFERENCE_FORCE * (q.motion.a / 1000) ** 2


@form("outside:quantised_current", CURRENT, limit=1.0, depends_on="I", tolerated="x v history")
def _quantised_current(rng):
    """The driver's converter has few levels; the measured current is the command. Step in A."""
    offset = rng.uniform(0, 1)
    return lambda s, q: np.maximum(s * (np.floor(q.current / s + offset) + 0.5 - offset), 0.0)


@form("outside:current_rate", FORCE, depends_on="I", tolerated="t history")
def _current_rate(rng):
    """Changing flux pulls on the loose armature: a force with the current's rate of change."""
    tau = about(rng, 0.04)

    def act(s, q):
        rate = (q.current - lag(q.current, q.motion.step, tau)) / tau
        return s * REFERENCE_FORCE * rate / 10

    return act


@form("outside:centred_bump", FORCE, depends_on="x")
def _centred_bump(rng):
    """A detent at one position: an elastic force that is neither odd nor even."""
    centre, width = about(rng, 3.0), about(rng, 1.0)

    def act(s, q):
        u = (q.motion.x - centre) / width
        return -s * REFERENCE_FORCE * u * np.exp(-(u**2) / 2)

    return act
