"""Force of a device with hidden effects, and the severity that gives an effect a size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from . import effects_added, effects_field, effects_material, outside  # noqa: F401  fill FORMS
from .devices import Device
from .effect import CURRENT, FORCE, FORMS, MATERIAL, SENSOR, Action, Form, RunContext
from .motion import RATE, Motion

HEATING_SWEEPS = 6
"""Passes over a run where softening follows the dissipated power, which follows the softening."""


@dataclass(frozen=True)
class Hidden:
    """One effect as hidden in a device; ``action`` holds the perturbed shape."""

    form: Form
    action: Action
    severity: float = 0.0

    @classmethod
    def draw(cls, effect: str, rng: np.random.Generator, form: str | None = None) -> Hidden:
        """A form of the effect, a random one unless named, with its shape perturbed."""
        forms = FORMS[effect]
        chosen = forms[form if form is not None else str(rng.choice(sorted(forms)))]
        return cls(chosen, chosen.build(rng))

    def __call__(self, context: RunContext):
        """Apply the effect."""
        return self.action(self.severity, context)


def respond(device: Device, motion: Motion, hidden: Sequence[Hidden] = ()) -> np.ndarray:
    """Noise-free force on the motion's grid, N."""
    active = [h for h in hidden if h.severity != 0.0]
    nothing = np.zeros(motion.time.size)
    now = RunContext(motion, motion.current, nothing, nothing)
    for h in active:
        if h.form.stage == CURRENT:
            now = replace(now, current=h(now))
    material = [h for h in active if h.form.stage == MATERIAL]
    for _ in range(HEATING_SWEEPS if any(h.form.heats for h in material) else 1):
        stiffness, loss = 1.0, 1.0
        for h in material:
            factors = h(now)
            of_stiffness, of_loss = factors if isinstance(factors, tuple) else (factors, factors)
            stiffness, loss = stiffness * of_stiffness, loss * of_loss
        force, power = device.respond(motion, now.current, stiffness, loss)
        now = replace(now, force=force, power=power)
    added = sum((h(now) for h in active if h.form.stage == FORCE), nothing)
    now = replace(now, force=now.force + added)
    for h in active:
        if h.form.stage == SENSOR:
            now = replace(now, force=h(now))
    return now.force


@dataclass(frozen=True)
class Gauge:
    """Measures what an effect does to a device in a programme, on a coarse grid.

    ``change`` is the RMS of the force's change over the RMS of the clean force, pooled over runs.
    ``visible`` is the part of it left after the law's own coefficients, quadratic in the current,
    have taken up what they can to first order: what a fit of the law without the effect would
    leave. The size of a case is the visible part, for the rest is beyond any diagnosis.
    """

    device: Device
    motions: tuple[Motion, ...]
    before: tuple[Hidden, ...] = ()

    def force(self, device: Device, hidden: Sequence[Hidden] = ()) -> np.ndarray:
        """Forces of all runs at the campaign's rate, end to end."""
        every = round(1 / (RATE * self.motions[0].step))
        return np.concatenate([respond(device, m, hidden)[::every] for m in self.motions])

    @cached_property
    def clean(self) -> np.ndarray:
        """Force without noise, N."""
        return self.force(self.device, self.before)

    @cached_property
    def reach(self) -> np.ndarray:
        """Orthonormal columns: what the law's coefficients can do to the force."""
        columns = []
        for name, row in self.device.coefficients.items():
            if name == "v_s":
                continue
            scale = max(abs(c) for c in row) or 1.0
            for power in range(3):
                change = 1e-4 * scale / 3.0**power
                up = self.force(self.device.shifted(name, power, change), self.before)
                columns.append(up - self.clean)
        matrix = np.stack(columns, axis=1)
        left, sizes, _ = np.linalg.svd(matrix / np.linalg.norm(matrix, axis=0), full_matrices=False)
        return left[:, sizes > 1e-7 * sizes[0]]

    def change(self, hidden: Hidden) -> float:
        """RMS change of the force over its RMS."""
        return self._share(self._difference(hidden))

    def visible(self, hidden: Hidden) -> float:
        """The part of ``change`` beyond the law's own reach."""
        difference = self._difference(hidden)
        return self._share(difference - self.reach @ (self.reach.T @ difference))

    def largest(self, hidden: Hidden) -> float:
        """Visible part at the form's limit; infinite where it has none."""
        limit = hidden.form.limit
        return self.visible(replace(hidden, severity=limit)) if np.isfinite(limit) else np.inf

    def at_size(self, hidden: Hidden, size: float) -> Hidden:
        """The effect with the severity that makes its visible part ``size``.

        Raises ``Unreachable`` where no severity within the form's limit does.
        """

        def excess(logarithm: float) -> float:
            return self.visible(replace(hidden, severity=float(np.exp(logarithm)))) / size - 1

        end = np.log(min(hidden.form.limit, 1e4))
        low = high = np.log(1e-5)
        while excess(high) < 0:
            if high == end:
                raise Unreachable(f"{hidden.form.effect} ({hidden.form.name}) has no size {size}")
            low, high = high, min(high + 1.0, end)
        return replace(hidden, severity=float(np.exp(brentq(excess, low, high, xtol=1e-3))))

    def _difference(self, hidden: Hidden) -> np.ndarray:
        return self.force(self.device, (*self.before, hidden)) - self.clean

    def _share(self, difference: np.ndarray) -> float:
        return float(np.linalg.norm(difference) / np.linalg.norm(self.clean))


class Unreachable(ValueError):
    """No severity of this effect changes the force of this device visibly enough."""
