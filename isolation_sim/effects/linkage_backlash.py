"""Free play in the linkage: after a reversal the test rig moves before the device does.

Forms:

    play        law sees y, the play (backlash) of half-width `gap`: y stays while |x - y| < gap and
                is dragged along otherwise; it starts in the middle of the gap
    open        law sees the play, and no force passes while the linkage is open, nor at an end of
                the gap one that pulls: friction holds the device where it was left
    dead_zone   law sees x less the part within `gap` of the centre: a spring brings the device back
                to the middle of its clearance

The displacement is measured on the rig's side of the linkage. Contact is elastic: it takes hold
from 0.9 to 1.1 of the gap, and the device then sees the velocity of the rig. The memory of y
follows within a lag of 2 ms.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ..laws.law import Quantity
from .effect import Effect, EffectParameter, Signals
from .followers import RISE, positive

_NO_GAP = 1e-9
"""m: depth of the contact without a gap."""
_SMALL_GAP = 1e-6
"""m: a gap well below it does not part the device from the rig."""


def _from_0_to_1(value: Any) -> Any:
    above = positive(value)
    return above - positive(above - 1)


def _contact(away: Any, gap: Any) -> tuple:
    """Distance beyond the gap, m, and how far contact has taken hold, 0 to 1."""
    depth = gap / 10 + _NO_GAP
    hold = _from_0_to_1((np.fabs(away) - gap) / (2 * depth) + 0.5)
    pressed = depth * hold**2 + positive(np.fabs(away) - gap - depth)
    return np.sign(away) * pressed, hold


def motion(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Motion behind the gap."""
    pressed, hold = _contact(signals.x - states[0], parameters[0])
    return states[0] + pressed, signals.v * hold


def rates(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Dragged along at the ends of the gap."""
    return (_contact(signals.x - states[0], parameters[0])[0] / RISE,)


def open_linkage_force(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """What an open linkage keeps back: at each end of the gap it pushes and does not pull."""
    (gap,) = parameters
    away, force = signals.x - states[0], signals.force
    # at the end of its gap the linkage is closed even at rest; it opens at 0.8 of the gap
    hold = _from_0_to_1((np.fabs(away) - 0.8 * gap) / (0.1 * gap + _NO_GAP))
    pushed = positive(force) * (away > 0) - positive(-force) * (away < 0)
    return gap / (gap + _SMALL_GAP) * (hold * pushed - force)


def start(signals: Signals, parameters: tuple) -> tuple:
    """In the middle of the gap."""
    return (signals.x,)


def motion_dead_zone(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Motion outside the dead zone."""
    pressed, hold = _contact(signals.x, parameters[0])
    return pressed, signals.v * hold


GAP = EffectParameter(
    "gap", "m", "half of the free play", lower=0.0, magnitude=True, starts=(0.01, 0.03, 0.1),
    difference=0.05,
)  # fmt: skip
OPEN_GAP = replace(GAP, least=5e-4)
"""Without a gap that is seen in the displacement, an open linkage would be a part of the pull."""
KEEP = Quantity("keep", "m", "deformation from which the play is measured")

FORMS = (
    Effect(
        cause="linkage_backlash",
        form="play",
        title="Linkage backlash",
        parameters=(GAP,),
        states=(KEEP,),
        start=start,
        rates=rates,
        motion=motion,
        source="Visintin (1994), play operator",
    ),
    Effect(
        cause="linkage_backlash",
        form="open",
        title="Linkage backlash that lets go",
        parameters=(OPEN_GAP,),
        states=(KEEP,),
        start=start,
        rates=rates,
        motion=motion,
        force=open_linkage_force,
        needs=frozenset({"force"}),
        source="Nordin & Gutman (2002), physical model of backlash",
    ),
    Effect(
        cause="linkage_backlash",
        form="dead_zone",
        title="Linkage backlash about the centre",
        parameters=(GAP,),
        motion=motion_dead_zone,
        source="Nordin & Gutman (2002), dead zone",
    ),
)  # fmt: skip
