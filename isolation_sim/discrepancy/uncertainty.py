"""How well a diagnosis knows its numbers, the noise of the measured motion included."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..identification.least_squares import DETERMINED, unit_columns
from ..identification.noise import correlation_time
from .base_fit import SEARCHED
from .candidates import Fitted
from .diagnosis import Interval
from .model import Model
from .noise_examples import motion_noise

EXAMPLES = 12
"""Of the motion's noise."""


def intervals(final: Fitted, shifts: NDArray, seed: int = 0) -> list[dict[str, Interval]]:
    """95 % intervals of each effect's parameters, fitted together with everything else.

    Noise of the force spreads the numbers, noise of the displacement also shifts them: smoothing
    takes a part of the motion away, and what is left of the noise looks like motion. The interval
    lies about what is left after the shift; the value remains the fitted one, which is the best
    under motion measured like this.

    Parameters
    ----------
    final : Fitted
        The model on all samples.
    shifts : (n_examples, 3, n_samples) array
        Examples of the motion's noise, to which more are drawn; see ``motion_noise``.
    seed : int
        Of these.

    Returns
    -------
    list of dict of str to Interval
        One an effect; an interval holds the value and ends at the parameter's bounds.
    """
    memory = correlation_time(final.residual, _starts_of_fitted(final))
    half = _half_widths(final.residual, final.jacobian, memory)
    if not np.any(final.model.data.displacement_noise > 0):
        return _stated(final.model, final.values, final.values, half)
    from scipy.special import stdtrit

    more = motion_noise(final.model.data, EXAMPLES - len(shifts), seed + 1)
    errors = errors_by_motion(final, [*shifts, *more])
    # an example under which a law runs away must not count for all
    below, shift, above = np.percentile(
        errors, [15.87, 50.0, 84.13], axis=0, method="median_unbiased"
    )
    sure = stdtrit(EXAMPLES - 1, 0.975) * np.sqrt(1 + 1 / EXAMPLES)
    half = np.hypot(half, sure * (above - below) / 2)
    return _stated(final.model, final.values, final.values - shift, half)


def errors_by_motion(final: Fitted, shifts: Sequence[NDArray]) -> NDArray:
    """What noise of the displacement alone does to fitted values, by examples.

    The fitted model's own force under the motion takes the place of the measured one; one step of
    Gauss and Newton fits the model to it under the same motion with noise that passed the same
    smoothing.

    Parameters
    ----------
    final : Fitted
        The model on all samples.
    shifts : sequence of (3, n_samples) array
        These examples; see ``motion_noise``.

    Returns
    -------
    (n_examples, n_values) array
        Errors of the values.
    """
    full, model = final.model.data, final.model
    kept, part = full.kept(SEARCHED), full.thinned(SEARCHED)
    clean = replace(model, data=part).forces(final.values, False)[0]
    errors = []
    for shift in shifts:
        dx, dv, da = shift[:, kept]
        data = replace(part, x=part.x + dx, v=part.v + dv, a=part.a + da, force=clean)
        residual, jacobian = replace(model, data=data).residuals(final.values, True)
        scaled, norm = unit_columns(jacobian)
        errors.append(-np.linalg.lstsq(scaled, residual, rcond=DETERMINED)[0] / norm)
    return np.array(errors)


def linear_intervals(
    model: Model, values: NDArray, residual: NDArray, jacobian: NDArray
) -> list[dict[str, Interval]]:
    """95 % intervals of each effect's parameters by the residuals' derivatives.

    Parameters
    ----------
    model : Model
        The model.
    values : (n_values,) array
        Where it fits best.
    residual : (n_residuals,) array
        There, independent of each other.
    jacobian : (n_residuals, n_values) array
        Its derivatives.

    Returns
    -------
    list of dict of str to Interval
        One an effect; an interval ends at the parameter's bounds.
    """
    return _stated(model, values, values, _half_widths(residual, jacobian))


def _half_widths(residual: NDArray, jacobian: NDArray, memory: float = 1.0) -> NDArray:
    """By the curvature; a residual resembles its neighbours over ``memory`` samples."""
    n, n_values = jacobian.shape
    scaled, norm = unit_columns(jacobian)
    variance = memory * float(residual @ residual) / max(n - n_values, 1)
    inverse = np.linalg.pinv(scaled.T @ scaled, rcond=DETERMINED**2, hermitian=True)
    return 1.96 * np.sqrt(np.diag(inverse) * variance) / norm


def _stated(
    model: Model, values: NDArray, middle: NDArray, half: NDArray
) -> list[dict[str, Interval]]:
    """Intervals about a middle, which hold the values and end at the bounds."""
    low, high = np.minimum(values, middle - half), np.maximum(values, middle + half)
    return [
        {
            quantity.name: Interval(
                value=float(values[k]),
                low=float(max(low[k], quantity.lower)),
                high=float(min(high[k], quantity.upper)),
                unit=quantity.unit,
            )
            for k, quantity in enumerate(stage.effect.parameters, place.start)
        }
        for stage, place in zip(model.stages, model.slices(), strict=True)
    ]


def _starts_of_fitted(final: Fitted) -> NDArray:
    data = final.model.data
    counts = [int(np.sum(data.fitted[run])) for run in data.runs]
    return np.concatenate([[0], np.cumsum([c for c in counts if c])])
