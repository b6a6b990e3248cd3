r"""What holds at a place s of a line, as a constraint function by a law: s is a coordinate, and
selects the cell.

    phi = p + sum_c a_c R_c,    R_c = sum_b N_b(s) Y_bc                                                                (1)

N_b are polynomials of a cell, or their derivatives by s, Y_b the coefficients of a field of the
line: its positions, or a director of a beam. a_c and p are probe rows as well. With a = -1 and p
the component of a point, it is on the line; with p = 0 and a vector a of a body, this stays normal
to the slope or director at s. Beyond the ends the polynomials of the last cell go on.

    dR/dt = R' s' + Y',   ...        derivatives are as smooth as the splines are: R'' jumps where these are C1

Source: H. Sugiyama, J. L. Escalona, A. A. Shabana, Formulation of three-dimensional joint
constraints using the absolute nodal coordinates, Nonlinear Dynamics 31 (2003) 167-195,
doi:10.1023/A:1022082826627 (the arc length as a coordinate of the joint).
"""

from __future__ import annotations

from math import factorial
from typing import Any

import numpy as np

from ...core.compiling.jit import jit
from ...core.compiling.structs import routine
from ...shapes import line
from ..evaluation import evaluation
from .constraint_laws import ConstraintLaw, ConstraintRoutines, opened

WORD = "line"
HEAD = 3  #: numbers in front: components, functions on a cell, derivative by s


@jit
def layout(F: Any, k: int) -> tuple[int, int, int, int]:
    """Components c, functions on a cell, the derivative that is taken, and the number of cells, of
    row k.
    """
    c, b, order = int(F.numbers[k, 0]), int(F.numbers[k, 1]), int(F.numbers[k, 2])
    return c, b, order, (F.numbers.shape[1] - HEAD - 1) // (2 + b * b)


@jit
def cell_of(F: Any, k: int, s: float, cells: int) -> int:
    """The cell on which s is; the first or the last one beyond the ends."""
    found = int(np.searchsorted(F.numbers[k, HEAD : HEAD + cells + 1], s, "right")) - 1
    return min(max(found, 0), cells - 1)


@jit
def share(F: Any, k: int, e: int, b: int, s: float, order: int) -> float:
    """Derivative of a function of a line by the place along it.

        N_b^(order)(s) = d^order/ds^order sum_j C_bj u^j,    u = (s - s_e) / h

    of function b of cell e.
    """
    _, count, first, cells = layout(F, k)
    start = F.numbers[k, HEAD + e]
    h = F.numbers[k, HEAD + e + 1] - start
    u = (s - start) / h
    total = 0.0
    begin = HEAD + 2 * cells + 1 + (e * count + b) * count
    order = order + first
    for j in range(count - 1, order - 1, -1):
        factor = 1.0
        for i in range(order):
            factor *= j - i
        total = total * u + factor * F.numbers[k, begin + j]
    return total / h**order


@jit
def node(F: Any, k: int, e: int, cells: int) -> int:
    """The first function of a cell."""
    return int(F.numbers[k, HEAD + cells + 1 + e])


@jit
def value(F: Any, k: int, e: int, y: np.ndarray, c: int, s: float, order: int) -> float:
    """Derivative of a line by the place along it, one component c.

        sum_b N_b^(order)(s) Y_bc

    with the coefficients Y in y, in the cell e.
    """
    dim, count, _, cells = layout(F, k)
    first = node(F, k, e, cells)
    total = 0.0
    for b in range(count):
        total += share(F, k, e, b, s, order) * y[F.rows[k, 2 + dim + (first + b) * dim + c]]
    return total


@routine
def constrain(table: Any, record: Any) -> int:
    w = evaluation(table).space
    F = opened(record)
    gap = w.rhs[0, len(w.rhs[0]) - len(w.multipliers) :]
    for k in range(len(F.rows)):
        dim, count, _, cells = layout(F, k)
        row = F.row[k]
        s = w.y[F.rows[k, 0]]
        e = cell_of(F, k, s, cells)
        gap[row] += w.y[F.rows[k, 1]]
        w.Jy[row, F.rows[k, 1]] += 1.0
        for c in range(dim):
            a = w.y[F.rows[k, 2 + c]]
            R = value(F, k, e, w.y, c, s, 0)
            gap[row] += a * R
            w.Jy[row, F.rows[k, 2 + c]] += R
            w.Jy[row, F.rows[k, 0]] += a * value(F, k, e, w.y, c, s, 1)
            for b in range(count):
                w.Jy[row, F.rows[k, 2 + dim + (node(F, k, e, cells) + b) * dim + c]] += a * share(
                    F, k, e, b, s, 0
                )
    return 0


@routine
def slopes(table: Any, record: Any) -> int:
    w = evaluation(table).space
    F = opened(record)
    place = F.pair
    for k in range(len(F.rows)):
        dim, count, _, cells = layout(F, k)
        q = w.multipliers[F.row[k]]
        s = w.y[F.rows[k, 0]]
        e = cell_of(F, k, s, cells)
        for c in range(dim):
            a = w.y[F.rows[k, 2 + c]]
            along = q * value(F, k, e, w.y, c, s, 1)
            w.H[place] += q * a * value(F, k, e, w.y, c, s, 2)
            w.H[place + 1 + 2 * c] += along
            w.H[place + 2 + 2 * c] += along
            for b in range(count):
                at = place + 1 + 2 * dim + 4 * ((node(F, k, e, cells) + b) * dim + c)
                steep, here = q * a * share(F, k, e, b, s, 1), q * share(F, k, e, b, s, 0)
                w.H[at] += steep
                w.H[at + 1] += steep
                w.H[at + 2] += here
                w.H[at + 3] += here
        place += 1 + 2 * dim + 4 * (F.rows.shape[1] - 2 - dim)
    return 0


@routine
def drift(table: Any, record: Any) -> int:
    w = evaluation(table).space
    F = opened(record)
    gap = w.rhs[0, len(w.rhs[0]) - len(w.multipliers) :]
    y = w.paths[0]
    z = w.paths[1]
    v = w.paths[2]
    a = w.paths[3]
    for k in range(len(F.rows)):
        dim, _, _, cells = layout(F, k)
        place = F.rows[k, 0]
        s = y[place]
        ds = v[place]
        dds = a[place]
        e = cell_of(F, k, s, cells)
        found = z[F.rows[k, 1]]
        for c in range(dim):
            r = F.rows[k, 2 + c]
            R0, R1, R2, R3 = (
                value(F, k, e, y, c, s, 0),
                value(F, k, e, y, c, s, 1),
                value(F, k, e, y, c, s, 2),
                value(F, k, e, y, c, s, 3),
            )
            V0, V1, V2 = (
                value(F, k, e, v, c, s, 0),
                value(F, k, e, v, c, s, 1),
                value(F, k, e, v, c, s, 2),
            )
            A0, A1 = value(F, k, e, a, c, s, 0), value(F, k, e, a, c, s, 1)
            speed, bend = R1 * ds + V0, R2 * ds * ds + 2.0 * V1 * ds
            third = R3 * ds**3 + 3.0 * (R2 * ds * dds + V2 * ds * ds + V1 * dds + A1 * ds)
            found += z[r] * R0 + y[r] * (R1 * z[place] + value(F, k, e, z, c, s, 0))
            found += w.leads[0] * (2.0 * v[r] * speed + y[r] * bend)
            found += w.leads[1] * (
                3.0 * a[r] * speed + 3.0 * v[r] * (bend + R1 * dds + A0) + y[r] * third
            )
        gap[F.row[k]] += found
    return 0


def law(name: str) -> ConstraintLaw:
    """The law `line|c|n|b|e` of c components and n functions, b on each of e cells.

    Rows s, p, a (c,) and Y (n c,) of (1), function by function; numbers as of `numbers_of`.
    """
    dim, functions, count, cells = map(int, name.split("|")[1:])
    pairs = [(0, 0), *(pair for c in range(dim) for pair in ((0, 2 + c), (2 + c, 0)))]
    for b in range(functions):
        for c in range(dim):
            one = 2 + dim + b * dim + c
            pairs += [(0, one), (one, 0), (2 + c, one), (one, 2 + c)]
    rows, numbers = 2 + dim + functions * dim, HEAD + 1 + cells * (2 + count**2)
    return ConstraintLaw(
        name,
        rows,
        numbers,
        0,
        tuple(pairs),
        ConstraintRoutines(constrain, slopes, drift),
        maker=law,
    )


def law_on(space: line.BSpline | line.Hermite, dim: int) -> ConstraintLaw:
    """The law of fields of `dim` components over a space."""
    nodes = line.functions(space)
    return law(f"{WORD}|{dim}|{space.count}|{nodes.shape[1]}|{len(nodes)}")


def numbers_of(
    space: line.BSpline | line.Hermite, length: float, dim: int, derivative: int
) -> np.ndarray:
    """Numbers of the law: head, ends of the cells in s, first functions, and polynomials C (e, b,
    j) of the functions of each cell.

    s is the parameter of the line from its start on, as a part of its `length` [m]; R is the
    derivative of this order by s.
    """
    nodes = line.functions(space)
    ends = line.breaks(space)
    cells, count = nodes.shape
    h = np.diff(ends)
    s = (ends - ends[0]) * (length / (ends[-1] - ends[0]))
    found = line.in_cells(space, np.arange(cells), ends[:-1], count - 1)
    powers = (
        found.transpose(0, 2, 1)
        * (h[:, None, None] ** np.arange(count))
        / [factorial(j) for j in range(count)]
    )
    return np.concatenate([[dim, count, derivative], s, nodes[:, 0], powers.ravel()])


ConstraintLaw.makers[WORD] = law


def end_of(numbers: np.ndarray) -> float:
    """s [m] at the end of the line with these numbers (p,)."""
    count = int(numbers[1])
    return float(numbers[HEAD + (len(numbers) - HEAD - 1) // (2 + count**2)])
