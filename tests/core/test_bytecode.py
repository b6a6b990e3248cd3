"""Bytecode of the command where the environment forbids Python to write it, or the packages are
there for reading only.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fmbs_skfem.core import bytecode

ROOT = Path(__file__).resolve().parents[2]
PYC = f"main.{sys.implementation.cache_tag}.pyc"


def version(place: Path, cache: Path, *flags: str, **more: str) -> str:
    """What `fmbs --version` prints with the package at a place and a folder for caches, in an
    environment without bytecode.
    """
    given = {
        "PYTHONPATH": str(place),
        "PYTHONDONTWRITEBYTECODE": "1",
        "NUMBA_CACHE_DIR": str(cache),
        **more,
    }
    call = [sys.executable, *flags, "-m", "fmbs_skfem", "--version"]
    done = subprocess.run(
        call, env={**os.environ, **given}, cwd=place, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with a copy of the package that nobody has imported."""
    without = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "src" / "fmbs_skfem", tmp_path / "place" / "fmbs_skfem", ignore=without)
    return tmp_path / "place"


def test_the_command_keeps_bytecode_beside_its_kernels(place: Path, tmp_path: Path) -> None:
    """Also of a source that changes; nothing is written into the package."""
    cache = tmp_path / "cache"
    said = version(place, cache)
    (kept,) = (cache / "fmbs_skfem").glob(f"bytecode-*/**/cli/{PYC}")
    first = kept.stat().st_mtime_ns
    assert version(place, cache) == said
    assert kept.stat().st_mtime_ns == first
    source = place / "fmbs_skfem" / "cli" / "main.py"
    source.write_text(source.read_text().replace('prog_name="fmbs"', 'prog_name="changed"'))
    assert version(place, cache) == said.replace("fmbs", "changed")
    assert not list(place.rglob("*.pyc"))


def test_what_is_wanted_otherwise_stays(place: Path, tmp_path: Path) -> None:
    """A folder of the user's own, and no bytecode at all; where the cache cannot be written nothing
    changes either.
    """
    own = tmp_path / "own"
    said = version(place, tmp_path / "cache", PYTHONPYCACHEPREFIX=str(own))
    assert version(place, tmp_path / "cache", "-B", PYTHONDONTWRITEBYTECODE="") == said
    (tmp_path / "file").write_text("no folder")
    assert version(place, tmp_path / "file") == said
    assert not list(tmp_path.rglob("*.pyc"))


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package on the path, as the one by which `keep` decides; the settings of this process are
    restored.
    """
    folder = tmp_path / "a_package_of_tests"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(bytecode, "WITNESSES", (folder.name,))
    monkeypatch.setattr(sys, "pycache_prefix", None)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv(bytecode.FORBIDS, "1")
    monkeypatch.setenv(bytecode.PREFIX, "")
    return folder


def test_children_profit(package: Path, tmp_path: Path) -> None:
    bytecode.keep()
    assert not sys.dont_write_bytecode
    assert sys.pycache_prefix == os.environ[bytecode.PREFIX]
    assert Path(os.environ[bytecode.PREFIX]).parent == tmp_path / "cache" / "fmbs_skfem"
    assert bytecode.FORBIDS not in os.environ


def test_bytecode_that_is_there_is_not_moved(package: Path) -> None:
    kept = package / "__pycache__" / f"__init__.{sys.implementation.cache_tag}.pyc"
    kept.parent.mkdir()
    kept.write_bytes(b"")
    bytecode.keep()
    assert sys.pycache_prefix is None


def test_an_install_for_reading_only_has_bytecode_elsewhere(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that can be written is left to Python."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    monkeypatch.delenv(bytecode.FORBIDS)
    bytecode.keep()
    assert sys.pycache_prefix is None
    allowed = os.access
    monkeypatch.setattr(
        os, "access", lambda path, mode: not package.is_relative_to(path) and allowed(path, mode)
    )
    bytecode.keep()
    assert sys.pycache_prefix is not None


def test_nothing_is_written_to_a_full_disk(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bytecode, "room", lambda folder: 1e6)
    bytecode.keep()
    assert sys.pycache_prefix is None
    assert sys.dont_write_bytecode
