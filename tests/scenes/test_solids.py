"""Solids in scenes: files of other programs, what is wrong with one, pictures and parts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import scenes, studies
from fmbs_skfem.bodies import Body
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes.solids import solid_meshes
from fmbs_skfem.shapes.solids.solid import Solid
from fmbs_skfem.studies import plans
from tests.cli.calls import fmbs

from ..solids import HEXA, box

SCENE = """\
schema: 1
dimension: 3
bodies:
  bar:
    type: solid
    {body}
    rims: {{left: left}}
    averages: {{right: right}}
joints:
  hold: {{type: clamp, at: bar.left}}
loads:
  push: {{type: point_force, at: bar.right, force: [0, 0, 1 N]}}
outputs:
  tip: {{type: position, at: bar.right}}
  s: {{type: recovered_stress, of: bar, group: left}}
analysis: {{type: static, load_steps: 2}}
"""
MATERIAL = "material: {young_modulus: 200 MPa, density: 1000, poisson_ratio: 0.3}"
ABAQUS = """\
*NODE
1, 0., 0., 0.
2, 100., 0., 0.
3, 100., 10., 0.
4, 0., 10., 0.
5, 0., 0., 10.
6, 100., 0., 10.
7, 100., 10., 10.
8, 0., 10., 10.
*ELEMENT, TYPE=C3D8R, ELSET=all
1, 1, 2, 3, 4, 5, 6, 7, 8
*SURFACE, NAME=left, TYPE=ELEMENT
1, S6
*NSET, NSET=right
2, 3, 6, 7
*SOLID SECTION, ELSET=all, MATERIAL=steel
*MATERIAL, NAME=steel
*ELASTIC
210000., 0.3
*DENSITY
7.85e-9
"""


def body_of(folder: Path, text: str) -> Body:
    """The body of a scene with a mesh."""
    path = folder / "scene.yaml"
    path.write_text(SCENE.format(body=text), encoding="utf-8")
    return build.parts(scenes.read(path))[0]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """One with a bar of hexahedra, and one cell by Abaqus in mm and tonnes."""
    mesh = replace(box((8, 1, 1), kind=HEXA), sets={"corner": np.array([0])})
    solid_meshes.write(mesh, tmp_path / "bar.msh")
    (tmp_path / "one.inp").write_text(ABAQUS, encoding="utf-8")
    return tmp_path


def test_a_file_in_millimetres_and_tonnes_brings_its_material(folder: Path) -> None:
    body = body_of(folder, "mesh: one.inp\n    unit: 1 mm\n    order: 1")
    assert body.total_mass == pytest.approx(7850.0 * 1e-5, rel=1e-9)
    assert body.values["young_modulus"].number == pytest.approx(210e9)
    shape = body.space
    assert isinstance(shape, Solid)
    assert {name: len(faces) for name, faces in shape.faces.items()} == {"left": 1, "right": 1}
    assert_allclose(shape.reference[shape.sets["right"], 0], 0.1)


def test_what_is_hardly_meant_is_told_before_a_run(folder: Path) -> None:
    """A file in mm without its unit, and a center in metres."""
    with pytest.warns(Notice, match="7.85e-09 kg/m3 is outside"):
        body_of(folder, "mesh: one.inp\n    order: 1")
    far = "unit: mm\n    order: 1\n    points: {}"
    text = SCENE.replace("{{left: left}}", "{{left: {{faces: left, center: [4, 0, 5]}}}}")
    path = folder / "far.yaml"
    path.write_text(text.format(body=f"mesh: one.inp\n    {far}"), encoding="utf-8")
    with pytest.warns(Notice, match="its center lies 6.4 m away from its nodes"):
        build.parts(scenes.read(path))


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("ELSET=all\n1", "ELSET=some\n1", "a material, got none"),
        ("*DENSITY\n7.85e-9\n", "", "one of E = 210000 and no density"),
    ],
)
def test_a_file_without_its_material(folder: Path, old: str, new: str, text: str) -> None:
    (folder / "one.inp").write_text(ABAQUS.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=text):
        body_of(folder, "mesh: one.inp\n    unit: mm\n    order: 1")


def test_a_face_is_no_place(folder: Path) -> None:
    text = SCENE.replace("averages: {{right: right}}", "averages: {{}}")
    path = folder / "face.yaml"
    path.write_text(text.format(body=f"mesh: bar.msh\n    {MATERIAL}"), encoding="utf-8")
    with pytest.raises(InputError, match="'right', faces or a set of nodes"):
        build.system(scenes.read(path))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mesh: bar.msh", "material: expected a material, got none; give `material`"),
        (f"mesh: bar.msh\n    {MATERIAL}\n    refine: 3", "1, 2, 4, 8 or another power of two"),
        (f"mesh: bar.msh\n    {MATERIAL}\n    axes: {{axis: [0, 0, 1], angle: 1}}", "orthotropic"),
        (f"mesh: bar.msh\n    {MATERIAL}\n    volume: rod", "one of its groups of solid cells"),
        (
            f"mesh: bar.msh\n    {MATERIAL}\n    points: {{tip: [0.51 m, 0, 0]}}",
            r"the place of a node .* the nearest one is at \(0.5, 0, 0\)",
        ),
    ],
)
def test_what_is_wrong_is_said_with_its_place(folder: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        body_of(folder, text)


def test_a_finer_mesh_and_points_by_their_place(folder: Path) -> None:
    text = f"mesh: bar.msh\n    {MATERIAL}\n    refine: 2\n    points: {{tip: [1 m, 0.1 m, 0.1 m]}}"
    body = body_of(folder, text)
    shape = body.space
    assert isinstance(shape, Solid)
    assert len(shape.nodes) == 64
    assert sorted(body.places) == ["corner", "tip"]
    assert body.total_mass == pytest.approx(10.0)


def test_a_run_draws_its_skin_and_says_how_far_stresses_are_known(folder: Path) -> None:
    body_of(folder, f"mesh: bar.msh\n    {MATERIAL}")
    result = studies.run(folder / "scene.yaml", out=folder / "out")
    assert 0.0 < result.report["stress_errors"]["s"] < 1.0
    found = fmbs("export", folder / "scene.yaml", "--out", folder / "vtk")
    assert found.code == 0, found.err
    assert (folder / "vtk" / "motion.pvd").exists()


def test_a_part_trained_at_rest_is_bent_as_its_body(folder: Path) -> None:
    """Within 1e-4 of the way, at a fifth of a radian."""
    body_of(folder, f"mesh: bar.msh\n    {MATERIAL}")
    scene = folder / "scene.yaml"
    call = ["--body", "bar", "--alone", "--strain", "2e-3", "--runs", "3", "--out", folder]
    found = fmbs("part", "train", scene, *call)
    assert found.code == 0, found.err
    ends = []
    for number, text in enumerate(("", "    type: part\n    file: bar.part.h5")):
        path = folder / f"try{number}.yaml"
        own = scene.read_text().replace("1 N]", "400 N]")
        if text:
            head, _, rest = own.partition("    type: solid")
            own = head + text + "\njoints" + rest.partition("joints")[2]
            own = own.replace("  s: {type: recovered_stress, of: bar, group: left}\n", "")
        path.write_text(own, encoding="utf-8")
        values = studies.run(path, out=folder / f"out{number}").report["outputs"]
        ends.append(values)
    one, two = (np.array([found[f"tip_{k}"]["final"] for k in "xyz"]) for found in ends)
    way = np.linalg.norm(one - [1.0, 0.05, 0.05])
    assert way > 0.05
    assert np.linalg.norm(two - one) < 1e-3 * way


TWO = """\
*NODE
1, 0., 0., 0.
2, 50., 0., 0.
3, 50., 10., 0.
4, 0., 10., 0.
5, 0., 0., 10.
6, 50., 0., 10.
7, 50., 10., 10.
8, 0., 10., 10.
9, 100., 0., 0.
10, 100., 10., 0.
11, 100., 0., 10.
12, 100., 10., 10.
*ELEMENT, TYPE=C3D8, ELSET=soft
1, 1, 2, 3, 4, 5, 6, 7, 8
*ELEMENT, TYPE=C3D8, ELSET=hard
2, 2, 9, 10, 3, 6, 11, 12, 7
*SURFACE, NAME=left, TYPE=ELEMENT
1, S6
*SURFACE, NAME=right, TYPE=ELEMENT
2, S4
*SOLID SECTION, ELSET=soft, MATERIAL=rubber
*SOLID SECTION, ELSET=hard, MATERIAL=steel
*MATERIAL, NAME=rubber
*ELASTIC
100., 0.
*DENSITY
1e-9
*MATERIAL, NAME=steel
*ELASTIC
200., 0.
*DENSITY
2e-9
"""


def test_two_materials_of_a_file_are_two_bodies_tied(folder: Path) -> None:
    """Two springs in a row, E A / l = 200 and 400 N/m, pulled by 1 mN; and one component."""
    (folder / "two.inp").write_text(TWO, encoding="utf-8")
    path = folder / "scene.yaml"
    body = "mesh: two.inp\n    unit: 1 mm\n    refine: 2\n    volume: soft"
    soft = (
        SCENE.format(body=body)
        .replace("{right: right}", "{}")
        .replace("of: bar, group: left", "of: hard, group: right")
    )
    mesh = "mesh: two.inp, unit: mm, volume: hard, averages: {right: right}"
    hard = f"  hard: {{type: solid, {mesh}}}\njoints:\n  glue: {{type: tie, body: bar, to: hard}}"
    text = soft.replace("joints:", hard).replace("bar.right", "hard.right")
    path.write_text(text.replace("[0, 0, 1 N]", "[1 mN, 0, 0]"), encoding="utf-8")
    scene = scenes.read(path)
    found = studies.run(path, out=folder / "out")
    tip = found.outputs["tip_x"]
    stretch = 1e-3 / (1e8 * 1e-4) * 0.05 * 1.5
    assert tip[-1] - tip[0] == pytest.approx(stretch, rel=1e-4)
    assert plans.components(scene) == {"bar": ["bar", "hard"]}
