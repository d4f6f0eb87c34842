"""What a wrong law would have cost: the runs are those of the front door, the scale is closed form.

Plants differ in numbers alone, so that no law has to be compiled for these tests.
"""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import isolation_sim as iso
from controllers import Controller
from ground_motions import el_centro_1940
from ground_motions.spectra import response_spectrum
from isolation_sim.discrepancy.consequence import CASES, consequence
from isolation_sim.discrepancy.diagnosis import BuildingDiagnosis, Cause, Diagnosis, Errors
from isolation_sim.reports.diagnosis import consequence_note, consequence_table, markdown
from isolation_sim.reports.html.diagnosis_report import diagnosis_report
from isolation_sim.reports.tables import standard_console
from isolation_sim.scenario.consequence import carrying, with_consequence

NAMES = ("passive_off", "best_constant", "clipped_lqr")


def softened(device, factor=0.5):
    """The same law with all moduli smaller."""
    values = device.current.coefficients[0] * factor
    return device.with_parameters(**dict(zip(device.current.names, values.tolist(), strict=True)))


@pytest.fixture(scope="module")
def ground():
    return el_centro_1940()


@pytest.fixture(scope="module")
def before():
    return iso.reference_building().on(iso.reference_isolators())


@pytest.fixture(scope="module")
def after():
    device = softened(iso.law("strain_stiffening"))
    return iso.reference_building().on(iso.reference_isolators(device))


def _controllers():
    return {name: iso.controller(name) for name in NAMES}


@pytest.fixture(scope="module")
def compared(before, after, ground):
    return consequence(before, after, ground, _controllers())


def test_a_law_that_is_right_costs_nothing(before, ground):
    same = consequence(before, before, ground, _controllers())
    for cases in same.performance.values():
        assert cases["predicted"] == cases["actual"] == cases["redesigned"]
    # of this law the best constant current is none, so that two share the first place
    assert [cases["actual"].rank for cases in same.performance.values()] == [1, 1, 3]
    assert "+0 %" in same.finding and "ranks the controllers as they are" in same.finding


@pytest.mark.parametrize(("case", "plant", "nominal"),
                         [("predicted", "before", "before"), ("actual", "after", "before"),
                          ("redesigned", "after", "after")])  # fmt: skip
def test_a_model_based_controller_runs_with_plant_and_nominal_model(
    compared, request, ground, case, plant, nominal
):
    plant, nominal = request.getfixturevalue(plant), request.getfixturevalue(nominal)
    run = iso.simulate(plant, ground, "clipped_lqr", nominal=nominal)
    off = iso.simulate(plant, ground)
    one = compared.performance["clipped_lqr"][case]
    assert one.peak_base_displacement_m == run.criteria["peak_base_displacement_m"]
    assert one.peak_floor_acceleration_m_s2 == run.criteria["peak_floor_acceleration_m_s2"]
    ratios = [
        run.criteria[key] / off.criteria[key]
        for key in ("peak_base_displacement_m", "peak_floor_acceleration_m_s2")
    ]
    assert one.J == pytest.approx(sum(ratios), abs=5e-4)


def test_what_was_learnt_on_the_old_law_is_used_on_the_new_one(before, after, ground):
    def least_displacement():
        return iso.controller("best_constant", criterion="peak_base_displacement_m")

    controllers = {"passive_off": iso.controller("passive_off"), "best": least_displacement()}
    outcome = consequence(before, after, ground, controllers).performance["best"]
    learnt = least_displacement()
    iso.simulate(before, ground, learnt)
    held = iso.simulate(after, ground, iso.controller("constant", amperes=learnt.optimum))
    peak = held.criteria["peak_base_displacement_m"]
    assert outcome["actual"].peak_base_displacement_m == peak
    # searched again on the right law it is better
    assert outcome["redesigned"].peak_base_displacement_m < 0.99 * peak


def test_without_a_reference_there_is_no_score(before, ground):
    with pytest.raises(iso.InputError, match="passive_off among them"):
        consequence(before, before, ground, {"passive_on": iso.controller("passive_on")})


def test_a_tested_device_is_scaled_to_period_and_spectrum(ground):
    k, c, tested = 5e4, 2e3, 8e-3
    device = replace(iso.law("kelvin_voigt", {"k": k, "c": c}), tested_deformation=tested)
    structure = iso.reference_building()
    scale = carrying(device, structure, [ground])
    omega = np.pi
    expected = response_spectrum(ground, [2.0], c * omega / (2 * k)).sd[0]
    assert scale.length * tested == pytest.approx(expected, rel=2e-3)
    stiffness = scale.force / scale.length * k
    assert np.sqrt(stiffness / structure.total_mass) == pytest.approx(omega, rel=1e-3)
    assert "8 mm" in scale.words


def test_what_cannot_carry_a_building_is_refused(ground):
    damper = iso.law("kelvin_voigt", {"k": 1e3, "c": 1e4})
    structure = iso.reference_building()
    with pytest.raises(iso.InputError, match="tested deformation"):
        carrying(damper, structure, [ground])
    with pytest.raises(iso.InputError, match="damps more than it restores"):
        carrying(replace(damper, tested_deformation=0.01), structure, [ground])


def _diagnosis(nominal_model, extended):
    cause = Cause("amplitude_softening", 0.9, 0.0, {}, "It is softer.")
    return Diagnosis(
        data="rig 3", model="a law", verdict="explained", noise_floor=0.01,
        error_before=Errors(0.2, 0.2), error_after=Errors(0.02, 0.02), causes=(cause,),
        unexplained_share=0.0, depends_on=(), next_test=None, steps=(), nominal=nominal_model,
        extended=extended,
    )  # fmt: skip


SCENARIO = iso.Scenario.model_validate(
    {"controller": [{"name": "passive_on"}], "ground": {"name": "el_centro_1940_ns",
                                                        "stop_s": 10.0}}
)  # fmt: skip


@pytest.fixture(scope="module")
def diagnosed():
    nominal = iso.law("strain_stiffening")
    return with_consequence(_diagnosis(nominal, softened(nominal)), SCENARIO)


def test_a_diagnosis_is_carried_into_a_scenario(diagnosed):
    one = diagnosed.consequence
    assert list(one.performance) == ["passive_off", "passive_on"]
    assert "reference building" in one.scenario and "2 s" in one.scaling
    content = json.loads(diagnosed.to_json())["consequence"]
    assert set(content["controllers"]["passive_on"]) == set(CASES)
    # half the moduli: what was predicted is too small
    for cases in content["controllers"].values():
        assert (
            cases["predicted"]["peak_base_displacement_m"]
            < (cases["actual"]["peak_base_displacement_m"])
        )


def test_the_reports_show_it(diagnosed, capsys):
    table = consequence_table(diagnosed.consequence)
    row = next(row for row in table.rows if row[0] == "passive on")
    assert len(row) == len(table.headings)
    assert float(row[3]) == pytest.approx(100 * (float(row[1]) / float(row[2]) - 1), abs=1)
    diagnosed.report()
    printed = capsys.readouterr().out
    assert all(cell in printed for cell in row) and "misses the peak base" in printed
    assert max(map(len, printed.splitlines())) <= standard_console().width
    assert f"| {' | '.join(row)} |" in markdown(diagnosed)
    section = next(
        s for s in diagnosis_report(diagnosed).sections if s.title.startswith("Consequence")
    )
    assert any(getattr(block, "caption", None) == table.title for block in section.blocks)


def test_a_prescribed_scale_stays():
    nominal = iso.law("strain_stiffening")
    scenario = SCENARIO.model_copy(
        update={"isolator": SCENARIO.isolator.model_copy(
            update={"length_scale": 10.0, "force_scale": 3000.0})}
    )  # fmt: skip
    result = with_consequence(_diagnosis(nominal, softened(nominal)), scenario).consequence
    run = iso.simulate(
        iso.reference_building().on(nominal.scaled(10.0, 3000.0)), scenario.build().records
    )
    predicted = result.performance["passive_off"]["predicted"]
    assert predicted.peak_base_displacement_m == pytest.approx(
        run.criteria["peak_base_displacement_m"], rel=1e-9
    )


def test_a_building_that_was_diagnosed_is_run_as_it_is(after):
    nominal = SCENARIO.build()
    result = BuildingDiagnosis(**vars(_diagnosis(None, None)), building=after)
    cases = with_consequence(result, SCENARIO).consequence.performance["passive_off"]
    for case, plant in (("predicted", nominal.isolated), ("actual", after)):
        run = iso.simulate(plant, nominal.records)
        peak = run.criteria["peak_base_displacement_m"]
        assert cases[case].peak_base_displacement_m == peak


def test_a_building_with_a_wrong_model_or_sensor_has_no_wrong_law(after):
    result = BuildingDiagnosis(**vars(_diagnosis(None, None)), building=after)
    one = with_consequence(result, SCENARIO).consequence
    assert one.subject == "model" and "The original model misses the peak" in one.finding
    assert "law" not in consequence_note(one) + consequence_table(one).title + one.finding
    cause = replace(result.causes[0], name="sensor_gain")
    of_sensor = replace(result, causes=(cause,))
    assert with_consequence(of_sensor, SCENARIO) is of_sensor


def test_what_makes_no_sense_is_left_out_in_words():
    nominal = iso.law("strain_stiffening")
    nothing = replace(_diagnosis(nominal, nominal), causes=(), verdict="adequate")
    assert with_consequence(nothing, SCENARIO) is nothing
    damper = replace(iso.law("kelvin_voigt", {"k": 1e3, "c": 1e4}), tested_deformation=0.01)
    refused = with_consequence(_diagnosis(damper, damper), SCENARIO).consequence
    assert not refused.performance and "cannot carry a building" in refused.finding


class _OldLawOnly(Controller):
    """Refuses a nominal model that is not the one it was made for."""

    name = "old_law_only"

    def __init__(self, expected):
        self._expected = expected

    def prepare(self, context, trial):
        if context.nominal is not self._expected:
            raise iso.InputError("made for another law")

    def current(self, t, measurement):
        return 1.0


def test_a_controller_that_refuses_the_new_law_leaves_the_others(before, after, ground):
    """A diagnosis takes long: one controller must not end it."""
    both = {"passive_off": iso.controller("passive_off"), "old_law_only": _OldLawOnly(before)}
    result = consequence(before, after, ground, both)
    assert "Not run: old law only, redesigned (made for another law)." in result.finding
    assert "diverges" not in result.finding and "misses the peak base" in result.finding
    assert result.performance["old_law_only"]["predicted"] is not None
    assert result.performance["old_law_only"]["redesigned"] is None
