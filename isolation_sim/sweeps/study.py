"""The results of a study, read from its folder."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ground_motions.argument_types import checked

from ..errors import InputError
from ..rendering import Printed, render

if TYPE_CHECKING:
    import pandas

    from .result import Sweep

FINDING = "finding.txt"


@checked
class Study(Printed):
    """Results of a study.

    Parameters
    ----------
    folder : str or pathlib.Path
        Folder that ``isolation-sim study`` wrote.

    Attributes
    ----------
    folder : pathlib.Path
        The folder.
    title : str
        The question.
    finding : str
        The answer, a paragraph per line.

    Raises
    ------
    InputError
        If there is no study.
    """

    def __init__(self, folder: str | Path):
        self.folder = Path(folder)
        try:
            text = (self.folder / FINDING).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            raise InputError(f"{folder}: no study; expected: a folder with {FINDING}") from None
        self.title, *paragraphs = text.rstrip("\n").split("\n\n")
        self.finding = "\n\n".join(p for p in paragraphs if not p.startswith("code: "))

    @cached_property
    def table(self) -> pandas.DataFrame:
        """One row per case; headings end in the SI unit; empty cells for missing numbers."""
        import pandas

        return pandas.read_csv(self.folder / "table.csv")

    @property
    def figures(self) -> dict[str, Path]:
        """Files of the figures (SVG), by name."""
        return {path.stem: path for path in sorted((self.folder / "figures").glob("*.svg"))}

    @property
    def sweep(self) -> Sweep | None:
        """The runs of the table; None if the study is not one sweep."""
        from .result import Sweep

        inside = self.folder / "sweep"
        return Sweep(inside) if inside.is_dir() else None

    def _shown(self) -> Iterator[Any]:
        rows = self.table.astype(object).where(self.table.notna(), None).to_dict("records")
        yield render("sweep_tables:study_table", rows, self.title)
        yield self.finding

    def __repr__(self) -> str:
        return f"Study({self.title} {len(self.table)} rows, {len(self.figures)} figures)"
