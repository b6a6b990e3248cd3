"""Plates in motion: start, large rotations with re-used factors; what free plates conserve is in
`verification.plates`.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem.bodies import Body, Material
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate, outputs
from fmbs_skfem.systems import At, Motion, assemble, compile_system
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.measures import probes

from ..bodies.test_plate import KINDS, rectangle, ring


def thrown(kind: str) -> Body:
    return plate("plate", rectangle(kind, 3, 3, 1.0, 0.5), 0.02, Material(2e9, 1000.0, 0.3))


@pytest.mark.parametrize("kind", KINDS)
def test_rigid_start(kind: str) -> None:
    """The initial field v + omega x r has the kinetic energy m v^2/2 + omega . J omega/2 about the
    origin, v . (omega x S).
    """
    v, omega = np.array([1.0, -2.0, 0.5]), np.array([8.0, 1.0, 20.0])
    system = assemble([thrown(kind)], initial={"plate": Motion(tuple(v), tuple(omega))})
    x, w = np.polynomial.legendre.leggauss(4)
    X, Y = np.meshgrid(0.5 + 0.5 * x, 0.25 + 0.25 * x, indexing="ij")
    field = v + np.cross(omega, np.stack([X, Y, 0 * X], axis=-1))
    exact = 0.5 * 1000.0 * 0.02 * np.einsum("i,j,ijc,ijc->", 0.5 * w, 0.25 * w, field, field)
    assert 0.5 * system.v0 @ system.mass @ system.v0 == pytest.approx(exact, rel=1e-12)


def flywheel(h: float, steps: int, newton: Newton) -> Trajectory:
    """A planar ring on a rigid hub that is pinned beside its middle, spun at 200 rad/s about the
    pin.
    """
    rims = {"hub": Rim(("inner",), center=(0.05, 0.0))}
    body = plate(
        "plate", ring(0.1, 0.5, 20, 5), 0.01, Material(7e10, 2700.0, 0.3), dim=2, rims=rims
    )
    hub, spin = At("plate", "hub"), {"plate": Motion((0.0, -10.0), 200.0)}
    system = assemble(
        [body], [joints.Pin("pin", hub)], outputs={"hub": probes.Slope(hub)}, initial=spin
    )
    return integrate(system, GeneralizedAlpha(h, 0.8), h * steps, newton, every=steps // 20)


def test_large_rotation_with_one_factorisation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three turns with factors that turn with the plate: one factorisation, the motion of the band
    to 1e-9 of the norm of q.

    The band has factors of every step: velocities settle on the joints in their directions, which
    old ones do not turn.
    """
    h, steps = 2e-4, 480
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 40)
    large = flywheel(h, steps, Newton(1e-13))
    assert compile_system(large.system).pattern is not None
    assert large.statistics.factorisations <= 2
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 10_000)
    whole = flywheel(h, steps, Newton(1e-13, slow=1e-12))
    assert compile_system(whole.system).pattern is None
    np.testing.assert_allclose(
        large.x, whole.x, rtol=0, atol=1e-9 * np.linalg.norm(large.system.x0)
    )
    found = outputs(large)
    turned = np.unwrap(np.arctan2(found["hub_y"], found["hub_x"]))[-1]
    assert turned == pytest.approx(200.0 * h * steps, rel=1e-2)
