"""`fmbs check` and `fmbs schema`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fmbs_skfem.scenes import json_schema

from .calls import EXAMPLES, fmbs, scene

STATIC = "{type: static, load_steps: 4}"


@pytest.mark.parametrize(
    ("name", "dofs", "constraints", "multipliers"),
    [("spin_up", 404, 3, 1), ("double_pendulum", 1212, 6, 0), ("four_bar", 232, 9, 1), ("hanging_mass", 249, 9, 3)],
)
def test_examples_are_sound(name: str, dofs: int, constraints: int, multipliers: int) -> None:
    done = fmbs("check", EXAMPLES / f"{name}.yaml", "--json")
    assert done.code == 0
    found = done.json
    assert (found["dofs"], found["constraints"], found["multipliers"]) == (dofs, constraints, multipliers)
    assert found["unknowns"] == dofs - (constraints - multipliers)
    assert found["redundant_constraints"] == 0
    assert found["notices"] == []


def test_masses_are_those_of_solid_cylinders() -> None:
    """rho pi d^2 L / 4 = 1800 * pi * 1e-4 / 4 kg for a beam of 1 m."""
    found = fmbs("check", EXAMPLES / "double_pendulum.yaml", "--json").json
    expected = 1800 * 3.141592653589793e-4 / 4
    assert [part["mass"] for part in found["bodies"]] == pytest.approx([expected, expected], rel=1e-10)
    assert found["estimates"]["steps"] == 6000


def test_a_table_names_bodies_and_joints() -> None:
    done = fmbs("check", EXAMPLES / "spin_up.yaml")
    assert done.code == 0
    assert all(word in done.out for word in ("beam", "hinge", "drive", "404", "mass [kg]"))


def test_redundant_rows_are_counted_and_named(tmp_path: Path) -> None:
    path = scene(tmp_path, STATIC)
    path.write_text(path.read_text().replace("joints:\n", "joints:\n  second: {type: pin, at: beam.left, to: ground}\n"))
    done = fmbs("check", path, "--json")
    assert done.code == 0
    assert done.json["redundant_constraints"] == 2
    assert "redundant constraint rows" in done.err
    assert fmbs("check", path, "--strict").code == 3


def test_contradicting_joints_stop_the_check_by_name(tmp_path: Path) -> None:
    path = scene(tmp_path, STATIC)
    path.write_text(path.read_text().replace("joints:\n", "joints:\n  second: {type: pin, at: beam.left, to: [0.1, 0]}\n"))
    done = fmbs("check", path, "--json")
    assert done.code == 4
    assert "second.x" in done.json["message"] or "clamp.x" in done.json["message"]


def test_a_misspelt_key_is_bad_input_with_a_hint(tmp_path: Path) -> None:
    path = scene(tmp_path, STATIC)
    path.write_text(path.read_text().replace("analysis:", "analisys:"))
    done = fmbs("check", path)
    assert done.code == 3
    assert "did you mean 'analysis'?" in done.err


def test_a_mesh_outside_the_project_needs_permission(tmp_path: Path) -> None:
    folder = tmp_path / "project" / "scenes"
    folder.mkdir(parents=True)
    path = scene(folder, STATIC)
    (folder / "beam_20.msh").rename(tmp_path / "beam_20.msh")
    path.write_text(path.read_text().replace("beam_20.msh", "../../beam_20.msh"))
    assert fmbs("check", path).code == 3
    assert fmbs("check", path, "--allow-outside").code == 0


def test_check_writes_only_into_out(tmp_path: Path) -> None:
    path = scene(tmp_path, STATIC)
    before = sorted(tmp_path.iterdir())
    assert fmbs("check", path).code == 0
    assert sorted(tmp_path.iterdir()) == before
    out = tmp_path / "out"
    assert fmbs("check", path, "--out", out).code == 0
    assert json.loads((out / "check.json").read_text())["dofs"] == 84


def test_schema_is_that_of_the_scenes(tmp_path: Path) -> None:
    expected = json.loads(json.dumps(json_schema()))
    assert fmbs("schema").json == expected
    assert fmbs("schema", "--json", "--out", tmp_path).json == expected
    assert json.loads((tmp_path / "scene.schema.json").read_text()) == expected
    assert fmbs("schema", "--out", tmp_path).code == 3
