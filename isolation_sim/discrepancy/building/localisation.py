"""Localisation of what a building's model misses: the place of an unknown force.

A force on the linear structure shows in all channels by the structure's frequency response. At
each frequency the force that follows the residual best is subtracted. Where the remainder is noise,
the model is wrong at this place, whatever the reason. The force of the isolators is always unknown
here: it follows from their motion, which a force at another place changes. An unknown force is far
more flexible than a cause, so that it stands for causes only where they leave far more.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...simulation.result import Run
from ..decisions import IMITATION, NEARLY_RIGHT, WELL_EXPLAINED
from .comparison import CauseValues, Comparison, FittedBuilding, with_causes
from .errors import excess_error
from .frequency_response import end_response, frequency_response
from .model import BuildingModel, dofs_by_level
from .noise import spectra
from .record import BuildingRecord
from .segment import Segment, make_segment

ISOLATION_LAYER = "the isolation layer"
_NOWHERE = ""


class UnknownForce(NamedTuple):
    """An unknown force that leaves far less of the misfit than the causes found."""

    place: str  # Isolation layer, storey or floor
    beside: CauseValues  # Causes that are needed beside it
    left: float  # Share of the nominal model's misfit above the noise that remains
    left_by_causes: float  # The same with all causes in its stead

    @property
    def complexity(self) -> int:
        """Number of causes, and one for a force beside that of the isolators."""
        return len(self.beside) + (self.place != ISOLATION_LAYER)


def unknown_force(
    comparison: Comparison, nominal: FittedBuilding, causes: CauseValues
) -> UnknownForce | None:
    """Find the unknown force with the fewest causes beside it; None where causes do as well."""
    if len(comparison.records[0].axes) > 1:
        return None
    # the right model would leave little, and is looked for with weights that expect it
    expected = NEARLY_RIGHT * excess_error(comparison, nominal)
    segments = [
        make_segment(record, slice(0, len(record)), floor, expected)
        for record, floor in zip(comparison.records, comparison.floors, strict=True)
    ]
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
    if not by_causes >= WELL_EXPLAINED:
        return None
    unknown_forces = [
        UnknownForce(place, beside, one / misfit, by_causes)
        for beside, places in left.items()
        for place, one in places.items()
        if place != _NOWHERE
    ]
    least = min((one.left for one in unknown_forces), default=np.inf)
    if not least < IMITATION * by_causes:
        return None
    near = [one for one in unknown_forces if one.left < max(least, 0.0) + NEARLY_RIGHT**2]
    # a cause is preferred to an unknown force in its place
    near.sort(key=lambda one: (one.complexity, -len(one.beside), round(one.left, 3)))
    best = near[0]
    # beside the isolators' force, one on the first floor is one in the first storey
    alike = [
        one.place for one in near
        if one.beside == best.beside and one.complexity == best.complexity
    ]  # fmt: skip
    return best._replace(place=" or ".join(alike))


def _left(
    comparison: Comparison, segments: Sequence[Segment], causes: CauseValues
) -> dict[str, float]:
    """Misfit above the noise, without an unknown force and with one at each place."""
    model = with_causes(comparison.model, causes)
    total: dict[str, float] = defaultdict(float)
    for segment in segments:
        record, (whitening, frequencies) = segment.record, (segment.whitening, segment.frequencies)
        missed = spectra(comparison.residual(causes, record)[np.newaxis], len(frequencies))[0]
        # a constant force moves the free base without end
        white = np.einsum("fij,fj->fi", whitening, missed)[1:]
        total[_NOWHERE] += float(np.vdot(white, white).real) - segment.noise_cost
        if not np.isfinite(total[_NOWHERE]):
            return {_NOWHERE: np.inf}
        run, n_channels = model.run(record), white.shape[1]
        ends = whitening[1:] @ end_response(model, record, run, frequencies[1:])
        for place, forces in _places(model, record, run):
            response = frequency_response(model, record, run, frequencies[1:], forces)
            along = np.linalg.qr(whitening[1:] @ response)[0]
            both = np.concatenate([white[:, :, np.newaxis], ends], axis=2)
            rest = both - along @ (along.conj().swapaxes(1, 2) @ both)
            # any force follows its share of the noise
            free = 1 - forces.shape[1] / n_channels
            total[place] += _without_ends(rest) / free - segment.noise_cost
    return total


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
    places = [
        (ISOLATION_LAYER, np.empty((n, 0))),
        *zip(structure.storeys, structure.drift_rows[:, :, np.newaxis], strict=True),
        *((f"floor{number}", np.eye(n)[:, [dof]]) for number, dof in enumerate(floors, start=1)),
    ]
    for place, forces in places:
        # with as many forces as channels nothing would remain
        if layer.shape[1] + forces.shape[1] < len(record.channels):
            yield place, np.hstack([layer, forces])
