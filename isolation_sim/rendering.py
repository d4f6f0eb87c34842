"""Calls of the reports by name, since the reports import the results."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import Any


def render(function: str, *arguments: Any, **options: Any) -> Any:
    """Call a function of ``isolation_sim.reports``, named as ``"module:function"``."""
    module, _, name = function.partition(":")
    return getattr(import_module(f"isolation_sim.reports.{module}"), name)(*arguments, **options)


class Printed:
    """Base of results: prints tables and sentences in a terminal and in a notebook."""

    def _shown(self) -> Iterable[Any]:
        """Tables and sentences, in the order of reading."""
        raise NotImplementedError

    def summary(self) -> str:
        """Return its tables and sentences as text; ``print(result)`` shows the same.

        Returns
        -------
        str
        """
        return "\n".join(
            each if isinstance(each, str) else render("tables:as_text", each)
            for each in self._shown()
        )

    def report(self) -> None:
        """Print its tables and sentences, in the width of the terminal."""
        console = render("tables:standard_console")
        for each in self._shown():
            console.print(each)

    def __str__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        return "".join(render("tables:as_html", each) for each in self._shown())
