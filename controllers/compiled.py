"""Compile a controller's decision, written once as a plain function on arrays.

The source of one module contains the function, the functions and constants of its module that it
uses, and the nominal laws. Numba compiles the module and caches it on disk. Its name is a hash of
its content, so that nothing is compiled twice and no stale code is used.
"""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.errors import InputError
from isolation_sim.generated import load_text
from isolation_sim.laws.law import Law
from isolation_sim.simulation.control import CompiledDecision, RunContext

from .controller import Controller
from .device_model import RANGE_FUNCTIONS, DeviceModel, first_coefficient, polynomial

_HEADER = '''"""Written by controllers.compiled; do not edit."""

from __future__ import annotations

import math

import numpy as np
from numba import carray, cfunc, njit, types

OPTIONS = dict(error_model="numpy", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)
plain = njit(**OPTIONS)
doubles = types.CPointer(types.float64)'''

_ENTRY = """@cfunc(
    types.void(types.float64, doubles, doubles, doubles, doubles, types.CPointer(types.int64)),
    cache=True, error_model="numpy",
)
def entry(t, measured, settings, memory, command, sizes):
    # a run may have a channel more, for elements that no coil drives
    n_measured = sizes[0] - (sizes[3] - {n_channels})
    # an error cannot leave C code: it shows as a command that is not a number, which is refused
    for c in range({n_channels}):
        command[c] = np.nan
    {function}(
        t, carray(measured, n_measured), carray(settings, sizes[1]), carray(memory, sizes[2]),
        carray(command, {n_channels})
    )"""


@dataclass(frozen=True)
class Decision:
    """A controller's decision, ready to be called or compiled.

    Attributes
    ----------
    function : callable
        ``decide(t, measured, settings, memory, command)``: float64 arrays but for the time in s;
        writes ``command`` (A, one per coil) and what it must remember into ``memory``. Arguments
        annotated as ``Callable`` may follow: each is given the method of ``devices`` that it is
        named after. It and the functions and numbers of its module that it uses must be what Numba
        compiles, in a file; of modules, they may use ``math`` and ``np``.
    settings : numpy.ndarray, shape (n_settings,)
        Constants of the controller.
    memory : numpy.ndarray, shape (n_memory,)
        What it keeps between decisions; its value at the start.
    devices : DeviceModel or None
        Devices whose laws the decision uses.
    """

    function: Callable[..., None]
    settings: NDArray
    memory: NDArray
    devices: DeviceModel | None = None

    @property
    def methods(self) -> list[Callable]:
        """Methods of the devices that the function takes, in order."""
        return [getattr(self.devices, name) for name in _taken(self.function)]


class CompiledController(Controller):
    """A controller whose decision is compiled; the same function is its form in plain Python."""

    _given: dict[str, Any] | None = None
    _run_context: RunContext | None = None

    @abstractmethod
    def decision(self, context: RunContext) -> Decision:
        """Put the decision's constants together."""

    def reset(self, context: RunContext) -> None:
        """Put the decision together and forget what was remembered."""
        given = self.to_dict()
        # runs that differ in the ground motion alone share a design, unless it learns from trials
        learns = type(self).prepare is not Controller.prepare
        if learns or given != self._given or not _alike(context, self._run_context):
            self._decision = self.decision(context)
        self._given, self._run_context = given, context
        self._memory = self._decision.memory.copy()
        self._command = np.zeros(len(context.low))

    def compiled(self, context: RunContext) -> CompiledDecision:
        """Decision in compiled code."""
        if self._run_context is not context:
            self.reset(context)
        return compile_decision(self._decision, len(context.low))

    def current(self, t: float, measurement: Any) -> NDArray:
        """Decide, by the same function in plain Python."""
        decision = self._decision
        arrays = np.array(measurement, dtype=float), decision.settings, self._memory, self._command
        decision.function(t, *arrays, *decision.methods)
        return self._command.copy()


def _alike(one: RunContext, other: RunContext | None) -> bool:
    """Whether two run contexts lead to the same decision: equal, on the same nominal model."""
    if other is None:
        return False
    for name in (field.name for field in fields(RunContext)):
        a, b = getattr(one, name), getattr(other, name)
        if isinstance(a, np.ndarray):
            same = np.array_equal(a, b)
        else:
            same = a is b or (name not in ("nominal", "ground") and a == b)
        if not same:
            return False
    return True


def compile_decision(decision: Decision, n_channels: int) -> CompiledDecision:
    """Compile a decision, or load it from the cache folder."""
    devices = decision.devices
    model: Any = type(devices) if devices else None
    module = _module(decision.function, model, devices.laws if devices else (), n_channels)
    return CompiledDecision(module.entry.address, decision.settings, decision.memory, module)


@lru_cache(maxsize=64)
def _module(
    function: Callable, model: type[DeviceModel] | None, laws: tuple[Law, ...], n_channels: int
) -> ModuleType:
    parts: dict[str, str] = {}
    given = _taken(function)
    collect(function, parts, given)
    if model is not None:
        collect(first_coefficient, parts)
        collect(polynomial, parts)
        parts["devices"] = model.text(laws)
    if model is not None and "combined_range" in given:
        ranges = model.range_text(laws)
        for needed in RANGE_FUNCTIONS:
            if f"{needed.__name__}(" in ranges:
                collect(needed, parts)
        parts["ranges"] = ranges
    entry = _ENTRY.format(function=function.__name__, n_channels=n_channels)
    text = "\n\n\n".join([_HEADER, *parts.values(), entry]) + "\n"
    notice = "compiling the controller for this law (once; about 4 s) ..." if laws else ""
    return load_text("decision", text, notice)


def collect(function: Callable, parts: dict[str, str], given: Sequence[str] = ()) -> None:
    """Gather the source of a function and of all that it uses, what is used first.

    Functions that a function takes as arguments are written into its text by their names: compiled
    code that passes functions on takes ten times as long to compile, and cannot be kept on disk.
    """
    name = function.__name__
    try:
        source = textwrap.dedent(inspect.getsource(function))
    except OSError:
        raise InputError(f"{name} cannot be compiled: its source text is not in a file") from None
    used = inspect.getclosurevars(function).globals
    writer = _Given(dict(zip(_taken(function), given, strict=True)), used)
    text = ast.unparse(writer.visit(ast.parse(source)))
    for needed, value in used.items():
        if isinstance(value, FunctionType):
            collect(value, parts, writer.passed.get(value.__name__, ()))
        elif isinstance(value, (bool, int, float, tuple)):
            _put(parts, needed, f"{needed} = {value!r}")
        elif value is not np and value is not math:
            raise InputError(
                f"{name} cannot be compiled: it uses {needed}, a {type(value).__name__}; expected: "
                "functions, numbers and tuples of its module, math and np"
            )
    _put(parts, name, f"@plain\n{text}")


def _taken(function: Callable) -> list[str]:
    """Arguments that are functions."""
    return [name for name, kind in function.__annotations__.items() if "Callable" in str(kind)]


class _Given(ast.NodeTransformer):
    """Writes the functions that a function is given into its text.

    Parameters
    ----------
    given : mapping of str to str
        Name of the function that an argument stands for.
    used : mapping of str to object
        What else the text uses.

    Attributes
    ----------
    passed : dict of str to tuple of str
        By the name of a function that it calls: the functions that it gives on.
    """

    def __init__(self, given: Mapping[str, str], used: Mapping[str, Any]):
        self.given, self.used = given, used
        self.passed: dict[str, tuple[str, ...]] = {}

    def visit_arguments(self, node: ast.arguments) -> ast.arguments:
        """Leave out arguments that are functions."""
        node.args = [a for a in node.args if a.arg not in self.given]
        return node

    def visit_Name(self, node: ast.Name) -> ast.Name:
        """Name a function by its own name."""
        node.id = self.given.get(node.id, node.id)
        return node

    def visit_Call(self, node: ast.Call) -> ast.Call:
        """Note what is given on, and leave it out of the call."""
        self.generic_visit(node)
        callee = self.used.get(node.func.id) if isinstance(node.func, ast.Name) else None
        if isinstance(callee, FunctionType):
            taken = _taken(callee)
            pairs = list(zip(inspect.signature(callee).parameters, node.args, strict=False))
            given = tuple(ast.unparse(value) for name, value in pairs if name in taken)
            if self.passed.setdefault(callee.__name__, given) != given:
                raise InputError(
                    f"{callee.__name__} cannot be compiled: it is given different functions"
                )
            node.args = [value for name, value in pairs if name not in taken]
        return node


def _put(parts: dict[str, str], name: str, text: str) -> None:
    if parts.setdefault(name, text) != text:
        raise InputError(
            f"{name} cannot be compiled: two modules give this name to different things"
        )
