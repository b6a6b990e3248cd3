"""The Python scripts of `examples` give the numbers of the scene files."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import pytest

from .calls import EXAMPLES, fmbs


def script(name: str) -> Callable[..., dict[str, float]]:
    """The function `main` of a script."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found: Callable[..., dict[str, float]] = module.main
    return found


def test_spin_up_is_its_scene(tmp_path: Path) -> None:
    found = script("spin_up")(duration=0.1)
    other = fmbs("run", EXAMPLES / "spin_up.yaml", "--json", "--out", tmp_path / "out", "--duration", "0.1", "--no-plots").json
    assert (found["dofs"], found["constraints"]) == (other["dofs"], other["constraints"]) == (404, 3)
    assert found["final_deflection"] == pytest.approx(other["outputs"]["tip_deflection"]["final"], abs=1e-9)
    assert found["final_deflection"] < -1e-6


def test_double_pendulum_is_its_scene_and_its_reduced_model_follows(tmp_path: Path) -> None:
    found = script("double_pendulum")(duration=0.2)
    other = fmbs(
        "run", EXAMPLES / "double_pendulum.yaml", "--json", "--out", tmp_path / "out", "--duration", "0.2", "--no-plots"
    ).json
    assert found["dofs"] == other["dofs"] == 1212
    assert [found[f"C_{axis}"] for axis in "xyz"] == pytest.approx(
        [other["outputs"][f"C_{axis}"]["final"] for axis in "xyz"], abs=1e-6
    )
    assert found["modes"] < 60
    assert found["max_error"] < 1e-4
