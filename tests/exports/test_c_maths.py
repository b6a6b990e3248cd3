"""Mathematics of C files, without a library, against that of numpy: errors in units of the last
place.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.special

from fmbs_skfem.core.compiling import curves
from fmbs_skfem.exports import text
from tests.exports.c_library import COMPILER, compiled

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")

ALONE = (
    "sqrt",
    "sin",
    "cos",
    "tan",
    "atan",
    "asin",
    "acos",
    "exp",
    "log",
    "sinh",
    "cosh",
    "tanh",
    "erf",
    "floor",
    "round",
)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    wrappers = [
        f"double own_{name}(double x);\ndouble own_{name}(double x) {{ return math_{name}(x); }}"
        for name in ALONE
    ]
    for name in ("atan2", "pow"):
        wrappers.append(
            f"double own_{name}(double x, double y);\ndouble own_{name}(double x, double y) {{ return math_{name}(x, y); }}"
        )
    whole = "\n".join(wrappers)
    found = compiled(tmp_path_factory.mktemp("maths"), [text.maths(whole) + whole], "maths")
    for name in (*ALONE, "atan2", "pow"):
        function = getattr(found, f"own_{name}")
        function.restype = ctypes.c_double
        function.argtypes = [ctypes.c_double] * (2 if name in ("atan2", "pow") else 1)
    return found


def units(found: np.ndarray, exact: np.ndarray) -> float:
    """Largest error in units of the last place."""
    return float(
        (np.abs(found - exact) / np.spacing(np.maximum(np.abs(exact), np.finfo(float).tiny))).max()
    )


RANGES: dict[str, tuple[float, Callable[[np.random.Generator], np.ndarray]]] = {
    "sqrt": (1.0, lambda rng: 10.0 ** rng.uniform(-307, 307, 20_000)),
    "sin": (2.0, lambda rng: rng.uniform(-8e5, 8e5, 20_000)),
    "cos": (2.0, lambda rng: rng.uniform(-8e5, 8e5, 20_000)),
    "tan": (4.0, lambda rng: rng.uniform(-10, 10, 20_000)),
    "atan": (2.0, lambda rng: rng.standard_cauchy(20_000)),
    "asin": (4.0, lambda rng: rng.uniform(-1, 1, 20_000)),
    "acos": (4.0, lambda rng: rng.uniform(-1, 1, 20_000)),
    "exp": (2.0, lambda rng: rng.uniform(-700, 700, 20_000)),
    "log": (2.0, lambda rng: 10.0 ** rng.uniform(-307, 307, 20_000)),
    "sinh": (4.0, lambda rng: rng.uniform(-20, 20, 20_000)),
    "cosh": (4.0, lambda rng: rng.uniform(-20, 20, 20_000)),
    "tanh": (4.0, lambda rng: rng.uniform(-20, 20, 20_000)),
    "erf": (24.0, lambda rng: rng.uniform(-6, 6, 20_000)),
    "floor": (0.0, lambda rng: rng.uniform(-1e6, 1e6, 20_000)),
}


@pytest.mark.parametrize("name", RANGES)
def test_functions_are_right_to_the_last_places(name: str, library: ctypes.CDLL) -> None:
    bound, draw = RANGES[name]
    x = draw(np.random.default_rng(1))
    known = {"asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "erf": scipy.special.erf}
    exact = (known.get(name) or getattr(np, name))(x)
    found = np.array([getattr(library, f"own_{name}")(one) for one in x])
    assert units(found, exact) <= bound


def test_arctangents_of_two_numbers_are_right_in_all_quarters(library: ctypes.CDLL) -> None:
    y, x = np.random.default_rng(2).standard_cauchy((2, 20_000))
    found = np.array([library.own_atan2(*one) for one in zip(y, x, strict=True)])
    assert units(found, np.arctan2(y, x)) <= 2.0
    for one in (
        (0.0, -1.0),
        (-0.0, -1.0),
        (0.0, 1.0),
        (1.0, 0.0),
        (-1.0, 0.0),
        (-0.0, 0.0),
        (0.0, -0.0),
    ):
        assert library.own_atan2(*one) == np.arctan2(*one)


def test_what_is_no_number_stays_none(library: ctypes.CDLL) -> None:
    assert np.isnan(
        [
            library.own_sqrt(-1.0),
            library.own_log(-1.0),
            library.own_sin(np.inf),
            library.own_exp(np.nan),
        ]
    ).all()
    assert [
        library.own_sqrt(0.0),
        library.own_exp(-1e4),
        library.own_exp(1e4),
        library.own_log(0.0),
    ] == [0.0, 0.0, np.inf, -np.inf]
    assert library.own_sqrt(np.inf) == np.inf
    assert [library.own_round(one) for one in (0.5, 1.5, 2.5, -0.5, 2.4999, 1e300)] == [
        0.0,
        2.0,
        2.0,
        0.0,
        2.0,
        1e300,
    ]


def test_curves_through_points_are_those_of_compiled_code(tmp_path: Path) -> None:
    """Inside, at a point, at both ends and beyond them."""
    places, pieces = np.array([0.0, 0.4, 1.5, 2.0]), np.random.default_rng(5).normal(size=(3, 4))
    T = np.concatenate([[0.0, 4.0], places, pieces.ravel()])
    names = "lookup", "lookup_slope"
    heads = [f"double own_{name}(double x, const double *T)" for name in names]
    wrappers = "\n".join(
        f"{head};\n{head} {{ return {name}(x, T); }}"
        for name, head in zip(names, heads, strict=True)
    )
    found = compiled(tmp_path, [text.maths(wrappers) + wrappers], "curves")
    for name in names:
        function, exact = getattr(found, f"own_{name}"), getattr(curves, name)
        function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double, ctypes.c_void_p]
        for x in (-1.0, 0.0, 0.2, 0.4, 1.0, 1.5, 1.7, 2.0, 3.0):
            assert function(x, T.ctypes.data) == pytest.approx(exact(x, T), rel=1e-14, abs=1e-14)


def test_powers(library: ctypes.CDLL) -> None:
    a, b = (
        np.random.default_rng(3).uniform(0.1, 10, 5000),
        np.random.default_rng(4).uniform(-5, 5, 5000),
    )
    found = np.array([library.own_pow(*one) for one in zip(a, b, strict=True)])
    np.testing.assert_allclose(found, a**b, rtol=1e-14)
    assert library.own_pow(-2.0, 3.0) == pytest.approx(-8.0, rel=1e-15)
