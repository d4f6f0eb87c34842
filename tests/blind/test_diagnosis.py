"""A fast part of the blind study: ``python -m studies.blind`` runs all of it."""

import json

import pytest

from isolation_sim.cli import main
from isolation_sim.discrepancy.device import observable_effects
from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.effects import EFFECTS
from isolation_sim.scenario import Scenario
from studies.blind.cases import CATALOGUE, Case, clean, outside, several

pytestmark = pytest.mark.usefixtures("no_drawing")


def written(case, tmp_path):
    return case.campaign().write(tmp_path / "campaign")


def test_a_single_effect_is_named_first(tmp_path):
    name = "coulomb_friction"
    case = Case("single", "kelvin_voigt", "kelvin_voigt", ((name, "bristles"),), 31)
    diagnosis = diagnose(written(case, tmp_path), case.law, tiers="causes")
    assert diagnosis.causes[0].name == name
    assert diagnosis.error_after.held_out < 0.6 * diagnosis.error_before.held_out
    assert diagnosis.causes[0].p_value < 1e-6


def test_nothing_is_named_where_nothing_is_hidden(tmp_path):
    (case,) = clean(1, bases=("strain_stiffening",), seed=77)
    diagnosis = diagnose(written(case, tmp_path), case.law, tiers="causes")
    assert diagnosis.verdict == "adequate" and not diagnosis.causes


@pytest.mark.usefixtures("few_effects")
def test_both_of_a_pair_are_named(tmp_path, monkeypatch):
    case = next(several(2, 1))
    for effect, _ in case.effects:
        monkeypatch.setitem(observable_effects.EFFECTS, effect, EFFECTS[effect])
    diagnosis = diagnose(written(case, tmp_path), case.law, tiers="causes")
    assert {effect for effect, _ in case.effects} <= {cause.name for cause in diagnosis.causes}


def test_what_is_outside_the_catalogue_is_not_blamed_on_it(tmp_path):
    case = next(c for c in outside() if "pump" in c.name)
    diagnosis = diagnose(written(case, tmp_path), case.law, tiers="causes")
    assert diagnosis.verdict == "explained"  # as interference, beside which there is noise alone
    assert not {cause.name for cause in diagnosis.causes} & set(CATALOGUE)
    assert "frequency" in diagnosis.depends_on


@pytest.mark.usefixtures("few_effects")
def test_the_command_leaves_a_law_that_a_scenario_takes(tmp_path, capsys, monkeypatch):
    hidden = "tension_compression_asymmetry"
    monkeypatch.setitem(observable_effects.EFFECTS, hidden, EFFECTS[hidden])
    case = Case(
        "single", "strain_stiffening", "strain_stiffening", ((hidden, "stiffer_one_way"),), 32
    )
    folder, out = written(case, tmp_path), tmp_path / "out"
    scenario = tmp_path / "scenario.toml"
    scenario.write_text('[[controller]]\nname = "passive_off"\n')
    with pytest.raises(SystemExit) as ended:
        main(["diagnose", str(folder), "--law", case.law, "--scenario", str(scenario),
              "--out", str(out), "--json"])  # fmt: skip
    assert ended.value.code == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((out / "diagnosis.json").read_text())
    assert printed["causes"][0]["name"] == hidden
    runs = printed["consequence"]["controllers"]["passive_off"]
    assert runs["predicted"] != runs["actual"] == runs["redesigned"]
    isolated = Scenario.read(out / "extended_law.toml").build().isolated
    assert hidden in isolated.elements[0].device.law.name
