"""Rotations of up to half a radian a step against exact motions: bounded, and of second order in
all unknowns.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from fmbs_skfem.bodies import body
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, energies, integrate, outputs
from fmbs_skfem.systems import At, Motion, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

GRAVITY = 9.81
RADII = (0.5, 0.8, 0.9, 1.0)


class Exact(NamedTuple):
    """A system with its exact motion."""

    system: System
    rate: float  #: fastest rotation [rad/s]
    states: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]  #: times (s,) -> x, v (s, n)
    force: float  #: size of the reaction of its joint, or of all multipliers, constant [N]


def turned(angle: np.ndarray | float, axis: int) -> np.ndarray:
    """Rotations (s, 3, 3) about an axis of the scene."""
    c, s, out = np.cos(angle), np.sin(angle), np.zeros((*np.shape(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out[..., axis, axis] = 1.0
    out[..., i, i], out[..., j, j], out[..., i, j], out[..., j, i] = c, c, -s, s
    return out


def cross(a: np.ndarray) -> np.ndarray:
    """The matrix of a x."""
    return np.cross(a, np.eye(3)).T


def frames(R: np.ndarray, rates: np.ndarray, arm: float) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and velocities (s, 12) of rotations (s, 3, 3) with angular velocities (s, 3); c =
    arm e_3.
    """
    axes = np.concatenate([arm * R[:, None, :, 2], R.transpose(0, 2, 1)], axis=1)
    return axes.reshape(-1, 12), np.cross(rates[:, None, :], axes).reshape(-1, 12)


def spinning_disc() -> Exact:
    """A free planar body that turns at a constant rate."""
    rate = 5.0
    part = rigid("part", 2.0, 0.3, (0.0, 0.0), dim=2)

    def states(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        c, s, none = np.cos(rate * t), np.sin(rate * t), 0.0 * t
        return np.stack([none, none, c, s, -s, c], 1), rate * np.stack(
            [none, none, -s, c, -c, -s], 1
        )

    return Exact(
        assemble([part], initial={"part": Motion(angular_velocity=rate)}),
        rate,
        states,
        np.sqrt(2) * 0.15 * rate**2,
    )


def precessing(
    arm: float, mass: float, moments: tuple[float, float], tilt: float, spin: float
) -> Exact:
    """A symmetric top, free (arm 0) or on a spherical joint, in regular precession about the
    vertical.

    R = R_z(W t) R_x(tilt) R_z(p t) with I_3 (p + W cos tilt) W = m g l + I_1 W^2 cos tilt about the
    foot; W is its slow root.
    """
    first, third = moments[0] + mass * arm**2, moments[1]
    load, cosine = mass * GRAVITY * arm, float(np.cos(tilt))
    a, b = (third - first) * cosine, third * spin
    slow = (
        load / b
        if abs(a) < 1e-12
        else (-b + np.sqrt(b * b + 4 * a * load)) / (2 * a)
        if load
        else -b / a
    )
    top = rigid(
        "top",
        mass,
        (moments[0], moments[0], third),
        tuple(arm * turned(tilt, 0)[:, 2]),
        rotation=turned(tilt, 0),
        places={"foot": (0.0, 0.0, 0.0)},
    )
    start = slow * np.array([0.0, 0.0, 1.0]) + spin * turned(tilt, 0)[:, 2]
    held: list[joints.Joint] = [joints.Spherical("foot", At("top", "foot"))] if arm else []
    system = assemble(
        [top],
        held,
        [loads.Gravity((0.0, 0.0, -GRAVITY))] if arm else [],
        outputs={"R": probes.Reaction("foot")} if arm else {},
        initial={"top": Motion(angular_velocity=tuple(start))},
    )

    def states(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        R = turned(slow * t, 2) @ turned(tilt, 0) @ turned(spin * t, 2)
        return frames(R, slow * np.array([0.0, 0.0, 1.0]) + spin * R[:, :, 2], arm)

    inward = mass * slow**2 * arm * np.sin(tilt)
    rate = float(np.linalg.norm(start))
    if arm:
        return Exact(system, rate, states, float(np.hypot(inward, mass * GRAVITY)))
    omega, change = turned(tilt, 0).T @ start, np.array([spin * slow * np.sin(tilt), 0.0, 0.0])
    G = np.diag([0.5 * third, 0.5 * third, moments[0] - 0.5 * third])
    return Exact(
        system,
        rate,
        states,
        float(np.linalg.norm((cross(omega) @ cross(omega) + cross(change)) @ G)),
    )


def tumbling() -> Exact:
    """A free body of revolution that precesses about its angular momentum."""
    return precessing(0.0, 1.0, (0.1, 0.16), 0.5, 4.0)


def heavy_top() -> Exact:
    """A top of 1 kg that spins at 40 rad/s on its foot."""
    return precessing(0.3, 1.0, (0.05, 0.08), 0.6, 40.0)


def conical() -> Exact:
    """A mass of 2 kg on a massless link of 1 m, 30 degrees from the vertical; the tension is m g /
    cos 30 deg = 22.655 N.
    """
    tilt, mass = np.pi / 6, 2.0
    rate = float(np.sqrt(GRAVITY / np.cos(tilt)))
    place, speed = np.array([np.sin(tilt), 0.0, -np.cos(tilt)]), rate * np.sin(tilt)
    system = assemble(
        [body.point_mass("mass", mass, place)],
        [joints.RigidLink("link", At("mass", "center"), (0.0, 0.0, 0.0))],
        [loads.Gravity((0.0, 0.0, -GRAVITY))],
        outputs={"R": probes.Reaction("link")},
        initial={"mass": Motion(velocity=(0.0, speed, 0.0))},
    )

    def states(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        c, s, one = np.cos(rate * t), np.sin(rate * t), np.ones_like(t)
        x = np.stack([np.sin(tilt) * c, np.sin(tilt) * s, -np.cos(tilt) * one], 1)
        return x, speed * np.stack([-s, c, 0.0 * t], 1)

    return Exact(system, rate, states, mass * GRAVITY / np.cos(tilt))


def pulls(motion: Trajectory) -> np.ndarray:
    """Size (s,) of the reaction that is asked for, or of the symmetric matrix of the multipliers of
    a free frame.
    """
    columns = list(outputs(motion).values())
    ends = [row.split(".") for _, row in motion.system.constraints.names]
    twice = np.array([1.0 if len(set(end)) == 1 else np.sqrt(2.0) for end in ends])
    return np.asarray(
        np.linalg.norm(
            np.array(columns) if columns else twice[:, None] * motion.multipliers.T, axis=0
        )
    )


CASES = (spinning_disc, tumbling, heavy_top, conical)


@pytest.mark.parametrize("turn", [0.1, 0.2, 0.3, 0.4, 0.5])
@pytest.mark.parametrize("rho", RADII)
@pytest.mark.parametrize("make", CASES)
def test_twenty_turns_stay_bounded(make: Callable[[], Exact], rho: float, turn: float) -> None:
    """The energy rises by less than a hundredth, and falls by the method's damping alone, which
    grows with the turn in a step.
    """
    exact = make()
    h = turn / exact.rate
    motion = integrate(exact.system, GeneralizedAlpha(h, rho), np.ceil(20 * 2 * np.pi / turn) * h)
    balance, kinetic = energies(motion)[:, 3], energies(motion)[:, 0]
    change = (balance - balance[0]) / kinetic[0]
    assert change.max() < 0.01
    assert change.min() > -3.2 * turn**2
    assert motion.statistics.halved == 0


@pytest.mark.parametrize("rho", RADII)
@pytest.mark.parametrize("make", CASES)
def test_second_order_in_positions_velocities_and_multipliers(
    make: Callable[[], Exact], rho: float
) -> None:
    """Errors over two turns at 1/40 and 1/80 rad a step, of the multipliers from the first step on.

    Without damping, rho_inf = 1, the circle is met so well that multipliers are exact.
    """
    exact, errors = make(), []
    for steps in (504, 1008):
        h = 4 * np.pi / exact.rate / steps
        motion = integrate(
            exact.system, GeneralizedAlpha(h, rho), steps * h, Newton(tolerance=1e-13)
        )
        x, v = exact.states(motion.times)
        errors.append(
            [
                np.abs(motion.x - x).max(),
                np.abs(motion.v - v).max(),
                np.abs(pulls(motion) / exact.force - 1.0).max(),
            ]
        )
    for name, coarse, fine in zip(("x", "v", "multipliers"), *errors, strict=True):
        if fine > 1e-7:
            assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.15), name


@pytest.mark.parametrize("rho", [0.8, 0.9, 1.0])
def test_the_iteration_leaves_no_noise_in_reactions(rho: float) -> None:
    """With small steps and the default tolerance the tension of the conical pendulum is 22.655 N
    within one per mille.
    """
    exact = conical()
    tension = pulls(integrate(exact.system, GeneralizedAlpha(2.5e-4, rho), 1.0))
    assert tension == pytest.approx(exact.force, rel=1e-3)


@pytest.mark.parametrize(
    "inertia",
    [(0.01, 0.01, 0.02), (0.01, 0.0, 0.01), (0.0, 0.02, 0.02)],
    ids=["disc", "rod", "rod across"],
)
def test_bodies_without_thickness_begin_to_turn_on_an_axle(
    inertia: tuple[float, float, float],
) -> None:
    """Laminae and rods have axes without mass, whose velocities joints and the others fix: dw/dt =
    torque / J, h^2 aside.
    """
    axle = joints.Revolute("axle", At("part", "frame"), axis=(0.0, 0.0, 1.0))
    system = assemble(
        [rigid("part", 2.0, inertia, (0.0, 0.0, 0.0))],
        [axle],
        [loads.Torque("brake", At("part", "frame"), (0.0, 0.0, -2.0 * inertia[2]))],
        outputs={"w": probes.AngularVelocity(At("part", "frame"), axis=(0.0, 0.0, 1.0))},
        initial={"part": Motion(angular_velocity=(0.0, 0.0, 3.0))},
    )
    for form in (system, eliminate(system)):
        motion = integrate(form, GeneralizedAlpha(0.001), 0.5)
        np.testing.assert_allclose(outputs(motion)["w"], 3.0 - 2.0 * motion.times, atol=1e-5)
