"""Figure of a fit: measured and modelled force-deformation loops."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .style import DOUBLE_COLUMN, label_outer, legend, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..identification.fitted import LawEvaluation, RunError

_MOST_PANELS = 18


def fitted_loops(fit: LawEvaluation) -> Figure:
    """Measured and modelled loops of the runs of a fit or an evaluation, one panel per run."""
    errors = fit.errors[:: -(-len(fit.errors) // _MOST_PANELS)]
    across = min(len(errors), 4 if len(errors) > 9 else 3)
    down = -(-len(errors) // across)
    peak = max(float(np.abs(e.run.force).max()) for e in errors)
    unit, scale = ("kN", 1e-3) if peak >= 2e3 else ("N", 1.0)
    with style():
        figure = new_figure(DOUBLE_COLUMN, 0.5 + DOUBLE_COLUMN / across * down)
        # each on its own axes, since small loops may have the largest relative errors
        panels = figure.subplots(down, across, squeeze=False).ravel()
        for panel, error in zip(panels, errors, strict=False):
            _draw(panel, error, scale)
            panel.set_xlabel("Deformation (mm)")
            panel.set_ylabel(f"Force ({unit})")
        for panel in panels[len(errors) :]:
            panel.remove()
        label_outer(list(panels[: len(errors)]), across, ticks=False)
        legend(figure, panels[0], "outside upper center")
    return figure


def _draw(panel, error: RunError, scale: float) -> None:
    run = error.run
    # a few cycles are enough to see, and the file stays small
    shown = slice(-min(len(run.time), 1500), None)
    x = 1e3 * run.displacement[shown]
    panel.plot(x, scale * run.force[shown], color="0.65", lw=2.5, label="measured")
    modelled = {"color": "black", "ls": (0, (3, 1)), "lw": 0.8, "label": "modelled"}
    panel.plot(x, scale * error.force[shown], **modelled)
    held = ", held out" if run.hold_out else ""
    panel.set_title(f"{run.name}\n{100 * error.relative:.1f} %{held}", fontsize=6.5)
