"""Parallel projection: exact pixels, round lengths, grids of pages."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fmbs_skfem.core.values.display import SI
from fmbs_skfem.pages import grid
from fmbs_skfem.results.rendering import camera


@pytest.mark.parametrize(
    ("longest", "length"), [(0.5, 0.5), (0.2, 0.2), (0.198, 0.1), (2.5e-4, 2e-4), (17.5, 10.0)]
)
def test_round_lengths(longest: float, length: float) -> None:
    assert camera.round_length(longest) == pytest.approx(length, rel=1e-12)


def test_planar_pixels() -> None:
    """A 2 m x 1 m sheet in a 440 x 300 picture with margins 30, 10, 20, 40 lies at 200 pixels a
    metre.
    """
    corners = np.array([[0.0, 0.0, 0.0], [2.0, 1.0, 0.0]])
    view = camera.fit(corners, True, (440, 300), (30, 10, 20, 40))
    assert view.metres_per_pixel == pytest.approx(1 / 200)
    np.testing.assert_allclose(
        camera.project(view, corners), [[30.0, 240.0], [430.0, 40.0]], atol=1e-9
    )


def test_isometric_axes_have_equal_lengths() -> None:
    view = camera.fit(np.eye(3), False, (400, 400), (10, 10, 10, 10))
    np.testing.assert_allclose(view.axes @ view.axes.T, np.eye(3), atol=1e-15)
    pixels = camera.project(view, np.concatenate([np.zeros((1, 3)), np.eye(3)]))
    arms = pixels[1:] - pixels[0]
    np.testing.assert_allclose(np.linalg.norm(arms, axis=1), np.sqrt(2 / 3) / view.metres_per_pixel)
    assert arms[0, 0] > 0
    assert arms[0, 1] > 0
    assert arms[1, 0] > 0
    assert arms[1, 1] < 0
    assert arms[2, 0] == pytest.approx(0)


@example([(1.0, 0.0, 0.0), (1.0, 0.0, 8.5e-158)], False)
@example([(0.0, 0.0, 0.0)], True)
@given(st.lists(st.tuples(*[st.floats(-50, 50)] * 3), min_size=1, max_size=6), st.booleans())
def test_grids_and_pictures_hold_all_points(rows: list[tuple[float, ...]], flat: bool) -> None:
    points = np.array(rows)
    if flat:
        points[:, 2] = 0.0
    middle, side, box = grid.surround(points, flat, SI)
    half, step = np.array(box["half"]), box["step"]
    assert (np.abs(points - middle) <= half + 1e-5 * step).all()
    assert side == pytest.approx(2.0 * half.max())
    assert (half[: 2 if flat else 3] > 0.99 * step).all()
    pixels = camera.project(camera.fit(points, flat, (400, 300), (20, 30, 40, 50)), points)
    assert (pixels.min(axis=0) >= [20 - 1e-6, 40 - 1e-6]).all()
    assert (pixels.max(axis=0) <= [370 + 1e-6, 250 + 1e-6]).all()
