"""The section `training`: designs, points and problems; which points they are."""

from __future__ import annotations

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.scenes import points
from fmbs_skfem.scenes.training_options import Grid, Listed, Spread, Training

SCENE = """\
schema: 1
dimension: 2
parameters: {{{parameters}}}
bodies:
  ball: {{type: point_mass, mass: 1 kg, position: [0, 0]}}
analysis: {{type: dynamic, duration: 1 s, step: 1 ms}}
reduction: {{snapshots: 10 ms}}
training: {{{training}}}
"""
ONE = "E: {range: [40 GPa, 70 GPa]}"
TWO = "E: {range: [40 GPa, 70 GPa]}, d: {range: [1 mm, 100 mm], scale: log}"


def text(parameters: str, training: str) -> str:
    return SCENE.format(parameters=parameters, training=training)


def section(parameters: str, training: str) -> Training:
    found = scenes.loads(text(parameters, training)).training
    assert found is not None
    return found


def test_defaults() -> None:
    found = section(ONE, "")
    assert (found.candidates, found.samples, found.first, found.holdout) == (
        Spread(101),
        Spread(5),
        None,
        None,
    )
    assert (found.iterations, found.max_samples, found.tolerance, found.seed) == (5, 15, None, 0)


def placed(parameters: str, training: str, holdout: int | None = None) -> points.Points:
    scene = scenes.loads(text(parameters, training))
    known, _ = scenes.family(scene)
    return points.of(points.section(scene), known, holdout)


def test_the_papers_run() -> None:
    """E in [40, 70] GPa, 101 candidates, first samples {40, 47.5, 55, 62.5, 70}, first full run 55
    GPa, errors at 26 values.
    """
    training = "candidates: 101, samples: [40 GPa, 47.5 GPa, 55 GPa, 62.5 GPa, 70 GPa], first: 55 GPa, max_samples: 15, holdout: 26"
    found = placed(ONE, training)
    np.testing.assert_allclose(found.candidates[:, 0], 40e9 + 0.3e9 * np.arange(101), rtol=1e-15)
    np.testing.assert_array_equal(found.samples[:, 0], [40e9, 47.5e9, 55e9, 62.5e9, 70e9])
    np.testing.assert_array_equal(found.first, [55e9])
    np.testing.assert_allclose(found.holdout[:, 0], 40e9 + 1.2e9 * np.arange(26), rtol=1e-15)


def test_a_number_of_samples_over_one_parameter_is_even() -> None:
    found = placed("T: {range: [5 N m, 15 N m]}", "samples: 5")
    np.testing.assert_allclose(found.samples[:, 0], [5.0, 7.5, 10.0, 12.5, 15.0], rtol=1e-15)
    assert np.isin(found.samples, found.candidates).all()
    assert found.first is None
    assert found.holdout.shape == (0, 1)
    assert len(placed("T: {range: [5 N m, 15 N m]}", "samples: 5, holdout: 3", 7).holdout) == 7


def test_listed_samples_stay_as_they_are_written() -> None:
    found = placed("T: {range: [5 N m, 15 N m]}", "candidates: 3, samples: [5 N m, 6 N m]")
    np.testing.assert_array_equal(found.candidates[:, 0], [5.0, 10.0, 15.0])
    np.testing.assert_array_equal(found.samples[:, 0], [5.0, 6.0])


def test_grid_and_points_over_two_parameters() -> None:
    found = section(
        TWO,
        "candidates: {d: 3, E: 2}, samples: [{d: 10 mm, E: 4.5e10}], first: {E: 50 GPa, d: 0.1}",
    )
    assert found.candidates == Grid((2, 3))
    assert found.samples == Listed(((45e9, 0.01),))
    assert found.first == (50e9, 0.1)
    cloud = placed(TWO, "candidates: {d: 3, E: 2}").candidates
    np.testing.assert_allclose(cloud[:, 0], np.repeat([40e9, 70e9], 3), rtol=1e-15)
    np.testing.assert_allclose(cloud[:, 1], np.tile([1e-3, 1e-2, 1e-1], 2), rtol=1e-14)


@pytest.mark.parametrize("design", ["sobol", "latin_hypercube"])
def test_named_designs_fill_the_box(design: str) -> None:
    """Both are stratified: half of 64 points lie in half of a range, on its own scale; the corners
    of the box come on top.
    """
    found = placed(
        TWO, f"candidates: {{design: {design}, count: 64}}, samples: 9, holdout: 16, seed: 3"
    )
    assert found.candidates.shape == (68, 2)
    assert (found.candidates >= [40e9, 1e-3]).all()
    assert (found.candidates <= [70e9, 1e-1]).all()
    corners = [[40e9, 1e-3], [40e9, 1e-1], [70e9, 1e-3], [70e9, 1e-1]]
    np.testing.assert_allclose(found.candidates[64:], corners, rtol=1e-14)
    assert np.count_nonzero(found.candidates[:, 0] < 55e9) == 34
    assert np.count_nonzero(found.candidates[:, 1] < 1e-2) == 34
    assert placed(TWO, f"candidates: {{design: {design}, count: 3}}").candidates.shape == (3, 2)
    rows = {tuple(row) for row in found.candidates}
    assert 1 < len({tuple(row) for row in found.samples} & rows) == len(found.samples) <= 9
    assert found.holdout.shape == (16, 2)
    assert not {tuple(row) for row in found.holdout} & rows


@pytest.mark.parametrize(
    ("parameters", "training", "message"),
    [
        (
            ONE,
            "candidates: 0",
            "scene:8: training.candidates: expected a number of points from 1 to 1000000, got 0",
        ),
        (ONE, "candidates: 1.5", "scene:8: training.candidates: expected a number of points"),
        (
            ONE,
            "candidates: []",
            "scene:8: training.candidates: expected a number of points, a grid, a design or a list",
        ),
        (
            ONE,
            "candidates: {e: 3}",
            "scene:8: training.candidates: expected the parameters with ranges E, got 'e'",
        ),
        (
            TWO,
            "candidates: {E: 3}",
            r"scene:8: training.candidates: expected all .* \(E, d\), got none for d",
        ),
        (
            TWO,
            "candidates: {design: sobl, count: 3}",
            "scene:8: training.candidates.design: .* got 'sobl'; did you mean 'sobol'",
        ),
        (
            TWO,
            "candidates: {design: sobol}",
            "scene:8: training.candidates.count: expected the key 'count', got no such key",
        ),
        (
            TWO,
            "samples: [40 GPa]",
            "scene:8: training.samples: expected a mapping of E, d and their values, got '40 GPa'",
        ),
        (
            ONE,
            "samples: [3 mm]",
            r"scene:8: training.samples: expected a pressure \[Pa\], got '3 mm'",
        ),
        (
            ONE,
            "first: 71 GPa",
            r"scene:8: training.first: expected E within its range of 4e\+10 to 7e\+10 Pa, got '71 GPa'",
        ),
        (ONE, "iterations: 0", "scene:8: training.iterations: expected a number >= 1, got 0"),
        (ONE, "tolerance: 2", "scene:8: training.tolerance: expected "),
        (ONE, "tolerence: 1e-4", "scene:8: training.tolerence: .* did you mean 'tolerance'"),
        (ONE, "seed: -1", "scene:8: training.seed: expected a number >= 0, got -1"),
        (
            "E: 40 GPa",
            "",
            "scene:8: training: expected parameters with ranges to train over, got none; give one a range",
        ),
        (
            "E: 40 GPa",
            "candidates: 3",
            "scene:8: training.candidates: expected parameters with ranges",
        ),
    ],
)
def test_refused_with_place(parameters: str, training: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        scenes.loads(text(parameters, training))


def test_training_needs_snapshots_and_a_motion() -> None:
    with pytest.raises(
        InputError,
        match="training: expected a section 'reduction' and a dynamic analysis, got none; add them",
    ):
        scenes.loads(text(ONE, "").replace("reduction: {snapshots: 10 ms}\n", ""))
    with pytest.raises(
        InputError,
        match="training: expected a section 'reduction' and a dynamic analysis, got analysis modes",
    ):
        scenes.loads(
            text(ONE, "").replace("{type: dynamic, duration: 1 s, step: 1 ms}", "{type: modes}")
        )


def test_a_scene_without_ranges_cannot_be_trained() -> None:
    with pytest.raises(
        InputError,
        match="scene: parameters: expected parameters with ranges to train over, got none",
    ):
        points.section(scenes.loads(text("E: 1 GPa", "").replace("training: {}\n", "")))
