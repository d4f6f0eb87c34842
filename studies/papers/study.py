"""The whole study: every paper's numbers and figures, written to a folder and a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType

from isolation_sim.io.csv_table import write_table
from isolation_sim.io.results_folder import ResultsFolder, write_contents
from isolation_sim.reports.html.page import Block, Page, Picture, Prose, Section, Table
from isolation_sim.reports.style import save

from . import figures_000, figures_001, figures_002, paper_000, paper_001, paper_002, paper_003
from .table import Check, Claim, PrintedNumber, Verdict, layout, tally

PAPERS: dict[str, tuple[ModuleType, ModuleType]] = {
    "paper_000": (paper_000, figures_000),
    "paper_001": (paper_001, figures_001),
    "paper_002": (paper_002, figures_002),
    "paper_003": (paper_003, paper_003),
}
"""By paper: the module with ``TITLE`` and ``checks``, and the one with ``figures``."""


def reproduce(
    out: str | Path = "results/papers",
    figures: bool = True,
    short: bool = False,
    show: Callable[[str, list[Check]], None] = lambda title, checks: None,
    overwrite: bool = False,
) -> Path:
    """Recompute every checkable number of the papers and draw their figures."""
    parts: list[tuple[str, list[Check], list[Path]]] = []
    with ResultsFolder(out, overwrite) as folder:
        for name, (paper, drawings) in PAPERS.items():
            checks: list[Check] = paper.checks(short)
            show(paper.TITLE, checks)
            write_table([check.record() for check in checks], folder.unfinished / f"{name}.csv")
            drawn = drawings.figures().items() if figures else ()
            files = [save(each, folder.unfinished / "figures", stem) for stem, each in drawn]
            parts.append((paper.TITLE, checks, [svg for svg, _ in files]))
        report(parts).write(folder.unfinished / "report.html")
        write_contents(folder.unfinished, "Numbers and figures of the papers")
    return folder.path


def report(papers: Sequence[tuple[str, list[Check], list[Path]]]) -> Page:
    """Page of the study."""
    every = [check for _, checks, _ in papers for check in checks]
    printed = [check for check in every if isinstance(check, PrintedNumber | Claim)]
    good = sum(check.verdict in (Verdict.REPRODUCED, Verdict.WITHIN) for check in printed)
    first = (
        f"Of {len(printed)} printed numbers and statements that can be computed, {good} were "
        "reproduced."
    )
    sections = [Section("Verdict", [Prose((first, f"In all: {tally(every)}."), "verdict")])]
    for title, checks, figures in papers:
        numbers = Table.of(
            layout(title, checks), f"Numbers of: {title}", note="", filters=("Verdict",)
        )
        blocks: list[Block] = [Prose((f"{tally(checks)}.",)), numbers]
        blocks += [Picture(path.stem.replace("_", " "), path) for path in figures]
        sections.append(Section(title, blocks))
    return Page("What the papers' numbers are worth", "Recomputed by isolation-sim", sections)
