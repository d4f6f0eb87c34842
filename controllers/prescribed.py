"""Commands from a table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.errors import InputError
from isolation_sim.io.csv_table import read_csv_table
from isolation_sim.simulation.control import RunContext

from .open_loop import OpenLoop
from .settings import ExistingFile, Numbers, Optional, setting


class Prescribed(OpenLoop):
    """Commands from a table; each is held until the next.

    The file is a CSV with a column ``time_s`` and either ``current_A``, for all coils, or one
    column a coil, ``coil0_current_A``, ``coil1_current_A``, ….
    """

    name = "prescribed"
    title = "Prescribed current"

    time: tuple[float, ...] | None = setting(
        None, "times of the commands, increasing from 0", Optional(Numbers()), "s"
    )
    amperes: tuple[Any, ...] | None = setting(
        None,
        "commands: one per time for all coils, or one per coil in each row",
        Optional(Numbers((1, 2))),
        "A",
    )
    file: str | None = setting(None, "CSV file with both", Optional(ExistingFile()))

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        by_table = (self.time is not None, self.amperes is not None)
        if any(by_table) == (self.file is not None) or any(by_table) != all(by_table):
            raise InputError(
                "prescribed: expected: time and amperes together, or a file with columns time_s "
                "and current_A"
            )
        self._columns = self._table()

    def _table(self) -> tuple[NDArray, NDArray]:
        """Instants, (n,), and commands, (n, 1) or (n, n_channels)."""
        if self.file is None:
            where, time = "prescribed", np.array(self.time)
            current = np.array(self.amperes).reshape(len(self.amperes or ()), -1)
        else:
            where = f"prescribed: {self.file}"
            time, current = _read(Path(self.file))
        if len(time) != len(current):
            raise InputError(f"{where}: {len(time)} instants for {len(current)} commands")
        if time[0] != 0:
            raise InputError(f"{where}: the first instant", f"{time[0]:g} s", "0")
        late = np.flatnonzero(np.diff(time) <= 0)
        if late.size:
            raise InputError(
                f"{where}: instant {time[late[0] + 1]:g} s follows {time[late[0]]:g} s; expected: "
                "increasing instants"
            )
        return time, current

    def commands(self, context: RunContext) -> tuple[NDArray, NDArray]:
        """Return the part of the table that lies within the run."""
        time, current = self._columns
        n_channels = len(context.low)
        if current.shape[1] not in (1, n_channels):
            raise InputError(
                f"prescribed: commands for {current.shape[1]} coils; the structure has {n_channels}"
            )
        within = time < context.duration
        return time[within], np.repeat(current[within], n_channels // current.shape[1], axis=1)


def _read(path: Path) -> tuple[NDArray, NDArray]:
    cells = read_csv_table(path)
    coils = [f"coil{k}_current_A" for k in range(len(cells.names) - 1)]
    needed = ["time_s", *(["current_A"] if "current_A" in cells.names else coils)]
    if len(needed) < 2 or not set(needed) <= set(cells.names):
        raise InputError(
            f"{cells.head}: columns",
            ", ".join(cells.names),
            "time_s and current_A, or time_s and coil0_current_A, coil1_current_A, ...",
        )
    if not cells.rows:
        raise InputError(f"{cells.head}: no rows below the header")
    columns = [cells.names.index(name) for name in needed]
    table = cells.numbers(columns)[:, columns]
    return table[:, 0], table[:, 1:]
