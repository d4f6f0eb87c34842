"""Bouc-Wen element in normalised form, shared by the laws that hold one.

``F_y w``, ``w' = rho (u - (sigma |u| w + (1 - sigma) u |w|) |w|^(n-1))`` for a rate of extension u.
From rest w stays within -1 to 1, so that F_y is the yield force and 1 / rho the yield deformation:
no parameter is redundant, and each may follow the current by itself. In Wen's symbols
``F_y = alpha (A / (beta + gamma))^(1/n)``, ``rho = A ((beta + gamma) / A)^(1/n)`` and
``sigma = beta / (beta + gamma)``. With sigma at 1/2 or more the element gives back no more than
``F_y w^2 / (2 rho)`` (Ikhouane & Rodellar 2007).
"""

from typing import Any

import numpy as np

from .law import Quantity

# keeps log(0) out of derivatives at rest; changes no value above 1e-148
_TINY = 1e-300

STATE = Quantity("w", "1", "hysteretic force over the yield force")
PARAMETERS = (
    Quantity("F_y", "N", "yield force of the hysteretic element", lower=0.0),
    Quantity("rho", "1/m", "inverse yield deformation", lower=0.0, divides=True),
    Quantity("sigma", "1", "roundness of unloading", lower=0.5, upper=2.0),
    Quantity("n", "1", "smoothness of yielding", lower=1.0, upper=10.0),
)


def rate(u: Any, w: Any, rho: Any, sigma: Any, n: Any) -> Any:
    """Rate of the hysteretic variable under the rate of extension u."""
    # |w|^(n-1), so written that its derivatives need no second power
    shape = np.exp((n - 1) / 2 * np.log(w * w + _TINY))
    return rho * (u - (sigma * np.fabs(u) * w + (1 - sigma) * u * np.fabs(w)) * shape)


def energy(w: Any, F_y: Any, rho: Any) -> Any:
    """Energy that the element can give back."""
    return F_y * w**2 / (2 * rho)
