"""Model predictive control of the coil currents themselves."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.errors import InputError
from isolation_sim.simulation.control import RunContext
from isolation_sim.structures import IsolatedStructure

from .clairvoyant import coil_table
from .estimating import Estimating
from .observers.observer import Running
from .predictive.force_scale import ForceScale
from .predictive.slow_ground import SlowGround
from .settings import Integer, Number, OneOf, Optional, SearchRange, setting

if TYPE_CHECKING:
    from .predictive.prediction import Prediction
from .predictive.running_peaks import RunningPeaks

_STOPPING = 0.35
"""Time in which the ground comes to rest after the horizon, while the building floats on, s."""
_ENOUGH = 0.5
"""Preview time from which the programme decides when a stiff start ends, s."""
_INFEASIBLE = 1e-6
"""How far a solution may be outside a constraint, in the programme's units."""


@dataclass
class Report:
    """What happened in a run's decisions.

    Attributes
    ----------
    failed : int
        Programmes without a usable solution; the previous plan was followed instead.
    late : int
        Decisions that took longer than the deadline; the previous plan was followed instead.
    seconds : list of float
        Computing time of each decision, s.
    iterations : list of int
        Iterations of the solver in each decision.
    strength : float or None
        Last estimate of the force scale: isolator force over that of the nominal model; None
        without ``learning``.
    """

    failed: int = 0
    late: int = 0
    seconds: list[float] = field(default_factory=list)
    iterations: list[int] = field(default_factory=list)
    strength: float | None = None

    def __str__(self) -> str:
        if not self.seconds:
            return "no decisions"
        median, slow = np.percentile(self.seconds, [50, 99]) * 1e3
        learnt = ""
        if self.strength is not None:
            learnt = f"; estimated force scale of the isolators {self.strength:.2f}"
        return (
            f"{len(self.seconds)} decisions, {self.failed} failed and {self.late} late (the "
            f"previous plan was followed); median {median:.3f} ms, 99th percentile "
            f"{slow:.3f} ms{learnt}"
        )


class MPC(Estimating):
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

    With ``filter`` an observer estimates displacements and velocities from accelerations and
    isolator deformations. With ``learning`` the isolator force is multiplied by an estimated
    factor, for which it balances the measured inertia forces. The state is predicted over the
    ``delay`` of the measurements, with the commands given in the meantime.

    If a programme has no solution within its constraints, or a decision takes longer than
    ``deadline``, ``report`` counts it, and the previous plan, which is within all limits, is
    followed for one more step.

    Attributes
    ----------
    report : Report
        What happened in the last run's decisions.
    units : numpy.ndarray, shape (3,)
        Displacement (m), acceleration (m/s^2) and velocity (m/s) by which the last decision's
        costs were normalised.
    """

    name = "mpc"
    title = "Model predictive control"
    source = "real-time iteration: Diehl, Bock and Schlöder 2005; QP: Goldfarb and Idnani 1983"

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

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.preview_time = self.preview

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Displacements and velocities or what the observer sees, and the ground's acceleration."""
        structure = nominal.structure
        one = len(structure.directions) == 1
        seen = super().measures(nominal)
        if self.filter == "none":
            seen = (
                *(() if self.learning is None else seen[: structure.n_dofs]),
                *(f"{dof}_displacement_m" for dof in structure.names),
                *(f"{dof}_velocity_m_s" for dof in structure.names),
            )
        return (
            *seen,
            *(f"ground_{'' if one else d + '_'}acceleration_m_s2" for d in structure.directions),
        )

    def reset(self, context: RunContext) -> None:
        """Set the prediction up and forget the last run."""
        from .clipped_lqr import linear_model
        from .predictive.ground_forecast import GroundForecast
        from .predictive.nominal_linear_model import spring_and_dashpot
        from .predictive.prediction import Prediction, growing_blocks
        from .predictive.uncontrolled import Uncontrolled

        nominal = context.nominal
        if not nominal.n_channels:
            raise InputError(f"{self.name}: no element of the nominal model is driven by a coil")
        self._estimated: Running | None = None
        if self.filter != "none":
            self._estimated = Running(self.observer(context, self.filter))
        self.coils = coils = coil_table(context)
        frequency = linear_model(nominal, coils[:, 2])[0]
        self.frequency = 2 * np.pi * frequency
        if self.model == "linear":
            nominal = spring_and_dashpot(nominal, coils, frequency)
        self.step = context.period
        self._force_scale: ForceScale | None = None
        if self.learning is not None:
            self._force_scale = ForceScale(nominal, self.step, self.learning)
        horizon = 0.9 + self.preview / 2 if self.horizon is None else self.horizon
        n_steps = max(2, round(horizon / self.step))
        blocks = round(20 + 12 * self.preview) if self.blocks is None else self.blocks
        self.block = growing_blocks(n_steps, min(blocks, n_steps))
        longest = self.substep
        if longest is None:
            longest = 0.005 if self.preview else 0.01
        self.prediction = Prediction(nominal, coils, self.step, self.block, longest)
        p = self.prediction
        n, most = p.dy.shape[2] + 3, (n_steps + 1) * p.y.shape[1] * 8 + n_steps * len(coils)
        self._programme = (
            np.zeros((n, n)), np.zeros(n), np.zeros((most, n)), np.zeros(n + most),
            np.zeros(n + most),
        )  # fmt: skip
        self._solver = np.zeros((n, n)), np.zeros((n, n)), np.zeros((4, n + 1)), np.zeros(n + 1)
        on_excess = self.displacement_excess
        if on_excess is None:
            on_excess = 0.2 + 2.5 * self.preview
        regret = max(2.0 - 2.5 * self.preview, 0.0) if self.regret is None else self.regret
        self._stop = min(1.6 * self.preview, 1.3) if self.stop is None else self.stop
        self._weights = np.array(
            [
                self.displacement, self.acceleration, self.end, self.change, self.roughness,
                self.effort, on_excess, self.acceleration_excess, regret,
            ]
        )  # fmt: skip
        self._n_behind = len(nominal.structure.directions) + len(coils)
        delay = 0.0 if self.filter == "none" else sum(context.delays)
        self._n_late = round((delay if self.delay is None else self.delay) / self.step)
        ahead = 0
        if context.ground is not None:
            ahead = int(self.preview / self.step * (1 + 1e-9)) + self._n_late
        self._foreseen = np.arange(1, min(ahead, self._n_late + n_steps) + 1) * self.step
        if self._n_late:  # measured that long before the decision
            self._foreseen += context.delays[1] - self._n_late * self.step
        self._since: Prediction | None = None
        if self._n_late:
            together = np.zeros(self._n_late, int)
            self._since = Prediction(nominal, coils, self.step, together, longest)
        self._given = np.tile(coils[:, 4], (self._n_late, 1))
        self._ground = GroundForecast(
            p, coils, self.step, self._n_late + n_steps, self.order, self.settling, self.fading,
            context.ground,
        )  # fmt: skip
        self.commands = np.tile(coils[:, 4], (n_steps, 1))
        self._last: tuple[float, NDArray, NDArray] | None = None
        self._states = p.initial_states()
        self._seen, self._strongest = RunningPeaks(p.n_displacements, p.n_accelerations), 0.0
        self._jumps = bool(np.any((coils[:, 0] == 0) & np.isinf(coils[:, 1])))
        n_ahead = self._n_late + n_steps - len(self._foreseen)
        self._uncontrolled = Uncontrolled(nominal, coils, self.step, longest, n_ahead)
        stiffest = linear_model(context.nominal, coils[:, 3])[0]
        self._slow_ground, self._slow = SlowGround(self.step, self.stiff_start / stiffest), False
        self.report = Report()

    def current(self, t: float, measurement: Any) -> NDArray:
        """Predict, linearise, solve, and give the plan's first command."""
        began = perf_counter()
        p, before = self.prediction, self.commands[0].copy()
        if self._last is not None:
            self.commands[:-1] = self.commands[1:]
        z, states, coil = self._now(t, np.array(measurement, dtype=float))
        self._seen.follow(p.outputs(z, states, coil))
        plan = self.commands.copy()
        if self._slow:
            plan[:] = self.coils[:, 3]
        held = self._slow and self.preview < _ENOUGH
        for _ in range(0 if held else self.iterations):
            p.predict(z, states, coil, plan, self._ground.path[self._n_late * p.n_sub :])
            move = self._solve(plan, before)
            if move is None:
                self.report.failed += 1
                plan = self.commands
                break
            plan += move[self.block]
        # what the solver leaves of a bound, 1e-6 at most, no coil gets to see
        lag, slew = self.coils[:, 0], self.coils[:, 1]
        start = np.where(lag > 0, coil, before)
        reach = slew * np.where(lag > 0, lag, self.step)
        plan[0] = np.clip(plan[0], start - reach, start + reach)
        np.clip(plan, self.coils[:, 2], self.coils[:, 3], out=plan)
        took = perf_counter() - began
        self.report.seconds.append(took)
        if self.deadline is not None and took > self.deadline:
            self.report.late += 1
        else:
            self.commands = plan
        if self._jumps:
            self._seen.change(p.outputs(z, states, self.commands[0]))
        if self._n_late:
            self._given = np.concatenate([self._given[1:], self.commands[:1]])
        return self.commands[0].copy()

    def _now(self, t: float, measured: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Modes, device states and coil currents now, from what was measured ``delay`` before."""
        p, n = self.prediction, self.prediction.nominal.structure.n_dofs
        seen, ground, coil = np.split(measured, [-self._n_behind, -len(self.coils)])
        accelerations = seen[:n]
        if self._estimated is not None:
            seen = self._estimated.update(t, np.concatenate([seen, coil]))
        elif self._force_scale is not None:
            seen = seen[n:]
        z = p.modes_of(seen[:n], seen[n : 2 * n])
        first = self._last is None
        if self._last is not None:
            then, old, old_coil = self._last
            p.follow(old, z, t - then, self._states, (old_coil + coil) / 2)
        self._last = (t, z, coil)
        if self._force_scale is not None:
            learnt = self._force_scale.learn(accelerations, p.forces(z, self._states, coil))
            p.strength[:] = self.report.strength = learnt
            if self._estimated is not None:
                self._estimated.strengthen(p.strength)
        self._ground.look(ground, t + self._foreseen)
        self._uncontrolled.follow(self._ground.path, p.strength)
        was_slow, known = self._slow, self._ground.known
        for sample in self._ground.acceleration[0 if first else known - 1 : known]:
            self._slow = self._slow_ground.follow(sample, self._seen.peaks[1])
        if was_slow and not self._slow:
            self.commands[:] = self.coils[:, 2]
        if self._since is None:
            return z, self._states, coil
        self._since.strength[:] = p.strength
        late = self._ground.path[: self._n_late * p.n_sub + 1]
        return self._since.carried(z, self._states, coil, self._given, late)

    def _solve(self, plan: NDArray, before: NDArray) -> NDArray | None:
        """Changes of the blocks, (n_blocks, n_channels), A; None if there is no usable solution."""
        p = self.prediction
        n_d, n_a = p.n_displacements, p.n_accelerations
        known = self._ground.known
        strongest = np.abs(self._ground.acceleration[:known]).max()
        self._strongest = max(self._strongest, strongest, 1e-3)
        least = self.least_peak * self._strongest / np.array([self.frequency**2, 1.0])
        # a unit that grows too late would let the plan trade any acceleration for displacement
        without = self._uncontrolled.course[self._n_late :]
        scale = np.maximum(without[-1], least)
        shares = [self.displacement_level, self.acceleration_level]
        unavoidable = np.maximum(self._uncontrolled.peaks, least) * shares
        levels = np.maximum(self._seen.peaks, unavoidable)
        bearable = np.maximum(without[:, 1], max(self._seen.peaks[1], least[1]))
        self.units = np.array([*scale, scale[0] * self.frequency])
        # relative to ground that stops, a floating base has the ground's velocity on top of its own
        lost = self._stop * p.along @ self._ground.velocity
        resting = np.concatenate([-_STOPPING * lost, np.zeros(n_a), lost])
        count = p.module.programme(
            p.results, plan, before, p.block, self.coils, self.step, (n_d, n_a),
            self.units, levels,
            (max(known - self._n_late, 1), self.margin * self._ground.strays, bearable),
            self._weights, resting, self._programme,
        )  # fmt: skip
        hessian, gradient, rows, upper, lower = self._programme
        n = len(gradient)
        rows, upper, lower = rows[:count], upper[: n + count], lower[: n + count]
        x, iterations = self._solved(hessian, gradient, rows, upper, lower)
        self.report.iterations.append(abs(iterations))
        if iterations < 0 or not np.all(np.isfinite(x)):
            return None
        value = np.concatenate([x, rows @ x])
        if np.any(value > upper + _INFEASIBLE) or np.any(value < lower - _INFEASIBLE):
            return None
        move = x[:-3].reshape(-1, len(self.coils))
        return move * (self.coils[:, 3] - self.coils[:, 2])

    def _solved(
        self, hessian: NDArray, gradient: NDArray, rows: NDArray, upper: NDArray, lower: NDArray
    ) -> tuple[NDArray, int]:
        """Solution of a programme, and the solver's iterations, below 0 if it found none."""
        x = np.zeros(len(gradient))
        iterations = self.prediction.module.optimum(
            hessian, gradient, rows, upper, lower, x, self._solver
        )
        return x, iterations
