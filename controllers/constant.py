"""A constant current."""

from __future__ import annotations

from isolation_sim.simulation.control import RunContext

from .open_loop import Held
from .settings import Number, SearchRange, setting


class Constant(Held):
    """A constant current for all coils."""

    name = "constant"
    title = "Constant current"

    amperes: float = setting(1.5, "current to hold", Number(), "A", SearchRange(0.0, 3.0, "linear"))

    def held(self, context: RunContext) -> float:
        """Return the setting."""
        return self.amperes
