"""Gymnasium environments: the checker, the engine's numbers, many buildings side by side."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import isolation_sim as iso
from controllers import Policy
from ground_motions import el_centro_1940, kanai_tajimi_motion
from isolation_sim import environments
from isolation_sim.environments import BuildingEnv, BuildingVectorEnv

NAME = "isolation_sim/ReferenceBuilding-v0"


@pytest.fixture(scope="module")
def short_motions():
    """Two motions of different length."""
    return [
        kanai_tajimi_motion("firm", duration=duration, dt=0.02, seed=3, pga=3.0)
        for duration in (1.0, 1.6)
    ]


def test_check_env_passes_without_a_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # the action is the current itself, A, not a share of its range
        warnings.filterwarnings("ignore", message=".*symmetric and normalized space")
        check_env(gymnasium.make(NAME).unwrapped)
        options = {"driver": iso.CoilDriver(lag=0.02), "sensors": iso.Sensors(delay=0.02)}
        check_env(gymnasium.make(NAME, **options).unwrapped)


def test_an_episode_is_a_run():
    record = el_centro_1940().cut(0.0, 4.0)
    env = gymnasium.make(NAME, motions=[record])
    rule = iso.controller("on_off", on=3.0).in_python()
    run = iso.simulate(env.unwrapped._task.isolated, record, rule)
    observation, info = env.reset(seed=1)
    assert info == {"motion": record.name}
    cost, seen = 0.0, [observation]
    over = False
    for current in run.command[:-1]:
        assert not over
        observation, reward, terminated, over, _ = env.step(current.astype(np.float32))
        seen.append(observation)
        cost -= reward
        assert not terminated
    assert over
    seen = np.array(seen)
    np.testing.assert_allclose(seen[:, 0], run.output("base_displacement_m"), rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(seen[1:, -1], run.current[:-1, 0], rtol=1e-6)
    # accelerations are measured before the next current, as the run's are not
    floor = seen[1:, 3].astype(float)
    base = run.output("base_displacement_m")[1:]
    assert cost == pytest.approx(0.02 * np.sum(100 * base**2 + floor**2), rel=1e-4)


def test_a_policy_is_a_controller():
    """The same currents, so the same observations, in an environment and in a run."""
    record = el_centro_1940().cut(0.0, 4.0)
    env, seen = BuildingEnv(motions=[record]), []

    def act(observation):
        seen.append(observation)
        return 9.0 if observation[0] * observation[1] > 0 else 0.2

    policy = Policy(act, environments.OBSERVATIONS)
    run = iso.simulate(env._task.isolated, record, policy, current_outside="refuse")
    in_run, over = seen[:], False
    seen.clear()
    observation, _ = env.reset()
    while not over:
        observation, _, _, over, _ = env.step(np.array([act(observation)], np.float32))
    # 0.2 A is rounded to float32 on its way into the environment
    np.testing.assert_allclose(seen, in_run, rtol=1e-4, atol=1e-5)
    assert run.current.max() == pytest.approx(run.isolated.current_range(0)[1])
    assert run.controller == "policy"


def test_noise_is_drawn_for_each_episode(short_motions):
    env = BuildingEnv(motions=short_motions[:1], sensors=iso.Sensors({"velocity_m_s": 0.01}))
    first = env.reset(seed=5)[0]
    second = env.reset()[0]
    assert first[1] != second[1]
    np.testing.assert_array_equal(env.reset(seed=5)[0], first)


def test_side_by_side_each_is_as_it_is_alone(short_motions):
    n = 20
    many = gymnasium.make_vec(NAME, n, motions=short_motions)
    alone = BuildingEnv(motions=short_motions)
    observations, infos = many.reset(seed=4)
    motion = infos["motion"]
    assert set(motion) == {0, 1}
    rng = np.random.default_rng(2)
    actions = rng.uniform(0, 3, (130, n, 1)).astype(np.float32)
    seen, rewards, over, motions = [observations], [np.zeros(n)], [np.zeros(n, bool)], [motion]
    for action in actions:
        observations, reward, terminated, truncated, infos = many.step(action)
        assert not terminated.any()
        seen.append(observations)
        rewards.append(reward)
        over.append(truncated)
        motions.append(infos["motion"])
    for lane in (0, 5, 16, 19):
        begin, ended, episodes = True, False, 0
        for k in range(len(seen)):
            if begin:
                observation, _ = alone.reset(options={"motion": int(motions[k][lane])})
                reward, ended = 0.0, False
                episodes += 1
            else:
                observation, reward, _, ended, _ = alone.step(actions[k - 1, lane])
            np.testing.assert_array_equal(seen[k][lane], observation)
            assert rewards[k][lane] == pytest.approx(reward, abs=1e-12)
            assert over[k][lane] == ended
            begin = ended
        assert episodes >= 2


def test_what_leaves_the_range_of_the_law_terminates(short_motions):
    wild = [short_motions[0].scaled(1e5), short_motions[0]]
    many = BuildingVectorEnv(16, motions=wild)
    many.reset(options={"motion": [0] + 15 * [1]})
    alone = BuildingEnv(motions=wild)
    alone.reset(options={"motion": 0})
    current, over = np.ones((16, 1), np.float32), False
    while not over:
        _, reward, over, _, _ = alone.step(current[0])
        _, rewards, terminated, _, _ = many.step(current)
        assert terminated[0] == over
    assert reward == rewards[0] == -environments.PENALTY
    assert not terminated[1:].any()
    # the next step puts it to rest
    _, rewards, terminated, _, _ = many.step(current)
    assert not terminated.any()
    assert rewards[0] == 0.0


def test_what_is_refused(short_motions):
    with pytest.raises(iso.InputError, match="motions is empty"):
        BuildingEnv(motions=[])
    with pytest.raises(iso.InputError, match="cost of base_displacement_m: given 0"):
        BuildingEnv(cost={"base_displacement_m": 0})
    with pytest.raises(iso.InputError, match="base_displacment_m"):
        BuildingVectorEnv(2, observations=["base_displacment_m"])
    with pytest.raises(iso.InputError, match=r"motion: given 5; expected: 0 to 1"):
        BuildingEnv(motions=short_motions).reset(options={"motion": 5})
    with pytest.raises(iso.InputError, match=r"is sampled every 0.01 s, others every 0.02 s"):
        BuildingVectorEnv(2, motions=[short_motions[0], short_motions[1].resampled(0.01)])
