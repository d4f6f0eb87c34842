"""The verdict says what the numbers say."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

import isolation_sim as iso
from isolation_sim.reports.verdict import unknown_energies, verdict


def comparison(values, reference="off", energy=None):
    """Runs with given peaks: base displacement (m), floor acceleration (m/s2), drift (m)."""
    keys = "peak_base_displacement_m", "peak_floor_acceleration_m_s2", "peak_drift_m"
    return SimpleNamespace(
        optima=("clairvoyant",) if "clairvoyant" in values else (),
        criteria={name: dict(zip(keys, each, strict=True)) for name, each in values.items()},
        reference=reference, runs=values, energy=energy,
    )  # fmt: skip


def test_a_gain_and_its_price():
    sentences = verdict(comparison({"off": (0.2, 1.0, 2e-3), "on": (0.1, 3.0, 4e-3)}))
    assert sentences == (
        "On does not lower base displacement, floor acceleration and storey drift together; the "
        "smallest peak floor acceleration, 1 m/s², is that of off.",
        "On lowers the peak base displacement most, from 200 mm to 100 mm (−50 %), "  # noqa: RUF001
        "but raises the peak floor acceleration from 1 m/s² to 3 m/s² (+200 %).",
    )


def test_a_controller_that_is_better_in_all_respects_comes_first():
    values = {"off": (0.2, 1.0, 2e-3), "a": (0.1, 0.9, 1e-3), "b": (0.08, 3.0, 1e-3)}
    values["c, early"] = (0.15, 0.5, 1.5e-3)
    first, second = verdict(comparison(values))
    assert first == (
        "A lowers base displacement (−50 %), floor acceleration (−10 %) and storey drift "  # noqa: RUF001
        "(−50 %) together, compared with off; so does c (early)."  # noqa: RUF001
    )
    assert second.startswith("B lowers the peak base displacement most")


def test_nobody_is_praised_for_nothing():
    first, second = verdict(comparison({"off": (0.2, 1.0, 2e-3), "on": (0.2, 0.7, 1e-3)}))
    assert first.endswith("the smallest peak floor acceleration, 0.7 m/s², is that of on.")
    assert second == "No controller has a smaller peak base displacement than off, 200 mm."


def test_a_smaller_displacement_at_no_price_is_told():
    """A constant current on a soft soil: 57 % less displacement, and nothing else changes."""
    values = {"off": (0.3, 1.0, 2e-3), "held": (0.13, 0.999, 1.9e-3), "on_off": (0.1, 3.0, 4e-3)}
    first, second = verdict(comparison(values))
    assert first.endswith(
        "together; held lowers base displacement (−57 %) and raises neither other."  # noqa: RUF001
    )
    assert second.startswith("On-off lowers the peak base displacement most")


def test_changes_too_small_to_see_are_none():
    first, second = verdict(comparison({"off": (0.2, 1.0, 2e-3), "on": (0.1, 1.001, 2e-3)}))
    assert first.endswith("on lowers base displacement (−50 %) and raises neither other.")  # noqa: RUF001
    assert second.endswith("and leaves the peak floor acceleration at 1 m/s².")


@pytest.mark.parametrize("reference", [None, "off"])
def test_a_run_alone_is_reported_in_its_own_numbers(reference):
    energy = {"off": {"device_dissipation_J": 4e5, "input_J": 5e5, "closure_error": 2e-8}}
    sentences = verdict(comparison({"off": (0.2, 1.0, 2e-3)}, reference, energy))
    assert sentences == (
        "With off, the peaks are 200 mm of base displacement, 1 m/s² of floor acceleration and "
        "2 mm of storey drift.",
        "Isolators and other elements dissipated 80 % of the input energy of 500 kJ; the energy "
        "balance closes within 2e-08 of the peak input.",
    )


def test_without_a_reference_the_one_that_moves_least_is_reported():
    spent = {"device_dissipation_J": 0.0, "input_J": 0.0, "closure_error": 0.0}
    energy = {"a": spent, "b": spent}
    first, _ = verdict(comparison({"a": (0.2, 1, 1), "b": (0.1, 2, 2)}, None, energy))
    assert first.startswith(
        "With b, which has the smallest base displacement, the peaks are 100 mm"
    )


def test_an_optimum_is_no_controller_that_wins():
    off, best, bound = (0.2, 1.0, 0.01), (0.15, 0.9, 0.009), (0.05, 0.5, 0.004)
    both = comparison({"off": off, "mpc": best, "clairvoyant": bound})
    assert verdict(both) == verdict(comparison({"off": off, "mpc": best}))


def test_a_field_work_that_is_not_known_is_said():
    numbers = {"k": [1e5, 4e4], "c": 1e3, "alpha": 2e5, "A": 1.0, "beta": 800.0, "gamma": 800.0,
               "n": 1.0, "F0": 0.0}  # fmt: skip
    without = iso.law("bouc_wen", numbers)
    of_one_current = iso.law("bouc_wen", numbers | {"k": 1e5})

    def runs(device):
        elements = (SimpleNamespace(device=device, channel=0),)
        return {"off": SimpleNamespace(isolated=SimpleNamespace(elements=elements))}

    (sentence,) = unknown_energies(runs(without))
    assert sentence.startswith("The field work of Bouc-Wen is not known and counts as 0")
    titled = replace(without, law=replace(without.law, title="Ozdemir, Graesser and Cozzarelli"))
    (sentence,) = unknown_energies(runs(titled))
    assert "of Ozdemir, Graesser and Cozzarelli is not known" in sentence
    assert not unknown_energies(runs(of_one_current))
    assert not unknown_energies(runs(iso.law("strain_stiffening")))
