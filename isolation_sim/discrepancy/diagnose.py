"""Diagnose measured data: choose the adapter, run the pipeline."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..effects.serialisation import device_code
from ..errors import InputError
from ..identification.campaign import Campaign, read_campaign
from ..identification.law_choice import AUTO, LawChoice, choose_law
from ..identification.measured.data_checks import refuse_swapped
from ..identification.measured_runs import hold_out_some, measured_runs
from ..identification.run_preparation import repaired, thin_runs
from ..identification.sensitivities import laws_to_compile
from ..io.files import read_toml
from ..io.results_folder import law_file
from ..laws import Device
from ..laws import law as published
from ..laws.law import Law
from ..laws.registry import LAWS
from ..workers import Task, run_beside, workers
from .decisions import COMPLETES, MOST_BUILDING_CAUSES, SIGNIFICANCE
from .diagnosis import BuildingDiagnosis, Diagnosis
from .inference import gain_interval, verdict
from .loops.table import LoopTable, read_loop_table
from .problem import Problem
from .report_steps import report_steps
from .residuals import DRIFT, smallest_set
from .search import H, SearchResult
from .tiers.result import TIERS, Tier
from .verdict import NOTHING_PREDICTS

if TYPE_CHECKING:
    from ..structures import IsolatedStructure
    from .adapters.device_tests import DeviceTests
    from .building.record import BuildingRecord

DEFAULT_LAW = "strain_stiffening"
_ONLY_FITTED = (
    'law is "auto"; expected: a campaign of device tests and parameters "fit", or the name of a law'
)


def diagnose(
    data: Campaign | LoopTable | str | Path,
    law: str | Law = DEFAULT_LAW,
    parameters: str | Path | Device = "fit",
    *,
    current_degree: int | None = None,
    significance: float | None = None,
    tiers: Tier = "auto",
    seed: int = 0,
    threads: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Find the errors of a simulation, and name their causes."""
    significance = SIGNIFICANCE if significance is None else significance
    if not 0 <= significance < 1:
        raise InputError("significance", f"{significance:g}", "0 to 1, of the force")
    _check_tiers(tiers)
    if law != AUTO and not isinstance(law, Law):
        law = LAWS[law]
    device = read_parameters(law, parameters) if isinstance(law, Law) else None
    if not isinstance(data, Campaign | LoopTable):
        data = read_loop_table(data) if kind_of(data) == "loops" else read_campaign(data)
    report = progress or (lambda text: None)
    if isinstance(data, LoopTable):
        if not isinstance(law, Law):
            raise InputError(_ONLY_FITTED)
        if tiers not in ("auto", "causes"):
            raise InputError("tiers", f"{tiers!r} for a loop table", "auto or causes")
        from .adapters.loop_table import LoopTableTests

        with workers(threads) as pool:
            table = LoopTableTests(data, law, device, current_degree, seed, pool, report)
            return diagnose_problem(table)[0]
    if not isinstance(law, Law) and parameters != "fit":
        raise InputError(_ONLY_FITTED)
    from .adapters.device_tests import DeviceTests
    from .device.first_use import effects_to_compile

    data, repairs = repaired(data)
    refuse_swapped(data.runs)
    data, thinned = thin_runs(data)

    def uncompiled() -> list[Task[None]]:
        return [*(laws_to_compile() if law == AUTO else ()), *effects_to_compile()]

    with workers(threads) as pool, run_beside(uncompiled):
        runs = hold_out_some(measured_runs(data.runs), data.runs)
        tests = partial(
            DeviceTests, data, device=device, seed=seed, pool=pool, progress=report,
            significance=significance, data=runs, repaired=[*repairs, *thinned],
        )  # fmt: skip
        if isinstance(law, Law):
            fitted, chosen = law, None
        else:
            chosen = choose_law(
                data, runs, current_degree, pool, seed=seed,
                advance=lambda: report("comparing laws"),
            )  # fmt: skip
            fitted = LAWS[chosen.best.law]
        problem, diagnosis = _diagnose_tests(tests, fitted, current_degree, chosen)
        explained = diagnosis.verdict in ("adequate", "explained")
        # given parameter values are not fitted
        needless = explained or device is not None or problem.is_far_off
        if tiers == "causes" or (tiers == "auto" and needless):
            return diagnosis
        from .tiers.device_tests import DeviceTiers
        from .tiers.ladder import climb

        return climb(DeviceTiers(problem), diagnosis, "learned" if tiers == "auto" else tiers)


def _diagnose_tests(
    tests: Callable[..., DeviceTests], law: Law, degree: int | None, chosen: LawChoice | None
) -> tuple[DeviceTests, Diagnosis]:
    """Diagnose device tests, again with another law or degree where that needs less."""
    problem = tests(law=law, degree=degree, choice=chosen)
    diagnosis = diagnose_problem(problem)[0]
    better = problem.law_beside_causes() if chosen is not None else None
    if chosen is not None and better is not None:
        other = tests(law=LAWS[better.law], degree=degree, choice=chosen.with_best(better))
        again = diagnose_problem(other)[0]
        far_less = again.unexplained_share < COMPLETES * diagnosis.unexplained_share
        if len(again.causes) < len(diagnosis.causes) or far_less:
            problem, diagnosis = other, again
    if problem.saturates_alike():
        law = problem.law.model.parameterisation.law
        other = tests(law=law, degree=1, choice=problem.choice, saturates=True)
        again = diagnose_problem(other)[0]
        if any(one.name == "field_saturation" and one.is_named for one in again.causes):
            problem, diagnosis = other, again
    return problem, diagnosis


def diagnose_building(
    records: BuildingRecord | Sequence[BuildingRecord],
    isolated: IsolatedStructure,
    *,
    most_causes: int = MOST_BUILDING_CAUSES,
    tiers: Tier = "auto",
    progress: Callable[[str], None] | None = None,
) -> BuildingDiagnosis:
    """Find the errors of a building's simulation, and name their causes."""
    from .adapters.building import BuildingRecords
    from .building.isolation_force import unsupported
    from .building.record import BuildingRecord
    from .tiers.building import BuildingTiers

    _check_tiers(tiers)
    several = (records,) if isinstance(records, BuildingRecord) else tuple(records)
    lacking = unsupported(isolated, several) if several and isolated.elements else ""
    if lacking and tiers not in ("auto", "causes"):
        raise InputError("tiers", f"{tiers!r} for {lacking}", "auto or causes")
    problem = BuildingRecords(several, isolated, most_causes, progress or (lambda text: None))
    devices = [element.device for element in isolated.elements]
    common, result = diagnose_problem(problem, devices)
    diagnosis = BuildingDiagnosis(**vars(common), building=problem.building(result))
    explained = diagnosis.verdict in ("adequate", "explained")
    diverges = not np.isfinite([result.base.cost, result.best.cost]).all()
    # terms stand in the isolators' law
    needless = tiers == "auto" and (explained or problem.lacks_force_elsewhere)
    if tiers == "causes" or lacking or diverges or needless:
        return diagnosis
    from .tiers.ladder import climb

    with workers(1) as pool:
        rungs = BuildingTiers(problem, result.best, pool)
        return climb(rungs, diagnosis, "learned" if tiers == "auto" else tiers)


def _check_tiers(tiers: str) -> None:
    if tiers not in TIERS:
        raise InputError("tiers", repr(tiers), ", ".join(TIERS))


def diagnose_problem(
    problem: Problem[H], devices: Sequence[Device] = ()
) -> tuple[Diagnosis, SearchResult[H]]:
    """Run the pipeline on one kind of data."""
    result = problem.search(problem.nominal())
    dependences = problem.dependences(result.base)
    evaluation = problem.evaluate(result)
    variable = [one for one in dependences if one.text != DRIFT]
    if problem.predicts_residual and dependences and not smallest_set(variable):
        evaluation.details[NOTHING_PREDICTS] = True
    causes = tuple(sorted(problem.causes(result, evaluation), key=lambda cause: -cause.share))
    judgement = verdict(causes, evaluation.adequate, evaluation.explained)
    plan = problem.test_plan(result, causes)
    distinguishing = (
        [test.sentence for test in plan.tests if test.tells] if plan is not None else []
    )
    evaluated, extended = problem.devices(result)
    code: dict[str, str] = {}
    for device in (*devices, *([evaluated] if evaluated else [])):
        code |= device_code(device)
    diagnosis = Diagnosis(
        data=problem.data_name,
        model=problem.model_name,
        verdict=judgement,
        noise_floor=evaluation.noise.fit,
        held_out_noise_floor=evaluation.noise.held_out,
        error_before=evaluation.before,
        error_after=evaluation.after,
        causes=causes,
        unexplained_share=0.0 if evaluation.adequate else min(evaluation.unexplained, 1.0),
        depends_on=problem.depends_on(dependences, causes, evaluation),
        next_test=distinguishing[0] if distinguishing else problem.next_test(result, causes),
        test_plan=plan,
        steps=report_steps(problem, result, dependences, evaluation, causes, judgement),
        nominal=evaluated,
        extended=extended,
        gain=gain_interval(evaluation.blocks, problem.seed) if causes else None,
        traces=problem.traces(result),
        details=evaluation.details | ({"code": code} if code else {}),
        data_notes=problem.data_notes,
    )
    return diagnosis, result


def kind_of(path: str | Path) -> str:
    """Determine the kind of data in a path."""
    path = Path(path)
    if path.is_dir() or path.suffix.lower() != ".csv":
        return "campaign"
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        raise InputError(f"{path}: cannot be read ({reason})") from None
    head = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    if re.search(r"ground_\w*acceleration|isolator_\w*displacement", head, re.IGNORECASE):
        return "building"
    if "amplitude" in head or "damping_ratio" in head:
        return "loops"
    heading = f"columns {head!r}" if head else "no line of column names"
    raise InputError(
        f"{path}: {heading}; expected: a campaign folder, a loop table (amplitude_mm, "
        "frequency_Hz, ...) or a building record (time_s, ground_acceleration_m_s2, ...), which "
        "isolation-sim import --building makes of files of loggers"
    )


def read_parameters(law: Law, parameters: str | Path | Device) -> Device | None:
    """Find the parameter values of the nominal law."""
    if isinstance(parameters, Device):
        device = parameters
    elif str(parameters) == "fit":
        return None
    elif str(parameters) == "published":
        device = published(law)
    else:
        device = _from_file(law_file(parameters))
    if device.law is not law:
        raise InputError(
            f"{parameters}: parameters of {device.law.name}; expected: of {law.name}, the law"
        )
    return device


def _from_file(path: Path) -> Device:
    accepted = "fit, published or a file that fit --out has written"
    data = read_toml(path, accepted)
    try:
        section = data["isolator"]
        name, numbers = section["law"], section["parameters"]
    except (KeyError, TypeError):
        raise InputError(
            f"{path}: no [isolator] section with law and parameters; expected: {accepted}"
        ) from None
    if section.get("effect") or section.get("instrument"):
        raise InputError(
            f"{path}: a law with effects; expected: {accepted}. isolation-sim evaluate computes "
            "the errors of an extended law"
        )
    return published(name, numbers, section.get("current_range_A"))
