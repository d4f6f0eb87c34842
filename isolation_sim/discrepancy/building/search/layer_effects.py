"""Effects of the isolators' law that their motion in the records proposes.

The isolation layer of a record is a device test (``isolation_force``): the forms of all effects are
fitted along its measured motion, without a simulation of the building. Few are then tried in it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from ....effects import EFFECTS, Effect
from ....effects.extend import ExtendedLaw
from ....effects.followers import FLUID, RUBBER
from ...decisions import (
    ALONG_MOTION,
    INSTEAD,
    LEAST_PART,
    PROPOSALS,
    PROPOSED_GAIN,
    SIGNIFICANT,
    STARTS_FITTED,
)
from ...device.model import FittedModel, fit_roughly
from ...device.observable_effects import observable_effects
from ...device.screen import fit_direction, refine, screen_effect
from ..causes.candidate import Candidate
from ..causes.isolator_causes import effect_in_plan, layer_effect
from ..comparison import BuildingComparison, CauseValues, squared, with_causes
from ..isolation_force import effect_values, layer_model, unsupported
from ..isolator_effects import ISOLATOR_EFFECTS, LAYER_CAUSES


def proposed_effects(
    comparison: BuildingComparison,
    causes: CauseValues,
    names: Collection[str] = LAYER_CAUSES,
    least_gain: float = PROPOSED_GAIN,
    of_parts: bool = False,
) -> list[list[Candidate]]:
    """Effects beside some causes, best first: each in the form nearest to the layer's force.

    After it, its nearest form of fewer numbers, if it leaves little more. With ``of_parts`` also
    each in the nearest form that acts on a part of the force, such as that of a lead core.
    """
    directions = max(law.directions for law in comparison.model.nominal.group_laws)
    if directions > 1:
        bare = directions == 2 and not isinstance(comparison.model.device.law, ExtendedLaw)
        return _in_plan(comparison, causes, names, of_parts) if bare else []
    base = _along_motion(comparison, causes)
    if base is None:
        return []
    best: dict[tuple[str, bool], list[FittedModel]] = {}
    noise = _noise(comparison) * len(base.residual)
    for fit in _helpful(comparison, base, _forms(base, names), least_gain):
        part = of_parts and not {RUBBER, FLUID}.isdisjoint(fit.effects[-1].parameters)
        forms = best.setdefault((fit.causes[-1], part), [fit])
        nearest = forms[0]
        simpler = fit.n_parameters < nearest.n_parameters
        if len(forms) == 1 and simpler and INSTEAD**2 * (fit.cost - noise) < nearest.cost - noise:
            forms.append(fit)
    return [[_candidate(comparison, fit) for fit in forms]
            for forms in list(best.values())[: PROPOSALS * (1 + of_parts)]]  # fmt: skip


def _in_plan(
    comparison: BuildingComparison, causes: CauseValues, names: Collection[str], of_parts: bool
) -> list[list[Candidate]]:
    """Effects of biaxial isolators, from the two best starts of the nearest forms.

    Their layer is no device test, so that each form is simulated in the building.
    """
    tried = {*with_causes(comparison.model, causes).effects, *ISOLATOR_EFFECTS.values()}
    known = {one.cause for one in tried}
    best: dict[tuple[str, bool], tuple[float, Candidate]] = {}
    for effect in (one for name in names for one in EFFECTS[name]):
        if effect.plan is None or effect in tried or effect.cause in known:
            continue
        cause = effect_in_plan(comparison.model, comparison.records, effect)
        costs = [
            squared(comparison.fitted_residuals((*causes, (cause, one)))) for one in cause.starts
        ]
        order = np.argsort(np.nan_to_num(costs, nan=np.inf), kind="stable")[:STARTS_FITTED]
        key = effect.cause, of_parts and not {RUBBER, FLUID}.isdisjoint(effect.parameters)
        found = costs[order[0]], replace(cause, starts=tuple(cause.starts[k] for k in order))
        if key not in best or found[0] < best[key][0]:
            best[key] = found
    return [[cause] for _, cause in sorted(best.values(), key=lambda one: one[0])]


def helpful_effects(
    comparison: BuildingComparison, causes: CauseValues, effects: Collection[Effect]
) -> Collection[Effect]:
    """Those of some effects that may explain what the layer's force lacks beside some causes."""
    base = _along_motion(comparison, causes)
    if base is None:
        return effects
    return [fit.effects[-1] for fit in _helpful(comparison, base, effects)]


def _along_motion(comparison: BuildingComparison, causes: CauseValues) -> FittedModel | None:
    """The isolation layer with some causes, as a device test; None where it is none."""
    if unsupported(comparison.model.nominal, comparison.records):
        return None
    layer = layer_model(comparison, causes)
    base = FittedModel.at(layer, effect_values(comparison.model, causes))
    if not np.isfinite(base.cost):
        return None
    if not base.effects:
        return base
    # what other numbers of these effects remove asks for no further one
    own = fit_roughly(layer, np.clip(base.values, *layer.bounds()))
    return own if own.cost < base.cost else base


def _noise(comparison: BuildingComparison) -> float:
    """Mean square of weighted residuals of noise alone: below 1 where an error is expected."""
    sizes = sum(2 * float(segment.cell_sizes.sum()) for segment in comparison.fitted)
    return sum(segment.noise_cost for segment in comparison.fitted) / sizes


def _helpful(
    comparison: BuildingComparison,
    base: FittedModel,
    forms: Collection[Effect],
    least_gain: float = PROPOSED_GAIN,
) -> list[FittedModel]:
    """Effects fitted along the layer's motion that remove enough of its misfit, best first."""
    # examples of noise tell nothing among forms of one layer
    noise = np.zeros((len(base.residual), 1))
    screened = [screen_effect(base, one, noise) for one in forms]
    directions = sorted((one for one in screened if one is not None), key=lambda one: -one.gain)
    near = [refine(base, one, noise) for one in directions[:ALONG_MOTION]]
    fits = [fit_direction(base, one) for one in near]
    chance = _noise(comparison)
    misfit = base.cost - chance * len(base.residual)
    least = max(least_gain * misfit, SIGNIFICANT * chance)
    fits = [fit for fit in fits if base.cost - fit.cost > least]
    # a number more has to lower the cost by more than errors of the layer's force do
    return sorted(fits, key=lambda fit: fit.cost * (1 + LEAST_PART) ** fit.n_parameters)


def _forms(base: FittedModel, names: Collection[str]) -> list[Effect]:
    """Effects of some causes that may be added to a layer's model; others are tried before."""
    forms = observable_effects(base.model.data)
    tried = {*base.causes, *ISOLATOR_EFFECTS.values()}
    return [
        one for one in forms
        if one.cause in names and one.cause not in tried and one not in tried
    ]  # fmt: skip


def _candidate(comparison: BuildingComparison, fit: FittedModel) -> Candidate:
    """The newest effect of a layer's model, with its numbers to start from."""
    numbers = fit.values[fit.model.slices()[-1]]
    start = tuple(numbers.tolist())
    return layer_effect(comparison.model, comparison.records, fit.effects[-1], start)
