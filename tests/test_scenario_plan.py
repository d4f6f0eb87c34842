"""Buildings in plan, biaxial isolators and soil in a scenario."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from isolation_sim.errors import InputError
from isolation_sim.scenario import Scenario

PAGE = (Path(__file__).parents[1] / "docs" / "biaxial.md").read_text(encoding="utf-8")
SCENARIO = re.findall(r"^```toml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)[0]


def test_the_scenario_of_the_page():
    scenario = Scenario.from_toml(SCENARIO)
    isolated = scenario.build().isolated
    names = isolated.element_names
    assert [len(group) for group in isolated.groups] == [2, 2, 2, 2, 1, 1]
    assert names[0] == "isolator1_x" and names[-1] == "moat_wall_y"
    assert isolated.structure.names[-4:] == (
        "foundation_x", "foundation_y", "rocking_x", "rocking_y",
    )  # fmt: skip
    # isolators stand on the foundation, and share the numbers
    assert isolated.holding[0].tolist() == [1.0, 0.0]
    assert isolated.elements[0].device.force_scale == 0.25
    assert Scenario.from_toml(scenario.to_toml()) == scenario


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('law = "park_wen_ang"', 'law = "lugre"', "unknown parameter 'k'"),
        ("biaxial = true", "overturning = true", "need biaxial isolators"),
        (
            "biaxial = true",
            "",
            r"isolator: .* nothing resists rotation; expected: biaxial = true",
        ),
        (
            "biaxial = true",
            'biaxial = true\n[[isolator.effect]]\nname = "ambient_temperature"\nsoftening = 0.01',
            "effects act along one direction",
        ),
        ("biaxial = true", "vertical_period_s = 0.1", "need biaxial isolators"),
        ("biaxial = true", "biaxial = true\nvertical_period_s = 0.1", "vertical load that changes"),
        ("biaxial = true", "biaxial = true\noverturning = true", "vertical load that changes"),
        ("biaxial = true", "biaxial = true\np_delta_height_m = 0.0", "p_delta_height_m"),
        ("plan_m = [24.0, 15.0]", "plan_m = [24.0]", "plan_m"),
        ("poisson_ratio = 0.33", "poisson_ratio = 0.7", "poisson_ratio"),
        ("foundation_inertia_kg_m2 = 1.5e7", "", "expected for rocking: a number above 0"),
        ("Q = 1.5", "K = 1.5", "expected: k, c, Q"),
    ],
)
def test_what_cannot_be_is_refused(old, new, message):
    assert old in SCENARIO
    with pytest.raises(InputError, match=message):
        text = SCENARIO.replace(old, new)
        scenario = Scenario.from_toml(text)
        scenario.build()
        for _ in scenario.check_rows()[1]:
            pass


def test_biaxial_needs_two_directions_of_motion():
    text = '[isolator]\nbiaxial = true\n[[controller]]\nname = "passive_off"\n'
    with pytest.raises(InputError, match="expected for biaxial isolators: two directions"):
        Scenario.from_toml(text).build()
