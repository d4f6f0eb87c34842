"""Diagnosis of a loop table: a law with effects, fitted to stiffness and damping."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...effects import EFFECTS, extend
from ...effects.effect import in_sentence
from ...identification.current_basis import check_degree
from ...laws import Device
from ...laws.law import Law
from .. import inference
from ..decisions import LOOP_ACCURACY, LOOP_CORRELATION, LOOP_RIVAL
from ..device.intervals import linear_intervals
from ..diagnosis import Cause, Errors, Trace
from ..loops.effect_search import LoopSearch
from ..loops.model import FittedLoops, rms
from ..loops.table import LoopTable
from ..problem import Evaluation, Problem, Text
from ..residuals import Dependence, of_loops, significant
from ..search import Round, SearchResult, search


class LoopTableTests(Problem[FittedLoops]):
    """A loop table against a law, with given parameter values or with fitted ones."""

    # Errors are the RMS of the relative errors of stiffness and damping. Held-out errors are of the
    # rows that the table holds out; without any, of rows or groups of rows left out in turn.

    def __init__(
        self,
        table: LoopTable,
        law: Law,
        device: Device | None,
        degree: int | None,
        seed: int,
        pool: ThreadPoolExecutor,
        progress: Callable[[str], None],
    ):
        self.table, self.law, self.device, self.seed = table, law, device, seed
        self.data_name, self.model_name = table.name, law.title
        self.space = LoopSearch(table, pool, seed, lambda: progress("fitting loops"))
        currents = np.unique(table.current[~table.held_out])
        highest = min(len(currents) - 1, 2)
        if degree is not None:
            check_degree(table.name, "rows", degree, currents)
        self._degrees = range(min(1, highest), highest + 1) if degree is None else (degree,)

    def nominal(self) -> FittedLoops:
        """Fit the law with each degree of the current's influence; the search chooses one."""
        self._bases = [self.space.fit_law(self.law, self.device, one) for one in self._degrees]
        return min(self._bases, key=lambda base: base.left_out)

    def search(self, base: FittedLoops) -> SearchResult[FittedLoops]:
        """Search with each degree, of a large table with the best one; keep the better outcome."""
        bases = [base] if self.space.is_large else self._bases
        outcomes = [search(self.space, one) for one in bases]
        result = min(outcomes, key=lambda result: result.best.left_out)
        base, best = self.space.on_all(result.base, result.best)
        if not best.left_out < base.left_out:
            best = base
        return replace(result, base=base, best=best)

    def dependences(self, base: FittedLoops) -> list[Dependence]:
        """Correlate the errors with the conditions of the tests."""
        return of_loops(self.table, self._before(base))

    def _start(self, base: FittedLoops) -> NDArray:
        """Values of the evaluated law."""
        prescribed = self.device
        return base.optimum.x if prescribed is None else base.model.parameterisation.of(prescribed)

    def _before(self, base: FittedLoops) -> NDArray:
        return base.model.loops(self._start(base))[0]

    def evaluate(self, result: SearchResult[FittedLoops]) -> Evaluation:
        """Compare stiffness and damping before and after on fitted rows and on rows left out."""
        base, best = result.base, result.best
        before, after = self._before(base), best.ratios
        fitted = np.tile(~self.table.held_out, 2)
        errors = (
            Errors(
                rms((before - 1)[fitted]),
                base.left_out if self.device is None else rms(before - 1),
            ),
            Errors(rms((after - 1)[fitted]), best.left_out),
        )
        first = errors[0].held_out ** 2 - min(LOOP_ACCURACY, errors[0].held_out) ** 2
        rest = max(errors[1].held_out ** 2 - LOOP_ACCURACY**2, 0.0)
        left = rest / first if first > 0 else 0.0
        return Evaluation(
            *errors, Errors(np.nan, np.nan), left, errors[0].held_out <= LOOP_ACCURACY,
            errors[1].held_out <= LOOP_ACCURACY,
            details={"largest_error": {"before": _largest(before), "after": _largest(after)}},
        )  # fmt: skip

    def causes(self, result: SearchResult[FittedLoops], evaluation: Evaluation) -> list[Cause]:
        """Effects in the order of their selection, each with its contribution."""
        best, where = result.best, result.best.optimum.x
        if not best.causes:
            return []
        taken = [(tried.base, tried.taken, tried.tried) for tried in result.rounds if tried.taken]
        split = inference.shares(
            [without.left_out**2 - extended.left_out**2 for without, extended, _ in taken],
            0.0,
            1 - min(evaluation.unexplained, 1.0),
        )
        numbers = linear_intervals(best.model, where, *best.model.residuals(where, True))
        causes = []
        for k, (effect, (without, extended, tried)) in enumerate(
            zip(best.model.effects, taken, strict=True)
        ):
            rows = int(np.sum(~extended.model.table.held_out))
            freedom = max(2 * rows - len(extended.optimum.x), 1)
            causes.append(
                Cause(
                    name=effect.cause,
                    share=split[k],
                    p_value=inference.f_chance(
                        without.optimum.cost, extended.optimum.cost, len(effect.parameters),
                        freedom, len(EFFECTS),
                    ),
                    parameters=numbers[k],
                    reason=(
                        f"With {in_sentence(effect.title)} the error on rows left out falls "
                        f"from {100 * without.left_out:.1f} to {100 * extended.left_out:.1f} %."
                    ),
                    confusable_with=inference.rivals(
                        effect.cause,
                        [(one.causes[-1], one.left_out - extended.left_out) for one in tried],
                        LOOP_RIVAL * extended.left_out,
                    ),
                    form=effect.form,
                )
            )  # fmt: skip
        return causes

    def depends_on(
        self, dependences: Sequence[Dependence], causes: Sequence[Cause], evaluation: Evaluation
    ) -> tuple[str, ...]:
        """Conditions whose ranks correlate with the errors."""
        return significant(dependences, LOOP_CORRELATION)

    def devices(self, result: SearchResult[FittedLoops]) -> tuple[Device, Device]:
        """The nominal law, and the law with the effects found."""
        table, base, best = self.table, result.base, result.best
        varies = np.ptp(table.current) > 0
        evaluated = Device(
            self.law,
            base.model.parameterisation.dependence(self._start(base)),
            (float(table.current.min()), float(table.current.max()))
            if varies
            else (-np.inf, np.inf),
            float(table.amplitude.max()),
            float(table.current.max()),
            source=f"diagnosed from {table.name}",
        )
        model, values = best.model, best.optimum.x
        current = model.parameterisation.dependence(values[: model.n_law])
        applied = zip(model.effects, model.parameters_of(values), strict=True)
        extended = extend(replace(evaluated, current=current), list(applied))
        return evaluated if self.device is None else self.device, extended

    def traces(self, result: SearchResult[FittedLoops]) -> tuple[Trace, ...]:
        """Simulated loops; a table gives only the ellipses of the measured ones."""
        table, base, best = self.table, result.base, result.best
        data = base.model.data
        before = base.model.forces(self._start(base), False)[0]
        after = best.model.forces(best.optimum.x, False)[0]
        samples = base.model.samples
        phase = 2 * np.pi * np.arange(samples) / samples
        traces = []
        for k, amplitude in enumerate(table.amplitude):
            end = (k + 1) * base.model.cycles * samples
            at = slice(end - samples, end)
            # the ellipse of the same stiffness and energy
            ellipse = np.sin(phase) + 2 * table.damping[k] * np.cos(phase)
            traces.append(
                Trace(
                    name=(
                        f"{1e3 * amplitude:g} mm, {table.frequency[k]:g} Hz, {table.current[k]:g} A"
                    ),
                    held_out=bool(table.held_out[k]),
                    time=np.arange(samples) * data.dt[k],
                    across=1e3 * data.x[at],
                    across_label="deformation, mm",
                    label="force, N",
                    measured=table.stiffness[k] * amplitude * ellipse,
                    before=before[at],
                    after=after[at],
                )
            )
        return tuple(traces)

    def data_text(self) -> Text:
        """Number and range of the loops."""
        table, rows = self.table, len(self.space.table.amplitude)
        searched = f" Causes are searched on {rows} of them." if self.space.is_large else ""
        return Text(
            f"{len(table.amplitude)} loops, amplitudes {1e3 * table.amplitude.min():g} to "
            f"{1e3 * table.amplitude.max():g} mm, {table.frequency.min():g} to "
            f"{table.frequency.max():g} Hz, {table.current.min():g} to {table.current.max():g} A."
            f"{searched}"
        )

    def noise_text(self) -> Text:
        """The accuracy used in place of noise."""
        return Text(
            f"A table does not contain its noise; {100 * LOOP_ACCURACY:.0f} % counts as agreement."
        )

    def model_text(self, evaluation: Evaluation) -> Text:
        """Errors of the law."""
        how = "fitted" if self.device is None else "as given"
        before = evaluation.before
        return Text(
            f"{self.model_name}, {how}: wrong by {100 * before.fit:.1f} % (RMS of stiffness and "
            f"damping), on rows left out of its fit by {100 * before.held_out:.1f} %."
        )

    def trials_text(self, tried: Round[FittedLoops]) -> Text:
        """Error of each effect on rows left out."""
        return Text(
            "The effects that fit best, evaluated on held-out rows:",
            ("effect", "form", "error on rows left out"),
            tuple(
                (one.model.effects[-1].title, one.model.effects[-1].form,
                 f"{100 * one.left_out:.1f} %")
                for one in tried.tried
            ),
        )  # fmt: skip


def _largest(ratios: NDArray) -> dict[str, float]:
    """Largest relative errors of stiffness and of damping."""
    stiffness, damping = np.split(np.abs(ratios - 1), 2)
    return {"stiffness": float(stiffness.max()), "damping": float(damping.max())}
