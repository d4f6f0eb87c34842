"""Forces outside the catalogue in blind building records: an equation is to describe them."""

from __future__ import annotations

import pytest

from isolation_sim.discrepancy.building.record import read_building_record
from isolation_sim.discrepancy.diagnose import diagnose_building
from studies.blind.buildings import make_record, outside_faults
from studies.blind_buildings import engineers

SIZE = 0.06


def test_an_equation_describes_a_drag_that_needs_the_field(tmp_path):
    """Beside isolators with hysteresis whose current switches."""
    drag = next(one for one in outside_faults() if one.form == "field_drag")
    hidden = make_record(501, [drag], SIZE)
    record = read_building_record(hidden.write(tmp_path / "case") / "record.csv")
    # without the search for causes, to save time
    isolated = engineers(hidden.nominal)
    found = diagnose_building(record, isolated, most_causes=0, tiers="equation")
    (term,) = found.ladder.terms
    assert term.text == "v |v|" and found.ladder.offered == "equation"
    (coefficient,) = term.numbers.values()
    assert coefficient.unit == "N s^2/m^2/A^1"
    assert coefficient.value == pytest.approx(hidden.strengths[0], rel=0.03)
    law, equation = found.ladder.rungs[0], found.ladder.rungs[-1]
    assert equation.held_out < 0.25 * law.held_out
    assert found.verdict == "explained"
