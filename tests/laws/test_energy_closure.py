"""In motion, what is put into laws with a stored energy is stored or dissipated."""

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.structures import Element, IsolatedStructure

# each alone, with more about each, in tests/simulation/test_ledger.py
ELSEWHERE = {"strain_stiffening", "hybrid", "linear", "kelvin_voigt"}


@pytest.fixture(scope="module")
def run(devices):
    """Every other storing law side by side under one building: one kernel for all of them."""
    building = iso.reference_building()
    stiffness = abs(iso.reference_isolators().linearised(1.5, 0.5))
    one_a_law = {
        d.law.name: d
        for d in reversed(list(devices.values()))
        if d.stores_energy and d.law.name not in ELSEWHERE
    }
    row = building.on(iso.reference_isolators()).elements[0].direction
    elements = []
    for name, device in one_a_law.items():
        device = device.scaled(length=0.3 / device.deformation_scale)
        size = abs(device.linearised(1.5, 0.5)) * len(one_a_law)
        channel = 0 if device.depends_on_current else None
        elements.append(Element(device.scaled(force=stiffness / size), row, channel, name))
    plant = IsolatedStructure(building, tuple(elements))
    return iso.simulate(plant, el_centro_1940(), "passive_on")


def test_energy_closes(run):
    energy = run.energy
    assert energy.closure_error < 1e-6
    assert energy.device_dissipation_J[-1] > 0.5 * energy.input_J[-1] > 0


def test_dissipation_never_falls(run):
    energy = run.energy
    assert np.min(np.diff(energy.device_dissipation_J)) > -1e-6 * np.max(energy.input_J)
