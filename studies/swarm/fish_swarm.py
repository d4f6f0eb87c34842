"""Artificial fish swarm: fish that follow, gather and forage within their sight.

The classical method, with constant sight and step, which Yu et al. compare with: quick at first and
then stuck, since its step never falls.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from isolation_sim.errors import InputError

from .budget import Budget


def fish_swarm(
    evaluate: Budget,
    rng: np.random.Generator,
    population: int = 50,
    sight: float = 0.3,
    step: float = 0.1,
    crowding: float = 0.6,
    tries: int = 5,
) -> None:
    """Search until the budget is spent."""
    good = population >= 2 and tries >= 1 and sight > 0 and step > 0 and 0 < crowding <= 1
    if not good:
        raise InputError(
            f"population {population!r}, sight {sight!r}, step {step!r}, crowding {crowding!r}, "
            f"tries {tries!r}; expected: 2 fish or more, positive numbers, crowding up to 1"
        )
    lower, upper = evaluate.lower, evaluate.upper
    n = lower.size
    diagonal = np.sqrt(n)  # of the unit cube, in which the fish swim

    def smell(place: np.ndarray) -> float:
        return float(evaluate(lower + place * (upper - lower)))

    def towards(place: np.ndarray, goal: np.ndarray) -> np.ndarray:
        way = goal - place
        length = np.linalg.norm(way)
        if length == 0:
            return place
        move = min(rng.uniform() * step * diagonal, length)
        return np.clip(place + way * (move / length), 0.0, 1.0)

    fish = rng.uniform(size=(population, n))
    food = np.array([smell(place) for place in fish])
    while True:
        for k in range(population):
            place = fish[k]
            near = np.linalg.norm(fish - place, axis=1) < sight * diagonal
            near[k] = False
            moved = None
            if near.any() and near.sum() < crowding * population:
                others = np.flatnonzero(near)
                leader = others[np.argmin(food[others])]
                if food[leader] < food[k]:
                    moved = towards(place, fish[leader])
                else:
                    middle = fish[others].mean(axis=0)
                    if smell(middle) < food[k]:
                        moved = towards(place, middle)
            if moved is None:
                moved = _forage(place, food[k], smell, towards, sight, tries, rng)
            value = smell(moved)
            # the best fish stays where it is unless it finds better: nothing found is lost
            if value < food[k] or k != np.argmin(food):
                fish[k], food[k] = moved, value


def _forage(
    place: np.ndarray,
    value: float,
    smell: Callable[[np.ndarray], float],
    towards: Callable[[np.ndarray, np.ndarray], np.ndarray],
    sight: float,
    tries: int,
    rng: np.random.Generator,
) -> np.ndarray:
    """Move towards the first better place of a few tried within sight, or at random."""
    looked = place
    for _ in range(tries):
        looked = np.clip(place + sight * rng.uniform(-1.0, 1.0, place.size), 0.0, 1.0)
        if smell(looked) < value:
            break
    return towards(place, looked)
