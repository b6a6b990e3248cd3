"""Meshes of quads and triangles as plates: areas, groups, circles, constant strains and bending to
the last digit, numbering.
"""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes import ancf_plate, meshes, plate_meshes, splitting
from fmbs_skfem.shapes.msh import MshCells, Raw

POINTS = np.array([[0, 0], [1, 0], [2.2, 0], [3, 0], [0, 1], [1.2, 1], [2, 1], [3, 1]], float)
QUADS, TRIANGLES = np.array([[0, 1, 5, 4], [2, 3, 7, 6]]), np.array([[1, 2, 5], [2, 6, 5]])
LINES = {"left": [[4, 0]], "right": [[3, 7]], "bottom": [[0, 1], [1, 2], [2, 3]]}


def saved(path: Path, seed: int | None = None) -> Path:
    """A strip of two quads with two triangles between them, of which one is in a group with a quad."""
    place = np.arange(8) if seed is None else np.random.default_rng(seed).permutation(8)
    names = {name: np.array([tag, 1]) for tag, name in enumerate(LINES, 1)} | {
        "first": np.array([8, 2]),
        "second": np.array([9, 2]),
    }
    blocks = [("line", np.array(pairs), tag) for tag, pairs in enumerate(LINES.values(), 1)]
    blocks += [
        ("quad", QUADS[:1], 8),
        ("triangle", TRIANGLES[:1], 8),
        ("triangle", TRIANGLES[1:], 9),
        ("quad", QUADS[1:], 9),
    ]
    if seed is not None:
        blocks = [
            (kind, np.roll(cells, 1, axis=1) if kind != "line" else cells, tag)
            for kind, cells, tag in blocks[::-1]
        ]
    tags = [np.full(len(cells), tag) for _, cells, tag in blocks]
    points = np.column_stack([POINTS, np.zeros(8)])[np.argsort(place)]
    mesh = meshio.Mesh(
        points,
        [(kind, place[cells]) for kind, cells, _ in blocks],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data=names,
    )
    meshio.write(path, mesh, file_format="gmsh22")
    return path


@pytest.mark.parametrize(("corners", "cells", "first"), [(3, 6, 3), (4, 14, 7)])
def test_cells_and_groups(tmp_path: Path, corners: int, cells: int, first: int) -> None:
    with pytest.warns(Notice, match=r"2 quads and 2 triangles: every"):
        mesh = plate_meshes.read(saved(tmp_path / "a.msh"), True, corners=corners)
    assert mesh.cells.shape == (cells, corners)
    assert len(mesh.face_groups["first"]) == first
    x = mesh.points[mesh.cells][..., :2]
    area = 0.5 * np.sum(
        x[..., 0] * np.roll(x[..., 1], -1, 1) - np.roll(x[..., 0], -1, 1) * x[..., 1], axis=1
    )
    assert area.min() > 0
    assert area.sum() == pytest.approx(3.0, rel=1e-14)
    assert len(mesh.edge_groups["bottom"]) == (3 if corners == 3 else 6)
    assert np.ptp(mesh.points[mesh.edge_groups["left"].ravel(), 0]) == 0.0


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
def test_faces_of_one_kind_are_not_split(tmp_path: Path) -> None:
    """A face of triangles in a mixed file stays as it is; the whole file is refused where nobody
    says what to make of it.
    """
    mesh = saved(tmp_path / "a.msh")
    with pytest.raises(InputError, match="all quads or all triangles"):
        plate_meshes.read(mesh, True)
    blocks = [("quad", QUADS[:1]), ("triangle", TRIANGLES)]
    tags = [np.full(len(cells), tag) for tag, (_, cells) in enumerate(blocks, 8)]
    names = {"first": np.array([8, 2]), "second": np.array([9, 2])}
    points, data = (
        np.column_stack([POINTS, np.zeros(8)]),
        {"gmsh:physical": tags, "gmsh:geometrical": tags},
    )
    meshio.write(
        mesh, meshio.Mesh(points, blocks, cell_data=data, field_data=names), file_format="gmsh22"
    )
    assert plate_meshes.read(mesh, True, "first", corners=3).cells.shape == (1, 4)
    assert plate_meshes.read(mesh, True, "second").cells.shape == (2, 3)


def test_middles_lie_on_circles() -> None:
    """A ring of quads and triangles: its hole is as round as before."""
    n = 12
    turn = 2 * np.pi * np.arange(n) / n
    points = np.vstack(
        [r * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]) for r in (1.0, 2.0)]
    )
    i = np.arange(n)
    quads = np.column_stack([i, n + i, n + (i + 1) % n, (i + 1) % n])
    hole = np.column_stack([i, (i + 1) % n])
    triangles = np.vstack([quads[:1, [0, 1, 2]], quads[:1, [0, 2, 3]]])
    raw = Raw(
        points,
        np.arange(2 * n) + 5,
        {},
        MshCells(hole + 5, np.arange(n), {"hole": np.arange(n)}),
        MshCells(triangles + 5, np.arange(2), {}),
        MshCells(quads[1:] + 5, np.arange(n - 1), {}),
        {},
    )
    with pytest.warns(Notice):
        made = splitting.uniform(raw, "ring", 4, None)
    pairs = meshes.rows(made, made.lines.nodes, "ring", "lines")
    assert len(pairs) == 2 * n
    arc = ancf_plate.arcs_of(made.points[:, :2], {"hole": pairs})[0]
    assert arc.radius == pytest.approx(1.0, rel=1e-14)
    assert len(arc.edges) == 2 * n


PULL = """\
schema: 1
dimension: 2
bodies: {{strip: {{type: plate, mesh: a.msh, interpolation: {kind}, thickness: 1 cm,
         material: {{young_modulus: 1 GPa, density: 1000, poisson_ratio: 0}}}}}}
joints: {{left: {{type: edge, body: strip, edges: left}}}}
loads: {{pull: {{type: edge_load, body: strip, edges: right, force: [1 kN/m, 0]}}}}
analysis: {{type: static, load_steps: 1}}
outputs: {{x: {{type: position, at: strip.tip, component: x}}}}
"""


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
@pytest.mark.parametrize("seed", [None, 1])
@pytest.mark.parametrize("kind", ["ancf", "argyris"])
def test_a_strip_in_tension_is_exact(tmp_path: Path, kind: str, seed: int | None) -> None:
    """Nominal stress S l = n/t with the Green strain (l^2 - 1)/2 = S/E: l^3 - l = 2 n / (E t) over
    the whole strip.
    """
    mesh = plate_meshes.read(
        saved(tmp_path / "a.msh", seed), True, corners=3 if kind == "argyris" else 4
    )
    tip = np.flatnonzero((mesh.points[:, 0] == 3.0) & (mesh.points[:, 1] == 1.0))
    plate_meshes.write(
        type(mesh)(mesh.points, mesh.cells, {"tip": tip}, mesh.edge_groups, mesh.face_groups),
        tmp_path / "a.msh",
    )
    found = scenes.loads(PULL.format(kind=kind), tmp_path).run().outputs["x"]
    stretch = max(np.roots([1.0, 0.0, -1.0, -2 * 1e3 / (1e9 * 0.01)]).real)
    assert found[-1] == pytest.approx(3.0 * stretch, rel=1e-10)


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")
def test_scenes_take_mixed_meshes(tmp_path: Path) -> None:
    """Both interpolations and rigid plates, from one file."""
    saved(tmp_path / "a.msh")
    for kind, cells in (("ancf", 14), ("argyris", 6)):
        text = PULL.format(kind=kind).split("outputs")[0]
        (body,) = build.parts(scenes.loads(text, tmp_path))
        assert len(body.space.nodes) == cells
    rigid = "schema: 1\ndimension: 2\nbodies: {a: {type: rigid_plate, mesh: a.msh, thickness: 1 cm, density: 1000}}\n"
    rigid += "analysis: {type: static}\n"
    mass = build.system(scenes.loads(rigid, tmp_path)).mass
    assert mass[0, 0] == pytest.approx(30.0, rel=1e-12)
