"""Write a law's arithmetic out as plain Numba source.

CasADi traces the law from its one definition; its SX graph is then walked instruction by
instruction and printed as straight-line scalar Python, which Numba compiles without knowing
anything of laws, effects or CasADi. Whatever depends on the parameters alone is split off into a
``prepare`` function, so that the inner loops neither divide by nor recompute it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

_BINARY = {
    "OP_ADD": "({} + {})",
    "OP_SUB": "({} - {})",
    "OP_MUL": "({} * {})",
    "OP_DIV": "({} / {})",
    "OP_POW": "({} ** {})",
    "OP_CONSTPOW": "({} ** {})",
    "OP_LT": "(1.0 if {} < {} else 0.0)",
    "OP_LE": "(1.0 if {} <= {} else 0.0)",
    "OP_EQ": "(1.0 if {} == {} else 0.0)",
    "OP_NE": "(1.0 if {} != {} else 0.0)",
    "OP_AND": "(1.0 if {} != 0.0 and {} != 0.0 else 0.0)",
    "OP_OR": "(1.0 if {} != 0.0 or {} != 0.0 else 0.0)",
    "OP_FMIN": "min({}, {})",
    "OP_FMAX": "max({}, {})",
    "OP_FMOD": "math.fmod({}, {})",
    "OP_COPYSIGN": "math.copysign({}, {})",
    "OP_ATAN2": "math.atan2({}, {})",
    "OP_HYPOT": "math.hypot({}, {})",
    "OP_IF_ELSE_ZERO": "({1} if {0} != 0.0 else 0.0)",
}
_UNARY = {
    "OP_NEG": "(-{})",
    "OP_SQ": "({0} * {0})",
    "OP_TWICE": "(2.0 * {})",
    "OP_INV": "(1.0 / {})",
    "OP_NOT": "(1.0 if {} == 0.0 else 0.0)",
    "OP_FABS": "abs({})",
    "OP_SIGN": "(1.0 if {0} > 0.0 else (-1.0 if {0} < 0.0 else 0.0))",
    "OP_FLOOR": "math.floor({})",
    "OP_CEIL": "math.ceil({})",
    **{
        f"OP_{name.upper()}": f"math.{name}({{}})"
        for name in (
            "sqrt sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh "
            "exp log expm1 log1p erf"
        ).split()
    },
}


class NotTraceable(ValueError):
    """A law uses an operation that the compiled kernels do not support."""


def scalar_expression(operation: str, operands: Sequence[str], is_hoisted: Sequence[bool]) -> str:
    """Print one operation on scalars."""
    template = _BINARY.get(operation) if len(operands) == 2 else _UNARY.get(operation)
    if template is None:
        raise NotTraceable(
            f"operation {operation[3:].lower()} has no compiled counterpart; a law may use "
            "+ - * / **, comparisons and the functions that isolation_sim.laws.law lists"
        )
    return template.format(*operands)


def straight_line(
    inputs: dict[str, Any],
    outputs: Sequence[Any],
    hoist: Sequence[str] = (),
    write: Callable[[str, Sequence[str], Sequence[bool]], str] = scalar_expression,
) -> tuple[list[str], list[str], list[str], list[str]]:
    """Print a symbolic computation as scalar Python statements."""
    import casadi

    code_name = {getattr(casadi, n): n for n in dir(casadi) if n.startswith("OP_")}
    names = list(inputs)
    function = casadi.Function("f", list(inputs.values()), casadi.cse(list(outputs)))
    register: dict[int, str] = {}
    seldom = set(hoist)  # names (inputs and variables) that depend on hoisted inputs alone
    reciprocal: dict[str, str] = {}
    hoisted: list[str] = []
    statements: list[str] = []
    results = ["0.0"] * len(outputs)

    def is_seldom(operand: str) -> bool:
        return operand in seldom or operand[0] in "-0123456789"

    def assign(operation: str, operands: Sequence[str]) -> str:
        is_hoisted = [is_seldom(o) for o in operands]
        if all(is_hoisted):
            name = f"pre{len(hoisted)}"
            hoisted.append(f"{name} = {scalar_expression(operation, operands, is_hoisted)}")
            seldom.add(name)
        else:
            name = f"tmp{len(statements)}"
            statements.append(f"{name} = {write(operation, operands, is_hoisted)}")
        return name

    for k in range(function.n_instructions()):
        op = code_name[function.instruction_id(k)]
        out = function.instruction_output(k)
        if op == "OP_CONST":
            register[out[0]] = repr(float(function.instruction_constant(k)))
        elif op == "OP_INPUT":
            register[out[0]] = names[function.instruction_input(k)[0]]
        elif op == "OP_OUTPUT":
            results[out[0]] = register[function.instruction_input(k)[0]]
        elif op == "OP_ASSIGN":
            register[out[0]] = register[function.instruction_input(k)[0]]
        else:
            operands = [register[i] for i in function.instruction_input(k)]
            if op == "OP_DIV" and operands[1] in seldom and not is_seldom(operands[0]):
                divisor = operands[1]
                if divisor not in reciprocal:
                    reciprocal[divisor] = assign("OP_INV", [divisor])
                op, operands = "OP_MUL", [operands[0], reciprocal[divisor]]
            register[out[0]] = assign(op, operands)

    text = " ".join(statements) + " " + " ".join(results)
    tokens = set("".join(c if c.isalnum() or c == "_" else " " for c in text).split())
    names = [name for name in [*hoist, *(h.split(" = ")[0] for h in hoisted)] if name in tokens]
    return hoisted, names, statements, results


def function_text(
    name: str, arguments: str, body: Sequence[str], decorator: str = "@inline", doc: str = ""
) -> str:
    """Assemble one function's source text."""
    lines = [*filter(None, [decorator]), f"def {name}({arguments}):"]
    if doc:
        lines.append(f'    """{doc}"""')
    lines += [f"    {line}" for line in body]
    return "\n".join(lines) + "\n"


def own_slopes(
    inputs: dict[str, Any], rates: Sequence[Any], states: Sequence[Any]
) -> tuple[list[str], list[str]]:
    """Print the derivative of each state's rate by that state."""
    import casadi

    slopes = [casadi.gradient(casadi.SX(r), s) for r, s in zip(rates, states, strict=True)]
    _, _, statements, results = straight_line(inputs, slopes)
    return statements, results


def kinks(
    inputs: dict[str, Any], outputs: Sequence[Any], moving: Sequence[str]
) -> tuple[list[str], list[str]]:
    """Print the quantities whose change of sign causes a kink or a jump of an output."""
    # These are the arguments of absolute values and signs, the differences that comparisons look
    # at, and z where a power, a root or a logarithm is taken of z * z plus next to nothing.
    import casadi

    either = {casadi.OP_LT, casadi.OP_LE, casadi.OP_FMIN, casadi.OP_FMAX}
    sides = {casadi.OP_FABS, casadi.OP_SIGN}
    rounded = {casadi.OP_POW, casadi.OP_CONSTPOW, casadi.OP_LOG, casadi.OP_SQRT}
    variables = casadi.vertcat(*(inputs[name] for name in moving))
    result: list[Any] = []
    seen: set[int] = set()
    # expressions that stand in both force and rates are looked through once
    waiting = casadi.vertsplit(casadi.cse(casadi.vertcat(*outputs)))
    while waiting:
        node = waiting.pop()
        if node.element_hash() in seen or node.is_leaf():
            continue
        seen.add(node.element_hash())
        operands = [node.dep(i) for i in range(node.n_dep())]
        waiting += operands
        switch = None
        if node.op() in sides:
            switch = operands[0]
        elif node.op() == casadi.OP_COPYSIGN:
            switch = operands[1]
        elif node.op() in either:
            switch = operands[0] - operands[1]
        elif node.op() in rounded:
            switch = _squared(operands[0])
        if switch is None or not casadi.depends_on(switch, variables):
            continue
        if not any(casadi.is_equal(s, other, 9) for s in (switch, -switch) for other in result):
            result.append(switch)
    if not result:
        return [], []
    _, _, statements, results = straight_line(inputs, result)
    return statements, results


def _squared(node: Any) -> Any | None:
    """Return z of z * z plus next to nothing, which keeps the logarithm of 0 out; else None."""
    import casadi

    if node.op() == casadi.OP_ADD:
        small = [node.dep(i).is_constant() and abs(float(node.dep(i))) < 1e-99 for i in (0, 1)]
        if any(small):
            node = node.dep(small.index(False))
    return node.dep(0) if node.op() == casadi.OP_SQ else None


def symbols(names: Sequence[str]) -> list[Any]:
    """One CasADi symbol per name."""
    import casadi

    if hasattr(casadi.GlobalOptions, "setNumpyMode"):
        casadi.GlobalOptions.setNumpyMode(-1)  # its present NumPy behaviour, without the warning

    return [casadi.SX.sym(n) for n in names]
