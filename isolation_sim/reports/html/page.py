"""A page of sections made of blocks, written as one HTML file that needs no network."""

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
from ...io.atomic_write import write_text
from ...version import __version__
from .charts import Look
from .text import is_number, tied


@dataclass(frozen=True)
class Prose:
    """Paragraphs."""

    kind: ClassVar[str] = "prose"
    paragraphs: tuple[str, ...]  # Plain text
    role: str = ""  # {"", "verdict", "warning"}: How it is set off from the rest


@dataclass(frozen=True)
class Facts:
    """Pairs of a name and its value."""

    kind: ClassVar[str] = "facts"
    items: Mapping[str, str]  # Text by its heading


@dataclass(frozen=True)
class Bullets:
    """A list."""

    kind: ClassVar[str] = "bullets"
    items: tuple[str, ...]  # Plain text


@dataclass(frozen=True)
class Listing:
    """Text shown as it stands, folded away until it is asked for."""

    kind: ClassVar[str] = "listing"
    # title, text: What it is, and the text
    title: str
    text: str


@dataclass(frozen=True)
class Cell:
    """Cell of a table."""

    text: str  # What to print
    mark: str = ""  # Why it stands out, such as ``"best"``; empty if it does not


@dataclass(frozen=True)
class Row:
    """Row of a table."""

    label: str  # Its heading
    cells: tuple[Cell, ...] = ()  # One per column; none for a heading of the rows that follow


def text_rows(rows: Iterable[Sequence[str]]) -> tuple[Row, ...]:
    """Rows of plain texts, each with its label first."""
    return tuple(Row(label, tuple(map(Cell, texts))) for label, *texts in rows)


@dataclass(frozen=True)
class Table:
    """A table."""

    kind: ClassVar[str] = "table"
    caption: str  # What it shows
    headings: tuple[str, ...]  # Columns, that of the row labels first
    rows: tuple[Row, ...]  # Rows
    note: str = ""  # What a mark means
    # Headings of columns by whose values the reader can choose rows; points of charts that name a
    # row (`isolation_sim.reports.html.charts.points`) follow
    filters: tuple[str, ...] = ()

    @property
    def numeric(self) -> tuple[bool, ...]:
        """Whether each column holds numbers more than words; the row labels' does not."""
        result = [False]
        for column in zip(*(row.cells for row in self.rows if row.cells), strict=True):
            texts = [cell.text for cell in column if cell.text]
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
    title: str  # What it shows, with units; printed above it
    # ``data`` and ``layout`` of plotly.js; see `isolation_sim.reports.html.charts`
    figure: Mapping[str, Any]
    summary: str  # What it shows, in words, for those who cannot see it
    # Charts with the same link follow each other's zoom: ``"time"`` along x, ``"loop"`` along both
    # axes; others do not
    link: str = ""
    height: int = 230  # Pixels


@dataclass(frozen=True)
class Picture:
    """A figure for publication, as it was saved."""

    kind: ClassVar[str] = "picture"
    title: str  # What it shows
    path: Path | None = None  # SVG or PNG file, read when the page is made
    svg: str = ""  # Text of the SVG in place of a file

    @property
    def address(self) -> str:
        """The file itself, as an address."""
        content, form = self.svg.encode(), "svg+xml"
        if self.path is not None:
            content = self.path.read_bytes()
            form = "svg+xml" if self.path.suffix == ".svg" else "png"
        data = base64.b64encode(content).decode("ascii")
        return f"data:image/{form};base64,{data}"


@dataclass(frozen=True)
class Gallery:
    """Charts side by side, as many as the width of the page allows."""

    kind: ClassVar[str] = "gallery"
    charts: tuple[Chart, ...]  # The charts


@dataclass(frozen=True)
class LineChoice:
    """Legend of all charts of the page, whose lines it shows and hides by name."""

    kind: ClassVar[str] = "choice"
    lines: Mapping[str, Look]  # Look of each line by its name, which is its trace's ``meta``
    what: str  # What the names are, such as ``"Controllers"``


@dataclass(frozen=True)
class Key:
    """Meaning of filled areas and lines of charts."""

    kind: ClassVar[str] = "key"
    # Colour and hatch, as plotly names it or empty, by what the area is
    areas: Mapping[str, tuple[str, str]]
    lines: Mapping[str, Look]  # Look by what the line is


@dataclass(frozen=True)
class TimeRange:
    """Fields that set the interval that all charts over time show."""

    kind: ClassVar[str] = "timerange"
    # start, stop: Whole interval, s
    start: float
    stop: float


@dataclass(frozen=True)
class Animation:
    """Two runs of a building side by side; see `isolation_sim.reports.html.animation`."""

    kind: ClassVar[str] = "animation"
    data: Mapping[str, Any]  # What ``animation.js`` draws


@dataclass(frozen=True)
class Explorer:
    """Runs of a sweep that the reader chooses from; see `isolation_sim.reports.html.explorer`."""

    kind: ClassVar[str] = "explorer"
    # data, charts: What ``explorer.js`` draws, and into which charts
    data: Mapping[str, Any]
    charts: tuple[Chart, ...]


Block: TypeAlias = (
    Prose | Facts | Bullets | Listing | Table | Chart | Picture | Gallery | LineChoice | Key
    | TimeRange | Animation | Explorer
)  # fmt: skip


@dataclass(frozen=True)
class Section:
    """Part of a page under a heading."""

    title: str  # Heading, different from the others of its page
    blocks: Sequence[Block]  # What it holds

    @property
    def anchor(self) -> str:
        """Name of the section in an address."""
        return re.sub(r"\W+", "-", self.title.lower()).strip("-")


@dataclass(frozen=True)
class Page:
    """A report."""

    # title, subtitle: What it is about
    title: str
    subtitle: str
    sections: Sequence[Section]  # What it says

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
    """The script of plotly.js: an installed package has it, a checkout takes it from plotly."""
    try:
        return _file("plotly.min.js")
    except FileNotFoundError:
        pass
    try:
        from plotly.offline import get_plotlyjs
    except ModuleNotFoundError:
        raise InputError(
            "a report needs plotly.js, which this checkout does not have; expected: pip install ., "
            "or pip install plotly"
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
    environment.filters["tied"] = tied
    environment.filters["breaking"] = _breaking
    return environment.get_template("page.html.j2")


def _breaking(text: str) -> Any:
    """A text whose long names may break behind an underscore."""
    from markupsafe import Markup, escape

    return Markup(str(escape(tied(text))).replace("_", "_<wbr>"))
