"""A loop table: effective stiffness and damping ratio of steady harmonic tests.

A CSV file with the columns ``amplitude_mm, frequency_Hz, current_A, effective_stiffness_N_per_mm,
damping_ratio``, one row per test; an optional column ``hold_out`` of 0 and 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, unknown_name
from ...io.csv_table import read_csv_table

COLUMNS = (
    "amplitude_mm", "frequency_Hz", "current_A", "effective_stiffness_N_per_mm", "damping_ratio",
)  # fmt: skip
_HOLD_OUT = "hold_out"
_LEAST_ROWS = 6


@dataclass(frozen=True, eq=False)
class LoopTable:
    """Measured loops in two numbers each."""

    name: str  # Name to print
    # amplitude, frequency, current: (n,), m, Hz, A: Of the tests
    amplitude: NDArray
    frequency: NDArray
    current: NDArray
    # (n,), N/m: Effective: force difference over deformation difference at the extremes of the
    # deformation
    stiffness: NDArray
    damping: NDArray  # (n,): Energy of a cycle over 2 pi stiffness amplitude^2
    held_out: NDArray  # (n,) bool: Rows held out of the fit

    def __post_init__(self) -> None:
        n = len(self.amplitude)
        if n < _LEAST_ROWS:
            raise InputError(f"{self.name}: {n} rows; expected: {_LEAST_ROWS} or more")
        for what in ("amplitude", "frequency", "stiffness", "damping"):
            values = getattr(self, what)
            if not np.all(values > 0):
                worst = int(np.argmin(values))
                raise InputError(
                    f"{self.name}, row {worst + 1}: {what} {values[worst]:g}; expected: above 0"
                )


def read_loop_table(path: str | Path) -> LoopTable:
    """Read a loop table."""
    cells = read_csv_table(path)
    names = cells.names
    for name in names:
        if name not in (*COLUMNS, _HOLD_OUT):
            raise unknown_name(f"column of {path}", name, (*COLUMNS, _HOLD_OUT))
    for name in COLUMNS:
        if name not in names:
            raise InputError(f"{cells.head}: no column {name}; needed: {', '.join(COLUMNS)}")
    table = cells.numbers(range(len(names)))
    column = {name: table[:, k] for k, name in enumerate(names)}
    return LoopTable(
        name=str(Path(path).stem),
        amplitude=1e-3 * column["amplitude_mm"],
        frequency=column["frequency_Hz"],
        current=column["current_A"],
        stiffness=1e3 * column["effective_stiffness_N_per_mm"],
        damping=column["damping_ratio"],
        held_out=column.get(_HOLD_OUT, np.zeros(len(table))) > 0,
    )
