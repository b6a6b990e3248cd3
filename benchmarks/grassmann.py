r"""Interpolation of subspaces: geodesics on the Grassmann manifold of r-dimensional subspaces of
R^n.

    Y0^T Y1 = V cos(theta) W^T,    H = Y1 W - Y0 V cos(theta),    |H_i| = sin(theta_i)
    log_Y0 Y1 = H diag(theta / sin(theta)) V^T,        exp_Y0 D = Y0 V cos(S) V^T + U sin(S) V^T    with    D = U S V^T
    Y(mu) = exp_Y0( sum_j l_j(mu) log_Y0 Y_j )

theta are the principal angles, Y (n,r) orthonormal columns, l_j the Lagrange polynomials of a
tensor grid of nodes. A subspace is interpolated, not its columns: other columns of the same
subspaces give the same result. The logarithm needs every angle below a right one. Whatever linear
equations all Y_j satisfy, Y(mu) satisfies: it is a combination of their columns.

Sources: D. Amsallem, C. Farhat, AIAA J. 46 (2008) 1803-1813, doi 10.2514/1.35374; A. Edelman, T. A.
Arias, S. T. Smith, SIAM J. Matrix Anal. Appl. 20 (1998) 303-353, doi 10.1137/S0895479895290954.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg

from fmbs_skfem.core.algebra import ranks
from fmbs_skfem.core.errors import InputError, say
from fmbs_skfem.core.storage.records import dataclass
from fmbs_skfem.core.values.arrays import finite
from fmbs_skfem.reduction import affine

RIGHT = 1e-7  #: cosine below which an angle counts as a right one


@dataclass(frozen=True)
class Chart:
    """Subspaces at the nodes of a tensor grid, as tangent vectors at one of them.

    `tangents[j]` = log_Y0 Y_j, of which the subspace elsewhere is the exponential of a combination.
    """

    axes: tuple[np.ndarray, ...]  #: nodes (k_d,) of every parameter
    base: np.ndarray  #: (n, r), orthonormal columns
    tangents: np.ndarray  #: (j, n, r), the last parameter fastest


def orthonormal(columns: np.ndarray) -> np.ndarray:
    """Orthonormal columns (n, r) of the subspace that linearly independent columns (n, r) span."""
    wanted = "a matrix of finite columns, at most as many as rows"
    columns = finite(columns, "grassmann", wanted, None, None)
    if columns.shape[1] > columns.shape[0]:
        raise InputError(say("grassmann", wanted, f"shape {columns.shape}"))
    if ranks.rank(columns.T) < columns.shape[1]:
        raise InputError(
            say(
                "grassmann",
                "linearly independent columns",
                f"{columns.shape[1]} dependent ones",
                "leave some out",
            )
        )
    return np.asarray(np.linalg.qr(columns)[0])


def distance(one: np.ndarray, other: np.ndarray) -> float:
    """Length of the shortest geodesic between two subspaces: the norm of their principal angles
    [rad].

    |theta| of the angles theta (r,) between orthonormal or independent columns (n, r).
    """
    return float(np.linalg.norm(scipy.linalg.subspace_angles(one, other)))


def log(base: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Tangent vector (n, r) at `base` that leads to `other`; orthonormal columns (n, r) both.

    H diag(theta / sin(theta)) V^T as in the module. InputError for other shapes, and where a
    principal angle is a right one.
    """
    if base.shape != other.shape:
        raise InputError(
            say(
                "grassmann.log",
                f"a subspace of shape {base.shape}",
                f"{other.shape}",
                "keep equally many modes",
            )
        )
    V, cosine, W = np.linalg.svd(base.T @ other)
    if cosine.min() < RIGHT:
        remedy = (
            "the subspaces are too far apart for an interpolation; take more nodes or fewer modes"
        )
        raise InputError(
            say("grassmann.log", "principal angles below a right one", "pi / 2", remedy)
        )
    normal = other @ W.T - base @ (V * cosine)
    sine = np.linalg.norm(normal, axis=0)
    ratio = np.divide(np.arctan2(sine, cosine), sine, out=np.ones_like(sine), where=sine > 0.0)
    return np.asarray((normal * ratio) @ V.T)


def exp(base: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """The subspace (n, r) at the end of the geodesic that leaves `base` along `tangent`.

    Y0 V cos(S) V^T + U sin(S) V^T with the tangent D = U S V^T, made orthonormal once more.
    """
    U, size, V = np.linalg.svd(tangent, full_matrices=False)
    return orthonormal((base @ V.T * np.cos(size) + U * np.sin(size)) @ V)


def chart(
    axes: Sequence[np.ndarray], subspaces: Sequence[np.ndarray], reference: int | None = None
) -> Chart:
    """Tangent vectors of the subspaces (n, r) at the nodes of a tensor grid, the last parameter
    fastest.

    The reference is the subspace whose farthest other one is nearest, unless its number is given.
    """
    nodes = tuple(np.asarray(axis, dtype=np.float64) for axis in axes)
    wanted = int(np.prod([len(axis) for axis in nodes]))
    if wanted != len(subspaces) or any(len(np.unique(axis)) < len(axis) for axis in nodes):
        raise InputError(
            say(
                "grassmann.chart",
                f"distinct nodes and one subspace for each of the {wanted}",
                f"{len(subspaces)}",
            )
        )
    if len({space.shape for space in subspaces}) > 1:
        shapes = sorted({space.shape for space in subspaces})
        raise InputError(
            say(
                "grassmann.chart",
                "subspaces of one shape",
                shapes,
                "keep equally many modes at every node",
            )
        )
    planes = [orthonormal(space) for space in subspaces]
    base = planes[find_central(planes) if reference is None else reference]
    return Chart(nodes, base, np.stack([log(base, plane) for plane in planes]))


def find_central(planes: Sequence[np.ndarray]) -> int:
    """Number of the subspace whose farthest other one is nearest; the first of several."""
    count = len(planes)
    apart = np.zeros((count, count))
    for i in range(count):
        for j in range(i):
            apart[i, j] = apart[j, i] = distance(planes[i], planes[j])
    return int(np.argmin(apart.max(axis=1)))


def interpolate(subspaces: Chart, point: Sequence[float] | np.ndarray) -> np.ndarray:
    """Orthonormal columns (n, r) of the subspace at a point (d,), exact at the nodes.

    exp_Y0(sum_j l_j(mu) log_Y0 Y_j); beyond the nodes the polynomials go on.
    """
    weights = np.ones(1)
    for nodes, value in zip(subspaces.axes, np.asarray(point, dtype=np.float64), strict=True):
        weights = np.kron(weights, affine.basis(nodes, float(value), logarithmic=False))
    return exp(subspaces.base, np.einsum("j,jnr->nr", weights, subspaces.tangents))
