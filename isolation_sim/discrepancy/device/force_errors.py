"""Errors of modelled forces: on fitted samples, on those that validate, and beside noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...identification.measured.noise import slow_noise
from ...identification.measured_runs import MeasuredRuns
from ..decisions import ADEQUATE, CHANCE_OF_FEW, LOST, REMAINS, WORSE
from .conditions import conditions


@dataclass(frozen=True, eq=False)
class ForceErrors:
    """How well forces follow a campaign. Every force is of all samples, (n_samples,), N."""

    data: MeasuredRuns  # The campaign
    noise: NDArray  # (n_samples, n_examples): Residuals of noise alone, over the noise
    significance: float  # Share of the force, RMS, below which a difference is negligible

    @cached_property
    def validation_samples(self) -> NDArray:
        """Samples of the evaluation, (n_samples,) bool: those held out, if any."""
        return self.data.fitted if self.data.fitted.all() else ~self.data.fitted

    def relative(self, force: NDArray) -> float:
        """Error on the validation samples, over the force."""
        return self.data.relative(force - self.data.force, self.validation_samples)

    def squared(self, force: NDArray, chosen: NDArray | None = None) -> NDArray:
        """Squared error over that of the force: of all chosen samples, mean over their runs.

        By default these are the validation samples.
        """
        # in the mean a weak run, at small amplitude, counts as much as a strong one
        data, residual = self.data, force - self.data.force
        chosen = self.validation_samples if chosen is None else chosen
        runs = [np.arange(run.start, run.stop)[chosen[run]] for run in data.runs]
        of_runs = [data.relative(residual, at) ** 2 for at in runs if at.size]
        return np.array([data.relative(residual, chosen) ** 2, np.mean(of_runs)])

    def squared_blocks(self, before: NDArray, after: NDArray) -> NDArray:
        """Squared residuals of two forces in quarters of the validation runs, (n_blocks, 2)."""
        data = self.data
        residuals = before - data.force, after - data.force
        pieces = (
            at[self.validation_samples[at]] for run in data.runs
            for at in np.array_split(np.arange(run.start, run.stop), 4)
        )  # fmt: skip
        return np.array([[float(r[at] @ r[at]) for r in residuals] for at in pieces if at.size])

    def misfit(self, force: NDArray, chosen: NDArray | None = None) -> float:
        """Cost above that of noise; by default of the validation samples."""
        chosen = self.validation_samples if chosen is None else chosen
        noise = float(np.sum(np.mean(self.noise**2, axis=1)[chosen]))
        return max(self.data.cost(force, chosen) - noise, 0.0)

    def share_left(self, before: NDArray, after: NDArray, chosen: NDArray | None = None) -> float:
        """Share of the misfit before that is left after; of chosen samples as for ``misfit``."""
        misfit = self.misfit(before, chosen)
        return self.misfit(after, chosen) / misfit if misfit > 0 else 0.0

    def noise_floor(self, chosen: NDArray) -> float:
        """Error that noise alone leaves on chosen samples; not a number where there are none."""
        if not chosen.any():
            return float("nan")
        data = self.data
        force = np.mean(self.noise**2, axis=1)[chosen] / data.weight[chosen] ** 2
        return float(np.sqrt(np.sum(force) / np.sum(data.force[chosen] ** 2)))

    def is_noise(self, force: NDArray, chosen: NDArray) -> bool:
        """Whether a force misses the chosen samples by noise, or by a negligible share of it."""
        if self.is_near_noise(force, chosen, ADEQUATE):
            return True
        error = self.data.relative(self.data.bounded(force) - self.data.force, chosen)
        return bool(error**2 - self.noise_floor(chosen) ** 2 < self.significance**2)

    def is_near_noise(self, force: NDArray, chosen: NDArray, most: float) -> bool:
        """Whether the cost of a force on the chosen samples is within a factor of that of noise."""
        data = self.data
        noise = np.mean(self.noise**2, axis=1)[chosen]
        least = _weighted_squares(data, data.assumed_noise)[chosen]
        # a variance of n samples has a relative deviation of sqrt(2 / n), that of the noise too
        ratio = max(most, 1 + CHANCE_OF_FEW * np.sqrt(4 / max(len(noise), 1)))
        return bool(data.cost(force, chosen) < ratio * max(np.sum(noise), np.sum(least)))

    def beside_its_noise(self, force: NDArray) -> ForceErrors:
        """These, with noise that the force alone does not show, if it is all that a force misses.

        It is behind a low-pass, or grows as 1/f: that of the residual above the motion.
        """
        data, residual = self.data, force - self.data.force
        if data.relative(residual, data.fitted) > REMAINS:
            return self
        slow = np.array([slow_noise(residual[run], data.x[run]) for run in data.runs])
        each = (slow, data.noise_beside(force).deviation)
        rms = next((one for one in each if is_all(data, force, one)), None)
        if rms is None:
            return self
        squares, own = _weighted_squares(data, rms), np.mean(self.noise**2, axis=1)
        ratio = [np.sum(squares[run]) / max(float(np.sum(own[run])), 1e-300) for run in data.runs]
        factor = np.repeat(np.sqrt(np.maximum(ratio, 1.0)), data.lengths)
        return replace(self, noise=self.noise * factor[:, np.newaxis])

    def is_large(self, force: NDArray, chosen: NDArray) -> bool:
        """Whether a force has an error on the chosen samples that another law may explain."""
        error = self.data.relative(force - self.data.force, chosen)
        return error > REMAINS and not self.is_noise(force, chosen)

    def is_worse(self, before: NDArray, after: NDArray) -> bool:
        """Whether the force before is better on held-out runs."""
        # On single runs far better; on all of them, or on those of one condition, beyond a
        # negligible share of the force and beyond noise. In each case by more than a small share of
        # what other runs gain.
        data = self.data
        gained = lost = 0.0
        for run in data.runs:
            if not data.fitted[run].all():
                size = float(np.linalg.norm(data.force[run]))
                error_before, error_after = (
                    float(np.linalg.norm((force - data.force)[run])) / size
                    for force in (before, after)
                )
                gained += max(error_before**2 - error_after**2, 0.0)
                if error_after > max(WORSE * error_before, error_before + self.significance):
                    lost += error_after**2 - error_before**2
        if lost > LOST * gained:
            return True
        held_out = ~data.fitted[data.starts[:-1]]
        if not held_out.any():
            return False
        noise = np.repeat(data.assumed_noise, data.lengths)
        residual = before - data.force
        change = after - before
        decrease = np.add.reduceat(residual**2 - (residual + change) ** 2, data.starts[:-1])
        accepted = LOST * float(np.sum(np.maximum(decrease, 0.0)[held_out]))
        shared = (runs & held_out for _, runs in conditions(data))
        for runs in (held_out, *(runs for runs in shared if np.sum(runs) > 1)):
            at = np.repeat(runs, data.lengths)
            loss = float(np.sum(((residual + change)[at]) ** 2 - residual[at] ** 2))
            negligible = self.significance**2 * float(np.sum(data.force[at] ** 2))
            chance = 2 * float(np.linalg.norm((noise * change)[at]))
            if loss > max(negligible + 2 * chance, accepted):
                return True
        return False


def is_all(data: MeasuredRuns, force: NDArray, noise: NDArray) -> bool:
    """Whether noise of this RMS in each run (N) is all that a force misses where fitted."""
    squares = _weighted_squares(data, noise)
    return bool(data.cost(force, data.fitted) < ADEQUATE * float(np.sum(squares[data.fitted])))


def _weighted_squares(data: MeasuredRuns, noise: NDArray) -> NDArray:
    """Squared noise of each sample, weighted, from its RMS in each run, N."""
    return (np.repeat(noise, data.lengths) * data.weight) ** 2
