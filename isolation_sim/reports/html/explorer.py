"""Interactive charts of a sweep's runs; ``explorer.js`` draws them."""

from __future__ import annotations

import base64
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ...criteria import is_gain
from ...written_names import as_written
from ..style import light_shades
from ..sweep_tables import heading, value_text
from ..units import unit_of
from .charts import base64_floats, dashes, layout, looks, symbol
from .page import Chart, Explorer

if TYPE_CHECKING:
    import pandas

    from ...sweeps.result import Sweep

# limit that keeps the report of tens of thousands of runs small
_MOST_NUMBERS = 150_000
_MOST_LINES = 150
_MOST_VALUES, _INTERVALS = 12, 8
_BEST = 12
_AGAINST = "peak_base_displacement_m"


def explorer(sweep: Sweep, criterion: str) -> Explorer:
    """Runs of a sweep over the varied quantities: parallel axes, trade-off, map and best runs."""
    names = [name for name in sweep.criteria if not name.startswith(("energy_", "normalised_"))]
    names += [criterion] * (criterion not in names)
    runs = sweep.table[sweep.table["status"] == "ok"]
    shown, every = _select_rows(sweep, runs, criterion, len(names))
    fields = ["controller", *sweep.parameters]
    entries = [_field(shown[name]) for name in fields]
    look = looks(entries[0]["groups"])
    # a map over the quantities with most values; over controllers only if nothing else varies
    order = [k for k in range(1, len(fields)) if len(entries[k]["groups"]) > 1]
    pair = [*order, 0][:2] if order else []
    against = names.index(_AGAINST) if _AGAINST in names else 0
    # the peak over the floors is mostly the peak over all levels
    paths = [name for name in names if name.startswith("peak_") and "superstructure" not in name]
    data = {
        "fields": entries,
        "controller": 0,
        "looks": [
            {"colour": each.colour, "dashes": dashes(each), "symbol": symbol(each)}
            for each in look.values()
        ],
        "criteria": [
            {"name": heading(name), "more": is_gain(name),
             "values": base64_floats(shown[name] * unit_of(name)[1])}
            for name in names
        ],
        "paths": [names.index(name) for name in paths],
        "cases": base64_floats(shown["case"]),
        "criterion": names.index(criterion),
        "against": against,
        "across": pair[0] if len(pair) > 1 else None,
        "up": pair[1] if len(pair) > 1 else None,
        "best": _BEST,
        "lines": _MOST_LINES,
        "shades": _shades(),
        "note": _note(every, len(runs), len(shown)),
    }  # fmt: skip
    n_charts = sum(name.startswith("peak_") for name in names) + len(fields)
    return Explorer(data, _charts(n_charts, len(pair) > 1))


def _select_rows(
    sweep: Sweep, runs: pandas.DataFrame, criterion: str, n_criteria: int
) -> tuple[pandas.DataFrame, int]:
    """Rows to show, and the number n if only every n-th case is shown."""
    most = _MOST_NUMBERS // (n_criteria + len(sweep.parameters) + 1)
    every = -(-len(runs) // most)
    chosen = runs["case"] % every == 0
    for label in sweep.controllers:
        own = runs.loc[runs["controller"] == label, criterion]
        result = own.nlargest(_BEST) if is_gain(criterion) else own.nsmallest(_BEST)
        chosen |= runs.index.isin(result.index)
    return runs[chosen], every


def _field(column: pandas.Series) -> dict[str, Any]:
    """Values of a varied quantity for the selection, and the index of each run's value."""
    number = column.dtype.kind in "if"
    values = column.unique().tolist()
    if number:
        values.sort()
    if len(values) <= _MOST_VALUES or not number:
        word = as_written if column.name == "controller" else value_text
        groups = [word(value) for value in values]
        places = {value: place for place, value in enumerate(values)}
        codes = column.map(places).to_numpy()
    else:
        edges = np.linspace(values[0], values[-1], _INTERVALS + 1)
        groups = [f"{low:.3g} to {high:.3g}" for low, high in pairwise(edges)]
        codes = np.clip(np.searchsorted(edges, column, side="right") - 1, 0, _INTERVALS - 1)
    return {
        "name": str(column.name),
        "groups": groups,
        "codes": base64.b64encode(codes.astype("u1").tobytes()).decode("ascii"),
        "values": base64_floats(column) if number else None,
    }


def _charts(axes: int, mapped: bool) -> tuple[Chart, ...]:
    bare: dict[str, Any] = {"visible": False, "range": [-0.03, 1.03], "fixedrange": True}
    paths = layout(
        "", "", xaxis=bare, yaxis={"visible": False, "fixedrange": True},
        margin={"l": 10, "r": 10, "t": 6, "b": 6}, hovermode=False,
    )  # fmt: skip
    charts = [
        Chart(
            f"Runs over all quantities: the {_BEST} best in colour, the best one bold, others grey",
            {"data": [], "layout": paths},
            "Each axis is horizontal, with its smallest value at the left; the table lists the "
            "best runs.",
            height=64 * axes,
        ),
        Chart(
            "One criterion against another, one point per run",
            {"data": [], "layout": layout("", "", hovermode="closest")},
            "The table lists the best runs.", height=400,
        ),
    ]  # fmt: skip
    if mapped:
        charts.append(
            Chart(
                "Median over two quantities",
                {"data": [], "layout": layout("", "", hovermode="closest")},
                "One cell per pair of values; median over all other quantities.", height=400,
            )
        )  # fmt: skip
    return tuple(charts)


def _shades() -> list[list[Any]]:
    """Colours of the printed maps, as a Plotly colour scale."""
    from matplotlib.colors import to_hex

    shades = light_shades()
    return [[float(at), to_hex(shades(at))] for at in np.linspace(0.0, 1.0, 7)]


def _note(every: int, total: int, shown: int) -> str:
    if every == 1:
        return f"All {total:,} successful runs."
    return (
        f"{shown:,} of the {total:,} successful runs: one of every {every} cases, and the "
        f"{_BEST} best of each controller."
    )
