"""Elastic terms f(x) = L^T phi(L x): what a storage of L has to say, whichever it is.

A storage is a struct of arrays; for its type it registers

    carry           itself in other coordinates x = V z + d
    split           itself in pieces whose numbers stay in the cache, in the coordinates of `Lifts` if it reads bodies
    compile_term    a piece as a record of arrays and three routines that act on it (`evaluation.ElasticTerms`)
                    of a law at points, `at_points` makes them: gather, evaluate, scatter

and, where the default does not do, `couplings`, `position_gradients` and what costs are counted
from: `functions_read`, `numbers_read` and `cells_of_points`; points that can be sampled say their
`points.dense_rows` and `unknowns`, and `choose_points` among them. Nothing else asks which storage
a term has.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from functools import singledispatch
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np
from scipy.sparse import csr_array

from ...bodies import laws
from ...bodies.vectors import AXIAL
from ...core.algebra.linalg import as_dense, is_sparse, stacked
from ...core.compiling.entries import view
from ...core.compiling.structs import (
    Callback,
    Routine,
    Shorts,
    Vector,
    address_of,
    packed,
    routine,
    unpacked,
)
from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ..affine import Affine, Matrix
from ..evaluation import ACCEPTED, EXACT, NOW, Space, evaluation

Function: TypeAlias = Callable[..., Any]


class TermRoutines(NamedTuple):
    """What a record of an elastic term is acted on by; each takes the table of the evaluation and
    the record.

        force      f += L^T phi(L x, L v)            tangent    W += L^T phi' L, derivatives by rates times gh
        energy     energy += phi(L x) [J]            dissipate  energy += power [W] of what reads velocities

    The last one is None where nothing does.
    """

    force: Routine | Callback
    tangent: Routine | Callback
    energy: Routine | Callback
    #: with dense modes in a force alone, gather and scatter, for reports of time
    force_products: tuple[Routine, ...] = ()
    tangent_products: tuple[Routine, ...] = ()  #: U^T D U in a tangent alone
    #: of what reads velocities: energy += power of damping half way, see `work`
    dissipate: Routine | Callback | None = None


@dataclass(frozen=True)
class Piece:
    """A record for compiled code with the routines that act on it; it owns the arrays that its
    address points to.
    """

    record: Any  #: a struct, see `core.compiling.structs`
    routines: Any  #: a tuple of routines by name

    def __post_init__(self) -> None:
        object.__setattr__(self, "table", packed(self.record))

    @property
    def callbacks(self) -> list[Callback]:
        """Those of its routines that are functions of Python, which keep what went wrong in them."""
        return [one for one in self.routines if isinstance(one, Callback)]

    @property
    def address(self) -> int:
        """Of the record for compiled code."""
        return address_of(self.__dict__["table"])


@dataclass(frozen=True)
class Term(Piece):
    """A piece of a storage of elastic energy for compiled code.

    InputError where it reads velocities and has no routine `dissipate`.
    """

    routines: TermRoutines
    work: int  #: length of a work vector
    damped: bool = False  #: whether it reads velocities
    kept: int = 0  #: numbers in the gradients of a space
    follows: bool = False  #: whether it is a load that follows what it pushes, which does work and stores nothing
    turned: int = 0  #: numbers that it keeps of a tangent, to turn it with its body
    holds: bool = False  #: whether its tangents take stresses of another state

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.damped and self.routines.dissipate is None:
            raise InputError(say("a term that reads velocities", "a routine 'dissipate'", "none"))


class Targets(NamedTuple):
    """Where entries of the lower triangles of all cell matrices go in the flat storage of W.

    Without `source` there is one place for every entry, -1 for none; else W[target] += factor
    entries[source].
    """

    source: Shorts
    target: Shorts
    factor: Vector


@dataclass(frozen=True)
class Setting:
    """How a piece is compiled: what `compile_term` needs beside the piece."""

    dim: int
    beta: float  #: stiffness-proportional damping time [s]
    targets: Callable[[np.ndarray], Targets]  #: of the cells that read coordinates p (l, e)
    kept: int  #: first place in the gradients of a space
    turned: int  #: first place in what it keeps of turned tangents


def first_kept(law: laws.Law, setting: Setting) -> int:
    """The first place of its gradients in what a space keeps; -1 where neither damping nor its
    modulus needs them.
    """
    return setting.kept if setting.beta > 0.0 or law.holds else -1


def count_kept(law: laws.Law, gradients: int, setting: Setting) -> int:
    """How many numbers a space keeps of so many gradients: rates as well where they are damped."""
    return (2 if setting.beta > 0.0 else 1) * gradients if first_kept(law, setting) >= 0 else 0


@dataclass
class Lifts:
    """Coordinates p (p,) of the cells, while pieces of bodies say which ones they read: those of
    the bodies, or images of them.

        p = matrix @ x + offset

    of the unknowns x (n,), see `whole`.
    """

    lift: Affine  #: all body coordinates from the unknowns
    rows: list[Matrix] = field(default_factory=list)
    offsets: list[np.ndarray] = field(default_factory=lambda: [np.zeros(0)])
    shared: int = -1  #: place of the body coordinates themselves
    count: int = 0

    def place(self, spread: csr_array | None) -> int:
        """The first of the coordinates `spread` q, spread (w, q), or of q itself, which is there
        once for all that read it.
        """
        if spread is None and self.shared >= 0:
            return self.shared
        matrix, offset = self.lift.matrix, self.lift.offset
        if spread is not None:
            return self.add(spread @ matrix, spread @ offset)
        self.shared = self.add(matrix, offset)
        return self.shared

    def add(self, matrix: Matrix, offset: np.ndarray) -> int:
        """The number of the first of more coordinates p (w,) of the unknowns x (n,).

            p = matrix @ x + offset

        with the matrix (w, n) and the offset (w,).
        """
        start = self.count
        self.rows.append(matrix)
        self.offsets.append(offset)
        self.count += len(offset)
        return start

    def whole(self) -> tuple[Matrix, np.ndarray]:
        """Matrix (p, n) and offset (p,) of p from the unknowns, sparse where all parts of it are."""
        rows = self.rows or [self.lift.matrix[:0]]
        matrix = (
            stacked(rows)
            if all(map(is_sparse, rows))
            else np.concatenate([as_dense(row) for row in rows])
        )
        return matrix, np.ascontiguousarray(np.concatenate(self.offsets))


def at_points(
    owner: str,
    opened: Callable[[Any], Any],
    place: Function,
    read: Function,
    scatter: Function,
    add_tangent: Function,
    **more: tuple[Routine, ...],
) -> TermRoutines:
    """The routines of a storage whose law acts at points: gather, evaluate, scatter, for a module
    `owner` and its record P.

    It brings functions for compiled code: place(P, target, at), an array (k c, p, e) from a place
    of `target` on; read(s, P, order, target, at), the same with the gradients of the positions
    (`order` 0) or of their rates (1); scatter(s, P, S) of stresses; and add_tangent(s, P, D) of
    moduli (k c, k c, p, e).
    """

    def force(table: Any, record: Any) -> int:
        s = evaluation(table).space
        P = opened(record)
        # gradients are kept for the heat of a step and for stresses that tangents hold: neither
        # costs a second evaluation
        room, at = (s.gradients[NOW], P.kept) if P.kept >= 0 else (s.work[0], 0)
        u = read(s, P, 0, room, at)
        rate = read(s, P, 1, room, at + u.size) if P.beta > 0.0 else u
        # stresses beside gradients, in rooms that all terms share
        S = view(s.work[2], 0, u.shape)
        laws.call_stress(P.calls, u, rate, P.beta, P.section, S)
        scatter(s, P, S)
        return 0

    def tangent(table: Any, record: Any) -> int:
        s = evaluation(table).space
        P = opened(record)
        # gradients once more: those of the force are of another term by now
        u = read(s, P, 0, s.work[0], 0)
        rows, points, cells = u.shape
        D = view(s.work[1], 0, (rows, rows, points, cells))
        # on the way of a step guesses stretch what turns: stresses of the state before are nearer
        # to those of its end
        holds = P.kept >= 0 and s.holding[0] != EXACT
        held = place(P, s.gradients[ACCEPTED], P.kept) if holds else u
        laws.call_modulus(
            P.calls, u, held, s.holding[0] if holds else AXIAL, s.gh[0] * P.beta, P.section, D
        )
        add_tangent(s, P, D)
        return 0

    def energy(table: Any, record: Any) -> int:
        s = evaluation(table).space
        P = opened(record)
        s.energy[0] += laws.call_energy(P.calls, read(s, P, 0, s.work[0], 0), P.section)
        return 0

    def dissipate(table: Any, record: Any) -> int:
        """Energy += the power of damping half way between the last evaluation and the accepted
        state, see `Space.gradients`.
        """
        s = evaluation(table).space
        P = opened(record)
        u, rate = place(P, s.work[1], 0), place(P, s.work[2], 0)
        size = u.size
        now, before = (
            view(s.gradients[NOW], P.kept, (2 * size,)),
            view(s.gradients[ACCEPTED], P.kept, (2 * size,)),
        )
        mean, mean_rate = view(u, 0, (size,)), view(rate, 0, (size,))
        for i in range(size):
            # of second order, and none of a rigid rotation, which has no rate half way
            mean[i] = 0.5 * (now[i] + before[i])
            mean_rate[i] = 0.5 * (now[size + i] + before[size + i])
        s.energy[0] += P.beta * laws.call_dissipation(P.calls, u, rate, P.section, s.work[0])
        return 0

    for one in (force, tangent, energy, dissipate):
        one.__module__ = owner
        one.__qualname__ = one.__name__
    return TermRoutines(
        routine(force), routine(tangent), routine(energy), dissipate=routine(dissipate), **more
    )


@singledispatch
def carry(storage: Any, name: str, lift: Affine, V: Matrix, d: np.ndarray) -> Any:
    """The storage of a body in unknowns z (r,), with V (n, r) and d (n,); `lift` gives the body
    coordinates from z.

        x = V z + d

    Types of storages register here; TypeError for a type that has not.
    """
    raise TypeError(type(storage))


@singledispatch
def multiply_out(storage: Any, lift: Affine) -> Any:
    """The storage of a reduced body as points in the unknowns, for those who choose among points;
    most are as they stand.

    `lift` gives the body coordinates from the unknowns. Types of storages register here.
    """
    return storage


@singledispatch
def split(storage: Any, lifts: Lifts) -> Sequence[Any]:
    """The storage in pieces whose numbers stay in the cache from gather to scatter.

    Pieces that read bodies are in the coordinates p of `lifts`. Types of storages register here;
    TypeError for a type that has not.
    """
    raise TypeError(type(storage))


def is_storage(value: Any) -> bool:
    """Whether terms can be made of a value: whether its type has registered with `split`."""
    return split.dispatch(type(value)) is not split.dispatch(object)


@singledispatch
def compile_term(piece: Any, setting: Setting) -> Term:
    """A piece for compiled code: a record, routines that act on it, and what they need of the
    space.

    Types of pieces register here; TypeError for a type that has not.
    """
    raise TypeError(type(piece))


@singledispatch
def couplings(piece: Any) -> np.ndarray:
    """Coordinates p (l, e) that each of e cells of a piece couples, l a cell; none (0, 0) where it
    acts on dense unknowns.
    """
    return np.zeros((0, 0), np.int64)


@singledispatch
def stiffened(piece: Any) -> np.ndarray:
    """Coordinates p (l,) to which a piece gives a stiffness: by default all that it couples."""
    return couplings(piece).ravel()


@singledispatch
def position_gradients(storage: Any, x: np.ndarray, q: np.ndarray) -> np.ndarray | None:
    """Derivatives of the position u (k c, p, e) at the points of a storage, at unknowns x (n,) and
    body coordinates q (q,).

    None where it has no points.
    """
    return None


@singledispatch
def rotation_weights(storage: Any, q: np.ndarray) -> np.ndarray:
    """G (b, c) of a surface or solid, for the vectors of all body coordinates q (q,), b of them.

        G_b = sum_p w sum_k N_b,k r,k    of the tangents k of its law

    over its points; zeros for functions of other bodies. TypeError for a storage without it.
    """
    raise TypeError(type(storage))


@singledispatch
def functions_read(storage: Any, size: int) -> csr_array:
    """Ones (e, b) where a cell of a full body reads one of the `size` functions b of all bodies.

    Other storages have no rows, (0, b).
    """
    return csr_array((0, size), dtype=np.float32)


@singledispatch
def numbers_read(storage: Any) -> float:
    """Products of a table entry with a coordinate in one evaluation of the force of a full body; 0
    of other storages.

    They stand for its cost.
    """
    return 0.0


@singledispatch
def cells_of_points(storage: Any) -> np.ndarray:
    """Number of the cell of every point in use of a reduced body (p,); none (0,) of storages
    without such points.
    """
    return np.zeros(0, np.int64)


@singledispatch
def unknowns(storage: Any) -> slice | None:
    """The unknowns that the points of a reduced body read, as a slice of x (n,); None of other
    storages.
    """
    return None


@singledispatch
def choose_points(storage: Any, kept: np.ndarray, factors: np.ndarray) -> Any:
    """The storage of a reduced body at some of its points (i,), their quadrature weights times
    factors (i,).

    TypeError for a storage without points to choose among.
    """
    raise TypeError(type(storage))


class Nothing(NamedTuple):
    """A record of nothing."""


class PythonTerm(Protocol):
    """A force that is evaluated in Python, on all unknowns of a dense system: slow, and free to do
    anything.

        f(x, v),    df/dx + gh df/dv,    energy E(x)

    x and v (n,) are in the order of the system.
    """

    def force(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """f (n,) [N] at x and v (n,), on the left side of the equations: minus a load."""

    def tangent(self, x: np.ndarray, gh: float) -> np.ndarray:
        """Tangent (n, n) of a term at x (n,).

            df/dx + gh df/dv

        gh [1/s].
        """

    def energy(self, x: np.ndarray) -> float:
        """What is stored at x (n,) [J]."""


def of_python(force: PythonTerm) -> Term:
    """A term whose routines are functions of Python: about 0.1 ms a call beside their own time.

    What it dissipates is (f(x, v) - f(x, 0)) . v in the middle of a step.
    """

    def add_force(table: int, _: int) -> None:
        s = unpacked(Space, table)
        s.f[:] += force.force(s.x, s.v)

    def add_tangent(table: int, _: int) -> None:
        s = unpacked(Space, table)
        s.W[:] += force.tangent(s.x, float(s.gh[0]))

    def add_energy(table: int, _: int) -> None:
        s = unpacked(Space, table)
        s.energy[0] += force.energy(s.x)

    def add_dissipation(table: int, _: int) -> None:
        s = unpacked(Space, table)
        between = s.x - 0.5 * s.way
        rate = s.way / s.span[0]
        s.energy[0] += float(rate @ (force.force(between, rate) - force.force(between, 0.0 * rate)))

    routines = TermRoutines(
        Callback(add_force),
        Callback(add_tangent),
        Callback(add_energy),
        dissipate=Callback(add_dissipation),
    )
    return Term(Nothing(), routines, 1, True)
