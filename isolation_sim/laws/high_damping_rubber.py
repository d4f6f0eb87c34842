"""High-damping rubber bearing of Grant, Fenves and Whittaker, for two directions.

``F = (a1 + a2 |x|^2 + a3 |x|^4) x + c v + h``, ``h' = b3 ((b1 + b2 |x|^2) v - |v| h)``: a spring
that softens and stiffens again, and a hysteretic force h that tends to ``b1 + b2 |x|^2`` within the
length 1/b3, so that loops of large deformation are wider. The dashpot is ours: theirs depends on no
rate. Their softening by past deformation is the effect ``stress_softening``.

The stored energy is that of the spring, and what h would return. Nothing is gained in a cycle as
long as ``(b2/b1)^(1/2) < 2 b3``: the hysteretic force returns within a shorter length than that
over which it grows.
"""

from typing import Any

from .in_plan import along_a_line, length
from .law import InPlan, Law, Quantity


def plan_force(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Spring, dashpot and hysteretic force along x and y."""
    a1, a2, a3, c, *_ = parameters
    squared = x[0] * x[0] + x[1] * x[1]
    stiffness = a1 + (a2 + a3 * squared) * squared
    return stiffness * x[0] + c * v[0] + states[0], stiffness * x[1] + c * v[1] + states[1]


def plan_rates(x: tuple, v: tuple, states: tuple, parameters: tuple) -> tuple:
    """Rate of the hysteretic force."""
    *_, b1, b2, b3 = parameters
    limit, speed = b1 + b2 * (x[0] * x[0] + x[1] * x[1]), length(v[0], v[1])
    return b3 * (limit * v[0] - speed * states[0]), b3 * (limit * v[1] - speed * states[1])


def plan_energy(x: tuple, states: tuple, parameters: tuple) -> Any:
    """Energy of the spring and of the hysteretic force."""
    a1, a2, a3, _, b1, b2, b3 = parameters
    squared = x[0] * x[0] + x[1] * x[1]
    spring = squared * (a1 / 2 + squared * (a2 / 4 + squared * a3 / 6))
    return spring + (states[0] ** 2 + states[1] ** 2) / (2 * b3 * (b1 + b2 * squared))


PLAN = InPlan(plan_force, plan_rates, plan_energy)
LAW = Law(
    name="high_damping_rubber",
    title="High-damping rubber (Grant, Fenves and Whittaker)",
    states=(Quantity("h", "N", "hysteretic force"),),
    parameters=(
        Quantity("a1", "N/m", "stiffness", lower=0.0),
        Quantity("a2", "N/m^3", "change of the stiffness with the squared deformation"),
        Quantity("a3", "N/m^5", "change of the stiffness with its fourth power"),
        Quantity("c", "N s/m", "viscous damping", lower=0.0),
        Quantity("b1", "N", "hysteretic force at small deformation", lower=0.0, divides=True),
        Quantity("b2", "N/m^2", "its growth with the squared deformation", lower=0.0),
        Quantity("b3", "1/m", "inverse length of its return", lower=0.0, divides=True),
    ),
    **along_a_line(PLAN, n_states=1),
    source="Grant, Fenves and Whittaker (2004)",
    plan=PLAN,
    example={
        "a1": (20000.0, 3000.0), "a2": -1e7, "a3": 1e11, "c": 300.0, "b1": (100.0, 20.0),
        "b2": 5e5, "b3": 400.0,
    },
)  # fmt: skip
