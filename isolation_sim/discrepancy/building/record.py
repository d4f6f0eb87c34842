"""Measurements on a building during one earthquake, and their CSV file."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record
from ground_motions.readers.time_column import uniform_step

from ...errors import InputError
from ...io.csv_table import read_csv_table

MINIMUM_SAMPLES = 64
DISPLACEMENT = "isolator_displacement_m"
_NEEDED = (
    "time_s",
    "ground_acceleration_m_s2",
    "base_acceleration_m_s2",
    "floor1_acceleration_m_s2",
    DISPLACEMENT,
)
_OPTIONAL = ("current_A",)
_FLOOR = re.compile(r"floor([1-9]\d*)_acceleration_m_s2")
# beyond these a number is in another unit, or its sensor was broken (m/s2, m, A)
_LARGEST = {"acceleration_m_s2": 100.0, "displacement_m": 5.0, "current_A": 1000.0}


@dataclass(frozen=True, eq=False)
class BuildingRecord:
    """Samples of one earthquake at a constant step, read-only, in SI."""

    name: str  # Name to print; the file's, without its ending
    ground: Record  # Ground acceleration, m/s^2
    # dict of str to  (n,): Absolute accelerations of base and floors (m/s^2) from below, then the
    # isolator's displacement (m), by their column's name
    response: dict[str, NDArray]
    current: NDArray | None = None  # (n,), A: Coil current; None where it was not measured
    hold_out: bool = False  # Whether the record is held out of the fit, to validate it

    def __post_init__(self) -> None:
        n = len(self.ground.acceleration)
        if n < MINIMUM_SAMPLES:
            raise InputError(f"{self.name}: {n} samples; expected: {MINIMUM_SAMPLES} or more")
        for name in self.response:
            if not (name in _NEEDED[2:] or _FLOOR.fullmatch(name)):
                raise InputError(
                    f"{self.name}: unknown channel {name!r}; expected: {', '.join(_NEEDED[2:])}, "
                    "floor2_acceleration_m_s2, ..."
                )
        for name in (_NEEDED[2], DISPLACEMENT):
            if name not in self.response:
                raise InputError(f"{self.name}: channel {name!r} is missing")
        order = sorted(self.response, key=_height)
        checked = {name: self._checked(name, self.response[name], n) for name in order}
        self._checked("ground_acceleration_m_s2", self.ground.acceleration, n)
        object.__setattr__(self, "response", checked)
        if self.current is not None:
            object.__setattr__(self, "current", self._checked("current_A", self.current, n))

    def _checked(self, name: str, values: Any, n: int) -> NDArray:
        array = np.array(values, dtype=float)
        if array.shape != (n,):
            raise InputError(
                f"{self.name}, {name}: shape {array.shape}; expected: ({n},), as the ground motion"
            )
        largest = next(value for unit, value in _LARGEST.items() if name.endswith(unit))
        bad = ~(np.abs(array) <= largest)
        if bad.any():
            k = int(np.argmax(bad))
            raise InputError(
                f"{self.name}, {name}: sample {k} is {array[k]:.6g}; expected: finite numbers up "
                f"to {largest:g} {_unit(name)} (is the column in the unit that its name says?)"
            )
        if name != "current_A" and not np.ptp(array) > 0:
            raise InputError(
                f"{self.name}, {name}: the same number throughout; expected: a channel that moves"
            )
        array.flags.writeable = False
        return array

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the measured responses: base, floors from below, isolator displacement."""
        return tuple(self.response)

    @property
    def floors(self) -> tuple[int, ...]:
        """Numbers of the floors that were measured, from below."""
        result = [_FLOOR.fullmatch(name) for name in self.response]
        return tuple(int(match[1]) for match in result if match)

    @property
    def values(self) -> NDArray:
        """All responses side by side, (n, n_channels), in the order of ``channels``."""
        return np.column_stack(list(self.response.values()))


def read_building_record(path: str | Path, hold_out: bool = False) -> BuildingRecord:
    """Read one building record from a CSV file."""
    cells = read_csv_table(path)
    _check_names(cells.names, cells.head)
    table = cells.numbers(range(len(cells.names)))
    if len(table) < MINIMUM_SAMPLES:
        raise InputError(f"{path}: {len(table)} samples; expected: {MINIMUM_SAMPLES} or more")
    columns = dict(zip(cells.names, table.T, strict=True))
    times = columns.pop("time_s").tolist()
    dt = uniform_step(times, cells.lines[1:], f"{path}, column time_s")
    name = Path(path).stem
    ground = Record(columns.pop("ground_acceleration_m_s2"), dt, name, source=str(path))
    current = columns.pop("current_A", None)
    try:
        return BuildingRecord(name, ground, columns, current, hold_out)
    except InputError as error:
        raise InputError(str(error).replace(name, str(path), 1)) from None


def _check_names(names: list[str], place: str) -> None:
    known = (*_NEEDED, *_OPTIONAL)
    for name in names:
        if name not in known and not _FLOOR.fullmatch(name):
            close = difflib.get_close_matches(name, known, n=1)
            hint = f" did you mean {close[0]!r}?" if close else ""
            raise InputError(
                f"{place}: unknown column {name!r};{hint} expected: {', '.join(known)}, "
                "floor2_acceleration_m_s2, ..."
            )
        if names.count(name) > 1:
            raise InputError(f"{place}: column {name!r} given twice; expected: once")
    for name in _NEEDED:
        if name not in names:
            raise InputError(
                f"{place}: no column {name!r} among {', '.join(names)}; needed: "
                f"{', '.join(_NEEDED)}"
            )


def _height(channel: str) -> float:
    """Where a channel is: base, floors from below, then the displacement."""
    floor = _FLOOR.fullmatch(channel)
    if floor:
        return float(floor[1])
    return np.inf if channel == DISPLACEMENT else 0.0


def _unit(name: str) -> str:
    return {"current_A": "A", DISPLACEMENT: "m"}.get(name, "m/s2")
