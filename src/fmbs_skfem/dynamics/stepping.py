r"""The compiled time step: generalized-alpha for index-3 DAEs with a modified Newton iteration.

    (1 - am) a1 + am a0 = (1 - af) q1'' + af q0''
    q1  = q0 + h q0' + h^2 (1/2 - beta) a0 + h^2 beta a1,    q1' = q0' + h (1 - gamma) a0 + h gamma a1
    [ c W      Phi_q^T ] [ dq ]     [ c (M q'' + f) + Phi_q^T lambda ]
    [ Phi_q    0       ] [ dl ] = - [ Phi                            ],   W = bh M + gh C + K,   c = h^2 beta                   (3)

Here lambda is c times the physical multiplier, which makes the condition number independent of h. The predictor extrapolates q''
by the order (constant, linear, quadratic) that was best in the step before. A factorisation serves until the iteration contracts
slowly. The iteration stops on the estimated remaining error |dq| rate / (1 - rate) with the rate measured in the same step: a good
predictor makes the first correction small without making q'' accurate, so there are at least two.

Sources: Arnold and Bruels, Multibody Syst. Dyn. 18 (2007) 185-202, doi 10.1007/s11044-007-9084-0 (method);
Bottasso, Bauchau and Cardona, SIAM J. Sci. Comput. 29 (2007) 397-414, doi 10.1137/050638503 (scaling).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core import lapack
from ..core.jit import jit
from ..systems import kernels
from ..systems.kernels import Arrays

DONE, NOT_CONVERGED, DIVERGED, NOT_FINITE, SINGULAR = range(5)
STEPS, ITERATIONS, FACTORISATIONS, HALVED = range(4)  #: counters
FLOOR = 1e-4  #: a correction below this part of the tolerance needs no second one
HISTORY = 3  #: accelerations kept for the predictor


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
    tolerance: float  #: on the remaining error of q, absolute
    iterations: int
    slow: float  #: contraction above which the matrix is factored anew for the next step


class State(NamedTuple):
    """Motion at one instant; arrays are updated in place."""

    x: np.ndarray
    v: np.ndarray
    a: np.ndarray  #: algorithmic acceleration
    acceleration: np.ndarray  #: q''
    multipliers: np.ndarray  #: c times the physical ones
    history: np.ndarray  #: (3, n) earlier q'', latest first
    known: np.ndarray  #: (1,) number of valid rows of history
    order: np.ndarray  #: (1,) order of the predictor


class Work(NamedTuple):
    """Preallocated space of the iteration."""

    addresses: np.ndarray
    W: np.ndarray  #: lower band (n, d+1) or dense (n, n)
    kkt: np.ndarray  #: (n + m, n + m) for dense systems
    general: np.ndarray  #: general band, used where W is indefinite
    pivots: np.ndarray
    schur: np.ndarray
    schur_pivots: np.ndarray
    spread: np.ndarray  #: (m, n) W^-1 Phi_q^T
    J: np.ndarray  #: (m, n)
    Jy: np.ndarray  #: (m, j)
    rhs: np.ndarray  #: (1, n + m)
    y: np.ndarray
    g: np.ndarray
    H: np.ndarray
    body: np.ndarray
    work: np.ndarray
    x: np.ndarray
    v: np.ndarray
    acceleration: np.ndarray
    multipliers: np.ndarray
    kind: np.ndarray  #: (1,) 0 no factors, 1 Cholesky band, 2 general band, 3 dense


@jit
def residual(A: Arrays, w: Work, c: float, signals: np.ndarray) -> None:
    """rhs = (c (M q'' + f) + Phi_q^T lambda, Phi) at the trial state of `w`."""
    n = len(w.x)
    R = w.rhs[0, :n]
    kernels.clear(R)
    kernels.add_elastic_force(A, w.x, w.v, w.body, w.work, R)
    kernels.add_diagonals(A.mass, w.acceleration, R)
    kernels.add_diagonals(A.damping, w.v, R)
    kernels.add_diagonals(A.stiffness, w.x, R)
    for i in range(n):
        R[i] = c * (R[i] - A.load[i])
    if len(w.y) > 0:
        kernels.affine(A.probes, A.probes_offset, w.x, w.y)
        kernels.clear(w.g)
        kernels.add_loads(A, w.y, signals, w.g)
        kernels.constrain(A, w.y, signals, w.rhs[0, n:], w.Jy)
        for j in range(len(w.y)):
            total = -c * w.g[j]
            for m in range(len(w.multipliers)):
                total += w.Jy[m, j] * w.multipliers[m]
            w.g[j] = total
        kernels.add_transposed(A.probes, 1.0, w.g, R)


@jit
def constraint_rows(A: Arrays, w: Work) -> None:
    """J = Phi_y P, (m, n)."""
    kernels.clear(w.J.reshape(-1))
    for m in range(len(w.multipliers)):
        kernels.add_transposed(A.probes, 1.0, w.Jy[m], w.J[m])


@jit
def factorise(A: Arrays, w: Work, method: Method, signals: np.ndarray) -> int:
    """Iteration matrix at the trial state of `w`; its probe rows y and Phi_y must be current. 0, or LAPACK's info."""
    n, m = len(w.x), len(w.multipliers)
    constraint_rows(A, w)
    kernels.clear(w.H)
    kernels.load_slopes(A, w.y, signals, -method.c, w.H)
    kernels.constraint_slopes(A, signals, w.multipliers, w.H)
    iteration_matrix(A, w, method)
    if A.dense:
        return factorise_dense(A, w, n, m)
    w.kind[0] = 1
    if lapack.pbtrf(w.addresses, w.W) != 0:
        w.kind[0] = 2
        iteration_matrix(A, w, method)
        mirror_band(w.W, w.general)
        width = w.W.shape[1] - 1
        info = lapack.gbtrf(w.addresses, w.general, width, width, w.pivots)
        if info != 0:
            return info
    if m == 0:
        return 0
    for k in range(m):
        for i in range(n):
            w.spread[k, i] = w.J[k, i]
    solve_band(w, w.spread)
    for k in range(m):
        for l in range(m):
            w.schur[k, l] = 0.0
            for i in range(n):
                w.schur[k, l] += w.spread[k, i] * w.J[l, i]
    return lapack.getrf(w.addresses, w.schur, w.schur_pivots)


@jit
def iteration_matrix(A: Arrays, w: Work, method: Method) -> None:
    """Lower band (or all) of c W + d(Phi_q^T lambda)/dq at the trial state."""
    for i in range(w.W.shape[0]):
        for j in range(w.W.shape[1]):
            w.W[i, j] = method.bh * A.mass_band[i, j] + method.gh * A.damping_band[i, j] + A.stiffness_band[i, j]
    kernels.add_elastic_tangent(A, w.x, w.body[0], method.gh, w.work, w.W)
    for i in range(w.W.shape[0]):
        for j in range(w.W.shape[1]):
            w.W[i, j] *= method.c
    kernels.add_pairs(A, w.H, w.W)


@jit
def factorise_dense(A: Arrays, w: Work, n: int, m: int) -> int:
    """KKT matrix from the dense W."""
    for i in range(n):
        for j in range(n):
            w.kkt[i, j] = w.W[i, j]
    for k in range(m):
        for i in range(n):
            w.kkt[i, n + k] = w.kkt[n + k, i] = w.J[k, i]
        for l in range(m):
            w.kkt[n + k, n + l] = 0.0
    w.kind[0] = 3
    return lapack.getrf(w.addresses, w.kkt, w.pivots)


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
def solve_band(w: Work, rhs: np.ndarray) -> None:
    """rhs rows <- W^-1 rhs."""
    if w.kind[0] == 1:
        lapack.pbtrs(w.addresses, w.W, rhs)
    else:
        width = w.W.shape[1] - 1
        lapack.gbtrs(w.addresses, w.general, width, width, w.pivots, rhs)


@jit
def solve(w: Work) -> None:
    """rhs <- KKT^-1 rhs with the current factors."""
    n, m = len(w.x), len(w.multipliers)
    if w.kind[0] == 3:
        lapack.getrs(w.addresses, w.kkt, w.pivots, w.rhs, lapack.T)
        return
    R = w.rhs[0, :n].reshape(1, n)
    solve_band(w, R)
    if m == 0:
        return
    small = w.rhs[0, n:].reshape(1, m)
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
def predict(s: State, w: Work, method: Method) -> None:
    """Trial state from extrapolated q''."""
    order, h = min(s.order[0], s.known[0] - 1), method.h
    for i in range(len(s.x)):
        guess = extrapolated(s.history, order, i)
        a1 = ((1.0 - method.af) * guess + method.af * s.acceleration[i] - method.am * s.a[i]) / (1.0 - method.am)
        w.acceleration[i] = guess
        w.x[i] = s.x[i] + h * s.v[i] + h * h * ((0.5 - method.beta) * s.a[i] + method.beta * a1)
        w.v[i] = s.v[i] + h * ((1.0 - method.gamma) * s.a[i] + method.gamma * a1)
    for k in range(len(s.multipliers)):
        w.multipliers[k] = s.multipliers[k]


@jit
def extrapolated(history: np.ndarray, order: int, i: int) -> float:
    """Polynomial extrapolation of one component by one step."""
    if order <= 0:
        return history[0, i]
    if order == 1:
        return 2.0 * history[0, i] - history[1, i]
    return 3.0 * (history[0, i] - history[1, i]) + history[2, i]


@jit
def accept(s: State, w: Work, method: Method) -> None:
    """Take over the converged trial state and choose the predictor of the next step."""
    n = len(s.x)
    errors = np.zeros(HISTORY)
    for i in range(n):
        for order in range(s.known[0]):
            errors[order] += (extrapolated(s.history, order, i) - w.acceleration[i]) ** 2
        a1 = ((1.0 - method.af) * w.acceleration[i] + method.af * s.acceleration[i] - method.am * s.a[i]) / (1.0 - method.am)
        s.a[i] = a1
        s.x[i], s.v[i], s.acceleration[i] = w.x[i], w.v[i], w.acceleration[i]
        s.history[2, i] = s.history[1, i]
        s.history[1, i] = s.history[0, i]
        s.history[0, i] = w.acceleration[i]
    s.order[0] = 0
    for order in range(s.known[0]):
        if errors[order] < errors[s.order[0]]:
            s.order[0] = order
    if s.known[0] < HISTORY:
        s.known[0] += 1
        s.order[0] = min(s.order[0] + 1, s.known[0] - 1)
    for k in range(len(s.multipliers)):
        s.multipliers[k] = w.multipliers[k]


@jit
def correct(w: Work, method: Method) -> float:
    """One Newton correction from the residual in rhs; the norm of dq."""
    solve(w)
    square = 0.0
    for i in range(len(w.x)):
        d = w.rhs[0, i]
        square += d * d
        w.x[i] -= d
        w.v[i] -= method.gh * d
        w.acceleration[i] -= method.bh * d
    for k in range(len(w.multipliers)):
        w.multipliers[k] -= w.rhs[0, len(w.x) + k]
    return np.sqrt(square)


@jit
def step(A: Arrays, s: State, w: Work, method: Method, signals: np.ndarray, counters: np.ndarray) -> int:
    """Advance `s` by one step; on failure `s` is untouched."""
    predict(s, w, method)
    fresh, last, rate = False, 0.0, 1.0
    for iteration in range(method.iterations):
        residual(A, w, method.c, signals)
        if w.kind[0] == 0:
            counters[FACTORISATIONS] += 1
            if factorise(A, w, method, signals) != 0:
                w.kind[0] = 0
                return SINGULAR
            fresh = True
        norm = correct(w, method)
        counters[ITERATIONS] += 1
        if not np.isfinite(norm):
            w.kind[0] = 0
            return NOT_FINITE
        rate = norm / last if iteration > 0 and last > 0.0 else 1.0
        if norm <= FLOOR * method.tolerance or (rate < 1.0 and norm * rate <= method.tolerance * (1.0 - rate)):
            if rate > method.slow and iteration > 0:
                w.kind[0] = 0
            accept(s, w, method)
            return DONE
        if iteration > 3 and fresh and rate > 2.0:
            w.kind[0] = 0
            return DIVERGED
        if iteration > 0 and rate > 5.0 * method.slow:
            w.kind[0], fresh = 0, False
        last = norm
    w.kind[0] = 0
    return NOT_CONVERGED


@jit
def advance(
    A: Arrays,
    s: State,
    w: Work,
    method: Method,
    signals: np.ndarray,
    every: int,
    first: int,
    out: np.ndarray,
    multipliers: np.ndarray,
    counters: np.ndarray,
) -> tuple[int, int]:
    """Take a step for every row of `signals` (s, k); store x, v, q'' in out (3, s, n) every `every` steps.

    `first` steps were done before. Returns the status and the number of steps done.
    """
    c = method.c
    for k in range(len(signals)):
        status = step(A, s, w, method, signals[k], counters)
        if status != DONE:
            return status, k
        counters[STEPS] += 1
        if (first + k + 1) % every == 0:
            row = (first + k + 1) // every
            for i in range(len(s.x)):
                out[0, row, i], out[1, row, i], out[2, row, i] = s.x[i], s.v[i], s.acceleration[i]
            for m in range(len(s.multipliers)):
                multipliers[row, m] = s.multipliers[m] / c
    return DONE, len(signals)
