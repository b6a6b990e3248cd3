r"""The start of a motion in compiled code, as `initial` finds it: for dense models, and for the
programs that are printed of them.

    [ M      Phi_q^T ] [ q''    ]     [ f                                          ]
    [ Phi_q  0       ] [ lambda ] = - [ D2 = d2Phi/dt2 - Phi_q d2q/dt2             ]

and with D3 in place of D2 and no forces what of dq''/dt the joints determine. Steps begin with
M + (gh C + K) / bh in place of M where bodies are elastic. Here all matrices and forces are c bh
times as large, as W of a step is.

Derivatives by time are exact, those of `initial` differences over parts of a step.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiling.jit import jit
from ...core.compiling.structs import invoke, routine
from ...systems import evaluation, kernels, work
from ...systems.terms import turning
from . import factors, stepping
from .factors import ALL
from .step import opened

#: what `start` is told of a model, added up: whether it begins without waves that no step resolves,
#: whether M alone determines no accelerations, whether forces read those of joints (`initial`)
FILTERED, MASSLESS, REACTS = 1, 2, 4
#: matrices in place of M: M itself, with what touches in the state, or with all tangents
MASS, TOUCHING, STIFF = range(3)
KINETIC, STRAIN = range(2)  #: energies
# each leaves the friction coefficient squared or less of what is left, where mass and curvature are
# ordinary
REACTIONS = 4  #: corrections of what depends on the forces of joints, such as friction in them
# forces of inertia have it in them; where bodies move without strains nothing else is left
ROUND_OFF = 1e-12  #: of the power of inertia, up to which something is held


@routine
def start(table: Any, more: Any) -> int:
    """Put a state with its x, v that joints admit, and what forces keep before, to the start of a
    motion; 0, or 1 where a matrix is singular.

    Signals are those of the first row of the job, with their derivatives where joints read them.
    `more` is a sum of FILTERED, MASSLESS and REACTS.
    """
    S = opened(table)
    kind = S.work.kind
    turns = kind[1]
    failed = find_accelerations(table, more)
    # new factors in the first step, of tangents that are turned or not as before
    kind[0] = kind[3] = 0
    kind[1] = turns
    if failed == 0:
        begin_state(table)
    return failed


@routine
def energies(table: Any, which: Any) -> int:
    """The KINETIC or STRAIN energy [J] of the accepted state, in the energy of the space; the next
    step does not notice.

    The latter is that of elastic terms, of linear springs, x . K x / 2, and of forces.
    """
    S = opened(table)
    A = S.arrays
    s = S.state
    t = S.space
    kernels.clear(t.f)
    if which == KINETIC:
        kernels.add_operator(A.mass, s.v, t.f)
        t.energy[0] = 0.5 * kernels.dot(s.v, t.f)
        return 0
    stepping.place_accepted(table)
    evaluation.sum_energies(table)
    kernels.add_operator(A.stiffness, s.x, t.f)
    t.energy[0] += 0.5 * kernels.dot(s.x, t.f)
    if len(A.forces.stored) > 0:
        evaluation.read_probes(table)
        evaluation.store_energies(table)
    return 0


@routine
def turned_tangents(table: Any, _: Any) -> int:
    """Find the tangents of planar bodies that turn, and use them from now on: 1, or 0 where none
    does.
    """
    found = turning.fill(table)
    opened(table).work.kind[1] = found
    return found


@jit
def find_accelerations(table: Any, more: int) -> int:
    """Accelerations and multipliers that balance all forces, and those that steps begin with in the
    first rows of history and past; 0, or 1.

    What changes with time of the accelerations is in the second row of history.
    """
    S = opened(table)
    filtered, massless = more % 2 == 1, more // 2 % 2 == 1
    touches = len(S.arrays.forces.judged) > 0
    find_forces(table)
    held = False
    if filtered or touches:
        # under a load that starts as a step M^-1 f is huge in waves that the step does not resolve
        if balance(table, STIFF if filtered else TOUCHING, more) != 0:
            return 1
        begin_with_these(table)
        held = massless or not filtered or is_held(table)
    if not massless:
        # where nothing holds what begins to move steps begin with M, too
        if balance(table, TOUCHING if touches and not held else MASS, more) != 0:
            return 1
        if not held:
            begin_with_these(table)
    return 0


@jit
def find_forces(table: Any) -> None:
    """Forces f (n,) [N] of the state without inertia and joints, in `moved`; rows that joints read,
    and Phi_y, become current.
    """
    S = opened(table)
    s = S.state
    t = S.space
    kernels.copy(S.job.signals[0], t.signals)
    kernels.copy(s.x, t.x)
    kernels.copy(s.v, t.v)
    kernels.copy(s.memory, t.memory)
    kernels.clear(t.acceleration)
    kernels.clear(t.multipliers)
    # forces in newtons and physical multipliers, as in `initial`
    t.c[0] = 1.0
    invoke(S.doors.residual, table, 0)
    kernels.copy(t.f, S.work.moved)
    # of the derivatives of joints below the third one multiplies it
    kernels.clear(s.acceleration)


@jit
def balance(table: Any, which: int, more: int) -> int:
    """Accelerations and multipliers of the state that balance its forces by a matrix; 0, or 1 where
    that is singular.

        W q'' + Phi_q^T mu = -c bh f,    Phi_q q'' = -D2,    mu = c bh lambda
    """
    S = opened(table)
    s = S.state
    t = S.space
    n = len(S.state.x)
    scale = S.method.c * S.method.bh
    if factor(table, which) != 0:
        return 1
    for k in range(1 + REACTIONS if more // 4 % 2 == 1 else 1):
        if k > 0:
            add_reactions(table)
        find_curvature(table, 1.0, 0.0)
        for i in range(n):
            t.f[i] = -scale * S.work.moved[i]
        invoke(S.doors.solve, table, 0)
        kernels.copy(t.f, s.acceleration)
        for m in range(len(s.multipliers)):
            s.multipliers[m] = t.rhs[0, n + m] / S.method.bh
    return 0


@jit
def factor(table: Any, which: int) -> int:
    """Factors of a matrix in the state of the space, whose multipliers are zero; 0, or 1 where it
    is singular.

        W = c bh M,    c bh M + H of what touches,    c (bh M + gh C + K) + H
    """
    S = opened(table)
    A = S.arrays
    t = S.space
    t.c[0], t.gh[0] = S.method.c, S.method.gh
    if which == STIFF:
        # exact tangents: those of a reference shape that is turned are for the iteration
        S.work.kind[1] = 0
        if invoke(S.doors.assemble, table, ALL) != 0:
            return 1
    else:
        factors.gather_joints(table)
        scale = S.method.c * S.method.bh
        for i in range(t.W.shape[0]):
            for j in range(t.W.shape[1]):
                t.W[i, j] = scale * A.mass.store[i, j]
        if which == TOUCHING:
            evaluation.slopes(table)
            factors.add_joints(table)
    # a moment makes W unsymmetric by less than what Cholesky's factors may leave out in a step: of
    # beams with directors, at 850 m/s2, those were off by 3e-6
    S.work.kind[0] = S.work.kind[2] = factors.DENSE_LU
    return 0 if factors.factor_dense(table) == 0 else 1


@jit
def add_reactions(table: Any) -> None:
    """The forces in `moved` become those beside the multipliers that were found."""
    S = opened(table)
    s = S.state
    t = S.space
    t.c[0] = 1.0
    for m in range(len(s.multipliers)):
        t.multipliers[m] = s.multipliers[m] / S.method.c
    invoke(S.doors.residual, table, 0)
    # without the forces of the joints themselves, which the matrix holds
    for m in range(len(s.multipliers)):
        t.multipliers[m] = -t.multipliers[m]
    kernels.add_combination(S.work.J, t.multipliers, t.f)
    kernels.copy(t.f, S.work.moved)
    kernels.clear(t.multipliers)


@jit
def find_curvature(table: Any, second: float, third: float) -> None:
    """Parts of derivatives of the joints by time, behind the forces in rhs.

        - (second D2 + third D3)

    of the state; 0 of joints that neither turn nor move.
    """
    S = opened(table)
    s = S.state
    t = S.space
    A = S.arrays
    n = len(S.state.x)
    whole = s.past[1]
    kernels.clear(t.rhs[0, n:])
    if S.doors.settle == 0:
        return
    kernels.probe_paths(A.shown, A.probes_offset, s.x, s.v, s.v, s.acceleration, t.paths)
    t.leads[0], t.leads[1] = second, third
    evaluation.find_drift(table)
    kernels.copy(t.rhs[0, n:], whole)
    # first derivatives, which are in that sum: zero but for round-off, as v is on the joints
    t.leads[0], t.leads[1] = 0.0, 0.0
    evaluation.find_drift(table)
    for m in range(len(whole)):
        t.rhs[0, n + m] -= whole[m]
        whole[m] = 0.0


@jit
def begin_with_these(table: Any) -> None:
    """What was found is what steps begin with; its change with time goes to the second row of
    history.
    """
    S = opened(table)
    s = S.state
    kernels.copy(s.acceleration, s.history[0])
    kernels.copy(s.multipliers, s.past[0])
    kernels.clear(s.history[1])
    if S.doors.settle != 0:
        find_curvature(table, 0.0, 1.0)
        kernels.clear(S.space.f)
        invoke(S.doors.solve, table, 0)
        kernels.copy(S.space.f, s.history[1])


@jit
def is_held(table: Any) -> bool:
    """Whether something holds what begins to move.

        q'' (gh C + K) q'' >= - ROUND_OFF bh q'' M q''

    of the accelerations that were found with M + (gh C + K) / bh.
    """
    S = opened(table)
    s = S.state
    t = S.space
    kernels.copy(s.acceleration, t.acceleration)
    kernels.copy(s.multipliers, t.multipliers)
    t.c[0] = S.method.c
    invoke(S.doors.residual, table, 0)
    kernels.clear(t.way)
    kernels.add_operator(S.arrays.mass, s.acceleration, t.way)
    # what is left of M q'' + Phi_q^T lambda + f is - (gh C + K) q'' / bh
    least = ROUND_OFF * S.method.c * kernels.dot(s.acceleration, t.way)
    held = kernels.dot(s.acceleration, t.f) <= least
    kernels.clear(t.acceleration)
    kernels.clear(t.multipliers)
    return held


@jit
def begin_state(table: Any) -> None:
    """All else of the state, and v and a onto the path of the joints, see `initial.Start`."""
    S = opened(table)
    s = S.state
    t = S.space
    method = S.method
    norm = S.arrays.norm
    # the space is in the state, whose gradients the last evaluation has left
    evaluation.take_over(table)
    kernels.copy(t.memory, s.memory)
    kernels.copy(t.gradients[0], s.gradients)
    if len(S.job.work) > 0:
        kernels.copy(s.past[0], t.multipliers)
        t.c[0] = method.c
        work.find_forces(table)
        kernels.copy(t.f, s.push)
        kernels.copy(S.job.signals[0, : len(s.signals)], s.signals)
        kernels.clear(s.work)
    square = 0.0
    h = method.h
    late = method.am - method.af
    for i in range(len(s.x)):
        square += norm[i] * s.v[i] * s.v[i]
        change = s.history[1, i]
        s.v[i] += h * h * (1.0 / 6.0 - method.beta - 0.5 * late) * change
        s.a[i] = s.history[0, i] + late * h * change
        s.history[1, i], s.history[2, i] = 0.0, 0.0
    for m in range(len(s.multipliers)):
        s.past[1, m], s.past[2, m] = 0.0, 0.0
    s.speed[0] = np.sqrt(square)
    s.known[0], s.order[0], s.parts[0] = 1, 0, 0
    s.change[0] = np.inf
