"""One specimen in a series of tests: what it has been through goes on from run to run."""

import numpy as np
import pytest

from isolation_sim.discrepancy.device.carried_history import (
    can_carry_history,
    carry_history,
    of_device,
)
from isolation_sim.discrepancy.device.effect_evaluation import evaluate
from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.effects import EFFECTS, effect
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.measured_runs import measured_runs
from isolation_sim.identification.run_table import TestRun

K, C = 60e3, 900.0


def series(loss, keeps=True):
    """Sinusoids of several amplitudes; a spring and dashpot that wear by the path travelled."""
    rng = np.random.default_rng(3)
    runs, travel = [], 0.0
    for k, (amplitude, frequency) in enumerate(
        [(2e-3, 1.0), (6e-3, 0.5), (4e-3, 2.0), (2e-3, 3.0), (6e-3, 1.0), (4e-3, 0.5), (2e-3, 1.0)]
    ):
        time = np.arange(0.0, 8.0, 0.01)
        ramp = np.minimum(time * frequency, 1.0)
        x = amplitude * ramp * np.sin(2 * np.pi * frequency * time)
        v = np.gradient(x, 0.01)
        path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))]) + (travel if keeps else 0.0)
        travel += float(np.sum(np.abs(np.diff(x))))
        force = (K * x + C * v) * (1 - loss * (1 - np.exp(-path / 0.4)))
        force = force + 0.004 * np.std(force) * rng.standard_normal(len(x))
        runs.append(TestRun(f"run_{k}", time, x, v, force, np.zeros_like(x), k in (2, 5)))
    return Campaign("series", "made", tuple(runs))


def test_the_past_is_that_of_all_earlier_runs():
    data = measured_runs(series(0.0).runs)
    assert data.past[0].tolist() == [0.0, 0.0]
    assert data.past[:, 0] == pytest.approx([0, 2e-3, 6e-3, 6e-3, 6e-3, 6e-3, 6e-3], rel=1e-2)
    assert np.all(np.diff(data.past[:, 1]) > 0)
    # runs that are held out have been made all the same
    fitted = data.without_held_out()
    assert fitted.past.tolist() == np.delete(data.past, [2, 5], axis=0).tolist()


def test_every_state_that_motion_tells_is_kept():
    names = {each.cause for forms in EFFECTS.values() for each in forms if can_carry_history(each)}
    assert names == {"stress_softening", "cyclic_degradation"}
    data = measured_runs(series(0.0).runs)
    wear = effect("cyclic_degradation")
    numbers = np.array([0.3, 0.4])
    fresh, going_on = (
        evaluate(one, data, data.force, numbers)["factor"] for one in (wear, carry_history(wear))
    )
    first = data.starts[:-1]
    assert fresh[first] == pytest.approx(1.0)
    assert going_on[first] == pytest.approx(1 - 0.3 * (1 - np.exp(-data.past[:, 1] / 0.4)))
    assert of_device(carry_history(wear)) is wear and of_device(wear) is wear


@pytest.mark.parametrize("keeps", [True, False])
def test_wear_is_named_whether_the_specimen_is_kept_or_new(keeps):
    found = diagnose(series(0.3, keeps), "kelvin_voigt", tiers="causes")
    (cause,) = found.causes
    assert cause.name == "cyclic_degradation" and cause.form.endswith("kept") == keeps
    assert found.verdict == "explained"
    assert cause.parameters["loss"].value == pytest.approx(0.3, rel=0.1)
    # the law that is written begins fresh
    assert [one.form for one in found.extended.law.effects] == [cause.form.removesuffix(", kept")]
