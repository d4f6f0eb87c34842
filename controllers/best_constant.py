"""The best constant current for a plant and a ground motion."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ground_motions.old_names import renamed_attribute
from isolation_sim.errors import Diverged, InputError
from isolation_sim.simulation.control import RunContext

from .coils import driven_elements, highest_tested, lowest
from .constant import Constant
from .controller import Trial
from .open_loop import Held
from .passive_off import PassiveOff
from .settings import Integer, Number, OneOf, Optional, setting

if TYPE_CHECKING:
    from isolation_sim.simulation.result import Run


def weighted_peak(run: Run, off: Run) -> float:
    """Peak base displacement and peak floor acceleration over those without current, added."""
    if not all(off.criteria[peak] for peak in PEAKS):
        raise InputError(
            "best_constant: nothing moves without current; expected: a ground motion that is not "
            "zero throughout"
        )
    return sum(run.criteria[peak] / off.criteria[peak] for peak in PEAKS)


PEAKS = ("peak_base_displacement_m", "peak_floor_acceleration_m_s2")

CRITERIA: dict[str, Callable[[Run, Run], float]] = {
    "weighted_peak": weighted_peak,
    PEAKS[0]: lambda run, off: run.criteria[PEAKS[0]],
    PEAKS[1]: lambda run, off: run.criteria[PEAKS[1]],
}
"""Criteria that ``best_constant`` can minimise, from a run and the run without current."""


class BestConstant(Held):
    """The constant current that minimises a criterion, found by a search over runs.

    It knows the plant and the whole ground motion and cannot be built: it is the reference that a
    controller should beat. The criterion need not be convex in the current: a grid search is
    refined by a bounded scalar search.

    Attributes
    ----------
    optimum : float, A
        The current, after ``prepare``.
    score : float
        The criterion's value there.
    """

    name = "best_constant"
    title = "Best constant current"
    source = "scalar search: Brent 1973"

    criterion: str = setting("weighted_peak", "criterion to minimise", OneOf(tuple(CRITERIA)))
    lowest: float | None = setting(
        None, "lowest current tried; None for the supply's lowest, or 0", Optional(Number()), "A"
    )
    highest: float | None = setting(
        None,
        "highest current tried; None for the highest tested, within the supply's limits",
        Optional(Number()),
        "A",
    )
    grid: int = setting(13, "currents tried before the scalar search", Integer(at_least=3))
    resolution: float = setting(1e-3, "accuracy of the scalar search", Number(above=0), "A")

    optimum: float | None = None
    score: float = np.nan
    found = renamed_attribute("found", "optimum")

    def prepare(self, context: RunContext, trial: Trial) -> None:
        """Search by trial runs of constant currents."""
        from scipy.optimize import minimize_scalar

        driven_elements(context.nominal, self.name)
        low = float(lowest(context).max()) if self.lowest is None else self.lowest
        high = float(highest_tested(context).min()) if self.highest is None else self.highest
        if not (np.isfinite([low, high]).all() and low <= high):
            raise InputError(
                f"best_constant: currents from {low:g} to {high:g} A; expected: finite limits, the "
                "lowest not above the highest"
            )
        criterion, off = CRITERIA[self.criterion], trial(PassiveOff())

        def score(current: float) -> float:
            try:
                return criterion(trial(Constant(amperes=current)), off)
            except Diverged:
                return np.inf

        currents = np.linspace(low, high, self.grid)
        scores = [score(current) for current in currents]
        best = int(np.argmin(scores))
        if not np.isfinite(scores[best]):
            raise InputError(
                f"best_constant: the run diverges at every current from {low:g} to {high:g} A"
            )
        valley = (currents[max(best - 1, 0)], currents[min(best + 1, self.grid - 1)])
        options = {"xatol": self.resolution}
        search = minimize_scalar(score, bounds=valley, method="bounded", options=options)
        self.optimum, self.score = float(currents[best]), float(scores[best])
        if search.fun < self.score:
            self.optimum, self.score = float(search.x), float(search.fun)
        self.report = f"{self.optimum:.3g} A, found by trial runs of this motion"

    def held(self, context: RunContext) -> float:
        """Return the best current."""
        if self.optimum is None:
            raise InputError(
                "best_constant has not searched yet: call prepare(context, trial) first, as "
                "simulate does"
            )
        return self.optimum
