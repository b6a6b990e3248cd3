r"""Slopes of NURBS patches tied exactly along the lines where their functions are continuous only.

At an inner knot repeated p times, and where a patch closes on itself, one function c_k lies on the
line, and both sides have

    dr/dxi- = a (c_k - c_k-1),   dr/dxi+ = b (c_k+1 - c_k),    a = w_k-1 / (w_k h-),   b = w_k+1 / (w_k h+)

up to a common factor, with h the lengths of the spans. Where a and b are the same for all functions
along the line and the reference shape has dr/dxi- = s dr/dxi+ with one s, as in every circle of
equal arcs and what is swept along or about it, the surface has no kink in any motion if

    c_k = t c_k-1 + (1 - t) c_k+1,     t = a / (a + s b),

which takes c_k out of the unknowns: no spring, no round-off of one. G. Farin, Curves and Surfaces
for CAGD, 5th ed., Morgan Kaufmann 2002, ch. 8 and 13 (geometric continuity of rational curves).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core.algebra.linalg import distinct
from . import line, nurbs
from .nurbs import Nurbs, Patch
from .surface import Surface
from .table import Floats, Ints

SAME = 1e-9  #: relative differences below which factors along a line, and slopes on its sides, are the same


def tie_slopes(shape: Surface) -> Surface:
    """The surface with the functions left out that follow from their neighbours; itself where there
    are none.
    """
    space: Nurbs = shape.space
    uses = np.concatenate([distinct(array) for array in space.numbers.values()])
    alone = np.bincount(uses, minlength=shape.count) == 1
    ties = {
        name: tuple(
            _ties(patch, shape.reference[space.numbers[name]], space.numbers[name], alone, axis)
            for axis in (0, 1)
        )
        for name, patch in space.patches.items()
    }
    gone = np.zeros(shape.count, dtype=bool)
    for name, array in space.numbers.items():
        for axis in (0, 1):
            gone[np.take(array, list(ties[name][axis]), axis)] = True
    if not gone.any():
        return shape
    place = np.where(gone, -1, np.cumsum(~gone) - 1)
    nodes = [
        place[array[_functions(patch, ties[name])].reshape(patch.cells[0] * patch.cells[1], -1)]
        for (name, array), patch in zip(space.numbers.items(), space.patches.values(), strict=True)
    ]
    numbers = {name: place[array] for name, array in space.numbers.items()}
    return replace(
        shape,
        space=replace(space, numbers=numbers, ties=ties),
        nodes=np.concatenate(nodes),
        reference=shape.reference[~gone],
        unit=shape.unit[~gone],
    )


def _functions(patch: Patch, ties: tuple[dict[int, float], ...]) -> tuple[Ints, Ints]:
    """Functions of both directions of every cell, (e2, e1, b2, b1): an index of numbers (n1, n2)."""
    one, two = (
        nurbs.local_functions(spline, found)[0]
        for spline, found in zip(patch.lines, ties, strict=True)
    )
    first, second = np.broadcast_arrays(one[None, :, None, :], two[:, None, :, None])
    return first, second


def _ties(
    patch: Patch, control: Floats, numbers: Ints, alone: np.ndarray, axis: int
) -> dict[int, float]:
    """Functions k of a direction that follow from k - 1 and k + 1, and their shares t of k - 1."""
    spline = patch.lines[axis]
    weights = np.ones(patch.shape) if patch.weights is None else patch.weights
    points, w, own = (
        np.moveaxis(control, axis, 0),
        np.moveaxis(weights, axis, 0),
        np.moveaxis(numbers, axis, 0),
    )
    ends = line.breaks(spline)
    last = spline.count - 1
    found: dict[int, float] = {}
    if spline.degree < 2:
        return found
    for i, knot in enumerate(ends[1:-1], start=1):
        k = int(np.searchsorted(spline.knots, knot)) - 1
        if np.count_nonzero(spline.knots == knot) == spline.degree and alone[own[k]].all():
            share = _share(
                points[[k - 1, k, k + 1]],
                w[k - 1] / w[k],
                w[k + 1] / w[k],
                *np.diff(ends[i - 1 : i + 2]),
            )
            found |= {} if share is None else {k: share}
    if np.array_equal(own[0], own[last]) and alone[own[0]].all():
        spans = np.diff(ends)[[-1, 0]]
        share = _share(points[[last - 1, last, 1]], w[last - 1] / w[last], w[1] / w[0], *spans)
        found |= {} if share is None else {0: share, last: share}
    return found


def _share(
    points: Floats, before: Floats, after: Floats, left: float, right: float
) -> float | None:
    """t of the functions (3, n, c) around a line with ratios of weights (n,) and lengths of spans;
    None where there is none.
    """
    a, b = before[0] / left, after[0] / right
    slopes = a * (points[1] - points[0]), b * (points[2] - points[1])
    s = float(np.vdot(*slopes) / np.vdot(slopes[1], slopes[1]))
    size = float(np.abs(slopes[0]).max())
    straight = np.abs(slopes[0] - s * slopes[1]).max() <= SAME * size
    alike = max(np.ptp(before) / before[0], np.ptp(after) / after[0]) <= SAME
    return a / (a + s * b) if s > 0.0 and straight and alike else None
