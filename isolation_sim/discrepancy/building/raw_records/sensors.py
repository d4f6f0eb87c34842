"""Several sensors of a channel, or of a floor that moves as a rigid body, become channels."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....errors import InputError
from ..channels import AXES, ROTATION, Channel
from .columns import Column

_LEAST_DISTANCE = 0.05
"""Distance, m, below which sensors are at one place."""


class Samples(NamedTuple):
    """Channels at common times."""

    step: float  # s
    start: float  # Time of the first sample in the files, s
    values: dict[str, NDArray]  # (n,) in SI, by key
    notes: list[str]


def combine_sensors(columns: Sequence[Column], samples: Samples) -> None:
    """Replace the sensors' values by those of the channels, in place."""
    places = defaultdict(list)
    for one in columns:
        if one.channel is not None:
            places[one.channel.place, one.channel.quantity].append(one)
    for (place, quantity), sensors in places.items():
        if any(one.at is not None for one in sensors):
            _as_rigid_body(place, quantity, sensors, samples)
        else:
            _as_means(sensors, samples)


def _as_means(sensors: Sequence[Column], samples: Samples) -> None:
    """Take the mean of the sensors of each channel."""
    groups = defaultdict(list)
    for one in sensors:
        groups[one.channel].append(one)
    for channel, group in groups.items():
        if channel is None or len(group) == 1:
            continue
        values = np.stack([samples.values.pop(one.key) for one in group])
        mean = values.mean(axis=0)
        samples.values[channel.key] = mean
        headings = ", ".join(repr(one.heading) for one in group)
        apart = _share(values - mean, mean)
        samples.notes.append(
            f"{channel.key} is the mean of {headings}, which differ from it by {apart} (RMS)"
        )


def _as_rigid_body(place: str, quantity: str, sensors: Sequence[Column], samples: Samples) -> None:
    """Find the motion of the reference point, and the rotation, from sensors at known positions."""
    without = [one for one in sensors if one.at is None and _axis(one) != ROTATION]
    if without:
        raise InputError(
            f"{place}, {quantity}", f"no position of {', '.join(repr(o.heading) for o in without)}",
            "position_m = [x, y] of all its sensors in the settings, or of none",
        )  # fmt: skip
    if not all(map(_axis, sensors)):
        raise InputError(
            f"{place}, {quantity}", "position_m, in a record of one direction",
            "no positions, or sensors along x and y",
        )  # fmt: skip
    axes = [axis for axis in (*AXES, ROTATION) if axis == ROTATION or axis in map(_axis, sensors)]
    rows = np.zeros((len(sensors), len(axes)))
    for row, one in zip(rows, sensors, strict=True):
        row[axes.index(_axis(one))] = 1.0
        if one.at is not None:
            x, y = one.at
            row[-1] = -y if _axis(one) == "x" else x
    if not rows[:, -1].any():
        axes, rows = axes[:-1], rows[:, :-1]  # all on the axes: the rotation moves none of them
    # positions in m are compared with translations: a lever of some centimetres finds no rotation
    if np.linalg.matrix_rank(rows, tol=_LEAST_DISTANCE) < len(axes):
        raise InputError(
            f"{place}, {quantity}",
            f"{len(sensors)} sensors at {', '.join(_text(o.at) for o in sensors if o.at)}",
            "positions from which its motion along each direction and its rotation follow",
        )
    measured = np.stack([samples.values.pop(one.key) for one in sensors])
    motion, *_ = np.linalg.lstsq(rows, measured, rcond=None)
    keys = [Channel(place, axis, quantity).key for axis in axes]
    samples.values.update(zip(keys, motion, strict=True))
    note = f"{', '.join(keys)} are the motion of a rigid body by {len(sensors)} sensors"
    if len(sensors) > len(axes):
        note += f", which differ from it by {_share(measured - rows @ motion, measured)} (RMS)"
    samples.notes.append(note)


def _axis(one: Column) -> str:
    assert one.channel is not None
    return one.channel.axis


def _text(position: tuple[float, float]) -> str:
    return f"({position[0]:g}, {position[1]:g}) m"


def _share(difference: NDArray, whole: NDArray) -> str:
    """RMS of a difference over that of the whole, in percent."""
    size = float(np.sqrt(np.mean(whole**2)))
    return f"{100 * float(np.sqrt(np.mean(difference**2))) / size:.2g} %" if size else "0 %"
