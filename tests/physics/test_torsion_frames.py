"""Frames and rings of beams with torsion and shear against published figures: an elbow that swings,
buckling, a twisted ring.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from fmbs_skfem.bodies import sections
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.body import Body
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.bodies.sections import BeamSection
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    buckling,
    energies,
    integrate,
    outputs,
    solve_equilibria,
    vibration_modes,
)
from fmbs_skfem.shapes import curves
from fmbs_skfem.systems import At, System, assemble, eliminate, joints, loads
from fmbs_skfem.systems.connections.constraint_functions import Joint, mark, where
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.places import Draft

# Simo and Vu-Quoc, Comput. Methods Appl. Mech. Eng. 66 (1988) 125-161: z of the elbow, read off by
# the authors of AeroBeams.jl
ELBOW = np.array(
    [
        [0.96, 1.027], [1.923, 4.167], [2.718, 5.347], [3.048, 5.504], [3.6, 5.242], [4.021, 4.273], [4.927, 3.024],
        [6.129, 2.477], [6.905, 2.687], [7.901, 1.959], [8.694, 0.0439], [9.606, -2.337], [10.31, -3.659], [10.819, -3.871],
        [11.476, -3.164], [12.364, -0.774], [13.694, 1.161], [14.718, 0.299], [16.189, -0.963], [17.109, -1.376],
        [18.215, -1.033], [19.837, -2.235], [20.831, -2.733], [21.98, -1.27], [23.143, 2.185], [24.714, 5.955], [25.16, 6.105],
        [26.162, 5.237], [27.736, 3.812], [28.944, 2.163], [29.892, -0.025],
    ]
)  # fmt: skip


def leg(
    name: str, a: Sequence[float], b: Sequence[float], cells: int, section: BeamSection
) -> Body:
    """A straight beam from a to b, the y axis of its section that of z."""
    start, end = np.array(a, dtype=float), np.array(b, dtype=float)
    length = float(np.linalg.norm(end - start))
    line = curves.Line(
        np.linspace(0.0, length, cells + 1),
        curves.Straight(start, end, length),
        {"left": 0.0, "right": length},
        None,
    )
    return beam(name, line, section, direction=np.array([0.0, 0.0, 1.0]))


def angled(first: Body, second: Body) -> list[joints.Joint]:
    """The first leg clamped, the second one welded to its end."""
    return [
        joints.Clamp("root", At(first.name, "left")),
        joints.Weld("corner", At(second.name, "left"), At(first.name, "right")),
    ]


def test_an_elbow_swings_for_thirty_seconds() -> None:
    """Legs of 10, EA = GA = 1e6, EI = GJ = 1e3, mass 1 and inertia 10 a length; a push of up to 50
    out of the plane for 2 s.
    """
    section = BeamSection(np.diag([1e6, 1e6, 1e6, 1e3, 1e3, 1e3]), np.diag([1.0, 10.0, 10.0]))
    legs = (
        leg("one", (0, 0, 0), (10, 0, 0), 4, section),
        leg("two", (10, 0, 0), (10, 10, 0), 4, section),
    )
    push = loads.PointForce(
        "push",
        At("one", "right"),
        (0.0, 0.0, 1.0),
        history=lambda t: np.interp(t, [0, 1, 2], [0, 50, 0]),
    )
    sensed = {"elbow": probes.Position(At("one", "right"))}
    motion = integrate(
        eliminate(assemble(list(legs), angled(*legs), [push], outputs=sensed)),
        GeneralizedAlpha(0.025, 0.9),
        30.0,
    )
    z, (times, read) = outputs(motion)["elbow_z"], ELBOW.T

    # points read off steep flanks err by their times, the highest ones by their heights alone
    off = np.interp(times, motion.times, z) - read
    assert np.sqrt(np.mean(off**2)) < 0.06 * np.abs(read).max()
    assert z[np.abs(motion.times - 3.0) < 0.5].max() == pytest.approx(5.504, rel=5e-3)
    assert z[np.abs(motion.times - 25.0) < 0.5].max() == pytest.approx(6.105, rel=5e-3)

    free = energies(motion)[:, :2].sum(axis=1)[motion.times > 2.0]
    assert np.ptp(free) < 1e-3 * free[0]


def test_a_right_angle_frame_buckles_out_of_its_plane() -> None:
    """Argyris 1979, Simo and Vu-Quoc 1986: 1.088 to 1.09 at the end of the second leg, along the
    first.
    """
    section = sections.Rectangular(0.6, 30.0).of_beam(sections.Material(71240.0, 1e-9, 0.31))
    legs = (
        leg("one", (0, 0, 0), (240, 0, 0), 8, section),
        leg("two", (240, 0, 0), (240, -240, 0), 8, section),
    )
    pull = loads.PointForce("F", At("two", "right"), (1.0, 0.0, 0.0))
    factors = buckling(eliminate(assemble(list(legs), angled(*legs), [pull])), 2).factors
    assert factors[factors > 0.0].min() == pytest.approx(1.088, rel=5e-3)


GJ = 5.0  #: of the ring


#: of the ring, where it turns about its own direction
END, TANGENT = (
    At("rod", "right"),
    (1.0, 0.0, 0.0),
)


@dataclass(frozen=True)
class Level(Joint, word=None):
    """A point keeps its z = 0."""

    name: str
    at: At

    def constrain(self, draft: Draft) -> None:
        mark(self, draft, "level", self.at)
        first = draft.probes.add(draft.layout.read(where(self), self.at))
        draft.constraints.row(self.name, "z", (1.0, -1, first + 2, -1))


def ring(cells: int) -> tuple[Body, list[joints.Joint]]:
    """A rod of length 1 with EI = 1 and GJ, straight by itself, and closed to a ring, whose end may
    turn about its direction.

    As it is as stiff in all directions, only its mesh holds it against a tilt of its plane.
    """
    radius = 0.5 / np.pi

    def circle(xi: np.ndarray, derivative: int = 0) -> np.ndarray:
        a, zero = np.asarray(xi) / radius, np.zeros(len(xi))
        point = np.stack([radius * np.sin(a), radius * (1.0 - np.cos(a)), zero], axis=1)
        return point if derivative == 0 else np.stack([np.cos(a), np.sin(a), zero], axis=1)

    section = BeamSection(np.diag([1e6, 1e6, 1e6, GJ, 1.0, 1.0]), np.diag([1.0, 1e-6, 1e-6]))
    line = curves.Line(
        np.linspace(0.0, 1.0, cells + 1), circle, {"left": 0.0, "middle": 0.5, "right": 1.0}, None
    )
    part = beam("rod", line, section, direction=np.array([0.0, 0.0, 1.0]))
    assert part.cells is not None
    rows, first = part.cells.section.copy(), Law.BEAM.section.index("kappa1")
    rows[first : first + 3] = 0.0  # it would be straight
    part = replace(part, cells=replace(part.cells, section=rows))
    return part, [
        joints.Clamp("root", At("rod", "left")),
        joints.Revolute("end", END, axis=TANGENT),
    ]


def twisted_ring(cells: int, *more: joints.Joint) -> System:
    """The ring with more joints, its end twisted by t [rad]."""
    part, held = ring(cells)
    return eliminate(
        assemble(
            [part], [*held, *more, joints.DrivenAngle("twist", END, lambda t: t, axis=TANGENT)]
        )
    )


LEVEL = Level("level", At("rod", "middle"))  #: against a tilt of the plane


def test_a_ring_buckles_under_twist() -> None:
    """Zajac 1962: a straight rod that is closed to a ring buckles at a twist of 2 pi sqrt(3) EI /
    GJ.

    The square of the frequency at which it leaves its plane falls to zero there: a cubic through
    four twists below.
    """
    system = twisted_ring(24, LEVEL)
    critical = 2.0 * np.pi * np.sqrt(3.0) / GJ
    twists = np.array([0.6, 0.7, 0.8, 0.9])
    path = solve_equilibria(system, critical * np.append(0.0, twists))
    squares = np.array([vibration_modes(system, 2, x).squares for x in path.x[1:]])
    assert (np.diff(squares, axis=0) < 0.0).all()
    assert (squares > 0.0).all()
    assert np.polyval(np.polyfit(squares[:, 1] / squares[0, 1], twists, 3), 0.0) == pytest.approx(
        1.0, rel=5e-3
    )


def test_stresses_without_loads_do_not_change_what_buckles() -> None:
    """They move the ring of stiff sections from its reference by 1e-5 of its size, which strains
    along the path must not feel.
    """
    factors = []
    for cells in (16, 24):
        part, held = ring(cells)
        found = buckling(
            eliminate(assemble([part], [*held, LEVEL], [loads.Moment("M", END, TANGENT)])), 2
        ).factors
        assert found[0] == pytest.approx(-found[1], rel=1e-4)  # twisted to the left or to the right
        factors.append(found[0])
    assert factors[0] == pytest.approx(factors[1], rel=1e-2)
