"""MATLAB files with the variables of a ground motion."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import FloatArray, positive
from ground_motions.component_names import are_a_pair, direction_in, is_vertical
from ground_motions.errors import InputError, wrong_choice
from ground_motions.readers.csv_file import is_of_another_quantity, quantity_of, unit_of
from ground_motions.readers.lines import uniform_step
from ground_motions.readers.mat_variables import mat_variables
from ground_motions.record import Record
from ground_motions.units import to_m_s2, unit_name

_TIMES = ("t", "time", "times", "time_s", "t_s", "tt")
_STEPS = ("dt", "dt_s", "delta_t", "deltat", "step", "ts")
_RATES = ("fs", "fs_hz", "rate", "sampling_rate", "sample_rate", "samplerate")
_UNITS = ("unit", "units", "acc_unit", "acc_units")
_ACCELERATIONS = ("acc", "ground_acc", "groundacc", "ag", "a_g", "a")
"""Beginnings of the names of accelerations, and whole names if shorter than three letters."""


@checked
def read_mat(
    path: str | Path,
    column: str | None = None,
    unit: str | None = None,
    dt: float | None = None,
) -> Record:
    """Read one variable of a MATLAB file.

    Parameters
    ----------
    path : str or Path
        ``.mat``, from version 7.3 with the extra hdf5: a vector of accelerations, with a vector
        ``time`` or ``t`` (s), a step ``dt`` (s) or a rate ``fs`` (Hz); or a matrix of two
        columns, times first. Fields of structs are named with a dot, ``gm.acc``.
    column : str, optional
        Name of the acceleration, where the file has several vectors and not one of them alone has
        a unit in its name or a name such as ``acc``.
    unit : str, optional
        Unit, as in `read_text`, where neither the name ends in it (``acc_m_s2``) nor a variable
        ``unit`` has it.
    dt : float, optional
        Sampling step, s, where the file has no time, step or rate.

    Returns
    -------
    Record
        The motion in m/s2, named after the file.

    Raises
    ------
    InputError
        If the file cannot be read; no variable, or more than one, can be the acceleration; the
        unit or the step is missing, unknown or given twice; or a sample is not a finite number.
    """
    values = dict(_named(mat_variables(Path(path))))
    series, motions = _all_series(values)
    if column in motions:
        expected = "an acceleration, as its name has the unit of another quantity"
        raise InputError(f"{path}, column", repr(column), expected)
    chosen = _chosen(series, values, column, path)
    place, array = f"{path}, variable {chosen}", series[chosen]
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if bad.size:
        raise InputError(f"{place}, sample {bad[0] + 1}", "no finite number", "numbers")
    unit = _unit(chosen, values, unit, place)
    step = _step(chosen, array, values, path)
    if dt is not None and step is not None and abs(step - dt) > 1e-6 * step:
        raise InputError(f"{path}, dt", f"{dt:g} s", f"{step:g} s, as in the file")
    if step is None:
        step = dt
    if step is None:
        expected = "a variable time, dt or fs; or dt=, the step in s; dt_s in a scenario"
        raise InputError(place, "no times and no step", expected)
    return Record(
        array[:, -1] * to_m_s2(unit),
        positive(f"{path}, dt (s)", step),
        name=Path(path).stem,
        source=f"{path}, variable {chosen}",
        file_unit=unit_name(unit) or unit,
    )


def acceleration_variables(path: str | Path) -> dict[str, str]:
    """Vectors called accelerations with a direction, and these; none without a pair."""
    series, _ = _all_series(dict(_named(mat_variables(Path(path)))))
    called = {name: direction_in(quantity_of(name)) for name in series if _is_acceleration(name)}
    words = [word for word in called.values() if not is_vertical(word)]
    return called if are_a_pair(*words) else {}


def _all_series(values: Mapping[str, Any]) -> tuple[dict[str, FloatArray], list[str]]:
    """Vectors that may be accelerations, and names of those with the unit of another quantity."""
    series = {
        name: array
        for name, value in values.items()
        if (array := _series(value)) is not None and _short(name) not in _TIMES
    }
    motions = [
        name
        for name in series
        if is_of_another_quantity(_short(name)) and not _is_acceleration(name)
    ]
    for name in motions:
        del series[name]
    return series, motions


def _named(variables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Variables, and fields of structs with a dot."""
    for name, value in variables.items():
        if isinstance(value, Mapping):
            yield from _named(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _short(name: str) -> str:
    return name.rpartition(".")[2].lower()


def _series(value: Any) -> FloatArray | None:
    """One or two columns of numbers, (n, 1) or (n, 2); None for anything else."""
    array = np.asarray(value if isinstance(value, np.ndarray) else 0.0)
    if array.dtype.kind not in "fiu" or array.ndim not in (1, 2) or array.size < 3:
        return None
    array = np.atleast_2d(array).astype(float)
    if array.shape[0] < array.shape[1]:
        array = array.T
    with_times = array.shape[1] == 2 and bool(np.all(np.diff(array[:, 0]) > 0.0))
    return array if array.shape[1] == 1 or with_times else None


def _unit_in(name: str) -> str | None:
    """Unit at the end of a name; ``a_g`` is the usual symbol of a ground acceleration."""
    unit = unit_of(name)
    return unit if unit != "g" or "acc" in name.lower() else None


def _is_acceleration(name: str) -> bool:
    """Whether a name begins like that of an acceleration, or is its symbol."""
    short = _short(name)
    return any(
        short.startswith(each) if len(each) > 2 else short == each for each in _ACCELERATIONS
    )


def _chosen(
    series: Mapping[str, FloatArray],
    values: Mapping[str, Any],
    column: str | None,
    path: str | Path,
) -> str:
    """Return the name of the acceleration."""
    if column is not None:
        if column not in series:
            raise wrong_choice(f"{path}, column", column, series)
        return column
    accelerations = [name for name in series if _is_acceleration(name)]
    with_unit = [name for name in series if _unit_in(name)]
    for candidates in (list(series), with_unit, accelerations):
        if len(candidates) == 1:
            return candidates[0]
    if not series:
        raise InputError(
            str(path),
            f"variables {', '.join(values) or 'none'}",
            "a vector of accelerations, or a matrix of two columns, times first",
        )
    raise InputError(
        str(path), f"{len(series)} vectors and no choice", f"column= one of {', '.join(series)}"
    )


def _beside(chosen: str, values: Mapping[str, Any], names: tuple[str, ...]) -> Iterator[Any]:
    """Values with one of some names, those of the same struct first."""
    struct = chosen.rpartition(".")[0]
    found = [name for name in values if _short(name) in names]
    for name in sorted(found, key=lambda name: name.rpartition(".")[0] != struct):
        if name.rpartition(".")[0] in (struct, ""):
            yield values[name]


def _unit(chosen: str, values: Mapping[str, Any], unit: str | None, place: str) -> str:
    """Return the unit of the name, of a variable or of the caller."""
    if unit is not None:
        to_m_s2(unit, f"{place}, unit")
    texts = [value for value in _beside(chosen, values, _UNITS) if isinstance(value, str)]
    own = _unit_in(chosen) or next(iter(texts), None)
    if own is None and unit is None:
        raise InputError(f"{place}, unit", "nothing", "the unit, for example unit='g'")
    if own is not None:
        to_m_s2(own, f"{place}, unit")
        if unit is not None and unit_name(own) != unit_name(unit):
            raise InputError(f"{place}, unit", repr(unit), f"{own}, as in the file")
    return own or unit or ""


def _step(
    chosen: str, array: FloatArray, values: Mapping[str, Any], path: str | Path
) -> float | None:
    """Return the step in s of the first column, the times, the step or the rate; None if none."""
    samples = range(1, len(array) + 1)
    if array.shape[1] == 2:
        return uniform_step(array[:, 0], samples, f"{path}, variable {chosen}, times")
    for value in _beside(chosen, values, _TIMES):
        if np.size(value) == len(array):
            return uniform_step(np.ravel(value), samples, f"{path}, times")
    for names, is_rate in ((_STEPS, False), (_RATES, True)):
        for value in _beside(chosen, values, names):
            if np.size(value) == 1:
                number = positive(f"{path}, {names[0]}", np.ravel(value)[0])
                return 1.0 / number if is_rate else number
    return None
