"""Records of instrumented buildings of the US Geological Survey, a channel per file (SMC)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ground_motions.readers.smc import read_channel

from .channels import heading_of
from .raw_table import RawTable, filter_note, table_of_columns

_UNITS = {"acceleration": "cm/s2", "displacement": "cm"}


def read_smc(path: Path) -> list[RawTable]:
    """Accelerations or displacements of a sensor."""
    channel = read_channel(path, displacements=True)
    azimuth = f"{channel.direction} deg" if channel.direction.isdigit() else channel.direction
    words = f"{channel.quantity} {azimuth} {channel.location}".strip()
    heading = heading_of(f"{words} [{_UNITS[channel.quantity]}]")
    notes = [] if channel.is_corrected else ["uncorrected accelerations"]
    if channel.corners is not None:
        notes.append(filter_note([channel.corners]))
    return [table_of_columns(
        path, "", [heading], [np.array(channel.samples)], notes, rate=channel.rate,
        filtered=channel.corners,
    )]  # fmt: skip
