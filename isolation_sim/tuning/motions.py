"""The motions for tuning or evaluation, by their source."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeAlias

from ground_motions import STANDARD_GRAVITY, Record, motion_mixture, read_folder

from ..errors import InputError
from ..scenario.job import Job

MIXTURE = "mixture"
SCENARIO = "scenario"
COUNT = 32
"""Default number of motions of a mixture."""

_ACCEPTED = (
    f"{MIXTURE}, {MIXTURE}:COUNT, {SCENARIO}, a folder of ground motions, a record, or records"
)

Motions: TypeAlias = Annotated[str | Path | Record | Sequence[Record | Sequence[Record]], _ACCEPTED]
"""``"mixture"`` or ``"mixture:40"``, ``"scenario"``, a folder, a record, or records."""


@dataclass(frozen=True)
class MotionSet:
    """Ground motions under one name."""

    name: str  # Source
    records: tuple[tuple[Record, ...], ...]  # One record per direction, for every motion

    @property
    def names(self) -> list[str]:
        """Name of each motion."""
        return [", ".join(record.name for record in each) for each in self.records]

    @property
    def digest(self) -> str:
        """SHA-256 of all samples; only equal motions have equal digests."""
        digest = hashlib.sha256()
        for record in (record for each in self.records for record in each):
            digest.update(f"{record.dt!r} {len(record)} ".encode())
            digest.update(record.acceleration.tobytes())
        return digest.hexdigest()


def motion_set(motions: Motions, job: Job, seed: int = 0, pga_g: float | None = None) -> MotionSet:
    """Prepare motions for the plant of a scenario."""
    n = len(job.isolated.structure.directions)
    if isinstance(motions, str | Path):
        kind, colon, count = str(motions).partition(":")
        if kind == MIXTURE and (count.isdigit() and int(count) > 0 if colon else True):
            drawn = motion_mixture(int(count or COUNT) * n, seed)
            name = f"mixture of {len(drawn) // n} motions, seed {seed}"
            return MotionSet(name, tuple(zip(*(iter(drawn),) * n, strict=True)))
        if str(motions) == SCENARIO:
            return MotionSet("the scenario's motion", (job.records,))
        if not Path(motions).is_dir():
            raise InputError("motions", str(motions), _ACCEPTED)
        records = tuple(one for record in read_folder(motions) for one in record.components)
        if pga_g is not None:
            records = tuple(record.scaled_to_pga(pga_g * STANDARD_GRAVITY) for record in records)
        name = Path(motions).name
        each: tuple[tuple[Record, ...], ...] = tuple((record,) for record in records)
    else:
        several = [motions] if isinstance(motions, Record) else motions
        each = tuple((one,) if isinstance(one, Record) else tuple(one) for one in several)
        name = f"{len(each)} record{'s' * (len(each) != 1)}"
    if not each:
        raise InputError("motions", "none", _ACCEPTED)
    for records in each:
        if len(records) != n:
            raise InputError(
                f"motions, {records[0].name}", f"{len(records)} directions",
                f"{n}, one record per direction of {job.isolated.structure.name}",
            )  # fmt: skip
    return MotionSet(name, each)
