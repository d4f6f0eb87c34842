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
from .settings import Integer, Number, OneOf, Optional, setting

if TYPE_CHECKING:
    from .predictive.prediction import Prediction
from .predictive.running_peaks import RunningPeaks

_STOPPING = 0.35
"""Time in which the ground comes to rest after the horizon, while the building floats on, s."""
_INFEASIBLE = 1e-6
"""How far a solution may be outside a constraint, in the programme's units."""
_PROXIMAL = 1e-6
"""Curvature that the solver's proximal steps add, in the programme's units."""


@dataclass
class Report:
    """What happened in a run's decisions.

    Attributes
    ----------
    failed : int
        Programmes without a usable solution; the plan before was followed instead.
    late : int
        Decisions that took longer than the deadline; the plan before was followed instead.
    seconds : list of float
        Time that each decision took, s.
    iterations : list of int
        Of the solver, each decision.
    strength : float or None
        Force of the isolators over the one believed in, as learnt at last; None without learning.
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
            learnt = f"; isolators {self.strength:.2f} times as strong as believed"
        return (
            f"{len(self.seconds)} decisions, {self.failed} failed and {self.late} late (the plan "
            f"before was followed); median {median:.3f} ms, 99th percentile {slow:.3f} ms{learnt}"
        )


class MPC(Estimating):
    """Model predictive control of the coil currents themselves.

    Each decision predicts the response over a horizon with the law believed in and the plan of the
    decision before, linearises that prediction exactly, and corrects the plan by one quadratic
    programme (real-time iteration). The programme charges a little of the squared response and of
    the plan's changes, and what exceeds the peaks so far or a level that counts as unavoidable; the
    coils' limits and slew are its constraints.

    The nominal model also goes through the ground motion without current, as far as it is known and
    then as forecast. Its peaks over this course are the units of displacement and acceleration. The
    regret is the acceleration above the largest one of this course up to the same step: without
    preview a plan pays for it, so that an uncertain gain of displacement is not bought with more
    acceleration than doing nothing would bring.

    The ground motion ahead is the record's as far as ``preview`` goes. From there on its velocity
    is expected to come back to zero, driven by what an autoregressive model, identified as the
    motion arrives, expects; this forecast fades, because the ramp of a pulse is not a trend. What
    is left of it at the end of the horizon is lost after it, while
    the building floats on: the cost there is on the amplitude that this leaves, as far as there is
    a warning. Accelerations keep clear of their level by what may come against that
    expectation before the coils can answer, which is the more the stiffer the isolators are.

    As long as all of the ground motion has been slow for the building at its highest current
    (``stiff_start``), that current is held instead: the building follows the ground. A long
    near-fault pulse is seen too late otherwise.

    With ``filter`` an observer estimates displacements and velocities from accelerations and
    isolator deformations. With ``learning`` the isolators' force is corrected by a factor, the one
    with which it carries the inertia forces that the accelerations show. Over the measurements'
    ``delay`` the state is predicted, under the commands given since.

    A programme without a solution inside its constraints, or a decision later than ``deadline``,
    is counted in ``report``; the plan of the decision before, which is within all limits, is then
    followed one step further.

    Attributes
    ----------
    report : Report
        What happened in the last run's decisions.
    units : numpy.ndarray, shape (3,)
        Displacement (m), acceleration (m/s^2) and velocity (m/s) that the last decision's costs
        were in units of.
    """

    name = "mpc"
    title = "Model predictive control"
    source = "real-time iteration: Diehl, Bock and Schlöder 2005; QP: Arnström et al. 2022"

    period: float | None = 0.02
    filter: str = setting(
        "none", "observer that estimates displacements and velocities from accelerations and "
        "isolator deformations; none takes them as measured",
        OneOf(("none", "kalman", "extended")),
    )  # fmt: skip
    preview: float = setting(
        0.0, "warning time: the ground motion is known so far ahead", Number(at_least=0), "s"
    )
    model: str = setting(
        "law", "device in the prediction: its law, or spring and dashpot at each current",
        OneOf(("law", "linear")),
    )  # fmt: skip
    horizon: float | None = setting(
        None, "how far ahead it predicts; None for 0.9 s and half of the preview",
        Optional(Number(above=0)), "s",
    )  # fmt: skip
    blocks: int | None = setting(
        None, "blocks of commands that move together, at first of one step; None for 20 and 12 for "
        "every second of the preview", Optional(Integer(at_least=1)),
    )  # fmt: skip
    order: int = setting(
        10, "order of the autoregressive model of the ground motion, identified as it arrives; 0 "
        "for none", Integer(at_least=0),
    )  # fmt: skip
    settling: float | None = setting(
        1.0, "time in which the ground's velocity is expected to come back to zero, beside what "
        "the autoregressive model expects; None for never", Optional(Number(above=0)), "s",
    )  # fmt: skip
    fading: float | None = setting(
        0.15, "time in which the forecast of the autoregressive model fades; None for never",
        Optional(Number(above=0)), "s",
    )  # fmt: skip
    displacement: float = setting(0.5, "weight of squared displacement", Number(at_least=0))
    acceleration: float = setting(0.5, "weight of squared acceleration", Number(at_least=0))
    end: float = setting(0.25, "weight of the squared amplitude at the end", Number(at_least=0))
    stop: float | None = setting(
        None, "share of the ground's velocity at the end that is expected to be lost while the "
        "building floats on; None for 1.6 for every second of the preview, 1.3 at most: without "
        "warning that velocity is a guess", Optional(Number(at_least=0)),
    )  # fmt: skip
    change: float = setting(0.1, "weight of squared changes of the plan", Number(above=0))
    roughness: float = setting(
        0.05, "weight of squared differences between commands of the plan", Number(at_least=0)
    )
    effort: float = setting(0.0, "weight of squared currents", Number(at_least=0))
    margin: float = setting(
        1.0, "what accelerations keep clear of their level, over the standard deviation of what "
        "may come unforeseen before the coils can answer", Number(at_least=0),
    )  # fmt: skip
    displacement_excess: float | None = setting(
        None, "weight of the displacement that exceeds its level; None for 0.2 and 2.5 for "
        "every second of the preview: without warning it is not foreseen",
        Optional(Number(at_least=0)),
    )  # fmt: skip
    acceleration_excess: float = setting(
        2.4, "weight of the acceleration that exceeds its level", Number(at_least=0)
    )
    regret: float | None = setting(
        None, "weight of the acceleration that exceeds the peak without current, so far and as "
        "forecast; None for 2 less 2.5 for every second of the preview, 0 at least",
        Optional(Number(at_least=0)),
    )  # fmt: skip
    displacement_level: float = setting(
        0.2, "peak displacement that counts as unavoidable, over the peak without current so far",
        Number(at_least=0),
    )  # fmt: skip
    acceleration_level: float = setting(
        0.25, "peak acceleration that counts as unavoidable, over the peak without current so far",
        Number(at_least=0),
    )  # fmt: skip
    stiff_start: float = setting(
        1.3, "shortest period of a ground motion that is ridden out at the highest current, over "
        "the building's first period at that current; 0 for none", Number(at_least=0),
    )  # fmt: skip
    least_peak: float = setting(
        0.13, "peaks without current are taken to be at least this times the strongest ground "
        "acceleration so far, for displacements over the square of the first frequency",
        Number(above=0),
    )  # fmt: skip
    delay: float | None = setting(
        None, "age of a measurement when its command takes effect, over which the state is "
        "predicted; None for what it is told where it has an observer, else 0: that sharpens noise",
        Optional(Number(at_least=0)), "s",
    )  # fmt: skip
    learning: float | None = setting(
        None, "memory of the isolators' force over the one believed in, learnt from accelerations; "
        "None to believe as given", Optional(Number(above=0)), "s",
    )  # fmt: skip
    substep: float | None = setting(
        None, "longest step of the prediction's integration; None for 0.01 s and half of that with "
        "a warning", Optional(Number(above=0)), "s",
    )  # fmt: skip
    iterations: int = setting(1, "linearisations a decision", Integer(at_least=1))
    deadline: float | None = setting(
        None, "time that a decision may take; None for any", Optional(Number(above=0)), "s"
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
        self._sense = np.zeros(n + most, dtype=np.int32)
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
        for _ in range(0 if self._slow else self.iterations):
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
        was_slow, self._slow = self._slow, self._slow_ground.follow(ground, self._seen.peaks[1])
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
        x, flag, iterations = self._solved(hessian, gradient, rows, upper, lower)
        self.report.iterations.append(iterations)
        if flag <= 0 or not np.all(np.isfinite(x)):
            return None
        value = np.concatenate([x, rows @ x])
        if np.any(value > upper + _INFEASIBLE) or np.any(value < lower - _INFEASIBLE):
            return None
        move = x[:-3].reshape(-1, len(self.coils))
        return move * (self.coils[:, 3] - self.coils[:, 2])

    def _solved(self, *programme: NDArray) -> tuple[NDArray, int, int]:
        """Solution of a programme, the solver's verdict (above 0: solved), and its iterations."""
        import daqp

        sense, iterations = self._sense[: len(programme[-1])], 0
        # where constraints are nearly dependent it may go in circles: proximal steps lead out
        for proximal in (0.0, _PROXIMAL):
            sense[:] = 0
            x, _, flag, info = daqp.solve(*programme, sense, eps_prox=proximal)
            iterations += info["iterations"]
            if flag > 0:
                break
        return np.asarray(x), flag, iterations
