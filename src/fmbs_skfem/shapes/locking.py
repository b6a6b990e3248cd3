r"""Quadrature of strains that smooth splines lock with, under the Gauss rule of their bending.

A cubic line that bends without stretching, r'.r' = 1, has two unknowns a cell (in the plane) where
it is C2, and at three Gauss points a cell three conditions to meet: it stiffens with EA h^2 / EI.
So do quartic C3 beams with directors, whose stretch, shear and section are held. Such strains are
therefore integrated with about as many points as their space S of C^(p-2) splines of degree p - 1
has functions, one in the middle of every cell, three in the first and the last,

    sum_i W_i N_b(x_i) = int N_b    for all N_b of S,        min sum_i (W_i - G_i)^2 / G_i

nearest to the Gauss weights G (h where a cell has one point; so is W between equal cells). All are
Gauss points of the bending, so that nothing new is evaluated. Beside cells of very different
lengths weights would be negative: there all three points stay. The part LIMIT EI / h^2 of EA, which
cannot lock, stays under the Gauss rule, so that a line of fine cells is integrated as ever, and
orders of convergence are those of full integration in the end.

C. Adam, S. Bouabdallah, M. Zarroug, H. Maitournam, Improved numerical integration for locking
treatment in isogeometric structural elements, Part I: Beams, Comput. Methods Appl. Mech. Engrg. 279
(2014) 1-28, doi:10.1016/j.cma.2014.06.023.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from . import line
from .table import BasisTable, Floats

LIMIT = 1e2  #: EA h^2 / EI up to which the Gauss rule does not lock: as much of EA keeps it
POINTS = 3  #: Gauss points a cell of the bending
#: of the length of its cell: weights below it bring back the points of the cells around
SMALL = 0.05


def locks(space: line.BSpline | line.Hermite) -> bool:
    """Whether a line is a C2 cubic B-spline without weights."""
    return line.is_smooth(space) and space.degree == 3


def axial_shares(space: line.BSpline | line.Hermite, table: BasisTable, ratio: float) -> Floats:
    """Factors (e, p) of EA at the Gauss points of a cable, for the largest ratio EA h^2 / EI of its
    cells; 1 without locking.
    """
    if not locks(space) or table.weights.shape[1] != POINTS:
        return np.ones_like(table.weights)
    assert isinstance(space, line.BSpline)
    return shares(space, table, ratio)


def shares(space: line.BSpline, table: BasisTable, ratio: float) -> Floats:
    """Factors (e, p) of stiffnesses that lock at the three Gauss points a cell of a table, for the
    largest ratio EA h^2 / EI.

        f + (1 - f) W / w,    f = min(1, LIMIT / ratio)

    with the weights w of the table and W of `reduced_weights`.
    """
    whole = min(1.0, LIMIT / ratio)
    if whole == 1.0:
        return np.ones_like(table.weights)
    return whole + (1.0 - whole) * reduced_weights(space, table) / table.weights


def reduced_weights(space: line.BSpline, table: BasisTable) -> Floats:
    """The weights W (e, p) in xi of smooth splines at their three Gauss points a cell."""
    length = table.weights.sum(axis=1, keepdims=True)
    whole = np.zeros(len(length), dtype=bool)
    whole[[0, -1]] = True
    found = _weights(space, table, whole)
    while (wrong := ((found != 0.0) & (found < SMALL * length)).any(axis=1)).any():
        # one cell more a round: it ends with the Gauss rule
        whole = np.convolve(whole | wrong, [True, True, True])[1:-1] > 0
        found = _weights(space, table, whole)
    return found


def _weights(space: line.BSpline, table: BasisTable, whole: np.ndarray) -> Floats:
    """W (e, p) with all points of the cells that are `whole`, and the middle one of the others."""
    gauss = np.where(whole[:, None], table.weights, 0.0)
    gauss[~whole, 1] = table.weights[~whole].sum(axis=1)
    used = gauss > 0.0
    strains = line.uniform(line.breaks(space), space.degree - 1, space.degree - 2)
    integrals = (strains.knots[space.degree :] - strains.knots[: -space.degree]) / space.degree
    rows = csc_array(line.sample(strains, table.points[used]))
    start = gauss[used]
    shares = splu(csc_array(rows.T @ diags_array(start) @ rows)).solve(integrals - rows.T @ start)
    gauss[used] = start + start * (rows @ shares)
    return gauss
