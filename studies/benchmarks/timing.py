"""Wall times of the benchmarks."""

from __future__ import annotations

import time
from collections.abc import Callable


def wall_time(action: Callable[[], object]) -> float:
    """Time of an action, s."""
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


def shortest_time(action: Callable[[], object], repetitions: int) -> float:
    """Shortest time of several, s."""
    return min(wall_time(action) for _ in range(repetitions))
