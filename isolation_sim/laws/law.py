"""The interface of a law: the arithmetic of force and states, written once.

NumPy calls it on arrays, CasADi traces it, and the compiled kernels are written out from that
trace. What all three accept: ``+ - * / **``, comparisons used as multipliers, tuples, and ``np.sinh
cosh tanh exp expm1 log log1p sqrt sin cos arctan arcsinh sign fabs fmax fmin hypot copysign floor
power``. Not: ``if``, builtin ``abs`` or ``max``, ``np.where``, ``np.maximum``, ``math.*``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ground_motions.argument_types import checked

from ..errors import InputError


@checked
@dataclass(frozen=True)
class Quantity:
    """A state or a parameter of a law.

    Attributes
    ----------
    name : str
        Its symbol in the equations, as text.
    unit : str
        SI unit.
    meaning : str
        Short description.
    lower, upper : float
        Bounds within which the law is meaningful, in ``unit``.
    divides : bool
        Whether the law divides by it, so that zero is refused.
    """

    name: str
    unit: str
    meaning: str
    lower: float = -np.inf
    upper: float = np.inf
    divides: bool = False


@dataclass(frozen=True)
class Spring:
    """A spring in a law, whose force and energy grow in proportion to one parameter."""

    # The parameter; force and rates are linear in it, and the stored energy is its multiple
    stiffness: str
    # What it stretches by: ``"x"`` for the device's deformation, or a state that is nothing but
    # this spring's extension; several where several springs share the parameter
    extensions: tuple[str, ...]
    # State to take from ``"x"``, the extension of what stands in series; empty for none
    less: str = ""
    # Power of the extension to which the force grows, or the parameter that is this power
    power: float | str = 1.0


@dataclass(frozen=True)
class StateScaling:
    """How a factor on a state moves between redundant parameters."""

    tied: str  # With the state scaled to 1 at most, this parameter is a sum of others
    terms: Mapping[str, float]  # Factors of the others
    units: Mapping[str, str]  # Units of the parameters for a state of unit 1
    largest: Callable[[Mapping[str, NDArray]], NDArray]  # Of the state, from the parameters
    # Powers of a factor on the state with which each parameter changes
    powers: Callable[[Mapping[str, NDArray]], Mapping[str, Any]]

    def scaled(self, values: Mapping[str, NDArray]) -> dict[str, NDArray]:
        """Parameters with a state of 1 at most."""
        with np.errstate(all="ignore"):
            return self._changed(values, 1 / self.largest(values))

    def holding(
        self, name: str, value: NDArray, values: Mapping[str, NDArray]
    ) -> dict[str, NDArray]:
        """Parameters that do the same, one of them at given values."""
        with np.errstate(all="ignore"):
            factor = (value / values[name]) ** (1 / self.powers(values)[name])
        return self._changed(values, factor)

    def _changed(self, values: Mapping[str, NDArray], factor: NDArray) -> dict[str, NDArray]:
        # a state that stays zero has no scale
        factor = np.where(np.isfinite(factor) & (factor > 0), factor, 1.0)
        powers = self.powers(values)
        return {name: values[name] * factor**power for name, power in powers.items()}


@dataclass(frozen=True)
class Redundancy:
    """Parameters of which one is redundant, since scaling a state moves a factor between them."""

    # At constant currents a fit that leaves all of them free has no single answer. Where they
    # follow the current, answers that agree at the tested currents differ widely between these. A
    # current that changes within a run tells them apart, for the state is kept and not scaled.

    # The parameter that a fit to constant currents holds, unless it holds another one of them
    held: str
    value: float  # Value at which it is held, in its SI unit; see ``of_data``
    among: tuple[str, ...]  # The parameters
    # With the state scaled to 1 at most the parameters follow the current more simply
    scaling: StateScaling | None = None
    of_data: bool = False  # Whether the value is a multiple of the data's RMS force


class InPlan(NamedTuple):
    """Functions of a law over two horizontal directions."""

    # As in ``Law``, but for tuples of deformations, velocities and forces; the states along x, then
    # those along y. Along a line they must give what the law itself gives. The energy is None where
    # no such function is known.

    force: Callable[..., tuple]
    rates: Callable[..., tuple]
    stored_energy: Callable[..., Any] | None


def no_rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
    """Rates of a law without internal states: an empty tuple."""
    return ()


@checked
@dataclass(frozen=True, eq=False)
class Law:
    """Arithmetic of a device; a law is equal to itself alone.

    Attributes
    ----------
    name : str
        Registry name.
    title : str
        Name to print.
    parameters, states : tuple of Quantity
        Names that the functions below unpack, in this order.
    force : callable
        ``force(x, v, states, parameters)`` -> N, for deformation x (m) and velocity v (m/s).
    rates : callable
        ``rates(x, v, states, parameters)`` -> tuple of the states' time derivatives.
    stored_energy : callable or None
        ``stored_energy(x, states, parameters)`` -> J, what the device could give back; None where
        no such function is known: the ledger then books the device's whole work as dissipated.
    source : str
        Paper and equations.
    springs : tuple of Spring
        All that stores energy, where it is springs alone: what the passive switching rule needs.
    rest : callable or None
        ``rest(parameters)`` -> states of the undeformed device long after the current was set;
        None where they are zero.
    field_power : callable or None
        ``field_power(x, states, parameters)`` -> W, what a change of the field does on the stored
        energy, in a law that holds the field among its states.
    redundancy : Redundancy or None
        Parameters of which one is redundant.
    smoothing : mapping of str to float
        Parameters that only round a corner off, with the values at which a fit holds them.
    example : mapping of str to float or tuple of float
        Numbers of a small device for examples and tests: constants, or ascending powers of the
        current, in SI units. A law with a published set needs none.
    sets : mapping of str to callable
        Published parameter sets by name, the default one first: functions that return a ``Device``.
    conditions : mapping of str to callable
        The same for sets that were published for a single loading condition each.
    unit : str
        File of a functional mock-up unit that sets the state, the force, in a run; empty for
        arithmetic.
    unit_variables : mapping of str to str
        ``displacement_m``, ``velocity_m_s``, ``current_A``, ``force_N`` by the unit's own names,
        where these are others.
    directions : int
        Number of deformations that the functions take and of forces that they return. Above one,
        ``x``, ``v`` and the force are tuples: along x, along y and, where there are three, the
        change of the vertical load over its mean, along which there is no force.
    plan : InPlan or None
        Its functions over two horizontal directions that act on each other.
    axial : InPlan or None
        The same with the change of the vertical load over its mean as a third deformation.
    """

    name: str
    title: str
    parameters: tuple[Quantity, ...]
    force: Callable[..., Any]
    states: tuple[Quantity, ...] = ()
    rates: Callable[..., tuple] = no_rates
    stored_energy: Callable[..., Any] | None = None
    source: str = ""
    springs: tuple[Spring, ...] = ()
    rest: Callable[[tuple], tuple] | None = None
    field_power: Callable[..., Any] | None = None
    redundancy: Redundancy | None = None
    smoothing: Mapping[str, float] = field(default_factory=dict, repr=False)
    example: Mapping[str, float | tuple[float, ...]] = field(default_factory=dict, repr=False)
    sets: Mapping[str, Callable[[], Any]] = field(default_factory=dict, repr=False)
    conditions: Mapping[str, Callable[[], Any]] = field(default_factory=dict, repr=False)
    unit: str = ""
    unit_variables: Mapping[str, str] = field(default_factory=dict, repr=False)
    directions: int = 1
    plan: InPlan | None = field(default=None, repr=False)
    axial: InPlan | None = field(default=None, repr=False)

    @cached_property
    def in_plan(self) -> Law:
        """The law in two horizontal directions; its states are those along x, then along y."""
        return self._over(self.plan, 2)

    @cached_property
    def under_axial_load(self) -> Law:
        """The law in two horizontal directions, under a vertical load that changes."""
        return self._over(self.axial, 3)

    def _over(self, functions: InPlan | None, directions: int) -> Law:
        if functions is None:
            loaded = " under a vertical load that changes" if directions == 3 else ""
            raise InputError(
                f"law {self.name!r} has no form in two directions{loaded}; expected: one of those "
                "that isolation-sim list laws calls biaxial"
            )
        states = tuple(
            replace(state, name=f"{state.name}_{axis}", meaning=f"{state.meaning}, along {axis}")
            for axis in "xy"
            for state in self.states
        )
        return replace(
            self, states=states, directions=directions, springs=(), rest=None, field_power=None,
            plan=None, axial=None, **functions._asdict(),
        )  # fmt: skip

    def respond(self, x: Any, v: Any, states: tuple, parameters: tuple) -> tuple[tuple, tuple]:
        """Forces along every direction, and rates of the states, whatever the directions.

        Parameters
        ----------
        x : tuple of float or numpy.ndarray, one entry a direction, m
            Deformations.
        v : tuple of float or numpy.ndarray, one entry a direction, m/s
            Their velocities.
        states : tuple, one entry a state
            Internal states, in their units.
        parameters : tuple, one entry a parameter
            In the law's order and SI units.

        Returns
        -------
        forces : tuple, one entry a direction
            In N.
        rates : tuple, one entry a state
            Time derivatives of the states.
        """
        if self.directions == 1:
            (x,), (v,) = x, v
            forces = (self.force(x, v, states, parameters),)
        else:
            forces = tuple(self.force(x, v, states, parameters))
        return forces, tuple(self.rates(x, v, states, parameters))

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters, in the law's order."""
        return tuple(quantity.name for quantity in self.parameters)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the internal states, in the law's order."""
        return tuple(quantity.name for quantity in self.states)
