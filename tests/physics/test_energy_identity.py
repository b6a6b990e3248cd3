"""Galerkin's identity: the energy of the error is what the work of the loads lacks, on meshes of
every kind of plate.

    a(w - v, w - v) = f(w) - f(v),    v of the mesh, w = sin(pi x) sin(pi y) of the hinged unit square, f = 4 pi^4 D w

It holds where functions and slopes are continuous and the edges are held; the twelve-term plate,
whose slopes jump, and seams of patches, with springs against folding, miss it by a part of the
work. G. Strang, G. Fix, An Analysis of the Finite Element Method (1973), theorem 1.1. That of `fvs`
on clamped squares of all meshes is in `tests/shapes/test_fvs_plate.py`.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.linalg import spsolve

from fmbs_skfem.bodies import patches
from fmbs_skfem.bodies.plate import trace
from fmbs_skfem.core.algebra import ranks
from fmbs_skfem.shapes import (
    ancf_plate,
    fvs_plate,
    interfaces,
    nurbs,
    skfem_surface,
    smoothing,
    surface,
)
from fmbs_skfem.shapes.surface import Surface

from ..bodies.test_weak_seams import UNIT_SQUARES, shape_of
from ..shapes.test_fvs_plate import MESHES, curvatures, cut, shaken

NU, ORDER = 0.3, 8
D = np.array([[1.0, NU, 0.0], [NU, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - NU)]])


def flat(name: str) -> Surface:
    shape = shape_of(
        {key: (patch, control[..., :2]) for key, (patch, control) in UNIT_SQUARES[name].items()}
    )
    return smoothing.tie_slopes(shape)


WORK = np.pi**4  #: f(w)
CONFORMING = {
    "bfs": lambda: skfem_surface.bfs(*shaken(6, 0.0)),
    "argyris": lambda: skfem_surface.argyris(*cut(shaken(4))),
    "nurbs": lambda: nurbs.surface(*nurbs.rectangle(1.0, 1.0, 6, 6, origin=(0.0, 0.0))),
    "nurbs 2": lambda: nurbs.surface(*nurbs.rectangle(1.0, 1.0, 6, 6, 2, origin=(0.0, 0.0))),
    "fvs free quads": lambda: fvs_plate.surface(*MESHES["free quads"](8)),
    "fvs triangles": lambda: fvs_plate.surface(*MESHES["free triangles"](8)),
}
OTHERS = {  # with the part of the work by which they miss the identity: that of the twelve-term plate falls by order 2
    "ancf grid, 8": (lambda: ancf_plate.surface(*shaken(8, 0.0)), 0.018),
    "ancf grid, 16": (lambda: ancf_plate.surface(*shaken(16, 0.0)), 0.0045),
    "seam, other knots": (lambda: flat("other knots"), 1.5e-4),
    "seam, one against two": (lambda: flat("one against two"), 2e-4),
    "seam, halves of edges": (lambda: flat("halves of edges"), 2e-4),
}


def identity(shape: Surface) -> tuple[float, float]:
    """Energy of the error, and the deficit of the work."""
    x, area, N, rows = curvatures(shape, ORDER)
    s, c = np.sin(np.pi * x), np.cos(np.pi * x)
    w = s[..., 0] * s[..., 1]
    exact = np.pi**2 * np.stack([-w, -w, 2.0 * c[..., 0] * c[..., 1]], axis=-1)
    load = 4.0 * np.pi**4 * w

    def summed(parts: np.ndarray) -> np.ndarray:
        found = np.zeros(shape.count)
        np.add.at(found, shape.nodes, parts)
        return found

    blocks = np.einsum("ep,epib,ij,epjd->ebd", area, rows, D, rows)
    at = (
        np.broadcast_to(shape.nodes[:, :, None], blocks.shape),
        np.broadcast_to(shape.nodes[:, None, :], blocks.shape),
    )
    K = csr_array(
        (blocks.ravel(), (at[0].ravel(), at[1].ravel())), shape=(shape.count, shape.count)
    )
    f = summed(np.einsum("ep,ep,epb->eb", area, load, N))
    S = csr_array(np.eye(shape.count))
    if isinstance(shape.space, nurbs.Nurbs) and shape.space.seams:
        S = patches.tie(shape)[1]
        K = K + interfaces.penalty_stiffness(shape, interfaces.common_edges(shape), 1.0)
    A = csr_array(
        trace(shape, surface.free_sides(shape) if S.nnz == shape.count else outer(shape)) @ S
    )
    first, second, X = ranks.determined(A)
    T = np.eye(shape.count)
    T[first] = 0.0
    T[np.ix_(first, second)] = -X
    T = csr_array(S @ T[:, np.setdiff1d(np.flatnonzero(S.diagonal()), first)])
    q = T @ spsolve((T.T @ K @ T).tocsc(), T.T @ f)
    away = exact - np.einsum("epib,eb->epi", rows, q[shape.nodes])
    error = float(np.einsum("ep,epi,ij,epj->", area, away, D, away))
    return error, float(np.sum(area * load * w) - f @ q)


def outer(shape: Surface) -> np.ndarray:
    """Sides on the border of the unit square."""
    sides = np.indices((len(shape.nodes), int(shape.parent))).reshape(2, -1).T
    middle = surface.sample(
        shape, sides[:, 0], surface.side_points(shape.parent, sides[:, 1], np.full(len(sides), 0.5))
    )
    return sides[np.abs(middle @ shape.reference - 0.5).max(axis=1) > 0.499]


@pytest.mark.parametrize("kind", CONFORMING)
def test_energy_of_the_error_is_the_deficit_of_the_work(kind: str) -> None:
    error, deficit = identity(CONFORMING[kind]())
    assert 1e-6 < error / WORK < 0.02
    assert deficit == pytest.approx(error, rel=1e-6)


@pytest.mark.parametrize("kind", OTHERS)
def test_others_miss_it_by_a_part_of_the_work(kind: str) -> None:
    make, most = OTHERS[kind]
    error, deficit = identity(make())
    assert abs(error - deficit) < most * WORK
