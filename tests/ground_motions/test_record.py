import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.integrate import quad

from ground_motions import STANDARD_GRAVITY, Record, el_centro_1940

motions = arrays(np.float64, st.integers(2, 40), elements=st.floats(-20, 20, allow_subnormal=False))


def sine(frequency_hz: float = 1.0, duration: float = 4.0, dt: float = 0.001) -> Record:
    time = np.arange(round(duration / dt) + 1) * dt
    return Record(np.sin(2 * np.pi * frequency_hz * time), dt, name="sine")


def test_time_and_duration():
    record = Record([0.0, 1.0, 0.0], 0.5)
    assert record.time.tolist() == [0.0, 0.5, 1.0]
    assert (record.duration, len(record)) == (1.0, 3)


def test_integrals_of_a_triangle_are_exact():
    record = Record([0.0, 2.0, 0.0], 1.0)
    assert record.velocity.tolist() == [0.0, 1.0, 2.0]
    np.testing.assert_allclose(record.displacement, [0.0, 1 / 3, 2.0], rtol=1e-15)


@given(motions)
@settings(deadline=None)
def test_integrals_agree_with_quadrature_within_samples(acceleration):
    record = Record(acceleration, 0.1)
    fine = record.resampled(0.1 / 64)
    # Trapezoids on the velocity of a 64 times finer, identical motion.
    coarse_sum = np.cumsum((fine.velocity[:-1] + fine.velocity[1:]) / 2 * fine.dt)
    np.testing.assert_allclose(fine.velocity[::64], record.velocity, rtol=0, atol=1e-10)
    np.testing.assert_allclose(record.displacement[1:], coarse_sum[63::64], rtol=0, atol=1e-3)


@given(motions)
@settings(deadline=None)
def test_peaks_between_samples_are_those_of_a_finer_copy(acceleration):
    record = Record(acceleration, 0.1)
    fine = record.resampled(0.1 / 128)
    for peak, history in ((record.pgv, fine.velocity), (record.pgd, fine.displacement)):
        sampled = np.max(np.abs(history))
        assert peak >= sampled - 1e-10
        assert peak == pytest.approx(sampled, rel=1e-3, abs=2e-5)


def test_pgv_where_no_sample_holds_the_peak():
    record = Record([1.0, -3.0], 1.0)  # crosses zero at a quarter of the step
    assert record.pgv == pytest.approx(1.0, rel=1e-15)  # the end, -1, beats the turn, 1/8
    assert Record([3.0, -3.0], 1.0).pgv == pytest.approx(0.75, rel=1e-15)


def test_pgd_turns_within_a_step():
    # v = 3 s - 4.5 s^2 is zero at s = 2/3, where d = 1.5 s^2 - 1.5 s^3 = 2/9; at the end d = 0.
    assert Record([3.0, -6.0], 1.0).pgd == pytest.approx(2 / 9, rel=1e-14)


def test_arias_intensity_of_a_sine():
    # The integral of sin^2 over whole periods is half the duration.
    expected = math.pi / (2 * STANDARD_GRAVITY) * 2.0
    assert sine().arias_intensity() == pytest.approx(expected, rel=1e-5)


def test_arias_intensity_of_a_line_is_exact():
    assert Record([0.0, 3.0], 2.0).arias_intensity() == pytest.approx(
        math.pi / (2 * STANDARD_GRAVITY) * quad(lambda t: (1.5 * t) ** 2, 0, 2)[0], rel=1e-14
    )


def test_significant_duration_of_constant_acceleration():
    record = Record(np.ones(101), 0.1)
    assert record.significant_duration() == pytest.approx(9.0, rel=1e-12)
    assert record.significant_duration(0.25, 0.75) == pytest.approx(5.0, rel=1e-12)


def test_scalings_hit_their_targets():
    record = el_centro_1940()
    assert record.scaled_to_pga(4.0).pga == 4.0
    assert record.scaled(-2.0).acceleration.tolist() == (-2.0 * record.acceleration).tolist()
    scaled = record.scaled_to_sa(5.0, period=1.5, damping=0.02)
    assert scaled.spectrum([1.5], 0.02).psa[0] == pytest.approx(5.0, rel=1e-13)
    assert record.scaled_to_sa(4.0, period=0.0).pga == pytest.approx(4.0, rel=1e-14)


def test_padding_and_cutting_undo_each_other():
    record = el_centro_1940()
    padded = record.padded(before=1.0, after=2.001)
    assert len(padded) == len(record) + 50 + 101
    assert not padded.acceleration[:50].any()
    assert not padded.acceleration[-101:].any()
    back = padded.cut(1.0, 1.0 + record.duration)
    assert np.array_equal(back.acceleration, record.acceleration)


def test_cut_keeps_the_samples_at_both_times():
    record = Record(np.arange(11.0), 0.1)
    assert record.cut(0.3, 0.6).acceleration.tolist() == [3.0, 4.0, 5.0, 6.0]
    assert record.cut(0.8).acceleration.tolist() == [8.0, 9.0, 10.0]


def test_nothing_can_be_changed():
    record = Record([0.0, 1.0, 2.0], 0.1)
    for array in (record.acceleration, record.velocity, record.displacement):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    with pytest.raises(AttributeError):
        record.dt = 0.2


def test_the_array_is_copied():
    samples = np.ones(3)
    record = Record(samples, 0.1)
    samples[:] = 7.0
    assert record.acceleration.tolist() == [1.0, 1.0, 1.0]


def test_equality_and_hash_go_by_content():
    record = Record([0.0, 1.0], 0.1, name="a")
    assert record == Record([0.0, 1.0], 0.1, name="a")
    assert hash(record) == hash(Record([0.0, 1.0], 0.1, name="a"))
    for other in (
        Record([0.0, 2.0], 0.1, name="a"),
        Record([0.0, 1.0], 0.2, name="a"),
        Record([0.0, 1.0], 0.1, name="b"),
        "a",
    ):
        assert record != other


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda r: pickle.loads(pickle.dumps(r))])
def test_copies_are_equal_and_still_read_only(copied):
    record = el_centro_1940()
    other = copied(record)
    assert other == record
    assert not other.acceleration.flags.writeable


def test_repr_is_one_short_line():
    text = repr(el_centro_1940())
    assert "1560 points" in text
    assert len(text) < 250
    assert "\n" not in text


def test_source_tells_what_was_done():
    record = Record([0.0, 1.0, 0.0], 0.1, source="made up").scaled(2.0).padded(after=0.1)
    assert record.source == "made up; scaled by 2; padded by 0 s and 0.1 s"


@pytest.mark.parametrize(
    ("acceleration", "dt", "parts"),
    [
        ([1.0], 0.1, ("acceleration", "shape (1,)", "two or more")),
        ([[1.0, 2.0], [3.0, 4.0]], 0.1, ("shape (2, 2)", "one row")),
        ([1.0, math.nan], 0.1, ("nan at sample 1", "finite")),
        ([math.inf, 1.0], 0.1, ("inf at sample 0", "finite")),
        (["a", "b"], 0.1, ("acceleration: given ['a', 'b']", "an array of numbers")),
        ([[1.0], [1.0, 2.0]], 0.1, ("acceleration: given [[", "an array of numbers")),
        ([0.0, 1.0], 0.0, ("dt (s)", "given 0.0", "above 0")),
        ([0.0, 1.0], math.nan, ("dt (s)", "given nan", "above 0")),
        ([0.0, 1.0], "x", ("dt: given 'x'", "expected: a number")),
    ],
)
def test_bad_records_are_refused(refused, acceleration, dt, parts):
    with refused(*parts):
        Record(acceleration, dt)


@pytest.mark.parametrize(
    ("call", "parts"),
    [
        (lambda r: r.scaled(math.inf), ("factor", "inf", "finite")),
        (lambda r: r.scaled_to_pga(-1.0), ("pga (m/s2)", "-1.0", "above 0")),
        (lambda r: r.scaled_to_sa(0.0, 1.0), ("sa (m/s2)", "0.0", "above 0")),
        (lambda r: r.scaled_to_sa(1.0, -1.0), ("periods (s)", "-1", "0, or")),
        (lambda r: r.padded(before=-1.0), ("before (s)", "-1.0", "0 or above")),
        (lambda r: r.padded(after=math.nan), ("after (s)", "nan", "0 or above")),
        (lambda r: r.cut(2.0, 1.0), ("start and stop", "2 and 1", "start < stop")),
        (lambda r: r.cut(0.0, 99.0), ("stop (s)", "99.0", "from 0 to 31.18")),
        (lambda r: r.significant_duration(0.9, 0.1), ("low and high", "0.9 and 0.1", "low < high")),
        (lambda r: r.significant_duration(high=1.1), ("high (share)", "1.1", "from 0 to 1")),
        (lambda r: r.significant_duration(-0.1), ("low (share)", "-0.1", "from 0 to 1")),
        (lambda r: r.scaled(0.0).scaled_to_pga(1.0), ("scaled_to_pga", "zero throughout")),
        (lambda r: r.scaled(0.0).scaled_to_sa(1.0, 1.0), ("scaled_to_sa", "zero throughout")),
        (lambda r: r.scaled(0.0).significant_duration(), ("significant_duration", "zero")),
    ],
)
def test_bad_arguments_are_refused(refused, call, parts):
    with refused(*parts):
        call(el_centro_1940())
