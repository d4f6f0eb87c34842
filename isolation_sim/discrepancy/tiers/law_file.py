"""A law with further terms, written as a Python file that a user can read and edit.

``law_file.py.j2`` is the text of the file.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ground_motions.registry import copy_code

from ...archive import BASES
from ...errors import InputError
from ...identification.parameterisation import Parameterisation
from ...laws.law import Law
from ...laws.registry import LAWS
from .terms import Number, Term

_PATH_IMPORT = "from pathlib import Path\nfrom typing import Any\n"
_PLACE_IMPORT = "import numpy as np\n\nfrom ground_motions.registry import absolute_place\n"


@dataclass(frozen=True)
class Chosen:
    """A term of an equation."""

    term: Term  # The term
    powers: tuple[int, ...]  # Powers of the current that its coefficient has

    @property
    def written(self) -> str:
        """With its power of the current, as a generic term is written; empty for several powers."""
        if len(self.powers) > 1:
            return ""
        power = {0: "", 1: " I"}.get(self.powers[0], f" I^{self.powers[0]}")
        return self.term.text + power

    def unit(self, power: int) -> str:
        """Unit of its coefficient at a power of the current."""
        return self.term.unit + ("", "/A")[power > 0] + (f"^{power}" if power > 1 else "")


@dataclass(frozen=True, eq=False)
class Network:
    """A learned term: a sum of hyperbolic tangents of bounded inputs."""

    states: tuple[Term, ...]  # Terms with a state, whose value over their first number is an input
    # tuple of (str, float): Python code of each input, and the value at which it is limited
    inputs: tuple[tuple[str, float], ...]
    units: NDArray  # (n_units, n_inputs + 1): Offset and weights of each unit
    # (n_powers, n_units): N; what each unit adds at each power of the current over the largest
    # current
    weights: NDArray
    # (n_units, 3): Each unit is multiplied by a polynomial of the limited |x|, by powers of m
    gates: NDArray | None = None


def text_beside(text: str, folder: Path) -> str:
    """The text of ``law_text`` for a folder, to which the file of the base law is copied."""
    for place, beside in copy_code(BASES.findall(text), folder).items():
        here = f'LAWS[absolute_place("{beside}", Path(__file__).parent)]'
        text = text.replace(f'LAWS["{place}"]', here)
        text = text.replace("from typing import Any\n", _PATH_IMPORT, 1)
        text = text.replace("import numpy as np\n", _PLACE_IMPORT, 1)
    return text


class _Named(NamedTuple):
    """A parameter or a state of the terms in the file."""

    name: str
    unit: str
    meaning: str
    limits: str = ""  # Further arguments of a parameter
    rate: str = ""  # Code of a state's rate
    at_rest: str = "0.0"  # Code of a state's value in the undeformed device


def law_text(base: Law, chosen: Sequence[Chosen], network: Network | None, title: str) -> str:
    """Write the file of a law with terms, and a learned term if there is one."""
    parameters, states, forces, equation = [], [], [], []
    for k, one in enumerate(chosen, start=first_place(base)):
        names, term = _names(one, k), one.term
        parameters.append(_Named(f"c_{k}", term.unit, f"coefficient of {term.text}"))
        parameters += [_Named(names[n.symbol], n.unit, n.meaning, _limits(n)) for n in term.numbers]
        if term.current:
            parameters.append(_Named(names["i"], "A", "current"))
        if term.rate:
            rate, at_rest = _named(term.rate, names), names["i"] if term.current else "0.0"
            states.append(
                _Named(f"s_{k}", term.state_unit, f"state of c_{k}", rate=rate, at_rest=at_rest)
            )
        forces.append(f"c_{k} * ({_named(term.code, names)})")
        equation.append(f"c_{k} ({shown(one, k)})")
    arguments = ""
    if network is not None:
        shares = [f"share_{k}" for k in range(len(network.weights))]
        parameters += [
            _Named(name, "1", f"of the learned term, power {k} of the current")
            for k, name in enumerate(shares)
        ]
        for k, term in enumerate(network.states):
            values = {n.symbol: f"{n.value:.9g}" for n in term.numbers} | {"s": f"m_{k}"}
            rate = _named(term.rate, values)
            states.append(_Named(f"m_{k}", "m", "memory of the learned term", rate=rate))
        arguments = ", ".join(["x", "v", *(f"m_{k}" for k in range(len(network.states)))])
        forces.append(f"learned({arguments}, ({', '.join(shares)},))")
    for name in (one.name for one in (*parameters, *states)):
        if name in (*base.parameter_names, *base.state_names):
            raise InputError(f"{base.name} has {name!r} already; expected: a law without this term")
    return _template().render(
        title=title, base=base, place=LAWS.called(base, base.name),
        equation=equation or ["learned"], parameters=parameters, states=states, forces=forces,
        network=network, arguments=arguments,
        has_rest=base.rest is not None or any(one.term.current for one in chosen),
    )  # fmt: skip


@cache
def _template() -> Any:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(__package__, "."), trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True, undefined=StrictUndefined,
    )  # fmt: skip
    return environment.get_template("law_file.py.j2")


def _limits(number: Number) -> str:
    """Range of a number as arguments of its quantity; a position has none."""
    if number.symbol == "b":
        return ""
    least, most = number_range(number)
    return f", lower={least:.3g}, divides=True, upper={most:.3g}"


def number_range(number: Number) -> tuple[float, float]:
    """Range in which a law's file lets a number inside a term be fitted."""
    least, most = max(0.05 * number.value, number.least), min(20 * number.value, number.most)
    return float(f"{least:.3g}"), float(f"{most:.3g}")


def first_place(base: Law) -> int:
    """Number of the first further term: a law may have an equation's terms already."""
    return 1 + sum(bool(re.fullmatch(r"c_\d+", name)) for name in base.parameter_names)


def _names(one: Chosen, place: int) -> dict[str, str]:
    """Symbols of a term as they are called in the equation."""
    own = ("s", "i", *(n.symbol for n in one.term.numbers))
    return {symbol: f"{symbol}_{place}" for symbol in own}


def shown(one: Chosen, place: int) -> str:
    """A term as it stands in the equation at some place, from 1."""
    return _named(one.term.text, _names(one, place))


def _named(code: str, names: Mapping[str, str]) -> str:
    """Code with a term's own symbols renamed."""
    return re.sub(r"(?<![\w.])[a-z](?![\w(])", lambda m: names.get(m[0], m[0]), code)


class TermParameterisation(Parameterisation):
    """Unknowns of a law with terms: some parameters have given powers of the current alone."""

    def __init__(
        self,
        law: Law,  # The law with its terms
        base: Parameterisation,  # That of the law without them
        # Powers of the current of each further parameter; none where it is held
        powers: Mapping[str, tuple[int, ...]],
        # Coefficients (ascending powers of the current) of parameters that are not free
        held: Mapping[str, Sequence[float]] | None = None,
    ):
        # as the base's, with all further parameters fixed; those with powers are freed below
        fixed = base.fixed | dict.fromkeys([*powers, *(held or {})], 0.0)
        super().__init__(law, base.currents, base.sizes, fixed, base.span, base.scaling)
        n, names = len(base.currents), law.parameter_names
        own = base.spread.shape[0]
        self.spread = np.zeros_like(base.spread, shape=(len(names) * n, base.spread.shape[1]))
        self.spread[:own] = base.spread
        self._offset[:own] = base._offset
        self.basis, self.scale = base.basis, base.scale
        self.lower, self.upper = base.lower, base.upper
        quantities = {q.name: q for q in law.parameters}
        columns, lower, upper = [], [], []
        for name, exponents in powers.items():
            for power in exponents:
                column = np.zeros(len(names) * n)
                column[names.index(name) * n + power] = 1.0
                columns.append(column)
                alone = exponents == (0,)
                lower.append(quantities[name].lower if alone else -np.inf)
                upper.append(quantities[name].upper if alone else np.inf)
        for name, coefficients in (held or {}).items():
            at = names.index(name) * n
            self._offset[at : at + len(coefficients)] = coefficients
        if columns:
            self.spread = np.column_stack([self.spread, *columns])
        # of no size of their own: nothing pulls them
        self.scale = np.concatenate([self.scale, np.full(len(columns), np.inf)])
        self.lower = np.concatenate([self.lower, lower])
        self.upper = np.concatenate([self.upper, upper])
