"""C99 from compiled Python: the subset of the language that Numba compiles here.

Numbers, arrays of them, slices of flat arrays of float64, rows of arrays of several axes, tuples,
and functions on these. Types are inferred from the arguments of the first call. A slice is a
pointer and a length, and is cut off where Python cuts it off. Nothing is allocated.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping, Sequence
from typing import Any

from ground_motions.python_source import parse

from ..errors import InputError

Kind = Any
"""``"b"`` truth, ``"i"`` long, ``"d"`` double, ``"z"`` complex, ``"v"`` nothing; a tuple of kinds.

``"a"`` is a flat array of double; another array is its element and the number of its axes, such as
``"i1"`` or ``"z2"``.
"""

TYPES = {"b": "int", "i": "long", "d": "double", "z": "double complex", "v": "void", "a": "array"}
NUMBERS = ("b", "i", "d", "z")
"""Kinds of numbers; each can represent those before it."""

ARRAY = "typedef struct { double *p; long n; } array;\n"

HELPERS = {
    "part": """\
static array part(array a, long begin, long end)
{
    begin = smaller_whole(larger_whole(begin, 0), a.n);
    end = larger_whole(smaller_whole(end, a.n), begin);
    a.p += begin;
    a.n = end - begin;
    return a;
}""",
    "rest": "static long rest(long a, long b) { return a - b * over(a, b); }",
    "over": "static long over(long a, long b)\n"
    "{\n    return a / b - (a % b != 0 && (a < 0) != (b < 0));\n}",
    "magnitude": "static long magnitude(long a) { return a < 0 ? -a : a; }",
    "larger": "static double larger(double a, double b) { return b > a ? b : a; }",
    "smaller": "static double smaller(double a, double b) { return b < a ? b : a; }",
    "larger_whole": "static long larger_whole(long a, long b) { return b > a ? b : a; }",
    "smaller_whole": "static long smaller_whole(long a, long b) { return b < a ? b : a; }",
}
"""Functions of Python that C does not have; each calls only later ones."""

MATHEMATICS = set(
    "acos acosh asin asinh atan atan2 atanh ceil copysign cos cosh erf exp expm1 fabs floor fmod "
    "hypot log log10 log1p log2 nextafter pow sin sinh sqrt tan tanh".split()
)
RENAMED = {"arcsin": "asin", "arccos": "acos", "arctan": "atan", "arcsinh": "asinh",
           "arctan2": "atan2", "power": "pow", "abs": "fabs"}  # fmt: skip
KEYWORDS = set(
    "auto break case char const continue default do double else enum extern float for goto if "
    "I complex inline int long register restrict return short signed sizeof static struct switch "
    "typedef union unsigned void volatile while array".split()
) | set(HELPERS)
OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
COMPARED = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


class _NotYet(Exception):
    """The kind of a variable is not known yet."""


class Fields(tuple):
    """Kind of a tuple with named parts."""

    names: tuple[str, ...]

    def __new__(cls, names: Sequence[str], kinds: Sequence[Kind]) -> Fields:
        """Kind of parts of these names and kinds."""
        result = super().__new__(cls, kinds)
        result.names = tuple(names)
        return result


class CText:
    """Writes functions of a module as C; ``prefix`` stands before their names."""

    def __init__(
        self,
        text: str,
        prefix: str,
        external: Mapping[str, tuple[Kind, str]] | None = None,
        records: Mapping[str, Sequence[str]] | None = None,
    ):
        self.prefix = prefix
        # kind of the result and C text of functions that replace the module's own or imported
        # ones; an empty text leaves their calls out
        self.external = external or {}
        # names of the fields of named tuples
        self.records = records or {}
        self.arrays: dict[str, str] = {}
        self.sources: dict[str, ast.FunctionDef] = {}
        self.constants: dict[str, Any] = {}
        for node in parse(text).body:
            if isinstance(node, ast.FunctionDef):
                self.sources[node.name] = node
            elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                try:
                    self.constants[node.targets[0].id] = ast.literal_eval(node.value)
                except ValueError:
                    continue
            elif isinstance(node, ast.Assign) and ast.unparse(node.value).startswith("range("):
                names = ast.unparse(node.targets[0]).strip("()").split(", ")
                self.constants |= {name: k for k, name in enumerate(names)}
        self.tuples: dict[Kind, str] = {}
        self.tables: dict[str, str] = {}
        self.functions: dict[tuple, tuple[str, Kind]] = {}
        self.texts: list[str] = []

    def function(self, name: str, kinds: Sequence[Kind]) -> tuple[str, Kind]:
        """Write a function for arguments of some kinds and its callees; return C name and kind."""
        node = self.sources[name]
        own_kinds = [
            "d" if kind in ("i", "b") and _annotated(argument, "float") else kind
            for argument, kind in zip(node.args.args, kinds, strict=True)
        ]
        key = (name, *own_kinds)
        if key not in self.functions:
            same = sum(known[0] == name for known in self.functions)
            own = f"{self.prefix}_{name.lstrip('_')}{same + 1 if same else ''}"
            self.functions[key] = (own, None)  # a function that calls itself has no kind yet
            kind, text = _Function(self, node, own_kinds, own).written()
            self.functions[key] = (own, kind)
            self.texts.append(text)
        return self.functions[key]

    def type_of(self, kind: Kind) -> str:
        """Name of a kind's C type."""
        if axes := _axes(kind):
            if kind != "a":
                element = TYPES[kind[0]]
                text = f"typedef struct {{ {element} *p; long n[{axes}]; }} array_{kind};"
                self.arrays[kind] = text
                return f"array_{kind}"
        if not isinstance(kind, tuple):
            return TYPES[kind]
        for part in kind:
            self.type_of(part)  # a struct stands behind those that it holds
        return self.tuples.setdefault(kind, f"tuple_{len(self.tuples)}")

    def definitions(self) -> str:
        """Helpers, tuples, tables and functions, in an order in which C takes them."""
        lines = []
        for kind, name in self.tuples.items():
            members = " ".join(f"{self.type_of(part)} f{k};" for k, part in enumerate(kind))
            lines.append(f"typedef struct {{ {members} }} {name};")
        written = "".join(self.texts)
        lines += self.tables.values()
        lines += [c for name, (_, c) in self.external.items() if re.search(rf"\b{name}\(", written)]
        text = "\n".join([*self.arrays.values(), *lines, "", written])
        # compilers warn of what nothing calls
        for name, helper in HELPERS.items():
            if re.search(rf"\b{name}\(", text):
                text = f"{helper}\n{text}"
        return f"{ARRAY}{text}"


def _axes(kind: Kind) -> int:
    """Number of axes of an array's kind; 0 for another kind."""
    if isinstance(kind, tuple) or kind is None:
        return 0
    return 1 if kind == "a" else int(kind[1:] or 0)


def array_kind(element: str, axes: int) -> Kind:
    """Kind of an array of numbers of a kind."""
    return "a" if (element, axes) == ("d", 1) else f"{element}{axes}"


def _annotated(argument: ast.arg, name: str) -> bool:
    return isinstance(argument.annotation, ast.Name) and argument.annotation.id == name


def _joined(a: Kind, b: Kind) -> Kind:
    """The kind that holds values of both."""
    if a == b or b is None:
        return a
    if a is None:
        return b
    if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b):
        return tuple(map(_joined, a, b))
    if a in NUMBERS and b in NUMBERS:
        return max(a, b, "i", key=NUMBERS.index)
    raise InputError(f"a variable is {a} and {b}; C has one type for it")


class _Function:
    """One function, for arguments of some kinds."""

    def __init__(self, module: CText, node: ast.FunctionDef, kinds: Sequence[Kind], name: str):
        self.module, self.node, self.name = module, node, name
        self.arguments = [argument.arg for argument in node.args.args]
        self.kinds: dict[str, Kind] = dict(zip(self.arguments, kinds, strict=True))
        self.returned: Kind = None
        self.count = 0
        self.lines: list[str] = []

    def written(self) -> tuple[Kind, str]:
        """Kind of its result, and its text."""
        body = self.node.body
        said = ast.get_docstring(self.node)
        while True:
            before = (dict(self.kinds), self.returned)
            self._infer(body)
            if before == (self.kinds, self.returned):
                break
        self.returned = self.returned or "v"
        self._block(body, 1)
        c = self.module.type_of
        arguments = ", ".join(f"{c(self.kinds[a])} {_c(a)}" for a in self.arguments)
        lines = [f"/* {said.splitlines()[0]} */"] if said else []
        lines += [f"static {c(self.returned)} {self.name}({arguments})", "{"]
        left_out = {
            id(part)
            for call in ast.walk(self.node)
            if isinstance(call, ast.Call)
            and self.module.external.get(ast.unparse(call.func), ("v", "C"))[1] == ""
            for part in ast.walk(call)
        }
        read = {n.id for n in ast.walk(self.node)
                if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)
                and id(n) not in left_out}  # fmt: skip
        local = [name for name in self.kinds if name not in self.arguments]
        for name in local:
            kind = self.kinds[name]
            zero = "{0}" if _axes(kind) or isinstance(kind, tuple) else "0"
            lines.append(f"    {c(kind)} {_c(name)} = {zero};")
        lines += [f"    (void){_c(name)};" for name in local if name not in read]
        return self.returned, "\n".join([*lines, *self.lines, "}", ""])

    # kinds

    def _infer(self, body: Sequence[ast.stmt]) -> None:
        for node in body:
            try:
                if isinstance(node, ast.Assign):
                    kind = self._expression(node.value)[1]
                    for target in node.targets:
                        self._note(target, kind)
                elif isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
                    whole = ast.BinOp(ast.Name(node.target.id, ast.Load()), node.op, node.value)
                    self._note(node.target, self._expression(whole)[1])
                elif isinstance(node, ast.For):
                    self._note(node.target, "d" if isinstance(node.iter, ast.Tuple) else "i")
                elif isinstance(node, ast.Return) and node.value is not None:
                    self.returned = _joined(self.returned, self._expression(node.value)[1])
            except _NotYet:
                continue
            finally:
                for block in ("body", "orelse"):
                    self._infer(getattr(node, block, []))

    def _note(self, target: ast.expr, kind: Kind) -> None:
        if isinstance(target, ast.Name) and target.id != "_":
            self.kinds[target.id] = _joined(self.kinds.get(target.id), kind)
        elif isinstance(target, ast.Tuple):
            for part, own in zip(target.elts, kind, strict=True):
                self._note(part, own)

    # statements

    def _put(self, depth: int, line: str) -> None:
        self.lines.append("    " * depth + line)

    def _block(self, body: Sequence[ast.stmt], depth: int) -> None:
        for node in body:
            self._statement(node, depth)

    def _statement(self, node: ast.stmt, depth: int) -> None:
        if isinstance(node, ast.Assign):
            self._assign(node, depth)
        elif isinstance(node, ast.AugAssign):
            target, kind = self._expression(_loaded(node.target))
            if type(node.op) in OPERATORS and (kind == "d" or not isinstance(node.op, ast.Div)):
                value = self._expression(node.value)[0]
                self._put(depth, f"{target} {OPERATORS[type(node.op)]}= {value};")
            else:
                whole = ast.BinOp(_loaded(node.target), node.op, node.value)
                self._put(depth, f"{target} = {self._expression(whole)[0]};")
        elif isinstance(node, ast.Expr):
            if not isinstance(node.value, ast.Constant):
                self._put(depth, f"{self._expression(node.value)[0]};")
        elif isinstance(node, ast.If):
            self._put(depth, f"if ({_bare(self._expression(node.test)[0])}) {{")
            self._block(node.body, depth + 1)
            if node.orelse:
                self._put(depth, "} else {")
                self._block(node.orelse, depth + 1)
            self._put(depth, "}")
        elif isinstance(node, ast.While) and not node.orelse:
            self._put(depth, f"while ({_bare(self._expression(node.test)[0])}) {{")
            self._block(node.body, depth + 1)
            self._put(depth, "}")
        elif isinstance(node, ast.For) and not node.orelse:
            self._for(node, depth)
        elif isinstance(node, ast.Return):
            value = "" if node.value is None else f" {self._as(self.returned, node.value)}"
            self._put(depth, f"return{value};")
        elif isinstance(node, (ast.Break, ast.Continue)):
            self._put(depth, f"{type(node).__name__.lower()};")
        elif not isinstance(node, ast.Pass):
            raise self._no_form(node)

    def _assign(self, node: ast.Assign, depth: int) -> None:
        target = node.targets[0]
        if isinstance(target, ast.Subscript) and ast.unparse(target.slice) == ":":
            (there, kind), (here, own) = map(self._expression, (target.value, node.value))
            if own in NUMBERS:
                sizes = [f"{there}.n[{k}]" for k in range(_axes(kind))]
                n = f"{there}.n" if kind == "a" else " * ".join(sizes)
                self.count += 1
                i, stop = f"i{self.count}_", f"n{self.count}_"
                self._put(depth, f"for (long {i} = 0, {stop} = {n}; {i} < {stop}; ++{i})")
                self._put(depth + 1, f"{there}.p[{i}] = {here};")
                return
            self._put(depth, f"memcpy({there}.p, {here}.p, (size_t){there}.n * sizeof(double));")
            return
        if len(node.targets) == 1 and not isinstance(target, ast.Tuple):
            kind = self._expression(_loaded(target))[1]
            value = self._as(kind, node.value)
            self._put(depth, f"{self._expression(_loaded(target))[0]} = {value};")
            return
        # Python evaluates the right-hand side before it assigns any part of it
        self._put(depth, "{")
        kind = self._expression(node.value)[1]
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            values = []
            for each in node.value.elts:
                text, own = self._expression(each)
                values.append((self._temporary(text, own, depth + 1), own))
        else:
            text = self._temporary(self._expression(node.value)[0], kind, depth + 1)
            values = [(text, kind)]
            if isinstance(target, ast.Tuple):
                values = [(f"{text}.f{k}", own) for k, own in enumerate(kind)]
        for place in node.targets:
            parts = place.elts if isinstance(place, ast.Tuple) else [place]
            for part, (value, own) in zip(parts, values, strict=True):
                if isinstance(part, ast.Name) and part.id == "_":
                    continue  # a value that nothing uses
                there, requested = self._expression(_loaded(part))
                self._put(depth + 1, f"{there} = {self._converted(value, own, requested)};")
        self._put(depth, "}")

    def _temporary(self, text: str, kind: Kind, depth: int) -> str:
        self.count += 1
        self._put(depth, f"const {self.module.type_of(kind)} t{self.count}_ = {text};")
        return f"t{self.count}_"

    def _for(self, node: ast.For, depth: int) -> None:
        call = node.iter
        if isinstance(call, ast.Tuple):
            values = ", ".join(self._expression(each)[0] for each in call.elts)
            self.count += 1
            i, each = f"i{self.count}_", f"each{self.count}_"
            self._put(depth, "{")
            self._put(depth + 1, f"const double {each}[] = {{{values}}};")
            self._put(depth + 1, f"for (int {i} = 0; {i} < {len(call.elts)}; ++{i}) {{")
            self._put(depth + 2, f"{_c(ast.unparse(node.target))} = {each}[{i}];")
            self._block(node.body, depth + 2)
            self._put(depth + 1, "}")
            self._put(depth, "}")
            return
        if not (isinstance(call, ast.Call) and ast.unparse(call.func) == "range"):
            raise self._no_form(call)
        bounds = [self._expression(argument)[0] for argument in call.args]
        begin, end = ("0", bounds[0]) if len(bounds) == 1 else bounds[:2]
        down = len(bounds) == 3
        if down and ast.unparse(call.args[2]) != "-1":
            raise self._no_form(call)
        self.count += 1
        i, stop = f"i{self.count}_", f"n{self.count}_"
        rise = f"{i} > {stop}; --{i}" if down else f"{i} < {stop}; ++{i}"
        self._put(depth, f"for (long {i} = {begin}, {stop} = {end}; {rise}) {{")
        if ast.unparse(node.target) != "_":
            self._put(depth + 1, f"{_c(ast.unparse(node.target))} = {i};")
        self._block(node.body, depth + 1)
        self._put(depth, "}")

    # expressions

    def _as(self, kind: Kind, node: ast.expr) -> str:
        """An expression as a value of a kind."""
        text, own = self._expression(node)
        if isinstance(kind, tuple) and isinstance(node, ast.Tuple):
            parts = ", ".join(map(self._as, kind, node.elts))
            return f"({self.module.type_of(kind)}){{{parts}}}"
        return self._converted(text, own, kind)

    def _converted(self, text: str, own: Kind, target: Kind) -> str:
        numbers = own in NUMBERS and target in NUMBERS and (own != "z" or target == "z")
        if own == target or numbers:
            return text
        if not (isinstance(own, tuple) and isinstance(target, tuple)):
            raise InputError(f"{self.node.name} has no form in C: {text} is {own}, not {target}")
        parts = [
            self._converted(f"{text}.f{k}", *pair)
            for k, pair in enumerate(zip(own, target, strict=True))
        ]
        return f"({self.module.type_of(target)}){{{', '.join(parts)}}}"

    def _expression(self, node: ast.expr) -> tuple[str, Kind]:
        """C text of an expression, and its kind."""
        write = getattr(self, f"_{type(node).__name__.lower()}", None)
        if write is None:
            raise self._no_form(node)
        text, kind = write(node)
        return text, kind

    def _constant(self, node: ast.Constant) -> tuple[str, Kind]:
        return _number(node.value)

    def _name(self, node: ast.Name) -> tuple[str, Kind]:
        if node.id in self.kinds:
            return _c(node.id), self.kinds[node.id]
        if node.id not in self.module.constants:
            raise _NotYet(node.id)
        value = self.module.constants[node.id]
        if not isinstance(value, tuple):
            return _number(value)
        shape, numbers = _table(value)
        own = f"{self.module.prefix}_{node.id}"
        sizes = "".join(f"[{n}]" for n in shape)
        element = "i" if re.fullmatch(r"[-0-9{}, ]+", numbers) else "d"
        self.module.tables[own] = f"static const {TYPES[element]} {own}{sizes} = {numbers};"
        return own, ("table", len(shape), element)

    def _attribute(self, node: ast.Attribute) -> tuple[str, Kind]:
        if node.attr in ("real", "imag"):
            return f"c{node.attr}({self._expression(node.value)[0]})", "d"
        known = {"nan": "NAN", "inf": "INFINITY", "pi": "3.141592653589793"}
        if node.attr in known:
            return known[node.attr], "d"
        text, kind = self._expression(node.value)
        if not isinstance(kind, Fields):
            raise self._no_form(node)
        at = kind.names.index(node.attr)
        return f"{text}.f{at}", kind[at]

    def _unaryop(self, node: ast.UnaryOp) -> tuple[str, Kind]:
        text, kind = self._expression(node.operand)
        if isinstance(node.op, ast.Not):
            return f"(!{text})", "b"
        if isinstance(node.op, ast.USub):
            return f"(-{text})", "i" if kind == "b" else kind
        raise self._no_form(node)

    def _binop(self, node: ast.BinOp) -> tuple[str, Kind]:
        (a, left), (b, right) = self._expression(node.left), self._expression(node.right)
        kind, op = _joined(left, right), type(node.op)
        if op is ast.Div:
            whole = kind in ("b", "i")
            return f"((double){a} / {b})" if whole else f"({a} / {b})", "d" if whole else kind
        if op in OPERATORS:
            return f"({a} {OPERATORS[op]} {b})", "i" if kind == "b" else kind
        if op is ast.Pow:
            return (f"pow({a}, {b})", "d") if kind == "d" else (f"((long)pow({a}, {b}))", "i")
        if kind != "d" and op in (ast.FloorDiv, ast.Mod):
            return f"{'over' if op is ast.FloorDiv else 'rest'}({a}, {b})", "i"
        if kind != "d" and op in (ast.LShift, ast.RShift):
            return f"({a} {'<<' if op is ast.LShift else '>>'} {b})", "i"
        if op is ast.FloorDiv:
            return f"floor({a} / {b})", "d"
        raise self._no_form(node)

    def _boolop(self, node: ast.BoolOp) -> tuple[str, Kind]:
        parts = [self._expression(value)[0] for value in node.values]
        return f"({(' && ' if isinstance(node.op, ast.And) else ' || ').join(parts)})", "b"

    def _compare(self, node: ast.Compare) -> tuple[str, Kind]:
        values = [self._expression(value)[0] for value in (node.left, *node.comparators)]
        signs = [COMPARED.get(type(op)) for op in node.ops]
        if None in signs:
            raise self._no_form(node)
        parts = [f"({values[k]} {sign} {values[k + 1]})" for k, sign in enumerate(signs)]
        return parts[0] if len(parts) == 1 else f"({' && '.join(parts)})", "b"

    def _ifexp(self, node: ast.IfExp) -> tuple[str, Kind]:
        test = self._expression(node.test)[0]
        kind = _joined(self._expression(node.body)[1], self._expression(node.orelse)[1])
        return f"({test} ? {self._as(kind, node.body)} : {self._as(kind, node.orelse)})", kind

    def _tuple(self, node: ast.Tuple) -> tuple[str, Kind]:
        parts = [self._expression(part) for part in node.elts]
        kind = tuple(part[1] for part in parts)
        return f"({self.module.type_of(kind)}){{{', '.join(part[0] for part in parts)}}}", kind

    def _subscript(self, node: ast.Subscript) -> tuple[str, Kind]:
        at = node.slice
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            text, kind = self._expression(node.value.value)
            return f"{text}.n" if kind == "a" else f"{text}.n[{ast.unparse(at)}]", "i"
        text, kind = self._expression(node.value)
        if kind == "a" and isinstance(at, ast.Slice) and at.step is None:
            begin = "0" if at.lower is None else self._expression(at.lower)[0]
            end = f"{text}.n" if at.upper is None else self._expression(at.upper)[0]
            return f"part({text}, {begin}, {end})", "a"
        if isinstance(kind, Fields) and isinstance(at, ast.Slice):
            bounds = (None if b is None else int(ast.unparse(b)) for b in (at.lower, at.upper))
            chosen = range(len(kind))[slice(*bounds)]
            some = tuple(kind[k] for k in chosen)
            own = ", ".join(f"{text}.f{k}" for k in chosen)
            return f"({self.module.type_of(some)}){{{own}}}", some
        if isinstance(kind, tuple) and kind[0] == "table":
            _, depth, element = kind
            part = ("table", depth - 1, element) if depth > 1 else element
            return f"{text}[{self._expression(at)[0]}]", part
        if isinstance(kind, tuple) and isinstance(at, ast.Constant) and isinstance(at.value, int):
            return f"{text}.f{at.value}", kind[at.value]
        places = at.elts if isinstance(at, ast.Tuple) else [at]
        axes = _axes(kind)
        if axes < len(places) or any(
            isinstance(place, (ast.UnaryOp, ast.Slice)) for place in places
        ):
            raise self._no_form(node)
        index = self._expression(places[0])[0]
        for axis, place in enumerate(places[1:], 1):
            index = f"({index} * {text}.n[{axis}] + {self._expression(place)[0]})"
        if len(places) == axes:
            return f"{text}.p[{_bare(index)}]", "d" if kind == "a" else kind[0]
        # the places left are an array of fewer axes
        sizes = [f"{text}.n[{axis}]" for axis in range(len(places), axes)]
        return self._view(kind[0], f"{text}.p + {' * '.join([index, *sizes])}", sizes)

    def _view(self, element: str, begin: str, sizes: Sequence[str]) -> tuple[str, Kind]:
        """Array of several axes, or of one, from the place of its first number."""
        kind = array_kind(element, len(sizes))
        lengths = sizes[0] if kind == "a" else f"{{{', '.join(sizes)}}}"
        return f"({self.module.type_of(kind)}){{{begin}, {lengths}}}", kind

    def _call(self, node: ast.Call) -> tuple[str, Kind]:
        name = ast.unparse(node.func)
        if isinstance(node.func, ast.Attribute) and node.func.attr == "reshape":
            text, kind = self._expression(node.func.value)
            sizes = node.args[0].elts if isinstance(node.args[0], ast.Tuple) else node.args
            lengths = [self._expression(size)[0] for size in sizes]
            return self._view("d" if kind == "a" else kind[0], f"{text}.p", lengths)
        if name in ("unsigned", "np.int64"):
            return self._expression(node.args[0])
        if name in self.module.external:
            texts = [self._expression(argument)[0] for argument in node.args]
            kind, own = self.module.external[name]
            return f"{name}({', '.join(map(_bare, texts))})" if own else "(void)0", kind
        if name in self.module.records:
            text, kind = self._tuple(ast.Tuple(node.args, ast.Load()))
            return text, Fields(self.module.records[name], kind)
        if name in self.module.sources:
            arguments = [self._expression(argument) for argument in node.args]
            own, kind = self.module.function(name, [kind for _, kind in arguments])
            if kind is None:
                raise _NotYet(name)
            return f"{own}({', '.join(_bare(text) for text, _ in arguments)})", kind
        arguments = [self._expression(argument) for argument in node.args]
        texts, kinds = [text for text, _ in arguments], [kind for _, kind in arguments]
        if name in ("max", "min"):
            whole = "d" not in kinds
            call = ("larger" if name == "max" else "smaller") + "_whole" * whole
            text = texts[0]
            for other in texts[1:]:
                text = f"{call}({text}, {other})"
            return text, "i" if whole else "d"
        if name == "complex":
            return f"({texts[0]} + {texts[1]} * I)", "z"
        if name == "abs":
            if kinds[0] == "z":
                return f"cabs({texts[0]})", "d"
            return f"{'fabs' if kinds[0] == 'd' else 'magnitude'}({texts[0]})", kinds[0]
        if name == "len" and kinds[0] == "a":
            return f"{texts[0]}.n", "i"
        if name in ("int", "float"):
            kind = name[0].replace("f", "d")
            return f"(({TYPES[kind]}){texts[0]})", kind
        module, _, function = name.rpartition(".")
        function = RENAMED.get(function, function)
        if name == "np.exp" and kinds == ["z"]:
            return f"cexp({texts[0]})", "z"
        if module in ("np", "math") and function in MATHEMATICS:
            return f"{function}({', '.join(texts)})", "d"
        raise self._no_form(node)

    def _no_form(self, node: ast.AST) -> InputError:
        return InputError(f"{self.node.name} has no form in C: it uses {ast.unparse(node)!r}")


def _loaded(node: Any) -> ast.expr:
    (statement,) = parse(ast.unparse(node)).body
    assert isinstance(statement, ast.Expr)
    return statement.value


def _c(name: str) -> str:
    return f"{name}_" if name in KEYWORDS or name in MATHEMATICS else name


def _bare(text: str) -> str:
    """Without the brackets around all of it."""
    if not (text.startswith("(") and text.endswith(")")):
        return text
    depth = 0
    for k, sign in enumerate(text):
        depth += (sign == "(") - (sign == ")")
        if depth == 0 and k + 1 < len(text):
            return text
    return text[1:-1]


def _number(value: Any) -> tuple[str, Kind]:
    if isinstance(value, bool):
        return str(int(value)), "b"
    if value == 0j and isinstance(value, complex):
        return "0.0", "z"
    if not isinstance(value, (int, float)):
        raise InputError(f"{value!r} has no form in C")
    text = repr(value).replace("inf", "INFINITY").replace("nan", "NAN")
    return f"({text})" if value < 0 else text, "i" if isinstance(value, int) else "d"


def _table(value: tuple) -> tuple[tuple[int, ...], str]:
    """Shape and C text of a tuple of numbers, or of tuples of them."""
    if not isinstance(value[0], tuple):
        return (len(value),), "{" + ", ".join(map(repr, value)) + "}"
    rows = [_table(row) for row in value]
    return (len(value), *rows[0][0]), "{" + ", ".join(text for _, text in rows) + "}"
