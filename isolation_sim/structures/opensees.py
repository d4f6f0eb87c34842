"""Import of the linear model of an OpenSeesPy session."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ground_motions.argument_types import checked

from ..errors import InputError
from .matrices import from_matrices
from .structure import Structure

# axes of a node's degrees of freedom, by the model's dimensions and dofs per node
_AXES = {
    (1, 1): "x", (2, 2): "xy", (2, 3): ("x", "y", "rz"), (3, 3): "xyz",
    (3, 6): ("x", "y", "z", "rx", "ry", "rz"),
}  # fmt: skip
MASSLESS = 1e-9
"""Largest mass of a massless degree of freedom, as a share of the model's largest mass."""


@checked
def from_opensees(
    base: int,
    floors: Sequence[int] | None = None,
    directions: str = "x",
    isolators: Sequence[int] | None = None,
    opensees: Any = None,
    name: str = "OpenSees model",
) -> Structure:
    """Structure from the OpenSeesPy model in this process.

    OpenSees assembles mass, tangent stiffness and damping of the model in its present state.
    Degrees of freedom without mass, such as rotations of joints, are condensed statically. The base
    above the isolators is one node, to which other nodes may be tied. It must be free: only the
    superstructure may be connected to it.

    Parameters
    ----------
    base : int
        Tag of the base's node.
    floors : sequence of int, optional
        Tags of one node per floor, upwards, for drifts, storey heights and floor accelerations;
        without them the structure has no storeys, and all nodes with mass count as floors.
    directions : str, default "x"
        Directions of ground motion and isolation, such as ``"x"`` or ``"xy"``. With two directions
        a base that can rotate about the vertical z is also isolated in rotation.
    isolators : sequence of int, optional
        Tags of the nodes above the isolators; their coordinates are the isolators' positions.
        For a base that can rotate.
    opensees : module, optional
        ``openseespy.opensees`` by default.
    name : str, default "OpenSees model"
        Name to print.

    Returns
    -------
    Structure
        Its dofs have the names ``node<tag>_<axis>``.

    Raises
    ------
    InputError
        If OpenSeesPy is missing, or the model has no such node or is not free at the base.

    Notes
    -----
    The function replaces the session's analysis by one with the integrator GimmeMCK and wipes it;
    nodes, elements, masses and the model's state do not change. M. H. Scott, "Gimme All Your
    Damping, All Your Mass and Stiffness Too", Portwood Digital 2020.
    """
    ops = _module() if opensees is None else opensees
    tags = list(ops.getNodeTags())
    for tag in [base, *(floors or ()), *(isolators or ())]:
        if tag not in tags:
            known = ", ".join(map(str, tags[:10])) or "none"
            raise InputError(f"the OpenSees model has no node {tag}; expected: {known}")
    (mass, damping, stiffness), equations = _assemble(ops, tags)
    axes = _AXES.get((len(ops.nodeCoord(base)), len(equations[base])))
    if axes is None or not set(directions) <= set(axes):
        raise InputError("directions", f"{directions!r}", "axes of the model's nodes")
    place: dict[tuple[int, str], int] = {}
    labels: dict[int, str] = {}
    tied = set(ops.getConstrainedNodes())  # they have the equations of another node
    for tag in [tag for tag in tags if tag not in tied]:
        for axis, equation in zip(axes, equations[tag], strict=True):
            if equation >= 0:
                place[tag, axis] = equation
                labels[equation] = f"node{tag}_{axis}"
    turns = len(directions) == 2 and (base, "rz") in place and isolators is not None
    moving = [*directions, *(["rz"] if turns else [])]
    for axis in moving:
        if (base, axis) not in place:
            raise InputError(
                f"node {base} is fixed or tied along {axis}; expected: a base that is free"
            )
    n = len(mass)
    influence = np.zeros((n, len(directions)))
    for (_, axis), equation in place.items():
        if axis in directions:
            influence[equation, directions.index(axis)] = 1.0
    heavy = np.diag(mass) > MASSLESS * np.diag(mass).max(initial=0.0)
    for axis in moving:
        if not heavy[place[base, axis]]:
            raise InputError(f"node {base} has no mass along {axis}; expected: a base with mass")
    if not set(np.flatnonzero(heavy)) <= set(labels):
        raise InputError(
            "a tied node has a mass with a free degree of freedom; expected: ties of all "
            "its degrees of freedom with mass"
        )
    condensed = _condensation(stiffness, heavy)
    numbers = {equation: k for k, equation in enumerate(np.flatnonzero(heavy).tolist())}
    storeys, rows, heights = _storeys(ops, [base, *(floors or ())], directions, place, n)
    centre = np.array(ops.nodeCoord(base)[:2])
    return from_matrices(
        condensed.T @ mass @ condensed,
        condensed.T @ damping @ condensed,
        condensed.T @ stiffness @ condensed,
        influence=influence[heavy],
        base=[numbers[place[base, axis]] for axis in moving],
        names=[labels[equation] for equation in numbers],
        drift_rows=np.reshape([row @ condensed for row in rows], (-1, len(numbers))),
        storeys=storeys,
        directions=list(directions),
        heights=heights if heights and min(heights) > 0 else None,
        isolator_positions=(
            [np.array(ops.nodeCoord(tag)[:2]) - centre for tag in isolators or ()]
            if turns else None
        ),
        name=name,
    )  # fmt: skip


def _storeys(
    ops: Any,
    levels: Sequence[int],
    directions: str,
    place: Mapping[tuple[int, str], int],
    n: int,
) -> tuple[list[str], list[np.ndarray], list[float]]:
    """Names, drift rows over the n equations, and heights of the storeys between nodes."""
    up = len(ops.nodeCoord(levels[0])) - 1  # y of a plane, z of space
    names, rows, heights = [], [], []
    for storey, (below, above) in enumerate(pairwise(levels), start=1):
        for axis in directions:
            row = np.zeros(n)
            for tag, sign in ((above, 1.0), (below, -1.0)):
                if (tag, axis) not in place:
                    raise InputError(
                        f"node {tag} is fixed or tied along {axis}; expected: a free floor"
                    )
                row[place[tag, axis]] += sign
            rows.append(row)
            names.append(f"storey{storey}_{axis}" if len(directions) > 1 else f"storey{storey}")
            heights.append(ops.nodeCoord(above)[up] - ops.nodeCoord(below)[up])
    return names, rows, heights


def _module() -> Any:
    """Check that OpenSeesPy can be loaded; its error is one line."""
    if "openseespy.opensees" not in sys.modules:
        try:
            import openseespy.opensees  # noqa: F401
        except (ImportError, RuntimeError) as error:
            raise InputError(
                f"OpenSeesPy cannot be loaded ({error}); expected: pip install "
                "'isolation-sim[opensees]', or the module as argument opensees"
            ) from None
    return sys.modules["openseespy.opensees"]


def _assemble(ops: Any, tags: Sequence[int]) -> tuple[list[np.ndarray], dict[int, list[int]]]:
    """Mass, damping and stiffness of the session's equations, and each node's equations."""
    ops.wipeAnalysis()
    ops.constraints("Transformation")
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.test("NormUnbalance", 1.0, 1)
    ops.algorithm("Linear")
    sums = []
    # with stiffness and mass in each, so that the solution exists
    for weights in ((1.0, 0.0, 1.0), (2.0, 0.0, 1.0), (1.0, 1.0, 1.0)):
        ops.integrator("GimmeMCK", *weights)
        ops.analysis("Transient", "-noWarnings")
        ops.analyze(1, 0.0)
        n = ops.systemSize()
        if n == 0:
            raise InputError("the OpenSees model has no free degree of freedom; expected: some")
        sums.append(np.array(ops.printA("-ret")).reshape(n, n))
    equations = {tag: list(ops.nodeDOFs(tag)) for tag in tags}
    ops.wipeAnalysis()
    both, more_mass, more_damping = sums
    rounding = 4 * np.finfo(float).eps * np.abs(more_mass)
    mass, damping = (
        np.where(np.abs(more - both) > rounding, more - both, 0.0)
        for more in (more_mass, more_damping)
    )
    return [(matrix + matrix.T) / 2 for matrix in (mass, damping, both - mass)], equations


def _condensation(stiffness: np.ndarray, heavy: np.ndarray) -> np.ndarray:
    """All displacements from the dofs with mass, (n, n_heavy), by exact static condensation."""
    transformation = np.zeros((len(heavy), int(heavy.sum())))
    transformation[heavy] = np.eye(int(heavy.sum()))
    if not heavy.all():
        inner, outer = stiffness[np.ix_(~heavy, ~heavy)], stiffness[np.ix_(~heavy, heavy)]
        try:
            transformation[~heavy] = -np.linalg.solve(inner, outer)
        except np.linalg.LinAlgError:
            raise InputError(
                "the OpenSees model has a degree of freedom with neither mass nor stiffness"
            ) from None
    return transformation
