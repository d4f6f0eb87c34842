"""Train the network of ``trained_policy`` through the equations of motion.

``python -m studies.train_policy --out my_policy.npz`` (needs the extra ``train``). The reference
building, its isolators and the network are simulated in JAX under random motions of several
processes, and the mean of J minus that of the best constant current is minimised by its gradient
through the whole simulation (backpropagation through time, Adam). J is the peak base displacement
and the peak floor acceleration, each over its value without current, added. No recorded motion is
used.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from controllers.clipped_lqr import linear_model
from controllers.predictive import policy_kernel as at
from controllers.trained_policy import LAYERS, WEIGHTS
from ground_motions import mavroeidis_papageorgiou_pulse, motion_mixture
from ground_motions.checks import positive, within
from isolation_sim.errors import InputError, not_installed
from isolation_sim.structures import reference_building, reference_isolators

if TYPE_CHECKING:
    from numpy.typing import NDArray

DT, N_SUB = 0.01, 2
"""Integration step, s, and steps from one decision to the next."""
DECISION = N_SUB * DT
SAMPLES = 2200
"""Of a training motion."""
N_HIDDEN, N_FIRST, N_SECOND = 24, 48, 32
"""Units of the recurrent layer and of both others."""
LAG, HIGHEST = 0.05, 3.0
"""Coil lag, s, and highest current, A."""
CURRENTS = (0.0, 0.125, 0.25, 0.375, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0)
"""Constant currents, A."""
STRONGEST = 5.5
"""Largest ground acceleration of a training motion, m/s^2."""
ODD = (*range(7), 18, 19)
"""Inputs from the ground motion that change their sign with it."""
NOISY = (0, *(at.N_GROUND + k for k in (0, 1, 2, 3, 4, 12)))
"""Inputs with noise: ground acceleration, base motion, three accelerations, roof displacement."""
NOISE = (0.02, 5e-4, 5e-3, 0.02, 0.02, 0.02, 5e-4)
"""Standard deviations of their measurements, SI units."""
FACTORS = 0.8, 1.25
"""True force of the isolators over the nominal one under degraded conditions."""
MOST_LOSS = 2.0
"""J above that of the best constant current beyond which a motion counts no more."""
LARGEST_GRADIENT = 0.5
AVERAGED = 0.98
"""Factor of the moving average of the weights."""
_STEPS_TO_AVERAGE = 50
"""Steps until the average of the weights is better than the last ones."""
_MOTIONS_AT_ONCE = 512
"""Motions that are simulated at once before the training."""


def broadband_motion(draw: np.random.Generator) -> NDArray:
    """Draw a motion with an omega-squared spectrum, some with a soil layer; peak 1.

    Boore, Pure and Applied Geophysics 160 (2003) 635-676: windowed noise with the spectrum of a
    source with a corner frequency.
    """
    n = 4096
    f = np.fft.rfftfreq(n, DT)

    def geometric(low: float, high: float) -> float:
        return float(np.exp(draw.uniform(np.log(low), np.log(high))))

    corner, kappa, cut = geometric(0.06, 0.6), draw.uniform(0.02, 0.08), geometric(0.05, 0.2)
    spectrum = f**2 / (1 + (f / corner) ** 2) * np.exp(-np.pi * kappa * f)
    spectrum /= np.sqrt(1 + (cut / np.maximum(f, 1e-6)) ** 8)
    if draw.random() < 0.5:
        ratio, damping = f / geometric(0.4, 4.0), draw.uniform(0.15, 0.6)
        viscous = (2 * damping * ratio) ** 2
        spectrum *= np.sqrt((1 + viscous) / ((1 - ratio**2) ** 2 + viscous))
    length, peak, end = geometric(4.0, 20.0), draw.uniform(0.1, 0.5), draw.uniform(0.05, 0.3)
    b = -peak * np.log(end) / (1 + peak * (np.log(peak) - 1))
    s = np.arange(n) * DT / length
    window = (np.e / peak) ** b * s**b * np.exp(-b / peak * s)
    noise = draw.standard_normal(n) * window
    motion = np.fft.irfft(np.fft.rfft(noise) * spectrum, n)[: SAMPLES + 200]
    motion = np.concatenate([np.zeros(int(draw.uniform(0, 150))), motion])[:SAMPLES]
    motion[-200:] *= np.linspace(1, 0, 200)
    return motion / np.abs(motion).max()


def pulse(draw: np.random.Generator) -> NDArray:
    """Draw a near-fault pulse of 0.5 to 6.5 s."""
    period = float(np.exp(draw.uniform(np.log(0.5), np.log(6.5))))
    made = mavroeidis_papageorgiou_pulse(
        1.0, period, draw.uniform(1.05, 3.0), draw.uniform(0, 2 * np.pi), DT,
        before=draw.uniform(0.3, 4.0), after=14.0,
    ).acceleration  # fmt: skip
    return _to_length(made) * min(draw.uniform(0.2, 0.8), 4.5 / np.abs(made).max())


def training_motions(count: int, seed: int) -> NDArray:
    """Draw motions, (count, SAMPLES), m/s^2.

    30 % of ``motion_mixture``, half of them with another time scale; 30 % broadband; 15 %
    broadband with a pulse; 10 % a sum of both; 15 % pulses alone.
    """
    draw = np.random.default_rng(seed)
    mixture = motion_mixture(count, seed + 5000)
    result = np.zeros((count, SAMPLES))
    for k in range(count):
        kind = draw.random()
        if kind < 0.30:
            motion = mixture[k].acceleration
            if draw.random() < 0.5:
                scale = np.exp(draw.uniform(np.log(0.6), np.log(1.6)))
                times = np.arange(int(len(motion) * scale)) / scale
                motion = np.interp(times, np.arange(len(motion)), motion)
            motion = _to_length(motion) * np.exp(draw.uniform(-0.4, 0.3))
        elif kind < 0.60:
            motion = broadband_motion(draw) * draw.uniform(1.5, 4.5)
        elif kind < 0.75:
            motion = broadband_motion(draw) * draw.uniform(0.7, 3.0)
            motion = motion + pulse(draw) * draw.uniform(0.4, 1.0)
        elif kind < 0.85:
            motion = _to_length(mixture[k].acceleration) * draw.uniform(0.4, 0.9)
            motion = motion + broadband_motion(draw) * draw.uniform(0.7, 2.5)
        else:
            motion = pulse(draw)
        peak = np.abs(motion).max()
        result[k] = motion * (min(max(peak, 0.5), STRONGEST) / max(peak, 1e-6))
    return result.astype(np.float32)


def _to_length(motion: NDArray) -> NDArray:
    """Cut to the length of a training motion, or continue by zeros."""
    cut = np.asarray(motion)[:SAMPLES]
    return np.pad(cut, (0, SAMPLES - len(cut)))


class Plant(NamedTuple):
    """The reference building in discrete time; forces over the total mass."""

    carried: Any  # (12, 12): Displacements and velocities, over one step
    force: tuple[Any, Any]  # (12,): By the force at both ends of the step
    ground: tuple[Any, Any]  # (12,), s^2: By the ground acceleration at both ends
    on_motion: Any  # (6, 12): Absolute accelerations by the motion
    on_force: Any  # (6,)
    length: float  # Deformation over that of the laboratory device
    scale: float  # Force of the laboratory device over the total mass
    coefficients: tuple[tuple[float, ...], ...]  # Polynomials of the law's parameters
    frequency: float  # First circular frequency without current, rad/s


def plant() -> Plant:
    """Discretise the reference building; force and ground acceleration are lines within a step."""
    from scipy.linalg import expm

    building, device = reference_building(), reference_isolators()
    n, total = building.n_dofs, building.total_mass
    inverse = np.linalg.inv(building.mass)
    a = np.block([
        [np.zeros((n, n)), np.eye(n)],
        [-inverse @ building.stiffness, -inverse @ building.damping],
    ])  # fmt: skip
    by_force = np.concatenate([np.zeros(n), -inverse[0] * total])
    by_ground = np.concatenate([np.zeros(n), -np.ones(n)])

    def carried(b: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        block = np.zeros((2 * n + 2, 2 * n + 2))
        block[: 2 * n, : 2 * n], block[: 2 * n, 2 * n] = a, b
        block[2 * n, 2 * n + 1] = 1 / DT
        whole = expm(block * DT)
        held, sloped = whole[: 2 * n, 2 * n], whole[: 2 * n, 2 * n + 1]
        return whole[: 2 * n, : 2 * n], held - sloped, sloped

    step, *force = carried(by_force)
    _, *ground = carried(by_ground)
    softest = linear_model(building.on(device), np.zeros(1))[0]
    return Plant(
        np.float32(step), (np.float32(force[0]), np.float32(force[1])),
        (np.float32(ground[0]), np.float32(ground[1])), np.float32(a[n:]), np.float32(by_force[n:]),
        device.length, device.force_scale / total,
        tuple(map(tuple, device.current.coefficients[0].tolist())), 2 * np.pi * softest,
    )  # fmt: skip


class DegradedSensing(NamedTuple):
    """Degraded conditions of each motion of a batch."""

    factor: Any  # (count,): True force of the isolators over the nominal one
    late: Any  # (count,): Whether measurements are one decision old
    noise: Any  # (n_decisions, count, 7), SI units: Of the measurements behind ``NOISY``


def draw_sensing(draw: np.random.Generator, n: int, count: int, share: float) -> DegradedSensing:
    """Draw conditions: a share of the motions has noise, delay and a wrong nominal force."""
    degraded = draw.random(count) < share
    factor = np.where(degraded, draw.uniform(*FACTORS, count), 1.0)
    noise = draw.standard_normal((n, count, len(NOISY)), dtype=np.float32) * np.float32(NOISE)
    return DegradedSensing(
        factor.astype(np.float32), degraded & (draw.random(count) < 0.75),
        noise * degraded[:, np.newaxis],
    )  # fmt: skip


@dataclass(frozen=True)
class Training:
    """The simulation and the network in JAX."""

    plant: Plant
    corrections: int = 1  # Evaluations of the isolator's force at the end of a step
    n_ahead: int = 0  # Ground accelerations ahead, one at every ``at.AHEAD``th decision

    def _parameters(self, current: Any) -> list[Any]:
        return [sum(c * current**k for k, c in enumerate(row)) for row in self.plant.coefficients]

    def _force(self, y: Any, z: Any, current: Any, factor: Any) -> Any:
        _, _, _, k1, alpha = self._parameters(current)
        return factor * self.plant.scale * (k1 * y + alpha * z**3)

    def _rates(self, motion: Any, y: Any, z: Any, current: Any) -> tuple[Any, Any]:
        c0, k0, c1, k1, alpha = self._parameters(current)
        n, length = motion.shape[1] // 2, self.plant.length
        x, v = motion[:, 0] / length, motion[:, n] / length
        return v + (k0 * x - (k0 + k1) * y) / c0, v - alpha / c1 * z**3

    def step(
        self, state: tuple, command: Any, ground: tuple, factor: Any = 1.0
    ) -> tuple[tuple, Any]:
        """Advance all motions by one step of Heun's rule; the state and the accelerations."""
        motion, y, z, current = state
        p, h = self.plant, DT
        then = command + (current - command) * float(np.exp(-DT / LAG))
        force = self._force(y, z, current, factor)
        rates = self._rates(motion, y, z, current)
        free = motion @ p.carried.T + force[:, None] * p.force[0]
        free = free + ground[0][:, None] * p.ground[0] + ground[1][:, None] * p.ground[1]
        moved = free + force[:, None] * p.force[1]
        y1, z1 = y + h * rates[0], z + h * rates[1]
        for _ in range(self.corrections):
            ends = self._rates(moved, y1, z1, then)
            y1, z1 = y + h / 2 * (rates[0] + ends[0]), z + h / 2 * (rates[1] + ends[1])
            force = self._force(y1, z1, then, factor)
            moved = free + force[:, None] * p.force[1]
        accelerations = moved @ p.on_motion.T + force[:, None] * p.on_force
        return (moved, y1, z1, then), accelerations

    def _rest(self, count: int, current: Any) -> tuple:
        import jax.numpy as jnp

        n = len(self.plant.carried)
        state = jnp.zeros((count, n)), jnp.zeros(count), jnp.zeros(count), current
        return state, jnp.zeros(count), jnp.zeros(count), jnp.zeros((count, n // 2))

    def _interval(self, carried: tuple, command: Any, ground: tuple, factor: Any = 1.0) -> tuple:
        """From one decision to the next; state, both peaks so far and accelerations."""
        import jax.numpy as jnp

        state, base, floor, accelerations = carried
        for k in range(N_SUB):
            state, accelerations = self.step(state, command, (ground[0][k], ground[1][k]), factor)
            base = jnp.maximum(base, jnp.abs(state[0][:, 0]))
            floor = jnp.maximum(floor, jnp.abs(accelerations).max(1))
        return state, base, floor, accelerations

    @staticmethod
    def _intervals(ground: Any) -> tuple[Any, Any]:
        """Ground accelerations at both ends of every step, by interval."""
        n = (ground.shape[1] - 1) // N_SUB * N_SUB
        both = ground.T[:n], ground.T[1 : n + 1]
        return both[0].reshape(-1, N_SUB, len(ground)), both[1].reshape(-1, N_SUB, len(ground))

    def constant(self, ground: Any, current: float) -> tuple[Any, Any, Any]:
        """Peaks under a constant current, and the response at every decision."""
        import jax
        import jax.numpy as jnp

        count, n = len(ground), len(self.plant.carried) // 2
        held = jnp.full(count, current)

        def advance(carried: tuple, both: tuple) -> tuple[tuple, Any]:
            state, base, floor, accelerations = carried
            now = state[0][:, 0], state[0][:, n], accelerations[:, -1], base, floor
            return self._interval(carried, held, both), jnp.stack(now, -1)

        (_, base, floor, _), course = jax.lax.scan(
            advance, self._rest(count, held), self._intervals(ground)
        )
        return base, floor, course

    def ground_inputs(self, ground: Any) -> tuple[Any, Any, Any]:
        """Inputs from the ground motion at every decision, and both peaks without current.

        As ``controllers.predictive.policy_kernel.fill_inputs``.
        """
        import jax
        import jax.numpy as jnp

        def ahead(course: Any, k: int = self.n_ahead * at.AHEAD) -> Any:
            return jnp.concatenate([course[k:], jnp.repeat(course[-1:], k, axis=0)])

        currents = 0.0, HIGHEST / 3, HIGHEST
        off, third, high = (ahead(self.constant(ground, c)[2]) for c in currents)
        h, w, count = DECISION, self.plant.frequency, len(ground)

        def follow(state: tuple, new: Any) -> tuple[tuple, Any]:
            last, v, x, fast, pga, pgv, rate, moving, samples = state
            mean = 0.5 * (last + new)
            v = v * np.exp(-h / at.SLOW_MEMORY) + h * mean
            x = x * np.exp(-h / at.DISPLACEMENT_MEMORY) + h * v
            fast = fast * np.exp(-h / at.FAST_MEMORY) + h * mean
            pga, pgv = jnp.maximum(pga, jnp.abs(new)), jnp.maximum(pgv, jnp.abs(v))
            changed = jnp.abs(new - samples[0]) / (at.N_SAMPLES * h)
            rate = jnp.maximum(at.RATE_FADING * rate, changed)
            moving = moving + h * (pga > at.FELT)
            samples = jnp.concatenate([samples[1:], new[None]])
            now = new, v, x, fast, pga, pgv, rate, moving
            return (*now, samples), jnp.stack(now, -1)

        zero = jnp.zeros(count)
        decisions = ground.T[::N_SUB][: len(off)]
        begin = (*[zero] * 8, jnp.zeros((at.N_SAMPLES, count)))
        _, course = jax.lax.scan(follow, begin, decisions)
        a = course[..., 0]
        _, v, x, fast, pga, pgv, rate, moving = jnp.moveaxis(ahead(course), -1, 0)
        pga = jnp.maximum(pga, 1e-3)
        x0 = jnp.maximum(off[..., 3], at.LEAST_PEAK * pga / w**2)
        a0 = jnp.maximum(off[..., 4], at.LEAST_PEAK * pga)

        def log(value: Any) -> Any:
            return jnp.log(jnp.maximum(value, 1e-6))

        inputs = [
            a / pga, v / (x0 * w), x / x0, fast / (x0 * w), off[..., 0] / x0,
            off[..., 1] / (x0 * w), off[..., 2] / a0, 0.5 * log(x0 / 0.1), 0.5 * log(a0),
            0.5 * log(0.5 * pga), log(2 * np.pi * pga / jnp.maximum(rate, 1e-3)),
            log(2 * np.pi * jnp.maximum(pgv, 1e-4) / pga), jnp.tanh(moving / 2),
            jnp.tanh(moving / 8), log(high[..., 3] / x0 + 0.01), log(high[..., 4] / a0 + 0.01),
            log(third[..., 3] / x0 + 0.01), log(third[..., 4] / a0 + 0.01), third[..., 0] / x0,
            high[..., 0] / x0,
            *(ahead(a, at.AHEAD * k) / pga for k in range(1, self.n_ahead + 1)),
        ]  # fmt: skip
        return jnp.clip(jnp.stack(inputs, -1), -at.LIMIT, at.LIMIT), x0, a0

    def run(
        self, network: dict, ground: Any, inputs: Any, x0: Any, a0: Any,
        sensing: DegradedSensing | None = None,
    ) -> tuple[Any, Any]:  # fmt: skip
        """Peak base displacement (m) and floor acceleration (m/s^2) with the network."""
        import jax
        import jax.numpy as jnp

        count, n, w = len(ground), len(self.plant.carried) // 2, self.plant.frequency
        # what is known ahead is not late
        measured = np.ones(at.N_GROUND + at.N_MOTION + self.n_ahead, dtype=bool)
        if self.n_ahead:
            measured[1 : at.N_GROUND] = measured[at.N_GROUND + at.N_MOTION :] = False

        def advance(carried: tuple, step: tuple) -> tuple[tuple, None]:
            (state, base, floor, acc), hidden, before = carried
            by_ground, x_unit, a_unit, noise, *both = step
            motion, y, z, current = state
            by_motion = [
                motion[:, 0] / x_unit, motion[:, n] / (x_unit * w), acc[:, 0] / a_unit,
                acc[:, n // 2] / a_unit, acc[:, -1] / a_unit, y * self.plant.length / x_unit,
                z * self.plant.length / x_unit, 2 * current / HIGHEST - 1, base / x_unit,
                floor / a_unit, (jnp.abs(motion[:, 0]) - base) / x_unit,
                (jnp.abs(acc[:, -1]) - floor) / a_unit, 5 * motion[:, n - 1] / x_unit,
            ]  # fmt: skip
            by_noise = noise / jnp.stack(
                [a_unit, x_unit, x_unit * w, a_unit, a_unit, a_unit, x_unit / 5], -1
            )
            split = by_ground[:, : at.N_GROUND], by_ground[:, at.N_GROUND :]
            now = jnp.concatenate([split[0], jnp.stack(by_motion, -1), split[1]], 1)
            now = jnp.clip(now.at[:, NOISY].add(by_noise), -at.LIMIT, at.LIMIT)
            late = False if sensing is None else sensing.late[:, None] & measured
            seen = jnp.where(late, before, now)
            share, hidden = evaluate(network, seen, hidden)
            factor = 1.0 if sensing is None else sensing.factor
            current = HIGHEST * share
            moved = self._interval((state, base, floor, acc), current, tuple(both), factor)
            return (moved, hidden, now), None

        n_decisions = len(inputs)
        both = [one[:n_decisions] for one in self._intervals(ground)]
        noise = jnp.zeros((n_decisions, 1, len(NOISY))) if sensing is None else sensing.noise
        begin = (
            self._rest(count, jnp.zeros(count)), jnp.zeros((count, len(network["Ug"]))),
            jnp.zeros((count, at.N_GROUND + at.N_MOTION + self.n_ahead)),
        )  # fmt: skip
        ((_, base, floor, _), _, _), _ = jax.lax.scan(
            advance, begin, (inputs, x0, a0, noise, *both)
        )
        return base, floor

    def best_constant(self, ground: Any) -> NDArray:
        """Least J of a constant current, and both peaks without current, (3, count)."""
        import jax

        runs = jax.jit(self.constant)
        peaks = np.array([[np.asarray(p) for p in runs(ground, c)[:2]] for c in CURRENTS])
        return np.array([(peaks / peaks[0]).sum(axis=1).min(axis=0), *peaks[0]])

    def loss(
        self,
        network: dict,
        ground: Any,
        inputs: Any,
        units: tuple,
        best: Any,
        sensing: DegradedSensing,
        harm: float,
    ) -> tuple[Any, Any]:
        """Mean loss over the motions, and J minus that of the best constant current."""
        import jax.numpy as jnp

        base, floor = self.run(network, ground, inputs, *units, sensing)
        difference = base / best[1] + floor / best[2] - best[0]
        counted = jnp.minimum(difference, MOST_LOSS)
        return jnp.mean(counted + harm * jnp.maximum(counted, 0.0)), difference


def evaluate(network: dict, x: Any, hidden: Any) -> tuple[Any, Any]:
    """Share of the current's range, and the hidden units' next values."""
    import jax
    import jax.numpy as jnp

    n = hidden.shape[1]
    from_inputs, from_hidden = x @ network["Wg"] + network["bg"], hidden @ network["Ug"]
    reset = jax.nn.sigmoid(from_inputs[:, :n] + from_hidden[:, :n])
    update = jax.nn.sigmoid(from_inputs[:, n : 2 * n] + from_hidden[:, n : 2 * n])
    candidate = jnp.tanh(from_inputs[:, 2 * n :] + reset * from_hidden[:, 2 * n :])
    hidden = update * hidden + (1 - update) * candidate
    layer = jnp.tanh(jnp.concatenate([x, hidden], 1) @ network["W1"] + network["b1"])
    layer = jnp.tanh(layer @ network["W2"] + network["b2"])
    return jax.nn.sigmoid(layer @ network["W3"] + network["b3"])[:, 0], hidden


def new_network(seed: int, n_ahead: int = 0) -> dict[str, NDArray]:
    """Draw random weights; the current is low at first."""
    draw, n = np.random.default_rng(seed), at.N_GROUND + at.N_MOTION + n_ahead

    def layer(inputs: int, outputs: int, size: float = 1.0) -> NDArray:
        return np.float32(size * draw.standard_normal((inputs, outputs)) / np.sqrt(inputs))

    offsets = np.zeros(3 * N_HIDDEN, dtype=np.float32)
    offsets[N_HIDDEN : 2 * N_HIDDEN] = 2.0
    arrays = (
        layer(n, 3 * N_HIDDEN), layer(N_HIDDEN, 3 * N_HIDDEN), offsets,
        layer(n + N_HIDDEN, N_FIRST), np.zeros(N_FIRST, dtype=np.float32),
        layer(N_FIRST, N_SECOND), np.zeros(N_SECOND, dtype=np.float32),
        layer(N_SECOND, 1, 0.1), np.full(1, -2.0, dtype=np.float32),
    )  # fmt: skip
    return dict(zip(LAYERS, arrays, strict=True))


class Batch(NamedTuple):
    """Motions of one step of the training, some of them with the other sign."""

    ground: Any  # (count, n_samples), m/s^2
    inputs: Any  # (n_decisions, count, n_inputs): Of the network, from the ground motion
    units: tuple[Any, Any]  # (n_decisions, count), m and m/s^2: Peaks that scale the other inputs
    best: Any  # (3, count): See ``Training.best_constant``


class TrainingSet(NamedTuple):
    """All training motions, with what does not depend on the network."""

    motions: NDArray  # (count, SAMPLES), m/s^2
    inputs: NDArray  # (n_decisions, count, n_inputs), half precision
    units: tuple[NDArray, NDArray]  # (n_decisions, count), m and m/s^2
    best: NDArray  # (3, count)
    odd: tuple[int, ...]  # Inputs that change their sign with the motion

    @classmethod
    def of(cls, training: Training, motions: NDArray, duration: float) -> TrainingSet:
        """Simulate the motions under constant currents; ``duration`` is used of each, s."""
        import jax

        parts = [
            motions[k : k + _MOTIONS_AT_ONCE] for k in range(0, len(motions), _MOTIONS_AT_ONCE)
        ]
        best = np.concatenate([training.best_constant(part) for part in parts], axis=1)
        ground_inputs = jax.jit(training.ground_inputs)
        inputs, x0, a0 = zip(*(map(np.asarray, ground_inputs(part)) for part in parts), strict=True)
        n = min(round(duration / DECISION), len(inputs[0]))
        halved = [each[:n].astype(np.float16) for each in inputs]
        x0, a0 = ([each[:n] for each in peaks] for peaks in (x0, a0))
        return cls(
            motions[:, : N_SUB * n + 1], np.concatenate(halved, axis=1),
            (np.concatenate(x0, axis=1), np.concatenate(a0, axis=1)), best,
            (*ODD, *range(at.N_GROUND, at.N_GROUND + training.n_ahead)),
        )  # fmt: skip

    def draw(self, draw: np.random.Generator, count: int) -> Batch:
        """Draw motions, each with a random sign."""
        some = draw.choice(len(self.motions), min(count, len(self.motions)), replace=False)
        sign = draw.choice(np.float32([-1.0, 1.0]), len(some))
        inputs = self.inputs[:, some].astype(np.float32)
        inputs[:, :, self.odd] *= sign[:, np.newaxis]
        x0, a0 = self.units
        ground = self.motions[some] * sign[:, np.newaxis]
        return Batch(ground, inputs, (x0[:, some], a0[:, some]), self.best[:, some])


class Adam:
    """Weights that follow clipped gradients (Kingma and Ba 2015), and their moving average."""

    def __init__(self, weights: dict[str, Any]) -> None:
        self.weights, self.average = dict(weights), dict(weights)
        self.first = {name: np.zeros_like(value) for name, value in weights.items()}
        self.second = dict(self.first)

    def update(self, step: int, gradient: dict[str, Any], rate: float) -> bool:
        """Make a step, counted from 1; False, and no change, if the gradient is not finite."""
        import jax.numpy as jnp

        size = float(jnp.sqrt(sum(jnp.sum(g**2) for g in gradient.values())))
        if not np.isfinite(size):
            return False
        clip = min(1.0, LARGEST_GRADIENT / size)
        for name, g in gradient.items():
            self.first[name] = 0.9 * self.first[name] + 0.1 * clip * g
            self.second[name] = 0.99 * self.second[name] + 0.01 * (clip * g) ** 2
            scaled = jnp.sqrt(self.second[name] / (1 - 0.99**step)) + 1e-6
            change = rate * self.first[name] / (1 - 0.9**step) / scaled
            self.weights[name] = self.weights[name] - change
            self.average[name] = AVERAGED * self.average[name] + (1 - AVERAGED) * self.weights[name]
        return True

    def result(self, step: int) -> dict[str, NDArray]:
        """Averaged weights; those of the last step during the first steps."""
        weights = self.average if step > _STEPS_TO_AVERAGE else self.weights
        return {name: np.asarray(value) for name, value in weights.items()}


def learning_rate(step: int, steps: int, highest: float) -> float:
    """Rate of a step: a linear rise, then a cosine down to a twentieth."""
    cosine = 0.05 + 0.475 * (1 + np.cos(np.pi * step / steps))
    return highest * min(1.0, step / 20) * cosine


def train(
    network: dict[str, NDArray], motions: NDArray, steps: int, *, batch: int = 128,
    rate: float = 4e-3, harm: float = 0.3, degraded: float = 0.4, seed: int = 0,
    duration: float = 20.0,
) -> Iterator[tuple[int, float, dict[str, NDArray]]]:  # fmt: skip
    """Train a network: yields the step, its mean J minus constant, and the averaged weights."""
    import jax

    training = Training(plant(), n_ahead=len(network["Wg"]) - at.N_GROUND - at.N_MOTION)
    data = TrainingSet.of(training, motions, duration)
    loss_and_gradient = jax.jit(jax.value_and_grad(partial(training.loss, harm=harm), has_aux=True))
    draw, optimiser = np.random.default_rng(seed), Adam(network)
    for step in range(1, steps + 1):
        some = data.draw(draw, batch)
        sensing = draw_sensing(draw, len(some.inputs), len(some.ground), degraded)
        (_, differences), gradient = loss_and_gradient(
            optimiser.weights, some.ground, some.inputs, some.units, some.best, sensing
        )
        if optimiser.update(step, gradient, learning_rate(step, steps, rate)):
            yield step, float(np.mean(differences)), optimiser.result(step)


def beginning(options: argparse.Namespace) -> dict[str, NDArray]:
    """Network to begin with; what cannot be used is refused before the long work."""
    if find_spec("jax") is None:
        raise not_installed("the training", "jax", "train")
    out: Path = options.out
    if out.suffix != ".npz" or out.exists() or not os.access(out.parent, os.W_OK):
        raise InputError("--out", str(out), "a new file .npz in a folder that can be written to")
    for name, least in (("motions", 1), ("steps", 1), ("seed", 0)):
        if getattr(options, name) < least:
            raise InputError(f"--{name}", str(getattr(options, name)), f"{least} or more")
    positive("--rate", options.rate)
    within("--harm", options.harm, 0.0, np.inf)
    within("--degraded", options.degraded, 0.0, 1.0)
    step = at.AHEAD * DECISION
    n_ahead = round(within("--preview", options.preview, 0.0, np.inf) / step)
    if abs(options.preview - n_ahead * step) > 1e-9:
        raise InputError("--preview", f"{options.preview:g} s", f"a multiple of {step:g} s")
    network = new_network(options.seed, n_ahead)
    if options.begin is None:
        return network
    try:
        with np.load(options.begin) as file:
            found = {name: file[name] for name in LAYERS}
    except (OSError, KeyError, ValueError) as error:
        expected = "a file that this command wrote"
        raise InputError("--begin", f"{options.begin} ({error})", expected) from None
    if [array.shape for array in found.values()] != [array.shape for array in network.values()]:
        trained = (len(found["Wg"]) - at.N_GROUND - at.N_MOTION) * step
        expected = f"a network for --preview {options.preview:g}, not {trained:g}"
        raise InputError("--begin", str(options.begin), expected)
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Train by the command line's arguments."""
    parser = argparse.ArgumentParser(
        prog="python -m studies.train_policy", description=(__doc__ or "").partition("\n")[0],
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )  # fmt: skip
    add = parser.add_argument
    add("--out", type=Path, required=True, help="new file of weights to write, .npz")
    add("--begin", type=Path, help=f"file of weights to begin with, as {WEIGHTS}")
    add("--motions", type=int, default=16384, help="ground motions to train on")
    add("--steps", type=int, default=6000, help="about 0.5 s each on one processor")
    add("--rate", type=float, default=4e-3, help="highest learning rate")
    add("--harm", type=float, default=0.3, help="additional weight of a loss")
    add("--degraded", type=float, default=0.4, help="share of motions with noise, delay and error")
    add("--preview", type=float, default=0.0, help="preview time, s; a multiple of 0.08 s")
    add("--seed", type=int, default=1, help="of weights and motions")
    options = parser.parse_args(arguments)
    try:
        network = beginning(options)
    except InputError as error:
        parser.exit(2, f"train_policy: {error}\n")
    motions = training_motions(options.motions, options.seed)
    began, recent = time.monotonic(), []
    for step, mean, weights in train(
        network,
        motions,
        options.steps,
        rate=options.rate,
        harm=options.harm,
        degraded=options.degraded,
        seed=options.seed,
    ):
        recent.append(mean)
        if step % 100 == 0 or step == options.steps:
            print(f"{step}: {np.mean(recent):+.4f} ({time.monotonic() - began:.0f} s)", flush=True)
            recent.clear()
            np.savez(options.out, **weights)


if __name__ == "__main__":
    main()
