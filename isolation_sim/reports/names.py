"""Names of controllers as people write them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..comparison import Comparison

_ACRONYMS = re.compile(r"\b(h2|lqg|lqr|mpc)\b")


def as_written(name: str) -> str:
    """A registered name in words: passive off, clipped LQR, MPC."""
    return _ACRONYMS.sub(lambda found: found[0].upper(), name.replace("_", " "))


def with_written_names(comparison: Comparison) -> Comparison:
    """The same runs, their controllers named in words."""
    from ..comparison import Comparison

    reference = comparison.reference
    result = Comparison(
        {as_written(name): run for name, run in comparison.runs.items()},
        None if reference is None else as_written(reference),
        {as_written(name): error for name, error in comparison.diverged.items()},
        comparison.fixed_base,
    )
    return result if len(result.runs) == len(comparison.runs) else comparison
