"""Vectors of three numbers in compiled loops over points, as tuples: the compiler keeps them in
registers, side by side.

They are inlined: loops in which calls stand become no vector instructions.
"""

from __future__ import annotations

import numpy as np

from ..core.compiling.jit import inlined

Vector = tuple[float, float, float]
#: what a modulus takes from the gradients that it holds: axial forces (and those of shells), those
#: of strains that are linear from there to its own gradients, or all stresses
AXIAL, LINEAR, ALL = range(3)


@inlined
def dot(a: Vector, b: Vector) -> float:
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(f: float, a: Vector, b: Vector) -> Vector:
    """f a x b of a factor f and vectors a and b, in compiled code."""
    return (
        f * (a[1] * b[2] - a[2] * b[1]),
        f * (a[2] * b[0] - a[0] * b[2]),
        f * (a[0] * b[1] - a[1] * b[0]),
    )


@inlined
def vector(u: np.ndarray, k: int, q: int) -> Vector:
    """Vector k of point q: the rows 3 k, 3 k + 1 and 3 k + 2 of gradients u (i, p e), in compiled
    code.
    """
    return u[3 * k, q], u[3 * k + 1, q], u[3 * k + 2, q]
