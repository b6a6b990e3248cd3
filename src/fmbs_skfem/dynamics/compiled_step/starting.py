r"""The start of a motion, or of what is left of it at an event, in compiled code: for all models, and
for the programs that are printed of them.

    [ W      Phi_q^T ] [ q''    ]     [ f                                          ]
    [ Phi_q  0       ] [ lambda ] = - [ D2 = d2Phi/dt2 - Phi_q d2q/dt2             ],    W = M

and with D3 in place of D2 and no forces what of dq''/dt the joints determine. Steps of elastic
bodies begin with W = M + (gh C + K) / bh: under a load that starts as a step M^-1 f is huge in the
waves that the step h does not resolve, and the run would carry them on. What that leaves out is of
second order in h. What is shown, and read within steps, balances all forces by M, also where what
touches holds the first step. Where nothing holds what begins to move, q'' K q'' < 0, steps begin
with M. Of a motion that goes on, accelerations that are known stay, and what has changed is found
so. Here all matrices and forces are c bh times as large, as W of a step is.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiling.jit import jit
from ...core.compiling.structs import invoke, routine
from ...systems import evaluation, kernels, work
from ...systems.terms import turning
from . import stepping
from .factors import MASS, SOFT, STIFF, TOUCHING
from .step import opened

#: what `start` is told of a model, added up: whether it begins without waves that no step resolves;
#: whether M alone determines no accelerations, and whether a little stiffness shall; whether forces
#: read those of joints; whether something may touch that holds the first step; whether the
#: accelerations in `a` of the state are known; whether joints alone determine some accelerations
FILTERED, MASSLESS, SOFTENED, REACTS, TOUCHES, KNOWN, HELD = (2**k for k in range(7))
KINETIC, STRAIN = range(2)  #: energies
# each leaves the friction coefficient squared or less of what is left, where mass and curvature are
# ordinary
REACTIONS = 4  #: corrections of what depends on the forces of joints, such as friction in them
# forces of inertia have it in them; where bodies move without strains nothing else is left
ROUND_OFF = (
    1e-12  #: of the power of inertia, up to which something is held; of inertia that is none
)
MIXED = 17  #: a prime number that no mesh repeats itself with


@jit
def has(more: int, flag: int) -> bool:
    """Whether a flag is one of those added up in `more`."""
    return more // flag % 2 == 1


@routine
def find_rates(table: Any, _: Any) -> int:
    """What velocities of the state break, behind the forces in rhs, with the signals of the first
    row of the job.

        Phi_q v + Phi_t

    0 in rows that are off.
    """
    S = opened(table)
    # of places and rates of probes alone: no force is evaluated
    kernels.copy(S.job.signals[0], S.space.signals)
    stepping.place_paths(table)
    stepping.add_drift(table, 0.0, 0.0)
    return 0


@routine
def start(table: Any, more: Any) -> int:
    """Put a state with its x, v that joints admit, and what forces keep before, to the start of a
    motion; 0, or 1 where a matrix is singular.

    Signals are those of the first row of the job, with their derivatives where joints read them.
    `more` is a sum of the flags above; accelerations that are known are in `a` of the state, which
    is overwritten.
    """
    turns = opened(table).work.kind[1]
    failed = find_accelerations(table, more)
    forget_factors(table, turns)
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
def forget_factors(table: Any, turns: int) -> None:
    """New factors in the next step, of tangents that are turned or not, as its kind was before."""
    kind = opened(table).work.kind
    kind[0] = kind[2] = kind[3] = 0
    kind[1] = turns


@routine
def find_accelerations(table: Any, more: Any) -> int:
    """Accelerations and multipliers that balance all forces, and those that steps begin with in the
    first rows of history and past; 0, or 1. `more` as of `start`.

    What changes with time of the accelerations is in the second row of history.
    """
    filtered, touches = has(more, FILTERED), has(more, TOUCHES)
    if find_forces(table) != 0:
        return 1
    held = False
    if filtered or touches:
        # what W makes singular, as in an unstable state, is held by nothing
        held = balance(table, STIFF if filtered else TOUCHING, more) == 0
        if held:
            begin_with_these(table)
            held = has(more, MASSLESS) or not filtered or is_held(table, more)
        elif has(more, MASSLESS):
            return 1
    if has(more, MASSLESS):
        return balance_softly(table, more) if has(more, SOFTENED) else 0
    # where nothing holds what begins to move steps begin with M, too; factors of M alone there are
    # none where it is singular
    which = TOUCHING if touches and not held else MASS
    if balance(table, SOFT if has(more, HELD) else which, more) != 0:
        return 1
    if not held:
        begin_with_these(table)
    return 0


@jit
def balance_softly(table: Any, more: int) -> int:
    """Accelerations and multipliers by M and little of the stiffness, where directors have no mass,
    which follow at once; 0, or 1.

    The accelerations of what has no mass have no bound there, and are those that steps begin with.
    """
    S = opened(table)
    s = S.state
    any_motion, inertia = S.space.acceleration, S.space.way
    if balance(table, SOFT, more) != 0:
        return 1
    # unequal numbers, so that nothing cancels: zero is left of what has no mass alone
    for i in range(len(inertia)):
        any_motion[i] = 1.0 / (i % MIXED + 1)
    kernels.clear(inertia)
    kernels.add_operator(S.arrays.mass, any_motion, inertia)
    kernels.clear(any_motion)
    largest = 0.0
    for i in range(len(inertia)):
        largest = max(largest, abs(inertia[i]))
    for i in range(len(inertia)):
        if abs(inertia[i]) <= ROUND_OFF * largest:
            s.acceleration[i] = s.history[0, i]
    return 0


@jit
def place_state(table: Any) -> None:
    """The trial state is the state with the signals of the first row of the job; accelerations and
    multipliers are zero.
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


@jit
def find_forces(table: Any) -> int:
    """Forces f (n,) [N] of the state without inertia and joints, in `moved`, 0, or the number of
    forces that failed; rows that joints read, and Phi_y, become current.
    """
    S = opened(table)
    place_state(table)
    # forces in newtons and physical multipliers
    S.space.c[0] = 1.0
    failed = invoke(S.doors.residual, table, 0)
    kernels.copy(S.space.f, S.work.moved)
    # of the derivatives of joints below the third one multiplies it
    kernels.clear(S.state.acceleration)
    return failed


@jit
def balance(table: Any, which: int, more: int) -> int:
    """Accelerations and multipliers of the state that balance its forces by a matrix; 0, or 1 where
    that is singular.

        W (q'' - a) + Phi_q^T mu = - c bh (f + M a),    Phi_q q'' = -D2,    mu = c bh lambda

    of accelerations a that are known, or 0.
    """
    S = opened(table)
    s = S.state
    t = S.space
    n = len(S.state.x)
    scale = S.method.c * S.method.bh
    # the space is in the state, whose multipliers are zero
    if factorise(table, which) != 0:
        return 1
    for k in range(1 + REACTIONS if has(more, REACTS) else 1):
        if k > 0:
            add_reactions(table)
        find_curvature(table, 1.0, 0.0)
        kernels.copy(S.work.moved, t.way)
        if has(more, KNOWN):
            kernels.add_operator(S.arrays.mass, s.a, t.way)
            subtract_known(table)
        for i in range(n):
            t.f[i] = -scale * t.way[i]
        if solve(table) != 0:
            return 1
        kernels.copy(t.f, s.acceleration)
        for m in range(len(s.multipliers)):
            s.multipliers[m] = t.rhs[0, n + m] / S.method.bh
        if has(more, KNOWN):
            for i in range(n):
                s.acceleration[i] += s.a[i]
    return 0


@jit
def factorise(table: Any, which: int) -> int:
    """Factors of the matrix of a start at the trial state, see `factors`; 0, or 1 where it is
    singular.
    """
    S = opened(table)
    S.work.kind[1] = which
    S.space.c[0], S.space.gh[0] = S.method.c, S.method.gh
    if S.doors.whole == 0:
        return invoke(S.doors.factorise, table, 0)
    # factors of a storage itself: those that rotate are for what comes
    S.rotations.on[0] = 0
    return invoke(S.doors.whole, table, 0)


@jit
def solve(table: Any) -> int:
    """rhs <- KKT^-1 rhs; 0, or 1 where that is no solution."""
    return invoke(opened(table).doors.solve, table, 0)


@jit
def subtract_known(table: Any) -> None:
    """Curvatures of the joints behind the forces in rhs less those that known accelerations have."""
    S = opened(table)
    t = S.space
    n = len(S.state.x)
    y = t.paths[0]
    kernels.clear(y)
    kernels.add_product(S.arrays.shown, 1.0, S.state.a, y)
    for m in range(len(S.state.multipliers)):
        if t.off[m] == 0.0:
            t.rhs[0, n + m] -= kernels.dot(t.Jy[m], y)


@jit
def add_joint_forces(table: Any, multipliers: np.ndarray, f: np.ndarray) -> None:
    """f (n,) += Phi_q^T of multipliers (m,), with current Phi_y."""
    S = opened(table)
    t = S.space
    kernels.clear(t.g)
    kernels.add_combination(t.Jy, multipliers, t.g)
    kernels.add_transposed(S.arrays.shown, 1.0, t.g, f)


@jit
def add_reactions(table: Any) -> None:
    """The forces in `moved` become those beside the multipliers that were found."""
    S = opened(table)
    s = S.state
    t = S.space
    t.c[0] = 1.0
    for m in range(len(s.multipliers)):
        t.multipliers[m] = s.multipliers[m] / S.method.c
    kernels.clear(t.acceleration)
    invoke(S.doors.residual, table, 0)
    # without the forces of the joints themselves, which the matrix holds
    for m in range(len(s.multipliers)):
        t.multipliers[m] = -t.multipliers[m]
    add_joint_forces(table, t.multipliers, t.f)
    kernels.copy(t.f, S.work.moved)
    kernels.clear(t.multipliers)


@jit
def find_curvature(table: Any, second: float, third: float) -> None:
    """Parts of derivatives of the joints by time, behind the forces in rhs.

        - (second D2 + third D3)

    of the state; 0 of joints that neither turn nor move.
    """
    S = opened(table)
    t = S.space
    n = len(S.state.x)
    whole = S.state.past[1]
    kernels.clear(t.rhs[0, n:])
    if S.doors.settle == 0:
        return
    stepping.place_paths(table)
    stepping.add_drift(table, second, third)
    kernels.copy(t.rhs[0, n:], whole)
    # first derivatives, which are in that sum: zero but for round-off, as v is on the joints
    stepping.add_drift(table, 0.0, 0.0)
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
        solve(table)
        kernels.copy(S.space.f, s.history[1])


@jit
def is_held(table: Any, more: int) -> bool:
    """Whether something holds what begins to move.

        d (gh C + K) d >= - ROUND_OFF bh d M d

    d of the accelerations that were found with M + (gh C + K) / bh, less those known.
    """
    S = opened(table)
    s = S.state
    t = S.space
    kernels.copy(s.acceleration, t.acceleration)
    kernels.copy(s.multipliers, t.multipliers)
    t.c[0] = S.method.c
    invoke(S.doors.residual, table, 0)
    # what is left of M q'' + Phi_q^T lambda + f is - (gh C + K) d / bh
    for i in range(len(s.x)):
        known = s.a[i] if has(more, KNOWN) else 0.0
        t.acceleration[i] = s.acceleration[i] - known
    kernels.clear(t.way)
    kernels.add_operator(S.arrays.mass, t.acceleration, t.way)
    least = ROUND_OFF * S.method.c * kernels.dot(t.acceleration, t.way)
    held = kernels.dot(t.acceleration, t.f) <= least
    kernels.clear(t.acceleration)
    kernels.clear(t.multipliers)
    return held


@jit
def begin_state(table: Any) -> None:
    """All else of the state; v and a onto the path of the joints.

        v <- v + h^2 (1/6 - beta - (am - af) / 2) dq''/dt,    a = q'' + (am - af) h dq''/dt

    with (4) of `settling`, and a at t + (am - af) h.
    """
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
