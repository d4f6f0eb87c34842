"""Progress of long work as lines on standard error, where there is no terminal to draw on."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

BETWEEN_LINES = 30.0
"""Least time between two lines, s."""


def occasional_lines(steps: int, quiet: bool = False) -> Callable[..., None]:
    """Return ``step(text, done=1, total=None)``; a line from time to time, as steps begin."""
    started = last = time.monotonic()
    count: float = -1

    def step(text: str, done: float = 1, total: int | None = None) -> None:
        nonlocal last, count, steps
        if total is not None:
            count, steps = 0, total
        count += done
        now = time.monotonic()
        if not quiet and now - last >= BETWEEN_LINES:
            last = now
            share = f"{count} of {steps}, " if isinstance(count, int) else f"{count / steps:.0%}, "
            if not 0 <= count <= steps:  # the number of steps may be an estimate
                share = ""
            print(f"{text}: {share}{now - started:.0f} s", file=sys.stderr)

    return step
