"""Dependence of a law's parameters on the coil current."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ground_motions.argument_types import checked

from ..errors import InputError, check_name


@checked
@dataclass(frozen=True, eq=False)
class CurrentDependence:
    """Piecewise polynomials of the current, one per parameter.

    Attributes
    ----------
    names : tuple of str
        Parameters, in the order of ``coefficients`` and of the result of ``at``.
    breaks : numpy.ndarray, shape (n_pieces + 1,), A
        Limits of the pieces, increasing, with -inf and inf at the ends. A piece includes its lower
        limit and excludes its upper one.
    coefficients : numpy.ndarray, shape (n_pieces, n_parameters, n_powers)
        Ascending powers of the current itself, in the parameter's SI unit / A^power.

    Raises
    ------
    InputError
        If shapes disagree, a number is not finite, or the breaks do not increase.
    """

    names: tuple[str, ...]
    breaks: np.ndarray
    coefficients: np.ndarray

    def __post_init__(self) -> None:
        names = tuple(self.names)
        breaks = _array("breaks", self.breaks)
        coefficients = _array("coefficients", self.coefficients)
        if len(set(names)) != len(names):
            raise InputError(f"current dependence names a parameter twice: {', '.join(names)}")
        if coefficients.ndim != 3 or coefficients.shape[1] != len(names):
            raise InputError(
                f"current dependence has coefficients of shape {coefficients.shape}; "
                f"expected: (n_pieces, {len(names)} parameters, n_powers)"
            )
        if coefficients.shape[2] == 0:
            raise InputError("current dependence has no coefficients: give at least the constants")
        if breaks.shape != (len(coefficients) + 1,) or not np.all(np.diff(breaks) > 0):
            raise InputError(
                f"current dependence has breaks {breaks.tolist()} A; expected: "
                f"{len(coefficients) + 1} increasing currents"
            )
        if breaks[0] != -np.inf or breaks[-1] != np.inf or not np.all(np.isfinite(breaks[1:-1])):
            raise InputError("current dependence must have breaks from -inf to inf, finite between")
        for name, values in zip(names, np.moveaxis(coefficients, 1, 0), strict=True):
            if not np.all(np.isfinite(values)):
                raise InputError(f"parameter {name!r} has a coefficient that is not finite")
        object.__setattr__(self, "names", names)
        object.__setattr__(self, "breaks", breaks)
        object.__setattr__(self, "coefficients", coefficients)

    @classmethod
    def polynomial(
        cls,
        coefficients: Mapping[str, float | Sequence[float]],
        order: Sequence[str] | None = None,
    ) -> CurrentDependence:
        """One polynomial per parameter, for all currents.

        Parameters
        ----------
        coefficients : mapping of str to float or sequence of float
            Parameter name to ascending powers of the current in A; a number is a constant.
        order : sequence of str, optional
            Order of the parameters; as in ``coefficients`` by default.

        Returns
        -------
        CurrentDependence

        Raises
        ------
        InputError
            If a number is not finite or ``order`` names other parameters.
        """
        names = tuple(coefficients) if order is None else tuple(order)
        _check_names(coefficients, names)
        rows = [_row(name, coefficients[name]) for name in names]
        return cls(names, np.array([-np.inf, np.inf]), _padded(rows)[np.newaxis])

    @classmethod
    def constant(
        cls, values: Mapping[str, float], order: Sequence[str] | None = None
    ) -> CurrentDependence:
        """Parameters that do not depend on the current.

        Parameters
        ----------
        values : mapping of str to float
            Parameter name to value in its SI unit.
        order : sequence of str, optional
            Order of the parameters; as in ``values`` by default.

        Returns
        -------
        CurrentDependence

        Raises
        ------
        InputError
            If a number is not finite or ``order`` names other parameters.
        """
        return cls.polynomial({name: (value,) for name, value in values.items()}, order)

    @classmethod
    def table(
        cls,
        currents: Sequence[float],
        values: Mapping[str, Sequence[float]],
        order: Sequence[str] | None = None,
    ) -> CurrentDependence:
        """Linear interpolation between tabulated currents, constant beyond the ends.

        Parameters
        ----------
        currents : sequence of float, shape (n,), A
            Increasing.
        values : mapping of str to sequence of float, shape (n,)
            Parameter name to its values at ``currents``, in its SI unit.
        order : sequence of str, optional
            Order of the parameters; as in ``values`` by default.

        Returns
        -------
        CurrentDependence

        Raises
        ------
        InputError
            If the currents do not increase, a column has another length or a number is not finite.
        """
        knots = _array("currents", currents)
        names = tuple(values) if order is None else tuple(order)
        _check_names(values, names)
        finite = knots.ndim == 1 and knots.size > 0 and bool(np.all(np.isfinite(knots)))
        if not finite or not np.all(np.diff(knots) > 0):
            raise InputError(f"currents {knots.tolist()} A must be finite and increase")
        coefficients = np.zeros((knots.size + 1, len(names), 2))
        for k, name in enumerate(names):
            column = _row(name, values[name])
            if column.shape != knots.shape:
                raise InputError(
                    f"parameter {name!r} has {column.size} values for {knots.size} currents"
                )
            slope = np.diff(column) / np.diff(knots)
            coefficients[0, k, 0], coefficients[-1, k, 0] = column[0], column[-1]
            coefficients[1:-1, k, 0] = column[:-1] - slope * knots[:-1]
            coefficients[1:-1, k, 1] = slope
        return cls(names, np.concatenate([[-np.inf], knots, [np.inf]]), coefficients)

    @property
    def depends_on_current(self) -> bool:
        """Whether any parameter changes with the current."""
        powers = bool(np.any(self.coefficients[:, :, 1:]))
        return powers or bool(np.any(self.coefficients != self.coefficients[:1]))

    def at(self, current: Any) -> tuple:
        """Parameters at a current.

        Parameters
        ----------
        current : float, numpy.ndarray or casadi.SX, A
            Coil current.

        Returns
        -------
        tuple, one entry per parameter
            Values in SI units, of the type and shape of ``current``.
        """
        pieces = self._rows
        if len(pieces) == 1:
            return tuple([_horner(row, current) for row in pieces[0]])
        inner = self.breaks[1:-1].tolist()
        if isinstance(current, float):
            return tuple([_horner(row, current) for row in pieces[bisect_right(inner, current)]])
        holds = [current < inner[0]]
        holds += [(current >= low) * (current < high) for low, high in pairwise(inner)]
        holds.append(current >= inner[-1])
        return tuple(
            sum(on * _horner(piece[k], current) for on, piece in zip(holds, pieces, strict=True))
            for k in range(len(self.names))
        )

    @cached_property
    def _rows(self) -> list[list[list[float]]]:
        """Coefficients by piece and parameter, without powers above the highest in use."""
        return [[_trimmed(row) for row in piece] for piece in self.coefficients.tolist()]

    def replaced(self, **values: float | Sequence[float]) -> CurrentDependence:
        """Return a copy with some parameters' dependence replaced.

        Parameters
        ----------
        **values : float or sequence of float
            Parameter name to a constant or to ascending powers of the current in A.

        Returns
        -------
        CurrentDependence

        Raises
        ------
        InputError
            If a name is unknown or a number is not finite.
        """
        rows = {}
        for name, value in values.items():
            check_name("parameter", name, self.names)
            rows[name] = _row(name, value)
        n_powers = max([self.coefficients.shape[2], *(row.size for row in rows.values())])
        shape = (*self.coefficients.shape[:2], n_powers)
        coefficients = np.zeros(shape)
        coefficients[:, :, : self.coefficients.shape[2]] = self.coefficients
        for name, row in rows.items():
            k = self.names.index(name)
            coefficients[:, k] = 0.0
            coefficients[:, k, : row.size] = row
        # pieces that have become alike are one
        changes = np.append(True, (np.diff(coefficients, axis=0) != 0).any(axis=(1, 2)))
        breaks = np.append(self.breaks[:-1][changes], self.breaks[-1])
        return CurrentDependence(self.names, breaks, coefficients[changes])

    def ordered(self, names: Sequence[str]) -> CurrentDependence:
        """Return the same dependence with its parameters in another order.

        Parameters
        ----------
        names : sequence of str
            The same parameters in the given order.

        Returns
        -------
        CurrentDependence

        Raises
        ------
        InputError
            If a parameter is missing or unknown.
        """
        if self.names == tuple(names):
            return self
        _check_names(self.names, names)
        order = [self.names.index(name) for name in names]
        return CurrentDependence(tuple(names), self.breaks, self.coefficients[:, order])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, CurrentDependence) and self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())

    def _content(self) -> tuple:
        shape = self.coefficients.shape
        return self.names, shape, self.breaks.tobytes(), self.coefficients.tobytes()


def _trimmed(row: list[float]) -> list[float]:
    used = [k for k, coefficient in enumerate(row) if coefficient != 0.0]
    return row[: max(used, default=0) + 1]


def _horner(row: list[float], current: Any) -> Any:
    # 0 * current keeps the shape of an array; CasADi simplifies it away
    value = row[-1] + 0.0 * current
    for coefficient in row[-2::-1]:
        value = value * current + coefficient
    return value


def _array(what: str, values: Any) -> np.ndarray:
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{what} {values!r} must be numbers") from None
    array.flags.writeable = False
    return array


def _row(name: str, value: Any) -> np.ndarray:
    row = np.atleast_1d(_array(f"parameter {name!r}:", value))
    if row.ndim != 1 or row.size == 0 or not np.all(np.isfinite(row)):
        raise InputError(
            f"parameter {name!r}", repr(value), "a finite number or a sequence of them"
        )
    return row


def _padded(rows: Iterable[np.ndarray]) -> np.ndarray:
    rows = list(rows)
    padded = np.zeros((len(rows), max((row.size for row in rows), default=1)))
    for line, row in zip(padded, rows, strict=True):
        line[: row.size] = row
    return padded


def _check_names(names: Iterable[str], accepted: Sequence[str]) -> None:
    names = list(names)
    for name in names:
        check_name("parameter", name, accepted)
    missing = [name for name in accepted if name not in names]
    if missing:
        raise InputError(f"parameter {missing[0]!r} is missing; needed: {', '.join(accepted)}")
