"""Noise of half as many draws: to simulate them takes long."""

from collections.abc import Iterator

import pytest

from isolation_sim.discrepancy.building import noise

DRAWS = noise._DRAWS
"""Of a diagnosis."""


@pytest.fixture(scope="module", autouse=True)
def few_draws() -> Iterator[None]:
    """Half of the draws to estimate the noise."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(noise, "_DRAWS", DRAWS // 2)
        yield


@pytest.fixture
def all_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many as in a diagnosis, where a test looks at the noise closely."""
    monkeypatch.setattr(noise, "_DRAWS", DRAWS)
