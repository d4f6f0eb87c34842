"""Runs to draw."""

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940


@pytest.fixture(scope="session")
def ground():
    return el_centro_1940().cut(0, 8)


@pytest.fixture(scope="session")
def runs(ground):
    isolated = iso.reference_building().on(iso.reference_isolators())
    return {
        name: iso.simulate(isolated, ground, name)
        for name in ("passive_off", "passive_on", "on_off")
    }


@pytest.fixture(scope="session")
def seven(runs):
    """As many controllers as a comparison may show, some with long names."""
    names = ["passive_off", "passive_on", "best_constant", "clipped_lqr", "sliding_mode",
             "model_predictive_control", "clairvoyant"]
    given = list(runs.values())
    return {name: given[k % 3] for k, name in enumerate(names)}


@pytest.fixture(scope="session")
def passive_biaxial(ground):
    """Building that moves in x, y and rotation, on isolators without coils."""
    mass = np.diag([2e5, 2e5, 5e6])
    building = iso.from_fixed_base(
        mass, 0.5 * mass, 400 * mass, np.diag([3e5, 3e5, 7e6]),
        rigid_motion=np.eye(3), shaken=[0, 1],
        names=["base_x", "base_y", "base_r", "floor1_x", "floor1_y", "floor1_r"],
    )
    # no isolator resists rotation here: hold it
    stiffness = building.stiffness.copy()
    stiffness[2, 2] += 1e8
    building = iso.from_matrices(
        building.mass, building.damping, stiffness, influence=building.influence, base=(0, 1, 2),
        names=building.names, name="biaxial building",
    )
    isolated = building.on(iso.law("linear", {"k": 5e6}))
    return iso.simulate(isolated, [ground, ground.scaled(0.5)], "passive_off")
