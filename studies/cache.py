"""Cache of results that take minutes, valid while their sources stay the same."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import controllers
import isolation_sim
from ground_motions.files import atomic_write
from isolation_sim.compilation.generated import cache_folder


def cached_result(name: str, content: bytes, find: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Return a stored result, or compute and store it."""
    digest = hashlib.sha256(_sources() + content).hexdigest()[:32]
    path = cache_folder() / name / f"{digest}.json"
    try:
        result: dict[str, Any] = json.loads(path.read_text())
    except (OSError, ValueError):
        result = find()
        _write(path, json.dumps(result))
    return result


def _write(path: Path, text: str) -> None:
    with suppress(OSError):  # a full or read-only disk costs the time, not the result
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as unfinished:
            unfinished.write_text(text)


@lru_cache(maxsize=1)
def _sources() -> bytes:
    """Digest of whatever is installed that a simulation or an optimum can depend on."""
    digest = hashlib.sha256()
    for name in ("casadi", "numpy", "scipy"):
        digest.update(version(name).encode())
    for package in (isolation_sim, controllers):
        for path in sorted(Path(package.__path__[0]).rglob("*.py")):
            digest.update(path.read_bytes())
    digest.update(Path(__file__).with_name("controller_runs.py").read_bytes())
    return digest.digest()
