"""Amplitude scaling of a suite to a target spectrum, and selection of the records that fit best."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ground_motions.argument_types import checked
from ground_motions.checks import FloatArray, positive
from ground_motions.errors import InputError
from ground_motions.pairs import Combination

POINTS = 100
"""Periods at which a suite is compared with its target."""


@checked
@dataclass(frozen=True)
class SuiteRule:
    """Requirements of a design code on a suite of records.

    Parameters
    ----------
    name : str
        Short name.
    clause : str
        Clause on the spectra.
    low, high : float
        Range of periods over the isolated period, dimensionless.
    floor : float
        Least mean spectrum over the target, dimensionless.
    combination : str
        Spectrum of a pair of components; see `ground_motions.pairs.combined_spectrum`.
    response_clause : str
        Clause on the number of records and on the response to design for.
    mean_from : int
        Records from which on the mean response is the design value.
    maximum_from : int, optional
        Records from which on the largest response is, where there are fewer than ``mean_from``.
    zero_floor : float, optional
        Least mean spectrum over the target at period 0, where the code asks for it.
    matched_floor : float, optional
        Least mean spectrum over the target of matched records, where it is another.
    """

    name: str
    clause: str
    low: float
    high: float
    floor: float
    combination: Combination
    response_clause: str
    mean_from: int
    maximum_from: int | None = None
    zero_floor: float | None = None
    matched_floor: float | None = None

    def under(self, scaling: str | None) -> SuiteRule:
        """Return the rule for records that are scaled in a way.

        Parameters
        ----------
        scaling : str or None
            ``"matched"`` to the target, or anything else.

        Returns
        -------
        SuiteRule
        """
        if scaling != "matched" or self.matched_floor is None:
            return self
        return replace(self, floor=self.matched_floor)

    def periods(self, isolated_period: float) -> FloatArray:
        """Return the periods at which the rule is checked.

        Parameters
        ----------
        isolated_period : float
            Effective period of the isolated building, s.

        Returns
        -------
        (m,) ndarray
            Periods of the range, evenly spaced in the logarithm, s; 0 first where the rule asks
            for it.
        """
        period = positive("isolated_period (s)", isolated_period)
        within = np.geomspace(self.low * period, self.high * period, POINTS)
        return within if self.zero_floor is None else np.append(0.0, within)

    def design_statistic(self, n_records: int) -> str | None:
        """Return the statistic over the suite that is the response to design for.

        Parameters
        ----------
        n_records : int
            Number of recordings, whose two components count once.

        Returns
        -------
        str or None
            ``"mean"``, ``"maximum"``, or None where the code asks for more records.
        """
        if n_records >= self.mean_from:
            return "mean"
        enough = self.maximum_from is not None and n_records >= self.maximum_from
        return "maximum" if enough else None

    @property
    def floors(self) -> FloatArray:
        """Least mean spectrum over the target at each of `periods`, dimensionless, shape (m,)."""
        within = np.full(POINTS, self.floor)
        return within if self.zero_floor is None else np.append(self.zero_floor, within)


SUITE_RULES = {
    rule.name: rule
    for rule in (
        SuiteRule(
            "asce7_22_16", "ASCE 7-22, 16.2.3", 0.2, 2.0, 0.9, "rotd100",
            "ASCE 7-22, 16.2.2 and 16.4", mean_from=11, matched_floor=1.1,
        ),
        SuiteRule(
            "asce7_22_17", "ASCE 7-22, 17.3.3", 0.75, 1.25, 1.0, "srss",
            "ASCE 7-22, 17.3.3", mean_from=7,
        ),
        SuiteRule(
            "en1998_1_2004", "EN 1998-1:2004, 3.2.3.1.2(4)", 0.2, 2.0, 0.9, "mean",
            "EN 1998-1:2004, 4.3.3.4.3(3)", mean_from=7, maximum_from=3, zero_floor=1.0,
        ),
        SuiteRule(
            "en1998_2_2005", "EN 1998-2:2005, 3.2.3(3)P", 0.2, 1.5, 1.3, "srss",
            "EN 1998-2:2005, 4.2.4.3", mean_from=7, maximum_from=3,
        ),
    )
}  # fmt: skip
"""Rules by name; the first one is the default."""


@dataclass(frozen=True, eq=False)
class SuiteScaling:
    """Scale factors of a suite.

    Parameters
    ----------
    factors : (n,) ndarray
        Factor of each record, the common one included, dimensionless.
    misfit : (n,) ndarray
        RMS of the logarithm of the scaled spectrum over the target, before the common factor.
    common : float
        Factor on all records that lifts the mean to the rule's floor; 1 or above.
    mean_ratio : (m,) ndarray
        Mean scaled spectrum over the target at each period.
    """

    factors: FloatArray
    misfit: FloatArray
    common: float
    mean_ratio: FloatArray


def best_factors(
    spectra: FloatArray, target: FloatArray, limits: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Return the factor of each record that fits a target best, and the remaining misfit."""
    low, high = limits
    if not 0.0 < low <= high < math.inf:
        raise InputError("limits of scale factors", f"{low:g} and {high:g}", "0 < low <= high")
    if not np.all(spectra > 0.0):
        raise InputError("spectra (m/s2)", "an ordinate of 0", "ordinates above 0")
    distance = np.log(target / spectra)
    logarithm = np.clip(distance.mean(axis=1), math.log(low), math.log(high))
    misfit = np.sqrt(np.mean((distance - logarithm[:, None]) ** 2, axis=1))
    return np.exp(logarithm), misfit


@checked
def select_best(
    spectra: FloatArray, target: FloatArray, count: int, limits: tuple[float, float]
) -> npt.NDArray[np.int64]:
    """Return which records fit a target best in shape, their factors held within limits.

    Parameters
    ----------
    spectra : (n, m) ndarray
        Spectrum of each record, m/s2.
    target : (m,) ndarray
        Target, m/s2.
    count : int
        How many to take.
    limits : tuple of float
        Least and largest factor, dimensionless.

    Returns
    -------
    (count,) ndarray of int
        Rows of ``spectra``, the best first.

    Raises
    ------
    InputError
        If there are fewer records than requested.
    """
    if not 0 < count <= len(spectra):
        raise InputError("records to select", f"{count}", f"1 to {len(spectra)}, as many as given")
    _, misfit = best_factors(spectra, target, limits)
    return np.argsort(misfit, kind="stable")[:count]


@checked
def scale_suite(
    spectra: FloatArray, target: FloatArray, floors: FloatArray, limits: tuple[float, float]
) -> SuiteScaling:
    """Scale each record to the target, then all records together to the least mean of a code.

    Parameters
    ----------
    spectra : (n, m) ndarray
        Spectrum of each record at the periods of a `SuiteRule`, m/s2.
    target : (m,) ndarray
        Target there, m/s2.
    floors : (m,) ndarray
        Least mean spectrum over the target there, dimensionless.
    limits : tuple of float
        Least and largest factor of a record, dimensionless.

    Returns
    -------
    SuiteScaling

    Raises
    ------
    InputError
        If the mean cannot reach the floor with factors within the limits.
    """
    # the ordinate at period 0 is checked, but the shape is fitted over the range
    own, misfit = best_factors(spectra[:, -POINTS:], target[-POINTS:], limits)
    factors, common = own, 1.0
    # a factor at its limit cannot be lifted further, so that the others are lifted more
    for _ in range(100):
        ratio = (factors[:, None] * spectra).mean(axis=0) / target
        lack = float(np.max(floors / ratio))
        if lack <= 1.0:
            return SuiteScaling(factors, misfit, common, ratio)
        common *= lack * (1.0 + 1e-12)
        factors = np.minimum(common * own, limits[1])
        if np.all(factors >= limits[1]):
            break
    raise InputError(
        "scale factors",
        f"a mean {lack:.3g} times too low at the upper limit {limits[1]:g}",
        "a higher limit (scale_limits in [ground]), or records that are stronger there",
    )
