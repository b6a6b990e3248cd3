"""Beams with torsion and shear against closed forms and published figures, at stated numbers of
cells.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fmbs_skfem.bodies import rigid, sections
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.body import Body
from fmbs_skfem.bodies.sections import BeamSection
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    buckling,
    integrate,
    outputs,
    solve_statics,
    vibration_modes,
)
from fmbs_skfem.shapes import curves
from fmbs_skfem.systems import At, assemble, eliminate, joints, loads
from fmbs_skfem.systems.measures import probes

ROOT, TIP = At("beam", "left"), At("beam", "right")
CLAMP = joints.Clamp("root", ROOT)


def along(curve: curves.Curve, length: float, cells: int, section: BeamSection) -> Body:
    """A beam in equal cells along a curve, the y axis of its section that of z."""
    ends = {"left": 0.0, "right": length}
    line = curves.Line(np.linspace(0.0, length, cells + 1), curve, ends, None)
    return beam("beam", line, section, direction=np.array([0.0, 0.0, 1.0]))


def straight(cells: int, section: BeamSection, length: float = 1.0) -> Body:
    """A beam along x."""
    return along(
        curves.Straight(np.zeros(3), np.array([length, 0.0, 0.0]), length), length, cells, section
    )


def square(h: float, E: float = 1e9) -> BeamSection:
    """A square of side h without Poisson's ratio."""
    return sections.Rectangular(h, h).of_beam(sections.Material(E, 1000.0, 0.0))


def held(part: Body, load: loads.Load, steps: int = 1) -> dict[str, np.ndarray]:
    """Outputs of the equilibria of a beam that is clamped at its left end."""
    sensed = {"tip": probes.Position(TIP)}
    return outputs(
        solve_statics(eliminate(assemble([part], [CLAMP], [load], outputs=sensed)), steps)
    )


def elastica(load: float) -> tuple[float, float]:
    """Tip (x, z) / L of a cantilever under a dead force P across its end: theta'' = -P cos(theta),
    P L^2 / EI = load.
    """

    def bent(kappa: float) -> np.ndarray:
        rates = lambda s, y: [y[1], -load * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])]  # noqa: E731
        return np.asarray(
            solve_ivp(rates, (0.0, 1.0), [0.0, kappa, 0.0, 0.0], rtol=1e-11, atol=1e-12).y[:, -1]
        )

    x, z = bent(brentq(lambda kappa: bent(kappa)[1], 1.0, 4.6, xtol=1e-12))[2:]
    return float(x), float(z)


@pytest.mark.parametrize(
    ("cells", "error", "slender"), [(5, 4e-3, 1e4), (10, 5e-4, 1e4), (20, 1e-5, 1e3)]
)
def test_slender_beams_do_not_lock(cells: int, error: float, slender: float) -> None:
    section = square(1.0 / slender)
    found = held(
        straight(cells, section),
        loads.PointForce("F", TIP, (0.0, 0.0, 10.0 * section.stiffness[4, 4])),
        10,
    )
    np.testing.assert_allclose([found["tip_x"][-1], found["tip_z"][-1]], elastica(10.0), atol=error)


@pytest.mark.parametrize(
    ("turns", "cells", "slender", "error"), [(1, 16, 1e2, 1e-6), (2, 32, 1e3, 5e-6)]
)
def test_an_end_moment_rolls_a_beam_up(
    turns: int, cells: int, slender: float, error: float
) -> None:
    section = square(1.0 / slender)
    moment = (0.0, 2.0 * np.pi * turns * section.stiffness[4, 4], 0.0)
    found = held(straight(cells, section), loads.Moment("M", TIP, moment), 8 * turns)
    assert np.hypot(found["tip_x"][-1], found["tip_z"][-1]) < error


def test_a_bend_of_45_degrees() -> None:
    """Bathe and Bolourchi 1979; tip at F = 600 of splines of degree 3, 4 and 5 with 32 cells:
    (-23.5613, -13.6050, 53.4762).
    """
    R, EI = 100.0, 833300.0

    def arc(xi: np.ndarray, derivative: int = 0) -> np.ndarray:
        a, zero = np.asarray(xi) / R, np.zeros(len(xi))
        point = np.stack([R * np.sin(a), R * (1.0 - np.cos(a)), zero], axis=1)
        return point if derivative == 0 else np.stack([np.cos(a), np.sin(a), zero], axis=1)

    section = BeamSection(
        np.diag([1e7, 4166670.0, 4166670.0, EI, EI, EI]), np.diag([1.0, 1 / 12, 1 / 12])
    )
    found = held(
        along(arc, 0.25 * np.pi * R, 8, section), loads.PointForce("F", TIP, (0.0, 0.0, 600.0))
    )
    moved = np.array([found[f"tip_{c}"][-1] for c in "xyz"]) - arc(np.array([0.25 * np.pi * R]))[0]
    np.testing.assert_allclose(moved, [-23.5613, -13.6050, 53.4762], atol=1e-4 * 53.0)


@pytest.mark.parametrize(
    ("angle", "y", "z"),
    [
        (0, 0.0107141763, 0.0),
        (30, 0.0101116963, 0.07939482948),
        (60, 0.006604665004, 0.129887616),
        (90, 0.0, 0.146245978),
    ],
)
def test_princeton_beam(angle: float, y: float, z: float) -> None:
    """Beam elements of Obrezkov et al., Nonlinear Dyn. 109 (2022): a strip under its tip force at
    angles to its stiff direction.
    """
    section = BeamSection(
        np.diag([2.84191e6, 9.037e5, 9.037e5, 3.10338, 2.42873, 36.2794]),
        np.diag([0.1, 1e-6, 1e-7]),
    )
    part = along(
        curves.Straight(np.zeros(3), np.array([0.508, 0.0, 0.0]), 0.508), 0.508, 8, section
    )
    force = 8.896 * np.array([0.0, np.sin(np.radians(angle)), np.cos(np.radians(angle))])
    found = held(part, loads.PointForce("F", TIP, tuple(force)), 4)
    np.testing.assert_allclose(
        [found["tip_z"][-1], found["tip_y"][-1]], [y, z], atol=5e-3 * max(y, z)
    )


def test_frequencies_of_a_free_shaft() -> None:
    """Timoshenko's beam with Cowper's coefficient: 1499.55, 3956.31, 7330.90 Hz, each twice."""
    diameter, E = 0.03008, 210e9
    shaft = sections.Circular(diameter).of_beam(sections.Material(E, 7850.0, 0.3))
    assert shaft.stiffness[1, 1] / (E / 2.6 * 0.25 * np.pi * diameter**2) == pytest.approx(
        0.88636, abs=1e-5
    )
    found = vibration_modes(
        eliminate(assemble([straight(12, shaft, 0.3)])), 16
    ).angular_frequencies / (2.0 * np.pi)
    for wanted in (1499.55, 3956.31, 7330.90):
        assert np.sum(np.abs(found / wanted - 1.0) < 1e-4) == 2


@pytest.mark.parametrize("GA", [4e5, 1e8])
def test_directors_do_not_soften_a_beam(GA: float) -> None:
    """N L / EA and P L / GA + P L^3 / (3 EI) of small forces, of shear areas below and far above
    EA.
    """
    section = BeamSection(np.diag([1e6, GA, GA, 600.0, 800.0, 800.0]), np.diag([1.0, 0.0, 0.0]))
    found = held(straight(8, section), loads.PointForce("F", TIP, (1e-2, 0.0, 0.0)))
    assert found["tip_x"][-1] - 1.0 == pytest.approx(1e-2 / 1e6, rel=1e-6)
    found = held(straight(8, section), loads.PointForce("F", TIP, (0.0, 0.0, 1e-3)))
    assert found["tip_z"][-1] == pytest.approx(1e-3 * (1.0 / GA + 1.0 / 2400.0), rel=1e-6)


@pytest.mark.parametrize("slender", [4.0, 1e4])
def test_stocky_and_slender_beams_bend_and_shear(slender: float) -> None:
    """P L^3 / (3 EI) + P L / GA of a small force across cantilevers of L / h = 4 and 10 000."""
    section = square(1.0 / slender)
    P = 1e-5 * section.stiffness[4, 4]
    found = held(straight(8, section), loads.PointForce("F", TIP, (0.0, 0.0, P)))
    assert found["tip_z"][-1] == pytest.approx(
        P / (3.0 * section.stiffness[4, 4]) + P / section.stiffness[2, 2], rel=1e-5
    )


def test_a_shaft_is_twisted_by_two_turns() -> None:
    """phi = M L / GJ."""
    section = BeamSection(np.diag([1e8, 1e8, 1e8, 1.0, 1.0, 1.0]), np.diag([1.0, 1e-6, 1e-6]))
    turned = {"turn": probes.Angle(TIP, axis=(1.0, 0.0, 0.0)), "tip": probes.Position(TIP)}
    moment = loads.Moment("M", TIP, (4.0 * np.pi, 0.0, 0.0))
    found = outputs(
        solve_statics(
            eliminate(assemble([straight(32, section)], [CLAMP], [moment], outputs=turned)), 8
        )
    )
    assert found["turn"][-1] == pytest.approx(4.0 * np.pi, rel=5e-6)
    np.testing.assert_allclose([found[f"tip_{c}"][-1] for c in "xyz"], [1.0, 0.0, 0.0], atol=1e-9)


def test_an_end_couple_winds_a_helix() -> None:
    """Curvature and torsion of radius 10, height 50, two coils: the couple is along the helix's
    axis, as EI = GJ.
    """
    length, curvature, torsion = 135.24558, 0.0863323502, 0.0343505507
    section = BeamSection(np.diag([1e4, 1e4, 1e4, 1.0, 1.0, 1.0]), np.diag([1.0, 1e-3, 1e-3]))
    at = np.linspace(0.0, length, 9)[1:]
    sensed = {f"p{k}": probes.Position(At("beam", float(s))) for k, s in enumerate(at)}
    moment = loads.Moment("M", TIP, (torsion, 0.0, curvature))
    found = outputs(
        solve_statics(
            eliminate(assemble([straight(32, section, length)], [CLAMP], [moment], outputs=sensed)),
            4,
        )
    )
    w = np.hypot(curvature, torsion)
    axis, start = np.array([torsion, 0.0, curvature]) / w, np.array([1.0, 0.0, 0.0])
    along, across = axis * (axis @ start), start - axis * (axis @ start)
    for k, s in enumerate(at):
        point = (
            along * s
            + across * np.sin(w * s) / w
            + np.cross(axis, start) * (1.0 - np.cos(w * s)) / w
        )
        np.testing.assert_allclose([found[f"p{k}_{c}"][-1] for c in "xyz"], point, atol=2e-3)


# EI about its soft axis and GJ are 1; a force or moment in its plane bends it the stiff way
STRIP = BeamSection(np.diag([1e7, 1e6, 1e6, 1.0, 1.0, 1e4]), np.diag([1.0, 1e-6, 1e-6]))


def test_a_strip_buckles_sideways_under_a_force() -> None:
    """Prandtl, Michell 1899: P L^2 = 4.0125993 sqrt(EI GJ), where what it bends before is small."""
    strip = assemble([straight(8, STRIP)], [CLAMP], [loads.PointForce("F", TIP, (0.0, 0.0, -1.0))])
    found = buckling(eliminate(strip), 1)
    assert found.factors[0] == pytest.approx(4.0125993435789, rel=1e-4)


def test_a_strip_buckles_sideways_under_a_moment() -> None:
    """M L = pi/2 sqrt(EI GJ) of two dead forces along the strip, above and below its end."""
    arm = rigid.rigid(
        "arm",
        1.0,
        np.full(3, 1e-3),
        (1.0, 0.0, 0.0),
        dim=3,
        places={"up": (1.0, 0.0, 0.1), "down": (1.0, 0.0, -0.1)},
    )
    pair = [
        loads.PointForce(place, At("arm", place), (5.0 * sign, 0.0, 0.0))
        for place, sign in (("up", 1.0), ("down", -1.0))
    ]
    found = buckling(
        eliminate(
            assemble(
                [straight(8, STRIP), arm], [CLAMP, joints.Weld("w", At("arm", "frame"), TIP)], pair
            )
        ),
        1,
    )
    assert found.factors[0] == pytest.approx(np.pi / 2.0, rel=1e-5)


def test_a_pinned_shaft_buckles_under_twist() -> None:
    """Greenhill 1883: M L = 2 pi EI, of moments about a fixed axis."""
    section = BeamSection(np.diag([1e7, 1e6, 1e6, 1.0, 1.0, 1.0]), np.diag([1.0, 1e-6, 1e-6]))
    middle = joints.DrivenAngle("middle", At("beam", 0.5), lambda t: 0.0 * t, axis=(1.0, 0.0, 0.0))
    held_by = [joints.Pin("left", ROOT), joints.Slider("right", TIP, (1.0, 0.0, 0.0)), middle]
    pair = [
        loads.Moment("end", TIP, (1.0, 0.0, 0.0)),
        loads.Moment("start", ROOT, (-1.0, 0.0, 0.0)),
    ]
    found = buckling(eliminate(assemble([straight(8, section)], held_by, pair)), 1)
    assert abs(found.factors[0]) == pytest.approx(2.0 * np.pi, rel=1e-3)


@pytest.mark.parametrize(("cells", "error"), [(6, 0.15), (8, 0.1), (18, 2e-3)])
def test_beams_that_turn_far_in_a_cell_are_told(cells: int, error: float) -> None:
    """Two turns of torsion: 120 and 90 degrees a cell with the cells that do, also in motions; 40
    degrees are not told.
    """
    section = BeamSection(np.diag([1e8, 4e7, 4e7, 1.0, 1.0, 1.0]), np.diag([1.0, 1e-4, 1e-4]))
    sensed = {"turn": probes.Angle(TIP, axis=(1.0, 0.0, 0.0))}
    moment = loads.Moment("M", TIP, (4.0 * np.pi, 0.0, 0.0))
    system = eliminate(assemble([straight(cells, section)], [CLAMP], [moment], outputs=sensed))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        path = solve_statics(system, 8)
        if cells == 6:  # the moment begins at once, and turns the cell at the end
            integrate(system, GeneralizedAlpha(1e-3), 2e-3)
    told = [str(one.message) for one in caught if "in a cell" in str(one.message)]
    assert abs(outputs(path)["turn"][-1] / (4.0 * np.pi) - 1.0) < error
    assert len(told) == {6: 2, 8: 1, 18: 0}[cells]
    assert all("take " in one for one in told)
