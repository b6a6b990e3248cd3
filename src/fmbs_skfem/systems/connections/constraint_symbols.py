r"""Constraint functions of probe rows in symbols: their derivatives become programs.

    phi(y, h, p) = 0,     d phi/dy,     lambda d2 phi/dy2,
    phi_y z + D1 + second D2 + third D3,     D_k = d^k phi/dt^k - phi_y d^k y/dt^k

for rows y, their rates v and accelerations a, histories h with the derivatives h', h'', h''', and
numbers p.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import sympy

from ...core.compiling.graphs import Node
from ...core.compiling.symbols import Drawing, Expression
from ...core.storage.records import dataclass
from .. import row_programs
from ..forces.force_symbols import history, numbers, plain, rates, rows, symbols
from ..row_programs import Action
from .constraint_laws import ConstraintLaw, ConstraintRoutines

ORDERS = 3  #: derivatives of histories
steps = partial(symbols, "z")  #: the vectors z of `kernels.drift`
accelerations = partial(symbols, "a")  #: second derivatives of the rows by time


@dataclass(frozen=True)
class RowSymbols:
    """A constraint function phi(y, h, p) in symbols: `rows` y, `numbers` p and `histories` h are
    how many of each it may read.
    """

    phi: Expression
    rows: int
    numbers: int
    histories: int = 0

    def unknown(self) -> set[Expression]:
        """Symbols in the function that are none of the law's."""
        own = {
            *rows(self.rows),
            *numbers(self.numbers),
            *(history(k) for k in range(self.histories)),
        }
        return set(self.phi.free_symbols) - own


def pruned(law: RowSymbols) -> tuple[RowSymbols, tuple[int, ...]]:
    """The same function of those rows alone that it reads, renumbered from 0, and the old numbers
    of these (i,).
    """
    y = rows(law.rows)
    used = tuple(k for k in range(law.rows) if y[k] in law.phi.free_symbols)
    fewer = dict(zip([y[k] for k in used], rows(len(used)), strict=True))
    return RowSymbols(
        law.phi.subs(fewer, simultaneous=True), len(used), law.numbers, law.histories
    ), used


def change(number: int, order: int) -> Expression:
    """Derivatives of a history by time."""
    return history(number) if order == 0 else sympy.Symbol(f"h{number}_{order}", real=True)


def drift(law: RowSymbols) -> Expression:
    """phi_y z + D1 + second D2 + third D3 in symbols, see `kernels.drift`.

        D_k = d^k phi/dt^k - phi_y d^k y/dt^k

    Rates v and accelerations a of the rows, and derivatives of the histories up to the third, are
    symbols.
    """
    y, v, a, z = (part(law.rows) for part in (rows, rates, accelerations, steps))

    def by_time(value: Expression) -> Expression:
        """Its derivative by time, with the third derivative of the rows left out."""
        found = sum(
            sympy.diff(value, one) * rate
            for one, rate in (*zip(y, v, strict=True), *zip(v, a, strict=True))
        )
        return found + sum(
            sympy.diff(value, change(k, order)) * change(k, order + 1)
            for k in range(law.histories)
            for order in range(ORDERS)
        )

    slopes = [sympy.diff(law.phi, one) for one in y]
    first = by_time(law.phi)
    second = by_time(first)
    D1 = first - sum(slope * one for slope, one in zip(slopes, v, strict=True))
    D2 = second - sum(slope * one for slope, one in zip(slopes, a, strict=True))
    lead = sum(slope * one for slope, one in zip(slopes, z, strict=True))
    return (
        lead
        + sympy.expand(D1)
        + sympy.Symbol("second") * D2
        + sympy.Symbol("third") * by_time(second)
    )


def law(name: str, found: RowSymbols, maker: Callable[[str], ConstraintLaw]) -> ConstraintLaw:
    """The law of a constraint function in symbols by its name, by which `maker` makes it again."""
    count = found.rows
    y = rows(found.rows)
    phi = sympy.sympify(found.phi)
    own = {one: (row_programs.NUMBER, n) for n, one in enumerate(numbers(found.numbers))}
    histories = range(found.histories)
    times = {history(n): (row_programs.HISTORY, n) for n in histories}
    still = Drawing({one: (row_programs.ROW, n) for n, one in enumerate(y)} | own | times)
    graph = still.graph
    value = still.node(plain(phi))
    along = [{still.node(each): graph.constant(1.0)} for each in y]
    slopes = [graph.derivatives([value], direction)[0] for direction in along]
    second = dict[tuple[int, int], Node]()
    for j, direction in enumerate(along):
        for i, node in enumerate(graph.derivatives(slopes, direction)):
            if graph.value(node) != 0.0:
                second[i, j] = node
    pairs = sorted(second)

    paths = enumerate((rows, steps, rates, accelerations), row_programs.PATH)
    moving: dict[Any, tuple[int, int]] = {
        one: (kind, k) for kind, part in paths for k, one in enumerate(part(count))
    }
    moving |= {
        change(n, order): (row_programs.HISTORY + order, n)
        for n in histories
        for order in range(1, ORDERS + 1)
    }
    moving |= {one: (row_programs.LEAD, k) for k, one in enumerate(sympy.symbols("second third"))}
    driven = Drawing(moving | own | times)
    constrain = [(row_programs.GAP, 0), *((row_programs.JACOBIAN, n) for n in range(count))]
    actions = (
        Action(graph.program([value, *slopes]), tuple(constrain)),
        Action(
            graph.program([second[pair] for pair in pairs]),
            tuple((row_programs.CURVATURE, k) for k in range(len(pairs))),
        ),
        Action(driven.graph.program([driven.node(plain(drift(found)))]), ((row_programs.GAP, 0),)),
    )
    routines = ConstraintRoutines(row_programs.first, row_programs.second, row_programs.third)
    return ConstraintLaw(
        name,
        count,
        found.numbers,
        found.histories,
        tuple(pairs),
        routines,
        maker=maker,
        actions=actions,
    )
