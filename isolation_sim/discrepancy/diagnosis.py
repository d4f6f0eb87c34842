"""Results of a diagnosis: the verdict, the causes with their parameters, and the steps."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked
from ground_motions.old_names import renamed_attribute

from ..io.files import plain
from ..io.results_folder import writing_to
from ..rendering import Printed, render
from .device.generic_terms import OUTSIDE
from .interval import Interval
from .verdict import NOTHING_PREDICTS, Verdict, meaning

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from ..laws import Device
    from ..structures import IsolatedStructure
    from .consequence import Consequence
    from .planned_tests import TestPlan
    from .tiers.result import Ladder


@dataclass(frozen=True)
class Cause:
    """One cause of the misfit.

    Attributes
    ----------
    name : str
        As in the catalogue; outside of it, the quantity that the residual depends on.
    share : float
        Part of the misfit above the noise that it removes, 0 to 1, on data not fitted.
    p_value : float
        Chance of such an improvement if the cause were absent.
    parameters : mapping of str to Interval
        Its numbers.
    reason : str
        Why it is named, in one sentence.
    confusable_with : tuple of str
        Causes that the data do not distinguish from it.
    form : str
        Form of the effect that was chosen, or the law of a term outside the catalogue.
    stability : mapping of str to float
        Share of fits from other runs in which the cause is named again: ``conditions_left_out``,
        without the runs of one condition at a time, and ``runs_resampled``. Empty where it is not
        computed.
    place : str
        Storey, floor or channel of it in a building; empty where there is only one.
    doubtful : bool
        Whether it is one of several and corrects less than what all of them leave, or in a law of
        the wrong family.
    """

    name: str
    share: float
    p_value: float
    parameters: Mapping[str, Interval]
    reason: str
    confusable_with: tuple[str, ...] = ()
    form: str = ""
    stability: Mapping[str, float] = field(default_factory=dict)
    place: str = ""
    doubtful: bool = False

    evidence = renamed_attribute("evidence", "reason")

    @property
    def acts_like(self) -> bool:
        """Whether something else may act like it: a parameter at its bound, or ``doubtful``."""
        return self.doubtful or any(one.at_bound for one in self.parameters.values())

    @property
    def is_named(self) -> bool:
        """Whether it is a cause of the catalogue, and nothing else is known to act like it."""
        return self.name != OUTSIDE and not self.acts_like

    @property
    def label(self) -> str:
        """The name as a report shows it."""
        return f"acts like {self.name}" if self.acts_like else self.name

    @property
    def placed(self) -> str:
        """The label with the place."""
        return f"{self.label} ({self.place})" if self.place else self.label


@dataclass(frozen=True)
class Step:
    """One step on the way to the diagnosis, for the report.

    Attributes
    ----------
    title : str
        Description of the step.
    text : str
        Result, in plain sentences.
    headings : tuple of str
        Of the table, if there is one.
    rows : tuple of tuple of str
        The table.
    figure : str
        Name of the figure that belongs to it, if there is one; see ``Diagnosis.plot``.
    """

    title: str
    text: str
    headings: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    figure: str = ""


@dataclass(frozen=True, eq=False)
class Trace:
    """A run as measured, and as simulated before and after.

    Attributes
    ----------
    name : str
        Of the run.
    held_out : bool
        Whether it was held out of the fit.
    time, across : (n,) array
        Time (s), and the quantity that the run is drawn against.
    across_label, label : str
        Names and units of ``across`` and of the rest.
    measured, before, after : (n,) array
        In the unit that ``label`` says.
    group : str
        What figures show some runs of each of, such as a direction; empty where all are alike.
    size : float, optional
        RMS by which errors are ranked, in the unit that ``label`` says: of a whole record, whose
        quiet end matters less; None for that of ``measured``.
    settled : int
        The first sample that counts in errors: what is before it depends on how the run began,
        which is unknown.
    """

    name: str
    held_out: bool
    time: NDArray
    across: NDArray
    across_label: str
    label: str
    measured: NDArray
    before: NDArray
    after: NDArray
    group: str = ""
    size: float | None = None
    settled: int = 0


@checked
def relative_error(trace: Trace, simulated: NDArray) -> float:
    """RMS of a run's residual over RMS of the measured value.

    Parameters
    ----------
    trace : Trace
        The run.
    simulated : (n,) array
        Its ``before`` or ``after``.

    Returns
    -------
    float
        Not a number where nothing was measured.
    """
    measured = trace.measured[trace.settled :]
    size = float(np.sum(measured**2))
    residual = simulated[trace.settled :] - measured
    return float(np.sqrt(np.sum(residual**2) / size)) if size else np.nan


@checked
def worst_first(traces: Iterable[Trace]) -> tuple[Trace, ...]:
    """Sort runs by their errors before.

    Parameters
    ----------
    traces : iterable of Trace
        Runs.

    Returns
    -------
    tuple of Trace
        The largest relative error first.
    """

    def rank(run: Trace) -> float:
        if not run.size:
            return relative_error(run, run.before)
        return float(np.sqrt(np.mean((run.before - run.measured) ** 2))) / run.size

    return tuple(sorted(traces, key=rank, reverse=True))


@checked
def groups_in_turn(traces: Iterable[Trace]) -> tuple[Trace, ...]:
    """Sort runs so that the first ones are of all groups.

    Parameters
    ----------
    traces : iterable of Trace
        Runs.

    Returns
    -------
    tuple of Trace
        Of each group in turn, the one with the largest relative error before.
    """
    groups: dict[str, list[Trace]] = {}
    for trace in worst_first(traces):
        groups.setdefault(trace.group, []).append(trace)
    turns = zip_longest(*groups.values())
    return tuple(trace for turn in turns for trace in turn if trace is not None)


@dataclass(frozen=True)
class Errors:
    """RMS of the residual over RMS of the measured values, pooled over runs.

    Attributes
    ----------
    fit, held_out : float
        On the fitted and on the held-out runs; not a number where there are none.
    """

    fit: float
    held_out: float

    @property
    def least(self) -> float:
        """The smaller one of those that exist."""
        return float(np.fmin(self.fit, self.held_out))


@dataclass(frozen=True, eq=False)
class Diagnosis(Printed):
    """Errors of a simulation and their causes.

    Attributes
    ----------
    data : str
        The diagnosed data.
    model : str
        The simulation that was evaluated.
    verdict : str
        "adequate", "explained", "partly_explained" or "unexplained".
    noise_floor : float
        Error that noise alone leaves on the fitted runs, relative like the errors.
    error_before, error_after : Errors
        Of the simulation as it was, and with the causes in it.
    causes : tuple of Cause
        Those that remove most first.
    unexplained_share : float
        Part of the misfit above the noise that remains, 0 to 1.
    depends_on : tuple of str
        Variables that the residual depends on, before any cause was found; of a building first the
        place of an unknown force, where causes only imitate it.
    next_test : str or None
        The test that best distinguishes the causes that these data do not distinguish.
    steps : tuple of Step
        How it was found.
    nominal : Device or None
        The device of the nominal model, with its fitted or prescribed parameters.
    extended : Device or None
        The device with the causes in it; None where nothing was found in the device.
    gain : (float, float) or None
        95 % interval of the held-out error's reduction, as a fraction.
    traces : tuple of Trace
        The runs, to draw.
    consequence : Consequence or None
        Consequence of the error for a controlled building; None if not requested.
    details : mapping of str to object
        More plain numbers, for the JSON.
    ladder : Ladder or None
        Errors with causes, with an equation and with a learned term; None if not requested.
    data_notes : tuple of str
        What looks wrong in the data, such as loops that run the wrong way round.
    held_out_noise_floor : float
        Error that noise alone leaves on the held-out runs; not a number where it is not known.
    test_plan : TestPlan or None
        Tests that tell confusable causes apart, and conditions that were not tested; None for data
        other than a campaign of device tests.
    """

    data: str
    model: str
    verdict: Verdict
    noise_floor: float
    error_before: Errors
    error_after: Errors
    causes: tuple[Cause, ...]
    unexplained_share: float
    depends_on: tuple[str, ...]
    next_test: str | None
    steps: tuple[Step, ...]
    nominal: Device | None = None
    extended: Device | None = None
    gain: tuple[float, float] | None = None
    traces: tuple[Trace, ...] = ()
    consequence: Consequence | None = None
    details: Mapping[str, Any] = field(default_factory=dict)
    ladder: Ladder | None = None
    data_notes: tuple[str, ...] = ()
    held_out_noise_floor: float = float("nan")
    test_plan: TestPlan | None = None

    judged = renamed_attribute("judged", "nominal")

    @property
    def meaning(self) -> str:
        """The verdict in a sentence."""
        ladder = self.ladder
        not_measured = ladder.inexplicable if ladder is not None else float("nan")
        unpredicted = ladder is None and NOTHING_PREDICTS in self.details
        noise = self.noise.held_out
        before, left = self.error_before.held_out, self.unexplained_share
        named = all(cause.is_named for cause in self.causes)
        return meaning(self.verdict, before, noise, left, named, not_measured, unpredicted)

    @property
    def noise(self) -> Errors:
        """Errors that noise alone leaves; as on the fitted runs where only that is known."""
        held_out = self.held_out_noise_floor
        return Errors(self.noise_floor, self.noise_floor if np.isnan(held_out) else held_out)

    def to_dict(self) -> dict[str, Any]:
        """Return everything but steps and traces as plain numbers and text.

        Returns
        -------
        dict
            As ``diagnose --json`` prints it; None where a number does not exist.
        """
        return plain({
            "data": self.data,
            "model": self.model,
            "verdict": self.verdict,
            "noise_floor": self.noise_floor,
            "held_out_noise_floor": self.held_out_noise_floor,
            "error_before": self.error_before,
            "error_after": self.error_after,
            "gain_held_out": self.gain or None,
            "causes": [vars(cause) | {"acts_like": cause.acts_like} for cause in self.causes],
            "unexplained_share": self.unexplained_share,
            "depends_on": self.depends_on,
            "next_test": self.next_test,
            "test_plan": self.test_plan.to_dict() if self.test_plan else None,
            "data_notes": self.data_notes,
            **({"consequence": self.consequence.to_dict()} if self.consequence else {}),
            **({"ladder": self.ladder.to_dict()} if self.ladder else {}),
            **self.details,
        })  # fmt: skip

    def to_json(self) -> str:
        """Return ``to_dict`` as JSON text.

        Returns
        -------
        str
        """
        return json.dumps(self.to_dict(), indent=2, allow_nan=False)

    def _shown(self) -> Iterator[Any]:
        yield from render("diagnosis:shown", self)

    def __repr__(self) -> str:
        before, after, noise = (
            100 * (error.fit if np.isnan(error.held_out) else error.held_out)
            for error in (self.error_before, self.error_after, self.noise)
        )
        causes = ", ".join(cause.placed for cause in self.causes) or "no cause"
        return (
            f"{type(self).__name__}({self.model} against {self.data}: {self.verdict}, {causes}; "
            f"error {before:.3g} % to {after:.3g} %, noise {noise:.3g} %)"
        )

    @property
    def criteria(self) -> dict[str, float]:
        """Relative RMS errors before and after, the noise floors and the unexplained share."""
        return {
            "error_before": self.error_before.fit,
            "error_after": self.error_after.fit,
            "held_out_error_before": self.error_before.held_out,
            "held_out_error_after": self.error_after.held_out,
            "noise_floor": self.noise_floor,
            "held_out_noise_floor": self.held_out_noise_floor,
            "unexplained_share": self.unexplained_share,
        }

    def to_pandas(self) -> pandas.DataFrame:
        """Return the causes with their numbers.

        Returns
        -------
        pandas.DataFrame
            A row for each parameter of each cause: ``cause``, ``form``, ``place``, ``share``,
            ``p_value``, ``parameter``, ``unit``, ``value``, ``low``, ``high``, ``at_bound``.
        """
        import pandas

        columns = ["cause", "form", "place", "share", "p_value", "parameter", "unit", "value",
                   "low", "high", "at_bound"]  # fmt: skip
        rows = [
            (cause.name, cause.form, cause.place, cause.share, cause.p_value, name, one.unit,
             one.value, one.low, one.high, one.at_bound)
            for cause in self.causes
            for name, one in cause.parameters.items()
        ]  # fmt: skip
        return pandas.DataFrame(rows, columns=columns)

    def plot(self) -> Figure:
        """Draw measured runs against simulated ones, before and after, and the errors of all runs.

        Returns
        -------
        matplotlib.figure.Figure
        """
        return render("diagnosis_figures:overview", self)

    @checked
    def save(self, folder: str | Path, overwrite: bool = False) -> list[Path]:
        """Write ``diagnosis.json``, ``extended_law.toml``, the report and the figures.

        Parameters
        ----------
        folder : str or pathlib.Path
            Made if it does not exist.
        overwrite : bool
            Whether a saved result and files of the same name are replaced.

        Returns
        -------
        list of pathlib.Path
            The files, each written under a temporary name and renamed.

        Raises
        ------
        InputError
            If the folder cannot be written, or contains a saved result or a file of the same name
            and ``overwrite`` is false.
        """
        with writing_to(folder):
            return render("html.diagnosis_report:save_diagnosis", self, Path(folder), overwrite)


@dataclass(frozen=True, eq=False)
class BuildingDiagnosis(Diagnosis):
    """Errors of a building's simulation and their causes.

    Attributes
    ----------
    building : IsolatedStructure or None
        Structure and isolators with the causes in them, to be simulated like the nominal one.
        Errors of a sensor, or between a command and the coil, are no part of it.
    """

    building: IsolatedStructure | None = None
