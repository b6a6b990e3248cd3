"""Parameters: ranges on their scales, sets of points, names."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmbs_skfem.core.errors import InputError
from fmbs_skfem.reduction import parameters
from fmbs_skfem.reduction.parameters import Parameter, Scale

E = Parameter("E", 4e10, 7e10, unit="Pa", value=7e10)
D = Parameter("d", 1e-3, 1e-1, Scale.LOG)
BOTH = (E, D)


@given(st.lists(st.tuples(st.floats(-0.5, 1.5), st.floats(-0.5, 1.5)), min_size=1, max_size=5))
def test_the_box_and_back(unit: list[tuple[float, float]]) -> None:
    assert parameters.to_box(BOTH, parameters.from_box(BOTH, unit)) == pytest.approx(
        np.array(unit), abs=1e-14
    )


def test_scales_and_ends() -> None:
    assert parameters.from_box(BOTH, [[0, 0], [0.5, 0.5], [1, 1]]).tolist() == [
        [4e10, 1e-3],
        [5.5e10, pytest.approx(1e-2)],
        [7e10, 1e-1],
    ]
    assert (E.nominal, D.nominal) == (7e10, pytest.approx(math.sqrt(1e-3 * 1e-1)))
    assert Parameter("g", -2.0, 4.0).nominal == 1.0


@pytest.mark.parametrize(
    "values, message",
    [
        ((2.0, 1.0), "parameter 'p': expected a finite range, its lower end first, got 2 to 1"),
        ((1.0, 1.0), "got 1 to 1"),
        ((0.0, math.inf), "got 0 to inf"),
        ((math.nan, 1.0), "got nan to 1"),
        (
            (0.0, 1.0, Scale.LOG),
            "a positive range on a logarithmic scale, got 0 to 1; take a linear scale",
        ),
        ((1.0, 2.0, Scale.LINEAR, "", 3.0), "a nominal value from 1 to 2, got 3"),
    ],
)
def test_bad_ranges_are_refused(values: tuple[float, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Parameter("p", *values)  # type: ignore[arg-type]


def test_names_are_unique() -> None:
    for bad in ((), (E, E)):
        with pytest.raises(InputError, match="every name once"):
            parameters.check(bad)


def test_grids() -> None:
    points = parameters.grid(BOTH, (3, 2))
    expected = [[e, d] for e in (4e10, 5.5e10, 7e10) for d in (1e-3, 1e-1)]
    assert points == pytest.approx(np.array(expected), rel=1e-15)
    assert np.array_equal(parameters.grid(BOTH, {"d": 2, "E": 3}), points)
    assert parameters.grid((E,), 101)[:, 0] == pytest.approx(
        np.linspace(4e10, 7e10, 101), rel=1e-15
    )
    assert parameters.grid(BOTH, 1).tolist() == [[5.5e10, pytest.approx(1e-2)]]
    for counts in (0, (3,), (3, 0)):
        with pytest.raises(InputError, match="grid"):
            parameters.grid(BOTH, counts)
    with pytest.raises(InputError, match=r"none for d"):
        parameters.grid(BOTH, {"E": 3})


def test_one_point_in_every_slice() -> None:
    unit = parameters.to_box(BOTH, parameters.latin_hypercube(BOTH, 40, seed=3))
    for column in unit.T:
        assert sorted(np.floor(40 * column).astype(int)) == list(range(40))
    assert np.array_equal(
        parameters.latin_hypercube(BOTH, 40, seed=3), parameters.latin_hypercube(BOTH, 40, seed=3)
    )
    assert not np.array_equal(
        parameters.latin_hypercube(BOTH, 40, seed=3), parameters.latin_hypercube(BOTH, 40, seed=4)
    )


def test_sobol_sequences_go_on() -> None:
    six = tuple(Parameter(name, 0.0, 1.0) for name in "abcdef")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        points = parameters.sobol(six, 100, seed=5)
        assert np.array_equal(parameters.sobol(six, 37, seed=5), points[:37])
        assert parameters.sobol(six, 1).shape == (1, 6)
    # a net in base 2: every half of every range holds the same number of the first 64 points
    assert (np.floor(2 * points[:64]).sum(axis=0) == 32).all()
    with pytest.raises(InputError, match="a number of points from 1 on, got 0"):
        parameters.sobol(six, 0)


def test_lists() -> None:
    rows = [(5e10, 0.01), {"d": 0.02, "E": 6e10}, np.array([4e10, 0.1])]
    assert parameters.listed(BOTH, rows).tolist() == [[5e10, 0.01], [6e10, 0.02], [4e10, 0.1]]
    assert parameters.listed((E,), [40e9, 47.5e9]).tolist() == [[40e9], [47.5e9]]
    assert parameters.listed(BOTH, []).shape == (0, 2)
    for bad in ([(1.0,)], [(1.0, math.nan)]):
        with pytest.raises(InputError):
            parameters.listed(BOTH, bad)


def test_points_by_name() -> None:
    assert parameters.named(BOTH, [5e10, 0.01]) == {"E": 5e10, "d": 0.01}
    assert parameters.row_of(BOTH, {"d": 0.01, "E": 5e10}).tolist() == [5e10, 0.01]
    assert parameters.completed(BOTH, {"d": 0.02}) == {"E": 7e10, "d": 0.02}


@pytest.mark.parametrize(
    "values, message",
    [
        ({"E": 5e10}, "a value for each of E, d, got none for d"),
        ({"E": 5e10, "d": 0.01, "EE": 1.0}, "one of E, d, got 'EE'; did you mean 'E'?"),
        ({"E": math.inf, "d": 0.01}, "parameter 'E': expected a finite number, got inf"),
        ({"E": 5e10, "d": 0.0}, "parameter 'd': expected a positive number, got 0.0"),
        ({"E": "5e10", "d": 0.01}, "parameter 'E': expected a finite number, got '5e10'"),
    ],
)
def test_wrong_values_are_named(values: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message.replace("?", r"\?")):
        parameters.row_of(BOTH, values)


def test_values_outside_of_the_ranges() -> None:
    assert parameters.outside(BOTH, {"E": 4e10, "d": 0.1}) == ()
    assert parameters.outside(BOTH, {"E": 7.01e10, "d": 0.1}) == ("E",)
    assert parameters.outside(BOTH, {"E": 3.9e10, "d": 9e-4}) == ("E", "d")
    # values read from a decimal text are inside
    assert parameters.outside((Parameter("p", 0.1, 0.3),), {"p": 0.1 + 0.2}) == ()
