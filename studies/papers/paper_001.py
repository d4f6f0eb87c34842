"""Tao et al.: improved Bouc-Wen model of the high-load MR fluid-elastomer isolator."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from isolation_sim.laws.published import TAO, TAO_CURRENTS_A, TAO_IMPROVED
from studies.papers import isolator_design as design
from studies.papers.tables import TAO_COMPLEX_MODULUS

from . import models_001
from .conditions_001 import ENDS_A, corrupt, meant, modulus, peaks, sources
from .table import (
    Check,
    Claim,
    Consequence,
    Verdict,
    alternatives,
    compare,
    how,
    note,
    read,
    reading,
)

TITLE = TAO
STIFFNESS_GAINS = (
    "75.6 -3.3 68.2 71.8 68.5 15.9 -16.9 16.0 6.9 -16.7 8.3 65.9 0.9 52.1 58.8 56.5 14.9 -19.5 14.4"
).split()
DAMPING_GAINS = (
    "676.0 1472.9 525.9 435.4 417.8 510.0 1434.6 409.7 407.8 1545.1 362.0 424.4 1100.3 315.5 290.1 "
    "296.3 346.1 1308.7 288.2"
).split()
"""Table 3: variations from 0 to 2 A in percent, by scheme."""

OWN = how("Table 4's own condition")
OTHER = read("Table 4 is of scheme 2 alone")


def checks(short: bool = False) -> list[Check]:
    """Recompute the paper's numbers."""
    return [
        *_peaks(),
        *_phase(),
        *_table_3(),
        *_gains(),
        *models_001.checks(),
        *_trends(),
        *_design(),
        *_uncheckable(),
    ]


def _peaks() -> Iterator[Check]:
    own, other = OWN, OTHER
    zero, two = (peaks(1.0, 0.5, current)[0] for current in ENDS_A)
    yield compare("tension, 1 mm, 0.5 Hz, 0 A", "Section 3.3", "3.115", zero, "kN", own, within=5)
    yield compare("tension, 1 mm, 0.5 Hz, 2 A", "Section 3.3", "5.721", two, "kN", own, within=5)
    yield compare("its gain", "Section 3.3", "83.7", 100 * (two / zero - 1), "%", own, within=5)
    yield compare(
        "its gain, of the printed forces", "Section 3.3", "83.7", 100 * (5.721 / 3.115 - 1), "%"
    )
    slow = [peaks(1.0, 0.1, current)[1] for current in ENDS_A]
    yield compare(
        "compression, 1 mm, 0.1 Hz, 0 A", "Section 3.3", "3.083", slow[0], "kN", other, within=5
    )
    yield compare(
        "compression, 1 mm, 0.1 Hz, 2 A", "Section 3.3", "6.331", slow[1], "kN", other, within=5
    )
    yield compare(
        "its gain, of the printed forces", "Section 3.3", "105.4", 100 * (6.331 / 3.083 - 1), "%"
    )
    for what, frequency, side, printed, gain in (
        ("compression", 0.5, 1, "16.533", "19.98"),
        ("tension", 1.0, 0, "13.177", "22.3"),
    ):
        weak, strong = (peaks(5.0, frequency, current)[side] for current in ENDS_A)
        at = f"{what}, 5 mm, {frequency:g} Hz"
        yield compare(f"{at}, 0 A", "Section 3.3", printed, weak, "kN", other, within=5)
        gained = 100 * (strong / weak - 1)
        yield compare(f"{at}, gain to 2 A", "Section 3.3", gain, gained, "%", other, within=5)
        yield compare(
            f"{at}, 2 A",
            "Section 3.3",
            f"{float(printed) * (1 + float(gain) / 100):.2f}",
            strong,
            "kN",
            note("printed as {} kN and {} % more", printed, gain),
            within=5,
        )


def _phase() -> Iterator[Check]:
    for current in ENDS_A:
        yield from sources(current).values()
    for scheme in corrupt():
        for name, value, unit in zip(
            ("stiffness", "damping"), meant(scheme), ("N/m", "N s/m"), strict=True
        ):
            yield Consequence(
                f"{name} meant, scheme {scheme}, 2 A",
                "Table 3",
                value,
                unit,
                how("mean of its 0.1 and 1 Hz neighbours"),
            )


def _table_3() -> Iterator[Check]:
    """Table 4's model in every condition."""
    for scheme, (amplitude, frequency, position, *row) in TAO_COMPLEX_MODULUS.items():
        own = (amplitude, frequency, position) == (1.0, 0.5, 0.0)
        for j, current in enumerate(ENDS_A):
            values = modulus(amplitude, frequency, current, position)
            for name, k, unit, within in (
                ("stiffness", 0, "N/m", 2 if own else 5),
                ("damping", 1, "N s/m", 10),
            ):
                yield compare(
                    f"{name}, scheme {scheme}, {current:g} A",
                    "Table 3 by Table 4",
                    f"{row[2 * k + j]:.3e}" if k == 0 else f"{row[2 * k + j]:.2e}",
                    values[k],
                    unit,
                    OWN if own else OTHER,
                    within=within,
                    source=sources(current).get(scheme),
                )

    for current, k in ((0.0, 5), (2.0, 6)):
        yield Consequence(
            f"damping at 10 Hz over Table 3's, {current:g} A",
            "Table 3 by Table 4",
            modulus(1.0, 10.0, current)[1] / TAO_COMPLEX_MODULUS[5][k],
            "",
            how("scheme 5"),
        )


def _rounding(values: np.ndarray, digits: int) -> np.ndarray:
    """Half a unit of the last of the printed digits, relative to the values."""
    return 0.5 * 10.0 ** (np.floor(np.log10(values)) - digits + 1) / values


def _gains() -> Iterator[Check]:
    """Table 3's variations from its own columns, which are rounded to three or four digits."""
    rows = np.array([row[3:] for row in TAO_COMPLEX_MODULUS.values()])
    for name, printed, weak, strong, digits in (
        ("stiffness", STIFFNESS_GAINS, rows[:, 0], rows[:, 1], 4),
        ("damping", DAMPING_GAINS, rows[:, 2], rows[:, 3], 3),
    ):
        ratio = strong / weak
        spread = 100 * ratio * (_rounding(weak, digits) + _rounding(strong, digits))
        for scheme, published, value, points in zip(
            TAO_COMPLEX_MODULUS, printed, 100 * (ratio - 1), spread, strict=True
        ):
            yield compare(
                f"gain of {name}, scheme {scheme}",
                "Table 3",
                published,
                value,
                "%",
                note("the columns' rounding allows {:.2g} % points", points),
                within=100 * (points + 0.05) / abs(float(published)),
                source=sources(2.0).get(scheme),
            )
    schemes = np.array(list(TAO_COMPLEX_MODULUS))
    sound = ~np.isin(schemes, corrupt())
    for name, published, weak, strong in (
        ("damping", "1545.1", rows[:, 2], rows[:, 3]),
        ("stiffness", "75.6", rows[:, 0], rows[:, 1]),
    ):
        gain = strong / weak - 1
        largest = int(schemes[np.argmax(gain)])
        yield compare(
            f"largest gain of {name}",
            "Conclusions",
            published,
            100 * np.max(gain[sound]),
            "%",
            note("of the sound rows; of all, scheme {} has the largest", largest),
            within=0.2,
            source=sources(2.0).get(largest),
        )


def _trends() -> Iterator[Check]:
    currents = np.array(TAO_CURRENTS_A)
    slopes = {name: np.polyfit(currents, TAO_IMPROVED[name], 1)[0] for name in ("d", "W")}
    yield Claim("d rises with the current", "Section 3.4", slopes["d"], "1/A", above=0.0)
    yield Claim("W falls with the current", "Section 3.4", slopes["W"], "mm/A", below=0.0)
    for which, value in (("least", min), ("largest", max)):
        yield Claim(
            f"O between 6000 and 12000, {which}",
            "Section 3.4",
            value(TAO_IMPROVED["O"]),
            "1/m",
            read("printed in N/m"),
            above=6000.0,
            below=12000.0,
        )
    yield reading(
        "alpha, beta, gamma dimensionless",
        "Eq 19",
        Verdict.MISPRINT,
        "1/m is meant, and N for theta: z has no unit",
        "are dimensionless parameters that influence the shape and size",
    )
    yield reading("1/M in the step", "Eq 22", Verdict.MISPRINT, "1/O is meant", "W 1 / M x < W")


def _design() -> Iterator[Check]:
    sizes = design.TABLE_1
    R2, R3, h, h1 = (sizes[name] for name in ("R2", "R3", "h", "h1"))
    radius = design.upper_radius(R2, h, h1, sizes["alpha"])
    yield compare(
        "R1",
        "Table 1 by Eq 5",
        "32.5",
        1e3 * radius,
        "mm",
        how("from Table 1's other numbers"),
        within=2,
    )
    yield compare(
        "static stiffness",
        "Abstract by 2.4",
        "3e6",
        3e3 / 1e-3,
        "N/m",
        how("3 kN over 1 mm, the paper's finite elements"),
    )
    E, hardness = 1e6, {}
    for shape in design.SHAPE_FACTORS:
        for raises in (True, False):
            upper = design.upper_stiffness(
                radius, R2, R3, h, h1, sizes["alpha"], E, E / 3, shape, raises
            )
            total = upper + design.lower_stiffness(R2, R3, h1, E / 3)
            which = "whole" if raises else "compression"
            hardness[f"hardness, {shape}, {which}"] = design.hardness_of(
                E * design.PUBLISHED_STIFFNESS / total
            )
    yield from alternatives(
        "Eqs 2-6", hardness, "Shore A", read("not printed; Eq 2 reads six ways")
    )
    for what, one, other in (
        ("h1", ("Figure 5", 43.5), ("Table 1", 58.0)),
        ("l", ("Section 2.2", 40.0), ("Table 1", 20.0)),
    ):
        printed = {f"{what}, {place}": value for place, value in (one, other)}
        yield from alternatives("Section 2", printed, "mm", read("both are printed"))
    yield reading(
        "damping force, magnetomotive force",
        "Eqs 7-11",
        Verdict.NOT_CHECKABLE,
        "viscosity, yield stress and permeability are not printed",
        "describes the viscosity of MRF",
    )


def _uncheckable() -> Iterator[Check]:
    reason = "needs the measured loops, which are not published"
    for what, where, quote in (
        (
            "errors of the models, reductions by 28.8 to 52.4 %",
            "Figure 23",
            "normalized root mean square errors between simulation and experimental data",
        ),
        ("errors by condition", "Table 5", "Wen model under different operating conditions"),
        ("parameters as identified", "Table 4", "Improved model parameter identification results"),
    ):
        yield reading(what, where, Verdict.NOT_CHECKABLE, reason, quote)
