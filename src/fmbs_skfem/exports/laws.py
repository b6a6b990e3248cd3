"""Laws in C: loops over the points of a body, written from the energy in symbols."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import sympy

from ..bodies import own_laws, strain_law
from ..bodies.laws import Law
from ..bodies.symbolic import LawSymbols, results
from ..core.errors import InputError
from ..core.values.problems import Problem
from . import law_symbols
from .text import block, number, replaced, statements, template

KINDS = "energy", "stress", "modulus"
# common factors of sums are a fifth of the operations of cables (6 numbers), and cost the tangent
# of shells (15) 74 s for 4 s, with 2417 operations for 2231
FEW = 9  #: numbers of gradients up to which they are looked for
HEADS = {
    "energy": "static double {name}_energy(int n, const double *restrict u, const double *restrict s)",
    "stress": "static void {name}_stress(int n, const double *restrict u, const double *restrict v, const double *restrict s,\n"
    "{pad}double beta, double *restrict S)",
    "modulus": "static void {name}_modulus(int n, const double *restrict u, const double *restrict held,\n"
    "{pad}const double *restrict s, double beta, double *restrict D)",
}


def refuse(law: Law, dim: int) -> Problem | None:
    """What speaks against a law in C: its energy is not known in symbols, and it is no law of
    quadratic strains.
    """
    if law is Law.BEAM or symbols_of(law, dim) is not None:
        return None
    return Problem(
        "a law with its energy in symbols", law.name, "cables, beams, membranes and shells have one"
    )


def symbols_of(law: Law, dim: int) -> LawSymbols | None:
    """The energy of a law in symbols, one of this package or of one's own; None of one that has
    none.
    """
    return law_symbols.symbols_of(law, dim) or own_laws.symbols_of(law.name)


def holds(law: Law, dim: int) -> bool:
    """Whether first tangents of a step take strains of the state before."""
    return law is Law.BEAM or law_symbols.held_strains(law, dim) is not None


def functions(
    law: Law, dim: int, damped: bool, zeros: Sequence[int], where: str
) -> tuple[str, dict[str, str]]:
    """The name of a law, and its functions by name, of sections whose rows `zeros` are zero;
    InputError, after `where`, without.
    """
    if law is Law.BEAM:
        return "beam", {"beam": quadratic_strains("beam")}
    if (problem := refuse(law, dim)) is not None:
        raise InputError(problem.at(where))
    symbols = symbols_of(law, dim)
    assert symbols is not None
    parts = [
        law.name.lower(),
        str(dim),
        *(f"no_{law.section[k]}" for k in zeros),
        *(["damped"] if damped else []),
    ]
    name = "_".join(parts)
    known = set_zero(symbols, zeros)
    found = {f"{name}_{kind}": function(known, law, dim, kind, damped, name) for kind in KINDS}
    return name, found


def set_zero(law: LawSymbols, zeros: Sequence[int]) -> LawSymbols:
    """The law where some numbers of its section are zero."""

    def given(section: Sequence[Any]) -> list[Any]:
        return [sympy.Integer(0) if k in zeros else one for k, one in enumerate(section)]

    return LawSymbols(
        law.vectors,
        law.section,
        lambda r, *section: law.energy(r, *given(section)),
        None
        if law.dissipation is None
        else lambda r, v, *section: law.dissipation(r, v, *given(section)),  # type: ignore[misc]
    )


def function(symbols: LawSymbols, law: Law, dim: int, kind: str, damped: bool, name: str) -> str:
    """The text of one function: a loop over n points, numbers of a kind behind each other."""
    count = symbols.vectors * dim
    many = len(symbols.section) + 1
    wanted, names = results(symbols, dim, "damped_stress" if kind == "stress" and damped else kind)
    if kind == "modulus" and damped:
        viscous, _ = results(symbols, dim, "viscosity")
        wanted = [one + other for one, other in zip(wanted, viscous, strict=True)]
    before = sympy.symbols(f"g:{count}", real=True)
    if kind == "modulus" and (axial := law_symbols.held_strains(law, dim)):
        wanted = [
            one + other
            for one, other in zip(
                wanted, held_part(axial, names, before, symbols, dim), strict=True
            )
        ]
    places = [
        *(f"u[{k} * n + q]" for k in range(count)),
        *(f"v[{k} * n + q]" for k in range(count)),
    ]
    places += [f"s[{k} * n + q]" for k in range(many)]
    known = dict(zip(names[:-1], places, strict=True)) | {
        one: f"held[{k} * n + q]" for k, one in enumerate(before)
    }
    lines, found = statements(wanted, known, factored=count <= FEW)
    if kind == "energy":
        body = [*lines, f"total += {found[0]};"]
    elif kind == "stress":
        body = [*lines, *(f"S[{k} * n + q] = {one};" for k, one in enumerate(found))]
    else:
        body = [*lines, *(f"D[{k} * n + q] = {one};" for k, one in enumerate(found))]
    text = "\n".join(body)
    unused = [
        one for one, read in (("v", "v["), ("held", "held["), ("beta", "beta")) if read not in text
    ]
    taken = {"energy": (), "stress": ("v", "beta"), "modulus": ("held", "beta")}[kind]
    unread = [f"(void){one};" for one in taken if one in unused]
    head = HEADS[kind].format(name=name, pad=" " * (len(f"static void {name}_{kind}(")))
    start = [*unread, *(["double total = 0.0;"] if kind == "energy" else [])]
    loop = f"    for (int q = 0; q < n; q++) {{\n{block(body, 2)}\n    }}"
    end = ["return total;"] if kind == "energy" else []
    parts = [
        f"{head}\n{{",
        *([block(start)] if start else []),
        loop,
        *([block(end)] if end else []),
        "}",
    ]
    return "\n".join(parts) + "\n"


def held_part(
    axial: Any, names: Sequence[Any], before: Sequence[Any], symbols: LawSymbols, dim: int
) -> list[Any]:
    """What strains e of the state before change of the lower half of a modulus: w sum_ab C_ab
    (e_b(g) - e_b(u)) d2e_a/du2.
    """
    strains, stiffness = axial
    count = symbols.vectors * dim
    u, (*section, w) = names[:count], names[2 * count : -1]
    now, then = (
        strains([sympy.Matrix(one[k * dim : (k + 1) * dim]) for k in range(symbols.vectors)])
        for one in (u, before)
    )
    C = sympy.Matrix(stiffness(*section))
    more = C * (sympy.Matrix(then) - sympy.Matrix(now))
    return [
        w * sum(f * sympy.diff(e, u[i], u[j]) for f, e in zip(more, now, strict=True))
        for i in range(count)
        for j in range(i + 1)
    ]


def quadratic_strains(name: str) -> str:
    """A law of strains that are quadratic in vectors, see `bodies.strain_law`: the beam."""
    free, held = strain_law.FREE, strain_law.HELD
    strains = [*free, *(terms for terms, _ in held)]
    terms = [(k, i, j, f) for k, one in enumerate(strains) for i, j, f in one]
    many = len(free)
    pairs = [(k, l, 1.0) for k in range(many) for l in range(k, many)]
    rows = [(k, l, row) for row, (k, l, _) in enumerate(pairs)] + [
        (many + k, many + k, len(pairs)) for k in range(len(held))
    ]
    parts = [1.0] * len(pairs) + [part for _, part in held]
    words = {
        "LAW": name, "VECTORS": Law.BEAM.vectors, "TERMS_": len(terms), "PAIRS_": len(rows), "STRAINS_": len(strains),
        "FIRST_": strain_law.FIRST, "LAST_": Law.BEAM.rows - 1, "OF": listed(term[:3] for term in terms),
        "FACTORS": ", ".join(number(f) for *_, f in terms), "COUPLED": listed(rows), "PARTS": ", ".join(map(number, parts)),
    }  # fmt: skip
    return replaced(template("strains.c"), words)


def listed(rows: Iterable[Sequence[int]]) -> str:
    """Rows of a table of C."""
    return ", ".join("{" + ", ".join(map(str, row)) + "}" for row in rows)
