"""A plant in C99: building, isolators and coil drivers, from the source that Numba compiles."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..simulation.control import CoilDriver, Sensors
from ..simulation.kernel.arguments import Step
from ..simulation.kernel.loading import Shape
from ..simulation.kernel.slots import ALIVE, BUFFER_FULL, COMMAND, DN0, F0, FREE0, OPERATIONS
from ..simulation.plan import Plan
from ..simulation.run import NoControl, prepare_lane
from ..simulation.simulator import still_ground
from .c_text import CText, Fields, Kind, array_kind
from .part import Part, numbers

if TYPE_CHECKING:
    from ..scenario.job import Job

FOLDER = Path(__file__).parent
GROUPS = ("position", "sizes", "limits", "time_grid", "propagation", "measurements", "coils", "law",
          "lanes", "history", "scratch")  # fmt: skip
"""The compiled integration's arguments; see ``simulation/kernel/arguments.py``."""
CONSTANT = {
    "time_grid_segments", "time_grid_events", "propagation_offsets", "propagation_modes",
    "measurements_rows", "measurements_noise", "measurements_decided", "measurements_measured_for",
    "coils_driver", "limits_deformation", "law_table", "law_breaks", "law_shape", "law_channel",
    "law_functions", "law_numbers", "observed_rows",
}  # fmt: skip
"""Read-only arrays."""
EMPTY = {
    "history_z", "history_states", "history_forces", "history_steps", "propagation_table",
    "propagation_phi", "propagation_integral", "scratch_u",
}  # fmt: skip
"""Arrays that are zero at the start."""
ELEMENTS = {"f": "d", "i": "i", "c": "z"}


class Array(NamedTuple):
    """An array of the compiled integration, in the state or among the constants."""

    name: str
    values: NDArray

    @property
    def kind(self) -> Kind:
        """Its kind in the C text."""
        return array_kind(ELEMENTS[self.values.dtype.kind], self.values.ndim)

    @property
    def declared(self) -> str:
        """Its declaration: a complex number is two, as C99 stores it."""
        size = self.values.size * (2 if self.values.dtype.kind == "c" else 1)
        return f"{'long' if self.values.dtype.kind == 'i' else 'double'} {self.name}[{size or 1}]"

    @property
    def defined(self) -> str:
        """Its definition as a constant."""
        flat = np.ascontiguousarray(self.values).ravel()
        flat = flat.view(float) if flat.dtype.kind == "c" else flat
        return f"static const {self.declared} = {{\n    {numbers(flat)}\n}};"

    @property
    def passed(self) -> str:
        """Initialiser of the struct that functions take."""
        number = {"f": "double", "i": "long", "c": "double complex"}[self.values.dtype.kind]
        place = self.name if self.name in CONSTANT else f"it->{self.name}"
        sizes = ", ".join(map(str, self.values.shape))
        sizes = sizes if self.kind == "a" else f"{{{sizes}}}"
        return f"{{({number} *){place}, {sizes}}}"


_NAMES = re.compile(rf"\b(element|respond|kinks|{'|'.join(OPERATIONS)})\(")
"""Functions of a law, whose names are the same for every law."""
CHANGED = ("coils", "law")
"""Groups of arguments of ``update_current`` after the element and the grid point."""
OBSERVED = ("observed_rows", "noise", "ground", "history_z", "0", "coils_current", "scratch_w")
"""Arguments of ``read_sensors`` between the sizes and the result."""
WRITE = """\
static void write(array a, long at, long k, double value, int on)
{
    if (on)
        a.p[at + k] = value;
}"""
ADD_ROWS = """\
/* w[to + r] += sum over k of table[at + 8 k + r] x[x_at + k stride], for eight rows r */
static void add_rows(array w, long to, array table, long at, array x, long x_at, long stride,
                     long n)
{
    for (long k = 0; k < n; ++k)
        for (long r = 0; r < 8; ++r)
            w.p[to + r] += table.p[at + 8 * k + r] * x.p[x_at + k * stride];
}"""
ELEMENT = """\
static void element(array_i1 functions, long operation, long e, array w, double a, double b,
                    array numbers, long at, array_i1 mask)"""
OTHERS = """\
/* eight rows of element e: its free response, and that to the other elements' forces */
static void respond_to_others(long e, long n_elements, array w, array table, long force_rows)
{
    double *const to = w.p + e * $STRIDE + $TO;
    memcpy(to, w.p + e * $STRIDE + $FREE, 8 * sizeof *to);
    for (long k = 1; k < n_elements; ++k) {
        const long other = (e + k) % n_elements;
        const double *const rows = table.p + force_rows + 24 * (e * n_elements + other);
        const double *const force = w.p + other * $STRIDE + $FORCE;
        for (long r = 0; r < 8; ++r)
            to[r] += rows[r] * force[0] + rows[8 + r] * force[1] + rows[16 + r] * force[2];
    }
}"""
FREE_ROWS = """\
/* response to the modes and to the ground alone */
static void free_rows(array w, long to, array table, long at, long ground_at, array z, long z_at,
                      long n_modes, long n_pad, array u, long n_points, long n)
{
    memset(w.p + to, 0, 8 * sizeof *w.p);
    add_rows(w, to, table, at, z, z_at, 1, n_modes);
    add_rows(w, to, table, at + 8 * n_modes, z, z_at + n_pad, 1, n_modes);
    for (long g = 0; g < n; ++g)
        add_rows(w, to, table, ground_at + 8 * g * n_points, u, g, n, n_points);
}"""
MOVE_MODES = """\
/* modes at the end of a step: decayed, pushed by the ground and by the forces at the nodes */
static void move_modes(long n_pad, array table, long decay, long ground, long force, array z,
                       long start, long to, array u, long u_at, array w, array_i1 mask,
                       long n_e, long n_g)
{
    const double *const e = table.p + decay;
    (void)mask;
    for (long m = 0; m < n_pad; ++m) {
        const double re = z.p[start + m], im = z.p[start + n_pad + m];
        double sum[2] = {e[m] * re - e[n_pad + m] * im, e[m] * im + e[n_pad + m] * re};
        for (long k = 0; k < 2 * n_g; ++k) {
            const double *const push = table.p + ground + 2 * k * n_pad;
            /* the table has a direction's both ends, the grid a point's directions together */
            const double given = u.p[u_at + k % 2 * n_g + k / 2];
            sum[0] += push[m] * given;
            sum[1] += push[n_pad + m] * given;
        }
        for (long k = 0; k < 3 * n_e; ++k) {
            const double *const push = table.p + force + 2 * k * n_pad;
            const double given = w.p[k / 3 * $STRIDE + $FORCE + k % 3];
            sum[0] += push[m] * given;
            sum[1] += push[n_pad + m] * given;
        }
        z.p[to + m] = sum[0];
        z.p[to + n_pad + m] = sum[1];
    }
}"""


def plant_part(job: Job) -> Part:
    """Write a scenario's building with isolators and coil drivers as C99."""
    isolated, options, period = job.isolated, job.options, float(job.records[0].dt)
    still = still_ground(isolated, period, period, None)
    driver = options.get("driver") or CoilDriver()
    lane = prepare_lane(isolated, still, NoControl(), None, driver, (0.0, 0.0), None)
    plan = Plan([lane], Sensors(), 0.0, alike=True)
    work = plan.workspace(options.get("tolerance", 1e-6), clamp=True, record_steps=False)
    kernel, shape, names = plan.kernel, plan.kernel.shape, plan.outputs[0].names
    shown = [k for k, name in enumerate(names) if not name.startswith("ground_")]
    grounds = [name for name in names if name.startswith("ground_")]
    coils = range(len(work.driver) - 1)  # the last channel is that of elements without a coil
    title = f"{isolated.structure.name}, isolated"
    inputs = (
        *grounds,
        *(name.replace("_m_s2", "_rate_m_s3") for name in grounds),
        *(f"coil{c}_command_A" for c in coils),
    )
    outputs = (*(names[k] for k in shown), *(f"coil{c}_current_A" for c in coils))

    distinct = list(filter(None, dict.fromkeys(kernel.laws)))
    modules = [kernel.tables, kernel.integration, *distinct]
    tables, integration, *written = (Path(str(m.__file__)).read_text() for m in modules)
    own_laws = [_NAMES.sub(rf"law{k}_\1(", text) for k, text in enumerate(written)]
    text = "".join([tables, integration, *own_laws])
    module = CText(text, "engine", _intrinsics(shape), {"Step": Step._fields})
    arguments = dict(zip(GROUPS, work.arguments, strict=True))
    numbers_of_laws = [0 if law is None else 1 + distinct.index(law) for law in kernel.laws]
    arguments["law"] = arguments["law"]._replace(functions=np.array(numbers_of_laws))
    groups = {name: _group(module, name, value) for name, value in arguments.items()}
    own_kinds = ["i", "a", "i", "d", "d", "a", "i", "i1"]
    cases = [
        f"    case {k + 1}: {module.function(f'law{k}_element', own_kinds)[0]}"
        f"(operation, w, {shape.stride} * e, a, b, numbers, at, mask); break;"
        for k in range(len(distinct))
    ]
    element = "\n".join([ELEMENT, "{", "    switch (functions.p[e]) {", *cases, "    }", "}"])
    arrays = {array.name: array for _, _, own in groups.values() for array in own}
    rows = Array("observed_rows", plan.outputs[0].rows[shown][:, :, None])
    arrays[rows.name] = rows
    observe = [arrays.get(name, name) for name in OBSERVED]
    integrate, _ = module.function("integrate", [kind for kind, _, _ in groups.values()])
    own = [arrays["lanes_going"], arrays["scratch_w"]]
    changed, _ = module.function(
        "update_current", ["i", "i", *(groups[name][0] for name in CHANGED), *map(_kind, own)]
    )
    change = [f"({module.type_of(groups[name][0])}){groups[name][1]}" for name in CHANGED]
    seen, _ = module.function("read_sensors", ["i"] * 8 + [*map(_kind, observe), "d3"])

    state = [array for name, array in arrays.items() if name not in CONSTANT]
    started = [a for a in state if a.name not in EMPTY and a.values.any()]
    constants = [array for name, array in arrays.items() if name in CONSTANT]
    constants += [a._replace(name=f"start_{a.name}") for a in started]
    filled = {
        "TITLE": title,
        "PERIOD": repr(period),
        "N_INPUTS": len(inputs),
        "N_OUTPUTS": len(outputs),
        "N_SHOWN": len(shown),
        "N_GROUND": shape.n_ground,
        "N_CHANNELS": len(work.driver),
        "N_ELEMENTS": shape.n_elements,
        "N_STATES": shape.n_elements * work.sizes.n_states,
        "N_MODES": work.sizes.n_modes,
        "N_PAD": work.sizes.n_pad,
        "N_ROW": 2 * work.sizes.n_pad,
        "COMMAND": COMMAND,
        "BUFFER_FULL": BUFFER_FULL,
        "ALIVE": ALIVE,
        "MEMBERS": "\n".join(f"    {array.declared};" for array in state),
        "STARTED": "\n".join(
            f"    memcpy(it->{a.name}, start_{a.name}, sizeof it->{a.name});" for a in started
        ),
        "GROUPS": "\n".join(
            f"    {module.type_of(kind)} {name} = {text};"
            for name, (kind, text, _) in groups.items()
        ),
        "ARGUMENTS": ", ".join(GROUPS),
        "INTEGRATE": integrate,
        "CHANGE": changed,
        "CHANGED": ",\n            ".join([*change, _literals(module, own)]),
        "OBSERVE": seen,
        "OBSERVED": _literals(module, observe),
        "FUNCTIONS": f"{module.definitions()}\n{element}",
        "CONSTANTS": "\n".join(array.defined for array in constants),
    }
    files = {
        f"plant.{end}": Template((FOLDER / f"plant.{end}").read_text()).substitute(filled)
        for end in "hc"
    }
    return Part("plant", title, files, inputs, outputs, period)


def _intrinsics(shape: Shape) -> dict[str, tuple[Kind, str]]:
    """The kernel's LLVM functions in C, for one lane; it calls no controller."""
    sizes = {"STRIDE": shape.stride, "TO": DN0, "FREE": FREE0, "FORCE": F0}
    return {
        "read": ("d", "static double read(array a, long at, long k) { return a.p[at + k]; }"),
        "write": ("v", WRITE),
        "element": ("v", f"{ELEMENT};"),
        "fused": ("d", "static double fused(double a, double b, double c) { return a * b + c; }"),
        "respond_to_others": ("v", Template(OTHERS).substitute(sizes)),
        "free_rows": ("v", f"{ADD_ROWS}\n{FREE_ROWS}"),
        "move_modes": ("v", Template(MOVE_MODES).substitute(sizes)),
        "call_controllers": ("v", ""),
    }


def _group(module: CText, name: str, value: Any) -> tuple[Kind, str, list[Array]]:
    """Kind of an argument, C initialiser of its struct, and the arrays in it."""
    if isinstance(value, np.ndarray):
        array = Array(name, value)
        return array.kind, array.passed, [array]
    if isinstance(value, float):
        return "d", repr(value), []
    if not isinstance(value, tuple):
        return "i", str(int(value)), []
    fields = getattr(value, "_fields", range(len(value)))
    parts = [_group(module, f"{name}_{f}", v) for f, v in zip(fields, value, strict=True)]
    kind = tuple(part[0] for part in parts)
    if hasattr(value, "_fields"):
        kind = Fields(value._fields, kind)
    arrays = [array for part in parts for array in part[2]]
    return kind, f"{{{', '.join(part[1] for part in parts)}}}", arrays


def _kind(argument: Array | str) -> Kind:
    own = {"noise": "d3", "ground": "a"}
    return argument.kind if isinstance(argument, Array) else own.get(argument, "i")


def _literals(module: CText, arguments: Sequence[Array | str]) -> str:
    """Arguments of a call, a line each."""
    return ",\n        ".join(
        f"({module.type_of(a.kind)}){a.passed}" if isinstance(a, Array) else a for a in arguments
    )
