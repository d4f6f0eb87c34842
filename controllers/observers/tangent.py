"""Devices with the exact derivatives of their laws, traced once and written out."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from isolation_sim.laws.law import Law

from ..device_model import (
    FORCE_SCALE,
    LENGTH,
    DeviceModel,
    by_law,
    loaded,
    traced,
)


def force_and_rates(law: Law, x: Any, v: Any, states: tuple, parameters: tuple) -> list[Any]:
    """Force and rates of the states, each followed by its derivatives by x, v and the states."""
    import casadi

    motion = [x, v, *states]
    values = [law.force(x, v, states, parameters), *law.rates(x, v, states, parameters)]
    return [
        entry
        for value in map(casadi.SX, values)
        for entry in (value, *(casadi.jacobian(value, by) for by in motion))
    ]


@lru_cache(maxsize=64)
def _function(law: Law) -> Any:
    """CasADi function: x, v, states, parameters -> the rows of ``force_and_rates``."""
    import casadi

    from isolation_sim.laws.emit import symbols

    x, v, *rest = arguments = symbols(["x", "v", *law.state_names, *law.parameter_names])
    states, parameters = tuple(rest[: len(law.states)]), tuple(rest[len(law.states) :])
    entries = force_and_rates(law, x, v, states, parameters)
    return casadi.Function("tangent", arguments, [casadi.vertcat(*entries)])


class TangentModel(DeviceModel):
    """Devices with the further function ``tangent``."""

    signatures: ClassVar[dict[str, str]] = {
        **DeviceModel.signatures, "tangent": DeviceModel.signatures["state_rates"],
    }  # fmt: skip

    @staticmethod
    def text(laws: Sequence[Law]) -> str:
        """Source of the functions, as of ``DeviceModel``."""
        from isolation_sim.laws.emit import function_text

        parts = [DeviceModel.text(laws)]
        for tag, law in enumerate(laws):
            width = 3 + len(law.states)
            statements, entries = traced(law, lambda *a, law=law: tuple(force_and_rates(law, *a)))
            body = [*loaded(law), *statements]
            for k, entry in enumerate(entries):
                factor = f"row[{FORCE_SCALE}] * " if k < width else ""
                divided = f" / row[{LENGTH}]" if k % width in (1, 2) else ""
                body.append(f"out[{k}] = {factor}{entry}{divided}")
            parts.append(
                function_text(f"tangent_{tag}", "x, v, states, current, row, out", body, "@plain")
            )
        body = by_law(laws, "", "tangent_{}(x, v, states, current, row, out)")
        parts.append(function_text("tangent", "e, x, v, states, current, row, out", body, "@plain"))
        return "\n\n".join(parts)

    def tangent(
        self, e: int, x: float, v: float, states: NDArray, current: float, row: NDArray,
        out: NDArray,
    ) -> None:  # fmt: skip
        """Force and rates of a device's states with their derivatives."""
        device = self.devices[e]
        n = len(device.law.states)
        values = np.ravel(
            _function(device.law)(
                x / device.length, v / device.length, *states[:n].tolist(),
                *device.parameters_at(current),
            )
        ).reshape(1 + n, 3 + n)  # fmt: skip
        values[:, 1:3] /= device.length
        values[0] *= device.force_scale
        out[: values.size] = values.ravel()
