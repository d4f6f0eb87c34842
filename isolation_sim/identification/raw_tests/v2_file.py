"""Corrected records of instrumented buildings, of COSMOS and CSMIP (V2)."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

import numpy as np

from ground_motions.readers.lines import read_lines
from ground_motions.readers.v2 import Series, all_series, samples_of

from .channels import heading_of
from .raw_table import RawTable

# of COSMOS: "Record filtered below  0.08 Hz (periods over 12.5 secs), and above 40.0 Hz"
_FILTERED = re.compile(r"\bfiltered below\s+(\d*\.?\d+)\s*Hz", re.IGNORECASE)


def read_v2(path: Path) -> list[RawTable]:
    """Records of CSMIP and COSMOS: accelerations and displacements of all channels."""
    lines = read_lines(path)
    groups: dict[tuple[int, float], list[Series]] = defaultdict(list)
    for one in all_series(lines, path):
        groups[one.count, one.dt].append(one)
    tables = []
    corners = {float(found[1]) for line in lines if (found := _FILTERED.search(line))} - {0.0}
    filtered = ", ".join(f"{corner:g}" for corner in sorted(corners))
    notes = [f"filtered below {filtered} Hz: slower and residual motion is missing"]
    for number, ((_, step), group) in enumerate(groups.items(), 1):
        part = f"table {number}" if len(groups) > 1 else ""
        headings = [heading_of(_text(one)) for one in group]
        columns = [np.array(samples_of(lines, one, path)) for one in group]
        # a few samples may be missing at the end
        length = min(map(len, columns))
        columns = [column[:length] for column in columns]
        rows = list(range(1, length + 1))
        own = notes if corners else []
        tables.append(RawTable(path, part, headings, [*columns], rows, own, rate=1 / step))
    return tables


def _text(one: Series) -> str:
    """Heading of a column; its unit in brackets, as a location may end in others."""
    quantity = "displacement" if one.is_displacement else "acceleration"
    return f"channel {one.channel} {quantity} {one.words}".strip() + f" [{one.unit}]"
