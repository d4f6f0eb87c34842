"""Figures of a sweep, legible in grey: medians, maps and sensitivities."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..comparison import UNCONTROLLED
from ..errors import InputError
from ..written_names import as_written
from .style import (
    DOUBLE_COLUMN,
    contour_lines,
    label_outer,
    legend,
    light_shades,
    line_styles,
    new_figure,
    style,
)
from .units import unit_of

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..sweeps.result import Sweep

_MOST_CELLS = 24
"""Largest number of values on a map's axis; more values are grouped into intervals."""
_INTERVALS = 12
_ACROSS = 3


def comparison(sweep: Sweep, criteria: Sequence[str] | None = None) -> Figure:
    """Criteria as ratios, one bar per controller."""
    peaks = [name for name in sweep.criteria if name.startswith("peak_")]
    target = peaks if criteria is None else list(criteria)
    for name in target:
        sweep.check(name, sweep.criteria, "criterion")
    values = sweep.table.pivot(index="case", columns="controller", values=target)
    uncontrolled = UNCONTROLLED in sweep.controllers
    with style():
        figure = new_figure(DOUBLE_COLUMN, 3.4)
        axes = figure.add_subplot()
        styles = line_styles(len(sweep.controllers), markers=True)
        for k, (label, look) in enumerate(zip(sweep.controllers, styles, strict=True)):
            ratios = np.stack([
                values[name, label]
                / (values[name, UNCONTROLLED] if uncontrolled else np.nanmedian(values[name]))
                for name in target
            ])  # fmt: skip
            low, middle, high = np.nanpercentile(ratios, [10, 50, 90], axis=1)
            # bars beside each other, not on each other
            at = np.arange(len(target)) + 0.08 * (k - (len(styles) - 1) / 2)
            bars = np.stack([middle - low, high - middle])
            axes.errorbar(
                at, middle, bars, label=as_written(label), elinewidth=0.8, capsize=1.5, **look
            )
        # a word per line: names stand side by side
        axes.set_xticks(range(len(target)), [title_of(name).replace(" ", "\n") for name in target])
        axes.set_ylabel(
            f"over {as_written(UNCONTROLLED)}" if uncontrolled else "over the median of all runs"
        )
        legend(figure, axes, "outside upper center")
    return figure


def heat_map(sweep: Sweep, x: str | None, y: str | None, criterion: str) -> Figure:
    """A criterion over two varied quantities, one panel per controller, with one colour scale."""
    x, y = _two(sweep, x, y)
    sweep.check(criterion, sweep.criteria, "criterion")
    unit, factor = unit_of(criterion)
    frame = sweep.table[["controller", x, y, criterion]].copy()
    # medians of scattered points have no smooth contour lines
    binned = max(frame[x].nunique(), frame[y].nunique()) > _MOST_CELLS
    frame[x], frame[y] = _cells(frame[x]), _cells(frame[y])
    middle = frame.groupby(["controller", y, x])[criterion].median() * factor
    least, most = float(middle.min()), float(middle.max())
    rows = -(-len(sweep.controllers) // _ACROSS)
    across = min(_ACROSS, len(sweep.controllers))
    with style():
        figure = new_figure(DOUBLE_COLUMN if across > 1 else 4.2, 0.6 + 2.5 * rows)
        grid = figure.add_gridspec(rows, across)
        shades = light_shades()
        panels: list[Axes] = []
        image = None
        for k, label in enumerate(sweep.controllers):
            axes = figure.add_subplot(grid[divmod(k, across)])
            cells = middle[label].unstack()
            image = axes.pcolormesh(
                _edges(cells.columns), _edges(cells.index), cells.to_numpy(), cmap=shades,
                vmin=least, vmax=most,
            )  # fmt: skip
            _print_cells(axes, cells, lines=not binned)
            axes.set(
                xlabel=x, ylabel=y, title=as_written(label) if len(sweep.controllers) > 1 else ""
            )
            axes.grid(False)
            panels.append(axes)
        label_outer(panels, across)
        assert image is not None
        title = f"{title_of(criterion)}, {unit}" if unit else title_of(criterion)
        figure.colorbar(image, ax=panels, label=title)
    return figure


def _two(sweep: Sweep, x: str | None, y: str | None) -> tuple[str, str]:
    numbers = [name for name in sweep.parameters if sweep.table[name].dtype.kind in "if"]
    for name in (x, y):
        if name is not None:
            sweep.check(name, numbers, "varied quantity")
    first = x or next((name for name in numbers if name != y), None)
    second = y or next((name for name in numbers if name != first), None)
    if first is None or second is None or first == second:
        raise InputError(
            f"a map needs two varied quantities that are numbers; there are: "
            f"{', '.join(numbers) or 'none'}"
        )
    return first, second


def _cells(values: pandas.Series) -> pandas.Series:
    """Return the values, or the middles of intervals if there are too many."""
    if values.nunique() <= _MOST_CELLS:
        return values
    import pandas

    edges = np.linspace(values.min(), values.max(), _INTERVALS + 1)
    middles = (edges[:-1] + edges[1:]) / 2
    result = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, _INTERVALS - 1)
    return pandas.Series(middles[result], index=values.index)


def _edges(middles: Sequence[float]) -> np.ndarray:
    """Edges of cells around values of any spacing."""
    at = np.asarray(middles, float)
    if len(at) == 1:
        return at[0] + np.array([-0.5, 0.5])
    inner = (at[:-1] + at[1:]) / 2
    return np.concatenate([[2 * at[0] - inner[0]], inner, [2 * at[-1] - inner[-1]]])


def _print_cells(axes: Axes, cells: pandas.DataFrame, lines: bool) -> None:
    """Print the numbers in the cells if they fit; otherwise draw contour lines."""
    values = cells.to_numpy()
    if values.size <= 36:
        for i, j in np.ndindex(*values.shape):
            if np.isfinite(values[i, j]):
                axes.text(
                    cells.columns[j], cells.index[i], f"{values[i, j]:.3g}", fontsize=6,
                    ha="center", va="center",
                )  # fmt: skip
    elif lines and min(values.shape) > 1 and np.nanmin(values) < np.nanmax(values):
        contour_lines(axes, cells.columns, cells.index, values, 6)


def sensitivity(sweep: Sweep, criterion: str, controller: str | None) -> Figure:
    """Bars of the sensitivity indices, with 95 % intervals."""
    result = sweep.sensitivity(criterion, controller)
    shown = [name for name in result.columns if not name.endswith("_conf")]
    unit, factor = unit_of(criterion)
    morris = "mu_star" in shown
    names = {
        "S1": "first order, $S_1$", "ST": "total, $S_T$", "mu_star": "mean effect",
        "sigma": "its spread",
    }  # fmt: skip
    with style():
        figure = new_figure(DOUBLE_COLUMN / 2 + 1.0, 1.1 + 0.42 * len(result))
        axes = figure.add_subplot()
        height = 0.8 / len(shown)
        for k, (name, grey, hatch) in enumerate(
            zip(shown, ("0.25", "0.8"), ("", "////"), strict=False)
        ):
            at = np.arange(len(result)) + (k - (len(shown) - 1) / 2) * height
            values = result[name] * (factor if morris else 1.0)
            conf = result.get(f"{name}_conf")
            bars = None if conf is None else conf * (factor if morris else 1.0)
            axes.barh(
                at, values, height, xerr=bars, color=grey, hatch=hatch, edgecolor="black",
                linewidth=0.5, label=names[name], error_kw={"elinewidth": 0.8, "capsize": 2},
            )  # fmt: skip
        axes.set_yticks(range(len(result)), list(result.index))
        axes.invert_yaxis()
        axes.set_xlabel(
            f"effect on {title_of(criterion)}, {unit}" if morris
            else f"share of the variance of {title_of(criterion)}"
        )  # fmt: skip
        axes.set_title(sweep.one_controller(controller))
        axes.grid(axis="y", visible=False)
        legend(figure, axes, "outside upper center")
    return figure


def title_of(criterion: str) -> str:
    """Return a criterion's name in words, without the unit."""
    parts = criterion.split("_")
    return " ".join(parts[: -_unit_parts(criterion)] if _unit_parts(criterion) else parts)


def _unit_parts(name: str) -> int:
    """Count the parts of a criterion's name, between underscores, that form the unit."""
    return 2 if name.endswith(("_m_s2", "_m_s")) else 1 if unit_of(name)[0] else 0
