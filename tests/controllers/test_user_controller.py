"""A controller of one's own."""

import time

import numpy as np
import pytest

from controllers import Controller
from controllers.compiled import CompiledController, Decision
from isolation_sim.errors import InputError
from isolation_sim.simulation.run import simulate

from .conftest import both_forms, context_of
from .test_open_loop import check_against


class Outwards(Controller):
    name = "outwards"
    period = 0.02

    def measures(self, nominal):
        return ("base_displacement_m", "base_velocity_m_s")

    def current(self, t, m):
        return 3.0 if m.base_displacement_m * m.base_velocity_m_s > 0 else 0.0


class Replay(Controller):
    """Plays a sequence back, one an interval, without saying so before the run."""

    period = 0.1

    def reset(self, context):
        # the sequence behind the switching reference
        self._on = iter(np.random.default_rng(1).random(312) > 0.5)

    def current(self, t, measurement):
        return 3.0 if next(self._on) else 0.0


GAIN = 40.0


def decide(t, measured, settings, memory, command):
    memory[0] += 1.0
    command[0] = limited(GAIN * abs(measured[0]), settings[0])


def limited(value, high):
    return min(value, high)


def broken(t, measured, settings, memory, command):
    command[0] = abs(measured[0]) if t < 0.5 else one_over(0)


def one_over(k):
    if k == 0:
        raise ValueError
    return 1.0 / k


class Proportional(CompiledController):
    def measures(self, nominal):
        return ("base_displacement_m",)

    def decision(self, context):
        return Decision(decide, np.array([2.5]), np.zeros(1))


def test_ten_lines_of_python_cost_microseconds(isolated, el_centro):
    simulate(isolated, el_centro, Outwards())
    times = []
    for _ in range(5):
        start = time.perf_counter()
        run = simulate(isolated, el_centro, Outwards())
        times.append(time.perf_counter() - start)
    assert min(times) / len(run.time) < 1e-4
    assert set(run.command.ravel()) == {0.0, 3.0}


def test_a_replayed_sequence_reproduces_the_reference(shared_data, isolated, el_centro):
    path = shared_data / "engine_reference" / "strain_stiffening_switching_0.1s.npz"
    reference = np.load(path)
    run = simulate(isolated, el_centro, Replay())
    assert np.array_equal(run.command[:-1, 0], reference["current_A"][:-1])
    check_against(reference, run)


def test_a_compiled_one_of_their_own(isolated, record):
    run = simulate(isolated, record, Proportional())
    base = run.output("base_displacement_m")
    expected = np.minimum(40 * np.abs(base), 2.5)
    assert np.allclose(run.command[:-1, 0], expected[:-1], atol=1e-9)
    one = Proportional()
    plain, fast = both_forms(one, context_of(one, isolated), np.eye(20, 2))
    assert np.array_equal(plain, fast)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_error_in_compiled_code_does_not_pass_unseen(isolated, record):
    class Broken(Proportional):
        def decision(self, context):
            return Decision(broken, np.zeros(1), np.zeros(1))

    with pytest.raises(InputError, match=r"current nan A at t = 0\.5 s"):
        simulate(isolated, record, Broken())


def test_what_cannot_be_compiled_is_said(isolated):
    class Odd(Proportional):
        def decision(self, context):
            space = {}
            exec("def decide(t, measured, settings, memory, command): command[0] = 1.0", space)
            return Decision(space["decide"], np.zeros(1), np.zeros(1))

    class Worse(Proportional):
        def decision(self, context):
            return Decision(uses_a_class, np.zeros(1), np.zeros(1))

    for one, message in ((Odd(), "not in a file"), (Worse(), "it uses Outwards, a type")):
        context = context_of(one, isolated)
        with pytest.raises(InputError, match=message):
            one.compiled(context)


def uses_a_class(t, measured, settings, memory, command):
    command[0] = Outwards.period


def test_a_controller_without_a_decision_says_so(isolated, record):
    with pytest.raises(NotImplementedError, match="Empty has no method current"):
        simulate(isolated, record, type("Empty", (Controller,), {})())
