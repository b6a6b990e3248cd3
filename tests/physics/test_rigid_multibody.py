"""Rigid bodies with joints against exact solutions: pendulums, heavy top, slider-crank, gears, springs, a universal joint."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Body
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, energy_drift, integrate, outputs
from fmbs_skfem.systems import At, Motion, System, assemble, eliminate, joints, loads, probes

GRAVITY = 9.81
Z = (0.0, 0.0, 1.0)


def rod(name: str, start: Sequence[float], end: Sequence[float], mass: float, dim: int = 2) -> Body:
    """Uniform rod with the places `s` and `e`; in space an axis of revolution with a tenth of the moment about the others."""
    a, b = np.array(start, dtype=float), np.array(end, dtype=float)
    u, inertia = (b - a) / np.linalg.norm(b - a), mass * float((b - a) @ (b - a)) / 12
    turn = np.eye(dim)
    turn[:2, :2] = [[u[0], -u[1]], [u[1], u[0]]]
    rest = (0.0,) * (dim - 2)
    moments = inertia if dim == 2 else np.array([0.1 * inertia, inertia, inertia])
    places = {"s": (*a, *rest), "e": (*b, *rest)}
    return rigid(name, mass, moments, (*(a + b) / 2, *rest), dim=dim, rotation=turn, places=places)


def run(system: System, h: float, duration: float, rho: float = 0.8, every: int = 1) -> dict[str, np.ndarray]:
    return outputs(integrate(system, GeneralizedAlpha(h, rho), duration, every=every))


def order(errors: Callable[[float], float], h: float) -> float:
    """Observed order of an error between the steps h and h / 2."""
    return float(np.log2(errors(h) / errors(0.5 * h)))


def test_period_of_a_rod() -> None:
    """Swing from 90 degrees: 2 pi sqrt(2 L / 3 g) times 1.18034059902 (complete elliptic integral K(1/2) 2/pi), of second order."""
    system = eliminate(
        assemble(
            [rod("rod", (0, 0), (1, 0), 2.0)],
            [joints.Revolute("pin", At("rod", "s"))],
            [loads.Gravity((0, -GRAVITY))],
            outputs={"angle": probes.Angle(At("rod", "frame")), "rate": probes.AngularVelocity(At("rod", "frame"))},
        )
    )
    period = 1.18034059902 * 2 * np.pi * np.sqrt(2 / (3 * GRAVITY))

    def error(h: float) -> float:
        found = run(system, period / round(period / h), period)
        return float(np.hypot(found["angle"][-1], found["rate"][-1]))

    assert error(1e-3) < 1e-3
    assert 1.9 < order(error, 4e-3) < 2.1
    found = run(system, period / 1000, 3 * period, every=250)
    assert_allclose(found["angle"], -np.pi / 2 + np.pi / 2 * np.array([1, 0, -1, 0] * 3 + [1]), atol=1e-3)


def test_double_pendulum_of_rods() -> None:
    """Two rods of 1 kg and 1 m from the horizontal: tips at 0.5 s and 1 s (integration to 1e-12 in minimal coordinates)."""
    exact = {0.5: (0.433292317695, -0.901253442394, 1.29668853623, -1.40577992319)}
    exact[1.0] = (-0.934807350144, -0.355155202857, -1.66211513582, -1.04146663719)
    system = eliminate(
        assemble(
            [rod("a", (0, 0), (1, 0), 1.0), rod("b", (1, 0), (2, 0), 1.0)],
            [joints.Revolute("A", At("a", "s")), joints.Revolute("B", At("a", "e"), At("b", "s"))],
            [loads.Gravity((0, -GRAVITY))],
            outputs={"B": probes.Position(At("a", "e")), "C": probes.Position(At("b", "e"))},
        )
    )

    def error(h: float) -> float:
        found = run(system, h, 1.0, every=round(0.5 / h))
        columns = np.array([found[key] for key in ("B_x", "B_y", "C_x", "C_y")])
        return float(max(np.abs(columns[:, k + 1] - exact[t]).max() for k, t in enumerate((0.5, 1.0))))

    assert error(5e-4) < 1e-4
    assert 1.9 < order(error, 2e-3) < 2.1


def test_heavy_top() -> None:
    """Bruls, Cardona, J. Comput. Nonlinear Dyn. 5 (2010) 031002, doi:10.1115/1.4001370: 15 kg, 150 rad/s, centre at 0.2 s."""
    top = rigid("top", 15.0, (0.234375, 0.46875, 0.234375), (0, 1, 0), places={"foot": (0, 0, 0)})
    system = eliminate(
        assemble(
            [top],
            [joints.Spherical("foot", At("top", "foot"))],
            [loads.Gravity((0, 0, -GRAVITY))],
            outputs={"c": probes.Position(At("top", "center"))},
            initial={"top": Motion(angular_velocity=(0, 150, -4.61538))},
        )
    )
    exact = np.array([0.605550561377, 0.598957681795, -0.52398302743])

    def error(h: float) -> float:
        found = run(system, h, 0.2, 0.9)
        return float(np.linalg.norm([found[f"c_{axis}"][-1] for axis in "xyz"] - exact))

    assert error(2e-4) < 1e-2
    assert 1.8 < order(error, 4e-4) < 2.2


def slider_crank(drive: list[joints.Joint], forces: list[Any], start: float = 0.0, spin: float = 0.0) -> System:
    """Crank of 0.15 m, rod of 0.3 m, slider of 0.5 kg on the x-axis; outputs x, phi, energy."""
    pin = 0.15 * np.array([np.cos(start), np.sin(start)])
    end = np.array([pin[0] + np.sqrt(0.09 - pin[1] ** 2), 0.0])
    block = rigid("block", 0.5, 1e-3, end, dim=2)
    rest = {
        "block": Motion((-0.15 * spin * (np.sin(start) + np.sin(start) * np.cos(start) / np.sqrt(4 - np.sin(start) ** 2)), 0.0))
    }
    system = assemble(
        [rod("crank", (0, 0), pin, 0.4), rod("rod", pin, end, 0.8), block],
        [
            joints.Revolute("A", At("crank", "s")),
            joints.Revolute("B", At("crank", "e"), At("rod", "s")),
            joints.Revolute("C", At("rod", "e"), At("block", "center")),
            joints.Prismatic("guide", At("block", "center"), (1, 0)),
            *drive,
        ],
        forces,
        outputs={"C": probes.Position(At("block", "frame")), "phi": probes.Angle(At("crank", "frame"))},
        initial=rest if spin else None,
    )
    return eliminate(system)


def test_driven_slider_crank() -> None:
    """x = r cos phi + sqrt(l^2 - r^2 sin^2 phi) at every step of two turns at 150 rad/s, through both dead centres."""
    system = slider_crank([joints.DrivenAngle("drive", At("crank", "frame"), lambda t: 150 * t)], [])
    with pytest.warns(Notice, match="initial velocities are projected"):
        found = run(system, 2 * np.pi / 150 / 240, 4 * np.pi / 150)
    phi = 150 * np.arange(481) * 2 * np.pi / 150 / 240
    assert_allclose(found["phi"], phi, atol=1e-9)
    assert_allclose(found["C_x"], 0.15 * np.cos(phi) + np.sqrt(0.09 - 0.0225 * np.sin(phi) ** 2), atol=1e-9)


def test_free_slider_crank_passes_dead_centre() -> None:
    """Torque of 5 N m from rest at dead centre: the work 5 phi is the kinetic energy over several turns."""
    system = slider_crank([], [loads.Moment("torque", At("crank", "frame"), 5.0)])
    trajectory = integrate(system, GeneralizedAlpha(1e-4), 0.4)
    phi = outputs(trajectory)["phi"]
    kinetic = 0.5 * np.einsum("sn,sn->s", trajectory.v, (system.mass @ trajectory.v.T).T)
    assert phi[-1] > 6 * np.pi
    assert np.diff(phi).min() > 0
    assert_allclose(kinetic, 5.0 * phi, atol=2e-3 * kinetic[-1])


@pytest.mark.parametrize("dim", [2, 3])
def test_a_torque_on_a_free_disc(dim: int) -> None:
    """angle = M t^2 / (2 J), rate = M t / J, from a step of the torque at t = 0, over several turns."""
    disc = rigid("disc", 2.0, 0.3 if dim == 2 else (0.2, 0.25, 0.3), (0.0,) * dim, dim=dim)
    at, axis = At("disc", "frame"), None if dim == 2 else Z
    torque = loads.Moment("torque", at, 2.0 if dim == 2 else (0.0, 0.0, 2.0))
    sensed = {"angle": probes.Angle(at, axis), "rate": probes.AngularVelocity(at, axis)}
    system = assemble([disc], [], [torque], outputs=sensed)

    def error(h: float) -> float:
        found, times = run(system, h, 3.0, every=round(0.1 / h)), 0.1 * np.arange(31)
        assert found["angle"][-1] > 4 * 2 * np.pi
        return float(max(np.abs(found["angle"] - times**2 / 0.3).max(), np.abs(found["rate"] - 2 * times / 0.3).max()))

    assert error(5e-4) < 1e-3
    assert 1.9 < order(error, 2e-3) < 2.1


def test_torsional_oscillator() -> None:
    """J theta'' + d theta' + k (theta - theta0) = 0 from rest at the angle 0."""
    J, k, d, rest = 0.3, 12.0, 0.2, 0.8
    disc = rigid("disc", 2.0, J, (0, 0), dim=2)
    at = At("disc", "frame")
    spring = loads.TorsionSpring("spring", at, None, k, d, rest)
    system = eliminate(
        assemble([disc], [joints.Revolute("pin", at)], [spring], outputs={"angle": probes.Angle(at)}),
    )
    decay, rate = d / (2 * J), np.sqrt(k / J - (d / (2 * J)) ** 2)

    def error(h: float) -> float:
        t = h * np.arange(round(2.0 / h) + 1)
        exact = rest - rest * np.exp(-decay * t) * (np.cos(rate * t) + decay / rate * np.sin(rate * t))
        return float(np.abs(run(system, h, 2.0)["angle"] - exact).max())

    assert error(1e-3) < 1e-4
    assert 1.9 < order(error, 4e-3) < 2.1


@pytest.mark.parametrize("dim", [2, 3])
def test_gears_share_a_torque(dim: int) -> None:
    """20 and 50 teeth: J1 + (20/50)^2 J2 resists the torque on the first wheel; the second turns back at 0.4 of its angle."""
    axis = {} if dim == 2 else {"axis": Z}
    moments = (lambda J: J) if dim == 2 else (lambda J: (0.6 * J, 0.6 * J, J))
    wheels = [rigid(name, 1.0, moments(J), (x, 0.0, 0.0)[:dim], dim=dim) for name, J, x in (("a", 0.1, 0.0), ("b", 0.4, 1.0))]
    a, b = At("a", "frame"), At("b", "frame")
    pins = [joints.Revolute("A", a, **axis), joints.Revolute("B", b, **axis), joints.Gear("gear", a, b, (20, 50), **axis)]
    torque = loads.Moment("torque", a, 0.5 if dim == 2 else (0.0, 0.0, 0.5))
    sensed = {"first": probes.Angle(a, **axis), "second": probes.Angle(b, **axis), "E": probes.Energy()}
    trajectory = integrate(eliminate(assemble(wheels, pins, [torque], outputs=sensed)), GeneralizedAlpha(1e-3), 3.0, every=30)
    found = outputs(trajectory)
    assert_allclose(found["first"], 0.5 * 0.5 / (0.1 + 0.16 * 0.4) * trajectory.times**2, atol=2e-3)
    assert found["first"][-1] > 2 * 2 * np.pi
    assert_allclose(found["second"], -0.4 * found["first"], atol=1e-8)


def test_universal_joint() -> None:
    """Shafts at 30 degrees: tan(second) = tan(first) / cos 30 when the first drives with its fork in the plane of the shafts."""
    bend = np.radians(30.0)
    out = np.array([np.cos(bend), np.sin(bend), 0.0])
    cross = np.array([-np.sin(bend), np.cos(bend), 0.0])
    shafts = [rigid("in", 1.0, (1e-2,) * 3, (0, 0, 0)), rigid("out", 1.0, (1e-2,) * 3, (0, 0, 0))]
    a, b = At("in", "frame"), At("out", "frame")
    held = [
        joints.Revolute("bearing", a, None, (1, 0, 0)),
        joints.Cylindrical("support", b, tuple(out)),
        joints.Universal("cross", a, b, Z, tuple(cross)),
        joints.DrivenAngle("drive", a, lambda t: t**2, (1, 0, 0)),
    ]
    sensed = {"first": probes.Angle(a, (1, 0, 0)), "second": probes.Angle(b, tuple(out))}
    with pytest.warns(Notice, match=r"redundant .*cross"):
        system = eliminate(assemble(shafts, held, outputs=sensed))
    found = run(system, 5e-3, 2.0)
    exact = np.arctan2(np.sin(found["first"]) * np.cos(bend), np.cos(found["first"]))
    assert_allclose(found["first"], (5e-3 * np.arange(401)) ** 2, atol=1e-9)
    assert_allclose(np.unwrap(exact), found["second"], atol=1e-9)


def test_a_top_without_torque_keeps_its_energy() -> None:
    """A free box that spins about its middle axis, which is unstable: the energy is kept to second order."""
    box = rigid("box", 1.0, (0.1, 0.2, 0.25), (0, 0, 0))
    system = assemble([box], initial={"box": Motion(angular_velocity=(0.01, 5.0, 0.0))})
    drift = [energy_drift(integrate(system, GeneralizedAlpha(h, 0.9), 4.0)) for h in (2e-2, 1e-2)]
    assert drift[1] < 1e-3 * 2.5
    assert np.log2(drift[0] / drift[1]) > 1.9
