import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground_motions import JENNINGS_HOUSNER_A, JENNINGS_HOUSNER_B, AminAng, SaragoniHart, Trapezoid

TIME = np.linspace(0.0, 60.0, 6001)


@pytest.mark.parametrize(
    "envelope",
    [JENNINGS_HOUSNER_A, JENNINGS_HOUSNER_B, Trapezoid(3.0, 12.0, 40.0), SaragoniHart(30.0)],
)
def test_envelopes_rise_from_zero_to_one_and_decay(envelope):
    values = envelope(TIME)
    assert values[0] == 0.0
    assert np.max(values) == pytest.approx(1.0, rel=1e-5)
    peak = np.argmax(values)
    assert np.all(np.diff(values[: peak + 1]) >= 0.0)
    assert np.all(np.diff(values[peak:]) <= 1e-12)
    assert values[-1] < 0.42


def test_amin_ang_parts():
    envelope = AminAng(rise_end=2.0, decay_start=5.0, decay_rate=0.3)
    values = envelope(np.array([1.0, 2.0, 3.5, 5.0, 7.0]))
    np.testing.assert_allclose(values, [0.25, 1.0, 1.0, 1.0, math.exp(-0.6)], rtol=1e-14)


def test_jennings_housner_types_are_the_published_ones():
    assert AminAng(4.0, 35.0, 0.0357) == JENNINGS_HOUSNER_A
    assert AminAng(4.0, 15.0, 0.0992) == JENNINGS_HOUSNER_B


def test_jennings_housner_type_a_meets_its_last_part():
    # The published decay meets a final parabola at 80 s: 0.05 + 0.0000938 (120 - t)^2.
    assert JENNINGS_HOUSNER_A(np.array([80.0]))[0] == pytest.approx(0.05 + 9.38e-5 * 1600, rel=5e-3)


def test_trapezoid_parts():
    envelope = Trapezoid(2.0, 5.0, 9.0)
    values = envelope(np.array([0.0, 1.0, 2.0, 5.0, 7.0, 9.0, 20.0]))
    np.testing.assert_allclose(values, [0.0, 0.5, 1.0, 1.0, 0.5, 0.0, 0.0], atol=1e-15)


@given(st.floats(5.0, 60.0), st.floats(0.05, 0.8), st.floats(0.001, 0.9))
@settings(deadline=None)
def test_saragoni_hart_peaks_and_ends_at_its_settings(end, share, final):
    envelope = SaragoniHart(end, share, final)
    peak, last = envelope(np.array([share * end, end]))
    assert peak == pytest.approx(1.0, rel=1e-12)
    assert last == pytest.approx(final, rel=1e-9)
    around = envelope(np.array([0.9, 1.1]) * share * end)
    assert np.all(around < 1.0)


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (lambda: Trapezoid(0.0, 5.0, 9.0), ("rise_end (s)", "0.0", "above 0")),
        (lambda: Trapezoid(2.0, 1.0, 9.0), ("2 and 1 and 9", "rise_end <= decay_start <= end")),
        (lambda: AminAng(3.0, math.nan, 0.1), ("decay_start (s)", "nan", "finite")),
        (lambda: AminAng(3.0, 2.0, 0.1), ("3 and 2", "rise_end <= decay_start")),
        (lambda: AminAng(3.0, 4.0, -0.1), ("decay_rate (1/s)", "-0.1", "above 0")),
        (lambda: SaragoniHart(-1.0), ("end (s)", "-1.0", "above 0")),
        (lambda: SaragoniHart(10.0, 1.0), ("peak_share", "1.0", "below 1")),
        (lambda: SaragoniHart(10.0, 0.2, 0.0), ("final", "0.0", "above 0")),
    ],
)
def test_bad_envelopes_are_refused(refused, make, parts):
    with refused(*parts):
        make()
