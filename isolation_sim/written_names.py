"""Names of controllers as people write them."""

from __future__ import annotations

import re

_ACRONYMS = re.compile(r"\b(h2|lqg|lqr|mpc)\b")


def as_written(name: str) -> str:
    """A registered name in words: passive off, clipped LQR, MPC."""
    return _ACRONYMS.sub(lambda found: found[0].upper(), name.replace("_", " "))
