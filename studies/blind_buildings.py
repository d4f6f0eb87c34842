"""How often the diagnosis of a building record finds what an independent generator has hidden.

Run it from a checkout with ``python -m studies.blind_buildings [SHARE]``, as ``studies.blind``,
which asks the same of device tests. It writes ``results/blind/building_confusion.md`` and
``building_rates.md``.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

from .blind import diagnosed, leave, part

CLEAN, PAIRS = 60, 20


def cases(share: float) -> list[Any]:
    """List the blind cases.

    Parameters
    ----------
    share : float
        Of them all, 0 to 1.

    Returns
    -------
    list of tests.blind.building_cases.BuildingCase
    """
    from tests.blind import building_cases as blind

    listed = (blind.singles(), blind.clean(CLEAN), blind.pairs(PAIRS))
    return list(chain.from_iterable(part(every, share) for every in listed))


def engineers(building: Any) -> Any:
    """Build what an engineer knows of a blind building.

    Parameters
    ----------
    building : tests.blind.building_model.Building
        Without faults.

    Returns
    -------
    IsolatedStructure
    """
    import isolation_sim as iso
    from tests.blind.buildings import DAMPING_RATIO, ISOLATOR

    structure = iso.shear_building(
        building.masses, building.stiffnesses, base_mass=building.base_mass,
        damping_ratio=DAMPING_RATIO, rayleigh_modes=(1, 3),
    )  # fmt: skip
    rows = dict(zip(ISOLATOR, building.isolator.tolist(), strict=True))
    return structure.on(iso.law("bouc_wen", rows | {"F0": 0.0}))


def scored(case: Any) -> Any:
    """Make a case's record, diagnose it, and put the truth beside the outcome.

    Parameters
    ----------
    case : tests.blind.building_cases.BuildingCase
        The case.

    Returns
    -------
    tests.blind.building_score.BuildingScored
    """
    from isolation_sim.discrepancy.building import diagnose_building, read_building_record
    from tests.blind.building_score import BuildingScored

    with tempfile.TemporaryDirectory() as folder:
        written = case.record.write(Path(folder) / "case")
        record = read_building_record(written / "record.csv")
    diagnosis = diagnose_building(record, engineers(case.record.nominal))
    # afresh: the record that a case keeps cannot go to another process
    return BuildingScored(replace(case), diagnosis.to_dict())


def main(share: float = 1.0) -> None:
    """Diagnose all cases and print the rates.

    Parameters
    ----------
    share : float
        Of the cases, 0 to 1.
    """
    from tests.blind.building_score import confusion_table, rates

    results, seconds = diagnosed(cases(share), scored)
    lines = [f"- {name}: {rate}" for name, rate in rates(results).items()]
    lines.append(f"- {len(results)} records, {seconds:.1f} s each")
    leave(lines, confusion_table(results), "building_")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 1.0)
