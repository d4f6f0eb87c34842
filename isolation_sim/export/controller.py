"""A controller in C99: decision, observer and current map, from the text that Numba compiles."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ground_motions.python_source import parse

from ..errors import InputError, check_name
from ..simulation.control import CoilDriver, CompiledDecision, RunContext, Sensors
from ..simulation.run import prepare_lane, simulate
from .c_text import CText
from .part import numbers

if TYPE_CHECKING:
    from ..scenario.job import Job


@dataclass(frozen=True)
class ExportedDecision:
    """A controller's compiled decision in a scenario, and its run context."""

    name: str  # Of the controller, as an identifier of C
    title: str  # Short description for comments
    compiled: CompiledDecision  # Constants, and memory at the start
    text: str  # Source of the compiled module
    context: RunContext  # With the measured outputs, the period and the limits of the currents

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs: measurements, then further known values."""
        return (*self.context.outputs, *self.compiled.inputs)

    @property
    def entry(self) -> str:
        """Function of the module that decides."""
        functions = [n for n in parse(self.text).body if isinstance(n, ast.FunctionDef)]
        call = functions[-1].body[-1]
        assert isinstance(call, ast.Expr) and isinstance(call.value, ast.Call)
        return ast.unparse(call.value.func)


def prepare_decision(job: Job, label: str) -> ExportedDecision:
    """Prepare a scenario's controller as for a run."""
    check_name("controller of the scenario", label, job.controllers)
    controller, options = job.controllers[label], dict(job.options)
    sensors = options.get("sensors") or Sensors()
    lane = prepare_lane(
        job.isolated, job.records, controller, options.get("nominal"),
        options.get("driver") or CoilDriver(),
        (sensors.delay, options.get("computation_delay", 0.0)),
        partial(simulate, job.isolated, job.records, **options),
    )  # fmt: skip
    if lane.schedule is not None:
        raise InputError(
            f"{label} is an open loop, whose currents are known before; expected: a controller "
            "that decides by what it measures"
        )
    compiled = lane.compiled or controller.compiled(lane.context)
    if compiled is None or compiled.text is None:
        raise InputError(
            f"{label} has no compiled decision to write out; expected: a "
            "controllers.compiled.CompiledController, such as on_off or clipped_lqg"
        )
    name = re.sub(r"\W", "_", label)
    name = f"_{name}" if name[0].isdigit() else name
    title = f"{getattr(controller, 'title', '') or label}, {job.isolated.structure.name}"
    return ExportedDecision(name, title, compiled, compiled.text(), lane.context)


def controller_files(job: Job, label: str) -> dict[str, str]:
    """Write a scenario's controller as C99."""
    return decision_files(prepare_decision(job, label))


def decision_files(result: ExportedDecision) -> dict[str, str]:
    """Write a decision as C99: header, source, and a program that steps it."""
    return {
        f"{result.name}.h": _header(result),
        f"{result.name}.c": _source(result),
        f"{result.name}_run.c": RUN.replace("NAME", result.name),
    }


def _header(result: ExportedDecision) -> str:
    name, context = result.name, result.context
    low, high = context.low, context.high
    n_outputs, n_coils = len(result.inputs), len(low)
    measured = [f" *   measured[{k}]: {output}" for k, output in enumerate(result.inputs)]
    commands = [
        f" *   command[{c}]: current of coil {c}, A, {low[c]:g} to {high[c]:g}"
        for c in range(n_coils)
    ]
    return "\n".join([
        f"/* {result.title}. Written by isolation-sim; do not edit.",
        " *",
        f" * Call {name}_init once, then {name}_step every {context.period:g} s, with the time",
        " * in s from the first call, and:",
        " *",
        *measured,
        *commands,
        " *",
        " * No memory is allocated. All memory is in the state of the caller. */",
        f"#ifndef {name.upper()}_H",
        f"#define {name.upper()}_H",
        "",
        f"#define {name}_PERIOD {context.period!r}",
        f"#define {name}_N_MEASURED {n_outputs}",
        f"#define {name}_N_COMMANDS {n_coils}",
        "",
        f"typedef struct {{ double memory[{max(len(result.compiled.memory), 1)}]; }} {name}_state;",
        "",
        f"void {name}_init({name}_state *state);",
        f"void {name}_step({name}_state *state, double t, const double *measured, "
        "double *command);",
        "",
        "#endif",
        "",
    ])  # fmt: skip


def _source(result: ExportedDecision) -> str:
    name, compiled, context = result.name, result.compiled, result.context
    module = CText(result.text, name)
    decide, _ = module.function(result.entry, ["d", "a", "a", "a", "a"])
    n_settings, n_memory, n_coils = len(compiled.settings), len(compiled.memory), len(context.low)
    arrays = {"SETTINGS": compiled.settings, "AT_REST": compiled.memory,
              "LOW": context.low, "HIGH": context.high}  # fmt: skip
    # C fills the rest with zeros
    constants = [
        f"static const double {key}[{max(len(values), 1)}] = {{\n"
        f"    {numbers(np.trim_zeros(values, 'b'))}\n}};"
        for key, values in arrays.items()
    ]
    return "\n".join([
        f"/* {result.title}. Written by isolation-sim; do not edit. */",
        f'#include "{name}.h"',
        "",
        "#include <math.h>",
        "",
        module.definitions(),
        *constants,
        "",
        f"void {name}_init({name}_state *state)",
        "{",
        f"    for (int k = 0; k < {max(n_memory, 1)}; ++k)",
        "        state->memory[k] = AT_REST[k];",
        "}",
        "",
        "/* Settings and measurements are read only: the casts are for a type that serves all. */",
        f"void {name}_step({name}_state *state, double t, const double *measured, double *command)",
        "{",
        f"    array seen = {{0, {len(result.inputs)}}}, settings = {{0, {n_settings}}};",
        f"    array memory = {{0, {n_memory}}}, wanted = {{0, {n_coils}}};",
        "    seen.p = (double *)measured;",
        "    settings.p = (double *)SETTINGS;",
        "    memory.p = state->memory;",
        "    wanted.p = command;",
        f"    {decide}(t, seen, settings, memory, wanted);",
        f"    for (int c = 0; c < {n_coils}; ++c) {{",
        "        /* also of a value that is not a number */",
        "        if (!(command[c] >= LOW[c]))",
        "            command[c] = LOW[c];",
        "        else if (command[c] > HIGH[c])",
        "            command[c] = HIGH[c];",
        "    }",
        "}",
        "",
    ])  # fmt: skip


RUN = """\
/* Read the time (s) and the measurements of one step a line, write its commands (A), and say on
 * standard error how long a step takes at most: the mean of REPEATS, at the worst line. */
#include <stdio.h>
#include <time.h>

#include "NAME.h"

#ifndef REPEATS
#define REPEATS 100
#endif

int main(void)
{
    NAME_state state, trial;
    double t, measured[NAME_N_MEASURED], command[NAME_N_COMMANDS], worst = 0.0;
    long steps = 0;

    NAME_init(&state);
    while (scanf("%lf", &t) == 1) {
        clock_t begun;
        double took;
        for (int k = 0; k < NAME_N_MEASURED; ++k)
            if (scanf("%lf", &measured[k]) != 1)
                return 2;
        begun = clock();
        for (int k = 0; k < REPEATS; ++k) {
            trial = state;
            NAME_step(&trial, t, measured, command);
        }
        took = (double)(clock() - begun) / CLOCKS_PER_SEC / REPEATS;
        worst = took > worst ? took : worst;
        state = trial;
        for (int c = 0; c < NAME_N_COMMANDS; ++c)
            printf("%.17g%c", command[c], c + 1 < NAME_N_COMMANDS ? ' ' : '\\n');
        ++steps;
    }
    fprintf(stderr, "%ld steps, at most %.3g us a step\\n", steps, 1e6 * worst);
    return 0;
}
"""
