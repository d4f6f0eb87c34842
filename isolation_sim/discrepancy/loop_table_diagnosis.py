"""Diagnosis of a loop table."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..effects import EFFECTS, Effect, extend
from ..effects.effect import in_sentence
from ..identification.current_basis import check_degree
from ..identification.least_squares import Optimum
from ..identification.multistart import different
from ..identification.unknowns import Unknowns
from ..identification.workers import workers
from ..laws import Device
from ..laws.law import Law
from .diagnosis import Cause, Diagnosis, Errors, Verdict
from .loop_model import ACCURACY, LoopModel, loop_motion
from .loop_story import FittedLoops, Round, depends_on, largest, rms, steps, traces
from .loop_table import LoopTable
from .uncertainty import linear_intervals

BETTER = 0.8
"""An effect has to lower the error on rows left out to less than this part."""
MOST_EFFECTS = 3
LAWS_TRIED = 6
"""Laws, nearly as good as the best without effects, from which forms are fitted."""
FOLDS = 16
"""Groups of rows, each left out of the fit in turn; of a short table every row is one."""
JUDGED = 6
"""Forms that are fitted from several laws and judged on rows left out."""
N_STEPS = 2
"""Integration steps a sample."""
_STARTS = 4
# effects that a steady loop cannot show
_UNSEEN = (
    "force_offset", "sensor_delay", "stress_softening", "self_heating", "ambient_temperature",
    "cyclic_degradation", "current_lag", "tension_compression_asymmetry",
)  # fmt: skip


def diagnose_loop_table(
    table: LoopTable,
    law: Law,
    device: Device | None = None,
    *,
    current_degree: int | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Find what a law lacks to reproduce a loop table.

    Parameters
    ----------
    table : LoopTable
        Measured loops.
    law : Law
        The law to judge.
    device : Device, optional
        Numbers with which to judge it; fitted to the table if not given.
    current_degree, seed, threads, progress : optional
        As of ``diagnose``.

    Returns
    -------
    Diagnosis
        Errors are the RMS of the relative errors of stiffness and damping. Held-out errors are of
        the rows that the table holds out; without any, of rows or groups of rows, each left out of
        the fit in turn.
    """
    with workers(threads) as pool:
        work = _Work(table, law, pool, seed, progress or (lambda name: None))
        return work.diagnosed(device, current_degree)


@dataclass(frozen=True, eq=False)
class _Work:
    table: LoopTable
    law: Law
    pool: ThreadPoolExecutor
    seed: int
    tell: Callable[[str], None]

    def diagnosed(self, device: Device | None, degree: int | None) -> Diagnosis:
        """Search with each degree of the current's influence, and tell of the better outcome."""
        currents = np.unique(self.table.current[~self.table.held_out])
        highest = min(len(currents) - 1, 2)
        if degree is not None:
            check_degree(self.table.name, "rows", degree, currents)
        degrees = range(min(1, highest), highest + 1) if degree is None else (degree,)
        bases = [self.base_of(device, currents, one) for one in degrees]
        outcomes = [(base, *self.extended(base)) for base in bases]
        base, best, rounds = min(outcomes, key=lambda o: o[1].left_out)
        given = None if device is None else base.model.unknowns.of(device)
        return self.told(base, given, best, rounds)

    def extended(self, base: FittedLoops) -> tuple[FittedLoops, list[Round]]:
        """Add effects as long as they lower the error on rows left out."""
        best, rounds = base, []
        while len(best.model.stages) < MOST_EFFECTS and best.left_out > ACCURACY:
            tried = self.tried(best)
            rounds.append((best, tried))
            if not tried or tried[0].left_out > BETTER * best.left_out:
                break
            best = tried[0]
        return best, rounds

    def chance(self, without: FittedLoops, given: FittedLoops) -> float:
        """Chance that an effect without meaning fits so much better, over all causes (F test)."""
        from scipy.stats import f as f_distribution

        p = len(given.model.stages[-1].effect.parameters)
        free = max(2 * int(np.sum(~self.table.held_out)) - len(given.optimum.x), 1)
        drop = without.optimum.cost - given.optimum.cost
        ratio = drop / p / (given.optimum.cost / free)
        return float(min(1.0, len(EFFECTS) * f_distribution.sf(ratio, p, free)))

    def base_of(self, device: Device | None, currents: NDArray, degree: int) -> FittedLoops:
        """The law alone, its parameters polynomials of a degree."""
        at = np.linspace(currents[0], currents[-1], degree + 1) if degree else currents[:1]
        force = float(np.median(self.table.stiffness * self.table.amplitude))
        x = float(np.median(self.table.amplitude))
        time = 1 / (2 * np.pi * float(np.median(self.table.frequency)))
        unknowns = Unknowns(self.law, at, (force, x, time))
        model = LoopModel(loop_motion(self.table), unknowns, N_STEPS, table=self.table)
        starts = unknowns.starts(16, self.seed)
        if device is not None:
            starts.insert(0, unknowns.of(device))
        found = sorted(
            self.pool.map(lambda s: self.minimised(model, s), starts), key=lambda o: o.cost
        )
        # the same law is looked for wherever rows or effects change
        judged = self.judged(replace(model, expected=found[0].x), found[0])
        return replace(judged, others=tuple(o.x for o in different(found)[1:LAWS_TRIED]))

    def minimised(self, model: LoopModel, start: NDArray, most: int = 40) -> Optimum:
        self.tell("fitting loops")
        return model.minimised(start, most, 1e-6)

    def judged(self, model: LoopModel, optimum: Optimum) -> FittedLoops:
        """The error on rows left out."""
        table = self.table
        if table.held_out.any():
            ratios = model.loops(optimum.x)[0]
            return FittedLoops(model, optimum, rms((ratios - 1)[np.tile(table.held_out, 2)]))
        n, squares = len(table.amplitude), 0.0
        group = np.random.default_rng(self.seed).permutation(n) % FOLDS
        for fold in range(min(FOLDS, n)):
            part = replace(model, table=replace(table, held_out=group == fold))
            ratios = part.loops(self.minimised(part, optimum.x).x)[0]
            squares += float(np.sum((ratios - 1)[np.tile(group == fold, 2)] ** 2))
        left_out = float(np.sqrt(squares / (2 * n))) if np.isfinite(squares) else np.inf
        return FittedLoops(model, optimum, left_out)

    def tried(self, base: FittedLoops) -> list[FittedLoops]:
        """Effects fitted together with the model, the best few judged on rows left out."""
        left = [
            effect
            for cause, forms in EFFECTS.items()
            if cause not in (*base.causes, *_UNSEEN)
            for effect in forms
            if np.ptp(self.table.current) > 0 or effect.current is None
        ]
        found = list(self.pool.map(lambda e: self.with_effect(base, e), left))
        found.sort(key=lambda pair: pair[1].cost)
        judged = self.pool.map(lambda pair: self.settled(base, *pair), found[:JUDGED])
        return sorted(judged, key=lambda f: f.left_out)

    def settled(self, base: FittedLoops, model: LoopModel, optimum: Optimum) -> FittedLoops:
        """The best of a form over several laws, which without it were nearly as good."""
        found = [optimum]
        for law in base.others:
            start = np.concatenate([law, optimum.x[model.n_law :]])
            found.append(self.minimised(replace(model, expected=law), start, 60))
        best = min(found, key=lambda o: o.cost)
        judged = self.judged(replace(model, expected=best.x[: model.n_law]), best)
        return replace(judged, others=base.others)

    def with_effect(self, base: FittedLoops, effect: Effect) -> tuple[LoopModel, Optimum]:
        model: LoopModel = base.model.with_effects(effect)
        choices = [
            [min(max(s * model.size(q), q.lower), q.upper) for s in q.starts]
            for q in effect.parameters
        ]
        starts = list(product(*choices))[:_STARTS]
        found = [
            self.minimised(model, np.concatenate([base.optimum.x, np.array(s)]), 25)
            for s in starts
        ]
        best = min(found, key=lambda o: o.cost)
        return model, self.minimised(model, best.x, 60)

    def told(
        self, base: FittedLoops, given: NDArray | None, best: FittedLoops,
        rounds: list[Round],
    ) -> Diagnosis:  # fmt: skip
        """Put the outcome together."""
        start = base.optimum.x if given is None else given
        before, after = base.model.loops(start)[0], best.model.loops(best.optimum.x)[0]
        kept = np.tile(~self.table.held_out, 2)
        errors = (
            Errors(rms((before - 1)[kept]), base.left_out if given is None else rms(before - 1)),
            Errors(rms((after - 1)[kept]), best.left_out),
        )
        first = errors[0].held_out**2 - min(ACCURACY, errors[0].held_out) ** 2
        rest = max(errors[1].held_out**2 - ACCURACY**2, 0.0)
        unexplained = rest / first if first > 0 else 0.0
        causes = self.causes(base, best, rounds, unexplained)
        adequate = errors[0].held_out <= ACCURACY
        verdict: Verdict
        if adequate and not causes:
            verdict = "adequate"
        elif not causes:
            verdict = "unexplained"
        else:
            verdict = "explained" if unexplained < 0.1 else "partly_explained"
        model = best.model
        judged = Device(
            self.law,
            base.model.unknowns.dependence(start),
            (float(self.table.current.min()), float(self.table.current.max()))
            if np.ptp(self.table.current) > 0
            else (-np.inf, np.inf),
            float(self.table.amplitude.max()),
            float(self.table.current.max()),
            source=f"diagnosed from {self.table.name}",
        )
        fitted = model.unknowns.dependence(best.optimum.x[: model.n_law])
        extended = extend(replace(judged, current=fitted), _applied(best))
        return Diagnosis(
            data=self.table.name,
            model=self.law.title,
            verdict=verdict,
            noise_floor=float("nan"),
            error_before=errors[0],
            error_after=errors[1],
            causes=causes,
            unexplained_share=float(min(unexplained, 1.0)),
            depends_on=depends_on(self.table, before),
            next_test=None,
            steps=steps(self.table, self.law, base, given, before, after, rounds, verdict),
            judged=judged,
            extended=extended,
            traces=traces(self.table, base, start, best),
            details={"largest_error": {"before": largest(before), "after": largest(after)}},
        )

    def causes(
        self, base: FittedLoops, best: FittedLoops, rounds: list[Round],
        unexplained: float,
    ) -> tuple[Cause, ...]:  # fmt: skip
        found = []
        drops = [r[0].left_out ** 2 for r in rounds[: len(best.model.stages)]]
        drops.append(best.left_out**2)
        total = max(drops[0] - drops[-1], 1e-300)
        where = best.optimum.x
        numbers = linear_intervals(best.model, where, *best.model.residuals(where, True))
        for k, stage in enumerate(best.model.stages):
            without, tried = rounds[k]
            given = next(f for f in tried if f.causes == best.causes[: k + 1])
            near = list(
                dict.fromkeys(
                    f.causes[-1]
                    for f in tried[1:]
                    if f.left_out < 1.1 * tried[0].left_out and f.causes[-1] != stage.effect.cause
                )
            )
            share = (drops[k] - drops[k + 1]) / total * (1 - unexplained)
            found.append(
                Cause(
                    name=stage.effect.cause,
                    share=float(share),
                    p_value=self.chance(without, given),
                    parameters=numbers[k],
                    evidence=(
                        f"With {in_sentence(stage.effect.title)} the error on rows left out falls "
                        f"from {100 * without.left_out:.1f} to {100 * given.left_out:.1f} %."
                    ),
                    confusable_with=tuple(near),
                    form=stage.effect.form,
                )
            )
        return tuple(sorted(found, key=lambda c: -c.share))

def _applied(best: FittedLoops) -> list[tuple[Effect, dict[str, float]]]:
    found = []
    for stage, place in zip(best.model.stages, best.model.slices(), strict=True):
        numbers = best.optimum.x[place].tolist()
        found.append((stage.effect, dict(zip(stage.effect.parameter_names, numbers, strict=True))))
    return found
