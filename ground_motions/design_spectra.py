"""Elastic design spectra of building codes, 5 % damped, and of a user's table.

Each function gives the clause that it follows. Site factors and hazard maps are input: they belong
to the site, not to the shape of the spectrum.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from ground_motions.argument_types import checked
from ground_motions.checks import FloatArray, choice, finite_row, positive, within
from ground_motions.errors import InputError
from ground_motions.units import STANDARD_GRAVITY

DESIGN_TO_MCE_R = 1.5
"""Risk-targeted maximum considered over design spectrum; ASCE 7-22, 11.4.6."""

_NEVER_ZERO = 1e-9  # s; branches that divide by the period are not taken there
Level = Literal["design", "mce_r"]


@checked
@dataclass(frozen=True, eq=False)
class DesignSpectrum:
    """Elastic pseudo-acceleration spectrum of a code at 5 % damping.

    Parameters
    ----------
    name : str
        The code and its options.
    clause : str
        Clause that gives the shape.
    ordinates : callable
        ``ordinates(periods)`` -> pseudo-acceleration, m/s2, for an array of periods, s.
    shortest_period, longest_period : float
        Periods for which the clause gives an ordinate, s.
    """

    name: str
    clause: str
    ordinates: Callable[[FloatArray], FloatArray]
    shortest_period: float = 0.0
    longest_period: float = np.inf

    def psa(self, periods: npt.ArrayLike) -> FloatArray:
        """Return the pseudo-acceleration.

        Parameters
        ----------
        periods : (m,) array_like
            Natural periods, s.

        Returns
        -------
        (m,) ndarray
            Pseudo-acceleration, m/s2.

        Raises
        ------
        InputError
            If a period is outside the range of the clause.
        """
        target = np.atleast_1d(np.array(periods, dtype=float))
        # a period computed as 0.2 T may end a last bit outside
        slack = 1e-12 * np.abs(target)
        outside = target[
            ~((target >= self.shortest_period - slack) & (target <= self.longest_period + slack))
        ]
        if outside.size:
            raise InputError(
                f"period (s) of the spectrum {self.name}, {self.clause}",
                f"{outside[0]:g}",
                f"{self.shortest_period:g} to {self.longest_period:g}",
            )
        return np.asarray(self.ordinates(target), dtype=float)


@checked
def asce7_22_two_period(
    s_ds: float, s_d1: float, t_l: float, level: Level = "design"
) -> DesignSpectrum:
    """Return the two-period design response spectrum of ASCE 7-22, 11.4.5.2.

    Parameters
    ----------
    s_ds, s_d1 : float
        Design spectral acceleration at short periods and at 1 s, m/s2 (the code's times g).
    t_l : float
        Long-period transition period, s.
    level : {"design", "mce_r"}
        ``"mce_r"`` is 1.5 times the design spectrum (11.4.6); chapter 17 designs isolation with it.

    Returns
    -------
    DesignSpectrum

    Raises
    ------
    InputError
        If a number is not above 0, or ``s_d1 / s_ds`` is not below ``t_l``.
    """
    s_ds, s_d1 = positive("s_ds (m/s2)", s_ds), positive("s_d1 (m/s2)", s_d1)
    t_l = positive("t_l (s)", t_l)
    t_s = s_d1 / s_ds
    if t_s >= t_l:
        raise InputError("t_l (s)", f"{t_l:g}", f"above s_d1 / s_ds = {t_s:g}")
    t_0 = 0.2 * t_s
    factor = _level_factor(level)

    def ordinates(periods: FloatArray) -> FloatArray:
        period = np.maximum(periods, _NEVER_ZERO)
        return factor * np.select(
            [periods < t_0, periods <= t_s, periods <= t_l],
            [s_ds * (0.4 + 0.6 * periods / t_0), np.full_like(periods, s_ds), s_d1 / period],
            s_d1 * t_l / period**2,
        )

    return DesignSpectrum(f"ASCE 7-22 two-period, {level}", "ASCE 7-22, 11.4.5.2", ordinates)


@checked
def asce7_22_multi_period(
    periods: npt.ArrayLike, mce_r: npt.ArrayLike, t_l: float, level: Level = "design"
) -> DesignSpectrum:
    """Return the multi-period design response spectrum of ASCE 7-22, 11.4.5.1.

    Parameters
    ----------
    periods : (m,) array_like
        Periods of the geodatabase, s, increasing from 0 to 10.
    mce_r : (m,) array_like
        MCE_R spectral accelerations there for the site class, m/s2.
    t_l : float
        Long-period transition period, s.
    level : {"design", "mce_r"}
        The design spectrum is two thirds of ``mce_r``.

    Returns
    -------
    DesignSpectrum
        Linear between the periods; beyond 10 s it falls with 1/T, beyond ``t_l`` with 1/T^2. With
        ``t_l`` below 10 s it falls with 1/T^2 from its value at 10 s; the literal factor 10 t_l /
        T^2 would be a step there.

    Raises
    ------
    InputError
        If the periods do not increase from 0 to 10 s, or a number cannot be used.
    """
    table_periods, sa = _table(periods, mce_r)
    if table_periods[0] != 0.0 or table_periods[-1] != 10.0:
        raise InputError("periods (s)", f"{table_periods[0]:g} to {table_periods[-1]:g}", "0 to 10")
    transition = max(positive("t_l (s)", t_l), 10.0)
    factor = _level_factor(level) / DESIGN_TO_MCE_R

    def ordinates(target: FloatArray) -> FloatArray:
        beyond = np.maximum(target, 10.0)
        tail = np.where(beyond <= transition, 10.0 / beyond, 10.0 * transition / beyond**2)
        return factor * np.where(
            target <= 10.0, np.interp(target, table_periods, sa), sa[-1] * tail
        )

    return DesignSpectrum(f"ASCE 7-22 multi-period, {level}", "ASCE 7-22, 11.4.5.1", ordinates)


# S, T_B, T_C, T_D by spectrum type and ground; EN 1998-1:2004, Tables 3.2 and 3.3
_EN_2004 = {
    1: {
        "A": (1.0, 0.15, 0.4, 2.0),
        "B": (1.2, 0.15, 0.5, 2.0),
        "C": (1.15, 0.20, 0.6, 2.0),
        "D": (1.35, 0.20, 0.8, 2.0),
        "E": (1.4, 0.15, 0.5, 2.0),
    },
    2: {
        "A": (1.0, 0.05, 0.25, 1.2),
        "B": (1.35, 0.05, 0.25, 1.2),
        "C": (1.5, 0.10, 0.25, 1.2),
        "D": (1.8, 0.10, 0.30, 1.2),
        "E": (1.6, 0.05, 0.25, 1.2),
    },
}
# T_E of type 1; T_F is 10 s for every ground; EN 1998-1:2004, Table A.1
_EN_2004_T_E = {"A": 4.5, "B": 5.0, "C": 6.0, "D": 6.0, "E": 6.0}
_EN_2004_T_F = 10.0


@checked
def en1998_1_2004(a_g: float, ground: str, spectrum_type: int = 1) -> DesignSpectrum:
    """Return the horizontal elastic response spectrum of EN 1998-1:2004, 3.2.2.2.

    Parameters
    ----------
    a_g : float
        Design ground acceleration on ground A, importance factor included, m/s2.
    ground : {"A", "B", "C", "D", "E"}
        Ground type (3.1.2).
    spectrum_type : {1, 2}
        Type 1, or type 2 for low-magnitude seismicity; recommended parameters of Tables 3.2 and
        3.3. A National Annex may give others.

    Returns
    -------
    DesignSpectrum
        Beyond 4 s, type 1 follows Annex A; for type 2 there is no ordinate.

    Raises
    ------
    InputError
        If ``a_g`` is not above 0, or ground or type is unknown.
    """
    a_g = positive("a_g (m/s2)", a_g)
    if spectrum_type not in _EN_2004:
        raise InputError("spectrum_type", repr(spectrum_type), "1, 2")
    choice("ground", ground, _EN_2004[spectrum_type])
    soil, t_b, t_c, t_d = _EN_2004[spectrum_type][ground]
    plateau, t_e = 2.5 * a_g * soil, _EN_2004_T_E[ground]

    def annex_a(period: FloatArray) -> FloatArray:
        share = np.clip((period - t_e) / (_EN_2004_T_F - t_e), 0.0, 1.0)
        displacement = 0.025 * a_g * soil * t_c * t_d * (2.5 - 1.5 * share)
        return displacement * (2.0 * np.pi / period) ** 2

    def ordinates(periods: FloatArray) -> FloatArray:
        period = np.maximum(periods, _NEVER_ZERO)
        short = np.select(
            [periods <= t_b, periods <= t_c, periods <= t_d],
            [
                a_g * soil * (1.0 + periods / t_b * 1.5),
                np.full_like(periods, plateau),
                plateau * t_c / period,
            ],
            plateau * t_c * t_d / period**2,
        )
        return np.where((periods <= t_e) | (spectrum_type == 2), short, annex_a(period))

    return DesignSpectrum(
        f"EN 1998-1:2004 type {spectrum_type}, ground {ground}",
        "EN 1998-1:2004, 3.2.2.2" + (" and Annex A" if spectrum_type == 1 else ""),
        ordinates,
        longest_period=np.inf if spectrum_type == 1 else 4.0,
    )


@checked
def en1998_1_1_2022(
    s_alpha_rp: float,
    s_beta_rp: float,
    f_alpha: float = 1.0,
    f_beta: float = 1.0,
    f_topography: float = 1.0,
) -> DesignSpectrum:
    """Return the horizontal elastic response spectrum of EN 1998-1-1:2022, 5.2.2.2.

    Parameters
    ----------
    s_alpha_rp, s_beta_rp : float
        Spectral acceleration of the plateau and at 1 s on site category A for the return period
        of the design situation, m/s2.
    f_alpha, f_beta : float
        Site amplification factors of the site category; 1 on category A.
    f_topography : float
        Topography amplification factor.

    Returns
    -------
    DesignSpectrum

    Raises
    ------
    InputError
        If a number is not above 0, or the corner periods are out of order.
    """
    s_beta_rp = positive("s_beta_rp (m/s2)", s_beta_rp)
    f_topography = positive("f_topography", f_topography)
    s_alpha = f_topography * positive("f_alpha", f_alpha) * positive("s_alpha_rp", s_alpha_rp)
    s_beta = f_topography * positive("f_beta", f_beta) * s_beta_rp
    t_a, zero_period_ratio, plateau_width = 0.02, 2.5, 4.0
    t_c = s_beta / s_alpha  # times T_beta, 1 s
    t_b = min(max(t_c / plateau_width, 0.05), 0.1)
    t_d = 2.0 if s_beta_rp <= 1.0 else 1.0 + s_beta_rp
    if not t_b < t_c < t_d:
        raise InputError(
            "s_beta / s_alpha (s)", f"T_C = {t_c:g}", f"between T_B = {t_b:g} and T_D = {t_d:g}"
        )

    def ordinates(periods: FloatArray) -> FloatArray:
        period = np.maximum(periods, _NEVER_ZERO)
        rise = (periods - t_a + (t_b - periods) / zero_period_ratio) / (t_b - t_a)
        return np.select(
            [periods <= t_a, periods <= t_b, periods <= t_c, periods <= t_d],
            [
                np.full_like(periods, s_alpha / zero_period_ratio),
                s_alpha * rise,
                np.full_like(periods, s_alpha),
                s_beta / period,
            ],
            s_beta * t_d / period**2,
        )

    return DesignSpectrum("EN 1998-1-1:2022", "EN 1998-1-1:2022, 5.2.2.2", ordinates)


# Spectral shape factor by subsoil class: value at 0 s, its rise over 0.1 s, plateau, end of the
# plateau, factor and period of the branch with T^-0.75, factor of 1/T, factor of 1/T^2;
# NZS 1170.5:2004, Table 3.1 for numerical integration, equations of C3.1.2
_NZS = {
    "A": (1.0, 1.35, 2.35, 0.3, 1.6, 0.5, 1.05, 3.15),
    "B": (1.0, 1.35, 2.35, 0.3, 1.6, 0.5, 1.05, 3.15),
    "C": (1.33, 1.60, 2.93, 0.3, 2.0, 0.5, 1.32, 3.96),
    "D": (1.12, 1.88, 3.0, 0.56, 2.4, 0.75, 2.14, 6.42),
    "E": (1.12, 1.88, 3.0, 1.0, 3.0, 1.0, 3.32, 9.96),
}
# near-fault factor over the period; NZS 1170.5:2004, Table 3.7
_NZS_NEAR_FAULT = ((1.5, 2.0, 3.0, 4.0, 5.0), (1.0, 1.12, 1.36, 1.60, 1.72))


@checked
def nzs1170_5(
    z: float, r: float, subsoil: str, fault_distance_km: float | None = None
) -> DesignSpectrum:
    """Return the elastic site spectrum of NZS 1170.5:2004, 3.1.1: C(T) = C_h(T) Z R N(T, D).

    Parameters
    ----------
    z : float
        Hazard factor.
    r : float
        Return period factor.
    subsoil : {"A", "B", "C", "D", "E"}
        Site subsoil class (3.1.3).
    fault_distance_km : float, optional
        Shortest distance to a major fault, km, where the near-fault factor applies: for annual
        probabilities of exceedance below 1/250 (3.1.6). The factor is 1 if left out.

    Returns
    -------
    DesignSpectrum
        With the shape factor for numerical integration time history analysis.

    Raises
    ------
    InputError
        If a factor is not above 0, Z R exceeds 0.7 (3.1.1), the class is unknown or the distance
        is negative.
    """
    z, r = positive("z", z), positive("r", r)
    if z * r > 0.7 * (1.0 + 1e-12):
        raise InputError("z times r", f"{z * r:g}", "0.7 or below (NZS 1170.5, 3.1.1)")
    choice("subsoil", subsoil, _NZS)
    zero, rise, plateau, end, power, reference, slope, square = _NZS[subsoil]
    near = 0.0
    if fault_distance_km is not None:
        distance = within("fault_distance_km (km)", fault_distance_km, 0.0, np.inf)
        near = float(np.clip((20.0 - distance) / 18.0, 0.0, 1.0))

    def ordinates(periods: FloatArray) -> FloatArray:
        period = np.maximum(periods, _NEVER_ZERO)
        shape = np.select(
            [periods < 0.1, periods <= end, periods <= 1.5, periods <= 3.0],
            [
                zero + rise * periods / 0.1,
                np.full_like(periods, plateau),
                power * (reference / period) ** 0.75,
                slope / period,
            ],
            square / period**2,
        )
        near_fault = 1.0 + near * (np.interp(periods, *_NZS_NEAR_FAULT) - 1.0)
        return shape * z * r * near_fault * STANDARD_GRAVITY

    return DesignSpectrum(
        f"NZS 1170.5:2004 class {subsoil}", "NZS 1170.5:2004, 3.1.1 and C3.1.2", ordinates
    )


@checked
def table_spectrum(
    periods: npt.ArrayLike, psa: npt.ArrayLike, name: str = "table"
) -> DesignSpectrum:
    """Return a spectrum that is linear between given points.

    Parameters
    ----------
    periods : (m,) array_like
        Increasing periods, s.
    psa : (m,) array_like
        Pseudo-accelerations there at 5 % damping, m/s2, above 0.
    name : str
        Short name, for tables and figures.

    Returns
    -------
    DesignSpectrum
        Without ordinates outside the table.

    Raises
    ------
    InputError
        If the table cannot be used.
    """
    table_periods, sa = _table(periods, psa)
    return DesignSpectrum(
        name,
        "the user's table",
        lambda target: np.interp(target, table_periods, sa),
        float(table_periods[0]),
        float(table_periods[-1]),
    )


def _level_factor(level: str) -> float:
    return DESIGN_TO_MCE_R if choice("level", level, ("design", "mce_r")) == "mce_r" else 1.0


def _table(periods: npt.ArrayLike, psa: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    table_periods, sa = finite_row("periods (s)", periods), finite_row("psa (m/s2)", psa)
    if len(table_periods) != len(sa):
        raise InputError(
            "periods and psa", f"{len(table_periods)} and {len(sa)} numbers", "equal counts"
        )
    if table_periods[0] < 0.0 or np.any(np.diff(table_periods) <= 0.0):
        raise InputError("periods (s)", "not increasing from 0 or above", "increasing periods")
    if np.any(sa <= 0.0):
        raise InputError("psa (m/s2)", f"{sa[sa <= 0.0][0]:g}", "numbers above 0")
    return table_periods, sa
