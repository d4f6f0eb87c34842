"""Two series of force compared: how well a model's follows a measured one."""

from __future__ import annotations

from typing import Any

import numpy as np

from isolation_sim.errors import InputError


def rms_error(measured: Any, modelled: Any) -> float:
    """Root mean square of the difference (Yu et al., Eq 6)."""
    measured, modelled = _pair(measured, modelled)
    return float(np.sqrt(np.mean((measured - modelled) ** 2)))


def normalised_rms(measured: Any, modelled: Any) -> float:
    """Root mean square of the difference over that of the measured force about its mean."""
    measured, modelled = _pair(measured, modelled)
    return rms_error(measured, modelled) / _spread("measured", measured)


def fitness(measured: Any, modelled: Any) -> float:
    """Fitness of the linearised Bouc-Wen paper (Eq 13, mended)."""
    # ``100 (1 - |F_p - F_m| / |F_m - mean(F_m)|)``. The paper prints F_m - F_m in the denominator,
    # which is zero; the mean is what the fitness that it cites has there.
    return 100 * (1 - normalised_rms(measured, modelled))


def half_range_error(measured: Any, modelled: Any) -> float:
    """Root mean square of the difference over half of the measured range (Tao et al., Eq 24)."""
    # Unlike `normalised_rms`, it counts the range of the force, not its spread: for a sinusoidal
    # force it is smaller by the square root of 2.
    measured, modelled = _pair(measured, modelled)
    _spread("measured", measured)
    return 2 * rms_error(measured, modelled) / float(np.ptp(measured))


def correlation(measured: Any, modelled: Any) -> float:
    """Correlation coefficient CC (Li & Li, Eq 22)."""
    # It sees neither an offset nor a factor: a model twice too stiff has CC = 1.
    measured, modelled = _pair(measured, modelled)
    scale = _spread("measured", measured) * _spread("modelled", modelled)
    product = np.mean((measured - measured.mean()) * (modelled - modelled.mean()))
    return float(np.clip(product / scale, -1.0, 1.0))


def squared_force_error(measured: Any, modelled: Any, step: float = 1.0) -> float:
    """Objective of the strain-stiffening paper (Li & Li, Eq 16), integral of |F_exp^2 - F_mod^2|.

    Kept to reproduce the paper: it cannot see a sign, so that a model whose force is everywhere
    opposite to the measured one is perfect to it, and it weighs the peaks by the square.
    """
    measured, modelled = _pair(measured, modelled)
    return float(np.trapezoid(np.abs(measured**2 - modelled**2), dx=step))


def _pair(measured: Any, modelled: Any) -> tuple[np.ndarray, np.ndarray]:
    a, b = np.asarray(measured, dtype=float), np.asarray(modelled, dtype=float)
    if a.ndim != 1 or a.size == 0 or a.shape != b.shape:
        raise InputError(
            f"measured force of shape {a.shape}, modelled of {b.shape}; expected: one shape (n,)"
        )
    for what, series in (("measured", a), ("modelled", b)):
        if not np.all(np.isfinite(series)):
            worst = int(np.argmin(np.isfinite(series)))
            raise InputError(f"{what} force: sample {worst}", f"{series[worst]}", "finite numbers")
    return a, b


def _spread(what: str, series: np.ndarray) -> float:
    spread = float(np.std(series))
    if not spread > 1e-14 * float(np.max(np.abs(series))):
        raise InputError(f"{what} force is constant; expected: a force that changes")
    return spread
