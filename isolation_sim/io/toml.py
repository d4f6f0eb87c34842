"""Reading TOML, with errors for users."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from ..errors import InputError


def read_toml(path: Path, accepted: str) -> dict[str, Any]:
    """Read a TOML file."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; expected: {accepted}") from None
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8"
        raise InputError(f"{path}: cannot be read ({reason}); expected: {accepted}") from None
    return parse_toml(text, str(path))


def parse_toml(text: str, source: str = "") -> dict[str, Any]:
    """Read TOML from text."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = f"{source}: " if source else ""
        raise InputError(f"{place}not TOML: {error}; expected: TOML") from None
