"""A law with effects around it, held against measured runs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..effects import Effect
from ..effects.effect import EffectParameter
from ..identification.least_squares import Optimum, levenberg_marquardt
from ..identification.magnitudes import magnitude
from ..identification.sensitivities import Simulator
from ..identification.unknowns import Unknowns
from .measured import Measured
from .stages import Stage
from .zero import EACH_RUN, run_means

_DIFFERENCE = 1e-4
"""Step of the differences by an effect's parameters, relative to their size."""


@dataclass(frozen=True, eq=False)
class Model:
    """A law's unknowns and effects, on measured runs.

    Attributes
    ----------
    data : Measured
        The runs.
    unknowns : Unknowns
        Those of the law.
    n_steps : int
        Integration steps a sample.
    stages : tuple of Stage
        The effects, in the order in which they act.
    expected : (n_unknowns,) array or None
        Values about which the law's unknowns are looked for; see ``minimised``.
    """

    data: Measured
    unknowns: Unknowns
    n_steps: int
    stages: tuple[Stage, ...] = ()
    expected: NDArray | None = None

    def with_effects(self, *effects: Effect) -> Self:
        """Return the model with more effects.

        Parameters
        ----------
        *effects : Effect
            They act after those already there.

        Returns
        -------
        Model
            Of the same kind.
        """
        return replace(self, stages=(*self.stages, *map(Stage, effects)))

    def without(self, place: int) -> Self:
        """Return the model with one effect less.

        Parameters
        ----------
        place : int
            Of the effect.

        Returns
        -------
        Model
            Of the same kind.
        """
        return replace(self, stages=self.stages[:place] + self.stages[place + 1 :])

    @property
    def n_law(self) -> int:
        """Number of the law's unknowns; the effects' parameters follow them."""
        return len(self.unknowns.scale)

    def slices(self) -> list[slice]:
        """Place of each effect's parameters among the values.

        Returns
        -------
        list of slice
        """
        found, at = [], self.n_law
        for stage in self.stages:
            found.append(slice(at, at + len(stage.effect.parameters)))
            at = found[-1].stop
        return found

    def bounds(self) -> tuple[NDArray, NDArray]:
        """Bounds of all values.

        Returns
        -------
        lower, upper : (n_values,) array
        """
        quantities = [q for stage in self.stages for q in stage.effect.parameters]
        lower = np.concatenate([self.unknowns.lower, [q.lower for q in quantities]])
        upper = np.concatenate([self.unknowns.upper, [q.upper for q in quantities]])
        return lower, upper

    def size(self, quantity: EffectParameter) -> float:
        """Return what a parameter's ``starts`` are multiples of, in its unit.

        Parameters
        ----------
        quantity : EffectParameter
            The parameter.

        Returns
        -------
        float
        """
        if quantity.unit in ("s", "1", "-"):
            return 1.0
        data = self.data
        x = float(np.max(np.abs(data.x)))
        force = float(np.sqrt(np.mean(data.force**2)))
        current = float(np.max(np.abs(data.current))) or 1.0
        return magnitude(quantity.unit, force, x, x / float(np.max(np.abs(data.v))), current)

    # trials far off may overflow: their cost tells
    @np.errstate(all="ignore")
    def forces(
        self, values: NDArray, derivatives: bool, inner: NDArray | None = None
    ) -> tuple[NDArray, NDArray]:
        """Modelled force of all samples, and its derivatives.

        Parameters
        ----------
        values : (n_values,) array
            The law's unknowns, then each effect's parameters.
        derivatives : bool
            Whether these are wanted: exact by the law's unknowns, differences by the effects'
            parameters.
        inner : (n_samples,) array, optional
            Force of the law before any effect, where it is known and no derivatives are wanted, N.

        Returns
        -------
        force : (n_samples,) array
            N.
        jacobian : (n_samples, n_values) array
            No rows if they are not wanted.
        """
        law, own = values[: self.n_law], [values[s] for s in self.slices()]
        if inner is None or derivatives:
            inner, jacobian = self._law_force(law, own, derivatives)
        courses = [self._outer(stage, inner, p) for stage, p in zip(self.stages, own, strict=True)]
        force = _combined(inner, courses)
        if not derivatives:
            return self._zeroed(force), np.empty((0, len(values)))
        columns = np.empty((len(force), len(values)))
        by_law = jacobian @ self.unknowns.spread
        columns[:, : self.n_law] = self._passed(by_law, inner, force, courses, own)
        for place, stage in enumerate(self.stages):
            for k, quantity in enumerate(stage.effect.parameters):
                moved = [p.copy() for p in own]
                step = _DIFFERENCE * max(abs(moved[place][k]), 0.01 * self.size(quantity))
                if moved[place][k] + step > quantity.upper:
                    step = -step
                moved[place][k] += step
                other = self._moved(inner, courses, place, law, moved)
                columns[:, self.slices()[place].start + k] = (other - force) / step
        if self._free_zero:
            columns -= run_means(self.data, columns)
        return self._zeroed(force), columns

    def _passed(
        self, by_law: NDArray, inner: NDArray, force: NDArray, courses: list, own: list
    ) -> NDArray:
        """Derivatives of the law's force as they come out behind the effects."""
        following = [k for k, s in enumerate(self.stages) if "force" in s.effect.needs]
        if not following:
            for course in courses:
                if "factor" in course:
                    by_law = by_law * course["factor"][:, np.newaxis]
            return by_law
        passed = np.empty_like(by_law)
        for k, column in enumerate(by_law.T):
            size = float(np.linalg.norm(column))
            step = _DIFFERENCE * float(np.linalg.norm(inner)) / size if size > 0 else 1.0
            changed, moved = list(courses), inner + step * column
            for place in following:
                changed[place] = self._outer(self.stages[place], moved, own[place])
            passed[:, k] = (_combined(moved, changed) - force) / step
        return passed

    @property
    def _free_zero(self) -> bool:
        return any(stage.effect is EACH_RUN for stage in self.stages)

    def _zeroed(self, force: NDArray) -> NDArray:
        """The force with each run's own zero, where that is free."""
        if not self._free_zero:
            return force
        return force + run_means(self.data, self.data.force - force)

    def _moved(
        self, inner: NDArray, courses: list, place: int, law: NDArray, own: list
    ) -> NDArray:
        """Force after the parameters of one effect have changed."""
        effect = self.stages[place].effect
        if effect.motion is not None or effect.current is not None:
            inner = self._law_force(law, own, False)[0]
        changed = list(courses)
        changed[place] = self._outer(self.stages[place], inner, own[place])
        return _combined(inner, changed)

    def law_force(self, values: NDArray) -> NDArray:
        """Force of the law on the motion and the current that the effects let it see.

        Parameters
        ----------
        values : (n_values,) array
            As of ``forces``.

        Returns
        -------
        (n_samples,) array
            N, before any effect.
        """
        own = [values[s] for s in self.slices()]
        return self._law_force(values[: self.n_law], own, False)[0]

    def _law_force(self, law: NDArray, own: list, derivatives: bool) -> tuple[NDArray, NDArray]:
        motion = self.data.motion
        nothing = np.zeros(len(self.data.x))
        for stage, parameters in zip(self.stages, own, strict=True):
            if stage.effect.motion is not None:
                seen = stage.course(
                    self.data, nothing, parameters, (motion.displacement, motion.velocity)
                )["motion"]
                motion = replace(motion, displacement=seen[0], velocity=seen[1])
            if stage.effect.current is not None:
                seen = stage.course(self.data, nothing, parameters, current=motion.current)
                motion = replace(motion, current=seen["current"])
        u = self.unknowns
        simulator = Simulator(u.law, motion, u.owner, u.power, self.n_steps)
        return simulator.run(u.coefficients(law), derivatives)

    def _outer(self, stage: Stage, inner: NDArray, parameters: NDArray) -> dict[str, Any]:
        """Factor and added force of an effect; empty where it has neither."""
        if stage.effect.factor is None and stage.effect.force is None:
            return {}
        return stage.course(self.data, inner, parameters)

    @np.errstate(all="ignore")
    def residuals(self, values: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
        """Residuals of the fitted samples over their noise, and their derivatives.

        Parameters
        ----------
        values : (n_values,) array
            As of ``forces``.
        derivatives : bool
            Whether these are wanted.

        Returns
        -------
        residual : (n_fitted,) array
            1.
        jacobian : (n_fitted, n_values) array
            No rows if they are not wanted.
        """
        force, jacobian = self.forces(values, derivatives)
        kept, weight = self.data.fitted, self.data.weight
        residual = ((force - self.data.force) * weight)[kept]
        if derivatives:
            jacobian = jacobian[kept] * weight[kept, np.newaxis]
        return residual, jacobian

    def minimised(self, start: NDArray, most: int = 20, tolerance: float = 1e-5) -> Optimum:
        """Fit law and effects together.

        Parameters
        ----------
        start : (n_values,) array
            Values to start from.
        most : int
            Most steps to try.
        tolerance : float
            Relative decrease of the cost below which the search ends.

        Returns
        -------
        Optimum
            The cost and the derivatives are those of the data alone.

        Notes
        -----
        The law's unknowns are held near ``expected`` by a spring too weak to matter where the data
        say anything (a deviation of 300 % weighs as much as one standard deviation of one sample):
        what few runs leave open does not run away, and the law stays fit for other runs.
        """
        lower, upper = self.bounds()
        if self.expected is None:
            return levenberg_marquardt(self.residuals, start, lower, upper, most, tolerance)
        n = self.n_law
        width = 3 * np.maximum(np.abs(self.expected), 0.1 * self.unknowns.scale)
        pull = np.zeros((n, len(start)))
        pull[:, :n] = np.diag(1 / width)

        def held(values: NDArray, derivatives: bool) -> tuple[NDArray, NDArray]:
            residual, jacobian = self.residuals(values, derivatives)
            residual = np.concatenate([residual, (values[:n] - self.expected) / width])
            return residual, np.concatenate([jacobian, pull]) if derivatives else jacobian

        found = levenberg_marquardt(held, start, lower, upper, most, tolerance)
        rows = len(found.residual) - n
        residual = found.residual[:rows]
        cost = float(np.nan_to_num(0.5 * np.vdot(residual, residual), nan=np.inf))
        return replace(found, cost=cost, residual=residual, jacobian=found.jacobian[:rows])


def _combined(inner: NDArray, courses: list) -> NDArray:
    force = inner
    for course in courses:
        if "factor" in course:
            force = force * course["factor"]
    for course in courses:
        if "force" in course:
            force = force + course["force"]
    return force
