"""Knot vectors t of B-splines of degree p: checks, spans, Greville abscissae, interpolation points, polar forms, extraction.

    b = len(t) - p - 1 functions,    domain [t_p, t_b],    sum_i mean(t_{i+1} .. t_{i+p}) N_i(xi) = xi

Polar forms: Ramshaw, Computer Aided Geometric Design 6 (1989), doi:10.1016/0167-8396(89)90032-0. Extraction: Borden, Scott, Evans
and Hughes, Int. J. Numer. Meth. Engng 87 (2011), doi:10.1002/nme.2968.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from ..core.errors import InputError, say
from .table import Floats, Ints


def freeze(where: str, values: ArrayLike) -> Floats:
    """A read-only copy (i,) of finite numbers."""
    remedy = "look for NaN, text or nested lists"
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(say(where, "an array of numbers", values, remedy)) from error
    if array.ndim != 1 or not np.isfinite(array).all():
        raise InputError(say(where, "a one-dimensional array of finite numbers", f"{array} of shape {array.shape}", remedy))
    array.setflags(write=False)
    return array


def increasing(where: str, values: ArrayLike) -> Floats:
    """A read-only copy (i,) of at least two strictly increasing numbers."""
    array = freeze(where, values)
    if len(array) < 2 or not np.all(np.diff(array) > 0.0):
        raise InputError(say(where, "at least two strictly increasing numbers", array, "sort them and remove repetitions"))
    return array


def check(degree: int, knots: Floats) -> None:
    """Whether the knots make a basis: enough, in order, none repeated too often, every function alive in the domain."""
    where, steps, least = "BSpline.knots", np.diff(knots), 2 * degree + 2
    if len(knots) < least:
        remedy = "repeat the end knots degree + 1 times"
        raise InputError(say(where, f"at least 2 (degree + 1) = {least} knots", f"{len(knots)}", remedy))
    if np.any(steps < 0.0):
        i = int(np.argmax(steps < 0.0)) + 1
        raise InputError(say(f"{where}[{i}]", f"a knot of at least {knots[i - 1]:g}", f"{knots[i]:g}", "sort the knots"))
    if np.any((steps > 0.0) & (steps < 1e-12 * (knots[-1] - knots[0]))):
        got = f"{steps[steps > 0.0].min():.1e}"
        raise InputError(say(where, "distinct knots at least 1e-12 of the length apart", got, "make them equal"))
    low, high = knots[degree], knots[-degree - 1]
    for knot, times in zip(*np.unique(knots, return_counts=True), strict=True):
        most, kind = (degree, "inner") if low < knot < high else (degree + 1, "end")
        if times > most:
            got = f"{times} times {knot:g}"
            raise InputError(say(where, f"each {kind} knot at most {most} times", got, "remove repetitions or raise the degree"))
    if knots[degree] == knots[degree + 1] or knots[-degree - 1] == knots[-degree - 2]:
        expected = "knots[degree] < knots[degree+1] and knots[-degree-2] < knots[-degree-1]"
        raise InputError(say(where, expected, knots, "leave out the outer knots that carry no function of the domain"))


def check_weights(weights: Floats, count: int) -> None:
    """Whether there is a positive weight for each of `count` functions."""
    if len(weights) != count:
        expected = f"{count} weights, one for each basis function"
        raise InputError(say("BSpline.weights", expected, len(weights), "there are len(knots) - degree - 1 functions"))
    if not np.all(weights > 0.0):
        i = int(np.argmin(weights))
        raise InputError(say(f"BSpline.weights[{i}]", "a positive weight", weights[i], "a plain B-spline has weights 1"))


def spans(degree: int, knots: Floats, xi: Floats) -> Ints:
    """Numbers i (x,) of the spans with t_i <= xi < t_{i+1}, kept in the domain; the functions i-p .. i live there."""
    return np.clip(np.searchsorted(knots, xi, side="right") - 1, degree, len(knots) - degree - 2)


def functions(degree: int, knots: Floats, xi: Floats) -> sparse.csr_array:
    """N (x, b) at points of the domain by the recursion of Cox and de Boor, without scipy.interpolate, whose import takes 0.2 s."""
    span = spans(degree, knots, xi)
    values = np.zeros((len(xi), degree + 1))
    values[:, 0] = 1.0
    for p in range(1, degree + 1):
        lower = values[:, :p].copy()
        values[:, 0] = 0.0
        for n in range(1, p + 1):
            after, before = knots[span + n], knots[span + n - p]
            share = np.divide(lower[:, n - 1], after - before, out=np.zeros(len(xi)), where=after > before)
            values[:, n - 1] += share * (after - xi)
            values[:, n] = share * (xi - before)
    columns = span[:, None] + np.arange(-degree, 1)
    rows = np.arange(len(xi) + 1) * (degree + 1)
    return sparse.csr_array((values.ravel(), columns.ravel(), rows), shape=(len(xi), len(knots) - degree - 1))


def averages(degree: int, knots: Floats) -> Floats:
    """Greville abscissae (b,): the coefficients of xi."""
    return np.lib.stride_tricks.sliding_window_view(knots[1:-1], degree).mean(axis=1)


def sites(degree: int, knots: Floats) -> tuple[Floats, Ints]:
    """Interpolation points and orders of derivative, (b,) each, for which the interpolant exists (Schoenberg and Whitney).

    Odd degrees to 5 with smooth enough breaks: value (slope, curvature) at each break as often as it repeats, (p + 1) / 2 times at
    the ends; otherwise the Greville abscissae of the knots closed at the ends of the domain.
    """
    low, inner, high = knots[degree], knots[degree + 1 : -degree - 1], knots[-degree - 1]
    distinct, times = np.unique(inner, return_counts=True)
    half = (degree + 1) // 2
    if degree in (1, 3, 5) and np.all(times <= half):
        each = np.concatenate([[half], times, [half]])
        return np.repeat(np.concatenate([[low], distinct, [high]]), each), np.concatenate([np.arange(n) for n in each])
    closed = np.concatenate([np.full(degree + 1, low), inner, np.full(degree + 1, high)])
    return np.clip(averages(degree, closed), low, high), np.zeros(len(knots) - degree - 1, dtype=np.int64)


def elevate(degree: int, knots: Floats) -> Floats:
    """Knots of degree p + 1 and the same continuity: each once more, outer ones left out that carry no function of the domain."""
    distinct, times = np.unique(knots, return_counts=True)
    more = np.repeat(distinct, times + 1)
    before = int(np.sum(more <= knots[degree])) - degree - 2
    after = int(np.sum(more >= knots[-degree - 1])) - degree - 2
    return more[before : len(more) - after]


def insertion_matrix(degree: int, knots: Floats, refined: Floats) -> sparse.csr_array:
    """Coefficients over `refined`, which holds all of `knots`, from those over `knots`: (i, b)."""
    arguments = np.lib.stride_tricks.sliding_window_view(refined[1:-1], degree)
    return _polar(degree, knots, refined[: len(arguments)], arguments)


def elevation_matrix(degree: int, knots: Floats) -> sparse.csr_array:
    """Coefficients of degree p + 1 over `elevated` knots, (i, b): the mean of the polar forms with one argument left out."""
    more = elevate(degree, knots)
    arguments = np.lib.stride_tricks.sliding_window_view(more[1:-1], degree + 1)
    starts = more[: len(arguments)]
    total = sum(_polar(degree, knots, starts, np.delete(arguments, j, axis=1)) for j in range(degree + 1))
    return sparse.csr_array(total / (degree + 1))


def first_functions(degree: int, knots: Floats) -> Ints:
    """First of the p + 1 functions of each span of the domain (e,)."""
    domain = knots[degree : len(knots) - degree]
    return np.flatnonzero(domain[:-1] < domain[1:])


def extraction(degree: int, knots: Floats) -> Floats:
    """Bernstein coefficients (e, p+1, p+1) of the B-splines on each span of open knots: coefficient by function.

    C_ji is the polar form of N_i at p - j times the start and j times the end of the span. Cells are evaluated a few at a time, and
    the arrays of the knots seen last are kept.
    """
    return _extraction(degree, tuple(knots.tolist()))


@functools.lru_cache(maxsize=64)
def _extraction(degree: int, numbers: tuple[float, ...]) -> Floats:
    knots = np.array(numbers)
    ends, first = np.unique(knots), first_functions(degree, knots)
    spans = len(first)
    change = insertion_matrix(degree, knots, np.concatenate([ends[:1], np.repeat(ends, degree), ends[-1:]]))
    found = np.zeros((spans, degree + 1, degree + 1))
    for j in range(degree + 1):
        rows = change[degree * np.arange(spans) + j].tocoo()
        column = rows.col - first[rows.row]
        alive = (column >= 0) & (column <= degree)
        found[rows.row[alive], j, column[alive]] = rows.data[alive]
    found.setflags(write=False)
    return found


def _polar(degree: int, knots: Floats, starts: Floats, arguments: Floats) -> sparse.csr_array:
    """Polar forms at the arguments u (i, p) of the polynomial pieces that live just after `starts` (i,), as an array (i, b).

    Row i is a product R_1(u_1) .. R_p(u_p), R_k bringing in one coefficient more:
    row_j <- row_j (t_{s+j} - u) / (t_{s+j} - t_{s+j-k}),  row_{j+1} <- row_j (u - t_{s+j-k}) / (t_{s+j} - t_{s+j-k}),  j = 1 .. k.
    """
    span = spans(degree, knots, starts)[:, None]
    row = np.ones((len(starts), 1))
    for k in range(1, degree + 1):
        upper, lower = knots[span + np.arange(1, k + 1)], knots[span + np.arange(1 - k, 1)]
        share = (arguments[:, k - 1, None] - lower) / (upper - lower)
        row = np.pad(row * (1.0 - share), ((0, 0), (0, 1))) + np.pad(row * share, ((0, 0), (1, 0)))
    columns = (span - degree + np.arange(degree + 1)).ravel()
    rows = np.arange(len(starts) + 1) * (degree + 1)
    return sparse.csr_array((row.ravel(), columns, rows), shape=(len(starts), len(knots) - degree - 1))
