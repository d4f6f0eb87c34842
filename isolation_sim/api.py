"""The main functions of the package; they accept controllers by name and scenarios by path."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from ground_motions import Record
from ground_motions.argument_types import checked

from .criterion import Criterion
from .errors import InputError, warn
from .registry import controller as named_controller
from .registry import named_controllers
from .simulation.control import CoilDriver, Control, Sensors
from .simulation.result import Run
from .simulation.validity import warnings_of
from .structures import IsolatedStructure

if TYPE_CHECKING:
    from .comparison import Comparison
    from .discrepancy.diagnosis import Diagnosis
    from .discrepancy.tiers.result import Tier
    from .identification.campaign import Campaign
    from .identification.fitted import Fit, LawEvaluation
    from .laws import Device
    from .laws.law import Law
    from .scenario import Scenario
    from .sweeps.result import Sweep
    from .sweeps.study import Study
    from .sweeps.suites.result import Suite
    from .tuning.tuning import Tuning


@checked
def simulate(
    isolated: IsolatedStructure,
    ground: Record | Sequence[Record],
    controller: str | Control = "passive_off",
    *,
    nominal: IsolatedStructure | None = None,
    driver: CoilDriver | None = None,
    sensors: Sensors | None = None,
    computation_delay: float = 0.0,
    tolerance: float = 1e-6,
    current_outside: Literal["refuse", "clamp"] = "refuse",
    criteria: Sequence[str | Criterion] = (),
) -> Run:
    """Simulate one run.

    Parameters
    ----------
    isolated : IsolatedStructure
        The plant, such as ``reference_building().on(reference_isolators())``.
    ground : Record or sequence of Record
        Ground acceleration, m/s^2, one record per direction of the structure.
    controller : str or Control, default "passive_off"
        Name of a controller, a place such as ``"my_controllers.py:Outwards"``, or a
        controller object such as ``controller("constant", amperes=1.5)``.
    nominal : IsolatedStructure, optional
        The nominal model of the controller; the plant itself by default.
    driver : CoilDriver, optional
        Lag, slew, limits and step of the coils; ideal by default.
    sensors : Sensors, optional
        Noise, delay, dropout and sampling of the controller's measurements; ideal by default.
    computation_delay : float, default 0
        Time from a decision to its command, s.
    tolerance : float, default 1e-6
        Target accuracy, relative to each quantity's peak; 1e-12 to 1e-2.
    current_outside : {"refuse", "clamp"}
        Treatment of a command outside the driver's limits: stop with an error, or clamp and count
        it.
    criteria : sequence of str or Criterion
        Criteria beside the peaks and RMS values, by name, by place or themselves.

    Returns
    -------
    Run

    Raises
    ------
    InputError
        If a name or an argument cannot be used, or a current is refused.
    Diverged
        If the response leaves the range of numbers or of the law; with the time and the cause.
    ControllerError
        If the controller raises an error, which is its ``__cause__``.

    Warns
    -----
    TestedRangeWarning
        If a deformation or a current exceeds those of the device tests.
    PlausibilityWarning
        If the structure, its isolators or the ground motion are implausible for a building, if the
        building moves or is displaced at the end, or if a moat wall or an end stop is touched.
    ControllerWarning
        If the controller was not made for these conditions.
    AccuracyWarning
        If some integration steps missed the tolerance.
    """
    from .simulation.run import simulate as run

    result = run(
        isolated, ground, _controller(controller), nominal=nominal, driver=driver, sensors=sensors,
        computation_delay=computation_delay, tolerance=tolerance, current_outside=current_outside,
        criteria=criteria,
    )  # fmt: skip
    _warn({result.controller: result})
    return result


@checked
def compare(
    isolated: IsolatedStructure,
    ground: Annotated[
        Record | Sequence[Record],
        "a Record, such as ground_motions.read(path), or a list with one per direction; "
        "compare_records takes several records",
    ],
    controllers: Sequence[str | Control] | Mapping[str, str | Control],
    *,
    nominal: IsolatedStructure | None = None,
    driver: CoilDriver | None = None,
    sensors: Sensors | None = None,
    computation_delay: float = 0.0,
    tolerance: float = 1e-6,
    current_outside: Literal["refuse", "clamp"] = "refuse",
    criteria: Sequence[str | Criterion] = (),
    fixed_base: bool = False,
) -> Comparison:
    """Simulate several controllers on one plant under one ground motion.

    For several records see `isolation_sim.compare_records`.

    Parameters
    ----------
    isolated : IsolatedStructure
        The plant.
    ground : Record or sequence of Record
        Ground acceleration, m/s^2, one record per direction of the structure.
    controllers : sequence or mapping of str or Control
        Names or controllers; a mapping's keys are the names to print.
    nominal, driver, sensors, computation_delay, tolerance, current_outside, criteria
        As in `simulate`.
    fixed_base : bool, default False
        Whether to simulate the building without isolation and without soil, too, for comparison.

    Returns
    -------
    Comparison
        Its ``criteria``, ``energy`` and ``table()``; ``diverged`` names the controllers without a
        result.

    Raises
    ------
    InputError
        If a name or an argument cannot be used, or two controllers share a name.
    Diverged
        If every response leaves the range of numbers or of the law, or every controller raises an
        error; with the time and the cause.
    RefusedCurrent
        If every controller commands a current out of range.

    Warns
    -----
    TestedRangeWarning
        If a deformation or a current is beyond those at which the devices were tested.
    PlausibilityWarning
        If the structure, its isolators or the ground motion are implausible for a building, if the
        building moves or is displaced at the end, or if a moat wall or an end stop is touched.
    ControllerWarning
        If a controller was not made for these conditions.
    """
    from .comparison import simulated
    from .simulation.run import fixed_base_run
    from .simulation.run import simulate as run

    named = named_controllers(controllers)
    result = simulated(
        named,
        lambda name: run(
            isolated, ground, named[name], nominal=nominal, driver=driver, sensors=sensors,
            computation_delay=computation_delay, tolerance=tolerance,
            current_outside=current_outside, criteria=criteria,
        ),
        lambda: fixed_base_run(isolated, ground, tolerance) if fixed_base else None,
    )  # fmt: skip
    _warn(result.runs)
    return result


@checked
def load(path: str | Path) -> Run | Comparison | Fit | Diagnosis | Sweep | Suite | Tuning | Study:
    """Load a saved result as an object of its class.

    Parameters
    ----------
    path : str or pathlib.Path
        Results folder of ``save``, ``isolation-sim run``, ``fit``, ``diagnose``, ``sweep``,
        ``suite``, ``tune`` or ``study``, or a file ``result.npz``.

    Returns
    -------
    Run, Comparison, Fit, Diagnosis, Sweep, Suite, Tuning or Study
        With its plots, criteria and reports; without the simulation's working memory.

    Raises
    ------
    InputError
        If there is no readable result.
    """
    from .archive import FILE, load_archive
    from .sweeps.result import Sweep
    from .sweeps.study import FINDING, Study
    from .sweeps.suites.result import Suite
    from .tuning.tuning import Tuning

    folder = Path(path)
    if folder.is_file():
        return load_archive(folder)
    if (folder / FILE).is_file():
        return load_archive(folder / FILE)
    kinds: dict[str, Callable[[Path], Sweep | Suite | Tuning | Study]]
    kinds = {
        "suite.json": Suite, "manifest.json": Sweep, "tuning.json": Tuning.read, FINDING: Study,
    }  # fmt: skip
    for name, kind in kinds.items():
        if (folder / name).is_file():
            return kind(folder)
    raise InputError(f"{path}: no saved result; expected: a folder with {FILE}, {', '.join(kinds)}")


@checked
def run_scenario(scenario: Scenario | str | Path | None = None) -> Comparison:
    """Run all controllers of a scenario.

    Parameters
    ----------
    scenario : Scenario, str or pathlib.Path, optional
        A scenario or the path of its file; the main job by default.

    Returns
    -------
    Comparison
        Its ``diverged`` names the controllers without a result.

    Raises
    ------
    InputError
        With the file, the key, its value and the expected value.
    Diverged
        If every response leaves the range of numbers or of the law; with the first controller, the
        time and the cause.
    """
    from .comparison import simulated
    from .scenario import Scenario, main_job
    from .scenario.compilation import compile_in_parallel

    if not isinstance(scenario, Scenario):
        scenario = main_job() if scenario is None else Scenario.read(scenario)
    job = scenario.build()
    with compile_in_parallel(scenario, job) as run:
        result = simulated(job.controllers, run, job.run_fixed_base)
    _warn(result.runs)
    return result


@checked
def diagnose(
    data: Campaign | str | Path | Sequence[str | Path],
    law: str | Law = "strain_stiffening",
    parameters: str | Path | Device = "fit",
    *,
    scenario: Scenario | IsolatedStructure | str | Path | None = None,
    hold_out: Sequence[str | Path] = (),
    consequence: bool = True,
    current_degree: int | None = None,
    significance: float | None = None,
    tiers: Tier = "auto",
    seed: int = 0,
    threads: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Find the differences between a simulation and measured data, and their causes.

    Parameters
    ----------
    data : Campaign, str, pathlib.Path or a sequence of paths
        A campaign of device tests or its folder, the CSV file of a loop table, or one or several
        CSV files of building records, of one horizontal direction or of two.
    law : str or Law, default "strain_stiffening"
        Law to evaluate, its registry name, or a place such as ``"my_laws.py:CUBIC"``; for device
        tests and loop tables. "auto" first compares all registered laws on device tests, and
        evaluates the one with the smallest error on the held-out runs.
    parameters : str, pathlib.Path or Device, default "fit"
        Parameters of the law: "fit", "published", or a file of ``fit --out``.
    scenario : Scenario, IsolatedStructure, str or pathlib.Path, optional
        The nominal building; required for building records, with as many directions as they have.
        For device tests it is the scenario of the consequence; the main job by default. If its
        isolator section has no scales, the diagnosis scales the device.
    hold_out : sequence of paths, optional
        Further building records, or some of ``data``, that are not used in the fit. By default it
        is the last of several records, and the later part of a single one.
    consequence : bool, default True
        Whether to run the scenario's controllers with the evaluated and with the extended law, if
        a cause was found. For a building record this needs a scenario of the building.
    current_degree : int, optional
        Degree of the parameters' polynomials of the current; not for building records.
    significance : float, optional
        Share of the force (RMS) below which an effect is negligible, 0.002 by default; not for
        building records.
    tiers : {"auto", "causes", "equation", "learned"}, default "auto"
        Methods beyond named causes, for campaigns of device tests and for building records of one
        direction: "auto" adds an equation and a learned term where a fitted law, or the nominal
        building, with its causes does not explain the data.
    seed : int, default 0
        Random seed of search and inference; not used for a building record.
    threads : int, optional
        Threads of the fits; one per processor by default. A building record uses one.
    progress : callable, optional
        Called with the name of each step at its beginning.

    Returns
    -------
    Diagnosis
        Its ``verdict``, ``causes``, ``extended`` device, ``report()`` and ``save(folder)``.

    Raises
    ------
    InputError
        If the data cannot be read, a name is unknown, the law cannot be fitted, or
        ``current_degree`` is set for a building record.
    """
    from .discrepancy.building.record import read_building_record
    from .discrepancy.diagnose import diagnose as of_device
    from .discrepancy.diagnose import diagnose_building
    from .scenario import Scenario
    from .scenario.consequence import with_consequence

    if isinstance(scenario, str | Path):
        scenario = Scenario.read(scenario)
    paths, held = _record_paths(data, hold_out)
    result: Diagnosis
    if paths:
        isolated = _nominal_building(paths[0], scenario, significance, current_degree)
        records = [read_building_record(path, path in held) for path in paths]
        result = diagnose_building(records, isolated, tiers=tiers, progress=progress)
    else:
        result = of_device(
            data, law, parameters, current_degree=current_degree,  # type: ignore[arg-type]
            significance=significance, tiers=tiers, seed=seed, threads=threads,
            progress=progress,
        )  # fmt: skip
        scenario = Scenario() if scenario is None else scenario
    if consequence and isinstance(scenario, Scenario):
        return with_consequence(result, scenario, progress)
    return result


def _nominal_building(
    path: str | Path,
    scenario: Scenario | IsolatedStructure | None,
    significance: float | None,
    current_degree: int | None,
) -> IsolatedStructure:
    """Building of a record's scenario; options for device tests are refused."""
    if scenario is None:
        raise InputError(
            f"{path}: a building record needs its building; expected: --scenario with a "
            "scenario file that describes it"
        )
    if significance is not None:
        raise InputError(
            f"{path}: significance",
            f"{significance:g}, which has no meaning for a building record",
            "none, or a campaign of device tests",
        )
    if current_degree is not None:
        raise InputError(
            f"{path}: current degree",
            f"{current_degree}, which has no meaning for a building record: its isolator's numbers "
            "are the scenario's",
            "none, or a campaign or loop table, to which a law is fitted",
        )
    return scenario if isinstance(scenario, IsolatedStructure) else scenario.build().isolated


def _record_paths(data: Any, hold_out: Sequence[str | Path]) -> tuple[list[Path], list[Path]]:
    """Files of building records, and those of them that are held out; none for other data."""
    from .discrepancy.diagnose import kind_of

    several = isinstance(data, list | tuple)
    paths = [Path(path) for path in (data if several else [data]) if isinstance(path, str | Path)]
    held = [Path(path) for path in hold_out]
    if not (several or held) and (not paths or kind_of(paths[0]) != "building"):
        return [], []
    if not paths:
        raise InputError("data", repr(data), "one or several building records")
    for path in (*paths, *held):
        if kind_of(path) != "building":
            raise InputError(
                f"{path}: not a CSV file of a building record; expected: one, as for every one of "
                "several data and for what is held out beside them"
            )
    return [*paths, *(path for path in held if path not in paths)], held


@checked
def evaluate(law: Device | str | Path, campaign: Campaign | str | Path) -> LawEvaluation:
    """Compute the errors of a law on measured runs, without fitting.

    Parameters
    ----------
    law : Device, str or pathlib.Path
        A device, or a file with an ``[isolator]`` section from ``fit --out`` or ``diagnose``, or
        the folder of one. The scales in a file are ignored: the law is that of the tested device.
        Its effects of the instruments count.
    campaign : Campaign, str or pathlib.Path
        The measured runs, or their folder.

    Returns
    -------
    LawEvaluation
        Its ``error``, ``errors`` run by run, ``tables()``, ``plot()`` and ``to_html(path)``.

    Raises
    ------
    InputError
        If a file cannot be read, or the law's parameters are piecewise in the current.
    """
    from .discrepancy.evaluate import evaluate as errors_of
    from .io.results_folder import law_file
    from .laws import Device
    from .scenario import Scenario

    if not isinstance(law, Device):
        if not (file := law_file(law)).is_file():
            expected = "the file of a law, as fit --out and diagnose write it"
            raise InputError(f"{file}: no such file; expected: {expected}")
        section = Scenario.read(file).isolator
        changes: dict[str, Any] = {"length_scale": 1.0, "force_scale": 1.0, "count": 1.0}
        # the measured force contains what the instruments add
        changes["effect"] = [*(section.effect or ()), *(section.instrument or ())]
        law = section.model_copy(update=changes).device()
    return errors_of(law, campaign)


def _controller(controller: str | Control) -> Control:
    return named_controller(controller) if isinstance(controller, str) else controller


def _warn(runs: Mapping[str, Run]) -> None:
    """Warn the user, once for each line."""
    for line, kind in warnings_of(runs):
        warn(line, kind)
