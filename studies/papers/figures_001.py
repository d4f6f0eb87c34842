"""Figures of Tao et al.: loops of Table 4's model, their parts, and measures against current."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isolation_sim.identification.sinusoidal import sinusoidal
from isolation_sim.laws import Device, law
from isolation_sim.laws.published import TAO_CURRENTS_A, TAO_IMPROVED
from isolation_sim.reports.style import line_styles, new_figure, style

from .conditions_001 import ENDS_A, POINTS, modulus, table_4
from .loops import draw_loops, finish

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figures() -> dict[str, Figure]:
    """Draw the loops, their ingredients and the stiffness and damping against the current.

    Returns
    -------
    dict of str to matplotlib.figure.Figure
        By file name.
    """
    motion = table_4(0.5)
    loops = {f"{current:g} A": motion.last_cycle(0, j) for j, current in enumerate(TAO_CURRENTS_A)}
    rows = [(f"{name} changed", _varied(name, (0.5, 1.0, 1.4))) for name in ("W", "d", "O")]
    return {
        "001_fig20_loops": draw_loops([("", loops)], "kN", "Table 4's model, 1 mm, 0.5 Hz"),
        "001_fig19_parameters": draw_loops(rows, "kN", "Table 4's model at 2 A, 1 mm, 0.5 Hz"),
        "001_fig18_spring_and_step": _ingredients(),
        "001_fig21_current": _against_current(),
    }


def _fixed(**changes: float) -> Device:
    """Table 4's model at 2 A with some parameters multiplied."""
    device = law("improved_bouc_wen")
    values = dict(zip(device.law.parameter_names, device.parameters_at(2.0), strict=True))
    return device.with_parameters(
        **{name: float(value) * changes.get(name, 1.0) for name, value in values.items()}
    )


def _varied(name: str, factors: tuple[float, ...]) -> dict[str, tuple[np.ndarray, ...]]:
    return {
        f"{factor:g} times Table 4's": sinusoidal(
            _fixed(**{name: factor}), [1e-3], 0.0, 0.5, 3, POINTS
        ).last_cycle(0)
        for factor in factors
    }


def _ingredients() -> Figure:
    """The spring and the step of the damping, each taken out of the law's force."""
    device = law("improved_bouc_wen")
    x = np.linspace(-1.2e-3, 1.2e-3, 2401)
    with style():
        figure = new_figure(7.2, 3.2)
        left, right = figure.subplots(1, 2)
        lines = line_styles(4)
        for current, line in zip(ENDS_A, (lines[0], lines[1]), strict=True):
            spring = 1e-3 * device.force(x, 0.0, (0.0,), current)
            left.plot(1e3 * x, spring, **line, label=f"{current:g} A")
        for current, pair in zip(ENDS_A, ((lines[0], lines[2]), (lines[1], lines[3])), strict=True):
            c = device.parameters_at(current)[5]
            for speed, line in zip((1e-3, -1e-3), pair, strict=True):
                viscous = device.force(x, speed, (0.0,), current) - device.force(
                    x, 0.0, (0.0,), current
                )
                way = "extending" if speed > 0 else "returning"
                right.plot(1e3 * x, viscous / (c * speed), **line, label=f"{current:g} A, {way}")
        left.set(
            xlabel="displacement (mm)",
            ylabel="force of the spring (kN)",
            title="asymmetric stiffness (1 - ε) k x",
        )
        right.set(
            xlabel="displacement (mm)",
            ylabel="share of the damping f",
            ylim=(-0.05, 1.05),
            title="stepped damping f(x, v)",
        )
        left.legend(loc="upper left")
        finish(figure, right)
    return figure


def _against_current() -> Figure:
    k, d = (np.array(TAO_IMPROVED[name]) for name in ("k", "d"))
    found = np.array([modulus(1.0, 0.5, current) for current in TAO_CURRENTS_A])
    sets = (
        (
            ("compression, k", 1e-6 * k),
            ("tension, (1 - d) k", 1e-6 * k * (1 - d)),
            ("complex modulus of the model", 1e-6 * found[:, 0]),
        ),
        (
            ("c", 1e-3 * np.array(TAO_IMPROVED["c"])),
            (None, None),
            ("complex modulus of the model", 1e-3 * found[:, 1]),
        ),
    )
    with style():
        figure = new_figure(7.2, 3.2)
        panels = figure.subplots(1, 2)
        for panel, curves in zip(panels, sets, strict=True):
            for (label, values), line in zip(curves, line_styles(3, markers=True), strict=True):
                if values is not None:
                    panel.plot(TAO_CURRENTS_A, values, **line, label=label)
            panel.set(xlabel="current (A)")
            panel.legend(loc="lower right")
        panels[0].set(ylabel="stiffness (MN/m)", title="stiffness", ylim=(2, 6))
        panels[1].set(ylabel="damping (kN s/m)", title="damping", ylim=(0, 950))
        figure.suptitle("Table 4's model, 1 mm, 0.5 Hz", fontsize=9)
    return figure
