"""Fuzzy control by rules on the isolators' deformation and velocity."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from isolation_sim.simulation.control import RunContext
from isolation_sim.structures import IsolatedStructure

from .coils import driven_elements, highest_tested, lowest, motion_of_driven
from .compiled import CompiledController, Decision
from .settings import Number, SearchRange, setting

RULES = (
    # velocity: back fast, back slowly, still, out slowly, out fast; by a deformation that is
    (1.0, 0.5, 0.0, 0.5, 1.0),  # none
    (0.0, 0.0, 0.0, 0.5, 1.0),  # middling
    (0.0, 0.0, 0.0, 0.0, 0.0),  # large
)
"""Current of each rule, as a share of the range, by deformation and velocity."""
# settings: these, then each element's coil
DEFORMATION, VELOCITY, LOW, HIGH, OWN_COILS = range(5)


def share(deformation: float, velocity: float) -> float:
    """Weighted mean of the rules, each weighted by the product of its two memberships."""
    # adjacent triangular sets: the memberships of two neighbours add up to 1, so that
    # the weighted mean is interpolation between the rules
    row = 2.0 * min(deformation, 1.0)
    column = 2.0 + 2.0 * min(max(velocity, -1.0), 1.0)
    i, j = min(int(row), 1), min(int(column), 3)
    u, w = row - i, column - j
    return (1.0 - u) * ((1.0 - w) * RULES[i][j] + w * RULES[i][j + 1]) + u * (
        (1.0 - w) * RULES[i + 1][j] + w * RULES[i + 1][j + 1]
    )


def _decide(
    t: float, measured: NDArray, settings: NDArray, memory: NDArray, command: NDArray
) -> None:
    """Give each coil the largest current that the rules of its elements require."""
    # Measured: each element's deformation (m) and velocity (m/s), then the coil currents (A).
    for c in range(len(command)):
        most = 0.0
        for e in range((len(measured) - len(command)) // 2):
            if settings[OWN_COILS + e] == c:
                x, v = measured[2 * e], measured[2 * e + 1]
                outwards = v if x >= 0.0 else -v
                most = max(
                    most, share(abs(x) / settings[DEFORMATION], outwards / settings[VELOCITY])
                )
        command[c] = settings[LOW] + most * (settings[HIGH] - settings[LOW])


class Fuzzy(CompiledController):
    """Fuzzy rules on the isolators' deformation and velocity.

    The faster an isolator passes through its centre and moves away, the more current; none where
    it turns round, so that the stiffened isolator lets go before it pulls hardest, nor on the way
    back. Both sides of the centre are alike, so that three sets of deformation and five of velocity
    make fifteen rules, with a current as each rule's conclusion (Takagi and Sugeno). The rules are
    this project's own; the kind of controller is the sources'. Defaults are tuned
    (``studies/tuned/fuzzy.toml``).
    """

    name = "fuzzy"
    title = "Fuzzy"
    source = "Kim and Roschke 2006 (fuzzy control of isolated buildings); Takagi and Sugeno 1985"

    presets: ClassVar = {"published": {"large_deformation": 0.2, "fast": 1.2}}

    large_deformation: float = setting(
        0.3436, "deformation that counts as large", Number(above=0), "m", SearchRange(0.02, 2.0)
    )
    fast: float = setting(
        10.0, "velocity that counts as fast", Number(above=0), "m/s", SearchRange(0.05, 10.0)
    )

    def measures(self, nominal: IsolatedStructure) -> tuple[str, ...]:
        """Deformation and velocity of each element that a coil drives."""
        return motion_of_driven(nominal, self.name)

    def decision(self, context: RunContext) -> Decision:
        """Scales, range and coils."""
        coils = [e.channel or 0 for e in driven_elements(context.nominal, self.name)]
        low, high = float(lowest(context).max()), float(highest_tested(context).min())
        settings = np.array([self.large_deformation, self.fast, low, high, *coils], dtype=float)
        return Decision(_decide, settings, np.zeros(0))
