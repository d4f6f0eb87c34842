"""Controllers whose commands are known before the run."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.errors import InputError
from isolation_sim.simulation.control import RunContext, Schedule

from .controller import Controller


def highest_tested(context: RunContext) -> NDArray:
    """Highest current within the supply's limits at which the devices were tested."""
    return within_tested(context.tested, context.low, context.high)


def within_tested(tested: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """As ``highest_tested``, from the tested currents and the supply's limits, A."""
    highest = np.clip(tested, low, high)
    if np.isinf(highest).any():
        raise InputError(
            f"nothing says how high the current of coil {np.argmax(np.isinf(highest))} may be; "
            "expected: devices with a tested current or a range of current, or a coil driver with "
            "a highest current"
        )
    return highest


def lowest(context: RunContext) -> NDArray:
    """Lowest current of the supply; 0 where it has no limit."""
    return np.where(np.isfinite(context.low), context.low, 0.0)


class OpenLoop(Controller):
    """Commands that depend on the time alone."""

    @abstractmethod
    def commands(self, context: RunContext) -> tuple[NDArray, NDArray]:
        """Commands and the instants from which they hold.

        Parameters
        ----------
        context : RunContext
            Information about the run.

        Returns
        -------
        time : numpy.ndarray, shape (n,), s
            Increasing from 0.
        current : numpy.ndarray, shape (n, n_channels), A
        """

    def reset(self, context: RunContext) -> None:
        """Work the commands out, for the form in plain Python."""
        self._time, self._current = self.commands(context)

    def schedule(self, context: RunContext) -> Schedule:
        """All commands, as worked out in ``reset``."""
        return Schedule(self._time, self._current)

    def current(self, t: float, measurement: Any) -> NDArray:
        """Look the command up that holds at this instant."""
        # an instant reached by adding up periods may fall short of the table's by rounding
        k = np.searchsorted(self._time, t * (1 + 1e-12), side="right") - 1
        return self._current[k]


class Held(OpenLoop):
    """One current a coil during the whole run."""

    @abstractmethod
    def held(self, context: RunContext) -> Any:
        """Return the current to hold: one for all coils or one per coil, A."""

    def commands(self, context: RunContext) -> tuple[NDArray, NDArray]:
        """One command, from the start."""
        current = np.empty((1, len(context.low)))
        current[0] = self.held(context)
        return np.zeros(1), current
