"""A run's histories as an xarray Dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray

    from .trajectory import Trajectory


def dataset(run: Trajectory) -> xarray.Dataset:
    """Histories at the record's samples."""
    import xarray

    structure, isolated = run.isolated.structure, run.isolated
    n, m = structure.n_dofs, len(isolated.elements)
    widths = [n, n, n, len(structure.storeys), m, m, m, len(structure.directions)]
    parts = np.split(run.values, np.cumsum(widths)[:-1], axis=1)
    quantities = [
        ("displacement", "dof", "m", "displacement relative to the ground"),
        ("velocity", "dof", "m/s", "velocity relative to the ground"),
        ("acceleration", "dof", "m/s^2", "absolute acceleration"),
        ("drift", "storey", "m", "storey drift"),
        ("deformation", "element", "m", "deformation of the element"),
        ("deformation_rate", "element", "m/s", "deformation velocity of the element"),
        ("force", "element", "N", "restoring force of the element"),
        ("ground_acceleration", "direction", "m/s^2", "ground acceleration"),
    ]
    variables: dict[str, tuple] = {
        name: (("time", axis), values, {"units": unit, "long_name": meaning})
        for (name, axis, unit, meaning), values in zip(quantities, parts, strict=True)
    }
    for name, values, meaning in (
        ("current", run.current, "coil current"),
        ("command", run.command, "commanded current"),
    ):
        variables[name] = (("time", "channel"), values, {"units": "A", "long_name": meaning})
    devices = zip(isolated.device_names, isolated.groups, isolated.group_laws, strict=True)
    for name, (e, *_), law in devices:
        for k, state in enumerate(law.states):
            variables[f"{name}_{state.name}"] = (
                ("time",),
                run.states[:, e, k],
                {"units": state.unit, "long_name": f"{state.meaning}, in the device's scale"},
            )
    return xarray.Dataset(
        variables,
        coords={
            "time": ("time", run.time, {"units": "s"}),
            "dof": list(structure.names),
            "storey": list(structure.storeys),
            "element": list(isolated.element_names),
            "channel": np.arange(isolated.n_channels),
            "direction": list(structure.directions),
        },
        attrs={
            "structure": structure.name,
            "controller": run.controller,
            "ground_motion": ", ".join(r.name for r in run.records),
        },
    )
