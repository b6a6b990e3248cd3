"""The Python scripts of `examples` give the numbers of the scene files, and the scenes of plates those of the literature."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import pytest

from fmbs_skfem import scenes
from fmbs_skfem.scenes import build

from .calls import EXAMPLES, fmbs


def script(name: str) -> Callable[..., dict[str, float]]:
    """The function `main` of a script."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found: Callable[..., dict[str, float]] = module.main
    return found


def test_spin_up_is_its_scene(tmp_path: Path) -> None:
    found = script("spin_up")(duration=0.1)
    other = fmbs("run", EXAMPLES / "spin_up.yaml", "--json", "--out", tmp_path / "out", "--duration", "0.1", "--no-plots").json
    assert (found["dofs"], found["constraints"]) == (other["dofs"], other["constraints"]) == (404, 3)
    assert found["final_deflection"] == pytest.approx(other["outputs"]["tip_deflection"]["final"], abs=1e-9)
    assert found["final_deflection"] < -1e-6


def test_double_pendulum_is_its_scene_and_its_reduced_model_follows(tmp_path: Path) -> None:
    found = script("double_pendulum")(duration=0.2)
    other = fmbs(
        "run", EXAMPLES / "double_pendulum.yaml", "--json", "--out", tmp_path / "out", "--duration", "0.2", "--no-plots"
    ).json
    assert found["dofs"] == other["dofs"] == 1212
    assert [found[f"C_{axis}"] for axis in "xyz"] == pytest.approx(
        [other["outputs"][f"C_{axis}"]["final"] for axis in "xyz"], abs=1e-6
    )
    assert found["modes"] < 60
    assert found["max_error"] < 1e-4


def test_plate_bends_as_published(tmp_path: Path) -> None:
    """Sze, Liu, Lo 2004, doi 10.1016/j.finel.2003.11.001, section 3.1, without shear strains: W = 6.6999, -U = 3.2895 at P = 4."""
    found = fmbs("run", EXAMPLES / "plate.yaml", "--json", "--out", tmp_path / "out", "--no-plots").json
    assert found["outputs"]["W"]["final"] == pytest.approx(6.6999, abs=3e-4)
    assert 10.0 - found["outputs"]["x"]["final"] == pytest.approx(3.2895, abs=3e-4)


def test_an_arm_under_lqr_comes_to_rest() -> None:
    """As the linear loop predicts with four modes, within 1 %; from 1 rad/s, with an amplitude above 5 % of the length."""
    found = script("lqr_arm")(duration=1.2)
    assert found["most"] > 0.05
    assert abs(found["end"]) < 0.02 * found["most"]
    assert found["error"] < 1e-2


def test_roof_sinks_as_published(tmp_path: Path) -> None:
    """Scordelis, Lo 1964 by thin-shell theory: 0.3006 m under the whole load, to 0.5 per mille."""
    found = fmbs("run", EXAMPLES / "roof.yaml", "--json", "--out", tmp_path / "out", "--no-plots").json
    edge = found["outputs"]["edge"]
    assert 1e4 * (edge["max"] - edge["final"]) == pytest.approx(0.3006, rel=5e-4)


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_scene_is_sound(path: Path) -> None:
    """Its system is built, in the form in which it is solved."""
    scene = scenes.read(path)
    system = build.chosen_form(scene, build.system(scene))
    assert system.size > 0
    assert bool([column for output in system.outputs.values() for column in output.columns]) == scene.analysis.has_outputs


def test_a_controlled_arm_reduced(tmp_path: Path) -> None:
    """Reduced and hyper-reduced arms follow the full one to 1e-3 of the stroke; all of them reach their goal."""
    run = fmbs("run", EXAMPLES / "controlled_arm.yaml", "--json", "--out", tmp_path / "run", "--no-plots").json
    assert run["outputs"]["hinge"]["final"] == pytest.approx(0.9, abs=2e-3)
    done = fmbs("compare", EXAMPLES / "controlled_arm.yaml", "--json", "--out", tmp_path / "out").json
    assert len(done["models"]) > 2
    for model in done["models"]:
        assert model["status"] == "done"
        for name in ("hinge", "tip_x", "tip_y", "drive_angle"):
            assert model["outputs"][name]["relative"] <= 1e-3
