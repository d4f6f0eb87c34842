"""How the kernel's functions are compiled.

With ``NUMBA_DISABLE_JIT=1`` nothing is compiled: the same functions run as Python, in which a
debugger can stop.
"""

from __future__ import annotations

import math as python_math
from types import SimpleNamespace
from typing import Any

import numpy as np
from numba import njit

from ..generated import COMPILED
from .linked import LinkedCompiler

# not a set, whose order differs between processes
OPTIONS: dict[str, Any] = {
    "fastmath": {"contract": True, "nsz": True}, "error_model": "numpy", "_nrt": False,
}  # fmt: skip
# nothing but the kernel calls these: they need no entry from Python
_INNER: dict[str, Any] = {
    **OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True,
    "pipeline_class": LinkedCompiler,
}  # fmt: skip
# no product is fused with a sum: the same bits wherever it stands
_EXACT = {**_INNER, "fastmath": False}
inner = njit(**_INNER)
inline = njit(forceinline=True, **_INNER)
exact = njit(**_EXACT)
exact_inline = njit(forceinline=True, **_EXACT)
# Python's own functions raise errors where Numba's and NumPy's return infinity
math: Any = python_math if COMPILED else SimpleNamespace(**vars(np), erf=python_math.erf)
