"""`fmbs reduce`: a reduced model of example 2 trained over a tenth of a second, saved, and run
again from its file.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from fmbs_skfem.dynamics import GeneralizedAlpha, integrate
from fmbs_skfem.reduction import files
from tests.cli.calls import CANTILEVER, EXAMPLES, Call, fmbs, scene

SCENE = EXAMPLES / "double_pendulum.yaml"


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("reduce") / "new" / "model.h5"


@pytest.fixture(scope="module")
def call(path: Path) -> Call:
    return fmbs(
        "reduce",
        SCENE,
        "--duration",
        "0.1",
        "--sample",
        "points",
        "--hyper",
        "1e-4",
        "--out",
        path,
        "--json",
    )


def test_sizes_and_errors_are_told(call: Call) -> None:
    assert call.code == 0, call.err
    found = call.json
    assert found["dofs_full"] == 1212
    assert found["dofs"] == sum(found["modes"].values())
    assert set(found["modes"]) == {"first", "second"}
    assert 0 < found["max_error"] < 1e-4
    assert found["hyper_tolerance"] == 1e-4
    assert all(found["points"][name] < 300 for name in found["modes"])


def test_the_file_runs_alone(call: Call, path: Path) -> None:
    saved = files.read(path)
    assert saved.system.size == call.json["dofs"]
    assert saved.notes["training"]["d"] == pytest.approx(0.01)
    motion = integrate(
        files.load(path), GeneralizedAlpha(call.json["step"], call.json["rho_inf"]), 0.1
    )
    assert len(motion.times) == 201


@pytest.mark.usefixtures("opengl")
def test_the_file_is_drawn(call: Call, path: Path, tmp_path: Path) -> None:
    drawn = fmbs(
        "run",
        path,
        "--duration",
        "0.1",
        "--step",
        "5e-4",
        "--picture",
        "--out",
        tmp_path / "out",
        "--json",
    )
    assert drawn.code == 0, drawn.err
    assert (tmp_path / "out" / "picture.png").stat().st_size > 10_000


def test_an_existing_file_is_kept(call: Call, path: Path) -> None:
    before = path.read_bytes()
    again = fmbs("reduce", SCENE, "--duration", "0.1", "--out", path)
    assert again.code == 3
    assert "--force" in again.err
    assert path.read_bytes() == before
    below = fmbs("reduce", SCENE, "--duration", "0.1", "--out", path / "below.h5")
    assert below.code == 3
    assert f"--out {path}: expected a folder, got a file; choose another name" in below.err


def test_a_number_of_modes_at_system_level(tmp_path: Path) -> None:
    call = fmbs(
        "reduce",
        SCENE,
        "--duration",
        "0.1",
        "--level",
        "system",
        "--modes",
        "8",
        "--hyper",
        "0",
        "--out",
        tmp_path,
    )
    assert call.code == 0, call.err
    assert files.load(tmp_path / "double_pendulum.h5").size == 8


def test_outputs_that_are_off_are_named(tmp_path: Path) -> None:
    """Four modes follow the tip of a shaken cantilever, and miss most of the force that its clamp
    has of the waves along it.
    """
    text = (
        CANTILEVER + "reduction: {{snapshots: 2 ms, modes: 4, hyper_reduction: {{sample: none}}}}\n"
    )
    path = scene(tmp_path, "{type: dynamic, duration: 0.1 s, step: 1 ms}", "sin(60*t)", text)
    call = fmbs("reduce", path, "--out", tmp_path / "model.h5", "--json")
    assert call.code == 0, call.err
    off = {name: one["relative"] for name, one in call.json["output_errors"].items()}
    assert off["tip_y"] < 0.1 < off["clamp_x"]
    told = next(
        line for line in call.json["notices"] if "gives outputs wrong over its own training" in line
    )
    assert "clamp_x is off by" in told
    assert "tip_y" not in told
    assert (
        told
        in fmbs("rom", "run", tmp_path / "model.h5", "--out", tmp_path / "run", "--json").json[
            "notices"
        ]
    )


@pytest.mark.parametrize(
    "options,told",
    [
        (("--tolerance", "1e-8", "--modes", "4"), "one of them"),
        (("--tolerance", "2"), "0 < eps < 1"),
        (("--hyper", "-1"), "0 <= eta < 1"),
    ],
)
def test_options_that_make_no_sense(options: tuple[str, ...], told: str, tmp_path: Path) -> None:
    call = fmbs("reduce", SCENE, *options, "--out", tmp_path / "model.h5")
    assert call.code == 3
    assert told in call.err


@pytest.mark.parametrize("command", ["reduce", "compare"])
def test_what_is_refused_leaves_no_folder(command: str, tmp_path: Path) -> None:
    """Neither a new one nor those above it; one that was there stays."""
    path = scene(tmp_path, "{type: dynamic, duration: 0.1 s, step: 1 ms}")
    (tmp_path / "there").mkdir()
    for out in ("new/inner", "there", "there/new"):
        assert fmbs(command, path, "--out", tmp_path / out).code == 3
    assert not (tmp_path / "new").exists()
    assert list((tmp_path / "there").iterdir()) == []


def test_a_scene_without_reduction_is_refused(tmp_path: Path) -> None:
    call = fmbs(
        "reduce",
        scene(tmp_path, "{type: dynamic, duration: 0.1 s, step: 1 ms}"),
        "--out",
        tmp_path / "model.h5",
    )
    assert call.code == 3
    assert "section 'reduction'" in call.err


def test_the_exact_polynomial_of_plates_is_saved_and_runs_alone(tmp_path: Path) -> None:
    path = tmp_path / "plates.h5"
    call = fmbs(
        "reduce",
        EXAMPLES / "crank_slider_coarse.yaml",
        "--duration",
        "0.003",
        "--sample",
        "exact",
        "--out",
        path,
        "--json",
    )
    assert call.code == 0, call.err
    assert call.json["hyper_reduction"] == "exact"
    assert call.json["snnls_s"] == {}
    assert 0 < call.json["coordinates_error"] < 1e-4
    assert 0 < call.json["max_error"] < 1e-3  # of the motion, which is small at the start
    motion = integrate(
        files.load(path), GeneralizedAlpha(call.json["step"], call.json["rho_inf"]), 0.001
    )
    assert len(motion.times) == 101


def test_beams_have_no_exact_polynomial(tmp_path: Path) -> None:
    call = fmbs(
        "reduce", SCENE, "--duration", "0.1", "--sample", "exact", "--out", tmp_path / "model.h5"
    )
    assert call.code == 3
    assert "take ECSW" in call.err


def test_an_invariant_basis_is_an_option(tmp_path: Path) -> None:
    found = fmbs(
        "reduce",
        SCENE,
        "--duration",
        "0.05",
        "--basis",
        "invariant",
        "--out",
        tmp_path / "model.h5",
        "--json",
    )
    assert found.code == 0, found.err
    assert found.json["modes"]["first"] % 3 == 0
    assert 0 < found.json["max_error"] < 1e-4
