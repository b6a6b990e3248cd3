"""Graphs of operations and the programs that they become: values beside SymPy, derivatives beside
differences, what is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose

from fmbs_skfem.core.compiling import programs
from fmbs_skfem.core.compiling.graphs import JUMPS, RULES, Graph, GraphProgram
from fmbs_skfem.core.compiling.symbols import Drawing, chosen, less
from fmbs_skfem.core.errors import InputError

x, y, z = sympy.symbols("x y z", real=True)
#: two cubics, see `curves`
CURVE = (
    0.0,
    3.0,
    0.0,
    1.0,
    3.0,
    0.5,
    -1.0,
    2.0,
    0.1,
    -0.3,
    0.2,
    0.4,
    1.6,
)
EXPRESSIONS = (
    x**3 * y - 2 / y**2 + sympy.Rational(1, 3) * z,
    sympy.sqrt(x) * x ** sympy.Rational(-3, 2) + y**sympy.pi + x**20,
    sympy.sin(x) * sympy.cos(y) - sympy.tan(x * z) / sympy.exp(y),
    sympy.atan2(y - 1, x) + sympy.atan(z) + sympy.asin(x / 3) - sympy.acos(y / 4) + sympy.erf(x),
    sympy.sinh(x)
    + sympy.cosh(y) * sympy.tanh(z)
    + sympy.asinh(x)
    + sympy.acosh(y + 1)
    + sympy.atanh(x / 3),
    sympy.Abs(x - y) * sympy.sign(z - 1) + sympy.log(y) + sympy.floor(3 * x) + sympy.ceiling(3 * y),
    sympy.Min(x, y, z) - sympy.Max(x, 2 * z) + sympy.Mod(5 * x, y) + sympy.sec(z) + sympy.cot(x),
    sympy.Piecewise((x, (x < y) & (z > 0.5)), (y, sympy.Or(x >= 2 * y, sympy.Ne(z, 1))), (z, True)),
    chosen(less(x, y), x * y, y**2) + sympy.Heaviside(x - y, 1),
)


def value_of(
    program: GraphProgram, numbers: Sequence[float], values: dict[Any, float]
) -> list[float]:
    """The results of a program, run by itself."""
    ahead = [*program.constants, *(values[name] for name in program.symbols)]
    room = np.array([*ahead, *[0.0] * len(program.operations)])
    operations = np.array(program.operations, dtype=np.int64).reshape(-1, 4)
    programs.run(operations, len(ahead), room, np.array(numbers, dtype=float))
    return [float(room[place]) for place in program.results]


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_programs_are_what_their_symbols_say(expression: Any) -> None:
    drawing = Drawing({x: "x", y: "y", z: "z"})
    program = drawing.graph.program([drawing.node(expression)])
    plain = expression.replace(chosen, lambda c, a, b: sympy.Piecewise((a, c > 0), (b, True)))
    plain = plain.replace(less, lambda a, b: sympy.Piecewise((1, a < b), (0, True)))
    exact = sympy.lambdify((x, y, z), plain, "math")
    for given in np.random.default_rng(4).uniform(0.2, 1.8, (8, 3)):
        values = dict(zip("xyz", given, strict=True))
        assert_allclose(value_of(program, (), values), [exact(*given)], rtol=1e-12)


@pytest.mark.parametrize(
    "operation", sorted({*RULES, *JUMPS, programs.CHOOSE} - {programs.LOOKUP_SLOPE})
)
def test_derivatives_are_those_of_differences(operation: int) -> None:
    """First and second ones along a direction, so of the rules' own operations, too."""
    graph, count = Graph(), 3 if operation == programs.CHOOSE else len(RULES.get(operation, (0, 0)))
    names = "abc"[:count]
    symbols = [graph.symbol(name) for name in names]
    # the arguments are functions themselves, for the rule of the chain
    parts = [
        graph.node(programs.MULTIPLY, one, graph.node(programs.ADD, one, graph.constant(0.1)))
        for one in symbols
    ]
    curve = operation in (programs.LOOKUP, programs.BEYOND)
    f = graph.add(operation, parts[0], 0, len(CURVE)) if curve else graph.node(operation, *parts)
    along = {
        one: graph.constant(value) for one, value in zip(symbols, (1.0, -0.7, 0.4), strict=False)
    }
    first = graph.derivatives([f], along)
    second = graph.derivatives(first, along)
    program = graph.program([f, *first, *second])
    low = 1.1 if operation == programs.ACOSH else 0.3

    def at(a: np.ndarray) -> np.ndarray:
        return np.array(value_of(program, CURVE, dict(zip(names, a, strict=True))))

    h, direction = 1e-4, np.array([1.0, -0.7, 0.4])[:count]
    for a in np.random.default_rng(operation).uniform(low, low + 0.4, (5, count)):
        found = at(a)
        slopes = (
            8 * (at(a + h * direction) - at(a - h * direction))
            - at(a + 2 * h * direction)
            + at(a - 2 * h * direction)
        ) / (12 * h)
        assert_allclose(found[1], slopes[0], rtol=1e-7, atol=1e-7)
        if not curve:
            assert_allclose(found[2], slopes[1], rtol=1e-7, atol=1e-7)


def test_operations_are_there_once_and_zeros_not_at_all() -> None:
    graph = Graph()
    a, b, zero, one = graph.symbol("a"), graph.symbol("b"), graph.constant(0.0), graph.constant(1.0)
    product = graph.node(programs.MULTIPLY, a, b)
    assert graph.node(programs.MULTIPLY, a, b) == product
    assert graph.product([one, a, one]) == a
    assert graph.sum([zero, a, zero]) == a
    assert graph.node(programs.NEGATE, graph.node(programs.NEGATE, a)) == a
    assert graph.value(graph.node(programs.MULTIPLY, product, zero)) == 0.0
    assert graph.node(programs.CHOOSE, b, a, a) == a
    assert graph.program([product]) == GraphProgram(
        (), ("a", "b"), ((programs.MULTIPLY, 0, 1, 0),), (2,)
    )
    long = graph.sum([graph.node(programs.SIN, graph.symbol(k)) for k in range(5000)])
    (slope,) = graph.derivatives([long], {graph.symbol(4999): one})
    assert graph.nodes[slope][0] == programs.COS


def test_functions_that_no_program_has_are_named() -> None:
    with pytest.raises(
        InputError, match=r"expected functions among sin, .*, got besselj in besselj\(0, x\)"
    ):
        Drawing({x: "x"}).node(sympy.besselj(0, x))
