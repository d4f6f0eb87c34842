"""Raw files and folders of them: their tables by name."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from ground_motions.readers.lines import AnotherQuantityError
from ground_motions.registry import Registry

from ...errors import InputError
from ..measured.run_table import MINIMUM_SAMPLES
from .raw_table import RawTable, tables_by_column, tables_of_frames

_KIND = re.compile(r"\b(sheet|table|test) ")
"""Words before the name of a sheet and the number of a table or a test."""
_NOT_IN_NAMES = re.compile(r'[\\/:*?"<>|\s]+')

TEST_READERS: Registry[Callable[[Path], Any]] = Registry(
    "isolation_sim.test_readers",
    "test reader",
    "a function of a path that returns a pandas.DataFrame, or several by the tests' names",
    lambda loaded: loaded if callable(loaded) else None,
)
"""Every reader of test files by their suffix, without the dot."""


def raw_files(places: Sequence[Path], kind: str = "test") -> list[Path]:
    """Files that can be read, those of folders in the order of the numbers in their names."""
    return [path for place in places for path in _files(place, _expected(kind))]


def tables_by_name(
    places: Sequence[Path],
    leave_out: Sequence[str],
    kind: str = "test",
    progress: Callable[[str], None] = lambda text: None,
    test_column: str | None = None,
    unreadable: Callable[[InputError], None] | None = None,
) -> tuple[dict[str, RawTable], list[str]]:
    """Tables by the names of their tests or records, and notes of files without one.

    ``test_column``: column that tells the tests of one table apart. ``unreadable``: called with
    the error of each file that cannot be read, which is raised otherwise.
    """
    by_name: dict[str, RawTable] = {}
    notes: list[tuple[str, str]] = []  # Files and what is said of them
    fitting: set[str] = set()
    failed = False

    def left_out(*names: str) -> bool:
        fits = {p for p in leave_out if any(fnmatch(name, p) for name in names)}
        fitting.update(fits)
        return bool(fits)

    for path in raw_files(places, kind):
        progress(f"reading {path.name}")
        try:
            tables = [] if left_out(path.name, path.stem) else read_tables(path)
            if test_column is not None:
                tables = [one for table in tables for one in tables_by_column(table, test_column)]
        except AnotherQuantityError:
            if path in places:
                raise
            notes.append((path.name, "neither accelerations nor displacements; left out"))
            continue
        except InputError as error:
            if unreadable is None:
                raise
            unreadable(error)
            failed = True
            continue
        for table in tables:
            part = _KIND.sub("", table.part) if len(tables) > 1 else ""
            name = _NOT_IN_NAMES.sub("_", f"{path.stem} {part}".strip())
            if name in by_name:
                raise InputError(
                    f"{by_name[name].place} and {table.place}: both are named {name!r}; "
                    "expected: different names"
                )
            if not (part and left_out(name, part)):
                by_name[name] = table
        if not (tables or left_out(path.name, path.stem)):
            if path in places:
                least = f"{MINIMUM_SAMPLES} rows of numbers or more, of one width"
                raise InputError(str(path), "no table", least)
            notes.append((path.name, "no table of numbers; left out"))
    for pattern in leave_out:
        if pattern not in fitting:
            named = kind if kind == "test" else "file"
            raise InputError("--leave-out", repr(pattern), pattern_of(by_name, named))
    if not (by_name or failed):
        raise InputError(f"{', '.join(map(str, places))}: no {kind}; expected: {_expected(kind)}")
    return by_name, notes_of(notes)


def notes_of(notes: Iterable[tuple[str, str]]) -> list[str]:
    """Notes of files; one for several that have the same."""
    files: dict[str, list[str]] = {}
    for file, text in notes:
        files.setdefault(text, []).append(file)
    return [
        f"{names[0]}{f' and {len(names) - 1} more' if len(names) > 1 else ''}: {text}"
        for text, names in files.items()
    ]


def pattern_of(names: Iterable[str], kind: str = "test") -> str:
    """Describe a pattern of names that would be accepted."""
    return f"a pattern that fits a {kind}, such as {next(iter(names), '*')!r}"


def _expected(kind: str) -> str:
    return f"{kind} files ({', '.join(suffixes())}) or a folder of them"


def _files(place: Path, expected: str) -> list[Path]:
    """A file, or those of a folder."""
    if not place.is_dir():
        if place.suffix.lower() not in suffixes():
            raise InputError(f"{place}: {place.suffix or 'no'} file; expected: {expected}")
        return [place]
    known = suffixes()
    return sorted(
        (p for p in place.iterdir() if p.suffix.lower() in known and p.name[0] not in ".~"),
        key=lambda path: [
            (float(part), "") if part[:1].isdigit() else (0.0, part)
            for part in re.split(r"(\d+(?:\.\d+)?)", path.stem.lower())
        ],
    )


def suffixes() -> tuple[str, ...]:
    """Suffixes of the files that can be read."""
    return tuple(f".{name}" for name in TEST_READERS)


def read_tables(path: Path) -> list[RawTable]:
    """Tests of a file; none if it holds no table of 16 rows or more."""
    name = path.suffix.lower().removeprefix(".")
    read = TEST_READERS[name]
    try:
        result = read(path)
        tables = result if isinstance(result, list) else tables_of_frames(path, result)
        return [table for table in tables if len(table.lines) >= MINIMUM_SAMPLES]
    except (InputError, OSError):
        raise
    except Exception as error:
        words = " ".join(str(error).split())
        raise InputError(
            f"test reader {name!r}", f"{type(error).__name__}: {words}", f"tests of {path}"
        ) from error
