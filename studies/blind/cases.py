"""Seeded lists of cases: what is hidden, in which device, at which size, diagnosed with which law.

A case is made only when asked for (``case.campaign()``); the same seed gives the same campaign.
Sizes are visible parts (``response.Gauge``): the share of the force, RMS, that the diagnosing law
cannot take up. Where a form's limit lies below a size asked for, the sizes are spread between the
smallest and that limit, so that every form is asked at three sizes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .campaign import BlindCampaign, make_campaign, true_form_error
from .devices import BASES, Device, perturbed
from .effect import FORMS
from .motion import motions
from .response import Gauge, Hidden

CATALOGUE = tuple(sorted(name for name in FORMS if not name.startswith("outside:")))
OUTSIDE = tuple(sorted(name for name in FORMS if name.startswith("outside:")))
SIZES = (0.01, 0.02, 0.05)
"""Visible sizes of single effects at 1 % noise in force and displacement."""
MEMBER_SIZE = 0.03
"""Visible size of each member of a pair or a triple."""

# base laws whose own parameters take the form up, wholly or to below the smallest size
TAKEN_UP = {
    ("force_offset", "same_everywhere"): ("bouc_wen", "hybrid"),
    ("weak_rate_dependence", "thinning"): ("bouc_wen",),
    ("field_saturation", "langevin"): ("bouc_wen", "hybrid"),
    ("field_gap_coupling", "longer_path"): ("hybrid",),
}


@dataclass(frozen=True)
class Truth:
    """What the case hides.

    ``sizes`` and ``changes`` are the gauge's visible parts and whole changes; ``depends_on`` and
    ``tolerated`` are variables of effects outside the catalogue (see ``outside``).
    """

    base: str
    effects: tuple[str, ...]
    forms: tuple[str, ...]
    severities: tuple[float, ...]
    sizes: tuple[float, ...]
    changes: tuple[float, ...]
    depends_on: frozenset[str]
    tolerated: frozenset[str]


@dataclass(frozen=True)
class Case:
    """One blind case.

    ``kind`` is clean, single, pair, triple, outside or wrong_law; ``base`` the true law and ``law``
    the one to diagnose with; ``effects`` are (effect, form) with form None for a random one.
    ``level`` chooses the size for a single: 0 smallest, 2 largest.
    """

    kind: str
    base: str
    law: str
    effects: tuple[tuple[str, str | None], ...] = ()
    seed: int = 0
    programme: str = "quick"
    level: int = 2
    sizes: tuple[float, ...] = SIZES
    noise: float = 0.01
    settings: dict = field(default_factory=dict, hash=False, compare=False)

    @property
    def name(self) -> str:
        """Unique in its list."""
        against = f"-by-{self.law}" if self.law != self.base else ""
        hidden = "+".join(f"{e}.{f}" if f else e for e, f in self.effects) or "nothing"
        level = f"-{self.level}" if self.kind in ("single", "outside") else ""
        return f"{self.kind}-{self.base}{against}-{hidden}{level}-{self.seed}"

    @cached_property
    def device(self) -> Device:
        """Base device, its parameters perturbed by the seed."""
        return perturbed(self.base, np.random.default_rng([self.seed, 1]))

    @cached_property
    def _calibrated(self) -> tuple[tuple[Hidden, ...], Truth]:
        """Each effect to its size in the device that already has the effects before it."""
        tests = tuple(motions(self.programme, self.seed, 2))
        result: list[Hidden] = []
        sizes, changes = [], []
        for number, (effect, form) in enumerate(self.effects):
            rng = np.random.default_rng([self.seed, 2, number])
            blank = Hidden.draw(effect, rng, form)
            gauge = Gauge(self.device, tests, tuple(result))
            hidden = gauge.at_size(blank, self._size(gauge, blank))
            result.append(hidden)
            sizes.append(gauge.visible(hidden))
            changes.append(gauge.change(hidden))
        forms = [h.form for h in result]
        truth = Truth(
            base=self.base,
            effects=tuple(f.effect for f in forms),
            forms=tuple(f.name for f in forms),
            severities=tuple(h.severity for h in result),
            sizes=tuple(sizes),
            changes=tuple(changes),
            depends_on=frozenset().union(*(f.depends_on for f in forms)),
            tolerated=frozenset().union(*(f.tolerated for f in forms)),
        )
        return tuple(result), truth

    def _size(self, gauge: Gauge, hidden: Hidden) -> float:
        largest = 0.95 * gauge.largest(hidden)
        if len(self.effects) > 1:
            return min(MEMBER_SIZE, largest)
        low = min(self.sizes[0], largest)
        if largest >= self.sizes[-1]:
            return self.sizes[self.level]
        return float(low * (largest / low) ** (self.level / (len(self.sizes) - 1)))

    @property
    def hidden(self) -> tuple[Hidden, ...]:
        """The effects with their severities."""
        return self._calibrated[0]

    @property
    def truth(self) -> Truth:
        """What a diagnosis is scored against."""
        return self._calibrated[1]

    def campaign(self) -> BlindCampaign:
        """The data: nothing of the truth is in names or columns."""
        return make_campaign(
            self.device,
            self.hidden,
            programme=self.programme,
            seed=self.seed,
            force_noise=self.noise,
            displacement_noise=self.noise,
            **self.settings,
        )

    def true_form_error(self, campaign: BlindCampaign) -> float:
        """Held-out error of the true device with the true effects."""
        return true_form_error(campaign, self.device, self.hidden)


def forms_of(effect: str, base: str) -> list[str]:
    """Forms of an effect that can be seen in a base law."""
    return [name for name in sorted(FORMS[effect]) if base not in TAKEN_UP.get((effect, name), ())]


def singles(
    bases: Sequence[str] = ("strain_stiffening", "bouc_wen"),
    levels: Sequence[int] = (0, 1, 2),
    seed: int = 1000,
    **options,
) -> Iterator[Case]:
    """Each effect, each form, each size, each base, each with its own seed."""
    for base in bases:
        for effect in CATALOGUE:
            for form in forms_of(effect, base):
                for level in levels:
                    seed += 1
                    yield Case(
                        "single", base, base, ((effect, form),), seed, level=level, **options
                    )


def several(
    size: int,
    count: int,
    bases: Sequence[str] = ("strain_stiffening", "bouc_wen"),
    seed: int = 5000,
    **options,
) -> Iterator[Case]:
    """Random pairs (2) or triples (3) of different effects."""
    rng = np.random.default_rng([seed, size])
    kind = {2: "pair", 3: "triple"}[size]
    for number in range(count):
        base = bases[number % len(bases)]
        effects = rng.permutation(CATALOGUE)[:size]
        drawn = tuple((str(e), str(rng.choice(forms_of(e, base)))) for e in effects)
        yield Case(kind, base, base, drawn, seed + number, **options)


def clean(
    count: int,
    bases: Sequence[str] = ("strain_stiffening", "bouc_wen"),
    seed: int = 8000,
    **options,
) -> Iterator[Case]:
    """Nothing hidden; the diagnosing law is the true one."""
    for number in range(count):
        base = bases[number % len(bases)]
        yield Case("clean", base, base, (), seed + number, **options)


def outside(
    bases: Sequence[str] = ("strain_stiffening", "bouc_wen"),
    levels: Sequence[int] = (1, 2),
    seed: int = 9000,
    **options,
) -> Iterator[Case]:
    """Each effect outside the catalogue."""
    for base in bases:
        for effect in OUTSIDE:
            for level in levels:
                seed += 1
                yield Case("outside", base, base, ((effect, None),), seed, level=level, **options)


def wrong_law(count: int, seed: int = 9500, **options) -> Iterator[Case]:
    """Nothing hidden, but the data are of a law that the one to diagnose does not contain."""
    pairs = [(true, law) for true in BASES for law in BASES if true not in (law, "kelvin_voigt")]
    rng = np.random.default_rng([seed, 3])
    for number in range(count):
        true, law = pairs[int(rng.integers(len(pairs)))]
        yield Case("wrong_law", true, law, (), seed + number, **options)
