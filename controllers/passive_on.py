"""Coils under full current."""

from __future__ import annotations

from typing import Any

from isolation_sim.simulation.control import RunContext

from .coils import highest_tested
from .open_loop import Held
from .settings import Number, Optional, setting


class PassiveOn(Held):
    """A constant high current."""

    name = "passive_on"
    title = "Passive on"
    source = "Dyke et al. 1996"

    amperes: float | None = setting(
        None,
        "current to hold; None for the highest tested, within the supply's limits",
        Optional(Number()),
        "A",
    )

    def held(self, context: RunContext) -> Any:
        """Return the setting, or the highest tested current."""
        return highest_tested(context) if self.amperes is None else self.amperes
