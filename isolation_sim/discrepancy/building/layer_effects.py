"""Effects of the isolators' law that their motion in the records proposes.

The isolation layer of a record is a device test (``isolation_force``): the forms of all effects are
fitted along its measured motion, without a simulation of the building. Few are then tried in it.
"""

from __future__ import annotations

import numpy as np

from ...effects import Effect
from ..decisions import ALONG_MOTION, LEAST_PART, PROPOSALS, PROPOSED_GAIN
from ..device.model import FittedModel, fit_roughly
from ..device.observable_effects import observable_effects
from ..device.screen import fit_direction, refine, screen_effect
from .candidate import Candidate
from .comparison import CauseValues, Comparison
from .isolation_force import effect_values, layer_model, unsupported
from .isolator_causes import layer_effect
from .isolator_effects import ISOLATOR_EFFECTS, LAYER_CAUSES


def proposed_effects(comparison: Comparison, causes: CauseValues) -> list[list[Candidate]]:
    """Effects beside some causes, best first: each in the form nearest to the layer's force.

    After it, its nearest form of fewer numbers.
    """
    if unsupported(comparison.model.nominal, comparison.records):
        return []
    layer = layer_model(comparison, causes)
    base = FittedModel.at(layer, effect_values(comparison.model, causes))
    if not np.isfinite(base.cost):
        return []
    if base.effects:
        # what other numbers of these effects remove asks for no further one
        own = fit_roughly(layer, np.clip(base.values, *layer.bounds()))
        base = own if own.cost < base.cost else base
    # examples of noise tell nothing among forms of one layer
    noise = np.zeros((len(base.residual), 1))
    screened = [screen_effect(base, one, noise) for one in _forms(base)]
    directions = sorted((one for one in screened if one is not None), key=lambda one: -one.gain)
    near = [refine(base, one, noise) for one in directions[:ALONG_MOTION]]
    fits = [fit_direction(base, one) for one in near]
    least = PROPOSED_GAIN * max(base.cost - len(base.residual), 0.0)
    best: dict[str, list[FittedModel]] = {}
    # a number more has to lower the cost by more than errors of the layer's force do
    for fit in sorted(fits, key=lambda fit: fit.cost * (1 + LEAST_PART) ** fit.n_parameters):
        if base.cost - fit.cost > least:
            forms = best.setdefault(fit.causes[-1], [])
            if not forms or (len(forms) == 1 and fit.n_parameters < forms[0].n_parameters):
                forms.append(fit)
    return [[_candidate(comparison, fit) for fit in forms]
            for forms in list(best.values())[:PROPOSALS]]  # fmt: skip


def _forms(base: FittedModel) -> list[Effect]:
    """Effects that may be added to a layer's model; others are tried before."""
    forms = observable_effects(base.model.data)
    tried = {*base.causes, *ISOLATOR_EFFECTS.values()}
    return [
        one for one in forms
        if one.cause in LAYER_CAUSES and one.cause not in tried and one not in tried
    ]  # fmt: skip


def _candidate(comparison: Comparison, fit: FittedModel) -> Candidate:
    """The newest effect of a layer's model, with its numbers to start from."""
    numbers = fit.values[fit.model.slices()[-1]]
    start = tuple(numbers.tolist())
    return layer_effect(comparison.model, comparison.records, fit.effects[-1], start)
