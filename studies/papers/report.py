"""The study as a page: every number and figure of the papers, to be read in a browser."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from isolation_sim.reports.html.page import Block, Cell, Page, Picture, Prose, Row, Section, Table

from .table import COLUMNS, Check, Claim, Comparison, Verdict, tally, texts


def report(papers: Sequence[tuple[str, list[Check], list[Path]]]) -> Page:
    """Page of the study."""
    every = [check for _, checks, _ in papers for check in checks]
    printed = [check for check in every if isinstance(check, Comparison | Claim)]
    good = sum(check.verdict in (Verdict.REPRODUCED, Verdict.WITHIN) for check in printed)
    first = (
        f"Of {len(printed)} printed numbers and statements that can be computed, {good} were "
        "reproduced."
    )
    sections = [Section("Verdict", [Prose((first, f"In all: {tally(every)}."), "verdict")])]
    for title, checks, figures in papers:
        blocks: list[Block] = [Prose((f"{tally(checks)}.",)), _table(title, checks)]
        blocks += [Picture(path.stem.replace("_", " "), path) for path in figures]
        sections.append(Section(title, blocks))
    return Page("What the papers' numbers are worth", "Recomputed by isolation-sim", sections)


def _table(title: str, checks: Sequence[Check]) -> Table:
    rows = []
    for check in checks:
        label, *cells = texts(check)
        rows.append(Row(label, tuple(Cell(text) for text in cells)))
    return Table(
        caption=f"Numbers of: {title}",
        headings=tuple(COLUMNS),
        rows=tuple(rows),
        filters=("verdict",),
    )
