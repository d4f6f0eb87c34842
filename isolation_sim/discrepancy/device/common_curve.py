"""One saturation in place of a curve of each parameter over the current.

Parameters that are quadratic in the current follow a field that saturates, each by its own
coefficients. Where parameters that are linear in one saturating current do as well, the saturation
is the simpler explanation: several independent curves agree by chance only.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...effects.field_saturation import FORMS
from ...identification.least_squares import DETERMINED
from ...identification.parameterisation import Parameterisation
from ..decisions import SIGNIFICANT
from .model import FittedModel, fit_model
from .screen import screen_effect


def several_curves(fitted: FittedModel) -> bool:
    """Whether more than one of the law's parameters is curved over the current, beyond noise."""
    n = len(fitted.model.parameterisation.free)
    covariance, length = fitted.covariance
    # second differences of Bernstein's coefficients
    bend = np.zeros((n, len(length)))
    for k in range(n):
        bend[k, 3 * k : 3 * k + 3] = 1.0, -2.0, 1.0
    curvature = bend @ fitted.values
    spread = (bend / length) @ covariance @ (bend / length).T
    noise = fitted.cost / len(fitted.residual)
    # parameters may stand for each other: those beside any one have to be curved together
    for k in range(n):
        others = np.delete(np.arange(n), k)
        size = np.sqrt(np.diag(spread)[others]) + 1e-300
        inverse = np.linalg.pinv(
            spread[np.ix_(others, others)] / np.outer(size, size), DETERMINED, hermitian=True
        )
        one = curvature[others] / size
        if one @ inverse @ one < noise * (SIGNIFICANT + len(others)):
            return False
    return n > 1


def linear_in_current(fitted: FittedModel) -> FittedModel:
    """Fit the same effects on the law with parameters that are linear in the current."""
    quadratic, n_law = fitted.model.parameterisation, fitted.model.n_law
    ends = np.array(quadratic.span)
    p = Parameterisation(
        quadratic.law, ends, quadratic.sizes, quadratic.fixed, quadratic.span, quadratic.scaling
    )
    model = replace(fitted.model, parameterisation=p, expected=None, inside=None, held=None)
    at_ends = fitted.values[:n_law].reshape(-1, 3)[:, [0, 2]].ravel()
    return fit_model(model, np.concatenate([at_ends, fitted.values[n_law:]]))


def with_saturation(linear: FittedModel) -> FittedModel | None:
    """Add the form of saturation that fits best; None where the current does not vary."""
    noise = np.zeros((len(linear.residual), 1))
    tried = []
    for form in FORMS:
        found = screen_effect(linear, form, noise)
        if found is not None:
            start = np.concatenate([linear.values, found.start])
            tried.append(fit_model(linear.model.with_effects(form), start))
    return min(tried, key=lambda one: one.criterion, default=None)
