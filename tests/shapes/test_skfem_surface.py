"""Bogner-Fox-Schmit and Argyris: the contract, C1 continuity, polynomials, convergence, plate
frequencies, and what is refused.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import skfem
from numpy.polynomial import polynomial
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import eigh
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.shapes import plate_audit, skfem_surface, surface
from fmbs_skfem.shapes.surface import Parent, Surface
from fmbs_skfem.shapes.table import check_table

from .. import pages

NU = 0.3
DEGREE = {Parent.SQUARE: 3, Parent.TRIANGLE: 5}


# ----------------------------------------------------------------------------------------------------------------- meshes
def grid(nx: int, ny: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and anticlockwise cells of the unit square."""
    x, y = np.meshgrid(np.linspace(0.0, 1.0, nx + 1), np.linspace(0.0, 1.0, ny + 1), indexing="ij")
    i = np.arange(nx)[:, None] * (ny + 1) + np.arange(ny)
    return np.column_stack([x.ravel(), y.ravel()]), np.stack(
        [i, i + ny + 1, i + ny + 2, i + 1], axis=-1
    ).reshape(-1, 4)


def halves(nx: int, ny: int) -> tuple[np.ndarray, np.ndarray]:
    points, quads = grid(nx, ny)
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def scrambled(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same mesh with other node numbers, another order of cells and another first vertex in
    each.
    """
    random = np.random.default_rng(11)
    new = random.permutation(len(points))
    places = np.empty_like(points)
    places[new] = points
    start = random.integers(0, cells.shape[1], len(cells))[:, None]
    turned = np.take_along_axis(
        new[cells], (start + np.arange(cells.shape[1])) % cells.shape[1], axis=1
    )
    return places, random.permutation(turned)


def shaken(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Irregular triangles of the unit square."""
    points, cells = halves(n, n)
    inside = ((points > 0.0) & (points < 1.0)).all(axis=1)
    points[inside] += np.random.default_rng(5).uniform(-0.2, 0.2, (inside.sum(), 2)) / n
    return scrambled(points, cells)


def graded(nx: int, ny: int) -> tuple[np.ndarray, np.ndarray]:
    """Rectangles of different sizes, 2 m by 0.5 m."""
    points, cells = grid(nx, ny)
    return scrambled(points**1.5 * [2.0, 0.5], cells)


def turned(degrees: float, points: np.ndarray) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return points @ np.array([[c, s], [-s, c]])


def bfs_turned(degrees: float) -> Surface:
    points, cells = graded(5, 4)
    return skfem_surface.bfs(turned(degrees, points), cells)


FAR = np.array([1024.0, -4096.0])  # [m], exact together with the coordinates of the grids below
SURFACES: dict[str, Callable[[], Surface]] = {
    "bfs": lambda: skfem_surface.bfs(*grid(3, 2)),
    "bfs, graded": lambda: skfem_surface.bfs(*graded(5, 4)),
    "bfs, turned by 30 degrees": lambda: bfs_turned(30.0),
    "bfs, 64 x 64": lambda: skfem_surface.bfs(*grid(64, 64)),
    "bfs, far away": lambda: skfem_surface.bfs(grid(8, 4)[0] + FAR, grid(8, 4)[1]),
    "bfs, slender": lambda: skfem_surface.bfs(grid(3, 3)[0] * [1.0, 1e-4], grid(3, 3)[1]),
    "argyris": lambda: skfem_surface.argyris(*halves(3, 2)),
    "argyris, irregular": lambda: skfem_surface.argyris(*shaken(5)),
    "argyris, 64 x 64": lambda: skfem_surface.argyris(*halves(64, 64)),
    "argyris, far away": lambda: skfem_surface.argyris(halves(8, 4)[0] + FAR, halves(8, 4)[1]),
    "argyris, slender": lambda: skfem_surface.argyris(
        halves(3, 3)[0] * [1.0, 1e-2], halves(3, 3)[1]
    ),
}


# ------------------------------------------------------------------------------------------------------ tools of the tests
def vertices(space: Surface) -> np.ndarray:
    """Places (e, v, 2) of the vertices of the cells."""
    nodal = 4 if space.parent is Parent.SQUARE else 6
    return space.reference[space.nodes[:, : nodal * int(space.parent) : nodal]]


def gradients(space: Surface, cell: np.ndarray, xi: np.ndarray) -> tuple[np.ndarray, ...]:
    """N (x, b), dN/dX (x, 2, b), d2N/dX2 (x, 2, 2, b) and det J (x,); J from the vertices, exact
    far from the origin too.
    """
    values = surface.basis(space.space, cell, xi)
    corners = vertices(space)[cell]
    jacobian = (corners[:, [1, -1]] - corners[:, :1]).transpose(0, 2, 1)
    inverse = np.linalg.inv(jacobian)
    second = values[:, [3, 5, 5, 4]].reshape(len(xi), 2, 2, -1)
    return (
        values[:, 0],
        np.einsum("xkb,xkc->xcb", values[:, 1:3], inverse),
        np.einsum("xklb,xkc,xld->xcdb", second, inverse, inverse),
        np.linalg.det(jacobian),
    )


def at_gauss(space: Surface, order: int) -> tuple[np.ndarray, ...]:
    """`gradients` and area weights at all quadrature points, (e, p, ...)."""
    table = surface.tabulate(space, order)
    e, p = table.weights.shape
    *parts, det = gradients(space, np.repeat(np.arange(e), p), table.points.reshape(-1, 2))
    return *(part.reshape(e, p, *part.shape[1:]) for part in parts), table.weights * det.reshape(
        e, p
    )


def assembled(space: Surface, matrices: np.ndarray) -> coo_array:
    rows = np.broadcast_to(space.nodes[:, :, None], matrices.shape)
    entries = (matrices.ravel(), (rows.ravel(), rows.transpose(0, 2, 1).ravel()))
    return coo_array(entries, shape=(space.count, space.count)).tocsc()


def mass(space: Surface, order: int) -> coo_array:
    values, _, _, weights = at_gauss(space, order)
    return assembled(space, np.einsum("epb,epc,ep->ebc", values, values, weights, optimize=True))


def coefficients(space: Surface, field: Callable[..., np.ndarray]) -> np.ndarray:
    """Coordinates of a field(X, Y, i, j) -> d^(i+j)/dX^i dY^j, from the documented meaning of every
    coordinate.
    """
    nodal = 4 if space.parent is Parent.SQUARE else 6
    orders = (
        [(0, 0), (1, 0), (0, 1), (1, 1)]
        if nodal == 4
        else [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]
    )
    result = np.empty(space.count)
    sides = int(space.parent)
    for vertex in range(sides):
        nodes = space.nodes[:, nodal * vertex : nodal * (vertex + 1)]
        place = space.reference[nodes[:, 0]].T
        for k, (i, j) in enumerate(orders):
            result[nodes[:, k]] = field(*place, i, j) * (space.space.length if i + j == 2 else 1.0)
    corners = vertices(space)
    for side in range(space.nodes.shape[1] - nodal * sides):
        middle = 0.5 * (corners[:, side] + corners[:, (side + 1) % 3]).T
        normal = space.reference[space.nodes[:, nodal * sides + side]]
        result[space.nodes[:, nodal * sides + side]] = (
            field(*middle, 1, 0) * normal[:, 0] + field(*middle, 0, 1) * normal[:, 1]
        )
    return result


def polynomial_field(parent: Parent) -> Callable[..., np.ndarray]:
    n = DEGREE[parent] + 1
    factors = np.random.default_rng(2).uniform(-1.0, 1.0, (n, n))
    if parent is Parent.TRIANGLE:
        factors[np.add.outer(np.arange(n), np.arange(n)) >= n] = 0.0

    def field(x: np.ndarray, y: np.ndarray, i: int, j: int) -> np.ndarray:
        return polynomial.polyval2d(
            x, y, polynomial.polyder(polynomial.polyder(factors, i, axis=0), j, axis=1)
        )

    return field


def wave(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.sin(3.0 * x + 1.0) * np.cos(2.0 * y - x)


#: error of a basis that is the inverse of a matrix, times coordinates far from the origin
BASIS = 100 * np.finfo(float).eps


# ------------------------------------------------------------------------------------------------------------------ tests
@pytest.mark.parametrize("name", [name for name in SURFACES if "64" not in name])
def test_contract(name: str) -> None:
    check_table(SURFACES[name]())


@pytest.mark.parametrize("name", SURFACES)
def test_slopes_are_continuous(name: str) -> None:
    """Value and gradient from both cells at random points of all interior edges; random
    coordinates, gradients relative to 1/h.
    """
    space = SURFACES[name]()
    sides = int(space.parent)
    nodal = 4 if sides == 4 else 6
    cells = space.nodes[:, : nodal * sides : nodal]
    keys = plate_audit.side_keys(plate_audit.sides(cells), space.count).ravel()
    order = np.argsort(keys, kind="stable")
    pair = (
        order[:-1][keys[order][1:] == keys[order][:-1]],
        order[1:][keys[order][1:] == keys[order][:-1]],
    )
    assert len(pair[0]) == keys.size - len(np.unique(keys)) > 0
    random = np.random.default_rng(1)
    s, c = random.uniform(0.0, 1.0, len(pair[0])), random.uniform(-1.0, 1.0, space.count)
    results = []
    for sided, fraction in zip(pair, (s, 1.0 - s), strict=True):
        cell, side = np.divmod(sided, sides)
        value, gradient, _, _ = gradients(
            space, cell, surface.side_points(space.parent, side, fraction)
        )
        place = np.einsum("xb,xbc->xc", value, space.reference[space.nodes[cell]])
        size = np.einsum("xb,xbc->xc", np.abs(value), np.abs(space.reference[space.nodes[cell]]))
        results.append(
            (
                place,
                np.einsum("xb,xb->x", value, c[space.nodes[cell]]),
                np.einsum("xcb,xb->xc", gradient, c[space.nodes[cell]]),
            )
        )
    (place, value, gradient), (place_2, value_2, gradient_2) = results
    assert (np.abs(place - place_2) <= 1e-12 + BASIS * size).all()
    assert_allclose(value, value_2, rtol=0.0, atol=1e-12)
    assert_allclose(gradient, gradient_2, rtol=0.0, atol=1e-12 * np.abs(gradient).max())


@pytest.mark.parametrize("name", ["bfs, graded", "argyris", "argyris, irregular"])
def test_polynomials_are_reproduced(name: str) -> None:
    """Bicubic and quintic ones with all derivatives; other vertices than the first come from the
    coordinates of neighbours too.
    """
    space = SURFACES[name]()
    field = polynomial_field(space.parent)
    random = np.random.default_rng(4)
    cell = random.integers(0, len(space.nodes), 200)
    xi = random.uniform(-0.1, 1.1, (200, 2))
    c = coefficients(space, field)[space.nodes[cell]]
    value, gradient, hessian, _ = gradients(space, cell, xi)
    x, y = np.einsum("xb,xbc->cx", value, space.reference[space.nodes[cell]])
    assert_allclose(np.einsum("xb,xb->x", value, c), field(x, y, 0, 0), rtol=0.0, atol=1e-12)
    assert_allclose(
        np.einsum("xcb,xb->cx", gradient, c),
        [field(x, y, 1, 0), field(x, y, 0, 1)],
        rtol=0.0,
        atol=1e-10,
    )
    exact = [[field(x, y, 2, 0), field(x, y, 1, 1)], [field(x, y, 1, 1), field(x, y, 0, 2)]]
    assert_allclose(np.einsum("xcdb,xb->cdx", hessian, c), exact, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("degrees", [-45.0, -30.0, 0.0, 30.0, 100.0])
def test_rectangles_may_be_turned(degrees: float) -> None:
    """r_x and r_y of the reference are unit vectors along the sides, at most 45 degrees away from
    the global axes.
    """
    points, cells = graded(3, 2)
    space = skfem_surface.bfs(turned(degrees, points), cells)
    check_table(space)
    axes = space.reference[space.nodes[0, 1:3]]
    assert_allclose(axes @ axes.T, np.eye(2), atol=1e-15)
    assert axes[0, 0] >= np.cos(np.radians(45.0)) - 1e-15
    assert_allclose(np.sort(np.abs(turned(-degrees, axes)), axis=1), [[0.0, 1.0]] * 2, atol=1e-14)


def test_functions_are_those_of_scikit_fem() -> None:
    """On a mesh near the origin scikit-fem's own tabulation gives the same functions, up to length
    and the sense of r_n.
    """
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [2.0, 0.0], [2.0, 1.0]])
    quads, triangles = np.array([[0, 1, 2, 3], [1, 4, 5, 2]]), np.array([[0, 1, 2], [0, 2, 3]])
    xi = np.random.default_rng(6).uniform(0.05, 0.45, (5, 2))
    for mesh, element, make in (
        (skfem.MeshQuad(points.T, quads.T), skfem.ElementQuadBFS(), skfem_surface.bfs),
        (
            skfem.MeshTri(points[:4].T, triangles.T),
            skfem.ElementTriArgyris(),
            skfem_surface.argyris,
        ),
    ):
        space = make(mesh.p.T, mesh.t.T)
        cells = np.repeat(np.arange(len(space.nodes)), len(xi))
        values = surface.basis(space.space, cells, np.tile(xi, (len(space.nodes), 1)))[:, 0]
        nodal, sides = element.dofnames[: element.nodal_dofs], len(mesh.t)
        for b, name in enumerate([*nodal * sides, *element.dofnames[len(nodal) :] * sides]):
            exact = np.asarray(element.gbasis(mesh.mapping(), xi.T, b)[0])
            ours = values[:, b].reshape(exact.shape) * (
                space.space.length if len(name) == 4 else 1.0
            )
            sign = np.sign(np.sum(ours * exact, axis=1, keepdims=True)) if name == "u_n" else 1.0
            assert_allclose(sign * ours, exact, rtol=0.0, atol=1e-12)


def test_meshes_do_not_disturb_each_other() -> None:
    """scikit-fem's elements keep the matrix of their first mesh; a surface made before or after
    another is the same.
    """
    for make, first, second in (
        (skfem_surface.bfs, grid(2, 2), graded(3, 4)),
        (skfem_surface.argyris, halves(2, 2), shaken(4)),
    ):
        alone = make(*second)
        make(*first)
        after = make(*second)
        assert_array_equal(alone.space.coefficients, after.space.coefficients)
        field = polynomial_field(after.parent)
        cell = np.arange(len(after.nodes))
        value = gradients(after, cell, np.full((len(cell), 2), 0.3))[0]
        x, y = np.einsum("xb,xbc->cx", value, after.reference[after.nodes])
        assert_allclose(
            np.einsum("xb,xb->x", value, coefficients(after, field)[after.nodes]),
            field(x, y, 0, 0),
            atol=1e-12,
        )


@pytest.mark.parametrize(
    ("make", "mesh", "sizes", "order"),
    [(skfem_surface.bfs, grid, (8, 16, 32), 4.0), (skfem_surface.argyris, halves, (2, 4, 8), 6.0)],
)
def test_projection_converges(
    make: Callable[..., Surface],
    mesh: Callable[..., tuple[np.ndarray, np.ndarray]],
    sizes: tuple[int, ...],
    order: float,
) -> None:
    """L2 projection of a smooth function: error O(h^(k+1)) for degree k = 3 and 5 (Ciarlet,
    doi:10.1137/1.9780898719208).
    """
    errors = []
    for n in sizes:
        space = make(*mesh(n, n))
        value, _, _, weights = at_gauss(space, 7)
        exact = wave(*np.einsum("epb,ebc->cep", value, space.reference[space.nodes]))
        load = np.bincount(
            space.nodes.ravel(), np.einsum("epb,ep,ep->eb", value, exact, weights).ravel()
        )
        c = spsolve(mass(space, 7), load)
        errors.append(
            np.sqrt(np.sum(weights * (np.einsum("epb,eb->ep", value, c[space.nodes]) - exact) ** 2))
        )
    observed = np.log2(np.divide(errors[:-1], errors[1:]))
    assert observed[-1] == pytest.approx(order, abs=0.1)


# omega a^2 sqrt(rho t / D), nu = 0.3: Ritz upper bounds converged to 1e-6; the first three are
# published as 1.364614, 1.985504 and 2.459086 pi^2 (ASME DETC2007-34754,
# doi:10.1115/DETC2007-34754) and lie up to 1 % below the upper bounds of A. W. Leissa, J. Sound
# Vib. 31 (1973) 257-293, doi:10.1016/S0022-460X(73)80371-2
FREE_SQUARE = np.array([13.468197, 19.596137, 24.270201, 34.800889, 34.800891, 61.093234])


def free_plate(space: Surface, order: int) -> np.ndarray:
    """omega a^2 sqrt(rho t / D) of the free Kirchhoff plate: K = int B^T [[1, nu, 0], [nu, 1, 0],
    [0, 0, (1 - nu) / 2]] B dA.
    """
    _, _, hessian, weights = at_gauss(space, order)
    B = np.stack([hessian[:, :, 0, 0], hessian[:, :, 1, 1], 2.0 * hessian[:, :, 0, 1]], axis=2)
    law = np.array([[1.0, NU, 0.0], [NU, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - NU)]])
    stiffness = assembled(
        space, np.einsum("epib,ij,epjc,ep->ebc", B, law, B, weights, optimize=True)
    )
    return np.sqrt(
        np.abs(
            eigh(stiffness.toarray(), mass(space, space.order + 1).toarray(), eigvals_only=True)[:9]
        )
    )


@pytest.mark.parametrize(
    ("space", "error"),
    [(skfem_surface.argyris(*halves(4, 4)), 2.5e-5), (skfem_surface.bfs(*grid(8, 8)), 6.5e-4)],
    ids=["argyris 4 x 4", "bfs 8 x 8"],
)
def test_free_square_plate(space: Surface, error: float) -> None:
    found = free_plate(space, space.order)
    assert found[:3].max() < 1e-3
    assert_allclose(found[3:], FREE_SQUARE, rtol=error)
    assert (found[3:] > FREE_SQUARE * (1.0 - 1e-7)).all()
    assert_allclose(free_plate(space, 4)[3:], found[3:], rtol=1e-9)


def membrane_stiffness(space: Surface, order: int) -> np.ndarray:
    """K = int B^T [[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]] B dA with the strains u,x, v,y,
    u,y + v,x.
    """
    _, gradient, _, weights = at_gauss(space, order)
    e, p, _, b = gradient.shape
    B = np.zeros((e, p, 3, b, 2))
    B[:, :, 0, :, 0], B[:, :, 1, :, 1] = gradient[:, :, 0], gradient[:, :, 1]
    B[:, :, 2, :, 0], B[:, :, 2, :, 1] = gradient[:, :, 1], gradient[:, :, 0]
    B = B.reshape(e, p, 3, 2 * b)
    law = np.array([[1.0, NU, 0.0], [NU, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - NU)]])
    return np.einsum("epib,ij,epjc,ep->ebc", B, law, B, weights, optimize=True)


@pytest.mark.parametrize(
    "space",
    [skfem_surface.bfs(*grid(1, 1)), skfem_surface.argyris(*shaken(2))],
    ids=["bfs", "argyris"],
)
def test_quadrature_is_exact_for_the_linear_membrane(space: Surface) -> None:
    """`order` points give the energy of twice as many, one point less does not; only the three
    rigid motions cost nothing.
    """
    exact = membrane_stiffness(space, 2 * space.order)
    size = np.abs(exact).max()
    assert_allclose(membrane_stiffness(space, space.order), exact, rtol=0.0, atol=1e-13 * size)
    assert np.abs(membrane_stiffness(space, space.order - 1) - exact).max() > 1e-4 * size
    scale = 1.0 / np.sqrt(np.diagonal(exact, axis1=1, axis2=2))
    values = np.linalg.eigvalsh(exact * scale[:, :, None] * scale[:, None, :])
    assert_array_equal((values > 1e-9).sum(axis=1), values.shape[1] - 3)


@pytest.mark.parametrize(
    ("make", "mesh"),
    [(skfem_surface.bfs, grid), (skfem_surface.argyris, halves)],
    ids=["bfs", "argyris"],
)
def test_named_places(
    make: Callable[..., Surface], mesh: Callable[..., tuple[np.ndarray, np.ndarray]]
) -> None:
    points, cells = scrambled(*mesh(3, 2))
    left = np.flatnonzero(points[:, 0] == 0.0)
    left = left[np.argsort(points[left, 1])]
    corner = int(np.argmax(points.sum(axis=1)))
    pairs = np.column_stack([left[:-1], left[1:]])
    space = make(
        points, cells, {"corner": [corner], "left": left}, {"left": pairs}, {"some": [3, 0]}
    )
    assert_array_equal(space.faces["some"], [3, 0])
    assert set(space.points) == {"corner", "left[0]", "left[1]", "left[2]"}
    for name, node in (("corner", corner), *((f"left[{i}]", node) for i, node in enumerate(left))):
        cell, *xi = space.points[name]
        assert_allclose(
            surface.sample(space, np.array([cell]), np.array([xi])) @ space.reference,
            points[[node]],
            atol=1e-14,
        )
    cell, side = space.edges["left"].T
    middle = (
        surface.sample(space, cell, surface.side_points(space.parent, side, np.full(2, 0.5)))
        @ space.reference
    )
    assert_allclose(middle, [[0.0, 0.25], [0.0, 0.75]], atol=1e-14)


SKEWED = np.array([[0.0, 0.0], [1.0, 0.0], [1.1, 1.0], [0.0, 1.0]])
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
TWO_TURNED = np.concatenate([SQUARE, [[2.0, 0.0], [2.0, 1.0], [1.2, 2.0]]])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: skfem_surface.bfs(SKEWED, [[0, 1, 2, 3]]),
            r"expected rectangles .* cell 0 at \(0.525, 0.5\).* fvs for quads",
        ),
        (
            lambda: skfem_surface.bfs(SQUARE @ [[1.0, 0.0], [0.3, 1.0]], [[0, 1, 2, 3]]),
            "expected rectangles",
        ),
        (lambda: skfem_surface.bfs(SQUARE * 1.0, [[0, 3, 1, 2]]), "cells whose sides do not cross"),
        (
            lambda: skfem_surface.bfs(np.column_stack([SQUARE, SQUARE]), [[0, 1, 2, 3]]),
            r"finite points \(n, 2\)",
        ),
        (lambda: skfem_surface.argyris(SQUARE * np.nan, [[0, 1, 2], [0, 2, 3]]), "NaN"),
        (lambda: skfem_surface.argyris(SQUARE, [[0, 1, 2]]), "unused nodes 3; remove them"),
        (lambda: skfem_surface.argyris(SQUARE, [[0, 1, 2], [0, 2, 4]]), "numbers from 0 to 3"),
        (lambda: skfem_surface.argyris(SQUARE, [[0, 1, 2, 3]]), r"shape \(i, 3\)"),
        (
            lambda: skfem_surface.argyris(
                SQUARE, [[0, 1, 2], [0, 2, 3]], edge_groups={"a": [[1, 3]]}
            ),
            "'a'.* no cell with the side 1, 3",
        ),
        (
            lambda: skfem_surface.argyris(SQUARE, [[0, 1, 2], [0, 2, 3]], point_groups={"p": [7]}),
            "'p'.* numbers from 0 to 3",
        ),
        (
            lambda: skfem_surface.argyris(SQUARE, [[0, 1, 2], [0, 2, 3]], face_groups={"f": [2]}),
            "'f'.* numbers from 0 to 1",
        ),
    ],
)
def test_refused(call: Callable[[], Surface], message: str) -> None:
    with pytest.raises(InputError, match=message):
        call()


# ---------------------------------------------------------------------------------------------------------------- recipe
def test_the_recipe_for_an_own_element_runs() -> None:
    """docs/own_element.md: its code calls the contract; the surface is C1 and its named places are
    where they should be.
    """
    names = pages.run("docs/own_element.md", __name__="own_element")
    shape = names["shape"]
    cell, *xi = shape.points["corner"]
    assert_allclose(
        surface.sample(shape, np.array([cell]), np.array([xi])) @ shape.reference,
        [[0.4, 0.2]],
        atol=1e-15,
    )
    cells, side = shape.edges["left"].T
    left = (
        surface.sample(shape, cells, surface.side_points(shape.parent, side, np.full(4, 0.5)))
        @ shape.reference
    )
    assert_allclose(
        left, [[0.0, 0.175], [0.0, 0.125], [0.0, 0.075], [0.0, 0.025]][::-1], atol=1e-15
    )
    y = np.linspace(0.0, 1.0, 5)
    for k in range(3):
        here = surface.sample(shape, np.zeros(5, int), np.column_stack([np.ones(5), y]), k)
        there = surface.sample(shape, np.full(5, 4), np.column_stack([np.zeros(5), y]), k)
        assert abs(here - there).max() <= 1e-15
