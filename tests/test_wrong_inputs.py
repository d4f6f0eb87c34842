"""Wrong inputs of every kind, each answered in one clear line; on the command line with exit 2.

The table is the specification: what a user may get wrong, and the part of the answer that names
it. Nothing of it reaches a simulation.
"""

import runpy
from importlib import import_module
from inspect import isfunction, signature
from pathlib import Path

import numpy as np
import pytest

import isolation_sim as iso
from ground_motions import Record, el_centro_1940, read
from isolation_sim.cli import main
from isolation_sim.effects import Effect, EffectParameter, extend
from isolation_sim.errors import InputError
from isolation_sim.laws.law import Law, Quantity
from isolation_sim.simulation.control import CoilDriver, Sensors

CSV = "time_s,ground_acceleration_m_s2\n0.00,0.1\n0.01,-0.2\n0.02,0.1\n"
SHEAR = "[structure]\nfloor_masses_kg = {m}\nstorey_stiffnesses_N_per_m = {k}\nbase_mass_kg = {b}\n"

# a scenario's text, and what the answer says
SCENARIOS = [
    ("name = 3", "name: given 3; expected: text"),
    ("name = ''", "name: given ''; expected: text that is not empty"),
    ("nme = 'a'", "unknown key 'nme'; did you mean 'name'?"),
    ("ground = 1", "ground"),
    ("ground = []", "ground"),
    ("[ground]\nname = 'el_centro'", "ground: record name: given 'el_centro'; did you mean"),
    ("[ground]\nsoil = 'firm'", "ground.kind is missing"),
    (
        "[ground]\nfile = 'a.csv'\ncolum = 'b'",
        "ground: unknown key 'colum'; did you mean 'column'?",
    ),
    (
        "[[ground]]\n[[ground]]\nscale_factor = 'x'",
        "ground[1].scale_factor: given 'x'; expected: a number",
    ),
    ("[ground]\nnam = 'el_centro_1940_ns'", "unknown key 'nam'; did you mean 'name'?"),
    ("[ground]\nkind = 'recrd'", "ground.kind: given 'recrd'; did you mean 'record'?"),
    ("[ground]\nstart_s = -1.0", "ground.start_s: given -1.0; expected: 0 or more"),
    ("[ground]\nstop_s = 0.0", "ground.stop_s: given 0.0; expected: a number above 0"),
    ("[ground]\nstart_s = 5.0\nstop_s = 4.0", "ground"),
    ("[ground]\nstart_s = 100.0", "ground"),
    ("[ground]\nstop_s = '4'", "ground.stop_s: given '4'; expected: a number"),
    ("[ground]\nstop_s = nan", "ground.stop_s: given nan"),
    ("[ground]\nscale_factor = inf", "ground.scale_factor: given inf; expected: a finite number"),
    ("[ground]\nscale_factor = 1.0\nscale_to_pga_g = 0.3", "expected: at most one of them"),
    ("[ground]\nscale_to_sa_g = 0.3", "scale_to_sa_g or sa_period_s is missing"),
    ("[ground]\nhighpass_Hz = 0.1", "highpass_Hz needs baseline_order"),
    ("[ground]\nbaseline_order = 99", "ground"),
    ("[ground]\nresample_to_s = 1e-7", "up to 20,000,000 samples"),
    ("[ground]\nresample_to_s = 100.0", "at most half the duration"),
    ("[ground]\nquiet_after_s = 1e9", "up to 20,000,000 samples"),
    ("[ground]\nquiet_before_s = -1.0", "ground.quiet_before_s: given -1.0; expected: 0 or more"),
    ("[ground]\nfile = 'none.at2'", "none.at2: no such file"),
    ("[ground]\nfile = 3", "ground.file: given 3; expected: a path, as text"),
    ("[ground]\nfile = 'short.at2'", "short.at2"),
    ("[ground]\nfile = 'motion.xyz'", "motion.xyz"),
    ("[ground]\nfile = 'empty.csv'", "empty.csv"),
    ("[ground]\nfile = 'text.csv'", "text.csv"),
    ("[ground]\nfile = 'motion.csv'\ncolumn = 'acc'", "column: given 'acc'"),
    ("[ground]\nfile = 'motion.txt'\ndt_s = 0.01", "unit"),
    ("[ground]\nfile = 'motion.txt'\nunit = 'g'", "motion.txt"),
    ("[ground]\nfile = 'motion.txt'\nunit = 'yd/s2'\ndt_s = 0.01", "given unit 'yd/s2'"),
    ("[ground]\nfile = 'motion.csv'\nreader = 'cvs'", "unknown reader 'cvs'; did you mean 'csv'?"),
    ("[ground]\nkind = 'kanai_tajimi'", "ground"),
    ("[ground]\nkind = 'band_limited_noise'\nlow_Hz = 1.0", "is missing; it has no default"),
    (
        "[ground]\nkind = 'band_limited_noise'\nlow_Hz = 1.0\nhigh_Hz = 0.5\nduration_s = 5.0\n"
        "rms_m_s2 = 1.0",
        "ground",
    ),
    (
        "[ground]\nkind = 'band_limited_noise'\nlow_Hz = 1.0\nhigh_Hz = 5.0\nduration_s = 1e9\n"
        "rms_m_s2 = 1.0",
        "up to 20,000,000 samples",
    ),
    ("[[ground]]\n[[ground]]", "takes 1 ground motions"),
    ("structure = 'reference'", "structure"),
    ("[structure]\nkind = 'sheer'", "structure.kind: given 'sheer'; did you mean 'shear'?"),
    ("[structure]\nfloor_masses_kg = [1e5]", "is missing; it has no default"),
    (SHEAR.format(m="[]", k="[]", b=1e5), "a list of 1 or more"),
    (SHEAR.format(m="[0.0]", k="[1e8]", b=1e5), "floor_masses_kg[0]: given 0.0; expected: a num"),
    (
        SHEAR.format(m="[1e5]", k="[-1.0]", b=1e5),
        "N_per_m[0]: given -1.0; expected: a number above",
    ),
    (SHEAR.format(m="[1e5]", k="['a']", b=1e5), "N_per_m[0]: given 'a'; expected: a number"),
    (SHEAR.format(m="[1e5, 1e5]", k="[1e8]", b=1e5), "storey_stiffnesses_N_per_m has 1 numbers"),
    (
        SHEAR.format(m="[1e5, 1e5]", k="[1e8, 1e8]", b=1e5) + "storey_heights_m = [3.0]",
        "storey_heights_m has 1 numbers; expected: 2, as floor_masses_kg has",
    ),
    ("[moat_wall]\ngap_m = 350\nstiffness_N_per_m = 1e8", "moat_wall.gap_m: given 350; expected: "),
    (SHEAR.format(m="[1e5]", k="[1e8]", b="'x'"), "base_mass_kg: given 'x'; expected: a number"),
    (SHEAR.format(m="[1e5]", k="[1e8]", b=1e5) + "damping = 'raleigh'", "'rayleigh'"),
    (SHEAR.format(m="[1e5]", k="[1e8]", b=1e5) + "damping_ratio = 2.0", "a number below 1"),
    (SHEAR.format(m="[1e5,1e5]", k="[1e8,1e8]", b=1e5) + "rayleigh_modes = [1, 3]", "1 to 2"),
    (SHEAR.format(m="[1e5]", k="[1e8]", b=1e5), "length_scale is missing"),
    (
        SHEAR.format(m="[1e5]", k="[1e8]", b=1e5) + "storey_heights_m = [3.0, 3.0]\n[isolator]\n"
        "target_period_s = 2.0",
        "heights",
    ),
    ("[structure]\nkind = 'matrices'", "structure.file is missing"),
    ("[structure]\nfile = 'none.npz'", "none.npz"),
    ("[structure]\nfile = 'motion.csv'", "motion.csv"),
    ("[structure]\nfile = 'lacking.npz'", "array 'K' is missing"),
    ("[structure]\nfile = 'uneven.npz'", "has shape (2, 3); expected: (2, 2)"),
    ("[structure]\nfile = 'massless.npz'", "mass of"),
    ("[isolator]\nlaw = 'bouc_wenn'", "unknown law 'bouc_wenn'; did you mean 'bouc_wen'?"),
    ("[isolator]\nlaw = 'none.py:LAW'", "cannot be read"),
    ("[isolator]\nlaw = 'own.py:NOTHING'", "own.py:NOTHING"),
    ("[isolator]\nlaw = 'own.py:NUMBER'", "NUMBER': given 3; expected: an isolation_sim.laws.Law"),
    (
        "[isolator]\nlaw = 'own.py:BRANCH'\nparameters = { k = 1e6 }\nlength_scale = 1.0\n"
        "force_scale = 1.0",
        "own.py:7: 'if x > abs(x) / 2:' cannot be traced in force; expected: a comparison",
    ),
    (
        "[isolator]\nlaw = 'own.py:BRANCH'\nparameters = { k = 1e6 }\ntarget_period_s = 2.0",
        "own.py:7: 'if x > abs(x) / 2:' cannot be traced in force; expected: a comparison",
    ),
    (
        "[isolator]\nlaw = 'own.py:UNKNOWN'\nparameters = { k = 1e6 }\ntarget_period_s = 2.0",
        "'return p[0] * abs(y)' in force: NameError: name 'y' is not defined",
    ),
    (
        "[isolator]\nlaw = 'own.py:WHOLE'\nparameters = { k = 1e6 }\ntarget_period_s = 2.0",
        "'return p[0] * (x + p)' in force cannot be traced (TypeError); expected: + - * / **",
    ),
    ("[isolator]\nparameters = 'genralised'", "unknown parameter set of strain_stiffening"),
    ("[isolator]\nparameters = { q = 1.0 }", "q"),
    ("[isolator]\nparameters = 4", "isolator.parameters: given 4; expected: text or a table"),
    ("[isolator.parameters]\nk0 = ['a']", "isolator.parameters.k0[0]: given 'a'"),
    (
        "[isolator]\nlaw = 'kelvin_voigt'\nparameters = { k = -1.0, c = 1.0 }",
        "parameter 'k': given -1",
    ),
    ("[isolator]\nlaw = 'kelvin_voigt'\nparameters = { k = 1.0 }", "c"),
    ("[isolator]\nlaw = 'kelvin_voigt'", "no published set; parameters needed: k, c"),
    ("[isolator]\ncurrent_range_A = [3.0]", "a list of 2 or more"),
    ("[isolator]\ncurrent_range_A = [3.0, 1.0]", "current_range: given (3.0, 1.0)"),
    ("[isolator]\ntested_deformation_m = 0.0", "a number above 0"),
    ("[isolator]\nlength_scale = -10.0", "isolator.length_scale: given -10.0"),
    ("[isolator]\nforce_scale = true", "isolator.force_scale: given True; expected: a number"),
    ("[isolator]\ncount = 0.0", "isolator.count: given 0.0; expected: a number above 0"),
    ("[isolator]\nswitching = 'active'", "isolator.switching: given 'active'"),
    ("[isolator]\ntarget_period_s = 0.3", "target_period_s: given 0.3; expected: above 0.5"),
    (
        "[isolator]\ntarget_period_s = 2.0\nlength_scale = 9.0",
        "length_scale and target_period_s are both set",
    ),
    ("[isolator]\ntarget_period_s = 2.0\ndamping_ratio = 0.001", "damping_ratio: given 0.001; exp"),
    ("[isolator]\ndesign_displacement_m = 0.1", "is set without target_period_s or"),
    ("[[isolator.effect]]\nname = 'frction'", "unknown effect 'frction'"),
    ("[[isolator.effect]]\nname = 'coulomb_friction'\nform = 'x'", "unknown form"),
    ("[[isolator.effect]]\nname = 'coulomb_friction'", "is missing; needed"),
    (
        "[[element]]\ndirection = 'storey1'\nlaw = 'linear'\nparameters = { k = 1.0 }\n"
        "dirction = 1",
        "unknown key 'dirction'; did you mean 'direction'?",
    ),
    (
        "[[element]]\ndirection = 'storey9'\nlaw = 'linear'\nparameters = { k = 1.0 }",
        "unknown storey or dof 'storey9'",
    ),
    ("[[element]]\ndirection = [1.0]\nlaw = 'linear'\nparameters = { k = 1.0 }", "has shape (1,)"),
    ("[[element]]\ndirection = 'storey1'", "has no channel"),
    ("[[element]]\ndirection = 'storey1'\nchannel = 5", "without gaps"),
    ("[[controller]]\nname = 'clipped_lqrr'", "controller[0]: unknown controller 'clipped_lqrr'"),
    ("[[controller]]\namperes = 1.0", "controller[0].name is missing"),
    ("[[controller]]\nname = 'constant'\namperes = 'high'", "amperes"),
    ("[[controller]]\nname = 'constant'\nampere = 1.0", "did you mean 'amperes'?"),
    ("[[controller]]\nname = 'on_off'\nperiod = -1.0", "period"),
    ("[[controller]]\nname = 'on_off'\nperiod = 1e-9", "period is 1e-09 s, "),
    ("[[controller]]\nname = 'on_off'\n[[controller]]\nname = 'on_off'", "two controllers have"),
    ("controller = []", "controller: given []; expected: a list of 1 or more"),
    ("controller = 3", "controller: given 3; expected: a list"),
    (
        "[controller]\nname = 'on_off'",
        "expected: a list (of tables: [[controller]], double brackets)",
    ),
    ("driver = 3", "driver: given 3; expected: a table"),
    ("[driver]\nlag_s = -0.1", "driver.lag_s: given -0.1; expected: 0 or more"),
    ("[driver]\nslew_A_per_s = 0.0", "driver.slew_A_per_s: given 0.0; expected: a number above 0"),
    ("[driver]\nlow_A = 2.0\nhigh_A = 1.0", "high"),
    ("[driver]\nlag = 0.1", "driver: unknown key 'lag'; did you mean 'lag_s'?"),
    ("[driver]\nlag_s = -1\nslew_A_per_s = -1", "0 or more (and 1 more problem)"),
    ("[sensors]\ndropout = 1.0", "sensors.dropout: given 1.0; expected: a number below 1"),
    ("[sensors]\nseed = -1", "sensors.seed: given -1; expected: 0 or more"),
    ("[sensors]\nseed = 1.5", "sensors.seed: given 1.5; expected: a whole number"),
    ("[simulation]\ntolerance = 1.0", "simulation.tolerance: given 1.0; expected: 0.01 or less"),
    ("[simulation]\ncurrent_outside = 'clip'", "did you mean 'clamp'?"),
    ("[simulation]\nfixed_base = 1", "simulation.fixed_base: given 1; expected: true or false"),
    ("[nominal]\nlaw = 'lineer'", "unknown law 'lineer'"),
    ("[nominal]\nforce_factor = 0.0", "nominal.force_factor: given 0.0; expected: a number ab"),
    ("[nominl]\nforce_factor = 1.0", "unknown key 'nominl'; did you mean 'nominal'?"),
    ("name = 'a'\nname = 'b'", "job.toml: not TOML"),
]

# a plan's text, and what the answer says
VARY = "[[vary]]\nfield = 'isolator.count'\n"
PLANS = [
    ("vary = 1", "vary: given 1; expected: a list"),
    ("[[vary]]\nvalues = [1.0]", "vary[0].field is missing"),
    (VARY, "expected: values, or low and high"),
    (VARY + "values = []", "a list of 1 or more"),
    (VARY + "low = 2.0\nhigh = 1.0\ncount = 3", "low and high: given 2 and 1; expected: low"),
    (VARY + "low = 1.0\nhigh = 2.0\ncount = 1", "count: given 1; expected: 2 or more"),
    (VARY + "low = 1.0\nhigh = 2.0\ncount = 3\nstep = 0.1", "at most one of them"),
    (VARY + "low = 0.0\nhigh = 2.0\ncount = 3\nspacing = 'log'", "given 0, with log spacing; exp"),
    (VARY + "low = 1.0\nhigh = 2.0\ncount = 3\nspacing = 'logarithmic'", "'log'"),
    (VARY + "low = 1.0\nhigh = 2.0", "isolator.count has limits but no count"),
    (VARY + "low = 1.0\nhigh = 2.0\nstep = 1e-12", "makes 1e+12 values"),
    (VARY + "values = [1.0]\nnames = ['a', 'b']", "names and values differ in number"),
    (
        VARY + "values = [-1.0]",
        "isolator.count = -1.0: isolator.count: given -1.0; expected: a number a",
    ),
    (VARY + "valus = [1.0]", "did you mean 'values'?"),
    (VARY + "values = ['many']", "isolator.count"),
    ("[[vary]]\nfield = 'isolator.cuont'\nvalues = [1.0]", "count"),
    ("[[vary]]\nfield = 'isolator..count'\nvalues = [1.0]", "cannot be read"),
    ("[[vary]]\nfield = 'controller.amperes'\nvalues = [1.0]", "unknown field"),
    (
        "[[vary]]\nfield = 'isolator.target_period_s'\nlabel = 'T'\nvalues = [0.4, 0.3]",
        "T = 0.4: isolator: ",
    ),
    ("vry = []", "did you mean 'vary'?"),
    ("[sample]\ncount = 4", "no quantity is sampled"),
    ("[[vary]]\nfield = 'controller[9].amperes'\nvalues = [1.0]", "controller"),
    (VARY + "values = [1.0]\n" + VARY + "values = [2.0]", "is varied twice"),
    (VARY + "low = 1.0\nhigh = 2.0\n[sample]\ncount = 0", "sample.count: given 0"),
    (VARY + "low = 1.0\nhigh = 2.0\n[sample]\ncount = 4\nmethod = 'soboll'", "'sobol'"),
    (VARY + "low = 1.0\nhigh = 2.0\n[sample]\ncount = 3\nmethod = 'sobol'", "a power of 2"),
    (VARY + "low = 1.0\nhigh = 2.0\n[sample]\ncount = 1000000000", "makes 1e+09 values"),
    ("[cases]\nfile = 'none.csv'", "none.csv: cannot be read"),
    ("[cases]\nfile = 'empty.csv'", "empty.csv: empty"),
    ("[seeds]\ncount = 0", "seeds.count: given 0"),
    ("scenario = 'none.toml'", "none.toml: no such file"),
    ("[scenario.isolator]\ncuont = 1.0", "unknown key 'cuont'; did you mean 'count'?"),
    ("histories = 'all'", "histories"),
]

# a command line, and what the answer says
COMMANDS = [
    ("rnu", "No such command 'rnu'"),
    ("run --jsn", "No such option: --jsn"),
    ("run none.toml", "none.toml: no such file"),
    ("run a.toml b.toml", "unexpected extra argument"),
    ("run motion.csv", "motion.csv: not TOML"),
    ("run --out motion.csv/out", "motion.csv/out: results cannot be written there"),
    ("run --overwrite --out .", "is no results folder"),
    ("new motion.csv", "motion.csv: exists; expected: a new name, or --force"),
    ("list", "Missing argument"),
    ("list lawz", "unknown subject 'lawz'; did you mean 'laws'?"),
    ("fit", "Missing argument"),
    ("fit .", "Missing option '--law'"),
    ("fit none --law linear", "none: a folder that does not exist"),
    ("fit . --law linear --starts few", "Invalid value for '--starts'"),
    ("fit . --law linear --fix k", "--fix k"),
    (
        "fit no --law linear --out motion.csv",
        "motion.csv: exists; expected: a new name, or --force",
    ),
    ("fit no --law linear --report motion.csv", "motion.csv: exists"),
    ("fit no --law linear --out new.toml --report motion.csv", "motion.csv: exists"),
    ("fit no --law linear --figure loops", "loops.svg: exists"),
    ("fit . --law linear --out motion.csv/a.toml", "motion.csv is a file; expected: a folder"),
    ("diagnose none.csv", "none.csv"),
    ("diagnose motion.csv", "motion.csv: a building record needs its building"),
    ("diagnose motion.csv .", ".: not a CSV file of a building record"),
    ("diagnose . --hold-out motion.csv", ".: not a CSV file of a building record"),
    ("diagnose motion.csv --hold-out none.csv", "none.csv: cannot be read"),
    ("sweep none.toml", "none.toml: no such file"),
    ("sweep plan.toml --workers 0", "workers: given 0; expected: 1 or more"),
    ("sweep plan.toml --workers two", "Invalid value for '--workers'"),
    ("sweep plan.toml --out .", ": is not empty; expected: a new folder"),
    ("sweep show .", "no sweep there"),
    ("sweep new motion.csv", "motion.csv: exists"),
    ("study no_such_study", "no_such_study"),
    ("study papres", "unknown study 'papres'; did you mean 'papers'?"),
    ("evaluate none.toml .", "none.toml: no such file; expected: the file of a law"),
    ("cite none.toml", "none.toml"),
]


def isolated():
    return iso.reference_building().on(iso.reference_isolators())


MOTION = Record([0.0, 0.1, 0.0], 0.01)
BRANCH = Law(
    "branch",
    "Branch",
    (Quantity("k", "N/m", "stiffness"),),
    lambda x, v, s, p: p[0] * x if x > 0 else 0.0,
)


def listed(x, v, s, p):
    return [p[0] * x]


def powered(x, v, states, parameters):
    k, n = parameters
    return k * (x + np.sign(x) * np.fabs(x) ** n)


POWERED = Law(
    "powered", "Powered",
    (Quantity("k", "N/m^n", "stiffness", 0.0), Quantity("n", "1", "power", 1.0, 2.0)), powered,
)  # fmt: skip


def halved(signals, states, parameters):
    return (signals.x if signals.x > 0 else signals.x / 2), signals.v


HALVED = Effect(
    "halved", "one_side", "Halved",
    (EffectParameter("part", "1", "part", magnitude=True, starts=(0.1,)),), motion=halved,
)  # fmt: skip


def on_halved():
    device = extend(iso.law("strain_stiffening"), [(HALVED, {"part": 0.5})])
    return iso.reference_building().on(iso.reference_isolators(device))


def on_powers():
    isolators = iso.Device(
        POWERED, iso.laws.CurrentDependence.polynomial({"k": (1e7, 1e6), "n": 1.5}), (0.0, 3.0)
    )
    return iso.reference_building().on(isolators)


LISTED = Law("listed", "Listed", (Quantity("k", "N/m", "stiffness"),), listed)

# a call in Python, and what the answer says
CALLS = [
    (
        lambda: iso.simulate(iso.reference_building(), MOTION),
        "isolated: given a Structure; expected: an IsolatedStructure, such as str",
    ),
    (lambda: iso.simulate(None, MOTION), "isolated: given None; expected: an IsolatedStructure"),
    (
        lambda: iso.simulate(isolated(), "motion.csv"),
        "ground: given 'motion.csv'; expected: a Record, such as ground_motions.read(path), "
        "load_record(name) or Record(acceleration, dt) or a list of them",
    ),
    (lambda: iso.simulate(isolated(), 3.0), "ground: given 3.0; expected: a Record"),
    (lambda: iso.simulate(isolated(), [1.0, 2.0]), "ground[0]: given 1.0; expected: a Record"),
    (
        lambda: iso.simulate(isolated(), MOTION.acceleration),
        "ground: given an array; expected: a Record",
    ),
    (lambda: iso.simulate(isolated(), [MOTION, MOTION]), "takes 1 ground motions"),
    (lambda: iso.compare(isolated(), [MOTION] * 2, ["mpc"]), "or compare_records in Python"),
    (lambda: iso.compare(isolated(), {"a": MOTION}, ["mpc"]), "compare_records takes several"),
    (lambda: iso.simulate(isolated(), MOTION, "clipped_lqrr"), "unknown controller"),
    (lambda: iso.simulate(isolated(), MOTION, type(iso.controller("on_off"))), "the class OnOff"),
    (lambda: iso.simulate(isolated(), MOTION, 1.5), "controller: given 1.5; expected"),
    (
        lambda: (
            iso.simulate(
                isolated(), MOTION, criteria=[iso.Criterion("a_m", "a", lambda run: run.time)]
            ).criteria
        ),
        "criterion a_m of run passive_off: given an array; expected: a number",
    ),
    (lambda: iso.simulate(isolated(), MOTION, None), "controller: given None; expected"),
    (lambda: iso.simulate(isolated(), MOTION, tolerance=1.0), "tolerance: given 1.0; expected"),
    (lambda: iso.simulate(isolated(), MOTION, tolerance="fine"), "tolerance: given 'fine'; exp"),
    (
        lambda: iso.simulate(isolated(), MOTION, current_outside="clip"),
        "current_outside: given 'clip'",
    ),
    (
        lambda: iso.simulate(isolated(), MOTION, computation_delay=-1),
        "computation_delay: given -1 s",
    ),
    (lambda: iso.simulate(isolated(), MOTION, driver=Sensors()), "driver: given a Sensors"),
    (lambda: iso.simulate(isolated(), MOTION, sensors=CoilDriver()), "sensors: given a Coil"),
    (
        lambda: iso.simulate(isolated(), MOTION, nominal=iso.reference_building()),
        "nominal: given a Structure; expected: an IsolatedStructure",
    ),
    (
        lambda: iso.simulate(iso.reference_building().on(iso.law(BRANCH, {"k": 1.0})), MOTION),
        "cannot be traced in force; expected: a comparison as a multiplier",
    ),
    (
        lambda: iso.simulate(iso.reference_building().on(iso.law(LISTED, {"k": 1.0})), MOTION),
        "return [p[0] * x]' cannot be traced in force; expected: one expression",
    ),
    (
        lambda: iso.simulate(on_halved(), MOTION),
        "return (signals.x if signals.x > 0 else signals.x / 2), signals.v' cannot be traced",
    ),
    (
        lambda: iso.simulate(on_powers(), MOTION, "mpc"),
        "law 'powered': no derivative of the force by n at rest, for fits and predictions",
    ),
    (
        lambda: iso.simulate(on_powers(), MOTION, "clairvoyant"),
        "second derivatives of the law are not finite at rest (powered)",
    ),
    (
        lambda: iso.compare(isolated(), MOTION, "on_off"),
        "controllers: given 'on_off'; expected: a list, each text or controller(name)",
    ),
    (lambda: iso.load(3), "path: given 3; expected: text or a path"),
    (lambda: iso.run_scenario(3), "scenario: given 3; expected: a Scenario"),
    (lambda: iso.run_suite(3), "scenario: given 3; expected: a Scenario"),
    (lambda: iso.evaluate(3, "tests"), "law: given 3; expected: a Device"),
    (lambda: iso.sweep([1]), "plan: given [1]; expected: a SweepPlan or a mapping or text or a"),
    (lambda: iso.law(3), "name: given 3; expected: text or a Law"),
    (lambda: iso.controller(3), "name: given 3; expected: text"),
    (lambda: iso.fit("tests", 3), "law: given 3; expected: text or a Law"),
    (lambda: iso.diagnose("tests", 3), "law: given 3; expected: text or a Law"),
    (lambda: iso.Comparison([1]), "runs: given [1]; expected: a mapping"),
    (
        lambda: iso.simulate(isolated(), MOTION).criteria["peak_drift"],
        "unknown criterion 'peak_drift'; did you mean 'peak_drift_m'?",
    ),
    (lambda: iso.compare(isolated(), MOTION, None), "controllers: given None"),
    (lambda: iso.compare(isolated(), MOTION, ["on_off", "on_off"]), "different names"),
    (lambda: iso.compare(isolated(), MOTION, []), "a comparison has no runs"),
    (lambda: iso.Case(isolated(), MOTION, "on_off"), "controller: given 'on_off'; expected: contr"),
    (
        lambda: iso.Case(iso.reference_building(), MOTION, iso.controller("on_off")),
        "isolated: given a Structure",
    ),
    (lambda: iso.simulate_many([isolated()]), "cases[0]: given an IsolatedStructure"),
    (lambda: iso.simulate_many([], threads=0), "threads: given 0; expected: 1 or more"),
    (
        lambda: iso.reference_building().on("bouc_wen"),
        "device: given 'bouc_wen'; expected: a Device, such as law(name)",
    ),
    (lambda: iso.reference_building().on(iso.law("strain_stiffening"), count=0), "force: given 0"),
    (lambda: iso.shear_building([1e5], [1e8], base_mass=0.0), "base_mass[0]: given 0 kg; expected"),
    (lambda: iso.shear_building([1e5], [1e8], base_mass=1.0, damping="none"), "unknown damping"),
    (lambda: iso.from_matrices(1.0, 1.0, 1.0), "mass must be a square matrix"),
    (lambda: iso.from_matrices(np.eye(2), np.eye(2), np.eye(3)), "stiffness has shape (3, 3)"),
    (lambda: iso.read_matrices("none.npz"), "none.npz"),
    (lambda: isolated().periods(99.0), "current 99 A is outside"),
    (lambda: iso.law("bouc_wenn"), "unknown law 'bouc_wenn'; did you mean 'bouc_wen'?"),
    (
        lambda: iso.law("strain_stiffening").scaled(length=-1),
        "length: given -1; expected: a number ab",
    ),
    (lambda: iso.controller("constant", ampers=1.0), "did you mean 'amperes'?"),
    (lambda: iso.fit("none", "bouc_wen"), "none: a folder that does not exist"),
    (lambda: iso.sweep({"vry": []}), "unknown key 'vry'; did you mean 'vary'?"),
    (lambda: iso.load("none"), "none: no saved result"),
    (lambda: iso.register("low", None), "unknown kind 'low'; did you mean 'law'?"),
    (lambda: iso.Comparison({}), "a comparison has no runs"),
    (lambda: read("none.at2"), "none.at2: no such file"),
    (lambda: el_centro_1940().cut(50, 60), "start"),
    (lambda: el_centro_1940().resampled(0.0), "dt (s)"),
    (lambda: Record([0.0, np.nan], 0.01), "nan at sample 1"),
    (lambda: Record([[0.0]], 0.01), "acceleration"),
    (lambda: Record([0.0, 1.0], -0.01), "dt (s): given -0.01"),
    (lambda: CoilDriver(lag=-1.0), "lag"),
    (lambda: Sensors(dropout=2.0), "dropout: given 2.0; expected: 0 or more, below 1"),
]

DEVICE, A_CLASS, A_PATH = iso.law("strain_stiffening"), iso.Device, Path("motion.csv")

# an exported name, one argument of a wrong type, and what the answer says
TYPES = [
    ("Case", {"isolated": DEVICE}, "isolated: given a Device; expected: an IsolatedStructure"),
    ("Case", {"ground": A_PATH}, "ground: given the path 'motion.csv'; expected: a Record"),
    ("CoilDriver", {"lag": "slow"}, "lag: given 'slow'; expected: a number"),
    ("CoilDriver", {"slew": None}, "slew: given None; expected: a number"),
    ("CoilDriver", {"low": "0"}, "low: given '0'; expected: a number or None"),
    ("CoilDriver", {"step": True}, "step: given True; expected: a number"),
    ("Comparison", {"runs": 3}, "runs: given 3; expected: a mapping"),
    ("Comparison", {"fixed_base": "yes"}, "fixed_base: given 'yes'; expected: a Run or None"),
    ("Device", {"law": "bouc_wen"}, "law: given 'bouc_wen'; expected: a Law"),
    ("Device", {"length": "10"}, "length: given '10'; expected: a number"),
    ("DeviceSimulator", {"device": "bouc_wen"}, "device: given 'bouc_wen'; expected: a Device"),
    ("DeviceSimulator", {"period": "fast"}, "period: given 'fast'; expected: a number"),
    ("Record", {"acceleration": "motion.csv"}, "expected: an array of numbers"),
    ("Record", {"acceleration": None}, "acceleration: given None; expected: an array of numbers"),
    ("Record", {"dt": "0.1"}, "dt: given '0.1'; expected: a number"),
    ("Record", {"name": 3}, "name: given 3; expected: text"),
    ("Scenario", {"name": 3}, "name: given 3; expected: text"),
    ("Scenario", {"ground": 3}, "ground: given 3; expected: a table"),
    ("Scenario", {"driver": A_CLASS}, "driver: given <class"),
    ("Sensors", {"noise": 0.1}, "noise: given 0.1; expected: a mapping"),
    ("Sensors", {"seed": 1.5}, "seed: given 1.5; expected: a whole number"),
    ("Sensors", {"delay": "short"}, "delay: given 'short'; expected: a number"),
    ("Simulator", {"isolated": 3}, "isolated: given 3; expected: an IsolatedStructure"),
    ("Simulator", {"ground": "motion.csv"}, "ground: given 'motion.csv'; expected: a Record"),
    ("Simulator", {"period": "1"}, "period: given '1'; expected: a number or None"),
    ("Simulator", {"measures": "current_A"}, "measures: given 'current_A'; expected: a list"),
    ("Suite", {"folder": 3}, "folder: given 3; expected: text or a path"),
    ("Sweep", {"folder": None}, "folder: given None; expected: text or a path"),
    ("SweepPlan", {"vary": 3}, "vary: given 3; expected: a list"),
    ("VectorSimulator", {"n": 1.5}, "n: given 1.5; expected: a whole number"),
    ("available_sets", {"name": 3}, "name: given 3; expected: text"),
    ("available_conditions", {"name": None}, "name: given None; expected: text"),
    ("compare", {"isolated": A_CLASS}, "isolated: given the class Device; expected: an Isolated"),
    ("compare", {"controllers": 3}, "controllers: given 3; expected: a list"),
    ("compare", {"controllers": ["on_off", 3]}, "controllers[1]: given 3; expected: text or contr"),
    ("compare", {"fixed_base": "no"}, "fixed_base: given 'no'; expected: True or False"),
    ("controller", {"name": None}, "name: given None; expected: text"),
    ("diagnose", {"data": 3}, "data: given 3; expected: a Campaign or text or a path"),
    ("diagnose", {"scenario": 3}, "scenario: given 3; expected: a Scenario"),
    ("diagnose", {"seed": "one"}, "seed: given 'one'; expected: a whole number"),
    ("evaluate", {"campaign": None}, "campaign: given None; expected: a Campaign"),
    ("export_results", {"folder": 3}, "folder: given 3; expected: text or a path"),
    ("export_results", {"form": None}, "form: given None; expected: text"),
    ("fit", {"campaign": 3}, "campaign: given 3; expected: a Campaign or text or a path"),
    ("fit", {"fixed": ["n"]}, "fixed: given ['n']; expected: a mapping or None"),
    ("fit", {"starts": 2.5}, "starts: given 2.5; expected: a whole number"),
    ("fit", {"progress": 3}, "progress: given 3; expected: a function or None"),
    ("from_fixed_base", {"mass": "heavy"}, "mass: given 'heavy'; expected: an array of numbers"),
    ("from_matrices", {"mass": None}, "mass: given None; expected: an array of numbers"),
    ("from_matrices", {"stiffness": "M.npy"}, "stiffness: given 'M.npy'; expected: an array"),
    ("from_matrices", {"names": "floor"}, "names: given 'floor'; expected: a list, each text or"),
    ("from_opensees", {"base": "1"}, "base: given '1'; expected: a whole number"),
    ("import_tests", {"tests": 3}, "tests: given 3; expected: text or a path or a list"),
    ("import_tests", {"hold_out": "*1Hz"}, "hold_out: given '*1Hz'; expected: a whole number or"),
    ("json_report", {"comparison": 3}, "comparison: given 3; expected: a Comparison"),
    ("json_report", {"comparison": iso.Comparison}, "given the class Comparison; expected: a Comp"),
    ("law", {"name": DEVICE}, "name: given a Device; expected: text or a Law"),
    ("law", {"parameters": 3}, "parameters: given 3; expected: text or a mapping or None"),
    ("law", {"current_range": 3.0}, "current_range: given 3.0; expected: a list, each a number"),
    ("load", {"path": None}, "path: given None; expected: text or a path"),
    ("loop_curves", {"time": "t"}, "time: given 't'; expected: an array of numbers"),
    ("loop_measures", {"force": ["a"]}, "force: given ['a']; expected: an array of numbers"),
    ("opensees_material", {"device": "bouc_wen"}, "device: given 'bouc_wen'; expected: a Device"),
    ("passive", {"device": 3}, "device: given 3; expected: a Device"),
    ("passive", {"device": A_CLASS}, "device: given the class Device; expected: a Device"),
    ("passive", {"field_lag": "5 ms"}, "field_lag: given '5 ms'; expected: a number"),
    ("read_campaign", {"folder": 3}, "folder: given 3; expected: text or a path"),
    ("read_matrices", {"path": None}, "path: given None; expected: text or a path"),
    ("read_record", {"path": 3}, "path: given 3; expected: text or a path"),
    ("read_record", {"dt": "0.01"}, "dt: given '0.01'; expected: a number or None"),
    ("read_run", {"path": 3}, "path: given 3; expected: text or a path"),
    ("reference_isolators", {"device": "bouc_wen"}, "device: given 'bouc_wen'; expected: a Device"),
    ("run_scenario", {"scenario": DEVICE}, "scenario: given a Device; expected: a Scenario"),
    ("run_suite", {"workers": "two"}, "workers: given 'two'; expected: a whole number or None"),
    ("shear_building", {"masses": 3}, "masses: given 3; expected: a list, each a number"),
    ("shear_building", {"masses": ["3 t"]}, "masses[0]: given '3 t'; expected: a number"),
    ("shear_building", {"base_mass": "3 t"}, "base_mass: given '3 t'; expected: a number"),
    ("simulate", {"isolated": A_PATH}, "isolated: given the path 'motion.csv'; expected"),
    ("simulate", {"ground": A_CLASS}, "ground: given the class Device; expected: a Record"),
    ("simulate", {"driver": 3}, "driver: given 3; expected: a CoilDriver or None"),
    ("simulate", {"sensors": "good"}, "sensors: given 'good'; expected: a Sensors or None"),
    ("simulate_many", {"cases": 3}, "cases: given 3; expected: a list, each a Case"),
    ("sweep", {"plan": 3}, "plan: given 3; expected: a SweepPlan"),
    ("sweep", {"out": 3}, "out: given 3; expected: text or a path or None"),
    ("tune", {"name": 3}, "name: given 3; expected: a name, a place such as my_controllers.py"),
    ("tune", {"evaluations": "many"}, "evaluations: given 'many'; expected: a whole number"),
    ("write_run", {"run": 3}, "run: given 3; expected: a Run"),
    ("write_run", {"path": 3}, "path: given 3; expected: text or a path"),
]

API = runpy.run_path(str(Path(__file__).resolve().parents[1] / "docs/_ext/api_pages.py"))
OFFERED = {
    value: f"{module}.{name}"
    for module in API["PACKAGES"]
    for name in API["offered"](import_module(module))
    for value in [getattr(import_module(module), name)]
    if isfunction(value)
}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("given")
    eye = np.eye(2)
    (folder / "motion.csv").write_text(CSV)
    (folder / "empty.csv").write_text("")
    (folder / "text.csv").write_text("time_s,ground_acceleration_m_s2\n0,a\n1,b\n")
    (folder / "motion.txt").write_text("0.1\n0.2\n")
    (folder / "motion.xyz").write_text("0.1\n0.2\n")
    (folder / "loops.svg").write_text("mine")
    (folder / "short.at2").write_text("PEER\n")
    (folder / "plan.toml").write_text(VARY + "values = [1.0]\n")
    (folder / "own.py").write_text(
        "from isolation_sim.laws.law import Law, Quantity\n\n"
        "NUMBER = 3\n\n\n"
        "def force(x, v, states, parameters):\n    if x > abs(x) / 2:\n"
        "        return parameters[0] * x\n"
        "    return 0.0\n\n\n"
        "BRANCH = Law('branch', 'Branch', (Quantity('k', 'N/m', 'stiffness'),), force)\n"
        "def unknown(x, v, s, p):\n    return p[0] * abs(y)\n"
        "UNKNOWN = Law('unknown', 'Unknown', (Quantity('k', 'N/m', 'stiffness'),), unknown)\n"
        "def whole(x, v, s, p):\n    return p[0] * (x + p)\n"
        "WHOLE = Law('whole', 'Whole', (Quantity('k', 'N/m', 'stiffness'),), whole)\n"
    )
    np.savez(folder / "lacking.npz", M=eye, C=eye)
    np.savez(folder / "uneven.npz", M=eye, C=np.ones((2, 3)), K=eye)
    np.savez(folder / "massless.npz", M=0 * eye, C=eye, K=eye)
    return folder


@pytest.fixture
def answer(files, monkeypatch, capsys):
    """Run a command in the folder; return its one line of answer."""

    def run(*arguments):
        monkeypatch.chdir(files)
        before = {path: path.read_bytes() for path in files.rglob("*") if path.is_file()}
        with pytest.raises(SystemExit) as ended:
            main([str(each) for each in arguments])
        captured = capsys.readouterr()
        assert ended.value.code == 2, captured.err
        assert captured.out == ""
        assert captured.err.startswith("isolation-sim: ") and captured.err.count("\n") == 1
        after = {path: path.read_bytes() for path in files.rglob("*") if path.is_file()}
        assert after == before
        return captured.err

    return run


@pytest.mark.parametrize(("text", "message"), SCENARIOS)
def test_a_scenario(answer, files, text, message):
    (files / "job.toml").write_text(text)
    line = answer("run", "job.toml", "--no-figures")
    assert line.startswith("isolation-sim: job.toml: ") and message in line


@pytest.mark.parametrize(("text", "message"), PLANS)
def test_a_plan(answer, files, text, message):
    (files / "varied.toml").write_text(text)
    line = answer("sweep", "varied.toml", "--workers", "1")
    assert line.startswith("isolation-sim: varied.toml: ") and message in line


@pytest.mark.parametrize(("command", "message"), COMMANDS)
def test_a_command(answer, command, message):
    assert message in answer(*command.split())


@pytest.mark.parametrize(("call", "message"), CALLS, ids=range(len(CALLS)))
def test_a_call(tmp_path, monkeypatch, call, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as caught:
        call()
    assert message in str(caught.value) and "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("name", "argument", "message"), TYPES)
def test_a_type(name, argument, message):
    with pytest.raises(InputError) as caught:
        getattr(iso, name)(**argument)
    assert message in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("function", OFFERED, ids=OFFERED.values())
def test_every_argument_of_every_exported_function(function):
    for argument in signature(function).parameters.values():
        # a value of any type is what these two take; what follows stars has no type of its own
        if argument.kind in (argument.VAR_POSITIONAL, argument.VAR_KEYWORD) or argument.name in (
            "thing", "default", "opensees",
        ):  # fmt: skip
            continue
        with pytest.raises(InputError, match=f"^{argument.name}: given an object; expected: "):
            function(**{argument.name: object()})


def test_the_list_is_long_enough():
    assert sum(map(len, (SCENARIOS, PLANS, COMMANDS, CALLS, TYPES))) >= 300
