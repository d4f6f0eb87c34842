"""The cases of a plan by number, and the comparison of plans."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from ground_motions.registry import code_files, package_code

from ..errors import InputError, several
from ..scenario import Scenario
from ..scenario.job import with_place
from ..validation import names_in
from ..version import __version__
from .axes import MOST_CASES, Axis, axes_of
from .fields import Change, apply_changes, with_seed
from .plan import SweepPlan

_TRIED = 100  # cases that are built to find one that can be


@dataclass(frozen=True)
class CaseSpec:
    """One case: changes of a scenario, run with every controller."""

    number: int  # Place in the plan, from 0
    shown: dict[str, Any]  # Varied quantities for the table, by label
    changes: tuple[Change, ...]  # Changes of the scenario's data
    seed: int | None = None  # Seed of noise and random ground motion; None for the scenario's

    def data(self, base: dict[str, Any]) -> dict[str, Any]:
        """Return the case's scenario, as data."""
        data = apply_changes(base, self.changes)
        return data if self.seed is None else with_seed(data, self.seed)

    def scenario(self, base: dict[str, Any]) -> Scenario:
        """Return the case's scenario."""
        return Scenario(**self.data(base))


class Design:
    """All cases of a plan."""

    # source: File of the plan, for errors.

    def __init__(self, plan: SweepPlan, source: str = ""):
        self.plan = plan
        self.axes: list[Axis] = []  # Axes; the last one varies fastest
        try:
            # Data of the base scenario with all keys
            self.base = plan.scenario.model_dump(mode="json")
            for each in plan.vary:
                if each.fields == ("controller",):
                    self.base["controller"] = each.values
            scenario = Scenario(**self.base)
            self.base = scenario.model_dump(mode="json")
            # Labels of the controllers
            self.controllers = tuple(entry.shown for entry in scenario.controller)
            self.axes = axes_of(plan)
            if self.n_cases > MOST_CASES:
                sizes = " x ".join(str(len(axis)) for axis in self.axes)
                raise InputError(
                    f"{self.n_cases:,} cases ({sizes}); expected: up to {MOST_CASES:,}, or several "
                    "plans"
                )
            self._check_values()
            self._check_cases()
        except InputError as error:
            raise with_place(error, source) from None

    @property
    def n_cases(self) -> int:
        """Number of cases."""
        repetitions = self.plan.seeds.count if self.plan.seeds else 1
        return prod((len(axis) for axis in self.axes), start=repetitions)

    @property
    def n_runs(self) -> int:
        """Number of runs: cases times controllers."""
        return self.n_cases * len(self.controllers)

    def case(self, number: int) -> CaseSpec:
        """Return a case."""
        rest, places = number, []
        repetition = 0
        if self.plan.seeds:
            rest, repetition = divmod(rest, self.plan.seeds.count)
        for axis in reversed(self.axes):
            rest, k = divmod(rest, len(axis))
            places.append(k)
        shown: dict[str, Any] = {}
        changes: list[Change] = []
        for axis, k in zip(self.axes, reversed(places), strict=True):
            shown |= axis.shown(k)
            changes += axis.changes(k)
        if not self.plan.seeds:
            return CaseSpec(number, shown, tuple(changes))
        # from the contents of the case, not from its number
        content = sorted(_json([c.field, c.value, c.factor]) for c in changes)
        digest = hashlib.sha256(_json([self.plan.seeds.base, repetition, content]).encode())
        seed = int.from_bytes(digest.digest()[:4], "big")
        shown |= {"repetition": repetition, "seed": seed}
        return CaseSpec(number, shown, tuple(changes), seed)

    @cached_property
    def parameters(self) -> dict[str, type]:
        """Columns of the varied quantities, and their types: bool, int, float or str."""
        kinds: dict[str, type] = {}
        for axis in self.axes:
            for k in range(len(axis)):
                for label, value in axis.shown(k).items():
                    kinds[label] = _common(kinds.get(label), type(value))
        if self.plan.seeds:
            kinds |= {"repetition": int, "seed": int}
        return kinds

    def content(self) -> dict[str, Any]:
        """Return all inputs that determine the results, as data for JSON."""
        content = self.plan.model_dump(mode="json") | {"scenario": self.base}
        content["vary"] = [
            {key: value for key, value in each.items() if value is not None}
            for each in content["vary"]
        ]
        files = {path: _digest(path) for path in sorted(set(_files(content)))}
        names = list(self.names())
        files |= code_files(names) | package_code(names)
        return {"plan": content, "files": files, "software": f"isolation-sim {__version__}"}

    def names(self) -> Iterator[str]:
        """Registered names that the cases may use."""
        yield from names_in(self.base)
        for axis in self.axes:
            if isinstance(axis.points, np.ndarray):
                continue  # only numbers
            for k, quantity in enumerate(axis.quantities):
                column = [point[k] for point in axis.points]
                for field in quantity.fields:
                    yield from names_in(column, field.rpartition(".")[2])

    def _check_values(self) -> None:
        """Check every value, of a long file only some, and refuse all wrong ones in one message."""
        wrong: dict[str, Exception] = {}  # by the message: an unknown field gives one for all
        for axis in self.axes:
            for k in range(min(len(axis), 1000)):
                try:
                    self._varied(axis, k)
                except InputError as error:
                    # or is it a value of another axis?
                    if self._fails_alone(axis, k):
                        wrong.setdefault(str(error), with_place(error, _listed(axis.shown(k))))
        if wrong:
            raise several(f"{len(wrong)} values cannot be used", list(wrong.values()))

    def _fails_alone(self, axis: Axis, k: int) -> bool:
        """Whether a point is wrong with the scenario's own values, too."""
        try:
            Scenario(**apply_changes(self.base, axis.changes(k)))
        except InputError:
            return True
        return False

    def _check_cases(self) -> None:
        """Refuse a plan of which no case can be built, with the error of the first one."""
        # a case that cannot be built is a row of the table with its reason
        errors = []
        for number in range(min(self.n_cases, _TRIED)):
            case = self.case(number)
            try:
                case.scenario(self.base).build()
                return
            except InputError as error:
                errors.append(with_place(error, _listed(case.shown)))
        raise errors[0]

    def _varied(self, axis: Axis, k: int) -> Scenario:
        """Scenario of an axis's k-th point and the first points of the other axes."""
        others = (c for each in self.axes if each is not axis for c in each.changes(0))
        return Scenario(**apply_changes(self.base, (*others, *axis.changes(k))))

    def scenarios(self) -> Iterator[Scenario]:
        """Scenarios with all registered names of the cases; axes of numbers are skipped."""
        yield self.case(0).scenario(self.base)
        for axis in self.axes:
            if not isinstance(axis.points, np.ndarray):
                for k in range(min(len(axis), 1000)):
                    if any(isinstance(value, str) for value in axis.points[k]):
                        yield self._varied(axis, k)


def _listed(shown: dict[str, Any]) -> str:
    """Varied quantities of a case, for errors."""
    return ", ".join(f"{name} = {value!r}" for name, value in shown.items())


def _common(a: type | None, b: type) -> type:
    if a in (None, b):
        return b
    return float if {a, b} == {int, float} else str


def _json(value: Any) -> str:
    return json.dumps(value, sort_keys=True, separators=(",", ":"))


def _files(value: Any) -> Iterator[str]:
    """Yield the input files that a plan names."""
    if isinstance(value, dict):
        for key, each in value.items():
            if key.endswith("file") and isinstance(each, str):
                yield each
            yield from _files(each)
    elif isinstance(value, list):
        for each in value:
            yield from _files(each)


def _digest(path: str) -> str:
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError:
        return "not found"


def differences(stored: Any, now: Any, place: str = "") -> Iterator[str]:
    """Yield the differences of two plans' contents, one line per place."""
    if isinstance(stored, dict) and isinstance(now, dict):
        for key in {**stored, **now}:
            inner = f"{place}.{key}".removeprefix(".")
            yield from differences(stored.get(key), now.get(key), inner)
    elif isinstance(stored, list) and isinstance(now, list) and len(stored) == len(now):
        for k, (a, b) in enumerate(zip(stored, now, strict=True)):
            yield from differences(a, b, f"{place}[{k}]")
    elif stored != now:
        yield f"{place.removeprefix('plan.')} was {_short(stored)}, is {_short(now)}"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."
