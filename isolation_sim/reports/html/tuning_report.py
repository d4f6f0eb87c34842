"""The report of a tuning: progress of the search, sensitivities, gains on each set of motions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...written_names import as_written, capital
from ..chart import Panel
from ..style import Look
from ..tables import title_of
from ..tuning_tables import gains_table, settings_table
from .page import Block, Chart, Facts, Gallery, Key, Listing, Page, Prose, Section, Table, text_rows
from .panels import panel_chart
from .run_report import versions

if TYPE_CHECKING:
    from ...tuning.tuning import Evaluation, Tuning

_LOOKS = {
    "candidate": Look("#9a9a9a", marker="o", joined=False),
    "best so far": Look("#0072B2"),
    "tuned": Look("#D55E00", marker="D", joined=False),
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
        ("Gain", [Table.of(gains_table(tuning), "Mean score with 95 % intervals"),
                  *map(_by_motion, tuning.outcomes)]),
        ("Settings", [Table.of(settings_table(tuning), "Settings before and after")]),
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
        f"{len(tuning.trials)} trials of {', '.join(content['settings'])}",
        [Section(title, blocks) for title, blocks in parts],
    )


def _by_motion(evaluated: Evaluation) -> Table:
    columns = (evaluated.current, evaluated.constant, evaluated.before, evaluated.after)
    rows = (
        (name, *(f"{value:z.3f}" for value in values))
        for name, *values in zip(evaluated.motions, *columns, strict=True)
    )
    headings = ("Motion", "Best constant current, A", "Its J", "Score before", "Score, tuned")
    return Table(capital(evaluated.name), headings, text_rows(rows))


def _progress(tuning: Tuning) -> Chart:
    means = np.array([trial.mean for trial in tuning.trials])
    at, best = np.arange(1, len(means) + 1), np.minimum.accumulate(means)
    # failed candidates have large scores, which would flatten the rest of the chart
    gain = float(best[0] - best[-1]) or 1.0
    panel = Panel(
        "Progress of the search", "Trial", _SCORE,
        {"candidate": (at, means), "best so far": (at, best)}, _LOOKS, steps=True,
        limits=(best[-1] - 0.1 * gain, best[0] + 1.1 * gain),
    )  # fmt: skip
    return panel_chart(panel, f"The mean score falls from {means[0]:z.3f} to {best[-1]:z.3f}.")


def _sensitivity(tuning: Tuning, name: str) -> Chart:
    one, (values, scores) = tuning.content["settings"][name], tuning.sensitivity[name]
    lines = {name: (np.array(values), np.array(scores))}
    if name in tuning.best.settings:
        lines["tuned"] = np.array([tuning.best.settings[name]]), np.array([tuning.best.mean])
    panel = Panel(
        capital(one["meaning"]), f"{name} ({one['unit']})" if one["unit"] else name, _SCORE, lines,
        {name: Look("#0072B2", marker="o"), "tuned": _LOOKS["tuned"]}, log_x=one["scale"] == "log",
    )  # fmt: skip
    low, high = min(scores), max(scores)
    return panel_chart(
        panel, f"Mean score from {low:z.3f} to {high:z.3f} over the range of {name}."
    )
