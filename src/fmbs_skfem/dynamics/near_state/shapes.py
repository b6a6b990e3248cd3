r"""Small motions about a state, and what moves in them: shares of bodies, rigid motions that
nothing resists.

    share of body b     Re sum_(i in b) conj(v_i) (M v)_i / v^H M v,   that of the kinetic energy                          (1)
    free motions        v = B z on the bodies with  Phi_x v = 0  and  K v = 0,  so that omega = 0                          (2)

B are the rigid motions of every body. Free motions are found as such, and the others on the rows
Phi_x and v^T M: zero then costs no digits of the lowest frequencies, and says which motion it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import block_diag, csr_array

from ...core.algebra import ranks
from ...core.algebra.linalg import as_dense, squares
from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values.arguments import blaming, check_fields, checked, require
from ...systems import free_motions
from ...systems.connections import mechanism
from ...systems.system import System, project
from .linear import Linear

#: force on a motion, over the largest of which its stiffness is made, that is round-off
UNHELD = 1e-12
LISTED = 0.01  #: share from which a body is listed
FEW = 4  #: bodies that are listed
#: distance of a shape from free motions, over its own size, up to which it is one of them
ALIKE = 1e-3


@dataclass(frozen=True)
class Shapes:
    """Small motions of a system about a state x, v a column of `vectors`.

        x + Re v exp(s t)

    Their size is arbitrary; `captions` say what they are.
    """

    system: System
    x: np.ndarray  #: (n,) the state
    vectors: np.ndarray  #: (n, i), complex where bodies do not move in phase
    captions: tuple[str, ...]  #: (i,) what they are, in a few words

    def __post_init__(self) -> None:
        require("Shapes: system", self.system, System)
        require("Shapes: x", self.x, np.ndarray)
        require("Shapes: captions", self.captions, tuple[str, ...])
        with blaming(lambda: check_fields(self)):
            sizes = np.shape(self.x), np.shape(self.vectors), len(self.captions)
        if sizes != (
            (self.system.size,),
            (self.system.size, len(self.captions)),
            len(self.captions),
        ):
            expected = f"x ({self.system.size},), vectors ({self.system.size}, i) and captions (i,)"
            raise InputError(say("Shapes", expected, f"{sizes[0]}, {sizes[1]} and ({sizes[2]},)"))

    def __repr__(self) -> str:
        return f"<Shapes {', '.join(self.captions)}>"


@dataclass(frozen=True)
class Free:
    """Rigid motions that neither joints nor forces resist.

    The columns of `vectors` are independent, each a rigid motion of as few bodies as possible.
    """

    vectors: np.ndarray  #: (n, f)
    names: tuple[str, ...]  #: (f,) such as `beam turns about (0, 0)`


@checked
def shares(shapes: Shapes) -> dict[str, np.ndarray]:
    """Parts (i,) of every motion v that belong to the bodies b, to components of a model that is
    saved without them.

        Re sum_(i in b) conj(v_i) (M v)_i / v^H M v    (1)

    Where a motion has no mass, W of `systems.lengths` takes the place of M.
    """
    system = shapes.system
    base = shapes.system.full or shapes.system
    v = shapes.vectors if base is system else system.lift.matrix @ shapes.vectors
    spans = base.coordinates if base.size == len(base.unit) * base.dim else base.components
    M = base.mass if (squares(v, base.mass) > 0.0).all() else base.metric
    density = np.real(np.conj(v) * (M @ v)) / np.maximum(squares(v, M), 1e-300)
    return {name: density[first:last].sum(axis=0) for name, first, last in spans}


def say_shares(found: dict[str, np.ndarray], number: int) -> str:
    """`crank 97 %, rocker 3 %`, the largest first.

    `found` are those of `shares`, `number` is that of the motion; four at most, those below 1 %
    left out.
    """
    listed = sorted(
        ((float(values[number]), name) for name, values in found.items()), key=lambda pair: -pair[0]
    )
    told = [f"{name} {100 * share:.3g} %" for share, name in listed[:FEW] if share >= LISTED]
    return ", ".join(told)


def in_phase(vectors: np.ndarray, metric: csr_array | np.ndarray) -> np.ndarray:
    """Complex motions (n, i), each turned by a phase so that as much of it as possible is at its
    largest at t = 0.

        exp(-i angle) v,    angle = arg(v^T W v) / 2

    with the `metric` W (n, n): v^T W v is then real and positive.
    """
    angle = 0.5 * np.angle(np.sum(vectors * (metric @ vectors), axis=0))
    return np.asarray(vectors * np.exp(-1j * angle))


@checked
def find_free(system: System, linear: Linear) -> Free:
    """The rigid motions (2) of a system about the state of its linear equations, each of as few
    bodies as possible.

    None are found where the unknowns are not made of body coordinates, as of a component that is
    saved without its bodies.
    """
    T = system.lift.matrix
    q = system.lift(linear.x)
    base = replace(system.full or system, x0=q)
    if len(base.unit) * base.dim != len(q):
        return Free(np.zeros((system.size, 0)), ())
    B = as_dense(csr_array(block_diag(mechanism.motions(base, q))))
    X = project(T, B)
    Z = np.eye(B.shape[1])
    for part, size, noise in (
        (block_diag(mechanism.idle(base)).toarray(), 0.0, 0.0),
        (T @ X - B, np.abs(B), ranks.EXACT),
        (linear.rows @ X, np.abs(linear.rows) @ np.abs(X), ranks.EXACT),
        (linear.stiffness @ X, abs(linear.stiffness) @ np.abs(X), UNHELD),
    ):
        left = part @ Z
        left[np.abs(left) <= noise * np.max(size, initial=0.0)] = 0.0
        Z = (
            Z @ ranks.null_space(ranks.unit_rows(left), ranks.STATED, alike=True)
            if left.any()
            else Z
        )
    basis = free_motions.sparse_basis(Z)
    return Free(X @ basis.T, tuple(str(free_motions.motion(base, z)) for z in basis))


def apart_from(linear: Linear, free: Free) -> Linear:
    """The equations of motions that are orthogonal to free ones in the mass.

        v^T M u = 0

    Such rows of the free motions v stand behind those of the joints, (m + f, n).
    """
    return replace(linear, rows=np.concatenate([linear.rows, (linear.mass @ free.vectors).T]))


def stands_alone(linear: Linear, free: Free) -> bool:
    """Whether no force acts along free motions Y, so that motions orthogonal to them in the mass
    stay so.

        Y^T K = 0,    Y^T C = 0

    Both to round-off, beside the largest of |Y|^T |K| and |Y|^T |C|.
    """
    along = np.abs(free.vectors.T)
    return all(
        (np.abs(free.vectors.T @ A) <= ranks.STATED * (along @ abs(A)).max(initial=0.0)).all()
        for A in (linear.stiffness, linear.damping)
    )


def are_free(vectors: np.ndarray, free: Free, metric: csr_array | np.ndarray) -> np.ndarray:
    """Which motions (n, i) are combinations of free ones, (i,) bool.

        |v - Y Y^+ v|_W <= 1e-3 |v|_W

    What is left of v without its part along Y, in the `metric` W (n, n), is so little.
    """
    Y = free.vectors
    if not Y.shape[1]:
        return np.zeros(vectors.shape[1], dtype=bool)
    rest = vectors - Y @ np.linalg.solve(Y.T @ (metric @ Y), Y.T @ (metric @ vectors))
    return np.asarray(squares(rest, metric) <= ALIKE**2 * squares(vectors, metric))
