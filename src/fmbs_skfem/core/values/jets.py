r"""Functions of time with their first two derivatives, from the left or from the right where they
bend.

    f -> (f, f', f''),    (g o f)'' = g'(f) f'' + g''(f) f'^2

A jet is an array (3, s) at times (s,). What a function chooses where it bends, `min`, `abs`,
`where`, a piece of a table, it chooses at t + near, as far as the Taylor series says that: so a
derivative at a corner is that of one side of it, by the sign of `near` [s].
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from . import expressions
from .expressions import ARRAY, Algebra, Expression
from .tables import Table

Jet: TypeAlias = np.ndarray

#: g -> g, g', g'' of a number
RULES: dict[str, Callable[[np.ndarray], tuple[Any, Any, Any]]] = {
    "sin": lambda x: (np.sin(x), np.cos(x), -np.sin(x)),
    "cos": lambda x: (np.cos(x), -np.sin(x), -np.cos(x)),
    "tan": lambda x: (np.tan(x), 1 + np.tan(x) ** 2, 2 * np.tan(x) * (1 + np.tan(x) ** 2)),
    "asin": lambda x: (np.arcsin(x), (1 - x * x) ** -0.5, x * (1 - x * x) ** -1.5),
    "acos": lambda x: (np.arccos(x), -((1 - x * x) ** -0.5), -x * (1 - x * x) ** -1.5),
    "sinh": lambda x: (np.sinh(x), np.cosh(x), np.sinh(x)),
    "cosh": lambda x: (np.cosh(x), np.sinh(x), np.cosh(x)),
    "tanh": lambda x: (np.tanh(x), 1 - np.tanh(x) ** 2, -2 * np.tanh(x) * (1 - np.tanh(x) ** 2)),
    "exp": lambda x: (np.exp(x), np.exp(x), np.exp(x)),
    "log": lambda x: (np.log(x), 1 / x, -1 / x**2),
    "sqrt": lambda x: (np.sqrt(x), 0.5 * x**-0.5, -0.25 * x**-1.5),
}


def constant(value: Any) -> Jet:
    """A number, or values (s,), that do not change."""
    value = np.atleast_1d(value)
    return np.stack([value, 0.0 * value, 0.0 * value])


def chain(u: Jet, g: Any, first: Any, second: Any) -> Jet:
    """A function of a jet by its derivatives (s,) there."""
    return np.stack([g + 0.0 * u[1], first * u[1], first * u[2] + second * u[1] ** 2])


def product(a: Jet, b: Jet) -> Jet:
    return np.stack([a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2 * a[1] * b[1] + a[0] * b[2]])  # fmt: skip


def power(a: Jet, b: Jet) -> Jet:
    """a ** b, by its series where b is a constant."""
    if b[1:].any():
        return chain(product(b, chain(a, *RULES["log"](a[0]))), *3 * [a[0] ** b[0]])
    x, p = a[0], b[0]
    # a factor 0 beside a power of 0 is none
    slope, bend = (np.where(k == 0, 0.0, k * x ** (p - n)) for n, k in ((1, p), (2, p * (p - 1))))
    return chain(a, x**p, slope, bend)


def angle(y: Jet, x: Jet) -> Jet:
    """atan2(y, x)."""
    r = x[0] ** 2 + y[0] ** 2
    w = x[0] * y[1] - y[0] * x[1]
    turn = x[0] * y[2] - y[0] * x[2] - 2 * w * (x[0] * x[1] + y[0] * y[1]) / r
    return np.stack([np.arctan2(y[0], x[0]), w / r, turn / r])


def algebra(near: float) -> Algebra:
    """Operations of jets, which choose at t + near [s]."""
    at = partial(ahead, near=near)

    def least(a: Jet, b: Jet, sign: float = 1.0) -> Jet:
        return np.where(sign * at(a - b) < 0.0, a, b)

    steps = {
        sign: lambda *parts, rule=ARRAY[sign]: constant(rule(*map(at, parts)))
        for sign in (*expressions.COMPARISONS, "sign", "floor")
    }
    rules = {name: lambda u, rule=rule: chain(u, *rule(u[0])) for name, rule in RULES.items()}
    return {
        **steps,
        **rules,
        "+": np.add,
        "-": np.subtract,
        "neg": np.negative,
        "*": product,
        "/": lambda a, b: product(a, power(b, constant(-1.0))),
        "**": power,
        "atan2": angle,
        "mod": lambda a, b: a - b * np.floor(at(a) / at(b)),
        "abs": lambda a: np.where(at(a) < 0.0, -a, a),
        "min": least,
        "max": partial(least, sign=-1.0),
        "where": lambda c, a, b: np.where(c[0] != 0.0, a, b),
    }


def ahead(u: Jet, near: float) -> np.ndarray:
    """Its values at t + near."""
    return np.asarray(u[0] + near * (u[1] + 0.5 * near * u[2]))


def of_table(table: Table, x: Jet, near: float) -> Jet:
    """A table at a jet, on the piece ahead."""
    places = np.array(table.times)
    there = ahead(x, near)
    i = np.clip(np.searchsorted(places, there, side="right") - 1, 0, len(places) - 2)
    a, b, c, d = np.moveaxis(table.cubics[i], -1, 0)
    inside = (there >= places[0]) & (there <= places[-1])
    s = np.clip(x[0], places[0], places[-1]) - places[i]
    slope, bend = c + s * (2 * b + s * 3 * a), 2 * b + 6 * a * s
    return chain(x, d + s * (c + s * (b + s * a)), inside * slope, inside * bend)


def of_expression(given: Expression, t: np.ndarray, near: float) -> Jet:
    """An expression at times (s,) [s]; inputs stand still."""
    clock = np.stack([t, np.ones(len(t)), np.zeros(len(t))])
    names: dict[str, Any] = {"t": clock}
    for one in given.inputs:
        if isinstance(one, Table):
            names[one.call] = partial(of_table, one, near=near)
            names[one.name] = of_table(one, clock, near)
        else:
            names[one.name] = constant(one(t))
    with np.errstate(all="ignore"):
        return constant(0.0 * t) + expressions.evaluate(
            given.program, names, algebra(near), constant
        )
