"""A search among few causes."""

import pytest

from isolation_sim.discrepancy.building import cause_search

FEW = {
    "base_mass_error", "floor_mass_error", "storey_stiffness_loss", "isolator_stiffness_error",
    "isolator_force_error", "extra_isolator_damping", "moat_impact", "sensor_bias", "sensor_gain",
}  # fmt: skip
"""Of the structure, of the isolators and of the sensors."""


@pytest.fixture
def few_causes(monkeypatch):
    """Ask nine causes in all forms and places: to simulate all of them takes most of the time."""
    every = cause_search.candidates

    def fewer(model, records):
        return [cause for cause in every(model, records) if cause.name in FEW]

    monkeypatch.setattr(cause_search, "candidates", fewer)
