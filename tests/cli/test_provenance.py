"""Where numbers come from stands in every report and model; files are held against checksums;
processes agree bit by bit.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.families import parametric_model
from fmbs_skfem.reduction import files
from fmbs_skfem.studies import reports

from . import test_failures, test_train
from .calls import fmbs, scene

KEYS = {"scene", "file", "files", "versions", "machine", "threads", "seeds"}
TRAINING = "training: {candidates: 5, samples: 2, iterations: 2, max_samples: 2}"
TRAIN, REDUCE = (
    ("train", "beam.yaml", "--duration", "0.05", "--no-plots"),
    ("reduce", "beam.yaml", "--duration", "0.05"),
)

#: what is called -> its words, the code it ends with, its record, the files it reads
REPORTS = {
    "run": (
        ("run", "beam.yaml", "--duration", "0.01", "--no-plots"),
        0,
        "report.json",
        ("beam.yaml", "beam_10.msh"),
    ),
    "statics": (
        ("run", "static.yaml", "--no-plots"),
        0,
        "report.json",
        ("static.yaml", "beam_20.msh"),
    ),
    "modes": (("run", "modes.yaml"), 0, "report.json", ("modes.yaml", "beam_20.msh")),
    "failed": (("run", "jump.yaml", "--no-plots"), 4, "failure.json", ("jump.yaml", "beam_20.msh")),
    "no start": (
        ("run", "huge.yaml", "--no-plots"),
        4,
        "failure.json",
        ("huge.yaml", "beam_20.msh"),
    ),
    "export": (
        ("export", "beam.yaml", "--duration", "0.01", "--frames", "2"),
        0,
        "report.json",
        ("beam.yaml", "beam_10.msh"),
    ),
    "check": (("check", "beam.yaml"), 0, "check.json", ("beam.yaml", "beam_10.msh")),
    "compare": (
        ("compare", "beam.yaml", "--quick", "--no-picture", "--duration", "0.05"),
        0,
        "compare.json",
        ("beam.yaml", "beam_10.msh"),
    ),
    "train": (TRAIN, 0, "report.json", ("beam.yaml", "beam_10.msh")),
    "rom run": (
        ("rom", "run", "box.h5", "--duration", "0.01", "--no-plots"),
        0,
        "report.json",
        ("box.h5",),
    ),
    "run of a model": (
        ("run", "point.h5", "--duration", "0.01", "--no-plots"),
        0,
        "report.json",
        ("point.h5",),
    ),
    "rom info": (("rom", "info", "box.h5"), 0, "info.json", ("box.h5",)),
    "sweep": (
        ("sweep", "beam.yaml", "--samples", "2", "--seed", "5", "--duration", "0.01", "--no-plots"),
        0,
        "report.json",
        ("beam.yaml", "beam_10.msh"),
    ),
    "sweep of a model": (
        ("sweep", "box.h5", "--samples", "2", "--seed", "5", "--no-plots"),
        0,
        "report.json",
        ("box.h5",),
    ),
    "verify": (("verify", "--case", "coefficients"), 0, "verification.json", ()),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Scenes with their meshes, and two saved models."""
    place = tmp_path_factory.mktemp("provenance")
    test_train.written(place, test_train.REDUCTION + TRAINING)
    for name, analysis in (
        ("modes", "{type: modes, count: 1}"),
        ("static", "{type: static, load_steps: 1}"),
    ):
        scene(place, analysis).rename(place / f"{name}.yaml")
    jump = scene(place, test_failures.SHORT, test_failures.JUMP)
    (place / "jump.yaml").write_text(jump.read_text())
    huge = jump.read_text().replace(
        "point_force, at: beam.right, force: [0, load]",
        "follower, at: beam.right, force: [0, 1e40]",
    )
    (place / "huge.yaml").write_text(huge.replace("step: 1 ms", "step: 1 ms, start: equilibrium"))
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        assert fmbs(*TRAIN, "--out", "trained").code == 0
        assert fmbs(*REDUCE, "--out", "point.h5").code == 0
    (place / "trained" / "model.h5").rename(place / "box.h5")
    return place


@pytest.mark.parametrize("name", REPORTS)
def test_every_report_says_where_its_numbers_come_from(
    name: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words, code, record, read = REPORTS[name]
    monkeypatch.chdir(folder)
    done = fmbs(*words, "--out", name, "--json")
    assert done.code == code, done.err
    found = json.loads((folder / name / record).read_text())["provenance"]
    assert set(found) == KEYS
    assert {Path(path).name for path in found["files"]} == set(read)
    assert {"fmbs_skfem", "python", *reports.VERSIONS} == set(found["versions"])
    assert set(found["machine"]) == {"system", "processor", "cores"}
    assert found["threads"] == {"blas": 1, "workers": done.json.get("workers", 1)}
    assert found["seeds"]["solver"] == 0
    assert found["seeds"].get("design") == (5 if name.startswith("sweep") else None)
    assert (
        (found["scene"] is None)
        == (found["file"] is None)
        == (not any(path.endswith(".yaml") for path in read))
    )
    if name != "no start":
        assert fmbs("check", name).code == 0


def test_a_run_with_another_table_is_another_run(tmp_path: Path) -> None:
    """Files of tables count as meshes do: a sweep would go on with samples of two loads."""
    path = scene(tmp_path, test_failures.SHORT, "push(t)")
    path.write_text(f"{path.read_text()}tables: {{push: {{file: push.csv}}}}\n")
    marks = []
    for last in (1, 2):
        (tmp_path / "push.csv").write_text(f"time [s], push\n0, 0\n100, {last}\n")
        read = scenes.read(path)
        marks.append(reports.fingerprint(read))
        assert {place.name for place in reports.scene_files(read)} == {
            "cantilever.yaml",
            "beam_20.msh",
            "push.csv",
        }
    assert marks[0] != marks[1]


def test_saved_models_say_where_their_numbers_come_from(folder: Path) -> None:
    for notes in (
        files.read(folder / "point.h5").notes,
        parametric_model.load(folder / "box.h5").notes,
    ):
        assert set(notes["provenance"]) == KEYS
        assert notes["provenance"]["scene"]["name"] == "beam"
        assert notes["provenance"]["file"] in notes["provenance"]["files"]
        assert set(notes["provenance"]["files"]) == {notes["provenance"]["file"], "beam_10.msh"}
        assert str(folder) not in json.dumps(notes, default=str)


@pytest.mark.parametrize(
    ("mesh", "name"), [("../beam_20.msh", "../beam_20.msh"), ("../../beam_20.msh", "beam_20.msh")]
)
def test_files_outside_of_the_folder_are_named_without_it(
    mesh: str, name: str, tmp_path: Path
) -> None:
    place = tmp_path / "a" / "b"
    place.mkdir(parents=True)
    path = scene(place, test_failures.SHORT)
    (place / "beam_20.msh").rename(place / mesh)
    path.write_text(path.read_text().replace("beam_20.msh", mesh))
    read = scenes.read(path)
    found = reports.provenance_to_keep(reports.provenance(read), read)
    assert set(found["files"]) == {path.name, name}
    assert found["file"] == path.name


def arrays(path: Path) -> dict[str, np.ndarray]:
    """All arrays of a saved model: bases, selected cells, weights, polynomials."""
    with h5py.File(path, "r") as file:
        return {name: item[()] for name, item in file["arrays"].items()}


@pytest.mark.parametrize(
    ("words", "here", "there"),
    [(REDUCE, "point.h5", "again.h5"), (TRAIN, "box.h5", "again/model.h5")],
)
def test_the_same_training_gives_the_same_bits_in_another_process(
    words: tuple[str, ...], here: str, there: str, folder: Path
) -> None:
    out = there.partition("/")[0]
    command = [str(Path(sys.executable).parent / "fmbs"), *words, "--out", out]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    one, other = arrays(folder / here), arrays(folder / there)
    assert one.keys() == other.keys()
    assert all(one[name].tobytes() == other[name].tobytes() for name in one)


@pytest.fixture
def results(folder: Path, tmp_path: Path) -> Path:
    assert (
        fmbs(
            "run",
            folder / "beam.yaml",
            "--duration",
            "0.01",
            "--out",
            tmp_path / "out",
            "--checkpoint",
            "0",
        ).code
        == 0
    )
    return tmp_path / "out"


@pytest.mark.parametrize(
    "name", ["outputs.csv", "outputs.png", "report.json", "history/segment-00001.h5"]
)
def test_a_flipped_byte_of_a_result_is_found(name: str, results: Path) -> None:
    whole = fmbs("check", results, "--json")
    assert {Path(path).name for path in whole.json["verified"]} == {
        "report.json",
        "outputs.csv",
        "outputs.units.json",
        "outputs.png",
        "history",
    }
    path = results / name
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    done = fmbs("check", results)
    assert done.code == 8
    assert path.name in done.err


def test_a_result_that_is_lost_is_named(results: Path) -> None:
    (results / "outputs.csv").unlink()
    done = fmbs("check", results)
    assert done.code == 8
    assert "outputs.csv: expected the file, got none" in done.err


def test_a_folder_without_results_is_refused(tmp_path: Path) -> None:
    done = fmbs("check", tmp_path)
    assert done.code == 3
    assert "a folder with results, got a folder without a report" in done.err
