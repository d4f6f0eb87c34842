"""Axes of a plan: values, ranges, samples and files of cases, each as a list of points."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, not_installed
from .fields import Change, with_defaults
from .plan import Sample, SweepPlan, Vary

MOST_CASES = 10_000_000
"""Largest number of cases of a plan, and of values of a quantity: some days of computing."""


@dataclass(frozen=True)
class Quantity:
    """A varied quantity of an axis."""

    label: str  # Heading of its column in the table
    fields: tuple[str, ...]  # Fields of the scenario that are set to the value
    factor: bool = False  # Whether the value multiplies the scenario's value
    # Text in the table for each value; None for the value itself
    shown: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Axis:
    """Points along one or several quantities that are varied together."""

    quantities: tuple[Quantity, ...]  # Varied quantities
    points: Sequence[Sequence[Any]] | NDArray  # One value per quantity at each point

    def __len__(self) -> int:
        return len(self.points)

    def changes(self, k: int) -> Iterator[Change]:
        """Yield the changes of the k-th point."""
        for quantity, value in zip(self.quantities, self._values(k), strict=True):
            for field in quantity.fields:
                yield Change(field, value, quantity.factor)

    def shown(self, k: int) -> dict[str, Any]:
        """Return the k-th point for the table, by label."""
        return {
            quantity.label: value if quantity.shown is None else quantity.shown[k]
            for quantity, value in zip(self.quantities, self._values(k), strict=True)
        }

    def _values(self, k: int) -> Sequence[Any]:
        point = self.points[k]
        return point.tolist() if isinstance(point, np.ndarray) else point


def axes_of(plan: SweepPlan) -> list[Axis]:
    """Axes of a plan in its order; a file of cases is first, a sample at its first quantity."""
    axes = [] if plan.cases is None else [_file_axis(plan.cases.file)]
    sampled = [each for each in plan.vary if each.sampled]
    for each in plan.vary:
        if each.fields == ("controller",):
            continue
        if not each.sampled:
            axes.append(_axis(each))
        elif each is sampled[0]:
            assert plan.sample is not None
            quantities = tuple(Quantity(label_of(one), one.fields, one.factor) for one in sampled)
            axes.append(Axis(quantities, sample_of(plan.sample, sampled)))
    labels = [quantity.label for axis in axes for quantity in axis.quantities]
    for label in labels:
        if labels.count(label) > 1:
            raise InputError(f"{label} is varied twice; expected: another field or label")
    return axes


def label_of(vary: Vary) -> str:
    """Name of a varied quantity in the table: its label, or its first field."""
    return vary.label or vary.fields[0]


def _axis(vary: Vary) -> Axis:
    if vary.values is not None:
        values = vary.values
        shown = _shown(values) if vary.names is None else tuple(vary.names)
    else:
        assert vary.low is not None and vary.high is not None
        shown = None
        if vary.step is not None:
            exact = (vary.high - vary.low) / vary.step * (1 + 1e-12) + 1e-9
            _few_enough(exact, f"{label_of(vary)}: step {vary.step:g}")
            count = int(np.floor(exact)) + 1
            values = (vary.low + vary.step * np.arange(count)).tolist()
        else:
            _few_enough(vary.count or 2, f"{label_of(vary)}: count {vary.count}")
            space = np.geomspace if vary.spacing == "log" else np.linspace
            values = space(vary.low, vary.high, vary.count or 2).tolist()
    quantity = Quantity(label_of(vary), vary.fields, vary.factor, shown)
    return Axis((quantity,), [(value,) for value in values])


def _few_enough(count: float, subject: str) -> None:
    if count > MOST_CASES:
        raise InputError(f"{subject} makes {count:.3g} values; expected: up to {MOST_CASES:,}")


def _shown(values: Sequence[Any]) -> tuple[str, ...] | None:
    """Names of values that do not fit in a table, and of files; None for other values."""
    if values and all(isinstance(value, str) and Path(value).is_absolute() for value in values):
        names = tuple(Path(value).stem for value in values)
        return names if len(set(names)) == len(set(values)) else None
    if all(isinstance(value, bool | int | float | str) for value in values):
        return None
    return tuple(map(_name_of, values))


def _name_of(value: Any) -> str:
    if isinstance(value, dict):
        for key in ("label", "name", "file", "law", "kind"):
            if isinstance(value.get(key), str):
                return Path(value[key]).stem if key == "file" else value[key]
    if isinstance(value, list) and any(isinstance(each, dict) for each in value):
        return ", ".join(map(_name_of, value))
    return value if isinstance(value, str) else json.dumps(value)


def problem_of(sampled: Sequence[Vary]) -> dict[str, Any]:
    """Describe a sample for SALib; with log spacing it samples and analyses the logarithm."""
    return {
        "num_vars": len(sampled),
        "names": [label_of(each) for each in sampled],
        "bounds": [list(each.scaled_limits) for each in sampled],
    }


def sample_of(sample: Sample, sampled: Sequence[Vary]) -> NDArray:
    """Draw a sample."""
    _few_enough(sample.count, f"sample.count {sample.count}")
    if sample.method in ("sobol", "saltelli") and sample.count & (sample.count - 1):
        raise InputError(
            "sample.count",
            f"{sample.count}, with {sample.method}",
            f"a power of 2, such as {1 << sample.count.bit_length()}",
        )
    problem = problem_of(sampled)
    low, high = np.array(problem["bounds"]).T
    if sample.method in ("saltelli", "morris"):
        points = _salib_sample(sample, problem)
    else:
        from scipy.stats import qmc

        kind = qmc.LatinHypercube if sample.method == "latin_hypercube" else qmc.Sobol
        unit = kind(len(sampled), seed=sample.seed).random(sample.count)
        points = low + unit * (high - low)
    for column, each in zip(points.T, sampled, strict=True):
        if each.spacing == "log":
            column[:] = np.exp(column)
        # rounding in exp(log(x)) may leave the limits by one bit
        np.clip(column, each.low, each.high, out=column)
    return points


def _salib_sample(sample: Sample, problem: dict[str, Any]) -> NDArray:
    try:
        from SALib.sample import morris, sobol
    except ImportError:
        raise not_installed(f"sample.method {sample.method!r}", "SALib", "sweeps") from None
    if sample.method == "morris":
        return morris.sample(problem, sample.count, seed=sample.seed)
    return sobol.sample(problem, sample.count, calc_second_order=False, seed=sample.seed)


def _file_axis(path: Path) -> Axis:
    try:
        with path.open(newline="", encoding="utf-8") as file:
            header, *rows = [row for row in csv.reader(file) if row]
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8"
        raise InputError(f"{path}: cannot be read ({reason}); expected: CSV") from None
    except ValueError:
        raise InputError(
            f"{path}: empty; expected: a heading of fields and one row per case"
        ) from None
    if not rows:
        raise InputError(f"{path}: no cases; expected: one row per case below the heading")
    names = [name.strip() for name in header]
    for k, row in enumerate(rows):
        if len(row) != len(names):
            raise InputError(
                f"{path}: row {k + 2} has {len(row)} entries; expected: {len(names)}, as the "
                "heading"
            )
    columns = [
        [
            with_defaults(name, value, path.parent)
            for value in _typed([row[c].strip() for row in rows])
        ]
        for c, name in enumerate(names)
    ]
    quantities = tuple(
        Quantity(name, (name,), shown=_shown(column))
        for name, column in zip(names, columns, strict=True)
    )
    return Axis(quantities, list(zip(*columns, strict=True)))


def _typed(column: list[str]) -> Sequence[Any]:
    """Integers if all entries are integers, numbers if all are numbers, otherwise text."""
    for kind in (int, float):
        try:
            return [kind(entry) for entry in column]
        except ValueError:
            continue
    return column
