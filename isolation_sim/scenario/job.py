"""A scenario ready to run: plant, ground motion, controllers and options."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ground_motions import Record

from ..errors import Diverged, InputError, RefusedCurrent
from ..structures import IsolatedStructure

if TYPE_CHECKING:
    from ..simulation.control import Control
    from ..simulation.result import Run


@dataclass(frozen=True, eq=False)
class Job:
    """Runs of several controllers on one plant under one ground motion.

    Attributes
    ----------
    source : str
        Scenario file, for error messages; empty for a scenario made in Python.
    isolated : IsolatedStructure
        The plant.
    records : tuple of Record
        Ground motion, one per direction.
    controllers : dict of str to Control
        By the name to print.
    options : dict of str to object
        Keyword arguments of ``isolation_sim.simulation.run.simulate``.
    fixed_base : bool
        Whether the building without isolation is simulated, too.
    """

    source: str
    isolated: IsolatedStructure
    records: tuple[Record, ...]
    controllers: dict[str, Control]
    options: dict[str, Any]
    fixed_base: bool = False

    def run_fixed_base(self) -> Run | None:
        """Simulate the building without isolation, if ``fixed_base`` is set.

        Returns
        -------
        Run or None

        Raises
        ------
        InputError
            If the stiffness of the superstructure is singular.
        """
        from ..simulation.run import fixed_base_run

        if not self.fixed_base:
            return None
        try:
            return fixed_base_run(self.isolated, self.records, self.options["tolerance"])
        except (InputError, Diverged) as error:
            raise with_place(error, self.source, "fixed base") from None

    def compile(self, label: str) -> None:
        """Compile a controller's decision code without a run.

        Parameters
        ----------
        label : str
            One of ``controllers``.

        Raises
        ------
        InputError
            If an option does not fit the controller, or the controller learns from runs.
        """
        from ..simulation.control import CoilDriver
        from ..simulation.run import prepare_lane

        def trial(_: Control) -> Run:
            raise InputError(f"controller {label!r} learns from runs")

        nominal, driver = (self.options.get(name) for name in ("nominal", "driver"))
        prepare_lane(
            self.isolated, self.records, self.controllers[label], nominal, driver or CoilDriver(),
            (0.0, 0.0), trial,
        )  # fmt: skip

    def run(self, label: str) -> Run:
        """Simulate one controller.

        Parameters
        ----------
        label : str
            One of ``controllers``.

        Returns
        -------
        Run

        Raises
        ------
        InputError
            If a current is refused or an option does not fit the controller.
        Diverged
            If the response leaves the range of floating-point numbers or of the law, or the
            controller raises an error.
        """
        from ..simulation.run import simulate

        try:
            run = simulate(self.isolated, self.records, self.controllers[label], **self.options)
        except (InputError, Diverged) as error:
            place = with_place(error, self.source, f"controller {label!r}")
            # the error of a user's controller
            raise place from error.__cause__
        return run


def with_place(error: Exception, *places: str) -> Exception:
    """Insert places before an error's text."""
    text = ": ".join([place for place in places if place] + [str(error)])
    alone = isinstance(error, Diverged | RefusedCurrent)
    return type(error)(text) if alone else InputError(text)
