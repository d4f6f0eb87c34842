"""A part of a scenario in C, with the data for a co-simulation interface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Part:
    """C sources that are stepped through ``NAME_init``, ``NAME_step`` and ``NAME_observe``."""

    name: str  # Name, a C identifier
    title: str  # Description, for comments
    files: dict[str, str]  # C sources by name
    # inputs, outputs: Names with units, in the order of the sources' arrays
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    period: float  # Usual length of a step, s
    sampled: bool = False  # Whether it is a controller, which decides at multiples of its period


def numbers(values: np.ndarray) -> str:
    """Numbers as C text, a few per line; a zero if there are none, since C has no empty array."""
    texts = [repr(v).replace("inf", "INFINITY").replace("nan", "NAN") for v in values.tolist()]
    rows = [", ".join(texts[k : k + 4]) for k in range(0, len(texts), 4)]
    return ",\n    ".join(rows) or "0"
