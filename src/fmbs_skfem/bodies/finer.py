"""A reduced part with the shapes that it knows it lacks: the body that it is measured by.

    r = sum_b N_b c_b + sum_t T_t d_t,    F = [S, T],    energy at all quadrature points

Coordinates of the part come first, so that its states are states of the finer body with d = 0.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array, hstack

from .body import Body, ShapePoints


def knows_more(part: Body) -> bool:
    """Whether a body is a part that knows shapes beside its own, and is to be held against them.

    That is so of reduced bodies whose training has kept such shapes (`MissingShapes`) or that know
    small strains alone, unless they say `checked` False, and of bodies of matrices with more modes in
    reserve.
    """
    points = part.shapes
    if points is None:
        return part.spare is not None
    return points.checked and (part.linear is not None or knows_shapes(points))


def knows_shapes(points: ShapePoints) -> bool:
    """Whether points of a reduced body know shapes beside its own, as functions over its space."""
    return points.missing is not None and points.missing.over_space.size > 0


def finer(part: Body) -> Body:
    """The part with the functions F (b + t) of its training; any other body, or one that knows no
    T, as it is.

        F = [S, T]

    Of a part that knows small strains alone, and no T, the same functions with all strains.
    Coordinates of T are zero in the reference, so that a state of the part is one of the finer
    body; mass, spread and frames grow by the blocks of T, and the energy is that of all quadrature
    points.
    """
    if not knows_more(part):
        return part
    if part.spare is not None:
        return part.spare
    points = part.shapes
    assert points is not None
    assert part.spread is not None
    if not knows_shapes(points):
        return replace(part, linear=None)
    missing = points.missing
    assert missing is not None
    b = len(part.reference)
    f = missing.functions.shape[2]
    n = part.spread.shape[0]
    none = np.zeros((f - b, part.dim))
    total = part.total_mass
    beside, inertia = total * missing.mass[b:], total * missing.inertia
    mass = np.block([[part.mass.toarray(), beside.T], [beside, inertia]])
    every = ShapePoints(
        points.law,
        missing.functions,
        slice(0, f * part.dim),
        part.dim,
        missing.section,
        np.zeros(missing.functions.shape[1], dtype=np.int64),
        positions=missing.positions,
    )
    return replace(
        part,
        reference=np.vstack([part.reference, none]),
        constant=np.append(part.constant, none[:, 0]),
        mass=csr_array(mass),
        spread=csr_array(hstack([part.spread, csr_array(missing.over_space[:n])])),
        directors=None
        if part.directors is None
        else csr_array(hstack([part.directors, csr_array(missing.over_space[n:])])),
        axes=None if part.axes is None else csr_array(hstack([part.axes, csr_array(missing.axes)])),
        shapes=every,
        linear=None,
    )
