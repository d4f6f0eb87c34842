"""Measurements on a building during one earthquake, and their CSV file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record
from ground_motions.readers.lines import uniform_step

from ...errors import InputError, did_you_mean, near_name
from ...identification.measured.gaps import fill_gaps, gap_note
from ...io.csv_table import read_csv_table
from .channels import (
    AXES,
    BASE,
    GROUND,
    ISOLATOR,
    ROTATION,
    Channel,
    accepted_units,
    channel,
    in_any_unit,
    order,
    required,
)
from .record_filter import RecordFilter, read_filter

MINIMUM_SAMPLES = 64
_ALONE = 0.8
"""Share of a stepping current's changes that stand alone, beyond those before and after them."""
_ON_OFF = 0.9
"""Change within a sample, over the range of the current, by which it is switched on or off."""
_TAPERED = 0.05
"""Share of a record at its end that agencies fade out before they filter it. Convention."""
_TIME, _CURRENT = "time_s", "current_A"
_WORDS = {GROUND, BASE, ISOLATOR, ROTATION, "roof", "floor", "acceleration", "displacement"}
# beyond these a number is in another unit, or its sensor was broken
_LARGEST = {"m/s2": 100.0, "rad/s2": 100.0, "m": 5.0, "rad": 1.0, "A": 1000.0}


@dataclass(frozen=True, eq=False)
class BuildingRecord:
    """Samples of one earthquake at a constant step, read-only, in SI.

    It has one direction, or two of them, x and y. The channels of two directions are those of the
    centre of the plan, and of the rotation about it.
    """

    name: str  # Name to print; the file's, without its ending
    # Ground acceleration, m/s^2: one record per direction, or one alone
    ground: tuple[Record, ...]
    # dict of str to  (n,): Absolute accelerations of base and floors from below, then the
    # isolators' displacement, by their column's name and in its unit
    response: dict[str, NDArray]
    current: NDArray | None = None  # (n,), A: Coil current; None where it was not measured
    hold_out: bool = False  # Whether the record is held out of the fit, to validate it
    notes: tuple[str, ...] = ()  # Changes that were made while the file was read
    filter: RecordFilter | None = None  # That its channels passed, so far as it is known

    def __post_init__(self) -> None:
        motions = (self.ground,) if isinstance(self.ground, Record) else tuple(self.ground)
        object.__setattr__(self, "ground", motions)
        if len(motions) not in (1, 2):
            raise InputError(f"{self.name}: {len(motions)} ground motions; expected: 1 or 2")
        n = len(self)
        if n < MINIMUM_SAMPLES:
            raise InputError(f"{self.name}: {n} samples; expected: {MINIMUM_SAMPLES} or more")
        needed = [one.name for one in required(self.axes) if one.place != GROUND]
        for name in self.response:
            one = channel(name)
            if one is None or one.place == GROUND or not _fits(one, self.axes):
                raise InputError(
                    f"{self.name}: unknown channel {name!r}; expected: "
                    f"{', '.join(needed)}, {_further(self.axes)}"
                )
        for axis in self.axes:
            for one in (
                Channel(BASE, axis, "acceleration"),
                Channel(ISOLATOR, axis, "displacement"),
            ):
                if one.name not in self.response:
                    raise InputError(f"{self.name}: channel {one.name!r} is missing")
        names = sorted(self.response, key=order)
        checked = {name: self._checked(name, self.response[name], n) for name in names}
        for name, motion in zip(self.ground_channels, motions, strict=True):
            self._checked(name, motion.acceleration, n)
            if motion.dt != self.dt:
                raise InputError(
                    f"{self.name}, {name}: step {motion.dt:g} s; expected: {self.dt:g} s, as in "
                    f"{self.ground_channels[0]}"
                )
        object.__setattr__(self, "response", checked)
        if self.current is not None:
            object.__setattr__(self, "current", self._checked(_CURRENT, self.current, n))

    def _checked(self, name: str, values: Any, n: int) -> NDArray:
        array = np.array(values, dtype=float)
        if array.shape != (n,):
            raise InputError(
                f"{self.name}, {name}: shape {array.shape}; expected: ({n},), as the ground motion"
            )
        one = channel(name)
        unit = one.unit if one else "A"
        largest = _LARGEST[unit]
        bad = ~(np.abs(array) <= largest)
        if bad.any():
            k = int(np.argmax(bad))
            raise InputError(
                f"{self.name}, {name}: sample {k}",
                f"{array[k]:.6g}",
                f"finite numbers up to {largest:g} {unit} (is the column in the unit that its name "
                "says?)",
            )
        if name != _CURRENT and not np.ptp(array) > 0:
            raise InputError(
                f"{self.name}, {name}: the same number throughout; expected: a channel that moves"
            )
        array.flags.writeable = False
        return array

    def __len__(self) -> int:
        return len(self.ground[0].acceleration)

    @property
    def compared(self) -> int:
        """Samples before those that the taper of a filter fades out."""
        return int((1 - _TAPERED) * len(self)) if self.filter else len(self)

    @property
    def dt(self) -> float:
        """Step, s."""
        return self.ground[0].dt

    @property
    def time(self) -> NDArray:
        """Time of the samples, (n,), s."""
        return self.ground[0].time

    @property
    def axes(self) -> tuple[str, ...]:
        """Directions: one without a name, or x and y."""
        return ("",) if len(self.ground) == 1 else AXES

    @property
    def ground_channels(self) -> tuple[str, ...]:
        """Names of the ground motion's columns, one per direction."""
        return tuple(Channel(GROUND, axis, "acceleration").name for axis in self.axes)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the measured responses: base, floors from below, isolator displacement."""
        return tuple(self.response)

    @cached_property
    def sensors(self) -> tuple[Channel, ...]:
        """Place, direction and quantity of each of ``channels``."""
        return tuple(one for one in map(channel, self.response) if one is not None)

    @property
    def floors(self) -> tuple[int, ...]:
        """Numbers of the floors that were measured, from below."""
        return tuple(dict.fromkeys(one.floor for one in self.sensors if one.floor))

    @cached_property
    def values(self) -> NDArray:
        """All responses side by side, (n, n_channels), in the order of ``channels``."""
        values = np.column_stack(list(self.response.values()))
        values.flags.writeable = False
        return values

    @property
    def current_steps(self) -> bool:
        """Whether the current jumps and rests until the next jump, as a sampled controller's."""
        if self.current is None or not np.ptp(self.current) > 0:
            return False
        changes = np.abs(np.diff(self.current))
        padded = np.pad(changes, 1)
        alone = np.maximum(changes - np.maximum(padded[:-2], padded[2:]), 0.0)
        # on and off need not rest
        switched = changes[changes > _ON_OFF * np.ptp(self.current)]
        return bool(max(alone.sum(), switched.sum()) > _ALONE * changes.sum())

    def displacement(self, axis: str) -> NDArray:
        """Displacement of the isolators along a direction, (n,), m."""
        return self.response[Channel(ISOLATOR, axis, "displacement").name]

    def base_acceleration(self, axis: str) -> NDArray:
        """Absolute acceleration of the base along a direction, (n,), m/s^2."""
        return self.response[Channel(BASE, axis, "acceleration").name]

    def mean_acceleration(self, values: NDArray, axis: str) -> NDArray:
        """Mean along a direction over base and floors, of values (n, n_channels)."""
        used = [not one.is_displacement and one.axis == axis for one in self.sensors]
        return values[:, used].mean(axis=1)


def read_building_record(path: str | Path, hold_out: bool = False) -> BuildingRecord:
    """Read one building record from a CSV file."""
    cells = read_csv_table(path)
    unused = [name for name in cells.names if _is_foreign(name)]
    used = [k for k, name in enumerate(cells.names) if name not in unused]
    headings = [cells.names[k] for k in used]
    names, factors = _in_si(headings, cells.head)
    axes = _axes(names)
    _check_names(names, axes, cells.head)
    table = cells.numbers(used, [k for k in used if cells.names[k] != _TIME])[:, used]
    if len(table) < MINIMUM_SAMPLES:
        raise InputError(f"{path}: {len(table)} samples; expected: {MINIMUM_SAMPLES} or more")
    times, gaps = table[:, names.index(_TIME)], []
    for k, column in enumerate(headings):
        table[:, k], missing = fill_gaps(table[:, k], path, cells.lines[1:], column)
        if missing.size:
            gaps.append(gap_note(column, missing.size, times[missing[0]]))
    columns = dict(zip(names, (table * factors).T, strict=True))
    dt = uniform_step(columns.pop(_TIME).tolist(), cells.lines[1:], f"{path}, column {_TIME}")
    name = Path(path).stem
    ground = tuple(
        Record(
            columns.pop(Channel(GROUND, axis, "acceleration").name), dt,
            f"{name}, {axis}" if axis else name, source=str(path),
        )
        for axis in axes
    )  # fmt: skip
    current = columns.pop(_CURRENT, None)
    changes = {
        "converted to SI": [one for one, name in zip(headings, names, strict=True) if one != name],
        "columns not used": unused,
    }
    said = [f"{what}: {', '.join(these)}" for what, these in changes.items() if these]
    try:
        return BuildingRecord(
            name, ground, columns, current, hold_out, (*gaps, *said), read_filter(path)
        )
    except InputError as error:
        raise InputError(str(error).replace(name, str(path), 1)) from None


def _is_foreign(name: str) -> bool:
    """Whether a column has nothing of a building record in its name, such as a temperature."""
    return not (_WORDS & set(name.lower().split("_")) or near_name(name, (_TIME, _CURRENT)))


def _in_si(names: Sequence[str], place: str) -> tuple[list[str], list[float]]:
    """Names of columns in SI, and the factors to it; refuses one quantity in two units."""
    result: dict[str, tuple[str, float]] = {}
    for name in names:
        match = in_any_unit(name)
        si, factor = (match[0].name, match[1]) if match else (name, 1.0)
        if si in result:
            first = result[si][0]
            twice = f"given twice, as {first!r} and {name!r}" if first != name else "given twice"
            raise InputError(f"{place}: column {si!r} {twice}; expected: once, in one unit")
        result[si] = name, factor
    return list(result), [factor for _, factor in result.values()]


def _axes(names: Sequence[str]) -> tuple[str, ...]:
    """Directions of a file: x and y if any column has one of them."""
    return AXES if any(set(AXES) & set(name.split("_")) for name in names) else ("",)


def _check_names(names: list[str], axes: tuple[str, ...], place: str) -> None:
    given = [one.key for one in map(channel, names) if one]
    needed = (_TIME, *(one.name for one in required(axes, given)))
    known = (*needed, _CURRENT)
    for name in names:
        one = channel(name)
        if one is not None and not _fits(one, axes):
            lack = "of a rotation beside one direction" if one.axis else "without a direction"
            expected = (one.name for one in (one._replace(axis=axis) for axis in AXES))
            raise InputError(
                f"{place}: column {name!r} {lack}; expected: columns along x and y, such as "
                f"{', '.join(expected)}"
            )
        if name not in known and one is None:
            raise InputError(
                f"{place}: unknown column {name!r};{did_you_mean(name, known)} expected: "
                f"{', '.join(known)}, {_further(axes)}, in {_units()}"
            )
    for name in needed:
        if name not in names:
            raise InputError(
                f"{place}: no column {name!r} among {', '.join(names)}; needed: {', '.join(needed)}"
            )


def _fits(one: Channel, axes: tuple[str, ...]) -> bool:
    """Whether a channel may stand in a record of some directions."""
    return one.axis in axes or (one.axis == ROTATION and len(axes) == 2)


def _further(axes: tuple[str, ...]) -> str:
    """Columns that a record may have beside the required ones, and units of a file."""
    if len(axes) == 1:
        return "floor2_acceleration_m_s2, ..."
    return "base_rotation_acceleration_rad_s2, floor2_x_acceleration_m_s2, ..."


def _units() -> str:
    """Units in which the columns of a file may be."""
    kinds = (Channel(BASE, "", "acceleration"), Channel(ISOLATOR, "", "displacement"))
    return " or ".join(", ".join(accepted_units(one)) for one in kinds)
