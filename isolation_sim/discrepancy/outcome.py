"""What a search for effects came to, before it is put into words."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..identification.campaign import Campaign
from .candidates import Fitted
from .evidence import Dependence
from .interference import Interference
from .measured import Measured
from .selection import Search


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the search came to, before it is put into words.

    Attributes
    ----------
    campaign : Campaign
        The runs.
    data : Measured
        All their samples, any interference removed.
    given : (n_samples,) array or None
        Force with the numbers given, N; None where the law was fitted.
    base, final : Fitted
        The law, and the law with the effects found, on all samples.
    search : Search
        What was tried, on a part of the samples.
    evidence : list of Dependence
        What the law's residual depends on.
    disturbance : Interference or None
        Removed from the force.
    floor : float
        RMS of what noise leaves over RMS of the force.
    shifts : (n_examples, 3, n_samples) array
        Noise of the motion; see ``motion_noise``.
    noise_power : (n_samples,) array
        Mean square of the residual over its noise that noise leaves at each sample.
    chosen : (n_samples,) bool array
        Samples on which the outcome is judged.
    notes : list of str
        About the data.
    """

    campaign: Campaign
    data: Measured
    given: NDArray | None
    base: Fitted
    final: Fitted
    search: Search
    evidence: list[Dependence]
    disturbance: Interference | None
    floor: float
    shifts: NDArray
    noise_power: NDArray
    chosen: NDArray
    notes: list[str]

    @cached_property
    def before(self) -> NDArray:
        """Force of the simulation that was judged, N."""
        if self.given is not None:
            return self.data.bounded(self.given)
        return self.data.bounded(self.base.force)

    @cached_property
    def after(self) -> NDArray:
        """Force with all that was found, N."""
        return self.data.bounded(self.final.force)

    def misfit(self, force: NDArray, chosen: NDArray | None = None) -> float:
        """Cost of a force above that of noise; by default where the outcome is judged."""
        chosen = self.chosen if chosen is None else chosen
        return max(self.data.cost(force, chosen) - float(np.sum(self.noise_power[chosen])), 0.0)

    def left(self, chosen: NDArray | None = None) -> float:
        """Part of the misfit that is left after all that was found."""
        before = self.misfit(self.before, chosen)
        return self.misfit(self.after, chosen) / before if before > 0 else 0.0
