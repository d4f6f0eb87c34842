"""References: every source is known, and a result's are those of what it used."""

import json
import re

import pytest

from controllers import CONTROLLERS
from isolation_sim import Scenario
from isolation_sim.cli import main
from isolation_sim.cli.cite import citations_of
from isolation_sim.effects import EFFECTS
from isolation_sim.errors import InputError
from isolation_sim.laws import LAWS, available_sets, law
from isolation_sim.reports import references
from isolation_sim.reports.publications import PUBLICATIONS
from isolation_sim.scenario import main_job
from isolation_sim.tuning.tuning import Trial, Tuning

TEXTBOOK = {"linear", "kelvin_voigt", "maxwell", "spring_pot"}
"""Laws without a publication of their own."""


def known(source):
    return any(name in source for name in PUBLICATIONS)


@pytest.mark.parametrize("name", sorted(set(LAWS) - TEXTBOOK))
def test_the_source_of_every_law_and_set_is_known(name):
    assert known(LAWS[name].source)
    for each in available_sets(name):
        assert known(law(name, each).source), each


@pytest.mark.parametrize("name", [n for n, kind in CONTROLLERS.items() if kind.source])
def test_the_source_of_every_controller_is_known(name):
    rest = CONTROLLERS[name].source
    assert known(rest)
    for publication in PUBLICATIONS:
        rest = rest.replace(publication, "")
    # a year stands for a publication
    assert not re.search(r"\b(19|20)\d\d\b", rest)


@pytest.mark.parametrize("cause", EFFECTS)
def test_a_publication_of_an_effect_does_not_hide_another(cause):
    for form in EFFECTS[cause]:
        rest = form.source
        for publication in PUBLICATIONS:
            rest = rest.replace(publication, "")
        assert rest == form.source or not re.search(r"\b1[89]\d\d\b|\b20\d\d\b", rest), form.form


def test_each_publication_is_reported_once_with_all_its_uses():
    citations_text = references.citations(
        [("a", "Li & Li, Eq 1"), ("b", "Li & Li, Table 2"), ("a", "Li & Li")]
    )
    assert [(c.text.split(",")[0], c.uses) for c in citations_text] == [("Y. Li", ("a", "b"))]


def test_a_source_that_nobody_knows_stands_for_itself():
    citations_text = references.citations([("motion", "my shake table"), ("law", "")])
    assert [c.line for c in citations_text] == ["my shake table. Used for: motion."]


def test_a_scenario_cites_what_it_names_and_nothing_else():
    text = " ".join(c.line for c in references.of_scenarios([Scenario.from_toml(
        '[isolator]\nlaw = "hybrid"\n[[controller]]\nname = "passive_off"\n'
    )]))  # fmt: skip
    assert "improved FOA" in text and "Dyke" in text and "Chopra" in text
    assert "rate-dependent mechanical model" not in text and "Karnopp" not in text


def test_a_folder_without_a_scenario_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"holds no result; .*isolation-sim run makes one"):
        citations_of(tmp_path)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "scenario.toml").write_text("")
    with pytest.raises(InputError, match=r"results folder, such as .*mine"):
        citations_of(tmp_path)


def called(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(each) for each in arguments])
    return ended.value.code or 0, capsys.readouterr().out


def test_cite_a_folder_a_file_and_the_main_job(tmp_path, capsys):
    (tmp_path / "scenario.toml").write_text(main_job().to_toml())
    of_folder, of_file, of_main = (
        called(capsys, "cite", *where) for where in ([tmp_path], [tmp_path / "scenario.toml"], [])
    )
    assert of_folder == of_file == of_main
    assert of_main[0] == 0 and "Smart base-isolated benchmark building" in of_main[1]


def test_cite_as_json(capsys):
    code, out = called(capsys, "cite", "--json")
    entries = json.loads(out)["references"]
    assert code == 0
    main_jobs = references.of_scenarios([main_job()])
    assert [e["reference"] for e in entries] == [c.text for c in main_jobs]


def test_a_sweep_cites_every_law_and_controller_of_its_cases(tmp_path, capsys):
    plan = tmp_path / "plan.toml"
    plan.write_text(
        "[scenario.ground]\nstop_s = 0.5\n"
        '[[vary]]\nfield = "isolator.law"\nvalues = ["strain_stiffening", "hybrid"]\n'
        '[[vary]]\nfield = "controller"\nvalues = [{name = "on_off"}, {name = "fuzzy"}]\n'
    )
    assert called(capsys, "sweep", plan, "--out", tmp_path / "swept", "--workers", 1)[0] == 0
    code, out = called(capsys, "cite", tmp_path / "swept")
    assert code == 0
    for used in ("law strain_stiffening", "law hybrid", "controller on", "controller fuzzy"):
        assert used in out


def test_a_tuning_cites_its_plant_and_the_tuned_controller(tmp_path, capsys):
    plant = Scenario.from_toml('[isolator]\nlaw = "hybrid"\n[[controller]]\nname = "fuzzy"\n')
    content = {
        "controller": "clipped_lqr", "scenario": plant.to_toml(), "fixed": {}, "isolation_sim": "",
        "command": "", "settings": {"reference": {}},
    }  # fmt: skip
    Tuning(content, [Trial({}, [1.0])]).save_state(tmp_path)
    code, out = called(capsys, "cite", tmp_path)
    assert code == 0 and "law hybrid" in out and "controller clipped" in out
    assert "controller fuzzy" not in out
