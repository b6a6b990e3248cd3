"""`fmbs warm` compiles by name, once, and says what stopped it."""

from __future__ import annotations

import ctypes
import multiprocessing
from pathlib import Path

import pytest
from numba import types

from fmbs_skfem import studies
from fmbs_skfem.core.compiling import compilation, jit
from fmbs_skfem.core.errors import MissingFeature
from fmbs_skfem.scenes import examples
from fmbs_skfem.studies import Listener
from fmbs_skfem.studies.running import warming


def double(x: float) -> float:
    return 2.0 * x


def test_a_compilation_is_heard_by_name_and_only_where_nothing_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path)
    heard = list[str]()
    for expected in (["test_warming.double"], []):
        jit.kept.cache_clear()
        with compilation.heard_by(heard.append):
            found = jit.addressed(types.float64(types.float64), double)
        assert ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(found.address)(3.0) == 6.0
        assert heard == expected
        heard.clear()
    jit.kept.cache_clear()


def test_warm_takes_steps_of_every_kind(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise MissingFeature("an extra is not there")

    kinds = [warming.KINDS[0], warming.Warmed("of an extra", "spin_up.yaml", refuse)]
    monkeypatch.setattr(warming, "KINDS", kinds)
    shown = list[tuple[str, float]]()
    found = studies.warm(listener=Listener(lambda label, part: shown.append((label, part))))
    assert [row["outcome"] for row in found.report["kinds"]] == [
        "ok",
        "left out: an extra is not there",
    ]
    assert ("compiling beams in the plane", 0.0) in shown
    assert found.report["functions"] == sum(row["functions"] for row in found.report["kinds"])


@pytest.mark.parametrize("kind", warming.KINDS, ids=lambda kind: kind.name)
def test_the_scenes_of_warm_travel_with_the_package(kind: warming.Warmed) -> None:
    assert (examples.folder() / kind.scene).is_file()


def test_a_script_without_listeners_hears_once_that_it_compiles(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Python shows the log on stderr. Who listens hears it alone, and helpers that a process starts
    say nothing.
    """
    monkeypatch.setattr(compilation, "_BEGUN", set())
    with compilation.heard_by(lambda name: None):
        compilation.begin("work.survey")
    assert not caplog.messages
    for parent, said in ((multiprocessing.current_process(), 0), (None, 1)):
        monkeypatch.setattr(compilation, "_BEGUN", set())
        monkeypatch.setattr(multiprocessing, "parent_process", lambda parent=parent: parent)
        for name in ("work.survey", "stepping.advance"):
            compilation.begin(name)
        assert [one.count("compiling work.survey") for one in caplog.messages] == [1] * said
    caplog.clear()
    job = studies.Job()
    for name in (
        "law_12.own_force",
        "law_12.own_slopes",
        "work.survey",
        "law_34.own_force",
        "stepping.advance",
    ):
        job.hear_compilation(name)
    assert caplog.messages[0].startswith("compiling expressions of this model")
    assert [one.count("compiling work.survey") for one in caplog.messages] == [0, 1]
