"""Cross-validation of laws: folds of measured runs that are left out of a fit in turn."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .current_basis import STEADY, group_currents
from .law_model import LawModel
from .measured_runs import MeasuredRuns

_GROUPS = 6
"""Groups of conditions. Effort."""
_SAME = 0.1
"""Relative difference of amplitude and velocity up to which runs have one motion. Convention."""


def of_parts(data: MeasuredRuns) -> bool:
    """Whether the folds of the fitted samples are parts of one or two runs."""
    return sum(bool(data.fitted[run].any()) for run in data.runs) < 3


def folds_of(data: MeasuredRuns, n_currents: int = 0) -> list[tuple[str, NDArray]]:
    """Folds of the fitted samples, groups of conditions: name and samples, (n_samples,) bool.

    A run that alone has a current is in no fold where the others have fewer than ``n_currents``:
    parameters that depend on so many would be those of no data without it.
    """
    # Runs of nearly the same amplitude and velocity are one motion. Many motions are put together
    # by their size, so that what is left out is also an extrapolation. One or two runs are cut into
    # parts of the same travelled path: the quiet end of an earthquake is no fold of its own.
    number = np.zeros(len(data.x), dtype=int)
    if of_parts(data):
        inside = np.flatnonzero(data.fitted)
        path = np.cumsum(np.abs(data.v[inside]))
        ends = np.searchsorted(path, path[-1] * np.arange(1, _GROUPS) / _GROUPS)
        parts = np.split(inside, ends)
        return [(f"part {k + 1}", _mask(number, part)) for k, part in enumerate(parts)]
    own = [run for run in data.runs if data.fitted[run].any()]
    sizes = np.log([[np.max(np.abs(y[run])) for y in (data.x, data.v)] for run in own])
    motions: list[list[int]] = []
    for k in np.argsort(sizes.sum(axis=1), kind="stable").tolist():
        near = (m for m in motions if np.all(np.abs(sizes[k] - sizes[m[0]]) < _SAME))
        motion = next(near, None)
        if motion is None:
            motions.append([k])
        else:
            motion.append(k)
    count = min(_GROUPS, len(motions))
    groups = [
        [k for m in part for k in motions[m]] for part in np.array_split(range(len(motions)), count)
    ]  # fmt: skip
    named = [
        (f"up to {1e3 * np.exp(max(sizes[k][0] for k in group)):.3g} mm, "
         f"{1e3 * np.exp(max(sizes[k][1] for k in group)):.3g} mm/s", group)
        for group in groups
    ]  # fmt: skip
    currents = [(float(np.min(data.current[run])), float(np.max(data.current[run]))) for run in own]
    same = STEADY * float(np.max(np.abs(data.current)))
    left_out = [(name, _without_needed(g, currents, same, n_currents)) for name, g in named]
    result = [(name, _runs_mask(data, [own[k] for k in group])) for name, group in left_out]
    return [one for one in result if one[1].any()]


def _without_needed(
    group: Sequence[int], currents: Sequence[tuple[float, float]], same: float, number: int
) -> list[int]:
    """Runs of a group but those that alone have a current, where the others have too few."""

    def seen(runs: Sequence[int]) -> int:
        ends = [end for k in runs for end in currents[k]]
        return len(group_currents(ends, same)) if ends else 0

    needed = min(number, seen(range(len(currents))))
    rest = [k for k in range(len(currents)) if k not in group]
    for k in sorted(group):
        if seen(rest) < needed and seen([*rest, k]) > seen(rest):
            rest.append(k)
    return [k for k in group if k not in rest]


def fitted_without(
    model: LawModel,
    starts: Sequence[NDArray],
    masks: Sequence[NDArray],
    most: int,
    apply: Callable[..., Iterable[NDArray]] = map,
) -> list[NDArray]:
    """Values of fits without each mask's samples, each from values near the fit to all.

    ``apply``: ``map``, or that of a pool.
    """

    def fit(start: NDArray, mask: NDArray) -> NDArray:
        data = replace(model.data, fitted=model.data.fitted & ~mask)
        return replace(model, data=data).minimise(start, most, 1e-4).x

    return list(apply(fit, starts, masks))


def _mask(like: NDArray, places: NDArray) -> NDArray:
    mask = np.zeros(len(like), dtype=bool)
    mask[places] = True
    return mask


def _runs_mask(data: MeasuredRuns, runs: Sequence[slice]) -> NDArray:
    mask = np.zeros(len(data.x), dtype=bool)
    for run in runs:
        mask[run] = data.fitted[run]
    return mask
