"""Effects are looked at with the law linearised, shaped, then fitted: each step is no worse."""

from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from isolation_sim.discrepancy.device import observable_effects
from isolation_sim.discrepancy.device import screen as screening
from isolation_sim.discrepancy.device.intervals import may_be_zero
from isolation_sim.discrepancy.device.model import FittedModel, Model, fit_model
from isolation_sim.discrepancy.device.screen import (
    Direction,
    first_values,
    fit_directions,
    refine,
    screen,
    screen_effect,
)
from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.discrepancy.interval import Interval
from isolation_sim.effects import EFFECTS, Effect, EffectParameter, effect
from isolation_sim.errors import InputError
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.law_fit import parameterise
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured_runs import hold_out_some, measured_runs
from isolation_sim.laws import LAWS
from isolation_sim.workers import workers

RATE, STIFFNESS, DAMPING = 128, 3e4, 200.0
LOSS, HALF = 0.4, 4e-3


def runs(held_out=(2,)):
    """A spring and a dashpot that soften with |x| by r / (1 + r), r = |x| / 4 mm, under noise."""
    rng = np.random.default_rng(5)
    time = np.arange(0, 8, 1 / RATE)
    made = []
    for k, size in enumerate((2e-3, 8e-3, 5e-3, 3e-3)):
        omega = 2 * np.pi * (0.7 + 0.3 * k)
        x, v = size * np.sin(omega * time), size * omega * np.cos(omega * time)
        ratio = np.abs(x) / HALF
        force = (STIFFNESS * x + DAMPING * v) * (1 - LOSS * ratio / (1 + ratio))
        force += 0.005 * np.std(force) * rng.standard_normal(len(time))
        one = TestRun(f"run{k}", time, x, v, force, np.zeros(len(time)), velocity_measured=True)
        made.append(replace(one, hold_out=k in held_out))
    return Campaign("softening", "made", made)


@pytest.fixture(scope="module")
def bare():
    data = measured_runs(runs().runs)
    model = Model(data, parameterise(runs(), LAWS["kelvin_voigt"], data))
    return fit_model(model, model.parameterisation.starts(1, 0)[0], 50, 1e-10)


@pytest.fixture(scope="module")
def noise(bare):
    return np.random.default_rng(0).standard_normal((len(bare.residual), 6))


def halved(signals, states, parameters):
    return (signals.x if signals.x > 0 else signals.x / 2), signals.v


def test_an_effect_that_cannot_be_traced_is_named(monkeypatch):
    part = EffectParameter("part", "1", "part", magnitude=True, starts=(0.1,))
    one_side = Effect("halved", "one_side", "Halved", (part,), motion=halved)
    monkeypatch.setattr(observable_effects, "EFFECTS", {"halved": (one_side,)})
    with pytest.raises(InputError, match=r"candidates.py:\d+.*signals.x > 0.*cannot be traced"):
        diagnose(runs(), "kelvin_voigt", threads=1, tiers="causes")


def test_each_step_gains_on_the_one_before(bare, noise):
    softening = effect("amplitude_softening", "instantaneous")
    looked_at = screen_effect(bare, softening, noise)
    own = refine(bare, looked_at, noise)
    with workers(1) as pool:
        (together,) = fit_directions(bare, [own], pool, lambda: None)
    assert 0 < looked_at.gain <= own.gain
    # with the law linearised the cost is that of the model up to what is not linear
    assert bare.cost - own.gain == pytest.approx(together.cost, rel=0.3)
    loss = together.parameters(0)["loss"]
    assert loss == pytest.approx(LOSS, rel=0.1)
    assert together.cost < 1.1 * len(together.residual)


def test_what_cannot_compete_with_the_best_is_not_fitted(bare, noise, monkeypatch):
    with workers(1) as pool:
        (best, *others) = screen(bare, EFFECTS["amplitude_softening"], noise, pool)
        # what changes the current or the motion often gains more than expected
        slow = Direction(effect("current_lag", "first_order"), 1.0, 1.0, np.array([0.1]))
        weak = Direction(effect("force_offset", "constant"), 1.0, 1.0, np.array([1.0]))
        refitted = []
        monkeypatch.setattr(screening, "refit", lambda one: refitted.append(one) or one)
        fitted = fit_directions(bare, [best, *others[:2], weak, slow], pool, lambda: None)
    causes = [one.causes[-1] for one in fitted]
    assert sorted(causes) == ["amplitude_softening"] * 3 + ["current_lag"]
    assert [one.cost for one in fitted] == sorted(one.cost for one in fitted)
    # one form of a cause
    assert refitted == fitted[:1]


def test_a_fit_begins_where_the_law_follows_the_effect(bare, noise):
    """A spring beside that of the law: the law gives way, and the fit does not begin far off."""
    stop = effect("end_stop", "linear")
    strong = Direction(stop, 0.0, 1.0, np.array([0.3 * STIFFNESS, 1e-6]))
    model = bare.model.with_effects(stop)
    start = first_values(bare, model, strong)
    residual = model.residuals(start, False)[0]
    stays = model.residuals(np.concatenate([bare.values, strong.start]), False)[0]
    assert residual @ residual < 1.1 * bare.cost < stays @ stays
    # a strength that the law cannot make room for is taken in small part
    strong = Direction(stop, 0.0, 1.0, np.array([100 * STIFFNESS, 5e-3]))
    assert first_values(bare, model, strong)[-2] == pytest.approx(5 * STIFFNESS)


def slow_field():
    """A spring and a dashpot under a field that rises within 3 s and falls within 6 s."""
    rng = np.random.default_rng(2)
    time = np.arange(0, 60, 1 / 32)
    made = []
    for k, ends in enumerate(((5, 9, 30, 33), (12, 20, 24, 45), (0, 25, 40, 50))):
        current = 2.0 * (np.searchsorted(ends, time) % 2)
        field = np.empty_like(current)
        field[0] = now = current[0]
        for i in range(1, len(time)):
            lag = 6.0 if now > current[i] else 3.0
            field[i] = now = current[i] + (now - current[i]) * np.exp(-1 / (32 * lag))
        omega = 2 * np.pi * (0.2 + 0.1 * k)
        x, v = 5e-3 * np.sin(omega * time), 5e-3 * omega * np.cos(omega * time)
        force = (STIFFNESS * x + 2000 * v) * (1 + 0.5 * field)
        force += 0.005 * np.std(force) * rng.standard_normal(len(time))
        made.append(TestRun(f"run{k}", time, x, v, force, current, velocity_measured=True))
    return Campaign("slow field", "made", made)


def test_a_slow_field_is_seen_before_it_is_fitted():
    # what looks like a small gain may not be fitted at all, beside many other effects
    campaign = slow_field()
    data = measured_runs(campaign.runs)
    model = Model(data, parameterise(campaign, LAWS["kelvin_voigt"], data, 1))
    base = fit_model(model, model.parameterisation.starts(1, 0)[0], 50, 1e-10)
    noise = np.random.default_rng(0).standard_normal((len(base.residual), 6))
    looked_at = screen_effect(base, effect("current_lag", "rise_and_fall"), noise)
    with workers(1) as pool:
        (fitted,) = fit_directions(base, [refine(base, looked_at, noise)], pool, lambda: None)
    assert fitted.values[-2:] == pytest.approx([3.0, 2.0], rel=0.05)
    assert looked_at.gain > 0.3 * (base.cost - fitted.cost)


@pytest.mark.parametrize(
    ("form", "others", "gone"), [("first_order", [], True), ("two_stages", [0.8, 1.0], False)]
)
def test_a_size_of_zero_counts_where_nothing_is_left_of_the_effect(form, others, gone):
    campaign = slow_field()
    data = measured_runs(campaign.runs)
    model = Model(data, parameterise(campaign, LAWS["kelvin_voigt"], data, 1))
    law = fit_model(model, model.parameterisation.starts(1, 0)[0]).values
    values = np.array([*law, 0.5, *others])
    final = FittedModel.at(model.with_effects(effect("current_lag", form)), values)
    assert may_be_zero(final, 0, {"lag": Interval(0.5, 0.0, 1.0, "s")}) is gone
    assert not may_be_zero(final, 0, {"lag": Interval(0.5, 0.2, 0.8, "s")})
    assert not may_be_zero(final, 0, {"lag": Interval(0.5, 0.0, np.inf, "s")})


def test_a_loss_that_never_ends_is_not_zero_because_its_end_is_unknown():
    rng = np.random.default_rng(4)
    time = np.arange(0, 40, 1 / 32)
    x, v = 5e-3 * np.sin(2 * np.pi * time), 5e-3 * 2 * np.pi * np.cos(2 * np.pi * time)
    law, loss = np.array([STIFFNESS, 2000.0]), effect("cyclic_degradation", "exponential")

    def fitted(path):
        """A loss that reaches its end behind the path, with noise of the force."""
        run = TestRun("run", time, x, v, STIFFNESS * x, 0 * time, velocity_measured=True)
        campaign = Campaign("wear", "made", [run])
        data = measured_runs(campaign.runs)
        model = Model(data, parameterise(campaign, LAWS["kelvin_voigt"], data, 0))
        values = np.array([*law, 0.2, path])
        force = model.with_effects(loss).forces(values, False)[0]
        noise = 0.01 * np.std(force) * rng.standard_normal(len(time))
        model = replace(model, data=replace(data, force=force + noise))
        return FittedModel.at(model.with_effects(loss), values)

    # the force loses 1 % in both; an interval by noise of the motion may hold zero
    numbers = {"loss": Interval(0.2, 0.0, 0.95, "1")}
    assert not may_be_zero(fitted(20.0), 0, numbers)
    assert may_be_zero(fitted(0.1), 0, numbers)


def test_the_cause_leads_and_what_the_data_do_not_excite_is_left_out(bare, noise):
    listed = [
        effect("coulomb_friction"), effect("amplitude_softening", "instantaneous"),
        effect("field_saturation"), effect("force_offset"),
    ]  # fmt: skip
    with workers(2) as pool:
        result = screen(bare, listed, noise, pool)
    assert result[0].effect.cause == "amplitude_softening"
    assert "field_saturation" not in [one.effect.cause for one in result]  # the coil is off


def test_a_held_out_run_leaves_no_sample_in_what_is_searched(bare):
    data = bare.model.data
    left = data.without_held_out()
    assert left.names == ("run0", "run1", "run3") and left.fitted.all()
    np.testing.assert_array_equal(left.lengths, data.lengths[[0, 1, 3]])
    np.testing.assert_array_equal(left.force, data.force[data.fitted])
    np.testing.assert_array_equal(left.force_noise, data.force_noise[[0, 1, 3]])


def test_of_a_run_held_out_in_part_the_first_samples_are_left():
    one = runs(held_out=()).runs[:1]
    data = hold_out_some(measured_runs(one), one)
    left = data.without_held_out()
    assert left.lengths == [np.sum(data.fitted)] and left.lengths[0] < data.lengths[0]
    np.testing.assert_array_equal(left.x, data.x[: left.lengths[0]])


def test_linear_algebra_of_workers_stays_on_their_threads():
    def most():
        return max(lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas")

    before = most()
    with workers(2) as pool:
        assert set(pool.map(lambda _: most(), range(4))) == {1}
        assert list(pool.map(lambda k: k * k, range(5))) == [0, 1, 4, 9, 16]
    assert most() == before


def test_of_arms_and_a_spring_pot_the_smaller_only_mends_a_spectrum():
    from isolation_sim.discrepancy.device.causes import less_of_a_spectrum, share_a_spectrum

    arms, pot = effect("extra_relaxation", "two_arms"), effect("weak_rate_dependence", "spring_pot")
    friction, power = effect("coulomb_friction", "smooth"), effect("weak_rate_dependence", "power")
    assert less_of_a_spectrum((arms, friction, pot), (0.5, 0.1, 0.4)) == [False, False, True]
    assert less_of_a_spectrum((arms, pot), (0.3, 0.6)) == [True, False]
    assert less_of_a_spectrum((arms, power), (0.3, 0.6)) == [False, False]
    assert share_a_spectrum((arms, friction, pot)) and not share_a_spectrum((arms, power))
