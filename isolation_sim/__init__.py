"""Semi-active base isolation with magnetorheological isolators: simulate, control, compare.

Every exported name is imported on first use.

>>> import isolation_sim as iso
>>> building = iso.reference_building().on(iso.reference_isolators())
>>> building.n_channels
1
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from controllers import Controller
    from ground_motions import Record, available_records, el_centro_1940
    from ground_motions import read as read_record

    from .api import compare, diagnose, evaluate, load, run_scenario, simulate
    from .comparison import Comparison, json_report
    from .criterion import Criterion
    from .discrepancy.building.raw_records.import_record import import_building_record
    from .discrepancy.diagnosis import Diagnosis
    from .errors import (
        AccuracyWarning,
        ControllerError,
        ControllerWarning,
        Diverged,
        InputError,
        PlausibilityWarning,
        TestedRangeWarning,
    )
    from .export.opensees import OpenSeesMaterial, opensees_material
    from .fragility import Fragility, fit_fragility
    from .identification.campaign import read_campaign
    from .identification.fit import fit
    from .identification.fitted import Fit
    from .identification.loop_curves import loop_curves
    from .identification.loop_measures import loop_measures
    from .identification.raw_tests.import_tests import import_tests
    from .io.interchange import export_results
    from .laws import (
        Device,
        available_conditions,
        available_laws,
        available_sets,
        law,
        measured_force,
        passive,
    )
    from .registry import available_controllers, controller, register
    from .scenario import Scenario
    from .simulation.batch import Batch, Case, simulate_many
    from .simulation.control import CoilDriver, Sensors
    from .simulation.result import Run
    from .simulation.run_files import read_run, write_run
    from .simulation.simulator import Simulator
    from .simulation.substructure import DeviceSimulator
    from .simulation.vector_simulator import VectorSimulator
    from .structures import (
        IsolatedStructure,
        Structure,
        from_fixed_base,
        from_matrices,
        from_opensees,
        read_matrices,
        reference_building,
        reference_isolators,
        shear_building,
    )
    from .sweeps.plan import SweepPlan
    from .sweeps.result import Sweep
    from .sweeps.run import sweep
    from .sweeps.study import Study
    from .sweeps.suites.result import Suite
    from .sweeps.suites.run import run_suite
    from .tuning.tune import tune
    from .tuning.tuning import Tuning

from .version import __version__ as __version__


def _check_ground_motions() -> None:
    """Raise an error if another file hides the package ``ground_motions``."""
    result = find_spec("ground_motions")
    beside = Path(__file__).resolve().parents[1] / "ground_motions" / "__init__.py"
    if result is None or result.origin is None or Path(result.origin).resolve() != beside:
        raise ImportError(
            f"{result.origin if result else 'nothing'} hides the package 'ground_motions' of "
            "isolation-sim; expected: another name for it"
        )


_check_ground_motions()

# one line per name: its module
_HOMES = {
    "AccuracyWarning": ".errors",
    "Batch": ".simulation.batch",
    "Case": ".simulation.batch",
    "CoilDriver": ".simulation.control",
    "Comparison": ".comparison",
    "Controller": "controllers",
    "ControllerError": ".errors",
    "ControllerWarning": ".errors",
    "Criterion": ".criterion",
    "Device": ".laws",
    "DeviceSimulator": ".simulation.substructure",
    "Diagnosis": ".discrepancy.diagnosis",
    "Diverged": ".errors",
    "Fit": ".identification.fitted",
    "Fragility": ".fragility",
    "InputError": ".errors",
    "IsolatedStructure": ".structures",
    "OpenSeesMaterial": ".export.opensees",
    "PlausibilityWarning": ".errors",
    "Record": "ground_motions",
    "Run": ".simulation.result",
    "Scenario": ".scenario",
    "Sensors": ".simulation.control",
    "Simulator": ".simulation.simulator",
    "Structure": ".structures",
    "Study": ".sweeps.study",
    "Suite": ".sweeps.suites.result",
    "Sweep": ".sweeps.result",
    "SweepPlan": ".sweeps.plan",
    "TestedRangeWarning": ".errors",
    "Tuning": ".tuning.tuning",
    "VectorSimulator": ".simulation.vector_simulator",
    "available_conditions": ".laws",
    "available_controllers": ".registry",
    "available_laws": ".laws",
    "available_records": "ground_motions",
    "available_sets": ".laws",
    "compare": ".api",
    "controller": ".registry",
    "diagnose": ".api",
    "el_centro_1940": "ground_motions",
    "evaluate": ".api",
    "export_results": ".io.interchange",
    "fit": ".identification.fit",
    "fit_fragility": ".fragility",
    "from_fixed_base": ".structures",
    "from_matrices": ".structures",
    "from_opensees": ".structures",
    "import_building_record": ".discrepancy.building.raw_records.import_record",
    "import_tests": ".identification.raw_tests.import_tests",
    "json_report": ".comparison",
    "law": ".laws",
    "load": ".api",
    "loop_curves": ".identification.loop_curves",
    "loop_measures": ".identification.loop_measures",
    "measured_force": ".laws",
    "opensees_material": ".export.opensees",
    "passive": ".laws",
    "read_campaign": ".identification.campaign",
    "read_matrices": ".structures",
    "read_record": "ground_motions:read",
    "read_run": ".simulation.run_files",
    "reference_building": ".structures",
    "reference_isolators": ".structures",
    "register": ".registry",
    "run_scenario": ".api",
    "run_suite": ".sweeps.suites.run",
    "shear_building": ".structures",
    "simulate": ".api",
    "simulate_many": ".simulation.batch",
    "sweep": ".sweeps.run",
    "tune": ".tuning.tune",
    "write_run": ".simulation.run_files",
}

__all__ = [
    "AccuracyWarning",
    "Batch",
    "Case",
    "CoilDriver",
    "Comparison",
    "Controller",
    "ControllerError",
    "ControllerWarning",
    "Criterion",
    "Device",
    "DeviceSimulator",
    "Diagnosis",
    "Diverged",
    "Fit",
    "Fragility",
    "InputError",
    "IsolatedStructure",
    "OpenSeesMaterial",
    "PlausibilityWarning",
    "Record",
    "Run",
    "Scenario",
    "Sensors",
    "Simulator",
    "Structure",
    "Study",
    "Suite",
    "Sweep",
    "SweepPlan",
    "TestedRangeWarning",
    "Tuning",
    "VectorSimulator",
    "available_conditions",
    "available_controllers",
    "available_laws",
    "available_records",
    "available_sets",
    "compare",
    "controller",
    "diagnose",
    "el_centro_1940",
    "evaluate",
    "export_results",
    "fit",
    "fit_fragility",
    "from_fixed_base",
    "from_matrices",
    "from_opensees",
    "import_building_record",
    "import_tests",
    "json_report",
    "law",
    "load",
    "loop_curves",
    "loop_measures",
    "measured_force",
    "opensees_material",
    "passive",
    "read_campaign",
    "read_matrices",
    "read_record",
    "read_run",
    "reference_building",
    "reference_isolators",
    "register",
    "run_scenario",
    "run_suite",
    "shear_building",
    "simulate",
    "simulate_many",
    "sweep",
    "tune",
    "write_run",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    place, _, inside = _HOMES[name].partition(":")
    value = getattr(import_module(place, __name__), inside or name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(["__version__", *__all__])
