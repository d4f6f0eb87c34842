"""Diagnoses of building records against truths: rates, and what was named instead."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .building_cases import BuildingCase
from .score import NOTHING, Rate, named


@dataclass(frozen=True)
class BuildingScored:
    """A case, and the diagnosis as ``isolation-sim diagnose --json`` prints it."""

    case: BuildingCase
    diagnosis: dict


def answer(diagnosis: dict) -> str:
    """First cause named; else the verdict."""
    if diagnosis["verdict"] == "adequate":
        return NOTHING
    return next(iter(named(diagnosis)), str(diagnosis["verdict"]))


def storey_right(result: BuildingScored) -> bool | None:
    """Whether the storey that lost stiffness is named; None where none did or no loss is named."""
    storeys = [fault.storey for fault in result.case.faults if fault.storey is not None]
    named = [
        cause["parameters"]["storey"]["value"]
        for cause in result.diagnosis["causes"]
        if cause["name"] == "storey_stiffness_loss"
    ]
    return storeys[0] in named if storeys and named else None


def all_named(result: BuildingScored) -> bool:
    """Whether every fault is among the causes."""
    return {fault.name for fault in result.case.faults} <= set(named(result.diagnosis))


def halved(result: BuildingScored) -> bool:
    """Whether the model that is offered at least halves the error on data held out."""
    before, after = (result.diagnosis[f"error_{k}"]["held_out"] for k in ("before", "after"))
    return bool(after <= 0.5 * before)


def described(result: BuildingScored) -> bool:
    """Whether an equation or a learned term is offered."""
    ladder = result.diagnosis.get("ladder")
    return ladder is not None and ladder["offered"] in ("equation", "learned")


def rates(results: Sequence[BuildingScored]) -> dict[str, Rate]:
    """Every rate, over the cases that it asks something of."""

    def rate(kind: str, hit: Callable[[BuildingScored], bool | None]) -> Rate:
        hits = [h for r in results if r.case.kind.startswith(kind) and (h := hit(r)) is not None]
        return Rate(sum(hits), len(hits))

    return {
        "single named first": rate("single", lambda r: answer(r.diagnosis) == r.case.forms[0][0]),
        "single named with nothing beside it": rate(
            "single", lambda r: named(r.diagnosis) == [r.case.forms[0][0]]
        ),
        "storey right where one lost stiffness": rate("", storey_right),
        "pair both named": rate("pair", all_named),
        "outside: an equation or a learned term offered": rate("outside", described),
        "outside: held-out error halved": rate("outside", halved),
        "cause named on clean records": rate("clean", lambda r: bool(named(r.diagnosis))),
        "clean records called inadequate": rate("clean", lambda r: answer(r.diagnosis) != NOTHING),
    }


def confusion_table(results: Sequence[BuildingScored]) -> str:
    """Markdown: for each single fault and size how often it came first, and what came instead."""
    table: dict[tuple[str, float], Counter[str]] = {}
    for r in results:
        if len(r.case.forms) <= 1 and r.case.kind != "outside":
            row = ".".join(r.case.forms[0]) if r.case.forms else r.case.kind
            table.setdefault((row, r.case.size), Counter())[answer(r.diagnosis)] += 1
    lines = ["| hidden | misfit | cases | right | named instead |", "|---|---|---|---|---|"]
    for (row, size), counts in sorted(table.items()):
        right = NOTHING if row == "clean" else row.partition(".")[0]
        wrong = ", ".join(f"{name} {n}" for name, n in counts.most_common() if name != right)
        lines.append(f"| {row} | {size:g} | {counts.total()} | {counts[right]} | {wrong} |")
    return "\n".join(lines)
