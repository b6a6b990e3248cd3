r"""Laws of strains that are quadratic in vectors, as those of a beam with three directors.

    e_k = sum_t f_t u_i(t) . u_j(t) - e0_k,    W = 1/2 sum_kl C_kl e_k e_l + 1/2 E sum_m p_m e_m^2

of gradients u = (u_0, ... u_n), vectors in space: strains k, l with any stiffness C between them,
and m that hold lengths and angles between vectors by the stiffness E. With g_k = de_k/du = A_k u,
A_k constant,

    S = sum_k s_k g_k,   s = C e,        D = sum_k s_k A_k + sum_kl C_kl g_k g_l^T

Stiffness-proportional damping is of Kelvin-Voigt type, s = C (e + beta de/dt): rigid motions are
not damped.

A beam has the centre line r and the directors d_1 along it, d_2 and d_3 in its section:

    Gamma_i = d_i . r',    kappa_1 = 1/2 (d_3 . d_2' - d_2 . d_3')  (cyclic),    E_ij = d_i . d_j

each less its value in the reference: axial and shear strains, torsion and curvatures about d_2 and
d_3; E holds the section rigid. Where a section warps with its torsion, and its fibres lengthen by it,
there are two more, quadratic as these, since (d_3 . d_2' - d_2 . d_3')' has no products of slopes,
and |d_i'|^2 = kappa_j^2 + kappa_k^2:

    kappa_1' = 1/2 (d_3 . d_2'' - d_2 . d_3''),    kappa_1^2 = 1/2 (|d_2'|^2 + |d_3'|^2 - |d_1'|^2)

E holds the section rigid. The modulus takes the strains of sum_k s_k A_k from gradients of its
own, see `laws.call_modulus`.

Arrays: gradients `u` (3 n, p, e), stresses `S` the same, moduli `D` (3 n, 3 n, p, e); `section` (i,
p, e) holds the upper triangle of C row by row, E, the strains e0 and the weight.

Source: S. S. Antman, Nonlinear Problems of Elasticity, 2nd ed., Springer 2005,
doi:10.1007/0-387-27649-1, ch. 8 (the strains); P. Betsch and P. Steinmann, Int. J. Numer. Methods
Eng. 54 (2002) 1775-1788, doi:10.1002/nme.487 (directors as coordinates).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..core.compiling.entries import entry
from ..core.compiling.jit import carray, inlined
from .vectors import LINEAR

Terms = Sequence[tuple[int, int, float]]  #: (i, j, f) of a strain: f u_i . u_j


@inlined
def begin(first: int, c: np.ndarray, e: np.ndarray) -> None:
    """e (k, q) = -e0 of sections c (i, q), whose rows e0 begin at `first`."""
    for k in range(len(e)):
        for q in range(e.shape[1]):
            e[k, q] = -c[first + k, q]


@inlined
def add_products(
    of: np.ndarray, factors: np.ndarray, share: float, u: np.ndarray, v: np.ndarray, e: np.ndarray
) -> None:
    """Add products of vectors to strains, of all terms t.

        e_k += share f_t u_i . v_j

    strain k, vectors i and j in a row of `of`; u and v (3 n, q).
    """
    for t in range(len(of)):
        k = of[t, 0]
        i = 3 * of[t, 1]
        j = 3 * of[t, 2]
        f = share * factors[t]
        for q in range(e.shape[1]):
            e[k, q] += f * (
                u[i, q] * v[j, q] + u[i + 1, q] * v[j + 1, q] + u[i + 2, q] * v[j + 2, q]
            )


@inlined
def add_forces(
    of: np.ndarray, parts: np.ndarray, c: np.ndarray, e: np.ndarray, s: np.ndarray
) -> None:
    """Add forces that belong to strains, over all pairs (k, l) of which a row of `parts` has a
    part.

        s_k += weight C_kl e_l

    with the row of C in the sections c (i, q).
    """
    weight = c[len(c) - 1]
    for t in range(len(of)):
        k, l, row = of[t]
        for q in range(e.shape[1]):
            s[k, q] += weight[q] * parts[t] * c[row, q] * e[l, q]
        if k != l:
            for q in range(e.shape[1]):
                s[l, q] += weight[q] * parts[t] * c[row, q] * e[k, q]


@inlined
def find_slopes(of: np.ndarray, factors: np.ndarray, u: np.ndarray, p: int, g: np.ndarray) -> None:
    """g (t, 3, q) = f_t u_j at point p of the gradients u (3 n, p, q), for all terms t of the A_k
    (strain k, vectors i and j in a row of `of`).
    """
    for t in range(len(of)):
        j = 3 * of[t, 2]
        f = factors[t]
        for d in range(3):
            for q in range(g.shape[2]):
                g[t, d, q] = f * u[j + d, p, q]


@inlined
def add_pair(
    of: np.ndarray,
    starts: np.ndarray,
    k: int,
    l: int,
    C: np.ndarray,
    g: np.ndarray,
    D: np.ndarray,
    p: int,
) -> None:
    """D += C_kl (g_k g_l^T + g_l g_k^T), or C_kk g_k g_k^T, in the lower triangle at point p, of C
    (q,) and the terms g (t, 3, q) of all strains; those of strain k begin at starts[k].
    """
    for x in range(starts[k], starts[k + 1]):
        for y in range(starts[l], starts[l + 1]):
            for d in range(3):
                for h in range(3):
                    a, b = 3 * of[x, 1] + d, 3 * of[y, 1] + h
                    target = D[max(a, b), min(a, b), p]
                    if a >= b or k != l:
                        twice = 2.0 if a == b and k != l else 1.0
                        for q in range(len(C)):
                            target[q] += twice * C[q] * g[x, d, q] * g[y, h, q]


@inlined
def add_geometric(
    of: np.ndarray, factors: np.ndarray, s: np.ndarray, D: np.ndarray, p: int
) -> None:
    """D += sum_k s_k A_k, its geometric part, in the lower triangle at point p, of stresses s (k,
    q).
    """
    for t in range(len(of)):
        k = of[t, 0]
        i = 3 * of[t, 1]
        j = 3 * of[t, 2]
        f = factors[t]
        if i >= j:
            for d in range(3):
                for q in range(s.shape[1]):
                    D[i + d, j + d, p, q] += f * s[k, q]


@inlined
def clear_lower(D: np.ndarray, p: int) -> None:
    """D = 0 in the lower triangle at point p."""
    for a in range(len(D)):
        for b in range(a + 1):
            for q in range(D.shape[3]):
                D[a, b, p, q] = 0.0


@inlined
def mirror(D: np.ndarray, p: int) -> None:
    """The upper triangle of D as the lower one at point p."""
    for a in range(len(D)):
        for b in range(a):
            for q in range(D.shape[3]):
                D[b, a, p, q] = D[a, b, p, q]


def functions(
    name: str, vectors: int, free: Sequence[Terms], held: Sequence[tuple[Terms, float]]
) -> dict[str, Callable[[], int]]:
    """Functions of the law of strains `free`, with any stiffness between them, and `held` ones,
    each with its part p of E.
    """
    strains = [*free, *(terms for terms, _ in held)]
    many = len(strains)
    coupled = len(free)
    rows = 3 * vectors
    # term by term: strain, vectors, factor
    of = np.array([(k, i, j) for k, terms in enumerate(strains) for i, j, _ in terms])
    factors = np.array([f for terms in strains for *_, f in terms])
    # A_k u by vectors: strain, vector that it belongs to, vector that it reads, factor; those of a
    # strain behind each other
    slopes = sorted(
        (k, a, b, f)
        for k, terms in enumerate(strains)
        for i, j, f in terms
        for a, b in ((i, j), (j, i))
    )
    merged: dict[tuple[int, int, int], float] = {}
    for k, a, b, f in slopes:
        merged[k, a, b] = merged.get((k, a, b), 0.0) + f
    of_slope, slope_factors = np.array(list(merged)), np.array(list(merged.values()))
    starts = np.searchsorted(of_slope[:, 0], np.arange(many + 1))
    # pairs of strains with the row of their stiffness, and its part: any two free ones, and each
    # that is held
    free_pairs = [(k, l) for k in range(coupled) for l in range(k, coupled)]
    stiff = len(free_pairs)
    first = len(free_pairs) + 1  # rows of E and of the first e0
    pairs = np.array(
        [(k, l, row) for row, (k, l) in enumerate(free_pairs)]
        + [(k, k, stiff) for k in range(coupled, many)]
    )
    parts = np.array([1.0] * stiff + [part for _, part in held])
    lines = first + many + 1
    found: dict[str, Callable[[], int]] = {}

    def named(function: Callable[..., None]) -> None:
        function.__qualname__ = f"{name}_{function.__name__}"
        found[function.__qualname__] = entry(function)

    @named
    def energy(
        u: Any,
        _: Any,
        section: Any,
        W: Any,
        way: int,
        points: int,
        cells: int,
        option: int,
        beta: float,
    ) -> None:
        count = points * cells
        u, c = carray(u, (rows, count)), carray(section, (lines, count))
        e = np.empty((many, count))
        s = np.zeros((many, count))
        total = 0.0
        begin(first, c, e)
        add_products(of, factors, 1.0, u, u, e)
        add_forces(pairs, parts, c, e, s)
        for k in range(many):
            for q in range(count):
                total += 0.5 * e[k, q] * s[k, q]
        carray(W, 1)[0] = total

    @named
    def stress(
        u: Any,
        rate: Any,
        section: Any,
        S: Any,
        way: int,
        points: int,
        cells: int,
        option: int,
        beta: float,
    ) -> None:
        count = points * cells
        u, v, c, S = (
            carray(u, (rows, count)),
            carray(rate, (rows, count)),
            carray(section, (lines, count)),
            carray(S, (rows, count)),
        )
        e = np.empty((many, count))
        s = np.zeros((many, count))
        begin(first, c, e)
        add_products(of, factors, 1.0, u, u, e)
        if beta > 0.0:
            add_products(of, factors, beta, u, v, e)
            add_products(of, factors, beta, v, u, e)
        add_forces(pairs, parts, c, e, s)
        S[:] = 0.0
        for t in range(len(of_slope)):
            k = of_slope[t, 0]
            i = 3 * of_slope[t, 1]
            j = 3 * of_slope[t, 2]
            f = slope_factors[t]
            for q in range(count):
                S[i, q] += f * s[k, q] * u[j, q]
                S[i + 1, q] += f * s[k, q] * u[j + 1, q]
                S[i + 2, q] += f * s[k, q] * u[j + 2, q]

    @named
    def dissipation(
        u: Any,
        rate: Any,
        section: Any,
        W: Any,
        way: int,
        points: int,
        cells: int,
        option: int,
        beta: float,
    ) -> None:
        count = points * cells
        u, v, c, W = (
            carray(u, (rows, count)),
            carray(rate, (rows, count)),
            carray(section, (lines, count)),
            carray(W, count),
        )
        e, s = np.zeros((many, count)), np.zeros((many, count))
        add_products(of, factors, 1.0, u, v, e)
        add_products(of, factors, 1.0, v, u, e)
        add_forces(pairs, parts, c, e, s)
        W[:] = 0.0
        for k in range(many):
            for q in range(count):
                W[q] += e[k, q] * s[k, q]

    @named
    def modulus(
        u: Any,
        held: Any,
        section: Any,
        D: Any,
        way: int,
        points: int,
        cells: int,
        option: int,
        beta: float,
    ) -> None:
        u, c = carray(u, (rows, points, cells)), carray(section, (lines, points, cells))
        w = carray(held, (rows, points, cells))
        D = carray(D, (rows, rows, points, cells))
        e, s, C = np.empty((many, cells)), np.empty((many, cells)), np.empty(cells)
        g = np.empty((len(of_slope), 3, cells))
        for p in range(points):
            s[:] = 0.0
            begin(first, c[:, p], e)
            if way == LINEAR:
                add_products(of, factors, 1.0, u[:, p], w[:, p], e)
                add_products(of, factors, 1.0, w[:, p], u[:, p], e)
                add_products(of, factors, -1.0, w[:, p], w[:, p], e)
            else:
                add_products(of, factors, 1.0, w[:, p], w[:, p], e)
            add_forces(pairs, parts, c[:, p], e, s)
            clear_lower(D, p)
            find_slopes(of_slope, slope_factors, u, p, g)
            # sums over pairs of strains that are coupled here: at points of a reduced rule most of
            # them are not
            for pair in range(len(pairs)):
                (k, l, row) = pairs[pair]
                largest = 0.0
                for q in range(cells):
                    C[q] = (1.0 + beta) * c[lines - 1, p, q] * parts[pair] * c[row, p, q]
                    largest = max(largest, abs(C[q]))
                if largest == 0.0:
                    continue
                add_pair(of_slope, starts, k, l, C, g, D, p)
            add_geometric(of_slope, slope_factors, s, D, p)
            mirror(D, p)

    return found


CROSS = ((1, 2), (2, 0), (0, 1))  #: j and k beside i = 0, 1, 2
#: numbers of d_1, r', d_1' and d_1'' among the vectors of a beam
DIRECTOR, SLOPE, TURN, BEND = 1, 4, 5, 9
STRETCHES = tuple(((SLOPE, DIRECTOR + i, 1.0),) for i in range(3))
CURVATURES = tuple(
    ((TURN + j, DIRECTOR + k, 0.5), (TURN + k, DIRECTOR + j, -0.5)) for j, k in CROSS
)
HELD = tuple((((DIRECTOR + i, DIRECTOR + i, 1.0),), 0.25) for i in range(3))
HELD += tuple((((DIRECTOR + j, DIRECTOR + k, 1.0),), 0.5) for j, k in CROSS)
FREE = (*STRETCHES, *CURVATURES)
WARPING = ((BEND + 1, DIRECTOR + 2, 0.5), (BEND + 2, DIRECTOR + 1, -0.5))
TRAPEZE = tuple((TURN + i, TURN + i, -0.5 if i == 0 else 0.5) for i in range(3))
WARPED = (*FREE, WARPING, TRAPEZE)
FUNCTIONS = functions("beam", 8, FREE, HELD) | functions("warped_beam", 12, WARPED, HELD)


def strains(u: np.ndarray) -> np.ndarray:
    """Strains of a beam (12, ...), without those of the reference; of one that warps (14, ...).

        Gamma_i = d_i . r',    kappa_1 = 1/2 (d_3 . d_2' - d_2 . d_3')  (cyclic),    E_ij = d_i . d_j

    of gradients u (8, 3, ...); with those of the second order, (12, 3, ...), kappa_1' and kappa_1^2
    stand before E.
    """
    free = FREE if len(u) == 8 else WARPED
    return np.stack(
        [
            sum(f * (u[i] * u[j]).sum(axis=0) for i, j, f in terms)
            for terms in (*free, *(terms for terms, _ in HELD))
        ]
    )


def first_strain(section: np.ndarray) -> int:
    """The row of the first strain of the reference in a section (i, ...) of a beam in space."""
    return len(section) - 1 - len(HELD) - (len(FREE) if len(section) < 40 else len(WARPED))
