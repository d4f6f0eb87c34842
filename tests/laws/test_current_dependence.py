"""Parameters against the current."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from isolation_sim.errors import InputError
from isolation_sim.laws import CurrentDependence


def test_polynomial_in_ascending_powers():
    dependence = CurrentDependence.polynomial({"a": (1.0, 2.0, 3.0), "b": 4.0})
    assert dependence.coefficients.shape == (1, 2, 3)
    assert dependence.at(2.0) == (17.0, 4.0)
    a, b = dependence.at(np.array([0.0, 1.0, 2.0]))
    assert a.tolist() == [1.0, 6.0, 17.0] and b.tolist() == [4.0, 4.0, 4.0]


def test_prescribed_order():
    dependence = CurrentDependence.constant({"a": 1.0, "b": 2.0}, order=("b", "a"))
    assert dependence.names == ("b", "a") and dependence.at(0.0) == (2.0, 1.0)
    assert dependence.ordered(("a", "b")).at(0.0) == (1.0, 2.0)


@settings(max_examples=50, deadline=None, derandomize=True, database=None)
@given(st.lists(st.floats(-2, 6), min_size=1, max_size=8))
def test_table_interpolates_as_numpy_does(currents):
    knots, values = [0.0, 1.0, 2.5, 3.0], [4.0, 2.0, 8.0, 7.0]
    dependence = CurrentDependence.table(knots, {"a": values, "b": [0.0, 0.0, 1.0, 0.0]})
    expected = np.interp(currents, knots, values)
    np.testing.assert_allclose(dependence.at(np.array(currents))[0], expected, rtol=1e-14)
    for current, value in zip(currents, expected, strict=True):
        assert dependence.at(current)[0] == pytest.approx(value, rel=1e-14)


def test_table_traces_in_casadi():
    import casadi

    dependence = CurrentDependence.table([0.0, 1.0, 3.0], {"a": [1.0, 2.0, -2.0]})
    current = casadi.SX.sym("current")
    function = casadi.Function("a", [current], list(dependence.at(current)))
    for value in (-1.0, 0.0, 0.3, 1.0, 2.0, 3.0, 4.0):
        assert float(function(value)) == pytest.approx(dependence.at(value)[0], abs=1e-15)


def test_single_knot_is_a_constant():
    dependence = CurrentDependence.table([1.0], {"a": [5.0]})
    assert [dependence.at(c)[0] for c in (0.0, 1.0, 2.0)] == [5.0] * 3
    assert not dependence.depends_on_current


def test_depends_on_current():
    assert not CurrentDependence.constant({"a": 1.0}).depends_on_current
    assert not CurrentDependence.polynomial({"a": (1.0, 0.0)}).depends_on_current
    assert CurrentDependence.polynomial({"a": (1.0, 2.0)}).depends_on_current
    assert CurrentDependence.table([0, 1], {"a": [1.0, 2.0]}).depends_on_current


def test_replaced_keeps_the_others():
    table = CurrentDependence.table([0.0, 1.0], {"a": [1.0, 2.0], "b": [3.0, 4.0]})
    changed = table.replaced(a=(1.0, 0.0, 2.0))
    assert changed.at(0.5) == (1.5, 3.5) and changed.at(3.0) == (19.0, 4.0)
    assert table.at(0.5) == (1.5, 3.5)


def test_equality_and_read_only():
    one, two = (CurrentDependence.constant({"a": 1.0}) for _ in range(2))
    assert one == two and hash(one) == hash(two)
    assert one != CurrentDependence.constant({"a": 2.0})
    with pytest.raises(ValueError, match="read-only"):
        one.coefficients[0, 0, 0] = 2.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CurrentDependence.constant({"a": np.nan}), "'a'"),
        (lambda: CurrentDependence.polynomial({"a": (1.0, np.inf)}), "'a'"),
        (lambda: CurrentDependence.polynomial({"a": "many"}), "'a'"),
        (lambda: CurrentDependence.polynomial({"a": ()}), "'a'"),
        (lambda: CurrentDependence.constant({"a": 1.0}, order=("a", "b")), "'b' is missing"),
        (lambda: CurrentDependence.constant({"alfa": 1.0}, order=("alpha",)), "mean 'alpha'"),
        (lambda: CurrentDependence.table([0, 0], {"a": [1, 2]}), "increase"),
        (lambda: CurrentDependence.table([0, np.nan], {"a": [1, 2]}), "increase"),
        (lambda: CurrentDependence.table([0, 1], {"a": [1, 2, 3]}), "3 values for 2 currents"),
        (lambda: CurrentDependence(("a",), [-np.inf, np.inf], [[1.0]]), "shape"),
        (lambda: CurrentDependence(("a",), [-np.inf, np.inf], [[[np.nan]]]), "'a'"),
        (lambda: CurrentDependence(("a",), [0.0, 1.0], [[[1.0]]]), "-inf to inf"),
        (lambda: CurrentDependence(("a",), [-np.inf, 0, np.inf], [[[1.0]]]), "breaks"),
        (lambda: CurrentDependence(("a", "a"), [-np.inf, np.inf], [[[1.0], [1.0]]]), "twice"),
        (lambda: CurrentDependence(("a",), [-np.inf, np.inf], np.zeros((1, 1, 0))), "constants"),
        (lambda: CurrentDependence.constant({"k1": 1.0}).replaced(k=1.0), "unknown parameter"),
    ],
)
def test_refuses(make, message):
    with pytest.raises(InputError, match=message) as refused:
        make()
    assert "\n" not in str(refused.value)
