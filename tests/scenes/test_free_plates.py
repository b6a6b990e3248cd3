"""Plates of free meshes from scenes: the interpolation that converges is taken, and stresses meet
exact ones.
"""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from fmbs_skfem import scenes, studies
from fmbs_skfem.scenes import surfaces
from fmbs_skfem.shapes import ancf_plate, fvs_plate, plate_meshes
from fmbs_skfem.shapes.plate_meshes import PlateMesh

from ..shapes.test_fvs_plate import MESHES, Mesh, shaken

SCENE = """
schema: 1
name: clamped
bodies:
  plate: {type: plate, mesh: MESH, thickness: 10 mm, material: {young_modulus: 210 GPa, density: 7850 kg/m^3, poisson_ratio: 0.3}}
joints: {rim: {type: edge, body: plate, edges: rim, slope: z}}
loads: {p: {type: pressure, body: plate, pressure: 100 Pa}}
analysis: {type: static, load_steps: 1}
outputs:
  w: {type: position, at: plate.middle, component: z}
  s: {type: stress_tensor, at: plate.middle}
"""
#: S. Timoshenko, S. Woinowsky-Krieger, Theory of Plates and Shells (1959), table 35: 0.00126532 q
#: a^4 / D and 0.0229051 q a^2
DEFLECTION, STRESS = 6.5797e-6, 6 * 0.0229051 * 100.0 / 0.01**2


def centred(mesh: Mesh) -> PlateMesh:
    """The mesh with the node next to the middle moved there, its groups `middle` and `rim`."""
    points, cells = mesh[0].copy(), mesh[1]
    middle = int(np.argmin(np.linalg.norm(points - 0.5, axis=1)))
    points[middle] = 0.5
    sides = np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2)
    same = np.sort(sides, axis=1) @ [len(points), 1]
    rim = sides[np.isin(same, np.flatnonzero(np.bincount(same) == 1))]
    places = np.column_stack([points, np.zeros(len(points))])
    return PlateMesh(
        places, cells, {"middle": np.array([middle])}, {"rim": rim}, {"all": np.arange(len(cells))}
    )


def centre(folder: Path, name: str, options: str = "") -> tuple[float, float, float]:
    """Deflection and the two stresses in the middle of the clamped square."""
    scene = folder / "scene.yaml"
    scene.write_text(SCENE.replace("MESH", name + options), encoding="utf-8")
    last = {key: float(values[-1]) for key, values in studies.run(scene).outputs.items()}
    return last["w"], last["s_11"], last["s_22"]


@pytest.mark.parametrize(
    ("kind", "n", "deflection", "stress"),
    [("free quads", 32, 4e-3, 0.01), ("free triangles", 24, 6e-3, 0.03)],
)
def test_stress_in_the_middle_of_a_clamped_square(
    kind: str, n: int, deflection: float, stress: float, tmp_path: Path
) -> None:
    plate_meshes.write(centred(MESHES[kind](n)), tmp_path / "free.msh")
    w, s11, s22 = centre(tmp_path, "free.msh")
    assert w == pytest.approx(DEFLECTION, rel=deflection)
    assert (s11, s22) == pytest.approx((STRESS, STRESS), rel=stress)


def test_quads_and_triangles_in_one_body(tmp_path: Path) -> None:
    """The quads are cut: the nodes of the file, and no more, move."""
    mesh = centred(shaken(16))
    half = mesh.points[mesh.cells].mean(axis=1)[:, 0] < 0.5
    cut = np.concatenate([mesh.cells[half][:, [0, 1, 2]], mesh.cells[half][:, [0, 2, 3]]])
    middle, rim = mesh.point_groups["middle"], mesh.edge_groups["rim"]
    cells = [
        ("vertex", middle[:, None]),
        ("line", rim),
        ("triangle", cut),
        ("quad", mesh.cells[~half]),
    ]
    tags = [
        np.array([1]),
        np.full(len(rim), 2),
        np.full(len(cut), 3),
        np.full(int((~half).sum()), 3),
    ]
    names = {"middle": np.array([1, 0]), "rim": np.array([2, 1]), "all": np.array([3, 2])}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.write(
        tmp_path / "mixed.msh",
        meshio.Mesh(mesh.points, cells, cell_data=data, field_data=names),
        "gmsh22",
        binary=True,
    )
    with pytest.warns(UserWarning, match="cut along its shorter diagonal"):
        w, s11, s22 = centre(tmp_path, "mixed.msh")
    assert w == pytest.approx(DEFLECTION, rel=0.02)
    assert (s11, s22) == pytest.approx((STRESS, STRESS), rel=0.06)


@pytest.mark.parametrize(
    ("mesh", "dim", "expected"),
    [
        (shaken(8, 0.0), 3, "ancf"),
        (shaken(8, 0.01), 3, "ancf"),
        (shaken(8, 0.05), 3, "fvs"),
        (shaken(8, 0.25), 2, "ancf"),
        (MESHES["free quads"](8), 3, "fvs"),
        (MESHES["free quads"](8), 2, "ancf"),
        (MESHES["free triangles"](8), 3, "fvs"),
        (MESHES["free triangles"](8), 2, "fvs"),
    ],
)
def test_the_interpolation_that_converges_is_taken(mesh: Mesh, dim: int, expected: str) -> None:
    assert surfaces.choose(centred(mesh), dim) == expected


def test_what_a_scene_names_is_taken(tmp_path: Path) -> None:
    plate_meshes.write(centred(shaken(4)), tmp_path / "free.msh")
    for word, space in (("ancf", ancf_plate.PlateTangents), ("fvs", fvs_plate.Conforming)):
        plate = scenes.loads(
            SCENE.replace("MESH", f"free.msh, interpolation: {word}"), tmp_path
        ).bodies["plate"]
        assert type(plate.surface(tmp_path).space) is space
