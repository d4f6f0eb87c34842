"""Semi-active base isolation with magnetorheological isolators: simulate, control, compare.

Every exported name is loaded when it is first used.

>>> import isolation_sim as iso
>>> building = iso.reference_building().on(iso.reference_isolators())
>>> building.n_channels
1
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .api import compare, diagnose, run_scenario, simulate
    from .comparison import Comparison, json_report
    from .errors import Diverged, InputError
    from .identification.campaign import read_campaign
    from .identification.fit import fit
    from .identification.fitted import Fit
    from .identification.loop_curves import loop_curves
    from .identification.loop_measures import loop_measures
    from .laws import Device, available_conditions, available_laws, available_sets, law
    from .registry import available_controllers, controller, register
    from .scenario import Scenario
    from .simulation.batch import Case, simulate_many
    from .simulation.control import CoilDriver, Sensors
    from .simulation.result import Run
    from .simulation.run_files import read_run, write_run
    from .structures import (
        IsolatedStructure,
        Structure,
        from_fixed_base,
        from_matrices,
        read_matrices,
        reference_building,
        reference_isolators,
        shear_building,
    )
    from .sweeps.run import sweep

from .version import __version__ as __version__

# one line a name: where it lives
_HOMES = {
    "Case": ".simulation.batch",
    "CoilDriver": ".simulation.control",
    "Comparison": ".comparison",
    "Device": ".laws",
    "Diverged": ".errors",
    "Fit": ".identification.fitted",
    "InputError": ".errors",
    "IsolatedStructure": ".structures",
    "Run": ".simulation.result",
    "Scenario": ".scenario",
    "Sensors": ".simulation.control",
    "Structure": ".structures",
    "available_conditions": ".laws",
    "available_controllers": ".registry",
    "available_laws": ".laws",
    "available_sets": ".laws",
    "compare": ".api",
    "controller": ".registry",
    "diagnose": ".api",
    "evaluate": ".api",
    "fit": ".identification.fit",
    "from_fixed_base": ".structures",
    "from_matrices": ".structures",
    "json_report": ".comparison",
    "law": ".laws",
    "passive": ".laws",
    "loop_curves": ".identification.loop_curves",
    "loop_measures": ".identification.loop_measures",
    "read_campaign": ".identification.campaign",
    "read_matrices": ".structures",
    "read_run": ".simulation.run_files",
    "reference_building": ".structures",
    "reference_isolators": ".structures",
    "register": ".registry",
    "run_scenario": ".api",
    "shear_building": ".structures",
    "simulate": ".api",
    "simulate_many": ".simulation.batch",
    "sweep": ".sweeps.run",
    "write_run": ".simulation.run_files",
}

__all__ = [
    "Case",
    "CoilDriver",
    "Comparison",
    "Device",
    "Diverged",
    "Fit",
    "InputError",
    "IsolatedStructure",
    "Run",
    "Scenario",
    "Sensors",
    "Structure",
    "available_conditions",
    "available_controllers",
    "available_laws",
    "available_sets",
    "compare",
    "controller",
    "diagnose",
    "evaluate",
    "fit",
    "from_fixed_base",
    "from_matrices",
    "json_report",
    "law",
    "loop_curves",
    "loop_measures",
    "passive",
    "read_campaign",
    "read_matrices",
    "read_run",
    "reference_building",
    "reference_isolators",
    "register",
    "run_scenario",
    "shear_building",
    "simulate",
    "simulate_many",
    "sweep",
    "write_run",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name], __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
