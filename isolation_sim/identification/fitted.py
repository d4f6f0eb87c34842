"""The result of a fit: a device, its parameters with intervals, errors of each run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked
from ground_motions.registry import copy_code

from ..archive import FILE, save_archive
from ..effects.serialisation import device_places, device_section
from ..io.csv_table import write_table
from ..io.files import write_text
from ..io.interchange import write_parts
from ..io.results_folder import file_name, files_into, write_contents
from ..laws import Device
from ..rendering import Printed, render
from .campaign import Campaign
from .measured.noise import channel_noise
from .measured.run_table import TestRun

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure
    from rich.console import RenderableType


@dataclass(frozen=True)
class Estimate:
    """One fitted number.

    Attributes
    ----------
    name, unit : str
        Parameter and its SI unit.
    current : float or None
        Current at which it holds, A; None for a constant.
    value, low, high : float
        Value and its 95 % interval, in ``unit``.
    determined : bool
        Whether the data determine it: an interval narrower than twice the value, and no bound hit.
    at_bound : bool
        Whether the value lies at a bound of the parameter's range; the interval then says little.
    """

    name: str
    unit: str
    current: float | None
    value: float
    low: float
    high: float
    determined: bool
    at_bound: bool = False

    @property
    def interval(self) -> str:
        """The interval in words."""
        return "at its bound" if self.at_bound else f"{self.low:.5g} to {self.high:.5g}"

    @property
    def label(self) -> str:
        """Name, with the current where there are several."""
        return self.name if self.current is None else f"{self.name} at {self.current:.3g} A"


@checked
def labels(estimates: Sequence[Estimate]) -> list[str]:
    """Name numbers, those of one parameter together.

    Parameters
    ----------
    estimates : sequence of Estimate
        Numbers, those of one parameter one after the other.

    Returns
    -------
    list of str
        Such as ``"k at 0, 1.5 and 3 A"``.
    """
    currents: dict[str, list[str]] = {}
    for e in estimates:
        currents.setdefault(e.name, []).extend([] if e.current is None else [f"{e.current:.3g}"])
    result = []
    for name, values in currents.items():
        several = f"{', '.join(values[:-1])} and " * (len(values) > 1)
        result.append(f"{name} at {several}{values[-1]} A" if values else name)
    return result


@dataclass(frozen=True, eq=False)
class RunError:
    """How well a fitted law reproduces one run.

    Attributes
    ----------
    run : TestRun
        The measurement.
    force : (n,) array
        Modelled force, N.
    settled : int
        The first sample that counts: the force before depends on how the run began, which is
        unknown.
    """

    run: TestRun
    force: NDArray
    settled: int = 0

    @property
    def relative(self) -> float:
        """RMS of the force residual over the RMS of the measured force."""
        return pooled([self])


@checked
def pooled(errors: Iterable[RunError]) -> float:
    """RMS of the residuals of several runs over the RMS of their measured forces.

    Parameters
    ----------
    errors : iterable of RunError
        The runs.

    Returns
    -------
    float
        Not a number if there is no run.
    """
    errors = list(errors)
    if not errors:
        return float("nan")
    residual = sum(float(np.sum((e.force - e.run.force)[e.settled :] ** 2)) for e in errors)
    size = sum(float(np.sum(e.run.force[e.settled :] ** 2)) for e in errors)
    return float(np.sqrt(residual / size))


@checked
def noise_of(runs: Sequence[TestRun]) -> float:
    """RMS of the noise in the forces of several runs over the RMS of these forces.

    Parameters
    ----------
    runs : sequence of TestRun
        The runs.

    Returns
    -------
    float
    """
    deviation = channel_noise(
        [run.force for run in runs], [run.step for run in runs], [run.displacement for run in runs]
    ).deviation
    noise = sum(len(run.force) * one**2 for run, one in zip(runs, deviation, strict=True))
    return float(np.sqrt(noise / sum(float(np.sum(run.force**2)) for run in runs)))


@dataclass(frozen=True, eq=False)
class LawEvaluation(Printed):
    """The errors of a law on measured runs.

    Attributes
    ----------
    device : Device
        The law with its numbers, and effects if it has any.
    campaign : Campaign
        The runs.
    errors : tuple of RunError
        Every run of the campaign, held-out ones included.
    notes : tuple of str
        Remarks on the errors, such as data outside of the law's range.
    """

    device: Device
    campaign: Campaign
    errors: tuple[RunError, ...]
    notes: tuple[str, ...]

    @property
    def error(self) -> float:
        """Relative RMS error of all runs, pooled."""
        return pooled(self.errors)

    @property
    def noise(self) -> float:
        """RMS of the runs' own force noise over the RMS of their force, pooled."""
        return noise_of(self.campaign.runs)

    def tables(self) -> tuple[RenderableType, ...]:
        """Table of the runs, for a terminal.

        Returns
        -------
        tuple of rich.console.RenderableType
        """
        return (render("fit_tables:errors_table", self),)

    def _shown(self) -> Iterator[Any]:
        yield from self.tables()
        yield from (f"note: {each}" for each in self.notes)

    def __repr__(self) -> str:
        return (
            f"LawEvaluation({self.device.law.name} on {self.campaign.name}: error "
            f"{100 * self.error:.3g} %, noise {100 * self.noise:.3g} %)"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return everything but the histories as plain numbers and text.

        Returns
        -------
        dict
            ``law``, ``campaign``, ``error``, ``noise``, ``runs``, ``notes``; errors and noise are
            relative RMS.
        """
        return {
            "law": self.device.law.name,
            "campaign": self.campaign.name,
            "error": self.error,
            "noise": self.noise,
            "runs": [
                {"name": e.run.name, "error": e.relative, "hold_out": e.run.hold_out}
                for e in self.errors
            ],
            "notes": list(self.notes),
        }

    def plot(self) -> Figure:
        """Loops measured and modelled, one panel per run.

        Returns
        -------
        matplotlib.figure.Figure
        """
        return render("loops_fitted:fitted_loops", self)

    @checked
    def to_html(self, path: str | Path) -> Path:
        """Write a report that opens in any browser: loops, errors, and a fit's parameters.

        Parameters
        ----------
        path : str or pathlib.Path
            File to write, replaced whole or not at all.

        Returns
        -------
        pathlib.Path
            The file; it needs no network.
        """
        return self._page().write(path)

    def _page(self) -> Any:
        return render("html.fit_report:evaluation_report", self)


@dataclass(frozen=True, eq=False)
class Fit(LawEvaluation):
    """A fitted law.

    Attributes
    ----------
    device : Device
        The law with the fitted numbers, in the tested device's own scale.
    campaign : Campaign
        The fitted data.
    errors : tuple of RunError
        Every run of the campaign, held-out ones included.
    notes : tuple of str
        Parameters that the data do not determine or distinguish, and effects that the law lacks.
    estimates : tuple of Estimate
        The fitted numbers: every free parameter at every current that is handled.
    converged : bool
        Whether the search converged.
    """

    estimates: tuple[Estimate, ...]
    converged: bool

    @property
    def error(self) -> float:
        """Relative RMS error of the fitted runs, pooled."""
        return pooled(e for e in self.errors if not e.run.hold_out)

    @property
    def noise(self) -> float:
        """RMS of the fitted runs' own force noise over the RMS of their force, pooled."""
        return noise_of(self.campaign.fitted)

    @property
    def held_out_error(self) -> float:
        """Relative RMS error of the held-out runs, pooled; not a number if there are none."""
        return pooled(e for e in self.errors if e.run.hold_out)

    def tables(self) -> tuple[RenderableType, ...]:
        """Tables of the parameters and of the runs, for a terminal.

        Returns
        -------
        tuple of rich.console.RenderableType
        """
        return render("fit_tables:parameters_table", self), render("fit_tables:runs_table", self)

    def to_dict(self) -> dict[str, Any]:
        """Return everything but the histories as plain numbers and text.

        Returns
        -------
        dict
            ``law``, ``error``, ``held_out_error``, ``noise``, ``runs``, ``parameters``, ``notes``,
            ``converged``; errors and noise are relative RMS.
        """
        held = self.held_out_error
        return super().to_dict() | {
            "converged": self.converged,
            "held_out_error": None if np.isnan(held) else held,
            "parameters": [
                {
                    "name": e.name, "unit": e.unit, "current_A": e.current, "value": e.value,
                    "low": e.low, "high": e.high, "determined": e.determined,
                    "at_bound": e.at_bound,
                }
                for e in self.estimates
            ],
        }  # fmt: skip

    def scenario_section(self) -> str:
        """The ``[isolator]`` section of a scenario that uses the fitted device.

        Returns
        -------
        str
            TOML. The scales are those of one device of the tested size: change them.
        """
        return self._section({})

    def _section(self, places: Mapping[str, str]) -> str:
        """The section, with the places of a law and effects that have been copied beside it."""
        return device_section(self.device, f"fitted to {self.campaign.name}", places=places)

    def _exported(self) -> dict[str, pandas.DataFrame]:
        """The law, its numbers, the runs' errors and their loops, a table each."""
        import pandas

        dependence = self.device.current
        law = [
            {"law": self.device.law.name, "parameter": name, "from_current_A": begin}
            | {f"power{k}": number for k, number in enumerate(numbers)}
            for begin, piece in zip(dependence.breaks, dependence.coefficients, strict=False)
            for name, numbers in zip(dependence.names, piece.tolist(), strict=True)
        ]
        loops = {
            f"loops_{e.run.name.removesuffix('.csv')}": pandas.DataFrame({
                "time_s": e.run.time, "displacement_m": e.run.displacement,
                "current_A": e.run.current, "force_N": e.run.force, "fitted_force_N": e.force,
            })
            for e in self.errors
        }  # fmt: skip
        runs = pandas.DataFrame(self.to_dict()["runs"])
        return {"law": pandas.DataFrame(law), "parameters": self.to_pandas(), "runs": runs} | loops

    @checked
    def save(self, path: str | Path, overwrite: bool = False) -> Path:
        """Write the scenario section or all tables to a file, or everything into a folder.

        Parameters
        ----------
        path : str or pathlib.Path
            A file, replaced whole or not at all: ``.toml`` gets the scenario section, ``.mat`` and
            ``.xlsx`` the law's polynomials of the current, the fitted numbers, the runs' errors
            and their loops; or a folder, which gets ``fitted.toml``, these tables as
            CSV, ``result.npz`` and ``report.html``, and which ``isolation_sim.load`` reads.
        overwrite : bool, default False
            Whether to replace the files of a result that is in the folder. Other files stay.

        Returns
        -------
        pathlib.Path
            The file or folder.

        Raises
        ------
        InputError
            If the folder contains a saved result or a file of the same name.
        """
        path = Path(path)
        if path.suffix == ".toml":
            path.parent.mkdir(parents=True, exist_ok=True)
            return write_text(self.scenario_section(), path)
        if path.suffix in (".mat", ".xlsx"):
            path.parent.mkdir(parents=True, exist_ok=True)
            return write_parts(self._exported(), path.suffix[1:], path)
        with files_into(path, overwrite) as place:
            places = copy_code(device_places(self.device), place)
            write_text(self._section(places), place / "fitted.toml")
            for name, table in self._exported().items():
                write_table(table.to_dict("records"), place / f"{file_name(name)}.csv")
            save_archive(self, place / FILE)
            self.to_html(place / "report.html")
            write_contents(place, f"Fit of {self.device.law.name} to {self.campaign.name}")
        return path

    @property
    def criteria(self) -> dict[str, float]:
        """Relative RMS errors of the fitted and the held-out runs, and the forces' noise."""
        return {"error": self.error, "held_out_error": self.held_out_error, "noise": self.noise}

    def to_pandas(self) -> pandas.DataFrame:
        """Return the fitted numbers.

        Returns
        -------
        pandas.DataFrame
            A row for each: ``name``, ``unit``, ``current_A``, ``value``, ``low``, ``high``,
            ``determined``, ``at_bound``.
        """
        import pandas

        return pandas.DataFrame(self.to_dict()["parameters"])

    def __repr__(self) -> str:
        held = f", held out {100 * self.held_out_error:.3g} %" if self.campaign.held_out else ""
        return (
            f"Fit({self.device.law.name} to {self.campaign.name}: {len(self.estimates)} numbers, "
            f"error {100 * self.error:.3g} %{held}, noise {100 * self.noise:.3g} %)"
        )

    def _page(self) -> Any:
        return render("html.fit_report:fit_report", self)
