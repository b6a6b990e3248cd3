"""Natural frequencies of plates: free, clamped and cantilever squares, and the crank of example 3 in its plane.

Squares: omega a^2 sqrt(rho t/D), nu = 0.3; Leissa, J. Sound Vib. 31 (1973) 257-293, doi 10.1016/S0022-460X(73)80371-2, with the
digits of converged Ritz series (recomputed; Leissa's upper bounds are 0.01 to 1 % larger).
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
from fmbs_skfem.systems import assemble, eliminate, joints

from ..bodies.test_plate import rectangle, ring

MESHES = Path(__file__).parents[2] / "meshes"
FREE = np.array([13.468197, 19.596137, 24.270201, 34.800889, 34.800891, 61.093234])
CLAMPED = np.array([35.985191, 73.393846, 73.393846, 108.2165, 131.58077, 132.20479])
CANTILEVER = np.array([3.471005, 8.506202, 21.28392, 27.19869, 30.95424, 54.18368])
THIN = 1e-3  #: t/a, at which rotary inertia and membrane motions play no part
ALL = ("left", "right", "bottom", "top")


def frequencies(kind: str, cells: int, count: int, clamped: tuple[str, ...] = (), t: float = THIN) -> np.ndarray:
    """omega a^2 sqrt(rho t/D) of a unit square."""
    body = plate("plate", rectangle(kind, cells, cells), t, Material(1.0, 1.0, 0.3))
    held = [joints.Edge("clamp", "plate", clamped, slope="z")] if clamped else []
    system = eliminate(assemble([body], held))
    return vibration_modes(system, count).frequencies * np.sqrt(12 * (1 - 0.3**2)) / t


REGULAR = [("ancf", 20), ("nurbs", 8), ("bfs", 8), ("argyris", 4)]


@pytest.mark.parametrize("kind,cells", REGULAR)
def test_free_square_plate(kind: str, cells: int) -> None:
    found = frequencies(kind, cells, 12)
    assert found[:6].max() < 1e-2  # rigid motions
    np.testing.assert_allclose(found[6:], FREE, rtol=1e-3)


@pytest.mark.parametrize("kind,cells", REGULAR)
def test_cantilever_plate(kind: str, cells: int) -> None:
    np.testing.assert_allclose(frequencies(kind, cells, 5, ("left",)), CANTILEVER[:5], rtol=1e-3)


@pytest.mark.parametrize("kind,cells", [("nurbs", 12), ("bfs", 12), ("argyris", 6)])
def test_clamped_square_plate(kind: str, cells: int) -> None:
    np.testing.assert_allclose(frequencies(kind, cells, 6, ALL), CLAMPED, rtol=1e-3)


@pytest.mark.parametrize("kind,cells", REGULAR)
def test_thickness_does_not_lock(kind: str, cells: int) -> None:
    """omega is proportional to t down to t/a = 1e-4."""
    thick, thin = (frequencies(kind, cells, 2, ("left",), t) for t in (1e-2, 1e-4))
    np.testing.assert_allclose(thin, thick, rtol=1e-7)


@pytest.mark.parametrize("kind,cells,order", [("ancf", 8, 2), ("nurbs", 6, 4), ("bfs", 4, 4)])
def test_order_of_the_mesh(kind: str, cells: int, order: int) -> None:
    """The third frequency of the free plate: order 2 with slopes that agree at nodes only, 2 (p - 1) with C1 cubics."""
    coarse, fine = (frequencies(kind, n, 9)[8] / FREE[2] - 1 for n in (cells, 2 * cells))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.3)


def lug(name: str) -> Surface:
    """The outline of the crank with two holes, rims and ends as arcs."""
    mesh = plate_meshes.read(MESHES / f"{name}.msh", planar=True)
    points = mesh.points[:, :2]
    return ancf_plate.surface(points, mesh.cells, ancf_plate.arcs_of(points, mesh.edge_groups), {}, mesh.edge_groups)


@cache
def in_plane(name: str) -> tuple[np.ndarray, float]:
    """Six elastic frequencies [rad/s] in the plane and the mass of a lug."""
    body = plate("lug", lug(name), 0.01, Material(70e9, 2700.0, 0.3), dim=2)
    found = vibration_modes(assemble([body]), 9).frequencies
    assert found[:3].max() < 1e-4 * found[3]
    return found[3:], float(body.constant @ body.mass @ body.constant)


def test_lug_with_two_holes() -> None:
    """1422 coordinates against 12 318: 0.03 %."""
    (coarse, coarse_mass), (fine, fine_mass) = in_plane("plate_crank_coarse"), in_plane("plate_crank_fine")
    assert coarse_mass == pytest.approx(fine_mass, rel=2e-8)
    np.testing.assert_allclose(coarse, fine, rtol=3e-4)
    assert (coarse > fine).all()


def test_lug_on_an_unstructured_mesh() -> None:
    """2520 coordinates on gmsh's quads with rims of 16 nodes: 0.05 %, the first two modes and the fourth 0.03 %."""
    found, fine = in_plane("lug_quad")[0], in_plane("plate_crank_fine")[0]
    np.testing.assert_allclose(found, fine, rtol=5e-4)
    np.testing.assert_allclose(found[[0, 1, 3]], fine[[0, 1, 3]], rtol=3e-4)


def breathing(cells: int) -> float:
    """Frequency [rad/s] of the mode of a thin free ring in which its radius changes."""
    t, width, E, rho = 0.01, 0.01, 70e9, 2700.0
    body = plate("ring", ring(1.0 - width / 2, 1.0 + width / 2, cells, 1), t, Material(E, rho, 0.0), dim=2)
    found = vibration_modes(assemble([body]), 40)
    x = body.reference[::3] / np.linalg.norm(body.reference[::3], axis=1, keepdims=True)
    radial = np.einsum("nc,ncr->r", x, found.shapes.reshape(-1, 3, 2, 40)[:, 0])
    return float(found.frequencies[np.argmax(np.abs(radial))])


def test_breathing_ring() -> None:
    """A thin ring breathes with omega = sqrt(E/rho)/R, up to (width/R)^2/12 (Love, Mathematical Theory of Elasticity, 1927)."""
    assert breathing(48) == pytest.approx(np.sqrt(70e9 / 2700.0), rel=2e-5)
