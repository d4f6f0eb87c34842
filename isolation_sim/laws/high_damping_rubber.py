"""High-damping rubber bearing of Grant, Fenves and Whittaker, for two directions.

``F = (a1 + a2 |x|^2 + a3 |x|^4) x + c v + h``: a spring that softens and stiffens again, a dashpot,
and a hysteretic force h. In motion along n = v / |v| its distance to ``R n``, with the limit
``R = b1 + b2 |x|^2``, falls to 1/e within the length 1/b3:

    h' = b3 (R v - |v| h) + R' n,   R' = 2 b2 x.v

so that loops of large deformation are wider. Along a line and in a circle this is their law. Under
other motion theirs has the part of R' n along R n - h, which has no direction where h is R n. The
dashpot is ours: theirs depends on no rate. Their softening by past deformation is the effect
``stress_softening``.

No stored energy is declared: what unloading to h = 0 would return has no closed form.
"""

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
    speed = length(v[0], v[1])
    along = b3 * (b1 + b2 * (x[0] * x[0] + x[1] * x[1]))
    along = along + 2 * b2 * (x[0] * v[0] + x[1] * v[1]) / speed
    return along * v[0] - b3 * speed * states[0], along * v[1] - b3 * speed * states[1]


PLAN = InPlan(plan_force, plan_rates, None)
LAW = Law(
    name="high_damping_rubber",
    title="High-damping rubber (Grant, Fenves and Whittaker)",
    states=(Quantity("h", "N", "hysteretic force"),),
    parameters=(
        Quantity("a1", "N/m", "stiffness", lower=0.0),
        Quantity("a2", "N/m^3", "change of the stiffness with the squared deformation"),
        Quantity("a3", "N/m^5", "change of the stiffness with its fourth power"),
        Quantity("c", "N s/m", "viscous damping", lower=0.0),
        Quantity("b1", "N", "limit of the hysteretic force at rest", lower=0.0),
        Quantity("b2", "N/m^2", "its growth with the squared deformation", lower=0.0),
        Quantity("b3", "1/m", "inverse length of the approach to the limit", lower=0.0),
    ),
    **along_a_line(PLAN, n_states=1),
    source="Grant, Fenves and Whittaker (2004)",
    plan=PLAN,
    example={
        "a1": (20000.0, 3000.0), "a2": -2e8, "a3": (3e12, 5e11), "c": 300.0, "b1": (100.0, 20.0),
        "b2": 2e6, "b3": 400.0,
    },
)  # fmt: skip
