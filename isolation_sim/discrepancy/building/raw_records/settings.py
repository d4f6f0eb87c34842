"""Settings of an import: which column is which channel, and what is done with them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    PrivateAttr,
    StringConstraints,
    model_validator,
)

from ....errors import InputError
from ....io.files import read_toml
from ....validation import Number, Positive, Section
from ..channels import AXES, BASE, GROUND, ISOLATOR, ROTATION, Channel
from ..record_filter import RecordFilter
from .headings import SENSOR_QUANTITIES

TIME, CURRENT = "time", "current"
_KEY = re.compile(
    r"(ground|base|isolator|floor[1-9]\d*)(?:_(x|y|rotation))?_(acceleration|displacement)"
)
_KEYS_EXPECTED = (
    "time, current, ground_acceleration, base_acceleration, floor1_acceleration, ..., "
    "isolator_displacement, or base_displacement and ground_displacement, each also with a "
    "direction, as base_x_acceleration"
)
_OPTIONS = "--column, --unit, --rate"


def channel_of(key: str) -> Channel | None:
    """The channel of a key; None for any other text."""
    match = _KEY.fullmatch(key)
    if match is None:
        return None
    channel = Channel(match[1], match[2] or "", match[3])
    if channel.is_displacement:
        turned = channel.axis == ROTATION
        known = channel.place == ISOLATOR or (channel.place in (GROUND, BASE) and not turned)
    else:
        known = channel.place != ISOLATOR and channel[:2] != (GROUND, ROTATION)
    return channel if known else None


def sensor_key(key: str, number: int) -> str:
    """Key of a sensor of a channel, from 1."""
    return key if number == 1 else f"{key} {number}"


def _known_key(key: str) -> str:
    if key not in (TIME, CURRENT) and channel_of(key) is None:
        raise ValueError(f"no channel; expected: {_KEYS_EXPECTED}")
    return key


def _known_unit_key(key: str) -> str:
    if key not in SENSOR_QUANTITIES and key not in (TIME, CURRENT) and channel_of(key) is None:
        expected = f"{', '.join(SENSOR_QUANTITIES)}, {_KEYS_EXPECTED}"
        raise ValueError(f"no quantity and no channel; expected: {expected}")
    return key


def _column(value: Any) -> str:
    if isinstance(value, bool) or not isinstance(value, int | str) or value in ("", "?"):
        raise ValueError(f"{value!r}; expected: a heading, its number, or none")
    return str(value)


def _sign(value: float) -> float:
    if abs(value) != 1:
        raise ValueError(f"{value:g}; expected: 1 or -1; any other factor is a scale")
    return value


def _not_zero(value: float) -> float:
    if value == 0:
        raise ValueError("0; expected: a number other than 0")
    return value


def _entries(value: Any) -> Any:
    """Tables of the columns of a channel, of which a heading or a number is a short form."""
    entries = value if isinstance(value, list) else [value]
    return [one if isinstance(one, Mapping | Entry) else {"column": one} for one in entries]


def _both(directions: dict[str, str]) -> dict[str, str]:
    if sorted(directions) != ["x", "y"]:
        raise ValueError(f'{directions}; expected: {{ x = "EW", y = "NS" }}, words of the headings')
    return directions


_Text = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]


class Entry(Section):
    """The column of a channel."""

    column: Annotated[str, BeforeValidator(_column)]  # Its heading, its number from 1, or none
    file: _Text = ""  # File or table; empty if the column is in one table only
    unit: _Text = ""  # Of the column; empty if its heading has one
    sign: Annotated[Number, AfterValidator(_sign)] = 1.0
    scale: Annotated[Number, AfterValidator(_not_zero)] = 1.0
    # In the plan, from the reference point
    position_m: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = None

    @property
    def factor(self) -> float:
        """Sign times scale."""
        return self.sign * self.scale

    @property
    def at(self) -> tuple[float, float] | None:
        """Position in the plan, m."""
        return (self.position_m[0], self.position_m[1]) if self.position_m else None

    @property
    def is_none(self) -> bool:
        """Whether the channel has no column."""
        return self.column.lower() == "none"


ABSENT = Entry.model_construct(column="")
"""Entry of a channel that the settings do not name."""


class RecordSettings(Section):
    """Choices of the caller; see `import_building_record`."""

    rate_Hz: Annotated[
        Positive | None,
        Field(description="samples per second of files without a column of time", examples=[200]),
    ] = None
    floors: Annotated[
        int | None,
        Field(ge=1, description="floors above the base: the roof is floor 5", examples=[5]),
    ] = None
    direction: Annotated[
        _Text, Field(description="import one of two directions", examples=["x"])
    ] = ""
    accelerations: Annotated[
        Literal["absolute", "relative"] | None,
        Field(description="to the ground; they are made absolute", examples=["relative"]),
    ] = None
    offset_s: Annotated[
        Positive | None,
        Field(description="subtract the mean of the first 5 s from each channel", examples=[5]),
    ] = None
    resample_Hz: Annotated[
        Positive | None,
        Field(description="common rate of files with different sampling", examples=[200]),
    ] = None
    filter: Annotated[
        RecordFilter | None,
        Field(description="that the channels passed", examples=[{"high_pass_Hz": 0.1}]),
    ] = None
    directions: Annotated[
        dict[str, _Text],
        AfterValidator(_both),
        Field(description="words of the headings", examples=[{"x": "EW", "y": "NS"}]),
    ] = Field(default_factory=dict)
    start_s: Annotated[
        dict[str, Number],
        Field(description="added to the times of a file", examples=[{"logger2.txt": 0.35}]),
    ] = Field(default_factory=dict)
    units: Annotated[
        dict[Annotated[str, AfterValidator(_known_unit_key)], _Text],
        Field(description="of columns without one", examples=[{"acceleration": "g"}]),
    ] = Field(default_factory=dict)
    channels: dict[
        Annotated[str, AfterValidator(_known_key)],
        Annotated[list[Entry], BeforeValidator(_entries), Field(min_length=1)],
    ] = Field(default_factory=dict)
    _place: str = PrivateAttr("settings")

    @model_validator(mode="after")
    def _columns_that_fit(self) -> Self:
        for key, entries in self.channels.items():
            if len(entries) > 1 and (key in (TIME, CURRENT) or any(e.is_none for e in entries)):
                texts = ", ".join(repr(entry.column) for entry in entries)
                expected = "one column" if key in (TIME, CURRENT) else "columns, or none alone"
                raise InputError(f"channels.{key}", texts, expected)
            if any(entry.position_m for entry in entries) and not _has_position(key):
                raise InputError(
                    f"channels.{key}.position_m", f"one of {key}",
                    "that of an acceleration along x or y above the ground, or of the isolators' "
                    "displacement",
                )  # fmt: skip
        return self

    @property
    def place(self) -> str:
        """File, for errors."""
        return self._place

    @cached_property
    def sensors(self) -> dict[str, Entry]:
        """Entries by key; the second sensor of a channel has the key and " 2"."""
        return {
            sensor_key(key, k): entry
            for key, entries in self.channels.items()
            for k, entry in enumerate(entries, 1)
        }

    @property
    def words(self) -> dict[str, str]:
        """Direction x or y by the word of the headings."""
        return {word: axis for axis, word in self.directions.items()}

    @property
    def relative(self) -> bool | None:
        """Whether accelerations are relative to the ground."""
        return None if self.accelerations is None else self.accelerations == "relative"


def _has_position(key: str) -> bool:
    one = channel_of(key)
    return (
        one is not None
        and one.axis in AXES
        and one.place != GROUND
        and (one.place, one.quantity) != (BASE, "displacement")
    )


def read_settings(
    source: str | Path | Mapping[str, Any] | None,
    columns: Mapping[str, Sequence[str]],
    units: Mapping[str, str],
    rate: float | None,
) -> RecordSettings:
    """Read settings from a file or a mapping; ``columns``, ``units`` and ``rate`` go before."""
    if source is None or isinstance(source, Mapping):
        place, data = "settings", dict(source or {})
    else:
        place = str(source)
        data = read_toml(Path(source), "settings, such as --write-settings FILE writes")
    options = {"channels": dict(columns), "units": dict(units), "rate_Hz": rate}
    read, given = _validated(place, data), _validated(_OPTIONS, options)
    both = {
        "channels": read.channels | given.channels,
        "units": read.units | given.units,
        "rate_Hz": given.rate_Hz or read.rate_Hz,
    }
    result = read.model_copy(update=both)
    result._place = place
    return result


def _validated(place: str, data: dict[str, Any]) -> RecordSettings:
    try:
        return RecordSettings(**data)
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
