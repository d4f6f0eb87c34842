"""Controllers in C: gcc takes them without a warning, and they decide as Python does."""

import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import el_centro_1940
from isolation_sim.cli import main
from isolation_sim.errors import InputError
from isolation_sim.export.c_text import CText
from isolation_sim.export.controller import controller_files
from isolation_sim.scenario.job import Job
from isolation_sim.structures import cones, on_soil, plan_building

GCC = shutil.which("gcc")
pytestmark = pytest.mark.skipif(GCC is None, reason="needs gcc")
STRICT = ["-std=c99", "-Wall", "-Werror", "-pedantic"]
OPTIMISED = ("on_off", "clipped_lqg extended")
"""Compiled as a user would, with -O2, which takes five times as long; mpc is as well."""

CASES = {
    "on_off": {},
    "on_off skyhook": {"rule": "skyhook", "dead_band": 0.01},
    "fuzzy": {},
    "frequency_tracking": {},
    "lyapunov": {},
    "sliding_mode": {},
    "clipped_lqr": {},
    "clipped_lqg": {},
    "clipped_lqg extended": {"filter": "extended"},
    "h2": {},
    "trained_policy": {},
}


@pytest.fixture(scope="module")
def job():
    isolated = iso.reference_building().on(iso.reference_isolators())
    controllers = {
        label: iso.controller(label.split()[0], **settings) for label, settings in CASES.items()
    }
    controllers["passive_on"] = iso.controller("passive_on")
    # until the current map has been asked where the force hardly depends on the current
    record = el_centro_1940().cut(1.0, 6.5)
    return Job("", isolated, (record,), controllers, {"driver": iso.CoilDriver(lag=0.02)})


def compiled_program(files, folder, *options):
    for name, text in files.items():
        (folder / name).write_text(text)
    sources = [name for name in files if name.endswith(".c")]
    done = subprocess.run(
        [GCC, *STRICT, *options, "-o", "program", *sources, "-lm"],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return folder / "program"


@pytest.mark.parametrize(
    "label",
    [pytest.param(one, marks=[pytest.mark.slow] if "extended" in one else []) for one in CASES],
)
def test_c_decides_as_python_does(label, job, tmp_path):
    """The same measurements, decision by decision."""
    optimised = ["-O2"] if label in OPTIMISED else []
    program = compiled_program(controller_files(job, label), tmp_path, *optimised)
    controller = job.controllers[label].in_python()
    rows, commands, decide = [], [], controller.current

    def watched(t, measurement):
        rows.append([t, *measurement])
        commands.append(decide(t, measurement))
        return commands[-1]

    controller.current = watched
    # in plain Python the extended filter takes 70 ms a decision, the network 13 ms
    duration = {"clipped_lqg extended": 0.6, "trained_policy": 2.0}.get(label, 5.5)
    records = [each.cut(0.0, duration) for each in job.records]
    iso.simulate(job.isolated, records, controller, **job.options)
    inputs = "\n".join(" ".join(map(repr, row)) for row in rows)
    done = subprocess.run([program], input=inputs, capture_output=True, text=True, check=True)
    computed = np.array([line.split() for line in done.stdout.splitlines()], float)
    expected = np.array(commands)
    assert len(np.unique(expected.round(6))) > 1
    np.testing.assert_allclose(computed, expected, rtol=0, atol=1e-12)
    assert re.fullmatch(rf"{len(rows)} steps, at most \S+ us a step", done.stderr.strip())
    print(f"{label}: {done.stderr.strip()}")


def test_c_starts_anew_and_keeps_within_the_limits(job, tmp_path):
    """Two states side by side; a measurement that is not a number."""
    files = controller_files(job, "clipped_lqr")
    main_text = """
#include <math.h>
#include <stdio.h>
#include "clipped_lqr.h"
int main(void)
{
    clipped_lqr_state a, b;
    double measured[clipped_lqr_N_MEASURED] = {0}, of_a[1], of_b[1], wild[1];
    measured[1] = 0.1;
    clipped_lqr_init(&a);
    clipped_lqr_step(&a, 0.0, measured, of_a);
    clipped_lqr_step(&a, clipped_lqr_PERIOD, measured, of_a);
    clipped_lqr_init(&b);
    clipped_lqr_step(&b, 0.0, measured, of_b);
    measured[0] = NAN;
    clipped_lqr_step(&a, 2 * clipped_lqr_PERIOD, measured, wild);
    measured[0] = 0.0;
    clipped_lqr_step(&b, clipped_lqr_PERIOD, measured, of_b);
    printf("%.17g %.17g %.17g", of_a[0], of_b[0], wild[0]);
    return 0;
}
"""
    files["clipped_lqr_run.c"] = main_text
    program = compiled_program(files, tmp_path)
    done = subprocess.run([program], capture_output=True, text=True, check=True)
    of_a, of_b, wild = map(float, done.stdout.split())
    assert of_a == of_b
    low, high = job.isolated.current_range(0)
    assert low <= wild <= high


def test_the_command_writes_the_files(tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["export", "c", "--controller", "on_off", "--out", str(tmp_path)])
    assert stop.value.code == 0
    files = ["on_off.c", "on_off.h", "on_off_run.c"]
    assert sorted(path.name for path in tmp_path.iterdir()) == files
    assert "measured[0]: isolator_deformation_m" in (tmp_path / "on_off.h").read_text()
    assert "malloc" not in (tmp_path / "on_off.c").read_text()
    with pytest.raises(SystemExit) as stop:
        main(["export", "c", "--controller", "on_of", "--out", str(tmp_path)])
    assert stop.value.code == 2
    assert "on_off" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("controller", "said"),
    [
        (iso.controller("mpc", deadline=0.01), "has no compiled decision"),
        (iso.controller("passive_on"), "is an open loop"),
    ],
)
def test_what_has_no_form_in_c_is_refused(controller, said, job):
    with pytest.raises(InputError, match=said):
        controller_files(replace(job, controllers={"it": controller}), "it")


@pytest.mark.parametrize(
    ("name", "settings", "driver", "ahead"),
    [
        pytest.param(
            "mpc", {}, iso.CoilDriver(lag=0.05, slew=60.0, high=3.0), (), marks=pytest.mark.slow
        ),
        # a jump of the current shows in the accelerations; the ground motion ahead is an input
        pytest.param(
            "mpc", {"preview": 0.4}, iso.CoilDriver(high=3.0), range(5, 401, 5),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "mpc", {"filter": "extended", "learning": 20.0}, iso.CoilDriver(lag=0.05, high=3.0), (),
            marks=pytest.mark.slow,
        ),
        (
            "trained_policy", {"preview": 0.8}, iso.CoilDriver(lag=0.05, high=3.0),
            range(20, 801, 20),
        ),
    ],
    ids=["bare", "preview", "observer", "trained"],
)  # fmt: skip
def test_predictive_control_in_c_decides_as_in_the_simulation(
    name, settings, driver, ahead, job, tmp_path
):
    controller = iso.controller(name, **settings)
    sensors = iso.Sensors(delay=0.02 if "filter" in settings else 0.0)
    options = {"driver": driver, "sensors": sensors}
    case = replace(job, controllers={name: controller}, options=options)
    files = controller_files(case, name)
    assert "malloc" not in files[f"{name}.c"]
    inputs = re.findall(r"measured\[\d+\]: (\S+)", files[f"{name}.h"])
    known = [each for each in inputs if "_in_" in each]
    assert known == [f"ground_acceleration_in_{ms}_ms_m_s2" for ms in ahead]
    optimised = ["-O2"] if not settings else []
    program = compiled_program(files, tmp_path, "-DREPEATS=2", *optimised)
    check_decisions(program, controller, case)
    if name == "mpc":
        assert controller.report.failed == 0


def check_decisions(program, controller, job):
    """The program decides as the controller in a run."""
    rows, decide = [], controller.current

    def watched(t, measurement):
        command = decide(t, measurement)
        rows.append([t, *controller._step.measured.tolist()])
        return command

    controller.current = watched
    run = iso.simulate(job.isolated, job.records, controller, **job.options)
    inputs = "\n".join(" ".join(map(repr, row)) for row in rows)
    done = subprocess.run([program], input=inputs, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    computed = np.array([line.split() for line in done.stdout.splitlines()], float)
    assert np.ptp(computed) > 1.0
    np.testing.assert_allclose(computed, run.command[: len(computed)], rtol=0, atol=1e-12)
    print(f"{controller.name}: {done.stderr.strip()}")


def on_stiff_soil():
    """Two modes of the foundation are overdamped."""
    isolated = iso.reference_building().on(iso.reference_isolators())
    return on_soil(isolated, cones(10.0, 600.0, 2000.0, 0.3), 1e6)


def in_plan():
    """A building of unequal directions and eccentric floors, on biaxial isolators."""
    structure = plan_building(
        [2.5e5], [3e8], [2.5e8], base_mass=3e5, plan=(24.0, 15.0), eccentricity=(1.0, 0.5)
    )
    return structure.on(iso.law("strain_stiffening").scaled(10, 2000), biaxial=True)


@pytest.mark.parametrize(
    ("building", "name", "settings"),
    [
        pytest.param(on_stiff_soil, "mpc", {}, marks=pytest.mark.slow),
        (on_stiff_soil, "mpc", {"filter": "extended", "learning": 20.0}),
        (on_stiff_soil, "trained_policy", {"preview": 0.8}),
        pytest.param(in_plan, "mpc", {}, marks=pytest.mark.slow),
    ],
    ids=["soil", "soil, observer", "soil, trained", "plan"],
)
def test_predictive_control_in_c_stays_within_its_arrays(building, name, settings, tmp_path):
    """Under the sanitizers of gcc, where they are installed."""
    isolated, controller = building(), iso.controller(name, **settings)
    records = [el_centro_1940().cut(start, start + 2.0) for start in (1.0, 3.0)]
    records = tuple(records[: len(isolated.structure.directions)])
    options = {"driver": iso.CoilDriver(lag=0.05, high=3.0)}
    job = Job("", isolated, records, {name: controller}, options)
    files = controller_files(job, name)
    assert "malloc" not in files[f"{name}.c"]
    program = compiled_program(files, tmp_path, "-DREPEATS=1", *sanitizers(tmp_path))
    check_decisions(program, controller, job)
    if name == "mpc":
        assert controller.report.failed == 0


def sanitizers(folder):
    """Options for gcc."""
    # nothing is optimised away that they could see, and it compiles in a tenth of the time
    options = ["-O0", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    (folder / "nothing.c").write_text("int main(void) { return 0; }\n")
    command = [GCC, *options, "-o", "nothing", "nothing.c"]
    return options if subprocess.run(command, cwd=folder).returncode == 0 else []


PYTHON = '''
TABLE = ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
WHOLE = -7
@plain
def swapped(a: float, b: float):
    """Both, the other way round."""
    a, b = b, a
    return a, b
@plain
def f(x, out):
    n = 0
    for k in range(len(x) - 1, -1, -1):
        if x[k] > 2.0 and not x[k] > 5.0:
            continue
        n += 1
    i = j = 1
    first, second = swapped(n, x[1])
    total = 0
    total += TABLE[i][j + 1] / 4
    out[0] = n
    out[1], out[2] = first, second
    out[3] = WHOLE // 2 + WHOLE % 3 + 2 ** 5 + (1 << 3) + 2.0 ** 0.5
    out[4] = max(x[0], 1, n) + min(3, n) + abs(WHOLE) + abs(x[2])
    out[5] = len(x[2:100]) + len(x[3:1]) + x[1:][1]
    out[6] = 1.0 if 0.0 < x[0] < 2.0 else total
    while n > 0:
        n -= 2
        if n == 1:
            break
    out[7] = n + int(-2.7) + total
    out[8] = out[9] = np.nextafter(1.0, 2.0)
'''


def test_the_language_means_the_same_in_c(tmp_path):
    """Each construct, against Python itself."""
    names = {"plain": lambda function: function, "np": np}
    exec(PYTHON, names)
    x, out = np.array([1.5, -2.0, 3.5, 6.0]), np.zeros(10)
    names["f"](x, out)
    module = CText(PYTHON, "m")
    name, kind = module.function("f", ["a", "a"])
    assert kind == "v"
    text = f"""#include <math.h>
#include <stdio.h>
{module.definitions()}
int main(void)
{{
    double x[4] = {{1.5, -2.0, 3.5, 6.0}}, y[10] = {{0}};
    array a = {{x, 4}}, b = {{y, 10}};
    {name}(a, b);
    for (int k = 0; k < 10; ++k)
        printf("%.17g ", y[k]);
    return 0;
}}
"""
    program = compiled_program({"main.c": text}, tmp_path)
    done = subprocess.run([program], capture_output=True, text=True, check=True)
    np.testing.assert_array_equal(np.array(done.stdout.split(), float), out)


def test_what_the_language_lacks_is_named():
    module = CText("def f(x):\n    return [v for v in x]\n", "m")
    with pytest.raises(InputError, match=r"f has no form in C: it uses '\[v for v in x\]'"):
        module.function("f", ["a"])
