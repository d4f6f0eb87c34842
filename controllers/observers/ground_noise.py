"""Model of the unknown ground motion in observers and regulators: filtered white noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked
from isolation_sim.errors import InputError


@checked
@dataclass(frozen=True)
class GroundNoise:
    """White noise at bedrock through the filter of Kanai and Tajimi.

    Attributes
    ----------
    intensity : float, (m/s^2)^2/Hz
        One-sided density of the white noise, as in ``ground_motions.kanai_tajimi_psd``.
    frequency : float or None, rad/s
        Circular frequency of the ground; None leaves the noise white.
    damping : float
        Damping ratio of the ground.

    Raises
    ------
    InputError
        If a number is not above 0.

    References
    ----------
    Kanai 1957; Tajimi 1960. The default is the firm soil of Der Kiureghian and Neuenhofer 1992.
    """

    intensity: float = 0.1
    frequency: float | None = 15.0
    damping: float = 0.6

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InputError(f"ground noise: {name}", f"{value}", "a number above 0")

    @property
    def density(self) -> float:
        """Two-sided density, (m/s^2)^2/Hz: the factor of the noise's delta-shaped covariance."""
        return self.intensity / 2

    def filter(self) -> tuple[NDArray, NDArray, NDArray, float]:
        """Return the filter from white noise to ground acceleration, in one direction.

        Returns
        -------
        a : numpy.ndarray, shape (n, n), 1/s
            Dynamics; n is 2, or 0 for white noise.
        b : numpy.ndarray, shape (n,)
            Input.
        c : numpy.ndarray, shape (n,)
            Output.
        d : float
            Of the noise that reaches the ground unfiltered: 1 for white noise, else 0.
        """
        if self.frequency is None:
            return np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0
        omega, zeta = self.frequency, self.damping
        a = np.array([[0.0, 1.0], [-(omega**2), -2 * zeta * omega]])
        return a, np.array([0.0, 1.0]), np.array([omega**2, 2 * zeta * omega]), 0.0
