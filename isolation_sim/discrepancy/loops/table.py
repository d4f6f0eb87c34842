"""A loop table: effective stiffness and damping ratio of steady harmonic tests.

A CSV file with the columns ``amplitude_mm, frequency_Hz, current_A, effective_stiffness_N_per_mm,
damping_ratio``, one row per test; an optional column ``hold_out`` of 0 and 1. The storage stiffness
may stand for the effective one, and the loss factor or loss stiffness for the damping ratio.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, unknown_name
from ...io.csv_table import read_csv_table

_CONDITIONS = ("amplitude_mm", "frequency_Hz", "current_A")
_STIFFNESS = ("effective_stiffness_N_per_mm", "storage_stiffness_N_per_mm")
_DAMPING = ("damping_ratio", "loss_factor", "loss_stiffness_N_per_mm")
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
        for what in ("amplitude", "frequency", "stiffness", "damping"):
            values = getattr(self, what)
            if not np.all(values > 0):
                worst = int(np.argmin(values))
                raise InputError(
                    f"{self.name}, row {worst + 1}: {what} {values[worst]:g}; expected: above 0"
                )

    def rows(self, which: NDArray) -> LoopTable:
        """The table of some rows, (k,) int or (n,) bool."""
        arrays = {k: one[which] for k, one in vars(self).items() if isinstance(one, np.ndarray)}
        return replace(self, **arrays)

    def spread(self, number: int) -> NDArray:
        """Places of fitted rows whose conditions lie far apart, (number,)."""
        left = np.flatnonzero(~self.held_out)
        conditions = np.stack([np.log(self.amplitude), np.log(self.frequency), self.current])[
            :, left
        ]
        low, high = conditions.min(axis=1), conditions.max(axis=1)
        at = (conditions.T - low) / np.where(high > low, high - low, 1.0)
        chosen = [int(np.argmin(at.sum(axis=1)))]
        away = np.full(len(left), np.inf)
        while len(chosen) < min(number, len(left)):
            away = np.minimum(away, np.linalg.norm(at - at[chosen[-1]], axis=1))
            chosen.append(int(np.argmax(away)))
        return np.sort(left[chosen])


def read_loop_table(path: str | Path) -> LoopTable:
    """Read a loop table."""
    cells = read_csv_table(path)
    names = cells.names
    accepted = (*_CONDITIONS, *_STIFFNESS, *_DAMPING, _HOLD_OUT)
    for name in names:
        if name not in accepted:
            raise unknown_name(f"column of {path}", name, accepted)
    for several in (*((name,) for name in _CONDITIONS), _STIFFNESS, _DAMPING):
        present = [name for name in several if name in names]
        if len(present) != 1:
            actual = f"columns {' and '.join(present)}" if present else f"no column {several[0]}"
            raise InputError(f"{cells.head}: {actual}; expected: one of {', '.join(several)}")
    table = cells.numbers(range(len(names)))
    if len(table) < _LEAST_ROWS:
        raise InputError(f"{path}: {len(table)} rows; expected: {_LEAST_ROWS} or more")
    column = {name: table[:, k] for k, name in enumerate(names)}
    stiffness = next(column[name] for name in _STIFFNESS if name in column)
    return LoopTable(
        name=str(Path(path).stem),
        amplitude=1e-3 * column["amplitude_mm"],
        frequency=column["frequency_Hz"],
        current=column["current_A"],
        stiffness=1e3 * stiffness,
        damping=_damping(column, stiffness),
        held_out=column.get(_HOLD_OUT, np.zeros(len(table))) > 0,
    )


def _damping(column: Mapping[str, NDArray], stiffness: NDArray) -> NDArray:
    """Damping ratio by the column that gives it: half of the loss factor, loss over storage."""
    if "damping_ratio" in column:
        return column["damping_ratio"]
    if "loss_factor" in column:
        return column["loss_factor"] / 2
    with np.errstate(divide="ignore", invalid="ignore"):  # the table refuses a stiffness of 0
        return column["loss_stiffness_N_per_mm"] / stiffness / 2
