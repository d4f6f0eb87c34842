"""Semi-active base isolation with magnetorheological isolators: simulate, control, compare.

Every exported name is imported on first use.

>>> import isolation_sim as iso
>>> building = iso.reference_building().on(iso.reference_isolators())
>>> building.n_channels
1
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from controllers import Controller as Controller
    from ground_motions import Record as Record
    from ground_motions import available_records as available_records
    from ground_motions import el_centro_1940 as el_centro_1940
    from ground_motions import read

    from .api import compare as compare
    from .api import diagnose as diagnose
    from .api import evaluate as evaluate
    from .api import load as load
    from .api import run_scenario as run_scenario
    from .api import simulate as simulate
    from .comparison import Comparison as Comparison
    from .comparison import json_report as json_report
    from .criterion import Criterion as Criterion
    from .discrepancy.building.raw_records.import_record import (
        import_building_record as import_building_record,
    )
    from .discrepancy.diagnosis import Diagnosis as Diagnosis
    from .discrepancy.plan_tests import plan_tests as plan_tests
    from .discrepancy.planned_tests import TestPlan as TestPlan
    from .errors import AccuracyWarning as AccuracyWarning
    from .errors import ControllerError as ControllerError
    from .errors import ControllerWarning as ControllerWarning
    from .errors import Diverged as Diverged
    from .errors import InputError as InputError
    from .errors import PlausibilityWarning as PlausibilityWarning
    from .errors import RefusedCurrent as RefusedCurrent
    from .errors import TestedRangeWarning as TestedRangeWarning
    from .export.opensees import OpenSeesMaterial as OpenSeesMaterial
    from .export.opensees import opensees_material as opensees_material
    from .fragility import Fragility as Fragility
    from .fragility import fit_fragility as fit_fragility
    from .identification.campaign import read_campaign as read_campaign
    from .identification.fit import fit as fit
    from .identification.fitted import Fit as Fit
    from .identification.loop_curves import loop_curves as loop_curves
    from .identification.loop_measures import loop_measures as loop_measures
    from .identification.raw_tests.import_tests import import_tests as import_tests
    from .io.interchange import export_results as export_results
    from .laws import Device as Device
    from .laws import available_conditions as available_conditions
    from .laws import available_laws as available_laws
    from .laws import available_sets as available_sets
    from .laws import law as law
    from .laws import measured_force as measured_force
    from .laws import passive as passive
    from .registry import available_controllers as available_controllers
    from .registry import controller as controller
    from .registry import register as register
    from .scenario import Scenario as Scenario
    from .simulation.batch import Batch as Batch
    from .simulation.batch import Case as Case
    from .simulation.batch import simulate_many as simulate_many
    from .simulation.control import CoilDriver as CoilDriver
    from .simulation.control import Sensors as Sensors
    from .simulation.result import Run as Run
    from .simulation.run_files import read_run as read_run
    from .simulation.run_files import write_run as write_run
    from .simulation.simulator import Simulator as Simulator
    from .simulation.substructure import DeviceSimulator as DeviceSimulator
    from .simulation.vector_simulator import VectorSimulator as VectorSimulator
    from .structures import IsolatedStructure as IsolatedStructure
    from .structures import Structure as Structure
    from .structures import from_fixed_base as from_fixed_base
    from .structures import from_matrices as from_matrices
    from .structures import from_opensees as from_opensees
    from .structures import read_matrices as read_matrices
    from .structures import reference_building as reference_building
    from .structures import reference_isolators as reference_isolators
    from .structures import shear_building as shear_building
    from .sweeps.plan import SweepPlan as SweepPlan
    from .sweeps.result import Sweep as Sweep
    from .sweeps.run import sweep as sweep
    from .sweeps.study import Study as Study
    from .sweeps.suites.compare import compare_records as compare_records
    from .sweeps.suites.result import Suite as Suite
    from .sweeps.suites.run import run_suite as run_suite
    from .tuning.tune import tune as tune
    from .tuning.tuning import Tuning as Tuning

    read_record = read

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

if not TYPE_CHECKING:  # type checkers refuse a misspelt name
    from ground_motions.exports import lazy_exports

    __getattr__, __all__ = lazy_exports(__name__)

    def __dir__() -> list[str]:
        return sorted(["__version__", *__all__])
