"""Controllers: what sets the coil current. One file a controller, one line here.

A controller of one's own need not be here: ``simulate`` takes any ``Controller``.
"""

from __future__ import annotations

from typing import Any

from isolation_sim.errors import unknown_name

from .best_constant import BestConstant
from .clairvoyant import Clairvoyant
from .clipped_lqg import ClippedLQG
from .clipped_lqr import ClippedLQR
from .constant import Constant
from .controller import Controller
from .current_map import CurrentMap
from .frequency_tracking import FrequencyTracking
from .fuzzy import Fuzzy
from .h2 import H2
from .lyapunov import Lyapunov
from .mpc import MPC
from .on_off import OnOff
from .passive_off import PassiveOff
from .passive_on import PassiveOn
from .prescribed import Prescribed
from .settings import setting
from .sliding_mode import SlidingMode

_CLASSES: tuple[type[Controller], ...] = (
    PassiveOff,
    PassiveOn,
    Constant,
    Prescribed,
    BestConstant,
    OnOff,
    ClippedLQR,
    ClippedLQG,
    H2,
    Lyapunov,
    SlidingMode,
    FrequencyTracking,
    Fuzzy,
    MPC,
    Clairvoyant,
)

CONTROLLERS: dict[str, type[Controller]] = {c.name: c for c in _CLASSES}
"""Every controller's class by name."""

__all__ = [
    "CONTROLLERS",
    "Controller",
    "CurrentMap",
    "available_controllers",
    "controller",
    "setting",
]


def available_controllers() -> tuple[str, ...]:
    """Names of the controllers.

    Returns
    -------
    tuple of str
    """
    return tuple(CONTROLLERS)


def controller(name: str, **settings: Any) -> Controller:
    """Build a controller from its name.

    Parameters
    ----------
    name : str
        Name of the controller.
    **settings : object
        Its settings; see ``CONTROLLERS[name].settings``.

    Returns
    -------
    Controller

    Raises
    ------
    InputError
        If there is no such controller or setting, or a setting does not accept its value.
    """
    if name not in CONTROLLERS:
        raise unknown_name("controller", name, CONTROLLERS)
    return CONTROLLERS[name](**settings)
