"""Corrected records of instrumented buildings, of COSMOS and CSMIP (V2)."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

import numpy as np

from ground_motions.readers.lines import Corners, read_lines
from ground_motions.readers.v2 import Series, all_series, samples_of

from .channels import heading_of
from .raw_table import RawTable, filter_note, table_of_columns

_NUMBER = r"\d*\.?\d+"
_FILTERED = (
    # of COSMOS: "Record filtered below  0.08 Hz (periods over 12.5 secs), and above 40.0 Hz"
    re.compile(rf"\bfiltered below\s+({_NUMBER})\s*Hz(?:.*\band above\s+({_NUMBER})\s*Hz)?", re.I),
    # of CSMIP: "Accelerogram bandpass filtered with ramps at .05-.10 and 23.0-25.0 cyc/sec", and
    # "with 3 dB pts at   .07 and 40.00 cyc/sec"
    re.compile(
        rf"\bfiltered with (?:ramps|3 ?dB p(?:oin)?ts) at\s+({_NUMBER}(?:\s*-\s*{_NUMBER})?)"
        rf"(?:\s+and\s+({_NUMBER}(?:\s*-\s*{_NUMBER})?))?", re.I,
    ),
)  # fmt: skip


def read_v2(path: Path) -> list[RawTable]:
    """Records of CSMIP and COSMOS: accelerations and displacements of all channels."""
    lines = read_lines(path)
    groups: dict[tuple[int, float], list[Series]] = defaultdict(list)
    for one in all_series(lines, path):
        groups[one.count, one.dt].append(one)
    tables = []
    filters = sorted({found for line in lines if (found := _corners(line))})
    one_filter = filters[0] if len(filters) == 1 else None
    for number, ((_, step), group) in enumerate(groups.items(), 1):
        part = f"table {number}" if len(groups) > 1 else ""
        headings = [heading_of(_text(one)) for one in group]
        columns = [np.array(samples_of(lines, one, path)) for one in group]
        # a few samples may be missing at the end
        length = min(map(len, columns))
        columns = [column[:length] for column in columns]
        own = [filter_note(filters)] if filters else []
        tables.append(table_of_columns(
            path, part, headings, columns, own, rate=1 / step, filtered=one_filter
        ))  # fmt: skip
    return tables


def _corners(line: str) -> Corners | None:
    """Corners of a high-pass and a low-pass filter that a line of a header names."""
    for pattern in _FILTERED:
        if found := pattern.search(line):
            high, low = (
                tuple(map(float, re.findall(_NUMBER, text or ""))) for text in found.groups()
            )
            return (high, low) if any(high) else None
    return None


def _text(one: Series) -> str:
    """Heading of a column; its unit in brackets, as a location may end in others."""
    quantity = "displacement" if one.is_displacement else "acceleration"
    return f"channel {one.channel} {quantity} {one.words}".strip() + f" [{one.unit}]"
