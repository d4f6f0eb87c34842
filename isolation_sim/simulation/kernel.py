"""Assemble, cache and load the compiled kernel of a structure's elements."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache, lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numba import cfunc

from ..generated import load_text, load_written
from ..laws.fingerprint import fingerprint
from ..laws.law import Law
from .element_code import COMMON, MOVING_FACTOR, NODES, OPERATIONS, ElementCode
from .folded_constants import folded_constants
from .intrinsics import ELEMENT

_TEMPLATES = {
    part: Path(__file__).with_name(f"kernel_{part}_template.py")
    for part in ("tables", "windows", "step", "integration", "summary")
}
# not a set, whose order differs between processes
_OPTIONS: dict[str, Any] = {
    "fastmath": {"contract": True, "nsz": True}, "error_model": "numpy", "_nrt": False,
}  # fmt: skip
HEADER = f"""
import math

import numpy as np
from numba import njit

from isolation_sim.simulation import intrinsics, kernel
from isolation_sim.simulation.arguments import Step
from isolation_sim.simulation.intrinsics import call, fused, read, write

unsigned = np.uint64
OPTIONS = {_OPTIONS!r}
# nothing but the kernel calls these: they need no entry from Python
INNER = dict(OPTIONS, no_cpython_wrapper=True, no_cfunc_wrapper=True)
inner = njit(**INNER)
inline = njit(forceinline=True, **INNER)
# no product is fused with a sum: the same bits wherever it stands
EXACT = dict(INNER, fastmath=False)
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
SLOTS = 128
"""An element has a multiple of this many numbers, so that most laws share one integration."""
HOPELESS = 1e12
"""Change of an iteration above which it diverges, and largest rate of relaxation, 1/s."""
TINY = 1e-300


class Kernel(NamedTuple):
    """Compiled integration of a structure, for any laws, and compiled laws of its elements."""

    module: ModuleType
    # the law of each element; None: a further direction of the element before
    laws: tuple[ModuleType | None, ...]


def polynomials(*nodes: float) -> tuple[tuple[float, ...], ...]:
    """Ascending coefficients of the polynomials that are 1 at one node and 0 at the others."""
    return tuple(map(tuple, np.linalg.inv(np.vander(nodes, increasing=True)).T.tolist()))


_used: set[str] = set()


def kernel_text(n_elements: int, n_ground: int, lanes: int, table_lanes: int, stride: int) -> str:
    """Source of the integration of so many elements, of any laws, in so many lanes."""
    # ``table_lanes``: lanes of the coefficients; 1 if they serve all lanes, with equal structures.
    # ``stride``: numbers of an element
    constants = {
        "LANES": lanes,
        "TABLE_LANES": table_lanes,
        "N_ELEMENTS": n_elements,
        "N_GROUND": n_ground,
        "STRIDE": stride,
        "FORCE_SLOTS": tuple(
            e * stride + COMMON.index("f0") + k for e in range(n_elements) for k in range(3)
        ),
        **RECORDS,
        **STATUS,
        **{name.upper(): k for k, name in enumerate(OPERATIONS)},
        **{f"SLOT_{name.upper()}": k for k, name in enumerate(COMMON)},
        "NODES_AND_END": (*NODES, 1.0),
        "LAGRANGE": polynomials(*NODES),
        "MOVING_FACTOR": MOVING_FACTOR,
        "HOPELESS": HOPELESS,
        "TINY": TINY,
        "PAD": padding(lanes),
    }
    return _assembled(
        constants,
        "tables = kernel.load_tables(TABLE_LANES)\n"
        "build_table, layout = tables.build_table, tables.layout\n"
        "summary = kernel.load_summary(LANES, TABLE_LANES)\n"
        "move_modes = intrinsics.make_move_modes(LANES, TABLE_LANES, N_GROUND, FORCE_SLOTS)\n"
        "respond_to_others = intrinsics.make_respond_to_others(\n"
        "    LANES, TABLE_LANES, N_ELEMENTS, STRIDE, SLOT_DN0, SLOT_FREE0, SLOT_F0)\n"
        "free_rows = intrinsics.make_free_rows(LANES, TABLE_LANES, N_GROUND)\n"
        "element = intrinsics.make_element(STRIDE, LANES)",
        *(_TEMPLATES[part].read_text() for part in ("windows", "step", "integration")),
    )


def law_text(law: Law, n_elements: int, lanes: int, table_lanes: int, stride: int) -> str:
    """Source of the functions of a law's elements."""
    # the structure matters to a device of several directions, and to one that is alone
    code = ElementCode(law, n_elements == 1)
    slots = code.slots
    constants = {
        "LANES": lanes,
        "TABLE_LANES": table_lanes,
        "N_ELEMENTS": n_elements,
        "STRIDE": stride,
        "HOPELESS": HOPELESS,
        "TINY": TINY,
        "N_SLOTS": len(slots),
        "N_STATES": len(code.states),
        "N_PARAMETERS": len(code.parameters),
        "SLOT_PARAMETER": slots.index("p0_0") if code.parameters else 0,
        "SLOT_START": slots.index("start0") if code.states else 0,
        "SLOT_SCALE": slots.index("scale0") if code.states else 0,
    }
    return _assembled(constants, code.text(lanes, table_lanes < lanes))


def _assembled(constants: Mapping[str, object], *blocks: str) -> str:
    """Source of a module."""
    first = '"""Written by isolation_sim.simulation.kernel; do not edit."""'
    return folded_constants("\n\n".join([first, HEADER, _assigned(constants), *blocks]))


@lru_cache
def load_tables(table_lanes: int) -> ModuleType:
    """Coefficients of a step, for any laws and any number of elements."""

    def text() -> str:
        constants = {
            "TABLE_LANES": table_lanes,
            "NODES_AND_END": (*NODES, 1.0),
            "LAGRANGE": polynomials(*NODES),
        }
        return _assembled(constants, _TEMPLATES["tables"].read_text())

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
        return _assembled(
            constants,
            f"by_lanes = {'inline' if lanes == 1 else 'inner'}",
            "powers = kernel.load_tables(TABLE_LANES).powers\n"
            "POINTS = intrinsics.points_at_once(LANES)\n"
            "quantities_at = intrinsics.make_rows_at(LANES, TABLE_LANES)\n"
            "DENSE = intrinsics.points_at_once(1)\n"
            "dense_quantities_at = intrinsics.make_rows_at(1, 1)",
            _TEMPLATES["summary"].read_text(),
        )

    return load_written("summary", (lanes, table_lanes), text)


def _assigned(constants: Mapping[str, object]) -> str:
    return "\n".join(f"{name} = {value!r}" for name, value in constants.items())


def padding(lanes: int) -> int:
    """Modes are padded to this multiple: a single run vectorises over them, a batch over lanes."""
    return 8 if lanes == 1 else 1


def load(laws: Sequence[Law | None], n_ground: int, lanes: int, shared: bool = False) -> Kernel:
    """Kernel of elements of these laws; ``shared``: the structures of all lanes are equal.

    No law: a further direction of the element before.
    """
    return _load(tuple(laws), n_ground, lanes, 1 if shared else lanes)


@cache
def _load(laws: tuple[Law | None, ...], n_ground: int, lanes: int, table_lanes: int) -> Kernel:
    n, stride = len(laws), SLOTS
    modules = {law: load_law(law, n, lanes, table_lanes, stride) for law in laws if law}
    needed = max(m.N_SLOTS + 4 * m.N_STATES for m in modules.values())
    if needed > stride:
        stride = -(-needed // SLOTS) * SLOTS
        modules = {law: load_law(law, n, lanes, table_lanes, stride) for law in modules}
    module = load_integration(n, n_ground, lanes, table_lanes, stride)
    return Kernel(module, tuple(None if law is None else modules[law] for law in laws))


@cache
def load_integration(*shape: int) -> ModuleType:
    """Integration for any laws; see ``kernel_text``."""
    return load_written("kernel", shape, lambda: kernel_text(*shape))


def load_law(law: Law, n_elements: int, lanes: int, table_lanes: int, stride: int) -> ModuleType:
    """Functions of a law's elements; written once to the cache folder."""
    if law.directions == 1:  # it neither knows of the other elements nor where they are
        n_elements, stride = min(n_elements, 2), 0
    return _load_law(law, n_elements, lanes, table_lanes, stride)


@cache
def _load_law(law: Law, *shape: int) -> ModuleType:
    # The file is named by what goes into it, so that a later process finds it without tracing the
    # law, or, where that cannot be said of a law, by its content.
    def text() -> str:
        return law_text(law, *shape)

    mark = fingerprint(law)
    return load_text("law", text()) if mark is None else load_written("law", (mark, shape), text)


@cache
def compiled(law: ModuleType) -> Any:
    """Compile a law's ``element``, to be called by its ``address``."""
    return cfunc(ELEMENT, cache=True, **_OPTIONS)(law.element)


@contextmanager
def compiling(kernel: Kernel) -> Iterator[None]:
    """Say that the first run compiles, if a part of the kernel is not in the cache yet."""
    missing = [one for one in _modules(kernel) if not _is_available(one)]
    _used.update(one.__name__ for one in _modules(kernel))
    # Numba makes millions of objects, none of them garbage yet: looking for some costs a fifth
    paused = bool(missing) and gc.isenabled()
    if missing:
        whole = kernel.module in missing
        what = "the simulation (once; about 20 s)" if whole else "this device law (once; about 2 s)"
        print(f"compiling {what} ...", file=sys.stderr)
    if paused:
        gc.disable()
    try:
        yield
    finally:
        if paused:
            gc.enable()


def is_compiled(kernel: Kernel) -> bool:
    """Whether all of a kernel is loaded or in the cache folder."""
    return all(map(_is_available, _modules(kernel)))


def _modules(kernel: Kernel) -> list[ModuleType]:
    return [kernel.module, *filter(None, dict.fromkeys(kernel.laws))]


def _is_available(module: ModuleType) -> bool:
    path = Path(str(module.__file__))
    cached = (path.parent / "__pycache__").glob(f"{path.stem}.*.nbc")
    return module.__name__ in _used or any(cached)
