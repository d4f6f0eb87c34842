"""The command ``isolation-sim list``."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from typing import Annotated, Any

import typer

from ground_motions.registry import Registry

from ..errors import InputError, check_name
from ..io.files import json_text
from .common_options import AsJson, examples

EXAMPLES = examples("isolation-sim list laws", "isolation-sim list controllers --json")

Rows = tuple[list[str], list[list[str]]]


def _usable(registry: Registry[Any]) -> Iterator[tuple[str, Any]]:
    """What a registry has, with a warning in place of what cannot be loaded."""
    for name in registry:
        try:
            yield name, registry[name]
        except InputError as error:
            print(f"warning: {error}", file=sys.stderr)


def _laws() -> Rows:
    from ..laws import LAWS, available_conditions, available_sets

    entries = []
    for name, law in _usable(LAWS):
        parameters = ", ".join(f"{q.name} ({q.unit})" for q in law.parameters)
        sets, conditions = list(available_sets(name)), available_conditions(name)
        if conditions:
            sets.append(f"{len(conditions)} single conditions (isolation-sim list sets)")
        directions = "biaxial" if law.plan else "uniaxial"
        directions += ", axial load" * (law.axial is not None)
        entries.append([name, law.title, directions, ", ".join(sets) or "none", parameters])
    headings = ["law", "title", "directions", "published sets, the default first", "parameters"]
    return headings, entries


def _sets() -> Rows:
    from ..laws import LAWS, available_conditions, available_sets, law

    entries = [
        [name, each, law(name, each).source]
        for name, _ in _usable(LAWS)
        for each in (*available_sets(name), *available_conditions(name))
    ]
    return ["law", "published set", "source"], entries


def _controllers() -> Rows:
    from ..registry import CONTROLLERS

    entries = []
    for name, kind in _usable(CONTROLLERS):
        settings = ", ".join(
            f"{key} ({setting.unit})" if setting.unit else key
            for key, setting in getattr(kind, "settings", {}).items()
        )
        said, *_ = (kind.__doc__ or "").strip().splitlines() or [""]
        entries.append([name, getattr(kind, "title", "") or said, settings])
    return ["controller", "title", "settings"], entries


def _records() -> Rows:
    from ground_motions import STANDARD_GRAVITY, available_records, load_record

    entries = []
    for name in available_records():
        record = load_record(name)
        size = f"{len(record)} points, {record.dt:g} s, {record.pga / STANDARD_GRAVITY:.5g} g"
        entries.append([name, size, record.source])
    return ["record", "size", "source"], entries


def _effects() -> Rows:
    from ..effects import EFFECTS

    entries = []
    for cause, forms in _usable(EFFECTS):
        for form in forms:
            parameters = ", ".join(f"{q.name} ({q.unit})" for q in form.parameters)
            entries.append([cause, form.form, form.title, parameters, form.source])
    return ["effect", "form", "title", "parameters", "source"], entries


def _criteria() -> Rows:
    from ..criteria import QUANTITIES
    from ..criterion import CRITERIA

    kinds = {"peak": "peak", "rms": "RMS"}
    entries = [
        [f"{kind}_{each.name}", f"{word} {each.label}", "smaller", "every run"]
        for kind, word in kinds.items()
        for each in QUANTITIES
    ]
    entries += [
        [one.name, one.label, one.better, CRITERIA.place(one.name)] for _, one in _usable(CRITERIA)
    ]
    return ["criterion", "label", "better", "place"], entries


def _readers() -> Rows:
    from ground_motions.readers import READERS

    from ..identification.raw_tests.files import TEST_READERS

    entries = []
    for what, readers in (("ground motion", READERS), ("test files", TEST_READERS)):
        for name, read in _usable(readers):
            words = (read.__doc__ or "").partition("\n")[0]
            entries.append([name, what, words, readers.place(name)])
    return ["suffix", "of", "files", "place"], entries


def _studies() -> Rows:
    from ..registry import COMMANDS, STUDIES

    entries = [[name, study.TITLE] for name, study in _usable(STUDIES)]
    if "study" in COMMANDS:  # studies with options of their own, such as papers
        for command in COMMANDS["study"].registered_commands:
            said, *_ = (command.callback.__doc__ or "").splitlines() or [""]
            entries.append([command.name or command.callback.__name__, said.rstrip(".")])
    return ["study", "title"], sorted(entries)


def _structures() -> Rows:
    from ..scenario.building import MatricesFile, PlanBuilding, ReferenceBuilding, ShearBuilding

    entries = []
    for kind in (ReferenceBuilding, ShearBuilding, PlanBuilding, MatricesFile):
        summary = (kind.__doc__ or "").splitlines()[0]
        keys = ", ".join(key for key in kind.model_fields if key != "kind")
        entries.append([kind.model_fields["kind"].default, summary, keys or "none"])
    return ["kind", "description", "keys of [structure]"], entries


SUBJECTS: dict[str, Callable[[], Rows]] = {
    "laws": _laws,
    "sets": _sets,
    "controllers": _controllers,
    "records": _records,
    "effects": _effects,
    "criteria": _criteria,
    "readers": _readers,
    "studies": _studies,
    "structures": _structures,
}
"""Headings and rows of each list."""


def list_names(
    subject: Annotated[
        str,
        typer.Argument(
            help="What to list.", metavar="|".join(SUBJECTS), autocompletion=lambda: list(SUBJECTS)
        ),
    ],
    as_json: AsJson = False,
) -> None:
    """List the names that a scenario may use."""
    from ..reports.tables import TextTable, standard_console

    check_name("subject", subject, SUBJECTS)
    headings, entries = SUBJECTS[subject]()
    if as_json:
        print(json_text([dict(zip(headings, entry, strict=True)) for entry in entries]))
        return
    if not entries:
        print(f"no {subject} yet")
        return
    keys = 2 if subject in ("effects", "sets") else 1
    standard_console().print(TextTable("", headings, entries, keys=keys))
