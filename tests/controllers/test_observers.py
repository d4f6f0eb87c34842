"""Observers: exact steps, consistency over seeded runs, mismatch."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.stats import chi2

from controllers import controller
from controllers.estimating import Estimating
from controllers.observers import ExtendedKalmanFilter, GroundNoise, KalmanFilter, Noise, Observer
from controllers.observers.nominal_linear_model import sampled, structure_and_ground
from controllers.observers.observer import ground_outputs
from controllers.observers.small_matrices import step_matrices
from controllers.observers.tangent import TangentModel
from ground_motions import kanai_tajimi_motion
from isolation_sim.errors import InputError
from isolation_sim.laws import law, passive
from isolation_sim.simulation.control import CoilDriver
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import IsolatedStructure, reference_building

from .test_clipped_lqr import mixed

PERIOD, INTENSITY, NOISE = 0.02, 0.02, Noise(acceleration=0.02, deformation=2e-4)
GROUND = GroundNoise(INTENSITY)
KINDS = (KalmanFilter, ExtendedKalmanFilter)


def softer(isolated, factor):
    """The same with other isolator forces."""
    elements = (replace(e, device=e.device.scaled(force=factor)) for e in isolated.elements)
    return IsolatedStructure(isolated.structure, tuple(elements))


def measured(isolated, seed, current=None, duration=40.0, noise=NOISE, ground=()):
    """What sensors say in a run under stationary noise, and the true state."""
    record = kanai_tajimi_motion(
        "firm", duration, PERIOD / 2, seed=seed, intensity=INTENSITY, envelope=None
    )
    rng = np.random.default_rng(seed)
    one = controller("passive_off")
    if current is not None:
        time = np.arange(0.0, duration, 0.5)
        one = controller("prescribed", time=time, amperes=rng.uniform(*current, len(time)))
    run = simulate(isolated, record, one, driver=CoilDriver(lag=0.05))
    n = isolated.structure.n_dofs
    columns = [run.output(name)[::2] for name in (*Observer.measures(isolated), *ground)]
    deviations = [noise.acceleration] * n + [noise.deformation] * len(isolated.elements)
    deviations += [noise.acceleration] * len(ground)
    seen = [c + s * rng.standard_normal(len(c)) for c, s in zip(columns, deviations, strict=True)]
    currents = run.current[::2, : isolated.n_channels]
    truth = [
        run.output(f"{dof}_{quantity}")[::2]
        for quantity in ("displacement_m", "velocity_m_s")
        for dof in isolated.structure.names
    ]
    states = run.states[::2].reshape(len(currents), -1)
    return np.column_stack([*seen, currents]), np.column_stack([*truth, states])


def consistency(isolated, observer, seeds, current=None):
    """Mean normalised squares of innovations and errors, and Ljung-Box statistics of 10 lags."""
    nis, nees, box, misses = [], [], [], []
    for seed in seeds:
        ground = ground_outputs(isolated) if observer.measured_ground else ()
        seen, truth = measured(isolated, seed, current, noise=observer.noise, ground=ground)
        estimate = observer.run(seen)
        error = np.hstack([estimate.displacement, estimate.velocity]) - truth[:, :12]
        places = list(range(12))
        n_ground = estimate.ground.shape[1]
        if estimate.covariance.shape[1] > 12 + n_ground:
            states = estimate.device_states.reshape(len(seen), -1)
            error = np.hstack([error, states - truth[:, 12:]])
            places += range(12 + n_ground, estimate.covariance.shape[1])
        late = slice(250, None)
        inner = estimate.covariance[late][:, places][:, :, places]
        scaled = np.linalg.solve(inner, error[late, :, None])[..., 0]
        nees.append(np.mean(np.sum(error[late] * scaled, axis=1)) / len(places))
        innovations = estimate.innovations[late]
        nis.append(np.mean(innovations**2))
        n = len(innovations)
        rho = [np.mean(innovations[k:] * innovations[:-k], axis=0) for k in range(1, 11)]
        box.append(n * np.sum(np.square(rho), axis=0))
        misses.append(np.std(error[late, :12], axis=0) / np.std(truth[late, :12], axis=0))
    return np.mean(nis), np.mean(nees), np.mean(box, axis=0), np.mean(misses, axis=0)


def test_sampling_is_exact():
    rng = np.random.default_rng(0)
    a, b, g = rng.standard_normal((3, 3)), rng.standard_normal((3, 2)), rng.standard_normal((3, 1))
    h, start, end, z0 = 0.3, rng.standard_normal(2), rng.standard_normal(2), rng.standard_normal(3)
    transition, at_start, at_end, covariance = sampled(a, b, g @ g.T, h)

    def rates(t, s):
        spread = expm(a * t) @ g
        inner = a @ s[:3] + b @ (start + (end - start) * t / h)
        return np.concatenate([inner, (spread @ spread.T).ravel()])

    after = solve_ivp(rates, (0, h), np.append(z0, np.zeros(9)), rtol=1e-11, atol=1e-12).y[:, -1]
    assert np.allclose(transition @ z0 + at_start @ start + at_end @ end, after[:3], atol=1e-9)
    assert np.allclose(covariance.ravel(), after[3:], atol=1e-9)


def test_doubling_agrees_with_the_matrix_exponential(isolated):
    a, _, g, _, _ = structure_and_ground(isolated.structure, isolated.element_rows, GROUND)
    n, noise = len(a), GROUND.density * g @ g.T
    exact, _, _, covariance = sampled(a, g, noise, PERIOD)
    computed, added = np.zeros(n * n), np.zeros(n * n)
    work = np.zeros(3 * n * n)
    step_matrices(n, PERIOD * a.ravel(), PERIOD * noise.ravel(), computed, added, work)
    assert np.allclose(computed.reshape(n, n), exact, rtol=0, atol=1e-9 * np.abs(exact).max())
    assert np.allclose(added.reshape(n, n), covariance, rtol=0, atol=1e-9 * covariance.max())


@pytest.mark.parametrize("which", ["strain_stiffening", "hybrid", "improved_bouc_wen", "linear"])
def test_tangent_is_the_derivative(which):
    device = law(which, {"k": (2e4, 3e3)}) if which == "linear" else law(which)
    device = device.scaled(length=10, force=300)
    n, step = len(device.law.states), 1e-6
    model, rng = TangentModel([device]), np.random.default_rng(1)
    x, v, states = 0.02, 0.15, rng.uniform(0.5e-3, 1e-3, n)
    out = np.zeros((1 + n) * (3 + n))
    model.tangent(0, x, v, states, 1.2, model.numbers, out)
    rows = out.reshape(1 + n, 3 + n)

    def values(motion):
        s = tuple(motion[2:])
        rates = device.rates(motion[0], motion[1], s, 1.2)
        return np.array([device.force(motion[0], motion[1], s, 1.2), *rates])

    motion = np.array([x, v, *states])
    assert np.allclose(rows[:, 0], values(motion), rtol=1e-12)
    for j in range(2 + n):
        move = np.eye(2 + n)[j] * step * max(abs(motion[j]), 1e-3)
        slope = (values(motion + move) - values(motion - move)) / (2 * move[j])
        assert np.allclose(rows[:, 1 + j], slope, rtol=1e-5, atol=1e-6 * np.abs(rows).max())


@pytest.mark.parametrize("kind", KINDS)
def test_plain_and_compiled_form_agree_for_several_laws_and_coils(kind):
    nominal = mixed()
    observer = kind(nominal, PERIOD)
    rng = np.random.default_rng(3)
    size = np.array([*[0.5] * 6, *[0.02] * 4])
    currents = rng.uniform(0.0, 3.0, (12, 2))
    seen = np.hstack([np.cumsum(size * rng.standard_normal((12, 10)), axis=0) / 3, currents])
    decision = observer.decision()
    memory, row = decision.memory.copy(), np.zeros(observer.width())
    plain = []
    for k, inputs in enumerate(seen):
        decision.function(k * PERIOD, inputs, decision.settings, memory, row, *decision.methods)
        plain.append(row.copy())
    plain = observer.estimate(np.arange(len(seen)) * PERIOD, np.array(plain))
    fast = observer.run(seen)
    for quantity in ("displacement", "velocity", "ground", "device_states", "innovations"):
        expected = getattr(plain, quantity)
        result = getattr(fast, quantity)
        assert np.allclose(result, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("kind", KINDS)
def test_step_by_step_equals_all_measurements_at_once(isolated, kind):
    observer = kind(isolated, PERIOD, GROUND)
    seen = 1e-3 * np.random.default_rng(5).standard_normal((20, len(observer.outputs)))
    seen[:, -1] = 1.0
    estimate = observer.run(seen)
    for _ in range(2):  # the second time as the first one
        observer.reset()
        for k, row in enumerate(seen):
            present = observer.update(row)
            assert present.time[0] == estimate.time[k]
            assert np.array_equal(present.velocity[0], estimate.velocity[k])
            assert np.array_equal(present.device_states[0], estimate.device_states[k])
    with pytest.raises(
        InputError, match=r"shape \(3,\); expected: finite numbers, one number each"
    ):
        observer.update(seen[0, :3])


def test_on_linear_equations_the_extended_filter_is_the_kalman_filter():
    """Against a filter written out with SciPy's matrix exponential."""
    nominal = reference_building().on(law("linear", {"k": 1.5e7}))
    seen, _ = measured(nominal, 0, duration=4.0)
    estimate = ExtendedKalmanFilter(nominal, PERIOD, GROUND, NOISE).run(seen)
    held = replace(
        nominal.structure, stiffness=nominal.structure.stiffness + np.diag([1.5e7, *[0] * 5])
    )
    a, b, g, c, _ = structure_and_ground(held, nominal.element_rows, GROUND)
    transition, _, _, added = sampled(a, b, GROUND.density * g @ g.T, PERIOD)
    rows = np.vstack([c, np.eye(1, len(a))])
    noise = np.diag([NOISE.acceleration**2] * 6 + [NOISE.deformation**2])
    z, p = np.zeros(len(a)), np.zeros_like(a)
    for k, inputs in enumerate(seen):
        if k:
            z, p = transition @ z, transition @ p @ transition.T + added
        gain = p @ rows.T @ np.linalg.inv(rows @ p @ rows.T + noise)
        z, p = z + gain @ (inputs - rows @ z), p - gain @ rows @ p
    assert np.allclose(estimate.displacement[-1], z[:6], atol=1e-8)
    assert np.allclose(estimate.velocity[-1], z[6:12], atol=1e-7)
    assert np.allclose(estimate.covariance[-1], p, atol=1e-7 * np.abs(p).max())


def test_extended_filter_is_consistent(isolated):
    """Errors and innovations as large as expected, innovations white."""
    # the plant's device states do not walk at random
    observer = ExtendedKalmanFilter(isolated, PERIOD, GROUND, replace(NOISE, states=1e-4))
    nis, nees, box, _ = consistency(isolated, observer, range(6))
    n = 6 * 1750 * 7
    assert chi2.ppf(5e-4, n) / n <= nis <= chi2.ppf(1 - 5e-4, n) / n
    # errors of one run hang together over about a second
    n = 6 * 35 * 14
    assert chi2.ppf(5e-4, n) / n <= nees <= chi2.ppf(1 - 5e-4, n) / n
    assert np.all(6 * box <= chi2.ppf(1 - 5e-4, 60))


def test_kalman_filter_is_consistent(isolated):
    """With little noise in the deformation, through which device forces are known.

    More of that noise makes neighbouring innovations of the base depend on each other, since the
    force at one instant enters both; the errors are smaller than the filter expects.
    """
    fine = Noise(acceleration=0.02, deformation=2e-5)
    observer = KalmanFilter(isolated, PERIOD, GROUND, fine)
    nis, nees, box, _ = consistency(isolated, observer, range(6))
    assert abs(nis - 1) <= 0.02
    assert 0.25 <= nees <= 1
    assert np.all(6 * box <= chi2.ppf(1 - 5e-4, 60))


@pytest.mark.parametrize(
    ("kind", "gain", "near"), [(KalmanFilter, 2.0, 0.2), (ExtendedKalmanFilter, 3.0, 0.05)]
)
def test_a_measured_ground_acceleration_sharpens_the_velocities(isolated, kind, gain, near):
    unknown = kind(isolated, PERIOD, GROUND, replace(NOISE, states=1e-4))
    known = kind(isolated, PERIOD, GROUND, replace(NOISE, states=1e-4), measured_ground=True)
    assert known.outputs[-2:] == ("ground_acceleration_m_s2", "coil0_current_A")
    _, _, _, before = consistency(isolated, unknown, range(2))
    nis, nees, _, after = consistency(isolated, known, range(2))
    assert np.all(gain * after[6:] < before[6:])
    assert abs(nis - 1) < near and nees < 1.3
    # white noise has no acceleration at an instant
    white = kind(isolated, PERIOD, GroundNoise(frequency=None), measured_ground=True)
    assert white.outputs == unknown.outputs


def test_the_extended_filter_follows_a_field_faster_than_its_interval():
    plant = reference_building().on(passive(law("strain_stiffening").scaled(length=10, force=3000)))
    observer = ExtendedKalmanFilter(plant, PERIOD, GROUND, NOISE, measured_ground=True)
    ground = ground_outputs(plant)
    seen, truth = measured(plant, 0, (0.0, 3.0), ground=ground)
    estimate = observer.run(seen)
    states = truth[:, 12:]
    error = estimate.device_states.reshape(len(seen), -1) - states
    # with one step an interval 50 % of an extension would be wrong, and 4 % of the field's current
    miss = np.std(error[100:], axis=0) / np.std(states[100:], axis=0)
    assert np.all(miss < 0.15) and miss[-1] < 0.03


class Watching(Estimating):
    """Changes the current at every decision, and keeps what its observer estimates."""

    name, period = "watching", PERIOD

    def __init__(self, kind):
        super().__init__()
        self.kind = kind

    def measures(self, nominal):
        return (*super().measures(nominal), *ground_outputs(nominal))

    def reset(self, context):
        self.seen, self.rng = [], np.random.default_rng(1)
        self.watcher = self.observer(context, self.kind, measured_ground=True)

    def current(self, t, measurement):
        self.seen.append((t, self.watcher.update(measurement).velocity[0, 0]))
        return self.rng.uniform(0.0, 3.0)


@pytest.mark.parametrize("kind", ["kalman", "extended"])
@pytest.mark.parametrize(("lag", "delay"), [(0.0, 0.0), (0.0, 0.01), (0.0, 0.02), (0.05, 0.0)])
def test_a_current_that_jumps_is_held_between_the_measurements(isolated, kind, lag, delay):
    watching = Watching(kind)
    record = kanai_tajimi_motion("firm", 10.0, PERIOD, seed=3, intensity=INTENSITY, envelope=None)
    driver = CoilDriver(lag=lag)
    run = simulate(isolated, record, watching, driver=driver, computation_delay=delay)
    time, estimate = np.array(watching.seen).T
    velocity = run.output("base_velocity_m_s")[np.round(time / record.dt).astype(int)]
    error = np.sqrt(np.mean((estimate - velocity) ** 2) / np.mean(velocity**2))
    assert error < 0.01


@pytest.mark.parametrize("factor", [0.8, 1.2])
@pytest.mark.parametrize("kind", KINDS)
def test_mismatch_is_seen_in_the_innovations_and_survived(isolated, kind, factor):
    plant = softer(isolated, factor)
    right = kind(plant, PERIOD, GROUND, NOISE)
    wrong = kind(isolated, PERIOD, GROUND, NOISE)
    nis, _, _, miss = consistency(plant, right, range(2), current=(0.0, 3.0))
    nis_wrong, _, _, miss_wrong = consistency(plant, wrong, range(2), current=(0.0, 3.0))
    assert nis < 1.1 and nis_wrong > 4
    # the estimate stays useful: 2.5 % of the displacements, not much more of the velocities
    assert np.all(miss_wrong[:6] < 0.025) and np.all(miss_wrong[:6] > miss[:6])
    assert np.all(miss_wrong[6:] < 1.4 * miss[6:]) and np.all(miss[6:] < 0.12)


def test_bad_input_is_refused_in_one_line(isolated):
    with pytest.raises(InputError, match=r"observer: period: given 0\.0 s; expected: above 0"):
        KalmanFilter(isolated, 0.0)
    with pytest.raises(InputError, match=r"shape \(3, 2\); expected: .* isolator_deformation_m, c"):
        KalmanFilter(isolated, PERIOD).run(np.zeros((3, 2)))
    with pytest.raises(InputError, match="ground noise: intensity: given -1; expected"):
        GroundNoise(-1)
    with pytest.raises(InputError, match="noise: deformation: given 0; expected"):
        Noise(deformation=0)
