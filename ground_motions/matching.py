"""Spectral matching in the time domain: wavelets are added to a record until it fits a target.

L. Al Atik and N. Abrahamson, "An improved method for nonstationary spectral matching", Earthquake
Spectra 26 (2010) 601-617.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ground_motions.argument_types import checked
from ground_motions.checks import FloatArray, positive, within
from ground_motions.design_spectra import DesignSpectrum
from ground_motions.errors import InputError
from ground_motions.record import Record
from ground_motions.scaling import best_factors
from ground_motions.spectra import oscillator_response, propagator, response_spectrum

_SPACING = 0.04  # of the logarithm of the period: finer than a 5 % damped spectrum can bend
_CHECKS_A_WAVELET = 5  # periods at which the result is checked
_STEPS_A_PERIOD = 40
_TAIL = 5.0  # half length of a wavelet in units of its width: exp(-25) is left there
_NEAR = 0.7  # peaks below this share of the target are left out of the equations
# share of an oscillator's largest peak above which a peak has a wavelet of its own, and share of a
# wavelet's own influence that holds its amplitude; from gentle to strong
_STAGES = ((0.95, 0.1), (0.9, 0.05), (0.85, 0.03), (0.7, 0.03), (0.8, 0.01), (0.6, 0.005))
_ITERATIONS_A_STAGE = 5
_ACTIVE_SETS = 8


@dataclass(frozen=True, eq=False)
class MatchedRecord:
    """A record matched to a target spectrum, and what the matching changed.

    Parameters
    ----------
    record : Record
        The matched motion; longer than the original by quiet ground for the wavelets.
    scale_factor : float
        Factor before the wavelets were added, dimensionless.
    periods : (m,) ndarray
        Periods at which the match was checked, s.
    ratio : (m,) ndarray
        Spectrum of the matched motion over the target there.
    iterations : int
        Passes over all wavelets.
    arias_ratio : float
        Arias intensity over that of the scaled original.
    duration_change : float
        Change of the 5-95 % significant duration, s.
    """

    record: Record
    scale_factor: float
    periods: FloatArray
    ratio: FloatArray
    iterations: int
    arias_ratio: float
    duration_change: float

    @property
    def largest_misfit(self) -> float:
        """Largest distance of ``ratio`` from 1."""
        return float(np.max(np.abs(self.ratio - 1.0)))


@checked
def match_spectrum(
    record: Record,
    target: DesignSpectrum,
    shortest_period: float,
    longest_period: float,
    tolerance: float = 0.05,
    limits: tuple[float, float] = (0.1, 10.0),
) -> MatchedRecord:
    """Add wavelets to a record until its 5 % damped spectrum fits a target.

    Parameters
    ----------
    record : Record
        The motion to begin with.
    target : DesignSpectrum
        Target.
    shortest_period, longest_period : float
        Range of periods to match, s.
    tolerance : float
        Largest accepted distance of the spectrum from the target, as a share of it.
    limits : tuple of float
        Least and largest factor by which the record is scaled first, dimensionless.

    Returns
    -------
    MatchedRecord

    Raises
    ------
    InputError
        If an argument is out of range, or the match does not come within the tolerance.

    Notes
    -----
    The wavelet is the tapered cosine of Al Atik and Abrahamson, whose velocity and displacement
    end at zero, so that the baseline needs no correction. Each one peaks in the response
    of its own oscillator at that oscillator's largest response; the amplitudes follow from the
    linear equations for the responses at all those instants.
    """
    low = positive("shortest_period (s)", shortest_period)
    high = positive("longest_period (s)", longest_period)
    if low >= high:
        raise InputError("shortest_period (s)", f"{low:g}", f"below longest_period, {high:g}")
    tolerance = within("tolerance (share)", tolerance, 1e-4, 1.0)
    count = max(2, math.ceil(math.log(high / low) / _SPACING) + 1)
    wavelets = _Wavelets(np.geomspace(low, high, count))
    checked = np.geomspace(low, high, _CHECKS_A_WAVELET * (count - 1) + 1)
    requested, wanted_at_checks = target.psa(wavelets.periods), target.psa(checked)

    spectrum = response_spectrum(record, wavelets.periods).psa
    (factor,), _ = best_factors(spectrum[None], requested, limits)
    scaled = record.scaled(float(factor))
    motion = _with_room(scaled, wavelets)
    iterations, best = 0, motion
    ratio = response_spectrum(motion, checked).psa / wanted_at_checks
    misfit = float(np.max(np.abs(ratio - 1.0)))
    # as few and as small wavelets as will do; every stage goes on from the best motion so far
    for share, stiffness in _STAGES:
        motion = best
        for _ in range(_ITERATIONS_A_STAGE):
            # some room for whoever samples other periods
            if misfit <= 0.9 * tolerance:
                break
            iterations += 1
            motion = wavelets.corrected(motion, requested, share, stiffness)
            result = response_spectrum(motion, checked).psa / wanted_at_checks
            if np.max(np.abs(result - 1.0)) < misfit:
                misfit, best, ratio = float(np.max(np.abs(result - 1.0))), motion, result
    motion = best
    if misfit > tolerance:
        raise InputError(
            f"match of record {record.name}",
            f"{misfit:.1%} from the target after {iterations} iterations",
            f"{tolerance:.1%}; a record whose own spectrum is nearer, or a narrower range",
        )
    note = f"matched to {target.name} over {low:.3g}-{high:.3g} s by {count} wavelets"
    return MatchedRecord(
        Record(
            motion.acceleration, motion.dt, record.name, f"{scaled.source}; {note}",
            record.unit_as_given,
        ),
        float(factor),
        checked,
        ratio,
        iterations,
        motion.arias_intensity() / scaled.arias_intensity(),
        motion.significant_duration() - scaled.significant_duration(),
    )  # fmt: skip


class _Wavelets:
    """Tapered cosine wavelets, one an oscillator."""

    def __init__(self, periods: FloatArray, damping: float = 0.05) -> None:
        self.periods = periods
        self.damping = damping
        self.frequency = 2.0 * math.pi / periods * math.sqrt(1.0 - damping**2)
        # Al Atik and Abrahamson (2010): width of the taper, and lead of the wavelet's peak
        self.width = 1.178 * periods**0.93
        self.lead = math.atan(math.sqrt(1.0 - damping**2) / damping) / self.frequency

    @property
    def reach(self) -> float:
        """Length of the longest wavelet before or after its peak in the response, s."""
        return float(np.max(_TAIL * self.width + self.lead))

    def corrected(
        self, motion: Record, target: FloatArray, share: float, stiffness: float
    ) -> Record:
        """Return the motion with wavelets that bring the responses nearer to the target."""
        from ground_motions.wavelet_response import responses_at

        oscillator, sample, response, largest = self._peaks(motion, target)
        at = motion.time[sample]
        whole = (at > self.reach) & (at < motion.duration - self.reach)
        near = np.abs(response) >= share * np.abs(response[largest])[oscillator]
        own = np.flatnonzero(near & whole)
        shapes = self._shapes(oscillator[own], motion.time, motion.time[sample[own]])
        first = np.argmax(np.abs(shapes) > 0.0, axis=1)
        propagators = np.array([propagator(p, motion.dt, self.damping) for p in self.periods])
        influence = responses_at(shapes, first, propagators, oscillator, sample)
        # each row over its target, turned so that the response is positive
        scale = np.sign(response) / target[oscillator]
        influence, response = influence * scale[:, None], response * scale
        ridge = stiffness * np.abs(influence[own, np.arange(len(own))]).mean() * np.eye(len(own))
        # the largest peak is to reach the target, the others are to stay below it
        always = np.isin(np.arange(len(response)), largest)
        held = always | (response > 1.0)
        for _ in range(_ACTIVE_SETS):
            rows = np.flatnonzero(held)
            lack = np.concatenate((1.0 - response[rows], np.zeros(len(ridge))))
            amplitude = np.linalg.lstsq(np.vstack((influence[rows], ridge)), lack, rcond=None)[0]
            after = response + influence @ amplitude
            following = always | (after > 1.0)
            if np.array_equal(following, held):
                break
            held = following
        return Record(motion.acceleration + amplitude @ shapes, motion.dt, motion.name)

    def _peaks(self, motion: Record, target: FloatArray) -> tuple[npt.NDArray[Any], ...]:
        """Oscillator, sample and value of every peak near the target; places of the largest."""
        oscillators: list[int] = []
        samples: list[int] = []
        values: list[float] = []
        largest: list[int] = []
        for i, period in enumerate(self.periods):
            history = oscillator_response(motion, period, self.damping).displacement
            history = history * (2.0 * math.pi / period) ** 2
            size = np.abs(history)
            inner = (size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:])
            here = 1 + np.flatnonzero(inner & (size[1:-1] > _NEAR * min(target[i], size.max())))
            largest.append(len(samples) + int(np.argmax(size[here])))
            oscillators += [i] * len(here)
            samples += here.tolist()
            values += history[here].tolist()
        return np.array(oscillators), np.array(samples), np.array(values), np.array(largest)

    def _shapes(
        self, oscillator: npt.NDArray[np.int64], time: FloatArray, peak: FloatArray
    ) -> FloatArray:
        """Ground acceleration of wavelets of amplitude 1, (m, n)."""
        after = time - peak[:, None] + self.lead[oscillator, None]
        reach = np.abs(after) / self.width[oscillator, None]
        taper = np.where(reach < _TAIL, np.exp(-(reach**2)), 0.0)
        # the constant ends the velocity at exactly zero, as in the wavelet of Morlet
        mean = np.exp(-((self.frequency * self.width / 2.0) ** 2))
        return (np.cos(self.frequency[oscillator, None] * after) - mean[oscillator, None]) * taper


def _with_room(record: Record, wavelets: _Wavelets) -> Record:
    """Put quiet ground around a record, at a step that is fine enough for the shortest period."""
    parts = math.ceil(_STEPS_A_PERIOD * record.dt / wavelets.periods[0])
    room = wavelets.reach + wavelets.periods[-1]
    padded = record.padded(before=room, after=room)
    return padded.resampled(record.dt / parts)
