"""Ground motions shorter than those of the study."""

from functools import partial

import pytest

from studies.blind import buildings


@pytest.fixture
def short_motion(monkeypatch):
    """Building records of 12 s in place of 25 s."""
    short = partial(buildings.ground_motion, duration=12.0)
    monkeypatch.setattr(buildings, "ground_motion", short)
