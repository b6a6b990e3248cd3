"""Bushings: small oscillations along and about every axis, frames that turn, balance of forces and energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies import Body, rigid
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, outputs, vibration_modes
from fmbs_skfem.systems import At, Motion, assemble, check_force, compile_system, compiled, eliminate, probes
from fmbs_skfem.systems.bushing import Bushing

A, B = At("a", "frame"), At("b", "frame")
K, C, KT, CT = (10.0, 20.0, 30.0), (0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0.01, 0.02, 0.03)


def bodies(dim: int) -> list[Body]:
    inertia: Any = 0.02 if dim == 2 else np.diag([0.02, 0.03, 0.04])
    return [
        rigid.rigid(name, 2.0, inertia, place[:dim], dim=dim) for name, place in (("a", (0.3, 0.2, 0.1)), ("b", (0.0, 0.0, 0.0)))
    ]


def bushing(dim: int, to: At | None = B, **more: Any) -> Bushing:
    turn: Any = (0.6, 0.03) if dim == 2 else (KT, CT)
    return Bushing("bushing", A, to, K[:dim], C[:dim], *turn, **more)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("to", [B, None])
def test_contract(dim: int, to: At | None) -> None:
    check_force(bodies(dim), bushing(dim, to, x_axis=(0.6, 0.8, 0.0)[:dim]))


def force(system: Any, x: np.ndarray) -> np.ndarray:
    bare = assemble(bodies(system.dim))
    still = np.zeros_like(x)
    return compiled.forces(compile_system(bare), x, still) - compiled.forces(compile_system(system), x, still)


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.0, 0.0, 3.0), (1.0, -2.0, 0.5)])
def test_the_frame_turns_with_its_body(angles: tuple[float, float, float]) -> None:
    """Both bodies turned by R: no force; then `a` moved by R u: R (- k u), and its opposite with its moment on `b`."""
    system, R = assemble(bodies(3), loads=[bushing(3)]), Rotation.from_euler("xyz", angles).as_matrix()
    x = system.x0.reshape(-1, 3) @ R.T
    assert_allclose(force(system, x.ravel()), 0.0, atol=1e-12)
    u = np.array([0.01, -0.02, 0.03])
    x[0] += R @ u  # the centre of a comes first, then its axes
    f = force(system, x.ravel()).reshape(-1, 3)
    assert_allclose(f[0], -R @ (np.array(K) * u), atol=1e-12)
    assert_allclose(f[0] + f[4], 0.0, atol=1e-12)
    for w in np.eye(3):
        assert np.sum(f * np.cross(w, x)) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("to", [B, None])
@pytest.mark.parametrize("angle", [1.0, np.pi / 2, -2.5])
def test_one_angle_may_be_large(to: At | None, angle: float) -> None:
    """`a` turned by an angle about x, about which nothing resists, then tilted by 1e-6 about y and z: moments - kappa_i theta_i."""
    kappa, tilt = np.array([0.0, 0.5, 0.6]), np.array([0.0, 1e-6, -2e-6])
    system = assemble(bodies(3), loads=[Bushing("bushing", A, to, torsional_stiffness=kappa)])
    x = system.x0.reshape(-1, 3)
    x[1:4] = x[1:4] @ (Rotation.from_rotvec(tilt) * Rotation.from_euler("x", angle)).as_matrix().T
    moment = np.sum(np.cross(x[1:4], force(system, x.ravel()).reshape(-1, 3)[1:4]), axis=0)
    assert_allclose(moment, -kappa * tilt, atol=1e-11)


def test_frequencies() -> None:
    """A body on a bushing to the ground: sqrt(k / m) along, sqrt(kappa / J) about every axis."""
    found = vibration_modes(
        eliminate(assemble(bodies(3), loads=[bushing(3, None), Bushing("b", B, None, (1e3,) * 3, None, (1e3,) * 3)])), 6
    )
    expected = np.sort([*np.sqrt(np.array(K) / 2.0), *np.sqrt(np.array(KT) / [0.02, 0.03, 0.04])])
    assert_allclose(found.frequencies[:6], expected, rtol=1e-6)


@pytest.mark.parametrize("dim", [2, 3])
def test_energy_of_a_motion_with_large_rotations(dim: int) -> None:
    """Two bodies that turn together by more than a turn, and swing on each other without dampers: their energy stays."""
    turn: Any = (0.6,) if dim == 2 else (KT,)
    load = Bushing("bushing", A, B, K[:dim], None, *turn)
    spin = 4.0 if dim == 2 else (1.0, 2.0, 3.0)
    start = {name: Motion(angular_velocity=spin) for name in ("a", "b")}
    system = eliminate(assemble(bodies(dim), [], [load], outputs={"E": probes.Energy(), "a": probes.Position(A)}, initial=start))
    found = outputs(integrate(system, GeneralizedAlpha(1e-3, 1.0), 2.0, Newton(tolerance=1e-12)))
    assert found["E_strain"].max() > 1e-2
    assert np.ptp(found["E_balance"]) < 1e-4 * found["E_kinetic"].max()


def test_what_carries_no_frame_is_refused() -> None:
    with pytest.raises(InputError, match=r"bushing.*stiffness: expected numbers >= 0"):
        assemble(bodies(2), loads=[Bushing("bushing", A, None, (-1.0, 0.0))])
