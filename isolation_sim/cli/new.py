"""The command ``isolation-sim new``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .common_options import Force, examples, write_new_file

EXAMPLES = examples("isolation-sim new", "isolation-sim new my_scenario.toml --force")


def new(
    path: Annotated[Path, typer.Argument(help="File to write.")] = Path("scenario.toml"),
    force: Force = False,
) -> None:
    """Write a commented scenario as a starting point."""
    from ..scenario import Scenario

    write_new_file(path, Scenario(name=path.stem).to_toml(comments=True), force)
    print(f"wrote {path}; run it with: isolation-sim run {path}")
