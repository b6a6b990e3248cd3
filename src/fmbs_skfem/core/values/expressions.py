"""Expressions of time and of parameters, as texts: a whitelist grammar, a postfix program,
evaluation for one t or many.

    comparison: sum [(< | <= | > | >=) sum]    sum: product {(+ | -) product}    product: unary {(* | /) unary}
    unary: (+ | -) unary | power               power: atom [** unary]            atom: number | name | function(...) | (comparison)

A number may have a unit, `0.3 m`, and a name a part, `tip.x`.

A text becomes a program in postfix order, numbers and symbols, which a stack evaluates in any
algebra: floats, arrays, quantities with units. Nothing of Python is reachable from a text.
"""

from __future__ import annotations

import itertools
import math
import operator
import re
from collections import deque
from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any, TypeAlias, TypeGuard, overload

import numpy as np
import numpy.typing as npt

from ..errors import Reason, SolverError, closest, listed, say
from ..storage.container import storable
from ..storage.records import dataclass
from .arguments import checked
from .inputs import Source, timed
from .problems import Problem, shown
from .units import UNITS, Quantity, measure

Program: TypeAlias = tuple[float | str, ...]
Algebra: TypeAlias = Mapping[str, Callable[..., Any]]
Token: TypeAlias = tuple[str, str, int]  # kind, text, column

LENGTH = 2000  #: longest expression [characters]
LEVELS = 64  #: deepest nesting of parentheses, signs and powers

FUNCTIONS = {
    "sin": 1, "cos": 1, "tan": 1, "asin": 1, "acos": 1, "atan2": 2, "sinh": 1, "cosh": 1, "tanh": 1, "sqrt": 1, "exp": 1, "log": 1,
    "abs": 1, "sign": 1, "floor": 1, "mod": 2, "min": 2, "max": 2, "where": 3,
}  # fmt: skip
REPEATED = ("min", "max")  #: functions of two or more arguments
#: interp(x, x0, y0, x1, y1, ...): straight lines between points, constant beyond them
TABLE = "interp"
#: what is written out when it is read: the first two between points, the last one of one motion
PATHS = (TABLE, "minimum_jerk", "trapezoidal")
STEPS = 20_000  #: longest program
EDGE = 1e-9  #: part of a length that is round-off of it
BINARY = {"<": 1, "<=": 1, ">": 1, ">=": 1, "+": 2, "-": 2, "*": 3, "/": 3, "**": 5}  #: precedence
UNARY = 4  #: precedence of a sign: below a power, above a product
ARITY = FUNCTIONS | dict.fromkeys(BINARY, 2) | {"neg": 1}
COMPARISONS = ("<", "<=", ">", ">=")
DIVISIONS = ("/", "mod")
SWITCHES = (*COMPARISONS, "sign", "floor", "mod")  #: what jumps
BENDS = ("min", "max", "abs")  #: what bends
RESERVED = frozenset(FUNCTIONS) | {*PATHS, "t", "pi"}
OUTPUTS = "outputs are read by loads such as control_force, control_torque and actuator, by controllers and by events"
GRAMMAR = (
    "allowed are numbers, pi, the scene's parameters, t in functions of time, + - * / **, < <= > >=, parentheses and the functions "
    f"{', '.join(sorted(set(FUNCTIONS) - {'where'}))}, where(condition, then, else), interp(x, x0, y0, x1, y1, ...), "
    "minimum_jerk(x, x0, y0, x1, y1, ...), trapezoidal(x, x0, y0, x1, y1, ramp, rounding)"
)

_TOKEN = re.compile(
    r"[ \t\n]*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)?)|"
    r"(?P<sign>\*\*|<=|>=|[-+*/<>(),]))",
    re.ASCII,
)


def _extreme(choose: Callable[[float, float], float]) -> Callable[[float, float], float]:
    """min or max that passes NaN on, as its array form does."""
    return lambda a, b: a + b if a != a or b != b else choose(a, b)


SCALAR: Algebra = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "**": math.pow, "neg": operator.neg,
    "<": lambda a, b: float(a < b), "<=": lambda a, b: float(a <= b),
    ">": lambda a, b: float(a > b), ">=": lambda a, b: float(a >= b),
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "tanh": math.tanh, "sqrt": math.sqrt, "exp": math.exp, "log": math.log,
    "asin": math.asin, "acos": math.acos, "atan2": math.atan2, "sinh": math.sinh, "cosh": math.cosh,
    "sign": lambda a: (a > 0.0) - (a < 0.0) + 0.0 * a, "floor": lambda a: float(math.floor(a)), "mod": operator.mod,
    "abs": abs, "min": _extreme(min), "max": _extreme(max), "where": lambda c, a, b: a if c != 0.0 else b,
}  # fmt: skip
ARRAY: Algebra = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "**": np.power, "neg": np.negative,
    "<": lambda a, b: np.less(a, b) * 1.0, "<=": lambda a, b: np.less_equal(a, b) * 1.0,
    ">": lambda a, b: np.greater(a, b) * 1.0, ">=": lambda a, b: np.greater_equal(a, b) * 1.0,
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "tanh": np.tanh, "sqrt": np.sqrt, "exp": np.exp, "log": np.log,
    "asin": np.arcsin, "acos": np.arccos, "atan2": np.arctan2, "sinh": np.sinh, "cosh": np.cosh,
    "sign": np.sign, "floor": np.floor, "mod": np.mod,
    "abs": np.abs, "min": np.minimum, "max": np.maximum, "where": lambda c, a, b: np.where(np.not_equal(c, 0.0), a, b),
}  # fmt: skip


class Ambiguous(Problem):
    """A name in a text that may be a unit or a parameter, or an output, `s` in 3 m / s."""

    def __init__(self, name: str, text: str, kind: str = "a parameter") -> None:
        got = f"'{name}' in {shown(text)}, which is both"
        super().__init__(
            f"a unit or {kind}", got, f"rename '{name}', or write the number in SI units"
        )


@storable
@dataclass(frozen=True)
class Expression:
    """A function of time f(t) with its parameters bound: floats in, floats out; arrays in, arrays
    out.

    Inputs stand at their start, where `at` gives no values (s,) of theirs by name.
    """

    text: str
    program: Program
    inputs: tuple[Source, ...] = ()  #: inputs and tables that it reads

    @overload
    def __call__(self, t: float) -> float: ...
    @overload
    def __call__(self, t: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]: ...
    def __call__(self, t: float | npt.NDArray[np.float64]) -> float | npt.NDArray[np.float64]:
        if isinstance(t, np.ndarray):
            return self.at(t, {one.name: one(t) for one in self.inputs})
        calls = {one.call: one for one in self.inputs if one.call}
        return value_of(
            self.program,
            {one.name: float(one(np.array(t))) for one in self.inputs} | {"t": float(t)} | calls,
        )

    def at(
        self, t: npt.NDArray[np.float64], inputs: Mapping[str, npt.NDArray[np.float64]]
    ) -> npt.NDArray[np.float64]:
        """Its values at times (s,) with inputs of these values (s,)."""
        with np.errstate(all="ignore"):
            calls = {one.call: one for one in self.inputs if one.call}
            return np.zeros(t.shape) + evaluate(self.program, {"t": t, **inputs, **calls}, ARRAY)

    def switches(
        self, t: npt.NDArray[np.float64], margins: bool = False, bends: bool = False
    ) -> npt.NDArray[np.float64]:
        """`switches` of its program at times (s,), or `margins`."""
        sources = {one.name: one(t) for one in self.inputs} | {
            one.call: one for one in self.inputs if one.call
        }
        return switches(self.program, {"t": t, **sources}, t, margins, bends)


@checked
def of_time(
    text: str | float,
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, Source] | None = None,
) -> Expression:
    """The function of time written as `text`; `parameters` are names it may use beside t and pi,
    with their values, and inputs.

        >>> from fmbs_skfem.core.values.expressions import of_time
        >>> push = of_time("F * sin(2 * pi * t)", {"F": 3.0})
        >>> push(0.25)
        3.0
    """
    values = {"pi": math.pi} | dict(parameters or {})
    told = dict(inputs or {})
    calls = {one.call for one in told.values() if one.call}
    program = (
        parse(text, values.keys() | timed(told.values()).keys() | calls | {"t"})
        if isinstance(text, str)
        else (float(text),)
    )
    read = tuple(one for name, one in told.items() if name in program or one.call in program)
    fixed = values | {step: one.value for step, one in quantities(program).items()}
    return Expression(str(text), _fold(program, fixed, str(text)), read)


def check(expression: Expression, times: npt.ArrayLike, name: str) -> None:
    """Raises a SolverError naming the load or joint `name` and the first of the times (s,) [s]
    where f(t) is not finite.
    """
    t = np.atleast_1d(np.asarray(times, dtype=float))
    values = expression(t)
    if not np.isfinite(values).all():
        first = int(np.argmin(np.isfinite(values)))
        message = say(
            f"{name} at t = {t[first]:g} s",
            f"a finite value of '{expression.text}'",
            values[first],
            "guard it with where(...)",
        )
        raise SolverError(message, Reason.NOT_FINITE, float(t[first]))


def is_quantity(step: float | str) -> TypeGuard[str]:
    """Whether a step of a program is a number with a unit."""
    return isinstance(step, str) and step[0] in "0123456789."


def is_call(step: float | str) -> TypeGuard[str]:
    """Whether a step of a program is a table, called with what stands before it: `goal()`."""
    return isinstance(step, str) and step.endswith("()")


def quantities(program: Program) -> dict[str, Quantity]:
    """The numbers with units of a program."""
    return {step: measure(step) for step in program if is_quantity(step)}


def evaluate(
    program: Program,
    names: Mapping[str, Any],
    algebra: Algebra,
    lift: Callable[[float], Any] = float,
) -> Any:
    """The value of a program; `lift` brings its numbers into the algebra."""
    stack: list[Any] = []
    for step in program:
        if not isinstance(step, str):
            stack.append(lift(step))
        elif step in ARITY:
            first = len(stack) - ARITY[step]
            stack[first:] = [algebra[step](*stack[first:])]
        elif is_call(step):
            stack[-1] = names[step](stack[-1])
        else:
            stack.append(names[step])
    return stack[0]


def switches(
    program: Program,
    names: Mapping[str, Any],
    t: npt.NDArray[np.float64],
    margins: bool = False,
    bends: bool = False,
) -> npt.NDArray[np.float64]:
    """Parts (s, k) of a program that jump, at times (s,): comparisons, signs and whole numbers; nan
    where they read what is nan.

    With `bends` also which side is chosen by what bends. With `margins` the differences of both
    sides of comparisons, which change their signs where these jump.
    """
    found: list[npt.NDArray[np.float64]] = []
    words = (COMPARISONS if margins else SWITCHES) + (BENDS if bends else ())

    def recorded(word: str, *parts: Any) -> Any:
        value = ARRAY[word](*parts)
        apart = parts[0] - (parts[1] if len(parts) > 1 else 0.0)
        kept = (
            apart
            if margins
            else np.floor(parts[0] / parts[1])
            if word == "mod"
            else np.sign(apart)
            if word in BENDS
            else value
        )
        found.append(np.zeros(t.shape) + kept)
        return value

    if not any(step in words for step in program):
        return np.zeros((len(t), 0))
    with np.errstate(all="ignore"):
        evaluate(program, names, {**ARRAY, **{word: partial(recorded, word) for word in words}})
    return np.stack(found, axis=1)


def parse(text: str, names: Collection[str]) -> Program:
    """The postfix program of a text that may use `names` and pi; a Problem where the text leaves
    the grammar.
    """
    if len(text) > LENGTH:
        raise Problem(
            f"an expression of at most {LENGTH} characters",
            f"{len(text)} characters",
            "name its parts under parameters",
        )
    tokens = _tokens(text)
    program = _comparison(tokens, names, 0)
    if tokens[0][0] != "end":
        raise _unexpected("an operator or the end", tokens[0])
    return program


def value_of(program: Program, names: Mapping[str, Any]) -> float:
    """The value of a program in Python floats; through numpy where those raise (division by zero,
    overflow, domain).
    """
    try:
        return float(evaluate(program, names, SCALAR))
    except (ValueError, ArithmeticError):
        with np.errstate(all="ignore"):
            lifted = {
                name: value if callable(value) else np.float64(value)
                for name, value in names.items()
            }
            return float(evaluate(program, lifted, ARRAY, np.float64))


def require_defined(program: Program, values: Mapping[str, float], text: str) -> None:
    """Raises a Problem for a program that is no number whatever the names are that have no value
    here.
    """
    _fold(program, values, text)


def _fold(program: Program, values: Mapping[str, float], text: str) -> Program:
    """The program with constants computed once; a constant part that is not finite is refused, and
    a divisor that is always 0.

    A divisor is not where a condition chooses: where(t < T, t/T, 1) is a step for T = 0.
    """
    stack: list[tuple[Program, Problem | None]] = []
    for step in program:
        if isinstance(step, str) and step in ARITY:
            first = len(stack) - ARITY[step]
            parts, wrong = zip(*stack[first:], strict=True)
            constant = not any(isinstance(piece, str) for part in parts for piece in part)
            joined: Program = (*(piece for part in parts for piece in part), step)
            problem = next(filter(None, wrong[:1] if step == "where" else wrong), None)
            if step in DIVISIONS and parts[-1] == (0.0,) and not constant:
                problem = Problem(
                    "a divisor other than 0",
                    f"{shown(text)}, where it is always 0",
                    "guard it with where(...)",
                )
            stack[first:] = [
                ((_finite(value_of(joined, {}), text),) if constant else joined, problem)
            ]
        elif is_call(step):
            stack[-1] = ((*stack[-1][0], step), stack[-1][1])
        elif isinstance(step, str):
            stack.append(((step,) if step not in values else (_finite(values[step], text),), None))
        else:
            stack.append(((_finite(step, text),), None))
    found, undefined = stack[0]
    if undefined is not None:
        raise undefined
    return found


def _finite(value: float, text: str) -> float:
    if not math.isfinite(value):
        raise Problem(
            "an expression of finite numbers", f"{shown(text)}, a part of which is {value}", GRAMMAR
        )
    return value


def _tokens(text: str) -> deque[Token]:
    tokens: deque[Token] = deque()
    position = 0
    end = len(text.rstrip(" \t\n"))
    while position < end:
        match = _TOKEN.match(text, position)
        if match is None:
            rest = text[position:].lstrip(" \t\n")
            hint = "write ** for a power; " if rest[0] == "^" else ""
            raise Problem(
                "an expression",
                f"{rest[0]!r} at column {len(text) - len(rest) + 1} of {shown(text)}",
                hint + GRAMMAR,
            )
        kind = str(match.lastgroup)
        tokens.append((kind, match[kind], match.start(kind) + 1))
        position = match.end()
    tokens.append(("end", "the end", end + 1))
    return tokens


def _unexpected(expected: str, token: Token) -> Problem:
    return Problem(f"{expected} at column {token[2]} of the expression", shown(token[1]), GRAMMAR)


def _comparison(tokens: deque[Token], names: Collection[str], level: int) -> Program:
    left = _climb(tokens, names, 1, level)
    if BINARY.get(tokens[0][1]) == 1:
        raise Problem(
            "one comparison", "a chain of comparisons", "write (a < t) * (t < b) for both"
        )
    return left


def _climb(tokens: deque[Token], names: Collection[str], floor: int, level: int) -> Program:
    """Operands joined by operators of precedence `floor` and above; powers associate to the right,
    comparisons not at all.
    """
    left = _operand(tokens, names, level)
    while (precedence := BINARY.get(symbol := tokens[0][1], 0)) >= floor:
        tokens.popleft()
        right = _climb(tokens, names, precedence + (symbol != "**"), level + (symbol == "**"))
        left = (*left, *right, symbol)
        if precedence == 1:
            break
    return left


def _operand(tokens: deque[Token], names: Collection[str], level: int) -> Program:
    if level > LEVELS:
        raise Problem(
            f"an expression nested at most {LEVELS} deep",
            "a deeper one",
            "name its parts under parameters",
        )
    token = tokens.popleft()
    kind, text, _ = token
    if kind == "number":
        unit = _unit(tokens, names)
        return (f"{text} {unit}",) if unit else (float(text),)
    if kind == "name":
        return _call(tokens, names, level, text) if tokens[0][1] == "(" else (_known(text, names),)
    if text in ("+", "-"):
        inner = _climb(tokens, names, UNARY, level + 1)
        return inner if text == "+" else (*inner, "neg")
    if text == "(":
        inner = _comparison(tokens, names, level + 1)
        _close(tokens)
        return inner
    raise _unexpected("a number, a name or '('", token)


def _unit(tokens: deque[Token], names: Collection[str]) -> str:
    """The unit behind a number; empty where there is none. t is the time, and no tonne."""
    text = ""
    while tokens[0][0] == "name" and tokens[0][1] in UNITS and tokens[0][1] != "t":
        text += tokens.popleft()[1]
        if tokens[0][1] == "**" and tokens[1][0] == "number":
            text += f"^{tokens[1][1]}"
            tokens.popleft()
            tokens.popleft()
        if tokens[0][1] in ("*", "/") and _is_unit(tokens, names):
            text += tokens.popleft()[1]
        elif tokens[0][0] == "name":
            text += " "
    return text.rstrip()


def _is_unit(tokens: deque[Token], names: Collection[str]) -> bool:
    """Whether a unit goes on behind the operator that comes next; a Problem where a name of the
    scene may be meant as well.
    """
    name = tokens[1][1]
    if name == "t" or name not in UNITS or tokens[2][1] == "(":
        return False
    if name in names:
        raise Ambiguous(name, f"{tokens[0][1]} {name}")
    return True


def _known(name: str, names: Collection[str]) -> str:
    if name in FUNCTIONS or name in PATHS:
        raise Problem(f"the arguments of {name} in parentheses", f"'{name}' alone", GRAMMAR)
    if name not in names and name != "pi":
        known = sorted({*names, "pi"})
        near = (
            f"'{name}' is a unit, and cannot be the name of what is meant"
            if name in UNITS
            else closest(name, known).removeprefix("; ")
        )
        if "." in name and not any("." in one for one in known):
            near = OUTPUTS
        raise Problem(
            f"one of the names {listed(known, name)}",
            shown(name),
            f"{near}; {GRAMMAR}" if near else GRAMMAR,
        )
    return name


def _call(tokens: deque[Token], names: Collection[str], level: int, name: str) -> Program:
    known = {*FUNCTIONS, *PATHS}
    if (
        name not in known
        and f"{name}(t)" in names
        and [token[1] for token in itertools.islice(tokens, 3)] == ["(", "t", ")"]
    ):
        for _ in range(3):
            tokens.popleft()
        return (f"{name}(t)",)
    if name not in known and f"{name}()" in names:
        tokens.popleft()
        argument = _comparison(tokens, names, level + 1)
        _close(tokens)
        return (*argument, f"{name}()")
    if name not in known:
        hint = closest(name, known).removeprefix("; ")
        raise Problem(
            f"one of the functions {', '.join(sorted(known))}",
            shown(name),
            f"{hint} {GRAMMAR}".strip(),
        )
    tokens.popleft()
    arguments = [_comparison(tokens, names, level + 1)]
    while tokens[0][1] == ",":
        tokens.popleft()
        arguments.append(_comparison(tokens, names, level + 1))
    _close(tokens)
    if name in PATHS:
        return _motion(arguments) if name == PATHS[-1] else _between(name, arguments)
    count = FUNCTIONS[name]
    if len(arguments) != count and not (name in REPEATED and len(arguments) > 2):
        raise Problem(
            f"{count} argument{'s' if count > 1 else ''} of {name}", str(len(arguments)), GRAMMAR
        )
    if name in REPEATED:
        return (*arguments[0], *(step for argument in arguments[1:] for step in (*argument, name)))
    return (*(step for argument in arguments for step in argument), name)


def _between(name: str, arguments: list[Program]) -> Program:
    """y0 + sum_i (y_i+1 - y_i) S(min(max((x - x_i) / (x_i+1 - x_i), 0), 1)),    S(s) = s

    of straight lines, and S = s^3 (10 - 15 s + 6 s^2) with the least jerk (T. Flash, N. Hogan,
    J. Neurosci. 5 (1985) 1688-1703, doi 10.1523/JNEUROSCI.05-07-01688.1985).
    """
    x, points = arguments[0], arguments[1:]
    if len(points) < 4 or len(points) % 2:
        raise Problem(
            f"{name}(x, x0, y0, x1, y1, ...) with two points at least",
            f"{len(arguments)} arguments",
            GRAMMAR,
        )
    places, found = points[::2], points[1]
    _require_growing(name, places)
    for (a, b), (low, high) in zip(
        itertools.pairwise(places), itertools.pairwise(points[1::2]), strict=True
    ):
        s: Program = (*x, *a, "-", *b, *a, "-", "/", 0.0, "max", 1.0, "min")
        if name != TABLE:
            s = (*s, *s, "*", *s, "*", 10.0, *s, 6.0, *s, "*", 15.0, "-", "*", "+", "*")
        found = (*found, *high, *low, "-", *s, "*", "+")
        if len(found) > STEPS:
            raise Problem(f"an expression of at most {STEPS} steps", "a longer one", GRAMMAR)
    return found


def _motion(arguments: list[Program]) -> Program:
    """A motion from y0 at x0 to y1 at x1 whose rate is a trapezoid with sides of the length `ramp`,
    or with a `rounding` r of their ends an S-curve. With T = x1 - x0, u in [0, T] and truncated
    powers

        y0 + (y1 - y0) / (2 ramp (T - ramp)) sum_k s_k <u - u_k>^2
        y0 + (y1 - y0) / (6 r (ramp - r) (T - ramp)) sum_k s_k <u - u_k>^3
    """
    name = PATHS[-1]
    if len(arguments) not in (6, 7):
        usage = f"{name}(x, x0, y0, x1, y1, ramp, rounding), with or without the last one"
        raise Problem(usage, f"{len(arguments)} arguments", GRAMMAR)
    x, x0, y0, x1, y1, ramp, *r = arguments
    _require_growing(name, [x0, x1])
    begin, end, side, *rounding = map(_number, (x0, x1, ramp, *r))
    if not (0.0 < side <= 0.5 * (end - begin) * (1.0 + EDGE) or math.isnan(end - begin + side)):
        raise Problem(f"a ramp of {name} from 0 to half of its length", f"{side:g}")
    for one in rounding:
        if not (0.0 < one <= 0.5 * side * (1.0 + EDGE) or math.isnan(side + one)):
            raise Problem(f"a rounding of {name} from 0 to half of its ramp", f"{one:g}")
    whole: Program = (*x1, *x0, "-")
    rest: Program = (*whole, *ramp, "-")
    u: Program = (*x, *x0, "max", *x1, "min", *x0, "-")
    knots: list[tuple[Program, str]] = [(ramp, "-"), (rest, "-")]
    power, scale = 2.0, (2.0, *ramp, "*")
    if r:
        a, power = r[0], 3.0
        scale = (6.0, *a, "*", *ramp, *a, "-", "*")
        knots = [
            (a, "-"), ((*ramp, *a, "-"), "-"), (ramp, "+"),
            (rest, "-"), ((*rest, *a, "+"), "+"), ((*whole, *a, "-"), "+"),
        ]  # fmt: skip
    found: Program = (*u, power, "**")
    for place, sign in knots:
        found = (*found, *u, *place, "-", 0.0, "max", power, "**", sign)
    return (*y0, *y1, *y0, "-", *scale, *rest, "*", "/", *found, "*", "+")


def _number(program: Program) -> float:
    """The value of a number, with its unit or without one; nan of anything else."""
    step = program[0]
    if len(program) > 1 or (isinstance(step, str) and not is_quantity(step)):
        return math.nan
    return measure(step).value if isinstance(step, str) else step


def _require_growing(name: str, places: list[Program]) -> None:
    """Raises a Problem for numbers among places that do not grow."""
    numbers = [one for one in map(_number, places) if not math.isnan(one)]
    if any(b <= a for a, b in itertools.pairwise(numbers)):
        raise Problem(
            f"places x0 < x1 < ... of {name}",
            ", ".join(f"{number:g}" for number in numbers),
            GRAMMAR,
        )


def _close(tokens: deque[Token]) -> None:
    if tokens[0][1] != ")":
        raise _unexpected("')'", tokens[0])
    tokens.popleft()
