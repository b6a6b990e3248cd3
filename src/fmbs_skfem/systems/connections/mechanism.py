r"""Degrees of freedom of a mechanism, counted on the rigid motions of its bodies.

    q_b' = B_b z_b,   B_b = [ 1 (x) e_c,  e_k x (r - c_b) ],     Phi_q B z = 0

    rank count          F = sum_b rank B_b - rank(Phi_q B)
    Gruebler, Kutzbach  G = sum_b rank B_b - sum_j rank(Phi_q,j B)          F - G >= 0: redundant constraints (overconstrained)

A body, rigid or flexible, has as many motions as its coordinates show: 2 or 3 a mass point, 3 or 6
a body, 5 a straight line in space, which carries no torsion. Drives are left out of F and G; they
take degrees of freedom from what is left. Ranks are the largest of the start and of positions near
it on Phi = 0, so that a dead centre is not taken for a mechanism. What rigid bodies overdetermine
flexible ones may take up by deformation; rows that depend on each other in all coordinates are
redundant, or contradict each other.

Sources: G. Gogu, Mobility of mechanisms: a critical review, Mech. Mach. Theory 40 (2005) 1068-1097
(ranks against quick formulas); M. Wojtyra, J. Fraczek, Multibody Syst. Dyn. 30 (2013) 153-171,
doi:10.1007/s11044-013-9352-y (redundant rows).
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from scipy.sparse import block_diag, coo_array, csgraph, csr_array

from ...core.algebra import ranks
from ...core.algebra.linalg import as_dense
from ...core.algebra.rotations import rotation
from ...core.errors import Contradiction, say
from ...core.storage.records import dataclass
from ..system import System, driven_rows, is_linear, keep_constraints, reads
from . import redundancy
from .redundancy import AMPLITUDES, ITERATIONS, StartRows, relative, rows_of

WEIGHT = 1e-6  #: share of another row below which a row does not depend on it
FRAME = re.compile(r"e\d\.e\d")  #: rows that keep the axes of a frame orthonormal


@dataclass(frozen=True)
class JointCount:
    """What a joint ties, and how many rigid motions it takes by itself."""

    name: str
    rows: int
    bodies: tuple[str, ...]
    ground: bool
    driven: bool


@dataclass(frozen=True)
class Group:
    """Bodies that joints hang together, directly or by others."""

    bodies: tuple[str, ...]
    ground: bool  #: whether a joint ties one of them to the ground


@dataclass(frozen=True)
class Dependence:
    """A constraint row that follows from others, and how far it misses them [m]; nan where they are
    not all linear.

    Rows are named JOINT.COORDINATE.
    """

    row: str
    on: tuple[str, ...]
    gap: float = float("nan")


@dataclass(frozen=True)
class Mechanism:
    """Bodies, joints and degrees of freedom as an engineer counts them: F by ranks, G by Gruebler
    and Kutzbach.

    F - G is the number of rows too many for rigid bodies.
    """

    bodies: dict[str, int]  #: rigid motions of every body
    joints: tuple[JointCount, ...]
    groups: tuple[Group, ...]
    mobility: int  #: F
    gruebler: int  #: G
    at_start: int  #: F of the start alone, larger in a singular position
    free: int  #: degrees of freedom that drives leave
    overconstrained: tuple[Dependence, ...]  #: rows too many for rigid bodies, F - G of them

    @property
    def floating(self) -> tuple[Group, ...]:
        """Groups of bodies that no joint ties to the ground."""
        return tuple(group for group in self.groups if not group.ground)


def analyse(system: System) -> Mechanism:
    """The mechanism of a system with all multipliers in its reference configuration, histories of
    drives taken at t = 0.

        F = sum_b rank B_b - rank(Phi_q B),    G = sum_b rank B_b - sum_j rank(Phi_q,j B),    drives left out

    Ranks are the largest of the start and of positions near it. Sources as of the module.
    """
    names, joint, driven = joints_of(system)
    rows = rows_of(system)[0] if system.constraints.names else None
    start = on_motions(system, rows, system.x0)
    touched, ground = ties(system, joint, len(names), start)
    passive = np.isin(joint, np.flatnonzero(~driven))
    positions = [start, *nearby(system, rows, passive)]
    best = max(positions, key=lambda A: rank_of(A[passive]))
    single = [independent(start, np.flatnonzero(joint == k)) for k in range(len(names))]
    chosen = [row for k, own in enumerate(single) for row in own if not driven[k]]
    bodies = motion_counts(system)
    total = sum(bodies.values())
    labels = [".".join(pair) for pair in system.constraints.names]
    return Mechanism(
        bodies=bodies,
        joints=tuple(
            JointCount(
                name,
                len(own),
                tuple(np.array(list(bodies))[touched[k]].tolist()),
                bool(ground[k]),
                bool(driven[k]),
            )
            for k, (name, own) in enumerate(zip(names, single, strict=True))
        ),
        groups=groups(list(bodies), touched, ground),
        mobility=total - rank_of(best[passive]),
        gruebler=total - len(chosen),
        at_start=total - rank_of(start[passive]),
        free=total - max(rank_of(A[joint >= 0]) for A in positions),
        overconstrained=tuple(
            dependences(balanced(best[chosen]), [labels[k] for k in chosen], ranks.STATED)
        ),
    )


def joints_of(system: System) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Names of the joints (j), the joint of every row (m,), -1 for the axes of frames, and which
    joints are driven (j,).
    """
    bodies = {name for name, _, _ in system.coordinates}
    owners = [
        "" if FRAME.fullmatch(label) and {joint, joint.partition(".")[0]} & bodies else joint
        for joint, label in system.constraints.names
    ]
    names = list(dict.fromkeys(owner for owner in owners if owner))
    place = {name: k for k, name in enumerate(names)}
    joint = np.array([place.get(owner, -1) for owner in owners], dtype=np.int64)
    driven = np.zeros(len(names), dtype=bool)
    driven[joint[driven_rows(system.constraints)]] = True
    return names, joint, driven


def motions(system: System, q: np.ndarray) -> list[np.ndarray]:
    """B_b (coordinates, 3 or 6) of every body in the state q (q,), turns times the size of the
    system [m].

        B_b = [ 1 (x) e_c,  e_k x (r - c_b) / size ]

    c_b is the mean of the positions of the body.
    """
    dim = system.dim
    size = system.scale
    found = []
    for _, first, last in system.coordinates:
        part = q[first:last].reshape(-1, dim)
        unit = system.unit[first // dim : last // dim]
        if not is_body(system, first, last):  # the coordinate of a joint moves by itself
            found.append(
                np.eye(last - first, 3 if dim == 2 else 6) * (np.arange(last - first) == 0)[:, None]
            )
            continue
        apart = part - np.outer(unit, unit @ part / (unit @ unit))
        fields = [np.outer(unit, axis) for axis in np.eye(dim)]
        fields += [turn(apart, axis) / size for axis in np.eye(3)[2 if dim == 2 else 0 :]]
        found.append(np.stack([field.ravel() for field in fields], axis=1))
    return found


def turn(apart: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Velocities (b, c) of points r (b, c) by a turn about an axis (3,).

        axis x r

    in the plane about z.
    """
    dim = apart.shape[1]
    return np.asarray(np.cross(axis, np.pad(apart, ((0, 0), (0, 3 - dim))))[:, :dim])


def idle(system: System) -> list[np.ndarray]:
    """Combinations (i, 3 or 6) of motions of every body that move nothing: turns of a point, of a
    straight line about itself.

    One array a body, with columns as in `motions`.
    """
    found = []
    weight = np.repeat(np.where(system.unit > 0.5, 1.0, system.scale), system.dim)
    for (_, first, last), B in zip(system.coordinates, motions(system, system.x0), strict=True):
        # turns of axes and slopes by the size of the system beside positions
        moving = weight[first:last, None] * B
        found.append(ranks.null_space(moving, alike=True).T)
    return found


def motion_counts(system: System) -> dict[str, int]:
    """rank B_b of every body."""
    whole = 3 if system.dim == 2 else 6
    return {
        name: whole - len(none)
        for (name, _, _), none in zip(system.coordinates, idle(system), strict=True)
    }


def on_motions(system: System, rows: StartRows | None, q: np.ndarray) -> np.ndarray:
    """Constraints on rigid motions (m, z) in the state q (q,), of the rows of a system or of none;
    rows that all motions satisfy are zero.

        Phi_q B

    z counts the motions of all bodies, 3 or 6 each, as in `motions`.
    """
    B = csr_array(block_diag(motions(system, q), format="csr"))
    if rows is None:
        return np.zeros((0, B.shape[1]))
    J = rows(q[rows.used])[1]
    B = csr_array(B[rows.used])
    A = as_dense(J @ B)
    A[
        np.linalg.norm(A, axis=1) <= ranks.EXACT * np.linalg.norm(as_dense(abs(J) @ abs(B)), axis=1)
    ] = 0.0
    return A


def balanced(A: np.ndarray) -> np.ndarray:
    """A (m, n) with columns, then rows, of length one, so that ranks do not depend on units; those
    that are zero stay.
    """
    return ranks.unit_rows(ranks.unit_rows(A.T).T)


def rank_of(A: np.ndarray) -> int:
    """Rank of A (m, n), with columns and rows of length one."""
    return ranks.rank(balanced(A), ranks.STATED)


def independent(A: np.ndarray, mine: np.ndarray) -> np.ndarray:
    """A largest set of the rows `mine` (i,) of A (m, n) that do not depend on each other, their
    numbers in A.
    """
    return mine[ranks.independent_rows(balanced(A[mine]), ranks.STATED)]


def ties(
    system: System, joint: np.ndarray, count: int, start: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Which bodies every joint reads (j, b), and which joints resist a common motion of all of
    them, as the ground does (j,).
    """
    bodies = system.coordinates
    owner = np.repeat(np.arange(len(bodies)), [last - first for _, first, last in bodies])
    probes = csr_array(system.probes.matrix)
    touched, ground = np.zeros((count, len(bodies)), dtype=bool), np.zeros(count, dtype=bool)
    mine = np.flatnonzero(joint >= 0)
    read = coo_array(reads(system.constraints, probes.shape[0])[mine] @ abs(probes))
    touched[joint[mine][read.row], owner[read.col]] = True
    whole = start @ common(system)
    for k in range(count):
        mine = joint == k
        ground[k] = np.linalg.norm(whole[mine]) > ranks.STATED * np.linalg.norm(start[mine])
    return touched, ground


def common(system: System) -> np.ndarray:
    """Motions (z, 3 or 6) of all bodies as one.

        z_b = (t + w x (c_b - c), w)

    with the centres c_b of the bodies and their mean c.
    """
    dim = system.dim
    size = system.scale
    blocks = []
    centers = np.array([center(system, first, last) for _, first, last in system.coordinates])
    for apart, (_, first, last) in zip(
        centers - centers.mean(axis=0), system.coordinates, strict=True
    ):
        turns = [turn(apart[None], axis)[0] / size for axis in np.eye(3)[2 if dim == 2 else 0 :]]
        count = len(turns)
        moving = float(is_body(system, first, last))
        blocks.append(
            moving
            * np.block([[np.eye(dim), np.array(turns).T], [np.zeros((count, dim)), np.eye(count)]])
        )
    return np.concatenate(blocks)


def center(system: System, first: int, last: int) -> np.ndarray:
    """Mean (c,) of the positions [m] of a body in the reference, whose coordinates are first ...
    last - 1 of q; 0 of a joint's.
    """
    unit = system.unit[first // system.dim : last // system.dim]
    return np.asarray(unit @ system.x0[first:last].reshape(-1, system.dim) / (unit @ unit or 1.0))


def is_body(system: System, first: int, last: int) -> bool:
    """Whether coordinates first ... last - 1 of q are those of a body, which has positions, and not
    of a joint.
    """
    return bool(system.unit[first // system.dim : last // system.dim].any())


def groups(names: Sequence[str], touched: np.ndarray, ground: np.ndarray) -> tuple[Group, ...]:
    """Bodies that hang together by joints; the ground does not join them.

    `touched` (j, b) says which bodies a joint ties, `ground` (j,) which joints tie them to the
    ground.
    """
    joint, body = np.nonzero(touched)
    count = len(names)
    links = coo_array(
        (np.ones(len(joint)), (body, count + joint)), shape=(count + len(touched),) * 2
    )
    label = csgraph.connected_components(links, directed=False)[1]
    held = {int(label[count + k]) for k in np.flatnonzero(ground)}
    order = list(dict.fromkeys(label[:count].tolist()))
    return tuple(
        Group(tuple(n for n, own in zip(names, label, strict=False) if own == k), k in held)
        for k in order
    )


def moved(system: System, q: np.ndarray, step: np.ndarray) -> np.ndarray:
    """The state (q,) after finite rigid motions `step` (z,) of all bodies from the state q (q,).

    Of every body c translations [m], and 1 or 3 turns about its centre times the size of the system
    [m], as a rotation vector.
    """
    dim = system.dim
    size = system.scale
    out = q.copy()
    for (_, first, last), z in zip(
        system.coordinates, step.reshape(len(system.coordinates), -1), strict=True
    ):
        part = q[first:last].reshape(-1, dim)
        unit = system.unit[first // dim : last // dim]
        if not is_body(system, first, last):
            out[first] += z[0]
            continue
        middle = unit @ part / (unit @ unit)
        angle = z[dim:] / size
        R = rotation(angle if dim == 3 else [0.0, 0.0, angle[0]])[:dim, :dim]
        out[first:last] = (
            (part - np.outer(unit, middle)) @ R.T + np.outer(unit, middle + z[:dim])
        ).ravel()
    return out


def nearby(system: System, rows: StartRows | None, passive: np.ndarray) -> list[np.ndarray]:
    """Phi_q B (m, z) in positions near the start where the passive joints hold, reached by rigid
    motions: none, or up to three.

    `passive` (m,) are the rows without drives. Corrections keep as many directions as the start
    has, where rows are dependent in all positions, or else all that there are.
    """
    if rows is None or not passive.any():
        return []
    random = np.random.default_rng(0)
    size = system.scale
    A = on_motions(system, rows, system.x0)
    found = []
    for amplitude in AMPLITUDES:
        change = amplitude * size * random.normal(size=(A.shape[1],))
        change -= ranks.least(A[passive], A[passive] @ change, rank_of(A[passive]))
        for directions in (rank_of(A[passive]), A.shape[1]):
            q, closed = onto_joints(
                system, rows, moved(system, system.x0, change), 1e-11, passive, directions
            )
            if closed:
                found.append(on_motions(system, rows, q))
                break
    return found


def onto_joints(
    system: System,
    rows: StartRows,
    q: np.ndarray,
    tolerance: float,
    mine: np.ndarray | slice = slice(None),
    directions: int | None = None,
) -> tuple[np.ndarray, bool]:
    """The state q (q,) moved back onto the rows `mine` by rigid motions of least norm, and whether
    they hold in it.

    Newton's iteration, until gaps in units of the system are below `tolerance` times its largest
    coordinate in these units, at least 1. A step has the rank `directions`, by default that of the
    rows.
    """
    close = tolerance * max(1.0, float(np.abs(q[rows.used] / rows.scale).max()))
    for _ in range(ITERATIONS):
        if np.abs(relative(rows, q[rows.used])[0][mine]).max() < close:
            return q, True
        q = moved(
            system,
            q,
            -ranks.least(
                on_motions(system, rows, q)[mine], rows(q[rows.used])[0][mine], directions
            ),
        )
    return q, bool(np.abs(relative(rows, q[rows.used])[0][mine]).max() < close)


def dependences(
    J: np.ndarray,
    labels: Sequence[str],
    tolerance: float,
    phi: np.ndarray | None = None,
    kept: np.ndarray | None = None,
) -> list[Dependence]:
    """Rows of J (m, u) that follow from others, with their values phi the gap.

        row = sum_i w_i row_i,    gap = phi - sum_i w_i phi_i

    Rows `kept` (m,) are those that others follow from, as far as possible.
    """
    base, rest, weights = ranks.part(J, tolerance, kept)
    size = ranks.lengths(J)
    found = []
    for k, w in zip(rest, weights, strict=True):
        some = np.abs(w) * size[base] > WEIGHT * size[k]
        gap = float("nan") if phi is None else float(abs(phi[k] - w[some] @ phi[base[some]]))
        found.append(Dependence(labels[int(k)], tuple(labels[i] for i in base[some]), gap))
    return found


def redundant(system: System) -> tuple[Dependence, ...]:
    """Constraint rows that follow from others in all coordinates, not only on rigid motions, in the
    start and near it.

    The gap of linear rows says whether they agree with those they follow from.
    """
    if not system.constraints.names:
        return ()
    system = keep_constraints(system, redundancy.doubtful(*rows_of(system)))
    names = system.constraints.names
    if not names:
        return ()
    rows, z = rows_of(system)
    phi, J = rows(z)
    J = as_dense(J) * rows.scale
    labels = [".".join(pair) for pair in names]
    linear = is_linear(system.constraints)
    if ranks.rank(J, ranks.CLOSED) == len(names):
        return ()
    fixed = np.flatnonzero(linear)
    found = dependences(J[fixed], [labels[k] for k in fixed], ranks.CLOSED, phi[fixed])
    best = max(redundancy.nearby(rows, z), key=lambda A: ranks.rank(A, ranks.CLOSED), default=J)
    dropped = {dependence.row for dependence in found}
    rest = np.array([k for k in range(len(names)) if labels[k] not in dropped])
    axes = joints_of(system)[1][rest] < 0
    return (*found, *dependences(best[rest], [labels[k] for k in rest], ranks.CLOSED, kept=axes))


def driven_against(system: System, found: Sequence[Dependence]) -> list[Dependence]:
    """Dependences with a drive among their rows: what it moves is held or driven already.

    `system` has the rows that they name.
    """
    names = system.constraints.names
    driven = {".".join(names[row]) for row in np.flatnonzero(driven_rows(system.constraints))}
    return [one for one in found if driven & {one.row, *one.on}]


def refuse_held_drives(system: System) -> None:
    """Contradiction where a drive moves what is held or driven already, also in positions near the
    start.

    Equilibria and modes would take the singular state in which rows no longer say so: a slope held
    and turned has the length 0.
    """
    driven = driven_rows(system.constraints)
    full = system.full or system
    if (
        driven.any()
        and driven[redundancy.doubtful(*rows_of(system))].any()
        and (found := driven_against(full, redundant(full)))
    ):
        raise conflict(found)


def conflict(found: Sequence[Dependence]) -> Contradiction:
    """The error of drives that move what is held or driven already, which names the rows."""
    listed = "; ".join(
        f"{one.row} with {' and '.join(one.on)}" if one.on else f"{one.row} with what is held"
        for one in found
    )
    remedy = "a driven motion must be free: remove the drive or the joint that holds it"
    text = say("joints contradict each other", "drives of what is free", listed, remedy)
    return Contradiction(
        text, tuple((one.row, 0.0) for one in found), [row for one in found for row in one.on]
    )
