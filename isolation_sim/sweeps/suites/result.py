"""The results of a suite of records, read from its folder."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ground_motions import SUITE_RULES, SuiteRule
from ground_motions.argument_types import checked

from ...criteria import is_gain
from ...errors import InputError
from ...io.results_folder import files_into, write_contents
from ...rendering import Printed, render
from ..result import Sweep

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

SCENARIO, SWEEP = "scenario.toml", "sweep"
"""File of the scenario, folder of the runs."""
_ROUND_OFF = 1e-9
STATISTICS = ("mean", "median", "percentile_84", "maximum")
"""Statistics over the motions of a suite."""


def statistics_of(values: Any) -> dict[str, Any]:
    """The ``STATISTICS`` of a pandas series, or of each group of one."""
    results = values.mean(), values.median(), values.quantile(0.84), values.max()
    return dict(zip(STATISTICS, results, strict=True))


@checked
class Suite(Printed):
    """Results of a suite of records.

    Parameters
    ----------
    folder : str or pathlib.Path
        Folder that `isolation_sim.run_suite` or `save` wrote.

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
        return self.sweep.name

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
    def by_rule(self) -> bool:
        """Whether it is a suite of a scenario, or scaled to a target, and not of records alone."""
        inputs = self.index["inputs"]
        return bool(inputs["files"]) or inputs["section"]["target"] is not None

    @property
    def left_out(self) -> list[str]:
        """Reason for each record that could not be read and is not in the suite."""
        return list(self.index.get("left_out", ()))

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
        """Mean, standard deviation, median, 84th percentile and maximum over the motions.

        Indexed by controller and criterion; ``governing`` names the motion with the maximum,
        ``design`` is the design value by the rule, NaN if the rule has none or a run failed,
        ``runs`` is the number of runs in the statistics, and ``better`` the number of motions in
        which the controller is better than ``passive_off``, NaN without that controller.
        """
        import pandas as pd

        rows = []
        reference = self.sweep.reference
        uncontrolled = self.table[self.table["controller"] == reference].set_index("motion")
        for label in self.controllers:
            runs = self.table[self.table["controller"] == label]
            good = runs[runs["status"] == "ok"].set_index("motion")
            for criterion in self.criteria:
                values = good[criterion].dropna()
                row: dict[str, Any] = {
                    "controller": label, "criterion": criterion, "runs": len(values),
                }  # fmt: skip
                if len(values):
                    row |= statistics_of(values)
                    row |= {"standard_deviation": values.std(), "governing": values.idxmax()}
                    if reference is not None and label != reference:
                        gain = uncontrolled[criterion] - values
                        gain = -gain if is_gain(criterion) else gain
                        row["better"] = (gain > _ROUND_OFF * values.abs()).sum()
                    if self.design_statistic and len(values) == len(runs):
                        row["design"] = row[self.design_statistic]
                rows.append(row)
        columns = ["mean", "standard_deviation", *STATISTICS[1:], "governing", "design", "runs"]
        columns += ["better"]
        frame = pd.DataFrame(rows).set_index(["controller", "criterion"])
        return frame.reindex(columns=columns)

    @cached_property
    def floors(self) -> xarray.Dataset | None:
        """Peaks of each level and storey, and floor spectra, of every run.

        As `Sweep.floors`, over ``motion`` in place of ``case``; None if they were not computed.
        """
        floors = self.sweep.floors
        if floors is None:
            return None
        motions = self.sweep.table.drop_duplicates("case")["motion"].to_list()
        return floors.rename(case="motion").assign_coords(motion=motions)

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

    def failures(self) -> list[str]:
        """Return the runs without a result.

        Returns
        -------
        list of str
            One line per run: its motion, its controller, what happened and the cause.
        """
        return [
            f"{row['motion']}, {row['controller']}: {row['status']}: {row['reason']}"
            for _, row in self.sweep.failed.iterrows()
        ]

    def _shown(self) -> Iterator[Any]:
        yield from render("suite_tables:tables_and_verdict", self)
        yield from self.failures()
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

    def plot_floors(self) -> Figure:
        """Draw the peak acceleration of each level and the peak drift of each storey.

        With one controller the mean, median, 84th percentile and maximum over the motions, with
        several the mean of each.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InputError
            If the floors were not computed.
        """
        return render("suite_figures:floors", self)

    @checked
    def plot_floor_spectra(self, direction: str | None = None) -> Figure:
        """Draw the spectra of each level, as `plot_floors`.

        Parameters
        ----------
        direction : str, optional
            Horizontal direction; the first by default.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InputError
            If the floors were not computed, or there is no such direction.
        """
        return render("suite_figures:floor_spectra", self, direction)

    @checked
    def plot(self, criteria: Sequence[str] | None = None) -> Figure:
        """Draw medians and spreads of the criteria over the motions, for all controllers.

        Parameters
        ----------
        criteria : sequence of str, optional
            Columns of results; the peaks by default.

        Returns
        -------
        matplotlib.figure.Figure
        """
        return self.sweep.plot_comparison(criteria)

    @checked
    def save(self, folder: str | Path | None = None, overwrite: bool = False) -> Path:
        """Write the tables, the figure of the spectra and the report.

        Parameters
        ----------
        folder : str or pathlib.Path, optional
            Its own folder by default; another one also gets the runs and the motions, and
            ``isolation_sim.load`` loads the suite from there.
        overwrite : bool, default False
            Whether to replace the files of a result that is in the folder. Other files stay.

        Returns
        -------
        pathlib.Path
            The folder.

        Raises
        ------
        InputError
            If the folder contains a saved result or a file of the same name.
        """
        if folder is None or Path(folder).absolute() == self.folder.absolute():
            render("html.suite_report:write_suite", self)
            return self.folder
        with files_into(folder, overwrite) as place:
            shutil.copytree(self.folder, place, dirs_exist_ok=True)
            Suite(place).save()
            write_contents(place, f"Suite {self.name}")
        return Path(folder)
