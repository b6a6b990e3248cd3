"""Gears whose wheels turn far in a step: how much their moment errs, and the warning of it."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

from fmbs_skfem.bodies import rigid
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate, outputs
from fmbs_skfem.systems import At, Motion, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

#: moments of inertia [kg m2] of wheels of 12 and 36 teeth, torque on the small one [N m]
SMALL, LARGE, TORQUE = (
    0.01,
    0.09,
    0.5,
)


def spun(step: float, speed: float, dim: int = 2) -> Trajectory:
    """Two hundred steps from a speed [rad/s] on: the large wheel has J w' / 3 = 0.5 N m / 2 from
    the small one.
    """
    a, b = At("small", "frame"), At("large", "frame")
    spin, back, moment, axis = speed, -speed / 3, TORQUE, {}
    inertias = (SMALL, LARGE)
    if dim == 3:
        spin, back, moment, axis = (
            (0.0, 0.0, speed),
            (0.0, 0.0, -speed / 3),
            (0.0, 0.0, TORQUE),
            {"axis": (0, 0, 1)},
        )
        inertias = tuple(np.diag([J, J, J]) for J in inertias)
    parts = [
        rigid.rigid(at.body, 1.0, J, np.eye(dim)[0] * k, dim=dim)
        for k, (at, J) in enumerate(zip((a, b), inertias, strict=True))
    ]
    held = [
        joints.Revolute("A", a, **axis),
        joints.Revolute("B", b, **axis),
        joints.Gear("teeth", a, b, (12, 36), **axis),
    ]
    begin = {
        "small": Motion(angular_velocity=spin),
        "large": Motion(angular_velocity=back, center=tuple(np.eye(dim)[0])),
    }
    seen = {"moment": probes.Reaction("teeth")}
    system = assemble(parts, held, [loads.Torque("motor", a, moment)], outputs=seen, initial=begin)
    return integrate(
        eliminate(system), GeneralizedAlpha(step, 0.8), 200 * step, Newton(tolerance=1e-11)
    )


def missed(motion: Trajectory) -> float:
    """By which the moment errs when the start is over, where it changes from step to step [N m]."""
    (moment,) = outputs(motion).values()
    return float(abs(moment[-1] + TORQUE / 2))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(("speed", "step"), [(200.0, 1e-3), (2000.0, 5e-5), (2000.0, 2.5e-5)])
def test_moments_of_gears_that_err_are_told(dim: int, speed: float, step: float) -> None:
    with pytest.warns(
        Notice, match="the step is too large for gear 'teeth': its moment is wrong by about"
    ) as told:
        motion = spun(step, speed, dim)
    text = next(str(one.message) for one in told if "gear 'teeth'" in str(one.message))
    found = float(re.search(r"wrong by about (\S+) N m", text)[1])  # type: ignore[index]
    assert found == pytest.approx(missed(motion), rel=0.15)
    assert missed(spun(step / 2, speed, dim)) == pytest.approx(missed(motion) / 8, rel=0.3)


def test_moments_of_gears_that_are_right_are_not() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        assert missed(spun(2e-4, 200.0)) < 0.01 * TORQUE
