"""Text of C99: numbers, arrays, and functions of symbols, whose common parts are computed once."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from typing import Any

from sympy.printing.c import C99CodePrinter

from ..core.compiling.symbols import Expression, shared
from ..core.values import problems

WIDTH = 130  #: of a line
INDENT = "    "
#: functions that symbols are printed as, those of `maths.c`
FUNCTIONS = {
    name: f"math_{name}"
    for name in (
        "sin",
        "cos",
        "tan",
        "asin",
        "acos",
        "atan",
        "atan2",
        "exp",
        "log",
        "sqrt",
        "sinh",
        "cosh",
        "tanh",
        "floor",
    )
}


class CPrinter(C99CodePrinter):
    """Small powers as products, and functions of this package: no library is called."""

    def __init__(self) -> None:
        super().__init__({"user_functions": FUNCTIONS | {"Abs": "size_of"}, "contract": False})

    def _print_Pow(self, power: Expression, **_: Any) -> str:
        base = self.parenthesize(power.base, 100)
        twice = 2 * power.exp
        if not twice.is_Integer or abs(twice) > 16:
            return f"math_pow({self._print(power.base)}, {self._print(power.exp)})"
        whole, half = divmod(abs(int(twice)), 2)
        text = " * ".join([base] * whole + [f"math_sqrt({self._print(power.base)})"] * half)
        return f"(1.0 / ({text}))" if twice < 0 else f"({text})" if whole + half > 1 else text

    def _print_NumberSymbol(self, value: Expression) -> str:
        return number(float(value))

    def _print_Rational(self, value: Expression) -> str:
        return number(float(value))

    def _print_Float(self, value: Expression) -> str:
        return number(float(value))

    def _print_Function(self, call: Expression) -> str:
        name = type(call).__name__
        parts = [self._print(one) for one in call.args]
        if name == "chosen":
            return f"({parts[0]} != 0.0 ? {parts[1]} : {parts[2]})"
        if name in ("less", "not_more"):
            return f"({parts[0]} {'<' if name == 'less' else '<='} {parts[1]} ? 1.0 : 0.0)"
        known = {"sign_of": "math_sign", "floor_of": "math_floor"} | FUNCTIONS
        return f"{known.get(name, name)}({', '.join(parts)})"

    _print_Integer = _print_Half = _print_Zero = _print_One = _print_NegativeOne = _print_Rational
    _print_Pi = _print_Exp1 = _print_NumberSymbol
    _print_sin = _print_cos = _print_atan2 = _print_exp = _print_log = _print_Function


def number(value: float) -> str:
    """A number that is read back to the bit, in as few letters as there are for it."""
    text = repr(float(value))
    return text.replace("inf", "1e300").replace("e-0", "e-")


def statements(
    results: Sequence[Expression], places: Mapping[Any, str]
) -> tuple[list[str], list[str]]:
    """Lines that read the symbols that are needed and compute what results share, and the results
    as texts.
    """
    parts, reduced, needed = shared(results, False)
    write = CPrinter().doprint
    lines = [
        f"const double {symbol} = {place};" for symbol, place in places.items() if symbol in needed
    ]
    lines += [f"const double {symbol} = {write(value)};" for symbol, value in parts]
    return lines, [write(value) for value in reduced]


def block(lines: Iterable[str], depth: int = 1) -> str:
    """Lines of a body, long ones broken."""
    indent = INDENT * depth
    found = []
    for line in lines:
        found += textwrap.wrap(
            line,
            WIDTH,
            initial_indent=indent,
            subsequent_indent=indent + INDENT,
            break_long_words=False,
            break_on_hyphens=False,
        )
    return "\n".join(found)


def comment(text: str) -> str:
    """Any text inside of a comment, which it neither ends nor begins: on lines of its own, without
    control characters.
    """
    lines = [problems.printable(line) for line in text.splitlines()]
    return "\n * ".join(lines).replace("*/", "* /").replace("/*", "/ *")


def template(name: str) -> str:
    """A text of this package."""
    return (resources.files(__package__) / "c" / name).read_text(encoding="utf-8")


def replaced(text: str, words: Mapping[str, Any]) -> str:
    """A template with words in their places; a word ends where no letter follows."""
    pattern = re.compile("|".join(sorted(map(re.escape, words), key=len, reverse=True)))
    return pattern.sub(lambda found: str(words[found.group()]), text)


def maths(read: str) -> str:
    """Those functions of `maths.c` that a text calls, and those that these need, in order."""
    parts = [part for part in template("maths.c").split("//: ") if part]
    heads = {part.partition("\n")[0].split()[0]: part for part in parts}
    wanted = list(heads)
    found = set[str]()
    waiting = [name for name in wanted if re.search(rf"\b{name}\(", read)]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            body = heads[name].partition("\n")[2]
            waiting += [one for one in wanted if one != name and re.search(rf"\b{one}\(", body)]
    return "\n".join(
        heads[name].partition("\n")[2].strip() + "\n" for name in wanted if name in found
    )
