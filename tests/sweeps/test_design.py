"""Plans: what they say of themselves, and what they refuse."""

import itertools
import re

import numpy as np
import pytest

from isolation_sim.cli.sweep import PLAN
from isolation_sim.errors import InputError
from isolation_sim.sweeps.design import Design, differences
from isolation_sim.sweeps.plan import SweepPlan

from .conftest import MIXED, design_of, plan_of


def test_cases_are_all_combinations_the_last_axis_fastest():
    design = design_of(**MIXED)
    assert (design.n_cases, design.n_runs) == (36, 108)
    results = [tuple(design.case(k).shown.values()) for k in range(design.n_cases)]
    expected = itertools.product(np.linspace(0.7, 1.6, 4), [0.5, 1.5, 2.5], [0.2, 0.6, 1.0])
    np.testing.assert_allclose(results, list(expected), rtol=1e-14)
    assert design.parameters == {"isolators": float, "current": float, "ground.scale_factor": float}


def test_the_plan_that_new_writes_can_be_run(tmp_path):
    path = tmp_path / "my_plan.toml"
    path.write_text(PLAN)
    design = Design(SweepPlan.read(path), str(path))
    assert design.plan.name == "my_plan"
    assert (design.n_cases, design.controllers) == (12, ("passive_off", "clipped_lqr"))
    # the same with everything that is not in force
    (tmp_path / "cases.csv").write_text("isolator.force_scale\n3000\n3100\n")
    path.write_text(re.sub(r"^#(?=\S)", "", PLAN, flags=re.MULTILINE))
    full = Design(SweepPlan.read(path), str(path))
    assert full.n_cases == 2 * 4 * 3 * 2 * 64 * 10
    assert full.plan.energy and full.plan.histories == [0, 5]


def test_a_scenario_file_is_read_beside_the_plan(tmp_path):
    (tmp_path / "mine.toml").write_text('[[controller]]\nname = "on_off"\nrule = "skyhook"\n')
    path = tmp_path / "plan.toml"
    path.write_text('scenario = "mine.toml"\n')
    design = Design(SweepPlan.read(path))
    assert design.controllers == ("on_off",)
    assert (design.n_cases, design.base["controller"][0]["settings"]) == (1, {"rule": "skyhook"})


def test_wrong_values_are_told_together_and_a_first_case_is_as_any_other(tmp_path):
    counts = {"field": "isolator.count", "values": [-1, 1, 0]}
    others = {"field": "ground.scale_factor", "values": [1.0, 2.0]}
    told = (
        r"2 values cannot be used: isolator\.count = -1: .*above 0; isolator\.count = 0: .*above 0$"
    )
    with pytest.raises(InputError, match=told):
        design_of(vary=[counts, others])
    (tmp_path / "there.csv").write_text("time_s,acc_m_s2\n0,0\n0.02,1\n0.04,0\n")
    missing, there = (str(tmp_path / f"{name}.csv") for name in ("missing", "there"))
    vary = [{"field": "ground", "values": [{"file": missing}, {"file": there}]}]
    assert design_of(vary=vary).n_cases == 2
    vary[0]["values"] = [{"file": missing}, {"file": missing + "2"}]
    with pytest.raises(InputError, match=r"missing\.csv: no such file"):
        design_of(vary=vary)


def test_controllers_as_values():
    values = ["passive_on", {"name": "constant", "label": "half", "amperes": 1.5}]
    design = design_of(vary=[{"field": "controller", "values": values}])
    assert (design.n_cases, design.controllers) == (1, ("passive_on", "half"))


def test_whole_sections_by_name_or_table_and_their_keys(tmp_path):
    (tmp_path / "motion.csv").write_text("time_s,ground_acceleration_m_s2\n0,0\n0.02,1\n0.04,0\n")
    path = tmp_path / "plan.toml"
    path.write_text(
        '[[vary]]\nfield = "ground"\n'
        'values = ["el_centro_1940_ns", { kind = "record_file", file = "motion.csv" }]\n'
        '[[vary]]\nfield = "ground.scale_factor"\nvalues = [0.5]\n'
        '[[vary]]\nfield = "isolator"\nvalues = ["hybrid", { law = "linear", '
        "parameters = { k = 1e5 } }]\n"
    )
    design = Design(SweepPlan.read(path))
    shown = [tuple(design.case(k).shown.values()) for k in range(4)]
    assert shown[1] == ("el_centro_1940_ns", 0.5, "linear")
    assert shown[2] == ("motion", 0.5, "hybrid")
    scenario = design.case(3).scenario(design.base)
    (motion,) = scenario.ground
    assert motion.file == tmp_path / "motion.csv" and motion.scale_factor == 0.5
    assert scenario.isolator.parameters == {"k": 1e5}


def test_seeds_follow_from_the_case_not_from_its_place():
    noise = {"kind": "kanai_tajimi", "pga_m_s2": 1.0, "duration_s": 2.0}
    vary = [
        {"field": "isolator.count", "values": [1.0, 2.0]},
        {"field": "driver.lag_s", "values": [0.0, 0.02, 0.04]},
    ]

    def seeds(vary, **seeds):
        design = design_of(scenario={"ground": noise}, vary=vary, seeds=seeds)
        results = {}
        for k in range(design.n_cases):
            shown = dict(design.case(k).shown)
            data = design.case(k).data(design.base)
            assert data["ground"][0]["seed"] == data["sensors"]["seed"] == shown["seed"]
            results[tuple(sorted(shown.items()))[:3]] = shown["seed"]
        return results

    first = seeds(vary, count=4)
    assert len(set(first.values())) == len(first) == 24
    assert seeds(vary[::-1], count=4) == first
    fewer = seeds([vary[0], {**vary[1], "values": [0.02]}], count=2)
    assert fewer.items() <= first.items()
    assert not set(seeds(vary, count=4, base=1).values()) & set(first.values())


def test_the_content_names_what_differs(tmp_path):
    file = tmp_path / "motion.csv"
    file.write_text("time_s,ground_acceleration_m_s2\n0,0\n0.02,1\n0.04,0\n")
    ground = {"kind": "record_file", "file": str(file)}

    def content(**keys):
        return design_of(**{"scenario": {"ground": ground}, **keys}).content()

    vary = [{"field": "isolator.count", "values": [1.0, 2.0]}]
    saved = content(vary=vary)
    assert list(differences(saved, content(vary=vary))) == []
    changed = content(vary=[{**vary[0], "values": [1.0, 3.0]}], energy=True)
    assert set(differences(saved, changed)) == {
        "vary[0].values[1] was 2.0, is 3.0",
        "energy was false, is true",
    }
    file.write_text(file.read_text().replace("0.02,1", "0.02,2"))
    (line,) = differences(saved, content(vary=vary))
    assert line.startswith("files.") and str(file) in line


def test_a_plan_reads_back_from_what_is_saved():
    design = design_of(**MIXED)
    again = Design(SweepPlan.from_dict(design.content()["plan"]))
    assert again.content() == design.content()
    assert again.case(17) == design.case(17)
    assert plan_of(**MIXED).vary == again.plan.vary
