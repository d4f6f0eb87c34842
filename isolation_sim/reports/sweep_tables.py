"""Tables of a sweep and of a study, in engineering units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING, Any

from ..criteria import is_gain
from ..written_names import as_written, number_text
from .tables import RATIOS, TextTable, best_note, is_reference, mark_best, title_of
from .units import unit_of

if TYPE_CHECKING:
    from ..sweeps.result import Sweep


def controllers_table(sweep: Sweep) -> TextTable:
    """Median of every peak and RMS value, and of J1 to J9, one column per controller."""
    medians = median_cells(sweep)
    rows = [
        (title_of(name), unit_of(name)[0], *(f"{text}{'*' if best else ' '}" for text, best in row))
        for name, row in medians.items()
    ]
    return TextTable(
        f"{sweep.name}: {medians_title(sweep)}",
        ("", "unit", *map(as_written, sweep.controllers)), rows, keys=2,
        caption=best_note(chain(*medians.values())),
    )  # fmt: skip


def medians_title(sweep: Sweep) -> str:
    """What the medians are taken over."""
    failed = len(sweep.failed)
    left_out = f", {failed} failed run{'s' * (failed > 1)} left out" if failed else ""
    state = "" if sweep.finished else ", unfinished"
    return f"medians over {sweep.table['case'].nunique()} cases{left_out}{state}"


def median_cells(sweep: Sweep) -> dict[str, list[tuple[str, bool]]]:
    """Median of every peak and RMS value, and of J1 to J9, as text, and whether it is the best."""
    medians = sweep.table.groupby("controller", sort=False)[list(sweep.criteria)].median()
    cells = {}
    alone = len(sweep.controllers) == 1 and is_reference(medians.iloc[0])
    for name in sweep.criteria:
        if name.startswith(("energy_", "normalised_")) or (alone and name in RATIOS):
            continue
        values = [float(value) * unit_of(name)[1] for value in medians[name]]
        cells[name] = mark_best(values, max if is_gain(name) else min)
    return cells


def heading(criterion: str) -> str:
    """A criterion in words, with its printed unit."""
    unit, _ = unit_of(criterion)
    return f"{title_of(criterion)}, {unit}" if unit else title_of(criterion)


def value_text(value: Any) -> str:
    """A varied quantity's value as text."""
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def best_table(sweep: Sweep, criterion: str, count: int) -> TextTable:
    """Runs with the best criterion."""
    _, factor = unit_of(criterion)
    rows = [
        [str(row["case"]), number_text(row[criterion] * factor), as_written(row["controller"]),
         *(value_text(row[name]) for name in sweep.parameters)]
        for _, row in sweep.best(criterion, count).iterrows()
    ]  # fmt: skip
    title = f"{'highest' if is_gain(criterion) else 'lowest'} {title_of(criterion)}"
    headings = ("case", heading(criterion), "controller", *sweep.parameters)
    return TextTable(title, headings, rows)


def sensitivity_table(sweep: Sweep, criterion: str, controller: str) -> TextTable:
    """Sensitivity indices of the sampled quantities."""
    result = sweep.sensitivity(criterion, controller)
    headings = ("quantity", *(name.replace("_conf", " ±") for name in result.columns))
    rows = [
        [str(quantity), *(f"{value:.3g}" for value in row)] for quantity, row in result.iterrows()
    ]
    title = f"sensitivity of {title_of(criterion)}, {as_written(controller)}"
    return TextTable(title, headings, rows)


Records = Sequence[Mapping[str, Any]]
"""One row per case; headings end in the SI unit; None for a missing number."""


def study_table(records: Records, title: str) -> TextTable:
    """Format a study's table for the terminal, in engineering units."""
    words = [any(isinstance(record.get(key), str) for record in records) for key in _keys(records)]
    # the words at the beginning of a row identify the case
    keys = max(1, next((k for k, word in enumerate(words) if not word), len(words)))
    return TextTable(title, *study_texts(records), keys=keys)


def study_texts(records: Records) -> tuple[list[str], list[list[str]]]:
    """Write a study's table as text, in engineering units."""
    keys = _keys(records)
    headings = [heading(key).replace("_", " ") for key in keys]
    return headings, [[_cell_text(key, record.get(key, "")) for key in keys] for record in records]


def _keys(records: Records) -> list[str]:
    return list(dict.fromkeys(key for record in records for key in record))


def _cell_text(key: str, value: Any) -> str:
    if value is None:
        return "never"
    if key == "controller":
        return as_written(value)
    if isinstance(value, float):
        return f"{value * unit_of(key)[1]:.3g}"
    return str(value)
