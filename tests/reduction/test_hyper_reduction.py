"""Hyper-reductions as values of a plan: their names, and the recipe for one's own."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.reduction import NONE, Elements, Exact, Points, hyper_reduction


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
    text = (Path(__file__).parents[2] / "docs" / "own_hyper_reduction.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(text.splitlines()) < 70
    assert code.count("\n") < 60
    names: dict[str, Any] = {"__name__": __name__}
    exec(compile(code, "own_hyper_reduction.md", "exec"), names)
    assert hyper_reduction.named("every other") == names["EveryOther"]()
