"""A page for every law of the registry: equations, quantities, loops, published numbers."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import equations
import numpy as np
from figures import write_svg
from markdown import display, figure, prose, table, written

from isolation_sim import available_conditions, available_sets, fit, law
from isolation_sim.identification.campaign import Campaign, TestRun
from isolation_sim.identification.sinusoidal import sinusoidal
from isolation_sim.laws import LAWS, Device, Law
from isolation_sim.reports.style import legend, line_styles, new_figure, style

FREQUENCY = 1.0
"""Of the tests drawn, Hz."""

CURRENTS = (0.0, 1.0, 2.0, 3.0)
"""Of the published loops drawn, A."""

EXAMPLE_AMPLITUDES = (2e-3, 4e-3, 8e-3)
"""Of the loops to which laws without published numbers are fitted, m."""


DRAWN_IN_SHORT = "strain_stiffening", "dahl"
"""With published numbers, and without."""


def write_pages(folder: Path, short: bool = False) -> list[str]:
    """Write the pages and their figures.

    Parameters
    ----------
    folder : pathlib.Path
        Where to.
    short : bool, optional
        Whether only two laws' loops are drawn.

    Returns
    -------
    list of str
        Names of the laws, in the registry's order.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, one in LAWS.items():
        caption = _draw(one, folder) if not short or name in DRAWN_IN_SHORT else ""
        (folder / f"{name}.md").write_text(_page(one, caption), encoding="utf-8")
    here = f"/{folder.relative_to(folder.parents[1])}"
    rows = [
        (f"[{one.title}]({here}/{name}.md)", f"`{name}`",
         str(len(one.states)), str(len(one.parameters)),
         ", ".join(f"`{s}`" for s in available_sets(name)) or "none",
         "yes" if one.stored_energy else "no")
        for name, one in LAWS.items()
    ]  # fmt: skip
    headings = ("law", "name", "states", "parameters", "published sets", "stored energy")
    (folder / "table.txt").write_text(table(headings, rows), encoding="utf-8")
    return list(LAWS)


def _page(one: Law, loops: str) -> str:
    module = sys.modules[one.force.__module__]
    return "\n".join([
        f"# {one.title}",
        f"`{one.name}` · source: {written(one.source)}",
        "",
        prose(module.__doc__),
        "## Equations",
        _equations(one),
        "## Loops",
        loops,
        "## Quantities",
        _quantities(one),
        _sets(one),
        _conditions(one),
    ])  # fmt: skip


def _equations(one: Law) -> str:
    parts = [
        "Traced from the functions of the simulation; $x$ is the deformation, $v$ its "
        "velocity. Square brackets around a condition are 1 where it holds and 0 elsewhere.",
        f"Restoring force. {_summary(one.force)}",
        display(equations.equation("F", equations.force(one))),
    ]
    if one.states:
        parts.append(f"Internal states. {_summary(one.rates)}")
        for state, rate in zip(one.state_names, equations.rates(one), strict=True):
            left = rf"\dot{{{equations.symbol_latex(state)}}}"
            parts.append(display(equations.equation(left, rate)))
    energy = equations.stored(one)
    if energy is None:
        parts.append(
            "No stored energy is declared: in the [energy ledger](../../ideas/energy.md) the whole "
            "work of the device counts as dissipated."
        )
    else:
        parts += [
            f"Stored energy. {_summary(one.stored_energy)}",
            display(equations.equation("U", energy)),
        ]
    return "\n\n".join(parts)


def _summary(function: object) -> str:
    return written((function.__doc__ or "").partition("\n")[0])


def _quantities(one: Law) -> str:
    rows = []
    for kind, quantities in (("state", one.states), ("parameter", one.parameters)):
        for q in quantities:
            accepted = "any"
            if np.isfinite(q.lower) and np.isfinite(q.upper):
                accepted = f"{q.lower:g} to {q.upper:g}"
            elif np.isfinite(q.lower):
                accepted = f"above {q.lower:g}" if q.divides else f"{q.lower:g} or more"
            rows.append((
                f"${equations.symbol_latex(q.name)}$", f"`{q.name}`", kind, q.unit, q.meaning,
                accepted if kind == "parameter" else "",
            ))  # fmt: skip
    return table(("symbol", "name", "kind", "unit", "meaning", "accepted"), rows)


def _sets(one: Law) -> str:
    parts = []
    for name in available_sets(one.name):
        device = law(one.name, name)
        currents = _currents(device)
        numbers = np.array([np.broadcast_to(device.parameters_at(i), len(one.parameters))
                            for i in currents]).T  # fmt: skip
        rows = [
            (f"${equations.symbol_latex(q.name)}$", q.unit, *(_number(v) for v in values))
            for q, values in zip(one.parameters, numbers, strict=True)
        ]
        headings = ("parameter", "unit", *(f"{i:g} A" for i in currents))
        if not device.depends_on_current:
            headings = ("parameter", "unit", "value")
        parts += [f"## Published set `{name}`", f"{written(device.source)}.",
                  table(headings, rows)]  # fmt: skip
    return "\n\n".join(parts)


def _conditions(one: Law) -> str:
    """A row for each set of a single loading condition; those for every current stand apart."""
    devices = {name: law(one.name, name) for name in available_conditions(one.name)}
    if not devices:
        return ""
    every = [name for name, device in devices.items() if device.depends_on_current]
    rows = [
        (f"`{name}`", *(_number(p) for p in device.parameters_at(0.0)),
         written(device.source.partition("; ")[2]))
        for name, device in devices.items() if name not in every
    ]  # fmt: skip
    parts = [
        "## Published sets of single loading conditions",
        f"Source: {written(one.source)}. `parameters` of a device takes these names too; "
        "the last column marks corrupt columns of the printed tables.",
        table(("set", *(f"${equations.symbol_latex(q.name)}$ ({q.unit})" for q in one.parameters),
               "remark"), rows),
    ]  # fmt: skip
    if every:
        names = ", ".join(f"`{name}`" for name in every)
        parts.append(f"The same, linearly interpolated over the current: {names}.")
    return "\n\n".join(parts)


def _number(value: float) -> str:
    text = f"{value:.4g}"
    mantissa, _, power = text.partition("e")
    if not power:
        return text
    if 0 < int(power) < 6:
        return str(round(float(text)))
    return rf"${mantissa} \cdot 10^{{{int(power)}}}$"


def _currents(device: Device) -> tuple[float, ...]:
    if not device.depends_on_current:
        return (0.0,)
    low, high = device.current_range
    inside = tuple(i for i in CURRENTS if low <= i <= high)
    return inside if len(inside) > 1 else (low, high)


def _draw(one: Law, folder: Path) -> str:
    """Draw a law's loops, and return the MyST text that shows them."""
    if available_sets(one.name):
        device = law(one.name)
        amplitude = min(device.tested_deformation, EXAMPLE_AMPLITUDES[-1])
        loops = {
            f"{i:g} A" if device.depends_on_current else "": _loop(device, amplitude, i)
            for i in _currents(device)
        }
        caption = (
            f"Published set `{available_sets(one.name)[0]}` at {1e3 * amplitude:g} mm and "
            f"{FREQUENCY:g} Hz, last of six cycles."
        )
    else:
        result = fit(_tests(), one, starts=8)
        loops = {
            each.run.name: tuple(
                values[-_PERIOD:]
                for values in (each.run.displacement, each.run.velocity, each.force)
            )
            for each in result.errors
        }
        caption = (
            "The law has no published numbers. Here it is fitted to loops of the published "
            f"strain-stiffening isolator at 1 A and {FREQUENCY:g} Hz (thick grey): the RMS error "
            f"is {100 * result.error:.0f} % of the RMS force."
        )
    with style():
        picture = new_figure(7.2, 3.0)
        left, right = picture.subplots(1, 2, sharey=True)
        if not available_sets(one.name):
            for run in _tests().runs:
                for panel, across in ((left, run.displacement), (right, run.velocity)):
                    panel.plot(1e3 * across[-_PERIOD:], run.force[-_PERIOD:], "0.7", linewidth=2.5)
        for (label, (x, v, force)), line in zip(
            loops.items(), line_styles(len(loops)), strict=True
        ):
            left.plot(1e3 * x, force, label=label, **line)
            right.plot(1e3 * v, force, **line)
        left.set(xlabel="deformation (mm)", ylabel="force (N)")
        right.set(xlabel="velocity (mm/s)")
        if len(loops) > 1:
            legend(picture, left, "outside upper center")
    write_svg(picture, folder / f"{one.name}.svg")
    return figure(f"{one.name}.svg", caption, f"force-deformation loops of {one.title}")


_POINTS = 256
_PERIOD = _POINTS + 1


def _loop(device: Device, amplitude: float, current: float) -> tuple[np.ndarray, ...]:
    motion = sinusoidal(device, amplitude, current, FREQUENCY, cycles=6, points=_POINTS)
    return motion.last_cycle()


@cache
def _tests() -> Campaign:
    """Loops of the published isolator, as if they were measured."""
    runs = []
    for amplitude in EXAMPLE_AMPLITUDES:
        m = sinusoidal(law("strain_stiffening"), amplitude, 1.0, FREQUENCY, 4, _POINTS)
        runs.append(TestRun(
            f"{1e3 * amplitude:g} mm", m.time, m.displacement, m.velocity, m.force,
            np.ones_like(m.time), velocity_measured=True,
        ))  # fmt: skip
    return Campaign("strain-stiffening isolator at 1 A", "computed", tuple(runs))
