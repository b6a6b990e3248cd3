"""`fmbs rom run --guard`: a reduced model goes on as far as it holds, the full one elsewhere, and the answer keeps its accuracy."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from fmbs_skfem import studies
from fmbs_skfem.dynamics import Trajectory
from fmbs_skfem.reduction import cases, files, guarded

from .calls import fmbs
from .test_rom import TRAINING
from .test_train import REDUCTION, kept, written

SWING = """\
schema: 1
name: swing
dimension: 2
parameters: {g: 9.81 m/s^2}
bodies:
  upper: &arm
    type: cable
    mesh: beam_10.msh
    line: beam
    cells: 12
    section: {shape: circular, diameter: 10 mm}
    material: {young_modulus: 0.1 GPa, density: 1800 kg/m^3}
  lower: {<<: *arm, origin: [1, 0]}
joints:
  hinge: {type: pin, at: upper.left, to: ground}
  elbow: {type: pin, at: upper.right, to: lower.left}
loads:
  weight: {type: gravity, acceleration: [0, -g]}
analysis: {type: dynamic, duration: 0.8 s, step: 1 ms}
outputs:
  tip: {type: position, at: lower.right}
  hinge: {type: reaction, joint: hinge}
  held: {type: position, at: upper.left}
  turn: {type: angle, at: {body: upper, s: 0.5}}
reduction: {snapshots: 4 ms, tolerance: 1e-11, hyper_reduction: {tolerance: 1e-3, sample: points}}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene, and its reduced model beside it."""
    found = tmp_path_factory.mktemp("guard")
    done = fmbs("reduce", kept(found / "swing.yaml", SWING), "--out", found / "swing.h5")
    assert done.code == 0, done.err
    return found


def guarded_run(folder: Path, out: Path, *options: object) -> tuple[dict, np.ndarray, str]:  # type: ignore[type-arg]
    """Report, outputs and text of a guarded run."""
    done = fmbs("rom", "run", folder / "swing.h5", "--guard", folder / "swing.yaml", "--no-plots", "--out", out, *options)
    assert done.code == 0, done.err
    return json.loads((out / "report.json").read_text()), read(out), done.out


def full_run(folder: Path, out: Path, *options: object) -> np.ndarray:
    done = fmbs("run", folder / "swing.yaml", "--no-plots", "--out", out, *options)
    assert done.code == 0, done.err
    return read(out)


def read(out: Path) -> np.ndarray:
    return np.genfromtxt(out / "outputs.csv", delimiter=",", names=True)


def error(found: np.ndarray, full: np.ndarray, column: str) -> float:
    """Largest difference over the range."""
    return float(np.abs(found[column] - full[column]).max() / np.ptp(full[column]))


def steps(report: dict, model: str) -> int:  # type: ignore[type-arg]
    return sum(one["steps"] for one in report["guarded"]["windows"] if one["model"] == model)


def test_half_as_heavy_again(folder: Path, tmp_path: Path) -> None:
    """Both models take turns, states go into the basis, and the outputs are those of the full model within the accuracy."""
    report, found, text = guarded_run(folder, tmp_path / "guarded", "--set", "g=14.7", "--accuracy", "tip=2e-4,held=1e-3")
    full = full_run(folder, tmp_path / "full", "--set", "g=14.7")
    assert steps(report, "reduced") > 100
    assert 0 < steps(report, "full") < 700
    assert steps(report, "reduced") + steps(report, "full") == 800
    assert any(one["taken"] and sum(one["modes"].values()) for one in report["guarded"]["enrichments"])
    np.testing.assert_array_equal(found["t"], full["t"])
    assert max(error(found, full, column) for column in ("tip_x", "tip_y")) < 2e-4
    assert error(found, full, "turn") < 1e-3
    assert report["guarded"]["indicator"] <= report["guarded"]["indicator_allowed"]
    assert "States taken into the basis" in text
    windows = report["guarded"]["windows"]
    assert [one["end"] for one in windows[:-1]] == [one["begin"] for one in windows[1:]]


def test_where_the_model_holds_it_runs_alone(folder: Path, tmp_path: Path) -> None:
    """Over its own training no full step is taken, and without an accuracy the promise is that of the training."""
    report, found, text = guarded_run(folder, tmp_path / "guarded")
    full = full_run(folder, tmp_path / "full")
    assert (steps(report, "reduced"), steps(report, "full"), report["steps"]) == (800, 0, 800)
    assert error(found, full, "tip_y") < 1e-4
    assert "an indicator of at most twice that of its training" in text
    assert "holds for 100% of the motion" in text


def test_where_it_never_holds_the_full_model_runs(folder: Path, tmp_path: Path) -> None:
    """An accuracy far below that of the training: the numbers are those of the full model."""
    report, found, text = guarded_run(folder, tmp_path / "guarded", "--set", "g=14.7", "--accuracy", "tip=1e-9")
    full = full_run(folder, tmp_path / "full", "--set", "g=14.7")
    assert (steps(report, "reduced"), steps(report, "full")) == (0, 800)
    assert max(error(found, full, name) for name in full.dtype.names if name[:4] != "held") < 1e-12
    assert "holds for 0% of the motion" in text


def test_other_materials_and_lengths_of_time(folder: Path, tmp_path: Path) -> None:
    """Whatever the scene changes beside meshes and joints is that of the full model, also beyond the training's end."""
    softer = (folder / "swing.yaml").read_text().replace("0.1 GPa", "0.05 GPa").replace("0.8 s", "1 s")
    kept(tmp_path / "swing.yaml", softer)
    shutil.copy(folder / "swing.h5", tmp_path)
    report, found, _ = guarded_run(tmp_path, tmp_path / "guarded", "--accuracy", "tip=1e-3,held=1 mm")
    full = full_run(tmp_path, tmp_path / "full")
    assert report["steps"] >= 1000
    assert max(error(found, full, column) for column in ("tip_x", "tip_y")) < 1e-3


@pytest.mark.parametrize(
    ("before", "after", "text"),
    [
        ("upper", "above", "expected the bodies of the reduced model (lower, upper), got no upper and also above"),
        ("cells: 12", "cells: 9", "expected the meshes on which the model was trained, got others of upper, lower"),
        ("elbow: {type: pin", "knee: {type: pin", "expected the joints of the reduced model, got a scene without elbow"),
        ("step: 1 ms", "step: 1 ms, every: 1.5 ms", "every: expected multiples of the step 0.001 s in a guarded run"),
        ("type: dynamic, duration: 0.8 s, step: 1 ms", "type: static", "expected a dynamic analysis, got static"),
    ],
)
def test_other_scenes_are_refused(folder: Path, tmp_path: Path, before: str, after: str, text: str) -> None:
    other = SWING.replace(before, after)
    other = other if "dynamic" in other else other.partition("reduction:")[0]
    done = fmbs("rom", "run", folder / "swing.h5", "--guard", kept(tmp_path / "other.yaml", other))
    assert done.code == 3
    assert text in " ".join(done.err.split())


def test_other_models_and_options_are_refused(folder: Path, tmp_path: Path) -> None:
    box = fmbs("train", written(tmp_path, REDUCTION + TRAINING), "--no-plots", "--out", tmp_path / "out")
    assert box.code == 0, box.err
    saved = files.read(folder / "swing.h5")
    notes = {name: note for name, note in saved.notes.items() if name != guarded.NOTE}
    old = files.save(saved.system, tmp_path / "old.h5", **notes)
    for model, options, text in (
        (tmp_path / "out" / "model.h5", (), "expected a model at one set of parameters, got one of a range of them"),
        (old, (), "expected a model that knows its own indicator, got none; make it anew with fmbs reduce"),
        (folder / "swing.h5", ("--step", "0.1"), "expected the step of the scene beside --guard"),
        (folder / "swing.h5", ("--picture",), "fmbs render draws the scene"),
    ):
        done = fmbs("rom", "run", model, "--guard", folder / "swing.yaml", *options)
        assert done.code == 3
        assert text in " ".join(done.err.split())
    alone = fmbs("rom", "run", folder / "swing.h5", "--accuracy", "1e-3")
    assert alone.code == 3
    assert "with --guard SCENE the full model keeps another one" in " ".join(alone.err.split())


def test_scenes_with_events_are_reduced_and_not_guarded(tmp_path: Path) -> None:
    """What looks at every step can change no model: the file is made, and a guarded run of it is refused."""
    path = kept(tmp_path / "swing.yaml", SWING + "events: {low: {when: tip.y + 1.9, stop: true}}\n")
    done = fmbs("reduce", path, "--out", tmp_path / "swing.h5", "--json")
    assert done.code == 0, done.err
    refused = fmbs("rom", "run", tmp_path / "swing.h5", "--guard", path)
    assert refused.code == 3
    assert "expected a scene without events and controllers, got" in " ".join(refused.err.split())


def test_what_guarded_runs_need_costs_no_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The reduced model runs twice, to be timed; the second time with other velocities."""
    runs, legs = Mock(wraps=cases.run), Mock(wraps=guarded.Leg)
    monkeypatch.setattr(cases, "run", runs)
    monkeypatch.setattr(guarded, "Leg", legs)
    found = studies.reduce(kept(tmp_path / "swing.yaml", SWING))
    reduced = [one for one in runs.call_args_list if one.args[0].system.size == found.system.size]
    assert (len(reduced), legs.call_count) == (1, 1)
    again, _ = guarded.growth(found.case)
    assert found.known.growth == pytest.approx(again, rel=1e-3)
    assert found.known.growth > 1e-3


def test_what_the_reduced_model_does_alone_is_run_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its motion is that which the growth of errors is found from, beside one with other velocities."""
    taken = list[int]()
    take = guarded.Leg.take

    def counted(leg: guarded.Leg, many: int) -> Trajectory:
        found = take(leg, many)
        taken.append(len(found.times) - 1)
        return found

    monkeypatch.setattr(guarded.Leg, "take", counted)
    report = studies.run_model(folder / "swing.h5", guard=folder / "swing.yaml").report
    assert steps(report, "reduced") == 800
    assert sum(taken) == 2 * 800
