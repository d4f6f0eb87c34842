"""The devices that a decision reasons with, in plain Python and as text for compiled decisions.

A decision computes with flat arrays, one device after another: their numbers, deformations,
velocities and internal states. The text depends on the laws alone, not on their numbers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from isolation_sim.laws import Device
from isolation_sim.laws.law import Law

from .enclosure import (
    OPERATIONS,
    Range,
    fixed_range,
    force_range_statements,
    polynomial_range,
    scaled_range,
)

# a device's numbers: which law, scales, sizes of the current dependence, its breaks and
# coefficients
LAW, LENGTH, FORCE_SCALE, N_PIECES, N_PARAMETERS, N_POWERS, N_STATES, BREAKS = range(8)


def first_coefficient(row: NDArray, current: float) -> int:
    """Place of the coefficients that hold at a current."""
    n_pieces = int(row[N_PIECES])
    piece = 0
    while piece < n_pieces - 1 and current >= row[BREAKS + piece]:
        piece += 1
    return BREAKS + n_pieces - 1 + piece * int(row[N_PARAMETERS] * row[N_POWERS])


def polynomial(row: NDArray, at: int, n_powers: int, current: float) -> float:
    """Value of a parameter at a current."""
    value = row[at + n_powers - 1]
    for power in range(n_powers - 2, -1, -1):
        value = value * current + row[at + power]
    return value


def next_break(current: float, arguments: tuple) -> float:
    """Lowest current above a current at which other coefficients begin to hold."""
    weights, _, _, _, numbers = arguments
    n_numbers, lowest = len(numbers) // len(weights), np.inf
    for e in range(len(weights)):
        if weights[e] != 0.0:
            row = numbers[e * n_numbers : (e + 1) * n_numbers]
            for k in range(int(row[N_PIECES]) - 1):
                if row[BREAKS + k] > current:
                    lowest = min(lowest, row[BREAKS + k])
                    break
    return lowest


_ARRAY = "float64[::1]"
_COMBINED = f"UniTuple({_ARRAY}, 5)"


class DeviceModel:
    """Devices in the form in which decisions compute with them."""

    # Signatures of the methods in compiled code
    signatures: ClassVar[dict[str, str]] = {
        "combined_force": f"float64(float64, {_COMBINED})",
        "combined_range": f"UniTuple(float64, 4)(float64, float64, {_COMBINED})",
        "state_rates": f"void(int64, float64, float64, {_ARRAY}, float64, {_ARRAY}, {_ARRAY})",
    }

    def __init__(self, devices: Sequence[Device]):
        self.devices = tuple(devices)
        # each law once
        self.laws = tuple(dict.fromkeys(device.law for device in self.devices))
        # places for internal states and for numbers that each device has: the most of any of them
        self.n_states = max((len(law.states) for law in self.laws), default=0)
        rows = [self._row(device) for device in self.devices]
        self.n_numbers = max(map(len, rows), default=0)
        padded = [[*row, *[0.0] * (self.n_numbers - len(row))] for row in rows]
        self.numbers = np.array(padded, dtype=float).ravel()

    def _row(self, device: Device) -> list[float]:
        dependence = device.current
        return [
            self.laws.index(device.law), device.length, device.force_scale,
            *dependence.coefficients.shape, len(device.law.states),
            *dependence.breaks[1:-1], *dependence.coefficients.ravel(),
        ]  # fmt: skip

    @staticmethod
    def text(laws: Sequence[Law]) -> str:
        """Source of the functions, for some laws."""
        from isolation_sim.laws.emit import function_text

        parts = []
        for tag, law in enumerate(laws):
            start = loaded(law)
            statements, (force,) = traced(law, lambda *a, law=law: (law.force(*a),))
            body = [*start, *statements, f"return row[{FORCE_SCALE}] * {force}"]
            parts.append(
                function_text(f"force_{tag}", "x, v, states, current, row", body, "@plain")
            )
            statements, rates = traced(law, law.rates)
            body = [*start, *statements, *(f"out[{k}] = {rate}" for k, rate in enumerate(rates))]
            parts.append(
                function_text(f"rates_{tag}", "x, v, states, current, row, out", body, "@plain")
            )
        body = [
            *each_weighted("0.0"),
            *by_law(laws, " " * 8, "value = force_{}(x[e], v[e], own, current, row)"),
            "        total += weights[e] * value",
            "return total",
        ]
        parts.append(function_text("combined_force", "current, arguments", body, "@plain"))
        body = by_law(laws, "", "rates_{}(x, v, states, current, row, out)")
        parts.append(
            function_text("state_rates", "e, x, v, states, current, row, out", body, "@plain")
        )
        return "\n\n".join(parts)

    def combined_force(self, current: float, arguments: tuple) -> float:
        """Weighted sum of the devices' forces at one current."""
        return float(_in_python(self.laws)["combined_force"](current, arguments))

    @staticmethod
    def range_text(laws: Sequence[Law]) -> str:
        """Source of ``combined_range``, for some laws."""
        from isolation_sim.laws.emit import function_text

        parts = []
        for tag, law in enumerate(laws):
            statements, force = force_range_statements(law)
            body = [*statements, f"return scaled_range({force}, row[{FORCE_SCALE}])"]
            used = set(re.findall(r"\w+", " ".join(body)))
            call = "polynomial_range(row, at + {} * powers, powers, low, high)"
            start = loaded(law, "low", call)
            body = [s for s in start if s[0] != "p" or s.split(" = ")[0] in used] + body
            parts.append(
                function_text(f"range_{tag}", "x, v, states, low, high, row", body, "@plain")
            )
        body = [
            *each_weighted("fixed_range(0.0)"),
            *by_law(laws, " " * 8, "value = range_{}(x[e], v[e], own, low, high, row)"),
            "        total = sum_range(total, scaled_range(value, weights[e]))",
            "return total",
        ]
        parts.append(function_text("combined_range", "low, high, arguments", body, "@plain"))
        return "\n\n".join(parts)

    def combined_range(self, low: float, high: float, arguments: tuple) -> Range:
        """Bounds on the weighted sum of the devices' forces over an interval of the current."""
        bounds: Range = _in_python(self.laws)["combined_range"](low, high, arguments)
        return bounds

    def state_rates(
        self, e: int, x: float, v: float, states: NDArray, current: float, row: NDArray,
        out: NDArray,
    ) -> None:  # fmt: skip
        """Time derivatives of a device's internal states."""
        _in_python(self.laws)["state_rates"](e, x, v, states, current, row, out)


def loaded(
    law: Law, current: str = "current",
    parameter: str = "polynomial(row, at + {} * powers, powers, current)",
) -> list[str]:  # fmt: skip
    """Statements that bring a law's inputs into its own scale and under the names of ``traced``."""
    return [
        f"at, powers = first_coefficient(row, {current}), int(row[{N_POWERS}])",
        *(f"p{k} = {parameter.format(k)}" for k in range(len(law.parameters))),
        *(f"s{k} = states[{k}]" for k in range(len(law.states))),
        f"x = x / row[{LENGTH}]",
        f"v = v / row[{LENGTH}]",
    ]


def each_weighted(zero: str) -> list[str]:
    """Statements that begin the sum over the devices whose weight is not 0."""
    return [
        "weights, x, v, states, numbers = arguments",
        "n_states, n_numbers = len(states) // len(weights), len(numbers) // len(weights)",
        f"total = {zero}",
        "for e in range(len(weights)):",
        "    if weights[e] != 0.0:",
        f"        row, value = numbers[e * n_numbers : (e + 1) * n_numbers], {zero}",
        "        own = states[e * n_states : (e + 1) * n_states]",
    ]


def by_law(laws: Sequence[Law], indent: str, call: str) -> list[str]:
    """Statements that call the function of a device's law."""
    return [
        line
        for tag in range(len(laws))
        for line in (f"{indent}if row[{LAW}] == {tag}:", f"{indent}    {call.format(tag)}")
    ]


def traced(law: Law, function: Callable[..., tuple]) -> tuple[list[str], list[str]]:
    """Statements and results of a law's function in x, v, s0, s1, ..., p0, p1, ...."""
    from isolation_sim.laws.emit import straight_line, symbols

    states = [f"s{k}" for k in range(len(law.states))]
    parameters = [f"p{k}" for k in range(len(law.parameters))]
    x, v = symbols(["x", "v"])
    s, p = tuple(symbols(states)), tuple(symbols(parameters))
    inputs = dict(zip(["x", "v", *states, *parameters], (x, v, *s, *p), strict=True))
    outputs = function(x, v, s, p)
    if not outputs:
        return [], []
    _, _, statements, results = straight_line(inputs, outputs)
    return statements, results


RANGE_FUNCTIONS: tuple[Callable[..., Range], ...] = (
    *OPERATIONS.values(), fixed_range, scaled_range, polynomial_range,
)  # fmt: skip
"""Names that the text of ``combined_range`` may use."""


@lru_cache(maxsize=64)
def _in_python(laws: tuple[Law, ...]) -> dict[str, Any]:
    """Functions of both texts without the compiler: the same operations in the same order."""
    names: dict[str, Any] = {function.__name__: function for function in RANGE_FUNCTIONS}
    names |= {"first_coefficient": first_coefficient, "polynomial": polynomial}
    names |= {"math": math, "plain": lambda f: f}
    exec(DeviceModel.text(laws) + "\n\n" + DeviceModel.range_text(laws), names)
    return names
