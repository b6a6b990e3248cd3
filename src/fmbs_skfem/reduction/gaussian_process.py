r"""A smooth function over the unit box and the roughness about it: a Gaussian process of greatest likelihood.

    cov(z(x), z(y)) = a^2 (1 + r + r^2 / 3) exp(-r),   r^2 = 5 sum_i (x_i - y_i)^2 / l_i^2,   K = cov + (n^2 + alpha) 1
    log L = -1/2 y^T w - 1/2 log det K - k/2 log 2 pi,   w = K^-1 y
    d log L / dt = 1/2 tr((w w^T - K^-1) dK/dt),   t = (log a^2, log l_i, log n^2)

Matern kernel 5/2 with a length l_i a parameter, or one for all while samples are few. The search for the greatest likelihood starts
in the middle and at RESTARTS random places.

Source: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006,
eqs. 2.25, 2.26, 4.17, 5.8, 5.9.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, lapack, solve_triangular

from ..core.errors import InputError, say
from ..core.records import dataclass

Array = NDArray[np.float64]

LENGTHS = (0.1, 20.0)  #: bounds of the correlation lengths, in sides of the box
AMPLITUDE = (1e-2, 1e2)  #: bounds of the variance of z over that of the samples
QUIETEST = 1e-10  #: smallest variance of the roughness
START = (1.0, 0.5, 1e-3)  #: amplitude, lengths and roughness that the search starts from
ALPHAS = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4)  #: added to the diagonal, the next where the last leaves it indefinite
RESTARTS = 2  #: of the search for the greatest likelihood
FEW = 3  #: samples a parameter, up to which all parameters share one length: fewer tell lengths badly, and the mean too surely


@dataclass(frozen=True, eq=False)
class Process:
    """z of mean zero and the roughness about it, given samples."""

    points: Array  #: (k, d) of the unit box
    values: Array  #: (k,)
    amplitude: float  #: a^2, variance of z
    lengths: Array  #: (d,) in sides of the box
    noise: float  #: n^2, variance of the roughness
    alpha: float  #: added to the diagonal beside it
    factor: Array  #: (k, k) lower Cholesky factor of K
    weights: Array  #: (k,) w

    def predict(self, points: Array) -> tuple[Array, Array]:
        """Mean and standard deviation (i,) of z at points (i, d)."""
        across = covariance(points, self.points, self.amplitude, self.lengths)
        left = solve_triangular(self.factor, across.T, lower=True)
        return across @ self.weights, np.sqrt(np.maximum(self.amplitude - np.sum(left**2, axis=0), 0.0))

    def left_out(self) -> tuple[Array, Array]:
        """What each sample (k,) deviates from the mean given all the others, and its standard deviation (k,) there.

        e_i = w_i / [K^-1]_ii,   s_i^2 = 1 / [K^-1]_ii      S. Sundararajan, S. S. Keerthi, Neural Comput. 13
        (2001) 1103-1118, doi 10.1162/08997660151134343
        """
        inverse = np.diag(cho_solve((self.factor, True), np.eye(len(self.values))))
        return self.weights / inverse, 1.0 / np.sqrt(inverse)


def covariance(x: Array, y: Array, amplitude: float, lengths: Array) -> Array:
    """cov(z, z) (i, j) between points (i, d) and (j, d)."""
    return _matern((x[:, None] - y[None]) ** 2, amplitude, lengths)[0]


def fit(points: Array, values: Array, largest: float, seed: int = 0) -> Process:
    """The process of greatest likelihood, with a roughness of at most that variance; of one sample that of the start values.

    Points (k, d) of the unit box and values (k,) of mean zero and about unit variance. InputError where points are so close that
    no covariance is definite.
    """
    lengths = 1 if len(points) <= FEW * points.shape[1] else points.shape[1]
    start = np.log([START[0], *[START[1]] * lengths, min(START[2], largest)])
    bounds = np.log([AMPLITUDE, *[LENGTHS] * lengths, (QUIETEST, largest)])
    for alpha in ALPHAS:
        best = start if len(points) == 1 else _most_likely(points, values, start, bounds, alpha, seed)
        amplitude, noise = float(np.exp(best[0])), float(np.exp(best[-1]))
        found = np.broadcast_to(np.exp(best[1:-1]), points.shape[1]).copy()
        if process := solve(points, values, amplitude, found, noise, alpha):
            return process
    raise InputError(
        say("kriging.fit", "samples with a definite covariance", f"{len(points)} samples", "leave out nearly equal points")
    )


def solve(points: Array, values: Array, amplitude: float, lengths: Array, noise: float, alpha: float = 0.0) -> Process | None:
    """The process with these numbers given samples, values (k,) at points (k, d); None where K is indefinite."""
    K = covariance(points, points, amplitude, lengths)
    np.fill_diagonal(K, K.diagonal() + noise + alpha)
    factor, status = lapack.dpotrf(K, lower=1, clean=1)
    if status != 0:
        return None
    return Process(points, values, amplitude, lengths, noise, alpha, factor, cho_solve((factor, True), values))


def _most_likely(points: Array, values: Array, start: Array, bounds: Array, alpha: float, seed: int) -> Array:
    """t of the greatest likelihood that was found, within bounds (t, 2)."""
    from scipy.optimize import minimize

    apart = (points[:, None] - points[None]) ** 2
    if len(start) < points.shape[1] + 2:
        apart = apart.sum(axis=2, keepdims=True)
    random = np.random.RandomState(seed)  # as ever: a seed finds what it found in earlier versions
    starts = [start, *(random.uniform(bounds[:, 0], bounds[:, 1]) for _ in range(RESTARTS))]
    found = [minimize(_unlikely, t, (apart, values, alpha), "L-BFGS-B", jac=True, bounds=bounds) for t in starts]
    best: Array = found[int(np.argmin([one.fun for one in found]))].x
    return best


def _unlikely(t: Array, apart: Array, values: Array, alpha: float) -> tuple[float, Array]:
    """-log L and its derivative by t; infinite where K is indefinite. Squared distances (k, k, d), or (k, k, 1) for one length."""
    amplitude, lengths, noise = np.exp(t[0]), np.exp(t[1:-1]), np.exp(t[-1])
    smooth, slope, scaled = _matern(apart, amplitude, lengths)
    K = smooth.copy()
    np.fill_diagonal(K, K.diagonal() + noise + alpha)
    factor, status = lapack.dpotrf(K, lower=1)
    if status != 0:
        return np.inf, np.zeros_like(t)
    lower = np.tril(lapack.dpotri(factor, lower=1)[0])
    inverse = lower + np.tril(lower, -1).T
    weights = inverse @ values
    inner = np.outer(weights, weights) - inverse
    by_lengths = np.einsum("ij,ij,ijd->d", inner, slope, scaled)
    gradient = -0.5 * np.array([np.sum(inner * smooth), *by_lengths, noise * np.trace(inner)])
    log_det = 2.0 * np.sum(np.log(factor.diagonal()))
    return 0.5 * (values @ weights + log_det + len(values) * np.log(2.0 * np.pi)), gradient


def _matern(apart: Array, amplitude: float, lengths: Array) -> tuple[Array, Array, Array]:
    """Covariances (i, j) of squared distances (i, j, d); -2 times their derivative by r^2 (i, j); the parts of r^2 (i, j, d)."""
    scaled = 5.0 * apart / lengths**2
    squared = scaled.sum(axis=2)
    r = np.sqrt(squared)
    decay = amplitude * np.exp(-r)
    return (1.0 + r + squared / 3.0) * decay, (1.0 + r) / 3.0 * decay, scaled
