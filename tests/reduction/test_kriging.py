"""Kriging: published test functions, expected gain, hard samples, silence of the library behind it."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm, qmc

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.families import kriging


def forrester(x: np.ndarray) -> np.ndarray:
    """(6x - 2)^2 sin(12x - 4): smallest value -6.020740 at x = 0.757249.

    A. Forrester, A. Sobester, A. Keane, Engineering Design via Surrogate Modelling, Wiley 2008, doi
    10.1002/9780470770801.
    """
    return (6.0 * x[:, 0] - 2.0) ** 2 * np.sin(12.0 * x[:, 0] - 4.0)


def branin(x: np.ndarray) -> np.ndarray:
    """Branin's function of the unit square: three smallest values 0.397887, see Jones, Schonlau,
    Welch (1998), section 6.
    """
    a, b = 15.0 * x[:, 0] - 5.0, 15.0 * x[:, 1]
    return (
        (b - 5.1 / (4.0 * np.pi**2) * a**2 + 5.0 / np.pi * a - 6.0) ** 2
        + 10.0 * (1.0 - 1.0 / (8.0 * np.pi)) * np.cos(a)
        + 10.0
    )


def design(count: int, dimension: int, seed: int) -> np.ndarray:
    return qmc.LatinHypercube(dimension, rng=seed).random(count)


def column(*values: float) -> np.ndarray:
    return np.array(values, dtype=np.float64)[:, None]


def test_the_published_minima_are_those_of_the_functions_here() -> None:
    assert forrester(column(0.757249))[0] == pytest.approx(-6.020740, abs=1e-6)
    best = np.array([[(np.pi + 5.0) / 15.0, 2.275 / 15.0], [(-np.pi + 5.0) / 15.0, 12.275 / 15.0]])
    assert branin(best) == pytest.approx(0.397887, abs=1e-6)


def holdout_error(function: object, points: np.ndarray, others: np.ndarray, unit: float) -> float:
    """Largest error of the mean at `others` over the range of the function; log10 of the samples is
    the function over `unit`.
    """
    exact = function(others) / unit  # type: ignore[operator]
    mean, _ = kriging.predict(kriging.fit(points, 10.0 ** (function(points) / unit)), others)  # type: ignore[operator]
    return float(np.abs(mean - exact).max() / np.ptp(exact))


def test_errors_fall_with_the_samples_forrester() -> None:
    others = np.linspace(0.0, 1.0, 501)[:, None]
    errors = [
        holdout_error(forrester, np.linspace(0.0, 1.0, k)[:, None], others, 1.0)
        for k in (5, 9, 17, 25)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.005
    assert (
        np.log(errors[1] / errors[3]) / np.log(3.0) > 2.0
    )  # order of convergence, 5/2 in the native space of the kernel


def test_errors_fall_with_the_samples_branin() -> None:
    others = qmc.Sobol(2, rng=1).random(512)
    errors = [
        holdout_error(branin, qmc.Sobol(2, rng=2).random(k), others, 50.0) for k in (8, 16, 32, 128)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.01


def added_until(
    value: np.ndarray, x: np.ndarray, start: list[int], wanted: np.ndarray, most: int
) -> int:
    """Number of samples after which one of the wanted candidates is among them."""
    found = list(start)
    while not wanted[found].any() and len(found) < most:
        best = kriging.likely_maximum(kriging.fit(x[found], value[found]), x)
        if best in found:
            return most
        found.append(best)
    return len(found)


def test_expected_gain_finds_the_minimum_of_forrester() -> None:
    x = np.linspace(0.0, 1.0, 1001)[:, None]
    near = np.abs(x[:, 0] - 0.757249) < 2e-3
    assert added_until(10.0 ** -forrester(x), x, [0, 333, 667, 1000], near, 15) < 15


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_expected_gain_finds_a_minimum_of_branin(seed: int) -> None:
    """Within 0.05 decades after 28 samples, of which 21 are the first; Jones, Schonlau, Welch
    (1998) need 28 for 1 %.
    """
    x = np.vstack([design(21, 2, seed), qmc.Sobol(2, rng=3).random(4096)])
    value = 10.0 ** (-branin(x) / 50.0)
    assert added_until(value, x, list(range(21)), value >= value.max() * 10**-0.05, 29) <= 28


def test_the_mean_follows_the_samples_where_they_are_smooth() -> None:
    x = np.linspace(0.0, 1.0, 9)[:, None]
    y = -6.0 + np.sin(3.0 * x[:, 0])
    surrogate = kriging.fit(x, 10.0**y)
    mean, std = kriging.predict(surrogate, x)
    assert mean == pytest.approx(y, abs=1e-3)
    assert std.max() < 5e-3
    assert surrogate.roughness < 5e-3


def test_roughness_is_not_interpolated() -> None:
    """A line with a scatter of 0.1 decades: the surrogate is the line, and says how large the
    scatter is.
    """
    x = np.linspace(0.0, 1.0, 41)[:, None]
    line = -6.0 - 1.5 * x[:, 0]
    surrogate = kriging.fit(x, 10.0 ** (line + 0.1 * np.random.default_rng(5).standard_normal(41)))
    mean, _ = kriging.predict(surrogate, x)
    assert np.abs(mean - line).max() < 0.08
    assert surrogate.roughness == pytest.approx(0.1, rel=0.3)


def test_expected_gain_is_its_integral() -> None:
    surrogate = kriging.fit(column(0.0, 0.4, 1.0), [1e-5, 3e-4, 1e-5])
    at = column(0.55, 0.7, 0.9)
    mean, std = kriging.predict(surrogate, at)
    best = kriging.predict(surrogate, surrogate.points)[0].max()
    for m, s, g in zip(mean, std, kriging.gain(surrogate, at), strict=True):
        exact = quad(
            lambda z, m=m, s=s: (z - best) * norm.pdf(z, m, s),
            best,
            best + 12.0 * s + abs(m - best),
        )[0]
        assert g == pytest.approx(exact, rel=1e-6)


def test_a_parameter_without_influence_has_the_longest_length() -> None:
    x = design(20, 2, 6)
    surrogate = kriging.fit(x, 10.0 ** (-5.0 + np.sin(4.0 * x[:, 0])))
    assert surrogate.lengths[1] > 10.0 * surrogate.lengths[0]
    apart = np.array([[0.3, 0.0], [0.3, 1.0]])
    assert np.ptp(kriging.predict(surrogate, apart)[0]) < 0.01


def test_ten_decades() -> None:
    x = np.linspace(0.0, 1.0, 11)[:, None]
    surrogate = kriging.fit(x, 10.0 ** (-12.0 + 10.0 * x[:, 0]))
    assert kriging.predict(surrogate, column(0.05, 0.55))[0] == pytest.approx(
        [-11.5, -6.5], abs=0.02
    )


def test_constant_values_promise_nothing() -> None:
    surrogate = kriging.fit(column(0.0, 0.3, 1.0), [2e-6, 2e-6, 2e-6])
    grid = np.linspace(0.0, 1.0, 101)[:, None]
    mean, std = kriging.predict(surrogate, grid)
    assert mean == pytest.approx(np.log10(2e-6), abs=1e-9)
    assert std.max() < 0.06
    assert kriging.gain(surrogate, grid).max() < 0.05


def test_one_sample_says_how_little_is_known() -> None:
    surrogate = kriging.fit([[0.5, 0.5]], [1e-4])
    mean, std = kriging.predict(surrogate, [[0.5, 0.5], [0.0, 1.0]])
    assert mean[0] == pytest.approx(-4.0, abs=1e-9)
    assert std[0] < 0.05
    assert std[1] > 0.5


def test_equal_points_are_averaged() -> None:
    twice = kriging.fit(column(0.2, 0.8, 0.2), [1e-6, 1e-3, 1e-4])
    once = kriging.fit(column(0.2, 0.8), [1e-5, 1e-3])
    at = column(0.0, 0.2, 0.5, 1.0)
    assert np.array_equal(kriging.predict(twice, at), kriging.predict(once, at))


def test_nearly_equal_points_are_no_obstacle() -> None:
    surrogate = kriging.fit(
        column(0.2, 0.2 + 1e-13, 0.2 + 2e-13, 0.9), [1e-6, 1.1e-6, 0.9e-6, 1e-4]
    )
    assert kriging.predict(surrogate, column(0.2))[0] == pytest.approx([-6.0], abs=0.1)


@pytest.mark.parametrize("bad", [np.inf, np.nan])
def test_failed_runs_are_worse_than_all_others(bad: float) -> None:
    x = column(0.0, 0.25, 0.5, 0.75, 1.0)
    surrogate = kriging.fit(x, [1e-6, 2e-6, 5e-6, 1e-5, bad])
    assert int(np.argmax(surrogate.values)) == 4
    assert int(np.argmax(kriging.predict(surrogate, x)[0])) == 4
    assert kriging.fit(x, [bad] * 5).values == pytest.approx(1.0)


def test_zeros_are_better_than_all_others() -> None:
    surrogate = kriging.fit(column(0.0, 0.5, 1.0), [0.0, 1e-9, 1e-8])
    assert surrogate.values == pytest.approx([-10.0, -9.0, -8.0])
    assert kriging.fit(column(0.0, 1.0), [0.0, 0.0]).values == pytest.approx(-1.0)


def test_a_likely_maximum_has_a_least_gain() -> None:
    x = np.linspace(0.0, 1.0, 201)[:, None]
    surrogate = kriging.fit(
        column(0.0, 0.25, 0.5, 0.75, 1.0), 10.0 ** np.array([-6.0, -5.0, -6.0, -5.0, -6.0])
    )
    best = kriging.likely_maximum(surrogate, x)
    assert best is not None
    assert best == np.argmax(kriging.gain(surrogate, x))
    assert kriging.likely_maximum(surrogate, x, least=1e3) is None


def test_the_same_seed_gives_the_same_surrogate() -> None:
    x = design(12, 3, 8)
    y = 10.0 ** (-4.0 + x @ [1.0, -0.5, 0.1])
    one, two = (kriging.predict(kriging.fit(x, y, seed=7), x) for _ in range(2))
    assert np.array_equal(one, two)


def test_the_library_behind_it_is_silent() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for values in ([1e-6, 1e-6, 1e-6], [1e-9, 1e-2, 1e-5], [np.inf, 1e-5, 0.0]):
            surrogate = kriging.fit([[0.0, 0.1], [0.5, 0.9], [1.0, 0.4]], values)
            kriging.likely_maximum(surrogate, design(50, 2, 1))


@pytest.mark.parametrize(
    "points,values",
    [
        ([[0.0], [1.0]], [1.0]),
        ([[0.0], [1.0]], [1.0, -1.0]),
        ([[0.0], [np.nan]], [1.0, 1.0]),
        ([0.0, 1.0], [1.0, 1.0]),
        ([[0.0], [1.0]], [[1.0], [1.0]]),
    ],
)
def test_bad_samples_are_refused(points: list[object], values: list[object]) -> None:
    with pytest.raises(InputError, match=r"kriging\.fit"):
        kriging.fit(points, values)


def test_the_deviation_is_held_against_every_sample_left_out() -> None:
    """The factor is that of processes of one kernel from which one sample after the other is left
    out, computed one by one.
    """
    points = design(9, 2, 3)
    found = kriging.fit(points, 10.0 ** (branin(points) / 100.0))
    K, y, missed = (
        found.covariance(found.points) + found.noise * np.eye(9),
        (found.values - found.mean) / found.scale,
        [],
    )
    for k in range(9):
        rest = np.delete(np.arange(9), k)
        weights = np.linalg.solve(K[np.ix_(rest, rest)], K[rest, k])
        missed.append((y[k] - weights @ y[rest]) / np.sqrt(K[k, k] - weights @ K[rest, k]))
    factor = max(1.0, float(np.sqrt(np.mean(np.square(missed)))))
    others = design(5, 2, 4)
    expected = factor * np.hypot(kriging.predict(found, others)[1], found.roughness)
    assert kriging.deviation(found, others) == pytest.approx(expected, rel=1e-6)
