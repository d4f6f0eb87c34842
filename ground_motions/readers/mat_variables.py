"""Variables of MATLAB files, those of version 7.3 included, which are HDF5."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ground_motions.errors import InputError


def mat_variables(path: Path, squeezed: bool = True) -> dict[str, Any]:
    """Variables by name: structs as mappings, their arrays and cells as lists.

    ``squeezed``: without dimensions of length one, as vectors and numbers.
    """
    from scipy.io import loadmat

    try:
        with path.open("rb") as file:
            content = loadmat(file, squeeze_me=squeezed, simplify_cells=squeezed)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except NotImplementedError:
        content = _hdf5_variables(path, squeezed)
    except Exception:  # SciPy raises many kinds
        raise InputError(f"{path}: not a MATLAB .mat file") from None
    return {name: value for name, value in content.items() if not name.startswith("__")}


def _hdf5_variables(path: Path, squeezed: bool) -> dict[str, Any]:
    try:
        import h5py
    except ModuleNotFoundError:
        raise InputError(
            f"{path}: MATLAB's format 7.3 needs h5py, which is not installed; expected: pip "
            "install 'isolation-sim[hdf5]', or save(..., '-v7') in MATLAB"
        ) from None

    def value_of(item: Any) -> Any:
        if "MATLAB_sparse" in item.attrs:
            return _sparse(item)
        if isinstance(item, h5py.Group):
            return {name: value_of(each) for name, each in item.items()}
        if item.attrs.get("MATLAB_empty"):
            return np.zeros(0)
        values = item[()]
        if item.dtype == h5py.ref_dtype:  # cells, or a field of the structs of an array
            return [value_of(file[each]) for each in np.ravel(values)]
        if item.attrs.get("MATLAB_class", b"") == b"char":
            return "".join(map(chr, np.ravel(values)))
        array = np.asarray(values).T  # MATLAB stores columns first
        if squeezed:
            array = array.squeeze()
        return array if array.ndim else array.item()

    try:
        with h5py.File(path) as file:
            # names with # hold what cells and structs refer to
            names = [name for name in file if not name.startswith("#")]
            return {name: _struct_array(value_of(file[name])) for name in names}
    except OSError:
        raise InputError(f"{path}: not a MATLAB .mat file") from None


def _sparse(group: Any) -> Any:
    """A sparse matrix by columns, without entries if it has only zeros."""
    from scipy.sparse import csc_array

    shape = int(group.attrs["MATLAB_sparse"]), len(group["jc"]) - 1
    data, rows = (group[name][()] if name in group else np.zeros(0) for name in ("data", "ir"))
    return csc_array((data, rows, group["jc"][()]), shape=shape)


def _struct_array(value: Any) -> Any:
    """A list of structs where each field of a struct has the values of all of them."""
    if not isinstance(value, dict):
        return value
    lengths = {len(each) if isinstance(each, list) else 0 for each in value.values()}
    length = max(lengths, default=0)
    if len(lengths) == 1 and length > 1 and not any(map(_are_texts, value.values())):
        return [{name: each[k] for name, each in value.items()} for k in range(length)]
    return {name: _struct_array(each) for name, each in value.items()}


def _are_texts(values: list[Any]) -> bool:
    return all(isinstance(each, str) for each in values)
