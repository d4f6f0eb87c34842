"""Sliding mode control of the isolators' motion."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from isolation_sim.simulation.control import RunContext
from isolation_sim.structures import IsolatedStructure

from .coils import driven_elements, motion_of_driven
from .compiled import CompiledController, Decision
from .force_tracking import MOTION, follow_device, force_tracking, nearest_currents
from .settings import Number, SearchRange, setting

# settings: these, the mass that each element carries, then the force tracking's
SLOPE, GAIN, LAYER, MASSES = range(4)


def _decide(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray,
    combined_force: Callable, combined_range: Callable, state_rates: Callable,
) -> None:  # fmt: skip
    """Forces that lead each isolator to its surface, then the currents nearest to them."""
    # Measured: each element's deformation (m) and velocity (m/s), then the coil currents (A).
    # Memory: that of the force tracking.
    m = (len(measured) - len(command)) // 2
    tracking = settings[MASSES + m :]
    h = t - memory[0]
    memory[0] = t
    for e in range(m):
        x, v = measured[2 * e], measured[2 * e + 1]
        follow_device(e, x, v, h, tracking, memory, measured[2 * m :], state_rates)
        distance = (v + settings[SLOPE] * x) / settings[LAYER]
        reaching = settings[GAIN] * min(max(distance, -1.0), 1.0)
        memory[MOTION + 2 * m + e] = settings[MASSES + e] * (settings[SLOPE] * v + reaching)
    nearest_currents(tracking, memory, command, combined_force, combined_range)


class SlidingMode(CompiledController):
    """Sliding mode control of the isolators' motion, with a boundary layer.

    On the surface v + slope x = 0 an isolator's deformation dies out by itself. With the building
    taken as rigid on its isolators, m x'' = -F - m a_g, the force F = m (slope v + gain sign(s))
    leads to the surface wherever the gain exceeds the ground's acceleration; within a boundary
    layer of the surface the sign is replaced by a straight line. A gain below the ground's
    acceleration reaches it part of the time only, and shakes the building less. Defaults are tuned
    (``studies/tuned/sliding_mode.toml``).
    """

    name = "sliding_mode"
    title = "Sliding mode"
    source = "Yang, Wu and Agrawal 1995; Slotine and Li 1991, chapter 7 (boundary layer)"

    presets: ClassVar = {"published": {"slope": 0.4, "gain": 0.4, "layer": 0.09}}

    slope: float = setting(
        0.2127, "of the surface: decay rate of the deformation on it", Number(above=0), "1/s",
        SearchRange(0.02, 10.0),
    )  # fmt: skip
    gain: float = setting(
        0.01232, "acceleration towards the surface", Number(at_least=0), "m/s^2",
        SearchRange(0.01, 5.0),
    )  # fmt: skip
    layer: float = setting(
        0.0254, "width of the boundary layer", Number(above=0),
        "m/s", SearchRange(0.01, 3.0),
    )  # fmt: skip

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Deformation and velocity of each element that a coil drives."""
        return motion_of_driven(nominal, self.name)

    def decision(self, context: RunContext) -> Decision:
        """Constants, masses and devices in one array."""
        nominal = context.nominal
        tracking = force_tracking(driven_elements(nominal, self.name), context)
        masses = carried_masses(nominal, tracking.reference(None))
        own = [self.slope, self.gain, self.layer]
        settings = np.concatenate([own, masses, tracking.settings])
        return Decision(_decide, settings, tracking.memory, tracking.model)


def carried_masses(nominal: IsolatedStructure, currents: NDArray) -> NDArray:
    """Mass carried by each driven element: the isolated mass, distributed by stiffness."""
    structure, driven = nominal.structure, driven_elements(nominal, "carried masses")
    rows = np.array([element.direction for element in driven])
    carried = structure.above_foundation
    along = np.argmax(np.abs(rows @ carried), axis=1)
    stiffness = np.array([
        abs(element.device.linearised(float(currents[element.channel or 0]))) for element in driven
    ])  # fmt: skip
    whole = np.einsum("ij,ik,kj->j", carried, structure.mass, carried)
    totals = np.array([stiffness[along == direction].sum() for direction in along])
    return whole[along] * stiffness / totals
