"""What a verdict says of known data: negligible, explained, partly explained; sane numbers."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt, sosfiltfilt

from isolation_sim.discrepancy.device import causes, observable_effects
from isolation_sim.discrepancy.device.generic_terms import OUTSIDE
from isolation_sim.discrepancy.device.validated_search import ValidatedSearch
from isolation_sim.discrepancy.diagnose import diagnose
from isolation_sim.discrepancy.diagnosis import Cause
from isolation_sim.discrepancy.verdict import meaning
from isolation_sim.errors import InputError
from isolation_sim.identification.campaign import Campaign
from isolation_sim.identification.measured.run_table import TestRun

from ..pink_noise import pink_noise

pytestmark = pytest.mark.usefixtures("few_laws")
N, NOISE = 400, 0.005
DURATION = 4.0


def campaign(offset=0.0, unrelated=0.0, friction=0.0, drift=0.0, pink=0.0, held_out_size=6e-3, n=N):
    """A spring and a dashpot with noise, and shares of the force that they do not have."""
    random = np.random.default_rng(5)
    slow = butter(4, [0.5, 3.0], "bandpass", fs=n / DURATION, output="sos")
    time = DURATION / n * np.arange(n)
    runs = []
    for k, size in enumerate((4e-3, 5e-3, held_out_size, 7e-3, 8e-3)):
        omega = 2 * np.pi * (0.7 + 0.2 * k)
        x, v = size * np.sin(omega * time), size * omega * np.cos(omega * time)
        force = 2e4 * x + 700.0 * v
        rms = 100.0  # about the force of them all
        wandering = sosfiltfilt(slow, random.standard_normal(n))
        force += rms * (offset + unrelated * wandering / np.std(wandering))
        force += rms * (friction * np.tanh(v / 2e-3) + drift * (time / DURATION - 0.5))
        force += NOISE * rms * random.standard_normal(n)
        force += pink * rms * pink_noise(np.random.default_rng(k), n)
        runs.append(TestRun(f"run{k}", time, x, v, force, np.zeros(n), hold_out=k == 2))
    return Campaign("made", "made", tuple(runs))


def diagnosis_with(significance=None, tiers="causes", **hidden):
    diagnosis = diagnose(
        campaign(**hidden), "kelvin_voigt", threads=1, significance=significance, tiers=tiers
    )
    errors = diagnosis.error_before, diagnosis.error_after
    assert diagnosis.noise_floor <= min(e for one in errors for e in (one.fit, one.held_out))
    shares = [
        float(row[1].split()[0])
        for step in diagnosis.steps if "misfit predicted" in step.headings for row in step.rows
    ]  # fmt: skip
    assert all(0 <= share <= 100 for share in shares)
    return diagnosis


def test_the_right_law_is_adequate_and_its_numbers_are_sane():
    diagnosis = diagnosis_with()
    assert diagnosis.verdict == "adequate" and not diagnosis.causes
    assert diagnosis.noise_floor == pytest.approx(NOISE, rel=0.3)


@pytest.mark.usefixtures("few_effects")
@pytest.mark.parametrize("seed", [0, 11])
def test_a_few_samples_may_exceed_their_noise_by_chance(seed):
    """Of 40 samples the residual and the noise are known to some 20 % each."""
    random, time = np.random.default_rng(seed), 0.01 * np.arange(60)
    x = 0.01 * np.sin(4 * np.pi * time) * np.minimum(1, time / 0.3)
    v = np.gradient(x, 0.01)
    force = 2e4 * x + 300 * v
    force += 0.01 * np.std(force) * random.standard_normal(len(x))
    run = TestRun("short", time, x, v, force, 0 * x, velocity_measured=True)
    diagnosis = diagnose(Campaign("short", "made", (run,)), "kelvin_voigt", tiers="causes")
    assert diagnosis.verdict == "adequate"


def test_a_weak_run_that_is_held_out_is_missed_by_noise_alone():
    diagnosis = diagnosis_with(held_out_size=5e-4)
    assert diagnosis.verdict == "adequate" and "held out" not in diagnosis.meaning
    assert diagnosis.held_out_noise_floor > 3 * diagnosis.noise_floor
    assert diagnosis.error_before.held_out == pytest.approx(diagnosis.held_out_noise_floor, rel=0.3)


@pytest.mark.usefixtures("few_effects")
def test_a_significant_cause_too_small_to_matter_is_negligible():
    assert [cause.name for cause in diagnosis_with(offset=0.01).causes] == ["force_offset"]
    diagnosis = diagnosis_with(offset=0.01, significance=0.03)
    assert diagnosis.verdict == "adequate" and not diagnosis.causes
    assert "less than 3 % of the force is negligible" in diagnosis.steps[-1].text
    assert diagnosis.extended.law.effects == ()


@pytest.mark.usefixtures("few_effects")
def test_a_cause_that_leaves_more_than_one_of_the_right_form_only_acts_like_one():
    # a dashpot takes four fifths of the friction's square; 0.01 and 0.15 of the rest are unrelated
    for unrelated, label in ((0.015, "coulomb_friction"), (0.05, "acts like coulomb_friction")):
        diagnosis = diagnosis_with(friction=0.3, unrelated=unrelated)
        assert [cause.label for cause in diagnosis.causes] == [label]
        assert diagnosis.verdict == "partly_explained"


@pytest.mark.slow
@pytest.mark.usefixtures("few_effects")
def test_a_cause_that_corrects_less_than_what_remains_only_acts_like_one():
    def labels(**hidden):
        return sorted(
            cause.label for cause in diagnosis_with(friction=0.6, offset=0.03, **hidden).causes
        )

    assert labels() == ["coulomb_friction", "force_offset"]
    assert labels(unrelated=0.045) == ["acts like force_offset", "coulomb_friction"]


@pytest.mark.usefixtures("few_effects")
def test_a_second_cause_below_the_noise_counts_where_it_is_all_that_remains():
    # runs held out that are followed to 1.2 times the noise's variance cannot tell
    diagnosis = diagnosis_with(friction=0.3, offset=0.0023, n=4 * N)
    assert sorted(cause.name for cause in diagnosis.causes) == ["coulomb_friction", "force_offset"]
    diagnosis = diagnosis_with(friction=0.3, n=4 * N)
    assert [cause.name for cause in diagnosis.causes] == ["coulomb_friction"]


@pytest.mark.usefixtures("few_effects")
def test_a_small_share_of_the_misfit_counts_where_it_is_most_of_what_remains():
    # less than the noise, and a thousandth of what friction removes
    diagnosis = diagnosis_with(friction=0.3, offset=0.0045, n=2 * N)
    assert sorted(cause.name for cause in diagnosis.causes) == ["coulomb_friction", "force_offset"]
    assert diagnosis.verdict == "explained"
    assert all(share > 0.5 for cause in diagnosis.causes for share in cause.stability.values())
    diagnosis = diagnosis_with(friction=0.3, unrelated=0.0045, n=2 * N)
    assert [cause.name for cause in diagnosis.causes] == ["coulomb_friction"]


@pytest.mark.usefixtures("few_effects")
def test_of_losses_that_imitate_each_other_a_small_one_only_acts_like_one(monkeypatch):
    gradual = {
        cause: tuple(replace(effect, gradual=True) for effect in forms)
        for cause, forms in observable_effects.EFFECTS.items()
    }
    monkeypatch.setattr(observable_effects, "EFFECTS", gradual)
    diagnosis = diagnosis_with(friction=0.3, offset=0.015)
    assert sorted(cause.label for cause in diagnosis.causes) == [
        "acts like force_offset", "coulomb_friction"
    ]  # fmt: skip
    assert diagnosis.verdict == "explained"


@pytest.mark.usefixtures("few_effects")
@pytest.mark.parametrize("high", [9.0, pytest.param(np.inf, marks=pytest.mark.slow)])
def test_a_small_cause_whose_size_may_be_zero_only_acts_like_one(monkeypatch, high):
    numbers = causes.intervals

    def with_zero(*value):
        computed = numbers(*value)
        for one in computed:
            if "level" in one:
                one["level"] = replace(one["level"], low=0.0, high=high)
        return computed

    monkeypatch.setattr(causes, "intervals", with_zero)
    computed = diagnosis_with(friction=0.3, offset=0.02)
    labels = {one.name: one.label for one in computed.causes}
    # an end that the data do not determine says nothing of the size
    acts = "acts like " if np.isfinite(high) else ""
    assert labels["force_offset"] == f"{acts}force_offset"
    # a large cause is named whatever its interval
    assert labels["coulomb_friction"] == "coulomb_friction"


@pytest.mark.usefixtures("few_effects")
@pytest.mark.parametrize("named", [0.4, pytest.param(0.6, marks=pytest.mark.slow)])
def test_a_small_cause_that_others_replace_in_most_fits_only_acts_like_one(monkeypatch, named):
    judge = causes.stability
    monkeypatch.setattr(
        causes, "stability", lambda *given: [replace(one, named=named) for one in judge(*given)]
    )
    labels = {one.name: one.label for one in diagnosis_with(friction=0.3, offset=0.02).causes}
    acts = "acts like " if named < 0.5 else ""
    # a large cause is named, and its rivals are listed beside it
    assert labels == {
        "coulomb_friction": "coulomb_friction", "force_offset": f"{acts}force_offset"
    }  # fmt: skip


@pytest.mark.parametrize(
    ("names", "leaves_noise", "doubtful"),
    [
        ((OUTSIDE, "a", "b"), False, [False, True, False]),
        ((OUTSIDE, "a", "b"), True, [False, False, False]),
        (("c", "a", "b"), False, [False, False, False]),
    ],
)
def test_a_cause_may_mend_the_form_of_a_larger_term(names, leaves_noise, doubtful):
    assert causes._less_than_a_term(names, [0.4, 0.1, 0.5], leaves_noise) == doubtful


@pytest.mark.parametrize(("explained", "acts"), [(0.75, True), (0.85, False)])
def test_beside_what_only_acts_like_a_larger_cause_little_is_named(explained, acts):
    """Where much is left: the larger one has not the form of what the law lacks."""
    larger = Cause("end_stop", 0.4, 0.0, {}, "", doubtful=True)
    smaller, largest = (replace(larger, share=share, doubtful=False) for share in (0.1, 0.5))
    seen = causes.beside_imitations([largest, larger, smaller], explained)
    assert [one.acts_like for one in seen] == [False, True, acts]
    # beside what is named nothing is doubted
    assert causes.beside_imitations([largest, smaller], explained) == [largest, smaller]


@pytest.mark.parametrize("fitted", [2.0, 0.8])
@pytest.mark.parametrize("shown", [False, True])
def test_what_the_others_explain_to_noise_needs_no_further_cause(shown, fitted):
    """Unless the fitted runs show one that leaves nothing, and the others leave more there."""
    space = SimpleNamespace(completes=lambda *_: shown, without=lambda *_: None)
    # errors on the runs held out and on those fitted; noise leaves 1
    errors = SimpleNamespace(
        validation_samples=0,
        is_noise=lambda error, at: error[at] < 1.0,
        is_near_noise=lambda error, at, _: error[at] < 1.0,
    )
    problem = SimpleNamespace(
        errors=errors, after=(0.5, 0.5), space=space, data=SimpleNamespace(fitted=1)
    )
    completing = ValidatedSearch._completing(problem, None, [(0.8, fitted), (2.0, fitted)], None)
    assert completing == [shown and fitted > 1.0, True]


@pytest.mark.usefixtures("few_effects")
def test_explained_means_down_to_the_noise():
    assert diagnosis_with(offset=0.1).verdict == "explained"
    # the offset removes 96 % of the squared misfit; what remains is four times the noise
    diagnosis = diagnosis_with(offset=0.1, unrelated=0.02)
    assert diagnosis.causes[0].name == "force_offset"
    assert diagnosis.verdict == "partly_explained"
    # no flexible model of the measured variables explains the rest either
    diagnosis = diagnosis_with(offset=0.1, unrelated=0.02, tiers="auto")
    assert diagnosis.verdict == "explained" and diagnosis.ladder.offered == "causes"
    assert diagnosis.ladder.inexplicable > 0.02 and abs(diagnosis.ladder.explainable) < 0.01


@pytest.mark.usefixtures("few_effects")
@pytest.mark.parametrize(("unrelated", "found"), [(0.05, True), (0.0, False)])
def test_a_report_tells_effects_that_do_not_hold_from_none(unrelated, found):
    diagnosis = diagnosis_with(unrelated=unrelated)
    assert not diagnosis.causes
    text = diagnosis.steps[-1].text
    assert ("in the search, but none is named" in text) == found
    assert ("No effect lowered" in text) != found


def test_interference_explains_what_the_right_law_misses():
    diagnosis = diagnose(with_hum(campaign()), "kelvin_voigt", threads=1)
    (cause,) = diagnosis.causes
    assert cause.form == "periodic at 40.00 Hz, adds to the force" and "Shares" not in cause.reason
    assert diagnosis.verdict == "explained" and diagnosis.unexplained_share == 0.0


@pytest.mark.usefixtures("few_effects")
def test_beside_interference_shares_are_of_what_remains():
    tests = with_hum(campaign(offset=0.1))
    diagnosis = diagnose(tests, "kelvin_voigt", tiers="causes", threads=1)
    by_name = {cause.name: cause for cause in diagnosis.causes}
    assert set(by_name) == {"force_offset", OUTSIDE} and by_name["force_offset"].share > 0.9
    assert "other causes are of the misfit that remains" in by_name[OUTSIDE].reason


def with_hum(quiet):
    runs = [replace(r, force=r.force + 3.0 * np.sin(2 * np.pi * 40 * r.time)) for r in quiet.runs]
    return replace(quiet, runs=tuple(runs))


@pytest.mark.usefixtures("few_effects")
@pytest.mark.parametrize(
    ("hidden", "unpredicted", "depends_on"),
    [("unrelated", True, ()), ("friction", False, ("velocity",)), ("drift", True, ("time",))],
)
def test_what_nothing_measured_predicts_is_not_said_to_be_an_error(
    hidden, unpredicted, depends_on, monkeypatch
):
    monkeypatch.setattr(
        observable_effects, "EFFECTS", {"force_offset": observable_effects.EFFECTS["force_offset"]}
    )
    diagnosis = diagnosis_with(**{hidden: 0.08 if hidden == "drift" else 0.02})
    assert diagnosis.verdict == "unexplained" and diagnosis.depends_on == depends_on
    assert ("slow noise" in diagnosis.meaning) == unpredicted
    assert diagnosis.meaning in diagnosis.steps[-1].text


@pytest.mark.usefixtures("few_effects")
def test_noise_that_grows_towards_low_frequencies_is_noise():
    clean = diagnosis_with(pink=0.01)
    assert clean.verdict == "adequate" and not clean.causes
    assert clean.noise_floor == pytest.approx(np.hypot(NOISE, 0.01), rel=0.3)
    assert "noise is not white" in " ".join(step.text for step in clean.steps)
    hidden = diagnosis_with(pink=0.01, friction=0.05)
    assert hidden.verdict == "explained"
    assert [(c.name, c.is_named) for c in hidden.causes] == [("coulomb_friction", True)]


@pytest.mark.usefixtures("few_effects")
def test_white_noise_is_not_said_to_be_another():
    clean = diagnosis_with()
    assert clean.verdict == "adequate"
    assert "noise is not white" not in " ".join(step.text for step in clean.steps)


@pytest.mark.usefixtures("few_effects")
def test_noise_whose_low_pass_friction_hides_is_noise():
    random, time = np.random.default_rng(3), np.arange(0, 8, 0.005)
    low_pass = butter(2, 25.0, fs=200.0, output="sos")
    runs = []
    for k, (size, frequency) in enumerate([(4e-3, 1.1), (6e-3, 0.7), (8e-3, 0.9), (7e-3, 1.3)]):
        omega = 2 * np.pi * frequency
        x, v = size * np.sin(omega * time), size * omega * np.cos(omega * time)
        force = 2e4 * x + 200.0 * v + 200.0 * np.tanh(400.0 * v)
        noise = sosfilt(low_pass, random.standard_normal(time.size))
        force += 0.01 * np.std(force) * noise / np.std(noise)
        runs.append(TestRun(f"run{k}", time, x, v, force, 0 * time, hold_out=k == 3))
    tests = Campaign("made", "made", tuple(runs))
    diagnosis = diagnose(tests, "hyperbolic_tangent", tiers="causes", threads=1)
    assert diagnosis.verdict == "adequate" and not diagnosis.causes
    assert diagnosis.noise_floor == pytest.approx(0.01, rel=0.15)


@pytest.mark.usefixtures("few_effects")
def test_the_fitted_runs_tell_slow_noise():
    tests = campaign(pink=0.01)
    # a law that is not right beyond them
    runs = [replace(run, force=(1.0 + 0.1 * run.hold_out) * run.force) for run in tests.runs]
    tests = replace(tests, runs=tuple(runs))
    diagnosis = diagnose(tests, "kelvin_voigt", tiers="causes", threads=1)
    assert diagnosis.verdict == "adequate" and diagnosis.error_before.held_out > 0.05
    assert diagnosis.noise_floor == pytest.approx(np.hypot(NOISE, 0.01), rel=0.3)


@pytest.mark.slow
@pytest.mark.usefixtures("few_effects")
def test_slow_noise_is_not_said_to_be_an_error_of_the_simulation():
    diagnosis = diagnosis_with(unrelated=0.02, tiers="auto")
    assert diagnosis.verdict == "unexplained" and not diagnosis.causes
    assert "slow noise" in diagnosis.meaning and "gets something wrong" not in diagnosis.meaning


def test_a_significance_that_is_no_share_is_refused():
    with pytest.raises(InputError, match="significance: given 2; expected: 0 to 1"):
        diagnose(campaign(), "kelvin_voigt", significance=2.0)


@pytest.mark.parametrize(
    ("name", "doubtful", "sentence"),
    [
        ("coulomb_friction", False, "more than noise"),
        ("coulomb_friction", True, "only acts like"),
        (OUTSIDE, False, "or is none"),
    ],
)
def test_a_small_remainder_is_told_from_a_cause_in_doubt(name, doubtful, sentence):
    named = Cause(name, 0.95, 0.0, {}, "", doubtful=doubtful).is_named
    assert sentence in meaning("partly_explained", 0.1, 0.01, 0.05, named)


def test_an_adequate_law_of_noisy_data_is_said_to_prove_little():
    assert "which is 97 % of the signal" in meaning("adequate", 1.0, 0.97, 0.0, True)
    assert "no effect is missing" in meaning("adequate", 0.01, 0.01, 0.0, True)
