"""The report of a sweep, with interactive charts of its runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from typing import TYPE_CHECKING

from ...criteria import is_gain
from ...errors import InputError, check_name
from ...written_names import as_written, capital
from ..sweep_tables import heading, median_cells, medians_title, sensitivity_table, value_text
from ..tables import best_note, ratios_note, title_of
from ..units import unit_of
from .charts import looks
from .explorer import explorer
from .page import (
    Block,
    Facts,
    Key,
    Page,
    Prose,
    Section,
    Table,
    marked_row,
    table_note,
    text_rows,
)
from .run_report import versions

if TYPE_CHECKING:
    from ...sweeps.result import Sweep

_MOST_FAILED = 200


def sweep_report(sweep: Sweep, criterion: str) -> Page:
    """Report of a sweep."""
    check_name("criterion", criterion, sweep.criteria)
    varied = ", ".join(sweep.parameters) or "nothing"
    any_good = bool((sweep.table["status"] == "ok").any())
    chosen: list[Block] = []
    if any_good:
        chosen = [Key({}, looks([*map(as_written, sweep.controllers)])), explorer(sweep, criterion)]
    parts: list[tuple[str, Sequence[Block]]] = [
        ("Verdict", [Prose(_verdict(sweep, criterion), "verdict"), *warnings_of(sweep)]),
        ("Controllers side by side", [_medians(sweep)] if any_good else []),
        ("Explore the runs", chosen),
        ("Sensitivity", [*_sensitivity(sweep, criterion)]),
        ("Failed runs", [*_failed(sweep)]),
        ("Inputs and versions", [
            Facts({
                "Sweep": sweep.name + _state(sweep),
                "Varied": varied,
                "Controllers": ", ".join(map(as_written, sweep.controllers)),
                "All numbers": "table.npz in the sweep's folder; isolation-sim sweep show "
                               "FOLDER --csv FILE writes them as CSV",
                "Versions": versions(),
            })
        ]),
    ]  # fmt: skip
    return Page(
        f"Sweep: {sweep.name}",
        f"{len(sweep.table):,} runs{_state(sweep)}, {varied} varied",
        [Section(title, blocks) for title, blocks in parts if blocks],
    )


def _state(sweep: Sweep) -> str:
    return "" if sweep.finished else ", unfinished"


def warnings_of(sweep: Sweep) -> list[Block]:
    """Warnings about the validity of the results."""
    lines = sweep.warnings()
    return [Prose(tuple(f"Warning: {each}." for each in lines), "warning")] if lines else []


def _verdict(sweep: Sweep, criterion: str) -> tuple[str, str]:
    table = sweep.table
    failed = len(sweep.failed)
    first = (
        ""
        if sweep.finished
        else (
            "This sweep is unfinished: the report has the runs so far. isolation-sim sweep PLAN "
            "--resume continues it. "
        )
    )
    first += (
        f"{len(table):,} runs: {table['case'].nunique():,} cases under "
        f"{len(sweep.controllers)} controller{'s' * (len(sweep.controllers) != 1)}; "
        f"{f'{failed:,} failed' if failed else 'none failed'}."
    )
    good = table[table["status"] == "ok"]
    if good.empty:
        return first, "No run was successful; there is nothing to compare."
    place = good[criterion].idxmax() if is_gain(criterion) else good[criterion].idxmin()
    best = good.loc[place]
    unit, factor = unit_of(criterion)
    varied = ", ".join(f"{name} {value_text(best[name])}" for name in sweep.parameters)
    texts = good[criterion].mul(factor).map("{:.4g}".format)
    alike = (good["case"] == best["case"]) & (texts == texts[place])
    return first, (
        f"The {'highest' if is_gain(criterion) else 'lowest'} {title_of(criterion)}, "
        f"{f'{texts[place]} {unit}'.strip()}, is that of "
        f"{' and '.join(map(as_written, good['controller'][alike]))} in "
        f"case {best['case']}{f' ({varied})' if varied else ''}."
    )


def _medians(sweep: Sweep) -> Table:
    medians = median_cells(sweep)
    reference = None if sweep.reference is None else as_written(sweep.reference)
    return Table(
        capital(medians_title(sweep)),
        ("Criterion", *map(as_written, sweep.controllers)),
        tuple(marked_row(heading(name), cells) for name, cells in medians.items()),
        table_note(best_note(chain(*medians.values())), ratios_note(medians, reference)),
    )


def _sensitivity(sweep: Sweep, criterion: str) -> Iterator[Block]:
    if not sweep.finished or not sweep.sampled:
        return
    for label in sweep.controllers:
        try:
            table = sensitivity_table(sweep, criterion, label)
        except InputError as error:
            # the rest of the report does not depend on it
            yield Prose((f"No sensitivity of {as_written(label)}: {error}.",), "warning")
            continue
        yield Table.of(table, capital(table.title))


def _failed(sweep: Sweep) -> Iterator[Block]:
    failed = sweep.failed
    if failed.empty:
        return
    names = ["controller", "status", "reason", *sweep.parameters]
    shown = failed.head(_MOST_FAILED)
    rows = text_rows(
        (str(case), as_written(controller), *map(value_text, values))
        for case, (controller, *values) in zip(
            shown["case"], shown[names].astype(object).to_numpy(), strict=True
        )
    )
    if len(shown) < len(failed):
        yield Prose((f"The first {len(shown)} of {len(failed):,}.",))
    yield Table(
        caption="Runs that failed, and why",
        headings=("Case", *names),
        rows=rows,
        filters=("controller", "status"),
    )
