"""Names of controllers in words."""

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
