"""Stiff while the base is near its largest displacement so far, soft otherwise."""

from typing import Any

from controllers import Controller, setting
from controllers.settings import Number, SearchRange
from isolation_sim.simulation.control import RunContext
from isolation_sim.structures import IsolatedStructure


class NearPeak(Controller):
    """A controller with memory: the peak of the base displacement until now."""

    name = "near_peak"
    title = "Stiff near the largest displacement so far"
    period = 0.02

    highest: float = setting(3.0, "current near the peak", Number(at_least=0), "A")
    share: float = setting(0.7, "share of the peak from which the current is on", Number(above=0),
                           "", SearchRange(0.3, 1.0, "linear"))  # fmt: skip

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Base displacement."""
        return ("base_displacement_m",)

    def reset(self, context: RunContext) -> None:
        """Forget the last run."""
        self.peak = 0.0

    def current(self, t: float, measurement: Any) -> float:
        """The current at this instant."""
        displacement = abs(measurement.base_displacement_m)
        self.peak = max(self.peak, displacement)
        return self.highest if displacement > self.share * self.peak else 0.0
