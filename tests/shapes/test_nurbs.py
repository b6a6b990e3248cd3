"""NURBS surfaces: the contract, exact shapes, refinement, common edges, springs against folding,
what is refused.
"""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose, assert_array_equal

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.shapes import interfaces, line, nurbs, surface
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.shapes.table import check_table

NU = 0.3
# D = 1, curvatures 11, 22, 12
BENDING = np.array([[1.0, NU, 0.0], [NU, 1.0, 0.0], [0.0, 0.0, 2.0 * (1.0 - NU)]])
MEMBRANE = np.array([[1.0, NU, 0.0], [NU, 1.0, 0.0], [0.0, 0.0, (1.0 - NU) / 2.0]])
# free square plate, omega a^2 sqrt(rho t / D)
LEISSA = np.array([13.4682, 19.5961, 24.2702, 34.8009, 34.8009, 61.093])
KNOTS = [0.0, 0.0, 0.0, 0.4, 1.0, 1.0, 1.0]
RIGHT = np.array([1.0, 0.0, 0.0])
SPACES = [(degree, continuity) for degree in (2, 3, 4, 5) for continuity in range(degree)]


def rational(degree: int, continuity: int, seed: int = 1) -> Surface:
    """A curved surface with uneven cells and uneven weights, of another degree in direction 2."""
    random = np.random.default_rng(seed)
    one = line.uniform([0.0, 0.3, 0.7, 2.0], degree, continuity)
    two = line.uniform([-1.0, 0.0, 0.4], degree - 1, max(continuity - 1, 0))
    x, y = np.meshgrid(
        np.linspace(0.0, 1.0, one.count), np.linspace(0.0, 1.0, two.count), indexing="ij"
    )
    control = np.stack([x, y, 0.1 * random.uniform(size=x.shape)], axis=2)
    return nurbs.surface(
        nurbs.Patch(
            one.knots, two.knots, one.degree, two.degree, random.uniform(0.5, 2.0, x.shape)
        ),
        control,
    )


def at_gauss(shape: Surface, order: int | None = None) -> np.ndarray:
    """The reference shape and its derivatives at the Gauss points, (x, 6, c)."""
    table = surface.tabulate(shape, order)
    values = np.einsum("epkb,ebc->epkc", table.values, shape.reference[shape.nodes])
    return values.reshape(-1, *values.shape[2:])


def halves(n: int, slant: float = 0.0, degree: int = 3, continuity: int | None = None) -> Surface:
    """The unit square of two patches with a common edge from (1/2 - slant, 0) to (1/2 + slant, 1)."""
    open_ = np.array([0.0, 0.0, 1.0, 1.0])
    low, high = [0.5 - slant, 0.0], [0.5 + slant, 1.0]
    corners = {
        "left": [[[0.0, 0.0], [0.0, 1.0]], [low, high]],
        "right": [[low, high], [[1.0, 0.0], [1.0, 1.0]]],
    }
    shapes = {
        name: nurbs.refine(nurbs.Patch(open_, open_, 1, 1), points, n, 2 * n, degree, continuity)
        for name, points in corners.items()
    }
    return nurbs.surface(
        {name: patch for name, (patch, _) in shapes.items()},
        {name: c for name, (_, c) in shapes.items()},
    )


def matrices(shape: Surface, order: int | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bending, membrane and mass matrices of a flat plate, E t = D = rho t = 1 up to constants,
    from physical derivatives.
    """
    table = surface.tabulate(shape, order)
    n, b = shape.count, table.nodes.shape[1]
    x = np.einsum("epkb,ebc->epkc", table.values, shape.reference[shape.nodes][..., :2])
    inverse = np.linalg.inv(x[:, :, 1:3])  # [c, a] = d xi_a / d x_c
    first = np.einsum("epca,epab->epcb", inverse, table.values[:, :, 1:3])
    second = (table.values[:, :, 3:] - np.einsum("epkc,epcb->epkb", x[:, :, 3:], first))[
        :, :, [0, 2, 2, 1]
    ]
    second = np.einsum(
        "epca,epdf,epafb->epcdb", inverse, inverse, second.reshape(*first.shape[:2], 2, 2, b)
    )
    weights = table.weights / np.abs(np.linalg.det(inverse))
    curvature = np.stack([second[:, :, 0, 0], second[:, :, 1, 1], second[:, :, 0, 1]], axis=2)
    zero = np.zeros_like(first[:, :, 0])
    strain = np.stack(
        [
            np.concatenate(pair, axis=2)
            for pair in (
                (first[:, :, 0], zero),
                (zero, first[:, :, 1]),
                (first[:, :, 1], first[:, :, 0]),
            )
        ],
        axis=2,
    )

    def assemble(
        rows: np.ndarray, modulus: np.ndarray, numbers: np.ndarray, size: int
    ) -> np.ndarray:
        local = np.einsum("ep,epib,ij,epjd->ebd", weights, rows, modulus, rows, optimize=True)
        whole = np.zeros((size, size))
        np.add.at(whole, (numbers[:, :, None], numbers[:, None, :]), local)
        return whole

    both = np.concatenate([table.nodes, table.nodes + n], axis=1)
    mass = assemble(table.values[:, :, :1], np.eye(1), table.nodes, n)
    return (
        assemble(curvature, BENDING, table.nodes, n),
        assemble(strain, MEMBRANE, both, 2 * n),
        mass,
    )


def frequencies(shape: Surface, extra: np.ndarray | float = 0.0) -> np.ndarray:
    """Circular frequencies of a free plate, rigid motions included."""
    bending, _, _ = matrices(shape)
    values = scipy.linalg.eigvalsh(bending + extra, matrices(shape, shape.order + 1)[2])
    return np.sqrt(np.maximum(values, 0.0))


# ----------------------------------------------------------------------------------------------------------- the contract
@pytest.mark.parametrize("degree,continuity", SPACES)
def test_contract(degree: int, continuity: int) -> None:
    check_table(rational(degree, continuity))
    check_table(nurbs.surface(*nurbs.rectangle(2.0, 1.0, 3, 2, degree, continuity)))
    check_table(nurbs.surface(*nurbs.cylinder_panel(2.0, 3.0, -0.7, 0.7, 2, 2, degree, continuity)))


@pytest.mark.parametrize("degree,continuity", SPACES)
def test_values_are_products_of_lines(degree: int, continuity: int) -> None:
    """Against the B-splines of `line`, derivatives in the knots' parameter."""
    one, two = (
        line.uniform([0.0, 0.3, 0.7, 2.0], degree, continuity),
        line.uniform([-1.0, 0.0, 0.4], degree, 0),
    )
    control = np.random.default_rng(2).uniform(size=(one.count, two.count, 3))
    shape = nurbs.surface(nurbs.Patch(one.knots, two.knots, degree, degree), control)
    for cell in range(6):
        i, j = cell % 3, cell // 3
        s, (h1, h2) = (
            np.array([[0.2, 0.9]]),
            (np.diff(line.breaks(one))[i], np.diff(line.breaks(two))[j]),
        )
        xi = line.breaks(one)[i] + s[0, 0] * h1, line.breaks(two)[j] + s[0, 1] * h2
        for k, (d1, d2) in enumerate(((0, 0), (1, 0), (0, 1), (2, 0), (0, 2), (1, 1))):
            exact = (
                line.sample(one, xi[0], d1).toarray()[0],
                line.sample(two, xi[1], d2).toarray()[0],
            )
            found = surface.sample(shape, np.array([cell]), s, k) @ shape.reference
            assert_allclose(
                found[0],
                h1**d1 * h2**d2 * np.einsum("i,j,ijc->c", *exact, control),
                rtol=1e-11,
                atol=1e-12,
            )


def test_beyond_its_ends_a_cell_continues_its_own_polynomial() -> None:
    patch, control = nurbs.rectangle(1.0, 1.0, 4, 1, 3)
    shape = nurbs.surface(patch, control)
    s = np.linspace(0.1, 0.9, 4)
    for cell in range(4):
        values = surface.basis(
            shape.space, np.full(4, cell), np.column_stack([s, np.full(4, 0.5)])
        )[:, 0]
        beyond = surface.basis(shape.space, np.full(2, cell), np.array([[-0.2, 0.5], [1.2, 0.5]]))[
            :, 0
        ]
        exact = np.stack(
            [np.polyval(np.polyfit(s, column, 3), [-0.2, 1.2]) for column in values.T], axis=1
        )
        assert_allclose(beyond, exact, atol=1e-12)


@pytest.mark.parametrize("degree", [2, 3, 4, 5])
def test_polynomials_are_reproduced(degree: int) -> None:
    """x^i y^j for i, j up to the degree, with second derivatives, over parameters that are x and y."""
    shape = nurbs.surface(*nurbs.rectangle(2.0, 1.5, 3, 2, degree))
    table = surface.tabulate(shape, degree + 1)
    rows = np.einsum("epkb,ebn->epkn", table.values, np.eye(shape.count)[shape.nodes]).reshape(
        -1, 6, shape.count
    )
    x, y = at_gauss(shape, degree + 1)[:, 0, :2].T
    for i in range(degree + 1):
        for j in range(degree + 1):
            coefficients = np.linalg.lstsq(rows[:, 0], x**i * y**j, rcond=None)[0]
            assert_allclose(rows[:, 0] @ coefficients, x**i * y**j, atol=1e-12 * 2.0**i * 1.5**j)
            mixed = i * j * x ** max(i - 1, 0) * y ** max(j - 1, 0) * (2.0 / 3.0) * (1.5 / 2.0)
            assert_allclose(rows[:, 5] @ coefficients, mixed, atol=1e-10 * 2.0**i * 1.5**j)


def test_numbers_run_fastest_in_direction_1() -> None:
    patch, control = nurbs.rectangle(3.0, 2.0, 3, 2, 2)
    shape = nurbs.surface(patch, control)
    assert_array_equal(shape.reference, control.swapaxes(0, 1).reshape(-1, 3))
    assert_array_equal(shape.nodes[4], [6, 7, 8, 11, 12, 13, 16, 17, 18])
    middles = surface.sample(shape, np.arange(6), np.full((6, 2), 0.5)) @ shape.reference
    assert_allclose(middles[:, :2], [(i + 0.5, j + 0.5) for j in range(2) for i in range(3)])


# ------------------------------------------------------------------------------------------------------------ exact shapes
@pytest.mark.parametrize("degree,continuity", SPACES)
def test_panel_is_a_cylinder(degree: int, continuity: int) -> None:
    shape = nurbs.surface(*nurbs.cylinder_panel(2.0, 3.0, -0.4, 0.9, 4, 2, degree, continuity))
    r, r1, r2 = at_gauss(shape)[:, :3].swapaxes(0, 1)
    assert_allclose(np.hypot(r[:, 0], r[:, 2]), 2.0, rtol=1e-14)
    normal = np.cross(r1, r2)
    assert_allclose(
        normal / np.linalg.norm(normal, axis=1)[:, None], r * [0.5, 0.0, 0.5], atol=1e-13
    )


def test_panel_area_and_curvature() -> None:
    """Area radius angle length; n . r,11 / |r,1|^2 = -1 / radius."""
    shape = nurbs.surface(*nurbs.cylinder_panel(2.0, 3.0, -0.4, 0.9, 4, 2))
    table = surface.tabulate(shape, 8)
    values = at_gauss(shape, 8)
    cross = np.cross(values[:, 1], values[:, 2])
    length = np.linalg.norm(cross, axis=1)
    assert_allclose(table.weights.ravel() @ length, 2.0 * 1.3 * 3.0, rtol=1e-14)
    bend = np.einsum("xc,xc->x", cross, values[:, 3]) / length / np.sum(values[:, 1] ** 2, axis=1)
    assert_allclose(bend, -0.5, rtol=1e-12)


def test_refinement_keeps_the_surface() -> None:
    """Spans in two and three, degree 3 x 2 to 5 x 5, continuity 2, uneven weights: the same points."""
    coarse = rational(3, 1)
    patch = coarse.space.patches[""]
    control = coarse.reference[coarse.space.numbers[""]]
    fine = nurbs.surface(*nurbs.refine(patch, control, 2, 3, 5, 2))
    assert len(fine.nodes) == 6 * len(coarse.nodes)
    for xi in np.random.default_rng(4).uniform([0.0, -1.0], [2.0, 0.4], (20, 2)):
        a, b = (nurbs.place(shape, *xi) for shape in (coarse, fine))
        points = [
            surface.sample(s, np.array([p[0]]), np.array([p[1:]])) @ s.reference
            for s, p in ((coarse, a), (fine, b))
        ]
        assert_allclose(points[0], points[1], atol=1e-14)


def test_default_continuity_is_the_highest() -> None:
    assert nurbs.rectangle(1.0, 1.0, 4, 2, 3)[0].shape == (7, 5)
    assert nurbs.rectangle(1.0, 1.0, 4, 2, 3, 1)[0].shape == (10, 6)
    assert nurbs.rectangle(1.0, 1.0, 4, 2, 3, origin=(1.0, 2.0))[1].shape == (7, 5, 2)


# ------------------------------------------------------------------------------------------------------------------- places
def test_named_places() -> None:
    shape = nurbs.surface(*nurbs.rectangle(3.0, 2.0, 3, 2))
    for name, xy in {
        "corner_00": (0, 0),
        "corner_10": (3, 0),
        "corner_01": (0, 2),
        "corner_11": (3, 2),
    }.items():
        cell, xi1, xi2 = shape.points[name]
        assert_allclose(
            (surface.sample(shape, np.array([cell]), np.array([[xi1, xi2]])) @ shape.reference)[
                0, :2
            ],
            xy,
            atol=1e-15,
        )
    for name, (axis, value, cells) in {
        "xi1_min": (0, 0, 2),
        "xi1_max": (0, 3, 2),
        "xi2_min": (1, 0, 3),
        "xi2_max": (1, 2, 3),
    }.items():
        cell, side = shape.edges[name].T
        assert len(cell) == cells
        points = (
            surface.sample(
                shape, cell, surface.side_points(shape.parent, side, np.full(cells, 0.3))
            )
            @ shape.reference
        )
        assert_allclose(points[:, axis], value, atol=1e-15)


def test_place_finds_cell_and_parent_point() -> None:
    shape = halves(2)
    assert nurbs.place(shape, 0.75, 0.3, "right")[0] == 8 + 1 + 2 * 1
    assert_allclose(nurbs.place(shape, 0.75, 0.3, "right")[1:], (0.5, 0.2))
    assert nurbs.place(shape, 1.0, 1.0, "left") == (7, 1.0, 1.0)
    with pytest.raises(
        InputError,
        match=r"expected a patch of \['left', 'right'\], got 'lift'; did you mean 'left'",
    ):
        nurbs.place(shape, 0.5, 0.5, "lift")
    with pytest.raises(
        InputError, match=r"nurbs\.place, xi2: expected parameters in \[0, 1\], got 1\.1"
    ):
        nurbs.place(shape, 0.5, 1.1, "left")


# ---------------------------------------------------------------------------------------------------------------- quadrature
@pytest.mark.parametrize("degree,continuity", [(p, c) for p, c in SPACES if p < 5 and c > 0])
def test_gauss_points_by_degree_are_enough(degree: int, continuity: int) -> None:
    """p points on C1 splines: three rigid motions only, bending and membrane, and frequencies of p
    + 1 points, ever nearer.
    """
    gaps = []
    for n in (2, 4):
        shape = nurbs.surface(*nurbs.rectangle(1.0, 1.0, n, n, degree, continuity))
        assert shape.order == degree
        bending, membrane, mass = matrices(shape)
        for matrix in (bending, membrane):
            values = np.linalg.eigvalsh(matrix)
            assert np.sum(values < 1e-10 * values[-1]) == 3
        full = scipy.linalg.eigvalsh(matrices(shape, degree + 1)[0], mass)[3:6]
        gaps.append(np.abs(scipy.linalg.eigvalsh(bending, mass)[3:6] / full - 1.0).max())
    assert gaps[0] < 4e-3
    assert gaps[1] < gaps[0] / 4.0


@pytest.mark.parametrize(
    "cells,degree,continuity", [((1, 1), 2, 1), ((1, 4), 3, 2), ((3, 3), 2, 0), ((2, 2), 3, 0)]
)
def test_cells_that_stand_alone_take_one_point_more(
    cells: tuple[int, int], degree: int, continuity: int
) -> None:
    shape = nurbs.surface(*nurbs.rectangle(1.0, 1.0, *cells, degree, continuity))
    assert shape.order == degree + 1
    values = np.linalg.eigvalsh(matrices(shape)[1])
    assert np.sum(values < 1e-10 * values[-1]) == 3


def test_free_square_plate() -> None:
    """Leissa, Vibration of Plates (NASA SP-160, 1969), to 0.1 % with 121 functions."""
    shape = nurbs.surface(*nurbs.rectangle(1.0, 1.0, 8, 8))
    assert shape.count == 121
    assert_allclose(frequencies(shape)[3:9], LEISSA, rtol=1e-3)


# -------------------------------------------------------------------------------------------------------------- common edges
def test_two_patches_share_their_edge() -> None:
    shape = halves(2)
    assert shape.count == 2 * 5 * 7 - 7
    assert interfaces.common_edges(shape) == [("left.xi1_max", "right.xi1_min")]
    assert set(shape.faces) == {"left", "right"}
    assert_array_equal(shape.faces["right"], np.arange(8, 16))
    assert_allclose(
        shape.reference[shape.space.numbers["left"][-1]],
        shape.reference[shape.space.numbers["right"][0]],
    )
    check_table(shape)


def test_edges_are_joined_in_every_orientation() -> None:
    """Each of the eight ways to turn and mirror the second patch: one edge in common."""
    patch, control = nurbs.rectangle(1.0, 1.0, 2, 2, 2)
    other = control + RIGHT
    for mirror in (False, True):
        for turn in range(4):
            turned = np.rot90(other.swapaxes(0, 1) if mirror else other, turn)
            shape = nurbs.surface({"a": patch, "b": patch}, {"a": control, "b": turned})
            assert shape.count == 2 * 16 - 4
            (pair,) = interfaces.common_edges(shape)
            common = interfaces.between(shape, *pair)
            assert_allclose((common.normal_a + common.normal_b) @ shape.reference, 0.0, atol=1e-14)
            assert_allclose(
                common.normal_a @ shape.reference,
                np.tile([1.0, 0.0, 0.0], (len(common.weights), 1)),
                atol=1e-14,
            )


def test_four_patches_meet_in_a_point() -> None:
    patch, control = nurbs.rectangle(1.0, 1.0, 1, 1, 2)
    corners = {f"p{i}{j}": control + np.array([i, j, 0.0]) for i in range(2) for j in range(2)}
    shape = nurbs.surface(dict.fromkeys(corners, patch), corners)
    assert shape.count == 25
    assert len(interfaces.common_edges(shape)) == 4


def test_closed_cylinder() -> None:
    """Three panels of 120 degrees: no free edge along the axis."""
    turn = 2.0 * np.pi / 3.0
    panels = {
        f"p{i}": nurbs.cylinder_panel(1.0, 2.0, i * turn, (i + 1) * turn, 4, 3) for i in range(3)
    }
    shape = nurbs.surface(
        {k: p for k, (p, _) in panels.items()}, {k: c for k, (_, c) in panels.items()}
    )
    assert shape.count == 3 * 6 * 6
    assert len(interfaces.common_edges(shape)) == 3
    for pair in interfaces.common_edges(shape):
        common = interfaces.between(shape, *pair)
        assert_allclose(common.weights.sum(), 2.0, rtol=1e-14)
        assert_allclose((common.normal_a + common.normal_b) @ shape.reference, 0.0, atol=1e-13)


def test_unjoined_patches_stay_apart() -> None:
    patch, control = nurbs.rectangle(1.0, 1.0, 2, 2, 2)
    shape = nurbs.surface(
        {"a": patch, "b": patch}, {"a": control, "b": control + RIGHT}, join=False
    )
    assert shape.count == 32
    assert interfaces.common_edges(shape) == []


def test_patch_without_extent_is_not_joined_to_itself() -> None:
    patch, control = nurbs.rectangle(1.0, 1.0, 1, 1, 2)
    assert nurbs.surface(patch, 0.0 * control).count == 9


# --------------------------------------------------------------------------------------------------------------- what is refused
OPEN = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])


@pytest.mark.parametrize(
    "change,message",
    [
        (
            {"degree1": 0},
            r"Patch, direction 1: BSpline\.degree: expected a whole number of at least 1, got 0",
        ),
        (
            {"knots2": OPEN[::-1]},
            r"Patch, direction 2: BSpline\.knots\[3\]: expected a knot of at least 1, got 0; sort the knots",
        ),
        ({"knots1": np.arange(6.0)}, r"Patch\.knots1: expected open knots"),
        (
            {"knots1": np.array([0, 0, 0, np.nan, 1, 1, 1])},
            r"direction 1: BSpline\.knots: expected .* finite numbers",
        ),
        (
            {"weights": np.ones((3, 2))},
            r"Patch\.weights: expected shape \(3, 3\), one for each function, got \(3, 2\)",
        ),
        ({"weights": -np.eye(3)}, r"Patch\.weights\[0, 0\]: expected a positive number, got -1\.0"),
        (
            {"weights": np.full((3, 3), np.inf)},
            r"Patch\.weights\[0, 0\]: expected a positive number, got inf",
        ),
    ],
)
def test_bad_patches(change: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        nurbs.Patch(**({"knots1": OPEN, "knots2": OPEN, "degree1": 2, "degree2": 2} | change))  # type: ignore[arg-type]


def test_bad_control_points() -> None:
    patch, control = nurbs.rectangle(1.0, 1.0, 2, 2)
    with pytest.raises(
        InputError,
        match=r"expected shape \(5, 5, '2 or 3'\), one for each function, got \(4, 5, 3\)",
    ):
        nurbs.surface(patch, control[1:])
    control[2, 2, 0] = np.nan
    with pytest.raises(InputError, match="expected finite numbers, got nan"):
        nurbs.surface(patch, control)
    with pytest.raises(
        InputError, match=r"control points for the patches \['a'\], got \['b'\]; use the same names"
    ):
        nurbs.surface({"a": patch}, {"b": control})
    cubic, quadratic = nurbs.rectangle(1.0, 1.0, 1, 1, 3), nurbs.rectangle(1.0, 1.0, 1, 1, 2)
    with pytest.raises(InputError, match="expected patches of the same degrees and dimension"):
        nurbs.surface({"a": cubic[0], "b": quadratic[0]}, {"a": cubic[1], "b": quadratic[1]})


def test_edges_of_other_functions_are_seams() -> None:
    patch, control = nurbs.rectangle(1.0, 1.0, 2, 2, 2)
    next_to = control + RIGHT
    uneven = np.ones((4, 4))
    uneven[0, 1] = 2.0
    for other in (
        nurbs.Patch(patch.knots1, patch.knots2, 2, 2, uneven),
        nurbs.Patch(patch.knots1, np.array(KNOTS), 2, 2),
    ):
        space = nurbs.surface({"a": patch, "b": other}, {"a": control, "b": next_to}).space
        assert space.joined == ()
        assert [set(pair) for pair in space.seams] == [{"a.xi1_max", "b.xi1_min"}]


def test_proportional_weights_are_joined() -> None:
    patch, control = nurbs.rectangle(1.0, 1.0, 2, 2, 2)
    other = nurbs.Patch(patch.knots1, patch.knots2, 2, 2, np.full((4, 4), 3.0))
    assert nurbs.surface({"a": patch, "b": other}, {"a": control, "b": control + RIGHT}).count == 28


@pytest.mark.parametrize(
    "build,message",
    [
        (lambda: nurbs.rectangle(0.0, 1.0, 1, 1), "expected positive length and width"),
        (
            lambda: nurbs.rectangle(1.0, 1.0, 0, 1),
            "expected a whole number of cells of at least 1, got 0",
        ),
        (
            lambda: nurbs.rectangle(1.0, 1.0, 2, 2, 3, 3),
            "expected a continuity from 0 to degree - 1 = 2, got 3",
        ),
        (
            lambda: nurbs.cylinder_panel(-1.0, 1.0, 0.0, 1.0, 1, 1),
            "expected positive radius and length",
        ),
        (
            lambda: nurbs.cylinder_panel(1.0, 1.0, 0.0, 3.2, 1, 1),
            "expected an opening angle between 0 and pi, got 3.2 rad",
        ),
        (
            lambda: nurbs.cylinder_panel(1.0, 1.0, 0.0, 1.0, 1, 1, 1),
            "expected a degree of at least 2, got 1",
        ),
        (
            lambda: nurbs.refine(*nurbs.rectangle(1.0, 1.0, 1, 1, 3), degree=2),
            "the degree cannot be lowered",
        ),
    ],
)
def test_bad_shapes(build: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        build()  # type: ignore[operator]
