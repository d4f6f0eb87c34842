"""Figures of Yu et al.: loops, test function with its searches, parameters against current."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isolation_sim.laws import Device, hybrid, law
from isolation_sim.laws.published import CURRENTS_A
from isolation_sim.reports.style import line_styles, new_figure, style
from studies.swarm.fruit_fly import fly

from .loops import draw_loops, finish
from .paper_002 import PRINTED, TABLES, means, refit_polynomial
from .search_002 import FAST, GLOBAL, ITERATIONS, LOCAL, POPULATION, cosine, minimum

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figures() -> dict[str, Figure]:
    """Draw the loops, the test function with its searches and the parameters."""
    phase = np.linspace(0, 2 * np.pi, 2001)

    def loop(device: Device, amplitude: float, frequency: float, current: float) -> tuple:
        x = 1e-3 * amplitude * np.sin(phase)
        v = 1e-3 * amplitude * 2 * np.pi * frequency * np.cos(phase)
        return x, v, device.force(x, v, (), current)

    every = law("hybrid", "generalised_refitted")
    rows = [
        (
            "Tables 1-4, 4 mm, 2 Hz",
            {
                f"{current:g} A": loop(hybrid.condition(4, 2, current), 4, 2, current)
                for current in CURRENTS_A
            },
        )
    ]
    rows += [
        (
            f"mean parameters, {amplitude} mm, 2 Hz",
            {f"{current:g} A": loop(every, amplitude, 2, current) for current in CURRENTS_A},
        )
        for amplitude in (2, 8)
    ]
    return {
        "002_mean_loops": draw_loops(rows),
        "002_fig4_parts": _parts(),
        "002_fig6_to_9_search": _search_figure(),
        "002_fig15_parameters": _parameters(),
    }


def _parts() -> Figure:
    device, x = hybrid.condition(8, 4, 1.0), np.linspace(-8e-3, 8e-3, 801)
    up, down = (device.force(x, v, (), 1.0) for v in (FAST, -FAST))
    with style():
        figure = new_figure(7.2, 2.9)
        panels = figure.subplots(1, 3)
        lines = line_styles(2)
        panels[0].plot(1e3 * x, up, **lines[0], label="velocity above 0")
        panels[0].plot(1e3 * x, down, **lines[1], label="velocity below 0")
        panels[1].plot(1e3 * x, (up + down) / 2, **lines[0])
        panels[2].plot(1e3 * x, (up - down) / 2, **lines[0])
        titles = "loop", "mean G(x)", "half thickness H(x)"
        for panel, title in zip(panels, titles, strict=True):
            panel.set(xlabel="displacement (mm)", ylabel="force (N)", title=title)
        finish(figure, panels[0], "Tables 1-4 at 8 mm, 4 Hz, 1 A")
    return figure


def _search_figure() -> Figure:
    """The test function, and distance of the flies and best value of one run of each step."""
    with style():
        figure = new_figure(7.2, 6.8)
        panels = figure.subplots(2, 2)
        x = np.linspace(0.02, 1, 4000)
        panels[0, 0].plot(x, cosine(x[:, None]), "k-", lw=0.8)
        panels[0, 0].set(xlabel="x", ylabel="cos(20πx) / x", title="test function (Eq 18)")
        for (low, high), mark in ((GLOBAL, "o"), (LOCAL, "s")):
            value, at = minimum(low, high)
            panels[0, 0].plot(at, value, f"k{mark}", ms=4, label=f"{value:.3f} at {at:.4f}")
        panels[0, 0].legend(loc="upper right")
        kinds = (
            ("step 20, adaptive", 20.0, True),
            ("step 20, fixed", 20.0, False),
            ("step 2, fixed", 2.0, False),
        )
        iterations = np.arange(1, ITERATIONS + 1)
        for (name, step, adaptive), line, panel in zip(
            kinds,
            line_styles(3, markers=True),
            (panels[0, 1], panels[1, 0], panels[1, 0]),
            strict=True,
        ):
            seen: list[np.ndarray] = []

            def recorded(smell: np.ndarray, seen: list[np.ndarray] = seen) -> np.ndarray:
                seen.append(1 / smell[0, :, 0])
                return cosine(smell)

            rng = np.random.default_rng(4)
            starts = np.array([[[5.0, -4.0]]])
            flight = fly(recorded, starts, step, ITERATIONS, POPULATION, rng, adaptive)
            dots = line | {"linestyle": ""}
            panel.plot(np.repeat(iterations, POPULATION), np.ravel(seen), **dots, ms=2, label=name)
            excess = np.maximum(flight.history[0] - minimum(*GLOBAL)[0], 1e-6)
            panels[1, 1].semilogy(iterations, excess, **line, markevery=7, label=name)
        for panel, title in (
            (panels[0, 1], "flies, falling step"),
            (panels[1, 0], "flies, fixed step"),
        ):
            for (low, high), dash in ((GLOBAL, "-"), (LOCAL, "--")):
                panel.axhline(1 / minimum(low, high)[1], color="0.4", ls=dash, lw=0.8)
            panel.set(
                xlabel="iteration",
                ylabel="distance from the origin, D = 1/x",
                ylim=(0, 60),
                title=title,
            )
        panels[1, 1].set(
            xlabel="iteration",
            ylabel="best value over the least, at least 1e-6",
            title="convergence",
        )
        finish(figure, panels[1, 1], "Fruit fly search, one run each; lines: the two minima")
    return figure


def _parameters() -> Figure:
    fine = np.linspace(0, 3, 61)
    with style():
        figure = new_figure(7.2, 5.4)
        panels = figure.subplots(2, 2)
        lines = line_styles(3)
        for panel, (name, (rows, _, unit)) in zip(panels.flat, TABLES.items(), strict=True):
            every = np.array(list(rows.values()))
            panel.plot(
                np.tile(CURRENTS_A, len(every)),
                every.ravel(),
                "x",
                color="0.6",
                ms=3,
                label="nine conditions",
            )
            panel.plot(CURRENTS_A, means(name), "ko", ms=4, label="mean")
            for label, row, line in (
                ("Eqs 26-29 as printed", [float(c) for c in PRINTED[name]], lines[1]),
                ("refitted", refit_polynomial(name), lines[2]),
            ):
                panel.plot(fine, np.polynomial.polynomial.polyval(fine, row), **line, label=label)
            panel.set(xlabel="current (A)", ylabel=f"{name.replace('_', ' ')} ({unit})")
        finish(figure, panels[0, 0])
    return figure
