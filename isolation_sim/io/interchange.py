"""Export of results to MATLAB, Excel and CSV: all tables and histories of a folder."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.files import atomic_write

from ..errors import InputError, check_name, not_installed
from ..rendering import render
from .columns import read_columns
from .files import read_netcdf

if TYPE_CHECKING:
    import pandas

CSV = "csv"
"""The format of several files."""
MOST_ROWS = 1_048_575
"""Largest number of rows of a sheet, without its heading."""
LONGEST_FIELD, LONGEST_SHEET = 63, 31
"""Largest number of characters of MATLAB's field names and of Excel's sheet names."""


@checked
def export_results(
    folder: str | Path,
    form: str,
    out: str | Path | None = None,
    units: Literal["si", "engineering"] = "si",
) -> Path:
    """Write all tables and histories of a results folder to one file, or to CSV files.

    Parameters
    ----------
    folder : str or pathlib.Path
        Results of a run, a fit, a diagnosis, a sweep or a study: its CSV files, ``table.npz`` and
        netCDF files.
    form : {"mat", "xlsx", "csv"}
        ``"mat"``: MATLAB's format of version 5, one struct per file, whose fields are a table's
        columns, or a history's arrays with their axes and a struct ``units``. ``"xlsx"``: one sheet
        per table. A history has one sheet per first axis, and one column per index of the other
        axes. ``"csv"``: the tables of ``"xlsx"`` that are no CSV files yet, one file each, with ten
        digits; the histories of a sweep's cases too. If all are CSV files, as of a suite or a
        tuning, they are written.
    out : str or pathlib.Path, optional
        File to write; ``results.mat`` or ``results.xlsx`` in the folder by default. For ``"csv"``
        a folder, ``results_csv`` by default. Existing files are replaced.
    units : {"si", "engineering"}
        ``"engineering"``: mm, kN, kJ and percent of drift, as printed tables have them, in place of
        m, N, J and a ratio; names of columns say so. ``"csv"`` then writes all tables.

    Returns
    -------
    pathlib.Path
        The file or folder.

    Raises
    ------
    InputError
        If the format is unknown, the folder has no such files, or a table has more rows than a
        sheet can have.
    """
    check_form(form, EXPORTS)
    folder = Path(folder)
    check_name("units", units, ("si", "engineering"))
    engineering = units == "engineering"

    def convert(part: Any) -> Any:
        return render("units:in_engineering_units", part) if engineering else part

    def files(*patterns: str) -> list[Path]:
        return sorted(path for pattern in patterns for path in folder.glob(pattern))

    tables = files("*.csv")
    paths = files("table.npz", "*.nc", *["histories/*.nc"] * (form == CSV))
    if form != CSV or engineering or not paths:  # a suite or a tuning has CSV files alone
        paths = sorted([*tables, *paths])
    if not paths:
        what = "holds no results" if folder.is_dir() else "no such folder"
        kinds = "CSV files, table.npz or netCDF files"
        raise InputError(f"{folder}: {what}; expected: a folder with {kinds}")
    place = export_place(folder, form) if out is None else Path(out)
    if form == CSV:
        return _write_csv(paths, place, convert)
    parts: dict[str, Any] = {}
    for path in paths:
        parts[path.stem if path.stem not in parts else path.name] = convert(_read(path))
    return write_parts(parts, form, place)


def export_place(folder: Path, form: str) -> Path:
    """File or folder of an export in a results folder."""
    return folder / ("results_csv" if form == CSV else f"results.{form}")


def check_form(form: str, known: Collection[str]) -> None:
    """Refuse an unknown format, and one whose library is not installed."""
    check_name("form to export", form, known)
    if form == "xlsx":
        try:
            import openpyxl  # noqa: F401
        except ModuleNotFoundError:
            raise not_installed("xlsx", "openpyxl", "excel") from None


def write_parts(parts: dict[str, Any], form: str, path: Path) -> Path:
    """Write tables (pandas) and histories (xarray) by name to one file."""
    check_form(form, FORMS)
    with atomic_write(path) as unfinished:
        FORMS[form](parts, unfinished)
    return path


def _read(path: Path) -> Any:
    import pandas

    if path.suffix == ".nc":
        return read_netcdf(path)
    return pandas.read_csv(path) if path.suffix == ".csv" else pandas.DataFrame(read_columns(path))


def _write_mat(parts: dict[str, Any], path: Path) -> None:
    from scipy.io import savemat

    tree = {}
    for name, part in zip(_fields(parts), parts.values(), strict=True):
        arrays: dict[str, Any]
        if hasattr(part, "data_vars"):
            arrays = {str(key): array.values for key, array in part.variables.items()}
            units = {
                str(key): array.attrs["units"]
                for key, array in part.variables.items()
                if "units" in array.attrs
            }
            arrays["attributes"] = dict(zip(_fields(part.attrs), part.attrs.values(), strict=True))
            arrays["units"] = dict(zip(_fields(units), units.values(), strict=True))
        else:
            arrays = {str(column): part[column].to_numpy() for column in part}
        tree[name] = {
            key: value if isinstance(value, dict) else _for_matlab(value)
            for key, value in zip(_fields(arrays), arrays.values(), strict=True)
        }
    # an open file, since SciPy adds .mat to a name without it
    with path.open("wb") as file:
        savemat(file, tree, long_field_names=True, do_compression=True, oned_as="column")


def _for_matlab(values: np.ndarray) -> np.ndarray:
    """Numbers unchanged; texts as a cell array."""
    if values.dtype.kind in "fiucb":
        return values
    cells = np.empty(values.shape, object)
    cells[...] = np.vectorize(str, otypes=[object])(values) if values.size else values
    return cells


def _fields(names: Iterable[Any]) -> list[str]:
    """Unique names that MATLAB accepts."""
    return _each_once(
        (re.sub(r"^(?![A-Za-z])", "x", re.sub(r"\W", "_", str(name))) for name in names),
        LONGEST_FIELD,
    )


def _each_once(names: Iterable[str], longest: int) -> list[str]:
    result: list[str] = []
    for name in names:
        own, count = name[:longest], 1
        while own.lower() in map(str.lower, result):
            count += 1
            own = f"{name[: longest - len(str(count)) - 1]}_{count}"
        result.append(own)
    return result


def _write_xlsx(parts: dict[str, Any], path: Path) -> None:
    import pandas

    tables = {}
    for name, part in parts.items():
        for axis, table in _flat(part).items():
            if len(table) > MOST_ROWS:
                raise InputError(
                    f"{name} has {len(table)} rows; expected in a sheet: at most {MOST_ROWS}"
                )
            tables[f"{name} {axis}".strip()] = table
    sheets = _each_once((re.sub(r"[][:*?/\\]", "_", name) for name in tables), LONGEST_SHEET)
    with path.open("wb") as file, pandas.ExcelWriter(file, engine="openpyxl") as book:
        for sheet, table in zip(sheets, tables.values(), strict=True):
            table.to_excel(book, sheet_name=sheet, index=False)


def _write_csv(paths: Iterable[Path], folder: Path, convert: Callable[[Any], Any]) -> Path:
    """Write each table to a file of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    for path in paths:
        for axis, table in _flat(convert(_read(path))).items():
            name = f"{path.stem}_{axis}" if axis else path.stem
            with atomic_write(folder / f"{name}.csv") as unfinished:
                table.to_csv(unfinished, index=False, float_format="%.10g")
    return folder


def _flat(part: Any) -> dict[str, pandas.DataFrame]:
    """A table unchanged; a dataset as one table per first axis of its variables."""
    import pandas

    if not hasattr(part, "data_vars"):
        return {"": part}
    tables: dict[str, dict[str, Any]] = {}
    for name, array in part.data_vars.items():
        axis = str(array.dims[0]) if array.dims else "value"
        columns = tables.setdefault("" if axis == "time" else axis, {})
        if array.dims and axis in part.coords and axis not in columns:
            unit = part[axis].attrs.get("units")
            columns[_heading(axis, (), unit)] = part[axis].values
        places = array.values.reshape(array.shape[0] if array.dims else 1, -1)
        others = [part[dim].values for dim in array.dims[1:]]
        labels = [()] if not others else list(np.ndindex(*map(len, others)))
        for column, at in zip(places.T, labels, strict=True):
            where = tuple(other[k] for other, k in zip(others, at, strict=True))
            turns = bool(where) and str(where[0]) in array.attrs.get("rotations", "").split()
            unit = array.attrs.get("units_of_rotations" if turns else "units")
            columns[_heading(str(name), where, unit)] = column
    return {axis: pandas.DataFrame(columns) for axis, columns in tables.items()}


def _heading(name: str, where: tuple, unit: str | None) -> str:
    return " ".join([name, *map(str, where), *([f"({unit})"] if unit else [])])


FORMS: dict[str, Callable[[dict[str, Any], Path], None]] = {"mat": _write_mat, "xlsx": _write_xlsx}
"""Writers of one file."""
EXPORTS = (*FORMS, CSV)
"""Formats of a folder's results."""
