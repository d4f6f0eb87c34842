"""Readers of test files by the suffix of the files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ground_motions.registry import Registry

from ...errors import InputError
from ..run_table import MINIMUM_SAMPLES
from .raw_table import RawTable, tables_of_frames

TEST_READERS: Registry[Callable[[Path], Any]] = Registry(
    "isolation_sim.test_readers",
    "test reader",
    "a function of a path that returns a pandas.DataFrame, or several by the tests' names",
    lambda loaded: loaded if callable(loaded) else None,
)
"""Every reader of test files by their suffix, without the dot."""


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
