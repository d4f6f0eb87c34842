"""Ten thousand runs as one sweep: against single runs, OpenSeesPy, one worker, and its memory.

Run it with ``python -m studies.benchmarks.sweep`` (``pip install '.[bench]'`` for OpenSeesPy).
Times of one machine; ratios within one process are what to compare between machines.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.table import Table

from isolation_sim.simulation.run import simulate
from isolation_sim.simulation.workspace import Workspace
from isolation_sim.structures import reference_building
from isolation_sim.structures.reference import FORCE_SCALE, LENGTH_SCALE
from isolation_sim.sweeps import SweepPlan, sweep
from isolation_sim.sweeps.chunk import Chunk
from isolation_sim.sweeps.design import Design
from isolation_sim.sweeps.run import MOST_CASES, chunk_of
from isolation_sim.workers import in_processes, in_this_process

from .peers import load_opensees, opensees_analysis
from .timing import wall_time

console = Console()


def plan(per_axis: int, controller: str = "constant") -> SweepPlan:
    """Reference building under El Centro: current, mass, stiffness of the isolators, and scale."""
    structure = reference_building()
    masses = structure.mass.diagonal().tolist()
    vary = [
        {"field": "structure.floor_masses_kg", "label": "mass", "factor": True,
         "low": 0.8, "high": 1.2, "count": per_axis},
        # the period of the isolated building goes with its root
        {"field": "isolator.force_scale", "label": "stiffness", "factor": True,
         "low": 0.5, "high": 2.0, "count": per_axis},
        {"field": "ground.scale_factor", "label": "scale", "low": 0.1, "high": 1.0,
         "count": per_axis},
        {"field": "controller.amperes" if controller == "constant" else "driver.high_A",
         "label": "current", "low": 0.3, "high": 3.0, "count": per_axis},
    ]  # fmt: skip
    return SweepPlan.from_dict({
        "name": "benchmark",
        "scenario": {
            "structure": {
                "floor_masses_kg": masses[1:],
                "storey_stiffnesses_N_per_m": [-structure.stiffness[0, 1]] * (len(masses) - 1),
                "base_mass_kg": masses[0],
                "rayleigh_modes": [1, 3],
            },
            "isolator": {"length_scale": LENGTH_SCALE, "force_scale": FORCE_SCALE},
            "controller": [{"name": controller}],
        },
        "vary": vary if controller == "constant" else vary[:3],
    })  # fmt: skip


@contextmanager
def in_compiled_code() -> Iterator[list[float]]:
    """Collect the processor time that is spent in the kernel, s."""
    spent: list[float] = []
    originals = {name: getattr(Workspace, name) for name in ("integrate", "peaks_and_mean_squares")}

    def counting(original: Callable) -> Callable:
        def counted(*arguments):
            # processor time of this thread: what else the machine does is left out
            start = time.thread_time()
            result = original(*arguments)
            spent.append(time.thread_time() - start)
            return result

        return counted

    for name, original in originals.items():
        setattr(Workspace, name, counting(original))
    try:
        yield spent
    finally:
        for name, original in originals.items():
            setattr(Workspace, name, original)


def chunks_of(design: Design, size: int = MOST_CASES) -> Iterator[Chunk]:
    """A design's chunks of so many cases."""
    for number, start in enumerate(range(0, design.n_cases, size)):
        yield chunk_of(design, number, range(start, min(start + size, design.n_cases)))


def ten_thousand(per_axis: int) -> None:
    """Print a sweep of many runs against loops over single runs."""
    design = Design(plan(per_axis))
    n = design.n_runs
    list(in_this_process(iter([chunk_of(design, 0, range(32))])))
    table = Table(title=f"{n} runs of El Centro with their criteria")
    for column in ("how", "s", "ms a run", "times the sweep on two processes"):
        table.add_column(column, justify="left" if column == "how" else "right")
    rows = []
    with in_compiled_code() as spent:
        rows.append(
            (
                "chunks one after another, nothing stored",
                wall_time(lambda: list(in_this_process(chunks_of(design)))),
            )
        )
    rows.append(("  of which in compiled code", sum(spent)))
    with tempfile.TemporaryDirectory() as folder:
        for workers in (1, 2):
            seconds = wall_time(lambda k=workers: sweep(design.plan, f"{folder}/{k}", workers=k))
            rows.append((f"sweep, everything, {workers} process{'es' * (workers > 1)}", seconds))
        size = sum(path.stat().st_size for path in Path(folder, "2").rglob("*"))
    whole = rows[-1][1]
    some = range(0, n, max(1, n // 200))
    single = wall_time(lambda: [one_run(design, k) for k in some]) / len(some)
    rows.append((f"loop over single runs (from {len(some)})", single * n))
    ops = load_opensees()
    if ops is not None:
        seconds = sum(wall_time(lambda k=k: opensees_run(ops, design, k)) for k in some[:10]) / 10
        rows.append(("loop over OpenSeesPy (from 10)", seconds * n))
    for name, seconds in rows:
        ratio = "" if name.startswith("  ") else f"{seconds / whole:.2f}"
        table.add_row(name, f"{seconds:.2f}", f"{seconds / n * 1e3:.3f}", ratio)
    console.print(table)
    console.print(f"on disk: {size / 1e6:.2f} MB, {size / n:.0f} bytes a run")


def one_run(design: Design, number: int) -> dict[str, float]:
    """Criteria of one case as a user's loop would have them."""
    job = design.case(number).scenario(design.base).build()
    (controller,) = job.controllers.values()
    return simulate(job.isolated, job.records, controller, **job.options).criteria


def opensees_run(ops, design: Design, number: int) -> None:
    """One case in OpenSeesPy, displacements to a file, on the nearest isolator that it has."""
    case = design.case(number)
    job = case.scenario(design.base).build()
    run, output = opensees_analysis(ops, job.isolated, job.records[0], case.shown["current"])
    run()
    ops.wipe()
    output.unlink()


def two_workers(per_axis: int) -> None:
    """Print how much two worker processes are faster than one, once they are at work."""
    table = Table(title="Two worker processes against one, start left out")
    # what the caller does cannot be divided: its share bounds the ratio on more workers
    for column in ("controller", "runs", "runs/s, one", "runs/s, two", "ratio", "caller's share"):
        table.add_column(column, justify="left" if column == "controller" else "right")
    for controller in ("constant", "on_off", "clipped_lqr"):
        design = Design(plan(per_axis, controller))
        list(in_this_process(iter([chunk_of(design, 0, range(32))])))
        rates = []
        size = min(MOST_CASES, max(1, design.n_cases // 16))
        for count in (1, 2):
            # from when every worker has answered once
            times = []
            before = processor_times()
            for finished in in_processes(chunks_of(design, size), count):
                times.append((time.perf_counter(), finished.n_runs))
            begun = times[2 * count - 1][0]
            rates.append(sum(n for _, n in times[2 * count :]) / (times[-1][0] - begun))
            caller, workers = (b - a for a, b in zip(before, processor_times(), strict=True))
        numbers = (
            f"{rates[0]:.0f}", f"{rates[1]:.0f}", f"{rates[1] / rates[0]:.2f}",
            f"{caller / (caller + workers):.1%}",
        )  # fmt: skip
        table.add_row(controller, str(design.n_runs), *numbers)
    console.print(table)


def processor_times() -> list[float]:
    """Processor time of this process, and of its children that have ended, s."""
    usages = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return [usage.ru_utime + usage.ru_stime for usage in usages]


def memory(per_axis: tuple[int, ...]) -> None:
    """Print the peak memory of sweeps of different length, each in a process of its own."""
    table = Table(title="Peak memory, two worker processes")
    for column in ("runs", "caller, MB", "largest worker, MB", "s"):
        table.add_column(column, justify="right")
    for n in per_axis:
        code = f"from studies.benchmarks.sweep import measured; measured({n})"
        answer = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout.split()
        table.add_row(str(n**4), *answer)
    console.print(table)


def measured(per_axis: int) -> None:
    """Run a sweep and print this process's peak memory, a worker's, and the time."""
    with tempfile.TemporaryDirectory() as folder:
        seconds = wall_time(lambda: sweep(plan(per_axis), f"{folder}/sweep", workers=2))
    peaks = [
        resource.getrusage(who).ru_maxrss / 1024
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    ]
    print(*(f"{peak:.0f}" for peak in peaks), f"{seconds:.1f}")


def main() -> None:
    """Run all benchmarks of the sweep."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", action="store_true", help="hundreds of runs, not thousands")
    short = parser.parse_args().short
    ten_thousand(4 if short else 10)
    two_workers(6 if short else 10)
    memory((4, 6) if short else (6, 8, 10, 12, 18))


if __name__ == "__main__":
    main()
