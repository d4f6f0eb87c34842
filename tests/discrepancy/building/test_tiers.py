"""An equation for what the isolators of a building lack: selected, judged, written and simulated.

The hidden force is in no catalogue. The engine that makes the record also diagnoses it; records
from an independent generator are in ``tests/blind``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.archive import law_of
from isolation_sim.cli import main
from isolation_sim.discrepancy.building.comparison import compare_building
from isolation_sim.discrepancy.building.isolation_force import layer_model, unsupported
from isolation_sim.discrepancy.building.model import building_model
from isolation_sim.discrepancy.building.record import BuildingRecord
from isolation_sim.discrepancy.building.search import cause_search
from isolation_sim.discrepancy.building.search.cause_search import candidates
from isolation_sim.discrepancy.diagnose import diagnose_building
from isolation_sim.discrepancy.tiers.law_file import Chosen, law_text
from isolation_sim.discrepancy.tiers.terms import Term
from isolation_sim.errors import InputError
from isolation_sim.laws import LAWS
from isolation_sim.structures import plan_building

DAMPING = ("extra_isolator_damping", "")
NOISE, N = 0.01, 1000
SPRING, DASHPOT, SQUEEZE = 1.2e7, 1.0e6, 4e7
SCENARIO = f"""
[isolator]
law = "kelvin_voigt"
length_scale = 1.0
force_scale = 1.0
count = 1
parameters = {{k = {SPRING}, c = {DASHPOT}}}
"""
CHANNELS = (
    "base_acceleration_m_s2",
    *(f"floor{k}_acceleration_m_s2" for k in range(1, 6)),
    "isolator_displacement_m",
)


def nominal():
    return iso.reference_building().on(iso.law("kelvin_voigt", {"k": SPRING, "c": DASHPOT}))


def squeezed():
    """The same on isolators with a fluid film, x^2 v."""
    film = Chosen(Term("x^2 v", "x**2 * v", "N s/m^3"), (0,))
    law = law_of(law_text(LAWS["kelvin_voigt"], (film,), None, "A squeeze film."))
    device = iso.law(law, {"k": SPRING, "c": DASHPOT, "c_1": SQUEEZE})
    return iso.reference_building().on(device)


def record_of(isolated, seed=0):
    """What a building would have shown, with noise in every channel, the ground's too."""
    rng = np.random.default_rng(seed)
    whole = el_centro_1940()
    ground = replace(whole, acceleration=whole.acceleration[:N], name="quake")
    blank = BuildingRecord("quake", (ground,), {c: np.arange(N) % 3 - 1.0 for c in CHANNELS})
    values = building_model(isolated, [blank]).predict(blank)

    def noisy(signal):
        return signal + NOISE * np.sqrt(np.mean(signal**2)) * rng.standard_normal(N)

    shaking = replace(ground, acceleration=noisy(ground.acceleration))
    response = {c: noisy(one) for c, one in zip(CHANNELS, values.T, strict=True)}
    return BuildingRecord("quake", (shaking,), response)


@pytest.fixture(scope="module")
def record():
    return record_of(squeezed())


@pytest.fixture(scope="module")
def folder(record, tmp_path_factory):
    """What the command writes."""
    where = tmp_path_factory.mktemp("tiers")
    columns = {"time_s": record.time, "ground_acceleration_m_s2": record.ground[0].acceleration}
    columns |= record.response
    rows = "\n".join(",".join(map(str, row)) for row in np.column_stack(list(columns.values())))
    (where / "quake.csv").write_text(",".join(columns) + "\n" + rows)
    (where / "building.toml").write_text(SCENARIO)
    arguments = [
        "diagnose", str(where / "quake.csv"), "--scenario", str(where / "building.toml"),
        "--tiers", "equation", "--no-consequence", "--out", str(where / "out"), "--quiet",
    ]  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        # two causes alone, to save time
        patch.setattr(cause_search, "candidates", two_causes)
        with pytest.raises(SystemExit) as ended:
            main(arguments)
    assert ended.value.code == 0
    return where / "out"


def two_causes(model, records):
    every = candidates(model, records)
    return [one for one in every if one.key in (("base_mass_error", ""), DAMPING) and not one.form]


@pytest.fixture(scope="module")
def diagnosis(folder):
    """The saved diagnosis."""
    return iso.load(folder)


def test_the_force_that_the_isolators_lack_is_seen_through_the_building(record):
    """Without that force it is noise of unit variance in the band; with it, its coefficient."""
    for isolated, true in ((nominal(), 0.0), (squeezed(), SQUEEZE)):
        shown = record if true else record_of(isolated)
        layer = layer_model(compare_building(building_model(nominal(), [shown]), [shown]), ())
        data = layer.data
        left = (layer.forces(np.zeros(0), False)[0] - data.force)[data.fitted]
        (column,) = layer.recorded((data.x**2 * data.v)[:, np.newaxis])[data.fitted].T
        assert -(column @ left) / (column @ column) == pytest.approx(true, abs=0.04 * SQUEEZE)
        if not true:
            power = np.abs(np.fft.rfft(left)) ** 2 / len(left)
            frequencies = np.fft.rfftfreq(len(left), shown.dt)
            band = (frequencies > 1.0) & (frequencies < 0.5 * frequencies.max())
            assert 0.5 < np.mean(power[band]) < 2.0


def test_the_force_of_a_law_that_is_fast_between_samples_follows_its_motion(record):
    """A Maxwell branch of 2 ms diverges with one explicit step a sample of 20 ms."""
    numbers = {"k0": SPRING, "c0": 0.1 * DASHPOT, "k1": 4 * SPRING}
    stiff = iso.law("standard_solid", numbers)
    model = building_model(iso.reference_building().on(stiff), [record])
    layer = layer_model(compare_building(model, [record]), ())
    force = layer.forces(np.zeros(0), False)[0]
    assert np.isfinite(force).all()
    finer = replace(layer, data=layer.data.with_steps(8 * layer.data.n_steps, layer.data.stiff))
    apart = force - finer.forces(np.zeros(0), False)[0]
    assert np.abs(apart).max() < 1e-2 * np.abs(force).max()


def test_the_equation_is_identified_and_lowers_the_held_out_error(diagnosis):
    (term,) = diagnosis.ladder.terms
    (coefficient,) = term.numbers.values()
    assert term.text == "x^2 v" and coefficient.unit == "N s/m^3"
    assert coefficient.value == pytest.approx(SQUEEZE, rel=0.03)
    assert coefficient.low < SQUEEZE * 1.02 and coefficient.high > SQUEEZE * 0.98
    rungs = {one.name: one for one in diagnosis.ladder.rungs}
    assert list(rungs) == ["law", "causes", "equation"] and diagnosis.ladder.offered == "equation"
    assert rungs["equation"].held_out < 0.35 * rungs["law"].held_out
    assert rungs["equation"].held_out < 0.8 * rungs["causes"].held_out
    assert diagnosis.error_after.held_out == rungs["equation"].held_out < 1.5 * NOISE * 1.5
    assert diagnosis.verdict == "explained"


def test_the_reports_show_the_ladder(folder):
    text = (folder / "report.md").read_text()
    assert "with an equation (offered)" in text and "x^2 v" in text
    assert "conditions left out, %" not in text
    page = (folder / "report.html").read_text()
    assert "Residual over measured signal (RMS) of each tier" in page and "x^2 v" in page


def test_the_extended_building_simulates_as_the_hidden_one(diagnosis, folder, record):
    assert type(diagnosis).__name__ == "BuildingDiagnosis"
    hidden, result = (
        building_model(one, [record]).predict(record) for one in (squeezed(), diagnosis.building)
    )
    assert np.all(np.std(result - hidden, axis=0) < 0.02 * np.std(hidden, axis=0))
    law = LAWS[f"{folder / 'extended_law.py'}:LAW"]
    assert law.parameter_names == ("k", "c", "c_1")
    device = iso.Scenario.read(folder / "extended_law.toml").isolator.device()
    at = 0.1, 0.5, (), 0.0
    assert device.force(*at) == pytest.approx(diagnosis.extended.force(*at))


def test_nothing_is_added_where_nothing_is_missing():
    clean = record_of(nominal(), seed=1)
    diagnosis = diagnose_building(clean, nominal(), most_causes=0)
    assert diagnosis.verdict == "adequate" and diagnosis.ladder is None
    asked = diagnose_building(clean, nominal(), most_causes=0, tiers="equation")
    assert asked.verdict == "adequate" and asked.extended is None
    assert asked.ladder.terms == () and asked.ladder.offered == "causes"


def test_where_no_term_can_stand_is_said(record):
    with pytest.raises(InputError, match="tiers: given 'all'; expected: auto, causes, equation"):
        diagnose_building(record, nominal(), tiers="all")
    stiffer = iso.law("kelvin_voigt", {"k": SPRING, "c": DASHPOT})
    twice = nominal().structure.with_element(stiffer, "base", name="isolator")
    against = twice.with_element(stiffer, -twice.elements[0].direction, name="other")
    assert unsupported(nominal(), [record]) == ""
    assert "several directions" in unsupported(against, [record])
    plan = plan_building([2e5], [2e8], [2e8], base_mass=2e5, plan=(20.0, 12.0))
    assert "several directions" in unsupported(plan.on(stiffer, biaxial=True), [record])


def test_numbers_are_reported_for_all_isolators_and_written_for_one_device(record):
    length, force = 10.0, 100.0
    small = {"k": SPRING * length / force, "c": DASHPOT * length / force}
    scaled = iso.reference_building().on(iso.law("kelvin_voigt", small).scaled(length, force))
    diagnosis = diagnose_building(record, scaled, most_causes=0, tiers="equation")
    ((coefficient,),) = (term.numbers.values() for term in diagnosis.ladder.terms)
    assert coefficient.value == pytest.approx(SQUEEZE, rel=0.03)
    own = diagnosis.extended.current.coefficients[0, -1, 0]
    assert own == pytest.approx(coefficient.value * length**3 / force)
