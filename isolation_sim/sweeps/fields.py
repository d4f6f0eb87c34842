"""Fields of a scenario by name, such as ``isolator.force_scale``, and their changes in a case."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ground_motions.old_names import renamed_value
from ground_motions.registry import absolute_place

from ..errors import InputError, unknown_name

_STEP = re.compile(r"([^.\[\]]+)((?:\[\d+\])*)")

_NAMED_BY = {"ground": "name", "controller": "name", "isolator": "law"}

Step = str | int


@dataclass(frozen=True)
class Change:
    """Change of one field in a case."""

    # Keys joined by dots; ``[k]`` picks an item of a list. Without it all items change
    field: str
    value: Any  # The field's value, or its factor
    factor: bool = False  # Whether the value multiplies the scenario's value

    def new(self, old: Any) -> Any:
        """Return the field's new value."""
        return _times(self.field, old, self.value) if self.factor else self.value


@lru_cache(maxsize=1024)
def steps_of(field: str) -> tuple[Step, ...]:
    """Split a field's name into keys and indices."""
    steps: list[Step] = []
    for part in field.split("."):
        match = _STEP.fullmatch(part)
        if match is None:
            raise InputError(
                f"field {field!r} cannot be read; expected: keys joined by dots, such as "
                "isolator.force_scale or controller[1].amperes"
            )
        name = match[1] if steps else renamed_value("field", match[1], belief="nominal")
        steps.append(name)
        steps += [int(number) for number in re.findall(r"\d+", match[2])]
    return tuple(steps)


def apply_changes(data: dict[str, Any], changes: Iterable[Change]) -> dict[str, Any]:
    """Apply changes to a scenario's data."""
    for change in sorted(changes, key=lambda each: len(steps_of(each.field))):
        data = _put(data, steps_of(change.field), change.new, ())
    return data


def with_defaults(field: str, value: Any, folder: str | Path) -> Any:
    """Fill in the defaults of a value, so that its keys can be changed, too."""
    from ..scenario import Scenario
    from ..validation import NAMING

    name, *rest = steps_of(field)
    if isinstance(value, str) and str((name, *rest)[-1]).endswith("file"):
        return str((Path(folder) / Path(value).expanduser()).resolve())
    if isinstance(value, str) and rest and rest[-1] in NAMING:
        return absolute_place(value, folder)
    if name not in Scenario.model_fields or any(isinstance(step, str) for step in rest):
        return value
    if isinstance(value, str) and name in _NAMED_BY:
        value = {_NAMED_BY[name]: value}
    if not isinstance(value, dict | list):
        return value
    alone = isinstance(value, dict) and name in ("ground", "controller", "element")
    entry = {name: [value] if alone else value}
    data = Scenario.model_validate(entry, context={"folder": folder}).model_dump(mode="json")
    return data[name][0] if rest or (name == "controller" and alone) else data[name]


def with_seed(data: dict[str, Any], seed: int) -> dict[str, Any]:
    """Set every seed of a scenario."""
    ground = [
        {**motion, "seed": seed + k} if "seed" in motion else motion
        for k, motion in enumerate(data["ground"])
    ]
    return {**data, "ground": ground, "sensors": {**data["sensors"], "seed": seed}}


def _put(value: Any, steps: tuple[Step, ...], new: Callable[[Any], Any], place: tuple) -> Any:
    """Return a value in which the part at the steps is replaced."""
    if not steps:
        return new(value)
    step, rest = steps[0], steps[1:]
    if isinstance(value, list):
        if not isinstance(step, int):
            if not value:
                raise InputError(f"field {_dotted(place)}: is not in the scenario")
            # without an index all items change; the one that cannot is named
            many = len(value) > 1
            return [
                _put(each, steps, new, (*place, k) if many else place)
                for k, each in enumerate(value)
            ]
        if step >= len(value):
            raise InputError(
                f"field {_dotted((*place, step))}: the scenario has {len(value)}, counted from 0"
            )
        return [
            _put(each, rest, new, (*place, k)) if k == step else each
            for k, each in enumerate(value)
        ]
    if not isinstance(value, dict) or isinstance(step, int):
        raise InputError(f"field {_dotted((*place, step))}: {_dotted(place)} has no such part")
    inner = _with_default(value, step, place)
    if not inner:
        raise InputError(
            f"field {_dotted((*place, step))}: {_dotted(place)} has no keys; expected: the "
            "number of an item that has this key, in brackets"
        )
    if step not in inner:
        raise unknown_name("field", _dotted((*place, step)), (_dotted((*place, k)) for k in inner))
    put = {**inner, step: _put(inner[step], rest, new, (*place, step))}
    if "settings" in value and step not in ("name", "label"):
        return {**value, "settings": {k: put[k] for k in {**value["settings"], step: None}}}
    if step == "parameters" and rest and not isinstance(value[step], dict):
        # missing parameters are those of the law's published set
        put[step] = {rest[0]: put[step][rest[0]]}
    return put


def _with_default(value: dict[str, Any], step: str, place: tuple) -> dict[str, Any]:
    """Return a table with the default of a key that the scenario leaves out."""
    if not place and step == "nominal" and value["nominal"] is None:
        from ..scenario.devices import NominalModel

        return {**value, "nominal": NominalModel().model_dump(mode="json")}
    if "settings" in value:
        from ..registry import CONTROLLERS

        declared = getattr(CONTROLLERS[value["name"]], "settings", {})
        defaults = {name: setting.default for name, setting in declared.items()}
        return {**value, **defaults, **value["settings"]}
    if place[-1:] == ("noise",):
        # every name may have noise; the run refuses names that are no output
        return {step: None, **value}
    if step == "parameters" and not isinstance(value["parameters"], dict):
        return {**value, "parameters": _published(value, place)}
    return value


def _published(device: dict[str, Any], place: tuple) -> dict[str, Any]:
    """Return the parameters of a section's published set, ascending powers of the current."""
    from ..laws import available_sets, law

    name, chosen = device["law"], device["parameters"]
    if name is None or (chosen is not None and chosen != available_sets(name)[0]):
        raise InputError(
            f"field {_dotted((*place, 'parameters'))}: single parameters of the set {chosen!r} "
            "cannot be changed; expected: a scenario with the law and its parameters"
        )
    current = law(name, chosen).current
    if len(current.coefficients) > 1:
        return dict.fromkeys(current.names)
    return {
        key: np.trim_zeros(row, "b").tolist() or [0.0]
        for key, row in zip(current.names, current.coefficients[0], strict=True)
    }


def _times(field: str, old: Any, factor: Any) -> Any:
    if isinstance(old, list):
        return [_times(field, each, factor) for each in old]
    if isinstance(old, bool) or not isinstance(old, int | float):
        raise InputError(
            f"field {field}: {old!r} cannot be multiplied; expected: factor = false, or a scenario "
            "that gives it a number"
        )
    return old * factor


def _dotted(place: tuple) -> str:
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in place)
    return text.lstrip(".")
