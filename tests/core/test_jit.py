"""The cache of compiled code: another folder after any change, notices, clean-up."""

from __future__ import annotations

import math
import os
import time
from pathlib import Path

import numpy as np
import pytest
from numba.core import config

from fmbs_skfem.core.compiling import jit as module
from fmbs_skfem.core.compiling.jit import cache_folder, jit, prepare, remove_old, stamp
from fmbs_skfem.core.compiling.kernels import MODULES
from fmbs_skfem.core.notices import Notice

INNER = ("a.py", "inner/b.py")


@pytest.fixture
def package(tmp_path: Path) -> Path:
    folder = tmp_path / "package"
    (folder / "inner").mkdir(parents=True)
    for name in INNER:
        write(folder / name, "import numba\n")
    return folder


def write(path: Path, text: str, age: float = 3600.0) -> None:
    path.write_text(text)
    os.utime(path, (module.BEGIN - age,) * 2)


def test_stamp_sees_every_change_of_a_text_and_nothing_else(package: Path) -> None:
    inner, first = package / "inner" / "b.py", stamp(package, INNER)
    write(inner, "import numba\n", age=7200.0)
    assert stamp(package, INNER) == first
    assert stamp(package.rename(package.with_name("elsewhere")), INNER) == first
    package.with_name("elsewhere").rename(package)
    write(inner, "import numbo\n")
    other = stamp(package, INNER)
    inner.rename(package / "b.py")
    moved = stamp(package, ("a.py", "b.py"))
    assert len({first, other, moved}) == 3


def test_code_of_a_text_that_changed_while_a_process_runs_is_its_own(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It may have imported the text before: under the hash of the new one, its code would be found
    by all later processes.
    """
    inner, first = package / "inner" / "b.py", stamp(package, INNER)
    monkeypatch.setattr(module, "BEGIN", time.time() - 1.0)
    os.utime(inner)
    assert stamp(package, INNER) != first
    os.utime(inner, (time.time() + 3600.0,) * 2)  # the clock of another machine
    assert stamp(package, INNER) == first


def test_the_list_of_modules_with_compiled_functions_is_complete() -> None:
    """The stamp reads these alone, since all of the package would take longer than a small model
    does.
    """
    marks = ("jit import", "structs import", "import numba", "from numba")
    package = Path(module.__file__).parents[2]
    texts = {
        path.relative_to(package).as_posix(): path.read_text(encoding="utf-8")
        for path in package.rglob("*.py")
        if path.parent.name != "printing"  # which reads compiled functions and has none
    }
    assert sorted(
        name for name, text in texts.items() if any(mark in text for mark in marks)
    ) == list(MODULES)


def test_stamp_depends_on_the_numba_version(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = stamp(package, INNER)
    monkeypatch.setattr(module.installed, "version", lambda name: "0.0.0")
    assert stamp(package, INNER) != first


def test_folders_without_use_for_30_days_are_removed(tmp_path: Path) -> None:
    old, recent = tmp_path / "old", tmp_path / "recent"
    for folder, days in ((old, 31.0), (recent, 29.0)):
        folder.mkdir()
        (folder / "advance.code").touch()
        os.utime(folder, (time.time() - 86400.0 * days,) * 2)
    folder = prepare(tmp_path)
    assert folder == tmp_path / stamp()
    assert not old.exists()
    assert recent.exists()
    os.utime(folder, (0.0, 0.0))
    remove_old(tmp_path, folder)
    assert folder.exists()
    prepare(tmp_path)
    assert time.time() - folder.stat().st_mtime < 3600.0


def test_without_a_writable_folder_code_is_compiled_without_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = tmp_path / "file"
    blocked.touch()
    with pytest.warns(Notice, match="not cached"):
        assert prepare(blocked) is None
    monkeypatch.setattr(module, "cache_folder", lambda: None)

    @jit
    def double(x: float) -> float:
        return 2.0 * x

    assert double(1.5) == 3.0
    assert double.whole.stats.cache_path is None


def test_the_users_folder_takes_precedence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert cache_folder.__wrapped__() == tmp_path / "fmbs_skfem" / stamp()


def test_the_cache_of_other_packages_is_left_alone() -> None:
    before = config.CACHE_DIR

    @jit
    def same(x: float) -> float:
        return x

    assert same(1.0) == 1.0
    assert before == config.CACHE_DIR
    assert Path(same.whole.stats.cache_path).is_relative_to(cache_folder())


def test_only_what_python_calls_becomes_a_function_of_its_own() -> None:
    """A function that another one calls is part of it: no code of its own, nothing on disk; Python
    may call it, too.
    """

    @jit
    def part(x: float) -> float:
        return 2.0 * x

    @jit
    def caller(x: float) -> float:
        return part(x) + 1.0

    assert caller(1.5) == 4.0
    assert "whole" not in part.__dict__
    overloads = part.contained.overloads.values()
    # what an earlier run of the tests has compiled is loaded without it
    compiled = [0] if caller.whole.stats.cache_misses else []
    assert [
        found.library.get_pointer_to_function(found.fndesc.llvm_func_name) for found in overloads
    ] == compiled
    assert part(1.5) == 3.0
    assert part(2) == 4


def test_divisions_by_zero_follow_ieee() -> None:
    @jit
    def quotient(x: float, y: float) -> float:
        return x / y

    assert quotient(1.0, 0.0) == math.inf
    assert np.isnan(quotient(0.0, 0.0))


def test_no_fastmath() -> None:
    @jit
    def lost(x: float, y: float) -> float:
        return (x + y) - x

    assert lost(1e16, 1.0) == 0.0
