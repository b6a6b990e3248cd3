r"""Reduced parts: a body with few shape functions, which is a body again.

    r(s) = sum_b N_b(s) c_b,   Y = [x, y, z rows of all c (n, d s)]:    S = [1, c0, left singular vectors of the rest of Y]     (1)
    c = (S (x) I_d) z,    r(s) = sum_a Nbar_a(s) z_a,    Nbar = S^T N,    mass S^T M S

The basis acts on every component alike: it holds all translations, and with a state every rotation of it, so that a part does not
know in which direction it was trained. Joints are kept out of it: a part that was trained with one end pinned can be pinned at the
other. Law, section and places are those of the full body, so that `systems.assemble` takes both alike.

Positions at the places of a part are coordinates of their own, as far as they are independent (S -> [S B^+, S null(B)] with
the rows B of the places): joints there leave out or share unknowns, and link no others.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import qr
from scipy.sparse import csr_array, vstack

from ..bodies.body import Body, Cells, ShapePoints, locate, probe
from ..core.errors import InputError, say
from ..core.linalg import alike
from ..systems import lengths, shape_points
from ..systems.system import Affine, Elastic
from . import pod, sampling
from .hyper_reduction import USUAL
from .sampling import Level

APART = 1e-3  #: least pivot of the rows of places that are coordinates, over the largest
MISSES = 1e-9  #: distance of the reference from the shape functions, over the size of the body, from which it is refused


def metric(part: Body) -> csr_array:
    """W (b, b) over the mass of the body, alike for every component: coordinates of massless axes count by the body's size."""
    W = lengths.metric([part], alike(part.mass, part.dim)) / lengths.weight([part])
    return csr_array(W[:: part.dim, :: part.dim])


def shape_functions(part: Body, states: np.ndarray, tolerance: float | None = 1e-12, modes: int | None = None) -> np.ndarray:
    """S (b, m) of (1) from states (s, b, c) of a full body; eps = `tolerance` refers to the deviations from the field 1, or m.

    Coordinates at the places of the body come first, the others are orthonormal in the mass over that of the body.
    """
    columns = np.moveaxis(states, 0, 1).reshape(states.shape[1], -1)
    keep = np.column_stack([part.constant, part.reference])
    S = pod.of_vectors(columns, keep, None if modes else tolerance, modes, metric(part)).modes
    return with_places(part, S)


def with_places(part: Body, S: np.ndarray) -> np.ndarray:
    """The same space with the positions of independent places as its first coordinates; the others vanish there."""
    names = [*part.places, *part.frames]
    if not names:
        return S
    B = np.asarray(csr_array(vstack([probe(part, locate(part, name)) for name in names])) @ S)
    triangle, order = qr(B.T, mode="r", pivoting=True)
    pivots = np.abs(np.diag(triangle))
    B = B[np.sort(order[: int((pivots > APART * pivots[0]).sum())])]
    Q = qr(B.T)[0]
    return np.hstack([S @ np.linalg.pinv(B), S @ Q[:, len(B) :]])


def coordinates(part: Body, S: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Coordinates z (s, m, c) of the states (s, b, c) of a full body nearest in the mass."""
    W = metric(part)
    return (
        np.asarray(np.linalg.solve(S.T @ (W @ S), S.T @ (W @ np.moveaxis(states, 0, 1).reshape(len(S), -1))))
        .reshape(S.shape[1], len(states), -1)
        .transpose(1, 0, 2)
    )


def reduced_body(part: Body, S: np.ndarray) -> Body:
    """The body with the shape functions Nbar = S^T N of S (b, m), its elastic energy at all quadrature points."""
    if part.cells is None or part.shapes is not None:
        raise InputError(say(f"body '{part.name}'", "a full elastic body", "a reduced one" if part.shapes else "one without cells"))
    fields = np.column_stack([part.constant, part.reference])
    found = coordinates(part, S, fields[None])[0]
    if np.abs(S @ found - fields).max() > MISSES * np.abs(fields).max():
        raise InputError(say(f"body '{part.name}'", "shape functions that hold the reference and the field 1", "others"))
    spread = csr_array(S) if part.spread is None else csr_array(part.spread @ S)
    first = sorted(part.frames.items(), key=lambda one: one[1])
    rows = [np.arange(at, at + 1 + part.dim) for _, at in first]
    law, K, P, _, E = part.cells.law, *part.cells.table.shape
    table = np.einsum("kpbe,bea->kpea", part.cells.table, spread.toarray()[part.cells.nodes // part.dim], optimize=True)
    points = ShapePoints(
        law,
        np.ascontiguousarray(table.reshape(K, P * E, -1)),
        slice(0, S.shape[1] * part.dim),
        part.dim,
        part.cells.section.reshape(len(part.cells.section), 1, P * E),
        np.tile(np.arange(E), P),
    )
    return replace(
        part,
        reference=found[:, 1:],
        constant=found[:, 0],
        mass=symmetric(part.mass, S),
        stiffness=None if part.stiffness is None else symmetric(part.stiffness, S),
        cells=one_point(part.cells),
        spread=spread,
        frames={name: k * (1 + part.dim) for k, (name, _) in enumerate(first)},
        axes=csr_array(S[np.concatenate(rows)]) if rows else None,
        shapes=points,
    )


def symmetric(A: csr_array, S: np.ndarray) -> csr_array:
    """S^T A S (m, m)."""
    product = S.T @ (A @ S)
    product[np.abs(product) <= 1e-15 * np.abs(product).max()] = 0.0
    return csr_array(0.5 * (product + product.T))


def one_point(cells: Cells) -> Cells:
    """One quadrature point of every cell, which says law and section to pictures."""
    return Cells(cells.law, cells.table[:, :1], cells.nodes, cells.dim, cells.section[:, :1], cells.spread)


def sampled(part: Body, states: np.ndarray, tolerance: float = USUAL) -> Body:
    """A reduced body whose energy is that of few weighted points (ECSW), to the relative tolerance eta at its states (s, m, c)."""
    if part.shapes is None:
        raise InputError(say(f"body '{part.name}'", "a reduced body", "a full one", "reduce it first: parts.reduced_body"))
    n = part.reference.size
    rows = shape_points.carry(part.shapes, part.name, Affine(np.eye(n), np.zeros(n)), np.eye(n), np.zeros(n))
    member = Elastic(part.name, 0.0, rows)
    sample, _, _ = sampling.solve([([member], states.reshape(len(states), -1))], 0, tolerance, Level.POINTS)
    kept, points = sample.indices, part.shapes
    section = points.section[:, :, kept].copy()
    section[-1] *= sample.weights
    few = replace(points, table=np.ascontiguousarray(points.table[:, kept]), section=section, cell=points.cell[kept])
    return replace(part, shapes=few)


def placed(part: Body, name: str, origin: np.ndarray | None = None, rotation: np.ndarray | None = None) -> Body:
    """A reduced body elsewhere under another name: x -> origin + rotation x, (c,) [m] and a proper rotation (c, c)."""
    R = np.eye(part.dim) if rotation is None else np.asarray(rotation, dtype=float)
    if R.shape != (part.dim, part.dim) or np.abs(R @ R.T - np.eye(part.dim)).max() > MISSES or np.linalg.det(R) < 0.0:
        remedy = "a mirrored part is another part: train it from a mirrored mesh"
        raise InputError(say(f"part '{name}'", f"a rotation ({part.dim}, {part.dim}) that mirrors nothing", R.tolist(), remedy))
    shift = np.zeros(part.dim) if origin is None else np.asarray(origin, dtype=float)
    return replace(part, name=name, reference=part.reference @ R.T + np.outer(part.constant, shift))
