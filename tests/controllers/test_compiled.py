"""The text that a decision is compiled from."""

from collections.abc import Callable

import numpy as np
import pytest

from controllers.compiled import collect
from isolation_sim.errors import InputError


def twice(x: float, rule: Callable) -> float:
    return rule(rule(x))


def shifted(x: float, before: float, rule: Callable, after: float) -> float:
    return twice(x + before, rule) + after


def root(x: float, combined_force: Callable, state_rates: Callable) -> float:
    return shifted(x, 1.0, combined_force, 2.0) + state_rates(x)


def two_sided(x: float, combined_force: Callable, state_rates: Callable) -> float:
    return twice(x, combined_force) + twice(x, state_rates)


def test_functions_given_as_arguments_are_written_in_by_name():
    parts: dict[str, str] = {}
    collect(root, parts, ("combined_force", "state_rates"))
    assert list(parts) == ["twice", "shifted", "root"]
    assert "Callable" not in "".join(parts.values())
    names = {"plain": lambda f: f, "np": np, "combined_force": lambda x: 3 * x,
             "state_rates": lambda x: -x}  # fmt: skip
    exec("\n".join(["from __future__ import annotations", *parts.values()]), names)
    here = root(0.5, names["combined_force"], names["state_rates"])
    assert names["root"](0.5) == here == 9 * 1.5 + 2.0 - 0.5


def test_a_function_cannot_be_given_two_different_ones():
    with pytest.raises(InputError, match="twice cannot be compiled: it is given different"):
        collect(two_sided, {}, ("combined_force", "state_rates"))
