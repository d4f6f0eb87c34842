"""Results in one file of plain data: a NumPy ``.npz`` file with a JSON tree and arrays.

Reading the file executes no code from it. It contains names of classes of this project with their
fields, and registered names of laws and effects. The only exception is the law file of a diagnosis;
its text may contain only the definition of a law. A law or an effect in a file of the user's own is
named by its place: that file is run, as in a scenario. ``pickle`` uses the same reductions.
"""

from __future__ import annotations

import ast
import copyreg
import json
import re
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import lru_cache
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ground_motions.files import atomic_write
from ground_motions.old_names import renamed_keys
from ground_motions.python_source import parse
from ground_motions.registry import code_files, copied_place, has_changed

from .compilation.generated import cache_folder, load_text
from .criterion import Criteria
from .effects.effect import Effect
from .effects.extend import ExtendedLaw, _extended_law, _outer_parameters
from .effects.registry import EFFECTS, effect
from .errors import ControllerError, Diverged, InputError, RefusedCurrent, warn
from .laws.fmu import of_file
from .laws.law import Law
from .laws.passive_switching import PassiveLaw, _passive_law
from .laws.registry import LAWS
from .version import __version__

FILE = "result.npz"
"""Name of the file in a folder of results."""
BASES = re.compile(r'^BASE = LAWS\["(.*)"\]$', re.MULTILINE)
"""Places of base laws in the text of a law."""
_LAW = "LAW"
_LAW_MODULES = {"typing", "numpy", "isolation_sim.laws", "isolation_sim.laws.law"}
_LAW_CALLS = {"Law", "Quantity", "len", "zip", "enumerate", "tuple", "limited", "learned"}
_LAW_NUMPY = {"abs", "arcsinh", "cos", "cosh", "exp", "fabs", "log", "log1p", "max", "min", "sign",
          "sin", "sinh", "sqrt", "tanh", "where"}  # fmt: skip
_TREE = "tree.json"
_PACKAGES = ("isolation_sim", "ground_motions", "controllers")
_ERRORS: dict[str, type[Exception]] = {
    each.__name__: each for each in (Diverged, ControllerError, RefusedCurrent, InputError)
}
_OLD_MODULES = {
    "isolation_sim.identification.run_table": "isolation_sim.identification.measured.run_table"
}
_OLD_CLASSES = {"Reached": "TestComparison"}
_OLD_FIELDS = {
    "Cause": {"evidence": "reason"},
    "Diagnosis": {"judged": "nominal"},
    "Record": {"unit_as_given": "file_unit"},
    "Run": {"reached": "accuracy", "reached_of_tests": "test_comparison"},
}
"""Names of modules, of classes and of their fields in files of older versions."""


class _Content(NamedTuple):
    """What the tree of a result refers to."""

    arrays: Mapping[str, np.ndarray]
    folder: Path  # Of the file, which may have copies of files of code


def save_archive(result: Any, path: str | Path) -> Path:
    """Write a result, completely or not at all; return the file."""
    arrays: dict[int, tuple[str, np.ndarray]] = {}
    tree = {"software": f"isolation-sim {__version__}", "result": _encode(result, arrays)}
    with atomic_write(path) as unfinished, unfinished.open("wb") as file:
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            archive.writestr(_TREE, json.dumps(tree))
            for name, array in arrays.values():
                buffer = BytesIO()
                np.lib.format.write_array(buffer, np.asarray(array), allow_pickle=False)
                archive.writestr(f"{name}.npy", buffer.getvalue())
    return Path(path)


def load_archive(path: str | Path) -> Any:
    """Read a file of `save_archive`."""
    try:
        with zipfile.ZipFile(path) as archive:
            tree = json.loads(archive.read(_TREE))
            arrays: dict[str, np.ndarray] = {}
            for name in archive.namelist():
                if name.endswith(".npy"):
                    array = np.lib.format.read_array(
                        BytesIO(archive.read(name)), allow_pickle=False
                    )
                    array.flags.writeable = False
                    arrays[name.removesuffix(".npy")] = array
        return _decode(tree["result"], _Content(arrays, Path(path).absolute().parent))
    except (OSError, KeyError, TypeError, AttributeError, ValueError, zipfile.BadZipFile) as error:
        if isinstance(error, InputError):
            raise InputError(f"{path}: {error}") from None
        reason = getattr(error, "strerror", None) or f"{type(error).__name__}: {error}"
        others = "; iso.Scenario.read reads a .toml file of a scenario or of fit --out"
        others *= Path(path).suffix == ".toml"
        raise InputError(
            f"{path}: not a saved result ({reason}); expected: a results folder or its "
            f"{FILE}{others}"
        ) from None


def _encode(value: Any, arrays: dict[int, tuple[str, np.ndarray]]) -> Any:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        # an array that occurs twice is written once
        name, _ = arrays.setdefault(id(value), (f"array_{len(arrays)}", value))
        return {"$array": name}
    if isinstance(value, list):
        return [_encode(each, arrays) for each in value]
    if isinstance(value, Criteria):
        return {"$criteria": dict(value)}
    if isinstance(value, Mapping):
        return {"$dict": [[_encode(k, arrays), _encode(v, arrays)] for k, v in value.items()]}
    if isinstance(value, Path):
        return {"$path": str(value)}
    if isinstance(value, Diverged | InputError):
        return {"$error": [type(value).__name__, str(value)]}
    if isinstance(value, Law):
        return {"$law": _encode(_law_recipe(value), arrays)}
    if isinstance(value, Effect):
        return {"$effect": [EFFECTS.called(value, value.cause), value.form]}
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        return {"$tuple": [_encode(each, arrays) for each in value]}
    kind = type(value)
    if kind.__module__.partition(".")[0] not in _PACKAGES:
        raise InputError(f"a result with {kind.__module__}.{kind.__name__} cannot be saved")
    if isinstance(value, tuple):
        state = value._asdict()  # type: ignore[attr-defined]
    elif is_dataclass(value) and "__getstate__" not in vars(kind):
        state = {each.name: getattr(value, each.name) for each in fields(value)}
    else:
        state = value.__getstate__()
    return {
        "$object": f"{kind.__module__}:{kind.__qualname__}",
        "state": {key: _encode(each, arrays) for key, each in state.items()},
    }


def _decode(tree: Any, content: _Content) -> Any:
    if isinstance(tree, list):
        return [_decode(each, content) for each in tree]
    if not isinstance(tree, dict):
        return tree
    if "$object" in tree:
        return _object(tree["$object"], {k: _decode(v, content) for k, v in tree["state"].items()})
    ((kind, part),) = tree.items()
    if kind == "$array":
        return content.arrays[part]
    if kind == "$criteria":
        return Criteria(part)
    if kind == "$dict":
        return {_decode(k, content): _decode(v, content) for k, v in part}
    if kind == "$tuple":
        return tuple(_decode(each, content) for each in part)
    if kind == "$path":
        return Path(part)
    if kind == "$error":
        return _ERRORS[part[0]](part[1])
    if kind == "$law":
        return law_of_recipe(*_beside(_decode(part, content), content.folder))
    if kind == "$effect":
        return effect(*part)
    raise KeyError(kind)


def _beside(recipe: tuple, folder: Path) -> tuple:
    """A law's recipe; files that are gone are replaced by their copies in the folder."""
    kind, first, *others = recipe
    if kind == "text":
        for place in BASES.findall(first):
            first = first.replace(f'"{place}"', f'"{copied_place(place, folder)}"')
    elif kind == "file" and (place := copied_place(first, folder)) != first:
        first, others[0] = place, place.rpartition(":")[0] or place
    return kind, first, *others


def _object(place: str, state: dict[str, Any]) -> Any:
    """Restore an object of one of the project's classes from its state."""
    module, _, name = place.partition(":")
    if module.partition(".")[0] not in _PACKAGES:
        raise InputError(f"contains {place}, which is not a class of the project")
    module = _OLD_MODULES.get(module, module)
    kind = getattr(import_module(module), _OLD_CLASSES.get(name, name))
    if not isinstance(kind, type):
        raise InputError(f"contains {place}, which is not a class")
    for each in kind.__mro__:
        state = renamed_keys(state, **_OLD_FIELDS.get(each.__name__, {}))
    if hasattr(kind, "_fields"):
        return kind(**state)
    instance: Any = object.__new__(kind)
    if hasattr(kind, "__setstate__"):
        instance.__setstate__(state)
        return instance
    for key, value in state.items():
        object.__setattr__(instance, key, value)
    return instance


def _law_recipe(law: Law) -> tuple:
    """Recipe to find or rebuild a law: its kind, then its arguments."""
    if isinstance(law, ExtendedLaw) and law.base is not None:
        n_powers = 0
        if law.breaks is not None:
            n_inner = len(law.parameters) - len(_outer_parameters(law.effects))
            n_powers = n_inner // (len(law.base.parameters) * (len(law.breaks) + 1))
        return "extended", law.base, law.effects, law.breaks, n_powers
    if isinstance(law, PassiveLaw) and law.plain is not None:
        return "passive", law.plain, law.powers
    if law.unit:
        return "unit", law.unit, dict(law.unit_variables)
    own = law.name if law.name in LAWS and LAWS[law.name] is law else ""
    name = LAWS.called(law, own)
    if text := text_of(law):
        return "text", text
    if not name:
        raise InputError(
            f"law {law.name!r} cannot be saved, since it has no registered name; expected: "
            f"register('law', ...), or a place such as file.py:NAME"
        )
    for file, digest in code_files([name]).items():
        return "file", name, file, digest, law.name, law.title, law.parameters, law.states
    return "named", name


def _law_in_file(place: str, file: str, digest: str, *description: Any) -> Law:
    """Law at a place, or its description if the file is missing."""
    if not Path(file).is_file():
        warn(
            f"{file}: no such file; the result is loaded without its law: histories, criteria and "
            "plots are complete, new simulations are not possible",
            UserWarning,
        )
        return _without_file(file, *description)
    if has_changed(Path(file), digest):
        warn(f"{file} has changed since the result was saved; its law is the new one", UserWarning)
    return LAWS[place]


@lru_cache
def _without_file(file: str, name: str, title: str, parameters: tuple, states: tuple) -> Law:
    """Law that can be described, but not computed."""

    def missing(*_: Any) -> Any:
        raise InputError(f"{file}: no such file; expected: the file of law {name!r}")

    return Law(name, title, parameters, missing, states, missing)


def law_of_recipe(kind: str, *parts: Any) -> Law:
    """Find or rebuild a law from its recipe."""
    makers: dict[str, Callable[..., Law]] = {
        "extended": _extended_law, "passive": _passive_law, "named": LAWS.__getitem__,
        "unit": of_file, "text": law_of_saved, "file": _law_in_file,
    }  # fmt: skip
    return makers[kind](*parts)


def law_of(text: str) -> Law:
    """Load a law from the text of its file, by a copy in the cache folder."""
    module = load_text("law", text)
    return LAWS[f"{module.__file__}:{_LAW}"]


def text_of(law: Law) -> str:
    """Return the text of a law that ``law_of`` has loaded; empty for any other law."""
    file, _, name = LAWS.called(law, "").rpartition(":")
    path = Path(file)
    return path.read_text() if name == _LAW and path.parent == cache_folder().resolve() else ""


def law_of_saved(text: str) -> Law:
    """Load a law from the text in a saved result, if the text contains only its definition."""
    for node in ast.walk(parse(text)):
        if not _describes(node):
            raise InputError(
                f"line {getattr(node, 'lineno', 1)} of a saved law is not valid; "
                "expected: the law in a separate file"
            )
    return law_of(text)


def _describes(node: ast.AST) -> bool:
    """Whether a part of a text is arithmetic or a name of a law's definition."""
    if isinstance(node, ast.Import):
        return all(one.name in _LAW_MODULES for one in node.names)
    if isinstance(node, ast.ImportFrom):
        return node.level == 0 and node.module in _LAW_MODULES
    if isinstance(node, ast.Attribute):
        of_numpy = isinstance(node.value, ast.Name) and node.value.id == "np"
        return node.attr in _LAW_NUMPY if of_numpy else not node.attr.startswith("_")
    if isinstance(node, ast.Call):
        function = node.func
        return isinstance(function, ast.Attribute) or (
            isinstance(function, ast.Name) and function.id in _LAW_CALLS
        )
    return not isinstance(node, ast.With | ast.Try | ast.Raise | ast.ClassDef | ast.Lambda)


def _reduced_law(law: Law) -> tuple:
    try:
        return law_of_recipe, _law_recipe(law)
    except InputError:  # a user's law: by its functions
        return law.__reduce_ex__(2)  # type: ignore[return-value]


copyreg.pickle(Law, _reduced_law)
copyreg.pickle(ExtendedLaw, _reduced_law)
copyreg.pickle(PassiveLaw, _reduced_law)
copyreg.pickle(Effect, lambda one: (effect, (EFFECTS.called(one, one.cause), one.form)))
