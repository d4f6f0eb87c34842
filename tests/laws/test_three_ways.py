"""A law means the same to NumPy, to CasADi and written out for Numba."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from isolation_sim.compilation.generated import load_text
from isolation_sim.laws import LAWS
from isolation_sim.laws.emit import function_text, straight_line, symbols


def outputs(device, x, v, states, current):
    result = [device.force(x, v, states, current), *device.rates(x, v, states, current)]
    if device.stores_energy:
        result.append(device.stored_energy(x, states, current))
    return result


def traced(device):
    names = ["x", "v", *device.law.state_names, "current"]
    inputs = symbols(names)
    x, v, *states, current = inputs
    return names, inputs, outputs(device, x, v, tuple(states), current)


def casadi_function(device):
    import casadi

    _, inputs, expressions = traced(device)
    return casadi.Function("law", inputs, expressions)


def numba_function(device):
    """A module of the cache folder: equal text is compiled once."""
    names, inputs, expressions = traced(device)
    _, _, statements, results = straight_line(dict(zip(names, inputs, strict=True)), expressions)
    body = [*statements, f"return ({', '.join(results)},)"]
    head = "import math\n\nfrom numba import njit\n\n\n"
    text = function_text("written", ", ".join(names), body, "@njit(cache=True)")
    return load_text("test", head + text).written


def test_every_registered_law_is_covered(devices):
    assert {device.law.name for device in devices.values()} == set(LAWS)


def test_numpy_casadi_and_numba_agree(device, draw):
    x, v, states, current = draw(device)
    by_numpy = np.array(outputs(device, x, v, states, current))
    arguments = np.array([x, v, *states, current])
    symbolic = casadi_function(device)
    by_casadi = np.array(symbolic.map(x.size)(*(row[np.newaxis] for row in arguments)))[:, 0]
    written = numba_function(device)
    by_numba = np.array([written(*column) for column in arguments.T]).T
    # sums cancel: compare against the size of what is summed
    size = np.max(np.abs(by_numpy), axis=1, keepdims=True)
    assert np.all(np.isfinite(by_numpy))
    assert np.max(np.abs(by_casadi - by_numpy) / size) < 1e-12
    assert np.max(np.abs(by_numba - by_numpy) / size) < 1e-12


def test_numbers_and_arrays_agree(device):
    n = len(device.law.states)

    @settings(max_examples=25, deadline=None, derandomize=True, database=None)
    @given(
        st.lists(st.floats(-1, 1), min_size=2 + n, max_size=2 + n),
        st.floats(0, 3),
    )
    def agree(motion, current):
        scale = device.deformation_scale
        x, v, *states = (scale * m for m in motion)
        single = outputs(device, x, v, tuple(states), current)
        columns = tuple(np.full(2, s) for s in states)
        double = outputs(device, np.full(2, x), np.full(2, v), columns, np.full(2, current))
        for one, two in zip(single, double, strict=True):
            np.testing.assert_allclose(two, one, rtol=1e-12, atol=1e-12 * abs(scale))

    agree()
