"""Controllers whose commands are known before the run."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.simulation.control import RunContext, Schedule

from .controller import Controller


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
