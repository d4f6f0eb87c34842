"""The nearest OpenSees material of a device: OpenSees itself gives the fitted forces."""

import numpy as np
import pytest

import isolation_sim as iso
from isolation_sim.cli import main
from isolation_sim.export.opensees import SAMPLES, USUAL, isolated_frequency
from studies.benchmarks.peers import load_opensees

pytestmark = pytest.mark.usefixtures("no_drawing")

ops = load_opensees()
needs_opensees = pytest.mark.skipif(ops is None, reason="OpenSeesPy does not load here")

NEAREST = {
    "strain_stiffening": "ElasticBilin and Viscous",
    "improved_bouc_wen": "BoucWen and Viscous",
}


def exit_code(path, current, *options):
    """End of the command that exports a scenario or a law at a current."""
    with pytest.raises(SystemExit) as stop:
        main(["export", "opensees", str(path), "--current", str(current), *options])
    return stop.value.code


def device_of(law):
    return iso.law(law).scaled(length=10, force=3000)


@needs_opensees
@pytest.mark.parametrize("law", NEAREST)
def test_opensees_gives_the_fitted_force_on_the_same_displacements(law):
    device = device_of(law)
    material = iso.opensees_material(device, 2.0)
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    for command in material.commands:
        ops.uniaxialMaterial(*command)
    ops.testUniaxialMaterial(material.commands[-1][1])
    results = []
    for x, v in zip(material.displacement.tolist(), material.velocity.tolist(), strict=True):
        ops.setStrain(x, v)
        results.append(ops.getStress())
    ops.wipe()
    peak = np.abs(material.fitted).max()
    np.testing.assert_allclose(results, material.fitted, rtol=0, atol=1e-9 * peak)
    # the stated error is that of OpenSees' force to the device's
    step = iso.DeviceSimulator(device, 1 / SAMPLES)
    force = [
        step.step(x, 2.0, v) for x, v in zip(material.displacement, material.velocity, strict=True)
    ]
    error = np.sqrt(np.mean(np.subtract(results, force) ** 2) / np.mean(np.square(force)))
    assert material.error == pytest.approx(error, rel=1e-6)
    assert material.name == NEAREST[law]
    assert material.error == min(material.errors.values()) < 0.15


def test_a_bilinear_device_is_restored():
    """Spring and dashpot are an OpenSees material themselves."""
    device = iso.law("kelvin_voigt", {"k": 2e5, "c": 3e4})
    material = iso.opensees_material(device, 0.0, amplitude=0.1)
    assert material.error < 1e-6
    stiffness, beyond, _ = material.commands[0][2:]
    assert [stiffness, beyond, material.commands[1][2]] == pytest.approx([2e5, 2e5, 3e4], rel=1e-4)


def test_a_bouc_wen_device_has_its_own_numbers():
    """The material has them in closed form, and gives the device's force at any fine step."""
    k, c, yields, knee, n = 2e6, 3e4, 6e6, 0.01, 1.5
    share = 0.5 / knee**n
    numbers = dict(k=k, c=c, alpha=yields, A=1.0, beta=share, gamma=share, n=n, F0=0.0)
    material = iso.opensees_material(iso.law("bouc_wen", numbers), 0.0, amplitude=0.08)
    (_, _, ratio, stiffness, exponent, gamma, beta, *_), (*_, viscosity, _), _ = material.commands
    assert [ratio, stiffness] == pytest.approx([k / (k + yields), k + yields], rel=0.01)
    assert exponent == pytest.approx(n, rel=0.1)
    # z' of both from rest to 8 knees, by the midpoint rule in 4000 steps
    dx, z, difference = 8 * knee / 4000, np.zeros(2), []
    powers, shares = np.array([exponent, n]), np.array([gamma + beta, 2 * share])
    for step in range(4000):
        middle = z + dx / 2 * (1 - shares * z**powers)
        z = z + dx * (1 - shares * middle**powers)
        x = (step + 1) * dx
        spring = [ratio * x, k / (k + yields) * x] + np.array(
            [1 - ratio, yields / (k + yields)]
        ) * z
        difference.append(stiffness * spring[0] - (k + yields) * spring[1])
    assert np.sqrt(np.mean(np.square(difference))) < 0.005 * (k * x + yields * z[1])
    assert viscosity == pytest.approx(c, rel=0.02)


def test_the_command_prints_and_writes_it(tmp_path, capsys):
    law = tmp_path / "fitted.toml"
    law.write_text(
        '[isolator]\nlaw = "kelvin_voigt"\nlength_scale = 1.0\nforce_scale = 1.0\n'
        "parameters = { k = 2e5, c = 3e4 }\ntested_deformation_m = 0.1\n"
    )
    assert exit_code(law, 0) == 0
    captured = capsys.readouterr().out
    assert "# error of the force up to 0.1 m at 1 Hz: " in captured
    assert "ops.uniaxialMaterial('Parallel', 3, 1, 2)" in captured
    compile(captured, "told", "exec")
    out = tmp_path / "material.tcl"
    for code, words in ((0, [str(out)]), (2, [str(out)]), (2, [str(tmp_path / "x.txt")])):
        assert exit_code(law, 0, "--out", *words) == code
    assert out.read_text().splitlines()[-1] == "uniaxialMaterial Parallel 3 1 2"


def test_loops_of_a_scenario_have_the_frequency_of_its_building(tmp_path, capsys):
    """1 Hz for every building gave it 250 mm in OpenSees in place of 155 mm."""
    path = tmp_path / "main.toml"
    path.write_text('[ground]\nname = "el_centro_1940_ns"\n')
    isolated = iso.reference_building().on(iso.reference_isolators())
    runs = ((0.0, []), (3.0, []), (0.0, ["--frequency", "0.9"]), (1.0, []))
    for current, options in runs:
        if current == 1.0:  # of its scaled isolators alone, too
            path.write_text('[isolator]\nlaw = "strain_stiffening"\n')
        assert exit_code(path, current, *options) == 0
        period = isolated.effective(0.08, current).period
        expected = float(options[1]) if options else 1 / period
        assert f"up to 0.08 m at {expected:.3g} Hz: " in capsys.readouterr().out


def test_which_of_several_elements_it_is_is_told(tmp_path, capsys):
    path = tmp_path / "two.toml"
    path.write_text(
        "[[element]]\nname = 'bearing'\ndirection = 'base'\nlaw = 'linear'\n"
        "parameters = { k = 1e6 }\nlength_scale = 1.0\nforce_scale = 1.0\n"
    )
    assert exit_code(path, 1) == 0
    captured = capsys.readouterr().out
    assert captured.startswith("# of isolator alone; further elements: bearing\n# Strain stiff")


def test_a_current_out_of_range_is_refused(tmp_path, capsys):
    path = tmp_path / "main.toml"
    path.write_text('[ground]\nname = "el_centro_1940_ns"\n')
    assert exit_code(path, 9) == 2 and "current 9 A is outside" in capsys.readouterr().err


def test_a_building_without_a_period_has_the_usual_loops():
    friction = iso.law("kelvin_voigt", {"k": 0.0, "c": 3e4})
    isolated = iso.reference_building().on(friction)
    assert isolated_frequency(isolated, 0.0, 0.1) == USUAL


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"amplitude": -1.0}, "amplitude: given -1.0 m; expected: above 0"),
        ({"frequency": 0.0}, "frequency: given 0.0 Hz; expected: above 0"),
        ({"current": 9.0}, "9"),
    ],
)
def test_what_cannot_be_used_is_said(value, message):
    with pytest.raises(iso.InputError, match=message):
        iso.opensees_material(device_of("strain_stiffening"), **{"current": 1.0, **value})


def test_only_a_law_of_the_current_needs_one(tmp_path, capsys):
    (tmp_path / "spring.toml").write_text(
        '[isolator]\nlaw = "kelvin_voigt"\nparameters = { k = 1e5, c = 1e3 }\n'
        "length_scale = 1.0\nforce_scale = 1.0\ntested_deformation_m = 0.01\n"
    )
    (tmp_path / "main.toml").write_text("")
    for name, code in (("spring", 0), ("main", 2)):
        with pytest.raises(SystemExit) as stop:
            main(["export", "opensees", str(tmp_path / f"{name}.toml")])
        assert (stop.value.code or 0) == code
    shown = capsys.readouterr()
    assert "'Viscous'" in shown.out
    assert "--current is missing; expected: a coil current in A" in shown.err
