"""Forces outside the catalogue in blind building records: an equation is to describe them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim.discrepancy.building.record import read_building_record
from isolation_sim.discrepancy.diagnose import diagnose_building
from studies.blind.buildings import (
    DAMPING_RATIO,
    ISOLATOR,
    make_record,
    nominal_building,
    outside_faults,
)

SEED, SIZE = 501, 0.06


def without_hysteresis(building):
    """The building on springs and dashpots, whose law other tests have compiled as well."""
    numbers = dict(zip(ISOLATOR, building.isolator, strict=True))
    numbers["k"] = np.array([1e7, 1e6, 0.0])
    numbers["c"] = np.array([6e5, 0.0, 0.0])
    numbers["alpha"] = np.zeros(3)
    return replace(building, isolator=np.array([numbers[name] for name in ISOLATOR]))


def engineers(building):
    structure = iso.shear_building(
        building.masses, building.stiffnesses, base_mass=building.base_mass,
        damping_ratio=DAMPING_RATIO, rayleigh_modes=(1, 3),
    )  # fmt: skip
    return structure.on(iso.law("kelvin_voigt", {"k": [1e7, 1e6], "c": 6e5}))


@pytest.mark.slow
@pytest.mark.usefixtures("short_motion")
def test_an_equation_describes_a_squeeze_film_of_the_isolators(tmp_path):
    """Under a current that switches, with noise in every channel and in the ground motion."""
    nominal = without_hysteresis(nominal_building(SEED))
    film = next(one for one in outside_faults() if one.form == "squeeze_film")
    hidden = make_record(SEED, [film], SIZE, nominal=nominal)
    record = read_building_record(hidden.write(tmp_path / "case") / "record.csv")
    # without the search for causes, to save time
    diagnosis = diagnose_building(record, engineers(nominal), most_causes=0, tiers="equation")
    (term,) = diagnosis.ladder.terms
    assert term.text == "x^2 v" and diagnosis.ladder.offered == "equation"
    (coefficient,) = term.numbers.values()
    assert coefficient.unit == "N s/m^3"
    assert coefficient.value == pytest.approx(hidden.severities[0], rel=0.03)
    law, equation = diagnosis.ladder.rungs[0], diagnosis.ladder.rungs[-1]
    assert equation.held_out < 0.25 * law.held_out
    assert diagnosis.verdict == "explained"
