"""Parallel projection: exact pixels, round grids."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fmbs_skfem.results.rendering import camera


@pytest.mark.parametrize(
    ("extent", "cells", "step"), [(2.0, 4, 0.5), (1.0, 5, 0.2), (0.99, 5, 0.1), (1e-3, 4, 2e-4), (70.0, 4, 10.0)]
)
def test_nice_step(extent: float, cells: int, step: float) -> None:
    assert camera.nice_step(extent, cells) == pytest.approx(step, rel=1e-12)


def test_planar_pixels() -> None:
    """A 2 m x 1 m sheet in a 440 x 300 picture with margins 30, 10, 20, 40 lies at 200 pixels a metre."""
    corners = np.array([[0.0, 0.0, 0.0], [2.0, 1.0, 0.0]])
    view = camera.fit(camera.Box(*corners, 0.5), True, (440, 300), (30, 10, 20, 40))
    assert view.metres_per_pixel == pytest.approx(1 / 200)
    np.testing.assert_allclose(camera.project(view, corners), [[30.0, 240.0], [430.0, 40.0]], atol=1e-9)
    np.testing.assert_allclose(view.towards, [0, 0, 1])


def test_isometric_axes_have_equal_lengths() -> None:
    view = camera.fit(camera.Box(np.zeros(3), np.ones(3), 0.5), False, (400, 400), (10, 10, 10, 10))
    pixels = camera.project(view, np.concatenate([np.zeros((1, 3)), np.eye(3)]))
    arms = pixels[1:] - pixels[0]
    np.testing.assert_allclose(np.linalg.norm(arms, axis=1), np.sqrt(2 / 3) / view.metres_per_pixel)
    assert arms[0, 0] > 0
    assert arms[0, 1] > 0
    assert arms[1, 0] > 0
    assert arms[1, 1] < 0
    assert arms[2, 0] == pytest.approx(0)


@example([(1.0, 0.0, 0.0), (1.0, 0.0, 8.5e-158)], False, 2)
@given(st.lists(st.tuples(*[st.floats(-50, 50)] * 3), min_size=1, max_size=6), st.booleans(), st.integers(2, 6))
def test_the_box_holds_all_points_and_the_picture_holds_the_box(rows: list[tuple[float, ...]], flat: bool, cells: int) -> None:
    points = np.array(rows)
    if flat:
        points[:, 2] = 0.0
    box = camera.box(points, flat, cells)
    assert (box.lower <= points.min(axis=0) + 1e-5 * box.step).all()
    assert (box.upper >= points.max(axis=0) - 1e-5 * box.step).all()
    assert box.cells[:2].min() >= 2
    pixels = camera.project(camera.fit(box, flat, (400, 300), (20, 30, 40, 50)), box.corners)
    assert (pixels.min(axis=0) >= [20 - 1e-6, 40 - 1e-6]).all()
    assert (pixels.max(axis=0) <= [370 + 1e-6, 250 + 1e-6]).all()
