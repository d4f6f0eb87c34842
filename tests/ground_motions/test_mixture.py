"""Mixtures of motions, and folders of records."""

from __future__ import annotations

import numpy as np
import pytest

from ground_motions import InputError, motion_mixture
from ground_motions.mixture import DURATION


def test_a_mixture_is_drawn_by_its_seed_and_begins_alike():
    few, many = motion_mixture(6, seed=2), motion_mixture(9, seed=2)
    assert few == many[:6] and len(many) == 9
    assert all(a != b for a, b in zip(few, motion_mixture(6, seed=3), strict=True))


def test_all_motions_of_a_mixture_are_on_the_same_samples_and_end_with_rest():
    for k, record in enumerate(motion_mixture(12, seed=1)):
        assert record.dt == 0.01 and record.duration == pytest.approx(DURATION)
        assert not record.acceleration[-300:].any()
        if k % 4 == 2:
            assert abs(record.velocity[-1]) < 1e-9 * record.pgv


def test_the_kinds_have_the_amplitude_that_they_should():
    many = motion_mixture(80, seed=5)
    far, pulses, near = [*many[0::4], *many[1::4]], many[2::4], many[3::4]
    assert all(2.5 <= record.pga <= 4.0 for record in far)
    # a pulse's peak acceleration is at most a little above that of a harmonic of its amplitude
    assert all(record.pga < 1.25 * 4.0 and record.pgv < 0.81 for record in pulses)
    first = [record.velocity[np.argmax(np.abs(record.velocity))] > 0 for record in pulses]
    assert 4 < sum(first) < 16, "either sign"
    assert all(record.pga < 1.25 * 4.0 + 2.5 for record in near)
    # noise on top of a pulse: more changes of sign
    changes = [[np.sum(np.diff(np.sign(r.acceleration[:2000])) != 0) for r in kind]
               for kind in (pulses, near)]  # fmt: skip
    assert max(changes[0]) < min(changes[1])


@pytest.mark.parametrize("value", [{"count": 0}, {"count": 1.5}, {"count": 1, "seed": -1}])
def test_a_mixture_that_cannot_be_drawn_is_refused(value):
    with pytest.raises(InputError, match="expected: a whole number"):
        motion_mixture(**value)
