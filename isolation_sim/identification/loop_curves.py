"""Mean and thickness curves of a measured loop, to which Yu et al. fit their hybrid law.

At each displacement the force of the upper branch (velocity positive) and that of the lower one are
split into their mean (Eq 1), which is the backbone, and their half difference (Eq 3), which is the
dissipative part. The paper prints 1/N over the samples for the 1/2 of both equations. The backbone
is described by a hyperbolic sine (Eq 2), the thickness by a Gaussian (Eq 4).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ground_motions.argument_types import checked

from .steady_loops import steady_loops

_POINTS = 101
_INSIDE = 1e-9
"""Part of a branch off its ends, where the force may jump."""
_STARTS_BETA = (0.3, 1.0, 3.0)
"""Times the reciprocal of the amplitude."""


class HyperbolicSine(NamedTuple):
    """Yu et al., Eq 2: ``alpha sinh(beta x) + F0``.

    Attributes
    ----------
    alpha, beta, F0 : float, N, 1/m and N
    """

    alpha: float
    beta: float
    F0: float


class Gaussian(NamedTuple):
    """Yu et al., Eq 4: ``gamma exp(-x^2 / (2 sigma^2))``.

    Attributes
    ----------
    gamma, sigma_squared : float, N and m^2
    """

    gamma: float
    sigma_squared: float


@dataclass(frozen=True, eq=False)
class LoopCurves:
    """Both branches of a loop, their mean and its thickness.

    Attributes
    ----------
    displacement : numpy.ndarray, shape (n,), m
        From one end of the stroke to the other, evenly spaced in the phase.
    upper, lower : numpy.ndarray, shape (n_cycles, n), N
        Force of each cycle at positive and at negative velocity.
    initial_force : float, N
        Mean of the largest and the smallest force of a cycle: the paper's F0.
    """

    displacement: np.ndarray
    upper: np.ndarray
    lower: np.ndarray
    initial_force: float

    @property
    def mean(self) -> np.ndarray:
        """Yu et al., Eq 1: mean of both branches, N, shape (n,)."""
        return np.asarray(np.mean(self.upper + self.lower, axis=0) / 2)

    @property
    def thickness(self) -> np.ndarray:
        """Yu et al., Eq 3: half the difference of the branches, N, shape (n,).

        With its sign, which is negative where a loop runs the other way.
        """
        return np.asarray(np.mean(self.upper - self.lower, axis=0) / 2)

    @property
    def mean_uncertainty(self) -> np.ndarray:
        """Standard error of the mean curve from cycle to cycle, N, shape (n,)."""
        return _error((self.upper + self.lower) / 2)

    @property
    def thickness_uncertainty(self) -> np.ndarray:
        """Standard error of the thickness from cycle to cycle, N, shape (n,)."""
        return _error((self.upper - self.lower) / 2)

    @cached_property
    def hyperbolic_sine(self) -> HyperbolicSine:
        """Least-squares fit to the mean curve (Eq 2)."""
        from scipy.optimize import least_squares

        x, mean = self.displacement, self.mean
        stroke = float(np.max(np.abs(x)))

        def terms(beta: float) -> np.ndarray:
            return np.stack([np.sinh(beta * x / stroke), np.ones_like(x)], axis=1)

        def left(beta: np.ndarray) -> np.ndarray:
            rows = terms(beta[0])
            return np.asarray(mean - rows @ np.linalg.lstsq(rows, mean, rcond=None)[0])

        best = min(
            (
                least_squares(left, [start], bounds=(1e-3, 50.0), xtol=1e-12, ftol=1e-14)
                for start in _STARTS_BETA
            ),
            key=lambda result: result.cost,
        )
        alpha, F0 = np.linalg.lstsq(terms(best.x[0]), mean, rcond=None)[0]
        return HyperbolicSine(float(alpha), float(best.x[0]) / stroke, float(F0))

    @cached_property
    def gaussian(self) -> Gaussian:
        """Least-squares fit to the thickness (Eq 4)."""
        from scipy.optimize import least_squares

        x, thickness = self.displacement, self.thickness
        stroke = float(np.max(np.abs(x)))
        size = float(np.max(np.abs(thickness)))

        def left(numbers: np.ndarray) -> np.ndarray:
            gamma, narrowness = numbers
            return np.asarray(gamma * np.exp(-narrowness * (x / stroke) ** 2) - thickness / size)

        result = least_squares(left, [1.0, 1.0], xtol=1e-12, ftol=1e-14)
        gamma, narrowness = result.x
        return Gaussian(float(gamma) * size, stroke**2 / (2 * float(narrowness)))


@checked
def loop_curves(
    time: ArrayLike,
    displacement: ArrayLike,
    force: ArrayLike,
    frequency: float | None = None,
    skip: int = 0,
    points: int = _POINTS,
) -> LoopCurves:
    """Split the loop of a sinusoidal test into its mean curve and its thickness.

    Parameters
    ----------
    time : array_like, shape (n,), s
        Uniform.
    displacement : array_like, shape (n,), m
        A sinusoid with any offset, slow drift and noise; 16 samples a cycle or more.
    force : array_like, shape (n,), N
    frequency : float, optional, Hz
        Of the test; found from the displacement by default.
    skip : int
        Whole cycles to leave out at the beginning, while the device settles.
    points : int
        Displacements at which the curves are given.

    Returns
    -------
    LoopCurves

    Raises
    ------
    InputError
        As of `loop_measures`.
    """
    loops = steady_loops(time, displacement, force, frequency, skip)
    ends, curves = loops.ends, loops.curves
    centre, f_centre = np.mean(loops.displacement_centre), np.mean(loops.force_centre)
    # from the top down the lower branch, and from the bottom up the upper one
    share = np.linspace(0, 1, points)
    on_branch = np.clip(share, _INSIDE, 1 - _INSIDE)
    down = ends.at_top + on_branch * ((ends.at_bottom - ends.at_top) % (2 * np.pi))
    up = ends.at_bottom + on_branch * ((ends.at_top - ends.at_bottom) % (2 * np.pi))
    middle, half = float(np.mean(ends.top + ends.bottom)) / 2, float(np.mean(ends.amplitude))
    return LoopCurves(
        displacement=centre + middle - half * np.cos(np.pi * share),
        upper=f_centre + np.stack([curves.at(phase) for phase in up], axis=1),
        lower=f_centre + np.stack([curves.at(phase) for phase in down[::-1]], axis=1),
        initial_force=float(f_centre + np.mean(curves.extreme(1.0) + curves.extreme(-1.0)) / 2),
    )


def _error(cycles: np.ndarray) -> np.ndarray:
    return np.asarray(np.std(cycles, axis=0, ddof=1) / np.sqrt(len(cycles)))
