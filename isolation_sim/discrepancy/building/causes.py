"""Causes that the model of an isolated building may lack."""

from __future__ import annotations

from collections.abc import Sequence

from .candidate import Candidate
from .isolator_causes import current_causes, layer_causes
from .model import BuildingModel
from .record import BuildingRecord
from .sensor_causes import sensor_causes
from .structure_causes import structure_causes


def candidates(model: BuildingModel, records: Sequence[BuildingRecord]) -> tuple[Candidate, ...]:
    """All candidate causes for the records of a building."""
    return (
        *structure_causes(model, records), *layer_causes(model, records),
        *current_causes(model, records), *sensor_causes(records),
    )  # fmt: skip
