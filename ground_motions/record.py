"""A ground motion in one direction: acceleration samples at a fixed step."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ground_motions import checks, integration
from ground_motions.argument_types import checked
from ground_motions.checks import FloatArray
from ground_motions.errors import InputError
from ground_motions.old_names import renamed_arguments, renamed_attribute
from ground_motions.processing import correct_baseline, resample
from ground_motions.units import STANDARD_GRAVITY

if TYPE_CHECKING:
    from ground_motions.spectra import ResponseSpectrum


@renamed_arguments(unit_as_given="file_unit")
@checked
@dataclass(frozen=True, eq=False, repr=False)
class Record:
    """Ground acceleration in one direction, linear between samples, starting from rest.

    Nothing in a record can be changed; every method that alters the motion returns a new record
    whose ``source`` describes its processing.

    Parameters
    ----------
    acceleration : (n,) array_like
        Ground acceleration, m/s2; two samples or more. Stored as a read-only copy.
    dt : float
        Sampling step, s.
    name : str
        Short name, for tables and figures.
    source : str
        Source and processing of the motion.
    file_unit : str
        Unit of the file that the motion was read from; ``acceleration`` itself is always m/s2.

    Raises
    ------
    InputError
        If the acceleration is not one row of two or more finite numbers, or ``dt`` is not above 0.
    """

    acceleration: FloatArray
    dt: float
    name: str = "unnamed"
    source: str = "given as an array"
    file_unit: str = "m/s2"

    unit_as_given = renamed_attribute("unit_as_given", "file_unit")

    def __post_init__(self) -> None:
        samples = checks.finite_row("acceleration (m/s2)", self.acceleration)
        object.__setattr__(self, "acceleration", samples)
        object.__setattr__(self, "dt", checks.positive("dt (s)", self.dt))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Record):
            return NotImplemented
        return self._labels == other._labels and np.array_equal(
            self.acceleration, other.acceleration
        )

    def __hash__(self) -> int:
        return hash((*self._labels, self.acceleration.tobytes()))

    def __len__(self) -> int:
        return len(self.acceleration)

    def __repr__(self) -> str:
        return (
            f"Record({self.name!r}, {len(self)} points, dt={self.dt:g} s, "
            f"duration={self.duration:g} s, pga={self.pga:.4g} m/s2, source={self.source!r})"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        # Through the constructor, so that arrays are read-only again after pickling or copying.
        return Record, (self.acceleration, *self._labels)

    @property
    def _labels(self) -> tuple[float, str, str, str]:
        return self.dt, self.name, self.source, self.file_unit

    @property
    def time(self) -> FloatArray:
        """Time of each sample from the first, s, shape (n,)."""
        return np.arange(len(self)) * self.dt

    @property
    def duration(self) -> float:
        """Time from the first sample to the last, s."""
        return (len(self) - 1) * self.dt

    @cached_property
    def velocity(self) -> FloatArray:
        """Ground velocity, m/s, shape (n,): the exact integral, zero at the first sample."""
        return checks.read_only(integration.velocity(self.acceleration, self.dt))

    @cached_property
    def displacement(self) -> FloatArray:
        """Ground displacement, m, shape (n,): the exact second integral, from rest.

        An uncorrected record drifts; see `baseline_corrected`.
        """
        return checks.read_only(integration.displacement(self.acceleration, self.dt))

    @cached_property
    def pga(self) -> float:
        """Peak ground acceleration, absolute, m/s2."""
        return float(np.max(np.abs(self.acceleration)))

    @cached_property
    def pgv(self) -> float:
        """Peak ground velocity, absolute, m/s, between samples too."""
        return integration.peak_velocity(self.acceleration, self.dt)

    @cached_property
    def pgd(self) -> float:
        """Peak ground displacement, absolute, m, between samples too."""
        return integration.peak_displacement(self.acceleration, self.dt)

    @cached_property
    def _energy(self) -> FloatArray:
        return integration.squared(self.acceleration, self.dt)

    def arias_intensity(self) -> float:
        """Return the Arias intensity, pi / (2 g) times the integral of squared acceleration.

        Returns
        -------
        float
            Arias intensity, m/s, exact for the piecewise-linear motion.

        Notes
        -----
        A. Arias, "A measure of earthquake intensity", in Seismic Design for Nuclear Power Plants,
        MIT Press, 1970. g is standard gravity.
        """
        return float(math.pi / (2.0 * STANDARD_GRAVITY) * self._energy[-1])

    @checked
    def significant_duration(self, low: float = 0.05, high: float = 0.95) -> float:
        """Return the time in which Arias intensity grows from one share to another.

        Parameters
        ----------
        low, high : float
            Shares of the final intensity, 0 <= low < high <= 1.

        Returns
        -------
        float
            Duration, s; the growth is taken as linear within a sample.

        Raises
        ------
        InputError
            If the shares are not in order within [0, 1], or the record is zero throughout.

        Notes
        -----
        M. D. Trifunac and A. G. Brady, Bulletin of the Seismological Society of America 65 (1975)
        581-626.
        """
        low = checks.within("low (share)", low, 0.0, 1.0)
        high = checks.within("high (share)", high, 0.0, 1.0)
        if low >= high:
            raise InputError("low and high (share)", f"{low:g} and {high:g}", "low < high")
        self._require_motion("significant_duration")
        energy = self._energy
        start, end = np.interp([low * energy[-1], high * energy[-1]], energy, self.time)
        return float(end - start)

    @checked
    def resampled(self, dt: float) -> Record:
        """Return the motion at another sampling step.

        Parameters
        ----------
        dt : float
            New sampling step, s.

        Returns
        -------
        Record
            The motion at the new step, up to the last new sample within the old duration.

        Raises
        ------
        InputError
            If ``dt`` is not above 0, or is refused by `ground_motions.processing.resample`.

        Notes
        -----
        A finer step interpolates linearly: by a whole ratio the motion is the very same function
        of time; by another ratio the new samples lie on it but its corners are cut. A coarser
        step low-pass filters first, so that nothing above the new Nyquist frequency folds back.
        """
        dt = checks.positive("dt (s)", dt)
        if math.isclose(dt, self.dt, rel_tol=1e-12):
            return self
        samples = resample(self.acceleration, self.dt, dt)
        return self._derive(samples, f"resampled from {self.dt:g} s to {dt:g} s", dt=dt)

    @checked
    def scaled(self, factor: float) -> Record:
        """Return the motion times a factor.

        Parameters
        ----------
        factor : float
            Factor on the acceleration, dimensionless; negative turns the direction round.

        Returns
        -------
        Record
            The scaled motion.
        """
        factor = checks.number("factor", factor, "a finite number")
        return self._derive(self.acceleration * factor, f"scaled by {factor:.6g}")

    @checked
    def scaled_to_pga(self, pga: float) -> Record:
        """Return the motion scaled to a peak ground acceleration.

        Parameters
        ----------
        pga : float
            Peak ground acceleration to reach, absolute, m/s2.

        Returns
        -------
        Record
            The scaled motion.

        Raises
        ------
        InputError
            If ``pga`` is not above 0, or the record is zero throughout.
        """
        pga = checks.positive("pga (m/s2)", pga)
        self._require_motion("scaled_to_pga")
        # Dividing first makes the peak sample exactly one, so that it then hits the target exactly.
        return self._derive(self.acceleration / self.pga * pga, f"scaled to pga {pga:g} m/s2")

    @checked
    def scaled_to_sa(self, sa: float, period: float, damping: float = 0.05) -> Record:
        """Return the motion scaled to a pseudo-acceleration at one period.

        Parameters
        ----------
        sa : float
            Pseudo-spectral acceleration to reach, m/s2.
        period : float
            Undamped natural period, s; 0 means the peak ground acceleration.
        damping : float
            Damping ratio, 0 <= damping < 1.

        Returns
        -------
        Record
            The scaled motion.

        Raises
        ------
        InputError
            If an argument is out of range, or the record is zero throughout.
        """
        sa = checks.positive("sa (m/s2)", sa)
        self._require_motion("scaled_to_sa")
        present = float(self.spectrum([period], damping).psa[0])
        return self._derive(
            self.acceleration * (sa / present),
            f"scaled to sa {sa:g} m/s2 at {period:g} s, damping {damping:g}",
        )

    @checked
    def baseline_corrected(self, order: int = 1, highpass_hz: float | None = None) -> Record:
        """Return the motion without drift: it ends with zero velocity.

        Parameters
        ----------
        order : int
            Degree of the polynomial taken from the acceleration, 0 to 10. Of all polynomials that
            bring the final velocity to zero, the one that leaves the least mean-square velocity
            is taken.
        highpass_hz : float, optional
            Corner of a fourth-order Butterworth high-pass run forwards and backwards (zero phase,
            -6 dB at the corner) over the zero-padded motion, Hz. Default none.

        Returns
        -------
        Record
            The corrected motion, same length.

        Raises
        ------
        InputError
            If ``order`` is not a whole number from 0 to 10, or ``highpass_hz`` is not between 0
            and the Nyquist frequency.

        Notes
        -----
        Pads as D. M. Boore, Bulletin of the Seismological Society of America 95 (2005) 745-750;
        least velocity as G. V. Berg and G. W. Housner, ibid. 51 (1961) 175-189.
        """
        samples = correct_baseline(self.acceleration, self.dt, order, highpass_hz)
        step = f"order {order}" + (f", high-pass {highpass_hz:g} Hz" if highpass_hz else "")
        return self._derive(samples, f"baseline corrected ({step})")

    @checked
    def padded(self, before: float = 0.0, after: float = 0.0) -> Record:
        """Return the motion with quiet ground before and after it.

        The acceleration is linear between samples. A first or last sample other than 0 therefore
        adds a velocity of half a step times this sample, also to a motion of zero final velocity.

        Parameters
        ----------
        before, after : float
            Time of zero acceleration to add, s; rounded up to whole steps.

        Returns
        -------
        Record
            The longer motion.

        Raises
        ------
        InputError
            If either is negative.
        """
        counts = [
            checks.whole_steps(checks.within(name, value, 0.0, math.inf), self.dt)
            for name, value in (("before (s)", before), ("after (s)", after))
        ]
        samples = np.pad(self.acceleration, counts)
        return self._derive(samples, f"padded by {before:g} s and {after:g} s")

    @checked
    def cut(self, start: float = 0.0, stop: float | None = None) -> Record:
        """Return the part of the motion between two times; its own time starts at zero.

        Parameters
        ----------
        start, stop : float
            First and last time to keep, s; samples at these times stay. ``stop`` defaults to the
            end.

        Returns
        -------
        Record
            The shorter motion. It starts from rest, whatever the velocity was at ``start``.

        Raises
        ------
        InputError
            If the times are out of order or outside the record, or fewer than two samples remain.
        """
        stop = self.duration if stop is None else stop
        end = self.duration * (1.0 + 1e-12)
        start = checks.within("start (s)", start, 0.0, end)
        stop = checks.within("stop (s)", stop, 0.0, end)
        first = checks.whole_steps(start, self.dt)
        last = math.floor(stop / self.dt * (1.0 + 1e-12))
        if last <= first:
            raise InputError(
                "start and stop (s)",
                f"{start:g} and {stop:g}",
                f"start < stop with two samples or more between them (dt {self.dt:g} s)",
            )
        return self._derive(self.acceleration[first : last + 1], f"cut to {start:g}-{stop:g} s")

    @checked
    def spectrum(self, periods: npt.ArrayLike, damping: float = 0.05) -> ResponseSpectrum:
        """Return the response spectrum; see `ground_motions.spectra.response_spectrum`.

        Parameters
        ----------
        periods : (m,) array_like
            Undamped natural periods, s; 0 means a rigid oscillator.
        damping : float
            Damping ratio, 0 <= damping < 1.

        Returns
        -------
        ResponseSpectrum
            Peaks of the relative displacement (m) and velocity (m/s), the absolute acceleration
            (m/s2) and the pseudo-values, each (m,).
        """
        from ground_motions.spectra import response_spectrum

        return response_spectrum(self, periods, damping)

    def _derive(self, acceleration: FloatArray, step: str, dt: float | None = None) -> Record:
        return replace(
            self,
            acceleration=acceleration,
            dt=self.dt if dt is None else dt,
            source=f"{self.source}; {step}",
        )

    def _require_motion(self, method: str) -> None:
        if self.pga == 0.0:
            raise InputError(
                f"{method} of record {self.name!r}", "zero throughout", "a sample other than 0"
            )
