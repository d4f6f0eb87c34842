"""The best currents for a whole ground motion, by sparse direct optimal control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from isolation_sim.laws.emit import symbols
from isolation_sim.simulation.modal import real_rows
from isolation_sim.simulation.plan import modes_for
from isolation_sim.simulation.quantities import quantity_rows
from isolation_sim.simulation.result import Run

from .interval import propagator

_MIDDLE, _END = (5 / 24, 8 / 24, -1 / 24), (4 / 24, 16 / 24, 4 / 24)
"""Lobatto IIIA: states at the middle and the end of an interval from rates at its three nodes."""

_FROM_THE_START = {
    "ipopt.mu_init": 1e-5, "ipopt.bound_push": 1e-6, "ipopt.bound_frac": 1e-6,
    "ipopt.slack_bound_push": 1e-6, "ipopt.slack_bound_frac": 1e-6, "ipopt.mumps_pivot_order": 0,
}  # fmt: skip
"""A barrier so low that the optimum next to the start is found, not the one that a high barrier
leads every start to; and minimum degree ordering, which takes half the time of MUMPS's choice."""

_VARIABLES = ("z", "s", "i", "u", "first", "middle", "last", "s_middle")


@dataclass(frozen=True)
class Optimum:
    """Solution of the whole-record problem: a local optimum."""

    current: NDArray  # (n_commands, n_channels), A: Commands
    peaks: dict[str, float]  # Peaks that the transcription predicts, by quantity, SI units
    objective: float  # Weighted sum of the peaks
    iterations: int  # Of the interior-point method
    status: str  # Its own word on how it ended
    variables: NDArray  # Solution, to start a neighbouring problem from


class WholeRecord:
    """The response to a whole record as equations between one sample and the next."""

    # The modes are carried exactly from sample to sample, with each device's force a quadratic
    # through the ends and the middle of the interval; device states are collocated on the same
    # points (Lobatto IIIA, fourth order); coil currents follow their commands in closed form. Laws
    # are traced from their one definition. Peaks are taken on both sides of every change of current
    # and at three instants of every interval; what lies in between is left to the certificate.
    # start: A run of the structure under the ground motion, such as one of a constant current: it
    # gives the problem its structure, its scales and its first guess.
    # coils: (n_channels, 5): Lag (s), slew (A/s), lowest, highest and initial current (A) of each
    # coil.
    # every: Samples from one command to the next.
    # quantities: Whose peaks count, such as ``"base_displacement_m"``; see
    # ``criteria.quantity_rows``.
    # roughness: Weight of the mean square change from command to command, relative to the coil's
    # range, against the weighted peaks: it settles the currents on which no peak depends.

    def __init__(
        self, start: Run, coils: NDArray, every: int, quantities: Sequence[str], roughness: float
    ):
        self.start, self.coils, self.every = start, coils, every
        self.quantities, self.roughness = tuple(quantities), roughness
        self.isolated = start.isolated
        self.dt = start.records[0].dt
        self.ground = np.stack([record.acceleration for record in start.records])
        self.n = self.ground.shape[1] - 1
        self.modes, self.outputs = modes_for(self.isolated)
        ends = np.cumsum([len(e.device.law.states) for e in self.isolated.elements]).tolist()
        self.own = [slice(a, b) for a, b in zip([0, *ends[:-1]], ends, strict=True)]
        n_elements, n_channels = len(self.own), len(coils)
        self.sizes = {
            "z": 2 * self.modes.eigenvalues.size, "s": ends[-1], "i": n_channels, "u": n_channels,
            "first": n_elements, "middle": n_elements, "last": n_elements, "s_middle": ends[-1],
        }  # fmt: skip

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

    @cached_property
    def guess(self) -> dict[str, NDArray]:
        """Variables of the run to start from, (size, n or n + 1)."""
        run, n = self.start, self.n
        z = run.modal[run.grid.samples].T
        s = np.concatenate([run.states[:, e, : k.stop - k.start].T for e, k in enumerate(self.own)])
        i, u = run.current.T.copy(), run.command[:-1].T
        i[:, 0] = self.coils[:, 4]
        forces = [
            np.array(self._device_side(z[:, at], s[:, at], current)[0])
            for at, current in (
                (slice(0, n), self._coil(i[:, :-1], u, 0.0)), (slice(1, n + 1), i[:, 1:])
            )
        ]  # fmt: skip
        return {
            "z": z, "s": s, "i": i, "u": u[:, :: self.every], "first": forces[0],
            "middle": (forces[0] + forces[1]) / 2, "last": forces[1],
            "s_middle": (s[:, 1:] + s[:, :-1]) / 2,
        }  # fmt: skip

    @cached_property
    def scale(self) -> dict[str, NDArray]:
        """Size of each variable, (size,): its largest in the run to start from."""
        forces = np.concatenate([self.guess[k] for k in ("first", "last")], axis=1)
        sizes = {k: self.guess[k] for k in ("z", "s", "s_middle")}
        sizes |= dict.fromkeys(("first", "middle", "last"), forces)
        scale = {k: np.abs(v).max(axis=1, initial=0.0) for k, v in sizes.items()}
        scale = {k: np.where(v > 1e-6 * v.max(initial=0.0), v, 1.0) for k, v in scale.items()}
        return scale | dict.fromkeys("iu", self.coils[:, 3] - self.coils[:, 2])

    @cached_property
    def _step(self) -> Any:
        """CasADi function: one interval's variables -> scaled defects of its equations."""
        import casadi

        h, n = self.dt, self.sizes
        ends = [(name, n[name]) for name in _VARIABLES]
        ends += [(f"{name}_end", n[name]) for name in "zsi"]
        ends += [(name, len(self.ground)) for name in ("a", "a_end")]
        at = {k: casadi.vertcat(*symbols([f"{k}{j}" for j in range(size)])) for k, size in ends}
        forces = [at[k] for k in ("first", "middle", "last")]

        def carried(t: float) -> Any:
            step = propagator(self.modes, h, t, 3)
            moved = casadi.mtimes(casadi.sparsify(casadi.DM(step.decay)), at["z"])
            for k, force in enumerate(forces):
                moved += casadi.mtimes(casadi.DM(step.force[:, :, k]), force)
            for k, name in enumerate(("a", "a_end")):
                moved += casadi.mtimes(casadi.DM(step.ground[:, :, k]), at[name])
            return moved

        coil = [casadi.vertcat(*self._coil(at["i"], at["u"], t)) for t in (0.0, h / 2, h)]
        sides = [
            self._device_side(at["z"], at["s"], coil[0]),
            self._device_side(carried(h / 2), at["s_middle"], coil[1]),
            self._device_side(at["z_end"], at["s_end"], at["i_end"]),
        ]
        defects = [(at["z_end"] - carried(h), "z"), (at["i_end"] - coil[2], "i")]
        for side, force in zip(sides, forces, strict=True):
            defects.append((casadi.vertcat(*side[0]) - force, "first"))
        for name, rule in (("s_middle", _MIDDLE), ("s_end", _END)):
            grown = sum(w * casadi.vertcat(*side[1]) for w, side in zip(rule, sides, strict=True))
            defects.append((at[name] - at["s"] - h * grown, "s"))
        scaled = casadi.vertcat(*[d / casadi.DM(self.scale[k]) for d, k in defects])
        return casadi.Function("step", list(at.values()), [scaled])

    def _inside(self, var: Mapping[str, Any], ground: Any, tau: float) -> tuple[Any, Any]:
        """Modes and forces at a fraction tau of every interval, (2 n_modes, n), (n_elements, n)."""
        import casadi

        step = propagator(self.modes, self.dt, tau * self.dt, 3)
        moved = casadi.mtimes(casadi.sparsify(casadi.DM(step.decay)), var["z"][:, :-1])
        for k, name in enumerate(("first", "middle", "last")):
            moved += casadi.mtimes(casadi.DM(step.force[:, :, k]), var[name])
        for k, a in enumerate((ground[:, :-1], ground[:, 1:])):
            moved += casadi.mtimes(casadi.DM(step.ground[:, :, k]), a)
        early, late = 1.0 - tau, 2.0 * tau - 1.0
        force = -early * late * var["first"] + 4.0 * early * tau * var["middle"]
        return moved, force + tau * late * var["last"]

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
    def _problem(self) -> Any:
        """The sparse nonlinear programme; weights and bounds of the peaks are its parameters."""
        import casadi

        n, sizes = self.n, self.sizes
        counts = {k: n for k in _VARIABLES} | dict.fromkeys("zsi", n + 1)
        counts["u"] = self.guess["u"].shape[1]
        raw = {k: casadi.MX.sym(k, sizes[k], counts[k]) for k in _VARIABLES}
        var = {k: casadi.repmat(casadi.DM(self.scale[k]), 1, counts[k]) * v for k, v in raw.items()}
        peaks = casadi.MX.sym("peaks", len(self.quantities))
        weights = casadi.MX.sym("weights", len(self.quantities))
        command = var["u"][:, (np.arange(n) // self.every).tolist()]
        before = [var[k][:, :-1] if k in "zsi" else var[k] for k in _VARIABLES]
        before[_VARIABLES.index("u")] = command
        after = [var[k][:, 1:] for k in "zsi"]
        a = casadi.DM(self.ground)
        defects = self._step.map(n)(*before, *after, a[:, :-1], a[:, 1:])
        within: list[Any] = []
        # before a change of current, after the last one, and between them
        sides = [(var["z"][:, 1:], var["last"]), (var["z"][:, :-1], var["first"])]
        sides += [self._inside(var, a, tau) for tau in (0.25, 0.5, 0.75)]
        for k, quantity in enumerate(self.quantities):
            on_modes, on_force = self._rows(quantity)
            for z, force in sides if on_force.any() else sides[:1]:
                for item in range(len(on_modes)):
                    value = casadi.mtimes(casadi.DM(on_modes[item]), z)
                    value += casadi.mtimes(casadi.DM(on_force[item]), force)
                    value /= self.peaks_of_start[k]
                    if len(on_modes[item]) == 1:
                        within += [(peaks[k] - value).T, (peaks[k] + value).T]
                    else:
                        within.append((peaks[k] ** 2 - casadi.sum1(value**2)).T)
        driven = np.flatnonzero(np.isfinite(self.coils[:, 1])).tolist()
        for c in driven:
            lag, slew = self.coils[c, :2]
            past = casadi.horzcat(self.coils[c, 4], command[c, :-1])
            rate = (command[c, :] - (var["i"][c, :-1] if lag > 0 else past)) / (lag or self.dt)
            within += [(slew - rate).T / slew, (slew + rate).T / slew]
        inequality = casadi.vertcat(*within)
        change = casadi.diff(raw["u"], 1, 1)
        smooth = self.roughness * casadi.sumsqr(change) / max(change.shape[1], 1)
        x = casadi.vertcat(*[casadi.vec(raw[k]) for k in _VARIABLES], peaks)
        equality = casadi.vec(defects)
        self._n_equal, self._n_within = equality.shape[0], inequality.shape[0]
        return {
            "x": x, "p": weights, "f": casadi.dot(weights, peaks) + smooth,
            "g": casadi.vertcat(equality, inequality),
        }  # fmt: skip

    @cached_property
    def peaks_of_start(self) -> NDArray:
        """Peak of each quantity in the run to start from, SI units."""
        return np.array([self.start.criteria[f"peak_{q}"] for q in self.quantities])

    def packed(self, guess: Mapping[str, NDArray]) -> NDArray:
        """Scaled variables in the programme's order, the peaks last."""
        parts = [(guess[k] / self.scale[k][:, np.newaxis]).ravel(order="F") for k in _VARIABLES]
        return np.concatenate([*parts, np.ones(len(self.quantities))])

    def solve(
        self,
        weights: Mapping[str, float],
        bounds: Mapping[str, float] | None = None,
        start: NDArray | None = None,
        iterations: int = 300,
        tolerance: float = 1e-5,
    ) -> Optimum:
        """Minimise a weighted sum of peaks."""
        x0 = self.packed(self.guess) if start is None else start
        low, high = self._box(bounds or {})
        w = self._scaled(weights)
        solver = _interior_point("whole_record", self._problem, iterations, tolerance)
        lowest, highest = self._ends()
        solved = solver(x0=x0, p=w, lbx=low, ubx=high, lbg=lowest, ubg=highest)
        return self._optimum(np.asarray(solved["x"]).ravel(), w, solver.stats())

    def _scaled(self, weights: Mapping[str, float]) -> NDArray:
        """Weights of the peaks as the programme scales them."""
        return np.array([weights.get(q, 0.0) for q in self.quantities]) * self.peaks_of_start

    def _ends(self) -> tuple[NDArray, NDArray]:
        """Limits of the programme's constraints."""
        high = np.concatenate([np.zeros(self._n_equal), np.full(self._n_within, np.inf)])
        return np.zeros(len(high)), high

    def _box(self, bounds: Mapping[str, float]) -> tuple[NDArray, NDArray]:
        """Limits of the scaled variables: coils, state at the start, and bounds of the peaks."""
        low: list[NDArray] = []
        high: list[NDArray] = []
        for name in _VARIABLES:
            size, guess = self.sizes[name], self.guess[name] / self.scale[name][:, np.newaxis]
            least, most = np.full_like(guess, -np.inf), np.full_like(guess, np.inf)
            if name in "iu":
                least[:], most[:] = (self.coils[:, [2, 3]] / self.scale[name][:, np.newaxis]).T[
                    ..., np.newaxis
                ]
            if name in "zsi" and size:
                least[:, 0] = most[:, 0] = guess[:, 0]
            low.append(least.ravel(order="F"))
            high.append(most.ravel(order="F"))
        most = [bounds.get(q, np.inf) for q in self.quantities] / self.peaks_of_start
        return np.concatenate([*low, np.zeros(len(most))]), np.concatenate([*high, most])

    @property
    def _commands(self) -> slice:
        """Place of the commands among the variables."""
        before = sum(self.guess[k].size for k in _VARIABLES[: _VARIABLES.index("u")])
        return slice(before, before + self.guess["u"].size)

    def _optimum(self, x: NDArray, w: NDArray, stats: Mapping[str, Any]) -> Optimum:
        """Solution in SI units."""
        peaks = x[-len(self.quantities) :]
        u = x[self._commands].reshape(-1, self.sizes["u"]) * self.scale["u"]
        return Optimum(
            np.clip(u, self.coils[:, 2], self.coils[:, 3]),
            dict(zip(self.quantities, (peaks * self.peaks_of_start).tolist(), strict=True)),
            float(w @ peaks), stats["iter_count"], stats["return_status"], x,
        )  # fmt: skip


def solve_together(
    problems: Sequence[WholeRecord],
    weights: Sequence[Mapping[str, float]],
    references: Sequence[float],
    shared: Sequence[int],
    iterations: int = 300,
    tolerance: float = 1e-5,
) -> list[Optimum]:
    """Minimise the largest weighted sum of peaks over its reference, first commands being shared.

    ``shared``: commands that a problem has in common with the first one. Rockafellar and Wets 1991:
    scenarios and the nonanticipativity of decisions.
    """
    import casadi

    worst = casadi.MX.sym("worst")
    w = [one._scaled(own) for one, own in zip(problems, weights, strict=True)]
    objective, constraints, lowest, highest, excesses = worst, [], [], [], []
    first = problems[0]._problem["x"][problems[0]._commands]
    for one, own, reference, n in zip(problems, w, references, shared, strict=True):
        x, n_shared = one._problem["x"], n * one.sizes["u"]
        objective += casadi.substitute(one._problem["f"], one._problem["p"], np.zeros(len(own)))
        excess = casadi.dot(casadi.DM(own), x[-len(own) :]) - reference
        apart = x[one._commands][:n_shared] - first[:n_shared]
        constraints += [one._problem["g"], worst - excess, apart]
        low, high = one._ends()
        lowest += [low, np.zeros(1 + n_shared)]
        highest += [high, [np.inf], np.zeros(n_shared)]
        excesses.append(own.sum() - reference)
    programme = {
        "x": casadi.vertcat(*[one._problem["x"] for one in problems], worst), "f": objective,
        "g": casadi.vertcat(*constraints),
    }  # fmt: skip
    boxes = [one._box({}) for one in problems]
    solver = _interior_point("together", programme, iterations, tolerance)
    solved = solver(
        x0=np.concatenate([*(one.packed(one.guess) for one in problems), [max(excesses)]]),
        lbx=np.concatenate([*(low for low, _ in boxes), [-np.inf]]),
        ubx=np.concatenate([*(high for _, high in boxes), [np.inf]]),
        lbg=np.concatenate(lowest),
        ubg=np.concatenate(highest),
    )
    ends = np.cumsum([len(low) for low, _ in boxes])
    parts = np.split(np.asarray(solved["x"]).ravel(), ends)
    given = zip(problems, parts, w, strict=False)
    return [one._optimum(x, own, solver.stats()) for one, x, own in given]


def _interior_point(
    name: str, programme: Mapping[str, Any], iterations: int, tolerance: float
) -> Any:
    import casadi

    options: dict[str, Any] = {
        "ipopt.max_iter": iterations, "ipopt.tol": tolerance, "ipopt.print_level": 0,
        "print_time": False, "ipopt.sb": "yes", **_FROM_THE_START,
    }  # fmt: skip
    return casadi.nlpsol(name, "ipopt", dict(programme), options)


def _along(row: NDArray, vector: Any) -> Any:
    if isinstance(vector, np.ndarray):
        return row @ vector
    return sum(float(w) * vector[k] for k, w in enumerate(row) if w != 0.0)
