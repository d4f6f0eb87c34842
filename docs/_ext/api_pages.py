"""The API reference: a page for every package that offers names, from their docstrings."""

from __future__ import annotations

import ast
import importlib
import inspect
from pathlib import Path
from types import ModuleType

PACKAGES = (
    "isolation_sim",
    "isolation_sim.structures",
    "isolation_sim.laws",
    "isolation_sim.effects",
    "isolation_sim.scenario",
    "isolation_sim.simulation.batch",
    "isolation_sim.simulation.trajectory",
    "isolation_sim.simulation.ledger",
    "isolation_sim.criteria",
    "isolation_sim.identification.campaign",
    "isolation_sim.identification.fitted",
    "isolation_sim.identification.loop_curves",
    "isolation_sim.identification.loop_measures",
    "isolation_sim.identification.raw_tests.import_tests",
    "studies.swarm",
    "isolation_sim.discrepancy.diagnosis",
    "isolation_sim.discrepancy.building.raw_records.import_record",
    "isolation_sim.sweeps.suites",
    "isolation_sim.sweeps",
    "isolation_sim.reports.figures",
    "controllers",
    "controllers.clairvoyant",
    "controllers.observers",
    "ground_motions",
    "ground_motions.readers",
    "ground_motions.records",
)
"""Those whose ``__all__``, or all that they define, is documented."""


def write_pages(folder: Path) -> list[str]:
    """Write the pages.

    Parameters
    ----------
    folder : pathlib.Path
        Where to.

    Returns
    -------
    list of str
        Names of the packages.
    """
    folder.mkdir(parents=True, exist_ok=True)
    sentences: dict[int, str] = {}
    for name in PACKAGES:
        text = _page(importlib.import_module(name), sentences)
        (folder / f"{name}.rst").write_text(text, encoding="utf-8")
    return list(PACKAGES)


def _page(module: ModuleType, sentences: dict[int, str]) -> str:
    """A module's page; what another page has told already is referred to."""
    name = module.__name__
    lines = [name, "=" * len(name), "", f".. py:module:: {name}", "", _prose(module), ""]
    for one in offered(module):
        value = getattr(module, one)
        path = f"{name}.{one}"
        if not (inspect.isclass(value) or inspect.isroutine(value)):
            lines += [f".. py:data:: {path}", "", f"   {meaning(module, one)}", ""]
        elif id(value) in sentences:
            lines += [f"``{one}`` is :py:obj:`{sentences[id(value)]}`.", ""]
        elif inspect.isclass(value):
            lines += [f".. autoclass:: {path}", "   :members:", ""]
        else:
            lines += [f".. autofunction:: {path}", ""]
        sentences.setdefault(id(value), path)
    return "\n".join(lines)


def _prose(module: ModuleType) -> str:
    """A module's docstring as reStructuredText; what is indented stays as it is typed."""
    blocks = (inspect.getdoc(module) or "").split("\n\n")
    return "\n\n".join(f"::\n\n{b}" if b.startswith("    ") else b for b in blocks)


def offered(module: ModuleType) -> list[str]:
    """Return what a module offers: its ``__all__``, or the public names that it defines.

    Parameters
    ----------
    module : types.ModuleType
        The module.

    Returns
    -------
    list of str
    """
    named = getattr(module, "__all__", None)
    return list(named) if named is not None else [
        name for name, value in vars(module).items()
        if not name.startswith("_") and getattr(value, "__module__", "") == module.__name__
        and (inspect.isclass(value) or inspect.isroutine(value))
    ]  # fmt: skip


def meaning(module: ModuleType, name: str) -> str:
    """Return the text behind a constant, wherever in the package it is defined.

    Parameters
    ----------
    module : types.ModuleType
        Module that offers it.
    name : str
        The constant.

    Returns
    -------
    str
        Empty where there is none.
    """
    tree = ast.parse(inspect.getsource(module))
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and name in [one.name for one in node.names]:
            origin = importlib.import_module(f"{'.' * node.level}{node.module}", module.__package__)
            return meaning(origin, name)
    for node, after in zip(tree.body, tree.body[1:], strict=False):
        targets = getattr(node, "targets", [getattr(node, "target", None)])
        if name in [getattr(target, "id", None) for target in targets]:
            if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
                return " ".join(str(after.value.value).split())
    return ""
