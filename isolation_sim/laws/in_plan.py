"""Laws in two horizontal directions: vectors, and conversion between the forms of a law."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .law import InPlan, no_rates

# keeps 0^(n - 2) and the derivative of a length at 0 finite; changes no length above 1e-148
_TINY = 1e-300


def length(x: Any, y: Any) -> Any:
    """Length of a vector, with a finite derivative at zero."""
    return np.sqrt(x * x + y * y + _TINY)


def power_of_length(x: Any, y: Any, n: Any) -> Any:
    """Length of a vector to the power n, with finite derivatives at zero."""
    return np.exp(n / 2 * np.log(x * x + y * y + _TINY))


def each_direction(
    force: Callable,
    rates: Callable = no_rates,
    stored_energy: Callable | None = None,
    n_states: int = 0,
) -> InPlan:
    """In-plan form of a linear law: x and y by themselves."""
    n = n_states

    def both_forces(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
        first = force(x[0], v[0], states[:n], parameters)
        return first, force(x[1], v[1], states[n:], parameters)

    def both_rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
        first = rates(x[0], v[0], states[:n], parameters)
        return *first, *rates(x[1], v[1], states[n:], parameters)

    def both_energies(x: Any, states: tuple, parameters: tuple) -> Any:
        assert stored_energy is not None
        first = stored_energy(x[0], states[:n], parameters)
        return first + stored_energy(x[1], states[n:], parameters)

    return InPlan(both_forces, both_rates, both_energies if stored_energy else None)


def along_a_line(form: InPlan, n_states: int) -> dict[str, Any]:
    """Functions of a law along one line, from those in plan with nothing across."""
    across = (0.0,) * n_states

    def force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:
        return form.force((x, 0.0), (v, 0.0), (*states, *across), parameters)[0]

    def rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:
        both = form.rates((x, 0.0), (v, 0.0), (*states, *across), parameters)
        return tuple(both[:n_states])

    def stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:
        assert form.stored_energy is not None
        return form.stored_energy((x, 0.0), (*states, *across), parameters)

    functions: dict[str, Any] = {"force": force, "rates": rates}
    return functions | ({"stored_energy": stored_energy} if form.stored_energy else {})
