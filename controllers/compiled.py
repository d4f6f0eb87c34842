"""Compile a controller's decision, written once as a plain function on arrays.

The source of one module contains the function, and the functions and constants of its module that
it uses. Numba compiles the module and caches it on disk. Its name is a hash of its content, so that
nothing is compiled twice and no stale code is used. What works with the devices and stands in
another file, such as an observer or the current map, is a module of its own: it is compiled once
for all controllers. The functions of the nominal laws are modules as well. A decision calls them
through their addresses, so that it is compiled once for all laws.
"""

from __future__ import annotations

import ast
import ctypes
import inspect
import math
import re
import textwrap
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache, partial
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground_motions.python_source import parse
from isolation_sim.compilation.generated import COMPILED, load_text, module_name
from isolation_sim.errors import InputError
from isolation_sim.laws.law import Law
from isolation_sim.simulation.control import CompiledDecision, RunContext

from .controller import Controller
from .device_model import RANGE_FUNCTIONS, DeviceModel, first_coefficient, polynomial

_HEADER = '''"""Written by controllers.compiled; do not edit."""

from __future__ import annotations

import math
import sys

import numpy as np
from numba import carray, cfunc, njit, types

from isolation_sim.compilation.call_by_address import make_call
from isolation_sim.compilation.options import KernelCompiler, LinkedCompiler

OPTIONS = dict(error_model="numpy", {options}no_cpython_wrapper=True, no_cfunc_wrapper=True)
plain = njit(pipeline_class=LinkedCompiler, **OPTIONS)
with_disk_cache = njit(cache=True, pipeline_class=KernelCompiler, **OPTIONS)
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
        carray(command, {n_channels}), {functions}
    )"""


_DURATIONS = {"controllers.predictive.state_seen": "; about 40 s"}
"""Time to compile, by the module of the decision, where it is long."""

Model = Any
"""Class of device models; mypy takes no class for hashable, as caches of functions need it."""


@dataclass(frozen=True)
class Decision:
    """A controller's decision, ready to be called or compiled."""

    # ``decide(t, measured, settings, memory, command)``: float64 arrays but for the time in s;
    # writes ``command`` (A, one per coil) and what it must remember into ``memory``. Arguments
    # annotated as ``Callable`` may follow: each is given the method of ``devices`` that it is named
    # after. It and the functions and numbers of its module that it uses must be what Numba
    # compiles, in a file; of modules, they may use ``math`` and ``np``
    function: Callable[..., None]
    settings: NDArray  # (n_settings,): Constants of the controller
    memory: NDArray  # (n_memory,): What it keeps between decisions; its value at the start
    devices: DeviceModel | None = None  # Devices whose laws the decision uses

    @property
    def methods(self) -> list[Callable]:
        """Methods of the devices that the function takes, in order."""
        return [getattr(self.devices, name) for name in _function_arguments(self.function)]


class CompiledController(Controller):
    """A controller whose decision is compiled; the same function is its form in plain Python."""

    # Of the last design
    _settings: dict[str, Any] | None = None
    _run_context: RunContext | None = None

    @abstractmethod
    def decision(self, context: RunContext) -> Decision:
        """Assemble the constants of the decision."""

    def reset(self, context: RunContext) -> None:
        """Assemble the decision and clear the memory."""
        settings = self.to_dict()
        # runs that differ in the ground motion alone share a design, unless it learns from trials
        learns = type(self).prepare is not Controller.prepare
        if learns or settings != self._settings or not _alike(context, self._run_context):
            self._decision = self.decision(context)
        self._settings, self._run_context = settings, context
        self._step = DecisionStep(self._decision, len(context.low))

    def compiled(self, context: RunContext) -> CompiledDecision | None:
        """Decision in compiled code."""
        if self._run_context is not context:
            self.reset(context)
        return compile_decision(self._decision, len(context.low), self.name)

    def current(self, t: float, measurement: Any) -> NDArray:
        """Decide, by the same function in plain Python."""
        return self._step(t, measurement)


class DecisionStep:
    """A decision that is called from Python, one measurement after another."""

    def __init__(self, decision: Decision, n_commands: int):
        self._decision, self.memory = decision, decision.memory.copy()
        self._command = np.zeros(n_commands)

    def __call__(self, t: float, measured: Any) -> NDArray:
        """Decide."""
        arrays = np.asarray(measured, dtype=float), self._decision.settings, self.memory
        self._decision.function(t, *arrays, self._command, *self._decision.methods)
        return self._command.copy()


class CompiledStep(DecisionStep):
    """The same, compiled."""

    def __init__(self, decision: Decision, n_measured: int, n_commands: int, name: str = ""):
        super().__init__(decision, n_commands)
        compiled = compile_decision(decision, n_commands, name)
        pointer, double = ctypes.POINTER(ctypes.c_double), ctypes.c_double
        kind = ctypes.CFUNCTYPE(None, double, *[pointer] * 4, ctypes.POINTER(ctypes.c_int64))
        self._entry, self._keep = kind(compiled.address), compiled
        self.measured = np.zeros(n_measured)
        self._arrays = self.measured, compiled.settings, self.memory, self._command
        lengths = [len(array) for array in self._arrays]
        self._sizes = np.array([*lengths, *compiled.numbers], dtype=np.int64)
        self._places = [
            *(array.ctypes.data_as(pointer) for array in self._arrays),
            self._sizes.ctypes.data_as(ctypes.POINTER(ctypes.c_int64)),
        ]

    def __call__(self, t: float, measured: Any) -> NDArray:
        """Decide."""
        self.measured[:] = measured
        self._entry(t, *self._places)
        return self._command.copy()


def decision_step(
    decision: Decision, n_measured: int, n_commands: int, name: str = ""
) -> DecisionStep:
    """Compile a decision to call it from Python; with ``NUMBA_DISABLE_JIT=1`` it stays Python."""
    if not COMPILED:
        return DecisionStep(decision, n_commands)
    return CompiledStep(decision, n_measured, n_commands, name)


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


def compile_decision(decision: Decision, n_channels: int, name: str = "") -> CompiledDecision:
    """Compile a decision, or load it from the cache folder; the name is that of the controller."""
    devices, methods = decision.devices, _function_arguments(decision.function)
    model: Any = type(devices) if devices else None
    laws = devices.laws if devices else ()
    module = _module(decision.function, model, name)
    functions = [_device_function(model, laws, method) for method in methods]
    return CompiledDecision(
        module.entry.address, decision.settings, decision.memory, (module, functions),
        partial(_text, decision.function, model, laws, n_channels),
        numbers=(n_channels, *(address for _, address in functions)),
    )  # fmt: skip


@lru_cache(maxsize=64)
def _module(function: Callable, model: Model | None, name: str) -> ModuleType:
    """Module of a decision, for all laws and numbers of coils."""
    methods = _function_arguments(function)
    parts: dict[str, str] = {}
    collect(function, parts, methods, partial(_shared, model))
    parts["entry"] = _ENTRY.format(
        function=function.__name__, n_channels="sizes[4]",
        functions=", ".join(f"sizes[{5 + k}]" for k in range(len(methods))),
    )  # fmt: skip
    what, time = name or "a controller", _DURATIONS.get(function.__module__, "")
    notice = f"compiling {what} (once{time}) ..." if model else ""
    return load_text("decision", _module_text(parts, model), notice)


@lru_cache(maxsize=256)
def _shared(model: Model, function: Callable, arguments: tuple[str, ...]) -> str:
    """Statement that takes a function that calls the devices from its own module."""
    parts: dict[str, str] = {}
    collect(function, parts, arguments, partial(_shared, model))
    name = function.__name__
    parts[name] = parts[name].replace("@plain", "@with_disk_cache", 1)
    text = _module_text(parts, model)
    load_text("shared", text)
    return f"{name} = sys.modules[{module_name('shared', text)!r}].{name}"


@lru_cache(maxsize=256)
def _device_function(model: Model, laws: tuple[Law, ...], method: str) -> tuple[Any, int]:
    """Function of the devices, and its address while the function exists."""
    from isolation_sim.compilation.call_by_address import address_of

    function = getattr(_device_module(model, laws, method), method)
    return function, address_of(function, model.signatures[method])


def _device_module(model: Model, laws: tuple[Law, ...], method: str) -> ModuleType:
    """Module with a function of the devices."""
    text = _module_text(_device_parts(model, laws, {method}))
    return load_text(
        "devices", text.replace(f"@plain\ndef {method}(", f"@with_disk_cache\ndef {method}(")
    )


def _text(
    function: Callable, model: Model | None, laws: tuple[Law, ...], n_channels: int
) -> str:  # fmt: skip
    """Whole source of a decision, in which functions are called by their names."""
    parts: dict[str, str] = {}
    collect(function, parts, _function_arguments(function))
    called = set(re.findall(r"\w+(?=\()", "\n".join(parts.values())))
    parts["entry"] = _ENTRY.format(function=function.__name__, n_channels=n_channels, functions="")
    return _module_text({**_device_parts(model, laws, called), **parts})


def _module_text(parts: Mapping[str, str], model: Model | None = None) -> str:
    """Source of a module, with the calls of the devices' functions through their addresses."""
    text = "\n\n\n".join(parts.values())
    calls = sorted(set(re.findall(r"(?<=\bcall_)\w+(?=\()", text)))
    if model is not None and calls:
        makes = (f"call_{name} = make_call({model.signatures[name]!r})" for name in calls)
        text = "\n".join(makes) + f"\n\n\n{text}"
    # where functions return views of arrays, Numba wants to count references
    header = _HEADER.format(options="" if "-> NDArray" in text else "_nrt=False, ")
    return f"{header}\n\n\n{text}\n"


def _device_parts(model: Model | None, laws: tuple[Law, ...], called: set[str]) -> dict[str, str]:
    """Source of the functions of the devices that are called, and of what these use."""
    parts: dict[str, str] = {}
    if model is None:
        return parts
    devices = _devices(model, laws)
    if called & set(re.findall(r"(?<=def )\w+", devices)):
        collect(first_coefficient, parts)
        collect(polynomial, parts)
        parts["functions of the devices"] = devices
    if "combined_range" in called:
        collect(first_coefficient, parts)
        ranges = model.range_text(laws)
        for needed in RANGE_FUNCTIONS:
            if f"{needed.__name__}(" in ranges:
                collect(needed, parts)
        parts["ranges"] = ranges
    return parts


@lru_cache(maxsize=64)
def _devices(model: Model, laws: tuple[Law, ...]) -> str:
    """Source of the devices' functions."""
    text: str = model.text(laws)
    return text


def collect(
    function: Callable, parts: dict[str, str], arguments: Sequence[str] = (),
    shared: Callable[..., str] | None = None,
) -> None:  # fmt: skip
    """Gather the source of a function and of all functions that it uses, in order of use.

    Functions of the devices, which a function takes as ``arguments``, are written into its text by
    their names. With ``shared`` they remain arguments, and are addresses. It returns the import of
    a function of another file that takes some, which else is gathered too.
    """
    name = function.__name__
    try:
        source = textwrap.dedent(inspect.getsource(function))
    except OSError:
        raise InputError(f"{name} cannot be compiled: its source text is not in a file") from None
    used = inspect.getclosurevars(function).globals
    names = dict(zip(_function_arguments(function), arguments, strict=True))
    writer = (_CallByAddress if shared else _CallByName)(names, used)
    text = ast.unparse(writer.visit(parse(source)))
    for needed, value in used.items():
        if isinstance(value, FunctionType):
            passed = writer.passed.get(value.__name__, ())
            if shared and passed and value.__module__ != function.__module__:
                _put(parts, needed, shared(value, passed))
            else:
                collect(value, parts, passed, shared)
        elif isinstance(value, (bool, int, float, tuple)):
            # Numba compiles a function once more for every number that is a constant
            number = shared and isinstance(value, int) and not isinstance(value, bool)
            _put(parts, needed, f"{needed} = {f'np.int64({value})' if number else repr(value)}")
        elif value is not np and value is not math:
            raise InputError(
                f"{name} cannot be compiled: it uses {needed}, a {type(value).__name__}; expected: "
                "functions, numbers and tuples of its module, math and np"
            )
    _put(parts, name, f"@plain\n{text}")


def _function_arguments(function: Callable) -> list[str]:
    """Arguments that are functions."""
    return [name for name, kind in function.__annotations__.items() if "Callable" in str(kind)]


class _Calls(ast.NodeTransformer):
    """Writes the calls of functions that a function takes as arguments."""

    def __init__(self, names: Mapping[str, str], used: Mapping[str, Any]):
        self.names, self.used = names, used
        # By the name of a function that it calls: the functions that it passes on
        self.passed: dict[str, tuple[str, ...]] = {}

    def note(self, node: ast.Call) -> list[bool]:
        """Note the functions that a call passes on, and which of its arguments they are."""
        callee = self.used.get(node.func.id) if isinstance(node.func, ast.Name) else None
        if not isinstance(callee, FunctionType):
            return [False] * len(node.args)
        functions = _function_arguments(callee)
        pairs = list(zip(inspect.signature(callee).parameters, node.args, strict=False))
        given = [ast.unparse(value) for name, value in pairs if name in functions]
        passed = tuple(self.names.get(name, name) for name in given)
        if self.passed.setdefault(callee.__name__, passed) != passed:
            raise InputError(
                f"{callee.__name__} cannot be compiled: it is given different functions"
            )
        return [name in functions for name, _ in pairs]


class _CallByName(_Calls):
    """Calls them by their names, and leaves them out of arguments."""

    def visit_arguments(self, node: ast.arguments) -> ast.arguments:
        """Leave out arguments that are functions."""
        node.args = [a for a in node.args if a.arg not in self.names]
        return node

    def visit_Name(self, node: ast.Name) -> ast.Name:
        """Name a function by its own name."""
        node.id = self.names.get(node.id, node.id)
        return node

    def visit_Call(self, node: ast.Call) -> ast.Call:
        """Leave functions out of a call."""
        self.generic_visit(node)
        are_functions = self.note(node)
        node.args = [a for a, is_one in zip(node.args, are_functions, strict=True) if not is_one]
        return node


class _CallByAddress(_Calls):
    """Calls them through their addresses, which stay arguments."""

    def visit_Call(self, node: ast.Call) -> ast.Call:
        """Call a function of the devices through its address."""
        self.generic_visit(node)
        self.note(node)
        if isinstance(node.func, ast.Name) and node.func.id in self.names:
            call = ast.Name(f"call_{self.names[node.func.id]}", ast.Load())
            return ast.Call(call, [node.func, ast.Tuple(node.args, ast.Load())], [])
        return node


def _put(parts: dict[str, str], name: str, text: str) -> None:
    if parts.setdefault(name, text) != text:
        raise InputError(
            f"{name} cannot be compiled: two modules give this name to different things"
        )
