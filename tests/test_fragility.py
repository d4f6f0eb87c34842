"""Fragility curves by maximum likelihood, against the probit regression that they are."""

import numpy as np
import pytest
from scipy.stats import norm

import isolation_sim as iso

# intensities, and collapses among 40 motions
INTENSITY = np.array([0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9, 1.0])
COLLAPSES = np.array([0, 0, 0, 4, 6, 13, 12, 16])


def test_the_curve_solves_the_likelihood_equations_of_a_probit():
    curve = iso.fit_fragility(INTENSITY, COLLAPSES, 40)
    x = (np.log(INTENSITY) - np.log(curve.median)) / curve.dispersion
    p = norm.cdf(x)
    residual = (COLLAPSES - 40 * p) * norm.pdf(x) / (p * (1 - p))
    scale = np.abs(residual).sum()
    assert abs(residual.sum()) < 1e-4 * scale and abs(residual @ x) < 1e-4 * scale
    assert curve.probability(curve.median) == pytest.approx(0.5)
    # one run at a time is the same data
    single = [(im, k < n) for im, n in zip(INTENSITY, COLLAPSES, strict=True) for k in range(40)]
    again = iso.fit_fragility(*zip(*single, strict=True))
    assert again == pytest.approx(curve, rel=1e-5)


def test_a_known_curve_is_estimated():
    rng, im = np.random.default_rng(0), np.linspace(0.2, 3.0, 15)
    drawn = rng.binomial(20_000, iso.Fragility(1.2, 0.5).probability(im))
    assert iso.fit_fragility(im, drawn, 20_000) == pytest.approx((1.2, 0.5), rel=0.01)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([1.0, 2.0], [0, 0], 3), "0 of 6 runs exceed the limit; expected: some but not all"),
        (([1.0, 2.0], [3, 3], 3), "6 of 6 runs exceed"),
        (([1.0, -2.0], [0, 3], 3), r"intensity\[1\]: given -2; expected: above 0"),
        (([1.0, 2.0], [0, 4], 3), r"exceeded\[1\]: given 4; expected: 0 up to the count"),
        (([1.0, 2.0], [0, 1, 2], 3), "different lengths"),
    ],
)
def test_wrong_numbers_are_refused(arguments, message):
    with pytest.raises(iso.InputError, match=message):
        iso.fit_fragility(*arguments)
