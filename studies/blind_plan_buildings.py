"""How often the diagnosis finds the faults hidden in records of two directions.

Run it with ``python -m studies.blind_plan_buildings [SHARE]``, as ``studies.blind_buildings``. It
writes ``results/blind/plan_confusion.md`` and ``plan_rates.md``.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from .blind import plan_buildings as blind
from .blind.building_score import BuildingScored, answer, confusion_table
from .blind.score import Rate, named
from .blind.study import part, share_from, study_records

CLEAN = 12
SIZES = (0.03, 0.1)
"""Misfits that the faults make, at 1 % noise in each channel and in the ground motions."""


@dataclass(frozen=True)
class PlanCase:
    """A record; ``kind`` is clean or single, ``forms`` are (name, form)."""

    kind: str
    seed: int
    forms: tuple[tuple[str, str], ...] = ()
    size: float = 0.0


def singles() -> Iterator[PlanCase]:
    """Each fault at each size, with its own seed."""
    for number, form in enumerate(blind.FORMS):
        for k, size in enumerate(SIZES):
            yield PlanCase("single", 30_000 + len(SIZES) * number + k, (form,), size)


def clean() -> Iterator[PlanCase]:
    """Nothing hidden."""
    for number in range(CLEAN):
        yield PlanCase("clean", 31_000 + number)


def score(case: PlanCase) -> BuildingScored:
    """Make a case's record, diagnose it, and put the truth beside the outcome."""
    import isolation_sim as iso

    nominal = blind.nominal_building(case.seed)
    building, bias = nominal, 0.0
    for _, form in case.forms:
        severity = blind.severity_for(nominal, form, case.size, case.seed)
        building = blind.faulty(nominal, form, severity, case.seed)
        bias = severity if form == "constant" else 0.0
    with tempfile.TemporaryDirectory() as folder:
        place = blind.write(nominal, blind.record(building, case.seed, bias=bias), Path(folder))
        diagnosis = iso.diagnose(
            place / "record.csv", scenario=place / "building.toml", consequence=False
        )
    return BuildingScored(case, diagnosis.to_dict())


def rates(results: list[BuildingScored]) -> dict[str, Rate]:
    """Faults that are named, and causes where nothing is hidden."""
    singles = [r for r in results if r.case.forms]
    clean = [r for r in results if not r.case.forms]
    first = [answer(r.diagnosis) == r.case.forms[0][0] for r in singles]
    alone = [named(r.diagnosis) == [r.case.forms[0][0]] for r in singles]
    return {
        "single named first": Rate(sum(first), len(first)),
        "single named with nothing beside it": Rate(sum(alone), len(alone)),
        "cause named on clean records": Rate(
            sum(bool(named(r.diagnosis)) for r in clean), len(clean)
        ),
    }


def main(share: float = 1.0) -> None:
    """Diagnose all cases and print the rates."""
    listed = [*part(singles(), share), *part(clean(), share)]
    study_records(listed, score, rates, confusion_table, "plan_")


if __name__ == "__main__":
    help_text = "Diagnose blind records of two directions and print how often faults are found."
    main(share_from("studies.blind_plan_buildings", help_text))
