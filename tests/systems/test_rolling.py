"""What rolls with friction against exact motions: the slip of a step is of second order, wherever
it rolls.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from fmbs_skfem.bodies import Given, cable, rigid
from fmbs_skfem.contact.beams import ContactBeam, node_rows
from fmbs_skfem.contact.contacts import (
    Contact,
    ContactBox,
    ContactCylinder,
    ContactHeights,
    ContactPlane,
    ContactSphere,
)
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, outputs
from fmbs_skfem.scenes import build
from fmbs_skfem.scenes import reading as scenes
from fmbs_skfem.systems import At, Motion, assemble, compiled
from fmbs_skfem.systems.connections.frame_joints import Revolute
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from ..models import polyline, segment

#: gravity, radius and mass of a ball, stiffness of what it rolls on
G, R, M, K = (
    9.81,
    0.1,
    1.0,
    1e6,
)
BALL, TABLE = At("ball", "center"), At("table")
UP = np.array([0.0, 0.0, 1.0])
LAW: dict[str, Any] = {"stiffness": K, "damping": 500.0, "friction": 0.5, "radius": R, "at": BALL}

pytestmark = pytest.mark.filterwarnings(
    "ignore:load .* overlap", "ignore:body .* is curved in space"
)

AXLE = """
schema: 1
dimension: 3
bodies: {wheel: {type: rigid, mass: 78.54, inertia: [4.9742, 4.9742, 9.8175], center: [0, 0, 3], points: {pivot: [0, 0, 0]}}}
joints: {p: {type: spherical, at: wheel.pivot}}
loads:
  w: {type: gravity, acceleration: [0, -9.81, 0]}
  roll:
    {type: contact_plane, at: wheel.center, radius: 0.5, point: [0, -0.4992295, 0], normal: [0, 1, 0], stiffness: 1000000,
     damping: 10000, friction: 0.5}
initial: {bodies: {wheel: {velocity: [-1.5, 0, 0], angular_velocity: [0, -0.5, 3], center: [0, 0, 3]}}}
analysis: {type: dynamic, duration: 3, step: 5 ms}
outputs: {x: {type: position, at: wheel.center}, c: {type: contact, load: roll}, r: {type: reaction, joint: p}}
"""


@pytest.mark.parametrize("step", [5e-3, 1.25e-3, 3.125e-4])
def test_a_wheel_on_an_axle_rolls_freely_in_a_circle(step: float) -> None:
    """The pivot holds m v^2 / r = 58.9 N along the axle, and friction has nothing to do: 0.2 % of
    mu N are what the start left.
    """
    scene = scenes.loads(AXLE)
    motion = integrate(build.system(scene), GeneralizedAlpha(step), scene.analysis.duration)
    found, late = outputs(motion), motion.times > 1.5
    x, z = found["x_x"], found["x_z"]
    axial = -((found["r_x"] * x + found["r_z"] * z) / np.hypot(x, z))[late]
    assert (found["c_friction"] / found["c_force"])[late].max() < 0.5 * 0.0025
    assert axial.mean() == pytest.approx(78.54 * 1.5**2 / 3.0, abs=1.0)
    assert np.ptp(axial) < 0.5


def roll(
    contact: Contact,
    center: np.ndarray,
    spin: np.ndarray,
    velocity: np.ndarray,
    weight: np.ndarray,
    step: float,
    time: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Times, and places (s, c) of the center of a ball, on a contact that a table may carry, which
    turns about z by 2 rad/s.
    """
    ball = rigid.rigid("ball", M, 0.4 * M * R**2 * np.eye(3), tuple(center))
    table = rigid.rigid("table", 1e7, 1e7 * np.eye(3), (0.2, -0.3, -0.5))
    start = {
        "ball": Motion(
            velocity=tuple(velocity), angular_velocity=tuple(spin), center=tuple(center)
        ),
        "table": Motion(angular_velocity=(0.0, 0.0, 2.0), center=(0.2, -0.3, -0.5)),
    }
    pin = Revolute("pin", TABLE, axis=(0.0, 0.0, 1.0))
    forces = [contact, loads.Gravity(tuple(weight))]
    system = assemble(
        [ball, table], [pin], forces, outputs={"x": probes.Position(BALL)}, initial=start
    )
    motion = integrate(system, GeneralizedAlpha(step, 1.0), time, Newton(tolerance=1e-12))
    found = outputs(motion)
    return motion.times, np.column_stack([found[f"x_{c}"] for c in "xyz"])


@pytest.mark.parametrize("shape", ["plane", "box", "cylinder", "heights"])
def test_a_ball_on_a_turntable(shape: str) -> None:
    """It runs in a circle at 2/7 of the speed of the table, whatever its spin, on every shape that
    has a flat side.

    Source: Weltner, Am. J. Phys. 47 (1979) 984-986, doi 10.1119/1.11602.
    """
    on: dict[str, Any] = {**LAW, "on": TABLE}
    contact = {
        "plane": lambda: ContactPlane("c", point=(1.0, 2.0, 0.0), normal=(0.0, 0.0, 1.0), **on),
        "box": lambda: ContactBox("c", sides=(9.0, 9.0, 1.0), center=(0.0, 0.0, -0.5), **on),
        "cylinder": lambda: ContactCylinder(
            "c", diameter=9.0, length=1.0, axis=(0, 0, 1), center=(0.0, 0.0, -0.5), **on
        ),
        "heights": lambda: ContactHeights(
            "c", corner=(-2.0, -2.0, 0.0), step=(1.0, 1.0), heights=[[0.0] * 5] * 5, **on
        ),
    }[shape]()
    center, velocity, middle = (
        np.array([0.3, 0.0, R - M * G / K]),
        np.array([0.0, 0.4, 0.0]),
        np.array([0.2, -0.3, 0.0]),
    )
    spin = np.cross(UP, velocity - np.cross(2.0 * UP, center - middle)) / R + 3.0 * UP

    def error(step: float) -> float:
        t, x = roll(contact, center, spin, velocity, -G * UP, step, 1.0)
        rate = 4.0 / 7.0
        away = np.cross(UP, velocity) / rate  # the middle of the circle is at center + away
        turned = np.cos(rate * t)[:, None] * -away + np.sin(rate * t)[:, None] * np.cross(UP, -away)
        return float(np.abs(x - center - away - turned)[:, :2].max())

    errors = [error(4e-3 / 2**k) for k in range(3)]
    assert errors[0] < 1e-4
    assert errors[0] > 3.5 * errors[1] > 3.5**2 * errors[2], errors


def follow(
    normal: Callable[[np.ndarray], np.ndarray], start: np.ndarray, weight: np.ndarray, t: np.ndarray
) -> np.ndarray:
    """Places (s, c) of the center of a ball that rolls, from its center and spin: F of the contact,
    v = w x R n, I w' = - R n x F.

    With F = m (v' - g) the spin obeys (I + m R^2) w' - m R^2 n (n . w') = - m R n x (R w x n' - g),
    n the normal at the center.
    """
    inertia = 0.4 * M * R**2

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        x, w = y[:3], y[3:]
        n, v = normal(x), np.cross(w, R * normal(x))
        turned = (normal(x + 1e-6 * v) - normal(x - 1e-6 * v)) / 2e-6
        A = (inertia + M * R**2) * np.eye(3) - M * R**2 * np.outer(n, n)
        return np.concatenate(
            [v, np.linalg.solve(A, -M * R * np.cross(n, R * np.cross(w, turned) - weight))]
        )

    return solve_ivp(rates, (0.0, t[-1]), start, t_eval=t, rtol=1e-11, atol=1e-12).y[:3].T


def around(x: np.ndarray) -> np.ndarray:
    """Unit vector from the z axis."""
    return np.array([x[0], x[1], 0.0]) / np.hypot(x[0], x[1])


#: shape, normal of the path of the center, center, spin at the start, weight
PATHS: dict[str, tuple[Contact, Callable[[np.ndarray], np.ndarray], Any, Any, Any]] = {
    "on a slope": (
        ContactPlane("c", point=(0, 0, 0), normal=(0, 0, 1), **LAW),
        lambda x: UP,
        (0.0, 0.0, R),
        (2.0, 1.0, 9.0),
        (0.8, 0.0, -G),
    ),
    "on sloping heights": (
        ContactHeights(
            "c",
            corner=(-2, -2, -0.8),
            step=(2.0, 2.0),
            heights=[[0.4 * i] * 3 for i in range(3)],
            **LAW,
        ),
        lambda x: np.array([-0.2, 0.0, 1.0]) / np.hypot(0.2, 1.0),
        tuple(R * np.array([-0.2, 0.0, 1.0]) / np.hypot(0.2, 1.0) - np.array([0.0, 0.0, 0.4])),
        (2.0, 1.0, 9.0),
        (0.0, 0.0, -G),
    ),
    "in a bowl": (
        ContactSphere("c", center=(0, 0, 0), diameter=1.0, inside=True, **LAW),
        lambda x: -x / np.linalg.norm(x),
        (0.4 * np.sin(0.6), 0.0, -0.4 * np.cos(0.6)),
        (6.0, 2.0, 5.0),
        (0.0, 0.0, -G),
    ),
    "over a sphere": (
        ContactSphere("c", center=(0, 0, 0), diameter=1.0, **LAW),
        lambda x: x / np.linalg.norm(x),
        (0.0, 0.06, 0.6 * np.sqrt(0.99)),
        (-1.0, 1.5, 9.0),
        (0.0, 0.0, -G),
    ),
    "in a tube": (
        ContactCylinder("c", center=(0, 0, 0), diameter=1.0, axis=(0, 0, 1), inside=True, **LAW),
        lambda x: -around(x),
        (0.4, 0.0, 0.0),
        (5.0, 0.0, 30.0),
        (0.0, 0.0, -G),
    ),
    "along a roller": (
        ContactCylinder("c", center=(0, 0, 0), diameter=1.0, axis=(0, 0, 1), **LAW),
        around,
        (0.6, 0.0, 0.0),
        (7.0, 4.0, 1.0),
        (-G, 0.0, 0.0),
    ),
}


@pytest.mark.parametrize("name", PATHS)
def test_a_ball_that_spins_about_the_normal(name: str) -> None:
    """Without holonomic constraints but one: in a tube it goes up and down, `golfer's bad luck`.

    Source of the equations: Neimark and Fufaev, Dynamics of Nonholonomic Systems, AMS 1972, doi
    10.1090/mmono/033, chapter III.
    """
    contact, normal, center, spin, weight = PATHS[name]
    x0, w, g = np.array(center), np.array(spin), np.array(weight)
    n, v = normal(x0), np.cross(w, R * normal(x0))
    turned = (normal(x0 + 1e-6 * v) - normal(x0 - 1e-6 * v)) / 2e-6
    force = M * (-turned @ v - g @ n)  # m n . v' = m g . n + N, as n . v = 0 stays
    x0 = x0 - n * force / K

    found = [roll(contact, x0, w, v, g, 2e-3 / 2**k, 0.4) for k in range(3)]
    differences = [
        float(np.abs(fine[1][::2] - coarse[1]).max()) for coarse, fine in pairwise(found)
    ]
    expected = follow(normal, np.concatenate([center, w]), g, found[-1][0])
    assert differences[0] < 4e-4
    assert differences[0] > 3.4 * differences[1], differences
    assert (
        np.abs(found[-1][1] - expected).max() < 5.0 * force / K
    )  # it is pressed in by that, and rolls on it


def test_a_disc_in_the_plane_keeps_its_contact() -> None:
    """At 6 rad/s in steps of 5 ms it slips by less than 2 um in 10 s; weights of one end make R w^3
    h^2 t / 6 = 0.9 mm of it.
    """
    disc = rigid.rigid("disc", M, 0.5 * M * R**2, (0.0, R), dim=2)
    on = ContactPlane(
        "c", point=(0.0, M * G / K), normal=(0.0, 1.0), **LAW | {"at": At("disc", "center")}
    )
    start = {"disc": Motion(velocity=(6.0 * R, 0.0), angular_velocity=-6.0, center=(0.0, R))}
    measured = {"x": probes.Position(At("disc", "center")), "turn": probes.Angle(At("disc"))}
    system = assemble([disc], [], [on, loads.Gravity((0.0, -G))], outputs=measured, initial=start)
    found = outputs(integrate(system, GeneralizedAlpha(5e-3), 10.0))
    assert found["x_x"][-1] > 5.9
    assert found["x_x"][-1] == pytest.approx(-R * found["turn"][-1], abs=2e-6)


def test_an_arc_rolls_on_a_bar() -> None:
    """An arc that rocks and yaws on the y axis, without slip where they touch: what a step h slips
    falls with h^3.

    It turns by a velocity w = 2 n x t - 3 n about the point C where they touch, n the normal and t
    its tangent there.
    """
    bend = np.linspace(-0.6, 0.6, 13)
    corners = np.column_stack([np.sin(bend), 0.3 * np.sin(bend), 0.095 + 1.0 - np.cos(bend)])
    section, radius = Given(EA=2000.0, EI=3.0, rhoA=0.5), 0.05
    arc, bar = (
        cable("arc", polyline(corners), section),
        cable("bar", segment(3, (0, -1, 0), (0, 1, 0)), section),
    )
    touch = ContactBeam(
        "c",
        body="arc",
        other="bar",
        radius=radius,
        stiffness=K,
        friction=9.0,
        sticking=1.0,
        sticking_damping=0.0,
    )
    system = replace(assemble([arc, bar], loads=[touch]), elastic=())
    model, first = compiled.compile_system(system), arc.reference.size
    rows, xi = node_rows("", arc, None, np.inf)
    nodes = (rows @ arc.reference.ravel()).reshape(len(xi), 2, 3)
    curve = CubicHermiteSpline(xi, nodes[:, 0], nodes[:, 1])

    def meet(y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Normal, unit tangent of the arc, and the point where it touches the bar, when turned and
        moved.
        """
        turned, moved = y[:9].reshape(3, 3), y[9:]

        def along(s: float) -> float:
            return float(((turned @ curve(s) + moved) * (turned @ curve(s, 1)))[[0, 2]].sum())

        s = brentq(along, 0.1 * xi[-1], 0.9 * xi[-1], xtol=1e-15)
        there, t = turned @ curve(s) + moved, turned @ curve(s, 1)
        away = np.hypot(there[0], there[2])
        n = np.array([there[0], 0.0, there[2]]) / away
        return n, t / np.linalg.norm(t), there - 0.5 * away * n

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        n, t, C = meet(y)
        w = 2.0 * np.cross(n, t) - 3.0 * n
        return np.concatenate(
            [np.cross(w, y[:9].reshape(3, 3), axisb=0).T.ravel(), np.cross(w, y[9:] - C)]
        )

    def placed(y: np.ndarray) -> np.ndarray:
        x = system.x0.copy()
        x[:first] = (arc.reference @ y[:9].reshape(3, 3).T + arc.constant[:, None] * y[9:]).ravel()
        return x

    steps = 0.04 / 2.0 ** np.arange(3)
    motion = solve_ivp(
        rates,
        (0.0, 0.2),
        np.append(np.eye(3), np.zeros(3)),
        rtol=1e-12,
        atol=1e-14,
        dense_output=True,
    ).sol
    slips = []
    for h in steps:
        memory = None
        for t in (0.1 - h, 0.1):
            memory = compiled.accepted(model, placed(motion(t)), memory=memory)
        force = compiled.forces(model, placed(motion(0.1 + h)), np.zeros(system.size), 0.0, memory)[
            :first
        ].reshape(-1, 3)
        whole, n = arc.constant @ force, meet(motion(0.1 + h))[0]
        slips.append(float(np.linalg.norm(whole - (whole @ n) * n)))
    assert slips[0] < 3e-5
    assert slips[0] > 7.0 * slips[1] > 7.0**2 * slips[2], slips
