"""Figures of runs for publication: legible in grey, units on every axis, one or two columns wide.

Figures are made without pyplot: they need not be closed, and no window opens. `save` writes them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from textwrap import fill
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ground_motions.argument_types import checked

from ..comparison import reference_name
from ..errors import InputError, check_name
from ..simulation.result import Run
from ..written_names import as_written
from . import chart, panels
from .energy import draw_ledger, energy_figure
from .style import DOUBLE_COLUMN, label_outer, legend, line_looks, new_figure, save, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpecBase


_MOST_TOGETHER = 4
"""Largest number of runs whose lines can be told apart in one panel over time."""

_LEAST_WIDTH, _ONE_COLUMN = 3.0, 5.0
"""Least width of a run's page, and largest width with all panels in a column, inches."""

_LETTERS = 13
"""Letters of a page's title on an inch."""

Runs: TypeAlias = Run | Mapping[str, Run] | Sequence[Run]

__all__ = [
    "currents",
    "energy_figure",
    "floor_envelopes",
    "floor_spectra",
    "loops",
    "loops_in_plan",
    "run_figure",
    "save",
    "time_histories",
]


@checked
def time_histories(runs: Runs, direction: str | None = None) -> Figure:
    """Ground acceleration, base displacement, roof acceleration and current over time.

    The current is that of the first coil; without coils this panel is missing. Up to four runs are
    drawn on each other. Of more runs, each has a row of panels with the run of ``passive_off``,
    or the first run, in grey.

    Parameters
    ----------
    runs : Run, mapping of str to Run, or sequence of Run
        Runs, by the name to print or by their controller's.
    direction : str, optional
        Direction of ground motion; the first by default.

    Returns
    -------
    matplotlib.figure.Figure
        Two columns wide.

    Raises
    ------
    InputError
        If there are no runs or no such direction.
    """
    by_name = panels.name_runs(runs)
    first = next(iter(by_name.values()))
    number = panels.direction_number(first, direction)
    if len(by_name) > _MOST_TOGETHER:
        return _histories_apart(by_name, number)
    with style():
        figure = new_figure(DOUBLE_COLUMN, 6.4)
        ratios = [0.7, 1.0, 1.0, 0.8][: 3 + _coils(by_name)]
        axes = _column(figure.add_gridspec(len(ratios), 1, height_ratios=ratios), sharex=True)
        _histories(axes, by_name, number)
        if len(by_name) > 1:
            legend(figure, axes[1], "outside upper center")
    return figure


@checked
def loops(runs: Runs, element: str | None = None) -> Figure:
    """Force over deformation of an isolator, one panel per run on the same axes.

    Parameters
    ----------
    runs : Run, mapping of str to Run, or sequence of Run
        Runs, by the name to print or by their controller's.
    element : str, optional
        Name of the element; the first along the first direction by default.

    Returns
    -------
    matplotlib.figure.Figure
        Two columns wide.

    Raises
    ------
    InputError
        If there are no runs or no such element.
    """
    by_name = panels.name_runs(runs)
    across = min(len(by_name), 4 if len(by_name) in (4, 7, 8) else 3)
    down = -(-len(by_name) // across)
    with style():
        figure = new_figure(DOUBLE_COLUMN, 0.3 + 2.2 * down)
        axes: list[Axes] = []
        for k, (name, run) in enumerate(by_name.items()):
            shared = axes[0] if axes else None
            panel = figure.add_subplot(down, across, k + 1, sharex=shared, sharey=shared)
            panels.loop(panel, run, _element(run, element))
            panel.set_title(name)
            axes.append(panel)
        label_outer(axes, across)
    return figure


@checked
def loops_in_plan(runs: Runs, element: str | None = None) -> Figure:
    """Orbits of a biaxial device's deformation and force, and its loops along x and y.

    Parameters
    ----------
    runs : Run, mapping of str to Run, or sequence of Run
        Runs, by the name to print or by their controller's.
    element : str, optional
        Name of the device's element along x; the first biaxial device by default.

    Returns
    -------
    matplotlib.figure.Figure
        Two columns wide, one row per run.

    Raises
    ------
    InputError
        If there are no runs, or the element is none of a biaxial device.
    """
    by_name = panels.name_runs(runs)
    isolated = next(iter(by_name.values())).isolated
    names = isolated.element_names
    pairs = {names[g[0]]: [names[e] for e in g[:2]] for g in isolated.groups if len(g) > 1}
    if not pairs:
        raise InputError(f"{isolated.structure.name} has no biaxial device; expected: one or more")
    if element is not None:
        check_name("biaxial device", element, pairs)
    pair = pairs[element or next(iter(pairs))]
    with style():
        figure = new_figure(DOUBLE_COLUMN, 0.3 + 2.0 * len(by_name))
        rows = figure.subplots(len(by_name), 4, squeeze=False)
        for (name, run), axes in zip(by_name.items(), rows, strict=True):
            panels.orbit(axes[0], run, pair, "deformation_m")
            panels.orbit(axes[1], run, pair, "force_N")
            for panel, each in zip(axes[2:], pair, strict=True):
                panels.loop(panel, run, each)
                panel.set_title(each, loc="left")
            axes[0].set_title(name, loc="left")
    return figure


@checked
def currents(runs: Runs) -> Figure:
    """Coil currents over time, one panel per run on the same axes, one line per channel.

    Parameters
    ----------
    runs : Run, mapping of str to Run, or sequence of Run
        Runs, by the name to print or by their controller's.

    Returns
    -------
    matplotlib.figure.Figure
        Two columns wide.

    Raises
    ------
    InputError
        If there are no runs, or none has a coil.
    """
    by_name = {name: run for name, run in panels.name_runs(runs).items() if run.isolated.n_channels}
    if not by_name:
        raise InputError("no run has a coil; expected: a run with a coil current")
    with style():
        figure = new_figure(DOUBLE_COLUMN, 0.6 + 1.1 * len(by_name))
        axes = _column(figure.add_gridspec(len(by_name), 1), sharex=True, sharey=True)
        for panel, (name, run) in zip(axes, by_name.items(), strict=True):
            drawn = chart.coil_currents(run)
            panels.over_time(panel, drawn, list(drawn.lines))
            panel.set_title(name, loc="left")
        axes[-1].set_xlabel("Time (s)")
        widest = max(axes, key=lambda panel: len(panel.lines))
        if len(widest.lines) > 1:
            legend(figure, widest, "outside upper center")
    return figure


@checked
def floor_envelopes(runs: Runs) -> Figure:
    """Peak absolute acceleration and peak drift over the height.

    Parameters
    ----------
    runs : Run, mapping of str to Run, or sequence of Run
        Runs, by the name to print or by their controller's.

    Returns
    -------
    matplotlib.figure.Figure
        Two columns wide; peaks of the vectors' norms over the directions of ground motion.

    Raises
    ------
    InputError
        If there are no runs.
    """
    by_name = panels.name_runs(runs)
    with style():
        figure = new_figure(DOUBLE_COLUMN, 3.2)
        left, right = figure.subplots(1, 2)
        panels.envelopes(left, right, by_name)
        if len(by_name) > 1:
            legend(figure, left, "outside upper center")
    return figure


@checked
def floor_spectra(runs: Runs, direction: str | None = None) -> Figure:
    """Response spectra of the absolute accelerations of the levels, 5 % damping.

    Parameters
    ----------
    runs : Run, mapping of str to Run, or sequence of Run
        Runs, by the name to print or by their controller's.
    direction : str, optional
        Direction of ground motion; the first by default.

    Returns
    -------
    matplotlib.figure.Figure
        Two columns wide, one panel per level.

    Raises
    ------
    InputError
        If there are no runs or no such direction.
    """
    by_name = panels.name_runs(runs)
    # many points, at which markers would hide each other
    looks = [replace(look, marker="") for look in line_looks(len(by_name))]
    return panels.grid(chart.floor_spectra(by_name, direction, looks), 3, 2.0)


@checked
def run_figure(
    run: Run, direction: str | None = None, element: str | None = None, width_in: float = 7.2
) -> Figure:
    """Draw one run on one page: time histories, loop, peaks over the height, energies.

    Parameters
    ----------
    run : Run
        A run.
    direction : str, optional
        Direction of ground motion of the histories; the first by default.
    element : str, optional
        Name of the element of the loop; the first along that direction by default.
    width_in : float, default 7.2, inches
        Width. Up to 5 inches, as for one column of 3.5 inches, all panels are below each other.

    Returns
    -------
    matplotlib.figure.Figure
        Two columns wide by default.

    Raises
    ------
    InputError
        If there is no such direction or element, or the width is below 3 inches.
    """
    if not width_in >= _LEAST_WIDTH:
        raise InputError("width_in", f"{width_in:g}", f"{_LEAST_WIDTH:g} or more")
    by_name = {run.controller: run}
    number = panels.direction_number(run, direction)
    # a structure without elements has no loop
    elements = [_element(run, element, number)] if run.isolated.elements or element else []
    with style():
        if width_in <= _ONE_COLUMN:
            figure = new_figure(width_in, 11.0)
            column = figure.add_gridspec(3, 1, height_ratios=[1.7, 1.8, 1])
            left, right, below = (column[k] for k in range(3))
        else:
            figure = new_figure(width_in, 9.0)
            page = figure.add_gridspec(2, 1, height_ratios=[2.6, 1])
            above, below = page[0].subgridspec(1, 2, width_ratios=[1.7, 1]), page[1]
            left, right = above[0], above[1]
        motions = ", ".join(record.name for record in run.records)
        title = f"{run.isolated.structure.name}, {motions}, {as_written(run.controller)}"
        figure.suptitle(fill(title, int(_LETTERS * width_in), break_on_hyphens=False), fontsize=9)
        histories = _column(left.subgridspec(3 + _coils(by_name), 1), sharex=True)
        _histories(histories, by_name, number)
        for panel, unit in zip(histories, ("m/s²", "mm", "m/s²"), strict=False):
            _mark_peak(panel, unit)
        *force, acceleration, drift = _column(right.subgridspec(2 + len(elements), 1))
        for panel, name in zip(force, elements, strict=True):
            panels.loop(panel, run, name)
        panels.envelopes(acceleration, drift, by_name)
        energy = figure.add_subplot(below)
        draw_ledger(energy, run.energy)
        legend(figure, energy, "outside lower center")
    return figure


def _histories_apart(runs: Mapping[str, Run], direction: int) -> Figure:
    """One row of panels per run, each before the reference in grey."""
    reference = reference_name(runs) or next(iter(runs))
    rows = [name for name in runs if name != reference]
    across = 2 + _coils(runs)
    with style():
        figure = new_figure(DOUBLE_COLUMN, 1.6 + 1.1 * len(rows))
        cells = figure.add_gridspec(len(rows) + 1, across)
        above = figure.add_subplot(cells[0, :])
        panels.ground_acceleration(above, runs[reference], direction)
        above.set_xlabel(chart.OVER_TIME)
        column: list[Axes] = []
        for k, name in enumerate(rows, 1):
            both = {reference: runs[reference], name: runs[name]}
            drawn = [*chart.base_and_roof(both, direction), chart.coil_current(both, 0)][:across]
            row = []
            for j, panel in enumerate(drawn):
                shared = column[j] if column else None
                axes = figure.add_subplot(cells[k, j], sharex=shared, sharey=shared)
                panels.before_reference(axes, panel, reference)
                axes.tick_params(labelbottom=k == len(rows))
                row.append(axes)
            row[0].set_title(name, loc="left")
            column = column or row
        for axes in row:
            axes.set_xlabel(chart.OVER_TIME)
        legend(figure, row[0], "outside upper center")
    return figure


def _histories(axes: list[Axes], runs: Mapping[str, Run], direction: int) -> None:
    panels.ground_acceleration(axes[0], next(iter(runs.values())), direction)
    drawn = [*chart.base_and_roof(runs, direction), chart.coil_current(runs, 0)]
    # without coils the panel of the current is missing
    for panel, what in zip(axes[1:], drawn, strict=False):
        panels.over_time(panel, what, list(runs))
    axes[-1].set_xlabel("Time (s)")
    axes[0].figure.align_ylabels(axes)


def _coils(runs: Mapping[str, Run]) -> bool:
    return any(run.isolated.n_channels for run in runs.values())


def _column(cells: GridSpecBase, sharex: bool = False, sharey: bool = False) -> list[Axes]:
    return list(cells.subplots(sharex=sharex, sharey=sharey, squeeze=False)[:, 0])


def _mark_peak(axes: Axes, unit: str) -> None:
    """Write the largest absolute value of a single line above its panel."""
    peak = np.max(np.abs(np.asarray(axes.lines[0].get_ydata())))
    axes.set_title(f"peak {peak:.3g} {unit}", loc="right", fontsize=7, pad=2)


def _element(run: Run, name: str | None, direction: int = 0) -> str:
    isolated = run.isolated
    names = isolated.element_names
    if not names:
        raise InputError(f"{isolated.structure.name} has no element; expected: one or more")
    if name is None:
        # that of the isolators
        return names[int(np.argmax(isolated.holding[:, direction] != 0))]
    check_name("element", name, names)
    return name
