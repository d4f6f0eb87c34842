"""Values at the bound of their range: asked for by the data, or only left open."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from isolation_sim.discrepancy.device.intervals import (
    acts_as_another,
    needs_bound,
    values_at_bounds,
)
from isolation_sim.discrepancy.device.model import Model
from isolation_sim.discrepancy.device.screen import _LITTLE
from isolation_sim.effects import EffectParameter, effect

T = np.linspace(0, 1, 200)


class Decay:
    """A loss d (1 - exp(-t / s)): of d and s the data tell the ratio alone where t is small."""

    def __init__(self, data):
        self.data = data

    def bounds(self):
        return np.array([0.0, 1e-3]), np.array([1.0, 1e3])

    def lower(self, quantity):
        return quantity.lower

    def upper(self, quantity):
        return quantity.upper

    def slices(self):
        return [slice(0, 2)]

    def residuals(self, values, derivatives):
        loss, scale = values
        e = np.exp(-T / scale)
        columns = np.stack([1 - e, -loss * e * T / scale**2], axis=1)
        return (loss * (1 - e) - self.data) / 1e-2, columns / 1e-2


EFFECT = SimpleNamespace(
    parameters=(
        EffectParameter("loss", "1", "loss", lower=0.0, upper=1.0, magnitude=True),
        EffectParameter("scale", "s", "time", lower=1e-3, upper=1e3),
    )
)


def searched(data, values):
    model = Decay(data)
    residual = model.residuals(values, False)[0]
    return SimpleNamespace(
        model=model, effects=(EFFECT,), values=np.array(values), cost=float(residual @ residual)
    )


def test_poles_are_in_line_near_the_middle_of_the_tested_deformation():
    data = SimpleNamespace(x=np.array([-4e-3, 10e-3]), sizes=(300.0, 10e-3, 0.1, 1.0))
    model = Model(data, SimpleNamespace(law=None))
    loss, centre = effect("field_gap_coupling", "off_centre").parameters
    assert (model.lower(centre), model.upper(centre)) == pytest.approx((-3e-3, 3e-3))
    assert (model.lower(loss), model.upper(loss)) == (loss.lower, loss.upper)


def test_an_open_linkage_has_a_gap_that_the_displacement_shows():
    data = SimpleNamespace(x=np.array([-4e-3, 10e-3]), sizes=(300.0, 10e-3, 0.1, 1.0))
    model = Model(data, SimpleNamespace(law=None))
    (gap,), (play,) = (effect("linkage_backlash", form).parameters for form in ("open", "play"))
    assert (model.lower(gap), model.lower(play)) == pytest.approx((5e-6, 0.0))
    # a fit begins no nearer to zero
    assert gap.starts[0] * model.size(gap) * _LITTLE >= model.lower(gap)


@pytest.mark.parametrize(
    ("data", "values", "needed"),
    [
        (0.01 * T, (1.0, 100.0), False),  # (0.7, 70) fits as well
        (1.4 * (1 - np.exp(-T / 0.3)), (1.0, 0.15), True),
        (0.5 * (1 - np.exp(-T / 0.3)), (0.5, 0.3), False),  # none lies at its bound
    ],
)
def test_a_bound_counts_where_the_gain_depends_on_it(data, values, needed):
    one = searched(data, values)
    gain = float(np.sum((data / 1e-2) ** 2)) - one.cost
    assert needs_bound(one, 0, gain) == needed


def test_values_that_a_whole_step_takes_too_far_follow_one_that_leaves_its_bound():
    class Saturating(Decay):
        """The data tell the ratio alone; far from it the residual hardly changes."""

        def residuals(self, values, derivatives):
            loss, scale = values
            off = 10 * (loss / scale - self.data)
            columns = np.stack([10 / scale + 0 * T, -10 * loss / scale**2 + 0 * T], axis=1)
            return np.arctan(off), columns / (1 + off**2)[:, np.newaxis]

    one = searched(0.01 * T, (1.0, 1.0))
    one = SimpleNamespace(**{**vars(one), "model": Saturating(1.0 + 0 * T), "cost": 0.0})
    assert not needs_bound(one, 0, 200.0)


def test_a_plain_bound_does_not_count():
    loss, scale = EFFECT.parameters
    data = 1.4 * (1 - np.exp(-T / 0.3))
    one = searched(data, (1.0, 0.15))
    plain = SimpleNamespace(parameters=(replace(loss, plain=(1.0,)), scale))
    assert not needs_bound(SimpleNamespace(**{**vars(one), "effects": (plain,)}), 0, 1e3)
    other = SimpleNamespace(parameters=(replace(loss, plain=(0.0,)), scale))
    assert needs_bound(SimpleNamespace(**{**vars(one), "effects": (other,)}), 0, 1e3)


def test_a_slow_part_of_a_field_whose_rest_follows_at_once_is_a_lag():
    def at_bounds(form, *values):
        one = effect("current_lag", form)
        model = SimpleNamespace(
            lower=lambda quantity: quantity.lower, upper=lambda quantity: quantity.upper,
            slices=lambda: [slice(0, len(values))],
        )  # fmt: skip
        searched = SimpleNamespace(effects=(one,), model=model, values=values)
        return [place for place, _ in values_at_bounds(searched, 0)]

    assert at_bounds("two_stages", 0.0, 0.9, 0.09) == []
    assert at_bounds("two_stages", 0.0, 0.9, 5.0) == [2]  # what follows so late is remanence
    assert at_bounds("first_order", 0.0) == [0]


def test_a_bound_at_which_it_is_another_effect_counts_in_any_case():
    loss, scale = EFFECT.parameters
    one = searched(0.01 * T, (1.0, 100.0))  # (0.7, 70) fits as well
    other = SimpleNamespace(parameters=(replace(loss, other=(1.0,)), scale))
    assert acts_as_another(SimpleNamespace(**{**vars(one), "effects": (other,)}), 0, 1.0)


@pytest.mark.parametrize(("loss_found", "time", "another"), [(0.1, 10.0, True), (0.5, 0.3, False)])
def test_a_value_that_the_data_leave_open_up_to_another_effect_counts(loss_found, time, another):
    loss, scale = EFFECT.parameters
    data = loss_found * (1 - np.exp(-T / time))
    one = searched(data, (loss_found, time))
    endless = SimpleNamespace(parameters=(loss, replace(scale, other=(100.0,))))
    one = SimpleNamespace(**{**vars(one), "effects": (endless,)})
    gain = float(np.sum((data / 1e-2) ** 2))
    assert acts_as_another(one, 0, gain) == another * ["scale"]
    # of two numbers both have to lie there
    endless.parameters = (replace(loss, other=(0.5,)), endless.parameters[1])
    assert acts_as_another(one, 0, gain) == ["loss"] * (loss_found == 0.5)


@pytest.mark.parametrize(
    ("cause", "form", "place"),
    [
        ("weak_rate_dependence", "thinning", 1),  # thins only beyond the tests
        ("coulomb_friction", "smooth", -1),  # not developed at the largest velocity
        ("coulomb_friction", "stroke", -1),
        ("coulomb_friction", "stribeck", -1),
        ("coulomb_friction", "dahl", -1),  # nor at the largest deformation, where it is a spring
    ],
)
def test_what_is_no_more_than_a_dashpot_or_a_spring_is_named_for_nothing_else(cause, form, place):
    quantity = effect(cause, form).parameters[place]
    loss, scale = EFFECT.parameters
    bounds = replace(quantity, lower=loss.lower, upper=1.0)
    one = searched(0.01 * T, (1.0, 100.0))  # (0.7, 70) fits as well
    other = SimpleNamespace(parameters=(bounds, scale))
    assert acts_as_another(SimpleNamespace(**{**vars(one), "effects": (other,)}), 0, 1.0)


def test_friction_has_developed_at_the_largest_velocity_and_deformation():
    data = SimpleNamespace(x=np.array([-4e-3, 10e-3]), sizes=(300.0, 10e-3, 0.1, 1.0))
    model = Model(data, SimpleNamespace(law=None))
    velocity, length = (effect("coulomb_friction", f).parameters[1] for f in ("smooth", "dahl"))
    assert (model.upper(velocity), model.upper(length)) == pytest.approx((0.1, 10e-3))
    rise = effect("coulomb_friction", "stribeck").parameters[-1]  # it develops over a tenth
    assert model.upper(rise) == pytest.approx(1.0)


def test_an_amplitude_that_is_forgotten_at_once_is_none():
    memory = effect("amplitude_softening", "storage").parameters[-1]
    loss, _ = EFFECT.parameters
    one = searched(0.01 * T, (0.1, memory.lower))
    soft = SimpleNamespace(parameters=(loss, replace(memory, upper=1e3)))
    assert acts_as_another(SimpleNamespace(**{**vars(one), "effects": (soft,)}), 0, 1e9)


@pytest.mark.parametrize("form", ["frequency", "mean_speed"])
def test_a_mean_over_the_whole_test_only_acts_like_a_rate_dependence(form):
    window = effect("weak_rate_dependence", form).parameters[-1]
    loss, _ = EFFECT.parameters
    one = searched(0.01 * T, (0.1, window.upper))  # (0.07, 7) fits as well
    mean = SimpleNamespace(parameters=(loss, window))
    assert acts_as_another(SimpleNamespace(**{**vars(one), "effects": (mean,)}), 0, 1.0)
