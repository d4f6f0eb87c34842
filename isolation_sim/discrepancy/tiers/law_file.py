"""A law with further terms, written as a Python file that a user can read and edit."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ground_motions.registry import copy_code

from ...archive import BASES
from ...errors import InputError
from ...identification.parameterisation import Parameterisation
from ...laws.law import Law
from ...laws.registry import LAWS
from .terms import Number, Term

_HEAD = '''"""{title}

    F = {name}(x, v)
{equation}
{note}"""

from typing import Any

import numpy as np

from isolation_sim.laws import LAWS
from isolation_sim.laws.law import Law, Quantity

BASE = LAWS["{base}"]
N_STATES, N_PARAMETERS = len(BASE.states), len(BASE.parameters)
'''


_PATH_IMPORT = "from pathlib import Path\nfrom typing import Any\n"
_PLACE_IMPORT = "import numpy as np\n\nfrom ground_motions.registry import absolute_place\n"


@dataclass(frozen=True)
class Chosen:
    """A term of an equation."""

    term: Term  # The term
    powers: tuple[int, ...]  # Powers of the current that its coefficient has


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


def law_text(base: Law, chosen: Sequence[Chosen], network: Network | None, title: str) -> str:
    """Write the file of a law with terms, and a learned term if there is one."""
    parameters, states, rates, force, lines = [], [], [], [], []
    at_rest: list[str] = []
    unpack_parameters: list[str] = []
    for k, one in enumerate(chosen, start=first_place(base)):
        names = _names(one, k)
        coefficient = f"c_{k}"
        unpack_parameters += [coefficient, *(names[n.symbol] for n in one.term.numbers)]
        if one.term.current:
            unpack_parameters.append(names["i"])
        meaning = f"coefficient of {one.term.text}"
        parameters.append(f'    Quantity("{coefficient}", "{one.term.unit}", "{meaning}"),')
        for n in one.term.numbers:
            least, most = number_range(n)
            lower = "" if n.symbol == "b" else f", lower={least:.3g}, divides=True"
            upper = "" if n.symbol == "b" else f", upper={most:.3g}"
            parameters.append(
                f'    Quantity("{names[n.symbol]}", "{n.unit}", "{n.meaning}"{lower}{upper}),'
            )
        if one.term.current:
            parameters.append(f'    Quantity("{names["i"]}", "A", "current"),')
        if one.term.rate:
            unit = one.term.state_unit
            states.append(f'    Quantity("s_{k}", "{unit}", "state of c_{k}"),')
            rates.append(_named(one.term.rate, names))
            at_rest.append(names["i"] if one.term.current else "0.0")
        force.append(f"{coefficient} * ({_named(one.term.code, names)})")
        lines.append(f"      + c_{k} ({shown(one, k)})")
    note = ""
    learned = ""
    if network is not None:
        note = "plus a learned term of inputs limited to the range of the tests.\n"
        learned, own_parameters, own_states, own_rates, own_force = _network_text(network)
        parameters += own_parameters
        unpack_parameters += [f"share_{k}" for k in range(len(network.weights))]
        states += own_states
        rates += own_rates
        at_rest += ["0.0"] * len(own_states)
        force.append(own_force)
    state_names = [line.split('"')[1] for line in states]
    for name in [*unpack_parameters, *state_names]:
        if name in (*base.parameter_names, *base.state_names):
            raise InputError(f"{base.name} has {name!r} already; expected: a law without this term")
    head = _HEAD.format(title=title, name=base.name, base=LAWS.called(base, base.name),
                        equation="\n".join(lines) or "      + learned", note=note)  # fmt: skip
    unpack = [
        f"    {', '.join(unpack_parameters)}, = parameters[N_PARAMETERS:]",
        *([f"    {', '.join(state_names)}, = states[N_STATES:]"] if state_names else []),
    ]
    body = [
        head + learned,
        "\ndef force(x: Any, v: Any, states: tuple, parameters: tuple) -> Any:",
        '    """Force of the law and of the terms."""',
        *unpack,
        "    total = BASE.force(x, v, states[:N_STATES], parameters[:N_PARAMETERS])",
        *(f"    total = total + {one}" for one in force),
        "    return total\n",
        "\ndef rates(x: Any, v: Any, states: tuple, parameters: tuple) -> tuple:",
        '    """Rates of the law\'s states and of the terms\' states."""',
        *unpack,
        "    inner = BASE.rates(x, v, states[:N_STATES], parameters[:N_PARAMETERS])",
        f"    return (*inner, {', '.join(rates)})\n" if rates else "    return tuple(inner)\n",
    ]
    extra = []
    if base.stored_energy is not None:
        body += [
            "\ndef stored_energy(x: Any, states: tuple, parameters: tuple) -> Any:",
            '    """Energy of the law; the work of the terms counts as dissipated."""',
            "    return BASE.stored_energy(x, states[:N_STATES], parameters[:N_PARAMETERS])\n",
        ]
        extra.append("    stored_energy=stored_energy,")
    if base.field_power is not None:
        body += [
            "\ndef field_power(x: Any, states: tuple, parameters: tuple) -> Any:",
            '    """Power of a change of the field on the law\'s stored energy."""',
            "    return BASE.field_power(x, states[:N_STATES], parameters[:N_PARAMETERS])\n",
        ]
        extra.append("    field_power=field_power,")
    if base.rest is not None or any(one.term.current for one in chosen):
        inner = "*BASE.rest(parameters[:N_PARAMETERS])" if base.rest else "*(0.0,) * N_STATES"
        body += [
            "\ndef rest(parameters: tuple) -> tuple:",
            '    """States of the undeformed device at a steady current."""',
            *unpack[:1],
            f"    return ({', '.join([inner, *at_rest])},)\n",
        ]
        extra.append("    rest=rest,")
    body += [
        "\nPARAMETERS = (", *parameters, ")", "STATES = (", *states, ")", "LAW = Law(",
        f'    name="{base.name.replace("+", "_")}_extended",',
        f'    title="{base.title}, extended by {"a learned term" if network else "an equation"}",',
        "    parameters=(*BASE.parameters, *PARAMETERS),",
        "    states=(*BASE.states, *STATES),",
        "    force=force,", "    rates=rates,", *extra, "    source=BASE.source,", ")",
    ]  # fmt: skip
    return "\n".join(body) + "\n"


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


def _network_text(network: Network) -> tuple[str, list[str], list[str], list[str], str]:
    """Definitions of a learned term, its parameters, states, rates and force."""

    def number(value: float) -> str:
        return f"{value:.9g}"

    states, rates, names = [], [], {}
    for k, term in enumerate(network.states):
        values = {n.symbol: number(n.value) for n in term.numbers} | {"s": f"m_{k}"}
        states.append(f'    Quantity("m_{k}", "m", "memory of the learned term"),')
        rates.append(_named(term.rate, values))
        names[f"m_{k}"] = k
    arguments = ["x", "v", *names]
    inputs = [f"        limited({code}, {number(most)})," for code, most in network.inputs]
    units = [f"    ({', '.join(number(u) for u in row)})," for row in network.units]
    weights = [f"    ({', '.join(number(w) for w in row)})," for row in network.weights]
    shares = ", ".join(f"share_{k}" for k in range(len(network.weights)))
    gates, gate, gate_input = [], "", []
    if network.gates is not None:
        gates = [
            "GATES = (",
            *(f"    ({', '.join(number(g) for g in row)})," for row in network.gates), ")",
            '"""Factor of each unit, by ascending powers of |x| in m."""',
        ]  # fmt: skip
        gate = " * (GATES[k][0] + size_x * (GATES[k][1] + size_x * GATES[k][2]))"
        limit = next(most for code, most in network.inputs if code == "x")
        gate_input = [f"    size_x = np.fabs(limited(x, {number(limit)}))"]
    text = "\n".join([
        "UNITS = (", *units, ")",
        '"""Offset and weights of each unit of the learned term."""',
        "WEIGHTS = (", *weights, ")",
        '"""N; contribution of each unit, a row for each power of the current."""',
        *gates,
        "",
        "",
        "def limited(u: Any, most: float) -> Any:",
        '    """A value, limited to -most and most."""',
        "    return u * (np.fabs(u) <= most) + most * np.sign(u) * (np.fabs(u) > most)",
        "",
        "",
        f"def learned({', '.join(arguments)}, shares: tuple) -> Any:",
        '    """Odd units of limited inputs: the term vanishes at rest."""',
        "    inputs = (", *inputs, "    )",
        *gate_input,
        "    total = 0.0 * x",
        "    for k, (offset, *weights) in enumerate(UNITS):",
        "        at = 0.0",
        "        for weight, value in zip(weights, inputs):",
        "            at = at + weight * value",
        "        size = 0.0",
        "        for share, row in zip(shares, WEIGHTS):",
        "            size = size + share * row[k]",
        "        unit = np.tanh(at + offset) + np.tanh(at - offset)",
        f"        total = total + size * unit{gate}",
        "    return total",
        "",
    ])  # fmt: skip
    parameters = [
        f'    Quantity("share_{k}", "1", "of the learned term, power {k} of the current"),'
        for k in range(len(network.weights))
    ]
    return text, parameters, states, rates, f"learned({', '.join(arguments)}, ({shares},))"


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
        self.spread = np.zeros_like(base.spread, shape=(len(self.owner), base.spread.shape[1]))
        self.spread[:own] = base.spread
        self._offset[:own] = base._offset
        self.basis, self.scale = base.basis, base.scale
        self.lower, self.upper = base.lower, base.upper
        quantities = {q.name: q for q in law.parameters}
        columns, lower, upper = [], [], []
        for name, exponents in powers.items():
            for power in exponents:
                column = np.zeros(len(self.owner))
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
