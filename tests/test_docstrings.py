"""Examples in docstrings of the package run, each by itself, from the folder of the project."""

from __future__ import annotations

import ast
import doctest
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "fmbs_skfem"
MODULES = [path for path in sorted(PACKAGE.rglob("*.py")) if ">>> " in path.read_text("utf-8")]
#: what a user meets first, by its module
FIRST = {
    "scenes/reading.py": ("read", "loads"),
    "scenes/build.py": ("system",),
    "shapes/meshes.py": ("read",),
    "shapes/plate_meshes.py": ("read",),
    "bodies/body.py": ("cable", "point_mass"),
    "bodies/plate.py": ("plate",),
    "bodies/rigid.py": ("rigid",),
    "systems/places.py": ("At",),
    "systems/assembly.py": ("assemble", "eliminate"),
    "dynamics/scheme.py": ("GeneralizedAlpha",),
    "dynamics/integration.py": ("integrate",),
    "dynamics/equilibria/statics.py": ("solve_statics",),
    "dynamics/outputs.py": ("outputs",),
    "dynamics/near_state/modes.py": ("vibration_modes",),
    "reduction/spaces/galerkin.py": ("snapshots", "reduce_system"),
    "control/live.py": ("start",),
    "control/environments.py": ("Plant",),
    "studies/commands.py": ("run", "check", "reduce", "sweep"),
}


def examples(path: Path) -> Iterator[doctest.DocTest]:
    """The examples of every docstring of a module, by the name of what it belongs to."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            text = ast.get_docstring(node) or ""
            name = getattr(node, "name", "")
            if ">>> " in text:
                line = node.body[0].lineno - 1
                yield doctest.DocTestParser().get_doctest(text, {}, name, str(path), line)


def test_what_a_user_meets_first_has_an_example() -> None:
    known = {(path, example.name) for path in FIRST for example in examples(PACKAGE / path)}
    assert {(path, name) for path, names in FIRST.items() for name in names} - known == set()


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_examples_of_docstrings_run(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    runner, told = doctest.DocTestRunner(verbose=False), list[str]()
    for example in examples(path):
        runner.run(example, out=told.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(told)
