"""Data of the animation of a building on its isolators; ``animation.js`` draws it."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...criteria import columns
from ...simulation.outputs import level_dofs
from .page import Animation

if TYPE_CHECKING:
    from ...simulation.result import Run

_FRAMES_A_SECOND = 25
_MOST_NUMBERS = 40_000
_MOST_LEVELS = 30
_STEPS = 32767
# share of the drawing's width, to either side
_SWAY, _LEAN = 0.2, 0.06


def animation(runs: Mapping[str, Run], left: str, right: str) -> Animation:
    """Two buildings side by side that the reader can play."""
    first = next(iter(runs.values()))
    structure = first.isolated.structure
    dofs = level_dofs(structure)[:, 0]
    indices = np.unique(np.linspace(0, len(dofs) - 1, min(len(dofs), _MOST_LEVELS)).astype(int))
    levels = [structure.names[dof] for dof in dofs[indices]]
    time = first.time
    frames = max(int(_FRAMES_A_SECOND * (time[-1] - time[0])), 2)
    frames = min(frames, max(_MOST_NUMBERS // (len(runs) * (len(levels) + 1)), 2), len(time))
    instants = np.linspace(time[0], time[-1], frames)

    def at_frames(values: NDArray) -> NDArray:
        seen = [np.interp(instants, time, column) for column in values.T]
        return np.reshape(seen, (-1, frames))

    shown, sway, lean, largest, largest_at = {}, 0.0, 0.0, 0.0, 0
    for name, run in runs.items():
        displacement = at_frames(1e3 * columns(run, levels, "displacement_m"))
        current = at_frames(run.current[:, :1])
        sway = max(sway, float(np.abs(displacement[0]).max()))
        lean = max(lean, float(np.abs(displacement - displacement[0]).max()))
        largest = max(largest, float(current.max(initial=0.0)))
        if name == left:
            largest_at = int(np.abs(displacement[0]).argmax())
        shown[name] = {"displacement_mm": _packed(displacement)}
        if current.size:
            shown[name]["current_A"] = _packed(current)
    ground = np.interp(instants, time, first.records[0].acceleration)
    return Animation(
        {
            "runs": shown, "left": left, "right": right, "frames": frames,
            "start_s": float(time[0]), "step_s": float(instants[1] - instants[0]),
            "levels": len(levels), "isolated": bool(structure.base),
            "largest_A": largest, "largest_at": largest_at,
            "ground_m_s2": _packed(ground[np.newaxis]),
            # shares of the drawing's width for 1 mm
            "sway": _SWAY / sway if sway else 0.0, "lean": _LEAN / lean if lean else 0.0,
            "note": _note(len(levels) < len(dofs)),
        }
    )  # fmt: skip


def _note(some: bool) -> str:
    left_out = " Some floors are left out." if some else ""
    return (
        "Motion relative to the ground, above the ground acceleration. The base displacement and "
        "the drift of the building have different scales, which are equal in both drawings. A "
        f"darker isolator has a larger current.{left_out} Press Play to start; the slider and the "
        "arrow keys set the time."
    )


def _packed(rows: NDArray) -> dict[str, Any]:
    """Numbers as 16-bit integers in base64, with the value of the integer 1."""
    peak = float(np.abs(rows).max(initial=0.0)) or 1.0
    data = np.round(rows / peak * _STEPS).astype("<i2").tobytes()
    return {"unit": peak / _STEPS, "data": base64.b64encode(data).decode("ascii")}
