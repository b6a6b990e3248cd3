"""Knot vectors t of B-splines of degree p: checks, spans, basis functions, Greville abscissae,
interpolation points, polar forms.

    b = len(t) - p - 1 functions,    domain [t_p, t_b],    sum_i mean(t_{i+1} .. t_{i+p}) N_i(xi) = xi

Basis functions: Piegl and Tiller, The NURBS Book, 2nd ed., doi:10.1007/978-3-642-59223-2, ch. 2.
Polar forms: Ramshaw, Computer Aided Geometric Design 6 (1989), doi:10.1016/0167-8396(89)90032-0.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from ..core.errors import InputError, say
from .table import Floats, Ints, rows


def freeze(where: str, values: ArrayLike) -> Floats:
    """A read-only copy (i,) of finite numbers."""
    remedy = "look for NaN, text or nested lists"
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(say(where, "an array of numbers", values, remedy)) from error
    if array.ndim != 1 or not np.isfinite(array).all():
        raise InputError(
            say(
                where,
                "a one-dimensional array of finite numbers",
                f"{array} of shape {array.shape}",
                remedy,
            )
        )
    array.setflags(write=False)
    return array


def increasing(where: str, values: ArrayLike) -> Floats:
    """A read-only copy (i,) of at least two strictly increasing numbers."""
    array = freeze(where, values)
    if len(array) < 2 or not np.all(np.diff(array) > 0.0):
        raise InputError(
            say(
                where,
                "at least two strictly increasing numbers",
                array,
                "sort them and remove repetitions",
            )
        )
    return array


def check(degree: int, knots: Floats) -> None:
    """Whether the knots make a basis: enough, in order, none repeated too often, every function
    alive in the domain.
    """
    where = "BSpline.knots"
    steps = np.diff(knots)
    least = 2 * degree + 2
    if len(knots) < least:
        remedy = "repeat the end knots degree + 1 times"
        raise InputError(
            say(where, f"at least 2 (degree + 1) = {least} knots", f"{len(knots)}", remedy)
        )
    if np.any(steps < 0.0):
        i = int(np.argmax(steps < 0.0)) + 1
        raise InputError(
            say(
                f"{where}[{i}]",
                f"a knot of at least {knots[i - 1]:g}",
                f"{knots[i]:g}",
                "sort the knots",
            )
        )
    if np.any((steps > 0.0) & (steps < 1e-12 * (knots[-1] - knots[0]))):
        got = f"{steps[steps > 0.0].min():.1e}"
        raise InputError(
            say(where, "distinct knots at least 1e-12 of the length apart", got, "make them equal")
        )
    low, high = knots[degree], knots[-degree - 1]
    for knot, times in zip(*np.unique(knots, return_counts=True), strict=True):
        most, kind = (degree, "inner") if low < knot < high else (degree + 1, "end")
        if times > most:
            got = f"{times} times {knot:g}"
            raise InputError(
                say(
                    where,
                    f"each {kind} knot at most {most} times",
                    got,
                    "remove repetitions or raise the degree",
                )
            )
    if knots[degree] == knots[degree + 1] or knots[-degree - 1] == knots[-degree - 2]:
        expected = "knots[degree] < knots[degree+1] and knots[-degree-2] < knots[-degree-1]"
        raise InputError(
            say(
                where,
                expected,
                knots,
                "leave out the outer knots that carry no function of the domain",
            )
        )


def check_weights(weights: Floats, count: int) -> None:
    """Whether there is a positive weight for each of `count` functions."""
    if len(weights) != count:
        expected = f"{count} weights, one for each basis function"
        raise InputError(
            say(
                "BSpline.weights",
                expected,
                len(weights),
                "there are len(knots) - degree - 1 functions",
            )
        )
    if not np.all(weights > 0.0):
        i = int(np.argmin(weights))
        raise InputError(
            say(
                f"BSpline.weights[{i}]",
                "a positive weight",
                weights[i],
                "a plain B-spline has weights 1",
            )
        )


def spans(degree: int, knots: Floats, xi: Floats) -> Ints:
    """Numbers i (x,) of the spans of parameters, kept in the domain; the functions i-p .. i live
    there.

        t_i <= xi < t_{i+1}
    """
    return np.clip(np.searchsorted(knots, xi, side="right") - 1, degree, len(knots) - degree - 2)


def basis(
    degree: int,
    knots: Floats,
    span: Ints,
    xi: Floats,
    derivatives: int,
    start: Floats | float = 0.0,
) -> Floats:
    """N_i and their derivatives (x, k, p + 1), i = span - p .. span, on the polynomial pieces of
    the spans (x,), and beyond them.

    `xi` (x,) counts from `start`. The functions of degree p - k give the derivatives k, see
    `differences`.
    """
    found = np.zeros((derivatives + 1, degree + 1, len(xi)))
    for p, N in enumerate(levels(degree, knots, span, [xi] * degree, start)):
        if (k := degree - p) <= derivatives:
            T = differences(degree, knots, k).T
            for i, row in enumerate(N):
                for j in range(k + 1):
                    found[k, i + j] += row * T[j, span - degree + i]
    return np.ascontiguousarray(found.transpose(2, 0, 1))


def levels(
    degree: int, knots: Floats, span: Ints, arguments: Iterable[Floats], start: Floats | float = 0.0
) -> Iterator[list[Floats]]:
    """The functions of degree 0 .. p that live on the spans (x,), of rising number, (x,) each, by
    the recursion of Cox and de Boor.

        N_i^p = (xi - t_i) / (t_{i+p} - t_i) N_i^{p-1} + (t_{i+p+1} - xi) / (t_{i+p+1} - t_{i+1}) N_{i+1}^{p-1}

    Each step takes an argument (x,) of its own, which counts from `start`: equal ones give
    functions, others their polar forms.
    """
    N = [np.ones(len(span))]
    yield N
    near = [knots[span + n] - start for n in range(1 - degree, degree + 1)]
    for p, u in zip(range(1, degree + 1), arguments, strict=True):
        lower = N
        N = [np.zeros(len(span))]
        for n, one in enumerate(lower):
            after, before = near[degree + n], near[degree + n - p]
            share = one / (after - before)
            N[n] = N[n] + share * (after - u)
            N.append(share * (u - before))
        yield N


def differences(degree: int, knots: Floats, derivative: int) -> Floats:
    """T (b - k, k + 1) of the derivative k of B-splines, rows from their diagonal on.

        N_p^(k) = N_{p-k} T,    (D_p c)_i = p (c_i - c_{i-1}) / (t_{i+p} - t_i)

    T is a product of k factors D, which are zero where the knots coincide.
    """
    T = np.ones((len(knots) - degree - 1, 1))
    for p in range(degree, degree - derivative, -1):
        width = knots[p + 1 : -1] - knots[1 : -p - 1]
        factor = np.divide(p, width, out=np.zeros_like(width), where=width > 0.0)[:, None]
        before = T
        T = np.zeros((len(T) - 1, T.shape[1] + 1))
        knots = knots[1:-1]
        T[:, :-1] = -factor * before[:-1]
        T[:, 1:] += factor * before[1:]
    return T


def averages(degree: int, knots: Floats) -> Floats:
    """Greville abscissae (b,): the coefficients of xi.

        (t_{i+1} + ... + t_{i+p}) / p

    with the knots t and the degree p.
    """
    return np.lib.stride_tricks.sliding_window_view(knots[1:-1], degree).mean(axis=1)


def sites(degree: int, knots: Floats) -> tuple[Floats, Ints]:
    """Interpolation points and orders of derivative, (b,) each, for which the interpolant exists
    (Schoenberg and Whitney).

    Odd degrees to 5 with smooth enough breaks: value (slope, curvature) at each break as often as
    it repeats, (p + 1) / 2 times at the ends; otherwise the Greville abscissae of the knots closed
    at the ends of the domain.
    """
    low, inner, high = knots[degree], knots[degree + 1 : -degree - 1], knots[-degree - 1]
    distinct, times = np.unique(inner, return_counts=True)
    half = (degree + 1) // 2
    if degree in (1, 3, 5) and np.all(times <= half):
        each = np.concatenate([[half], times, [half]])
        return np.repeat(np.concatenate([[low], distinct, [high]]), each), np.concatenate(
            [np.arange(n) for n in each]
        )
    closed = np.concatenate([np.full(degree + 1, low), inner, np.full(degree + 1, high)])
    return np.clip(averages(degree, closed), low, high), np.zeros(
        len(knots) - degree - 1, dtype=np.int64
    )


def elevate(degree: int, knots: Floats) -> Floats:
    """Knots of degree p + 1 and the same continuity: each once more, outer ones left out that carry
    no function of the domain.
    """
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
    """Coefficients of degree p + 1 over `elevated` knots, (i, b): the mean of the polar forms with
    one argument left out.
    """
    more = elevate(degree, knots)
    arguments = np.lib.stride_tricks.sliding_window_view(more[1:-1], degree + 1)
    starts = more[: len(arguments)]
    total = sum(
        _polar(degree, knots, starts, np.delete(arguments, j, axis=1)) for j in range(degree + 1)
    )
    return sparse.csr_array(total / (degree + 1))


def _polar(degree: int, knots: Floats, starts: Floats, arguments: Floats) -> sparse.csr_array:
    """Polar forms at the arguments u (i, p) of the polynomial pieces that live just after `starts`
    (i,), as an array (i, b).
    """
    span = spans(degree, knots, starts)
    *_, row = levels(degree, knots, span, arguments.T)
    return rows(
        np.stack(row, axis=1), span[:, None] + np.arange(-degree, 1), len(knots) - degree - 1
    )
