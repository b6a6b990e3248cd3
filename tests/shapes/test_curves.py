"""Curves through points: straight stays straight, arcs come out smooth and of fourth order, bad
polylines are refused.
"""

from __future__ import annotations

import pickle
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.shapes import curves, line


def _arc(number: int, angle: float = 2.0) -> np.ndarray:
    phi = np.linspace(0.0, angle, number)
    return np.stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)], axis=1)


def test_straight_points_along_an_axis_are_exact() -> None:
    x = np.array([0.0, 0.1, 0.7, 1.0, 3.0])
    breaks, curve = curves.through(np.stack([x, 0.0 * x], axis=1))
    xi = np.linspace(0.0, 3.0, 23)
    assert_array_equal(breaks, x)
    assert_array_equal(curve(xi, 1), np.tile([1.0, 0.0], (23, 1)))
    assert_array_equal(curve(xi, 2), np.zeros((23, 2)))
    assert_array_equal(curve(breaks[[0, -1]]), [[0.0, 0.0], [3.0, 0.0]])
    assert_allclose(curve(xi)[:, 0], xi, rtol=1e-15)


@pytest.mark.parametrize("origin", [0.0, 1e3, 1e6])
@pytest.mark.parametrize("number", [2, 3, 4, 40])
def test_straight_points_in_any_direction(number: int, origin: float) -> None:
    direction = np.array([1.0, -2.0, 3.0]) / np.sqrt(14.0)
    points = origin + np.outer(np.linspace(0.0, 1.5, number), direction)
    breaks, curve = curves.through(points)
    slopes = curve(breaks, 1)
    assert_array_equal(slopes, np.tile(slopes[0], (number, 1)))
    assert_array_equal(curve(breaks, 2), np.zeros((number, 3)))
    assert_allclose(curve(breaks), points, atol=1e-15 * (1.0 + 10.0 * origin))
    assert np.linalg.norm(slopes[0]) == pytest.approx(1.0, abs=1e-14)


def test_a_line_fitted_to_a_straight_curve_has_no_curvature() -> None:
    breaks, curve = curves.through(np.outer(np.linspace(0.0, 2.0, 11), [0.6, 0.8]))
    space = line.uniform(breaks)
    bend = line.sample(space, np.linspace(0.0, 2.0, 50), 2) @ line.fit(space, curve)
    assert np.max(np.abs(bend)) < 1e-11


@pytest.mark.parametrize("number", [3, 4, 9])
def test_curve_passes_through_the_points_with_chord_length_breaks(number: int) -> None:
    points = _arc(number)
    breaks, curve = curves.through(points)
    assert_allclose(np.diff(breaks), np.linalg.norm(np.diff(points, axis=0), axis=1), rtol=1e-14)
    assert breaks[0] == 0.0
    assert_allclose(curve(breaks), points, atol=1e-15)


def test_three_points_give_the_parabola() -> None:
    with pytest.warns(Notice, match="90 degrees at point 1"):
        breaks, curve = curves.through([[-1.0, 0.0], [0.0, 1.0], [1.0, 0.0]])
    xi = np.linspace(0.0, breaks[-1], 9)
    assert_allclose(
        curve(xi),
        np.stack([xi / np.sqrt(2.0) - 1.0, 1.0 - (xi / np.sqrt(2.0) - 1.0) ** 2], axis=1),
        atol=1e-14,
    )
    assert_allclose(curve(xi, 2), np.tile([0.0, -1.0], (9, 1)), atol=1e-13)


def test_arc_is_met_with_order_four_and_its_curvature_with_order_two() -> None:
    radius, bend = [], []
    for number in (17, 33):
        breaks, curve = curves.through(_arc(number))
        xi = np.linspace(0.0, breaks[-1], 2001)
        r, slope, second = (curve(xi, d) for d in range(3))
        radius.append(np.max(np.abs(np.linalg.norm(r, axis=1) - 1.0)))
        kappa = np.linalg.norm(np.cross(slope, second), axis=1) / np.linalg.norm(slope, axis=1) ** 3
        bend.append(np.max(np.abs(kappa - 1.0)))
    assert np.log2(radius[0] / radius[1]) == pytest.approx(4.0, abs=0.4)
    assert np.log2(bend[0] / bend[1]) == pytest.approx(2.0, abs=0.4)


def test_curve_is_twice_continuously_differentiable() -> None:
    breaks, curve = curves.through(_arc(9))
    inner, step = breaks[1:-1], 1e-9
    for d, bound in ((0, 1e-8), (1, 1e-8), (2, 1e-7)):
        assert_allclose(curve(inner + step, d), curve(inner - step, d), atol=bound)
    assert np.max(np.abs(curve(inner + step, 3) - curve(inner - step, 3))) > 1e-4


def test_curve_lies_in_a_c2_cubic_space() -> None:
    breaks, curve = curves.through(_arc(9))
    space = line.uniform(breaks, 3, 2)
    xi = np.linspace(0.0, breaks[-1], 77)
    for d in range(3):
        assert_allclose(
            line.sample(space, xi, d) @ line.fit(space, curve), curve(xi, d), atol=1e-11
        )


@pytest.mark.parametrize("points", [_arc(9), np.outer([0.0, 1.0], [1.0, 2.0])])
def test_curves_end_at_their_ends_and_can_be_sent_to_workers(points: np.ndarray) -> None:
    breaks, curve = curves.through(points)
    with pytest.raises(InputError, match="curve: expected parameters in"):
        curve(breaks[-1:] + 0.1)
    assert_array_equal(pickle.loads(pickle.dumps(curve))(breaks), curve(breaks))


@pytest.mark.parametrize(
    "points, message",
    [
        ([[0.0, 0.0]], "at least two finite points"),
        ([0.0, 1.0], "at least two finite points"),
        ([[0.0, 0.0], [np.nan, 1.0]], "with NaN or infinity"),
        ([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [2.0, 1.0]], "points 1 and 2 both at"),
        ([[0.0, 0.0], [0.0, 0.0]], "points 0 and 1 both at"),
        ([[0.0, 0.0], [2.0, 0.0], [1.0, 0.0]], "a turn back at point 1"),
    ],
)
def test_refused_polylines(points: list[list[float]], message: str) -> None:
    with pytest.raises(InputError, match=message):
        curves.through(points)


def test_corners_are_noticed_and_arcs_are_not() -> None:
    with pytest.warns(Notice, match="turns by 90 degrees at point 2"):
        curves.through([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        curves.through(_arc(5))
