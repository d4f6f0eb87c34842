"""Checks of a building record before any model is fitted."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ground_motions.units import STANDARD_GRAVITY

from ...errors import InputError
from ...identification.data_checks import clipped
from ...structures import Structure
from .model import dofs_by_level
from .record import BuildingRecord

_LOW, _HIGH = 0.2, 3.0
"""Hz: where an isolated building moves enough to compare accelerations with its displacement."""
_TAPER = 0.25
"""Share of a record over which it fades in and out for this comparison. Convention."""
_UNITS = (STANDARD_GRAVITY, 100.0, 100.0 * STANDARD_GRAVITY, 1000.0)
"""Factors between units that are mistaken for each other."""
_ALIKE, _COHERENT, _COHERENT_ALL = 0.12, 0.9, 0.97
"""Relative distance from a factor, and coherence from which it counts; coherence of what can only
be the same motion. Convention."""
_STILL = 0.03
"""Motion of an accelerometer over the usual one of its direction that is none. Convention."""


def check_quantities(record: BuildingRecord) -> None:
    """Refuse a record whose accelerations and displacements do not belong together."""
    for axis, motion in zip(record.axes, record.ground, strict=True):
        along = f" along {axis}" if axis else ""
        slope, _, coherence = _against_displacement(record, axis, motion.acceleration)
        ratio = max(abs(slope), 1 / abs(slope)) if slope else 1.0
        if coherence > _COHERENT and any(abs(ratio / one - 1) < _ALIKE for one in _UNITS):
            raise InputError(
                f"{record.name}: the base's acceleration relative to the ground{along} is "
                f"{slope:.3g} times that of the isolators' displacement; expected: 1 (is each "
                "column in the unit that its name says?)"
            )
        itself, _, same = _against_displacement(record, axis, 0.0)
        if coherence < _COHERENT_ALL < same and abs(itself - 1) < _ALIKE:
            raise InputError(
                f"{record.name}: the base's acceleration{along} itself is that of the isolators' "
                "displacement; expected: absolute accelerations, and displacements relative to the "
                "ground"
            )


def record_problems(record: BuildingRecord) -> tuple[str, ...]:
    """Find suspicious features of a record."""
    result = []
    motions = [motion.acceleration for motion in record.ground]
    signals = {**dict(zip(record.ground_channels, motions, strict=True)), **record.response}
    still = tuple(_without_motion(record))
    for name, values in signals.items():
        if name in still:
            result.append(f"{name} does not move with the building: not connected?")
            continue
        flat = clipped(values)
        if flat:
            length = flat.stop - flat.start
            result.append(f"{name} stays at its peak for {length} samples: clipped?")
        start = np.sqrt(np.mean(values[: max(len(values) // 100, 8)] ** 2))
        if start > 0.3 * np.sqrt(np.mean(values**2)):
            result.append(f"{name} does not start at rest, as the simulation does")
    for axis, motion in zip(record.axes, motions, strict=True):
        along = f" along {axis}" if axis else ""
        slope, lag, _ = _against_displacement(record, axis, motion)
        if not 0.7 < slope < 1.4:
            result.append(
                f"the base's acceleration relative to the ground{along} is {slope:.2f} times that "
                "of the isolators' displacement: a unit, a sign, or a base that does not stand on "
                "the ground"
            )
        elif abs(lag) > record.dt:
            late = "behind" if lag > 0 else "ahead of"
            result.append(
                f"the isolators' displacement{along} is {1e3 * abs(lag):.0f} ms {late} the "
                "accelerations"
            )
    return tuple(result)


def _without_motion(record: BuildingRecord) -> Iterator[str]:
    """Accelerometers that show next to nothing of what the others along their direction show."""
    for axis in record.axes:
        sizes = {
            one.name: float(np.std(record.response[one.name]))
            for one in record.sensors
            if one.axis == axis and not one.is_displacement
        }
        usual = np.median(list(sizes.values()))
        yield from (name for name, size in sizes.items() if size < _STILL * usual)


def unmeasured_floors(record: BuildingRecord, structure: Structure) -> tuple[str, ...]:
    """Say which floors a structure has above the last one that was measured."""
    first, last = max(record.floors) + 1, len(dofs_by_level(structure, record.axes[0])) - 1
    if first > last:
        return ()
    which = f"floor {last}" if first == last else f"floors {first} to {last}"
    return (f"{which} of {structure.name} {'was' if first == last else 'were'} not measured",)


def _against_displacement(
    record: BuildingRecord, axis: str, motion: NDArray | float
) -> tuple[float, float, float]:
    """Relative acceleration over the displacement's, delay of the displacement (s), coherence."""
    from scipy.signal.windows import tukey

    # From the phase and size of their cross-spectrum, weighted by its size. Without a window, a
    # record that is cut off in strong motion would have a jump at its end. By parts, the second
    # derivative of the displacement moves to the window and to the oscillation.
    window = tukey(len(record), _TAPER)
    frequency = np.fft.rfftfreq(len(record), record.dt)
    used = (frequency > _LOW) & (frequency < _HIGH)
    omega = 2 * np.pi * frequency[used]
    base = record.base_acceleration(axis)
    relative = np.fft.rfft(window * (base - motion))[used]
    slope = np.gradient(window, record.dt)
    bend = np.gradient(slope, record.dt)
    x = record.displacement(axis)
    of_x, of_slope, of_bend = (np.fft.rfft(w * x)[used] for w in (window, slope, bend))
    accelerated = of_bend - 2j * omega * of_slope - omega**2 * of_x
    cross = relative * accelerated.conj()
    power = float(np.sum(np.abs(accelerated) ** 2))
    own = float(np.sum(np.abs(relative) ** 2))
    if power == 0 or own == 0:
        return 0.0, 0.0, 0.0
    lag = float(np.sum(omega * np.abs(cross) * np.angle(cross)) / np.sum(omega**2 * np.abs(cross)))
    aligned = cross * np.exp(-1j * omega * lag)
    shared = float(aligned.real.sum())
    return shared / power, lag, abs(shared) / float(np.sqrt(power * own))
