"""Sphinx extension: writes what is generated before the pages are read.

Law pages, tables, figures and the API's pages go to ``docs/generated``, which is made anew by every
build and is not kept under version control. With ``sphinx-build -t short`` the tables of studies
have fewer cases, figures are computed but only two laws' are drawn, the report has two controllers,
and the pages cannot be searched.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import api_pages
import catalogues
import comparison
import figures
import gallery
import law_pages

import isolation_sim as iso
from isolation_sim.scenario import main_job


def write(app: Any) -> None:
    """Write everything that is generated.

    Parameters
    ----------
    app : sphinx.application.Sphinx
        The build.
    """
    folder = Path(app.srcdir) / "generated"
    shutil.rmtree(folder, ignore_errors=True)
    short = app.tags.has("short")
    # the index of all words takes a twentieth of the build
    app.builder.search = not short
    figures.write_figures(folder / "figures", short)
    catalogues.write_tables(folder, short)
    comparison.write_tables(folder)
    gallery.write_gallery(folder, short)
    scenario = main_job()
    if short:
        scenario = scenario.model_copy(update={"controller": scenario.controller[:2]})
    iso.run_scenario(scenario).to_html(folder / "report.html")
    # the table of laws links to them already
    _index(folder / "laws", law_pages.write_pages(folder / "laws", short), ":hidden:")
    _index(folder / "api", api_pages.write_pages(folder / "api"), ":maxdepth: 1")


def _index(folder: Path, pages: list[str], option: str) -> None:
    """List pages, for a table of contents that includes the file."""
    listed = "\n".join(f"/generated/{folder.name}/{page}" for page in pages)
    (folder / "contents.txt").write_text(
        f":::{{toctree}}\n{option}\n\n{listed}\n:::\n", encoding="utf-8"
    )


def setup(app: Any) -> dict[str, bool]:
    """Connect to the build.

    Parameters
    ----------
    app : sphinx.application.Sphinx
        The build.

    Returns
    -------
    dict of str to bool
        That pages may be read and written in parallel.
    """
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
