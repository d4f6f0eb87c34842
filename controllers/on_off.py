"""Two currents, switched by the sign of a product of two measured quantities."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from isolation_sim.simulation.control import RunContext
from isolation_sim.structures import IsolatedStructure

from .coils import driven_elements, highest_tested, lowest
from .compiled import CompiledController, Decision
from .settings import Number, OneOf, Optional, SearchRange, setting

RULES = {
    "stiffness": "stiff while the isolator moves away from its centre, on if x v > 0: "
    "Chen 1984, Onoda et al. 1991",
    "dissipation": "on while the isolator takes energy out of the motion, if F v > 0: "
    "Jansen and Dyke 2000, maximum energy dissipation",
    "acceleration": "on while that slows the base, if its absolute acceleration a has a v > 0: "
    "Savaresi et al. 2005, acceleration-driven damper",
    "skyhook": "on while that slows the base, if its absolute velocity w has w v > 0: "
    "Karnopp et al. 1974",
}
"""Each rule in the isolator's deformation x, its velocity v and its force F."""

SKYHOOK = 1.0
# settings: currents, dead band, whether to integrate, rad/s of the wash-out, then an element's coil
ON, OFF, BAND, KIND, WASH_OUT, COILS = range(6)


def _decide(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray
) -> None:
    """Switch each coil by the sum of the products of its elements."""
    # Measured: both factors of each element, then the coil currents. Memory: last instant (s), last
    # commands (A), and each element's last acceleration (m/s^2) and velocity (m/s).
    n_coils = len(command)
    n_elements = (len(measured) - n_coils) // 2
    h = t - memory[0]
    memory[0] = t
    for c in range(n_coils):
        total = 0.0
        for e in range(n_elements):
            if settings[COILS + e] != c:
                continue
            first, second = measured[2 * e], measured[2 * e + 1]
            if settings[KIND] == SKYHOOK:
                # acceleration to velocity by the trapezoidal rule; drift is washed out
                at = 1 + n_coils + 2 * e
                gain = 0.5 * h * (memory[at] + first)
                memory[at] = first
                memory[at + 1] = memory[at + 1] * math.exp(-settings[WASH_OUT] * h) + gain
                first = memory[at + 1]
            total += first * second
        if total > settings[BAND]:
            memory[1 + c] = settings[ON]
        elif total <= -settings[BAND]:
            memory[1 + c] = settings[OFF]
        command[c] = memory[1 + c]


class OnOff(CompiledController):
    """Two currents, switched by the sign of a product of two measured quantities."""

    name = "on_off"
    title = "On-off"
    source = "; ".join(RULES.values())

    rule: str = setting("stiffness", "product that decides", OneOf(tuple(RULES)))
    on: float | None = setting(
        None,
        "current when on; None for the highest tested, within the supply's limits",
        Optional(Number()),
        "A",
        SearchRange(0.0, 3.0, "linear"),
    )
    off: float | None = setting(
        None, "current when off; None for the supply's lowest, or 0", Optional(Number()), "A",
        SearchRange(0.0, 3.0, "linear"),
    )  # fmt: skip
    dead_band: float = setting(
        0.0,
        "the last current is held while the absolute product is below this; in m^2/s for stiffness "
        "and skyhook (m^2/s^2), W for dissipation, m^2/s^3 for acceleration",
        Number(at_least=0),
    )
    wash_out: float = setting(
        0.1, "skyhook: corner frequency of the wash-out filter", Number(above=0),
        "Hz",
    )  # fmt: skip

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Both factors of each element that a coil drives."""
        names = []
        for element in driven_elements(nominal, self.name):
            base = nominal.structure.names[int(np.argmax(element.direction))]
            first = {
                "stiffness": f"{element.name}_deformation_m",
                "dissipation": f"{element.name}_force_N",
            }.get(self.rule, f"{base}_acceleration_m_s2")
            names += [first, f"{element.name}_velocity_m_s"]
        return tuple(names)

    def decision(self, context: RunContext) -> Decision:
        """Currents and coils; switched off at the start."""
        on = float(highest_tested(context).min()) if self.on is None else self.on
        off = float(lowest(context).max()) if self.off is None else self.off
        driven = driven_elements(context.nominal, self.name)
        coils = [float(element.channel or 0) for element in driven]
        kind = SKYHOOK if self.rule == "skyhook" else 0.0
        wash_out = 2 * np.pi * self.wash_out
        memory = np.zeros(1 + len(context.low) + 2 * len(coils))
        memory[1 : 1 + len(context.low)] = off
        settings = np.array([on, off, self.dead_band, kind, wash_out, *coils])
        return Decision(_decide, settings, memory)
