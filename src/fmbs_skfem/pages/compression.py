r"""Motions of points in few numbers: an affine motion of the reference, and modes of what is left.

    r(s, x) = A(s) [1, X(x)] + sum_m a(s, m) phi(m, x),        f(s, x) = sum_m b(s, m) psi(m, x)

The modes are a proper orthogonal decomposition of what an affine motion does not tell, found in
rounds: they are stored as half floats, and every round takes what the rounding of the one before
has left. Full and reduced models so take one path, and a longer motion costs its coordinates alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core.storage.records import dataclass
from ..results.frames import Array

AFFINE = 12  #: numbers of an affine motion: three rows of a shift and a matrix
MOST = 64  #: modes of a body, which the page keeps as numbers of its programs
#: in the modes of a field, and the fewest modes that it may have where there are many points
NUMBERS, FEWEST = (
    250_000,
    8,
)
#: instants whose correlation is decomposed; all instants are told by the modes found
SNAPSHOTS = 160
ROUNDS = 4  #: each leaves about a thousandth of the one before, as half floats have eleven digits


@dataclass(frozen=True)
class PageShape:
    """What the page draws a body of."""

    modes: np.ndarray  #: (m, x, 3) half floats, the largest entry of each is 1
    coordinates: Array  #: (s, AFFINE + m) [m] and [-]
    error: float  #: largest distance from the points that it stands for [m]


@dataclass(frozen=True)
class Values:
    """A field of a body."""

    modes: np.ndarray  #: (m, x) half floats
    coordinates: Array  #: (s, m)
    error: float  #: the largest one


def of_points(points: Array, reference: Array, tolerance: float) -> PageShape:
    """Points (s, x, 3) from their reference (x, 3), both from one origin, to a tolerance [m] where
    MOST modes reach it.
    """
    corner = np.column_stack([np.ones(len(reference)), reference])
    affine = np.einsum("kx,sxc->skc", np.linalg.pinv(corner, rcond=1e-9), points)
    rest = (points - np.einsum("xk,skc->sxc", corner, affine)).reshape(len(points), -1)
    modes, amplitudes = decompose(rest, tolerance / 2.0)
    coordinates = np.column_stack(
        [affine.transpose(0, 2, 1).reshape(len(points), AFFINE), amplitudes]
    )
    found = PageShape(modes.reshape(len(modes), len(reference), 3), coordinates, 0.0)
    return replace(
        found,
        error=float(np.linalg.norm(points - points_of(found, reference), axis=2).max(initial=0.0)),
    )


def points_of(shape: PageShape, reference: Array) -> Array:
    """The points (s, x, 3) that a shape tells."""
    affine = shape.coordinates[:, :AFFINE].reshape(-1, 3, 4)
    corner = np.column_stack([np.ones(len(reference)), reference])
    flat = shape.modes.reshape(len(shape.modes), reference.size).astype(float)
    return np.asarray(
        np.einsum("xk,sck->sxc", corner, affine)
        + (shape.coordinates[:, AFFINE:] @ flat).reshape(-1, *reference.shape)
    )


def of_values(values: Array, tolerance: float) -> Values:
    """Values (s, x) to a tolerance where modes of NUMBERS numbers in all reach it."""
    modes, amplitudes = decompose(
        values.copy(), tolerance, int(np.clip(NUMBERS // values.shape[1], FEWEST, MOST))
    )
    return Values(
        modes, amplitudes, float(np.abs(values - amplitudes @ modes.astype(float)).max(initial=0.0))
    )


def decompose(rest: Array, tolerance: float, most: int = MOST) -> tuple[np.ndarray, Array]:
    """Modes (m, i) as half floats and amplitudes (s, m) of values (s, i), which are left with what
    is not told.
    """
    modes: list[np.ndarray] = []
    amplitudes: list[Array] = []
    for _ in range(ROUNDS):
        for mode in leading(rest, tolerance):
            largest = float(np.abs(rest).max(initial=0.0))
            if largest <= tolerance or len(modes) == most:
                break
            rounded = (mode / np.abs(mode).max()).astype(np.float16)
            exact = rounded.astype(float)
            amplitude = rest @ exact / (exact @ exact)
            rest -= np.outer(amplitude, exact)
            modes.append(rounded)
            amplitudes.append(amplitude)
    if not modes:
        return np.zeros((0, rest.shape[1]), np.float16), np.zeros((len(rest), 0))
    return np.array(modes), np.array(amplitudes).T


def leading(rest: Array, tolerance: float) -> Array:
    """Leading modes (m, i) of values (s, i), the first one first, from at most SNAPSHOTS of their
    instants.

    A mode below a tenth of the tolerance, which is that of single entries, is noise of those before
    it.
    """
    some = rest[
        np.unique(np.linspace(0, len(rest) - 1, min(len(rest), SNAPSHOTS)).round().astype(int))
    ]
    energies, vectors = np.linalg.eigh(some @ some.T)
    sizes = np.sqrt(np.maximum(energies[::-1], 0.0))
    kept = int(np.sum((sizes > 0.1 * tolerance) & (sizes > 1e-7 * max(sizes[0], 1e-300))))
    return np.asarray(vectors[:, ::-1][:, :kept].T @ some)
