r"""Sides of NURBS patches that lie on one another without having the same functions: they move as
one line, weakly.

    int mu_i (r_a - r_b) ds = 0,    r_a = r_b,  dr_a/ds = dr_b/ds at both ends

mu_i are splines over the common part of both sides, with the knots and the degree of b, as many as
are left beside the ends; they reproduce constants and lines, so that a constant traction is passed
on exactly. Values and derivatives at the ends make edges that are held on both sides of a seam hold
nothing twice. E. Brivadis, A. Buffa, B. Wohlmuth, L. Wunderlich, Isogeometric mortar methods,
Comput. Methods Appl. Mech. Engrg. 284 (2015) 292-319, doi:10.1016/j.cma.2014.09.012.

Sides are compared as curves: other knots, weights and parametrisations, one side against two, and
parts of sides are all the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csr_array, diags_array, vstack

from ..core.algebra.linalg import distinct
from ..core.notices import notify, remark
from ..core.storage.records import dataclass
from . import line
from . import surface as surfaces
from .surface import Surface
from .table import Floats, Ints

CLOSE = 1e-5  #: of the extent: a gap that is closed. CAD programs sew within 1e-6 to 1e-5 of the size of a model
ROUND_OFF = 1e-9  #: of the extent: a gap that is none
NEAR = 1e-4  #: of the extent: a gap that is told of; slits are wider
SMOOTH = 1e-5  #: largest sum of outward unit normals at a seam; closing a gap of CLOSE may tilt them by a tenth of that
GRID = 16  #: points of a cell's side from which the nearest point is looked for
SHORT = 0.2  #: of a cell: a shorter piece at the end of a seam has no knot of its own
STEPS = 8  #: of Gauss and Newton, which double the digits
#: direction that a side keeps fixed, and its value there, by number of the side
FIXED = (
    (1, 0.0),
    (0, 1.0),
    (1, 1.0),
    (0, 0.0),
)


@dataclass(frozen=True, eq=False)
class Side:
    """A side of a patch as a curve over u in [0, m], a cell and the fraction of it, with the
    patch's parameter increasing.
    """

    shape: Surface
    name: str

    @property
    def cells(self) -> Ints:
        """(m,)."""
        return self.shape.edges[self.name][:, 0]

    @property
    def number(self) -> int:
        """The side of all cells."""
        return int(self.shape.edges[self.name][0, 1])

    def rows(self, u: Floats, derivative: bool = False) -> csr_array:
        """Rows (x, n) of the points u (x,), or of their derivatives in u."""
        axis, value = FIXED[self.number]
        cell = np.minimum(u.astype(np.int64), len(self.cells) - 1)
        xi = np.full((len(u), 2), value)
        xi[:, 1 - axis] = u - cell
        return surfaces.sample(self.shape, self.cells[cell], xi, 2 - axis if derivative else 0)

    def sides(self, u: Floats) -> tuple[Ints, Floats]:
        """Cells and sides (x, 2) of the points u (x,), and fractions (x,) along the sides."""
        cell = np.minimum(u.astype(np.int64), len(self.cells) - 1)
        return self.shape.edges[self.name][cell], u - cell if self.number < 2 else 1.0 - (u - cell)

    @cached_property
    def grid(self) -> Floats:
        """Points (x, c), evenly spread over u."""
        return np.asarray(
            self.rows(np.linspace(0.0, len(self.cells), GRID * len(self.cells) + 1))
            @ self.shape.reference
        )

    @cached_property
    def tree(self) -> Any:
        """The grid, for searches."""
        from scipy.spatial import cKDTree  # a tenth of the time of `fmbs check`

        return cKDTree(self.grid)

    def nearest(self, points: Floats) -> tuple[Floats, Floats]:
        """u (x,) of the points of the side nearest to points (x, c), and distances (x,)."""
        u = self.tree.query(points)[1] / GRID
        last = float(len(self.cells))
        for _ in range(STEPS):
            away = points - self.rows(u) @ self.shape.reference
            along = self.rows(u, True) @ self.shape.reference
            u = np.clip(
                u + np.einsum("xc,xc->x", away, along) / np.einsum("xc,xc->x", along, along),
                0.0,
                last,
            )
        return u, np.linalg.norm(points - self.rows(u) @ self.shape.reference, axis=1)

    def at_ends_of_cells(self, u: Floats, touch: float) -> Floats:
        """u (x,), those within `touch` [m] of an end of a cell moved onto it: corners within a gap
        are one.
        """
        away = np.linalg.norm(
            (self.rows(u) - self.rows(np.round(u))) @ self.shape.reference, axis=1
        )
        return np.where(away <= 2.0 * touch, np.round(u), u)


@dataclass(frozen=True, eq=False)
class Seam:
    """Pieces of two sides that lie on one another, within each of which both are in one cell."""

    a: Side
    b: Side  #: which has the multipliers
    cuts: Floats  #: (i, 2) ends of the pieces in u of a
    gap: float  #: largest distance [m]

    def points(self, order: int) -> tuple[Floats, Floats, Floats]:
        """Quadrature points: u of both sides and weights [m], (x,) each."""
        s, w = np.polynomial.legendre.leggauss(order)
        length = np.diff(self.cuts, axis=1)
        u = (self.cuts[:, :1] + length * (0.5 * (s + 1.0))).ravel()
        speed = np.linalg.norm(self.a.rows(u, True) @ self.a.shape.reference, axis=1)
        return (
            u,
            self.b.nearest(self.a.rows(u) @ self.a.shape.reference)[0],
            (0.5 * length * w).ravel() * speed,
        )

    @property
    def ends(self) -> tuple[Floats, Floats]:
        """u (2,) of the ends of the seam, on both sides."""
        u = np.array([self.cuts.min(), self.cuts.max()])
        v = self.b.nearest(self.a.rows(u) @ self.a.shape.reference)[0]
        return u, self.b.at_ends_of_cells(v, CLOSE * extent(self.b.shape))


def extent(shape: Surface) -> float:
    """Largest size of the box around a surface [m]."""
    return float(np.ptp(shape.reference, axis=0).max())


def find(
    shape: Surface, joined: Sequence[tuple[str, str]], sides: Sequence[str]
) -> tuple[tuple[str, str], ...]:
    """Pairs of sides that have a seam, beside those that are `joined`; warns of those that nearly
    do.
    """
    size = extent(shape)
    done = {name for pair in joined for name in pair}
    curves = [Side(shape, name) for name in sides]
    curves = [side for side in curves if np.ptp(side.grid, axis=0).max() > CLOSE * size]
    low, high = (np.array([f(side.grid, axis=0) for side in curves]) for f in (np.min, np.max))
    found: list[tuple[str, str]] = []
    for i, one in enumerate(curves):
        meet = np.all(
            (low[i] - NEAR * size <= high[i + 1 :]) & (low[i + 1 :] - NEAR * size <= high[i]),
            axis=1,
        )
        for j in i + 1 + np.flatnonzero(meet):
            other = curves[j]
            if not {one.name, other.name} <= done and (seam := between(one, other, size)):
                found.append((seam.a.name, seam.b.name))
                tell_closed((one.name, other.name), seam.gap, size)
    return tuple(found)


def tell_closed(pair: Sequence[str], gap: float, size: float) -> None:
    """A remark of a gap [m] between two sides that was closed, if it is more than round-off of a
    surface of that size [m].
    """
    if gap > ROUND_OFF * size:
        remark(
            f"the sides '{pair[0]}' and '{pair[1]}' of NURBS patches are {gap:.2g} m apart and were joined"
        )


def between(one: Side, other: Side, size: float) -> Seam | None:
    """The seam of two sides of a surface of that size [m], if there is one; b is the side of
    smaller cells that it covers.
    """
    seam, back = (_covered(a, b, size) for a, b in ((one, other), (other, one)))
    if seam is None or back is None:
        return None
    finer = [found.a for found in (seam, back) if _share(found) > 1.0 - 1e-6] or [seam.a, back.a]
    return seam if max(finer, key=lambda side: len(side.cells)) is seam.b else back


def _share(seam: Seam) -> float:
    """Part of side a that a seam covers."""
    return float(np.diff(seam.cuts, axis=1).sum()) / len(seam.a.cells)


def _covered(a: Side, b: Side, size: float) -> Seam | None:
    """The pieces of side a that lie on side b; None where there are none."""
    count = len(a.cells)
    touch = CLOSE * size
    inner = np.asarray((np.arange(4 * count) + 0.5) / 4.0, dtype=np.float64)
    distance = b.nearest(a.rows(inner) @ a.shape.reference)[1]
    if not (distance <= touch).any():
        if np.mean(distance <= NEAR * size) >= 0.5:
            text = f"the sides '{a.name}' and '{b.name}' of NURBS patches run {distance.min():.2g} m apart and are not joined"
            notify(f"{text}; close the gap, or say 'join: false' if it is meant")
        return None
    u, away = a.nearest(b.rows(np.arange(len(b.cells) + 1.0)) @ b.shape.reference)
    cuts = distinct(
        np.round(np.append(np.arange(count + 1.0), a.at_ends_of_cells(u[away <= touch], touch)), 9)
    )
    probes = cuts[:-1, None] + np.diff(cuts)[:, None] * np.array([0.1, 0.5, 0.9])
    distance = (
        b.nearest(a.rows(probes.ravel()) @ a.shape.reference)[1].reshape(probes.shape).max(axis=1)
    )
    on = distance <= touch
    return (
        Seam(a, b, np.stack([cuts[:-1], cuts[1:]], axis=1)[on], float(distance[on].max()))
        if on.any()
        else None
    )


def seams(shape: Surface) -> list[Seam]:
    """The seams of a surface."""
    found = [_covered(Side(shape, a), Side(shape, b), extent(shape)) for a, b in shape.space.seams]
    return [seam for seam in found if seam is not None]


def multipliers(seam: Seam, v: Floats) -> tuple[line.BSpline, Floats]:
    """Splines over the common part of both sides in u of b, with the knots and the degree of b; v
    (x,) moved into that part.
    """
    low, high = np.sort(seam.ends[1])
    inner = np.arange(np.floor(low) + 1.0, np.ceil(high))
    inner = inner[(inner > low + SHORT) & (inner < high - SHORT)]
    patch = seam.b.shape.space.patches[seam.b.name.rpartition(".")[0]]
    degree = patch.lines[1 - FIXED[seam.b.number][0]].degree
    knots = np.concatenate([np.full(degree + 1, low), inner, np.full(degree + 1, high)])
    return line.BSpline(degree, knots), np.clip(v, low, high)


def rows(seam: Seam) -> csr_array:
    """Rows (i, n) of coordinates that vanish where both sides are one line: see the head of the
    module.
    """
    u, v, w = seam.points(seam.a.shape.order + 1)
    spline, at = multipliers(seam, v)
    held = min(2, spline.count // 2)
    ends = seam.ends
    mu = _without_ends(line.sample(spline, at).toarray(), spline, held)
    moments = csr_array((w[:, None] * mu).T) @ (seam.a.rows(u) - seam.b.rows(v))
    found = [
        diags_array(1.0 / (np.abs(mu).T @ w)) @ moments,
        seam.a.rows(ends[0]) - seam.b.rows(ends[1]),
    ]
    if held > 1:
        slopes = [side.rows(end, True) for side, end in zip((seam.a, seam.b), ends, strict=True)]
        one, two = (slope @ seam.a.shape.reference for slope in slopes)
        speeds = (
            np.linalg.norm(one, axis=1),
            np.linalg.norm(two, axis=1) * np.sign(np.einsum("xc,xc->x", one, two)),
        )
        cell = w.sum() / len(seam.cuts)
        found.append(
            cell
            * (diags_array(1.0 / speeds[0]) @ slopes[0] - diags_array(1.0 / speeds[1]) @ slopes[1])
        )
    return csr_array(vstack(found))


def _without_ends(mu: Floats, spline: line.BSpline, held: int) -> Floats:
    """Values (x, i) of splines without `held` ones at either end, whose parts of constants and
    lines the next ones take over.
    """
    kept = mu[:, held : spline.count - held].copy()
    # coefficients of t
    at = np.array([spline.knots[k + 1 : k + 1 + spline.degree].mean() for k in range(spline.count)])
    for end, first, second in (
        (range(held), held, held + 1),
        (range(-held, 0), -held - 1, -held - 2),
    ):
        for k in end if kept.shape[1] else ():
            share = (at[k] - at[first]) / (at[second] - at[first]) if kept.shape[1] > 1 else 0.0
            kept[:, first - held if first > 0 else first + held] += (1.0 - share) * mu[:, k]
            if share:
                kept[:, second - held if second > 0 else second + held] += share * mu[:, k]
    return kept


def follow(control: Mapping[str, Floats], numbers: Mapping[str, Ints], reference: Floats) -> Floats:
    """Control points (n, c) with those beside a side that was moved moved alike, so that closing a
    gap tilts no slope.

    `control` (n1, n2, c) and `numbers` (n1, n2), -1 for none, by patch, are those before;
    `reference` (n, c) has the sides moved.
    """
    moved = reference.copy()
    least = ROUND_OFF * float(np.ptp(reference, axis=0).max())
    for name, own in numbers.items():
        change = np.where((own >= 0)[..., None], reference[own] - control[name], 0.0)
        apart = np.abs(change).max(axis=2) > least
        for turn in range(4):
            side, beside, by, stays = (
                np.rot90(array, turn) for array in (apart, own, change, ~apart & (own >= 0))
            )
            some = side[0] & stays[1]
            moved[beside[1, some]] += by[0, some]
    return moved
