"""From expressions in symbols to graphs of operations, or to the text of compiled functions in a
module of the cache folder.

What acts on a few rows is a program of a graph (`Drawing`), which nothing is compiled for. What
acts on all points of a body is text (`statements`), whose common subexpressions are computed once;
`bodies.symbolic` writes the frame around them.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable, Hashable, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, TypeAlias

import sympy
from sympy.printing.codeprinter import CodePrinter
from sympy.printing.pycode import PythonCodePrinter

from ..errors import InputError, say
from ..values.expressions import Algebra
from . import programs
from .compilation import LAW
from .graphs import Graph, Node
from .jit import cache_folder

Expression: TypeAlias = Any


class Printer(PythonCodePrinter):
    """Small powers as products, and numbers as floats."""

    def _print_Pow(self, power: Expression, rational: bool = False) -> str:
        base = self.parenthesize(power.base, 100)
        twice = 2 * power.exp
        if not twice.is_Integer or abs(twice) > 16:
            return str(super()._print_Pow(power, rational))
        whole, half = divmod(abs(int(twice)), 2)
        text = " * ".join([base] * whole + [f"math.sqrt({self._print(power.base)})"] * half)
        return f"(1.0 / ({text}))" if twice < 0 else f"({text})"

    def parenthesize(self, item: Expression, level: int, strict: bool = False) -> str:
        if item.is_Rational and not item.is_negative:
            return str(self._print(item))
        return str(super().parenthesize(item, level, strict))

    def _print_Rational(self, number: Expression) -> str:
        return repr(float(number))

    _print_Integer = _print_Half = _print_Rational


def scalar(place: str, value: Expression) -> Expression:
    """A value as a real expression; InputError where it is a text, a vector, complex, or no finite
    number.
    """
    try:
        found = sympy.sympify(value, strict=True)
    except sympy.SympifyError:
        found = None
    if not isinstance(found, sympy.Expr) or found.has(
        sympy.I, sympy.nan, sympy.zoo, sympy.oo, -sympy.oo
    ):
        raise InputError(say(place, "a real expression of its arguments", repr(value)))
    return found


def function(name: str, slope: Callable[..., Expression] | None = None) -> Any:
    """A function that compiled code calls by its name; its derivative by any argument, where it has
    one, is a function of all.
    """
    rules = {"fdiff": lambda self, argindex=1: slope(*self.args)} if slope else {}
    return type(name, (sympy.Function,), {"__module__": __name__, **rules})


def constant(*_: Expression) -> Expression:
    """The derivative of what only jumps."""
    return sympy.Integer(0)


less, not_more, sign_of, floor_of = (
    function(name, constant) for name in ("less", "not_more", "sign_of", "floor_of")
)


class chosen(sympy.Function):
    """A choice, whose derivative is that of what is chosen."""

    def _eval_derivative(self, symbol: Expression) -> Expression:
        condition, *branches = self.args
        changes = [sympy.diff(branch, symbol) for branch in branches]
        return chosen(condition, *changes) if any(changes) else sympy.Integer(0)


def number(value: float) -> Expression:
    """Whole numbers as such, since powers of them are products."""
    return (
        sympy.Integer(int(value))
        if value == int(value) and abs(value) < 2**31
        else sympy.Float(value)
    )


#: of programs (`expressions.evaluate`)
ALGEBRA: Algebra = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a / b, "**": lambda a, b: a**b,
    "neg": lambda a: -a, "<": less, "<=": not_more, ">": lambda a, b: less(b, a), ">=": lambda a, b: not_more(b, a),
    "sin": sympy.sin, "cos": sympy.cos, "tan": sympy.tan, "asin": sympy.asin, "acos": sympy.acos, "atan2": sympy.atan2,
    "sinh": sympy.sinh, "cosh": sympy.cosh, "tanh": sympy.tanh, "sqrt": sympy.sqrt, "exp": sympy.exp, "log": sympy.log,
    "abs": lambda a: chosen(less(a, 0), -a, a), "sign": sign_of, "floor": floor_of, "mod": lambda a, b: a - b * floor_of(a / b),
    "min": lambda a, b: chosen(less(a, b), a, b), "max": lambda a, b: chosen(less(a, b), b, a), "where": chosen,
}  # fmt: skip


#: operations of functions of symbols, by their names
OPERATIONS = {
    "sin": programs.SIN, "cos": programs.COS, "tan": programs.TAN, "asin": programs.ASIN, "acos": programs.ACOS,
    "atan": programs.ATAN, "atan2": programs.ATAN2, "sinh": programs.SINH, "cosh": programs.COSH, "tanh": programs.TANH,
    "asinh": programs.ASINH, "acosh": programs.ACOSH, "atanh": programs.ATANH, "exp": programs.EXP, "log": programs.LOG,
    "erf": programs.ERF, "Abs": programs.ABS, "sign": programs.SIGN, "floor": programs.FLOOR, "less": programs.LESS,
    "not_more": programs.NOT_MORE, "sign_of": programs.SIGN, "floor_of": programs.FLOOR, "chosen": programs.CHOOSE,
    "continued": programs.CONTINUE,
}  # fmt: skip
CURVES = {
    "lookup": programs.LOOKUP,
    "lookup_slope": programs.LOOKUP_SLOPE,
    "beyond": programs.BEYOND,
}
#: functions that are several operations -> their nodes of what they are called with
SEVERAL: dict[str, Callable[[Drawing, Sequence[Any]], Node]] = {
    "Min": lambda to, parts: to.extreme(parts, False),
    "Max": lambda to, parts: to.extreme(parts, True),
    "Heaviside": lambda to, parts: to.not_negative(parts[0]),
    "Piecewise": lambda to, parts: to.piecewise(parts),
    "ceiling": lambda to, parts: to.ceiling(parts[0]),
    "Mod": lambda to, parts: to.node(parts[0] - parts[1] * floor_of(parts[0] / parts[1])),
}


class Drawing:
    """Expressions as nodes of a graph.

    `symbols` are what the symbols of expressions stand for in programs; `curves` the first and last
    number of each curve.
    """

    def __init__(
        self, symbols: Mapping[Any, Hashable], curves: Mapping[Any, tuple[int, int]] | None = None
    ) -> None:
        self.graph = Graph()
        self.curves = curves or {}
        self.known: dict[Any, Node] = {
            symbol: self.graph.symbol(name) for symbol, name in symbols.items()
        }

    def node(self, value: Expression) -> Node:
        """The node of an expression; InputError for a function that no program has."""
        if value not in self.known:
            self.known[value] = self.drawn(value)
        return self.known[value]

    def drawn(self, value: Expression) -> Node:
        """The same, of one that is not there yet."""
        graph = self.graph
        name = type(value).__name__
        if value.is_number and value.is_real:
            return graph.constant(float(value))
        if value.is_Add:
            return graph.sum([self.node(one) for one in value.args])
        if value.is_Mul:
            return self.product(value.args)
        if value.is_Pow:
            return self.power(value.base, value.exp)
        if name in CURVES:
            return graph.add(CURVES[name], self.node(value.args[0]), *self.curves[value.args[1]])
        if name in OPERATIONS:
            return graph.node(OPERATIONS[name], *map(self.node, value.args))
        if name in SEVERAL:
            return SEVERAL[name](self, value.args)
        if rewritten := CodePrinter._rewriteable_functions.get(name):
            return self.node(value.rewrite(getattr(sympy, rewritten[0])))
        known = ", ".join((*OPERATIONS, *SEVERAL))
        raise InputError(say("expression", f"functions among {known}", f"{name} in {value}"))

    def product(self, factors: Sequence[Expression]) -> Node:
        """a b / (c d) of a, b and powers with negative exponents."""
        above, below = list[Node](), list[Node]()
        for one in factors:
            if one.is_Pow and one.exp.is_Rational and one.exp.is_negative:
                below.append(self.power(one.base, -one.exp))
            else:
                above.append(self.node(one))
        over = self.graph.product(above)
        return self.graph.node(programs.DIVIDE, over, self.graph.product(below)) if below else over

    def power(self, base: Expression, exponent: Expression) -> Node:
        """Small powers as products of the base and of its root."""
        graph = self.graph
        x = self.node(base)
        twice = 2 * exponent
        if not twice.is_Integer or abs(twice) > 16:
            return graph.node(programs.POWER, x, self.node(exponent))
        whole, half = divmod(abs(int(twice)), 2)
        found = graph.product([x] * whole + [graph.node(programs.SQRT, x)] * half)
        return graph.node(programs.DIVIDE, graph.constant(1.0), found) if twice < 0 else found

    def extreme(self, parts: Sequence[Expression], largest: bool) -> Node:
        """The smallest or largest part."""
        found, *others = map(self.node, parts)
        for other in others:
            order = (other, found) if largest else (found, other)
            found = self.graph.node(
                programs.CHOOSE, self.graph.node(programs.LESS, *order), found, other
            )
        return found

    def not_negative(self, value: Expression) -> Node:
        """A step, 1 at 0."""
        return self.graph.node(programs.NOT_MORE, self.graph.constant(0.0), self.node(value))

    def ceiling(self, value: Expression) -> Node:
        """The next whole number, -floor(-x)."""
        down = self.graph.node(programs.FLOOR, self.node(-value))
        return self.graph.node(programs.NEGATE, down)

    def piecewise(self, parts: Sequence[Any]) -> Node:
        """The value of the first condition that holds, no number where none does."""
        found = self.graph.constant(float("nan"))
        for value, condition in reversed(parts):
            found = self.graph.node(
                programs.CHOOSE, self.condition(condition), self.node(value), found
            )
        return found

    def condition(self, value: Any) -> Node:
        """1 where a condition holds, else 0."""
        graph = self.graph
        kind = type(value)
        if value in (sympy.true, sympy.false):
            return graph.constant(float(bool(value)))
        if kind in (sympy.And, sympy.Or):
            parts = [self.condition(one) for one in value.args]
            if kind is sympy.And:
                return graph.product(parts)
            none = graph.product([self.unless(one) for one in parts])
            return self.unless(none)
        if kind is sympy.Not:
            return self.unless(self.condition(value.args[0]))
        a, b = map(self.node, value.args)
        relations: dict[Any, Callable[[], Node]] = {
            sympy.StrictLessThan: lambda: graph.node(programs.LESS, a, b),
            sympy.LessThan: lambda: graph.node(programs.NOT_MORE, a, b),
            sympy.StrictGreaterThan: lambda: graph.node(programs.LESS, b, a),
            sympy.GreaterThan: lambda: graph.node(programs.NOT_MORE, b, a),
            sympy.Equality: lambda: graph.node(programs.EQUAL, a, b),
            sympy.Unequality: lambda: self.unless(graph.node(programs.EQUAL, a, b)),
        }
        if kind not in relations:
            raise InputError(
                say("expression", "conditions by <, <=, >, >=, ==, and, or, not", str(value))
            )
        return relations[kind]()

    def unless(self, node: Node) -> Node:
        """1 where a condition does not hold."""
        return self.graph.node(programs.SUBTRACT, self.graph.constant(1.0), node)


def statements(
    named: Sequence[tuple[Any, Expression]],
    results: Sequence[Expression],
    places: Mapping[Any, str],
) -> tuple[list[str], list[str]]:
    """Lines that read the symbols that are needed from their places and compute what results share,
    and the results as texts.

    `named` are symbols that results may have, with their values, which may have those before; of
    them what is needed is computed.
    """
    parts, reduced, _ = shared([*(value for _, value in named), *results], True)
    values = dict(parts) | {
        symbol: value for (symbol, _), value in zip(named, reduced, strict=False)
    }
    results = reduced[len(named) :]
    order = in_order(values, results)
    needed = set().union(*(one.free_symbols for one in (*results, *map(values.get, order))))
    read = [(str(symbol), place) for symbol, place in places.items() if symbol in needed]
    write = Printer().doprint
    lines = (
        [f"{', '.join(symbol for symbol, _ in read)} = {', '.join(place for _, place in read)}"]
        if read
        else []
    )
    return lines + [f"{symbol} = {write(values[symbol])}" for symbol in order], [
        write(value) for value in results
    ]


def in_order(values: Mapping[Any, Expression], results: Sequence[Expression]) -> list[Any]:
    """Symbols that results are made of, each behind those of its own value."""

    def symbols(value: Expression) -> list[Any]:
        return sorted(value.free_symbols & values.keys(), key=str, reverse=True)

    found: dict[Any, None] = {}
    # each as late as it may be: compilers keep fewer numbers at a time
    pending = [one for value in reversed(results) for one in symbols(value)]
    while pending:
        missing = [one for one in symbols(values[pending[-1]]) if one not in found]
        pending.extend(missing)
        if not missing:
            found[pending.pop()] = None
    return list(found)


def shared(
    results: Sequence[Expression], factored: bool
) -> tuple[list[tuple[Any, Expression]], list[Expression], set[Any]]:
    """Symbols of what results share with their values, the results in these, and all symbols that
    are needed.

    `factored` looks for common factors of sums first, which takes most of the time: a quarter fewer
    operations in loops over many points, nothing in forces on a few rows.
    """
    parts, reduced = sympy.cse(list(results), optimizations="basic" if factored else None)
    return (
        parts,
        reduced,
        set().union(*(one.free_symbols for one in (*reduced, *(value for _, value in parts)))),
    )


def module(about: str, imports: Sequence[str], parts: Sequence[str]) -> str:
    """The text of a module of functions."""
    head = [
        f'"""{about}"""',
        "",
        "# fmt: off",
        "# ruff: noqa",
        "# mypy: ignore-errors",
        "from __future__ import annotations",
    ]
    return (
        "\n".join([*head, "import math", "from typing import Any", *imports])
        + "\n\n\n"
        + "\n\n\n".join(parts)
        + "\n"
    )


def import_text(text: str) -> ModuleType:
    """The module of a text, kept in the cache folder under its hash, so that its compiled functions
    are found again.
    """
    folder = cache_folder() or Path(tempfile.mkdtemp(prefix="fmbs_laws_"))
    name = f"{LAW}{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    path = folder / f"{name}.py"
    if not path.exists():
        part = path.with_suffix(f".{os.getpid()}.part")
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    # where numba looks for what it has cached
    found = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found
