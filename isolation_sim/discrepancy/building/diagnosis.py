"""Diagnosis of building records: structure and isolation layer judged by what was measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...structures import IsolatedStructure
from ..diagnosis import Cause, Diagnosis, Errors, Step, Verdict
from .checks import record_problems
from .errors import gain_interval, pooled, relative_errors, relative_noise
from .evidence import dependences, depends_on, evidence, intervals, next_test
from .fit import Comparison, compare_records, with_causes
from .model import building_model
from .part import Part
from .record import BuildingRecord
from .selection import MOST_CAUSES, Selection, adequacy, removed_share, select
from .traces import traces

MISFIT_LEVEL = 0.005
"""Chance of calling a model inadequate that is not."""
EXPLAINED = 0.95
"""Share of the misfit whose removal counts as an explanation of the whole."""
_SHOWN = 6


@dataclass(frozen=True, eq=False)
class BuildingDiagnosis(Diagnosis):
    """What the simulation of a building gets wrong, and why.

    Attributes
    ----------
    building : IsolatedStructure or None
        Structure and isolators with the causes in them, to be simulated like the nominal one.
        What is wrong in a sensor, or between a command and the coil, is no part of it.
    """

    building: IsolatedStructure | None = None


def diagnose_building(
    records: BuildingRecord | Sequence[BuildingRecord],
    isolated: IsolatedStructure,
    *,
    most_causes: int = MOST_CAUSES,
    progress: Callable[[str], None] | None = None,
) -> BuildingDiagnosis:
    """Say what the simulation of a building gets wrong, name the causes, measure the gain.

    Parameters
    ----------
    records : BuildingRecord or sequence of BuildingRecord
        One or several earthquakes. Those marked ``hold_out`` judge; without any, the last of
        several does, and of a lone one the time after 60 % of its energy.
    isolated : IsolatedStructure
        The engineer's model: one direction of ground motion, its first element the isolation
        layer. The recorded current, if there is one, is put into its coil.
    most_causes : int
        Where to stop at the latest.
    progress : callable, optional
        Told what is being done.

    Returns
    -------
    BuildingDiagnosis

    Raises
    ------
    InputError
        If the records and the structure do not fit together, or nothing is left to fit.
    """
    given = (records,) if isinstance(records, BuildingRecord) else tuple(records)
    tell = progress or (lambda text: None)
    tell("estimating the noise")
    comparison = compare_records(building_model(isolated, given), given)
    nominal = comparison.judged(())
    shares = dependences(comparison, nominal)
    dependent = depends_on(comparison, nominal, shares)
    selection = select(comparison, most_causes, progress)
    tell("measuring the gain")
    after, before = selection.after, selection.before
    final = selection.comparison
    chance = {
        label: adequacy(final.fitted + final.held_out, outcome.fitted + outcome.held_out)
        for label, outcome in (("before", before), ("after", after))
    }
    removed = removed_share(final.held_out, before.held_out, after.held_out)
    numbers = intervals(after)
    causes = [
        Cause(
            name=cause.name, share=selection.shares[k], p_value=selection.p_values[k],
            parameters=numbers[k], evidence=evidence(selection, k, numbers[k]),
            confusable_with=tuple(t.cause.label for t in selection.rivals[k]), form=cause.form,
        )
        for k, (cause, _) in enumerate(after.found)
    ]  # fmt: skip
    errors = {
        (when, held_out): pooled(relative_errors(final, outcome, held_out))
        for when, outcome in (("before", before), ("after", after))
        for held_out in (False, True)
    }
    model = with_causes(final.model, after.found)
    names = ", ".join(record.name for record in given)
    return BuildingDiagnosis(
        data=names,
        model=f"{isolated.structure.name} on {isolated.elements[0].device.name}",
        verdict=_verdict(bool(causes), chance, removed),
        noise_floor=relative_noise(final),
        error_before=Errors(errors["before", False], errors["before", True]),
        error_after=Errors(errors["after", False], errors["after", True]),
        causes=tuple(sorted(causes, key=lambda cause: -cause.share)),
        unexplained_share=1.0 - removed if chance["before"] < MISFIT_LEVEL else 0.0,
        depends_on=dependent if chance["before"] < MISFIT_LEVEL else (),
        next_test=next_test(selection),
        steps=_steps(comparison, selection, shares, chance),
        extended=model.device if model.effects else None,
        gain=gain_interval(final, before, after) if causes else None,
        traces=traces(final, before, after),
        details={"adequacy_p_value": chance, "expected_model_error": final.model_error},
        building=model.assembled(),
    )


def _verdict(any_causes: bool, chance: dict[str, float], removed: float) -> Verdict:
    if not any_causes:
        return "adequate" if chance["before"] >= MISFIT_LEVEL else "unexplained"
    if chance["after"] >= MISFIT_LEVEL or removed >= EXPLAINED:
        return "explained"
    return "partly_explained"


def _steps(
    first: Comparison,
    selection: Selection,
    shares: list[tuple[str, float, float]],
    chance: dict[str, float],
) -> tuple[Step, ...]:
    steps = [
        _data_step(first),
        _noise_step(selection.comparison),
        Step(
            "Simulation against noise",
            f"Residuals as large as these, in the channel and band where they are largest, have "
            f"the chance {chance['before']:.2g} if there is noise alone.",
        ),
        Step(
            "What the residual depends on",
            "Part of the variance of the isolation layer's residual force that goes with each "
            "variable.",
            ("variable", "share", "p"),
            tuple((name, f"{share:.2f}", f"{p:.1e}") for name, share, p in shares),
        ),
    ]
    for number, trials in enumerate(selection.rounds, start=1):
        taken = number <= len(selection.rivals)
        steps.append(
            Step(
                f"Candidates, round {number}",
                f"{trials[0].cause.label} is best and is taken."
                if taken
                else f"{trials[0].cause.label} is best, and is not taken: its improvement, its "
                "size or its gain on data not fitted does not stand out from chance.",
                ("cause", "form", "mean square of fitted data", "of held-out data", "p"),
                tuple(
                    (
                        t.cause.label, t.cause.form, f"{t.outcome.variance:.3f}",
                        f"{t.outcome.held_out_cost / sum(p.size for p in t.outcome.held_out):.3f}",
                        f"{t.p_value:.1e}",
                    )
                    for t in trials[:_SHOWN]
                ),
            )
        )  # fmt: skip
    steps.append(_remainder_step(selection, chance))
    return tuple(steps)


def _data_step(comparison: Comparison) -> Step:
    rows = tuple(
        (record.name, problem)
        for record in comparison.records
        for problem in record_problems(record)
    )
    text = "Units, clipping, a start at rest, and the displacement against the accelerations: "
    found = "see below." if rows else "nothing amiss."
    return Step("Data", text + found, ("record", "problem"), rows)


def _noise_step(comparison: Comparison) -> Step:
    fitted = ", ".join(_time(part) for part in comparison.fitted)
    held_out = ", ".join(_time(part) for part in comparison.held_out)
    rows = tuple(
        (record.name, channel, f"{own:.2e}", f"{total:.2e}", f"{100 * total / rms:.2g}")
        for record, floor in zip(comparison.records, comparison.floors, strict=True)
        for channel, own, total, rms in zip(
            record.channels, floor.sensors, floor.total,
            np.sqrt(np.mean(record.values**2, axis=0)), strict=True,
        )
    )  # fmt: skip
    ground = ", ".join(f"{floor.ground:.2e}" for floor in comparison.floors)
    return Step(
        "Noise floor",
        f"Seen above {comparison.floors[0].band:.1f} Hz; noise of the measured ground motion "
        f"({ground} m/s2) simulated. Fitted: {fitted}. Held out: {held_out}. Even the best model "
        f"is expected to miss {100 * comparison.model_error:.2g} % of what was measured.",
        ("record", "channel", "sensor", "with the ground's", "% of RMS"),
        rows,
    )


def _time(part: Part) -> str:
    start, stop, _ = part.samples.indices(len(part.record.ground))
    dt = part.record.ground.dt
    return f"{part.record.name}, {start * dt:.1f} to {stop * dt:.1f} s"


def _remainder_step(selection: Selection, chance: dict[str, float]) -> Step:
    final = selection.comparison
    before = relative_errors(final, selection.before, True)
    after = relative_errors(final, selection.after, True)
    channels = final.records[0].channels
    return Step(
        "Gain on data not fitted",
        f"What remains has the chance {chance['after']:.2g} if there is noise alone.",
        ("channel", "error before, %", "after, %"),
        tuple(
            (c, f"{100 * b:.2f}", f"{100 * a:.2f}")
            for c, b, a in zip(channels, before, after, strict=True)
        ),
    )
