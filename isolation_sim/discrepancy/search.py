"""The search for causes: add the best one as long as the data ask for another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar


class Hypothesis(Protocol):
    """A fitted model with some causes in it; the last one was added last."""

    @property
    def causes(self) -> tuple[str, ...]:
        """Names of its causes."""
        ...


H = TypeVar("H", bound=Hypothesis)


class SearchSpace(Protocol[H]):
    """Interface of a search to one kind of data."""

    @property
    def most_causes(self) -> int:
        """Number of causes at which the search stops."""
        ...

    def is_explained(self, current: H) -> bool:
        """Whether nothing is left that causes would explain."""
        ...

    def candidates(self, current: H) -> list[H]:
        """Fit models with one more cause each, the best first."""
        ...

    def choose(self, current: H, tried: Sequence[H]) -> H | None:
        """Select the model to go on with; None if the data ask for no further cause."""
        ...

    def revise(self, taken: H) -> H:
        """Exchange or drop earlier causes now that one more is known."""
        ...

    def finish(self, best: H) -> H:
        """Check the causes together after the last one was added."""
        ...


@dataclass(frozen=True, eq=False)
class Round(Generic[H]):
    """One round of a search."""

    base: H  # Model before the round
    tried: list[H]  # Models with one more cause, the best first
    taken: H | None  # Model that was chosen


@dataclass(frozen=True, eq=False)
class SearchResult(Generic[H]):
    """Outcome of a search."""

    # base, best: Nominal model, and the model with the causes found
    base: H
    best: H
    rounds: list[Round[H]]  # In the order in which they were made


def search(space: SearchSpace[H], base: H) -> SearchResult[H]:
    """Add causes one by one."""
    current, rounds = base, []
    while len(current.causes) < space.most_causes and not space.is_explained(current):
        tried = space.candidates(current)
        taken = space.choose(current, tried)
        rounds.append(Round(current, tried, taken))
        if taken is None:
            break
        current = space.revise(taken)
    return SearchResult(base, space.finish(current), rounds)
