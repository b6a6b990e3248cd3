r"""Vibration modes of constrained systems, undamped and damped, about any equilibrium.

    K v = omega^2 M v  on the null space of Phi_x                                                                         (1)
    u = v exp(s t):    (s^2 M + s C + K) v = 0;     frequency |Im s|, damping ratio -Re s / |s|                             (2)

K and C of (2) need not be symmetric (follower forces, gyroscopic terms, damping in a rotating
frame), so its eigenvalues are complex, and an equilibrium is unstable where one has a positive real
part: flutter with, divergence without an imaginary one.

A structure that is loaded beyond its buckling load without imperfections keeps its straight state,
as does a pendulum that stands on its head: Newton's iteration finds such states as it finds others,
where (1) has an omega^2 < 0.

Sources: Geradin and Rixen, Mechanical Vibrations, 3rd ed., Wiley 2015, chs. 2 and 3; Fan, Lin and
Van Dooren, SIAM J. Matrix Anal. Appl. 26 (2004) 252-256, doi 10.1137/S0895479803434914 (scaling of
the quadratic eigenproblem).
"""

from __future__ import annotations

from dataclasses import field

import numpy as np
from scipy.linalg import eig, eigh, qr
from scipy.linalg.lapack import dpstrf
from scipy.sparse import csr_array
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigs, eigsh

from ...core.algebra import inertia, krylov, ranks, saddle
from ...core.algebra.linalg import Array, scaled
from ...core.errors import InputError, Reason, SolverError, say
from ...core.storage.records import dataclass
from ...core.values.arguments import checked
from ...systems import free_motions
from ...systems.system import System
from ..trajectory import Trajectory
from .linear import Linear, is_symmetric, linearise

SEEN = 1e-8  #: of the size of a matrix over that of the mass, below which eigenvalues count as zero: those of free motions are
SMALL = 400  #: independent unknowns up to which all eigenvalues are found
PAIR = 1e-6  #: sum of two real eigenvalues, over one of them, up to which they are a pair s, -s of a system without damping
ROUND = 1e-9  #: real and imaginary parts, relative to the size of an eigenvalue, that are round-off
GROWS = 1e-6  #: real part of an eigenvalue, over the largest one listed, from which a motion grows
# round-off parts the double zero of a free motion into s and -s, of the root of it: 1e-16 becomes
# 1e-8
STILL = 1e-7  #: eigenvalue over the largest frequency that the matrices allow, up to which the double zeros of free motions split
ALONE = 1e-3  #: distance of a slow shape from those before it, over its size, from which it is a motion of its own
#: sum of slow real parts, over that of their sizes, up to which they are such splits
MIRRORED = 0.1
FEW = 6  #: modes next to zero, of which one would have passed it, where a state may not stand
LARGE = 6000  #: unknowns beyond which nothing is said of that: factors of their stiffness cost as much as a load step
WIDE = 1_000_000  #: numbers of the rows of constraints beyond which nothing is said, either: they are dense
# free motions near a shift next to zero drown the digits of the others: frequencies of a fine lug
# scattered by 3e-5
LIGHT = 1e-12  #: mass of a direction in units of the masses of its unknowns, up to which it is round-off: others have 1e-6
STIFFLESS = 1e-12  #: stiffness of a direction without mass, over the largest of these, up to which it is round-off
INFINITE = 1e12  #: eigenvalue over the largest frequency of the matrices, from which it is round-off of 1/0
#: unknowns of a body without constraints from which modes are found without factors: these of a
#: solid of 530 000 unknowns have 1e9 numbers
HUGE = 200_000
FREE = 1e-9  #: force of a rigid motion that costs no energy, over the sum of the sizes of its terms
TRIES = 3  #: how often missing modes are looked for
ABOVE = 1e-6  #: distance from the last eigenvalue, over it, at which those below are counted
NEXT = 1e-9  #: shift next to zero, over the size of the matrices
LOSE = (
    1e-7  #: eigenvalue over the largest one, below which it has lost more than half of its digits
)
AWAY = 1.1  #: shift over the size of the eigenvalues wanted, by which all of them are positive
UPWARD = 1e-7  #: shift over the largest frequency that the matrices allow, so that free motions have an inverse


@dataclass(frozen=True)
class VibrationModes:
    """Vibration modes (1) about a configuration, by rising omega^2.

        K v = omega^2 M v,    v^T M v = 1

    A negative omega^2 is a motion that grows by exp(sqrt(-omega^2) t): the equilibrium is unstable.
    """

    squares: np.ndarray  #: (i,) omega^2 [1/s2], negative where the equilibrium is unstable
    shapes: np.ndarray  #: (n, i) normalised by the mass matrix

    @property
    def angular_frequencies(self) -> np.ndarray:
        """Angular frequencies (i,) [rad/s].

            omega = sqrt(max(omega^2, 0))

        0 where the equilibrium is unstable.
        """
        return np.sqrt(np.maximum(self.squares, 0.0))


@checked
def vibration_modes(
    system: System,
    count: int = 10,
    x: np.ndarray | None = None,
    multipliers: np.ndarray | None = None,
) -> VibrationModes:
    """Lowest `count` modes about x (n,), by default the reference, and multipliers (m,), with all
    constraints in linear form.

        K v = omega^2 M v    on    Phi_x v = 0

    All where there are fewer. Cables curved in space have no stiffness out of their plane in the
    reference, and are refused there. Found by Lanczos iteration on the inverse of the bordered
    matrix, shifted a little below zero so that free bodies have one; where most modes are wanted,
    by a dense solution on the null space of the constraints.

        >>> import numpy as np
        >>> from fmbs_skfem import bodies, dynamics, systems
        >>> from fmbs_skfem.shapes.meshes import segment
        >>> beam = bodies.cable("beam", segment(4), bodies.Given(1e5, 0.5, 0.1), dim=2)
        >>> clamp = systems.joints.Clamp("clamp", systems.At("beam", "left"))
        >>> found = dynamics.vibration_modes(systems.assemble([beam], [clamp]), 1)
        >>> f"{found.angular_frequencies[0]:.2f}, {1.8751**2 * np.sqrt(0.5 / 0.1):.2f} rad/s"
        '7.86, 7.86 rad/s'
    """
    if x is None:
        free_motions.refuse_limp("vibration_modes", system)
    linear = linearise(system, x, multipliers)
    if len(linear.x) >= HUGE and not len(linear.rows):
        motions = free_motions.rigid_motions(system)
        try:
            return huge_modes(linear, motions, at_most(count, len(linear.x)))
        except SolverError:  # as of several bodies, which have more motions without energy
            pass
    return real_modes(linear, count)


def huge_modes(linear: Linear, motions: np.ndarray, count: int) -> VibrationModes:
    """Lowest `count` modes of one body without constraints by conjugate gradients with multigrid, its
    rigid `motions` (n, k) among them, as far as they cost no energy.
    """
    K, M = symmetric(linear.stiffness), linear.mass
    forces = np.linalg.norm(K @ motions, axis=0)
    free = forces <= FREE * np.linalg.norm(abs(K) @ np.abs(motions), axis=0)
    rigid = motions[:, free]
    weights, Q = eigh(rigid.T @ (M @ rigid))
    rigid = rigid @ (Q / np.sqrt(weights))
    found = krylov.lowest(K, M, rigid, motions, max(count - rigid.shape[1], 1), 3)
    squares = np.append(np.zeros(rigid.shape[1]), found[0])
    vectors = np.column_stack([rigid, found[1]])
    return VibrationModes(squares[:count], vectors[:, :count])


@checked
def real_modes(linear: Linear, count: int = 10) -> VibrationModes:
    """Lowest `count` modes (1) of linear equations, their damping and what is not symmetric in
    their stiffness left out.

        (K + K^T)/2 v = omega^2 M v    on    rows v = 0

    There are as many modes as unknowns n less the rows m and directions without mass, which follow
    at rest, if `count` asks for more. InputError for a count below 1, where the joints leave no
    motion, where no motion has a mass, and where some direction has neither mass nor stiffness.
    """
    large, (K, M, J) = in_alike_units(linear)
    possible = len(linear.x) - len(J)
    count = at_most(count, possible)
    heavy = int(np.sum(abs(M).sum(axis=0) > 0.0))
    squares, vectors = (dense_modes if 3 * count + 20 > min(possible, heavy) else sparse_modes)(
        symmetric(K), M, J, count
    )
    return VibrationModes(squares, large[:, None] * vectors)


def in_alike_units(linear: Linear) -> tuple[np.ndarray, tuple[Array, Array, np.ndarray]]:
    """Units S (n,) by which positions and axes count alike, however small a body is.

        v = S y

    with S K S, S M S and unit rows of J S.
    """
    large = np.broadcast_to(linear.large, len(linear.x))
    large = large / large.max()
    K, M = (scaled(A, large, large) for A in (linear.stiffness, linear.mass))
    return large, (K, M, ranks.unit_rows(linear.rows * large))


def at_most(count: int, possible: int) -> int:
    """`count`, or the number of independent motions where there are fewer; InputError where that is
    none.
    """
    if count < 1:
        raise InputError(say("modes, count", "1 or more", count))
    if not possible:
        raise InputError(say("modes", "motions that the joints leave", "none", "release a joint"))
    return min(count, possible)


def dense_modes(K: Array, M: Array, J: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues and vectors of (K, M) on the null space of independent rows J.

        v = R y + N z,   M N = 0:      N^T K N z = - N^T K R y,     (R^T K R + R^T K N z) y = omega^2 y

    K and M (n, n), J (m, n): the `count` lowest eigenvalues (i,) [1/s2], all where there are fewer,
    rising, and vectors (n, i) with v^T M v = 1.
    """
    R, N = split_by_mass(M, J)
    if not R.shape[1]:
        raise InputError(
            say("modes", "motions that have a mass", "none", "give the bodies a density")
        )
    Z = R + N @ follow(K, R, N) if N.shape[1] else R
    stiffness, weights = Z.T @ (K @ Z), R.T @ (M @ R)
    vectors = (
        Z
        @ eigh(
            stiffness,
            None if N.shape[1] else weights,
            subset_by_index=[0, min(count, R.shape[1]) - 1],
        )[1]
    )
    squares = np.sum(vectors * (K @ vectors), axis=0)
    slow = np.abs(squares) < LOSE * np.max(stiffness.diagonal() / weights.diagonal())
    if slow.any():
        squares[slow], vectors[:, slow] = sharpen(K, M, J, vectors[:, slow], squares[slow])
    order = np.argsort(squares, kind="stable")
    return squares[order], vectors[:, order]


def sharpen(
    K: Array, M: Array, J: np.ndarray, vectors: np.ndarray, squares: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Slow motions (n, i) and their omega^2 (i,) as their inverse has them.

        1 / (omega^2 + s)  of  (K + s M)^-1 M,    s > -omega^2 of all of them

    Directors of a beam are 1e14 times as stiff as it bends: beside them slow motions lose digits
    that the inverse keeps, a clamped bar 0.4 % of its frequencies.
    """
    least = NEXT * float(abs(K).max() / abs(M).max())
    shift = max(AWAY * float(np.abs(squares).max()), least)
    inverse = saddle.constrained(K + shift * M, J)
    if inverse is None:
        return squares, vectors
    found = np.column_stack([inverse(M @ one) for one in vectors.T])
    compliance = found.T @ (M @ vectors)
    values, Q = eigh(0.5 * (compliance + compliance.T), vectors.T @ (M @ vectors))
    return 1.0 / values[::-1] - shift, vectors @ Q[:, ::-1]


def split_by_mass(M: Array, J: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bases R (n, r) and N (n, i) of the null space of independent rows J (m, n).

        M N = 0,    and R^T M R = 1 where there are such N

    Unknowns count in units of their own mass, in which that of a direction is either of the size of
    1 or round-off: directors of thin beams weigh 1e-10 of what positions do, and some nothing.
    """
    own = np.maximum(M.diagonal(), 0.0)
    none = own <= np.finfo(float).eps * own.max(initial=0.0)
    units = 1.0 / np.sqrt(np.where(none, own.max(initial=1e-300), own))
    rows = ranks.unit_rows(J * units)
    Z = units[:, None] * (qr(rows.T)[0][:, len(rows) :] if len(rows) else np.eye(len(own)))
    weights = Z.T @ (M @ Z)
    if dpstrf(weights, tol=LIGHT * np.abs(weights.diagonal()).max(initial=0.0))[2] == len(weights):
        return Z, Z[:, :0]
    found, Q = eigh(weights)
    light = found <= LIGHT * np.abs(found).max()
    return Z @ (Q[:, ~light] / np.sqrt(found[~light])), Z @ Q[:, light]


def follow(K: Array, R: np.ndarray, N: np.ndarray) -> np.ndarray:
    """z (i, r) by which directions N (n, i) without mass follow motions R (n, r) at rest.

        N^T K (R + N z) = 0

    InputError where some of them have no stiffness.
    """
    stiff = N.T @ (K @ N)
    own = np.abs(np.linalg.eigvalsh(stiff))
    if not own.min() > STIFFLESS * own.max():
        raise InputError(
            say("modes", "a mass or a stiffness in every direction", "one without both")
        )
    return np.asarray(np.linalg.solve(stiff, -(N.T @ (K @ R))))


def sparse_modes(
    K: csr_array, M: csr_array, J: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues and vectors for independent rows J, by Lanczos iteration in shift-invert mode.

        K v = omega^2 M v,    J v = 0

    Near a shift close to zero the free motions of a body drown the digits of all others: where
    there are any, the lowest other eigenvalue, negative, is the second shift.
    """
    shift = -NEXT * float(abs(K).max() / abs(M).max())
    squares, vectors = shifted_modes(K, M, J, count, shift)
    others = squares[squares > 10.0 * abs(shift)]
    if 0 < len(others) < count:
        shift = -float(others[0])
        squares, vectors = shifted_modes(K, M, J, count, shift)
    for _ in range(TRIES):
        if not (missing := count_missing(K, M, J, squares)):
            break
        more = shifted_modes(K, M, J, missing, shift, vectors)
        squares = np.append(squares, more[0])
        order = np.argsort(squares, kind="stable")
        squares, vectors = squares[order], np.hstack([vectors, more[1]])[:, order]
    return squares[:count], vectors[:, :count]


def count_missing(K: csr_array, M: csr_array, J: np.ndarray, squares: np.ndarray) -> int:
    """How many eigenvalues up to the last one of `squares` (i,) are not among them, by the negative
    pivots of K - s M just above it; 0 where nobody knows.

    Lanczos iteration finds one vector of several of one eigenvalue, and others by round-off alone:
    of the six rigid motions of a free solid four.
    """
    shifted = csr_array(K - (squares[-1] + ABOVE * max(abs(squares[-1]), abs(squares[0]))) * M)
    found = saddle.factor(saddle.matrix(shifted, J), rows=len(J))
    below = None if found is None else inertia.count_negative(shifted, J, found)
    return max(0, (below or 0) - len(squares))


def shifted_modes(
    K: csr_array,
    M: csr_array,
    J: np.ndarray,
    count: int,
    shift: float,
    known: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """The modes next to a shift below all of them; beside those `known` (n, i), if there are any."""
    n = K.shape[0]
    inverse = saddle.constrained(K - shift * M, J)
    if inverse is None:
        raise InputError(
            say("vibration_modes", "a mass or a stiffness in every direction", "one without both")
        )

    def other(f: np.ndarray) -> np.ndarray:
        u = inverse(f)
        return u if known is None else u - known @ (known.T @ (M @ u))

    start = other(M @ np.cos((1.0 if known is None else 0.7) * np.arange(n)))
    squares, vectors = eigsh(
        K,
        count,
        M=M,
        sigma=shift,
        OPinv=LinearOperator((n, n), matvec=other, dtype=float),
        v0=start,
        tol=1e-14,
    )
    order = np.argsort(squares)
    return squares[order], vectors[:, order]


@dataclass(frozen=True)
class ComplexModes:
    """Motions by (2), each of a conjugate pair once, slowest first: by |s|, rising.

        u = Re v exp(s t),    (s^2 M + s C + K) v = 0

    A motion grows where Re s > 0, and the equilibrium is unstable then: flutter with, divergence
    without an imaginary part.
    """

    eigenvalues: np.ndarray  #: (i,) s [1/s], imaginary parts not negative
    shapes: np.ndarray  #: (n, i) complex, of largest entry 1
    #: (j,) s [1/s] of motions that grow beside these
    beyond: np.ndarray = field(default_factory=lambda: np.empty(0))
    unknown: int = 0  #: faster motions of which nothing says whether they grow

    @property
    def angular_frequencies(self) -> np.ndarray:
        """Angular frequencies (i,) of the motions [rad/s].

            |Im s|

        0 where one grows or decays without a vibration.
        """
        return np.asarray(np.abs(self.eigenvalues.imag))

    @property
    def damping_ratios(self) -> np.ndarray:
        """Damping ratios (i,) of the motions.

            - Re s / |s|

        negative where a motion grows.
        """
        size = np.abs(self.eigenvalues)
        return np.asarray(
            np.divide(0.0 - self.eigenvalues.real, size, out=np.zeros(len(size)), where=size > 0.0)
        )


@checked
def complex_modes(linear: Linear, count: int = 10) -> ComplexModes:
    """The `count` slowest motions (2) of linear equations, all where there are fewer, and one more
    where that parts a pair s, -s.

        (s^2 M + s C + K) v = 0    on    rows v = 0

    What grows beside them is among those `beyond`, as far as it is found: of a small system, all of
    which is found by a dense solution on the null space of the constraints. Those of a large one
    are found by Arnoldi's iteration on the inverse, and the others are `unknown` unless none
    `can_grow`; SolverError where that does not converge.
    """
    possible = len(linear.x) - len(linear.rows)
    few = at_most(count, possible)
    whole = possible <= SMALL or 4 * few > possible
    values, shapes = (all_eigenvalues if whole else slow_eigenvalues)(linear, few)
    values = without_round_off(values)
    unknown = 0 if whole or not can_grow(linear) else possible - int(np.sum(values.imag >= 0.0))
    kept = np.flatnonzero(values.imag >= 0.0)
    kept = kept[np.argsort(np.abs(values[kept]), kind="stable")]
    kept = kept[once(values[kept], shapes[:, kept], STILL * fastest(linear))]
    kept, rest = np.split(kept, [whole_pairs(values[kept], count)])
    size = max(np.abs(values[kept]).max(initial=0.0), STILL * fastest(linear))
    return ComplexModes(
        values[kept],
        largest_one(shapes[:, kept]),
        values[rest][values[rest].real > GROWS * size],
        unknown,
    )


def can_grow(linear: Linear) -> bool:
    """Whether linear motions may grow; not where K is symmetric and positive, and the symmetric
    part D of C is not negative.

        d/dt (v'^T M v' + v^T K v) / 2 = - v'^T D v' <= 0

    then holds them (Kelvin, Tait and Chetaev; A. P. Seyranian, A. A. Mailybaev, Multiparameter
    Stability Theory with Mechanical Applications, World Scientific 2003, ch. 6). Gyroscopic terms,
    the other part of C, do no work.
    """
    D = csr_array(0.5 * (linear.damping + linear.damping.T))
    return not (is_positive(linear, linear.stiffness) and is_positive(linear, D))


def is_positive(linear: Linear, A: csr_array) -> bool:
    """Whether A (n, n) is symmetric and has no negative eigenvalue on the null space of the rows,
    beside the mass and to SEEN.
    """
    if not (size := abs(A).max()):
        return True
    shifted = csr_array(A + SEEN * size / abs(linear.mass).max() * linear.mass)
    found = saddle.factor(saddle.matrix(shifted, linear.rows), rows=len(linear.rows))
    return found is not None and inertia.count_negative(shifted, linear.rows, found) == 0


def whole_pairs(values: np.ndarray, count: int) -> int:
    """How many of eigenvalues (i,), slowest first, are listed where `count` are asked for: a real
    pair s, -s is not parted.
    """
    cut = 0 < count < len(values) and values[count - 1].imag == values[count].imag == 0.0
    return count + bool(cut and abs(values[count - 1] + values[count]) <= PAIR * abs(values[count]))


def without_round_off(values: np.ndarray) -> np.ndarray:
    """Eigenvalues (i,) on the axes of the complex plane where they are there but for round-off.

        |Re s| <= 1e-9 |s|    or    |Im s| <= 1e-9 |s|

    become zero.
    """
    real, imaginary = (
        np.where(np.abs(part) <= ROUND * np.abs(values), 0.0, part)
        for part in (values.real, values.imag)
    )
    return np.asarray(real + 1j * imaginary)


def fastest(linear: Linear) -> float:
    """A bound of the frequencies that the matrices allow, to a factor [rad/s].

        sqrt(max |K| / max |M|)

    of the largest entries.
    """
    return float(np.sqrt(abs(linear.stiffness).max() / abs(linear.mass).max()))


def once(values: np.ndarray, shapes: np.ndarray, still: float) -> np.ndarray:
    """Which motions (i,) are left when those slower than `still` [rad/s], sorted, are kept only
    where their shapes (n, i) are new.

        u = a + b t

    Such a free motion has the eigenvalue 0 twice with one shape; round-off parts it into s and -s,
    real or imaginary, where damped motions have negative real parts alone.
    """
    slow = int(np.sum(np.abs(values) <= still))
    if abs(values[:slow].real.sum()) > MIRRORED * np.abs(values[:slow]).sum():
        return np.arange(len(values))
    first = (
        ranks.independent_rows(largest_one(shapes[:, :slow]).real.T, ALONE)
        if slow
        else np.zeros(0, np.int64)
    )
    return np.append(first, np.arange(slow, len(values)))


def all_eigenvalues(linear: Linear, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (i,) and vectors (n, i) of (2) on the null space Z of the rows, by the companion
    form in the time 1/w.

        w = sqrt(|K| / |M|)

    It makes both matrices equally large, which keeps the digits of slow motions; unknowns in metres
    and slopes are counted in what is large of each.
    """
    large, (K, M, J) = in_alike_units(linear)
    R, N = split_by_mass(M, J)
    if N.shape[1]:
        V = dense_modes(symmetric(K), M, J, R.shape[1])[1]
        return eigenvalues_beside(linear, large[:, None] * N, large[:, None] * V)
    large = np.broadcast_to(linear.large, linear.x.shape)
    Z = large[:, None] * (
        ranks.null_space(linear.rows * large) if len(linear.rows) else np.eye(len(linear.x))
    )
    M, C, K = (Z.T @ (A @ Z) for A in (linear.mass, linear.damping, linear.stiffness))
    w = np.sqrt(max(float(np.linalg.norm(K)), 1e-300) / float(np.linalg.norm(M)))
    r = len(M)
    size = float(np.linalg.norm(K)) or 1.0
    A = np.block([[np.zeros((r, r)), np.eye(r)], [-K / size, -w * C / size]])
    B = np.block([[np.eye(r), np.zeros((r, r))], [np.zeros((r, r)), w * w * M / size]])
    values, vectors = eig(A, B)
    finite = np.isfinite(values)
    return w * values[finite], Z @ vectors[:r, finite]


def eigenvalues_beside(
    linear: Linear, N: np.ndarray, V: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (i,) and vectors (n, i) of (2) with u = V y + N z: modes V (n, r), V^T M V = 1,
    and directions N without mass.

        p = g y,  q = y':        p' = g q,     q' + V^T C N z' = - V^T (K u + C V q),     N^T C N z' = - N^T (K u + C V q)

    With g of the frequency of each mode slow and fast ones keep their digits. Directions that
    nothing damps follow at rest, and have the eigenvalue 1/0; others come to rest.
    """
    r = V.shape[1]
    i = N.shape[1]
    U = np.concatenate([V, N], axis=1)
    C, K = (U.T @ (A @ U) for A in (linear.damping, linear.stiffness))
    g = np.sqrt(np.abs(K.diagonal()[:r]))
    w = float(g.max())
    g = np.maximum(g, STILL * w)
    none = np.zeros((r, i))
    A = np.block([[np.zeros((r, r)), np.diag(g), none], [-K[:, :r] / g, -C[:, :r], -K[:, r:]]])
    B = np.block(
        [[np.eye(r), np.zeros((r, r + i))], [np.zeros((r + i, r)), np.eye(r + i, r), C[:, r:]]]
    )
    scale = np.concatenate([np.full(2 * r, w), np.abs(K.diagonal()[r:])])  # of the equations
    values, vectors = eig(A / scale[:, None], w * B / scale[:, None])
    finite = np.abs(values) < INFINITE
    return w * values[finite], V @ (vectors[:r, finite] / g[:, None]) + N @ vectors[2 * r :, finite]


def symmetric(A: Array) -> Array:
    """(A + A^T) / 2."""
    return 0.5 * (A + A.T)


def slow_eigenvalues(linear: Linear, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The slowest eigenvalues (i,) and vectors (n, i) of (2) by shift and inversion.

    With q = (u, u') and A q = s B q, a shift z takes (a, b) to (A - z B)^-1 (a, b):

        (K + z C + z^2 M) u = -(b + (C + z M) a),    u' = z u + a    on the rows
    """
    M = linear.mass
    C = linear.damping
    K = linear.stiffness
    J = linear.rows
    n = len(linear.x)
    z = UPWARD * fastest(linear)
    solved = saddle.constrained(K + z * C + z * z * M, J)
    if solved is None:
        raise InputError(
            say("complex_modes", "a mass or a stiffness in every direction", "one without both")
        )

    def inverse(q: np.ndarray) -> np.ndarray:
        a, b = q[:n], q[n:]
        u = solved(-(b + C @ a + z * (M @ a)))
        return np.append(u, z * u + a)

    def product(q: np.ndarray) -> np.ndarray:
        return inverse(np.append(q[:n], M @ q[n:]))

    start = product(np.append(np.cos(np.arange(n)), np.zeros(n)))
    wanted = 2 * count + 2
    try:
        inverted, vectors = eigs(
            LinearOperator((2 * n, 2 * n), matvec=product, dtype=float), wanted, v0=start, tol=1e-13
        )
    except ArpackNoConvergence as error:
        # all of them, where free motions kept the iteration from ending
        inverted, vectors = (
            error.eigenvalues,
            error.eigenvectors,
        )
        if len(inverted) == wanted:
            return z + 1.0 / inverted, vectors[:n]
        text = f"complex modes: {len(error.eigenvalues)} of {wanted} eigenvalues converged; ask for fewer modes"
        raise SolverError(text, Reason.NOT_CONVERGED, 0.0, ()) from error
    return z + 1.0 / inverted, vectors[:n]


def largest_one(shapes: np.ndarray) -> np.ndarray:
    """Shapes (n, i) with the largest entry 1.

        v / v_k,    k the entry of largest size, which may be complex

    column by column.
    """
    return np.asarray(shapes / shapes[np.abs(shapes).argmax(axis=0), np.arange(shapes.shape[1])])


def grows(omega: np.ndarray, growth: np.ndarray) -> np.ndarray:
    """Which motions (i,) bool of eigenvalues growth + i omega [1/s], both (i,) or (s, i), grow by
    more than round-off.

        growth > 1e-6 max |growth + i omega|

    of all of them.
    """
    return np.asarray(growth > GROWS * np.hypot(omega, growth).max(initial=0.0))


def instability(path: Trajectory) -> str:
    """What is said of the last state of a load path where it is unstable; nothing elsewhere, see
    `growth`.

    Of up to 6000 unknowns the text has the growth [1/s], of more the number of negative pivots of
    the tangent.
    """
    found = growth(path)
    pivots = 0.0 if path.negative is None else float(np.nan_to_num(path.negative[-1]))
    if not found and path.system.size > LARGE and pivots:
        return f"the equilibrium is unstable, its tangent has {pivots:.0f} negative pivots"
    return f"the equilibrium is unstable, a small push grows by {found:.3g} 1/s" if found else ""


def growth(path: Trajectory) -> float:
    """Largest growth s [1/s] of the last state of a load path (`solve_statics`), 0 where it is
    stable.

        s = sqrt(-omega^2)

    Nothing is said of forces without a potential, such as follower forces and friction, and of more
    than `LARGE` unknowns.
    """
    if path.system.size > LARGE or path.system.size * path.multipliers.shape[1] > WIDE:
        return 0.0
    kept = None if path.memory is None else path.memory[-1]
    linear = linearise(path.system, path.x[-1], path.multipliers[-1], float(path.times[-1]), kept)
    if len(linear.x) <= len(linear.rows) or not is_symmetric(linear):
        return 0.0
    try:
        least = float(real_modes(linear, FEW).squares.min())
    except (
        InputError,
        np.linalg.LinAlgError,
        ArpackError,
    ):  # no modes, as without a mass: the equilibrium is one all the same
        return 0.0
    return float(np.sqrt(-least)) if least < -((STILL * fastest(linear)) ** 2) else 0.0
