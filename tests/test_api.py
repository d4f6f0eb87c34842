"""The api: lazy, complete, and with controllers by name."""

from __future__ import annotations

import re
import subprocess
import sys

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import Record
from isolation_sim import InputError

HEAVY = ("numpy", "scipy", "numba", "casadi", "matplotlib", "xarray", "control", "pydantic", "rich")


def _modules_after(statement: str) -> set[str]:
    code = f"{statement}\nimport sys\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_import_loads_nothing_heavy():
    assert not _modules_after("import isolation_sim") & set(HEAVY)


def test_the_command_line_loads_nothing_heavy():
    assert not _modules_after("import isolation_sim.cli") & (set(HEAVY) - {"rich"})


def test_there_is_one_error_for_input_that_cannot_be_used():
    import ground_motions
    from isolation_sim.errors import InputError as of_errors

    assert iso.InputError is ground_motions.InputError is of_errors
    with pytest.warns(DeprecationWarning, match="now InputError"):
        assert ground_motions.GroundMotionError is iso.InputError
    with pytest.raises(iso.InputError, match="dt"):
        Record([0.0, 1.0], -1.0)


def test_a_law_and_a_building_load_no_compiler_and_no_figures():
    loaded = _modules_after(
        "import isolation_sim as iso\niso.reference_building().on(iso.reference_isolators())"
    )
    assert not loaded & {"numba", "casadi", "matplotlib", "xarray", "control"}


def test_a_run_loads_no_diagnosis_and_no_sweep():
    loaded = _modules_after(
        "from isolation_sim.cli import main\ntry:\n    main(['run', 'missing.toml'])\n"
        "except SystemExit:\n    pass"
    )
    assert "isolation_sim.reports.html.run_report" in loaded
    other = ("discrepancy", "identification", "sweeps", "tuning")
    assert not {
        name for name in loaded if name.startswith("isolation_sim.") and name.split(".")[1] in other
    }


def test_all_names_resolve_and_are_listed():
    for name in iso.__all__:
        assert getattr(iso, name) is not None
    assert set(iso.__all__) <= set(dir(iso))


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        iso.simulat  # noqa: B018


@pytest.fixture(scope="module")
def isolated():
    return iso.reference_building().on(iso.reference_isolators())


@pytest.fixture(scope="module")
def shake():
    t = np.arange(0, 3, 0.02)
    return Record(np.sin(2 * np.pi * t), 0.02, name="sine")


def test_simulate_takes_a_name_or_a_controller(isolated, shake):
    by_name = iso.simulate(isolated, shake)
    expected = iso.simulate(isolated, shake, iso.controller("passive_off"))
    assert by_name.controller == "passive_off"
    np.testing.assert_array_equal(by_name.values, expected.values)


def test_simulate_passes_options_on(isolated, shake):
    with pytest.raises(InputError, match="tolerance: given 3"):
        iso.simulate(isolated, shake, tolerance=3)
    with pytest.raises(TypeError, match="tolerence"):
        iso.simulate(isolated, shake, tolerence=1e-6)
    # the key of a scenario file
    with pytest.raises(TypeError, match="CoilDriver has no argument 'lag_s'; did you mean 'lag'"):
        iso.CoilDriver(lag_s=0.02)


def test_simulate_refuses_an_unknown_controller(isolated, shake):
    with pytest.raises(InputError, match="did you mean 'passive_on'"):
        iso.simulate(isolated, shake, "pasive_on")


def test_compare_names_its_runs(isolated, shake):
    comparison = iso.compare(isolated, shake, ["passive_off", "passive_on"])
    assert list(comparison.runs) == ["passive_off", "passive_on"]
    strong = iso.controller("constant", amperes=2.0)
    labelled = iso.compare(isolated, shake, {"off": "passive_off", "2 A": strong})
    assert list(labelled.runs) == ["off", "2 A"]
    assert labelled.runs["2 A"].current.max() == 2.0


def test_compare_refuses_shared_names_and_a_bare_name(isolated, shake):
    with pytest.raises(InputError, match="different names"):
        iso.compare(isolated, shake, ["passive_on", "passive_on"])
    with pytest.raises(InputError, match="expected: a list, each text"):
        iso.compare(isolated, shake, "passive_on")


def test_run_scenario_takes_an_object_or_a_path(tmp_path, isolated):
    text = '[ground]\nstop_s = 3.0\n[[controller]]\nname = "passive_off"\n'
    path = tmp_path / "short.toml"
    path.write_text(text)
    by_path = iso.run_scenario(path)
    by_object = iso.run_scenario(iso.Scenario.from_toml(text))
    assert by_path.criteria == by_object.criteria
    assert by_path.runs["passive_off"].time[-1] == pytest.approx(3.0)


DIVERGING = """
[ground]
scale_factor = 50  # without current the isolators deform 50 times further than tested
stop_s = 3.0
[[controller]]
name = "passive_off"
[[controller]]
name = "passive_on"
"""


def test_a_controller_that_diverges_leaves_the_others_their_results(tmp_path):
    path = tmp_path / "strong.toml"
    path.write_text(DIVERGING)
    result = iso.run_scenario(path)
    assert list(result.runs) == ["passive_on"]
    reason = r"strong.toml: controller 'passive_off': the run diverged at t = 1\.\d+ s: the devices"
    assert list(result.diverged) == ["passive_off"]
    assert isinstance(result.diverged["passive_off"], iso.Diverged)
    assert re.search(reason, str(result.diverged["passive_off"]))
    assert re.search(f"passive off has no result: .*{reason}", str(result))
    run = result.runs["passive_on"]
    again = iso.compare(run.isolated, run.records[0], ["passive_off", "passive_on"])
    assert (list(again.runs), list(again.diverged)) == (["passive_on"], ["passive_off"])
    assert again.criteria == result.criteria
    report = iso.json_report(result)["diverged"]
    assert report == [{"controller": "passive_off", "reason": str(result.diverged["passive_off"])}]


def test_if_every_controller_diverges_there_is_no_comparison():
    text = DIVERGING.replace("= 50 ", "= 1000 ")
    with pytest.raises(iso.Diverged, match="controller 'passive_off': the run diverged"):
        iso.run_scenario(iso.Scenario.from_toml(text))


def test_a_degree_of_the_current_is_refused_where_it_has_no_meaning(tmp_path):
    record = tmp_path / "record.csv"
    record.write_text("time_s,ground_acceleration_m_s2,base_acceleration_m_s2\n0,0,0\n")
    with pytest.raises(InputError, match="current degree: given 1, which has no meaning") as error:
        iso.diagnose(record, scenario=iso.Scenario(), current_degree=1)
    assert str(record) in str(error.value) and "\n" not in str(error.value)
    with pytest.raises(InputError, match="current degree: given 0, which has no meaning"):
        iso.diagnose([record], scenario=iso.Scenario(), current_degree=0)


def test_building_records_are_held_out_by_their_paths(tmp_path, monkeypatch):
    names = ("weak.csv", "strong.csv", "second.csv")
    paths = [tmp_path / name for name in names]
    for path in paths:
        path.write_text("time_s,ground_acceleration_m_s2\n0,0\n")
    seen = []
    monkeypatch.setattr(
        "isolation_sim.discrepancy.building.record.read_building_record",
        lambda path, hold_out: seen.append((path.name, hold_out)),
    )
    monkeypatch.setattr("isolation_sim.discrepancy.diagnose.diagnose_building", lambda *_, **__: 0)
    scenario = iso.Scenario()
    for data in (paths, paths[:2]):
        iso.diagnose(data, scenario=scenario, hold_out=[str(paths[2])], consequence=False)
        assert seen == [("weak.csv", False), ("strong.csv", False), ("second.csv", True)]
        seen.clear()
    with pytest.raises(InputError, match="not a CSV file of a building record"):
        iso.diagnose(tmp_path, hold_out=paths[2:])


@pytest.mark.parametrize(
    ("degree", "message"),
    [
        (
            2,
            "need 3 currents; the fitted rows have 2 "
            r"\(0 to 3 A\)",
        ),
        (-1, "expected: 0 or more"),
    ],
)
def test_a_degree_that_a_loop_table_does_not_determine_is_refused(tmp_path, degree, message):
    table = tmp_path / "loops.csv"
    rows = [f"{2 + k // 2},1,{3 * (k % 2)},{50 + k},0.1" for k in range(8)]
    head = "amplitude_mm,frequency_Hz,current_A,effective_stiffness_N_per_mm,damping_ratio"
    table.write_text("\n".join([head, *rows]) + "\n")
    with pytest.raises(InputError, match=message):
        iso.diagnose(table, law="kelvin_voigt", current_degree=degree)
