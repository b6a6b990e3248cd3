"""ANCF plates: the contract, circles, patch tests, zero modes, frequencies with exact references,
and what is refused.
"""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose
from scipy.optimize import brentq
from scipy.sparse import coo_array
from scipy.special import jv, jvp, yv, yvp

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.shapes import ancf_plate, surface
from fmbs_skfem.shapes.ancf_plate import Arc
from fmbs_skfem.shapes.surface import Parent, Surface
from fmbs_skfem.shapes.table import check_table

NU = 0.3
# E = t = 1
PLANE_STRESS = np.array([[1.0, NU, 0.0], [NU, 1.0, 0.0], [0.0, 0.0, (1.0 - NU) / 2.0]]) / (
    1.0 - NU**2
)


# ----------------------------------------------------------------------------------------------------------------- meshes
def grid(nx: int, ny: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and anticlockwise cells of the unit square."""
    x, y = np.meshgrid(np.linspace(0.0, 1.0, nx + 1), np.linspace(0.0, 1.0, ny + 1), indexing="ij")
    i = np.arange(nx)[:, None] * (ny + 1) + np.arange(ny)
    return np.column_stack([x.ravel(), y.ravel()]), np.stack(
        [i, i + ny + 1, i + ny + 2, i + 1], axis=-1
    ).reshape(-1, 4)


def ring_mesh(
    layers: int, around: int, shake: float = 0.0
) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """A ring between the radii 1 and 2; the nodes inside are moved by up to `shake`, the rims'
    along the rims.
    """
    random = np.random.default_rng(7)
    angle = 2.0 * np.pi * np.arange(around) / around + 0.3 * shake * random.uniform(
        -1.0, 1.0, (layers + 1, around)
    )
    radius = np.linspace(1.0, 2.0, layers + 1)[:, None]
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    points[1:-1] += shake * random.uniform(-1.0, 1.0, points[1:-1].shape)
    i, j = np.arange(layers)[:, None] * around, np.arange(around)
    k = (j + 1) % around
    cells = np.stack([i + j, i + around + j, i + around + k, i + k], axis=-1).reshape(-1, 4)
    edges = {"inner": np.column_stack([j, k]), "outer": layers * around + np.column_stack([j, k])}
    return points.reshape(-1, 2), cells, edges


def ring(layers: int, around: int, curved: bool = True, shake: float = 0.0) -> Surface:
    points, cells, edges = ring_mesh(layers, around, shake)
    arcs = ancf_plate.arcs_of(points, edges, ["inner", "outer"]) if curved else []
    return ancf_plate.surface(points, cells, arcs, edge_groups=edges)


def distorted(n: int) -> Surface:
    points, cells = grid(n, n)
    inside = ((points > 0.0) & (points < 1.0)).all(axis=1)
    points[inside] += np.random.default_rng(3).uniform(-0.25, 0.25, (inside.sum(), 2)) / n
    return ancf_plate.surface(points, cells)


def turned(degrees: float) -> Surface:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return ancf_plate.surface(grid(1, 1)[0] @ np.array([[c, s], [-s, c]]), grid(1, 1)[1])


SURFACES = {
    "distorted": distorted(4),
    "ring": ring(2, 12),
    "shaken ring": ring(3, 12, shake=0.08),
    "turned by 45 degrees": turned(45.0),
    "far away": ancf_plate.surface(grid(3, 2)[0] + 1e4, grid(3, 2)[1]),
}


# ------------------------------------------------------------------------------------------------- mechanics of the tests
def gradients(space: Surface, order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """N (e, p, b), dN/dX (e, p, 2, b) and the area weights (e, p)."""
    table = surface.tabulate(space, order)
    # dX_c / dxi_k
    jacobian = np.einsum("epkb,ebc->epck", table.values[:, :, 1:3], space.reference[space.nodes])
    gradient = np.einsum("epkc,epkb->epcb", np.linalg.inv(jacobian), table.values[:, :, 1:3])
    return table.values[:, :, 0], gradient, table.weights * np.linalg.det(jacobian)


def assembled(space: Surface, blocks: np.ndarray, components: int) -> np.ndarray:
    """Cell matrices (e, b c, b c) in one dense matrix (n c, n c)."""
    rows = (components * space.nodes[:, :, None] + np.arange(components)).reshape(
        len(space.nodes), -1
    )
    i, j = np.broadcast_arrays(rows[:, :, None], rows[:, None, :])
    size = components * space.count
    return coo_array((blocks.ravel(), (i.ravel(), j.ravel())), shape=(size, size)).toarray()


def membrane(space: Surface, order: int = ancf_plate.ORDER) -> np.ndarray:
    """int eps : C : eps of linear elasticity, coordinates (function, component)."""
    _, gradient, area = gradients(space, order)
    strain = np.zeros((*area.shape, 3, 12, 2))
    strain[:, :, 0, :, 0] = strain[:, :, 2, :, 1] = gradient[:, :, 0]
    strain[:, :, 1, :, 1] = strain[:, :, 2, :, 0] = gradient[:, :, 1]
    strain = strain.reshape(*area.shape, 3, 24)
    return assembled(
        space,
        np.einsum("epin,ij,epjm,ep->enm", strain, PLANE_STRESS, strain, area, optimize=True),
        2,
    )


def mass(space: Surface, components: int) -> np.ndarray:
    values, _, area = gradients(space, 6)
    scalar = np.einsum("epa,epb,ep->eab", values, values, area)
    size = 12 * components
    return assembled(
        space,
        np.einsum("eab,cd->eacbd", scalar, np.eye(components)).reshape(-1, size, size),
        components,
    )


def frequencies(stiffness: np.ndarray, inertia: np.ndarray, rigid: int, count: int) -> np.ndarray:
    """The first frequencies after the rigid motions, which have none."""
    squares = scipy.linalg.eigh(
        stiffness, inertia, eigvals_only=True, subset_by_index=[0, rigid + count - 1]
    )
    assert np.abs(squares[:rigid]).max() < 1e-7 * squares[rigid]
    return np.sqrt(squares[rigid:])


def edge_cells(space: Surface, count: int, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cells, parent points and fractions s of `count` points on every edge of a group."""
    cell, side = np.repeat(space.edges[name], count, axis=0).T
    s = np.tile(np.linspace(0.0, 1.0, count), len(space.edges[name]))
    return cell, surface.side_points(Parent.SQUARE, side, s), s


# -------------------------------------------------------------------------------------------------------------- functions
@pytest.mark.parametrize("space", SURFACES.values(), ids=SURFACES)
def test_contract(space: Surface) -> None:
    check_table(space)


def test_functions_are_nodal_on_the_parent_square() -> None:
    space = ancf_plate.surface(*grid(1, 1))
    corners = surface.VERTICES[Parent.SQUARE]
    values = surface.basis(space.space, np.zeros(4, dtype=int), corners)[:, :3].reshape(12, 12)
    assert_allclose(values, np.eye(12), atol=1e-15)  # rows and columns r, r_X, r_Y of every vertex
    assert_allclose(space.reference[space.nodes[0]].reshape(4, 3, 2)[:, 0], corners)


def test_polynomials_of_the_space_are_reproduced_on_a_square_also_outside_it() -> None:
    """x^i y^j, i + j <= 3, x^3 y and x y^3, and all derivatives, from nodal values and slopes
    (Adini and Clough 1961).
    """
    space = ancf_plate.surface(*grid(1, 1))
    corners, points = grid(1, 1)[0], np.random.default_rng(1).uniform(-0.5, 1.5, (20, 2))
    rows = surface.basis(space.space, np.zeros(20, dtype=int), points)
    for i, j in ancf_plate.POWERS:
        f = np.polynomial.Polynomial.basis(i), np.polynomial.Polynomial.basis(j)

        def exact(x: np.ndarray, m: int, n: int, f: Any = f) -> np.ndarray:
            return np.asarray(f[0].deriv(m)(x[:, 0]) * f[1].deriv(n)(x[:, 1]))

        nodal = np.column_stack(
            [exact(corners, *order) for order in ((0, 0), (1, 0), (0, 1))]
        ).ravel()
        for k, (m, n) in enumerate(((0, 0), (1, 0), (0, 1), (2, 0), (0, 2), (1, 1))):
            assert_allclose(rows[:, k] @ nodal[space.nodes[0]], exact(points, m, n), atol=2e-13)


def test_shape_is_continuous_over_every_edge_inside() -> None:
    """Arbitrary coordinates, both sides of every edge between two cells."""
    space = SURFACES["shaken ring"]
    cells = space.nodes[:, ::3] // 3
    coordinates = np.random.default_rng(2).normal(size=(space.count, 2))
    seen: dict[tuple[int, int], np.ndarray] = {}
    s = np.linspace(0.0, 1.0, 7)
    shared = 0
    for cell, side in np.ndindex(len(cells), 4):
        a, b = int(cells[cell, side]), int(cells[cell, (side + 1) % 4])
        xi = surface.side_points(Parent.SQUARE, np.full(7, side), s)
        r = surface.sample(space, np.full(7, cell), xi) @ coordinates
        if (b, a) in seen:
            shared += 1
            assert_allclose(r[::-1], seen[b, a], atol=1e-13)
        seen[a, b] = r
    assert shared == 2 * 12 + 3 * 12


# ---------------------------------------------------------------------------------------------------------------- circles
@pytest.mark.parametrize("around", [6, 12, 36])
def test_radius_of_curved_edges(around: int) -> None:
    """max (|r| - R) = 2/27 R sin^6(theta/4) / cos^2(theta/4), exact in the middle (Goldapp 1991);
    arc-length tangents are worse.
    """
    space = ring(1, around)
    quarter = np.pi / 2.0 / around
    largest = 2.0 / 27.0 * np.sin(quarter) ** 6 / np.cos(quarter) ** 2
    for name, radius in (("inner", 1.0), ("outer", 2.0)):
        cell, xi, s = edge_cells(space, 241, name)
        error = (
            np.linalg.norm(surface.sample(space, cell, xi) @ space.reference, axis=1) / radius - 1.0
        )
        assert_allclose(error[(s == 0.0) | (s == 0.5) | (s == 1.0)], 0.0, atol=4e-16)
        assert error.min() > -4e-16
        assert_allclose(error.max(), largest, rtol=1e-3, atol=4e-16)
        assert largest < 0.1 * (4.0 * quarter) ** 4 / 384.0


def area(space: Surface) -> float:
    return float(gradients(space, ancf_plate.ORDER)[2].sum())


@pytest.mark.parametrize("curved,order", [(True, 6.0), (False, 2.0)])
def test_order_of_the_area_of_a_ring(curved: bool, order: float) -> None:
    """The area 3 pi of a ring: sixth order with curved rims, second with straight ones."""
    errors = [abs(area(ring(max(n // 8, 1), n, curved)) / (3.0 * np.pi) - 1.0) for n in (8, 16, 32)]
    for coarse, fine in pairwise(errors):
        assert_allclose(np.log2(coarse / fine), order, atol=0.05)
    assert errors[-1] < (1.1e-9 if curved else 6.5e-3)


def test_tangents_of_straight_edges_are_the_edges_and_of_arcs_those_of_the_circle() -> None:
    points, cells, edges = ring_mesh(1, 8)
    tangents = ancf_plate.surface(
        points, cells, [Arc(np.zeros(2), 1.0, edges["inner"])]
    ).space.tangents
    assert_allclose(tangents[:, 0, 0], points[cells[:, 1]] - points[cells[:, 0]])
    assert_allclose(tangents[:, 1, 1], points[cells[:, 2]] - points[cells[:, 1]])
    length = 4.0 * np.tan(np.pi / 16.0)
    for vertex in (0, 3):
        radius = points[cells[:, vertex]]
        assert_allclose(
            tangents[:, vertex, 1],
            length * np.column_stack([-radius[:, 1], radius[:, 0]]),
            atol=1e-15,
        )


@pytest.mark.parametrize("span", [0.02, 0.5, 2.0 * np.pi])
def test_circle_through_points_is_exact(span: float) -> None:
    angle = np.linspace(0.0, span, 9)
    center, radius = ancf_plate.circle_through(
        np.array([0.1, -3.0]) + 0.035 * np.column_stack([np.cos(angle), np.sin(angle)])
    )
    tolerance = 1e-13 / min(span, 1.0) ** 2
    assert_allclose(center, [0.1, -3.0], atol=tolerance)
    assert_allclose(radius, 0.035, atol=tolerance)


def test_circle_through_refuses_what_is_none() -> None:
    angle = np.linspace(0.0, 2.0, 9)
    points = np.column_stack([np.cos(angle), np.sin(angle)])
    points[4] *= 1.0 + 1e-5
    with pytest.raises(
        InputError,
        match=r"expected points on a circle, got point 4 at \(0\.5403.*name the nodes of one arc only",
    ):
        ancf_plate.circle_through(points)
    with pytest.raises(InputError, match="points on a straight line"):
        ancf_plate.circle_through(np.column_stack([angle, 0.1 * angle]))
    with pytest.raises(InputError, match="at least three finite points"):
        ancf_plate.circle_through(points[:2])


def test_arcs_of_groups() -> None:
    points, _, edges = ring_mesh(1, 12)
    groups = {
        **edges,
        "outer quarter": edges["outer"][:3],
        "both": np.concatenate(list(edges.values())),
        "edge": edges["outer"][:1],
    }
    found = ancf_plate.arcs_of(points, groups)
    assert [arc.radius for arc in found] == pytest.approx([1.0, 2.0, 2.0], abs=1e-12)
    assert [len(arc.edges) for arc in found] == [12, 12, 3]
    (inner,) = ancf_plate.arcs_of(points, groups, ["inner"])
    assert_allclose(inner.center, 0.0, atol=1e-14)
    with pytest.raises(InputError, match=r"edge group 'both': .*expected points on a circle"):
        ancf_plate.arcs_of(points, groups, ["both"])
    with pytest.raises(
        InputError, match=r"got 'iner'; use one of the groups .*did you mean 'inner'"
    ):
        ancf_plate.arcs_of(points, groups, ["iner"])


def test_corners_of_rectangles_and_hexagons_stay_corners() -> None:
    points, cells = grid(1, 1)
    outline = np.stack([cells[0], np.roll(cells[0], -1)], axis=1)
    assert ancf_plate.arcs_of(points, {"outline": outline}) == []
    points, _, edges = ring_mesh(1, 6)
    assert ancf_plate.arcs_of(points, edges) == []
    points, _ = grid(4, 1)
    assert (
        ancf_plate.arcs_of(
            points, {"bottom": np.column_stack([np.arange(0, 8, 2), np.arange(2, 10, 2)])}
        )
        == []
    )


# ------------------------------------------------------------------------------------------------------------ patch tests
@pytest.mark.parametrize("space", SURFACES.values(), ids=SURFACES)
def test_linear_fields_are_exact(space: Surface) -> None:
    """r = A X + b gives dr/dX = A everywhere, on curved cells too."""
    a, b = np.array([[1.3, -0.4], [0.2, 0.8]]), np.array([2.0, -1.0])
    coordinates = space.reference @ a.T + space.unit[:, None] * b
    gradient = np.einsum("epkb,ebc->epck", gradients(space, 4)[1], coordinates[space.nodes])
    assert_allclose(
        gradient,
        np.broadcast_to(a, gradient.shape),
        atol=1e-14 * max(1.0, np.abs(space.reference).max()),
    )


@pytest.mark.parametrize("space", SURFACES.values(), ids=SURFACES)
def test_rotations_strain_nothing(space: Surface) -> None:
    q = np.array([[np.cos(2.0), -np.sin(2.0)], [np.sin(2.0), np.cos(2.0)]])
    coordinates = space.reference @ q.T
    f = np.einsum("epkb,ebc->epck", gradients(space, 3)[1], coordinates[space.nodes])
    strain = 0.5 * (np.einsum("epca,epcb->epab", f, f) - np.eye(2))
    assert np.abs(strain).max() < 1e-14 * max(1.0, np.abs(space.reference).max())


@pytest.mark.parametrize("name", ["distorted", "shaken ring"])
def test_patch_with_prescribed_rim(name: str) -> None:
    """Nodes inside are free; K u = 0 there gives u = H X, r_X = H e_x, r_Y = H e_y."""
    space = SURFACES[name]
    h = np.array([[0.02, 0.013], [-0.004, -0.011]])
    exact = (space.reference @ h.T).ravel()
    points = space.reference[::3]
    radius = np.linalg.norm(points, axis=1)
    rim = (
        (np.abs(points - 0.5).max(axis=1) > 0.4999)
        if name == "distorted"
        else (radius < 1.0001) | (radius > 1.9999)
    )
    free = np.repeat(~rim, 6)
    assert 0 < free.sum() < len(free)
    stiffness = membrane(space)
    u = scipy.linalg.solve(
        stiffness[np.ix_(free, free)],
        -stiffness[np.ix_(free, ~free)] @ exact[~free],
        assume_a="pos",
    )
    assert np.abs(u - exact[free]).max() < 1e-12 * np.abs(exact).max()


@pytest.mark.parametrize("curved", [True, False])
def test_patch_under_tractions(curved: bool) -> None:
    """Tractions s n of a constant stress on the rims of a shaken ring give its constant strain;
    only rigid motions are held.
    """
    space = ring(3, 12, curved, shake=0.08)
    stress = np.array([[1.0, 0.3], [0.3, -0.5]])
    strain = np.linalg.solve(PLANE_STRESS, [stress[0, 0], stress[1, 1], stress[0, 1]])
    h = np.array([[strain[0], strain[2] / 2.0], [strain[2] / 2.0, strain[1]]])
    gauss, weights = np.polynomial.legendre.leggauss(3)
    load = np.zeros((space.count, 2))
    for cell, side in np.concatenate(list(space.edges.values())):
        start, end = surface.VERTICES[Parent.SQUARE][[side, (side + 1) % 4]]
        xi = surface.side_points(Parent.SQUARE, np.full(3, side), 0.5 + 0.5 * gauss)
        rows = surface.basis(space.space, np.full(3, cell), xi)
        along = (
            np.einsum("k,xkb->xb", end - start, rows[:, 1:3]) @ space.reference[space.nodes[cell]]
        )
        normal = np.column_stack([along[:, 1], -along[:, 0]])  # outwards, times ds
        load[space.nodes[cell]] += 0.5 * rows[:, 0].T @ (weights[:, None] * normal @ stress)
    stiffness = membrane(space)
    # both components of node 0, at an angle of 0 degrees, one of node 6, at 180 degrees
    held = np.array([0, 1, 6 * 6 + 1])
    exact = (space.reference @ h.T + space.unit[:, None] * (-space.reference[0] @ h.T)).ravel()
    free = np.setdiff1d(np.arange(2 * space.count), held)
    force = load.ravel() - stiffness[:, held] @ exact[held]
    u = scipy.linalg.solve(stiffness[np.ix_(free, free)], force[free], assume_a="pos")
    assert np.abs(u - exact[free]).max() < 1e-12 * np.abs(exact).max()


@pytest.mark.parametrize("name", ["distorted", "shaken ring"])
def test_patch_at_finite_strain(name: str) -> None:
    """St. Venant-Kirchhoff: a homogeneous F leaves no force on functions inside, int (F S) . grad N
    = 0.
    """
    space = SURFACES[name]
    f = np.array([[1.2, 0.3], [-0.1, 0.9]])
    e = 0.5 * (f.T @ f - np.eye(2))
    s = PLANE_STRESS @ [e[0, 0], e[1, 1], 2.0 * e[0, 1]]
    p = f @ np.array([[s[0], s[2]], [s[2], s[1]]])
    _, gradient, weights = gradients(space, ancf_plate.ORDER)
    force = np.zeros((space.count, 2))
    np.add.at(force, space.nodes, np.einsum("epab,ca,ep->ebc", gradient, p, weights))
    points = space.reference[::3]
    radius = np.linalg.norm(points, axis=1)
    rim = (
        (np.abs(points - 0.5).max(axis=1) > 0.4999)
        if name == "distorted"
        else (radius < 1.0001) | (radius > 1.9999)
    )
    assert np.abs(force[~np.repeat(rim, 3)]).max() < 1e-14
    assert np.abs(force[np.repeat(rim, 3)]).max() > 0.05


def zero_modes(space: Surface, order: int) -> int:
    values = np.linalg.eigvalsh(membrane(space, order))
    assert values[0] > -1e-12 * values[-1]
    return int((values < 1e-10 * values[-1]).sum())


SINGLE = {
    "square": turned(0.0),
    "turned by 45 degrees": turned(45.0),
    "trapezoid": ancf_plate.surface(
        [[0.0, 0.0], [2.0, 0.1], [1.4, 1.0], [0.3, 0.8]], [[0, 1, 2, 3]]
    ),
    "curved": ancf_plate.surface(
        [[1.0, 0.0], [2.0, 0.0], [0.0, 2.0], [0.0, 1.0]],
        [[0, 1, 2, 3]],
        [Arc(np.zeros(2), 2.0, np.array([[2, 1]]))],
    ),
}


@pytest.mark.parametrize("space", SINGLE.values(), ids=SINGLE)
def test_three_gauss_points_leave_the_rigid_motions_only(space: Surface) -> None:
    assert zero_modes(space, 3) == 3


@pytest.mark.parametrize("space", SINGLE.values(), ids=SINGLE)
def test_two_gauss_points_leave_spurious_modes(space: Surface) -> None:
    """Four points with three strains each hold twelve of 24 coordinates."""
    assert zero_modes(space, 2) == 12


def test_frequencies_do_not_depend_on_the_direction_of_the_square() -> None:
    """Gradients in X and Y and tangents along the edges: a polynomial in X, Y would be singular at
    45 degrees.
    """
    straight, oblique = (
        frequencies(membrane(space), mass(space, 2), 3, 21) for space in (turned(0.0), turned(45.0))
    )
    assert_allclose(oblique, straight, rtol=1e-11)


# ------------------------------------------------------------------------------------------------------------ frequencies
def free_rims(omega: float, n: int) -> float:
    """Determinant of the stresses on free rims r = 1, 2 of plane waves cos(n theta), sin(n theta),
    E = rho = 1.

    u_r = f' + n g / r, u_theta = -n f / r - g' with Bessel functions f of the dilatation and g of
    the shear wave (G. Ambati, J. F. W. Bell, J. C. K. Sharp, J. Sound Vib. 47, 1976, 415-432); n =
    0 is the product of both kinds.
    """
    kinds = []
    for speed, shear in (
        (1.0 / np.sqrt(1.0 - NU**2), False),
        (1.0 / np.sqrt(2.0 * (1.0 + NU)), True),
    ):
        k = omega / speed
        for value, slope in ((jv, jvp), (yv, yvp)):
            column = []
            for r in (1.0, 2.0):
                w, w1, w2 = value(n, k * r), k * slope(n, k * r), k**2 * slope(n, k * r, 2)
                if shear:
                    u, v, u1, v1 = n * w / r, -w1, n * w1 / r - n * w / r**2, -w2
                else:
                    u, v, u1, v1 = w1, -n * w / r, w2, -n * w1 / r + n * w / r**2
                column += [u1 + NU * (u + n * v) / r, v1 - (n * u + v) / r]
            kinds.append(column)
    matrix = np.array(kinds).T
    if n > 0:
        return float(np.linalg.det(matrix))
    return float(np.linalg.det(matrix[::2, :2]) * np.linalg.det(matrix[1::2, 2:]))


def ring_frequencies(count: int) -> np.ndarray:
    """The first exact frequencies of the free ring; those with n > 0 count twice."""
    found: list[float] = []
    scan = np.linspace(0.05, 2.2, 431)
    for n in range(9):
        values = [free_rims(omega, n) for omega in scan]
        roots = [
            brentq(partial(free_rims, n=n), a, b, xtol=1e-13)
            for (a, b), (fa, fb) in zip(pairwise(scan), pairwise(values), strict=True)
            if fa * fb < 0.0
        ]
        found += roots * (2 if n else 1)
    return np.sort(found)[:count]


def test_frequencies_of_a_free_ring() -> None:
    """Twelve in-plane frequencies against Bessel functions: 0.03 % with 960 coordinates, 0.4 % with
    straight edges.
    """
    exact = ring_frequencies(12)
    errors = {}
    for curved, n in ((True, 2), (True, 4), (False, 4)):
        space = ring(n, 8 * n, curved)
        errors[curved, n] = np.abs(
            frequencies(membrane(space), mass(space, 2), 3, 12) / exact - 1.0
        ).max()
    assert errors[True, 4] < 3.2e-4
    assert errors[False, 4] > 3.0e-3
    assert np.log2(errors[True, 2] / errors[True, 4]) > 4.5


def bending_frequencies(n: int, count: int) -> np.ndarray:
    """omega a^2 sqrt(rho t / D) of the free unit square of n x n cells in linear thin-plate
    bending.
    """
    space = ancf_plate.surface(*grid(n, n))
    table = surface.tabulate(space)
    curvature = table.values[:, :, 3:] * n**2
    curvature[:, :, 2] *= 2.0
    rigidity = (1.0 - NU**2) * PLANE_STRESS
    stiffness = np.einsum(
        "epib,ij,epjd,ep->ebd", curvature, rigidity, curvature, table.weights / n**2, optimize=True
    )
    return frequencies(assembled(space, stiffness, 1), mass(space, 1), 3, count)


def test_frequencies_of_a_free_square_plate() -> None:
    """Bending, nu = 0.3: A. W. Leissa, J. Sound Vib. 31, 1973, doi:10.1016/S0022-460X(73)80371-2;
    Ritz values converged to 1e-6.
    """
    exact = np.array([13.468197, 19.596137, 24.270201, 34.800889, 34.800891, 61.093234])
    coarse, fine = (np.abs(bending_frequencies(n, 6) / exact - 1.0) for n in (10, 20))
    assert fine.max() < 7e-4
    assert np.log2(coarse.max() / fine.max()) > 1.8


# ----------------------------------------------------------------------------------------------------------------- places
def test_named_places() -> None:
    points, cells = grid(2, 2)
    space = ancf_plate.surface(
        points,
        cells,
        point_groups={"corner": [8], "left": [0, 1, 2]},
        edge_groups={"top": [[2, 5], [8, 5]], "inside": [[1, 4]]},
        face_groups={"half": [2, 3]},
    )
    assert set(space.points) == {"corner", "left[0]", "left[1]", "left[2]"}
    for name, node in (("corner", 8), ("left[0]", 0), ("left[2]", 2)):
        cell, *xi = space.points[name]
        assert_allclose(
            surface.sample(space, np.array(cell), np.array(xi)) @ space.reference, points[[node]]
        )
    for name, along, at in (("top", 1, 1.0), ("inside", 1, 0.5)):
        cell, xi, _ = edge_cells(space, 5, name)
        assert_allclose((surface.sample(space, cell, xi) @ space.reference)[:, along], at)
    assert space.faces["half"].tolist() == [2, 3]
    assert space.nodes[0].tolist() == [0, 1, 2, 9, 10, 11, 12, 13, 14, 3, 4, 5]


SQUARE = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
LENS = [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]


@pytest.mark.parametrize(
    "points,quad,message",
    [
        (
            SQUARE,
            [0, 3, 2, 1],
            r"cell 0 that is clockwise, nodes 0 \(0, 0\), 3 \(0, 1\).*reverse its nodes",
        ),
        (SQUARE, [0, 2, 1, 3], r"cell 0 that is a bow-tie, .*order its nodes around the cell"),
        ([[0.0, 0.0], [1.0, 0.0], [0.2, 0.2], [0.0, 1.0]], [0, 1, 2, 3], "cell 0 that is concave"),
        (
            [[0.0, 0.0], [1.0, 0.0], [0.5, 0.5], [0.0, 1.0]],
            [0, 1, 2, 3],
            "cell 0 that is degenerate",
        ),
        (SQUARE, [0, 1, 2, 2], "unused nodes 3; remove them"),
        (SQUARE, [0, 1, 2, 4], r"expected numbers from 0 to 3, got 4"),
        (SQUARE, [0, 1, 2], r"expected whole numbers of shape \(i, 4\)"),
        ([*SQUARE[:3], [0.0, np.nan]], [0, 1, 2, 3], "NaN or infinity"),
        ([[*point, 0.0] for point in SQUARE], [0, 1, 2, 3], "a flat plate has no third coordinate"),
    ],
)
def test_meshes_refused(points: list[list[float]], quad: list[int], message: str) -> None:
    with pytest.raises(InputError, match=message):
        ancf_plate.surface(points, [quad])


@pytest.mark.parametrize(
    "points,arc,message",
    [
        (
            LENS,
            Arc(np.zeros(2), 1.0, np.array([[0, 1], [1, 2]])),
            "cell 0 with two edges on one arc, .*set 'arcs: ..' for straight edges, or use triangles",
        ),
        (
            LENS,
            Arc(np.zeros(2), 1.1, np.array([[0, 1]])),
            r"nodes on the circle of radius 1\.1 about \(0, 0\), got node 0 at \(0, -1\)",
        ),
        (
            SQUARE,
            Arc(np.array([0.5, 0.0]), 0.5, np.array([[0, 1]])),
            "edges of at most 150 degrees, got 180",
        ),
        (
            SQUARE,
            Arc(np.array([0.5, 0.5]), np.sqrt(0.5), np.array([[0, 2]])),
            "no cell with the side 0, 2",
        ),
        (
            [[0.0, 0.0], [2.0, 0.0], [2.0, 0.1], [0.0, 0.1]],
            Arc(np.array([1.0, -2.0]), np.sqrt(5.0), np.array([[0, 1]])),
            "folded cell 0 with the nodes 0, 1, 2, 3",
        ),
    ],
)
def test_arcs_refused(points: list[list[float]], arc: Arc, message: str) -> None:
    with pytest.raises(InputError, match=message):
        ancf_plate.surface(points, [[0, 1, 2, 3]], [arc])


def test_edges_on_arcs_stay_straight_where_a_cell_would_fold() -> None:
    """A ring with a cell that has two edges on the circle, and a cell as thin as its arc is high;
    the other edges are round.
    """
    angle = np.pi / 6.0 * np.arange(12)
    outer, inner = (r * np.column_stack([np.cos(angle), np.sin(angle)]) for r in (1.0, 0.5))
    points = np.concatenate([outer, inner])
    ring = [[12 + k, k, (k + 1) % 12, 12 + (k + 1) % 12] for k in range(2, 12)] + [[13, 0, 1, 2]]
    rim = np.column_stack([np.arange(12), (np.arange(12) + 1) % 12])
    with pytest.warns(
        Notice,
        match=r"2 edges on arcs stay straight.* as near \(0\.93\d+, 0\.25\); an edge that is hinged there",
    ):
        (arc,) = ancf_plate.fitting(points, ring, ancf_plate.arcs_of(points, {"rim": rim}))
    assert sorted(map(tuple, arc.edges.tolist())) == sorted(map(tuple, rim[2:].tolist()))
    plate = ancf_plate.surface(points, ring, [arc])
    table = surface.tabulate(plate)
    tangents = np.einsum("epkb,ebc->epkc", table.values[:, :, 1:3], plate.reference[plate.nodes])
    area = float(np.sum(table.weights * np.linalg.det(tangents)))
    x, y = points[ring[-1]].T
    straight = 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    assert_allclose(area, 10 * (np.pi / 12.0 - 0.0625) + straight, rtol=1e-5)
    thin, bow = (
        [[0.0, 0.0], [2.0, 0.0], [2.0, 0.1], [0.0, 0.1]],
        Arc(np.array([1.0, -2.0]), np.sqrt(5.0), np.array([[0, 1]])),
    )
    with pytest.warns(Notice, match="1 edges on arcs stay straight"):
        assert not len(ancf_plate.fitting(thin, [[0, 1, 2, 3]], [bow])[0].edges)


def test_groups_refused() -> None:
    with pytest.raises(
        InputError,
        match=r"edge group 'rim': expected edges of cells, got no cell with the side 1, 3",
    ):
        ancf_plate.surface(SQUARE, [[0, 1, 2, 3]], edge_groups={"rim": [[0, 1], [1, 3]]})
    with pytest.raises(InputError, match=r"face group 'all': expected numbers from 0 to 0, got 1"):
        ancf_plate.surface(SQUARE, [[0, 1, 2, 3]], face_groups={"all": [0, 1]})
    with pytest.raises(InputError, match=r"point group 'pin': expected whole numbers"):
        ancf_plate.surface(SQUARE, [[0, 1, 2, 3]], point_groups={"pin": [0.5]})
