"""The second family of hidden effects: right forces, asked sizes, files that are read."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from isolation_sim.identification.campaign import read_campaign
from studies.blind import second_cases
from studies.blind.cases import CATALOGUE
from studies.blind.second_cases import SecondCase, programme, second_pairs, second_singles
from studies.blind.second_device import SECOND_FORMS, Effects, SecondDevice, second_device


def test_every_cause_of_the_first_family_has_a_second_form():
    assert sorted(SECOND_FORMS) == list(CATALOGUE)


@pytest.mark.parametrize("law", second_cases.LAWS)
def test_the_force_is_that_of_scipy_on_the_printed_equations(law):
    device = second_device(law, np.random.default_rng(3))
    motion = programme(1)[8].signals(1600)
    time = motion.step * np.arange(motion.x.size)
    x, current = (make_interp_spline(time, one, k=3) for one in (motion.x, motion.current))
    v = x.derivative()

    def numbers(t):
        return device.coefficients @ np.stack([current(t) ** 0, current(t), current(t) ** 2])

    def bouc_wen(t, s):
        _, _, _, slope, beta, gamma, n, _ = numbers(t)
        decay = beta * abs(v(t)) * s[0] + gamma * v(t) * abs(s[0])
        return [slope * v(t) - decay * abs(s[0]) ** (n - 1), 0.0]

    def strain_stiffening(t, s):
        c0, k0, c1, k1, alpha = numbers(t)
        return [v(t) - (k1 * s[0] - k0 * (x(t) - s[0])) / c0, v(t) - alpha / c1 * s[1] ** 3]

    rates = {"bouc_wen": bouc_wen, "strain_stiffening": strain_stiffening}[law]
    at = time[:4001:80]
    y, z = solve_ivp(rates, (0, 1.25), [0, 0], "DOP853", at, rtol=1e-8, atol=1e-11, max_step=0.01).y
    p = numbers(at)
    if law == "bouc_wen":
        expected = p[0] * x(at) + p[1] * v(at) + p[2] * y + p[7]
    else:
        expected = p[3] * y + p[4] * z**3
    inputs = device.respond(motion, Effects())[:2001:40]
    assert np.max(np.abs(inputs - expected)) < 1e-5 * np.max(np.abs(expected))


def test_core_and_plates_warm_as_scipy_says():
    table = np.zeros((8, 3))
    table[[1, 3, 6], 0] = 800.0, 1.0, 1.0  # a dashpot alone
    motion = programme(1)[9].signals(1600)
    heat = {"heat_path": 0.25, "heat_room": 0.05, "heat_ratio": 0.5}
    force, softened = (
        SecondDevice("bouc_wen", table).respond(motion, Effects(heat=gain, **heat))
        for gain in (0.0, 1e-8)
    )
    v = make_interp_spline(2 * motion.step * np.arange(force.size), motion.v[::2], k=3)

    def rates(t, s):
        flow = 0.25 * (s[0] - s[1])
        return [800 * v(t) ** 2 - flow, 0.5 * flow - 0.05 * s[1]]

    at = np.flatnonzero(np.abs(force) > 20)[::200]
    times = 2 * motion.step * at
    core = solve_ivp(rates, (0, 8), [0, 0], t_eval=times, rtol=1e-8, max_step=0.05).y[0]
    assert -1e8 * np.log(softened[at] / force[at]) == pytest.approx(core, rel=1e-4)


def test_a_delay_shifts_the_force():
    device = second_device("bouc_wen", np.random.default_rng(3))
    motion = programme(1)[2].signals(1600)
    force, late = (device.respond(motion, Effects(delay=d)) for d in (0.0, 0.01))
    assert np.allclose(late[16:], force[:-16])


SINGLES = [case for case in second_singles((0.02,)) if case.law == "bouc_wen"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [SINGLES[2], SINGLES[19]],
    ids=lambda case: case.name,
)
def test_an_effect_has_the_size_asked_for(case):
    assert case.truth.sizes[0] == pytest.approx(0.02, rel=0.03)
    assert case.truth.changes[0] >= case.truth.sizes[0]


def test_members_of_a_pair_do_not_share_a_number():
    for case in second_pairs(60):
        severities = [SECOND_FORMS[cause][form].severity for cause, form in case.hidden]
        assert len(set(severities)) == 2


def test_files_are_read_in_their_units(tmp_path):
    case = SecondCase("clean", "strain_stiffening", (), 4)
    made = case.campaign()
    campaign = read_campaign(made.write(tmp_path / "campaign"))
    for run, test, columns in zip(campaign.runs, made.tests, made.columns, strict=True):
        assert run.hold_out == test.hold_out
        assert np.allclose(run.force, 1e3 * columns["force_kN"], rtol=1e-6)
        assert np.allclose(run.displacement, columns["displacement_m"], atol=1e-9)
    assert 0.01 < case.true_form_error(made) < 0.02
