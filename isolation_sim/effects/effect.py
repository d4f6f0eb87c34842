"""The contract of an effect: something that a law may lack, written once.

An effect modifies a law. It may change the motion or the current that the law sees, multiply
the law's force, or add a force of its own; each of these is a function of the same form, and all
may use the effect's own states. ``extend`` puts effects and a law together into a law again, which
is simulated, traced and fitted like any other; the diagnosis evaluates the same functions, stage
by stage, along measured runs.

The functions may use the operations listed in ``isolation_sim.laws.law``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from ground_motions.argument_types import checked
from ground_motions.old_names import renamed_arguments, renamed_attribute

from ..laws.law import Quantity

REFERENCE_TEMPERATURE = 20.0
"""deg C: where an effect of the temperature leaves the law as it is."""


class Signals(NamedTuple):
    """Signals of an effect at an instant.

    Attributes
    ----------
    x, v, a : float, m, m/s, m/s^2
        Deformation of the device, its velocity and acceleration.
    current : float, A
        Coil current.
    force : float, N
        Force of the law before any effect multiplies it; 0 where an effect changes what the law
        sees.
    temperature : float, deg C
        Of the surroundings.
    """

    x: Any
    v: Any
    a: Any
    current: Any
    force: Any
    temperature: Any


class Past(NamedTuple):
    """Measured history of a device before a test.

    Attributes
    ----------
    deformation : float, m
        Largest deformation.
    travel : float, m
        Path length.
    current : float, A
        Largest coil current.
    work : float, J
        Work done on the device, without the work that it gave back.
    dissipated : float, J
        Work done on the device, less the work that it gave back.
    cycles : float, 1
        Cycles, half of one at each passage through the middle.
    """

    deformation: Any
    travel: Any
    current: Any
    work: Any
    dissipated: Any
    cycles: Any


@renamed_arguments(strength="magnitude")
@checked
@dataclass(frozen=True)
class EffectParameter(Quantity):
    """A parameter of an effect.

    Attributes
    ----------
    magnitude : bool
        Whether the law is left as it is where this parameter is zero; every effect has one such.
    starts : tuple of float
        Values from which a fit may start: in the unit itself for times (s) and pure numbers, else
        as multiples of the data's size of that unit (largest deformation, RMS force, ...).
    least : float
        Bound below its first value, as a multiple of the data's size of that unit: what lies below
        is another effect.
    most : float
        Bound of its size, as a multiple of the data's size of that unit: what lies beyond is
        another effect.
    difference : float
        Relative step of differences by it. A contact that begins between two samples asks for
        a larger one.
    plain : tuple of float
        Bounds at which the effect is a plainer one of the same cause, such as an exponent of 1: a
        fit that ends there is as sound as inside.
    other : tuple of float
        Bounds at which the effect is one of another cause, such as a relaxation that takes for
        ever: a fit that ends there is no sign of this one. Infinity stands for the bound by
        ``most``.
    """

    magnitude: bool = False
    starts: tuple[float, ...] = (1.0,)
    least: float = 0.0
    most: float = float("inf")
    difference: float = 1e-4
    plain: tuple[float, ...] = ()
    other: tuple[float, ...] = ()

    strength = renamed_attribute("strength", "magnitude")


class EffectInPlan(NamedTuple):
    """Functions of an effect over two horizontal directions.

    They are those of ``Effect``, but for signals whose ``x``, ``v`` and ``force`` are tuples. The
    states are the same, once for both directions. Along a line they must give what the effect
    itself gives.

    Attributes
    ----------
    rates, factor : callable or None
        As in ``Effect``.
    force : callable or None
        -> tuple of the forces added along x and y, N.
    """

    rates: Callable[..., tuple] | None = None
    factor: Callable[..., Any] | None = None
    force: Callable[..., tuple] | None = None


def in_sentence(name: str) -> str:
    """A cause or an effect's title as it stands within a sentence."""
    words = name.replace("_", " ")
    return f"{words[:1].lower()}{words[1:]}".replace("coulomb", "Coulomb")


@checked
@dataclass(frozen=True, eq=False)
class Effect:
    """One form of one cause; an effect is equal to itself alone.

    Every function below takes ``(signals, states, parameters)``; those left None do nothing.

    Attributes
    ----------
    cause : str
        Its name in a diagnosis.
    form : str
        Which way of writing the cause it is.
    title : str
        Name to print.
    parameters : tuple of EffectParameter
        One of them its magnitude.
    states : tuple of Quantity
        Internal states; zero at rest without current.
    start : callable or None
        ``start(signals, parameters)`` -> states at the start of a test, from its first signals;
        zeros where None.
    carried : callable or None
        ``carried(past, parameters)`` -> the least values of the states at the start of a test of a
        device with a ``Past``; None where the past does not determine them.
    recovery : callable or None
        ``recovery(parameters)`` -> time constant, s, with which the only state h falls at rest. Of
        unknown rests, ``carried`` is then the largest value. For effects that leave exp(-h) of the
        force, or of all but the part ``spared``.
    spared : callable or None
        ``spared(signals, parameters)`` -> part of the law's force that such an effect does not
        weaken, N, linear in the parameters; none of it where None.
    rates : callable or None
        -> tuple of the states' time derivatives.
    motion : callable or None
        -> (x, v) that the law sees, m and m/s.
    delay : callable or None
        ``delay(parameters)`` -> time, s, by which the motion that the law sees is late. Along a
        measured run that motion itself is taken; ``motion`` stands for it where only an instant is
        known, as in a simulation.
    current : callable or None
        -> current that the law sees, A.
    time_scale : callable or None
        -> factor of all times of the law, 1, by which its states relax more slowly and its dashpots
        resist more; of signals and parameters alone. Along a measured run it is the run's mean.
    factor : callable or None
        -> factor of the law's force, 1.
    force : callable or None
        -> force added, N.
    stored_energy : callable or None
        ``stored_energy(x, states, parameters)`` -> J, of an added force that could give some back.
    needs : frozenset of str
        Signals it uses beyond the motion: "acceleration", "temperature", the law's "force".
        "current" if a factor or an added force depends on it; a device without coil then needs one.
    gradual : bool
        Whether it builds up over a whole test, so that its states begin with the first sample of a
        run that was cut out of steady cycles.
    of_device : bool
        False for effects in the instruments of a test and not in the device: it belongs to
        the measured data and is left out of a law that is used elsewhere.
    alike : str
        What else makes the force look so, to check before it is believed; empty if nothing is
        known.
    source : str
        Publication behind it.
    plan : EffectInPlan or None
        Its functions over two horizontal directions, for biaxial devices.
    """

    cause: str
    form: str
    title: str
    parameters: tuple[EffectParameter, ...]
    states: tuple[Quantity, ...] = ()
    start: Callable[..., tuple] | None = None
    carried: Callable[..., tuple] | None = None
    recovery: Callable[..., Any] | None = None
    spared: Callable[..., Any] | None = None
    rates: Callable[..., tuple] | None = None
    motion: Callable[..., tuple] | None = None
    delay: Callable[..., Any] | None = None
    current: Callable[..., Any] | None = None
    time_scale: Callable[..., Any] | None = None
    factor: Callable[..., Any] | None = None
    force: Callable[..., Any] | None = None
    stored_energy: Callable[..., Any] | None = None
    needs: frozenset[str] = frozenset()
    gradual: bool = False
    of_device: bool = True
    alike: str = ""
    source: str = ""
    plan: EffectInPlan | None = None

    @property
    def name(self) -> str:
        """Cause and form."""
        return f"{self.cause}.{self.form}"

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters, in order."""
        return tuple(quantity.name for quantity in self.parameters)

    strength = renamed_attribute("strength", "magnitude")

    @property
    def is_before_law(self) -> bool:
        """Whether it changes what the law sees, so that the law has to be simulated again."""
        return any(one is not None for one in (self.motion, self.current, self.time_scale))

    @property
    def records_force(self) -> bool:
        """Whether it is an instrument's, and follows the force of the device with its effects."""
        return not self.of_device and "force" in self.needs

    @property
    def magnitude(self) -> int:
        """Place of the magnitude among the parameters."""
        return next(k for k, q in enumerate(self.parameters) if q.magnitude)
