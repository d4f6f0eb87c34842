"""Files of LabVIEW: measurement files as text, and TDMS."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ground_motions.readers.lines import is_number, read_lines

from ...errors import InputError, not_installed
from .channels import Heading, heading_of
from .raw_table import RawTable, Row, with_point

_END = "***End_of_Header***"
_X = "X_Value"


def read_lvm(path: Path) -> list[RawTable]:
    """Measurement files of LabVIEW: a segment per test."""
    lines = read_lines(path)
    if not lines[0].startswith("LabVIEW Measurement"):
        raise InputError(f"{path}, line 1", repr(lines[0][:40]), "LabVIEW Measurement")
    comma = any(line.split()[:2] == ["Separator", "Comma"] for line in lines[:40])
    rows = []
    for number, line in enumerate(lines, 1):
        cells = [cell.strip() for cell in line.split("," if comma else "\t")]
        numbers = all(is_number(with_point(cell)) for cell in cells if cell)
        rows.append(Row(number, cells, numbers and any(cells)))
    # the header of the file ends first, then that of each segment
    ends = [k for k, row in enumerate(rows) if row.cells[0] == _END]
    tables = []
    for number, end in enumerate(ends[1:], 1):
        stop = ends[number + 1] if number + 1 < len(ends) else len(rows)
        part = f"table {number}" if len(ends) > 2 else ""
        tables.append(_segment(path, part, rows[ends[number - 1] : end], rows[end + 1 : stop]))
    return tables


def _segment(path: Path, part: str, above: Sequence[Row], below: Sequence[Row]) -> RawTable:
    header = {row.cells[0]: row.cells[1:] for row in above}
    names = next((row.cells for row in below if row.cells[0] == _X), [_X])
    block = [row for row in below if row.numbers]
    units = iter(header.get("Y_Unit_Label", []))
    headings: list[Heading] = []
    columns = []
    for k, name in enumerate(names):
        cells = [row.cells[k] if k < len(row.cells) else "" for row in block]
        # with a column of times beside each channel, the first stands for all
        if name == _X and any(cells) and not headings:
            headings.append(Heading(_X, "s", ("time",), False, _X))
        elif name not in (_X, "Comment"):
            headings.append(heading_of(name, next(units, "")))
        else:
            continue
        columns.append(cells)
    steps = {float(with_point(cell)) for cell in header.get("Delta_X", []) if cell}
    rate = 1 / steps.pop() if len(steps) == 1 and min(steps) > 0 else None
    return RawTable(path, part, headings, [*columns], [row.line for row in block], rate=rate)


def read_tdms(path: Path) -> list[RawTable]:
    """TDMS files of LabVIEW: a group of channels per test (needs the extra tdms)."""
    try:
        from nptdms import TdmsFile
    except ModuleNotFoundError:
        raise not_installed(f"{path}:", "npTDMS", "tdms") from None
    try:
        with path.open("rb") as file:
            if file.read(4) != b"TDSm":
                raise InputError(f"{path}: not a file *.tdms")
        groups = TdmsFile.read(path).groups()
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except Exception as error:  # npTDMS raises many kinds
        words = " ".join(str(error).split())
        raise InputError(f"{path}: cannot be read ({words}); expected: a file *.tdms") from None
    return [_group(path, group) for group in groups]


def _group(path: Path, group: Any) -> RawTable:
    channels = [one for one in group.channels() if len(one) and one.dtype.kind in "iufM"]
    lengths = Counter(map(len, channels))
    length = lengths.most_common(1)[0][0] if lengths else 0
    alike = [one for one in channels if len(one) == length]
    headings, columns, rates = [], [], set()
    for one in alike:
        values, properties = one[:], one.properties
        unit = str(properties.get("unit_string") or properties.get("NI_UnitDescription", ""))
        if values.dtype.kind == "M":
            values, unit = (values - values[0]) / np.timedelta64(1, "s"), "s"
        headings.append(heading_of(one.name, unit))
        columns.append(np.asarray(values, float))
        rates.add(properties.get("wf_increment", 0.0))
    step = rates.pop() if len(rates) == 1 else 0.0
    others = sorted(one.name for one in channels if len(one) != length)
    notes = [f"of another length, left out: {', '.join(others)}"] if others else []
    return RawTable(
        path, group.name, headings, [*columns], list(range(1, length + 1)), notes,
        1 / step if step > 0 else None,
    )  # fmt: skip
