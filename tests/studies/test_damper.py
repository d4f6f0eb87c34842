"""The damper study in a short form, on the measured runs."""

from __future__ import annotations

import numpy as np
import pytest

from studies import damper

LABEL = "10mm_1Hz"


@pytest.fixture(scope="module")
def campaign(shared_data):
    return damper.read_shortened(shared_data / "mr_damper")


FAST = ("hyperbolic_tangent", "dahl")
STUDY = ("lugre", "bouc_wen")


@pytest.fixture(scope="module", params=[FAST, STUDY], ids=["fast", "study"])
def outcomes(request, shared_data):
    few = damper.read_shortened(shared_data / "mr_damper", cycles=2, samples=50)
    return damper.fit_laws(few, [LABEL, "0.5 A"], request.param, starts=1)


def test_conditions_and_currents_come_from_the_names(campaign):
    assert len(campaign.runs) == 18
    assert len(damper.conditions(campaign)) == 6
    assert damper.conditions(campaign)[0] == "25mm_0.1Hz"
    assert damper.currents(campaign) == ["0 A", "0.5 A", "1 A"]
    held = damper.without(campaign, LABEL).held_out
    assert [damper.condition(run) for run in held] == [LABEL] * 3


def test_runs_keep_enough_samples_a_cycle(campaign):
    for run in campaign.runs:
        assert 300 <= len(run.time) <= 900


@pytest.mark.slow
def test_laws_reproduce_runs_that_they_have_not_seen(outcomes):
    for outcome in outcomes:
        assert outcome.fits[damper.EVERYTHING].error < 0.2
        assert outcome.left_out(LABEL) < 0.2
        # the tests at 0 A do not determine the bristles of LuGre
        assert outcome.left_out("0.5 A") < 0.5


@pytest.mark.slow
def test_the_verdict_names_a_winner_and_where_it_gains(outcomes):
    said = damper.verdict(outcomes, [LABEL], ["0.5 A"])
    assert "has the smallest error" in said and "near reversal" in said and "nan" not in said
    best = min(outcomes, key=lambda outcome: outcome.left_out(LABEL))
    assert said.startswith(f"On conditions left out {best.law} ")
    assert damper.table(outcomes, [LABEL, "0.5 A"]).row_count == 3


@pytest.mark.slow
def test_the_figure_shows_runs_not_seen(outcomes):
    figure = damper.figure(outcomes, [LABEL])
    assert len(figure.axes) == 2
    for axis in figure.axes:
        assert len(axis.lines) == 3
        assert all(np.isfinite(line.get_ydata()).all() for line in axis.lines)
