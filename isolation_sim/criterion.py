"""Criteria that are selected by name, each one number of a run; and their registry."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from ground_motions.argument_types import shown
from ground_motions.registry import Registry

from .errors import InputError, line_within, unknown_name

BETTER = ("smaller", "larger", "neither")
_OF_TABLES = re.compile(r"J[1-9]|(normalised|energy)_.*|controller|case|status|reason")
"""Names of the ratios to a reference, of energies, and of other columns of tables."""


@dataclass(frozen=True)
class Criterion:
    """A criterion: one number of a run, beside the peaks and RMS values that every run has.

    Attributes
    ----------
    name : str
        Name in tables of numbers, with the SI unit at its end, such as ``"isolator_travel_m"``.
    label : str
        Name in tables for readers, without unit, such as ``"travel of the isolators"``.
    of : callable
        ``of(run)`` -> the number, in the unit of the name, of a
        `isolation_sim.simulation.result.Run`.
    better : {"smaller", "larger", "neither"}
        Which of two numbers is better, for the marks of tables.

    Raises
    ------
    InputError
        If the name is no name or that of a ratio or another column of tables, such as ``"J1"`` or
        ``"normalised_travel"``, or ``of`` or ``better`` cannot be used.
    """

    name: str
    label: str
    of: Callable[[Any], float]
    better: Literal["smaller", "larger", "neither"] = "smaller"

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and self.name.isidentifier()):
            raise InputError("name of a criterion", repr(self.name), "such as 'isolator_travel_m'")
        if _OF_TABLES.fullmatch(self.name):
            raise InputError(
                f"criterion {self.name} is a column of every table; expected: another name, not J1 "
                "to J9 and not beginning with normalised_ or energy_"
            )
        if not callable(self.of):
            raise InputError(f"{self.name}: of", repr(self.of), "a function of a run")
        if self.better not in BETTER:
            raise InputError(f"{self.name}: better", repr(self.better), ", ".join(BETTER))

    def value(self, run: Any) -> float:
        """Return the criterion of a run.

        Parameters
        ----------
        run : Run
            A run.

        Returns
        -------
        float
            In the unit of the name.

        Raises
        ------
        InputError
            If the function fails or does not return one number.
        """
        try:
            result = self.of(run)
        except Exception as error:
            kind = "" if isinstance(error, InputError) else f"{type(error).__name__}: "
            line = line_within(getattr(self.of, "__module__", ""), error) if kind else ""
            raise InputError(
                f"criterion {self.name}, run {run.controller}: {kind}{error}{line}"
            ) from error
        try:
            return float(result)
        except (TypeError, ValueError):
            raise InputError(
                f"criterion {self.name} of run {run.controller}", shown(result), "a number"
            ) from None


CRITERIA: Registry[Criterion] = Registry(
    "isolation_sim.criteria",
    "criterion",
    "an isolation_sim.Criterion",
    lambda result: result if isinstance(result, Criterion) else None,
    lambda criterion: criterion.name,
)
"""Criteria that can be selected beside the peaks and RMS values, by name or by place."""

_SELECTED: dict[str, Criterion] = {}
"""The criteria that were selected in this process, for the labels of tables."""


def selected_criteria(criteria: Sequence[str | Criterion]) -> tuple[Criterion, ...]:
    """Criteria by names, places or themselves; refuses two of one name."""
    if isinstance(criteria, str | Criterion):
        criteria = (criteria,)
    result = tuple(one if isinstance(one, Criterion) else CRITERIA[one] for one in criteria)
    names = [one.name for one in result]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"criterion {name} is selected twice; expected: once")
    _SELECTED.update(zip(names, result, strict=True))
    return result


def known_criterion(name: str) -> Criterion | None:
    """The criterion of a name, if it was selected in this process or a package declares it."""
    return _SELECTED.get(name) or CRITERIA.get(name)


def labels_of(criteria: Iterable[Criterion]) -> list[list[str]]:
    """Criteria as results save them, for `saved_criterion`."""
    return [[one.name, one.label, one.better] for one in criteria]


def saved_criterion(name: str, label: str, better: Any) -> Criterion:
    """The criterion of a saved result, with its label; without its function where unknown."""

    def of(run: Any) -> float:
        raise InputError(
            f"criterion {name} is of a saved result; expected: the one of your program"
        )

    one = known_criterion(name) or Criterion(name, label, of, better)
    return _SELECTED.setdefault(name, one)


class Criteria(dict[str, float]):
    """Criteria by name, SI units; the error for an unknown name contains the nearest one."""

    def __missing__(self, name: str) -> float:
        if "J1" not in self and re.fullmatch(r"J[1-9]|normalised_\w+", str(name)):
            raise InputError(
                f"criterion {name!r} is a ratio to the run without current; expected: compare() "
                "with passive_off among the controllers"
            )
        raise unknown_name("criterion", str(name), self)
