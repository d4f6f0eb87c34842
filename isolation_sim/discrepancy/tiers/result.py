"""The ladder of a diagnosis: how far each tier comes, on data fitted, held out and left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from ...io.files import plain
from ..interval import Interval

Tier = Literal["auto", "causes", "equation", "learned"]
TIERS: tuple[Tier, ...] = ("auto", "causes", "equation", "learned")


@dataclass(frozen=True)
class Rung:
    """One model of the ladder."""

    name: str  # "law", "causes", "equation" or "learned"
    # fit, held_out: RMS residual over RMS force of the fitted and of the held-out samples
    fit: float
    held_out: float
    left_out: float  # The same of each condition, predicted by the model fitted without it, pooled
    # Conditions left out, and runs held out, on which the model loses against the law
    worse: tuple[str, ...] = ()
    # Tests beyond whose range, at a larger motion, it runs away or gives energy back
    beyond: tuple[str, ...] = ()
    # Models before it that predict all that was left out, or all that was held out, better
    worse_than: tuple[str, ...] = ()

    @property
    def loses(self) -> bool:
        """Whether it loses anywhere, so that it is not offered."""
        return bool(self.worse or self.beyond or self.worse_than)


@dataclass(frozen=True)
class EquationTerm:
    """One term of an equation."""

    text: str  # The term, with its numbers' names
    stability: float  # Share of the conditions without which the term is chosen as well
    # Coefficients by power of the current, and the numbers inside, with 95 % intervals
    numbers: Mapping[str, Interval]

    @property
    def product(self) -> str:
        """The term with the names of its coefficients."""
        powers = [(name, int(name.rpartition("_")[2])) for name in self.numbers if name[0] == "c"]
        parts = [name + ("" if k == 0 else " I" if k == 1 else f" I^{k}") for name, k in powers]
        coefficient = parts[0] if len(parts) == 1 else f"({' + '.join(parts)})"
        return f"{coefficient} {self.text.partition(',')[0]}"


@dataclass(frozen=True)
class Ladder:
    """Law, causes, equation, learned term, and the attainable error."""

    rungs: tuple[Rung, ...]  # In the order of the tiers
    terms: tuple[EquationTerm, ...] = ()  # The equation; empty where none was found
    # File of the extended law, if a tier beyond the causes is offered; else empty
    law_text: str = ""
    offered: str = "causes"  # The rung whose law is offered
    # Smallest error of any rung, or of another law, on the validation data
    attainable: float = float("nan")
    # Share of the law's squared misfit that causes and equation leave and a flexible model of the
    # measured variables explains; not a number where none was fitted
    explainable: float = float("nan")
    inexplicable: float = float("nan")  # Share that nothing measured explains
    # Such as a rung that is not offered, and why
    notes: tuple[str, ...] = field(default_factory=tuple)
    quantity: str = "force"  # What errors are relative to
    better_law: str = ""  # Sentence that names a law with a greater gain than that of any rung

    @property
    def equation(self) -> str:
        """The equation with its numbers, one term a line; empty where none was found."""
        return "\n".join(
            f"{_coefficient(term)} · ({term.text}){_inside(term)}" for term in self.terms
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the ladder as plain numbers and text."""
        return plain({
            "rungs": self.rungs,
            "equation": [
                {"term": term.text, "stability": term.stability, "numbers": term.numbers}
                for term in self.terms
            ],
            "offered": self.offered,
            "attainable": self.attainable,
            "explainable_share": self.explainable,
            "inexplicable_share": self.inexplicable,
            "notes": self.notes,
            "better_law": self.better_law,
        })  # fmt: skip


def _coefficient(term: EquationTerm) -> str:
    """A polynomial of the current, with its sign."""
    parts = [
        ("+ " if n.value >= 0 else "")
        + f"{n.value:.4g} ({n.low:.3g} to {n.high:.3g}) {n.unit}"
        + (f" I^{power}" if int(power) > 1 else " I" if power == "1" else "")
        for name, n in term.numbers.items()
        if name.startswith("c") and (power := name.rpartition("_")[2])
    ]
    return parts[0] if len(parts) == 1 else f"+ ({' '.join(parts).removeprefix('+ ')})"


def _inside(term: EquationTerm) -> str:
    inside = [
        f"{name} = {n.value:.4g} ({n.low:.3g} to {n.high:.3g}) {n.unit}"
        for name, n in term.numbers.items()
        if not name.startswith("c")
    ]
    return f", {', '.join(inside)}" if inside else ""
