"""Cost of a wrong law: a building controlled with the old and with the extended law.

Every controller is run three times: as the evaluated law predicts it; as it then turns out,
on the extended law but designed with the old one; and designed with the extended law.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ground_motions import Record

from ..comparison import UNCONTROLLED
from ..criteria import criteria
from ..errors import Diverged, InputError
from ..simulation.control import Control, RunContext
from ..simulation.result import Run
from ..simulation.run import simulate
from ..structures import IsolatedStructure
from ..written_names import as_written

CASES = {
    "predicted": "plant and nominal model by the evaluated law",
    "actual": "plant by the extended law, nominal model by the evaluated law",
    "redesigned": "plant and controllers' nominal model by the extended law",
}
"""How each controller is run."""
SUBJECTS = {
    "law": ("evaluated law", "extended law"),
    "model": ("original model", "corrected model"),
}
"""Names of what was wrong, and of what is right: a device's law, or the model of a building."""

DIGITS = 3
"""After the point, of J: controllers that are alike in these share a rank."""

_BASE, _FLOOR = "normalised_peak_base_displacement", "normalised_peak_floor_acceleration"


@dataclass(frozen=True)
class Performance:
    """Result of a run."""

    # peak_base_displacement_m, peak_floor_acceleration_m_s2: As in ``isolation_sim.criteria``
    peak_base_displacement_m: float
    peak_floor_acceleration_m_s2: float
    J: float  # Sum of both peaks, each over that with the coils off on the same plant
    rank: int  # Place among the controllers by ``J``, 1 the best


@dataclass(frozen=True)
class Consequence:
    """Consequence of a law's or a model's error for a controlled building."""

    scenario: str  # Building and ground motion
    scaling: str  # How the tested device was scaled to the building; empty where it was not
    # What the numbers say; why there are none where the device cannot carry a building
    finding: str
    # By controller and by case of ``CASES``; None for a run that diverged
    performance: Mapping[str, Mapping[str, Performance | None]]
    warnings: tuple[str, ...] = ()  # Runs that went further than the device was tested
    subject: str = "law"  # What was wrong, of ``SUBJECTS``

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain numbers and text."""
        return {
            "scenario": self.scenario,
            "scaling": self.scaling,
            "finding": self.finding,
            "warnings": list(self.warnings),
            "controllers": {
                name: {case: vars(one) if one else None for case, one in cases.items()}
                for name, cases in self.performance.items()
            },
        }


class _AsDesigned:
    """A controller that stays prepared for the plant of its first run."""

    def __init__(self, control: Control):
        self._control = control

    def __getattr__(self, name: str) -> Any:
        return getattr(self._control, name)

    def prepare(self, context: RunContext, trial: Any) -> None:
        """Keep the preparation of the first run."""


def consequence(
    before: IsolatedStructure,
    after: IsolatedStructure,
    ground: Record | Sequence[Record],
    controllers: Mapping[str, Control],
    *,
    options: Mapping[str, Any] | None = None,
    scaling: str = "",
    subject: str = "law",
    progress: Callable[[str], None] | None = None,
) -> Consequence:
    """Run controllers on a building as it was simulated and as it is."""
    if UNCONTROLLED not in controllers:
        expected = f"{UNCONTROLLED} among them, which J refers to"
        raise InputError("controllers", ", ".join(controllers), expected)
    tell = progress or (lambda what: None)
    runs: dict[str, dict[str, Run | None]] = {case: {} for case in CASES}
    refused: dict[tuple[str, str], str] = {}
    for name, control in controllers.items():
        # in this order: what is learnt on the old plant is used on the new one
        for case, plant, nominal, one in (
            ("predicted", before, before, control),
            ("actual", after, before, _AsDesigned(control)),
            ("redesigned", after, after, control),
        ):
            tell(f"{name}, {case}")
            try:
                run = simulate(plant, ground, one, **{**(options or {}), "nominal": nominal})
            except Diverged:
                run = None
            except InputError as error:
                run, refused[name, case] = None, str(error)
            runs[case][name] = run
    ranked = {case: _ranked(of_case) for case, of_case in runs.items()}
    performance = {name: {case: ranked[case][name] for case in CASES} for name in controllers}
    records = (ground,) if isinstance(ground, Record) else tuple(ground)
    return Consequence(
        scenario=f"{before.structure.name}, {', '.join(record.name for record in records)}",
        scaling=scaling,
        finding=_finding(performance, refused, subject),
        performance=performance,
        warnings=tuple(_beyond(runs, subject)),
        subject=subject,
    )


def _ranked(runs: Mapping[str, Run | None]) -> dict[str, Performance | None]:
    ranked: dict[str, Performance | None] = dict.fromkeys(runs)
    off = runs[UNCONTROLLED]
    if off is None:
        return ranked
    numbers = {name: criteria(run, off) for name, run in runs.items() if run is not None}
    scores = {name: round(n[_BASE] + n[_FLOOR], DIGITS) for name, n in numbers.items()}
    for name, result in numbers.items():
        ranked[name] = Performance(
            peak_base_displacement_m=result["peak_base_displacement_m"],
            peak_floor_acceleration_m_s2=result["peak_floor_acceleration_m_s2"],
            J=scores[name],
            rank=1 + sum(score < scores[name] for score in scores.values()),
        )
    return ranked


def _beyond(runs: Mapping[str, Mapping[str, Run | None]], subject: str) -> list[str]:
    """Say which runs deform the device further than it was tested."""
    old, new = SUBJECTS[subject]
    where = {
        "predicted": f"By the {old}",
        "actual": f"By the {new}",
        "redesigned": f"Under controllers designed with the {new}",
    }
    sentences = []
    for case, of_case in runs.items():
        peaks = {}
        for name, run in of_case.items():
            if run is None:
                continue
            element = run.isolated.elements[0]
            tested = element.device.length * element.device.tested_deformation
            peak = float(np.abs(run.output(f"{element.name}_deformation_m")).max())
            if peak > tested:
                peaks[name] = peak / tested
        if peaks:
            how = ", ".join(
                f"{as_written(name)} {ratio:.2f} times" for name, ratio in peaks.items()
            )
            sentences.append(f"{where[case]} the device deforms further than it was tested: {how}.")
    return sentences


def _finding(
    performance: Mapping[str, Mapping[str, Performance | None]],
    refused: Mapping[tuple[str, str], str],
    subject: str,
) -> str:
    old, new = SUBJECTS[subject]
    failed = [
        f"{as_written(name)}, {case}"
        for name, cases in performance.items()
        for case, one in cases.items()
        if one is None and (name, case) not in refused
    ]
    known = {
        name: (predicted, actual, redesigned)
        for name, cases in performance.items()
        if (predicted := cases["predicted"])
        and (actual := cases["actual"])
        and (redesigned := cases["redesigned"])
    }
    sentences = [f"The response diverges: {'; '.join(failed)}."] if failed else []
    sentences += [
        f"Not run: {as_written(name)}, {case} ({reason})."
        for (name, case), reason in refused.items()
    ]
    if not known:
        return " ".join(sentences)
    sentences.append(
        f"The {old} misses the peak base displacement by "
        f"{_range(known, 'peak_base_displacement_m')} and the peak floor acceleration by "
        f"{_range(known, 'peak_floor_acceleration_m_s2')}."
    )
    if len(known) > 1:
        sentences += [_choice(known), *_redesign(known, new)]
    return " ".join(sentences)


_Known = Mapping[str, tuple[Performance, Performance, Performance]]


def _range(known: _Known, quantity: str) -> str:
    errors = [
        100 * (getattr(predicted, quantity) / getattr(actual, quantity) - 1)
        for predicted, actual, _ in known.values()
    ]
    low, high = f"{min(errors):+z.0f}", f"{max(errors):+z.0f}"
    return f"{low} %" if low == high else f"{low} to {high} %"


def _choice(known: _Known) -> str:
    """Name the controller that the old model would have selected, and the cost of this choice."""
    first = min(known, key=lambda name: known[name][0].J)
    second = min(known, key=lambda name: known[name][1].J)
    chosen, best = as_written(first), as_written(second)
    same = all(predicted.rank == actual.rank for predicted, actual, _ in known.values())
    if same:
        return f"It ranks the controllers as they are, {chosen} first."
    hoped, got, possible = known[first][0].J, known[first][1].J, known[second][1].J
    if got == possible:
        return f"It finds the best controller, {chosen}, but not the order of the others."
    return (
        f"It chooses {chosen} for a J of {hoped:.2f} that turns out to be {got:.2f}; {best} has "
        f"{possible:.2f}: the wrong choice costs {100 * (got / possible - 1):.0f} %."
    )


def _redesign(known: _Known, new: str) -> list[str]:
    """Say whom the new law or model helps most."""
    changes = {name: after.J / before.J - 1 for name, (_, before, after) in known.items()}
    most = max(changes, key=lambda name: abs(changes[name]))
    if abs(changes[most]) < 0.005:
        return [f"Designing the controllers with the {new} changes nothing."]
    _, before, after = known[most]
    return [
        f"Designing with the {new} changes {as_written(most)} most: J goes from "
        f"{before.J:.3f} to {after.J:.3f}."
    ]
