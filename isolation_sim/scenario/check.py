"""The ``[check]`` section: settings of ``isolation-sim check``."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from ground_motions import STANDARD_GRAVITY

from ..code_check import CheckSettings
from ..validation import NonNegative, Positive, Section

if TYPE_CHECKING:
    from ground_motions import Record

    from ..simulation.result import Run
    from ..structures import IsolatedStructure
    from .job import Job

_Parameters = Annotated[dict[str, Positive], Field(min_length=1)]


class Check(Section):
    """Code checks of an isolated building."""

    S_M1_g: Annotated[
        Positive, Field(description="spectral acceleration at 1 s, maximum considered earthquake")
    ]
    upper_factors: Annotated[
        Annotated[Positive, Field(ge=1)] | _Parameters,
        Field(description="on the isolators' force, or { parameter = factor }"),
    ] = 1.3
    lower_factors: Annotated[
        Annotated[Positive, Field(le=1)] | _Parameters,
        Field(description="on the isolators' force, or { parameter = factor }"),
    ] = 0.85
    displacement_capacity_m: Annotated[
        Positive | None, Field(description="of the isolators; the moat wall's gap if left out")
    ] = None
    quiet_after_s: Annotated[
        NonNegative, Field(description="still ground before the residual displacement is read")
    ] = 20.0

    def settings(self, gap: float | None) -> CheckSettings:
        """Return the settings; ``gap`` of a moat wall, m."""
        capacity = self.displacement_capacity_m
        return CheckSettings(
            self.S_M1_g * STANDARD_GRAVITY,
            self.upper_factors,
            self.lower_factors,
            gap if capacity is None else capacity,
            self.quiet_after_s,
        )


def simulator(job: Job) -> Callable[..., Run]:
    """Return a function that runs a plant under a motion with a controller."""
    from ..simulation.run import simulate

    # controllers use the nominal properties for every plant
    options = {"nominal": job.isolated, **job.options}

    def run(plant: IsolatedStructure, records: tuple[Record, ...], controller: Any) -> Run:
        return simulate(plant, records, controller, **options)

    return run
