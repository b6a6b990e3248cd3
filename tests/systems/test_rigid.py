"""Rigid bodies: mass properties, places, energies and momenta of rigid motions, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies.rigid import rigid, rigid_from_mesh
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.shapes.plate_meshes import PlateMesh
from fmbs_skfem.systems import At, Motion, assemble, check_system
from fmbs_skfem.systems.assembly import empty_draft
from fmbs_skfem.systems.forces import loads

TURN = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
TENSOR = TURN @ np.diag([0.2, 0.25, 0.3]) @ TURN.T


def energy(part: Any, motion: Motion) -> float:
    """Kinetic energy at the start [J]."""
    system = assemble([part], initial={part.name: motion})
    return float(0.5 * system.v0 @ (system.mass @ system.v0))


@pytest.mark.parametrize("rotation", [np.eye(3), TURN])
def test_kinetic_energy_in_space(rotation: np.ndarray) -> None:
    """T = 1/2 m |v_c|^2 + 1/2 w . J w, with J = R J_body R^T, and v_c = v + w x c."""
    part = rigid("box", 1.5, TENSOR, (0.5, 0.2, -0.3), rotation=rotation)
    v, w = np.array([0.4, -1.0, 2.0]), np.array([0.7, 0.4, -0.5])
    center = v + np.cross(w, [0.5, 0.2, -0.3])
    expected = 0.75 * center @ center + 0.5 * w @ (rotation @ TENSOR @ rotation.T) @ w
    assert energy(part, Motion(tuple(v), tuple(w))) == pytest.approx(expected, rel=1e-13)


def test_kinetic_energy_in_the_plane() -> None:
    part = rigid("box", 1.5, 0.3, (0.5, 0.2), dim=2, rotation=np.array([[0.8, -0.6], [0.6, 0.8]]))
    center = np.array([0.4, -1.0]) + 0.7 * np.array([-0.2, 0.5])
    assert energy(part, Motion((0.4, -1.0), 0.7)) == pytest.approx(
        0.75 * center @ center + 0.15 * 0.49, rel=1e-13
    )


def test_places_are_points_of_the_scene() -> None:
    part = rigid(
        "box", 1.0, (1.0, 1.0, 1.0), (1, 2, 3), rotation=TURN, places={"tip": (4.0, 4.0, 4.0)}
    )
    check_system(assemble([part], loads=[loads.Gravity((0, 0, -9.81))]))
    read = empty_draft([part])[1]
    assert_allclose(read.reference("test", At("box", "tip")), [4, 4, 4], atol=1e-14)
    assert_allclose(read.reference("test", At("box", "center")), [1, 2, 3])
    for k in range(3):
        assert_allclose(read.reference("test", At("box", "tip"), k + 1), TURN[:, k], atol=1e-15)


def test_mesh_of_a_disc_with_a_hole() -> None:
    """Ring of radii 0.1 and 0.3 m, 20 mm thick: m = rho t A, J_z = m (a^2 + b^2) / 2, J_x = J_z / 2
    + m t^2 / 12 (polygon 2e-4).
    """
    count, a, b, t = 240, 0.1, 0.3, 0.02
    angle = 2 * np.pi * np.arange(count) / count
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    inner, outer = np.arange(count), count + np.arange(count)
    cells = np.stack([inner, outer, np.roll(outer, -1), np.roll(inner, -1)], axis=1)
    mesh = PlateMesh(np.concatenate([a * ring, b * ring]), cells, {"rim": np.array([count])})
    mass = 2700.0 * t * np.pi * (b**2 - a**2)
    polar = 0.5 * mass * (a**2 + b**2)
    flat = rigid_from_mesh("disc", mesh, t, 2700.0, dim=2, origin=np.array([1.0, 2.0]))
    assert_allclose(flat.reference[0], [1.0, 2.0], atol=1e-14)
    assert_allclose(
        flat.mass.toarray(), np.diag([mass, polar / 2, polar / 2]), rtol=3e-4, atol=1e-12
    )
    assert_allclose(np.array(flat.places["rim"]), [b, 0.0], atol=1e-14)
    assert flat.outline is not None
    # the hole has as many nodes
    assert_allclose(np.linalg.norm(flat.outline[:, 1:], axis=1), b, rtol=1e-12)
    turned = rigid_from_mesh("disc", mesh, t, 2700.0, rotation=TURN)
    J = TURN @ np.diag([polar / 2 + mass * t**2 / 12] * 2 + [polar]) @ TURN.T
    G = 0.5 * np.trace(J) * np.eye(3) - J
    assert_allclose(turned.mass.toarray()[1:, 1:], G, atol=3e-4 * polar)
    w = TURN[:, 2] * 2.0
    assert energy(turned, Motion(angular_velocity=tuple(w))) == pytest.approx(
        0.5 * polar * 4.0, rel=3e-4
    )


def test_a_slanted_rod_says_its_axes() -> None:
    """A rod along (0.6, 0.8, 0), whose tensor is not diagonal in the axes of the scene."""
    along = np.array([0.6, 0.8, 0.0])
    with pytest.warns(
        Notice, match=r"body 'rod': has no thickness .* are principal: .*\(-?0\.6, -?0\.8, 0\)"
    ):
        rigid("rod", 1.0, 0.1 * (np.eye(3) - np.outer(along, along)), (0, 0, 0))


def test_triangles_have_exact_moments() -> None:
    """A right triangle of legs 3 and 4 m: A = 6 m2, centroid at a third, I_x = b h^3 / 36, I_y = h
    b^3 / 36.
    """
    mesh = PlateMesh(np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]]), np.array([[0, 1, 2]]))
    part = rigid_from_mesh("wedge", mesh, 0.5, 2.0, dim=2)
    assert_allclose(part.reference[0], [1.0, 4.0 / 3.0], rtol=1e-14)
    assert_allclose(
        part.mass.toarray(),
        np.diag([6.0, 0.5 * (5 + 1 / 3 + 3), 0.5 * (5 + 1 / 3 + 3)]),
        rtol=1e-13,
    )


@pytest.mark.parametrize(
    "options, named",
    [
        ({"mass": 0.0}, r"'box'\.mass: expected a positive and finite number"),
        (
            {"inertia": (1.0, 1.0, 2.5)},
            r"'box'\.inertia: expected moments of a body, got principal moments \[1.0, 1.0, 2.5\]",
        ),
        ({"inertia": 1.0}, r"'box'\.inertia: expected 3 principal moments"),
        ({"inertia": (1.0, np.nan, 1.0)}, r"'box'\.inertia: expected finite numbers"),
        ({"inertia": 1.0, "dim": 2, "center": (0, 0, 0)}, "points with 2 finite coordinates"),
        (
            {"inertia": -1.0, "dim": 2, "center": (0, 0)},
            r"'box'\.inertia: expected one positive number in the plane",
        ),
        (
            {"rotation": np.diag([1.0, 1.0, -1.0])},
            r"'box'\.rotation: expected a 3 x 3 rotation matrix",
        ),
        ({"places": {"P": (0.0, 1.0)}}, "points with 3 finite coordinates"),
    ],
)
def test_wrong_bodies_are_named(options: dict[str, Any], named: str) -> None:
    given = {"mass": 1.0, "inertia": (1.0, 1.0, 1.0), "center": (0.0, 0.0, 0.0)} | options
    with pytest.raises(InputError, match=named):
        rigid("box", **given)
