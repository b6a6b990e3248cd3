"""Tabulated basis functions, the verbs that a space of basis functions answers to, and the contract
they keep.

    r(xi_ep) = sum_b values[e, p, 0, b] c[nodes[e, b]],     int f dxi = sum_ep weights[e, p] f(xi_ep)

A space is a frozen struct; `breaks`, `tabulate`, `sample`, `fit`, `sample_field` and `reproduce`
are registered for its type, in `line` for the spaces of this package. `check_table` tests any
space, a user's own too.
"""

from __future__ import annotations

import math
import operator
from functools import partial, singledispatch
from typing import Any, NoReturn, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ..core import errors
from ..core.errors import InputError, say
from ..core.storage.container import storable
from ..core.storage.records import dataclass

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Curve(Protocol):
    """A curve or its derivative in the parameter: xi (x,) -> (x, c)."""

    def __call__(self, xi: Floats, derivative: int = 0, /) -> Floats: ...


@storable
@dataclass(frozen=True)
class Nodes:
    """The space of a body that comes as matrices: of each of its `count` functions a value is
    known, and nothing between them.
    """

    count: int


@dataclass(frozen=True, eq=False)
class BasisTable:
    """Basis functions and their derivatives at the quadrature points of every cell.

    values (e, p, k, b): derivative k of local function b: 0, 1, 2 in xi on lines; N, 1, 2, 11, 22,
    12 on surfaces nodes (e, b): the function's number in the space weights (e, p): quadrature
    weights in xi;  points (e, p), on surfaces (e, p, 2): the parameters xi count: number of
    functions of the space
    """

    values: Floats
    nodes: Ints
    weights: Floats
    points: Floats
    count: int

    def __post_init__(self) -> None:
        cells, points, _, functions = (
            self.values.shape if np.ndim(self.values) == 4 else (-1, -1, -1, -1)
        )
        shapes = {
            "nodes": (cells, functions),
            "weights": (cells, points),
            "points": (cells, points, *np.shape(self.points)[2:]),
        }
        for name, shape in shapes.items():
            if np.shape(getattr(self, name)) != shape:
                got = np.shape(getattr(self, name))
                remedy = "give arrays of the same cells and points"
                raise InputError(
                    say(
                        f"BasisTable.{name}",
                        f"shape {shape} to match values (e, p, k, b)",
                        got,
                        remedy,
                    )
                )


def matrix(table: BasisTable, derivative: int = 0) -> sparse.csr_array:
    """The table as one sparse array (e*p, count), rows cell by cell."""
    _, points, _, functions = table.values.shape
    return rows(
        table.values[:, :, derivative].reshape(-1, functions),
        table.nodes.repeat(points, axis=0),
        table.count,
    )


def rows(values: Floats, nodes: Ints, count: int) -> sparse.csr_array:
    """Values (x, b) of the functions nodes (x, b) as one sparse array (x, count), whose rows are
    sums where functions repeat.
    """
    indptr = np.arange(len(values) + 1) * values.shape[1]
    found = sparse.csr_array((values.ravel(), nodes.ravel(), indptr), shape=(len(values), count))
    found.sum_duplicates()
    return found


def quotient(numerators: Floats, denominators: Floats, orders: Ints) -> Floats:
    """Derivatives (x, k, b) of R = A / W from those of A (x, k, b) and of W (x, k), which are of
    these orders (k, axes).

        R^(a) = (A^(a) - sum_{0 <= b < a} binomial(a, b) W^(a - b) R^(b)) / W

    By the rule of Leibniz, order by order.
    """
    place = {tuple(order): k for k, order in enumerate(orders.tolist())}
    found = np.empty_like(numerators)
    for order, k in place.items():
        rest = numerators[:, k]
        for lower in (
            one
            for one in reversed(place)
            if one != order and all(b <= a for a, b in zip(order, one, strict=True))
        ):
            weight = (
                math.prod(map(math.comb, order, lower))
                * denominators[:, place[tuple(map(operator.sub, order, lower))]]
            )
            rest = rest - weight[:, None] * found[:, place[lower]]
        found[:, k] = rest / denominators[:, :1]
    return found


def _unknown(verb: str, space: object) -> NoReturn:
    remedy = f"register a rule with {verb}.register for your type"
    raise InputError(
        say(
            verb,
            "a space of basis functions such as line.BSpline or line.Hermite",
            type(space).__name__,
            remedy,
        )
    )


@singledispatch
def breaks(space: Any) -> Floats:
    """Parameters of the ends of the cells, (e+1,), increasing."""
    _unknown("breaks", space)


@singledispatch
def tabulate(space: Any, points: int = 4, derivatives: int = 2) -> BasisTable:
    """Basis functions and derivatives up to `derivatives`, zero beyond, at `points` Gauss points a
    cell, which are exact for polynomials of degree 2 points - 1 in xi.
    """
    _unknown("tabulate", space)


@singledispatch
def sample(space: Any, xi: ArrayLike, derivative: int = 0) -> sparse.csr_array:
    """Basis functions or their derivative 0, 1, 2 or 3 at the parameters xi (x,), as an array (x,
    b); from the right at a break.
    """
    _unknown("sample", space)


@singledispatch
def fit(space: Any, curve: Curve) -> Floats:
    """Coefficients (b, c) of a curve, exact when the curve lies in the space; the ends of the curve
    are kept.
    """
    _unknown("fit", space)


@singledispatch
def sample_field(space: Any) -> Floats:
    """Coefficients (b, 1 or 2) of the functions 1 and, where a closed form exists, xi."""
    _unknown("known", space)


@singledispatch
def reproduce(space: Any, xi: Floats, derivative: int = 0) -> Floats:
    """Functions (x, c) of xi that span a cell: the polynomials up to the degree, over the weight
    function in a rational space.
    """
    _unknown("reproduced", space)


def inside(where: str, xi: ArrayLike, low: float, high: float) -> Floats:
    """Parameters (x,) of the domain [low, high]; one that misses it by round-off (1e-12 of its
    length) is moved onto its end.

    InputError for others, and for an array of other than one axis.
    """
    array = np.atleast_1d(np.asarray(xi, dtype=float))
    slack = 1e-12 * (high - low)
    wrong = ~((array >= low - slack) & (array <= high + slack))
    if array.ndim != 1:
        raise InputError(
            say(where, "one-dimensional parameters", f"shape {array.shape}", "flatten them")
        )
    if wrong.any():
        raise InputError(
            say(
                where,
                f"parameters in [{low:g}, {high:g}]",
                array[wrong][0],
                "take them from the domain of the line",
            )
        )
    return np.clip(array, low, high)


@singledispatch
def check_table(space: Any, tolerance: float = 1e-9) -> None:
    """The contract of a space; raises an InputError (a ValueError) that names the first property
    that fails.

    Nodes in range; quadrature inside each cell, its weights positive and summing to the cell's
    length; the table equal to `sample`; partition of unity, and xi itself where its coefficients
    are known; `fit` reproduces what `reproduce` lists; derivatives 1, 2 and 3 against fourth-order
    differences, to the square root of the tolerance. Derivatives are scaled by the cell's length.
    """
    table = tabulate(space)
    _check_quadrature(space, table, tolerance)
    _check_sample(space, table, tolerance)
    _check_known(space, table, tolerance)
    _check_reproduction(space, table, tolerance)
    _check_derivatives(space, table, np.sqrt(tolerance))


def require(space: Any, name: str, error: float, tolerance: float) -> None:
    """Refuse an error of a space beyond the tolerance."""
    errors.require(f"check_table({type(space).__name__})", name, error, tolerance)


def _lengths(space: Any) -> Floats:
    return np.diff(breaks(space))


def _check_quadrature(space: Any, table: BasisTable, tolerance: float) -> None:
    ends = breaks(space)
    lengths = _lengths(space)
    outside = (table.nodes < 0) | (table.nodes >= table.count)
    require(space, "nodes in range (share outside)", float(outside.mean()), 0.0)
    apart = (
        (table.points <= ends[:-1, None])
        | (table.points >= ends[1:, None])
        | (table.weights <= 0.0)
    )
    require(
        space,
        "quadrature points inside their cells with positive weights (share that is not)",
        float(apart.mean()),
        0.0,
    )
    error = np.max(np.abs(table.weights.sum(axis=1) / lengths - 1.0))
    require(space, "quadrature weights sum to the cell's length", float(error), tolerance)


def _scaled(space: Any, table: BasisTable, rows: Any, power: int) -> float:
    """Largest entry of |rows| (e*p, ...) times (cell length)^power."""
    scale = np.repeat(_lengths(space), table.points.shape[1]) ** power
    return float(np.max(np.abs(sparse.diags_array(scale) @ rows)))


def _check_sample(space: Any, table: BasisTable, tolerance: float) -> None:
    for k in range(table.values.shape[2]):
        difference = matrix(table, k) - sample(space, table.points.ravel(), k)
        require(
            space,
            f"table equals sample, derivative {k}",
            _scaled(space, table, difference, k),
            tolerance,
        )


def _check_known(space: Any, table: BasisTable, tolerance: float) -> None:
    coefficients = sample_field(space)
    xi = table.points.ravel()
    names = ("partition of unity", "linear reproduction")
    size = float(np.max(np.abs(breaks(space))))
    for j, column in enumerate(coefficients.T):
        exact = ((np.ones_like(xi), 0.0 * xi, 0.0 * xi), (xi, np.ones_like(xi), 0.0 * xi))[j]
        for k in range(table.values.shape[2]):
            error = _scaled(space, table, matrix(table, k) @ column - exact[k], k)
            require(space, f"{names[j]}, derivative {k}", error / (1.0, size)[j], tolerance)


def _check_reproduction(space: Any, table: BasisTable, tolerance: float) -> None:
    coefficients = fit(space, partial(reproduce, space))
    for k in range(table.values.shape[2]):
        error = matrix(table, k) @ coefficients - reproduce(space, table.points.ravel(), k)
        require(
            space,
            f"polynomial reproduction, derivative {k}",
            _scaled(space, table, error, k),
            tolerance,
        )


def _check_derivatives(space: Any, table: BasisTable, tolerance: float) -> None:
    """First and second derivatives against f, the third against the second, over steps of 0.002
    cell lengths.
    """
    xi = table.points.ravel()
    step = 2e-3 * np.repeat(_lengths(space), table.points.shape[1])

    def difference(stencil: tuple[int, ...], order: int, of: int) -> Any:
        total = sum(
            weight * sample(space, xi + (i - 2) * step, of) for i, weight in enumerate(stencil)
        )
        return sparse.diags_array(1.0 / (12.0 * step**order)) @ total

    first = (1, -8, 0, 8, -1)
    second = (-1, 16, -30, 16, -1)
    for k, estimate in (
        (1, difference(first, 1, 0)),
        (2, difference(second, 2, 0)),
        (3, difference(first, 1, 2)),
    ):
        error = _scaled(space, table, sample(space, xi, k) - estimate, k)
        require(space, f"derivative {k} against differences", error, tolerance)
