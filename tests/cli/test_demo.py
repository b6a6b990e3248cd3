"""`fmbs demo` on a short horizon: everything it promises is there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from fmbs_skfem.scenes import Scene, build
from fmbs_skfem.studies import comparison, projects

from .calls import fmbs
from .test_provenance import KEYS


def short(scene: Scene) -> Scene:
    """The demo's scene with one competitor, a larger step, and few steps of time."""
    analysis = replace(build.dynamic(scene), duration=0.1, step=1e-3)
    compare = replace(scene.compare, coarse=[5], steps=[]) if scene.compare else None
    return replace(scene, analysis=analysis, compare=compare)


def test_the_scenes_travel_with_the_package() -> None:
    assert (projects.folder() / projects.DEMO).is_file()
    assert (projects.folder().parent / "meshes" / "double_pendulum_100.msh").is_file()


def test_examples_are_copied_with_their_meshes_and_run_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_demo_computes_all_models_and_writes_all_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(comparison, "lean", short)
    shown = replace(comparison.DEMO_SHOWN, frames=3)
    monkeypatch.setattr(comparison, "DEMO_SHOWN", shown)
    done = fmbs("demo", "--json")
    assert done.code in (0, 7)
    names = [model["name"] for model in done.json["models"]]
    assert names == [
        *("full", "system", "component", "system+ecsw", "component+ecsw", "component+ecsw-points", "ffrf", "coarse-5"),
    ]
    assert set(done.json["provenance"]) == KEYS
    out = tmp_path / "fmbs-demo"
    wanted = {"compare.json", "history_B.png", "history_C.png", "errors.png", "speed_error.png", "motion.pvd"}
    assert wanted <= {path.name for path in out.iterdir()}
    assert len(list((out / "motion").glob("*.vtu"))) == 3
    if done.code == 0:
        assert {*shown.names} <= {path.name for path in out.iterdir()}
    else:
        assert "apt-get install" in done.err
