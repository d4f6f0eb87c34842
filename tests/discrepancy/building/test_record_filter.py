"""Filters that records passed, and their inverse."""

import numpy as np
import pytest
from scipy.signal import butter, sosfilt, sosfiltfilt

from isolation_sim.discrepancy.building.record_filter import RecordFilter
from isolation_sim.identification.raw_tests.v2_file import _corners

DT, N = 0.01, 4000
TIME = DT * np.arange(N)
MOTION = np.exp(-(((TIME - 20) / 3) ** 2)) * np.sin(2 * np.pi * 0.7 * TIME) + (TIME > 20) * (
    np.exp(-(((TIME - 20) / 6) ** 2))
)


@pytest.mark.parametrize("zero_phase", [False, True])
def test_a_signal_is_filtered_as_scipy_does_and_restored(zero_phase):
    one = RecordFilter(high_pass_Hz=0.1, order=4, zero_phase=zero_phase)
    run = sosfiltfilt if zero_phase else sosfilt
    sections = butter(4, 0.1, "highpass", fs=1 / DT, output="sos")
    padded = np.pad(MOTION, 4000)
    expected = run(sections, padded)[4000:-4000]
    both = one.apply(np.column_stack([MOTION, 2 * MOTION]), DT)
    np.testing.assert_allclose(both, np.column_stack([expected, 2 * expected]), atol=2e-3)
    # what the filter left is what the restored motion leaves behind it
    again = one.apply(one.restore(both[:, 0], DT), DT)
    assert np.abs(again - expected).max() < 0.05
    assert (one.reach(DT) > 0) == zero_phase


def test_ramps_rise_and_fall():
    response = RecordFilter(high_pass_Hz=(0.1, 0.3), low_pass_Hz=(20.0, 30.0)).response(10000, DT)
    at = {f: abs(response[round(f * 100)]) for f in (0.05, 0.2, 5.0, 25.0, 40.0)}
    assert list(at.values()) == pytest.approx([0.0, 0.5, 1.0, 0.5, 0.0])


@pytest.mark.parametrize(
    ("line", "corners"),
    [
        ("Record filtered below  0.08 Hz (periods over 12.5 secs), and above 40.0 Hz",
         ((0.08,), (40.0,))),
        ("Accelerogram bandpass-filtered with ramps at .05-.10 and 23.0-25.0 Hz",
         ((0.05, 0.1), (23.0, 25.0))),
        ("ACCELEROGRAM BANDPASS FILTERED WITH RAMPS AT  .050- .100 AND 23.00-25.00 CYC/SEC",
         ((0.05, 0.1), (23.0, 25.0))),
        ("Accelerogram bandpass filtered with 3 dB pts at   .07 and 40.00 cyc/sec",
         ((0.07,), (40.0,))),
        ("filtered below 0.00 Hz", None),
        ("Instrument period .02 sec", None),
    ],
)  # fmt: skip
def test_headers_of_agencies_name_corners(line, corners):
    assert _corners(line) == corners
