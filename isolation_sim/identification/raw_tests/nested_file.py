"""MATLAB, JSON and HDF5 files, a test per struct, object or group, or per matrix."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ground_motions.readers.mat_variables import mat_variables

from ...errors import InputError, not_installed
from ..measured.run_table import MINIMUM_SAMPLES
from .channels import Heading, heading_of
from .rate import rate_of
from .raw_table import RawTable, are_units, table_of_columns

_MOST_COLUMNS = 64
"""Columns of a matrix without names, at most."""


class _Scalars(NamedTuple):
    """What the scalars of a struct, or of those around it, say of its columns."""

    rate: float | None  # Samples per second, Hz
    currents: dict[str, float]  # By name, as the file has them


_NO_SCALARS = _Scalars(None, {})


def read_mat(path: Path) -> list[RawTable]:
    """MATLAB files: a struct or a matrix per test (version 7.3 needs the extra hdf5)."""
    return list(_structs(path, "", mat_variables(path)))


def read_json(path: Path) -> list[RawTable]:
    """JSON files: an object of columns, a list of rows or a list of samples per test."""
    try:
        content = json.loads(path.read_bytes())
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except ValueError as error:
        raise InputError(f"{path}: not JSON ({error})") from None
    content = _of_lists(content)
    return list(_structs(path, "", content if isinstance(content, dict) else {"": content}))


def read_hdf5(path: Path) -> list[RawTable]:
    """HDF5 files: a group of columns or a matrix per test (needs the extra hdf5)."""
    try:
        import h5py
    except ModuleNotFoundError:
        raise not_installed(f"{path}:", "h5py", "hdf5") from None

    def content_of(item: Any) -> Any:
        if isinstance(item, h5py.Group):
            return contents_of(item)
        values = item[()]
        return {name: values[name] for name in item.dtype.names} if item.dtype.names else values

    def contents_of(group: Any) -> dict[str, Any]:
        items = {name: content_of(item) for name, item in group.items()}
        units = {name: item.attrs.get("units", "") for name, item in group.items()}
        return {**group.attrs, **items, "units": units}

    try:
        with h5py.File(path) as file:
            return list(_structs(path, "", contents_of(file)))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except OSError:
        raise InputError(f"{path}: not an HDF5 file") from None


def _of_lists(value: Any) -> Any:
    """JSON values with arrays in place of lists of numbers, and of numbers by row; null is NaN."""
    if isinstance(value, dict):
        if len(value) >= MINIMUM_SAMPLES and all(map(_is_sample, value.values())):
            return np.array([*value.values()], float)  # by the number of the sample
        return {key: _of_lists(each) for key, each in value.items()}
    if not isinstance(value, list) or not value:
        return value
    if all(isinstance(each, dict) for each in value) and len(value) >= MINIMUM_SAMPLES:
        # a sample per object
        return {key: _of_lists([each.get(key) for each in value]) for key in value[0]}
    try:
        return np.array(value, float)
    except (TypeError, ValueError):
        return [_of_lists(each) for each in value]


def _structs(
    path: Path, name: str, value: Any, above: _Scalars = _NO_SCALARS
) -> Iterator[RawTable]:
    """Tables of a struct, of a list of structs, or of the variables of a file."""
    if isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
        for number, each in enumerate(value, 1):
            yield from _structs(path, f"{name} {number}".strip(), each, above)
        return
    if not isinstance(value, dict):
        return
    scalars = _Scalars(rate_of(value) or above.rate, _currents_of(value) or above.currents)
    arrays = {key: a for key, each in value.items() if (a := _numbers(each)) is not None}
    vectors = {key: a.ravel() for key, a in arrays.items() if a.size == max(a.shape)}
    lengths = Counter(a.size for a in vectors.values() if a.size >= MINIMUM_SAMPLES)
    for length, count in lengths.most_common(1):
        if count > 1:
            alike = {key: a for key, a in vectors.items() if a.size == length}
            units = value.get("units")
            texts = units if isinstance(units, dict) else {}
            headings = [heading_of(key, str(texts.get(key, ""))) for key in alike]
            yield _table(path, name, headings, [*alike.values()], scalars)
    for key, array in arrays.items():
        own = f"{name} {key}".strip()
        matrix = array.ndim == 2 and len(array) >= MINIMUM_SAMPLES
        if matrix and 2 <= array.shape[1] <= _MOST_COLUMNS:
            headings = _column_headings(value, array.shape[1])
            beside = {} if any(map(_is_time, headings)) else _time_beside(vectors, len(array))
            headings = [*map(heading_of, beside), *headings]
            yield _table(path, own, headings, [*beside.values(), *array.T], scalars)
    for key, each in value.items():
        yield from _structs(path, f"{name} {key}".strip(), each, scalars)


def _table(
    path: Path, name: str, headings: list[Heading], columns: list[NDArray], scalars: _Scalars
) -> RawTable:
    """A test of columns, with the current that a scalar beside them says if none has it."""
    if not any("current" in heading.quantities for heading in headings):
        headings = [*headings, *map(heading_of, scalars.currents)]
        columns = [*columns, *(np.full(len(columns[0]), one) for one in scalars.currents.values())]
    return table_of_columns(path, name, headings, columns, rate=scalars.rate)


def _currents_of(struct: dict[str, Any]) -> dict[str, float]:
    """Scalars of a struct that are named a current; not ``i``, which counts loops."""
    return {
        name: float(value)
        for name, value in struct.items()
        if isinstance(value, int | float | np.number) and not isinstance(value, bool)
        and name != "i" and heading_of(name).quantities == ("current",)
    }  # fmt: skip


def _is_sample(value: Any) -> bool:
    return value is None or isinstance(value, float | int)


def _is_time(heading: Heading) -> bool:
    return "time" in heading.quantities


def _time_beside(vectors: dict[str, NDArray], length: int) -> dict[str, NDArray]:
    """The vector of times of a matrix's rows, by its name; empty if there is not one."""
    times = {key: a for key, a in vectors.items() if a.size == length and _is_time(heading_of(key))}
    return times if len(times) == 1 else {}


def _numbers(value: Any) -> NDArray | None:
    real = isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and value.size
    return np.asarray(value, float) if real else None


def _column_headings(struct: dict[str, Any], number: int) -> list[Heading]:
    """Headings of a matrix's columns: lists of names, as ``colheaders``, and of units beside it."""
    lists = [
        [str(each) for each in value] for value in struct.values()
        if isinstance(value, list | np.ndarray) and len(value) == number
        and all(isinstance(each, str) for each in value)
    ]  # fmt: skip
    units = next((each for each in lists if are_units(each)), [""] * number)
    numbered = [f"column {k}" for k in range(1, number + 1)]
    names = next((each for each in lists if each is not units), numbered)
    return [heading_of(name.strip(), unit) for name, unit in zip(names, units, strict=True)]
