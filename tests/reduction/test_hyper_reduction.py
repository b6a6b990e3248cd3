"""Hyper-reductions as values of a plan: their names, and the recipe for one's own."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.reduction import NONE, Elements, Exact, Points
from fmbs_skfem.reduction.hyper import hyper_reduction
from tests import pages
from tests.cli.calls import EXAMPLES


@pytest.fixture
def known() -> Iterator[None]:
    """What is registered in a test is forgotten after it."""
    before = dict(hyper_reduction.KNOWN)
    yield
    hyper_reduction.KNOWN.clear()
    hyper_reduction.KNOWN.update(before)


def test_names_make_hyper_reductions() -> None:
    assert hyper_reduction.named("none", 1e-4) == NONE
    assert hyper_reduction.named("elements", 1e-4) == Elements(1e-4)
    assert hyper_reduction.named("points") == Points(hyper_reduction.USUAL)
    assert hyper_reduction.named("exact", 1e-4) == Exact()
    assert Exact().tolerance is None
    with pytest.raises(InputError, match=r"expected one of none, .*, got 'point'"):
        hyper_reduction.named("point")


def test_the_recipe_for_an_own_hyper_reduction_runs(known: None) -> None:
    """docs/own_hyper_reduction.md: short, and its code compares the model with the full one."""
    text = (pages.ROOT / "docs" / "own_hyper_reduction.md").read_text(encoding="utf-8")
    (code,) = pages.blocks("docs/own_hyper_reduction.md")
    assert len(text.splitlines()) < 70
    assert code.count("\n") < 60
    names = pages.run("docs/own_hyper_reduction.md", __name__=__name__)
    assert hyper_reduction.named("every other") == names["EveryOther"]()


FILE = """
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from fmbs_skfem.reduction import HyperReduction, Level, sampling
from fmbs_skfem.reduction.hyper_reduction import Rule, register


@register
@dataclass(frozen=True)
class EveryOther(HyperReduction):
    name: ClassVar[str] = "every other"
    label: ClassVar[str] = "every-other"
    tolerance: float = 1e-2

    def train(self, runs):
        return Rule(lambda system: replace(system, elastic=tuple(map(self.thinned, system.elastic))))

    def thinned(self, elastic):
        weights = np.zeros(sampling.count(elastic, Level.ELEMENTS))
        weights[1::2] = 2.0
        return sampling.weighted(elastic, weights, Level.ELEMENTS)
"""


def test_a_scene_takes_the_one_of_its_extension(known: None, tmp_path: Path) -> None:
    """The key `sample` is checked against what is registered when the scene is read."""
    text = (
        (EXAMPLES / "double_pendulum.yaml")
        .read_text(encoding="utf-8")
        .replace("../meshes", "meshes")
    )
    (tmp_path / "meshes").mkdir()
    (tmp_path / "every_other.py").write_text(FILE, encoding="utf-8")
    shutil.copy(EXAMPLES.parent / "meshes" / "double_pendulum_100.msh", tmp_path / "meshes")
    path = tmp_path / "own.yaml"
    path.write_text(text.replace("sample: elements", "sample: every other"), encoding="utf-8")
    with pytest.raises(
        InputError,
        match=r"sample: expected one of none, elements, points, exact, got 'every other'",
    ):
        scenes.read(path)
    path.write_text(
        "extensions: [every_other.py]\n" + path.read_text(encoding="utf-8"), encoding="utf-8"
    )
    found = studies.reduce(path, duration=0.02)
    assert (found.report["hyper_reduction"], found.report["hyper_tolerance"]) == (
        "every other",
        1e-3,
    )
    assert found.report["elements"] == {"first": 50, "second": 50}
    assert found.report["max_error"] < 1e-2
