"""Standard output as a console for tables and paragraphs."""

from __future__ import annotations

import sys

from rich.console import Console

from .tables import WIDTH


def standard_console(width: int = WIDTH) -> Console:
    """Console of the terminal's width; without a terminal ``width`` columns and no colours."""
    return Console(width=None if sys.stdout.isatty() else width, highlight=False, markup=False)
