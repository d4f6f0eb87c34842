"""Runs of controllers on one plant, beside runs with constant currents.

A motion's score is J, the peak base displacement and the peak floor acceleration, each over its
value without current, added.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from functools import lru_cache
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from controllers import Controller, controller
from controllers.clairvoyant import ACCELERATION, DISPLACEMENT, Plant, bound
from ground_motions import Record
from isolation_sim.errors import Diverged, check_name
from isolation_sim.laws import law as law_of
from isolation_sim.laws import passive
from isolation_sim.simulation.control import CoilDriver, Sensors
from isolation_sim.simulation.result import Run
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import IsolatedStructure, reference_building, reference_isolators

from .cache import cached_result
from .study import Step

if TYPE_CHECKING:
    from numpy.typing import NDArray

Key = TypeVar("Key")
Task = tuple[Callable[..., Any], tuple[Any, ...]]
"""A function of a module and its arguments, to be called in some process."""
BASE, FLOOR = f"peak_{DISPLACEMENT}", f"peak_{ACCELERATION}"
DRIVER = CoilDriver(lag=0.05, high=3.0)
CONSTANTS = tuple(np.linspace(0.0, 3.0, 13).tolist())
"""Currents whose constant use draws the line that a controller has to beat, A."""
UNBOUNDED = {BASE: 1.5, FLOOR: 3.0}
"""Peaks that count as not bounded: the base's over that without, the floors' over that at 3 A."""
NOISE = {
    "displacement_m": 5e-4, "velocity_m_s": 5e-3, "acceleration_m_s2": 0.02, "deformation_m": 5e-4,
    "force_N": 5e3,
}  # fmt: skip
"""Standard deviation of the sensors' white noise."""
DEGRADED_SENSING = Sensors(noise=NOISE, delay=0.02, seed=1)
CERTIFIED = 1e-2
"""Largest relative difference between engine and optimisation with which a bound counts."""
INTERVAL = 0.02
"""Interval of the clairvoyant optimum's commands, s: that of the controllers' decisions."""
NOMINAL, PASSIVE = "nominal", "passive"
HOME = "El Centro"

Rows = list[dict[str, Any]]


@dataclass(frozen=True)
class Case:
    """Conditions of a comparison of controllers."""

    switching: str = (
        "instantaneous"  # Rule by which the isolators stiffen: instantaneous or passive
    )
    # Nominal force of the isolators over the true one; at 1 each controller has the nominal model
    # that it has by default
    nominal_force: float = 1.0
    sensors: Sensors = field(default_factory=Sensors)  # What the controllers are given


CASES = {
    NOMINAL: Case(),
    "soft": Case(nominal_force=0.8, sensors=DEGRADED_SENSING),
    "stiff": Case(nominal_force=1.2, sensors=DEGRADED_SENSING),
    PASSIVE: Case("passive"),
}
"""Nominal; with noise, 20 ms of delay and a nominal force 20 % too small or too large; the passive
rule."""


@dataclass(frozen=True)
class Evaluation:
    """Scores of controllers in all cases and under all motions."""

    # By case and motion, as ``run_candidates`` gives them
    rows: dict[tuple[str, str], Rows]
    constants: dict[str, Rows]  # By motion, the constant currents
    possible: dict[str, dict[str, Any]]  # By motion, the clairvoyant bound, for some of them

    def of(self, name: str, case: str, key: str, motions: Iterable[str]) -> NDArray:
        """One number of one controller in one case, one value per motion."""
        motions = list(motions)
        known = {
            "case": (case, {each for each, _ in self.rows}),
            "controller": (name, self.candidates),
            **{f"motion {k}": (each, self.constants) for k, each in enumerate(motions)},
        }
        for kind, (value, names) in known.items():
            check_name(kind.partition(" ")[0], str(value), names)
        result = (self.rows[case, m] for m in motions)
        rows = [next(row for row in some if row["controller"] == name) for some in result]
        return np.array([row.get(key, np.nan) for row in rows])

    @property
    def candidates(self) -> list[str]:
        """Names of the controllers."""
        return [row["controller"] for row in next(iter(self.rows.values()))]

    @property
    def solved(self) -> list[str]:
        """Motions whose bound is certified and that no controller passes: local optima are left."""
        least = {
            motion: min(row["J"] for row in self.rows[NOMINAL, motion] if np.isfinite(row["J"]))
            for motion in self.possible
        }
        return [
            motion for motion, one in self.possible.items()
            if one["certified"] <= CERTIFIED and one["J"] <= least[motion]
        ]  # fmt: skip

    @property
    def random(self) -> list[str]:
        """Names of the motions that the ranking is by: all but El Centro."""
        return [motion for motion in self.constants if motion != HOME]


@lru_cache(maxsize=8)
def plant(switching: str = "instantaneous", factor: float = 1.0) -> IsolatedStructure:
    """Return the reference building on its isolators."""
    law = law_of("strain_stiffening")
    controllers = reference_isolators(passive(law) if switching == "passive" else law)
    return reference_building().on(controllers.scaled(force=factor))


def run_candidates(candidates: Mapping[str, Controller], record: Record, case: Case) -> Rows:
    """Run controllers under one motion."""
    off, on, best = (
        _run(controller(name), record, case)
        for name in ("passive_off", "passive_on", "best_constant")
    )
    rows = []
    for name, one in candidates.items():
        began = perf_counter()
        try:
            run = _run(one, record, case)
        except Diverged:
            run = None
        took = perf_counter() - began
        row = _peaks(run, off) | {"controller": name, "constant": _peaks(best, off)["J"]}
        row["bounded"] = (
            row[BASE] <= UNBOUNDED[BASE] * off.criteria[BASE]
            and row[FLOOR] <= UNBOUNDED[FLOOR] * on.criteria[FLOOR]
        )
        if run is not None:
            decisions = record.duration / (one.period or record.dt)
            row |= {
                "field_work_J": float(run.energy.final["field_work_J"]),
                "mean_squared_current_A2": float(np.mean(run.current**2)),
                "time_a_decision_s": took / decisions,
            }
        rows.append(row)
    return rows


def _run(one: Controller, record: Record, case: Case) -> Run:
    wrong = plant("instantaneous", case.nominal_force) if case.nominal_force != 1.0 else None
    return simulate(
        plant(case.switching), record, one, nominal=wrong, driver=DRIVER, sensors=case.sensors
    )


def _peaks(run: Run | None, off: Run) -> dict[str, float]:
    result = {key: np.inf if run is None else float(run.criteria[key]) for key in (BASE, FLOOR)}
    ratios = {
        "base": result[BASE] / off.criteria[BASE],
        "floor": result[FLOOR] / off.criteria[FLOOR],
    }
    return result | ratios | {"J": sum(ratios.values())}


def constants(record: Record) -> list[dict[str, float]]:
    """Run constant currents under one motion, nominal."""
    runs = [_run(controller("constant", amperes=i), record, Case()) for i in CONSTANTS]
    return [_peaks(run, runs[0]) for run in runs]


def possible(record: Record) -> dict[str, Any]:
    """Solve for the clairvoyant bound of one motion; a minute or two for 30 s of motion.

    It is saved in the cache folder: an interrupted study resumes, and other controllers are
    compared with it without solving again.
    """

    def find() -> dict[str, Any]:
        best = bound(Plant(plant(), (record,), DRIVER), interval=INTERVAL)
        off = _run(controller("passive_off"), record, Case())
        return _peaks(best.run, off) | {"certified": best.difference}

    return cached_result("bounds", np.append(record.acceleration, record.dt).tobytes(), find)


def evaluate(
    controllers: Mapping[str, Controller],
    records: Mapping[str, Record],
    n_bounds: int | None = None,
    workers: int = 1,
    step: Step = lambda what, share=0.0: None,
) -> Evaluation:
    """Run controllers under motions, in every case."""
    tasks: dict[tuple[str, str], Task] = {}
    # what takes longest first, so that no process is left with it at the end
    for motion in list(records)[:n_bounds]:
        tasks["bound", motion] = possible, (records[motion],)
    for motion, record in records.items():
        tasks["constants", motion] = constants, (record,)
        for name, case in CASES.items():
            tasks[name, motion] = run_candidates, (controllers, record, case)
    done = in_processes(tasks, workers, lambda key: step(": ".join(key), 1 / len(tasks)))
    return Evaluation(
        {(c, m): done[c, m] for c in CASES for m in records},
        {m: done["constants", m] for m in records},
        {m: done["bound", m] for m in list(records)[:n_bounds]},
    )


def in_processes(
    tasks: Mapping[Key, Task], workers: int, finished: Callable[[Key], None]
) -> dict[Key, Any]:
    """Call functions, several at a time."""
    done = {}
    if workers == 1:
        for key, (work, arguments) in tasks.items():
            done[key] = work(*arguments)
            finished(key)
        return done
    with ProcessPoolExecutor(workers) as pool:
        futures = {pool.submit(work, *arguments): key for key, (work, arguments) in tasks.items()}
        for future in as_completed(futures):
            done[futures[future]] = future.result()
            finished(futures[future])
    return done
