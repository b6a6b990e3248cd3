"""Rigid bodies with joints against exact solutions: a rod, discs, gears, springs, a universal
joint.

Pendulums, tops and the slider-crank are in `verification.rigid`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from verification.rigid import rod, run

GRAVITY = 9.81
Z = (0.0, 0.0, 1.0)


def order(errors: Callable[[float], float], h: float) -> float:
    """Observed order of an error between the steps h and h / 2."""
    return float(np.log2(errors(h) / errors(0.5 * h)))


def test_period_of_a_rod() -> None:
    """Swing from 90 degrees: 2 pi sqrt(2 L / 3 g) times 1.18034059902 (complete elliptic integral
    K(1/2) 2/pi), of second order.
    """
    system = eliminate(
        assemble(
            [rod("rod", (0, 0), (1, 0), 2.0)],
            [joints.Revolute("pin", At("rod", "s"))],
            [loads.Gravity((0, -GRAVITY))],
            outputs={
                "angle": probes.Angle(At("rod", "frame")),
                "rate": probes.AngularVelocity(At("rod", "frame")),
            },
        )
    )
    period = 1.18034059902 * 2 * np.pi * np.sqrt(2 / (3 * GRAVITY))

    def error(h: float) -> float:
        found = run(system, period / round(period / h), period)
        return float(np.hypot(found["angle"][-1], found["rate"][-1]))

    assert error(1e-3) < 1e-3
    assert 1.9 < order(error, 4e-3) < 2.1
    found = run(system, period / 1000, 3 * period, every=250)
    assert_allclose(
        found["angle"], -np.pi / 2 + np.pi / 2 * np.array([1, 0, -1, 0] * 3 + [1]), atol=1e-3
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_a_torque_on_a_free_disc(dim: int) -> None:
    """angle = M t^2 / (2 J), rate = M t / J, from a step of the torque at t = 0, over several
    turns.
    """
    disc = rigid("disc", 2.0, 0.3 if dim == 2 else (0.2, 0.25, 0.3), (0.0,) * dim, dim=dim)
    at, axis = At("disc", "frame"), None if dim == 2 else Z
    torque = loads.Moment("torque", at, 2.0 if dim == 2 else (0.0, 0.0, 2.0))
    sensed = {"angle": probes.Angle(at, axis), "rate": probes.AngularVelocity(at, axis)}
    system = assemble([disc], [], [torque], outputs=sensed)

    def error(h: float) -> float:
        found, times = run(system, h, 3.0, every=round(0.1 / h)), 0.1 * np.arange(31)
        assert found["angle"][-1] > 4 * 2 * np.pi
        return float(
            max(
                np.abs(found["angle"] - times**2 / 0.3).max(),
                np.abs(found["rate"] - 2 * times / 0.3).max(),
            )
        )

    assert error(5e-4) < 1e-3
    assert 1.9 < order(error, 2e-3) < 2.1


def test_torsional_oscillator() -> None:
    """J theta'' + d theta' + k (theta - theta0) = 0 from rest at the angle 0."""
    J, k, d, rest = 0.3, 12.0, 0.2, 0.8
    disc = rigid("disc", 2.0, J, (0, 0), dim=2)
    at = At("disc", "frame")
    spring = loads.TorsionSpring("spring", at, None, k, d, rest)
    system = eliminate(
        assemble(
            [disc], [joints.Revolute("pin", at)], [spring], outputs={"angle": probes.Angle(at)}
        ),
    )
    decay, rate = d / (2 * J), np.sqrt(k / J - (d / (2 * J)) ** 2)

    def error(h: float) -> float:
        t = h * np.arange(round(2.0 / h) + 1)
        exact = rest - rest * np.exp(-decay * t) * (
            np.cos(rate * t) + decay / rate * np.sin(rate * t)
        )
        return float(np.abs(run(system, h, 2.0)["angle"] - exact).max())

    assert error(1e-3) < 1e-4
    assert 1.9 < order(error, 4e-3) < 2.1


@pytest.mark.parametrize("dim", [2, 3])
def test_gears_share_a_torque(dim: int) -> None:
    """20 and 50 teeth: J1 + (20/50)^2 J2 resists the torque on the first wheel; the second turns
    back at 0.4 of its angle.
    """
    axis = {} if dim == 2 else {"axis": Z}
    moments = (lambda J: J) if dim == 2 else (lambda J: (0.6 * J, 0.6 * J, J))
    wheels = [
        rigid(name, 1.0, moments(J), (x, 0.0, 0.0)[:dim], dim=dim)
        for name, J, x in (("a", 0.1, 0.0), ("b", 0.4, 1.0))
    ]
    a, b = At("a", "frame"), At("b", "frame")
    pins = [
        joints.Revolute("A", a, **axis),
        joints.Revolute("B", b, **axis),
        joints.Gear("gear", a, b, (20, 50), **axis),
    ]
    torque = loads.Moment("torque", a, 0.5 if dim == 2 else (0.0, 0.0, 0.5))
    sensed = {
        "first": probes.Angle(a, **axis),
        "second": probes.Angle(b, **axis),
        "E": probes.Energy(),
    }
    trajectory = integrate(
        eliminate(assemble(wheels, pins, [torque], outputs=sensed)),
        GeneralizedAlpha(1e-3),
        3.0,
        every=30,
    )
    found = outputs(trajectory)
    assert_allclose(found["first"], 0.5 * 0.5 / (0.1 + 0.16 * 0.4) * trajectory.times**2, atol=2e-3)
    assert found["first"][-1] > 2 * 2 * np.pi
    assert_allclose(found["second"], -0.4 * found["first"], atol=1e-8)


def test_universal_joint() -> None:
    """Shafts at 30 degrees: tan(second) = tan(first) / cos 30 when the first drives with its fork
    in the plane of the shafts.
    """
    bend = np.radians(30.0)
    out = np.array([np.cos(bend), np.sin(bend), 0.0])
    cross = np.array([-np.sin(bend), np.cos(bend), 0.0])
    shafts = [rigid("in", 1.0, (1e-2,) * 3, (0, 0, 0)), rigid("out", 1.0, (1e-2,) * 3, (0, 0, 0))]
    a, b = At("in", "frame"), At("out", "frame")
    held = [
        joints.Revolute("bearing", a, None, (1, 0, 0)),
        joints.Cylindrical("support", b, tuple(out)),
        joints.Universal("cross", a, Z, tuple(cross), b),
        joints.DrivenAngle("drive", a, lambda t: t**2, (1, 0, 0)),
    ]
    sensed = {"first": probes.Angle(a, (1, 0, 0)), "second": probes.Angle(b, tuple(out))}
    with pytest.warns(Notice, match=r"redundant .*cross"):
        system = eliminate(assemble(shafts, held, outputs=sensed))
    found = run(system, 5e-3, 2.0)
    exact = np.arctan2(np.sin(found["first"]) * np.cos(bend), np.cos(found["first"]))
    assert_allclose(found["first"], (5e-3 * np.arange(401)) ** 2, atol=1e-9)
    assert_allclose(np.unwrap(exact), found["second"], atol=1e-9)
