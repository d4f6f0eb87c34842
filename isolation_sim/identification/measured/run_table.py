"""One measured run: arrays in SI, and the CSV file that holds it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.readers.lines import uniform_step
from ground_motions.units import column_units

from ...errors import InputError, near_name
from ...io.csv_table import read_csv_table
from .gaps import fill_gaps, gap_note
from .velocity import smooth

MINIMUM_SAMPLES = 16

# quantity -> end of a column's name -> factor of this unit to SI
_UNITS = {
    "time": column_units("time", ["s"]),
    "displacement": column_units("displacement", ["mm", "m"]),
    "velocity": column_units("velocity", ["mm/s", "m/s"]),
    "acceleration": column_units("acceleration", ["mm/s2", "m/s2", "g"]),
    "current": column_units("current", ["A"]),
    "force": column_units("force", ["N", "kN"]),
    "temperature": column_units("temperature"),
}
_NEEDED = ("time", "displacement", "force")
_WITH_GAPS = ("displacement", "force", "current")
_COLUMNS = {f"{what}_{unit}": what for what, units in _UNITS.items() for unit in units}
# a velocity given may differ this many times from the displacement's slope: noise does, units more
_VELOCITY_FACTOR = 30.0


@checked
@dataclass(frozen=True, eq=False)
class TestRun:
    """Samples of one test at a constant step, read-only, in SI.

    Attributes
    ----------
    name : str
        Name to print; the file's, without its ending.
    time : numpy.ndarray, shape (n,), s
    displacement : numpy.ndarray, shape (n,), m
    velocity : numpy.ndarray, shape (n,), m/s
        As measured, or by `isolation_sim.identification.measured.velocity.smooth`.
    force : numpy.ndarray, shape (n,), N
    current : numpy.ndarray, shape (n,), A
        0 throughout where it was not measured, as of a device without coil.
    hold_out : bool
        Whether the run is held out of the fit, to validate it.
    acceleration : numpy.ndarray or None, shape (n,), m/s^2
        None where it was not measured.
    temperature : numpy.ndarray or None, shape (n,), degree Celsius
        None where it was not measured.
    velocity_measured, current_measured : bool
        Whether the velocity and the current are data.
    ignored_columns : tuple of str
        Columns of the file that are none of the above.
    gap_notes : tuple of str
        Notes of missing samples that were interpolated.

    Raises
    ------
    InputError
        If an array has another length, fewer than 16 samples or a number that is not finite; the
        time is not uniform; or the displacement or the force never changes.
    """

    __test__ = False  # not a test class to pytest

    name: str
    time: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    current: np.ndarray
    hold_out: bool = False
    acceleration: np.ndarray | None = None
    temperature: np.ndarray | None = None
    velocity_measured: bool = False
    current_measured: bool = True
    ignored_columns: tuple[str, ...] = field(default=())
    gap_notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        n = np.size(self.time)
        if n < MINIMUM_SAMPLES:
            raise InputError(
                f"{self.name}: {n} sample{'s' * (n != 1)}; expected: {MINIMUM_SAMPLES} or more"
            )
        for what in _UNITS:
            values = getattr(self, what)
            if values is not None:
                object.__setattr__(self, what, self._checked(what, values, n))
        object.__setattr__(self, "ignored_columns", tuple(self.ignored_columns))
        object.__setattr__(self, "gap_notes", tuple(self.gap_notes))
        self.step  # noqa: B018  (refuses times that are not uniform)
        for what in ("displacement", "force"):
            if not np.ptp(getattr(self, what)) > 0:
                raise InputError(
                    f"{self.name}, {what}: the same number throughout; expected: a test that moves "
                    "and is resisted"
                )

    def _checked(self, what: str, values: Any, n: int) -> np.ndarray:
        array = np.array(values, dtype=float)
        if array.shape != (n,):
            raise InputError(
                f"{self.name}, {what}: shape {array.shape}; expected: ({n},), as the time"
            )
        if not np.all(np.isfinite(array)):
            worst = int(np.argmin(np.isfinite(array)))
            raise InputError(
                f"{self.name}, {what}: sample {worst}", f"{array[worst]}", "finite numbers"
            )
        array.flags.writeable = False
        return array

    @cached_property
    def step(self) -> float:
        """Time between samples, s."""
        try:
            return uniform_step(self.time, range(self.time.size), f"{self.name}, time")
        except InputError as error:
            raise InputError(str(error).replace(" line ", " sample ")) from None


@checked
def read_run(path: str | Path, hold_out: bool = False) -> TestRun:
    """Read one run from a CSV file whose columns carry their unit in their name.

    Parameters
    ----------
    path : str or pathlib.Path
        Comma-separated UTF-8 text: a line of names, then numbers; ``#`` and blank lines are
        skipped. Needed: ``time_s``, ``displacement_mm`` or ``_m``, ``force_N`` or ``_kN``.
        Optional: ``current_A`` (0 by default), ``velocity_mm_s`` or ``_m_s``,
        ``acceleration_m_s2``, ``_mm_s2`` or ``_g``, ``temperature_C``. Other columns are left
        alone and named in the result. Empty cells and NaN in displacement, force and current are
        interpolated where they are few; ``gap_notes`` of the result tell.
    hold_out : bool
        Whether the run is held out of the fit.

    Returns
    -------
    TestRun

    Raises
    ------
    InputError
        If the file or a needed column is missing, a column is misspelt, a quantity is given twice
        (in one unit or in two), a cell is not a finite number, more than 1 % or 5 in a row of a
        channel's samples are missing, times do not increase uniformly, there are too few samples,
        or a velocity is not the displacement's slope.
    """
    cells = read_csv_table(path)
    names = cells.names
    known = {k: _COLUMNS[name] for k, name in enumerate(names) if name in _COLUMNS}
    table = cells.numbers(list(known), [k for k, what in known.items() if what in _WITH_GAPS])
    columns = _recognised(names, cells.head)
    if len(table) < MINIMUM_SAMPLES:
        raise InputError(f"{path}: {len(table)} samples; expected: {MINIMUM_SAMPLES} or more")
    time_name = names[columns["time"]]
    uniform_step(table[:, columns["time"]].tolist(), cells.lines[1:], f"{path}, column {time_name}")
    data: dict[str, Any] = {}
    notes = []
    for what, k in columns.items():
        values, missing = fill_gaps(table[:, k], path, cells.lines[1:], names[k])
        data[what] = values * _UNITS[what][names[k].removeprefix(f"{what}_")]
        if missing.size:
            first = table[missing[0], columns["time"]]
            notes.append(f"{Path(path).stem}: {gap_note(what, missing.size, first)}")
    return make_run(
        Path(path).stem,
        data,
        str(path),
        f"column {names[columns['velocity']]}" if "velocity" in columns else "",
        hold_out=hold_out,
        ignored_columns=tuple(name for k, name in enumerate(names) if k not in columns.values()),
        gap_notes=tuple(notes),
    )


def make_run(
    name: str, data: dict[str, Any], place: str, velocity: str, remedy: str = "", **others: Any
) -> TestRun:
    """A run of channels in SI; derives a velocity and a current that were not measured.

    ``place``, ``velocity``, ``remedy``: names of the file and of its velocity, and what helps if
    it is another quantity, for errors.
    """
    measured, current_measured = "velocity" in data, "current" in data
    data.setdefault("current", np.zeros(len(data["time"])))
    if measured:
        _check_velocity(data, f"{place}, {velocity}", remedy)
    else:
        time = data["time"]
        _, data["velocity"], _ = smooth(
            data["displacement"], (time[-1] - time[0]) / (time.size - 1)
        )
    try:
        return TestRun(
            name, **data, velocity_measured=measured, current_measured=current_measured, **others
        )
    except InputError as error:
        raise InputError(str(error).replace(name, place, 1)) from None


def _recognised(names: list[str], place: str) -> dict[str, int]:
    """Quantity to its column; refuses missing, misspelt or repeated columns."""
    result: dict[str, int] = {}
    for k, name in enumerate(names):
        what = _COLUMNS.get(name)
        if what is None:
            _refuse_misspelt(name, names, place)
        elif what in result:
            other = names[result[what]]
            raise InputError(
                f"{place}: {what} given twice, as {other!r} and {name!r}; expected: one column, "
                "in one unit"
            )
        else:
            result[what] = k
    lacking = [what for what in _NEEDED if what not in result]
    if lacking:
        accepted = (" or ".join(f"{what}_{unit}" for unit in _UNITS[what]) for what in lacking)
        raise InputError(
            f"{place}: no column of {' and '.join(lacking)} among {', '.join(names)}; expected: "
            f"{', '.join(accepted)}; isolation-sim import reads other headings"
        )
    return result


def _refuse_misspelt(name: str, names: list[str], place: str) -> None:
    free = [c for c, what in _COLUMNS.items() if not any(_COLUMNS.get(n) == what for n in names)]
    what = name.partition("_")[0].lower()
    if what in _UNITS:
        accepted = [f"{what}_{unit}" for unit in _UNITS[what]]
    else:
        accepted = [near_name(name, free, surely=True)]
    if any(accepted):
        raise InputError(f"{place}: unknown column {name!r}; expected: {' or '.join(accepted)}")


def _check_velocity(data: dict[str, np.ndarray], place: str, remedy: str) -> None:
    time, values = data["time"], data["velocity"]
    _, slope, _ = smooth(data["displacement"], (time[-1] - time[0]) / (time.size - 1))
    size, expected = np.std(values), np.std(slope)
    agrees = np.mean((values - values.mean()) * (slope - slope.mean())) > -0.5 * size * expected
    if not (expected <= _VELOCITY_FACTOR * size and size <= _VELOCITY_FACTOR * expected and agrees):
        opposite = "" if agrees else ", of opposite sign"
        raise InputError(
            f"{place}: {size:.3g} m/s rms where the displacement changes by {expected:.3g} m/s "
            f"rms{opposite}; expected: the displacement's velocity, in the unit that the name says"
            f"{remedy}"
        )
