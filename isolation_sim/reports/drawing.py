"""Drawing of an isolated structure: elevation, and plan and 3-D view if positions are known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..simulation.outputs import level_dofs, storey_rows
from ..structures.element import isolation_elements, moat_walls
from .style import DOUBLE_COLUMN, new_figure, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..structures import IsolatedStructure, Structure

_STOREY = 3.0
"""Storey height in the drawing if the structure has none, m."""
_COIL, _NO_COIL = "#0072B2", "#A66300"
"""Colours of isolators with and without a coil."""
_LINE = 0.29
"""Height of a line of text, over that of a storey."""
_HALF = 5.0
"""Half width of the building in the elevation, m; the elevation is not to scale along x."""
_SLAB = 0.08
"""Half thickness of a floor, over the height of a storey."""


def structure_drawing(isolated: IsolatedStructure) -> Figure:
    """Draw a structure with its isolators, moat walls and soil springs."""
    places = isolated.structure.isolator_positions
    with style():
        figure = new_figure(DOUBLE_COLUMN, 3.6 if places is None else 7.4)
        if places is None:
            side = figure.subplots(1, 1)
        else:
            side, above = figure.add_subplot(2, 2, 1), figure.add_subplot(2, 2, 2)
            _from_above(above, isolated)
            _in_space(figure.add_subplot(2, 1, 2, projection="3d"), isolated.structure)
        _from_the_side(side, isolated)
    return figure


def _from_the_side(axes: Axes, isolated: IsolatedStructure) -> None:
    structure = isolated.structure
    z, tall = _levels(structure)
    thick = _SLAB * tall
    devices = {element.name: element.device.name for element in isolated.elements}
    _draw_storeys(axes, structure, devices)
    below = lowest = ground = -0.45 * tall
    if structure.base:
        lowest = _draw_isolators(axes, isolated, below, tall)
    wall = next((text for name, text in devices.items() if name.startswith("moat_wall")), "")
    if wall:
        for sign in (-1, 1):
            edge = sign * (_HALF + 0.35)
            axes.fill_between([edge, edge + sign * 0.25], below, 2.5 * thick, color="0.2")
        axes.text(-_HALF - 0.9, 0.0, "wall: " + wall.replace(", ", ",\n"), va="center", ha="right",
                  fontsize=7)  # fmt: skip
    if structure.foundation:
        ground = below - 0.7 * tall
        lowest = _draw_soil(axes, structure, below, ground, lowest, tall)
    axes.plot([-1.2 * _HALF, 1.2 * _HALF], [ground, ground], color="0.2", linewidth=1.0)
    axes.fill_between([-1.2 * _HALF, 1.2 * _HALF], ground - 0.2 * tall, ground, hatch="////",
                      facecolor="white", edgecolor="0.6", linewidth=0)  # fmt: skip
    axes.set_xlim(-2.4 * _HALF, 3.0 * _HALF)
    axes.set_ylim(min(lowest, ground - 0.2 * tall), z[-1] + 2 * thick)
    axes.set_title(
        "from the side" + "; dashed: storeys that yield" * any("_hysteresis" in n for n in devices),
        loc="left",
    )
    axes.set_axis_off()


def _draw_storeys(axes: Axes, structure: Structure, devices: Mapping[str, str]) -> None:
    """Draw columns, dashed where a storey yields, and floors with their masses."""
    z, tall = _levels(structure)
    thick = _SLAB * tall
    for low, high, row in zip(z[:-1], z[1:], storey_rows(structure)[:, 0], strict=False):
        yields = devices.get(f"{structure.storeys[row]}_hysteresis", "").partition(",")[0]
        color, dash = ("#D55E00", "--") if yields else ("0.2", "-")
        axes.text(_HALF + 1.2, (low + high) / 2, yields, va="center", fontsize=7, color=color)
        for x in (-0.9 * _HALF, 0.9 * _HALF):
            axes.plot([x, x], [low, high], color=color, linestyle=dash, linewidth=1.6)
    for level, dof in zip(z, level_dofs(structure)[:, 0], strict=True):
        axes.fill_between([-_HALF, _HALF], level - thick, level + thick, color="0.45", linewidth=0)
        label = structure.names[dof].removesuffix(f"_{structure.directions[0]}")
        axes.text(_HALF + 1.2, level, f"{label}, {1e-3 * structure.mass[dof, dof]:.4g} t",
                  va="center", fontsize=7)  # fmt: skip


def _draw_isolators(axes: Axes, isolated: IsolatedStructure, below: float, tall: float) -> float:
    """Draw isolators with the names of their kinds; return the lowest end of the text."""
    kinds = _isolators(isolated)
    colours = [_COIL if driven else _NO_COIL for driven in kinds.values()] or [_COIL]
    for k, x in enumerate(np.linspace(-0.8 * _HALF, 0.8 * _HALF, max(4, len(kinds)))):
        colour = colours[k % len(colours)]
        axes.fill_between([x - 0.5, x + 0.5], below, -_SLAB * tall, color=colour, linewidth=0)
    top = -2.2 * _SLAB * tall
    for text, colour in zip(kinds, colours, strict=False):
        axes.text(_HALF + 1.2, top, text, va="top", fontsize=7, color=colour)
        top -= _LINE * tall * (1 + text.count("\n"))
    return top


def _draw_soil(
    axes: Axes, structure: Structure, below: float, ground: float, lowest: float, tall: float
) -> float:
    """Draw the foundation on springs and write their stiffness; return the text's lower end."""
    foundation = below - 2 * _SLAB * tall
    axes.fill_between([-1.1 * _HALF, 1.1 * _HALF], foundation, below, color="0.45")
    for x in np.linspace(-0.9 * _HALF, 0.9 * _HALF, 5):
        turns = np.linspace(0, 1, 13)
        zigzag = np.where(np.arange(13) % 2, 0.25, -0.25) * (turns > 0.05) * (turns < 0.95)
        axes.plot(x + zigzag, ground + (foundation - ground) * turns, color="#009E73",
                  linewidth=0.9)  # fmt: skip
    sway = structure.foundation[0]
    rocks = any(structure.names[d].startswith("rocking") for d in structure.foundation)
    label = f"soil: sway, {1e-6 * structure.stiffness[sway, sway]:.5g} kN/mm"
    axes.text(_HALF + 1.2, lowest, label + "; rocking" * rocks, va="top", fontsize=7)
    return lowest - _LINE * tall


def _levels(structure: Structure) -> tuple[np.ndarray, float]:
    """Height of every level above the base and mean storey height, m."""
    rows = storey_rows(structure)[:, 0]
    heights = np.full(len(rows), _STOREY)
    if structure.heights is not None:
        heights = structure.heights[rows]
    z = np.concatenate([[0.0], np.cumsum(heights)])[: len(level_dofs(structure))]
    return z, float(heights.mean()) if len(heights) else _STOREY


def _in_space(axes: Any, structure: Structure) -> None:
    """Draw floors and isolators, seen from above."""
    places = structure.isolator_positions
    assert places is not None
    low, high = places.min(axis=0), places.max(axis=0)
    corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    z, tall = _levels(structure)
    x_floor, y_floor = np.meshgrid([low[0], high[0]], [low[1], high[1]])
    for level in z:
        axes.plot_surface(x_floor, y_floor, np.full((2, 2), level), color="0.6", edgecolor="0.3",
                          alpha=0.25, linewidth=0.8)  # fmt: skip
    for x, y in corners:
        axes.plot([x, x], [y, y], [z[0], z[-1]], color="0.2", linewidth=1.2)
    for x, y in places:
        axes.plot([x, x], [y, y], [-0.45 * tall, 0.0], color="#0072B2", linewidth=4.0)
    axes.set_box_aspect((*(high - low + 1.0), z[-1] + tall))
    axes.view_init(elev=38.0, azim=-60.0)
    axes.set(xlabel="x (m)", ylabel="y (m)", zlabel="height over the base (m)")
    axes.set_title("isolators and floors in space", loc="left", x=-0.35, y=0.85)
    axes.patch.set_visible(False)


def drawing_title(isolated: IsolatedStructure) -> str:
    """Contents of the drawing, in words."""
    parts = ["storeys", *["isolators"] * bool(isolated.structure.base)]
    parts += ["moat wall"] * bool(moat_walls(isolated))
    parts += ["soil springs"] * bool(isolated.structure.foundation)
    *most, last = parts
    return f"The structure: {', '.join(most)} and {last}" if most else f"The structure: {last}"


def _isolators(isolated: IsolatedStructure) -> dict[str, bool]:
    """Short description of each kind of isolator, and whether it has a coil."""
    layer, kinds = isolation_elements(isolated), dict[tuple[str, bool], list[str]]()
    devices = zip(isolated.device_names, isolated.groups, isolated.group_laws, strict=True)
    for name, (e, *others), law in devices:
        if e in layer:
            driven = isolated.elements[e].channel is not None
            kind = law.name + ", biaxial" * bool(others), driven
            kinds.setdefault(kind, []).append(name)
    result = {}
    for (kind_of_law, driven), names in kinds.items():
        several = f"{names[0]} to {names[-1]} ({len(names)})"
        who = several if len(names) > 2 else " and ".join(names)
        result[f"{who}:\n{kind_of_law}{', with coil' * driven}"] = driven
    return result


def _from_above(axes: Axes, isolated: IsolatedStructure) -> None:
    structure = isolated.structure
    places = structure.isolator_positions
    assert places is not None
    low, high = places.min(axis=0), places.max(axis=0)
    outline = np.array([low, [high[0], low[1]], high, [low[0], high[1]], low])
    axes.plot(*outline.T, color="0.45", linewidth=1.0)
    axes.plot(*places.T, "s", color="#0072B2", markersize=6)
    stiff = places.mean(axis=0)
    axes.plot(*stiff, "+", color="black", markersize=9)
    axes.plot(*_centre_of_mass(structure), "o", color="#D55E00", markersize=5)
    axes.set_aspect("equal")
    axes.margins(0.15)
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.set_title("plan; centre of\nisolators: +, of mass: o", loc="left")


def _centre_of_mass(structure: Structure) -> tuple[float, float]:
    """Centre of the total mass from the momentum of a slow rotation of all floors."""
    _, _, rotation = structure.plan_dofs()
    turning = np.zeros(structure.n_dofs)
    turning[rotation] = 1.0
    # floors rotate with the base in a rotation without elastic forces
    inner = list(structure.superstructure)
    if inner:
        block = structure.stiffness[np.ix_(inner, inner)]
        turning[inner] = -np.linalg.solve(block, structure.stiffness[inner, rotation])
    inertia = structure.above_foundation.T @ structure.mass
    momentum, mass = inertia @ turning, inertia @ structure.above_foundation
    return momentum[1] / mass[1, 1], -momentum[0] / mass[0, 0]
