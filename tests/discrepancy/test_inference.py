"""Inference and search, the same for every kind of data, against textbook formulas."""

import ast
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2, linregress, t
from scipy.stats import f as f_distribution

from isolation_sim.discrepancy import decisions, inference
from isolation_sim.discrepancy.device.generic_terms import OUTSIDE
from isolation_sim.discrepancy.diagnosis import Cause, Interval
from isolation_sim.discrepancy.search import search


def test_shares_follow_what_the_cost_grows_by():
    assert inference.shares([30.0, 14.0, 8.0], 10.0, 0.6) == pytest.approx([0.5, 0.1, 0.0])
    assert inference.shares([10.0, 9.0], 10.0, 0.6) == [0.3, 0.3]
    failed, other = inference.shares([np.inf, 20.0], 10.0, 1.0)
    assert failed > other > 0 and failed + other == pytest.approx(1.0)


def test_chances_are_those_of_the_distributions():
    assert inference.chi_squared_chance(30.0, 2, 50) == pytest.approx(50 * chi2.sf(30.0, 2))
    assert inference.chi_squared_chance(1.0, 2, 50) == 1.0
    # an F test of three more parameters, 40 residuals' worth of freedom
    ratio = (20.0 - 12.0) / 3 / (12.0 / 40)
    expected = 5 * f_distribution.sf(ratio, 3, 40)
    assert inference.f_chance(20.0, 12.0, 3, 40, 5) == pytest.approx(expected)
    assert inference.f_chance(12.0, 20.0, 3, 40) == 1.0


def test_rivals_are_named_once_and_the_nearest_first():
    others = [("b", 3.0), ("a", 1.0), ("own", 0.0), ("b", 2.0), (OUTSIDE, 0.5), ("far", 9.0)]
    assert inference.rivals("own", others, 5.0) == ("a", "b")


def test_half_widths_are_those_of_a_straight_line():
    rng = np.random.default_rng(0)
    x = np.linspace(0.0, 1e-3, 200)
    y = 5.0 + 2e4 * x + rng.standard_normal(x.size)
    line = linregress(x, y)
    residual = y - line.intercept - line.slope * x
    jacobian = np.column_stack([np.ones_like(x), x])
    half = inference.half_widths(jacobian, float(residual @ residual) / (x.size - 2))
    assert half == pytest.approx([1.96 * line.intercept_stderr, 1.96 * line.stderr])


def test_half_widths_are_no_narrower_than_the_spread_by_noise():
    """Residuals that move together tell as little of a mean as a single one."""
    rng = np.random.default_rng(0)
    noise = np.repeat(rng.standard_normal((20, 1)), 100, axis=1)
    mean = np.ones((100, 1))
    expected = t.ppf(0.975, 19) * noise[:, 0].std(ddof=1)
    assert inference.half_widths(mean, 1.0, noise) == pytest.approx([expected])
    assert inference.half_widths(mean, 1e4, noise) == pytest.approx([19.6])


def test_what_the_data_do_not_determine_has_no_interval():
    rng = np.random.default_rng(0)
    x = rng.standard_normal((300, 3))
    # the second and the third value do the same; the last one's derivative overflows
    jacobian = np.column_stack([x[:, 0], x[:, 1], -2 * x[:, 1], np.full(300, np.inf)])
    half = inference.half_widths(jacobian, 1.0)
    assert half[0] == pytest.approx(1.96 / np.linalg.norm(x[:, 0]), rel=0.05)
    assert np.all(np.isinf(half[1:]))


def test_a_value_at_a_bound_is_distinguished_from_one_near_it():
    for value, lower, upper, expected in (
        (0.5, 0.5, 10.0, True), (10.0, 0.5, 10.0, True), (0.51, 0.5, 10.0, False),
        (0.0, 0.0, np.inf, True), (1e-9, 0.0, np.inf, False), (-3.0, -np.inf, np.inf, False),
    ):  # fmt: skip
        assert inference.at_bound(value, lower, upper) is expected


def test_the_interval_of_a_gain_is_that_of_the_delta_method():
    rng = np.random.default_rng(1)
    before = rng.gamma(50.0, size=400)
    blocks = np.column_stack([before, 0.25 * before * rng.gamma(100.0, 0.01, size=400)])
    low, high = inference.gain_interval(blocks)
    a, b = blocks.mean(axis=0)
    ratio = b / a
    spread = np.std(blocks[:, 1] - ratio * blocks[:, 0]) / a / np.sqrt(len(blocks))
    half = 1.96 * spread / (2 * np.sqrt(ratio))
    assert (low + high) / 2 == pytest.approx(1 - np.sqrt(ratio), abs=0.1 * half)
    assert (high - low) / 2 == pytest.approx(half, rel=0.1)
    assert inference.gain_interval(blocks[:3]) is None


def test_gain_intervals_of_few_blocks_are_as_wide_as_student_s():
    """Of equal errors before the gain is nearly a mean; a plain bootstrap has 60 % of the width."""
    shares = []
    for noise in np.random.default_rng(3).normal(0.0, 0.01, (20, 5)):
        low, high = inference.gain_interval(np.column_stack([np.ones(5), 0.25 + noise]))
        # the root of 0.25 + e is nearly 0.5 + e
        half = t.ppf(0.975, 4) * noise.std(ddof=1) / np.sqrt(5)
        shares.append((high - low) / 2 / half)
    assert 0.85 < np.mean(shares) < 1.05


def test_verdicts():
    known, other = (Cause(name, 0.5, 0.0, {}, "") for name in ("end_stop", OUTSIDE))
    like = replace(known, parameters={"gap": Interval(1.0, 0.5, 1.0, "m", at_bound=True)})
    hum = replace(other, parameters={"frequency": Interval(50.0, 49.9, 50.1, "Hz", False)})
    table = [
        ((), True, False, "adequate"), ((), False, True, "unexplained"),
        ((other,), False, True, "unexplained"), ((hum,), True, False, "explained"),
        ((hum,), False, True, "unexplained"), ((known, hum), False, True, "explained"),
        ((hum, other), False, True, "unexplained"),
        ((known,), False, True, "explained"),
        ((known,), True, False, "partly_explained"),
        ((known, other), False, True, "partly_explained"),
        ((like,), False, True, "partly_explained"),
        ((replace(like, share=0.05),), False, True, "partly_explained"),
        ((known, like), False, True, "partly_explained"),
        ((known, replace(like, share=0.05)), False, True, "explained"),
        ((known, replace(other, share=0.05)), False, True, "partly_explained"),
        ((known, like), False, True, "partly_explained"),
    ]  # fmt: skip
    for causes, adequate, explained, expected in table:
        assert inference.verdict(causes, adequate, explained) == expected


@dataclass(frozen=True)
class Sum:
    """A model of the number 7.2 by the numbers 5, 2 and 1; the rest is what it misses."""

    causes: tuple[str, ...] = ()

    @property
    def rest(self):
        return abs(7.2 - sum(map(int, self.causes)))


class Numbers:
    most_causes = 3

    def is_explained(self, current):
        return current.rest < 0.1

    def candidates(self, current):
        left = [one for one in ("5", "2", "1") if one not in current.causes]
        return sorted((Sum((*current.causes, one)) for one in left), key=lambda s: s.rest)

    def choose(self, current, tried):
        return tried[0] if tried and tried[0].rest < current.rest else None

    def revise(self, taken):
        return taken

    def finish(self, best):
        return Sum(tuple(sorted(best.causes)))


def test_a_search_adds_the_best_until_none_helps():
    result = search(Numbers(), Sum())
    assert result.base == Sum() and result.best.causes == ("2", "5")
    assert [one.taken and one.taken.causes for one in result.rounds] == [("5",), ("5", "2"), None]
    space = Numbers()
    space.most_causes = 1
    assert search(space, Sum()).best.causes == ("5",)


def test_every_constant_that_decides_says_by_what_it_was_chosen():
    body = ast.parse(Path(decisions.__file__).read_text(encoding="utf-8")).body
    grounds = ("Blind", "Theory", "Effort", "Loops", "Convention", "data sheets")
    constants = [pair for pair in pairwise(body) if isinstance(pair[0], ast.Assign)]
    assert len(constants) > 50
    for constant, meaning in constants:
        said = " ".join(ast.literal_eval(meaning.value).split())
        assert any(ground in said for ground in grounds), ast.unparse(constant)
