"""Screws, racks and pinions: their contract and symbols, exact motions, reactions, reversal, bodies
that both move.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Body
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs
from fmbs_skfem.systems import At, Motion, assemble, check_joint, eliminate
from fmbs_skfem.systems.connections import constraint_laws, joints, mechanism, travels
from fmbs_skfem.systems.evaluation import space_of
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

from .rigid_parts import A1, B1, RIM, SPATIAL_AXIS, bodies

Z = (0.0, 0.0, 1.0)


def every_joint(dim: int) -> list[joints.Joint]:
    axis = {} if dim == 2 else {"axis": Z}
    along = (1.0, 2.0, 0.0)[:dim]
    racks: list[joints.Joint] = [
        joints.RackAndPinion("on a fixed rack", A1, along, 0.05, **axis),
        joints.RackAndPinion("on a rack that moves", B1, along, -0.05, A1, **axis),
        joints.RackAndPinion("on a rim", A1, along, 0.3, RIM, **axis),
    ]
    screws = [
        joints.Screw("screw", A1, SPATIAL_AXIS, 0.01),
        joints.Screw("screw of bodies", B1, SPATIAL_AXIS, -0.3, A1),
    ]
    return racks if dim == 2 else [*racks, *screws]


CASES = [
    pytest.param(dim, joint, id=f"{dim}-{joint.name}")
    for dim in (2, 3)
    for joint in every_joint(dim)
]


def test_every_type_is_tested() -> None:
    module = "fmbs_skfem.systems.connections.screws"
    assert {kind for kind in joints.Joint.known.values() if kind.__module__ == module} == {
        type(one) for one in every_joint(3)
    }


@pytest.mark.parametrize("dim, joint", CASES)
def test_contract(dim: int, joint: joints.Joint) -> None:
    check_joint(bodies(dim), joint)


@pytest.mark.parametrize("dim", [2, 3])
def test_drift_of_the_law(dim: int) -> None:
    """Second and third derivatives by time along paths without a third derivative; remainders of
    whole turns.
    """
    rng, law, count = np.random.default_rng(dim), travels.travel(f"travel|{dim}"), 5 * dim
    y, z, v, a = 0.3 * rng.normal(size=(4, count))
    y.reshape(5, dim)[[2, 3, 4], [0, 0, 1]] += 1.0  # u, e_1, e_2
    found = constraint_laws.one(law, 0, range(count), [0.2, 0.3])
    t = 0.1 * np.cos(np.pi * (np.arange(15) + 0.5) / 15)
    phi = [
        constraint_laws.evaluate(found, y + v * s + 0.5 * a * s**2, np.zeros(0))[0][0] for s in t
    ]
    path = np.polynomial.Polynomial.fit(t, np.unwrap(phi, period=2 * np.pi * 0.3), 12)
    slopes, record = (
        constraint_laws.evaluate(found, y, np.zeros(0))[1][0],
        constraint_laws.compile_rows(found, 0),
    )
    for leads, expected in (
        ((1.0, 0.0), path.deriv(2)(0.0) - slopes @ a),
        ((0.0, 1.0), path.deriv(3)(0.0)),
    ):
        drift = np.zeros((1, 1))
        space = space_of(
            paths=np.stack([y, z, v, a]), leads=np.array(leads), multipliers=np.zeros(1), rhs=drift
        )
        law.routines.drift(space, record.address)
        assert drift[0, 0] == pytest.approx(slopes @ z + expected, rel=1e-6)
    d, n, u, first, second = y.reshape(5, dim)
    turns = (n @ d - 0.2 - 0.3 * np.arctan2(u @ second, u @ first) - path(0.0)) / (2 * np.pi * 0.3)
    assert turns == pytest.approx(round(turns), abs=1e-9)
    assert np.abs(phi).max() <= np.pi * 0.3


def nut(name: str = "nut", mass: float = 2.0, turning: float = 0.03) -> Body:
    return rigid(name, mass, (0.02, 0.02, turning), (0.0, 0.0, 0.0))


def back(t: np.ndarray) -> np.ndarray:
    return np.where(t < 0.5, 1.0, -1.0)


def test_screw_under_a_torque() -> None:
    """(J + m p^2) theta'' = T, z = p theta; the torque turns round half way. Its force does m z'',
    its moment - p times that.
    """
    lead, mass, J, T = 0.04, 2.0, 0.03, 1.5
    p = lead / (2 * np.pi)
    at, axis = At("nut", "frame"), {"axis": Z}
    held = [joints.Screw("screw", at, Z, lead)]
    sensed = {
        "turn": probes.Angle(at, **axis),
        "z": probes.Position(at, "z"),
        "R": probes.Reaction("screw"),
        "E": probes.Energy(),
    }
    push = [loads.Torque("T", at, (0.0, 0.0, T), back)]
    system = eliminate(assemble([nut(mass=mass, turning=J)], held, push, outputs=sensed))
    assert mechanism.analyse(system.full or system).mobility == 1
    motion = integrate(system, GeneralizedAlpha(1e-3), 1.0)
    found, t = outputs(motion), motion.times
    a = T / (J + mass * p**2)
    exact = np.where(
        t < 0.5, 0.5 * a * t**2, 0.125 * a + 0.5 * a * (t - 0.5) - 0.5 * a * (t - 0.5) ** 2
    )
    assert exact.max() > 1.5 * 2 * np.pi
    assert_allclose(found["turn"], exact, atol=2e-3 * exact.max())
    assert_allclose(found["z"], p * found["turn"], atol=1e-10)
    quiet = np.abs(t - 0.5) > 0.01
    assert_allclose(found["R_thrust"][quiet], (back(t) * mass * p * a)[quiet], rtol=2e-2)
    assert np.ptp(found["E_balance"]) < 2e-3 * found["E_kinetic"].max()


def test_screw_of_the_second_order() -> None:
    def error(h: float) -> float:
        at = At("nut", "frame")
        system = assemble(
            [nut()], [joints.Screw("screw", at, Z, -0.1)], [loads.Gravity((0.0, 0.0, -9.81))]
        )
        system = eliminate(system)
        found = integrate(system, GeneralizedAlpha(h), 1.0)
        p = 0.1 / (2 * np.pi)
        exact = -0.5 * 2.0 * 9.81 * p**2 / (0.03 + 2.0 * p**2)
        return abs(float(system.lift(found.x[-1])[2]) - exact)

    assert error(1e-3) < 1e-5
    assert np.log2(error(4e-3) / error(2e-3)) == pytest.approx(2.0, abs=0.15)


def test_screw_between_free_bodies() -> None:
    """Both move: momentum and spin about the axis are kept, travel goes with the turn of one
    against the other.
    """
    p = 0.2 / (2 * np.pi)
    parts = [nut("nut", 2.0, 0.03), nut("bolt", 3.0, 0.01)]
    a, b = At("nut", "frame"), At("bolt", "frame")
    w, v = 4.0, 0.5
    start = {"nut": Motion((0.0, v, p * w), (0.0, 0.0, w)), "bolt": Motion((0.0, v, 0.0))}
    sensed = {
        "turn": probes.Angle(a, Z),
        "other": probes.Angle(b, Z),
        "r": probes.Position(a),
        "q": probes.Position(b),
        "E": probes.Energy(),
    }
    system = eliminate(
        assemble(parts, [joints.Screw("screw", a, Z, 0.2, b)], outputs=sensed, initial=start)
    )
    motion = integrate(system, GeneralizedAlpha(1e-3, 1.0), 2.0)
    found, t = outputs(motion), motion.times
    apart = found["r_z"] - found["q_z"]
    assert_allclose(apart, p * (found["turn"] - found["other"]), atol=1e-9)
    assert_allclose((2.0 * found["r_z"] + 3.0 * found["q_z"]), 2.0 * p * w * t, atol=1e-9)
    assert_allclose(0.03 * found["turn"] + 0.01 * found["other"], 0.03 * w * t, atol=1e-4)
    assert_allclose(found["r_y"], v * t, atol=1e-9)
    assert np.ptp(found["E_kinetic"]) < 1e-4 * found["E_kinetic"][0]


@pytest.mark.parametrize("dim", [2, 3])
def test_pinion_moves_a_rack(dim: int) -> None:
    """(J + M R^2) theta'' = T about a bearing; the rack, above the wheel, goes back by R theta, and
    the teeth push with M x''.
    """
    axis, R, J, M, T = ({} if dim == 2 else {"axis": Z}), 0.05, 0.02, 4.0, 0.6
    moments = (lambda J: J) if dim == 2 else (lambda J: (J, J, J))
    parts = [
        rigid("wheel", 1.0, moments(J), (0.0, 0.0, 0.0)[:dim], dim=dim),
        rigid("rack", M, moments(1.0), (0.3, 0.05, 0.0)[:dim], dim=dim),
    ]
    a, b, x = At("wheel", "frame"), At("rack", "frame"), (1.0, 0.0, 0.0)[:dim]
    guides = [joints.Revolute("bearing", a, **axis), joints.Prismatic("guide", b, x)]
    held = [*guides, joints.RackAndPinion("teeth", a, x, R, b, **axis)]
    push = [loads.Torque("T", a, T if dim == 2 else (0.0, 0.0, T))]
    sensed = {
        "turn": probes.Angle(a, **axis),
        "x": probes.Position(b, "x"),
        "F": probes.Reaction("teeth"),
    }
    motion = integrate(
        eliminate(assemble(parts, held, push, outputs=sensed)), GeneralizedAlpha(1e-3), 1.0
    )
    found, t, a2 = outputs(motion), motion.times, T / (J + M * R**2)
    assert_allclose(found["turn"], 0.5 * a2 * t**2, atol=1e-3 * a2)
    assert_allclose(found["x"], 0.3 - R * found["turn"], atol=1e-10)
    assert_allclose(found["F_thrust"], M * R * a2, rtol=2e-2)


def test_wheel_rolls_down_a_rack() -> None:
    """A disc on a rack at 30 degrees: a = g sin / (1 + J / m R^2), with its rack below it: negative
    radius.
    """
    R, m, J, slope = 0.1, 1.5, 0.01, np.radians(30.0)
    along = (float(np.cos(slope)), float(-np.sin(slope)))
    disc, at = rigid("disc", m, J, (0.0, 0.0), dim=2), At("disc", "frame")
    held = [joints.Slider("line", at, along), joints.RackAndPinion("teeth", at, along, -R)]
    sensed = {"r": probes.Position(at), "turn": probes.Angle(at)}
    motion = integrate(
        eliminate(assemble([disc], held, [loads.Gravity((0.0, -9.81))], outputs=sensed)),
        GeneralizedAlpha(1e-3),
        1.0,
    )
    found, way = (
        outputs(motion),
        0.5 * 9.81 * np.sin(slope) / (1 + J / (m * R**2)) * motion.times**2,
    )
    assert_allclose(
        np.column_stack([found["r_x"], found["r_y"]]), np.outer(way, along), atol=2e-3 * way.max()
    )
    assert_allclose(
        found["turn"], -(found["r_x"] * along[0] + found["r_y"] * along[1]) / R, atol=1e-8
    )


@pytest.mark.parametrize(
    "dim, joint, named",
    [
        (
            2,
            joints.Screw("s", A1, (0.0, 0.0, 1.0), 0.1),
            "expected a spatial scene, got a planar one; take `rack",
        ),
        (
            3,
            joints.Screw("s", A1, Z, 0.0),
            r"'s'\.lead: expected a travel a turn that is not zero, got 0; a hinge",
        ),
        (
            3,
            joints.RackAndPinion("r", A1, (1.0, 0.0, 1.0), 0.1, axis=Z),
            "expected a direction normal to the axis",
        ),
        (
            3,
            joints.RackAndPinion("r", A1, (1.0, 0.0, 0.0), 0.1),
            r"'r'\.axis: expected the axis of rotation in space",
        ),
        (
            2,
            joints.RackAndPinion("r", A1, (1.0, 0.0), 0.0),
            r"'r'\.radius: expected a radius that is not zero",
        ),
    ],
)
def test_what_does_not_fit_is_named(dim: int, joint: joints.Joint, named: str) -> None:
    with pytest.raises(InputError, match=named):
        assemble(bodies(dim), [joint])
