"""The isolation layer of building records as device tests: its motion, and the force it must exert.

The structure is linear. What the simulation misses in the channels is therefore its response to the
force that the isolators lack. Channels are put together, frequency by frequency, with the weights
of their noise, and the measured displacement prescribes the isolators' motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...effects.effect import REFERENCE_TEMPERATURE
from ...effects.extend import ExtendedLaw
from ...identification.measured_runs import MeasuredRuns
from ...identification.parameterisation import Parameterisation
from ...simulation.result import Run
from ...structures import IsolatedStructure
from ..decisions import LEAST_SENSOR_ERROR
from ..device.model import Model
from .channels import ISOLATOR, Channel
from .comparison import BuildingComparison, CauseValues, with_causes
from .frequency_response import frequency_response, linear_stiffness
from .model import BuildingModel, total_force_scale
from .noise import NoiseFloor, smooth_spectrum, spectra
from .record import BuildingRecord

_SMOOTH_POWER = 8
"""Of the low-pass up to which the displacement counts: Butterworth's of order 4, twice."""
_GUARD = 2.0
"""s: before held-out data of the same record, in which no force is compared."""
_CLEAR = 3.0
"""Power over that of noise, mean of nine frequencies, from which a displacement shows. Theory:
noise exceeds it once in 40,000 times."""


@dataclass(frozen=True, eq=False)
class LayerRuns(MeasuredRuns):
    """Records of an isolation layer; forces are weighted by their noise in the channels."""

    # By run: frequencies (Hz) and one over the standard deviation of a force there, 1/N
    gains: Mapping[str, tuple[NDArray, NDArray]]
    rms_force: float  # Of the law in the simulation, N; forces themselves are weighted

    @cached_property
    def sizes(self) -> tuple[float, float, float, float]:
        """RMS force (N), peak displacement (m), a time (s) and the highest current (A), or 1."""
        return (self.rms_force, *super().sizes[1:])

    def record_changes(self, force: NDArray) -> NDArray:
        """Forces, (n_samples, ...), weighted so that noise has unit variance in the band."""
        if not len(force):
            return force
        parts = []
        for name, run, dt in zip(self.names, self.runs, self.dt, strict=True):
            n = run.stop - run.start
            spectrum = np.fft.rfft(force[run], 2 * n, axis=0)
            at = np.fft.rfftfreq(2 * n, dt)
            gain = np.interp(at, *self.gains[name], right=0.0) * (at > 0)
            shape = (-1, *(1,) * (force.ndim - 1))
            parts.append(np.fft.irfft(spectrum * gain.reshape(shape), 2 * n, axis=0)[:n])
        return np.concatenate(parts)


def unsupported(isolated: IsolatedStructure, records: Sequence[BuildingRecord]) -> str:
    """Why the isolation layer of a building is no device test; empty where it is one."""
    model = BuildingModel(isolated, isolated.structure)
    device, holding = model.device, isolated.holding[list(model.isolators), 0]
    if len(records[0].axes) > 1:
        return "records of two directions"
    if isinstance(device.law, ExtendedLaw) or device.law.unit:
        return f"isolators with the law {device.law.name}"
    if len(device.current.coefficients) > 1:
        return "parameters given piecewise in the current"
    return "" if np.ptp(holding) == 0 else "isolators that act in several directions"


def layer_model(comparison: BuildingComparison, result: CauseValues) -> Model:
    """The isolators' law under the measured motion, with causes in law and structure."""
    model = with_causes(comparison.model, result)
    device = model.nominal.elements[0].device
    (rows,) = device.current.coefficients
    n_powers = 1 + int(np.flatnonzero(np.any(rows != 0, axis=0)).max(initial=0))
    fixed = dict(zip(device.current.names, rows[:, :n_powers], strict=True))
    currents = np.arange(n_powers, dtype=float)
    own = Parameterisation(device.law, currents, (1.0, 1.0, 1.0), fixed)
    layer = Model(_runs(comparison, model, result), own, effects=tuple(model.effects))
    # a fast Maxwell branch diverges with one step a sample
    return layer.resolve_steps(effect_values(comparison.model, result))


def effect_values(model: BuildingModel, result: CauseValues) -> NDArray:
    """Values of a layer's model: the parameters of the causes that are effects."""
    effects = with_causes(model, result).effects
    numbers = [own[q.name] for effect, own in effects.items() for q in effect.parameters]
    return np.array(numbers, dtype=float)


def _runs(comparison: BuildingComparison, model: BuildingModel, result: CauseValues) -> LayerRuns:
    """Motion and force in the records that are fitted, in the device's scale."""
    share, length = total_force_scale(model), model.nominal.elements[0].device.length
    parts, gains = [], {}
    for segment in comparison.fitted:
        record, floor = segment.record, comparison.floor_of(segment.record)
        run, residual = model.run(record), comparison.residual(result, record)
        lacking = _lacking(comparison, model, record, floor, run, residual)
        gains[record.name] = lacking.frequencies, lacking.gain * share
        x, v, a, force, current = _motion(model, run, record.dt, lacking)
        # a force shows in channels somewhat later and earlier as well
        start, stop, _ = segment.samples.indices(len(record))
        fitted = np.zeros(len(record), dtype=bool)
        fitted[start : stop - round(_GUARD / record.dt) * (stop < len(record))] = True
        parts.append(
            [x / length, v / length, a / length, force / share, lacking.force, current, fitted]
        )
    x, v, a, force, lacks, current, fitted = (
        np.concatenate(one) for one in zip(*parts, strict=True)
    )
    names = tuple(segment.record.name for segment in comparison.fitted)
    nothing, ones = np.zeros(len(names)), np.ones(len(names))
    data = LayerRuns(
        names=names,
        starts=np.concatenate([[0], np.cumsum([len(one[0]) for one in parts])]).astype(np.int64),
        dt=np.array([segment.record.dt for segment in comparison.fitted]),
        x=x, v=v, a=a, force=force, current=current,
        temperature=np.full(len(x), REFERENCE_TEMPERATURE), fitted=fitted,
        beside_jump=np.zeros(len(x), bool),
        clipped=np.zeros(len(x), bool),
        force_noise=ones, force_corner=np.inf * ones, displacement_noise=nothing, sigma=ones,
        velocity_noise=np.inf * ones, has_temperature=False,
        averaging=nothing, periods=nothing, return_times=nothing[:, np.newaxis],
        n_steps=np.ones(len(names), np.int64), stiff=np.zeros(len(names), bool), gains=gains,
        rms_force=float(np.sqrt(np.mean(force**2))),
    )  # fmt: skip
    return replace(data, force=lacks + data.record(force))


def _motion(model: BuildingModel, run: Run, dt: float, lacking: _Lacking) -> tuple[NDArray, ...]:
    """Deformation of the isolators, its derivatives, their simulated force, and the current."""
    first = model.nominal.elements[0]
    names = [model.nominal.elements[e].name for e in model.isolators]
    x, v = (run.output(f"{names[0]}_{what}") for what in ("deformation_m", "velocity_m_s"))
    missed = lacking.displacement * model.nominal.holding[model.isolators[0], 0]
    rate = 2j * np.pi * np.fft.rfftfreq(len(x), dt)
    closer = np.fft.irfft(np.array([missed, rate * missed, rate**2 * missed]), len(x))
    force = np.sum([run.output(f"{name}_force_N") for name in names], axis=0)
    current = np.zeros(len(x)) if first.channel is None else run.current[:, first.channel]
    return x + closer[0], v + closer[1], np.gradient(v, dt) + closer[2], force, current


def _place(record: BuildingRecord) -> int:
    """Isolators' displacement among the channels."""
    return record.channels.index(Channel(ISOLATOR, "", "displacement").name)


class _Lacking(NamedTuple):
    """What the simulation of a record lacks: force of the isolators, and displacement."""

    frequencies: NDArray  # (n_frequencies,), Hz: The building's band
    gain: NDArray  # (n_frequencies,), 1/N: One over the force's standard deviation
    force: NDArray  # (n,): Times the gain, so that noise has unit variance in the band
    displacement: NDArray  # (n // 2 + 1,), m: Fourier coefficients


def _lacking(
    comparison: BuildingComparison, model: BuildingModel, record: BuildingRecord, floor: NoiseFloor,
    run: Run, residual: NDArray,
) -> _Lacking:  # fmt: skip
    """Estimate the force and the displacement that a simulation lacks from all channels."""
    n, place = len(residual), _place(record)
    every = np.fft.rfftfreq(n, record.dt)
    # a constant force has no acceleration, and the free base no rest
    inside = np.flatnonzero((every > 0) & (every <= floor.band))
    frequencies = every[inside]
    by_force, by_ground, stiffness = _responses(model, record, run, frequencies)
    sensors = floor.sensor_noise(every) ** 2
    shown, missed = spectra(np.array([record.values, residual]), len(every))
    inexact = LEAST_SENSOR_ERROR**2 / 2 * smooth_spectrum(np.abs(shown) ** 2)[inside]
    expected = comparison.model_error**2 * np.mean(record.values**2, axis=0)
    # the displacement's noise is one in that channel and in the law's force
    clear = _clear(missed[:, place], sensors[:, place], every)
    both = np.eye(sensors.shape[1])[place] - (clear[inside] * stiffness)[:, np.newaxis] * by_force
    sensors = sensors[inside]
    own = sensors * (np.arange(sensors.shape[1]) != place) + expected + inexact
    noise = own[:, :, np.newaxis] * np.eye(sensors.shape[1])
    of_ground = floor.ground[0] ** 2 * np.ones(len(inside))
    for size, vector in ((sensors[:, place], both), (of_ground, by_ground)):
        outer = vector[:, :, np.newaxis] * vector[:, np.newaxis].conj()
        noise = noise + size[:, np.newaxis, np.newaxis] * outer
    whitening = np.linalg.inv(np.linalg.cholesky(noise))
    unit = np.einsum("fij,fj->fi", whitening, by_force)
    white = np.einsum("fij,fj->fi", whitening, missed[inside])
    gain = np.linalg.norm(unit, axis=1)
    force = np.zeros(len(every), dtype=complex)
    force[inside] = (unit.conj() * white).sum(axis=1) / gain * np.sqrt(n / 2)
    # where the sensor shows noise alone, accelerations and the force tell more
    displacement = clear * np.fft.rfft(residual[:, place])
    displacement[inside] += (1 - clear[inside]) * by_force[:, place] * force[inside] / gain
    return _Lacking(frequencies, gain, np.fft.irfft(force, n), displacement)


def _responses(
    model: BuildingModel, record: BuildingRecord, run: Run, frequencies: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Channels by a force of the isolators and by the ground, and the layer's stiffness.

    (n_frequencies, n_channels), m/s^2 or m a N; the same a m/s^2; (n_frequencies,), N/m.
    """
    structure = run.isolated.structure
    row = run.isolated.elements[model.isolators[0]].direction
    influence = structure.influence[:, 0]
    forces = -np.column_stack([row, structure.mass @ influence])
    by_force, by_ground = np.moveaxis(
        frequency_response(model, record, run, frequencies, forces), 2, 0
    )
    # the ground carries the sensors of accelerations with it
    n, columns = len(influence), model.measured(record, run.isolated, run.outputs.names)
    by_ground = by_ground + influence @ columns[2 * n : 3 * n]
    layer = np.sum([linear_stiffness(run, e, frequencies) for e in model.isolators], axis=0)
    return by_force, by_ground, layer


def _clear(missed: NDArray, noise: NDArray, frequencies: NDArray) -> NDArray:
    """Low-pass up to the last frequency at which a displacement shows above its noise."""
    power = smooth_spectrum(np.abs(missed) ** 2 / 2)
    clear = np.flatnonzero(power > _CLEAR * noise)
    if not len(clear):
        return np.zeros(len(frequencies))
    cut_off = max(frequencies[clear[-1]], frequencies[1])
    return 1 / (1 + (frequencies / cut_off) ** _SMOOTH_POWER)
