"""Shells through the nodes of mesh files: order of the geometry, published shells, invariance,
meshes that are in no grid.

Sources: `verification.statics_shells` (Scordelis-Lo roof, 0.30059246 m without shear; pinched
cylinder, 164.24 P / (E t)).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes import plate_meshes, smoothing, structured, surface, table
from fmbs_skfem.shapes.plate_meshes import PlateMesh
from verification.statics_shells import PINCHED, ROOF_FREE

Shape = Callable[[np.ndarray, np.ndarray], np.ndarray]


def cylinder(angle: float, radius: float = 1.0, length: float = 1.0) -> Shape:
    """u, v in 0..1 -> points about the y axis, u from the crown on."""
    return lambda u, v: np.stack(
        [radius * np.sin(angle * u), length * v, radius * np.cos(angle * u)], axis=1
    )


def torus(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    ring, tube = 2 * np.pi * u, 2 * np.pi * v
    return np.stack(
        [(2 + np.cos(tube)) * np.cos(ring), (2 + np.cos(tube)) * np.sin(ring), np.sin(tube)], axis=1
    )


def sheet(
    shape: Shape,
    n: tuple[int, int],
    closed: tuple[bool, bool] = (False, False),
    seed: int | None = None,
) -> PlateMesh:
    """Quads of a surface over u, v with groups at its sides and corners; `seed` shuffles nodes,
    cells and their first vertices.
    """
    m1, m2 = n[0] + (not closed[0]), n[1] + (not closed[1])
    nodes = np.arange(m1 * m2).reshape(m1, m2)
    i, j = np.indices(n).reshape(2, -1)
    right, up = (i + 1) % m1, (j + 1) % m2
    cells = np.stack([nodes[i, j], nodes[right, j], nodes[right, up], nodes[i, up]], axis=1)
    u, v = np.meshgrid(np.arange(m1) / n[0], np.arange(m2) / n[1], indexing="ij")
    points = shape(u.ravel(), v.ravel())
    place = np.arange(len(points))
    if seed is not None:
        random = np.random.default_rng(seed)
        place = random.permutation(len(points))
        points = points[np.argsort(place)]
        cells = np.stack(
            [
                np.roll(row, random.integers(4))
                for row in place[cells][random.permutation(len(cells))]
            ]
        )
    nodes = place[nodes]
    ring = np.vstack([nodes, nodes[:1]]) if closed[0] else nodes
    edges = {"start": ring[:, 0], "end": ring[:, -1]} | (
        {} if closed[0] else {"crown": nodes[0], "free": nodes[-1]}
    )
    edges = (
        {}
        if closed[1]
        else {name: np.column_stack([row[:-1], row[1:]]) for name, row in edges.items()}
    )
    points_of = {
        "tip": nodes[-1:, -1],
        "middle": nodes[:1, m2 // 2],
        "below": nodes[m1 // 2, [m2 // 2]],
    }
    return plate_meshes.audit(
        PlateMesh(points, cells, points_of, edges, {"all": np.arange(len(cells))}), False
    )


@pytest.mark.parametrize(("angle", "closed"), [(1.0, False), (2 * np.pi, True)])
def test_geometry_is_of_fourth_order(angle: float, closed: bool) -> None:
    """The radius between nodes, with numbers shuffled, and its estimate within a factor of two."""
    errors = []
    for n in (8, 16, 32):
        shape, estimate = structured.surface(
            sheet(cylinder(angle), (n, 3), (closed, False), seed=n)
        )
        values = surface.tabulate(shape, 5)
        found = np.einsum("epb,ebc->epc", values.values[:, :, 0], shape.reference[shape.nodes])
        errors.append(np.abs(np.hypot(found[..., 0], found[..., 2]) - 1.0).max())
        assert estimate == pytest.approx(errors[-1], rel=1.0)
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(4.0, abs=0.2)


def test_torus_has_no_kink() -> None:
    shape, _ = structured.surface(sheet(torus, (24, 12), (True, True), seed=1))
    table.check_table(shape)
    assert smoothing.tie_slopes(shape).count == 25 * 13


def test_groups_keep_their_places() -> None:
    """Points, edges and faces of the file, wherever numbers begin, also where every quad is split."""
    plain, mixed = (sheet(cylinder(1.0), (5, 4), seed=seed) for seed in (None, 3))
    for cells in (1, 3):
        for mesh in (plain, mixed):
            shape, _ = structured.surface(mesh, cells)
            for name, (cell, *xi) in shape.points.items():
                if name in mesh.point_groups:
                    at = surface.sample(shape, np.array([cell]), np.array([xi])) @ shape.reference
                    assert at[0] == pytest.approx(
                        mesh.points[mesh.point_groups[name][0]], abs=1e-12
                    )
            assert len(shape.faces["all"]) == len(shape.nodes) == 20 * cells**2
            for name, axis, value in (("start", 1, 0.0), ("end", 1, 1.0), ("crown", 0, 0.0)):
                sides = shape.edges[name]
                assert len(sides) == cells * (4 if name == "crown" else 5)
                xi = surface.side_points(shape.parent, sides[:, 1], np.full(len(sides), 0.3))
                along = surface.sample(shape, sides[:, 0], xi) @ shape.reference
                assert along[:, axis] == pytest.approx(value, abs=1e-12)


ROOF = """\
schema: 1
bodies:
  roof: {{type: shell, mesh: roof.msh, cells: 2, thickness: 0.25 m,
         material: {{young_modulus: 432 MPa, density: 360 kg/m^3, poisson_ratio: 0}}}}
joints:
  diaphragm: {{type: edge, body: roof, edges: start, fixed: xz}}
  crown: {{type: edge, body: roof, edges: crown, fixed: x, slope: yz}}
  middle: {{type: edge, body: roof, edges: end, fixed: y, slope: xz}}
loads: {{weight: {{type: surface_load, body: roof, force: [0, 0, {force}]}}}}
analysis: {{type: static, load_steps: 1}}
outputs: {{edge: {{type: position, at: roof.tip, component: z}}}}
"""

CYLINDER = """\
schema: 1
bodies:
  tube: {type: shell, mesh: tube.msh, thickness: 3 m, material: {young_modulus: 3 MPa, density: 1, poisson_ratio: 0.3}}
joints:
  diaphragms: {type: edge, body: tube, edges: [start, end], fixed: xz}
  along: {type: slider, at: tube.middle, direction: [0, 0, 1]}
loads:
  down: {type: point_force, at: tube.middle, force: [0, 0, -1 mN]}
  up: {type: point_force, at: tube.below, force: [0, 0, 1 mN]}
analysis: {type: static, load_steps: 1}
outputs: {top: {type: position, at: tube.middle, component: z}, bottom: {type: position, at: tube.below, component: z}}
"""


def moved(text: str, folder: Path) -> dict[str, float]:
    """Changes of the outputs of a scene from its first to its last load."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)  # corners belong to two edges
        found = scenes.loads(text, folder).run().outputs
    return {name: float(values[-1] - values[0]) for name, values in found.items() if name != "t"}


def test_roof_of_a_mesh_file(tmp_path: Path) -> None:
    """The Scordelis-Lo roof through 7 x 7 nodes, however they are numbered, and from its other
    side.
    """
    found = []
    for seed in (None, 1, 2):
        mesh = sheet(cylinder(np.radians(40), 25.0, 25.0), (6, 6), seed=seed)
        cells = mesh.cells if seed != 2 else mesh.cells[:, ::-1]
        plate_meshes.write(
            PlateMesh(mesh.points, cells, mesh.point_groups, mesh.edge_groups, mesh.face_groups),
            tmp_path / "roof.msh",
        )
        found.append(moved(ROOF.format(force=-90e-4), tmp_path)["edge"])
    assert found[0] == pytest.approx(-ROOF_FREE * 1e-4, rel=2e-4)
    assert found[1:] == pytest.approx([found[0]] * 2, rel=1e-8)


def test_closed_cylinder_of_a_mesh_file(tmp_path: Path) -> None:
    """The whole pinched cylinder, closed where its mesh is, the nodes closer together under both
    forces.
    """
    half = np.linspace(0.0, 1.0, 13) ** 2
    turn = np.concatenate([0.25 * half, 0.5 - 0.25 * half[-2::-1]])
    turn = np.concatenate([turn, 0.5 + turn[1:]])
    along = 0.5 * np.concatenate([1 - half[::-1], 1 + half[1:]])
    round_ = cylinder(2 * np.pi, 300.0, 600.0)

    def shape(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return round_(
            np.interp(u, np.linspace(0, 1, 49), turn), np.interp(v, np.linspace(0, 1, 25), along)
        )

    plate_meshes.write(sheet(shape, (48, 24), (True, False), seed=4), tmp_path / "tube.msh")
    found = moved(CYLINDER, tmp_path)
    assert found["top"] == pytest.approx(-PINCHED * 1e-3, rel=5e-3)
    assert found["bottom"] == pytest.approx(-found["top"], rel=1e-6)


def folded(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.stack([np.minimum(u, 0.5), v, np.maximum(u - 0.5, 0.0)], axis=1)


def test_kinks_and_coarse_meshes_are_told(tmp_path: Path) -> None:
    """What the nodes do not define to a part of the thickness; without a degree, which wants a
    spline, kinks are refused.
    """
    plate_meshes.write(sheet(folded, (8, 6)), tmp_path / "roof.msh")
    with pytest.raises(
        InputError, match="cells that meet at an angle of at most 50 degrees, got 90 degrees"
    ):
        build.system(scenes.loads(ROOF.format(force=-1), tmp_path))
    with pytest.warns(
        Notice,
        match=r"defined to about .* m, .* % of its thickness: mesh it finer; where it has a kink",
    ):
        build.system(
            scenes.loads(
                ROOF.format(force=-1)
                .replace("0.25 m", "1 mm")
                .replace("cells", "degree: 3, cells"),
                tmp_path,
            )
        )


def refused(mesh: PlateMesh, *words: str) -> None:
    with pytest.raises(InputError) as caught:
        structured.surface(mesh)
    for word in words:
        assert word in str(caught.value), caught.value


def test_meshes_in_no_grid_are_refused() -> None:
    """With the node that is irregular, and what to do."""
    whole = sheet(cylinder(1.0), (4, 4))
    notch = PlateMesh(whole.points, whole.cells[:-1])
    refused(notch, "3 at the border node at", "Transfinite")
    split = whole.cells[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    refused(
        plate_meshes.audit(PlateMesh(whole.points, split), False),
        "structured quads",
        "32 triangles",
        "Transfinite",
    )
    a, b = np.radians(90 + 120 * np.arange(3)), np.radians(150 + 120 * np.arange(3))
    points = np.vstack(
        [[0, 0, 0], *([np.cos(x), np.sin(x), 0.1 * k] for k, x in enumerate((*a, *b)))]
    )
    star = plate_meshes.audit(
        PlateMesh(points, np.array([[0, 1, 4, 2], [0, 2, 5, 3], [0, 3, 6, 1]])), False
    )
    refused(star, "four quads at every inner node", "3 at the inner node at (0, 0, 0)")


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("{type: shell, nurbs: a.json, mesh: a.msh, ", ("NURBS patches or a mesh", "both")),
        ("{type: shell, ", ("NURBS patches or a mesh", "neither")),
        ("{type: shell, mesh: a.msh, degree: 2, ", ("degree 3 or more",)),
        ("{type: shell, mesh: none.msh, ", ("no such file",)),
    ],
)
def test_scenes_that_are_wrong(tmp_path: Path, body: str, words: tuple[str, ...]) -> None:
    material = "thickness: 1 mm, material: {young_modulus: 1 GPa, density: 1}}"
    text = f"schema: 1\nbodies:\n  a: {body}{material}\nanalysis: {{type: static}}\n"
    with pytest.raises(InputError) as caught:
        build.system(scenes.loads(text, tmp_path))
    assert all(word in str(caught.value) for word in words), caught.value
