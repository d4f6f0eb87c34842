"""Checks of a building record before any model is fitted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ground_motions.units import STANDARD_GRAVITY

from ...errors import InputError
from ...identification.measured.channel_checks import clipped
from ...structures import Structure
from .model import dofs_by_level
from .record import BuildingRecord

_LOW, _HIGH = 0.2, 3.0
"""Hz: where an isolated building moves enough to compare accelerations with its displacement."""
_TAPER = 0.25
"""Share of a record over which it fades in and out for this comparison. Convention."""
_UNITS = {
    STANDARD_GRAVITY: "g and m/s^2", 100.0: "cm/s^2 and m/s^2",
    100.0 * STANDARD_GRAVITY: "g and cm/s^2", 1000.0: "mm/s^2 and m/s^2",
}  # fmt: skip
"""Factors between units of acceleration that are mistaken for each other."""
_ALIKE, _COHERENT, _COHERENT_ALL = 0.12, 0.9, 0.97
"""Relative distance from a factor, and coherence from which it counts; coherence of what can only
be the same motion. Convention."""
_SLOW = 1.0
"""Hz: below it base and floors of an isolated building move alike, whatever the superstructure."""
_FLOORS_ALIKE = 0.35
"""Relative distance from a factor of units at which a floor counts: floors move somewhat more than
the base. Convention."""
_UNIT = 0.02
"""Relative distance from a factor of units at which a fitted gain counts as one. Convention."""
_STILL = 0.03
"""Motion of an accelerometer over the usual one of its direction that is none. Convention."""

_WINDOW, _FEWEST_AT_REST = 0.5, 6
"""s: parts into which the rest before the motion is divided, and their least number. Convention."""
_MOVES, _OFF = 2.0, 6.0
"""Spread in such a time over that in the first one with which the motion begins; standard errors
from which a mean is an offset. Convention."""


def unit_factor_in_words(factor: float) -> str:
    """Units that a factor lies between; empty if between none."""
    return next((words for one, words in _UNITS.items() if _is_factor(factor, one, _UNIT)), "")


def check_quantities(record: BuildingRecord) -> None:
    """Refuse a record whose accelerations and displacements do not belong together."""
    for axis, motion in zip(record.axes, record.ground, strict=True):
        along = f" along {axis}" if axis else ""
        name, factor = _wrong_unit(record, axis, motion.acceleration)
        if name:
            between = next(words for one, words in _UNITS.items() if _is_factor(factor, one))
            raise InputError(
                f"{record.name}: the {name}'s acceleration{along} is {factor:.3g} times the one "
                "that fits the other columns and the isolators' displacement; expected: each "
                f"column in the unit that its name says (the factor is that between {between})"
            )
        slope, _, coherence = _against_displacement(record, axis, motion.acceleration)
        if coherence > _COHERENT and any(_is_factor(slope, one) for one in _UNITS):
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


def _is_factor(ratio: float, factor: float, distance: float = _ALIKE) -> bool:
    """Whether a ratio is a factor or its inverse, of either sign."""
    ratio = max(abs(ratio), 1 / abs(ratio)) if ratio else 1.0
    return abs(ratio / factor - 1) < distance


def _wrong_unit(record: BuildingRecord, axis: str, motion: NDArray) -> tuple[str, float]:
    """Which of base and ground is alone in another unit, and by which factor; else no name."""
    # the displacement's second derivative is that of the base less that of the ground, each times
    # its own factor; both are one unless a unit is wrong
    base, ground, target = _spectra(record, axis, record.base_acceleration(axis), motion)
    columns = np.stack([base, -ground], axis=1)
    parts = np.vstack([columns.real, columns.imag])
    both = np.concatenate([target.real, target.imag])
    (of_base, of_ground), *_ = np.linalg.lstsq(parts, both, rcond=None)
    left = both - parts @ (of_base, of_ground)
    if float(left @ left) > (1 - _COHERENT**2) * float(both @ both):
        return "", 1.0
    for name, own, other in (("base", of_base, of_ground), ("ground", of_ground, of_base)):
        if abs(other - 1) < _ALIKE and any(_is_factor(own, one) for one in _UNITS):
            return name, 1 / own
    return "", 1.0


def without_offsets(record: BuildingRecord) -> BuildingRecord:
    """Subtract the offsets of a record most of whose accelerometers show one before the motion.

    That is a logger whose zeros were not subtracted; of few sensors it is a fault of theirs.
    """
    names = (*record.ground_channels, *record.channels)
    signals = np.column_stack([*(one.acceleration for one in record.ground), record.values])
    size = max(round(_WINDOW / record.dt), 8)
    windows = signals[: len(signals) // size * size].reshape(-1, size, len(names))
    spread = windows.std(axis=1)
    moves = (spread > _MOVES * spread[0]).any(axis=1)
    n = int(np.argmax(moves)) if moves.any() else len(moves)
    if n < _FEWEST_AT_REST:
        return record
    means = windows[:n].mean(axis=1)
    offsets, errors = means.mean(axis=0), means.std(axis=0, ddof=1) / np.sqrt(n)
    seen = np.abs(offsets) > _OFF * errors
    accelerometers = np.array(["acceleration" in name for name in names])
    if not seen[accelerometers].mean() > 0.5:
        return record
    # over all of a record an acceleration has the mean of its sensor, but for a last velocity
    last = windows[-_FEWEST_AT_REST:].std(axis=(0, 1)) * _WINDOW / (len(record) * record.dt)
    offsets = np.where(accelerometers & (last < errors), signals.mean(axis=0), offsets)
    g = len(record.ground)
    ground = tuple(
        replace(one, acceleration=one.acceleration - offset)
        for one, offset in zip(record.ground, offsets[:g], strict=True)
    )
    response = dict(zip(record.channels, (record.values - offsets[g:]).T, strict=True))
    largest = np.argmax(np.abs(offsets) * accelerometers)
    said = (
        f"most channels have an offset in the first {n * size * record.dt:.3g} s; it is "
        f"subtracted, of {names[largest]} {offsets[largest]:.2g}"
    )
    notes = (*record.notes, said)
    return replace(record, ground=ground, response=response, notes=notes)


def record_problems(record: BuildingRecord) -> tuple[str, ...]:
    """Find suspicious features of a record."""
    result: list[str] = []
    motions = [motion.acceleration for motion in record.ground]
    signals = {**dict(zip(record.ground_channels, motions, strict=True)), **record.response}
    unlike = {
        name: problem
        for axis, motion in zip(record.axes, motions, strict=True)
        for name, problem in _unlike_others(record, axis, motion)
    }
    result += unlike.values()
    still = {name for name in _without_motion(record) if name not in unlike}
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


def _unlike_others(record: BuildingRecord, axis: str, motion: NDArray) -> Iterator[tuple[str, str]]:
    """Accelerometers that are turned or in another unit, by what most others show slowly."""
    names = [
        one.name for one in record.sensors if one.axis == axis and not one.is_displacement
    ]  # fmt: skip
    *shown, of_ground, relative = _spectra(
        record, axis, *(record.response[name] for name in names), motion, high=_SLOW
    )
    # the ground's motion and the isolators' displacement are one more witness
    every = np.array([*shown, of_ground + relative])
    sizes = np.linalg.norm(every, axis=1)
    if len(every) < 3 or not np.all(sizes > 0):
        return
    alike = (every.conj() @ every.T).real / np.outer(sizes, sizes)
    signs = np.sign(np.linalg.eigh(alike)[1][:, -1])
    signs *= np.sign(signs.sum()) or 1.0
    right = signs > 0
    if right.sum() <= len(signs) / 2:
        return
    for k, name in enumerate(names):
        others = right & (np.arange(len(right)) != k)
        coherence = float(np.median(alike[k, others]))
        if abs(coherence) < _COHERENT:
            continue
        ratio = float(sizes[k] / np.median(sizes[others]))
        factors = [one for one in _UNITS if _is_factor(ratio, one, _FLOORS_ALIKE)]
        below = f"below {_SLOW:g} Hz"
        if factors:
            yield (
                name,
                f"{name} shows {ratio:.3g} times what the other sensors show {below}, about the "
                f"factor between {_UNITS[factors[0]]}: is it in the unit that its name says?",
            )
        elif coherence < 0:
            yield (
                name,
                f"{name} moves against the other sensors {below}: its sign is turned? (multiply "
                "the column by -1, or import it with sign = -1)",
            )


def unmeasured_floors(record: BuildingRecord, structure: Structure) -> tuple[str, ...]:
    """Say which floors a structure has above the last one that was measured."""
    first = max(record.floors, default=0) + 1
    last = len(dofs_by_level(structure, record.axes[0])) - 1
    if first > last:
        return ()
    which = f"floor {last}" if first == last else f"floors {first} to {last}"
    return (f"{which} of {structure.name} {'was' if first == last else 'were'} not measured",)


def _against_displacement(
    record: BuildingRecord, axis: str, motion: NDArray | float
) -> tuple[float, float, float]:
    """Relative acceleration over the displacement's, delay of the displacement (s), coherence."""
    # From the phase and size of their cross-spectrum, weighted by its size.
    relative, accelerated = _spectra(record, axis, record.base_acceleration(axis) - motion)
    _, omega = _band(record)
    cross = relative * accelerated.conj()
    power = float(np.sum(np.abs(accelerated) ** 2))
    own = float(np.sum(np.abs(relative) ** 2))
    if power == 0 or own == 0:
        return 0.0, 0.0, 0.0
    lag = float(np.sum(omega * np.abs(cross) * np.angle(cross)) / np.sum(omega**2 * np.abs(cross)))
    aligned = cross * np.exp(-1j * omega * lag)
    shared = float(aligned.real.sum())
    return shared / power, lag, abs(shared) / float(np.sqrt(power * own))


def _band(record: BuildingRecord, high: float = _HIGH) -> tuple[NDArray, NDArray]:
    """Where accelerations and displacements are compared in a spectrum, and there omega, rad/s."""
    frequency = np.fft.rfftfreq(len(record), record.dt)
    used = (frequency > _LOW) & (frequency < high)
    return used, 2 * np.pi * frequency[used]


def _spectra(
    record: BuildingRecord, axis: str, *accelerations: NDArray, high: float = _HIGH
) -> list[NDArray]:
    """Spectra of accelerations, and last that of the displacement's second derivative."""
    from scipy.signal.windows import tukey

    # Without a window, a record that is cut off in strong motion would have a jump at its end. By
    # parts, the second derivative of the displacement moves to the window and to the oscillation.
    window = tukey(len(record), _TAPER)
    used, omega = _band(record, high)
    slope = np.gradient(window, record.dt)
    bend = np.gradient(slope, record.dt)
    x = record.displacement(axis)
    of_x, of_slope, of_bend = (np.fft.rfft(w * x)[used] for w in (window, slope, bend))
    accelerated = of_bend - 2j * omega * of_slope - omega**2 * of_x
    return [*(np.fft.rfft(window * each)[used] for each in accelerations), accelerated]
