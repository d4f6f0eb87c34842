"""Channels of building records as measured and as simulated, to draw."""

from __future__ import annotations

import re
from collections.abc import Iterator

from ..diagnosis import Trace, worst_first
from .fit import Comparison, Outcome
from .part import Part
from .record import DISPLACEMENT

_FLOOR = re.compile(r"floor(\d+)")


def traces(comparison: Comparison, before: Outcome, after: Outcome) -> tuple[Trace, ...]:
    """Channels as measured and simulated, to draw.

    Parameters
    ----------
    comparison : Comparison
        Records against the model.
    before, after : Outcome
        Without and with the causes.

    Returns
    -------
    tuple of Trace
        A channel in some time of a record each, those with the largest errors before first.
    """
    return worst_first(
        trace
        for parts, held_out in ((comparison.fitted, False), (comparison.held_out, True))
        for part in parts
        for trace in _of(part, held_out, comparison, before, after)
    )


def _of(
    part: Part, held_out: bool, comparison: Comparison, before: Outcome, after: Outcome
) -> Iterator[Trace]:
    record, samples = part.record, part.samples
    simulated = [
        record.values - comparison.residual(outcome.found, record) for outcome in (before, after)
    ]
    time = record.ground.time[samples]
    where = record.name
    if len(time) < len(record.ground):
        where += f" from {time[0]:.4g} s" if samples.start else f" to {time[-1]:.4g} s"
    for k, channel in enumerate(record.channels):
        moved = channel == DISPLACEMENT
        sensor = _FLOOR.sub(r"floor \1", channel.partition("_")[0])
        measured, *values = (
            (1e3 if moved else 1.0) * values[samples, k] for values in (record.values, *simulated)
        )
        yield Trace(
            name=f"{where}, {sensor}",
            held_out=held_out,
            time=time,
            across=time if moved else 1e3 * record.response[DISPLACEMENT][samples],
            across_label="time, s" if moved else "isolator displacement, mm",
            label="displacement, mm" if moved else "acceleration, m/s²",
            measured=measured,
            before=values[0],
            after=values[1],
        )
