"""Assemble, cache and load the compiled kernel of a structure's elements."""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

import numpy as np

from ..laws import emit
from ..laws.fingerprint import fingerprint
from ..laws.law import Law
from . import element_code
from .element_code import COMMON, NODES, ElementCode

TEMPLATES = tuple(
    Path(__file__).with_name(f"kernel_{part}_template.py")
    for part in ("tables", "step", "control", "march", "summary")
)
# element functions: name, arguments between base and mask, the argument that points into lanes
DISPATCHED = (
    ("prepare_held", "", ""),
    ("prepare_moving", "", ""),
    ("relax", "h", ""),
    ("sweep", "h, table, at", "at"),
    ("finish", "h, table, at", "at"),
    ("inside", "tau, states, at", "at"),
    ("accept", "states, at", "at"),
    ("restart", "", ""),
    ("probe", "", ""),
)
# whatever decides on the text besides the laws
_SOURCES = (
    *TEMPLATES, Path(__file__), Path(element_code.__file__), Path(emit.__file__),
    Path(__file__).with_name("vector.py"), Path(__file__).with_name("foreign_call.py"),
)
_used: set[str] = set()
_loaded: dict[tuple, ModuleType] = {}


def cache_folder() -> Path:
    """Folder of the generated modules: ISOLATION_SIM_CACHE, else the user's cache folder."""
    given = os.environ.get("ISOLATION_SIM_CACHE")
    if given:
        return Path(given)
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "isolation_sim"


def _dispatch(name: str, extra: str, lane_offset: str, n_laws: int, lanes: int) -> str:
    """Text that calls an element's function for each lane of a mask, whatever its law."""
    arguments = [f"{a} + lane" if a == lane_offset else a for a in extra.split(", ") if a]
    lines = ["@by_lanes", f"def {name}(e, w, base{', ' + extra if extra else ''}, mask):"]
    for tag in range(n_laws):
        call = ", ".join(["w", "base + lane", *arguments])
        lines.append(f"    {'if' if tag == 0 else 'elif'} KIND[e] == {tag}:")
        if lanes == 1:
            lines += ["        lane = 0", "        if mask[0]:"]
            lines.append(f"            {name}_{tag}({call}, True)")
        else:
            lines.append("        for lane in range(LANES):")
            lines.append(f"            {name}_{tag}({call}, mask[lane] != 0)")
    return "\n".join(lines) + "\n"


def kernel_text(laws: Sequence[Law], n_ground: int, lanes: int) -> str:
    """Source of the kernel for elements of these laws, in this order, in so many lanes."""
    distinct = list(dict.fromkeys(laws))
    codes = [ElementCode(law, tag, len(laws) == 1) for tag, law in enumerate(distinct)]
    n_states = max(len(c.states) for c in codes)
    stride = max(len(c.slots) for c in codes) + 4 * n_states
    monomials = np.vander(NODES, increasing=True)
    constants = {
        "LANES": lanes,
        "N_ELEMENTS": len(laws),
        "N_GROUND": n_ground,
        "N_STATES": n_states,
        "KIND": tuple(distinct.index(law) for law in laws),
        "STRIDE": stride,
        "N_PARAMETERS": tuple(len(c.parameters) for c in codes),
        "SLOT_PARAMETER": tuple(c.slots.index("p0_0") if c.parameters else 0 for c in codes),
        "SLOT_START": tuple(c.slots.index("start0") if c.states else 0 for c in codes),
        "SLOT_SCALE": tuple(c.slots.index("scale0") if c.states else 0 for c in codes),
        "FORCE_SLOTS": tuple(
            e * stride + COMMON.index("f0") + k for e in range(len(laws)) for k in range(3)
        ),
        "PAD": padding(lanes),
        "NODES_AND_END": (*NODES, 1.0),
        "LAGRANGE": tuple(map(tuple, np.linalg.inv(monomials).T.tolist())),
        "TINY": 1e-300,
        "HOPELESS": 1e12,
        **{f"SLOT_{name.upper()}": k for k, name in enumerate(COMMON)},
    }
    blocks = [
        '"""Written by isolation_sim.simulation.kernel; do not edit."""',
        "import math\n\nimport numpy as np\nfrom numba import njit\n\n"
        "from isolation_sim.simulation.foreign_call import call\n"
        "from isolation_sim.simulation import vector\n\n"
        "unsigned = np.uint64",
        "\n".join(f"{name} = {value!r}" for name, value in constants.items()),
        'OPTIONS = {"fastmath": {"contract", "nsz"}, "error_model": "numpy", "_nrt": False}\n'
        "inline = njit(forceinline=True, **OPTIONS)\n"
        # loops over lanes become vector instructions in functions of their own
        f"by_lanes = {'inline' if lanes == 1 else 'njit(**OPTIONS)'}",
        *(c.text() for c in codes),
        "add_rows = vector.make_add_rows(LANES)\n"
        "free_rows = vector.make_free_rows(LANES, N_GROUND)\n"
        "move_modes = vector.make_move_modes(LANES, N_GROUND, FORCE_SLOTS)",
        *(_dispatch(name, extra, at, len(codes), lanes) for name, extra, at in DISPATCHED),
        *(template.read_text() for template in TEMPLATES),
    ]
    tree = _UnsignedIndices().visit(ast.parse("\n\n".join(blocks)))
    return ast.unparse(ast.fix_missing_locations(tree)) + "\n"


class _UnsignedIndices(ast.NodeTransformer):
    """Make array indices unsigned: Numba then leaves out the test for a negative one.

    That test takes much of the kernel's time where an index is not known when it is compiled.
    """

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        self.generic_visit(node)
        if isinstance(node.value, ast.Name) and node.value.id.islower():
            parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
            parts = [
                part
                if isinstance(part, ast.Constant)
                else ast.Call(ast.Name("unsigned", ast.Load()), [part], [])
                for part in parts
            ]
            node.slice = ast.Tuple(parts, ast.Load()) if len(parts) > 1 else parts[0]
        return node


def padding(lanes: int) -> int:
    """Modes are padded to this multiple: a single run vectorises over them, a batch over lanes."""
    return 8 if lanes == 1 else 1


def load(laws: Sequence[Law], n_ground: int, lanes: int) -> ModuleType:
    """Kernel module for elements of these laws; written once to the cache folder.

    The file is named by what goes into it, so that a later process finds it without tracing the
    laws, or, where that cannot be said of a law, by its content.
    """
    key = (tuple(laws), n_ground, lanes)
    if key not in _loaded:
        marks = [fingerprint(law) for law in laws]
        text = None
        if None in marks:
            text = kernel_text(laws, n_ground, lanes)
            digest = hashlib.sha256(text.encode())
        else:
            distinct = [laws.index(law) for law in laws]
            digest = hashlib.sha256(repr((marks, distinct, n_ground, lanes)).encode())
            for source in _SOURCES:
                digest.update(source.read_bytes())
        name = "kernel_" + digest.hexdigest()[:20]
        if not (cache_folder() / f"{name}.py").exists() and text is None:
            text = kernel_text(laws, n_ground, lanes)
        _loaded[key] = import_text(name, text)
    return _loaded[key]


def import_text(name: str, text: str | None) -> ModuleType:
    """Write a module into the cache folder, unless it is there, and import it."""
    path = cache_folder() / f"{name}.py"
    if text is not None and not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_suffix(f".{os.getpid()}.tmp")
        temporary.write_text(text)
        temporary.replace(path)
    spec = importlib.util.spec_from_file_location(f"isolation_sim_{name}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@contextmanager
def compiling(module: ModuleType) -> Iterator[None]:
    """Say that the first run compiles, if the kernel is neither loaded nor in the cache."""
    if module.__name__ not in _used and not _is_cached(module):
        print("compiling the simulation kernel for this law (once; about 8 s) ...", file=sys.stderr)
    _used.add(module.__name__)
    yield


def _is_cached(module: ModuleType) -> bool:
    path = Path(str(module.__file__))
    return any((path.parent / "__pycache__").glob(f"{path.stem}.march-*.nbc"))
