"""Co-simulation of the building with isolators in a functional mock-up unit (FMU).

Both make steps from sample to sample. The unit's force is linear in time within a step. Its value
at the end of the step is iterated until it equals the unit's force for the resulting motion. A very
short step determines the jump of the force with the current.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import Diverged, InputError
from ..io.fmu import Unit
from ..structures import Element, IsolatedStructure
from .control import CoilDriver, Control, RunContext
from .kernel.slots import ALIVE, D_END, V_END
from .workspace import Workspace

MOST_ITERATIONS = 60
NO_LENGTH = 1e-6
"""Length of the step for a jump, as a share of a step."""


def unit_element(isolated: IsolatedStructure) -> int | None:
    """Index of the element with an FMU; None if all have laws."""
    units = [e for e, element in enumerate(isolated.elements) if element.device.law.unit]
    if len(units) > 1:
        raise InputError(
            f"{len(units)} elements are functional mock-up units; expected: one, in one direction"
        )
    return units[0] if units else None


def refuse_unit(isolated: IsolatedStructure) -> None:
    """Refuse a plant with an FMU in parallel runs and step-by-step simulation."""
    e = unit_element(isolated)
    if e is not None:
        raise InputError(
            f"{isolated.elements[e].device.law.unit}: isolators that are a functional mock-up unit "
            "run one at a time; expected: simulate, compare or isolation-sim run"
        )


def check_limits(element: Element, driver: CoilDriver) -> None:
    """Refuse an FMU without limits of its current."""
    if not np.isfinite(element.device.current_range).all() and None in (driver.low, driver.high):
        raise InputError(
            f"{element.device.law.unit}: limits of the current are missing; expected: "
            "current_range_A of the isolator, or low and high of the driver"
        )


def at_every_sample(controller: Control, dt: float) -> Control:
    """The controller, called at every sample; it decides at its own instants."""
    every = 1 if controller.period is None else round(controller.period / dt)
    if every < 1 or (controller.period and abs(controller.period - every * dt) > 1e-6 * dt):
        raise InputError(
            f"{controller.name}: period",
            f"{controller.period} s, where the isolators are a unit",
            f"a multiple of the record's interval, {dt:g} s",
        )
    # single decisions in Python
    own: Any = controller.in_python() if hasattr(controller, "in_python") else copy(controller)
    own_prepare, own_reset, own_current = own.prepare, own.reset, own.current
    n_calls, command = 0, None

    def at_samples(context: RunContext) -> RunContext:
        return replace(context, period=every * dt)

    def prepare(context: RunContext, trial: Any) -> None:
        own_prepare(at_samples(context), trial)

    def reset(context: RunContext) -> None:
        nonlocal n_calls
        n_calls = 0
        own_reset(at_samples(context))

    def current(t: float, measurement: Any) -> Any:
        nonlocal n_calls, command
        if n_calls % every == 0:
            command = own_current(t, measurement)
        n_calls += 1
        return command

    own.period, own.prepare, own.reset, own.current = dt, prepare, reset, current
    return own


class Coupling:
    """Integrates a run together with its FMU, from decision to decision."""

    def __init__(self, work: Workspace, isolated: IsolatedStructure, e: int):
        element = isolated.elements[e]
        law = element.device.law
        assert law.unit is not None and element.channel is not None
        self.unit, self.work, self.e = Unit(law.unit), work, e
        self.channel, self.small = element.channel, work.tolerance
        names = {own: name for name, own in law.unit_variables.items()}
        self.inputs = [names.get(n, n) for n in ("displacement_m", "velocity_m_s", "current_A")]
        self.output = names.get("force_N", "force_N")
        self.unit.check_has(self.inputs, (self.output,), "variables in [isolator]")
        if not self.unit.saves_state:
            raise InputError(
                f"{law.unit}: cannot save its state, which the iteration needs; expected: a unit "
                "with canGetAndSetFMUstate"
            )
        if not (work.grid.events[:, 1] >= 0).all():
            raise InputError(
                f"{law.unit}: isolators are a unit, and measurements or commands are delayed; "
                "expected: no delays, and no sampling of the sensors"
            )
        # all runs of the plant share the law's numbers; this run changes its own copy
        *others, self.coils, numbers, lanes, history, scratch = work.arguments
        self.table = numbers.table.copy()
        self.table.flags.writeable = False
        numbers = numbers._replace(table=self.table)
        work.arguments = (*others, self.coils, numbers, lanes, history, scratch)
        self.w, self.base = scratch.w, e * work.kernel.shape.stride
        self.started = False
        self.force = self.last = self.largest = 0.0
        self.current = np.nan
        self.unit.start()

    def __call__(self) -> int:
        """Integrate to the next decision, or to the end; returns the kernel's status."""
        if not self.started:
            self.started = True
            return self.work.integrate()
        work, unit = self.work, self.unit
        segment, begin = int(work.position[0]), self._motion()
        start, end = work.grid.time[work.grid.segments[segment : segment + 2, 0]]
        length = float(end - start)
        point = int(work.grid.segments[segment, 0])
        saved, n_steps, state = work.state_at(point), work.step_count.copy(), unit.get_state()
        guess = 2.0 * self.force - self.last
        self.last = self.force
        status = self._try(guess, length)
        before = float(work.coil_history[segment, self.channel, 0])
        after = float(self.coils.current[self.channel, 0])
        if before != self.current:
            force_after_jump = self._force_now(start, length, begin, before, self.force)
            guess += force_after_jump - self.force
            self.force = force_after_jump
        self.current = after
        for _ in range(MOST_ITERATIONS):
            work.restore(point, saved)
            work.step_count[:] = n_steps
            status = self._try(guess, length)
            if work.alive[0] != ALIVE:
                break
            motion = self._motion()
            force = self._step_unit(start, length, motion, 0.5 * (before + after))
            if after != before:
                force = self._force_now(end, length, motion, after, force)
            self.largest = max(self.largest, abs(force))
            change, guess = abs(force - guess), force
            if change <= 0.1 * self.small * self.largest:
                break
            unit.set_state(state)
        else:
            raise Diverged(
                f"the run diverged at t = {start:.4g} s: the iteration between the building and "
                f"{unit.file} does not converge; a shorter interval of the record may help"
            )
        unit.free_state(state)
        self.force = guess
        return status

    def _motion(self) -> NDArray:
        """Deformation and velocity of the device in its own scale."""
        return self.w[self.base + np.array([D_END, V_END])]

    def _force_now(
        self, time: float, length: float, motion: NDArray, current: float, otherwise: float
    ) -> float:
        """Force at a current without a change of motion, if the FMU accepts a very short step."""
        if not self.unit.takes_any_step:
            return otherwise
        state = self.unit.get_state()
        force = self._step_unit(time, NO_LENGTH * length, motion, current)
        self.unit.set_state(state)
        self.unit.free_state(state)
        return force

    def _step_unit(self, time: float, length: float, motion: NDArray, current: float) -> float:
        inputs = dict(zip(self.inputs, [*motion.tolist(), current], strict=True))
        return self.unit.step(time, length, inputs, [self.output])[0]

    def _try(self, force: float, length: float) -> int:
        """Integrate to the next decision with a force that is linear in time to this value."""
        work = self.work
        self.w[self.base + work.elements.starts[self.e]] = self.force
        work.states[work.grid.segments[work.position[0], 0], self.e, 0, 0] = self.force
        self.table.flags.writeable = True
        self.table[self.e, 0, 0, 0, 0] = (force - self.force) / length
        self.table.flags.writeable = False
        self.coils.applied[self.e] = np.nan
        return work.integrate()
