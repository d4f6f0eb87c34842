"""A real building on rubber isolators: errors of a linear isolation layer, and their causes.

A five-storey building on high-damping rubber was shaken on a table (``bncs`` of the shared data).
Floors of equal mass are assumed. The superstructure is identified from the base's accelerations,
apart from any isolator; a linear spring and dashpot below it are fitted to the response at 50 %.
The isolation layer's force is minus the mass times the mean of the six accelerations, so that the
records hold measured loops of it: the diagnosis judges the linear layer by them, and what it finds
is put under the building again, to predict the response to each ground motion. The measured
isolator displacement was integrated from the accelerations: its agreement with them is no
independent evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import isolation_sim as iso
from ground_motions import Record
from isolation_sim.discrepancy.building.record import BuildingRecord, read_building_record
from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.discrepancy.diagnosis import Diagnosis
from isolation_sim.identification.campaign import Campaign, TestRun
from isolation_sim.laws import Device
from isolation_sim.structures import IsolatedStructure, Structure

from .study import Outcome, Step, data_folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLE = "A real building on rubber isolators: errors of a linear isolation layer"
RECORDS = {"ICA50": "ICA 50 %", "ICA100": "ICA 100 %", "CNP100": "Canoga Park 100 %"}
FIRST = "ICA50"
SHOWN = (("ICA50",), ("ICA50", "ICA100"))
"""Records that the diagnosis uses; the others validate."""
EVERY = 4
"""Samples of 200 Hz that become one of 50 Hz: the building's modes lie below 15 Hz."""
LOOPS_EVERY, SHORT_EVERY = 2, 3
"""Samples of 50 Hz that become one in the loops: the layer's force lies below 5 Hz."""
STRONG = 0.98
"""Share of the ground motion's energy after which a record is cut."""
FLOOR_MASS = 2e5
"""kg; only ratios to it matter, since no force was measured."""
TOTAL_MASS = 6 * FLOOR_MASS


@dataclass(frozen=True, eq=False)
class Layer:
    """An isolation layer under the building, and what it predicts."""

    name: str  # To print
    shown: tuple[str, ...]  # Records that it was fitted to
    responses: dict[str, NDArray]  # By record; channels as measured, m/s2 and m


def read_resampled(folder: Path, name: str) -> BuildingRecord:
    """Read a record, bring it to 50 Hz and cut the quiet after its strong part."""
    from scipy.signal import decimate

    record = read_building_record(folder / f"{name}.csv")

    def slower(values: NDArray) -> NDArray:
        return decimate(values, EVERY, ftype="fir")

    shaking = slower(record.ground[0].acceleration)
    energy = np.cumsum(shaking**2)
    end = int(np.searchsorted(energy, STRONG * energy[-1]))
    ground = Record(shaking[:end], record.dt * EVERY, name)
    return BuildingRecord(name, (ground,), {c: slower(v)[:end] for c, v in record.response.items()})


def superstructure(storey_stiffness: float, damping_ratio: float) -> Structure:
    """Five equal storeys on a base, all floors of one mass."""
    return iso.shear_building(
        [FLOOR_MASS] * 5, [storey_stiffness] * 5, base_mass=FLOOR_MASS,
        damping_ratio=damping_ratio, name="BNCS building",
    )  # fmt: skip


def floor_accelerations(structure: Structure, base: NDArray, dt: float) -> NDArray:
    """Absolute accelerations of the floors above a base that moves as measured."""
    from scipy.signal import lsim

    fixed = structure.fixed_base()
    n = fixed.n_dofs
    rates = -np.linalg.solve(fixed.mass, np.hstack([fixed.stiffness, fixed.damping]))
    states = np.vstack([np.eye(2 * n)[n:], rates])
    driven = np.concatenate([np.zeros(n), -fixed.influence[:, 0]])[:, np.newaxis]
    system = states, driven, rates, np.zeros((n, 1))
    return lsim(system, base, dt * np.arange(len(base)))[1]


def identify_superstructure(record: BuildingRecord) -> Structure:
    """Fit storey stiffness and damping ratio to the floors' accelerations above the base."""
    base, floors = record.values[:, 0], record.values[:, 1:-1]

    def residual(x: NDArray) -> NDArray:
        result = floor_accelerations(superstructure(*np.exp(x)), base, record.dt)
        return ((result - floors) / np.linalg.norm(floors, axis=0)).ravel()

    return superstructure(*_fit(residual, (FLOOR_MASS * (2 * np.pi / 0.2) ** 2, 0.05)))


def linear_layer(structure: Structure, record: BuildingRecord) -> Device:
    """Fit a spring and dashpot under the building to its response."""
    measured = record.values

    def layer(x: NDArray) -> Device:
        k, c = np.exp(x).tolist()
        return iso.law("kelvin_voigt", {"k": k, "c": c})

    def residual(x: NDArray) -> NDArray:
        result = response(structure.on(layer(x)), record)
        return ((result - measured) / np.linalg.norm(measured, axis=0)).ravel()

    omega = 2 * np.pi / 2.4
    start = (TOTAL_MASS * omega**2, 0.3 * omega * TOTAL_MASS)
    return layer(np.log(_fit(residual, start)))


def _fit(residual: Callable[[NDArray], NDArray], start: Sequence[float]) -> NDArray:
    """Least squares over the logarithms of positive numbers."""
    from scipy.optimize import least_squares

    return np.exp(least_squares(residual, np.log(start), diff_step=1e-3, xtol=1e-5).x)


def response(isolated: IsolatedStructure, record: BuildingRecord) -> NDArray:
    """Simulate a record's channels."""
    run = iso.simulate(isolated, record.ground)
    names = [f"{dof}_acceleration_m_s2" for dof in isolated.structure.names]
    return np.column_stack([run.output(name) for name in (*names, "base_displacement_m")])


def layer_force(values: NDArray) -> NDArray:
    """Restoring force of the isolation layer from the accelerations, floors of equal mass."""
    return -TOTAL_MASS * values[:, :-1].mean(axis=1)


def loops(
    records: Sequence[BuildingRecord], shown: Sequence[str], every: int = LOOPS_EVERY
) -> Campaign:
    """Measured loops of the isolation layer as a campaign of device tests."""
    runs = []
    for record in records:
        keep = slice(None, None, every)
        x = record.values[:, -1]
        v = np.gradient(x, record.dt)
        time = record.time[keep]
        runs.append(
            TestRun(
                record.name, time, x[keep], v[keep], layer_force(record.values)[keep],
                np.zeros(len(time)), hold_out=record.name not in shown, velocity_measured=True,
            )
        )  # fmt: skip
    return Campaign("BNCS isolation layer", "shake table", tuple(runs))


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    data = data_folder("bncs")
    records = [read_resampled(data, name) for name in RECORDS]
    first = next(record for record in records if record.name == FIRST)
    step("fitting the building at 50 %", 0.0)
    structure = identify_superstructure(first)
    linear = linear_layer(structure, first)
    step("linear layer", 0.1)
    layers = [_layer("linear", (FIRST,), structure, linear, records)]
    diagnoses = []
    choices = SHOWN[-1:] if short else SHOWN
    for shown in choices:
        step(f"diagnosing {', '.join(shown)}", 0.0)
        campaign = loops(records, shown, SHORT_EVERY if short else LOOPS_EVERY)
        diagnosis = diagnose(campaign, linear.law, linear)
        diagnosis.save(folder / f"diagnosis_{'_'.join(shown)}")
        assert diagnosis.extended is not None
        name = f"extended by {', '.join(RECORDS[one] for one in shown)}"
        layers.append(_layer(name, shown, structure, diagnosis.extended, records))
        diagnoses.append(diagnosis)
        step(f"diagnosing {', '.join(shown)}", 0.9 / len(choices))
    table = [_row(layer, record) for layer in layers for record in records]
    finding = _finding(structure, first, table, diagnoses, layers)
    return Outcome(table, finding, {"loops": _figure(records, layers[0], layers[-1])})


def _layer(
    name: str, shown: tuple[str, ...], structure: Structure, device: Device,
    records: Sequence[BuildingRecord],
) -> Layer:  # fmt: skip
    isolated = structure.on(device)
    return Layer(name, shown, {record.name: response(isolated, record) for record in records})


def _row(layer: Layer, record: BuildingRecord) -> dict[str, Any]:
    result, measured = layer.responses[record.name], record.values
    errors = np.linalg.norm(result - measured, axis=0) / np.linalg.norm(measured, axis=0)
    peaks = np.abs(result).max(axis=0) / np.abs(measured).max(axis=0)
    return {
        "isolation layer": layer.name, "record": RECORDS[record.name],
        "used": "fitted" if record.name in layer.shown else "not seen",
        "isolator displacement, RMS error %": 100 * float(errors[-1]),
        "accelerations, %": 100 * float(np.sqrt(np.mean(errors[:-1] ** 2))),
        "peak displacement over measured": float(peaks[-1]),
        "peak acceleration over measured": float(
            np.abs(result[:, :-1]).max() / np.abs(measured[:, :-1]).max()
        ),
    }  # fmt: skip


def _finding(
    structure: Structure, first: BuildingRecord, table: Sequence[dict[str, Any]],
    diagnoses: Sequence[Diagnosis], layers: Sequence[Layer],
) -> str:  # fmt: skip
    base, floors = first.values[:, 0], first.values[:, 1:-1]
    missed = floor_accelerations(structure, base, first.dt) - floors
    sentences = [
        f"Above the measured base the identified storeys follow the floors within "
        f"{100 * np.linalg.norm(missed) / np.linalg.norm(floors):.0f} % (RMS, {RECORDS[FIRST]}); "
        "the linear layer fitted to that record misses it all the same:"
        f"{_errors_text(table, layers[0])}."
    ]
    for diagnosis, layer in zip(diagnoses, layers[1:], strict=True):
        named = ", ".join(
            f"{cause.label} ({cause.form}, {100 * cause.share:.0f} %)"
            if cause.form
            else f"{cause.label} ({100 * cause.share:.0f} %)"
            for cause in diagnosis.causes
        )
        sentences.append(
            f"Shown the loops of {', '.join(RECORDS[one] for one in layer.shown)}, the diagnosis "
            f"calls it {diagnosis.verdict.replace('_', ' ')}: {named or 'no cause'}; the force's "
            f"error on the other records goes from {100 * diagnosis.error_before.held_out:.0f} to "
            f"{100 * diagnosis.error_after.held_out:.0f} %. Under the building, the extended "
            f"layer misses{_errors_text(table, layer)}."
        )
    return "\n".join(sentences)


def _errors_text(table: Sequence[dict[str, Any]], layer: Layer) -> str:
    rows = [row for row in table if row["isolation layer"] == layer.name]
    return ";".join(
        f" {row['record']} ({row['used']}) by {row['isolator displacement, RMS error %']:.0f} % in "
        f"isolator displacement (its peak {row['peak displacement over measured']:.2f} times the "
        f"measured one) and {row['accelerations, %']:.0f} % in accelerations"
        for row in rows
    )


def _figure(records: Sequence[BuildingRecord], linear: Layer, extended: Layer) -> Figure:
    from isolation_sim.reports.style import DOUBLE_COLUMN, legend, new_figure, style

    looks = {
        "measured": {"color": "#9a9a9a", "linewidth": 1.4},
        "linear": {"color": "#D55E00", "linewidth": 0.7, "linestyle": "--"},
        "extended": {"color": "#000000", "linewidth": 0.7},
    }
    with style():
        figure = new_figure(DOUBLE_COLUMN, 4.6)
        panels = figure.subplots(2, len(records))
        for (upper, lower), record in zip(panels.T, records, strict=True):
            lines = {
                "measured": record.values,
                "linear": linear.responses[record.name],
                "extended": extended.responses[record.name],
            }
            strong = _strong(record)
            for name, values in lines.items():
                force = layer_force(values)[strong] / TOTAL_MASS
                moved = 1e3 * values[strong, -1]
                upper.plot(moved, force, label=name, **looks[name])
                lower.plot(record.time[strong], moved, **looks[name])
            seen = "fitted" if record.name in extended.shown else "not seen"
            upper.set_title(f"{RECORDS[record.name]}, {seen}")
            upper.set_xlabel("isolator displacement, mm")
            lower.set_xlabel("time, s")
        panels[0, 0].set_ylabel("force over mass, m/s²")
        panels[1, 0].set_ylabel("isolator displacement, mm")
        legend(figure, panels[0, 0], "outside upper center")
    return figure


def _strong(record: BuildingRecord, duration: float = 30.0) -> slice:
    """The time around the largest displacement."""
    dt = record.dt
    peak, half = int(np.argmax(np.abs(record.values[:, -1]))), int(duration / 2 / dt)
    return slice(max(peak - half, 0), peak + half)
