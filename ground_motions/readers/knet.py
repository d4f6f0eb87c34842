"""K-NET and KiK-net files (K-NET ASCII format)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ground_motions.argument_types import checked
from ground_motions.checks import positive
from ground_motions.errors import InputError
from ground_motions.readers.lines import (
    excerpt,
    numbers_in,
    read_lines,
    require_count,
    require_two,
)
from ground_motions.record import Record
from ground_motions.units import to_m_s2

_FREQUENCY = ("Sampling Freq(Hz)", re.compile(r"(?P<a>[\d.]+)\s*Hz", re.IGNORECASE), "100Hz")
_DURATION = ("Duration Time(s)", re.compile(r"(?P<a>[\d.]+)"), "108")
_SCALE = (
    "Scale Factor",
    re.compile(r"(?P<a>[\d.]+)\s*\(gal\)\s*/\s*(?P<b>[\d.]+)", re.IGNORECASE),
    "3920(gal)/6182761",
)
_STATION = ("Station Code", re.compile(r"(?P<a>\S+)"), "MYG002")
_DIRECTION = ("Dir.", re.compile(r"(?P<a>\S+)"), "N-S")
_WIDTH = 18  # of the names in the header
_HEADER = 17  # lines, from "Origin Time" to "Memo."


@checked
def read_knet(path: str | Path) -> Record:
    """Read a K-NET or KiK-net file in ASCII.

    Parameters
    ----------
    path : str or Path
        One component: ``.NS``, ``.EW``, ``.UD``; of KiK-net with 1 (in the borehole) or 2 (at the
        surface) behind. A header of 17 lines from ``Origin Time`` to ``Memo.``, then whole numbers
        of the recorder.

    Returns
    -------
    Record
        The motion in m/s2, less its mean, as the maximum in the header is.

    Raises
    ------
    InputError
        If the header is another one, the number of samples is not that of the duration, or a
        sample is not a finite number.

    Notes
    -----
    National Research Institute for Earth Science and Disaster Resilience, "About K-NET ASCII
    format", www.kyoshin.bosai.go.jp/kyoshin/man/knetform_en.html.
    """
    lines = read_lines(path)
    header = lines[:_HEADER]
    for number, name in ((1, "Origin Time"), (_HEADER, "Memo.")):
        if len(lines) < number or not lines[number - 1].startswith(name):
            text = excerpt(lines[number - 1]) if len(lines) >= number else "no such line"
            raise InputError(f"{path}, line {number}", text, f"{name!r}, as in K-NET ASCII files")
    frequency = positive(f"{path}, sampling frequency (Hz)", _entry(header, _FREQUENCY, path)["a"])
    duration = positive(f"{path}, duration (s)", _entry(header, _DURATION, path)["a"])
    scale = _entry(header, _SCALE, path)
    station = _entry(header, _STATION, path)["a"]
    counts = numbers_in(lines, range(_HEADER, len(lines)), path)
    require_count(len(counts), round(duration * frequency), str(path), "duration times frequency")
    require_two(len(counts), str(path))
    factor = float(scale["a"]) / positive(f"{path}, scale factor", scale["b"]) * to_m_s2("gal")
    samples = np.array(counts) * factor
    direction = _entry(header, _DIRECTION, path)["a"]
    return Record(
        samples - samples.mean(),
        1.0 / frequency,
        name=f"{Path(path).stem}_{Path(path).suffix.removeprefix('.')}",
        source=f"{path}, station {station}, direction {direction}; less its mean",
        file_unit="gal",
    )


def _entry(
    header: list[str], entry: tuple[str, re.Pattern[str], str], path: str | Path
) -> re.Match[str]:
    """Return the value of a line of the header."""
    name, pattern, example = entry
    for number, line in enumerate(header, start=1):
        if line[:_WIDTH].strip() == name:
            match = pattern.match(line[_WIDTH:].strip())
            if match is None:
                text = excerpt(line[_WIDTH:].strip())
                raise InputError(f"{path}, line {number}, {name}", text, f"such as {example}")
            return match
    raise InputError(
        f"{path}, lines 1 to {len(header)}", f"no line {name!r}", f"such as '{name}  {example}'"
    )
