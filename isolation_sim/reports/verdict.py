"""The verdict on a comparison: two sentences made from its numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..written_names import as_written, capital
from .units import unit_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ..comparison import Comparison
    from ..simulation.result import Run

_BASE, _FLOOR, _DRIFT = "peak_base_displacement_m", "peak_floor_acceleration_m_s2", "peak_drift_m"
_NOTICED = 0.005
"""Relative changes smaller than this count as no change."""


def verdict(comparison: Comparison) -> tuple[str, str]:
    """Name the controllers that improve every peak, and the smallest displacement and its price."""
    values, reference = comparison.criteria, comparison.reference
    # an optimum that knows the whole motion is a bound and no controller
    values = {name: values[name] for name in values if name not in comparison.optima} or values
    best = min(values, key=lambda name: values[name][_BASE])
    others = [name for name in values if name != reference]
    if reference is None or not others:
        return _peaks(comparison, best)
    return _together(values, reference, others), _gain(values, reference, others)


def unknown_energies(runs: Mapping[str, Run]) -> list[str]:
    """Name the laws whose field work is not known, as they declare no stored energy."""
    laws = {
        element.device.law.title: None
        for run in runs.values()
        for element in run.isolated.elements
        if element.channel is not None
        and element.device.depends_on_current
        and not element.device.stores_energy
    }
    if not laws:
        return []
    return [
        f"The field work of {_join(list(laws))} is not known and counts as 0: "
        f"{'the law declares' if len(laws) == 1 else 'the laws declare'} no stored energy, so that "
        "all work of the isolators counts as dissipated."
    ]


def _gain(values: dict[str, dict[str, float]], reference: str, others: list[str]) -> str:
    best = min(others, key=lambda name: values[name][_BASE])
    before, after = values[reference], values[best]
    if not _change(before[_BASE], after[_BASE]) < -_NOTICED:
        return (
            f"No controller has a smaller peak base displacement than {_noun(reference)}, "
            f"{_quantity(_BASE, before[_BASE])}."
        )
    change = _change(before[_FLOOR], after[_FLOOR])
    joined = "and also lowers" if change < -_NOTICED else "but raises"
    price = (
        f"{joined} the peak floor acceleration from {_quantity(_FLOOR, before[_FLOOR])} to "
        f"{_quantity(_FLOOR, after[_FLOOR])} ({_percent(change)})"
        if abs(change) > _NOTICED
        else f"and leaves the peak floor acceleration at {_quantity(_FLOOR, after[_FLOOR])}"
    )
    return (
        f"{capital(_noun(best))} lowers the peak base displacement most, from "
        f"{_quantity(_BASE, before[_BASE])} to {_quantity(_BASE, after[_BASE])} "
        f"({_percent(_change(before[_BASE], after[_BASE]))}), {price}."
    )


def _together(values: dict[str, dict[str, float]], reference: str, others: list[str]) -> str:
    before, three = values[reference], (_BASE, _FLOOR, _DRIFT)
    changes = {name: [_change(before[key], values[name][key]) for key in three] for name in others}
    better = [name for name in others if max(changes[name]) < -_NOTICED]
    if better:
        best, *rest = sorted(better, key=lambda name: sum(changes[name]))
        base, floor, drift = map(_percent, changes[best])
        also = "so do" if len(rest) > 1 else "so does"
        return (
            f"{capital(_noun(best))} lowers base displacement ({base}), floor acceleration "
            f"({floor}) and storey drift ({drift}) together, compared with {_noun(reference)}"
            + (f"; {also} {_join_names(rest)}." if rest else ".")
        )
    subject = (
        "No controller lowers" if len(others) > 1 else f"{capital(_noun(others[0]))} does not lower"
    )
    none = f"{subject} base displacement, floor acceleration and storey drift together; "
    free = [
        name for name in others if changes[name][0] < -_NOTICED and max(changes[name]) <= _NOTICED
    ]
    if free:
        best = min(free, key=lambda name: changes[name][0])
        base = _percent(changes[best][0])
        return f"{none}{_noun(best)} lowers base displacement ({base}) and raises neither other."
    calm = min(values, key=lambda name: values[name][_FLOOR])
    # controllers that change nothing have the same value as the reference
    if _change(values[reference][_FLOOR], values[calm][_FLOOR]) >= -_NOTICED:
        calm = reference
    return (
        f"{none}the smallest peak floor acceleration, {_quantity(_FLOOR, values[calm][_FLOOR])}, "
        f"is that of {_noun(calm)}."
    )


def _peaks(comparison: Comparison, name: str) -> tuple[str, str]:
    values, energy = comparison.criteria[name], comparison.energy[name]
    alone = "" if len(comparison.runs) == 1 else ", which has the smallest base displacement"
    peaks = (
        f"With {_noun(name)}{alone}, the peaks are {_quantity(_BASE, values[_BASE])} of base "
        f"displacement, {_quantity(_FLOOR, values[_FLOOR])} of floor acceleration and "
        f"{_quantity(_DRIFT, values[_DRIFT])} of storey drift."
    )
    share = energy["device_dissipation_J"] / energy["input_J"] if energy["input_J"] else 0.0
    spent = (
        f"Isolators and other elements dissipated {100 * share:.0f} % of the input energy of "
        f"{_quantity('input_J', energy['input_J'])}; the energy balance closes within "
        f"{energy['closure_error']:.0e} of the peak input."
    )
    return peaks, spent


def _change(before: float, after: float) -> float:
    return after / before - 1 if before else 0.0


def _percent(change: float) -> str:
    return f"{100 * change:+z.0f} %".replace("-", "\N{MINUS SIGN}")


def _quantity(key: str, value: float) -> str:
    unit, factor = unit_of(key)
    number = value * factor
    return f"{number:.0f} {unit}" if abs(number) >= 1000 else f"{number:.3g} {unit}"


def _join_names(names: list[str]) -> str:
    return _join([_noun(name) for name in names])


def _join(nouns: list[str]) -> str:
    *most, last = nouns
    return f"{', '.join(most)} and {last}" if most else last


def _noun(name: str) -> str:
    """Name of a controller within a sentence: its settings stand in brackets."""
    controller, _, settings = as_written(name).partition(", ")
    return f"{controller} ({settings})" if settings else controller
