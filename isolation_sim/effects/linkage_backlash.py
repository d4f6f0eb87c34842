"""Free play in the linkage: after a reversal the test rig moves before the device does.

Forms:

    play        law sees y, the play (backlash) of half-width `gap`: y stays while |x - y| < gap and
                is dragged along otherwise; it starts in the middle of the gap
    open        law sees the play, and no force passes while the linkage is open, nor at an end of
                the gap one that pulls: friction holds the device where it was left
    dead_zone   law sees x less the part within `gap` of the centre: a spring brings the device back
                to the middle of its clearance
    released    law sees the play, and while the linkage is open the device relaxes,
                y' = -y / `time`: a damper with a spring in a clearance that only pushes. The
                linkage opens where the force is zero, if `time` is the law's own (c / k)

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


def motion_released(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Motion behind the gap of a device that relaxes while the linkage is open."""
    gap, time = parameters
    place = signals.x - states[0]
    pressed, _ = _contact(states[0], gap)
    # a contact pushes, up to the velocity of the rig; without a gap it is never open
    closing, pushed = signals.v + place / time, pressed / RISE
    driven = positive(np.fmin(pushed, closing)) - positive(np.fmin(-pushed, -closing))
    held = _SMALL_GAP / (gap + _SMALL_GAP)
    return place + pressed, driven + held * (closing - driven) - place / time


def rates_released(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Distance of the rig from a device that relaxes, up to the ends of the gap."""
    gap, time = parameters
    away = states[0]
    return (signals.v + (signals.x - away) / time - _contact(away, gap)[0] / RISE,)


GAP = EffectParameter(
    "gap", "m", "half of the free play", lower=0.0, magnitude=True, starts=(0.001, 0.01, 0.03, 0.1),
    difference=0.05,
)  # fmt: skip
OPEN_GAP = replace(GAP, least=5e-4, starts=(0.01, 0.03, 0.1))
"""Without a gap that is seen in the displacement, an open linkage would be a part of the pull."""
RELEASE = EffectParameter(
    "time", "s", "relaxation of the device that is let go", lower=2.5 * RISE, upper=20.0,
    starts=(0.02, 0.07, 0.2, 1.0), divides=True, plain=(2.5 * RISE, 20.0),
)  # fmt: skip
"""For ever it is the play; at once, the dead zone."""
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
    Effect(
        cause="linkage_backlash",
        form="released",
        title="Linkage backlash that releases the device",
        parameters=(GAP, RELEASE),
        states=(Quantity("away", "m", "distance of the rig from the device, from their middle"),),
        rates=rates_released,
        motion=motion_released,
        source="Nordin, Galic & Gutman (1997), flexible shaft in its gap",
    ),
)  # fmt: skip
