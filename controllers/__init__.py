"""Controllers of the coil current: one file per controller, one entry point per name.

Your own controller need not be here: ``simulate`` accepts any ``Controller``.
"""

from __future__ import annotations

from isolation_sim.registry import CONTROLLERS, available_controllers
from isolation_sim.registry import controller as _controller

from .controller import Controller
from .current_map import CurrentMap
from .policy import Policy
from .settings import setting

controller = _controller  # not the module controller.py, which took this name when it was imported

__all__ = [
    "CONTROLLERS",
    "Controller",
    "CurrentMap",
    "Policy",
    "available_controllers",
    "controller",
    "setting",
]
