r"""Forces on probe rows in symbols: their values and derivatives become compiled functions.

    F(y, v, p, h),     - c (dF/dy + gh dF/dv)     for rows y, their rates v, numbers p, histories h

`turned(angle)` is an angle that counts its turns, see `built_in_forces`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import partial
from typing import Any

import sympy

from ...core.compiling.symbols import Expression, constant, function, module, statements
from ...core.storage.records import dataclass
from .built_in_forces import SMALLEST

RATE = sympy.Symbol("gh", real=True)  #: factor of derivatives by rates
SIGN = {sympy.Heaviside: lambda x, *_: sympy.Piecewise((0.0, x < 0), (1.0, True)), sympy.DiracDelta: lambda *_: sympy.Integer(0)}
HEADS = {  #: of the routines of a law
    "force": "    s, F = evaluation(table).space, opened(record)",
    "slopes": "    s, F = evaluation(table).space, opened(record)\n    c, gh = -s.c[0], s.gh[0]",
    "accept": "    s, F = evaluation(table).space, opened(record)",
    "energy": "    s, F = evaluation(table).space, opened(record)",
}
IMPORTS = (
    "from fmbs_skfem.core.compiling.choices import chosen, floor_of, less, not_more, sign_of",
    "from fmbs_skfem.core.compiling.structs import routine",
    "from fmbs_skfem.systems.evaluation import evaluation",
    "from fmbs_skfem.systems.forces.force_laws import ForceLaw, continued, opened",
    "from fmbs_skfem.systems.kernels import factor",
)

CURVES = ("from fmbs_skfem.core.compiling.curves import beyond, lookup, lookup_slope",)  #: of laws that read tables


def norm(vector: sympy.Matrix) -> Expression:
    """|vector| of a matrix of symbols (c,), as sqrt(v . v + tiny): its derivatives are numbers where it is zero, too."""
    return sympy.sqrt(vector.dot(vector) + SMALLEST)


turned = function("turned", lambda *_: sympy.Integer(1))  #: an angle that counts its turns
continued = function("continued")  #: its value, the one nearest to its last one
lookup_slope = function("lookup_slope", constant)  #: slope of a curve through points, see `core.compiling.curves`
lookup = function("lookup", lookup_slope)  #: its value at the first argument; the second one stands for its numbers
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
    """Forces F(y, v, p, h) on r rows in symbols, of rows y, their rates v, `numbers` p and `histories` h."""

    force: Sequence[Expression]  #: (r,)
    numbers: int
    histories: int = 0
    energy: Expression = 0  #: potential [J] whose negative gradient is in the force
    kept: Sequence[Expression] = ()  #: values of accepted states that are kept beside angles
    tables: Mapping[str, tuple[int, int]] = field(default_factory=dict)  #: first number and end of every curve by its name

    def unknown(self) -> set[Expression]:
        """Symbols in the forces and their energy that are none of the law's."""
        count = len(self.force)
        own = {*rows(count), *rates(count), *numbers(self.numbers), *(history(k) for k in range(self.histories))}
        return set().union(*(sympy.sympify(value).free_symbols for value in (*self.force, self.energy))) - own


def pruned(law: ForceSymbols) -> tuple[ForceSymbols, tuple[int, ...]]:
    """The same forces on those rows alone that they read or push, renumbered from 0, and the old numbers of these (i,)."""
    count = len(law.force)
    read = set().union(*(sympy.sympify(value).free_symbols for value in (*law.force, *law.kept)))
    y, v = rows(count), rates(count)
    used = tuple(k for k in range(count) if law.force[k] != 0 or y[k] in read or v[k] in read)
    fewer = {old: new for full in (rows, rates) for old, new in zip([full(count)[k] for k in used], full(len(used)), strict=True)}
    found, kept = (
        [sympy.sympify(value).subs(fewer, simultaneous=True) for value in values]
        for values in ([law.force[k] for k in used], law.kept)
    )
    return ForceSymbols(
        found, law.numbers, law.histories, sympy.sympify(law.energy).subs(fewer, simultaneous=True), kept, law.tables
    ), used


def text(name: str, law: ForceSymbols) -> str:
    """Routines of a law, and the law itself as an entry of LAWS."""
    count, F = len(law.force), [plain(value) for value in law.force]
    y, v = rows(count), rates(count)
    pairs, slopes = [], []
    for i in range(count):
        for j in range(count):
            slope = plain(sympy.diff(F[i], y[j]) + RATE * sympy.diff(F[i], v[j]))
            if slope != 0:
                pairs.append((i, j))
                slopes.append(slope)
    potential = plain(law.energy)
    kept = [plain(value) for value in law.kept]
    angles = sorted(set().union(*(value.atoms(turned) for value in (*F, *kept, potential))), key=str)
    curves = sorted(set().union(*(value.atoms(lookup) for value in (*F, *kept))), key=str)
    outside = [beyond(*one.args) for one in curves]  # after what is kept, the largest one so far
    size = len(angles) + len(kept) + len(outside)
    held = [f"s.memory[F.memory + {size} * k + {n}]" for n in range(size)]
    accepted = [f"{one} = {{}}" if n < size - len(outside) else f"{one} = max({one}, {{}})" for n, one in enumerate(held)]
    last = sympy.symbols(f"m0:{len(angles)}", real=True)
    known = {angle: continued(angle.args[0], m) for angle, m in zip(angles, last, strict=True)}
    places = {
        **{y[k]: f"s.y[F.rows[k, {k}]]" for k in range(count)},
        **{v[k]: f"s.rates[F.rows[k, {k}]]" for k in range(count)},
        **{p: f"F.numbers[k, {k}]" for k, p in enumerate(numbers(law.numbers))},
        **{history(k): f"factor(s.signals, F.signals[k, {k}])" for k in range(law.histories)},
        **{table(k): f"F.numbers[k, {first}:{last}]" for k, (first, last) in enumerate(law.tables.values())},
        **dict(zip(last, held, strict=False)),
    }
    parts = {
        "force": (F, [f"s.g[F.rows[k, {k}]] += {{}}" for k in range(count)]),
        "slopes": (slopes, [f"s.H[F.pair + {len(pairs)} * k + {n}] += c * ({{}})" for n in range(len(pairs))]),
        "accept": ([*angles, *kept, *outside], accepted),
        "energy": (
            [potential, *(plain(sympy.diff(potential, one)) for one in y)] if potential != 0 else [],
            ["s.energy[0] += {}", *(f"s.g[F.rows[k, {k}]] += {{}}" for k in range(count))],
        ),
    }
    routines = [
        routine(f"{name}_{part}", HEADS[part], [value.xreplace(known) for value in values], targets, places)
        for part, (values, targets) in parts.items()
        if values or part in ("force", "slopes")
    ]
    damped = bool(set(v) & set().union(*(value.free_symbols for value in (*F, *kept))))
    given = [part for part in ("accept", "energy") if parts[part][0]]
    more = [*(f"{part}={name}_{part}" for part in given), *([f"kept={len(kept)}"] if kept else [])]
    if curves:
        names = list(law.tables)
        more.append(f"tables={tuple(names[int(str(one.args[1])[1:])] for one in curves)}")
    functions = ", ".join([f"{name}_force, {name}_slopes", *more])
    facts = f"{count}, {law.numbers}, {law.histories}, {tuple(pairs)}, {len(angles)}, {damped}"
    return "\n\n\n".join([*routines, f'LAWS["{name}"] = ForceLaw("{name}", {facts}, {functions})'])


def plain(value: Any) -> Expression:
    """An expression without what only exists as a derivative of a jump: delta functions are zero, steps are 0 or 1."""
    value = sympy.sympify(value)
    for kind, other in SIGN.items():
        value = value.replace(kind, other)
    return value


def routine(name: str, head: str, values: Sequence[Expression], targets: Sequence[str], places: Mapping[Any, str]) -> str:
    """Source of a routine `name` that gives values to targets, for all groups of rows.

    `head` are its first lines; `places` say how symbols are read; a target has {} where its value goes. Zeros are left out.
    """
    lines, found = statements(values, places)
    body = [*lines, *(target.format(value) for target, value in zip(targets, found, strict=True) if value != "0.0")] or ["pass"]
    start = f"@routine\ndef {name}(table: Any, record: Any) -> int:\n{head}\n    for k in range(len(F.rows)):"
    return "\n        ".join([start, *body]) + "\n    return 0"


def source(laws: Mapping[str, ForceSymbols], about: str) -> str:
    """Source of a module with LAWS of these names: routines for forces, derivatives, memory and energy.

    `about` is its docstring.
    """
    more = () if not any(law.tables for law in laws.values()) else CURVES
    return module(about, (*IMPORTS, *more), ["LAWS = {}", *(text(name, law) for name, law in laws.items())])
