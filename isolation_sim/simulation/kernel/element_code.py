"""Write the compiled functions of an element from its law.

They are one module for each law, which the integration of any structure calls by the address of
``element``. The numbers of an element are in one flat float64 array, at ``base + slot * LANES +
lane``. The same text therefore serves a single run (one lane) and a batch (several lanes, which the
compiler turns into vector instructions). All quantities are those of the device in its own scale;
the rows and columns of the structure contain the scales.

A device of several directions has consecutive elements, one per direction. The functions are
written for the first element, which has the states and parameters, and also update the others.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from ...laws.emit import function_text, kinks, own_slopes, straight_line, symbols
from ...laws.law import Law
from .collocation import COLLOCATION, END_FROM_NODES, GAIN_SLOPE, NODES, RATES_FROM_NODES
from .slots import COMMON, OPERATIONS

KINK_FACTOR = 10.0
"""Weight of the error at a kink: a switching controller makes many kinks with similar errors."""

_GENERAL = {"h": "p", "tau": "p", "share": "q", "table": "array", "states": "array"}


def _general(arguments: str) -> str:
    """Arguments of an operation by their names in ``element``."""
    return ", ".join(_GENERAL.get(name, name) for name in arguments.split(", "))


def _indented(lines: Sequence[str]) -> list[str]:
    """Lines of a nested block."""
    return [f"    {line}" for line in lines]


def lagrange(nodes: Sequence[float], at: float) -> list[float]:
    """Values at ``at`` of the Lagrange polynomials through ``nodes``."""
    weights = []
    for i, a in enumerate(nodes):
        others = [b for j, b in enumerate(nodes) if j != i]
        weights.append(float(np.prod([(at - b) / (a - b) for b in others])))
    return weights


_BY_DIRECTION = re.compile(
    r"\b(d[012]|v[012]|d_end|v_end|f[012]|new_f[012]|f_start|force_end|force_scale|k_ref|c_ref"
    r"|late|early|own_odd|own_even|moved)\b"
)
"""Variables of the written statements that exist once per direction."""


def along(name: str, direction: int) -> str:
    """Name of a variable in one direction; unchanged for the first direction."""
    return f"{name}_along{direction}" if direction else name


def _sum(coefficients: Sequence[float], names: Sequence[str]) -> str:
    return " + ".join(f"{c!r} * {n}" for c, n in zip(coefficients, names, strict=True))


class ElementCode:
    """Slots and functions of one law's elements."""

    def __init__(self, law: Law):
        self.law = law
        n = len(law.states)
        self.states = [f"s{i}" for i in range(n)]
        self.parameters = [f"p{k}" for k in range(len(law.parameters))]
        self.directions = range(law.directions)
        motion = [along(name, a) for a in self.directions for name in ("x", "v")]
        moving = symbols(motion)
        s, p = tuple(symbols(self.states)), tuple(symbols(self.parameters))
        inputs = dict(zip(motion, moving, strict=True))
        inputs |= dict(zip(self.states + self.parameters, s + p, strict=True))
        forces, rates = law.respond(tuple(moving[::2]), tuple(moving[1::2]), s, p)
        outputs = [*forces, *rates]
        self.hoisted, self.coefficients, self.statements, self.results = straight_line(
            inputs, outputs, hoist=self.parameters
        )
        self.derived = [q for q in self.coefficients if q not in self.parameters]
        self.relaxation = own_slopes(inputs, rates, s) if n else ([], [])
        self.motion = motion
        self.kinks = kinks(inputs, outputs, [*motion, *self.states])
        self.start = [f"start{i}" for i in range(n)]
        self.end = [f"end{i}" for i in range(n)]
        self.scale = [f"scale{i}" for i in range(n)]
        self.rate = [f"rate{i}" for i in range(n)]
        self.end_rate = [f"end_rate{i}" for i in range(n)]
        self.slots = [*COMMON, *(f"{s}_{j}" for s in self.states for j in range(3))]
        self.slots += self.start + self.end + self.scale + self.rate + self.end_rate
        # three nodes and the end of the step have different currents while the coil current changes
        self.slots += [f"{q}_{j}" for j in range(4) for q in self.parameters]
        self.slots += [f"{q}_{j}" for j in range(4) for q in self.derived]
        self.slots += [f"relax{i}" for i in range(n)]
        self.slots += [f"gain{i}_{j}{k}" for i in range(n) for j in range(3) for k in range(3)]

    def slot(self, name: str, direction: int = 0) -> str:
        """Place of a number, from the first element's base."""
        slot = str(self.slots.index(name))
        return f"({direction} * STRIDE + {slot}) * LANES" if direction else f"{slot} * LANES"

    def at(self, name: str, direction: int = 0) -> str:
        """Expression for the number in a slot."""
        return f"read(w, b, {self.slot(name, direction)})"

    def load(self, *names: str, direction: int = 0) -> list[str]:
        """Statements that read slots to variables of the same names."""
        return [f"{along(n, direction)} = {self.at(n, direction)}" for n in names]

    def put(self, slot: str, value: str, direction: int = 0) -> str:
        """Statement that writes a slot in the active lanes, by a select without a branch."""
        return f"write(w, b, {self.slot(slot, direction)}, {value}, on)"

    def store(self, *names: str, direction: int = 0) -> list[str]:
        """Statements that write variables to their slots."""
        return [self.put(n, along(n, direction), direction) for n in names]

    def respond(self, x: str, v: str, states: Sequence[str], j: int) -> str:
        """Call of the law at node ``j``: forces along each direction, then rates."""
        motion = [along(name, a) for a in self.directions for name in (x, v)]
        arguments = [*motion, *states, *(f"{q}_{j}" for q in self.coefficients)]
        return f"respond({', '.join(arguments)})"

    def text(self, lanes: int, shared: bool) -> str:
        """All functions of this law, as Numba source; ``element`` calls one for a mask of lanes."""
        written, calls = self._of_law(), []
        for k, (name, numbers) in enumerate(OPERATIONS.items()):
            arguments = ", ".join(filter(None, ["w", "base", numbers, "mask"]))
            by_lane = lanes > 1 and not (shared and "table" in numbers)
            body = [f"at = first{' + lane' if by_lane else ''}"] if "first" in numbers else []
            body += self._body(name)
            if lanes == 1:
                body = ["if mask[0]:", *_indented(["b, on = base, True", *body])]
                written.append(function_text(name, arguments, body))
            else:
                # a loop becomes vector instructions in a function of its own
                body = ["b, on = base + lane, mask[lane] != 0", *body]
                body = ["for lane in range(LANES):", *_indented(body)]
                written.append(function_text(name, arguments, body, "@inner"))
            calls.append(f"{'elif' if k else 'if'} operation == {k}:")
            calls += _indented([f"{name}({_general(arguments)})"])
        arguments = "operation, w, base, p, q, array, first, mask"
        return "\n\n".join([*written, function_text("element", arguments, calls, "")])

    def _of_law(self) -> list[str]:
        """Force and rates of the law, and its switching functions if it has any."""
        motion = [*self.motion, *self.states]
        arguments = ", ".join([*motion, *self.coefficients])
        body = [*self.statements, f"return ({', '.join(self.results)},)"]
        written = [function_text("respond", arguments, body)]
        statements, signs = self.kinks
        if signs:
            body = [*statements, f"return ({', '.join(signs)},)"]
            written.append(function_text("kinks", ", ".join([*motion, *self.parameters]), body))
        return written

    def _body(self, operation: str) -> list[str]:
        """Statements of an operation for one lane."""
        if operation == "prepare_held":
            return self._prepare([0], copies=[1, 2, 3])
        if operation == "prepare_moving":
            return self._prepare([0, 1, 2, 3], copies=[])
        body: list[str] = getattr(self, f"_{operation}")()
        return body

    def _prepare(self, nodes: list[int], copies: list[int]) -> list[str]:
        """Expressions of only the parameters, at these nodes; copies get the last values."""
        body = []
        for j in nodes:
            body += [f"{p} = {self.at(f'{p}_{j}')}" for p in self.parameters]
            body += self.hoisted
            body += [self.put(f"{q}_{j}", f"{q}") for q in self.derived]
        for j in copies:
            body += [self.put(f"{q}_{j}", f"{q}") for q in self.parameters + self.derived]
        return body or ["pass"]

    def _row(self, r: int, forces: Sequence[str], direction: int = 0) -> str:
        """Row r of the response to the element's own nodal forces, added to the present value."""
        response = self.at(COMMON[r], direction)
        own = f"{direction} * (N_ELEMENTS + 1) * 24 + " if direction else ""
        for k, f in enumerate(forces):
            row = f"({own}{8 * k + r}) * TABLE_LANES"
            response = f"fused(read(table, at, {row}), {along(f, direction)}, {response})"
        return response

    def _relax(self) -> list[str]:
        """Relaxation of each state, d rate / d state, and the collocation with it."""
        # The linear part of the rate, relax * (state - start), is moved to the left side of the
        # collocation s = start + h C rate(s). The remaining part hardly depends on the state. This
        # speeds up the iteration and does not change its solution. It is not used for a state that
        # grows, or whose rate has a kink here.
        statements, results = self.relaxation
        body = []
        for a in self.directions:
            body += [f"{along('x', a)} = {self.at('d_start', a)}"]
            body += [f"{along('v', a)} = {self.at('v_start', a)}"]
        body += [f"{s} = {self.at(f'start{i}')}" for i, s in enumerate(self.states)]
        body += [f"{p} = {self.at(f'{p}_0')}" for p in self.parameters]
        body += statements
        for i, result in enumerate(results):
            body.append(f"relax = {result}")
            body.append("relax = relax if -HOPELESS < relax < 0.0 else 0.0")
            body.append("m = h * relax")
            # (I - m C)**-1 C by Cayley and Hamilton
            body.append("scale = h / (1.0 + m * (m * (0.1 - m / 120.0) - 0.5))")
            body.append(self.put(f"relax{i}", "relax"))
            for j in range(3):
                for k in range(3):
                    c, slope = COLLOCATION[j][k], GAIN_SLOPE[j][k]
                    square = " + m * m / 120.0" if j == k else ""
                    gain = f"scale * ({c!r} + m * {slope!r}{square})"
                    body.append(self.put(f"gain{i}_{j}{k}", gain))
        return body

    def _iterate(self) -> list[str]:
        """One fixed-point iteration: response to the forces, rates, states, forces."""
        forces = ["f0", "f1", "f2"]
        body = self.load("change")
        for a in self.directions:
            body += self.load(*forces, "force_scale", "k_ref", "c_ref", direction=a)
        for j in range(3):
            for a in self.directions:
                body += self._motion(f"d{j}", f"v{j}", j, forces, a)
            body += self.load(*(f"{q}_{j}" for q in self.coefficients))
            body += self.load(*(f"{s}_{j}" for s in self.states))
            if self.states:
                call = self.respond(f"d{j}", f"v{j}", [f"{s}_{j}" for s in self.states], j)
                body.append(f"r{j} = {call}")
        body += self.load(*self.start, *self.scale)
        for i, s in enumerate(self.states):
            body += self.load(f"relax{i}", *(f"gain{i}_{j}{k}" for j in range(3) for k in range(3)))
            for j in range(3):
                rate = f"r{j}[{i + len(self.directions)}]"
                body.append(f"rest{j} = {rate} - relax{i} * ({s}_{j} - start{i})")
            for j in range(3):
                integral = " + ".join(f"gain{i}_{j}{k} * rest{k}" for k in range(3))
                body.append(f"new_{s}_{j} = start{i} + ({integral})")
                body.append(self.put(f"{s}_{j}", f"new_{s}_{j}"))
            moved = " + ".join(f"abs(new_{s}_{j} - {s}_{j})" for j in range(3))
            body.append(f"change = change + ({moved}) * scale{i}")
        for j in range(3):
            call = self.respond(f"d{j}", f"v{j}", [f"new_{s}_{j}" for s in self.states], j)
            body.append(f"r{j} = {call}")
            for a in self.directions:
                residual = f"r{j}[{a}] - k_ref * d{j} - c_ref * v{j}"
                body.append(self._along(f"new_f{j} = {residual}", a))
                body.append(self.put(f"f{j}", along(f"new_f{j}", a), a))
        for a in self.directions:
            moved = " + ".join(f"abs(new_f{j} - f{j})" for j in range(3))
            body.append(self._along(f"moved = ({moved}) * force_scale", a))
            body.append(f"change = change + {along('moved', a)}")
        return body + self.store("change")

    def _motion(self, d: str, v: str, j: int, forces: Sequence[str], direction: int) -> list[str]:
        """Statements for deformation and velocity at node j, or at the end (6)."""
        at_velocity = j + 1 if j == 6 else j + 3
        return [
            f"{along(d, direction)} = {self._row(j, forces, direction)}",
            f"{along(v, direction)} = {self._row(at_velocity, forces, direction)}",
        ]

    def _along(self, statement: str, direction: int) -> str:
        """A statement of the first direction, converted to another direction."""
        return re.sub(_BY_DIRECTION, lambda m: along(m[0], direction), statement)

    def _finish(self) -> list[str]:
        """States and force at the end, and defects of the polynomials at both ends."""
        # The polynomials are those of the force and of the states' rates. The odd part of the
        # defects is of third order in the step, and orthogonal to the functions that change the
        # response. The first term that changes the response is of sixth order. It is estimated
        # from the decrease per order: roughness = even part (fourth order) over odd part. At a
        # kink this estimate is not valid, and the parts may cancel. There the error of the
        # response is the defect itself, and the error of the states does not decrease with the
        # step's share of the sample.
        forces = ["f0", "f1", "f2"]
        body = self.load(*self.start)
        for a in self.directions:
            body += self.load(*forces, "force_scale", "k_ref", "c_ref", "f_start", direction=a)
            body += self._motion("d_end", "v_end", 6, forces, a)
        body += self.load(*(f"{q}_3" for q in self.coefficients))
        for i, s in enumerate(self.states):
            body += self.load(*(f"{s}_{j}" for j in range(3)))
            steps = [f"({s}_{j} - start{i})" for j in range(3)]
            body.append(f"end{i} = start{i} + {_sum(END_FROM_NODES, steps)}")
        body.append(f"r3 = {self.respond('d_end', 'v_end', self.end, 3)}")
        weights = [lagrange(NODES, t) for t in (0.0, 1.0)]
        at_start, at_end = (_sum(w, forces) for w in weights)
        body.append("odd, even = 0.0, 0.0")
        for a in self.directions:
            for line in (
                f"force_end = r3[{a}]",
                f"late = force_end - k_ref * d_end - c_ref * v_end - ({at_end})",
                f"early = f_start - ({at_start})",
                "own_odd = abs(late - early) * force_scale",
                "own_even = abs(late + early) * force_scale",
            ):
                body.append(self._along(line, a))
            body.append(f"odd, even = odd + {along('own_odd', a)}, even + {along('own_even', a)}")
        body.append("of_force = odd + even")
        body += [*self.load(*self.scale, *self.rate), "lasting = 0.0"]
        for i, s in enumerate(self.states):
            body += self.load(f"relax{i}")
            moved = [f"({s}_{j} - start{i})" for j in range(3)]
            at_start, at_end = (_sum((w @ RATES_FROM_NODES).tolist(), moved) for w in weights)
            body.append(f"end_rate{i} = r3[{i + len(self.directions)}]")
            body.append(f"late = h * end_rate{i} - ({at_end})")
            body.append(f"early = h * rate{i} - ({at_start})")
            body.append(f"miss = abs(late - early) * scale{i}")
            body.append("odd = odd + miss")
            body.append(f"even = even + abs(late + early) * scale{i}")
            # part of an odd defect (a Legendre polynomial) that remains at the end after relaxation
            body.append(f"m = -h * relax{i}")
            body.append("scale = 840.0 + m * (420.0 + m * (84.0 + m * (12.0 + m)))")
            body.append("lasting = lasting + miss * m * m * m / scale")
        body.append("defect = odd + even")
        body += self.load("roughness", "bent", "weight")
        body += ["kink = bent", *self._kink(forces)]
        body.append("last = roughness")
        body.append("roughness = min(max(even / (odd + TINY), 0.5 * roughness), 1.0)")
        body.append("error = weight * (defect * roughness * roughness * share + lasting)")
        at_kink = f"{KINK_FACTOR!r} * (defect + of_force * (share - 1.0))"
        body.append(f"error = {at_kink} if kink > 0.0 else error")
        body.append("roughness = last if kink > 0.0 else roughness")
        for a in self.directions:
            body += self.store("d_end", "v_end", "force_end", direction=a)
        return body + self.store(*self.end, *self.end_rate, "defect", "error", "roughness", "kink")

    def _kink(self, forces: Sequence[str]) -> list[str]:
        """Statements that set ``kink`` to 1 if a switching function of the law changes sign."""
        n = len(self.kinks[1])
        if not n:
            return []
        body = self.load(*(f"{p}_{j}" for p in self.parameters for j in range(4)))
        for a in self.directions:
            body += self.load("d_start", "v_start", direction=a)
        points = [("d_start", "v_start", self.start, 0)]
        for j in range(3):
            for a in self.directions:
                body += self._motion(f"d{j}", f"v{j}", j, forces, a)
            points.append((f"d{j}", f"v{j}", [f"{s}_{j}" for s in self.states], j))
        points.append(("d_end", "v_end", self.end, 3))
        for k, (x, v, states, j) in enumerate(points):
            motion = [along(name, a) for a in self.directions for name in (x, v)]
            arguments = [*motion, *states, *(f"{p}_{j}" for p in self.parameters)]
            body.append(f"side{k} = kinks({', '.join(arguments)})")
        for k in range(4):
            for m in range(n):
                body.append(f"kink = 1.0 if side{k}[{m}] * side{k + 1}[{m}] < 0.0 else kink")
        return body

    def _inside(self) -> list[str]:
        """Write the states at a fraction tau of the step, from the collocation polynomial."""
        body = []
        nodes = [0.0, *NODES]
        for m, a in enumerate(nodes):
            others = [c for c in nodes if c != a]
            scale = float(np.prod([a - c for c in others]))
            product = " * ".join(f"(tau - {c!r})" for c in others)
            body.append(f"weight{m} = {product} * {1.0 / scale!r}")
        for i, s in enumerate(self.states):
            names = [f"start{i}", *(f"{s}_{j}" for j in range(3))]
            body += self.load(*names)
            value = " + ".join(f"weight{m} * {n}" for m, n in enumerate(names))
            body.append(f"write(states, at, {i} * LANES, {value}, on)")
        return body if self.states else ["pass"]

    def _accept(self) -> list[str]:
        """Move to the step's end; extrapolate the initial guess of the next step."""
        body = []
        for a in self.directions:
            body += self.load(
                "f0", "f1", "f2", "force_end", "k_ref", "c_ref", "d_end", "v_end", "force_scale",
                direction=a,
            )  # fmt: skip
            body.append(self._along("f_start = force_end - k_ref * d_end - c_ref * v_end", a))
            body += [self.put("d_start", along("d_end", a), a)]
            body += [self.put("v_start", along("v_end", a), a)]
            for j in range(3):
                weights = lagrange([*NODES, 1.0], 1.0 + NODES[j])
                names = [along(f, a) for f in ("f0", "f1", "f2", "f_start")]
                body.append(self.put(f"f{j}", f"{_sum(weights, names)}", a))
            body += self.store("f_start", direction=a)
        # the scale of all directions is the largest force of them
        body += ["scale = force_scale"]
        for a in self.directions:
            body.append(f"scale = min(scale, 1.0 / (abs({along('force_end', a)}) + TINY))")
        for a in self.directions:
            body.append(self.put("force_scale", "scale", a))
        for i, s in enumerate(self.states):
            names = [f"start{i}", *(f"{s}_{j}" for j in range(3))]
            body += self.load(*names, f"end{i}", f"scale{i}")
            for j in range(3):
                guess = _sum(lagrange([0.0, *NODES], 1.0 + NODES[j]), names)
                body.append(self.put(f"{s}_{j}", f"{guess}"))
            body.append(self.put(f"start{i}", f"end{i}"))
            body += [*self.load(f"end_rate{i}"), self.put(f"rate{i}", f"end_rate{i}")]
            body.append(f"write(states, at, {i} * LANES, end{i}, on)")
            body.append(f"scale{i} = min(scale{i}, 1.0 / (abs(end{i}) + TINY))")
        for x, y in self._pairs():  # the states along x and y have one scale
            body += [f"{x} = min({x}, {y})", f"{y} = {x}"]
        return body + self.store(*self.scale)

    def _pairs(self) -> list[tuple[str, str]]:
        """Scales of each state along x and along y; effects have states of both at once."""
        scales = dict(zip((q.name for q in self.law.states), self.scale, strict=True))
        along_y = {name: f"{name.removesuffix('_x')}_y" for name in scales if name.endswith("_x")}
        return [(scales[x], scales[y]) for x, y in along_y.items() if y in scales]

    def _restart(self) -> list[str]:
        """Initial guess after a change of step length: constant values of the start."""
        body = self.load(*self.start)
        for a in self.directions:
            body += self.load("f_start", direction=a)
            body += [self.put(f"f{j}", along("f_start", a), a) for j in range(3)]
        for i, s in enumerate(self.states):
            body += [self.put(f"{s}_{j}", f"start{i}") for j in range(3)]
        return body

    def _probe(self) -> list[str]:
        """Force and rates at the present state, after a change of current."""
        body = self.load(*self.start, *(f"{q}_0" for q in self.coefficients))
        for a in self.directions:
            body += self.load("d_end", "v_end", direction=a)
        body.append(f"r0 = {self.respond('d_end', 'v_end', self.start, 0)}")
        body += [self.put("force_end", f"r0[{a}]", a) for a in self.directions]
        n = len(self.directions)
        return body + [self.put(f"rate{i}", f"r0[{n + i}]") for i in range(len(self.states))]
