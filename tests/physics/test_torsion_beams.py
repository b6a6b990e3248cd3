"""Beams with torsion and shear against closed forms and published figures, at stated numbers of cells."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fmbs_skfem.bodies import sections
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.body import Body
from fmbs_skfem.bodies.sections import BeamSection
from fmbs_skfem.dynamics import outputs, solve_statics, vibration_modes
from fmbs_skfem.shapes import curves
from fmbs_skfem.systems import At, assemble, eliminate, joints, loads
from fmbs_skfem.systems.measures import probes

ROOT, TIP = At("beam", "left"), At("beam", "right")


def along(curve: curves.Curve, length: float, cells: int, section: BeamSection) -> Body:
    """A beam in equal cells along a curve, the y axis of its section that of z."""
    ends = {"left": 0.0, "right": length}
    line = curves.Line(np.linspace(0.0, length, cells + 1), curve, ends, None)
    return beam("beam", line, section, direction=np.array([0.0, 0.0, 1.0]))


def straight(cells: int, section: BeamSection, length: float = 1.0) -> Body:
    """A beam along x."""
    return along(curves.Straight(np.zeros(3), np.array([length, 0.0, 0.0]), length), length, cells, section)


def square(h: float, E: float = 1e9) -> BeamSection:
    """A square of side h without Poisson's ratio."""
    return sections.Rectangular(h, h).of_beam(sections.Material(E, 1000.0, 0.0))


def held(part: Body, load: loads.Load, steps: int = 1) -> dict[str, np.ndarray]:
    """Outputs of the equilibria of a beam that is clamped at its left end."""
    sensed = {"tip": probes.Position(TIP)}
    return outputs(solve_statics(eliminate(assemble([part], [joints.Clamp("root", ROOT)], [load], outputs=sensed)), steps))


def elastica(load: float) -> tuple[float, float]:
    """Tip (x, z) / L of a cantilever under a dead force P across its end: theta'' = -P cos(theta), P L^2 / EI = load."""

    def bent(kappa: float) -> np.ndarray:
        rates = lambda s, y: [y[1], -load * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])]  # noqa: E731
        return np.asarray(solve_ivp(rates, (0.0, 1.0), [0.0, kappa, 0.0, 0.0], rtol=1e-11, atol=1e-12).y[:, -1])

    x, z = bent(brentq(lambda kappa: bent(kappa)[1], 1.0, 4.6, xtol=1e-12))[2:]
    return float(x), float(z)


@pytest.mark.parametrize(("cells", "error", "slender"), [(5, 4e-3, 1e4), (10, 5e-4, 1e4), (20, 1e-5, 1e3)])
def test_slender_beams_do_not_lock(cells: int, error: float, slender: float) -> None:
    section = square(1.0 / slender)
    found = held(straight(cells, section), loads.PointForce("F", TIP, (0.0, 0.0, 10.0 * section.stiffness[4, 4])), 10)
    np.testing.assert_allclose([found["tip_x"][-1], found["tip_z"][-1]], elastica(10.0), atol=error)


def test_an_end_moment_rolls_a_beam_up() -> None:
    section = square(1e-2)
    found = held(straight(16, section), loads.Moment("M", TIP, (0.0, 2.0 * np.pi * section.stiffness[4, 4], 0.0)), 8)
    assert np.hypot(found["tip_x"][-1], found["tip_z"][-1]) < 1e-5


def test_a_bend_of_45_degrees() -> None:
    """Bathe and Bolourchi 1979; tip at F = 600 of splines of degree 3, 4 and 5 with 32 cells: (-23.5613, -13.6050, 53.4762)."""
    R, EI = 100.0, 833300.0

    def arc(xi: np.ndarray, derivative: int = 0) -> np.ndarray:
        a, zero = np.asarray(xi) / R, np.zeros(len(xi))
        point = np.stack([R * np.sin(a), R * (1.0 - np.cos(a)), zero], axis=1)
        return point if derivative == 0 else np.stack([np.cos(a), np.sin(a), zero], axis=1)

    section = BeamSection(np.diag([1e7, 4166670.0, 4166670.0, EI, EI, EI]), np.diag([1.0, 1 / 12, 1 / 12]))
    found = held(along(arc, 0.25 * np.pi * R, 8, section), loads.PointForce("F", TIP, (0.0, 0.0, 600.0)))
    moved = np.array([found[f"tip_{c}"][-1] for c in "xyz"]) - arc(np.array([0.25 * np.pi * R]))[0]
    np.testing.assert_allclose(moved, [-23.5613, -13.6050, 53.4762], atol=1e-4 * 53.0)


@pytest.mark.parametrize(
    ("angle", "y", "z"),
    [(0, 0.0107141763, 0.0), (30, 0.0101116963, 0.07939482948), (60, 0.006604665004, 0.129887616), (90, 0.0, 0.146245978)],
)
def test_princeton_beam(angle: float, y: float, z: float) -> None:
    """Beam elements of Obrezkov et al., Nonlinear Dyn. 109 (2022): a strip under its tip force at angles to its stiff direction."""
    section = BeamSection(np.diag([2.84191e6, 9.037e5, 9.037e5, 3.10338, 2.42873, 36.2794]), np.diag([0.1, 1e-6, 1e-7]))
    part = along(curves.Straight(np.zeros(3), np.array([0.508, 0.0, 0.0]), 0.508), 0.508, 8, section)
    force = 8.896 * np.array([0.0, np.sin(np.radians(angle)), np.cos(np.radians(angle))])
    found = held(part, loads.PointForce("F", TIP, tuple(force)), 4)
    np.testing.assert_allclose([found["tip_z"][-1], found["tip_y"][-1]], [y, z], atol=5e-3 * max(y, z))


def test_frequencies_of_a_free_shaft() -> None:
    """Timoshenko's beam with Cowper's coefficient: 1499.55, 3956.31, 7330.90 Hz, each twice."""
    diameter, E = 0.03008, 210e9
    shaft = sections.Circular(diameter).of_beam(sections.Material(E, 7850.0, 0.3))
    assert shaft.stiffness[1, 1] / (E / 2.6 * 0.25 * np.pi * diameter**2) == pytest.approx(0.88636, abs=1e-5)
    found = vibration_modes(eliminate(assemble([straight(12, shaft, 0.3)])), 16).angular_frequencies / (2.0 * np.pi)
    for wanted in (1499.55, 3956.31, 7330.90):
        assert np.sum(np.abs(found / wanted - 1.0) < 1e-4) == 2


@pytest.mark.parametrize("GA", [4e5, 1e8])
def test_directors_do_not_soften_a_beam(GA: float) -> None:
    """N L / EA and P L / GA + P L^3 / (3 EI) of small forces, of shear areas below and far above EA."""
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
    assert found["tip_z"][-1] == pytest.approx(P / (3.0 * section.stiffness[4, 4]) + P / section.stiffness[2, 2], rel=1e-5)
