"""The guide to scene files: every block of it is a scene that `fmbs check` finds sound, and its
meshes are built as it says.
"""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

from fmbs_skfem.shapes import meshes, plate_meshes

from .. import pages
from ..cli.calls import ROOT, fmbs

GUIDE = "docs/scenes.md"
SCENES = pages.blocks(GUIDE, "yaml")
SOLID = (
    "section: {shape: circular, diameter: 10 mm}, material: {young_modulus: 1 GPa, density: 1800}"
)
LINE = f"{{type: %s, mesh: ../meshes/beam_20.msh, {SOLID}}}"
RIGID = "{type: rigid, mass: 0.1 kg, inertia: 1e-4 kg m^2, center: [%s, 0]}"
#: what stands around the blocks that are about other bodies than the first scene's, by one of these
AROUND = {
    "rail": """
dimension: 3
joints: {left: {type: clamp, at: rail.left}, right: {type: clamp, at: blade.left}}
loads: {tip: {type: point_force, at: rail.right, force: [0, 0, -5 N]}}
outputs: {tip: {type: position, at: rail.right}}""",
    "trolley": f"""
bodies: {{girder: {LINE % "cable"}, trolley: {RIGID % "0.1 m"}}}
joints: {{left: {{type: clamp, at: girder.left}}, right: {{type: clamp, at: girder.right}}}}
outputs: {{middle: {{type: position, at: {{body: girder, s: 0.5 m}}}}}}""",
    "hand": f"""
bodies: {{arm: {LINE % "cable"}, hand: {RIGID % "1 m"}}}
joints:
  clamp: {{type: clamp, at: arm.left}}
  wrist: {{type: pin, at: hand.frame, to: arm.right}}
  drive: {{type: driven_angle, at: hand.frame, to: arm.right, angle: 0.1 * t ** 2}}
loads: {{tip: {{type: point_force, at: arm.right, force: [0, -0.5 N]}}}}""",
    "body: arm": f"""
dimension: 3
bodies: {{arm: {LINE % "beam"}}}
joints: {{clamp: {{type: clamp, at: arm.left}}}}
loads: {{tip: {{type: point_force, at: arm.right, force: [0, 0, -0.5 N]}}}}""",
}


def project(folder: Path, text: str) -> Path:
    """A scene file in a project with the mesh that the guide takes."""
    for name in ("scenes", "meshes"):
        (folder / name).mkdir()
    mesh = Path("meshes", "beam_20.msh")
    for copy in (mesh, *(Path("scenes", name) for name in ("rail.msh", "blade.msh"))):
        (folder / copy).write_bytes((ROOT / mesh).read_bytes())
    path = folder / "scenes" / "scene.yaml"
    path.write_text(text)
    return path


def sections(text: str) -> dict[str, Any]:
    found = YAML(typ="safe").load(text)
    assert isinstance(found, dict)
    return found


@pytest.mark.parametrize("number", range(len(SCENES)))
def test_every_block_makes_a_sound_scene(number: int, tmp_path: Path) -> None:
    """A block replaces and adds sections of the first one, as the guide says; modes and buckling
    have no outputs.
    """
    text, block = io.StringIO(), sections(SCENES[number])
    around = next(
        (
            sections(one)
            for body, one in AROUND.items()
            if re.search(rf"\b{body}\b", SCENES[number])
        ),
        {},
    )
    block = around | {
        key: around[key] | value if key in around else value for key, value in block.items()
    }
    idle = ("outputs",) if block.get("analysis", {}).get("type") in ("modes", "buckling") else ()
    YAML(typ="safe").dump(
        {key: value for key, value in (sections(SCENES[0]) | block).items() if key not in idle},
        text,
    )
    done = fmbs("check", project(tmp_path, text.getvalue()), "--strict", "--json")
    assert done.code == 0, done.err


def test_the_first_scene_runs(tmp_path: Path) -> None:
    """The tip swings about its static deflection P l^3 / (3 EI) (Euler-Bernoulli), less far than
    twice that: it moves on an arc.
    """
    done = fmbs(
        "run", project(tmp_path, SCENES[0]), "--out", tmp_path / "out", "--no-plots", "--json"
    )
    assert done.code == 0, done.err
    table = np.genfromtxt(tmp_path / "out" / "outputs.csv", delimiter=",", names=True)
    static = 0.5 / (3 * 1e9 * np.pi * 0.01**4 / 64)
    assert 1.2 * static < -table["tip_y"].min() < 2 * static


def test_the_meshes_are_built_as_it_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for block in pages.blocks(GUIDE):
        pages.run(GUIDE, [block])
    line = meshes.read("beam.msh")
    assert line.points[line.point_groups["right"]].tolist() == [[1.0, 0.0, 0.0]]
    assert meshes.chain(line).tolist() == list(range(21))
    plate = plate_meshes.read("plate.vtu", planar=True)
    assert len(plate.cells) == 64
    assert len(plate.edge_groups["left"]) == 8
