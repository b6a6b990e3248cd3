r"""The compiled time step of `stepping` for a block of members: gathers and scatters of all members as products of matrices.

    U = Xi G^T + g,   S_b = phi(U_b; section_b),   F = S G,   rows b of the members that still iterate

The rest of the residual, the factors, the corrections and their judgement are those of `stepping`, member by member, with the
members' rows of stacked arrays.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ..bodies import laws
from ..core.entries import borrowed
from ..core.jit import inlined, jit
from ..systems import kernels, springs
from ..systems.kernels import Arrays, Forces, Groups, Operator, Pairs, Terms
from ..systems.turning import Turning
from . import stepping
from .stepping import DONE, FACTORISATIONS, ITERATIONS, NOT_CONVERGED, SINGULAR, STEPS, Method, State, Work

F = TypeVar("F", bound=Callable[..., Any])


class Members(NamedTuple):
    """What differs between the members of a block, first axis b."""

    sections: np.ndarray  #: (b, i) sections of all groups behind each other
    beta: np.ndarray  #: (b, g)
    mass: np.ndarray  #: (b, n, n)
    lumped: np.ndarray  #: (b, n) its diagonal, which is all where `Arrays.mass` is not full
    damping: np.ndarray
    stiffness: np.ndarray
    probes_offset: np.ndarray  #: (b, j)
    terms: np.ndarray
    forces: np.ndarray
    vectors: np.ndarray
    pairs: np.ndarray
    load: np.ndarray  #: (b, n)
    norm: np.ndarray  #: (b, n)
    turns: np.ndarray  #: (b, t, 2, n), (b, t, 2), (b, i) rows, offset and numbers of the turned tangents
    turns_offset: np.ndarray
    tangents: np.ndarray
    signals: np.ndarray  #: (b, s, k)
    methods: np.ndarray  #: (b, 13) fields of Method


class Room(NamedTuple):
    """Space of a block; row k of flat matrices belongs to the k-th member that still iterates."""

    u: np.ndarray  #: (b r,) jets of one group
    rate: np.ndarray
    S: np.ndarray
    x: np.ndarray  #: (b n,)
    f: np.ndarray
    force: np.ndarray  #: (b, n) elastic forces
    factors: np.ndarray  #: (b, n + m, n + m) of the members, as `stepping.substitute_dense` reads them
    P: np.ndarray  #: (j, n) probe rows
    Pt: np.ndarray  #: (n, j) the same, turned
    y: np.ndarray  #: (b j,) probe values of the members that still iterate
    active: np.ndarray  #: (b,) members that still iterate
    norms: np.ndarray  #: (b,) size of the last correction
    fresh: np.ndarray  #: (b,) corrections with factors of this step
    status: np.ndarray  #: (b,)
    live: np.ndarray  #: (b,) 0 for members that have failed for good


def released(function: F) -> F:
    """`jit` without the interpreter lock: other threads run meanwhile."""
    compiled = jit(function)
    compiled.targetoptions["nogil"] = True  # type: ignore[attr-defined]
    return compiled


@jit
def arrays_of(A: Arrays, M: Members, b: int) -> Arrays:
    """The arrays of one member; its elastic groups are those that are in `A` now."""
    mass, damping, stiffness = A.mass, A.damping, A.stiffness
    return Arrays(
        A.groups,
        A.scatter,
        A.lift,
        A.lift_offset,
        Operator(mass.offsets, mass.diagonals, mass.rows, mass.components, M.mass[b], mass.full),
        Operator(damping.offsets, damping.diagonals, damping.rows, damping.components, M.damping[b], damping.full),
        Operator(stiffness.offsets, stiffness.diagonals, stiffness.rows, stiffness.components, M.stiffness[b], stiffness.full),
        A.dense,
        A.probes,
        M.probes_offset[b],
        Terms(A.terms.row, M.terms[b], A.terms.signal, A.terms.i, A.terms.j, A.terms.pair),
        Forces(A.forces.row, M.forces[b], A.forces.signal, A.forces.laws, M.vectors[b], A.forces.dim),
        Pairs(A.pairs.target, M.pairs[b], A.pairs.size),
        M.load[b],
        Turning(A.turning.table, M.turns[b], M.turns_offset[b], M.beta[b], M.tangents[b]),
        M.norm[b],
    )


@inlined
def state_of(s: State, b: int) -> State:
    """One member's motion in stacked arrays."""
    return State(
        s.x[b],
        s.v[b],
        s.a[b],
        s.acceleration[b],
        s.multipliers[b],
        s.history[b],
        s.past[b],
        s.known[b],
        s.order[b],
        s.angles[b],
        s.change[b],
    )


@inlined
def work_of(w: Work, b: int) -> Work:
    """One member's trial state and factors; all else is shared."""
    return Work(
        w.addresses,
        w.W,
        w.kkt,
        w.general,
        w.pivots[b],
        w.schur,
        w.schur_pivots,
        w.spread,
        w.J,
        w.Jy,
        w.rhs,
        w.y,
        w.g,
        w.H,
        w.paths,
        w.pull[b],
        w.body,
        w.work,
        w.x[b],
        w.v[b],
        w.acceleration[b],
        w.multipliers[b],
        w.angles[b],
        w.kind[b],
    )


@inlined
def method_of(M: Members, b: int) -> Method:
    """Coefficients of one member's step size."""
    m = M.methods[b]
    return Method(m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], int(m[9]), m[10], m[11], m[12])


@jit
def matrix(flat: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """The front of `flat` as a matrix."""
    return flat[: rows * columns].reshape(rows, columns)


@jit
def gather(turned: np.ndarray, x: np.ndarray, first: int, active: np.ndarray, room: np.ndarray, u: np.ndarray) -> None:
    """u (k, r) = x[active, columns] G^T; `turned` is G^T."""
    columns = matrix(room, len(active), len(turned))
    for k in range(len(active)):
        for i in range(len(turned)):
            columns[k, i] = x[active[k], first + i]
    np.dot(columns, turned, u)


@jit
def elastic_forces(groups: Groups, M: Members, x: np.ndarray, v: np.ndarray, active: np.ndarray, room: Room) -> None:
    """room.force[k] = sum over the groups of G^T phi(G x + g) for the members that still iterate."""
    kernels.clear(room.force.reshape(-1))
    at = 0
    for g in range(len(groups.table)):
        row = groups.table[g]
        G, offset = kernels.sampled_views(groups, g)
        turned = kernels.turned_view(groups, g)
        size, modes = G.shape
        u, rate, S = matrix(room.u, len(active), size), matrix(room.rate, len(active), size), matrix(room.S, len(active), size)
        gather(turned, x, row[kernels.FIRST], active, room.x, u)
        if M.beta[:, g].max() > 0.0:
            gather(turned, v, row[kernels.FIRST], active, room.x, rate)
        points, count = row[kernels.POINTS], row[kernels.CELLS]
        rows, lines = size // (points * count), row[kernels.ROWS]
        for k in range(len(active)):
            b = active[k]
            for i in range(size):
                u[k, i] += offset[i]
            section = M.sections[b, at : at + lines * points * count].reshape(lines, points, count)
            jets, rates = u[k].reshape(rows, points, count), rate[k].reshape(rows, points, count)
            laws.call_stress(groups.laws, row[kernels.LAW], jets, rates, M.beta[b, g], section, S[k].reshape(rows, points, count))
        f = matrix(room.f, len(active), modes)
        np.dot(S, G, f)
        for k in range(len(active)):
            for i in range(modes):
                room.force[k, row[kernels.FIRST] + i] += f[k, i]
        at += lines * points * count


@inlined
def probe(x: np.ndarray, active: np.ndarray, room: Room) -> None:
    """room.y[k] = P x[active[k]]."""
    if len(room.P) > 0:
        gather(room.Pt, x, 0, active, room.x, matrix(room.y, len(active), len(room.P)))


@inlined
def residual(A: Arrays, M: Members, w: Work, room: Room, k: int, b: int, c: float, signals: np.ndarray) -> None:
    """rhs = (c (M q'' + f) + Phi_q^T lambda, Phi) of the k-th member that still iterates, as in `stepping.residual`."""
    n, j = len(w.x), len(w.y)
    R = w.rhs[0, :n]
    R[:] = room.force[k]
    if A.mass.full:
        kernels.add_combination(M.mass[b], w.acceleration, R)
    else:
        for i in range(n):
            R[i] += M.lumped[b, i] * w.acceleration[i]
    if A.damping.full:
        kernels.add_combination(M.damping[b], w.v, R)
    if A.stiffness.full:
        kernels.add_combination(M.stiffness[b], w.x, R)
    for i in range(n):
        R[i] = c * (R[i] - M.load[b, i])
    if j == 0:
        return
    for i in range(j):
        w.y[i] = room.y[k * j + i] + M.probes_offset[b, i]
    kernels.clear(w.g)
    forces = Forces(A.forces.row, M.forces[b], A.forces.signal, A.forces.laws, M.vectors[b], A.forces.dim)
    kernels.add_loads(forces, A.probes, w.y, w.v, signals, w.angles, w.g)
    terms = Terms(A.terms.row, M.terms[b], A.terms.signal, A.terms.i, A.terms.j, A.terms.pair)
    kernels.constrain(terms, w.y, signals, w.rhs[0, n:], w.Jy)
    for i in range(j):
        w.g[i] *= -c
    kernels.add_combination(w.Jy, w.multipliers, w.g)
    kernels.add_combination(room.P, w.g, R)


@jit
def factorise(A: Arrays, groups: Groups, M: Members, w: Work, method: Method, signals: np.ndarray, b: int, room: Room) -> int:
    """Factors of one member; `groups` receives its sections."""
    at = 0
    for g in range(len(groups.table)):
        row = groups.table[g]
        size = row[kernels.ROWS] * row[kernels.POINTS] * row[kernels.CELLS]
        groups.numbers[row[kernels.SECTION] : row[kernels.SECTION] + size] = M.sections[b, at : at + size]
        groups.beta[g] = M.beta[b, g]
        at += size
    info = stepping.factorise(A, w, method, signals)
    room.factors[b] = w.kkt
    return info


@inlined
def correct(
    A: Arrays, M: Members, w: Work, room: Room, k: int, step: int, iteration: int, change: float, counters: np.ndarray
) -> int:
    """One correction of the k-th member that still iterates; its status."""
    b = room.active[k]
    method, signals, trial = method_of(M, b), M.signals[b, step], work_of(w, b)
    residual(A, M, trial, room, k, b, method.c, signals)
    if trial.kind[0] == 0:
        counters[b, FACTORISATIONS] += 1
        room.fresh[b] = 1
        if factorise(arrays_of(A, M, b), A.groups, M, trial, method, signals, b, room) != 0:
            return SINGULAR
    stepping.substitute_dense(room.factors[b], trial.pivots, trial.rhs[0])
    norm = stepping.apply(M.norm[b], trial, method)
    counters[b, ITERATIONS] += 1
    status = stepping.judge(trial, method, change, iteration, norm, room.norms[b], room.fresh[b])
    room.norms[b] = norm
    if trial.kind[0] == 0:
        room.fresh[b] = 0
    elif room.fresh[b] > 0:
        room.fresh[b] += 1
    return status


@inlined
def begin(M: Members, s: State, w: Work, room: Room) -> int:
    """Predict the next step of the live members; their number."""
    count = 0
    for b in range(len(room.live)):
        if room.live[b] == 1:
            stepping.predict(state_of(s, b), work_of(w, b), method_of(M, b))
            room.active[count], room.status[b], room.norms[b], room.fresh[b] = b, NOT_CONVERGED, 0.0, 0
            count += 1
    return count


@inlined
def settle(A: Arrays, M: Members, s: State, w: Work, room: Room, method: Method, step: int, b: int) -> None:
    """As `stepping.settle`, of one member."""
    terms = Terms(A.terms.row, M.terms[b], A.terms.signal, A.terms.i, A.terms.j, A.terms.pair)
    stepping.drift(A.probes, M.probes_offset[b], terms, s, w, method, M.signals[b, step])
    stepping.substitute_dense(room.factors[b], w.pivots, w.rhs[0])
    stepping.turn(A.probes, w)
    stepping.substitute_dense(room.factors[b], w.pivots, w.rhs[0])
    stepping.shift(M.norm[b], A.probes, s, w)


@inlined
def end(
    A: Arrays,
    M: Members,
    s: State,
    w: Work,
    room: Room,
    step: int,
    row: int,
    out: np.ndarray,
    multipliers: np.ndarray,
    counters: np.ndarray,
) -> bool:
    """Accept the step of the members that have converged; whether all have."""
    good, moving = True, not kernels.steady(A.terms)
    for b in range(len(room.live)):
        if room.live[b] == 0:
            continue
        if room.status[b] != DONE:
            w.kind[b] = 0
            good = False
            continue
        method = method_of(M, b)
        stepping.accept(M.norm[b], state_of(s, b), work_of(w, b), method)
        springs.follow(A.forces.laws, A.probes, M.probes_offset[b], s.x[b], s.angles[b])
        if moving:
            settle(A, M, state_of(s, b), work_of(w, b), room, method, step, b)
        counters[b, STEPS] += 1
        if row >= 0:
            stepping.store(state_of(s, b), method.c, row, out[b], multipliers[b])
    return good


@released
def march(
    A: Arrays,
    M: Members,
    s: State,
    w: Work,
    room: Room,
    first: int,
    rows: np.ndarray,
    out: np.ndarray,
    multipliers: np.ndarray,
    counters: np.ndarray,
) -> int:
    """Take steps from number `first` on, until all are done or a member fails; the number of steps that are begun then.

    States go to row rows[k + 1] of out (b, 3, s, n) after step k. Members that fail stay at their last good step with room.status.
    """
    A, M, s, w, room = borrowed(A), borrowed(M), borrowed(s), borrowed(w), borrowed(room)
    out, multipliers, counters = borrowed(out), borrowed(multipliers), borrowed(counters)
    for step in range(first, M.signals.shape[1]):
        count, iteration = begin(M, s, w, room), 0
        while count > 0 and iteration < int(M.methods[0, 9]):
            active = room.active[:count]
            elastic_forces(A.groups, M, w.x, w.v, active, room)
            probe(w.x, active, room)
            left = 0
            for k in range(count):
                b = active[k]
                room.status[b] = correct(A, M, w, room, k, step, iteration, s.change[b, 0], counters)
                if room.status[b] == NOT_CONVERGED:
                    active[left] = b
                    left += 1
            count, iteration = left, iteration + 1
        if not end(A, M, s, w, room, step, rows[step + 1], out, multipliers, counters):
            return step + 1
    return M.signals.shape[1]
