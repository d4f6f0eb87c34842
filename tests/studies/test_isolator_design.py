"""Design formulas of 001, with every reading that the paper leaves open."""

import numpy as np
import pytest

from isolation_sim.errors import InputError
from studies.papers import isolator_design as design
from studies.papers.isolator_design import SHAPE_FACTORS, TABLE_1

T = TABLE_1
RUBBER = {name: T[name] for name in ("R2", "R3", "h", "h1", "alpha")}


def test_eq_5_contradicts_table_1():
    result = design.upper_radius(T["R2"], T["h"], T["h1"], T["alpha"])
    assert result == pytest.approx(32.84e-3, abs=5e-6) and T["R1"] == 32.5e-3


def test_moduli_and_back():
    E, G = design.moduli(60.0)
    assert pytest.approx((3.61875e6, 3.61875e6 / 3)) == (E, G)
    assert design.hardness_of(E) == pytest.approx(60.0)
    for bad in (100.0, -1.0, float("nan")):
        with pytest.raises(InputError, match="hardness"):
            design.moduli(bad)


def hardness_needed(**readings):
    """Stiffness is proportional to E, so the hardness that the paper did not print follows."""
    at_60 = design.static_stiffness(**RUBBER | readings, hardness=60.0)
    return design.hardness_of(design.moduli(60.0)[0] * design.PUBLISHED_STIFFNESS / at_60)


@pytest.mark.parametrize("h1", [43.5e-3, 58e-3])
@pytest.mark.parametrize("R1", [None, 32.5e-3])
@pytest.mark.parametrize("shape_factor", SHAPE_FACTORS)
def test_compression_alone_raised_needs_an_ordinary_rubber(h1, R1, shape_factor):
    readings = {"h1": h1, "R1": R1, "shape_factor": shape_factor}
    alone = hardness_needed(**readings, raises_shear=False)
    both = hardness_needed(**readings, raises_shear=True)
    assert 45 < alone < 56 and 4 < both < 29


def test_parts_add():
    E, G = design.moduli(50.0)
    upper = design.upper_stiffness(
        T["R1"], T["R2"], T["R3"], T["h"], T["h1"], T["alpha"], E, G, "times_cos2", False
    )
    lower = design.lower_stiffness(T["R2"], T["R3"], T["h1"], G)
    whole = design.static_stiffness(
        **RUBBER, hardness=50.0, shape_factor="times_cos2", raises_shear=False, R1=T["R1"]
    )
    assert upper + lower == pytest.approx(whole)
    with pytest.raises(InputError, match="did you mean 'squared'"):
        design.static_stiffness(
            **RUBBER, hardness=50.0, shape_factor="square", raises_shear=False, R1=None
        )


def test_damping_force_readings():
    numbers = {"r1": T["r1"], "r2": T["r2"], "w": T["w"], "viscosity": 0.3, "yield_stress": 4e4}
    printed = design.damping_force(
        0.01, l=20e-3, channel_radius=T["r1"], yield_divisor=np.pi, **numbers
    )
    usual = design.damping_force(
        0.01, l=20e-3, channel_radius=T["r2"], yield_divisor=1.0, **numbers
    )
    long = design.damping_force(0.01, l=40e-3, channel_radius=T["r2"], yield_divisor=1.0, **numbers)
    assert long == pytest.approx(2 * usual)
    area = np.pi * (25e-3**2 - 4e-3**2)
    assert design.piston_area(T["r1"], T["r2"]) == pytest.approx(area)
    viscous = 12 * 0.3 * 20e-3 * area**2 / (2 * np.pi * 25e-3 * 1e-9) * 0.01
    assert usual == pytest.approx(viscous + 3 * 20e-3 * area * 4e4 / 1e-3)
    assert printed == pytest.approx(viscous * 25 / 4 + (usual - viscous) / np.pi)
    both = design.damping_force(
        np.array([-0.01, 0.0]), l=20e-3, channel_radius=T["r2"], yield_divisor=1.0, **numbers
    )
    np.testing.assert_allclose(both, [-usual, 0.0])


def test_magnetic_circuit_and_rod():
    mu = 4e-7 * np.pi
    across = design.magnetomotive_force(0.6, 2 * T["w"], 5 * mu)
    along = design.magnetomotive_force(0.6, T["l"], 5 * mu)
    assert across == pytest.approx(191, abs=0.5) and along == pytest.approx(10 * across)
    assert design.smallest_flux_area(0.6, 1e-3, 1.5) == pytest.approx(4e-4)
    radius = design.smallest_rod_radius(8050.0, 2e8)
    assert np.pi * radius**2 * 2e8 == pytest.approx(8050.0)
