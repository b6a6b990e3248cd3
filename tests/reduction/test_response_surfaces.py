"""Response surfaces: smooth functions within the error they state, noise, constants, logarithmic
scales, files.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.values.ranges import Parameter, Scale
from fmbs_skfem.families import response_surfaces
from fmbs_skfem.reduction.parameters import sobol

BOX = (Parameter("E", 1e8, 1e10, Scale.LOG, "Pa"), Parameter("L", 0.5, 2.0, unit="m"))


def deflection(points: np.ndarray) -> np.ndarray:
    """F L^3 / (3 E I) of a cantilever."""
    return 1e6 * points[:, 1] ** 3 / points[:, 0]


@pytest.mark.parametrize("count", [40, 260])
def test_smooth_functions(count: int) -> None:
    """The error at new points is that which is stated, of samples left out or held out, and small;
    the deviation covers it.
    """
    surface = response_surfaces.fit(BOX, points := sobol(BOX, count, 1), np.log(deflection(points)))
    assert surface is not None
    fresh = sobol(BOX, 512, 7)
    mean, deviation = surface.predict(fresh)
    error = mean - np.log(deflection(fresh))
    assert np.sqrt(np.mean(error**2)) < 3.0 * surface.rms_error < 3e-2
    assert surface.q2 > 0.999
    assert np.mean(np.abs(error) <= 3.0 * deviation + 1e-9) > 0.9
    assert len(surface.values) == min(count, response_surfaces.MOST)
    assert surface.predict({"E": 1e9, "L": 1.0})[0] == pytest.approx(np.log(1e-3), abs=0.02)


def test_left_out_samples_one_by_one() -> None:
    """The errors stated are those of surfaces of one covariance that one sample after the other is
    left out of.
    """
    points = sobol(BOX, 12, 2)
    surface = response_surfaces.fit(BOX, points, np.log(deflection(points)))
    assert surface is not None
    process = surface.process
    K = process.covariance(process.points) + process.noise * np.eye(12)
    y = (surface.values - surface.values.mean()) / surface.values.std()
    for i, missed in enumerate(process.left_out()[0]):
        kept = np.arange(12) != i
        guess = K[i, kept] @ np.linalg.solve(K[np.ix_(kept, kept)], y[kept])
        assert missed == pytest.approx(surface.values.std() * (y[i] - guess), rel=1e-6, abs=1e-9)


def test_noise_is_no_surface() -> None:
    points = sobol(BOX, 64, 3)
    found = response_surfaces.fit(BOX, points, np.random.default_rng(1).normal(size=64))
    assert found is not None
    assert found.q2 < 0.3
    assert found.rms_error == pytest.approx(1.0, rel=0.3)


def test_failed_samples_constants_and_few_samples() -> None:
    points = sobol(BOX, 32, 4)
    values = np.log(deflection(points))
    values[::5] = np.nan
    found = response_surfaces.fit(BOX, points, values)
    assert found is not None
    assert len(found.values) == 25
    assert response_surfaces.fit(BOX, points, np.full(32, 3.0)) is None
    with pytest.raises(
        InputError, match="at least 7 samples that run, for 2 parameters, got 6; take more samples"
    ):
        response_surfaces.fit(BOX, points[:6], np.arange(6.0))


def test_files_predict_the_same(tmp_path: Path) -> None:
    surface = response_surfaces.fit(BOX, points := sobol(BOX, 20, 5), np.log(deflection(points)))
    assert surface is not None
    path = response_surfaces.write(tmp_path / "surfaces.json", {"tip": {"final": surface}})
    again = response_surfaces.read(path)["tip"]["final"]
    np.testing.assert_array_equal(again.predict(points[:5]), surface.predict(points[:5]))
    assert again.parameters == surface.parameters
    path.write_text("{}")
    with pytest.raises(InputError, match="response surfaces written by a sweep"):
        response_surfaces.read(path)
