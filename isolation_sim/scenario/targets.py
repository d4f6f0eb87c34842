"""The ``target`` of a suite of records: the design spectrum of a code."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Discriminator, Field, Tag

import ground_motions
from ground_motions import STANDARD_GRAVITY, DesignSpectrum
from ground_motions.units import column_units

from ..errors import InputError
from ..io.csv_table import read_csv_table
from ..validation import InputPath, NonNegative, Positive, Section, kind_by_keys

_Level = Annotated[
    Literal["design", "mce_r"],
    Field(description="design, or mce_r, which ASCE 7-22 16.2 and 17.3 ask for"),
]
_PSA = {
    f"psa_{unit}": factor for unit, factor in column_units("acceleration", ["g", "m/s2"]).items()
}


class TwoPeriodASCE7(Section):
    """ASCE 7-22, 11.4.5.2."""

    kind: Literal["asce7_22_two_period"] = "asce7_22_two_period"
    S_DS_g: Annotated[Positive, Field(description="design acceleration at short periods")]
    S_D1_g: Annotated[Positive, Field(description="design acceleration at 1 s")]
    T_L_s: Annotated[Positive, Field(description="long-period transition")]
    level: _Level = "design"

    def spectrum(self) -> DesignSpectrum:
        """Return the design spectrum."""
        g = STANDARD_GRAVITY
        return ground_motions.asce7_22_two_period(
            self.S_DS_g * g, self.S_D1_g * g, self.T_L_s, self.level
        )


class MultiPeriodASCE7(Section):
    """ASCE 7-22, 11.4.5.1."""

    kind: Literal["asce7_22_multi_period"] = "asce7_22_multi_period"
    file: Annotated[InputPath, Field(description="CSV: period_s and psa_g of MCE_R, 0 to 10 s")]
    T_L_s: Annotated[Positive, Field(description="long-period transition")]
    level: _Level = "design"

    def spectrum(self) -> DesignSpectrum:
        """Return the design spectrum."""
        periods, psa = _read_table(self.file)
        return ground_motions.asce7_22_multi_period(periods, psa, self.T_L_s, self.level)


class EN1998Of2004(Section):
    """EN 1998-1:2004, 3.2.2.2."""

    kind: Literal["en1998_1_2004"] = "en1998_1_2004"
    a_g_m_s2: Annotated[Positive, Field(description="on ground type A, with the importance factor")]
    ground: Annotated[Literal["A", "B", "C", "D", "E"], Field(description="A, B, C, D, E")]
    type: Annotated[Literal[1, 2], Field(description="1, 2")] = 1

    def spectrum(self) -> DesignSpectrum:
        """Return the design spectrum."""
        return ground_motions.en1998_1_2004(self.a_g_m_s2, self.ground, self.type)


class EN1998Of2022(Section):
    """EN 1998-1-1:2022, 5.2.2.2."""

    kind: Literal["en1998_1_1_2022"] = "en1998_1_1_2022"
    S_alpha_RP_m_s2: Annotated[Positive, Field(description="plateau on site category A")]
    S_beta_RP_m_s2: Annotated[Positive, Field(description="at 1 s on site category A")]
    F_alpha: Annotated[Positive, Field(description="site amplification of the plateau")] = 1.0
    F_beta: Annotated[Positive, Field(description="site amplification at 1 s")] = 1.0
    F_T: Annotated[Positive, Field(description="topography amplification")] = 1.0

    def spectrum(self) -> DesignSpectrum:
        """Return the design spectrum."""
        return ground_motions.en1998_1_1_2022(
            self.S_alpha_RP_m_s2, self.S_beta_RP_m_s2, self.F_alpha, self.F_beta, self.F_T
        )


class NZS1170(Section):
    """NZS 1170.5:2004, 3.1.1."""

    kind: Literal["nzs1170_5"] = "nzs1170_5"
    Z: Annotated[Positive, Field(description="hazard factor")]
    R: Annotated[Positive, Field(description="return period factor")]
    subsoil: Annotated[Literal["A", "B", "C", "D", "E"], Field(description="A, B, C, D, E")]
    fault_distance_km: Annotated[
        NonNegative | None, Field(description="for the near-fault factor; 1 if left out")
    ] = None

    def spectrum(self) -> DesignSpectrum:
        """Return the design spectrum."""
        return ground_motions.nzs1170_5(self.Z, self.R, self.subsoil, self.fault_distance_km)


class TableTarget(Section):
    """A user's spectrum."""

    kind: Literal["table"] = "table"
    file: Annotated[InputPath, Field(description="CSV: period_s and psa_g or psa_m_s2")]

    def spectrum(self) -> DesignSpectrum:
        """Return the design spectrum."""
        return ground_motions.table_spectrum(*_read_table(self.file), name=self.file.stem)


Target = Annotated[
    Annotated[TwoPeriodASCE7, Tag("asce7_22_two_period")]
    | Annotated[MultiPeriodASCE7, Tag("asce7_22_multi_period")]
    | Annotated[EN1998Of2004, Tag("en1998_1_2004")]
    | Annotated[EN1998Of2022, Tag("en1998_1_1_2022")]
    | Annotated[NZS1170, Tag("nzs1170_5")]
    | Annotated[TableTarget, Tag("table")],
    Discriminator(kind_by_keys(
        TwoPeriodASCE7, MultiPeriodASCE7, EN1998Of2004, EN1998Of2022, NZS1170, TableTarget,
    )),
]  # fmt: skip


def _read_table(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Periods, s, and pseudo-accelerations, m/s2, of a CSV file."""
    table = read_csv_table(path)
    columns = [name for name in _PSA if name in table.names]
    if "period_s" not in table.names or len(columns) != 1:
        raise InputError(
            table.head, f"columns {', '.join(table.names)}", "period_s, and psa_g or psa_m_s2"
        )
    used = [table.names.index("period_s"), table.names.index(columns[0])]
    numbers = table.numbers(used)
    return numbers[:, used[0]], numbers[:, used[1]] * _PSA[columns[0]]
