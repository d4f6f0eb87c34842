"""Causes in the sensors: channels that do not show what moves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from ..channels import Channel, channel
from ..model import BuildingModel
from ..record import BuildingRecord
from .candidate import Candidate, Parameter, Values


def sensor_causes(records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """Causes in the channels of ground and building."""
    yield from _biases(records)
    yield from _gains(records)
    yield from _delays(records)
    yield from _exchanges(records)


def _biases(records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """A sensor has a constant or slowly varying error."""
    for name in (*records[0].ground_channels, *records[0].channels):
        sensor = channel(name)
        assert sensor is not None
        size = 1e-3 if sensor.is_displacement else 1e-2

        def apply(model: BuildingModel, values: Values, name=name) -> BuildingModel:
            return replace(model, biases={**model.biases, name: np.array(values)})

        for form, names in _BIASES.items():
            yield Candidate(
                "sensor_bias", name, tuple(Parameter(n, sensor.unit) for n in names),
                ((size, *(0.0,) * (len(names) - 1)),), apply,
                f"{name} is off by {{mean:.3g}} {sensor.unit}"
                + (" on average, drifting" if len(names) > 1 else ""),
                form=form,
            )  # fmt: skip
    yield _offsets(records)


def _offsets(records: Sequence[BuildingRecord]) -> Candidate:
    """All channels of the building have offsets, of a logger whose zeros were not subtracted."""
    sensors = records[0].sensors
    means = np.concatenate([record.values for record in records]).mean(axis=0)

    def apply(model: BuildingModel, values: Values) -> BuildingModel:
        offsets = {one.name: np.array([value]) for one, value in zip(sensors, values, strict=True)}
        return replace(model, biases={**model.biases, **offsets})

    return Candidate(
        "sensor_bias", "all channels", tuple(Parameter(one.name, one.unit) for one in sensors),
        (tuple(means.tolist()),), apply, "all channels have offsets", form="constant",
    )  # fmt: skip


_BIASES = {
    "constant": ("mean",),
    "linear": ("mean", "slope"),
    "drifting": ("mean", "slope", "curvature", "cubic"),
}
"""Parameters of each form of a bias: coefficients of Legendre polynomials over the record."""


def _gains(records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """A channel shows more or less than what moves, or the opposite."""
    for name in (*records[0].ground_channels, *records[0].channels):

        def apply(model: BuildingModel, values: Values, name=name) -> BuildingModel:
            return replace(model, gains={**model.gains, name: values[0]})

        yield Candidate(
            "sensor_gain", name, (Parameter("gain", "1", -3.0, 3.0),), ((1.05,), (-1.0,)), apply,
            f"{name} shows {{gain:.3g}} times the motion",
        )  # fmt: skip


def _delays(records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """Channels are late against the ground motion: another logger, clock or filter."""
    for place, names in _logged_together(records[0].sensors).items():
        verb = "are" if len(names) > 1 else "is"

        def apply(model: BuildingModel, values: Values, names=names) -> BuildingModel:
            delays = {name: model.delays.get(name, 0.0) + values[0] for name in names}
            return replace(model, delays={**model.delays, **delays})

        yield Candidate(
            "sensor_delay", place, (Parameter("delay", "s", -1.0, 1.0),),
            ((0.01,), (-0.01,), (0.1,), (-0.1,)), apply,
            f"{place} {verb} {{delay:.3g}} s late against the ground motion",
        )  # fmt: skip

        def drift(model: BuildingModel, values: Values, names=names, apply=apply) -> BuildingModel:
            drifts = dict.fromkeys(names, values[1])
            return replace(apply(model, values), drifts={**model.drifts, **drifts})

        if len(names) > 1:
            yield Candidate(
                "sensor_delay", place,
                (Parameter("delay", "s", -1.0, 1.0), Parameter("drift", "1", -0.01, 0.01)),
                ((0.0, 1e-3), (0.0, -1e-3)), drift,
                f"{place} {verb} {{delay:.3g}} s late at first, and {{drift:.3g}} s more every "
                "second, against the ground motion", form="clock_drift",
            )  # fmt: skip


def _logged_together(sensors: Sequence[Channel]) -> dict[str, tuple[str, ...]]:
    """Channels that one logger may have recorded, by its place; each alone first."""
    accelerations = [one for one in sensors if not one.is_displacement]
    loggers: dict[str, Sequence[Channel]] = {
        "all channels": sensors,
        "accelerations": accelerations,
        "accelerations above the base": [one for one in accelerations if one.floor],
    }
    for place in dict.fromkeys(one.place for one in sensors):
        loggers[f"channels of {place}"] = [one for one in sensors if one.place == place]
    result: dict[str, tuple[str, ...]] = {one.name: (one.name,) for one in sensors}
    for place, some in loggers.items():
        names = tuple(one.name for one in some)
        if len(names) > 1 and names not in result.values():
            result[place] = names
    return result


def _exchanges(records: Sequence[BuildingRecord]) -> Iterator[Candidate]:
    """Two accelerometers along one direction are exchanged."""
    sensors = [one for one in records[0].sensors if not one.is_displacement]
    for one, other in combinations(sensors, 2):
        if one.axis != other.axis:
            continue

        def apply(
            model: BuildingModel, values: Values, pair=(one.name, other.name)
        ) -> BuildingModel:
            return replace(model, exchanged=(*model.exchanged, pair))

        yield Candidate(
            "sensor_exchange", f"{one.name}, {other.name}", (), ((),), apply,
            f"{one.name} and {other.name} are exchanged",
        )  # fmt: skip
