"""The verbs of the package: controllers by name, scenarios by path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ground_motions import Record

from .errors import InputError
from .registry import controller as named_controller
from .simulation.control import Control
from .simulation.result import Run
from .structures import IsolatedStructure

if TYPE_CHECKING:
    from .comparison import Comparison
    from .discrepancy.diagnosis import Diagnosis
    from .identification.campaign import Campaign
    from .identification.fitted import LawEvaluation
    from .laws import Device
    from .laws.law import Law
    from .scenario import Scenario


def simulate(
    isolated: IsolatedStructure,
    ground: Record | Sequence[Record],
    controller: str | Control = "passive_off",
    **options: Any,
) -> Run:
    """Simulate one run.

    Parameters
    ----------
    isolated : IsolatedStructure
        The plant, such as ``reference_building().on(reference_isolators())``.
    ground : Record or sequence of Record
        Ground acceleration, m/s2, one record a direction of the structure.
    controller : str or Control, default "passive_off"
        Name of a controller, a place such as ``"my_controllers.py:Outwards"``, or one with
        settings such as ``controller("constant",
        amperes=1.5)``, or one of your own.
    **options
        Keyword arguments of ``isolation_sim.simulation.run.simulate``: ``belief``, ``driver``,
        ``sensors``, ``computation_delay`` (s), ``tolerance``, ``current_outside``.

    Returns
    -------
    Run

    Raises
    ------
    InputError
        If a name or an argument cannot be used, or a current is refused.
    Diverged
        If the response leaves the range of numbers or of the law; with the time and the cause.
    """
    from .simulation.run import simulate as run

    return run(isolated, ground, _controller(controller), **options)


def compare(
    isolated: IsolatedStructure,
    ground: Record | Sequence[Record],
    controllers: Sequence[str | Control] | Mapping[str, str | Control],
    **options: Any,
) -> Comparison:
    """Simulate several controllers on one plant under one ground motion.

    Parameters
    ----------
    isolated : IsolatedStructure
        The plant.
    ground : Record or sequence of Record
        Ground acceleration, m/s2, one record a direction of the structure.
    controllers : sequence or mapping of str or Control
        Names or controllers; a mapping's keys are the names to print.
    **options
        As in `simulate`.

    Returns
    -------
    Comparison
        Its ``criteria``, ``energy`` and ``table()``; ``diverged`` names the controllers without a
        result.

    Raises
    ------
    InputError
        If a name or an argument cannot be used, two controllers share a name, or a current is
        refused.
    Diverged
        If every response leaves the range of numbers or of the law; with the time and the cause.
    """
    from .comparison import simulated

    if isinstance(controllers, Mapping):
        named = {name: _controller(each) for name, each in controllers.items()}
    else:
        if isinstance(controllers, str):
            raise InputError(
                f"controllers is {controllers!r}; accepted: a list of names or controllers"
            )
        built = [_controller(each) for each in controllers]
        named = {each.name: each for each in built}
        if len(named) < len(built):
            names = ", ".join(each.name for each in built)
            raise InputError(
                f"controllers are {names}; accepted: different names, or a mapping of names to "
                "controllers"
            )
    return simulated(named, lambda name: simulate(isolated, ground, named[name], **options))


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
        Naming the file, the key, what was given and what is accepted.
    Diverged
        If every response leaves the range of numbers or of the law; with the first controller, the
        time and the cause.
    """
    from .comparison import simulated
    from .scenario import Scenario

    if not isinstance(scenario, Scenario):
        scenario = Scenario() if scenario is None else Scenario.read(scenario)
    job = scenario.build()
    return simulated(job.controllers, job.run)


def diagnose(
    data: Campaign | str | Path | Sequence[str | Path],
    law: str | Law = "strain_stiffening",
    parameters: str | Path | Device = "fit",
    *,
    scenario: Scenario | IsolatedStructure | str | Path | None = None,
    consequence: bool = True,
    **options: Any,
) -> Diagnosis:
    """Find what a simulation gets wrong in measured data, and why.

    Parameters
    ----------
    data : Campaign, str, pathlib.Path or a sequence of paths
        A campaign of device tests or its folder, the CSV file of a loop table, or one or several
        CSV files of building records.
    law : str or Law, default "strain_stiffening"
        The law to judge, its registry name, or a place such as ``"my_laws.py:CUBIC"``; for device
        tests and loop tables.
    parameters : str, pathlib.Path or Device, default "fit"
        Its numbers: "fit", "published", or a file that ``fit --out`` writes.
    scenario : Scenario, IsolatedStructure, str or pathlib.Path, optional
        The building as it is believed to be; needed for building records. For device tests, where
        the consequence is shown: the main job by default. A scenario whose isolator section has no
        scales leaves it to the diagnosis to scale the device.
    consequence : bool, default True
        Whether to run the scenario's controllers with the law that was judged and with the
        extended one, where a cause was found; of a building record only if it is a scenario that
        describes the building.
    **options
        ``progress`` (called with the name of what is being done); for campaigns and loop tables
        also ``seed``, ``threads``, ``current_degree``, the degree of the parameters'
        polynomials of the current, and ``significance``, the share of the force (RMS) below
        which an effect is negligible (0.002).

    Returns
    -------
    Diagnosis
        Its ``verdict``, ``causes``, ``extended`` device, ``report()`` and ``save(folder)``.

    Raises
    ------
    InputError
        If the data cannot be read, a name is unknown, the law cannot be fitted, or
        ``current_degree`` is given for a building record.
    """
    from .discrepancy.building.record import read_building_record
    from .discrepancy.diagnose import diagnose as of_device
    from .discrepancy.diagnose import diagnose_building, kind_of
    from .scenario import Scenario
    from .scenario.consequence import with_consequence

    if isinstance(scenario, str | Path):
        scenario = Scenario.read(scenario)
    paths: list[str | Path]
    if isinstance(data, Sequence) and not isinstance(data, str):
        paths = list(data)
    else:
        paths = [] if not isinstance(data, str | Path) or kind_of(data) != "building" else [data]
    found: Diagnosis
    if not paths:
        found = of_device(data, law, parameters, **options)  # type: ignore[arg-type]
        scenario = Scenario() if scenario is None else scenario
    else:
        if scenario is None:
            raise InputError(
                f"{paths[0]}: a building record needs the building; accepted: --scenario with a "
                "scenario file that describes it"
            )
        significance = options.pop("significance", None)
        if significance is not None:
            raise InputError(
                f"{paths[0]}: significance is {significance:g}, which has no meaning for a "
                "building record; accepted: none, or a campaign of device tests"
            )
        degree = options.pop("current_degree", None)
        if degree is not None:
            raise InputError(
                f"{paths[0]}: current degree is {degree}, which has no meaning for a building "
                "record: its isolator's numbers are the scenario's; accepted: none, or a campaign "
                "or loop table, to which a law is fitted"
            )
        isolated = scenario.build().isolated if isinstance(scenario, Scenario) else scenario
        records = [read_building_record(path) for path in paths]
        found = diagnose_building(records, isolated, **options)
    if not (consequence and isinstance(scenario, Scenario)):
        return found
    return with_consequence(found, scenario, options.get("progress"))


def evaluate(law: Device | str | Path, campaign: Campaign | str | Path) -> LawEvaluation:
    """Compute the errors of a law on measured runs; nothing is fitted.

    Parameters
    ----------
    law : Device, str or pathlib.Path
        A device, or a file with an ``[isolator]`` section, as ``fit --out`` and ``diagnose`` write
        it. Of a file the tested device itself is taken, without its scales.
    campaign : Campaign, str or pathlib.Path
        The runs, or their folder.

    Returns
    -------
    LawEvaluation
        Its ``error``, ``errors`` run by run, ``tables()``, ``plot()`` and ``to_html(path)``.

    Raises
    ------
    InputError
        If a file cannot be read, or the law's numbers are given piecewise in the current.
    """
    from .discrepancy.evaluate import evaluate as errors_of
    from .laws import Device
    from .scenario import Scenario

    if not isinstance(law, Device):
        section = Scenario.read(law).isolator
        own = {"length_scale": 1.0, "force_scale": 1.0, "count": 1.0}
        law = section.model_copy(update=own).device()
    return errors_of(law, campaign)


def _controller(given: str | Control) -> Control:
    return named_controller(given) if isinstance(given, str) else given
