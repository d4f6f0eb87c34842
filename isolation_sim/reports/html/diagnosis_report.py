"""The report of a diagnosis, in the order of its steps, and the files of its results."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ground_motions.registry import copy_code

from ...archive import FILE, save_archive
from ...discrepancy.diagnosis import (
    BuildingDiagnosis,
    Diagnosis,
    Step,
    Trace,
    groups_in_turn,
    relative_error,
    worst_first,
)
from ...discrepancy.interval import percent
from ...discrepancy.tiers.law_file import text_beside
from ...effects.effect import in_sentence
from ...effects.serialisation import device_places, device_section
from ...io.csv_table import write_table
from ...io.files import write_text
from ...io.results_folder import files_into, write_contents
from ...written_names import capital
from ..diagnosis import (
    RUNGS,
    better_law,
    cause_text,
    causes_tables,
    consequence_note,
    consequence_table,
    consequence_text,
    data_notes,
    equation_table,
    errors_table,
    is_unchanged,
    ladder_table,
    ladder_text,
    markdown,
    plan_table,
    remarks,
)
from ..diagnosis_figures import (
    LOOKS,
    STRONGEST,
    errors,
    errors_by_run,
    histories,
    loops,
    over_time,
    overview,
    residuals,
)
from ..references import of_device
from ..style import save
from .page import (
    Block,
    Bullets,
    Chart,
    Facts,
    Gallery,
    Key,
    LineChoice,
    Listing,
    Page,
    Prose,
    Section,
    Table,
    TimeRange,
    text_rows,
)
from .panels import panel_chart
from .run_report import code_facts, versions

if TYPE_CHECKING:
    from ...effects import Effect
    from ...laws.law import Law

_DEPENDENCE = "Dependence of the residual"
_HISTORIES, _PLANNED = 3, 12
_LAW_FILE = "extended_law.py"
_FUNCTIONS = ("motion", "current", "factor", "force", "rates")


def save_diagnosis(diagnosis: Diagnosis, folder: Path, overwrite: bool) -> list[Path]:
    """Write report, JSON, text, figures and extended law to a folder; return the files."""
    with files_into(folder, overwrite) as place:
        written = _write_files(diagnosis, place)
    return [folder / path.relative_to(place) for path in written]


def _write_files(diagnosis: Diagnosis, folder: Path) -> list[Path]:
    texts = {"diagnosis.json": diagnosis.to_json() + "\n", "report.md": markdown(diagnosis)}
    section = ""
    if diagnosis.extended is not None:
        comment = f"{diagnosis.model}, extended by a diagnosis of {diagnosis.data}"
        law, *effects = device_places(diagnosis.extended)
        if diagnosis.ladder is not None and diagnosis.ladder.law_text:
            texts[_LAW_FILE] = text_beside(diagnosis.ladder.law_text, folder)
            places = {law: f"{_LAW_FILE}:LAW"} | copy_code(effects, folder)
        else:
            places = copy_code([law, *effects], folder)
        section = device_section(diagnosis.extended, comment, places=places)
        texts["extended_law.toml"] = section
    written = [diagnosis_report(diagnosis, section).write(folder / "report.html")]
    written += [write_text(text, folder / name) for name, text in texts.items()]
    errors = [
        {"run": each.name, "held_out": each.held_out,
         "error_before": relative_error(each, each.before),
         "error_after": relative_error(each, each.after)}
        for each in diagnosis.traces
    ]  # fmt: skip
    written.append(write_table(errors, folder / "errors.csv"))
    if diagnosis.causes:
        causes = [
            {"cause": each.name, "form": each.form, "place": each.place, "share": each.share,
             "p_value": each.p_value,
             **{f"{name}, {one.unit}": one.value for name, one in each.parameters.items()}}
            for each in diagnosis.causes
        ]  # fmt: skip
        written.append(write_table(causes, folder / "causes.csv"))
    if diagnosis.traces:
        for stem, draw in ("loops", overview), ("residuals", residuals), ("errors", errors_by_run):
            written += save(draw(diagnosis), folder, stem)
    written.append(save_archive(diagnosis, folder / FILE))
    written.append(write_contents(folder, f"Diagnosis of {diagnosis.data}"))
    return written


def diagnosis_report(diagnosis: Diagnosis, section: str = "") -> Page:
    """Report of a diagnosis."""
    traces = worst_first(diagnosis.traces)
    code = code_facts(diagnosis.details.get("code", {}))
    parts: list[tuple[str, Sequence[Block]]] = [
        ("Verdict", [
            Prose((*data_notes(diagnosis), *better_law(diagnosis), *_verdict(diagnosis)), "verdict")
        ]),
        ("Measured against simulated", [*_measured(diagnosis, traces)]),
        ("Errors by run", [*_where(diagnosis, traces)]),
        ("Steps of the diagnosis", [*_steps(diagnosis)]),
        ("Causes", [*_causes(diagnosis)]),
        ("Tiers", [*_tiers(diagnosis)]),
        ("Extended law", [*_extended(diagnosis, section)]),
        ("Gain", [*_gain(diagnosis)]),
        ("Next test", [*_next_tests(diagnosis)]),
        ("Consequence for control", [*_consequence(diagnosis)]),
        ("Inputs and versions", [
            Facts({"Data": diagnosis.data, "Simulation": diagnosis.model, **code,
                   "Versions": versions()})
        ]),
        ("References", [*_references(diagnosis)]),
    ]  # fmt: skip
    return Page(
        f"Diagnosis: {diagnosis.data}",
        f"{capital(diagnosis.model)} against measured data",
        [Section(title, blocks) for title, blocks in parts if blocks],
    )


def _next_tests(diagnosis: Diagnosis) -> Iterator[Block]:
    if diagnosis.next_test:
        yield Prose((diagnosis.next_test,))
    plan = diagnosis.test_plan
    if plan is not None and plan.tests:
        yield Table.of(plan_table(plan, _PLANNED))
        further = len(plan.matrix) - _PLANNED
        if further > 0:
            yield Prose((f"isolation-sim plan-tests lists {further} more.",))
    if plan is not None and plan.notes:
        yield Prose(plan.notes)


def step_blocks(step: Step) -> list[Block]:
    """A step as text, with its table."""
    if not step.rows:
        return [Facts({step.title: step.text})]
    return [Prose((step.text,)), Table(step.title, step.headings, text_rows(step.rows))]


def _verdict(diagnosis: Diagnosis) -> tuple[str, ...]:
    before, after, noise = (
        (error.held_out, "on held-out data") if np.isfinite(diagnosis.error_before.held_out)
        else (error.fit, "on the fitted data")
        for error in (diagnosis.error_before, diagnosis.error_after, diagnosis.noise)
    )  # fmt: skip
    alone = f"; noise alone causes {percent(noise[0])} %" if np.isfinite(noise[0]) else ""
    first = (
        f"{capital(diagnosis.model)} has an RMS error of {percent(before[0], 3)} % "
        f"{before[1]}{alone}."
    )
    left = diagnosis.unexplained_share
    rest = f"; {100 * left:.0f} % of the misfit remains unexplained" if left > 0.005 else ""
    rung = diagnosis.ladder.offered if diagnosis.ladder is not None else ""
    if rung in ("equation", "learned"):
        return first, (
            f"{diagnosis.meaning} {capital(RUNGS[rung])} found in the data, see "
            f"Tiers, the error is {percent(after[0], 3)} %{rest}."
        )
    if not diagnosis.causes:
        return first, diagnosis.meaning, *remarks(diagnosis)
    names = ", ".join(
        ("a cause that acts like " if cause.acts_like else "")
        + in_sentence(cause.name)
        + (f" ({cause.form})" if cause.form and cause.name.startswith("outside") else "")
        for cause in diagnosis.causes
    )
    explained = (
        f"{diagnosis.verdict.replace('_', ' ').capitalize()} by {names}: with "
        f"{'these' if len(diagnosis.causes) > 1 else 'it'} the error is {percent(after[0], 3)} %"
        f"{rest}."
    )
    return first, explained, *remarks(diagnosis)


def _measured(diagnosis: Diagnosis, traces: Sequence[Trace]) -> Iterator[Block]:
    if not traces:
        return
    shown = groups_in_turn(traces)
    charts = [panel_chart(panel, _rms(trace), height=290)
              for panel, trace in zip(loops(shown), shown, strict=False)]  # fmt: skip
    each = ", every direction in turn" if len({trace.group for trace in traces}) > 1 else ""
    strongest = f" Over time the charts show the strongest {STRONGEST:.0f} s." * over_time(shown[0])
    one = "signal" if isinstance(diagnosis, BuildingDiagnosis) else "run"
    same = " No cause is named: before and after are the same." * is_unchanged(diagnosis)
    yield Prose((
        f"The {len(charts)} of {len(traces)} {one}s with the largest errors before{each}, each on "
        f"its own axes. Titles give the error of the whole {one} before and after.{same}"
        f"{strongest}",
    ))  # fmt: skip
    yield LineChoice(LOOKS, "Lines of all charts")
    yield Gallery(tuple(charts))
    charts = _over_time(diagnosis, traces)
    if isinstance(diagnosis, BuildingDiagnosis):
        yield TimeRange(*charts[0].figure["layout"]["xaxis"]["range"])
    yield from charts


def _over_time(
    diagnosis: Diagnosis, traces: Sequence[Trace], residual: bool = False
) -> list[Chart]:
    """The first runs, each over its own time; signals of one record over the same."""
    if not isinstance(diagnosis, BuildingDiagnosis):
        panels = histories(groups_in_turn(traces)[:_HISTORIES], residual)
        return [panel_chart(panel, height=215, linked=False) for panel in panels]
    worst = worst_first(traces)[0]
    # of a record in two parts, those of the same part
    same = [
        one for one in traces
        if one.time[0] < worst.time[-1] and worst.time[0] < one.time[-1]
    ]  # fmt: skip
    shown = groups_in_turn(same)[:_HISTORIES]
    start = min(float(trace.time[0]) for trace in shown)
    end = max(float(trace.time[-1]) for trace in shown)
    panels = histories(shown, residual)
    return [panel_chart(panel, height=215, xaxis={"range": [start, end]}) for panel in panels]


def _rms(trace: Trace) -> str:
    before, after = (percent(relative_error(trace, f)) for f in (trace.before, trace.after))
    return (
        f"RMS error of the simulation: {before} % of the measured signal before, {after} % after."
    )


def _where(diagnosis: Diagnosis, traces: Sequence[Trace]) -> Iterator[Block]:
    if traces:
        panel, names = errors(diagnosis), [trace.name for trace in traces]
        yield Key({}, panel.looks)
        yield panel_chart(
            panel, f"{names[0]} has the largest error; the table below gives the numbers.",
            ids=names, height=90 + 20 * len(names), margin={"l": 20},
        )  # fmt: skip
        yield _runs_table(traces)
        yield from _over_time(diagnosis, traces, residual=True)
    for step in diagnosis.steps:
        if step.title == _DEPENDENCE:
            yield from step_blocks(step)
    if diagnosis.depends_on:
        yield Prose(
            (f"Without causes, the residual depends on {', '.join(diagnosis.depends_on)}.",)
        )


def _runs_table(traces: Sequence[Trace]) -> Table:
    """Errors run by run, before and after."""
    rows = text_rows(
        (trace.name, "held out" if trace.held_out else "fitted",
         *(f"{100 * relative_error(trace, f):.2f}" for f in (trace.before, trace.after)))
        for trace in traces
    )  # fmt: skip
    return Table(
        caption="Residual over measured signal, both RMS",
        headings=("Run", "Used as", "Error before, %", "After, %"),
        rows=rows,
        filters=("Used as",) if len({trace.held_out for trace in traces}) > 1 else (),
    )


def _steps(diagnosis: Diagnosis) -> Iterator[Block]:
    before = ""
    for step in diagnosis.steps:
        if step.title == _DEPENDENCE:
            continue
        # rounds of a search have equal texts and different tables
        yield from step_blocks(step)[bool(step.rows) and step.text == before :]
        before = step.text


def _causes(diagnosis: Diagnosis) -> Iterator[Block]:
    if not diagnosis.causes:
        return
    for table in causes_tables(diagnosis):
        yield Table.of(table)
    yield Facts({cause.placed: cause_text(cause) for cause in diagnosis.causes})
    rivals = tuple(
        f"These data cannot distinguish {cause.name} from {', '.join(cause.confusable_with)}."
        for cause in diagnosis.causes
        if cause.confusable_with
    )
    if rivals:
        yield Prose(rivals, "warning")


def _tiers(diagnosis: Diagnosis) -> Iterator[Block]:
    if diagnosis.ladder is None:
        return
    yield Table.of(
        ladder_table(diagnosis.ladder, diagnosis.noise),
        note="Conditions left out: each condition is predicted by a model fitted without it."
        * any(np.isfinite(one.left_out) for one in diagnosis.ladder.rungs),
    )  # fmt: skip
    yield from map(Table.of, equation_table(diagnosis.ladder))
    yield Prose(tuple(ladder_text(diagnosis.ladder)))
    if diagnosis.ladder.law_text:
        yield Listing("The extended law, as a Python file", diagnosis.ladder.law_text)


def _extended(diagnosis: Diagnosis, section: str) -> Iterator[Block]:
    base, applied = _parts(diagnosis)
    if base is None or not applied:
        return
    yield Facts({
        "Law": f"{base.title} ({base.name}); {base.source}",
        **{
            f"Effect {effect.cause}": f"{effect.title} ({effect.form})"
            + ("" if effect.of_device else "; of the instruments: not in a simulation")
            for effect in applied
        },
    })  # fmt: skip
    yield Listing(f"Equations of {base.name}, from its file", equations(base))
    for effect in applied:
        yield Listing(f"Equations of {effect.cause}, from its file", equations(effect))
    if section:
        yield Listing("The extended law, as a scenario's [isolator] section", section)


def equations(part: Law | Effect) -> str:
    """Equations of a law or an effect: the description in its file, and its functions."""
    functions = [f for name in _FUNCTIONS if (f := getattr(part, name, None)) is not None]
    module = sys.modules[functions[0].__module__]
    # inherited functions, such as that for no states, carry no information
    own = [f for f in functions if f.__module__ == module.__name__]
    return "\n\n\n".join(
        [inspect.cleandoc(module.__doc__ or ""), *(inspect.getsource(f).rstrip() for f in own)]
    )


def _gain(diagnosis: Diagnosis) -> Iterator[Block]:
    yield Table.of(
        errors_table(diagnosis),
        note="The held-out data were not used in any fit." * bool(diagnosis.gain),
    )  # fmt: skip


def _consequence(diagnosis: Diagnosis) -> Iterator[Block]:
    if diagnosis.consequence is None:
        return
    yield Prose(tuple(consequence_text(diagnosis.consequence)))
    if diagnosis.consequence.performance:
        yield Table.of(
            consequence_table(diagnosis.consequence), note=consequence_note(diagnosis.consequence)
        )


def _references(diagnosis: Diagnosis) -> Iterator[Block]:
    if diagnosis.extended is not None:
        yield Bullets(tuple(citation.line for citation in of_device(diagnosis.extended)))


def _parts(diagnosis: Diagnosis) -> tuple[Law | None, list[Effect]]:
    """The evaluated law and its effects."""
    from ...effects.extend import separate

    if diagnosis.extended is None:
        return None, []
    device, applied = separate(diagnosis.extended)
    return device.law, [effect for effect, _ in applied]
