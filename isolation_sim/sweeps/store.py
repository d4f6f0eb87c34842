"""A sweep's folder: finished chunks that survive an interruption, and the table from them.

The name of a chunk's file contains the checksum of its contents. The file is written under another
name, forced to the disk and then renamed. A kill, a full disk or a power failure can therefore
never leave an incomplete chunk that looks complete.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ground_motions.files import UNFINISHED, atomic_write

from ..criterion import Criterion, labels_of
from ..errors import InputError
from ..io.columns import column_names, columns_bytes, read_columns, write_columns
from ..io.results_folder import check_free, writing_to
from .chunk import Finished
from .design import differences

FORMAT = 2
"""Version of the folder's format; version 1 had Parquet tables."""

STORED = ("manifest.json", "chunks", "table.npz", "histories")
"""Files and folders of a sweep, finished or not."""

DRAWINGS = ("comparison", "map", "sensitivity")
"""Figures of a sweep."""

_AT_ONCE = 4_000_000
"""Largest number of values in memory while chunks are joined."""


class Store:
    """A sweep's folder."""

    def __init__(self, folder: str | Path):
        # ``manifest.json``, ``chunks/`` during the sweep, ``table.npz`` at its end, and
        # ``histories/`` if they are saved
        self.folder = Path(folder)
        self.manifest = self.folder / "manifest.json"
        self.table = self.folder / "table.npz"
        self.chunks = self.folder / "chunks"
        self.histories = self.folder / "histories"

    def exists(self) -> bool:
        """Whether the folder has a sweep."""
        return self.manifest.is_file()

    def check_free(self) -> None:
        """Refuse a folder that is not empty."""
        there = self.folder.iterdir() if self.folder.is_dir() else (self.folder,)
        if not all(path.name.endswith(UNFINISHED) for path in there):
            check_free(self.folder, resumable=self.exists())

    def begin(
        self, content: dict[str, Any], cases_per_chunk: int, criteria: Iterable[Criterion]
    ) -> None:
        """Create the folder; ``criteria``: the selected ones."""
        self.check_free()
        with writing_to(self.folder):
            self.folder.mkdir(parents=True, exist_ok=True)
        manifest = {
            "format": FORMAT, "cases_per_chunk": cases_per_chunk, "criteria": labels_of(criteria),
            **content,
        }  # fmt: skip
        with atomic_write(self.manifest, durable=True) as unfinished:
            unfinished.write_text(json.dumps(manifest, indent=1))

    def read_manifest(self) -> dict[str, Any]:
        """Return the data of `begin`."""
        try:
            manifest = json.loads(self.manifest.read_bytes())
        except (FileNotFoundError, NotADirectoryError):
            raise InputError(
                f"{self.folder}: no sweep there; expected: a folder that isolation-sim sweep made"
            ) from None
        except (OSError, ValueError) as error:
            raise InputError(f"{self.manifest}: cannot be read ({error})") from None
        if manifest.get("format") != FORMAT:
            raise InputError(
                f"{self.folder}: a sweep of another release; expected: to run the sweep again, "
                "or to read its table with pandas.read_parquet"
            )
        return manifest

    def check_same(self, content: dict[str, Any]) -> int:
        """Refuse another plan than that of the folder."""
        manifest = self.read_manifest()
        cases_per_chunk = manifest.pop("cases_per_chunk")
        for key in ("format", "criteria"):
            manifest.pop(key, None)
        differ = list(differences(manifest, json.loads(json.dumps(content))))
        if differ:
            more = f" (and {len(differ) - 3} more)" if len(differ) > 3 else ""
            raise InputError(
                f"{self.folder}: the plan has changed since: {'; '.join(differ[:3])}{more}; "
                "expected: the same plan, or a new folder"
            )
        return cases_per_chunk

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Lock the folder against other processes; the end of the process releases the lock."""
        try:
            import fcntl
        except ImportError:  # this system has no such locks
            yield
            return
        with (self.folder / ".lock").open("w") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise InputError(
                    f"{self.folder}: another process runs this sweep; expected: wait for it"
                ) from None
            yield

    def remove_pages(self) -> None:
        """Remove report and figures, which show fewer runs than there will be."""
        drawings = [f"figures/{name}{end}" for name in DRAWINGS for end in (".svg", ".png")]
        for name in ("report.html", *drawings):
            (self.folder / name).unlink(missing_ok=True)

    def finished(self) -> set[int]:
        """Numbers of the complete chunks; incomplete ones are removed."""
        # Chunks with an error are removed, too, since their runs may now succeed.
        numbers = set()
        self.chunks.mkdir(exist_ok=True)
        for place in (self.folder, self.chunks, self.histories):
            for path in place.glob(f"*{UNFINISHED}"):
                path.unlink()
        for path in sorted(self.chunks.iterdir()):
            number, _, checksum = path.stem.partition("-")
            whole = _checksum(path.read_bytes()) == checksum
            if not whole or _has_errors(read_columns(path, ["status"])):
                path.unlink()
            else:
                numbers.add(int(number))
        return numbers

    def put(self, finished: Finished) -> None:
        """Save a finished chunk; it is complete when this returns."""
        if finished.histories:
            self.histories.mkdir(exist_ok=True)
        checksum = _checksum(finished.table)
        paths = {self.histories / name: data for name, data in finished.histories.items()}
        paths[self.chunks / f"{finished.number:06d}-{checksum}.npz"] = finished.table
        for path, data in paths.items():
            with atomic_write(path, durable=True) as unfinished:
                unfinished.write_bytes(data)

    def close(self) -> None:
        """Join the chunks, some columns at a time, and remove them."""
        with atomic_write(self.table, durable=True) as unfinished, unfinished.open("wb") as file:
            write_columns(_together(sorted(self.chunks.iterdir())), file)
        self.tidy()

    def has_errors(self) -> bool:
        """Whether a run of a finished sweep ended in an error."""
        return _has_errors(read_columns(self.table, ["status"]))

    def reopen(self, cases_per_chunk: int) -> None:
        """Divide a finished table into chunks again, without those with an error."""
        table = read_columns(self.table)
        self.tidy()
        self.chunks.mkdir()
        numbers = table["case"] // cases_per_chunk
        for number in np.unique(numbers).tolist():
            rows = {name: column[numbers == number] for name, column in table.items()}
            if not _has_errors(rows):
                self.put(Finished(number, columns_bytes(rows), len(rows["case"]), 0))
        self.table.unlink()

    def tidy(self) -> None:
        """Remove the chunks of a sweep that has its table."""
        if self.table.is_file():
            shutil.rmtree(self.chunks, ignore_errors=True)

    def read(self, columns: Sequence[str] | None = None) -> dict[str, np.ndarray]:
        """Return the table of the finished runs."""
        if self.table.is_file():
            return read_columns(self.table, columns)
        paths = sorted(self.chunks.glob("*.npz"))
        if not paths:
            raise InputError(f"{self.folder}: no chunk is finished yet")
        return _concatenate(paths, columns)


def _together(paths: list[Path]) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the joined columns of all chunks; several at a time, to open few files."""
    if not paths:
        return
    names = column_names(paths[0])
    at_once = max(1, _AT_ONCE // max(1, len(_concatenate(paths, ["case"])["case"])))
    for first in range(0, len(names), at_once):
        yield from _concatenate(paths, names[first : first + at_once]).items()


def _concatenate(paths: list[Path], names: Sequence[str] | None) -> dict[str, np.ndarray]:
    """Concatenated columns of several files."""
    tables = [read_columns(path, names) for path in paths]
    return {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}


def _has_errors(table: dict[str, np.ndarray]) -> bool:
    """Whether a run ended in an error outside its input, such as lack of memory."""
    return bool(np.any(table["status"] == "error"))


def _checksum(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:32]
