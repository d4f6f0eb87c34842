"""The gallery: runs each program of ``examples/gallery``, and shows its figure with its lines."""

from __future__ import annotations

import ast
import os
import tempfile
from contextlib import chdir
from pathlib import Path
from typing import TYPE_CHECKING

from figures import write_svg
from markdown import figure

from isolation_sim.reports.style import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PROGRAMS = Path(__file__).parents[1] / "examples" / "gallery"
ORDER = (
    "histories", "loops", "currents", "envelopes", "energy", "one_run", "trade_off", "sweep_map",
    "periods", "fit", "spectra",
)  # fmt: skip
"""The programs, in the order of the page."""


def write_gallery(folder: Path, short: bool = False) -> None:
    """Run the programs, and write their figures and the page's text.

    Parameters
    ----------
    folder : pathlib.Path
        Where to.
    short : bool, optional
        Whether the programs run, but their figures are not drawn.
    """
    parts = []
    for name in ORDER:
        write_svg(draw(name), folder / "gallery" / f"{name}.svg", empty=short)
        parts.append(text_of(name))
    (folder / "gallery.txt").write_text("\n".join(parts), encoding="utf-8")


def draw(name: str) -> Figure:
    """Run a program in an empty folder.

    Parameters
    ----------
    name : str
        Of the program.

    Returns
    -------
    matplotlib.figure.Figure
        What it leaves as ``figure``.
    """
    import matplotlib.pyplot as plt

    source = PROGRAMS / f"{name}.py"
    names = {"__name__": name}
    code = compile(source.read_text(encoding="utf-8"), os.fspath(source), "exec")
    with tempfile.TemporaryDirectory() as empty, chdir(empty), style():
        exec(code, names)
    made: Figure = names["figure"]  # type: ignore[assignment]
    plt.close("all")
    return made


def text_of(name: str) -> str:
    """Heading, figure, caption and lines of a program.

    Parameters
    ----------
    name : str
        Of the program.

    Returns
    -------
    str
        MyST text.
    """
    source = (PROGRAMS / f"{name}.py").read_text(encoding="utf-8")
    said = ast.get_docstring(ast.parse(source)) or ""
    title, _, caption = said.partition(".\n\n")
    lines = source.split('"""\n', 2)[-1].strip()
    shown = figure(f"generated/gallery/{name}.svg", " ".join(caption.split()), title)
    return f"## {title}\n\n{shown}\n```python\n{lines}\n```\n"
