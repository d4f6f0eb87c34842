"""Coils without current."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from isolation_sim.simulation.control import RunContext

from .open_loop import Held


class PassiveOff(Held):
    """Zero current, or the nearest one within the limits of the supply."""

    name = "passive_off"
    title = "Passive off"
    source = "Dyke et al. 1996"

    def held(self, context: RunContext) -> NDArray:
        """Zero, or the lowest current of the supply."""
        return np.clip(0.0, context.low, context.high)
