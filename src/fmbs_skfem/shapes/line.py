"""Spaces of basis functions on a line: B-splines, NURBS, and the cubic Hermite functions of the
ANCF cable.

    r(xi) = sum_b R_b(xi) c_b,    R_b = w_b N_b / W,  W = sum_b w_b N_b

N_b are B-splines of the knot vector (`knotvector.basis`), w_b the weights of a NURBS, 1 otherwise.
Piegl and Tiller, The NURBS Book, 2nd ed., doi:10.1007/978-3-642-59223-2.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable
from typing import Any, TypeGuard, TypeVar

import numpy as np
from numpy.polynomial import legendre, polynomial
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.linalg import splu

from ..core.errors import InputError, say
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from . import knotvector
from . import table as tables
from .table import (
    BasisTable,
    Curve,
    Floats,
    Ints,
    breaks,
    fit,
    inside,
    reproduce,
    sample,
    sample_field,
    tabulate,
)

S = TypeVar("S", bound="Keeping")
Found = TypeVar("Found")
# what a space of 100 cells keeps takes some 0.2 MB; half and twice of it take half and twice of
# that
SHARED = 100  #: cells up to which equal spaces are one
KEPT = "kept"  #: where a space remembers what follows from it

__all__ = [
    "BSpline",
    "Hermite",
    "uniform",
    "breaks",
    "tabulate",
    "sample",
    "fit",
    "sample_field",
    "reproduce",
    "insert_knots",
    "elevate",
    "hermite_to_bspline",
    "REGISTRY",
]


class Keeping:
    """A space that keeps what follows from it: it never changes, and bodies of one mesh ask the
    same several times.
    """

    def keep(self: S, name: Hashable, make: Callable[[S], Found]) -> Found:
        """What `make` finds of the space, once. Nobody writes to it; copies and pickles are made of
        the fields alone.
        """
        known: dict[Hashable, Any] = self.__dict__.setdefault(KEPT, {})
        if name not in known:
            known[name] = make(self)
        found: Found = known[name]
        return found

    def __getstate__(self) -> dict[str, Any]:
        return {key: value for key, value in self.__dict__.items() if key != KEPT}


@storable
@dataclass(frozen=True, eq=False)
class BSpline(Keeping):
    """B-splines of a knot vector; NURBS when `weights` (b,) are given. The domain is
    [knots[degree], knots[-degree-1]].
    """

    degree: int
    knots: Floats
    weights: Floats | None = None

    def __post_init__(self) -> None:
        _check_degree("BSpline.degree", self.degree)
        object.__setattr__(self, "knots", knotvector.freeze("BSpline.knots", self.knots))
        knotvector.check(self.degree, self.knots)
        if self.weights is not None:
            object.__setattr__(self, "weights", knotvector.freeze("BSpline.weights", self.weights))
            knotvector.check_weights(self.weights, self.count)

    @property
    def count(self) -> int:
        """Number of basis functions."""
        return len(self.knots) - self.degree - 1


@storable
@dataclass(frozen=True, eq=False)
class Hermite(Keeping):
    """Cubic Hermite functions: function 2i carries the position of node i, 2i+1 its slope dr/dxi.

        1 - 3 u^2 + 2 u^3,  h (u - 2 u^2 + u^3),  3 u^2 - 2 u^3,  h (u^3 - u^2)    u from 0 to 1 in a cell of the length h

    The gradient-deficient ANCF cable: Gerstmayr and Shabana, Nonlinear Dynamics 45 (2006),
    doi:10.1007/s11071-006-1856-1.
    """

    breaks: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "breaks", knotvector.increasing("Hermite.breaks", self.breaks))

    @property
    def count(self) -> int:
        """Number of basis functions."""
        return 2 * len(self.breaks)


def uniform(cells: int | ArrayLike, degree: int = 3, continuity: int = 1) -> BSpline:
    """Open B-splines of the given continuity over `cells` equal cells of [0, 1], or over the given
    breakpoints (e+1,).

    InputError for no cells, breakpoints that do not rise, and a continuity that the degree does not
    have.
    """
    whole = isinstance(cells, int | np.integer)
    if np.ndim(cells) == 0 and not (whole and cells >= 1):  # type: ignore[operator]
        raise InputError(
            say(
                "uniform.cells",
                "a whole number of at least 1, or breakpoints",
                cells,
                "20 suit a slender beam",
            )
        )
    ends = (
        np.linspace(0.0, 1.0, int(cells) + 1)  # type: ignore[arg-type]
        if whole
        else knotvector.increasing("uniform.breaks", cells)
    )
    _check_degree("uniform.degree", degree)
    if not isinstance(continuity, int | np.integer) or not 0 <= continuity < degree:
        raise InputError(
            say(
                "uniform.continuity",
                f"a whole number from 0 to degree - 1 = {degree - 1}",
                continuity,
                "raise the degree",
            )
        )
    if len(ends) - 1 > SHARED:
        return _uniform(ends.tobytes(), int(degree), int(continuity))
    return shared(ends.tobytes(), int(degree), int(continuity))


def _uniform(ends: bytes, degree: int, continuity: int) -> BSpline:
    breaks = np.frombuffer(ends)
    times = np.full(len(breaks), degree - continuity)
    times[[0, -1]] = degree + 1
    return BSpline(degree, np.repeat(breaks, times))


# bodies over equal cells have one space, and what it keeps
shared = functools.lru_cache(maxsize=64)(_uniform)


def _check_degree(where: str, degree: int) -> None:
    if not isinstance(degree, int | np.integer) or degree < 1:
        raise InputError(say(where, "a whole number of at least 1", degree, "3 suits beams"))


# -------------------------------------------------------------------------------------------------------- cells, tables
@breaks.register
def _(space: BSpline) -> Floats:
    return space.keep("breaks", _breaks)


def _breaks(space: BSpline) -> Floats:
    return frozen(np.unique(space.knots[space.degree : len(space.knots) - space.degree]))


@breaks.register
def _(space: Hermite) -> Floats:
    return space.breaks


def is_smooth(space: BSpline | Hermite) -> TypeGuard[BSpline]:
    """Whether a line is of B-splines without weights that are as smooth at every break as their
    degree allows, C^(degree - 1).
    """
    return (
        isinstance(space, BSpline)
        and space.weights is None
        and space.count == len(breaks(space)) - 1 + space.degree
    )


def functions(space: BSpline | Hermite) -> Ints:
    """The functions (e, b) that live on every cell, read-only; they have neighbouring numbers."""
    return space.keep("functions", _functions)


def _functions(space: BSpline | Hermite) -> Ints:
    if isinstance(space, Hermite):
        return frozen(2 * np.arange(len(space.breaks) - 1)[:, None] + np.arange(4))
    domain = space.knots[space.degree : len(space.knots) - space.degree]
    return frozen(np.flatnonzero(domain[:-1] < domain[1:])[:, None] + np.arange(space.degree + 1))


def frozen(array: Any) -> Any:
    """The array, read-only."""
    array.setflags(write=False)
    return array


_gauss = functools.cache(legendre.leggauss)  # takes as long as a table of a few cells


@tabulate.register(BSpline)
@tabulate.register(Hermite)
def _(space: BSpline | Hermite, points: int = 4, derivatives: int = 2) -> BasisTable:
    """Gauss table with the derivatives up to the given one; those beyond are zero."""
    if not isinstance(points, int | np.integer) or points < 1:
        raise InputError(
            say(
                "tabulate.points",
                "a whole number of at least 1",
                points,
                "4 points are exact for cubic cables",
            )
        )
    ends = breaks(space)
    half = np.diff(ends)[:, None] / 2.0
    sites, gauss = _gauss(int(points))
    xi = (ends[:-1] + ends[1:])[:, None] / 2.0 + half * sites
    nodes = functions(space)
    values = np.zeros((len(nodes), points, 3, nodes.shape[1]))
    found = in_cells(space, np.repeat(np.arange(len(nodes)), points), xi.ravel(), derivatives)
    values[:, :, : derivatives + 1] = found.reshape(len(nodes), points, -1, nodes.shape[1])
    return BasisTable(values, nodes, half * gauss, xi, space.count)


def gauss_table(space: BSpline | Hermite, points: int, derivatives: int) -> BasisTable:
    """The table of `tabulate`, read-only: bodies over one space share it."""

    def make(space: BSpline | Hermite) -> BasisTable:
        table = tabulate(space, points, derivatives)
        for array in (table.values, table.weights, table.points):
            frozen(array)
        return table

    return space.keep(("table", points, derivatives), make)


# ---------------------------------------------------------------------------------------------------------- evaluation
def in_cells(
    space: BSpline | Hermite,
    cell: Ints,
    xi: Floats,
    derivatives: int = 0,
    start: Floats | float = 0.0,
) -> Floats:
    """Functions of the cells (x,) and their derivatives (x, k, b), in a cell and beyond; `xi` (x,)
    counts from `start`.
    """
    if isinstance(space, Hermite):
        splines = in_cells(uniform(space.breaks), cell, xi, derivatives, start).reshape(
            len(xi), -1, 2, 2
        )
        change = _changes(space.breaks)[cell[:, None] + np.arange(2)][:, None]
        found = splines[..., :1] * change[..., 0, :] + splines[..., 1:] * change[..., 1, :]
        return np.asarray(found.reshape(len(xi), -1, 4))
    nodes = functions(space)[cell]
    found = knotvector.basis(space.degree, space.knots, nodes[:, -1], xi, derivatives, start)
    if space.weights is None:
        return found
    found *= space.weights[nodes][:, None]
    return tables.quotient(found, found.sum(axis=2), np.arange(derivatives + 1)[:, None])


@sample.register(BSpline)
@sample.register(Hermite)
def _(space: BSpline | Hermite, xi: ArrayLike, derivative: int = 0) -> sparse.csr_array:
    if derivative not in (0, 1, 2, 3):
        raise InputError(
            say(
                "sample.derivative",
                "0, 1, 2 or 3",
                derivative,
                "fit another line to the third derivative",
            )
        )
    ends = breaks(space)
    where = inside("sample", xi, ends[0], ends[-1])
    cell = np.clip(np.searchsorted(ends, where, side="right") - 1, 0, len(ends) - 2)
    found = tables.rows(
        in_cells(space, cell, where, derivative)[:, derivative], functions(space)[cell], space.count
    )
    found.eliminate_zeros()
    return found


# ------------------------------------------------------------------------------------------------------- reproduction
@sample_field.register
def _(space: BSpline) -> Floats:
    one = np.ones(space.count)
    return (
        one[:, None]
        if space.weights is not None
        else np.stack([one, knotvector.averages(space.degree, space.knots)], axis=1)
    )


@sample_field.register
def _(space: Hermite) -> Floats:
    one = np.tile([1.0, 0.0], len(space.breaks))
    xi = np.ones(space.count)
    xi[::2] = space.breaks
    return np.stack([one, xi], axis=1)


@reproduce.register
def _(space: BSpline, xi: Floats, derivative: int = 0) -> Floats:
    from scipy.interpolate import BSpline as SciPySpline

    low, high = breaks(space)[[0, -1]]
    powers = [_powers(xi, space.degree, low, high, d) for d in range(derivative + 1)]
    if space.weights is None:
        return powers[derivative]
    weight = SciPySpline(space.knots, space.weights, space.degree)
    weights = np.stack([weight(xi, d) for d in range(derivative + 1)], axis=1)
    return tables.quotient(np.stack(powers, axis=1), weights, np.arange(derivative + 1)[:, None])[
        :, derivative
    ]


@reproduce.register
def _(space: Hermite, xi: Floats, derivative: int = 0) -> Floats:
    return _powers(xi, 3, space.breaks[0], space.breaks[-1], derivative)


def _powers(xi: Floats, degree: int, low: float, high: float, derivative: int) -> Floats:
    """Derivatives in xi of s^0 .. s^degree, (x, degree+1), with s in [-1, 1] over [low, high]."""
    half = (high - low) / 2.0
    coefficients = polynomial.polyder(np.eye(degree + 1), derivative)
    return (
        polynomial.polyvander((xi - low) / half - 1.0, len(coefficients) - 1)
        @ coefficients
        / half**derivative
    )


@fit.register
def _(space: BSpline, curve: Curve) -> Floats:
    """Interpolation: at the breaks, with slopes (and curvatures) where they repeat, else at the
    Greville abscissae.
    """
    # the reference of a body and the field 1 are both found by it
    sites, solve = space.keep("interpolation", _interpolation)
    return solve(np.concatenate([_values(curve, xi, d) for d, xi in sites]))


def _interpolation(space: BSpline) -> tuple[list[tuple[int, Floats]], Callable[[Floats], Floats]]:
    """Orders of derivatives with the parameters where a curve is read, and what makes coefficients
    of the values.
    """
    points, orders = knotvector.sites(space.degree, space.knots)
    sites = [(int(d), points[orders == d]) for d in np.unique(orders)]
    return sites, splu(
        sparse.csc_array(sparse.vstack([sample(space, xi, d) for d, xi in sites]))
    ).solve


@fit.register
def _(space: Hermite, curve: Curve) -> Floats:
    pairs = [_values(curve, space.breaks, d) for d in (0, 1)]
    return np.stack(pairs, axis=1).reshape(space.count, -1)


def _values(curve: Curve, xi: Floats, derivative: int) -> Floats:
    values = np.asarray(curve(xi, derivative), dtype=float)
    if values.ndim != 2 or len(values) != len(xi) or not np.isfinite(values).all():
        expected = f"finite values ({len(xi)}, c) of curve(xi, {derivative})"
        raise InputError(
            say("fit.curve", expected, f"shape {values.shape}", "return one row a parameter")
        )
    return values


# --------------------------------------------------------------------------------------------------------- refinement
def insert_knots(
    space: BSpline, coefficients: ArrayLike, knots: ArrayLike
) -> tuple[BSpline, Floats]:
    """The same curve with more knots strictly inside the domain (Boehm, Oslo); coefficients (b, c)
    or (b,).

    InputError for knots outside of it.
    """
    low, high = breaks(space)[[0, -1]]
    extra = inside("insert_knots", knots, low, high)
    if np.any((extra <= low) | (extra >= high)):
        raise InputError(
            say(
                "insert_knots",
                f"knots strictly between {low:g} and {high:g}",
                extra,
                "leave out the end knots",
            )
        )
    refined = np.sort(np.concatenate([space.knots, extra]))
    return _carry(
        space,
        space.degree,
        refined,
        knotvector.insertion_matrix(space.degree, space.knots, refined),
        coefficients,
    )


def elevate(space: BSpline, coefficients: ArrayLike, times: int = 1) -> tuple[BSpline, Floats]:
    """The same curve with a degree higher by `times`, continuity unchanged; coefficients (b, c) or
    (b,).

    InputError for `times` below 0.
    """
    if not isinstance(times, int | np.integer) or times < 0:
        raise InputError(
            say(
                "elevate.times",
                "a whole number of at least 0",
                times,
                "the degree cannot be lowered",
            )
        )
    array = _coefficients(space, coefficients)
    for _ in range(times):
        degree, knots = space.degree, space.knots
        space, array = _carry(
            space,
            degree + 1,
            knotvector.elevate(degree, knots),
            knotvector.elevation_matrix(degree, knots),
            array,
        )
    return space, array


def _carry(
    space: BSpline, degree: int, knots: Floats, change: Any, coefficients: ArrayLike
) -> tuple[BSpline, Floats]:
    """The space over new knots and the coefficients in it, in homogeneous coordinates (w c, w)
    where it is rational.
    """
    array = _coefficients(space, coefficients)
    if space.weights is None:
        return BSpline(degree, knots), change @ array
    weights = change @ space.weights
    return BSpline(degree, knots, weights), ((change @ (space.weights * array.T).T).T / weights).T


def _coefficients(space: BSpline, coefficients: ArrayLike) -> Floats:
    array = np.asarray(coefficients, dtype=float)
    if array.ndim not in (1, 2) or len(array) != space.count:
        raise InputError(
            say(
                "coefficients",
                f"shape ({space.count}, c), a row for each function",
                array.shape,
                "see space.count",
            )
        )
    return array


# --------------------------------------------------------------------------------------------- ANCF cable -> C1 cubic
def hermite_to_bspline(hermite: Hermite) -> sparse.csr_array:
    """Map (b, b) from positions and slopes to the coefficients in `uniform(hermite.breaks, 3, 1)`.

        d_2i = r_i - h_- r'_i / 3,    d_2i+1 = r_i + h_+ r'_i / 3

    with the cells h_- and h_+ beside node i, zero beyond the ends.
    """
    blocks = _changes(hermite.breaks)
    places = np.arange(len(blocks) + 1)
    return sparse.csr_array(sparse.bsr_array((blocks, places[:-1], places)))


def _changes(ends: Floats) -> Floats:
    """The blocks (i, 2, 2) of `hermite_to_bspline`, one a node."""
    lengths = np.pad(np.diff(ends), 1)
    one = np.ones_like(ends)
    return np.stack([one, -lengths[:-1] / 3.0, one, lengths[1:] / 3.0], axis=1).reshape(-1, 2, 2)


#: Spaces of every kind; the contract check runs over them.
REGISTRY: tuple[BSpline | Hermite, ...] = (
    *(uniform(3, degree, continuity) for degree in range(1, 7) for continuity in range(degree)),
    uniform(1, 4, 0),
    uniform([0.0, 0.1, 0.7, 0.8, 2.5], 3, 1),
    BSpline(3, np.array([0, 0, 0, 0, 1, 2, 2, 3, 3, 3, 4, 4, 4, 4.0])),
    BSpline(3, np.array([-3, -1, -0.5, 0, 0.4, 1, 1, 2, 2.5, 2.5, 4.0])),
    BSpline(
        2,
        np.array([0, 0, 0, 1, 1, 2, 2, 2.0]),
        np.array([1.0, np.sqrt(0.5), 1.0, np.sqrt(0.5), 1.0]),
    ),
    BSpline(3, np.array([0, 0, 0, 0, 0.3, 1, 1, 1, 1.0]), np.array([1.0, 0.4, 2.0, 0.7, 1.5])),
    Hermite(np.linspace(0.0, 2.0, 5)),
    Hermite(np.array([-1.0, -0.9, 0.0, 3.0])),
)
