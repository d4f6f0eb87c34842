"""The blind generator itself: right forces, effects of the asked size, files in their format."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from isolation_sim.identification.campaign import read_campaign
from studies.blind import cases
from studies.blind.campaign import make_campaign, true_form_error
from studies.blind.devices import BASES, perturbed
from studies.blind.effect import FORMS, STAGES
from studies.blind.motion import RATE, Run, full_programme, motions, quick_programme, random, steps
from studies.blind.response import Gauge, Hidden, Unreachable, respond

CATALOGUE = """current_lag field_saturation magnetic_remanence field_gap_coupling stress_softening
amplitude_softening self_heating ambient_temperature tension_compression_asymmetry force_offset
coulomb_friction inertia_force sensor_delay extra_relaxation weak_rate_dependence end_stop
cyclic_degradation""".split()
ALL = [(effect, name) for effect, forms in FORMS.items() for name in forms]
COARSE = tuple(motions("quick", 3, 2))


@cache
def gauge_of(base: str) -> Gauge:
    return Gauge(perturbed(base, np.random.default_rng(9)), COARSE)


def one_run(substeps: int):
    rng = np.random.default_rng(5)
    run = Run("random", random(3.0, 0.2, 6.0, rng), steps(0.7, 4.0, rng), 22.0)
    return run.on_grid(0, 4.0, substeps)


def by_solve_ivp(device, motion):
    """Force from scipy on the equations as the papers print them."""
    x = make_interp_spline(motion.time, motion.x, k=5)
    v, current = x.derivative(), make_interp_spline(motion.time, motion.current, k=5)

    def p(t):
        return [
            np.polynomial.polynomial.polyval(current(t), c) for c in device.coefficients.values()
        ]

    def five_parameter(t, s):
        c0, k0, c1, k1, alpha = p(t)
        y, z = s
        return [-(k0 + k1) / c0 * y + v(t) + k0 / c0 * x(t), v(t) - alpha / c1 * z**3]

    def bouc_wen(t, s):
        _, _, _, a, beta, gamma, n, _ = p(t)
        (z,) = s
        rate = v(t)
        return [a * rate - beta * abs(rate) * abs(z) ** (n - 1) * z - gamma * rate * abs(z) ** n]

    rates, start = {
        "strain_stiffening": (five_parameter, [0.0, 0.0]),
        "bouc_wen": (bouc_wen, [0.0]),
    }[device.law]
    solution = solve_ivp(
        rates,
        (0.0, motion.time[-1]),
        start,
        method="DOP853",
        t_eval=motion.time,
        rtol=1e-9,
        atol=1e-10,
        max_step=0.01,
    )
    forces = {
        "strain_stiffening": lambda t, q, s: q[3] * s[0] + q[4] * s[1] ** 3,
        "bouc_wen": lambda t, q, s: q[0] * x(t) + q[1] * v(t) + q[2] * s[0] + q[7],
    }[device.law]
    return np.array([forces(t, p(t), s) for t, s in zip(motion.time, solution.y.T, strict=True)])


@pytest.mark.parametrize(
    "law", ["strain_stiffening", pytest.param("bouc_wen", marks=pytest.mark.slow)]
)
def test_forces_agree_with_scipy(law):
    device, motion = perturbed(law, np.random.default_rng(7)), one_run(4)
    force, expected = respond(device, motion), by_solve_ivp(device, motion)
    assert np.linalg.norm(force - expected) < 2e-5 * np.linalg.norm(expected)


@pytest.mark.parametrize("law", sorted(BASES))
def test_dissipated_power_balances_the_work_of_a_closed_loop(law):
    """At constant current and in a steady cycle all work done on the device is dissipated."""
    device = perturbed(law, np.random.default_rng(8))
    run = Run("sine", lambda t: 3 * np.sin(2 * np.pi * t), lambda t: np.full_like(t, 1.5), 22.0)
    motion = run.on_grid(0, 12.0, 8)
    force, power = device.respond(motion, motion.current)
    cycle = slice(-RATE * 8 - 1, None)
    work = np.trapezoid((force * motion.v)[cycle], dx=motion.step)
    assert work == pytest.approx(np.trapezoid(power[cycle], dx=motion.step), rel=2e-3)
    assert np.all(power >= -1e-9) and work > 0


def test_every_name_of_the_design_has_two_forms():
    assert set(CATALOGUE) == set(cases.CATALOGUE)
    assert all(len(FORMS[name]) >= 2 for name in CATALOGUE)
    assert all(form.depends_on for name in cases.OUTSIDE for form in FORMS[name].values())
    assert all(FORMS[effect][name].stage in STAGES for effect, name in ALL)


FIRST = [(effect, next(iter(FORMS[effect]))) for effect in FORMS][::2]
"""A form of every second effect; the others are slow."""


@pytest.mark.parametrize(
    ("effect", "form"),
    [pytest.param(*case, marks=[] if case in FIRST else [pytest.mark.slow]) for case in ALL],
)
def test_severity_zero_is_clean_and_the_size_is_attained(effect, form):
    base = "hybrid" if effect == "weak_rate_dependence" else "strain_stiffening"
    gauge = gauge_of(base)
    blank = Hidden.draw(effect, np.random.default_rng(10), form)
    np.testing.assert_array_equal(gauge.force(gauge.device, [blank]), gauge.clean)
    hidden = gauge.at_size(blank, 0.02)
    assert gauge.visible(hidden) == pytest.approx(0.02, rel=0.01)
    faint = replace(hidden, severity=hidden.severity / 100)
    assert gauge.change(faint) < 0.2 * gauge.change(hidden)
    assert gauge.change(hidden) >= gauge.visible(hidden)
    assert 0 < hidden.severity <= hidden.form.limit


@pytest.mark.slow
def test_sizes_are_repeated_on_a_finer_grid():
    """The gauge's coarse grid measures what the campaign's fine one has."""
    device = perturbed("bouc_wen", np.random.default_rng(11))
    coarse, fine = Gauge(device, COARSE), Gauge(device, tuple(motions("quick", 3, 4)))
    for effect in ("self_heating", "stress_softening", "current_lag", "coulomb_friction"):
        hidden = coarse.at_size(Hidden.draw(effect, np.random.default_rng(1)), 0.03)
        assert fine.visible(hidden) == pytest.approx(0.03, rel=0.02)


def test_what_the_law_takes_up_is_not_visible():
    device = perturbed("bouc_wen", np.random.default_rng(12))
    gauge = Gauge(device, COARSE)
    offset = Hidden.draw("force_offset", np.random.default_rng(1), "same_everywhere")
    assert gauge.change(replace(offset, severity=10.0)) > 0.02
    assert gauge.visible(replace(offset, severity=10.0)) < 1e-6
    with pytest.raises(Unreachable):
        gauge.at_size(offset, 0.02)


@pytest.mark.parametrize(
    ("programme", "runs", "held"), [(full_programme, 30, 8), (quick_programme, 10, 3)]
)
def test_programme_tells_nothing_of_the_case(programme, runs, held):
    made, other = programme(1)[0], programme(2)[0]
    assert len(made) == runs and sum(run.hold_out for run in made) == held
    assert [run.name for run in made] == [run.name for run in other]
    assert len({run.temperature for run in made}) == runs


@pytest.mark.parametrize("velocity_noise", [None, 0.02])
def test_folder_is_read_by_the_library(tmp_path, velocity_noise):
    device = perturbed("kelvin_voigt", np.random.default_rng(13))
    made = make_campaign(device, seed=4, velocity_noise=velocity_noise)
    header = (made.write(tmp_path / "c") / f"{made.runs[0].name}.csv").read_text().split("\n")[0]
    columns = ["time_s", "displacement_mm", "current_A", "force_N", "temperature_C"]
    assert header.split(",") == columns + ["velocity_mm_s"] * (velocity_noise is not None)
    read = read_campaign(tmp_path / "c")
    for run, original in zip(read.runs, made.runs, strict=True):
        assert (run.name, run.hold_out) == (original.name, original.hold_out)
        np.testing.assert_allclose(1e3 * run.displacement, original.displacement, atol=1e-6)
        np.testing.assert_allclose(run.force, original.force, atol=1e-4)
        assert run.velocity_measured == (velocity_noise is not None)


def test_noise_is_the_share_asked_for_and_the_seed_repeats_it():
    device = perturbed("kelvin_voigt", np.random.default_rng(14))
    made = make_campaign(device, seed=6, force_noise=0.02)
    again = make_campaign(device, seed=6, force_noise=0.02)
    noise = np.concatenate([run.force - run.true_force for run in made.runs])
    force = np.concatenate([run.true_force for run in made.runs])
    assert np.std(noise) / np.sqrt(np.mean(force**2)) == pytest.approx(0.02, rel=0.03)
    np.testing.assert_array_equal(made.runs[5].force, again.runs[5].force)


def test_true_form_reaches_little_more_than_the_force_noise():
    (case, *_) = cases.several(2, 1)
    campaign = case.campaign()
    floor = campaign.noise_floor()
    with_effects = true_form_error(campaign, case.device, case.hidden)
    assert floor < with_effects < 1.4 * floor
    assert true_form_error(campaign, case.device) > 2 * with_effects


def test_lists_of_cases():
    singles = list(cases.singles())
    assert {case.effects[0][0] for case in singles} == set(cases.CATALOGUE)
    assert len({case.name for case in singles}) == len(singles) == len({c.seed for c in singles})
    for kind in (cases.several(3, 40), cases.clean(100), cases.outside(), cases.wrong_law(20)):
        made = list(kind)
        assert len({case.name for case in made}) == len(made)
    for case in cases.several(3, 40):
        assert len({effect for effect, _ in case.effects}) == 3
    assert all(case.law != case.base for case in cases.wrong_law(20))


@pytest.mark.slow
def test_a_case_below_its_largest_size_is_spread_to_its_limit():
    sizes = [
        cases.Case(
            "single", "bouc_wen", "bouc_wen", (("field_saturation", "knee"),), 5, level=level
        ).truth.sizes[0]
        for level in range(3)
    ]
    assert sizes == sorted(sizes) and sizes[0] == pytest.approx(0.01, rel=0.01)
    assert 0.01 < sizes[2] < 0.05
