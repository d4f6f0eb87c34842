"""Seeded lists of building records: what is hidden, in which form, at which size.

The seed also draws the building, the ground motion, the storey and the sensor.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .buildings import Fault, Record, faults, make_record, outside_faults

SIZES = (0.03, 0.1)
"""Misfits that single faults make, at 1 % noise in each channel and in the ground motion."""
MEMBER_SIZE = 0.06
"""Misfit that each fault of a pair makes alone."""


@dataclass(frozen=True)
class BuildingCase:
    """One blind case; ``kind`` is clean, single, pair or outside, ``forms`` are (name, form)."""

    kind: str
    seed: int
    forms: tuple[tuple[str, str], ...] = ()
    size: float = 0.0

    @property
    def label(self) -> str:
        """Unique in its list."""
        hidden = "+".join(".".join(one) for one in self.forms) or "nothing"
        return f"{self.kind}-{hidden}-{self.size:g}-{self.seed}"

    @cached_property
    def faults(self) -> tuple[Fault, ...]:
        """What is hidden."""
        every = [*faults(self.seed), *outside_faults()]
        known = {(fault.name, fault.form): fault for fault in every}
        return tuple(known[one] for one in self.forms)

    @cached_property
    def record(self) -> Record:
        """The data, and the building that the engineer knows."""
        return make_record(self.seed, self.faults, self.size)


def all_forms() -> list[tuple[str, str]]:
    """Name and form of every fault."""
    return [(fault.name, fault.form) for fault in faults(0)]


def singles(sizes: Sequence[float] = SIZES, seed: int = 20_000) -> Iterator[BuildingCase]:
    """Each fault, each form, each size, each with its own seed."""
    for number, form in enumerate(all_forms()):
        for k, size in enumerate(sizes):
            yield BuildingCase("single", seed + len(sizes) * number + k, (form,), size)


def pairs(count: int, seed: int = 21_000) -> Iterator[BuildingCase]:
    """Random pairs of faults with different names."""
    rng = np.random.default_rng(seed)
    forms = all_forms()
    names = sorted({name for name, _ in forms})
    for number in range(count):
        drawn = [
            forms[rng.choice([k for k, (other, _) in enumerate(forms) if other == name])]
            for name in rng.permutation(names)[:2]
        ]
        yield BuildingCase("pair", seed + number, tuple(drawn), MEMBER_SIZE)


def clean(count: int, seed: int = 22_000) -> Iterator[BuildingCase]:
    """Nothing hidden."""
    for number in range(count):
        yield BuildingCase("clean", seed + number)


def outside(sizes: Sequence[float] = SIZES, seed: int = 23_000) -> Iterator[BuildingCase]:
    """Forces of the isolators that no cause describes, each at each size with its own seed."""
    forms = [(fault.name, fault.form) for fault in outside_faults()]
    for number, form in enumerate(forms):
        for k, size in enumerate(sizes):
            yield BuildingCase("outside", seed + len(sizes) * number + k, (form,), size)
