"""`fmbs rom`: a trained model is described, run at wanted values, and refused where it is damaged
or asked for what it has not.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.families import parametric_model
from fmbs_skfem.reduction import files, parameters
from fmbs_skfem.studies import models
from fmbs_skfem.studies.running import solving

from .calls import EXAMPLES, fmbs
from .test_train import REDUCTION, kept, written

PENDULUM = """\
schema: 1
name: pendulum
dimension: 2
bodies:
  beam:
    type: cable
    mesh: beam_10.msh
    line: beam
    section: {shape: circular, diameter: 4 mm}
    material: {young_modulus: 0.1 GPa, density: 1800 kg/m^3}
joints:
  hinge: {type: pin, at: beam.left, to: ground}
loads:
  weight: {type: gravity, acceleration: [0, -9.81]}
analysis: {type: dynamic, duration: 0.3 s, step: 1 ms}
outputs:
  tip: {type: position, at: beam.right}
reduction: {snapshots: 5 ms, tolerance: 1e-8, hyper_reduction: {tolerance: 1e-3, sample: points}}
"""
TRAINING = "training: {candidates: 11, samples: 3, iterations: 1, max_samples: 4}"


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rom")
    done = fmbs(
        "train", written(folder, REDUCTION + TRAINING), "--no-plots", "--out", folder / "out"
    )
    assert done.code == 0, done.err
    return folder / "out" / "model.h5"


def test_info(model: Path, tmp_path: Path) -> None:
    done = fmbs("rom", "info", model, "--json", "--out", tmp_path)
    assert done.code == 0, done.err
    found = done.json
    assert found["parameters"]["E"]["low"] == 0.5e9
    assert (found["parameters"]["E"]["unit"], found["parameters"]["E"]["degree"]) == ("Pa", 1)
    assert found["steps"] == 200
    assert found["notes"]["training"]["full_runs"] == 1
    assert found["notes"]["scene"] == "beam"
    assert (tmp_path / "info.json").is_file()
    table = fmbs("rom", "info", model)
    assert re.search(r"E \[GPa\] +0\.5 ", table.out)
    assert "full_runs" in table.out


def test_run_at_a_value_with_its_unit(model: Path, tmp_path: Path) -> None:
    """outputs.csv holds what the three lines of Python give; the predicted error stands in the
    report.
    """
    done = fmbs("rom", "run", model, "--set", "E=1.2 GPa", "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    found = done.json
    assert found["parameters"] == {"E": 1.2e9}
    assert found["outside"] == []
    error = found["predicted_error"]
    assert 0 < error["low"] < error["error"] < error["high"]
    columns = dynamics.outputs(parametric_model.run(parametric_model.load(model), E=1.2e9))
    table = np.genfromtxt(tmp_path / "out" / "outputs.csv", delimiter=",", names=True)
    np.testing.assert_allclose(table["tip_y"], columns["tip_y"], rtol=1e-13, atol=1e-15)
    assert (tmp_path / "out" / "outputs.png").is_file()


def test_run_and_rom_run_are_one(model: Path, tmp_path: Path) -> None:
    options = (model, "--set", "E=7e8", "--duration", "0.1", "--no-plots", "--json")
    reports = [
        fmbs(*words, *options, "--out", tmp_path / words[0]).json
        for words in (("run",), ("rom", "run"))
    ]
    keys = ("parameters", "predicted_error", "outputs", "steps", "end", "fingerprint")
    assert {key: reports[0][key] for key in keys} == {key: reports[1][key] for key in keys}
    assert (reports[0]["steps"], reports[0]["end"]) == (100, pytest.approx(0.1))


def test_without_values_the_nominal_ones_run(model: Path, tmp_path: Path) -> None:
    done = fmbs("rom", "run", model, "--no-plots", "--out", tmp_path / "out")
    assert done.code == 0, done.err
    assert "E = 1 GPa" in done.out
    assert "Predicted error of the outputs over their ranges:" in done.out
    assert "not reliable" not in done.out


def test_outside_the_box_there_is_a_notice_and_no_prediction(model: Path, tmp_path: Path) -> None:
    done = fmbs(
        "rom", "run", model, "--set", "E=1.6e9", "--no-plots", "--out", tmp_path / "out", "--json"
    )
    assert done.code == 0, done.err
    assert done.json["outside"] == ["E"]
    assert done.json["predicted_error"] is None
    assert any(
        "outside its training: E = 1.6e+09, trained from 5e+08 to 1.5e+09, 10% of that range outside"
        in text
        for text in done.json["notices"]
    )
    longer = fmbs(
        "rom",
        "run",
        model,
        "--duration",
        "0.3",
        "--no-plots",
        "--out",
        tmp_path / "longer",
        "--json",
    )
    assert any("runs for 0.3 s, trained for 0.2 s" in text for text in longer.json["notices"])
    assert longer.json["beyond_training"] == ["runs for 0.3 s, trained for 0.2 s"]
    assert longer.json["predicted_error"] is None
    other = fmbs("rom", "run", model, "--step", "2e-3", "--no-plots", "--out", tmp_path / "other")
    assert "No error is known: a step of 0.002 s, trained with 0.001 s." in other.out
    assert "Predicted error" not in other.out


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--set", "e=1e9"), "expected one of E, got 'e'"),
        (("--set", "EE=1e9"), "got 'EE'; did you mean 'E'?"),
        (("--set", "E=3 mm"), "--set E: expected a pressure [Pa], got '3 mm' (length)"),
        (("--set", "E=many"), "--set E: expected"),
        (
            ("--set", "E=-1 Pa"),
            "--set E: expected a positive number, as all of its range, 5e+08 to 1.5e+09 Pa, got -1",
        ),
        (("--duration", "-1"), "expected a positive step, and a duration of 1 to 10000000 of them"),
        (("--step", "1e-12"), "expected a positive step, and a duration of 1 to 10000000 of them"),
    ],
)
def test_refused(model: Path, options: tuple[str, ...], told: str, tmp_path: Path) -> None:
    done = fmbs("rom", "run", model, *options, "--out", tmp_path / "out")
    assert done.code == 3
    assert told in done.err
    assert not (tmp_path / "out").exists()


@pytest.fixture
def any_sign(monkeypatch: pytest.MonkeyPatch) -> None:
    """Negative moduli, which are refused, are the surest way to a run that fails."""
    monkeypatch.setattr(parameters, "require_sign", lambda *given: None)


@pytest.mark.usefixtures("any_sign")
def test_a_failed_run_is_explained_as_that_of_a_scene_is(model: Path, tmp_path: Path) -> None:
    """A negative Young's modulus has no motion: the part that was reached is kept, with reason,
    residuals and what to try.
    """
    out = tmp_path / "out"
    done = fmbs("rom", "run", model, "--set", "E=-1e9", "--out", out, "--json")
    assert done.code == 4
    found = done.json
    assert (found["status"], found["reason"]) == ("error", "Newton iteration diverged")
    assert 0.0 < found["end"] < found["time"] < 0.2
    failure = json.loads((out / "failure.json").read_text())
    assert failure == {**found["failure"], "provenance": found["provenance"]}
    assert failure["attempts"][0]["residuals"][0] > 0.0
    assert {"outside training", "indefinite"} <= {cause["name"] for cause in failure["causes"]}
    assert all(cause["remedy"] for cause in failure["causes"])
    assert failure["residuals"][0]["name"].startswith("beam mode")
    table = np.genfromtxt(out / "outputs.csv", delimiter=",", names=True)
    assert table["t"][-1] == pytest.approx(found["end"])
    shown = fmbs("rom", "run", model, "--set", "E=-1e9", "--no-plots", "--out", out)
    assert "Likely causes" in shown.out
    good = fmbs("rom", "run", model, "--no-plots", "--out", out, "--force")
    assert good.code == 0
    assert not (out / "failure.json").exists()


@pytest.mark.usefixtures("opengl", "any_sign")
def test_a_failed_run_is_drawn(model: Path, tmp_path: Path) -> None:
    assert fmbs("rom", "run", model, "--set", "E=-1e9", "--out", tmp_path / "out").code == 4
    assert (tmp_path / "out" / "failure.png").is_file()


def test_a_loose_note_is_corrupt(model: Path, tmp_path: Path) -> None:
    system = parametric_model.load(model).model.nominal.system
    for wrong in ("fast", float("nan"), None, True):
        path = files.save(system, tmp_path / "model.h5", report={"duration": 0.01, "step": wrong})
        done = fmbs("rom", "run", path, "--out", tmp_path / "out")
        assert done.code == 8
        assert "notes.report.step: expected a number, got" in done.err


@pytest.mark.parametrize("place", [3, 700, -5])
def test_a_damaged_file_is_corrupt(model: Path, place: int, tmp_path: Path) -> None:
    data = bytearray(model.read_bytes())
    data[place] ^= 1
    damaged = tmp_path / "damaged.h5"
    damaged.write_bytes(bytes(data))
    for words in (("rom", "info"), ("rom", "run"), ("run",)):
        assert fmbs(*words, damaged, "--out", tmp_path / "out").code == 8


def test_a_file_that_is_not_there() -> None:
    done = fmbs("rom", "info", "nothing.h5")
    assert done.code == 3
    assert "fmbs train" in done.err


def test_a_model_at_one_set_of_parameters(tmp_path: Path) -> None:
    """`fmbs reduce` notes duration and step, so that its files run without them; they have no
    parameters.
    """
    model = tmp_path / "single.h5"
    trained = fmbs("reduce", written(tmp_path, REDUCTION), "--out", model, "--json")
    assert trained.code == 0, trained.err
    done = fmbs("rom", "run", model, "--no-plots", "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    assert (done.json["steps"], done.json["dofs"]) == (200, trained.json["dofs"])
    assert fmbs("rom", "info", model, "--json").json["parameters"] == {"E": 1e9, "spin": 3.0}
    assert (done.json["notices"], done.json["beyond_training"]) == ([], [])
    longer = fmbs(
        "rom",
        "run",
        model,
        "--duration",
        "0.6",
        "--no-plots",
        "--out",
        tmp_path / "longer",
        "--json",
    )
    told = "the reduced model runs outside its training: runs for 0.6 s, trained for 0.2 s; check its error against a full run"
    assert told in longer.json["notices"]
    assert longer.json["beyond_training"] == ["runs for 0.6 s, trained for 0.2 s"]
    with pytest.warns(
        Notice, match="runs for 0.4 s, trained for 0.2 s; a step of 0.002 s, trained with 0.001 s"
    ):
        files.run(files.read(model), duration=0.4, step=2e-3)
    refused = fmbs("rom", "run", model, "--set", "E=1e9", "--out", tmp_path / "other")
    assert refused.code == 3
    assert "train one with fmbs train" in refused.err


def test_a_place_that_cannot_be_written_is_refused_before_the_run(
    model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(solving, "attempt", lambda *_: pytest.fail("it ran"))
    (tmp_path / "taken").write_text("a file in the way")
    done = fmbs("rom", "run", model, "--out", tmp_path / "taken" / "below")
    assert done.code == 3
    assert "expected a folder that can be made" in done.err


def test_pictures_have_the_name_of_the_scene() -> None:
    assert models.title(Path("model.h5"), {"scene": "crank-slider"}) == "crank-slider"
    assert models.title(Path("model.h5"), {"scene": ""}) == "model"


def test_a_model_that_loses_energy_beyond_its_training_is_told(tmp_path: Path) -> None:
    """A soft pendulum trained on the first 0.3 s of its fall: over 2 s it loses what the full run
    keeps, to 1e-3.
    """
    path, model = kept(tmp_path / "pendulum.yaml", PENDULUM), tmp_path / "pendulum.h5"
    assert fmbs("reduce", path, "--out", model).code == 0
    done = fmbs(
        "rom", "run", model, "--duration", "2", "--no-plots", "--out", tmp_path / "out", "--json"
    )
    assert done.code == 0, done.err
    assert done.json["energy_change"] > 0.05
    assert any(text.startswith("the energy balance falls by ") for text in done.json["notices"])
    inside = fmbs("rom", "run", model, "--no-plots", "--out", tmp_path / "inside", "--json")
    assert inside.json["energy_change"] < 1e-2
    assert inside.json["notices"] == []
    full = fmbs("run", path, "--duration", "2", "--no-plots", "--out", tmp_path / "full", "--json")
    assert full.json["energy_drift"] < 0.01 * done.json["energy_drift"]
    assert full.json["notices"] == []


def test_models_of_a_scene_are_no_scenes_and_no_families(model: Path, tmp_path: Path) -> None:
    """A sound file at the wrong place is not called damaged."""
    for command in ("check", "render"):
        done = fmbs(command, model)
        assert (done.code, "expected a scene, got a file of kind 'fmbs_skfem" in done.err) == (
            3,
            True,
        )
    plain = files.save(parametric_model.load(model).model.nominal.system, tmp_path / "plain.h5")
    swept = fmbs("sweep", plain, "--samples", 2)
    assert swept.code == 3
    assert (
        "expected a model over ranges of parameters, got one of a single scene; make one with fmbs train"
        in swept.err
    )
    part = fmbs("part", "info", plain)
    assert (part.code, "is it the file that you mean?" in part.err) == (8, True)


@pytest.mark.parametrize("words", [("run",), ("info",), ("export", "--c", "out")])
def test_a_scene_is_no_model(
    words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = fmbs("rom", words[0], EXAMPLES / "four_bar.yaml", *words[1:])
    assert done.code == 3
    assert "expected a saved reduced model, got a scene; run it with fmbs run" in done.err
