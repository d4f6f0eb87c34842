"""Names of controllers in words."""

from __future__ import annotations

import re

_WRITTEN = {
    "h2": "H2", "lqg": "LQG", "lqr": "LQR", "lyapunov": "Lyapunov", "mpc": "MPC",
    "on off": "on-off",
}  # fmt: skip
_OTHERWISE = re.compile(rf"\b({'|'.join(_WRITTEN)})\b")


def as_written(name: str) -> str:
    """A registered name in words: passive off, clipped LQR, MPC."""
    return _OTHERWISE.sub(lambda match: _WRITTEN[match[0]], name.replace("_", " "))
