"""With NUMBA_DISABLE_JIT=1 the same functions run as Python, and give the same response."""

import os
import pickle
import subprocess
import sys

import numpy as np
import pytest

import isolation_sim as iso
from controllers.passive_off import PassiveOff
from ground_motions import Record
from isolation_sim.compilation.generated import COMPILED
from isolation_sim.discrepancy.device import effect_evaluation, effect_kernel
from isolation_sim.effects import EFFECTS
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.fit import fit
from isolation_sim.identification.kernel import device_kernel
from isolation_sim.identification.measured.run_table import TestRun
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.identification.sensitivities import Motion, Simulator
from isolation_sim.laws import LAWS, law
from isolation_sim.simulation.batch import LANES, Case, simulate_many
from isolation_sim.structures import from_matrices

FIRST_ORDER, SECOND_ORDER, *_ = EFFECTS["current_lag"]
TIME = 0.02 * np.arange(30)
X, Y = (Record(3.0 * np.sin(w * TIME) * np.exp(-TIME), 0.02) for w in (9.0, 14.0))
SAMPLES = 0.005 * np.arange(60)
RUN = TestRun(
    "run", SAMPLES, 5e-3 * np.sin(9 * SAMPLES), 45e-3 * np.cos(9 * SAMPLES),
    100.0 * np.sin(9 * SAMPLES + 0.3), 1.0 + np.sin(7 * SAMPLES),
)  # fmt: skip


def controlled():
    """One element and a controller: the modules themselves."""
    isolated = iso.reference_building().on(iso.reference_isolators())
    runs = [iso.simulate(isolated, X, controller=name) for name in ("on_off", "clipped_lqr")]
    return [run.values for run in runs], [run.criteria for run in runs]


def biaxial():
    """Two elements of one device, and two ground motions: copies of the modules."""
    zero = np.zeros((2, 2))
    slab = from_matrices(
        3e5 * np.eye(2), zero, zero, influence=np.eye(2), base=(0, 1), names=["x", "y"]
    )
    values = {"k": 2e6, "c": 0.0, "alpha": 1.5e7, "A": 1.0, "beta": 5e3, "gamma": 5e3, "n": 2.0,
              "F0": 0.0}  # fmt: skip
    run = iso.simulate(slab.on(law("bouc_wen", values), biaxial=True), (X, Y))
    return [run.values], [run.criteria]


def batch():
    """Runs side by side, with a common structure."""
    isolated = iso.reference_building().on(iso.reference_isolators())
    grounds = [Record(X.acceleration[:12] * (1 + k), 0.02) for k in range(LANES)]
    many = simulate_many([Case(isolated, ground, PassiveOff()) for ground in grounds])
    return list(many.criteria.values()), []


def law_fit():
    """The fit of a law: a copy of the device's kernel."""
    fitted = fit(Campaign("small", "made", (RUN,)), "hybrid", current_degree=0, starts=1, threads=1)
    return [fitted.device.current.coefficients], []


def device():
    """A device under measured motion: uncompiled, the module itself, whose law is Maxwell's."""
    arrays = RUN.displacement, RUN.velocity, RUN.current, np.array([0.005])
    simulator = Simulator(LAWS["maxwell"], Motion(np.array([0, 60]), *arrays), n_powers=2)
    if not COMPILED:
        simulator.module = device_kernel
    return [*simulator.run(np.array([2e4, 3e3, 800.0, 0.0]))], []


def trajectories():
    """Effects along a run: a copy and, uncompiled, the module itself with its first-order lag."""
    data, lag = measured_runs([RUN]), np.array([0.1])
    second = effect_evaluation.evaluate(SECOND_ORDER, data, RUN.force, lag)["current"]
    if not COMPILED:
        effect_evaluation.compiled = lambda effect: effect_kernel
    first = effect_evaluation.evaluate(FIRST_ORDER, data, RUN.force, lag)["current"]
    return [first, second], []


CASES = {
    case.__name__: case for case in (controlled, biaxial, batch, law_fit, device, trajectories)
}


@pytest.fixture(scope="module")
def in_python():
    """Each case as a process finds it that compiles nothing; one process for all."""
    command = [sys.executable, "-W", "ignore", "-c",
               "import pickle, sys; from tests.simulation.test_uncompiled import CASES;"
               "found = {name: case() for name, case in CASES.items()};"
               "sys.stdout.buffer.write(pickle.dumps(found))"]  # fmt: skip
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr.decode()[-2000:]
    return pickle.loads(done.stdout)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_python_and_compiled_code_agree(name, in_python):
    for ours, theirs in zip(CASES[name](), in_python[name], strict=True):
        for one, other in zip(ours, theirs, strict=True):
            if isinstance(one, np.ndarray):
                np.testing.assert_allclose(other, one, rtol=0, atol=1e-9 * np.abs(one).max())
            else:
                assert dict(other) == pytest.approx(dict(one), rel=1e-9)
