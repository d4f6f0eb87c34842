"""Localisation of what a building's model misses: the place of an unknown force or signal.

A force on the linear structure shows in all channels by the structure's frequency response. At
each frequency the force that follows the residual best is subtracted. Where the remainder is noise,
the model is wrong at this place, whatever the reason. The force of the isolators is always unknown
here: it follows from their motion, which a force at another place changes. A signal that one
channel alone shows is no force: the sensor is wrong, or what moves it is not in the model, such as
torsion. Both are far more flexible than a cause, so that they stand for causes only where these
leave far more.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...simulation.result import Run
from ..decisions import (
    IMITATION,
    NEARLY_RIGHT,
    PROPOSED_GAIN,
    STRONG_EVIDENCE,
    WELL_EXPLAINED,
)
from .comparison import BuildingComparison, CauseValues, FittedBuilding, with_causes
from .errors import excess_error
from .frequency_response import end_response, frequency_response
from .model import BuildingModel, dofs_by_level
from .noise import spectra
from .record import BuildingRecord
from .segment import Segment, make_segment

ISOLATION_LAYER = "the isolation layer"
_ANYWHERE, _BETWEEN = "in the structure", "between"
_MOST_PLACES = 3
"""Places that are listed; more are not told apart."""
_MOST_SIGMA = 3.0
"""Standard deviations of the noise's squares up to which noise alone is left. Convention."""
_NOWHERE = "", ""
"""Key of what is left without an unknown force."""


class UnknownForce(NamedTuple):
    """An unknown force, or signal of a channel, that leaves far less than the causes found."""

    place: str  # Isolation layer, storey or floors; empty for a signal
    beside: CauseValues  # Causes that are needed beside it
    left: float  # Share of the nominal model's misfit above the noise that remains
    left_by_causes: float  # The same with all causes in its stead

    channel: str = ""  # Channel that could alone show it as a signal; empty for a force

    @property
    def complexity(self) -> int:
        """Number of causes, and one for a force beside that of the isolators."""
        return len(self.beside) + (self.place not in ("", ISOLATION_LAYER))

    @property
    def is_in_structure(self) -> bool:
        """Whether it acts in the structure, or on it, and may not only be a sensor's signal."""
        return self.place not in ("", ISOLATION_LAYER) and not self.channel

    @property
    def words(self) -> str:
        """What is unknown, for a sentence."""
        at = "" if self.place.startswith((_BETWEEN, _ANYWHERE)) else "at "
        # with that of the isolators unknown, it may also act between the base and the floor
        ends = " (from outside or from the base)" if re.fullmatch(r"floor\d+", self.place) else ""
        force = [f"an unknown force {at}{self.place}{ends}"] if self.place else []
        signal = [f"an unknown signal in {self.channel} alone"] if self.channel else []
        return " or ".join(force + signal)


def unknown_force(
    comparison: BuildingComparison, nominal: FittedBuilding, causes: CauseValues
) -> UnknownForce | None:
    """Find the unknown force with the fewest causes beside it; None where causes do as well."""
    if len(comparison.records[0].axes) > 1:
        return None
    # the right model would leave little, and is looked for with weights that expect it
    segments = _whole(comparison, NEARLY_RIGHT * excess_error(comparison, nominal))
    try:
        left = {
            beside: _left(comparison, segments, beside)
            for n in range(len(causes) + 1)
            for beside in combinations(causes, n)
        }
    except InputError:
        return None  # an element beside the isolators that has no stiffness at rest
    misfit = left[()][_NOWHERE]
    by_causes = left[causes][_NOWHERE] / misfit if misfit > 0 else np.nan
    unknown_forces = [
        UnknownForce(place, beside, one / misfit, by_causes, channel)
        for beside, places in left.items()
        for (place, channel), one in places.items()
        if (place, channel) != _NOWHERE
    ]
    least = min((one.left for one in unknown_forces), default=np.inf)
    if not least < IMITATION * by_causes:
        return None
    near = [one for one in unknown_forces if one.left < max(least, 0.0) + NEARLY_RIGHT**2]
    # a cause in the right place may have another form, and leave as much
    if by_causes < WELL_EXPLAINED and any(_is_of(one, causes) for one in _needed(near)):
        return None
    # a cause is preferred to an unknown force in its place, and a place that leaves noise alone
    noise = _most_noise(segments) / misfit
    near.sort(key=lambda one: (
        max(one.left, 0.0) > noise, one.complexity, -len(one.beside), round(one.left, 3)
    ))  # fmt: skip
    best = near[0]
    # beside the isolators' force, one on the first floor is one in the first storey
    alike = [
        one for one in near
        if (one.beside, one.complexity) == (best.beside, best.complexity)
        and (one.left <= noise or best.left > noise)
    ]  # fmt: skip
    likeliest = _by_noise_alone(comparison, alike)
    return likeliest[0]._replace(
        place=_places_in_words(likeliest),
        channel=_channels_in_words(likeliest),
    )


def _by_noise_alone(
    comparison: BuildingComparison, alike: Sequence[UnknownForce]
) -> Sequence[UnknownForce]:
    """Forces beside the same causes that noise does not tell from the likeliest of them."""
    if len(alike) < 2:
        return alike
    # weights that expect an error of the model hide differences which are far more than noise
    segments = _whole(comparison, 0.0)
    left = _left(comparison, segments, alike[0].beside)
    squares = {one: left[one.place, one.channel] for one in alike}
    least = min(squares.values())
    if least > _most_noise(segments):
        return alike
    return [one for one in alike if squares[one] < least + STRONG_EVIDENCE]


def _most_noise(segments: Sequence[Segment]) -> float:
    """Squares above those of noise up to which noise alone is left."""
    return _MOST_SIGMA * float(np.sqrt(sum(segment.noise_variance for segment in segments)))


def is_elsewhere(comparison: BuildingComparison, causes: CauseValues, best: CauseValues) -> bool:
    """Whether any force of the isolators beside causes leaves more than the best others do."""
    if len(comparison.records[0].axes) > 1:
        return False
    segments = _whole(comparison, comparison.model_error)
    try:
        left = _left(comparison, segments, causes, (ISOLATION_LAYER,))
        left_by_best = _left(comparison, segments, best, ())[_NOWHERE]
    except InputError:
        return False  # an element beside the isolators that has no stiffness at rest
    by_force = left.get((ISOLATION_LAYER, ""), -np.inf)
    return bool(by_force > max(left_by_best, 0.0) + PROPOSED_GAIN * left[_NOWHERE])


def _whole(comparison: BuildingComparison, model_error: float) -> list[Segment]:
    """Whole records, with weights that expect an error of the model."""
    return [
        make_segment(record, slice(0, len(record)), floor, model_error)
        for record, floor in zip(comparison.records, comparison.floors, strict=True)
    ]


def _needed(near: Sequence[UnknownForce]) -> list[UnknownForce]:
    """Those that are no nearer by causes beside them than others at the same place."""
    return [
        one for one in near
        if not any(
            (other.place, other.channel) == (one.place, one.channel)
            and set(other.beside) < set(one.beside)
            for other in near
        )
    ]  # fmt: skip


def _is_of(unknown: UnknownForce, causes: CauseValues) -> bool:
    """Whether an unknown force or signal stands for causes of its place alone, all others beside.

    Causes of the isolators and of the whole are of the layer, whose force is always unknown.
    """
    own = {unknown.channel or unknown.place}
    if unknown.place:
        own.add(ISOLATION_LAYER)
    places = {cause.place or ISOLATION_LAYER for cause, _ in causes}
    rest = {c.place or ISOLATION_LAYER for c, _ in causes if c not in dict(unknown.beside)}
    return (unknown.channel or unknown.place) in places and rest <= own


def _places_in_words(alike: Sequence[UnknownForce]) -> str:
    """Places of forces that are alike; empty without one."""
    places = [one.place for one in alike if not one.channel]
    simple = [place for place in places if not place.startswith(_BETWEEN)] or places
    return " or ".join(simple) if len(simple) <= _MOST_PLACES else _ANYWHERE


def _channels_in_words(alike: Sequence[UnknownForce]) -> str:
    """Channels that could alone show what the model lacks; empty without one."""
    return " or ".join(one.channel for one in alike if one.channel)


def _left(
    comparison: BuildingComparison,
    segments: Sequence[Segment],
    causes: CauseValues,
    places: Collection[str] | None = None,  # Of the forces; all, and all channels, by default
) -> dict[tuple[str, str], float]:
    """Misfit above the noise, without an unknown force and with one at each place or channel."""
    model = with_causes(comparison.model, causes)
    total: dict[tuple[str, str], float] = defaultdict(float)
    for segment in segments:
        record, (whitening, frequencies) = segment.record, (segment.whitening, segment.frequencies)
        missed = spectra(comparison.residual(causes, record)[np.newaxis], len(frequencies))[0]
        # a constant force moves the free base without end
        white = np.einsum("fij,fj->fi", whitening, missed)[1:]
        total[_NOWHERE] += float(np.vdot(white, white).real) - segment.noise_cost
        if not np.isfinite(total[_NOWHERE]):
            return {_NOWHERE: np.inf}
        if places is not None and not places:
            continue
        run = model.run(record)
        ends = whitening[1:] @ end_response(model, record, run, frequencies[1:])
        for place, forces in _places(model, record, run):
            if places is not None and place not in places:
                continue
            response = frequency_response(model, record, run, frequencies[1:], forces)
            both = np.concatenate([white[:, :, np.newaxis], ends], axis=2)
            total[place, ""] += _remainder(both, whitening[1:] @ response) - segment.noise_cost
        for k, channel in enumerate(record.channels if places is None else ()):
            own = _remainder(white[:, :, np.newaxis], whitening[1:, :, k : k + 1])
            total["", channel] += own - segment.noise_cost
    return total


def _remainder(white: NDArray, response: NDArray) -> float:
    """Squares that remain of weighted residuals beside any force or signal with a response."""
    along = np.linalg.qr(response)[0]
    rest = white - along @ (along.conj().swapaxes(1, 2) @ white)
    # any force follows its share of the noise
    return _without_ends(rest) / (1 - response.shape[2] / response.shape[1])


def _without_ends(rest: NDArray) -> float:
    """Least squares of a residual beside what the motion at the record's end may add to it."""
    parts = rest.reshape(-1, rest.shape[2])
    parts = np.concatenate([parts.real, parts.imag])
    ends = parts[:, 1:] / np.maximum(np.linalg.norm(parts[:, 1:], axis=0), 1e-300)
    return float(np.sum((parts[:, 0] - ends @ np.linalg.lstsq(ends, parts[:, 0])[0]) ** 2))


def _places(
    model: BuildingModel, record: BuildingRecord, run: Run
) -> Iterator[tuple[str, NDArray]]:
    """Forces on the dofs, (n_dofs, n_forces): the isolators', and those of one more place."""
    from scipy.linalg import orth

    structure, n = run.isolated.structure, run.isolated.structure.n_dofs
    layer = orth(np.transpose([run.isolated.elements[e].direction for e in model.isolators]))
    floors = dofs_by_level(model.structure, record.axes[0])[1:]
    unit = np.eye(n)[:, list(floors)]
    between = [
        (f"{_BETWEEN} floor{i + 1} and floor{j + 1}", unit[:, [j]] - unit[:, [i]])
        for i, j in combinations(range(len(floors)), 2)
        if j > i + 1  # others are in a storey
    ]
    places = [
        (ISOLATION_LAYER, np.empty((n, 0))),
        *zip(structure.storeys, structure.drift_rows[:, :, np.newaxis], strict=True),
        # beside the isolators' force, one on a floor is one between base and floor
        *((f"floor{number}", unit[:, [k]]) for k, number in enumerate(range(1, len(floors) + 1))),
        *between,
    ]
    for place, forces in places:
        # with as many forces as channels nothing would remain
        if layer.shape[1] + forces.shape[1] < len(record.channels):
            yield place, np.hstack([layer, forces])
