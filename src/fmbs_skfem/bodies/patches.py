r"""NURBS patches of one body: where they are joined, what follows from others there, springs that
keep angles, pieces.

    A q = 0 along the seams (`shapes.seams`):    q = S q,    S the identity but for q_i = -X_ij q_j of those that A determines

Patches that share the functions of an edge need nothing but springs against folding
(`interfaces.penalty_stiffness`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array, csr_array, eye_array, vstack
from scipy.sparse.csgraph import connected_components

from ..core.algebra import ranks
from ..core.errors import InputError, say
from ..core.notices import notify
from ..shapes import interfaces, nurbs, seams
from ..shapes.surface import Surface
from .sections import Material


def joined_edges(shape: Surface) -> list[tuple[str, str]]:
    """Pairs of names of edges that are one line inside the surface: edges with common functions,
    and seams.

    None where the surface is not made of NURBS patches.
    """
    return [*shape.space.joined, *shape.space.seams] if isinstance(shape.space, nurbs.Nurbs) else []


def tell_closed(where: str, shape: Surface) -> None:
    """A notice of NURBS patches whose own edges coincide, so that they are closed, where `join` is
    not said.

    `where` is the place in messages.
    """
    for one, other in joined_edges(shape):
        patch, _, _ = one.rpartition(".")
        if shape.space.join is None and patch == other.rpartition(".")[0]:
            text = f"the edges '{one}' and '{other}' of one patch coincide and are joined, so that it is closed"
            notify(
                f"{where}: {text}; say 'join: true' if that is meant, 'join: false' if it is slit there"
            )


def fold_springs(
    where: str, shape: Surface, thickness: float | np.ndarray, material: Material
) -> csr_array | None:
    """Stiffness (n, n) that keeps the angle along lines where NURBS patches are continuous only;
    None where there are none.

    It is `interfaces.penalty_stiffness` and acts on every component alike [N/m], with the bending
    stiffness [N m]

        E t^3 / (12 (1 - nu^2))

    `thickness` t [m] is a number or one a cell (e,). InputError where a patch of degree 1 has
    several cells in that direction.
    """
    if not isinstance(shape.space, nurbs.Nurbs):
        return None
    pairs = interfaces.common_edges(shape)
    if not pairs and not shape.space.seams:
        return None
    for patch in shape.space.patches.values():
        if any(
            spline.degree == 1 and count > 1
            for spline, count in zip(patch.lines, patch.cells, strict=True)
        ):
            got = f"degrees {patch.degree1} and {patch.degree2} over {patch.cells[0]} x {patch.cells[1]} cells"
            raise InputError(
                say(
                    where,
                    "degree 2 or more where cells meet, because they bend",
                    got,
                    "raise 'degree'",
                )
            )
    bending = (
        material.young_modulus
        * np.asarray(thickness) ** 3
        / (12.0 * (1.0 - material.poisson_ratio**2))
    )
    return interfaces.penalty_stiffness(shape, pairs, bending)


def tie(shape: Surface) -> tuple[Surface, csr_array]:
    """Functions from those that are free along seams: S (n, n), and the surface, whose gaps there
    are closed.

    Those that follow are of the sides that have the multipliers, as far as possible, which are the
    finer ones.
    """
    identity = csr_array(eye_array(shape.count))
    found = seams.seams(shape) if isinstance(shape.space, nurbs.Nurbs) else []
    if not found:
        return shape, identity
    finer = np.zeros(shape.count, dtype=bool)
    for seam in found:
        finer[seam.b.rows(seam.points(1)[1]).indices] = True
    first, second, X = ranks.determined(
        csr_array(vstack([seams.rows(seam) for seam in found])), finer
    )
    i, j = np.nonzero(X)
    follow = coo_array((-X[i, j], (first[i], second[j])), shape=identity.shape)
    own = np.ones(shape.count)
    own[first] = 0.0
    S = csr_array(coo_array((own, (np.arange(shape.count),) * 2), shape=identity.shape) + follow)
    S.eliminate_zeros()
    before = {name: shape.reference[numbers] for name, numbers in shape.space.numbers.items()}
    return replace(
        shape, reference=S @ seams.follow(before, shape.space.numbers, S @ shape.reference)
    ), S


def check_one_piece(where: str, shape: Surface, spread: csr_array) -> None:
    """Refuse patches that neither functions, nor seams, nor rims connect, unless `join` is false;
    `spread` (n, b) as in `Body`.

    Cells that read a common function of the body are one piece; InputError tells the pieces by
    their number of cells and their patches.
    """
    if (
        not isinstance(shape.space, nurbs.Nurbs)
        or shape.space.join is False
        or len(shape.space.patches) == 1
    ):
        return
    cells, functions = shape.nodes.shape
    reads = csr_array(
        (np.ones(shape.nodes.size), shape.nodes.ravel(), np.arange(cells + 1) * functions),
        shape=(cells, shape.count),
    )
    links = csr_array(reads @ abs(spread))
    count, label = connected_components(csr_array(links @ links.T), directed=False)
    if count > 1:
        first = np.cumsum(
            [0, *(patch.cells[0] * patch.cells[1] for patch in shape.space.patches.values())]
        )[:-1]
        names = np.array(list(shape.space.patches))
        texts = [
            f"{np.sum(label == k)} cells ({', '.join(names[label[first] == k])})"
            for k in range(count)
        ]
        remedy = "close the gaps between their sides, join them by a rim, or make a body of each; 'join: false' lets them be"
        raise InputError(say(where, "one piece", f"{count} parts: {'; '.join(texts[:3])}", remedy))
