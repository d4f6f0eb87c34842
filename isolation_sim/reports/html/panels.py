"""Panels as charts of a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..chart import OVER_TIME, Panel
from ..style import BAND, Look
from .charts import choose_samples, layout, line, numbers, over, peaks
from .page import Chart

_LABEL = 20
"""Height of a row's name, px."""
_ROOM = 0.03
"""Share of a loop's width that is left free beside it."""
_LOGARITHMIC = {"type": "log", "dtick": "D2", "tickformat": "~g"}
"""Plotly keys of an axis."""


def panel_chart(
    panel: Panel, summary: str = "", *, looks: Mapping[str, Look] | None = None,
    ids: Sequence[str] = (), most: int = 4000, height: int = 230, linked: bool = True, **axes: Any,
) -> Chart:  # fmt: skip
    """Draw a panel; charts over time that are linked zoom together."""
    # ``ids``: rows of the page's filtered table at the points; ``most``: largest number of points
    # of a line over time; ``axes``: keys of plotly's layout
    is_history = panel.x == OVER_TIME
    traces = []
    for name, (x, y) in panel.lines.items():
        look = {**(looks or {}), **panel.looks}[name]
        keep = choose_samples(most, y) if is_history else slice(None)
        pair = over(x[keep], y[keep]) if is_history else {"x": numbers(x), "y": numbers(y)}
        shape = {"shape": "hv"} if panel.steps and look.joined else {}
        traces.append(line(name, look, **shape) | pair | {"meta": panel.groups.get(name, name)})
        if ids and not look.joined:
            traces[-1] |= {
                "ids": list(ids), "text": list(ids),
                "unselected": {"marker": {"opacity": 0.07}},
                "hovertemplate": "%{text}: %{x:.4g}, %{y:.4g}<extra></extra>",
            }  # fmt: skip
    across: dict[str, Any] = {}
    if panel.log_x:
        across = dict(_LOGARITHMIC)
    elif is_history:
        across["range"] = [float(f(t[k] for t, _ in panel.lines.values()))
                           for f, k in ((min, 0), (max, -1))]  # fmt: skip
    elif panel.reach is not None:
        across["range"] = [0.0, panel.reach]
    elif panel.lines:
        # plotly leaves no room beside lines: the ends of loops would lie on the edge
        all_x = np.concatenate([np.ravel(x) for x, _ in panel.lines.values()])
        low, high = float(np.nanmin(all_x)), float(np.nanmax(all_x))
        if low < 0 < high:
            across["range"] = [low - _ROOM * (high - low), high + _ROOM * (high - low)]
    up: dict[str, Any] = dict(_LOGARITHMIC) if panel.log_y else {}
    if panel.limits is not None:
        up["range"] = list(panel.limits)
    if panel.rows:
        n = len(panel.rows)
        every = -(-n // ((height - 80) // _LABEL))
        ticks = {"tickvals": list(range(0, n, every)), "ticktext": panel.rows[::every]}
        up |= {**ticks, "automargin": True}
    axes_layout = layout(
        panel.x, panel.y.replace("\n", " "), xaxis=across, yaxis=up,
        hovermode="x" if is_history else "closest",
    )  # fmt: skip
    for key, value in axes.items():
        axes_layout[key] |= value
    if panel.band is not None:
        low, high = panel.band
        axes_layout["shapes"] = [{
            "type": "rect", "yref": "paper", "x0": low, "x1": high, "y0": 0, "y1": 1,
            "fillcolor": BAND, "line": {"width": 0}, "layer": "below",
        }]  # fmt: skip
    values = {name: y for name, (_, y) in panel.lines.items()}
    return Chart(
        f"{panel.title}: {panel.note}" if panel.note else panel.title,
        {"data": traces, "layout": axes_layout}, summary or peaks(values, panel.unit),
        "time" if is_history and linked else "", height,
    )  # fmt: skip
