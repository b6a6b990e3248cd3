"""Sobol indices of functions whose indices are known."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.ranges import Parameter, Scale
from fmbs_skfem.families import sensitivity

BOX = [Parameter(name, -np.pi, np.pi) for name in "abc"]


def ishigami(x: np.ndarray) -> np.ndarray:
    """sin x1 + 7 sin^2 x2 + 0.1 x3^4 sin x1."""
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def test_indices_of_the_ishigami_function() -> None:
    """V1 = (1 + b pi^4/5)^2/2, V2 = a^2/8, V13 = b^2 pi^8 (1/18 - 1/50); Ishigami, Homma 1990,
    doi:10.1109/ISUMA.1990.151285.
    """
    a, b = 7.0, 0.1
    V1, V2, V13 = 0.5 * (1 + b * np.pi**4 / 5) ** 2, a**2 / 8, b**2 * np.pi**8 * (1 / 18 - 1 / 50)
    exact = np.array([V1, V2, 0.0]), np.array([V1 + V13, V2, V13])
    points = sensitivity.design(BOX, 4096, seed=3)
    found = sensitivity.indices(ishigami(points), 3)
    V = V1 + V2 + V13
    np.testing.assert_allclose(found.first, exact[0] / V, atol=0.01)
    np.testing.assert_allclose(found.total, exact[1] / V, atol=0.01)
    coarse = sensitivity.indices(ishigami(sensitivity.design(BOX, 256)), 3)
    assert (np.abs(coarse.first - exact[0] / V) < 4 * coarse.first_error + 1e-3).all()
    assert (coarse.first_error > found.first_error).all()


def test_the_scale_of_a_range_and_rows_that_failed() -> None:
    """log p of a logarithmic range is uniform: the sum of logarithms has equal indices; failed runs
    take their rows with them.
    """
    box = [Parameter("p", 1.0, 100.0, Scale.LOG), Parameter("q", 0.01, 1.0, Scale.LOG)]
    points = sensitivity.design(box, 512)
    values = np.log(points).sum(axis=1) + 1e6
    values[[3, 700]] = np.nan
    found = sensitivity.indices(values, 2)
    assert found.rows == 510
    np.testing.assert_allclose(found.first, 0.5, atol=0.02)
    np.testing.assert_allclose(found.total, 0.5, atol=0.02)
    assert np.isnan(sensitivity.indices(np.full(40, 3.0), 2).first).all()


@pytest.mark.parametrize("unit", [1e-20, 1.0, 1e20])
def test_indices_do_not_depend_on_the_unit(unit: float) -> None:
    """The same to round-off; what varies by round-off of the size of other components has none."""
    values = ishigami(sensitivity.design(BOX, 64))
    one, other = (
        sensitivity.indices(values, 3),
        sensitivity.indices(unit * values, 3, size=100.0 * unit),
    )
    np.testing.assert_allclose(other.first, one.first, rtol=1e-9)
    np.testing.assert_allclose(other.total_error, one.total_error, rtol=1e-9)
    assert np.isnan(sensitivity.indices(1e-17 * unit * values, 3, size=unit).first).all()


def test_what_is_no_design_is_refused() -> None:
    with pytest.raises(InputError, match="a multiple of 5 values"):
        sensitivity.indices(np.zeros(17), 3)
    with pytest.raises(InputError, match="at least 8 rows that ran, got 2"):
        sensitivity.indices(np.arange(10.0), 3)


def test_failures_that_stand_together_are_told() -> None:
    """y = a + b without the part a > 0.9: the share of a is 0.81 / 1.81 of what is left, 0.5 of the
    whole box.
    """
    box = [Parameter(name, 0.0, 1.0) for name in "ab"]
    points = sensitivity.design(box, 1024)
    values = points.sum(axis=1)
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        assert sensitivity.indices(values, 2).first == pytest.approx([0.5, 0.5], abs=0.02)
        sensitivity.indices(np.where(points[:, 0] > 0.995, np.nan, values), 2)
    with pytest.warns(
        Notice,
        match="the part of the ranges where samples ran: 193 of 1024 rows have samples that failed",
    ):
        found = sensitivity.indices(np.where(points[:, 0] > 0.9, np.nan, values), 2)
    assert found.rows == 831
    assert found.first[0] == pytest.approx(0.81 / 1.81, abs=0.02)
