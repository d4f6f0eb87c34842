"""Sizes of parameters from the data."""

from __future__ import annotations

import numpy as np
import pytest

from isolation_sim.errors import InputError
from isolation_sim.identification.characteristic_scales import characteristic_scale
from isolation_sim.laws import LAWS

FORCE, LENGTH, TIME = 100.0, 0.002, 0.1


@pytest.mark.parametrize(
    ("unit", "size"),
    [
        ("N", FORCE),
        ("m", LENGTH),
        ("m/s", LENGTH / TIME),
        ("N/m", FORCE / LENGTH),
        ("N s/m", FORCE * TIME / LENGTH),
        ("N/m^3", FORCE / LENGTH**3),
        ("m^2", LENGTH**2),
        ("1/m", 1 / LENGTH),
        ("1/s", 1 / TIME),
        ("N/(m s)", FORCE / LENGTH / TIME),
        ("N/m^1.5", FORCE / LENGTH**1.5),
        ("1/m^n", LENGTH**-2),
        ("kg", FORCE * TIME**2 / LENGTH),
        ("1/J", 1 / (FORCE * LENGTH)),
        ("1", 1.0),
        ("-", 1.0),
    ],
)
def test_units(unit, size):
    assert characteristic_scale(unit, FORCE, LENGTH, TIME) == pytest.approx(size)


def test_every_law_has_units_of_known_size():
    for law in LAWS.values():
        for quantity in law.parameters:
            assert np.isfinite(characteristic_scale(quantity.unit, FORCE, LENGTH, TIME))


@pytest.mark.parametrize("unit", ["rad", "N/V", "N/m**2", "Pa s"])
def test_other_units_are_refused(unit):
    with pytest.raises(InputError, match="is not made of N, m, s, A"):
        characteristic_scale(unit, FORCE, LENGTH, TIME)
