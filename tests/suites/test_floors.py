"""Peaks of levels and storeys, and floor spectra, of a suite and of a sweep."""

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lsim

import isolation_sim as iso
from ground_motions import el_centro_1940, write_csv
from isolation_sim.errors import InputError
from isolation_sim.structures import plan_building
from isolation_sim.sweeps.suites import Suite

pytestmark = pytest.mark.usefixtures("no_drawing")
WHOLE = el_centro_1940()
RECORDS = {"early": WHOLE.cut(0.0, 4.0), "late": WHOLE.cut(4.0, 8.0)}
FLOORS = {"floors": True}


@pytest.fixture(scope="module")
def plant():
    return iso.reference_building().on(iso.reference_isolators())


@pytest.fixture(scope="module")
def suite(plant):
    return iso.compare_records(plant, RECORDS, ["passive_off", "on_off"], ground=FLOORS)


def test_the_largest_over_the_height_is_the_criterion(suite):
    table = suite.table.set_index(["controller", "motion"])
    for name, place in (("peak_floor_acceleration_m_s2", "level"), ("peak_drift_m", "storey")):
        largest = suite.floors[name].max(place).to_series()
        for key, value in largest.items():
            assert value == pytest.approx(table.loc[key[::-1], name], rel=1e-12)


def test_a_floor_spectrum_is_that_of_an_oscillator_on_the_floor(suite, plant):
    run = iso.simulate(plant, RECORDS["late"], "passive_off")
    accelerations, step = run.refined_accelerations, RECORDS["late"].duration
    time = np.linspace(0.0, step, len(accelerations))
    place = 30
    period = float(suite.floors.period_s[place])
    w, z = 2 * np.pi / period, 0.05
    system = ([[0, 1], [-w * w, -2 * z * w]], [[0], [-1]], [[-w * w, -2 * z * w]], [[0]])
    for k, level in enumerate(("base", "floor5")):
        _, absolute, _ = lsim(system, accelerations[:, [0, -1][k]], time)
        found = suite.floors.floor_spectrum_m_s2.sel(
            motion="late", controller="passive_off", direction="x", level=level
        )[place]
        assert float(found) == pytest.approx(np.abs(absolute).max(), rel=1e-3)


def test_files_report_and_a_loaded_suite_have_the_floors(suite, tmp_path):
    suite.save(tmp_path / "kept")
    means = pd.read_csv(tmp_path / "kept" / "peak_drift_m.csv")
    own = means[means["controller"] == "on_off"].set_index("storey")["mean"]
    expected = suite.floors.peak_drift_m.sel(controller="on_off").mean("motion")
    np.testing.assert_allclose(own[expected.storey.to_numpy()], expected, rtol=1e-12)
    for name in ("floors", "floor_spectra_x"):
        assert (tmp_path / "kept" / "figures" / f"{name}.svg").is_file()
    assert "Floor spectra: floor5" in (tmp_path / "kept" / "report.html").read_text()
    assert "peak_drift_m.csv" in (tmp_path / "kept" / "README.txt").read_text()
    assert iso.load(tmp_path / "kept").floors.equals(suite.floors)


def test_figures_show_statistics_of_one_controller_or_means_of_several(suite, plant):
    alone = iso.compare_records(plant, RECORDS, ["passive_off"], ground=FLOORS)
    for one, names in ((suite, ["passive off", "on-off"]),
                       (alone, ["mean", "median", "84 %", "maximum"])):  # fmt: skip
        (left, right) = one.plot_floors().axes
        assert [line.get_label() for line in left.lines] == names
        assert len(right.lines[0].get_xdata()) == 5
        assert len(one.plot_floor_spectra().axes) == 6
    top = alone.floors.peak_drift_m.sel(controller="passive_off").max("motion")
    lines = {line.get_label(): line.get_xdata() for line in alone.plot_floors().axes[1].lines}
    np.testing.assert_allclose(lines["maximum"], 1e3 * top)
    with pytest.raises(InputError, match="direction 'y'"):
        suite.plot_floor_spectra("y")


def test_both_directions_have_spectra():
    masses, heights = [3e4, 3e4], [3.0, 3.0]
    plan = plan_building(
        masses, [5e7, 5e7], [4e7, 4e7], base_mass=4e4, plan=(12.0, 9.0), heights=heights,
        isolator_positions=[[-6, -4], [6, -4], [-6, 4], [6, 4]],
    )  # fmt: skip
    plant = plan.on(iso.reference_isolators(), biaxial=True)
    pair = {"pair": (RECORDS["early"], RECORDS["late"])}
    floors = iso.compare_records(plant, pair, ["passive_off"], ground=FLOORS).floors
    assert floors.direction.to_numpy().tolist() == ["x", "y"]
    assert floors.level.to_numpy().tolist() == ["base", "floor1", "floor2"]
    assert np.isfinite(floors.floor_spectrum_m_s2).all()
    np.testing.assert_allclose(floors.peak_drift_ratio, floors.peak_drift_m / 3.0)


def test_a_mass_without_storeys_has_levels_only(tmp_path):
    mass = iso.from_matrices(np.array([[1e5]]), np.zeros((1, 1)), np.zeros((1, 1)), base=(0,))
    plant = mass.on(iso.law("linear", {"k": 4e6}))
    suite = iso.compare_records(plant, RECORDS, ["passive_off"], ground=FLOORS)
    assert set(suite.floors) == {"floor_spectrum_m_s2", "peak_floor_acceleration_m_s2"}
    suite.save(tmp_path / "mass")


def test_without_them_it_is_said(plant):
    suite = iso.compare_records(plant, RECORDS, ["passive_off"])
    assert suite.floors is None
    with pytest.raises(InputError, match=r"floors were not computed.*floors = true"):
        suite.plot_floors()


def test_a_run_without_result_is_missing(plant, tmp_path):
    plan = {
        "scenario": {"controller": [{"name": "constant", "amperes": 1.0}]},
        "vary": [{"field": "controller.amperes", "values": [1.0, 99.0]}],
        "floors": True,
    }
    floors = iso.sweep(plan, tmp_path / "sweep", workers=1).floors
    assert np.isfinite(floors.peak_drift_m.sel(case=0)).all()
    assert floors.peak_drift_m.sel(case=1).isnull().all()
    # a controller without any result
    controllers = {"off": "passive_off", "far": iso.controller("constant", amperes=99.0)}
    suite = iso.compare_records(plant, RECORDS, controllers, ground=FLOORS)
    assert suite.floors.peak_drift_m.sel(controller="far").isnull().all()
    suite.save(tmp_path / "suite")


def test_a_suite_of_a_file_has_them_unless_switched_off(tmp_path):
    (tmp_path / "records").mkdir()
    write_csv(RECORDS["early"], tmp_path / "records" / "one.csv")
    text = '[ground]\nfolder = "records"\nFLOORS\n[[controller]]\nname = "passive_off"\n'
    for key, present in (("", True), ("floors = false", False)):
        (tmp_path / "one.toml").write_text(text.replace("FLOORS", key))
        out = tmp_path / str(present)
        iso.run_suite(tmp_path / "one.toml", out, workers=1)
        assert (Suite(out).floors is not None) == present
        assert (out / "peak_drift_m.csv").is_file() == present
