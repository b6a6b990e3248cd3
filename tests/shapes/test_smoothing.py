"""Standard NURBS circles: knots repeated degree times inside a patch, and sides that meet, tie
slopes exactly.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.shapes import interfaces, nurbs, smoothing, surface
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.shapes.table import check_table

OPEN = np.array([0.0, 0.0, 1.0, 1.0])
QUARTERS = np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]) / 4.0
#: of the nine points of a circle; their weights are 1 / SIZE
SIZE = np.where(np.arange(9) % 2, np.sqrt(2.0), 1.0)


def revolved(
    radii: np.ndarray, heights: np.ndarray, weights: np.ndarray, knots: np.ndarray
) -> tuple[nurbs.Patch, np.ndarray]:
    """A profile turned about z: nine control points, four arcs, along xi1; the profile along xi2."""
    turn = np.arange(9) * np.pi / 4.0
    circle = SIZE[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    control = np.concatenate(
        [circle[:, None, :] * radii[:, None], np.tile(heights[:, None], (9, 1, 1))], axis=2
    )
    return nurbs.Patch(
        QUARTERS, knots, 2, len(knots) - len(radii) - 1, np.outer(1.0 / SIZE, weights)
    ), control


def tube(radius: float = 1.0, length: float = 1.0) -> tuple[nurbs.Patch, np.ndarray]:
    return revolved(np.array([radius, radius]), np.array([0.0, length]), np.ones(2), OPEN)


def annulus(inner: float, outer: float) -> tuple[nurbs.Patch, np.ndarray]:
    return revolved(np.array([inner, outer]), np.zeros(2), np.ones(2), OPEN)


def torus() -> tuple[nurbs.Patch, np.ndarray]:
    """Of radii 3 and 1: both directions are nine-point circles."""
    turn = np.arange(9) * np.pi / 4.0
    return revolved(3.0 + SIZE * np.cos(turn), SIZE * np.sin(turn), 1.0 / SIZE, QUARTERS)


def positions(shape: Surface) -> np.ndarray:
    return np.asarray(
        np.einsum("epkb,ebc->epkc", surface.tabulate(shape).values, shape.reference[shape.nodes])
    )


@pytest.mark.parametrize(
    "patch,join,tied",
    [(tube(), True, 4), (tube(), False, 3), (annulus(6.0, 10.0), False, 3), (torus(), True, 8)],
    ids=["tube", "slit tube", "slit ring", "torus"],
)
@pytest.mark.parametrize("degree,cells", [(2, 1), (3, 2), (4, 1)])
def test_circles_keep_their_shape_and_lose_the_functions_on_their_knots(
    patch: tuple[nurbs.Patch, np.ndarray], join: bool, tied: int, degree: int, cells: int
) -> None:
    """Positions and both derivatives to round-off, at every Gauss point; no line is left along
    which the surface may fold.
    """
    plain = nurbs.surface(*nurbs.refine(*patch, cells, cells, degree), join=join)
    smooth = smoothing.tie_slopes(plain)
    if join:  # the sides of a slit coincide and have no function in common
        check_table(smooth)
    n1, n2 = plain.space.patches[""].shape
    lines = [3 + join, 3 + join if tied == 8 else 0]
    free = [n1 - join - lines[0], n2 - (tied == 8) - lines[1]]
    assert smooth.count == free[0] * free[1]
    assert interfaces.common_edges(smooth) == []
    assert len(interfaces.common_edges(plain)) == tied
    before, after = positions(plain), positions(smooth)
    for k in range(surface.DERIVATIVES):  # of the size of the surface in the parent
        assert_allclose(after[:, :, k], before[:, :, k], atol=1e-11 * np.abs(before).max())
    assert_allclose(nurbs.control_points(smooth, ""), nurbs.control_points(plain, ""), atol=1e-13)


def test_any_motion_of_a_tied_surface_is_smooth() -> None:
    """Outward derivatives of random fields sum to zero across the lines that were tied; before,
    they do not.
    """
    plain = nurbs.surface(*nurbs.refine(*tube(), 2, 2, 3), join=True)
    smooth = smoothing.tie_slopes(plain)
    named = replace(smooth, edges={**smooth.edges, **interfaces.inner_lines(plain)})
    jumps = []
    for shape in (plain, named):
        field = np.random.default_rng(1).standard_normal(shape.count)
        found = [interfaces.between(shape, *pair) for pair in interfaces.common_edges(plain)]
        jumps.append(
            max(float(np.abs((one.normal_a + one.normal_b) @ field).max()) for one in found)
        )
    assert jumps[0] > 1.0
    assert jumps[1] < 1e-12 * jumps[0]


def test_what_other_patches_share_or_what_has_a_kink_is_not_tied() -> None:
    """Two tubes on top of each other share a circle; a profile with a corner has no common
    direction.
    """
    patch, control = tube()
    shape = nurbs.surface(
        {"a": patch, "b": patch},
        {"a": control, "b": control + np.array([0.0, 0.0, 1.0])},
        join=True,
    )
    assert smoothing.tie_slopes(shape) is shape
    assert len(interfaces.common_edges(shape)) == 9
    bent = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0, 1], [2, 0, 2.0]])
    folded = np.stack([bent, bent + np.array([0.0, 1.0, 0.0])], axis=1)
    shape = nurbs.surface(nurbs.Patch(np.array([0, 0, 0, 1, 1, 2, 2, 2.0]), OPEN, 2, 1), folded)
    assert smoothing.tie_slopes(shape) is shape
    assert interfaces.common_edges(shape) == [("xi1 = 1.0-", "xi1 = 1.0+")]


def test_uneven_arcs_are_tied_with_the_ratio_of_their_speeds() -> None:
    """A straight strip in two quadratic arcs of lengths 1 and 3: the middle point divides its
    neighbours as 1 to 3.
    """
    x = np.array([0.0, 0.5, 1.0, 2.5, 4.0])
    control = np.stack(
        [np.column_stack([x, 0 * x, 0 * x]), np.column_stack([x, 0 * x + 1.0, 0 * x])], axis=1
    )
    shape = nurbs.surface(nurbs.Patch(np.array([0, 0, 0, 1, 1, 2, 2, 2.0]), OPEN, 2, 1), control)
    smooth = smoothing.tie_slopes(shape)
    assert smooth.space.ties[""][0] == {2: pytest.approx(0.75)}
    assert smooth.count == 8
