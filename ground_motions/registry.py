"""Registry of laws, effects, controllers, studies and readers by name.

A name is an entry point of an installed package, of this project or a user's; or was given to
``register``; or is itself a place, ``"my_laws.py:CUBIC"``, ``"my_package.laws:CUBIC"`` or, of a
controller, ``"my.fmu"``.
A thing is loaded when it is first asked for. A file is run only when it is named with its path.
"""

from __future__ import annotations

import hashlib
import re
import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from glob import escape
from importlib import import_module
from importlib.metadata import distributions, entry_points
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, TypeVar

from ground_motions.argument_types import shown
from ground_motions.errors import InputError, unknown_name

T = TypeVar("T")

PROJECT = "isolation-sim"
PACKAGES = ("ground_motions", "isolation_sim", "controllers", "studies")
"""The project's packages, all in one folder."""
UNIT = ".fmu"
_CHECKOUT = Path(__file__).resolve().parents[1]
_SHORT = 12  # Digits of a digest in the name of a copied file
_DIGEST = rf"_[0-9a-f]{{{_SHORT}}}$"
_NEIGHBOUR = r'absolute_place\("([^":/]+\.py)[":]'
_files: dict[Path, tuple[str, ModuleType]] = {}


@dataclass(frozen=True)
class _Entry:
    """Where a registered thing is, and who says so."""

    place: str
    package: str


class Registry(Mapping[str, T]):
    """Objects of one kind by name; a mapping that loads them on first use.

    The names of the mapping are the registered ones. ``registry[name]`` also takes a place,
    ``"file.py:NAME"`` or ``"package.module:NAME"``.

    Parameters
    ----------
    group : str
        Name of the entry points' group, such as ``"isolation_sim.laws"``.
    kind : str
        The kind in the singular, for errors.
    accepted : str
        Words for a usable thing, for errors.
    usable : callable
        ``usable(loaded)`` -> the thing to keep, or None if it cannot be used.
    own_name : callable, optional
        ``own_name(thing)`` -> the name that it gives itself; it must be the registered one.
    unit : str, optional
        Place of a function that makes a thing of a functional mock-up unit, ``"my.fmu"``; without
        it a unit cannot be such a thing.
    """

    def __init__(
        self,
        group: str,
        kind: str,
        accepted: str,
        usable: Callable[[Any], T | None],
        own_name: Callable[[T], str] | None = None,
        unit: str = "",
    ) -> None:
        self.group, self.kind, self.accepted = group, kind, accepted
        self._usable, self._own_name, self._unit = usable, own_name, unit
        self._registered: dict[str, T] = {}
        self._loaded: dict[str, T] = {}

    def __iter__(self) -> Iterator[str]:
        yield from self._entries
        yield from self._registered

    def __len__(self) -> int:
        return len(self._entries) + len(self._registered)

    def __contains__(self, name: object) -> bool:
        return name in self._entries or name in self._registered

    def __getitem__(self, name: str) -> T:
        if not isinstance(name, str):
            raise InputError(self.kind, repr(name), "a name, or a place such as file.py:NAME")
        if name in self._registered:
            return self._registered[name]
        if is_place(name):
            return self._at(name)
        if name not in self._loaded:
            self._loaded[name] = self._from_package(name)
        return self._loaded[name]

    def get(self, name: str, default: Any = None) -> Any:
        """Return a registered thing, or the default; a place is not looked up."""
        return self[name] if name in self else default

    def register(self, thing: Any, name: str | None = None, *, replace: bool = False) -> None:
        """Give a thing a name in this process."""
        part = self._checked(thing, self.kind)
        own = self._own_name(part) if self._own_name else None
        name = name or own
        if not name or is_place(name) or own not in (None, name):
            raise InputError(
                f"{self.kind} {own or thing!r} cannot be registered as {name!r}; expected: "
                f"{'its own name' if own else 'a name without colon'}"
            )
        if name in self._entries:
            raise self._ambiguous(name, "register()", *self._entries[name])
        if name in self._registered and not replace:
            raise InputError(
                f"{self.kind} {name!r} is registered already in this process; expected: another "
                "name, or replace=True"
            )
        self._registered[name] = part

    def called(self, thing: object, default: str) -> str:
        """Return the name or place under which a thing was found."""
        for name, known in {**self._loaded, **self._registered}.items():
            if known is thing or (isinstance(known, tuple) and thing in known):
                return name
        return default

    def place(self, name: str) -> str:
        """Return where a thing is, without loading it."""
        if is_place(name):
            return name
        return "" if name in self._registered else self._entry(name).place

    def only_here(self) -> tuple[str, ...]:
        """Names that were registered in this process, which no other process knows."""
        return tuple(self._registered)

    @cached_property
    def _entries(self) -> dict[str, tuple[_Entry, ...]]:
        """Entry points by name: the project's first, then those of other packages."""
        own = checkout_entries().get(self.group)
        result = [(name, _Entry(place, PROJECT)) for name, place in (own or {}).items()]
        for point in entry_points(group=self.group):
            package = point.dist.name if point.dist else "unknown"
            if package != PROJECT or own is None:
                result.append((point.name, _Entry(point.value, package)))
        result.sort(key=lambda each: (each[1].package != PROJECT, each[1].package, each[0]))
        entries: dict[str, tuple[_Entry, ...]] = {}
        for name, entry in result:
            entries[name] = (*entries.get(name, ()), entry)
        return entries

    def _entry(self, name: str) -> _Entry:
        if name not in self._entries:
            if not any(e.package == PROJECT for each in self._entries.values() for e in each):
                raise InputError(
                    f"unknown {self.kind} {name!r}: {PROJECT} is not installed, so that its own "
                    f"entry points {self.group} are not found; expected: pip install "
                    f"{_CHECKOUT}"
                )
            raise unknown_name(self.kind, name, self)
        first, *others = self._entries[name]
        if others:
            raise self._ambiguous(name, first.package, *others)
        return first

    def _ambiguous(self, name: str, one: str, *others: _Entry) -> InputError:
        packages = " and ".join([one, *(entry.package for entry in others)])
        return InputError(
            f"{self.kind} {name!r} is given by {packages}; expected: one of them, or "
            f"another name in one's entry points {self.group}"
        )

    def _from_package(self, name: str) -> T:
        entry = self._entry(name)
        label = f"{self.kind} {name!r} of package {entry.package} ({entry.place})"
        thing = self._checked(_import_place(entry.place, label), label)
        own = self._own_name(thing) if self._own_name else name
        if own != name:
            raise InputError(f"{label} calls itself {own!r}; expected: one name in both places")
        return thing

    def _at(self, place: str) -> T:
        """Object at a place; a file that has changed is loaded again."""
        label = f"{self.kind} {place!r}"
        place = absolute_place(place)
        file, name = _split(place)
        if file and file.suffix == UNIT:
            if not self._unit:
                raise InputError(f"{label} is a functional mock-up unit; expected: {self.accepted}")
            loaded = _import_place(self._unit, label)(file)
        else:
            loaded = _from_file(file, name, label) if file else _import_place(place, label)
        thing = self._checked(loaded, label)
        # equal things stay one: a tuple may have been put around the same effect anew
        if self._loaded.get(place) != thing:
            self._loaded[place] = thing
        return self._loaded[place]

    def _checked(self, loaded: Any, label: str) -> T:
        thing = self._usable(loaded)
        if thing is None:
            raise InputError(label, shown(loaded), self.accepted)
        return thing


def is_place(name: str) -> bool:
    """Whether a name says itself where the thing is."""
    return ":" in name or name.endswith((".py", UNIT))


def absolute_place(name: str, folder: str | Path = ".") -> str:
    """Make the path in a place absolute, so that another process finds the same file."""
    file, inside = _split(name)
    if file is None:
        return name
    path = (Path(folder) / file.expanduser()).resolve()
    return f"{path}:{inside}" if inside else str(path)


def code_files(names: Iterable[str]) -> dict[str, str]:
    """Return the files of code that places name, with a digest of their loaded text."""
    result = {}
    for name in names:
        file, _ = _split(absolute_place(name))
        if file in _files:
            result[str(file)] = _files[file][0]
        elif file is not None:
            there = file.is_file()
            result[str(file)] = _digest(file.read_bytes()) if there else "not found"
    return result


def package_code(names: Iterable[str]) -> dict[str, str]:
    """Return the further packages whose parts are named, with a digest of their Python files."""
    # an entry point's value, or the name itself if it is a place in a module
    others = {
        point.name: point.value
        for package in distributions()
        for point in package.entry_points
        if point.group.partition(".")[0] in PACKAGES and package.name != PROJECT
    }
    places = (others.get(name, name if ":" in name else "") for name in names)
    tops = {place.partition(":")[0].partition(".")[0] for place in places if not _split(place)[0]}
    result = {}
    for top in sorted(tops - {"", *PACKAGES}):
        spec = find_spec(top)
        folders = list(spec.submodule_search_locations or []) if spec else []
        files = [file for folder in folders for file in sorted(Path(folder).rglob("*.py"))]
        if not files and spec and spec.origin:
            files = [Path(spec.origin)]
        digests = "".join(_digest(file.read_bytes()) for file in files if file.is_file())
        result[f"package {top}"] = _digest(digests.encode())
    return result


def copy_code(names: Iterable[str], folder: Path) -> dict[str, str]:
    """Copy files of code that places name into a folder; return each such place in the folder.

    A copy's name has the digest of its text. What a file calls by ``absolute_place`` from beside
    it is copied with it. A file that has changed since it was loaded is left where it is.
    """
    result = {}
    for name in names:
        file, inside = _split(absolute_place(name))
        if file is None or file.suffix != ".py" or file not in _files:
            continue
        digest = _files[file][0]
        if not has_changed(file, digest) and file.is_file():
            copy = f"{re.sub(_DIGEST, '', file.stem)}_{digest[:_SHORT]}.py"
            _copy_with_neighbours(file, folder / copy)
            result[name] = f"{copy}:{inside}" if inside else copy
    return result


def copied_place(place: str, folder: Path) -> str:
    """Return a place, or where its file is gone that of its only copy in a folder."""
    file, inside = _split(absolute_place(place))
    if file is None or file.is_file():
        return place
    copies = list(folder.glob(f"{escape(file.stem)}_{'[0-9a-f]' * _SHORT}.py"))
    if len(copies) != 1:
        return place
    return f"{copies[0]}:{inside}" if inside else str(copies[0])


def _copy_with_neighbours(file: Path, copy: Path) -> None:
    text = file.read_bytes()
    copy.write_bytes(text)
    for name in re.findall(_NEIGHBOUR, text.decode()):
        neighbour = file.with_name(name)
        if neighbour.is_file() and not copy.with_name(name).exists():
            _copy_with_neighbours(neighbour, copy.with_name(name))


def has_changed(file: Path, digest: str) -> bool:
    """Whether a file is another than that of a digest; a missing file is not."""
    return file.is_file() and _digest(file.read_bytes()) != digest


@cache
def checkout_entries() -> dict[str, dict[str, str]]:
    """Entry points of a checkout that runs in place, where the installed ones may be older."""
    try:
        project = tomllib.loads((_CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))
    except OSError:
        return {}
    described = project.get("project", {})
    return described.get("entry-points", {}) if described.get("name") == PROJECT else {}


def _split(name: str) -> tuple[Path | None, str]:
    """File and name inside it; no file where the place is a module's or none at all."""
    if name.endswith((".py", UNIT)):
        return Path(name), ""
    file, _, inside = name.rpartition(":")
    return (Path(file), inside) if file.endswith(".py") else (None, inside)


def _import_place(place: str, label: str) -> Any:
    module, _, inside = place.partition(":")
    check_not_hidden(module.partition(".")[0])
    try:
        loaded = import_module(module)
    except Exception as error:
        raise _not_loaded(label, error) from error
    return _inside(loaded, inside, label)


def check_not_hidden(package: str) -> None:
    """Refuse to go on where a user's file or folder hides a package of the project."""
    if package not in PACKAGES:
        return
    module = sys.modules.get(package)
    origin = getattr(module, "__file__", None) if module else None
    if origin is None and (spec := find_spec(package)) is not None:
        origin = spec.origin
    if origin and Path(origin).resolve().parent.parent != _CHECKOUT:
        file = Path(origin)
        what = file.parent if file.name == "__init__.py" else file
        raise InputError(
            f"{what} hides the package {package!r} of {PROJECT}; expected: another name for it"
        )


def hides_packages(folder: str) -> bool:
    """Whether a folder on Python's path holds something named like a package of the project."""
    place = Path(folder or ".").resolve()
    files = (file for name in PACKAGES for file in (f"{name}.py", f"{name}/__init__.py"))
    return place != _CHECKOUT and any((place / file).is_file() for file in files)


def _from_file(file: Path, inside: str, label: str) -> Any:
    try:
        loaded = _file_module(file)
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"{label}: cannot be read ({reason}); expected: file.py:NAME") from None
    except Exception as error:
        raise _not_loaded(label, error) from error
    return _inside(loaded, inside, label)


def _file_module(file: Path) -> ModuleType:
    """Run a file as a module, once as long as it stays the same; nothing is written beside it."""
    source = file.read_bytes()
    digest = _digest(source)
    if file in _files and _files[file][0] == digest:
        return _files[file][1]
    module = ModuleType(f"{file.stem}_{digest[:16]}", f"Loaded from {file}.")
    module.__file__ = str(file)
    sys.modules[module.__name__] = module
    try:
        exec(compile(source, str(file), "exec"), module.__dict__)
    except BaseException:
        del sys.modules[module.__name__]
        raise
    _files[file] = digest, module
    return module


def _digest(source: bytes) -> str:
    return hashlib.sha256(source).hexdigest()


def _inside(module: ModuleType, name: str, label: str) -> Any:
    thing: Any = module
    for part in name.split(".") if name else ():
        if not hasattr(thing, part):
            own = [
                each
                for each, value in vars(thing).items()
                if not each.startswith("_") and not _is_imported(value, module)
            ]
            raise unknown_name(f"name in {label}:", part, own)
        thing = getattr(thing, part)
    return thing


def _is_imported(value: Any, module: ModuleType) -> bool:
    """Whether a value in a file is a module, or a class or function of another one."""
    if isinstance(value, ModuleType):
        return True
    return isinstance(value, type | FunctionType) and value.__module__ != module.__name__


def _not_loaded(label: str, error: Exception) -> InputError:
    words = " ".join(str(error).split())
    return InputError(f"{label} cannot be loaded: {type(error).__name__}: {words}")
