"""The isolators in C99 with prescribed motion: their law, as in fits and hybrid tests."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..identification.kernel.device_arguments import Workspace
from ..identification.kernel.device_kernel_text import compiled
from ..laws.law import Law, Quantity
from .c_text import CText
from .part import Part, numbers

if TYPE_CHECKING:
    from ..scenario.job import Job

FOLDER = Path(__file__).parent


def device_part(job: Job) -> Part:
    """Write a scenario's isolators as C99, with the work done on them."""
    element = job.isolated.elements[0]
    if element.device.law.directions != 1:
        raise InputError(
            f"{element.name} acts in {element.device.law.directions} directions; expected in a "
            "unit of the device: one"
        )
    device, law = element.device, with_work(element.device.law)
    text = Path(str(compiled(law).__file__)).read_text()
    groups = {Workspace.__name__: Workspace._fields}
    module = CText(text, "law", {"step_with_slopes": ("v", "")}, groups)
    kinds = ["d"] * 6 + ["a"] * 5 + ["d3", "d2"]
    follow, _ = module.function("follow", kinds)
    coefficients = np.asarray(device.current.coefficients, float)
    n_pieces, n_parameters, n_powers = coefficients.shape
    low, high = (numbers(np.array([limit])) for limit in device.current_range)
    filled = {
        "TITLE": f"{element.name}, {law.title}",
        "N_STATES": len(law.states),
        "N_PARAMETERS": n_parameters,
        "N_PIECES": n_pieces,
        "N_POWERS": n_powers,
        "N_BREAKS": n_pieces + 1,
        "LENGTH": repr(float(device.length)),
        "FORCE": repr(float(device.force_scale)),
        "LOW": low,
        "HIGH": high,
        "BREAKS": numbers(np.asarray(device.current.breaks, float)),
        "COEFFICIENTS": _nested(coefficients),
        "TOLERANCE": repr(float(job.options.get("tolerance", 1e-6))),
        "FOLLOW": follow,
        "FUNCTIONS": module.definitions(),
    }
    files = {
        f"device.{end}": Template((FOLDER / f"device.{end}").read_text()).substitute(filled)
        for end in "hc"
    }
    inputs = ("displacement_m", "velocity_m_s", "current_A")
    outputs = ("force_N", "absorbed_energy_J")
    return Part("device", filled["TITLE"], files, inputs, outputs, float(job.records[0].dt))


def with_work(law: Law) -> Law:
    """A law with one more state: the work done on the device, J."""
    n = len(law.states)

    def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
        return law.force(x, v, tuple(states)[:n], parameters)

    def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
        own = tuple(states)[:n]
        return (*law.rates(x, v, own, parameters), law.force(x, v, own, parameters) * v)

    def rest(parameters: tuple) -> tuple:
        return (*((0.0,) * n if law.rest is None else law.rest(parameters)), 0.0)

    work = Quantity("work", "J", "work done on the device")
    return replace(law, states=(*law.states, work), force=force, rates=rates, rest=rest)


def _nested(values: np.ndarray) -> str:
    """An array as C text, one brace per axis."""
    if values.ndim == 1:
        return f"{{{numbers(values)}}}"
    return f"{{{', '.join(map(_nested, values))}}}"
