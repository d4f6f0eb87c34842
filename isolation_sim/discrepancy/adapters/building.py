"""Diagnosis of building records: structure and isolation layer against the measurement."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...laws import Device
from ...structures import IsolatedStructure
from .. import inference
from ..building.causes.candidate import TYPICAL_PERIOD
from ..building.causes.isolator_causes import LAYER_NUMBERS
from ..building.comparison import (
    BuildingComparison,
    CauseValues,
    FittedBuilding,
    compare_building,
    coordinates,
    is_at_bound,
    values_of,
    with_causes,
)
from ..building.errors import (
    excess_error,
    mean_error,
    relative_errors,
    relative_noise,
    squared_blocks,
)
from ..building.filter_search import with_likeliest_filter
from ..building.goodness_of_fit import cell_p_values, is_quiet, noise_chance, p_value
from ..building.isolator_effects import ISOLATOR_EFFECTS, LAYER_CAUSES
from ..building.localisation import ISOLATION_LAYER, UnknownForce, unknown_force
from ..building.model import BuildingModel, building_model, total_force_scale
from ..building.next_test import next_test
from ..building.record import BuildingRecord
from ..building.record_checks import (
    check_quantities,
    record_problems,
    unit_factor_in_words,
    unmeasured_floors,
    without_offsets,
)
from ..building.search.searches import search_causes
from ..building.segment import Segment, band_edges, cell_means
from ..building.switching import switching_error
from ..decisions import (
    DEPENDENCE_LEVEL,
    INSTEAD,
    LEAST_BUILDING_SHARE,
    MISFIT_LEVEL,
    SWITCHING,
    TURNED,
)
from ..diagnosis import Cause, Errors, Interval, Trace, worst_first
from ..interval import percent
from ..problem import Evaluation, Problem, Text
from ..residuals import Dependence, of_building, significant
from ..search import Round, SearchResult


class BuildingRecords(Problem[FittedBuilding]):
    """Building records against an engineer's model."""

    def __init__(
        self,
        records: Sequence[BuildingRecord],
        isolated: IsolatedStructure,
        most_causes: int,
        progress: Callable[[str], None],
    ):
        self.records = tuple(without_offsets(record) for record in records)
        self.most_causes, self.progress = most_causes, progress
        for record in self.records:
            check_quantities(record)
        self._model = building_model(isolated, self.records)
        self.data_name = ", ".join(record.name for record in self.records)
        self.model_name = f"{isolated.structure.name} on {isolated.elements[0].device.name}"

    def nominal(self) -> FittedBuilding:
        """Estimate the noise and simulate the engineer's model."""
        self.progress("estimating the noise")
        self.first = compare_building(self._model, self.records).with_best_current()
        self.engineers = self.first.evaluate(())
        if not is_quiet(self.first, self.engineers):
            self._take_if_much_better(with_likeliest_filter(self.first))
        self._take_if_much_better(self.first.with_best_ground()[0])
        # a late current is nearer if held: that only counts if it leaves noise alone
        held = self.first.with_best_sampling()[0]
        nominal = held.evaluate(())
        if is_quiet(held, nominal):
            self.first, self.engineers = held, nominal
        self.records = self.first.records
        return self.engineers

    def _take_if_much_better(self, other: BuildingComparison, causes: CauseValues = ()) -> None:
        """Compare under another assumption that leaves noise alone, or far less of the misfit.

        Beside something that is wrong, a slightly better assumption is no evidence.
        """
        best = other.fit((), causes)
        # by the noise as it is seen with the better one: the other counts its error as noise
        under_it = other.as_assumed_by(self.first)
        left = sum(other.above_noise(best))
        left_by_first = sum(under_it.above_noise(under_it.fit((), causes)))
        if is_quiet(other, best) or left < INSTEAD**2 * left_by_first:
            self.first, self.engineers = other, other.evaluate(())

    def search(self, base: FittedBuilding) -> SearchResult[FittedBuilding]:
        """Search for causes, and fit the model again without each of them."""
        result, explained = self._searched()
        first, nearest = self.first, result.best
        if not nearest.cause_values and result.rounds and result.rounds[-1].tried:
            nearest = result.rounds[-1].tried[0]
        causes = nearest.cause_values
        if causes and not explained:
            # beside a cause, what a filter removed is little of the misfit
            self._take_if_much_better(with_likeliest_filter(first, causes), causes)
        if self.first is not first:
            self.records = self.first.records
            result, explained = self._searched()
        self.imitations: tuple[str, ...] = ()
        self.switching = 0.0 if explained else self._switching()
        self.unknown: UnknownForce | None = None
        if self.switching > 0:
            result = replace(result, best=self.space.before)
        else:
            self.unknown = self._unknown_force(result.best)
        self.progress("measuring the gain")
        if self.unknown is not None:
            best = self.space.comparison.fit((), self.unknown.beside)
            self.imitations = tuple(c for c in result.best.causes if c not in best.causes)
            result = replace(result, best=best)
        self.without = self.space.without_each(result.best) if result.best.cause_values else []
        return result

    def _searched(self) -> tuple[SearchResult[FittedBuilding], bool]:
        """Search for causes; also whether they explain the records."""
        self.space, result = search_causes(self.first, self.most_causes, self.progress)
        chance = noise_chance(self.space.comparison, result.best)
        return result, self.space.explains(result.best, chance)

    def _unknown_force(self, best: FittedBuilding) -> UnknownForce | None:
        """An unknown force that leaves far less than causes which leave more than noise."""
        chance = noise_chance(self.space.comparison, best)
        if chance >= MISFIT_LEVEL and self.space.explains(best, chance):
            return None
        return unknown_force(self.space.comparison, self.space.before, best.cause_values)

    def _switching(self) -> float:
        """Error by unknown moments of the current's changes where the model misses no more."""
        comparison, least = self.space.comparison, np.inf
        for held_out in (False, True):
            error = switching_error(comparison, held_out)
            if excess_error(comparison, self.space.before, held_out) > SWITCHING * error:
                return 0.0
            least = min(least, error)
        return least

    @property
    def lacks_force_elsewhere(self) -> bool:
        """Whether the model lacks an unknown force in the structure."""
        return self.unknown is not None and self.unknown.place != ISOLATION_LAYER

    def dependences(self, base: FittedBuilding) -> list[Dependence]:
        """Analyse the residual of the acceleration of the whole, the isolation layer's force."""
        each = [(record, axis) for record in self.records for axis in record.axes]
        return of_building(
            [
                record.mean_acceleration(self.first.residual((), record), axis)
                for record, axis in each
            ],
            [_variables(record, axis) for record, axis in each],
        )

    def evaluate(self, result: SearchResult[FittedBuilding]) -> Evaluation:
        """Compare all channels before and after, and test both for noise alone."""
        comparison, before, after = self.space.comparison, self.space.before, result.best
        chance = {
            label: noise_chance(comparison, outcome)
            for label, outcome in (("before", before), ("after", after))
        }
        errors = [
            Errors(*(mean_error(comparison, one, held) for held in (False, True)))
            for one in (before, after)
        ]
        removed, adequate = self.space.removed_share(after), chance["before"] >= MISFIT_LEVEL
        return Evaluation(
            errors[0],
            errors[1],
            Errors(*(relative_noise(comparison, held) for held in (False, True))),
            0.0 if adequate else 1.0 - removed,
            adequate,
            self.space.explains(after, chance["after"]),
            squared_blocks(comparison, (before, after)),
            {
                "adequacy_p_value": chance,
                "expected_model_error": comparison.model_error,
                "remark": f"{_of_data(after)}{self._unknown_text()}".strip(),
            },
        )

    def causes(self, result: SearchResult[FittedBuilding], evaluation: Evaluation) -> list[Cause]:
        """Causes with their shares of the misfit that all of them remove."""
        best, space = result.best, self.space
        split = inference.shares(
            [one.held_out_cost for one in self.without], best.held_out_cost,
            space.removed_share(best),
        ) if best.cause_values else []  # fmt: skip
        numbers = intervals(space.comparison, best)
        return [
            Cause(
                name=cause.name,
                share=split[k],
                p_value=p_value(space.comparison, self.without[k], best),
                parameters=numbers[k],
                reason=self._reason(best, k, numbers[k]),
                confusable_with=tuple(one.causes[-1] for one in space.rivals[cause.label]),
                form=cause.form,
                place=cause.place,
                doubtful=split[k] < LEAST_BUILDING_SHARE and _mends_a_form(best, k),
            )
            for k, (cause, _) in enumerate(best.cause_values)
        ]

    def _reason(self, best: FittedBuilding, k: int, numbers: dict[str, Interval]) -> str:
        comparison, without = self.space.comparison, self.without[k]
        errors = [percent(mean_error(comparison, one, True)) for one in (without, best)]
        what = best.cause_values[k][0].says.format(
            **{name: one.value for name, one in numbers.items()}
        )
        segment = comparison.held_out[0]
        gain = cell_means(without.held_out[0]) - cell_means(best.held_out[0])
        return (
            f"If {what.replace('%', ' %')}, the error on data not fitted falls from "
            f"{errors[0]} to {errors[1]} %, most of it in "
            f"{_cell(segment, int(np.argmax(gain * segment.cell_sizes)))}."
            + _remedy(best.cause_values[k][0].name, numbers)
        )

    def depends_on(
        self, dependences: Sequence[Dependence], causes: Sequence[Cause], evaluation: Evaluation
    ) -> tuple[str, ...]:
        """Variables, then the channel and band in which the residual exceeds the noise most."""
        if evaluation.adequate:
            return ()
        segment, whitened = self.first.fitted[0], self.engineers.fitted[0]
        named = significant(dependences)
        if self.unknown is not None:
            named = (self.unknown.words, *named)
        if self.switching > 0:
            named = ("the current between its samples", *named)
        if cell_p_values(segment, whitened).min() < DEPENDENCE_LEVEL:
            excess = (cell_means(whitened) - segment.expected) * segment.cell_sizes
            named = (*named, _cell(segment, int(np.argmax(excess))))
        return named

    def next_test(
        self, result: SearchResult[FittedBuilding], causes: Sequence[Cause]
    ) -> str | None:
        """The ground motion scaled, or another current, where the first rivals differ most."""
        doubts = [
            (cause.label, self.space.rivals[cause.label][0])
            for cause, _ in result.best.cause_values
            if self.space.rivals[cause.label]
        ]
        return next_test(self.space.comparison, result.best, *doubts[0]) if doubts else None

    def devices(self, result: SearchResult[FittedBuilding]) -> tuple[None, Device | None]:
        """The device of all isolators, if a cause changes it."""
        model = with_causes(self._model, result.best.cause_values)
        return None, extended_device(model) if model.effects else None

    def building(self, result: SearchResult[FittedBuilding]) -> IsolatedStructure:
        """Structure and isolators with the causes in them."""
        return with_causes(self._model, result.best.cause_values).assembled

    def traces(self, result: SearchResult[FittedBuilding]) -> tuple[Trace, ...]:
        """Each channel in each segment of a record."""
        return traces_of(self.space.comparison, (self.space.before, result.best))

    @cached_property
    def _problems(self) -> tuple[tuple[str, str], ...]:
        """Names of records, and suspicious features."""
        return tuple(
            (record.name, problem)
            for record in self.records
            for problem in (
                *record_problems(record),
                *unmeasured_floors(record, self._model.structure),
                *record.notes,
                *self._switching_problem(record),
            )
        )

    def _switching_problem(self, record: BuildingRecord) -> tuple[str, ...]:
        """Say that a current was recorded too slowly, where it limits the diagnosis."""
        if not self.switching > 0:
            return ()
        return (
            f"the current is known every {1e3 * record.dt:g} ms alone: changes between the samples "
            f"make errors of {percent(self.switching)} % (record it at the rate of its controller)",
        )

    @property
    def data_notes(self) -> tuple[str, ...]:
        """Return suspicious features of the records."""
        return tuple(f"{name}: {problem}" for name, problem in self._problems)

    def data_text(self) -> Text:
        """Suspicious features of the records."""
        rows = self._problems
        return Text(
            "Units, clipping, a start at rest, and the displacement against the accelerations: "
            + ("see below." if rows else "nothing amiss."),
            ("record", "problem"),
            rows,
        )

    def noise_text(self) -> Text:
        """Noise of each channel, and which data are fitted."""
        comparison = self.space.comparison
        fitted, held_out = (
            ", ".join(_time(segment) for segment in segments)
            for segments in (comparison.fitted, comparison.held_out)
        )
        rows = tuple(
            (record.name, channel, f"{own:.2e}", f"{total:.2e}", percent(total / rms))
            for record, floor in zip(comparison.records, comparison.floors, strict=True)
            for channel, own, total, rms in zip(
                record.channels, floor.own, floor.total,
                np.sqrt(np.mean(record.values**2, axis=0)), strict=True,
            )
        )  # fmt: skip
        ground = ", ".join(f"{size:.2e}" for floor in comparison.floors for size in floor.ground)
        return Text(
            f"Size seen above {comparison.floors[0].band:.1f} Hz, colour in the quiet half of each "
            "record; noise of the measured ground motion "
            f"({ground} m/s2) simulated. Fitted: {fitted}. Held out: {held_out}. The "
            f"weights allow for an error of any model, {percent(comparison.model_error)} %.",
            ("record", "channel", "sensor", "with the ground's", "% of RMS"),
            rows,
        )

    def model_text(self, evaluation: Evaluation) -> Text:
        """Chance of the nominal model's residuals."""
        chance = evaluation.details["adequacy_p_value"]["before"]
        return Text(
            "Residuals as large as these, in the channel and band where they are largest, have "
            f"the chance {chance:.2g} if there is noise alone."
        )

    def trials_text(self, tried: Round[FittedBuilding]) -> Text:
        """Mean squares that each cause leaves, and its chance."""
        sizes = sum(weighted.size for weighted in tried.base.held_out)
        before = [cause.label for cause, _ in tried.base.cause_values]
        taken, best = (
            _added(tried.base, one)[0] for one in (tried.taken or tried.base, tried.tried[0])
        )
        outcome = (
            f"{_and(taken)} {'are' if len(taken) > 1 else 'is'} taken." if taken
            else f"{_and(best)} is best, and is not taken: its improvement, its size or its gain "
            "on data not fitted does not stand out from chance."
        )  # fmt: skip
        return Text(
            (f"Beside {_and(before)}: " if before else "") + outcome,
            ("cause", "form", "mean square of fitted data", "of held-out data", "p"),
            tuple(
                (
                    *map(_and, _added(tried.base, one)), f"{one.variance:.3f}",
                    f"{one.held_out_cost / sizes:.3f}",
                    f"{self.space.chances[one]:.1e}",
                )
                for one in tried.tried
            ),
        )  # fmt: skip

    def outcome_text(
        self, result: SearchResult[FittedBuilding], evaluation: Evaluation, causes: Sequence[Cause]
    ) -> Text:
        """Chance of what remains, and the errors on data not fitted, channel by channel."""
        chance = evaluation.details["adequacy_p_value"]["after"]
        comparison = self.space.comparison
        before, after = (
            relative_errors(comparison, one, True) for one in (self.space.before, result.best)
        )
        return Text(
            f"What remains has the chance {chance:.2g} if there is noise alone. "
            + evaluation.details["remark"],
            ("channel", "error on data not fitted before, %", "after, %"),
            tuple(
                (channel, f"{100 * b:.2f}", f"{100 * a:.2f}")
                for channel, b, a in zip(self.records[0].channels, before, after, strict=True)
            ),
        )

    def _unknown_text(self) -> str:
        """The unknown force against the causes that it stands for."""
        if self.switching > 0:
            return (
                " The current is known at its samples alone. Changes at other moments between them "
                f"make errors of {percent(self.switching)} % and more, as large as those of the "
                "model: no cause is named."
            )
        if self.unknown is None:
            return ""
        beside = [cause.label for cause, _ in self.unknown.beside]
        sentences = (
            f" With {self.unknown.words}"
            f"{' beside ' * bool(beside)}{', '.join(beside)}, chosen freely at every frequency, "
            f"{percent(max(self.unknown.left, 0.0))} % of the misfit would remain"
        )
        found = bool(beside) or bool(self.imitations)
        left = percent(self.unknown.left_by_causes)
        sentences += f"; with all causes that were found, {left} % do." if found else "."
        if self.imitations:
            sentences += f" They only imitate it: {', '.join(self.imitations)}."
        return sentences


def extended_device(model: BuildingModel) -> Device:
    """All isolators in one device, as a scenario has it."""
    return replace(model.device, force_scale=total_force_scale(model))


def traces_of(
    comparison: BuildingComparison, outcomes: Sequence[FittedBuilding]
) -> tuple[Trace, ...]:
    """Channels of each segment, measured and by two models."""
    return worst_first(
        trace
        for segments, held_out in ((comparison.fitted, False), (comparison.held_out, True))
        for segment in segments
        for trace in _segment_traces(segment, held_out, comparison, outcomes)
    )


def intervals(comparison: BuildingComparison, outcome: FittedBuilding) -> list[dict[str, Interval]]:
    """95 % intervals of all causes' numbers; the noise counts as far as it is independent."""
    half = np.zeros(outcome.n_parameters)
    if outcome.optimum is not None:
        # as many residuals as are independent carry the same sum of squares
        half = inference.half_widths(
            outcome.optimum.jacobian,
            outcome.cost / outcome.n_independent,
            comparison.fitted_noise,
        )
    numbers, at = [], 0
    for cause, values in outcome.cause_values:
        x = coordinates(cause.parameters, values)
        width = half[at : at + len(x)]
        lower, upper = (
            np.clip(values_of(cause.parameters, end), [p.lower for p in cause.parameters],
                    [p.upper for p in cause.parameters])
            for end in (x - width, x + width)
        )  # fmt: skip
        fixed = {name: Interval(v, v, v, "1") for name, v in cause.numbers}
        fitted = {
            p.name: Interval(
                v * p.factor, float(a * p.factor), float(b * p.factor), p.unit,
                is_at_bound(p, v),
            )
            for p, v, a, b in zip(cause.parameters, values, lower, upper, strict=True)
        }  # fmt: skip
        numbers.append({**fixed, **fitted})
        at += len(x)
    return numbers


def _variables(record: BuildingRecord, axis: str) -> dict[str, NDArray]:
    """Quantities that a residual along a direction could depend on, each (n,)."""
    from scipy.ndimage import maximum_filter1d

    x, dt = record.displacement(axis), record.dt
    half = max(int(TYPICAL_PERIOD / 2 / dt), 1)
    size = np.abs(x)
    amplitude = maximum_filter1d(size, 2 * half + 1, mode="nearest")
    result = {
        "isolator displacement": x,
        "isolator velocity": np.gradient(x, dt),
        "present amplitude times displacement": amplitude * x,
        "largest past displacement times displacement": np.maximum.accumulate(size) * x,
        "time": record.time,
    }
    if record.current is not None and np.ptp(record.current) > 0:
        result["coil current"] = record.current
        result["coil current times displacement"] = record.current * x
    return result


def _cell(segment: Segment, k: int) -> str:
    """Channel and band of a cell."""
    band, channel = divmod(k, len(segment.record.channels))
    edges, frequency = band_edges(len(segment.frequencies)), segment.frequencies
    low, high = frequency[edges[band]], frequency[edges[band + 1] - 1]
    return f"{segment.record.channels[channel]} at {low:.1f} to {high:.1f} Hz"


def _time(segment: Segment) -> str:
    start, stop, _ = segment.samples.indices(len(segment.record))
    dt = segment.record.dt
    return f"{segment.record.name}, {start * dt:.1f} to {stop * dt:.1f} s"


def _segment_traces(
    segment: Segment,
    held_out: bool,
    comparison: BuildingComparison,
    outcomes: Sequence[FittedBuilding],
) -> Iterator[Trace]:
    record, samples = segment.record, segment.samples
    simulated = [record.values - comparison.residual(one.cause_values, record) for one in outcomes]
    time = record.time[samples]
    where = record.name
    if len(time) < len(record):
        where += f" from {time[0]:.4g} s" if samples.start else f" to {time[-1]:.4g} s"
    for k, sensor in enumerate(record.sensors):
        factor = 1e3 if sensor.is_displacement else 1.0
        measured, before, after = (
            factor * values[samples, k] for values in (record.values, *simulated)
        )
        yield Trace(
            name=f"{where}, {sensor.words}",
            held_out=held_out,
            time=time,
            across=time,
            across_label="time, s",
            label=_LABELS[sensor.unit],
            measured=measured,
            before=before,
            after=after,
            group=sensor.axis,
            size=factor * float(np.sqrt(np.mean(record.values[:, k] ** 2))),
        )


def _of_data(best: FittedBuilding) -> str:
    """Say that the model of the building is right where all causes are faults of the data."""
    causes = [cause for cause, _ in best.cause_values]
    if not causes or not all(cause.name.startswith("sensor_") for cause in causes):
        return ""
    return " All causes are faults of the data: the model of the building needs none."


def _added(base: FittedBuilding, one: FittedBuilding) -> tuple[list[str], list[str]]:
    """Labels and forms of the causes that a model has beyond those of another."""
    new = [cause for cause, _ in one.cause_values[len(base.cause_values) :]]
    return [cause.label for cause in new], [cause.form for cause in new if cause.form]


def _and(words: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


def _mends_a_form(best: FittedBuilding, k: int) -> bool:
    """Whether a cause may mend the form of another one: of its place, or an effect of its layer."""
    causes = [cause for cause, _ in best.cause_values]
    cause, others = causes[k], causes[:k] + causes[k + 1 :]
    if cause.place:
        return any(one.place == cause.place for one in others)
    effects = {*ISOLATOR_EFFECTS, *LAYER_CAUSES}.difference(LAYER_NUMBERS)
    return cause.name in LAYER_NUMBERS and any(one.name in effects for one in others)


def _remedy(name: str, numbers: dict[str, Interval]) -> str:
    """What to do about a fault of the data that is no error of calibration."""
    if name == "sensor_exchange":
        return " Exchange the two columns, and diagnose again."
    if name != "sensor_gain":
        return ""
    gain = numbers["gain"].value
    if abs(gain + 1) < TURNED:
        return (
            " Its sign is turned: multiply the column by -1, or import it with sign = -1, and "
            "diagnose again."
        )
    units = unit_factor_in_words(gain)
    return f" This is the factor between {units}: correct the unit of the column." if units else ""


_LABELS = {
    "m": "displacement, mm",
    "m/s2": "acceleration, m/s²",
    "rad": "rotation, mrad",
    "rad/s2": "rotation, rad/s²",
}
"""Quantity and unit in charts, by the channel's unit."""
