"""A controller of one's own."""

import pickle

import numpy as np
import pytest

import isolation_sim as iso
from controllers import Controller, compiled, setting
from controllers.compiled import CompiledController, Decision
from controllers.device_model import DeviceModel
from controllers.predictive import state_seen
from controllers.predictive.generated_jacobian import PredictionModel
from controllers.settings import Number, OneOf
from isolation_sim.errors import ControllerError, InputError
from isolation_sim.simulation.control import Sensors
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


def test_ten_lines_of_python_are_a_controller(isolated, el_centro):
    run = simulate(isolated, el_centro, Outwards())
    assert set(run.command.ravel()) == {0.0, 3.0}


def test_sensors_may_be_a_tuple_of_names(isolated, el_centro):
    class Briefly(Outwards):
        measures = ("base_displacement_m", "base_velocity_m_s")

    run, same = (simulate(isolated, el_centro, one()) for one in (Briefly, Outwards))
    np.testing.assert_array_equal(run.command, same.command)


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
    with pytest.raises(ControllerError, match=r"Empty failed at t = 0 s: .*Empty has no method"):
        simulate(isolated, record, type("Empty", (Controller,), {})())


class Failing(Outwards):
    """Fails in one of its methods, at 1 s or before the run."""

    name = "failing"

    def __init__(self, place="current"):
        super().__init__()
        self.place = place

    def measures(self, nominal):
        return self.fail("measures") or super().measures(nominal)

    def reset(self, context):
        self.fail("reset")

    def current(self, t, m):
        return self.fail("current") if t >= 1.0 else 0.0

    def fail(self, place):
        if place == self.place:
            raise ZeroDivisionError("division by zero")


@pytest.mark.parametrize(
    ("place", "when"),
    [("current", "at t = 1 s"), ("measures", r"in measures\(\)"), ("reset", r"in reset\(\)")],
)
def test_an_error_names_the_controller_the_time_and_the_line(isolated, record, place, when):
    message = rf"^failing failed {when}: ZeroDivisionError: division by zero \(test_user_\w+.py:\d"
    with pytest.raises(ControllerError, match=message) as raised:
        simulate(isolated, record, Failing(place))
    assert isinstance(raised.value.__cause__, ZeroDivisionError)


def test_an_argument_that_a_method_lacks_is_said(isolated, record):
    class Short(Controller):
        name = "short"
        current = Outwards.current

        def reset(self):
            pass

    with pytest.raises(ControllerError, match=r"were given; the call is reset\(context\)"):
        simulate(isolated, record, Short())


def test_the_other_controllers_go_on(isolated, record):
    comparison = iso.compare(isolated, record, ["passive_off", Failing()])
    assert list(comparison.runs) == ["passive_off"]
    assert comparison.failures()[0].startswith(
        "failing has no result: failing failed at t = 1 s: Zero"
    )
    again = pickle.loads(pickle.dumps(comparison))
    assert isinstance(again.diverged["failing"], ControllerError)
    batch = iso.simulate_many([iso.Case(isolated, record, c) for c in (Failing(), Outwards())])
    assert batch.diverged.tolist() == [True, False] and "failing failed" in batch.failure[0]


def deciding(value, measured=("base_displacement_m",)):
    """A controller that returns a value, or what a function makes of the measurement."""

    class Own(Controller):
        name = "own"

        def measures(self, nominal):
            return measured

        def current(self, t, m):
            return value(m) if callable(value) else value

    return Own()


@pytest.mark.parametrize(
    ("controller", "message"),
    [
        (deciding(None), r"own: current\(\) gave None at t = 0 s; expected: a current, A, after"),
        (deciding("3"), r"own: current\(\) gave '3' at t = 0 s; expected: a current, A, as a num"),
        (deciding(np.nan), r"own: current nan A at t = 0 s"),
        (deciding("a"), r"own failed at t = 0 s: ValueError: could not convert"),
        (
            deciding(lambda m: m.base_velocity_m_s),
            r"the measurement has no base_velocity_m_s; expected: base_displacement_m, "
            r"coil0_current_A, or base_velocity_m_s among the names of measures\(\) \(test_",
        ),
        (
            deciding(0.0, "base_displacement_m"),
            r"own: measures\(\) gave 'base_displacement_m'; expected: a tuple of names, such as "
            r"\('base_displacement_m',\)",
        ),
        (
            deciding(0.0, ("base_speed",)),
            r"own: measures\(\): unknown output 'base_speed'; did you",
        ),
        (deciding(0.0, None), r"own: measures\(\) gave None; expected: a tuple of names"),
    ],
)
def test_a_wrong_answer_is_said(isolated, record, controller, message):
    with pytest.raises((InputError, ControllerError), match=message):
        simulate(isolated, record, controller)


def test_an_init_that_loses_settings_is_refused():
    class Lost(Outwards):
        gain: float = setting(1.0, "of nothing", Number())

        def __init__(self, **settings):
            self.own = 1

    assert Lost().gain == 1.0
    with pytest.raises(InputError, match=r"Lost: __init__ loses the setting gain; expected: super"):
        Lost(gain=2.0)


def test_a_class_that_needs_more_than_its_settings_is_refused(tmp_path):
    (tmp_path / "own.py").write_text(
        "from controllers import Controller\n"
        "class Needs(Controller):\n    def __init__(self, gain):\n        super().__init__()\n"
    )
    with pytest.raises(InputError, match=r"py:Needs: given TypeError: .*argument: 'gain'"):
        iso.controller(f"{tmp_path / 'own.py'}:Needs")


def test_one_sensor_without_brackets_is_refused(isolated, record):
    class One(Outwards):
        measures = "base_velocity_m_s"

    with pytest.raises(InputError, match=r"measures\(\) gave 'base_velocity_m_s'; .*'base_velo.*,"):
        simulate(isolated, record, One())


def test_compiling_names_the_controller(monkeypatch):
    lines = []
    monkeypatch.setattr(compiled, "load_text", lambda *value: lines.append(value[-1]))
    compiled._module.cache_clear()
    monkeypatch.setattr(compiled, "_module_text", lambda *value: "")
    monkeypatch.setattr(compiled, "collect", lambda *value: None)
    compiled._module(decide, DeviceModel, "mine")
    compiled._module(state_seen.decide, PredictionModel, "mpc")
    compiled._module.cache_clear()
    assert lines == [
        "compiling mine (once) ...",
        "compiling mpc (once; about 40 s) ...",
    ]


def test_an_observer_is_recommended_under_noise_or_delay(isolated, record):
    class Observing(Outwards):
        filter: str = setting("none", "observer", OneOf(("none", "kalman")))

    def cautions(sensors, **settings):
        return simulate(isolated, record, Observing(**settings), sensors=sensors).cautions

    noise, delay = Sensors(noise={"velocity_m_s": 0.01}), Sensors(delay=0.02)
    for sensors in (noise, delay):
        (line,) = cautions(sensors)
        assert 'filter="kalman"' in line
        assert not cautions(sensors, filter="kalman")
    assert not cautions(Sensors())
    assert not simulate(isolated, record, Outwards(), sensors=noise).cautions
    (line,) = simulate(isolated, record, iso.controller("clipped_lqr"), sensors=noise).cautions
    assert line.endswith("clipped_lqg estimates them by an observer")
    with pytest.warns(iso.ControllerWarning, match="as they are measured, with noise or delay"):
        run = iso.simulate(isolated, record, Observing(), sensors=noise)
    assert any(run.cautions[0] in line for line in run.warnings())
    both = iso.Comparison({"mine": run})
    assert any(line.startswith("mine: it takes") for line in both.warnings())
