"""Joints with axes and along edges keep their contract, allow the motions they should, and hold the
others.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies import Body
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.systems import (
    At,
    System,
    assemble,
    change_coordinates,
    check_joint,
    check_system,
    compile_system,
    compiled,
    eliminate,
)
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads

from .rigid_parts import A0, A1, B1, B2, BEAM, RIM, SPATIAL_AXIS, bodies, every_joint

CASES = [
    pytest.param(dim, joint, id=f"{dim}-{joint.name}")
    for dim in (2, 3)
    for joint in every_joint(dim)
]
MODULES = ("fmbs_skfem.systems.connections.frame_joints", "fmbs_skfem.systems.connections.edges")


def test_every_type_is_tested() -> None:
    registered = {kind for kind in joints.Joint.known.values() if kind.__module__ in MODULES}
    planar = registered - {joints.Universal, joints.Cylindrical}
    for dim, expected in ((2, planar), (3, registered)):
        assert {type(joint) for joint in every_joint(dim)} >= expected


@pytest.mark.parametrize("dim, joint", CASES)
def test_contract(dim: int, joint: joints.Joint) -> None:
    check_joint(bodies(dim), joint)


def gap(system: System, x: np.ndarray, name: str) -> np.ndarray:
    """Rows of one joint."""
    values = compiled.gap(compile_system(system), x)[0]
    return values[[joint == name for joint, _ in system.constraints.names]]


def moved(part: Body, turn: np.ndarray, about: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Coordinates of a body turned about a point and shifted, x -> about + turn (x - about) +
    shift.
    """
    return part.reference @ turn.T + np.outer(part.constant, about - turn @ about + shift)


def relative(joint: joints.Joint, turn: np.ndarray, shift: np.ndarray, at: At) -> np.ndarray:
    """Rows of a joint when the body of `at` moves so relative to the others, and then all move
    together.
    """
    parts = bodies(len(turn))
    about = next(p for p in parts if p.name == "a").reference[0] + np.eye(len(turn))[0] * 0.5
    whole = Rotation.from_rotvec([0.3, -0.4, 0.5] if len(turn) == 3 else [0, 0, 0.7]).as_matrix()[
        : len(turn), : len(turn)
    ]
    together = whole if not ground(joint) else np.eye(len(turn))
    x = []
    for part in parts:
        own = moved(part, turn, about, shift) if part.name == at.body else part.reference
        x.append(own @ together.T)
    return gap(assemble(parts, [joint]), np.concatenate([part.ravel() for part in x]), joint.name)


def ground(joint: Any) -> bool:
    return not isinstance(getattr(joint, "to", None), At)


def rotation(dim: int, angle: float, axis: tuple[float, ...] = SPATIAL_AXIS) -> np.ndarray:
    vector = np.array(axis if dim == 3 else (0.0, 0.0, 1.0))
    return Rotation.from_rotvec(angle * vector / np.linalg.norm(vector)).as_matrix()[:dim, :dim]


@pytest.mark.parametrize("dim", [2, 3])
def test_free_motions_and_held_ones(dim: int) -> None:
    """(1, 0) is the joint of a and b: turns about the axis, shifts along the line, and neither for
    a weld.
    """
    axis = {} if dim == 2 else {"axis": SPATIAL_AXIS}
    none, turn, other = np.zeros(dim), rotation(dim, 0.8), rotation(dim, 0.8, (1.0, 0.0, 0.3))
    along = np.array([1.0, 2.0, -0.5])[:dim]
    unit, across = along / np.linalg.norm(along), np.array([2.0, -1.0, 0.0])[:dim] / np.sqrt(5)
    revolute, weld = joints.Revolute("j", B1, A1, **axis), joints.Weld("j", B1, A1)
    prismatic, slider = (
        joints.Prismatic("j", B1, tuple(along), A1),
        joints.Slider("j", B1, tuple(along), A1),
    )
    for joint, motion, shift in (
        (revolute, turn, none),
        (prismatic, np.eye(dim), 0.3 * unit),
        (slider, turn, 0.3 * unit),
    ):
        assert_allclose(relative(joint, motion, shift, B1), 0.0, atol=1e-14)
    assert np.linalg.norm(relative(slider, turn, 0.3 * across, B1)) == pytest.approx(0.3)
    assert np.linalg.norm(relative(revolute, turn, 0.3 * across, B1)) == pytest.approx(0.3)
    assert np.linalg.norm(relative(prismatic, np.eye(dim), 0.3 * across, B1)) == pytest.approx(0.3)
    for joint in (weld, prismatic):
        assert np.abs(relative(joint, turn, none, B1)).max() > 0.3
    if dim == 3:
        assert np.abs(relative(revolute, other, none, B1)).max() > 0.3


def test_axes_in_space() -> None:
    """A cylindrical joint turns and slides, a universal one turns about either of its axes and
    keeps them normal.
    """
    axis, none = np.array(SPATIAL_AXIS), np.zeros(3)
    cylindrical = joints.Cylindrical("j", B1, SPATIAL_AXIS, A1)
    assert_allclose(relative(cylindrical, rotation(3, 0.8), 0.4 * axis, B1), 0.0, atol=1e-14)
    assert np.linalg.norm(
        relative(cylindrical, np.eye(3), np.array([0.4, 0.0, 0.0]), B1)
    ) == pytest.approx(0.4)
    universal = joints.Universal("j", B1, (0, 0, 1), (1, 0, 0), A1)
    two = rotation(3, 0.7, (1, 0, 0)) @ rotation(3, -0.4, (0, 0, 1))
    assert_allclose(relative(universal, two, none, B1), 0.0, atol=1e-14)
    twist = relative(universal, rotation(3, 0.3, (0, 1, 0)), none, B1)
    assert_allclose(twist, [0, 0, 0, np.sin(0.3)], atol=1e-14)


@pytest.mark.parametrize("dim", [2, 3])
def test_drives_turn_one_body_against_the_other(dim: int) -> None:
    axis = {} if dim == 2 else {"axis": SPATIAL_AXIS}
    drive = joints.DrivenAngle("j", B1, lambda t: 0.8 + 0 * t, **axis, to=A1)
    assert_allclose(relative(drive, rotation(dim, 0.8), np.zeros(dim), B1), 0.0, atol=1e-14)
    assert relative(drive, rotation(dim, 0.5), np.zeros(dim), B1) == pytest.approx(-np.sin(0.3))


@pytest.mark.parametrize("dim", [2, 3])
def test_gear_ratio_over_many_turns(dim: int) -> None:
    """12 against 30 teeth: the angles are as 5 to -2, whatever the turns; a tooth off by 0.1 rad of
    the first wheel is seen so.
    """
    axis = {} if dim == 2 else {"axis": SPATIAL_AXIS}
    parts = bodies(dim)
    system = assemble(parts, [joints.Gear("j", A1, B1, (12, 30), **axis)])

    def rows(first: float, second: float) -> np.ndarray:
        a, b = (
            moved(p, rotation(dim, w), p.reference[0], np.zeros(dim))
            for p, w in zip(parts, (first, second), strict=False)
        )
        return gap(
            system,
            np.concatenate([a.ravel(), b.ravel(), *(p.reference.ravel() for p in parts[2:])]),
            "j",
        )

    for angle in (0.3, 2.9, 7.0, -40.0):
        assert rows(angle, -0.4 * angle) == pytest.approx(0.0, abs=1e-12)
        assert rows(angle + 0.1, -0.4 * angle) == pytest.approx(0.1, abs=1e-12)


def test_planetary_gear() -> None:
    """A carrier that turns with both wheels keeps the mesh; the sun held, 12 and 30 teeth: the
    planet turns 1.4 times as fast.
    """
    parts = bodies(2)
    system = assemble(parts, [joints.Gear("j", A1, B1, (12, 30), RIM)])

    def rows(*angles: float) -> np.ndarray:
        x = [
            moved(p, rotation(2, w), p.reference[0], np.zeros(2)).ravel()
            for p, w in zip(parts, angles, strict=True)
        ]
        return gap(system, np.concatenate(x), "j")

    assert rows(0.4, 0.4, 0.0, 0.4, 0.0) == pytest.approx(0.0, abs=1e-13)
    assert rows(0.0, 1.4 * 0.9, 0.0, 0.9, 0.0) == pytest.approx(0.0, abs=1e-13)


@pytest.mark.parametrize(
    "dim, joint, named",
    [
        (
            3,
            joints.Revolute("pin", A0),
            r"'pin'\.axis: expected the axis of rotation in space, got nothing",
        ),
        (
            3,
            joints.Revolute("pin", B2, A0, SPATIAL_AXIS),
            "b.Q and a.O at one point, got a gap of 1.4",
        ),
        (
            3,
            joints.Revolute("pin", BEAM, A1, (1.0, 0.0, 1.0)),
            "expected a place that carries the direction .* got beam.left with a slope",
        ),
        (3, joints.Prismatic("guide", B2, (1, 0, 0), BEAM), "carries the direction"),
        (2, joints.Universal("cross", A1, (0, 0, 1), (1, 0, 0), B1), "expected a spatial scene"),
        (
            3,
            joints.Universal("cross", A1, (0, 0, 1), (1, 0, 1), B1),
            r"'cross'\.axis_to: expected an axis normal to the other, got an angle of 45",
        ),
        (2, joints.Cylindrical("tube", A1, (0, 0, 1)), "expected a spatial scene"),
        (2, joints.Gear("wheels", A1, B1, (12, 0)), r"'wheels'\.teeth: expected two whole numbers"),
        (
            2,
            joints.Gear("wheels", A1, B1, (1.5, 2)),
            r"'wheels'\.teeth: expected a sequence, in it a whole number",
        ),  # type: ignore[arg-type]
        (
            3,
            joints.Gear("wheels", A1, B1, (1, 2), RIM, (0, 0, 1)),
            r"'wheels'\.carrier: expected wheels on the ground in space",
        ),
        (
            3,
            joints.Gear("wheels", A1, BEAM, (1, 2), None, (1, 0, 0)),
            "a direction normal to the axis",
        ),
        (
            2,
            joints.Edge("hold", "plate", ("lft",)),
            "one of its edges .*got 'lft'; did you mean 'left'",
        ),
        (2, joints.Edge("hold", "beam", ("left",)), "expected a plate, shell or solid, got 'beam'"),
        (
            2,
            joints.Edge("hold", "plate", ("right",), "xz"),
            r"'hold'\.fixed: expected letters of xy",
        ),
        (
            2,
            joints.Edge("hold", "plate", ("right",), ""),
            r"'hold'\.fixed: expected a component of displacement or slope",
        ),
        (2, joints.RimNodes("ring", "a", ("right",), A1), "expected a plate, shell or solid"),
    ],
)
def test_wrong_joints_are_named(dim: int, joint: Any, named: str) -> None:
    with pytest.raises(InputError, match=named):
        assemble(bodies(dim), [joint])


@pytest.mark.parametrize("dim", [2, 3])
def test_gears_and_springs_after_a_change_of_coordinates(dim: int) -> None:
    """Angles stay angles of probe rows when linear constraints are eliminated and when coordinates
    are reduced.
    """
    axis = {} if dim == 2 else {"axis": SPATIAL_AXIS}
    held = [
        joints.Revolute("hinge", A1, **axis),
        joints.Pin("pin", B1),
        joints.Gear("gear", A1, B1, (12, 30), **axis),
    ]
    system = eliminate(
        assemble(
            bodies(dim), held, [loads.TorsionSpring("spring", A1, None, 3.0, 0.2, 0.1, **axis)]
        )
    )
    check_system(system)
    V = np.linalg.qr(np.random.default_rng(1).normal(size=(system.size, 12)))[0]
    check_system(change_coordinates(system, V, system.x0))
