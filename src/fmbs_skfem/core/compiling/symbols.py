"""From expressions in symbols to the text of compiled functions, and from such a text to a module of the cache folder.

Common subexpressions are computed once. Whoever needs functions of symbols (`bodies.symbolic`, `forces.force_symbols`) writes the
frame around them.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, TypeAlias

import sympy
from sympy.printing.pycode import PythonCodePrinter

from ..errors import InputError, say
from ..values.expressions import Algebra
from .compilation import LAW
from .jit import cache_folder

Expression: TypeAlias = Any


class Printer(PythonCodePrinter):
    """Small powers as products, and numbers as floats."""

    def _print_Pow(self, power: Expression, rational: bool = False) -> str:
        base, twice = self.parenthesize(power.base, 100), 2 * power.exp
        if not twice.is_Integer or abs(twice) > 16:
            return str(super()._print_Pow(power, rational))
        whole, half = divmod(abs(int(twice)), 2)
        text = " * ".join([base] * whole + [f"math.sqrt({self._print(power.base)})"] * half)
        return f"(1.0 / ({text}))" if twice < 0 else f"({text})"

    def _print_Rational(self, number: Expression) -> str:
        return repr(float(number))

    def _print_Function(self, call: Expression) -> str:
        """Functions that the module of the text imports."""
        return f"{type(call).__name__}({', '.join(self._print(one) for one in call.args)})"

    _print_Integer = _print_Half = _print_Rational


def scalar(place: str, value: Expression) -> Expression:
    """A value as a real expression; InputError where it is a text, a vector, complex, or no finite number."""
    try:
        found = sympy.sympify(value, strict=True)
    except sympy.SympifyError:
        found = None
    if not isinstance(found, sympy.Expr) or found.has(sympy.I, sympy.nan, sympy.zoo, sympy.oo, -sympy.oo):
        raise InputError(say(place, "a real expression of its arguments", repr(value)))
    return found


def function(name: str, slope: Callable[..., Expression] | None = None) -> Any:
    """A function that compiled code calls by its name; its derivative by any argument, where it has one, is a function of all."""
    rules = {"fdiff": lambda self, argindex=1: slope(*self.args)} if slope else {}
    return type(name, (sympy.Function,), {"__module__": __name__, **rules})


def constant(*_: Expression) -> Expression:
    """The derivative of what only jumps."""
    return sympy.Integer(0)


less, not_more, sign_of, floor_of = (function(name, constant) for name in ("less", "not_more", "sign_of", "floor_of"))


class chosen(sympy.Function):
    """A choice, whose derivative is that of what is chosen."""

    def _eval_derivative(self, symbol: Expression) -> Expression:
        condition, *branches = self.args
        changes = [sympy.diff(branch, symbol) for branch in branches]
        return chosen(condition, *changes) if any(changes) else sympy.Integer(0)


def number(value: float) -> Expression:
    """Whole numbers as such, since powers of them are products."""
    return sympy.Integer(int(value)) if value == int(value) and abs(value) < 2**31 else sympy.Float(value)


#: of programs (`expressions.evaluate`)
ALGEBRA: Algebra = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a / b, "**": lambda a, b: a**b,
    "neg": lambda a: -a, "<": less, "<=": not_more, ">": lambda a, b: less(b, a), ">=": lambda a, b: not_more(b, a),
    "sin": sympy.sin, "cos": sympy.cos, "tan": sympy.tan, "asin": sympy.asin, "acos": sympy.acos, "atan2": sympy.atan2,
    "sinh": sympy.sinh, "cosh": sympy.cosh, "tanh": sympy.tanh, "sqrt": sympy.sqrt, "exp": sympy.exp, "log": sympy.log,
    "abs": lambda a: chosen(less(a, 0), -a, a), "sign": sign_of, "floor": floor_of, "mod": lambda a, b: a - b * floor_of(a / b),
    "min": lambda a, b: chosen(less(a, b), a, b), "max": lambda a, b: chosen(less(a, b), b, a), "where": chosen,
}  # fmt: skip


def statements(results: Sequence[Expression], places: Mapping[Any, str], factored: bool = False) -> tuple[list[str], list[str]]:
    """Lines that read the symbols that are needed from their places and compute what results share, and the results as texts.

    `factored` looks for common factors of sums first, which takes most of the time: a quarter fewer operations in loops over many
    points, nothing in forces on a few rows.
    """
    parts, reduced, needed = shared(results, factored)
    read, write = [(str(symbol), place) for symbol, place in places.items() if symbol in needed], Printer().doprint
    lines = [f"{', '.join(symbol for symbol, _ in read)} = {', '.join(place for _, place in read)}"] if read else []
    return lines + [f"{symbol} = {write(value)}" for symbol, value in parts], [write(value) for value in reduced]


def shared(results: Sequence[Expression], factored: bool) -> tuple[list[tuple[Any, Expression]], list[Expression], set[Any]]:
    """Symbols of what results share with their values, the results in these, and all symbols that are needed."""
    parts, reduced = sympy.cse(list(results), optimizations="basic" if factored else None)
    return parts, reduced, set().union(*(one.free_symbols for one in (*reduced, *(value for _, value in parts))))


def module(about: str, imports: Sequence[str], parts: Sequence[str]) -> str:
    """The text of a module of functions."""
    head = [f'"""{about}"""', "", "# fmt: off", "# ruff: noqa", "# mypy: ignore-errors", "from __future__ import annotations"]
    return "\n".join([*head, "import math", "from typing import Any", *imports]) + "\n\n\n" + "\n\n\n".join(parts) + "\n"


def import_text(text: str) -> ModuleType:
    """The module of a text, kept in the cache folder under its hash, so that its compiled functions are found again."""
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
    found = sys.modules[name] = importlib.util.module_from_spec(spec)  # where numba looks for what it has cached
    spec.loader.exec_module(found)
    return found
