"""Several controllers on one plant under one ground motion."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ground_motions.argument_types import checked

from .criteria import criteria
from .criterion import Criteria
from .errors import Diverged, InputError, RefusedCurrent, check_name
from .io.results_folder import files_into
from .rendering import Printed, render
from .simulation.result import decisions_of
from .simulation.validity import validity_lines
from .written_names import as_written

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure
    from rich.console import RenderableType

    from .simulation.result import Run

UNCONTROLLED = "passive_off"
"""Controller of the reference run of J1 to J9."""

OPTIMUM = "clairvoyant"
"""Registered name of the full-information optimum: a bound, never the best controller."""

_FIGURES = {
    "time_histories": "time_histories",
    "loops": "loops",
    "loops_in_plan": "loops_in_plan",
    "currents": "currents",
    "floor_envelopes": "floor_envelopes",
    "floor_spectra": "floor_spectra",
    "energy": "energy_figure",
}
"""Function of ``isolation_sim.reports.figures`` by the kind of figure."""


@checked
class Comparison(Printed):
    """Results of several controllers on one plant under one ground motion.

    It prints as its table.

    Parameters
    ----------
    runs : mapping of str to Run
        Runs by the name to print.
    reference : str, optional
        Name of the reference run of J1 to J9; that of the controller ``"passive_off"`` by default.
        Without such a run there are no J1 to J9.
    diverged : mapping of str to Diverged or RefusedCurrent, optional
        Errors of the runs that diverged or whose controller failed, by the name to print.
    fixed_base : Run, optional
        The building without isolation under the same ground motion, for comparison.

    Attributes
    ----------
    runs : dict of str to Run
        The runs.
    diverged : dict of str to Diverged or RefusedCurrent
        Time and cause of the runs that diverged or whose controller failed (`ControllerError`) or
        commanded a current out of range (`RefusedCurrent`).
    reference : str or None
        Name of the reference run of J1 to J9.

    Raises
    ------
    InputError
        If there are no runs, they differ in dofs or ground motion, or the reference is not one of
        them.
    """

    def __init__(
        self,
        runs: Mapping[str, Run],
        reference: str | None = None,
        diverged: Mapping[str, Diverged | RefusedCurrent] | None = None,
        fixed_base: Run | None = None,
    ):
        if not runs:
            raise InputError("a comparison has no runs; expected: one run or more")
        if reference is not None:
            check_name("reference run", reference, runs)
        self.runs, self.diverged = dict(runs), dict(diverged or {})
        self.reference = reference_name(runs) if reference is None else reference
        self.fixed_base = fixed_base
        (first, like), *others = self.runs.items()
        if fixed_base is not None and fixed_base.records != like.records:
            raise InputError("the fixed-base run has another ground motion; expected: the same")
        for name, run in others:
            for what, differ in (
                ("dofs", run.isolated.structure.names != like.isolated.structure.names),
                ("ground motion", run.records != like.records),
            ):
                if differ:
                    raise InputError(
                        f"runs {first!r} and {name!r} differ in {what}; expected: controllers on "
                        "one plant under one ground motion"
                    )

    @cached_property
    def criteria(self) -> dict[str, dict[str, float]]:
        """Criteria of each run, SI units; with J1 to J9 if there is a reference."""
        if self.reference is None:
            return {name: run.criteria for name, run in self.runs.items()}
        reference = self.runs[self.reference]
        return {name: Criteria(criteria(run, reference)) for name, run in self.runs.items()}

    @cached_property
    def energy(self) -> dict[str, dict[str, float]]:
        """Energies of each run at its end, J, and the closure error, relative to peak input."""
        return {
            name: {"closure_error": float(run.energy.closure_error)}
            | {key: float(value) for key, value in run.energy.final.items()}
            for name, run in self.runs.items()
        }

    @property
    def baseline(self) -> dict[str, dict[str, float]]:
        """Criteria of the fixed-base run by its name, SI units; empty if there is none."""
        run = self.fixed_base
        return {} if run is None else {run.controller: run.criteria}

    @property
    def optima(self) -> tuple[str, ...]:
        """Names of the runs with full information of the motion: optima, not controllers."""
        return tuple(name for name, run in self.runs.items() if run.controller == OPTIMUM)

    @property
    def title(self) -> str:
        """Names of the structure and the ground motion."""
        run = next(iter(self.runs.values()))
        motion = ", ".join(record.name for record in run.records)
        return f"{run.isolated.structure.name}, {motion}"

    def failures(self) -> list[str]:
        """Return the names of the runs that diverged or whose controller failed.

        Returns
        -------
        list of str
            One line per run: its name, the time and the cause.
        """
        return [
            f"{as_written(name)} has no result: {error}" for name, error in self.diverged.items()
        ]

    def warnings(self) -> list[str]:
        """Return warnings about the validity of the results.

        Returns
        -------
        list of str
            Elements beyond the tested deformation, coils beyond the tested current, clamped
            commands, implausible periods, contacts with moat walls and end stops, and cautions of
            the controllers.
        """
        return validity_lines(self.runs)

    def verdict(self) -> list[str]:
        """Describe the best controllers, and what controllers report on their decisions.

        Returns
        -------
        list of str
            Two sentences, then laws of unknown field work, and such as the current that
            ``best_constant`` found.
        """
        unknown = render("verdict:unknown_energies", self.runs)
        return [*render("verdict:verdict", self), *unknown, *decisions_of(self.runs)]

    def table(self) -> RenderableType:
        """Build the table of criteria and energies in engineering units.

        Returns
        -------
        rich.console.RenderableType
            One column per controller; split into parts if wider than the terminal. An asterisk
            marks the best of a row.
        """
        return render(
            "tables:criteria_tables",
            self.criteria,
            self.energy,
            self.title,
            self.baseline,
            self.optima,
        )

    def to_records(self) -> list[dict[str, str | float]]:
        """List the runs as flat records, for CSV.

        Returns
        -------
        list of dict
            One per run: ``controller``, its criteria and ``energy_`` with each energy, SI units.
            The fixed-base run is the last one, with criteria only.
        """
        records: list[dict[str, str | float]] = [
            {"controller": name}
            | self.criteria[name]
            | {f"energy_{key}": value for key, value in self.energy[name].items()}
            for name in self.runs
        ]
        return records + [{"controller": name} | values for name, values in self.baseline.items()]

    @checked
    def plot(
        self,
        kind: str = "time_histories",
        direction: str | None = None,
        element: str | None = None,
    ) -> Figure:
        """Draw one figure of all runs.

        Parameters
        ----------
        kind : {"time_histories", "loops", "loops_in_plan", "currents", "floor_envelopes", \
                "floor_spectra", "energy"}
            Figure of ``isolation_sim.reports.figures``.
        direction : str, optional
            Direction of the time histories and floor spectra; the first by default.
        element : str, optional
            Name of the element of the loops; the first by default.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InputError
            If there is no such figure, direction or element.
        """
        check_name("figure", kind, _FIGURES)
        options = {"time_histories": direction, "floor_spectra": direction, "loops": element}
        chosen = [options[kind]] if kind in options else []
        runs = dict(self.runs)
        if kind == "floor_envelopes" and self.fixed_base is not None:
            runs[self.fixed_base.controller] = self.fixed_base
        return render(f"figures:{_FIGURES[kind]}", runs, *chosen)

    @checked
    def to_html(self, path: str | Path, scenario: str = "") -> Path:
        """Write a report that opens in any browser: tables, linked charts, an animation.

        Parameters
        ----------
        path : str or pathlib.Path
            File to write; replaced completely or not at all.
        scenario : str
            TOML of the scenario of the runs, for the report.

        Returns
        -------
        pathlib.Path
            The file; it needs no network.
        """
        return render("html.run_report:run_report", self, scenario).write(path)

    def _shown(self) -> Iterator[Any]:
        yield self.table()
        yield from self.failures()
        isolated = next(iter(self.runs.values())).isolated
        yield from (f"{key}: {value}" for key, value in isolated.facts().items())
        yield from (f"warning: {each}" for each in self.warnings())
        yield from self.verdict()

    @checked
    def save(
        self,
        folder: str | Path,
        scenario: str = "",
        figures: bool = False,
        overwrite: bool = False,
    ) -> Path:
        """Write all results; ``isolation_sim.load`` loads the comparison again.

        Parameters
        ----------
        folder : str or pathlib.Path
            Made if it does not exist.
        scenario : str
            TOML of the scenario of the runs, saved with them.
        figures : bool, default False
            Whether to draw figures, each as SVG and PNG.
        overwrite : bool, default False
            Whether to replace the files of a result that is in the folder. Other files stay.

        Returns
        -------
        pathlib.Path
            The folder; its ``README.txt`` lists the files.

        Raises
        ------
        InputError
            If the folder contains a saved result or a file of the same name.
        """
        with files_into(folder, overwrite) as place:
            render("html.run_report:write_comparison", self, place, scenario, figures)
        return Path(folder)

    def to_pandas(self) -> pandas.DataFrame:
        """Return criteria and energies.

        Returns
        -------
        pandas.DataFrame
            One row per run, one column per criterion and energy, SI units.
        """
        import pandas

        return pandas.DataFrame(self.to_records()).set_index("controller")

    def to_xarray(self) -> xarray.Dataset:
        """Return the histories of all runs, with the axis ``controller``.

        Returns
        -------
        xarray.Dataset
        """
        import xarray

        histories = [run.history for run in self.runs.values()]
        names = xarray.DataArray(list(self.runs), dims="controller", name="controller")
        return xarray.concat(histories, names, combine_attrs="drop_conflicts")

    def __getstate__(self) -> dict[str, Any]:
        names = ("runs", "diverged", "reference", "fixed_base")
        return {name: getattr(self, name) for name in names}

    def __repr__(self) -> str:
        return f"Comparison({', '.join(self.runs)}; reference={self.reference!r})"

    def __rich__(self) -> RenderableType:
        return self.table()


def simulated(
    names: Iterable[str],
    run: Callable[[str], Run],
    fixed_base: Callable[[], Run | None] = lambda: None,
) -> Comparison:
    """Compare runs; a diverged run or a failed controller does not stop the others."""
    runs: dict[str, Run] = {}
    diverged: dict[str, Diverged | RefusedCurrent] = {}
    for name in names:
        try:
            runs[name] = run(name)
        except (Diverged, RefusedCurrent) as error:
            diverged[name] = error
    if diverged and not runs:
        raise next(iter(diverged.values()))
    return Comparison(runs, diverged=diverged, fixed_base=fixed_base())


def reference_name(runs: Mapping[str, Run]) -> str | None:
    """Name of the run of ``passive_off``, whatever its label; else of the run with this label."""
    alike = (name for name, run in runs.items() if run.controller == UNCONTROLLED)
    return next(alike, UNCONTROLLED if UNCONTROLLED in runs else None)


@checked
def json_report(comparison: Comparison) -> dict[str, Any]:
    """Report of a comparison as data for JSON.

    Parameters
    ----------
    comparison : Comparison
        Runs to report.

    Returns
    -------
    dict
        ``{"runs": [{"controller": ..., "criteria": {...}, "energy": {...}}, ...]}`` with the
        criteria of `isolation_sim.criteria.criteria` and, in ``energy``, ``closure_error`` and the
        energies at the end of the run (J); plain floats. ``"diverged": [{"controller": ...,
        "reason": ...}, ...]`` lists the runs that have no result, of failed controllers too.
        ``"warnings": [...]`` has the warnings of ``Comparison.warnings``. ``"fixed_base": {...}``
        has the criteria of the fixed-base run, if there is one.
    """
    report: dict[str, Any] = {
        "runs": [
            {
                "controller": name,
                "criteria": comparison.criteria[name],
                "energy": comparison.energy[name],
            }
            for name in comparison.runs
        ],
        "diverged": [
            {"controller": name, "reason": str(error)}
            for name, error in comparison.diverged.items()
        ],
        "warnings": comparison.warnings(),
    }
    if comparison.fixed_base is not None:
        report["fixed_base"] = comparison.fixed_base.criteria
    return report
