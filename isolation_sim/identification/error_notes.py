"""Notes on the errors of a law, run by run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .fitted import RunError, pooled

_ALONE, _FAR_WORSE = 2 / 3, 3.0
"""Share of the squared misfit in one run, and its error over that of the other runs, from which the
run alone makes the misfit. Convention."""
_GROSS = 0.3
"""Error from which a wrong sign, unit or channel is likelier than a test apart. Convention."""


def outlier_note(errors: Sequence[RunError]) -> str:
    """Say which run alone makes the misfit of a law; empty if none does."""
    if len(errors) < 3:
        return ""
    squares = np.array(
        [float(np.sum((one.force - one.run.force)[one.settled :] ** 2)) for one in errors]
    )
    worst = int(np.argmax(squares))
    error = errors[worst].relative
    others = pooled(one for k, one in enumerate(errors) if k != worst)
    if not (squares[worst] > _ALONE * squares.sum() and error > _FAR_WORSE * others):
        return ""
    run = errors[worst].run
    if error > _GROSS:
        advice = "Check its signs, units and channels first, or leave it out"
    elif run.hold_out:
        advice = "It was not fitted: the other runs may not determine the law there"
    else:
        advice = "Compare its amplitude, rate, current and history with those of the others"
    return (
        f"{run.name} alone makes {100 * squares[worst] / squares.sum():.0f} % of the squared "
        f"misfit: its error is {100 * error:.3g} %, that of the other runs {100 * others:.3g} %. "
        f"{advice}"
    )


def divergence_note(errors: Sequence[RunError]) -> str:
    """Say in which runs the force of a law is not finite; empty if it is in all."""
    lost = [one.run.name for one in errors if not np.isfinite(one.force).all()]
    if not lost:
        return ""
    return (
        f"the law diverges in {', '.join(lost)}: its parameters do not hold for the motion and the "
        "currents there"
    )
