"""Stiffness of 001 by its design, with every reading that the paper leaves open."""

import numpy as np
import pytest

from isolation_sim.errors import InputError
from studies.papers import isolator_design as design
from studies.papers.isolator_design import SHAPE_FACTORS, TABLE_1

T = TABLE_1
PRINTED_R1 = 32.5e-3


def test_eq_5_contradicts_table_1():
    result = design.upper_radius(T["R2"], T["h"], T["h1"], T["alpha"])
    assert result == pytest.approx(32.84e-3, abs=5e-6) and result != pytest.approx(PRINTED_R1)


def test_hardness_solves_eq_4():
    E = 1e6 * (15.75 + 2.15 * 60.0) / (100 - 60.0)
    assert design.hardness_of(E) == pytest.approx(60.0)


@pytest.mark.parametrize("h1", [43.5e-3, 58e-3])
@pytest.mark.parametrize("R1", [None, PRINTED_R1])
@pytest.mark.parametrize("shape_factor", SHAPE_FACTORS)
def test_compression_alone_raised_needs_an_ordinary_rubber(h1, R1, shape_factor):
    R1 = R1 or design.upper_radius(T["R2"], T["h"], h1, T["alpha"])

    def hardness_needed(raises_shear):
        """Stiffness is proportional to E, so the hardness that the paper did not print follows."""
        E = 1e6
        upper = design.upper_stiffness(
            R1, T["R2"], T["R3"], T["h"], h1, T["alpha"], E, E / 3, shape_factor, raises_shear
        )
        whole = upper + design.lower_stiffness(T["R2"], T["R3"], h1, E / 3)
        return design.hardness_of(E * design.PUBLISHED_STIFFNESS / whole)

    assert 45 < hardness_needed(False) < 56 and 4 < hardness_needed(True) < 29


def test_an_unknown_reading_is_refused():
    with pytest.raises(InputError, match="did you mean 'squared'"):
        design.upper_stiffness(*np.ones(8), "square", False)
