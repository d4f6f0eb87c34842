"""Load the compiled integration of a structure, and the compiled laws of its elements.

The modules of this package are written for one element and one run at a time. What is compiled are
copies of them for a ``Shape``, in the cache folder (``compilation/kernel_text.py``). One copy
serves structures of one element, where the constants also save time in the integration, and one all
others. With ``NUMBA_DISABLE_JIT=1`` nothing is compiled, and these modules integrate themselves.
"""

from __future__ import annotations

import gc
import importlib
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from ...compilation.generated import COMPILED, in_cache, load_written
from ...compilation.kernel_text import assigned, kernel_text, module_text
from ...laws.fingerprint import fingerprint
from ...laws.law import Law
from . import shape as own_sizes
from .element_code import ElementCode
from .slots import HOPELESS, TINY


class Shape(NamedTuple):
    """Sizes of a structure and its lanes, or those for which an integration is compiled."""

    # see ``shape.py``; no integration is compiled for a number of elements or directions above 1

    n_elements: int
    n_ground: int
    lanes: int
    table_lanes: int
    stride: int


OWN_SHAPE = Shape(*(getattr(own_sizes, size.upper()) for size in Shape._fields))
"""Shape of the modules of this package."""
ONE = 1, 1
"""Elements and ground directions that an integration of its own is compiled for."""


class Kernel(NamedTuple):
    """Compiled integration of a structure, for any laws, and compiled laws of its elements."""

    shape: Shape
    integration: ModuleType
    tables: ModuleType
    peaks: ModuleType
    # the law of each element; None: a further direction of the element before
    laws: tuple[ModuleType | None, ...]


_used: set[str] = set()
_TABLES = f"from {__package__} import loading\n" + "\n".join(
    f"{name} = loading.load_tables(TABLE_LANES).{name}"
    for name in ("build_table", "layout", "powers")
)
"""A copy of the coefficients, too, in place of their module."""


def integration_text(shape: Shape) -> str:
    """Source of the integration of elements of any laws."""
    return _copy(shape, "segments", "step", "integration")


def tables_text(table_lanes: int) -> str:
    """Source of the coefficients of a step, for any laws and any number of elements."""
    return _copy(OWN_SHAPE._replace(table_lanes=table_lanes), "tables")


def peaks_text(lanes: int, table_lanes: int) -> str:
    """Source of peaks and mean squares, for any laws and any number of elements."""
    return _copy(OWN_SHAPE._replace(lanes=lanes, table_lanes=table_lanes), "peaks")


def law_text(law: Law, n_elements: int, lanes: int, table_lanes: int, stride: int) -> str:
    """Source of the functions of a law's elements."""
    code = ElementCode(law)
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
    imports = [
        "from numba import njit",
        "from isolation_sim.compilation.options import OPTIONS, inline, inner, math",
        f"from {__package__}.operations import fused, read, write",
    ]
    return module_text([*imports, assigned(constants), code.text(lanes, table_lanes < lanes)])


def _copy(shape: Shape, *names: str) -> str:
    """Source of modules of this package, for a shape, as one module."""
    from . import integration, peaks, segments, step, tables  # noqa: F401 their sources are read

    modules = [importlib.import_module(f".{name}", __package__) for name in names]
    sizes = {size.upper(): value for size, value in shape._asdict().items()}
    case = {own_sizes: assigned(sizes)}
    if tables not in modules:
        case[tables] = _TABLES
    fields = {"sizes.n_elements": 1, "sizes.n_ground": 1} if shape[:2] == ONE else {}
    return kernel_text(modules, case, fields)


@cache
def load_tables(table_lanes: int) -> ModuleType:
    """Coefficients of a step."""
    if not COMPILED and table_lanes == OWN_SHAPE.table_lanes:
        return importlib.import_module(".tables", __package__)
    return load_written("tables", table_lanes, lambda: tables_text(table_lanes))


@cache
def load_peaks(lanes: int, table_lanes: int) -> ModuleType:
    """Peaks and mean squares."""
    if not COMPILED and (lanes, table_lanes) == OWN_SHAPE[2:4]:
        return importlib.import_module(".peaks", __package__)
    return load_written("peaks", (lanes, table_lanes), lambda: peaks_text(lanes, table_lanes))


@cache
def load_integration(shape: Shape) -> ModuleType:
    """Integration of structures of a shape."""
    if shape[:2] != ONE or not COMPILED:
        shape = shape._replace(n_elements=OWN_SHAPE.n_elements, n_ground=OWN_SHAPE.n_ground)
    if not COMPILED and shape == OWN_SHAPE:
        return importlib.import_module(".integration", __package__)
    return load_written("kernel", tuple(shape), lambda: integration_text(shape))


def load(laws: Sequence[Law | None], n_ground: int, lanes: int, shared: bool = False) -> Kernel:
    """Kernel of elements of these laws; ``shared``: the structures of all lanes are equal.

    No law: a further direction of the element before.
    """
    return _load(tuple(laws), n_ground, lanes, 1 if shared else lanes)


@cache
def _load(laws: tuple[Law | None, ...], n_ground: int, lanes: int, table_lanes: int) -> Kernel:
    n, stride = len(laws), OWN_SHAPE.stride
    modules = {law: load_law(law, n, lanes, table_lanes, stride) for law in laws if law}
    needed = max(m.N_SLOTS + 4 * m.N_STATES for m in modules.values())
    if needed > stride:
        stride *= -(-needed // stride)  # multiples, so that most laws share one integration
        modules = {law: load_law(law, n, lanes, table_lanes, stride) for law in modules}
    shape = Shape(n, n_ground, lanes, table_lanes, stride)
    return Kernel(
        shape,
        load_integration(shape),
        load_tables(table_lanes),
        load_peaks(lanes, table_lanes),
        tuple(None if law is None else modules[law] for law in laws),
    )


def load_law(law: Law, n_elements: int, lanes: int, table_lanes: int, stride: int) -> ModuleType:
    """Functions of a law's elements; written once to the cache folder."""
    if law.directions == 1:  # it neither knows of the other elements nor where they are
        n_elements, stride = 1, 0
    return _load_law(law, n_elements, lanes, table_lanes, stride)


@cache
def _load_law(law: Law, *shape: int) -> ModuleType:
    # The file is named by what goes into it, so that a later process finds it without tracing the
    # law, or, where that cannot be said of a law, by its content.
    def text() -> str:
        return law_text(law, *shape)

    mark = fingerprint(law)
    return load_written("law", mark and (mark, shape), text)


@contextmanager
def compiling(kernel: Kernel) -> Iterator[None]:
    """Say that the first run compiles, if a part of the kernel is not in the cache yet."""
    missing = [one for one in _modules(kernel) if not _is_available(one)]
    _used.update(one.__name__ for one in _modules(kernel))
    # Numba makes millions of objects, none of them garbage yet: looking for some costs a fifth
    paused = bool(missing) and gc.isenabled()
    if missing:
        whole = kernel.integration in missing
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
    """Whether the integration is loaded or in the cache folder; a law compiles within seconds."""
    return _is_available(kernel.integration)


def _modules(kernel: Kernel) -> list[ModuleType]:
    return [kernel.integration, *filter(None, dict.fromkeys(kernel.laws))]


def _is_available(module: ModuleType) -> bool:
    return module.__name__ in _used or in_cache(Path(str(module.__file__)).stem)
