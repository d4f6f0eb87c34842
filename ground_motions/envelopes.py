"""Envelopes that give random motion the rise and decay of an earthquake."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import FloatArray, number, positive, within
from ground_motions.errors import InputError


class Envelope(Protocol):
    """A function of time between 0 and 1 whose repr states its parameters."""

    def __call__(self, time: FloatArray) -> FloatArray:
        """Return the envelope.

        Parameters
        ----------
        time : (n,) ndarray
            Time, s.

        Returns
        -------
        (n,) ndarray
            Envelope, dimensionless, 0 to 1.
        """
        ...


def _require_order(**times: float) -> None:
    names = list(times)
    values = [number(f"{name} (s)", value, "a finite number") for name, value in times.items()]
    if any(later < earlier for earlier, later in itertools.pairwise(values)):
        raise InputError(
            " and ".join(names) + " (s)",
            " and ".join(f"{value:g}" for value in values),
            " <= ".join(names),
        )


@checked
@dataclass(frozen=True)
class Trapezoid:
    """Straight rise, plateau, straight decay to zero.

    Parameters
    ----------
    rise_end : float
        Time at which the plateau begins, s.
    decay_start : float
        Time at which it ends, s.
    end : float
        Time at which the motion ends, s.

    Notes
    -----
    S. Hou, Earthquake simulation models and their applications, MIT report R68-17, 1968.
    """

    rise_end: float
    decay_start: float
    end: float

    def __post_init__(self) -> None:
        positive("rise_end (s)", self.rise_end)
        _require_order(rise_end=self.rise_end, decay_start=self.decay_start, end=self.end)

    def __call__(self, time: FloatArray) -> FloatArray:
        """Return the envelope at times in s; see `Envelope`."""
        return np.interp(
            time, [0.0, self.rise_end, self.decay_start, self.end], [0.0, 1.0, 1.0, 0.0]
        )


@checked
@dataclass(frozen=True)
class AminAng:
    """Parabolic rise, plateau, exponential decay.

    Parameters
    ----------
    rise_end : float
        Time at which the plateau begins, s.
    decay_start : float
        Time at which it ends, s.
    decay_rate : float
        Rate of the decay, 1/s.

    Notes
    -----
    M. Amin and A. H. S. Ang, Journal of the Engineering Mechanics Division ASCE 94 (1968) 559-584;
    P. C. Jennings, G. W. Housner and N. C. Tsai, Simulated earthquake motions, California
    Institute of Technology, 1968, use the same three parts.
    """

    rise_end: float
    decay_start: float
    decay_rate: float

    def __post_init__(self) -> None:
        positive("rise_end (s)", self.rise_end)
        positive("decay_rate (1/s)", self.decay_rate)
        _require_order(rise_end=self.rise_end, decay_start=self.decay_start)

    def __call__(self, time: FloatArray) -> FloatArray:
        """Return the envelope at times in s; see `Envelope`."""
        rise = np.clip(time / self.rise_end, 0.0, 1.0) ** 2
        decay = np.exp(-self.decay_rate * np.maximum(time - self.decay_start, 0.0))
        envelope: FloatArray = rise * decay
        return envelope


JENNINGS_HOUSNER_A = AminAng(rise_end=4.0, decay_start=35.0, decay_rate=0.0357)
"""Jennings, Housner and Tsai's type A (magnitude 8 or more), without its last, parabolic part."""

JENNINGS_HOUSNER_B = AminAng(rise_end=4.0, decay_start=15.0, decay_rate=0.0992)
"""Their type B (magnitude about 7, as El Centro 1940), without its last, parabolic part."""


@checked
@dataclass(frozen=True)
class SaragoniHart:
    """Gamma function: a smooth rise to 1 and a longer decay.

    Parameters
    ----------
    end : float
        Time at which the envelope has come down to ``final``, s.
    peak_share : float
        Time of the peak as a share of ``end``, above 0 and below 1.
    final : float
        Envelope at ``end``, above 0 and below 1.

    Notes
    -----
    G. R. Saragoni and G. C. Hart, Earthquake Engineering and Structural Dynamics 2 (1974) 249-267,
    with the parameters of D. M. Boore, Bulletin of the Seismological Society of America 73 (1983)
    1865-1894: peak at 0.2, final 0.05.
    """

    end: float
    peak_share: float = 0.2
    final: float = 0.05

    def __post_init__(self) -> None:
        positive("end (s)", self.end)
        for name in ("peak_share", "final"):
            positive(name, getattr(self, name))
            within(name, getattr(self, name), 0.0, 1.0, open_high=True)

    def __call__(self, time: FloatArray) -> FloatArray:
        """Return the envelope at times in s; see `Envelope`."""
        share = self.peak_share
        power = -share * math.log(self.final) / (1.0 + share * (math.log(share) - 1.0))
        # In units of the time of the peak, (s exp(1 - s))^power: 1 at the peak, for any power.
        s = np.maximum(time, 0.0) / (share * self.end)
        envelope: FloatArray = (s * np.exp(1.0 - s)) ** power
        return envelope
