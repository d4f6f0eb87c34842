"""The result of one run: trajectory, criteria, energies."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..rendering import render
from ..structures.sizing import implausible
from .tested_range import Reached, of_runs, reached
from .trajectory import Trajectory

if TYPE_CHECKING:
    import xarray

    from .ledger import Ledger


class Run(Trajectory):
    """What happened in one run; everything is computed when it is first used.

    Its arrays over time are those of `isolation_sim.simulation.trajectory.Trajectory`.

    Attributes
    ----------
    isolated : IsolatedStructure
        The plant.
    records : tuple of Record
        Ground motion, one a direction.
    controller : str
        Name of the controller.
    clamped : int
        Commands that were clamped to the driver's limits.
    steps : int
        Integration steps taken, rejected ones included.
    unresolved : int
        Steps that missed the tolerance when the smallest size, or the work allowed in a part of the
        run, was reached; as at a force that jumps back and forth.
    reached : float
        Tolerance that all steps meet: the wanted one unless some are unresolved.
    """

    @cached_property
    def history(self) -> xarray.Dataset:
        """Everything over time, with named axes and units."""
        from .history import dataset

        return dataset(self)

    @cached_property
    def energy(self) -> Ledger:
        """Where the energy came from and where it went."""
        from .ledger import ledger

        return ledger(self)

    @cached_property
    def criteria(self) -> dict[str, float]:
        """Peaks and RMS values of the response; see ``isolation_sim.criteria``."""
        from .summary import summary

        found = summary([self.isolated], self.work)
        return {name: float(values[0]) for name, values in found.items()}

    @cached_property
    def peaks(self) -> dict[str, NDArray]:
        """Peaks of each level, storey or slab, (n_items,); see ``simulation.quantities``."""
        from .summary import item_peaks

        return item_peaks(self.isolated, self.work)

    @cached_property
    def reached_of_tests(self) -> Reached:
        """Peak deformations and currents beside those at which the devices were tested."""
        return reached(self.isolated, self.modes, self.work, self.criteria)

    @cached_property
    def implausible(self) -> list[str]:
        """Tell of periods that no building has."""
        values = self.modes.eigenvalues
        swinging = np.abs(values[np.abs(values.imag) > 1e-6 * np.abs(values)])
        return implausible(self.isolated, 2 * np.pi / float(np.min(swinging, initial=np.inf)))

    def warnings(self) -> list[str]:
        """Tell what a reader must know before trusting the numbers.

        Returns
        -------
        list of str
            Elements that deform further than their law was tested, coils with more current than
            was tested, commands that were clamped, and periods that no building has.
        """
        told = [*self.implausible, *of_runs({self.controller: self})]
        if self.clamped:
            told.append(
                f"{self.controller}: {self.clamped} commands were clamped to the supply's limits"
            )
        return told

    def plot(self, **options: Any) -> Any:
        """Figure of the run; see ``isolation_sim.reports.figures.run_figure``."""
        return render("figures:run_figure", self, **options)
