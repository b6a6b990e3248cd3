"""Beams with torsion and shear on joints: frames at any place, reactions and section forces that
balance, momenta that are kept.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.body import Body
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.bodies.sections import BeamSection
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs, solve_statics
from fmbs_skfem.shapes import curves
from fmbs_skfem.systems import At, Motion, assemble, eliminate, joints, loads
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.measures.stresses import SectionForces

SECTION = BeamSection(np.diag([1e6, 4e5, 4e5, 60.0, 80.0, 20.0]), np.diag([1.0, 1e-4, 4e-4]))


def leg(
    name: str,
    start: tuple[float, ...],
    end: tuple[float, ...],
    direction: tuple[float, ...],
    cells: int = 6,
) -> Body:
    """A straight beam between two points."""
    a, b = np.array(start, dtype=float), np.array(end, dtype=float)
    size = float(np.linalg.norm(b - a))
    line = curves.Line(
        np.linspace(0.0, size, cells + 1),
        curves.Straight(a, b, size),
        {"left": 0.0, "right": size},
        None,
    )
    return beam(name, line, SECTION, direction=np.array(direction))


def elbow() -> list[Body]:
    """Two legs of a metre at a right angle, along x and then along y."""
    return [leg("a", (0, 0, 0), (1, 0, 0), (0, 0, 1)), leg("b", (1, 0, 0), (1, 1, 0), (0, 0, 1))]


def test_a_weld_at_an_angle_passes_all_on() -> None:
    """A force across both legs: bending of one is torsion of the other; small, so that elementary
    figures hold.
    """
    sensed = {
        "tip": probes.Position(At("b", "right")),
        "root": probes.Reaction("root"),
        "near": SectionForces(At("a", 0.25)),
        "knee": probes.Reaction("knee"),
    }
    held = [
        joints.Clamp("root", At("a", "left")),
        joints.Weld("knee", At("b", "left"), At("a", "right")),
    ]
    force = loads.PointForce("F", At("b", "right"), (0.0, 0.0, -3e-3))
    found = outputs(solve_statics(eliminate(assemble(elbow(), held, [force], outputs=sensed)), 1))
    F, (GA, _, GJ, EIy, EIz) = 3e-3, SECTION.stiffness.diagonal()[1:]
    del EIy
    assert found["tip_z"][-1] == pytest.approx(
        -F * (2.0 / (3.0 * EIz) + 2.0 / GA + 1.0 / GJ), rel=1e-4
    )
    assert_allclose(
        [found[f"root_{c}"][-1] for c in ("x", "y", "z", "mx", "my", "mz")],
        [0, 0, F, F, -F, 0],
        atol=1e-6 * F,
    )
    assert_allclose(
        [found[f"near_{c}"][-1] for c in ("N", "Vy", "T")], [0.0, -F, -F], atol=1e-4 * F
    )
    assert abs(found["near_Mz"][-1]) == pytest.approx(0.75 * F, rel=2e-3)
    assert_allclose(
        [found[f"knee_{c}"][-1] for c in ("x", "y", "z", "mx", "my", "mz")],
        [0, 0, F, F, 0, 0],
        atol=1e-6 * F,
    )


def test_a_rigid_body_on_a_beam_is_the_same_as_its_load() -> None:
    """Welded to the end, its weight a metre away is a force and a moment of torsion there."""
    block = rigid("block", 2.0, (0.1, 0.1, 0.1), (1.0, 1.0, 0.0), places={"at": (1.0, 0.0, 0.0)})
    part, root = leg("a", (0, 0, 0), (1, 0, 0), (0, 0, 1)), joints.Clamp("root", At("a", "left"))
    weld = joints.Weld("w", At("block", "at"), At("a", "right"))
    sensed = {
        "root": probes.Reaction("root"),
        "w": probes.Reaction("w"),
        "end": probes.Position(At("a", "right")),
    }
    weight = loads.PointForce("g", At("block"), (0.0, 0.0, -2e-3))
    found = outputs(
        solve_statics(eliminate(assemble([part, block], [root, weld], [weight], outputs=sensed)), 1)
    )
    assert_allclose(
        [found[f"root_{c}"][-1] for c in ("z", "mx", "my")], [2e-3, 2e-3, -2e-3], rtol=1e-3
    )
    assert_allclose([found[f"w_{c}"][-1] for c in ("z", "mx", "my")], [2e-3, 2e-3, 0.0], atol=2e-6)
    assert found["end_z"][-1] == pytest.approx(-2e-3 * (1 / (3 * 20.0) + 1 / 4e5), rel=1e-3)


def test_a_hinge_needs_no_rigid_end() -> None:
    """A beam that swings about y at its end keeps its axis, and the balance of its energy."""
    part, root = (
        leg("b", (0, 0, 0), (1, 0, 0), (0, 0, 1)),
        joints.Revolute("hinge", At("b", "left"), axis=(0.0, 1.0, 0.0)),
    )
    sensed = {"tip": probes.Position(At("b", "right")), "E": probes.Energy()}
    system = eliminate(assemble([part], [root], [loads.Gravity((0.0, 0.0, -9.81))], outputs=sensed))
    found = outputs(integrate(system, GeneralizedAlpha(1e-3), 0.5))
    assert np.abs(found["tip_y"]).max() < 1e-9
    assert found["tip_z"][-1] < -0.7
    assert np.ptp(found["E_balance"]) < 2e-3 * 9.81 * 0.5


@pytest.mark.parametrize("spin", [(0.0, 3.0, 8.0), (5.0, 0.0, 0.0)])
def test_a_free_beam_keeps_its_momenta(spin: tuple[float, ...]) -> None:
    """Linear momentum to round-off; energy with the square of the step."""
    part, change = leg("b", (0, 0, 0), (1, 0, 0), (0, 0, 1)), []
    start = {"b": Motion((1.0, 0.0, 2.0), spin, (0.5, 0.0, 0.0))}
    system = eliminate(assemble([part], initial=start, outputs={"E": probes.Energy()}))
    for steps in (800, 1600):
        found = integrate(system, GeneralizedAlpha(0.5 / steps, 1.0), 0.5)
        momentum = found.v @ system.mass @ np.kron(system.unit[:, None], np.eye(3))
        assert_allclose(momentum, np.tile([1.0, 0.0, 2.0], (len(momentum), 1)), atol=1e-10)
        change.append(np.ptp(outputs(found)["E_balance"]))
    assert change[1] < 0.35 * change[0] or change[1] < 1e-6


def test_a_direction_along_the_line_is_refused_with_its_place() -> None:
    with pytest.raises(
        InputError,
        match=r"body 'b'.direction: expected a direction across the line, got one along it at",
    ):
        leg("b", (0, 0, 0), (1, 0, 0), (1, 0, 0)).cells.section  # noqa: B018
