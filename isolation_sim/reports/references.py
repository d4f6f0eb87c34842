"""References of the methods behind a result, to cite beside the software.

Laws, parameter sets, controllers and records have a short ``source``. ``publications.py`` has the
full references of the short names. A source that it does not know is printed unchanged.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

from ..effects.extend import separate
from .publications import PUBLICATIONS

if TYPE_CHECKING:
    from ground_motions import Record

    from ..laws import Device
    from ..scenario import Scenario
    from ..simulation.result import Run
    from ..structures import IsolatedStructure

ENGINE = (
    ("time integration (exponential collocation)", "Hochbruck and Ostermann 2005"),
    ("energy ledger (relative energies)", "Uang and Bertero 1990"),
    ("derivatives and code of the laws", "Andersson et al. 2019; Lam et al. 2015"),
    ("criteria J1 to J9", "Narasimhan et al. 2006"),
)
"""Methods of every run, and their sources."""


class Citation(NamedTuple):
    """A publication and its uses."""

    text: str  # The publication
    uses: tuple[str, ...]  # Methods, parameters or records from it

    @property
    def line(self) -> str:
        """Publication and uses in one line."""
        return f"{self.text.rstrip('.')}. Used for: {', '.join(self.uses)}."


def of_scenarios(scenarios: Iterable[Scenario]) -> list[Citation]:
    """References of scenarios."""
    used: list[tuple[str, str]] = []
    for scenario in scenarios:
        job = scenario.build()
        sources = {label: getattr(each, "source", "") for label, each in job.controllers.items()}
        used += _sources(job.isolated, job.records, sources)
    return citations(used)


def of_runs(runs: Mapping[str, Run]) -> list[Citation]:
    """References of runs."""
    first = next(iter(runs.values()))
    sources = {label: run.source for label, run in runs.items()}
    return citations(_sources(first.isolated, first.records, sources))


def of_device(device: Device) -> list[Citation]:
    """References of a device's law and effects, for fits and diagnoses."""
    base, applied = separate(device)
    used = [(f"law {base.law.name}", base.law.source)]
    used += [(f"effect {effect.cause}", effect.source) for effect, _ in applied]
    return citations(used)


def citations(used: Iterable[tuple[str, str]]) -> list[Citation]:
    """Look up publications."""
    uses: dict[str, list[str]] = {}
    for what, source in used:
        texts = [text for name, text in PUBLICATIONS.items() if name in source]
        for text in texts or ([source] if source else []):
            uses.setdefault(text, [])
            if what not in uses[text]:
                uses[text].append(what)
    return [Citation(text, tuple(names)) for text, names in uses.items()]


def _sources(
    isolated: IsolatedStructure, records: Iterable[Record], controllers: Mapping[str, str]
) -> Iterator[tuple[str, str]]:
    for element in isolated.elements:
        law = element.device.law
        yield f"law {law.name}", law.source
        yield f"parameters of {element.name}", element.device.source
    for record in records:
        yield f"ground motion {record.name}", record.source
    for label, source in controllers.items():
        yield f"controller {label}", source
    yield from ENGINE
