"""Tao et al.: improved Bouc-Wen model of the high-load MR fluid-elastomer isolator."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from isolation_sim.identification.sinusoidal import Motion, sinusoidal
from isolation_sim.laws import isolator_design as design
from isolation_sim.laws import law
from isolation_sim.laws.published import (
    TAO,
    TAO_COMPLEX_MODULUS,
    TAO_CURRENTS_A,
    TAO_IMPROVED,
)

from .table import Check, Verdict, claim, compare, follows, remark

TITLE = f"001 {TAO}"
SETTLED = 2
POINTS = 1000

STIFFNESS_GAINS = (
    "75.6 -3.3 68.2 71.8 68.5 15.9 -16.9 16.0 6.9 -16.7 8.3 65.9 0.9 52.1 58.8 56.5 14.9 -19.5 14.4"
).split()
DAMPING_GAINS = (
    "676.0 1472.9 525.9 435.4 417.8 510.0 1434.6 409.7 407.8 1545.1 362.0 424.4 1100.3 315.5 290.1 "
    "296.3 346.1 1308.7 288.2"
).split()
"""Table 3: variations from 0 to 2 A in percent, by scheme."""

_AMPLITUDES_MM = (1.0, 3.0, 5.0)
ENDS_A = (0.0, 2.0)
"""Currents of Table 3."""


@cache
def table_4(frequency: float) -> Motion:
    """Move Table 4's model at 1, 3 and 5 mm and at all six currents.

    Parameters
    ----------
    frequency : float, Hz
        Of the motion.

    Returns
    -------
    Motion
        Cases by amplitude and current.
    """
    amplitudes = 1e-3 * np.array(_AMPLITUDES_MM)[:, None]
    currents = np.array(TAO_CURRENTS_A)[None, :]
    device = law("improved_bouc_wen")
    return sinusoidal(device, amplitudes, currents, frequency, SETTLED + 4, POINTS)


def peaks(amplitude_mm: float, frequency: float, current_A: float) -> tuple[float, float]:
    """Largest tensile and compressive force of Table 4's model.

    Parameters
    ----------
    amplitude_mm : float, mm
        1, 3 or 5.
    frequency : float, Hz
    current_A : float, A
        One of Table 4's.

    Returns
    -------
    tension, compression : float, kN
    """
    case = _AMPLITUDES_MM.index(amplitude_mm), TAO_CURRENTS_A.index(current_A)
    force = table_4(frequency).last_cycle(*case)[2]
    return 1e-3 * float(np.max(force)), -1e-3 * float(np.min(force))


def modulus(amplitude_mm: float, frequency: float, current_A: float) -> tuple[float, float]:
    """Complex modulus of Table 4's model.

    Parameters
    ----------
    amplitude_mm : float, mm
        1, 3 or 5.
    frequency : float, Hz
    current_A : float, A
        One of Table 4's.

    Returns
    -------
    stiffness, damping : float, N/m and N s/m
    """
    case = _AMPLITUDES_MM.index(amplitude_mm), TAO_CURRENTS_A.index(current_A)
    measured = table_4(frequency).measured(*case, skip=SETTLED)
    return measured.storage_stiffness.value, measured.loss_damping.value


def _row(scheme: int, current_A: float) -> complex:
    """Complex stiffness of a scheme as Table 3 prints it, N/m."""
    _, frequency, _, k0, k2, c0, c2 = TAO_COMPLEX_MODULUS[scheme]
    stiffness, damping = (k0, c0) if current_A == 0 else (k2, c2)
    return stiffness + 2j * np.pi * frequency * damping


def departures(current_A: float) -> dict[int, float]:
    """Phase of Table 3's 0.5 Hz rows over that between the same series' 0.1 and 1 Hz rows.

    Parameters
    ----------
    current_A : float, A
        0 or 2.

    Returns
    -------
    dict of int to float, deg
        By scheme; the phase between is linear in the logarithm of the frequency.
    """
    share = np.log(5) / np.log(10)
    found = {}
    for scheme, (amplitude, frequency, position, *_) in TAO_COMPLEX_MODULUS.items():
        if frequency != 0.5:
            continue
        for other, expected in ((scheme - 1, 0.1), (scheme + 1, 1.0)):
            assert TAO_COMPLEX_MODULUS[other][:3] == (amplitude, expected, position)
        low, here, high = (np.degrees(np.angle(_row(scheme + k, current_A))) for k in (-1, 0, 1))
        found[scheme] = float(here - low * (1 - share) - high * share)
    return found


def checks(short: bool = False) -> list[Check]:
    """Recompute the paper's numbers.

    Parameters
    ----------
    short : bool
        Ignored: all of it takes seconds.

    Returns
    -------
    list of Check
    """
    return [*_peaks(), *_phase(), *_table_3(), *_gains(), *_trends(), *_design(), *_uncheckable()]


def _peaks() -> Iterator[Check]:
    own = "Table 4's own condition"
    other = "Table 4 is of 1 mm, 0.5 Hz alone"
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
        ("compression", 0.5, 1, "16.533", 19.98),
        ("tension", 1.0, 0, "13.177", 22.3),
    ):
        stronger = f"{float(printed) * (1 + gain / 100):.3f}"
        for current, published in zip(ENDS_A, (printed, stronger), strict=True):
            yield compare(
                f"{what}, 5 mm, {frequency:g} Hz, {current:g} A",
                "Section 3.3",
                published,
                peaks(5.0, frequency, current)[side],
                "kN",
                other,
                within=5,
            )


def _phase() -> Iterator[Check]:
    for current in ENDS_A:
        for scheme, departure in departures(current).items():
            verdict = Verdict.CORRUPT if abs(departure) > 10 else Verdict.REPRODUCED
            reason = (
                "all five by one common angle"
                if verdict is Verdict.CORRUPT
                else "0.5 Hz lies between 0.1 and 1 Hz"
            )
            yield Check(
                f"departure of phase, scheme {scheme}, {current:g} A",
                "Table 3",
                "",
                departure,
                "deg",
                verdict,
                reason,
            )
    for scheme in _corrupt():
        between = (_row(scheme - 1, 2.0) + _row(scheme + 1, 2.0)) / 2
        for name, value, unit in (
            ("stiffness", between.real, "N/m"),
            ("damping", between.imag / np.pi, "N s/m"),
        ):
            yield follows(
                f"{name} meant, scheme {scheme}, 2 A",
                "Table 3",
                value,
                unit,
                "mean of its 0.1 and 1 Hz neighbours",
            )


def _corrupt() -> list[int]:
    return [scheme for scheme, departure in departures(2.0).items() if abs(departure) > 10]


def _table_3() -> Iterator[Check]:
    """Table 4's model in every condition about the zero position."""
    corrupt = _corrupt()
    for scheme, (amplitude, frequency, position, *row) in TAO_COMPLEX_MODULUS.items():
        if position != 0:
            continue
        for j, current in enumerate(ENDS_A):
            found = modulus(amplitude, frequency, current)
            bad = current == 2 and scheme in corrupt
            own = (amplitude, frequency) == (1.0, 0.5)
            reason = (
                "the printed row is corrupt"
                if bad
                else "Table 4's own condition"
                if own
                else "Table 4 is of 1 mm, 0.5 Hz alone"
            )
            otherwise = Verdict.CORRUPT if bad else Verdict.NOT_REPRODUCED
            for name, k, unit, within in (
                ("stiffness", 0, "N/m", 2 if own else 5),
                ("damping", 1, "N s/m", 10),
            ):
                yield compare(
                    f"{name}, scheme {scheme}, {current:g} A",
                    "Table 3 by Table 4",
                    f"{row[2 * k + j]:.3e}" if k == 0 else f"{row[2 * k + j]:.2e}",
                    found[k],
                    unit,
                    reason,
                    within=within,
                    otherwise=otherwise,
                )


def _gains() -> Iterator[Check]:
    """Table 3's variations from its own columns, which are rounded to three or four digits."""
    corrupt = _corrupt()
    rows = np.array([row[3:] for row in TAO_COMPLEX_MODULUS.values()])
    for name, printed, gain in (
        ("stiffness", STIFFNESS_GAINS, 100 * (rows[:, 1] / rows[:, 0] - 1)),
        ("damping", DAMPING_GAINS, 100 * (rows[:, 3] / rows[:, 2] - 1)),
    ):
        for scheme, published, value in zip(TAO_COMPLEX_MODULUS, printed, gain, strict=True):
            what = f"gain of {name}, scheme {scheme}"
            if scheme in corrupt:
                yield Check(
                    what,
                    "Table 3",
                    published,
                    float(value),
                    "%",
                    Verdict.CORRUPT,
                    "follows from a corrupt row",
                )
            else:
                yield compare(
                    what, "Table 3", published, value, "%", "from rounded columns", within=1
                )
    sound = [k for k, scheme in enumerate(TAO_COMPLEX_MODULUS) if scheme not in corrupt]
    yield compare(
        "largest gain of damping",
        "Conclusions",
        "1545.1",
        100 * np.max(rows[sound, 3] / rows[sound, 2] - 1),
        "%",
        "computed: of the sound rows",
        otherwise=Verdict.CORRUPT,
    )
    yield compare(
        "largest gain of stiffness",
        "Conclusions",
        "75.6",
        100 * np.max(rows[sound, 1] / rows[sound, 0] - 1),
        "%",
        "sound rows",
        within=0.2,
    )


def _trends() -> Iterator[Check]:
    currents = np.array(TAO_CURRENTS_A)
    slopes = {name: np.polyfit(currents, TAO_IMPROVED[name], 1)[0] for name in ("d", "W")}
    yield claim("d rises with the current", "Section 3.4", slopes["d"] > 0, slopes["d"], "1/A")
    yield claim("W falls with the current", "Section 3.4", slopes["W"] < 0, slopes["W"], "mm/A")
    O = np.array(TAO_IMPROVED["O"])  # noqa: E741
    yield claim(
        "O between 6000 and 12000",
        "Section 3.4",
        bool(np.all((O > 6000) & (O < 12000))),
        np.max(O),
        "1/m",
        "largest; printed in N/m",
    )
    yield remark("alpha, beta, gamma dimensionless", "Eq 20", Verdict.MISPRINT, "they are 1/m")
    yield remark("1/M in the step", "Eq 23", Verdict.MISPRINT, "1/O is meant")


def _design() -> Iterator[Check]:
    sizes = design.TABLE_1
    R2, R3, h, h1 = (sizes[name] for name in ("R2", "R3", "h", "h1"))
    radius = design.upper_radius(R2, h, h1, sizes["alpha"])
    yield compare(
        "R1", "Table 1 by Eq 5", "32.5", 1e3 * radius, "mm", "from Table 1's own numbers", within=2
    )
    yield compare(
        "static stiffness",
        "Abstract by 2.4",
        "3e6",
        3e3 / 1e-3,
        "N/m",
        "3 kN over 1 mm, by finite elements",
    )
    E = 1e6
    for shape in design.SHAPE_FACTORS:
        for raises in (True, False):
            upper = design.upper_stiffness(
                radius, R2, R3, h, h1, sizes["alpha"], E, E / 3, shape, raises
            )
            total = upper + design.lower_stiffness(R2, R3, h1, E / 3)
            needed = design.hardness_of(E * design.PUBLISHED_STIFFNESS / total)
            which = "whole" if raises else "compression"
            yield Check(
                f"hardness, {shape}, {which}",
                "Eqs 2-6",
                "",
                needed,
                "Shore A",
                Verdict.AMBIGUOUS,
                "not printed; Eq 2 reads six ways",
            )
    for what, one, other in (
        ("h1", "43.5 mm in Figure 5", "58 mm in Table 1"),
        ("l", "40 mm in 2.2", "20 mm in Table 1"),
    ):
        yield remark(what, "Section 2", Verdict.AMBIGUOUS, f"{one}, {other}")
    yield remark(
        "damping force, magnetomotive force",
        "Eqs 7-11",
        Verdict.NOT_CHECKABLE,
        "viscosity, yield stress and permeability are not printed",
    )


def _uncheckable() -> Iterator[Check]:
    reason = "needs the measured loops, which are not published"
    for what, where in (
        ("errors of the models, reductions by 28.8 to 52.4 %", "Figure 23"),
        ("errors by condition", "Table 5"),
        ("parameters as identified", "Table 4"),
    ):
        yield remark(what, where, Verdict.NOT_CHECKABLE, reason)
