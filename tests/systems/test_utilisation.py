"""Von Mises stresses over the yield strength, at places and of whole bodies, against formulas and what
other outputs and pictures read.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import dynamics, scenes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics.trajectory import Trajectory
from fmbs_skfem.results import motion
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes.solids import solid_meshes
from fmbs_skfem.systems.measures import utilisation
from fmbs_skfem.systems.system import Output

from ..solids import HEXA, box

MESHES = Path(__file__).parents[2] / "meshes"
BEAM = """\
schema: 1
dimension: 3
bodies:
  b:
    type: TYPE
    line: {start: [0, 0, 0], end: [0.6 m, 0, 0.8 m]}
    section: {shape: circular, diameter: 10 mm}
    material: MATERIAL
    cells: 40
joints: {hold: {type: clamp, at: b.left}}
loads: {tip: {type: point_force, at: b.right, force: [0, 1 N, 0]}}
analysis: {type: static, load_steps: 1}
outputs:
  u: {type: utilisation, of: b}
  root: {type: utilisation, at: b.left}
  middle: {type: utilisation, at: {body: b, s: 0.5 m}}
"""
PLATE = """\
schema: 1
dimension: 3
bodies:
  plate:
    type: plate
    mesh: plate_16x1.msh
    interpolation: bfs
    thickness: 0.1 m
    material: {young_modulus: 1.2 MPa, density: 1000, poisson_ratio: 0.3, yield_strength: 2 kPa}
    rotation: {axis: [1, 2, 3], angle: 1}
joints: {clamp: {type: edge, body: plate, edges: left, slope: xyz}}
loads: {p: {type: pressure, body: plate, pressure: 0.01 Pa}}
analysis: {type: static, load_steps: 1}
outputs:
  u: {type: utilisation, of: plate}
  a: {type: utilisation, at: plate.a}
  s: {type: stress, at: plate.a}
"""
SOLID = """\
schema: 1
dimension: 3
bodies:
  bar:
    type: solid
    mesh: bar.msh
    material: {young_modulus: 200 MPa, density: 1000, yield_strength: 4 kPa}
    rims: {left: left}
    averages: {right: right}
joints: {hold: {type: clamp, at: bar.left}}
loads: {push: {type: point_force, at: bar.right, force: [0, 0, 1 N]}}
analysis: {type: static, load_steps: 1}
outputs:
  u: {type: utilisation, of: bar}
  left: {type: utilisation, at: bar.left}
  s: {type: recovered_stress, of: bar, group: left}
"""


def read(text: str, folder: Path = MESHES) -> scenes.Scene:
    return scenes.loads(text, folder=folder)


def solved(scene: scenes.Scene) -> tuple[Trajectory, dict[str, float]]:
    path = dynamics.solve_statics(build.system(scene), 1)
    return path, {name: float(one[-1]) for name, one in dynamics.outputs(path).items()}


def test_a_beam_takes_what_its_moment_takes() -> None:
    """32 P s / pi d^3 R, at the distance s from the force."""
    text = BEAM.replace("TYPE", "beam")
    _, found = solved(read(text.replace("MATERIAL", "S355")))
    wanted = 32.0 / (np.pi * 1e-6 * 355e6)
    assert_allclose([found["u"], found["root"]], wanted, rtol=3e-4)
    assert found["middle"] == pytest.approx(0.5 * wanted, rel=1e-5)
    own = "{young_modulus: 210 GPa, density: 7850, yield_strength: 71 MPa}"
    assert solved(read(text.replace("MATERIAL", own)))[1]["u"] == pytest.approx(5.0 * found["u"])


def test_of_a_plate_it_is_the_largest_of_a_picture() -> None:
    path, found = solved(read(PLATE))
    assert found["a"] == pytest.approx(max(found["s_bottom"], found["s_top"]) / 2e3, rel=1e-12)
    picture = motion.frames(path).bodies["plate"].fields["von_mises"][-1]
    assert found["u"] == pytest.approx(picture.max() / 2e3, rel=1e-9)
    assert found["u"] > found["a"] > 0.5 * found["u"] > 0.0


def test_of_a_solid_it_is_that_of_all_nodes_or_of_a_group(tmp_path: Path) -> None:
    solid_meshes.write(box((4, 1, 1), (0.4, 0.1, 0.1), HEXA), tmp_path / "bar.msh")
    _, found = solved(read(SOLID, tmp_path))
    assert found["left"] == pytest.approx(found["s_von_mises"] / 4e3, rel=1e-12)
    # 6 P L / b h^2 at the clamp, in coarse cells
    assert found["u"] >= found["left"]
    assert found["u"] == pytest.approx(6.0 * 0.4 / 1e-3 / 4e3, rel=0.3)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("MATERIAL", "aluminium", "output 'u': expected a body whose material has a known yield str.*'b'; write yield_strength: 235 MPa"),
        ("of: b}", "of: b, at: b.left}", r"outputs.u.of: expected a place `at`, or `of` a body, got both"),
        ("of: b}", "of: c}", r"outputs.u.of: .*'c'"),
        ("of: b}", "}", r"outputs.u.of: expected a place `at`, or `of` a body, got neither"),
        ("of: b}", "at: b.tip}", r"outputs.u.*'tip'"),
        ("yield_strength: 1", "yield_strength: -1", r"yield_strength: expected a pressure \[Pa\] > 0"),
        ("yield_strength: 1", "yield: 1", "expected one of the keys .*yield_strength"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(old: str, new: str, told: str) -> None:
    own = "{young_modulus: 1 GPa, density: 1, yield_strength: 1}"
    text = BEAM.replace(old, new, 1).replace("TYPE", "beam")
    with pytest.raises(InputError, match=told):
        build.system(read(text.replace("MATERIAL", own.replace(old, new))))


def test_what_yields_is_told() -> None:
    outputs = {"u": Output("utilisation", (), ("u",)), "x": Output("position", (), ("x",))}
    columns = {"u": np.array([0.0, 1.7]), "x": np.array([0.0, 9.0])}
    (said,) = utilisation.beyond_yield(outputs, columns)
    assert "output 'u' reaches 1.7: the material yields" in said
    assert not list(utilisation.beyond_yield(outputs, {"u": np.array([0.5]), "x": columns["x"]}))
