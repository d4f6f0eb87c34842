"""The results of a suite of records, read from its folder."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ground_motions import SUITE_RULES, SuiteRule
from ground_motions.argument_types import checked

from ...errors import InputError
from ...rendering import Printed, render
from ..result import Sweep

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

SCENARIO, SWEEP = "scenario.toml", "sweep"
"""File of the scenario, folder of the runs."""
STATISTICS = ("mean", "median", "percentile_84", "maximum")
"""Statistics over the motions of a suite."""


@checked
class Suite(Printed):
    """Results of a suite of records.

    Parameters
    ----------
    folder : str or pathlib.Path
        Folder that `isolation_sim.run_suite` wrote.

    Attributes
    ----------
    folder : pathlib.Path
        The folder.
    index : dict
        The motions, their processing and their spectra.
    sweep : Sweep
        The runs.

    Raises
    ------
    InputError
        If there is no suite.
    """

    def __init__(self, folder: str | Path):
        self.folder = Path(folder)
        try:
            self.index: dict[str, Any] = json.loads((self.folder / "suite.json").read_bytes())
        except (OSError, ValueError):
            raise InputError(
                f"{folder}: no suite there; expected: a folder that isolation-sim suite made"
            ) from None
        self.sweep = Sweep(self.folder / SWEEP)

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.sweep.plan.name

    @property
    def rule(self) -> SuiteRule:
        """Requirements of the code on the suite."""
        section = self.index["inputs"]["section"]
        return SUITE_RULES[section["rule"]].under(section["scaling"])

    @property
    def design_statistic(self) -> str | None:
        """Design statistic of the rule; None if the rule requires more records."""
        return self.rule.design_statistic(self.index["n_records"])

    @property
    def controllers(self) -> tuple[str, ...]:
        """Labels of the controllers."""
        return self.sweep.controllers

    @cached_property
    def criteria(self) -> tuple[str, ...]:
        """Criteria, SI units, and J1 to J8 if one controller is ``passive_off``."""
        skipped = ("energy_", "normalised_")
        return tuple(name for name in self.sweep.criteria if not name.startswith(skipped))

    @cached_property
    def table(self) -> pandas.DataFrame:
        """One row per run: ``motion``, ``record``, ``controller``, ``status``, criteria (SI)."""
        table = self.sweep.table.drop(columns="case")
        record = {each["name"]: each["record"] for each in self.index["motions"]}
        table.insert(1, "record", table["motion"].map(record))
        return table

    @cached_property
    def statistics(self) -> pandas.DataFrame:
        """Mean, median, 84th percentile and maximum over the motions.

        Indexed by controller and criterion; ``governing`` names the motion with the maximum,
        ``design`` is the design value by the rule, NaN if the rule has none or a run failed, and
        ``runs`` is the number of runs in the statistics.
        """
        import pandas as pd

        rows = []
        for label in self.controllers:
            runs = self.table[self.table["controller"] == label]
            good = runs[runs["status"] == "ok"].set_index("motion")
            for criterion in self.criteria:
                values = good[criterion].dropna()
                row: dict[str, Any] = {
                    "controller": label, "criterion": criterion, "runs": len(values),
                }  # fmt: skip
                if len(values):
                    row |= {
                        "mean": values.mean(),
                        "median": values.median(),
                        "percentile_84": values.quantile(0.84),
                        "maximum": values.max(),
                        "governing": values.idxmax(),
                    }
                    if self.design_statistic and len(values) == len(runs):
                        row["design"] = row[self.design_statistic]
                rows.append(row)
        columns = [*STATISTICS, "governing", "design", "runs"]
        frame = pd.DataFrame(rows).set_index(["controller", "criterion"])
        return frame.reindex(columns=columns)

    @property
    def mean_ratio(self) -> tuple[float, float] | None:
        """Smallest and largest ratio of mean spectrum to target in the rule's range, or None."""
        result = self.index["spectra"]["range"]
        if any(value is None for value in result["target_m_s2"]):
            return None
        pairs = zip(result["period_s"], result["mean_m_s2"], result["target_m_s2"], strict=True)
        ratios = [mean / target for period, mean, target in pairs if period > 0.0]
        return min(ratios), max(ratios)

    @property
    def meets_rule(self) -> bool | None:
        """Whether the mean spectrum reaches the rule's floor everywhere; None without a target."""
        result = self.index["spectra"]["range"]
        if any(value is None for value in result["target_m_s2"]):
            return None
        rows = zip(result["mean_m_s2"], result["target_m_s2"], result["floor"], strict=True)
        return all(mean >= floor * target * (1.0 - 1e-9) for mean, target, floor in rows)

    def warnings(self) -> list[str]:
        """Return warnings about the validity of the results; see `Sweep.warnings`.

        Returns
        -------
        list of str
        """
        return self.sweep.warnings()

    def _shown(self) -> Iterator[Any]:
        for label in self.controllers:
            yield render("suite_tables:statistics_table", self, label)
        yield from render("suite_tables:verdict", self)
        yield from (f"warning: {each}" for each in self.warnings())

    def __repr__(self) -> str:
        return f"Suite({str(self.folder)!r}, {len(self.index['motions'])} motions)"

    def to_pandas(self) -> pandas.DataFrame:
        """Return the runs; the same as ``table``.

        Returns
        -------
        pandas.DataFrame
        """
        return self.table

    def plot_spectra(self) -> Figure:
        """Draw the spectra of the records, their mean and the target.

        Returns
        -------
        matplotlib.figure.Figure
        """
        return render("suite_figures:spectra", self)

    def save(self) -> None:
        """Write the tables, the figure of the spectra and the report to the folder."""
        render("suite_files:write_suite", self)
