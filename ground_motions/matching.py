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
from ground_motions.spectra import oscillator_response, response_spectrum

_SPACING = 0.04  # of the logarithm of the period: finer than a 5 % damped spectrum can bend
_CHECKS_A_WAVELET = 5  # periods at which the spectrum is matched and checked
_STEPS_A_PERIOD = 40
_TAIL = 5.0  # half length of a wavelet in units of its width: exp(-25) is left there
_NEGLIGIBLE = 4.5  # distance from a wavelet's centre in units of its width: exp(-20)
_NEAR = 0.7  # peaks below this share of the target are left out of the equations
_OWN = 0.9  # share of an oscillator's largest peak above which a peak has a wavelet of its own
_NORM = 8  # of the misfit over the periods: near to the largest, but smooth
_ITERATIONS = 40
# Share of the best factor, and pressure on the periods with the largest misfit. The first try is
# nearly always enough; steps from another start end elsewhere.
_TRIES = ((1.0, 0.0), (1.0, 1.0), (0.8, 0.0), (1.25, 0.0), (0.8, 1.0))
_DAMPING = (0.1, 50.0)  # of the first step, and where no step helps any more
_ACTIVE_SETS = 12


@dataclass(frozen=True, eq=False)
class MatchedRecord:
    """A record matched to a target spectrum, and its changes.

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
        Steps tried.
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
        return _misfit(self.ratio)


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
    of its own oscillator at that oscillator's largest response. The amplitudes follow from damped
    linear equations for all large peaks of all oscillators: the largest peak of each one is to
    reach the target, the others are to stay below it. A step that does not reduce the misfit is
    tried again with more damping. Where this ends outside the tolerance, other factors before the
    wavelets are tried, and more weight on the periods with the largest misfit.
    """
    low = positive("shortest_period (s)", shortest_period)
    high = positive("longest_period (s)", longest_period)
    if low >= high:
        raise InputError("shortest_period (s)", f"{low:g}", f"below longest_period, {high:g}")
    tolerance = within("tolerance (share)", tolerance, 1e-4, 1.0)
    count = max(2, math.ceil(math.log(high / low) / _SPACING) + 1)
    wavelets = _Wavelets(np.geomspace(low, high, _CHECKS_A_WAVELET * (count - 1) + 1))
    target_psa = target.psa(wavelets.periods)
    spectrum = response_spectrum(record, wavelets.periods).psa
    (best_factor,), _ = best_factors(spectrum[None], target_psa, limits)
    tried = []
    for share, emphasis in _TRIES:
        factor = float(np.clip(share * best_factor, *limits))
        scaled = record.scaled(factor)
        start = _with_room(scaled, wavelets)
        motion, ratio, steps = wavelets.match(start, target_psa, tolerance, emphasis)
        tried.append((_misfit(ratio), factor, scaled, motion, ratio, steps))
        if tried[-1][0] <= tolerance:
            break
    misfit, factor, scaled, motion, ratio, _ = min(tried, key=lambda each: each[0])
    iterations = sum(each[-1] for each in tried)
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
            record.file_unit,
        ),
        factor,
        wavelets.periods,
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

    def match(
        self, motion: Record, target: FloatArray, tolerance: float, emphasis: float
    ) -> tuple[Record, FloatArray, int]:
        """Return the matched motion, its spectrum over the target, and the steps tried."""
        ratio = response_spectrum(motion, self.periods).psa / target
        damping, steps = _DAMPING[0], 0
        # some room for whoever samples other periods
        while _misfit(ratio) > 0.9 * tolerance:
            own, at, equations = self._equations(motion, target, emphasis)
            while True:
                if steps == _ITERATIONS or damping > _DAMPING[1]:
                    return motion, ratio, steps
                steps += 1
                amplitudes = equations.solve(damping, 1.0 + 0.5 * tolerance)
                added = self.acceleration(own, at, amplitudes, motion.time)
                tried = Record(motion.acceleration + added, motion.dt, motion.name)
                result = response_spectrum(tried, self.periods).psa / target
                if np.linalg.norm(result - 1.0, _NORM) < np.linalg.norm(ratio - 1.0, _NORM):
                    motion, ratio, damping = tried, result, damping / 3.0
                    break
                damping *= 4.0
        return motion, ratio, steps

    def _equations(
        self, motion: Record, target: FloatArray, emphasis: float
    ) -> tuple[npt.NDArray[np.int64], FloatArray, _Equations]:
        """Oscillators and instants of new wavelets, and equations of their amplitudes."""
        oscillator, sample, response, largest = self._peaks(motion, target)
        at = motion.time[sample]
        whole = (at > self.reach) & (at < motion.duration - self.reach)
        near = np.abs(response) >= _OWN * np.abs(response[largest])[oscillator]
        own = np.flatnonzero(near & whole & (oscillator % _CHECKS_A_WAVELET == 0))
        # each row over its target, turned so that the response is positive
        scale = np.sign(response) / target[oscillator]
        influence = scale[:, None] * self._influence(oscillator, at, oscillator[own], at[own])
        response = response * scale
        is_largest = np.isin(np.arange(len(response)), largest)
        misfit = np.abs(response - 1.0) / np.max(np.abs(response[is_largest] - 1.0))
        weight = np.where(is_largest | (response > 1.0), np.clip(misfit, 0.3, 1.0), 0.3)
        size = np.abs(influence[own, np.arange(len(own))]).mean()
        equations = _Equations(influence, response, is_largest, weight**emphasis, float(size))
        return oscillator[own], at[own], equations

    def _influence(
        self,
        oscillator: npt.NDArray[np.int64],
        time: FloatArray,
        wavelet: npt.NDArray[np.int64],
        peak: FloatArray,
    ) -> FloatArray:
        """Scaled displacement of oscillators at instants under wavelets of amplitude 1, (m, n)."""
        natural = (2.0 * math.pi / self.periods[oscillator])[:, None]
        root = -self.damping * natural + 1j * self.frequency[oscillator, None]
        frequency, width = self.frequency[wavelet], self.width[wavelet]
        after = time[:, None] - (peak - self.lead[wavelet])
        turning = 1j * frequency
        # without the constant of the wavelet, which is a millionth of it
        whole = 0.5 * (
            _convolved(turning, root, width, after) + _convolved(-turning, root, width, after)
        )
        scaled: FloatArray = -(natural**2) / self.frequency[oscillator, None] * whole.imag
        return scaled

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

    def acceleration(
        self,
        oscillator: npt.NDArray[np.int64],
        peak: FloatArray,
        amplitude: FloatArray,
        time: FloatArray,
    ) -> FloatArray:
        """Ground acceleration of the sum of wavelets at increasing times, (n,)."""
        total = np.zeros(len(time))
        centre, reach = peak - self.lead[oscillator], _TAIL * self.width[oscillator]
        first, last = np.searchsorted(time, (centre - reach, centre + reach))
        # the constant ends the velocity at exactly zero, as in the wavelet of Morlet
        mean = np.exp(-((self.frequency * self.width / 2.0) ** 2))
        for k, i in enumerate(oscillator):
            here = slice(first[k], last[k])
            after = time[here] - centre[k]
            taper = np.exp(-((after / self.width[i]) ** 2))
            total[here] += amplitude[k] * (np.cos(self.frequency[i] * after) - mean[i]) * taper
        return total


@dataclass(frozen=True, eq=False)
class _Equations:
    """Linear equations of the peaks, over their targets, in the amplitudes of wavelets."""

    influence: FloatArray
    response: FloatArray
    is_largest: npt.NDArray[np.bool_]
    weight: FloatArray
    size: float

    def solve(self, damping: float, top: float) -> FloatArray:
        """Amplitudes that bring the largest peaks to 1 and keep the others below the top."""
        ridge = damping * self.size * np.eye(self.influence.shape[1])
        lack = np.where(self.is_largest, 1.0, top) - self.response
        held = self.is_largest | (self.response > top)
        for _ in range(_ACTIVE_SETS):
            rows = np.vstack(((self.weight[:, None] * self.influence)[held], ridge))
            right = np.append((self.weight * lack)[held], np.zeros(len(ridge)))
            amplitude: FloatArray = np.linalg.lstsq(rows, right, rcond=None)[0]
            following = self.is_largest | (self.response + self.influence @ amplitude > top)
            if np.array_equal(following, held):
                break
            held = following
        return amplitude


def _convolved(turning: Any, root: Any, width: FloatArray, time: FloatArray) -> Any:
    """Integral of exp(turning s - (s / width)^2 + root (time - s)) over s up to the time."""
    from scipy.special import wofz

    apart, time, width = np.broadcast_arrays(turning - root, time, width)
    begun = apart.real * width / 2.0 < time / width
    result = np.zeros(apart.shape, complex)
    exponent = (root * time)[begun] + (apart[begun] * width[begun] / 2.0) ** 2
    result[begun] = 2.0 * np.exp(exponent)
    # elsewhere nothing has begun, or all is over
    near = np.abs(time) < _NEGLIGIBLE * width
    sign = np.where(begun[near], -1.0, 1.0)
    argument = apart[near] * width[near] / 2.0 - (time / width)[near]
    exponent = (turning * time)[near] - (time / width)[near] ** 2
    result[near] += sign * np.exp(exponent) * wofz(1j * sign * argument)
    return width * math.sqrt(math.pi) / 2.0 * result


def _misfit(ratio: FloatArray) -> float:
    return float(np.max(np.abs(ratio - 1.0)))


def _with_room(record: Record, wavelets: _Wavelets) -> Record:
    """Put quiet ground around a record, at a step that is fine enough for the shortest period."""
    parts = math.ceil(_STEPS_A_PERIOD * record.dt / wavelets.periods[0])
    room = wavelets.reach + wavelets.periods[-1]
    padded = record.padded(before=room, after=room)
    return padded.resampled(record.dt / parts)
