"""`fmbs new`: a project that runs, from any example."""

from __future__ import annotations

from pathlib import Path

import pytest

from fmbs_skfem.scenes import examples

from .calls import fmbs


@pytest.mark.parametrize("like", examples.names())
def test_a_project_like_any_example_is_sound(like: str, tmp_path: Path) -> None:
    """It stands alone: no file outside of its folder is read."""
    done = fmbs("new", tmp_path / "mine", "--like", like, "--json")
    assert done.code == 0, done.err
    scene = tmp_path / "mine" / "mine.yaml"
    assert done.json["files"][0] == str(scene)
    text = scene.read_text(encoding="utf-8")
    assert "name: mine\n" in text
    assert "../" not in text
    assert all(Path(path).is_relative_to(tmp_path / "mine") for path in done.json["files"])


def test_a_new_pendulum_is_checked(tmp_path: Path) -> None:
    assert fmbs("new", tmp_path / "swing").code == 0
    assert fmbs("check", tmp_path / "swing" / "swing.yaml", "--strict").code == 0
    again = fmbs("new", tmp_path / "swing")
    assert (again.code, "expected a new folder, got one with swing.yaml" in again.err) == (3, True)
    assert fmbs("new", tmp_path / "swing", "--force").code == 0


def test_the_name_of_an_example_is_a_copy_of_it(tmp_path: Path) -> None:
    assert fmbs("new", tmp_path / "four_bar", "--json").json["like"] == "four_bar"
    assert fmbs("new", tmp_path / "mine", "--json").json["like"] == "double_pendulum"


def test_an_unknown_example_lists_those_there_are(tmp_path: Path) -> None:
    done = fmbs("new", tmp_path / "x", "--like", "double_pendulm")
    assert done.code == 2
    assert "double_pendulum" in done.err
