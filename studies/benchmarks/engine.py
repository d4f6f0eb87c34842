"""Speed of the engine against SciPy and OpenSeesPy, in one process and at matched accuracy.

Run it with ``python -m studies.benchmarks.engine`` (``pip install '.[bench]'`` for OpenSeesPy).
Times are the best of several; ratios are what to compare between machines.
"""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from controllers import controller
from ground_motions import Record, el_centro_1940, oscillator_response
from isolation_sim.environments import BuildingVectorEnv
from isolation_sim.laws import law
from isolation_sim.simulation.batch import Case, simulate_many
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import (
    plan_building,
    reference_building,
    reference_isolators,
    shear_building,
)

from .peers import FirstOrder, load_opensees, opensees_analysis
from .timing import shortest_time

CURRENT = 1.5
LARGEST_ERROR = 1e-6
"""Largest error of any state, relative to its peak; SciPy's solvers are timed at the engine's."""
console = Console()


def error(states: NDArray, reference: NDArray) -> float:
    """Largest error of any column, relative to that column's peak."""
    return float((np.abs(states - reference).max(axis=0) / np.abs(reference).max(axis=0)).max())


def states_of(run) -> NDArray:
    """Displacements, velocities and device states at the samples."""
    history = run.history
    return np.column_stack([history.displacement, history.velocity, run.states[:, 0]])


def at_error(
    solve: Callable[[float], NDArray], exact: NDArray, target: float, repetitions: int
) -> tuple[float, float]:
    """Relative tolerance and time, s, of a solver at an error: between two runs of it, in logs."""
    errors, times, tolerances = [], [], []
    for tolerance in (1e-6, 3e-7, 1e-7, 3e-8, 1e-8, 3e-9, 1e-9, 3e-10, 1e-10):
        errors.append(error(solve(tolerance), exact))
        tolerances.append(tolerance)
        if errors[-1] <= target:
            break
    for tolerance in tolerances[-2:]:
        times.append(shortest_time(lambda tolerance=tolerance: solve(tolerance), repetitions))
    at = np.log(errors[-2:])[::-1]
    tolerance, spent = (
        float(np.exp(np.interp(np.log(target), at, np.log(values[-2:])[::-1])))
        for values in (tolerances, times)
    )
    return tolerance, spent


def one_run() -> None:
    """Print one run of El Centro against the peers."""
    plant, record = reference_building().on(reference_isolators()), el_centro_1940()
    held = controller("constant", amperes=CURRENT)
    exact = states_of(simulate(plant, record, held, tolerance=1e-12))
    n = plant.structure.n_dofs
    for tolerance in (3e-5, 1e-5, 3e-6, 1e-6):
        ours = error(states_of(simulate(plant, record, held, tolerance=tolerance)), exact)
        if ours <= LARGEST_ERROR:
            break
    seconds = shortest_time(lambda: simulate(plant, record, held, tolerance=tolerance), 500)
    table = Table(title=f"One run, {record.duration:.0f} s of El Centro, 6 storeys, {CURRENT} A")
    for column in ("tool", "largest error", "ms a run", "this engine is faster by"):
        table.add_column(column, justify="left" if column == "tool" else "right")
    table.add_row(
        f"isolation_sim, tolerance {tolerance:.0e}", f"{ours:.1e}", f"{seconds * 1e3:.3f}", ""
    )

    peer = FirstOrder(plant, record, CURRENT)
    loops, products = peer.rate_in_loops(), peer.rate_in_products()
    for name, solve, repetitions in (
        ("odeint, compiled loops", lambda tol: peer.by_odeint(loops, tol), 5),
        ("odeint, compiled matrix products", lambda tol: peer.by_odeint(products, tol), 5),
        ("solve_ivp RK45", peer.by_solve_ivp, 1),
    ):
        tolerance, spent = at_error(solve, exact, ours, repetitions)
        table.add_row(
            f"{name}, rtol {tolerance:.0e}",
            f"{ours:.1e}",
            f"{spent * 1e3:.1f}",
            f"{spent / seconds:.0f}",
        )

    ops = load_opensees()
    if ops is None:
        table.add_row("OpenSeesPy", "", "not installed", "")
    else:
        spent = []
        for _ in range(5):
            run, output = opensees_analysis(ops, plant, record, CURRENT)
            spent.append(shortest_time(run, 1))
            ops.wipe()
            displacement = np.loadtxt(output)[:, 1:]
            output.unlink()
        attained = error(displacement, exact[1:, :n])
        table.add_row(
            f"OpenSeesPy, {record.dt} s, nearest isolator",
            f"{attained:.1e}",
            f"{min(spent) * 1e3:.1f}",
            f"{min(spent) / seconds:.0f}",
        )
    console.print(table)


def many_runs(n_runs: int = 1024) -> None:
    """Print a batch against a loop over single runs."""
    plant, record = reference_building().on(reference_isolators()), el_centro_1940()
    currents = np.linspace(0.0, 3.0, n_runs)
    cases = [Case(plant, record, controller("constant", amperes=float(i))) for i in currents]
    simulate_many(cases[:16])
    single = shortest_time(
        lambda: [simulate(c.isolated, c.ground, c.controller).criteria for c in cases], 1
    )
    table = Table(title=f"{n_runs} runs of El Centro with their criteria")
    for column in ("threads", "ms a run", "faster than a loop of single runs by"):
        table.add_column(column, justify="right")
    table.add_row("loop", f"{single / n_runs * 1e3:.3f}", "1.0")
    for threads in (1, 2):
        if threads > (os.cpu_count() or 1):
            break
        spent = shortest_time(lambda threads=threads: simulate_many(cases, threads=threads), 5)
        table.add_row(str(threads), f"{spent / n_runs * 1e3:.4f}", f"{single / spent:.1f}")
    console.print(table)


def storeys() -> None:
    """Print the cost of a run with its criteria against the number of storeys."""
    record = el_centro_1940()
    held = controller("constant", amperes=CURRENT)
    table = Table(title="Cost of a run with its criteria against storeys")
    for column in ("storeys", "ms a run", "us per storey", "of which integration, ms"):
        table.add_column(column, justify="right")
    points = []
    for n in (1, 2, 5, 10, 20, 50, 100):
        building = shear_building([2.5e5] * n, [5e8 * n / 5] * n, base_mass=3e5)
        plant = building.on(reference_isolators().scaled(force=(n + 1) / 6))

        def whole(plant=plant) -> None:
            simulate(plant, record, held).criteria  # noqa: B018

        spent = shortest_time(whole, 30)
        inner = shortest_time(lambda plant=plant: simulate(plant, record, held), 30)
        points.append((n, spent))
        table.add_row(str(n), f"{spent * 1e3:.2f}", f"{spent / n * 1e6:.0f}", f"{inner * 1e3:.2f}")
    console.print(table)
    upper = [(n, t) for n, t in points if n >= 10]
    slope = np.polyfit(*np.log(np.array(upper)).T, 1)[0]
    console.print(f"from 10 to 100 storeys the time grows as storeys^{slope:.2f}")


def isolators_in_plan() -> None:
    """Print the cost of four biaxial isolators over that of one element along each direction."""
    record = el_centro_1940()
    records = record, record.scaled(0.7)
    building = plan_building(
        [2.5e5] * 3, [3e8] * 3, [3e8] * 3, base_mass=3e5, plan=(20.0, 12.0), eccentricity=(1.0, 0.5)
    )
    yields = {"alpha": 3e7, "A": 1.0, "beta": 5e3, "gamma": 5e3, "n": 2.0}
    device = law("bouc_wen", {"k": 5e6, "c": 0.0, "F0": 0.0} | yields)
    spring, off = law("linear", {"k": 2e9}), controller("passive_off")
    plants = (
        building.on(device).with_element(spring, np.eye(12)[2], name="rotation"),
        building.on(device, biaxial=True),
    )
    few, many = (
        shortest_time(lambda plant=plant: simulate(plant, records, off), 20) for plant in plants
    )
    console.print(f"four biaxial isolators take {many / few:.1f} times as long as two elements")


def spectrum() -> None:
    """Print the cost of a response spectrum over that of the oscillators' histories."""
    record = Record(np.random.default_rng(0).standard_normal(60001), 0.005)
    periods = np.geomspace(0.1, 10.0, 20)
    histories = shortest_time(
        lambda: [oscillator_response(record, period) for period in periods], 3
    )
    peaks = shortest_time(lambda: record.spectrum(periods), 3)
    console.print(f"a spectrum takes {peaks / histories:.1f} times as long as the histories")


def environments() -> None:
    """Print the steps a second of many environments under random motions and currents."""
    many = BuildingVectorEnv(1024)
    many.reset(seed=1)
    actions = np.random.default_rng(0).uniform(0, 3, (10, 1024, 1)).astype(np.float32)

    def steps() -> None:
        for action in actions:
            many.step(action)

    console.print(f"environments: {actions.size / shortest_time(steps, 10):.3g} steps a second")


def main() -> None:
    """Run all benchmarks of the engine."""
    one_run()
    many_runs()
    storeys()
    isolators_in_plan()
    spectrum()
    environments()


if __name__ == "__main__":
    main()
