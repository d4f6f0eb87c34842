"""A device's force, rates and their exact derivatives, written out for Numba."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, ClassVar

from numpy.typing import NDArray

from isolation_sim.laws.law import Law

from ..device_model import N_POWERS, by_law, first_coefficient, polynomial
from ..observers.tangent import TangentModel


class PredictionModel(TangentModel):
    """Devices with the further function ``device_side``, in the laws' own scales."""

    signatures: ClassVar[dict[str, str]] = {
        **TangentModel.signatures,
        "device_side": TangentModel.signatures["state_rates"].replace("int64, ", ""),
    }

    @staticmethod
    def text(laws: Sequence[Law]) -> str:
        """Source of the functions, as of ``DeviceModel``."""
        return "\n\n".join([TangentModel.text(laws), _text(tuple(laws))])

    def device_side(
        self, x: float, v: float, states: NDArray, current: float, row: NDArray, out: NDArray
    ) -> None:
        """Force and rates, each with its derivatives by motion, current and states."""
        _in_python(self.laws)["device_side"](x, v, states, current, row, out)


@lru_cache(maxsize=64)
def _in_python(laws: tuple[Law, ...]) -> dict[str, Any]:
    names: dict[str, Any] = {"first_coefficient": first_coefficient, "polynomial": polynomial}
    names |= {"math": math, "plain": lambda function: function}
    exec(_text(laws), names)
    return names


@lru_cache(maxsize=64)
def _text(laws: tuple[Law, ...]) -> str:
    """Source of ``device_side``: force, rates and their exact derivatives, for some laws."""
    from isolation_sim.laws.emit import function_text

    n_states = max((len(law.states) for law in laws), default=0)
    parts = [_slope_text()]
    for tag, law in enumerate(laws):
        parts.append(function_text(f"side_{tag}", "x, v, states, current, row, out",
                                   _side_body(law, n_states), "@plain"))  # fmt: skip
    body = by_law(laws, "", "side_{}(x, v, states, current, row, out)")
    parts.append(function_text("device_side", "x, v, states, current, row, out", body, "@plain"))
    return "\n\n".join(parts)


def _slope_text() -> str:
    from isolation_sim.laws.emit import function_text

    body = [
        "value = 0.0",
        "for power in range(n_powers - 1, 0, -1):",
        "    value = value * current + power * row[at + power]",
        "return value",
    ]
    return function_text("polynomial_slope", "row, at, n_powers, current", body, "@plain")


def _side_body(law: Law, n_states: int) -> list[str]:
    import casadi

    from isolation_sim.laws.emit import straight_line, symbols

    own, n = [f"s{k}" for k in range(len(law.states))], len(law.states)
    numbered = range(len(law.parameters))
    names = ["x", "v", *own, *(f"p{k}" for k in numbered), *(f"q{k}" for k in numbered)]
    symbol = dict(zip(names, symbols(names), strict=True))
    s = tuple(symbol[k] for k in own)
    p = tuple(symbol[f"p{k}"] for k in numbered)
    values = [law.force(symbol["x"], symbol["v"], s, p)]
    values += law.rates(symbol["x"], symbol["v"], s, p)
    parameters = casadi.vertcat(*p) if p else casadi.SX(0, 1)
    slopes = casadi.vertcat(*[symbol[f"q{k}"] for k in numbered]) if p else casadi.SX(0, 1)
    motion = casadi.vertcat(symbol["x"], symbol["v"])
    states = casadi.vertcat(*s) if s else casadi.SX(0, 1)
    outputs: list[Any] = []
    places: list[int] = []
    stride = n_states + 4
    for k, value in enumerate(values):
        value = casadi.SX(value)
        row = [value, *casadi.vertsplit(casadi.gradient(value, motion))]
        row.append(casadi.jtimes(value, parameters, slopes) if p else casadi.SX(0))
        row += casadi.vertsplit(casadi.gradient(value, states)) if s else []
        outputs += row
        places += range(k * stride, k * stride + len(row))
    _, _, statements, results = straight_line(symbol, outputs)
    start = [
        f"at, powers = first_coefficient(row, current), int(row[{N_POWERS}])",
        *(f"p{k} = polynomial(row, at + {k} * powers, powers, current)" for k in numbered),
        *(f"q{k} = polynomial_slope(row, at + {k} * powers, powers, current)" for k in numbered),
        *(f"{name} = states[{k}]" for k, name in enumerate(own)),
    ]
    blank = [] if n == n_states else ["out[:] = 0.0"]
    put = [f"out[{at}] = {result}" for at, result in zip(places, results, strict=True)]
    return [*start, *statements, *blank, *put]
