"""How results call the reports: by name, since the reports stand on top of the results."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def render(function: str, *arguments: Any, **options: Any) -> Any:
    """Call a function of ``isolation_sim.reports``, named as ``"module:function"``."""
    module, _, name = function.partition(":")
    return getattr(import_module(f"isolation_sim.reports.{module}"), name)(*arguments, **options)
