import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import TransferFunction, welch

from ground_motions import (
    SOILS,
    Soil,
    Trapezoid,
    clough_penzien_motion,
    clough_penzien_psd,
    kanai_tajimi_motion,
    kanai_tajimi_psd,
)

CASES = [(kanai_tajimi_motion, kanai_tajimi_psd), (clough_penzien_motion, clough_penzien_psd)]


@pytest.mark.parametrize("soil", SOILS.values(), ids=SOILS)
def test_spectra_are_those_of_the_filters(soil):
    """The densities are the squared transfer functions of the oscillators that define them."""
    frequency = np.geomspace(0.01, 30.0, 200)
    wg, zg, wf, zf = (
        soil.ground_frequency,
        soil.ground_damping,
        soil.low_frequency,
        soil.low_damping,
    )
    ground = TransferFunction([2 * zg * wg, wg**2], [1, 2 * zg * wg, wg**2])
    second = TransferFunction([1, 0, 0], [1, 2 * zf * wf, wf**2])
    w = 2 * np.pi * frequency
    ground_gain = np.abs(ground.freqresp(w)[1]) ** 2
    low_gain = np.abs(second.freqresp(w)[1]) ** 2
    np.testing.assert_allclose(kanai_tajimi_psd(frequency, soil, 2.0), 2 * ground_gain, rtol=1e-10)
    np.testing.assert_allclose(
        clough_penzien_psd(frequency, soil, 2.0), 2 * ground_gain * low_gain, rtol=1e-10
    )


@pytest.mark.parametrize("soil", SOILS.values(), ids=SOILS)
def test_kanai_tajimi_variance(soil):
    # Classical: variance = pi S0 wg (1 + 4 z^2) / (2 z), S0 two-sided over circular frequency.
    z, s0 = soil.ground_damping, 1.0 / (4 * math.pi)
    expected = math.pi * s0 * soil.ground_frequency * (1 + 4 * z**2) / (2 * z)
    low = quad(lambda f: kanai_tajimi_psd(f, soil), 0, 20, limit=300)[0]
    high = quad(lambda f: kanai_tajimi_psd(f, soil), 20, np.inf, limit=300)[0]
    assert low + high == pytest.approx(expected, rel=1e-7)


def test_soils_are_the_published_ones():
    """Der Kiureghian and Neuenhofer (1992): ground rad/s and damping, second filter's."""
    assert dict(SOILS) == {
        "firm": Soil(15.0, 0.6, 1.5, 0.6),
        "medium": Soil(10.0, 0.4, 1.0, 0.6),
        "soft": Soil(5.0, 0.2, 0.5, 0.6),
    }


def test_limits_at_zero_frequency():
    assert kanai_tajimi_psd(0.0, SOILS["firm"], 3.0) == 3.0
    assert clough_penzien_psd(0.0, SOILS["firm"], 3.0) == 0.0


@pytest.mark.parametrize(("motion", "psd"), CASES, ids=["kanai_tajimi", "clough_penzien"])
@pytest.mark.parametrize("soil", SOILS)
def test_density_over_seeds_is_the_target(motion, psd, soil):
    densities = []
    for seed in range(30):
        record = motion(soil, 60.0, 0.02, seed=seed, intensity=0.01, envelope=None)
        frequency, density = welch(record.acceleration, 50.0, nperseg=1024, detrend=False)
        densities.append(density)
    band = (frequency > 0.3) & (frequency < 20.0)
    measured = np.mean(densities, axis=0)[band]
    expected = psd(frequency[band], SOILS[soil], 0.01)
    np.testing.assert_allclose(measured, expected, rtol=0.2)
    assert np.mean(measured / expected) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(("motion", "psd"), CASES, ids=["kanai_tajimi", "clough_penzien"])
def test_one_stationary_motion_has_the_target_variance(motion, psd):
    record = motion("medium", 100.0, 0.01, seed=3, intensity=0.02, envelope=None)
    expected = quad(lambda f: psd(f, SOILS["medium"], 0.02), 0, 50, limit=500)[0]
    assert np.mean(record.acceleration**2) == pytest.approx(expected, rel=0.01)


def test_the_envelope_multiplies_the_stationary_motion():
    envelope = Trapezoid(2.0, 8.0, 10.0)
    plain = kanai_tajimi_motion("soft", 10.0, seed=1, intensity=0.1, envelope=None)
    refined = kanai_tajimi_motion("soft", 10.0, seed=1, intensity=0.1, envelope=envelope)
    np.testing.assert_allclose(
        refined.acceleration, plain.acceleration * envelope(plain.time), rtol=1e-14
    )


@pytest.mark.parametrize("motion", [kanai_tajimi_motion, clough_penzien_motion])
def test_pga_seed_and_source(motion):
    record = motion("firm", 20.0, seed=11, pga=3.5)
    assert record.pga == pytest.approx(3.5, rel=1e-15)
    assert motion("firm", 20.0, seed=11, pga=3.5) == record
    assert motion("firm", 20.0, seed=12, pga=3.5) != record
    for part in (motion.__name__, "soil='firm'", "seed=11", "pga=3.5", "AminAng(rise_end=4.0"):
        assert part in record.source


def test_clough_penzien_moves_less_at_low_frequency():
    drift = [m("firm", 30.0, seed=2, intensity=0.01).pgd for m, _ in CASES]
    assert drift[1] < 0.7 * drift[0]


def test_a_soil_of_ones_own():
    own = Soil(12.0, 0.5, 1.2, 0.6)
    record = clough_penzien_motion(own, 20.0, seed=1, pga=1.0)
    assert record.name == "clough_penzien_own_soil_seed_1"
    assert repr(own) in record.source


@pytest.mark.parametrize(
    ("changed", "parts"),
    [
        ({"soil": "sfot"}, ("soil", "'sfot'", "did you mean 'soft'? expected: firm, medium, soft")),
        ({"soil": 3}, ("soil: given 3", "text or a Soil")),
        ({"duration": -1.0}, ("duration (s)", "-1.0", "above 0")),
        ({"dt": 0.0}, ("dt (s)", "0.0", "above 0")),
        ({"pga": None}, ("pga and intensity", "neither", "exactly one")),
        ({"intensity": 1.0}, ("pga and intensity", "given pga and intensity", "exactly one")),
        ({"pga": 0.0}, ("pga", "0.0", "above 0")),
        ({"seed": -3}, ("seed", "-3", "whole number")),
        ({"envelope": lambda t: 0 * t}, ("duration and envelope", "10 s", "not all zero")),
    ],
)
@pytest.mark.parametrize("motion", [kanai_tajimi_motion, clough_penzien_motion])
def test_bad_arguments_are_refused(refused, motion, changed, parts):
    arguments = {"soil": "firm", "duration": 10.0, "dt": 0.01, "pga": 1.0, "seed": 0}
    with refused(*parts):
        motion(**(arguments | changed))


def test_a_bad_soil_is_refused(refused):
    with refused("ground_damping", "-0.1", "above 0"):
        Soil(15.0, -0.1, 1.5, 0.6)
