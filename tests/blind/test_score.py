"""Scoring on diagnoses written by hand."""

from __future__ import annotations

import pytest

from studies.blind.cases import Truth
from studies.blind.score import Rate, Scored, confusion_table, median_held_out_ratio, rates


def truth(*effects, forms=("any",), severities=(1.0,), depends_on=(), tolerated=()):
    sizes = (0.02,) * len(effects)
    return Truth(
        "bouc_wen", effects, forms, severities, sizes, sizes, frozenset(depends_on),
        frozenset(tolerated),
    )  # fmt: skip


def diagnosis(*causes, verdict="explained", depends_on=(), held_out=0.012, **parameters):
    return {
        "verdict": verdict,
        "causes": [{"name": name, "parameters": parameters} for name in causes],
        "depends_on": list(depends_on),
        "error_after": {"fit": 0.01, "held_out": held_out},
    }


def scored(kind, hidden, result):
    return Scored(kind, hidden, result, 0.010)


SINGLE = truth("end_stop")
PAIR = truth("end_stop", "current_lag")


def test_rates_by_kind():
    results = [
        scored("single", SINGLE, diagnosis("end_stop", "current_lag")),
        scored("single", SINGLE, diagnosis("current_lag", "end_stop")),
        scored("single", SINGLE, diagnosis(verdict="adequate")),
        scored("pair", PAIR, diagnosis("current_lag", "end_stop")),
        scored("pair", PAIR, diagnosis("end_stop")),
        scored("triple", truth("end_stop", "current_lag", "force_offset"), diagnosis("end_stop")),
        scored("clean", truth(), diagnosis(verdict="adequate")),
        scored("clean", truth(), diagnosis(verdict="unexplained")),
        scored("wrong_law", truth(), diagnosis(verdict="unexplained")),
    ]
    values = {name: (rate.hits, rate.cases) for name, rate in rates(results).items()}
    assert values == {
        "single named first": (1, 3),
        "single named, nothing beside it": (0, 3),
        "pair both named": (1, 2),
        "pair named, nothing beside it": (1, 2),
        "triple all named": (0, 1),
        "false alarm on clean data": (1, 2),
        "outside not blamed on the catalogue": (0, 0),
        "outside's variables named": (0, 0),
        "wrong law noticed": (1, 1),
        "intervals that cover": (0, 0),
    }


@pytest.mark.parametrize(
    ("computed", "not_blamed", "named"),
    [
        (diagnosis(verdict="unexplained", depends_on=["current", "velocity"]), 1, 1),
        (diagnosis(verdict="unexplained", depends_on=["I", "v", "x"]), 1, 1),
        (diagnosis(verdict="unexplained", depends_on=["I", "v", "x", "time"]), 1, 0),
        (diagnosis(verdict="unexplained", depends_on=["v"]), 1, 0),
        (diagnosis("coulomb_friction", depends_on=["I", "v"]), 0, 1),
        (diagnosis("x^2 v", depends_on=["I", "v"]), 1, 1),
        (diagnosis(verdict="adequate"), 0, 0),
    ],
)
def test_outside(computed, not_blamed, named):
    hidden = truth("outside:current_velocity_squared", depends_on="Iv")
    result = rates([scored("outside", hidden, computed)])
    assert result["outside not blamed on the catalogue"].hits == not_blamed
    assert result["outside's variables named"].hits == named


def test_tolerated_variables_are_no_strangers():
    hidden = truth("outside:wandering_stiffness", depends_on="t", tolerated="xvI")
    result = diagnosis(verdict="unexplained", depends_on=["t", "x", "v", "I"])
    assert rates([scored("outside", hidden, result)])["outside's variables named"].hits == 1


@pytest.mark.parametrize(("low", "high", "hit"), [(1.8, 2.3, 1), (-2.3, -1.8, 1), (2.1, 3.0, 0)])
def test_intervals(low, high, hit):
    parameter = {"value": (low + high) / 2, "low": low, "high": high, "unit": "N"}
    hidden = truth("force_offset", forms=("same_everywhere",), severities=(2.0,))
    result = diagnosis("force_offset", offset=parameter)
    rate = rates([scored("single", hidden, result)])["intervals that cover"]
    assert (rate.hits, rate.cases) == (hit, 1)


def test_held_out_ratio_leaves_clean_cases_out():
    results = [
        scored("single", SINGLE, diagnosis("end_stop", held_out=h)) for h in (0.010, 0.011, 0.03)
    ] + [scored("clean", truth(), diagnosis(held_out=5.0))] * 3
    assert median_held_out_ratio(results) == pytest.approx(1.1)


def test_confusion_table():
    results = [
        scored("single", SINGLE, diagnosis("end_stop")),
        scored("single", SINGLE, diagnosis("current_lag")),
        scored("clean", truth(), diagnosis(verdict="adequate")),
        scored("outside", truth("outside:pump"), diagnosis(verdict="unexplained")),
        scored("pair", PAIR, diagnosis("end_stop")),
    ]
    rows = confusion_table(results).splitlines()[2:]
    assert rows == [
        "| clean | 1 | 1 |  |",
        "| end_stop | 2 | 1 | current_lag 1 |",
        "| outside:pump | 1 | 1 |  |",
    ]


def test_wilson_interval_against_the_textbook():
    low, high = Rate(95, 100).interval
    assert low == pytest.approx(0.8882, abs=1e-4) and high == pytest.approx(0.9785, abs=1e-4)
    assert Rate(0, 100).interval[0] == pytest.approx(0.0, abs=1e-12)
    assert Rate(0, 100).interval[1] == pytest.approx(0.0370, abs=1e-4)
