"""Settings of the documentation: ``sphinx-build -W --keep-going -b html docs docs/_build``.

With ``-t short`` no tutorial is run, and the theme is plain.
"""

import os
import sys
from importlib.util import find_spec
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]
# notebooks and pages type isolation-sim as a reader does
os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
# and see figures where they draw them
os.environ.pop("MPLBACKEND", None)

from isolation_sim import __version__  # noqa: E402

project = "isolation-sim"
author = "The isolation-sim developers"
project_copyright = author
version = release = __version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "numpydoc",
    "myst_nb",
    "pages",
]
exclude_patterns = ["_build", "_ext", "examples", "**/*.txt"]
nitpicky = True
language = "en"
# types of attributes that a user never makes
nitpick_ignore = [
    ("py:class", "controllers.device_model.DeviceModel"),
    ("py:class", "controllers.observers.tangent.TangentModel"),
]

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
short = tags.has("short")  # type: ignore[name-defined]  # noqa: F821
# tests/test_docs.py runs each tutorial on request
nb_execution_mode = "off" if short else "force"
nb_execution_in_temp = True
nb_execution_timeout = 240
nb_execution_raise_on_error = True
nb_output_stderr = "remove"

autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

# MathJax 3 as one file beside the pages: equations need no network
_mathjax = find_spec("sphinx-mathjax-offline")
assert _mathjax is not None and _mathjax.submodule_search_locations, "pip install '.[docs]'"
html_static_path = [
    "_static",
    f"{_mathjax.submodule_search_locations[0]}/static/mathjax/tex-svg.js",
]
mathjax_path = "tex-svg.js"

# to make its navigation anew for each page takes Furo a third of the short build
html_theme = "basic" if short else "furo"
html_title = f"isolation-sim {version}"
html_css_files = ["wide.css"]
html_show_sourcelink = False
html_copy_source = False
