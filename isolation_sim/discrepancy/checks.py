"""First look at measured runs: what is wrong with the data before any model is asked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..identification.run_table import TestRun

_CLIPPED = 6
"""Equal extreme samples in a row from which a channel counts as clipped."""
_LARGEST_DEFORMATION = 1.0
_DRIFT = 0.1


def data_notes(runs: Sequence[TestRun]) -> list[str]:
    """Say what looks wrong in the runs.

    Parameters
    ----------
    runs : sequence of TestRun
        The runs; the reader has refused what no model could use.

    Returns
    -------
    list of str
        One sentence each; none where nothing looks wrong.
    """
    notes = []
    for run in runs:
        for what in ("displacement", "force"):
            values = getattr(run, what)
            part = clipped(values)
            if part:
                notes.append(
                    f"{run.name}: {what} stands still at an extreme for {part} samples in a row, "
                    "as a clipped channel does"
                )
        if np.max(np.abs(run.displacement)) > _LARGEST_DEFORMATION:
            notes.append(
                f"{run.name}: deformation reaches {np.max(np.abs(run.displacement)):.3g} m; "
                "is its unit right?"
            )
        drift = _drift(run.displacement)
        if abs(drift) > _DRIFT:
            notes.append(
                f"{run.name}: the displacement's middle moves by {100 * drift:.0f} % of its range "
                "during the test"
            )
    gaps = {round(run.step, 9) for run in runs}
    if len(gaps) > 1:
        listed = ", ".join(f"{1e3 * g:.3g}" for g in sorted(gaps))
        notes.append(f"sampling intervals differ: {listed} ms")
    return notes


def clipped(values: NDArray) -> int:
    """Find the longest stretch of equal samples at an extreme.

    Parameters
    ----------
    values : numpy.ndarray, shape (n,)
        A channel.

    Returns
    -------
    int
        Number of samples; 0 if it is not too long to be chance.
    """
    longest = 0
    if np.unique(np.diff(values)).size < 8:
        return 0  # a channel of few levels says nothing
    for extreme in (values.max(), values.min()):
        at = np.flatnonzero(values == extreme)
        if at.size < _CLIPPED:
            continue
        breaks = np.flatnonzero(np.diff(at) > 1)
        lengths = np.diff(np.concatenate([[-1], breaks, [at.size - 1]]))
        longest = max(longest, int(lengths.max()))
    return longest if longest >= _CLIPPED else 0


def _drift(values: NDArray) -> float:
    """Change of the mid-range from the first to the last third, relative to the range."""
    third = len(values) // 3
    size = float(np.ptp(values))
    first, last = values[:third], values[-third:]
    if min(np.ptp(first), np.ptp(last)) < 0.9 * size:
        return 0.0  # a test whose size changes has no steady middle
    middle = [0.5 * (float(part.max()) + float(part.min())) for part in (first, last)]
    return (middle[1] - middle[0]) / size
