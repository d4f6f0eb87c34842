"""Unknown parameters against the current: bounds."""

from __future__ import annotations

import numpy as np
import pytest

from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.current_basis import currents_of
from isolation_sim.identification.fit import fit
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.parameterisation import Parameterisation
from isolation_sim.laws import LAWS, Device


def test_what_a_search_has_switched_off_begins_again_weaker():
    p = Parameterisation(LAWS["kelvin_voigt"], np.array([0.0, 2.0]), (300.0, 8e-3, 0.2), {})
    assert [q.name for q in p.free] == ["k", "c"]
    start = np.array([1e4, 2e4, 500.0, 700.0])
    assert p.switched_on(start, np.array([3e4, 0.0, 0.0, 40.0])) is None  # off at one current only
    again = p.switched_on(start, np.array([3e4, 2e4, 0.0, 0.0]))
    assert again.tolist() == [3e4, 2e4, 50.0, 70.0]
    began_off = np.array([1e4, 2e4, 0.0, 0.0])
    assert p.switched_on(began_off, np.array([3e4, 2e4, 0.0, 0.0])) is None


def test_a_divisor_that_has_grown_out_of_reach_begins_again_at_its_size():
    """A force c v_c log(1 + v / v_c) does not tell v_c where that is far beyond the velocities."""
    law = LAWS["rate_dependent_bouc_wen"]
    p = Parameterisation(law, np.array([0.0, 2.0]), (300.0, 8e-3, 0.2), {})
    at = 2 * [q.name for q in p.free].index("v_c")
    end = p.scale.copy()
    assert p.switched_on(p.scale, end) is None
    end[at] = 1e3 * p.scale[at]
    assert p.switched_on(p.scale, end) is None  # at one current only
    end[at + 1] = 1e7 * p.scale[at]
    assert p.switched_on(p.scale, end).tolist() == p.scale.tolist()


def test_the_bounds_of_a_divisor_hold_for_every_exponent_in_its_unit():
    """A damper of 300 N at 0.1 mm/s: its force at 1 m/s follows from the exponent."""
    law = LAWS["viscous_damper"]
    p = Parameterisation(law, np.array([0.0]), (300.0, 1e-4, 1.0), {})
    at = [q.name for q in p.free].index("c")
    for alpha in (0.1, 0.3, 1.0, 2.0):
        assert p.lower[at] < 0.1 * 300.0 / 1e-4**alpha < 10 * 300.0 / 1e-4**alpha < p.upper[at]


def test_what_vanishes_at_one_current_has_its_mean_at_all():
    p = Parameterisation(LAWS["kelvin_voigt"], np.array([0.0, 2.0]), (300.0, 8e-3, 0.2), {})
    assert p.with_every_element(np.array([1e4, 3e4, 40.0, 0.0])).tolist() == [1e4, 3e4, 20.0, 20.0]
    assert p.with_every_element(np.array([1e4, 3e4, 40.0, 60.0])) is None


def test_a_spring_that_has_become_rigid_has_its_size_at_all_currents():
    p = Parameterisation(LAWS["standard_solid"], np.array([0.0, 2.0]), (300.0, 8e-3, 0.2), {})
    assert [q.name for q in p.free] == ["c0", "k0", "k1"]
    near = p.scale * [1.0, 2.0, 3.0, 4.0, 50.0, 500.0]
    assert p.with_every_element(near) is None  # at one current only
    rigid = p.scale * [1.0, 2.0, 3.0, 4.0, 1e30, 1e30]
    again = p.with_every_element(rigid)
    assert again.tolist() == [*rigid[:4], *p.scale[4:]]


@pytest.mark.parametrize(
    ("law", "fixed", "held"),
    [
        ("linearised_bouc_wen", {}, {"k2": 300.0}),
        ("linearised_bouc_wen", {"C_e": 5.0}, {"C_e": 5.0}),
        ("bouc_wen", {}, {"A": 1.0}),
        ("bouc_wen", {"alpha": 2e4}, {"alpha": 2e4}),
        ("kelvin_voigt", {}, {}),
    ],
)
def test_a_search_without_the_current_holds_a_redundant_parameter(law, fixed, held):
    """Its scale would be that of chance, far from the size that is expected of it."""
    p = Parameterisation(LAWS[law], np.array([0.0, 2.0]), (300.0, 8e-3, 0.2), fixed)
    assert p.fixed == fixed
    assert p.steady().fixed == held


def test_a_number_in_a_power_of_a_length_is_compared_by_its_length():
    """The same corner with another exponent: beta alone is 10^5 times as large."""
    p = Parameterisation(LAWS["bouc_wen"], np.array([0.0]), (100.0, 2e-2, 0.1), {"A": 1.0})
    names = [q.name for q in p.free]
    n, beta, gamma = (names.index(name) for name in ("n", "beta", "gamma"))

    def corner(exponent):
        values = np.array([1e4, 100.0, 4e4, 0.0, 0.0, exponent, 0.0])
        values[[beta, gamma]] = 0.5 * 3e-3**-exponent
        return values

    expected, values = corner(2.3), corner(4.5)
    away, slopes = p.deviations(values, expected)
    assert values[beta] > 1e5 * expected[beta] and 0 < away[beta] == away[gamma] < 1
    assert away[n] == pytest.approx(2.2 / 2.3) and not away[: names.index("beta")].any()
    step = 1e-6 * np.maximum(np.abs(values), 1.0)
    moved = [p.deviations(values + one, expected)[0] for one in np.diag(step)]
    assert slopes == pytest.approx((np.array(moved) - away).T / step, rel=1e-4, abs=1e-12)


def test_rounding_makes_no_divisor_zero():
    law = LAWS["strain_stiffening"]
    currents = np.array([0.0, 1.0, 2.0, 3.0])
    parameterisation = Parameterisation(law, currents, sizes=(100.0, 4e-3, 0.16))
    n = len(currents)
    for k in range(n):  # as large as a fit may make it, but for one current
        values = np.minimum(parameterisation.upper, 1e30)
        values[k::n] = parameterisation.lower[k::n]
        result = parameterisation.dependence(values).at(currents)
        for quantity, row in zip(law.parameters, result, strict=True):
            if quantity.divides:
                assert np.all(row > 0), (quantity.name, k)
        device = Device(law, parameterisation.dependence(values), (0.0, 3.0))
        assert np.all(np.isfinite(device.parameters_at(currents)))


@pytest.mark.usefixtures("few_laws")
@pytest.mark.parametrize("degree", [1, 2])
def test_the_law_keeps_its_bounds_at_currents_that_are_held_out(degree):
    # a stiffness that falls so fast that its polynomial is negative at the held-out current
    stiffness = {0.0: 1e4, 0.25: 6.5e3, 0.5: 3e3, 1.0: 500.0}
    time = 0.005 * np.arange(800)
    x, v = 5e-3 * np.sin(6 * time), 3e-2 * np.cos(6 * time)
    runs = tuple(
        TestRun(f"{i} A", time, x, v, k * x + 50 * v, np.full(800, i), hold_out=i == 1.0)
        for i, k in stiffness.items()
    )
    line = np.polyfit([0.0, 0.25, 0.5], [1e4, 6.5e3, 3e3], degree)
    assert np.polyval(line, 1.0) < -1e3
    campaign = Campaign("falling", "made", runs)
    result = fit(campaign, "kelvin_voigt", current_degree=degree, starts=4, threads=1)
    # rounding aside
    assert np.min(result.device.current.at(np.linspace(0, 1, 50))) > -1e-6
    nominal = diagnose(
        campaign, "kelvin_voigt", current_degree=degree, tiers="causes", threads=1
    ).nominal
    assert nominal.current_range == (0.0, 1.0)
    assert np.min(nominal.parameters_at(np.linspace(0, 1, 50))) > -1e-6


@pytest.mark.parametrize(
    ("levels", "noise", "expected"),
    [
        ((0.0, 1.0, 2.0, 3.0), 0.006, [0.0, 1.5, 3.0]),
        ((0.0, 0.45, 3.0), 0.02, [0.0, 0.45, 3.0]),
        ((1.0, 1.0), 0.01, [1.0]),
        ((0.0, 0.05, 3.0), 0.0, [0.0, 0.05, 3.0]),
    ],
)
def test_a_fit_is_tabulated_at_nominal_currents(levels, noise, expected):
    time = 0.01 * np.arange(400)
    x, draw = np.sin(time), np.random.default_rng(1)
    runs = [
        TestRun(str(k), time, x, np.cos(time), x, level + noise * draw.standard_normal(400))
        for k, level in enumerate(levels)
    ]
    campaign = Campaign("noisy", "made", runs)
    assert currents_of(campaign, campaign.runs, None) == pytest.approx(expected, abs=noise / 5)
