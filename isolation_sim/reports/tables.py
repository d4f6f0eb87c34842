"""Tables for the terminal, in engineering units."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from ..criteria import QUANTITIES
from ..criterion import known_criterion
from ..written_names import as_written, number_text
from .units import ending_of, unit_of

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions
    from rich.table import Table

    from ..simulation.result import Run

WIDTH = 100
"""Width of the terminal for which the tables are formatted, characters."""


class Row(NamedTuple):
    """One row of the table."""

    key: str  # Criterion or energy; ends in the SI unit
    label: str  # Text to print
    # Selects the best of several values; None if no value is better than another
    best: Callable[[list[float]], float] | None = min


_FURTHER = "Further"
_GROUPS = {
    "Peak": [Row(f"peak_{each.name}", each.label) for each in QUANTITIES],
    "RMS": [Row(f"rms_{each.name}", each.label) for each in QUANTITIES],
    _FURTHER: [],  # those that were selected
    "Benchmark": [
        Row("J1", "J1 peak base shear"),
        Row("J2", "J2 peak structural shear"),
        Row("J3", "J3 peak isolator displacement"),
        Row("J4", "J4 peak storey drift ratio"),
        Row("J5", "J5 peak floor acceleration"),
        Row("J6", "J6 control device / base shear"),
        Row("J7", "J7 RMS isolator displacement"),
        Row("J8", "J8 RMS floor acceleration"),
        Row("J9", "J9 control work / input energy", max),
    ],
    # energies have no best value
    "Energy at the end": [
        Row("input_J", "input", None),
        Row("field_work_J", "field work", None),
        Row("device_dissipation_J", "dissipated by all elements", None),
        Row("structural_damping_J", "dissipated by structure", None),
        Row("device_stored_J", "stored in all elements", None),
        Row("strain_J", "strain", None),
        Row("kinetic_J", "kinetic", None),
        Row("closure_error", "closure error / peak input", None),
    ],
}


_LABELS = (
    {f"{key}_{each.name}": f"{word} {each.label}"
     for key, word in (("peak", "peak"), ("rms", "RMS")) for each in QUANTITIES}
    | {row.key: row.label for row in _GROUPS["Benchmark"]}
)  # fmt: skip


RATIOS = frozenset(row.key for row in _GROUPS["Benchmark"])
"""Criteria that refer to the run without current, J1 to J9."""


def title_of(criterion: str) -> str:
    """A criterion in words, without its unit, as in the table of a run."""
    if criterion in _LABELS:
        return _LABELS[criterion]
    one = known_criterion(criterion)
    if one is not None:
        return one.label
    # a ratio, or of a result that another process saved
    return criterion.removesuffix(f"_{ending_of(criterion)}").replace("_", " ")


class WideTable:
    """A table that is split into parts, one below the other, to fit the console's width."""

    def __init__(self, names: Sequence[str], part: Callable[[Sequence[str]], Table]):
        self._names, self._part = list(names), part

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Any]:
        from rich.measure import Measurement

        left, unlimited = self._names, options.update(max_width=10_000, width=10_000)
        while left:
            n = len(left)
            while (
                n > 1
                and Measurement.get(console, unlimited, self._part(left[:n])).maximum
                > options.max_width
            ):
                n -= 1
            yield self._part(left[:n])
            left = left[n:]
            if left:
                yield ""


class TextTable:
    """A table of texts that fits any width; `html.page.Table.of` puts it on a page."""

    # Numbers are not split; headings break between words. Columns that do not fit go to a part
    # below, together with the key columns.

    GAP = 2
    """Characters between columns."""

    def __init__(
        self, title: str, headings: Sequence[str], rows: Sequence[Sequence[str]], keys: int = 1,
        caption: str = "", totals: int = 0,
    ):  # fmt: skip
        self.title, self.headings, self.rows, self.caption = title, headings, rows, caption
        self._totals = totals
        columns = [_Column(heading, k, [row[k] for row in rows], k < keys)
                   for k, heading in enumerate(headings)]  # fmt: skip
        self._keys, self._others = columns[:keys], columns[keys:]

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Any]:
        left = self._others
        while True:
            n = len(left)
            while n > 1 and self._least([*self._keys, *left[:n]]) > options.max_width:
                n -= 1
            yield self._part([*self._keys, *left[:n]], options.max_width)
            left = left[n:]
            if not left:
                return
            yield ""

    def _least(self, columns: Sequence[_Column]) -> int:
        return sum(column.least for column in columns) + self.GAP * (len(columns) - 1)

    def _part(self, columns: Sequence[_Column], width: int) -> Table:
        from rich.box import SIMPLE_HEAD
        from rich.table import Table

        table = Table(
            title=self.title or None, title_justify="left", title_style="bold",
            caption=self.caption or None, caption_justify="left", box=SIMPLE_HEAD,
            padding=(0, self.GAP - 1, 0, 0), show_edge=False, pad_edge=False,
        )  # fmt: skip
        spare = max(0, width - self._least(columns))
        for column in columns:
            more = min(spare, column.most - column.least)
            spare -= more
            table.add_column(
                column.heading, justify="right" if column.number else "left",
                width=column.least + more,
            )  # fmt: skip
        for number, row in enumerate(self.rows):
            if self._totals and number == len(self.rows) - self._totals:
                table.add_section()
            table.add_row(*(row[column.place] for column in columns))
        return table


class _Column:
    """Alignment and width of a column of texts."""

    LONGEST, NARROWEST = 24, 16
    """Longest unbroken text, and least width of a column with broken texts, characters."""

    def __init__(self, heading: str, place: int, cells: Sequence[str], key: bool):
        lines = [line for cell in cells for line in cell.split("\n") if line]
        self.place = place
        self.number = not key and bool(lines) and all(_NUMBER.match(c) for c in cells if c)
        self.most = max(map(len, lines), default=0)
        words = [word for line in lines for word in line.split()]
        whole = self.number or self.most <= self.LONGEST
        self.least = self.most if whole else max(self.NARROWEST, *map(len, words))
        self.heading = _break_heading(heading, self.least)
        widest = max(map(len, self.heading.split("\n")))
        self.least, self.most = max(self.least, widest), max(self.most, widest)


_NUMBER = re.compile(r"[<>±+-]? ?\.?\d|nan$|-$")
"""First characters of a number's text."""


def _break_heading(heading: str, width: int) -> str:
    """A heading broken between words to fit its column."""
    lines = [""]
    for piece in re.findall(r"\S+?(?:[._](?=\w)|\s+|$)", heading):
        if lines[-1] and len((lines[-1] + piece).rstrip()) > max(width, 12):
            lines.append("")
        lines[-1] += piece
    return "\n".join(line.rstrip() for line in lines)


def criteria_tables(
    criteria: Mapping[str, Mapping[str, float]],
    energy: Mapping[str, Mapping[str, float]],
    title: str = "",
    baseline: Mapping[str, Mapping[str, float]] | None = None,
    optima: Collection[str] = (),
) -> WideTable:
    """Table of criteria and energies, split to fit the console's width."""
    beside = dict(baseline or {})
    return WideTable(
        [*criteria, *beside],
        lambda shown: _criteria_columns(criteria, energy, title, beside, optima, shown),
    )


def _criteria_columns(
    criteria: Mapping[str, Mapping[str, float]],
    energy: Mapping[str, Mapping[str, float]],
    title: str,
    baseline: Mapping[str, Mapping[str, float]],
    optima: Collection[str],
    shown: Sequence[str],
) -> Table:
    """Table of some runs; the marks compare all runs."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    columns = [k for k, name in enumerate([*criteria, *baseline]) if name in shown]
    table = Table(title=title or None, box=SIMPLE_HEAD, padding=0, show_edge=False)
    table.add_column("", no_wrap=True)
    for name in shown:
        # one word per line, since rich would break within words
        header = Text("\n".join(as_written(name).split()))
        table.add_column(header, justify="right", no_wrap=True, overflow="fold", vertical="bottom")
    for group, lines in criteria_lines(criteria, energy, baseline, optima).items():
        table.add_row(Text(group, style="bold"))
        for label, values in lines:
            part = [values[k] for k in columns]
            cells = [
                Text(f"{text}*", style="bold") if best else Text(f"{text} ") for text, best in part
            ]
            table.add_row(f"  {label}", *cells)
            table.caption = best_note(part) or table.caption
        table.add_section()
    return table


def criteria_lines(
    criteria: Mapping[str, Mapping[str, float]],
    energy: Mapping[str, Mapping[str, float]],
    baseline: Mapping[str, Mapping[str, float]] | None = None,
    optima: Collection[str] = (),
) -> dict[str, list[tuple[str, list[tuple[str, bool]]]]]:
    """Texts of the table of criteria and energies, for all output formats."""
    values = [{**criteria[name], **energy[name]} for name in criteria]
    bounds = [name in optima for name in criteria]
    others = (baseline or {}).values()
    groups = {}
    for group, rows in _GROUPS.items():
        if group == _FURTHER:
            rows = _further_rows(criteria)
        if group == "Benchmark" and len(values) == 1 and is_reference(values[0]):
            continue
        lines = []
        for row in rows:
            if not any(row.key in v for v in values):
                continue
            symbol, factor = unit_of(row.key)
            numbers = [v[row.key] * factor if row.key in v else None for v in values]
            cells = mark_best(numbers, row.best if len(values) > 1 else None, bounds)
            cells += mark_best(
                [b[row.key] * factor if row.key in b else None for b in others], None
            )
            lines.append((f"{row.label}{', ' * bool(symbol)}{symbol}", cells))
        if lines:
            groups[group] = lines
    return groups


def _further_rows(criteria: Mapping[str, Mapping[str, float]]) -> list[Row]:
    """Rows of the criteria that were selected beside those of every run."""
    listed = {row.key for rows in _GROUPS.values() for row in rows}
    names = dict.fromkeys(name for values in criteria.values() for name in values)
    result = []
    for name in names:
        if name in listed or name.startswith("normalised_"):
            continue
        one = known_criterion(name)
        better = {"smaller": min, "larger": max, "neither": None}
        result.append(Row(name, title_of(name), None if one is None else better[one.better]))
    return result


def is_reference(criteria: Any) -> bool:
    """Whether criteria by name are those of the run to which J1 to J9 refer."""
    return all(criteria.get(f"J{k}") == 1.0 for k in (1, 2, 3, 4, 5, 7, 8))


def run_table(run: Run) -> WideTable:
    """Table of one run."""
    from ..comparison import Comparison

    of_one = Comparison({run.controller: run})
    return criteria_tables(of_one.criteria, of_one.energy, of_one.title)


def standard_console(width: int = WIDTH) -> Console:
    """Console of the terminal's width; without a terminal ``width`` columns and no colours."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else width, highlight=False, markup=False)


def as_text(table: Any, width: int = WIDTH) -> str:
    """Plain text of a table."""
    from rich.console import Console

    console = Console(
        width=width, color_system=None, force_terminal=False, markup=False, highlight=False
    )
    with console.capture() as capture:
        console.print(table)
    return "\n".join(line.rstrip() for line in capture.get().splitlines())


def as_html(table: Any) -> str:
    """Table as HTML for a notebook."""
    from html import escape

    return f'<pre style="line-height:1.2">{escape(as_text(table))}</pre>'


def best_note(cells: Iterable[tuple[str, bool]]) -> str:
    """Explain the mark of the best, if a cell has it."""
    return "* best of the row" if any(best for _, best in cells) else ""


def ratios_note(criteria: Iterable[str], reference: str | None) -> str:
    """Name the run to which the ratios among some criteria refer."""
    ratios = sorted(RATIOS.intersection(criteria))
    return f"{ratios[0]} to {ratios[-1]} refer to {reference}" if ratios and reference else ""


def mark_best(
    numbers: Sequence[float | None],
    best: Callable[[list[float]], float] | None,
    bounds: Sequence[bool] = (),
) -> list[tuple[str, bool]]:
    """Text of each number of a row, and whether it is the best."""
    texts = [number_text(number) for number in numbers]
    bounds = bounds or [False] * len(numbers)
    known = [
        number
        for number, bound in zip(numbers, bounds, strict=True)
        if number is not None and number == number and not bound
    ]
    mark = number_text(best(known)) if best and known else None
    # equal values: none is the best
    if len(set(texts)) == 1:
        mark = None
    return [(text, text == mark and not bound) for text, bound in zip(texts, bounds, strict=True)]
