"""The time grid, as properties of any record and any instants."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from isolation_sim.simulation.control import instants
from isolation_sim.simulation.grid import MOST_INTERVALS, make_grid

steps = st.sampled_from([0.02, 0.01, 0.005, 1 / 3, 0.0078125, 1.7])


@st.composite
def situations(draw):
    """Number of samples, dt, and increasing instants, well inside the record, of three kinds."""
    n, dt = draw(st.integers(2, 60)), draw(steps)
    inside = st.floats(0, (n - 1) * dt * (1 - 1e-4))
    kinds = []
    for _ in range(3):
        times = np.sort(draw(st.lists(inside, max_size=12)))
        selected = np.diff(times, prepend=-1.0) > 1e-5 * dt  # a grid merges what is closer
        kinds.append(times[selected])
    return n, dt, kinds


@given(situations())
@settings(deadline=None)
def test_segments_cover_the_record_in_powers_of_two(context):
    n, dt, kinds = context
    grid = make_grid(n, dt, *kinds)
    first, kind, count = grid.segments.T
    np.testing.assert_array_equal(first[1:], first[:-1] + count[:-1])
    assert first[0] == 0 and first[-1] == len(grid.time) - 1
    sizes = count[:-1]
    assert np.all(sizes & (sizes - 1) == 0) and np.all((sizes >= 1) & (sizes <= MOST_INTERVALS))
    np.testing.assert_array_equal(grid.intervals[kind[:-1]], sizes)
    np.testing.assert_allclose(
        np.diff(grid.time[first]), grid.spans[kind[:-1]], rtol=1e-9, atol=1e-12 * dt
    )


@given(situations())
@settings(deadline=None)
def test_intervals_of_a_segment_are_equal(context):
    n, dt, kinds = context
    grid = make_grid(n, dt, *kinds)
    for k, (first, _, count) in enumerate(grid.segments[:-1]):
        lengths = np.diff(grid.time[first : first + count + 1])
        np.testing.assert_allclose(lengths, grid.spans[grid.segments[k, 1]] / count, rtol=1e-7)


@given(situations())
@settings(deadline=None)
def test_every_instant_begins_a_segment_and_every_sample_is_a_point(context):
    n, dt, kinds = context
    grid = make_grid(n, dt, *kinds)
    np.testing.assert_allclose(grid.time[grid.samples], np.arange(n) * dt, atol=1e-9 * dt)
    assert np.all(np.diff(grid.time) > 0)
    starts = grid.time[grid.segments[:-1, 0]]
    for column, times in enumerate(kinds):
        numbers = grid.events[:, column]
        happening = np.flatnonzero(numbers >= 0)
        np.testing.assert_array_equal(numbers[happening], np.arange(len(times)))
        np.testing.assert_allclose(starts[happening], times, atol=0.51e-6 * dt)


@given(situations())
@settings(deadline=None)
def test_without_instants_segments_are_as_long_as_they_may_be(context):
    n, dt, _ = context
    grid = make_grid(n, dt)
    left = (n - 1) % MOST_INTERVALS
    assert len(grid.segments) - 1 == (n - 1) // MOST_INTERVALS + bin(left).count("1")


def test_instants_at_or_after_the_end_are_left_out():
    grid = make_grid(11, 0.1, command_times=np.array([0.0, 0.5, 1.0, 1.5]))
    assert grid.events[:, 2].max() == 1
    assert grid.time[-1] == 1.0


@given(st.floats(1e-3, 3.0), st.floats(1e-2, 40.0))
def test_decisions_fill_the_run(period, duration):
    times = instants(period, duration)
    assert times[0] == 0 and times[-1] < duration <= times[-1] + period * (1 + 1e-9)


def test_decisions_whose_last_falls_on_the_end_by_rounding():
    assert len(instants(0.1, 0.3)) == 3  # 0.3 / 0.1 is 2.9999999999999996
    assert len(instants(0.02, 31.18)) == 1559
