"""Assemble, cache and load the compiled kernel of a structure's elements."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from types import ModuleType

import numpy as np

from ..generated import load_text, load_written
from ..laws.fingerprint import fingerprint
from ..laws.law import Law
from .element_code import COMMON, MOVING_FACTOR, NODES, ElementCode
from .folded_constants import folded_constants

TEMPLATES = tuple(
    Path(__file__).with_name(f"kernel_{part}_template.py") for part in ("step", "integration")
)
TABLES_TEMPLATE = Path(__file__).with_name("kernel_tables_template.py")
WINDOWS_TEMPLATE = Path(__file__).with_name("kernel_windows_template.py")
SUMMARY_TEMPLATE = Path(__file__).with_name("kernel_summary_template.py")
HEADER = """
import math

import numpy as np
from numba import njit

from isolation_sim.simulation import intrinsics, kernel
from isolation_sim.simulation.arguments import Step
from isolation_sim.simulation.intrinsics import call, fused, read, write

unsigned = np.uint64
OPTIONS = {"fastmath": {"contract", "nsz"}, "error_model": "numpy", "_nrt": False}
# nothing but the kernel calls these: they need no entry from Python
INNER = {**OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
inner = njit(**INNER)
inline = njit(forceinline=True, **INNER)
# compiled once, and included by kernels of all laws
shared = njit(cache=True, forceinline=True, **INNER)
# no product is fused with a sum: the same bits wherever it stands
EXACT = {**INNER, "fastmath": False}
exact = njit(**EXACT)
exact_inline = njit(forceinline=True, **EXACT)
"""
# how forces and steps are recorded; what integrates writes it, what summarises reads it
RECORDS = {
    # forces of an element at a grid point: before and after a change of current, at the nodes
    "BEFORE": 0,
    "AFTER": 1,
    "AT_NODES": 2,
    "FORCES": 5,
    # a step's own numbers: window, begin and length in it, record of the interval's next step
    "WINDOW": 0,
    "BEGIN": 1,
    "LENGTH": 2,
    "NEXT": 3,
    "STEP": 4,
}
# what ``integrate`` returns, where it is, and what became of a lane
STATUS = {
    **{name: k for k, name in enumerate(("FINISHED", "DECIDE", "BUFFER_FULL"))},
    **{name: k for k, name in enumerate(("WINDOW_NOW", "STAGE"))},
    **{name: k for k, name in enumerate(("MEASURE", "COMMAND", "UNDER_WAY"))},
    **{
        name: k
        for k, name in enumerate(
            ("ALIVE", "NO_CONVERGENCE", "NOT_FINITE", "TOO_LARGE", "CURRENT_REFUSED")
        )
    },
}
# slots of an element: a multiple of this, so that kernels of many laws include the same code
SLOTS = 128
# functions of that code
SHARED = (
    "begin_window", "take_current", "shift_force", "any_lane", "choose_step", "move_currents",
    "judge_step", "keep_step", "close_step", "close_window", "keep_force", "layout",
)  # fmt: skip
# element functions: name, arguments between base and mask, what the offset `at` is into
DISPATCHED = (
    ("prepare_held", "", ""),
    ("prepare_moving", "", ""),
    ("relax", "h", ""),
    ("sweep", "h, table, at", "table"),
    ("finish", "h, share, table, at", "table"),
    ("inside", "tau, states, at", "states"),
    ("accept", "states, at", "states"),
    ("restart", "", ""),
    ("probe", "", ""),
)


def polynomials(*nodes: float) -> tuple[tuple[float, ...], ...]:
    """Ascending coefficients of the polynomials that are 1 at one node and 0 at the others."""
    return tuple(map(tuple, np.linalg.inv(np.vander(nodes, increasing=True)).T.tolist()))


_used: set[str] = set()
_loaded: dict[tuple, ModuleType] = {}


def _dispatch(name: str, extra: str, into: str, n_laws: int, lanes: int, shared: bool) -> str:
    """Text that calls an element's function for each lane of a mask, whatever its law."""
    at = "at" if into == "table" and shared else "at + lane"
    arguments = [at if a == "at" else a for a in extra.split(", ") if a]
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


def kernel_text(laws: Sequence[Law | None], n_ground: int, lanes: int, shared: bool) -> str:
    """Source of the kernel for elements of these laws, in this order, in so many lanes."""
    # No law: a further direction of the element before. ``shared``: one set of coefficients serves
    # all lanes, whose structures are then the same.
    distinct = [law for law in dict.fromkeys(laws) if law is not None]
    codes = [ElementCode(law, tag, len(laws) == 1) for tag, law in enumerate(distinct)]
    n_states = max(len(c.states) for c in codes)
    stride = -(-(max(len(c.slots) for c in codes) + 4 * n_states) // SLOTS) * SLOTS
    shape = (len(laws), n_ground, lanes, 1 if shared else lanes, stride)
    constants = {
        **_shape_constants(*shape),
        "N_STATES": n_states,
        "KIND": tuple(len(distinct) if law is None else distinct.index(law) for law in laws),
        "DIRECTIONS": tuple(0 if law is None else law.directions for law in laws),
        # the last entry is that of a further direction, which has none of its own
        "N_PARAMETERS": (*(len(c.parameters) for c in codes), 0),
        "SLOT_PARAMETER": (*(c.slots.index("p0_0") if c.parameters else 0 for c in codes), 0),
        "SLOT_START": (*(c.slots.index("start0") if c.states else 0 for c in codes), 0),
        "SLOT_SCALE": (*(c.slots.index("scale0") if c.states else 0 for c in codes), 0),
        "PAD": padding(lanes),
        "HOPELESS": 1e12,
    }
    blocks = [
        '"""Written by isolation_sim.simulation.kernel; do not edit."""',
        HEADER,
        _assigned(constants),
        # loops over lanes become vector instructions in functions of their own
        f"by_lanes = {'inline' if lanes == 1 else 'inner'}",
        *(c.text() for c in codes),
        f"windows = kernel.load_windows{shape}\n"
        f"{', '.join(SHARED)} = ({', '.join(f'windows.{name}' for name in SHARED)})\n"
        "summary = kernel.load_summary(LANES, TABLE_LANES)\n"
        "respond_to_others = intrinsics.make_respond_to_others(\n"
        "    LANES, TABLE_LANES, N_ELEMENTS, STRIDE, SLOT_DN0, SLOT_FREE0, SLOT_F0)\n"
        "free_rows = intrinsics.make_free_rows(LANES, TABLE_LANES, N_GROUND)",
        *(_dispatch(*one, len(codes), lanes, shared) for one in DISPATCHED),
        *(template.read_text() for template in TEMPLATES),
    ]
    return folded_constants("\n\n".join(blocks))


def _shape_constants(
    n_elements: int, n_ground: int, lanes: int, table_lanes: int, stride: int
) -> dict[str, object]:
    """Constants that depend on the laws by the elements' number of slots alone."""
    return {
        "LANES": lanes,
        "ROWS": 8 * lanes,
        "TABLE_LANES": table_lanes,
        "N_ELEMENTS": n_elements,
        "N_GROUND": n_ground,
        "STRIDE": stride,
        "FORCE_SLOTS": tuple(
            e * stride + COMMON.index("f0") + k for e in range(n_elements) for k in range(3)
        ),
        **RECORDS,
        **STATUS,
        "NODES_AND_END": (*NODES, 1.0),
        "LAGRANGE": polynomials(*NODES),
        "MOVING_FACTOR": MOVING_FACTOR,
        "TINY": 1e-300,
        **{f"SLOT_{name.upper()}": k for k, name in enumerate(COMMON)},
    }


@lru_cache
def load_windows(*shape: int) -> ModuleType:
    """Windows, choice of steps and records, for any laws; see ``_shape_constants``."""

    def text() -> str:
        blocks = [
            HEADER,
            _assigned(_shape_constants(*shape)),
            "tables = kernel.load_tables(TABLE_LANES)\n"
            "build_table, layout = tables.build_table, tables.layout\n"
            "move_modes = intrinsics.make_move_modes(LANES, TABLE_LANES, N_GROUND, FORCE_SLOTS)",
            WINDOWS_TEMPLATE.read_text(),
        ]
        return folded_constants("\n\n".join(blocks))

    return load_written("windows", shape, text)


@lru_cache
def load_tables(table_lanes: int) -> ModuleType:
    """Coefficients of a step, for any laws and any number of elements."""

    def text() -> str:
        constants = {
            "TABLE_LANES": table_lanes,
            "NODES_AND_END": (*NODES, 1.0),
            "LAGRANGE": polynomials(*NODES),
        }
        return folded_constants(
            "\n\n".join([HEADER, _assigned(constants), TABLES_TEMPLATE.read_text()])
        )

    return load_written("tables", table_lanes, text)


@lru_cache
def load_summary(lanes: int, table_lanes: int) -> ModuleType:
    """Peaks and mean squares, for any laws and any number of elements."""

    def text() -> str:
        constants = {
            "LANES": lanes,
            "ROWS": 8 * lanes,
            "TABLE_LANES": table_lanes,
            "LAGRANGE": polynomials(*NODES),
            "THROUGH_ENDS": polynomials(0.0, *NODES, 1.0),
            **RECORDS,
        }
        blocks = [
            HEADER,
            _assigned(constants),
            f"by_lanes = {'inline' if lanes == 1 else 'inner'}",
            "powers = kernel.load_tables(TABLE_LANES).powers\n"
            "POINTS = intrinsics.points_at_once(LANES)\n"
            "quantities_at = intrinsics.make_rows_at(LANES, TABLE_LANES)\n"
            "DENSE = intrinsics.points_at_once(1)\n"
            "dense_quantities_at = intrinsics.make_rows_at(1, 1)",
            SUMMARY_TEMPLATE.read_text(),
        ]
        return folded_constants("\n\n".join(blocks))

    return load_written("summary", (lanes, table_lanes), text)


def _assigned(constants: dict[str, object]) -> str:
    return "\n".join(f"{name} = {value!r}" for name, value in constants.items())


def padding(lanes: int) -> int:
    """Modes are padded to this multiple: a single run vectorises over them, a batch over lanes."""
    return 8 if lanes == 1 else 1


def load(laws: Sequence[Law | None], n_ground: int, lanes: int, shared: bool = False) -> ModuleType:
    """Kernel module for elements of these laws; written once to the cache folder."""
    # The file is named by what goes into it, so that a later process finds it without tracing the
    # laws, or, where that cannot be said of a law, by its content.
    shared = shared and lanes > 1
    key = (tuple(laws), n_ground, lanes, shared)
    if key not in _loaded:

        def text() -> str:
            return kernel_text(laws, n_ground, lanes, shared)

        marks = ["" if law is None else fingerprint(law) for law in laws]
        if None in marks:
            _loaded[key] = load_text("kernel", text())
        else:
            content = (marks, [laws.index(law) for law in laws], n_ground, lanes, shared)
            _loaded[key] = load_written("kernel", content, text)
    return _loaded[key]


@contextmanager
def compiling(module: ModuleType) -> Iterator[None]:
    """Say that the first run compiles, if the kernel is neither loaded nor in the cache."""
    first = not is_compiled(module)
    _used.add(module.__name__)
    # Numba makes millions of objects, none of them garbage yet: looking for some costs a fifth
    paused = first and gc.isenabled()
    if first:
        print("compiling the kernel for this device law (once; about 20 s) ...", file=sys.stderr)
    if paused:
        gc.disable()
    try:
        yield
    finally:
        if paused:
            gc.enable()


def is_compiled(module: ModuleType) -> bool:
    """Whether a kernel is loaded or in the cache folder."""
    if module.__name__ in _used:
        return True
    path = Path(str(module.__file__))
    return any((path.parent / "__pycache__").glob(f"{path.stem}.integrate-*.nbc"))
