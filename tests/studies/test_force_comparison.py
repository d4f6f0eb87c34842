"""Comparison of two force series: known values, and what each cannot see."""

import numpy as np
import pytest

from isolation_sim.errors import InputError
from studies.force_comparison import (
    correlation,
    fitness,
    half_range_error,
    normalised_rms,
    rms_error,
    squared_force_error,
)

F = 100 * np.sin(np.linspace(0, 20 * np.pi, 4001))
ALL = (correlation, fitness, half_range_error, normalised_rms, rms_error, squared_force_error)


def test_perfect():
    assert [measure(F, F) for measure in ALL] == pytest.approx([1, 100, 0, 0, 0, 0])


def test_known_values():
    assert rms_error(F, F + 3) == pytest.approx(3)
    assert normalised_rms(F, 0.9 * F) == pytest.approx(0.1, rel=1e-3)
    assert fitness(F, 0.9 * F) == pytest.approx(90, abs=0.01)
    assert fitness(F, np.full_like(F, F.mean())) == pytest.approx(0, abs=1e-9)
    assert squared_force_error(F, 0 * F, 0.5) == pytest.approx(0.5 * 5000 * 4000, rel=1e-3)


def test_half_range():
    # Tao et al., Eq 24, term by term: an asymmetric force of mean 40 N and range 200 N
    shifted = F + 40
    terms = [((a - b) / ((140 - -60) / 2)) ** 2 for a, b in zip(shifted, F, strict=True)]
    assert half_range_error(shifted, F) == pytest.approx((sum(terms) / len(terms)) ** 0.5)
    assert half_range_error(shifted, F) == pytest.approx(0.4)
    ratio = half_range_error(F, 0.9 * F) / normalised_rms(F, 0.9 * F)
    assert ratio == pytest.approx(0.5**0.5, rel=1e-3)


def test_what_each_cannot_see():
    assert correlation(F, 2 * F + 50) == pytest.approx(1)
    assert squared_force_error(F, -F) == 0  # the defect of Eq 16
    assert correlation(F, -F) == pytest.approx(-1)
    assert fitness(F, -F) == pytest.approx(-100)


@pytest.mark.parametrize("measure", ALL)
def test_refused(measure):
    for a, b in ((F, F[1:]), ([], []), (F, np.where(F > 99, np.nan, F))):
        with pytest.raises(InputError, match="expected"):
            measure(a, b)


@pytest.mark.parametrize("measure", [correlation, fitness, half_range_error, normalised_rms])
def test_a_constant_force_has_no_spread(measure):
    with pytest.raises(InputError, match="constant"):
        measure(np.ones(9), np.arange(9.0))
