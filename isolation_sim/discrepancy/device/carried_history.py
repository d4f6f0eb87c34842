"""Effects of a device that keeps its history from run to run, as one specimen in a test series.

An effect of the catalogue begins each run on a fresh device. Here its state begins where the
earlier runs have left it, held-out runs included, in the order in which the campaign lists them.
Only states that follow from the measured motion, current and force can begin so. A state that
recovers in rests of unknown length begins between zero and the end of the run before, where the
run's own forces are best met.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...effects import Effect, Past
from ...identification.measured_runs import MeasuredRuns
from .acting_order import ActsFirst, acting_order

P = TypeVar("P")

DAMAGE = frozenset({"stress_softening", "cyclic_degradation"})
"""Causes from which a specimen does not recover between runs."""


@dataclass(frozen=True, eq=False)
class CarriedHistory(Effect):
    """A form of an effect of the catalogue whose state goes on from run to run."""

    fresh: Effect | None = None  # The form that begins on a fresh device


@lru_cache(maxsize=64)
def carry_history(effect: Effect) -> CarriedHistory:
    """An effect whose state goes on from run to run."""
    same = {one.name: getattr(effect, one.name) for one in fields(Effect)}
    form, title = f"{effect.form}, kept", f"{effect.title}, kept from run to run"
    return CarriedHistory(**{**same, "form": form, "title": title}, fresh=effect)


def keeps_history(effect: Effect) -> bool:
    """Whether an effect's state goes on from run to run."""
    return isinstance(effect, CarriedHistory)


def has_unknown_starts(effect: Effect) -> bool:
    """Whether an effect's state at the start of each run is fitted to the run."""
    return keeps_history(effect) and effect.recovery is not None


def needs_new_specimens(effect: Effect) -> bool:
    """Whether an effect is a damage that each run begins without."""
    return effect.cause in DAMAGE and not keeps_history(effect)


def is_kept_damage(effect: Effect) -> bool:
    """Whether an effect is a damage that goes on from run to run, without recovery."""
    return effect.cause in DAMAGE and keeps_history(effect) and not has_unknown_starts(effect)


def can_carry_history(effect: Effect) -> bool:
    """Whether an effect's states follow from the measured history of a device."""
    return effect.carried is not None


def of_device(effect: Effect) -> Effect:
    """The effect of the catalogue, for a device that is fresh when a simulation begins."""
    if isinstance(effect, ActsFirst) and effect.form_behind:
        return effect.form_behind
    return effect.fresh if isinstance(effect, CarriedHistory) and effect.fresh else effect


def of_device_in_order(
    effects: Sequence[Effect], parameters: Sequence[P]
) -> list[tuple[Effect, P]]:
    """The same of effects with their parameters, in the order in which they act."""
    return [(of_device(effects[k]), parameters[k]) for k in acting_order(effects)]


def first_states(
    effect: Effect, data: MeasuredRuns, first: NDArray, p: NDArray, slope: NDArray | None = None,
    own: int = 0,
) -> tuple[NDArray, NDArray | None]:  # fmt: skip
    """States at the start of each run, (n_runs, n_states), from those of a fresh device."""
    # ``slope``: their derivatives, (n_runs, n_states, n_directions), in directions of which those
    # from ``own`` on are the effect's parameters
    if not keeps_history(effect) or effect.carried is None or data.past is None:
        return first, slope
    carried = np.column_stack(effect.carried(data.past, tuple(p)))
    if slope is not None:
        slope = slope.copy()
        for run, state in np.argwhere(carried > first):
            past = Past(*(float(one[run]) for one in data.past))
            slope[run, state] = 0.0
            slope[run, state, own : own + len(p)] = _by_parameters(effect.carried, past, p)[state]
    return np.maximum(first, carried), slope


class Weakened(NamedTuple):
    """The force under an effect whose state h leaves exp(-h) of it, or of a part; (n_samples,)."""

    force: NDArray  # N
    weak: NDArray  # Of the part that the effect weakens, what is left of it, N
    left: NDArray  # The same over that part; not a number where that is small


class WeakenedSlopes(NamedTuple):
    """Derivatives that ``after_rests`` needs, in directions that include the parameters."""

    # of ``Weakened``, (n_samples, n_directions)
    force: NDArray  # N over the unit of a direction
    weak: NDArray  # The same
    left: NDArray  # 1 over that unit
    first: NDArray  # (n_runs, 1, n_directions), of the states at the start
    own: int  # First direction that is a parameter of the effect


def after_rests(
    effect: Effect, data: MeasuredRuns, now: Weakened, first: NDArray, p: NDArray,
    by: WeakenedSlopes | None = None,
) -> tuple[NDArray, NDArray | None]:  # fmt: skip
    """Move the states at the start of each run, (n_runs, 1), by a step to the forces of the run."""
    # ``now``: the force with those that begin with ``first``. Returned are the states, and their
    # derivatives if those of the others are given.
    assert effect.carried is not None and effect.recovery is not None and data.past is not None
    time = effect.recovery(tuple(p))
    before = effect.carried(data.past, tuple(p))[0]  # each run, without recovery
    result, most, so_far = np.zeros_like(first), 0.0, 0.0
    slopes = None if by is None else np.zeros_like(by.first)
    by_most = by_so_far = np.zeros(0 if by is None else by.first.shape[2])
    for k, run in enumerate(data.runs):
        # runs that are left out here were made all the same
        added = float(before[k]) - so_far
        most += max(added, 0.0)
        weak, left = now.weak[run], now.left[run]
        seconds = np.arange(len(weak)) * data.dt[k]
        fading = np.exp(-seconds / time)
        slope, misfit = weak * fading, now.force[run] - data.force[run]
        size = max(slope @ slope, 1e-300)
        step = misfit @ slope / size
        moved = float(first[k, 0] + step)
        result[k] = np.clip(moved, 0.0, most)
        known = np.flatnonzero(np.isfinite(left))
        end = int(known[-1]) if known.size else -1  # none where the law diverges
        heat = -float(np.log(max(left[end], 1e-300)))
        own = Past(0.0, 0.0, 0.0, 0.0, data.force[run] @ data.v[run] * data.dt[k], 0.0)
        if by is not None and slopes is not None:
            places = slice(by.own, by.own + len(p))
            of_time, of_before, of_own = np.zeros((3, len(by_most)))
            past = Past(*(float(one[k]) for one in data.past))
            of_time[places] = _by_parameters(effect.recovery, p)[0]
            of_before[places] = _by_parameters(effect.carried, past, p)[0]
            of_own[places] = _by_parameters(effect.carried, own, p)[0]
            if added > 0:
                by_most = by_most + of_before - by_so_far
            if moved > most:
                slopes[k, 0] = by_most
            elif moved >= 0:
                by_time = (misfit * slope - 2 * step * slope**2) @ seconds / (size * time**2)
                slopes[k, 0] = by.first[k, 0] + by_time * of_time
                slopes[k, 0] += slope / size @ by.force[run]
                slopes[k, 0] += fading * (misfit - 2 * step * slope) / size @ by.weak[run]
            ending = by.left[run][end] / left[end]
            by_most, by_so_far = (-ending if heat > 0 else 0.0 * ending), of_before + of_own
        most = max(heat, 0.0)
        so_far = float(before[k] + effect.carried(own, tuple(p))[0])
    return result, slopes


def _by_parameters(function: Callable[..., Any], *arguments: Any) -> NDArray:
    """Derivatives of what a function of an effect returns by its parameters, its last argument."""
    return by_inputs(function, *arguments)[:, -len(arguments[-1]) :]


def by_inputs(function: Callable[..., Any], *arguments: Any) -> NDArray:
    """Derivatives of what a function of an effect returns by all inputs, (n_results, n_inputs)."""
    kinds = tuple((type(one) if hasattr(one, "_fields") else tuple, len(one)) for one in arguments)
    numbers = np.concatenate([np.asarray(one, float) for one in arguments])
    return np.array(_jacobian(function, kinds)(numbers))


@lru_cache(maxsize=64)
def _jacobian(function: Callable[..., Any], kinds: tuple[tuple[Any, int], ...]) -> Any:
    """CasADi's function for these derivatives; an argument is a named tuple or a plain one."""
    import casadi

    inputs = casadi.SX.sym("inputs", sum(n for _, n in kinds))
    arguments, at = [], 0
    for kind, n in kinds:
        symbols = casadi.vertsplit(inputs)[at : at + n]
        arguments.append(tuple(symbols) if kind is tuple else kind(*symbols))
        at += n
    result = function(*arguments)
    rows = casadi.vertcat(*(result if isinstance(result, tuple) else (result,)))
    return casadi.Function("slopes", [inputs], [casadi.jacobian(casadi.SX(rows), inputs)])
