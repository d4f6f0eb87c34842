"""The full-information optimum: the best currents for a ground motion known in advance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record
from ground_motions.argument_types import checked
from isolation_sim.errors import Diverged, InputError
from isolation_sim.simulation.control import CoilDriver, RunContext
from isolation_sim.structures import IsolatedStructure

from .coils import coil_table, without_coil
from .controller import Trial
from .open_loop import OpenLoop
from .passive_off import PassiveOff
from .prescribed import Prescribed
from .settings import Integer, Number, Optional, setting

if TYPE_CHECKING:
    from isolation_sim.simulation.result import Run

    from .predictive.whole_record import Optimum, WholeRecord

__all__ = ["Bound", "Clairvoyant", "Plant", "bound", "causal_bound", "pareto", "share_of_gap"]

DISPLACEMENT, ACCELERATION, DRIFT = (
    "base_displacement_m", "floor_acceleration_m_s2", "drift_m"
)  # fmt: skip
"""Quantities whose peaks may be weighted; names as in ``isolation_sim.criteria``."""
EQUALLY = {DISPLACEMENT: 1.0, ACCELERATION: 1.0}
"""The weighted peaks that controllers are compared by."""
ITERATIONS = 300
"""Most iterations of the interior-point method."""
LONG = 1000
"""Intervals of a motion above which its first half is solved before."""
_TRIFLE = 0.02
"""Weight of the other peak at an end of the Pareto front, which keeps it from growing freely."""
_WITHIN = 1.001
"""Largest excess of a point over its bound, by differences between engine and optimisation."""


class Plant(NamedTuple):
    """Plant and motions of a bound; equal plants share their solutions.

    Attributes
    ----------
    isolated : IsolatedStructure
        Structure and devices.
    records : tuple of Record
        Ground motion, one per direction.
    driver : CoilDriver
        Of the coils.
    """

    isolated: IsolatedStructure
    records: tuple[Record, ...]
    driver: CoilDriver


@dataclass(frozen=True)
class Bound:
    """A local optimum over a whole ground motion, and the engine's run of its commands.

    Attributes
    ----------
    time : numpy.ndarray, shape (n,), s
        Instants from which the commands hold.
    current : numpy.ndarray, shape (n, n_channels), A
        Commands.
    predicted : dict of str to float
        Peaks by the optimisation's own equations, SI units.
    certified : dict of str to float
        Peaks of the same commands in the engine, SI units.
    score : float
        Weighted sum of the certified peaks, each relative to its value without current.
    solved : bool
        Whether the interior-point method ended within its tolerance.
    run : Run
        The engine's run.
    """

    time: NDArray
    current: NDArray
    predicted: dict[str, float]
    certified: dict[str, float]
    score: float
    solved: bool
    run: Run

    @property
    def difference(self) -> float:
        """Largest relative difference between predicted and certified peaks."""
        return max(abs(self.certified[q] / p - 1.0) for q, p in self.predicted.items())


@checked
def bound(
    plant: Plant, weights: Mapping[str, float] = EQUALLY, period: float | None = None,
    starts: int = 2, roughness: float = 1e-3, iterations: int = ITERATIONS,
    interval: float | None = None,
) -> Bound:  # fmt: skip
    """Minimise weighted peaks over the commands of a whole ground motion.

    The problem is not convex: the result is the best of the local optima from several
    constant currents. Under a motion of more than ``LONG`` intervals the first half is solved from
    the constant current, and the whole from that optimum, continued by the constant current.

    Parameters
    ----------
    plant : Plant
        Structure, ground motion and driver.
    weights : mapping of str to float
        Weight of the peaks of the quantities above, each relative to its value without current.
    period : float, optional, s
        Time from one command to the next, rounded to whole samples; one sample by default.
    starts : int
        Constant currents to start from, equally spaced from the lowest up: two are the lowest
        and the middle of the range.
    roughness : float
        See ``WholeRecord``.
    iterations : int
        Most iterations of the interior-point method from one start.
    interval : float, optional, s
        Shortest interval of the optimisation, to which a motion that is sampled more finely is
        resampled; its own interval by default. A longer one takes less time. The certified peaks
        are those under the motion itself.

    Returns
    -------
    Bound

    Raises
    ------
    InputError
        If no weight is above 0, or the structure diverges at every current to start from.
    """
    positive = tuple(sorted((q, float(w)) for q, w in weights.items() if w > 0))
    if not positive:
        raise InputError("clairvoyant: every weight is 0; expected: one or more above 0")
    return _bound(plant, positive, period, starts, roughness, iterations, interval)


@lru_cache(maxsize=16)
def _bound(
    plant: Plant, weights: tuple[tuple[str, float], ...], period: float | None, starts: int,
    roughness: float, iterations: int, interval: float | None,
) -> Bound:  # fmt: skip
    objective = dict(weights)
    absolute, sampled = _absolute(plant, objective), plant
    if interval is not None and plant.records[0].dt < interval:
        sampled = plant._replace(records=tuple(r.resampled(interval) for r in plant.records))

    def problem_of(part: Plant) -> WholeRecord:
        return _problem(part, period, roughness, tuple(objective), iterations)

    def solve(part: Plant, run: Run) -> Optimum:
        """Solve from a run of a constant current."""
        problem = problem_of(part)
        if problem.n > LONG:
            constant = run.command[-1:]
            half = part._replace(records=tuple(r.cut(0.0, r.duration / 2) for r in part.records))
            first = solve(half, _simulate(half, Prescribed(time=(0.0,), amperes=constant)))
            commands = np.vstack([first.current, constant])
            time = np.arange(len(commands)) * problem.every * problem.dt
            run = _simulate(part, Prescribed(time=time, amperes=commands))
        return problem.solve(run, absolute)

    problem = problem_of(sampled)
    optima = [solve(sampled, run) for run in _starts(sampled, starts)]
    result = [_certify(plant, problem, objective, optimum) for optimum in optima]
    return min(result, key=lambda one: one.score)


@checked
def pareto(
    plant: Plant, n: int = 7, period: float | None = None, starts: int = 2, roughness: float = 1e-3
) -> list[Bound]:
    """Front of peak base displacement against peak floor acceleration.

    Its ends minimise one peak, from several constant currents; between them the acceleration is
    minimised under bounds on the displacement, once from each neighbour, which finds the front
    where it is not convex too. The best local optimum within each bound is returned.

    Parameters
    ----------
    plant : Plant
        Structure, ground motion and driver.
    n : int
        Bounds on the displacement, 2 or more; fewer points where two bounds share the best.
    period : float, optional, s
        Time from one command to the next; one sample by default.
    starts : int
        Constant currents to look for the ends from; see ``bound``.
    roughness : float
        See ``WholeRecord``.

    Returns
    -------
    list of Bound
        By increasing displacement; ``score`` is of both peaks, weighted equally.

    Raises
    ------
    InputError
        If ``n`` is below 2, or the structure diverges at every current to start from.
    """
    if n < 2:
        raise InputError("pareto: n", f"{n}", "2 or more")
    problem = _problem(plant, period, roughness, (DISPLACEMENT, ACCELERATION), ITERATIONS)
    runs = _starts(plant, starts)
    weights = {
        peak: _absolute(plant, {DISPLACEMENT: _TRIFLE, ACCELERATION: _TRIFLE} | {peak: 1.0})
        for peak in (DISPLACEMENT, ACCELERATION)
    }
    result: list[Bound] = []

    def solve(
        peak: str, run: Run, start: NDArray | None = None, most: float = np.inf
    ) -> tuple[Bound, Run, NDArray]:
        optimum = problem.solve(run, weights[peak], {DISPLACEMENT: most}, start)
        result.append(_certify(plant, problem, EQUALLY, optimum))
        return result[-1], run, optimum.variables

    stiff, gentle = (
        min((solve(peak, run) for run in runs), key=lambda one: one[0].certified[peak])
        for peak in (DISPLACEMENT, ACCELERATION)
    )
    least, widest = (one.certified[DISPLACEMENT] for one, *_ in (stiff, gentle))
    limits = np.linspace(least, widest, n)
    for (_, run, start), inner in ((stiff, limits[1:]), (gentle, limits[-2:0:-1])):
        for most in inner:
            *_, start = solve(ACCELERATION, run, start, float(most))
    front = {}
    for most in limits:
        within = [k for k, b in enumerate(result) if b.certified[DISPLACEMENT] <= most * _WITHIN]
        best = min(within, key=lambda k: result[k].certified[ACCELERATION])
        front[best] = result[best]
    return list(front.values())


@checked
def causal_bound(
    plants: Sequence[Plant], apart: Sequence[float], references: Sequence[float],
    period: float | None = None, starts: int = 2, roughness: float = 1e-3,
    iterations: int = ITERATIONS,
) -> list[Bound]:  # fmt: skip
    """Bound the performance without preview, by motions that are equal at first.

    A controller without preview gives equal commands while it measures the same. Here this is
    all that is asked: once a motion has parted from the first one, all of it is known. The largest
    score over its reference is minimised over the commands of all motions at once. The problem is
    not convex: the result is the best of the local optima from several constant currents.

    Parameters
    ----------
    plants : sequence of Plant
        Equal ones but for their ground motions, which have the same samples.
    apart : sequence of float, s
        Until when each motion equals the first one, 0 or later; the first one's does not matter.
    references : sequence of float
        Reference score of each motion, such as that of the best constant current.
    period : float, optional, s
        Time from one command to the next, rounded to whole samples; one sample by default.
    starts : int
        Constant currents to start from; see ``bound``.
    roughness : float
        See ``WholeRecord``.
    iterations : int
        Most iterations of the interior-point method from one start.

    Returns
    -------
    list of Bound
        One per motion, with equal commands until they part.

    Raises
    ------
    InputError
        If a motion differs from the first one before the time given, or the structure diverges at
        every current to start from.

    References
    ----------
    Rockafellar and Wets 1991, Scenarios and policy aggregation in optimization under uncertainty.
    """
    first = plants[0].records[0]
    for plant, until in zip(plants, apart, strict=True):
        n = math.floor(until / first.dt * (1 + 1e-9)) + 1
        for own, other in zip(plant.records, plants[0].records, strict=True):
            if not np.array_equal(own.acceleration[:n], other.acceleration[:n]):
                raise InputError(
                    f"{own.name} differs from {first.name} before {until:g} s; expected: motions "
                    "that are equal until they part"
                )
    problem = _problem(plants[0], period, roughness, tuple(EQUALLY), iterations)
    weights = [_absolute(plant, EQUALLY) for plant in plants]
    # what is measured at the instant of parting is still equal
    shared = [math.floor(t / first.dt * (1 + 1e-9)) + 1 for t in apart]
    result = []
    for runs in zip(*(_starts(plant, starts) for plant in plants), strict=False):
        optima = zip(plants, problem.solve_together(runs, weights, references, shared), strict=True)
        result.append([_certify(plant, problem, EQUALLY, optimum) for plant, optimum in optima])

    def worst(bounds: list[Bound]) -> float:
        return max(b.score - r for b, r in zip(bounds, references, strict=True))

    return min(result, key=worst)


@checked
def share_of_gap(score: float, constant: float, clairvoyant: float) -> float:
    """Share of the gap between the best constant current and the clairvoyant bound that is closed.

    Parameters
    ----------
    score : float
        Weighted peaks of the controller in question.
    constant : float
        Of the best constant current.
    clairvoyant : float
        Of the bound, ``Bound.score``.

    Returns
    -------
    float
        0 for the constant current, 1 for the bound; below 0 if worse than the constant current.
    """
    return (constant - score) / (constant - clairvoyant)


def _coils(plant: Plant) -> NDArray:
    """Lag (s), slew (A/s), lowest, highest and initial current (A) of each coil."""
    isolated, driver = plant.isolated, plant.driver
    ranges = [isolated.current_range(c) for c in range(isolated.n_channels)]
    low, high = np.array(ranges).reshape(-1, 2).T
    low = low if driver.low is None else np.full_like(low, driver.low)
    high = high if driver.high is None else np.full_like(high, driver.high)
    tested = np.array([isolated.tested_current(c) for c in range(len(low))])
    dt = plant.records[0].dt
    return coil_table(RunContext(isolated, dt, 0.0, low, high, tested, (), driver))


def _simulate(plant: Plant, controller: OpenLoop) -> Run:
    from isolation_sim.simulation.run import simulate

    return simulate(plant.isolated, plant.records, controller, driver=plant.driver)


@lru_cache(maxsize=16)
def _uncontrolled(plant: Plant) -> Run:
    return _simulate(plant, PassiveOff())


def _problem(
    plant: Plant, period: float | None, roughness: float, quantities: tuple[str, ...],
    iterations: int,
) -> WholeRecord:  # fmt: skip
    """The problem; motions of one length share it, since building its solver takes a minute."""
    coils = _coils(plant)
    if not len(coils):
        raise without_coil("clairvoyant", "the structure")
    record = plant.records[0]
    every = 1 if period is None else max(1, round(period / record.dt))
    return _whole_record(
        plant.isolated, record.dt, len(record.acceleration) - 1, tuple(map(tuple, coils)), every,
        quantities, roughness, iterations,
    )  # fmt: skip


@lru_cache(maxsize=4)
def _whole_record(
    isolated: IsolatedStructure, dt: float, n: int, coils: tuple[tuple[float, ...], ...],
    *settings: Any,
) -> WholeRecord:  # fmt: skip
    from .predictive.whole_record import WholeRecord

    return WholeRecord(isolated, dt, n, np.array(coils), *settings)


def _starts(plant: Plant, count: int) -> list[Run]:
    """Runs of constant currents, equally spaced from the lowest up."""
    coils, result = _coils(plant), []
    for k in range(count):
        amperes = tuple((coils[:, 2] + k / count * (coils[:, 3] - coils[:, 2])).tolist())
        try:
            result.append(_simulate(plant, Prescribed(time=(0.0,), amperes=(amperes,))))
        except Diverged:
            continue
    if not result:
        raise InputError("clairvoyant: the structure diverges at every current to start from")
    return result


def _absolute(plant: Plant, weights: Mapping[str, float]) -> dict[str, float]:
    off = _uncontrolled(plant).criteria
    return {q: w / off[f"peak_{q}"] for q, w in weights.items()}


def _certify(
    plant: Plant, problem: WholeRecord, weights: Mapping[str, float], optimum: Optimum
) -> Bound:
    """Simulate an optimum's commands in the engine."""
    time = np.arange(len(optimum.current)) * problem.every * problem.dt
    commands = Prescribed(time=time, amperes=optimum.current)
    run = _simulate(plant, commands)
    peaks = {q: run.criteria[f"peak_{q}"] for q in optimum.peaks}
    score = sum(w * peaks[q] for q, w in _absolute(plant, weights).items())
    return Bound(time, optimum.current, optimum.peaks, peaks, score, optimum.solved, run)


class Clairvoyant(OpenLoop):
    """The full-information optimum over the whole ground motion.

    It knows the ground motion from the start and minimises the weighted peaks over all commands at
    once by sparse direct optimal control, with the laws traced from their one definition. The
    problem is not convex: the bound is the best local optimum found, certified by simulating its
    commands in the engine.

    Attributes
    ----------
    bound : Bound or None
        The solution, after ``prepare``.
    """

    name = "clairvoyant"
    title = "Clairvoyant optimum"
    source = "direct optimal control: Betts 2010; interior point: Vanroye et al. 2023"
    preview_time = np.inf

    displacement_weight: float = setting(
        1.0, "weight of the peak base displacement, relative to its value without current",
        Number(at_least=0),
    )  # fmt: skip
    acceleration_weight: float = setting(
        1.0, "weight of the peak floor acceleration, relative to its value without current",
        Number(at_least=0),
    )  # fmt: skip
    drift_weight: float = setting(
        0.0, "weight of the peak storey drift, relative to its value without current",
        Number(at_least=0),
    )  # fmt: skip
    starts: int = setting(
        2, "number of constant currents from which the search starts, equally spaced",
        Integer(at_least=1),
    )  # fmt: skip
    roughness: float = setting(
        1e-3,
        "weight of the mean square change of the commands, relative to the peaks",
        Number(at_least=0),
    )
    interval: float | None = setting(
        None, "shortest interval of the optimisation; None for that of the motion's samples",
        Optional(Number(above=0)), "s",
    )  # fmt: skip
    iterations: int = setting(
        300,
        "largest number of iterations of the interior-point method from one start",
        Integer(at_least=1),
    )

    bound: Bound | None = None

    def prepare(self, context: RunContext, trial: Trial) -> None:
        """Solve for the whole record.

        Parameters
        ----------
        context : RunContext
            With the ground motion.
        trial : callable
            Not needed: the bound is that of the nominal model.

        Raises
        ------
        InputError
            If no peak is weighted, no coil drives anything, or no run ends to start from.
        """
        assert context.ground is not None
        plant = Plant(context.nominal, context.ground, context.driver)
        weights = {
            DISPLACEMENT: self.displacement_weight,
            ACCELERATION: self.acceleration_weight,
            DRIFT: self.drift_weight,
        }
        self.bound = bound(
            plant, weights, self.period, self.starts, self.roughness, self.iterations,
            self.interval,
        )  # fmt: skip

    def commands(self, context: RunContext) -> tuple[NDArray, NDArray]:
        """Return the optimal commands."""
        if self.bound is None:
            raise InputError(
                "clairvoyant has not solved yet: call prepare(context, trial) first, as "
                "simulate does"
            )
        return self.bound.time, self.bound.current
