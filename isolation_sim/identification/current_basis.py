"""Polynomials of the current in Bernstein's form, over the currents of a campaign."""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .campaign import Campaign
from .measured.run_table import TestRun

STEADY = 0.02
"""Standard deviation of a run's current, and difference of two, over the largest one, up to which
a current is steady and two are one."""


def tested_currents(currents: Sequence[NDArray]) -> NDArray:
    """Currents of some runs, increasing, A; nominal ones where every run keeps its own to noise."""
    seen = np.unique(np.round(np.concatenate([np.unique(current) for current in currents]), 6))
    noise = max(float(np.std(current)) for current in currents)
    same = STEADY * float(np.max(np.abs(seen)))
    if not 1e-6 < noise < same:
        return seen
    levels = group_currents([float(np.mean(current)) for current in currents], same)
    # a step of this decimal is not above the noise
    decimal = -int(np.floor(np.log10(noise)))
    return np.unique([round(float(np.mean(level)), decimal) + 0.0 for level in levels])


def group_currents(means: Sequence[float], same: float) -> list[NDArray]:
    """Mean currents of runs, increasing, those that differ by no more than ``same`` together."""
    ordered = np.sort(means)
    return np.split(ordered, np.flatnonzero(np.diff(ordered) > same) + 1)


def currents_of(campaign: Campaign, runs: Sequence[TestRun], degree: int | None) -> NDArray:
    """Choose the currents at which polynomials are reported, one per coefficient."""
    seen = tested_currents([run.current for run in runs])
    if degree is None:
        degree = min(len(seen) - 1, 2)
    check_degree(campaign.name, "runs", degree, seen)
    if degree + 1 == len(seen):
        return seen
    return np.linspace(seen[0], seen[-1], degree + 1) if degree else np.array([seen.mean()])


def check_degree(name: str, data: str, degree: int, seen: NDArray) -> None:
    """Refuse a degree that the currents seen in the fitted data do not determine."""
    if degree < 0:
        raise InputError("current degree", f"{degree}", "0 or more")
    if degree >= len(seen):
        raise InputError(
            f"{name}: polynomials of degree {degree} in the current need {degree + 1} "
            f"currents; the fitted {data} have {len(seen)} ({seen.min():g} to {seen.max():g} A)"
        )


def bernstein(currents: NDArray, span: tuple[float, float]) -> NDArray:
    """Evaluate the Bernstein polynomials of a range of the current at some currents, one each."""
    degree = len(currents) - 1
    if degree == 0:
        return np.ones((1, 1))
    t = (currents - span[0]) / (span[1] - span[0])
    columns = [comb(degree, k) * t**k * (1 - t) ** (degree - k) for k in range(degree + 1)]
    return np.stack(columns, axis=1)
