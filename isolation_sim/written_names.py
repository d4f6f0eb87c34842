"""Names and numbers as texts."""

from __future__ import annotations

import re

_SPELLINGS = {
    "h2": "H2", "lqg": "LQG", "lqr": "LQR", "lyapunov": "Lyapunov", "mpc": "MPC",
    "on off": "on-off",
}  # fmt: skip
_SPECIAL = re.compile(rf"\b({'|'.join(_SPELLINGS)})\b")


def as_written(name: str) -> str:
    """A registered name in words: passive off, clipped LQR, MPC; a place as it is."""
    if re.search(r":\w", name):
        return name
    return _SPECIAL.sub(lambda match: _SPELLINGS[match[0]], name.replace("_", " "))


def number_text(number: float | None) -> str:
    """A number in four digits; large ones without exponent, small ones with it."""
    if number is None:
        return "-"
    small = number != 0 and abs(number) < 0.01
    if 9999.5 <= abs(number) < 1e7:
        return f"{number:.0f}"
    return f"{number:.1e}" if small else f"{number:#.4g}".rstrip(".")


def capital(text: str) -> str:
    """A text with a capital first letter."""
    return f"{text[:1].upper()}{text[1:]}"
