"""Every joint keeps its contract in the plane and in space; wrong, contradictory and redundant
joints are named.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies import Given, cable, rigid
from fmbs_skfem.core.errors import InputError, Reason, SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import outputs, solve_statics
from fmbs_skfem.systems import (
    At,
    System,
    assemble,
    check_joint,
    compile_system,
    compiled,
    eliminate,
    fields,
)
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads, springs
from fmbs_skfem.systems.measures import probes, stresses
from fmbs_skfem.systems.places import Draft

from .. import models
from ..models import segment
from .parts import A0, A1, B0, B1, BOB, C0, C1, beams, displaced, every_joint, swing

SPACES: list[dict[str, Any]] = [{"ancf": True}, {"degree": 3}, {"degree": 4, "continuity": 2}]
CASES = [
    pytest.param(dim, joint, id=f"{dim}-{joint.name}")
    for dim in (2, 3)
    for joint in every_joint(dim)
]


def gap(system: System, x: np.ndarray, time: float = 0.0) -> np.ndarray:
    return compiled.gap(compile_system(system), x, time)[0]


def test_every_type_is_tested() -> None:
    registered = {
        kind
        for kind in joints.Joint.known.values()
        if kind.__module__ == "fmbs_skfem.systems.connections.joints"
    }
    for dim in (2, 3):
        assert {type(joint) for joint in every_joint(dim)} == registered


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("dim, joint", CASES)
def test_contract(dim: int, joint: joints.Joint, space: dict[str, Any]) -> None:
    check_joint(beams(dim, **space), joint)


@dataclass(frozen=True)
class Loose(joints.Joint, word=None):
    """A joint that is not satisfied in the reference by 0.01."""

    name: str
    at: fields.Place

    def constrain(self, draft: Draft) -> None:
        first = draft.probes.add(draft.layout.read("joint", self.at))
        draft.constraints.row(self.name, "x", (1.0, -1, first, -1), (-1.01, -1, -1, -1))


def test_the_contract_finds_faults(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gap in the reference, a Jacobian and second derivatives off by 1e-6."""
    with pytest.raises(
        InputError, match=r"check_joint\(Loose\): gap in the reference.*got 1.000e-02"
    ):
        check_joint(beams(2), Loose("loose", A1))
    right, exact = compiled.gap, compiled.tangent
    joint = joints.RigidLink("link", A0, C1)
    check_joint(beams(2), joint)
    monkeypatch.setattr(
        compiled, "gap", lambda *state: (right(*state)[0], (1.0 + 1e-6) * right(*state)[1])
    )
    with pytest.raises(InputError, match=r"check_joint\(RigidLink\): Jacobian of row 'length'"):
        check_joint(beams(2), joint)
    monkeypatch.setattr(compiled, "gap", right)
    monkeypatch.setattr(
        compiled, "tangent", lambda *state, **more: (1.0 + 1e-6) * exact(*state, **more)
    )
    with pytest.raises(
        InputError, match=r"check_joint\(RigidLink\): second derivatives of row 'length'"
    ):
        check_joint(beams(2), joint)


@pytest.mark.parametrize("dim", [2, 3])
def test_rigid_motions_that_joints_allow(dim: int) -> None:
    """A pinned beam turned about its pin, a link turned about its ground point, a slider moved
    along its line: no gap.
    """
    a, _, _, bob = beams(dim)
    turn = np.eye(dim)
    turn[:2, :2] = [[0.6, -0.8], [0.8, 0.6]]
    pinned = assemble([a], [joints.Pin("pin", A0), joints.RigidLink("link", A1, (0.0,) * dim)])
    assert_allclose(gap(pinned, (a.reference @ turn.T).ravel()), 0.0, atol=1e-14)
    assert np.abs(gap(pinned, 1.1 * a.reference.ravel())).max() == pytest.approx(0.105)
    direction = np.array([1.0, -2.0, 0.5][:dim])
    slid = assemble([bob], [joints.Slider("slider", BOB, tuple(direction))])
    assert_allclose(gap(slid, bob.reference[0] + 0.7 * direction), 0.0, atol=1e-14)
    assert np.linalg.norm(gap(slid, bob.reference[0] + np.eye(dim)[0])) == pytest.approx(
        np.sqrt(1 - 1 / (direction @ direction))
    )


def test_a_clamp_and_a_weld_leave_the_stretch_free() -> None:
    """Only directions are fixed: a beam clamped at its start may stretch uniformly."""
    a = beams(3)[0]
    clamped = assemble([a], [joints.Clamp("clamp", A0)])
    assert_allclose(gap(clamped, 1.3 * a.reference.ravel()), 0.0, atol=1e-14)
    assert len(clamped.constraints.names) == 5


def test_a_weld_at_an_angle_keeps_the_angle() -> None:
    a, _, c, _ = beams(2)
    system = assemble([a, c], [joints.Weld("weld", A1, C0)])

    def turned(first: float, second: float) -> np.ndarray:
        """Both beams turned about the weld at (1, 0)."""
        parts = []
        for part, angle in ((a, first), (c, second)):
            R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            parts.append(
                (part.reference - np.outer(part.constant, [1.0, 0.0])) @ R.T
                + np.outer(part.constant, [1.0, 0.0])
            )
        return np.concatenate(parts).ravel()

    assert_allclose(gap(system, turned(0.9, 0.9)), 0.0, atol=1e-14)
    assert_allclose(gap(system, turned(0.9, 1.2)), [0.0, 0.0, np.sin(0.3)], atol=1e-14)


@pytest.mark.parametrize("dim", [2, 3])
def test_drives_follow_their_histories(dim: int) -> None:
    """The angle of the slope and the displacement are those of the histories at every time."""
    _, _, c, bob = beams(dim)
    angle = float(swing(np.array(0.4)))
    axis = np.array([0.0, 0.6, 0.8])
    drive = joints.DrivenAngle("drive", C0, swing, None if dim == 2 else tuple(axis))
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    R = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    if dim == 2:
        R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    driven = assemble([c], [drive])
    assert_allclose(gap(driven, (c.reference @ R.T).ravel(), 0.4), 0.0, atol=1e-14)
    assert np.abs(gap(driven, c.reference.ravel(), 0.4)).max() > 0.1
    moved = assemble(
        [bob], [joints.DrivenPosition("drive", BOB, (swing, *(np.zeros_like,) * (dim - 1)))]
    )
    assert_allclose(gap(moved, bob.reference[0] + angle * np.eye(dim)[0], 0.4), 0.0, atol=1e-14)


def test_contradictory_joints_are_named() -> None:
    """The tip of a beam held at two points 0.1 m apart."""
    two = [joints.Pin("left pin", A1), joints.Pin("right pin", A1)]
    system = displaced(assemble(beams(2), two), ("right pin", "x"), 0.1)
    with pytest.raises(
        SolverError, match=r"contradict each other: .*(left|right) pin\.x by 0\.1 m"
    ) as caught:
        eliminate(system)
    assert caught.value.reason is Reason.INCONSISTENT
    assert caught.value.worst[0][1] == pytest.approx(0.1)


def test_redundant_joints_are_noticed_and_left_out() -> None:
    """A pin where a clamp is: two rows more, the same system."""
    clamp, pin = joints.Clamp("clamp", A0), joints.Pin("spare", A0)
    once = eliminate(assemble(beams(3), [clamp]))
    with pytest.warns(Notice, match=r"redundant constraint rows are left out .*(clamp|spare)\.x"):
        twice = eliminate(assemble(beams(3), [clamp, pin]))
    assert twice.size == once.size
    z = np.random.default_rng(2).normal(size=once.size)
    assert np.abs(gap(assemble(beams(3), [clamp]), twice.lift(z))).max() < 1e-12


def test_a_pin_elsewhere_moves_the_initial_state_with_a_notice() -> None:
    system = displaced(assemble(beams(2), [joints.Pin("pin", A1)]), ("pin", "x"), -0.05)
    with pytest.warns(Notice, match=r"initial state is moved.*: pin\.x by 0\.05$"):
        moved = eliminate(system)
    assert np.abs(gap(system, moved.lift(moved.x0))).max() < 1e-12


@pytest.mark.parametrize(
    "dim, joint, named",
    [
        (
            2,
            joints.Pin("pin", At("aa", "left")),
            r"joint 'pin': expected one of the bodies a, b, c, bob, got 'aa'; did you mean 'a'",
        ),
        (
            2,
            joints.Pin("pin", At("a", "lft")),
            "body 'a': expected one of its points .*did you mean 'left'",
        ),
        (2, joints.Pin("pin", At("a", 1.2)), "an arc length between 0 and 1 m"),
        (2, joints.Pin("pin", A0, (0.0, 0.0, 0.0)), "joint 'pin': expected 2 finite numbers"),
        (
            2,
            joints.Pin("pin", A0, (0.0, np.nan)),
            "joint 'pin'.to: expected an At or a sequence, in it a finite number",
        ),
        (
            3,
            joints.Pin("pin", A0, B1),
            r"joint 'pin': expected a.left and b.right at one point, got a gap of 2 m",
        ),
        (3, joints.Weld("weld", A1, C0), "parallel slopes in space, got an angle of 36.87 deg"),
        (2, joints.Clamp("clamp", BOB), "body 'bob': expected a body with a slope"),
        (
            2,
            joints.RigidLink("link", A1, B0),
            r"'link'\.length: expected a positive length .*use a pin",
        ),
        (
            2,
            joints.RigidLink("link", A0, B1, -1.0),
            r"'link'\.length: expected a length .*> 0, got -1",
        ),
        (
            2,
            joints.Slider("slider", A0, (0.0, 0.0)),
            r"'slider'\.direction: expected a non-zero vector",
        ),
        (
            3,
            joints.DrivenAngle("drive", A0, swing),
            r"'drive'\.axis: expected the axis of rotation",
        ),
        (
            3,
            joints.DrivenPosition("drive", A0, (swing, swing)),
            r"'drive'\.displacement: expected 3 functions of time, got 2",
        ),
        (2, "hinge", "joints: expected a joint, got str"),
    ],
)
def test_wrong_joints_are_named(dim: int, joint: Any, named: str) -> None:
    with pytest.raises(InputError, match=named):
        assemble(beams(dim), [joint])


@pytest.mark.filterwarnings("error::fmbs_skfem.core.notices.Notice")
@pytest.mark.parametrize("between, force", [(False, 0.4), (True, 1.0)])
def test_rods_of_other_stiffness_share_no_slope(between: bool, force: float) -> None:
    """Rods of EA and 4 EA pulled by 1 N: one stretch at the weld makes EA times it 1/2.5 and 4/2.5
    N, a hub between leaves 1 N.
    """
    section = Given(EA=1e5, EI=10.0, rhoA=1.0)
    a, b = (
        cable(n, segment(4, (k, 0, 0), (k + 1, 0, 0)), replace(section, EA=s * 1e5), dim=2)
        for k, s, n in ((0, 1, "a"), (1, 4, "b"))
    )
    hub = rigid.rigid("hub", 1e-3, 1e-3, (1.0, 0.0), dim=2)
    welds = (
        [joints.Weld(f"weld {end.body}", end, At("hub", "frame")) for end in (A1, B0)]
        if between
        else [joints.Weld("weld", A1, B0)]
    )
    pull, end = (
        loads.PointForce("pull", B1, (1.0, 0.0)),
        {"slope": probes.Slope(A1, "x"), "N": stresses.SectionForces(A1)},
    )
    with nullcontext() if between else pytest.warns(Notice, match=r"EA is 1e\+05 N and 4e\+05 N"):
        system = assemble(
            [a, b, hub][: 2 + between], [joints.Clamp("root", A0), *welds], [pull], outputs=end
        )
    found = outputs(solve_statics(eliminate(system), 1))
    assert 1e5 * (found["slope"][-1] - 1.0) == pytest.approx(force, rel=1e-4)
    assert found["N_N"][-1] == pytest.approx(1.0, rel=1e-8)


@pytest.mark.parametrize("to", ["right", 1.0])
def test_a_place_is_not_joined_to_itself(to: str | float) -> None:
    """However it is called; both ends of a line that is closed are two places at one point."""
    beam = cable("beam", segment(4), models.SECTION, models.MATERIAL, dim=2)
    with pytest.raises(InputError, match=r"expected another place, got 'beam.* itself"):
        assemble([beam], [joints.Pin("j", At("beam", "right"), At("beam", to))])
    with pytest.raises(InputError, match=r"expected another place, got 'beam.* itself"):
        assemble(
            [beam],
            [],
            [springs.SpringDamper("s", At("beam", "right"), At("beam", to), stiffness=1.0)],
        )
