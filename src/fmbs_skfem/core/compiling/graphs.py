"""Graphs of real operations: every one is there once, derivatives are further ones, and results
become programs.

    graph = Graph()
    x, y = graph.symbol("x"), graph.symbol("y")                  nodes are numbers
    f = graph.node(MULTIPLY, x, graph.node(SIN, y))              f = x sin y
    graph.derivatives([f], {y: graph.constant(1.0)})             x cos y

Derivatives are found forwards, operation by operation (A. Griewank, A. Walther, Evaluating
Derivatives, SIAM 2008, chapter 3, 10.1137/1.9780898717761). What only jumps has none: that of a
choice is the derivative of what is chosen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

from . import programs
from .programs import (
    ABS,
    ACOS,
    ACOSH,
    ADD,
    ASIN,
    ASINH,
    ATAN,
    ATAN2,
    ATANH,
    CHOOSE,
    CONTINUE,
    COS,
    COSH,
    DIVIDE,
    ERF,
    EXP,
    LOG,
    LOOKUP,
    MULTIPLY,
    NEGATE,
    POWER,
    SIGN,
    SIN,
    SINH,
    SQRT,
    SUBTRACT,
    TAN,
    TANH,
)

Node: TypeAlias = int

CONSTANT, SYMBOL = -1, -2  #: of what is no operation

#: whose derivatives are left out
JUMPS = frozenset(
    (
        programs.LESS,
        programs.NOT_MORE,
        programs.EQUAL,
        SIGN,
        programs.FLOOR,
        programs.LOOKUP_SLOPE,
        programs.BEYOND,
    )
)
#: whose second and third numbers say where the numbers of a curve are
CURVES = frozenset((LOOKUP, programs.LOOKUP_SLOPE, programs.BEYOND))


class GraphProgram(NamedTuple):
    """What gives results, in the order of a room of numbers: constants, what is read, results of
    operations.
    """

    constants: tuple[float, ...]
    symbols: tuple[Any, ...]  #: that are read
    #: an operation and the places in the room that it reads
    operations: tuple[tuple[int, int, int, int], ...]
    results: tuple[int, ...]  #: their places in the room


class Graph:
    """Operations by number, each with the numbers of what it reads, which come before it."""

    def __init__(self) -> None:
        self.nodes = list[tuple[Any, ...]]()
        self.known = dict[tuple[Any, ...], Node]()

    def add(self, *parts: Any) -> Node:
        """The node of an operation, a constant or a symbol, which is made where there is none."""
        if parts not in self.known:
            self.known[parts] = len(self.nodes)
            self.nodes.append(parts)
        return self.known[parts]

    def symbol(self, name: Hashable) -> Node:
        return self.add(SYMBOL, name)

    def constant(self, value: float) -> Node:
        return self.add(CONSTANT, float(value))

    def value(self, node: Node) -> float | None:
        """The number that a node is; None of one that is none."""
        kind, first, *_ = self.nodes[node]
        return float(first) if kind == CONSTANT else None

    def node(self, operation: int, *parts: Node) -> Node:
        """An operation on nodes, or what it is without one: zeros, ones and choices between equals
        are left out.
        """
        if operation in SIMPLIFICATIONS:
            simpler = SIMPLIFICATIONS[operation](self, *parts)
            if simpler is not None:
                return simpler
        if operation in FOLDED:
            values = [self.value(part) for part in parts]
            if None not in values:
                return self.constant(FOLDED[operation](*values))
        return self.add(operation, *parts)

    def sum(self, parts: Sequence[Node]) -> Node:
        """a + b + c ..., subtracting what is negative."""
        total = self.constant(0.0)
        for part in parts:
            kind, *inner = self.nodes[part]
            total = (
                self.node(SUBTRACT, total, inner[0])
                if kind == NEGATE
                else self.node(ADD, total, part)
            )
        return total

    def product(self, parts: Sequence[Node]) -> Node:
        """a b c ..."""
        total = self.constant(1.0)
        for part in parts:
            total = self.node(MULTIPLY, total, part)
        return total

    def derivatives(self, nodes: Sequence[Node], along: Mapping[Node, Node]) -> list[Node]:
        """Derivatives of nodes along a direction: how much each symbol changes, nodes too, 0 for
        all others.
        """
        slopes = dict[Node, Node]()
        # in the order of their numbers, as recursion would be as deep as the longest sum
        for node in self.needed(nodes):
            slopes[node] = along[node] if node in along else self.slope(node, slopes)
        return [slopes[node] for node in nodes]

    def slope(self, node: Node, slopes: Mapping[Node, Node]) -> Node:
        """The derivative of a node from those of all that it reads."""
        operation, *parts = self.nodes[node]
        if operation in (CONSTANT, SYMBOL) or operation in JUMPS:
            return self.constant(0.0)
        if operation == CHOOSE:
            condition, *branches = parts
            return self.node(CHOOSE, condition, *(slopes[one] for one in branches))
        found = list[Node]()
        for part, rule in zip(parts, RULES[operation], strict=False):
            inner = slopes[part]
            if self.value(inner) != 0.0:
                found.append(self.node(MULTIPLY, rule(self, node, *parts), inner))
        return self.sum(found)

    def needed(self, nodes: Sequence[Node]) -> list[Node]:
        """All nodes that these read, and themselves, in their order."""
        found = set[Node]()
        waiting = list(nodes)
        while waiting:
            node = waiting.pop()
            if node not in found:
                found.add(node)
                waiting += self.read_by(node)
        return sorted(found)

    def program(self, results: Sequence[Node]) -> GraphProgram:
        """What gives these nodes, and no more."""
        order = self.needed(results)
        kinds = {
            kind: [node for node in order if self.nodes[node][0] == kind]
            for kind in (CONSTANT, SYMBOL)
        }
        computed = [node for node in order if self.nodes[node][0] >= 0]
        place = {node: k for k, node in enumerate([*kinds[CONSTANT], *kinds[SYMBOL], *computed])}

        def operation(node: Node) -> tuple[int, int, int, int]:
            kind, *parts = self.nodes[node]
            places = (
                [place[parts[0]], *parts[1:]] if kind in CURVES else [place[one] for one in parts]
            )
            a, b, c = [*places, 0, 0][:3]
            return kind, a, b, c

        return GraphProgram(
            tuple(self.nodes[node][1] for node in kinds[CONSTANT]),
            tuple(self.nodes[node][1] for node in kinds[SYMBOL]),
            tuple(map(operation, computed)),
            tuple(place[node] for node in results),
        )

    def read_by(self, node: Node) -> list[Node]:
        """The nodes that a node reads."""
        kind, *parts = self.nodes[node]
        if kind in (CONSTANT, SYMBOL):
            return []
        return parts[:1] if kind in CURVES else parts


def simplify_choice(graph: Graph, condition: Node, a: Node, b: Node) -> Node | None:
    """a where the condition is met, b where it is zero."""
    x = graph.value(condition)
    if x is None and a != b:
        return None
    return b if x == 0.0 else a


def simplify_sum(graph: Graph, a: Node, b: Node) -> Node | None:
    """0 + b, a + 0."""
    if graph.value(a) == 0.0:
        return b
    return a if graph.value(b) == 0.0 else None


def simplify_difference(graph: Graph, a: Node, b: Node) -> Node | None:
    """a - 0, 0 - b."""
    if graph.value(b) == 0.0:
        return a
    return graph.node(NEGATE, b) if graph.value(a) == 0.0 else None


def simplify_product(graph: Graph, a: Node, b: Node) -> Node | None:
    """Products with 0, 1 or -1."""
    values = graph.value(a), graph.value(b)
    if 0.0 in values:
        return graph.constant(0.0)
    for value, other in zip(values, (b, a), strict=True):
        if value == 1.0:
            return other
        if value == -1.0:
            return graph.node(NEGATE, other)
    return None


def simplify_quotient(graph: Graph, a: Node, b: Node) -> Node | None:
    """0 / b, a / 1."""
    return a if graph.value(a) == 0.0 or graph.value(b) == 1.0 else None


def simplify_negative(graph: Graph, a: Node) -> Node | None:
    """That of a negative."""
    kind, *inner = graph.nodes[a]
    return int(inner[0]) if kind == NEGATE else None


#: nodes that an operation can be left out for, by what it reads; None where it cannot
SIMPLIFICATIONS: Mapping[int, Callable[..., Node | None]] = {
    CHOOSE: simplify_choice,
    ADD: simplify_sum,
    SUBTRACT: simplify_difference,
    MULTIPLY: simplify_product,
    DIVIDE: simplify_quotient,
    NEGATE: simplify_negative,
}

#: operations that give a constant where they read constants
FOLDED: Mapping[int, Callable[..., float]] = {
    ADD: lambda x, y: x + y,
    SUBTRACT: lambda x, y: x - y,
    MULTIPLY: lambda x, y: x * y,
    NEGATE: lambda x: -x,
}

Rule: TypeAlias = Callable[..., Node]


def one(graph: Graph, *_: Any) -> Node:
    return graph.constant(1.0)


def over_root(sign: float, square: float) -> Rule:
    """1 / sqrt(sign x^2 + square), as in derivatives of asin, asinh and acosh."""

    def rule(graph: Graph, f: Node, x: Node) -> Node:
        squared = graph.node(MULTIPLY, graph.constant(sign), graph.node(MULTIPLY, x, x))
        return graph.node(
            DIVIDE,
            graph.constant(1.0),
            graph.node(SQRT, graph.node(ADD, graph.constant(square), squared)),
        )

    return rule


def over_square(sign: float) -> Rule:
    """1 / (1 + sign x^2), the derivative of atan and atanh."""

    def rule(graph: Graph, f: Node, x: Node) -> Node:
        squared = graph.node(MULTIPLY, graph.constant(sign), graph.node(MULTIPLY, x, x))
        return graph.node(
            DIVIDE, graph.constant(1.0), graph.node(ADD, graph.constant(1.0), squared)
        )

    return rule


def squared_and(sign: float) -> Rule:
    """1 + sign f^2, the derivative of tan and tanh by their value f."""
    return lambda graph, f, x: graph.node(
        ADD,
        graph.constant(1.0),
        graph.node(MULTIPLY, graph.constant(sign), graph.node(MULTIPLY, f, f)),
    )


def power_by_base(graph: Graph, f: Node, x: Node, y: Node) -> Node:
    """y x^(y - 1), which is a number where x is zero, too."""
    return graph.node(
        MULTIPLY, y, graph.node(POWER, x, graph.node(SUBTRACT, y, graph.constant(1.0)))
    )


def error_slope(graph: Graph, f: Node, x: Node) -> Node:
    """2 / sqrt(pi) exp(-x^2), the derivative of erf."""
    bell = graph.node(EXP, graph.node(NEGATE, graph.node(MULTIPLY, x, x)))
    return graph.node(MULTIPLY, graph.constant(2.0 / math.sqrt(math.pi)), bell)


def by_angle(sign: float, other: int) -> Rule:
    """sign b / (a^2 + b^2), of the other one of a and b: a derivative of atan2."""

    def rule(graph: Graph, f: Node, *parts: Node) -> Node:
        squares = [graph.node(MULTIPLY, one, one) for one in parts]
        return graph.node(
            DIVIDE,
            graph.node(MULTIPLY, graph.constant(sign), parts[other]),
            graph.node(ADD, squares[0], squares[1]),
        )

    return rule


#: derivatives of an operation f by each of the numbers that it reads
RULES: Mapping[int, tuple[Rule, ...]] = {
    ADD: (one, one),
    SUBTRACT: (one, lambda graph, f, x, y: graph.constant(-1.0)),
    MULTIPLY: (lambda graph, f, x, y: y, lambda graph, f, x, y: x),
    DIVIDE: (
        lambda graph, f, x, y: graph.node(DIVIDE, graph.constant(1.0), y),
        lambda graph, f, x, y: graph.node(NEGATE, graph.node(DIVIDE, f, y)),
    ),
    POWER: (power_by_base, lambda graph, f, x, y: graph.node(MULTIPLY, f, graph.node(LOG, x))),
    ATAN2: (by_angle(1.0, 1), by_angle(-1.0, 0)),
    CONTINUE: (one,),
    NEGATE: (lambda graph, f, x: graph.constant(-1.0),),
    SQRT: (lambda graph, f, x: graph.node(DIVIDE, graph.constant(0.5), f),),
    EXP: (lambda graph, f, x: f,),
    LOG: (lambda graph, f, x: graph.node(DIVIDE, graph.constant(1.0), x),),
    SIN: (lambda graph, f, x: graph.node(COS, x),),
    COS: (lambda graph, f, x: graph.node(NEGATE, graph.node(SIN, x)),),
    TAN: (squared_and(1.0),),
    ASIN: (over_root(-1.0, 1.0),),
    ACOS: (lambda graph, f, x: graph.node(NEGATE, over_root(-1.0, 1.0)(graph, f, x)),),
    ATAN: (over_square(1.0),),
    SINH: (lambda graph, f, x: graph.node(COSH, x),),
    COSH: (lambda graph, f, x: graph.node(SINH, x),),
    TANH: (squared_and(-1.0),),
    ASINH: (over_root(1.0, 1.0),),
    ACOSH: (over_root(1.0, -1.0),),
    ATANH: (over_square(-1.0),),
    ABS: (lambda graph, f, x: graph.node(SIGN, x),),
    ERF: (error_slope,),
    LOOKUP: (lambda graph, f, x, first, last: graph.add(programs.LOOKUP_SLOPE, x, first, last),),
}
