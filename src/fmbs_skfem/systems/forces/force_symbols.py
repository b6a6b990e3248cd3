r"""Forces on probe rows in symbols: their values and derivatives become programs.

    F(y, v, p, h),     - c (dF/dy + gh dF/dv)     for rows y, their rates v, numbers p, histories h

`turned(angle)` is an angle that counts its turns, see `built_in_forces`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import partial
from typing import Any

import sympy

from ...core.compiling.graphs import Node
from ...core.compiling.symbols import Drawing, Expression, constant, function
from ...core.storage.records import dataclass
from .. import row_programs
from ..row_programs import Action
from .built_in_forces import SMALLEST
from .force_laws import ForceLaw

RATE = sympy.Symbol("gh", real=True)  #: factor of derivatives by rates
SIGN = {
    sympy.Heaviside: lambda x, *_: sympy.Piecewise((0.0, x < 0), (1.0, True)),
    sympy.DiracDelta: lambda *_: sympy.Integer(0),
}


def norm(vector: sympy.Matrix) -> Expression:
    """Length of a matrix of symbols (c,).

        sqrt(v . v + tiny)

    Its derivatives are numbers where it is zero, too.
    """
    return sympy.sqrt(vector.dot(vector) + SMALLEST)


turned = function("turned", lambda *_: sympy.Integer(1))  #: an angle that counts its turns
continued = function("continued")  #: its value, the one nearest to its last one
#: slope of a curve through points, see `core.compiling.curves`
lookup_slope = function("lookup_slope", constant)
#: its value at the first argument; the second one stands for its numbers
lookup = function("lookup", lookup_slope)
beyond = function("beyond")  #: how far the argument is beyond its ends


def symbols(letter: str, count: int, first: int = 0) -> sympy.Matrix:
    """Real symbols of one letter, numbered from `first` on, as a column (count,)."""
    return sympy.Matrix(sympy.symbols(f"{letter}{first}:{first + count}", real=True))


rows = partial(symbols, "y")  #: probe rows
rates = partial(symbols, "v")  #: their rates
numbers = partial(symbols, "p")  #: of a law


def table(number: int) -> Expression:
    """The numbers of curve `number` that a law reads, as one symbol."""
    return sympy.Symbol(f"T{number}", real=True)


def history(number: int = 0) -> Expression:
    """The symbol of history `number`, a function of time; its value is 1 where the force has none."""
    return sympy.Symbol(f"h{number}", real=True)


@dataclass(frozen=True)
class ForceSymbols:
    """Forces F(y, v, p, h) on r rows in symbols, of rows y, their rates v, `numbers` p and
    `histories` h.
    """

    force: Sequence[Expression]  #: (r,)
    numbers: int
    histories: int = 0
    energy: Expression = 0  #: potential [J] whose negative gradient is in the force
    kept: Sequence[Expression] = ()  #: values of accepted states that are kept beside angles
    #: first number and end of every curve by its name
    tables: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    def unknown(self) -> set[Expression]:
        """Symbols in the forces and their energy that are none of the law's."""
        count = len(self.force)
        own = {
            *rows(count),
            *rates(count),
            *numbers(self.numbers),
            *(history(k) for k in range(self.histories)),
        }
        return (
            set().union(
                *(sympy.sympify(value).free_symbols for value in (*self.force, self.energy))
            )
            - own
        )


def pruned(law: ForceSymbols) -> tuple[ForceSymbols, tuple[int, ...]]:
    """The same forces on those rows alone that they read or push, renumbered from 0, and the old
    numbers of these (i,).
    """
    count = len(law.force)
    read = set().union(*(sympy.sympify(value).free_symbols for value in (*law.force, *law.kept)))
    y = rows(count)
    v = rates(count)
    used = tuple(k for k in range(count) if law.force[k] != 0 or y[k] in read or v[k] in read)
    fewer = {
        old: new
        for full in (rows, rates)
        for old, new in zip([full(count)[k] for k in used], full(len(used)), strict=True)
    }
    found, kept = (
        [sympy.sympify(value).subs(fewer, simultaneous=True) for value in values]
        for values in ([law.force[k] for k in used], law.kept)
    )
    return ForceSymbols(
        found,
        law.numbers,
        law.histories,
        sympy.sympify(law.energy).subs(fewer, simultaneous=True),
        kept,
        law.tables,
    ), used


def law(name: str, found: ForceSymbols, maker: Callable[[str], ForceLaw]) -> ForceLaw:
    """The law of forces in symbols by its name, by which `maker` makes it again."""
    count = len(found.force)
    F = [plain(value) for value in found.force]
    y = rows(count)
    v = rates(count)
    h = [history(k) for k in range(found.histories)]
    kept = [plain(value) for value in found.kept]
    potential = plain(found.energy)
    angles = sorted(
        set().union(*(value.atoms(turned) for value in (*F, *kept, potential))), key=str
    )
    curves = sorted(set().union(*(value.atoms(lookup) for value in (*F, *kept))), key=str)
    last = sympy.symbols(f"m0:{len(angles)}", real=True)
    sources = {
        **{one: (row_programs.ROW, k) for k, one in enumerate(y)},
        **{one: (row_programs.RATE, k) for k, one in enumerate(v)},
        **{one: (row_programs.NUMBER, k) for k, one in enumerate(numbers(found.numbers))},
        **{one: (row_programs.HISTORY, k) for k, one in enumerate(h)},
        **{one: (row_programs.MEMORY, k) for k, one in enumerate(last)},
    }
    drawing = Drawing(sources, {table(k): ends for k, ends in enumerate(found.tables.values())})
    for angle, before in zip(angles, last, strict=True):
        drawing.known[angle] = drawing.node(continued(angle.args[0], before))
    graph = drawing.graph
    one = graph.constant(1.0)
    gh = graph.symbol((row_programs.DAMPING, 0))

    force = [drawing.node(value) for value in F]
    slopes = dict[tuple[int, int], Node]()
    for j in range(count):
        along = {drawing.node(y[j]): one, drawing.node(v[j]): gh}
        for i, slope in enumerate(graph.derivatives(force, along)):
            if graph.value(slope) != 0.0:
                slopes[i, j] = slope
    pairs = sorted(slopes)

    values = [drawing.node(one) for one in kept]
    outside = [drawing.node(beyond(*one.args)) for one in curves]
    keeps = [*(drawing.node(one) for one in angles), *values, *outside]
    ways = [row_programs.KEEP] * (len(angles) + len(values)) + [row_programs.FURTHEST] * len(
        outside
    )
    stored = drawing.node(potential)
    energies = (
        [stored, *(graph.derivatives([stored], {drawing.node(each): one})[0] for each in y)]
        if potential != 0
        else []
    )

    def action(nodes: Sequence[Node], targets: Sequence[tuple[int, int]]) -> Action:
        there = [k for k, node in enumerate(nodes) if graph.value(node) != 0.0]
        return Action(graph.program([nodes[k] for k in there]), tuple(targets[k] for k in there))

    pushes = [(row_programs.PUSH, k) for k in range(count)]
    actions = (
        action(force, pushes),
        action(
            [slopes[pair] for pair in pairs], [(row_programs.SLOPE, k) for k in range(len(pairs))]
        ),
        # zeros are kept, too: a value that was something else before
        Action(graph.program(keeps), tuple(zip(ways, range(len(keeps)), strict=True))),
        action(energies, [(row_programs.ENERGY, 0), *pushes]),
    )
    return ForceLaw(
        name,
        count,
        found.numbers,
        found.histories,
        tuple(pairs),
        len(angles),
        bool(set(v) & set().union(*(value.free_symbols for value in (*F, *kept)))),
        row_programs.first,
        row_programs.second,
        row_programs.third if keeps else None,
        row_programs.fourth if energies else None,
        kept=len(values),
        tables=tuple(list(found.tables)[int(str(one.args[1])[1:])] for one in curves),
        maker=maker,
        actions=actions,
    )


def plain(value: Any) -> Expression:
    """An expression without what only exists as a derivative of a jump: delta functions are zero,
    steps are 0 or 1.
    """
    value = sympy.sympify(value)
    for kind, other in SIGN.items():
        value = value.replace(kind, other)
    return value
