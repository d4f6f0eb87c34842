"""A sweep's folder: finished chunks that survive anything, and the table made of them.

A chunk counts when its file has its name, which holds the checksum of what is in it: it is written
under another name, forced to the disk and then renamed. So there is no instant at which a kill, a
full disk or a power cut leaves something half done that looks whole.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from ..errors import InputError
from .chunk import Finished
from .design import differences
from .rows import FORMAT

ROWS = 8_192
"""Rows of a group in the final table, which so does not depend on the size of chunks."""

_LEFT_OVER = ".unfinished"


class Store:
    """A sweep's folder.

    Parameters
    ----------
    folder : str or pathlib.Path
        ``manifest.json``, ``chunks/`` while the sweep runs, ``table.parquet`` at its end, and
        ``histories/`` where they are kept.
    """

    def __init__(self, folder: str | Path):
        self.folder = Path(folder)
        self.manifest = self.folder / "manifest.json"
        self.table = self.folder / "table.parquet"
        self.chunks = self.folder / "chunks"
        self.histories = self.folder / "histories"

    def exists(self) -> bool:
        """Whether a sweep was begun there."""
        return self.manifest.is_file()

    def check_free(self) -> None:
        """Make sure that there is nothing yet."""
        if self.folder.is_file():
            raise InputError(f"{self.folder}: a file; expected: a new folder")
        there = self.folder.iterdir() if self.folder.exists() else ()
        if not all(path.name.endswith(_LEFT_OVER) for path in there):
            remedy = ", or --resume to go on with the sweep there" if self.exists() else ""
            raise InputError(
                f"{self.folder}: holds something already; expected: a new folder{remedy}"
            )

    def begin(self, content: dict[str, Any], cases_per_chunk: int) -> None:
        """Make the folder."""
        self.check_free()
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                f"{self.folder}: results cannot be written there ({error.strerror}); expected: a "
                "folder that you may write to"
            ) from None
        manifest = {"format": 1, "cases_per_chunk": cases_per_chunk, **content}
        write_durably(self.manifest, json.dumps(manifest, indent=1).encode())

    def read_manifest(self) -> dict[str, Any]:
        """Return what `begin` wrote."""
        try:
            return json.loads(self.manifest.read_bytes())
        except (FileNotFoundError, NotADirectoryError):
            raise InputError(
                f"{self.folder}: no sweep there; expected: a folder that isolation-sim sweep made"
            ) from None
        except (OSError, ValueError) as error:
            raise InputError(f"{self.manifest}: cannot be read ({error})") from None

    def check_same(self, content: dict[str, Any]) -> int:
        """Make sure that the plan is the one that was begun."""
        manifest = self.read_manifest()
        cases_per_chunk = manifest.pop("cases_per_chunk")
        manifest.pop("format")
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
        """Keep other processes from writing to the folder; a killed process lets it go."""
        try:
            import fcntl
        except ImportError:  # no such locks on this system
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

    def finished(self) -> set[int]:
        """Numbers of the chunks that are there and whole; what is not whole is removed.

        So is a chunk in which a run ended in an error: the next one may have what it lacked.
        """
        numbers = set()
        self.chunks.mkdir(exist_ok=True)
        for path in sorted(self.chunks.iterdir()):
            number, _, checksum = path.stem.partition("-")
            whole = not path.name.endswith(_LEFT_OVER) and _checksum(path.read_bytes()) == checksum
            if not whole or _has_errors(_read(path, ["status"])):
                path.unlink()
            else:
                numbers.add(int(number))
        return numbers

    def put(self, finished: Finished) -> None:
        """Keep a finished chunk; it counts when this returns."""
        if finished.histories:
            self.histories.mkdir(exist_ok=True)
        for name, data in finished.histories.items():
            write_durably(self.histories / name, data)
        checksum = _checksum(finished.table)
        write_durably(self.chunks / f"{finished.number:06d}-{checksum}.parquet", finished.table)

    def close(self) -> None:
        """Put the chunks together, a group of rows at a time, and remove them."""
        unfinished = self.table.with_name(self.table.name + _LEFT_OVER)
        paths = sorted(self.chunks.iterdir())
        try:
            with unfinished.open("wb") as file:
                writer: pq.ParquetWriter | None = None
                for group in _regrouped(paths):
                    if writer is None:
                        writer = pq.ParquetWriter(file, group.schema, **FORMAT)
                    writer.write_table(group, row_group_size=ROWS)
                if writer is not None:
                    writer.close()
                file.flush()
                os.fsync(file.fileno())
            unfinished.replace(self.table)
        finally:
            unfinished.unlink(missing_ok=True)
        _sync_folder(self.folder)
        self.tidy()

    def has_errors(self) -> bool:
        """Whether a run of a finished sweep ended in an error."""
        return _has_errors(_read(self.table, ["status"]))

    def reopen(self, cases_per_chunk: int) -> None:
        """Divide a finished table into chunks again, and leave out those with an error."""
        table = _read(self.table)
        self.tidy()
        self.chunks.mkdir()
        numbers = pc.divide(table["case"], cases_per_chunk)
        for number in pc.unique(numbers).to_pylist():
            rows = table.filter(pc.equal(numbers, number))
            if not _has_errors(rows):
                sink = io.BytesIO()
                pq.write_table(rows, sink, **FORMAT)
                self.put(Finished(number, sink.getvalue(), len(rows), 0))
        self.table.unlink()

    def tidy(self) -> None:
        """Remove the chunks of a sweep whose table is there."""
        if self.table.is_file():
            shutil.rmtree(self.chunks, ignore_errors=True)

    def read(self, columns: Sequence[str] | None = None) -> pa.Table:
        """Return the table: of the whole sweep, or of what is finished of it."""
        if self.table.is_file():
            return _read(self.table, columns)
        paths = sorted(self.chunks.glob("*.parquet"))
        if not paths:
            raise InputError(f"{self.folder}: no chunk is finished yet")
        return pa.concat_tables(_read(path, columns) for path in paths)


def _regrouped(paths: list[Path]) -> Iterator[pa.Table]:
    """Yield the chunks' rows in groups of one size."""
    waiting: list[pa.Table] = []
    for path in paths:
        waiting.append(_read(path))
        while sum(map(len, waiting)) >= ROWS:
            together = pa.concat_tables(waiting)
            yield together.slice(0, ROWS).combine_chunks()
            waiting = [together.slice(ROWS)]
    rest = pa.concat_tables(waiting)
    if len(rest):
        yield rest.combine_chunks()


def _read(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    names = None if columns is None else list(columns)
    return pq.read_table(path, columns=names, page_checksum_verification=True)


def _has_errors(table: pa.Table) -> bool:
    """Whether a run ended in an error that is not of its input: no memory, a file that is gone."""
    return bool(pc.any(pc.equal(table["status"], "error")).as_py())


def _checksum(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:32]


def write_durably(path: Path, data: bytes) -> None:
    """Write a file that is there whole, even after a power cut, or not at all."""
    unfinished = path.with_name(path.name + _LEFT_OVER)
    try:
        with unfinished.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    """Force a folder's names to the disk, where the system can."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
