"""`fmbs demo` on a short horizon: everything it promises is there."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from fmbs_skfem import studies
from fmbs_skfem.scenes import Scene, build, examples, read
from fmbs_skfem.studies import ReportTable, comparison, text_tables

from .calls import fmbs
from .test_provenance import KEYS


def short(scene: Scene) -> Scene:
    """The demo's scene with one competitor, a larger step, and few steps of time."""
    analysis = replace(build.dynamic(scene), duration=0.1, step=1e-3)
    compare = replace(scene.compare, coarse=[5], steps=[]) if scene.compare else None
    return replace(scene, analysis=analysis, compare=compare)


def test_the_scenes_travel_with_the_package() -> None:
    assert (examples.folder() / examples.DEMO).is_file()
    assert (examples.folder().parent / "meshes" / "double_pendulum_100.msh").is_file()


def test_examples_are_copied_with_their_meshes_and_run_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = fmbs("demo", "--copy")
    assert done.code == 0, done.err
    assert "fmbs check fmbs-examples/examples/double_pendulum.yaml" in done.out
    assert fmbs("check", "fmbs-examples/examples/four_bar.yaml").code == 0
    changed = tmp_path / "fmbs-examples" / "examples" / "four_bar.yaml"
    changed.write_text("mine")
    assert fmbs("demo", "--copy").code == 3
    assert changed.read_text() == "mine"
    assert fmbs("demo", "--copy", "--force").code == 0
    assert changed.read_text() != "mine"


def test_demo_computes_all_models_and_writes_all_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(comparison, "lean", short)
    shown = replace(comparison.DEMO_SHOWN, frames=3)
    monkeypatch.setattr(comparison, "DEMO_SHOWN", shown)
    done = fmbs("demo", "--json")
    assert done.code in (0, 7)
    names = [model["name"] for model in done.json["models"]]
    assert names == [
        *(
            "full",
            "system",
            "component",
            "system+ecsw",
            "component+ecsw",
            "component+ecsw-points",
            "ffrf",
            "coarse-5",
        ),
        *("accuracy 0.01", "accuracy 0.001"),
    ]
    errors = {model["name"]: model["true_error"] for model in done.json["models"]}
    assert errors["accuracy 0.01"] <= 1e-2
    assert errors["accuracy 0.001"] <= 1e-3
    assert errors["full"] > 0.0  # its own step errs
    assert re.fullmatch(r"\d+ cells a line and \d+ steps", done.json["truth"])
    times = {model["name"]: model["cpu_s"] for model in done.json["models"]}
    for wanted, name in done.json["cheapest"].items():
        good = [
            each for each, error in errors.items() if error is not None and error <= float(wanted)
        ]
        assert name == min(good, key=times.__getitem__)
    assert set(done.json["provenance"]) == KEYS
    out = tmp_path / "fmbs-demo"
    wanted = {
        "compare.json",
        "history_B.png",
        "history_C.png",
        "errors.png",
        "speed_error.png",
        "motion.pvd",
    }
    assert wanted <= {path.name for path in out.iterdir()}
    assert len(list((out / "motion").glob("*.vtu"))) == 3
    if done.code == 0:
        assert {*shown.names} <= {path.name for path in out.iterdir()}
    else:
        assert "apt-get install" in done.err


@pytest.mark.parametrize("tables", [False, True])
def test_demo_says_the_gist_in_twelve_lines_of_a_terminal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tables: bool
) -> None:
    """Full and best reduced model, the error of the step, pictures, the cheapest models; all tables
    where they are asked for.
    """
    scene = short(read(examples.folder() / examples.DEMO))
    assert scene.compare
    scene = replace(scene, compare=replace(scene.compare, steps=[2e-3]))
    monkeypatch.setattr(comparison, "demo_scene", lambda: scene)
    monkeypatch.setattr(comparison, "DEMO_SHOWN", None)
    monkeypatch.chdir(tmp_path)
    found = studies.demo(out="demo", tables=tables)
    shown = [
        item.text(80) if isinstance(item, ReportTable) else "\n".join(text_tables.fill(item, 80))
        for item in found.lines
    ]
    lines = "\n".join(
        item.removesuffix("\n") for item in shown
    ).splitlines()  # as a terminal shows them
    assert max(map(len, (line for line in lines if " " in line.strip()))) <= 80
    assert ("Largest errors of the outputs" in lines) == tables
    if not tables:
        assert len(lines) <= 12
        for words in (
            "full model",
            "reduced (component+ecsw",
            "error of the step, 0.001 s",
            "Pictures: demo",
        ):
            assert any(line.strip().startswith(words) for line in lines)
        assert [line.split(":")[0] for line in lines[-2:]] == ["  0.01", "  0.001"]
    assert "Cheapest model for each true error (of mesh, step and model, over the range):" in lines
