"""The noise of a building record, from the record itself.

Two noises are told apart: each sensor's own, and what the noise of the measured ground motion does
to the simulation that is driven by it. The size of the first is seen above the building's band,
where the simulation misses nothing else; its colour in the quiet parts of the record, where it is
what each channel shows apart from all others. The second is shared by all channels and lives around
the building's modes; it is simulated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...identification.measured.noise import noise_beside_steps
from ...structures import IsolatedStructure
from ..decisions import LEAST_SENSOR_NOISE, MOST_COLOUR, MOST_CURRENT_NOISE
from .model import BuildingModel
from .record import BuildingRecord
from .record_filter import RecordFilter

_WINDOW = 0.5
"""s: over which the noise's size is taken, so that neither shaking nor impacts count for all."""
_DRAWS, _SMOOTHING = 32, 4
_SPAN = 4.0
"""s: over which the colour of noise is taken, so that slow noise is seen and quiet parts are told
from others."""
_FEWEST = 8
"""Windows without which a record has no quiet parts."""
_SLOWEST = 0.02
"""Hz: down to which slower noise is extrapolated."""
_OWN_COLOUR = 4.0
"""Standard deviations by which the noise of one sensor stands out."""
_FEWEST_SLOW = 4
"""Slow frequencies of a record without which nothing is known of slow noise."""
_RIGID = 0.25
"""Hz: below which all floors of an isolated building move alike."""
_INDEPENDENT = 0.5
"""Independent ones among the Fourier coefficients of Hann windows that overlap by half. Theory."""


class Colour(NamedTuple):
    """Noise in the building's band over white noise that has its size above the band."""

    frequencies: NDArray  # (n_octaves,), Hz, increasing: Centres of octaves
    factors: NDArray  # (n_octaves, n_channels): Standard deviation over that of white noise
    band: float  # Highest frequency in the band, Hz
    # (n_channels,): Frequency below which flicker noise exceeds white noise, Hz; 0 where not seen
    corners: NDArray
    most: NDArray  # (n_channels,): Largest factor that instruments may have

    @property
    def plateau(self) -> NDArray:
        """Factors of the white part of the noise, (n_channels,)."""
        factors = self.factors[1:] if len(self.factors) > 1 else self.factors
        return np.median(factors, axis=0) if len(factors) else np.ones(factors.shape[1])

    def at(self, frequencies: NDArray) -> NDArray:
        """Factors at other frequencies, (n_frequencies, n_channels)."""
        if not len(self.frequencies):
            return np.ones((len(frequencies), self.factors.shape[1]))
        logs, known = np.log(np.maximum(frequencies, _SLOWEST)), np.log(self.frequencies)
        between = np.transpose([np.interp(logs, known, one) for one in self.factors.T])
        # slower noise flickers: its power beside that of white noise goes with one over frequency
        white = self.plateau
        flicker = np.maximum((self.factors[0] / white) ** 2 - 1, 0.0)
        slower = np.exp(np.maximum(known[0] - logs, 0.0))[:, np.newaxis]
        inside = between * np.sqrt((1 + flicker * slower) / (1 + flicker))
        flickering = white * np.sqrt(1 + self.corners / np.exp(logs)[:, np.newaxis])
        seen = (slower > 1) & (self.corners > 0)
        inside = np.where(seen, np.maximum(inside, flickering), inside)
        inside = np.minimum(inside, self.most)
        return np.where(frequencies[:, np.newaxis] > self.band, 1.0, inside)


@dataclass(frozen=True, eq=False)
class NoiseFloor:
    """Noise of one record."""

    # (n_channels,): Standard deviation of white noise as each channel's is above the band, in its
    # unit
    sensors: NDArray
    colour: Colour  # Of the channels' noise in the band
    own: NDArray  # (n_channels,): RMS of each channel's noise, in its unit
    # (n_directions,): Standard deviation of the noise of the measured ground motion, m/s^2
    ground: NDArray
    total: NDArray  # (n_channels,): RMS that both leave in a channel's residual, in its unit
    band: float  # Highest frequency that is compared, Hz
    # (n_draws, n, n_channels): What noise of ground and current does to the simulation, simulated
    draws: NDArray
    # (n_draws, n, n_channels): Residuals of noise alone; as far off the weights as the noise's
    # estimate may be
    examples: NDArray

    def sensor_noise(self, frequencies: NDArray) -> NDArray:
        """Noise of each channel by frequency, (n_frequencies, n_channels), as ``sensors``."""
        return self.sensors * self.colour.at(frequencies)


def highest_frequency(isolated: IsolatedStructure, dt: float) -> float:
    """Upper end of the band in which building and simulation are compared, Hz."""
    # Half as much again as the highest natural frequency, and at most 0.6 of the Nyquist frequency,
    # so that noise can be seen above it.
    current = 0.0
    if isolated.n_channels:
        low, high = isolated.current_range()
        current = float(np.clip(0.0, low, high))
    linear = isolated.linearised(current)
    squares = np.linalg.eigvals(np.linalg.solve(linear.mass, linear.stiffness)).real
    return float(min(1.5 * np.sqrt(squares.max()) / (2 * np.pi), 0.6 * 0.5 / dt))


def white_noise(
    values: NDArray, dt: float, band: float, quantile: float, passed: RecordFilter | None = None
) -> NDArray:
    """Standard deviation of the white noise in signals (n, n_channels), from above a band (Hz).

    It is that before a filter that the signals passed.
    """
    # ``quantile`` chooses among windows of half a second: 0.5 for the median, which impacts do not
    # move; less if the signal fills most of the time.
    size = _window_quantile(values, dt, band, quantile)
    return size / _of_unit_noise(len(values), dt, band, quantile, passed)


def _window_quantile(values: NDArray, dt: float, band: float, quantile: float) -> NDArray:
    # the mean slope between the ends would leak into all frequencies
    ramp = np.linspace(0.0, 1.0, len(values))[:, np.newaxis]
    flat = values - values[0] - (values[-1] - values[0]) * ramp
    spectrum = np.fft.rfft(flat, axis=0)
    spectrum[np.fft.rfftfreq(len(values), dt) < band] = 0.0
    fast = np.fft.irfft(spectrum, len(values), axis=0)
    per_window = max(round(_WINDOW / dt), 8)
    windows = len(values) // per_window
    squares = (fast[: windows * per_window] ** 2).reshape(windows, per_window, -1).mean(axis=1)
    return np.sqrt(np.quantile(squares, quantile, axis=0))


@lru_cache(maxsize=32)
def _of_unit_noise(
    n: int, dt: float, band: float, quantile: float, passed: RecordFilter | None = None
) -> NDArray:
    """The quantile of white noise of unit variance, (1,), behind a filter."""
    white = np.random.default_rng(0).standard_normal((n, 1))
    if passed:
        white = passed.apply(white, dt)
    return _window_quantile(white, dt, band, quantile)


def noise_floor(model: BuildingModel, record: BuildingRecord) -> NoiseFloor:
    """Estimate the noise of a record."""
    dt, measured = record.dt, record.values
    band = highest_frequency(model.nominal, dt)
    predicted = model.predict(record)
    is_finite = np.isfinite(predicted).all()
    residual = measured - predicted if is_finite else measured
    least = LEAST_SENSOR_NOISE * np.sqrt(np.mean(measured**2, axis=0))
    # where the simulation misses more up there than it explains, the signal itself is no worse
    sensors = np.minimum(
        *(white_noise(one, dt, band, 0.5, record.filter) for one in (residual, measured))
    )
    sensors = np.maximum(sensors, least)
    displacements = np.array([one.is_displacement for one in record.sensors])
    quiet = _quiet_windows((predicted if is_finite else measured) / sensors, dt, band)

    together = [
        [k for k, one in enumerate(record.sensors) if one.axis == axis and not one.is_displacement]
        for axis in record.axes
    ]
    most_colour = MOST_COLOUR * _fall(residual, dt, band, displacements)

    def colour_of(noise: NDArray) -> Colour:
        colour = _colour(noise / sensors, dt, band, quiet, displacements, most_colour)
        corner = _flicker_corner(noise, sensors * colour.plateau, dt, together)
        return colour._replace(corners=np.where(displacements, 0.0, corner))

    colour = colour_of(residual)
    shaking = np.column_stack([motion.acceleration for motion in record.ground])
    of_motion = record.filter if record.filter and record.filter.ground else None
    most = white_noise(shaking, dt, band, 0.1, of_motion)
    # accelerometers of the ground are as most of the building
    of_ground = colour._replace(
        factors=colour.factors[:, ~displacements].min(axis=1, keepdims=True),
        corners=colour.corners[~displacements][:1],
        most=colour.most[~displacements][:1],
    )
    draws = _simulated_noise(model, record, most, of_ground, predicted)
    by_current = np.zeros_like(draws)
    if uncertain := _current_noise(record, band):
        by_current = _simulated_noise(model, record, 0 * most, of_ground, predicted, uncertain)
    at = np.arange(int(band * dt * len(measured))) / (dt * len(measured))
    own_noise = sensors * colour.at(at)
    felt = _felt(draws, own_noise, len(most))
    share = float(_ground_shares(residual[np.newaxis], own_noise, felt)[0])
    # the response to so little noise is linear, so that sums of runs are as good as further runs
    mixing = np.random.default_rng(2).standard_normal((_DRAWS, _DRAWS)) / np.sqrt(_DRAWS)
    shaken, switched = (
        np.einsum("ed,dnc->enc", mixing, one) for one in (share * draws, by_current)
    )
    own = _sensor_examples(shaken + switched, sensors, colour, dt, band, colour_of)
    # and so would the ground's noise
    guesses = np.maximum(_ground_shares(own - shaken, own_noise, felt), share / 2)
    examples = own - shaken * (share / guesses)[:, np.newaxis, np.newaxis] - switched
    ground, draws = share * most, share * draws + by_current
    every = sensors * colour.at(np.fft.rfftfreq(len(measured), dt))
    own_rms = np.sqrt(np.mean(every**2, axis=0))
    total = np.hypot(own_rms, np.sqrt(np.mean(draws**2, axis=(0, 1))))
    return NoiseFloor(sensors, colour, own_rms, ground, total, band, draws, examples)


def _sensor_examples(
    beside: NDArray, sensors: NDArray, colour: Colour, dt: float, band: float,
    colour_of: Callable[[NDArray], Colour],
) -> NDArray:  # fmt: skip
    """Examples of the sensors' noise, of the size and colour that would be estimated from each.

    ``beside``: other errors of each example, (n_examples, n_samples, n_channels).
    """
    own = np.empty_like(beside)
    for k in range(len(own)):
        white = np.random.default_rng(k).standard_normal(own[k].shape)
        own[k] = _coloured(white, dt, colour)
        own[k] *= sensors / white_noise(own[k], dt, band, 0.5)
        # from this example the colour would have been estimated differently
        guess = colour_of(own[k] - beside[k])
        likely = colour.corners / np.clip(
            guess.corners / np.maximum(colour.corners, 1e-9), 0.5, 2.0
        )
        own[k] = _coloured(
            own[k], dt, colour._replace(factors=colour.factors / guess.factors, corners=likely)
        )
    return own


def _windows(values: NDArray, dt: float, n: int | None = None) -> NDArray:
    """Fourier coefficients of windows in time, (n_windows, n_frequencies, n_channels).

    Those of white noise of unit variance have unit mean square. ``n`` are the samples of a window.
    """
    n = _per_window(len(values), dt) if n is None else n
    shape = np.hanning(n + 1)[:n, np.newaxis]
    parts = np.array([values[a : a + n] for a in range(0, len(values) - n + 1, max(n // 2, 1))])
    # neither an offset nor a drift is noise
    line = np.linalg.qr(np.column_stack([np.ones(n), np.linspace(-1, 1, n)]))[0]
    parts = parts - line @ (line.T @ parts)
    return np.fft.rfft(shape * parts, axis=1) / np.linalg.norm(shape)


def _octaves(n_frequencies: int) -> list[slice]:
    """Octaves among the frequencies of a window up to a band's end, from above."""
    edges = [n_frequencies]
    while edges[-1] // 2 >= 2:
        edges.append(edges[-1] // 2)
    return [slice(low, high) for high, low in pairwise(edges)]


def _per_window(n_samples: int, dt: float) -> int:
    """Samples of a window."""
    return min(round(_SPAN / dt), n_samples)


def _n_frequencies(n_samples: int, dt: float, band: float) -> int:
    """Frequencies of a window up to a band's end."""
    return int(band * dt * _per_window(n_samples, dt)) + 1


def _quiet_windows(predicted: NDArray, dt: float, band: float) -> list[NDArray]:
    """The half of the windows in which a simulation has the least motion, for each octave."""
    power = (np.abs(_windows(predicted, dt)) ** 2).sum(axis=2)
    n = -(-len(power) // 2)
    octaves = _octaves(_n_frequencies(len(predicted), dt, band))
    return [np.argsort(power[:, one].sum(axis=1))[:n] for one in octaves]


def _fall(residual: NDArray, dt: float, band: float, displacements: NDArray) -> NDArray:
    """Noise just above the band over that far above it, (n_channels,), at least 1.

    A logger's filter that begins to act near the band lets more noise into it than above it.
    """
    edges = band, (band + 0.5 / dt) / 2
    found, white = (
        [quantile(edge) ** 2 for edge in edges]
        for quantile in (
            lambda edge: _window_quantile(residual, dt, edge, 0.5),
            lambda edge: _of_unit_noise(len(residual), dt, edge, 0.5),
        )
    )
    near, far = (found[0] - found[1]) / (white[0] - white[1]), found[1] / white[1]
    ratios = np.sqrt(np.maximum(near, 0.0) / np.maximum(far, 1e-300))
    # sensors of a kind are alike
    for kind in (displacements, ~displacements):
        if kind.any():
            ratios[kind] = np.median(ratios[kind])
    return np.maximum(ratios, 1.0)


def _colour(
    residual: NDArray, dt: float, band: float, quiet: Sequence[NDArray], displacements: NDArray,
    most: NDArray,
) -> Colour:  # fmt: skip
    """Noise in the band from residuals over its size above the band."""
    # What the simulation misses, and the noise of the ground, show in several channels together.
    # A channel's noise is what no sum of the others predicts. Sensors of a kind are alike.
    shown, n_channels = _windows(residual, dt), residual.shape[1]
    octaves = _octaves(_n_frequencies(len(residual), dt, band))
    centres, factors = [], []
    for one, windows in zip(octaves, quiet, strict=True):
        cells = shown[windows, one].reshape(-1, n_channels)
        independent = _INDEPENDENT * len(cells)
        if len(shown) < _FEWEST or independent < 2 * n_channels:
            break
        together = cells.T @ cells.conj() / len(cells) + 1e-9 * np.eye(n_channels)
        alone = 1 / np.diag(np.linalg.inv(together)).real
        # the others follow some of any noise
        free = independent - n_channels + 1
        alone *= independent / free
        sizes = np.empty(n_channels)
        for kind in (displacements, ~displacements):
            if kind.any():
                # no more than stands out from chance
                chance = 1 + 2 / np.sqrt(free * kind.sum())
                sizes[kind] = np.sqrt(np.median(alone[kind]) / chance)
        # a sensor of another colour than those of its kind stands out from chance alone
        sizes = np.maximum(sizes, np.sqrt(alone / (1 + _OWN_COLOUR / np.sqrt(free))))
        centres.append(np.sqrt(one.start * one.stop) / (dt * _per_window(len(residual), dt)))
        factors.append(np.clip(sizes, 1.0, most))
    return Colour(
        np.array(centres[::-1]), np.array(factors[::-1]).reshape(-1, n_channels), band,
        np.zeros(n_channels), most,
    )  # fmt: skip


def _flicker_corner(
    residual: NDArray, white: NDArray, dt: float, together: Sequence[Sequence[int]]
) -> float:
    """Frequency below which accelerometers flicker, Hz, from what those that move alike differ by.

    ``white`` is their white noise. Of the pairs those count that one faulty sensor is not in.
    """
    shown = _windows(residual, dt, len(residual))[0]
    at = np.arange(len(shown)) / (dt * len(residual))
    slow = (at >= 2 / (dt * len(residual))) & (at <= _RIGID)
    corners = []
    for group in together:
        n = len(group)
        if n < 3 or slow.sum() < _FEWEST_SLOW:
            continue
        each = []
        for i, j in combinations(group, 2):
            power = np.abs(shown[slow, i] - shown[slow, j]) ** 2 / (white[i] ** 2 + white[j] ** 2)
            each.append(_corner(power, at[slow]))
        corners.append(np.quantile(each, (n - 2) / (2 * n)))
    return float(np.median(corners)) if corners else 0.0


def _corner(power: NDArray, frequencies: NDArray) -> float:
    """Corner with which powers over those of white noise are those of flicker and white noise."""
    low, high = 0.0, MOST_COLOUR**2 * _RIGID
    for _ in range(20):
        middle = (low + high) / 2
        above = np.mean(power / (1 + middle / frequencies)) > 1
        low, high = (middle, high) if above else (low, middle)
    return low


def _coloured(white: NDArray, dt: float, colour: Colour) -> NDArray:
    """Noise of a colour from white noise, (n, n_channels)."""
    factors = colour.at(np.fft.rfftfreq(len(white), dt))
    return np.fft.irfft(factors * np.fft.rfft(white, axis=0), len(white), axis=0)


def _current_noise(record: BuildingRecord, band: float) -> float:
    """Standard deviation of the noise of a recorded current, A; 0 where changes may hide it."""
    if record.current is None or record.current_steps:
        return 0.0
    size = float(white_noise(record.current[:, np.newaxis], record.dt, band, 0.1)[0])
    size = min(size, noise_beside_steps(record.current))  # ramps are none
    return size if size <= MOST_CURRENT_NOISE * np.ptp(record.current) else 0.0


def _simulated_noise(
    model: BuildingModel,
    record: BuildingRecord,
    sizes: NDArray,
    colour: Colour,
    predicted: NDArray,
    of_current: float = 0.0,
) -> NDArray:
    """Errors of the simulation by noise of its inputs' sensors, (n_draws, n, n_channels)."""
    random = np.random.default_rng(1)
    draws = []
    if not np.isfinite(predicted).all():
        return np.zeros((_DRAWS, *predicted.shape))
    for _ in range(_DRAWS):
        shaken = []
        for motion, size in zip(record.ground, sizes, strict=True):
            noise = size * random.standard_normal((len(record), 1))
            noise = _coloured(noise, record.dt, colour)[:, 0]
            shaken.append(replace(motion, acceleration=motion.acceleration + noise))
        driven = record
        if of_current and record.current is not None:
            noise = of_current * random.standard_normal(len(record))
            driven = replace(record, current=record.current + noise)
        draws.append(model.predict(driven, shaken) - predicted)
    return np.nan_to_num(np.array(draws))


def _felt(draws: NDArray, noise: NDArray, n_directions: int) -> tuple[NDArray, NDArray]:
    """Size and proportions of the errors in the channels by noise of the ground's sensors."""
    # Variance over that of the channels' own noise, (n_frequencies, n_directions), and the unit
    # vectors of it, (n_frequencies, n_channels, n_directions).
    felt = spectra(draws, len(noise)) / noise
    vectors = np.linalg.eigh(covariance(felt))[1][:, :, -n_directions:]
    # not smoothed: beside a peak it would be too much, and the noise found too little
    along = np.einsum("fic,dfi->dfc", vectors.conj(), felt)
    return np.mean(np.abs(along) ** 2, axis=0) / 2, vectors


def _ground_shares(residuals: NDArray, noise: NDArray, felt: tuple[NDArray, NDArray]) -> NDArray:
    """Noise of the ground's sensors over its upper limits, from the part that channels share."""
    # Strong shaking is never without fast motion, so that what lies above the band bounds the noise
    # of the ground's sensor but seldom is it. The residual's part along what such noise does to the
    # channels tells more; the median over frequencies leaves out where something else is wrong.
    variance, vectors = felt
    used = variance > 1.0
    if used.sum() < 16:
        return np.ones(len(residuals))
    spectrum = spectra(residuals, len(variance)) / noise
    along = np.einsum("fcd,rfc->rfd", vectors.conj(), spectrum)
    result, variance = np.abs(along[:, used]) ** 2, variance[used]
    low, high = np.zeros(len(residuals)), np.ones(len(residuals))
    for _ in range(30):
        middle = (low + high) / 2
        # half of what is distributed exponentially with mean 2 lies below 2 ln 2
        medians = np.median(result / (1 + middle[:, np.newaxis] * variance), axis=1)
        more = medians > 2 * np.log(2)
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    return np.sqrt(high)


def spectra(values: NDArray, n_frequencies: int) -> NDArray:
    """First Fourier coefficients of signals (n_signals, n, n_channels), scaled to white noise."""
    # Real and imaginary parts have the variance of white noise.
    n = values.shape[1]
    result = np.fft.rfft(values, axis=1)[:, :n_frequencies] / np.sqrt(n / 2)
    result[:, 0] /= np.sqrt(2)
    return result


def covariance(examples: NDArray) -> NDArray:
    """Smoothed covariance of the channels, (n_frequencies, n_channels, n_channels)."""
    products = np.einsum("dfi,dfj->fij", examples, examples.conj())
    return smooth_spectrum(products / (2 * len(examples)))


def smooth_spectrum(products: NDArray) -> NDArray:
    """Mean over neighbouring frequencies; fewer at the ends, always as many on either side."""
    n = len(products)
    total = np.concatenate([np.zeros_like(products[:1]), np.cumsum(products, axis=0)])
    reach = np.minimum(_SMOOTHING, np.minimum(np.arange(n), n - 1 - np.arange(n)))
    low, high = np.arange(n) - reach, np.arange(n) + reach + 1
    return (total[high] - total[low]) / (high - low).reshape(-1, *[1] * (products.ndim - 1))
