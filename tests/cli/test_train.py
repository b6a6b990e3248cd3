"""`fmbs train`: a beam of ten cells spun up for a fifth of a second, trained over Young's modulus, and checked at full runs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmbs_skfem import dynamics, reduction, scenes
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton
from fmbs_skfem.reduction import prediction, product
from fmbs_skfem.scenes import build

from .calls import ROOT, Call, fmbs

BEAM = """\
schema: 1
name: beam
dimension: 2
parameters:
  E: {{value: 1 GPa, range: [0.5 GPa, 1.5 GPa]}}
  spin: 3
bodies:
  beam:
    type: cable
    mesh: beam_10.msh
    line: beam
    section: {{shape: circular, diameter: 10 mm}}
    material: {{young_modulus: E, density: 1800 kg/m^3}}
joints:
  hinge: {{type: pin, at: beam.left, to: ground}}
  drive: {{type: driven_angle, at: beam.left, angle: spin * t**2}}
analysis: {{type: dynamic, duration: 0.2 s, step: 1 ms}}
outputs:
  tip: {{type: position, at: beam.right}}
{rest}
"""
REDUCTION = "reduction: {snapshots: 5 ms, tolerance: 1e-12, hyper_reduction: {tolerance: 1e-3, sample: points}}\n"
TRAINING = "training: {candidates: 21, samples: 3, iterations: 3, max_samples: 6, holdout: 5}"


def written(folder: Path, rest: str = REDUCTION + TRAINING) -> Path:
    """The scene with its mesh beside it."""
    (folder / "beam_10.msh").write_bytes((ROOT / "meshes" / "beam_10.msh").read_bytes())
    path = folder / "beam.yaml"
    path.write_text(BEAM.format(rest=rest))
    return path


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("train"))


@pytest.fixture(scope="module")
def call(scene: Path) -> Call:
    return fmbs("train", scene, "--compare", "--out", scene.parent / "out", "--json")


def test_runs_and_choices_are_told(call: Call, scene: Path) -> None:
    assert call.code == 0, call.err
    found = call.json
    assert found["parameters"]["E"] == {"low": 0.5e9, "high": 1.5e9, "scale": "linear", "unit": "Pa", "nominal": 1e9}
    assert 1 <= found["full_runs"] <= 3
    assert found["points"][0] == {"E": 1e9}
    assert found["hyper_reductions"] == found["full_runs"] == len(found["iterations"])
    assert found["reduced_runs"] == sum(iteration["samples"] for iteration in found["iterations"])
    assert all(3 <= iteration["samples"] <= 6 for iteration in found["iterations"])
    assert (found["eps"], found["eta"], found["level"]) == (1e-12, 1e-3, "points")
    assert found["predicted_error"]["low"] < found["predicted_error"]["error"] < found["predicted_error"]["high"]
    files = {Path(name).name for name in found["files"]}
    assert files == {"model.h5", "report.json", "surrogate.png", "errors.png", "predicted.png"}
    assert all(Path(name).stat().st_size > 0 for name in found["files"])
    assert json.loads((scene.parent / "out" / "report.json").read_text())["points"] == found["points"]


def test_a_true_error_is_the_error_against_the_full_scene(call: Call, scene: Path) -> None:
    """Equation (48) at the stiffest hold-out point, from a full run of the scene with this number and a run of the saved model."""
    held = call.json["holdout"]
    point = held["points"][-1][0]
    assert point == 1.5e9
    full = scenes.read(scene, {"E": point})
    sharp = Newton(tolerance=1e-12)
    truth = dynamics.integrate(build.system(full), GeneralizedAlpha(1e-3, 0.8), 0.2, sharp, 5)
    rom = product.load(scene.parent / "out" / "model.h5")
    motion = product.run(rom, 5, E=point)
    assert reduction.compare(truth, motion).mean == pytest.approx(held["true"][-1], rel=0.02)


def test_a_full_run_more_is_better_and_comparators_stand_beside(call: Call) -> None:
    """The far ends of the range are worse than 1e-4 after one run in the middle, and better with more runs."""
    rows = {row["name"]: row for row in call.json["holdout"]["rows"]}
    ours = [rows[f"greedy {k}"] for k in range(1, call.json["full_runs"] + 1)]
    assert [row["full_runs"] for row in ours] == list(range(1, len(ours) + 1))
    assert ours[-1]["max_error"] == call.json["holdout"]["max_error"] < 1e-4
    assert len(ours) == 1 or ours[-1]["max_error"] < ours[0]["max_error"]
    assert set(rows) - {row["name"] for row in ours} == {
        "fast to slow", "uniform grid 2", "nearest basis 2", "Grassmann 2", "greedy, system level",
    }  # fmt: skip
    assert rows["fast to slow"]["full_runs"] == 1
    assert rows["nearest basis 2"]["max_error"] > ours[-1]["max_error"]
    assert all(len(row["errors"]) == 5 for row in rows.values())


def test_predictions_are_those_of_the_saved_model(call: Call, scene: Path) -> None:
    rom, held = product.load(scene.parent / "out" / "model.h5"), call.json["holdout"]
    for (point,), told in zip(held["points"], held["predicted"], strict=True):
        found = prediction.predicted_error(rom, E=point)
        assert found is not None
        assert (found.error, found.low, found.high) == pytest.approx((told["error"], told["low"], told["high"]), rel=1e-12)
    inside = [p["low"] <= e <= p["high"] for p, e in zip(held["predicted"], held["true"], strict=True)]
    assert held["inside"] == np.mean(inside) >= 0.8
    outside = prediction.predicted_error(rom, E=2e9)
    assert outside is not None
    assert np.isnan([outside.error, outside.low, outside.high]).all()


def test_the_model_notes_its_training(call: Call, scene: Path) -> None:
    notes = product.load(scene.parent / "out" / "model.h5").notes
    assert notes["scene"] == "beam"
    assert set(notes["hashes"]) == {"beam.yaml", "beam_10.msh"}
    assert notes["fixed"] == {"spin": 3.0}
    assert notes["training"]["full_runs"] == call.json["full_runs"]


def test_the_same_call_computes_nothing_twice(call: Call, scene: Path) -> None:
    out = scene.parent / "out"
    before = {path: path.stat().st_mtime_ns for path in (out / "training").iterdir()}
    (out / "model.h5").unlink()
    again = fmbs("train", scene, "--resume", "--no-plots", "--out", out, "--json")
    assert again.code == 0, again.err
    assert {path: path.stat().st_mtime_ns for path in (out / "training").iterdir()} == before
    same = ("points", "reduced_runs", "largest_indicator", "predicted_error", "modes")
    assert {key: again.json[key] for key in same} == {key: call.json[key] for key in same}
    assert again.json["holdout"]["true"] == call.json["holdout"]["true"]


def test_the_training_of_another_scene_is_kept(call: Call, scene: Path, tmp_path: Path) -> None:
    other = written(tmp_path)
    other.write_text(other.read_text().replace("10 mm", "12 mm"))
    report = (scene.parent / "out" / "report.json").read_bytes()
    done = fmbs("train", other, "--out", scene.parent / "out")
    assert done.code == 3
    assert "--force" in done.err
    assert (scene.parent / "out" / "report.json").read_bytes() == report


def test_a_wanted_error_chooses_eps_and_eta_and_is_met(scene: Path, tmp_path: Path) -> None:
    done = fmbs("train", scene, "--tolerance", "1e-3", "--holdout", "3", "--no-plots", "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    found = done.json
    assert found["budget"]["tolerance"] == found["tolerance"] == 1e-3
    assert (found["budget"]["eps"], found["budget"]["eta"]) == (found["eps"], found["eta"]) != (1e-12, 1e-3)
    assert "time step" in found["budget"]["statement"]
    assert found["holdout"]["max_error"] < 1e-3


@pytest.mark.parametrize(
    ("rest", "options", "told"),
    [
        (REDUCTION, ("--compare",), "--compare: expected hold-out points, got none; give --holdout N"),
        (REDUCTION + TRAINING, ("--tolerance", "2"), "--tolerance: expected a relative error between 0 and 1, got 2.0"),
        (REDUCTION + TRAINING, ("--resume",), "--resume: expected a training in '"),
        (TRAINING, (), "training: expected a section 'reduction' and a dynamic analysis"),
        ("", (), "expected a dynamic analysis and a section 'reduction', got none"),
    ],
)
def test_refused(rest: str, options: tuple[Any, ...], told: str, tmp_path: Path) -> None:
    done = fmbs("train", written(tmp_path, rest), *options, "--out", tmp_path / "out")
    assert done.code == 3
    assert told in done.err
    assert not (tmp_path / "out" / "training").exists()


def test_a_scene_without_ranges_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, REDUCTION)
    path.write_text(path.read_text().replace("{value: 1 GPa, range: [0.5 GPa, 1.5 GPa]}", "1 GPa"))
    done = fmbs("train", path, "--out", tmp_path / "out")
    assert done.code == 3
    assert "parameters: expected parameters with ranges, got none; give one a range" in done.err


def test_a_model_that_is_no_polynomial_of_its_parameters_has_no_file(tmp_path: Path) -> None:
    """The beam lies at an angle that is a parameter: every value assembles its own system, hold-out points are checked as ever."""
    path = written(tmp_path)
    text = path.read_text().replace("{value: 1 GPa, range: [0.5 GPa, 1.5 GPa]}", "1 GPa")
    text = text.replace("  spin: 3\n", "  spin: 3\n  phi: {value: 60 deg, range: [0 deg, 170 deg]}\n")
    path.write_text(text.replace("    line: beam\n", "    line: beam\n    rotation: phi\n"))
    done = fmbs("train", path, "--iterations", "1", "--no-plots", "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    assert "no polynomial of its parameters" in done.err
    assert not (tmp_path / "out" / "model.h5").exists()
    assert [Path(name).name for name in done.json["files"]] == ["report.json"]
    assert np.isfinite(done.json["holdout"]["true"]).all()
    assert done.json["holdout"]["predicted"] == []
