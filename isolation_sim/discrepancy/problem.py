"""The contract between the pipeline of a diagnosis and one kind of data."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Generic, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..laws import Device
from .diagnosis import Cause, Errors, Trace
from .planned_tests import TestPlan
from .residuals import Dependence
from .search import H, Round, SearchResult


class Text(NamedTuple):
    """Sentences of a report step, with a table if there is one."""

    text: str
    headings: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()


@dataclass(frozen=True, eq=False)
class Evaluation:
    """How well the nominal and the final model follow the data."""

    # before, after: Relative errors of the nominal and of the final model
    before: Errors
    after: Errors
    noise: Errors  # Errors that noise alone leaves
    # Share of the misfit above the noise that the causes leave, from 0; unbounded above
    unexplained: float
    adequate: bool  # Whether the nominal model misses the data by no more than noise
    explained: bool  # Whether the remainder is small enough for the verdict "explained"
    # (n_blocks, 2): Squared residual before and after in blocks of the validation data, for the
    # gain
    blocks: NDArray = field(default_factory=lambda: np.empty((0, 2)))
    details: dict[str, Any] = field(default_factory=dict)  # Further plain numbers for the JSON


class Problem(ABC, Generic[H]):
    """One kind of data against one nominal model."""

    # The pipeline calls the methods in the order in which they stand here.

    data_name: str
    model_name: str
    seed: int = 0
    # Whether its dependences predict data that they were not found on
    predicts_residual: ClassVar[bool] = False

    @abstractmethod
    def nominal(self) -> H:
        """Fit the model without causes, and estimate the noise."""

    @abstractmethod
    def search(self, base: H) -> SearchResult[H]:
        """Search for causes."""

    @abstractmethod
    def dependences(self, base: H) -> list[Dependence]:
        """Analyse the dependence of the nominal model's residual."""

    @abstractmethod
    def evaluate(self, result: SearchResult[H]) -> Evaluation:
        """Compare both models with all of the data."""

    @abstractmethod
    def causes(self, result: SearchResult[H], evaluation: Evaluation) -> list[Cause]:
        """Infer share, chance, numbers and rivals of each cause."""

    @abstractmethod
    def depends_on(
        self, dependences: Sequence[Dependence], causes: Sequence[Cause], evaluation: Evaluation
    ) -> tuple[str, ...]:
        """Name the variables on which the nominal model's residual depends."""

    def test_plan(self, result: SearchResult[H], causes: Sequence[Cause]) -> TestPlan | None:
        """Plan the next tests; None for data other than device tests."""
        return None

    def next_test(self, result: SearchResult[H], causes: Sequence[Cause]) -> str | None:
        """Propose the test that would best tell rival causes apart."""
        return None

    @abstractmethod
    def devices(self, result: SearchResult[H]) -> tuple[Device | None, Device | None]:
        """Return the nominal device, and the one with the causes in it."""

    @abstractmethod
    def traces(self, result: SearchResult[H]) -> tuple[Trace, ...]:
        """Return the data as measured and as simulated, to draw."""

    @property
    def data_notes(self) -> tuple[str, ...]:
        """Return suspicious features of the data."""
        return ()

    @abstractmethod
    def data_text(self) -> Text:
        """Describe the data."""

    @abstractmethod
    def noise_text(self) -> Text:
        """Describe the noise."""

    def choice_text(self) -> Text | None:
        """Describe how the model was chosen among others; None if it was given."""
        return None

    @abstractmethod
    def model_text(self, evaluation: Evaluation) -> Text:
        """Describe how well the nominal model follows the data."""

    @abstractmethod
    def trials_text(self, tried: Round[H]) -> Text:
        """Describe the candidates of a round, the best first."""

    def outcome_text(
        self, result: SearchResult[H], evaluation: Evaluation, causes: Sequence[Cause]
    ) -> Text:
        """Add to the verdict the statements that this kind of data supports."""
        return Text("")
