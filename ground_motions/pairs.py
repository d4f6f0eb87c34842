"""Spectra of the two horizontal components of a ground motion, taken together."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np
import numpy.typing as npt

from ground_motions.argument_types import checked
from ground_motions.checks import FloatArray, choice
from ground_motions.errors import InputError
from ground_motions.record import Record
from ground_motions.spectra import oscillator_response, response_spectrum

Combination = Literal["srss", "rotd100", "geometric_mean", "mean", "larger"]

_OF_ORDINATES: dict[str, Callable[[FloatArray, FloatArray], FloatArray]] = {
    "srss": np.hypot,
    "geometric_mean": lambda first, second: np.sqrt(first * second),
    "mean": lambda first, second: 0.5 * (first + second),
    "larger": np.maximum,
}
COMBINATIONS = (*_OF_ORDINATES, "rotd100")
"""How the components' spectra may be combined."""

_STEPS_A_PERIOD = 40


@checked
def combined_spectrum(
    components: tuple[Record, ...],
    periods: npt.ArrayLike,
    combination: Combination = "srss",
    damping: float = 0.05,
) -> FloatArray:
    """Return the pseudo-acceleration spectrum of a ground motion of one or two components.

    Parameters
    ----------
    components : tuple of Record
        One component, whose own spectrum is returned, or two horizontal ones.
    periods : (m,) array_like
        Natural periods, s.
    combination : {"srss", "rotd100", "geometric_mean", "mean", "larger"}
        Of the two ordinates at each period; ``"rotd100"`` is the maximum over all horizontal
        directions (Boore 2010), the "maximum direction" of ASCE 7-22. There the shorter of two
        components is at rest after its end.
    damping : float
        Damping ratio.

    Returns
    -------
    (m,) ndarray
        Pseudo-acceleration, m/s2.

    Raises
    ------
    InputError
        If there are not one or two components, their steps differ with ``"rotd100"``, or an
        argument is out of range.

    Notes
    -----
    D. M. Boore, "Orientation-independent, nongeometric-mean measures of seismic intensity from
    two horizontal components of motion", Bulletin of the Seismological Society of America 100
    (2010) 1830-1835. The maximum over the directions is the largest length of the displacement
    vector in plan.
    """
    choice("combination", combination, COMBINATIONS)
    if len(components) not in (1, 2):
        raise InputError("components", f"{len(components)} records", "1 or 2")
    if len(components) == 1:
        return response_spectrum(components[0], periods, damping).psa
    one, other = components
    if combination == "rotd100":
        return _rotd100(one, other, np.atleast_1d(np.asarray(periods, dtype=float)), damping)
    first, second = (response_spectrum(each, periods, damping).psa for each in components)
    return _OF_ORDINATES[combination](first, second)


def _rotd100(first: Record, second: Record, periods: FloatArray, damping: float) -> FloatArray:
    if not math.isclose(first.dt, second.dt, rel_tol=1e-9):
        raise InputError(
            f"components {first.name} and {second.name}",
            f"steps of {first.dt:g} and {second.dt:g} s", "one step",
        )  # fmt: skip
    length = max(len(first), len(second))
    pair = [each.padded(after=(length - len(each)) * each.dt) for each in (first, second)]
    result = np.zeros(len(periods))
    for k, period in enumerate(periods):
        if period == 0.0:
            plan = np.hypot(pair[0].acceleration, pair[1].acceleration)
            result[k] = plan.max()
            continue
        # a whole ratio: the very same motion at a finer step, and a period of free vibration
        parts = math.ceil(_STEPS_A_PERIOD * first.dt / period)
        x, y = (
            oscillator_response(
                each.padded(after=period).resampled(first.dt / parts), period, damping
            ).displacement
            for each in pair
        )
        result[k] = (2.0 * math.pi / period) ** 2 * math.sqrt(_peak(x**2 + y**2))
    return result


def _peak(values: FloatArray) -> float:
    """Largest value, by a parabola through the largest sample and its neighbours."""
    k = int(np.argmax(values))
    if not 0 < k < len(values) - 1:
        return float(values[k])
    before, here, after = values[k - 1 : k + 2]
    bend = before - 2.0 * here + after
    return float(here - (after - before) ** 2 / (8.0 * bend)) if bend < 0.0 else float(here)
