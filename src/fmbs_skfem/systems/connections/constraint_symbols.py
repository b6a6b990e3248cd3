r"""Constraint functions of probe rows in symbols: their derivatives become functions.

    phi(y, h, p) = 0,     d phi/dy,     lambda d2 phi/dy2,
    phi_y z + D1 + second D2 + third D3,     D_k = d^k phi/dt^k - phi_y d^k y/dt^k

for rows y, their rates v and accelerations a, histories h with the derivatives h', h'', h''', and numbers p.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import sympy

from ...core.compiling.symbols import Expression, module
from ...core.storage.records import dataclass
from ..forces.force_symbols import history, numbers, plain, rates, routine, rows, symbols

HEADS = {  #: of the routines of a law
    "constrain": "    s, F = evaluation(table).space, opened(record)\n    gap = s.rhs[0, len(s.rhs[0]) - len(s.multipliers) :]",
    "slopes": "    s, F = evaluation(table).space, opened(record)",
    "drift": "    s, F = evaluation(table).space, opened(record)\n    gap = s.rhs[0, len(s.rhs[0]) - len(s.multipliers) :]\n"
    "    many, second, third = len(s.signals) // 4, s.leads[0], s.leads[1]",
}
IMPORTS = (
    "from fmbs_skfem.core.compiling.structs import routine",
    "from fmbs_skfem.systems.evaluation import evaluation",
    "from fmbs_skfem.systems.connections.constraint_laws import ConstraintLaw, ConstraintRoutines, opened",
    "from fmbs_skfem.systems.kernels import derivative, factor",
)
ORDERS = 3  #: derivatives of histories
steps = partial(symbols, "z")  #: the vectors z of `kernels.drift`
accelerations = partial(symbols, "a")  #: second derivatives of the rows by time


@dataclass(frozen=True)
class RowSymbols:
    """A constraint function phi(y, h, p) in symbols: `rows` y, `numbers` p and `histories` h are how many of each it may read."""

    phi: Expression
    rows: int
    numbers: int
    histories: int = 0

    def unknown(self) -> set[Expression]:
        """Symbols in the function that are none of the law's."""
        own = {*rows(self.rows), *numbers(self.numbers), *(history(k) for k in range(self.histories))}
        return set(self.phi.free_symbols) - own


def pruned(law: RowSymbols) -> tuple[RowSymbols, tuple[int, ...]]:
    """The same function of those rows alone that it reads, renumbered from 0, and the old numbers of these (i,)."""
    y = rows(law.rows)
    used = tuple(k for k in range(law.rows) if y[k] in law.phi.free_symbols)
    fewer = dict(zip([y[k] for k in used], rows(len(used)), strict=True))
    return RowSymbols(law.phi.subs(fewer, simultaneous=True), len(used), law.numbers, law.histories), used


def change(number: int, order: int) -> Expression:
    """Derivatives of a history by time."""
    return history(number) if order == 0 else sympy.Symbol(f"h{number}_{order}", real=True)


def drift(law: RowSymbols) -> Expression:
    """phi_y z + D1 + second D2 + third D3 in symbols, see `kernels.drift`.

        D_k = d^k phi/dt^k - phi_y d^k y/dt^k

    Rates v and accelerations a of the rows, and derivatives of the histories up to the third, are symbols.
    """
    y, v, a, z = (part(law.rows) for part in (rows, rates, accelerations, steps))

    def by_time(value: Expression) -> Expression:
        """Its derivative by time, with the third derivative of the rows left out."""
        found = sum(sympy.diff(value, one) * rate for one, rate in (*zip(y, v, strict=True), *zip(v, a, strict=True)))
        return found + sum(
            sympy.diff(value, change(k, order)) * change(k, order + 1) for k in range(law.histories) for order in range(ORDERS)
        )

    slopes = [sympy.diff(law.phi, one) for one in y]
    first = by_time(law.phi)
    second = by_time(first)
    D1 = first - sum(slope * one for slope, one in zip(slopes, v, strict=True))
    D2 = second - sum(slope * one for slope, one in zip(slopes, a, strict=True))
    lead = sum(slope * one for slope, one in zip(slopes, z, strict=True))
    return lead + sympy.expand(D1) + sympy.Symbol("second") * D2 + sympy.Symbol("third") * by_time(second)


def text(name: str, law: RowSymbols) -> str:
    """Routines of a law, and the law itself as an entry of LAWS."""
    count, y, phi = law.rows, rows(law.rows), sympy.sympify(law.phi)
    slopes = [plain(sympy.diff(phi, one)) for one in y]
    second = {(i, j): plain(sympy.diff(slopes[i], y[j])) for i in range(count) for j in range(count)}
    pairs = [pair for pair, value in second.items() if value != 0]
    places: dict[Any, str] = {
        **{one: f"s.y[F.rows[k, {n}]]" for n, one in enumerate(y)},
        **{one: f"F.numbers[k, {n}]" for n, one in enumerate(numbers(law.numbers))},
        **{history(n): f"factor(s.signals, F.signals[k, {n}])" for n in range(law.histories)},
    }
    moving = {
        one: f"s.paths[{n}, F.rows[k, {k}]]"
        for n, part in enumerate((rows, steps, rates, accelerations))
        for k, one in enumerate(part(count))
    }
    moving |= {
        change(n, order): f"derivative(s.signals, F.signals[k, {n}], {order} * many)"
        for n in range(law.histories)
        for order in range(1, ORDERS + 1)
    }
    targets = ["gap[F.row[k]] += {}", *(f"s.Jy[F.row[k], F.rows[k, {n}]] += {{}}" for n in range(count))]
    found = [
        routine(f"{name}_constrain", HEADS["constrain"], [plain(phi), *slopes], targets, places),
        routine(
            f"{name}_slopes",
            HEADS["slopes"],
            [second[pair] for pair in pairs],
            [f"s.H[F.pair + {len(pairs)} * k + {n}] += s.multipliers[F.row[k]] * ({{}})" for n in range(len(pairs))],
            places,
        ),
        routine(f"{name}_drift", HEADS["drift"], [plain(drift(law))], ["gap[F.row[k]] += {}"], {**places, **moving}),
    ]
    routines = f"ConstraintRoutines({name}_constrain, {name}_slopes, {name}_drift)"
    facts = f"{count}, {law.numbers}, {law.histories}, {tuple(pairs)}"
    return "\n\n\n".join([*found, f'LAWS["{name}"] = ConstraintLaw("{name}", {facts}, {routines})'])


def source(laws: Mapping[str, RowSymbols], about: str) -> str:
    """Source of a module with LAWS of these names: routines for phi, its derivatives and its drift.

    `about` is its docstring.
    """
    return module(about, IMPORTS, ["LAWS = {}", *(text(name, law) for name, law in laws.items())])
