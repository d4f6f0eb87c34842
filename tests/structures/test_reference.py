"""The reference building, and the rules behind its numbers."""

import numpy as np
import pytest

from isolation_sim.laws import law
from isolation_sim.structures import reference_building, reference_isolators
from isolation_sim.structures.reference import FORCE_SCALE


def test_matrices_of_the_engine_reference(shared_data):
    expected = np.load(shared_data / "engine_reference" / "building.npz")
    building = reference_building()
    for key, field in (("M", "mass"), ("C", "damping"), ("K", "stiffness")):
        error = np.abs(getattr(building, field) - expected[key]).max()
        assert error <= 1e-12 * np.abs(expected[key]).max()
    isolators = reference_isolators()
    assert isolators.length == expected["length_scale"]
    assert isolators.force_scale == pytest.approx(float(expected["force_scale"]), rel=1e-15)


def test_rules():
    building = reference_building()
    assert building.total_mass == 1.55e6
    assert building.stiffness[0, 0] == pytest.approx(4.87303329e8, rel=1e-8)
    frequencies, shapes = building.fixed_base_modes()
    assert 2 * np.pi / frequencies[0] == pytest.approx(0.5, rel=1e-13)
    ratios = np.diag(shapes.T @ building.damping @ shapes) / (2 * frequencies)
    assert ratios[[0, 2]] == pytest.approx([0.02, 0.02], rel=1e-12)


def test_force_scale_gives_the_whole_mass_two_seconds_at_1_5_ampere():
    storage = law("strain_stiffening").linearised(1.5, 0.5).real
    assert 1.55e6 * np.pi**2 * 10 / storage == pytest.approx(FORCE_SCALE, rel=1e-14)
    isolated = reference_building().on(reference_isolators())
    layer = isolated.linearised(1.5, 0.5).stiffness - isolated.structure.stiffness
    assert 2 * np.pi * np.sqrt(1.55e6 / layer[0, 0]) == pytest.approx(2.0, rel=1e-9)


def test_other_devices_keep_the_scale():
    isolators = reference_isolators(law("hybrid"))
    assert (isolators.law.name, isolators.length) == ("hybrid", 10.0)
    assert isolators.force_scale == FORCE_SCALE
