r"""Linear elasticity of a body that moves by large rotations, as a term: a constant stiffness that
turns with the body.

    W = 1/2 d^T K d,    d_b = R^T (q_b - t_b c) - X_b,    c = sum_b w_b q_b,    w = M t / t^T M t                       (1)
    R the rotation with sum_b m_b x (R^T q_b) = 0,    m_b = sum_a M_ba X_a,    X_b = q0_b - t_b c0                      (2)

Coordinates q (b, 3) are vectors of the scene: positions of nodes, gradients, or what multiplies
shape functions; t are those of the field 1. R is the rotation that fits the motion of the body best
in its mass, the polar factor of q^T M X, and c its centre of mass. Both are the same for a full
body and for coordinates that interpolate it, as M and X are carried over to these. d is orthogonal
to rigid motions in the mass, so that they cost nothing, whatever K is. With y = R^T dq and x_b =
R^T (q_b - t_b c),

    dphi = J^-1 sum_b m_b x y_b,    J = tr(S) 1 - S,    S = sum_b x_b m_b^T (symmetric by (2))                          (3)
    f_b = g_b - s x m_b,    g = K d + D P y',    s = J^-1 sum_b x_b x g_b,    P y = y - dphi x x                        (4)
    d2W = (P y)^T K P y - 2 dphi . sum_b y_b x f_b + sum_b f_b . (dphi x (dphi x x_b))                                  (5)

are the change of R, the forces in the axes of the body and the tangent there, K + V Gamma + (V
Gamma)^T with dphi = Gamma y. Strains are small: a body that spins is not stiffened by it.

Sources: A. Pechstein, D. Reischl, J. Gerstmayr, J. Comput. Nonlinear Dynam. 8 (2013) 031019, doi
10.1115/1.4007191 (modes with vectors); A. Zwoelfer, J. Gerstmayr, Multibody Syst. Dyn. 47 (2019)
263-281, doi 10.1007/s11044-019-09680-6.
"""

from __future__ import annotations

from dataclasses import field, replace
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ...bodies.body import LinearElasticity
from ...bodies.from_matrices import rigid_motions
from ...bodies.laws import Law
from ...core.algebra.linalg import alike, as_dense, is_sparse, support
from ...core.compiling.entries import view
from ...core.compiling.jit import jit
from ...core.compiling.structs import Matrix as Rows
from ...core.compiling.structs import Vector, opener, routine
from ...core.storage.container import storable
from ...core.storage.records import dataclass
from ...core.storage.validation import Range, Reals
from ..affine import Affine, Matrix
from ..evaluation import ACCEPTED, NOW, evaluation
from ..kernels import add_sums, clear_rows
from . import elastic as terms
from .cells import put
from .elastic import Lifts, Setting, Targets, Term, TermRoutines
from .turned_tangents import cofactors, to_rotation

ROUND = 1e-12  #: stiffness of a coordinate, over the largest, that is round-off


@storable
@dataclass(frozen=True)
class Corotated:
    """The energy (1) of a body of b functions, in coordinates z = q[columns], or matrix @ x +
    offset of the unknowns x where there is such a matrix.
    """

    law: ClassVar[Law] = Law.LINEAR
    stiffness: Annotated[np.ndarray, Reals("bc bc")]  #: K, without rigid motions [N/m]
    damping: Annotated[np.ndarray, Reals("* *")]  #: (b c, b c), or none (0, 0) [N s/m]
    reference: Annotated[np.ndarray, Reals("b c")]  #: X, about the centre of mass [m]
    moments: Annotated[np.ndarray, Reals("b c")]  #: m = M X [kg m]
    mass: Annotated[np.ndarray, Reals("b b")]  #: M [kg]
    unit: Annotated[np.ndarray, Reals("b")]  #: t, of the field 1
    weights: Annotated[np.ndarray, Reals("b")]  #: w, of the centre of mass
    columns: Annotated[slice, Range("bc", end="q")]  #: coordinates of the body
    #: (b c, n) of the coordinates z in the unknowns
    matrix: csr_array | np.ndarray | None = None
    offset: np.ndarray = field(default_factory=lambda: np.zeros(0))  #: (b c,)
    slowest: float = 0.0  #: lowest angular frequency of the free body [rad/s], 0 where not known
    prestressed: bool = False  #: whether the stresses of a spin are in its stiffness
    checked: bool = False  #: whether what it takes part in is held against more modes


def of_body(
    linear: LinearElasticity, mass: csr_array, reference: np.ndarray, unit: np.ndarray
) -> Corotated:
    """The energy of a body with stiffness K and damping C in its reference (b, c), the mass M (b,
    b) of every component, and the coordinates `unit` (b,) of the field 1.

        K <- P^T K P,    P = 1 - Q (Q^T M Q)^-1 Q^T M,    Q the rigid motions

    which takes out what numbers of a file leave there, and changes no energy. Stresses of a steady
    spin act on d as well: what they do to rotations of the whole body is in those of its axes.
    """
    weights = np.asarray(mass @ unit) / float(unit @ (mass @ unit))
    about = reference - np.outer(unit, weights @ reference)
    Q = rigid_motions(about, unit)
    MQ = np.asarray(alike(mass, 3) @ Q)
    share = np.linalg.solve(Q.T @ MQ, MQ.T)

    def elastic(A: Matrix) -> np.ndarray:
        B = as_dense(A)
        B = B - (B @ Q) @ share
        B = B - share.T @ (Q.T @ B)
        return np.ascontiguousarray(0.5 * (B + B.T))

    K = elastic(linear.stiffness)
    return Corotated(
        K if linear.prestress is None else K + elastic(linear.prestress),
        np.zeros((0, 0)) if linear.damping is None else elastic(linear.damping),
        about,
        np.asarray(mass @ about),
        as_dense(mass),
        unit,
        weights,
        slice(0, reference.size),
        slowest=linear.slowest,
        prestressed=linear.prestress is not None,
    )


class CorotatedRecord(NamedTuple):
    """A body for compiled code."""

    first: int  #: of the coordinates
    stiffness: Rows
    damping: Rows  #: D = C + beta K, no rows without damping
    reference: Rows
    moments: Rows
    unit: Vector
    weights: Vector
    targets: Targets
    kept: int  #: first place of coordinates and rates in what a space keeps


opened = opener(CorotatedRecord)


@jit
def in_body(P: Any, q: np.ndarray, R: np.ndarray, x: np.ndarray) -> None:
    """x (b, c) = R^T (q_b - t_b c) of coordinates (b, c), with R (c, c) of (2), which is found."""
    for k in range(3):
        centre = 0.0
        for b in range(len(q)):
            centre += P.weights[b] * q[b, k]
        for b in range(len(q)):
            x[b, k] = q[b, k] - P.unit[b] * centre
    # the best fit to the vectors as they are: no angle is followed from step to step
    clear_rows(R)
    for b in range(len(q)):
        for i in range(3):
            for k in range(3):
                R[i, k] += x[b, i] * P.moments[b, k]
    to_rotation(R, np.empty((3, 3)))
    turn_back(R, x)


@jit
def turn_back(R: np.ndarray, x: np.ndarray) -> None:
    """x_b <- R^T x_b, of vectors (b, c)."""
    for b in range(len(x)):
        x0, x1, x2 = x[b, 0], x[b, 1], x[b, 2]
        for k in range(3):
            x[b, k] = R[0, k] * x0 + R[1, k] * x1 + R[2, k] * x2


@jit
def inverse_inertia(P: Any, x: np.ndarray, J: np.ndarray) -> None:
    """J (3, 3) = J^-1 of (3), at x (b, c)."""
    S = np.zeros((3, 3))
    for b in range(len(x)):
        for i in range(3):
            for k in range(3):
                # the symmetric half: the other one is what the iteration leaves of R
                S[i, k] -= 0.5 * (x[b, i] * P.moments[b, k] + x[b, k] * P.moments[b, i])
    trace = S[0, 0] + S[1, 1] + S[2, 2]
    for i in range(3):
        S[i, i] -= trace
    det = cofactors(S, J)
    for i in range(3):
        for k in range(3):
            J[i, k] /= det


@jit
def add_moment(x: np.ndarray, g: np.ndarray, moment: np.ndarray) -> None:
    """moment (c,) += sum_b x_b x g_b of vectors (b, c)."""
    for b in range(len(x)):
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            moment[k] += x[b, i] * g[b, j] - x[b, j] * g[b, i]


@jit
def subtract_turned(J: np.ndarray, moment: np.ndarray, x: np.ndarray, g: np.ndarray) -> None:
    """g_b -= (J moment) x x_b, of vectors (b, c)."""
    turn = np.zeros(3)
    for i in range(3):
        for k in range(3):
            turn[i] += J[i, k] * moment[k]
    for b in range(len(x)):
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            g[b, k] -= turn[i] * x[b, j] - turn[j] * x[b, i]


@jit
def add_damping(P: Any, x: np.ndarray, J: np.ndarray, rates: np.ndarray, g: np.ndarray) -> None:
    """g (b, c) += D P y' of rates y' (b, c) in the axes of the body, which become P y'."""
    moment = np.zeros(3)
    # of a steady translation rates are the same everywhere, and D takes nothing of them
    add_moment(P.moments, rates, moment)
    subtract_turned(J, moment, x, rates)
    add_sums(P.damping, view(rates, 0, (rates.size,)), view(g, 0, (g.size,)))


@jit
def add_elastic(P: Any, x: np.ndarray, d: np.ndarray, g: np.ndarray) -> None:
    """g (b, c) += K d, of d (b, c) = x - X, which is found."""
    for b in range(len(x)):
        for k in range(3):
            d[b, k] = x[b, k] - P.reference[b, k]
    add_sums(P.stiffness, view(d, 0, (d.size,)), view(g, 0, (g.size,)))


@jit
def find_elastic(
    s: Any, P: Any, R: np.ndarray, J: np.ndarray, x: np.ndarray, g: np.ndarray
) -> None:
    """R (c, c), J^-1 (c, c), x (b, c) and g (b, c) = K d in the axes of the body, in the state of a
    space.
    """
    in_body(P, view(s.cell_x, P.first, x.shape), R, x)
    inverse_inertia(P, x, J)
    clear_rows(g)
    add_elastic(P, x, view(s.work[0], 2 * x.size, x.shape), g)


@jit
def balance(P: Any, J: np.ndarray, x: np.ndarray, g: np.ndarray) -> None:
    """g (b, c) becomes f of (4)."""
    moment = np.zeros(3)
    add_moment(x, g, moment)
    subtract_turned(J, moment, P.moments, g)


@routine
def force(table: Any, record: Any) -> int:
    """Forces (4) on the coordinates of the body."""
    s = evaluation(table).space
    P = opened(record)
    size = P.reference.size
    x, f = view(s.work[0], 0, P.reference.shape), view(s.work[0], size, P.reference.shape)
    R, J = np.empty((3, 3)), np.empty((3, 3))
    find_elastic(s, P, R, J, x, f)
    if len(P.damping) > 0:
        rates = view(s.work[0], 2 * size, x.shape)
        for b in range(len(x)):
            for k in range(3):
                rates[b, k] = s.cell_v[P.first + 3 * b + k]
        turn_back(R, rates)
        add_damping(P, x, J, rates, f)
    balance(P, J, x, f)
    target = view(s.cell_f, P.first, f.shape)
    for b in range(len(f)):
        for k in range(3):
            target[b, k] += R[k, 0] * f[b, 0] + R[k, 1] * f[b, 1] + R[k, 2] * f[b, 2]
    if P.kept >= 0:
        # half way to those of the accepted state a step finds its heat
        for i in range(size):
            s.gradients[NOW, P.kept + i] = s.cell_x[P.first + i]
            s.gradients[NOW, P.kept + size + i] = s.cell_v[P.first + i]
    return 0


@routine
def tangent(table: Any, record: Any) -> int:
    """Tangent (5), the lower triangle row by row, put where it belongs, and P^T D P times gh: that
    the axes of D turn is left out, as of all damping.
    """
    s = evaluation(table).space
    P = opened(record)
    size = P.reference.size
    x, f = view(s.work[0], 0, P.reference.shape), view(s.work[0], size, P.reference.shape)
    R, J = np.empty((3, 3)), np.empty((3, 3))
    find_elastic(s, P, R, J, x, f)
    balance(P, J, x, f)
    gamma, V = view(s.work[1], 0, (size, 3)), view(s.work[1], 3 * size, (size, 3))
    find_low_rank(s, P, J, x, f, gamma, V)
    block, half = np.empty((3, 3)), np.empty((3, 3))
    entries = s.work[2]
    for b in range(len(f)):
        for d in range(b + 1):
            for i in range(3):
                for j in range(3):
                    p, q = 3 * b + i, 3 * d + j
                    total = stiffness(s, P, p, q)
                    for k in range(3):
                        total += V[p, k] * gamma[q, k] + gamma[p, k] * V[q, k]
                    block[i, j] = total
            for i in range(3):
                for j in range(3):
                    half[i, j] = 0.0
                    for k in range(3):
                        half[i, j] += R[i, k] * block[k, j]
            for i in range(3):
                row = 3 * b + i
                at = row * (row + 1) // 2 + 3 * d
                for j in range(3):
                    if 3 * d + j <= row:
                        entries[at + j] = (
                            half[i, 0] * R[j, 0] + half[i, 1] * R[j, 1] + half[i, 2] * R[j, 2]
                        )
    put(P.targets, entries, s.entries)
    return 0


@jit
def stiffness(s: Any, P: Any, p: int, q: int) -> float:
    """An entry of K + gh D."""
    if len(P.damping) > 0:
        return P.stiffness[p, q] + s.gh[0] * P.damping[p, q]
    return P.stiffness[p, q]


@jit
def find_low_rank(
    s: Any,
    P: Any,
    J: np.ndarray,
    x: np.ndarray,
    f: np.ndarray,
    gamma: np.ndarray,
    V: np.ndarray,
) -> None:
    """Gamma and V (b c, c) of the tangent K + V Gamma^T + Gamma V^T of (5), with X dphi = dphi x x.

    V = - K X - F^T + Gamma (X^T K X + N) / 2,    F y = sum_b y_b x f_b,    N = sym(sum x f^T) - (sum x . f) 1
    """
    size = f.size
    X, KX = view(s.work[1], 6 * size, (size, 3)), view(s.work[1], 9 * size, (size, 3))
    N = np.zeros((3, 3))
    clear_rows(X)
    clear_rows(V)
    for b in range(len(f)):
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            for g in range(3):
                gamma[3 * b + k, g] = J[g, i] * P.moments[b, j] - J[g, j] * P.moments[b, i]
            X[3 * b + i, k] = -x[b, j]
            X[3 * b + j, k] = x[b, i]
            V[3 * b + i, k] = -f[b, j]
            V[3 * b + j, k] = f[b, i]
            N[k, k] -= x[b, i] * f[b, i] + x[b, j] * f[b, j]
            for g in range(3):
                if g != k:
                    N[k, g] += 0.5 * (x[b, k] * f[b, g] + x[b, g] * f[b, k])
    for p in range(size):
        for k in range(3):
            KX[p, k] = 0.0
            for q in range(size):
                KX[p, k] += stiffness(s, P, p, q) * X[q, k]
    for p in range(size):
        for i in range(3):
            for k in range(3):
                N[i, k] += X[p, i] * KX[p, k]
    for p in range(size):
        for k in range(3):
            V[p, k] -= KX[p, k]
            for g in range(3):
                V[p, k] += 0.5 * gamma[p, g] * N[g, k]


@routine
def energy(table: Any, record: Any) -> int:
    """Energy (1)."""
    s = evaluation(table).space
    P = opened(record)
    size = P.reference.size
    x, g = view(s.work[0], 0, P.reference.shape), view(s.work[0], size, P.reference.shape)
    d = view(s.work[0], 2 * size, P.reference.shape)
    in_body(P, view(s.cell_x, P.first, x.shape), np.empty((3, 3)), x)
    clear_rows(g)
    add_elastic(P, x, d, g)
    for b in range(len(x)):
        for k in range(3):
            s.energy[0] += 0.5 * d[b, k] * g[b, k]
    return 0


@routine
def dissipate(table: Any, record: Any) -> int:
    """Energy += the power of damping half way between the last evaluation and the accepted state."""
    s = evaluation(table).space
    P = opened(record)
    size = P.reference.size
    x, rates = view(s.work[0], 0, P.reference.shape), view(s.work[0], size, P.reference.shape)
    g, q = view(s.work[0], 2 * size, x.shape), view(s.work[0], 3 * size, x.shape)
    for b in range(len(x)):
        for k in range(3):
            at = P.kept + 3 * b + k
            q[b, k] = 0.5 * (s.gradients[NOW, at] + s.gradients[ACCEPTED, at])
            at += size
            rates[b, k] = 0.5 * (s.gradients[NOW, at] + s.gradients[ACCEPTED, at])
    R, J = np.empty((3, 3)), np.empty((3, 3))
    in_body(P, q, R, x)
    inverse_inertia(P, x, J)
    turn_back(R, rates)
    clear_rows(g)
    add_damping(P, x, J, rates, g)
    for b in range(len(x)):
        for k in range(3):
            s.energy[0] += rates[b, k] * g[b, k]
    return 0


ROUTINES = TermRoutines(force, tangent, energy, dissipate=dissipate)


@terms.carry.register(Corotated)
def carry(body: Corotated, name: str, lift: Affine, V: Matrix, d: np.ndarray) -> Corotated:
    """Coordinates of the body stay those of its energy; dense V become a matrix of them."""
    if body.matrix is None:
        if is_sparse(V):
            return body
        matrix = as_dense(lift.matrix[body.columns])
        return replace(
            body,
            matrix=matrix,
            offset=np.ascontiguousarray(lift.offset[body.columns]),
            columns=slice(0, len(matrix)),
        )
    return replace(body, matrix=body.matrix @ V, offset=body.offset + body.matrix @ d)


@terms.split.register(Corotated)
def split(body: Corotated, lifts: Lifts) -> list[Corotated]:
    """One piece."""
    if body.matrix is None:
        start = lifts.place(None) + body.columns.start
    else:
        start = lifts.add(body.matrix, body.offset)
    return [replace(body, columns=slice(start, start + body.reference.size))]


@terms.couplings.register(Corotated)
def couplings(body: Corotated) -> np.ndarray:
    """All coordinates of the body, (b c, 1)."""
    return np.arange(body.columns.start, body.columns.stop)[:, None]


@terms.stiffened.register(Corotated)
def stiffened(body: Corotated) -> np.ndarray:
    """Those with a stiffness: axes of rims and averages have none."""
    own = body.stiffness.diagonal()
    return couplings(body)[own > ROUND * own.max()].ravel()


@terms.unknowns.register(Corotated)
def unknowns(body: Corotated) -> slice:
    """Those of its matrix."""
    return body.columns if body.matrix is None else support(as_dense(body.matrix))


@terms.compile_term.register(Corotated)
def compile_term(body: Corotated, setting: Setting) -> Term:
    """Its numbers, with a damping in proportion to the stiffness."""
    K, C = body.stiffness, body.damping
    D = setting.beta * K if setting.beta > 0.0 else np.zeros((0, 0))
    if len(C):
        D = C + D if len(D) else C
    size = len(K)
    damped = len(D) > 0
    record = CorotatedRecord(
        first=body.columns.start,
        stiffness=np.ascontiguousarray(K),
        damping=np.ascontiguousarray(D),
        reference=np.ascontiguousarray(body.reference),
        moments=np.ascontiguousarray(body.moments),
        unit=np.ascontiguousarray(body.unit),
        weights=np.ascontiguousarray(body.weights),
        targets=setting.targets(couplings(body)),
        kept=setting.kept if damped else -1,
    )
    return Term(
        record,
        ROUTINES,
        max(size * (size + 1) // 2, 12 * size),
        damped,
        2 * size if damped else 0,
    )


@terms.functions_read.register(Corotated)
def functions_read(body: Corotated, size: int) -> csr_array:
    """All functions of the body, in one row; none where it reads the unknowns of a reduced model."""
    if body.matrix is not None:
        return csr_array((0, size), dtype=np.float32)
    first, last = body.columns.start // 3, body.columns.stop // 3
    ones = np.ones(last - first, np.float32)
    return csr_array((ones, np.arange(first, last), [0, last - first]), shape=(1, size))


def coordinates(body: Corotated, lift: Affine, x: np.ndarray) -> np.ndarray:
    """Coordinates (b c,) of a body from the unknowns (n,)."""
    if body.matrix is None:
        return np.asarray(lift(x))[body.columns]
    return np.asarray(body.matrix @ x + body.offset)


def rotations(H: np.ndarray) -> np.ndarray:
    """R (s, 3, 3) of (2), the rotations in H = sum_b q_b m_b^T (s, 3, 3)."""
    U, _, W = np.linalg.svd(H)
    U[:, :, 2] *= np.linalg.det(U @ W)[:, None]
    return np.asarray(U @ W)


def in_axes(body: Corotated, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x and d (b, c) of (1), of coordinates (b c,)."""
    q = z.reshape(-1, 3)
    x = q - np.outer(body.unit, body.weights @ q)
    x = x @ rotations((x.T @ body.moments)[None])[0]
    return x, x - body.reference
