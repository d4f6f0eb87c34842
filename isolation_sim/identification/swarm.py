"""Old name of ``studies.swarm``, the papers' searches; accepted until version 0.3."""

from importlib import import_module
from typing import Any

from ..old_names import note_renamed


def __getattr__(name: str) -> Any:
    value = getattr(import_module("studies.swarm"), name)
    note_renamed(__name__, "studies.swarm")
    return value
