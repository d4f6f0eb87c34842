"""Drawing of an isolated structure: elevation, and plan and 3-D view if positions are known."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..simulation.quantities import level_dofs, storey_rows
from .style import DOUBLE_COLUMN, new_figure, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..structures import IsolatedStructure, Structure

_STOREY = 3.0
"""Storey height in the drawing if the structure has none, m."""
_WIDTH = 10.0
"""Width of the building in the elevation, m; the elevation is not to scale along x."""


def structure_drawing(isolated: IsolatedStructure) -> Figure:
    """Draw a structure with its isolators, moat walls and soil springs."""
    places = isolated.structure.isolator_positions
    with style():
        figure = new_figure(DOUBLE_COLUMN, 3.6 if places is None else 7.0)
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
    levels = level_dofs(structure)[:, 0]
    rows = storey_rows(structure)[:, 0]
    z, tall = _levels(structure)
    half, thick = _WIDTH / 2, 0.08 * tall
    device_names = {element.name: element.device.name for element in isolated.elements}
    for low, high, row in zip(z[:-1], z[1:], rows, strict=False):
        yields = device_names.get(f"{structure.storeys[row]}_hysteresis", "").partition(",")[0]
        color, dash = ("#D55E00", "--") if yields else ("0.2", "-")
        axes.text(half + 1.2, (low + high) / 2, yields, va="center", fontsize=7, color=color)
        for x in (-0.9 * half, 0.9 * half):
            axes.plot([x, x], [low, high], color=color, linestyle=dash, linewidth=1.6)
    for level, dof in zip(z, levels, strict=True):
        axes.fill_between([-half, half], level - thick, level + thick, color="0.45", linewidth=0)
        name = structure.names[dof]
        label = name.removesuffix(f"_{structure.directions[0]}")
        axes.text(half + 1.2, level, f"{label}, {1e-3 * structure.mass[dof, dof]:.4g} t",
                  va="center", fontsize=7)  # fmt: skip
    below = -0.45 * tall
    if structure.base:
        for x in np.linspace(-0.8 * half, 0.8 * half, 4):
            axes.fill_between([x - 0.5, x + 0.5], below, -thick, color="#0072B2", linewidth=0)
        axes.text(half + 1.2, (below - thick) / 2, _isolators(isolated), va="center", fontsize=7)
    wall = next((text for name, text in device_names.items() if name.startswith("moat_wall")), "")
    if wall:
        for sign in (-1, 1):
            edge = sign * (half + 0.35)
            axes.fill_between([edge, edge + sign * 0.25], below, 2.5 * thick, color="0.2")
        axes.text(-half - 0.9, 0.0, "wall: " + wall.replace(", ", ",\n"), va="center", ha="right",
                  fontsize=7)  # fmt: skip
    ground = below
    if structure.foundation:
        ground = below - 0.7 * tall
        axes.fill_between([-1.1 * half, 1.1 * half], below - 2 * thick, below, color="0.45")
        for x in np.linspace(-0.9 * half, 0.9 * half, 5):
            turns = np.linspace(0, 1, 13)
            zigzag = np.where(np.arange(13) % 2, 0.25, -0.25) * (turns > 0.05) * (turns < 0.95)
            axes.plot(x + zigzag, ground + (below - 2 * thick - ground) * turns, color="#009E73",
                      linewidth=0.9)  # fmt: skip
        sway = structure.foundation[0]
        rocks = any(structure.names[d].startswith("rocking") for d in structure.foundation)
        label = f"soil: sway, {1e-6 * structure.stiffness[sway, sway]:.4g} kN/mm"
        axes.text(half + 1.2, (ground + below) / 2, label + "; rocking" * rocks, va="center",
                  fontsize=7)  # fmt: skip
    axes.plot([-1.4 * half, 1.4 * half], [ground, ground], color="0.2", linewidth=1.0)
    axes.fill_between([-1.4 * half, 1.4 * half], ground - 0.2 * tall, ground, hatch="////",
                      facecolor="white", edgecolor="0.6", linewidth=0)  # fmt: skip
    axes.set_xlim(-2.4 * half, 3.0 * half)
    axes.set_title(
        "from the side"
        + "; dashed: storeys that yield" * any("_hysteresis" in n for n in device_names),
        loc="left",
    )
    axes.set_axis_off()


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
    axes.set_title("from above: isolators (blue) and floors", loc="left")
    axes.patch.set_visible(False)


def _isolators(isolated: IsolatedStructure) -> str:
    """Short description of the isolators."""
    laws = []
    for group, law in zip(isolated.groups, isolated.group_laws, strict=True):
        name = isolated.element_names[group[0]]
        if np.any(isolated.holding[group[0]]) and not name.startswith("moat_wall"):
            laws.append(law.name + ", biaxial" * (len(group) > 1))
    return "isolators: " + ", ".join(dict.fromkeys(laws))


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
    axes.set_title("plan; centre of isolators: +, of mass: o", loc="left")


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
