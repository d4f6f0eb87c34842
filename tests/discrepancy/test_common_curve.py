"""A saturation that quadratic parameters follow, each by a curve of its own."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim.discrepancy.adapters.device_tests import DeviceTests
from isolation_sim.identification.campaign import Campaign, TestRun


def campaign(stiffness, damping):
    """A spring and a dashpot by closed form, 1 % of noise; factors over the current, A."""
    rng = np.random.default_rng(7)
    runs = []
    for current in (0.0, 0.5, 1.0, 1.5, 2.0):
        for amplitude, frequency in ((0.004, 1.5), (0.010, 0.7), (0.007, 1.1)):
            omega = 2 * np.pi * frequency
            t = np.arange(0, 3 / frequency, 0.01)
            x, v = amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)
            force = 2e5 * stiffness(current) * x + 6e3 * damping(current) * v
            force += 0.01 * np.std(force) * rng.standard_normal(t.size)
            runs.append(
                TestRun(
                    f"{current} A, {1e3 * amplitude} mm", t, x, v, force, np.full(t.size, current),
                    hold_out=amplitude == 0.007 and current in (0.5, 1.5),
                )
            )  # fmt: skip
    return Campaign("curves", "closed form", tuple(runs))


def saturated(current):
    return 1.5 * np.tanh(current / 1.5)


@pytest.mark.parametrize(
    ("stiffness", "damping", "named"),
    [
        pytest.param(
            lambda i: 1 + 0.5 * saturated(i), lambda i: 1 + 0.6 * saturated(i),
            ["field_saturation"], id="one saturation",
        ),
        pytest.param(
            lambda i: 1 + 0.5 * i - 0.10 * i**2, lambda i: 1 + 0.6 * i - 0.16 * i**2,
            [], id="two curves that differ",
        ),
        pytest.param(
            lambda i: 1 + 0.5 * i - 0.12 * i**2, lambda i: 1 + 0.3 * i, [], id="one curve",
        ),
    ],
)  # fmt: skip
def test_a_saturation_is_named_where_all_parameters_share_its_curve(stiffness, damping, named):
    diagnosis = iso.diagnose(campaign(stiffness, damping), law="kelvin_voigt", tiers="causes")
    assert [cause.name for cause in diagnosis.causes if cause.is_named] == named
    assert diagnosis.error_after.fit < 0.0102
    text = next(step.text for step in diagnosis.steps if step.title == "Nominal model")
    assert ("linear in the current" in text) == bool(named)


def test_a_degree_that_is_given_is_kept():
    data = campaign(lambda i: 1 + 0.5 * saturated(i), lambda i: 1 + 0.6 * saturated(i))
    diagnosis = iso.diagnose(data, law="kelvin_voigt", current_degree=2, tiers="causes")
    assert diagnosis.verdict == "adequate"


def test_slow_noise_beside_a_cause_does_not_hide_a_saturation():
    from scipy.signal import lfilter

    data = campaign(lambda i: 1 + 0.5 * saturated(i), lambda i: 1 + 0.6 * saturated(i))
    rng = np.random.default_rng(1)
    runs = []
    for run in data.runs:
        slow = lfilter([0.2], [1, -0.95], rng.standard_normal(run.force.size))
        force = run.force + np.std(run.force) * 0.012 * slow / np.std(slow) + 400.0
        runs.append(replace(run, force=force))
    diagnosis = iso.diagnose(replace(data, runs=tuple(runs)), law="kelvin_voigt", tiers="causes")
    assert {one.name for one in diagnosis.causes} == {"force_offset", "field_saturation"}


@pytest.mark.parametrize(("more", "alike"), [(200.0, True), (400.0, False)])
def test_curves_are_weighed_by_the_noise_that_remains(more, alike):
    final = SimpleNamespace(cost=9e3, residual=np.zeros(1000), penalty=100.0)
    saturated = SimpleNamespace(cost=9e3 + more, penalty=70.0)
    problem = SimpleNamespace(final=final, _saturated=saturated)
    assert DeviceTests.saturates_alike(problem) == alike
