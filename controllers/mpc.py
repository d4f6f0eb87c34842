"""Model predictive control of the coil currents themselves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.laws.trace_check import check_differentiable
from isolation_sim.simulation.control import CompiledDecision, RunContext
from isolation_sim.structures import IsolatedStructure

from .coils import coil_table, driven_elements
from .compiled import CompiledController, Decision, decision_step
from .device_model import FORCE_SCALE
from .estimating import Estimating
from .observers.observer import ground_outputs
from .preview import Preview
from .settings import Integer, Number, OneOf, Optional, SearchRange, setting

if TYPE_CHECKING:
    from .predictive.prediction import Prediction

_ENOUGH = 0.5
"""Preview time from which the programme decides when a stiff start ends, s."""


@dataclass
class Report:
    """Statistics of a run's decisions."""

    failed: int = 0  # Programmes without a usable solution; the previous plan was followed instead
    # Decisions that took longer than the deadline; the previous plan was followed instead
    late: int = 0
    seconds: list[float] = field(default_factory=list)  # Computing time of each decision, s
    # Iterations of the solver in each decision
    iterations: list[int] = field(default_factory=list)
    # Last estimate of the force scale: isolator force over that of the nominal model; None without
    # ``learning``
    force_scale: float | None = None

    def __str__(self) -> str:
        if not self.seconds:
            return "no decisions"
        median, slow = np.percentile(self.seconds, [50, 99]) * 1e3
        learnt = ""
        if self.force_scale is not None:
            learnt = f"; estimated force scale of the isolators {self.force_scale:.2f}"
        return (
            f"{len(self.seconds)} decisions, {self.failed} failed and {self.late} late (the "
            f"previous plan was followed); median {median:.3f} ms, 99th percentile "
            f"{slow:.3f} ms{learnt}"
        )


class MPC(Estimating, CompiledController):
    """Model predictive control of the coil currents themselves.

    Each decision predicts the response over a horizon with the nominal law and the plan of the
    previous decision, linearises the prediction exactly, and corrects the plan by one quadratic
    programme (real-time iteration). Its cost has small weights on the squared response and on
    changes of the plan, and slack weights on what exceeds the peaks so far or an unavoidable level.
    Its constraints are the limits and the slew rate of the coils.

    The nominal model is also simulated without current, over the known ground motion and then over
    its forecast. The peaks of this simulation normalise displacement and acceleration. The regret
    is the acceleration above the peak of this simulation up to the same step. Without preview it
    has a slack weight, so that an uncertain benefit in displacement is not bought with more
    acceleration than without control.

    Within ``preview`` the ground motion is the record's. Beyond it the ground velocity is expected
    to return to zero, with the innovation of an autoregressive model that is identified during the
    motion. The forecast fades, because the ramp of a pulse is not a trend. The terminal cost
    penalises the vibration amplitude that remains after the ground stops moving; it takes the
    ground velocity into account only with preview. Acceleration constraints are tightened by the
    forecast error before the coils can respond, which grows with the stiffness of the isolators.

    While the ground motion is slow for the building at the highest current (``stiff_start``), that
    current is held instead, so that the building follows the ground. A long near-fault pulse is
    recognised too late otherwise. With ``preview`` the known ground motion counts, and from 0.5 s
    on each programme starts from the highest current but may lower it.

    With ``filter`` an observer estimates displacements and velocities from accelerations, also of
    the ground, and isolator deformations. With ``learning`` the isolator force is multiplied by an
    estimated factor, for which it balances the measured inertia forces. The state is predicted over
    the ``delay`` of the measurements, with the commands given in the meantime.

    If a programme has no solution within its constraints, or a decision takes longer than
    ``deadline``, ``report`` counts it, and the previous plan, which is within all limits, is
    followed for one more step.

    Attributes
    ----------
    report : Report
        Statistics of the last run's decisions.
    units : numpy.ndarray, shape (3,)
        Displacement (m), acceleration (m/s^2) and velocity (m/s) by which the last decision's
        costs were normalised.
    """

    name = "mpc"
    title = "Model predictive control"
    source = "real-time iteration: Diehl, Bock and Schlöder 2005; QP: Goldfarb and Idnani 1983"
    predicts_switching = True

    period: float | None = 0.02
    filter: str = setting(
        "none", "observer that estimates displacements and velocities from accelerations and "
        "isolator deformations; none: displacements and velocities are measured",
        OneOf(("none", "kalman", "extended")),
    )  # fmt: skip
    preview: float = setting(
        0.0, "preview time: the ground motion is known this far ahead", Number(at_least=0), "s"
    )
    model: str = setting(
        "law", "device in the prediction: the law, or a spring and a dashpot that follow the "
        "current (linear)", OneOf(("law", "linear")),
    )  # fmt: skip
    horizon: float | None = setting(
        None, "prediction horizon; None for 0.9 s plus half of the preview time",
        Optional(Number(above=0)), "s", SearchRange(0.5, 2.0),
    )  # fmt: skip
    blocks: int | None = setting(
        None, "move blocking: number of blocks of commands, the first ones one decision long; "
        "None for 20 plus 12 per second of preview", Optional(Integer(at_least=1)),
    )  # fmt: skip
    order: int = setting(
        10, "order of the autoregressive model of the ground motion, which is identified during "
        "the motion; 0 for no model", Integer(at_least=0),
    )  # fmt: skip
    settling: float | None = setting(
        1.0, "time constant with which the forecast ground velocity returns to zero; None for no "
        "return", Optional(Number(above=0)), "s", SearchRange(0.3, 3.0),
    )  # fmt: skip
    fading: float | None = setting(
        0.15, "time constant with which the autoregressive forecast fades; None for no fading",
        Optional(Number(above=0)), "s", SearchRange(0.05, 1.0),
    )  # fmt: skip
    displacement: float = setting(
        0.5, "weight of squared displacement", Number(at_least=0), search=SearchRange(0.05, 5.0)
    )
    acceleration: float = setting(
        0.5, "weight of squared acceleration", Number(at_least=0), search=SearchRange(0.05, 5.0)
    )
    end: float = setting(
        0.25, "terminal weight, of the squared vibration amplitude after the horizon",
        Number(at_least=0), search=SearchRange(0.02, 2.0),
    )  # fmt: skip
    stop: float | None = setting(
        None, "terminal ground-velocity factor: the share of the ground velocity at the end of the "
        "horizon that the ground is expected to lose; None for 1.6 per second of preview, at most "
        "1.3", Optional(Number(at_least=0)),
    )  # fmt: skip
    change: float = setting(
        0.1, "proximal weight, of squared changes of the plan", Number(above=0),
        search=SearchRange(0.01, 1.0),
    )  # fmt: skip
    roughness: float = setting(
        0.05, "input-rate weight, of squared differences between commands", Number(at_least=0),
        search=SearchRange(0.005, 0.5),
    )  # fmt: skip
    effort: float = setting(0.0, "input weight, of squared currents", Number(at_least=0))
    margin: float = setting(
        1.0, "constraint tightening of accelerations, in standard deviations of the forecast error "
        "before the coils can respond", Number(at_least=0), search=SearchRange(0.0, 3.0, "linear"),
    )  # fmt: skip
    displacement_excess: float | None = setting(
        None, "slack weight, of the displacement above its level; None for 0.2 plus 2.5 per second "
        "of preview", Optional(Number(at_least=0)), search=SearchRange(0.05, 8.0),
    )  # fmt: skip
    acceleration_excess: float = setting(
        2.4, "slack weight, of the acceleration above its level", Number(at_least=0),
        search=SearchRange(0.5, 10.0),
    )  # fmt: skip
    regret: float | None = setting(
        None, "slack weight, of the acceleration above the peak without current, past and "
        "forecast; None for 2 minus 2.5 per second of preview, at least 0",
        Optional(Number(at_least=0)), search=SearchRange(0.0, 6.0, "linear"),
    )  # fmt: skip
    displacement_level: float = setting(
        0.2, "unavoidable displacement, as a fraction of the peak without current so far",
        Number(at_least=0), search=SearchRange(0.0, 0.9, "linear"),
    )  # fmt: skip
    acceleration_level: float = setting(
        0.25, "unavoidable acceleration, as a fraction of the peak without current so far",
        Number(at_least=0), search=SearchRange(0.0, 0.9, "linear"),
    )  # fmt: skip
    stiff_start: float = setting(
        1.3, "the highest current is held, with 0.5 s of preview planned from, while the period of "
        "the ground motion exceeds this multiple of the first period at that current; 0 for never",
        Number(at_least=0), search=SearchRange(0.7, 3.0),
    )  # fmt: skip
    least_peak: float = setting(
        0.13, "lower limit of the peaks without current, as a multiple of the largest ground "
        "acceleration so far; displacements: over the squared first circular frequency",
        Number(above=0), search=SearchRange(0.03, 0.5),
    )  # fmt: skip
    delay: float | None = setting(
        None, "age of a measurement when its command takes effect, over which the state is "
        "predicted; None for the scenario's delays with an observer and 0 without",
        Optional(Number(at_least=0)), "s",
    )  # fmt: skip
    learning: float | None = setting(
        None, "memory of the force-scale estimate of the isolators, from accelerations; None for "
        "no estimate", Optional(Number(above=0)), "s",
    )  # fmt: skip
    substep: float | None = setting(
        None, "longest integration step of the prediction; None for 0.01 s, or 0.005 s with "
        "preview", Optional(Number(above=0)), "s",
    )  # fmt: skip
    iterations: int = setting(1, "linearisations per decision", Integer(at_least=1))
    deadline: float | None = setting(
        None, "longest time of a decision; None for no limit", Optional(Number(above=0)), "s"
    )

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.preview_time = self.preview

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Displacements and velocities, or an observer's inputs, and the ground acceleration."""
        structure = nominal.structure
        seen = super().measures(nominal)
        if self.filter == "none":
            seen = (
                *(() if self.learning is None else seen[: structure.n_dofs]),
                *(f"{dof}_displacement_m" for dof in structure.names),
                *(f"{dof}_velocity_m_s" for dof in structure.names),
            )
        return (*seen, *ground_outputs(nominal))

    def decision(self, context: RunContext) -> Decision:
        """Assemble the prediction, its settings and its memory."""
        from .clipped_lqr import linear_model
        from .predictive import decision as at
        from .predictive import state_seen
        from .predictive.flat_arrays import flat_arrays
        from .predictive.force_scale import CERTAIN, balance
        from .predictive.linear_devices import spring_and_dashpot
        from .predictive.memory import Sizes, initial_memory
        from .predictive.prediction import Prediction, growing_blocks

        nominal, step = context.nominal, context.period
        driven_elements(nominal, self.name)
        self.coils = coils = np.minimum(coil_table(context), 1e30)
        softest, stiffest = (linear_model(nominal, coils[:, k])[0] for k in (2, 3))
        self.frequency = 2 * np.pi * softest
        predicted = nominal
        if self.model == "linear":
            predicted = spring_and_dashpot(nominal, coils, softest)
        longest = self.substep
        if longest is None:
            longest = 0.005 if self.preview else 0.01
        observer, scales = None, np.zeros(0)
        function: Callable[..., None] = state_seen.decide
        if self.filter != "none":
            own = self.observer(context, self.filter, measured_ground=True)
            observer, model = own.decision(), own.tracking.model
            scales = model.numbers.reshape(-1, model.n_numbers)[:, FORCE_SCALE]
            extended = self.filter == "extended"
            function = state_seen.decide_extended if extended else state_seen.decide_kalman
        for element in predicted.elements:
            check_differentiable(element.device.law)
        p = Prediction(predicted, coils, step, longest, nominal if observer else None)
        n_steps = self._n_steps(step)
        blocks = round(20 + 12 * self.preview) if self.blocks is None else self.blocks
        block = growing_blocks(n_steps, min(blocks, n_steps))
        n_late, n_known = self._n_late(context), self._n_known(context)
        # until the coil has responded: one lag and one decision later
        reach = min(int(np.ceil(coils[:, 0].max() / step - 1e-9)) + 1, n_steps)
        sizes = Sizes(n_steps, n_late, n_known, int(block[-1] + 1), reach, self.order)
        pulses = np.stack([p.pulses(coils[:, k].copy(), reach) for k in (2, 3)], axis=1)
        prior = CERTAIN**2 / step
        by_inertia, by_force = balance(predicted)
        settings = {
            at.NUMBERS: self._numbers(p, step, softest, stiffest, n_late, prior),
            at.BLOCK: block, at.NO_BLOCK: [], at.COIL_TABLE: coils, at.TO_MODES: p.to_modes,
            at.ALONG: p.along, at.PULSES: np.concatenate(pulses), at.BY_INERTIA: by_inertia,
            at.BY_FORCE: by_force, at.WEIGHTS: self._weights(), at.LENGTHS: p.lengths,
            at.LOWEST_CURRENTS: np.tile(coils[:, 2], (n_late + n_steps - n_known + 1, 1)),
            at.OBSERVER_SCALES: scales,
        }  # fmt: skip
        # the force-scale estimate changes and is in the memory
        settings |= dict(enumerate([*p.plant[:8], *p.plant[9:]], at.DECAY))
        memory = initial_memory(p, step, sizes, prior, observer)
        return Decision(function, flat_arrays(settings), memory, p.model)

    def _weights(self) -> list[float]:
        """Weights of the programme, in the order of ``condense_kernel``."""
        excess, regret = self.displacement_excess, self.regret
        if excess is None:
            excess = 0.2 + 2.5 * self.preview
        if regret is None:
            regret = max(2.0 - 2.5 * self.preview, 0.0)
        return [
            self.displacement, self.acceleration, self.end, self.change, self.roughness,
            self.effort, excess, self.acceleration_excess, regret,
        ]  # fmt: skip

    def _numbers(
        self, p: Prediction, step: float, softest: float, stiffest: float, n_late: int,
        prior: float,
    ) -> list[float]:  # fmt: skip
        """Single numbers of the settings; frequencies at the lowest and highest currents in Hz."""
        from .predictive import decision as at
        from .predictive.ground_kernel import DRIFT

        def decay(time: float | None) -> float:
            return 1.0 if time is None else float(np.exp(-step / time))

        numbers: dict[int, float] = {
            at.STEP: step, at.N_SUB: p.n_sub, at.N_LATE: n_late,
            at.HOLDS: self.preview < _ENOUGH,
            at.STOP: min(1.6 * self.preview, 1.3) if self.stop is None else self.stop,
            at.MARGIN: self.margin, at.LEAST_PEAK: self.least_peak,
            at.FREQUENCY: 2 * np.pi * softest, at.DISPLACEMENT_LEVEL: self.displacement_level,
            at.ACCELERATION_LEVEL: self.acceleration_level, at.LINEARISATIONS: self.iterations,
            at.LEARNS: self.learning is not None, at.LEARNING_DECAY: decay(self.learning),
            at.LEARNT_BEFORE: prior, at.PULL: 0.0 if self.settling is None else 1 / self.settling,
            at.VELOCITY_DECAY: decay(DRIFT), at.FORECAST_DECAY: decay(self.fading),
            at.SLOW_LIMIT: self.stiff_start / stiffest, at.N_DISPLACEMENTS: p.n_displacements,
            at.N_ACCELERATIONS: p.n_accelerations,
            at.PRESENT: 0, at.JUMPS: bool(np.any((p.coils[:, 0] == 0) & (p.coils[:, 1] >= 1e30))),
        }  # fmt: skip
        return [numbers[k] for k in range(len(numbers))]

    def _n_steps(self, step: float) -> int:
        """Steps of the horizon."""
        horizon = 0.9 + self.preview / 2 if self.horizon is None else self.horizon
        return max(2, round(horizon / step))

    def _n_late(self, context: RunContext) -> int:
        """Steps from a measurement to its decision."""
        delay = 0.0 if self.filter == "none" else sum(context.delays)
        steps = (delay if self.delay is None else self.delay) / context.period
        return int(steps + 0.5 + 1e-9)  # half a step is one

    def _n_known(self, context: RunContext) -> int:
        """Samples of the ground motion that are known after the measured one."""
        if context.ground is None:
            return 0
        step, n_late = context.period, self._n_late(context)
        ahead = int(self.preview / step * (1 + 1e-9)) + n_late
        return min(ahead, n_late + self._n_steps(step))

    def _ahead(self, context: RunContext) -> NDArray:
        """Times from a decision on at which the ground motion is known, s."""
        from .predictive.decision import N_SUB, NUMBERS
        from .predictive.flat_arrays import array1

        n_sub = int(array1(self._decision.settings, NUMBERS)[N_SUB])
        step, n_late = context.period, self._n_late(context)
        times = np.arange(1, self._n_known(context) * n_sub + 1) * (step / n_sub)
        # measured that long before the decision
        return times + (context.delays[1] - n_late * step if n_late else 0.0)

    def reset(self, context: RunContext) -> None:
        """Prepare the prediction and clear the memory of the last run."""
        super().reset(context)
        ahead = self._ahead(context)
        n_measured = len(context.outputs) + len(context.nominal.structure.directions) * len(ahead)
        self._step = decision_step(self._decision, n_measured, len(context.low), self.name)
        self._preview = Preview(ahead, context.ground or ())
        self.report = Report()

    def compiled(self, context: RunContext) -> CompiledDecision | None:
        """Decision in compiled code, without a deadline."""
        decision = None if self.deadline is not None else super().compiled(context)
        if decision is None:
            return None
        names = self.measures(context.nominal)[-len(context.nominal.structure.directions) :]
        return replace(decision, inputs=self._preview.names(names))

    def memory_array(self, which: int) -> NDArray:
        """Array of the decision's memory, by its number in ``predictive.decision``."""
        from .predictive.flat_arrays import array

        return array(self._step.memory, which)

    def programme(self) -> tuple[list[NDArray], NDArray]:
        """Hessian, gradient, rows, upper and lower bounds of the last programme; its solution."""
        from .predictive.decision import CONSTRAINTS, PROGRAMME, SOLUTION, STATE

        n = int(self.memory_array(STATE)[CONSTRAINTS])
        hessian, gradient, rows, *bounds = (self.memory_array(PROGRAMME + k) for k in range(5))
        upper, lower = (bound[: len(gradient) + n] for bound in bounds)
        return [hessian, gradient, rows[:n], upper, lower], self.memory_array(SOLUTION)

    @property
    def units(self) -> NDArray:
        """Displacement, acceleration and velocity by which costs were normalised."""
        from .predictive.decision import UNITS

        return self.memory_array(UNITS).copy()

    def current(self, t: float, measurement: Any) -> NDArray:
        """Decide in compiled code, and record the statistics of the decision."""
        from .predictive import decision as at

        began = perf_counter()
        plan = self.memory_array(at.PLAN)
        previous = plan.copy()
        begun = self.memory_array(at.STATE)[at.BEGUN] == 1.0
        command = self._step(t, self._preview.known(t, measurement))
        took = perf_counter() - began
        state, report = self.memory_array(at.STATE), self.report
        report.seconds.append(took)
        report.iterations.append(int(state[at.ITERATED]))
        report.failed += int(state[at.FAILED])
        if self.learning is not None:
            report.force_scale = float(state[at.FACTOR])
        if self.deadline is not None and took > self.deadline:
            report.late += 1
            if begun:
                previous[:-1] = previous[1:]
            plan[:] = previous
            command = plan[0].copy()
        return command
