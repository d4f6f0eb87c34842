"""The field-gap factor around any law."""

import numpy as np
import pytest

from isolation_sim.laws import CurrentDependence, Device, available_laws, law
from isolation_sim.laws.field_gap import EPSILON_FINITE_ELEMENTS, LAW, field_gap
from isolation_sim.laws.fingerprint import fingerprint
from isolation_sim.laws.registry import LAWS


def test_published_loss():
    # Section 4.2: 0.588 T to 0.568 T at 15 mm, and a loss of less than 0.01 T at 8 mm
    assert EPSILON_FINITE_ELEMENTS * 15e-3 == pytest.approx(0.02 / 0.588)
    assert 0.588 * EPSILON_FINITE_ELEMENTS * 8e-3 == pytest.approx(0.0107, abs=1e-4)


def test_without_loss_it_is_the_law(draw):
    plain, wrapped = law("strain_stiffening"), law("strain_stiffening_field_gap")
    none = wrapped.with_parameters(gap_epsilon=0.0)
    x, v, states, current = draw(plain, 100)
    np.testing.assert_array_equal(
        none.force(x, v, states, current), plain.force(x, v, states, current)
    )
    np.testing.assert_array_equal(
        wrapped.rates(x, v, states, current), plain.rates(x, v, states, current)
    )
    ratio = wrapped.force(x, v, states, current) / plain.force(x, v, states, current)
    np.testing.assert_allclose(ratio, 1 - EPSILON_FINITE_ELEMENTS * np.abs(x), rtol=1e-12)


def test_scaling_every_parameter_is_scaling_the_force(draw):
    """The paper's reading: mu multiplies the parameters. Rates hold ratios of them alone."""
    wrapped = law("strain_stiffening_field_gap", {"gap_epsilon": 30.0})
    for x in (-5e-3, 0.0, 8e-3):
        mu = 1 - 30.0 * abs(x)
        numbers = {k: mu * p for k, p in zip(wrapped.law.parameter_names[:-1],
                   wrapped.parameters_at(1.0)[:-1], strict=True)}  # fmt: skip
        weaker = law("strain_stiffening", numbers)
        states = (3e-3, -2e-3)
        assert wrapped.force(x, 0.1, states, 1.0) == pytest.approx(
            weaker.force(x, 0.1, states, 1.0), rel=1e-12
        )
        assert wrapped.rates(x, 0.1, states, 1.0) == pytest.approx(
            weaker.rates(x, 0.1, states, 1.0), rel=1e-12
        )


def test_factor_never_turns_the_force_round():
    wrapped = law("strain_stiffening_field_gap", {"gap_epsilon": 100.0})
    assert wrapped.force(20e-3, 0.0, (5e-3, 0.0), 1.0) == 0.0


@pytest.mark.parametrize("name", [name for name in available_laws() if name != LAW.name])
def test_every_law_can_be_wrapped(name):
    inner = LAWS[name]
    wrapped = field_gap(inner)
    assert wrapped.parameter_names == (*inner.parameter_names, "gap_epsilon")
    assert wrapped.stored_energy is None
    assert fingerprint(wrapped) is not None
    assert fingerprint(wrapped) != fingerprint(inner)


def test_wrapped_spring():
    spring = Device(
        field_gap(LAWS["linear"]), CurrentDependence.constant({"k": 2e4, "gap_epsilon": 10.0})
    )
    assert spring.force(-0.02, 0.0, (), 0.0) == pytest.approx(-2e4 * 0.02 * 0.8)
