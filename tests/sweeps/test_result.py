"""The table for other tools, sensitivities against closed forms, figures and what they show."""

import csv

import matplotlib
import numpy as np
import pandas
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm

import isolation_sim as iso
from isolation_sim.errors import InputError
from isolation_sim.reports import sweep_figures
from isolation_sim.reports.style import point_looks
from isolation_sim.reports.sweep_figures import quantity_title
from isolation_sim.reports.sweep_tables import best_table, controllers_table
from isolation_sim.reports.tables import as_text
from isolation_sim.sweeps.result import Sweep
from isolation_sim.written_names import as_written

from .conftest import MIXED, SHORT, plan_of


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mixed") / "sweep"
    return iso.sweep(plan_of(**MIXED, energy=True), folder, workers=1)


def test_the_table_is_tidy_and_any_tool_reads_it(mixed):
    table = mixed.table
    assert len(table) == 108 and mixed.finished
    assert list(table.columns[:10]) == [
        "case", "isolators", "current", "ground.scale_factor", "controller", "status", "reason",
        "clamped", "deformation_over_tested", "current_over_tested",
    ]  # fmt: skip
    assert mixed.parameters == ("isolators", "current", "ground.scale_factor")
    assert {"peak_drift_m", "J9", "energy_input_J", "energy_closure_error"} < set(mixed.criteria)
    assert table["energy_closure_error"].max() < 1e-5
    with np.load(mixed.folder / "table.npz") as arrays:
        read = pandas.DataFrame({name: arrays[name] for name in arrays.files})
    pandas.testing.assert_frame_equal(read, table)


def test_csv_holds_every_bit(mixed, tmp_path):
    path = mixed.to_csv(tmp_path / "table.csv")
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["J5"]) for row in rows] == mixed.table["J5"].tolist()


def test_the_best_runs(mixed):
    best = mixed.best("rms_drift_m", 3)
    lowest = np.unique(mixed.table["rms_drift_m"])[:3]
    np.testing.assert_array_equal(best["rms_drift_m"], lowest)
    with pytest.raises(InputError, match="did you mean 'rms_drift_m'"):
        mixed.best("rms_drift")
    with pytest.raises(InputError, match="best: given 0; expected: 1 or more"):
        mixed.best("rms_drift_m", 0)


def test_the_best_take_most_energy_out(mixed):
    sweep = Sweep(mixed.folder)
    vars(sweep)["table"] = mixed.table.assign(J9=np.linspace(0.5, 0.9, len(mixed.table)))
    good = sweep.table[sweep.table["status"] == "ok"]
    assert sweep.best("J9", 2)["J9"].tolist() == sorted(good["J9"], reverse=True)[:2]
    assert as_text(best_table(sweep, "J9", 2)).startswith(
        "highest J9 control work / input energy\n"
    )
    assert as_text(best_table(mixed, "rms_drift_m", 2)).startswith("lowest RMS storey drift\n")


def test_the_best_list_has_a_result_once(tmp_path):
    """Passive off does not depend on the setting of another controller."""
    scenario = {
        "ground": SHORT,
        "controller": [{"name": "passive_off"}, {"name": "constant", "amperes": 0.5}],
    }
    amperes = {"field": "controller[1].amperes", "low": 0.5, "high": 1.5, "count": 3}
    result = iso.sweep(plan_of(scenario=scenario, vary=[amperes]), tmp_path / "sweep", workers=1)
    best = result.best(count=10)
    assert sorted(best["controller"]) == ["constant"] * 3 + ["passive_off"]


def test_histories_are_saved_on_request(tmp_path):
    keys = {**MIXED, "vary": MIXED["vary"][:1], "histories": [2]}
    result = iso.sweep(plan_of(**keys), tmp_path / "sweep", workers=1)
    history = result.history(2, "on_off")
    (row,) = result.table[
        (result.table["case"] == 2) & (result.table["controller"] == "on_off")
    ].to_dict("records")
    peak = row["peak_base_displacement_m"]
    assert history.attrs["criterion_peak_base_displacement_m"] == peak
    # the samples miss the peak between two of them
    assert 0.99 * peak < float(abs(history.displacement[:, 0]).max()) <= peak
    with pytest.raises(InputError, match="no such file"):
        result.history(1)


LINEAR = {
    "scenario": {
        "ground": SHORT,
        "isolator": {"law": "linear", "parameters": {"k": 1e5}},
        "controller": [{"name": "passive_off"}],
    },
    "vary": [
        {"field": "ground.scale_factor", "low": 1.0, "high": 3.0},
        {"field": "sensors.delay_s", "low": 0.0, "high": 1.0},
    ],
}


@pytest.mark.parametrize(
    ("method", "count", "columns"),
    [
        pytest.param("saltelli", 64, ["S1", "S1_conf", "ST", "ST_conf"], marks=pytest.mark.slow),
        ("morris", 10, ["mu_star", "mu_star_conf", "sigma"]),
        ("latin_hypercube", 200, ["S1", "S1_conf"]),
    ],
)
def test_sensitivity_of_a_linear_building_is_known(tmp_path, method, count, columns):
    """Response is the scale times that at scale one, and no sensor matters without a controller."""
    pytest.importorskip("SALib")
    plan = plan_of(**LINEAR, sample={"method": method, "count": count, "seed": 2})
    result = iso.sweep(plan, tmp_path / "sweep", workers=1)
    computed = result.sensitivity("peak_drift_m")
    assert list(computed.index) == ["ground.scale_factor", "sensors.delay_s"]
    assert list(computed.columns) == columns
    at_one = result.table["peak_drift_m"] / result.table["ground.scale_factor"]
    np.testing.assert_allclose(at_one, at_one[0], rtol=1e-6)
    scale, delay = computed.iloc[0], computed.iloc[1]
    if method == "morris":
        # the elementary effect over the whole range, 2 in scale
        assert scale["mu_star"] == pytest.approx(2 * at_one[0], rel=1e-5)
        assert delay["mu_star"] == pytest.approx(0, abs=1e-12) and scale["sigma"] < 1e-6 * at_one[0]
    else:
        assert scale["S1"] == pytest.approx(1, abs=0.1)
        assert abs(delay["S1"]) < 0.15
    figure = result.plot_sensitivity("peak_drift_m")
    (axes,) = figure.axes
    factor = 1e3 if method == "morris" else 1.0  # mm
    widths = [bar.get_width() for bar in axes.patches]
    np.testing.assert_allclose(widths[:2], factor * computed[columns[0]])


def test_what_sensitivity_needs(mixed, tmp_path):
    with pytest.raises(InputError, match="nothing was sampled"):
        mixed.sensitivity()
    pytest.importorskip("SALib")
    vary = [{"field": "ground.scale_factor", "low": 0.1, "high": 5e3}, LINEAR["vary"][1]]
    plan = plan_of(vary=vary, sample={"method": "morris", "count": 4})
    swept = iso.sweep(plan, tmp_path / "sweep", workers=1)
    failed = len(swept.failed)
    assert f" cases, {failed} failed runs left out" in controllers_table(swept).title
    with pytest.raises(InputError, match="runs of passive_off failed"):
        swept.sensitivity()


def test_the_comparison_shows_medians_over_the_uncontrolled_run(mixed):
    figure = mixed.plot_comparison(["peak_drift_m", "rms_floor_acceleration_m_s2"])
    (axes,) = figure.axes
    table = mixed.table
    for container, label in zip(axes.containers, mixed.controllers, strict=True):
        shown = container.lines[0].get_ydata()
        rows = table[table["controller"] == label]
        names = ["normalised_peak_drift", "normalised_rms_floor_acceleration"]
        np.testing.assert_allclose(shown, [rows[name].median() for name in names], rtol=1e-12)
    points = [container.lines[0] for container in axes.containers]
    assert len({point.get_marker() for point in points}) == 3
    # criteria are categories: a line between them has no meaning
    assert {point.get_linestyle() for point in points} == {"None"}


def test_the_force_of_a_wall_that_is_not_touched_is_left_out(mixed, recwarn):
    untouched = Sweep(mixed.folder)
    untouched.table["peak_wall_force_N"] = np.where(untouched.table["controller"] == "on_off", 1, 0)
    (axes,) = untouched.plot_comparison(["peak_drift_m", "peak_wall_force_N"]).axes
    assert [label.get_text() for label in axes.get_xticklabels()] == ["peak\nstorey\ndrift"]
    assert not recwarn.list


def test_the_reference_is_recognised_by_what_it_is(tmp_path):
    """Under another label; and a label alone is not a reference."""
    entries = [
        {"name": "constant", "label": "passive_off", "amperes": 1.0},
        {"name": "passive_off", "label": "bare"},
    ]
    result = iso.sweep(plan_of(scenario={"controller": entries}), tmp_path / "one", workers=1)
    assert result.reference == "bare"
    peaks = result.table.set_index("controller")["peak_drift_m"]
    ratios = result.table.set_index("controller")["J4"]
    assert ratios["bare"] == 1.0 and ratios["passive_off"] != 1.0
    assert ratios["passive_off"] == pytest.approx(peaks["passive_off"] / peaks["bare"])
    assert result.plot_comparison().axes[0].get_ylabel() == "ratio to bare (-)"
    assert "J1 to J8 refer to bare." in result.to_html(tmp_path / "report.html").read_text()
    alone = iso.sweep(plan_of(scenario={"controller": entries[:1]}), tmp_path / "two", workers=1)
    assert alone.reference is None and "J4" not in alone.table


def test_points_of_many_controllers_differ_in_grey():
    looks = [(look.marker, look.filled) for look in point_looks(14)]
    assert len(set(looks)) == 14 and not any(look.joined for look in point_looks(14))


def test_the_map_shows_medians_over_what_else_is_varied(mixed):
    figure = mixed.plot_map("current", "isolators", "peak_base_shear_N")
    *panels, bar = figure.axes
    assert [panel.get_title() for panel in panels] == [
        as_written(name) for name in mixed.controllers
    ]
    assert bar.get_ylabel() == "peak base shear (kN)\nmedian over ground.scale_factor"
    rows = mixed.table[mixed.table["controller"] == "constant"]
    expected = rows.groupby(["isolators", "current"])["peak_base_shear_N"].median() / 1e3
    (mesh,) = panels[2].collections
    np.testing.assert_allclose(mesh.get_array().ravel(), expected.to_numpy(), rtol=1e-12)
    printed = [text.get_text() for text in panels[2].texts]
    assert printed == [f"{value:.3g}" for value in expected]
    for wrong in ({"x": "curent"}, {"criterion": "peak_drift"}):
        with pytest.raises(InputError, match="did you mean"):
            mixed.plot_map(**wrong)


def test_the_map_ends_where_the_values_end(tmp_path):
    """A lag cannot be negative; cells with numbers are named by their values."""
    lag = {"field": "driver.lag_s", "low": 0.0, "high": 0.06}
    scale = {"field": "ground.scale_factor", "low": 0.2, "high": 1.0}
    for counts in ((4, 3), (9, 8)):
        vary = [{**one, "count": n} for one, n in zip((lag, scale), counts, strict=True)]
        result = iso.sweep(plan_of(vary=vary), tmp_path / str(counts[0]), workers=1)
        axes = result.plot_map().axes[0]
        assert (axes.get_xlabel(), axes.get_ylabel()) == (
            "driver lag (s)", "ground scale factor (-)",
        )  # fmt: skip
        if counts[0] == 4:
            labels = [text.get_text() for text in axes.get_xticklabels()]
            assert labels == ["0", "0.02", "0.04", "0.06"]
        else:
            assert axes.get_xlim() == (0.0, 0.06) and axes.get_ylim() == (0.2, 1.0)


def test_varied_quantities_have_units(mixed, tmp_path):
    assert quantity_title(mixed, "current") == "current (A)"  # the setting's unit
    assert quantity_title(mixed, "isolators") == "isolators (-)"
    vary = [{"field": "driver.lag_s", "label": "lag [ms]", "values": [0.0, 0.01]}]
    result = iso.sweep(plan_of(vary=vary), tmp_path / "sweep", workers=1)
    assert quantity_title(result, "lag [ms]") == "lag [ms]"


def test_the_map_is_legible_in_grey(mixed):
    """Lightness rises with the value, and black print stands out from the darkest cell."""
    figure = mixed.plot_map("current", "isolators")
    (mesh,) = figure.axes[0].collections
    rgb = mesh.cmap(np.linspace(0, 1, 64))[:, :3]
    grey = rgb @ [0.299, 0.587, 0.114]
    assert (np.diff(grey) > 0).all() and grey[0] > 0.35


def test_a_map_of_mostly_small_values_shows_their_differences(mixed, monkeypatch):
    """Logarithmic colours; all panels have the levels that are marked on the colour bar."""
    monkeypatch.setattr(sweep_figures, "_MOST_PRINTED", 0)
    skewed = Sweep(mixed.folder)
    table = mixed.table.assign(current=np.tile(np.repeat(np.arange(9.0), 3), 4))
    table["peak_drift_m"] = 1e-3 * 1.5 ** table["current"] * table["isolators"]
    vars(skewed)["table"] = table
    *panels, bar = skewed.plot_map("current", "isolators", "peak_drift_m").axes
    assert isinstance(panels[0].collections[0].norm, LogNorm)
    levels = [float(each) for each in bar.get_yticks()]
    assert len(levels) >= 5
    for panel in panels:
        (lines,) = panel.collections[1:]
        assert set(lines.levels) <= set(levels)


def test_a_map_of_scattered_points_takes_intervals(tmp_path):
    vary = [
        {"field": "isolator.count", "low": 0.7, "high": 1.4},
        {"field": "ground.scale_factor", "low": 0.2, "high": 1.0},
    ]
    plan = plan_of(vary=vary, sample={"method": "sobol", "count": 128})
    result = iso.sweep(plan, tmp_path / "sweep", workers=1)
    figure = result.plot_map()
    mesh = figure.axes[0].collections[0]
    assert mesh.get_array().shape == (12, 12)
    table = result.table
    first = table[
        (table["isolator.count"] < 0.7 + 0.7 / 12) & (table["ground.scale_factor"] < 0.2 + 0.8 / 12)
    ]
    assert len(first) > 0
    assert mesh.get_array()[0, 0] == pytest.approx(first["peak_floor_acceleration_m_s2"].median())


def test_figures_draw_without_a_window_or_a_change_of_style(mixed):
    before = dict(matplotlib.rcParams)
    FigureCanvasAgg(mixed.plot_map()).draw()
    assert dict(matplotlib.rcParams) == before


def test_a_map_needs_two_numbers(tmp_path):
    plan = plan_of(vary=[{"field": "isolator.count", "values": [1.0, 2.0]}])
    result = iso.sweep(plan, tmp_path / "sweep", workers=1)
    with pytest.raises(InputError, match="two varied quantities that are numbers"):
        result.plot_map()


def test_a_folder_without_a_sweep_is_reported(tmp_path):
    with pytest.raises(InputError, match="no sweep there"):
        Sweep(tmp_path)
