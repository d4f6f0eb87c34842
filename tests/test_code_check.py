"""Code checks against hand calculation."""

from __future__ import annotations

import json

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940, write_csv
from isolation_sim.cli import main
from isolation_sim.code_check import (
    DESIGN,
    CheckRow,
    _beside,
    commands_until,
    damping_coefficient,
    effective_properties,
    peak_displacement,
    with_factors,
)
from isolation_sim.errors import InputError
from isolation_sim.laws import law
from isolation_sim.reports.code_check import check_page, console_table, verdict
from isolation_sim.reports.tables import as_text
from isolation_sim.structures import shear_building, with_p_delta
from isolation_sim.structures.isolation_loop import isolation_loop

pytestmark = pytest.mark.usefixtures("no_drawing")

WEIGHT_MASS = 5e5
GRAVITY = 9.80665


def building():
    return shear_building([2e5], [4e8], base_mass=3e5)


def test_table_of_damping_coefficients():
    assert damping_coefficient(0.0) == 0.8 and damping_coefficient(0.6) == 2.0
    assert damping_coefficient(0.15) == pytest.approx(1.35)
    assert damping_coefficient(0.45) == pytest.approx(1.95)


def test_spring_and_dashpot():
    """beta = c omega / (2 k), D_M = S T / (4 pi^2 B): all in closed form."""
    k, c, demand = 5e6, 2.5e5, 6.0
    plant = building().on(law("kelvin_voigt", {"k": k, "c": c}))
    effective = effective_properties(plant, demand)
    omega = np.sqrt(k / WEIGHT_MASS)
    period, damping = 2 * np.pi / omega, c * omega / (2 * k)
    displacement = demand * period / (4 * np.pi**2 * damping_coefficient(damping))
    assert effective.period == pytest.approx(period, rel=1e-5)
    assert effective.damping == pytest.approx(damping, rel=1e-3)
    assert effective.displacement == pytest.approx(displacement, rel=1e-3)
    assert effective.shear == pytest.approx(k * displacement, rel=1e-3)
    assert effective.softening == pytest.approx(1.0, rel=1e-6)
    slow_dashpot = c * omega / 50 * displacement * np.sqrt(1 - 0.25)
    restoring = (k * displacement / 2 - slow_dashpot) / (WEIGHT_MASS * GRAVITY)
    assert effective.restoring == pytest.approx(restoring, rel=1e-3)


def test_bilinear_bearing():
    """k_eff = k + Q / D and loop area 4 Q (D - u_y), for a sharp corner."""
    k, strength, u_y = 3e6, 2.5e5, 0.01
    numbers = {"k": k, "c": 0.0, "alpha": strength / u_y, "A": 1.0, "n": 10.0, "F0": 0.0}
    numbers |= {"beta": 0.5 / u_y**10, "gamma": 0.5 / u_y**10}
    plant = building().on(law("bouc_wen", numbers))
    x, force = isolation_loop(plant, 0.2, 2.5, 0.0)
    assert force[0] == pytest.approx(k * 0.2 + strength, rel=1e-4)
    area = np.trapezoid(force, x)
    # a rounded corner cuts off a little
    assert area == pytest.approx(4 * strength * (0.2 - u_y), rel=0.01)
    effective = effective_properties(plant, 6.0)
    d = effective.displacement
    stiffness = k + strength / d
    assert effective.stiffness == pytest.approx(stiffness, rel=1e-4)
    damping = 4 * strength * (d - u_y) / (2 * np.pi * stiffness * d**2)
    assert effective.damping == pytest.approx(damping, rel=0.01)
    assert effective.restoring == pytest.approx(k * d / 2 / (WEIGHT_MASS * GRAVITY), rel=2e-3)


def test_factors_and_p_delta():
    plant = building().on(law("kelvin_voigt", {"k": 5e6, "c": 1e5}))
    upper = with_factors(plant, {"k": 1.2})
    period = effective_properties(upper, 6.0).period
    assert period == pytest.approx(2 * np.pi * np.sqrt(WEIGHT_MASS / 6e6), rel=1e-4)
    stiff = with_factors(plant, 2.0)
    assert effective_properties(stiff, 6.0).stiffness == pytest.approx(1e7, rel=1e-4)
    leaning = with_p_delta(building(), 4.0).on(law("kelvin_voigt", {"k": 5e6, "c": 1e5}))
    left = 5e6 - WEIGHT_MASS * GRAVITY / 4.0
    assert effective_properties(leaning, 6.0).stiffness == pytest.approx(left, rel=1e-4)
    with pytest.raises(InputError, match=r"^factors: given 'Q'; expected: k, c$"):
        with_factors(plant, {"Q": 1.2})


def ended(arguments):
    """Exit code of the command line."""
    with pytest.raises(SystemExit) as end:
        main(arguments)
    return end.value.code


SCENARIO = """
[ground]
name = "el_centro_1940_ns"
stop_s = 6.0

[[controller]]
name = "on_off"

[moat_wall]
gap_m = 0.04
stiffness_N_per_m = 1e7

[check]
S_M1_g = 0.5
displacement_capacity_m = 0.25
quiet_after_s = 4.0
"""


def test_the_command_lists_failures_of_the_control(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(SCENARIO)
    assert ended(["check", "mine.toml", "--json", "--report", "check.html"]) == 0
    rows = json.loads(capsys.readouterr().out)
    by_case = {row["case"]: row for row in rows if row["group"] == "Failure of the control"}
    lost = next(case for case in by_case if case.startswith("power lost at"))
    assert {"coil stuck off", "coil stuck on"} < set(by_case)

    def amount(row):
        return float(row["value"].removesuffix(" mm"))

    history = [row for row in rows if row["subject"] == "largest isolator displacement"]
    nominal = next(row for row in history if row["case"] == "nominal, on_off")
    # until the power is lost the run is the same: it cannot do better than before
    assert amount(by_case[lost]) >= 0.5 * amount(nominal)
    assert all(row["limit"] == "at most 250 mm" for row in by_case.values())
    (beyond,) = (row for row in rows if row["subject"] == "deformation over that of the tests")
    assert beyond["case"] == "on_off" and beyond["passes"] == (float(beyond["value"]) <= 1)
    (touched,) = (row for row in rows if row["subject"] == "contacts with walls and stops")
    assert max(map(amount, history)) > 40
    assert int(touched["value"]) > 0 and not touched["passes"]
    page = (tmp_path / "check.html").read_text()
    assert "no certification" in page and "from memory" in page


@pytest.mark.parametrize("c, moves", [(1e4, True), (1e6, False)])
def test_an_elastic_building_that_still_moves_has_no_residual_displacement(
    tmp_path, capsys, c, moves
):
    """Of a linear building it is zero; a mean over part of a cycle is not."""
    isolator = f"""
[isolator]
law = "kelvin_voigt"
parameters = {{ k = 2e6, c = {c} }}
length_scale = 1.0
force_scale = 1.0
"""
    (tmp_path / "mine.toml").write_text(SCENARIO.split("[moat_wall]")[0].replace(
        '"on_off"', '"passive_off"') + isolator + "[check]\nS_M1_g = 0.5\nquiet_after_s = 20.0\n"
    )  # fmt: skip
    assert ended(["check", str(tmp_path / "mine.toml"), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    values = [row["value"] for row in rows if row["subject"].startswith("residual displacement")]
    assert len(values) == 3
    for value in values:
        assert value == "not known: still moving" if moves else float(value[:-3]) < 2


@pytest.mark.parametrize("count, statistic", [(7, np.mean), (2, np.max)])
def test_a_suite_is_checked_by_the_mean_of_its_motions_or_the_largest(
    tmp_path, capsys, count, statistic
):
    (tmp_path / "records").mkdir()
    whole = el_centro_1940()
    records = [whole.cut(0.5 * k, 3.0 + 0.5 * k) for k in range(count)]
    for k, record in enumerate(records):
        write_csv(record, tmp_path / "records" / f"r{k}.csv")
    ground = '[ground]\nfolder = "records"\nrule = "asce7_22_17"\n'
    text = SCENARIO.split("[moat_wall]")[0].split("[[controller]]")[1]
    check = "[check]" + SCENARIO.split("[check]")[1]
    (tmp_path / "suite.toml").write_text(f"{ground}[[controller]]{text}{check}")
    assert ended(["check", str(tmp_path / "suite.toml"), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    which = "mean" if count == 7 else "largest"
    groups = {row["group"] for row in rows[-8:]}
    assert groups == {f"{name}, {which} of {count} motions"
                      for name in ("Response history", "Failure of the control")}  # fmt: skip
    (shown,) = (
        row["value"] for row in rows
        if (row["subject"], row["case"]) == ("largest isolator displacement", "coil stuck on")
    )  # fmt: skip
    plant = iso.reference_building().on(iso.reference_isolators())
    on = iso.controller("constant", amperes=plant.tested_current())
    peaks = [iso.simulate(plant, each, on).criteria["peak_base_displacement_m"] for each in records]
    assert float(shown.removesuffix(" mm")) == pytest.approx(1e3 * statistic(peaks), rel=1e-3)


def test_power_is_lost_at_the_instant():
    run = iso.simulate(
        iso.reference_building().on(iso.reference_isolators()),
        el_centro_1940().cut(0, 4.0),
        "on_off",
    )
    time, rows = commands_until(run, 2.0, 0.0).values()
    assert time[-1] == 2.0 and rows[-1] == (0.0,)
    assert time[0] == 0.0 and len(time) == len(rows) > 3
    replayed = iso.simulate(
        run.isolated, run.records, iso.controller("prescribed", time=time, amperes=rows)
    )
    before = run.time < 2.0
    a, b = (r.history.displacement.values[before] for r in (run, replayed))
    np.testing.assert_allclose(a, b, atol=1e-5 * np.abs(a).max())


@pytest.mark.parametrize("period, delay", [(0.02, 0.006), (0.005, 0.0), (0.03, 0.011)])
def test_commands_are_repeated_when_they_acted(period, delay):
    plant = iso.reference_building().on(iso.reference_isolators())
    ground = el_centro_1940().cut(0, 6.0)
    options = {"driver": iso.CoilDriver(lag=0.01)}
    on_off = iso.controller("on_off", period=period)
    run = iso.simulate(plant, ground, on_off, computation_delay=delay, **options)
    time, rows = commands_until(run, 6.0, 0.0).values()
    prescribed = iso.controller("prescribed", time=time, amperes=rows)
    replayed = iso.simulate(plant, ground, prescribed, **options)
    a, b = (r.output("base_displacement_m") for r in (run, replayed))
    np.testing.assert_allclose(a, b, atol=1e-5 * np.abs(a).max())
    # a peak between samples counts
    assert peak_displacement(run) == pytest.approx(run.criteria["peak_base_displacement_m"], 2e-5)


def test_without_the_section_it_says_so(tmp_path, capsys):
    path = tmp_path / "plain.toml"
    path.write_text("")
    assert ended(["check", str(path)]) == 2
    assert "no [check] section" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("factors", "message"),
    [
        ("upper_factors = 0.5", "check.upper_factors: given 0.5; expected: 1 or more"),
        ("lower_factors = 1.2", "check.lower_factors: given 1.2; expected: 1 or less"),
        ("upper_factors = { k2 = 2 }", "check.upper_factors: given 'k2'; expected: c0, k0"),
    ],
)
def test_factors_that_bound_nothing_are_refused(factors, message, tmp_path, capsys):
    path = tmp_path / "bounds.toml"
    path.write_text(f"{SCENARIO}{factors}\n")
    assert ended(["check", str(path)]) == 2
    answer = capsys.readouterr().err
    assert message in answer and answer.count("\n") == 1


@pytest.mark.parametrize(
    ("value", "limit", "text"),
    [(30.02, 30.0, "30.02"), (29.99, 30.0, "29.99"), (30.0, 30.0, "30"), (28.71, 30.0, "28.7")],
)
def test_a_value_beside_its_limit_shows_on_which_side_it_is(value, limit, text):
    assert _beside(value, limit) == text


def test_the_verdict_names_what_fails_and_the_design_values():
    rows = [
        CheckRow("Group", "effective period T_M", "nominal", "17.4.1", "2 s", "at most 5 s", True),
        CheckRow("Group", "design displacement: the largest", "on_off", DESIGN, "397 mm",
                 "at most 380 mm", False),
        CheckRow("Group", "design shear: the largest", "on_off", DESIGN, "2674 kN"),
    ]  # fmt: skip
    assert verdict(rows) == [
        "1 of 2 checks with a limit pass, 1 do not.",
        "Not passed: design displacement (on-off), 397 mm; expected: at most 380 mm.",
        "Design displacement (on-off): 397 mm.",
        "Design shear (on-off): 2674 kN.",
    ]


def test_the_table_keeps_values_and_limits_in_one_line():
    long = "recentring: F(D_M) - F(D_M / 2), of the weight"
    row = CheckRow("Group", long, "lower bound, coil off", "17.2.4.4", "0.0491", "at least 0.025",
                   True)  # fmt: skip
    lines = as_text(console_table([row], "bi")).splitlines()
    (first,) = (line for line in lines if "recentring" in line)
    assert "lower bound, coil off" in first and "at least 0.025" in first
    assert all(len(line) <= 100 for line in lines)
    after = lines[lines.index(first) + 1]
    assert after.startswith("   ")  # indented like the line above
    page = check_page([row], iso.reference_building().on(iso.reference_isolators()), "bi")
    (table,) = page.sections[1].blocks
    assert table.rows[1].cells[3].text == "at\N{NO-BREAK SPACE}least\N{NO-BREAK SPACE}0.025"
