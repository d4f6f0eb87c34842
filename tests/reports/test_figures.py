"""Figures: units on every axis, nothing overlaps or is cut off, lines that grey keeps apart."""

import itertools
import re
import subprocess
import sys
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread

import isolation_sim as iso
from ground_motions import Record
from isolation_sim.comparison import Comparison
from isolation_sim.reports import figures
from isolation_sim.reports.drawing import drawing_title, structure_drawing
from isolation_sim.reports.html.run_report import write_comparison
from isolation_sim.reports.loops_fitted import fitted_loops, strong_end
from isolation_sim.reports.references import of_scenarios
from isolation_sim.reports.style import (
    DOUBLE_COLUMN,
    contour_lines,
    line_styles,
    new_figure,
    style,
)
from isolation_sim.scenario import Scenario
from isolation_sim.simulation.ledger import Ledger
from isolation_sim.simulation.outputs import output_names
from isolation_sim.structures import IsolatedStructure, plan_building
from isolation_sim.written_names import as_written

from ..sampled_criteria import response_of

UNIT = re.compile(r"\((s|m/s²|mm|A|kN|kJ|-)\)$")

OF_RUNS = {
    "time_histories": figures.time_histories,
    "loops": figures.loops,
    "currents": figures.currents,
    "floor_envelopes": figures.floor_envelopes,
    "energy_figure": figures.energy_figure,
}


def drawn_texts(figure):
    """Texts that are drawn, with their boxes in pixels."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    texts = [*figure.texts]
    if figure._suptitle is not None and figure._suptitle not in texts:
        texts.append(figure._suptitle)
    for legend in figure.legends:
        texts += legend.get_texts()
    for axes in figure.axes:
        texts += [axes.title, axes._left_title, axes._right_title, *axes.texts]
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            texts += [axis.label, axis.offsetText]
            texts += [
                tick.label1
                for tick in axis.get_major_ticks()
                if low - 1e-9 <= tick.get_loc() <= high + 1e-9
            ]
    shown = [text for text in texts if text.get_visible() and text.get_text().strip()]
    return [(text.get_text(), text.get_window_extent(renderer)) for text in shown]


def check_texts(figure):
    """No text is cut off or lies on another."""
    texts = drawn_texts(figure)
    for (one, a), (other, b) in itertools.combinations(texts, 2):
        across = min(a.x1, b.x1) - max(a.x0, b.x0)
        along = min(a.y1, b.y1) - max(a.y0, b.y0)
        assert across < 0.5 or along < 0.5, f"{one!r} overlaps {other!r}"
    for text, box in texts:
        inside = (
            -0.5 <= box.x0
            and -0.5 <= box.y0
            and box.x1 <= figure.bbox.x1 + 0.5
            and box.y1 <= figure.bbox.y1 + 0.5
        )
        assert inside, f"{text!r} is cut off"


def check(figure):
    """Everything that holds for all figures."""
    check_texts(figure)
    for axes in figure.axes:
        for axis, siblings in (
            (axes.xaxis, axes.get_shared_x_axes()),
            (axes.yaxis, axes.get_shared_y_axes()),
        ):
            labels = [
                getattr(other, f"get_{axis.axis_name}label")()
                for other in siblings.get_siblings(axes)
            ]
            assert any(UNIT.search(label) for label in labels), f"no unit in {labels}"
        looks = [
            (
                line.get_linestyle(),
                line._unscaled_dash_pattern,
                line.get_marker(),
                line.get_linewidth() > 1.5,
            )
            for line in axes.lines
        ]
        assert len(set(map(str, looks))) == len(looks), "lines that only their colour tells apart"
    assert figure.get_figwidth() == DOUBLE_COLUMN


@pytest.mark.parametrize("name", OF_RUNS)
@pytest.mark.parametrize("value", ["one", "seven"])
def test_figures_of_runs(name, value, runs, seven):
    chosen = {"one": runs["on_off"], "seven": seven}[value]
    check(OF_RUNS[name](chosen))


def test_figure_of_one_run(runs):
    figure = runs["on_off"].plot()
    check(figure)
    assert len(figure.axes) == 8


def test_a_figure_of_one_run_fits_one_column(runs):
    figure = runs["on_off"].plot(width_in=3.5)
    figure.draw_without_rendering()
    assert len(figure.axes) == 8
    inside = figure.bbox
    parts = [*(axes.get_tightbbox() for axes in figure.axes), figure.legends[0].get_window_extent()]
    for k, one in enumerate(parts):
        assert inside.x0 <= one.x0 and one.x1 <= inside.x1
        assert not any(one.overlaps(other) for other in parts[k + 1 :])
    with pytest.raises(iso.InputError, match=r"width_in: given 2\.5; expected: 3 or more"):
        runs["on_off"].plot(width_in=2.5)


def test_two_directions_without_coils(passive_biaxial):
    figure = figures.run_figure(passive_biaxial, direction="y")
    check(figure)
    assert len(figure.axes) == 7  # no panel of the current
    deformation = figure.axes[3].lines[0].get_xdata()
    expected = 1e3 * passive_biaxial.output("isolator_y_deformation_m")
    assert deformation == pytest.approx(expected)
    levels = [label.get_text() for label in figure.axes[4].get_yticklabels()]
    assert levels == ["base", "floor1"]
    histories = figures.time_histories(passive_biaxial, direction="y")
    names = [axes.get_ylabel() for axes in histories.axes]
    assert names == ["Ground\nacc. y (m/s²)", "Base\ndisp. y (mm)", "Roof\nacc. y (m/s²)"]
    with pytest.raises(iso.InputError, match="no run has a coil"):
        figures.currents(passive_biaxial)


@pytest.mark.usefixtures("no_drawing")
def test_a_folder_of_results_has_the_time_histories_of_both_directions(passive_biaxial, tmp_path):
    write_comparison(Comparison({"off": passive_biaxial}), tmp_path)
    histories = {path.stem for path in (tmp_path / "figures").glob("time_histories*")}
    assert histories == {"time_histories", "time_histories_y"}


class StubRun(SimpleNamespace):
    """What the figures need of a run."""

    __class__ = iso.Run


def test_a_structure_without_elements(ground):
    isolated = IsolatedStructure(iso.reference_building().fixed_base(), ())
    names, n = output_names(isolated), len(ground)
    values = np.sin(np.arange(n))[:, None] * np.arange(1, len(names) + 1)
    run = StubRun(
        isolated=isolated,
        records=(ground,),
        time=ground.time,
        controller="none",
        values=values,
        outputs=SimpleNamespace(names=names),
        current=np.zeros((n, 0)),
        energy=Ledger(ground.time, *np.zeros((9, n)), closure_error=0.0),
    )
    response = response_of(run)
    run.peaks = {
        "floor_acceleration_m_s2": np.abs(response.floor_acceleration).max(axis=0),
        "drift_m": np.abs(response.drift).max(axis=0),
    }
    figure = figures.run_figure(run)
    check(figure)
    assert len(figure.axes) == 6  # neither a loop nor a current
    _, base, *_ = figure.axes
    assert base.lines[0].get_ydata() == pytest.approx(1e3 * values[:, 0])
    with pytest.raises(iso.InputError, match="no element"):
        figures.loops({"fixed base": run})


def test_a_tall_building(ground):
    tall = iso.shear_building([2e5] * 30, [8e8] * 30, base_mass=2e5)
    run = iso.simulate(tall.on(iso.reference_isolators(), 4), ground, "passive_on")
    check(figures.floor_envelopes(run))
    check(figures.run_figure(run))


def test_what_is_drawn_is_the_run(runs):
    run = runs["passive_on"]
    _, base, roof, current = figures.time_histories(run).axes
    assert base.lines[0].get_ydata() == pytest.approx(1e3 * run.output("base_displacement_m"))
    assert roof.lines[0].get_ydata() == pytest.approx(run.output("floor5_acceleration_m_s2"))
    assert current.lines[0].get_ydata() == pytest.approx(run.current[:, 0])
    acceleration, drift = figures.floor_envelopes(run).axes
    assert max(acceleration.lines[0].get_xdata()) == run.criteria["peak_floor_acceleration_m_s2"]
    assert max(drift.lines[0].get_xdata()) == 1e3 * run.criteria["peak_drift_m"]


def test_many_histories_are_drawn_apart(runs, seven):
    """Each run before the reference, which is found by what it is and not by its name."""
    renamed = {
        "bare": runs["on_off"],
        "soft": runs["passive_off"],
        **dict(list(seven.items())[1:4]),
    }
    figure = figures.time_histories(renamed)
    above, *panels = figure.axes
    assert len(panels) == 3 * 4 and len(above.lines) == 1
    rows = [panels[k : k + 3] for k in range(0, 12, 3)]
    assert [row[0].get_title(loc="left") for row in rows] == [
        as_written(name) for name in renamed if name != "soft"
    ]
    grey, black = rows[0][0].lines
    off, on_off = (1e3 * runs[k].output("base_displacement_m") for k in ("passive_off", "on_off"))
    assert grey.get_ydata() == pytest.approx(off) and black.get_ydata() == pytest.approx(on_off)
    assert len({panel.get_ylim() for panel, *_ in rows}) == 1
    # a few runs are still drawn on each other
    assert len(figures.time_histories(runs).axes[1].lines) == 3


@pytest.mark.parametrize(
    "count", [1, 2, 5, *(pytest.param(n, marks=pytest.mark.slow) for n in (3, 4, 6, 7))]
)
def test_the_page_of_energies_has_no_empty_panel(count, seven):
    figure = figures.energy_figure(dict(list(seven.items())[:count]))
    check(figure)
    *_, residuals = figure.axes
    cells = sum(
        len(axes.get_subplotspec().colspan) * len(axes.get_subplotspec().rowspan)
        for axes in figure.axes
    )
    grid = residuals.get_gridspec()
    assert len(figure.axes) == count + 1 and cells == grid.nrows * grid.ncols


def test_panels_of_one_figure_share_their_axes(runs):
    axes = figures.loops(runs).axes
    assert len({panel.get_xlim() for panel in axes}) == 1
    assert len({panel.get_ylim() for panel in axes}) == 1
    assert [panel.get_title() for panel in axes] == [*map(as_written, runs)]


def test_the_stack_of_energies_ends_at_what_was_supplied(runs):
    run = runs["on_off"]
    axes = figures.energy_figure(run).axes[0]
    top = max(layer.get_xy()[:, 1].max() for layer in axes.patches)
    supplied = 1e-3 * (run.energy.input_J + run.energy.field_work_J).max()
    assert top == pytest.approx(supplied, rel=1e-3)


@pytest.mark.parametrize("count", [1, 7, 10, 40])
def test_loops_of_a_fit(count):
    phase = np.linspace(0, 4 * np.pi, 200)
    errors = []
    for k in range(count):
        run = SimpleNamespace(
            name=f"{k:02d}_sine_8mm_0.5Hz_1A", time=phase, hold_out=k % 3 == 0,
            displacement=1e-3 * (k + 1) * np.sin(phase), force=100 * (k + 1) * np.cos(phase),
        )  # fmt: skip
        errors.append(SimpleNamespace(run=run, force=1.1 * run.force, relative=0.1))
    figure = fitted_loops(SimpleNamespace(errors=errors))
    check_texts(figure)
    assert figure.axes[0].get_ylabel() in ("Force (N)", "Force (kN)")
    assert figure.axes[-1].get_xlabel() == "Deformation (mm)"
    # the smallest loop fills its panel as the largest does
    for panel in figure.axes:
        drawn = panel.lines[0].get_xdata()
        assert np.ptp(drawn) > 0.8 * np.ptp(panel.get_xlim())


def test_the_loop_of_an_earthquake_is_not_its_quiet_end():
    time = np.arange(4000) / 100
    sine, quake = np.sin(6 * time), np.exp(-((time - 10) ** 2) / 20) * np.sin(6 * time)
    assert strong_end(sine, sine) == slice(2800, 4000, 1)
    assert strong_end(sine[:500], sine[:500]) == slice(0, 500, 1)
    assert np.max(np.abs(quake[strong_end(quake, quake)])) > 0.9


@pytest.mark.parametrize("count", [2100, 4300, 10_000])
def test_the_loop_of_a_slow_test_is_closed(count):
    time = np.arange(count) / 1000  # cycles of 2000 samples
    sine = np.sin(np.pi * time) + 0.01 * np.random.default_rng(0).standard_normal(count)
    shown = strong_end(sine, sine)
    assert shown.stop - shown.start >= min(3990, count)
    assert len(sine[shown]) <= 1200


def test_no_value_of_a_contour_is_cut_off():
    x, y = np.linspace(1, 3, 9), np.linspace(0, 1, 7)
    with style():
        figure = new_figure(DOUBLE_COLUMN / 2, 2.0)
        panel = figure.add_subplot()
        levels = np.linspace(0, 10, 21)
        contour_lines(panel, x, y, 3 * x + np.outer(y, 1 + np.sin(4 * x)), levels, "%.1f mm")
    FigureCanvasAgg(figure).draw()
    selected = [text for text in panel.texts if text.get_visible()]
    assert 5 < len(selected) < len(panel.texts)
    frame = panel.get_window_extent()
    for text in selected:
        box = text.get_window_extent()
        middle = [(box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2]
        assert frame.contains(*middle)
        assert min(middle[0] - frame.x0, frame.x1 - middle[0]) > 0.03 * frame.width


def test_runs_without_names(runs):
    run = runs["on_off"]
    labels = [axes.get_title() for axes in figures.loops([run, run]).axes]
    assert labels == ["on-off", "on-off 2"]


def test_refusals(runs):
    with pytest.raises(iso.InputError, match="one run or more"):
        figures.time_histories({})
    with pytest.raises(iso.InputError, match="one run or more"):
        figures.energy_figure([])
    with pytest.raises(iso.InputError, match="unknown direction 'y'"):
        figures.time_histories(runs, direction="y")
    with pytest.raises(iso.InputError, match="unknown element 'isolater'; did you mean 'isolator'"):
        figures.loops(runs, element="isolater")


def test_the_users_settings_stay(runs):
    with matplotlib.rc_context({"font.size": 21.0, "lines.linewidth": 5.0}):
        before = dict(matplotlib.rcParams)
        figure = figures.time_histories(runs)
        assert dict(matplotlib.rcParams) == before
        assert figure.axes[0].yaxis.label.get_fontsize() == 8.0
        with pytest.raises(ZeroDivisionError), style():
            1 / 0  # noqa: B018
        assert dict(matplotlib.rcParams) == before


def test_styles_differ_by_more_than_colour():
    for markers in (False, True):
        looks = [(str(s["linestyle"]), s["marker"]) for s in line_styles(28, markers=markers)]
        assert len(set(looks)) == 28


def test_saved_files(runs, tmp_path):
    figure = figures.loops(runs)
    svg, png = figures.save(figure, tmp_path / "new" / "folder", "loops")
    assert (svg.name, png.name) == ("loops.svg", "loops.png")
    paths = re.findall(r' d="([^"]*)"', svg.read_text("utf-8"))
    assert max(map(len, paths)) > 1000 and not re.search(r"\.\d{3}", "".join(paths))
    assert sorted(path.name for path in svg.parent.iterdir()) == ["loops.png", "loops.svg"]
    assert imread(png).shape[1] == round(200 * DOUBLE_COLUMN)
    first = svg.read_bytes()
    figures.save(figures.loops(runs), svg.parent, "loops")
    assert svg.read_bytes() == first


def test_no_text_is_cut_off_in_the_saved_picture(tmp_path):
    """Texts are wider at 200 dots per inch; both files have a layout with room for them."""
    with style():
        figure = new_figure(DOUBLE_COLUMN, 2.0)
        axes = figure.add_subplot()
        axes.set_yticks([0, 1], ["25mm_0.25Hz_0A, held out, run", "short"])
        axes.tick_params(axis="y", labelsize=6)
    figures.save(figure, tmp_path, "labels")
    picture = imread(tmp_path / "labels.png")[..., :3].mean(axis=2)
    assert (picture[:, :3] == 1.0).all()


def test_a_figure_that_cannot_be_drawn_leaves_no_file(tmp_path):
    class Broken(Figure):
        def savefig(self, path, **options):
            path.write_text("half")
            raise RuntimeError("broken")

    with pytest.raises(RuntimeError):
        figures.save(Broken(), tmp_path, "broken")
    assert not list(tmp_path.iterdir())


def test_drawing_libraries_are_loaded_when_used():
    modules = "criteria", "comparison", "reports.figures", "reports.tables"
    code = "; ".join(f"import isolation_sim.{name}" for name in modules)
    code += "; import sys; print({'matplotlib', 'rich', 'xarray'} & set(sys.modules))"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "set()"


def test_the_building_from_above_has_every_floor_and_isolator():
    building = plan_building([2e5] * 3, [3e8] * 3, [3e8] * 3, base_mass=3e5, plan=(20.0, 12.0))
    drawn = structure_drawing(building.on(iso.law("strain_stiffening"), biaxial=True))
    side, plan, space = drawn.axes
    assert (side.get_title(loc="left"), plan.get_xlabel()) == ("from the side", "x (m)")
    titles = {title for axes in drawn.axes if (title := axes.get_title(loc="left"))}
    boxes = [box for text, box in drawn_texts(drawn) if text in titles]
    assert len(boxes) == 3
    assert all(box.x0 >= 0 and box.x1 <= drawn.bbox.x1 for box in boxes)
    assert len(space.collections) == 4  # floors and base
    assert len(space.lines) == 4 + len(building.isolator_positions)  # columns and isolators


def test_yielding_storeys_walls_and_soil_are_drawn_with_units():
    scenario = Scenario.from_toml(
        "[yielding]\nyield_shear_N = [2e6, 1.8e6, 1.5e6, 1.2e6, 8e5]\n"
        "[moat_wall]\ngap_m = 0.1\nstiffness_N_per_m = 1e8\n"
        "[soil]\nradius_m = 12.0\nshear_wave_velocity_m_s = 200.0\nfoundation_mass_kg = 4e5\n"
    )
    isolated = scenario.build().isolated
    shown = [text.get_text() for text in structure_drawing(isolated).axes[0].texts]
    assert "yield shear 1800 kN" in shown
    assert "wall: gap 100 mm,\nstiffness 100 kN/mm" in shown
    sway = 8 * 1800 * 200**2 * 12 / (2 - 0.33)
    assert f"soil: sway, {1e-6 * sway:.5g} kN/mm" in shown
    # they are no publications
    assert not any("kN" in citation.text for citation in of_scenarios([scenario]))


@pytest.mark.parametrize("name", ["time_histories", "floor_envelopes"])
def test_very_long_names(name, runs):
    settings = {f"{key}_with_a_new_model_of_the_device_and_its_coil": r for key, r in runs.items()}
    check(OF_RUNS[name](settings))


def test_the_drawing_names_every_kind_of_isolator():
    isolated = iso.reference_building().on(iso.reference_isolators())
    bearing = iso.law("kelvin_voigt", {"k": 4e6, "c": 1e5})
    mixed = isolated.with_element(bearing, "base", name="rubber bearings")
    shown = [text.get_text() for text in structure_drawing(mixed).axes[0].texts]
    assert "isolator:\nstrain_stiffening, with coil" in shown
    assert "rubber bearings:\nkelvin_voigt" in shown
    assert drawing_title(mixed) == "The structure: storeys and isolators"


def test_floor_spectra_are_those_of_the_accelerations(runs):
    run = runs["passive_off"]
    spectra = run.floor_spectra([0.0, 0.5], damping=0.02)
    assert list(spectra) == ["base", *(f"floor{k}" for k in range(1, 6))]
    acceleration = run.output("floor5_acceleration_m_s2")
    roof = Record(acceleration, run.records[0].dt).spectrum([0.0, 0.5], 0.02)
    # without switching, nearly as between straight lines through the samples
    np.testing.assert_allclose(spectra["floor5"].sa, roof.sa, rtol=0.01)
    peak = run.criteria["peak_floor_acceleration_m_s2"]
    assert max(each.sa[0] for each in spectra.values()) == pytest.approx(peak, rel=1e-3)
    drawn = iso.Comparison(runs).plot("floor_spectra")
    assert [axes.get_title() for axes in drawn.axes] == list(spectra)
    with pytest.raises(iso.InputError, match="direction"):
        run.floor_spectra(direction="y")
