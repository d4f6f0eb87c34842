"""Declared settings of controllers, with their meaning and expected values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from ground_motions.argument_types import checked
from isolation_sim.errors import InputError
from isolation_sim.search_range import SearchRange


@dataclass(frozen=True)
class Number:
    """Accepts numbers."""

    at_least: float = -np.inf  # Lowest number accepted
    above: float = -np.inf  # Number above which all are accepted; -inf for no such bound
    infinite: bool = False  # Whether infinity is accepted

    kind = float
    """Type of the expected values."""

    def __call__(self, value: Any) -> float:
        """Return the number, or raise ValueError or TypeError."""
        if isinstance(value, (str, bool)):
            raise TypeError(value)
        number = float(value)
        bounded = number >= self.at_least and (number > self.above or self.above == -np.inf)
        if not bounded or not (np.isfinite(number) or (self.infinite and number == np.inf)):
            raise ValueError(value)
        return number

    def __str__(self) -> str:
        if self.above > -np.inf:
            text = f"a number above {self.above:g}"
        elif self.at_least > -np.inf:
            text = f"a number, {self.at_least:g} or more"
        else:
            text = "a number"
        return text + (" or inf" if self.infinite else "")


@dataclass(frozen=True)
class Setting:
    """One setting of a controller."""

    default: Any  # Value where none is given
    meaning: str  # Short description
    # Turns a given value into the one to use, or raises ValueError; printed with ``str``, it names
    # the expected values
    accepts: Callable[[Any], Any]
    unit: str = ""  # SI unit; empty for a number without one and for other types
    # Where ``isolation_sim.tune`` looks for a better value; None if it is not tuned
    search: SearchRange | None = None

    @property
    def annotation(self) -> Any:
        """Its type for a signature, with the unit if it has one."""
        kind = getattr(self.accepts, "kind", Any)
        return Annotated[kind, self.unit] if self.unit else kind

    def checked(self, owner: str, name: str, value: Any) -> Any:
        """Return the value to use for a given one."""
        try:
            return self.accepts(value)
        except (TypeError, ValueError):
            unit = f", in {self.unit}" if self.unit else ""
            raise InputError(f"{owner}: {name}", repr(value), f"{self.accepts}{unit}") from None

    def with_default(self, owner: str, name: str, value: Any) -> Setting:
        """Return the setting with another default, checked like a given value."""
        return replace(self, default=self.checked(owner, name, value))


@checked
def setting(
    default: Any,
    meaning: str,
    accepts: Callable[[Any], Any] = Number(),
    unit: str = "",
    search: SearchRange | None = None,
) -> Any:
    """Declare a setting in a controller's class; the class turns it into its default value.

    Parameters
    ----------
    default : object
        Value where none is given.
    meaning : str
        Short description.
    accepts : callable
        Such as ``Number(above=0)``; any finite number by default.
    unit : str
        SI unit.
    search : SearchRange, optional
        Where ``isolation_sim.tune`` looks for a better value; without one it is not tuned.

    Returns
    -------
    Setting
        Typed as anything, so that the attribute can carry its own annotation.
    """
    return Setting(default, meaning, accepts, unit, search)


@dataclass(frozen=True)
class Integer:
    """Accepts whole numbers."""

    at_least: int  # Lowest number accepted

    kind = int
    """Type of the expected values."""

    def __call__(self, value: Any) -> int:
        """Return the number, or raise ValueError or TypeError."""
        if isinstance(value, (str, bool)) or int(value) != value or value < self.at_least:
            raise ValueError(value)
        return int(value)

    def __str__(self) -> str:
        return f"a whole number, {self.at_least} or more"


@dataclass(frozen=True)
class OneOf:
    """Accepts one of some words."""

    words: tuple[str, ...]  # The words

    @property
    def kind(self) -> Any:
        """Type of the expected values."""
        return Literal[self.words]

    def __call__(self, value: Any) -> str:
        """Return the word, or raise ValueError."""
        if value not in self.words:
            raise ValueError(value)
        return value

    def __str__(self) -> str:
        return " or ".join(repr(word) for word in self.words)


@dataclass(frozen=True)
class Optional:
    """Expects None or the values of another kind of setting."""

    inner: Callable[[Any], Any]  # The other kind

    @property
    def kind(self) -> Any:
        """Type of the expected values."""
        return getattr(self.inner, "kind", Any) | None

    def __call__(self, value: Any) -> Any:
        """Return None or the value read by the other kind."""
        return None if value is None else self.inner(value)

    def __str__(self) -> str:
        return f"{self.inner} or None"


@dataclass(frozen=True)
class Numbers:
    """Accepts rows, or rows of rows, of finite numbers and keeps them as nested tuples."""

    n_axes: tuple[int, ...] = (1,)  # Numbers of axes accepted

    kind = tuple
    """Type of the expected values."""

    def __call__(self, value: Any) -> tuple:
        """Return the numbers, or raise ValueError or TypeError."""
        array = np.array(value, dtype=float)
        if array.ndim not in self.n_axes or not array.size or not np.all(np.isfinite(array)):
            raise ValueError(value)
        return tuple(tuple(v) if isinstance(v, list) else v for v in array.tolist())

    def __str__(self) -> str:
        return "finite numbers in a row" + (" or in rows of one length" if 2 in self.n_axes else "")


@dataclass(frozen=True)
class NamesByName:
    """Accepts a table of names by name."""

    def __call__(self, value: Any) -> dict[str, str]:
        """Return the table, or raise TypeError."""
        if not isinstance(value, Mapping) or not all(isinstance(v, str) for v in value.values()):
            raise TypeError(value)
        return dict(value)

    def __str__(self) -> str:
        return "a table of names"


@dataclass(frozen=True)
class ExistingFile:
    """Accepts the path of a file that exists."""

    kind = str
    """Type of the expected values."""

    def __call__(self, value: Any) -> str:
        """Return the path as text, or raise ValueError or TypeError."""
        if not Path(value).is_file():
            raise ValueError(value)
        return str(value)

    def __str__(self) -> str:
        return "the path of an existing file"
