"""Stiff while the base moves away from its centre, soft on the way back."""

from typing import Any

from controllers import Controller, setting
from controllers.settings import Number, SearchRange
from isolation_sim.structures import IsolatedStructure


class Outwards(Controller):
    """A current in proportion to the speed away from the centre."""

    name = "outwards"
    title = "Current in proportion to the outward velocity"
    period = 0.02

    highest: float = setting(3.0, "current at full speed", Number(at_least=0), "A")
    full_speed: float = setting(0.3, "outward velocity of the highest current", Number(above=0),
                                "m/s", SearchRange(0.05, 5.0))  # fmt: skip

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Base displacement and velocity."""
        return ("base_displacement_m", "base_velocity_m_s")

    def current(self, t: float, measurement: Any) -> float:
        """The current at this instant."""
        v = measurement.base_velocity_m_s
        outward = v if measurement.base_displacement_m > 0 else -v
        return self.highest * min(max(outward / self.full_speed, 0.0), 1.0)
