"""Shells on free meshes: published shells with observed orders, stresses, tubes, rigid motions,
frequencies, files of scenes.

Sources: `verification.statics_shells` (Scordelis-Lo roof 0.30059246, pinched cylinder 164.24 P/(E
t)); R. H. MacNeal, R. L. Harder, Finite Elem. Anal. Des. 1 (1985) 3-20, doi
10.1016/0168-874X(85)90003-4 (hemisphere with a hole of 18 degrees, 0.094; 0.0935 without shear, by
quartic splines); R. Bredt (1896): a tube turns by M l / (2 pi R^3 t G).
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import meshio
import numpy as np
import pytest
from scipy.interpolate import CloughTocher2DInterpolator
from scipy.spatial.transform import Rotation

from fmbs_skfem import scenes
from fmbs_skfem.bodies import Material
from fmbs_skfem.bodies.plate import Rim, local_table, on_nodes, plate
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import Trajectory, outputs, solve_statics
from fmbs_skfem.dynamics.outputs import body_coordinates
from fmbs_skfem.shapes import fvs_shell, nurbs, plate_meshes, surface
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.systems import At, assemble, eliminate
from fmbs_skfem.systems.compiled import compile_system, elastic_tangent, residual
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from verification.beams import TIGHT
from verification.statics_shells import PINCHED, ROOF_FREE, loaded, mirror

from ..shapes.test_fvs_plate import MESHES
from ..shapes.test_fvs_shell import bent, cylinder, mixed

# corners belong to two edges
pytestmark = pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
KINDS = ["free triangles", "free quads", "distorted quads"]
ROOF = cylinder(np.radians(40.0), 25.0, 25.0)
WEIGHT = 1e-4  #: part of the load


def loaded_roof(shape: Surface, first: str, across: str, middle: str, **sensed: str) -> Trajectory:
    """The Scordelis-Lo roof under a small load; the edges `first` and `middle` are its planes of
    symmetry.
    """
    held = [
        joints.Edge("diaphragm", "plate", (across,), "xz"),
        mirror("x", first),
        mirror("y", middle),
    ]
    weight = loads.SurfaceLoad("weight", "plate", (0.0, 0.0, -90.0 * WEIGHT))
    return solve_statics(loaded(shape, 0.25, 4.32e8, 0.0, held, [weight], **sensed), 1, TIGHT)


def roof(kind: str, n: int) -> float:
    """Deflection of the free edge over the published one, less 1."""
    shape, _ = fvs_shell.surface(bent(MESHES[kind](n), ROOF))
    w = outputs(loaded_roof(shape, "left", "bottom", "top", tip="tip"))["tip_z"]
    return float(w[0] - w[-1]) / WEIGHT / ROOF_FREE - 1.0


def strains(shape: Surface, found: Trajectory, order: int) -> tuple[np.ndarray, ...]:
    """Points (x, 2) along the arc and the axis, areas (x,), strains and curvatures (x, 2, 3): 11,
    22, 12 along these.
    """
    values = surface.tabulate(shape, order)
    local, area, bend = local_table(values.values, values.weights, shape.reference[shape.nodes])
    moved = body_coordinates(found)[-1].reshape(-1, 3)
    x = on_nodes(values.values[:, :, :1], shape.reference[shape.nodes])[:, :, 0]
    before, after = (
        on_nodes(local, coordinates[shape.nodes]) for coordinates in (shape.reference, moved)
    )
    stretch = 0.5 * (np.einsum("epac,epbc->epab", after[:, :, :2], after[:, :, :2]) - np.eye(2))
    normal = np.cross(after[:, :, 0], after[:, :, 1])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    bent_by = np.einsum("epkc,epc->epk", after[:, :, 2:], normal) - bend
    phi = np.arctan2(x[..., 0], x[..., 2])
    arc, axis = np.stack([np.cos(phi), 0 * phi, -np.sin(phi)], axis=-1), np.array([0.0, 1.0, 0.0])
    turn = np.stack(
        [np.einsum("epkc,epc->epk", before[:, :, :2], arc), before[:, :, :2] @ axis], axis=2
    )
    sign = np.sign(np.linalg.det(turn))[..., None, None]
    both = np.stack([stretch, sign * bent_by[..., [0, 2, 2, 1]].reshape(stretch.shape)], axis=2)
    both = np.einsum("epia,epkab,epjb->epkij", turn, both, turn)[..., [0, 1, 0], [0, 1, 1]] / WEIGHT
    return (
        np.stack([25.0 * phi, x[..., 1]], axis=-1).reshape(-1, 2),
        area.ravel(),
        both.reshape(-1, 2, 3),
    )


@cache
def spline_strains() -> CloughTocher2DInterpolator:
    shape = nurbs.surface(*nurbs.cylinder_panel(25.0, 25.0, 0.0, np.radians(40.0), 16, 16, 4))
    x, _, both = strains(shape, loaded_roof(shape, "xi1_min", "xi2_min", "xi2_max"), 4)
    return CloughTocher2DInterpolator(x, both)


@pytest.mark.parametrize("kind", ["free triangles", "free quads"])
def test_orders_of_strains(kind: str) -> None:
    """Beside quartic splines, in the mean: strains fall by a factor of four, curvatures by two."""
    errors = []
    for n in (8, 16):
        shape, _ = fvs_shell.surface(bent(MESHES[kind](n), ROOF))
        x, area, both = strains(shape, loaded_roof(shape, "left", "bottom", "top"), 3)
        exact = spline_strains()(x)
        known = np.isfinite(exact).all(axis=(1, 2))
        squares = [
            (area[known, None, None] * some[known] ** 2).sum(axis=(0, 2))
            for some in (both - exact, exact)
        ]
        errors.append(np.sqrt(squares[0] / squares[1]))
    membrane, bending = np.log2(errors[0] / errors[1])
    assert membrane > 1.8
    assert bending > 0.9
    assert (errors[1] < [0.03, 0.045]).all()


@pytest.mark.parametrize("kind", KINDS)
def test_scordelis_lo(kind: str) -> None:
    """The order between 8 and 16 cells a side; fitted normals do not lock the planes of symmetry."""
    coarse, fine = (abs(roof(kind, n)) for n in (8, 16))
    assert np.log2(coarse / fine) > 2.4
    assert fine < 1.3e-3


def sphere(u: np.ndarray) -> np.ndarray:
    a, b = 0.5 * np.pi * u[:, 0], np.radians(72.0) * u[:, 1]
    return 10.0 * np.column_stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)])


@pytest.mark.parametrize(("kind", "n"), [("free triangles", 28), ("free quads", 24)])
def test_hemisphere_with_a_hole(kind: str, n: int) -> None:
    """Two forces of 2 outwards, two inwards: bending without stretch, R/t = 250."""
    shape, _ = fvs_shell.surface(bent(MESHES[kind](n), sphere))
    out, back = At("plate", "out"), At("plate", "back")
    held = [
        mirror("y", "left"),
        mirror("x", "right"),
        joints.Slider("height", out, (1.0, 0.0, 0.0)),
    ]
    small = 1e-3
    load = [
        loads.PointForce("A", out, (small, 0.0, 0.0)),
        loads.PointForce("B", back, (0.0, -small, 0.0)),
    ]
    found = outputs(
        solve_statics(
            loaded(shape, 0.04, 6.825e7, 0.3, held, load, out="out", back="back"), 1, TIGHT
        )
    )
    moved = np.array([found["out_x"][-1] - 10.0, 10.0 - found["back_y"][-1]]) / small
    assert moved == pytest.approx(0.0935, rel=0.01)
    assert moved == pytest.approx(0.094, rel=0.02)


def test_pinched_cylinder() -> None:
    """The force is a point load: of order 2 from 2 x 16 cells on."""
    found = []
    for n in (16, 32):
        shape, _ = fvs_shell.surface(
            bent(MESHES["free quads"](n), cylinder(0.5 * np.pi, 300.0, 300.0))
        )
        held = [
            mirror("x", "left"),
            mirror("z", "right"),
            mirror("y", "bottom"),
            joints.Edge("diaphragm", "plate", ("top",), "xz"),
        ]
        load = [loads.PointForce("P", At("plate", "out"), (0.0, 0.0, -2.5))]
        w = outputs(solve_statics(loaded(shape, 3.0, 3e6, 0.3, held, load, under="out"), 1, TIGHT))[
            "under_z"
        ]
        found.append(1.0 - float(w[0] - w[-1]) / 10.0 / PINCHED)
    assert 0.0 < found[1] < 0.02
    assert np.log2(found[0] / found[1]) > 1.5


# ------------------------------------------------------------------------------------------------------------------- tubes
RADIUS, LENGTH, T, E, NU = 1.0, 3.0, 0.02, 1e9, 0.3
MATERIAL = Material(E, 1000.0, NU)


@cache
def tube(kind: str, n: int) -> Surface:
    return fvs_shell.surface(
        bent(MESHES[kind](n), cylinder(2 * np.pi, RADIUS, LENGTH), closed=True)
    )[0]


@pytest.mark.parametrize("kind", ["free triangles", "free quads"])
def test_tubes_turn_as_bredt_says(kind: str) -> None:
    body = plate(
        "tube",
        tube(kind, 20),
        T,
        MATERIAL,
        rims={end: Rim((end,), slopes=False) for end in ("bottom", "top")},
    )
    load = [loads.Moment("M", At("tube", "top"), (0.0, 1e3, 0.0))]
    sensed = {"p": probes.Position(At("tube", "middle"))}
    system = eliminate(
        assemble([body], [joints.Clamp("c", At("tube", "bottom"))], load, outputs=sensed)
    )
    found = outputs(solve_statics(system, 1, TIGHT))
    z, x = found["p_z"], found["p_x"]
    angle = (z[0] * x[1] - x[0] * z[1]) / RADIUS**2
    bredt = 1e3 * found["p_y"][0] / (2 * np.pi * RADIUS**3 * T * E / (2 * (1 + NU)))
    assert angle == pytest.approx(bredt, rel=1.5e-3)


def test_rotated_shells_have_no_stress() -> None:
    body = plate("tube", tube("free quads", 14), T, MATERIAL)
    system = compile_system(assemble([body], [], []))
    turned = body.reference @ Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix().T
    force = residual(system, turned.ravel(), np.zeros(0), 0.0)
    assert (
        np.abs(force).max()
        < 1e-14 * abs(elastic_tangent(system, body.reference.ravel(), 0.0)).max()
    )


def test_stress_of_a_tube_under_pressure(tmp_path: Path) -> None:
    """Hoop stress p R / t and that along it, nu p R / t, as the ends are held."""
    text = """\
schema: 1
bodies:
  tube: {type: shell, mesh: tube.msh, thickness: 20 mm, material: {young_modulus: 1 GPa, density: 1000, poisson_ratio: 0.3}}
joints: {ends: {type: edge, body: tube, edges: [bottom, top]}}
loads: {p: {type: pressure, body: tube, pressure: 1 Pa}}
analysis: {type: static, load_steps: 1}
outputs: {s: {type: stress_tensor, at: tube.middle}}
"""
    errors = []
    for n in (14, 28):
        mesh = bent(MESHES["free triangles"](n), cylinder(2 * np.pi, RADIUS, LENGTH), closed=True)
        plate_meshes.write(mesh, tmp_path / "tube.msh")
        found = scenes.loads(text, tmp_path).run().outputs
        got = sorted((float(found["s_1"][-1]), float(found["s_2"][-1])))
        errors.append(np.abs(np.array(got) / (RADIUS / T) - [NU, 1.0]).max())
    assert errors[1] < 0.02
    assert errors[1] < 0.5 * errors[0]


# ------------------------------------------------------------------------------------------------------------------- files
SCENE = """\
schema: 1
bodies:
  roof: {type: shell, mesh: roof.msh, thickness: 0.25 m, material: {young_modulus: 432 MPa, density: 360, poisson_ratio: 0}}
joints:
  diaphragm: {type: edge, body: roof, edges: bottom, fixed: xz}
  crown: {type: edge, body: roof, edges: left, fixed: x, slope: yz}
  middle: {type: edge, body: roof, edges: top, fixed: y, slope: xz}
loads: {weight: {type: surface_load, body: roof, force: [0, 0, -90e-4]}}
analysis: {type: static, load_steps: 1}
outputs:
  tip: {type: position, at: roof.tip, component: z}
"""


def test_quads_and_triangles_in_one_shell(tmp_path: Path) -> None:
    """A mesh of both in a file, its quads cut, has the order of triangles alone."""
    errors = []
    for n in (8, 16):
        (points, quads), left = mixed(n)
        mesh = bent((points, quads), ROOF)
        some = quads[left]
        both = np.concatenate([some[:, [0, 1, 2]], some[:, [0, 2, 3]]])
        cells, tags, names = (
            [("triangle", both), ("quad", quads[~left])],
            [np.full(len(both), 9), np.full((~left).sum(), 9)],
            {},
        )
        for kind, own, dim in (("line", mesh.edge_groups, 1), ("vertex", mesh.point_groups, 0)):
            for name, rows in own.items():
                names[name] = np.array([len(names) + 10, dim])
                cells.append((kind, rows.reshape(len(rows), -1)))
                tags.append(np.full(len(rows), names[name][0]))
        names["all"] = np.array([9, 2])
        data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
        meshio.write(
            tmp_path / "roof.msh",
            meshio.Mesh(mesh.points, cells, cell_data=data, field_data=names),
            "gmsh22",
            binary=True,
        )
        with pytest.warns(Notice, match="every quad is cut along its shorter diagonal"):
            found = scenes.loads(SCENE, tmp_path).run().outputs
        errors.append(abs(float(found["tip"][0] - found["tip"][-1]) * 1e4 / ROOF_FREE - 1.0))
    assert errors[1] < 1.5e-3
    assert np.log2(errors[0] / errors[1]) > 2.4


def test_what_a_scene_does_with_a_free_shell(tmp_path: Path) -> None:
    """A rim that is clamped, pressure and a load on an edge balance; a plane stops what they lift."""
    plate_meshes.write(
        bent(MESHES["free quads"](10), cylinder(1.0, 1.0, 1.0)), tmp_path / "panel.msh"
    )
    text = """\
schema: 1
bodies:
  panel: {type: shell, mesh: panel.msh, thickness: 10 mm, material: {young_modulus: 1 GPa, density: 1000, poisson_ratio: 0.3},
          rims: {grip: {edges: right, slopes: true}}}
joints: {wall: {type: clamp, at: panel.grip}}
loads:
  p: {type: pressure, body: panel, pressure: 20 Pa}
  q: {type: edge_load, body: panel, edges: left, force: [0, 0, 5 N/m]}
  stop: {type: contact_plane, body: panel, point: [0, 0, HEIGHT m], normal: [0, 0, -1], stiffness: 1 kN/m}
analysis: {type: static, load_steps: 2}
outputs:
  wall: {type: reaction, joint: wall}
  z: {type: position, at: panel.crown, component: z}
"""
    free, stopped = (
        scenes.loads(text.replace("HEIGHT", height), tmp_path).run().outputs
        for height in ("1.1", "1.0055")
    )
    lifted = 20.0 * np.sin(1.0) + 5.0
    assert abs(float(free["wall_z"][-1])) == pytest.approx(lifted, rel=2e-3)
    assert abs(float(stopped["wall_z"][-1])) < 0.6 * lifted
    assert 1.0 < float(stopped["z"][-1]) < float(free["z"][-1])
