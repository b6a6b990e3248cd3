"""`fmbs train`: a beam of ten cells spun up for a fifth of a second, trained over Young's modulus,
and checked at full runs.
"""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmbs_skfem import dynamics, reduction, scenes
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton
from fmbs_skfem.families import parametric_model, prediction
from fmbs_skfem.families import training_store as store
from fmbs_skfem.reduction import full_runs
from fmbs_skfem.reduction.accuracy import output_errors
from fmbs_skfem.scenes import build
from fmbs_skfem.studies import greedy_training as training
from fmbs_skfem.studies.job import Job

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
#: a column that is pushed; far above its buckling load 1.98 N Newton's iteration ends
COLUMN = """\
schema: 1
name: column
dimension: 2
parameters:
  P: {value: 1.786, range: [0.5953, 3.9688]}
bodies:
  column:
    type: cable
    mesh: beam_10.msh
    line: beam
    section: {shape: circular, diameter: 8 mm}
    material: {young_modulus: 1 GPa, density: 1500}
joints:
  hinge: {type: pin, at: column.left}
  guide: {type: slider, at: column.right, direction: [1, 0]}
loads:
  push:
    type: point_force
    at: column.right
    force: [-P, 0]
    history: "min(t/0.5, 1) + 0 * sqrt(where(t < 1.2, 1, (P - 3.9)**2 - 1e-4))"
  weight: {type: gravity, acceleration: [0, 0.01]}
damping: {mass: 4 1/s}
analysis: {type: dynamic, duration: 2.0, step: 4 ms}
outputs:
  end: {type: position, at: column.right}
reduction: {snapshots: 20 ms}
training: {candidates: 9, samples: 3, iterations: 1, holdout: [1.0, 3.9]}
"""
REDUCTION = "reduction: {snapshots: 5 ms, tolerance: 1e-12, hyper_reduction: {tolerance: 1e-3, sample: points}}\n"
TRAINING = "training: {candidates: 21, samples: 3, iterations: 3, max_samples: 6, holdout: 5}"


def written(folder: Path, rest: str = REDUCTION + TRAINING) -> Path:
    """The scene with its mesh beside it."""
    return kept(folder / "beam.yaml", BEAM.format(rest=rest))


def kept(path: Path, text: str) -> Path:
    """A scene as a file, with its mesh beside it."""
    (path.parent / "beam_10.msh").write_bytes((ROOT / "meshes" / "beam_10.msh").read_bytes())
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("train"))


@pytest.fixture(scope="module")
def call(scene: Path) -> Call:
    return fmbs("train", scene, "--out", scene.parent / "out", "--json")


def test_runs_and_choices_are_told(call: Call, scene: Path) -> None:
    assert call.code == 0, call.err
    found = call.json
    assert found["parameters"]["E"] == {
        "low": 0.5e9,
        "high": 1.5e9,
        "scale": "linear",
        "unit": "Pa",
        "nominal": 1e9,
    }
    assert 1 <= found["full_runs"] <= 3
    assert found["points"][0] == {"E": 1e9}
    assert found["hyper_reductions"] == found["full_runs"] == len(found["iterations"])
    assert found["reduced_runs"] == sum(iteration["samples"] for iteration in found["iterations"])
    assert all(3 <= iteration["samples"] <= 6 for iteration in found["iterations"])
    assert (found["eps"], found["eta"], found["level"]) == (1e-12, 1e-3, "points")
    assert (
        found["predicted_error"]["low"]
        < found["predicted_error"]["error"]
        < found["predicted_error"]["high"]
    )
    files = {Path(name).name for name in found["files"]}
    assert files == {"model.h5", "report.json", "surrogate.png", "errors.png", "predicted.png"}
    assert all(Path(name).stat().st_size > 0 for name in found["files"])
    assert (
        json.loads((scene.parent / "out" / "report.json").read_text())["points"] == found["points"]
    )


def test_a_true_error_is_the_error_against_the_full_scene(call: Call, scene: Path) -> None:
    """Errors of outputs and displacements at the stiffest hold-out point, from runs of the scene
    and of the saved model.
    """
    held = call.json["holdout"]
    point = held["points"][-1][0]
    assert point == 1.5e9
    full = scenes.read(scene, {"E": point})
    sharp = Newton(tolerance=1e-12)
    truth = dynamics.integrate(build.system(full), GeneralizedAlpha(1e-3, 0.8), 0.2, sharp, 5)
    rom = parametric_model.load(scene.parent / "out" / "model.h5")
    motion = parametric_model.run(rom, 5, E=point)
    assert output_errors.measure(output_errors.compare(truth, motion)) == pytest.approx(
        held["true"][-1], rel=0.02
    )
    assert reduction.compare(truth, motion).mean == pytest.approx(held["states"][-1], rel=0.02)
    assert held["true"][-1] > held["states"][-1]


def test_errors_of_outputs_are_those_of_runs_of_the_scene(call: Call, scene: Path) -> None:
    """At the stiffest hold-out point, the outputs of a full run of the scene beside those of a run
    of the saved model.
    """
    held = call.json["holdout"]
    truth = dynamics.integrate(
        build.system(scenes.read(scene, {"E": 1.5e9})),
        GeneralizedAlpha(1e-3, 0.8),
        0.2,
        Newton(1e-12),
        5,
    )
    found = output_errors.compare(
        truth,
        parametric_model.run(parametric_model.load(scene.parent / "out" / "model.h5"), 5, E=1.5e9),
    )
    assert set(held["outputs_at_points"][-1]) == set(found) == {"tip_x", "tip_y"}
    for name, one in found.items():
        assert held["outputs_at_points"][-1][name] == pytest.approx(one.relative, rel=0.05)
        assert held["outputs"][name]["unit"] == "m"
        assert held["outputs"][name]["relative"] == max(
            point[name] for point in held["outputs_at_points"]
        )


def test_a_full_run_more_is_better(call: Call) -> None:
    """The ends of the range are bad after one run in the middle, and better with more; x moves by 7
    mm beside 0.12 m of y.
    """
    rows = {row["name"]: row for row in call.json["holdout"]["rows"]}
    ours = [rows[f"greedy {k}"] for k in range(1, call.json["full_runs"] + 1)]
    assert [row["full_runs"] for row in ours] == list(range(1, len(ours) + 1))
    assert ours[-1]["max_error"] == call.json["holdout"]["max_error"] < 0.02
    assert max(call.json["holdout"]["states"]) < 1e-2  # of the motion
    assert len(ours) == 1 or ours[-1]["max_error"] < ours[0]["max_error"]
    assert len(ours) == len(rows)
    assert all(len(row["errors"]) == 5 for row in rows.values())


def test_predictions_are_those_of_the_saved_model(call: Call, scene: Path) -> None:
    rom, held = parametric_model.load(scene.parent / "out" / "model.h5"), call.json["holdout"]
    for (point,), told in zip(held["points"], held["predicted"], strict=True):
        found = prediction.predicted_error(rom, E=point)
        assert found is not None
        assert (found.error, found.low, found.high) == pytest.approx(
            (told["error"], told["low"], told["high"]), rel=1e-12
        )
    inside = [
        p["low"] <= e <= p["high"] for p, e in zip(held["predicted"], held["true"], strict=True)
    ]
    assert held["inside"] == np.mean(inside) >= 0.8
    outside = prediction.predicted_error(rom, E=2e9)
    assert outside is not None
    assert np.isnan([outside.error, outside.low, outside.high]).all()


def test_the_model_notes_its_training(call: Call, scene: Path) -> None:
    notes = parametric_model.load(scene.parent / "out" / "model.h5").notes
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
    done = fmbs(
        "train",
        scene,
        "--tolerance",
        "1e-3",
        "--holdout",
        "3",
        "--no-plots",
        "--out",
        tmp_path / "out",
        "--json",
    )
    assert done.code == 0, done.err
    found = done.json
    assert found["budget"]["tolerance"] == found["tolerance"] == 1e-3
    assert (
        (found["budget"]["eps"], found["budget"]["eta"])
        == (found["eps"], found["eta"])
        != (1e-12, 1e-3)
    )
    assert "time step" in found["budget"]["statement"]
    assert found["holdout"]["max_error"] < 1e-3


@pytest.mark.parametrize(
    ("rest", "options", "told"),
    [
        (
            REDUCTION + TRAINING,
            ("--tolerance", "2"),
            "--tolerance: expected an error between 0 and 1, a part of the ranges of the outputs, got 2.0",
        ),
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
    assert (
        "parameters: expected parameters with ranges to train over, got none; give one a range"
        in done.err
    )


def with_angle(folder: Path, modulus: str = "E") -> Path:
    """The scene with the angle at which the beam lies as its parameter; Young's modulus may depend
    on it.
    """
    path = written(folder)
    text = path.read_text().replace("{value: 1 GPa, range: [0.5 GPa, 1.5 GPa]}", "1 GPa")
    text = text.replace("young_modulus: E", f"young_modulus: {modulus}")
    text = text.replace(
        "  spin: 3\n", "  spin: 3\n  phi: {value: 60 deg, range: [0 deg, 170 deg]}\n"
    )
    path.write_text(text.replace("    line: beam\n", "    line: beam\n    rotation: phi\n"))
    return path


def test_a_parameter_that_moves_geometry_makes_a_model(tmp_path: Path) -> None:
    """The beam lies at an angle that is a parameter: its places are polynomials of it to the
    round-off of a rotation.
    """
    path = with_angle(tmp_path)
    done = fmbs(
        "train", path, "--iterations", "2", "--no-plots", "--out", tmp_path / "out", "--json"
    )
    assert done.code == 0, done.err
    rom = parametric_model.load(tmp_path / "out" / "model.h5")
    assert parametric_model.summary(rom)["parameters"]["phi"]["degree"] > 4
    columns = dynamics.outputs(parametric_model.run(rom, 5, phi=1.1))
    assert [columns["tip_x"][0], columns["tip_y"][0]] == pytest.approx(
        [np.cos(1.1), np.sin(1.1)], abs=1e-11
    )
    assert np.isfinite(done.json["holdout"]["true"]).all()
    assert len(done.json["holdout"]["predicted"]) == 5


def test_a_model_that_is_no_polynomial_of_its_parameters_ends_the_training(tmp_path: Path) -> None:
    """Young's modulus has a kink in the range of the angle."""
    path = with_angle(tmp_path, "E*(1 + 0.1*abs(phi - 1))")
    out = tmp_path / "out"
    for _ in range(2):
        done = fmbs("train", path, "--no-plots", "--out", out, "--json")
        assert done.code == 4, done.err
        assert (done.json["status"], done.json["reason"]) == ("error", "no reduced model")
        assert (
            "parameter 'phi': expected numbers that are polynomials of it of degree 24 or less"
            in done.json["message"]
        )
        assert not (out / "model.h5").exists()
        assert json.loads((out / "report.json").read_text())["message"] == done.json["message"]
        assert len(list((out / "training").glob("run-*.h5"))) == 1


def test_a_holdout_point_without_a_motion_is_marked_and_the_training_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = kept(tmp_path / "column.yaml", COLUMN)
    call = fmbs("train", path, "--out", tmp_path / "out", "--json")
    assert call.code == 0, call.err
    held = call.json["holdout"]
    assert [one["point"] for one in held["failed"]] == [{"P": 3.9}]
    assert re.search(
        r"load 'push' at t = 1\.2.* s: expected a finite value", held["failed"][0]["reason"]
    )
    assert held["true"] == [held["max_error"], None]
    assert 0.0 < held["max_error"] < 1e-3
    assert held["rows"][0]["errors"] == held["true"]
    assert {Path(name).name for name in call.json["files"]} >= {
        "report.json",
        "errors.png",
        "predicted.png",
    }
    assert any(
        "the full model has no motion at P = 3.9, the point is left out" in text
        for text in call.json["notices"]
    )
    monkeypatch.setattr(
        full_runs, "full_run", lambda *arguments: pytest.fail("a run that is known was made again")
    )
    again = fmbs("train", path, "--no-plots", "--out", tmp_path / "out")
    assert again.code == 0, again.err
    assert re.search(
        r"The full model has no motion at P = 3\.9 \(.*: load 'push' at t = 1\.2", again.out
    )
    assert "Error of the outputs over their ranges at 1 of 2 hold-out points" in again.out
    assert call.json["status"] == "no promise"
    assert "the full model has no motion at 1 of 2 hold-out points" in call.json["doubts"]
    doubts = "; ".join(call.json["doubts"])
    assert f"This error estimate is not reliable: {doubts}; check with full runs" in again.out
    run = fmbs("rom", "run", tmp_path / "out" / "model.h5", "--no-plots", "--out", tmp_path / "run")
    assert f"This error estimate is not reliable: {doubts}; check with full runs" in run.out
    assert "Errors of the outputs" in again.out
    assert "end_x [µm]" in again.out


def test_a_training_stopped_before_its_report_goes_on(
    call: Call, scene: Path, tmp_path: Path
) -> None:
    """As it is left where the process is killed between model.h5 and report.json."""
    out = tmp_path / "out"
    shutil.copytree(scene.parent / "out", out)
    (out / "report.json").unlink()
    other = written(tmp_path)
    other.write_text(other.read_text().replace("10 mm", "12 mm"))
    refused = fmbs("train", other, "--out", out)
    assert refused.code == 3
    assert "expected a folder of this training, got one of another training" in refused.err
    again = fmbs("train", scene, "--no-plots", "--out", out, "--json")
    assert again.code == 0, again.err
    assert again.json["points"] == call.json["points"]
    assert (out / "report.json").is_file()


def test_a_training_that_was_stopped_knows_the_code_that_it_has_run(tmp_path: Path) -> None:
    """Laws of files that a scene names stand in a system by their names; another file of that name
    is another training.
    """
    codes = []
    for number, code in enumerate(("FACTOR = 1", "FACTOR = 2", "FACTOR = 2")):
        (place := tmp_path / f"{number}").mkdir()
        (place / "own.py").write_text(code)
        path = written(place)
        path.write_text(path.read_text().replace("bodies:", "extensions: [own.py]\nbodies:", 1))
        order = training.prepare(Job(path), scenes.read(path), None, None, None)
        codes.append(store.fingerprint(order.task))
    assert codes[0] != codes[1] == codes[2]


def test_a_tolerance_of_an_output_is_met_in_its_unit(scene: Path, tmp_path: Path) -> None:
    path = written(
        tmp_path,
        REDUCTION + TRAINING.replace("holdout: 5}", "holdout: 3, tolerance: {tip: 0.05 mm}}"),
    )
    done = fmbs("train", path, "--no-plots", "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    found = done.json
    assert (found["tolerance"], found["measure"]) == (
        {"tip": 5e-5},
        "error of the outputs over their tolerances",
    )
    assert max(one["error"] for one in found["holdout"]["outputs"].values()) < 5e-5
    largest = max(one["error"] for one in found["holdout"]["outputs"].values())
    assert found["holdout"]["max_error"] == pytest.approx(largest / 5e-5, rel=1e-9)


@pytest.mark.parametrize(
    ("tolerance", "told"),
    [
        (
            "{tipp: 1 mm}",
            "training.tolerance.tipp: expected one of the outputs tip, got the output 'tipp'; did you mean 'tip'?",
        ),
        ("{tip: 1 N}", "training.tolerance.tip: expected an error in m, got one in N"),
        ("{tip: 0}", "expected a largest error of tip above 0, got 0"),
        (
            "2",
            "expected a part of the ranges of the outputs below 1, or errors of outputs by name, got 2",
        ),
        ("{}", "expected errors of outputs by name, got none"),
    ],
)
def test_tolerances_that_mean_nothing_are_refused(
    tolerance: str, told: str, tmp_path: Path
) -> None:
    path = written(
        tmp_path, REDUCTION + TRAINING.replace("holdout: 5}", f"tolerance: {tolerance}}}")
    )
    done = fmbs("train", path, "--out", tmp_path / "out")
    assert done.code == 3
    assert told in done.err
