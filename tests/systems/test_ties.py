"""Faces of solids with other meshes, tied."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem import dynamics
from fmbs_skfem.bodies import Body
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.shapes.solids import facing, solid
from fmbs_skfem.systems import assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.connections.ties import Tie
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures.probes import Reaction
from fmbs_skfem.systems.measures.recovered import RecoveredStress

from ..solids import HEXA, TETRA, bar, box

HALF = (0.5, 0.1, 0.1)
MESHES = [
    (TETRA, (2, 2, 2), TETRA, (2, 3, 3)),
    (TETRA, (2, 3, 2), HEXA, (2, 2, 3)),
    (HEXA, (2, 1, 1), HEXA, (2, 3, 2)),
]


def halves(
    one: type, cells: tuple[int, int, int], two: type, other: tuple[int, int, int]
) -> list[Body]:
    """Two bars, one behind the other."""
    first = bar(box(cells, HALF, one), name="a")
    return [first, bar(box(other, HALF, two), name="b", origin=[0.5, 0.0, 0.0])]


@pytest.mark.parametrize("meshes", MESHES)
@pytest.mark.parametrize("swapped", [False, True])
def test_a_constant_stress_passes(meshes: tuple, swapped: bool) -> None:  # type: ignore[type-arg]
    held = [
        joints.HeldFace(f"{body}.{face}", body, (face,), axis)
        for body in "ab"
        for face, axis in (("front", "y"), ("bottom", "z"))
    ]
    tie = Tie("tie", *(("b", "a") if swapped else ("a", "b")))
    load = loads.SurfaceLoad("pull", "b", (200.0, 0.0, 0.0), faces=("right",))
    out = {"a": RecoveredStress("a", "right"), "b": RecoveredStress("b", "left")}
    system = assemble(
        halves(*meshes),
        [joints.HeldFace("x", "a", ("left",), "x"), *held, tie],
        [load],
        outputs=out,
    )
    found = dynamics.outputs(dynamics.solve_statics(eliminate(system), 1))
    for body in "ab":
        assert float(found[f"{body}_1"][-1]) == pytest.approx(200.0, rel=0.012)
        assert float(found[f"{body}_3"][-1]) == pytest.approx(0.0, abs=1.0)


def test_a_bar_of_two_is_bent_as_one() -> None:
    load = loads.SurfaceLoad("push", "b", (0.0, 0.0, -1.0), faces=("right",))
    held = joints.HeldFace("hold", "a", ("left",))
    bodies = halves(TETRA, (3, 2, 2), HEXA, (3, 2, 1))
    ends = []
    for parts, more in ((bodies, [Tie("tie", "a", "b")]), ([bar(box((6, 2, 2)), name="b")], [])):
        hold = held if more else joints.HeldFace("hold", "b", ("left",))
        system = eliminate(assemble(parts, [hold, *more], [load]))
        moved = system.lift(dynamics.solve_statics(system, 1).x[-1]) - system.lift(system.x0)
        ends.append(np.abs(moved).max())
    assert ends[0] == pytest.approx(ends[1], rel=5e-3)


def sector(inner: float, outer: float):  # type: ignore[no-untyped-def]
    """Nodes of a box as a quarter of a ring."""

    def shape(x: np.ndarray) -> np.ndarray:
        r = inner + (outer - inner) * x[:, 0]
        angle = 0.5 * np.pi * x[:, 1]
        return np.column_stack([r * np.cos(angle), r * np.sin(angle), x[:, 2]])

    return shape


def rings(**place: object) -> list[Body]:
    """Two quarters, one inside the other, whose cells have no node in common."""
    inner = box((3, 5, 1), (1.0, 1.0, 0.2), HEXA, shape=sector(1.0, 1.5))
    outer = box((3, 8, 1), (1.0, 1.0, 0.2), HEXA, shape=sector(1.5, 2.0))
    return [bar(inner, name="a", **place), bar(outer, name="b", **place)]


def test_rings_under_pressure() -> None:
    """A radial stress p (1 - 4/r^2)/3 and one around p (1 + 4/r^2)/3 [Lame]."""
    p = 2e3
    held = [
        joints.HeldFace(f"{body}.{face}", body, (face,), axis)
        for body in "ab"
        for face, axis in (("front", "y"), ("back", "x"), ("bottom", "z"), ("top", "z"))
    ]
    tie = Tie("tie", "a", "b", ("right",), ("left",))
    out = {"a": RecoveredStress("a", "right"), "b": RecoveredStress("b", "left")}
    load = loads.Pressure("p", "a", p, faces=("left",))
    system = eliminate(assemble(rings(), [*held, tie], [load], outputs=out))
    found = dynamics.outputs(dynamics.solve_statics(system, 1))
    for body in "ab":
        assert float(found[f"{body}_1"][-1]) == pytest.approx(p * (1 + 4 / 2.25) / 3, rel=0.02)
        assert float(found[f"{body}_3"][-1]) == pytest.approx(p * (1 - 4 / 2.25) / 3, rel=0.03)


def test_what_is_tied_flies_as_one_body() -> None:
    """Six motions without energy, wherever it stands, though curved meshes do not meet."""
    turn = Rotation.from_rotvec([0.3, 1.0, -2.0]).as_matrix()
    tie = Tie("tie", "a", "b", ("right",), ("left",))
    squares = []
    for place in ({}, {"origin": np.array([10.0, -3.0, 2.0]), "rotation": turn}):
        system = eliminate(assemble(rings(**place), [tie]))
        squares.append(dynamics.vibration_modes(system, 8).squares)
    for one in squares:
        assert np.abs(one[:6]).max() < 1e-10 * one[6]
    assert_allclose(squares[1][6:], squares[0][6:], rtol=1e-6)


def test_a_block_on_a_plate_leaves_the_rest_free() -> None:
    """The tie knows the face that lies wholly on the other, whichever is finer."""
    block = bar(box((1, 1, 1), (0.1, 0.1, 0.1), HEXA), name="a", origin=[0.43, 0.0, 0.1])
    plate = bar(box((10, 3, 2), (1.0, 0.1, 0.1), HEXA), name="b")
    mass = [assemble([block, plate], [Tie("tie", *pair)]) for pair in (("a", "b"), ("b", "a"))]
    assert [len(one.constraints.names) for one in mass] == [24, 24]
    block = bar(box((4, 1, 1), (0.1, 0.1, 0.1), HEXA), name="a", origin=[0.95, 0.0, 0.1])
    with pytest.warns(Notice, match=r"[45]\d\.\d% of the area of its smaller face lies on no face"):
        assemble([block, plate], [Tie("tie", "a", "b", ("bottom",), ("top",))])


@pytest.mark.parametrize(
    ("tie", "text"),
    [
        (Tie("tie", "a", "b", ("left",), ("left",)), "expected faces that touch, got 'a' and 'b'"),
        (Tie("tie", "a", "b", ("lid",)), "expected one of its faces"),
        (Tie("tie", "a", "c"), "expected one of the bodies a, b"),
    ],
)
def test_ties_that_cannot_be(tie: Tie, text: str) -> None:
    with pytest.raises(InputError, match=text):
        assemble(halves(*MESHES[0]), [tie])


def test_places_on_faces_are_found_again() -> None:
    mesh = box((3, 4, 2), (1.0, 1.0, 0.2), TETRA, shape=sector(1.0, 1.5))
    faces = mesh.faces["right"]
    points = solid.face_points(mesh, faces, 3)[2]
    number, xi, apart = facing.on_faces(mesh, faces, points.reshape(-1, 3))
    assert_allclose(number, np.repeat(np.arange(len(faces)), points.shape[1]))
    values = solid.elements.basis(mesh.kind, xi)[:, 0]
    nodes = mesh.reference[mesh.nodes[faces[number, 0]]]
    assert_allclose(np.einsum("xb,xbc->xc", values, nodes), points.reshape(-1, 3), atol=1e-12)
    assert apart.max() < 1e-9


def test_forces_of_a_tie() -> None:
    """F on the other body, and F times the arm."""
    force, arm = 30.0, 0.5
    tie = Tie("tie", "b", "a")
    load = loads.SurfaceLoad("push", "b", (0.0, 0.0, force / 0.01), faces=("right",))
    hold = joints.HeldFace("hold", "a", ("left",))
    raw = assemble(halves(*MESHES[1]), [hold, tie], [load], outputs={"f": Reaction("tie")})
    found = dynamics.outputs(dynamics.solve_statics(eliminate(raw), 1))
    assert float(found["f_z"][-1]) == pytest.approx(-force, rel=1e-6)
    assert float(found["f_my"][-1]) == pytest.approx(force * arm, rel=1e-3)
