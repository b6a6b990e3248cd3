"""Degrees of freedom of mechanisms that textbooks count, and what a static problem leaves free."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest

from fmbs_skfem.bodies import Body, Given, Material, cable, point_mass
from fmbs_skfem.bodies.plate import Rim, plate
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.systems import At, System, assemble, free_motions
from fmbs_skfem.systems.connections import joints, mechanism
from fmbs_skfem.systems.forces import loads

from ..models import cantilever, double_pendulum, mass_pendulum, polyline, segment, spin_up
from .parts import displaced
from .rigid_parts import grid

SECTION = Given(EA=2000.0, EI=3.0, rhoA=0.5)
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
Point = Sequence[float]


def link(name: str, start: Point, end: Point, dim: int, **places: Point) -> Body:
    """A rigid link with the places `A` and `B` at its ends."""
    named = {
        "A": tuple(start)[:dim],
        "B": tuple(end)[:dim],
        **{key: tuple(at)[:dim] for key, at in places.items()},
    }
    middle = 0.5 * (np.array(start) + np.array(end))[:dim]
    return rigid(
        name, 1.0, 0.1 if dim == 2 else np.array([0.1, 0.1, 0.1]), middle, dim=dim, places=named
    )


def hinge(name: str, at: At, to: At | None = None, axis: Point | None = None) -> joints.Revolute:
    return joints.Revolute(name, at, to, None if axis is None else tuple(axis))


def loop(points: Sequence[Point], dim: int, axes: Sequence[Point | None]) -> System:
    """A closed chain of rigid links on the ground with hinges at the points."""
    links = [link(f"l{k}", a, b, dim) for k, (a, b) in enumerate(pairwise(points))]
    last = len(links) - 1
    hinges = [hinge("h0", At("l0", "A"), None, axes[0])]
    hinges += [
        hinge(f"h{k + 1}", At(f"l{k}", "B"), At(f"l{k + 1}", "A"), axes[k + 1]) for k in range(last)
    ]
    return assemble(links, [*hinges, hinge(f"h{last + 1}", At(f"l{last}", "B"), None, axes[-1])])


def unheld(system: System) -> tuple[free_motions.FreeMotion, ...]:
    """Motions that nothing holds, where weight holds none."""
    free, hung = free_motions.unsupported(system)
    assert hung == ()
    return free


def test_clamps_leave_no_rigid_motion() -> None:
    """Of rigid bodies, rims and points of plates in space, nor in the plane."""
    body = link("l", (0, 0, 0), (0.3, 0.1, 0.2), 3)
    sheet, flat = (
        plate("p", grid(2, 2), 0.01, Material(70e9, 2700.0), rims={"rim": Rim(("left",))}),
        link("l", X, Y, 2),
    )
    cases = [(body, "A"), (body, ""), (sheet, "rim"), (sheet, "middle"), (flat, "B")]
    for part, place in cases:
        assert (
            mechanism.analyse(assemble([part], [joints.Clamp("c", At(part.name, place))])).at_start
            == 0
        )


FOUR_BAR = [(0, 0, 0), (0.1, 0.2, 0), (0.6, 0.4, 0), (0.5, 0, 0)]


def bennett(
    a: float, alpha: float, beta: float, theta: float
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Points and axes of a linkage with sin(alpha) / a = sin(beta) / b, closed at the angle theta.

    Chain of T = Rz(theta_i) Tx(a_i) Rx(alpha_i) with theta_1 + theta_3 = theta_2 + theta_4 = 2 pi
    and tan(theta_1 / 2) tan(theta_2 / 2) = sin((beta + alpha) / 2) / sin((beta - alpha) / 2).
    """
    b = a * np.sin(beta) / np.sin(alpha)
    other = 2 * np.arctan(
        np.sin((beta + alpha) / 2) / np.sin((beta - alpha) / 2) / np.tan(theta / 2)
    )
    T, points, axes = np.eye(4), [], []
    for angle, length, twist in (
        (theta, a, alpha),
        (other, b, beta),
        (-theta, a, alpha),
        (-other, b, beta),
    ):
        points.append(T[:3, 3].copy())
        axes.append(T[:3, 2].copy())
        c, s, ct, st = np.cos(angle), np.sin(angle), np.cos(twist), np.sin(twist)
        T = T @ np.array(
            [
                [c, -s * ct, s * st, length * c],
                [s, c * ct, -c * st, length * s],
                [0, st, ct, 0],
                [0, 0, 0, 1],
            ]
        )
    assert np.abs(T - np.eye(4)).max() < 1e-12
    return points, axes


def counts(system: System) -> tuple[int, int, int]:
    """Degrees of freedom, Gruebler's count, rows too many."""
    found = mechanism.analyse(system)
    return found.mobility, found.gruebler, len(found.overconstrained)


def test_a_planar_four_bar_has_one_degree_of_freedom() -> None:
    """3 * 3 - 4 * 2 = 1."""
    system = loop(FOUR_BAR, 2, [None] * 4)
    assert counts(system) == (1, 1, 0)
    assert mechanism.analyse(system).at_start == 1


def test_a_four_bar_of_revolutes_in_space_moves_although_gruebler_counts_minus_two() -> None:
    """3 * 6 - 4 * 5 = -2: three rows too many, one degree of freedom (the textbook case of
    overconstraint).
    """
    found = mechanism.analyse(loop(FOUR_BAR, 3, [Z] * 4))
    assert (found.mobility, found.gruebler, found.free) == (1, -2, 1)
    assert len(found.overconstrained) == 3
    names = {name.partition(".")[0] for one in found.overconstrained for name in (one.row, *one.on)}
    assert names == {"h0", "h1", "h2", "h3"}


def test_a_four_bar_with_one_axis_askew_is_a_structure() -> None:
    askew = (0.0, np.sin(0.1), np.cos(0.1))
    assert counts(loop(FOUR_BAR, 3, [Z, askew, Z, Z]))[0] == 0


def test_one_revolute_and_a_cylindrical_spherical_chain_is_not_overconstrained() -> None:
    """RSSR with a twist of its coupler: 3 * 6 - (5 + 3 + 3 + 5) = 2, one of them the coupler about
    its own line.
    """
    (a, b, c, d), axes = FOUR_BAR, (Z, X)
    parts = [link("crank", a, b, 3), link("coupler", b, c, 3), link("rocker", c, d, 3)]
    ties = [
        hinge("A", At("crank", "A"), None, axes[0]),
        joints.Spherical("B", At("crank", "B"), At("coupler", "A")),
        joints.Spherical("C", At("coupler", "B"), At("rocker", "A")),
        hinge("D", At("rocker", "B"), None, axes[1]),
    ]
    assert counts(assemble(parts, ties)) == (2, 2, 0)


@pytest.mark.parametrize("theta", [0.7, 2.1])
def test_bennetts_linkage_moves(theta: float) -> None:
    """G. T. Bennett, Engineering 76 (1903) 777: four revolutes whose axes are neither parallel nor
    meet, one degree of freedom.
    """
    points, axes = bennett(1.0, 0.5, 1.1, theta)
    assert counts(loop(points, 3, axes)) == (1, -2, 3)


def test_four_revolutes_off_bennetts_condition_are_a_structure() -> None:
    points, axes = bennett(1.0, 0.5, 1.1, 0.7)
    turned = np.cross(axes[1], [0.3, 0.2, 0.1])
    axes[1] = axes[1] + 0.05 * turned
    assert counts(loop(points, 3, axes))[0] == 0


def test_a_parallelogram_with_a_third_crank_is_overconstrained_by_one() -> None:
    """4 * 3 - 6 * 2 = 0, and one degree of freedom because the cranks are parallel and equal."""
    up = np.array([0.3, 0.4, 0.0])
    feet = [np.array([x, 0.0, 0.0]) for x in (0.0, 0.5, 1.2)]
    bar = link("bar", feet[0] + up, feet[2] + up, 2, M=feet[1] + up)
    cranks = [link(f"c{k}", foot, foot + up, 2) for k, foot in enumerate(feet)]
    ties = [hinge(f"g{k}", At(f"c{k}", "A")) for k in range(3)]
    ties += [hinge(f"t{k}", At(f"c{k}", "B"), At("bar", place)) for k, place in enumerate("AMB")]
    assert counts(assemble([bar, *cranks], ties)) == (1, 0, 1)


def test_a_folded_parallelogram_is_in_a_singular_position() -> None:
    """All hinges on one line: two motions at the start, one a little away from it."""
    found = mechanism.analyse(
        loop([(0, 0, 0), (0.3, 0, 0), (1.3, 0, 0), (1.0, 0, 0)], 2, [None] * 4)
    )
    assert (found.mobility, found.at_start, found.gruebler) == (1, 2, 1)


def test_a_straight_double_pendulum_of_beams_has_four_degrees_of_freedom_in_space() -> None:
    """A straight line turns about two axes only: 2 * 5 - 2 * 3 = 4; two rigid bodies also turn
    about their own, 2 * 6 - 6 = 6.
    """
    found = mechanism.analyse(double_pendulum(4, all_multipliers=True))
    assert found.bodies == {"I": 5, "II": 5}
    assert (found.mobility, found.gruebler, found.free, len(found.overconstrained)) == (4, 4, 4, 0)
    a, b = link("a", (0, 0, 0), (1, 0, 0), 3), link("b", (1, 0, 0), (1, 1, 0), 3)
    ties = [joints.Spherical("A", At("a", "A")), joints.Spherical("B", At("a", "B"), At("b", "A"))]
    assert counts(assemble([a, b], ties)) == (6, 6, 0)


def test_a_drive_takes_the_degree_of_freedom_of_its_hinge() -> None:
    found = mechanism.analyse(spin_up(4, all_multipliers=True))
    assert (found.mobility, found.gruebler, found.free) == (1, 1, 0)
    assert [(joint.name, joint.rows, joint.driven, joint.ground) for joint in found.joints] == [
        ("hinge", 2, False, True),
        ("drive", 1, True, True),
    ]


@pytest.mark.parametrize("angle", [0.0, 0.8])
def test_a_crank_slider_has_one_degree_of_freedom_also_at_its_dead_centre(angle: float) -> None:
    """2 * 3 + 2 - (3 * 2 + 1) = 1."""
    B = np.array([np.cos(angle), np.sin(angle), 0.0])
    C = np.array([B[0] + np.sqrt(4 - B[1] ** 2), 0.0, 0.0])
    parts = [link("crank", (0, 0, 0), B, 2), link("rod", B, C, 2), point_mass("slider", 0.5, C[:2])]
    ties = [
        hinge("A", At("crank", "A")),
        hinge("B", At("crank", "B"), At("rod", "A")),
        hinge("C", At("rod", "B"), At("slider", "center")),
        joints.Slider("guide", At("slider", "center"), (1, 0)),
    ]
    assert counts(assemble(parts, ties)) == (1, 1, 0)


def test_flexible_bodies_count_as_rigid_ones() -> None:
    """A plate with a rim as a crank, a beam as the rod and a mass point: three in the plane, and 5
    of a straight line in space.
    """
    shape = grid(2, 2)
    for dim, axis in ((2, None), (3, Z)):
        sheet = plate(
            "sheet", shape, 0.02, Material(1e5, 500.0), dim=dim, rims={"rim": Rim(("left",))}
        )
        rod = cable("rod", segment(3, (1, 1, 0), (2, 1, 0)), SECTION, dim=dim)
        ties = [
            hinge("A", At("sheet", "rim"), None, axis),
            joints.Pin("B", At("sheet", "corner"), At("rod", "left")),
        ]
        found = mechanism.analyse(assemble([sheet, rod], ties))
        assert found.bodies == ({"sheet": 3, "rod": 3} if dim == 2 else {"sheet": 6, "rod": 5})
        assert found.mobility == (2 if dim == 2 else 3)


def test_an_edge_counts_as_the_motions_that_it_takes() -> None:
    """A clamped edge is six rows of an engineer, a hinged one five, whatever the mesh."""
    sheet = plate("sheet", grid(3, 3), 0.02, Material(1e5, 500.0))
    for slope, rows in (("z", 6), ("", 5)):
        found = mechanism.analyse(
            assemble([sheet], [joints.Edge("edge", "sheet", ("left",), slope=slope)])
        )
        assert (found.joints[0].rows, found.mobility, found.gruebler) == (rows, 6 - rows, 6 - rows)


def test_a_curved_line_in_space_turns_about_three_axes() -> None:
    arc = [(np.cos(s), np.sin(s), 0.0) for s in np.linspace(0, 1, 5)]
    assert mechanism.analyse(assemble([cable("arc", polyline(np.array(arc)), SECTION)])).bodies == {
        "arc": 6
    }


def test_bodies_that_no_joint_ties_to_the_ground_are_named() -> None:
    parts = [
        link("a", (0, 0, 0), (1, 0, 0), 3),
        link("b", (1, 0, 0), (2, 0, 0), 3),
        link("c", (0, 1, 0), (1, 1, 0), 3),
    ]
    system = assemble(
        parts, [hinge("pin", At("a", "B"), At("b", "A"), Z), joints.Spherical("ball", At("c", "A"))]
    )
    found = mechanism.analyse(system)
    assert [group.bodies for group in found.floating] == [("a", "b")]
    assert [(group.bodies, group.ground) for group in found.groups] == [
        (("a", "b"), False),
        (("c",), True),
    ]
    assert found.mobility == 18 - 5 - 3


def test_gears_on_the_ground_stand_on_it() -> None:
    """Teeth resist a common turn of both wheels about either axis, as fixed axles do."""
    parts = [link("a", (0, 0, 0), (1, 0, 0), 2), link("b", (3, 0, 0), (4, 0, 0), 2)]
    ties = [
        hinge("A", At("a", "A")),
        hinge("B", At("b", "A")),
        joints.Gear("teeth", At("a", "A"), At("b", "A"), (12, 30)),
    ]
    found = mechanism.analyse(assemble(parts, ties))
    assert (found.mobility, found.gruebler) == (1, 1)
    assert found.joints[2].bodies == ("a", "b")
    assert found.joints[2].ground


def test_free_bodies_have_all_their_motions() -> None:
    found = mechanism.analyse(
        assemble([point_mass("p", 1.0, np.zeros(3)), link("a", (0, 0, 0), (1, 0, 0), 3)])
    )
    assert (found.mobility, found.gruebler, found.free) == (9, 9, 9)
    assert [group.bodies for group in found.floating] == [("p",), ("a",)]


def test_a_mass_on_a_rigid_rod_is_a_pendulum() -> None:
    assert counts(mass_pendulum((0.6, -0.8))) == (1, 1, 0)
    assert counts(mass_pendulum((0.6, 0.0, -0.8))) == (2, 2, 0)


def test_free_motions_of_a_static_problem_are_said_in_words() -> None:
    """A bar on one pin turns about it; a mass on a guide moves along it."""
    parts = [
        link("bar", (0.2, 0.1, 0), (1.2, 0.1, 0), 2),
        point_mass("mass", 1.0, np.array([3.0, 0.0])),
    ]
    ties = [hinge("pin", At("bar", "A")), joints.Slider("guide", At("mass", "center"), (0.6, 0.8))]
    said = sorted(str(motion) for motion in unheld(assemble(parts, ties)))
    assert len(said) == 2
    assert said[0] == "bar turns about (0.2, 0.1)"
    assert said[1] in ("mass moves along (0.6, 0.8)", "mass moves along (-0.6, -0.8)")


def test_the_axis_of_a_free_motion_in_space_is_that_of_the_hinge() -> None:
    bar = link("bar", (0, 0, 0), (1, 0, 0), 3)
    (motion,) = unheld(assemble([bar], [hinge("pin", At("bar", "A"), None, (0, 0.6, 0.8))]))
    v, w = motion.bodies["bar"]
    assert np.abs(np.cross(w, [0, 0.6, 0.8])).max() < 1e-12
    assert v == pytest.approx(np.cross(w, [0.5, 0, 0]), abs=1e-12)


def test_a_held_body_has_no_free_motion_and_a_spring_holds_too() -> None:
    assert unheld(cantilever(4, all_multipliers=True)) == ()
    bar, pin = link("bar", (0, 0, 0), (1, 0, 0), 2), hinge("pin", At("bar", "A"))
    spring = loads.TorsionSpring("spring", At("bar", "A"), stiffness=2.0)
    assert len(unheld(assemble([bar], [pin]))) == 1
    assert unheld(assemble([bar], [pin], [spring])) == ()


def test_a_straight_line_in_space_does_not_turn_about_itself() -> None:
    """Two balls at its ends hold a straight line; a curved one swings about the line between them."""
    points = [segment(4).points, np.array([(s, s * (1 - s), 0.0) for s in np.linspace(0, 1, 5)])]
    for line, free in zip(points, (0, 1), strict=True):
        beam = cable("beam", polyline(line), SECTION)
        ties = [
            joints.Spherical("A", At("beam", "left")),
            joints.Slider("B", At("beam", "right"), X),
        ]
        found = unheld(assemble([beam], ties))
        assert len(found) == free
    w = found[0].bodies["beam"][1]
    assert np.abs(np.cross(w, X)).max() < 1e-9 * np.linalg.norm(w)


@pytest.mark.parametrize(
    ("end", "dim", "free", "hung"),
    [
        ((0, -1), 2, 0, 1),
        ((0, 1), 2, 1, 0),
        ((0.6, -0.8), 2, 1, 0),
        ((0, 0, -1), 3, 1, 2),
        ((0, 0, 1), 3, 3, 0),
    ],
)
def test_weight_holds_what_hangs_and_nothing_else(
    end: Point, dim: int, free: int, hung: int
) -> None:
    """A bar on a ball hangs in its minimum of V = m g z; upright or inclined it falls, and nothing
    stops its spin.
    """
    bar = rigid(
        "bar",
        1.0,
        0.1 if dim == 2 else np.array([0.1, 0.1, 0.1]),
        0.5 * np.array(end),
        dim=dim,
        places={"A": (0.0,) * dim},
    )
    down = (0.0,) * (dim - 1) + (-9.81,)
    found = free_motions.unsupported(
        assemble([bar], [joints.Pin("A", At("bar", "A"))], [loads.Gravity(down)])
    )
    assert tuple(len(part) for part in found) == (free, hung)


def test_a_hanging_chain_of_two_bars_is_held_by_weight() -> None:
    parts = [link("a", (0, 0, 0), (0, -1, 0), 2), link("b", (0, -1, 0), (0, -3, 0), 2)]
    ties = [hinge("A", At("a", "A")), hinge("B", At("a", "B"), At("b", "A"))]
    free, hung = free_motions.unsupported(assemble(parts, ties, [loads.Gravity((0, -9.81))]))
    assert (len(free), len(hung)) == (0, 2)


def test_redundant_rows_are_named_with_those_they_follow_from() -> None:
    bar = link("bar", (0, 0, 0), (1, 0, 0), 2)
    found = mechanism.redundant(
        assemble([bar], [hinge("one", At("bar", "A")), hinge("two", At("bar", "A"))])
    )
    assert len(found) == 2
    for dependence in found:
        joint, _, label = dependence.row.partition(".")
        assert dependence.on == (f"{'two' if joint == 'one' else 'one'}.{label}",)
        assert dependence.gap == 0.0


def test_the_gap_of_contradicting_rows_is_found() -> None:
    bar = link("bar", (0, 0, 0), (1, 0, 0), 2)
    system = assemble([bar], [hinge("one", At("bar", "A")), joints.Pin("two", At("bar", "A"))])
    found = mechanism.redundant(displaced(system, ("two", "x"), 0.1))
    assert sorted(round(dependence.gap, 12) for dependence in found) == [0.0, 0.1]


def test_nonlinear_redundant_rows_of_rigid_loops_are_found() -> None:
    """The third crank of a parallelogram again: in all coordinates of rigid bodies one row is too
    many.
    """
    assert len(mechanism.redundant(loop(FOUR_BAR, 3, [Z] * 4))) == 3
    assert mechanism.redundant(loop(FOUR_BAR, 2, [None] * 4)) == ()
    assert mechanism.redundant(double_pendulum(4, all_multipliers=True)) == ()
