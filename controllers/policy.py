"""A function of the measurements, such as a policy that was trained in an environment."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ground_motions.argument_types import checked
from isolation_sim.simulation.control import RunContext
from isolation_sim.structures import IsolatedStructure

from .controller import Controller


@checked
class Policy(Controller):
    """A function from the measurements to the currents.

    Parameters
    ----------
    act : callable
        ``act(observation)``: coil current, or one per coil, A; the observation, a float32 array,
        contains the measurements, then the coil currents, as in `isolation_sim.environments`.
        Its result is clamped to the supply's limits.
    measures : sequence of str
        Outputs to measure, in the observation's order.
    period : float, optional, s
        Interval between decisions; the ground motion's sampling interval by default.
    """

    name = "policy"
    title = "Policy"

    def __init__(
        self,
        act: Callable[[NDArray], ArrayLike],
        measures: Sequence[str],
        period: float | None = None,
    ) -> None:
        super().__init__(period=period)
        self._act, self._measures = act, tuple(measures)

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Return the outputs that the function takes.

        Parameters
        ----------
        nominal : IsolatedStructure
            Not needed.

        Returns
        -------
        tuple of str
        """
        return self._measures

    def reset(self, context: RunContext) -> None:
        """Note the supply's limits.

        Parameters
        ----------
        context : RunContext
            With the limits.
        """
        self._low, self._high = context.low, context.high

    def current(self, t: float, measurement: Any) -> NDArray:
        """Ask the function.

        Parameters
        ----------
        t : float, s
            Not needed.
        measurement : named tuple of float
            The measurements, then the coil currents.

        Returns
        -------
        numpy.ndarray, shape (1,) or (n_channels,), A
            Result of the function, within the supply's limits.
        """
        currents = self._act(np.array(measurement, np.float32))
        return np.clip(np.asarray(currents, float).ravel(), self._low, self._high)
