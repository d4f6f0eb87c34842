"""Li & Li: stiffness and damping ratio of the published models, integrated (ERRATA's tables)."""

from __future__ import annotations

import numpy as np
import pytest

from isolation_sim.identification.sinusoidal import sinusoidal
from isolation_sim.laws import law
from studies.papers.paper_000 import CYCLES, STEADY_CYCLES, generalised

STIFFNESS = {  # N/mm at 0, 1, 2, 3 A
    2: (30.05, 50.00, 67.74, 87.48),
    4: (31.41, 51.16, 68.67, 88.14),
    8: (32.94, 53.00, 70.68, 90.05),
}
DAMPING_RATIO = {
    2: (0.168, 0.234, 0.188, 0.141),
    4: (0.165, 0.231, 0.187, 0.140),
    8: (0.184, 0.236, 0.189, 0.141),
}
# section 4.1, base set: K in N/mm, damping ratio
BASE_MODEL = {2: (7.314, 0.203), 4: (13.09, 0.132), 8: (27.97, 0.165)}


@pytest.mark.parametrize("row", [0, 1, 2])
@pytest.mark.parametrize("current", [0, 1, 2, 3])
def test_generalised_model(row, current):
    m = generalised().measured(row, current, skip=STEADY_CYCLES)
    amplitude = (2, 4, 8)[row]
    stiffness = 1e3 * STIFFNESS[amplitude][current]
    assert m.effective_stiffness.value == pytest.approx(stiffness, rel=5e-3)
    # printed to three digits: half a unit of the last is 0.36 % of the smallest
    ratio = DAMPING_RATIO[amplitude][current]
    assert m.damping_ratio.value == pytest.approx(ratio, rel=5e-3)


@pytest.mark.parametrize("amplitude", [2, 4, 8])
def test_base_model(amplitude):
    base = law("strain_stiffening", "base_model")
    m = sinusoidal(base, [1e-3 * amplitude], cycles=CYCLES).measured(0, skip=STEADY_CYCLES)
    stiffness, ratio = BASE_MODEL[amplitude]
    assert m.effective_stiffness.value == pytest.approx(1e3 * stiffness, rel=5e-3)
    assert m.damping_ratio.value == pytest.approx(ratio, rel=5e-3)


@pytest.mark.parametrize("amplitude", [2, 4, 8])
def test_kelvin_voigt_base_set(amplitude):
    device = law("kelvin_voigt", {"k": 200.0, "c": 2000.0})
    m = sinusoidal(device, [1e-3 * amplitude]).measured(0)
    assert m.effective_stiffness.value == pytest.approx(200.0, rel=5e-3)
    assert m.damping_ratio.value == pytest.approx(31.4, rel=5e-3)


def test_standard_solid_is_the_law_without_stiffening():
    device = law("strain_stiffening", "base_model").with_parameters(alpha=0.0)
    m = sinusoidal(device, [4e-3], cycles=CYCLES).measured(0, skip=STEADY_CYCLES)
    assert m.effective_stiffness.value == pytest.approx(5318.0, rel=1e-3)
    assert m.damping_ratio.value == pytest.approx(0.276, rel=5e-3)
    k0, k1, c0, omega = 200.0, 7000.0, 2000.0, 2 * np.pi
    modulus = k1 * (k0 + 1j * omega * c0) / (k0 + k1 + 1j * omega * c0)
    assert m.storage_stiffness.value == pytest.approx(modulus.real, rel=1e-6)
    assert m.loss_stiffness.value == pytest.approx(modulus.imag, rel=1e-6)
