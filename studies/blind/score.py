"""Diagnoses against truths: confusion matrix and rates.

A diagnosis is the dictionary that ``isolation-sim diagnose --json`` prints. Rates are strict: a
cause that is only listed as confusable does not count as named.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from .cases import CATALOGUE, Truth

NOTHING, ELSEWHERE = "nothing", "outside the catalogue"
_ALIASES = {
    "x": ("x", "displacement", "deformation", "position"),
    "v": ("v", "velocity"),
    "a": ("a", "acceleration"),
    "I": ("I", "current"),
    "t": ("t", "time", "frequency"),
    "T": ("T", "temperature"),
    "history": ("history", "past", "largest_deformation"),
}
_CANONICAL = {alias: name for name, aliases in _ALIASES.items() for alias in aliases}

# forms whose severity is a physical parameter that any right form must have: unit in SI
_MEASURABLE = {
    ("force_offset", "same_everywhere"): "N",
    ("inertia_force", "plate"): "kg",
    ("inertia_force", "on_a_mount"): "kg",
    ("sensor_delay", "late_channel"): "s",
    ("sensor_delay", "shifted"): "s",
}


@dataclass(frozen=True)
class Scored:
    """One case's kind and truth, the diagnosis, and the true form's held-out error."""

    kind: str
    truth: Truth
    diagnosis: dict
    true_form_error: float


@dataclass(frozen=True)
class Rate:
    """A share of cases with Wilson's 95 % interval."""

    hits: int
    cases: int

    @property
    def value(self) -> float:
        """Share, nan without cases."""
        return self.hits / self.cases if self.cases else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's interval at 95 %."""
        if not self.cases:
            return 0.0, 1.0
        z, n, p = 1.959964, self.cases, self.value
        middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
        half = z * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2)) / (1 + z**2 / n)
        return float(max(0.0, middle - half)), float(min(1.0, middle + half))

    def __str__(self) -> str:
        low, high = self.interval
        return f"{self.value:.1%} ({self.hits} of {self.cases}; {low:.1%} to {high:.1%})"


def named(diagnosis: dict) -> list[str]:
    """Names of the causes, in order."""
    return [cause["name"] for cause in diagnosis["causes"]]


def answer(diagnosis: dict) -> str:
    """First cause named, or that nothing is wrong, or that it is outside the catalogue."""
    if diagnosis["verdict"] == "adequate":
        return NOTHING
    causes = [name for name in named(diagnosis) if name in CATALOGUE]
    return causes[0] if causes else ELSEWHERE


def named_first(result: Scored) -> bool:
    """Whether the single hidden effect is the first cause."""
    return answer(result.diagnosis) == result.truth.effects[0]


def all_named(result: Scored) -> bool:
    """Whether every hidden effect is among the causes."""
    return set(result.truth.effects) <= set(named(result.diagnosis))


def exact_set(result: Scored) -> bool:
    """Whether the causes are the hidden effects, and nothing beside them."""
    return set(result.truth.effects) == set(named(result.diagnosis))


def false_alarm(result: Scored) -> bool:
    """Whether something is said to be wrong."""
    return answer(result.diagnosis) != NOTHING


def noticed_not_blamed(result: Scored) -> bool:
    """Whether the misfit was noticed and no effect of the catalogue blamed for it."""
    return answer(result.diagnosis) == ELSEWHERE


def variables_named(result: Scored) -> bool:
    """Whether the true variables are named, with at most one that has no part in it."""
    stated = {_CANONICAL.get(v, v) for v in result.diagnosis["depends_on"]}
    strangers = stated - result.truth.depends_on - result.truth.tolerated
    return result.truth.depends_on <= stated and len(strangers) <= 1


def covered(result: Scored) -> bool | None:
    """Whether the interval of the parameter with a physical meaning holds the true value.

    None if the form has no such parameter or the effect is not named. Signs are not compared: the
    truth's severity is a magnitude.
    """
    (effect, *_), (form, *_) = result.truth.effects, result.truth.forms
    unit = _MEASURABLE.get((effect, form))
    causes = [c for c in result.diagnosis["causes"] if c["name"] == effect]
    if unit is None or not causes:
        return None
    fitting = [p for p in causes[0]["parameters"].values() if p["unit"] == unit]
    if len(fitting) != 1:
        return None
    (value,), low, high = result.truth.severities, fitting[0]["low"], fitting[0]["high"]
    return any(low <= side * value <= high for side in (1, -1))


def held_out_ratio(result: Scored) -> float:
    """Held-out error after extension over the true form's."""
    return float(result.diagnosis["error_after"]["held_out"] / result.true_form_error)


def rates(results: Sequence[Scored]) -> dict[str, Rate]:
    """Every rate that the issue asks for, over the cases of its kind."""

    def rate(kinds: Iterable[str], hit: Callable[[Scored], bool | None]) -> Rate:
        hits = [h for r in results if r.kind in kinds and (h := hit(r)) is not None]
        return Rate(sum(hits), len(hits))

    return {
        "single named first": rate(["single"], named_first),
        "single named, nothing beside it": rate(["single"], exact_set),
        "pair both named": rate(["pair"], all_named),
        "pair named, nothing beside it": rate(["pair"], exact_set),
        "triple all named": rate(["triple"], all_named),
        "false alarm on clean data": rate(["clean"], false_alarm),
        "outside not blamed on the catalogue": rate(["outside"], noticed_not_blamed),
        "outside's variables named": rate(["outside"], variables_named),
        "wrong law noticed": rate(["wrong_law"], false_alarm),
        "intervals that cover": rate(["single"], covered),
    }


def median_held_out_ratio(results: Sequence[Scored], kinds=("single", "pair", "triple")) -> float:
    """Median over the cases in which something of the catalogue is hidden."""
    return float(np.median([held_out_ratio(r) for r in results if r.kind in kinds]))


def confusion(results: Sequence[Scored]) -> dict[str, Counter[str]]:
    """Row: the single effect hidden (or nothing); counts: what was named first."""
    table: dict[str, Counter[str]] = {}
    for r in results:
        if len(r.truth.effects) <= 1:
            row = r.truth.effects[0] if r.truth.effects else r.kind
            table.setdefault(row, Counter())[answer(r.diagnosis)] += 1
    return table


def confusion_table(results: Sequence[Scored]) -> str:
    """The confusion matrix as Markdown: each row's right answers, then the wrong ones by name."""
    lines = ["| hidden | cases | right | named instead |", "|---|---|---|---|"]
    for row, counts in sorted(confusion(results).items()):
        right = NOTHING if row == "clean" else ELSEWHERE if row.startswith("outside:") else row
        wrong = ", ".join(f"{name} {n}" for name, n in counts.most_common() if name != right)
        lines.append(f"| {row} | {counts.total()} | {counts[right]} | {wrong} |")
    return "\n".join(lines)
