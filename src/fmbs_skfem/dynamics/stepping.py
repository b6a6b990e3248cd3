r"""The compiled time step: generalized-alpha for index-3 DAEs with a modified Newton iteration.

    (1 - am) a1 + am a0 = (1 - af) q1'' + af q0''
    q1  = q0 + h q0' + h^2 (1/2 - beta) a0 + h^2 beta a1,    q1' = q0' + h (1 - gamma) a0 + h gamma a1
    [ c W      Phi_q^T ] [ dq ]     [ c (M q'' + f) + Phi_q^T lambda ]
    [ Phi_q    0       ] [ dl ] = - [ Phi                            ],   W = bh M + gh C + K,   c = h^2 beta                   (3)

and then velocities that put the next q'' onto the joints,

    Phi_q (v + h (1/2 - beta) a) + D1 + h (1/2 - beta) D2 + h^2 (1/6 - beta (1 + am - af)) D3 = 0,
    D_k = d^k Phi / dt^k - Phi_q d^k q / dt^k                                                                                   (4)

at the end of the step, by v <- v - [W^-1 Phi_q^T (Phi_q W^-1 Phi_q^T)^-1] (left side). Without (4) the normal parts of v and a are
carried on by a map with the triple eigenvalue -rho_inf, which a rotation by w rad a step makes one of about -(rho_inf + 1.3 w): the
motion explodes. (4) follows from q1 = q(t + h) where v, q'' and dq''/dt satisfy the derivatives of Phi = 0: the joints'
positions then say nothing about a that is not so already. It changes v by O(h^3) in a step, so all stays of second order, and
reactions are of second order from the first step on, which begins on (4) too. See docs/stability.md.

Here lambda is c times the physical multiplier, which makes the condition number independent of h. The predictor extrapolates q''
by the order (constant, linear, quadratic) that was best in the step before. A factorisation serves until the iteration contracts
slowly. The iteration stops on the estimated remaining error |dq| rate / (1 - rate) with the rate measured in the same step: a good
predictor makes the first correction small without making q'' accurate, so there are at least two. |dq| is a root mean square
displacement (`systems.lengths`).

An error d of q is one of d / (beta h^2) in q'' and in the reactions, which grows as h falls. Beside the tolerance the remaining
error has therefore to be a small part of beta h^2 |second difference of q''|: the method's own error of q'' is of that size. Where
round-off is in the way the tolerance alone decides.

Sources: Arnold and Bruels, Multibody Syst. Dyn. 18 (2007) 185-202, doi 10.1007/s11044-007-9084-0 (method); Arnold, Bruels and
Cardona, Numer. Math. 129 (2015) 149-179, doi 10.1007/s00211-014-0633-1 (errors of velocities normal to the joints, and of starts);
Bottasso, Bauchau and Cardona, SIAM J. Sci. Comput. 29 (2007) 397-414, doi 10.1137/050638503 (scaling).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..core import lapack
from ..core.jit import jit, summing
from ..core.structs import Cube, Integers, Matrix, Shorts, Vector, invoke, opener, routine
from ..systems import corotation, evaluation, kernels
from ..systems.evaluation import Arrays, Space

DONE, NOT_CONVERGED, DIVERGED, NOT_FINITE, SINGULAR, STOPPED = range(6)
STEPS, ITERATIONS, FACTORISATIONS, HALVED = range(4)  #: counters
CHOLESKY, BAND, FULL = 1, 2, 3  #: kinds of factors: Cholesky band, general band, dense
FLOOR = 1e-4  #: a correction below this part of the tolerance needs no second one
PATIENT = 6  #: corrections after which the tolerance alone decides
CHEAP = 0.2  #: part of `slow` where tangents are turned: new factors cost little then
OLD = 0.01  #: part of (4) that old factors may leave
HISTORY = 3  #: accelerations kept for the predictor
MARGIN = 10.0  #: on a contraction that was not measured in the same step
REMEASURE = 8  #: steps after which a contraction that is relied on is measured again


class Method(NamedTuple):
    """Coefficients of one step size, and the controls of the iteration."""

    h: float
    am: float
    af: float
    gamma: float
    beta: float
    bh: float
    gh: float
    c: float
    tolerance: float  #: on the remaining error of q [m]
    iterations: int
    slow: float  #: contraction above which the matrix is factored anew for the next step
    floor: float  #: round-off of q [m]
    sharp: float  #: remaining error of q over the second difference of q'' [s2]
    trusting: bool  #: whether a contraction of steps before may be relied on


class State(NamedTuple):
    """Motion at one instant; arrays are updated in place."""

    x: Vector
    v: Vector
    a: Vector  #: algorithmic acceleration
    acceleration: Vector  #: q''
    multipliers: Vector  #: c times the physical ones
    history: Matrix  #: (3, n) earlier q'', latest first
    past: Matrix  #: (3, m) earlier multipliers, latest first
    known: Integers  #: (1,) number of valid rows of history and past
    order: Integers  #: (1,) order of the predictor
    memory: Vector  #: (l,) what forces keep of it
    change: Vector  #: (1,) size of the second difference of q'' [m/s2], infinite where it is not known


class Work(NamedTuple):
    """Factors, and preallocated space of the solver."""

    addresses: Integers
    kkt: Matrix  #: (n + m, n + m) for dense systems
    general: Matrix  #: general band, used where W is indefinite
    pivots: Shorts
    schur: Matrix
    schur_pivots: Shorts
    spread: Matrix  #: (m, n) W^-1 Phi_q^T
    J: Matrix  #: (m, n)
    paths: Matrix  #: (4, j) rows of `kernels.drift`
    pull: Vector  #: (2,) size of the last correction of the multipliers, infinite before the first; the largest mass [kg]
    rate: Vector  #: (1,) contraction, the largest of late measurements
    kind: Integers  #: (4,) kind of the factors, 0: anew; 1 while tangents are turned; kind of those there are; their age in steps


class Doors(NamedTuple):
    """Addresses of the routines that a step calls."""

    residual: int
    factorise: int  #: factors at the trial state of the space, 0 or the reason for none
    solve: int  #: rhs <- KKT^-1 rhs
    settle: int  #: the accepted velocities onto (4)


class Job(NamedTuple):
    """Steps to take, and where their results go."""

    signals: Matrix  #: (k, s) a row for every step
    rows: Integers  #: (k,) rows of the trajectory, -1 for none
    out: Cube  #: (3, s, n) x, v, q''
    multipliers: Matrix  #: (s, m) physical
    counters: Integers
    done: Integers  #: (1,) steps that were taken


class Step(NamedTuple):
    """All that the routines of a step read and write."""

    space: Space  #: the trial state and what is evaluated there
    arrays: Arrays
    doors: Doors
    state: State
    work: Work
    method: Method
    job: Job


opened = opener(Step)


@routine
def factorise(table: Any, _: Any) -> int:
    """Factors of c W + d(Phi_q^T lambda)/dq at the trial state, whose y and Phi_y must be current; 0, or LAPACK's info.

    Where Cholesky's factorisation of the band fails, the matrix is set up again for LU.
    """
    S = opened(table)
    A, s, w = S.arrays, S.space, S.work
    kernels.clear(w.J.reshape(-1))
    for m in range(len(s.multipliers)):
        kernels.add_transposed(A.probes, 1.0, s.Jy[m], w.J[m])
    s.c[0], s.gh[0] = S.method.c, S.method.gh
    evaluation.slopes(table)
    info = 1
    for kind in range(FULL if A.dense else CHOLESKY, FULL + 1 if A.dense else FULL):
        combine(S.method.bh, A.mass.store, S.method.gh, A.damping.store, A.stiffness.store, s.W)
        if w.kind[1] == 1:
            corotation.add_rotated_tangent(A.corotation, s.x, S.method.gh, s.W)
        elif evaluation.sum_tangents(table) != 0:
            return 1
        scale(S.method.c, s.W)
        kernels.add_pairs(A.pairs, s.H, A.dense, s.W)
        w.kind[0] = w.kind[2] = kind
        info = factors(table)
        if info == 0:
            break
    return info


@jit
def combine(bh: float, mass: np.ndarray, gh: float, damping: np.ndarray, stiffness: np.ndarray, W: np.ndarray) -> None:
    """W = bh M + gh C + K."""
    for i in range(W.shape[0]):
        for j in range(W.shape[1]):
            W[i, j] = bh * mass[i, j] + gh * damping[i, j] + stiffness[i, j]


@jit
def scale(c: float, W: np.ndarray) -> None:
    """W *= c."""
    for i in range(W.shape[0]):
        for j in range(W.shape[1]):
            W[i, j] *= c


@jit
def factors(table: Any) -> int:
    """Factor W and J by `kind`: band by Cholesky or LU with the Schur complement of J, or all dense; 0, or LAPACK's info."""
    S = opened(table)
    W, w = S.space.W, S.work
    n, m = len(S.space.x), len(S.space.multipliers)
    if w.kind[2] == FULL:
        bordered(W, w.J, w.kkt)
        info = lapack.getrf(w.addresses, w.kkt, w.pivots)
        for i in range(n + m):
            w.kkt[i, i] = 1.0 / w.kkt[i, i]
        return info
    if w.kind[2] == CHOLESKY:
        info = lapack.pbtrf(w.addresses, W)
        for i in range(n):
            W[i, 0] = 1.0 / W[i, 0]
    else:
        width = W.shape[1] - 1
        mirror_band(W, w.general)
        info = lapack.gbtrf(w.addresses, w.general, width, width, w.pivots)
    if info != 0 or m == 0:
        return info
    for k in range(m):
        for i in range(n):
            w.spread[k, i] = w.J[k, i]
    solve_band(table, w.spread)
    for k in range(m):
        for l in range(m):
            w.schur[k, l] = 0.0
            for i in range(n):
                w.schur[k, l] += w.spread[k, i] * w.J[l, i]
    return lapack.getrf(w.addresses, w.schur, w.schur_pivots)


@jit
def bordered(W: np.ndarray, J: np.ndarray, kkt: np.ndarray) -> None:
    """kkt = [[W, J^T], [J, 0]]^T: LAPACK counts along columns."""
    n, m = len(W), len(J)
    for i in range(n):
        for j in range(n):
            kkt[j, i] = W[i, j]
    for k in range(m):
        for i in range(n):
            kkt[i, n + k] = kkt[n + k, i] = J[k, i]
        for l in range(m):
            kkt[n + k, n + l] = 0.0


@jit
def mirror_band(low: np.ndarray, general: np.ndarray) -> None:
    """Lower band (n, d+1) as LAPACK's general band (n, 3d+1) with room for pivoting."""
    n, width = low.shape
    d = width - 1
    kernels.clear(general.reshape(-1))
    for j in range(n):
        for k in range(min(width, n - j)):
            general[j, 2 * d + k] = low[j, k]
            general[j + k, 2 * d - k] = low[j, k]


@jit
def solve_band(table: Any, rhs: np.ndarray) -> None:
    """rhs rows <- W^-1 rhs."""
    S = opened(table)
    W, w = S.space.W, S.work
    if w.kind[2] == CHOLESKY:
        for k in range(len(rhs)):
            substitute(W, rhs[k])
    else:
        width = W.shape[1] - 1
        lapack.gbtrs(w.addresses, w.general, width, width, w.pivots, rhs)


@jit
def substitute_dense(LU: np.ndarray, pivots: np.ndarray, x: np.ndarray) -> None:
    """x <- K^-1 x with the factors P K = L U by columns, the diagonal of U inverted; faster than LAPACK's getrs for one vector.

    Four columns at a time: the unknowns of a triangle first, then all that they reach.
    """
    n = len(x)
    full = n // 4 * 4
    for j in range(n):
        other = pivots[j] - 1
        x[j], x[other] = x[other], x[j]
    for j in range(0, full, 4):
        A, B, C, D = LU[j], LU[j + 1], LU[j + 2], LU[j + 3]
        a = x[j]
        b = x[j + 1] - A[j + 1] * a
        c = x[j + 2] - A[j + 2] * a - B[j + 2] * b
        d = x[j + 3] - A[j + 3] * a - B[j + 3] * b - C[j + 3] * c
        x[j + 1], x[j + 2], x[j + 3] = b, c, d
        rest, A, B, C, D = x[j + 4 :], A[j + 4 :], B[j + 4 :], C[j + 4 :], D[j + 4 :]
        for i in range(len(rest)):
            rest[i] -= A[i] * a + B[i] * b + C[i] * c + D[i] * d
    for j in range(full, n):
        for i in range(j + 1, n):
            x[i] -= LU[j, i] * x[j]
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


@jit
def substitute(L: np.ndarray, x: np.ndarray) -> None:
    """x <- (L L^T)^-1 x with the band factor (n, d+1), its diagonal inverted; faster than LAPACK's pbtrs for narrow bands.

    Four columns at a time, as `substitute_dense`: first the unknowns of a triangle, then those that all four reach, then the rest.
    """
    n, width = L.shape
    full = max(0, (n - width - 2) // 4 * 4) if width > 4 else 0
    for j in range(0, full, 4):
        A, B, C, D, rest = L[j], L[j + 1], L[j + 2], L[j + 3], x[j + 4 :]
        a = x[j] * A[0]
        b = (x[j + 1] - A[1] * a) * B[0]
        c = (x[j + 2] - A[2] * a - B[1] * b) * C[0]
        d = (x[j + 3] - A[3] * a - B[2] * b - C[1] * c) * D[0]
        x[j], x[j + 1], x[j + 2], x[j + 3] = a, b, c, d
        A, B, C, D = A[4:], B[3:], C[2:], D[1:]
        for i in range(width - 4):
            rest[i] -= A[i] * a + B[i] * b + C[i] * c + D[i] * d
        rest[width - 4] -= B[width - 4] * b + C[width - 4] * c + D[width - 4] * d
        rest[width - 3] -= C[width - 3] * c + D[width - 3] * d
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
        A, B, C, D, rest = L[j, 4:], L[j + 1, 3:], L[j + 2, 2:], L[j + 3, 1:], x[j + 4 :]
        a, b, c, d = x[j], x[j + 1], x[j + 2], x[j + 3]
        d -= D[width - 2] * rest[width - 2] + D[width - 3] * rest[width - 3] + D[width - 4] * rest[width - 4]
        c -= C[width - 3] * rest[width - 3] + C[width - 4] * rest[width - 4]
        b -= B[width - 4] * rest[width - 4]
        for i in range(width - 5, -1, -1):
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


@routine
def solve(table: Any, _: Any) -> int:
    """rhs <- KKT^-1 rhs with the current factors."""
    back_substitute(table)
    return 0


@jit
def back_substitute(table: Any) -> None:
    """As `solve`."""
    S = opened(table)
    rhs, n = S.space.rhs, len(S.space.x)
    if S.work.kind[2] == FULL:
        substitute_dense(S.work.kkt, S.work.pivots, rhs[0])
        return
    solve_band(table, rhs[0, :n].reshape(1, n))
    if len(S.space.multipliers) > 0:
        close(S.work, rhs)


@jit
def close(w: Work, rhs: np.ndarray) -> None:
    """rhs <- KKT^-1 (r, g) from rhs = (W^-1 r, g), with band factors."""
    m, n = w.J.shape
    R, small = rhs[0, :n].reshape(1, n), rhs[0, n:].reshape(1, m)
    for k in range(m):
        total = -small[0, k]
        for i in range(n):
            total += w.J[k, i] * R[0, i]
        small[0, k] = total
    lapack.getrs(w.addresses, w.schur, w.schur_pivots, small, lapack.T)
    for k in range(m):
        for i in range(n):
            R[0, i] -= w.spread[k, i] * small[0, k]


@jit
def predict(table: Any) -> None:
    """Trial state from extrapolated q'' and multipliers."""
    S = opened(table)
    s, t, method = S.state, S.space, S.method
    order, h = min(s.order[0], s.known[0] - 1), method.h
    extrapolate(s.history, order, t.acceleration)
    extrapolate(s.past, order, t.multipliers)
    S.work.pull[0] = np.inf
    for i in range(len(s.x)):
        a1 = algorithmic(method, t.acceleration[i], s.acceleration[i], s.a[i])
        t.x[i] = s.x[i] + h * s.v[i] + h * h * ((0.5 - method.beta) * s.a[i] + method.beta * a1)
        t.v[i] = s.v[i] + h * ((1.0 - method.gamma) * s.a[i] + method.gamma * a1)
    for k in range(len(s.memory)):
        t.memory[k] = s.memory[k]


@jit
def algorithmic(method: Method, new: float, old: float, a: float) -> float:
    """a1 from q1'', q0'' and a0."""
    return ((1.0 - method.af) * new + method.af * old - method.am * a) * (1.0 / (1.0 - method.am))


@jit
def extrapolate(history: np.ndarray, order: int, guess: np.ndarray) -> None:
    """Polynomial extrapolation by one step."""
    latest, before, first = history[0], history[1], history[2]
    if order <= 0:
        for i in range(len(guess)):
            guess[i] = latest[i]
    elif order == 1:
        for i in range(len(guess)):
            guess[i] = 2.0 * latest[i] - before[i]
    else:
        for i in range(len(guess)):
            guess[i] = 3.0 * (latest[i] - before[i]) + first[i]


@summing
def best_order(norm: np.ndarray, history: np.ndarray, known: int, true: np.ndarray) -> tuple[int, float]:
    """Order of the extrapolation that came closest to what is `true` now, and the size of the second difference."""
    latest, before, first = history[0], history[1], history[2]
    constant, linear, quadratic = 0.0, 0.0, 0.0
    for i in range(len(true)):
        a, b, c = latest[i] - true[i], 2.0 * latest[i] - before[i] - true[i], 3.0 * (latest[i] - before[i]) + first[i] - true[i]
        constant += norm[i] * a * a
        linear += norm[i] * b * b
        quadratic += norm[i] * c * c
    order = 1 if known > 1 and linear < constant else 0
    order = 2 if known > 2 and quadratic < min(constant, linear) else order
    return order, np.sqrt(linear) if known > 1 else np.inf


@jit
def remember(history: np.ndarray, new: np.ndarray) -> None:
    """Put the newest values before the earlier ones."""
    for i in range(len(new)):
        history[2, i], history[1, i], history[0, i] = history[1, i], history[0, i], new[i]


@jit
def accept(table: Any) -> None:
    """Take over the converged trial state and choose the predictor of the next step."""
    S = opened(table)
    s, t = S.state, S.space
    s.order[0], s.change[0] = best_order(S.arrays.norm, s.history, s.known[0], t.acceleration)
    for i in range(len(s.x)):
        s.a[i] = algorithmic(S.method, t.acceleration[i], s.acceleration[i], s.a[i])
        s.x[i], s.v[i], s.acceleration[i] = t.x[i], t.v[i], t.acceleration[i]
    remember(s.history, t.acceleration)
    remember(s.past, t.multipliers)
    if s.known[0] < HISTORY:
        s.known[0] += 1
        s.order[0] = min(s.order[0] + 1, s.known[0] - 1)
    for k in range(len(s.multipliers)):
        s.multipliers[k] = t.multipliers[k]
    evaluation.take_over(table)
    for k in range(len(s.memory)):
        s.memory[k] = t.memory[k]


@jit
def find_drift(table: Any) -> None:
    """rhs = (0, r), r what the accepted state is off (4), and a copy of r in the trial multipliers; the trial v is overwritten."""
    S = opened(table)
    s, t, method, A, paths = S.state, S.space, S.method, S.arrays, S.work.paths
    n, lead = len(s.x), method.h * (0.5 - method.beta)
    third = method.h**2 * (1.0 / 6.0 - method.beta * (1.0 + method.am - method.af))
    for i in range(n):
        t.v[i] = s.v[i] + lead * s.a[i]
    kernels.probe_paths(A.probes, A.probes_offset, s.x, t.v, s.v, s.acceleration, paths)
    kernels.clear(t.f)
    kernels.drift(A.terms, paths, t.signals, lead, third, t.rhs[0, n:])
    for k in range(len(t.multipliers)):
        t.multipliers[k] = t.rhs[0, n + k]


@routine
def drift(table: Any, _: Any) -> int:
    """As `find_drift`."""
    find_drift(table)
    return 0


@routine
def settle(table: Any, _: Any) -> int:
    """Put the accepted velocities onto (4) with the factors that are there, or with new ones of the accepted state."""
    S = opened(table)
    for attempt in range(2):
        find_drift(table)
        if S.work.kind[2] == FULL:
            substitute_dense(S.work.kkt, S.work.pivots, S.space.rhs[0])
        else:
            close(S.work, S.space.rhs)
        turn(table)
        back_substitute(table)
        if move_velocities(table) or attempt == 1:
            return 0
        restore(table)
        S.job.counters[FACTORISATIONS] += 1
        if invoke(S.doors.factorise, table, 0) != 0:
            S.work.kind[0] = 0
            return 0
    return 0


@jit
def restore(table: Any) -> None:
    """The trial state of velocities and multipliers is the accepted one."""
    S = opened(table)
    for i in range(len(S.state.x)):
        S.space.v[i] = S.state.v[i]
    for k in range(len(S.state.multipliers)):
        S.space.multipliers[k] = S.state.multipliers[k]


@jit
def turn(table: Any) -> None:
    """rhs for the direction of the joints as they are now, from (d, mu) = KKT^-1 (0, r) with the joints J0 of the factors.

    W d' + J^T mu' = 0,  J d' = r:    KKT (d', .) = (- J^T mu, r + r - J d)  up to the square of J - J0
    """
    S = opened(table)
    t, probes, y, n = S.space, S.arrays.probes, S.work.paths[0], len(S.space.x)
    kernels.clear(t.g)
    kernels.add_combination(t.Jy, t.rhs[0, n:], t.g)
    kernels.clear(y)
    kernels.add_product(probes, 1.0, t.f, y)
    for k in range(len(t.multipliers)):
        t.rhs[0, n + k] = 2.0 * t.multipliers[k]
        for j in range(len(y)):
            t.rhs[0, n + k] -= t.Jy[k, j] * y[j]
    kernels.clear(t.f)
    kernels.add_transposed(probes, -1.0, t.g, t.f)


@jit
def move_velocities(table: Any) -> bool:
    """v -= d, the front of rhs, where Phi_q d is r; else the factors are too old, as near a singular position. Whether it is.

    A change beyond v itself is left out as well: at a dead centre the joints do not determine it.
    """
    S = opened(table)
    s, t, norm = S.state, S.space, S.arrays.norm
    square, change, wanted, missed = 0.0, 0.0, 0.0, 0.0
    for i in range(len(s.x)):
        square += norm[i] * s.v[i] * s.v[i]
        change += norm[i] * t.f[i] * t.f[i]
    kernels.clear(t.g)
    kernels.add_product(S.arrays.probes, 1.0, t.f, t.g)
    for k in range(len(t.multipliers)):
        rest = t.multipliers[k]
        wanted += rest * rest
        for j in range(len(t.g)):
            rest -= t.Jy[k, j] * t.g[j]
        missed += rest * rest
    if missed > OLD * OLD * wanted:
        return False
    if change <= square:
        for i in range(len(s.x)):
            s.v[i] -= t.f[i]
    return True


@routine
def shift(table: Any, _: Any) -> int:
    """As `move_velocities`."""
    return 1 if move_velocities(table) else 0


@jit
def apply(table: Any) -> float:
    """Add the correction in rhs to the trial state; the size of dq [m].

    Factors with which the multipliers' corrections grow are discarded: near singular positions |dq| does not show it. What a
    displacement of the tolerance stands for, |dlambda| = tolerance times mass, does not count.
    """
    S = opened(table)
    t, w, method, norm = S.space, S.work, S.method, S.arrays.norm
    square, pull = 0.0, 0.0
    for i in range(len(t.x)):
        d = t.f[i]
        square += norm[i] * d * d
        t.x[i] -= d
        t.v[i] -= method.gh * d
        t.acceleration[i] -= method.bh * d
    for k in range(len(t.multipliers)):
        d = t.rhs[0, len(t.x) + k]
        pull += d * d
        t.multipliers[k] -= d
    pull = np.sqrt(pull)
    if pull > w.pull[0] and pull > method.tolerance * w.pull[1]:
        w.kind[0] = 0
    w.pull[0] = pull
    return np.sqrt(square)


@jit
def goal(method: Method, change: float, iteration: int) -> float:
    """Remaining error of q [m] at which the iteration may stop after a second difference `change` of q''."""
    if iteration >= PATIENT:
        return method.tolerance
    return max(min(method.tolerance, method.sharp * change), method.floor)


@jit
def judge(table: Any, step: int, iteration: int, norm: float, last: float, fresh: int) -> int:
    """Go on, accept or give up after a correction of size `norm`, `last` the one before; a slow iteration discards its factors.

    `fresh` counts the corrections with factors of this step, 0 where they are older: with old directions of the joints a correction
    of the multipliers leaves forces behind, however small that of q is, so the first one is not believed, unless directions are
    current and MARGIN times the contraction of steps before promises enough. Turned tangents that contract slowly when they are
    new are given up for the exact ones.
    """
    S = opened(table)
    w, method = S.work, S.method
    enough = goal(method, S.state.change[0], iteration)
    if method.trusting:
        if iteration == 1 and last > 0.0:
            w.rate[0] = max(0.9 * w.rate[0], norm / last)
        if iteration == 0 and fresh == 0 and step % REMEASURE != 0 and norm * MARGIN * w.rate[0] <= enough:
            return DONE
    rate = norm / last if iteration > 0 and last > 0.0 else 1.0
    slow = CHEAP * method.slow if w.kind[1] == 1 else method.slow
    if fresh > 1 and rate > method.slow:
        w.kind[1] = 0
    if not np.isfinite(norm):
        return NOT_FINITE
    if w.kind[0] == 0 and fresh == 0:
        return NOT_CONVERGED
    sure = iteration > 0 or fresh > 0
    if (sure and norm <= max(FLOOR * enough, method.floor)) or (rate < 1.0 and norm * rate <= enough * (1.0 - rate)):
        if rate > slow and iteration > 0:
            w.kind[0] = 0
        return DONE
    if iteration > 3 and fresh > 0 and rate > 2.0:
        return DIVERGED
    if iteration > 0 and rate > 5.0 * slow:
        w.kind[0] = 0
    return NOT_CONVERGED


@jit
def iterate(table: Any, step: int) -> int:
    """Newton's iteration from the predicted state of a step; status."""
    S = opened(table)
    w, last, fresh, brief = S.work, 0.0, 0, False
    for iteration in range(S.method.iterations):
        S.space.c[0] = S.method.c
        if invoke(S.doors.residual, table, 0) != 0:
            return STOPPED
        if w.kind[0] == 0:
            brief, w.kind[3] = iteration > 0 and w.kind[3] < 2, 0
            S.job.counters[FACTORISATIONS] += 1
            if invoke(S.doors.factorise, table, 0) != 0:
                return SINGULAR
            fresh = 1
        if invoke(S.doors.solve, table, 0) != 0:
            return STOPPED
        norm = apply(table)
        S.job.counters[ITERATIONS] += 1
        status = judge(table, step, iteration, norm, last, fresh)
        if status == DONE:
            w.kind[0], w.kind[3] = 0 if brief else w.kind[0], w.kind[3] + 1
        if status != NOT_CONVERGED:
            return status
        last, fresh = norm, fresh + 1 if fresh > 0 and w.kind[0] > 0 else 0
    return NOT_CONVERGED


@routine
def advance(table: Any, _: Any) -> int:
    """Take the steps of the job; the status, and the number of steps done in the job.

    On failure the state stays at the last good step, and the space keeps the trial state.
    """
    S = opened(table)
    job, moving = S.job, not kernels.steady(S.arrays.terms)  # on steady joints velocities are at the end of a step, too
    for k in range(len(job.signals)):
        for i in range(job.signals.shape[1]):
            S.space.signals[i] = job.signals[k, i]
        predict(table)
        status = iterate(table, k)
        if status != DONE:
            S.work.kind[:] = 0
            job.done[0] = k
            return status
        accept(table)
        if moving and invoke(S.doors.settle, table, 0) != 0:
            job.done[0] = k
            return STOPPED
        job.counters[STEPS] += 1
        if job.rows[k] >= 0:
            store(S.state, S.method.c, job.rows[k], job.out, job.multipliers)
    job.done[0] = len(job.signals)
    return DONE


@jit
def store(s: State, c: float, row: int, out: np.ndarray, multipliers: np.ndarray) -> None:
    """Row of the trajectory; multipliers become physical."""
    for i in range(len(s.x)):
        out[0, row, i], out[1, row, i], out[2, row, i] = s.x[i], s.v[i], s.acceleration[i]
    for m in range(len(s.multipliers)):
        multipliers[row, m] = s.multipliers[m] / c


def take(step: Step) -> tuple[int, int]:
    """Take the steps of a job: the status and the number of steps done."""
    return advance(step), int(step.job.done[0])
