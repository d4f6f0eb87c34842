"""Figures of the pages on ideas, computed when the documentation is built."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import isolation_sim as iso
from controllers import CurrentMap, controller
from ground_motions import el_centro_1940, response_spectrum
from isolation_sim.identification.sinusoidal import sinusoidal
from isolation_sim.reports.style import line_styles, new_figure, style, svg_text
from studies.papers.tables import LI_LI_STIFFNESS_N_PER_MM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 7.2


def write_figures(folder: Path, short: bool = False) -> None:
    """Draw all figures.

    Parameters
    ----------
    folder : pathlib.Path
        Where to.
    short : bool, optional
        Whether they are computed, but not drawn.
    """
    for draw in FIGURES:
        with style():
            figure = draw()
        write_svg(figure, folder / f"{draw.__name__}.svg", empty=short)


def write_svg(figure: Figure, path: Path, empty: bool = False) -> None:
    """Write a figure as the pages show it.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        The figure.
    path : pathlib.Path
        Its file.
    empty : bool, optional
        Whether an empty picture stands in its place.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(EMPTY if empty else svg_text(figure), encoding="utf-8")


EMPTY = '<svg xmlns="http://www.w3.org/2000/svg"/>'


def spectra() -> Figure:
    """Draw what a longer period and damping do to a rigid building on a linear isolator."""
    figure = new_figure(WIDTH, 2.9)
    left, right = figure.subplots(1, 2)
    periods = np.linspace(0.2, 4.0, 120)
    for damping, line in zip((0.02, 0.1, 0.2), line_styles(3), strict=True):
        result = response_spectrum(el_centro_1940(), periods, damping)
        label = f"damping ratio {damping:g}"
        left.plot(periods, result.sa, label=label, **line)
        right.plot(periods, 1e3 * result.sd, label=label, **line)
    left.set(xlabel="period (s)", ylabel="peak acceleration (m/s²)")
    right.set(xlabel="period (s)", ylabel="peak displacement (mm)")
    right.legend()
    return figure


def trade() -> Figure:
    """Draw base displacement against floor acceleration: currents held, and controllers."""
    isolated = _isolated()
    amperes = np.arange(0.0, 5.01, 0.25)
    cases = [
        iso.Case(isolated, el_centro_1940(), controller("constant", amperes=i)) for i in amperes
    ]
    held = iso.simulate_many(cases).criteria
    figure = new_figure(WIDTH, 3.4)
    panel = figure.subplots()
    base, floor = (held[f"peak_{key}"] for key in _PEAKS)
    panel.plot(1e3 * base, floor, "o-", color="0.6", markersize=3, label="current held")
    for k in range(0, len(amperes), 4):
        panel.annotate(f"{amperes[k]:g} A", (1e3 * base[k], floor[k]), xytext=(4, 4),
                       textcoords="offset points", fontsize=7)  # fmt: skip
    names = ("on_off", "clipped_lqr", "best_constant")
    for name, marker, line in zip(names, "s^D", line_styles(4)[1:], strict=True):
        run = iso.simulate(isolated, el_centro_1940(), name)
        x, y = (run.criteria[f"peak_{key}"] for key in _PEAKS)
        panel.plot(1e3 * x, y, marker, color=line["color"], markersize=7, label=name)
    panel.set(xlabel="peak base displacement (mm)", ylabel="peak floor acceleration (m/s²)")
    panel.legend()
    return figure


_PEAKS = ("base_displacement_m", "floor_acceleration_m_s2")


def elastomer() -> Figure:
    """Draw loops of the published isolator and its stiffness against the amplitude."""
    device = iso.law("strain_stiffening")
    figure = new_figure(WIDTH, 3.0)
    left, right = figure.subplots(1, 2)
    amplitudes = np.linspace(1e-3, 8e-3, 8)
    for current, line in zip((0.0, 1.0, 2.0, 3.0), line_styles(4), strict=True):
        motion = sinusoidal(device, amplitudes, current, 1.0, cycles=6, points=256)
        x, _, force = motion.last_cycle(len(amplitudes) - 1)
        left.plot(1e3 * x, force, label=f"{current:g} A", **line)
        stiffness = [motion.measured(k, skip=3).effective_stiffness.value
                     for k in range(len(amplitudes))]  # fmt: skip
        right.plot(1e3 * amplitudes, 1e-3 * np.array(stiffness), **line)
        measured = {a: row[int(current)] for a, row in LI_LI_STIFFNESS_N_PER_MM.items()}
        right.plot(*zip(*measured.items(), strict=True), "o", color=line["color"])
    left.set(xlabel="deformation (mm)", ylabel="force (N)")
    left.legend()
    right.set(xlabel="amplitude (mm)", ylabel="effective stiffness (N/mm)")
    right.set_ylim(bottom=0)
    return figure


def switching() -> Figure:
    """Draw the work of on-off switching, under the instantaneous rule and the passive one."""
    figure = new_figure(WIDTH, 2.9)
    left, right = figure.subplots(1, 2)
    device = iso.reference_isolators()
    rules = {"instantaneous rule": device, "passive rule": iso.passive(device)}
    for (label, one), line in zip(rules.items(), line_styles(2), strict=True):
        isolated = iso.reference_building().on(one)
        run = iso.simulate(isolated, el_centro_1940(), "on_off")
        left.plot(run.time, 1e-3 * run.energy.field_work_J, label=label, **line)
        panel_loop(right, run, (2.5, 6.5), line)
    left.set(xlabel="time (s)", ylabel="field work (kJ)")
    left.legend()
    right.set(xlabel="isolator deformation (mm)", ylabel="isolator force (kN)")
    return figure


def panel_loop(panel: Axes, run: iso.Run, between: tuple[float, float], line: dict) -> None:
    """Draw an isolator's force over its deformation between two instants."""
    name = run.isolated.element_names[0]
    shown = (run.time >= between[0]) & (run.time <= between[1])
    x, force = (run.output(f"{name}_{what}")[shown] for what in ("deformation_m", "force_N"))
    panel.plot(1e3 * x, 1e-3 * force, **line)


def current_map() -> Figure:
    """Draw the forces within an isolator's reach along a cycle, and the current for a target."""
    device = iso.reference_isolators()
    motion = sinusoidal(iso.law("strain_stiffening"), 6e-3, 1.0, 0.5, cycles=4, points=256)
    low, high = 0.0, 3.0
    n = motion.points
    x, v = device.length * motion.displacement[-n:], device.length * motion.velocity[-n:]
    states = motion.states[-n:]
    inverse = CurrentMap(device, low, high)
    ends = [device.force(x, v, tuple(states.T), i) for i in (low, high)]
    # target: linear spring and dashpot
    target = 5e6 * x + 2e6 * v
    result = [inverse(*each) for each in zip(target, x, v, states, strict=True)]
    figure = new_figure(WIDTH, 2.9)
    left, right = figure.subplots(1, 2)
    time = np.arange(n) / (motion.frequency * motion.points)
    left.fill_between(time, 1e-3 * ends[0], 1e-3 * ends[1], color="0.85", label="0 A to 3 A")
    left.plot(time, 1e-3 * target, "--", color="#D55E00", label="target")
    left.plot(time, [1e-3 * each.force for each in result], color="black", label="result")
    left.set(xlabel="time (s)", ylabel="force (kN)")
    left.legend()
    right.plot(time, [each.current for each in result], color="black")
    right.set(xlabel="time (s)", ylabel="current (A)")
    return figure


def ledger() -> Figure:
    """Draw where the energy of two runs went."""
    runs = {n: iso.simulate(_isolated(), el_centro_1940(), n) for n in ("passive_off", "on_off")}
    return iso.Comparison(runs).plot("energy")


@cache
def _isolated() -> iso.IsolatedStructure:
    return iso.reference_building().on(iso.reference_isolators())


FIGURES: tuple[Callable[[], Figure], ...] = (
    spectra, trade, elastomer, switching, current_map, ledger,
)  # fmt: skip
