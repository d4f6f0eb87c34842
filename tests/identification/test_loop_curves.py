"""Mean and thickness of a loop, against the hybrid law's closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim.errors import InputError
from isolation_sim.laws.hybrid import condition

X = 8e-3
PHASE = 2 * np.pi * np.arange(0, 8.3, 1 / 256.3) + 0.3


def hybrid_loop(mean=0.0, sharp=True, F0=0.0):
    """Time, displacement and force of one condition of Yu et al., and its numbers."""
    device = condition(8, 1, 2).with_parameters(F0=F0)
    alpha, beta, gamma, sigma_squared, *_ = numbers = device.parameters_at(2.0)
    x, v = mean + X * np.sin(PHASE), 2 * np.pi * X * np.cos(PHASE)
    thickness = gamma * np.exp(-(x**2) / (2 * sigma_squared))
    sharp_force = alpha * np.sinh(beta * x) + np.sign(v) * thickness + F0
    force = sharp_force if sharp else device.force(x, v, (), 2.0)
    return PHASE / (2 * np.pi), x, force, numbers


@pytest.mark.parametrize("mean", [0.0, 1e-3])
def test_both_curves_of_the_hybrid_law(mean):
    t, x, force, (alpha, beta, gamma, sigma_squared, F0, _) = hybrid_loop(mean, F0=7.0)
    curves = iso.loop_curves(t, x, force)
    at = curves.displacement
    assert at[[0, -1]] == pytest.approx([mean - X, mean + X], abs=1e-9)
    backbone = alpha * np.sinh(beta * at) + F0
    thickness = gamma * np.exp(-(at**2) / (2 * sigma_squared))
    assert curves.mean == pytest.approx(backbone, abs=1e-5 * np.max(backbone))
    assert curves.thickness == pytest.approx(thickness, abs=1e-4 * gamma)
    assert curves.hyperbolic_sine == pytest.approx((alpha, beta, F0), rel=1e-4)
    assert curves.gaussian == pytest.approx((gamma, sigma_squared), rel=1e-4)
    largest = np.max(backbone + thickness) + np.min(backbone - thickness)
    assert curves.initial_force == pytest.approx(largest / 2, abs=2e-4 * np.max(backbone))


def test_smoothed_law():
    t, x, force, (alpha, beta, gamma, sigma_squared, _, v_s) = hybrid_loop(sharp=False)
    curves = iso.loop_curves(t, x, force, points=61)
    at = curves.displacement
    v = 2 * np.pi * np.sqrt(np.maximum(X**2 - at**2, 0))
    thickness = gamma * np.exp(-(at**2) / (2 * sigma_squared)) * np.tanh(v / v_s)
    inner = slice(3, -3)  # the jump is rounded within two samples
    assert curves.thickness[inner] == pytest.approx(thickness[inner], abs=1e-2 * gamma)
    backbone = alpha * np.sinh(beta * at)
    assert curves.mean == pytest.approx(backbone, abs=1e-3 * np.max(backbone))


def test_elliptic_loop():
    t, x, _, _ = hybrid_loop()
    force = 3e4 * x + 1e3 * 2 * np.pi * X * np.cos(PHASE)
    curves = iso.loop_curves(t, x, force)
    at = curves.displacement
    ellipse = 2e3 * np.pi * np.sqrt(np.maximum(X**2 - at**2, 0))
    assert curves.mean == pytest.approx(3e4 * at, abs=1e-4)
    assert curves.thickness == pytest.approx(ellipse, abs=1e-4)


def test_the_uncertainty_shows_the_noise():
    t, x, force, (alpha, beta, gamma, sigma_squared, *_) = hybrid_loop()
    rng = np.random.default_rng(5)
    noise = 0.03 * np.std(force)
    curves = iso.loop_curves(t, x, force + noise * rng.standard_normal(t.size))
    at = curves.displacement
    thickness = gamma * np.exp(-(at**2) / (2 * sigma_squared))
    inner = slice(10, -10)
    for computed, error, expected in (
        (curves.mean, curves.mean_uncertainty, alpha * np.sinh(beta * at)),
        (curves.thickness, curves.thickness_uncertainty, thickness),
    ):
        assert np.max(error[inner]) < noise
        assert np.mean(np.abs(computed - expected)[inner] < 3 * error[inner]) > 0.9
    assert curves.gaussian == pytest.approx((gamma, sigma_squared), rel=0.1)
    assert curves.hyperbolic_sine[:2] == pytest.approx((alpha, beta), rel=0.1)


def test_refused():
    t, x, force, _ = hybrid_loop()
    with pytest.raises(InputError, match="whole cycles"):
        iso.loop_curves(t[:500], x[:500], force[:500])
