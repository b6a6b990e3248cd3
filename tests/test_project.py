"""The project as a whole: format, types, floors, licences, set-up lines, what the wheel carries."""

from __future__ import annotations

import ast
import importlib.metadata
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement

from fmbs_skfem.core.extras import PACKAGES

ROOT = Path(__file__).resolve().parents[1]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
BIN = Path(sys.executable).parent


def passes(*command: str | Path, where: Path = ROOT, path: str | None = None) -> None:
    """Run a tool of this environment and show what it says where it fails."""
    environment = {**os.environ, **({} if path is None else {"PYTHONPATH": path})}
    done = subprocess.run(command, cwd=where, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr


def test_lint() -> None:
    passes(BIN / "ruff", "check", "--no-cache", ".")


def test_format() -> None:
    passes(BIN / "ruff", "format", "--no-cache", "--check", ".")


def test_types() -> None:
    passes(BIN / "mypy")


def test_floors() -> None:
    passes(BIN / "lint-imports", "--no-cache")


def test_floors_refuse_an_import_upwards(tmp_path: Path) -> None:
    """The contract of pyproject.toml on a copy of the package's folders, with one import that goes
    up.
    """
    package = tmp_path / "fmbs_skfem"
    contract = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"][
        "contracts"
    ][0]
    floors = [
        floor
        for layer in contract["layers"]
        for floor in layer.split(" | ")
        if floor[0] != "(" and floor != "wings"
    ]
    assert "scenes | results" in contract["layers"]
    for floor in floors:
        (package / floor).mkdir(parents=True)
        (package / floor / "__init__.py").touch()
    (package / "__init__.py").touch()
    (package / "wings.py").touch()
    (tmp_path / "pyproject.toml").write_bytes((ROOT / "pyproject.toml").read_bytes())
    command = (BIN / "lint-imports", "--no-cache")
    passes(*command, where=tmp_path, path=str(tmp_path))
    (package / "scenes" / "__init__.py").write_text("import fmbs_skfem.results\n")
    with pytest.raises(AssertionError, match=r"fmbs_skfem\.scenes -> fmbs_skfem\.results"):
        passes(*command, where=tmp_path, path=str(tmp_path))


def test_no_folder_has_more_than_25_files() -> None:
    folders = {path.parent for path in (ROOT / "src").rglob("*.py")}
    assert {str(one): many for one in folders if (many := len(list(one.glob("*.py")))) > 25} == {}


def test_pages_of_folders_name_files_that_are_there() -> None:
    package = ROOT / "src" / "fmbs_skfem"
    pages = [*package.glob("*/README.md"), ROOT / "docs" / "architecture.md"]
    assert len(pages) > 10
    for page in pages:
        named = re.findall(r"`([\w/]+\.py)`", page.read_text(encoding="utf-8"))
        assert [
            one
            for one in named
            if not any((base / one).exists() for base in (page.parent, package))
        ] == [], page


def is_gpl(licence: str) -> bool:
    """Whether a licence expression, classifier or name binds to the GPL; a choice without it and a
    linking exception do not.
    """
    terms = re.split(r"\bAND\b", licence)
    choices = [re.split(r"\bOR\b", term) for term in terms]
    strong = re.compile(r"(?<![A-Z])A?GPL|(?<!Lesser )General Public Licen[sc]e", re.IGNORECASE)
    return any(
        all(strong.search(name) and "exception" not in name for name in term) for term in choices
    )


def licences(package: str) -> list[str]:
    """What the metadata of an installed package says: expression, else classifiers, else the first
    line of the old field.
    """
    metadata = importlib.metadata.metadata(package)
    if expression := metadata.get("License-Expression"):
        return [expression]
    classifiers = [
        text for text in metadata.get_all("Classifier") or [] if text.startswith("License ::")
    ]
    return classifiers or (metadata.get("License") or "").splitlines()[:1]


def closure(requirements: Iterable[str]) -> set[str]:
    """Names of all packages that `requirements` bring along in this environment."""
    found: set[tuple[str, str]] = set()
    todo = [(Requirement(text), "") for text in requirements]
    while todo:
        requirement, extra = todo.pop()
        if requirement.marker and not requirement.marker.evaluate({"extra": extra}):
            continue
        for wanted in {"", *requirement.extras}:
            if (requirement.name, wanted) not in found:
                found.add((requirement.name, wanted))
                todo += [
                    (Requirement(text), wanted)
                    for text in importlib.metadata.requires(requirement.name) or []
                ]
    return {name for name, _ in found}


@pytest.mark.parametrize(
    ("licence", "expected"),
    [
        ("GPL-3.0-or-later", True),
        ("GPLv2+", True),
        ("AGPL-3.0-only", True),
        ("BSD-3-Clause AND GPL-2.0-only", True),
        ("License :: OSI Approved :: GNU General Public License v3 (GPLv3)", True),
        ("LGPL-3.0-or-later", False),
        ("License :: OSI Approved :: GNU Lesser General Public License v3 (LGPLv3)", False),
        ("MIT OR GPL-2.0-only", False),
        ("BSD-3-Clause AND GPL-3.0-or-later WITH GCC-exception-3.1", False),
        ("BSD-3-Clause AND 0BSD AND MIT AND Zlib AND CC0-1.0", False),
    ],
)
def test_gpl_is_recognised(licence: str, expected: bool) -> None:
    assert is_gpl(licence) is expected


def test_no_dependency_is_under_the_gpl() -> None:
    extras = PROJECT["optional-dependencies"]
    names = closure(
        [*PROJECT["dependencies"], *(each for name in PACKAGES for each in extras[name])]
    )
    assert {"numpy", "vtk", "llvmlite"} <= {name.replace("_", "-") for name in names}
    stated = {name: licences(name) for name in names}
    assert [name for name, texts in stated.items() if not texts] == []
    assert {name: texts for name, texts in stated.items() if any(map(is_gpl, texts))} == {}


def test_all_is_for_one_machine() -> None:
    extras = PROJECT["optional-dependencies"]
    (every,) = map(Requirement, extras["all"])
    names = {
        name.lower() for name in closure(text for extra in every.extras for text in extras[extra])
    }
    assert names >= {"pyvista", "sympy", "scikit-learn"}
    assert not names & set(PACKAGES["cluster"])


def imported(path: Path) -> set[str]:
    """First words of the absolute imports of a module, those inside functions too."""
    words: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            words |= {name.name.split(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            words.add(node.module.split(".")[0])
    return words


def test_every_third_party_import_is_declared() -> None:
    extras = [text for texts in PROJECT["optional-dependencies"].values() for text in texts]
    names = {
        Requirement(text).name.lower().replace("-", "_")
        for text in [*PROJECT["dependencies"], *extras]
    }
    modules = {"scikit_fem": "skfem", "scikit_learn": "sklearn", "ruamel.yaml": "ruamel"}
    brought = {"PIL", "vtk", "vtkmodules"}  # parts of pyvista, which cannot be without them
    known = (
        {modules.get(name, name) for name in names}
        | brought
        | {"fmbs_skfem", *sys.stdlib_module_names}
    )
    assert {
        (path.name, word)
        for path in (ROOT / "src").rglob("*.py")
        for word in imported(path) - known
    } == set()


def shell_lines(text: str) -> list[str]:
    """Contents of the shell blocks of a Markdown text."""
    return re.findall(r"^```sh\n(.*?)\n```", text, flags=re.DOTALL | re.MULTILINE)


def test_readme_sets_up_in_two_lines_and_ci_runs_the_second() -> None:
    demo, tests, *_ = shell_lines((ROOT / "README.md").read_text())
    assert demo.endswith("&& .venv/bin/fmbs demo")
    assert tests.endswith("&& .venv/bin/python -m pytest -n logical")
    for line in (demo, tests):
        assert "\n" not in line
        assert line.startswith("python3 -m venv .venv && .venv/bin/pip install -q ")
    ci = ROOT / ".ci" / "run"
    assert os.access(ci, os.X_OK)
    assert tests in ci.read_text().splitlines()
    assert (
        demo.removesuffix(".venv/bin/fmbs demo") in (ROOT / "docs" / "first_steps.md").read_text()
    )


def test_libraries_with_used_inner_parts_are_bounded() -> None:
    """Next releases of numba and llvmlite wait for the newest lane of `.ci/versions`, whose tests
    there are.
    """
    bounded = [
        one
        for text in PROJECT["dependencies"]
        if (one := Requirement(text)).name in ("numba", "llvmlite")
    ]
    assert len(bounded) == 2
    for one in bounded:
        assert any(bound.operator == "<" for bound in one.specifier), one
        assert importlib.metadata.version(one.name) in one.specifier
    script = ROOT / ".ci" / "versions"
    assert os.access(script, os.X_OK)
    named = re.findall(r"tests/\S+\.py", script.read_text())
    assert named
    assert all((ROOT / path).is_file() for path in named)


def test_versions_agree() -> None:
    assert f"version: {PROJECT['version']}" in (ROOT / "CITATION.cff").read_text().splitlines()
    assert importlib.metadata.version("fmbs_skfem") == PROJECT["version"]


def test_the_wheel_carries_types_licence_and_demo(tmp_path: Path) -> None:
    passes(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", tmp_path)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    shipped = [
        path.relative_to(ROOT)
        for folder in ("examples", "meshes")
        for path in (ROOT / folder).rglob("*")
        if path.is_file()
    ]
    data = {
        f"fmbs_skfem/_demo/{path.as_posix()}"
        for path in shipped
        if path.suffix in {".yaml", ".msh", ".vtu"}
    }
    assert "fmbs_skfem/_demo/examples/double_pendulum.yaml" in data
    assert data <= names
    assert {"fmbs_skfem/py.typed", "fmbs_skfem/core/compiling/lapack.py"} <= names
    assert any(name.endswith("licenses/LICENSE") for name in names)
    assert not any("verification" in name.split("/")[:2] for name in names)
    command = (sys.executable, "-P", "-m", "fmbs_skfem", "verify", "--list")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "there")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "there")}
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=environment)
    assert done.returncode == 7, done.stderr
    assert "clone the project" in done.stderr
