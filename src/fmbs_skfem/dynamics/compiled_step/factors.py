r"""Factors of the matrix of (3) in `stepping`, and solutions with them: bands, blocks or dense ones
with a Schur complement of the joints, or all dense where W alone may be singular. Cholesky's
factors replace W, whose lower half has the form of a band.

    [ c W      Phi_q^T ]        W = bh M + gh C + K
    [ Phi_q    0       ]

Each storage has two routines, `factorise` and `apply` (W^-1 on rows); a model compiles those of its
own storage alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.algebra import direct, small
from ...core.compiling import lapack
from ...core.compiling.entries import view
from ...core.compiling.jit import jit
from ...core.compiling.structs import Routine, invoke, routine
from ...systems import evaluation, kernels
from ...systems.forces import low_rank
from ...systems.layouts import Storage
from ...systems.terms import corotation
from .step import Workspace, opened
from .woodbury import COLUMNS, JOINTS, RHS, rows_of

#: kinds of factors, L D L^T those of blocks
BAND_CHOLESKY, BAND_LU, DENSE_LU, BLOCKS, DENSE_CHOLESKY = (
    1,
    2,
    3,
    4,
    5,
)
ALL, BODIES, REST = 0, 1, 2  #: what `assemble` assembles
#: what W is made of: all tangents, exact ones or turned ones; those of starts are of exact ones, of
#: the mass alone, beside it of what touches, or of a little stiffness; those of impulses of exact
#: ones of bodies alone
EXACT, TURNED, STIFF, MASS, TOUCHING, SOFT, ELASTIC = range(7)
# the head of a clamped beam: 1e-6 to 1e-10 give the same seven digits of its acceleration
SOFTNESS = 1e-8  #: of the stiffness of the step, which holds what has no mass
# a bar damped by 5 ms that catches a mass wins 0.6 to 1.4 % of its energy so, 1.2 to 3.0 % with half
# and 0.3 to 0.6 % with twice of it, which takes 9 % more of what the catch leaves
DAMPING = 2.0  #: times that of a step, in the factors of impulses
# joints and elastic terms leave 1e-15 at most, what touches with friction between 1e-8 and 1e-4: a
# hundredth of it decides alike, and what half or twice of it lets through is as small as what the
# iteration leaves
SYMMETRIC = 1e-8  #: largest difference of entries ij and ji of W, over sqrt(W_ii W_jj), with which half of them is factored


def doors(form: Storage) -> tuple[Routine, Routine, Routine]:
    """The routines `factorise`, `solve` and `apply` of a storage."""
    if form is Storage.BLOCKS:
        # three names a storage: another one is three routines and a line here
        return factorise_blocks, solve, apply_blocks
    return (
        (factorise_dense, solve, apply_dense)
        if form is Storage.DENSE
        else (factorise_band, solve, apply_band)
    )


@routine
def assemble(table: Any, part: Any) -> int:
    """Front of the iteration matrix at the trial state, whose y and Phi_y must be current.

        c W + d(Phi_q^T lambda)/dq,    J = Phi_q

    ALL of it, or one part after the other; 0, or 1 where a tangent failed. What terms keep of an
    assembly may be turned the next time.
    """
    # by address: all kinds of factors begin so, and those of beams took 8.9 s to compile with it in
    # each of them, 7.6 s without
    if part != REST and assemble_bodies(table) != 0:
        return 1
    if part != BODIES:
        add_joints(table)
    return 0


@jit
def gather_joints(table: Any, J: np.ndarray) -> None:
    """J (m, n) = Phi_q at the trial state."""
    S = opened(table)
    # J is made with the factors alone: between them the iteration reads Phi_y on the probe rows
    kernels.clear_rows(J)
    for m in range(len(J)):
        kernels.add_transposed(S.arrays.probes, 1.0, S.space.Jy[m], J[m])


@jit
def assemble_bodies(table: Any) -> int:
    """J, and c W of bodies and constant matrices alone; 0, or 1 where a tangent failed."""
    S = opened(table)
    A, s, w = S.arrays, S.space, S.work
    gather_joints(table, w.J)
    s.c[0], s.gh[0] = S.method.c, S.method.gh
    if w.kind[1] == ELASTIC:
        s.gh[0] *= DAMPING
    # one pass that writes W, so that it need not be cleared first
    combine(S.method.bh, A.mass.store, s.gh[0], A.damping.store, A.stiffness.store, s.W)
    if w.kind[1] > STIFF:
        return assemble_start(table)
    evaluation.slopes(table)
    s.turning[0] = TURNED if w.kind[1] == TURNED else EXACT
    # tangents of planar reduced bodies are turned, not assembled: with sums that take all lanes a
    # step takes 15 to 40 % less
    if w.kind[1] == TURNED and len(A.corotation.table) > 0:
        corotation.add_rotated_tangent(A.corotation, s.x, S.method.gh, s.W)
    elif evaluation.sum_tangents(table) != 0:
        return 1
    # an exact tangent is there to be turned the next time; `judge` says where that is not good
    # enough
    if len(s.turned) > 0:
        w.kind[1] = TURNED
    scale(S.method.c, s.W)
    return 0


@jit
def assemble_start(table: Any) -> int:
    """c W of a start, from a W that has all constant matrices, and H beside it; 0, or 1 where a
    tangent failed.

        W = bh M + s (gh C + K),    s = 0, SOFTNESS, or 1 with DAMPING gh

    H is that of what touches, or zero.
    """
    S = opened(table)
    s = S.space
    which = S.work.kind[1]
    if which == TOUCHING:
        evaluation.slopes(table)
    else:
        kernels.clear(s.H)
        s.low.used[0] = 0
    s.turning[0] = EXACT
    if which >= SOFT and evaluation.sum_tangents(table) != 0:
        return 1
    softness = 1.0 if which == ELASTIC else SOFTNESS if which == SOFT else 0.0
    mass = S.arrays.mass.store
    for i in range(s.W.shape[0]):
        for j in range(s.W.shape[1]):
            inertia = S.method.bh * mass[i, j]
            s.W[i, j] = S.method.c * (inertia + softness * (s.W[i, j] - inertia))
    return 0


@jit
def add_joints(table: Any) -> None:
    """Second derivatives of joints and forces onto c W of the bodies."""
    S = opened(table)
    A, s = S.arrays, S.space
    # behind the scaling: H has c in it
    kernels.add_pairs(A.pairs, A.probes, s.H, A.dense, A.blocks, s.W)
    if A.dense and len(s.low.rows) > 0:
        low_rank.add_dense(s.low, A.probes, s.W)


@jit
def combine(
    bh: float,
    mass: np.ndarray,
    gh: float,
    damping: np.ndarray,
    stiffness: np.ndarray,
    W: np.ndarray,
) -> None:
    """Front of the iteration matrix from those of its parts.

        W = bh M + gh C + K

    bh [1/s2] and gh [1/s] are the factors of derivatives by accelerations and rates.
    """
    for i in range(W.shape[0]):
        # an expression of arrays would make one of the size of W first
        for j in range(W.shape[1]):
            W[i, j] = bh * mass[i, j] + gh * damping[i, j] + stiffness[i, j]


@jit
def scale(c: float, W: np.ndarray) -> None:
    """W *= c."""
    for i in range(W.shape[0]):
        # all of W once more: terms add stiffness to it, whose factor c is that of the multipliers
        for j in range(W.shape[1]):
            W[i, j] *= c


@routine
def factorise_dense(table: Any, _: Any) -> int:
    """Factors of the matrix at the trial state; 0, or LAPACK's info. Secants of earlier factors are
    forgotten.
    """
    S = opened(table)
    S.work.secants[0] = 0
    if invoke(S.doors.assemble, table, ALL) != 0:
        return 1
    return factor_either(table)


@jit
def factor_either(table: Any) -> int:
    """Factor the W that is there, and the Schur complement of J, by Cholesky's factorisation or LU;
    0, or LAPACK's info.

    Bodies that nothing but joints couples now are factored one by one. Where Cholesky's
    factorisation of the upper half of W fails, the lower half and the diagonal are what LU starts
    from.
    """
    S = opened(table)
    w = S.work
    W = S.space.W
    # half of the numbers of LU: a plate thrown round with 75 unknowns takes 0.099 s for 0.118 s,
    # with 69 0.093 s for 0.105 s; of a start, which has one matrix, the other half counts as well:
    # beams with directors begin with 850 m/s2, which were off by 3e-6
    if not is_bordered(w) and w.kind[1] not in (STIFF, ELASTIC) and is_symmetric(W):
        for i in range(len(W)):
            w.diagonal[i] = W[i, i]
        w.kind[0] = w.kind[2] = DENSE_CHOLESKY
        if factor_dense(table) == 0:
            return 0
        for i in range(len(W)):
            # Cholesky's factorisation has overwritten the upper half alone: no second assembly
            # where W is indefinite
            W[i, i] = w.diagonal[i]
            for j in range(i):
                W[j, i] = W[i, j]
    w.kind[0] = w.kind[2] = DENSE_LU
    return factor_dense(table)


@jit
def factor_dense(table: Any) -> int:
    """Factor W by `kind`, block by block, and the Schur complement of J, or both in one; 0, or
    LAPACK's info.
    """
    S = opened(table)
    W = S.space.W
    w = S.work
    if is_bordered(w):
        # W alone may be singular, where joints alone determine some unknowns
        bordered(W, w.J, S.space.off, w.kkt)
        return factor_lu(w, 0, 0, len(w.kkt))
    n = len(W)
    first = 0
    at = 0
    info = 0
    while first < n and info == 0:
        # blocks are found anew with each W: of two bodies half of the numbers are zero until they
        # touch
        last = w.ends[first] = end_of_block(W, first)
        if w.kind[2] == DENSE_CHOLESKY:
            info = factor_cholesky(w, lower_half(W, first, last))
        else:
            K = view(w.kkt, at, (last - first, last - first))
            for i in range(first, last):
                for j in range(first, last):
                    # by columns, as LAPACK and `substitute_dense` read it
                    K[j - first, i - first] = W[i, j]
            info = factor_lu(w, at, first, last)
        first, at = last, at + (last - first) ** 2
    return info if info != 0 else close_factors(table)


@jit
def is_symmetric(W: np.ndarray) -> bool:
    """Whether W is symmetric but for round-off."""
    for i in range(len(W)):
        for j in range(i):
            # squares save a root an entry; n^2 / 2 of them are little beside the n^3 / 3 operations
            # of factors
            difference = W[i, j] - W[j, i]
            if difference * difference > SYMMETRIC * SYMMETRIC * W[i, i] * W[j, j]:
                return False
    return True


@jit
def lower_half(W: np.ndarray, first: int, last: int) -> np.ndarray:
    """The lower half of a diagonal block of a symmetric W, as a band of all diagonals.

        B[j, i - j] = W[i, j]

    i >= j.
    """
    # rows of n + 1 numbers begin one place further in each: no copy, and the substitution of bands
    # serves it
    return view(W, first * (len(W) + 1), (last - first, len(W) + 1))


@jit
def is_bordered(w: Workspace) -> bool:
    """Whether dense factors are those of W and the joints in one."""
    # told by a size, which `initial.workspace` sets: no flag beside it that could say something
    # else
    return len(w.schur) < len(w.J)


@jit
def end_of_block(W: np.ndarray, first: int) -> int:
    """Where the unknowns end that those from `first` on are coupled with, in a pattern that is
    symmetric.
    """
    last = first + 1
    i = first
    while i < last:
        j = len(W) - 1
        # from the right, so that coupled unknowns end the search at once; a full W costs n reads
        while j >= last and W[i, j] == 0.0:
            j -= 1
        last = max(last, j + 1)
        i = i + 1
    return last


@jit
def factor_cholesky(w: Workspace, band: np.ndarray) -> int:
    """Cholesky's factor of a dense block in place, its diagonal inverted; 0, or LAPACK's info."""
    # a substitution of one's own below: calls for one vector cost more than the work in them
    if len(band) <= small.LARGEST:
        info = small.potrf(w.addresses, band)
    else:
        info = lapack.potrf(w.addresses, band)
    invert_pivots(band)
    return info


@jit
def factor_narrow(w: Workspace, band: np.ndarray) -> int:
    """The same of a band."""
    info = lapack.pbtrf(w.addresses, band)
    invert_pivots(band)
    return info


@jit
def invert_pivots(band: np.ndarray) -> None:
    """Divisions once a factorisation, products in every solution."""
    for i in range(len(band)):
        band[i, 0] = 1.0 / band[i, 0]


@jit
def factor_lu(w: Workspace, at: int, first: int, last: int) -> int:
    """Factors of a block at a place of `kkt`, the diagonal of U inverted; 0, or LAPACK's info."""
    K = view(w.kkt, at, (last - first, last - first))
    info = factor_general(w, K, w.pivots[first:last])
    for i in range(len(K)):
        # as above: divisions once, products in every solution
        K[i, i] = 1.0 / K[i, i]
    return info


@jit
def factor_general(w: Workspace, K: np.ndarray, pivots: np.ndarray) -> int:
    """Factors of a dense matrix by columns in place; 0, or LAPACK's info."""
    if len(K) <= small.LARGEST:
        return small.getrf(w.addresses, K, pivots)
    return lapack.getrf(w.addresses, K, pivots)


@routine
def solve(table: Any, joints: Any) -> int:
    """Solve with the current factors of the whole matrix.

        rhs <- KKT^-1 rhs

    With `joints` = 1 the front of rhs is zero.
    """
    S = opened(table)
    w = S.work
    rhs = S.space.rhs
    if is_bordered(w):
        substitute_dense(w.kkt, w.pivots, rhs[0])
        return 0
    if joints == 0:
        # W^-1 0 = 0: one of the two applications of a solution is left out where velocities settle
        apply_factors(table, RHS)
    if len(w.J) > 0:
        close(w, rhs)
    return 0


@jit
def apply_factors(table: Any, which: int) -> None:
    """Solve with the factors of W, and what it has of low rank beside them.

        RHS or JOINTS <- W^-1 of them

    `which` says which of both.
    """
    doors = opened(table).doors
    invoke(doors.apply, table, which)
    # only models with beams or plates that may touch have these routines
    if doors.fill != 0:
        invoke(doors.correct, table, which)


@routine
def apply_dense(table: Any, which: Any) -> int:
    """Rows <- W^-1 rows with the factors of all dense blocks."""
    S = opened(table)
    W = S.space.W
    w = S.work
    rows = rows_of(table, which)
    for k in range(len(rows)):
        # row by row, all blocks of one: a row stays in the cache, and blocks are few
        x = rows[k]
        first = 0
        at = 0
        while first < len(x):
            last = w.ends[first]
            if w.kind[2] == DENSE_CHOLESKY:
                substitute(lower_half(W, first, last), x[first:last])
            else:
                substitute_dense(
                    view(w.kkt, at, (last - first, last - first)),
                    w.pivots[first:last],
                    x[first:last],
                )
            first, at = last, at + (last - first) ** 2
    return 0


@jit
def bordered(W: np.ndarray, J: np.ndarray, off: np.ndarray, kkt: np.ndarray) -> None:
    """The matrix of a dense front with the rows of joints, transposed as LAPACK counts along
    columns.

        kkt = [[W, J^T], [J, 1 in rows that are off]]^T

    W (n, n), J (m, n), off (m,).
    """
    n, m = len(W), len(J)
    for i in range(n):
        for j in range(n):
            kkt[j, i] = W[i, j]
    for k in range(m):
        for i in range(n):
            kkt[i, n + k] = kkt[n + k, i] = J[k, i]
        for l in range(m):
            kkt[n + k, n + l] = 0.0
        kkt[n + k, n + k] = off[k]


@jit
def substitute_dense(LU: np.ndarray, pivots: np.ndarray, x: np.ndarray) -> None:
    """Solve with factors by columns, the diagonal of U inverted; faster than LAPACK's getrs for one
    vector.

        x <- K^-1 x,    P K = L U

    Four columns at a time, as `small.substitute_forward`.
    """
    n = len(x)
    full = n // 4 * 4
    small.substitute_forward(LU, pivots, n, x)
    for j in range(n - 1, full - 1, -1):
        x[j] *= LU[j, j]
        for i in range(j):
            x[i] -= LU[j, i] * x[j]
    for j in range(full - 4, -1, -4):
        A, B, C, D = LU[j], LU[j + 1], LU[j + 2], LU[j + 3]
        d = x[j + 3] * D[j + 3]
        c = (x[j + 2] - D[j + 2] * d) * C[j + 2]
        b = (x[j + 1] - D[j + 1] * d - C[j + 1] * c) * B[j + 1]
        a = (x[j] - D[j] * d - C[j] * c - B[j] * b) * A[j]
        x[j], x[j + 1], x[j + 2], x[j + 3] = a, b, c, d
        rest = x[:j]
        for i in range(j):
            rest[i] -= A[i] * a + B[i] * b + C[i] * c + D[i] * d


@routine
def factorise_band(table: Any, _: Any) -> int:
    """As `factorise_dense`. Where Cholesky's factorisation of the band fails, it is set up again
    for LU, which friction needs.
    """
    S = opened(table)
    kind = BAND_CHOLESKY
    info = 1
    while info != 0 and kind <= BAND_LU:
        if invoke(S.doors.assemble, table, ALL) != 0:
            return 1
        # open contacts leave W symmetric: LU and its skew part are for what touches with friction
        if S.arrays.pairs.skew and kernels.any_of(S.space.H):
            kind = BAND_LU
        S.work.kind[0] = S.work.kind[2] = kind
        # LAPACK overwrites the band, so that LU begins with a new assembly; it is rare, and a copy
        # of every band would not be
        info = factor_band(table)
        kind = kind + 1
    return info


@jit
def factor_band(table: Any) -> int:
    """Factor W by `kind`, and the Schur complement of J; 0, or LAPACK's info."""
    S = opened(table)
    W = S.space.W
    w = S.work
    if w.kind[2] == BAND_CHOLESKY:
        info = factor_narrow(w, W)
    else:
        width = W.shape[1] - 1
        # three times the numbers of Cholesky's band, for pivots
        mirror_band(W, w.general)
        if S.arrays.pairs.skew:
            kernels.add_skew_pairs(S.arrays.pairs, S.arrays.probes, S.space.H, w.general)
        info = lapack.gbtrf(w.addresses, w.general, width, width, w.pivots)
    return info if info != 0 else close_factors(table)


@jit
def close_factors(table: Any) -> int:
    """Factors of what joints and terms of low rank add to the factors of W; 0, or LAPACK's info.

        W^-1 U in `lows`,    W^-1 J^T in `spread`

    and the factors of 1 + V^T W^-1 U and J W^-1 J^T that follow.
    """
    S = opened(table)
    w = S.work
    # columns of low rank before joints: J^T is solved for with all of W
    if S.doors.fill != 0:
        invoke(S.doors.fill, table, 0)
        invoke(S.doors.apply, table, COLUMNS)
        info = invoke(S.doors.close, table, 0)
        if info != 0:
            return info
    if len(w.J) == 0:
        return 0
    for k in range(len(w.J)):
        # all joints in one application, so that storages may take several rows at once
        kernels.copy(w.J[k], w.spread[k])
    apply_factors(table, JOINTS)
    return factor_joints(w, S.space.off)


@jit
def factor_joints(w: Workspace, off: np.ndarray) -> int:
    """Factors of the Schur complement of joints, the diagonal of U inverted; 0, or LAPACK's info.

        J W^-1 J^T

    from the rows W^-1 J^T of `spread`.
    """
    m = len(w.J)
    for k in range(m):
        for l in range(m):
            # all entries, not half of them: friction and low rank make W unsymmetric
            w.schur[k, l] = kernels.dot(w.spread[k], w.J[l])
        # rows that are off become lambda = 0: an event changes no sizes and compiles nothing
        w.schur[k, k] -= off[k]
    info = factor_general(w, w.schur, w.schur_pivots)
    for k in range(m):
        w.schur[k, k] = 1.0 / w.schur[k, k]
    return info


@routine
def factorise_blocks(table: Any, _: Any) -> int:
    """As `factorise_dense`, for W by its upper triangle."""
    S = opened(table)
    A = S.arrays
    W = S.space.W
    w = S.work
    w.secants[0] = 0
    if invoke(S.doors.assemble, table, ALL) != 0:
        return 1
    w.kind[0] = w.kind[2] = BLOCKS
    # supernodes, four columns at a time: factors of 100 parts take 0.3 ms for 1.1 ms column by
    # column
    if (
        direct.eliminate(A.tree, A.blocks.indptr, A.blocks.indices, W[0], w.lower, w.diagonal)
        != direct.DONE
    ):
        return 1
    return close_factors(table)


@routine
def apply_blocks(table: Any, which: Any) -> int:
    """As `apply_dense`, for blocks of a sparse W, as many rows at once as there is room for."""
    S = opened(table)
    w = S.work
    rows = rows_of(table, which)
    room, n = w.columns.shape
    for first in range(0, len(rows), room):
        # many rows a visit of the factors, which are read from memory once for all of them
        some = view(rows, first * n, (min(room, len(rows) - first), n))
        direct.substitute(S.arrays.tree, w.lower, w.diagonal, some, w.columns, w.front)
    return 0


@jit
def mirror_band(low: np.ndarray, general: np.ndarray) -> None:
    """Lower band (n, d+1) as LAPACK's general band (n, 3d+1) with room for pivoting."""
    n, width = low.shape
    d = width - 1
    kernels.clear_rows(general)
    # both halves at once, as LAPACK's LU knows no symmetric band
    for j in range(n):
        for k in range(min(width, n - j)):
            general[j, 2 * d + k] = low[j, k]
            general[j + k, 2 * d - k] = low[j, k]


@routine
def apply_band(table: Any, which: Any) -> int:
    """As `apply_dense`, for a band."""
    S = opened(table)
    W = S.space.W
    w = S.work
    rows = rows_of(table, which)
    if w.kind[2] == BAND_LU:
        # LAPACK for a band with pivots: friction is rare, and rows of U are as wide again as the
        # band
        width = W.shape[1] - 1
        return lapack.gbtrs(w.addresses, w.general, width, width, w.pivots, rows)
    for k in range(len(rows)):
        substitute(W, rows[k])
    return 0


@jit
def substitute(L: np.ndarray, x: np.ndarray) -> None:
    """Solve with the Cholesky factor of a band (n, d+1), its diagonal inverted; faster than LAPACK
    for one vector.

        x <- (L L^T)^-1 x

    Four columns at a time, as `substitute_dense`: first the unknowns of a triangle, then those that
    all four reach, then the rest.
    """
    n = len(L)
    width = min(L.shape[1], len(L))
    # 10 us for 18 us at 1206 unknowns of half width 11: nothing waits for what was stored just
    # before
    full = n // 4 * 4 if width > 4 else 0
    for j in range(0, full, 4):
        A = L[j]
        B = L[j + 1]
        C = L[j + 2]
        D = L[j + 3]
        rest = x[j + 4 :]
        reach = min(width, n - j)
        a = x[j] * A[0]
        b = (x[j + 1] - A[1] * a) * B[0]
        c = (x[j + 2] - A[2] * a - B[1] * b) * C[0]
        d = (x[j + 3] - A[3] * a - B[2] * b - C[1] * c) * D[0]
        x[j], x[j + 1], x[j + 2], x[j + 3] = a, b, c, d
        A = A[4:]
        B = B[3:]
        C = C[2:]
        D = D[1:]
        for i in range(reach - 4):
            rest[i] -= A[i] * a + B[i] * b + C[i] * c + D[i] * d
        beyond = n - j - reach
        if beyond > 0:
            rest[width - 4] -= B[width - 4] * b + C[width - 4] * c + D[width - 4] * d
        if beyond > 1:
            rest[width - 3] -= C[width - 3] * c + D[width - 3] * d
        if beyond > 2:
            rest[width - 2] -= D[width - 2] * d
    for j in range(full, n):
        value = x[j] * L[j, 0]
        x[j] = value
        for i in range(1, min(width, n - j)):
            x[j + i] -= L[j, i] * value
    for j in range(n - 1, full - 1, -1):
        value = x[j]
        for i in range(min(width, n - j) - 1, 0, -1):
            value -= L[j, i] * x[j + i]
        x[j] = value * L[j, 0]
    for j in range(full - 4, -1, -4):
        A = L[j, 4:]
        B = L[j + 1, 3:]
        C = L[j + 2, 2:]
        D = L[j + 3, 1:]
        rest = x[j + 4 :]
        reach = min(width, n - j)
        a, b, c, d = x[j], x[j + 1], x[j + 2], x[j + 3]
        beyond = n - j - reach
        if beyond > 2:
            d -= D[width - 2] * rest[width - 2]
        if beyond > 1:
            c -= C[width - 3] * rest[width - 3]
            d -= D[width - 3] * rest[width - 3]
        if beyond > 0:
            b -= B[width - 4] * rest[width - 4]
            c -= C[width - 4] * rest[width - 4]
            d -= D[width - 4] * rest[width - 4]
        # sums of four columns at once, as four independent chains of additions
        for i in range(reach - 5, -1, -1):
            value = rest[i]
            a -= A[i] * value
            b -= B[i] * value
            c -= C[i] * value
            d -= D[i] * value
        A, B, C, D = L[j], L[j + 1], L[j + 2], L[j + 3]
        d *= D[0]
        c = (c - C[1] * d) * C[0]
        b = (b - B[1] * c - B[2] * d) * B[0]
        a = (a - A[1] * b - A[2] * c - A[3] * d) * A[0]
        x[j], x[j + 1], x[j + 2], x[j + 3] = a, b, c, d


@jit
def close(w: Workspace, rhs: np.ndarray) -> None:
    """Solve with the Schur complement of joints.

        rhs <- KKT^-1 (r, g)    from    rhs = (W^-1 r, g)

    that is, once W is solved with.
    """
    m, n = w.J.shape
    front, multipliers = rhs[0, :n], rhs[0, n:]
    for k in range(m):
        # J^T W^-1 is kept: closing costs m products of length n twice, no further application of
        # W^-1
        multipliers[k] = kernels.dot(w.J[k], front) - multipliers[k]
    substitute_dense(w.schur, w.schur_pivots, multipliers)
    for k in range(m):
        for i in range(n):
            front[i] -= w.spread[k, i] * multipliers[k]
