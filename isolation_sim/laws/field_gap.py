"""Field-gap factor: the field between the layers weakens as the isolator shears.

``F = mu(x) F_law`` with ``mu = 1 - epsilon |x|``, and zero beyond ``|x| = 1 / epsilon``. The
parameter is called ``gap_epsilon``, because other laws have an epsilon too. In the paper (Eq 15) mu
scales "the model parameters" at the present deformation. If all stiffnesses and dampings have the
same factor, the state equations of its models do not change, because they contain ratios only, and
the force is multiplied by the factor. The wrapper does this to any law. In plan, x is the length of
the deformation.

A wrapped law has no stored energy: because the springs weaken as the deformation grows, the energy
of the law is not the energy that the device can return.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from . import strain_stiffening
from .current_dependence import CurrentDependence
from .device import Device
from .in_plan import length
from .law import InPlan, Law, Quantity

EPSILON_FINITE_ELEMENTS = (1 - 0.568 / 0.588) / 15e-3
"""1/m: the first layer's field falls from 0.588 T to 0.568 T at 15 mm (Section 4.2)."""


def field_gap(law: Law) -> Law:
    """Wrap a law so that its force falls with the deformation."""
    inner_force, inner_rates = law.force, law.rates

    def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
        mu = 1 - parameters[-1] * np.fabs(x)
        return mu * (mu > 0) * inner_force(x, v, states, parameters[:-1])

    def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
        return inner_rates(x, v, states, parameters[:-1])

    def plan_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
        assert law.plan is not None
        mu = 1 - parameters[-1] * length(x[0], x[1])
        first, second = law.plan.force(x, v, states, parameters[:-1])
        return mu * (mu > 0) * first, mu * (mu > 0) * second

    def plan_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
        assert law.plan is not None
        return law.plan.rates(x, v, states, parameters[:-1])

    return Law(
        name=f"{law.name}_field_gap",
        title=f"{law.title}, field-gap factor",
        parameters=(
            *law.parameters,
            Quantity("gap_epsilon", "1/m", "loss of force with deformation", lower=0.0),
        ),
        states=law.states,
        force=force,
        rates=rates,
        plan=InPlan(plan_force, plan_rates, None) if law.plan else None,
        source=f"{law.source}; Li & Li, Eq 15",
    )


def generalised() -> Device:
    """Build the published model (Table 2) with the loss that its field computation shows."""
    inner = strain_stiffening.generalised()
    coefficients = inner.current.coefficients[0]
    rows = dict(zip(inner.current.names, coefficients.tolist(), strict=True))
    return Device(
        law=LAW,
        current=CurrentDependence.polynomial(rows | {"gap_epsilon": (EPSILON_FINITE_ELEMENTS,)}),
        current_range=inner.current_range,
        tested_deformation=inner.tested_deformation,
        tested_current=inner.tested_current,
        source=f"{inner.source}; gap_epsilon from Section 4.2",
    )


LAW = replace(field_gap(strain_stiffening.LAW), sets={"generalised": generalised})
