"""`fmbs compare` on example 2 over a tenth of a second, and its tables and figures from known
numbers.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fmbs_skfem import scenes
from fmbs_skfem.cli import common
from fmbs_skfem.reduction import reduced_models
from fmbs_skfem.studies import comparison, figures
from fmbs_skfem.studies.result import Result
from tests.cli.calls import EXAMPLES, ROOT, Call, fmbs, scene
from tests.cli.test_picture import RIGID
from tests.clocks import wind

SCENE = EXAMPLES / "double_pendulum.yaml"
MAIN = ("system", "component", "system+ecsw", "component+ecsw", "component+ecsw-points", "ffrf")


def both(*words: str | Path) -> tuple[Call, Call]:
    """What a command says with --json and as tables: the study runs once, and its result is shown
    twice.
    """
    found, perform = list[Result](), common.perform

    def once(function: Callable[[], Result], how: common.Call, bar: Any) -> int:
        def result() -> Result:
            found.append(found[0] if found else function())
            return found[0]

        return perform(result, how, bar)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(common, "perform", once)
        return fmbs(*words, "--json"), fmbs(*words)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("compare")


@pytest.fixture(scope="module")
def calls(folder: Path) -> tuple[Call, Call]:
    return both("compare", SCENE, "--quick", "--no-picture", "--duration", "0.1", "--out", folder)


@pytest.fixture(scope="module")
def call(calls: tuple[Call, Call]) -> Call:
    return calls[0]


@pytest.fixture(scope="module")
def table(calls: tuple[Call, Call]) -> Call:
    return calls[1]


def test_models_and_their_numbers(call: Call) -> None:
    assert call.code == 0, call.err
    found = {model["name"]: model for model in call.json["models"]}
    assert {
        "full",
        *MAIN,
        "coarse-5",
        "coarse-10",
        "coarse-20",
        "coarse-50",
        "step-1e-3",
        "step-2.5e-3",
    } == set(found)
    keys = (
        "name",
        "dofs",
        "modes",
        "elements",
        "points",
        "cpu_s",
        "wall_s",
        "kr_us",
        "snnls_s",
        "max_error",
        "mean_error",
        "position_error",
    )
    assert all(key in model for model in found.values() for key in keys)
    assert found["full"]["dofs"] == 1212
    assert found["full"]["max_error"] == 0.0
    assert (
        set(found["component+ecsw"]["modes"])
        == set(found["component+ecsw"]["snnls_s"])
        == {"first", "second"}
    )
    assert all(found[name]["max_error"] < 1e-3 for name in MAIN if name != "ffrf")
    assert found["coarse-50"]["position_error"] < found["coarse-5"]["position_error"]


def test_time_error_and_front_are_told(call: Call) -> None:
    found = call.json
    assert found["status"] == "ok"
    assert 0 < found["time_error"]["position"] < 1e-2
    assert f"Of {len(found['models'])} models" in found["front"]
    assert found["pays_after_runs"] is None or found["pays_after_runs"] > 0


def test_files_are_written(call: Call, folder: Path) -> None:
    for name in (
        "history_B.png",
        "history_C.png",
        "errors.png",
        "norms.png",
        "singular_values.png",
        "speed_error.png",
    ):
        assert (folder / name).read_bytes().startswith(b"\x89PNG"), name
    assert json.loads((folder / comparison.RECORD).read_text())["models"] == call.json["models"]


def test_tables_show_time_beside_error(table: Call) -> None:
    assert table.code == 0, table.err
    for text in (
        "Time beside error",
        "speed-up",
        "Largest errors of the outputs as parts of their ranges",
    ):
        assert text in table.out
    assert "Errors on the Pareto front are the largest distances" in " ".join(table.out.split())


def test_results_of_another_run_are_kept(call: Call, folder: Path) -> None:
    other = fmbs("compare", SCENE, "--quick", "--duration", "0.05", "--out", folder)
    assert other.code == 3
    assert "--force" in other.err


def test_a_scene_without_reduction_is_refused(tmp_path: Path) -> None:
    call = fmbs(
        "compare",
        scene(tmp_path, "{type: dynamic, duration: 0.1 s, step: 1 ms}"),
        "--out",
        tmp_path / "out",
    )
    assert call.code == 3
    assert "section 'reduction'" in call.err


@pytest.fixture(scope="module")
def plates(tmp_path_factory: pytest.TempPathFactory) -> tuple[Call, Call]:
    """Example 3 on coarse meshes over its first 2 ms, as JSON and as tables."""
    out = tmp_path_factory.mktemp("plates")
    with pytest.MonkeyPatch.context() as patch:
        wind(patch, reduced_models)
        return both(
            "compare",
            EXAMPLES / "crank_slider_coarse.yaml",
            "--quick",
            "--no-picture",
            "--duration",
            "0.002",
            "--out",
            out,
        )


def test_plates_have_exact_polynomials_and_a_choice(plates: tuple[Call, Call]) -> None:
    call = plates[0]
    assert call.code == 0, call.err
    found = {model["name"]: model for model in call.json["models"]}
    hyper = {
        f"{level}+{kind}"
        for level in ("system", "component")
        for kind in ("ecsw", "ecsw-points", "exact")
    }
    assert set(found) == {"full", "step-2e-5", *hyper}
    assert call.json["choice"] in hyper
    assert call.json["time_error"]["step"] == 1e-5
    assert 0.0 < call.json["outputs"]["crank_angle"]["final"] < 0.1
    assert found["full"]["newton"] == 4e-10
    assert found["component+exact"]["newton"] == 1e-13
    assert (
        found["component+exact"]["training_s"] == 3.0
    )  # for bases, hyper-reduction and model one look each
    assert all(found[name]["coordinates_error"] < 1e-4 for name in hyper)


def test_a_crank_slider_has_figures_11_and_12(plates: tuple[Call, Call]) -> None:
    """Displacement and speed in one figure, errors over time in another; other scenes have no
    slider.
    """
    files = {Path(name).name: Path(name) for name in plates[0].json["files"]}
    for name in ("slider.png", "errors.png"):
        assert files[name].read_bytes().startswith(b"\x89PNG"), name
    assert figures.slider_columns(scenes.read(EXAMPLES / "crank_slider.yaml")) == (
        "x",
        "x_C",
        "crank_speed",
    )
    assert figures.slider_columns(scenes.read(SCENE)) is None


def test_plates_have_a_choice_and_both_levels(plates: tuple[Call, Call]) -> None:
    call = plates[1]
    assert call.code == 0, call.err
    for text in (
        "Choice:",
        "Error of the full model's own step",
    ):
        assert text in call.out, text
    told = " ".join(call.out.split())
    assert "the time of one call, measured apart, times the calls counted" in told
    assert "System against component level at one eps" in told


def test_a_mechanism_of_rigid_bodies_is_compared(tmp_path: Path) -> None:
    """There are no tangents, cells and least squares to speak of; the tables and plots stand
    without them.
    """
    (tmp_path / "plate_linkage_coarse.msh").write_bytes(
        (ROOT / "meshes" / "plate_linkage_coarse.msh").read_bytes()
    )
    path = tmp_path / "rigid.yaml"
    path.write_text(
        RIGID
        + "reduction: {snapshots: 1 ms, tolerance: 1e-10, hyper_reduction: {tolerance: 1e-3, sample: points}}\n"
    )
    done = fmbs("compare", path, "--out", tmp_path / "out", "--no-picture")
    assert done.code == 0, done.err
    assert "component+ecsw-points" in done.out
