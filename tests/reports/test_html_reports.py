"""Reports of runs and fits: what they say is what was computed, and they stay small."""

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import Record
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.reports.chart import elements_along
from isolation_sim.reports.html.run_report import criteria_table, run_report
from isolation_sim.structures import load_change_rows, plan_building
from isolation_sim.written_names import as_written

MOST = 6_000_000


@pytest.fixture(scope="module")
def comparison(runs):
    return iso.Comparison(runs)


def test_time_histories_are_the_runs_own(comparison, runs, figures, unpacked):
    drawn = figures(run_report(comparison).html())
    base = drawn["Base displacement relative to the ground (mm)"]["data"]
    assert [trace["name"] for trace in base] == [*map(as_written, runs)]
    for trace, run in zip(base, runs.values(), strict=True):
        expected = 1e3 * run.output("base_displacement_m")
        np.testing.assert_allclose(unpacked(trace["y"]), expected, rtol=1e-6)
        assert trace["dx"] == pytest.approx(run.records[0].dt)
    current = {t["name"]: unpacked(t["y"]) for t in drawn["Coil current (A)"]["data"]}
    assert set(current["on-off"]) == {0.0, 3.0}


def test_loops_carry_the_current(comparison, runs, figures, unpacked):
    trace = figures(run_report(comparison).html())["on-off, isolator"]["data"][0]
    assert set(unpacked(trace["marker"]["color"])) == {0.0, 3.0}
    force = unpacked(trace["y"])
    assert np.abs(force).max() == pytest.approx(
        1e-3 * abs(runs["on_off"].output("isolator_force_N")).max(), rel=1e-6
    )


def test_energies_stack_up_to_what_was_supplied(comparison, runs, figures, unpacked):
    drawn = figures(run_report(comparison).html())
    for name in runs:
        ledger = next(
            figure for title, figure in drawn.items() if title.startswith(f"{as_written(name)} (cl")
        )
        *stack, _, supplied = (unpacked(trace["y"]) for trace in ledger["data"])
        np.testing.assert_allclose(sum(stack), supplied, atol=1e-5 * supplied.max())


def test_every_quantity_has_its_unit(comparison, figures):
    for title, figure in figures(run_report(comparison).html()).items():
        assert figure["layout"]["xaxis"]["title"]["text"].endswith(")"), title
        vertical = figure["layout"]["yaxis"]
        assert vertical["title"]["text"] or "ticktext" in vertical, title


def test_the_best_of_each_row_is_marked(comparison):
    rows = {row.label: row.cells for row in reversed(criteria_table(comparison).rows)}
    values = [run["peak_base_displacement_m"] for run in comparison.criteria.values()]
    marks = [cell.mark for cell in rows["base displacement, mm"]]
    assert marks.index("best") == int(np.argmin(values)) and marks.count("best") == 1
    assert float(rows["base displacement, mm"][0].text) == pytest.approx(1e3 * values[0], rel=1e-3)
    assert not any(cell.mark for cell in rows["input, kJ"])


def test_input_is_listed(comparison):
    text = run_report(comparison, 'name = "mine"\n[sensors]\nseed = 7\n').html()
    for expected_text in (
        "mine", "sensors.seed = 7", f"isolation-sim {iso.__version__}", "numpy", "Table 2",
        "Smart base-isolated benchmark", "Dynamics of Structures", "Warning: ",
    ):  # fmt: skip
        assert expected_text in text, expected_text


def test_seven_runs_of_a_long_record_stay_small_and_keep_their_peak(
    seven, runs, tmp_path, figures, unpacked
):
    random = np.random.default_rng(0)
    motion = Record(0.3 * random.normal(size=30_000), 0.005, name="long")
    long = iso.simulate(runs["passive_on"].isolated, motion, "passive_on")
    comparison = iso.Comparison(dict.fromkeys(seven, long))
    path = comparison.to_html(tmp_path / "report.html")
    assert path.stat().st_size < MOST
    drawn = figures(path.read_text())
    trace = drawn["Absolute roof acceleration (m/s²)"]["data"][0]
    peak = abs(long.output("floor5_acceleration_m_s2")).max()
    assert np.abs(unpacked(trace["y"])).max() == pytest.approx(peak, rel=1e-6)


@pytest.fixture(scope="module")
def fit():
    """Spring and dashpot at two currents, one run held out."""
    random = np.random.default_rng(0)
    time = np.arange(0, 3, 1 / 100)
    tests = []
    for current, stiffness in ((0.0, 2e4), (2.0, 5e4)):
        for frequency in (1.0, 2.0):
            w = 2 * np.pi * frequency
            x, v = 4e-3 * np.sin(w * time), 4e-3 * w * np.cos(w * time)
            force = stiffness * x + 300 * v + random.normal(0, 2.0, time.size)
            name = f"{frequency:g}Hz_{current:g}A"
            tests.append(
                TestRun(name, time, x, v, force, np.full(time.size, current), frequency == 2)
            )
    return iso.fit(Campaign("isolator 7", "made for a test", tuple(tests)), law="kelvin_voigt")


def test_a_fit_report_has_the_results_of_the_fit(fit, tmp_path, figures, unpacked):
    text = fit.to_html(tmp_path / "fit.html").read_text().replace("\u00a0", " ")
    assert (tmp_path / "fit.html").stat().st_size < MOST
    drawn = figures(text)
    assert len(drawn) == 2 * len(fit.errors)
    for k, (title, figure) in enumerate(drawn.items()):
        error = fit.errors[k % len(fit.errors)]
        assert error.run.name in title and ("held out" in title) == error.run.hold_out
        motion = error.run.displacement if k < len(fit.errors) else error.run.velocity
        for trace in figure["data"]:
            np.testing.assert_allclose(unpacked(trace["x"]), 1e3 * motion, rtol=1e-5, atol=1e-5)
        measured, modelled = (unpacked(trace["y"]) for trace in figure["data"])
        residual = np.sqrt(np.mean((modelled - measured) ** 2) / np.mean(measured**2))
        assert residual == pytest.approx(error.relative, rel=1e-4)
    for estimate in fit.estimates:
        assert f"{estimate.value:.5g}" in text and f"{estimate.low:.5g} to" in text
    assert f"RMS force error of {100 * fit.error:.2g} %" in text
    assert "[isolator]" in text


def test_a_fit_report_is_operated(fit, opened, tmp_path, until):
    page = opened(fit.to_html(tmp_path / "fit.html"))
    page.locator(".filters select").select_option("held out")
    assert page.locator("tbody tr:visible").filter(has_text="held out").count() == 3
    page.locator("[data-line=modelled]").uncheck()
    until(
        page,
        "[...document.querySelectorAll('.plot')].every((plot) => !plot._fullData[1].visible)",
    )


@pytest.fixture(scope="module")
def mixed():
    """MR isolators beside rubber bearings within a wall that one controller touches."""
    scenario = iso.Scenario.from_toml(
        "[ground]\nstop_s = 8.0\n[[element]]\nname = 'rubber bearings'\ndirection = 'base'\n"
        "law = 'kelvin_voigt'\nparameters = { k = 4e6, c = 1e5 }\n"
        "length_scale = 1.0\nforce_scale = 1.0\n"
        "[moat_wall]\ngap_m = 0.1\nstiffness_N_per_m = 1e8\n[simulation]\nfixed_base = true\n"
        "[[controller]]\nname = 'passive_off'\n[[controller]]\nname = 'passive_on'\n"
    )
    return iso.run_scenario(scenario)


def test_the_fixed_base_is_in_the_envelopes_and_named_at_the_trade_off(mixed, figures, unpacked):
    drawn = figures(run_report(mixed).html())
    trade_off = drawn["Trade-off: the lower left is better"]
    assert [trace["name"] for trace in trade_off["data"]] == ["passive off", "passive on"]
    assert trade_off["layout"]["annotations"][0]["text"].startswith("not drawn: fixed base ")
    (points,) = (t for t in drawn["Peak absolute acceleration (m/s²)"]["data"]
                 if t["name"] == "fixed base")  # fmt: skip
    # a fixed base has no level at the base
    assert unpacked(points["y"]).tolist() == [1, 2, 3, 4, 5]
    peaks = mixed.fixed_base.peaks["floor_acceleration_m_s2"]
    np.testing.assert_allclose(unpacked(points["x"]), peaks, rtol=1e-6)


def test_every_kind_of_element_at_the_base_has_a_loop(mixed, figures, unpacked):
    drawn = figures(run_report(mixed).html())
    kinds = ["isolator", "rubber bearings", "isolation layer"]
    assert all(f"passive off, {kind}" in drawn for kind in kinds)
    touching = [name for name, run in mixed.runs.items() if run.contacts["moat_wall"]]
    walls = [title for title in drawn if title.endswith(", moat_wall")]
    assert walls == [f"{as_written(name)}, moat_wall" for name in touching]
    force = unpacked(drawn["passive off, isolation layer"]["data"][0]["y"])
    run = mixed.runs["passive_off"]
    total = sum(run.output(f"{name}_force_N") for name in run.isolated.element_names)
    assert np.abs(force).max() == pytest.approx(1e-3 * np.abs(total).max(), rel=1e-6)


def test_columns_and_numbers_of_the_criteria(mixed):
    table = criteria_table(mixed)
    assert table.numeric == (False, True, True, True)
    rows = {row.label: row.cells for row in reversed(table.rows)}
    ratio = mixed.criteria["passive_off"]["peak_drift_m"]
    assert float(rows["storey drift, mm"][0].text.rstrip("*")) == pytest.approx(
        1e3 * ratio, rel=1e-3
    )
    assert not any("e+" in cell.text for row in table.rows for cell in row.cells)


@pytest.mark.filterwarnings("ignore::isolation_sim.PlausibilityWarning")
def test_axial_loads_of_bearings_have_no_loop():
    building = plan_building([2e5], [3e8], [3e8], base_mass=3e5, plan=(20.0, 12.0), heights=[3.5])
    sliding = {"W": 5e6, "R": 2.0, "mu_max": 0.06, "mu_min": 0.03, "a": 50.0, "u_y": 1e-3}
    bearings = iso.law("friction_pendulum", sliding | {"n": 2.0, "tau": 1.0})
    loads = load_change_rows(building, overturning=True)
    isolated = building.on(bearings, biaxial=True, load_changes=loads)
    pulse = Record(np.sin(np.arange(100) / 10), 0.02, name="pulse")
    run = iso.simulate(isolated, [pulse, pulse])
    assert elements_along({"passive off": run}, 0) == ["isolator1_x"]
