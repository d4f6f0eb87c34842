"""Filtered white noise: the spectra of Kanai and Tajimi and of Clough and Penzien."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple, dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from ground_motions.argument_types import checked
from ground_motions.checks import FloatArray, choice, exactly_one, positive, sample_count
from ground_motions.envelopes import JENNINGS_HOUSNER_B, Envelope
from ground_motions.errors import InputError
from ground_motions.record import Record
from ground_motions.synthesis import call_text, frequencies, random_phases


@checked
@dataclass(frozen=True)
class Soil:
    """Parameters of the ground filter and of the filter that takes out low frequencies.

    Parameters
    ----------
    ground_frequency : float
        Circular frequency of the ground, rad/s.
    ground_damping : float
        Damping ratio of the ground.
    low_frequency : float
        Circular frequency of the second filter (Clough-Penzien only), rad/s.
    low_damping : float
        Its damping ratio.

    Raises
    ------
    InputError
        If a parameter is not a finite number above 0.
    """

    ground_frequency: float
    ground_damping: float
    low_frequency: float
    low_damping: float

    def __post_init__(self) -> None:
        for name, value in zip(self.__dataclass_fields__, astuple(self), strict=True):
            positive(name, value)


SOILS = MappingProxyType(
    {
        "firm": Soil(15.0, 0.6, 1.5, 0.6),
        "medium": Soil(10.0, 0.4, 1.0, 0.6),
        "soft": Soil(5.0, 0.2, 0.5, 0.6),
    }
)
"""Soils of A. Der Kiureghian and A. Neuenhofer, Earthquake Engineering and Structural Dynamics 21
(1992) 713-740."""


@checked
def kanai_tajimi_psd(frequency: npt.ArrayLike, soil: Soil, intensity: float = 1.0) -> FloatArray:
    """Return the Kanai-Tajimi power spectral density of ground acceleration.

    Parameters
    ----------
    frequency : (n,) array_like
        Frequency, Hz.
    soil : Soil
        Ground filter.
    intensity : float
        One-sided density of the white noise at bedrock, (m/s2)^2/Hz. The two-sided S0 of the
        literature, m2/s3 over the circular frequency, is this divided by 4 pi.

    Returns
    -------
    (n,) ndarray
        One-sided density, (m/s2)^2/Hz; equals ``intensity`` at 0 Hz.

    Notes
    -----
    K. Kanai, Bulletin of the Earthquake Research Institute Tokyo 35 (1957) 309-325; H. Tajimi,
    Proceedings of the 2nd World Conference on Earthquake Engineering, 1960, 781-798.
    """
    squared = (2.0 * np.pi * np.asarray(frequency, dtype=np.float64) / soil.ground_frequency) ** 2
    damping = 4.0 * soil.ground_damping**2 * squared
    psd: FloatArray = intensity * (1.0 + damping) / ((1.0 - squared) ** 2 + damping)
    return psd


@checked
def clough_penzien_psd(frequency: npt.ArrayLike, soil: Soil, intensity: float = 1.0) -> FloatArray:
    """Return the Clough-Penzien power spectral density of ground acceleration.

    Kanai and Tajimi's density with a second filter, so that velocity and displacement stay finite.

    Parameters
    ----------
    frequency : (n,) array_like
        Frequency, Hz.
    soil : Soil
        Both filters.
    intensity : float
        One-sided density of the white noise at bedrock, (m/s2)^2/Hz.

    Returns
    -------
    (n,) ndarray
        One-sided density, (m/s2)^2/Hz; zero at 0 Hz.

    Notes
    -----
    R. W. Clough and J. Penzien, Dynamics of Structures, McGraw-Hill, 1975.
    """
    squared = (2.0 * np.pi * np.asarray(frequency, dtype=np.float64) / soil.low_frequency) ** 2
    high_pass = squared**2 / ((1.0 - squared) ** 2 + 4.0 * soil.low_damping**2 * squared)
    psd: FloatArray = high_pass * kanai_tajimi_psd(frequency, soil, intensity)
    return psd


@checked
def kanai_tajimi_motion(
    soil: str | Soil = "firm",
    duration: float = 30.0,
    dt: float = 0.01,
    *,
    seed: int,
    pga: float | None = None,
    intensity: float | None = None,
    envelope: Envelope | None = JENNINGS_HOUSNER_B,
) -> Record:
    """Return random ground motion with the Kanai-Tajimi spectrum.

    Parameters
    ----------
    soil : str or Soil
        One of `SOILS` (firm, medium, soft), or parameters of your own.
    duration : float
        Length, s; rounded up to a whole number of steps.
    dt : float
        Sampling step, s.
    seed : int
        Seed of NumPy's default generator.
    pga : float, optional
        Peak ground acceleration, m/s2, reached exactly. Give this or ``intensity``.
    intensity : float, optional
        One-sided density of the white noise at bedrock, (m/s2)^2/Hz, before the envelope.
    envelope : Envelope, optional
        Multiplies the stationary motion; None leaves it stationary. Default Jennings, Housner
        and Tsai's type B.

    Returns
    -------
    Record
        The motion; its ``source`` states every argument. It ends with some velocity: correct
        with `Record.baseline_corrected`.

    Raises
    ------
    InputError
        If an argument is out of range, or the soil is unknown.
    """
    return _motion(
        "kanai_tajimi", kanai_tajimi_psd, soil, duration, dt, seed, pga, intensity, envelope
    )


@checked
def clough_penzien_motion(
    soil: str | Soil = "firm",
    duration: float = 30.0,
    dt: float = 0.01,
    *,
    seed: int,
    pga: float | None = None,
    intensity: float | None = None,
    envelope: Envelope | None = JENNINGS_HOUSNER_B,
) -> Record:
    """Return random ground motion with the Clough-Penzien spectrum.

    Parameters
    ----------
    soil : str or Soil
        One of `SOILS` (firm, medium, soft), or parameters of your own.
    duration : float
        Length, s; rounded up to a whole number of steps.
    dt : float
        Sampling step, s.
    seed : int
        Seed of NumPy's default generator.
    pga : float, optional
        Peak ground acceleration, m/s2, reached exactly. Give this or ``intensity``.
    intensity : float, optional
        One-sided density of the white noise at bedrock, (m/s2)^2/Hz, before the envelope.
    envelope : Envelope, optional
        Multiplies the stationary motion; None leaves it stationary. Default Jennings, Housner
        and Tsai's type B.

    Returns
    -------
    Record
        The motion; its ``source`` states every argument.

    Raises
    ------
    InputError
        If an argument is out of range, or the soil is unknown.
    """
    return _motion(
        "clough_penzien", clough_penzien_psd, soil, duration, dt, seed, pga, intensity, envelope
    )


def _motion(
    kind: str,
    psd: Callable[[npt.ArrayLike, Soil, float], FloatArray],
    soil: str | Soil,
    duration: float,
    dt: float,
    seed: int,
    pga: float | None,
    intensity: float | None,
    envelope: Envelope | None,
) -> Record:
    parameters = soil if isinstance(soil, Soil) else SOILS[choice("soil", soil, SOILS)]
    measure, size = exactly_one(pga=pga, intensity=intensity)
    count = sample_count(duration, dt)
    density = psd(frequencies(count, dt), parameters, 1.0 if intensity is None else size)
    samples = random_phases(density, count, dt, seed)
    if envelope is not None:
        samples *= envelope(np.arange(count) * dt)
    if measure == "pga":
        peak = float(np.max(np.abs(samples)))
        if peak == 0.0:
            raise InputError(
                "duration and envelope", f"{duration:g} s and {envelope!r}", "a motion not all zero"
            )
        samples = samples / peak * size
    soil_name = soil if isinstance(soil, str) else "own_soil"
    return Record(
        samples,
        dt,
        name=f"{kind}_{soil_name}_seed_{seed}",
        source=call_text(
            f"{kind}_motion", soil=soil, duration=duration, dt=dt, **{measure: size}, seed=seed,
            envelope=envelope,
        ),
    )  # fmt: skip
