"""Noise of half as many draws: to simulate them takes half of a diagnosis."""

from collections.abc import Iterator

import pytest

from isolation_sim.discrepancy.building import noise


@pytest.fixture(scope="module", autouse=True)
def few_draws() -> Iterator[None]:
    """Sixteen draws in place of 32, to estimate the noise and as many to compare with."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(noise, "_DRAWS", 16)
        yield


@pytest.fixture
def all_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many as in a diagnosis, where a test looks at the noise closely."""
    monkeypatch.setattr(noise, "_DRAWS", 32)
