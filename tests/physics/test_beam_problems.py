"""Beams with torsion against closed forms: springs, rings, grids, frames, rotors, blades, columns
under thrust and twist.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fmbs_skfem.bodies import rigid
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.body import Body
from fmbs_skfem.bodies.sections import BeamSection
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Linear,
    Spin,
    buckling,
    complex_modes,
    in_rotating_frame,
    integrate,
    linearise,
    outputs,
    real_modes,
    solve_statics,
    vibration_modes,
)
from fmbs_skfem.shapes import curves
from fmbs_skfem.shapes.table import Curve
from fmbs_skfem.systems import At, System, assemble, eliminate, joints, loads
from fmbs_skfem.systems.measures import probes

LEFT, RIGHT = At("beam", "left"), At("beam", "right")
X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
CLAMP = joints.Clamp("clamp", LEFT)


def section(
    EA: float, GJ: float, EIy: float, EIz: float, inertia: tuple[float, float] = (0.0, 0.0)
) -> BeamSection:
    """Of a mass of 1 kg/m, with GA = 0.4 EA and integrals of density times y^2 and z^2."""
    return BeamSection(np.diag([EA, 0.4 * EA, 0.4 * EA, GJ, EIy, EIz]), np.diag([1.0, *inertia]))


def along(
    curve: Curve,
    length: float,
    cells: int,
    made: BeamSection,
    y: Sequence[float],
    name: str = "beam",
) -> Body:
    """A beam in equal cells along a curve."""
    ends = {"left": 0.0, "right": length}
    return beam(
        name,
        curves.Line(np.linspace(0.0, length, cells + 1), curve, ends, None),
        made,
        direction=np.array(y),
    )


def straight(
    made: BeamSection,
    cells: int = 8,
    name: str = "beam",
    end: Sequence[float] = X,
    y: Sequence[float] = (0, 1, 0),
) -> Body:
    """A beam from the origin."""
    length = float(np.linalg.norm(end))
    return along(
        curves.Straight(np.zeros(3), np.array(end, dtype=float), length),
        length,
        cells,
        made,
        y,
        name,
    )


def helix(pitch: float) -> Curve:
    """A helix of radius 1 that rises by sin(pitch) a length; for 0 a circle. The z axis across it
    is the y axis of a section.
    """

    def curve(s: np.ndarray, derivative: int = 0) -> np.ndarray:
        c, a = np.cos(pitch), np.cos(pitch) * np.asarray(s)
        if derivative:
            return np.stack([-c * np.sin(a), c * np.cos(a), np.full(len(a), np.sin(pitch))], axis=1)
        return np.stack([np.cos(a), np.sin(a), np.sin(pitch) * np.asarray(s)], axis=1)

    return curve


def at_rest(
    parts: Sequence[Body],
    held: Sequence[joints.Joint],
    acting: Sequence[loads.Load],
    **sensed: probes.Probe,
) -> dict[str, float]:
    """Outputs of the equilibrium, in one load step."""
    found = outputs(solve_statics(eliminate(assemble(parts, held, acting, outputs=sensed)), 1))
    return {name: float(values[-1]) for name, values in found.items()}


def turning(system: System, rate: float, axis: tuple[float, float, float] = Z) -> Linear:
    """The equations about the equilibrium in a frame that turns."""
    return about(eliminate(in_rotating_frame(system, Spin(rate, axis))))


def about(system: System) -> Linear:
    path = solve_statics(system, 2)
    return linearise(path.system, path.x[-1], path.multipliers[-1], 1.0)


def nearest(found: np.ndarray, wanted: Sequence[float]) -> np.ndarray:
    """Of all found those next to the wanted ones."""
    return np.array([found[np.abs(found - one).argmin()] for one in wanted])


def test_a_helical_spring_under_a_force_along_its_axis() -> None:
    """L (R^2 (cos^2 / GJ + sin^2 / EI) + sin^2 / EA + cos^2 / GA) F, and L R sin cos (1/GJ - 1/EI)
    F of its turn.
    """
    pitch, F = np.arctan(0.25 / np.pi), 1e-3
    c, s, L = np.cos(pitch), np.sin(pitch), 4 * np.pi / np.cos(pitch)
    part = along(helix(pitch), L, 32, section(1e6, 62.0, 80.0, 80.0), Z)
    end = part.reference[part.constant > 0.5][-1]
    arm = rigid.rigid(
        "arm", 1.0, np.ones(3), tuple(end), dim=3, places={"axis": (0.0, 0.0, end[2])}
    )
    weld, pull = (
        joints.Weld("weld", At("arm", "frame"), RIGHT),
        loads.PointForce("F", At("arm", "axis"), (0.0, 0.0, F)),
    )
    sensed = {"at": probes.Position(At("arm", "axis")), "turn": probes.Angle(At("arm", "frame"), Z)}
    found = at_rest([part, arm], [CLAMP, weld], [pull], **sensed)
    assert found["at_z"] - end[2] == pytest.approx(
        F * L * (c**2 / 62.0 + s**2 / 80.0 + s**2 / 1e6 + c**2 / 4e5), rel=1e-4
    )
    assert abs(found["turn"]) == pytest.approx(F * L * s * c * (1 / 62.0 - 1 / 80.0), rel=5e-4)


def test_a_bow_girder() -> None:
    """P R^3 (pi/4 / EI + (3 pi/4 - 2) / GJ) of a quarter of a ring, clamped, under a force across
    its plane at its end.
    """
    part, P = along(helix(0.0), 0.5 * np.pi, 8, section(1e7, 50.0, 90.0, 80.0), Z), 1e-3
    found = at_rest(
        [part], [CLAMP], [loads.PointForce("F", RIGHT, (0.0, 0.0, P))], at=probes.Position(RIGHT)
    )
    exact = 0.25 * np.pi / 80.0 + (0.75 * np.pi - 2.0) / 50.0 + 0.5 * np.pi / 4e6
    assert found["at_z"] == pytest.approx(P * exact, rel=2e-5)


def test_four_beams_at_a_point() -> None:
    """A cross with clamped ends: each arm gives way by L^3 / (12 EI) + L / GA to a force; two twist
    and two bend under a moment.
    """
    made = section(1e6, 60.0, 80.0, 20.0)
    ends = {"a": (1, 0, 0), "b": (0, 1, 0), "c": (-1, 0, 0), "d": (0, -1, 0)}
    arms, middle, P = (
        [straight(made, 4, name, end, Z) for name, end in ends.items()],
        At("a", "left"),
        1e-3,
    )
    held = [joints.Clamp(f"{name} held", At(name, "right")) for name in ends]
    held += [joints.Weld(f"{name} welded", At(name, "left"), middle) for name in "bcd"]
    found = at_rest(
        arms, held, [loads.PointForce("F", middle, (0.0, 0.0, P))], at=probes.Position(middle)
    )
    assert found["at_z"] == pytest.approx(P / 4 * (1 / 240.0 + 1 / 4e5), rel=2e-4)
    shear = 12 * 20.0 / 4e5
    found = at_rest(
        arms, held, [loads.Moment("M", middle, (P, 0.0, 0.0))], turn=probes.Angle(middle, X)
    )
    assert found["turn"] == pytest.approx(
        P / (2 * 60.0 + 2 * 20.0 * (4 + shear) / (1 + shear)), rel=2e-4
    )


def test_torsional_modes_of_a_shaft_with_discs() -> None:
    """phi = cos b x - J1 w^2 / (GJ b) sin b x,  GJ phi' = J2 w^2 phi at the end,  b = w sqrt(rho J
    / GJ).
    """
    GJ, rhoJ, (J1, J2) = 60.0, 0.02, (0.03, 0.01)
    discs = [
        rigid.rigid(name, 1.0, np.array([J, 1.0, 1.0]), (x, 0.0, 0.0), dim=3)
        for name, J, x in (("a", J1, 0), ("b", J2, 1))
    ]
    held = [joints.Weld("l", At("a", "frame"), LEFT), joints.Weld("r", At("b", "frame"), RIGHT)]
    held.append(joints.Revolute("bearing", At("a", "frame"), axis=X))
    system = assemble(
        [straight(section(1e7, GJ, 80.0, 80.0, (0.5 * rhoJ, 0.5 * rhoJ)), 12), *discs], held
    )

    def left(w: float) -> float:
        b, k = w * np.sqrt(rhoJ / GJ), -J1 * w / np.sqrt(rhoJ * GJ)
        return float(GJ * b * (k * np.cos(b) - np.sin(b)) - J2 * w**2 * (np.cos(b) + k * np.sin(b)))

    grid = np.linspace(1.0, 600.0, 600)
    signs = np.sign([left(w) for w in grid])
    exact = [brentq(left, grid[k], grid[k + 1]) for k in np.flatnonzero(signs[1:] != signs[:-1])]
    assert len(exact) == 4
    found = vibration_modes(eliminate(system), 40).angular_frequencies
    np.testing.assert_allclose(nearest(found, exact), exact, rtol=3e-6)


def test_a_ring_vibrates_in_its_plane_and_out_of_it() -> None:
    """Love 1927, art. 293: n^2 (n^2 - 1)^2 EI / ((n^2 + 1) m R^4), and n^2 (n^2 - 1)^2 EI / ((n^2 +
    EI/GJ) m R^4), each twice.
    """
    part, n = (
        along(helix(0.0), 2 * np.pi, 32, section(1e8, 60.0, 80.0, 50.0), Z),
        np.array([2.0, 3.0]),
    )
    found = vibration_modes(
        eliminate(assemble([part], [joints.Weld("closed", RIGHT, LEFT)])), 16
    ).angular_frequencies
    for exact in (
        n * (n**2 - 1) * np.sqrt(80.0 / (n**2 + 1)),
        n * (n**2 - 1) * np.sqrt(50.0 / (n**2 + 50.0 / 60.0)),
    ):
        for one in exact:
            assert np.sum(np.abs(found / one - 1.0) < 1.5e-4) == 2
    assert np.sum(found < 1.0) == 6


@pytest.mark.parametrize(("rate", "flap"), [(2.0, 4.1373), (4.0, 5.5850), (12.0, 13.1702)])
def test_a_blade_turns(rate: float, flap: float) -> None:
    """Wright, Smith, Thresher, Wang, J. Appl. Mech. 49 (1982) 197-202; in the plane of the rotation
    sqrt(flap^2 - rate^2).
    """
    system = assemble([straight(section(1e8, 100.0, 1.0, 1.0), 12)], [CLAMP])
    found = complex_modes(turning(system, rate), 4).angular_frequencies
    wanted = [flap, np.sqrt(flap**2 - rate**2)]
    np.testing.assert_allclose(nearest(found, wanted), wanted, rtol=3e-4)


def test_a_turning_blade_resists_twist() -> None:
    """w^2 = (pi/2)^2 GJ / (rho J L^2) + rate^2 (Iy - Iz) / J of a flat section: the propeller
    moment.
    """
    system = assemble([straight(section(1e8, 1.0, 1e3, 1e5, (0.02, 0.002)), 12)], [CLAMP])
    exact = np.sqrt((0.5 * np.pi) ** 2 / 0.022 + 20.0**2 * 0.018 / 0.022)
    assert nearest(complex_modes(turning(system, 20.0), 8).angular_frequencies, [exact])[
        0
    ] == pytest.approx(exact, rel=1e-4)


def test_a_turning_bar_is_stretched() -> None:
    """tan(k L) / k - L, k = rate sqrt(m / EA)."""
    system = in_rotating_frame(
        assemble(
            [straight(section(1e7, 100.0, 1e3, 1e3))],
            [CLAMP],
            outputs={"at": probes.Position(RIGHT)},
        ),
        Spin(40.0),
    )
    k = 40.0 / np.sqrt(1e7)
    assert outputs(solve_statics(eliminate(system), 2))["at_x"][-1] - 1.0 == pytest.approx(
        np.tan(k) / k - 1.0, rel=1e-4
    )


def test_a_column_under_a_force_that_follows_flutters() -> None:
    """Beck 1952: 20.0509 EI / L^2."""

    def grows(P: float) -> bool:
        push = loads.Follower("F", RIGHT, (-P, 0.0, 0.0))
        system = eliminate(assemble([straight(section(1e8, 100.0, 1.0, 1.0))], [CLAMP], [push]))
        return bool(complex_modes(about(system), 6).eigenvalues.real.max() > 1e-3)

    assert not grows(20.03)
    assert grows(20.06)


def test_a_shaft_has_the_critical_speed_of_timoshenko() -> None:
    """W^2 m w + GA (w'' - t') = 0,  EI t'' + GA (w' - t) - W^2 I t = 0: slices of inertia I resist
    their tilt as they turn.
    """
    EI, GA, inertia, k = 80.0, 2e4, 0.004, np.pi
    made = BeamSection(np.diag([1e6, GA, GA, 60.0, EI, EI]), np.diag([1.0, inertia, inertia]))

    def determinant(rate: float) -> float:
        return float(
            np.linalg.det(
                [[rate**2 - GA * k**2, GA * k], [GA * k, -EI * k**2 - GA - inertia * rate**2]]
            )
        )

    held = [joints.Pin("l", LEFT), joints.Slider("r", RIGHT, X)]
    held.append(joints.DrivenAngle("turn", At("beam", 0.5), lambda t: 0.0 * t, axis=X))
    system, exact = assemble([straight(made)], held), brentq(determinant, 50.0, 150.0)
    found = brentq(
        lambda rate: real_modes(turning(system, rate, X), 1).squares[0],
        0.95 * exact,
        1.05 * exact,
        xtol=1e-4,
    )
    assert found == pytest.approx(exact, rel=1e-4)


def test_a_rotor_runs_through_its_critical_speed() -> None:
    """z'' + w^2 z = e (u^2 - i u') exp(i v), v' = u = a t, of a disc e off a light shaft: Jeffcott
    1919.
    """
    EI, m, e, a = 20.0, 1.0, 1e-3, 30.0
    w = np.sqrt(48.0 * EI / m)
    made = BeamSection(np.diag([1e6, 1e7, 1e7, 200.0, EI, EI]), np.diag([1e-4, 1e-8, 1e-8]))
    disc = rigid.rigid(
        "disc",
        m,
        np.array([1e-3, 5e-4, 5e-4]),
        (0.5, e, 0.0),
        dim=3,
        places={"hub": (0.5, 0.0, 0.0)},
    )
    held = [
        joints.Pin("l", LEFT),
        joints.Slider("r", RIGHT, X),
        joints.Weld("on", At("disc", "hub"), At("beam", 0.5)),
    ]
    held.append(joints.DrivenAngle("motor", LEFT, lambda t: 0.5 * a * t**2, axis=X))
    system = assemble(
        [straight(made, 8), disc], held, outputs={"at": probes.Position(At("disc", "hub"))}
    )
    found = outputs(motion := integrate(eliminate(system), GeneralizedAlpha(2e-3, 0.95), 1.6))

    def rates(t: float, z: np.ndarray) -> np.ndarray:
        return np.array([z[1], e * ((a * t) ** 2 - 1j * a) * np.exp(0.5j * a * t**2) - w**2 * z[0]])

    exact = np.abs(
        solve_ivp(rates, (0.0, 1.6), [0j, 0j], rtol=1e-9, atol=1e-12, t_eval=motion.times).y[0]
    )
    way = np.hypot(found["at_y"], found["at_z"])
    assert exact.max() > 8 * e  # it has passed
    assert np.abs(way - exact).max() < 0.03 * exact.max()
    assert motion.times[way.argmax()] == pytest.approx(motion.times[exact.argmax()], abs=5e-3)


EI, GJ = 1.0, 0.8  #: of the arch in bending out of its plane and torsion [N m2]


def arch(angle: float) -> System:
    """A circle of radius 1 under moments at its ends, which turn about its radii; it hardly bends
    in its plane.
    """
    part, end = (
        along(helix(0.0), angle, 12, section(2.5e6, GJ, 1e4, EI), Z),
        np.array([np.cos(angle), np.sin(angle), 0.0]),
    )
    chord = (end - X) / np.linalg.norm(end - X)
    held: list[joints.Joint] = [joints.Pin("l", LEFT), joints.Slider("r", RIGHT, tuple(chord))]
    for name, place, axis in (("tl", LEFT, (0.0, 1.0, 0.0)), ("tr", RIGHT, (-end[1], end[0], 0.0))):
        held.append(joints.DrivenAngle(name, place, lambda t: 0.0 * t, axis=axis))
    pair = [loads.Moment("ml", LEFT, (0.0, 0.0, -1.0)), loads.Moment("mr", RIGHT, (0.0, 0.0, 1.0))]
    return eliminate(assemble([part], held, pair))


@pytest.mark.parametrize("angle", [0.5 * np.pi, 0.8 * np.pi])
def test_an_arch_leaves_its_plane_under_end_moments(angle: float) -> None:
    """(EI + GJ -+ sqrt((EI - GJ)^2 + 4 EI GJ pi^2 / angle^2)) / (2 R): Timoshenko and Gere 1961,
    ch. 7.8.
    """
    found = buckling(arch(angle), 4).factors
    root = np.sqrt((EI - GJ) ** 2 + 4 * EI * GJ * np.pi**2 / angle**2)
    assert found[found < 0.0].max() == pytest.approx(0.5 * (EI + GJ - root), rel=1e-4)
    assert found[found > 0.0].min() == pytest.approx(0.5 * (EI + GJ + root), rel=1e-4)


@pytest.mark.parametrize("EA", [1e6, 1e8])
@pytest.mark.parametrize("moment", [1.0, 5.0])
def test_a_shaft_buckles_under_thrust_and_twist(EA: float, moment: float) -> None:
    """Greenhill 1883: M^2 / (4 EI^2) + P / EI = pi^2 / L^2, of moments about a fixed axis."""
    held = [joints.Pin("l", LEFT), joints.Slider("r", RIGHT, X)]
    held.append(joints.DrivenAngle("middle", At("beam", 0.5), lambda t: 0.0 * t, axis=X))
    pair = [
        loads.Moment("mr", RIGHT, (moment, 0.0, 0.0)),
        loads.Moment("ml", LEFT, (-moment, 0.0, 0.0)),
    ]
    thrust = loads.PointForce("P", RIGHT, (0.25 * moment**2 - np.pi**2, 0.0, 0.0))
    found = buckling(
        eliminate(assemble([straight(section(EA, 1.0, 1.0, 1.0))], held, [*pair, thrust])), 1
    )
    assert abs(found.factors[0]) == pytest.approx(1.0, rel=2e-4)


def test_a_column_that_is_soft_in_shear() -> None:
    """P (1 - P/EA + P/GA) = pi^2 EI / L^2 (Reissner 1972): on the path, and predicted."""
    made = BeamSection(np.diag([1e5, 200.0, 200.0, 100.0, 10.0, 20.0]), np.diag([1.0, 0.0, 0.0]))
    exact = brentq(lambda P: P * (1.0 - P / 1e5 + P / 200.0) - 10.0 * np.pi**2, 1.0, 99.0)
    held = [joints.Pin("l", LEFT), joints.Slider("r", RIGHT, X)]
    held.append(joints.DrivenAngle("middle", At("beam", 0.5), lambda t: 0.0 * t, axis=X))
    system = eliminate(
        assemble([straight(made)], held, [loads.PointForce("P", RIGHT, (-1.2 * exact, 0.0, 0.0))])
    )
    assert 1.2 * buckling(system, 1).factors[0] == pytest.approx(1.0, rel=1e-3)
    (point,) = solve_statics(system, 12).crossings
    assert point.kind == "branch point"
    assert point.before - 1e-4 < 1.0 / 1.2 < point.after + 1e-4 < point.before + 5e-3


def test_a_hinged_right_angle_frame_under_end_moments() -> None:
    """pi sqrt(EI GJ) / L = 622.2 N mm of legs in pure bending, either way (626 of Argyris 1979, of
    few elements).
    """
    E, G, b, h, L = 71240.0, 71240.0 / 2.62, 30.0, 0.6, 240.0
    soft, stiff, GJ = E * b * h**3 / 12, E * h * b**3 / 12, G * b * h**3 / 3
    made = BeamSection(
        np.diag([E * b * h, G * b * h, G * b * h, GJ, stiff, soft]), np.diag([1.0, 0.0, 0.0])
    )
    s = L / np.sqrt(2.0)
    one = along(curves.Straight(np.array([-s, 0, 0]), np.array([0, s, 0]), L), L, 8, made, Z, "one")
    two = along(curves.Straight(np.array([0, s, 0]), np.array([s, 0, 0]), L), L, 8, made, Z, "two")
    car = rigid.rigid("car", 1.0, np.ones(3), (s, 0.0, 0.0), dim=3)
    held = [
        joints.Weld("corner", At("two", "left"), At("one", "right")),
        joints.Revolute("l", At("one", "left"), axis=Z),
    ]
    held += [joints.Prismatic("rail", At("car", "frame"), direction=X)]
    held += [joints.Revolute("r", At("two", "right"), At("car", "frame"), axis=Z)]
    pair = [
        loads.Moment("ml", At("one", "left"), (0.0, 0.0, 1.0)),
        loads.Moment("mr", At("two", "right"), (0.0, 0.0, -1.0)),
    ]
    found = buckling(eliminate(assemble([one, two, car], held, pair)), 2).factors
    np.testing.assert_allclose(
        np.sort(found), np.pi * np.sqrt(soft * GJ) / L * np.array([-1.0, 1.0]), rtol=2e-3
    )
    np.testing.assert_allclose(np.abs(found), 626.0, rtol=7e-3)
