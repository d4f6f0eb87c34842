"""The contract of a controller.

A controller of one's own is a class with a name and two methods::

    class Outwards(Controller):
        name = "outwards"
        period = 0.1

        def measures(self, nominal):
            return ("base_displacement_m", "base_velocity_m_s")

        def current(self, t, measurement):
            moving_away = measurement.base_displacement_m * measurement.base_velocity_m_s > 0
            return 3.0 if moving_away else 0.0

Settings are declared with ``setting`` and given by name, ``Outwards(period=0.05)``. A class may
name sets of them in ``presets``, which are chosen by ``Outwards(preset="...")``.
"""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable, Mapping
from inspect import Parameter, Signature, signature
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from isolation_sim.errors import InputError, check_name
from isolation_sim.simulation.control import CompiledDecision, RunContext, Schedule, Sensors
from isolation_sim.structures import IsolatedStructure

from .settings import Number, Optional, Setting

if TYPE_CHECKING:
    from isolation_sim.simulation.result import Run

Trial = Callable[["Controller"], "Run"]
"""Simulates another controller on the same plant, record and driver."""


class Controller:
    """Sets the coil currents of a run.

    A run calls ``prepare``, ``reset``, ``schedule`` and ``compiled``, in this order, before it
    starts; ``current`` at each decision only where the last two return None.

    Attributes
    ----------
    name : str
        Registry name; the class's by default.
    title : str
        Name to print.
    source : str
        Publication behind the rule.
    settings : mapping of str to Setting
        Settings with meaning, unit and default; each is an attribute of the same name.
    presets : mapping of str to mapping
        Named sets of settings, such as ``"published"``; one is chosen by ``preset``.
    period : float or None, s
        Interval between decisions; None for the ground motion's sampling interval.
    preview_time : float, s
        Preview time of the ground motion; 0 for none.
    predicts_switching : bool
        Whether it predicts by the isolators' own switching rule. By default the nominal model of
        others has the instantaneous rule: they compute the current for a force.
    observed_by : str
        The controller that does the same with an observer; empty for none.
    report : object or None
        What its decisions were like in the last run, for those that count something; printed as
        ``str`` after a run.

    Parameters
    ----------
    **settings : object
        Settings by name; ``preset`` names a set of them, to which the others are added.

    Raises
    ------
    InputError
        If there is no such setting or preset, or a setting does not accept the value.
    """

    name: ClassVar[str] = "controller"
    title: ClassVar[str] = ""
    source: ClassVar[str] = ""
    settings: ClassVar[Mapping[str, Setting]] = {
        "period": Setting(
            None,
            "interval between decisions; None for the ground motion's sampling interval",
            Optional(Number(above=0)),
            "s",
        )
    }
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    period: float | None = None
    preview_time: float = 0.0
    predicts_switching: ClassVar[bool] = False
    observed_by: ClassVar[str] = ""
    report: Any = None
    __signature__: ClassVar[Signature]
    """Signature for editors: every setting with its type, unit and default."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        own = vars(cls)
        if "name" not in own:
            cls.name = cls.__name__
        settings: dict[str, Setting] = {}
        for base in reversed(cls.__mro__[1:]):
            settings |= vars(base).get("settings", {})
        for name, value in own.items():
            if isinstance(value, Setting):
                settings[name] = value
            elif name in settings:
                settings[name] = settings[name].with_default(cls.name, name, value)
        cls.settings = settings
        for name, declared in settings.items():
            setattr(cls, name, declared.default)
        measured = own.get("measures")
        if isinstance(measured, tuple | list | str):
            # a text is refused when it is used
            names: Any = measured if isinstance(measured, str) else tuple(measured)
            cls.measures = lambda self, nominal: names  # type: ignore[method-assign]
        if "__init__" in own:
            cls.__init__ = _without_losses(own["__init__"])  # type: ignore[method-assign]
        cls.__signature__ = _signature(cls)

    def __init__(self, **settings: Any) -> None:
        preset = settings.pop("preset", None)
        if preset is not None:
            check_name(f"preset of {self.name}", str(preset), self.presets)
        for name, value in (dict(self.presets.get(preset, {})) | settings).items():
            check_name(f"setting of {self.name}", name, self.settings)
            setattr(self, name, self.settings[name].checked(self.name, name, value))

    def __repr__(self) -> str:
        changed = [
            f"{name}={getattr(self, name)!r}"
            for name, declared in self.settings.items()
            if getattr(self, name) != declared.default
        ]
        return f"{self.name}({', '.join(changed)})"

    def to_dict(self) -> dict[str, Any]:
        """Name and all settings; ``controller(**c.to_dict())`` builds the same again.

        Returns
        -------
        dict of str to object
        """
        return {"name": self.name, **{name: getattr(self, name) for name in self.settings}}

    def in_python(self) -> Controller:
        """Copy that decides in plain Python, interval by interval, even if it need not.

        Returns
        -------
        Controller
            The same rule with the same settings, to step through or to check the other forms.
        """
        twin: Any = copy.copy(self)
        twin.schedule = twin.compiled = lambda context: None
        return twin

    def prepare(self, context: RunContext, trial: Trial) -> None:
        """Learn about plant and ground motion from trial runs; most controllers need none.

        Parameters
        ----------
        context : RunContext
            Information about the run.
        trial : callable
            ``trial(controller)`` simulates another controller on the same plant, ground motion and
            driver and returns its Run.
        """

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Names of the outputs that it wants measured.

        Parameters
        ----------
        nominal : IsolatedStructure
            The model that it may reason with.

        Returns
        -------
        tuple of str
            Such as ``("base_displacement_m",)``; none by default.
        """
        return ()

    def schedule(self, context: RunContext) -> Schedule | None:
        """Commands known before the run.

        Parameters
        ----------
        context : RunContext
            Information about the run.

        Returns
        -------
        Schedule or None
            None if it decides as it goes, as by default.
        """
        return None

    def compiled(self, context: RunContext) -> CompiledDecision | None:
        """Its decision in compiled code.

        Parameters
        ----------
        context : RunContext
            Information about the run.

        Returns
        -------
        CompiledDecision or None
            None if it decides in plain Python, as by default.
        """
        return None

    def reset(self, context: RunContext) -> None:
        """Forget the last run and get ready for the next.

        Parameters
        ----------
        context : RunContext
            Information about the run.
        """

    def cautions(self, context: RunContext, sensors: Sensors) -> list[str]:
        """Warn about its use under the conditions of a run.

        Parameters
        ----------
        context : RunContext
            Information about the run.
        sensors : Sensors
            Noise and delay of the measurements.

        Returns
        -------
        list of str
            One line each, without its name. By default one where an observer is available, by the
            setting ``filter`` or in the controller `observed_by`, and it takes displacements or
            velocities with noise or delay instead.
        """
        motion = ("_displacement_m", "_velocity_m_s")
        measured = any(name.endswith(motion) for name in context.outputs)
        degraded = any(context.delays) or any(sensors.noise.values())
        remedy = 'filter="kalman"' if getattr(self, "filter", "") == "none" else self.observed_by
        if not (remedy and measured and degraded):
            return []
        return [
            "it takes displacements and velocities as they are measured, with noise or delay, and "
            f"may be worse than no current; {remedy} estimates them by an observer"
        ]

    def current(self, t: float, measurement: Any) -> Any:
        """Decide, in plain Python.

        Parameters
        ----------
        t : float, s
            Instant of the decision.
        measurement : named tuple of float
            Its measurements, then the coil currents ``coil0_current_A``, ….

        Returns
        -------
        float or array_like, shape (n_channels,), A
            One current for all coils, or one per coil.
        """
        raise NotImplementedError(f"{self.name} has no method current(t, measurement)")


def _without_losses(init: Callable[..., None]) -> Callable[..., None]:
    """An ``__init__`` that refuses to lose a setting."""

    @functools.wraps(init)
    def with_check(self: Controller, *args: Any, **settings: Any) -> None:
        init(self, *args, **settings)
        for name in settings:
            if name in self.settings and name not in vars(self):
                raise InputError(
                    f"{self.name}: __init__ loses the setting {name}; expected: "
                    "super().__init__(**settings) in it"
                )

    return with_check


def _signature(kind: type[Controller]) -> Signature:
    """Arguments of a class: its settings in place of ``**settings``."""
    own = list(signature(kind.__init__).parameters.values())[1:]
    if not own or own[-1].kind is not Parameter.VAR_KEYWORD:
        return Signature(own)
    settings = [
        Parameter(name, Parameter.KEYWORD_ONLY, default=each.default, annotation=each.annotation)
        for name, each in kind.settings.items()
    ]
    if kind.presets:
        choice: Any = Literal[tuple(kind.presets)] | None
        settings.append(
            Parameter("preset", Parameter.KEYWORD_ONLY, default=None, annotation=choice)
        )
    return Signature([*own[:-1], *settings])


Controller.__signature__ = _signature(Controller)
