"""`fmbs part`: a body of a scene becomes a part, which takes its place there and stands in other
scenes.
"""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest

from fmbs_skfem.parts import files as part_files

from .calls import fmbs
from .test_rom import PENDULUM
from .test_train import kept

CHAIN = """\
schema: 1
name: chain
dimension: 2
bodies:
  upper: {type: part, file: beam.part.h5, rotation: -90 deg}
  lower: {type: part, file: beam.part.h5, origin: [0, -1 m], rotation: -90 deg}
joints:
  hinge: {type: pin, at: upper.left, to: ground}
  middle: {type: pin, at: upper.right, to: lower.left}
loads:
  weight: {type: gravity, acceleration: [0, -9.81]}
  push: {type: point_force, at: lower.right, force: [1 mN, 0]}
analysis: {type: dynamic, duration: 0.02 s, step: 1 ms}
outputs:
  tip: {type: position, at: lower.right}
"""
SHORT = (
    "--duration",
    "0.5",
    "--step",
    "1e-3",
    "--runs",
    "2",
    "--tolerance",
    "1e-6",
    "--moment",
    "0",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("part")
    kept(found / "scene.yaml", PENDULUM)
    done = fmbs(
        "part", "train", found / "scene.yaml", "--body", "beam", "--alone", *SHORT, "--out", found
    )
    assert done.code == 0, done.err
    return found


def test_info_says_sizes_places_and_the_strains_of_the_training(
    folder: Path, tmp_path: Path
) -> None:
    found = fmbs("part", "info", folder / "beam.part.h5", "--json", "--out", tmp_path).json
    assert found["functions"] < found["functions_full"]
    assert {"young_modulus", "density"} <= set(found["values"])
    assert {"left", "right"} <= set(found["places"])
    assert found["stands_at"] == {"left [m]": [0.0, 0.0], "right [m]": [pytest.approx(1.0), 0.0]}
    assert found["alone"]["runs"] == 2
    assert found["missing_shapes"] == "known"
    assert found["strains"]["curvature [1/m]"][1] > 0.0
    assert (tmp_path / "info.json").exists()


def test_a_part_names_the_files_of_its_training_without_their_folders(folder: Path) -> None:
    notes = part_files.load(folder / "beam.part.h5").notes
    assert "scene.yaml" in notes["provenance"]["files"]
    assert str(folder) not in json.dumps(notes)


def test_modes_say_which_frequencies_of_a_part_are_too_high(folder: Path, tmp_path: Path) -> None:
    """The beam was trained without moments, and is clamped here."""
    hung = CHAIN.replace(
        "joints:\n  hinge: {type: pin, at: upper.left",
        "joints:\n  hinge: {type: weld, at: upper.left",
    )
    text = hung.replace(
        "{type: dynamic, duration: 0.02 s, step: 1 ms}", "{type: modes, count: 4, about: reference}"
    )
    text = text.replace("beam.part.h5,", "beam.part.h5, modes: 4,")
    unread = text[text.index("loads:") : text.index("analysis:")], text[text.index("outputs:") :]
    text = text.replace(unread[0], "").replace(unread[1], "")
    found = fmbs("run", kept(folder / "modes.yaml", text), "--json", "--out", tmp_path / "out")
    assert found.code == 0, found.err
    assert len(found.json["too_high_by"]) == 4
    assert max(found.json["too_high_by"]) > 0.01
    (told,) = [one for one in found.json["notices"] if "frequencies of parts" in one]
    assert re.search(
        r"frequencies of parts are off from those of their bodies: mode \d by \+", told
    )
    strict = fmbs("run", folder / "modes.yaml", "--json", "--strict", "--out", tmp_path / "strict")
    assert (strict.code, strict.json["reason"], strict.json["too_high_by"]) == (
        3,
        "notice",
        found.json["too_high_by"],
    )
    assert (tmp_path / "strict" / "modes.csv").read_bytes() == (
        tmp_path / "out" / "modes.csv"
    ).read_bytes()


DOORS = """\
schema: 1
dimension: 2
bodies: {beam: {type: part, file: beam.part.h5, modes: 3}}
joints: {clamp: {type: clamp, at: beam.left}}
"""
PUSH = "loads: {push: {type: point_force, at: beam.right, force: [-1 mN, 1 mN]}}\n"
TIP = "outputs: {tip: {type: position, at: beam.right}}\n"
SPIN = "parameters: {w: {value: 1, range: [0, 2]}}\n"
INPUT = "inputs: {u: {unit: N}}\nloads: {push: {type: control_force, at: beam.right, direction: [0, 1], force: u}}\n"
OFF = "parts 'beam' do not stand for their bodies here, .*tip_y is off by"


@pytest.mark.parametrize(
    ("analysis", "more", "told"),
    [
        (
            "modes, count: 4, damped: true, about: reference",
            "damping: {stiffness: 0.1 ms}\n",
            "frequencies of parts are off",
        ),
        (
            "campbell, parameter: w, spin: {rate: w}, count: 2, steps: 2",
            SPIN,
            "frequencies of parts are off .* at w = [012] by",
        ),
        ("buckling, count: 2", PUSH, "load factors of parts are off"),
        ("linearise", INPUT + TIP, "eigenvalues of parts are off"),
        ("static, load_steps: 2", PUSH + TIP, OFF),
        ("static, load_steps: 2, method: arc_length", PUSH + TIP, OFF),
        ("dynamic, duration: 6 s, step: 6 ms", PUSH + TIP, OFF),
    ],
)
def test_every_door_says_that_a_part_does_not_stand_for_its_body(
    folder: Path, tmp_path: Path, analysis: str, more: str, told: str
) -> None:
    """A beam with one function beside rigid motions and stretch is clamped."""
    scene = kept(folder / "door.yaml", f"{DOORS}{more}analysis: {{type: {analysis}}}\n")
    found = fmbs("run", scene, "--json", "--no-plots", "--out", tmp_path / "out")
    assert found.code == 0, found.err
    assert [one for one in found.json["notices"] if re.search(told, one)], found.json["notices"]


def test_an_accuracy_counts_the_errors_of_parts(folder: Path, tmp_path: Path) -> None:
    """What a run knows of its parts is a part of what it promises: of the error beside every
    number, and of whether it is met.
    """
    text = f"{DOORS}{PUSH}{TIP}analysis: {{type: static, accuracy: {{tip: 5 %}}}}\n"
    found = fmbs(
        "run", kept(folder / "wish.yaml", text), "--json", "--no-plots", "--out", tmp_path / "out"
    ).json
    plan, known = found["accuracy"], found["part_errors"]["tip_y"]
    assert known > 0.05
    assert (plan["met"], plan["why_not"]) == (False, "parts")
    assert plan["of_parts"] > 1.0
    assert plan["errors"]["tip_y"] >= known * (
        found["outputs"]["tip_y"]["max"] - found["outputs"]["tip_y"]["min"]
    )
    assert [
        one for one in found["notices"] if "not met" in one and "mostly by the parts; train" in one
    ]


def test_a_part_takes_the_place_of_its_full_body(folder: Path) -> None:
    found = fmbs(
        "part", "check", folder / "beam.part.h5", folder / "scene.yaml", "--body", "beam", "--json"
    ).json
    assert found["output_errors"]["tip_x"]["error"] < 1e-3
    assert found["output_errors"]["tip_y"]["error"] < 1e-3
    coarse = fmbs(
        "part",
        "check",
        folder / "beam.part.h5",
        folder / "scene.yaml",
        "--body",
        "beam",
        "--modes",
        "4",
        "--json",
    ).json
    assert coarse["functions"] == 4 < found["functions"]
    assert (
        coarse["output_errors"]["tip_x"]["error"] > 2.0 * found["output_errors"]["tip_x"]["error"]
    )


def test_a_scene_of_parts_runs_and_is_checked(folder: Path, tmp_path: Path) -> None:
    (folder / "chain.yaml").write_text(CHAIN, encoding="utf-8")
    assert fmbs("check", folder / "chain.yaml", "--json").json["status"] == "ok"
    found = fmbs("run", folder / "chain.yaml", "--json", "--no-plots", "--out", tmp_path / "out")
    assert found.code == 0, found.err
    assert any(name.endswith("beam.part.h5") for name in found.json["provenance"]["files"])


def test_a_part_is_trained_on_the_motion_of_a_scene_as_well(folder: Path, tmp_path: Path) -> None:
    found = fmbs(
        "part",
        "train",
        folder / "scene.yaml",
        "--body",
        "beam",
        "--hyper",
        "0",
        "--json",
        "--out",
        tmp_path,
    ).json
    assert found["alone"] is None
    assert found["points"] == found["points_full"]


def test_a_part_is_trained_up_to_a_strain(folder: Path, tmp_path: Path) -> None:
    told = (
        "--body",
        "beam",
        "--alone",
        "--strain",
        "2e-3",
        "--runs",
        "1",
        "--tolerance",
        "1e-6",
        "--samples",
        "100",
    )
    found = fmbs("part", "train", folder / "scene.yaml", *told, "--json", "--out", tmp_path).json
    assert 1.8e-3 <= found["largest_strain"] <= 2.2e-3
    assert found["alone"]["strain"] == 2e-3
    assert found["alone"]["force"] > 0.0


def test_a_training_goes_on(folder: Path, tmp_path: Path) -> None:
    more = (
        "--body",
        "beam",
        "--alone",
        *SHORT[:-2],
        "--seed",
        "1",
        "--continue",
        folder / "beam.part.h5",
    )
    found = fmbs("part", "train", folder / "scene.yaml", *more, "--json", "--out", tmp_path).json
    before = fmbs("part", "info", folder / "beam.part.h5", "--json").json
    assert found["states"] == 2 * before["states"]
    assert found["before"]["strains"] == before["strains"]
    assert found["strains"]["curvature [1/m]"][1] >= before["strains"]["curvature [1/m]"][1]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("train", "scene.yaml", "--body", "beem", "--alone"), "did you mean 'beam'"),
        (
            ("train", "scene.yaml", "--body", "beam", "--alone", "--out", "beam.part.h5"),
            "a new file, got one that exists",
        ),
        (
            ("train", "chain.yaml", "--body", "upper", "--alone"),
            "a full elastic body (none here), got 'upper', a part; give the scene that has the full",
        ),
        (
            ("check", "beam.part.h5", "chain.yaml", "--body", "upper"),
            "'upper', a part; give the scene that has the full body in place",
        ),
        (
            ("train", "scene.yaml", "--body", "beam", "--strain", "1e-3"),
            "--alone: expected it beside the sizes of its motions",
        ),
        (("info", "scene.yaml"), "'fmbs_skfem part' in its first line"),
        (
            ("check", "beam.part.h5", "mute.yaml", "--body", "beam"),
            "outputs, whose errors are found, got none; add one",
        ),
    ],
)
def test_refused(
    folder: Path, options: tuple[str, ...], told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "chain.yaml").write_text(CHAIN, encoding="utf-8")
    (folder / "mute.yaml").write_text(PENDULUM[: PENDULUM.index("outputs:")], encoding="utf-8")
    monkeypatch.chdir(folder)
    done = fmbs("part", *options)
    assert done.code in (3, 8)
    assert told in done.err.replace("\n", " ")


def test_sweeps_say_in_which_samples_parts_leave_their_training(
    folder: Path, tmp_path: Path
) -> None:
    text = CHAIN.replace(
        "bodies:", "parameters: {F: {value: 1 mN, range: [1 mN, 2000 N]}}\nbodies:", 1
    ).replace("[1 mN, 0]", "[F, 0]")
    (table := tmp_path / "points.csv").write_text("F [N]\n0.001\n2000\n-1\n")
    scene, out = kept(folder / "sweep.yaml", text), tmp_path / "out"
    found = fmbs(
        "sweep", scene, "--list", table, "--workers", "1", "--no-plots", "--json", "--out", out
    )
    assert found.code == 0, found.err
    alone = fmbs(
        "run", scene, "--set", "F=2000 N", "--json", "--no-plots", "--out", tmp_path / "run"
    ).json["beyond_training"]
    parts = len({one["body"] for one in alone})
    assert parts > 0
    (one,) = found.json["outside_training"]
    assert one == {"member": 1, "values": {"F": 2000.0}, "parts": parts}
    with (out / "sweep.csv").open() as file:
        assert [row["parts outside training"] for row in csv.DictReader(file)] == [
            "0",
            str(parts),
            "0",
        ]


def test_strains_beyond_the_training_are_told_and_strict_stops(
    folder: Path, tmp_path: Path
) -> None:
    (folder / "pushed.yaml").write_text(CHAIN.replace("[1 mN, 0]", "[2000 N, 0]"), encoding="utf-8")
    found = fmbs("run", folder / "pushed.yaml", "--json", "--no-plots", "--out", tmp_path / "out")
    assert found.code == 0, found.err
    assert {one["body"] for one in found.json["beyond_training"]} <= {"upper", "lower"}
    assert "near (" in found.err
    assert "trained from" in found.err
    strict = fmbs(
        "run",
        folder / "pushed.yaml",
        "--strict",
        "--json",
        "--no-plots",
        "--out",
        tmp_path / "strict",
    )
    assert (strict.code, strict.json["reason"]) == (3, "notice")
    assert "(an error by --strict)" in strict.err


DRIVEN = PENDULUM.replace("4 mm", "5 mm").partition("reduction:")[0]


@pytest.mark.parametrize("alone", [False, True])
def test_an_accuracy_chooses_shape_functions_and_points(alone: bool, tmp_path: Path) -> None:
    """The coarsest ones with which the outputs of the scene err by at most 0.3 of it: a coarser
    accuracy takes fewer.
    """
    scene, sizes = kept(tmp_path / "scene.yaml", DRIVEN), []
    for accuracy in ("1e-2", "1e-5"):
        out = tmp_path / f"{accuracy}.part.h5"
        how = ("--alone", "--runs", "2", "--duration", "0.5", "--step", "1e-3") if alone else ()
        done = fmbs(
            "part",
            "train",
            scene,
            "--body",
            "beam",
            *how,
            "--accuracy",
            f"tip={accuracy}",
            "--out",
            out,
            "--json",
        )
        assert done.code == 0, done.err
        assert done.json["error_over_accuracy"] <= 0.3
        assert done.json["accuracy"] == f"tip: {accuracy} of the range".replace(
            "1e-2", "0.01"
        ).replace("1e-5", "1e-05")
        sizes.append((done.json["functions"], done.json["points"]))
    assert sizes[0] < sizes[1]
    given = ("--modes", "4", "--hyper", "0", "--force")
    rough = fmbs(
        "part",
        "train",
        scene,
        "--body",
        "beam",
        *given,
        "--accuracy",
        "tip=1e-6",
        "--out",
        out,
        "--json",
    )
    assert rough.json["functions"] < sizes[1][0]
    assert any("where 0.3 of it is aimed at" in notice for notice in rough.json["notices"])
