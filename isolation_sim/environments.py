"""Gymnasium environments: an isolated building under random motions of a set.

Importing this module registers ``isolation_sim/ReferenceBuilding-v0``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground_motions import Record, kanai_tajimi_motion

from .errors import Diverged, InputError, not_installed
from .simulation.control import CoilDriver, Sensors
from .simulation.outputs import output_names
from .simulation.simulator import Simulator
from .simulation.vector_simulator import VectorSimulator
from .structures import IsolatedStructure, reference_building, reference_isolators

try:
    import gymnasium
    from gymnasium import spaces
    from gymnasium.vector import AutoresetMode
    from gymnasium.vector.utils import batch_space
except ModuleNotFoundError:
    raise not_installed("isolation_sim.environments", "gymnasium", "gym") from None

OBSERVATIONS = (
    "base_displacement_m", "base_velocity_m_s", "base_acceleration_m_s2",
    "floor5_acceleration_m_s2",
)  # fmt: skip
"""Default observations of the reference building, before the coil current."""

COST = {"base_displacement_m": 0.1, "floor5_acceleration_m_s2": 1.0}
"""Size of each output for a cost of 1 per second: about the RMS under strong motion."""

PENALTY = 1000.0
"""Cost of a response outside the range of the law, which ends the episode."""


def training_motions() -> list[Record]:
    """Return the default motions: 32 Kanai-Tajimi motions, firm soil, 16 s, 1.5 to 4.5 m/s^2."""
    peaks = np.linspace(1.5, 4.5, 32)
    return [
        kanai_tajimi_motion("firm", duration=16.0, dt=0.02, seed=seed, pga=peak)
        for seed, peak in enumerate(peaks)
    ]


class _Task:
    """Common parts of both environments: plant, motions, observations, cost."""

    def __init__(
        self,
        isolated: IsolatedStructure | None,
        motions: Sequence[Record] | None,
        period: float | None,
        observations: Sequence[str],
        cost: Mapping[str, float] | None,
    ):
        if isolated is None:
            isolated = reference_building().on(reference_isolators())
        if len(isolated.structure.directions) != 1:
            raise InputError(
                f"{isolated.structure.name} takes {len(isolated.structure.directions)} ground "
                "motions; expected: one direction"
            )
        self.isolated = isolated
        self.motions = training_motions() if motions is None else list(motions)
        if not self.motions:
            raise InputError("motions is empty; expected: one or more records")
        self.period = self.motions[0].dt if period is None else period
        self.cost = dict(COST if cost is None else cost)
        for name, size in self.cost.items():
            if not size > 0:
                raise InputError(f"cost of {name}", f"{size}", "a size above 0")
        # the outputs of the cost follow the observed outputs
        self.measures = tuple(dict.fromkeys([*observations, *self.cost]))
        self.n_observed = len(tuple(observations))
        unknown = set(self.measures) - set(output_names(isolated))
        if unknown:
            # raises an error with the unknown name and the nearest one
            Simulator(isolated, self.motions[0], measures=sorted(unknown))
        self._columns = [self.measures.index(name) for name in self.cost]
        self._sizes = np.array(list(self.cost.values()))

    def spaces(self, low: NDArray, high: NDArray) -> tuple[spaces.Box, spaces.Box]:
        """Observation and action space of one building; currents up to the tested one."""
        tested = [self.isolated.tested_current(c) for c in range(len(high))]
        high = np.minimum(high, tested)
        if not np.isfinite(high - low).all():
            raise InputError(
                f"currents range from {low} to {high} A; expected: limits, as of a CoilDriver"
            )
        # larger than any valid response
        most = np.full(self.n_observed + len(low), 1e9, np.float32)
        return (
            spaces.Box(-most, most, dtype=np.float32),
            spaces.Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32),
        )

    def observation(self, measured: NDArray) -> NDArray:
        """Observations from measurements, one per row."""
        coils = measured[..., len(self.measures) :]
        return np.concatenate([measured[..., : self.n_observed], coils], axis=-1, dtype=np.float32)

    def reward(self, measured: NDArray) -> Any:
        """Negative cost of a step: period * sum of (output / size)^2."""
        return -self.period * ((measured[..., self._columns] / self._sizes) ** 2).sum(axis=-1)


class BuildingEnv(gymnasium.Env):
    """An isolated building; an agent sets its coil currents.

    The action is the current of each coil, A, from the supply's lowest current to the highest
    tested current. The observation is the sensors' measurements at the end of the step, in SI
    units, then the coil currents. The reward of a step is - period * sum of (output / size)^2. An
    episode is one motion, which is drawn at each reset; it is truncated at the end of the motion.
    It is terminated with a cost of 1000 if the response leaves the range of the law.

    Parameters
    ----------
    isolated : IsolatedStructure, optional
        The plant, with one direction of ground motion; the reference building by default.
    motions : sequence of Record, optional
        Motions to draw from; `training_motions` by default.
    period : float, optional, s
        Length of a step; the first motion's sampling interval by default.
    observations : sequence of str
        Outputs to observe; every displacement and velocity would be the state of the structure.
    cost : mapping of str to float, optional
        Outputs, each with its size for a cost of 1 per second; 0.1 m of base displacement and
        1 m/s^2 of roof acceleration by default.
    driver : CoilDriver, optional
        Lag, slew, limits and step of the coils; ideal by default.
    sensors : Sensors, optional
        Noise, delay, dropout and sampling; ideal by default. Each episode draws new noise. The
        cost uses the measurements.
    computation_delay : float, default 0, s
        Time from an observation to the beginning of its action, s.
    render_mode : None
        Rendering is not available.

    Attributes
    ----------
    motions : list of Record
        Motions to draw from; ``reset(options={"motion": k})`` takes the k-th.

    Raises
    ------
    InputError
        If an argument cannot be used.
    """

    metadata = {"render_modes": []}  # noqa: RUF012

    def __init__(
        self,
        isolated: IsolatedStructure | None = None,
        motions: Sequence[Record] | None = None,
        *,
        period: float | None = None,
        observations: Sequence[str] = OBSERVATIONS,
        cost: Mapping[str, float] | None = None,
        driver: CoilDriver | None = None,
        sensors: Sensors | None = None,
        computation_delay: float = 0.0,
        render_mode: None = None,
    ):
        self._task = task = _Task(isolated, motions, period, observations, cost)
        self.motions, self.render_mode = task.motions, render_mode
        self._options: dict[str, Any] = {
            "period": task.period, "measures": task.measures, "driver": driver,
            "sensors": sensors, "computation_delay": computation_delay,
            "current_outside": "clamp",
        }  # fmt: skip
        self._simulators: dict[int, Simulator] = {}
        self._simulator = self._simulator_of(0)
        self.observation_space, self.action_space = task.spaces(
            self._simulator.low, self._simulator.high
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray, dict[str, Any]]:
        """Begin an episode."""
        super().reset(seed=seed)
        k = (options or {}).get("motion")
        k = int(self.np_random.integers(len(self.motions)) if k is None else k)
        if not 0 <= k < len(self.motions):
            raise InputError("motion", f"{k}", f"0 to {len(self.motions) - 1}")
        self._simulator = self._simulator_of(k)
        measured = self._simulator.reset(seed=int(self.np_random.integers(2**31)))
        return self._task.observation(np.array(measured)), {"motion": self.motions[k].name}

    def step(self, action: NDArray) -> tuple[NDArray, float, bool, bool, dict[str, Any]]:
        """Simulate one period."""
        simulator = self._simulator
        try:
            measured = np.array(simulator.step(action))
        except Diverged:
            rest = np.zeros(len(simulator.measures))
            return self._task.observation(rest), -PENALTY, True, False, {}
        reward = float(self._task.reward(measured))
        return self._task.observation(measured), reward, False, simulator.done, {}

    def _simulator_of(self, k: int) -> Simulator:
        if k not in self._simulators:
            self._simulators[k] = Simulator(self._task.isolated, self.motions[k], **self._options)
        return self._simulators[k]


class BuildingVectorEnv(gymnasium.vector.VectorEnv):
    """Many isolated buildings in parallel, on the batch engine.

    Each is a `BuildingEnv` with ideal sensors. A finished episode is reset in the next step, which
    ignores the action and draws the next motion (``AutoresetMode.NEXT_STEP``).

    Parameters
    ----------
    num_envs : int, default 1
        Number of buildings; multiples of 16 are most efficient.
    isolated : IsolatedStructure, optional
        The plant; see `BuildingEnv`, also for the other arguments.
    motions : sequence of Record, optional
        Motions to draw from, all with one sampling interval.
    period : float, optional, s
        Length of a step, a multiple of the motions' sampling interval.
    observations : sequence of str
        Outputs to observe.
    cost : mapping of str to float, optional
        Outputs, each with its size for a cost of 1 per second.
    driver : CoilDriver, optional
        Lag, slew, limits and step of the coils.
    threads : int, optional
        Number of threads; one per processor by default.
    render_mode : None
        Rendering is not available.

    Raises
    ------
    InputError
        If an argument cannot be used.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int = 1,
        isolated: IsolatedStructure | None = None,
        motions: Sequence[Record] | None = None,
        *,
        period: float | None = None,
        observations: Sequence[str] = OBSERVATIONS,
        cost: Mapping[str, float] | None = None,
        driver: CoilDriver | None = None,
        threads: int | None = None,
        render_mode: None = None,
    ):
        self._task = task = _Task(isolated, motions, period, observations, cost)
        self.num_envs, self.motions, self.render_mode = num_envs, task.motions, render_mode
        dt = self.motions[0].dt
        other = [r for r in self.motions if r.dt != dt]
        if other:
            raise InputError(
                f"motion {other[0].name!r} is sampled every {other[0].dt} s, others every {dt} s; "
                "expected: one interval; see Record.resampled"
            )
        self._simulator = VectorSimulator(
            task.isolated, num_envs, period=task.period, dt=dt, measures=task.measures,
            driver=driver, threads=threads,
        )  # fmt: skip
        per_step = self._simulator.samples
        counts = [-(-(len(r) - 1) // per_step) for r in self.motions]
        self._lengths = np.array(counts)
        # the ground is at rest after a motion's last sample
        self._ground = np.zeros((len(self.motions), max(counts) * per_step + 1))
        for row, record in zip(self._ground, self.motions, strict=True):
            row[: len(record)] = record.acceleration
        self._ahead = np.arange(1, per_step + 1)
        self.single_observation_space, self.single_action_space = task.spaces(
            self._simulator.low, self._simulator.high
        )
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._motion = np.zeros(num_envs, int)
        self._k = np.zeros(num_envs, int)
        self._over = np.zeros(num_envs, bool)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray, dict[str, Any]]:
        """Begin an episode in every building."""
        super().reset(seed=seed)
        everywhere = np.ones(self.num_envs, bool)
        measured = self._begin(everywhere, (options or {}).get("motion"))
        self._over[:] = False
        return self._task.observation(measured), self._infos()

    def step(self, actions: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray, dict[str, Any]]:
        """Simulate one period of every building."""
        begin = self._over.copy()
        at = np.minimum(self._k, self._lengths[self._motion] - 1) * len(self._ahead)
        ground = self._ground[self._motion[:, None], at[:, None] + self._ahead]
        measured = self._simulator.step(actions, ground[..., None])
        lost = ~self._simulator.alive & ~begin
        self._k += 1
        if begin.any():
            measured = self._begin(begin)
        rewards = np.where(lost, -PENALTY, self._task.reward(measured))
        rewards[begin] = 0.0
        truncated = ~lost & ~begin & (self._k >= self._lengths[self._motion])
        self._over = lost | truncated
        measured[lost] = 0.0
        return self._task.observation(measured), rewards, lost, truncated, self._infos()

    def _begin(self, which: NDArray, motions: Any = None) -> NDArray:
        """Put buildings to rest, each under a random or specified motion."""
        drawn = self.np_random.integers(len(self.motions), size=self.num_envs)
        chosen = drawn if motions is None else np.broadcast_to(motions, self.num_envs)
        if not ((chosen >= 0) & (chosen < len(self.motions))).all():
            raise InputError("motion", f"{motions}", f"0 to {len(self.motions) - 1}")
        self._motion[which], self._k[which] = chosen[which], 0
        return self._simulator.reset(which, self._ground[self._motion, 0][:, None])

    def _infos(self) -> dict[str, Any]:
        return {"motion": self._motion.copy(), "_motion": np.ones(self.num_envs, bool)}


gymnasium.register(
    "isolation_sim/ReferenceBuilding-v0",
    entry_point="isolation_sim.environments:BuildingEnv",
    vector_entry_point="isolation_sim.environments:BuildingVectorEnv",
)
