"""The results of a sweep, read from its folder."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.files import atomic_write

from ..criterion import saved_criterion
from ..errors import InputError, check_name
from ..rendering import Printed, render
from ..simulation.validity import Validity, validity_lines_of_many

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from .plan import SweepPlan

_ACCOUNT = ("controller", "status", "reason", *Validity._fields)


@checked
class Sweep(Printed):
    """Results of a sweep.

    Parameters
    ----------
    folder : str or pathlib.Path
        Folder of a sweep, finished or unfinished.

    Attributes
    ----------
    folder : pathlib.Path
        The folder.

    Raises
    ------
    InputError
        If there is no sweep.
    """

    def __init__(self, folder: str | Path):
        from .store import Store

        self.folder = Path(folder)
        self._store = Store(folder)
        self._manifest = self._store.read_manifest()
        for each in self._manifest.get("criteria", ()):
            saved_criterion(*each)

    @cached_property
    def plan(self) -> SweepPlan:
        """The plan with its scenario."""
        from .plan import SweepPlan

        if "plan" not in self._manifest:
            raise InputError(
                f"{self.folder}: made of Python objects, without a plan; expected: a sweep of "
                "a plan, or a suite of a scenario"
            )
        return SweepPlan.from_dict(self._manifest["plan"], source=str(self._store.manifest))

    @property
    def name(self) -> str:
        """Name of the plan."""
        return str(self._manifest.get("name") or self.plan.name)

    @property
    def sampled(self) -> bool:
        """Whether quantities were sampled, so that there are sensitivities."""
        return "plan" in self._manifest and self.plan.sample is not None

    @cached_property
    def table(self) -> pandas.DataFrame:
        """One row per finished run.

        ``case``, the varied quantities, ``controller``, ``status``, ``reason``, ``clamped``,
        ``deformation_over_tested`` and ``current_over_tested`` (peaks over those of the tests of
        the laws; 0 without tests), ``unresolved`` (steps that missed the tolerance),
        ``moving_at_end``, ``displacement_at_end`` (over the base's peak), ``implausible`` and
        ``cautions`` (warnings as text), ``contacts`` (with moat walls and end stops), then
        criteria and energies in SI units.
        """
        import pandas

        return pandas.DataFrame(self._store.read())

    @property
    def finished(self) -> bool:
        """Whether all runs are finished."""
        return self._store.table.is_file()

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """Varied quantities."""
        columns = list(self.table.columns)
        return tuple(columns[1 : columns.index("controller")])

    @cached_property
    def criteria(self) -> tuple[str, ...]:
        """Columns of results with energies, without criteria that the structure lacks."""
        from .rows import optional_names

        columns = list(self.table.columns)
        result = columns[1 + max(columns.index(name) for name in _ACCOUNT if name in columns) :]
        optional = [name for name in optional_names() if name in result]
        unknown = [name for name in optional if self.table[name].isna().all()]
        return tuple(name for name in result if name not in unknown)

    @cached_property
    def controllers(self) -> tuple[str, ...]:
        """Labels of the controllers."""
        return tuple(self.table["controller"].unique())

    @cached_property
    def reference(self) -> str | None:
        """Label of the controller ``passive_off``, to which ratios refer; None without it."""
        from .rows import place_of_reference

        named = self._manifest.get("controllers") or {
            entry.shown: entry.name for entry in self.plan.scenario.controller
        }
        place = place_of_reference(named.values())
        return None if place is None else list(named)[place]

    @cached_property
    def counts(self) -> dict[str, int]:
        """Number of runs by status, without reading the whole table."""
        values, counts = np.unique(self._store.read(["status"])["status"], return_counts=True)
        return dict(zip(values.tolist(), counts.tolist(), strict=True))

    @property
    def failed(self) -> pandas.DataFrame:
        """Rows of the failed runs, with the reasons."""
        return self.table[self.table["status"] != "ok"]

    def warnings(self) -> list[str]:
        """Return warnings about the validity of the results.

        Returns
        -------
        list of str
            Each kind with the number of runs: beyond the tested deformations or currents,
            implausible structures and ground motions, a building that moves or is displaced at the
            end, contacts with moat walls and end stops, cautions of controllers, missed tolerances,
            clamped commands.
        """
        # a table of an earlier release has some of the columns
        known = [name for name in _ACCOUNT if name in self.table]
        return validity_lines_of_many({name: self.table[name].to_numpy() for name in known})

    @checked
    def best(
        self, criterion: str = "peak_floor_acceleration_m_s2", count: int = 5
    ) -> pandas.DataFrame:
        """Return the runs with the best value of a criterion.

        Parameters
        ----------
        criterion : str
            Column of results. The best value is the smallest, or the largest of a gain.
        count : int, default 5
            Number of runs.

        Returns
        -------
        pandas.DataFrame
            Rows of the table, the best first. Of a controller's runs with equal results, as those
            over a quantity that it does not depend on, only the first is listed.

        Raises
        ------
        InputError
            If there is no such criterion, or the count is below 1.
        """
        from ..criteria import is_gain

        check_name("criterion", criterion, self.criteria)
        if count < 1:
            raise InputError("best", f"{count}", "1 or more")
        good = self.table[self.table["status"] == "ok"].sort_values(
            criterion, ascending=not is_gain(criterion), kind="stable"
        )
        return good.drop_duplicates(["controller", *self.criteria]).head(count)

    @checked
    def sensitivity(
        self, criterion: str = "peak_floor_acceleration_m_s2", controller: str | None = None
    ) -> pandas.DataFrame:
        """Return the sensitivity indices of a criterion, by SALib.

        Parameters
        ----------
        criterion : str
            Column of results.
        controller : str, optional
            Label of one; the first by default.

        Returns
        -------
        pandas.DataFrame
            One row per quantity. Columns: Sobol indices S1 and ST of a saltelli sample; mu_star
            and sigma of a morris sample, in the criterion's unit; otherwise S1 by random balance
            designs. Columns ending in ``_conf`` contain half the width of the 95 % interval.

        Raises
        ------
        InputError
            If nothing was sampled, runs are missing or failed, or SALib is not installed.
        """
        from .sensitivity import indices

        check_name("criterion", criterion, self.criteria)
        label = self.one_controller(controller)
        values = self.table.loc[self.table["controller"] == label, criterion].to_numpy()
        return indices(self.plan, values, str(self.folder), label)

    @checked
    def history(self, case: int, controller: str | None = None) -> xarray.Dataset:
        """Return a run's time histories, if the plan saves them.

        Parameters
        ----------
        case : int
            Number of the case.
        controller : str, optional
            Label of one; the first by default.

        Returns
        -------
        xarray.Dataset

        Raises
        ------
        InputError
            If they were not saved.
        """
        from ..simulation.run_files import read_run
        from .chunk import history_name

        return read_run(self._store.histories / history_name(case, self.one_controller(controller)))

    @cached_property
    def floors(self) -> xarray.Dataset | None:
        """Peaks of each level and storey, and floor spectra; None if the plan saves none.

        ``floor_spectrum_m_s2`` is the absolute acceleration of an oscillator of 5 % damping on a
        floor, over ``case``, ``controller``, ``direction``, ``level`` and ``period_s``. The peaks
        ``peak_floor_acceleration_m_s2``, ``peak_drift_m`` and, where the heights are known,
        ``peak_drift_ratio`` are those of the vectors over the directions, over ``level`` or
        ``storey``. All are in SI units; NaN for a run without a result.
        """
        from ..io.columns import read_columns
        from ..simulation.floors import of_runs
        from .chunk import FLOORS, history_name

        cases = list(dict.fromkeys(self.table["case"].tolist()))
        paths = [
            [
                self._store.histories / history_name(case, label, FLOORS)
                for label in self.controllers
            ]
            for case in cases
        ]
        if not any(path.is_file() for row in paths for path in row):
            return None
        return of_runs(
            [[read_columns(path) if path.is_file() else None for path in row] for row in paths],
            {"case": cases, "controller": list(self.controllers)},
        )

    @checked
    def to_csv(self, path: str | Path) -> Path:
        """Write the table as CSV.

        Parameters
        ----------
        path : str or pathlib.Path
            File to write, replaced whole or not at all.

        Returns
        -------
        pathlib.Path
            The file.
        """
        with atomic_write(path) as unfinished:
            self.table.to_csv(unfinished, index=False)
        return Path(path)

    @checked
    def to_html(self, path: str | Path, criterion: str = "peak_floor_acceleration_m_s2") -> Path:
        """Write a report with interactive charts, which opens in any browser.

        Parameters
        ----------
        path : str or pathlib.Path
            File to write, replaced whole or not at all.
        criterion : str
            Initial criterion.

        Returns
        -------
        pathlib.Path
            The file; it needs no network.

        Raises
        ------
        InputError
            If there is no such criterion.
        """
        return render("html.sweep_report:sweep_report", self, criterion).write(path)

    @checked
    def plot_comparison(self, criteria: Sequence[str] | None = None) -> Figure:
        """Draw medians and spreads of the criteria over the cases, for all controllers.

        Parameters
        ----------
        criteria : sequence of str, optional
            Columns of results; the peaks by default.

        Returns
        -------
        matplotlib.figure.Figure
        """
        return render("sweep_figures:comparison", self, criteria)

    @checked
    def plot_map(
        self,
        x: str | None = None,
        y: str | None = None,
        criterion: str = "peak_floor_acceleration_m_s2",
    ) -> Figure:
        """Draw a criterion over two varied quantities, one panel per controller.

        Parameters
        ----------
        x, y : str, optional
            Varied quantities; the first two by default. The map shows the median over further
            varied quantities.
        criterion : str
            Column of results.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InputError
            If fewer than two numerical quantities are varied, or a name is unknown.
        """
        return render("sweep_figures:heat_map", self, x, y, criterion)

    @checked
    def plot_sensitivity(
        self, criterion: str = "peak_floor_acceleration_m_s2", controller: str | None = None
    ) -> Figure:
        """Draw the sensitivity indices of a criterion; see `sensitivity`.

        Parameters
        ----------
        criterion : str
            Column of results.
        controller : str, optional
            Label of one; the first by default.

        Returns
        -------
        matplotlib.figure.Figure
        """
        return render("sweep_figures:sensitivity", self, criterion, controller)

    plot = plot_comparison

    def _shown(self) -> Iterator[Any]:
        yield render("sweep_tables:controllers_table", self)
        yield from (f"warning: {each}" for each in self.warnings())

    def to_pandas(self) -> pandas.DataFrame:
        """Return the table; the same as ``table``.

        Returns
        -------
        pandas.DataFrame
        """
        return self.table

    def to_xarray(self) -> xarray.Dataset:
        """Return the table as arrays.

        Returns
        -------
        xarray.Dataset
            Each column of ``table`` over the axes ``case`` and ``controller``; NaN for missing
            runs.
        """
        return self.table.set_index(["case", "controller"]).to_xarray()

    def __reduce__(self) -> tuple[type[Sweep], tuple[str]]:
        return Sweep, (str(self.folder.absolute()),)

    def one_controller(self, label: str | None) -> str:
        """Return a controller's label, the first by default.

        Parameters
        ----------
        label : str or None
            Label.

        Returns
        -------
        str

        Raises
        ------
        InputError
            If there is no such controller.
        """
        if label is None:
            return self.controllers[0]
        check_name("controller", label, self.controllers)
        return label

    def __repr__(self) -> str:
        state = f"{len(self.table)} runs" if self.finished else "unfinished"
        return f"Sweep({str(self.folder)!r}, {state})"
