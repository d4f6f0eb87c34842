"""Charts of a fit: measured and modelled force-deformation loops."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .chart import Panel
from .panels import grid
from .style import DOUBLE_COLUMN, Look

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..identification.fitted import LawEvaluation, RunError

_MOST_PANELS = 18
_POINTS = 1200
"""Largest number of points of a loop: a few cycles are enough to see, and files stay small."""
_CYCLES = 2
"""Least number of cycles of a loop, if the run has as many; then with fewer points a cycle."""
_TURN = 0.3
"""Part of the range of the motion, from its middle, that both halves of a cycle exceed."""
_STRONG = 0.5
"""Energy of the last strong samples over that of the strongest ones of a run."""

LOOKS = {
    # the measured line is wider, so that it shows on both sides of the modelled line
    "measured": Look("#9a9a9a", width=2.3),
    # solid lines: consecutive loops coincide and would fill the gaps of dashes
    "modelled": Look("#0072B2"),
}


def fitted_loops(fit: LawEvaluation) -> Figure:
    """Measured and modelled loops of the runs of a fit or an evaluation, one panel per run."""
    shown = loops(fit.errors[:: -(-len(fit.errors) // _MOST_PANELS)])
    across = min(len(shown), 4 if len(shown) > 9 else 3)
    return grid(shown, across, DOUBLE_COLUMN / across)


def loops(errors: Sequence[RunError], motion: str = "displacement") -> list[Panel]:
    """Measured and modelled force over the displacement or velocity of each run."""
    peak = max(float(np.abs(e.run.force).max()) for e in errors)
    unit, scale = ("kN", 1e-3) if peak >= 2e3 else ("N", 1.0)
    x = {"displacement": "Deformation (mm)", "velocity": "Velocity (mm/s)"}[motion]
    panels = []
    # each on its own axes, since small loops may have the largest relative errors
    for error in errors:
        run = error.run
        shown = strong_end(run.force, run.displacement)
        abscissa = 1e3 * getattr(run, motion)[shown]
        forces = zip(LOOKS, (run.force, error.force), strict=True)
        lines = {name: (abscissa, scale * force[shown]) for name, force in forces}
        note = f"{100 * error.relative:.1f} %" + (", held out" if run.hold_out else "")
        title = run.name + (", over velocity" if motion == "velocity" else "")
        panels.append(Panel(title, x, f"Force ({unit})", lines, LOOKS, note=note))
    return panels


def strong_end(signal: NDArray, motion: NDArray) -> slice:
    """The last samples of a run that are strong, since an earthquake ends quietly."""
    length = min(len(signal), max(_POINTS, _CYCLES * _samples_per_cycle(motion)))
    total = np.append(0.0, np.cumsum(signal**2))
    energy = total[length:] - total[:-length]
    start = int(np.flatnonzero(energy >= _STRONG * np.max(energy))[-1])
    return slice(start, start + length, -(-length // _POINTS))


def _samples_per_cycle(motion: NDArray) -> int:
    """Median number of samples of a cycle; all samples of a run of fewer than two cycles."""
    centred = motion - (np.max(motion) + np.min(motion)) / 2
    turned = np.flatnonzero(np.abs(centred) > _TURN * np.max(np.abs(centred)))
    rises = turned[1:][np.diff(np.sign(centred[turned])) > 0]
    return int(np.ceil(np.median(np.diff(rises)))) if len(rises) > 1 else len(motion)
