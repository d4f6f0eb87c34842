"""The smart base-isolated benchmark building: passive bearings, then MR isolators under control.

Eight storeys with an L-shaped plan, of x, y and rotation each, on a rigid base; seven bidirectional
records, each in both orientations. Matrices and records are those of ``benchmark_8_storey`` in the
shared data. The 92 bearings act as four groups whose centre and radius of gyration are those of
all: their sum is the supplied base case to the last digit, eccentricity included. A group of MR
isolators has one coil and acts along x and y. Isolator displacements are those at the positions of
the 92 bearings. The lead-rubber and friction bearings are biaxial. Their numbers are not those of
the definition papers, which are not public: they have the stiffness of the linear bearings after
yielding or slip, and common textbook values beside it.

Source: S. Narasimhan, S. Nagarajaiah, E. A. Johnson and H. P. Gavin, "Smart base-isolated benchmark
building. Part I: problem definition", Structural Control and Health Monitoring 13 (2006) 573-588.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import isolation_sim as iso
from ground_motions import STANDARD_GRAVITY, Record, read
from isolation_sim.criteria import criteria
from isolation_sim.identification.sinusoidal import sinusoidal
from isolation_sim.io.csv_table import write_table
from isolation_sim.structures import IsolatedStructure, Structure, from_fixed_base

from .benchmark_bearings import BEARINGS
from .study import Outcome, Step, data_folder, published_entry

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from isolation_sim.laws import Device
    from isolation_sim.simulation.result import Run

TITLE = "Smart base-isolated benchmark building"
SHORT_S = 8.0
"""Part of each record that the short form runs, s."""
RECORDS = ("newhall", "sylmar", "elcentro", "rinaldi", "kobe", "jiji", "erzikan")
COMPONENTS = ("fault_parallel", "fault_normal")
"""Of a record: each acts along x once, the other one along y."""
CONTROLLERS: dict[str, dict[str, str]] = {
    name: published_entry(name)
    for name in ("passive_off", "passive_on", "on_off", "clipped_lqr", "clipped_lqg")
} | {
    f"tuned {name}": {"name": name} for name in ("on_off", "clipped_lqr", "clipped_lqg")
} | {"mpc": {"name": "mpc"}}  # fmt: skip
"""With published settings, with those tuned on the reference building, and without preview."""

EIGENVALUES = (49.62, 65.66, 91.05, 496.42, 557.82, 860.45)
"""rad^2/s^2, the first six of the superstructure on a held base as supplied with its matrices. They
are not quite those of the matrices, which were put together from rounded mode shapes."""

BEARING_STIFFNESS = 919.422e3
"""N/m, of a linear bearing."""
BEARING_DAMPING = 27.717e3
"""N s/m, of a linear bearing."""
PLAN = (82.4, 54.3)
"""Sides of the plan, m: the four groups stand as its corners do about the bearings' centre."""

DESIGN_DISPLACEMENT = 0.4
"""Deformation to which the laboratory isolator's largest tested one is scaled, m."""
DESIGN_CURRENT = 1.5
"""Current at which MR isolators are as stiff there as the linear bearings, A."""
LINEAR = "linear bearings"
LEAD_RUBBER = "lead-rubber bearings"
FRICTION = "friction bearings"
CHARACTERISTIC_STRENGTH = 0.05
"""Characteristic strength of the lead-rubber bearings over the weight."""
YIELD_DEFORMATION = 0.01
"""Yield deformation of the lead, m."""
SLIDING = {"mu_max": 0.06, "mu_min": 0.03, "a": 50.0, "u_y": 0.002, "n": 2.0, "tau": 1.0}
"""Friction by speed, deformation before slip (m) and its smooth start in the friction bearings."""
PEAKS = (
    "peak_base_displacement_m", "peak_isolator_displacement_m", "peak_floor_acceleration_m_s2",
    "peak_superstructure_acceleration_m_s2", "peak_drift_m", "peak_drift_ratio",
)  # fmt: skip
INDICES = tuple(f"J{k}" for k in range(1, 10))
DISSIPATION = "normalised_device_dissipation"
WHAT = (
    "base\nshear", "structural\nshear", "isolator\ndispl.", "drift\nratio", "floor\naccel.",
    "device\nforce", "rms isol.\ndispl.", "rms floor\naccel.", "device\nwork",
)  # fmt: skip
"""What the indices are of."""


def structure(folder: Path) -> Structure:
    """Assemble the building on its free base, 24 + 3 degrees of freedom."""
    with np.load(folder / "structure.npz") as data:
        levels = ("base", *(f"floor{k + 1}" for k in range(8)))
        axes = ("x", "y", "rotation")
        return from_fixed_base(
            1e3 * data["M"],
            1e3 * data["C"],
            1e3 * data["K"],
            1e3 * data["m"],
            rigid_motion=data["R"],
            shaken=(0, 1),
            names=[f"{level}_{axis}" for level in levels for axis in axes],
            storeys=[f"storey{k + 1}_{axis}" for k in range(8) for axis in axes],
            heights=np.repeat(data["dh"], 3),
            isolator_positions=BEARINGS,
            name="benchmark building",
        )


def groups() -> tuple[float, NDArray]:
    """Where bearings are, as four groups."""
    places = np.array(BEARINGS)
    centre = places.mean(axis=0)
    gyration = np.sqrt(((places - centre) ** 2).sum(axis=1).mean())
    corner = np.array(PLAN) * gyration / np.hypot(*PLAN)
    signs = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    return len(places) / 4, centre + signs * corner


def on_bearings(folder: Path, device: Device, biaxial: bool = False) -> IsolatedStructure:
    """Put the building on its 92 bearings, whose directions act on each other if biaxial."""
    building = structure(folder)
    count, places = groups()
    isolated = IsolatedStructure(building, ())
    for k, (x, y) in enumerate(places):
        channel = k if device.depends_on_current else None
        bearings, name = device.scaled(force=count), f"isolator{k + 1}"
        turn = building.direction_row("base_rotation")
        rows = [
            building.direction_row(f"base_{axis}") + arm * turn
            for axis, arm in (("x", -y), ("y", x))
        ]
        if biaxial:
            isolated = isolated.with_biaxial(bearings, rows, channel, name)
            continue
        for axis, row in zip("xy", rows, strict=True):
            isolated = isolated.with_element(bearings, row, channel, f"{name}_{axis}")
    return isolated


def linear_bearing() -> Device:
    """Return the published base case's bearing."""
    return iso.law("kelvin_voigt", {"k": BEARING_STIFFNESS, "c": BEARING_DAMPING})


def lead_rubber_bearing(weight: float) -> Device:
    """Return a bearing with lead in the place of the linear one's damping."""
    values = {
        "Q": CHARACTERISTIC_STRENGTH * weight,
        "u_y": YIELD_DEFORMATION,
        "beta": 0.5,
        "gamma": 0.5,
    }
    return iso.law("park_wen_ang", {"k": BEARING_STIFFNESS, "c": 0.0} | values)


def friction_bearing(weight: float) -> Device:
    """Return a friction pendulum with the linear bearing's stiffness in sliding."""
    radius = weight / BEARING_STIFFNESS
    return iso.law("friction_pendulum", {"W": weight, "R": radius} | SLIDING)


def mr_isolator(frequency: float) -> Device:
    """Scale the published strain-stiffening isolator to the building."""
    device = iso.law("strain_stiffening")
    tested = device.tested_deformation
    loops = sinusoidal(device, tested, DESIGN_CURRENT, frequency, cycles=6)
    stiffness = loops.measured(skip=3).effective_stiffness.value
    length = DESIGN_DISPLACEMENT / tested
    return device.scaled(length=length, force=BEARING_STIFFNESS * length / stiffness)


def records(folder: Path, name: str, along_x: str = COMPONENTS[0]) -> list[Record]:
    """Read a record's two components, along x and y."""
    target = sorted(COMPONENTS, key=lambda component: component != along_x)
    return [read(folder / f"{name}.csv", column=f"{component}_m_s2") for component in target]


def isolated_period(building: Structure) -> float:
    """Period that the 92 linear bearings alone give the whole mass, s."""
    return float(2 * np.pi * np.sqrt(building.total_mass / (92 * BEARING_STIFFNESS)))


def outcome(folder: Path, short: bool, step: Step) -> Outcome:
    """Run the study."""
    data = data_folder("benchmark_8_storey")
    linear = on_bearings(data, linear_bearing())
    controlled = on_bearings(data, mr_isolator(1 / isolated_period(linear.structure)))
    weight = linear.structure.total_mass * STANDARD_GRAVITY / len(BEARINGS)
    passive = {
        LEAD_RUBBER: on_bearings(data, lead_rubber_bearing(weight), biaxial=True),
        FRICTION: on_bearings(data, friction_bearing(weight), biaxial=True),
    }
    target = RECORDS[2:4] if short else RECORDS
    names = ("passive_off", "passive_on", "clipped_lqr") if short else tuple(CONTROLLERS)
    motions = [(motion, along_x) for motion in target for along_x in COMPONENTS]
    share = 1 / (len(motions) * (len(names) + len(passive) + 1))
    runs: list[dict[str, Any]] = []
    for motion, along_x in motions:
        ground = records(data, motion, along_x)
        if short:
            ground = tuple(one.cut(0.0, SHORT_S) for one in ground)
        label = {"record": motion, "along_x": along_x}
        step(f"{motion}, {LINEAR}", 0.0)
        base = iso.simulate(linear, ground)
        runs.append(label | _row(LINEAR, base, base))
        for name, plant in passive.items():
            step(f"{motion}, {name}", share)
            runs.append(label | _row(name, iso.simulate(plant, ground), base))
        for name in names:
            one = iso.controller(**CONTROLLERS[name])
            step(f"{motion}, {name}", share)
            runs.append(label | _row(name, iso.simulate(controlled, ground, one), base))
        step(motion, share)
    write_table(runs, folder / "runs.csv")
    headings = ("peak_isolator_displacement_m", *INDICES, DISSIPATION)
    table = [
        {"median of": name} | {heading: _median(runs, name, heading) for heading in headings}
        for name in (LINEAR, *passive, *names)
    ]
    figures = {"indices": _figure(runs, names)}
    return Outcome(table, _finding(linear.structure, runs, names), figures)


def _row(controller: str, run: Run, base: Run) -> dict[str, Any]:
    result = criteria(run, base)
    return {"controller": controller} | {
        name: result[name] for name in (*PEAKS, *INDICES, DISSIPATION)
    }


def _median(runs: list[dict[str, Any]], controller: str, heading: str) -> float:
    return float(np.median([row[heading] for row in runs if row["controller"] == controller]))


def _finding(building: Structure, runs: list[dict[str, Any]], names: tuple[str, ...]) -> str:
    periods = ", ".join(f"{period:.4f}" for period in building.fixed_base_periods()[:6])
    supplied = ", ".join(f"{period:.4f}" for period in 2 * np.pi / np.sqrt(EIGENVALUES))
    twist = np.median(
        [
            row["peak_isolator_displacement_m"] / row["peak_base_displacement_m"]
            for row in runs
            if row["controller"] in (LINEAR, *names)
        ]
    )
    gains = "; ".join(
        f"{name}: J3 {_median(runs, name, 'J3'):.2f}, J5 {_median(runs, name, 'J5'):.2f}, "
        f"J9 {_median(runs, name, 'J9'):.2f}"
        for name in names
    )
    both = {
        name: sum(row["J3"] < 1 and row["J5"] < 1 for row in runs if row["controller"] == name)
        for name in names
    }
    count = sum(row["controller"] == LINEAR for row in runs)
    beyond = [
        row
        for row in runs
        if row["controller"] in names and row["peak_isolator_displacement_m"] > DESIGN_DISPLACEMENT
    ]
    most = max((row for row in runs if row["controller"] in names), key=lambda r: r[DISSIPATION])
    field = (
        f" The devices dissipated up to {most[DISSIPATION]:.2f} of the input energy "
        f"({most['controller']}, {most['record']}): there the current, stiffening deformed "
        "isolators, put energy in that they then dissipated."
        if most[DISSIPATION] > 1
        else ""
    )
    better = ", ".join(f"{name} under {number}" for name, number in both.items())
    least = {
        index: min(names, key=lambda name: _median(runs, name, index)) for index in ("J3", "J5")
    }
    return (
        f"The building's fixed-base periods are {periods} s by the supplied matrices and "
        f"{supplied} s by the eigenvalues supplied with them; its linear bearings alone give the "
        f"whole mass {isolated_period(building):.2f} s. {_passive(runs)} "
        "With MR isolators as stiff as the linear bearings at "
        f"{DESIGN_DISPLACEMENT:g} m and {DESIGN_CURRENT:g} A, the medians over {count} motions "
        "(each record in both orientations), "
        f"over the linear bearings, are {gains}. Isolator displacement is least with "
        f"{least['J3']}, floor acceleration with {least['J5']}. Both are less than on linear "
        f"bearings, of {count} motions, with {better}. The isolator that moves most moves "
        f"{twist:.2f} times as far as the base's centre (median). In {len(beyond)} of "
        f"{count * len(names)} runs an MR isolator is strained further than it was tested.{field}"
    )


def _passive(runs: list[dict[str, Any]]) -> str:
    """What the nonlinear bearings do, in a sentence."""
    medians = [
        f"{name} J1 {_median(runs, name, 'J1'):.2f}, J3 {_median(runs, name, 'J3'):.2f}, "
        f"J5 {_median(runs, name, 'J5'):.2f}"
        for name in (LEAD_RUBBER, FRICTION)
    ]
    return f"Nonlinear bearings of the same stiffness, over the linear ones: {'; '.join(medians)}."


def _figure(runs: list[dict[str, Any]], names: tuple[str, ...]) -> Figure:
    from isolation_sim.reports.style import (
        DOUBLE_COLUMN,
        legend,
        line_styles,
        new_figure,
        style,
    )
    from isolation_sim.written_names import as_written

    with style():
        figure = new_figure(DOUBLE_COLUMN, 3.2)
        axes = figure.subplots()
        looks = line_styles(len(names), markers=True)
        for k, (name, look) in enumerate(zip(names, looks, strict=True)):
            values = np.array(
                [[row[index] for index in INDICES] for row in runs if row["controller"] == name]
            )
            at = np.arange(len(INDICES)) + 0.8 / len(names) * (k - (len(names) - 1) / 2)
            middle = np.median(values, axis=0)
            bars = np.stack([middle - values.min(axis=0), values.max(axis=0) - middle])
            # without lines the styles repeat after the seventh: the rest is hollow
            look = {
                **look,
                "linestyle": "",
                "markerfacecolor": "white" if k >= 7 else look["color"],
            }
            axes.errorbar(
                at, middle, bars, label=as_written(name), elinewidth=0.8, capsize=1.5, **look
            )
        axes.axhline(1.0, color="0.4", linewidth=0.6)
        axes.set_xticks(
            range(len(INDICES)),
            [f"{index}\n{what}" for index, what in zip(INDICES, WHAT, strict=True)],
        )
        axes.set(ylabel="over linear bearings; J6 and J9 of the run itself", yscale="log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter("")
        axes.set_yticks([0.1, 0.2, 0.5, 1.0, 2.0, 5.0])
        legend(figure, axes, "outside upper center")
    return figure
