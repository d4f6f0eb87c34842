"""Generated modules in the cache folder, named by a digest of all inputs of their text.

The name must change with every input of the module, because a module with this name is used without
a check. The source files are found by following imports, so that none can be forgotten.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import cache, lru_cache
from importlib.metadata import version
from pathlib import Path
from threading import RLock
from types import ModuleType

from ground_motions.files import atomic_write

from ..errors import InputError

COMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")
"""Whether Numba compiles; with ``NUMBA_DISABLE_JIT=1`` all functions run as Python."""
UNUSED_DAYS = 60.0
"""Days without use after which a generated module is removed."""
_PACKAGE = Path(__file__).parents[1]
_PREFIX = "isolation_sim_"
# Threads that fit one law ask for its module at the same time, and only one needs to write it.
# CasADi, which writes the texts, fails in two threads at once.
_LOADING = RLock()
_NAME = re.compile(r"[a-z]+_[0-9a-f]{20}")
# in code and in a writer's strings
_IMPORTS = re.compile(
    r"^[ \t]*(?:from[ \t]+(\.*[\w.]*)[ \t]+import[ \t]+(\([^)]*\)|[^\n#]+)|import[ \t]+([\w., ]+))",
    re.MULTILINE,
)


def cache_folder() -> Path:
    """Folder of the generated modules: ISOLATION_SIM_CACHE, else the user's cache folder."""
    setting = os.environ.get("ISOLATION_SIM_CACHE")
    return _writable(Path(setting) if setting else None, os.environ.get("XDG_CACHE_HOME", ""))


@lru_cache
def _writable(setting: Path | None, cache_home: str) -> Path:
    """The cache folder, or a temporary folder if it can be neither written nor read."""
    folder = setting or (Path(cache_home) if cache_home else _home() / ".cache") / "isolation_sim"
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
    if os.access(folder, os.W_OK | os.X_OK):
        return folder
    if os.access(folder, os.R_OK | os.X_OK) and any(folder.glob("*.py")):
        return folder  # filled earlier, now read-only
    if setting is not None:
        raise InputError(
            f"ISOLATION_SIM_CACHE={setting}: cannot be written; expected: a folder "
            "with write permission"
        )
    user = os.getuid() if hasattr(os, "getuid") else ""
    fallback = Path(tempfile.gettempdir()) / f"isolation_sim-{user}"
    fallback.mkdir(mode=0o700, exist_ok=True)
    if user != "" and fallback.stat().st_uid != user:
        fallback = Path(tempfile.mkdtemp(prefix="isolation_sim-"))
    print(
        f"isolation-sim: {folder} cannot be written; compiled code goes to {fallback} instead; "
        "set ISOLATION_SIM_CACHE to another folder",
        file=sys.stderr,
    )
    return fallback


def _home() -> Path:
    try:
        return Path.home()
    except RuntimeError:  # a user without a home
        return Path("/nonexistent")


def load_text(kind: str, text: str, notice: str = "") -> ModuleType:
    """Load a module by its text; ``notice`` is printed to stderr for a new module."""
    return _load(name_of_text(kind, text), lambda: text, notice)


def load_written(kind: str, content: object, write: Callable[[], str]) -> ModuleType:
    """Load a module by the inputs of its text; the text is written only for a new module."""
    # ``content``: inputs of ``write`` besides source files; equal contents have equal ``repr``.
    # None: they cannot be described, and the module is loaded by its text.
    if content is None:
        with _LOADING:
            return load_text(kind, write())
    return _load(name_of_content(kind, content, write), write)


def in_cache(name: str, function: str = "*") -> bool:
    """Whether a function of a module, or any, is compiled in the cache folder, or need not be."""
    folder = cache_folder() / "__pycache__"
    return not COMPILED or any(folder.glob(f"{name}.{function}-*.nbc"))


def module_name(kind: str, text: str) -> str:
    """Python's name of a module that was loaded by its text."""
    return f"{_PREFIX}{name_of_text(kind, text)}"


def name_of_text(kind: str, text: str) -> str:
    """Name by the text and by the sources of its imports."""
    return _name(kind, [text], sorted(_closure(_package_files(text, None))))


def name_of_content(kind: str, content: object, write: Callable[..., str]) -> str:
    """Name by the content, all sources of its writer, and the version of CasADi."""
    return _name(kind, [repr(content), version("casadi")], sources_of(write))


def sources_of(write: Callable[..., str]) -> tuple[Path, ...]:
    """Source files of a writer: its own file and all files of the package that it imports."""
    return _sources_from(Path(write.__code__.co_filename))


@cache
def _sources_from(path: Path) -> tuple[Path, ...]:
    return tuple(sorted(_closure({path})))


def _name(kind: str, texts: Iterable[str], sources: Iterable[Path]) -> str:
    parts = [hashlib.sha256(text.encode()).digest() for text in texts]
    digest = hashlib.sha256(b"".join([*parts, *map(_digest, sources)]))
    return f"{kind}_{digest.hexdigest()[:20]}"


@cache
def _content(path: Path) -> bytes:
    return path.read_bytes()


@cache
def _digest(path: Path) -> bytes:
    return hashlib.sha256(_content(path)).digest()


def _closure(result: set[Path]) -> set[Path]:
    """These files and all files of the package that they import."""
    waiting = list(result)
    while waiting:
        path = waiting.pop()
        new = _package_files(_content(path).decode(), path)
        waiting += new - result
        result = result | new
    return result


def _package_files(text: str, path: Path | None) -> set[Path]:
    """Files of the package that a text imports; relative names are relative to its path."""
    result = set()
    for origin, members, modules in _IMPORTS.findall(text):
        if modules:
            places = [(name.split(" as ")[0].strip(), "") for name in modules.split(",")]
        else:
            names = (name.split(" as ")[0].strip() for name in members.strip("() \n").split(","))
            places = [(origin, name) for name in names if name]
        for module, member in places:
            folder = _place(module, path)
            if folder is not None:
                result |= set(_files(folder, member))
    return result


def _place(module: str, path: Path | None) -> Path | None:
    """Path of a module of the package, without its suffix."""
    dotted = module.lstrip(".")
    up = len(module) - len(dotted)
    if up == 0:
        first, *rest = dotted.split(".")
        return _PACKAGE.joinpath(*rest) if first == _PACKAGE.name else None
    if path is None or _PACKAGE not in path.parents:
        return None
    return path.parents[up - 1].joinpath(*filter(None, dotted.split(".")))


def _files(module: Path, member: str) -> Iterator[Path]:
    """File of an imported name: a module of that name, otherwise the module that contains it."""
    for stem in (module / member, module) if member else (module,):
        for file in (stem.with_suffix(".py"), stem / "__init__.py"):
            if file.is_file():
                yield file
                return


def _load(name: str, write: Callable[[], str], notice: str = "") -> ModuleType:
    """Import a module from the cache folder; a new one is written first."""
    path = cache_folder() / f"{name}.py"
    with _LOADING:
        if not _mark_used(path):
            if notice:
                print(notice, file=sys.stderr)
            _write(path, write())
            _remove_unused(path.parent)
        try:
            return _import(path)
        except FileNotFoundError:  # another process has just removed it as unused
            _write(path, write())
            return _import(path)


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as unfinished:
        unfinished.write_text(text)


def _import(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"{_PREFIX}{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def _mark_used(path: Path) -> bool:
    """Whether a file exists; its access time is set to now."""
    try:
        # the modification time must not change: Numba would compile again
        os.utime(path, ns=(time.time_ns(), path.stat().st_mtime_ns))
    except FileNotFoundError:
        return False
    except OSError:  # a read-only folder
        return path.exists()
    return True


def _remove_unused(folder: Path) -> None:
    """Remove generated modules without recent use, and their compiled code."""
    oldest = time.time() - 86400 * UNUSED_DAYS
    removed = set()
    for path in folder.glob("*.py"):
        with suppress(OSError):  # another process may remove the same ones
            if _NAME.fullmatch(path.stem) and path.stat().st_atime < oldest:
                path.unlink()
                removed.add(path.stem)
    for path in (folder / "__pycache__").glob("*") if removed else ():
        with suppress(OSError):
            if path.name.split(".")[0] in removed:
                path.unlink()
