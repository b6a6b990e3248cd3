"""Laws in C: loops over the points of a body, written from the energy in symbols."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy

from ..bodies import own_laws
from ..bodies.laws import Law
from ..bodies.symbolic import LawSymbols, results
from ..core.errors import InputError, say
from . import law_symbols
from .text import block, statements

KINDS = "energy", "stress", "modulus"
HEADS = {
    "energy": "static double {name}_energy(int n, const double *restrict u, const double *restrict s)",
    "stress": "static void {name}_stress(int n, const double *restrict u, const double *restrict v, const double *restrict s,\n"
    "{pad}double beta, double *restrict S)",
    "modulus": "static void {name}_modulus(int n, const double *restrict u, const double *restrict held,\n"
    "{pad}const double *restrict s, double beta, double *restrict D)",
}


def written(law: Law, dim: int, where: str) -> LawSymbols:
    """The energy of a law in symbols; InputError, after `where`, for one that has none."""
    found = law_symbols.symbols_of(law, dim) or own_laws.symbols_of(law.name)
    if found is None:
        raise InputError(say(where, "a law with its energy in symbols", f"{law.name}", "cables, membranes and shells have one"))
    return found


def holds(law: Law) -> bool:
    """Whether first tangents of a step take the axial strains of the state before: cables."""
    return law.holds and law.bends


def functions(law: Law, dim: int, damped: bool, zeros: Sequence[int], where: str) -> tuple[str, dict[str, str]]:
    """The name of a law, and its functions by name, of sections whose rows `zeros` are zero."""
    symbols = written(law, dim, where)
    parts = [law.name.lower(), str(dim), *(f"no_{law.section[k]}" for k in zeros), *(["damped"] if damped else [])]
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
        None if law.dissipation is None else lambda r, v, *section: law.dissipation(r, v, *given(section)),  # type: ignore[misc]
    )


def function(symbols: LawSymbols, law: Law, dim: int, kind: str, damped: bool, name: str) -> str:
    """The text of one function: a loop over n points, numbers of a kind behind each other."""
    count, many = symbols.vectors * dim, len(symbols.section) + 1
    wanted, names = results(symbols, dim, "damped_stress" if kind == "stress" and damped else kind)
    if kind == "modulus" and damped:
        viscous, _ = results(symbols, dim, "viscosity")
        wanted = [one + other for one, other in zip(wanted, viscous, strict=True)]
    places = [*(f"u[{k} * n + q]" for k in range(count)), *(f"v[{k} * n + q]" for k in range(count))]
    places += [f"s[{k} * n + q]" for k in range(many)]
    lines, found = statements(wanted, dict(zip(names[:-1], places, strict=True)), factored=True)
    if kind == "energy":
        body = [*lines, f"total += {found[0]};"]
    elif kind == "stress":
        body = [*lines, *(f"S[{k} * n + q] = {one};" for k, one in enumerate(found))]
    else:
        body = [*lines, *(f"D[{k} * n + q] = {one};" for k, one in enumerate(found))]
        if holds(law):
            square = [" + ".join(f"{array}[{c} * n + q] * {array}[{c} * n + q]" for c in range(dim)) for array in ("held", "u")]
            body.append(f"const double more = 0.5 * s[{many - 1} * n + q] * s[0 * n + q] * (({square[0]}) - ({square[1]}));")
            body += [f"D[{c * (c + 3) // 2} * n + q] += more;" for c in range(dim)]
    text = "\n".join(body)
    unused = [one for one, read in (("v", "v["), ("held", "held["), ("beta", "beta")) if read not in text]
    taken = {"energy": (), "stress": ("v", "beta"), "modulus": ("held", "beta")}[kind]
    before = [f"(void){one};" for one in taken if one in unused]
    head = HEADS[kind].format(name=name, pad=" " * (len(f"static void {name}_{kind}(")))
    start = [*before, *(["double total = 0.0;"] if kind == "energy" else [])]
    loop = f"    for (int q = 0; q < n; q++) {{\n{block(body, 2)}\n    }}"
    end = ["return total;"] if kind == "energy" else []
    parts = [f"{head}\n{{", *([block(start)] if start else []), loop, *([block(end)] if end else []), "}"]
    return "\n".join(parts) + "\n"
