"""Vectors of three numbers in compiled loops over points, as tuples: the compiler keeps them in
registers, side by side.

They are inlined: a stress of a shell at 1024 points takes 10 us as vector instructions, 47 us where
calls stand in the loop.
"""

from __future__ import annotations

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
def combine(f: float, a: Vector, h: float, b: Vector) -> Vector:
    """f a + h b."""
    return f * a[0] + h * b[0], f * a[1] + h * b[1], f * a[2] + h * b[2]


@inlined
def held_product(way: int, u: Vector, v: Vector, a: Vector, b: Vector) -> float:
    """Product of vectors a, b that are held for u, v, see `laws.call_modulus`.

        a.b    or, where `way` is LINEAR,    a.v + u.b - a.b

    The latter is what is linear in u - a and v - b of u.v.
    """
    return dot(a, v) + dot(u, b) - dot(a, b) if way == LINEAR else dot(a, b)
