"""Li & Li: the reduced model of the refits, and the settled decay rate, by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isolation_sim.identification.sinusoidal import sinusoidal
from isolation_sim.laws import law
from isolation_sim.laws.published import CURRENTS_A, LI_LI_GENERALISED
from studies.papers.paper_000 import decay_rate
from studies.papers.refit_000 import loops, lower_branch, refit


def steady_response(square: float, cycles: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """Phase and state of dζ/dτ = cos τ - s² ζ³ in a cycle after many."""
    tau = 2 * np.pi * (cycles + np.arange(2001) / 2000)
    solution = solve_ivp(
        lambda t, z: np.cos(t) - square * z**3, (0, tau[-1]), [0.0], t_eval=tau,
        rtol=1e-9, atol=1e-12, method="LSODA",
    )  # fmt: skip
    return tau, solution.y[0]


@pytest.mark.parametrize("s", [0.3, 1.0, 5.0])
def test_lower_branch(s):
    tau, zeta = steady_response(s**2)
    force = s**2 * zeta**3
    loss = np.trapezoid(force * np.cos(tau), tau) / np.pi
    assert lower_branch()(np.log(s)) == pytest.approx([force[500], loss], rel=2e-5)


def test_reduced_model_is_the_integrated_one():
    currents = np.array(CURRENTS_A)
    printed = [a + b * currents for a, b in LI_LI_GENERALISED.values()]
    stiffness, damping = loops(*(row[None, :] for row in printed))
    expected = (
        [30.05, 50.00, 67.74, 87.48],
        [31.41, 51.16, 68.67, 88.14],
        [32.94, 53.00, 70.68, 90.05],
    )
    np.testing.assert_allclose(stiffness, expected, atol=0.006)
    np.testing.assert_allclose(damping[0], [0.168, 0.234, 0.188, 0.141], atol=6e-4)


def test_refits_do_not_get_worse_with_more_parameters():
    def misfit(*form):
        fit = refit(*form)
        return fit.stiffness**2 + fit.damping**2

    free, linear, quadratic = (misfit(degree) for degree in (3, 1, 2))
    assert free <= quadratic * 1.001 and quadratic <= linear
    assert misfit(2, True) < misfit(1, True) < linear / 10


def test_decay_rate_is_of_the_steady_cycle():
    device, omega, amplitude = law("strain_stiffening"), 8 * np.pi, 8e-3
    _, _, c1, _, alpha = (float(p) for p in device.parameters_at(0.0))
    _, zeta = steady_response(alpha * amplitude**2 / (c1 * omega), 40)
    expected = 3 * alpha * (amplitude * np.max(np.abs(zeta))) ** 2 / c1
    assert expected == pytest.approx(16.58, abs=0.01)
    assert decay_rate(device, amplitude, 0.0, 4.0) == pytest.approx(expected, rel=1e-4)
    # from rest the state is larger at first
    start = sinusoidal(device, [amplitude], 0.0, 4.0, 1).states[:, 1]
    assert np.max(3 * alpha * start**2 / c1) == pytest.approx(17.76, abs=0.01)
