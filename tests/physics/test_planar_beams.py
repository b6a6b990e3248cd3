"""Beams with shear in the plane, against Timoshenko's formulas and beams in space."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_bvp
from scipy.optimize import brentq

from fmbs_skfem import dynamics, scenes, studies
from fmbs_skfem.bodies import Body, Material, Rectangular
from fmbs_skfem.bodies.beams import section_constants, section_shapes
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.beams.drawn_sections import LSection
from fmbs_skfem.bodies.beams.matrices import Matrices
from fmbs_skfem.bodies.sections import Section
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, vibration_modes
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, assemble, check_system, eliminate, joints, loads
from fmbs_skfem.systems.forces.line_loads import LineLoad
from fmbs_skfem.systems.measures import line_stresses, probes, stresses

STEEL = Material(210e9, 7850.0, 0.3)
DEEP = Rectangular(0.05, 0.1)
E, G, A, I = 210e9, 210e9 / 2.6, 0.05 * 0.1, 0.05 * 0.1**3 / 12.0
#: k of Cowper, of a shear force along z
K = section_constants.constants(section_shapes.rectangle(0.05, 0.1), 0.3).shear_area[1, 1] / A
LEFT, RIGHT = At("b", "left"), At("b", "right")


def bar(section: Section = DEEP, cells: int = 16, turn: float = 0.0, dim: int = 2) -> Body:
    c, s = np.cos(turn), np.sin(turn)
    placed = {"origin": np.array([5.0, 2.0]), "rotation": np.array([[c, -s], [s, c]])}
    if dim == 3:
        return beam("b", segment(cells), section, STEEL, direction=(0.0, 0.0, -1.0))
    return beam("b", segment(cells), section, STEEL, dim=2, **placed)


def held(body: Body, *acting: loads.Load, steps: int = 1) -> dict[str, float]:
    sensed: dict[str, probes.Probe] = {
        "tip": probes.Displacement(RIGHT),
        "f": stresses.SectionForces(At("b", 0.3)),
        "e": stresses.SectionStrains(At("b", 0.3)),
        "s": line_stresses.Stress(At("b", 0.3)),
    }
    clamp = joints.Clamp("root", LEFT)
    system = eliminate(assemble([body], [clamp], acting, outputs=sensed))
    found = dynamics.outputs(dynamics.solve_statics(system, steps))
    return {name: float(values[-1]) for name, values in found.items()}


@pytest.mark.parametrize("turn", [0.0, 2.0])
def test_a_deep_cantilever(turn: float) -> None:
    """F L^3/3EI + F L/kGA at its end; N, V, M and their strains at a place, in any direction."""
    N, V = 300.0, 2e3
    c, s = np.cos(turn), np.sin(turn)
    found = held(bar(turn=turn), loads.PointForce("F", RIGHT, (N * c - V * s, N * s + V * c)))
    across = -s * found["tip_x"] + c * found["tip_y"]
    k = np.sqrt(N / (E * I))  # the pull straightens it
    exact = V / N * (1.0 - np.tanh(k) / k) + V / (K * G * A)
    assert_allclose(across, exact, rtol=1e-3)
    M = V * np.sinh(0.7 * k) / (k * np.cosh(k))
    turned = V * (0.3 - 0.5 * 0.3**2) / (E * I)  # of the section there
    N, V = N + V * turned, V - N * turned
    assert_allclose([found["f_N"], found["f_V"], found["f_M"]], [N, V, M], rtol=1e-3)
    strains = [found["e_axial"], found["e_shear"], found["e_curvature"]]
    assert_allclose(strains, [N / (E * A), V / (K * G * A), M / (E * I)], rtol=2e-3)
    assert_allclose(found["s_max"], N / A + M * 0.05 / I, rtol=2e-3)
    assert_allclose(found["s_min"], N / A - M * 0.05 / I, rtol=2e-3)


@pytest.mark.parametrize(
    "section",
    [
        DEEP,
        Matrices((1e9, 3e8, 4e8, 4e5, 6e5, 9e5), (40.0, 40.0, 40.0, 0.05, 0.03, 0.02)),
    ],
)
def test_it_bends_far_as_a_beam_in_space_does(section: Section) -> None:
    """The same section with its z to the left of the line, by half its length."""
    EI = float(bar(section).profile.stiffness[0, 4, 4])  # type: ignore[union-attr]
    force = (0.5 * EI, 3.0 * EI)
    planar = eliminate(
        assemble(
            [bar(section)],
            [joints.Clamp("c", LEFT)],
            [loads.PointForce("F", RIGHT, force)],
            outputs={"r": probes.Displacement(RIGHT)},
        )
    )
    space = eliminate(
        assemble(
            [bar(section, dim=3)],
            [joints.Clamp("c", LEFT)],
            [loads.PointForce("F", RIGHT, (*force, 0.0))],
            outputs={"r": probes.Displacement(RIGHT)},
        )
    )
    mine, theirs = (dynamics.outputs(dynamics.solve_statics(one, 4)) for one in (planar, space))
    for name in ("r_x", "r_y"):
        assert_allclose(mine[name][-1], theirs[name][-1], atol=5e-5)
    assert abs(mine["r_y"][-1]) > 0.5


def test_a_uniform_load_bends_it_far_by_reissners_equations() -> None:
    """x' = (1 + N/EA) t + V/GA n, M' = - x' x (1 - s) q, to 1e-6 of the length with 16 cells.

    E. Reissner, Z. angew. Math. Phys. 23 (1972) 795-804, doi:10.1007/BF01602645.
    """
    EI, EA, GA = 10.0, 1e6, 4e5
    q = np.array([30.0, -80.0])

    def slopes(s: np.ndarray, y: np.ndarray) -> np.ndarray:
        c, d = np.cos(y[2]), np.sin(y[2])
        x, z = q[:, None] * (1.0 - s)
        e, g = 1.0 + (x * c + z * d) / EA, (z * c - x * d) / GA
        u, v = e * c - g * d, e * d + g * c
        return np.array([u, v, y[3] / EI, v * x - u * z])

    s = np.linspace(0.0, 1.0, 201)
    found = solve_bvp(
        slopes,
        lambda a, b: np.array([a[0], a[1], a[2], b[3]]),
        s,
        np.array([s, 0.0 * s, -s, 0.0 * s]),
        tol=1e-9,
        max_nodes=20000,
    )
    assert found.success
    section = Matrices((EA, GA, GA, 8.0, EI, EI), ((1.0, 0, 0), (0, 1e-4, 0), (0, 0, 1e-4)))
    body = beam("b", segment(16), section, dim=2)
    load = LineLoad("q", "b", tuple(q.tolist()))
    sensed = {"tip": probes.Displacement(RIGHT)}
    system = eliminate(assemble([body], [joints.Clamp("c", LEFT)], [load], outputs=sensed))
    tip = dynamics.outputs(dynamics.solve_statics(system, 4))
    exact = found.y[:2, -1] - [1.0, 0.0]
    assert_allclose([tip["tip_x"][-1], tip["tip_y"][-1]], exact, atol=1e-6)


def test_frequencies_of_a_deep_bar_on_two_pins() -> None:
    """Timoshenko's equation for sin(n pi x / L), with shear and rotary inertia."""
    pins = [joints.Pin("a", LEFT), joints.Slider("b", RIGHT, direction=(1.0, 0.0))]
    body = beam("b", segment(16), DEEP, STEEL, dim=2)
    found = vibration_modes(eliminate(assemble([body], pins)), 4).angular_frequencies
    rho = 7850.0

    def residual(w: float, n: int) -> float:
        q = n * np.pi
        return float(
            E * I * q**4
            - rho * A * w**2
            - rho * I * (1.0 + E / (K * G)) * q**2 * w**2
            + rho**2 * I / (K * G) * w**4
        )

    for n in (1, 2):
        guess = n**2 * np.pi**2 * np.sqrt(E * I / (rho * A))
        exact = brentq(residual, 0.3 * guess, guess, args=(n,))
        assert np.abs(np.asarray(found) / exact - 1.0).min() < 5e-4


def test_a_free_bar_keeps_its_momentum_and_energy() -> None:
    body = bar(Rectangular(0.02, 0.02), 8)
    out = {"E": probes.Energy(), "a": probes.Position(LEFT), "b": probes.Position(RIGHT)}
    system = assemble([body], outputs=out)
    check_system(system)
    places = system.x0.reshape(-1, 2)
    v = np.zeros_like(places)
    # a parabola across the line, which flies, turns and bends
    along = np.linalg.norm(places - places[0], axis=1)
    v[:, 1] = np.where(system.unit != 0.0, 5.0 * along**2, 0.0)
    system = replace(system, v0=v.ravel())
    run = dynamics.integrate(system, GeneralizedAlpha(2e-5, 0.9), 2e-3)
    mass = system.mass
    momentum = [(mass @ v).reshape(-1, 2)[system.unit != 0.0].sum(axis=0) for v in run.v]
    assert_allclose(momentum - momentum[0], 0.0, atol=1e-9 * np.abs(momentum).max())
    balance = dynamics.outputs(run)["E_balance"]
    assert np.ptp(balance) < 3e-4 * balance[0]


def test_an_offset_in_the_plane_and_an_angle() -> None:
    """Of an angle that is kept in the plane M = E int z^2 dA kappa; a line off the centres is refused."""
    angle = LSection(0.04, 0.06, 0.005, 0.005)
    with pytest.warns(Notice, match="its section is not symmetric about the plane"):
        body = bar(angle)
    found = held(body, loads.Moment("M", RIGHT, (50.0,)))
    _, _, second = section_shapes.moments(angle.outline())
    assert_allclose(found["e_curvature"], 50.0 / (E * second[1, 1]), rtol=1e-3)
    with pytest.raises(InputError, match="through the centres of mass"):
        beam("b", segment(8), angle, STEEL, dim=2, offset=(0.0, 0.0))


SCENE = """\
schema: 1
name: arm
dimension: 2
bodies:
  a:
    type: beam
    line: {start: [0, 0], end: [0.3, 0]}
    cells: 6
    section: &s {shape: rectangular, width: 20 mm, height: 30 mm}
    material: steel
  b: {type: beam, line: {start: [0.3, 0], end: [0.3, 0.4]}, cells: 8, section: *s, material: steel}
joints:
  hold: {type: clamp, at: a.left}
  corner: {type: weld, at: a.right, to: b.left}
loads:
  F: {type: point_force, at: b.right, force: [500 N, 0]}
analysis: {type: static}
outputs:
  tip: {type: displacement, at: b.right}
  corner: {type: section_forces, at: {body: a, s: 0.29 m}}
  most: {type: highest_stress, of: a}
"""


def test_a_bent_frame_of_a_scene(tmp_path: Path) -> None:
    """Tip of an L by unit loads: F h^3/3EI + F h^2 l/EI + shear and stretch."""
    path = tmp_path / "arm.yaml"
    path.write_text(SCENE, encoding="utf-8")
    found = {name: float(v[-1]) for name, v in studies.run(path).outputs.items()}
    section = section_constants.constants(section_shapes.rectangle(0.02, 0.03), 0.3)
    E, G, A, I = 210e9, 210e9 / 2.6, 6e-4, 0.02 * 0.03**3 / 12.0
    h, l, F = 0.4, 0.3, 500.0
    exact = F * h**3 / (3 * E * I) + F * h**2 * l / (E * I)
    exact += F * h / (G * section.shear_area[1, 1]) + F * l / (E * A)
    assert found["tip_x"] == pytest.approx(exact, rel=3e-3)
    assert found["corner_M"] == pytest.approx(-F * h, rel=3e-3)
    assert found["corner_N"] == pytest.approx(F, rel=3e-3)
    assert found["most_max"] == pytest.approx(F / A + F * h * 0.015 / I, rel=3e-3)
    with pytest.raises(InputError, match="direction: expected none, got one in the plane"):
        scenes.loads(SCENE.replace("cells: 6", "direction: [0, 1]"), tmp_path)


CRANK = """\
schema: 1
name: crank
dimension: 2
bodies:
  crank:
    type: beam
    line: {start: [0, 0], end: [0.2, 0]}
    cells: 4
    section: &s {shape: rectangular, width: 20 mm, height: 20 mm}
    material: aluminium
  rod: {type: beam, line: {start: [0.2, 0], end: [0.6, 0]}, cells: 6, section: *s, material: aluminium}
joints:
  O: {type: pin, at: crank.left}
  A: {type: pin, at: crank.right, to: rod.left}
  S: {type: slider, at: rod.right, direction: [1, 0]}
  motor: {type: driven_angle, at: crank.left, angle: "4 * t ** 3"}
damping: {stiffness: 0.5 ms}
analysis: {type: dynamic, duration: 0.4 s, step: 2 ms}
outputs: {tip: {type: position, at: rod.right}, motor: {type: reaction, joint: motor}}
reduction: {snapshots: 2 ms, tolerance: 1e-14, hyper_reduction: {sample: none}}
"""


def test_parts_and_reduced_models_of_a_crank(tmp_path: Path) -> None:
    """Modes of both bodies, and the rod alone as a part in the full crank, give its motion."""
    path = tmp_path / "crank.yaml"
    path.write_text(CRANK, encoding="utf-8")
    full = studies.run(path).outputs
    small = dynamics.outputs(studies.reduce(path, out=tmp_path / "crank.h5").reduced)
    studies.train_part(path, body="rod", out=tmp_path / "rod.h5")
    start = CRANK.index("  rod: {type: beam")
    end = CRANK.index("joints:")
    with_part = CRANK[:start] + "  rod: {type: part, file: rod.h5}\n" + CRANK[end:]
    path.write_text(with_part, encoding="utf-8")
    assembled = studies.run(path).outputs
    for found in (small, assembled):
        for name in ("tip_x", "motor_torque"):
            assert np.abs(found[name] - full[name]).max() < 2e-3 * np.ptp(full[name])
