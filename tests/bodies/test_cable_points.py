"""Smooth lines of degree 5 and more take a quadrature point less a cell, and err as with all of
them; others are refused.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.linalg import eigh, eigvalsh

from fmbs_skfem.bodies import Given, Law, cable
from fmbs_skfem.bodies.cable_points import points_of
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs
from fmbs_skfem.dynamics.near_state.linear import linearise
from fmbs_skfem.shapes import line
from fmbs_skfem.shapes.meshes import LineMesh
from fmbs_skfem.systems import assemble, check_system
from verification.statics import circle, pushed, rolled
from verification.vibration import frequencies

from ..models import double_pendulum, polyline, segment
from .test_locking import bent_arc

SMOOTH: dict[str, Any] = {"degree": 5, "continuity": 4}
DEGREES = [{"degree": p, "continuity": p - 1} for p in range(5, 10)]


@pytest.mark.parametrize(
    "space, points",
    [
        (line.uniform(8, 5, 4), 4),
        (line.uniform(2, 9, 8), 8),
        (line.uniform(1, 5, 4), 5),  # four points see four of the five axial strains of a cell
        (line.uniform(8, 5, 3), 5),
        (line.uniform(8, 4, 3), 4),
        (line.uniform(8, 3, 2), 3),
        (line.uniform(8, 2, 1), 2),
        (line.insert_knots(line.uniform(8, 5, 4), np.zeros(13), [0.5])[0], 5),
        (line.BSpline(5, line.uniform(8, 5, 4).knots, np.ones(13)), 5),
        (line.Hermite(np.linspace(0.0, 1.0, 9)), 3),
    ],
)
def test_points_of_spaces(space: line.BSpline | line.Hermite, points: int) -> None:
    assert points_of("", space) == points


def test_mass_and_what_a_step_evaluates() -> None:
    few, all_of_them = (
        cable("beam", segment(8), Given(1e4, 1.0, 1.0), **SMOOTH, points=n) for n in (None, 5)
    )
    assert few.cells is not None
    assert all_of_them.cells is not None
    assert (few.cells.shape[1], all_of_them.cells.shape[1]) == (4, 5)
    assert_array_equal(few.mass.toarray(), all_of_them.mass.toarray())
    check_system(assemble([cable("beam", segment(2), Given(1e4, 1.0, 1.0), dim=2, **SMOOTH)]))


# ------------------------------------------------------------------------------------------------- motions without energy
def lines(cells: int) -> list[LineMesh]:
    """Straight and curved ones, of equal cells and of lengths up to a hundred times those beside
    them.
    """
    uneven = np.concatenate(
        [[0.0], np.cumsum(10.0 ** np.random.default_rng(cells).uniform(-1.0, 1.0, cells))]
    )
    meshes = []
    for s in (np.linspace(0.0, 1.0, cells + 1), uneven / uneven[-1]):
        straight = np.column_stack([s, 0.0 * s, 0.0 * s])
        meshes += [
            polyline(straight),
            polyline(np.column_stack([np.sin(1.5 * s), 1.0 - np.cos(1.5 * s), 0.0 * s])),
        ]
    return meshes


def least_energy(mesh: LineMesh, options: dict[str, Any], EA: float = 1e4) -> float:
    """The smallest elastic energy of a free line over that with a point a cell more, of all but the
    three rigid motions.
    """

    def equations(points: int | None) -> Any:
        return linearise(
            assemble([cable("beam", mesh, Given(EA, 1.0, 1.0), dim=2, points=points, **options)])
        )

    more = equations(options["degree"] + 1)
    squares, shapes = eigh(more.stiffness.toarray(), more.mass.toarray())
    shapes = shapes[:, 3:] / np.sqrt(squares[3:])
    return float(eigvalsh(shapes.T @ equations(None).stiffness.toarray() @ shapes)[0])


@pytest.mark.parametrize("cells", range(1, 41))
def test_only_rigid_motions_are_without_energy(cells: int) -> None:
    """Four points on a cell by itself give 1e-16."""
    for mesh in lines(cells):
        assert least_energy(mesh, SMOOTH) > 1e-2


@pytest.mark.parametrize("options", DEGREES[1:])
@pytest.mark.parametrize("cells", [1, 2, 3, 12])
def test_nor_are_others_of_higher_degree(options: dict[str, Any], cells: int) -> None:
    for mesh in lines(cells):
        assert least_energy(mesh, options) > 1e-2


# ------------------------------------------------------------------------------------------------------------- accuracy
def frequency_error(cells: int, **options: Any) -> float:
    """Of the second frequency of a hinged beam, exactly 4 pi^2."""
    return float(abs(frequencies("pinned-pinned", cells, 2, **options)[1] / (4 * np.pi**2) - 1.0))


def roll_error(cells: int, **options: Any) -> float:
    return float(
        np.linalg.norm(rolled(0.25, 2, Law.EXACT, 1e4, cells, **options) - circle(0.25, 1e4))
    )


def slender_roll_error(cells: int, **options: Any) -> float:
    """A square bar of L/h = 1000."""
    return float(
        np.linalg.norm(rolled(0.25, 2, Law.MATERIAL, 1.2e7, cells, **options) - circle(0.25))
    )


def push_error(cells: int, **options: Any) -> float:
    return float(
        np.linalg.norm(pushed(2.0, cells, 1e4, **options) - pushed(2.0, 40, 1e4, degree=5))
    )


def arc_error(cells: int, **options: Any) -> float:
    """A slender quarter circle, see `test_locking`."""
    return float(abs(bent_arc(cells, 1e8, (1.0, 0.0), **options) - [np.pi / 4, -0.5]).max())


@pytest.mark.parametrize(
    "error, meshes, order",
    [
        (frequency_error, (6, 12), 8),
        (push_error, (4, 8), 8),
        (roll_error, (6, 12), 8),
        (slender_roll_error, (6, 12), None),
        (arc_error, (4, 8), None),
    ],
)
def test_errors_and_orders_are_those_of_all_points(
    error: Callable[..., float], meshes: tuple[int, int], order: int | None
) -> None:
    """Order 2 (p - 1), of Strang and Fix (1973); three points have the order 6 and err by ten times
    as much and more.
    """
    few, full = ([error(n, points=points, **SMOOTH) for n in meshes] for points in (None, 5))
    assert np.all(np.array(few) < 1.2 * np.array(full))
    if order is not None:
        assert np.log2(few[0] / few[1]) == pytest.approx(order, abs=0.9)


@pytest.mark.parametrize("options", DEGREES[1:])
def test_frequencies_of_higher_degrees(options: dict[str, Any]) -> None:
    """Two points less err by 30 times as much at degree 6, where the second mode is a half wave a
    cell.
    """
    assert frequency_error(2, **options) < 1.2 * frequency_error(
        2, points=options["degree"], **options
    )


def test_a_double_pendulum_moves_as_with_all_points() -> None:
    """Its ends over 0.5 s, against 64 cells."""

    def ends(cells: int, points: int | None) -> np.ndarray:
        found = outputs(
            integrate(double_pendulum(cells, points=points, **SMOOTH), GeneralizedAlpha(1e-3), 0.5)
        )
        return np.stack([found[f"{end}_{axis}"] for end in "BC" for axis in "xyz"])

    exact = ends(64, 5)
    few, full = (np.linalg.norm(ends(8, points) - exact) for points in (None, 5))
    assert few < 1.2 * full


# ------------------------------------------------------------------------------------------------------ what is refused
@pytest.mark.parametrize(
    "options, points, message",
    [
        (
            {},
            2,
            r"'beam'\.points: expected a whole .* at least 3 points a cell, as 4 cells have 10 functions, got 2; leave it out",
        ),
        ({"ancf": True}, 2, "at least 3 points a cell"),
        ({"degree": 2}, 1, "at least 2 points a cell"),
        (SMOOTH, 1, "at least 2 points a cell, as 4 cells have 9 functions, got 1"),
        ({}, 0, "at least 3 points a cell, .* got 0"),
        ({}, 3.5, r"a whole number, got 3\.5"),
        (
            {"continuity": 2},
            4,
            r"'beam'\.points: expected 3 points a cell, with which smooth cubics do not lock, got 4; leave it out",
        ),
        ({"continuity": 2}, 2, "expected 3 points a cell"),
    ],
)
def test_points_that_do_not_serve_a_line_are_refused(
    options: dict[str, Any], points: Any, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        cable("beam", segment(4), Given(1e4, 1.0, 1.0), dim=2, points=points, **options)


@pytest.mark.parametrize(
    "options, points", [({}, 4), ({"continuity": 2}, 3), (SMOOTH, 6), (SMOOTH, 3)]
)
def test_others_may_be_chosen(options: dict[str, Any], points: int) -> None:
    part = cable("beam", segment(4), Given(1e4, 1.0, 1.0), dim=2, points=points, **options)
    assert part.cells is not None
    assert part.cells.shape[1] == points
