"""What a hidden effect is, where it acts, and the registry of its forms.

An effect acts at one stage of the device's response:

``current``   what the material sees of the measured current;
``material``  factor on the device's stiffness and loss parameters, or a pair of factors, from the
              motion's history;
``force``     an added force;
``sensor``    what the force channel makes of the force.

A form is built from a generator of random numbers, which perturbs its shape, and returns a function
of the severity; severity 0 is no effect.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .motion import Motion

CURRENT, MATERIAL, FORCE, SENSOR = STAGES = ("current", "material", "force", "sensor")


@dataclass(frozen=True, eq=False)
class RunContext:
    """What a form may look at besides its severity.

    ``force`` (N) and ``power`` (dissipated, N mm/s) are those of the device with the effects of
    earlier stages; in the material stage they are of the last iterate.
    """

    motion: Motion
    current: np.ndarray
    force: np.ndarray
    power: np.ndarray


Action = Callable[[float, RunContext], object]
Builder = Callable[[np.random.Generator], Action]


@dataclass(frozen=True)
class Form:
    """One way to write an effect down."""

    effect: str
    name: str
    stage: str
    build: Builder
    limit: float
    heats: bool = False
    depends_on: frozenset[str] = frozenset()
    tolerated: frozenset[str] = frozenset()


FORMS: dict[str, dict[str, Form]] = {}


def form(
    effect: str,
    stage: str,
    limit: float = np.inf,
    heats: bool = False,
    depends_on: str = "",
    tolerated: str = "",
) -> Callable:
    """Enter a builder into ``FORMS``.

    ``limit`` is the severity beyond which the form is no longer physical; ``heats`` says that it
    needs the dissipated power; ``depends_on`` names the variables of an effect outside the
    catalogue, and ``tolerated`` those that may be named besides, for they come in through the force
    that the effect changes.
    """

    def register(build: Builder) -> Builder:
        name = build.__name__.lstrip("_")
        variables = frozenset(depends_on.split()), frozenset(tolerated.split())
        FORMS.setdefault(effect, {})[name] = Form(
            effect, name, stage, build, limit, heats, *variables
        )
        return build

    return register


def about(rng: np.random.Generator, value: float, spread: float = 0.2) -> float:
    """A value off by up to ``spread``."""
    return float(value * rng.uniform(1 - spread, 1 + spread))
