"""What `fmbs run` keeps and shows of a solve that failed: failure.json, a picture, tables, causes
on stderr.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import h5py
import numpy as np
import pytest

from fmbs_skfem.core.errors import MissingFeature
from fmbs_skfem.results import pictures
from fmbs_skfem.studies import reports
from fmbs_skfem.studies.running import judging

from .calls import CANTILEVER, Call, fmbs, scene

SHORT = "{type: dynamic, duration: 10 ms, step: 1 ms}"
JUMP = "where(t < 0.0055, 1, 1e12)"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("failure")


@pytest.fixture(scope="module")
def call(folder: Path) -> Call:
    return fmbs("run", scene(folder, SHORT, JUMP), "--json", "--out", folder / "out")


def test_failure_json_holds_the_facts(call: Call, folder: Path) -> None:
    assert call.code == 4
    found = json.loads((folder / "out" / "failure.json").read_text())
    assert found == {**call.json["failure"], "provenance": call.json["provenance"]}
    assert found["causes"][0]["name"] == "jump"
    assert found["step"] == 6
    assert found["good"] == pytest.approx(0.005)
    # the step ends where the load jumps, and another one begins there
    assert [attempt["step"] for attempt in found["attempts"]] == pytest.approx(
        [5e-4 / 2**k for k in range(7)]
    )
    assert {one["name"] for one in found["multipliers"]} == {
        "joint clamp.x",
        "joint clamp.y",
        "joint clamp.slope 1",
    }
    assert found["residuals"][0]["name"].startswith("beam at s = ")


def test_the_last_good_state_is_kept(call: Call, folder: Path) -> None:
    """5 ms of the motion; the tip's coordinates are the last output that was written."""
    with h5py.File(folder / "out" / "failure.h5") as file:
        state = {name: item[()] for name, item in file.items()}
        time = file.attrs["time"]
    assert time == pytest.approx(call.json["failure"]["good"]) == pytest.approx(0.005)
    assert (
        len(state["unknowns"])
        == len(state["x"])
        == len(state["v"])
        == len(state["a"])
        == call.json["unknowns"]
    )
    assert len(state["constraints"]) == len(state["multipliers"]) == call.json["multipliers"]
    assert all(name.startswith(b"beam at s = ") for name in state["unknowns"])
    tip = np.loadtxt(folder / "out" / "outputs.csv", delimiter=",", skiprows=1)[-1, 1:3]
    assert all(np.isclose(state["x"], value, rtol=1e-12).any() for value in tip)
    assert str(folder / "out" / "failure.h5") in call.json["files"]


@pytest.mark.usefixtures("opengl")
def test_the_last_good_state_is_drawn(call: Call, folder: Path) -> None:
    assert (folder / "out" / "failure.png").read_bytes().startswith(b"\x89PNG")
    assert str(folder / "out" / "failure.png") in call.json["files"]


def test_tables_without_json(tmp_path: Path) -> None:
    done = fmbs("run", scene(tmp_path, SHORT, JUMP), "--out", tmp_path / "out", "--no-plots")
    assert all(
        text in done.out
        for text in ("Likely causes", "jumps from 1", "last good state", "residuals with step")
    )
    assert not (tmp_path / "out" / "failure.png").exists()


def test_a_run_that_succeeds_removes_the_failure_of_the_one_before(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert fmbs("run", scene(tmp_path, SHORT, JUMP), "--out", out, "--no-plots").code == 4
    assert fmbs("run", scene(tmp_path, SHORT), "--out", out, "--no-plots", "--force").code == 0
    assert sorted(path.name for path in out.iterdir()) == [
        "outputs.csv",
        "outputs.units.json",
        "report.json",
    ]


def test_a_file_of_the_user_is_kept(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "failure.json").write_text("mine")
    done = fmbs("run", scene(tmp_path, SHORT, JUMP), "--out", out, "--no-plots")
    assert done.code == 4
    assert "failure.json did not come from here" in done.err
    assert (out / "failure.json").read_text() == "mine"


def test_without_opengl_the_facts_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*_: object, **__: object) -> Path:
        raise MissingFeature("no OpenGL")

    monkeypatch.setattr(pictures, "render", missing)
    done = fmbs("run", scene(tmp_path, SHORT, JUMP), "--out", tmp_path / "out")
    assert done.code == 4
    assert "no picture of the last good state: no OpenGL" in done.err
    assert (tmp_path / "out" / "failure.json").is_file()


def test_a_solve_that_never_starts_is_explained(tmp_path: Path) -> None:
    """No equilibrium is found from which a motion under a follower force of 1e40 N would start."""
    text = CANTILEVER.replace(
        "point_force, at: beam.right, force: [0, load]",
        "follower, at: beam.right, force: [0, 1e40]",
    )
    start = SHORT.replace("}", ", start: equilibrium}")
    done = fmbs("run", scene(tmp_path, start, text=text), "--out", tmp_path / "out")
    assert done.code == 4
    assert "likely cause: the loads at t = 0 have no equilibrium" in done.err
    found = json.loads((tmp_path / "out" / "failure.json").read_text())
    assert found["causes"][0]["name"] == "equilibrium"
    assert found["good"] is None


def test_a_static_failure_names_its_load_factor(tmp_path: Path) -> None:
    """A follower force of 10 GN on a rod of EA = 79 kN."""
    text = CANTILEVER.replace(
        "type: point_force, at: beam.right, force: [0, load]",
        "type: follower, at: beam.right, force: [0, load]",
    )
    out = tmp_path / "out"
    done = fmbs(
        "run",
        scene(tmp_path, "{type: static, load_steps: 4}", text=text),
        "--json",
        "--out",
        out,
        "--set",
        "load=1e10 N",
        "--no-plots",
    )
    assert done.code == 4
    found = done.json["failure"]
    assert found["unit"] == "load factor"
    assert 0.0 <= found["good"] < found["at"] <= 1.0
    with h5py.File(out / "failure.h5") as file:
        assert file.attrs["time"] == found["good"]
        assert len(file["x"]) == len(file["unknowns"]) == done.json["unknowns"]
    assert "huge load" in {one["name"] for one in found["causes"]}
    assert np.isfinite([value for pair in found["strains"].values() for value in pair]).all()


def test_a_run_that_fails_in_its_first_step_keeps_its_start(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = fmbs("run", scene(tmp_path, SHORT, "1e12"), "--json", "--out", out)
    assert done.code == 4, done.err
    assert np.loadtxt(out / "outputs.csv", delimiter=",", skiprows=1).reshape(-1, 6)[
        :, 0
    ].tolist() == [0.0]
    assert done.json["failure"]["step"] == 1
    assert (out / "failure.json").is_file()


def test_a_run_that_keeps_one_state_is_right(tmp_path: Path) -> None:
    done = fmbs(
        "run",
        scene(tmp_path, "{type: dynamic, duration: 10 ms, step: 1 ms, every: 1000}"),
        "--out",
        tmp_path / "out",
    )
    assert done.code == 0, done.err


def test_an_internal_error_leaves_its_traceback_and_the_motion(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Here in the balance of energy, after everything is solved."""

    def wrong(*_: object) -> float:
        raise ZeroDivisionError("oh")

    monkeypatch.setattr(judging, "energy_drift", wrong)
    out = tmp_path / "out"
    done = fmbs("run", scene(tmp_path, SHORT), "--out", out, "--json")
    assert done.code == 1
    assert done.json["reason"] == "internal error"
    assert done.json["files"] == [
        str(out / name) for name in ("internal_error.json", "states.h5", "outputs.csv")
    ]
    assert "Traceback" not in done.err
    found = json.loads((out / "internal_error.json").read_text())
    assert "in wrong" in "".join(found["traceback"])
    assert found["message"] == "ZeroDivisionError: oh"
    with h5py.File(out / "states.h5") as file:
        assert file["times"][-1] == pytest.approx(0.01)
        assert file["x"].shape == file["v"].shape == file["a"].shape
        assert len(file["x"]) == len(file["multipliers"]) == 11
    assert len(np.loadtxt(out / "outputs.csv", delimiter=",", skiprows=1)) == 11


def test_an_internal_error_without_results_leaves_its_traceback(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def wrong(*_: object) -> float:
        raise ZeroDivisionError("oh")

    monkeypatch.setattr(reports, "fingerprint", wrong)
    monkeypatch.chdir(tmp_path)
    done = fmbs("check", scene(tmp_path, SHORT))
    assert done.code == 1
    assert "written: internal_error.json" in done.err
    assert "in wrong" in (tmp_path / "internal_error.json").read_text()


@pytest.mark.skipif(os.name == "nt", reason="names of files are letters there")
def test_names_of_files_that_are_no_text_are_refused(tmp_path: Path) -> None:
    """Before anything is solved: reports, pages and models could not name them."""
    odd = tmp_path / os.fsdecode(b"sc\xe4ne")
    for words in (("check", f"{odd}.yaml"), ("run", "scene.yaml", "--out", odd), ("report", odd)):
        done = fmbs(*words, "--json")
        assert (done.code, "sc\\udce4ne" in done.json["message"]) == (3, True), done.err


@pytest.mark.skipif(os.name == "nt", reason="such names are refused there")
def test_control_characters_in_names_of_files_are_written_out(tmp_path: Path) -> None:
    """A terminal would follow them."""
    done = fmbs("check", tmp_path / "a\u202eb\x1b[2J.yaml")
    assert done.code == 3
    assert "a\\u202eb\\x1b[2J.yaml" in done.err


def test_names_are_drawn_as_they_are(tmp_path: Path) -> None:
    """A title that matplotlib would read as a formula, and a label that it would hide."""
    for name in ('"$x^{{$"', "_"):
        text = CANTILEVER.replace("name: cantilever", f"name: {name}")
        done = fmbs("run", scene(tmp_path, SHORT, text=text), "--out", tmp_path / "out", "--force")
        assert done.code == 0, done.err
        assert (tmp_path / "out" / "outputs.png").is_file()


@pytest.mark.parametrize("duration", ["inf", "nan", "1e300", "1e-300", "-1"])
def test_durations_that_are_none(duration: str, tmp_path: Path) -> None:
    done = fmbs("run", scene(tmp_path, SHORT), "--duration", duration, "--out", tmp_path / "out")
    assert done.code == 3
    words = "a finite number" if duration in ("inf", "nan") else "1 to 10000000 steps"
    assert f"expected {words}" in done.err
