"""Forces on probe rows in C, written from their symbols: springs, moments, followers, expressions
of the state.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import singledispatch
from typing import Any

import sympy

from ..core.compiling.symbols import chosen, less, not_more
from ..core.values.problems import Problem
from ..systems.forces import force_symbols as written
from ..systems.forces import responses
from ..systems.forces.force_laws import LawForces
from ..systems.forces.force_symbols import ForceSymbols, norm, plain
from .numbers import Numbers
from .pieces import Array, CodePiece
from .text import block, statements

LEAVE_OUT = "leave it out of the scene"
#: coordinates of forces: how many rows, and c of these
COORDINATES: dict[str, tuple[int, Callable[[Any], Any]]] = {
    "torsion_spring": (2, lambda y: sympy.atan2(y[1], y[0])),
    "relative_torsion_spring": (4, lambda y: sympy.atan2(y[1], y[0]) - sympy.atan2(y[3], y[2])),
    "spatial_torsion_spring": (
        9,
        lambda y: sympy.atan2(y[:3, :].dot(y[6:, :]), y[:3, :].dot(y[3:6, :])),
    ),
    "slide_2": (4, lambda y: y[:2, :].dot(y[2:, :])),
    "slide_3": (6, lambda y: y[:3, :].dot(y[3:, :])),
    "spring": (3, norm),
}


def spring(rows: int, write: Callable[[Any], Any], turns: bool) -> ForceSymbols:
    """A spring and damper along a coordinate c.

        F = - (k (c - c0) + d c') dc/dy

    on the rows y that it reads.
    """
    y = written.rows(rows)
    v = written.rates(rows)
    p = written.numbers(3)
    c = write(y)
    slopes = [sympy.diff(c, one) for one in y]
    rate = sum(slope * one for slope, one in zip(slopes, v, strict=True))
    pull = -p[0] * ((written.turned(c) if turns else c) - p[2]) - p[1] * rate
    return ForceSymbols(
        [pull * slope for slope in slopes],
        3,
        energy=p[0] * ((written.turned(c) if turns else c) - p[2]) ** 2 / 2,
    )


def carried(dim: int, force: bool) -> ForceSymbols:
    """A force or moment that a vector x carries.

        h (a x + m x x) / |x|^n

    a moment (n = 2) on itself, or a force (n = 1) on a position behind it.
    """
    count = (2 if dim == 2 else 1) if force else (1 if dim == 2 else 3)
    x = written.rows(dim)
    p = written.numbers(count)
    h = written.history()
    if force:
        along = p[0] * x + (p[1] * sympy.Matrix([-x[1], x[0]]) if dim == 2 else sympy.zeros(dim, 1))
        found = [sympy.Integer(0)] * dim + list(h * along / sympy.sqrt(x.dot(x)))
    else:
        turned = sympy.Matrix([-x[1], x[0]]) * p[0] if dim == 2 else p.cross(x)
        found = list(h * turned / x.dot(x))
    return ForceSymbols(found, count, 1)


def one_sided(rows: int, write: Callable[[Any], Any], signed: bool) -> ForceSymbols:
    """What acts on one side of a coordinate c: ropes and stops.

        F = - sign N dc/dy,    N = k ramp(s) + d touch(s) s',    s = sign (c - c0)

    as `systems.forces.one_sided`.
    """
    count = 6 if signed else 5
    y = written.rows(rows)
    v = written.rates(rows)
    p = written.numbers(count)
    sign, (k, d, c0, e, cut) = (p[0], p[1:]) if signed else (-1, p[:])
    c = write(y)
    slopes = [sympy.diff(c, one) for one in y]
    s, rate = sign * (c - c0), sign * sum(slope * one for slope, one in zip(slopes, v, strict=True))
    ramp = chosen(not_more(s, 0), 0, chosen(less(s, e), s**2 / (2 * e), s - e / 2))
    touch = chosen(not_more(s, 0), 0, chosen(less(s, e), s / e, 1))
    N = k * ramp + d * touch * rate
    N = chosen(less(N, 0), chosen(cut, 0, N), N)
    lift = chosen(
        not_more(s, 0), 0, chosen(less(s, e), s**3 / (6 * e), (s - e / 2) ** 2 / 2 + e**2 / 24)
    )
    return ForceSymbols([-sign * N * slope for slope in slopes], count, energy=k * lift)


def constant_pull() -> ForceSymbols:
    """A pull along a distance c.

        F = - p h dc/dy

    with the number p and the history h.
    """
    y = written.rows(3)
    pull = written.history() * written.numbers(1)[0]
    return ForceSymbols([-pull * sympy.diff(norm(y), one) for one in y], 1, 1, pull * norm(y))


def dead() -> ForceSymbols:
    return ForceSymbols([written.numbers(1)[0] * written.history()], 1, 1)


BUILT_IN: dict[str, Callable[[], ForceSymbols]] = {
    "dead": dead,
    "constant_pull": constant_pull,
    "one_sided": lambda: one_sided(3, norm, True),
    "one_sided_plane": lambda: one_sided(1, lambda y: y[0], False),
    "moment_2": lambda: carried(2, False),
    "moment_3": lambda: carried(3, False),
    "follower_2": lambda: carried(2, True),
    "follower_3": lambda: carried(3, True),
    **{
        name: lambda rows=rows, write=write, name=name: spring(rows, write, "torsion" in name)  # type: ignore[misc]
        for name, (rows, write) in COORDINATES.items()
    },
}


def symbols_of(name: str) -> ForceSymbols | None:
    """A force law in symbols by its name; None of one that has none."""
    if name in BUILT_IN:
        return BUILT_IN[name]()
    if name.partition("|")[0] == responses.WORD:
        return responses.symbols_of(name)
    return None


@singledispatch
def write_force(force: Any, number: int, kept: int, given: Numbers) -> CodePiece:
    """A force in C, whose numbers of accepted states begin at `kept`. Types of forces register
    here; others are refused before.
    """
    raise TypeError(type(force))


@singledispatch
def refuse(force: Any) -> Problem | None:
    """What speaks against a force in C: none has it whose type has not registered with
    `write_force`.

    Types of which only some have it register here.
    """
    if write_force.dispatch(type(force)) is not write_force.dispatch(object):
        return None
    return Problem(
        "loads, springs and motors that a C file can hold", type(force).__name__, LEAVE_OUT
    )


@refuse.register
def _(force: LawForces) -> Problem | None:
    if symbols_of(force.law.name) is not None and force.law.judge is None:
        return None
    expected = f"one of the forces {', '.join(BUILT_IN)} or an expression of the state"
    return Problem(expected, f"'{force.law.name.partition('|')[0]}'", LEAVE_OUT)


@write_force.register
def _(force: LawForces, place: int, kept: int, given: Numbers) -> CodePiece:
    symbols = symbols_of(force.law.name)
    assert symbols is not None
    leaf = ("system", "loads", "forces", place, "numbers")
    arrays = {}
    varied = f"FORCE_{place}" if given.varies(leaf) else ""
    if varied:
        arrays[varied] = Array(force.numbers, leaf)
    pieces = [
        group(symbols, force, k, kept + k * memory_of(symbols), f"{place}_{k}", varied)
        for k in range(len(force))
    ]
    functions: dict[str, str] = {}
    calls: dict[str, tuple[str, ...]] = {}
    for piece in pieces:
        arrays |= piece.arrays
        functions |= piece.functions
        calls |= {hook: calls.get(hook, ()) + found for hook, found in piece.calls.items()}
    return CodePiece(arrays, functions, calls, kept=len(force) * memory_of(symbols))


def angles_of(symbols: ForceSymbols) -> list[Any]:
    """Angles whose turns a force counts."""
    parts = [
        *(plain(value) for value in symbols.force),
        *map(plain, symbols.kept),
        plain(symbols.energy),
    ]
    return sorted(set().union(*(value.atoms(written.turned) for value in parts)), key=str)


def memory_of(symbols: ForceSymbols) -> int:
    return len(angles_of(symbols))


def group(
    symbols: ForceSymbols, force: LawForces, k: int, kept: int, name: str, varied: str
) -> CodePiece:
    """One group of rows of a law; its numbers are those of the array `varied` where parameters
    change them.
    """
    y = written.rows(len(symbols.force))
    v = written.rates(len(symbols.force))
    p = written.numbers(symbols.numbers)
    F = [plain(value) for value in symbols.force]
    rows = force.rows[k]
    angles = angles_of(symbols)
    last = sympy.symbols(f"m0:{len(angles)}", real=True)
    known = {
        angle: written.continued(angle.args[0], m) for angle, m in zip(angles, last, strict=True)
    }
    numbers = force.numbers[k].tolist()
    given = {} if varied else dict(zip(p, map(sympy.Float, numbers), strict=False))
    signals = force.signals[k]
    places = {
        **{one: f"m->y[{row}]" for one, row in zip(y, rows, strict=True)},
        **{one: f"m->rates[{row}]" for one, row in zip(v, rows, strict=True)},
        **{
            written.history(n): "1.0" if signal < 0 else f"m->signals[{signal}]"
            for n, signal in enumerate(signals)
        },
        **{one: f"m->now.kept[{kept + n}]" for n, one in enumerate(last)},
        written.RATE: "m->gh",
        **{one: f"{varied}[{k * len(numbers) + n}]" for n, one in enumerate(p) if varied},
    }
    tables = {
        f"TABLE_{name}_{n}": Array(force.numbers[k, first:end])
        for n, (first, end) in enumerate(symbols.tables.values())
    }
    places |= {written.table(n): table for n, table in enumerate(tables)}

    def write(values: Sequence[Any], targets: Sequence[str]) -> str:
        lines, found = statements([one.xreplace(given).xreplace(known) for one in values], places)
        lines = [line.replace("const double T", "const double *const T") for line in lines]
        return block(
            [
                *lines,
                *(
                    target.format(one)
                    for target, one in zip(targets, found, strict=True)
                    if one != "0.0"
                ),
            ]
        )

    slopes = [
        (i, j, slope)
        for i in range(len(F))
        for j in range(len(F))
        if (slope := plain(sympy.diff(F[i], y[j]) + written.RATE * sympy.diff(F[i], v[j]))) != 0
    ]
    label = force.law.name.partition("|")[0].replace("_", " ")
    push = write(F, [f"m->g[{row}] += {{}};" for row in rows])
    functions: dict[str, str] = {}
    calls: dict[str, tuple[str, ...]] = {}
    if push:  # nothing of a group whose numbers are zero
        functions[f"push_{name}"] = (
            f"/* {label} */\nstatic void push_{name}(NAME_memory *m)\n{{\n{push}\n}}\n"
        )
        calls["push"] = (f"push_{name}(m);",)
    if slopes:
        body = write(
            [value for *_, value in slopes],
            [f"add_pair(m, {rows[i]}, {rows[j]}, -m->c * ({{}}));" for i, j, _ in slopes],
        )
        functions[f"slopes_{name}"] = f"static void slopes_{name}(NAME_memory *m)\n{{\n{body}\n}}\n"
        calls["slopes"] = (f"slopes_{name}(m);",)
    if (potential := plain(symbols.energy)) != 0:
        body = write([potential], ["return {};"])
        functions[f"energy_{name}"] = (
            f"static double energy_{name}(NAME_memory *m)\n{{\n{body}\n}}\n"
        )
        calls["energy"] = (f"energy += energy_{name}(m);",)
    if angles:
        body = write(angles, [f"m->now.kept[{kept + n}] = {{}};" for n in range(len(angles))])
        functions[f"keep_{name}"] = f"static void keep_{name}(NAME_memory *m)\n{{\n{body}\n}}\n"
        calls["accept"] = (f"keep_{name}(m);",)
    return CodePiece(tables, functions, calls)
