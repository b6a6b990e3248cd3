"""Every load does the work it should, and its forces have the tangent they should."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.systems import System, assemble, check_system, compile_system, compiled
from fmbs_skfem.systems.forces import loads

from .parts import A1, B0, B1, BOB, beams, every_load

CASES = [
    pytest.param(dim, load, id=f"{dim}-{type(load).__name__}")
    for dim in (2, 3)
    for load in every_load(dim, np.cos)
]


def force(system: System, x: np.ndarray | None = None, time: float = 0.0) -> np.ndarray:
    """Generalised force of the loads alone, (n,)."""
    bare = assemble(beams(system.dim))
    x = system.x0 if x is None else x
    still = np.zeros_like(x)
    return compiled.forces(compile_system(bare), x, still) - compiled.forces(
        compile_system(system), x, still, time
    )


def translation(dim: int, direction: np.ndarray) -> np.ndarray:
    """Virtual displacement of all bodies by `direction`, (n,)."""
    return np.concatenate([np.outer(part.constant, direction[:dim]).ravel() for part in beams(dim)])


def rotation(dim: int, omega: np.ndarray, x: np.ndarray | None = None) -> np.ndarray:
    """Virtual rotation of all bodies about the origin, (n,)."""
    spin = np.array([[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]])[
        :dim, :dim
    ]
    x = np.concatenate([part.reference.ravel() for part in beams(dim)]) if x is None else x
    return (x.reshape(-1, dim) @ spin.T).ravel()


@pytest.mark.parametrize("dim, load", CASES)
def test_contract(dim: int, load: loads.Load) -> None:
    check_system(assemble(beams(dim), loads=[load]))


@pytest.mark.parametrize("dim", [2, 3])
def test_gravity_is_weight(dim: int) -> None:
    """Three beams of 0.5 kg and a point mass of 0.7 kg; two fields add up; the moment is that of
    the centre of mass.
    """
    g = np.array([1.0, -9.81, 2.0])[:dim]
    f = force(
        assemble(beams(dim), loads=[loads.Gravity(tuple(0.25 * g)), loads.Gravity(tuple(0.75 * g))])
    )
    for c in range(dim):
        assert f @ translation(dim, np.eye(3)[c]) == pytest.approx(2.2 * g[c], rel=1e-12)
    centres = 0.5 * np.array([[0.5, 0, 0], [1.5, 0, 0], [1.4, 0.3, 0]]).sum(
        axis=0
    ) + 0.7 * np.array([2.0, 1.0, 0.0])
    torque = np.cross(centres, np.append(g, [0.0] * (3 - dim)))
    assert f @ rotation(dim, np.array([0.0, 0.0, 1.0])) == pytest.approx(torque[2], rel=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_point_force_and_its_history(dim: int) -> None:
    direction = np.array([3.0, 1.0, 2.0])[:dim]
    system = assemble(
        beams(dim), loads=[loads.PointForce("force", BOB, tuple(direction), lambda t: 2.0 * t)]
    )
    for time in (0.0, 0.25, 1.5):
        assert_allclose(force(system, time=time)[-dim:], 2.0 * time * direction, atol=1e-12)
        assert_allclose(force(system, time=time)[:-dim], 0.0, atol=1e-12)


def test_a_follower_turns_with_its_beam() -> None:
    """Tangential 2 N, normal 1.5 N at the tip of a stretched beam turned by R: the resultant is R
    (2, 1.5).
    """
    system = assemble(beams(2), loads=[loads.Follower("follower", A1, (2.0, 1.5))])
    R = np.array([[0.6, -0.8], [0.8, 0.6]])
    x = (1.2 * system.x0.reshape(-1, 2) @ R.T).ravel()
    f = force(system, x)
    resultant = [f @ translation(2, np.eye(3)[c]) for c in range(2)]
    assert_allclose(resultant, R @ [2.0, 1.5], atol=1e-10)


def test_a_follower_in_space_pulls_along_the_slope() -> None:
    system = assemble(beams(3), loads=[loads.Follower("follower", A1, (2.0,))])
    R = Rotation.from_rotvec([0.4, 1.0, -0.3]).as_matrix()
    f = force(system, (0.9 * system.x0.reshape(-1, 3) @ R.T).ravel())
    assert_allclose([f @ translation(3, np.eye(3)[c]) for c in range(3)], 2.0 * R[:, 0], rtol=1e-10)


@pytest.mark.parametrize("stretch", [1.0, 1.3])
def test_a_moment_works_on_the_rotation_normal_to_the_slope(stretch: float) -> None:
    """Power m . omega - (m . t) (t . omega) on a rigid rotation, no resultant force; m . omega in
    the plane.
    """
    m, t, omega = np.array([0.1, -0.2, 0.3]), np.array([1.0, 0.0, 0.0]), np.array([0.7, 0.4, -0.5])
    spatial = assemble(beams(3), loads=[loads.Moment("moment", B0, tuple(m))])
    x = stretch * spatial.x0
    assert force(spatial, x) @ rotation(3, omega, x) == pytest.approx(
        m @ omega - (m @ t) * (t @ omega), rel=1e-10
    )
    planar = assemble(beams(2), loads=[loads.Moment("moment", B1, 0.3)])
    x = stretch * planar.x0
    assert force(planar, x) @ rotation(2, omega, x) == pytest.approx(0.3 * omega[2], rel=1e-10)
    assert_allclose(
        [force(planar, x) @ translation(2, np.eye(3)[c]) for c in range(2)], 0.0, atol=1e-12
    )


@pytest.mark.parametrize(
    "dim, load, named",
    [
        (3, loads.Gravity((0.0, -9.81)), "load 'gravity': expected 3 finite numbers"),
        (
            2,
            loads.PointForce("push", A1, (1.0, 0.0, 0.0)),
            "load 'push': expected 2 finite numbers",
        ),
        (
            2,
            loads.PointForce("push", BOB, (np.inf, 0.0)),
            "load 'push'.force: expected a sequence, in it a finite number",
        ),
        (
            3,
            loads.Follower("gradient", A1, (1.0, 2.0)),
            "load 'gradient': expected 1 finite numbers",
        ),
        (
            2,
            loads.Follower("gradient", BOB, (1.0, 2.0)),
            "body 'bob': expected a body with a slope",
        ),
        (3, loads.Moment("couple", A1, 1.0), "load 'couple': expected 3 finite numbers"),
        (2, "wind", "loads: expected a load, got str"),
    ],
)
def test_wrong_loads_are_named(dim: int, load: Any, named: str) -> None:
    with pytest.raises(InputError, match=named):
        assemble(beams(dim), loads=[load])
