"""Calibration: coverage of the band on synthetic scatter, exact lines, one pair, limits of the
slope.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import linregress, t

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.families import calibration


def pairs(
    rng: np.random.Generator, count: int, slope: float, scatter: float
) -> tuple[np.ndarray, np.ndarray]:
    """Indicators over four decades and errors with a log-normal scatter about their line."""
    x = rng.uniform(-9.0, -5.0, count)
    return 10.0**x, 10.0 ** (1.5 + slope * (x + 7.0) + scatter * rng.standard_normal(count))


def holds(calibrated: calibration.Calibration, indicators: np.ndarray, errors: np.ndarray) -> float:
    """Part of the true errors (k,) that lie in their bands."""
    bands = [calibration.predict(calibrated, float(i))[1:] for i in indicators]
    return float(np.mean([low <= e <= high for (low, high), e in zip(bands, errors, strict=True)]))


@pytest.mark.parametrize("count", [3, 4, 5, 6])
@pytest.mark.parametrize("scatter", [0.15, 0.2, 0.3])
@pytest.mark.parametrize("slope", [0.9, 1.0, 1.1])
def test_the_band_holds_nine_of_ten_further_points(
    count: int, scatter: float, slope: float
) -> None:
    rng = np.random.default_rng(17)
    held = [
        holds(calibration.fit(*pairs(rng, count, slope, scatter)), *pairs(rng, 20, slope, scatter))
        for _ in range(200)
    ]
    assert np.mean(held) >= 0.9


def test_one_pair_gives_a_wide_band_that_says_so() -> None:
    rng = np.random.default_rng(3)
    found = [calibration.fit(*pairs(rng, 1, 1.0, 0.3)) for _ in range(200)]
    assert np.mean([holds(c, *pairs(rng, 20, 1.0, 0.3)) for c in found]) >= 0.9
    assert all(c.wide and c.slope == 1.0 for c in found)
    _, low, high = calibration.predict(found[0], 1e-7)
    assert high / low > 100.0
    many = calibration.fit(*pairs(rng, 6, 1.0, 0.15))
    assert not many.wide


def test_one_pair_knows_little_of_the_slope() -> None:
    """Indicators two decades above that of one full run, slopes two standard deviations about 1: at
    least nine of ten are held.
    """
    rng = np.random.default_rng(11)
    held = []
    for _ in range(400):
        slope, x = 1.0 + calibration.SLOPE * rng.standard_normal(), np.array([-11.0, -9.0])
        e = 10.0 ** (3.0 + slope * x + calibration.PRIOR * rng.standard_normal(2))
        held.append(holds(calibration.fit(10.0 ** x[:1], e[:1]), 10.0 ** x[1:], e[1:]))
    assert np.mean(held) >= 0.9
    one = calibration.fit([1e-11], [1e-6])
    widths = [calibration.half_width(one, i) for i in (1e-11, 1e-10, 1e-9)]
    away = [
        math.sqrt(2.0 * calibration.PRIOR**2 + (calibration.SLOPE * decades) ** 2)
        for decades in (0.0, 1.0, 2.0)
    ]
    assert widths == pytest.approx([t.ppf(0.975, calibration.BELIEF) * s for s in away], rel=1e-9)


@pytest.mark.parametrize(
    "at_the_run,elsewhere",
    [
        ((5.85e-12, 1.91e-6), (1.86e-10, 4.09e-6)),
        ((5.45e-12, 1.75e-6), (1.88e-10, 6.78e-6)),
        ((6.47e-12, 1.16e-6), (4.29e-10, 1.82e-5)),
    ],
)
def test_one_full_run_of_example_3_predicts_the_ends_of_its_range(
    at_the_run: tuple[float, float], elsewhere: tuple[float, float]
) -> None:
    """Own figures of Young's modulus 55 -> 40 GPa and of torques 10.5 -> 5 and 15 -> 5 N m on
    coarse meshes, eps = 1e-15.
    """
    one = calibration.fit(at_the_run[:1], at_the_run[1:])
    _, low, high = calibration.predict(one, elsewhere[0])
    assert low <= elsewhere[1] <= high


def test_the_line_is_that_of_least_squares_and_the_band_that_of_student(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without the expectation of a scatter, band and line are those of the textbook: Draper and
    Smith (1998), section 1.4.
    """
    monkeypatch.setattr(calibration, "BELIEF", 0)
    i, e = pairs(np.random.default_rng(5), 12, 1.05, 0.3)
    c, line = calibration.fit(i, e), linregress(np.log10(i), np.log10(e))
    assert (c.slope, c.offset) == pytest.approx((line.slope, line.intercept), rel=1e-10)
    x = np.log10(i)
    s = math.sqrt(np.sum((np.log10(e) - line.intercept - line.slope * x) ** 2) / 10)
    at = -4.0
    half = (
        t.ppf(0.975, 10)
        * s
        * math.sqrt(1 + 1 / 12 + (at - x.mean()) ** 2 / np.sum((x - x.mean()) ** 2))
    )
    middle, low, high = np.log10(calibration.predict(c, 10.0**at))
    assert (middle - low, high - middle) == pytest.approx((half, half), rel=1e-8)


def test_an_exact_line_is_found_and_its_band_stays_open() -> None:
    i = 10.0 ** np.array([-9.0, -8.0, -6.5, -5.0])
    c = calibration.fit(i, 30.0 * i**0.95)
    assert (c.slope, 10.0**c.offset) == pytest.approx((0.95, 30.0), rel=1e-9)
    error, low, high = calibration.predict(c, 1e-7)
    assert error == pytest.approx(30.0 * 1e-7**0.95, rel=1e-9)
    assert math.log10(high / low) >= 2.0 * calibration.NARROWEST


def test_no_band_is_narrower_than_the_least() -> None:
    i = np.logspace(-9.0, -3.0, 5000)
    _, low, high = calibration.predict(calibration.fit(i, 2.0 * i), 1e-6)
    assert math.log10(high / low) == pytest.approx(2.0 * calibration.NARROWEST, rel=1e-9)


@pytest.mark.parametrize("slope,expected", [(4.0, 1.5), (-1.0, 0.5), (1.2, 1.2)])
def test_the_slope_stays_sensible(slope: float, expected: float) -> None:
    i = 10.0 ** np.array([-8.0, -7.0, -6.0])
    assert calibration.fit(i, (i / 1e-7) ** slope * 1e-5).slope == pytest.approx(expected, rel=1e-9)


def test_no_slope_is_fitted_to_neighbours_or_to_two_pairs() -> None:
    assert calibration.fit([1e-7, 1.5e-7, 2e-7], [1e-5, 1e-4, 1e-6]).slope == 1.0
    two = calibration.fit([1e-9, 1e-5], [1e-7, 1e-2])
    assert (two.slope, two.offset) == (1.0, pytest.approx(2.5))


@settings(max_examples=50, deadline=None)
@given(
    count=st.integers(1, 8),
    seed=st.integers(0, 10**6),
    factor=st.floats(1e-6, 1e6),
    at=st.floats(-14.0, 0.0),
)
def test_units_of_the_indicator_do_not_matter(
    count: int, seed: int, factor: float, at: float
) -> None:
    i, e = pairs(np.random.default_rng(seed), count, 1.0, 0.2)
    one = calibration.predict(calibration.fit(i, e), 10.0**at)
    assert calibration.predict(calibration.fit(factor * i, e), factor * 10.0**at) == pytest.approx(
        one, rel=1e-6
    )
    assert one[1] < one[0] < one[2]


def test_the_band_widens_away_from_the_pairs() -> None:
    c = calibration.fit(*pairs(np.random.default_rng(8), 5, 1.0, 0.2))
    widths = [calibration.half_width(c, i) for i in (10.0**c.centre, 1e-3, 1e0)]
    assert widths == sorted(widths)
    assert widths[0] < widths[2]


def test_failed_runs_are_left_out_and_predicted_as_such() -> None:
    c = calibration.fit([1e-7, math.inf, 1e-6, math.nan, 0.0], [1e-5, 1e-3, math.inf, 1e-2, 1e-9])
    assert c.count == 1
    assert calibration.predict(c, math.inf) == (math.inf,) * 3
    assert calibration.predict(c, 0.0) == (0.0,) * 3


def test_bad_pairs_are_refused() -> None:
    for i, e in (([], []), ([1.0], [1.0, 2.0]), ([0.0, math.inf], [1.0, 1.0]), ([[1.0]], [[1.0]])):
        with pytest.raises(InputError, match=r"calibration\.fit"):
            calibration.fit(i, e)
    with pytest.raises(InputError, match="level"):
        calibration.fit([1.0], [1.0], level=1.0)
    with pytest.raises(InputError, match="predict"):
        calibration.predict(calibration.fit([1.0], [1.0]), -1.0)
