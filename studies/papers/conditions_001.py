"""Tao et al.: Table 4's model in Table 3's conditions, and Table 3 against itself."""

from __future__ import annotations

from functools import cache

import numpy as np

from isolation_sim.identification.sinusoidal import Motion, sinusoidal
from isolation_sim.laws import law
from isolation_sim.laws.published import TAO_CURRENTS_A
from studies.papers.tables import TAO_COMPLEX_MODULUS

from .table import Outlier, Verdict, how

STEADY_CYCLES = 2
POINTS = 1000

_AMPLITUDES_MM = (1.0, 3.0, 5.0)
_POSITIONS_MM = (0.0, -3.5)
ENDS_A = (0.0, 2.0)
"""Currents of Table 3."""


@cache
def table_4(frequency: float) -> Motion:
    """Move Table 4's model at 1, 3 and 5 mm, at all six currents and about both positions."""
    amplitudes = 1e-3 * np.array(_AMPLITUDES_MM)[:, None, None]
    currents = np.array(TAO_CURRENTS_A)[:, None]
    device = law("improved_bouc_wen")
    cycles = STEADY_CYCLES + 3
    positions = 1e-3 * np.array(_POSITIONS_MM)
    return sinusoidal(device, amplitudes, currents, frequency, cycles, POINTS, positions)


def peaks(amplitude_mm: float, frequency: float, current_A: float) -> tuple[float, float]:
    """Largest tensile and compressive force of Table 4's model about the zero position."""
    case = _AMPLITUDES_MM.index(amplitude_mm), TAO_CURRENTS_A.index(current_A)
    force = table_4(frequency).last_cycle(*case, 0)[2]
    return 1e-3 * float(np.max(force)), -1e-3 * float(np.min(force))


def modulus(
    amplitude_mm: float, frequency: float, current_A: float, position_mm: float = 0.0
) -> tuple[float, float]:
    """Complex modulus of Table 4's model."""
    case = _AMPLITUDES_MM.index(amplitude_mm), TAO_CURRENTS_A.index(current_A)
    about = _POSITIONS_MM.index(position_mm)
    measured = table_4(frequency).measured(*case, about, skip=STEADY_CYCLES)
    return measured.storage_stiffness.value, measured.loss_damping.value


def complex_stiffness(scheme: int, current_A: float, by_table_4: bool = False) -> complex:
    """Complex stiffness of a scheme."""
    amplitude, frequency, position, k0, k2, c0, c2 = TAO_COMPLEX_MODULUS[scheme]
    stiffness, damping = (k0, c0) if current_A == 0 else (k2, c2)
    if by_table_4:
        stiffness, damping = modulus(amplitude, frequency, current_A, position)
    return stiffness + 2j * np.pi * frequency * damping


def meant(scheme: int) -> tuple[float, float]:
    """Mean of a 0.5 Hz scheme's neighbours at 2 A, which the corrupt row should be near."""
    between = sum(complex_stiffness(k, 2.0) for k in (scheme - 1, scheme + 1)) / 2
    return between.real, between.imag / (2 * np.pi * TAO_COMPLEX_MODULUS[scheme][1])


def departures(current_A: float) -> dict[int, float]:
    """Phase of Table 3's 0.5 Hz rows over that between the same series' 0.1 and 1 Hz rows."""
    share = np.log(5) / np.log(10)
    turned = {}
    for scheme, (amplitude, frequency, position, *_) in TAO_COMPLEX_MODULUS.items():
        if frequency != 0.5:
            continue
        for other, expected in ((scheme - 1, 0.1), (scheme + 1, 1.0)):
            assert TAO_COMPLEX_MODULUS[other][:3] == (amplitude, expected, position)
        low, here, high = (
            np.degrees(np.angle(complex_stiffness(scheme + k, current_A))) for k in (-1, 0, 1)
        )
        turned[scheme] = float(here - low * (1 - share) - high * share)
    return turned


@cache
def sources(current_A: float) -> dict[int, Outlier]:
    """Judge Table 3's 0.5 Hz rows by their departures of phase."""
    return {
        scheme: Outlier(
            f"departure of phase, scheme {scheme}, {current_A:g} A",
            "Table 3",
            departure,
            "deg",
            how("from that between the 0.1 and 1 Hz rows"),
            lowest=-10.0,
            highest=10.0,
        )
        for scheme, departure in departures(current_A).items()
    }


def corrupt() -> list[int]:
    """Schemes whose printed row at 2 A is corrupt."""
    return [k for k, row in sources(2.0).items() if row.verdict is Verdict.CORRUPT]
