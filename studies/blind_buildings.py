"""How often the diagnosis of a building record finds the faults that a generator has hidden.

Run it with ``python -m studies.blind_buildings [SHARE]``, as ``studies.blind``, which asks the
same of device tests. It writes ``results/blind/building_confusion.md`` and ``building_rates.md``.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .blind import building_cases as blind
from .blind.building_model import Building
from .blind.building_score import BuildingScored, confusion_table, rates
from .blind.buildings import DAMPING_RATIO, ISOLATOR
from .blind.study import part, share_from, study_records

if TYPE_CHECKING:
    from isolation_sim.discrepancy.tiers.result import Tier

CLEAN, PAIRS = 60, 20


def cases(share: float) -> list[blind.BuildingCase]:
    """List the blind cases."""
    listed = (blind.singles(), blind.clean(CLEAN), blind.pairs(PAIRS), blind.outside())
    return list(chain.from_iterable(part(every, share) for every in listed))


def engineers(building: Building) -> Any:
    """Build what an engineer knows of a blind building."""
    import isolation_sim as iso

    structure = iso.shear_building(
        building.masses, building.stiffnesses, base_mass=building.base_mass,
        damping_ratio=DAMPING_RATIO, rayleigh_modes=(1, 3),
    )  # fmt: skip
    rows = dict(zip(ISOLATOR, building.isolator.tolist(), strict=True))
    return structure.on(iso.law("bouc_wen", rows | {"F0": 0.0}))


def score(case: blind.BuildingCase) -> BuildingScored:
    """Make a case's record, diagnose it, and put the truth beside the outcome."""
    from isolation_sim.discrepancy.building.record import read_building_record
    from isolation_sim.discrepancy.diagnose import diagnose_building

    with tempfile.TemporaryDirectory() as folder:
        written = case.record.write(Path(folder) / "case")
        record = read_building_record(written / "record.csv")
    tiers: Tier = "auto" if case.kind == "outside" else "causes"
    diagnosis = diagnose_building(record, engineers(case.record.nominal), tiers=tiers)
    # a new case: the record that a case caches cannot go to another process
    return BuildingScored(replace(case), diagnosis.to_dict())


def main(share: float = 1.0) -> None:
    """Diagnose all cases and print the rates."""
    study_records(cases(share), score, rates, confusion_table, "building_")


if __name__ == "__main__":
    help_text = "Diagnose blind building records and print how often the faults are found."
    main(share_from("studies.blind_buildings", help_text))
