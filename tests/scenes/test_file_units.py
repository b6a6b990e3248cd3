"""Meshes in millimetres, and resultants of held edges: force and moment in place of a row a node."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics, scenes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.results import motion
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes import meshes, plate_meshes
from fmbs_skfem.systems import System
from fmbs_skfem.systems.measures import probes

ROOT = Path(__file__).parents[2]
PLATE = (ROOT / "examples" / "plate.yaml").read_text().replace("load_steps: 10", "load_steps: 4")


def assembled(text: str, folder: Path) -> System:
    scene = scenes.loads(text, folder)
    return build.chosen_form(scene, build.system(scene))


@pytest.mark.parametrize("unit", ["mm", "1 mm", "1e-3"])
def test_a_mesh_in_millimetres_is_one_in_metres(unit: str, tmp_path: Path) -> None:
    (tmp_path / "scenes").mkdir()
    line = meshes.read(ROOT / "meshes" / "beam_5.msh")
    meshes.write(replace(line, points=1e3 * line.points), tmp_path / "beam_5.msh")
    flat = plate_meshes.read(ROOT / "meshes" / "plate_16x1.msh", True)
    plate_meshes.write(replace(flat, points=1e3 * flat.points), tmp_path / "plate_16x1.msh")
    beam = (
        "{type: cable, mesh: ../beam_5.msh, UNIT, section: {shape: given, EA: 1, EI: 1, rhoA: 2}}"
    )
    text = f"schema: 1\ndimension: 3\nbodies: {{beam: {beam}}}\nanalysis: {{type: static}}\n"
    system = assembled(text.replace("UNIT", f"unit: {unit}"), tmp_path / "scenes")
    assert system.weight == pytest.approx(2.0)
    made = "thickness: 0.1, material: {young_modulus: 1e9, density: 10, poisson_ratio: 0}"
    plate = f"{{type: plate, mesh: ../plate_16x1.msh, UNIT, {made}}}"
    text = text.replace(beam, plate)
    assert assembled(
        text.replace("UNIT", f"unit: {unit}"), tmp_path / "scenes"
    ).weight == pytest.approx(10.0)


def test_a_unit_is_a_length() -> None:
    text = "schema: 1\nbodies: {b: {type: cable, mesh: x.msh, unit: kg, section: {shape: given, EA: 1, EI: 1, rhoA: 2}}}\n"
    with pytest.raises(InputError, match=r"bodies\.b\.unit: expected a length"):
        scenes.loads(text)


def test_the_reaction_of_a_clamped_edge_balances_its_load() -> None:
    """4 N upwards at the free end of a plate that is bent far: its force, and 4 N times where the
    end is now.
    """
    system = assembled(PLATE + "  R: {type: reaction, joint: clamp}\n", ROOT / "examples")
    found = {
        name: values[-1]
        for name, values in dynamics.outputs(dynamics.solve_statics(system, 4)).items()
    }
    names = ["R_x", "R_y", "R_z", "R_mx", "R_my", "R_mz"]
    assert [name for name in found if name.startswith("R_")] == names
    assert 6.0 < found["x"] < 7.0
    np.testing.assert_allclose(
        [found[name] for name in names], [0.0, 0.0, -4.0, 0.0, 4.0 * found["x"], 0.0], atol=1e-7
    )
    marks = motion.joints(system, system.x0[None])
    assert {mark.kind for mark in marks.values()} == {"held edge"}
    # where the plate is clamped
    np.testing.assert_allclose([mark.points[0, 0] for mark in marks.values()], 0.0, atol=1e-12)
    assert probes.column_labels(system.outputs)["R_my"] == "moment about y at (0, 0.5, 0)"
    assert [probes.column_units(system.outputs)[name] for name in names] == ["N"] * 3 + ["N m"] * 3


def test_a_membrane_far_from_the_origin_has_the_same_moment() -> None:
    text = (
        PLATE[: PLATE.index("outputs:")]
        .replace("dimension: 3", "dimension: 2")
        .replace("bfs", "ancf")
    )
    text = text.replace(
        "{type: edge, body: plate, edges: left, slope: z}", "{type: edge, body: plate, edges: left}"
    )
    text = text.replace("force: [0, 0, P / width]", "force: [0, P / width]").replace(
        "thickness: 0.1 m", "thickness: 0.1 m\n    ORIGIN"
    )
    text += "outputs: {R: {type: reaction, joint: clamp}, x: {type: position, at: plate.b}}"
    moments = []
    for first, second in ((0.0, 0.0), (2e3, -1e3)):
        system = assembled(
            text.replace("ORIGIN", f"origin: [{first}, {second}]"), ROOT / "examples"
        )
        found = {
            name: values[-1]
            for name, values in dynamics.outputs(dynamics.solve_statics(system, 2)).items()
        }
        assert list(found)[:3] == ["R_x", "R_y", "R_mz"]
        np.testing.assert_allclose([found["R_x"], found["R_y"]], [0.0, -4.0], atol=1e-6)
        assert found["R_mz"] == pytest.approx(
            -4.0 * (found["x_x"] - first), rel=2e-3
        )  # the end turns a little about its middle
        moments.append(found["R_mz"])
    assert moments[1] == pytest.approx(moments[0], abs=1e-6)
