"""Workers: this process, processes on this machine, a Dask cluster, or threads of this process.

A task is a function without arguments that can be pickled, such as the runs of a tuning. A worker
process is a new interpreter that reads tasks from its standard input and writes their
results to its standard output. The caller's script needs no guard. If the caller is killed, the
worker's input ends and the worker stops.
"""

from __future__ import annotations

import os
import pickle
import queue
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from operator import call
from threading import Lock, Thread
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from ground_motions.registry import hides_packages

from .errors import InputError

if TYPE_CHECKING:
    from distributed import Client

Result = TypeVar("Result")


Task: TypeAlias = Callable[[], Result]
"""Task of a worker; its text is its name in errors."""

TRIES = 3
"""Number of workers that may die at a task before the sweep stops."""

_COMMAND = "from isolation_sim.workers import serve; serve()"


def in_this_process(tasks: Iterator[Task[Result]]) -> Iterator[Result]:
    """Run tasks one after another."""
    return map(call, tasks)


class Processes:
    """Processes on this machine, which start on demand and serve until they are stopped."""

    def __init__(self, count: int) -> None:
        self.count = count
        self._workers = [Worker() for _ in range(count)]

    def __enter__(self) -> Processes:
        return self

    def __exit__(self, *raised: object) -> None:
        self.stop()

    def run(self, tasks: Iterator[Task[Result]]) -> Iterator[Result]:
        """Run tasks; a caller that stops the iteration stops the processes."""
        idle: queue.SimpleQueue[Worker] = queue.SimpleQueue()
        for worker in self._workers:
            idle.put(worker)

        def run(task: Task[Result]) -> Result:
            worker = idle.get()
            try:
                return worker.run(task)
            finally:
                idle.put(worker)

        pool = ThreadPoolExecutor(self.count)
        try:
            yield from _some_at_a_time(pool, run, tasks, 2 * self.count)
        except BaseException:
            self.stop()
            raise
        finally:
            pool.shutdown(cancel_futures=True)

    def stop(self) -> None:
        """Stop the processes in any state; new ones start on demand."""
        for worker in self._workers:
            worker.stop()
        self._workers = [Worker() for _ in range(self.count)]


def in_processes(tasks: Iterator[Task[Result]], count: int) -> Iterator[Result]:
    """Run tasks in processes on this machine, which are stopped at the end."""
    with Processes(count) as processes:
        yield from processes.run(tasks)


def idle_processors() -> int:
    """Number of processors without work, beside the one that asks; 0 where that is unknown."""
    if not hasattr(os, "getloadavg") or not hasattr(os, "sched_getaffinity"):
        return 0
    count = len(os.sched_getaffinity(0))
    return max(min(count - 1, int(count + 0.5 - os.getloadavg()[0])), 0)


@contextmanager
def run_beside(list_tasks: Callable[[], Sequence[Task[None]]]) -> Iterator[None]:
    """Run tasks on idle processors meanwhile; those that are left at the end are dropped."""
    # they are listed only if a processor is idle
    count = idle_processors()
    tasks = list_tasks() if count else ()
    count = min(count, len(tasks))
    if not count:
        yield
        return

    def run_all() -> None:
        with suppress(InputError):  # the processes were stopped
            deque(processes.run(iter(tasks)), maxlen=0)

    with Processes(count) as processes:
        thread = Thread(target=run_all)
        thread.start()
        try:
            yield
        finally:
            processes.stop()
            thread.join()


def processors(workers: int | None) -> int:
    """Return the number of processes that a user asks for: one per processor by default."""
    if workers is not None and workers < 1:
        raise InputError("workers", f"{workers}", "1 or more")
    return workers or os.cpu_count() or 1


@contextmanager
def connected(address: str | None) -> Iterator[Client | None]:
    """Connect to a Dask cluster; called before any file is written."""
    if address is None:
        yield None
        return
    try:
        from distributed import Client
    except ImportError:
        raise InputError("--scheduler needs Dask; install isolation-sim[cluster]") from None
    try:
        client = Client(address, timeout="20s")
    except (OSError, ValueError) as error:
        raise InputError(
            f"--scheduler {address}: cannot be reached ({error}); expected: a Dask scheduler's "
            "address, such as tcp://10.0.0.1:8786"
        ) from None
    with client:
        yield client


def on_cluster(tasks: Iterator[Task[Result]], client: Client) -> Iterator[Result]:
    """Run tasks on a Dask cluster, whose workers must have this package installed."""
    # other workers take over the tasks of a dead worker
    pool = client.get_executor(retries=TRIES, pure=False)
    most = 2 * max(1, sum(client.nthreads().values()))
    yield from _some_at_a_time(pool, call, tasks, most)


def _some_at_a_time(
    pool: Executor,
    run: Callable[[Task[Result]], Result],
    tasks: Iterator[Task[Result]],
    most: int,
) -> Iterator[Result]:
    """Keep a pool busy with a limited number of tasks in memory."""
    pending: set[Future[Result]] = set()
    more = True
    while more or pending:
        while more and len(pending) < most:
            task = next(tasks, None)
            more = task is not None
            if task is not None:
                pending.add(pool.submit(run, task))
        if pending:
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()


class Worker:
    """One worker process, started on demand and again after its death."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._stopped = False
        self._starting = Lock()

    def run(self, task: Task[Any]) -> Any:
        """Run a task in the process, and raise its exceptions here."""
        for _ in range(TRIES):
            if self._stopped:
                break
            try:
                answer = self._ask(task)
            except (EOFError, OSError, pickle.UnpicklingError):
                self._end()
                continue
            if isinstance(answer, Exception):
                raise answer
            return answer
        raise InputError(
            f"{task}: {TRIES} worker processes died, killed or out of "
            "memory; finished chunks are saved"
        )

    def _ask(self, task: Task[Any]) -> Any:
        with self._starting:
            if self._stopped:
                raise EOFError
            if self._process is None:
                self._process = _start_process()
            questions, answers = self._process.stdin, self._process.stdout
        assert questions is not None and answers is not None
        pickle.dump(task, questions)
        questions.flush()
        return pickle.load(answers)

    def stop(self) -> None:
        """Stop the process in any state."""
        with self._starting:
            self._stopped = True
        self._end()

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()


def _start_process() -> subprocess.Popen[bytes]:
    """Start a worker with the import path of this process."""
    # a folder that hides a package of the project goes last
    paths = sorted((path or os.getcwd() for path in sys.path), key=hides_packages)
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(paths),
        # one process per processor leaves no processors for threads
        "OPENBLAS_NUM_THREADS": "1",
    }
    return subprocess.Popen(
        [sys.executable, "-P", "-c", _COMMAND],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment,
    )  # fmt: skip


def serve() -> None:
    """Main loop of a worker process: run tasks until the input ends."""
    # an interrupt of the caller reaches this process, too; the caller decides
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    questions, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    # prints go to standard error
    os.dup2(2, 1)
    while True:
        try:
            task = pickle.load(questions)
        except EOFError:
            return
        try:
            answer = task()
        except Exception as error:
            answer = error
        # the caller was killed
        with suppress(BrokenPipeError):
            pickle.dump(answer, answers)
            answers.flush()


@contextmanager
def workers(threads: int | None = None) -> Iterator[ThreadPoolExecutor]:
    """Open a pool with one thread per processor."""
    # As long as it is open, linear algebra runs on the calling thread: the libraries' own threads
    # would wait for processors that the pool already uses, and take twice the time.
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, "blas"), ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        yield pool
