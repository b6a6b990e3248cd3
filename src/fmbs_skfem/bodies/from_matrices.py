r"""Bodies that come as matrices: a finite-element part of another program.

    T = 1/2 sum_c v_c^T m v_c,    W = 1/2 d^T K d,    M = m (x) 1,    K R = 0 of all rigid motions R

Nodes of a rigid interface (RBE2) are slaved to a frame, r_i = c + X_i e_1 + Y_i e_2 + Z_i e_3. An
average (RBE3) has a frame without mass that follows its nodes: it stands at their mean and turns as
they do in the least squares of their displacements,

    c = sum_i w_i r_i,    e_j . a_k = e_k . a_j,    a_k = sum_i w_i X_ik (r_i - c),    w_i = 1 / n

with X_i the places of the nodes about their mean in the reference; on a face w_i = int N_i dA / A, so
that a force is an even traction and a moment one that is linear. Both are exact for rotations of
any size. Where an interface has a centre of its own, joints and loads act at c + o_k e_k, with o_k
its distances from the mean, so that no centre changes the body.

Source: R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313-1319, doi 10.2514/3.4741 (what becomes
of them, see `parts.condensation`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

import numpy as np
from scipy.sparse import csr_array, eye_array, hstack, kron, vstack

from ..core.algebra.linalg import Array, alike, as_csr, selection
from ..core.errors import InputError, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values import arrays
from ..core.values.arguments import checked
from ..shapes.table import Nodes
from .body import Body, LinearElasticity
from .rigid import SLIM

ALIKE = 1e-12  #: difference of two entries, over the largest ones of their rows, that is round-off
# seven digits of a file are 5e-8 of an entry
ROUNDED = 1e-5  #: the same, up to which it comes from the digits of a file
#: force of a rigid motion, over the sum of the sizes of its terms, that the digits of a file leave
RIGID = 1e-5
ROUND_OFF = 1e-14  #: distance of a node from the middle of its set, over the largest, that is none
FLAT = 1e-6  #: second moment of the nodes of an interface, over the largest, that is none


@dataclass(frozen=True)
@checked
class Coupling:
    """Nodes of a body that move as one rigid frame (`rigid`), or whose mean motion a frame follows.

    The frame stands at `center` (3,) [m], by default the mean of its nodes. Nodes (i,) count from 0;
    `weights` (i,) are those of the mean, by default all alike, of a face its area by the functions
    of its nodes.
    """

    nodes: Annotated[tuple[int, ...], "numbers of nodes, from 0"]
    rigid: bool = True
    center: tuple[float, float, float] | None = None
    weights: tuple[float, ...] | None = None


def from_matrices(
    name: str,
    nodes: np.ndarray,
    stiffness: Array,
    mass: Array,
    damping: Array | None = None,
    *,
    unit: np.ndarray | None = None,
    interfaces: Mapping[str, Coupling] | None = None,
    places: Mapping[str, int] | None = None,
    recovery: Mapping[str, Array] | None = None,
    prestress: Array | None = None,
    origin: np.ndarray | None = None,
    rotation: np.ndarray | None = None,
) -> Body:
    """A body of n nodes (n, 3) [m] with K, M and C (3 n, 3 n), unknowns node by node, x, y, z of
    each; M may be (n, n), alike for every component.

    `unit` (n,) is 1 where a coordinate is a position, by default everywhere, 0 where it is a
    gradient. `interfaces` become frames, `places` are single nodes; `recovery` has rows (6 k, 3 n) of
    the stresses xx, yy, zz, xy, yz, zx of k points in the axes of the body [Pa/m], `prestress` (3 n,
    3 n) is what stresses of a steady spin add to K; `origin` (3,) [m] and
    `rotation` (3, 3) move the body, x <- origin + rotation x. InputError where the matrices are not
    those of a free elastic body: not symmetric, bound, in other axes, or of unlike components.
    """
    where = f"body '{name}'"
    nodes = arrays.finite(nodes, f"{where}: nodes", "positions (n, 3) [m]", None, 3)
    n = len(nodes)
    unit = np.ones(n) if unit is None else arrays.finite(unit, f"{where}: unit", f"{n} numbers", n)
    m = of_components(where, mass, n)
    K = symmetric(where, "stiffness", stiffness, 3 * n)
    C = None if damping is None else symmetric(where, "damping", damping, 3 * n)
    Kg = None if prestress is None else symmetric(where, "prestress", prestress, 3 * n)
    refuse_bound(where, K, nodes, unit)
    found = interfaces or {}
    for key, one in found.items():
        check_interface(f"{where}: interface '{key}'", one, nodes, unit)
    rows = {
        key: stress_rows(f"{where}: recovery '{key}'", one, 3 * n)
        for key, one in (recovery or {}).items()
    }
    turn = np.eye(3) if rotation is None else rotation
    if rotation is not None:
        Q = csr_array(kron(eye_array(n), turn))
        rows = {key: as_csr(one @ Q.T) for key, one in rows.items()}
        K = as_csr(Q @ K @ Q.T)
        C, Kg = (None if one is None else as_csr(Q @ one @ Q.T) for one in (C, Kg))
    spread, reference, constant = tie(where, nodes, unit, found)
    reference = reference @ turn.T
    if origin is not None:
        reference += np.outer(constant, origin)
    wide = as_csr(alike(spread, 3) @ small_rotations(spread, found, turn))
    whole = not found
    points = {
        key: node_row(f"{where}: place '{key}'", node, n) for key, node in (places or {}).items()
    }
    heavy = as_csr(spread.T @ m @ spread)
    axes = None if whole else axes_of(found, spread, nodes, unit)
    shown = [one @ spread for one in points.values()]
    shown += [] if axes is None else [axes[[4 * k]] for k in range(len(found))]
    return Body(
        name,
        reference,
        heavy,
        constant,
        points,
        Nodes(n),
        radius=SLIM * float(np.ptp(nodes, axis=0).max()),
        outline=through_center(shown, heavy @ constant / (constant @ (heavy @ constant))),
        frames={key: 4 * k for k, key in enumerate(found)},
        axes=axes,
        spread=None if whole else spread,
        linear=LinearElasticity(
            as_csr(wide.T @ K @ wide),
            None if C is None else as_csr(wide.T @ C @ wide),
            None if Kg is None else as_csr(wide.T @ Kg @ wide),
        ),
        recovery={key: as_csr(one @ wide) for key, one in rows.items()},
        fits={key: mean_axes(one, nodes, unit) for key, one in found.items() if not one.rigid},
    )


def through_center(rows: list[csr_array], center: np.ndarray) -> np.ndarray:
    """Rows (x, b) of a line from place to place, by way of the centre of mass (b,) where they are
    one or two.
    """
    places = [one.toarray() for one in rows]
    if len(places) > 2:
        return np.vstack([*places, places[0]])
    return np.vstack([*places[:1], center[None], *places[1:]])


def of_components(where: str, mass: Array, n: int) -> csr_array:
    """m (n, n) of a mass m (x) 1, given as itself or as (3 n, 3 n).

    InputError where components have other masses, or share some.
    """
    if mass.shape == (n, n):
        return symmetric(where, "mass", mass, n)
    M = symmetric(where, "mass", mass, 3 * n)
    parts = [as_csr(M[k::3, k::3]) for k in range(3)]
    m = as_csr(sum(parts[1:], parts[0]) / 3.0)
    size = float(abs(m).max())
    unlike = max(float(abs(one - m).max()) for one in parts)
    crossed = float(abs(M - alike(m, 3)).max())
    if max(unlike, crossed) > ROUNDED * size:
        got = "one that couples them" if crossed > unlike else "others"
        left = "local axes of nodes, rotations or drilling unknowns are left in"
        remedy = f"{left}: export translations in global axes, and condense all others"
        raise InputError(say(f"{where}: mass", "one that is alike for x, y and z", got, remedy))
    if float(m.diagonal().min()) < 0.0 or not float(np.ones(n) @ (m @ np.ones(n))) > 0.0:
        raise InputError(say(f"{where}: mass", "positive masses", "negative ones, or none"))
    return m


def symmetric(where: str, what: str, A: Array, size: int) -> csr_array:
    """A matrix (i, i), i = `size`, by the mean of itself and its transposed one.

    InputError for another size, numbers that are not finite, and entries ij and ji that differ by
    more than the digits of a file.
    """
    A = as_csr(A)
    if A.shape != (size, size):
        nodes = size // 3
        remedy = "unknowns are x, y, z of every node"
        if A.shape == (2 * size, 2 * size):
            remedy = (
                "rotations are left in: condense them in the program that made it, or take solids"
            )
        got = f"({A.shape[0]}, {A.shape[1]})"
        raise InputError(
            say(f"{where}: {what}", f"({size}, {size}) for {nodes} nodes", got, remedy)
        )
    if not np.isfinite(A.data).all():
        raise InputError(say(f"{where}: {what}", "finite numbers", "others"))
    largest = np.sqrt(np.maximum(abs(A).max(axis=1).toarray().ravel(), 1e-300))
    units = csr_array((1.0 / largest, (np.arange(size), np.arange(size))), shape=A.shape)
    apart = abs(units @ (A - A.T) @ units)
    worst = float(apart.max()) if apart.nnz else 0.0
    if worst > ROUNDED:
        i, j = np.unravel_index(int(apart.argmax()), A.shape)
        remedy = "if the file has one half alone, let it say so (%%MatrixMarket matrix coordinate real symmetric)"
        got = f"{A[i, j]:.6g} and {A[j, i]:.6g} at unknowns {i + 1} and {j + 1}"
        raise InputError(say(f"{where}: {what}", "a symmetric matrix", got, remedy))
    if worst > ALIKE:
        notify(
            f"{where}: its {what} is not symmetric, by {worst:.1g} of its entries; its mean with the transposed one is taken"
        )
    return as_csr(0.5 * (A + A.T))


def rigid_motions(about: np.ndarray, unit: np.ndarray, size: float = 1.0) -> np.ndarray:
    """Translations and rotations (b c, r) of a body with coordinates (b, c) about its centre and
    `unit` (b,) of the field 1, rotations in units of a size [m].
    """
    dim = about.shape[1]
    moves = np.kron(unit[:, None], np.eye(dim))
    if dim == 2:
        turns = np.column_stack([-about[:, 1], about[:, 0]])[None]
    else:
        turns = np.cross(np.eye(3)[:, None], about)
    return np.column_stack([moves, turns.reshape(len(turns), -1).T / size])


def refuse_bound(where: str, K: csr_array, nodes: np.ndarray, unit: np.ndarray) -> None:
    """InputError where rigid motions of a body meet forces, with what may be wrong."""
    alone = np.flatnonzero((abs(K).sum(axis=1) - np.abs(K.diagonal())) == 0.0)
    if len(alone):
        node, axis = divmod(int(alone[0]), 3)
        got = f"{len(alone)} unknowns that nothing couples, the first at node {node + 1}, {'xyz'[axis]}"
        remedy = "export the free body, without boundary conditions and loose nodes"
        raise InputError(say(f"{where}: stiffness", "unknowns of one elastic body", got, remedy))
    about = nodes - np.outer(unit, unit @ nodes / float(unit.sum()))
    Q = rigid_motions(about, unit, float(np.abs(about).max()) or 1.0)
    forces, sizes = np.abs(K @ Q), abs(K) @ np.abs(Q)
    # of a row against all motions, so that a direction that moves next to nothing counts little
    left = forces / np.maximum(sizes.max(axis=1, keepdims=True), 1e-300)
    moved, turned = left[:, :3].max(axis=1), left[:, 3:].max(axis=1)
    if max(moved.max(), turned.max()) <= RIGID:
        return
    worst = int(np.argmax(np.maximum(moved, turned)))
    node, axis = divmod(worst, 3)
    bad = np.flatnonzero(moved > RIGID)
    got = f"a force of {max(moved[worst], turned[worst]):.1g} of its terms at node {node + 1}, {'xyz'[axis]}"
    if not len(bad):
        remedy = "its nodes may be in another order than its unknowns, or mirrored"
    elif len(bad) < len(moved) / 3:
        remedy = f"unknowns are held or in local axes at {len(np.unique(bad // 3))} nodes: export the free body in global axes"
    else:
        remedy = "its unknowns may be in another order than x, y, z of every node, or in local axes"
    raise InputError(say(f"{where}: stiffness", "no forces of rigid motions", got, remedy))


def check_interface(where: str, one: Coupling, nodes: np.ndarray, unit: np.ndarray) -> None:
    """InputError for an interface of too few nodes, of some that are not there, or on one line;
    gradients take it off the line where it is rigid.
    """
    ids = np.array(one.nodes)
    if len(ids) and (ids.min() < 0 or ids.max() >= len(nodes)):
        raise InputError(say(where, f"nodes 0 to {len(nodes) - 1}", f"{ids.min()} to {ids.max()}"))
    if len(np.unique(ids)) != len(ids):
        raise InputError(say(where, "every node once", "some more than once"))
    remedy = "take more nodes, or name single ones as `points`"
    expected = "three or more nodes that are not on a line"
    if len(ids) < 3 or not unit[ids].any():
        got = f"{len(ids)} nodes, {int(unit[ids].sum())} of them positions"
        raise InputError(say(where, expected, got, remedy))
    about = nodes[ids] - np.outer(unit[ids], mean_place(one, nodes, unit))
    if not one.rigid:
        about *= unit[ids, np.newaxis]
    moments = np.linalg.eigvalsh(about.T @ about)
    if moments[1] <= FLAT * moments[2]:
        raise InputError(say(where, expected, f"{len(ids)} nodes on a line", remedy))


def weights_of(one: Coupling, unit: np.ndarray) -> np.ndarray:
    """Parts w_i (i,) of the nodes of an interface in their mean, 1 in all; gradients have none."""
    weights = unit[list(one.nodes)] * (1.0 if one.weights is None else np.array(one.weights))
    return np.asarray(weights / float(weights.sum()))


def mean_place(one: Coupling, nodes: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """Mean (3,) of the positions of an interface; gradients have no place."""
    return np.asarray(weights_of(one, unit) @ nodes[list(one.nodes)])


def tie(
    where: str, nodes: np.ndarray, unit: np.ndarray, interfaces: Mapping[str, Coupling]
) -> tuple[csr_array, np.ndarray, np.ndarray]:
    """Nodes from the functions of the body: spread (n, b), their reference (b, 3) [m], and the
    field 1 (b,).

    Free nodes, then c, e_1, e_2, e_3 of rigid interfaces, then e_1, e_2, e_3 of averages.
    """
    n = len(nodes)
    taken = np.zeros(n, dtype=bool)
    rows, columns = [np.zeros((n, 0))], []
    for key, one in interfaces.items():
        if not one.rigid:
            continue
        ids = np.array(one.nodes)
        if taken[ids].any():
            expected = "nodes of one rigid interface each"
            got = f"{int(taken[ids].sum())} of them in another one"
            raise InputError(say(f"{where}: interface '{key}'", expected, got))
        taken[ids] = True
        center = mean_place(one, nodes, unit)
        about = nodes[ids] - np.outer(unit[ids], center)
        # an axis across a flat set has no mass, and not that of round-off
        about[np.abs(about) <= ROUND_OFF * np.abs(about).max()] = 0.0
        block = np.zeros((n, 4))
        block[ids] = np.column_stack([unit[ids], about])
        rows.append(block)
        columns.append(np.vstack([center, np.eye(3)]))
    free = np.flatnonzero(~taken)
    own = csr_array((np.ones(len(free)), (free, np.arange(len(free)))), shape=(n, len(free)))
    averages = sum(not one.rigid for one in interfaces.values())
    beside = np.column_stack([*rows, np.zeros((n, 3 * averages))])
    spread = as_csr(hstack([own, csr_array(beside)]))
    reference = np.vstack([nodes[free], *columns, *[np.eye(3)] * averages])
    constant = np.concatenate(
        [unit[free], *[np.array([1.0, 0.0, 0.0, 0.0])] * len(columns), np.zeros(3 * averages)]
    )
    return spread, reference, constant


def small_rotations(
    spread: csr_array, interfaces: Mapping[str, Coupling], turn: np.ndarray
) -> csr_array:
    """Coordinates (b c, b c) that a stiffness reads: axes E of rigid interfaces by the
    antisymmetric part of their change alone, which is all of a small rotation.

        dE <- (dE - E0 dE^T E0) / 2

    Their second-order part is no strain, but would count as one: a cantilever whose end is
    deflected by 9 % of its length would be 13 % too stiff, a thin plate 27 % at 3 %.
    """
    b = spread.shape[1]
    first = b - 3 * sum(not one.rigid for one in interfaces.values())
    first -= 4 * sum(one.rigid for one in interfaces.values())
    # entry (k, c) of rows e_k of E0 = turn^T, k the axis and c the component
    E0 = turn.T
    flip = np.einsum("kg,mc->kcmg", E0, E0).reshape(9, 9)
    block = 0.5 * (np.eye(9) - flip)
    P = eye_array(3 * b, format="lil")
    for one in interfaces.values():
        if one.rigid:
            at = 3 * (first + 1)
            P[at : at + 9, at : at + 9] = block
            first += 4
    return as_csr(P.tocsr())


def axes_of(
    interfaces: Mapping[str, Coupling], spread: csr_array, nodes: np.ndarray, unit: np.ndarray
) -> csr_array:
    """Rows (i, b) of the place, e_1, e_2 and e_3 of every interface, in their order."""
    b = spread.shape[1]
    averages = sum(not one.rigid for one in interfaces.values())
    rigid = b - 3 * averages - 4 * (len(interfaces) - averages)
    average = b - 3 * averages
    rows = []
    for one in interfaces.values():
        if one.rigid:
            place = selection([rigid], b)
            axes = selection(rigid + np.arange(1, 4), b)
            rigid += 4
        else:
            place = mean_row(one, unit) @ spread
            axes = selection(average + np.arange(3), b)
            average += 3
        if one.center is not None:
            offset = np.array(one.center) - mean_place(one, nodes, unit)
            place += csr_array(offset[np.newaxis]) @ axes
        rows += [as_csr(place), axes]
    return as_csr(vstack(rows))


def mean_row(one: Coupling, unit: np.ndarray) -> csr_array:
    """Row (1, n) of the mean of the positions of an interface."""
    ids = np.array(one.nodes)
    share = weights_of(one, unit)
    return csr_array((share, (np.zeros(len(ids), np.int64), ids)), shape=(1, len(unit)))


def mean_axes(one: Coupling, nodes: np.ndarray, unit: np.ndarray) -> csr_array:
    """Rows (3, n) of a_k, over the mean square distance of the nodes from their mean."""
    ids = np.array(one.nodes)
    about = nodes[ids] - mean_place(one, nodes, unit)
    weights = weights_of(one, unit)
    rows = (weights[:, np.newaxis] * about).T / float(weights @ (about**2).sum(axis=1))
    k, i = np.nonzero(rows)
    return csr_array((rows[k, i], (k, ids[i])), shape=(3, len(nodes)))


def stress_rows(where: str, rows: Array, size: int) -> csr_array:
    """Rows (6 k, size) of stresses; InputError for other numbers of rows or columns."""
    A = as_csr(rows)
    if A.shape[1] != size or A.shape[0] % 6 or not A.shape[0]:
        expected = f"six rows a point (xx, yy, zz, xy, yz, zx) and {size} columns"
        raise InputError(say(where, expected, f"({A.shape[0]}, {A.shape[1]})"))
    return A


def node_row(where: str, node: int, n: int) -> csr_array:
    """Row (1, n) of a node; InputError where it is not there."""
    if not 0 <= node < n:
        raise InputError(say(where, f"a node from 0 to {n - 1}", node))
    return selection([node], n)


def about_center(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Centre of mass (c,) [m] of a body, and its reference (b, c) about it, whose digits are those
    of the body wherever it stands.
    """
    heavy = np.asarray(body.mass @ body.constant)
    center = heavy @ body.reference / float(heavy @ body.constant)
    return center, body.reference - np.outer(body.constant, center)


def rigidity(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Centre of mass (3,) [m] and inertia about it (3, 3) [kg m2] of a body.

    J = tr(G) 1 - G,    G = (q - t c)^T M (q - t c)
    """
    center, about = about_center(body)
    G = about.T @ np.asarray(body.mass @ about)
    return center, np.trace(G) * np.eye(3) - G
