"""Lines that a scene draws, without a mesh file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import dynamics, scenes, studies
from fmbs_skfem.bodies.body import extent, reference_at
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes.curves import Helix

SCENE = """\
schema: 1
dimension: {dim}
bodies:
  b:
    type: {kind}
    line: {line}
    section: {{shape: circular, diameter: 2 mm}}
    material: {{young_modulus: 210 GPa, density: 7850, poisson_ratio: 0.3}}
    {more}
joints:
  hold: {{type: clamp, at: b.left}}
  {joint}
loads: {{push: {{type: point_force, at: b.right, force: {force}}}}}
analysis: {{type: static, load_steps: 1}}
outputs: {{u: {{type: displacement, at: b.right}}}}
"""
RING = "{start: [1 m, 0], center: [0, 0], angle: 90 deg, points: {mid: 0.5}}"
SPRING = (
    "{start: [20 mm, 0, 0], center: [0, 0, -1 m], axis: [0, 0, 2], angle: 1800 deg, rise: 50 mm}"
)


def scene(line: str, dim: int = 2, kind: str = "cable", more: str = "", force: str = "", joint: str = "") -> scenes.Scene:  # fmt: skip
    force = force or ("[0, 1e-5 N]" if dim == 2 else "[0, 0, 0.1 N]")
    return scenes.loads(
        SCENE.format(dim=dim, kind=kind, line=line, more=more, force=force, joint=joint)
    )


def moved(found: scenes.Scene) -> dict[str, float]:
    """How far its end goes."""
    path = dynamics.solve_statics(build.system(found), 1)
    return {name: float(values[-1]) for name, values in dynamics.outputs(path).items()}


def test_a_quarter_of_a_ring_bends_as_its_formula() -> None:
    """pi F R^3 / 4 E I along the force, F R^3 / 2 E I across it, and its places."""
    bends = 1e-5 / (210e9 * np.pi * 2e-3**4 / 64.0)
    found = moved(scene(RING, more="cells: 16"))
    assert_allclose([found["u_y"], found["u_x"]], [bends * np.pi / 4, bends / 2], rtol=1e-3)
    (body,) = build.parts(scene(RING))
    assert_allclose(reference_at(body, "mid"), np.full(2, np.sqrt(0.5)), atol=1e-6)
    assert_allclose(reference_at(body, np.pi / 6), [np.cos(np.pi / 6), 0.5], atol=1e-6)


def test_a_helical_spring() -> None:
    """G d^4 / (8 D^3 n) of a close one, whose wire rises by 4.6 degrees: 1 %."""
    guide = "guide: {type: prismatic, at: b.right, to: ground, direction: [0, 0, 1]}"
    found = moved(scene(SPRING, 3, "beam", "cells: 60", joint=guide))
    stiffness = 210e9 / 2.6 * 2e-3**4 / (8.0 * 0.04**3 * 5.0)
    assert found["u_z"] == pytest.approx(0.1 / stiffness, rel=0.01)


def test_a_helix_has_the_derivatives_of_its_places() -> None:
    curve = Helix(np.array([1.0, 2.0, 3.0]), np.array([0.3, 0, 0]), np.array([0, 0, 1.0]), 7.0, 0.5)
    assert curve.length == pytest.approx(np.hypot(2.1, 0.5))
    s, h = np.linspace(0.1, 2.0, 5), 1e-5
    for k in range(3):
        rate = (curve(s + h, k) - curve(s - h, k)) / (2.0 * h)
        assert_allclose(curve(s, k + 1), rate, atol=1e-4)
    assert_allclose(np.linalg.norm(curve(s, 1), axis=1), 1.0)


@pytest.mark.parametrize("dim", [2, 3])
def test_lines_through_points(dim: int) -> None:
    points = [[0, 0, 0], [0.5, 0.1, 0], [1, 0, 0]]
    (body,) = build.parts(scene(f"{{through: {[one[:dim] for one in points]}}}", dim))
    assert_allclose(reference_at(body, "right"), [1.0, 0.0, 0.0][:dim], atol=1e-12)
    (straight,) = build.parts(scene(f"{{start: {points[0][:dim]}, end: {points[2][:dim]}}}", dim))
    assert extent(straight) == pytest.approx(1.0)
    assert straight.total_mass == pytest.approx(7850.0 * np.pi * 1e-6)


@pytest.mark.parametrize(
    ("line", "dim", "text"),
    [
        ("{start: [1, 0], angle: 1}", 2, "expected start and end, through, or start, center"),
        ("{start: [1, 0, 0], center: [0, 0, 0], angle: 1}", 3, "in space with an axis"),
        ("{start: [0, 0], end: [1, 0], rise: 1}", 2, "that of an arc about an axis"),
        ("{start: [0, 0], center: [0, 0], angle: 1}", 2, "an arc of some length, got a radius of 0"),
        ("{start: [0, 0], end: [0, 0]}", 2, "end: expected another point than the start"),
        ("upper", 2, "a mesh file, or a line that is drawn, got none"),
    ],
)  # fmt: skip
def test_lines_that_cannot_be(line: str, dim: int, text: str) -> None:
    with pytest.raises(InputError, match=text):
        build.parts(scene(line, dim))


CLOSED = """\
schema: 1
dimension: 2
bodies:
  ring:
    type: cable
    line: {start: [1 m, 0], center: [0, 0], angle: 360 deg, points: {top: 0.25, back: 0.5}}
    cells: 64
    section: {shape: circular, diameter: 10 mm}
    material: steel
joints:
  close: {type: weld, at: ring.left, to: ring.right}
  a: {type: slider, at: ring.left, direction: [1, 0]}
  b: {type: slider, at: ring.back, direction: [1, 0]}
  c: {type: slider, at: ring.top, direction: [0, 1]}
loads: {p: {type: line_load, body: ring, force: [0, 1 N/m], follower: true}}
analysis: {type: buckling, count: 3}
"""


@pytest.mark.filterwarnings("ignore:.*some loads turn with the structure")
@pytest.mark.parametrize(("kind", "cells", "error"), [("cable", 64, 3e-4), ("beam", 32, 1e-4)])
def test_a_ring_buckles_under_a_pressure_that_follows(
    tmp_path: Path, kind: str, cells: int, error: float
) -> None:
    """(k^2 - 1) E I / R^3 of k waves, 3 and 8 (M. Levy 1884); S. P. Timoshenko, J. M. Gere, Theory
    of Elastic Stability, 2nd ed. 1961, section 7.3.
    """
    text = CLOSED.replace("type: cable", f"type: {kind}").replace("cells: 64", f"cells: {cells}")
    (tmp_path / "ring.yaml").write_text(text, encoding="utf-8")
    factors = studies.run(tmp_path / "ring.yaml").report["load_factors"]
    bends = 210e9 * np.pi * 0.01**4 / 64.0
    assert_allclose(factors[:3], [3.0 * bends, 3.0 * bends, 8.0 * bends], rtol=error)
