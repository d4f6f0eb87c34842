"""Files of a suite of records: tables, the figure of its spectra, the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from ground_motions.files import atomic_write

from .html.suite_report import suite_report
from .style import save
from .suite_figures import spectra

if TYPE_CHECKING:
    from ..sweeps.suites.result import Suite


def write_suite(suite: Suite) -> None:
    """Write tables, figure and report to a suite's folder."""
    plotted = suite.index["spectra"]["plotted"]
    tables = {
        "runs": suite.table.set_index("motion"),
        "statistics": suite.statistics,
        "motions": pd.DataFrame(suite.index["motions"]).drop(columns="files").set_index("name"),
        "spectra": pd.DataFrame(
            {
                "period_s": plotted["period_s"],
                "target_psa_m_s2": plotted["target_m_s2"],
                "suite_mean_psa_m_s2": pd.DataFrame(plotted["psa_m_s2"]).mean(axis=1),
            }
            | {f"{name}_psa_m_s2": row for name, row in plotted["psa_m_s2"].items()}
        ).set_index("period_s"),
    }
    for name, table in tables.items():
        with atomic_write(suite.folder / f"{name}.csv") as unfinished:
            table.to_csv(unfinished)
    save(spectra(suite), suite.folder / "figures", "spectra")
    if len(suite.controllers) > 1:
        save(suite.plot(), suite.folder / "figures", "comparison")
    suite_report(suite).write(suite.folder / "report.html")
