"""A real building on rubber isolators: what a linear isolation layer gets wrong, and why.

Run it with ``python -m studies.building_record [FOLDER]``; the folder is ``bncs`` of the shared
data: a five-storey building on high-damping rubber, shaken on a table. Floors of equal mass are
assumed. Storeys and a linear isolation layer are fitted to one record (ICA at 50 %); the diagnosis
then sees two records and is judged by the third. The measured isolator displacement was integrated
from the accelerations: its agreement with them is no independent evidence. Table, findings and a
figure of the isolators' loops go to the terminal and to ``results/building_record``.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

import isolation_sim as iso
from ground_motions import Record
from isolation_sim.discrepancy.building import BuildingDiagnosis, diagnose_building
from isolation_sim.discrepancy.building_causes import Candidate, Parameter, Values
from isolation_sim.discrepancy.building_fit import compare_records
from isolation_sim.discrepancy.building_model import BuildingModel, building_model
from isolation_sim.discrepancy.building_record import (
    DISPLACEMENT,
    BuildingRecord,
    read_building_record,
)
from isolation_sim.structures import IsolatedStructure

DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "bncs"
RESULTS = Path("results/building_record")
FITTED_FIRST, OTHERS = "ICA50", ("ICA100", "CNP100")
EVERY = 4
"""Samples of 200 Hz that become one of 50 Hz: the building's modes lie below 15 Hz."""
STRONG = 0.98
"""Share of the ground motion's energy after which a record is cut."""
FLOOR_MASS = 2e5
"""kg; only ratios to it matter, since no force was measured."""


@dataclass(frozen=True)
class Prediction:
    """Errors of one channel group on one record.

    Attributes
    ----------
    record : str
        Name.
    fitted : bool
        Whether the extended model has seen it.
    displacement, acceleration : tuple of float
        RMS error over RMS, linear and extended, of isolator displacement and floors.
    """

    record: str
    fitted: bool
    displacement: tuple[float, float]
    acceleration: tuple[float, float]


def prepared(folder: Path, name: str) -> BuildingRecord:
    """Read a record, bring it to 50 Hz and cut the quiet after its strong part."""
    from scipy.signal import decimate

    record = read_building_record(folder / f"{name}.csv")

    def slower(values: NDArray) -> NDArray:
        return decimate(values, EVERY, ftype="fir")

    shaking = slower(record.ground.acceleration)
    energy = np.cumsum(shaking**2)
    end = int(np.searchsorted(energy, STRONG * energy[-1]))
    ground = Record(shaking[:end], record.ground.dt * EVERY, name)
    return BuildingRecord(name, ground, {c: slower(v)[:end] for c, v in record.response.items()})


def linear_building(values: Sequence[float]) -> IsolatedStructure:
    """Five storeys on a linear spring and dashpot.

    Parameters
    ----------
    values : sequence of float
        Layer's stiffness (N/m) and damping (N s/m), storeys' stiffness from below (N/m), damping
        ratio of the superstructure.
    """
    k, c, *storeys, ratio = values
    structure = iso.shear_building(
        [FLOOR_MASS] * 5, storeys, base_mass=FLOOR_MASS, damping_ratio=ratio, name="BNCS building"
    )
    return structure.on(iso.law("kelvin_voigt", {"k": k, "c": c}))


def fitted_building(record: BuildingRecord) -> IsolatedStructure:
    """Fit storeys and a linear isolation layer to one record."""
    total = 6 * FLOOR_MASS
    layer, storey = total * (2 * np.pi / 2.2) ** 2, FLOOR_MASS * (2 * np.pi / 0.25) ** 2
    start = (layer, 0.2 * np.sqrt(layer * total), *[storey] * 5, 0.04)

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        isolated = linear_building(values)
        return replace(model, nominal=isolated, structure=isolated.structure)

    whole = Candidate(
        "linear_building", "",
        (
            *(Parameter(f"p{k}", "1", v / 30, v * 30, True) for k, v in enumerate(start[:-1])),
            Parameter("ratio", "1", 0.001, 0.3),
        ),
        (start,), apply, "",
    )  # fmt: skip
    model = building_model(linear_building(start), [record])
    outcome = compare_records(model, [record]).fit((), ((whole, start),), most=40)
    return linear_building(outcome.found[0][1])


def errors(isolated: IsolatedStructure, record: BuildingRecord) -> tuple[float, float]:
    """Relative error of the isolator displacement and of the floors' accelerations."""
    measured = record.values
    residual = measured - building_model(isolated, [record]).predict(record)
    share = np.sqrt((residual**2).sum(axis=0) / (measured**2).sum(axis=0))
    return float(share[-1]), float(np.sqrt(np.mean(share[:-1] ** 2)))


def judged(
    linear: IsolatedStructure, diagnosis: BuildingDiagnosis, records: Sequence[BuildingRecord]
) -> list[Prediction]:
    """Errors of the linear and of the extended building on every record."""
    assert diagnosis.building is not None
    rows = []
    for record in records:
        pairs = [errors(model, record) for model in (linear, diagnosis.building)]
        displacement, acceleration = zip(*pairs, strict=True)
        rows.append(Prediction(record.name, not record.hold_out, displacement, acceleration))
    return rows


def table(rows: Sequence[Prediction]) -> Table:
    """Errors, a line a record."""
    result = Table(title="RMS error over RMS, %")
    for heading in ("record", "extended model", "displacement\nlinear", "\nextended",
                    "acceleration\nlinear", "\nextended"):  # fmt: skip
        result.add_column(heading, justify="right")
    for row in rows:
        cells = [f"{100 * e:.1f}" for e in (*row.displacement, *row.acceleration)]
        result.add_row(row.record, "fitted" if row.fitted else "not seen", *cells)
    return result


def findings(rows: Sequence[Prediction], diagnosis: BuildingDiagnosis) -> str:
    """Say what was found, from the numbers alone."""
    unseen = next(row for row in rows if not row.fitted)

    def change(pair: tuple[float, float]) -> str:
        return f"{100 * pair[0]:.0f} to {100 * pair[1]:.0f} %"

    named = "; ".join(
        f"{cause.name} ({100 * cause.share:.0f} % of the misfit on {unseen.record})"
        for cause in diagnosis.causes
    )
    return (
        f"The linear isolation layer is {diagnosis.verdict.replace('_', ' ')} by: "
        f"{named or 'none of the causes known'}. On {unseen.record}, which the extended model has "
        f"not seen, the error of the isolator displacement goes from "
        f"{change(unseen.displacement)} and that of the accelerations from "
        f"{change(unseen.acceleration)}. {100 * diagnosis.unexplained_share:.0f} % of the weighted "
        "misfit there stays without a name. Before any cause, the residual depends on "
        f"{', '.join(diagnosis.depends_on) or 'nothing that was asked'}."
    )


def figure(
    linear: IsolatedStructure, extended: IsolatedStructure, records: Sequence[BuildingRecord]
) -> Any:
    """Draw the isolators' loops: restoring force over total mass against displacement."""
    import matplotlib.pyplot as plt

    from isolation_sim.reports.style import DOUBLE_COLUMN, style

    with style():
        fig, axes = plt.subplots(
            1, len(records), figsize=(DOUBLE_COLUMN, 2.8), squeeze=False, sharey=True
        )
        for axis, record in zip(axes[0], records, strict=True):
            drawn = [("measured", record.values, {"color": "0.7", "lw": 1.8})]
            for label, model in (("linear", linear), ("extended", extended)):
                values = building_model(model, [record]).predict(record)
                drawn.append((label, values, {"lw": 0.7}))
            for label, values, look in drawn:
                force = -values[:, :-1].mean(axis=1)
                axis.plot(1e3 * values[:, -1], force, label=label, **look)
            seen = "not seen" if record.hold_out else "fitted"
            axis.set_title(f"{record.name}, {seen}")
            axis.set_xlabel("isolator displacement, mm")
        axes[0, 0].set_ylabel("force over mass, m/s²")
        lines, names = axes[0, 0].get_legend_handles_labels()
        fig.legend(lines, names, loc="outside upper center", ncols=len(names))
    return fig


def main(folder: Path = DATA, results: Path = RESULTS, unseen: str = "CNP100") -> str:
    """Run the study.

    Parameters
    ----------
    folder : pathlib.Path
        With the three records.
    results : pathlib.Path
        Where table, findings and figure go.
    unseen : str
        The record that judges.

    Returns
    -------
    str
        The findings.
    """
    records = [prepared(folder, name) for name in (FITTED_FIRST, *OTHERS)]
    linear = fitted_building(records[0])
    records = [replace(r, hold_out=r.name == unseen) for r in records]
    diagnosis = diagnose_building(records, linear)
    rows = judged(linear, diagnosis, records)
    said = findings(rows, diagnosis)
    console = Console(width=100)
    diagnosis.save(results)
    with (results / "building_record.txt").open("w", encoding="utf-8") as file:
        for out in (console, Console(file=file, width=100)):
            out.print(table(rows))
            for cause in diagnosis.causes:
                out.print(cause.evidence)
            out.print(said)
    assert diagnosis.building is not None
    figure(linear, diagnosis.building, records).savefig(results / f"loops_{DISPLACEMENT}.png")
    return said


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]))
