"""The result of one run: trajectory, criteria, energies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ground_motions import Record, ResponseSpectrum
from ground_motions.argument_types import checked
from ground_motions.old_names import renamed_attribute

from ..archive import FILE, save_archive
from ..criterion import Criteria, labels_of, saved_criterion
from ..errors import InputError, check_name
from ..io.files import write_netcdf
from ..io.results_folder import files_into
from ..rendering import Printed, render
from ..written_names import as_written
from .contact import contacts_of_lane, contacts_of_outputs, stops
from .outputs import level_dofs
from .plausibility import end_state, input_warnings, saved_end_state
from .tested_range import TestComparison, compare_with_tests, peak_currents
from .trajectory import Trajectory, dataset
from .validity import validity_lines

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from ..criterion import Criterion
    from .ledger import Ledger


_SAVED = (
    "isolated", "records", "controller", "source", "clamped", "steps", "unresolved", "accuracy",
    "outputs", "values", "states", "current", "command", "criteria", "energy", "peaks",
    "test_comparison", "implausible", "decisions", "cautions", "end", "contacts",
    "refined_accelerations",
)  # fmt: skip
"""Saved and pickled attributes of a run."""
_REFINED = 0.0025
"""Longest step of the accelerations for floor spectra, s: 20 in the shortest usual period."""


def decisions_of(runs: Mapping[str, Run]) -> list[str]:
    """Reports of the controllers on their decisions, by the name to print."""
    return [f"{as_written(name)}: {run.decisions}" for name, run in runs.items() if run.decisions]


class Run(Printed, Trajectory):
    """Result of one run; its quantities are computed on first use.

    Its arrays over time are those of `isolation_sim.simulation.trajectory.Trajectory`.

    Attributes
    ----------
    isolated : IsolatedStructure
        The plant.
    records : tuple of Record
        Ground motion, one per direction.
    controller : str
        Name of the controller.
    source : str
        Source of the controller, for citations.
    decisions : str
        The controller's report on its decisions, such as the current that ``best_constant`` found;
        empty for most.
    cautions : tuple of str
        The controller's warnings about its use under these conditions.
    clamped : int
        Number of commands clamped to the driver's limits.
    steps : int
        Number of integration steps, with rejected ones.
    unresolved : int
        Number of steps that missed the tolerance at the smallest step size, or at the largest
        number of steps in a segment, as with a force that jumps repeatedly.
    accuracy : float
        Tolerance met by all steps: the target, or a larger value if some are unresolved.
    """

    selected: tuple[Criterion, ...] = ()
    # runs saved by older versions have none of these
    source = ""
    decisions = ""
    cautions: tuple[str, ...] = ()
    reached = renamed_attribute("reached", "accuracy")
    reached_of_tests = renamed_attribute("reached_of_tests", "test_comparison")

    def __getstate__(self) -> dict[str, Any]:
        """Data for all reports, without the simulation's working memory."""
        labels = {"labels": labels_of(self.selected)}
        return {name: getattr(self, name) for name in _SAVED} | labels

    def __setstate__(self, state: dict[str, Any]) -> None:
        saved = dict(state)
        labels = saved.pop("labels", ())
        vars(self).update(saved)
        self.selected = tuple(saved_criterion(*each) for each in labels)

    def __repr__(self) -> str:
        motion = ", ".join(record.name for record in self.records)
        base = 1e3 * self.criteria["peak_base_displacement_m"]
        floor = self.criteria["peak_floor_acceleration_m_s2"]
        return (
            f"Run({self.controller}; {self.isolated.structure.name}, {motion}; peak base "
            f"displacement {base:.4g} mm, floor acceleration {floor:.4g} m/s^2)"
        )

    def _shown(self) -> Iterator[Any]:
        yield render("tables:run_table", self)
        yield from (f"warning: {each}" for each in self.warnings())
        yield from decisions_of({self.controller: self})

    @checked
    def save(self, folder: str | Path, overwrite: bool = False) -> Path:
        """Write the run; ``isolation_sim.load`` loads it again.

        Parameters
        ----------
        folder : str or pathlib.Path
            Created if it is missing; gets ``result.npz`` and ``history.nc``.
        overwrite : bool, default False
            Whether to replace the files of a result that is in the folder. Other files stay.

        Returns
        -------
        pathlib.Path
            The folder.

        Raises
        ------
        InputError
            If the folder contains a saved result or a file of the same name.
        """
        with files_into(folder, overwrite) as place:
            write_netcdf(self.history, place / "history.nc")
            save_archive(self, place / FILE)
        return Path(folder)

    def to_xarray(self) -> xarray.Dataset:
        """Return the histories; the same as ``history``.

        Returns
        -------
        xarray.Dataset
        """
        return self.history

    def to_pandas(self) -> pandas.DataFrame:
        """Return all outputs over time.

        Returns
        -------
        pandas.DataFrame
            One column per output, named with its unit, and per coil current; the index is the
            time in s.
        """
        import pandas

        table = pandas.DataFrame(
            self.values, pandas.Index(self.time, name="time_s"), list(self.outputs.names)
        )
        for channel in range(self.current.shape[1]):
            table[f"coil{channel}_current_A"] = self.current[:, channel]
        return table

    @cached_property
    def history(self) -> xarray.Dataset:
        """All time histories, with named axes and units."""
        return dataset(self)

    @cached_property
    def energy(self) -> Ledger:
        """Energy ledger of the run."""
        from .ledger import ledger

        return ledger(self)

    @cached_property
    def criteria(self) -> dict[str, float]:
        """Peaks and RMS values, and selected criteria; see ``isolation_sim.criteria``."""
        from .run_criteria import criteria_of_lanes

        result = criteria_of_lanes([self.isolated], self.work)
        criteria = Criteria({name: float(values[0]) for name, values in result.items()})
        vars(self)["criteria"] = criteria  # the selected ones may use the others
        for one in self.selected:
            if one.name in criteria:
                raise InputError(
                    f"criterion {one.name} is one of every run; expected: another name"
                )
            criteria[one.name] = one.value(self)
        return criteria

    @cached_property
    def peaks(self) -> dict[str, NDArray]:
        """Peaks of each level, storey or slab, (n_items,); see ``simulation.outputs``."""
        from .run_criteria import item_peaks

        return item_peaks(self.isolated, self.work)

    @cached_property
    def test_comparison(self) -> TestComparison:
        """Peak deformations and currents, with those of the device tests."""
        currents = peak_currents(self.work)
        return compare_with_tests(self.isolated, self.modes, self.work, self.criteria, currents)

    @cached_property
    def implausible(self) -> tuple[str, ...]:
        """Return warnings about implausible structures, isolators and ground motions."""
        return input_warnings(self.isolated, self.modes, self.records)

    @cached_property
    def end(self) -> tuple[bool, float]:
        """Whether the building still moves at the end, and the displacement where it stays."""
        if "work" in vars(self):
            return end_state(self.isolated, self.modes, self.work)
        return saved_end_state(self.isolated, self.time, self.values)

    @cached_property
    def contacts(self) -> dict[str, int]:
        """Number of contacts with each moat wall or end stop, by the element's name."""
        if "work" in vars(self):
            return contacts_of_lane(self.isolated, self.modes, self.work)
        if not stops(self.isolated):  # outputs at all samples take as long as a simulation
            return {}
        return contacts_of_outputs(self.isolated, self.outputs.names, self.values)

    @cached_property
    def refined_accelerations(self) -> NDArray:
        """Absolute accelerations of all levels, m/s^2, in the order of the floor spectra.

        They are at equal steps within each sample, of 2.5 ms or less, (n_steps, n_levels * n_axes):
        a current that switches makes them jump, and waves behind a jump are shorter than samples.
        """
        from .pieces import refined_outputs

        dofs = level_dofs(self.isolated.structure).ravel()
        names = [f"{self.isolated.structure.names[dof]}_acceleration_m_s2" for dof in dofs]
        if "work" not in vars(self):  # saved by an older version
            return np.column_stack([self.output(name) for name in names])
        return refined_outputs(self, names, int(np.ceil(self.records[0].dt / _REFINED)))

    def warnings(self) -> list[str]:
        """Return warnings about the validity of the results.

        Returns
        -------
        list of str
            Elements beyond the tested deformation, coils beyond the tested current, clamped
            commands, implausible structures and ground motions, a building that moves or is
            displaced at the end, contacts with moat walls and end stops, and cautions of the
            controller.
        """
        return validity_lines({self.controller: self})

    @checked
    def floor_spectra(
        self,
        periods: ArrayLike | None = None,
        damping: float = 0.05,
        direction: str | None = None,
    ) -> dict[str, ResponseSpectrum]:
        """Return the response spectra of the absolute accelerations of all levels.

        Parameters
        ----------
        periods : array_like, shape (m,), optional, s
            Undamped natural periods; 60 from 0.05 to 5 s by default.
        damping : float, default 0.05
            Damping ratio of the oscillators, such as equipment on a floor.
        direction : str, optional
            Horizontal direction of ground motion; the first by default.

        Returns
        -------
        dict of str to ground_motions.ResponseSpectrum
            By the name of the level's dof, from below.

        Raises
        ------
        InputError
            If there is no such direction, or an argument cannot be used.
        """
        structure = self.isolated.structure
        names = structure.horizontal
        if direction is not None:
            check_name("direction", direction, names)
        column = 0 if direction is None else names.index(direction)
        if periods is None:
            periods = np.geomspace(0.05, 5.0, 60)
        dofs = level_dofs(structure)
        refined = self.refined_accelerations
        step = self.records[0].duration / (len(refined) - 1)
        result = {}
        for dof, floor in zip(dofs[:, column], refined.T[column :: dofs.shape[1]], strict=True):
            name = structure.names[dof]
            result[name] = Record(floor, step, name=name).spectrum(periods, damping)
        return result

    @checked
    def plot(
        self, direction: str | None = None, element: str | None = None, width_in: float = 7.2
    ) -> Figure:
        """Draw the run on one page: time histories, loop, peaks over the height, energies.

        Parameters
        ----------
        direction : str, optional
            Direction of ground motion of the histories; the first by default.
        element : str, optional
            Name of the element of the loop; the first along that direction by default.
        width_in : float, default 7.2, inches
            Width. Up to 5 inches, as for one column of 3.5 inches, all panels are below each other.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InputError
            If there is no such direction or element, or the width is below 3 inches.
        """
        return render("figures:run_figure", self, direction, element, width_in)
