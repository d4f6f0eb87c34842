"""A published isolator law against the measurements of its own paper.

Li & Li print what they measured, effective stiffness and damping ratio of twelve loops at 1 Hz
(Table 1), and a law for the same device (Table 2). The diagnosis asks what that law lacks, its
parameters linear in the current as published. Yu et al. print a parameter set for every loop of the
same device at 1, 2 and 4 Hz; the loops that these sets describe, at 2 and 3 A where they agree with
Li & Li's stiffness, ask the same of its dependence on frequency.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.discrepancy.diagnosis import Diagnosis
from isolation_sim.discrepancy.loops.table import LoopTable
from isolation_sim.identification.loop_measures import loop_measures
from isolation_sim.laws import Device, hybrid, law
from isolation_sim.laws.published import CURRENTS_A, YU_ALPHA_N
from isolation_sim.written_names import capital
from studies.papers.tables import LI_LI_DAMPING_RATIO, LI_LI_STIFFNESS_N_PER_MM

from .papers.paper_002 import stiffness_and_energy
from .study import Outcome, Step

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLE = "A published isolator law against its own paper's measurements"
CYCLES = 16
"""Cycles of a computed test; all but the last four are for settling."""
POINTS = 256
"""Of a cycle."""
AGREEING = (2.0, 3.0)
"""Currents at which Yu et al. and Li & Li agree about the stiffness at 1 Hz, A."""
PUBLISHED, FITTED, EXTENDED = "as published", "fitted", "extended"
DEGREE = 1
"""Of the parameters' polynomials of the current, as published."""


def li_li() -> LoopTable:
    """Li & Li's Table 1."""
    rows = [
        (amplitude, 1.0, current, 1e3 * stiffness, damping)
        for amplitude, row in LI_LI_STIFFNESS_N_PER_MM.items()
        for current, stiffness, damping in zip(
            CURRENTS_A, row, LI_LI_DAMPING_RATIO[amplitude], strict=True
        )
    ]
    return _table("Li & Li, Table 1", rows)


def yu() -> LoopTable:
    """Loops that Yu et al.'s parameter sets describe."""
    rows = []
    for amplitude, frequency in YU_ALPHA_N:
        for current in AGREEING:
            x = 1e-3 * amplitude
            device = hybrid.condition(amplitude, frequency, current)
            stiffness, energy = stiffness_and_energy(device, x, current)
            damping = energy / (2 * np.pi * stiffness * x**2)
            rows.append((amplitude, frequency, current, stiffness, damping))
    return _table("Yu et al., Tables 1-4", rows)


def _table(name: str, rows: list[tuple[float, ...]]) -> LoopTable:
    amplitude, frequency, current, stiffness, damping = np.array(rows).T
    held_out = np.zeros(len(rows), bool)
    return LoopTable(name, 1e-3 * amplitude, frequency, current, stiffness, damping, held_out)


def loops(device: Device, table: LoopTable) -> tuple[NDArray, NDArray]:
    """Loops of a device in the tests of a table, integrated apart from the diagnosis."""
    tests = zip(table.amplitude, table.frequency, table.current, strict=True)
    stiffness, damping = np.array([_loop(device, *map(float, test)) for test in tests]).T
    return stiffness, damping


def _loop(
    device: Device, amplitude: float, frequency: float, current: float
) -> tuple[float, float]:
    """Effective stiffness (N/m) and damping ratio of a test, by a method for stiff equations."""
    from scipy.integrate import solve_ivp

    law, omega = device.law, 2 * np.pi * frequency
    parameters = tuple(map(float, device.parameters_at(current)))
    time = np.linspace(0, CYCLES / frequency, CYCLES * POINTS + 1)

    def motion(t: Any) -> tuple[Any, Any]:
        return amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)

    states = solve_ivp(
        lambda t, y: law.rates(*motion(t), tuple(y), parameters), (0, time[-1]),
        np.zeros(len(law.states)) if law.rest is None else law.rest(parameters),
        method="LSODA", t_eval=time, rtol=1e-8, atol=1e-10,
    ).y  # fmt: skip
    x, v = motion(time)
    force = law.force(x, v, tuple(states), parameters)
    measured = loop_measures(time, x, force, frequency=frequency, skip=CYCLES - 4)
    return measured.effective_stiffness.value, measured.damping_ratio.value


@dataclass(frozen=True, eq=False)
class TableDiagnosis:
    """A table, what was diagnosed in it, and what each law makes of its tests."""

    table: LoopTable  # What was measured
    diagnosis: Diagnosis  # Of the law fitted to it
    computed: dict[str, tuple[NDArray, NDArray]]  # By law, stiffness (N/m) and damping ratio


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    tables = [li_li()] if short else [li_li(), yu()]
    published = law("strain_stiffening")
    result = []
    for table in tables:
        step(f"diagnosing {table.name}", 0.0)
        diagnosis = diagnose(table, published.law, current_degree=DEGREE)
        diagnosis.save(folder / f"diagnosis_{table.name.split(' ')[0]}")
        assert diagnosis.nominal is not None and diagnosis.extended is not None
        laws = {PUBLISHED: published, FITTED: diagnosis.nominal, EXTENDED: diagnosis.extended}
        computed = {name: loops(device, table) for name, device in laws.items()}
        result.append(TableDiagnosis(table, diagnosis, computed))
        step(f"diagnosing {table.name}", 1 / len(tables))
    rows = [row for evaluated in result for row in _rows(evaluated)]
    return Outcome(rows, _finding(rows, result), {"loops": _figure(result)})


def _rows(evaluated: TableDiagnosis) -> list[dict[str, Any]]:
    table, diagnosis = evaluated.table, evaluated.diagnosis
    left_out = {FITTED: diagnosis.error_before.held_out, EXTENDED: diagnosis.error_after.held_out}
    rows = []
    for name, (stiffness, damping) in evaluated.computed.items():
        wrong = stiffness / table.stiffness - 1, damping / table.damping - 1
        rows.append({
            "data": table.name, "law": name, "stiffness, RMS error %": 100 * _rms(wrong[0]),
            "damping, %": 100 * _rms(wrong[1]), "both, %": 100 * _rms(np.concatenate(wrong)),
            "rows left out, %": 100 * left_out[name] if name in left_out else "",
            "causes": ", ".join(c.name for c in diagnosis.causes) if name == EXTENDED else "",
        })  # fmt: skip
    return rows


def _rms(values: NDArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _finding(rows: list[dict[str, Any]], result: list[TableDiagnosis]) -> str:
    sentences = []
    for evaluated in result:
        table, diagnosis = evaluated.table, evaluated.diagnosis
        published, fitted, extended = (row for row in rows if row["data"] == table.name)
        sentences.append(
            f"{table.name}: the published law misses stiffness and damping by "
            f"{_pair(published)} %, after a new fit by {_pair(fitted)} %"
        )
        if not diagnosis.causes:
            sentences[-1] += "; no effect of the catalogue lowers the error on rows left out."
            continue
        named = "; ".join(
            f"{cause.label} ({cause.form}) removes {100 * cause.share:.0f} % of the squared misfit"
            + (f", hardly to be distinguished from {', '.join(cause.confusable_with)}"
               if cause.confusable_with else "")
            for cause in diagnosis.causes
        )  # fmt: skip
        sentences[-1] += (
            f". {capital(named)}. Extended, the law misses them by "
            f"{_pair(extended)} %, and rows left out of its fit by "
            f"{extended['rows left out, %']:.1f} % (the fitted law "
            f"{fitted['rows left out, %']:.1f} %)."
        )
    return "\n".join(sentences)


def _pair(row: dict[str, Any]) -> str:
    return f"{row['stiffness, RMS error %']:.3g} and {row['damping, %']:.3g}"


def _figure(result: list[TableDiagnosis]) -> Figure:
    from isolation_sim.reports.style import DOUBLE_COLUMN, line_styles, new_figure, style

    with style():
        figure = new_figure(DOUBLE_COLUMN, 0.6 + 2.3 * len(result))
        panels = figure.subplots(len(result), 2, squeeze=False)
        for row, evaluated in zip(panels, result, strict=True):
            table = evaluated.table
            if np.ptp(table.frequency) > 0:
                shown = table.current == table.current.max()
                unit, x, group = "frequency, Hz", table.frequency, 1e3 * table.amplitude
                title, of = f"{table.name}, {table.current.max():g} A", "mm"
            else:
                shown = np.ones(len(table.amplitude), bool)
                unit, x, group = "amplitude, mm", 1e3 * table.amplitude, table.current
                title, of = f"{table.name}, {table.frequency[0]:g} Hz", "A"
            measured = 1e-3 * table.stiffness, table.damping
            for k, axes in enumerate(row):
                values = np.unique(group[shown])
                for value, look in zip(values, line_styles(len(values), markers=True), strict=True):
                    at = np.flatnonzero(shown & (group == value))
                    colour, marker = look["color"], look["marker"]
                    axes.plot(x[at], measured[k][at], marker, color=colour, label=f"{value:g} {of}")
                    for name, dashes in ((PUBLISHED, "--"), (EXTENDED, "-")):
                        y = evaluated.computed[name][k][at] * (1 if k else 1e-3)
                        axes.plot(x[at], y, dashes, color=colour)
                axes.set(xscale="log", xlabel=unit, title=title,
                         ylabel="damping ratio" if k else "effective stiffness, N/mm")  # fmt: skip
                axes.set_xticks(np.unique(x))
                axes.xaxis.set_major_formatter("{x:g}")
                axes.xaxis.set_minor_formatter("")
            row[0].set_yscale("log")
            low, high = row[0].get_ylim()
            row[0].set_yticks([tick for tick in (5, 10, 20, 50, 100) if low < tick < high])
            row[0].yaxis.set_major_formatter("{x:g}")
            row[0].yaxis.set_minor_formatter("")
            row[1].set_ylim(0, None)
            row[1].legend(ncols=2)
        for dashes, name in (("ko", "measured"), ("k--", PUBLISHED), ("k-", EXTENDED)):
            panels[0, 0].plot([], [], dashes, label=name)
        lines, names = panels[0, 0].get_legend_handles_labels()
        figure.legend(lines[-3:], names[-3:], loc="outside upper center", ncols=3)
    return figure
