"""Contours along beams: what a body keeps of its section, and what is between two stations."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies.beams.profiles import profile
from fmbs_skfem.bodies.sections import BeamSection, Circular, Material
from fmbs_skfem.core.errors import InputError

STEEL = Material(210e9, 7850.0, 0.3)


def test_between_two_stations_contours_are_linear() -> None:
    """A circle of twice the diameter: radii are in between, and beyond the ends those of the
    nearest.
    """
    found = profile(
        "b", np.array([0.0, 2.0]), [Circular(d).of_beam(STEEL) for d in (0.01, 0.02)], 1
    )
    stiffness, points, unit = found.at(np.array([-1.0, 0.0, 0.5, 2.0, 3.0]))
    assert_allclose(np.linalg.norm(points, axis=2)[:, 0], [5e-3, 5e-3, 6.25e-3, 1e-2, 1e-2])
    assert_allclose(unit[[0, 3], 0, 0], np.outer([4.0, 1.0], np.ones(64)) / (np.pi * 1e-4))
    assert_allclose(
        stiffness[:, 0, 0], 210e9 * np.pi * 2.5e-5 * np.array([1.0, 1.0, 1.75, 4.0, 4.0])
    )


def test_one_station_serves_all_of_a_line() -> None:
    found = profile("b", np.array([0.3]), [Circular(0.01).of_beam(STEEL)], 0)
    assert_allclose(np.linalg.norm(found.at(np.array([0.0, 5.0]))[1], axis=2), 5e-3)
    assert found.loops == [slice(0, 64)]


def test_matrices_have_no_contour() -> None:
    found = profile("b", np.zeros(1), [BeamSection(np.eye(6), np.eye(3))], 0)
    assert found.points.shape == (1, 0, 2)
    assert_allclose(found.at(np.array([2.0]))[0], np.eye(6)[None])


def test_contours_with_other_points_are_refused() -> None:
    one, two = (
        BeamSection(np.eye(6), np.eye(3), 1.0, (np.zeros((n, 2)),), np.zeros((3, 6, n)), STEEL)
        for n in (4, 6)
    )
    with pytest.raises(InputError, match="same points along the line"):
        profile("b", np.array([0.0, 1.0]), [one, two], 1)
