"""A short motion, so that hundreds of runs take a moment."""

import pytest

from isolation_sim.sweeps.design import Design
from isolation_sim.sweeps.plan import SweepPlan

SHORT = {"name": "el_centro_1940_ns", "stop_s": 2.0}


def plan_of(**keys):
    """Plan over a short motion; ``scenario`` adds to its sections."""
    short = {"ground": SHORT, "controller": [{"name": "passive_off"}]}
    scenario = short | keys.pop("scenario", {})
    return SweepPlan.from_dict({"name": "test", "scenario": scenario, **keys})


def design_of(**keys):
    return Design(plan_of(**keys))


@pytest.fixture(scope="session")
def short():
    return SHORT


# two compiled controllers, plants and motions that differ from case to case
MIXED = {
    "scenario": {
        "controller": [
            {"name": "passive_off"}, {"name": "on_off"}, {"name": "constant", "amperes": 1.0},
        ],
    },
    "vary": [
        {"field": "isolator.count", "label": "isolators", "low": 0.7, "high": 1.6, "count": 4},
        {"field": "controller[2].amperes", "label": "current", "values": [0.5, 1.5, 2.5]},
        {"field": "ground.scale_factor", "low": 0.2, "high": 1.0, "step": 0.4},
    ],
}  # fmt: skip
