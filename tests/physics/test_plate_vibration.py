"""Natural frequencies of the crank of example 3 in its plane; those of squares and rings are in
`verification.vibration`.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem.bodies import Material
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.dynamics import vibration_modes
from fmbs_skfem.shapes import ancf_plate, plate_meshes
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.systems import assemble

MESHES = Path(__file__).parents[2] / "meshes"


def lug(name: str) -> Surface:
    """The outline of the crank with two holes, rims and ends as arcs."""
    mesh = plate_meshes.read(MESHES / f"{name}.msh", planar=True)
    points = mesh.points[:, :2]
    return ancf_plate.surface(
        points, mesh.cells, ancf_plate.arcs_of(points, mesh.edge_groups), {}, mesh.edge_groups
    )


@cache
def in_plane(name: str) -> tuple[np.ndarray, float]:
    """Six elastic frequencies [rad/s] in the plane and the mass of a lug."""
    body = plate("lug", lug(name), 0.01, Material(70e9, 2700.0, 0.3), dim=2)
    found = vibration_modes(assemble([body]), 9).angular_frequencies
    assert found[:3].max() < 1e-4 * found[3]
    return found[3:], float(body.constant @ body.mass @ body.constant)


def test_lug_with_two_holes() -> None:
    """1422 coordinates against 12 318: 0.03 %."""
    (coarse, coarse_mass), (fine, fine_mass) = (
        in_plane("plate_crank_coarse"),
        in_plane("plate_crank_fine"),
    )
    assert coarse_mass == pytest.approx(fine_mass, rel=2e-8)
    np.testing.assert_allclose(coarse, fine, rtol=3e-4)
    assert (coarse > fine).all()


def test_lug_on_an_unstructured_mesh() -> None:
    """2520 coordinates on gmsh's quads with rims of 16 nodes: 0.05 %, the first two modes and the
    fourth 0.03 %.
    """
    found, fine = in_plane("lug_quad")[0], in_plane("plate_crank_fine")[0]
    np.testing.assert_allclose(found, fine, rtol=5e-4)
    np.testing.assert_allclose(found[[0, 1, 3]], fine[[0, 1, 3]], rtol=3e-4)
