"""Figures of Tao et al.: loops of Table 4's model, their parts, and the three models compared."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isolation_sim.identification.sinusoidal import sinusoidal
from isolation_sim.laws import Device, law
from isolation_sim.laws.published import TAO_CURRENTS_A, TAO_IMPROVED
from isolation_sim.reports.style import line_styles, new_figure, style

from .conditions_001 import ENDS_A, POINTS, table_4
from .loops import draw_loops, finish
from .models_001 import complex_modulus, improved_loop, traditional

if TYPE_CHECKING:
    from matplotlib.figure import Figure


MODELS = {"complex modulus": complex_modulus, "traditional Bouc-Wen": traditional}


def figures() -> dict[str, Figure]:
    """Draw the loops, their ingredients and the stiffness and damping against the current."""
    motion = table_4(0.5)
    loops = {
        f"{current:g} A": motion.last_cycle(0, j, 0) for j, current in enumerate(TAO_CURRENTS_A)
    }
    rows = [(f"{name} changed", _varied(name, (0.5, 1.0, 1.4))) for name in ("W", "d", "O")]
    return {
        "001_fig20_loops": draw_loops([("", loops)], "kN", "Table 4's model, 1 mm, 0.5 Hz"),
        "001_fig19_parameters": draw_loops(rows, "kN", "Table 4's model at 2 A, 1 mm, 0.5 Hz"),
        "001_fig18_spring_and_step": _ingredients(),
        "001_fig21_fig23_current": _against_current(),
        "001_fig22_models": _loops_of_three(),
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
    k, c, d = (np.array(TAO_IMPROVED[name]) for name in ("k", "c", "d"))
    fitted = {
        name: [model(current) for current in TAO_CURRENTS_A] for name, model in MODELS.items()
    }
    with style():
        figure = new_figure(7.2, 3.4)
        panels = figure.subplots(1, 3)
        tension, improved_line, *lines = line_styles(4, markers=True)
        own = "improved Bouc-Wen, Table 4"
        panels[0].plot(TAO_CURRENTS_A, 1e-6 * k, **improved_line, label=own)
        panels[0].plot(
            TAO_CURRENTS_A, 1e-6 * k * (1 - d), **tension, label="the same in tension, (1 - d) k"
        )
        panels[1].plot(TAO_CURRENTS_A, 1e-3 * c, **improved_line)
        for (name, models), line in zip(fitted.items(), lines, strict=True):
            label = f"{name}, fitted to it"
            panels[0].plot(
                TAO_CURRENTS_A, [1e-6 * fit.stiffness for fit in models], **line, label=label
            )
            panels[1].plot(TAO_CURRENTS_A, [1e-3 * fit.damping for fit in models], **line)
            panels[2].plot(TAO_CURRENTS_A, [fit.error for fit in models], **line)
        for panel, title, unit, top in zip(
            panels,
            ("stiffness", "damping", "error by Eq 24"),
            ("MN/m", "kN s/m", "%"),
            (6.0, 1000.0, 14.0),
            strict=True,
        ):
            panel.set(
                xlabel="current (A)", ylabel=f"{title} ({unit})", title=title, ylim=(0.0, top)
            )
        finish(figure, panels[0], "Three models of one loop: 1 mm, 0.5 Hz, zero position")
    return figure


def _loops_of_three() -> Figure:
    """Figure 22: the improved model's loops, and the other two fitted to them."""
    rows = []
    for current in ENDS_A:
        x, v, force = improved_loop(current)
        loops = {"improved Bouc-Wen, Table 4": (x, v, force)} | {
            f"{name}, fitted to it": (x, v, model(current).force) for name, model in MODELS.items()
        }
        rows.append((f"{current:g} A", loops))
    return draw_loops(rows, "kN", "Three models of one loop: 1 mm, 0.5 Hz, zero position")
