"""Fragility curves from the results of a sweep over intensities."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ground_motions.argument_types import checked

from .errors import InputError

_LEAST_DISPERSION = 1e-3
"""Dispersion of a curve that separates all runs."""


class Fragility(NamedTuple):
    """Lognormal probability that a limit is exceeded, over the intensity."""

    median: float  # Intensity with a probability of one half, in the unit of the intensities
    dispersion: float  # Standard deviation of the logarithm of the capacity

    def probability(self, intensity: ArrayLike) -> NDArray:
        """Probability that the limit is exceeded.

        Parameters
        ----------
        intensity : array_like
            Intensities above 0, in the unit of the median.

        Returns
        -------
        numpy.ndarray
            With the shape of the intensities.
        """
        from scipy.stats import norm

        with np.errstate(divide="ignore"):  # 0 at no intensity, and for an infinite median
            return norm.cdf(np.log(np.asarray(intensity, float) / self.median) / self.dispersion)


@checked
def fit_fragility(intensity: ArrayLike, exceeded: ArrayLike, count: ArrayLike = 1) -> Fragility:
    """Fit a fragility curve by maximum likelihood.

    The number of exceedances at each intensity is binomial.

    Parameters
    ----------
    intensity : array_like, shape (n,)
        Intensities above 0, such as spectral accelerations; one may come more than once.
    exceeded : array_like, shape (n,)
        Numbers of runs that exceed the limit; or, with a count of 1, whether a run does.
    count : array_like, shape (n,), default 1
        Numbers of runs.

    Returns
    -------
    Fragility
        Its ``median``, ``dispersion`` and ``probability(intensity)``.

    Raises
    ------
    InputError
        If a number cannot be used, or no run or every run exceeds the limit.

    References
    ----------
    Baker 2015, Earthquake Spectra 31(1), 579-599, equations 11 and 12.
    """
    from scipy.optimize import minimize
    from scipy.stats import norm

    im, over, runs = _counts(intensity, exceeded, count)
    logarithm = np.log(im)

    def minus_likelihood(p: NDArray) -> float:
        at = (logarithm - p[0]) / np.exp(p[1])
        return -float(np.sum(over * norm.logcdf(at) + (runs - over) * norm.logsf(at)))

    start = [np.average(logarithm, weights=runs), np.log(0.4)]
    bounds = [(None, None), (np.log(_LEAST_DISPERSION), np.log(20.0))]
    solution = minimize(
        minus_likelihood, start, method="Nelder-Mead", bounds=bounds,
        options={"xatol": 1e-8, "fatol": 1e-10, "maxiter": 2000},
    ).x  # fmt: skip
    return Fragility(*np.exp(solution).tolist())


def _counts(
    intensity: ArrayLike, exceeded: ArrayLike, count: ArrayLike
) -> tuple[NDArray, NDArray, NDArray]:
    """Intensities, exceedances and numbers of runs, refused if they cannot be used."""
    try:
        im, over, runs = np.broadcast_arrays(
            *(np.atleast_1d(np.asarray(each, float)) for each in (intensity, exceeded, count))
        )
    except (TypeError, ValueError):
        raise InputError(
            "intensity, exceeded and count have different lengths or are no numbers; expected: one "
            "number of each per intensity"
        ) from None
    for name, values, bad, expected in (
        ("intensity", im, ~((im > 0) & np.isfinite(im)), "above 0"),
        ("count", runs, ~((runs > 0) & np.isfinite(runs)), "1 or more"),
        ("exceeded", over, ~((over >= 0) & (over <= runs)), "0 up to the count"),
    ):
        if bad.any():
            k = int(np.argmax(bad))
            raise InputError(f"{name}[{k}]", f"{values.ravel()[k]:g}", expected)
    if not 0 < over.sum() < runs.sum():
        raise InputError(
            f"{over.sum():g} of {runs.sum():g} runs exceed the limit; expected: some but not all, "
            "so that a curve can be fitted"
        )
    return im, over, runs
