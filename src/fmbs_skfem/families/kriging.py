r"""Kriging of an error indicator over the unit box: its logarithm as a Gaussian process, and where
its maximum may lie.

    log10 I(x) = m + s (z(x) + n)                                                                        (`gaussian`)
    G(x) = E[max(z(x) - z*, 0)] = s (u Phi(u) + phi(u)),   u = (mu(x) - z*) / s(x)

n is a roughness of at most ROUGH decades: indicators of reduced runs may differ by about 0.1 decade
between neighbouring parameters, and an interpolating surrogate would chase that. mu and s are mean
and deviation of the smooth part m + s z given the samples, z* is the largest mean at a sample, G is
the expected gain in decades of a further sample at x.

Source: D. R. Jones, J. Global Optim. 21 (2001) 345-383, doi 10.1023/A:1012771025575; expected gain:
D. R. Jones, M. Schonlau, W. J. Welch, J. Global Optim. 13 (1998) 455-492, doi
10.1023/A:1008306431147. Use in a greedy loop: Hou, Liu, Hu, CMAME 361 (2020) 112690, section 4, doi
10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InputError, say
from ..core.values.arrays import finite
from . import gaussian
from .gaussian import Array
from .gaussian import Process as Surrogate

__all__ = ["Surrogate", "fit", "predict", "deviation", "gain", "likely_maximum"]

ROUGH = 0.2  #: largest standard deviation of the roughness [decades]
QUIET = 0.05  #: smallest standard deviation by which samples are scaled [decades]
BEYOND = 1.0  #: a failed run stands this far above the largest indicator, a zero as far below the smallest [decades]


def fit(points: ArrayLike, values: ArrayLike, seed: int = 0) -> Surrogate:
    """Surrogate of the values (k,), none negative, at points (k,d) of the unit box.

    Infinite and NaN values are failed runs, worse than all others. Values at the same point are
    averaged.
    """
    x = _points(points, "kriging.fit")
    y = _decades(values)
    if len(x) != len(y):
        raise InputError(
            say("kriging.fit", "a value for every point", f"{len(y)} values at {len(x)} points")
        )
    x, copies = np.unique(x, axis=0, return_inverse=True)
    y = np.bincount(copies.ravel(), y) / np.bincount(copies.ravel())
    shift = float(y.mean())
    scale = max(float(y.std()), QUIET) if len(y) > 1 else 1.0
    return Surrogate(
        x, y, shift, scale, *gaussian.likeliest(x, (y - shift) / scale, (ROUGH / scale) ** 2, seed)
    )


def predict(surrogate: Surrogate, points: ArrayLike) -> tuple[Array, Array]:
    """Mean and standard deviation (k,) [decades] of the smooth part m + s z of an indicator I, at
    points (k,d) of the unit box.

        log10 I = m + s (z(u) + n)

    InputError for points that are no finite matrix with a column for every parameter.
    """
    return surrogate.predict(_points(points, "kriging.predict", surrogate.points.shape[1]))


def deviation(surrogate: Surrogate, points: ArrayLike) -> Array:
    """Standard deviation (k,) [decades] of a further sample at points (k,d): of the smooth part s
    and the roughness r together.

        f sqrt(s^2 + r^2),    f = max(1, sqrt(mean((e_i / s_i)^2)))

    Both are scaled up by what samples deviate from the mean of all the others, e_i, in their
    standard deviations s_i, where that is more than 1: a likelihood of few samples may be greatest
    for a process that is much too sure.
    """
    errors, deviations = surrogate.left_out()
    factor = max(1.0, float(np.sqrt(np.mean((errors / deviations) ** 2))))
    return factor * np.hypot(predict(surrogate, points)[1], surrogate.roughness)


def gain(surrogate: Surrogate, points: ArrayLike) -> Array:
    """Expected gain G (k,) [decades] of a further sample at points (k,d) of the unit box.

        G = E[max(z(x) - z*, 0)] = s (u Phi(u) + phi(u)),    u = (mu(x) - z*) / s(x)

    with z* the largest mean at a sample. Source: Jones, Schonlau, Welch 1998, doi
    10.1023/A:1008306431147.
    """
    from scipy.special import ndtr

    mean, deviation = predict(surrogate, points)
    above = mean - predict(surrogate, surrogate.points)[0].max()
    safe = np.where(deviation > 0.0, deviation, 1.0)
    u = above / safe
    expected = safe * (u * ndtr(u) + np.exp(-0.5 * u**2) / np.sqrt(2.0 * np.pi))
    return np.where(deviation > 0.0, expected, np.maximum(above, 0.0))


def likely_maximum(surrogate: Surrogate, candidates: ArrayLike, least: float = 0.0) -> int | None:
    """Number of the candidate (c,d) with the largest expected gain; None where that is below
    `least`.

    `candidates` are points of the unit box, `least` is a gain in decades.
    """
    expected = gain(surrogate, candidates)
    best = int(np.argmax(expected))
    return best if expected[best] >= least else None


def _decades(values: ArrayLike) -> Array:
    """log10 of the values; failed runs stand BEYOND the largest, zeros BEYOND the smallest finite
    one.
    """
    given = np.asarray(values, dtype=np.float64)
    if given.ndim != 1 or np.any(given < 0.0):
        raise InputError(
            say(
                "kriging.fit",
                "a vector of values that are not negative",
                given,
                "an indicator is a norm",
            )
        )
    failed = ~np.isfinite(given)
    usable = np.isfinite(given) & (given > 0.0)
    y = np.log10(given, where=usable, out=np.zeros(len(given)))
    low, high = (float(y[usable].min()), float(y[usable].max())) if np.any(usable) else (0.0, 0.0)
    y[failed] = high + BEYOND
    y[~failed & ~usable] = low - BEYOND
    return y


def _points(points: ArrayLike, where: str, columns: int | None = None) -> Array:
    """Points as a finite, non-empty matrix."""
    return finite(
        points,
        where,
        f"finite points as a matrix (k,{columns or 'd'})",
        None,
        columns,
        remedy="one row a point",
    )
