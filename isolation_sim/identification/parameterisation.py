"""A law's parameters over the current as the unknowns of a fit, with sizes and bounds."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, unknown_name
from ..laws import CurrentDependence, Device
from ..laws import law as published
from ..laws.law import Law, StateScaling
from .characteristic_scales import characteristic_scale
from .current_basis import bernstein
from .least_squares import at_bound

_VANISHING = 0.02
"""Part of its mean over the currents below which a parameter vanishes at one. Convention."""
_ON = 0.1
"""Share of its start with which a parameter is fitted again."""
_LOST = 100.0
"""Multiple of its size from which a parameter is lost: a dashpot or a spring has become rigid, or
nothing depends on what the law divides by. Convention."""
_DECADES = (0.7, 1.5)
"""Reach of random starts about the data's magnitude: near and far by turns."""


class Parameterisation:
    """Bernstein coefficients of a law's free parameters over a range of the current."""

    # The coefficients' bounds hold for the polynomial at every current in the range.

    def __init__(
        self,
        law: Law,
        # (n_powers,): Currents at which the polynomials are reported, increasing, A
        currents: NDArray,
        sizes: tuple[float, float, float],  # Of the data: force (N), deformation (m) and time (s)
        # mapping of str to float or (n,): Parameters that are not free, SI: constants, or ascending
        # powers of the current
        fixed: Mapping[str, float | NDArray] | None = None,
        # (float, float): Range of the current in which the bounds hold, A; from the first to the
        # last of ``currents`` by default
        span: tuple[float, float] | None = None,
        # Of a state, to 1 at most, which makes one parameter a sum of others
        scaling: StateScaling | None = None,
    ):
        self.law, self.currents, self.sizes = law, currents, sizes
        self.span = span or (float(currents[0]), float(currents[-1]))
        self.fixed, self.scaling = dict(fixed or {}), scaling
        tied = {scaling.tied: scaling.terms} if scaling is not None else {}
        self._units = {q.name: q.unit for q in law.parameters}
        if scaling is not None:
            self._units |= scaling.units
        for name in self.fixed:
            if name not in law.parameter_names:
                raise unknown_name(f"parameter of {law.name}", name, law.parameter_names)
        # The free parameters
        self.free = tuple(q for q in law.parameters if q.name not in self.fixed | tied)
        n, names = len(currents), law.parameter_names
        # (n_powers, n_powers): Bernstein coefficients to values at ``currents``
        self.basis = bernstein(currents, self.span)
        self._to_powers = np.linalg.solve(np.vander(currents, increasing=True), self.basis)
        self.n_powers = n  # Coefficients of each parameter
        # scale, lower, upper: (n_unknowns,): Size by the data, and bounds; one free parameter's
        # coefficients after another's
        sized = [characteristic_scale(self._units[q.name], *sizes) for q in self.free]
        self.scale = np.repeat(sized, n)
        # (n_unknowns,): Place of the exponent n in a unit such as 1/m^n, -1 without one; size of
        # the unit's other part
        self._exponent, self._rest = np.full(len(self.scale), -1), np.ones(len(self.scale))
        places = {q.name: k * n for k, q in enumerate(self.free)}
        for name, at in places.items():
            for power in places.keys() & set(re.findall(r"\^([a-z]\w*)", self._units[name])):
                rest = characteristic_scale(self._units[name], *sizes, exponents={power: 0.0})
                self._exponent[at : at + n] = places[power] + np.arange(n)
                self._rest[at : at + n] = rest
        # (n_coefficients, n_unknowns): Derivatives of the coefficients by the unknowns
        self.spread = np.zeros((len(names) * n, len(self.free) * n))
        for k, quantity in enumerate(self.free):
            at = names.index(quantity.name) * n
            self.spread[at : at + n, k * n : (k + 1) * n] = self._to_powers
            for name, terms in tied.items():
                at = names.index(name) * n
                factor = terms.get(quantity.name, 0.0)
                self.spread[at : at + n, k * n : (k + 1) * n] = factor * self._to_powers
        self._offset = np.zeros(len(names) * n)
        for name, value in self.fixed.items():
            powers = np.atleast_1d(value)
            self._offset[names.index(name) * n : names.index(name) * n + len(powers)] = powers
        self.lower = np.repeat([q.lower for q in self.free], n)
        self.upper = np.repeat([q.upper for q in self.free], n)
        # a parameter that the law divides by stays clear of zero, also by rounding: where it is
        # huge at one current, its powers of the current may cancel at another
        divides = np.array([q.divides for q in self.free], dtype=bool)
        guarded = np.repeat(divides, n) & (self.lower == 0)
        # whatever the exponent is of a unit that has one
        least, most = {q.name: q.lower for q in self.free}, {q.name: q.upper for q in self.free}
        ends = np.repeat([
            [characteristic_scale(self._units[q.name], *sizes, exponents=end) for q in self.free]
            for end in (least, most)
        ], n, axis=1)  # fmt: skip
        self.lower[guarded] = 1e-6 * ends.min(axis=0)[guarded]
        self.upper[guarded] = np.minimum(self.upper[guarded], 1e7 * ends.max(axis=0)[guarded])

    def deviations(self, values: NDArray, expected: NDArray) -> tuple[NDArray, NDArray]:
        """Deviations from expected unknowns over their sizes, and derivatives by the unknowns."""
        # A number in 1/m^n changes by powers of ten with n. It is compared with a power of the
        # length that it is expected to stand for.
        size = np.maximum(np.abs(expected), 0.1 * self.scale)
        places = np.flatnonzero((self._exponent >= 0) & (expected[self._exponent] > 0))
        exponents = self._exponent[places]
        rate = np.log(size[places] / self._rest[places]) / expected[exponents]
        unit = np.ones(len(expected))
        unit[places] = np.exp(rate * (values - expected)[exponents])
        slopes = np.diag(1 / (size * unit))
        slopes[places, exponents] -= rate * (values / (size * unit))[places]
        return (values / unit - expected) / size, slopes

    def coefficients(self, parameterisation: NDArray) -> NDArray:
        """Coefficients of all parameters, ascending powers of the current."""
        return self.spread @ parameterisation + self._offset

    def dependence(self, parameterisation: NDArray) -> CurrentDependence:
        """Parameters against the current."""
        names = self.law.parameter_names
        rows = self.coefficients(parameterisation).reshape(len(names), -1)
        return CurrentDependence.polynomial(dict(zip(names, rows.tolist(), strict=True)))

    def steady(self) -> Parameterisation:
        """Return the unknowns of the same law with parameters that do not depend on the current."""
        mean = np.array([np.mean(self.currents)])
        fixed = {
            name: float(np.polynomial.polynomial.polyval(mean[0], np.atleast_1d(value)))
            for name, value in self.fixed.items()
        }
        # currents that change within runs determine the scale of a state, but not here
        redundancy = self.law.redundancy
        if redundancy is not None and self.scaling is None:
            name = redundancy.held
            if not fixed.keys() & set(redundancy.among):
                size = characteristic_scale(self._units[name], *self.sizes)
                fixed[name] = redundancy.value * size if redundancy.of_data else size
        return Parameterisation(self.law, mean, self.sizes, fixed, scaling=self.scaling)

    def holding(self) -> Parameterisation | None:
        """Return the unknowns with a redundant parameter held; None if no state is scaled."""
        redundancy = self.law.redundancy
        if self.scaling is None or redundancy is None:
            return None
        fixed = self.fixed | {redundancy.held: redundancy.value}
        return Parameterisation(self.law, self.currents, self.sizes, fixed, self.span)

    def of(self, device: Device, bounded: bool = True) -> NDArray:
        """Unknowns with which the parameters are those of a device at ``currents``."""
        return self._of(device.current, bounded)

    def convert(self, values: NDArray, other: Parameterisation) -> NDArray:
        """Unknowns with which the law does the same as with other unknowns at ``currents``."""
        return self._of(other.dependence(values), True)

    def _of(self, current: CurrentDependence, bounded: bool) -> NDArray:
        values = dict(zip(self.law.parameter_names, current.at(self.currents), strict=True))
        values |= self._same_scale(values)
        chosen = [np.linalg.solve(self.basis, values[q.name]) for q in self.free]
        start = np.concatenate(chosen) if chosen else np.zeros(0)
        return np.clip(start, self.lower, self.upper) if bounded else start

    def _same_scale(self, values: Mapping[str, NDArray]) -> dict[str, NDArray]:
        """Redundant parameters that do the same, scaled as the unknowns are."""
        redundancy = self.law.redundancy
        if self.scaling is not None:
            return self.scaling.scaled(values)
        if redundancy is None or redundancy.scaling is None:
            return {}
        held = [name for name in redundancy.among if name in self.fixed]
        if len(held) != 1:
            return {}
        value = np.polynomial.polynomial.polyval(self.currents, np.atleast_1d(self.fixed[held[0]]))
        return redundancy.scaling.holding(held[0], value, values)

    def switched_on(self, start: NDArray, end: NDArray) -> NDArray | None:
        """Return the end of a search with some of what it has switched off; None if nothing is."""
        # An element that began too strong is at zero for all currents, or its divisor so large, and
        # may stay there although a weaker one would help: nothing depends on it.
        from_zero = np.array([q.lower == 0 for q in self.free])
        divides = np.array([q.divides for q in self.free])
        off = from_zero & self._at_all_currents((end <= self.lower) & (start > self.lower))
        large = from_zero & divides & self._lost(end)
        if not (off | large).any():
            return None
        gone, lost = (np.repeat(one, len(self.currents)) for one in (off, large))
        again = np.where(gone, np.clip(_ON * start, self.lower, self.upper), end)
        return np.where(lost, self.scale, again)

    def with_every_element(self, values: NDArray) -> NDArray | None:
        """Return unknowns without parameters that vanish at some currents, or are lost.

        None if there are none.
        """
        # where an element is off or rigid nothing depends on it or on its other parameters, and a
        # search stays there
        rows = values.reshape(len(self.free), -1)
        mean = rows.mean(axis=1, keepdims=True)
        from_zero = np.array([q.lower == 0 for q in self.free])[:, None]
        vanishing = from_zero & (rows.min(axis=1, keepdims=True) < _VANISHING * mean)
        lost = from_zero & self._lost(values)[:, None]
        if not (vanishing | lost).any():
            return None
        sizes = self.scale.reshape(rows.shape)
        return np.where(lost, sizes, np.where(vanishing, mean, rows)).ravel()

    def ends_at_bound(self, values: NDArray) -> bool:
        """Whether a parameter is at a bound at all currents."""
        each = zip(values, self.lower, self.upper, self.scale, strict=True)
        return bool(self._at_all_currents(np.array([at_bound(*one) for one in each])).any())

    def _lost(self, values: NDArray) -> NDArray:
        return self._at_all_currents(values > _LOST * self.scale)

    def _at_all_currents(self, chosen: NDArray) -> NDArray:
        """Free parameters, (n_free,) bool, all of whose unknowns are chosen, (n_unknowns,) bool."""
        return np.asarray(chosen.reshape(len(self.free), -1).all(axis=1))

    def starts(self, number: int, seed: int) -> list[NDArray]:
        """Published numbers, if there are any, then random ones of the data's magnitude."""
        random = np.random.default_rng(seed)
        begin = []
        try:
            begin.append(self.of(published(self.law)))
        except InputError:
            pass  # a law without published numbers
        while len(begin) < number:
            drawn = self._drawn(random, _DECADES[len(begin) % 2])
            begin.append(np.clip(np.repeat(drawn, len(self.currents)), self.lower, self.upper))
        return begin

    def _drawn(self, random: np.random.Generator, decades: float) -> list[float]:
        """A random number for each free parameter."""
        bounded = {
            q.name: _between(q.lower, q.upper, random)
            for q in self.free
            if np.isfinite(q.lower) and np.isfinite(q.upper)
        }
        # a unit such as 1/m^n means another size for every n
        exponents = {name: float(np.take(value, 0)) for name, value in self.fixed.items()} | bounded
        drawn = []
        for quantity in self.free:
            unit = self._units[quantity.name]
            size = characteristic_scale(unit, *self.sizes, exponents=exponents)
            size *= 10 ** random.uniform(-decades, decades)
            if quantity.lower < 0:
                size *= random.uniform(-1, 1)
            drawn.append(bounded.get(quantity.name, max(size, quantity.lower)))
        return drawn


def _between(lower: float, upper: float, random: np.random.Generator) -> float:
    """A random number between bounds, as likely in every octave where they are positive."""
    if lower > 0:
        return float(np.exp(random.uniform(np.log(lower), np.log(upper))))
    return float(random.uniform(lower, upper))
