"""Tables and figures of comparisons from known numbers."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path

import numpy as np
import paper
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.reduction.accuracy.comparison import Comparison, ModelRecord
from fmbs_skfem.studies import comparison, figures
from fmbs_skfem.studies.planning import truth
from tests.cli.calls import EXAMPLES


def test_published_products_follow_the_formula() -> None:
    """p = sum N (w r + r^2) of the source's own figures."""
    for model in paper.read_published()["double-pendulum"]["models"].values():
        assert model["p"] == sum(
            n * (model["w"] * r + r**2) for n, r in zip(model["dofs"], model["r"], strict=True)
        )


def test_wrong_models_do_not_hide_the_others() -> None:
    first = np.array([0.0, 1.0, 2.0])
    shown = figures.inside({"full": first, "wrong": np.array([0.5, 3.9, 4.1])})
    np.testing.assert_array_equal(shown["full"], first)
    np.testing.assert_array_equal(shown["wrong"], [0.5, 3.9, np.nan])
    # [m]; of a motion of 1 m the last is wrong altogether, of one of 1 km it is not
    errors = np.array([1e-16, 1e-4, 2e-4, 30.0])
    np.testing.assert_array_equal(figures.readable(errors, 1.0), [np.nan, 1e-4, 2e-4, np.nan])
    np.testing.assert_array_equal(figures.readable(errors, 1e3), [np.nan, 1e-4, 2e-4, 30.0])


def test_models_off_the_chart_are_named_above_it() -> None:
    """The report calls an error of 1 the size of the motion."""
    records = [ModelRecord("full", "full", cpu_s=1.0, max_error=0.0, position_error=0.0)]
    records += [ModelRecord("system", "system", cpu_s=0.1, max_error=1e-3, position_error=1e-3)]
    records += [ModelRecord("ffrf", "ffrf", cpu_s=0.1, max_error=1.2, position_error=1.2)]
    study = Comparison(tuple(records), None, {}, {}, {}, None)  # type: ignore[arg-type]
    figure = figures.cloud(scenes.read(EXAMPLES / "double_pendulum.yaml"), study)
    assert figure.get_suptitle() == "double-pendulum; off the chart (error > 100 %): ffrf"
    assert "floating frame" not in figure.axes[0].get_legend_handles_labels()[1]


def test_the_cheapest_model_of_every_error_is_named_full_ones_too() -> None:
    """By time and true error: a full model with an accuracy, a reduced one, a coarser mesh, the
    scene's own; or none.
    """
    rows = [
        ("full", "full", 1.6, 1e-5),
        ("coarse-20", "coarse", 0.4, 4e-5),
        ("component+ecsw", "component+ecsw", 0.14, 2e-4),
        ("accuracy 0.001", "chosen", 0.06, 8.1e-4),
        ("ffrf", "ffrf", 0.01, math.nan),
    ]
    records = tuple(
        ModelRecord(name, family, cpu_s=cpu, true_error=error) for name, family, cpu, error in rows
    )
    study = Comparison(records, None, {}, {}, {}, None, truth="36 cells a line")  # type: ignore[arg-type]
    wanted = (1e-2, 1e-3, 3e-4, 1e-4, 2e-5, 1e-6)
    found = comparison.cheapest_by_error(study, wanted)
    assert list(found.values()) == [
        "accuracy 0.001",
        "accuracy 0.001",
        "component+ecsw",
        "coarse-20",
        "full",
        None,
    ]
    report = {"models": [asdict(record) for record in records], "cheapest": found}
    head, *lines = comparison.cheapest_words(report)
    assert "true error" in head
    assert lines == [
        "  0.01: full model with accuracy 0.001, 0.06 s, error 8.1e-04",
        "  0.001: full model with accuracy 0.001, 0.06 s, error 8.1e-04",
        "  0.0003: reduced (component+ecsw), 0.14 s after training, error 2.0e-04",
        "  0.0001: full model (coarse-20), 0.4 s, error 4.0e-05",
        "  2e-05: full model of the scene, 1.6 s, error 1.0e-05",
        "  1e-06: none of these models",
    ]
    assert comparison.cheapest_words({"models": []}) == []


def test_a_slider_is_followed_along_its_guide(tmp_path: Path) -> None:
    """A guide along y, a position of all components, and one of another point before it."""
    text = (
        (EXAMPLES / "crank_slider_coarse.yaml")
        .read_text()
        .replace("direction: [1, 0]", "direction: [0, -1]")
    )
    outputs = "  b: {type: position, at: linkage.B}\n  c: {type: position, at: slider}\n"
    text = text.replace("  x_C: {type: position, at: linkage.C, component: x}\n", outputs)
    assert figures.slider_columns(scenes.loads(text, EXAMPLES)) == ("y", "c_y", "crank_speed")
    without = text.replace("  c: {type: position, at: slider}\n", "")
    assert figures.slider_columns(scenes.loads(without, EXAMPLES)) is None


def test_published_totals_hold_their_parts() -> None:
    """Table 4: force, solves and products are part of the total; coarse meshes are compared with
    the same figures.
    """
    for model in paper.read_published()["crank-slider"]["models"].values():
        assert model["force_s"] + model["solve_s"] + model.get("product_s", 0.0) < model["total_s"]


@pytest.mark.parametrize(
    ("order", "told"),
    [
        (None, "0.0004 m."),
        (1.98, "0.0004 m, observed order 1.98."),
        (
            1.02,
            "0.0004 m, observed order 1.02; below 2, so that a part of the motion is faster than the step resolves.",
        ),
    ],
)
def test_an_order_below_two_is_explained(order: float | None, told: str) -> None:
    found = {"step": 1e-3, "position": 4e-4, "order": order}
    assert comparison.time_words(found) == f"Error of the full model's own step 0.001 s: {told}"


def test_true_errors_need_lines_whose_cells_can_be_chosen() -> None:
    scene = scenes.read(EXAMPLES / "crank_slider_coarse.yaml")
    with pytest.raises(
        InputError, match="--true: expected lines whose cells can be chosen, got none"
    ):
        truth.find(scene)
