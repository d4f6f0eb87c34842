"""Tables written from what the program knows: effects, controllers, formats, papers, references."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from types import ModuleType

from markdown import table, written

from controllers import CONTROLLERS, Controller
from isolation_sim.effects import EFFECTS
from isolation_sim.reports.publications import PUBLICATIONS
from isolation_sim.scenario import Scenario
from isolation_sim.structures import reference_building, reference_isolators
from studies import tuned_controllers
from studies.papers.study import PAPERS
from studies.papers.table import Check, tally, texts


def write_tables(folder: Path, short: bool = False) -> None:
    """Write the tables, a file each, to be included by pages.

    Parameters
    ----------
    folder : pathlib.Path
        Where to.
    short : bool, optional
        Whether tables of studies have fewer cases: two controllers, one paper.
    """
    folder.mkdir(parents=True, exist_ok=True)
    texts = {
        "effects": effects(),
        "controllers": controllers(),
        "mpc_settings": settings(CONTROLLERS["mpc"]),
        "references": references(),
        "scenario": f"```toml\n{Scenario().to_toml(comments=True)}```\n",
        "papers": papers(short),
        "tallies": tallies(short),
        "periods": periods(),
        "tuned": tuned(short),
    }
    for name, text in texts.items():
        (folder / f"{name}.txt").write_text(text, encoding="utf-8")


def periods() -> str:
    """Period and damping of the reference building's isolation layer against the current.

    Returns
    -------
    str
        MyST text.
    """
    isolators = reference_isolators()
    mass = float(reference_building().mass.trace())
    rows = []
    for current in (0.0, 1.0, 1.5, 2.0, 3.0):
        stiffness = isolators.linearised(current, frequency_hz=0.5)
        period = 2 * math.pi * math.sqrt(mass / stiffness.real)
        loss = stiffness.imag / stiffness.real
        rows.append((f"{current:g}", f"{1e-6 * stiffness.real:.2f}", f"{period:.2f}",
                     f"{loss / 2:.2f}"))  # fmt: skip
    headings = ("current, A", "storage stiffness, kN/mm", "period, s", "damping ratio")
    return table(headings, rows, "Reference isolators, small motion at 0.5 Hz")


def effects() -> str:
    """Every form of every effect, with its parameters.

    Returns
    -------
    str
        MyST text.
    """
    rows = []
    for cause, forms in EFFECTS.items():
        for k, form in enumerate(forms):
            parameters = "; ".join(
                f"`{q.name}`{f' ({q.unit})' if q.unit != '1' else ''}, {written(q.meaning)}"
                for q in form.parameters
            )
            rows.append((
                f"`{cause}`" if k == 0 else "", f"`{form.form}`", parameters,
                ", ".join(sorted(form.needs)) or "", written(form.source),
            ))  # fmt: skip
    headings = ("cause", "form", "parameters", "needs also", "source")
    return table(headings, rows)


def controllers() -> str:
    """Every controller with its settings.

    Returns
    -------
    str
        MyST text.
    """
    parts = []
    for name, kind in CONTROLLERS.items():
        parts += [
            f"## `{name}`: {kind.title}",
            f"{written((kind.__doc__ or '').splitlines()[0])}"
            + (f" Source: {written(kind.source)}." if kind.source else ""),
            settings(kind),
        ]
    return "\n\n".join(parts)


def settings(kind: type[Controller]) -> str:
    """Settings of a controller, from their declarations.

    Parameters
    ----------
    kind : type
        The controller's class.

    Returns
    -------
    str
        MyST text, empty without settings.
    """
    # a column per preset, and one for the search ranges, where there are any
    presets = {preset: dict(values) for preset, values in kind.presets.items()}
    searched = any(s.search for s in kind.settings.values())
    headings = ("setting", "meaning", "unit", "default", *presets, "accepts")
    rows = [
        (f"`{key}`", written(s.meaning), s.unit, f"`{s.default}`",
         *(f"`{values.get(key, s.default)}`" for values in presets.values()),
         written(str(s.accepts)), *((str(s.search or ""),) if searched else ()))
        for key, s in kind.settings.items()
    ]  # fmt: skip
    headings += ("tuned in",) if searched else ()
    return table(headings, rows) if rows else ""


def tuned(short: bool) -> str:
    """Scores of the tuned controllers, as the study of them finds them.

    Parameters
    ----------
    short : bool
        Whether in its short form.

    Returns
    -------
    str
        MyST text.
    """
    result = tuned_controllers.outcome(Path(), short, lambda what, share=0.0: None)
    rows = [
        (row["motions"], f"`{row['controller']}`",
         *(f"{row[what]:+.2f} ({row[f'{what}_from']:+.2f} to {row[f'{what}_to']:+.2f})"
           for what in ("published", "tuned")),
         f"{row['beats_constant']} of {row['number']}")
        for row in result.table
    ]  # fmt: skip
    headings = ("motions", "controller", "as published", "as tuned", "tuned beats constant in")
    return f"{table(headings, rows)}\n\n{result.finding.replace(chr(10), chr(10) * 2)}"


def references() -> str:
    """The literature, as ``isolation-sim cite`` prints it.

    Returns
    -------
    str
        MyST text.
    """
    return "\n".join(f"- {written(text)}" for text in sorted(set(PUBLICATIONS.values()))) + "\n"


def papers(short: bool) -> str:
    """Every number of the four papers beside the recomputed one.

    Parameters
    ----------
    short : bool
        Whether of the last paper alone.

    Returns
    -------
    str
        MyST text.
    """
    parts = []
    for paper, checks in _checks(short):
        rows = [_row(check) for check in checks]
        headings = ("number", "where", "published", "computed", "verdict", "remark")
        parts += [f"## {written(paper.TITLE)}", f"{written(tally(checks))}.",
                  table(headings, rows)]  # fmt: skip
    return "\n\n".join(parts)


def tallies(short: bool) -> str:
    """Number of verdicts of each kind, paper by paper.

    Parameters
    ----------
    short : bool
        Whether of the last paper alone.

    Returns
    -------
    str
        MyST text.
    """
    rows = [(written(paper.TITLE), written(tally(checks))) for paper, checks in _checks(short)]
    return table(("paper", "verdicts"), rows)


@cache
def _checks(short: bool) -> list[tuple[ModuleType, list[Check]]]:
    papers = list(PAPERS.values())[-1 if short else 0 :]
    return [(paper, list(paper.checks(True))) for paper, _ in papers]


def _row(check: Check) -> tuple[str, ...]:
    unit = f"\u00a0{check.unit}" if check.unit else ""  # stays with its number
    return (
        written(check.what), written(check.where),
        written(f"{check.published}{unit}") if check.published else "",
        "" if check.computed is None else written(f"{check.computed:.5g}{unit}"),
        check.judgement, written(texts(check)[-1]),
    )  # fmt: skip
