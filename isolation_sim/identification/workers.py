"""Threads that share out the fits of a search."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager


@contextmanager
def workers(threads: int | None = None) -> Iterator[ThreadPoolExecutor]:
    """Open a pool with one thread per processor."""
    # As long as it is open, linear algebra runs on the calling thread: the libraries' own threads
    # would wait for processors that the pool already uses, and take twice the time.
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, "blas"), ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        yield pool
