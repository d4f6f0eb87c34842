"""A mixture of random far-field motions and near-fault pulses, to tune and evaluate controllers."""

from __future__ import annotations

import math

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import FloatArray
from ground_motions.errors import InputError
from ground_motions.kanai_tajimi import SOILS, clough_penzien_motion, kanai_tajimi_motion
from ground_motions.near_fault import mavroeidis_papageorgiou_pulse
from ground_motions.record import Record

DURATION = 25.0
"""Length of every motion of a mixture, s, the last 5 s of the far-field motions still."""
_STEP = 0.01
_FAR_FIELD_PGA = (2.5, 4.0)
_BACKGROUND_PGA = (1.0, 2.5)
_PULSE_VELOCITY = (0.3, 0.8)
_MOST_PULSE_PGA = 4.0
"""Limits of the drawn values: m/s^2 and m/s."""
_PULSE_PERIOD = (0.5, 6.0)
_PULSE_CYCLES = (1.2, 2.5)
"""The pulse's period, s, and its length in periods."""


@checked
def motion_mixture(count: int, seed: int = 0) -> tuple[Record, ...]:
    """Draw motions of four kinds in turn, all on the same samples.

    Far field: Clough and Penzien's process, then Kanai and Tajimi's, on any soil, with a peak of
    2.5 to 4 m/s^2. Near fault: the pulse of Mavroeidis and Papageorgiou (the form of a Gabor
    wavelet) with a period of 0.5 to 6 s, any phase and so either sign, a peak velocity of 0.3 to
    0.8 m/s and no more than 4 m/s^2; then such a pulse in a far-field motion of 1 to 2.5 m/s^2, as
    near-fault records look.

    Parameters
    ----------
    count : int
        Number of motions, 1 or more.
    seed : int
        The same seed gives the same motions; those of another count begin alike.

    Returns
    -------
    tuple of Record
        Each ``DURATION`` long, in steps of 0.01 s.

    Raises
    ------
    InputError
        If the count is below 1 or the seed below 0.

    Notes
    -----
    G. P. Mavroeidis and A. S. Papageorgiou, Bulletin of the Seismological Society of America 93
    (2003) 1099-1131: records near a fault as a pulse and a random motion, added.
    """
    for name, value, least in (("count", count, 1), ("seed", seed, 0)):
        if value != int(value) or value < least:
            raise InputError(name, repr(value), f"a whole number, {least} or more")
    kinds = (_far_field, _far_field, _pulse, _pulse_in_noise)
    return tuple(
        kinds[k % len(kinds)](k, np.random.default_rng([seed, k])) for k in range(int(count))
    )


def _far_field(k: int, draw: np.random.Generator) -> Record:
    return _noise(k, draw, _FAR_FIELD_PGA)


def _noise(k: int, draw: np.random.Generator, peaks: tuple[float, float]) -> Record:
    """Random motion of Kanai and Tajimi for 1, 5, 9 and so on, else of Clough and Penzien."""
    make, process = (
        (kanai_tajimi_motion, "Kanai-Tajimi") if k % 4 == 1
        else (clough_penzien_motion, "Clough-Penzien")
    )  # fmt: skip
    soil = str(draw.choice(list(SOILS)))
    pga, seed = draw.uniform(*peaks), int(draw.integers(2**31))
    made = make(soil, DURATION - 5.0, _STEP, seed=seed, pga=pga)
    return _record(made.acceleration, f"{k}: {process}, {soil} soil, {pga:.1f} m/s²", made.source)


def _pulse(k: int, draw: np.random.Generator) -> Record:
    period = math.exp(draw.uniform(*np.log(_PULSE_PERIOD)))
    strongest = _MOST_PULSE_PGA * period / (2 * math.pi)
    velocity = min(draw.uniform(*_PULSE_VELOCITY), strongest)
    cycles, phase = draw.uniform(*_PULSE_CYCLES), draw.uniform(0.0, 2 * math.pi)
    made = mavroeidis_papageorgiou_pulse(velocity, period, cycles, phase, _STEP)
    return _record(
        made.acceleration, f"{k}: pulse, {period:.1f} s, {velocity:.2f} m/s", made.source
    )


def _pulse_in_noise(k: int, draw: np.random.Generator) -> Record:
    pulse, noise = _pulse(k, draw), _noise(k, draw, _BACKGROUND_PGA)
    return _record(
        pulse.acceleration + noise.acceleration, f"{pulse.name}, in noise",
        f"{pulse.source} + {noise.source}",
    )  # fmt: skip


def _record(acceleration: FloatArray, name: str, source: str) -> Record:
    """The motion, followed by rest until the end."""
    whole = np.zeros(round(DURATION / _STEP) + 1)
    whole[: len(acceleration)] = acceleration
    return Record(whole, _STEP, name=name, source=source)
