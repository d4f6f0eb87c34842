"""The decision of ``mpc`` as do-mpc takes it: the same states, horizon, cost and constraints.

The model is traced from the same law and given to do-mpc as a discrete one, a Runge-Kutta step a
command, which has fewer unknowns than its collocation. Costs on what exceeds a peak have no
counterpart in do-mpc: both controllers are given the squared ones alone.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.mpc import MPC
from controllers.predictive.condense_kernel import largest_gap
from controllers.predictive.decision import ACCELERATION_AHEAD, MOTION_SEEN, PLAN, STATES_THEN
from isolation_sim.structures import IsolatedStructure

ALONE = {
    "displacement_excess": 0.0, "acceleration_excess": 0.0, "regret": 0.0, "effort": 0.1,
    "end": 0.25, "horizon": 0.6, "blocks": 30,
}  # fmt: skip
"""Settings of ``mpc`` for the problem that both can be given."""
_PARAMETERS = ("ground", "ground_after", "displacement_unit", "acceleration_unit")
"""Time-varying parameters of do-mpc at every step of the horizon."""


@dataclass(frozen=True)
class Case:
    """What a decision started from, and what came of it."""

    state: NDArray  # Displacements (m), velocities (m/s), device states, coil current (A)
    ground: NDArray  # Ground acceleration over the horizon, m/s^2
    units: NDArray  # Units of displacement and acceleration in the costs, m and m/s^2
    before: float  # The last command given, A
    command: float  # The command decided, A
    seconds: float  # Time taken, s


class Recorder(MPC):
    """The predictive controller, with some of its decisions kept."""

    def __init__(self, first: int, count: int, **settings: Any):
        super().__init__(**settings)
        self.first, self.count = first, count
        self.cases: list[Case] = []

    def current(self, t: float, measurement: Any) -> NDArray:
        """Decide, and keep what it was about."""
        before = float(self.memory_array(PLAN)[0, 0])
        command = super().current(t, measurement)
        if self.first < len(self.report.seconds) <= self.first + self.count:
            motion = len(self.memory_array(MOTION_SEEN))
            measured = np.array(measurement, dtype=float)
            state = np.concatenate(
                [measured[:motion], self.memory_array(STATES_THEN)[0], measured[-1:]]
            )
            ground, took = self.memory_array(ACCELERATION_AHEAD)[0].copy(), self.report.seconds[-1]
            self.cases.append(Case(state, ground, self.units[:2], before, float(command[0]), took))
        return command


class DoMPC:
    """One decision after another by do-mpc."""

    # plant: a building on one kind of isolator, with one coil. one: the controller to agree with,
    # after a run. sizes: (n_states,), of displacements (m), velocities (m/s), device states and
    # current (A)

    def __init__(self, plant: IsolatedStructure, one: MPC, sizes: NDArray):
        import casadi

        with warnings.catch_warnings():
            # it warns of every optional package that is not there
            warnings.simplefilter("ignore")
            import do_mpc

        self.steps = len(one.memory_array(PLAN))
        lag, slew, low, high = one.coils[0, :4]
        element, n = plant.elements[0], plant.structure.n_dofs
        inverse = np.linalg.inv(plant.structure.mass)
        base = int(plant.structure.base[0])
        model = do_mpc.model.Model("discrete", "SX")
        x = model.set_variable("_x", "x", (2 * n + len(element.device.law.states) + 1, 1))
        u = model.set_variable("_u", "u")
        now, then, long, hard = (model.set_variable("_tvp", name) for name in _PARAMETERS)

        def parts(state: Any) -> tuple:
            """Displacements, velocities, and what the device's law is given."""
            q, v, rest = state[:n], state[n : 2 * n], casadi.vertsplit(state[2 * n :])
            along = (casadi.dot(element.direction, y) for y in (q, v))
            return q, v, (*along, rest[:-1], rest[-1])

        def accelerations(state: Any) -> Any:
            q, v, settings = parts(state)
            forces = plant.structure.stiffness @ q + plant.structure.damping @ v
            forces += element.direction * element.device.force(*settings)
            return -casadi.mtimes(inverse, forces)

        def rate(state: Any, share: float) -> Any:
            _, v, settings = parts(state)
            ground = now + share * (then - now)
            relative = accelerations(state) - plant.structure.influence[:, 0] * ground
            return casadi.vertcat(
                v, relative, *element.device.rates(*settings), (u - settings[-1]) / lag
            )

        h = one.period
        k1 = rate(x, 0.0)
        k2 = rate(x + h / 2 * k1, 0.5)
        k3 = rate(x + h / 2 * k2, 0.5)
        k4 = rate(x + h * k3, 1.0)
        model.set_rhs("x", x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
        model.setup()

        self.mpc = mpc = do_mpc.controller.MPC(model)
        mpc.settings.n_horizon, mpc.settings.t_step = self.steps, h
        mpc.settings.store_full_solution = False
        mpc.settings.supress_ipopt_output()
        span, omega = high - low, one.frequency
        amplitude = (x[base] / long) ** 2
        squares = one.displacement * amplitude
        squares += one.acceleration / n * casadi.sumsqr(accelerations(x) / hard)
        end = one.end * (amplitude + (x[n + base] / (long * omega)) ** 2)
        effort = one.effort * ((u - low) / span) ** 2
        mpc.set_objective(mterm=squares / self.steps + end, lterm=(squares + effort) / self.steps)
        mpc.set_rterm(u=one.roughness / span**2)
        mpc.bounds["lower", "_u", "u"], mpc.bounds["upper", "_u", "u"] = low, high
        reach = largest_gap(lag, slew, h)
        mpc.set_nl_cons("faster", u - x[-1], reach)
        mpc.set_nl_cons("slower", x[-1] - u, reach)
        mpc.scaling["_x", "x"] = sizes
        self._ahead, self._units, self._started = np.zeros(self.steps + 2), np.ones(2), False
        template = mpc.get_tvp_template()

        def ahead(_: float) -> Any:
            for k in range(self.steps + 1):
                values = (*self._ahead[k : k + 2], *self._units)
                for name, value in zip(_PARAMETERS, values, strict=True):
                    template["_tvp", k, name] = value
            return template

        mpc.set_tvp_fun(ahead)
        mpc.setup()

    def decide(self, case: Case) -> tuple[float, float]:
        """Take a decision of ``mpc`` again."""
        self._ahead[:-1], self._units = case.ground, case.units
        self.mpc.x0, self.mpc.u0 = case.state, case.before
        if not self._started:
            self.mpc.set_initial_guess()
            self._started = True
        began = perf_counter()
        command = self.mpc.make_step(case.state.reshape(-1, 1))
        return float(command[0, 0]), perf_counter() - began
