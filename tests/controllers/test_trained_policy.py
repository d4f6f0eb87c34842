"""The trained policy: its network, its inputs, its benefit, and its training."""

from dataclasses import replace

import numpy as np
import pytest

from controllers import controller
from controllers.predictive import policy_kernel as at
from controllers.predictive.flat_arrays import array
from controllers.trained_policy import LAYERS, WEIGHTS, WITH_PREVIEW
from ground_motions import mavroeidis_papageorgiou_pulse
from isolation_sim.errors import InputError
from isolation_sim.simulation.control import CoilDriver
from isolation_sim.simulation.run import simulate
from isolation_sim.structures import reference_building, reference_isolators, shear_building
from studies import train_policy
from studies.train_policy import (
    SAMPLES,
    Training,
    new_network,
    plant,
    train,
    training_motions,
)

DRIVER = CoilDriver(lag=0.05, high=3.0)
PEAKS = "peak_base_displacement_m", "peak_floor_acceleration_m_s2"


def network():
    with np.load(WEIGHTS) as file:
        return {name: np.asarray(file[name], dtype=float) for name in LAYERS}


def score(isolated, record, one):
    runs = [simulate(isolated, record, c, driver=DRIVER) for c in (controller("passive_off"), one)]
    return sum(runs[1].criteria[peak] / runs[0].criteria[peak] for peak in PEAKS)


def share(w, x, hidden):
    """Gated recurrent unit and layers, written with matrices."""
    n = len(hidden)
    inputs, selected = x @ w["Wg"] + w["bg"], hidden @ w["Ug"]
    reset, update = (1 / (1 + np.exp(-(inputs + selected)[k * n : (k + 1) * n])) for k in range(2))
    candidate = np.tanh(inputs[2 * n :] + reset * selected[2 * n :])
    hidden = update * hidden + (1 - update) * candidate
    layer = np.tanh(np.concatenate([x, hidden]) @ w["W1"] + w["b1"])
    layer = np.tanh(layer @ w["W2"] + w["b2"])
    return 1 / (1 + np.exp(-(layer @ w["W3"] + w["b3"])[0])), hidden


def test_the_network_is_that_of_the_matrices(isolated, record):
    one = controller("trained_policy").in_python()
    run = simulate(isolated, record.cut(0.0, 4.0), one, driver=DRIVER)
    memory, settings = one._step.memory, one._decision.settings
    x, last = array(memory, at.INPUTS), array(memory, at.HIDDEN).copy()
    # one more step from the last memory
    expected, hidden = share(network(), x, last)
    assert at.evaluate_network(settings, memory) == pytest.approx(expected, rel=1e-12)
    assert array(memory, at.HIDDEN) == pytest.approx(hidden, rel=1e-12)
    assert np.ptp(run.command) > 0.05


@pytest.mark.parametrize("preview", [0.0, 0.8])
def test_it_is_better_than_no_current_under_a_long_pulse(isolated, preview):
    pulse = mavroeidis_papageorgiou_pulse(0.5, 4.0, 1.5, 0.3, before=1.0, after=8.0)
    one = score(isolated, pulse, controller("trained_policy", preview=preview))
    assert one < 1.4  # 2 without current


def test_it_is_better_with_preview(isolated, el_centro):
    without, warned = (
        score(isolated, el_centro, controller("trained_policy", preview=p)) for p in (0.0, 0.8)
    )
    assert warned < without - 0.2


def test_preview_reaches_as_far_as_it_says(isolated, record):
    known, change = record.cut(0.0, 5.0), 3.0
    other = replace(known, acceleration=np.where(known.time > change, 0.0, known.acceleration))
    one, same = (
        simulate(isolated, each, controller("trained_policy", preview=0.8), driver=DRIVER)
        for each in (known, other)
    )
    apart = one.time[np.any(one.command != same.command, axis=1)][0]
    assert change - 0.8 < apart <= change - 0.8 + 0.04


def test_another_building_than_that_of_the_training_is_said(isolated, record):
    one, short = controller("trained_policy"), record.cut(0.0, 1.0)
    alike = reference_building().on(reference_isolators().scaled(force=1.25))
    taller = shear_building([2.5e5] * 10, [3e8] * 10, base_mass=3e5).on(reference_isolators())
    for plant_, n in ((isolated, 0), (alike, 0), (taller, 1)):
        run = simulate(plant_, short, one, driver=DRIVER)
        assert len(run.cautions) == n
    assert (
        "trained for the reference building on its isolators, and the periods here"
        in run.cautions[0]
    )
    own = controller("trained_policy", weights=str(WEIGHTS))
    assert not simulate(taller, short, own, driver=DRIVER).cautions


def test_weights_for_another_preview_are_refused(isolated, record):
    one = controller("trained_policy", preview=0.4, weights=str(WITH_PREVIEW))
    with pytest.raises(InputError, match=r"expected: a network of 38 inputs; preview .* 0\.8 s"):
        simulate(isolated, record, one)


def test_unusable_weights_are_refused(isolated, record, tmp_path):
    path = tmp_path / "weights.npz"
    np.savez(path, Wg=np.zeros((2, 2)))
    with pytest.raises(InputError, match=r"expected: a file that python -m studies\.train_policy"):
        simulate(isolated, record, controller("trained_policy", weights=str(path)))
    wrong = network()
    wrong["Ug"] = wrong["Ug"][:, :-1]
    np.savez(path, **wrong)
    with pytest.raises(InputError, match="expected: a network of 33 inputs"):
        simulate(isolated, record, controller("trained_policy", weights=str(path)))


def test_training_motions_repeat_and_are_within_their_limits():
    motions = training_motions(24, 5)
    assert motions.shape == (24, SAMPLES) and np.array_equal(motions, training_motions(24, 5))
    peaks = np.abs(motions).max(axis=1)
    assert peaks.min() >= 0.49 and peaks.max() <= 5.51


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--out nowhere/new.npz", "--out: given nowhere/new.npz; expected: a new file .npz"),
        ("--out old.npz", "--out: given old.npz; expected: a new file .npz"),
        ("--out new", "--out: given new; expected: a new file .npz"),
        ("--out new.npz --steps 0", "--steps: given 0; expected: 1 or more"),
        ("--out new.npz --preview 0.05", "--preview: given 0.05 s; expected: a multiple of 0.08 s"),
        ("--out new.npz --degraded 2", "--degraded: given 2.0; expected: a number from 0 to 1"),
        ("--out new.npz --begin none.npz", "expected: a file that this command wrote"),
        ("--out new.npz --begin old.npz --preview 0.8", "a network for --preview 0.8, not 0"),
    ],
)
def test_unusable_options_are_refused_before_the_training(
    arguments, message, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(train_policy, "find_spec", lambda name: name)
    np.savez("old.npz", **network())
    with pytest.raises(SystemExit, match="2"):
        train_policy.main(arguments.split())
    answer = capsys.readouterr().err
    assert message in answer and answer.count("\n") == 1


def test_a_training_without_its_library_says_how_to_install_it(monkeypatch, capsys):
    monkeypatch.setattr(train_policy, "find_spec", lambda name: None)
    with pytest.raises(SystemExit, match="2"):
        train_policy.main(["--out", "new.npz"])
    assert "expected: pip install 'isolation-sim[train]'" in capsys.readouterr().err


@pytest.mark.parametrize("n_ahead", [0, 10])
def test_training_simulates_as_the_engine(isolated, tmp_path, n_ahead):
    pytest.importorskip("jax")
    pulse = mavroeidis_papageorgiou_pulse(0.4, 1.5, 1.5, 0.5, before=1.0, after=5.0)
    ground = pulse.acceleration[np.newaxis].astype(np.float32)
    weights = new_network(3, n_ahead)
    # currents over the whole range
    weights["W3"] *= 20
    weights["b3"][:] = 0
    np.savez(tmp_path / "weights.npz", **weights)
    training = Training(plant(), corrections=2, n_ahead=n_ahead)
    best = training.best_constant(ground)
    inputs, *units = training.ground_inputs(ground)
    base, floor = training.run(weights, ground, inputs, *units)
    J = float(base[0]) / best[1, 0] + float(floor[0]) / best[2, 0]
    one = controller(
        "trained_policy", weights=str(tmp_path / "weights.npz"), preview=0.08 * n_ahead
    )
    assert pytest.approx(score(isolated, pulse, one), abs=0.01) == J
    assert J > 2.1


def test_training_descends():
    pytest.importorskip("jax")
    motions = training_motions(8, 3)
    untrained = {k: np.float32(w) for k, w in network().items()} | {"b3": np.float32([1.0])}
    means = [mean for _, mean, _ in train(untrained, motions, 6, batch=8, rate=0.02, duration=6.0)]
    assert means[-1] < means[0]
