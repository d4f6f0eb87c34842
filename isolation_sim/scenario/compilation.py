"""Compile controllers in a second process while the first one runs other controllers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, redirect_stderr, suppress
from functools import partial
from io import StringIO
from typing import TYPE_CHECKING

from ..errors import InputError
from ..workers import Worker, idle_processors
from .job import Job
from .scenario import Scenario

if TYPE_CHECKING:
    from ..simulation.result import Run


def _compile(scenario: str, label: str) -> None:
    """Compile a controller to the cache folder, in the second process."""
    with redirect_stderr(StringIO()):
        Scenario.from_toml(scenario).build().compile(label)


@contextmanager
def compile_in_parallel(scenario: Scenario, job: Job) -> Iterator[Callable[[str], Run]]:
    """Yield ``job.run``; on first use a second process compiles the last controllers."""
    # It starts with the last controller and the first process with the first, so that neither waits
    # long; only if the machine has an idle processor.
    if not _is_first_use(job) or not idle_processors():
        yield job.run
        return
    worker, pool = Worker(), ThreadPoolExecutor(1)
    text = scenario.to_toml()
    compilations = {
        label: pool.submit(worker.run, partial(_compile, text, label))
        for label in reversed(list(job.controllers))
    }

    def run(label: str) -> Run:
        if not compilations[label].cancel():
            with suppress(Exception):  # the run says what is wrong
                compilations[label].result()
        return job.run(label)

    try:
        yield run
    finally:
        worker.stop()
        pool.shutdown(cancel_futures=True)


def _is_first_use(job: Job) -> bool:
    """Whether the integration is not compiled; False with an FMU, which one process starts."""
    from ..simulation.fmu_run import unit_element
    from ..simulation.kernel.loading import is_compiled
    from ..simulation.plan import kernel_for
    from ..simulation.run import traceable

    isolated = job.isolated
    if len(job.controllers) < 2 or not isolated.elements:
        return False
    with suppress(InputError):  # the run says what is wrong
        traceable(isolated)
        return unit_element(isolated) is None and not is_compiled(kernel_for(isolated, 1, True))
    return False
