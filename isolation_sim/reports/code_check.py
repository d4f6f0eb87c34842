"""Table of a code check, on the console, as JSON and as a page."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING

from ..code_check import DESIGN, MEMORY, CheckRow
from ..written_names import as_written, capital
from .html.page import Cell, Page, Picture, Prose, Row, Section, Table
from .style import svg_text

if TYPE_CHECKING:
    from rich.table import Table as ConsoleTable

    from ..structures import IsolatedStructure

HEADINGS = ("check", "case", "ASCE 7-22", "value", "limit", "passes")
STATEMENT = (
    "These checks help to assess a design. They are no certification. They do not replace the "
    f"text of the code or an engineer's judgement; {MEMORY}."
)


def passes_text(row: CheckRow) -> str:
    """Whether a check passes, as a word; a dash without a limit."""
    return {True: "yes", False: "NO", None: "-"}[row.passes]


def verdict(rows: Sequence[CheckRow]) -> list[str]:
    """Sentences with the numbers of passed checks, the failed checks, and the design values."""
    limited = [row for row in rows if row.passes is not None]
    failed = [row for row in limited if not row.passes]
    passed = len(limited) - len(failed)
    result = [f"{passed} of {len(limited)} checks with a limit pass, {len(failed)} do not."]
    result += [
        f"Not passed: {_of_case(row)}, {row.value}; expected: {row.limit}." for row in failed
    ]
    return result + [
        f"{capital(_of_case(row))}: {row.value}." for row in rows if row.clause == DESIGN
    ]


def _of_case(row: CheckRow) -> str:
    case = f" ({as_written(row.case)})" if row.case else ""
    return f"{row.subject.partition(':')[0]}{case}"


def console_table(rows: Sequence[CheckRow], title: str) -> ConsoleTable:
    """Table for the console."""
    from rich.padding import Padding
    from rich.table import Table as ConsoleTable

    table = ConsoleTable(
        title=title, caption=" ".join([*verdict(rows), STATEMENT]), box=None, caption_justify="left"
    )
    subject, case, *others = HEADINGS
    table.add_column(subject, overflow="fold", ratio=1)
    table.add_column(case, overflow="fold")
    for heading in others:
        table.add_column(heading, no_wrap=True)
    for group, some in groupby(rows, key=lambda row: row.group):
        table.add_section()
        table.add_row(group, style="bold")
        for row in some:
            cells = (as_written(row.case), row.clause, row.value, row.limit, passes_text(row))
            table.add_row(Padding(row.subject, (0, 0, 0, 2)), *cells)
    return table


def check_page(rows: Sequence[CheckRow], isolated: IsolatedStructure, name: str) -> Page:
    """Page with the table and a drawing of the structure."""
    from .drawing import structure_drawing

    lines = []
    for group, some in groupby(rows, key=lambda row: row.group):
        lines.append(Row(group))
        for row in some:
            clause = f"{row.clause}, from memory" if row.clause else ""
            limit = row.limit.replace(" ", "\N{NO-BREAK SPACE}")
            texts = (as_written(row.case), clause, row.value, limit, passes_text(row))
            lines.append(Row(row.subject, tuple(map(Cell, texts))))
    headings = tuple(heading[0].upper() + heading[1:] for heading in HEADINGS)
    checks = Table(
        "Checks in the manner of ASCE 7-22, chapter 17", headings, tuple(lines),
        note="A dash: no limit in the code, or no capacity given.",
    )  # fmt: skip
    sections = [
        Section(
            "Verdict", [Prose(tuple(verdict(rows)), "verdict"), Prose((STATEMENT,), "warning")]
        ),
        Section("Checks", [checks]),
        Section("Structure", [Picture("The structure", svg=svg_text(structure_drawing(isolated)))]),
    ]
    return Page(f"Code checks: {name}", isolated.structure.name, sections)
