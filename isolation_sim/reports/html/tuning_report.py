"""The report of a tuning: progress of the search, sensitivities, gains on each set of motions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...written_names import as_written
from ..sweep_figures import title_of
from ..tuning_tables import gains_texts, settings_texts
from .charts import Look, layout, numbers
from .page import (
    Block,
    Chart,
    Facts,
    Gallery,
    Key,
    Listing,
    Page,
    Prose,
    Section,
    Table,
    text_rows,
)
from .run_report import versions
from .text import capital

if TYPE_CHECKING:
    from ...tuning.tuning import Judgement, Tuning

_LOOKS = {
    "candidate": Look("#9a9a9a", "", "circle", "●"),
    "best so far": Look("#0072B2", "", "", ""),
    "tuned": Look("#D55E00", "", "diamond", "◆"),
}
_SCORE = "Mean score"


def tuning_report(tuning: Tuning) -> Page:
    """Report of a tuning."""
    content = tuning.content
    criteria = " + ".join(
        f"{weight:g} {title_of(name)}" for name, weight in content["criteria"].items()
    )
    parts: list[tuple[str, Sequence[Block]]] = [
        ("Verdict", [Prose(tuple(tuning.verdict()), "verdict")]),
        ("Gain", [_texts("Mean score with 95 % intervals", *gains_texts(tuning)),
                  *map(_by_motion, tuning.judged)]),
        ("Settings", [_texts("Settings before and after", *settings_texts(tuning))]),
        ("Search", [Key({}, _LOOKS), _progress(tuning)]),
        ("Sensitivity", [
            Prose(("Each setting over its range, with tuned values of the other settings, on the "
                   "motions of the tuning.",)),
            Gallery(tuple(_sensitivity(tuning, name) for name in tuning.sensitivity)),
        ]),
        ("Inputs and versions", [
            Facts({
                "Controller": f"{as_written(tuning.controller)} ({tuning.controller})",
                "Score": f"{criteria}, each over its value without current, minus the smallest "
                         "such sum of any constant current on the same motion",
                "Seeds": f"{content['seed']} of the search and the intervals, "
                         f"{2 * content['seed']} of a mixture tuned on, "
                         f"{2 * content['seed'] + 1} of an unseen one",
                "Command": content["command"],
                "Versions": versions(),
            }),
            Listing("The tuned controller, as a scenario's section", tuning.scenario_section()),
            Listing("The scenario", content["scenario"]),
        ]),
    ]  # fmt: skip
    return Page(
        f"Tuning report: {as_written(tuning.controller)}",
        f"{len(tuning.trials)} trials of {len(content['settings'])} settings",
        [Section(title, blocks) for title, blocks in parts],
    )


def _texts(caption: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    return Table(caption, tuple(map(capital, headings)), text_rows(rows))


def _by_motion(evaluated: Judgement) -> Table:
    columns = (evaluated.current, evaluated.constant, evaluated.before, evaluated.after)
    rows = (
        (name, *(f"{value:.3f}" for value in values))
        for name, *values in zip(evaluated.motions, *columns, strict=True)
    )
    headings = ("Motion", "Best constant current, A", "Its J", "Score before", "Score, tuned")
    return Table(capital(evaluated.name), headings, text_rows(rows))


def _progress(tuning: Tuning) -> Chart:
    means = np.array([trial.mean for trial in tuning.trials])
    at, best = np.arange(1, len(means) + 1), np.minimum.accumulate(means)
    points = _LOOKS["candidate"].line() | {
        "mode": "markers", "name": "candidate", "x": numbers(at), "y": numbers(means),
        "marker": {"symbol": _LOOKS["candidate"].symbol, "size": 4, "maxdisplayed": 0},
    }  # fmt: skip
    line = _LOOKS["best so far"].line(shape="hv") | {
        "mode": "lines", "name": "best so far", "x": numbers(at), "y": numbers(best),
    }  # fmt: skip
    # failed candidates have large scores, which would flatten the rest of the chart
    gain = float(best[0] - best[-1]) or 1.0
    shown = [best[-1] - 0.1 * gain, best[0] + 1.1 * gain]
    axes = layout("Trial", _SCORE, yaxis={"range": shown})
    summary = f"The mean score falls from {means[0]:.3f} to {best[-1]:.3f}."
    return Chart("Progress of the search", {"data": [points, line], "layout": axes}, summary)


def _sensitivity(tuning: Tuning, name: str) -> Chart:
    one, (values, scores) = tuning.content["settings"][name], tuning.sensitivity[name]
    line = _LOOKS["best so far"].line() | {"x": numbers(values), "y": numbers(scores)}
    data = [line | {"mode": "lines+markers", "name": name}]
    if name in tuning.best.settings:
        data.append(_LOOKS["tuned"].line() | {
            "mode": "markers", "name": "tuned", "x": numbers([tuning.best.settings[name]]),
            "y": numbers([tuning.best.mean]),
        })  # fmt: skip
    unit = f" ({one['unit']})" if one["unit"] else ""
    axes = layout(f"{name}{unit}", _SCORE, xaxis={"type": "log"} if one["scale"] == "log" else {})
    summary = f"Mean score from {min(scores):.3f} to {max(scores):.3f} over the range of {name}."
    return Chart(capital(one["meaning"]), {"data": data, "layout": axes}, summary)
