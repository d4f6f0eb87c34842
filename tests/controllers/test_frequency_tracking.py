"""Frequency tracking."""

from collections import namedtuple

import numpy as np
import pytest

from controllers import controller
from controllers.frequency_tracking import (
    COEFFICIENTS,
    FASTEST,
    N_FREQUENCIES,
    SLOWEST,
    dominant_frequency,
)
from isolation_sim.structures import reference_building, reference_isolators

from .conftest import context_of

MEASUREMENT = namedtuple("Measurement", "ground coil")
FREQUENCIES = np.geomspace(SLOWEST, FASTEST, N_FREQUENCIES)


@pytest.mark.parametrize("frequency", [0.3, 1.0, 4.0])
def test_peak_of_the_spectrum(frequency):
    h, radius = 0.02, 0.95
    turn = 2 * np.pi * frequency * h
    cosine, decay = 2 * radius * np.cos(turn), -(radius**2)
    omega = np.linspace(1e-4, np.pi, 400001)
    response = 1 / np.abs(1 - cosine * np.exp(-1j * omega) - decay * np.exp(-2j * omega))
    result = dominant_frequency(cosine, decay, h)
    assert result == pytest.approx(omega[np.argmax(response)] / (2 * np.pi * h), abs=1e-3)


@pytest.mark.parametrize("frequency", [0.25, 0.5, 0.9])
def test_follows_a_changing_tone_in_noise(isolated, frequency):
    one = controller("frequency_tracking", corner=2.0, forgetting=2.0)
    context = context_of(one, isolated)
    one.reset(context)
    rng, phase = np.random.default_rng(0), 0.0
    for k in range(3000):
        phase += 2 * np.pi * 0.02 * (1.5 if k < 1000 else frequency)
        ground = np.sin(phase) + 0.05 * rng.standard_normal()
        one.current(0.02 * k, MEASUREMENT(ground, 0.0))
        if k == 999:
            assert dominant_frequency(*one._step.memory[COEFFICIENTS:][:2], 0.02) == pytest.approx(
                1.5, rel=0.1
            )
    result = dominant_frequency(*one._step.memory[COEFFICIENTS:][:2], 0.02)
    assert result == pytest.approx(frequency, rel=0.25)


def test_current_amplifies_the_tone_least(isolated):
    one = controller("frequency_tracking")
    currents = one.best_currents(context_of(one, isolated), 0)
    device, mass = isolated.elements[0].device, isolated.structure.total_mass
    for frequency in (0.2, 0.45, 0.55, 2.0):
        k = int(np.argmin(np.abs(FREQUENCIES - frequency)))
        square = (2 * np.pi * FREQUENCIES[k]) ** 2

        def amplification(current, k=k, square=square):
            stiffness = device.linearised(current, FREQUENCIES[k]) / mass
            return abs(stiffness / (stiffness - square))

        tried = [amplification(i) for i in np.linspace(0, 3, 301)]
        assert amplification(currents[k]) <= min(tried) * 1.01
    stiffer = reference_building().on(reference_isolators().scaled(force=2))
    nominal = one.best_currents(context_of(one, stiffer), 0)
    assert FREQUENCIES[nominal == 3].max() > 1.3 * FREQUENCIES[currents == 3].max()
    # below the isolators' frequencies stiff, above them soft
    assert currents[FREQUENCIES < 0.3].min() == 3 and currents[FREQUENCIES > 1].max() == 0


def test_a_quiet_ground_leaves_the_coil_alone(isolated):
    one = controller("frequency_tracking", threshold=0.5)
    one.reset(context_of(one, isolated))
    t = np.arange(1500) * 0.02
    slow = [one.current(s, MEASUREMENT(0.3 * np.sin(1.2 * s), 0.0))[0] for s in t]
    assert set(slow) == {0.0}
    loud = [one.current(30 + s, MEASUREMENT(3 * np.sin(1.2 * s), 0.0))[0] for s in t]
    assert loud[-1] == pytest.approx(3.0, abs=1e-3)
