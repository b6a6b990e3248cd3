r"""Laws written as their energy in symbols: stress, modulus and damping follow and become compiled
loops.

    S = w (dW/du + beta dR/dv),     D = w (d2W/du2 + b d2R/dv2),     v = du/dt,     b = gh beta

with an energy W(u) of the gradients u and, for damping of Kelvin-Voigt type, a dissipation R(u, v),
half the power that a damping time beta of 1 s turns into heat. A law that is given by its strains
e(u) and a section stiffness C has

    W = (e - e0)^T C (e - e0) / 2,     R = (de/du v)^T C (de/du v) / 2  (`quadratic_dissipation`)

Derivatives are taken by SymPy, common subexpressions once, and the loop runs over all points, so
that it becomes vector instructions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import sympy

from ..core.compiling.symbols import Expression, module, scalar, statements
from ..core.storage.records import dataclass
from .laws import KINDS

Vectors: TypeAlias = list[sympy.Matrix]  #: r,1 ... r,k
#: W of vectors and of the numbers of a section but the weight
Energy: TypeAlias = Callable[..., Expression]
Dissipation: TypeAlias = Callable[..., Expression]  #: R of vectors, their rates and those numbers

HEAD = "(u: Any, v: Any, s: Any, out: Any, way: int, points: int, cells: int, option: int, beta: float) -> None:"
FRAMES = {  # of a loop over all points, with where the results of a point go
    "energy": (
        """    {views}
    total = 0.0
    for q in range(count):
        {point}
    carray(out, 1)[0] = total""",
        "total +=",
    ),
    "dissipation": (
        """    {views}
    W = carray(out, count)
    for q in range(count):
        {point}""",
        "W[q] =",
    ),
    "stress": (
        """    {views}
    S = carray(out, ({rows}, count))
    for q in range(count):
        {point}""",
        "S[{0}, q] =",
    ),
    "modulus": (
        """    {views}
    D, T = carray(out, ({rows}, {rows}, count)), np.empty(({size}, LANES))
    for first in range(0, count, LANES):
        for k in range(min(LANES, count - first)):
            q = first + k
            {point}
        unfold(T, first, D, {onto})""",
        "T[{0}, k] =",
    ),
    "small modulus": (
        """    {views}
    D = carray(out, ({rows}, {rows}, count))
    for q in range(count):
        {point}""",
        "D[{1}, {2}, q] = D[{2}, {1}, q] =",
    ),
}
SMALL = 12  #: results of a loop that need no room of their own to become vector instructions


@dataclass(frozen=True)
class LawSymbols:
    """An energy [J/m or J/m2] of `vectors` derivatives of r, with the `section` numbers but the
    weight, and its dissipation.

    `energy(r, *section)` and `dissipation(r, rates, *section)` take and give symbols; r and rates
    are k matrices (c,).
    """

    vectors: int
    section: tuple[str, ...]
    energy: Energy
    dissipation: Dissipation | None = None


def quadratic_dissipation(
    strains: Callable[..., Sequence[Expression]],
    stiffness: Callable[..., Sequence[Sequence[Expression]]],
) -> Dissipation:
    """Dissipation of strains e of vectors and a section, with the section stiffness C, in symbols.

        R = (de/dt)^T C (de/dt) / 2

    `strains(r, *section)` gives e (i,), `stiffness(*section)` gives C (i, i).
    """

    def dissipation(r: Vectors, v: Vectors, *section: Expression) -> Expression:
        rates = sympy.Matrix([rate(e, r, v) for e in strains(r, *section)])
        return (rates.T * sympy.Matrix(stiffness(*section)) * rates)[0] / 2

    return dissipation


def rate(value: Expression, r: Vectors, v: Vectors) -> Expression:
    """Time derivative of a function of the gradients.

        sum_kc d value / dr_kc v_kc

    `r` and `v` are k vectors (c,) in symbols and their rates.
    """
    return sum(
        sympy.diff(value, x) * y
        for one, other in zip(r, v, strict=True)
        for x, y in zip(one, other, strict=True)
    )


def results(law: LawSymbols, dim: int, kind: str) -> tuple[list[Expression], list[Expression]]:
    """Results of one kind for one point, of a symmetric matrix the lower triangle, and the symbols
    u, v, section, w and beta.

    `kind` is one of `laws.KINDS`. With k c gradients there are 1 (energy, dissipation), k c
    (stress) or k c (k c + 1) / 2 (modulus, viscosity) results, times the weight w; u and v have k c
    symbols each.
    """
    count = law.vectors * dim
    u, v = sympy.symbols(f"u:{count}", real=True), sympy.symbols(f"v:{count}", real=True)
    # names of a user could be those of other variables
    *section, w = sympy.symbols(f"s:{len(law.section) + 1}", real=True)
    beta = sympy.Symbol("beta")
    r, rates = (
        [sympy.Matrix(one[k * dim : (k + 1) * dim]) for k in range(law.vectors)] for one in (u, v)
    )
    W = scalar("energy of a law", law.energy(r, *section))
    symbols = [*u, *v, *section, w, beta]
    if kind == "energy":
        return [w * W], symbols
    S = [sympy.diff(W, x) for x in u]
    damped = kind in ("damped_stress", "viscosity", "dissipation")
    R = scalar(
        "dissipation of a law",
        law.dissipation(r, rates, *section) if damped and law.dissipation else 0,
    )
    if kind == "dissipation":
        return [2 * w * R], symbols
    pull = [sympy.diff(R, y) for y in v]
    if kind.endswith("stress"):
        return [w * (a + beta * b) for a, b in zip(S, pull, strict=True)], symbols
    pairs = [(i, j) for i in range(count) for j in range(i + 1)]
    return [
        w * (sympy.diff(S[i], u[j]) if kind == "modulus" else beta * sympy.diff(pull[i], v[j]))
        for i, j in pairs
    ], symbols


def loop(law: LawSymbols, dim: int, kind: str, name: str) -> str:
    """Source of the entry `name` for one kind."""
    wanted, symbols = results(law, dim, kind)
    count = law.vectors * dim
    numbers = len(law.section) + 1
    places = [
        f"{array}[{i}, q]"
        for array, size in (("u", count), ("v", count), ("s", numbers))
        for i in range(size)
    ]
    lines, found = statements(wanted, dict(zip(symbols, places, strict=False)))
    matrix = kind in ("modulus", "viscosity")
    onto = kind == "viscosity"  # which is added to the modulus
    frame, target = FRAMES[
        "small modulus"
        if matrix and len(found) <= SMALL
        else "modulus"
        if matrix
        else kind.removeprefix("damped_")
    ]
    target += " D[{1}, {2}, q] +" if onto and target[0] == "D" else ""
    pairs = [(i, j) for i in range(count) for j in range(i + 1)]
    point = lines + [
        f"{target.format(k, *pair)} {value}"
        for k, (value, pair) in enumerate(zip(found, pairs, strict=False))
    ]
    views = [f"u = carray(u, ({count}, count))", f"s = carray(s, ({numbers}, count))"]
    views += [f"v = carray(v, ({count}, count))"] if lines and "v[" in lines[0] else []
    indent = " " * (12 if target[0] == "T" else 8)
    text = frame.format(
        views="\n    ".join(views),
        point=f"\n{indent}".join(point),
        size=len(found),
        onto=onto,
        rows=count,
    )
    return f"@entry\ndef {name}{HEAD}\n    count = points * cells\n{text}"


def source(law: LawSymbols, dims: Sequence[int], about: str) -> str:
    """Source of a module with the entries `own_DIM_KIND` of a law, for every number of components
    in `dims` and every kind.

    `about` is its docstring. Without a dissipation the damped kinds are those without damping, and
    the viscosity is zero.
    """
    needed = [
        "import numpy as np",
        "from fmbs_skfem.core.compiling.entries import LANES, entry, unfold",
        "from fmbs_skfem.core.compiling.jit import carray",
    ]
    return module(
        about, needed, [loop(law, dim, kind, f"own_{dim}_{kind}") for dim in dims for kind in KINDS]
    )
