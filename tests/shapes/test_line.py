"""B-spline, NURBS and Hermite lines: published values, exact geometry, observed orders, refused
input.
"""

from __future__ import annotations

import pickle
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.interpolate import BSpline

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.shapes import knotvector, line, table

HALF = np.sqrt(0.5)
CLAMPED = tuple(space for space in line.REGISTRY if isinstance(space, line.BSpline))
CIRCLE = line.BSpline(
    2, np.array([0, 0, 0, 1, 1, 2, 2, 2.0]), np.array([1.0, HALF, 1.0, HALF, 1.0])
)
HALF_CIRCLE = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, 0.0]])


def _grid(space: line.BSpline | line.Hermite, number: int = 41) -> np.ndarray:
    ends = line.breaks(space)
    return np.linspace(ends[0], ends[-1], number)


# ------------------------------------------------------------------------------------------------------------ evaluation
def test_bezier_values() -> None:
    """One cell: Bernstein polynomials, binomial(3, i) s^i (1 - s)^(3 - i), and their derivatives at
    s = 1/4.
    """
    space = line.uniform(1, 3, 2)
    exact = ([27, 27, 9, 1], [-27, 9, 15, 3], [18, -30, 6, 6], [-6, 18, -18, 6])
    scale = (64, 16, 4, 1)
    for d in range(4):
        assert_allclose(
            line.sample(space, 0.25, d).toarray()[0], np.array(exact[d]) / scale[d], rtol=1e-14
        )


def test_the_nurbs_book_example() -> None:
    """Ex. 2.3: degree 2, knots 0 0 0 1 2 3 4 4 5 5 5, N_{2..4,2}(5/2) = 1/8, 6/8, 1/8, their
    derivatives -1/2, 0, 1/2.
    """
    space = line.BSpline(2, np.array([0, 0, 0, 1, 2, 3, 4, 4, 5, 5, 5.0]))
    assert_allclose(
        line.sample(space, 2.5).toarray()[0], [0, 0, 1 / 8, 6 / 8, 1 / 8, 0, 0, 0], atol=1e-15
    )
    assert_allclose(
        line.sample(space, 2.5, 1).toarray()[0], [0, 0, -1 / 2, 0, 1 / 2, 0, 0, 0], atol=1e-15
    )


@pytest.mark.parametrize("degree", range(5))
def test_functions_are_those_of_scipy(degree: int) -> None:
    """To the bit, with repeated inner knots and at the knots."""
    inner = np.repeat([0.2, 0.5, 0.9], [1, max(degree, 1), 1])
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    xi = np.concatenate([np.linspace(0.0, 1.0, 37), inner])
    expected = BSpline.design_matrix(xi, knots, degree).toarray()
    span = knotvector.spans(degree, knots, xi)
    found = table.rows(
        knotvector.basis(degree, knots, span, xi, 0)[:, 0],
        span[:, None] + np.arange(-degree, 1),
        expected.shape[1],
    )
    assert_array_equal(found.toarray(), expected)


def test_derivative_beyond_the_degree_is_zero() -> None:
    assert line.sample(line.uniform(4, 1, 0), [0.1, 0.6], 2).nnz == 0


def test_third_derivative_of_a_circle() -> None:
    """On a NURBS circle r.r = 1, hence r.r' = 0, r'.r' + r.r'' = 0 and 3 r'.r'' + r.r''' = 0."""
    r = [line.sample(CIRCLE, _grid(CIRCLE), d) @ HALF_CIRCLE for d in range(4)]
    dot = partial(np.einsum, "xc,xc->x")
    assert_allclose(dot(r[0], r[0]), 1.0, rtol=1e-14)
    assert_allclose(dot(r[0], r[1]), 0.0, atol=1e-14)
    assert_allclose(dot(r[1], r[1]) + dot(r[0], r[2]), 0.0, atol=1e-13)
    assert_allclose(3.0 * dot(r[1], r[2]) + dot(r[0], r[3]), 0.0, atol=1e-12)


def test_ends_are_interpolated_and_slightly_outside_is_the_end() -> None:
    space = line.uniform([0.0, 0.3, 1.7])
    for xi, function in ((0.0, 0), (1.7, space.count - 1), (1.7 * (1 + 1e-15), space.count - 1)):
        assert_array_equal(line.sample(space, xi).toarray()[0], np.eye(space.count)[function])


@pytest.mark.parametrize("xi", [-0.01, 1.01, np.nan, np.inf, [0.5, 2.0]])
@pytest.mark.parametrize("space", [line.uniform(3), line.Hermite(np.array([0.0, 1.0]))])
def test_outside_the_domain(space: line.BSpline | line.Hermite, xi: float) -> None:
    with pytest.raises(InputError, match=r"sample: expected parameters in \[0, 1\]"):
        line.sample(space, xi)


@pytest.mark.parametrize("derivative", [-1, 4, 1.5])
def test_unknown_derivative(derivative: int) -> None:
    with pytest.raises(InputError, match=r"sample\.derivative: expected 0, 1, 2 or 3"):
        line.sample(line.uniform(3), 0.5, derivative)


def test_hermite_functions_are_the_textbook_ones() -> None:
    """1 - 3 s^2 + 2 s^3, h (s - 2 s^2 + s^3), 3 s^2 - 2 s^3, h (s^3 - s^2) on a cell of length h."""
    low, h = 0.5, 0.7
    space = line.Hermite(np.array([0.0, low, low + h, 2.0]))
    s = np.linspace(0.0, 0.99, 12)
    shapes = [[1, 0, -3, 2], [0, h, -2 * h, h], [0, 0, 3, -2], [0, 0, -h, h]]
    for d in range(4):
        exact = np.stack(
            [
                np.polynomial.Polynomial(c).deriv(d)(s) if d else np.polynomial.Polynomial(c)(s)
                for c in shapes
            ],
            axis=1,
        )
        found = line.sample(space, low + h * s, d).toarray()
        assert_allclose(found[:, 2:6], exact / h**d, rtol=1e-12, atol=1e-12)
        assert not found[:, [0, 1, 6, 7]].any()


# ----------------------------------------------------------------------------------------------------------------- tables
def test_empty_spans_carry_no_cell() -> None:
    space = line.BSpline(3, np.array([0, 0, 0, 0, 1, 2, 2, 4, 4, 4, 4.0]))
    basis = line.tabulate(space, 3)
    assert basis.values.shape == (3, 3, 3, 4)
    assert_array_equal(basis.nodes[:, 0], [0, 1, 3])
    assert_allclose(basis.weights.sum(axis=1), [1.0, 1.0, 2.0])


def test_cubic_beam_matrices() -> None:
    """Consistent mass and bending stiffness of the cubic beam element; Przemieniecki 1985, ISBN
    978-0-486-64948-1.
    """
    h = 0.4
    basis = line.tabulate(line.Hermite(np.array([1.0, 1.0 + h])))
    mass = np.einsum("p,pb,pd->bd", basis.weights[0], basis.values[0, :, 0], basis.values[0, :, 0])
    bending = np.einsum(
        "p,pb,pd->bd", basis.weights[0], basis.values[0, :, 2], basis.values[0, :, 2]
    )
    rows = [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h]]
    rows += [[54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]
    assert_allclose(mass, h / 420.0 * np.array(rows), rtol=1e-12)
    rows = [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h]]
    rows += [[-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
    assert_allclose(bending, np.array(rows) / h**3, rtol=1e-11)


@pytest.mark.parametrize("points", [1, 2, 5])
def test_gauss_points_are_exact_to_their_degree(points: int) -> None:
    basis = line.tabulate(line.uniform([0.0, 0.2, 1.0]), points)
    for power in range(2 * points):
        assert_allclose(np.sum(basis.weights * basis.points**power), 1.0 / (power + 1), rtol=1e-13)
    assert abs(np.sum(basis.weights * basis.points ** (2 * points)) * (2 * points + 1) - 1.0) > 1e-8


@pytest.mark.parametrize("points", [0, -1, 2.5])
def test_number_of_points(points: int) -> None:
    with pytest.raises(InputError, match=r"tabulate\.points"):
        line.tabulate(line.uniform(2), points)


# -------------------------------------------------------------------------------------------------------------------- fit
@pytest.mark.parametrize("space", line.REGISTRY)
def test_fit_returns_the_coefficients_of_a_curve_in_the_space(
    space: line.BSpline | line.Hermite,
) -> None:
    exact = np.random.default_rng(3).standard_normal((space.count, 2))
    found = line.fit(space, lambda xi, derivative=0: line.sample(space, xi, derivative) @ exact)
    assert_allclose(found, exact, atol=1e-10)


def _helix(xi: np.ndarray, derivative: int = 0) -> np.ndarray:
    quarter = derivative * np.pi / 2.0
    third = (0.5 * xi, np.full_like(xi, 0.5), np.zeros_like(xi))[min(derivative, 2)]
    return np.stack([np.cos(xi + quarter), np.sin(xi + quarter), third], axis=1)


@pytest.mark.parametrize(
    "degree, continuity",
    [(1, 0), (2, 0), (2, 1), (3, 0), (3, 1), (3, 2), (4, 1), (4, 3), (5, 2), (5, 4), (6, 3)],
)
def test_fit_converges_with_the_order_of_the_space(degree: int, continuity: int) -> None:
    errors = []
    for cells in (8, 16):
        space = line.uniform(np.linspace(0.0, 4.0, cells + 1), degree, continuity)
        coefficients = line.fit(space, _helix)
        xi = np.linspace(0.0, 4.0, 1001)
        errors.append(np.max(np.abs(line.sample(space, xi) @ coefficients - _helix(xi))))
        assert_allclose(coefficients[[0, -1]], _helix(np.array([0.0, 4.0])), atol=1e-13)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(degree + 1, abs=0.4)


@pytest.mark.parametrize(
    "curve",
    [lambda xi, d=0: xi, lambda xi, d=0: xi[:2, None], lambda xi, d=0: np.nan * xi[:, None]],
)
def test_fit_refuses_other_than_one_row_a_parameter(curve: table.Curve) -> None:
    for space in (line.uniform(3), line.Hermite(np.array([0.0, 1.0, 2.0]))):
        with pytest.raises(InputError, match=r"fit\.curve: expected finite values"):
            line.fit(space, curve)


# ------------------------------------------------------------------------------------------------------------- refinement
def _points(space: line.BSpline) -> np.ndarray:
    return np.random.default_rng(5).standard_normal((space.count, 3))


def _same_curve(
    old: line.BSpline, before: np.ndarray, new: line.BSpline, after: np.ndarray
) -> None:
    xi = _grid(old, 57)
    for d in range(3):
        exact = line.sample(old, xi, d) @ before
        assert_allclose(
            line.sample(new, xi, d) @ after,
            exact,
            rtol=1e-10,
            atol=1e-12 * max(1.0, np.max(np.abs(exact))),
        )


@pytest.mark.parametrize("space", CLAMPED)
def test_knots_inserted_keep_the_curve(space: line.BSpline) -> None:
    low, high = line.breaks(space)[[0, -1]]
    new = low + (high - low) * np.array([0.51, 0.13, 0.97])
    refined, after = line.insert_knots(space, _points(space), new)
    assert refined.count == space.count + 3
    assert np.isin(new, refined.knots).all()
    _same_curve(space, _points(space), refined, after)
    table.check_table(refined)


@pytest.mark.parametrize("times", [0, 1, 2])
@pytest.mark.parametrize("space", CLAMPED)
def test_elevated_degree_keeps_the_curve(space: line.BSpline, times: int) -> None:
    higher, after = line.elevate(space, _points(space), times)
    assert higher.degree == space.degree + times
    assert_array_equal(line.breaks(higher), line.breaks(space))
    _same_curve(space, _points(space), higher, after)
    table.check_table(higher)


def test_bezier_elevation_and_subdivision_by_hand() -> None:
    """Parabola 0, 1, 0: elevated 0, 2/3, 2/3, 0; cut at the middle 0, 1/2, 1/2, 1/2, 0 (de
    Casteljau).
    """
    space = line.uniform(1, 2, 1)
    assert_allclose(line.elevate(space, [0.0, 1.0, 0.0])[1], [0.0, 2 / 3, 2 / 3, 0.0], rtol=1e-15)
    refined, after = line.insert_knots(space, [0.0, 1.0, 0.0], [0.5, 0.5])
    assert_allclose(after, [0.0, 0.5, 0.5, 0.5, 0.0], rtol=1e-15)
    assert_array_equal(refined.knots, [0, 0, 0, 0.5, 0.5, 1, 1, 1])


def test_refined_circle_stays_a_circle() -> None:
    """Elevation of the quarter circle to degree 3: weights 1, (1 + sqrt 2)/3, (1 + sqrt 2)/3, 1."""
    quarter = line.BSpline(2, np.array([0, 0, 0, 1, 1, 1.0]), np.array([1.0, HALF, 1.0]))
    cubic, _ = line.elevate(quarter, HALF_CIRCLE[:3])
    assert cubic.weights is not None
    assert_allclose(
        cubic.weights,
        [1.0, (1.0 + np.sqrt(2.0)) / 3.0, (1.0 + np.sqrt(2.0)) / 3.0, 1.0],
        rtol=1e-15,
    )
    space, points = line.elevate(CIRCLE, HALF_CIRCLE, 3)
    space, points = line.insert_knots(space, points, np.linspace(0.05, 1.95, 16))
    assert_allclose(
        np.linalg.norm(line.sample(space, _grid(space, 201)) @ points, axis=1), 1.0, rtol=1e-14
    )


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 5), st.lists(st.integers(1, 99), min_size=1, max_size=8, unique=True))
def test_insertion_is_a_convex_combination(degree: int, hundredths: list[int]) -> None:
    """New control points stay in the hull of the old ones, whatever the knots; sums to one on each
    row.
    """
    space = line.uniform(3, degree, degree - 1)
    _, rows = line.insert_knots(space, np.eye(space.count), np.array(hundredths) / 100.0)
    assert rows.min() >= -1e-14
    assert_allclose(rows.sum(axis=1), 1.0, rtol=1e-13)


@pytest.mark.parametrize("new", [[0.0], [1.0], [1.5], [np.nan]])
def test_inserted_knots_lie_inside(new: list[float]) -> None:
    space = line.uniform(3)
    with pytest.raises(InputError, match="insert_knots"):
        line.insert_knots(space, np.zeros(space.count), new)


def test_inserted_knots_keep_the_curve_connected() -> None:
    space = line.uniform(2, 3, 0)
    with pytest.raises(InputError, match=r"inner knot at most 3 times, got 4 times 0\.5"):
        line.insert_knots(space, np.zeros(space.count), [0.5])


def test_refinement_refuses_other_arguments() -> None:
    space = line.uniform(3)
    with pytest.raises(InputError, match=r"elevate\.times"):
        line.elevate(space, np.zeros(space.count), -1)
    with pytest.raises(InputError, match=rf"coefficients: expected shape \({space.count}, c\)"):
        line.elevate(space, np.zeros((space.count + 1, 3)))


# ------------------------------------------------------------------------------------------------- ANCF cable -> C1 cubic
BREAKS = np.array([0.0, 0.2, 0.25, 1.0, 1.9])


def _mass(basis: table.BasisTable) -> np.ndarray:
    rows = table.matrix(basis)
    return (rows.T @ (basis.weights.reshape(-1, 1) * rows.toarray())).astype(float)


def test_the_map_takes_positions_and_slopes_and_mass() -> None:
    spline, cable = line.uniform(BREAKS), line.Hermite(BREAKS)
    to_spline = line.hermite_to_bspline(cable)
    for d in range(2):
        assert_allclose(
            (line.sample(spline, BREAKS, d) @ to_spline).toarray(), np.eye(10)[d::2], atol=1e-13
        )
    assert_allclose(
        to_spline.T @ _mass(line.tabulate(spline)) @ to_spline,
        _mass(line.tabulate(cable)),
        atol=1e-15,
    )
    assert_allclose(line.fit(spline, _helix), to_spline @ line.fit(cable, _helix), atol=1e-13)


# --------------------------------------------------------------------------------------------------------- refused spaces
@pytest.mark.parametrize(
    "degree, knots, weights, message",
    [
        (0, [0, 1], None, r"BSpline\.degree: expected a whole number of at least 1, got 0"),
        (1.5, [0, 0, 1, 1], None, r"BSpline\.degree"),
        (2, [0, 0, 0, 1, 1], None, r"at least 2 \(degree \+ 1\) = 6 knots, got 5"),
        (1, [0, 0, 2, 1, 3, 3], None, r"BSpline\.knots\[3\]: expected a knot of at least 2, got 1"),
        (1, [0, 0, np.nan, 1, 1], None, "finite numbers"),
        (1, [[0, 0], [1, 1]], None, "one-dimensional"),
        (1, ["a", 0, 1, 1], None, "an array of numbers"),
        (2, [0, 0, 0, 1, 1, 1, 2, 2, 2], None, "inner knot at most 2 times, got 3 times 1"),
        (2, [0, 0, 0, 0, 1, 1, 1], None, "end knot at most 3 times, got 4 times 0"),
        (2, [0, 0, 0, 1, 1, 1, 1], None, "end knot at most 3 times, got 4 times 1"),
        (2, [-1, 0, 0, 0, 1, 1, 1], None, "leave out the outer knots"),
        (1, [0, 0, 0.5, 0.5 + 1e-14, 1, 1], None, "make them equal"),
        (2, [0, 0, 0, 1, 1, 1], [1, 1], "expected 3 weights, one for each basis function, got 2"),
        (
            2,
            [0, 0, 0, 1, 1, 1],
            [1, 0, 1],
            r"BSpline\.weights\[1\]: expected a positive weight, got 0",
        ),
        (2, [0, 0, 0, 1, 1, 1], [1, 1, -2], r"BSpline\.weights\[2\]"),
        (2, [0, 0, 0, 1, 1, 1], [1, np.nan, 1], "finite numbers"),
    ],
)
def test_refused_splines(
    degree: int, knots: list[float], weights: list[float] | None, message: str
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        line.BSpline(degree, knots, weights)  # type: ignore[arg-type]
    assert caught.value.exit_code == 3


@pytest.mark.parametrize("breaks", [[0.0], [0.0, 0.0], [0.0, 2.0, 1.0], [0.0, np.nan], []])
def test_refused_breaks(breaks: list[float]) -> None:
    for build in (line.Hermite, line.uniform):
        with pytest.raises(InputError, match="breaks"):
            build(breaks)  # type: ignore[operator]


@pytest.mark.parametrize(
    "arguments, message",
    [
        ((0,), "cells"),
        ((2.5,), "cells"),
        ((3, 3, 3), "continuity"),
        ((3, 3, -1), "continuity"),
        ((3, 3, 0.5), "continuity"),
        ((3, 0, 0), "degree"),
    ],
)
def test_refused_uniform(arguments: tuple[int, ...], message: str) -> None:
    with pytest.raises(InputError, match=rf"uniform\.{message}"):
        line.uniform(*arguments)


def test_spaces_cannot_be_changed_in_place() -> None:
    knots = np.array([0, 0, 1, 1.0])
    space = line.BSpline(1, knots)
    knots[0] = -5.0
    assert space.knots[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        space.knots[0] = 1.0


@pytest.mark.parametrize(
    "degree, continuity, count", [(3, 1, 22), (3, 2, 13), (3, 0, 31), (1, 0, 11), (5, 2, 33)]
)
def test_number_of_functions(degree: int, continuity: int, count: int) -> None:
    """(degree + 1) + (cells - 1) (degree - continuity)."""
    space = line.uniform(10, degree, continuity)
    assert space.count == line.tabulate(space).count == count


def test_equal_spaces_of_few_cells_are_one_and_keep_what_follows_from_them() -> None:
    ends = np.linspace(0.0, 1.3, 8)
    space = line.uniform(ends)
    assert line.uniform(ends.copy()) is space
    assert line.uniform(ends, 3, 2) is not space
    assert line.uniform(np.linspace(0.0, 1.0, line.SHARED + 2)) is not line.uniform(
        np.linspace(0.0, 1.0, line.SHARED + 2)
    )
    assert line.breaks(space) is line.breaks(space)
    for kept in (line.breaks(space), line.functions(space)):
        with pytest.raises(ValueError, match="read-only"):
            kept[0] = 1
    ends[:] = 7.0
    assert_array_equal(line.breaks(space), np.linspace(0.0, 1.3, 8))


def test_a_space_that_keeps_something_can_be_pickled() -> None:
    space = line.uniform(5)
    line.fit(space, lambda xi, derivative=0: np.ones((len(xi), 1)) * (derivative == 0))
    again = pickle.loads(pickle.dumps(space))
    assert_array_equal(again.knots, space.knots)
    assert again.__dict__.keys() == {"degree", "knots", "weights"}


def test_tables_of_one_space_are_shared_and_cannot_be_altered() -> None:
    space = line.uniform(6)
    found, anew = line.gauss_table(space, 3, 2), line.tabulate(space, 3, 2)
    assert line.gauss_table(space, 3, 2) is found
    assert line.gauss_table(space, 4, 2) is not found
    for name in ("values", "nodes", "weights", "points"):
        assert_array_equal(getattr(found, name), getattr(anew, name))
        with pytest.raises(ValueError, match="read-only"):
            getattr(found, name)[0] = 0
    anew.values[:] = 0.0  # that of `tabulate` is the caller's own
    assert found.values.any()
