"""Conforming plates on free meshes: contract, slopes, patch tests, observed orders, circles, what
is refused.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import csr_array
from scipy.sparse.linalg import eigsh, spsolve
from scipy.spatial import Delaunay

from fmbs_skfem.bodies.body import scatter_blocks
from fmbs_skfem.bodies.plate import local_table, mass_matrix
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.shapes import ancf_plate, fvs_plate, surface
from fmbs_skfem.shapes.ancf_plate import Arc
from fmbs_skfem.shapes.surface import Parent, Surface
from fmbs_skfem.shapes.table import check_table

NU = 0.3
BENDING = np.array([[1.0, NU, 0.0], [NU, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - NU)]])  # D = 1
Mesh = tuple[np.ndarray, np.ndarray]


# ----------------------------------------------------------------------------------------------------------------- meshes
def triangles(n: int) -> Mesh:
    """A free mesh of triangles of the unit square: nodes at random but for the border."""
    side = np.linspace(0.0, 1.0, n + 1)
    border = np.concatenate(
        [np.column_stack([side, 0 * side]), np.column_stack([side, 1 + 0 * side])]
    )
    border = np.concatenate([border, border[:, ::-1]])
    rows, columns = np.indices((n - 1, n - 1)).reshape(2, -1) + 1
    inner = (
        np.column_stack([columns + 0.25 * (-1.0) ** rows, rows])
        + np.random.default_rng(5).uniform(-0.2, 0.2, (rows.size, 2))
    ) / n
    points = np.unique(np.concatenate([border, inner]), axis=0)
    cells = Delaunay(points).simplices.astype(np.int64)
    one, two = points[cells[:, 1]] - points[cells[:, 0]], points[cells[:, 2]] - points[cells[:, 0]]
    area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    cells = np.where(area[:, None] > 0.0, cells, cells[:, ::-1])
    return points, cells[np.abs(area) > 1e-9]


def divided(mesh: Mesh) -> Mesh:
    """Three quads of every triangle: a free mesh with three to eight cells at a node."""
    points, cells = mesh
    sides = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    pairs, number = np.unique(sides, axis=0, return_inverse=True)
    middle = len(points) + number.reshape(-1, 3)
    centre = np.broadcast_to(len(points) + len(pairs) + np.arange(len(cells))[:, None], cells.shape)
    quads = np.stack([cells, middle, centre, np.roll(middle, 1, axis=1)], axis=2).reshape(-1, 4)
    return np.concatenate([points, points[pairs].mean(axis=1), points[cells].mean(axis=1)]), quads


def shaken(n: int, by: float = 0.25) -> Mesh:
    """A grid of quads whose inner nodes are moved at random."""
    s = np.linspace(0.0, 1.0, n + 1)
    points = np.stack(np.meshgrid(s, s, indexing="ij"), axis=-1)
    points[1:-1, 1:-1] += by / n * np.random.default_rng(3).uniform(-1.0, 1.0, (n - 1, n - 1, 2))
    i = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    return points.reshape(-1, 2), np.stack(
        [i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]], axis=-1
    ).reshape(-1, 4)


def cut(mesh: Mesh) -> Mesh:
    points, cells = mesh
    return points, np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])


MESHES: dict[str, Callable[[int], Mesh]] = {
    "free triangles": triangles,
    "free quads": lambda n: divided(triangles(n // 2)),
    "distorted quads": shaken,
    "distorted triangles": lambda n: cut(shaken(n)),
}


@cache
def shape(kind: str, n: int) -> Surface:
    return fvs_plate.surface(*MESHES[kind](n))


# ------------------------------------------------------------------------------------------------- mechanics of the tests
def curvatures(
    space: Surface, order: int | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Points (e, p, 2), areas (e, p), N (e, p, b) and rows (e, p, 3, b) of w,11 w,22 2 w,12, also
    on cells with curved sides.
    """
    table = surface.tabulate(space, order)
    flat = np.pad(space.reference, ((0, 0), (0, 1)))[table.nodes]
    local, area, _ = local_table(table.values, table.weights, flat)
    places = np.einsum(
        "epkb,ebc->epkc", np.concatenate([table.values[:, :, :1], local], axis=2), flat
    )
    christoffel = np.einsum("epkc,epmc->epkm", places[:, :, 3:], places[:, :, 1:3])
    second = local[:, :, 2:] - christoffel @ local[:, :, :2]
    return (
        places[:, :, 0, :2],
        area,
        table.values[:, :, 0],
        second * np.array([1.0, 1.0, 2.0])[:, None],
    )


def stiffness(space: Surface) -> csr_array:
    _, area, _, B = curvatures(space)
    return scatter_blocks(
        np.einsum("ep,epib,ij,epjc->ebc", area, B, BENDING, B, optimize=True),
        space.nodes.astype(np.int32),
        space.count,
    )


def clamped(space: Surface) -> np.ndarray:
    """Functions (n,) of the nodes inside the unit square."""
    x = space.reference[::3]
    return np.repeat((np.abs(x - 0.5) < 0.5 - 1e-9).all(axis=1), 3)


def solved(space: Surface, load: np.ndarray, free: np.ndarray) -> np.ndarray:
    w = np.zeros(space.count)
    w[free] = spsolve(stiffness(space)[free][:, free].tocsc(), load[free])
    return w


def hump(x: np.ndarray) -> tuple[np.ndarray, ...]:
    """sin(pi x)^2 and its derivatives 1, 2, 4."""
    p = np.pi
    return (
        np.sin(p * x) ** 2,
        p * np.sin(2 * p * x),
        2 * p**2 * np.cos(2 * p * x),
        -8 * p**4 * np.cos(2 * p * x),
    )


@cache
def errors(kind: str, n: int) -> tuple[float, float, float]:
    """Errors of w = hump(x) hump(y) on the clamped square, rms over the largest rms: w, moments;
    and of the energy identity.
    """
    space = shape(kind, n)
    x, area, N, _ = curvatures(space, 7)
    (f, _, f2, f4), (g, _, g2, g4) = hump(x[..., 0]), hump(x[..., 1])
    force = area * (f4 * g + 2.0 * f2 * g2 + f * g4)
    load = np.bincount(
        space.nodes.ravel(), np.einsum("ep,epb->eb", force, N).ravel(), minlength=space.count
    )
    w = solved(space, load, clamped(space))
    off = np.sqrt(
        (area * (np.einsum("epb,eb->ep", N, w[space.nodes]) - f * g) ** 2).sum()
        / (area * (f * g) ** 2).sum()
    )
    x, area, _, B = curvatures(space, 7)
    (f, f1, f2, _), (g, g1, g2, _) = hump(x[..., 0]), hump(x[..., 1])
    exact = np.stack([f2 * g, f * g2, 2.0 * f1 * g1], axis=-1)
    found = np.einsum("epib,eb->epi", B, w[space.nodes])
    energy = [
        float(np.einsum("ep,epi,ij,epj->", area, k, BENDING, k)) for k in (found - exact, exact)
    ]
    # work of the load on the exact w less that on the one found
    deficit = energy[1] - float(load @ w)
    moment = [np.sqrt((area[..., None] * (k @ BENDING) ** 2).sum()) for k in (found - exact, exact)]
    return float(off), float(moment[0] / moment[1]), abs(energy[0] - deficit) / energy[1]


def slopes(space: Surface, sides: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Rows (x, 2, n) of the gradient in X, Y at fractions s (x,) of sides (x, 2)."""
    cell, side = sides.T
    values = surface.basis(space.space, cell, surface.side_points(space.parent, side, s))
    tangents = np.einsum("xkb,xbc->xkc", values[:, 1:3], space.reference[space.nodes[cell]])
    rows = np.zeros((len(cell), 2, space.count))
    np.add.at(
        rows,
        (np.arange(len(cell))[:, None], slice(None), space.nodes[cell]),
        np.linalg.solve(tangents, values[:, 1:3]).transpose(0, 2, 1),
    )
    return rows


# ------------------------------------------------------------------------------------------------------------------- tests
@pytest.mark.parametrize("kind", MESHES)
def test_contract(kind: str) -> None:
    check_table(shape(kind, 6))


@pytest.mark.parametrize("kind", MESHES)
def test_slopes_are_continuous(kind: str) -> None:
    space = shape(kind, 4)
    one, two, turned = surface.coincident_sides(space)
    assert len(one) >= 24
    for s in (0.1, 0.4, 0.75):
        here, there = (
            slopes(space, one, np.full(len(one), s)),
            slopes(space, two, np.where(turned, 1.0 - s, s)),
        )
        assert_allclose(here, there, rtol=0, atol=1e-11 * np.abs(here).max())


@pytest.mark.parametrize("parent", Parent)
def test_slopes_are_continuous_inside_of_a_cell(parent: Parent) -> None:
    """From both sides of the lines from the vertices to the centre, and the value of the normal
    slope along a side is linear.
    """
    corners = np.array([[0.0, 0.0], [2.0, 0.3], [1.6, 1.7], [-0.4, 0.9]])[: int(parent)]
    space = fvs_plate.surface(corners, np.arange(int(parent))[None]).space
    ends, centre = surface.VERTICES[parent], surface.VERTICES[parent].mean(axis=0)
    for vertex in range(int(parent)):
        for s in (0.0, 0.3, 0.8, 1.0):
            xi = (ends[vertex] + s * (centre - ends[vertex]))[None]
            z = fvs_plate.ordinates(space, np.array([0]))[0]
            sides = [vertex, (vertex - 1) % int(parent)]
            # derivatives in the parent jump with its triangles, those in X, Y do not
            found = []
            for t in sides:
                rows = (fvs_plate.bernstein(parent, np.array([t]), xi) @ z[t])[0]
                flat = np.zeros((3 * int(parent), 2))
                flat[::3], flat[1::3, 0], flat[2::3, 1] = corners, 1.0, 1.0
                found.append(np.vstack([rows[:1], np.linalg.solve(rows[1:3] @ flat, rows[1:3])]))
            assert_allclose(found[0], found[1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("kind", MESHES)
def test_constant_curvature_on_a_patch(kind: str) -> None:
    """w = x^2 + x y - 2 y^2 prescribed on the border of 70 nodes and more is found inside, moments
    too.
    """
    space = shape(kind, 10)
    assert space.count >= 3 * 70
    x, y = space.reference[::3].T
    exact = np.stack([x**2 + x * y - 2 * y**2, 2 * x + y, x - 4 * y], axis=1).ravel()
    K, free = stiffness(space), clamped(space)
    w = exact.copy()
    w[free] = spsolve(K[free][:, free].tocsc(), -(K[free] @ np.where(free, 0.0, exact)))
    assert_allclose(w, exact, rtol=0, atol=1e-10)
    k = np.einsum("epib,eb->epi", curvatures(space)[3], w[space.nodes])
    assert_allclose(k, np.broadcast_to([2.0, -4.0, 2.0], k.shape), rtol=0, atol=1e-9)


@pytest.mark.parametrize("kind", MESHES)
def test_orders_against_an_exact_field(kind: str) -> None:
    """w has order 2, moments order 1 (doi:10.1090/S0025-5718-1978-0482249-1); the error's energy is
    the deficit of the work.
    """
    (w, m, galerkin), (w2, m2, galerkin2) = errors(kind, 16), errors(kind, 32)
    size = math.sqrt(len(shape(kind, 32).nodes) / len(shape(kind, 16).nodes))
    assert math.log(w / w2, size) > 1.9
    assert math.log(m / m2, size) > 0.95
    assert w2 < 3.5e-3
    assert m2 < 0.06
    assert max(galerkin, galerkin2) < 1e-6


def test_moments_of_the_ancf_plate_do_not_converge_on_free_quads() -> None:
    """Why there is another element: twelve terms leave an error of the mesh's shape, whatever its
    size.
    """
    found = []
    for n in (16, 32):
        points, cells = MESHES["free quads"](n)
        space = ancf_plate.surface(points, cells)
        x, area, N, _ = curvatures(space, 6)
        (f, _, f2, f4), (g, _, g2, g4) = hump(x[..., 0]), hump(x[..., 1])
        load = np.einsum("ep,epb->eb", area * (f4 * g + 2.0 * f2 * g2 + f * g4), N)
        w = solved(
            space,
            np.bincount(space.nodes.ravel(), load.ravel(), minlength=space.count),
            clamped(space),
        )
        x, area, _, B = curvatures(space)
        (f, f1, f2, _), (g, g1, g2, _) = hump(x[..., 0]), hump(x[..., 1])
        exact = np.stack([f2 * g, f * g2, 2.0 * f1 * g1], axis=-1) @ BENDING
        off = np.einsum("epib,eb->epi", B, w[space.nodes]) @ BENDING - exact
        found.append(
            math.sqrt((area[..., None] * off**2).sum() / (area[..., None] * exact**2).sum())
        )
    assert min(found) > 0.1


@pytest.mark.parametrize("kind", MESHES)
def test_frequencies_of_the_free_square(kind: str) -> None:
    """A. W. Leissa, J. Sound Vib. 31 (1973) 257-293, doi:10.1016/S0022-460X(73)80371-2: order 2
    from above.
    """
    exact = np.array([13.4682, 19.5961, 24.2702, 34.8009, 34.8009])  # recomputed to six digits
    off = []
    for n in (16, 32):
        space = shape(kind, n)
        M = mass_matrix(space, space.reference, 1.0, 1.0)
        found = np.sqrt(
            np.sort(eigsh(stiffness(space), 8, M, sigma=-1.0, return_eigenvectors=False))[3:]
        )
        off.append(found / exact - 1.0)
    size = math.sqrt(len(shape(kind, 32).nodes) / len(shape(kind, 16).nodes))
    assert off[1].min() > 0.0
    assert off[1].max() < 2e-3
    assert (np.log(off[0] / off[1]) / math.log(size)).min() > 1.85


def ring(n: int, quads: bool) -> tuple[Surface, np.ndarray, np.ndarray]:
    """A ring of radii 0.25 and 1 on a free mesh with both circles; points and outer nodes (i,)."""
    h, random = 0.75 / n, np.random.default_rng(3)
    outer = np.exp(2j * np.pi * np.arange(around := round(2 * np.pi / h)) / around)
    inner = 0.25 * np.exp(2j * np.pi * np.arange(few := max(round(0.5 * np.pi / h), 6)) / few)
    i, j = np.indices((int(3 / h), int(3 / h))).reshape(2, -1) - int(1.5 / h)
    z = (
        (i + 0.5 * (j % 2)) * h
        + 1j * j * h * 0.866
        + 0.12 * h * (random.standard_normal(i.size) + 1j * random.standard_normal(i.size))
    )
    z = np.concatenate(
        [outer, inner, z[(np.abs(z) > 0.25 + 0.6 * h) & (np.abs(z) < 1.0 - 0.6 * h)]]
    )
    points = np.column_stack([z.real, z.imag])
    cells = Delaunay(points).simplices.astype(np.int64)
    one, two = points[cells[:, 1]] - points[cells[:, 0]], points[cells[:, 2]] - points[cells[:, 0]]
    cells = np.where(
        (one[:, 0] * two[:, 1] > one[:, 1] * two[:, 0])[:, None], cells, cells[:, ::-1]
    )
    cells = cells[
        ~(cells < around).all(axis=1) & ~((cells >= around) & (cells < around + few)).all(axis=1)
    ]
    if quads:
        points, cells = divided((points, cells))
    radius = np.hypot(*points.T)
    sides = np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2)
    keys = np.sort(sides, axis=1) @ [len(points), 1]
    border = sides[np.isin(keys, np.flatnonzero(np.bincount(keys) == 1))]
    arcs = []
    for r in (0.25, 1.0):
        rim = border[np.abs(radius[border].max(axis=1) - r) < 1e-9]
        points[np.unique(rim)] *= r / radius[np.unique(rim)][:, None]
        arcs.append(Arc(np.zeros(2), r, rim))
    return fvs_plate.surface(points, cells, arcs), points, np.unique(arcs[1].edges)


@pytest.mark.parametrize("quads", [False, True], ids=["triangles", "quads"])
def test_ring_with_curved_sides(quads: bool) -> None:
    """Supported outside, under a uniform load: w = r^4/64 + a + b r^2 + c log r + d r^2 log r."""
    rows = lambda r: np.array(  # noqa: E731
        [
            [1.0, r**2, np.log(r), r**2 * np.log(r), r**4 / 64],
            [0.0, 2 * r, 1 / r, 2 * r * np.log(r) + r, r**3 / 16],
            [0.0, 2.0, -1 / r**2, 2 * np.log(r) + 3.0, 3 * r**2 / 16],
            [0.0, 0.0, 2 / r**3, 2 / r, 3 * r / 8],
        ]
    )
    moment, shear = np.array([0.0, NU, 1.0, 0.0]), lambda r: np.array([0.0, -1 / r**2, 1 / r, 1.0])
    a, b = 0.25, 1.0
    system = np.stack(
        [
            rows(b)[0],
            (moment / [1, b, 1, 1]) @ rows(b),
            (moment / [1, a, 1, 1]) @ rows(a),
            shear(a) @ rows(a),
        ]
    )
    exact = np.append(np.linalg.solve(system[:, :4], -system[:, 4]), 1.0) @ rows(a)[0]
    off = []
    for n in (4, 8):
        space, points, rim = ring(n, quads)
        check_table(space)
        _, area, N, _ = curvatures(space, 6)
        load = np.bincount(
            space.nodes.ravel(), np.einsum("ep,epb->eb", area, N).ravel(), minlength=space.count
        )
        radial = points[rim] / np.hypot(*points[rim].T)[:, None]
        T = np.eye(space.count)  # at the rim: w, slope along the radius, slope along the circle
        T[3 * rim + 1, 3 * rim + 1], T[3 * rim + 2, 3 * rim + 1] = radial.T
        T[3 * rim + 1, 3 * rim + 2], T[3 * rim + 2, 3 * rim + 2] = -radial[:, 1], radial[:, 0]
        T = csr_array(np.delete(T, np.concatenate([3 * rim, 3 * rim + 2]), axis=1))
        w = T @ spsolve((T.T @ stiffness(space) @ T).tocsc(), T.T @ load)
        hole = np.flatnonzero(np.abs(np.hypot(*points.T) - a) < 1e-6)
        off.append(abs(np.mean(w[3 * hole]) / exact - 1.0))
    assert off[1] < 0.012
    assert off[1] < 0.3 * off[0]


def test_rules_are_exact() -> None:
    """Every rule integrates polynomials of the degree that it promises over both parents."""
    for parent in Parent:
        space = shape("free triangles" if parent is Parent.TRIANGLE else "free quads", 4).space
        for order in range(1, 10):
            xi, w = surface.quadrature(space, parent, order)
            assert w.min() > 0.0
            for i in range(order):
                for j in range(order - i):
                    exact = (
                        1 / ((i + 1) * (j + 1))
                        if parent is Parent.SQUARE
                        else math.factorial(i) * math.factorial(j) / math.factorial(i + j + 2)
                    )
                    assert_allclose(w @ (xi[:, 0] ** i * xi[:, 1] ** j), exact, rtol=1e-13)


def test_origin_size_and_numbering_are_no_matter() -> None:
    points, cells = MESHES["free quads"](6)
    xi = np.array([[0.3, 0.6], [0.9, 0.4], [0.5, 0.5]])
    here = surface.basis_in_cells(fvs_plate.surface(points, cells).space, np.arange(5), xi)
    far = surface.basis_in_cells(
        fvs_plate.surface(1e3 * points + 1e6, cells).space, np.arange(5), xi
    )
    scale = np.tile([1.0, 1e3, 1e3], 4)
    assert_allclose(far / scale, here, rtol=0, atol=1e-8)
    turned = surface.basis_in_cells(
        fvs_plate.surface(points, np.roll(cells, -1, axis=1)).space, np.arange(5), xi[2:]
    )
    assert_allclose(np.roll(turned, 3, axis=3)[:, :, 0], here[:, 2:, 0], rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    "points,cells,message",
    [
        ([[0, 0], [1, 0], [0.2, 0.2], [0, 1]], [[0, 1, 2, 3]], "angles below 180 degrees"),
        ([[0, 0], [1, 1], [1, 0], [0, 1]], [[0, 1, 2, 3]], "sides do not cross"),
        ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2], [0, 1, 1]], "sides longer than zero"),
        ([[0, 0], [1, 0], [0, 1]], [[0, 1]], "shape"),
    ],
)
def test_refused(points: list[list[float]], cells: list[list[int]], message: str) -> None:
    with pytest.raises(InputError, match=message):
        fvs_plate.surface(np.array(points, dtype=float), np.array(cells))
