"""Bushings: small oscillations along and about every axis, frames that turn, balance of forces and
energy.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies import Body, rigid
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, outputs, vibration_modes
from fmbs_skfem.reduction import files
from fmbs_skfem.systems import (
    At,
    Motion,
    assemble,
    check_force,
    compile_system,
    compiled,
    eliminate,
)
from fmbs_skfem.systems.forces.bushing import Bushing
from fmbs_skfem.systems.forces.gauges import LoadState
from fmbs_skfem.systems.measures import probes

A, B = At("a", "frame"), At("b", "frame")
K, C, KT, CT = (10.0, 20.0, 30.0), (0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0.01, 0.02, 0.03)


def bodies(dim: int, far: float = 0.0) -> list[Body]:
    inertia: Any = 0.02 if dim == 2 else np.diag([0.02, 0.03, 0.04])
    places = {"a": far + np.array([0.3, 0.2, 0.1]), "b": np.full(3, far)}
    return [rigid.rigid(name, 2.0, inertia, place[:dim], dim=dim) for name, place in places.items()]


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
    return compiled.forces(compile_system(bare), x, still) - compiled.forces(
        compile_system(system), x, still
    )


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.0, 0.0, 3.0), (1.0, -2.0, 0.5)])
def test_the_frame_turns_with_its_body(angles: tuple[float, float, float]) -> None:
    """Both bodies turned by R: no force; then `a` moved by R u: R (- k u), and its opposite with
    its moment on `b`.
    """
    system, R = (
        assemble(bodies(3), loads=[bushing(3)]),
        Rotation.from_euler("xyz", angles).as_matrix(),
    )
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
    """`a` turned by an angle about x, about which nothing resists, then tilted by 1e-6 about y and
    z: moments - kappa_i theta_i.
    """
    kappa, tilt = np.array([0.0, 0.5, 0.6]), np.array([0.0, 1e-6, -2e-6])
    system = assemble(bodies(3), loads=[Bushing("bushing", A, to, torsional_stiffness=kappa)])
    x = system.x0.reshape(-1, 3)
    x[1:4] = x[1:4] @ (Rotation.from_rotvec(tilt) * Rotation.from_euler("x", angle)).as_matrix().T
    moment = np.sum(np.cross(x[1:4], force(system, x.ravel()).reshape(-1, 3)[1:4]), axis=0)
    assert_allclose(moment, -kappa * tilt, atol=1e-11)


def test_frequencies() -> None:
    """A body on a bushing to the ground: sqrt(k / m) along, sqrt(kappa / J) about every axis."""
    found = vibration_modes(
        eliminate(
            assemble(
                bodies(3),
                loads=[bushing(3, None), Bushing("b", B, None, (1e3,) * 3, None, (1e3,) * 3)],
            )
        ),
        6,
    )
    expected = np.sort([*np.sqrt(np.array(K) / 2.0), *np.sqrt(np.array(KT) / [0.02, 0.03, 0.04])])
    assert_allclose(found.angular_frequencies[:6], expected, rtol=1e-6)


@pytest.mark.parametrize("dim", [2, 3])
def test_energy_of_a_motion_with_large_rotations(dim: int) -> None:
    """Two bodies that turn together by more than a turn, and swing on each other without dampers:
    their energy stays.
    """
    turn: Any = (0.6,) if dim == 2 else (KT,)
    load = Bushing("bushing", A, B, K[:dim], None, *turn)
    spin = 4.0 if dim == 2 else (1.0, 2.0, 3.0)
    start = {name: Motion(angular_velocity=spin) for name in ("a", "b")}
    system = eliminate(
        assemble(
            bodies(dim),
            [],
            [load],
            outputs={"E": probes.Energy(), "a": probes.Position(A)},
            initial=start,
        )
    )
    found = outputs(integrate(system, GeneralizedAlpha(1e-3, 1.0), 2.0, Newton(tolerance=1e-12)))
    assert found["E_strain"].max() > 1e-2
    assert np.ptp(found["E_balance"]) < 1e-4 * found["E_kinetic"].max()


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("to", [B, None])
def test_every_axis_is_an_output(to: At | None, dim: int, tmp_path: Path) -> None:
    """A pull k s + c s' along axes that `to` carries, a torque - kt theta - ct theta' about them;
    saved models know them.
    """
    x_axis = np.array((0.6, 0.8, 0.0)[:dim])
    axes = np.array(
        [x_axis, [-0.8, 0.6]] if dim == 2 else [x_axis, (-0.8, 0.6, 0.0), (0.0, 0.0, 1.0)]
    )
    names = [*"xyz"[:dim], *(["about_z"] if dim == 2 else ["about_x", "about_y", "about_z"])]
    spin = 0.4 if dim == 2 else (0.02, -0.01, 0.4)
    system = assemble(
        bodies(dim, 700.0),
        loads=[bushing(dim, to, x_axis=x_axis)],
        outputs={name: LoadState(f"bushing.{name}") for name in names},
        initial={"a": Motion((0.3, -0.2, 0.1)[:dim], spin, (700.0,) * dim)},
    )
    motion = integrate(system, GeneralizedAlpha(2e-3), 0.2)
    files.save(system, tmp_path / "model.h5")
    for found in (
        outputs(motion),
        outputs(replace(motion, system=files.load(tmp_path / "model.h5"))),
    ):
        q = motion.x.reshape(len(motion.x), 2, 1 + dim, dim)
        carried = (
            np.einsum("ij,sjc->sic", axes, q[:, 1, 1:]) if to else np.tile(axes, (len(q), 1, 1))
        )
        away = q[:, 0, 0] - (q[:, 1, 0] if to else q[0, 0, 0])
        free = axes @ (0.3, 0.2, 0.1)[:dim] if to else np.zeros(dim)
        for i, (k, c) in enumerate(zip(K[:dim], C[:dim], strict=True)):
            force, stretch, rate = (
                found[f"{names[i]}_{part}"] for part in ("force", "stretch", "rate")
            )
            assert_allclose(
                stretch, np.einsum("sc,sc->s", carried[:, i], away) - free[i], atol=1e-12
            )
            assert_allclose(force, k * stretch + c * rate, atol=1e-10)
        torque, angle, rate = (found[f"about_z_{part}"] for part in ("torque", "angle", "rate"))
        assert_allclose(torque, -0.6 * angle - 0.03 * rate, atol=1e-10)
        assert np.ptp(angle) > 0.05
    with pytest.raises(
        InputError,
        match=r"output 'B': expected one of the loads that measure bushing.x, .* got 'bushing'",
    ):
        assemble(bodies(dim), loads=[bushing(dim, to)], outputs={"B": LoadState("bushing")})


def test_what_carries_no_frame_is_refused() -> None:
    with pytest.raises(InputError, match=r"bushing.*stiffness: expected numbers >= 0"):
        assemble(bodies(2), loads=[Bushing("bushing", A, None, (-1.0, 0.0))])
