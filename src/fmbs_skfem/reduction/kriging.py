r"""Kriging of an error indicator over the unit box: its logarithm as a Gaussian process, and where its maximum may lie.

    log10 I(x) = m + z(x) + n,   cov(z(x), z(y)) = a^2 (1 + r + r^2 / 3) exp(-r),   r^2 = 5 sum_i (x_i - y_i)^2 / l_i^2
    G(x) = E[max(z(x) - z*, 0)] = s (u Phi(u) + phi(u)),   u = (mu(x) - z*) / s(x)

Matern kernel 5/2 with a length l_i a parameter, or one for all while samples are few; amplitude, lengths and the variance of the
roughness n (a nugget, at most ROUGH decades) are those of greatest likelihood. mu and s are mean and deviation of the smooth part
m + z given the samples, z* is the largest mean at a sample, G is the expected gain in decades of a further sample at x. Indicators
of reduced runs may differ by about 0.1 decade between neighbouring parameters: an interpolating surrogate would chase that.

Source: D. R. Jones, J. Global Optim. 21 (2001) 345-383, doi 10.1023/A:1012771025575; expected gain: D. R. Jones, M. Schonlau,
W. J. Welch, J. Global Optim. 13 (1998) 455-492, doi 10.1023/A:1008306431147. Use in a greedy loop: Hou, Liu, Hu, CMAME 361 (2020)
112690, section 4, doi 10.1016/j.cma.2019.112690.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_solve

from ..core import extras
from ..core.arrays import finite
from ..core.errors import InputError, say
from ..core.records import dataclass

Array = NDArray[np.float64]

LENGTHS = (0.1, 20.0)  #: bounds of the correlation lengths, in sides of the box
AMPLITUDE = (1e-2, 1e2)  #: bounds of the variance of z over that of the samples
ROUGH = 0.2  #: largest standard deviation of the roughness [decades]
QUIET = 0.05  #: smallest standard deviation by which samples are scaled [decades]
BEYOND = 1.0  #: a failed run stands this far above the largest indicator, a zero as far below the smallest [decades]
ALPHAS = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4)  #: added to the diagonal, the next where the last leaves it indefinite
RESTARTS = 2  #: of the search for the greatest likelihood
FEW = 3  #: samples a parameter, up to which all parameters share one length: fewer tell lengths badly, and the mean too surely


@dataclass(frozen=True)
class Surrogate:
    """log10 of a positive number over the unit box, from samples."""

    points: Array  #: (k,d), different from each other
    values: Array  #: (k,) log10, with stand-ins for failed runs and zeros
    shift: float  #: mean of the values
    scale: float  #: their standard deviation, at least QUIET
    process: Any  #: sklearn's GaussianProcessRegressor of (values - shift) / scale

    @property
    def lengths(self) -> Array:
        """Correlation lengths (d,) in sides of the box; long ones belong to parameters of little influence."""
        return np.broadcast_to(self.process.kernel_.k1.k2.length_scale, self.points.shape[1]).astype(np.float64)

    @property
    def roughness(self) -> float:
        """Standard deviation of what neighbouring parameters do not share [decades]."""
        return self.scale * float(np.sqrt(self.process.kernel_.k2.noise_level))


def fit(points: ArrayLike, values: ArrayLike, seed: int = 0) -> Surrogate:
    """Surrogate of the values (k,), none negative, at points (k,d) of the unit box.

    Infinite and NaN values are failed runs, worse than all others. Values at the same point are averaged.
    """
    x, y = _points(points, "kriging.fit"), _decades(values)
    if len(x) != len(y):
        raise InputError(say("kriging.fit", "a value for every point", f"{len(y)} values at {len(x)} points"))
    x, copies = np.unique(x, axis=0, return_inverse=True)
    y = np.bincount(copies.ravel(), y) / np.bincount(copies.ravel())
    shift, scale = float(y.mean()), max(float(y.std()), QUIET) if len(y) > 1 else 1.0
    return Surrogate(x, y, shift, scale, process(x, (y - shift) / scale, (ROUGH / scale) ** 2, seed))


def predict(surrogate: Surrogate, points: ArrayLike) -> tuple[Array, Array]:
    """Mean mu and standard deviation s (k,) [decades] of the smooth part m + z of log10 I, at points (k,d) of the unit box.

    InputError for points that are no finite matrix with a column for every parameter.
    """
    x = _points(points, "kriging.predict", surrogate.points.shape[1])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of variances that round-off has made negative
        mean, deviation = surrogate.process.predict(x, return_std=True)
    smooth = np.sqrt(np.maximum(deviation**2 - surrogate.process.kernel_.k2.noise_level, 0.0))
    return surrogate.shift + surrogate.scale * mean, surrogate.scale * smooth


def deviation(surrogate: Surrogate, points: ArrayLike) -> Array:
    """Standard deviation (k,) [decades] of a further sample at points (k,d): of the smooth part and the roughness together.

    Both are scaled up by what samples deviate from the mean of all the others, in their standard deviations, where that is more
    than 1: a likelihood of few samples may be greatest for a process that is much too sure.

        d_i = [K^-1 y]_i / sqrt([K^-1]_ii)      S. Sundararajan, S. S. Keerthi, Neural Comput. 13 (2001) 1103-1118
    """
    process = surrogate.process
    inverse = cho_solve((process.L_, True), np.eye(len(surrogate.points)))
    missed = (inverse @ process.y_train_) / np.sqrt(np.diag(inverse))
    factor = max(1.0, float(np.sqrt(np.mean(missed**2))))
    return factor * np.hypot(predict(surrogate, points)[1], surrogate.roughness)


def gain(surrogate: Surrogate, points: ArrayLike) -> Array:
    """Expected gain G (k,) [decades] of a further sample at points (k,d) of the unit box."""
    from scipy.special import ndtr

    mean, deviation = predict(surrogate, points)
    above = mean - predict(surrogate, surrogate.points)[0].max()
    safe = np.where(deviation > 0.0, deviation, 1.0)
    u = above / safe
    expected = safe * (u * ndtr(u) + np.exp(-0.5 * u**2) / np.sqrt(2.0 * np.pi))
    return np.where(deviation > 0.0, expected, np.maximum(above, 0.0))


def likely_maximum(surrogate: Surrogate, candidates: ArrayLike, least: float = 0.0) -> int | None:
    """Number of the candidate (c,d) with the largest expected gain; None where that is below `least`."""
    expected = gain(surrogate, candidates)
    best = int(np.argmax(expected))
    return best if expected[best] >= least else None


def process(x: Array, y: Array, largest: float, seed: int) -> Any:
    """The Gaussian process of greatest likelihood, with a roughness of at most that variance; of one sample that of start values.

    Points x (k, d) of the unit box and values y (k,) of mean zero and about unit variance.
    """
    extras.need("families", "Kriging surrogate")
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    one_length = len(x) <= FEW * x.shape[1]
    length = 0.5 if one_length else np.full(x.shape[1], 0.5)
    rough = WhiteKernel(min(1e-3, largest), (1e-10, largest))
    kernel = ConstantKernel(1.0, AMPLITUDE) * Matern(length, LENGTHS, nu=2.5) + rough
    return _regress(x, y, kernel, seed, "fmin_l_bfgs_b" if len(x) > 1 else None)


def _regress(x: Array, y: Array, kernel: Any, seed: int, optimizer: str | None) -> Any:
    """Fit a process, with more on the diagonal where its covariance is indefinite."""
    from sklearn.gaussian_process import GaussianProcessRegressor

    restarts = RESTARTS if optimizer else 0
    for alpha in ALPHAS:
        process = GaussianProcessRegressor(
            kernel, alpha=alpha, optimizer=optimizer, n_restarts_optimizer=restarts, random_state=seed
        )
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of bounds that are reached, which is where a parameter has no influence
                return process.fit(x, y)
        except np.linalg.LinAlgError:
            continue
    raise InputError(say("kriging.fit", "samples with a definite covariance", f"{len(x)} samples", "leave out nearly equal points"))


def _decades(values: ArrayLike) -> Array:
    """log10 of the values; failed runs stand BEYOND the largest, zeros BEYOND the smallest finite one."""
    given = np.asarray(values, dtype=np.float64)
    if given.ndim != 1 or np.any(given < 0.0):
        raise InputError(say("kriging.fit", "a vector of values that are not negative", given, "an indicator is a norm"))
    failed, usable = ~np.isfinite(given), np.isfinite(given) & (given > 0.0)
    y = np.log10(given, where=usable, out=np.zeros(len(given)))
    low, high = (float(y[usable].min()), float(y[usable].max())) if np.any(usable) else (0.0, 0.0)
    y[failed] = high + BEYOND
    y[~failed & ~usable] = low - BEYOND
    return y


def _points(points: ArrayLike, where: str, columns: int | None = None) -> Array:
    """Points as a finite, non-empty matrix."""
    return finite(points, where, f"finite points as a matrix (k,{columns or 'd'})", None, columns, remedy="one row a point")
