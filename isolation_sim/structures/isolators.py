"""Put a structure on isolators.

``Structure`` and ``IsolatedStructure`` import this module, so it does not import them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError
from ..laws.device import Device
from .rows import rows_of_base


def add_isolators(
    isolated: Any, device: Device, biaxial: bool = False, load_changes: np.ndarray | None = None
) -> Any:
    """Add the isolators between ground and base; ``device`` represents all of them."""
    channel = 0 if device.depends_on_current else None
    if biaxial:
        return _add_biaxial(isolated, device, channel, load_changes)
    if load_changes is not None:
        raise InputError(
            "overturning and vertical motion need biaxial isolators; expected: biaxial as well"
        )
    for name, row in rows_of_base(isolated.structure, "isolator").items():
        isolated = isolated.with_element(device, row, channel, name)
    return isolated


def _add_biaxial(
    isolated: Any, device: Device, channel: int | None, load_changes: np.ndarray | None
) -> Any:
    """Add a biaxial device at each isolator position, with equal shares."""
    structure = isolated.structure
    if len(structure.horizontal) != 2:
        raise InputError(
            f"{structure.name} has ground motion along {', '.join(structure.horizontal)}; expected "
            "for biaxial isolators: two directions"
        )
    places = structure.isolation_rows
    changes = [None] * len(places) if load_changes is None else list(load_changes)
    if len(changes) != len(places):
        raise InputError(
            f"load_changes has {len(changes)} rows; expected: {len(places)}, one per isolator"
        )
    share = device.scaled(force=1 / len(places))
    for k, (rows, change) in enumerate(zip(places, changes, strict=True)):
        name = "isolator" if len(places) == 1 else f"isolator{k + 1}"
        isolated = isolated.with_biaxial(share, rows, channel, name, change)
    return isolated
