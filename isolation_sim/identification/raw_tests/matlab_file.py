"""MATLAB files, a test per struct or matrix."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..run_table import MINIMUM_SAMPLES
from .channels import Heading, heading_of
from .rate import rate_of
from .raw_table import RawTable, are_units

_MOST_COLUMNS = 64
"""Columns of a matrix without names, at most."""


def read_mat(path: Path) -> list[RawTable]:
    """MATLAB files: a struct or a matrix per test (version 7.3 needs the extra hdf5)."""
    from scipy.io import loadmat

    try:
        with path.open("rb") as file:
            content = loadmat(file, simplify_cells=True)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except NotImplementedError:
        content = _read_hdf5(path)
    except Exception:  # SciPy raises many kinds
        raise InputError(f"{path}: not a MATLAB .mat file") from None
    variables = {name: value for name, value in content.items() if not name.startswith("__")}
    return list(_structs(path, "", variables))


def _read_hdf5(path: Path) -> dict[str, Any]:
    """Variables of a file of version 7.3, which is HDF5, as ``loadmat`` gives those of others."""
    try:
        import h5py
    except ModuleNotFoundError:
        raise InputError(
            f"{path}: MATLAB's format 7.3 needs h5py, which is not installed; expected: pip "
            "install 'isolation-sim[hdf5]', or save(..., '-v7') in MATLAB"
        ) from None

    def value_of(item: Any) -> Any:
        if isinstance(item, h5py.Group):
            return {name: value_of(each) for name, each in item.items()}
        if item.attrs.get("MATLAB_empty"):
            return np.zeros(0)
        kind = item.attrs.get("MATLAB_class", b"").decode()
        values = item[()]
        if item.dtype == h5py.ref_dtype:  # cells, or a field of the structs of an array
            return [value_of(file[each]) for each in np.ravel(values)]
        if kind == "char":
            return "".join(map(chr, np.ravel(values)))
        # columns come first in MATLAB
        turned = np.asarray(values).T.squeeze()
        return turned if turned.ndim else turned.item()

    try:
        with h5py.File(path) as file:
            # names with # hold what cells and structs refer to
            return {
                name: _struct_array(value_of(each))
                for name, each in file.items()
                if not name.startswith("#")
            }
    except OSError:
        raise InputError(f"{path}: not a MATLAB .mat file") from None


def _struct_array(value: Any) -> Any:
    """A list of structs where each field of a struct has the values of all of them."""
    if not isinstance(value, dict):
        return value
    lengths = {len(each) if isinstance(each, list) else 0 for each in value.values()}
    length = max(lengths, default=0)
    if len(lengths) == 1 and length > 1 and not any(map(_is_text_list, value.values())):
        return [{name: each[k] for name, each in value.items()} for k in range(length)]
    return {name: _struct_array(each) for name, each in value.items()}


def _is_text_list(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(each, str) for each in value)


def _structs(path: Path, name: str, value: Any, above: float | None = None) -> Iterator[RawTable]:
    """Tables of a struct, of a list of structs, or of the variables of a file."""
    if isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
        for number, each in enumerate(value, 1):
            yield from _structs(path, f"{name} {number}".strip(), each, above)
        return
    if not isinstance(value, dict):
        return
    rate = rate_of(value) or above
    arrays = {key: a for key, each in value.items() if (a := _numbers(each)) is not None}
    vectors = {key: a.ravel() for key, a in arrays.items() if a.size == max(a.shape)}
    lengths = Counter(a.size for a in vectors.values() if a.size >= MINIMUM_SAMPLES)
    for length, count in lengths.most_common(1):
        if count > 1:
            alike = {key: a for key, a in vectors.items() if a.size == length}
            units = value.get("units")
            texts = units if isinstance(units, dict) else {}
            headings = [heading_of(key, str(texts.get(key, ""))) for key in alike]
            yield RawTable(path, name, headings, [*alike.values()], _one_to(length), rate=rate)
    for key, array in arrays.items():
        own = f"{name} {key}".strip()
        matrix = array.ndim == 2 and len(array) >= MINIMUM_SAMPLES
        if matrix and 2 <= array.shape[1] <= _MOST_COLUMNS:
            headings = _column_headings(value, array.shape[1])
            beside = {} if any(map(_is_time, headings)) else _time_beside(vectors, len(array))
            headings = [*map(heading_of, beside), *headings]
            columns = [*beside.values(), *array.T]
            yield RawTable(path, own, headings, columns, _one_to(len(array)), rate=rate)
    for key, each in value.items():
        yield from _structs(path, f"{name} {key}".strip(), each, rate)


def _is_time(heading: Heading) -> bool:
    return "time" in heading.quantities


def _time_beside(vectors: dict[str, NDArray], length: int) -> dict[str, NDArray]:
    """The vector of times of a matrix's rows, by its name; empty if there is not one."""
    times = {key: a for key, a in vectors.items() if a.size == length and _is_time(heading_of(key))}
    return times if len(times) == 1 else {}


def _numbers(value: Any) -> NDArray | None:
    real = isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and value.size
    return np.asarray(value, float) if real else None


def _one_to(length: int) -> list[int]:
    return list(range(1, length + 1))


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
