"""Fit of causes to building records: residuals weighted by the noise, differences for slopes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...identification.least_squares import Optimum, levenberg_marquardt
from ..decisions import (
    FITTED_ENERGY,
    MOST_NOISE,
    QUIET_ENERGY,
    SCREENING_STEPS,
)
from ..inference import at_bound
from .causes.candidate import Candidate, Parameter, Values
from .causes.isolator_causes import CURRENT_CAUSES
from .frequency_response import end_response, frequency_response
from .model import JUMPS, BuildingModel
from .noise import NoiseFloor, noise_floor
from .record import MINIMUM_SAMPLES, BuildingRecord
from .segment import Segment, make_segment, without_channel, without_force

_STEP = 1e-3
_MOST_STEPS = 15
_CACHED_BYTES = 4e8
"""Memory, about, for simulations that a search meets again."""

CauseValues = tuple[tuple[Candidate, Values], ...]
"""Causes with their numbers."""


@dataclass(frozen=True, eq=False)
class FittedBuilding:
    """How well a model with some causes follows the records."""

    cause_values: CauseValues  # tuple of (Candidate, tuple of float): The causes in it
    fitted: tuple[NDArray, ...]  # Weighted residuals of each part; see ``Segment.whiten``
    # Simulates the same of what was not fitted; most causes that are tried are dropped without it
    weigh_held_out: Callable[[], tuple[NDArray, ...]]
    # Of the fit, in the fit's coordinates; None where nothing was fitted
    optimum: Optimum | None = None

    @cached_property
    def cost(self) -> float:
        """Sum of squared weighted residuals where it was fitted."""
        return squared(self.fitted)

    @cached_property
    def held_out(self) -> tuple[NDArray, ...]:
        """Weighted residuals of each part that was not fitted."""
        return self.weigh_held_out()

    @cached_property
    def held_out_cost(self) -> float:
        """The same where it was not."""
        return squared(self.held_out)

    @property
    def causes(self) -> tuple[str, ...]:
        """Labels of the causes in it."""
        return tuple(cause.label for cause, _ in self.cause_values)

    @property
    def n(self) -> int:
        """Number of residuals where it was fitted."""
        return sum(part.size for part in self.fitted)

    @property
    def n_parameters(self) -> int:
        """Numbers of all causes."""
        return sum(len(values) for _, values in self.cause_values)

    @property
    def variance(self) -> float:
        """Mean square of the weighted residuals; 1 for noise alone."""
        return self.cost / self.n

    @cached_property
    def n_independent(self) -> float:
        """Number of independent residuals."""
        # A remainder that is no noise sits at few frequencies; what it is spread over counts (its
        # participation number), against that of noise of the same variance.
        power = np.concatenate([(part**2).sum(axis=2).ravel() for part in self.fitted])
        return self.n * float(min(2 * power.mean() ** 2 / np.mean(power**2), 1.0))

    @property
    def at_bound(self) -> bool:
        """Whether a number of the last cause lies at its bound, so that others may act like it."""
        if not self.cause_values:
            return False
        cause, values = self.cause_values[-1]
        return any(is_at_bound(p, v) for p, v in zip(cause.parameters, values, strict=True))

    def criterion(self, n: float) -> float:
        """Schwarz's criterion; the less the better."""
        return n * np.log(self.cost) + self.n_parameters * np.log(n)


@dataclass(eq=False)
class BuildingComparison:
    """Records against a model, with the noise of each.

    Attributes
    ----------
    model : BuildingModel
        Without causes.
    records : tuple of BuildingRecord
        All of them.
    floors : tuple of NoiseFloor
        Noise of each.
    fitted, held_out : tuple of Segment
        Fitted and held-out data.
    model_error : float
        Error to be expected of any model, as ``make_segment`` takes it.
    middle : int or None
        Sample of the last record from which it is held out, 0 of several; None where records were
        chosen to be held out.
    _cache : dict
        Simulations by record, last sample and causes.
    """

    model: BuildingModel
    records: tuple[BuildingRecord, ...]
    floors: tuple[NoiseFloor, ...]
    fitted: tuple[Segment, ...]
    held_out: tuple[Segment, ...]
    model_error: float = 0.0
    middle: int | None = None
    _cache: dict = field(default_factory=dict)

    @property
    def seen(self) -> NDArray:
        """Channels that show more signal than noise in some record, (n_channels,) of bool."""
        # a rotation of a symmetric building is noise, whose relative error says nothing
        shares = [
            floor.total / np.sqrt(np.mean(record.values**2, axis=0))
            for floor, record in zip(self.floors, self.records, strict=True)
        ]
        return np.min(shares, axis=0) < MOST_NOISE

    def segments(self, held_out: bool) -> tuple[Segment, ...]:
        """Held-out data, or those that are fitted."""
        return self.held_out if held_out else self.fitted

    def residual(
        self, result: CauseValues, record: BuildingRecord, end: int | None = None
    ) -> NDArray:
        """Measured less predicted, (n, n_channels), in the channels' units."""
        end = len(record) if end is None else end
        shown = slice(0, end)
        if record.filter:
            end = min(end + record.filter.reach(record.dt), len(record))
        # most of what changes between two calls is a sensor's error, which needs no simulation
        moved = tuple((c, v) for c, v in result if not c.of_sensor)
        key = (record.name, end, *moved)
        if key not in self._cache:
            if sum(run.nbytes for run in self._cache.values()) > _CACHED_BYTES:
                self._forget()
            self._cache[key] = _simulated(with_causes(self.model, moved), record, end)
        sensors = with_causes(self.model, ((c, v) for c, v in result if c.of_sensor))
        return (record.values[:end] - sensors.sensed(record, self._cache[key]))[shown]

    def _forget(self) -> None:
        """Empty the cache, but for what each search begins with: one cause alone, where few."""
        alone = {key: run for key, run in self._cache.items() if len(key) <= 3}
        is_less = 2 * len(alone) < len(self._cache)
        self._cache.clear()
        self._cache.update(alone if is_less else {})

    def with_best_current(self) -> BuildingComparison:
        """Compare again if a current that jumps and rests is nearer as it is held."""
        if all(record.current_steps for record in self.records):
            return self._best_of(self._other_currents(), ())[0]
        return self

    def with_best_sampling(
        self, result: CauseValues = ()
    ) -> tuple[BuildingComparison, CauseValues]:
        """Compare again if ground or current between the samples follow another assumption.

        The causes then have the numbers that they have beside it.
        """
        best, result = self.with_best_ground(result)
        # where the model is as it was, a delay may yet be one of whole samples
        same = [best.model] if any(_is_of_current(cause) for cause, _ in result) else []
        return best._best_of([*best._other_currents(), *same], result)

    def with_best_ground(self, result: CauseValues = ()) -> tuple[BuildingComparison, CauseValues]:
        """Compare again if the ground motion between the samples follows the other assumption."""
        other = replace(self.model, band_limited=not self.model.band_limited)
        return self._best_of([other], result)

    def _other_currents(self) -> list[BuildingModel]:
        if any(record.current is None for record in self.records):
            return []
        return [replace(self.model, jump=j) for j in (None, *JUMPS) if j != self.model.jump]

    def _best_of(
        self, models: Sequence[BuildingModel], result: CauseValues
    ) -> tuple[BuildingComparison, CauseValues]:
        """Compare again with one of some models if it is nearer to the records than the present."""
        trials = [replace(self, model=one, _cache={}) for one in models]
        fits = [trial._with_currents_fitted(result) for trial in trials]
        costs = [one.cost for one in fits]
        if not costs or min(costs) >= squared(self.fitted_residuals(result)):
            return self, result
        best = int(np.argmin(costs))
        values = dict(fits[best].cause_values)
        result = tuple((cause, values[cause]) for cause, _ in result)
        return trials[best].with_noise_beside(result), result

    def _with_currents_fitted(self, result: CauseValues) -> FittedBuilding:
        """Fit the causes of the current again: held, it is half a sample later than linear."""
        moved = tuple(one for one in result if _is_of_current(one[0]))
        others = tuple(one for one in result if not _is_of_current(one[0]))
        # A step of the fit does not find the one moment at which a held current jumps at a sample.
        whole = (self._with_whole_delays(moved, to) for to in (np.floor, np.ceil))
        # without a delay all three are one
        starts = dict.fromkeys([moved, *whole])
        nearest = min(starts, key=lambda one: squared(self.fitted_residuals((*others, *one))))
        return self.fit(others, nearest, SCREENING_STEPS)

    def _with_whole_delays(self, result: CauseValues, to: Callable[[float], float]) -> CauseValues:
        """Causes whose delays are a whole number of samples."""
        dt = self.records[0].dt
        return tuple(
            (
                cause,
                tuple(
                    float(to(v / dt)) * dt if p.name == "delay" else v
                    for p, v in zip(cause.parameters, values, strict=True)
                ),
            )
            for cause, values in result
        )

    def as_assumed_by(self, other: BuildingComparison) -> BuildingComparison:
        """Compare with the model and the records of another comparison, weighted as here."""
        own = {one.name: one for one in other.records}
        fitted, held_out = (
            tuple(replace(one, record=own[one.record.name]) for one in segments)
            for segments in (self.fitted, self.held_out)
        )
        return replace(self, model=other.model, records=tuple(own.values()), fitted=fitted,
                       held_out=held_out, _cache={})  # fmt: skip

    def with_noise_beside(self, result: CauseValues) -> BuildingComparison:
        """Estimate the noise again, with given causes in the model."""
        again = compare_building(self.model, self.records, result, self.model_error, self.middle)
        return replace(again, _cache=self._cache)

    def floor_of(self, record: BuildingRecord) -> NoiseFloor:
        """Noise of a record."""
        return self.floors[[one.name for one in self.records].index(record.name)]

    def expecting(self, model_error: float) -> BuildingComparison:
        """Weight the same data by another expected model error."""
        again = self._weighted(
            lambda s, floor: make_segment(s.record, s.samples, floor, model_error)
        )
        return replace(again, model_error=model_error)

    def without_channel(self, name: str) -> BuildingComparison:
        """Compare the same data beside an unknown signal in one channel."""
        k = self.records[0].channels.index(name)
        return self._weighted(lambda segment, floor: without_channel(segment, floor, k))

    def beside_any_force(self) -> BuildingComparison | None:
        """Compare the same data beside any force of the isolators; None if that leaves nothing."""
        from scipy.linalg import orth

        elements = [self.model.nominal.elements[e] for e in self.model.isolators]
        forces = orth(np.transpose([one.direction for one in elements]))
        if forces.shape[1] >= len(self.records[0].channels):
            return None

        def weight(segment: Segment, floor: NoiseFloor) -> Segment:
            record, frequencies = segment.record, segment.frequencies.copy()
            frequencies[0] = frequencies[1]
            run = self.model.run(record)
            response = frequency_response(self.model, record, run, frequencies, forces)
            ends = end_response(self.model, record, run, frequencies)
            return without_force(segment, floor, response, ends)

        return self._weighted(weight)

    def _weighted(self, weight: Callable[[Segment, NoiseFloor], Segment]) -> BuildingComparison:
        fitted, held_out = (
            tuple(weight(segment, self.floor_of(segment.record)) for segment in segments)
            for segments in (self.fitted, self.held_out)
        )
        return replace(self, fitted=fitted, held_out=held_out)

    def fitting_more(self) -> BuildingComparison | None:
        """Fit more of the last record as well; None where that is no choice.

        That is half of the held-out time of a lone record, and of several most of the motion.
        """
        if self.middle is None:
            return None
        last, floor = self.records[-1], self.floors[-1]
        middle = (self.middle + last.compared) // 2 if self.middle else _middle_of_motion(last)
        if min(middle, last.compared - middle) < MINIMUM_SAMPLES:
            return None
        fitted, held_out = _parts(last, floor, self.model_error, middle)
        whole = tuple(one for one in self.fitted if one.record is not last)
        return replace(self, fitted=(*whole, fitted), held_out=(held_out,), middle=middle)

    def fitted_residuals(self, result: CauseValues) -> tuple[NDArray, ...]:
        """Weigh the residuals of the fitted segments alone, with given causes in the model."""
        return self._weighted_residuals(result, self.fitted)

    def beside(
        self, current: FittedBuilding, cause: Candidate, values: Values, alone: BuildingComparison
    ) -> tuple[NDArray, ...]:
        """Weigh the fitted residuals with one cause more, to first order where it is simulated.

        ``alone`` is a comparison that has simulated what each cause changes alone.
        """
        result = current.cause_values
        if cause.of_sensor or not result:
            return self.fitted_residuals((*result, (cause, values)))
        trial = []
        for segment, before in zip(self.fitted, current.fitted, strict=True):
            record, end = segment.record, segment.samples.indices(len(segment.record))[1]
            changed = alone.residual(((cause, values),), record, end)
            trial.append(before + segment.whiten(changed - alone.residual((), record, end)))
        return tuple(trial)

    @cached_property
    def fitted_noise(self) -> NDArray:
        """Weighted residuals of noise alone where it is fitted, (n_examples, n)."""
        parts = [segment.whiten_noise(self.floor_of(segment.record)) for segment in self.fitted]
        return np.concatenate([part.reshape(len(part), -1) for part in parts], axis=1)

    def evaluate(self, result: CauseValues, optimum: Optimum | None = None) -> FittedBuilding:
        """Weigh the residuals of all segments, with given causes in the model."""
        held_out = partial(self._weighted_residuals, result, self.held_out)
        return FittedBuilding(result, self.fitted_residuals(result), held_out, optimum)

    def above_noise(self, outcome: FittedBuilding) -> tuple[float, float]:
        """Costs of a model on fitted and held-out data, less those of noise alone."""
        fitted, held_out = (
            sum(segment.noise_cost for segment in segments)
            for segments in (self.fitted, self.held_out)
        )
        return outcome.cost - fitted, outcome.held_out_cost - held_out

    def fit(self, fixed: CauseValues, free: CauseValues, most: int = _MOST_STEPS) -> FittedBuilding:
        """Fit the numbers of the free causes, from the values given with them."""
        parameters = [p for cause, _ in free for p in cause.parameters]
        if not parameters:
            return self.evaluate(fixed + free)
        start = coordinates(parameters, [v for _, values in free for v in values])
        lower = coordinates(parameters, [p.lower for p in parameters])
        upper = coordinates(parameters, [p.upper for p in parameters])
        size = np.concatenate([_sizes(cause, values) for cause, values in free])

        def put(x: NDArray) -> CauseValues:
            numbers = iter(values_of(parameters, x))
            fitted = tuple((c, tuple(next(numbers) for _ in c.parameters)) for c, _ in free)
            return fixed + fitted

        def residuals(x: NDArray) -> NDArray:
            return np.concatenate([one.ravel() for one in self.fitted_residuals(put(x))])

        def problem(x: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
            at = residuals(x)
            jacobian = np.zeros((at.size, x.size if derivatives else 0))
            for k in range(jacobian.shape[1]):
                step = min(_STEP * max(abs(x[k]), size[k]), (upper[k] - lower[k]) / 2)
                if x[k] + step > upper[k]:
                    step = -step
                moved = x.copy()
                moved[k] += step
                jacobian[:, k] = (residuals(moved) - at) / step
            return at, jacobian

        optimum = levenberg_marquardt(problem, start, lower, upper, most, 1e-6, secants=True)
        return self.evaluate(put(optimum.x), optimum)

    def _weighted_residuals(
        self, result: CauseValues, segments: Sequence[Segment]
    ) -> tuple[NDArray, ...]:
        # a divided record's later segment is not simulated while its earlier one is fitted
        ends = {s.record.name: s.samples.indices(len(s.record))[1] for s in segments}
        residuals = {
            s.record.name: self.residual(result, s.record, ends[s.record.name]) for s in segments
        }
        return tuple(s.whiten(residuals[s.record.name]) for s in segments)


def compare_building(
    model: BuildingModel,
    records: Sequence[BuildingRecord],
    result: CauseValues = (),
    model_error: float = 0.0,
    middle: int | None = None,
) -> BuildingComparison:
    """Estimate the noise of records and divide them into fitted and held-out data."""
    records = tuple(records)
    if not records or all(record.hold_out for record in records):
        raise InputError("no building record to fit; expected: one or more that is not held out")
    names = [record.name for record in records]
    if len(set(names)) < len(names):
        raise InputError(f"two building records share a name: {', '.join(names)}")
    for record in records:
        if record.channels != records[0].channels:
            raise InputError(
                f"{record.name} has channels {', '.join(record.channels)}; expected: those of "
                f"{records[0].name}, {', '.join(records[0].channels)}"
            )
    known = with_causes(model, result)
    floors = tuple(noise_floor(known, record) for record in records)
    fitted: list[Segment] = []
    held_out: list[Segment] = []
    if middle is None and not any(record.hold_out for record in records):
        middle = 0 if len(records) > 1 else _middle_of_motion(records[0])
    for record, floor in zip(records, floors, strict=True):
        if record is records[-1] and middle:
            first, second = _parts(record, floor, model_error, middle)
            fitted.append(first)
            held_out.append(second)
        else:
            out = record.hold_out if middle is None else record is records[-1]
            (held_out if out else fitted).append(
                make_segment(record, slice(0, record.compared), floor, model_error)
            )
    return BuildingComparison(
        model, records, floors, tuple(fitted), tuple(held_out), model_error, middle
    )


def _parts(
    record: BuildingRecord, floor: NoiseFloor, model_error: float, middle: int
) -> tuple[Segment, Segment]:
    """Fitted and held-out time of a record."""
    return (
        make_segment(record, slice(0, middle), floor, model_error),
        make_segment(record, slice(middle, record.compared), floor, model_error),
    )


def _middle(record: BuildingRecord, fitted_energy: float) -> int:
    """Sample of a record before which it has a share of its energy."""
    values = record.values
    energy = np.cumsum(((values / values.std(axis=0)) ** 2).sum(axis=1))
    return int(np.searchsorted(energy, fitted_energy * energy[-1]))


def _middle_of_motion(record: BuildingRecord) -> int:
    """Sample before which a record has most of its energy, not too near to its ends."""
    return int(np.clip(_middle(record, FITTED_ENERGY), *_quarters(record)))


def _quarters(record: BuildingRecord) -> tuple[int, int]:
    """Least and largest sample at which a record may be divided: a quarter from its ends.

    A quarter of the time in motion, if the record is quiet for most of its own.
    """
    begins, ends = (_middle(record, share) for share in (QUIET_ENERGY, 1 - QUIET_ENERGY))
    if ends - begins > len(record) // 2:
        begins, ends = 0, len(record)
    quarter = (ends - begins) // 4
    return begins + quarter, ends - quarter


def _is_of_current(cause: Candidate) -> bool:
    """Whether a cause changes the current."""
    return cause.name in CURRENT_CAUSES


def with_causes(model: BuildingModel, result: Iterable[tuple[Candidate, Values]]) -> BuildingModel:
    """Put causes into a model."""
    for cause, values in result:
        model = cause.apply(model, values)
    return model


def _sizes(cause: Candidate, values: Values) -> NDArray:
    """Orders of magnitude of a cause's coordinates in a fit that starts from some values."""
    x = np.abs(coordinates(cause.parameters, values))
    sizes = np.where(x == 0, x.max(initial=0.0) * 0.1 + 1e-9, x)
    for k, p in enumerate(cause.parameters):
        # numbers beside one that starts from zero may be of other units
        known = max([abs(start[k]) for start in cause.starts], default=0.0)
        if p.logarithmic:
            sizes[k] = 1.0
        elif x[k] == 0 and (known or np.isfinite(p.upper - p.lower)):
            sizes[k] = known or p.upper - p.lower
    return sizes


def coordinates(parameters: Sequence[Parameter], values: Sequence[float]) -> NDArray:
    """Coordinates in which numbers are fitted: logarithms if only the order of size is known."""
    logs = [p.logarithmic for p in parameters]
    return np.array([np.log(v) if log else v for v, log in zip(values, logs, strict=True)], float)


def values_of(parameters: Sequence[Parameter], x: NDArray) -> list[float]:
    """Turn coordinates into numbers again."""
    return [
        float(np.exp(min(c, 700.0)) if p.logarithmic else c)
        for p, c in zip(parameters, x, strict=True)
    ]


def is_at_bound(parameter: Parameter, value: float) -> bool:
    """Whether a value lies at a bound of its range at which the cause is no plainer one."""
    at, lower, upper = coordinates(
        [parameter] * 3, [value, parameter.lower, parameter.upper]
    ).tolist()
    nearest = parameter.lower if at - lower < upper - at else parameter.upper
    return at_bound(at, lower, upper) and nearest not in parameter.plain


def _simulated(model: BuildingModel, record: BuildingRecord, end: int) -> NDArray:
    try:
        return model.simulated(record, end=end)
    except InputError:
        # a step of the fit into numbers that no building has, such as a device that runs away;
        # the engineer's own model has been simulated before
        return np.full((end, len(record.channels)), np.nan)


def squared(parts: Sequence[NDArray]) -> float:
    """Sum of squares of weighted residuals; infinite if the model diverged."""
    total = sum(float(np.vdot(part, part)) for part in parts)
    return total if np.isfinite(total) else np.inf
