"""Outputs over their largest acceptable values."""

import numpy as np
import pytest

from controllers.clipped_lqr import ClippedLQR
from controllers.lyapunov import Lyapunov
from isolation_sim.structures import shear_building


@pytest.mark.parametrize("kind", [ClippedLQR, Lyapunov])
def test_outputs_are_divided_by_what_is_acceptable(kind):
    one = kind(
        largest_displacement=0.1, largest_velocity=0.5, largest_drift=0.02, largest_acceleration=2.0
    )
    storey = shear_building([10.0], [4000.0], base_mass=20.0)
    rows = np.array([[1.0, 0.0]])
    outputs = one.weighted_outputs(storey, rows)
    x, v = np.array([0.03, 0.05]), np.array([0.2, 0.1])
    # base, its velocity, drift, then the accelerations of two masses joined by a spring
    damping = storey.damping @ v / [20.0, 10.0]
    spring = 4000.0 * 0.02 / np.array([20.0, -10.0])
    expected = [0.03 / 0.1, 0.2 / 0.5, 0.02 / 0.02, *((spring - damping) / 2.0)]
    assert outputs @ [*x, *v] == pytest.approx(expected)


def test_what_is_acceptable_without_end_has_no_weight():
    storey = shear_building([10.0], [4000.0], base_mass=20.0)
    outputs = ClippedLQR(largest_drift=np.inf, largest_velocity=np.inf).weighted_outputs(
        storey, np.array([[1.0, 0.0]])
    )
    assert np.array_equal(np.any(outputs, axis=1), [True, False, False, True, True])
