"""The equations of a law, read off the functions that the simulation itself uses.

The functions are called with `Traced` quantities, as CasADi calls them with symbols; what comes
back is a SymPy expression, printed as LaTeX. So a page cannot show another law than the one run.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Sequence
from itertools import count
from typing import Any

import numpy as np
import sympy
from sympy.printing.latex import LatexPrinter

NEGLIGIBLE = 1e-100
"""A number below this keeps derivatives finite at rest and changes no value."""

LINE = 58
"""Characters, as printed, after which a sum goes on in the next line."""

_COMPARISONS = {
    np.greater: sympy.Gt, np.greater_equal: sympy.Ge, np.less: sympy.Lt,
    np.less_equal: sympy.Le, np.equal: sympy.Eq, np.not_equal: sympy.Ne,
}  # fmt: skip
_FUNCTIONS = {
    np.add: operator.add, np.subtract: operator.sub, np.multiply: operator.mul,
    np.true_divide: operator.truediv, np.power: operator.pow, np.float_power: operator.pow,
    np.negative: operator.neg, np.positive: operator.pos,
    np.sinh: sympy.sinh, np.cosh: sympy.cosh, np.tanh: sympy.tanh, np.exp: sympy.exp,
    np.log: sympy.log, np.sin: sympy.sin, np.cos: sympy.cos, np.arctan: sympy.atan,
    np.arcsinh: sympy.asinh, np.sqrt: sympy.sqrt, np.sign: sympy.sign, np.fabs: sympy.Abs,
    np.floor: sympy.floor,
    np.log1p: lambda u: sympy.log(1 + u),
    np.expm1: lambda u: sympy.exp(u) - 1,
    np.hypot: lambda a, b: sympy.sqrt(a**2 + b**2),
    np.copysign: lambda a, b: sympy.Abs(a) * sympy.sign(b),
}  # fmt: skip


class Iverson(sympy.Function):
    """1 where a condition holds, else 0: a comparison used as a multiplier."""

    nargs = 1
    is_real = True


class _Printer(LatexPrinter):
    def _print_Iverson(self, function: Any, exp: Any = None) -> str:
        text = rf"\left[{self._print(function.args[0])}\right]"
        return text if exp is None else text + f"^{{{exp}}}"

    def _print_Float(self, number: Any) -> str:
        mantissa, _, power = f"{float(number):.4g}".partition("e")
        return rf"{mantissa} \cdot 10^{{{int(power)}}}" if power else mantissa


class Traced(np.lib.mixins.NDArrayOperatorsMixin):
    """A quantity that remembers how it was computed.

    Parameters
    ----------
    expression : sympy.Expr
        How.
    """

    def __init__(self, expression: Any):
        self.expression = expression

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        arguments = [expression_of(value) for value in inputs]
        if ufunc in _COMPARISONS:
            relation = _COMPARISONS[ufunc](*arguments)
            known = relation in (sympy.true, sympy.false)
            return Traced(sympy.Integer(bool(relation)) if known else Iverson(relation))
        return Traced(_FUNCTIONS[ufunc](*arguments))


def expression_of(value: Any) -> Any:
    """Return a traced quantity's expression, or a number as SymPy holds it.

    Parameters
    ----------
    value : Traced or float
        The quantity.

    Returns
    -------
    sympy.Expr
    """
    if isinstance(value, Traced):
        return value.expression
    number = float(value)
    if abs(number) < NEGLIGIBLE:
        return sympy.Integer(0)
    return sympy.Integer(int(number)) if number == int(number) else _fraction(number)


def _fraction(number: float) -> Any:
    for unit, printed in ((1.0, sympy.Integer(1)), (np.pi, sympy.pi), (1 / np.pi, 1 / sympy.pi)):
        for over in (1, 2, 3, 4, 6, 8, 12, 1000):
            near = round(number / unit * over)
            if near and abs(number / unit * over - near) < 1e-14 * abs(near):
                return sympy.Rational(near, over) * printed
    return sympy.Float(number)


def symbol(name: str) -> Any:
    """Return the real symbol of a named quantity.

    Parameters
    ----------
    name : str
        Such as ``"sigma_squared"`` or ``"k0"``.

    Returns
    -------
    sympy.Symbol
    """
    return sympy.Symbol(name, real=True)


def traced(names: Sequence[str]) -> tuple[Traced, ...]:
    """Return traced symbols.

    Parameters
    ----------
    names : sequence of str
        Their names.

    Returns
    -------
    tuple of Traced
    """
    return tuple(Traced(symbol(name)) for name in names)


def latex(expression: Any) -> str:
    """Print an expression.

    Parameters
    ----------
    expression : sympy.Expr
        The expression.

    Returns
    -------
    str
        LaTeX.
    """
    names = {s: symbol_latex(s.name) for s in expression.free_symbols}
    settings = {"symbol_names": names, "ln_notation": True, "order": "none"}
    return _Printer(settings).doprint(expression)


def symbol_latex(name: str) -> str:
    """Print a name as a symbol.

    Parameters
    ----------
    name : str
        Such as ``"sigma_squared"``, printed as sigma to the second power.

    Returns
    -------
    str
        LaTeX.
    """
    head, _, tail = name.partition("_")
    if tail == "squared":
        return f"{symbol_latex(head)}^{{2}}"
    if len(head) > 1 and not tail and head.isalpha() and not _is_greek(head):
        return rf"\mathrm{{{head}}}"
    if _is_greek(tail) and not _is_greek(head):
        head, tail = tail, head
    if tail:
        worded = len(tail) > 1 and not tail.isdigit()
        head = symbol_latex(head)
        return rf"{head}_{{\mathrm{{{tail}}}}}" if worded else f"{head}_{{{tail}}}"
    return sympy.latex(sympy.Symbol(name))


def _is_greek(name: str) -> bool:
    return sympy.latex(sympy.Symbol(name)).startswith("\\")


def equation(left: str, expression: Any) -> str:
    """Write an equation; what is too long is abbreviated, and a long sum takes several lines.

    Parameters
    ----------
    left : str
        Its left side, LaTeX.
    expression : sympy.Expr
        Its right side.

    Returns
    -------
    str
        LaTeX, for a display.
    """
    shorter, rows = [], []
    if _width(latex(expression)) > 2 * LINE:
        letters = (symbol(f"s_{k}") for k in count(1))
        shorter, (expression,) = sympy.cse(expression, letters, order="none")
    for name, meaning in ((left, expression), *((latex(s), e) for s, e in shorter)):
        first, *others = _lines(meaning)
        rows += [f"{name} &= {first}", *(rf"&\quad {other}" for other in others)]
    if len(rows) == 1:
        return rows[0].replace("&", "")
    return "\\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}"


def _lines(expression: Any) -> list[str]:
    """An expression as LaTeX, a sum broken between its terms where a line is full."""
    lines: list[str] = []
    now = ""
    for term in sympy.Add.make_args(expression):
        text = latex(term)
        if (lines or now) and not text.lstrip().startswith("-"):
            text = f"+ {text}"
        if now and _width(now + text) > LINE:
            lines.append(now)
            now = ""
        now = f"{now} {text}".strip()
    return [*lines, now]


def _width(text: str) -> int:
    """About how many characters a formula is wide."""
    part = r"\{((?:[^{}]|\{[^{}]*\})*)\}"
    fraction = re.compile(rf"\\frac{part}{part}")
    while fraction.search(text):
        text = fraction.sub(lambda result: max(result.groups(), key=len), text)
    text = re.sub(r"\\left|\\right|[{}^_\s]", "", text)
    return len(re.sub(r"\\[a-zA-Z]+", "x", text))


def stored(law: Any) -> Any:
    """Return the expression of a law's stored energy, or None where it has none.

    Parameters
    ----------
    law : Law
        The law.

    Returns
    -------
    sympy.Expr or None
    """
    if law.stored_energy is None:
        return None
    (x,) = traced("x")
    result = law.stored_energy(x, traced(law.state_names), traced(law.parameter_names))
    return expression_of(result)


def force(law: Any) -> Any:
    """Return the expression of a law's force.

    Parameters
    ----------
    law : Law
        The law.

    Returns
    -------
    sympy.Expr
    """
    return expression_of(law.force(*_arguments(law)))


def rates(law: Any) -> list[Any]:
    """Return the expressions of the rates of a law's states.

    Parameters
    ----------
    law : Law
        The law.

    Returns
    -------
    list of sympy.Expr
    """
    return [expression_of(rate) for rate in law.rates(*_arguments(law))]


def _arguments(law: Any) -> tuple:
    x, v = traced("xv")
    return x, v, traced(law.state_names), traced(law.parameter_names)
