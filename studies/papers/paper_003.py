"""Linearised Bouc-Wen: dynamic stiffness of an MR elastomer against amplitude, field, frequency."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from isolation_sim.laws import linearised_bouc_wen as lbw
from isolation_sim.laws.published import (
    LINEARISED_AMPLITUDES_MM,
    LINEARISED_FIELDS_T,
    LINEARISED_FREQUENCIES_HZ,
    LINEARISED_REGRESSION_PRINTED,
)
from isolation_sim.reports.style import line_styles, new_figure, style
from studies.papers.tables import LINEARISED

from . import misprints
from .loops import finish
from .table import (
    Check,
    Claim,
    Consequence,
    Outlier,
    Verdict,
    compare,
    how,
    note,
    reading,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLE = LINEARISED

PRINTED = {
    "storage": {"A": "1.4147", "B": "3.700", "f": "0.01421", "constant": "5.3376"},
    "loss": {"A": "-0.825", "B": "0.6469", "f": "0.00109", "constant": "1.017441"},
}
"""Coefficients of the printed regressions, N/mm over mm, T, Hz."""

TESTS = {
    (B, A, f)
    for B, A, f in product(LINEARISED_FIELDS_T, LINEARISED_AMPLITUDES_MM, LINEARISED_FREQUENCIES_HZ)
    if (B, A, f) != (0.4, 0.2, 20.0)
}
"""Tests that the section on parameter estimation lists: field (T), amplitude (mm), frequency (Hz).
At 0.4 T and 20 Hz it has 0.1 and 0.15 mm alone."""

FITNESS = {
    frequency: {
        (B, A): value
        for B, row in zip(LINEARISED_FIELDS_T, rows, strict=True)
        for A, value in zip((0.1, 0.2), row, strict=False)
    }
    for frequency, rows in {
        8.0: (("91.477", "92.432"), ("95.629", "90.281"), ("92.729", "92.356"),
              ("92.404", "93.945")),
        12.0: (("91.125", "94.267"), ("94.119", "92.092"), ("91.995", "95.412"),
               ("92.613", "93.380")),
        16.0: (("90.154", "92.905"), ("97.311", "92.290"), ("91.148", "94.679"),
               ("91.305", "93.157")),
        20.0: (("88.815", "90.911"), ("91.483", "93.453"), ("91.191", "93.988"), ("92.142",)),
    }.items()
}  # fmt: skip
"""Table 3: fitness in percent by frequency (Hz), then by field (T) and amplitude (mm)."""

_UNITS = {"A": "N/mm²", "B": "N/(mm T)", "f": "N s/mm", "constant": "N/mm"}
_PARTS = {"storage": "G_real", "loss": "G_img"}


def checks(short: bool = False) -> list[Check]:
    """Recompute the paper's numbers."""
    return [
        *_regression(),
        *_causality(),
        *_table_1(),
        *misprints.linearised_bouc_wen(),
        *_table_3(),
        *_uncheckable(),
    ]


def _regression() -> Iterator[Check]:
    every, sound = lbw.regression(), lbw.regression(drop=[lbw.CORRUPT])
    for part, printed in PRINTED.items():
        slopes, share = every[part]
        for name, value in printed.items():
            yield compare(
                f"{_PARTS[part]}, {name}",
                "Eqs 10, 11 (second)",
                value,
                slopes[name],
                _UNITS[name],
                how("all 48 columns, ω = 2πf"),
                within=0.2,
            )
        yield Consequence(f"R² of {_PARTS[part]}", "Table 1", share)
    slopes, share = sound["storage"]
    yield Consequence(
        "G_real, A, without the corrupt column",
        "Table 1",
        slopes["A"],
        _UNITS["A"],
        note("with it {:.4f}", every["storage"][0]["A"]),
    )
    yield Consequence("R² of G_real without it", "Table 1", share)
    yield Claim(
        "storage grows with amplitude",
        "Discussion",
        slopes["A"],
        _UNITS["A"],
        note("slope without the corrupt column; with it {:.4f}", every["storage"][0]["A"]),
        above=0.0,
    )
    yield Claim("storage grows with field", "Discussion", slopes["B"], _UNITS["B"], above=0.0)
    storage = every["storage"][0]
    yield compare(
        "amplitude's slope over frequency's",
        "Discussion",
        "80",
        storage["A"] / storage["f"],
        "mm/s",
        how("N/mm² over N s/mm: units differ, so the ratio has a unit"),
    )


def _corrupt_stiffness() -> Outlier:
    table = lbw.columns()
    keys = list(zip(table["field_T"], table["amplitude_mm"], table["frequency_Hz"], strict=True))
    at = keys.index(lbw.CORRUPT)
    others = [k for k, key in enumerate(keys) if key[0] == lbw.CORRUPT[0] and k != at]
    median = float(np.median(table["k1"][others]))
    return Outlier(
        "K1, 0.2 T, 0.1 mm, 20 Hz, over the median of its field",
        "Table 1",
        table["k1"][at] / median,
        "",
        note("{:g} N/mm; the median of the others is {:.3f}", table["k1"][at], median),
        lowest=0.5,
        highest=2.0,
    )


def _table_1() -> Iterator[Check]:
    table = lbw.columns()
    keys = list(zip(table["field_T"], table["amplitude_mm"], table["frequency_Hz"], strict=True))
    names = ("C", "k1", "k2", "C_e", "k_e")
    yield _corrupt_stiffness()
    values = np.column_stack([table[name] for name in names])
    pairs = [(a, b) for a in range(48) for b in range(a)]
    equal = {(a, b): int(np.sum(values[a] == values[b])) for a, b in pairs}
    for (a, b), count in equal.items():
        if count < 2:  # one entry may be equal by chance
            continue
        where = "{:g} T, {:g} mm, {:g} Hz"
        yield Outlier(
            f"entries of {where.format(*keys[a])} equal to another column's",
            "Table 1",
            count,
            "",
            note("of 5; the other column is " + where, *keys[b]),
            highest=1,
        )
    for B, A, f in sorted(set(keys) - TESTS):
        yield Outlier(
            f"tests listed of {B:g} T, {A:g} mm, {f:g} Hz",
            "Table 1",
            (B, A, f) in TESTS,
            "",
            note("{} tests are listed, {} columns printed", len(TESTS), len(keys)),
            lowest=1,
        )
    yield Claim(
        "z is stable in time",
        "Eq 3, Table 1",
        float(np.max(table["k_e"])),
        "1/s",
        note("largest K_e; the smallest is {:g}; the law takes -K_e", np.min(table["k_e"])),
        below=0.0,
    )


def fitness_of_regression() -> dict[tuple[float, float], float]:
    """Fitness of the paper's regression to Table 1 at 20 Hz, as in Table 3."""
    table, slopes = lbw.columns(), LINEARISED_REGRESSION_PRINTED
    inputs = {"A": "amplitude_mm", "B": "field_T", "f": "frequency_Hz"}
    fitted = {
        part: row["constant"] + sum(row[name] * table[column] for name, column in inputs.items())
        for part, row in slopes.items()
    }
    G, estimated = (each["storage"] + 1j * each["loss"] for each in (table, fitted))
    # of two sinusoids with one frequency, all norms are as their phasors
    share = 100 * (1 - np.abs(estimated - G) / np.abs(G))
    keys = zip(table["field_T"], table["amplitude_mm"], table["frequency_Hz"], strict=True)
    every = dict(zip(keys, share.tolist(), strict=True))
    return {(B, A): every[B, A, 20.0] for B, A in FITNESS[20.0]}


def _table_3() -> Iterator[Check]:
    values = np.array([float(value) for row in FITNESS.values() for value in row.values()])
    yield Claim(
        "fitness of nearly 97 %",
        "Conclusion, Table 3",
        float(np.mean(values)),
        "%",
        note("mean of {}; from {:g} to {:g}", values.size, values.min(), values.max()),
        above=96.0,
    )
    estimated = {f for _, _, f in TESTS}
    yield Claim(
        "validated at other frequencies than estimated",
        "Verification, Table 3",
        len(estimated & set(FITNESS)),
        "",
        note("of {} frequencies, also among the tests: {}", len(FITNESS),
              ", ".join(f"{f:g} Hz" for f in sorted(estimated & set(FITNESS)))),
        below=0.5,
    )  # fmt: skip
    for (B, A), value in fitness_of_regression().items():
        yield compare(
            f"fitness, {B:g} T, {A:g} mm, 20 Hz",
            "Table 3",
            FITNESS[20.0][B, A],
            value,
            "%",
            how("of the second Eqs 10-11 to Table 1's stiffness; printed: to the measured loop"),
            within=3,
            source=_corrupt_stiffness() if (B, A, 20.0) == lbw.CORRUPT else None,
        )


def _causality() -> Iterator[Check]:
    """A constant loss lets the storage of a linear material grow with the log of the frequency."""
    low, high = LINEARISED_FREQUENCIES_HZ[0], LINEARISED_FREQUENCIES_HZ[-1]
    loss = LINEARISED_REGRESSION_PRINTED["loss"]["constant"]
    yield Consequence(
        f"growth of storage from {low:g} to {high:g} Hz if linear and causal",
        "Eq 11 (second)",
        2 / np.pi * loss * np.log(high / low),
        "N/mm",
        note(
            "2/pi times loss times ln(f2/f1); Eq 10 (second) has {:.3f}",
            LINEARISED_REGRESSION_PRINTED["storage"]["f"] * (high - low),
        ),
    )


def _uncheckable() -> Iterator[Check]:
    reason = "needs the measured loops, which are not published"
    for what, where, quote in (
        ("fitness values, 8, 12 and 16 Hz", "Table 3", "Calculated Fitness values"),
        ("parameters as estimated", "Table 1", "Estimated Parameter Values"),
    ):
        yield reading(what, where, Verdict.NOT_CHECKABLE, reason, quote)


def figures() -> dict[str, Figure]:
    """Draw the stiffness against frequency, and the regression."""
    return {"003_stiffness": _stiffness(), "003_regression": _regression_figure()}


def _stiffness() -> Figure:
    table, frequencies = lbw.columns(), np.array(LINEARISED_FREQUENCIES_HZ)
    shape = (len(LINEARISED_FIELDS_T), len(LINEARISED_AMPLITUDES_MM), len(frequencies))
    result = lbw.regression()
    with style():
        figure = new_figure(7.2, 5.2)
        panels = figure.subplots(2, 3, sharex=True, sharey="row")
        for row, part in zip(panels, PRINTED, strict=True):
            slopes, _ = result[part]
            for j, (panel, amplitude) in enumerate(zip(row, LINEARISED_AMPLITUDES_MM, strict=True)):
                lines = line_styles(len(LINEARISED_FIELDS_T), markers=True)
                for i, (field, line) in enumerate(zip(LINEARISED_FIELDS_T, lines, strict=True)):
                    stiffness = table[part].reshape(shape)[i, j]
                    panel.plot(frequencies, stiffness, **line, label=f"{field:g} T, Table 1")
                    fitted = (
                        slopes["A"] * amplitude
                        + slopes["B"] * field
                        + slopes["f"] * frequencies
                        + slopes["constant"]
                    )
                    panel.plot(
                        frequencies,
                        fitted,
                        **line | {"marker": ""},
                        lw=0.6,
                        alpha=0.7,
                        label="regression, same dashes" if i == 0 else None,
                    )
                panel.set(
                    title=f"{amplitude:g} mm",
                    xlabel="frequency (Hz)",
                    ylabel=f"{part} stiffness (N/mm)",
                )
                panel.label_outer()
        finish(figure, panels[0, 0], "Storage and loss stiffness of Table 1, correct split")
    return figure


def _regression_figure() -> Figure:
    table, result = lbw.columns(), lbw.regression()
    inputs = {"A": "amplitude_mm", "B": "field_T", "f": "frequency_Hz"}
    corrupt = np.all(
        [
            table[name] == value
            for name, value in zip(
                ("field_T", "amplitude_mm", "frequency_Hz"), lbw.CORRUPT, strict=True
            )
        ],
        axis=0,
    )
    with style():
        figure = new_figure(7.2, 3.6)
        panels = figure.subplots(1, 2)
        for panel, part in zip(panels, PRINTED, strict=True):
            slopes, share = result[part]
            fitted = slopes["constant"] + np.sum(
                [slopes[k] * table[n] for k, n in inputs.items()], axis=0
            )
            fields = line_styles(len(LINEARISED_FIELDS_T), markers=True)
            for field, line in zip(LINEARISED_FIELDS_T, fields, strict=True):
                chosen = (table["field_T"] == field) & ~corrupt
                panel.plot(
                    table[part][chosen],
                    fitted[chosen],
                    label=f"{field:g} T",
                    **line | {"linestyle": ""},
                )
            panel.plot(table[part][corrupt], fitted[corrupt], "kx", ms=7, label="corrupt column")
            ends = np.array([np.min(fitted), np.max(fitted)])
            panel.plot(ends, ends, color="0.4", lw=0.8, label="equal")
            panel.set(
                xlabel=f"{part} stiffness of Table 1 (N/mm)",
                ylabel="by the regression (N/mm)",
                title=f"{part}, R² = {share:.2f}",
            )
        finish(figure, panels[0], "Regression on amplitude, field and frequency")
    return figure
