"""Base class of controllers that estimate the state: settings of their observer."""

from __future__ import annotations

import numpy as np

from isolation_sim.simulation.control import RunContext
from isolation_sim.structures import IsolatedStructure

from .coils import highest_tested, lowest
from .controller import Controller
from .observers import ExtendedKalmanFilter, GroundNoise, KalmanFilter, Noise, Observer
from .settings import Number, Optional, setting


class Estimating(Controller):
    """A controller with an observer, which sees accelerations and isolator deformations only."""

    ground_intensity: float = setting(
        0.1, "observer: one-sided density of the ground's white noise, (m/s^2)^2/Hz",
        Number(above=0),
    )  # fmt: skip
    ground_frequency: float | None = setting(
        15.0, "observer: circular frequency of the ground; None for white noise",
        Optional(Number(above=0)), "rad/s",
    )  # fmt: skip
    ground_damping: float = setting(0.6, "observer: damping ratio of the ground", Number(above=0))
    acceleration_noise: float = setting(
        0.02, "observer: standard deviation of an accelerometer's noise", Number(above=0), "m/s^2"
    )
    deformation_noise: float = setting(
        2e-4, "observer: standard deviation of a displacement transducer's noise",
        Number(above=0), "m",
    )  # fmt: skip

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """All levels' accelerations and all elements' deformations."""
        return Observer.measures(nominal)

    def observer(
        self, context: RunContext, kind: str = "kalman", measured_ground: bool = False
    ) -> Observer:
        """Build the observer that the settings describe."""
        # without lag a current jumps when the command of a measurement arrives
        driver, jump = context.driver, None
        if np.all(np.equal(driver.lag, 0)) and np.all(np.isinf(driver.slew)):
            jump = round(sum(context.delays) / context.period, 6) % 1.0
        return {"kalman": KalmanFilter, "extended": ExtendedKalmanFilter}[kind](
            context.nominal, context.period,
            GroundNoise(self.ground_intensity, self.ground_frequency, self.ground_damping),
            Noise(self.acceleration_noise, self.deformation_noise),
            limits=(lowest(context), highest_tested(context)), measured_ground=measured_ground,
            jump=jump,
        )  # fmt: skip
