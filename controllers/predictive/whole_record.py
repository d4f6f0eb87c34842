"""The best currents for a whole ground motion, by direct optimal control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.errors import InputError
from isolation_sim.laws.emit import symbols
from isolation_sim.simulation.complex_modes import real_rows
from isolation_sim.simulation.outputs import quantity_rows
from isolation_sim.simulation.plan import modes_for
from isolation_sim.simulation.result import Run
from isolation_sim.structures import IsolatedStructure

from .condense_kernel import largest_gap
from .prediction import propagator

_MIDDLE, _END = (5 / 24, 8 / 24, -1 / 24), (4 / 24, 16 / 24, 4 / 24)
"""Lobatto IIIA: states at the middle and the end of an interval from rates at its three nodes."""

_BARRIER = 1e-5
"""So low at first that the optimum next to the start is found, not the one that a high barrier
leads every start to."""
_TOLERANCE = 1e-5

_STATES = ("z", "s", "i", "past", "peaks")
_CONTROLS = ("u", "first", "middle", "last", "s_middle", "s_end")


@dataclass(frozen=True)
class Optimum:
    """Solution of the whole-record problem: a local optimum."""

    current: NDArray  # (n_commands, n_channels), A: Commands
    peaks: dict[str, float]  # Peaks that the transcription predicts, by quantity, SI units
    objective: float  # Weighted sum of the peaks
    iterations: int  # Iterations of the interior-point method
    solved: bool  # Whether it ended within its tolerance
    variables: NDArray  # Solution, to start a neighbouring problem from


class WholeRecord:
    """The response to a whole record as equations between one sample and the next."""

    # The modes are carried exactly from sample to sample, with each device's force a quadratic
    # through the ends and the middle of the interval; device states are collocated on the same
    # points (Lobatto IIIA, fourth order); coil currents follow their commands in closed form. Laws
    # are traced from their one definition. Peaks are taken on both sides of every change of current
    # and at three instants of every interval; the certificate checks the instants in between.
    # Every interval is a stage of an optimal control problem: modes, device states, currents, the
    # last commands and the peaks are its state; commands, forces and what is collocated are its
    # controls. The solver goes from stage to stage, so that its time grows with their number.
    # dt, n: Sampling interval (s) of the ground motion, and number of its intervals.
    # coils: (n_channels, 5): Lag (s), slew (A/s), lowest, highest and initial current (A) of each
    # coil.
    # every: Samples from one command to the next.
    # quantities: Whose peaks count, such as ``"base_displacement_m"``; see
    # ``criteria.quantity_rows``.
    # roughness: Weight of the mean square change from command to command, relative to the coil's
    # range, against the weighted peaks: it determines the currents on which no peak depends.
    # iterations: Most of the interior-point method.

    def __init__(
        self, isolated: IsolatedStructure, dt: float, n: int, coils: NDArray, every: int,
        quantities: Sequence[str], roughness: float, iterations: int,
    ):  # fmt: skip
        self.isolated, self.dt, self.n, self.coils, self.every = isolated, dt, n, coils, every
        self.quantities, self.roughness = tuple(quantities), roughness
        self.iterations = iterations
        self.modes, self.outputs = modes_for(isolated)
        ends = np.cumsum([len(e.device.law.states) for e in isolated.elements]).tolist()
        self.own = [slice(a, b) for a, b in zip([0, *ends[:-1]], ends, strict=True)]
        z, s, i, e = 2 * self.modes.eigenvalues.size, ends[-1], len(coils), len(self.own)
        self.sizes = {
            "z": z, "s": s, "i": i, "past": i, "peaks": len(self.quantities),
            "u": i, "first": e, "middle": e, "last": e, "s_middle": s, "s_end": s,
        }  # fmt: skip
        self.n_states = sum(self.sizes[k] for k in _STATES)
        self.n_initial = self.n_states - self.sizes["peaks"]
        self.n_variables = sum(self.sizes.values())

    def _device_side(self, z: Any, s: Any, i: Any) -> tuple[list, list]:
        """Each device's force beyond its reference (N, device scale), and all state rates."""
        forces: list[Any] = []
        rates: list[Any] = []
        modes = self.modes
        motion = real_rows(modes.deformation)
        for e, element in enumerate(self.isolated.elements):
            x, v = (_along(row, z) for row in motion[e])
            own = tuple(s[k] for k in range(self.own[e].start, self.own[e].stop))
            current = 0.0 if element.channel is None else i[element.channel]
            parameters = element.device.parameters_at(current)
            force = element.device.law.force(x, v, own, parameters)
            forces.append(force - modes.stiffness[e] * x - modes.damping[e] * v)
            rates.extend(element.device.law.rates(x, v, own, parameters))
        return forces, rates

    def _coil(self, i: Any, u: Any, t: float) -> list:
        """Coil currents a time t after commands were given; just after them for t = 0."""
        decay = [np.exp(-t / lag) if lag > 0 else 0.0 for lag in self.coils[:, 0]]
        return [u[c] + (i[c] - u[c]) * k for c, k in enumerate(decay)]

    def guess(self, run: Run) -> dict[str, NDArray]:
        """Variables of a run, (size, n or n + 1), SI units; peaks relative to the run's own."""
        n = self.n
        z = run.modal[run.grid.samples].T
        s = np.concatenate([run.states[:, e, : k.stop - k.start].T for e, k in enumerate(self.own)])
        i, u, initial = run.current.T.copy(), run.command[:-1].T, self.coils[:, 4:]
        u = np.repeat(u[:, :: self.every], self.every, axis=1)[:, :n]
        i[:, :1] = initial
        first, last = (
            np.array(self._device_side(z[:, at], s[:, at], current)[0])
            for at, current in (
                (slice(0, n), self._coil(i[:, :-1], u, 0.0)), (slice(1, n + 1), i[:, 1:])
            )
        )  # fmt: skip
        return {
            "z": z, "s": s, "i": i, "past": np.hstack([initial, u]),
            "peaks": np.ones((self.sizes["peaks"], n + 1)), "u": u, "first": first,
            "middle": (first + last) / 2, "last": last, "s_middle": (s[:, 1:] + s[:, :-1]) / 2,
            "s_end": s[:, 1:],
        }  # fmt: skip

    def scale(self, guess: Mapping[str, NDArray]) -> NDArray:
        """Size of each variable of a stage, (n_variables,): its largest in a guess."""
        force = np.concatenate([guess[k] for k in ("first", "last")], axis=1)
        alike = {"s_middle": "s", "s_end": "s"}
        scale = {}
        for k in (*_STATES, *_CONTROLS):
            of = force if k in ("first", "middle", "last") else guess[alike.get(k, k)]
            largest = np.abs(of).max(axis=1, initial=0.0)
            top = largest.max(initial=0.0)
            scale[k] = np.where(largest > 1e-6 * top, largest, top or 1.0)
        scale |= dict.fromkeys(("i", "u", "past"), self.coils[:, 3] - self.coils[:, 2])
        return np.concatenate(list(scale.values()))

    def _rows(self, quantity: str) -> tuple[NDArray, NDArray]:
        """Rows of a quantity's items over the modes and over the devices' forces beyond reference.

        (n_items, n_directions, 2 n_modes) and (n_items, n_directions, n_elements).
        """
        rows = quantity_rows(self.isolated, self.outputs.names)[quantity] @ self.outputs.rows
        n, m = self.sizes["z"], len(self.own)
        x, v = np.moveaxis(real_rows(self.modes.deformation), 1, 0)
        force = rows[..., n : n + m]
        reference = self.modes.stiffness[:, np.newaxis] * x + self.modes.damping[:, np.newaxis] * v
        return rows[..., :n] + force @ reference, force

    @cached_property
    def _stage(self) -> Any:
        """CasADi function: scaled next state, equations, inequalities and cost of an interval."""
        import casadi

        h, n_ground = self.dt, len(self.isolated.structure.directions)
        raw, scale = {}, {}
        for k in (*_STATES, *_CONTROLS):
            raw[k], scale[k] = (
                casadi.vertcat(*symbols([f"{k}{j}{what}" for j in range(self.sizes[k])]))
                for what in ("", "_scale")
            )
        at = {k: raw[k] * scale[k] for k in raw}
        ground = [
            casadi.vertcat(*symbols([f"{k}{j}" for j in range(n_ground)])) for k in ("a", "a_end")
        ]
        unit = casadi.vertcat(*symbols([f"{q}_peak" for q in self.quantities]))
        forces = [at[k] for k in ("first", "middle", "last")]

        def carried(t: float) -> Any:
            step = propagator(self.modes, h, t, 3)
            moved = casadi.mtimes(casadi.sparsify(casadi.DM(step.decay)), at["z"])
            for k, force in enumerate(forces):
                moved += casadi.mtimes(casadi.DM(step.force[:, :, k]), force)
            for k, a in enumerate(ground):
                moved += casadi.mtimes(casadi.DM(step.ground[:, :, k]), a)
            return moved

        def inside(tau: float) -> tuple[Any, Any]:
            early, late = 1.0 - tau, 2.0 * tau - 1.0
            force = -early * late * forces[0] + 4.0 * early * tau * forces[1]
            return carried(tau * h), force + tau * late * forces[2]

        coil = [casadi.vertcat(*self._coil(at["i"], at["u"], t)) for t in (0.0, h / 2, h)]
        sides = [
            self._device_side(at["z"], at["s"], coil[0]),
            self._device_side(carried(h / 2), at["s_middle"], coil[1]),
            self._device_side(carried(h), at["s_end"], coil[2]),
        ]
        following = casadi.vertcat(
            carried(h) / scale["z"], raw["s_end"], coil[2] / scale["i"], raw["u"], raw["peaks"]
        )
        equal = [
            (casadi.vertcat(*side[0]) - force) / scale["first"]
            for side, force in zip(sides, forces, strict=True)
        ]
        for name, rule in (("s_middle", _MIDDLE), ("s_end", _END)):
            grown = sum(w * casadi.vertcat(*side[1]) for w, side in zip(rule, sides, strict=True))
            equal.append((at[name] - at["s"] - h * grown) / scale["s"])
        # before a change of current, after the last one, and between them
        instants = [(carried(h), forces[2]), (at["z"], forces[0])]
        instants += [inside(tau) for tau in (0.25, 0.5, 0.75)]
        within = [*self._below_peaks(instants, raw["peaks"], unit), *self._slew_limits(at)]
        smooth = self.roughness / self.n * casadi.sumsqr(raw["u"] - raw["past"])
        state, control = (
            casadi.vertcat(*[raw[k] for k in names]) for names in (_STATES, _CONTROLS)
        )
        numbers = casadi.vertcat(*scale.values(), unit)
        results = [following, casadi.vertcat(*equal), casadi.vertcat(*within), smooth]
        return casadi.Function("stage", [state, control, *ground, numbers], results)

    def _below_peaks(self, instants: Sequence[tuple[Any, Any]], peaks: Any, unit: Any) -> list[Any]:
        """Peaks minus the outputs, which are at least 0, at instants with modes and forces."""
        import casadi

        within: list[Any] = []
        for which, quantity in enumerate(self.quantities):
            on_modes, on_force = self._rows(quantity)
            for z, force in instants if on_force.any() else instants[:1]:
                for item in range(len(on_modes)):
                    value = casadi.mtimes(casadi.DM(on_modes[item]), z)
                    value += casadi.mtimes(casadi.DM(on_force[item]), force)
                    value /= unit[which]
                    if len(on_modes[item]) == 1:
                        within += [peaks[which] - value, peaks[which] + value]
                    else:
                        within.append(peaks[which] ** 2 - casadi.sumsqr(value))
        return within

    def _slew_limits(self, at: Mapping[str, Any]) -> list[Any]:
        """Slew rates left, at least 0, of the coils with a limit."""
        within: list[Any] = []
        for c in np.flatnonzero(np.isfinite(self.coils[:, 1])).tolist():
            lag, slew = self.coils[c, :2]
            rate = at["u"][c] - (at["i"] if lag > 0 else at["past"])[c]
            rate /= largest_gap(lag, slew, self.dt)
            within += [1.0 - rate, 1.0 + rate]
        return within

    @cached_property
    def _programme(self) -> tuple[dict[str, Any], NDArray, list[int]]:
        """Programme, which of its constraints are equations, and constraints of each stage."""
        import casadi

        n, n_x, n_initial, n_u = self.n, self.n_states, self.n_initial, self.sizes["u"]
        stages = casadi.MX.sym("stages", self.n_variables, n)
        end = casadi.MX.sym("end", n_x)
        weights = casadi.MX.sym("weights", self.sizes["peaks"])
        initial = casadi.MX.sym("initial", n_initial)
        ground = casadi.MX.sym("ground", len(self.isolated.structure.directions), n + 1)
        units = casadi.MX.sym("units", self.n_variables + self.sizes["peaks"])
        state = stages[:n_x, :]
        following, equal, within, smooth = self._stage.map("stages", "serial", n, [4], [])(
            state, stages[n_x:, :], ground[:, :-1], ground[:, 1:], units
        )
        changes = stages[n_x : n_x + n_u, :] - state[n_initial - n_u : n_initial, :]
        start = state[:n_initial, :] - casadi.repmat(initial, 1, n)
        carried = casadi.horzcat(state[:, 1:], end) - following
        blocks = (carried, start, changes, equal, within)
        applies = np.ones((sum(block.shape[0] for block in blocks), n), bool)
        applies[n_x : n_x + n_initial, 1:] = False
        applies[n_x + n_initial : n_x + n_initial + n_u] = np.arange(n) % self.every != 0
        equation = np.ones_like(applies)
        equation[len(applies) - within.shape[0] :] = False
        equation = equation.T[applies.T]
        problem = {
            "x": casadi.vertcat(casadi.vec(stages), end),
            "p": casadi.vertcat(weights, initial, casadi.vec(ground), units),
            "f": casadi.dot(weights, end[n_initial:]) + casadi.sum2(smooth),
            "g": casadi.vec(casadi.vertcat(*blocks))[np.flatnonzero(applies.T).tolist()],
        }
        return problem, equation, applies[n_x:].sum(axis=0).tolist()

    @cached_property
    def _solver(self) -> Any:
        import casadi

        problem, equation, counts = self._programme
        n, n_x = self.n, self.n_states
        options = {
            "structure_detection": "manual", "N": n, "nx": [n_x] * (n + 1),
            "nu": [self.n_variables - n_x] * n + [0],
            "ng": [*counts, 0], "equality": equation.tolist(),
            "fatrop": {
                "print_level": 0, "max_iter": self.iterations, "tolerance": _TOLERANCE,
                "mu_init": _BARRIER,
            },
            "print_time": False,
        }  # fmt: skip
        return casadi.nlpsol("whole_record", "fatrop", problem, options)

    def packed(self, guess: Mapping[str, NDArray]) -> NDArray:
        """Scaled variables of a guess in the programme's order."""
        scale = self.scale(guess)
        stages = np.concatenate([guess[k][:, : self.n] for k in (*_STATES, *_CONTROLS)])
        end = np.concatenate([guess[k][:, self.n] for k in _STATES])
        return np.append((stages.T / scale).ravel(), end / scale[: self.n_states])

    def solve(
        self,
        start: Run,
        weights: Mapping[str, float],
        bounds: Mapping[str, float] | None = None,
        variables: NDArray | None = None,
    ) -> Optimum:
        """Minimise a weighted sum of peaks under a run's ground motion.

        The run gives the scales too, and the first guess without ``variables``.
        """
        equation = self._programme[1]
        x0, numbers = self._guess_and_parameters(start, weights)
        low, high = self._box(start, bounds or {})
        self._check_curvature(x0, numbers)
        solved = self._solver(
            x0=x0 if variables is None else variables, p=numbers, lbx=low, ubx=high,
            lbg=0.0, ubg=np.where(equation, 0.0, np.inf),
        )  # fmt: skip
        x = np.asarray(solved["x"]).ravel()
        return self._optimum(x, start, weights, self._solver.stats())

    def _check_curvature(self, x0: NDArray, numbers: NDArray) -> None:
        """Refuse a law without second derivatives at the start: the solver would never end."""
        *_, curvature = self._solver.get_function("nlp_hess_l")(x0, numbers, 1.0, 1.0)
        if not np.isfinite(curvature.nonzeros()).all():
            laws = ", ".join(law.name for law in self.isolated.group_laws)
            raise InputError(
                f"clairvoyant: the second derivatives of the law are not finite at rest ({laws}); "
                "expected: a law without a power below 2 of a quantity that is 0 at rest"
            )

    def solve_together(
        self, starts: Sequence[Run], weights: Sequence[Mapping[str, float]],
        references: Sequence[float], shared: Sequence[int],
    ) -> list[Optimum]:  # fmt: skip
        """Minimise the largest weighted sum of peaks over its reference, over several motions.

        ``shared``: intervals in which a motion's commands are those of the first one.
        """
        import casadi

        problem, equation, _ = self._programme
        one = casadi.Function("one", [problem["x"], problem["p"]], [problem["f"], problem["g"]])
        together = casadi.MX.sym("together", problem["x"].shape[0], len(starts))
        worst = casadi.MX.sym("worst")
        objective, constraints, boxes = worst, [], []
        guess: list[NDArray] = []
        highest: list[NDArray] = []
        excesses: list[float] = []
        for k, (run, own) in enumerate(zip(starts, weights, strict=True)):
            x0, numbers = self._guess_and_parameters(run, own)
            w = numbers[: self.sizes["peaks"]].copy()
            numbers[: len(w)] = 0.0
            smooth, equations = one(together[:, k], numbers)
            excess = casadi.dot(casadi.DM(w), together[-len(w) :, k]) - references[k]
            commands = self._commands[: shared[k] : self.every].ravel().tolist() if k else []
            objective += smooth
            constraints += [
                equations,
                worst - excess,
                together[commands, k] - together[commands, 0],
            ]
            highest += [
                np.where(equation, 0.0, np.inf),
                np.full(1, np.inf),
                np.zeros(len(commands)),
            ]
            guess.append(x0)
            boxes.append(self._box(run, {}))
            excesses.append(float(w.sum()) - references[k])
        options: dict[str, Any] = {
            "ipopt.max_iter": self.iterations, "ipopt.tol": _TOLERANCE, "ipopt.print_level": 0,
            "ipopt.mu_init": _BARRIER, "ipopt.bound_push": 1e-6, "ipopt.bound_frac": 1e-6,
            "ipopt.slack_bound_push": 1e-6, "ipopt.slack_bound_frac": 1e-6,
            "ipopt.mumps_pivot_order": 0, "ipopt.sb": "yes", "print_time": False,
        }  # fmt: skip
        programme = {
            "x": casadi.vertcat(casadi.vec(together), worst), "f": objective,
            "g": casadi.vertcat(*constraints),
        }  # fmt: skip
        solver = casadi.nlpsol("together", "ipopt", programme, options)
        solved = solver(
            x0=np.append(np.concatenate(guess), max(excesses)),
            lbx=np.append(np.concatenate([low for low, _ in boxes]), -np.inf),
            ubx=np.append(np.concatenate([high for _, high in boxes]), np.inf),
            lbg=0.0, ubg=np.concatenate(highest),
        )  # fmt: skip
        parts = np.asarray(solved["x"]).ravel()[:-1].reshape(len(starts), -1)
        solutions = zip(parts, starts, weights, strict=True)
        return [self._optimum(x, run, own, solver.stats()) for x, run, own in solutions]

    @property
    def _commands(self) -> NDArray:
        """Places of the commands among the variables, (n, n_channels)."""
        first = np.arange(self.n)[:, np.newaxis] * self.n_variables + self.n_states
        return first + np.arange(self.sizes["u"])

    def _guess_and_parameters(
        self, run: Run, weights: Mapping[str, float]
    ) -> tuple[NDArray, NDArray]:
        """Scaled variables of a run, and the programme's parameters, the weights first."""
        guess = self.guess(run)
        scale, x0 = self.scale(guess), self.packed(guess)
        ground = np.stack([record.acceleration for record in run.records])
        peaks = self._peaks(run)
        w = np.array([weights.get(q, 0.0) for q in self.quantities]) * peaks
        return x0, np.concatenate([w, x0[: self.n_initial], ground.ravel("F"), scale, peaks])

    def _peaks(self, run: Run) -> NDArray:
        """Peaks of a run, SI units."""
        return np.array([run.criteria[f"peak_{q}"] for q in self.quantities])

    def _box(self, run: Run, bounds: Mapping[str, float]) -> tuple[NDArray, NDArray]:
        """Limits of the scaled variables: coils, and bounds of the peaks."""
        high = np.full(self.n * self.n_variables + self.n_states, np.inf)
        low = -high
        reach = self.coils[:, 3] - self.coils[:, 2]
        low[self._commands], high[self._commands] = (self.coils[:, [2, 3]].T / reach)[:, np.newaxis]
        most = np.array([bounds.get(q, np.inf) for q in self.quantities])
        high[-len(most) :] = most / self._peaks(run)
        return low, high

    def _optimum(
        self, x: NDArray, run: Run, weights: Mapping[str, float], stats: Mapping[str, Any]
    ) -> Optimum:
        """Solution in SI units."""
        u = x[self._commands[:: self.every]] * (self.coils[:, 3] - self.coils[:, 2])
        u = np.clip(u, self.coils[:, 2], self.coils[:, 3])
        values = x[-len(self.quantities) :] * self._peaks(run)
        least = dict(zip(self.quantities, values.tolist(), strict=True))
        objective = sum(w * least[q] for q, w in weights.items())
        return Optimum(u, least, objective, stats["iter_count"], stats["success"], x)


def _along(row: NDArray, vector: Any) -> Any:
    if isinstance(vector, np.ndarray):
        return row @ vector
    return sum(float(w) * vector[k] for k, w in enumerate(row) if w != 0.0)
