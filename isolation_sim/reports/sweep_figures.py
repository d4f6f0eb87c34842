"""Figures of a sweep, legible in grey: medians, maps and sensitivities."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError, check_name
from ..registry import CONTROLLERS
from ..sweeps.axes import label_of
from ..sweeps.fields import steps_of
from ..written_names import as_written
from .style import (
    DOUBLE_COLUMN,
    contour_lines,
    label_outer,
    legend,
    light_shades,
    new_figure,
    point_looks,
    style,
)
from .tables import title_of
from .units import split_unit, unit_of

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    from ..sweeps.result import Sweep

_MOST_CELLS = 24
"""Largest number of values on a map's axis; more values are grouped into intervals."""
_INTERVALS = 12
_MOST_PRINTED = 36
"""Largest number of cells of a panel with their numbers."""
_ACROSS = 3


def comparison(sweep: Sweep, criteria: Sequence[str] | None = None) -> Figure:
    """Criteria as ratios, one point with its spread per controller."""
    peaks = [name for name in sweep.criteria if name.startswith("peak_")]
    target = peaks if criteria is None else list(criteria)
    for name in target:
        check_name("criterion", name, sweep.criteria)
    values = sweep.table.pivot(index="case", columns="controller", values=target)
    reference = sweep.reference
    base = {
        name: values[name, reference] if reference else np.nanmedian(values[name])
        for name in target
    }
    # the force of a wall that is not touched has no ratios
    target = [name for name in target if np.all(base[name] != 0.0)]
    with style():
        figure = new_figure(DOUBLE_COLUMN, 3.4)
        axes = figure.add_subplot()
        looks = point_looks(len(sweep.controllers))
        apart = min(0.12, 0.8 / len(looks))
        axes.axhline(1.0, color="0.6", linewidth=0.8, zorder=1)
        for k, (label, look) in enumerate(zip(sweep.controllers, looks, strict=True)):
            ratios = np.stack([values[name, label] / base[name] for name in target])
            low, middle, high = np.nanpercentile(ratios, [10, 50, 90], axis=1)
            # bars beside each other, not on each other
            at = np.arange(len(target)) + apart * (k - (len(looks) - 1) / 2)
            bars = np.stack([middle - low, high - middle])
            axes.errorbar(
                at, middle, bars, label=as_written(label), elinewidth=0.8, capsize=1.5,
                **look.print_keys(),
            )  # fmt: skip
        axes.grid(axis="x", visible=False)
        # a word per line: names stand side by side
        axes.set_xticks(range(len(target)), [title_of(name).replace(" ", "\n") for name in target])
        axes.set_ylabel(
            f"ratio to {as_written(reference)} (-)"
            if reference
            else "ratio to the median of all runs (-)"
        )
        legend(figure, axes, "outside upper center")
    return figure


def heat_map(sweep: Sweep, x: str | None, y: str | None, criterion: str) -> Figure:
    """A criterion over two varied quantities, one panel per controller, with one colour scale."""
    x, y = _two(sweep, x, y)
    check_name("criterion", criterion, sweep.criteria)
    unit, factor = unit_of(criterion)
    frame = sweep.table[["controller", x, y, criterion]].copy()
    # medians of scattered points have no smooth contour lines
    binned = max(frame[x].nunique(), frame[y].nunique()) > _MOST_CELLS
    limits = [(float(frame[name].min()), float(frame[name].max())) for name in (x, y)]
    frame[x], frame[y] = _cells(frame[x]), _cells(frame[y])
    printed = frame[x].nunique() * frame[y].nunique() <= _MOST_PRINTED
    middle = frame.groupby(["controller", y, x])[criterion].median() * factor
    norm, levels = _scale(middle.to_numpy())
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
            # the columns are alike wide if numbers stand in them, and named by their values
            sides = [
                _side(axis, values, ends, printed)
                for axis, values, ends in zip(
                    (axes.xaxis, axes.yaxis), (cells.columns, cells.index), limits, strict=True
                )
            ]
            (across_at, x_edges), (up_at, y_edges) = sides
            image = axes.pcolormesh(x_edges, y_edges, cells.to_numpy(), cmap=shades, norm=norm)
            if printed:
                _print_cells(axes, cells.to_numpy())
            elif not binned:
                _contours(axes, across_at, up_at, cells.to_numpy(), levels)
            axes.set(xlim=x_edges[[0, -1]], ylim=y_edges[[0, -1]])
            axes.set(
                xlabel=quantity_title(sweep, x), ylabel=quantity_title(sweep, y),
                title=as_written(label) if len(sweep.controllers) > 1 else "",
            )  # fmt: skip
            axes.grid(False)
            panels.append(axes)
        label_outer(panels, across)
        assert image is not None
        title = f"{title_of(criterion)} ({unit})" if unit else title_of(criterion)
        further = [
            name for name in sweep.parameters
            if name not in (x, y, "seed") and sweep.table[name].nunique() > 1
        ]  # fmt: skip
        if further:
            others = ", ".join(further) if len(further) <= 3 else f"{len(further)} quantities"
            title += f"\nmedian over {others}"
        bar = figure.colorbar(image, ax=panels, label=title, ticks=levels, format="%g")
        bar.ax.minorticks_off()
        # a line too short for its number is found here
        for level in levels if not (printed or binned) else ():
            bar.ax.axhline(level, color="black", linewidth=0.6)
    return figure


def _scale(values: np.ndarray) -> tuple[Normalize, list[float]]:
    """Colour scale of a map, logarithmic for values that are mostly small, and its levels."""
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.ticker import LogLocator, MaxNLocator

    least, most = float(np.nanmin(values)), float(np.nanmax(values))
    skewed = 0 < 3 * least < most and np.nanmedian(values) - least < 0.25 * (most - least)
    if not skewed:
        norm, ticks = Normalize(least, most), MaxNLocator(7).tick_values(least, most)
    else:
        steps = (1, 2, 5) if most / least > 30 else (1, 1.5, 2, 3, 4, 6, 8)
        norm, ticks = LogNorm(least, most), LogLocator(subs=steps).tick_values(least, most)
    return norm, [float(tick) for tick in ticks if least <= tick <= most]


def quantity_title(sweep: Sweep, name: str) -> str:
    """A varied quantity in words, with its unit: driver lag (s)."""
    varied = next((each for each in sweep.plan.vary if label_of(each) == name), None)
    field = name if varied is None else varied.fields[0]
    if name != field and any(mark in name for mark in "([,"):
        return name  # the user's label has its unit
    _, unit = split_unit(field)
    factor = varied is not None and varied.factor
    _, own = split_unit(name)
    if name == field or (own == unit and own not in ("", "-")):
        name = split_unit(name)[0]
    unit = "-" if factor else unit or _setting_unit(sweep, field)
    words = name.replace(".", " ").replace("_", " ")
    return f"{words} ({unit})" if unit else words


def _setting_unit(sweep: Sweep, field: str) -> str:
    """Unit of a controller's setting."""
    section, *between, setting = steps_of(field)
    if section != "controller":
        return ""
    chosen = sweep.plan.scenario.controller
    named = [chosen[k] for k in between if isinstance(k, int) and k < len(chosen)] or chosen
    units = {
        getattr(CONTROLLERS[each.name], "settings", {})[setting].unit
        for each in named
        if setting in getattr(CONTROLLERS[each.name], "settings", {})
    }
    return units.pop() if len(units) == 1 else ""


def _two(sweep: Sweep, x: str | None, y: str | None) -> tuple[str, str]:
    numbers = [name for name in sweep.parameters if sweep.table[name].dtype.kind in "if"]
    for name in (x, y):
        if name is not None:
            check_name("varied quantity", name, numbers)
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


def _side(
    axis: Axis, values: Sequence[float], limits: tuple[float, float], equal: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Middles and edges of the cells along an axis."""
    # Cells of equal width have their values as labels. Otherwise the axis ends at the limits:
    # beyond them there are no runs, and a quantity may have no negative values.
    at = np.asarray(values, float)
    if equal or len(at) == 1:
        axis.set_ticks(range(len(at)), [f"{value:.4g}" for value in at])
        return np.arange(len(at), dtype=float), np.arange(len(at) + 1) - 0.5
    inner = (at[:-1] + at[1:]) / 2
    return at, np.concatenate([[limits[0]], inner, [limits[1]]])


def _print_cells(axes: Axes, values: np.ndarray) -> None:
    """Print the numbers in cells of equal width."""
    for i, j in np.ndindex(*values.shape):
        if np.isfinite(values[i, j]):
            axes.text(j, i, f"{values[i, j]:.3g}", fontsize=6, ha="center", va="center")


def _contours(
    axes: Axes, x: np.ndarray, y: np.ndarray, values: np.ndarray, levels: Sequence[float]
) -> None:
    within = [level for level in levels if np.nanmin(values) < level < np.nanmax(values)]
    if within and min(values.shape) > 1:
        contour_lines(axes, x, y, values, within, "%g")


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
        axes.set_yticks(
            range(len(result)), [quantity_title(sweep, str(name)) for name in result.index]
        )
        axes.invert_yaxis()
        axes.set_xlabel(
            f"effect on {title_of(criterion)}" + f" ({unit})" * bool(unit) if morris
            else f"share of the variance of {title_of(criterion)}"
        )  # fmt: skip
        axes.set_title(as_written(sweep.one_controller(controller)))
        axes.grid(axis="y", visible=False)
        legend(figure, axes, "outside upper center")
    return figure
