"""Unknown parameters against the current: bounds."""

from __future__ import annotations

import numpy as np

from isolation_sim.identification.parameterisation import Parameterisation
from isolation_sim.laws import LAWS, Device


def test_rounding_makes_no_divisor_zero():
    law = LAWS["strain_stiffening"]
    currents = np.array([0.0, 1.0, 2.0, 3.0])
    unknowns = Parameterisation(law, currents, sizes=(100.0, 4e-3, 0.16))
    n = len(currents)
    for k in range(n):  # as large as a fit may make it, but for one current
        values = np.minimum(unknowns.upper, 1e30)
        values[k::n] = unknowns.lower[k::n]
        found = unknowns.dependence(values).at(currents)
        for quantity, row in zip(law.parameters, found, strict=True):
            if quantity.divides:
                assert np.all(row > 0), (quantity.name, k)
        device = Device(law, unknowns.dependence(values), (0.0, 3.0))
        assert np.all(np.isfinite(device.parameters_at(currents)))
