"""The report of a study: finding, tables and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from isolation_sim.reports.html.page import (
    Block,
    Facts,
    Page,
    Picture,
    Prose,
    Section,
    Table,
    is_number,
    text_rows,
)
from isolation_sim.reports.html.run_report import code_facts, versions
from isolation_sim.written_names import capital


def study_report(
    title: str,
    finding: Sequence[str],
    tables: Mapping[str, tuple[Sequence[str], Sequence[Sequence[str]]]],
    figures: Sequence[Path] = (),
    about: str = "",
    command: str = "",
    code: Mapping[str, str] | None = None,
) -> Page:
    """Report of a study."""
    pictures: list[Block] = [
        Picture(capital(path.stem.replace("_", " ")), path) for path in figures
    ]
    run = {"Study": title, "Command": command, **code_facts(code or {}), "Versions": versions()}
    parts: list[tuple[str, Sequence[Block]]] = [
        ("Finding", [Prose(tuple(finding), "verdict")]),
        ("Numbers", [_table(caption, *each) for caption, each in tables.items()]),
        ("Figures", pictures),
        ("Inputs and versions", [Facts({heading: text for heading, text in run.items() if text})]),
    ]
    return Page(title, capital(about), [Section(name, blocks) for name, blocks in parts if blocks])


def _table(caption: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """A table with filters for the columns of repeated words."""
    words = [
        heading
        for heading, column in zip(headings, zip(*rows, strict=True), strict=False)
        if 1 < len(set(column)) < len(column) and not any(map(is_number, column))
    ]
    return Table(caption, tuple(headings), text_rows(rows), filters=tuple(words))
