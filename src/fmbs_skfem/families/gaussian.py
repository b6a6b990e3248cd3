r"""Gaussian processes over the unit box: what samples say of a number elsewhere, how surely, and
what each says of the others.

    y(u) = m + s (z(u) + n),    cov(z(u), z(v)) = a^2 (1 + r + r^2 / 3) exp(-r),    r^2 = 5 sum_i (u_i - v_i)^2 / l_i^2
    m + s k^T K^-1 Y  +-  s sqrt(a^2 - k^T K^-1 k),    K = cov(z, z) + var(n) 1,    k = cov(z, z(u)),    Y = (y - m) / s
    e_i = s [K^-1 Y]_i / [K^-1]_ii,    s / sqrt([K^-1]_ii)          of sample i left out: its error and the deviation of that

Matern kernel 5/2; amplitude a, lengths l_i and the variance of n, which is no smooth function, are
those of greatest likelihood.

Sources: C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press
2006, eqs. 2.25, 2.26, 5.12; S. Sundararajan, S. S. Keerthi, Neural Comput. 13 (2001) 1103-1118,
doi:10.1162/08997660151134343.
"""

from __future__ import annotations

import warnings
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky, solve_triangular

from ..core import extras
from ..core.errors import InputError, say
from ..core.storage.records import dataclass

Array = NDArray[np.float64]

LENGTHS = (0.1, 20.0)  #: bounds of the correlation lengths, in sides of the box
AMPLITUDE = (1e-2, 1e2)  #: bounds of a^2
#: added to the diagonal, the next where the last leaves it indefinite
ALPHAS = (
    1e-8,
    1e-7,
    1e-6,
    1e-5,
    1e-4,
)
RESTARTS = 2  #: of the search for the greatest likelihood
FEW = 3  #: samples a parameter, up to which all parameters share one length: fewer tell lengths badly, and the mean too surely


@dataclass(frozen=True, eq=False)
class Process:
    """A number over the unit box, from samples.

        y(u) = mean + scale (z(u) + n)

    with the covariance of the module; `predict` gives y elsewhere and how surely, `left_out` what
    every sample says of the others.
    """

    points: Array  #: (k, d)
    values: Array  #: (k,)
    mean: float  #: m
    scale: float  #: s
    lengths: (
        Array  #: (d,) l_i, in sides of the box; long ones belong to parameters of little influence
    )
    amplitude: float  #: a^2
    noise: float  #: variance of n

    @property
    def roughness(self) -> float:
        """Standard deviation of what neighbouring points do not share.

            s sqrt(var(n))

        in the unit of y.
        """
        return self.scale * float(np.sqrt(self.noise))

    @cached_property
    def factor(self) -> Array:
        """Cholesky factor (k, k) of the covariance of the samples.

            L L^T = K = cov(z, z) + var(n) 1

        L lower.
        """
        return np.asarray(
            cholesky(
                self.covariance(self.points) + self.noise * np.eye(len(self.points)), lower=True
            )
        )

    @cached_property
    def weights(self) -> Array:
        """Weights (k,) of the samples in the mean.

            K^-1 Y

        with K and Y of the module.
        """
        return np.asarray(cho_solve((self.factor, True), (self.values - self.mean) / self.scale))

    def covariance(self, points: Array) -> Array:
        """cov(z, z) (i, k) of points (i, d) with the samples.

            a^2 (1 + r + r^2 / 3) exp(-r),    r^2 = 5 sum_i (u_i - v_i)^2 / l_i^2

        Matern's with nu = 5/2.
        """
        apart = (points[:, None] - self.points[None]) / self.lengths
        r = np.sqrt(5.0 * np.sum(apart**2, axis=2))
        return np.asarray(self.amplitude * (1.0 + r + r**2 / 3.0) * np.exp(-r))

    def predict(self, points: Array) -> tuple[Array, Array]:
        """Mean and standard deviation (i,) of the smooth part m + s z at points (i, d).

            m + s k^T K^-1 Y,    s sqrt(a^2 - k^T K^-1 k)

        Points are those of the unit box.
        """
        across = self.covariance(points)
        left = solve_triangular(self.factor, across.T, lower=True)
        deviation = np.sqrt(np.maximum(self.amplitude - np.sum(left**2, axis=0), 0.0))
        return self.mean + self.scale * (across @ self.weights), self.scale * deviation

    def left_out(self) -> tuple[Array, Array]:
        """Errors (k,) at every sample through all the others, and the standard deviations (k,) that
        they are expected to have.

            e_i = s [K^-1 Y]_i / [K^-1]_ii,    s / sqrt([K^-1]_ii)

        Source: doi:10.1162/08997660151134343.
        """
        inverse = np.diag(cho_solve((self.factor, True), np.eye(len(self.points))))
        return self.scale * self.weights / inverse, self.scale / np.sqrt(inverse)


def likeliest(
    points: Array, values: Array, largest: float, seed: int
) -> tuple[Array, float, float]:
    """Lengths (d,), amplitude and noise of greatest likelihood, the noise at most `largest`; of one
    sample those of the start.

    Points (k, d) of the unit box and values (k,) of mean zero and about unit variance.
    MissingFeature without the packages, InputError for points whose covariance is indefinite.
    """
    extras.need("families", "Kriging surrogate")
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    count, d = points.shape
    rough = WhiteKernel(min(1e-3, largest), (1e-10, largest))
    kernel = (
        ConstantKernel(1.0, AMPLITUDE)
        * Matern(0.5 if count <= FEW * d else np.full(d, 0.5), LENGTHS, nu=2.5)
        + rough
    )
    search = (
        {"optimizer": "fmin_l_bfgs_b", "n_restarts_optimizer": RESTARTS}
        if count > 1
        else {"optimizer": None}
    )
    for alpha in ALPHAS:
        try:
            with warnings.catch_warnings():
                # of bounds that are reached, which is where a parameter has no influence
                warnings.simplefilter("ignore")
                found = (
                    GaussianProcessRegressor(kernel, alpha=alpha, random_state=seed, **search)
                    .fit(points, values)
                    .kernel_
                )
        except np.linalg.LinAlgError:
            continue
        lengths = np.broadcast_to(found.k1.k2.length_scale, d).astype(np.float64)
        return lengths, float(found.k1.k1.constant_value), float(found.k2.noise_level + alpha)
    raise InputError(
        say(
            "kriging.fit",
            "samples with a definite covariance",
            f"{count} samples",
            "leave out nearly equal points",
        )
    )
