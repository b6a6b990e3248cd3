"""Plates that a scene draws, against exact deflections and stresses, and what is wrong with one.

S. Timoshenko, S. Woinowsky-Krieger, Theory of Plates and Shells, 2nd ed., McGraw-Hill 1959: art. 16,
17 (discs), 44 (a clamped square); R. E. Peterson, Stress Concentration Factors, 1974: Howland's plate
with a hole.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem import dynamics, scenes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.scenes import build

SCENE = """\
schema: 1
dimension: {dim}
bodies:
  p:
    type: plate
    {drawn}
    thickness: 1 mm
    material: steel
    {more}
joints:
  {joints}
loads:
  {load}
analysis: {{type: static, load_steps: 1}}
outputs:
  {outputs}
"""
D = 210e9 * 1e-9 / 12.0 / (1.0 - 0.09)
#: so small that the middle surface does not stretch
PRESSURE = "q: {type: pressure, body: p, pressure: -1e-4 Pa}"
CENTER = "w: {type: displacement, at: p.center, component: z}"


def scene(
    drawn: str,
    joints: str,
    load: str = PRESSURE,
    outputs: str = CENTER,
    dim: int = 3,
    more: str = "",
) -> scenes.Scene:
    parts = {"joints": joints, "load": load, "outputs": outputs, "dim": dim, "more": more}
    return scenes.loads(SCENE.format(drawn=drawn, **parts))


def solved(found: scenes.Scene) -> dict[str, float]:
    path = dynamics.solve_statics(build.system(found), 1)
    return {name: float(values[-1]) for name, values in dynamics.outputs(path).items()}


def held(edges: str, slope: str) -> str:
    more = f", slope: {slope}" if slope else ""
    return f"hold: {{type: edge, body: p, edges: {edges}{more}}}"


@pytest.mark.parametrize(
    "more", ["", "origin: [1, 2, 3]\n    rotation: {axis: [1, 2, 3], angle: 0.7}"]
)
def test_a_clamped_square(more: str) -> None:
    """w = 0.00126532 q a^4 / D in the middle, wherever it lies."""
    outputs = "w: {type: displacement, at: p.center}"
    square = "rectangle: {width: 1 m, height: 1 m}"
    edges = held("[left, right, bottom, top]", "xyz")
    found = solved(scene(square, edges, outputs=outputs, more=more))
    moved = np.linalg.norm([found["w_x"], found["w_y"], found["w_z"]])
    assert moved == pytest.approx(0.00126532e-4 / D, rel=2e-4)


@pytest.mark.parametrize(("slope", "factor"), [("z", 1.0), ("", 5.3 / 1.3)])
def test_a_disc(slope: str, factor: float) -> None:
    """w = q R^4 / 64 D clamped, (5 + nu) / (1 + nu) of that hinged; the largest moment is q R^2 / 8 at
    the clamped edge, (3 + nu) q R^2 / 16 in all directions in the middle of the hinged one.
    """
    outputs = f"{CENTER}\n  u: {{type: utilisation, of: p}}"
    found = solved(scene("disc: {radius: 1 m}", held("outer", slope), outputs=outputs))
    assert found["w"] == pytest.approx(-factor * 1e-4 / 64.0 / D, rel=3e-3)
    moment = 1e-4 * (np.sqrt(1.0 - 0.3 + 0.09) / 8.0 if slope else 3.3 / 16.0)
    assert found["u"] == pytest.approx(6e6 * moment / 235e6, rel=0.02)


def annulus(hole: float) -> float:
    """Deflection of the free outer edge, at the radius 1 m, of one that is clamped inside.

    w = q r^4 / 64 D + A + B ln r + C r^2 + E r^2 ln r,    w = w' = 0 inside,    M_r = Q_r = 0 outside
    """
    q, nu = -1e-4, 0.3
    s, L = hole, np.log(hole)
    rows = [
        [1.0, L, s**2, s**2 * L],
        [0.0, 1.0 / s, 2.0 * s, 2.0 * s * L + s],
        [0.0, nu - 1.0, 2.0 * (1.0 + nu), 3.0 + nu],
        [0.0, 0.0, 0.0, 4.0],
    ]
    part = q / 64.0 / D * np.array([s**4, 4.0 * s**3, 12.0 + 4.0 * nu, 32.0])
    found = np.linalg.solve(rows, -part)
    return float(q / 64.0 / D + found[0] + found[2])


def test_an_annulus_converges() -> None:
    """Clamped at the frame of its hole, as at the edge."""
    outputs = "w: {type: displacement, at: p.right, component: z}"
    rim = "rims: {hub: {edges: inner, slopes: true}}"

    def error(cells: int, joint: str = "hold: {type: clamp, at: p.hub}", more: str = rim) -> float:
        drawn = f"disc: {{radius: 1 m, hole_radius: 0.5 m, cells: {cells}}}"
        return solved(scene(drawn, joint, outputs=outputs, more=more))["w"] / annulus(0.5) - 1.0

    coarse, fine = error(2), error(6)
    assert abs(fine) < 0.01
    assert coarse / fine > 5.0
    assert error(2, held("inner", "z"), "") == pytest.approx(coarse, rel=1e-6)


def test_a_hole_in_a_strip_concentrates_stress() -> None:
    """3.14 times the stress of the strip at a hole of a fifth of its width (Howland), and its mass;
    upright, too.
    """
    mises = []
    for turned in (False, True):
        x, width, height, start, end = "x", 1.0, 0.5, "left", "right"
        if turned:
            x, width, height, start, end = "y", height, width, "bottom", "top"
        drawn = f"rectangle: {{width: {width}, height: {height}, hole_radius: 0.05}}"
        force = [0.0, 1e3] if turned else [1e3, 0.0]
        guide = f"guide: {{type: slider, at: p.left_bottom, direction: {force}}}"
        joints = f"hold: {{type: edge, body: p, edges: {start}, fixed: {x}}}\n  {guide}"
        load = f"q: {{type: edge_load, body: p, edges: {end}, force: {force}}}"
        made = scene(drawn, joints, load, "u: {type: utilisation, of: p}", dim=2)
        mises.append(solved(made)["u"] * 235.0)
    assert mises[0] == pytest.approx(3.14, rel=0.015)
    assert mises[1] == pytest.approx(mises[0], rel=1e-6)
    (body,) = build.parts(made)
    assert body.total_mass == pytest.approx(7.85 * (0.5 - np.pi * 0.05**2), rel=1e-6)


@pytest.mark.parametrize(
    ("drawn", "edges", "points", "cells"),
    [
        ("rectangle: {width: 2 m, height: 1 m, cells: 3}", "bottom left right top", "left_bottom", 18),
        ("rectangle: {width: 1 mm, height: 1 mm, cells: 1}", "bottom left right top", "right_top", 1),
        ("rectangle: {width: 1 km, height: 1 m, cells: 1}", "bottom left right top", "right_top", 12),
        ("rectangle: {width: 1 m, height: 2 m, hole_radius: 0.499 m}", "bottom inner left right top", "left_top", None),
        ("disc: {radius: 1 mm, cells: 1}", "outer", "bottom center left right top", 20),
        ("disc: {radius: 1 km, hole_radius: 999 m, cells: 1}", "inner outer", "bottom left right top", 32),
    ],
)  # fmt: skip
def test_names_and_cells(drawn: str, edges: str, points: str, cells: int | None) -> None:
    (body,) = build.parts(scene(drawn, held(edges.split()[-1], "z"), outputs="e: {type: energy}"))
    assert body.space is not None
    assert sorted(body.space.edges) == edges.split()  # type: ignore[union-attr]
    assert set(points.split()) <= set(body.places)
    assert cells is None or len(body.space.nodes) == cells  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("drawn", "told"),
    [
        ("rectangle: {width: 0, height: 1 m}", r"p.rectangle.width: expected a length \[m\] > 0"),
        ("rectangle: {width: 1 m}", "p.rectangle.height: expected the key 'height'"),
        ("rectangle: {width: 1 m, height: 2 m, hole_radius: 0.5 m}", "hole_radius: expected a hole inside .* below 0.5 m"),
        ("disc: {radius: 1 m, hole_radius: 2 m}", "disc.hole_radius: expected a hole inside .* below 1 m, got 2 m"),
        ("disc: {radius: 1 m, hole_radius: -2 m}", "disc.hole_radius: expected a length"),
        ("disc: {radius: 1 m, cells: 0}", "p.disc.cells: expected"),
        ("disc: {radius: 1 m}\n    mesh: a.msh", "p.mesh: expected a mesh file, a rectangle or a disc, got mesh, disc"),
        ("origin: [0, 0, 0]", "p.mesh: expected a mesh file, a rectangle or a disc, got none"),
        ("disc: {radius: 1 m}\n    interpolation: argyris", "mesh that is drawn: expected triangles for argyris, got quads"),
        ("disc: {radius: 1 m}\n    interpolation: bfs", "bfs"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(drawn: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        build.system(scene(drawn, held("outer", "z")))
