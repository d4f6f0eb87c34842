"""Noise of constant power between two frequencies."""

from __future__ import annotations

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import FloatArray, exactly_one, positive, sample_count, within
from ground_motions.errors import InputError
from ground_motions.record import Record
from ground_motions.synthesis import call_text, frequencies, random_phases


@checked
def band_limited_series(
    low_hz: float,
    high_hz: float,
    duration: float,
    dt: float,
    *,
    rms: float | None = None,
    peak: float | None = None,
    seed: int,
    taper: float = 0.05,
) -> FloatArray:
    """Return band-limited white noise of any quantity, for example a displacement command.

    Parameters
    ----------
    low_hz, high_hz : float
        Edges of the band, Hz, both included. The mean is zero even where ``low_hz`` is 0.
    duration : float
        Length, s; rounded up to a whole number of steps.
    dt : float
        Sampling step, s.
    rms : float, optional
        Root mean square of the series, reached exactly, in its own unit. Give this or ``peak``.
    peak : float, optional
        Largest absolute value, reached exactly, in the same unit.
    seed : int
        Seed of NumPy's default generator.
    taper : float
        Share of the duration, at each end, over which a half cosine brings the series to zero,
        0 to 0.5. With 0 the band is exact to the last bit; a taper smears its edges by about
        1 / (taper * duration) Hz.

    Returns
    -------
    (n,) ndarray
        The series, in the unit of ``rms`` or ``peak``.

    Raises
    ------
    InputError
        If the band is empty, in the wrong order, above the Nyquist frequency or too narrow for
        the duration; or another argument is out of range.

    Examples
    --------
    The random displacement tests of an MR-elastomer isolator (Yu et al.: 1 to 10 Hz, 4 mm at
    most, 5 s at 256 Hz):

    >>> command = band_limited_series(1.0, 10.0, 5.0, 1 / 256, peak=4.0, seed=1)  # mm
    >>> len(command)
    1281
    """
    low_hz = within("low_hz (Hz)", low_hz, 0.0, np.inf)
    high_hz = positive("high_hz (Hz)", high_hz)
    count = sample_count(duration, dt)
    taper = within("taper (share)", taper, 0.0, 0.5)
    measure, size = exactly_one(rms=rms, peak=peak)
    if low_hz >= high_hz:
        raise InputError(
            "low_hz and high_hz (Hz)", f"{low_hz:g} and {high_hz:g}", "low_hz < high_hz"
        )
    nyquist = 0.5 / dt
    if high_hz > nyquist:
        raise InputError(
            "high_hz (Hz)", f"{high_hz:g}", f"at most the Nyquist frequency, {nyquist:g} Hz"
        )
    frequency = frequencies(count, dt)
    edge = 1e-9 * frequency[1]
    psd = ((frequency >= low_hz - edge) & (frequency <= high_hz + edge)).astype(np.float64)
    series = random_phases(psd, count, dt, seed) * _taper(count, taper)
    present = float(np.sqrt(np.mean(series**2)) if measure == "rms" else np.max(np.abs(series)))
    if present == 0.0:
        raise InputError(
            "low_hz and high_hz (Hz)",
            f"{low_hz:g} and {high_hz:g} over {count * dt:g} s",
            f"a band with a multiple of {frequency[1]:g} Hz in it, above 0 and below Nyquist",
        )
    return series / present * size


@checked
def band_limited_noise(
    low_hz: float,
    high_hz: float,
    duration: float,
    dt: float = 0.01,
    *,
    rms: float | None = None,
    pga: float | None = None,
    seed: int,
    taper: float = 0.05,
) -> Record:
    """Return band-limited white noise as ground acceleration.

    Parameters
    ----------
    low_hz, high_hz : float
        Edges of the band, Hz, both included.
    duration : float
        Length, s; rounded up to a whole number of steps.
    dt : float
        Sampling step, s.
    rms : float, optional
        Root mean square of the acceleration, m/s2, reached exactly. Give this or ``pga``.
    pga : float, optional
        Peak ground acceleration, m/s2, reached exactly.
    seed : int
        Seed of NumPy's default generator.
    taper : float
        Share of the duration tapered at each end; see `band_limited_series`.

    Returns
    -------
    Record
        The motion; its ``source`` states every argument.

    Raises
    ------
    InputError
        As `band_limited_series`.

    Examples
    --------
    The band of Li and Li's 60 s random shake-table input, 0 to 20 Hz, and that of Yu et al., 1 to
    10 Hz:

    >>> wide = band_limited_noise(0.0, 20.0, 60.0, rms=1.0, seed=1)
    >>> narrow = band_limited_noise(1.0, 10.0, 5.0, 1 / 256, pga=2.0, seed=2)
    """
    measure, size = exactly_one(rms=rms, pga=pga)
    series = band_limited_series(
        low_hz, high_hz, duration, dt, rms=rms, peak=pga, seed=seed, taper=taper
    )
    return Record(
        series,
        dt,
        name=f"band_limited_{low_hz:g}_{high_hz:g}_Hz_seed_{seed}",
        source=call_text(
            "band_limited_noise", low_hz=low_hz, high_hz=high_hz, duration=duration, dt=dt,
            **{measure: size}, seed=seed, taper=taper,
        ),
    )  # fmt: skip


def _taper(count: int, share: float) -> FloatArray:
    """Return a window of ones that half cosines bring to zero at both ends, shape (count,)."""
    if share == 0.0:
        return np.ones(count)
    position = np.arange(count) / (count - 1)
    from_end = np.minimum(position, 1.0 - position)
    window: FloatArray = 0.5 * (1.0 - np.cos(np.pi * np.minimum(from_end / share, 1.0)))
    return window
