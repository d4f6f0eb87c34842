"""Fits say what the data leave open and what the law lacks; held-out runs and refusals."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim.discrepancy.device import observable_effects
from isolation_sim.errors import InputError
from isolation_sim.identification import law_fit
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.fit import fit
from isolation_sim.identification.fitted import Estimate, labels
from isolation_sim.identification.law_fit import parameterise
from isolation_sim.identification.law_model import LawModel
from isolation_sim.identification.least_squares import Optimum
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured.velocity import smooth
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.laws import LAWS, CurrentDependence, Device
from isolation_sim.laws.law import Law, Quantity

STARTS = 12


def fitted(name, campaign, held, **options):
    options = {"current_degree": 1, "fixed": held.get(name), "starts": STARTS, "threads": 1} | (
        options
    )
    return fit(campaign, name, **options)


def test_a_redundant_parameter_is_held(campaign_of):
    name = "linearised_bouc_wen"
    redundancy = LAWS[name].redundancy
    result = fitted(name, campaign_of(name, 0), {})
    assert result.error == pytest.approx(0.01, rel=0.1)
    assert all(e.determined for e in result.estimates)
    assert redundancy.held not in [e.name for e in result.estimates]
    at = LAWS[name].parameter_names.index(redundancy.held)
    assert result.device.parameters_at(1.3)[at] == pytest.approx(redundancy.value)
    assert result.notes[0].startswith(f"{redundancy.held} is held at {redundancy.value:g}: ")
    check_that_a_law_that_does_not_say_so_leaves_parameters_open(name, campaign_of)


def check_that_a_law_that_does_not_say_so_leaves_parameters_open(name, campaign_of):
    silent = fitted(replace(LAWS[name], redundancy=None), campaign_of(name, 0), {})
    left = {e.name for e in silent.estimates if not e.determined}
    assert left == set(LAWS[name].redundancy.among)
    assert any(note.startswith("the data do not determine") for note in silent.notes)


@pytest.mark.parametrize("function", [fit, iso.diagnose])
def test_a_law_that_cannot_be_traced_is_refused(campaign_of, function):
    law = Law(
        "branch", "", (Quantity("k", "N/m", ""),), lambda x, v, s, p: p[0] * x if x > 0 else 0
    )
    with pytest.raises(InputError, match=r"law 'branch': .* cannot be traced"):
        function(campaign_of("linear", 0), law)


@pytest.mark.parametrize("of", ["state", "motion"])
def test_a_power_needs_a_derivative_at_rest_if_it_is_of_a_state(campaign_of, of):
    def force(x, v, states, parameters):
        k, n = parameters
        return k * (states[0] if of == "state" else np.sign(x) * np.fabs(x) ** n)

    def rates(x, v, states, parameters):
        return (v - 1e3 * np.fabs(v) * states[0] * np.fabs(states[0]) ** parameters[1],)

    parameters = (Quantity("k", "N/m", "stiffness"), Quantity("n", "1", "power", 1.0, 2.0))
    law = Law("powered", "Powered", parameters, force)
    if of == "motion":
        assert fit(campaign_of("linear", 0), law).error == pytest.approx(0.01, rel=0.1)
        return
    law = replace(law, states=(Quantity("z", "m", "hysteretic deformation"),), rates=rates)
    with pytest.raises(InputError, match="no derivative of the rates by n at rest"):
        fit(campaign_of("linear", 0), law)


@pytest.mark.parametrize(
    "name", [pytest.param("bouc_wen", marks=pytest.mark.slow), "improved_bouc_wen"]
)
def test_a_state_of_a_law_that_follows_the_current_is_scaled(name, campaign_of):
    scaling = LAWS[name].redundancy.scaling
    result = fitted(name, campaign_of(name, 0), {})
    assert result.error == pytest.approx(0.01, rel=0.1)
    assert all(e.determined for e in result.estimates)
    assert scaling.tied not in [e.name for e in result.estimates]
    for current in (0.5, 1.3, 2.0):
        values = dict(
            zip(LAWS[name].parameter_names, result.device.parameters_at(current), strict=True)
        )
        assert scaling.largest(values) == pytest.approx(1.0)
    assert result.notes[0].startswith(f"{scaling.tied} is ")
    assert "the hysteretic variable is 1 at most" in result.notes[0]
    check_that_a_law_that_does_not_say_so_leaves_parameters_open(name, campaign_of)


@pytest.mark.parametrize("name", ["bouc_wen", "improved_bouc_wen"])
def test_scaling_a_state_changes_no_force(name):
    redundancy, law = LAWS[name].redundancy, LAWS[name]
    values = dict(zip(law.parameter_names, published_or_example(name), strict=True))
    held = redundancy.scaling.holding(
        redundancy.among[-1], 2 * values[redundancy.among[-1]], values
    )
    for changed in (redundancy.scaling.scaled(values), held):
        size = redundancy.scaling.largest(values | changed) / redundancy.scaling.largest(values)
        if name == "improved_bouc_wen":
            size = 1.0  # its state is scaled in the law
        for x, v, z in ((1e-3, 0.02, 2e-3), (-2e-3, -0.01, 1e-3), (1e-3, -0.03, 4e-3)):
            before, after = (
                [law.force(x, v, (state,), p), *law.rates(x, v, (state,), p)]
                for state, p in (
                    (z, tuple(values.values())), (size * z, tuple((values | changed).values())),
                )
            )  # fmt: skip
            np.testing.assert_allclose(after, [before[0], size * before[1]], rtol=1e-9)


def published_or_example(name):
    if name == "improved_bouc_wen":
        return iso.law(name).parameters_at(1.0)
    pairs = (np.atleast_1d(LAWS[name].example[p])[0] for p in LAWS[name].parameter_names)
    return [float(value) for value in pairs]


def bouc_wen_between_currents(currents, seed, yield_force=None, gamma=None):
    """Runs of Bouc-Wen whose yield force, or whose gamma, is a straight line of the current."""
    law, runs = LAWS["bouc_wen"], []
    random, time = np.random.default_rng(seed), np.arange(801) * 0.005
    for current in currents:
        phase = random.uniform(0, 2 * np.pi, 3)
        angles = [2 * np.pi * f * time + p for f, p in zip((0.7, 1.9, 3.1), phase, strict=True)]
        x = sum(a * np.sin(angle) for a, angle in zip((4e-3, 1.5e-3, 8e-4), angles, strict=True))
        v = np.gradient(x, time)
        A, n, beta = 1.0, 1.7, 4e4
        g = 1e4 if gamma is None else gamma(current)
        z_y = (A / (beta + g)) ** (1 / n)
        if yield_force is None:
            alpha = 4e4
        else:
            # so does its initial slope, which z_y sets where A is 1
            scale = 1 / (1 - 0.3 * current)
            beta, g = beta / scale**n, g / scale**n
            alpha = yield_force(current) / (z_y * scale)
        values = {"k": 1e4, "c": 300.0, "alpha": alpha, "A": A, "beta": beta, "gamma": g,
                  "n": n, "F0": 0.0}  # fmt: skip
        device = Device(law, CurrentDependence.polynomial({k: (y,) for k, y in values.items()}))
        run = TestRun(f"{current} A", time, x, v, x, np.full(801, current), velocity_measured=True)
        (one,) = iso.evaluate(device, Campaign("one", "made", (run,))).errors
        runs.append(replace(run, force=one.force))
    return runs


def test_a_yield_force_is_interpolated_between_the_tested_currents():
    runs = bouc_wen_between_currents((0.0, 2.0, 1.0), 3, yield_force=lambda i: 60.0 + 60.0 * i)
    campaign = Campaign("steep", "made", (*runs[:2], replace(runs[2], hold_out=True)))
    scaled = fitted("bouc_wen", campaign, {})
    held = fitted("bouc_wen", campaign, {}, fixed={"A": 1.0})
    assert max(scaled.error, held.error) < 1e-3
    assert scaled.held_out_error < 1e-3 < 0.01 < held.held_out_error


def test_the_data_choose_the_scale_where_there_are_more_currents():
    runs = bouc_wen_between_currents((0.0, 1.0, 2.0), 3, gamma=lambda i: 3e4 - 2.5e4 * i)
    chosen = fitted("bouc_wen", Campaign("straight", "made", tuple(runs)), {})
    assert chosen.error < 1e-3
    assert any(note.startswith("A is held at 1: ") for note in chosen.notes)
    runs = bouc_wen_between_currents((0.0, 1.0, 2.0), 3, yield_force=lambda i: 60.0 + 60.0 * i)
    chosen = fitted("bouc_wen", Campaign("steep", "made", tuple(runs)), {})
    assert any(note.startswith("gamma is A - beta, ") for note in chosen.notes)


def test_a_fit_that_diverges_takes_more_steps():
    """A relaxation of 1.5 ms diverges with one explicit step of 5 ms."""
    time = 0.005 * np.arange(800)
    x, v = 0.01 * np.sin(6 * time), 0.06 * np.cos(6 * time)
    run = TestRun("a", time, x, v, 150.0 * v, np.zeros(800), velocity_measured=True)
    campaign = Campaign("stiff", "made", (run,))
    data = measured_runs((run,)).with_steps(1)
    model = LawModel(data, parameterise(campaign, LAWS["maxwell"], data))
    start = np.array([1e5, 150.0])
    assert not np.isfinite(model.residuals(start, False)[0]).all()
    model, solution = model.minimise_resolved(start, 20, 1e-6)
    assert np.isfinite(solution.cost) and np.all(model.data.n_steps > 1)
    assert solution.x[1] == pytest.approx(150.0, rel=0.01)


@pytest.mark.parametrize("slower", [1, 2, 5])
def test_slow_samples_of_a_law_with_a_fast_branch_are_fitted(slower):
    """A spring-pot's fastest branch decays in 0.8 ms; its harmonic force is in closed form."""
    k, a, runs = 3e5, 0.2, []
    time = slower * np.arange(0, 120.0, 0.2)
    for frequency in np.array([0.05, 0.1, 0.2]) / slower:
        w = 2 * np.pi * frequency
        phase = np.exp(1j * w * time)
        x, v = 0.05 * phase.imag, 0.05 * w * phase.real
        force = (k * (1j * frequency) ** a * 0.05 * phase).imag
        runs.append(TestRun(f"{frequency:g}_hz", time, x, v, force, 0 * time))
    result = fit(Campaign("slow", "made", tuple(runs)), "spring_pot", threads=1, starts=4)
    assert result.error < 0.02
    values = dict(
        zip(LAWS["spring_pot"].parameter_names, result.device.parameters_at(0.0), strict=True)
    )
    assert values["k"] == pytest.approx(k, rel=0.05) and values["a"] == pytest.approx(a, abs=0.02)


def test_an_end_inside_the_bounds_is_kept_beside_a_better_one_at_a_bound(campaign_of):
    campaign = campaign_of("kelvin_voigt", 0)
    p = parameterise(campaign, LAWS["kelvin_voigt"], measured_runs(campaign.runs))
    within = p.scale * np.arange(1, len(p.scale) + 1)
    at_bound = within.copy()
    at_bound[-len(p.currents) :] = p.lower[-len(p.currents) :]
    one_current = within.copy()
    one_current[-1] = p.lower[-1]
    assert p.ends_at_bound(at_bound) and not p.ends_at_bound(one_current)

    def ends(*pairs):
        return [Optimum(x, cost, np.empty(0), np.empty((0, 0)), 1, True) for x, cost in pairs]

    assert law_fit._inside(p, ends((at_bound, 1.0), (within, 1.2))) is within
    assert law_fit._inside(p, ends((at_bound, 1.0), (within, 1.3))) is None  # far worse
    assert law_fit._inside(p, ends((one_current, 1.0), (within, 1.1))) is None


def test_another_of_the_redundant_parameters_may_be_held(campaign_of):
    result = fitted("bouc_wen", campaign_of("bouc_wen", 0), {}, fixed={"alpha": 4e4})
    assert "A" in [e.name for e in result.estimates]


@pytest.mark.parametrize("constant", ["A", "beta"])
def test_what_a_prescribed_device_holds_constant_stays_held(constant, campaign_of):
    """Between the tested currents it matters which of the redundant parameters that is."""
    law = LAWS["bouc_wen"]
    following = {name: (value, 0.1 * value) for name, value in {
        "k": 2e4, "c": 300.0, "alpha": 4e4, "A": 1.0, "beta": 5e3, "gamma": 3e3,
    }.items()}  # fmt: skip
    prescribed = Device(law, CurrentDependence.polynomial(
        following | {constant: following[constant][:1], "n": (1.7,), "F0": (0.0,)}
    ))  # fmt: skip
    campaign = campaign_of("bouc_wen", 0)
    result = parameterise(campaign, law, measured_runs(campaign.runs), 1, prescribed=prescribed)
    assert result.fixed.keys() == {constant}
    assert result.fixed[constant] == pytest.approx([following[constant][0], 0.0], abs=1e-9)


def test_numbers_of_one_parameter_are_named_together():
    at = [Estimate(n, "1", i, 1.0, 0.5, 2.0, False)
          for n, i in (("k", 0.0), ("k", 1.5), ("k", 3.0), ("c", 3.0), ("n", None))]  # fmt: skip
    assert labels(at) == ["k at 0, 1.5 and 3 A", "c at 3 A", "n"]
    assert labels([]) == []


def test_a_parameter_at_its_bound_is_printed_without_an_interval(campaign_of):
    runs = []
    for run in campaign_of("kelvin_voigt", 0).runs:
        runs.append(replace(run, force=2e4 * run.displacement - 20.0 * run.velocity))
    result = fitted("kelvin_voigt", Campaign("active", "made", runs), {})
    results = {e.name: e for e in result.estimates}
    assert results["c"].at_bound and not results["k"].at_bound
    assert results["c"].interval == "at its bound" and " to " in results["k"].interval
    assert {row["name"] for row in result.to_dict()["parameters"] if row["at_bound"]} == {"c"}


def test_what_the_motion_does_not_excite_is_named(campaign_of, held):
    runs = []
    for run in campaign_of("standard_solid", 0).runs:
        # a linear device in a motion too small for a cubic spring to be felt
        small = {"displacement": 0.01 * run.displacement, "velocity": 0.01 * run.velocity}
        runs.append(replace(run, force=0.01 * run.force, **small))
    result = fitted("four_parameter", Campaign("small", "made", runs), held)
    assert {e.name for e in result.estimates if not e.determined} == {"alpha"}


def test_a_law_that_lacks_something_is_reported(campaign_of, held):
    campaign = campaign_of("strain_stiffening", 0)
    lacking = fitted("kelvin_voigt", campaign, held)
    noise = 0.01
    assert lacking.noise == pytest.approx(noise, rel=0.15)
    assert lacking.to_dict()["noise"] == lacking.noise
    (errors,) = [note for note in lacking.notes if note.startswith("the residual")]
    assert lacking.error > 5 * noise
    assert f"is {lacking.error / lacking.noise:.0f} times the data's own noise" in errors
    enough = fitted("strain_stiffening", campaign, held)
    assert not [note for note in enough.notes if note.startswith("the residual")]


def test_noise_of_the_displacement_does_not_bend_the_parameters(campaign_of, held, true_value):
    covered, random = [], np.random.default_rng(5)
    for seed in range(6):
        runs = []
        for run in campaign_of("standard_solid", seed).runs:
            size = 0.01 * np.sqrt(np.mean(run.displacement**2))
            noisy = run.displacement + size * random.standard_normal(run.displacement.size)
            _, velocity, _ = smooth(noisy, run.step)
            runs.append(replace(run, displacement=noisy, velocity=velocity))
        result = fitted("standard_solid", Campaign("noisy", "made", runs), held)
        for e in result.estimates:
            truth = true_value("standard_solid", e.name, e.current)
            covered.append(e.low <= truth <= e.high)
            assert e.value == pytest.approx(truth, rel=0.02)
    assert np.mean(covered) > 0.75


def test_held_out_runs_never_influence_the_fit(campaign_of, held):
    selected, other = campaign_of("kelvin_voigt", 0), campaign_of("kelvin_voigt", 1)
    spoilt = replace(other.runs[0], name="spoilt", force=-50 * other.runs[0].force, hold_out=True)
    with_it = Campaign("same", "made", (*selected.runs, spoilt))
    alone = fitted("kelvin_voigt", Campaign("same", "made", selected.runs), held)
    together = fitted("kelvin_voigt", with_it, held)
    assert together.estimates == alone.estimates
    assert together.error == alone.error
    assert together.held_out_error > 0.9 and np.isnan(alone.held_out_error)
    assert [e.run.name for e in together.errors] == ["run0", "run1", "spoilt"]


def test_a_law_that_nothing_tests_between_two_currents_says_so(campaign_of, held, monkeypatch):
    campaign = campaign_of("kelvin_voigt", 0)
    plain = "the runs have 0.5 and 2 A: between them the law is interpolated, and no run tests it"

    def told(campaign):
        notes = fitted("kelvin_voigt", campaign, held).notes
        return [note for note in notes if note.startswith("the runs have")]

    assert told(campaign) == [f"{plain}; measure one at 1.25 A and hold it out"]
    first = campaign.runs[0]
    between = replace(
        first, name="between", hold_out=True, current=np.full_like(first.current, 1.0)
    )
    assert told(replace(campaign, runs=(*campaign.runs, between))) == []
    for force, words in ((3.0, "3 times that at its neighbours"), (np.nan, "not finite")):
        monkeypatch.setattr(
            sys.modules[fit.__module__],
            "_rms_force",
            lambda model, best, current, force=force: force if current == 1.25 else 1.0,
        )
        assert told(campaign)[0].startswith(f"{plain}; at 1.25 A its force is {words}; measure")


def test_the_same_seed_gives_the_same_fit(campaign_of, held):
    campaign = campaign_of("dahl", 0)
    one, two = (fitted("dahl", campaign, held, threads=n) for n in (1, 2))
    assert one.estimates == two.estimates


def test_fixed_parameters_stay_and_constants_need_no_current(campaign_of, held):
    campaign = campaign_of("kelvin_voigt", 0)
    result = fitted("kelvin_voigt", campaign, held, fixed={"c": 900.0}, current_degree=0)
    assert result.device.parameters_at(1.0)[1] == pytest.approx(900.0)
    assert [e.label for e in result.estimates] == ["k"]
    assert not result.device.depends_on_current


def test_the_fitted_device_reproduces_the_runs(campaign_of, held, reference_force):
    result = fitted("maxwell", campaign_of("maxwell", 0), held)
    from scipy.interpolate import CubicHermiteSpline

    for error in result.errors:
        run = error.run
        displacement = smooth(run.displacement, run.step)[0]
        cubic = CubicHermiteSpline(run.time, displacement, run.velocity)
        parameters = result.device.parameters_at(run.current[0])
        force = reference_force(LAWS["maxwell"], parameters, cubic, cubic.derivative(), run.time)
        np.testing.assert_allclose(error.force, force, atol=1e-5 * np.abs(force).max())


@pytest.mark.parametrize("off", [-0.01, 0.01])
def test_an_offset_of_the_current_sensor_is_no_current(off):
    time = np.arange(0, 2, 0.01)
    x, v = 1e-3 * np.sin(6 * time), 6e-3 * np.cos(6 * time)
    runs = [
        TestRun(f"{current:g}A", time, x, v, (1e5 + 3e4 * current) * x + 4e3 * v, current + 0 * x)
        for current in (off, 1.0, 2.0)
    ]
    campaign = Campaign("offset", "made", tuple(runs))
    device = fit(campaign, "kelvin_voigt").device
    assert device.current_range == (0.0, 2.0)
    noise = 0.01 * np.sin(np.arange(len(time)) ** 2)
    noisy = tuple(replace(run, current=run.current + noise) for run in runs)
    evaluation = iso.evaluate(device, replace(campaign, runs=noisy))
    assert not [note for note in evaluation.notes if "current outside" in note]


def test_progress_counts_the_starts(campaign_of, held):
    seen = []
    fitted("linear", campaign_of("linear", 0), held, starts=5, progress=seen.append)
    assert sum(seen) == 5


@pytest.mark.parametrize(
    ("law", "options", "message"),
    [
        ("kelvin_voigt", {"current_degree": 2}, "degree 2 in the current need 3 currents"),
        ("kelvin_voigt", {"current_degree": -1}, "degree: given -1"),
        ("kelvin_voight", {}, "kelvin_voigt"),
        ("kelvin_voigt", {"fixed": {"kk": 1.0}}, "parameter of kelvin_voigt"),
    ],
)
def test_what_cannot_be_fitted_is_refused(law, options, message, campaign_of, held):
    campaign = campaign_of("kelvin_voigt", 0)
    with pytest.raises(InputError, match=message) as caught:
        fitted(law, campaign, held, **options)
    assert "\n" not in str(caught.value)


def test_motionless_data_are_refused(campaign_of):
    campaign = campaign_of("kelvin_voigt", 0)
    still = np.zeros_like(campaign.runs[0].displacement)
    with pytest.raises(InputError, match="displacement: the same number throughout"):
        replace(campaign.runs[0], displacement=still)
    runs = [replace(run, velocity=still) for run in campaign.runs]
    with pytest.raises(InputError, match="velocity or force is zero throughout") as caught:
        fit(Campaign("still", "made", runs), "kelvin_voigt", threads=1)
    assert "\n" not in str(caught.value)


def test_a_campaign_all_held_out_is_refused(campaign_of):
    runs = [replace(run, hold_out=True) for run in campaign_of("linear", 0).runs]
    with pytest.raises(InputError, match="all with hold_out"):
        fit(Campaign("held", "made", runs), "linear")


@pytest.mark.usefixtures("few_laws")
@pytest.mark.parametrize(
    "name", [pytest.param("strain_stiffening", marks=pytest.mark.slow), "kelvin_voigt"]
)
def test_a_diagnosis_judges_the_law_that_a_fit_gives(name, campaign_of, monkeypatch):
    from isolation_sim.discrepancy.diagnose import diagnose

    # the law is judged before its causes are searched
    few = {"force_offset": observable_effects.EFFECTS["force_offset"]}
    monkeypatch.setattr(observable_effects, "EFFECTS", few)
    runs = (*campaign_of("strain_stiffening", 0).runs, *campaign_of("strain_stiffening", 1).runs)
    runs = tuple(
        replace(run, name=f"run{k}", hold_out=k == 3, force=(1 + 0.3 * (k == 1)) * run.force)
        for k, run in enumerate(runs)
    )
    campaign = Campaign("marked", "made", runs)
    result = fit(campaign, name, threads=1)
    nominal = diagnose(campaign, name, tiers="causes", threads=1).nominal
    for current in (0.0, 0.7, 2.0):
        np.testing.assert_allclose(
            nominal.parameters_at(current), result.device.parameters_at(current), rtol=1e-12
        )
    assert nominal.tested_current == result.device.tested_current


def test_an_end_that_diverges_on_all_samples_gives_way_to_the_next(campaign_of, monkeypatch):
    campaign = campaign_of("dahl", 0)
    data = measured_runs(campaign.runs)
    model = LawModel(data, parameterise(campaign, LAWS["dahl"], data, 1))
    refined, really = [], law_fit.refine_law

    def refine(model, start):
        refined.append(start)
        model, result = really(model, start)
        return model, replace(result, cost=np.inf) if len(refined) == 1 else result

    monkeypatch.setattr(law_fit, "refine_law", refine)
    with ThreadPoolExecutor(1) as pool:
        _, result = law_fit.fit_law(model, pool, starts=STARTS)
    assert len(refined) == 2
    assert not np.array_equal(*refined)
    assert np.isfinite(result.cost)


def test_noise_of_a_steady_current_widens_no_range():
    """A parameter that falls to its bound at the highest current would leave it in the noise."""
    time, draw = 0.01 * np.arange(800), np.random.default_rng(1)
    x, v = np.sin(3 * time), 3 * np.cos(3 * time)
    runs = [
        TestRun(
            f"{current:g} A", time, x, v, 100.0 * x + c * v + 0.1 * draw.standard_normal(800),
            current + 0.01 * draw.standard_normal(800),
        )
        for current, c in ((0.0, 20.0), (1.0, -1.0))
    ]  # fmt: skip
    device = fit(Campaign("noisy", "made", runs), "kelvin_voigt", current_degree=1).device
    assert device.parameters_at(device.current_range[1])[1] == pytest.approx(0.0, abs=1e-9)
    assert device.current_range == pytest.approx((0.0, 1.0), abs=2e-3)
    assert device.tested_current == device.current_range[1]
