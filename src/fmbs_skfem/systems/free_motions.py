r"""Rigid motions that make a static problem singular: no joint, no spring resists them.

    Phi_q B z = 0,   z^T B^T K_s B z = 0          held by weight alone:  dV = 0,  d2V > 0,   V = - Q^T q along Phi = 0

K_s is the stiffness of springs and of loads that turn with a body. Where the potential V of
constant loads has a minimum, as for a chain that hangs, there is an equilibrium, but the first
iteration of a load path from rest has a singular matrix. V is differenced along finite rigid
motions.

Source: M. Geradin, D. Rixen, Mechanical Vibrations, 3rd ed., Wiley 2015, ch. 2 (rigid modes and
their geometric stiffness).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import block_diag, csr_array

from ..bodies.body import LIMP, STIFF, limp
from ..core.algebra import ranks
from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from .compiled import compile_system, probe_tangent, residual
from .connections.mechanism import center, idle, is_body, motions, moved, on_motions, onto_joints
from .connections.redundancy import StartRows, rows_of
from .system import Constraints, System, project

ROUND = 1e-12  #: size of a rigid motion, over the largest, that is round-off

STEP = 1e-3  #: of the size of the system, over which the potential is differenced


@dataclass(frozen=True)
class FreeMotion:
    """One free rigid motion: velocity (c,) [m/s] of the middle of every body that moves, and its
    turning (1,) or (3,) [rad/s].

    Only their ratios count. As a text it says what turns about which axis, and what moves along
    which direction.
    """

    bodies: dict[str, tuple[np.ndarray, np.ndarray]]
    places: dict[str, np.ndarray]  #: middles of these bodies in the scene [m]

    def __str__(self) -> str:
        return "; ".join(
            said(name, v, w, self.places[name]) for name, (v, w) in self.bodies.items()
        )


def unsupported(system: System) -> tuple[tuple[FreeMotion, ...], tuple[FreeMotion, ...]]:
    """Rigid motions at the start that neither joints nor springs resist: those that nothing holds,
    and those that weight holds.

        Phi_q B z = 0,   z^T B^T K_s B z = 0          held by weight alone:  dV = 0,  d2V > 0,   V = - Q^T q along Phi = 0

    The system has all multipliers and is in its reference; each motion is of as few bodies as an
    echelon form gives.
    """
    rows, Z = unresisted(system)
    free, hung = by_weight(system, rows, Z)
    return tuple(motion(system, z) for z in sparse_basis(free)), tuple(
        motion(system, z) for z in sparse_basis(hung)
    )


def pushed(system: System, time: float) -> tuple[FreeMotion, ...]:
    """The motions that nothing holds, where loads at a time [s] push them; none where they are in
    equilibrium.

    There is no static equilibrium near the reference of a system that has such motions.
    """
    rows, Z = unresisted(system)
    free = by_weight(system, rows, Z)[0]
    held = np.zeros(len(system.constraints.names))
    force = (
        block_diag(motions(system, system.x0)).T
        @ residual(compile_system(system), system.x0, held, time)[: system.size]
    )
    balanced = not free.shape[1] or np.linalg.norm(free.T @ force) <= ranks.STATED * np.linalg.norm(
        force
    )
    return () if balanced else tuple(motion(system, z) for z in sparse_basis(free))


def unresisted(system: System) -> tuple[StartRows | None, np.ndarray]:
    """The constraint rows of a system, and a basis (z, f) of the rigid motions that neither they
    nor springs resist.
    """
    rows, Z = permitted(system)
    if not Z.shape[1]:
        return rows, Z
    K = resisting(system)
    Y = block_diag(motions(system, system.x0)) @ Z
    stiff = np.asarray(Y.T @ (K @ Y)) / max(
        float(abs(K).max() * np.max(np.sum(Y * Y, axis=0))), 1e-300
    )
    return rows, Z @ ranks.null_space(stiff, alike=True) if np.linalg.norm(
        stiff
    ) > ranks.EXACT else Z


def permitted(system: System) -> tuple[StartRows | None, np.ndarray]:
    """The constraint rows of a system, None without any, and an orthonormal basis (z, f) of the
    rigid motions that they permit.
    """
    rows = rows_of(system)[0] if system.constraints.names else None
    A = np.concatenate([on_motions(system, rows, system.x0), block_diag(idle(system)).toarray()])
    units = 1.0 / ranks.lengths(A.T)
    Z = units[:, None] * ranks.null_space(A * units, ranks.STATED)
    return rows, np.linalg.qr(Z)[0] if Z.shape[1] else Z


def left_by_drives(system: System) -> tuple[FreeMotion, ...]:
    """The rigid motions at the start that joints and drives permit, each of as few bodies as
    possible.

    Springs and weight are left out of account.
    """
    return tuple(motion(system, z) for z in sparse_basis(permitted(system)[1]))


def resisting(system: System) -> csr_array:
    """Stiffness (n, n) of linear springs and of forces on probe rows at the start."""
    K = csr_array(system.stiffness)
    if not system.loads.forces:
        return K
    alone = compile_system(replace(system, elastic=(), constraints=Constraints()))
    return csr_array(K + probe_tangent(alone, system.x0, np.zeros(0)))


def limp_bodies(system: System) -> tuple[str, ...]:
    """Cables curved in space, by names of bodies or components, see `bodies.body.limp`.

    Without tension nothing resists their bending out of the plane.
    """
    known = ((part.name, part.gather) for part in system.elastic)
    return tuple(name for name, gather in known if limp(gather, system.dim))


def refuse_limp(where: str, system: System) -> None:
    """InputError for modes about a reference without tension where cables are curved in space: all
    that are asked for would be 0.

    `where` is the place in the message.
    """
    if names := limp_bodies(system):
        got = f"{' and '.join(map(repr, names))}, which {LIMP}: the lowest frequencies are all 0"
        raise InputError(
            say(
                where,
                "straight cables, or a planar scene, for modes about the reference",
                got,
                STIFF,
            )
        )


def by_weight(
    system: System, rows: StartRows | None, Z: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Motions Z (z, f) parted into those that constant loads push or leave alone, and those that
    they hold.
    """
    count = Z.shape[1]
    force = block_diag(motions(system, system.x0)).T @ system.loads.constant
    size = float(np.linalg.norm(force))
    if not count or size == 0.0 or np.linalg.norm(Z.T @ force) > ranks.STATED * size:
        return Z, Z[:, :0]
    step = STEP * system.scale

    def potential(a: np.ndarray) -> float:
        return -float(system.loads.constant @ (reached(system, rows, Z @ (step * a)) - system.x0))

    axes = np.eye(count)
    H = np.diag([potential(e) + potential(-e) for e in axes])
    for i in range(count):
        for j in range(i):
            both = axes[i] + axes[j]
            H[i, j] = H[j, i] = 0.5 * (potential(both) + potential(-both) - H[i, i] - H[j, j])
    values, vectors = np.linalg.eigh(H / (step**2 * size / system.scale))
    held = values > ranks.STATED
    return Z @ vectors[:, ~held], Z @ vectors[:, held]


def reached(system: System, rows: StartRows | None, z: np.ndarray) -> np.ndarray:
    """The state (q,) after the rigid motions z (z,), moved back onto the joints by steps of least
    norm.
    """
    q = moved(system, system.x0, z)
    return q if rows is None else onto_joints(system, rows, q, 1e-14)[0]


def sparse_basis(Z: np.ndarray) -> np.ndarray:
    """Rows (f, n) that span the columns of Z (n, f), each with as few bodies as an echelon form
    gives.

    The largest entry of a row has the size 1; round-off is zero.
    """
    if not Z.shape[1]:
        return Z.T
    order = ranks.pivots(Z)[0]
    found = np.linalg.solve(Z[order].T, Z.T)
    found[np.abs(found) < ranks.STATED * np.abs(found).max()] = 0.0
    return np.asarray(found / np.abs(found).max(axis=1, keepdims=True))


def motion(system: System, z: np.ndarray) -> FreeMotion:
    """The motion z (z,) by bodies: of every body c translations [m] and 1 or 3 turns times the size
    of the system [m].

    Bodies that do not move are left out; what is round-off beside the largest of a body's numbers,
    all of them lengths, is zero.
    """
    dim, size = system.dim, system.scale
    moving, places = {}, {}
    for (name, first, last), own in zip(
        system.coordinates, z.reshape(len(system.coordinates), -1), strict=True
    ):
        if (most := np.abs(own).max()) > ranks.STATED and is_body(system, first, last):
            own = np.where(np.abs(own) > ranks.STATED * most, own, 0.0)
            moving[name], places[name] = (
                (own[:dim], own[dim:] / size),
                center(system, first, last) + system.origin,
            )
    return FreeMotion(moving, places)


def said(name: str, v: np.ndarray, w: np.ndarray, place: np.ndarray) -> str:
    """`beam turns about (0, 0)` or `mass moves along (1, 0)`."""
    rate = float(np.linalg.norm(w))
    if rate == 0.0:
        return f"{name} moves along {listed(v / np.linalg.norm(v))}"
    spin = w if len(w) == 3 else np.array([0.0, 0.0, w[0]])
    spin, wide = np.sign(spin[np.argmax(np.abs(spin))]) * np.stack(
        [spin, np.pad(v, (0, 3 - len(v)))]
    )
    at = np.pad(place, (0, 3 - len(place))) + np.cross(spin, wide) / rate**2
    axis = "" if len(v) == 2 else f"the axis {listed(spin / rate)} through "
    slide = " and moves along it" if abs(float(spin @ wide)) > ranks.STATED * rate else ""
    return f"{name} turns about {axis}{listed(at[: len(v)])}{slide}"


def listed(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value + 0.0:.4g}" for value in np.round(values, 6)) + ")"


def rigid_motions(system: System) -> np.ndarray:
    """Rigid motions of the whole system in the unknowns (n, 3 to 6), columns of length one; none
    about a line that all lie on.
    """
    dim = system.dim
    q = system.lift(system.x0).reshape(-1, system.dim)
    fields = [np.outer(system.unit, axis) for axis in np.eye(dim)]
    spins = [
        np.cross(axis, np.pad(q, ((0, 0), (0, 3 - dim))))[:, :dim]
        for axis in np.eye(3)[2 if dim == 2 else 0 :]
    ]
    B = project(system.lift.matrix, np.stack([field.ravel() for field in fields + spins], axis=1))
    sizes = np.linalg.norm(B, axis=0)
    # about a line that all points lie on nothing moves, and multigrid would divide by it
    moving = sizes > ROUND * sizes.max(initial=0.0)
    return np.asarray(B[:, moving] / sizes[moving])
