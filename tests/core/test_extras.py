"""Without the packages of the extras everything else works, and what needs one says which line
installs it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from fmbs_skfem.core import extras
from fmbs_skfem.core.errors import MissingFeature

ROOT = Path(__file__).resolve().parents[2]
BARE = """
import sys
sys.path[:0] = sys.argv[1:3]
del sys.argv[1:3]
from fmbs_skfem.cli.main import main
main()
"""
WITHOUT = {"vtkmodules"}.union(*extras.PACKAGES.values())


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of installed packages without those of the extras."""
    folder, known = tmp_path_factory.mktemp("packages"), metadata.packages_distributions()
    projects = {name for package in WITHOUT for name in known.get(package, ())}  # that install them
    # however many there are
    places = (
        place for place in map(Path, sys.path) if place.is_dir() and any(place.glob("*.dist-info"))
    )
    for place in places:
        for entry in place.iterdir():
            project = entry.name.removesuffix(".dist-info").rpartition("-")[0].replace("_", "-")
            lost = entry.name.removesuffix(".py") in WITHOUT or project in projects
            if not lost and not (folder / entry.name).exists():
                (folder / entry.name).symlink_to(entry)
    return folder


def fmbs(packages: Path, *words: str | Path) -> subprocess.CompletedProcess[str]:
    """A command in an interpreter that sees these packages only."""
    call = [sys.executable, "-S", "-c", BARE, str(ROOT / "src"), str(packages), *map(str, words)]
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return subprocess.run(call, env=kept, capture_output=True, text=True)


def test_a_page_needs_no_extra_and_c_needs_symbols(packages: Path, tmp_path: Path) -> None:
    done = fmbs(
        packages,
        "view",
        ROOT / "examples" / "four_bar.yaml",
        "--duration",
        "0.02",
        "--html",
        tmp_path / "page.html",
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "page.html").is_file()
    part = ROOT / "examples" / "parts" / "link.part.h5"
    done = fmbs(packages, "rom", "export", part, "--c", tmp_path / "c")
    assert done.returncode == 7, done.stderr
    assert 'pip install "fmbs_skfem[symbols]"' in done.stderr


def test_a_run_has_its_numbers_without_plots(packages: Path, tmp_path: Path) -> None:
    done = fmbs(
        packages,
        "run",
        ROOT / "examples" / "four_bar.yaml",
        "--duration",
        "0.02",
        "--out",
        tmp_path / "out",
        "--json",
    )
    report = json.loads(done.stdout)
    assert (done.returncode, report["status"]) == (0, "ok")
    assert 'pip install "fmbs_skfem[viz]"' in " ".join(report["notices"])
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {"outputs.csv", "report.json"}
    assert not (tmp_path / "out" / "outputs.png").exists()


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        ("viz", ("render", "four_bar.yaml", "--duration", "0.02")),
        ("families", ("train", "pendulum_family.yaml")),
        ("symbols", ("check", "controlled_arm.yaml")),
        (
            "cluster",
            ("sweep", "pendulum_family.yaml", "--samples", "2", "--scheduler", "tcp://127.0.0.1:9"),
        ),
    ],
)
def test_commands_say_which_line_installs_what_they_need(
    packages: Path, tmp_path: Path, extra: str, words: tuple[str, ...]
) -> None:
    command, scene, *options = words
    where = [] if command == "check" else ["--out", tmp_path / "out"]
    done = fmbs(packages, command, ROOT / "examples" / scene, *options, *where)
    assert done.returncode == 7, done.stderr
    assert f'pip install "fmbs_skfem[{extra}]"' in done.stderr


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(extras.PACKAGES, "viz", ("matplotlib", "no_such_package"))
    with pytest.raises(
        MissingFeature,
        match=r'plots: expected .* `viz`, got no no_such_package; pip install "fmbs_skfem\[viz\]"',
    ):
        extras.need("viz", "plots")
    assert not extras.there("viz")
