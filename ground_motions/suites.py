"""Suites of records: a folder, a list of files, or a download of PEER NGA-West2."""

from __future__ import annotations

import csv
import re
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath
from typing import TypeAlias

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.component_names import Component, by_header, by_recording, is_vertical
from ground_motions.errors import InputError, several, warn
from ground_motions.readers import READERS, at2, esm, read, smc, v2
from ground_motions.readers.csv_file import acceleration_columns, columns_of, has_units
from ground_motions.readers.dispatch import ARCHIVES, TEXT
from ground_motions.readers.geonet import directions_of
from ground_motions.readers.lines import AnotherQuantityError, read_lines
from ground_motions.readers.mat_file import acceleration_variables
from ground_motions.record import Record

_COMPONENTS = {".v2": v2.channels_of, ".v2c": v2.channels_of, ".v2a": directions_of}
_HEADERS: dict[str, Callable[[Path], Component | None]] = {
    ".asc": esm.component_of, ".at2": at2.component_of, ".smc": smc.component_of,
    ".v2": v2.component_of, ".v2c": v2.component_of,
}  # fmt: skip
_KNET = re.compile(r"\.(?P<direction>NS|EW|UD)(?P<sensor>[12]?)", re.IGNORECASE)
_NAMED = 8  # files in a warning
_SEARCH_RESULTS = "_SearchResults.csv"
_SECTION = "-- Summary of Metadata of Selected Records --"
_NUMBER, _FACTOR = "Record Sequence Number", "Scale Factor"
_HORIZONTAL = ("Horizontal-1 Acc. Filename", "Horizontal-2 Acc. Filename")
_VERTICAL = "Vertical Acc. Filename"


@checked
@dataclass(frozen=True, eq=False)
class SuiteRecord:
    """A ground motion of a suite: one or two horizontal components of one recording.

    Parameters
    ----------
    name : str
        Short name, for tables.
    components : tuple of Record
        One horizontal component or two.
    vertical : Record, optional
        The vertical component, where there is one.
    scale_factor : float
        Factor that the search which found the record gives it, dimensionless.
    """

    name: str
    components: tuple[Record, ...]
    vertical: Record | None = None
    scale_factor: float = 1.0

    def scaled(self, factor: float) -> SuiteRecord:
        """Return the record with all components times a factor.

        Parameters
        ----------
        factor : float
            Factor on the accelerations, dimensionless.

        Returns
        -------
        SuiteRecord
        """
        vertical = None if self.vertical is None else self.vertical.scaled(factor)
        scaled = tuple(each.scaled(factor) for each in self.components)
        return SuiteRecord(self.name, scaled, vertical, self.scale_factor)


_COPY = 1e-3
"""Difference of two records over their peak up to which one is a copy, rounded by its format."""

Columns: TypeAlias = str | Sequence[str] | None
"""One column or channel, or two horizontal ones and the vertical one."""

OnUnreadable: TypeAlias = Callable[[InputError], None] | None
"""Called with the error of each record that cannot be read."""


@checked
def read_folder(
    folder: str | Path,
    *,
    unit: str | None = None,
    dt: float | None = None,
    column: Columns = None,
    on_unreadable: OnUnreadable = None,
) -> list[SuiteRecord]:
    """Read every record in a folder; warnings name files not used, pairs, and boreholes.

    Parameters
    ----------
    folder : str or Path
        Unpacked download of PEER NGA-West2, with its ``_SearchResults.csv``; or files of records,
        each a record of its own, for which there is a reader. The columns of acceleration of a CSV
        file, the channels of a V2 file, and variables of a MATLAB file whose names end in a pair
        as below, are components; K-NET files that differ in their
        suffix alone are, too. So are V2, SMC and AT2 files whose headers name one recording, and
        other files of one component whose names differ in their end alone, where these are a
        pair: ``_H1`` and ``_H2``, ``-FN`` and ``-FP``, ``NS`` and ``EW``, ``N`` and ``E``, ``X``
        and ``Y``, or azimuths at right angles such as ``-000`` and
        ``-090``; with ``-UP`` or ``_V`` for the vertical component. Files that their headers call
        velocities, displacements or spectra are not used.
    unit : str, optional
        Unit of text files without one in their headings, which are not used without it, and of
        CSV and MATLAB files that have none.
    dt : float, optional
        Sampling step of text and MATLAB files without times, s. Others keep their own.
    column : str or sequence of str, optional
        Columns of CSV files, variables of MATLAB files, channels of V2 files and directions of
        V2A files, with more than one. One, or two for the two horizontal components; a third one
        is the vertical component. Needed for more than two, unless headers tell the vertical one.
    on_unreadable : callable, optional
        Called with the error of each record that cannot be read, which is left out. Without it
        all unreadable records are refused in one message.

    Returns
    -------
    list of SuiteRecord
        In the order of the search results, else by name.

    Raises
    ------
    InputError
        If there is no such folder, no record in it, or a file cannot be used; with
        ``on_unreadable``, if none can be used.
    """
    folder = Path(folder)
    if not folder.is_dir():
        value = "a file" if folder.is_file() else "a folder that does not exist"
        archive = ", unpacked" * (folder.suffix.lower() in ARCHIVES)
        raise InputError(str(folder), value, f"a folder with files of records{archive}")
    if (folder / _SEARCH_RESULTS).is_file():
        return _search_results(folder / _SEARCH_RESULTS, lambda name: folder / name, on_unreadable)
    suffixes = {f".{name}" for name in READERS}
    present = sorted(p for p in folder.iterdir() if p.is_file() and not p.name.startswith("."))
    components: dict[Path, Component | None] = {}
    for path in present:
        suffix = path.suffix.lower()
        if suffix in suffixes and (unit or suffix not in TEXT or has_units(path)):
            with suppress(AnotherQuantityError):
                components[path] = _only_component(path)
    files = list(components)
    others = [path for path in present if path not in components]
    text = any(path.suffix.lower() in TEXT for path in others)
    hint = "; .txt, .dat and .acc files need unit, or headings with one" if text else ""
    if not files:
        expected = f"files {', '.join(sorted(suffixes - TEXT))}{hint}"
        raise InputError(str(folder), "no file of a record", expected)
    vertical: list[Path] = []
    single = {path: component for path, component in components.items() if component}
    grouped = _group_components(files, single, vertical.append)
    groups = sorted(grouped, key=lambda each: min(each[1]))
    if vertical and not groups:
        raise InputError(str(folder), "vertical components alone", "horizontal components")
    on_structure = [
        f"{path.name} ({each.location})" for path, each in single.items() if each.is_on_structure
    ]
    deep = [path.name for _, paths in groups for path in paths if _is_borehole(path)]
    paired = [f"{name} ({', '.join(path.name for path in paths)})" for name, paths in groups
              if len(paths) > 1 and not _KNET.fullmatch(paths[0].suffix)]  # fmt: skip
    for told, names, remedy in (
        ("not used", [path.name for path in others], hint),
        ("not called free field by their headers, as sensors on a structure are", on_structure, ""),
        ("not at the surface, as KiK-net's sensors 1 are in a borehole", deep, ""),
        ("not used, vertical components alone", [path.name for path in vertical], ""),
        ("components of one record, by the ends of their names or by their headers", paired,
         "; the first acts along x: components = \"swapped\" in [ground] exchanges all, and a list "
         "of files pairs them otherwise"),
    ):  # fmt: skip
        if names:
            warn(f"{folder}: {told}: {_listed(names)}{remedy}", UserWarning)
    return _unique(_readable(groups, unit, dt, column, on_unreadable))


@checked
def read_files(
    files: Sequence[str | Path | Sequence[str | Path]],
    *,
    unit: str | None = None,
    dt: float | None = None,
    column: Columns = None,
    on_unreadable: OnUnreadable = None,
) -> list[SuiteRecord]:
    """Read a list of records.

    Parameters
    ----------
    files : sequence
        A file for each record, or two files for its two horizontal components; a third one is the
        vertical component.
    unit : str, optional
        As in `read_folder`.
    dt : float, optional
        As in `read_folder`, s.
    column : str or sequence of str, optional
        As in `read_folder`.
    on_unreadable : callable, optional
        As in `read_folder`.

    Returns
    -------
    list of SuiteRecord

    Raises
    ------
    InputError
        If a file cannot be used, or a record has more than three components.
    """
    groups = []
    for entry in files:
        paths = [Path(entry)] if isinstance(entry, str | Path) else [Path(each) for each in entry]
        if not 1 <= len(paths) <= 3:
            raise InputError("files of a record", f"{len(paths)}", "1 to 3")
        (name, together), *_ = by_recording(paths)
        name = name if len(together) == len(paths) else paths[0].stem
        groups.append((name, paths))
    return _unique(_readable(groups, unit, dt, column, on_unreadable))


def _is_borehole(path: Path) -> bool:
    """Whether a file is of the sensor of KiK-net below the surface."""
    match = _KNET.fullmatch(path.suffix)
    return match is not None and match["sensor"] == "1"


def _readable(
    groups: list[tuple[str, list[Path]]],
    unit: str | None,
    dt: float | None,
    column: Columns,
    on_unreadable: OnUnreadable,
) -> list[SuiteRecord]:
    """The records of groups of files."""
    readers = (partial(_record, name, files, unit, dt, column) for name, files in groups)
    return _all_or_told(readers, on_unreadable)


def _all_or_told(
    readers: Iterable[Callable[[], SuiteRecord]], on_unreadable: OnUnreadable
) -> list[SuiteRecord]:
    """Read records; those that cannot be read are told, or all refused in one message."""
    records, errors = [], []
    for reader in readers:
        try:
            records.append(reader())
        except InputError as error:
            errors.append(error)
    if errors and (on_unreadable is None or not records):
        what = f"{len(errors)} of {len(records) + len(errors)} records cannot be read"
        hint = "; leave_out_unreadable = true in [ground] runs the others" if records else ""
        raise several(what, errors, hint)
    if on_unreadable is not None:
        for each in errors:
            on_unreadable(each)
    return records


def _unique(records: list[SuiteRecord]) -> list[SuiteRecord]:
    names = [record.name for record in records]
    for name in names:
        if names.count(name) > 1:
            raise InputError("records", f"two called {name}", "files with different names")
    copies = _copies(records)
    if copies:
        warn(
            f"the same accelerations are in {_listed(copies)}: a copied record counts twice",
            UserWarning,
        )
    return records


def _copies(records: Iterable[SuiteRecord]) -> list[str]:
    """Pairs of records, one of which has a component of the other."""
    seen: dict[tuple[int, float], list[tuple[str, Record]]] = {}
    pairs: dict[str, None] = {}
    for record in records:
        for one in record.components:
            alike = seen.setdefault((len(one), round(one.dt, 9)), [])
            for name, other in alike:
                apart = np.max(np.abs(one.acceleration - other.acceleration))
                if name != record.name and apart <= _COPY * one.pga:
                    pairs[f"{name} and {record.name}"] = None
            alike.append((record.name, one))
    return list(pairs)


def _listed(names: list[str]) -> str:
    """The first few of many names."""
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more


def _group_components(
    files: list[Path], single: Mapping[Path, Component], leave_out: Callable[[Path], None]
) -> Iterator[tuple[str, list[Path]]]:
    """Names and files of records: the components of one recording together.

    ``single`` has the files of one component. ``leave_out`` is called with each vertical component
    without horizontal ones.
    """
    groups: dict[str, dict[str, Path]] = {}
    others: dict[Path, Component] = {}
    for path in files:
        match = _KNET.fullmatch(path.suffix)
        if match:
            name = f"{path.stem}_{match['sensor']}" if match["sensor"] else path.stem
            groups.setdefault(name, {})[match["direction"].lower()] = path
        elif path in single:
            others[path] = single[path]
        else:
            yield path.stem, [path]
    for name, group in groups.items():
        horizontal = [group[each] for each in ("ns", "ew") if each in group]
        vertical = [group["ud"]] if "ud" in group else []
        if horizontal:
            yield name, horizontal + (vertical if len(horizontal) == 2 else [])
        else:
            leave_out(group["ud"])
    for together in by_header(others):
        # the same files by their names: these have a name for the record, and an order
        (name, named), *further = by_recording(together)
        yield (together[0].stem, together) if further else (name, named)
        for path in together:
            del others[path]
    for name, paths in by_recording(others):
        if len(paths) == 1 and is_vertical(others[paths[0]].direction):
            leave_out(paths[0])
        else:
            yield name, paths


def _only_component(path: Path) -> Component | None:
    """The component of a file that has one; none if it has several, or cannot be read.

    A file of another quantity is refused.
    """
    suffix = path.suffix.lower()
    try:
        if suffix in _HEADERS:
            return _HEADERS[suffix](path)
        table = suffix == ".csv" or (suffix in TEXT and has_units(path))
        several_columns = table and len(acceleration_columns(path)) > 1
    except AnotherQuantityError:
        raise
    except InputError:
        return None
    return None if several_columns or suffix in _COMPONENTS else Component("", "")


def _record(
    name: str, files: list[Path], unit: str | None, dt: float | None, column: Columns
) -> SuiteRecord:
    """One record of the components in its files."""
    if len(files) == 1:
        components = _components(files[0], unit, dt, column)
    else:
        components = [_only(_components(file, unit, dt, column), file) for file in files]
    vertical = components[2] if len(components) == 3 else None
    return SuiteRecord(name, tuple(components[:2]), vertical)


@checked
def read_peer(path: str | Path, *, on_unreadable: OnUnreadable = None) -> list[SuiteRecord]:
    """Read a download of the PEER NGA-West2 ground motion database.

    Parameters
    ----------
    path : str or Path
        The zip file: AT2 files and ``_SearchResults.csv``, which pairs the components and gives
        the scale factors of the search.
    on_unreadable : callable, optional
        As in `read_folder`.

    Returns
    -------
    list of SuiteRecord
        Named by their record sequence number, in the order of the search.

    Raises
    ------
    InputError
        If the file is no such download, or lacks a file that its search results name.
    """
    path = Path(path)
    accepted = f"a zip file of PEER NGA-West2 with {_SEARCH_RESULTS}"
    if path.is_dir():
        raise InputError(str(path), "a folder", f"{accepted}; folder = reads it unpacked")
    try:
        archive = zipfile.ZipFile(path)
    except FileNotFoundError:
        raise InputError(str(path), "a file that does not exist", accepted) from None
    except (OSError, zipfile.BadZipFile) as error:
        raise InputError(str(path), f"no zip file ({error})", accepted) from None
    with archive, tempfile.TemporaryDirectory() as folder:
        # by their names alone: an archive cannot write outside the folder
        inside = {PurePosixPath(name).name: name for name in archive.namelist()}
        if _SEARCH_RESULTS not in inside:
            raise InputError(str(path), f"no {_SEARCH_RESULTS} in it", accepted)

        def unpacked(name: str) -> Path:
            if name not in inside:
                raise InputError(
                    f"{path}, {_SEARCH_RESULTS}", f"{name}, which is not in the zip file",
                    "the zip file with the time series",
                )  # fmt: skip
            file = Path(folder) / name
            file.write_bytes(archive.read(inside[name]))
            return file

        return _search_results(unpacked(_SEARCH_RESULTS), unpacked, on_unreadable)


def _components(path: Path, unit: str | None, dt: float | None, column: Columns) -> list[Record]:
    """The components in a file: the chosen columns, or both of two."""
    suffix = path.suffix.lower()
    columns: list[str | None] = [column] if isinstance(column, str) else list(column or ())
    if len(columns) > 3:
        raise InputError("column", f"{len(columns)} columns", "1 to 3")
    if suffix in TEXT:  # names are of other files of the folder
        columns = [each for each in columns if each is not None and each.isdecimal()]
    present: dict[str, str] = {}  # names of components, and their directions where they are told
    if suffix == ".mat" and not columns:
        present = acceleration_variables(path)
        columns = _both_and_vertical(present)
    if suffix == ".mat" or (suffix in TEXT and not has_units(path)):
        return [_read_with_step(path, unit, dt, each) for each in columns or [None]]
    if suffix == ".csv" or suffix in TEXT:
        present = acceleration_columns(path)
        if not present:
            header = columns_of(path)
            columns = [each for each in columns if each in header] or [None]
            return [read(path, column=each, unit=unit) for each in columns]
    elif suffix in _COMPONENTS:
        present = _COMPONENTS[suffix](path)
    if len(present) < 2:
        return [read(path)]
    return [read(path, column=each) for each in columns or _both_and_vertical(present) or [None]]


def _both_and_vertical(present: Mapping[str, str]) -> list[str | None]:
    """Components of a file, the vertical one last; none where there are more.

    ``present``: names, and their directions where they are told.
    """
    vertical = [name for name, direction in present.items() if is_vertical(direction)]
    horizontal = [name for name in present if name not in vertical]
    if len(horizontal) not in (1, 2) or len(vertical) > 1:
        return []
    return [*horizontal, *(vertical if len(horizontal) == 2 else ())]


def _read_with_step(
    path: Path, unit: str | None, dt: float | None, column: str | None = None
) -> Record:
    """A record of a file that has times or a step of its own, or else the one given."""
    try:
        return read(path, column=column, unit=unit, dt=dt)
    except InputError as error:
        if dt is None or error.place != f"{path}, dt":
            raise
        return read(path, column=column, unit=unit)


def _only(components: list[Record], path: Path) -> Record:
    """The one component of a file among several files of a record."""
    if len(components) > 1:
        raise InputError(
            str(path), f"{len(components)} components", "one, or column= with its name"
        )
    return components[0]


def _search_results(
    path: Path, result: Callable[[str], Path], on_unreadable: OnUnreadable
) -> list[SuiteRecord]:
    """The records of a search; ``result``: unpacks a file by its name."""

    def record(place: str, row: dict[str, str]) -> SuiteRecord:
        vertical = row.get(_VERTICAL, "")
        try:
            factor = float(row[_FACTOR])
        except ValueError:
            raise InputError(f"{place}, {_FACTOR}", repr(row[_FACTOR]), "a number") from None
        return SuiteRecord(
            f"RSN{row[_NUMBER]}",
            tuple(read(result(row[key])) for key in _HORIZONTAL if _is_file(row[key])),
            read(result(vertical)) if _is_file(vertical) else None,
            factor,
        )

    readers = [partial(record, *each) for each in _summary(path)]
    if not readers:
        raise InputError(f"{path}", "no record", f"rows below {_SECTION!r}")
    return _all_or_told(readers, on_unreadable)


def _is_file(name: str) -> bool:
    """Whether a cell names a file; PEER writes dashes where a component is missing."""
    return name.strip("- ") != ""


def _summary(path: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """Rows of the summary of a search, each with its place."""
    lines = read_lines(path)
    start = next((k for k, line in enumerate(lines) if _SECTION in line), None)
    if start is None or start + 1 >= len(lines):
        raise InputError(str(path), f"no section {_SECTION!r}", "search results of PEER NGA-West2")
    names = [cell.strip() for cell in lines[start + 1].split(",")]
    for key in (_NUMBER, _FACTOR, *_HORIZONTAL):
        if key not in names:
            raise InputError(f"{path}, line {start + 2}", f"no column {key!r}", "such a column")
    for number, line in enumerate(lines[start + 2 :], start=start + 3):
        if not line.strip(" ,"):  # of commas alone, where Excel has saved the file
            return
        (cells,) = csv.reader([line], skipinitialspace=True)
        if len(cells) != len(names):
            raise InputError(
                f"{path}, line {number}", f"{len(cells)} cells", f"{len(names)}, as in the header"
            )
        yield (
            f"{path}, line {number}",
            {name: cell.strip() for name, cell in zip(names, cells, strict=True)},
        )
