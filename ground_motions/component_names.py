"""Components of one recording in several files, by their headers or the ends of their names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

_PAIRS = (("h1", "h2"), ("fn", "fp"), ("ns", "ew"), ("n", "e"), ("x", "y"), ("3", "2"))
"""Ends of the names of both horizontal components, the first one first; the last of channels."""
_VERTICAL = ("up", "u", "ud", "dn", "dwn", "v", "ver", "vert", "z")
_WORDS = "|".join((*(end for pair in _PAIRS[:-1] for end in pair), *_VERTICAL))
_STEM = re.compile(
    rf"(?P<base>.+?)(?:[-_. ]+(?P<word>{_WORDS})|[-_. ]*(?P<azimuth>\d{{3}}))", re.IGNORECASE
)
_FREE_FIELD = re.compile(r".*free[\s_-]?field.*|ground(?: surface)?|surface", re.IGNORECASE)
# stations' names, such as IT.NRC..HGE.D.20161030.C.ACC, have it at the end of a code of the channel
_CHANNEL = re.compile(r"(?P<before>.+\.[A-Z][NGLH])(?P<word>[ENZ23])(?P<after>\..+)")


class Component(NamedTuple):
    """What the header of a file with one component says of it."""

    recording: str  # The same for all components of a recording; empty if it is not told
    direction: str  # As in the header: "Up", "360 Deg", "Long"; empty if it is not told
    location: str = ""  # Of the sensor, as in the header: "Freefield", "Roof"

    @property
    def is_on_structure(self) -> bool:
        """Whether the header names a place other than the free field."""
        return bool(self.location) and not _FREE_FIELD.fullmatch(self.location)


def by_header(components: Mapping[Path, Component]) -> list[list[Path]]:
    """Files of each recording of two horizontal components: these first, then the vertical one."""
    recordings: dict[tuple[str, str], list[Path]] = {}
    for path, component in components.items():
        if component.recording and component.direction:
            key = component.recording, component.location
            recordings.setdefault(key, []).append(path)
    result = []
    for files in recordings.values():
        vertical = [path for path in files if is_vertical(components[path].direction)]
        horizontal = [path for path in files if path not in vertical]
        if len(horizontal) == 2 and len(vertical) < 2:
            one, other = (components[path].direction.lower().split()[0] for path in horizontal)
            azimuths = one.isdigit() and other.isdigit()
            if _perpendicular(one, other) if azimuths else one != other:
                result.append(horizontal + vertical)
    return result


def by_recording(files: Iterable[Path]) -> list[tuple[str, list[Path]]]:
    """Name and files of each recording, horizontal components first; single files otherwise."""
    files = list(files)
    stems = {path.stem for path in files}
    groups: dict[tuple[str, str], dict[str, Path]] = {}
    keys = {}
    for path in files:
        base, end = _split(path.stem)
        if end and base not in stems:
            keys[path] = base, path.suffix.lower()
            groups.setdefault(keys[path], {})[end.lower()] = path
    components = {key: _components(group) for key, group in groups.items()}
    result: dict[Path, tuple[str, list[Path]]] = {}
    for path in files:
        key = keys.get(path)
        if key is None or not components[key]:
            result[path] = path.stem, [path]
        else:
            result[components[key][0]] = key[0], components[key]
    return list(result.values())


def component_end(name: str) -> str:
    """End of a name that tells which component it is, such as FN or 090; empty if there is none."""
    return _split(name)[1]


def direction_in(name: str) -> str:
    """Last word of a column's or variable's name, which may be a direction, such as UD."""
    return re.split(r"[-_. ]+", name.strip())[-1]


def is_vertical(direction: str) -> bool:
    """Whether a direction in a header, such as ``Up`` or ``90 Deg``, is the vertical one."""
    first, *_ = (*direction.lower().split(), "")
    return first in (*_VERTICAL, "vertical", "vertikal", "down")


def _split(name: str) -> tuple[str, str]:
    """Name of a recording, and what tells its component; empty if nothing does."""
    if match := _CHANNEL.fullmatch(name):
        return match["before"] + match["after"], match["word"]
    if match := _STEM.fullmatch(name):
        return match["base"], match["word"] or match["azimuth"]
    return name, ""


def _components(group: dict[str, Path]) -> list[Path]:
    """The two horizontal components and the vertical one; none unless the ends are a pair."""
    vertical = [end for end in group if end in _VERTICAL]
    horizontal = sorted(end for end in group if end not in _VERTICAL)
    pairs = [
        pair
        for pair in (*_PAIRS, *combinations(horizontal, 2))
        if set(pair) == set(horizontal) and (pair in _PAIRS or _perpendicular(*pair))
    ]
    if not pairs or len(vertical) > 1:
        return []
    return [group[end] for end in (*pairs[0], *vertical)]


def are_a_pair(*ends: str) -> bool:
    """Whether two words, in any order, are the directions of two horizontal components."""
    if len(ends) != 2:
        return False
    small = sorted(end.lower() for end in ends)
    return any(sorted(pair) == small for pair in _PAIRS) or _perpendicular(*small)


def _perpendicular(one: str, other: str) -> bool:
    """Whether two ends are azimuths, degrees, at right angles."""
    if not (one.isdigit() and other.isdigit()) or max(int(one), int(other)) > 360:
        return False
    return (int(one) - int(other)) % 180 == 90
