"""Fuzzy rules."""

from collections import namedtuple

import numpy as np
import pytest

from controllers import controller
from controllers.fuzzy import RULES, share
from isolation_sim.structures import reference_building, reference_isolators

from .conftest import both_forms, context_of

MEASUREMENT = namedtuple("Measurement", "x v coil")


def triangle(value, centre, half_width):
    return max(0.0, 1 - abs(value - centre) / half_width)


@pytest.mark.parametrize("seed", range(20))
def test_is_the_weighted_mean_of_the_rules(seed):
    """Against memberships and rules written out."""
    rng = np.random.default_rng(seed)
    x, v = rng.uniform(0, 1.3), rng.uniform(-1.3, 1.3)
    total = weights = 0.0
    for i, row in enumerate(RULES):
        for j, current in enumerate(row):
            weight = triangle(min(x, 1.0), i / 2, 0.5)
            weight *= triangle(np.clip(v, -1, 1), j / 2 - 1, 0.5)
            total, weights = total + weight * current, weights + weight
    assert share(x, v) == pytest.approx(total / weights, abs=1e-12)


def test_both_sides_are_alike_and_turning_round_is_soft(isolated):
    one = controller("fuzzy", large_deformation=0.1, fast=0.3)
    one.reset(context_of(one, isolated))

    def current(x, v):
        return one.current(0.0, MEASUREMENT(x, v, 0.0))[0]

    assert current(0.0, 0.3) == current(0.05, 0.3) == 3
    assert current(0.05, -0.3) == current(0.1, 0.3) == current(0.07, 0.0) == 0
    for x, v in np.random.default_rng(0).uniform(-0.2, 0.2, (30, 2)):
        assert current(x, v) == current(-x, -v)
        assert 0 <= current(x, v) <= 3
    # through the centre without a jump
    assert current(1e-9, 0.2) == pytest.approx(current(-1e-9, 0.2), abs=1e-6)


def test_a_coil_takes_what_its_elements_ask_for_most():
    device = reference_isolators().scaled(force=1 / 3)
    nominal = reference_building().with_element(device, "base", 0, "a")
    nominal = nominal.with_element(device, "base", 1, "b").with_element(device, "base", 0, "c")
    one = controller("fuzzy")
    rng = np.random.default_rng(0)
    inputs = np.hstack([rng.uniform(-0.2, 0.2, (40, 6)), np.zeros((40, 2))])
    plain, fast = both_forms(one, context_of(one, nominal), inputs)
    assert np.array_equal(plain, fast)
    alone = [
        [3 * share(abs(x) / one.large_deformation, np.sign(x) * v / one.fast)
         for x, v in row[:6].reshape(3, 2)]
        for row in inputs
    ]  # fmt: skip
    a, b, c = np.array(alone).T
    assert np.allclose(plain, np.column_stack([np.maximum(a, c), b]), atol=1e-12)
