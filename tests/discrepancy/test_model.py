"""A model's derivatives are those of its force, whatever effect stands around the law."""

from dataclasses import replace

import numpy as np
import pytest

from isolation_sim.discrepancy.device.carried_history import can_carry_history, carry_history
from isolation_sim.discrepancy.device.model import EACH_RUN, FittedModel, Model, fit_model
from isolation_sim.effects import EFFECTS, effect, extend
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.law_fit import parameterise
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.laws import LAWS, Device, law

from ..effects.conftest import respond

FORMS = [form for forms in EFFECTS.values() for form in forms]


@pytest.fixture(scope="module")
def bare():
    """Strain stiffening under a swelling sine, a moving current and a changing temperature."""
    time = np.arange(0, 4.0, 1 / 128)
    x = 6e-3 * (time / 4.0) * np.sin(2 * np.pi * 1.3 * time)
    run = TestRun("run", time, x, np.gradient(x, time), 3e4 * x, 1 + np.sin(2 * time))
    runs = Campaign("swelling", "made", [replace(run, temperature=20 + 5 * np.sin(time))])
    data = measured_runs(runs.runs)
    model = Model(data, parameterise(runs, LAWS["strain_stiffening"], data))
    return model, model.parameterisation.starts(1, 0)[0]


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
def test_derivatives_by_the_law_pass_the_effect(form, bare):
    model, law = bare
    model = model.with_effects(form)
    own = [np.clip(q.starts[0] * model.size(q), q.lower, q.upper) for q in form.parameters]
    values = np.concatenate([law, own])
    _, columns = model.forces(values, True)
    for k in range(len(law)):
        step = 1e-5 * max(abs(values[k]), model.parameterisation.scale[k])
        ends = []
        for side in (-step, step):
            moved = values.copy()
            moved[k] += side
            ends.append(model.forces(moved, False)[0])
        slope = (ends[1] - ends[0]) / (2 * step)
        assert np.linalg.norm(columns[:, k] - slope) <= 2e-4 * np.linalg.norm(slope)


@pytest.mark.parametrize("before", ["linkage_backlash.released", "sensor_delay.butterworth"])
@pytest.mark.parametrize("behind", ["coulomb_friction.dahl", "stress_softening.rubber"])
def test_a_whole_device_stands_behind_a_linkage_and_before_a_recorder(before, behind, bare):
    """In any order, with the derivatives of its force, and as the extended law is simulated."""
    (model, start), forces = bare, []
    for names in ((before, behind), (behind, before)):
        own = [effect(*name.split(".")) for name in names]
        model = bare[0].with_effects(*own)
        quantities = [q for one in own for q in one.parameters]
        numbers = [np.clip(q.starts[-1] * model.size(q), q.lower, q.upper) for q in quantities]
        values = np.concatenate([start, numbers])
        model = model.resolve_steps(values)
        force, columns = model.forces(values, True)
        forces.append(force)
        for k, quantity in enumerate(quantities, len(start)):
            moved = values.copy()
            moved[k] += quantity.difference * values[k]
            slope = (model.forces(moved, False)[0] - force) / (moved[k] - values[k])
            assert np.linalg.norm(columns[:, k] - slope) <= 2e-3 * np.linalg.norm(slope)
    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-9, atol=1e-9 * np.ptp(forces[0]))
    device = Device(LAWS["strain_stiffening"], model.parameterisation.dependence(start))
    device = extend(device, list(zip(own, model.parameters_of(values), strict=True)))
    data = model.data
    time = np.arange(len(data.x)) * data.dt[0]
    expected, _ = respond(device, time, data.x, data.v, data.current, longest_step=2e-3)
    assert np.std(force - expected) < 0.02 * np.std(expected)


@pytest.mark.parametrize("form", [f for f in FORMS if f.time_scale], ids=lambda form: form.name)
@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("standard_solid", {"c0": 900.0, "k0": 1e4, "k1": 2e4}),
        ("kelvin_voigt", {"k": 2e4, "c": 900.0}),
    ],
)
def test_another_time_of_the_law_is_that_of_the_simulated_device(form, name, numbers):
    """Steady and moving runs, each at its own temperature, against the extended law."""
    time, runs = np.arange(0, 3.0, 1 / 256), []
    for k, temperature in enumerate((-5.0, 20.0, 40.0)):
        w = 2 * np.pi * (1.0 + 0.5 * k)
        x, v = 6e-3 * np.sin(w * time), 6e-3 * w * np.cos(w * time)
        run = TestRun(f"run{k}", time, x, v, 3e4 * x, 0 * x)
        runs.append(replace(run, temperature=np.full_like(x, temperature)))
    campaign = Campaign("warm", "made", tuple(runs))
    data = measured_runs(campaign.runs)
    model = Model(data, parameterise(campaign, LAWS[name], data))
    own = {q.name: q.starts[0] * model.size(q) for q in form.parameters}
    values = np.array([*(numbers[q.name] for q in model.parameterisation.free), *own.values()])
    model = model.with_effects(form)
    force = model.resolve_steps(values).forces(values, False)[0]
    for k, run in enumerate(runs):
        device = extend(law(name, numbers), [(form, own)])
        device = device.with_parameters(temperature=run.temperature[0])
        expected, _ = respond(device, time, run.displacement, run.velocity, 0.0)
        at = slice(data.starts[k], data.starts[k + 1])
        # after the first cycle nothing is left of how the run began
        late = time > 1.5
        assert np.max(np.abs(force[at] - expected)[late]) < 1e-3 * np.max(np.abs(expected))


FOLLOWERS = [form for form in FORMS if "force" in form.needs]
FOLLOWERS += [carry_history(form) for form in FOLLOWERS if can_carry_history(form)]


@pytest.fixture(scope="module")
def series():
    """Three runs of one device: strain stiffening, a moving current and a lag before the law."""
    time, runs = np.arange(0, 3.0, 1 / 128), []
    for k, rate in enumerate((1.3, 0.7, 1.9)):
        x = 6e-3 * np.sin(2 * np.pi * rate * time) * np.minimum(time, 1.0)
        v = np.gradient(x, time)
        force = (4e4 * x + 900 * v) * (1 - 0.1 * k)
        runs.append(TestRun(f"run{k}", time, x, v, force, 1 + np.sin(2 * time)))
    campaign = Campaign("series", "made", tuple(runs))
    data = measured_runs(campaign.runs)
    model = Model(data, parameterise(campaign, LAWS["strain_stiffening"], data))
    model = model.with_effects(EFFECTS["current_lag"][0])
    return model, np.append(model.parameterisation.starts(1, 0)[0], 0.2)


@pytest.mark.parametrize("form", FOLLOWERS, ids=lambda form: form.name)
def test_what_follows_the_force_has_exact_derivatives(form, series):
    model, before = series
    lag = len(before) - 1
    model = model.with_effects(form)
    own = [np.clip(q.starts[0] * model.size(q), q.lower, q.upper) for q in form.parameters]
    values = np.concatenate([before, own])
    _, columns = model.forces(values, True)

    def force(k, factor):
        moved = values.copy()
        moved[k] += factor * 1e-4 * abs(values[k])
        return model.forces(moved, False)[0]

    for k in range(len(values)):
        if not values[k]:
            continue
        # central differences of fourth order
        slope = (8 * (force(k, 1) - force(k, -1)) - force(k, 2) + force(k, -2)) / (
            12e-4 * abs(values[k])
        )
        # what changes the law's motion or current has forward differences
        error = 1e-3 if k == lag or (k > lag and form.motion is not None) else 1e-6
        assert np.linalg.norm(columns[:, k] - slope) <= error * np.linalg.norm(slope), k


def test_a_value_at_its_bound_follows_no_other_effect(bare):
    """The width of an asymmetry moves the force by a constant, but never below its bound."""
    model, law = bare
    model = model.with_effects(next(f for f in FORMS if f.name.endswith("asymmetry.spring")))
    width = model.effects[0].parameters[1]
    left = []
    for value in (width.lower, 2 * width.lower):
        fitted = FittedModel.at(model, np.array([*law, 1e3, value]))
        constant = fitted.model.data.weight[fitted.model.data.fitted]
        left.append(np.linalg.norm(fitted.across(constant)) / np.linalg.norm(constant))
    at_bound, inside = left
    assert inside < 0.1 < 0.5 < at_bound


def test_the_device_alone_has_no_effects_of_the_instruments(bare):
    model, law = bare
    delay, friction = (EFFECTS[name][0] for name in ("sensor_delay", "coulomb_friction"))
    both = model.with_effects(delay, friction)
    own = np.arange(len(delay.parameters) + len(friction.parameters)) + 1.0
    alone, values = both.without_instruments(np.concatenate([law, own]))
    assert alone.effects == (friction,)
    assert values.tolist() == [*law, *own[len(delay.parameters) :]]


def test_an_end_stop_is_a_spring_and_a_relaxation_is_none(bare):
    model, law = bare
    stop, arm = (EFFECTS[name][0] for name in ("end_stop", "extra_relaxation"))
    own = np.arange(len(stop.parameters) + len(arm.parameters)) + 1.0
    alone, values = model.with_effects(stop, arm).without_springs(np.concatenate([law, own]))
    assert alone.effects == (arm,)
    assert values.tolist() == [*law, *own[len(stop.parameters) :]]


def test_offsets_of_the_runs_leave_the_law_its_constant_force():
    law = LAWS["hyperbolic_tangent"]
    time = np.arange(0, 4.0, 1 / 128)
    runs, random = [], np.random.default_rng(2)
    for k, offset in enumerate((-20.0, 5.0, 25.0, -10.0)):
        x = 5e-3 * np.sin(2 * np.pi * (0.5 + 0.4 * k) * time)
        v = np.gradient(x, time)
        force = 1e4 * x + 80 * np.tanh(v / 0.01) + 40 + offset + random.standard_normal(len(time))
        runs.append(TestRun(f"run{k}", time, x, v, force, np.zeros(len(time))))
    campaign = Campaign("offsets", "made", tuple(runs))
    data = measured_runs(campaign.runs)
    p = parameterise(campaign, law, data, fixed={"delta": 0.0, "c": 0.0, "x_s": 1.0})
    model = Model(data, p, effects=(EACH_RUN,))
    names = [q.name for q in p.free]
    start = np.array([{"k": 1e4, "alpha": 80.0, "beta": 100.0, "F0": 400.0}[n] for n in names])
    fitted = fit_model(model, np.append(start, 0.0))
    alone = fitted.without_offsets
    assert alone.effects == () and fitted.cost < 1.3 * len(fitted.residual)
    assert alone.values[names.index("F0")] == pytest.approx(40.0, abs=5.0)
    again = FittedModel.at(model, np.append(alone.values, 0.0))
    assert again.cost == pytest.approx(fitted.cost, rel=1e-6)


def test_an_element_that_has_become_rigid_follows_no_effect():
    """Its stiffness would follow a mass by a step far beyond infinity: at first order alone."""
    time = np.arange(0, 8.0, 1 / 256)
    x = 1e-3 * sum(np.sin(2 * np.pi * f * time) / f for f in (0.5, 1.7, 4.0))
    x *= np.minimum(1, time)
    v = np.gradient(x, time)
    force = 2e4 * x + 300 * v + 3 * np.gradient(v, time)
    runs = Campaign("rig", "made", [TestRun("run", time, x, v, force, 0 * x)])
    data = measured_runs(runs.runs)
    model = Model(data, parameterise(runs, LAWS["standard_solid"], data))
    start = np.array([300.0, 2e4, 5e7])
    fitted = fit_model(model.resolve_steps(start), start)
    assert fitted.values[2] > 1e8
    left = fitted.across(fitted.residual)
    assert np.linalg.norm(left) > 0.9 * np.linalg.norm(fitted.residual)
