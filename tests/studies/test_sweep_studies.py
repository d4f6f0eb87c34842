"""The studies that are sweeps, in their short forms: what they say is in their tables."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from isolation_sim.cli import app
from isolation_sim.errors import InputError
from isolation_sim.registry import STUDIES
from isolation_sim.sweeps import Sweep
from isolation_sim.sweeps.design import Design
from isolation_sim.sweeps.plan import SweepPlan
from studies import (
    device_scaling,
    fragility,
    level_and_period,
    moat_wall,
    robustness,
)
from studies.study import perform

SWEEPS = {
    "level_and_period": level_and_period,
    "fragility": fragility,
    "robustness": robustness,
    "device_scaling": device_scaling,
    "moat_wall": moat_wall,
}
LONG = ("fragility", "robustness")


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """Run a study in its short form, once."""
    folder, done = tmp_path_factory.mktemp("studies"), {}

    def run(name):
        if name not in done:
            steps = []
            outcome, path = perform(
                name, folder / name, True, lambda what, share: steps.append(share)
            )
            done[name] = outcome, path, steps
        return done[name]

    return run


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[pytest.mark.slow] if n in LONG else []) for n in SWEEPS],
)
def test_a_study_leaves_a_table_a_finding_a_figure_and_its_sweep(short, name):
    result, path, steps = short(name)
    with (path / "table.csv").open(newline="", encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == len(result.table) > 0
    assert result.finding in (path / "finding.txt").read_text(encoding="utf-8")
    assert "nan" not in result.finding and "inf " not in result.finding
    page = (path / "report.html").read_text(encoding="utf-8")
    assert page.count("data:image/svg+xml") == len(result.figures) and len(page) < 6_000_000
    for stem in result.figures:
        assert (path / "figures" / f"{stem}.png").stat().st_size > 20_000
        assert (path / "figures" / f"{stem}.svg").is_file()
    assert Sweep(path / "sweep").counts.keys() == {"ok"}
    assert sum(steps) == pytest.approx(2.0)  # the progress begins at -1


@pytest.mark.parametrize("name", SWEEPS)
def test_the_whole_plan_can_be_run(name):
    plan = SWEEPS[name].plan(False)
    design = Design(SweepPlan.from_dict(plan))
    assert design.n_runs > 4 * Design(SweepPlan.from_dict(SWEEPS[name].plan(True))).n_runs


def test_a_pair_of_period_and_current_keeps_the_base_within_its_gap(short):
    result, path, _ = short("level_and_period")
    runs = Sweep(path / "sweep").table
    assert result.table
    for row in result.table:
        assert row["peak_base_displacement_m"] <= row["gap_m"]
        within = runs[
            (runs["motion"] == row["motion"]) & (runs["peak_base_displacement_m"] <= row["gap_m"])
        ]
        least = within["peak_floor_acceleration_m_s2"].min()
        assert row["peak_floor_acceleration_m_s2"] == least


def test_designs_of_one_stiffness_have_one_period_and_the_reference_has_two_seconds():
    assert device_scaling.period(10.0, device_scaling.REFERENCE_COUNT) == pytest.approx(2.0)
    assert device_scaling.period(5.0, 40) == device_scaling.period(20.0, 10)
    assert device_scaling.period(10.0, 40) == pytest.approx(device_scaling.period(10.0, 10) / 2)


def test_a_larger_isolator_is_strained_less(short):
    result, path, _ = short("device_scaling")
    runs = Sweep(path / "sweep").table
    runs["strain"] = runs["peak_base_displacement_m"] / runs["size"].astype(float)
    small, large = (runs[runs["size"] == size]["strain"].median() for size in ("10", "30"))
    assert large < small
    for row in result.table:
        assert row["peak_base_displacement_m"] <= row["size"] * device_scaling.TESTED


def test_a_gap_that_the_base_does_not_fill_changes_nothing(short):
    _, path, _ = short("moat_wall")
    runs = Sweep(path / "sweep").table.set_index(["controller", "gap_m"])
    for controller in moat_wall.SHORT:
        free = runs.loc[(controller, moat_wall.WIDE)]
        for gap in (0.2, 0.3):
            walled = runs.loc[(controller, gap)]
            touched = free["peak_base_displacement_m"] > gap
            ratio = walled["peak_floor_acceleration_m_s2"] / free["peak_floor_acceleration_m_s2"]
            assert ratio > 1.5 if touched else ratio == pytest.approx(1.0, rel=1e-5)
            # a stiff wall lets the base go but little beyond the gap
            assert walled["peak_base_displacement_m"] < gap + 0.05


@pytest.mark.slow
def test_late_commands_cost_more_by_the_papers_rule_than_by_the_passive_one(short):
    result, _, _ = short("robustness")
    late = {row["switching"]: row["40 ms late"] / row["right and prompt"] for row in result.table}
    assert late["instantaneous"] > 2 * late["passive"]


def test_capacity_is_where_the_demand_first_crosses_the_limit():
    levels = np.array([0.1, 0.2, 0.4])
    assert fragility.capacity(levels, np.array([1.0, 3.0, 2.0]), 2.0) == pytest.approx(0.15)
    assert fragility.capacity(levels, np.array([4.0, 5.0, 6.0]), 2.0) == pytest.approx(0.05)
    assert fragility.capacity(levels, np.array([1.0, np.nan, np.nan]), 2.0) == 0.2
    assert fragility.capacity(levels, np.array([0.5, 1.0, 1.9]), 2.0) == np.inf


def test_maximum_likelihood_recovers_a_lognormal_with_and_without_censoring():
    draw = np.random.default_rng(1)
    capacities = 0.3 * np.exp(0.4 * draw.standard_normal(4000))
    whole = fragility.fit_lognormal(capacities, 10.0)
    assert whole.median == pytest.approx(np.exp(np.log(capacities).mean()))
    assert whole.dispersion == pytest.approx(np.log(capacities).std())
    # what lies beyond the levels is known to do so, and no more
    cut = np.where(capacities > 0.35, np.inf, capacities)
    censored = fragility.fit_lognormal(cut, 0.35)
    assert censored.median == pytest.approx(0.3, rel=0.03)
    assert censored.dispersion == pytest.approx(0.4, rel=0.06)
    assert fragility.fit_lognormal(np.array([np.inf, np.inf]), 1.0).probability(0.5) == 0.0


def test_bounds_narrow_with_more_motions():
    draw = np.random.default_rng(2)
    widths = []
    for count in (10, 160):
        capacities = 0.3 * np.exp(0.4 * draw.standard_normal(count))
        medians = [fit.median for fit in fragility.bootstrap_fits(capacities, 10.0, 300)]
        widths.append(np.log(np.percentile(medians, 97.5) / np.percentile(medians, 2.5)))
    # about 2 * 1.96 * 0.4 / sqrt(n)
    assert widths == pytest.approx([0.50, 0.124], rel=0.3)


def test_command_prints_a_table_and_the_finding(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["study", "moat_wall", "--short"])
    assert result.exit_code == 0
    assert "room" in result.stdout and "near-fault pulse" in result.stdout
    assert result.stdout.splitlines()[-1].endswith("results/moat_wall")
    result = CliRunner().invoke(app, ["study", "moat_wall", "--short", "--json"])
    report = json.loads(result.stdout)
    assert len(report["table"]) == len(moat_wall.SHORT) and report["finding"]
    assert (tmp_path / "results" / "moat_wall-2" / "table.csv").is_file()


def test_every_study_has_a_command():
    page = CliRunner().invoke(app, ["study", "--help"]).stdout
    assert all(name in page for name in STUDIES)


def test_a_study_that_is_not_there_is_refused():
    with pytest.raises(InputError, match="moat_wall"):
        perform("moat_walls")
