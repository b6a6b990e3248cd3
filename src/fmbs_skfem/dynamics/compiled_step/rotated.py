r"""Factors of full beams that rotate with the beams, point by point, between factorisations.

    W' = R W R^T,    R = diag(R_i),    R_i the rotation since W was factored: of the directors of a beam, or of the direction
                                       x_(i+1) - x_(i-1) of a cable

The energy of a beam does not change with a rotation of all of its points, nor does M = m (x) 1: W'
is the matrix of the beam that has moved as a rigid body, and nearly that of one that bends as well,
as R varies along it. Between the rotations factors contract at t h w, t the rotation since, w the
frequency of waves along the beam: 1.5 after a step of 2 ms of a double pendulum that W' contracts
by 0.07.

Points s that several beams share rotate with none of them. They are eliminated last,

    [ R W_i R^T     R V_a Q_a^T           ]      Q_a rotation of beam a at the point, K_a its share in the tangent there,
    [ sym.          N + sum Q_a K_a Q_a^T ]      N what is left of it: masses and springs

K_a follows from the rows of W, as a translation of a beam costs nothing: K_a = - sum_(j in a) K_sj.
After condensation the matrix of the shared points is N + sum_a Q_a (K_a - V_a^T W_i^-1 V_a) Q_a^T,
a few numbers that are made and factored anew in every step, as is Phi_q W'^-1 Phi_q^T.

Source (substructures with rotated condensed matrices): Nour-Omid and Rankin, Comput. Methods Appl.
Mech. Eng. 93 (1991) 353-384, doi 10.1016/0045-7825(91)90248-5.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiling import lapack
from ...core.compiling.entries import view
from ...core.compiling.jit import jit
from ...core.compiling.structs import invoke, routine
from ...systems import kernels
from . import factors
from .step import Doors, Rotations, opened
from .woodbury import JOINTS, rows_of

# four-bar of 8 cells, four sides and a joint: rotated factors serve 1.1 steps where others serve
# 0.6 (560 steps), 2.3 where they serve 0.8 (1440 steps), and pay in neither; a double pendulum with
# two sides is served three to ten times as long, and gains at twice
#: times as long that rotated factors have to serve as others do, and for each side and joint
WORTH, EACH = (
    2.0,
    0.2,
)
# an arm that is regulated: 7 steps at h = T / 4000, where rotated factors save 0.07 factorisations
# a step and cost 0.6 corrections
LONG = 4.0  #: steps that factors serve on their own where nothing is left to gain
#: steps that rotated ones are believed to serve before there were any: they are made first
FIRST = 8.0
NEWEST = 0.5  #: weight of the newest factors in the mean
TRIAL = 16  #: factorisations after which the other kind is tried once
BACK = -0.9  #: cosine of a rotation beyond which directions say nothing about its axis


def behind(doors: Doors) -> Doors:
    """Doors of a storage with rotations in front of its own factors."""
    mine = {"factorise": factorise.address, "apply": apply.address, "follow": follow.address}
    return doors._replace(**mine, whole=doors.factorise, inside=doors.apply)


@routine
def factorise(table: Any, _: Any) -> int:
    """Factors at the trial state; 0, or LAPACK's info.

    Those of W as a whole where W is indefinite or unsymmetric, and where rotated ones do not serve
    for longer.
    """
    S = opened(table)
    w, R = S.work, S.rotations
    if not choose(R, len(w.J), w.kind[2], w.kind[3]):
        R.on[0] = 0
        return int(invoke(S.doors.whole, table, 0))
    w.secants[0] = 0
    if invoke(S.doors.assemble, table, factors.BODIES) != 0:
        return 1
    find_shares(table)
    invoke(S.doors.assemble, table, factors.REST)
    # the band has the symmetric part of W alone; an arm whose regulator makes W unsymmetric divides
    # steps with it
    if S.arrays.dense and not factors.is_symmetric(S.space.W):
        R.on[0], R.lives[1] = 0, 0.0
        return int(invoke(S.doors.whole, table, 0))
    isolate(table)
    R.on[0] = 1
    if factor_inside(table) != 0:
        R.on[0], R.lives[1] = 0, 0.0
        return invoke(S.doors.whole, table, 0)
    w.kind[0] = w.kind[2] = factors.DENSE_CHOLESKY if S.arrays.dense else factors.BAND_CHOLESKY
    condense(table)
    for k in range(len(R.ends)):
        place_axes(R, S.space.cell_x, k, R.start[k])
    return rotate(table)


@jit
def forget(table: Any) -> None:
    """Forget how long factors have served: what follows has none, and does not depend on what was
    tried before.
    """
    S = opened(table)
    S.work.kind[0] = S.work.kind[2] = S.work.kind[3] = 0
    S.rotations.lives[0], S.rotations.lives[1], S.rotations.on[:] = 1.0, FIRST, 0


@jit
def choose(R: Rotations, joints: int, kind: int, age: int) -> bool:
    """Whether the next factors rotate, after some of a kind (0 for none) that have served for `age`
    steps.
    """
    if kind != 0:
        R.lives[R.on[0]] += NEWEST * (age - R.lives[R.on[0]])
    R.on[1] += 1
    better = (
        R.lives[0] < LONG and R.lives[1] >= (WORTH + EACH * (joints + len(R.sides))) * R.lives[0]
    )
    return better != (R.on[1] % TRIAL == 0)


@routine
def follow(table: Any, _: Any) -> int:
    """Rotate the factors into the trial state, whose Phi_y must be current; new ones are due where
    this fails.
    """
    S = opened(table)
    if S.rotations.on[0] == 0:
        return 0
    factors.gather_joints(table, S.work.J)
    if rotate(table) != 0:
        S.work.kind[0] = 0
    return 0


@jit
def rotate(table: Any) -> int:
    """Rotations R_i and Q_a, factors of the shared points, and of the joints; 0, or 1 where there
    are none.
    """
    S = opened(table)
    w, R = S.work, S.rotations
    dim = R.groups.shape[1]
    room = np.empty(9)
    for k in range(len(R.ends)):
        place_axes(R, S.space.cell_x, k, room)
        if R.ends[k, 2] >= 0:
            turn_axes(R.start[k], room, R.turns[k])
        elif place_rotation(R.start[k, :dim], room, R.turns[k]) != 0:
            return 1
    fill_border(R, dim)
    if len(R.border) > 0 and lapack.getrf(w.addresses, R.border, R.pivots) != 0:
        return 1
    for i in range(len(R.border)):
        R.border[i, i] = 1.0 / R.border[i, i]
    if len(w.J) == 0:
        return 0
    for k in range(len(w.J)):
        kernels.copy(w.J[k], w.spread[k])
    # by address: a part of this routine it would be compiled with `factorise` and with `follow`,
    # too
    invoke(S.doors.apply, table, JOINTS)
    return factors.factor_joints(w, S.space.off)


@jit
def fill_border(R: Rotations, dim: int) -> None:
    """border = rest^T + sum_ab Q_a T_ab Q_b^T over all sides a, b of the same beam."""
    for i in range(len(R.rest)):
        for j in range(len(R.rest)):
            R.border[j, i] = R.rest[i, j]
    for a in range(len(R.sides)):
        for b in range(len(R.sides)):
            if R.sides[a, 1] == R.sides[b, 1]:
                add_share(R, a, b, dim)


@jit
def add_share(R: Rotations, a: int, b: int, dim: int) -> None:
    """Add the condensed tangent T_ab of a beam between its shared points to the border.

        border += Q_a T_ab Q_b^T

    `R` holds the rotations Q (a, c, c).
    """
    Q, P = R.turns[R.sides[a, 4]], R.turns[R.sides[b, 4]]
    first, second = dim * R.sides[a, 0], dim * R.sides[b, 0]
    for i in range(dim):
        for j in range(dim):
            total = 0.0
            for k in range(dim):
                for l in range(dim):
                    total += Q[dim * i + k] * R.shares[dim * a + k, dim * b + l] * P[dim * j + l]
            R.border[second + j, first + i] += total


@jit
def place_axes(R: Rotations, q: np.ndarray, k: int, axes: np.ndarray) -> None:
    """Directors of a beam at its point number k, made orthonormal, or the direction of a cable
    there, at body coordinates q.
    """
    dim = R.groups.shape[1]
    (first, second, third) = R.ends[k]
    if third < 0:
        for c in range(dim):
            axes[c] = q[first + c] - q[second + c]
        return
    # Gram and Schmidt: directors of functions are as orthonormal as the beam is little bent within
    # some cells
    a, b, c = view(axes, 0, (3,)), view(axes, 3, (3,)), view(axes, 6, (3,))
    kernels.copy(q[first : first + 3], a)
    kernels.copy(q[second : second + 3], b)
    normalise(a)
    along = kernels.dot(a, b)
    for i in range(3):
        b[i] -= along * a[i]
    normalise(b)
    c[0], c[1], c[2] = (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@jit
def normalise(a: np.ndarray) -> None:
    """a <- a / |a|."""
    length = np.sqrt(kernels.dot(a, a))
    for i in range(len(a)):
        a[i] /= length


@jit
def turn_axes(a: np.ndarray, b: np.ndarray, Q: np.ndarray) -> None:
    """Q, row by row, the rotation of three axes a (9,), one after the other, into b."""
    for i in range(3):
        for j in range(3):
            Q[3 * i + j] = b[i] * a[j] + b[3 + i] * a[3 + j] + b[6 + i] * a[6 + j]


@jit
def place_rotation(a: np.ndarray, b: np.ndarray, Q: np.ndarray) -> int:
    """Q, row by row, the least rotation of a direction a (c,) into b; 1 where there is none."""
    dim = len(a)
    lengths, cosine = 0.0, 0.0
    first, second = 0.0, 0.0
    for c in range(dim):
        first += a[c] * a[c]
        second += b[c] * b[c]
        cosine += a[c] * b[c]
    lengths = np.sqrt(first * second)
    if not lengths > 0.0 or cosine < BACK * lengths:
        return 1
    cosine /= lengths
    if dim == 2:
        sine = (a[0] * b[1] - a[1] * b[0]) / lengths
        Q[0], Q[1], Q[2], Q[3] = cosine, -sine, sine, cosine
        return 0
    # beams without torsion: what turns about their axis changes nothing
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    x, y, z, less = x / lengths, y / lengths, z / lengths, 1.0 / (1.0 + cosine)
    Q[0], Q[1], Q[2] = cosine + less * x * x, less * x * y - z, less * x * z + y
    Q[3], Q[4], Q[5] = less * x * y + z, cosine + less * y * y, less * y * z - x
    Q[6], Q[7], Q[8] = less * x * z - y, less * y * z + x, cosine + less * z * z
    return 0


@jit
def entry(W: np.ndarray, dense: bool, i: int, j: int) -> float:
    """W[i, j] of a symmetric matrix in its storage."""
    if dense:
        return float(W[i, j])
    low = min(i, j)
    off = abs(i - j)
    return float(W[low, off]) if off < W.shape[1] else 0.0


@jit
def elastic(table: Any, i: int, j: int) -> float:
    """K[i, j] of c W, which has no joints in it yet."""
    S = opened(table)
    A = S.arrays
    m = S.method
    dense = S.arrays.dense
    constant = m.bh * entry(A.mass.store, dense, i, j) + m.gh * entry(A.damping.store, dense, i, j)
    constant += entry(A.stiffness.store, dense, i, j)
    return entry(S.space.W, dense, i, j) - m.c * constant


@jit
def find_shares(table: Any) -> None:
    """The share of every beam in the tangent at the points that it shares, in `shares`, before
    joints are added to W.
    """
    S = opened(table)
    R = S.rotations
    dim = R.groups.shape[1]
    wide = S.space.W.shape[1]
    kernels.clear_rows(R.shares)
    for a in range(len(R.sides)):
        point, body = R.sides[a, 0], R.sides[a, 1]
        for i in range(dim):
            row = R.shared[point, i]
            for j in range(dim):
                total = 0.0
                for g in range(len(R.groups)):
                    # points far away are outside of the band
                    if R.owners[g] == body and abs(row - R.groups[g, j]) < wide:
                        total -= elastic(table, row, R.groups[g, j])
                for b in range(len(R.sides)):
                    if b != a and R.sides[b, 1] == body:
                        found = elastic(table, row, R.shared[R.sides[b, 0], j])
                        R.shares[dim * a + i, dim * b + j] = found
                        total -= found
                R.shares[dim * a + i, dim * a + j] = total


@jit
def isolate(table: Any) -> None:
    """Take the rows of the shared points out of W: into `rest`, less the shares of beams, and
    `columns`; ones in their place.
    """
    S = opened(table)
    W = S.space.W
    R = S.rotations
    dense = S.arrays.dense
    n = len(S.space.x)
    dim = R.groups.shape[1]
    count = dim * len(R.shared)
    for p in range(count):
        row = R.shared[p // dim, p % dim]
        for q in range(count):
            R.rest[p, q] = entry(W, dense, row, R.shared[q // dim, q % dim])
        for i in range(n):
            R.columns[p, i] = entry(W, dense, row, i)
    subtract_shares(R, dim)
    for p in range(count):
        row = R.shared[p // dim, p % dim]
        for i in range(n):
            if dense:
                W[row, i] = W[i, row] = 1.0 if i == row else 0.0
            elif abs(i - row) < W.shape[1]:
                W[min(i, row), abs(i - row)] = 1.0 if i == row else 0.0
        for q in range(count):
            R.columns[q, row] = 0.0


@jit
def subtract_shares(R: Rotations, dim: int) -> None:
    """rest -= the shares of all beams between their shared points."""
    for a in range(len(R.sides)):
        for b in range(len(R.sides)):
            if R.sides[a, 1] == R.sides[b, 1]:
                first, second = dim * R.sides[a, 0], dim * R.sides[b, 0]
                for i in range(dim):
                    for j in range(dim):
                        R.rest[first + i, second + j] -= R.shares[dim * a + i, dim * b + j]


@jit
def factor_inside(table: Any) -> int:
    """Cholesky's factors of W in its storage; 0, or LAPACK's info."""
    S = opened(table)
    W = S.space.W
    w = S.work
    if not S.arrays.dense:
        return factors.factor_narrow(w, W)
    first, info = 0, 0
    while first < len(W) and info == 0:
        last = w.ends[first] = factors.end_of_block(W, first)
        info = factors.factor_cholesky(w, factors.lower_half(W, first, last))
        first = last
    return info


@jit
def solve_inside(table: Any, x: np.ndarray) -> None:
    """x <- W^-1 x with these factors."""
    S = opened(table)
    W = S.space.W
    w = S.work
    first = 0
    if not S.arrays.dense:
        factors.substitute(W, x)
        return
    while first < len(x):
        last = w.ends[first]
        factors.substitute(factors.lower_half(W, first, last), x[first:last])
        first = last


@jit
def condense(table: Any) -> None:
    """What beams have inside, condensed to their shared points.

        `reach` = W^-1 V,    K_a - V_a^T W^-1 V_a

    The latter are the shares of beams.
    """
    R = opened(table).rotations
    dim = R.groups.shape[1]
    for p in range(len(R.columns)):
        kernels.copy(R.columns[p], R.reach[p])
        solve_inside(table, R.reach[p])
    for a in range(len(R.sides)):
        for b in range(len(R.sides)):
            if R.sides[a, 1] != R.sides[b, 1]:
                continue
            for i in range(dim):
                for j in range(dim):
                    V = R.columns[dim * R.sides[a, 0] + i]
                    Z = R.reach[dim * R.sides[b, 0] + j]
                    total = 0.0
                    for k in range(R.sides[a, 2], R.sides[a, 3]):
                        total += V[R.members[k]] * Z[R.members[k]]
                    R.shares[dim * a + i, dim * b + j] -= total


@routine
def apply(table: Any, which: Any) -> int:
    """Rows <- W'^-1 rows, RHS or JOINTS."""
    S = opened(table)
    if S.rotations.on[0] == 0:
        return int(invoke(S.doors.inside, table, which))
    rows = rows_of(table, which)
    for k in range(len(rows)):
        apply_row(table, rows[k])
    return 0


@jit
def apply_row(table: Any, x: np.ndarray) -> None:
    """Solve with the rotated factors: into the directions in which W was factored, the shared
    points, all others, and back.

        x <- W'^-1 x
    """
    S = opened(table)
    R = S.rotations
    dim = R.groups.shape[1]
    turn_groups(R, x, True)
    for p in range(len(R.columns)):
        row = R.shared[p // dim, p % dim]
        R.pull[p], x[row] = x[row], 0.0
    for a in range(len(R.sides)):
        first = dim * R.sides[a, 0]
        Q = R.turns[R.sides[a, 4]]
        for j in range(dim):
            Z = R.reach[first + j]
            total = 0.0
            for k in range(R.sides[a, 2], R.sides[a, 3]):
                total += Z[R.members[k]] * x[R.members[k]]
            for i in range(dim):
                R.pull[first + i] -= Q[dim * i + j] * total
    factors.substitute_dense(R.border, R.pivots, R.pull)
    solve_inside(table, x)
    for a in range(len(R.sides)):
        first = dim * R.sides[a, 0]
        Q = R.turns[R.sides[a, 4]]
        for j in range(dim):
            Z = R.reach[first + j]
            total = 0.0
            for i in range(dim):
                total += Q[dim * i + j] * R.pull[first + i]
            for k in range(R.sides[a, 2], R.sides[a, 3]):
                x[R.members[k]] -= total * Z[R.members[k]]
    for p in range(len(R.columns)):
        x[R.shared[p // dim, p % dim]] = R.pull[p]
    turn_groups(R, x, False)


@jit
def turn_groups(R: Rotations, x: np.ndarray, back: bool) -> None:
    """x <- R x, or R^T x, point by point."""
    if R.groups.shape[1] == 2:
        for g in range(len(R.groups)):
            i = R.groups[g, 0]
            j = R.groups[g, 1]
            Q = R.turns[R.turned[g]]
            sine = Q[1] if back else -Q[1]
            x[i], x[j] = Q[0] * x[i] - sine * x[j], sine * x[i] + Q[0] * x[j]
        return
    for g in range(len(R.groups)):
        i = R.groups[g, 0]
        j = R.groups[g, 1]
        k = R.groups[g, 2]
        Q = R.turns[R.turned[g]]
        # components that are no unknowns are held by a hinge, about whose axis the others rotate
        a = x[i] if i >= 0 else 0.0
        b = x[j] if j >= 0 else 0.0
        c = x[k] if k >= 0 else 0.0
        if back:
            a, b, c = (
                Q[0] * a + Q[3] * b + Q[6] * c,
                Q[1] * a + Q[4] * b + Q[7] * c,
                Q[2] * a + Q[5] * b + Q[8] * c,
            )
        else:
            a, b, c = (
                Q[0] * a + Q[1] * b + Q[2] * c,
                Q[3] * a + Q[4] * b + Q[5] * c,
                Q[6] * a + Q[7] * b + Q[8] * c,
            )
        if i >= 0:
            x[i] = a
        if j >= 0:
            x[j] = b
        if k >= 0:
            x[k] = c
