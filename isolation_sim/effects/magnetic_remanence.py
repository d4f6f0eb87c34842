"""The field remembers larger currents: remanence of the steel and of the particles.

Forms:

    play       I' = I + share (y - I),   y the play (backlash) of half-width `coercive`: y stays
               while |I - y| < coercive and is dragged along otherwise; it starts where a current
               that rose from zero has dragged it
    settled    the same, but it starts at the first current
    plays      the same as `play` with the mean of plays whose half-widths are spread up to `widest`
    preisach   I' = I + share (P - I), P of Preisach's relays of equal weight up to twice `widest`:
               P = 2 <beyond(y, w)>, mean over plays y of half-widths w up to `widest`, which start
               as that of `play`. Nothing is left without current
    hodgdon    I' = I + share (y - I),   dy = |dI| (I - y) / path: y nears the current along its
               path, and begins where a current that rose from zero has brought it
    largest    I' = I + share (I_max - I)      I_max the largest current so far
    fading     the same, with I_max forgotten over a time (magnetic viscosity)

The states follow the current within a lag of 2 ms.
"""

from typing import Any

import numpy as np

from ..laws.law import Quantity
from .effect import Effect, EffectParameter, Past, Signals
from .followers import RISE, beyond, positive, rise, rise_and_fade


def current(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Between the current and the one remembered, which never lags behind the play's end."""
    share, coercive = parameters
    remanent = states[0] + beyond(signals.current - states[0], coercive)
    return signals.current + share * (remanent - signals.current)


def rates_play(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Dragged along at the ends of the play."""
    (keep,), coercive = states, parameters[1]
    return (beyond(signals.current - keep, coercive) / RISE,)


def start_play(signals: Signals, parameters: tuple) -> tuple:
    """The current has risen from zero."""
    return (beyond(signals.current, parameters[1]),)


def carried_play(past: Past, parameters: tuple) -> tuple:
    """Without current since an earlier test."""
    dragged = beyond(past.current, parameters[1])
    return (dragged - beyond(dragged, parameters[1]),)


def current_plays(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Between the current and the mean of those remembered."""
    share, widest = parameters
    remanent = 0.0
    for keep, part in zip(states, PARTS, strict=True):
        remanent += (keep + beyond(signals.current - keep, part * widest)) / len(PARTS)
    return signals.current + share * (remanent - signals.current)


def carried_plays(past: Past, parameters: tuple) -> tuple:
    """Without current since an earlier test."""
    return tuple(carried_play(past, (parameters[0], part * parameters[1]))[0] for part in PARTS)


def current_preisach(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Between the current and the relays', which are those of plays beyond their half-widths."""
    share, widest = parameters
    relays = 0.0
    for keep, part in zip(states, PARTS, strict=True):
        width = part * widest
        relays += 2 * beyond(keep + beyond(signals.current - keep, width), width) / len(PARTS)
    return signals.current + share * (relays - signals.current)


def rates_plays(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Each play is dragged along at its ends."""
    return tuple(
        beyond(signals.current - keep, part * parameters[1]) / RISE
        for keep, part in zip(states, PARTS, strict=True)
    )


def start_plays(signals: Signals, parameters: tuple) -> tuple:
    """The current has risen from zero."""
    return tuple(beyond(signals.current, part * parameters[1]) for part in PARTS)


def current_hodgdon(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Between the current and the one that follows it along its path."""
    return signals.current + parameters[0] * (states[1] - signals.current)


def rates_hodgdon(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """The current, some milliseconds late, and what follows it by the change of its size."""
    follow, kept = states
    rate = (signals.current - follow) / RISE
    return rate, np.fabs(rate) * (follow - kept) / parameters[1]


def start_hodgdon(signals: Signals, parameters: tuple) -> tuple:
    """The current has risen from zero."""
    path, size = parameters[1], np.fabs(signals.current)
    kept = size - path * (1 - np.exp(-size / path))
    return signals.current, kept * np.sign(signals.current)


def carried_hodgdon(past: Past, parameters: tuple) -> tuple:
    """Without current since an earlier test."""
    path = parameters[1]
    return 0.0 * past.current, path * (1 - np.exp(-past.current / path)) ** 2


def current_largest(signals: Signals, states: tuple, parameters: tuple) -> Any:
    """Never below the present current: the state is some milliseconds late."""
    return signals.current + parameters[0] * positive(states[0] - signals.current)


def rates_largest(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Upwards only."""
    return (rise(signals.current, states[0]),)


def rates_fading(signals: Signals, states: tuple, parameters: tuple) -> tuple:
    """Upwards at once, downwards over the time of memory."""
    return (rise_and_fade(signals.current, states[0], parameters[1]),)


def start(signals: Signals, parameters: tuple) -> tuple:
    """There was no current before the first one."""
    return (signals.current,)


def carried_largest(past: Past, parameters: tuple) -> tuple:
    """Earlier tests count."""
    return (past.current,)


PARTS = (0.125, 0.375, 0.625, 0.875)
"""Half-widths of the plays that stand for all relays, as shares of the widest."""
SHARE = EffectParameter(
    "share", "1", "fraction of the remanent field", lower=0.0, upper=1.0, magnitude=True,
    starts=(0.1, 0.4), plain=(1.0,),
)  # fmt: skip

FORMS = (
    *(
        Effect(
            cause="magnetic_remanence",
            form=form,
            title=title,
            parameters=(
                SHARE,
                EffectParameter(
                    "coercive", "A", "half-width of the play", lower=0.0, upper=10.0,
                    starts=(0.1, 0.3),
                ),
            ),
            states=(Quantity("kept", "A", "current in the play"),),
            start=first,
            carried=carried_play if form == "play" else None,
            current=current,
            rates=rates_play,
            source="play operator: Visintin (1994), Differential Models of Hysteresis",
        )
        for form, title, first in (
            ("play", "Magnetic remanence", start_play),
            ("settled", "Magnetic remanence, settled at the first current", start),
        )
    ),
    *(
        Effect(
            cause="magnetic_remanence",
            form=form,
            title=title,
            parameters=(
                SHARE,
                EffectParameter(
                    "widest", "A", f"half-width of the widest {what}", lower=1e-3, upper=100.0,
                    divides=True, starts=(0.3, 0.6),
                ),
            ),
            states=tuple(
                Quantity(f"kept_{k}", "A", f"current in play {k}") for k, _ in enumerate(PARTS, 1)
            ),
            start=start_plays,
            carried=past,
            current=follows,
            rates=rates_plays,
            source=source,
        )
        for form, title, what, past, follows, source in (
            (
                "plays", "Magnetic remanence of plays of all widths", "play",
                carried_plays, current_plays,
                "Visintin (1994); plays of Prandtl and Ishlinskii",
            ),
            (
                "preisach", "Magnetic remanence of relays of all widths", "relay",
                None, current_preisach,
                "Preisach (1935); relays of equal weight: Rayleigh (1887)",
            ),
        )
    ),
    Effect(
        cause="magnetic_remanence",
        form="hodgdon",
        title="Magnetic remanence along the path of the current",
        parameters=(
            SHARE,
            EffectParameter(
                "path", "A", "path of the current along which the field nears it", lower=0.05,
                upper=10.0, divides=True, starts=(0.2, 0.6),
            ),
        ),
        states=(
            Quantity("follow", "A", "current"), Quantity("kept", "A", "current that is neared"),
        ),
        start=start_hodgdon,
        carried=carried_hodgdon,
        current=current_hodgdon,
        rates=rates_hodgdon,
        source="Coleman & Hodgdon (1986); in magnetorheological actuators: An & Kwon (2003)",
    ),
    Effect(
        cause="magnetic_remanence",
        form="largest",
        title="Magnetic remanence after the largest current",
        parameters=(SHARE,),
        states=(Quantity("largest", "A", "largest current so far"),),
        start=start,
        carried=carried_largest,
        current=current_largest,
        rates=rates_largest,
        source="remanence of the major loop, linear",
    ),
    Effect(
        cause="magnetic_remanence",
        form="fading",
        title="Magnetic remanence that fades",
        parameters=(
            SHARE,
            EffectParameter(
                "memory", "s", "time constant of fading", lower=0.01, upper=1e4, divides=True,
                starts=(1.0, 10.0),
            ),
        ),
        states=(Quantity("largest", "A", "largest current, fading"),),
        start=start,
        current=current_largest,
        rates=rates_fading,
        source="magnetic viscosity: Street & Woolley (1949)",
    ),
)  # fmt: skip
