"""Stiffness and damping of a measured loop, with their uncertainty from cycle to cycle.

Li & Li, Eqs 1-5, and the complex modulus of Tao et al., from the time series of a sinusoidal test.
How the usual errors are avoided:

- Offset and slow drift: displacement and force are measured from their moving means over one
  period. The removed means are returned as the two offsets.
- Asymmetric devices and preloads: Eqs 1 and 3 use the force relative to that at the mean
  deformation, which is the mean of both branches there. The mean of the force over time would be
  wrong, because the force of an asymmetric device has a mean. The offset of a sensor and the force
  of a preload cancel.
- Partial cycles: the frequency is fitted, and whole cycles are cut from a quarter of a period
  before a peak of the displacement to three quarters after.
- Noise: energy and complex modulus come from the harmonics of each cycle. The force at a point
  comes from a curve through many samples (`force_curve`). The largest force of each cycle is the
  value of its curve at the maximum of the mean cycle, because the maximum of each cycle would be
  too high.
- Jumps: a friction-like force jumps when the velocity reverses. The force at an end is the mean of
  its limits before and after. For a symmetric loop this equals both ends at one sign of the
  velocity. Without a jump the two limits agree.
- Rest and ramps: cycles are left out if their amplitude differs by more than 5 % from the median of
  the moving cycles.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from ground_motions.argument_types import checked

from .measured.loop_cycles import harmonics
from .steady_loops import SteadyLoops, steady_loops

# harmonics fitted, and those that the displacement may have
_HARMONICS_FITTED, _HARMONICS = 15, 5


@dataclass(frozen=True, eq=False)
class Measure:
    """A number measured once per cycle.

    Attributes
    ----------
    value : float
        Mean over the cycles, in the measure's unit.
    uncertainty : float
        Standard error of the mean, in the same unit.
    cycles : numpy.ndarray, shape (n_cycles,)
        The cycles' own values, in the same unit.
    """

    value: float
    uncertainty: float
    cycles: np.ndarray

    @property
    def n_cycles(self) -> int:
        """Number of cycles behind the mean."""
        return self.cycles.size


@dataclass(frozen=True, eq=False)
class LoopMeasures:
    """Measures of a sinusoidal test.

    Attributes
    ----------
    frequency : float, Hz
        Given or found.
    n_cycles : int
        Whole cycles measured.
    n_left_out : int
        Whole cycles left out because their amplitude differs.
    amplitude : Measure, m
        Half the stroke, X.
    effective_stiffness : Measure, N/m
        Li & Li, Eq 2: difference of the forces at both ends of the stroke over the stroke.
    effective_stiffness_half : Measure, N/m
        Li & Li, Eq 1 (AASHTO): force at the positive end over the positive displacement, both from
        the mean deformation.
    dynamic_stiffness : Measure, N/m
        Li & Li, Eq 3: largest force over the largest displacement, both from the mean deformation.
    energy_per_cycle : Measure, J
        Area of the loop, positive where the device dissipates.
    equivalent_damping : Measure, N s/m
        Li & Li, Eq 4: energy / (pi omega X^2).
    damping_ratio : Measure, dimensionless
        Li & Li, Eq 5: energy / (2 pi K_eff X^2); nan where a cycle's effective stiffness
        is not positive.
    storage_stiffness : Measure, N/m
        Tao et al., k': part of the force's first harmonic in phase with the displacement's.
    loss_stiffness : Measure, N/m
        Tao et al., k'': part of the force's first harmonic a quarter of a period ahead.
    loss_damping : Measure, N s/m
        Tao et al., C_MR = k'' / (2 pi f).
    displacement_offset : Measure, m
        Mean over a cycle; drift shows in its uncertainty.
    force_offset : Measure, N
        Mean over a cycle.
    """

    frequency: float
    n_cycles: int
    n_left_out: int
    amplitude: Measure
    effective_stiffness: Measure
    effective_stiffness_half: Measure
    dynamic_stiffness: Measure
    energy_per_cycle: Measure
    equivalent_damping: Measure
    damping_ratio: Measure
    storage_stiffness: Measure
    loss_stiffness: Measure
    loss_damping: Measure
    displacement_offset: Measure
    force_offset: Measure

    @property
    def measures(self) -> dict[str, Measure]:
        """The measures by name, in order."""
        pairs = ((field.name, getattr(self, field.name)) for field in fields(self))
        return {name: value for name, value in pairs if isinstance(value, Measure)}


_MEASURES = [field.name for field in fields(LoopMeasures) if field.type == "Measure"]


@checked
def loop_measures(
    time: ArrayLike,
    displacement: ArrayLike,
    force: ArrayLike,
    frequency: float | None = None,
    skip: int = 0,
) -> LoopMeasures:
    """Measure the loop of a sinusoidal test, cycle by cycle.

    Parameters
    ----------
    time : array_like, shape (n,), s
        Uniform.
    displacement : array_like, shape (n,), m
        A sinusoid with any offset, slow drift and noise; 16 samples a cycle or more.
    force : array_like, shape (n,), N
    frequency : float, optional, Hz
        Of the test; found from the displacement by default.
    skip : int
        Whole cycles to leave out at the beginning, while the device settles.

    Returns
    -------
    LoopMeasures

    Raises
    ------
    InputError
        If the arrays differ in shape or hold what is not finite, the time is not uniform, the
        displacement is not sinusoidal or too coarsely sampled, or fewer than 3 whole cycles of
        one amplitude are left.
    """
    loops = steady_loops(time, displacement, force, frequency, skip)
    result = _by_harmonics(loops) | _by_force_curves(loops)
    stiffness = result["effective_stiffness"]
    positive = np.where(stiffness > 0, stiffness, np.nan)
    result["damping_ratio"] = result["energy_per_cycle"] / (
        2 * np.pi * positive * loops.ends.amplitude**2
    )
    return LoopMeasures(
        frequency=float(loops.frequency),
        n_cycles=loops.peaks.size,
        n_left_out=loops.n_left_out,
        **{name: _measure(result[name]) for name in _MEASURES},
    )


def _measure(cycles: np.ndarray) -> Measure:
    cycles.flags.writeable = False
    error = np.std(cycles, ddof=1) / np.sqrt(cycles.size)
    return Measure(float(np.mean(cycles)), float(error), cycles)


def _by_harmonics(loops: SteadyLoops) -> dict[str, np.ndarray]:
    """Energy, complex modulus and offsets of each cycle; the jumps' part in closed form."""
    t, x, f, frequency = loops.time, loops.displacement, loops.force, loops.frequency
    f = f - loops.curves.jumps(t)
    rows = []
    for peak in loops.peaks:
        inside = (t >= peak - 0.25 / frequency) & (t < peak + 0.75 / frequency)
        count = min(_HARMONICS_FITTED, int(inside.sum()) // 4)
        xs = harmonics(t[inside], x[inside], frequency, peak, count)[:_HARMONICS]
        fs = harmonics(t[inside], f[inside], frequency, peak, count)[:_HARMONICS]
        energy = np.pi * np.arange(1, xs.size + 1) @ (np.conj(fs) * xs).imag
        modulus = np.conj(fs[0] / xs[0])
        centres = loops.displacement_centre[inside], loops.force_centre[inside]
        rows.append((energy, modulus.real, modulus.imag, *np.mean(centres, axis=1)))
    energy, storage, loss, x_mean, f_mean = np.array(rows).T
    amplitude, jump = loops.ends.amplitude, loops.curves.jump_sizes()[0]
    energy += 4 * jump * amplitude
    loss += 4 * jump / (np.pi * amplitude)
    omega = 2 * np.pi * frequency
    return {
        "energy_per_cycle": energy,
        "equivalent_damping": energy / (np.pi * omega * amplitude**2),
        "storage_stiffness": storage,
        "loss_stiffness": loss,
        "loss_damping": loss / omega,
        "displacement_offset": x_mean,
        "force_offset": f_mean,
    }


def _by_force_curves(loops: SteadyLoops) -> dict[str, np.ndarray]:
    """Measures of each cycle that need the force at a point."""
    top, amplitude = loops.ends.top, loops.ends.amplitude
    f_top, f_bottom = loops.curves.at_ends()
    middle = loops.curves.half_way()
    return {
        "amplitude": amplitude,
        "effective_stiffness": (f_top - f_bottom) / (2 * amplitude),
        "effective_stiffness_half": (f_top - middle) / top,
        "dynamic_stiffness": (loops.curves.extreme(1.0) - middle) / top,
    }
