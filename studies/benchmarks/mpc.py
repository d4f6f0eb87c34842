"""Predictive control: time a decision, and how exactly its programme is solved.

``python -m studies.benchmarks.mpc`` runs the reference building under El Centro with a 50 ms coil
and prints quantiles of the decisions' times, beside the time of a fixed calculation on the same
machine; the worst difference of a first move from a tight interior-point solution of the same
programme; the worst violation of a bound; the same decisions taken by do-mpc (with the extra
``bench``); and the clairvoyant bound with its certificate.
"""

from __future__ import annotations

from importlib.util import find_spec
from time import perf_counter
from typing import Any

import numpy as np

import isolation_sim as iso
from controllers.best_constant import weighted_peak
from controllers.clairvoyant import Plant, bound, share_of_gap
from controllers.mpc import MPC
from controllers.predictive.condense_kernel import largest_gap
from ground_motions import Record, el_centro_1940
from isolation_sim.simulation.control import CoilDriver

from .do_mpc_peer import ALONE, DoMPC, Recorder
from .timing import shortest_time

DRIVER = CoilDriver(lag=0.05, slew=60.0, high=3.0)
EVERY = 25
"""Decisions from one programme that is solved again to the next."""


class Watched(MPC):
    """The predictive controller, with some of its programmes and solutions kept."""

    name = "mpc_watched"

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.programmes: list[tuple[list[np.ndarray], np.ndarray]] = []

    def current(self, t: float, measurement: Any) -> np.ndarray:
        """Decide, and keep every so often what was solved."""
        command = super().current(t, measurement)
        if self.report.iterations[-1] and len(self.report.seconds) % EVERY == 0:
            programme, x = self.programme()
            self.programmes.append(([part.copy() for part in programme], x.copy()))
        return command


def tight_solution(programme: list, start: np.ndarray) -> np.ndarray:
    """Solve a quadratic programme to 1e-12 by an interior-point method."""
    import casadi

    hessian, gradient, rows, upper, lower = programme
    n = len(gradient)
    x = casadi.SX.sym("x", n)
    problem = {
        "x": x, "f": casadi.bilin(hessian, x, x) / 2 + casadi.dot(gradient, x),
        "g": casadi.mtimes(casadi.DM(rows), x),
    }  # fmt: skip
    options = {
        "ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.tol": 1e-12,
        "ipopt.bound_relax_factor": 0.0,
    }  # fmt: skip
    low, high = (np.where(np.abs(b) < 1e29, b, np.copysign(np.inf, b)) for b in (lower, upper))
    solver = casadi.nlpsol("programme", "ipopt", problem, options)
    solved = solver(x0=start, lbx=low[:n], ubx=high[:n], lbg=low[n:], ubg=high[n:])
    return np.ravel(solved["x"])


def decisions(isolated: Any, record: Record, **settings: Any) -> None:
    """Print times and accuracy of one controller's decisions."""
    one = Watched(**settings)
    run = iso.simulate(isolated, record, one, driver=DRIVER)
    moves, costs, outside = [], [], 0.0
    for programme, x in one.programmes:
        hessian, gradient, rows, upper, lower = programme
        other = tight_solution(programme, x)
        a, b = (v @ hessian @ v / 2 + gradient @ v for v in (x, other))
        costs.append((a - b) / max(1.0, abs(b)))
        moves.append(abs(x[0] - other[0]))
        values = np.concatenate([x, rows @ x])
        outside = max(outside, float((values - upper).max()), float((lower - values).max()))
    slowest = np.percentile(one.report.seconds, [50, 99]) * 1e3
    print(
        f"{one}: median {slowest[0]:.3f} ms, 99th percentile {slowest[1]:.3f} ms, "
        f"best {min(one.report.seconds) * 1e3:.3f} ms, "
        f"{one.report.failed} failed; {len(moves)} programmes solved again: cost "
        f"{max(costs):.1e} higher at most, first move {np.median(moves):.1e} of the range off "
        f"(median), {max(moves):.1e} (worst); a row exceeded by {max(outside, 0.0):.1e} at most; "
        f"{violated(run, one.period)} of {len(one.report.seconds)} commands beyond range or slew"
    )


def violated(run: Any, period: float) -> int:
    """Number of commands outside the coil's range, or too far from its current for the slew."""
    reach = largest_gap(DRIVER.lag, DRIVER.slew, period) * (1 + 1e-12)
    far = np.abs(run.command - run.current) > reach
    return int(np.sum((run.command < 0.0) | (run.command > DRIVER.high) | far))


def calibration(repetitions: int = 200) -> float:
    """Time of a fixed calculation, the solution of 120 linear equations, at best, s."""
    matrix = np.random.default_rng(0).normal(size=(120, 120)) + 120 * np.eye(120)
    return shortest_time(lambda: np.linalg.solve(matrix, matrix[0]), repetitions)


def against_do_mpc(isolated: Any, record: Record, first: int = 200, count: int = 60) -> None:
    """Print how long do-mpc takes over the same decisions, and what it decides."""
    until = record.cut(0.0, (first + count) * MPC.period)
    if not find_spec("do_mpc"):
        print("do-mpc is not installed: pip install '.[bench]'")
        return
    quick, patient = (Recorder(first, count, **ALONE, iterations=n) for n in (1, 40))
    for one in (quick, patient):
        iso.simulate(isolated, until, one, driver=DRIVER)
    for what, one in (("one linearisation", quick), ("iterated", patient)):
        sizes = np.abs([case.state for case in one.cases]).max(axis=0)
        peer = DoMPC(isolated, one, sizes)
        commands, seconds = np.transpose([peer.decide(case) for case in one.cases])
        own = np.array([case.seconds for case in one.cases])
        span = one.coils[0, 3] - one.coils[0, 2]
        off = np.abs([case.command for case in one.cases] - commands) / span
        print(
            f"do-mpc, horizon {peer.steps}, {len(sizes)} states, {what}: median "
            f"{np.median(seconds) * 1e3:.0f} ms against {np.median(own) * 1e3:.3f} ms, "
            f"{np.median(seconds) / np.median(own):.0f} times (at best "
            f"{seconds.min() / own.min():.0f}); first moves differ by {np.median(off):.1e} of the "
            f"range (median), {off.max():.1e} (worst)"
        )


def main() -> None:
    """Print all of it."""
    isolated = iso.reference_building().on(iso.reference_isolators())
    record = el_centro_1940()
    print(f"calibration: {calibration() * 1e3:.3f} ms")
    against_do_mpc(isolated, record)
    decisions(isolated, record, horizon=0.6, blocks=30)
    decisions(isolated, record)
    decisions(isolated, record, preview=0.8)
    decisions(isolated, record, model="linear")
    plant = Plant(isolated, (record,), CoilDriver(lag=0.05, high=3.0))
    began = perf_counter()
    best = bound(plant)
    print(
        f"clairvoyant bound: {best.score:.4f} in {perf_counter() - began:.0f} s "
        f"({'' if best.solved else 'not '}solved); "
        f"engine and prediction differ by {best.difference:.1e}"
    )
    off, constant = (
        iso.simulate(isolated, record, name, driver=plant.driver)
        for name in ("passive_off", "best_constant")
    )

    for preview in (0.0, 0.8):
        run = iso.simulate(isolated, record, MPC(preview=preview), driver=plant.driver)
        peaks = weighted_peak(run, off)
        share = share_of_gap(peaks, weighted_peak(constant, off), best.score)
        print(f"mpc, preview {preview} s: weighted peaks {peaks:.3f}, gap {share:.0%}")


if __name__ == "__main__":
    main()
