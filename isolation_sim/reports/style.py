"""Style of the figures: sizes, lines that differ in grey, and files."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ground_motions.argument_types import checked
from ground_motions.files import atomic_write

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.contour import ContourSet
    from matplotlib.figure import Figure

DOUBLE_COLUMN = 7.2
"""Width of a figure across both columns, inches."""

BAND = "#f0f0f0"
"""Colour of a shaded band."""

# colours of Okabe and Ito, for colour-blind readers, from dark to light
_COLOURS = ("#000000", "#D55E00", "#0072B2", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
_DASHES: tuple[tuple[float, ...], ...] = ((), (4, 1.2), (5, 1.2, 1, 1.2), (1, 1))
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")


@dataclass(frozen=True)
class Look:
    """Look of a line, in print and on a page."""

    colour: str  # Colour, as HTML writes it
    dashes: tuple[float, ...] = ()  # Lengths of dashes and gaps, line widths; empty if solid
    marker: str = ""  # Marker, as matplotlib names it
    width: float = 1.0  # Width over that of other lines
    joined: bool = True  # Whether a line joins the points
    filled: bool = True  # Whether markers are filled

    def print_keys(self, width: float | None = None) -> dict[str, Any]:
        """Keys of matplotlib for this look; width in points."""
        dashes = (0, self.dashes) if self.dashes else "-"
        keys: dict[str, Any] = {
            "color": self.colour,
            "linestyle": dashes if self.joined else "",
            "marker": self.marker,
        }
        if width is not None:
            keys["linewidth"] = width * self.width
        return keys if self.filled else {**keys, "markerfacecolor": "white"}


_SETTINGS: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "legend.handlelength": 3.2,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.use_mathtext": True,
    "grid.color": "0.88",
    "grid.linewidth": 0.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.0,
    "lines.markersize": 3.5,
    "hatch.linewidth": 0.5,
    "figure.facecolor": "white",
    "figure.constrained_layout.use": True,
    "figure.constrained_layout.h_pad": 0.03,
    "figure.constrained_layout.w_pad": 0.03,
    "svg.hashsalt": "isolation_sim",
}


@contextmanager
def style() -> Iterator[None]:
    """Use the figures' style inside a ``with`` block, then the user's style again."""
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS)
        yield


def new_figure(width: float, height: float) -> Figure:
    """Empty figure outside pyplot."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def light_shades() -> Colormap:
    """Colours for maps: light, so that black numbers and lines are legible, also in grey."""
    import numpy as np
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps["cividis"](np.linspace(0.4, 1.0, 256)))


def label_outer(axes: Sequence[Axes], across: int, ticks: bool = True) -> None:
    """Keep the axis labels only at the left and at the bottom of a grid of panels."""
    for k, panel in enumerate(axes):
        left, bottom = k % across == 0, k + across >= len(axes)
        if ticks:
            panel.tick_params(labelleft=left, labelbottom=bottom)
        panel.set_ylabel(panel.get_ylabel() if left else "")
        panel.set_xlabel(panel.get_xlabel() if bottom else "")


def contour_map(
    axes: Axes, x: Any, y: Any, values: Any, shades: Any, lines: Any, fmt: str | None = None,
    **look: Any,
) -> ContourSet:  # fmt: skip
    """Draw filled contours at the levels ``shades``, and lines with their values at ``lines``."""
    image = axes.contourf(x, y, values, shades, cmap=light_shades(), **look)
    contour_lines(axes, x, y, values, lines, fmt)
    axes.grid(False)
    return image


def contour_lines(
    axes: Axes, x: Any, y: Any, values: Any, levels: Any, fmt: str | None = None, **look: Any
) -> None:
    """Draw contour lines with their values."""
    lines = axes.contour(x, y, values, levels, **{"colors": "black", "linewidths": 0.6, **look})
    in_panel = axes.transData - axes.transAxes
    for label in axes.clabel(lines, fmt=fmt, fontsize=6, inline=False):
        label.set_bbox({"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6})
        # a number cut by the panel's edge would be misread
        label.set_visible(bool(abs(in_panel.transform(label.get_position()) - 0.5).max() < 0.46))


def legend(
    figure: Figure, axes: Axes, place: Literal["outside upper center", "outside lower center"]
) -> None:
    """Draw the legend of one panel for all panels."""
    handles, labels = axes.get_legend_handles_labels()
    # a letter takes about 1/19 inch, and the line beside it ten letters
    fitting = int(19.4 * figure.get_figwidth() / (10 + max(map(len, labels))))
    ncols = max(1, min(len(labels), fitting, 4))
    figure.legend(handles, labels, loc=place, ncols=ncols)


def line_looks(count: int, *, markers: bool = False) -> list[Look]:
    """Looks that differ by more than colour."""
    unmarked = 0 if markers else len(_DASHES)
    return [
        Look(
            _COLOURS[k % len(_COLOURS)],
            _DASHES[k % len(_DASHES)],
            _MARKERS[(k - unmarked) % len(_MARKERS)] if k >= unmarked else "",
        )
        for k in range(count)
    ]


def point_looks(count: int) -> list[Look]:
    """Looks of points without lines; a marker is hollow where it comes a second time."""
    return [
        Look(
            _COLOURS[k % len(_COLOURS)],
            marker=_MARKERS[k % len(_MARKERS)],
            joined=False,
            filled=k // len(_MARKERS) % 2 == 0,
        )
        for k in range(count)
    ]


def line_styles(count: int, *, markers: bool = False) -> list[dict[str, Any]]:
    """Line styles of matplotlib that differ by more than colour."""
    return [look.print_keys() for look in line_looks(count, markers=markers)]


@checked
def save(figure: Figure, folder: str | Path, stem: str) -> tuple[Path, Path]:
    """Write a figure as SVG and as PNG (200 dots per inch).

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        A figure.
    folder : str or pathlib.Path
        Folder; created if it is missing.
    stem : str
        File name without suffix.

    Returns
    -------
    tuple of pathlib.Path
        SVG and PNG. Each file is written completely or not at all. Equal figures give equal bytes.

    Raises
    ------
    OSError
        If the folder cannot be written to.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    paths = folder / f"{stem}.svg", folder / f"{stem}.png"
    # the PNG first: its texts are wider than those of the SVG, which takes over its layout
    how: tuple[tuple[Path, dict[str, Any]], ...] = (
        (paths[1], {"dpi": 200}),
        (paths[0], {"metadata": {"Date": None}}),
    )
    _use_plain_ticks(figure)
    layout = figure.get_layout_engine()
    try:
        for path, options in how:
            with atomic_write(path) as unfinished:
                with style():
                    figure.savefig(unfinished, format=path.suffix[1:], **options)
                if path.suffix == ".svg":
                    unfinished.write_text(
                        _round_coordinates(unfinished.read_text("utf-8")), "utf-8"
                    )
            _fix_layout(figure)  # the second file keeps the layout of the first
    finally:
        figure.set_layout_engine(layout or "none")
    return paths


def svg_text(figure: Figure) -> str:
    """Return a figure as the text of the SVG file of ``save``."""
    text = io.StringIO()
    _use_plain_ticks(figure)
    with style():
        figure.savefig(text, format="svg", metadata={"Date": None})
    return _round_coordinates(text.getvalue())


def _fix_layout(figure: Figure) -> None:
    """Remove the layout engine, for which all is drawn once more."""
    import matplotlib

    none: dict[Any, Any] = {"figure.autolayout": False, "figure.constrained_layout.use": False}
    with matplotlib.rc_context(none):
        figure.set_layout_engine(None)


def _use_plain_ticks(figure: Figure) -> None:
    """Write the numbers at ticks as text: to set them as formulas takes a third of the time."""
    from matplotlib.ticker import ScalarFormatter

    class PlainTicks(ScalarFormatter):
        """As the base class, whose power of ten beside the axis stays a formula."""

        def __call__(self, x: float, pos: int | None = None) -> str:
            formula = super().__call__(x, pos)
            return formula.removeprefix(r"$\mathdefault{").removesuffix("}$")

    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            formatter = axis.get_major_formatter()
            if type(formatter) is ScalarFormatter:
                plain = PlainTicks()
                vars(plain).update(vars(formatter))
                axis.set_major_formatter(plain)


def _round_coordinates(svg: str) -> str:
    """Round coordinates to 0.01 points; Matplotlib writes 1e-6 points."""

    def cut(path: re.Match[str]) -> str:
        return re.sub(r"(\.\d\d)\d+", r"\1", path[0])

    return re.sub(r' d="[^"]*"', cut, svg)
