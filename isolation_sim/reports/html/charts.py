"""Parts of charts: lines that differ in grey, axes with units, compact numbers."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..style import Look, line_looks

_WIDTH = 1.5
"""Width of a line, px."""
# plotly's name, and characters for the filled and the open marker
_MARKERS = {
    "": ("circle", "", ""), "o": ("circle", "●", "○"), "s": ("square", "■", "□"),
    "^": ("triangle-up", "▲", "△"), "D": ("diamond", "◆", "◇"), "v": ("triangle-down", "▼", "▽"),
    "P": ("cross", "✚", "✛"), "X": ("x", "✖", "✕"), "*": ("star", "★", "☆"),
}  # fmt: skip
_MARKS_A_LINE = 12


def looks(names: Sequence[str]) -> dict[str, Look]:
    """Assign each name a look; looks differ by more than the colour."""
    return dict(zip(names, line_looks(len(names), markers=True), strict=True))


def dashes(look: Look) -> str:
    """Lengths of dashes and gaps, px; empty for a solid line, all gap without a line."""
    if not look.joined:
        return "0,99"
    return ",".join(f"{_WIDTH * look.width * length:g}px" for length in look.dashes)


def symbol(look: Look) -> str:
    """Marker, as plotly names it."""
    return _MARKERS[look.marker][0] + "-open" * (not look.filled)


def glyph(look: Look) -> str:
    """Marker as a character."""
    return _MARKERS[look.marker][1 if look.filled else 2]


def line(name: str, look: Look, **more: Any) -> dict[str, Any]:
    """Plotly keys of a trace with this look; the reader shows and hides it by its name."""
    modes = ["lines"] * look.joined + ["markers"] * bool(look.marker)
    keys: dict[str, Any] = {"type": "scatter", "mode": "+".join(modes), "name": name, "meta": name}
    if look.joined:
        width = round(_WIDTH * look.width, 2)
        keys["line"] = {"color": look.colour, "dash": dashes(look) or "solid", "width": width}
        keys["line"] |= more
    if look.marker:
        most = {"maxdisplayed": _MARKS_A_LINE} if look.joined else {"color": look.colour}
        keys["marker"] = {"symbol": symbol(look), "size": 6 if look.joined else 7, **most}
    return keys


def base64_floats(values: ArrayLike) -> str:
    """Numbers in single precision as base64."""
    return base64.b64encode(np.asarray(values, dtype="<f4").tobytes()).decode("ascii")


def numbers(values: ArrayLike) -> dict[str, str]:
    """Numbers in the binary form of plotly.js."""
    return {"dtype": "f4", "bdata": base64_floats(values)}


def over(x: NDArray, y: NDArray) -> dict[str, Any]:
    """Abscissa and ordinate of a trace; an evenly spaced abscissa is stored as start and step."""
    steps = np.diff(x)
    if len(steps) and np.ptp(steps) < 1e-6 * abs(steps[0]):
        return {"x0": float(x[0]), "dx": float(steps.mean()), "y": numbers(y)}
    return {"x": numbers(x), "y": numbers(y)}


def choose_samples(most: int, *series: NDArray) -> NDArray:
    """Choose samples to draw so that no peak is lost."""
    n = len(series[0])
    if n <= most:
        return np.arange(n)
    size = -(-n * 2 * len(series) // max(most, 4))
    starts = np.arange(0, n, size)
    keep = [np.array([0, n - 1])]
    for values in series:
        # the last piece is padded with its last value
        pieces = np.pad(values, (0, len(starts) * size - n), mode="edge").reshape(-1, size)
        keep += [starts + pieces.argmin(axis=1), starts + pieces.argmax(axis=1)]
    return np.unique(np.minimum(np.concatenate(keep), n - 1))


def layout(x_title: str, y_title: str, **more: Any) -> dict[str, Any]:
    """Layout of a chart with one pair of axes."""
    axis = {"gridcolor": "#e4e4e4", "linecolor": "#777", "showline": True, "zeroline": False}
    result: dict[str, Any] = {
        "xaxis": {"title": {"text": x_title, "standoff": 6}, **axis},
        "yaxis": {"title": {"text": y_title, "standoff": 8}, **axis},
        "margin": {"l": 64, "r": 14, "t": 24, "b": 44},
        "font": {"size": 12, "color": "#1b1b1b", "family": "system-ui, DejaVu Sans, sans-serif"},
        "showlegend": False,
        "dragmode": "zoom",
        "autosize": True,
    }
    for key, value in more.items():
        result[key] = {**result[key], **value} if isinstance(result.get(key), dict) else value
    return result


def span(values: Iterable[ArrayLike], margin: float = 0.05) -> list[float]:
    """Interval that contains all values, for axes with equal limits."""
    arrays = [np.asarray(each) for each in values]
    low = min(float(np.nanmin(each)) for each in arrays)
    high = max(float(np.nanmax(each)) for each in arrays)
    room = margin * (high - low) if high > low else 1.0
    return [low - room, high + room]


def peaks(values: Mapping[str, ArrayLike], unit: str) -> str:
    """Largest absolute value of each line, as a sentence."""
    peaks = [
        f"{name} {np.max(np.abs(np.asarray(each)), initial=0.0):.3g} {unit}"
        for name, each in values.items()
    ]
    return f"Largest absolute values: {', '.join(peaks)}."
