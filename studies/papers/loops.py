"""Figures of loops: force against displacement and velocity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from isolation_sim.reports.style import legend, line_styles, new_figure, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


Loops = Mapping[str, tuple[np.ndarray, ...]]


def draw_loops(rows: Sequence[tuple[str, Loops]], force_unit: str = "N", title: str = "") -> Figure:
    """Draw force against displacement and velocity."""
    factor = {"N": 1.0, "kN": 1e-3}[force_unit]
    with style():
        figure = new_figure(7.2, 0.7 + 2.5 * len(rows))
        panels = figure.subplots(len(rows), 2, squeeze=False)
        for (name, loops), (left, right) in zip(rows, panels, strict=True):
            for (label, (x, v, force)), line in zip(
                loops.items(), line_styles(len(loops)), strict=True
            ):
                line = line | {"marker": ""} if len(loops) <= 4 else line
                line["markevery"] = max(len(x) // 12, 1)
                left.plot(1e3 * x, factor * force, label=label, **line)
                right.plot(1e3 * v, factor * force, **line)
            left.set(xlabel="displacement (mm)", ylabel=f"force ({force_unit})", title=name)
            right.set(xlabel="velocity (mm/s)", ylabel=f"force ({force_unit})", title=name)
        finish(figure, panels[0, 0], title)
    return figure


def finish(figure: Figure, explained: Axes, title: str = "") -> None:
    """Put a figure's title above and the legend of one panel below."""
    if title:
        figure.suptitle(title, fontsize=9)
    if explained.get_legend_handles_labels()[1]:
        legend(figure, explained, "outside lower center")
