"""What holds for every form of every cause."""

from functools import cache
from pathlib import Path

import casadi
import numpy as np
import pytest

from controllers import CurrentMap
from isolation_sim.effects import EFFECTS, effect, extend, separate
from isolation_sim.effects.effect import Signals, in_sentence
from isolation_sim.errors import InputError
from isolation_sim.identification.characteristic_scales import characteristic_scale
from isolation_sim.laws import LAWS, law
from isolation_sim.laws.emit import symbols
from isolation_sim.laws.fingerprint import fingerprint

from ..laws.test_three_ways import casadi_function, numba_function, outputs
from .conftest import FORMS, motion, numbers, respond, size

DESIGN = (
    "current_lag field_saturation magnetic_remanence field_gap_coupling stress_softening "
    "amplitude_softening self_heating ambient_temperature tension_compression_asymmetry "
    "force_offset coulomb_friction inertia_force sensor_delay extra_relaxation "
    "linkage_backlash weak_rate_dependence end_stop cyclic_degradation"
).split()


def test_every_cause_of_the_design_is_there():
    assert set(DESIGN) <= set(EFFECTS)
    for cause, forms in EFFECTS.items():
        assert {form.cause for form in forms} == {cause}
        assert len({form.form for form in forms}) == len(forms)


def test_names_keep_their_capitals_within_a_sentence():
    assert in_sentence("Coulomb friction with Stribeck's rise") == (
        "Coulomb friction with Stribeck's rise"
    )
    assert in_sentence("coulomb_friction") == "Coulomb friction"
    assert in_sentence("Stress softening (Mullins)") == "stress softening (Mullins)"
    assert in_sentence("field_saturation") == "field saturation"


def test_parameters(form):
    assert sum(q.magnitude for q in form.parameters) == 1
    magnitude = form.parameters[form.magnitude]
    assert magnitude.lower <= 0 <= magnitude.upper
    assert not magnitude.divides
    assert form.source and form.title
    for q in form.parameters:
        assert characteristic_scale(q.unit, 300.0, 8e-3, 0.2, 2.0) > 0
        assert q.meaning and q.lower < q.upper and q.starts
        assert not (q.divides and q.lower <= 0)
        for start in q.starts:
            assert q.lower <= start * size(q) <= q.upper


def test_needs_are_what_it_uses(form):
    signals = Signals(*symbols(Signals._fields))
    states, numbers = (
        tuple(symbols([q.name for q in some])) for some in (form.states, form.parameters)
    )
    hooks = (form.rates, form.motion, form.time_scale, form.factor, form.force)
    values = [hook(signals, states, numbers) for hook in hooks if hook is not None]
    flat = [v for value in values for v in (value if isinstance(value, tuple) else (value,))]
    outputs = casadi.vertcat(*flat) + 0 * casadi.SX.sym("nothing")
    for need, symbol in (
        ("acceleration", signals.a), ("temperature", signals.temperature), ("force", signals.force)
    ):  # fmt: skip
        assert (need in form.needs) == casadi.depends_on(outputs, symbol), need
    assert not form.needs - {"acceleration", "temperature", "force", "current"}


@cache
def without_effect(changing):
    """Current, force and states of the plain law along the motion."""
    t, x, v, _ = motion()
    current = 1.0 + np.sin(2 * np.pi * 1.3 * t) if changing else 1.2
    return current, *respond(law("strain_stiffening"), t, x, v, current)


def test_with_magnitude_zero_the_law_is_as_it_was(form, isolator):
    t, x, v, _ = motion()
    current, plain, states = without_effect(False)
    extended, more = respond(extend(isolator, [(form, numbers(form, 0.0))]), t, x, v, current)
    largest = np.max(np.abs(plain))
    assert np.max(np.abs(extended - plain)) < 1e-5 * largest
    assert np.max(np.abs(more[: len(states)] - states)) < 1e-5 * np.max(np.abs(states))


def test_with_a_magnitude_it_is_not(form, isolator):
    """In a motion that has something for every effect: a changing current, and heat."""
    t, x, v, _ = motion()
    current, plain, _ = without_effect(True)
    extended = extend(isolator, [(form, numbers(form))])
    if "temperature" in form.needs:
        extended = extended.with_parameters(temperature=35.0)
    changed, _ = respond(extended, t, x, v, current)
    assert np.all(np.isfinite(changed))
    assert np.max(np.abs(changed - plain)) > 1e-4 * np.max(np.abs(plain))


@pytest.mark.parametrize("place", [0, 1])
def test_numpy_and_casadi_agree(form, place, draw, isolator):
    device = extend(isolator, [(form, numbers(form, place=place))])
    x, v, states, current = draw(device)
    states = tuple(np.abs(s) for s in states)
    by_numpy = np.array(np.broadcast_arrays(*outputs(device, x, v, states, current)))
    arguments = np.array([x, v, *states, current])
    symbolic = casadi_function(device).map(x.size)
    by_casadi = np.array(symbolic(*(row[np.newaxis] for row in arguments)))[:, 0]
    largest = np.max(np.abs(by_numpy), axis=1, keepdims=True) + 1e-300
    assert np.all(np.isfinite(by_numpy))
    # a filtered force, F + (y - F), is small here beside the force F
    assert np.max(np.abs(by_casadi - by_numpy) / largest) < 1e-10


@pytest.mark.parametrize(
    "causes",
    [
        ("field_saturation", "end_stop", "ambient_temperature", "inertia_force"),
        ("amplitude_softening", "weak_rate_dependence", "coulomb_friction"),
    ],
)
def test_written_out_for_numba_too(causes, draw, isolator):
    """Several effects in one law: everything that its text may hold, for one compilation."""
    applied = [(EFFECTS[cause][-1], numbers(EFFECTS[cause][-1])) for cause in causes]
    device = extend(isolator, applied)
    x, v, states, current = draw(device, 50)
    by_numpy = np.array(np.broadcast_arrays(*outputs(device, x, v, states, current)))
    written = numba_function(device)
    by_numba = np.array([written(*column) for column in np.array([x, v, *states, current]).T]).T
    largest = np.max(np.abs(by_numpy), axis=1, keepdims=True)
    assert np.max(np.abs(by_numba - by_numpy) / largest) < 1e-11


def anywhere(rng, low, high, n=400):
    """Random numbers between two others, many of them at the ends or at zero."""
    drawn = rng.uniform(low, high, n)
    drawn[rng.random(n) < 0.2] = low
    drawn[rng.random(n) < 0.2] = high
    if low <= 0 <= high:
        drawn[rng.random(n) < 0.2] = 0.0
    return drawn


def test_finite_over_its_bounds(form):
    """Whatever parameters within the bounds, motion and states, forces and rates are numbers."""
    rng = np.random.default_rng(0)
    parameters = [
        anywhere(rng, max(q.lower, -10 * abs(q.starts[0]) * size(q)),
                 min(q.upper, 1e3 * abs(q.starts[-1]) * size(q)))
        for q in form.parameters
    ]  # fmt: skip
    for q, values in zip(form.parameters, parameters, strict=True):
        if q.divides:
            values[values == 0] = 1e-3 * np.max(np.abs(values))
    x, v, a, current, force = (anywhere(rng, -s, s) for s in (0.1, 5.0, 100.0, 3.0, 1e5))
    signals = Signals(x, v, a, current, force, anywhere(rng, -40.0, 80.0))
    states = tuple(anywhere(rng, -1.0, 1.0) for _ in form.states)
    parameters = tuple(parameters)
    before, behind = (form.motion, form.current, form.time_scale), (form.factor, form.force)
    for hook in (*before, *behind, form.rates):
        if hook is not None:
            values = hook(signals, states, parameters)
            for value in values if isinstance(values, tuple) else (values,):
                assert np.all(np.isfinite(value))
    if form.time_scale is not None:
        assert np.all(form.time_scale(signals, states, parameters) > 0)
    if form.factor is not None:
        assert np.all(form.factor(signals, states, parameters) >= 0)
    # the energy of a force that is even in the deformation falls on one side
    even = form.cause in ("force_offset", "tension_compression_asymmetry")
    if form.stored_energy is not None and not even:
        assert np.all(form.stored_energy(x, states, parameters) >= 0)


def test_it_comes_apart_again(form, isolator):
    values = numbers(form)
    for device in (isolator, law("improved_bouc_wen"), law("strain_stiffening").scaled(10, 300)):
        base, applied = separate(extend(device, [(form, values)]))
        assert base.law is device.law
        assert base.current == device.current
        assert (base.length, base.force_scale) == (device.length, device.force_scale)
        assert base.current_range == device.current_range
        assert applied == [(form, values)]


def test_piecewise_law_keeps_its_force(form, draw):
    """The improved Bouc-Wen law has two pieces, which an effect on the current takes inside."""
    device = law("improved_bouc_wen")
    x, v, states, current = draw(device, 100)
    extended = extend(device, [(effect("current_lag"), {"lag": 0.1})])
    expected = device.force(x, v, states, current)
    np.testing.assert_allclose(
        extended.force(x, v, (*states, current), 0.3), expected, rtol=1e-10, atol=1e-9
    )


def test_fingerprints_name_the_arithmetic():
    device = law("kelvin_voigt", {"k": (2.0e4, 3.0e3), "c": 800.0})
    digests, again = (
        [fingerprint(extend(device, [(form, numbers(form))]).law) for form in FORMS.values()]
        for _ in range(2)
    )
    assert digests == again and None not in digests
    assert len({fingerprint(LAWS["kelvin_voigt"]), *digests}) == 1 + len(FORMS)


def test_current_map_takes_the_extended_device(form, isolator):
    device = extend(isolator, [(form, numbers(form))])
    x, v = 4e-3, 0.03
    states = (2e-3, 1e-3, *(1e-3,) * (len(device.law.states) - 2))
    target = device.force(x, v, states, 1.3)
    current = CurrentMap(device, 0.0, 3.0)(target, x, v, states)
    assert abs(device.force(x, v, states, current.current) - target) < 1e-8 * abs(target)


def test_refusals(isolator):
    lag = effect("current_lag")
    with pytest.raises(InputError, match="did you mean 'current_lag'"):
        effect("curent_lag")
    with pytest.raises(InputError, match="did you mean 'second_order'"):
        effect("current_lag", "second")
    with pytest.raises(InputError, match="parameter 'lag' is missing"):
        extend(isolator, [(lag, {})])
    with pytest.raises(InputError, match="did you mean 'lag'"):
        extend(isolator, [(lag, {"lag": 0.1, "lagg": 0.1})])
    with pytest.raises(InputError, match="given twice"):
        extend(isolator, [(lag, {"lag": 0.1}), (effect("current_lag", "second_order"),
                                                {"lag": 0.1})])  # fmt: skip
    with pytest.raises(InputError, match="expected: 0 to 5"):
        extend(isolator, [(lag, {"lag": -0.1})])
    with pytest.raises(InputError, match="has effects already"):
        extend(extend(isolator, [(lag, {"lag": 0.1})]), [])


def test_a_device_without_coil_asks_for_none(form):
    device = extend(law("linear", {"k": 1e4}), [(form, numbers(form))])
    # unless what it adds is itself a matter of the current
    assert device.depends_on_current == ("current" in form.needs)


def test_every_cause_is_documented():
    page = (Path(__file__).resolve().parents[2] / "docs" / "effects.md").read_text()
    for name in FORMS:
        cause, form = name.split(".")
        assert f"`{cause}`" in page and f"`{form}`" in page
