"""A part of a scenario in C, with the data that a co-simulation interface needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Part:
    """C sources that are stepped through ``NAME_init``, ``NAME_step`` and ``NAME_observe``.

    Attributes
    ----------
    name : str
        As an identifier of C.
    title : str
        Short description for comments.
    files : dict of str to str
        C sources by name.
    inputs, outputs : tuple of str
        Names with units, in the order of the arrays that the sources take.
    period : float
        Usual length of a step, s.
    sampled : bool
        Whether it is a controller, which decides at the multiples of its period.
    """

    name: str
    title: str
    files: dict[str, str]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    period: float
    sampled: bool = False


def numbers(values: np.ndarray) -> str:
    """Numbers as C text, a few a line; a zero where there are none, for C has no empty array."""
    texts = [repr(v).replace("inf", "INFINITY").replace("nan", "NAN") for v in values.tolist()]
    rows = [", ".join(texts[k : k + 4]) for k in range(0, len(texts), 4)]
    return ",\n    ".join(rows) or "0"
