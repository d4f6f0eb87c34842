"""Figure of the energy ledger: supplied, stored and dissipated energies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked

from .chart import OVER_TIME, Panel
from .panels import name_runs, over_time
from .style import DOUBLE_COLUMN, Look, label_outer, legend, new_figure, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..simulation.ledger import Ledger
    from ..simulation.result import Run

SINKS = (
    ("device_dissipation_J", "dissipated by all elements", "0.55", ""),
    ("structural_damping_J", "dissipated by structure", "0.8", "////"),
    ("device_stored_J", "stored in all elements", "0.93", "||||"),
    ("strain_J", "strain", "#A6CEE3", "\\\\\\\\"),
    ("kinetic_J", "kinetic", "white", "xxxx"),
)
"""Stored and dissipated energies from the bottom of the stack: attribute, label, shade, hatch."""

SUPPLY = {"input": Look("#000000"), "input + field work": Look("#D55E00", (4, 1.2))}
"""Looks of the lines of the supplied energy."""

INSTANTS = 900
"""Points per area: the resolution of a page's width. matplotlib does not simplify areas."""


@checked
def energy_figure(runs: Run | Mapping[str, Run] | Sequence[Run]) -> Figure:
    """Energy ledgers over time, one panel per run, and a panel of their closure errors.

    The closure errors fill the last row of panels, or have a row of their own.

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
        If there are no runs.
    """
    by_name = name_runs(runs)
    across = min(len(by_name), 2 if len(by_name) < 5 else 3)
    full, last = divmod(len(by_name), across)
    heights = [2.0] * full + [2.0 if last else 1.1]
    with style():
        figure = new_figure(DOUBLE_COLUMN, 1.1 + sum(heights))
        cells = figure.add_gridspec(full + 1, across, height_ratios=heights)
        axes: list[Axes] = []
        for k, (name, run) in enumerate(by_name.items()):
            shared = axes[0] if axes else None
            place = cells[k // across, k % across]
            panel = figure.add_subplot(place, sharex=shared, sharey=shared)
            draw_ledger(panel, run.energy, INSTANTS // across)
            panel.set_title(f"{name}\nclosure error {run.energy.closure_error:.1g}")
            axes.append(panel)
        label_outer(axes, across)
        residuals = figure.add_subplot(cells[full, last:])
        over_time(residuals, _residuals(by_name), list(by_name))
        residuals.set_xlabel(OVER_TIME)
        if last:
            residuals.set_title("closure errors")
            for panel in axes[: full * across]:
                panel.tick_params(labelbottom=False)
                panel.set_xlabel("")
        legend(figure, axes[0], "outside upper center")
        if len(by_name) > 1:
            legend(figure, residuals, "outside lower center")
    return figure


def draw_ledger(axes: Axes, ledger: Ledger, instants: int = INSTANTS) -> None:
    """Stack the stored and dissipated energies over time, under lines of the supplied energy."""
    drawn = instants_of(ledger, instants)
    time = ledger.time[drawn]
    tops = 1e-3 * np.cumsum([getattr(ledger, name)[drawn] for name, *_ in SINKS], axis=0)
    for layer, (top, (_, label, shade, hatch)) in enumerate(zip(tops, SINKS, strict=True)):
        # each layer extends to zero behind the layers below it, which halves the outline's points
        axes.fill(
            [time[0], *time, time[-1]],
            [0.0, *top, 0.0],
            label=label,
            facecolor=shade,
            hatch=hatch,
            edgecolor="0.35",
            linewidth=0.3,
            zorder=1 - 0.1 * layer,
        )
    for label, values in supply(ledger).items():
        axes.plot(time, values[drawn], label=label, **SUPPLY[label].print_keys())
    axes.margins(x=0)
    axes.set_xlabel("Time (s)")
    axes.set_ylabel("Energy (kJ)")


def _residuals(runs: Mapping[str, Run]) -> Panel:
    """Mismatch of supplied and spent energies over the peak input, over time."""
    lines = {}
    for name, run in runs.items():
        ledger, drawn = run.energy, instants_of(run.energy)
        spent = sum(getattr(ledger, sink) for sink, *_ in SINKS)
        peak = np.max(np.abs(ledger.input_J)) or 1.0
        residual = (ledger.input_J + ledger.field_work_J - spent) / peak
        lines[name] = ledger.time[drawn], residual[drawn]
    return Panel("Closure error", OVER_TIME, "Mismatch /\npeak input (-)", lines)


def instants_of(ledger: Ledger, instants: int = INSTANTS) -> slice:
    """Choose the instants to draw."""
    return slice(None, None, len(ledger.time) // instants + 1)


def supply(ledger: Ledger) -> dict[str, NDArray]:
    """Supplied energies without and with the field work, kJ."""
    energies = ledger.input_J, ledger.input_J + ledger.field_work_J
    return {label: 1e-3 * energy for label, energy in zip(SUPPLY, energies, strict=True)}
