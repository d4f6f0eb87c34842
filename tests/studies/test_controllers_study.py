"""The comparison study of controllers, in its short form and on a controller of one's own."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest

import isolation_sim as iso
from controllers import Controller, available_controllers, controller
from isolation_sim.errors import InputError
from isolation_sim.simulation.control import CoilDriver
from studies import controller_runs as runs
from studies import controllers as study
from studies.study import perform


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    steps = []
    folder = tmp_path_factory.mktemp("study") / "controllers"
    outcome, path = perform("controllers", folder, True, lambda what, share: steps.append(share))
    return outcome, path, steps


def rows_of(result, case):
    return {row["controller"]: row for row in result.table if row["case"] == case}


def test_short_form_leaves_a_table_a_finding_and_a_figure(short):
    result, path, steps = short
    with (path / "table.csv").open(newline="", encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == len(runs.CASES) * len(study.SHORT)
    assert "nan" not in result.finding and "inf " not in result.finding
    assert (path / "figures" / "pareto.png").stat().st_size > 20_000
    assert sum(steps) == pytest.approx(2.0)  # the progress begins at -1


def test_each_case_is_ranked_best_first_and_constants_do_no_field_work(short):
    result, _, _ = short
    for case in runs.CASES:
        rows = rows_of(result, case)
        scores = [row["J"] for row in rows.values()]
        assert scores == sorted(scores)
        assert rows["best_constant"]["excess"] == 0.0
        assert rows["passive_off"]["J"] == pytest.approx(2.0)
        assert rows["passive_off"]["excess"] >= 0.0
        for row in rows.values():
            assert row["from"] <= row["excess"] <= row["to"]
    nominal, passive = rows_of(result, "nominal"), rows_of(result, "passive")
    # energy does not enter through a current that does not change ...
    assert nominal["passive_off"]["field_J"] == pytest.approx(0.0, abs=1e-6)
    # ... and by the passive rule through none
    assert all(row["field_J"] <= 1e-6 for row in passive.values())


def test_scores_are_those_of_the_engine(short):
    result, _, _ = short
    record = study.motions(True)["El Centro"]
    isolated, driver = iso.reference_building().on(iso.reference_isolators()), CoilDriver(0.05)
    off, run = (
        iso.simulate(isolated, record, name, driver=driver) for name in ("passive_off", "on_off")
    )
    peaks = "peak_base_displacement_m", "peak_floor_acceleration_m_s2"
    expected = sum(run.criteria[key] / off.criteria[key] for key in peaks)
    assert rows_of(result, "nominal")["on_off"]["El Centro"] == pytest.approx(expected, abs=6e-4)


def test_noise_delay_and_a_wrong_nominal_model_reach_the_controllers(short):
    result, _, _ = short
    nominal, soft, stiff = (rows_of(result, c) for c in ("nominal", "soft", "stiff"))
    assert soft["clipped_lqr"]["J"] != stiff["clipped_lqr"]["J"]
    for name in ("clipped_lqr", "on_off"):
        assert soft[name]["J"] > nominal[name]["J"]
    assert soft["passive_off"]["J"] == nominal["passive_off"]["J"]


def test_every_controller_that_decides_something_is_evaluated():
    compared = study.candidates(False)
    assert set(available_controllers()) - set(compared) == set(study.NOT_EVALUATED)
    assert [one.preview for one in compared.values() if one.name == "mpc"] == [
        0.0, study.PREVIEW, 0.0, study.PREVIEW,
    ]  # fmt: skip
    random = [m for m in study.motions(False) if m != study.HOME]
    assert len(random) == study.COUNT
    tuned = {*range(81), *range(100, 103), *range(300, 440)}
    assert not tuned & {int(name.split()[-1]) for name in random}


class Outwards(Controller):
    name = "outwards"
    period = 0.1

    def measures(self, nominal):
        return ("base_displacement_m", "base_velocity_m_s")

    def current(self, t, measurement):
        outwards = measurement.base_displacement_m * measurement.base_velocity_m_s > 0
        return 3.0 if outwards else 0.0


class Leaving(Outwards):
    """Stiff on the way back: it feeds energy in until the law's range is left."""

    name = "leaving"
    period = 0.01

    def current(self, t, measurement):
        return 3.0 - super().current(t, measurement)


@pytest.fixture(scope="module")
def own():
    """Two controllers of one's own beside constants, with a bound for a cut motion."""
    record = study.motions(True)["El Centro"].cut(0.5, 3.0)
    settings = {"outwards": Outwards(), "off": controller("passive_off")}
    return study.evaluate(settings, {"El Centro": record, "again": record}, n_bounds=1)


@pytest.mark.slow
def test_a_controller_of_ones_own_is_compared_with_the_bound(own):
    rows = {row["controller"]: row for row in study.ranking(own, "nominal")}
    best = own.possible["El Centro"]
    assert best["certified"] < 5e-3
    constant = own.of("off", "nominal", "constant", ["El Centro"])[0]
    assert best["J"] < constant <= 2.0
    expected = (constant - rows["outwards"]["El Centro"]) / (constant - best["J"])
    assert rows["outwards"]["closed"] == pytest.approx(expected, abs=6e-3)
    # one motion drawn anew is itself
    assert rows["outwards"]["closed_from"] == rows["outwards"]["closed_to"]
    # the bound is that of the papers' rule
    assert all("closed" not in row for row in study.ranking(own, "passive"))
    assert "clairvoyant optimum" in study.finding(
        own, [row for case in runs.CASES for row in study.ranking(own, case)]
    )


@pytest.mark.slow
def test_an_unknown_name_is_answered_with_those_known(own):
    with pytest.raises(InputError, match="unknown case 'noise'; expected: nominal, passive, soft"):
        study.ranking(own, "noise")
    with pytest.raises(InputError, match="unknown controller 'of'; did you mean 'off'"):
        own.of("of", "nominal", "J", ["El Centro"])
    with pytest.raises(InputError, match="unknown motion 'Kobe'; expected: El Centro, again"):
        own.of("off", "nominal", "J", ["Kobe"])


def test_the_share_closed_is_a_mean_over_the_motions_that_have_a_bound():
    """Shares of 0.2, 0.4 and 0.6, and a motion whose bound a controller passes."""
    scores = {"El Centro": 1.8, "a": 1.6, "b": 1.4, "c": 0.9}
    row = {"controller": "mine", "constant": 2.0, "base": 0.5, "floor": 0.5, "bounded": True}
    row |= {runs.BASE: 0.1, runs.FLOOR: 1.0}
    evaluation = study.Evaluation(
        {(case, m): [row | {"J": score}] for case in runs.CASES for m, score in scores.items()},
        {m: [] for m in scores},
        {m: {"J": 1.0, "certified": 1e-4} for m in scores},
    )
    assert evaluation.solved == ["El Centro", "a", "b"]
    constants = {m: [] for m in ("a", "b", "c")}
    away = replace(evaluation, constants=constants, possible={})
    (own,) = study.ranking(away, "nominal")
    assert (own["J"], "El Centro" in own) == (1.3, False)
    table = [one for case in runs.CASES for one in study.ranking(evaluation, case)]
    first = table[0]
    assert first["closed"] == pytest.approx(0.4, abs=1e-3)
    low, high = first["closed_from"], first["closed_to"]
    assert 0.2 - 1e-6 <= low < 0.4 < high <= 0.6 + 1e-6
    text = study.finding(evaluation, table)
    assert f"mine 40 % ({100 * low:.0f} to {100 * high:.0f})" in text
    assert "No bound for c:" in text


def test_the_figure_shows_every_controller_and_the_bound(own):
    drawing = study.figure(own)
    labels = drawing.axes[0].get_legend_handles_labels()[1]
    assert set(labels) == {"constant currents", "equal J", "outwards", "off", "clairvoyant"}
    (off,) = [line for line in drawing.axes[0].lines if line.get_label() == "off"]
    assert off.get_xydata() == pytest.approx(np.array([[1.0, 1.0]]))


def test_no_two_controllers_of_the_figure_look_the_same():
    names, line = list(study.candidates(short=False)), [{"base": 1.0, "floor": 1.0}] * 2
    rows = [{"controller": name, "base": 1.0, "floor": 1.0, "J": 2.0} for name in names]
    evaluation = study.Evaluation(
        {("nominal", m): rows for m in ("El Centro", "a")}, {"El Centro": line, "a": line}, {}
    )
    axes = study.figure(evaluation).axes[0]
    drawn = [line for line in axes.lines if line.get_label() in names]
    looks = {(one.get_marker(), one.get_color(), one.get_fillstyle()) for one in drawn}
    assert len(looks) == len(drawn) == len(names)


def test_what_is_not_bounded_is_reported():
    record = study.motions(True)["El Centro"].padded(after=20.0)
    (row,) = runs.run_candidates({"leaving": Leaving()}, record, runs.Case())
    assert not row["bounded"]
    evaluation = study.Evaluation(
        {(case, m): [row] for case in runs.CASES for m in ("El Centro", "again")},
        {m: runs.constants(record) for m in ("El Centro", "again")},
        {},
    )
    table = [row for case in runs.CASES for row in study.ranking(evaluation, case)]
    assert {row["unbounded"] for row in table} == {2}
    assert "not bounded, with how many motions: leaving (2)" in study.finding(evaluation, table)


def test_interval_is_that_of_the_mean():
    draw = np.random.default_rng(3)
    differences = draw.normal(-0.1, 0.2, 200)
    low, high = study.interval(differences)
    half = 1.96 * differences.std() / np.sqrt(200)
    assert low == pytest.approx(differences.mean() - half, abs=0.1 * half)
    assert high == pytest.approx(differences.mean() + half, abs=0.1 * half)
