r"""The solver of large models: sparse factors that serve many steps, turned with the bodies, and
small systems for the joints.

With W = c (bh M + gh C + K) at the configuration where it was factored and R the rotation of every
body since then,

    W^-1 ~ R W0^-1 R^T.

Joints and configuration-dependent loads touch few unknowns, or means of many, the interface b: their second
derivatives H_b and Jacobian J_b enter exactly by a small system with F = (W^-1)_bb,

    [ I + F H_b   F J_b^T ] [ d_b ]   [ y_b ]
    [ J_b         0       ] [ l   ] = [ g   ],     y = W^-1 r,     d = y - W^-1 E_b (H_b d_b + J_b^T l),

so the factors depend on the bodies alone. Where H_b and J_b are zero, as of points that touch
nothing, unknowns are left out. Turned factors contract so well (1e-5 to 1e-3) that most steps need
one correction; the contraction is measured again every few steps. Interface unknowns without
stiffness and mass (massless frames) get a shift in W that H_b takes back. Everything else is the
compiled step of `stepping`.

Source (re-use of factors in turning bodies): corotational iteration matrices, e.g. Felippa and
Haugen, Comput. Methods Appl. Mech. Engrg. 194 (2005) 2285-2335, doi 10.1016/j.cma.2004.07.035.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse import csr_array, diags_array, vstack

from ...core import machine_memory
from ...core.algebra import direct, krylov, pardiso, supernodes
from ...core.algebra.linalg import distinct, is_identity, selection
from ...core.algebra.rotations import nearest
from ...core.compiling.structs import Callback, place_of, unpacked
from ...core.storage.records import dataclass
from ...systems import compiled, evaluation, free_motions
from ...systems.compiled import Compiled
from ...systems.evaluation import Space
from ...systems.system import reads
from ...systems.terms import elastic as terms
from ..scheme import Solver
from . import factors, settling
from .step import Method, Step

#: relative residual of the multigrid solution, the contraction of the Newton iteration
LOOSE = 1e-5
# a hundredth and a hundred times of it give the same motion of a crank-slider: frames have no
# stiffness, or that of a body
METHOD = place_of(Step, "method")  #: where it begins in a packed step
WIDE = 48  #: unknowns of a row from which it is a mean: a place of a plate reads 16 functions
EMPTY = 1e-8  #: diagonal of W, relative to the largest, below which an interface unknown counts as massless


class Standing(NamedTuple):
    """Of the interface what is not zero, as the bodies stand.

        [[1 + F H, F J^T], [J, 0]],    F = W^-1

    of b unknowns and m constraints.
    """

    turns: list[np.ndarray]  #: of the bodies since W was factored
    at: np.ndarray = np.zeros(0, np.int64)  #: (b,) where they are in the interface
    small: np.ndarray = np.eye(0)  #: the same on the interface (b, b)
    H: np.ndarray = np.eye(0)  #: second derivatives of joints and loads (b, b)
    J: np.ndarray = np.eye(0)  #: Phi_q (m, b)
    factors: tuple[np.ndarray, np.ndarray] = (np.eye(0), np.zeros(0))


class Large:
    """Factors of one model in the course of a run; `table` is where the step is packed, which takes
    longer than a routine.
    """

    def __init__(self, model: Compiled, solver: Solver = "own") -> None:
        self.model = model
        system = model.system
        self.solver: Solver = solver
        self.dim, self.size = system.dim, system.size
        # a rotation of a slaved coordinate would be one of its frame, too
        # unknowns are whole vectors, on which a rotation can act
        self.turns = is_identity(csr_array(system.lift.matrix))
        # found once: which unknowns joints and loads read does not change in a run
        self.interface = interface(model, self.turns)
        self.bodies = rotation_weights(model) if self.turns else []
        self.label = "sparse factors"  #: of the solver, more exactly once there are factors
        self.place = model.system.x0  #: configuration where W was factored
        self.factored: list[np.ndarray] = []  #: rotations of the bodies there
        self.motions = free_motions.rigid_motions(model.system)
        self.inverse: Inverse | None = None
        self.which = factors.EXACT  #: what W is made of
        self.start: csr_array | None = None  #: W of a start
        self.now = Standing([])

    def doors(self, step: Step) -> tuple[Callback, Callback, Callback]:
        """`factorise`, `solve` and `settle` of `stepping.Doors`, for a step of any method."""

        def now(table: int) -> Step:
            # parts of a step share all but its method
            return step._replace(method=unpacked(Method, table + 8 * METHOD))

        return (
            Callback(lambda table, more: self.factorise(now(table))),
            Callback(lambda table, more: self.solve(now(table), table)),
            Callback(lambda table, more: self.settle(now(table), table)),
        )

    def factorise(self, step: Step) -> None:
        """Factors of W at the trial state, and columns of its inverse that belong to the interface,
        or SolverError.
        """
        system = self.model.system
        method = step.method
        space = step.space
        work = step.work
        W = method.bh * csr_array(system.mass)
        # bodies alone: joints and loads of a step would make every factor one of its own
        self.which = int(work.kind[1])
        if self.which not in (factors.MASS, factors.TOUCHING):
            gh = method.gh * (factors.DAMPING if self.which == factors.ELASTIC else 1.0)
            K = gh * csr_array(system.damping) + csr_array(system.stiffness)
            K = K + compiled.elastic_tangent(self.model, space.x, gh)
            W = W + (factors.SOFTNESS * K if self.which == factors.SOFT else K)
        W = csr_array(method.c * W)
        diagonal = W.diagonal()
        # frames without mass and stiffness have zero pivots; H takes the same shift back, so that
        # the solution has none of it
        E, alone = self.interface.rows, self.interface.alone
        empty = (alone >= 0) & (diagonal[alone] < EMPTY * diagonal.max())
        self.shift = np.where(empty, np.median(diagonal), 0.0)
        shift = np.zeros(self.size)
        shift[alone[empty]] = self.shift[empty]
        W = csr_array(W + diags_array(shift))
        self.inverse = inverse(W, self.motions, self.solver, self.inverse)
        self.label = self.inverse.label
        work.rate[0], self.place, self.factored = 1.0, space.x.copy(), fit_rotations(self, space.x)
        # W^-1 of the interface is made with the factors: a step then solves a system of its size
        spread = refined(W, self.inverse, E.toarray())
        self.flexible = np.ascontiguousarray((E @ spread.T).T)
        # half of the memory, for what enters corrections only: a correction leaves 1e-7 of itself
        # to the next one; starts are solved to the last digit
        self.start = W if self.which >= factors.STIFF else None
        self.spread = spread if self.start is not None else spread.astype(np.float32)
        work.kind[0] = work.kind[2] = factors.BAND_CHOLESKY

    def solve(self, step: Step, table: int) -> None:
        """rhs <- KKT^-1 rhs."""
        now = self.now = self.standing(step, table)
        r = step.space.f.copy()
        # into the frame in which W was factored, and back in `close`: factors of the start serve a
        # run, where those that stand still diverge at 1 rad
        rotate(self, r, [R.T for R in now.turns])
        assert self.inverse is not None
        W = self.start
        rows = r[None, :]
        found = self.inverse.solve(rows) if W is None else refined(W, self.inverse, rows)
        self.close(step.space, now, found[0])

    def settle(self, step: Step, table: int) -> None:
        """As `settling.settle`, with the interface of the last correction."""
        # turns, derivatives and factors of the interface are those of the last correction: made
        # anew, a coarse crank-slider takes 1.3 times as long
        settling.find_drift(table)
        self.close(step.space, self.now, np.zeros(self.size))
        if not settling.move_velocities(table):
            step.work.kind[0] = 0

    def standing(self, step: Step, table: int) -> Standing:
        """The interface in the trial state."""
        space = step.space
        turns = [
            now @ then.T
            for now, then in zip(fit_rotations(self, space.x), self.factored, strict=True)
        ]
        if len(self.interface.alone) == 0:
            return Standing(turns)
        # points that touch nothing are left out: 729 unknowns of a plate of 8 x 8 cells over a
        # floor cost 0.33 s a correction
        at, H, J = self.slopes(step, table)
        nb = len(at)
        m = len(J)
        small = block_rotations(self, turns, at)
        F = small @ self.flexible[np.ix_(at, at)] @ small.T
        A = np.zeros((nb + m, nb + m))
        # LAPACK itself below: the checks of scipy.linalg.solve took a tenth of the time of models
        # with joints
        A[:nb, :nb], A[:nb, nb:], A[nb:, :nb], A[nb:, nb:] = (
            np.eye(nb) + F @ H,
            F @ J.T,
            J,
            np.diag(space.off),
        )
        return Standing(turns, at, small, H, J, dgetrf(A)[:2] if nb + m else (A, np.zeros(0)))

    def close(self, space: Space, now: Standing, r: np.ndarray) -> None:
        """The interface solved, with W^-1 of what stands for the point as the bodies stood when W
        was factored.

            rhs <- KKT^-1 (., g)    from    rhs = (., g)
        """
        n = self.size
        nb = len(now.at)
        # what the interface takes is one product of its size and one solution, in any step
        if nb:
            found = dgetrs(
                *now.factors,
                np.concatenate([now.small @ (self.interface.rows @ r)[now.at], space.rhs[0, n:]]),
            )[0]
            push = now.H @ found[:nb] + now.J.T @ found[nb:]
            r -= (now.small.T @ push).astype(self.spread.dtype) @ self.spread[now.at]
            space.rhs[0, n:] = found[nb:]
        rotate(self, r, now.turns)
        space.f[:] = r

    def slopes(self, step: Step, table: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where in the interface they are not zero: second derivatives of joints and loads, less
        the shift, and Phi_q.
        """
        space = step.space
        space.gh[0] = step.method.gh
        if self.which in (factors.MASS, factors.SOFT, factors.ELASTIC):
            space.H[:], space.low.used[0] = 0.0, 0
        else:
            evaluation.probe_slopes(table)
        pairs, H = compiled.row_slopes(self.model, space)
        rows, places = np.unique(pairs[H != 0.0], return_inverse=True)
        y = np.zeros((len(rows), len(rows)))
        probes = self.interface.probes
        J = space.Jy @ probes
        np.add.at(y, tuple(places.reshape(-1, 2).T), H[H != 0.0])
        used = probes[rows].any(axis=0) | J.any(axis=0) | (self.shift != 0.0)
        if self.turns:  # whole vectors
            # all components of a vector, on which rotations act
            used = np.repeat(used.reshape(-1, self.dim).any(axis=1), self.dim)
        at = np.flatnonzero(used)
        part = probes[np.ix_(rows, at)]
        return at, part.T @ y @ part - np.diag(self.shift[at]), J[:, at]


class InterfaceRows(NamedTuple):
    """What constraints and loads that depend on the configuration read: z = rows @ x, of which the
    probes are y = probes @ z.

    Unknowns, in whole vectors where rotations act, and means of many of them, as those of an average.
    """

    rows: csr_array  #: (b, n)
    probes: np.ndarray  #: (y, b)
    alone: np.ndarray  #: (b,) the unknown that a row is, -1 of a mean


def interface(model: Compiled, whole: bool) -> InterfaceRows:
    """What constraints and loads that depend on the configuration read."""
    system = model.system
    # whatever a constraint or a force with derivatives may read in a run: the interface has one
    # size
    rows = {int(k) for k in reads(system.constraints, len(system.probes.offset)).indices}
    rows |= {int(k) for k in model.pairs.ravel()} | {
        int(k) for force in model.forces if force.low.terms for k in force.alone
    }
    P = csr_array(system.probes.matrix)
    wide = means(P, rows, system.dim) if whole else []
    touched = distinct(P[sorted(rows - set(wide))].indices)
    if whole:
        first = distinct(touched // system.dim) * system.dim
        touched = (first[:, None] + np.arange(system.dim)).ravel()
    count = len(touched)
    unit = selection(touched, P.shape[1])
    probes = np.zeros((P.shape[0], count + len(wide)))
    probes[:, :count] = P[:, touched].toarray()
    probes[wide] = 0.0
    probes[wide, count + np.arange(len(wide))] = 1.0
    alone = np.append(touched, np.full(len(wide), -1)).astype(np.int64)
    return InterfaceRows(csr_array(vstack([unit, P[wide]])) if wide else unit, probes, alone)


def means(P: csr_array, rows: set[int], dim: int) -> list[int]:
    """Rows among those of P (y, n) that read many unknowns, a row for each component of a mean.

    A mean of the 300 nodes of a face is 3 rows of an interface, its nodes would be 900.
    """
    found: list[int] = []
    sizes = np.diff(P.indptr)
    for first in sorted(rows):
        if sizes[first] <= WIDE or (found and first <= found[-1]):
            continue
        group = range(first, first + dim)
        if not rows.issuperset(group) or not (sizes[first : first + dim] == sizes[first]).all():
            continue
        start, size = P.indptr[first], sizes[first]
        data, indices = (
            one[start : start + dim * size].reshape(dim, size) for one in (P.data, P.indices)
        )
        vectors = (indices[0] % dim == 0).all() and (np.diff(indices, axis=0) == 1).all()
        if vectors and (data == data[0]).all():
            found.extend(group)
    return found


def rotation_weights(model: Compiled) -> list[tuple[slice, np.ndarray]]:
    """Coordinates of every surface and solid, and weights G (b, c) of its functions, by which it shows how it
    has turned.

        G = sum w N,k t_k,    q^T G = sum w r,k t_k^T
    """
    system = model.system
    found = []
    spans = {name: slice(first, last) for name, first, last in system.coordinates}
    q = system.lift(system.x0)
    dim = system.dim
    for elastic in system.elastic:
        if elastic.gather.law.tangents:
            where = spans[elastic.name]
            found.append(
                (
                    where,
                    terms.rotation_weights(elastic.gather, q)[
                        where.start // dim : where.stop // dim
                    ],
                )
            )
    return found


def fit_rotations(large: Large, x: np.ndarray) -> list[np.ndarray]:
    """Rotation of every body that fits its motion from the reference best.

        q^T G = R S    (polar decomposition)

    with the weights G of `rotation_weights`.
    """
    # by all vectors of a body, so that what it bends to one side here it bends to the other there
    return [nearest(x[where].reshape(-1, large.dim).T @ G) for where, G in large.bodies]


def rotate(large: Large, r: np.ndarray, turns: list[np.ndarray]) -> None:
    """r <- R r, vector by vector, in place."""
    for (where, _), R in zip(large.bodies, turns, strict=True):
        part = r[where].reshape(-1, large.dim)
        # in place, over all vectors of a body in one product
        part[:] = part @ R.T


def block_rotations(large: Large, turns: list[np.ndarray], at: np.ndarray) -> np.ndarray:
    """R (b, b) on vectors at places of the interface (b,)."""
    out = np.eye(len(at))
    dim = large.dim
    rows = large.interface.rows
    unknowns = rows.indices[rows.indptr[at]]
    for (where, _), R in zip(large.bodies, turns, strict=True):
        mine = np.flatnonzero((unknowns >= where.start) & (unknowns < where.stop))
        for i in range(dim):
            for j in range(dim):
                out[mine[i::dim], mine[j::dim]] = R[i, j]
    return out


@dataclass(frozen=True)
class Inverse:
    """W^-1 up to a small relative error, and a description for reports."""

    solve: Callable[[np.ndarray], np.ndarray]  #: rows (k, n) -> rows
    label: str
    pattern: tuple[np.ndarray, np.ndarray] | None = None  #: of W, row by row, and
    tree: supernodes.Tree | None = None  #: its analysis, where there is one


def inverse(
    W: csr_array, motions: np.ndarray, solver: Solver = "own", before: Inverse | None = None
) -> Inverse:
    """Factors in single precision where they fit into the memory, else conjugate gradients with a
    multigrid preconditioner.

    Where PARDISO is asked for, its factors in double precision. The analysis of a matrix of
    `before` serves others of its pattern.
    """
    W.setdiag(W.diagonal())
    W.sum_duplicates()
    if solver == "pardiso":
        found = pardiso.factor(W)
        return Inverse(
            lambda rows: pardiso.solve(found, rows),
            f"PARDISO LDL^T with {found.numbers:.3g} numbers",
        )
    pattern = (W.indptr, W.indices)
    tree = None
    if (
        before is not None
        and before.pattern is not None
        and all(map(np.array_equal, pattern, before.pattern))
    ):
        # the order of elimination is a fifth of the time where a third of the steps factor anew
        tree = before.tree
    tree = tree or supernodes.analyse(W)
    fill = supernodes.entries(tree)
    if krylov.choose(W.shape[0], fill, machine_memory.free(), 4.0) == "direct":
        # half of the numbers to read in a solution; six digits are more than turned factors are
        # good for
        factors = direct.factor(W, np.float32, tree)
        label = f"sparse LDL^T with {fill:.3g} numbers in single precision"
        return Inverse(lambda rows: direct.solve(factors, rows.copy()), label, pattern, tree)
    # room for multigrid, which is taken for want of memory
    del tree
    hierarchy = krylov.multigrid(W, motions, node_size(W))
    report = hierarchy.report
    label = f"conjugate gradients, multigrid with {len(report.unknowns)} levels, {report.memory / 2**20:.0f} MiB; "
    label += f"factors of {fill:.3g} numbers do not fit"
    return Inverse(
        lambda rows: np.stack([krylov.solve(hierarchy, row, LOOSE)[0] for row in rows]), label
    )


def node_size(W: csr_array) -> int:
    """Largest of the sizes 9, 6, 3, 2 in which whole blocks of unknowns share a row pattern; 1 if
    none.
    """
    counts = np.diff(W.indptr)
    # multigrid coarsens nodes and not unknowns: nine of plates with gradients, six in the plane
    for size in (9, 6, 3, 2):
        if W.shape[0] % size == 0:
            first = W.indptr[:-1].reshape(-1, size)
            same = (counts.reshape(-1, size) == counts[::size, None]).all()
            if same and all(
                (
                    W.indices[first[k, 0] :][: counts[size * k]] % size
                    == np.arange(counts[size * k]) % size
                ).all()
                for k in (0, -1)
            ):
                return size
    return 1


def refined(W: csr_array, approximate: Inverse, columns: np.ndarray) -> np.ndarray:
    """Solutions for columns (rows of the array) with three steps of refinement.

        x <- x + P^-1 (b - W x)

    with the `approximate` inverse P^-1 of W.
    """
    x = approximate.solve(columns) if len(columns) else columns
    # single precision gains six digits a step: three of them are full double precision with one to
    # spare
    for _ in range(3 if len(columns) else 0):
        x = x + approximate.solve(direct.residual(W, x, columns))
    return x
