"""A page of sections and blocks, written as one HTML file that works without a network."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

from ...errors import InputError
from ...io.files import write_text
from ...version import __version__
from ...written_names import capital
from ..style import Look
from ..tables import TextTable
from .charts import dashes, glyph

# a number alone, or with words or the mark of the best one after it, as in 5.9 (5.7 to 6.1)
_NUMBER = re.compile(r"[<>±+\-]? ?\d[\d.,e+\-]*\*?( |$)")
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:%|m/s²|[mk]?m|m?s|[gtAVJNW]|k[NJ]|k?Hz|°C)(?!\w))")


@dataclass(frozen=True)
class Prose:
    """Paragraphs."""

    kind: ClassVar[str] = "prose"
    paragraphs: tuple[str, ...]  # Plain text
    role: str = ""  # {"", "verdict", "warning"}: Style


@dataclass(frozen=True)
class Facts:
    """Pairs of a heading and a text."""

    kind: ClassVar[str] = "facts"
    items: Mapping[str, str]  # Text by its heading


@dataclass(frozen=True)
class Bullets:
    """A list."""

    kind: ClassVar[str] = "bullets"
    items: tuple[str, ...]  # Plain text


@dataclass(frozen=True)
class Listing:
    """Preformatted text, folded until the reader opens it."""

    kind: ClassVar[str] = "listing"
    # title, text: Heading and text
    title: str
    text: str


@dataclass(frozen=True)
class Cell:
    """Cell of a table."""

    text: str  # Text to print
    mark: str = ""  # Reason for emphasis, such as ``"best"``; empty without emphasis


@dataclass(frozen=True)
class Row:
    """Row of a table."""

    label: str  # Heading of the row
    cells: tuple[Cell, ...] = ()  # One per column; empty for a heading above other rows


def marked_row(label: str, cells: Iterable[tuple[str, bool]]) -> Row:
    """A row of texts, of which the best is marked."""
    return Row(label, tuple(Cell(text, "best" * best) for text, best in cells))


def table_note(*notes: str) -> str:
    """The note of a table from several, of which some may be empty."""
    return " ".join(f"{note}." for note in notes if note)


def text_rows(rows: Iterable[Sequence[str]]) -> tuple[Row, ...]:
    """Rows from plain texts; the first text of each is its label."""
    return tuple(Row(label, tuple(map(Cell, texts))) for label, *texts in rows)


@dataclass(frozen=True)
class Table:
    """A table."""

    kind: ClassVar[str] = "table"
    caption: str  # Contents
    headings: tuple[str, ...]  # Column headings, that of the row labels first
    rows: tuple[Row, ...]  # Rows
    note: str = ""  # Explanation of the marks
    # Headings of columns with a filter; chart points that belong to a row
    # (``ids`` of `isolation_sim.reports.html.panels.panel_chart`) follow the filters
    filters: tuple[str, ...] = ()

    @classmethod
    def of(cls, table: TextTable, caption: str = "", **more: Any) -> Table:
        """A table of the terminal, with capitals at the start of its headings."""
        headings = tuple(one if len(one) == 1 else capital(one) for one in table.headings)
        return cls(caption or table.title, headings, text_rows(table.rows),
                   **{"note": table.caption, **more})  # fmt: skip

    @property
    def numeric(self) -> tuple[bool, ...]:
        """Whether each column holds mainly numbers; False for the row labels."""
        result = [False]
        for column in zip(*(row.cells for row in self.rows if row.cells), strict=True):
            texts = [cell.text for cell in column if cell.text not in ("", "-")]
            result.append(2 * sum(map(is_number, texts)) >= len(texts))
        return tuple(result)

    @property
    def choices(self) -> list[tuple[str, int, list[str]]]:
        """Heading, column and values of each filter."""
        result = []
        for heading in self.filters:
            column = self.headings.index(heading)
            texts = [row.label if column == 0 else row.cells[column - 1].text for row in self.rows]
            result.append((heading, column, list(dict.fromkeys(texts))))
        return result


@dataclass(frozen=True)
class Chart:
    """A Plotly figure."""

    kind: ClassVar[str] = "chart"
    title: str  # Contents with units, printed above the chart
    # ``data`` and ``layout`` of plotly.js; see `isolation_sim.reports.html.charts`
    figure: Mapping[str, Any]
    summary: str  # Contents in words, for readers who cannot see the chart
    # Charts with the same link zoom together: ``"time"`` along x, ``"loop"`` along both axes
    link: str = ""
    height: int = 230  # Pixels


@dataclass(frozen=True)
class Picture:
    """A saved figure for publication."""

    kind: ClassVar[str] = "picture"
    title: str  # Contents
    path: Path | None = None  # SVG or PNG file, read when the page is written
    svg: str = ""  # SVG as text, in place of a file

    @property
    def address(self) -> str:
        """The file as a data URI."""
        content, form = self.svg.encode(), "svg+xml"
        if self.path is not None:
            content = self.path.read_bytes()
            form = "svg+xml" if self.path.suffix == ".svg" else "png"
        data = base64.b64encode(content).decode("ascii")
        return f"data:image/{form};base64,{data}"


@dataclass(frozen=True)
class Gallery:
    """Charts side by side, as many as fit the width of the page."""

    kind: ClassVar[str] = "gallery"
    charts: tuple[Chart, ...]  # The charts


@dataclass(frozen=True)
class LineChoice:
    """Legend of all charts of the page; it shows and hides their lines by name."""

    kind: ClassVar[str] = "choice"
    lines: Mapping[str, Look]  # Look of each line by its name, the trace's ``meta``
    what: str  # Heading of the names, such as ``"Controllers"``


@dataclass(frozen=True)
class Key:
    """Key to the filled areas and lines of charts."""

    kind: ClassVar[str] = "key"
    # Colour and hatch (plotly's name, or empty) by the meaning of the area
    areas: Mapping[str, tuple[str, str]]
    lines: Mapping[str, Look]  # Look by the meaning of the line


@dataclass(frozen=True)
class TimeRange:
    """Input fields for the time interval of all charts over time."""

    kind: ClassVar[str] = "timerange"
    # start, stop: Whole interval, s
    start: float
    stop: float


@dataclass(frozen=True)
class Animation:
    """Two runs of a building side by side; see `isolation_sim.reports.html.animation`."""

    kind: ClassVar[str] = "animation"
    data: Mapping[str, Any]  # Input of ``animation.js``


@dataclass(frozen=True)
class Explorer:
    """Interactive charts of a sweep; see `isolation_sim.reports.html.explorer`."""

    kind: ClassVar[str] = "explorer"
    # data, charts: Input of ``explorer.js``, and its charts
    data: Mapping[str, Any]
    charts: tuple[Chart, ...]


Block: TypeAlias = (
    Prose | Facts | Bullets | Listing | Table | Chart | Picture | Gallery | LineChoice | Key
    | TimeRange | Animation | Explorer
)  # fmt: skip


@dataclass(frozen=True)
class Section:
    """Part of a page under a heading."""

    title: str  # Heading, unique on its page
    blocks: Sequence[Block]  # Contents

    @property
    def anchor(self) -> str:
        """Anchor of the section."""
        return re.sub(r"\W+", "-", self.title.lower()).strip("-")


@dataclass(frozen=True)
class Page:
    """A report."""

    # title, subtitle: Subject of the page
    title: str
    subtitle: str
    sections: Sequence[Section]  # Contents

    def html(self) -> str:
        """The whole page."""
        kinds = {block.kind for section in self.sections for block in section.blocks}
        scripts = [_plotly()] if kinds & {"chart", "gallery", "explorer"} else []
        own = ["page", *sorted(kinds & {"animation", "explorer"})]
        scripts += [_file(f"{name}.js") for name in own]
        return _template().render(
            page=self, scripts=scripts, css=_file("page.css"), version=__version__
        )

    def write(self, path: str | Path) -> Path:
        """Write the page."""
        return write_text(self.html(), path)


@cache
def _plotly() -> str:
    """The script of plotly.js, from the installed package, or from plotly in a checkout."""
    try:
        return _file("plotly.min.js")
    except FileNotFoundError:
        pass
    try:
        from plotly.offline import get_plotlyjs
    except ModuleNotFoundError:
        raise InputError(
            "plotly.js of the reports is missing in this checkout; expected: pip install ., or pip "
            "install plotly"
        ) from None
    return get_plotlyjs()


def _file(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


@cache
def _template() -> Any:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(__package__, "."),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters |= {
        "tied": tied, "breaking": _breaking, "dashes": dashes, "glyph": glyph
    }  # fmt: skip
    return environment.get_template("page.html.j2")


def is_number(text: str) -> bool:
    """Whether a text is a number, with or without words after it."""
    return _NUMBER.match(text) is not None


def tied(text: str) -> str:
    """Keep numbers and their units on one line."""
    return _BEFORE_UNIT.sub("\u00a0", text)


def _breaking(text: str) -> Any:
    """A text with possible line breaks after the underscores of long names."""
    from markupsafe import Markup, escape

    return Markup(str(escape(tied(text))).replace("_", "_<wbr>"))
