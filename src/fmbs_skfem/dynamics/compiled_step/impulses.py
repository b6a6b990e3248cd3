r"""What changes at once where rows of joints are released or lock, in compiled code: for runs, and for
the programs that are printed of models.

    [ W      Phi_q^T ] [ d ]     [ f                   ]
    [ Phi_q  0       ] [ p ]  =  [ - (Phi_q v + Phi_t) ],    v <- v + u,    u = d(0),    W = M

of rigid bodies. Of strains that vibrate by w [rad/s], with the damping time b, rates keep

    (1 + 2 y) / (1 + y)^2,  y = (2 gh b w^2 + w^2) / bh,    u = 2 d(0) - d(M d(0)),    W = M + (2 gh C + K) / bh

of it: to second order all that a step resolves, and little of what it does not, whose forces would
be those of no motion. By M alone an arm with 5 ms of damping that catches a mass fails at any step.
Accelerations and reactions then start anew (`starting`). Rows that depend on others in a singular
position determine nothing: independent ones find v and q'', and multipliers have least norm,

    J_d = w J_i,    lambda_i + w^T lambda_d = mu,    |lambda| -> min:    (1 + w w^T) lambda_d = w mu

with mu the multipliers of the independent rows i alone, and d the other rows.

Source: Brogliato, Nonsmooth Mechanics, 3rd ed., Springer 2016, section 4.2 (impulses on constraints).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...core.algebra.pivoting import (
    OUT,
    PivotedRows,
    find_weights,
    room_for,
    scale_rows,
    take_rows,
)
from ...core.algebra.ranks import CLOSED, EXACT
from ...core.compiling.jit import jit
from ...core.compiling.structs import Integers, Matrix, Vector, invoke, opener, routine
from ...systems import evaluation, kernels
from . import factors, starting
from .step import opened

SINGULAR, OPEN, UNHELD, AGAINST = 1, 2, 3, 4  #: reasons for which nothing begins anew
# rates that follow from others are off by round-off of an impulse, 1e-12
MOVING = 1e-6  #: rate of a row that follows from others, over what the largest rates make of it, from which on it does not hold
APART = 1e-6  #: gap of a row over what large changes make of it, or over the size of the mechanism, from which on it is open
VANISHING = 1e-6  #: length of a row, over the longest or the size of the mechanism, that is noise of a trained space
STAYS, FOLLOWS = 1, 2  #: groups of rows: those of joints that no event releases are taken first


class Impulse(NamedTuple):
    """What is needed beside a step where a motion changes at once, the unknowns in the order of the
    state.
    """

    start: int  #: address of `starting.start`, so that routines here do not compile it once more
    find: int  #: that of `starting.find_accelerations`
    flags: int  #: of `starting`, of a motion that goes on
    alone: int  #: the same where accelerations and reactions are only read
    trained: bool  #: whether rows may be noise of a trained space
    size: float  #: of the mechanism [m]
    units: Vector  #: (n,) changes of the unknowns that count as large
    loose: Integers  #: (m,) 1 for rows that events release or lock
    light: Integers  #: (l,) unknowns without mass, where joints alone are to hold them
    follows: Vector  #: (m,) 1 for rows that are to hold and follow from others
    rows: PivotedRows  #: of the joints
    columns: PivotedRows  #: of these in the unknowns without mass
    half: Matrix  #: (m, m) 1 + w w^T by its lower half
    off: Vector  #: (m,) rows that are off behind it
    rates: Vector  #: (m,) room
    change: Vector  #: (n,) of the velocities
    v: Vector  #: (n,) velocities that joints admit, behind it
    loss: Vector  #: (1,) of kinetic energy [J]
    acceleration: Vector  #: (n,) q'' that balances all forces, of `balance_known`
    multipliers: Vector  #: (m,) c times the physical ones, of `balance_known`
    a: Vector  #: (n,) of the state, while others are found
    history: Matrix  #: (3, n) likewise
    past: Matrix  #: (3, m)


opened_impulse = opener(Impulse)


def impulse_for(
    flags: int,
    alone: int,
    trained: bool,
    size: float,
    units: np.ndarray,
    loose: np.ndarray,
    light: np.ndarray,
) -> Impulse:
    """What is needed beside a step, with all its room; the arguments are its fields."""
    n = len(units)
    m = len(loose)
    return Impulse(
        start=starting.start.address,
        find=starting.find_accelerations.address,
        flags=flags,
        alone=alone,
        trained=trained,
        size=size,
        units=units,
        loose=loose,
        light=light,
        follows=np.zeros(m),
        rows=room_for(m, n),
        columns=room_for(len(light), m),
        half=np.zeros((m, m)),
        off=np.zeros(m),
        rates=np.zeros(m),
        change=np.zeros(n),
        v=np.zeros(n),
        loss=np.zeros(1),
        acceleration=np.zeros(n),
        multipliers=np.zeros(m),
        a=np.zeros(n),
        history=np.zeros((3, n)),
        past=np.zeros((3, m)),
    )


@routine
def begin_anew(table: Any, record: Any) -> int:
    """Go on from the state with the rows that are not `off` in the space, of an Impulse at the
    address `record`: 0, or SINGULAR, OPEN where a row that is to hold has a gap, UNHELD where
    neither joints nor a mass hold an unknown, AGAINST where a row that follows from others does not
    hold in the motion that these have, as where a drive moves against it.

    Signals are those of the first row of the job, with their derivatives where joints read them,
    and accelerations of the motion before in `a` of the state. Loose rows that follow from others
    are off as well behind it. Velocities that joints admit are in `v` of the record, and what the
    impulse has lost in `loss`. The largest speed so far, halvings of the next step and the work go
    on.
    """
    S = opened(table)
    p = opened_impulse(record)
    s, off = S.state, S.space.off
    speed, parts, work, heat = s.speed[0], s.parts[0], s.work[0], s.work[1]
    turns = S.work.kind[1]
    kernels.copy(off, p.off)
    # of all rows, since those that are open say which ones are noise
    kernels.clear(off)
    place_rows(table)
    leave_out(table, p)
    failed = OPEN if is_open(table, p) else 0
    count = choose_rows(table, p)
    if failed == 0 and starting.has(p.flags, starting.HELD) and not are_held(p):
        failed = UNHELD
    if failed == 0:
        failed = change_velocities(table, p)
    if failed == 0 and is_against(table, p):
        failed = AGAINST
    starting.forget_factors(table, turns)
    if failed == 0:
        failed = invoke(p.start, table, p.flags)
    if failed == 0:
        share(table, p, count)
    kernels.copy(p.off, off)
    s.speed[0], s.parts[0], s.work[0], s.work[1] = speed, parts, work, heat
    return failed


@routine
def balance_known(table: Any, record: Any) -> int:
    """Accelerations and multipliers that balance the forces of the state by M alone, in an Impulse
    at the address `record`; 0, or SINGULAR.

        M q'' + Phi_q^T lambda = - f,    Phi_q q'' = -D2

    with the signals of the first row of the job; those of the state are the known ones. The state
    stays as it is, to the bit, and the next step factors anew.
    """
    S = opened(table)
    p = opened_impulse(record)
    s, off = S.state, S.space.off
    turns = S.work.kind[1]
    kernels.copy(s.a, p.a)
    kernels.copy(s.acceleration, p.acceleration)
    kernels.copy(s.multipliers, p.multipliers)
    for k in range(len(s.history)):
        kernels.copy(s.history[k], p.history[k])
        kernels.copy(s.past[k], p.past[k])
    kernels.copy(s.acceleration, s.a)
    kernels.copy(off, p.off)
    place_rows(table)
    fill_rows(table, p)
    count = choose_rows(table, p)
    failed = invoke(p.find, table, p.alone)
    if failed == 0:
        share(table, p, count)
    exchange(s.acceleration, p.acceleration)
    exchange(s.multipliers, p.multipliers)
    kernels.copy(p.a, s.a)
    for k in range(len(s.history)):
        kernels.copy(p.history[k], s.history[k])
        kernels.copy(p.past[k], s.past[k])
    kernels.copy(p.off, off)
    starting.forget_factors(table, turns)
    return failed


@routine
def close_rates(table: Any, record: Any) -> int:
    """Put the velocities of the state onto the rows that are not off, which are independent, by an
    impulse; 0, or SINGULAR.

    Signals are those of the first row of the job.
    """
    turns = opened(table).work.kind[1]
    place_rows(table)
    failed = change_velocities(table, opened_impulse(record))
    starting.forget_factors(table, turns)
    return failed


@jit
def exchange(x: np.ndarray, y: np.ndarray) -> None:
    """x (n,) and y (n,), each for the other."""
    for i in range(len(x)):
        x[i], y[i] = y[i], x[i]


@jit
def place_rows(table: Any) -> None:
    """Gaps of the state behind the forces in rhs, and Phi_y, of rows that are not off."""
    starting.place_state(table)
    evaluation.probe_constraints(table, 0)


@jit
def fill_rows(table: Any, p: Impulse) -> None:
    """Phi_q in changes of the unknowns that count as large, row by row, see `PivotedRows`."""
    unit = p.rows.unit
    factors.gather_joints(table, unit)
    for m in range(len(unit)):
        for i in range(len(p.units)):
            unit[m, i] *= p.units[i]
    scale_rows(p.rows)


@jit
def leave_out(table: Any, p: Impulse) -> None:
    """Loose rows that follow from the other rows that hold are off from now on, and those that hold
    in all motions which a trained space knows, where they are noise.
    """
    rows = p.rows
    fill_rows(table, p)
    longest = p.size
    kernels.clear(p.follows)
    for m in range(len(p.off)):
        longest = max(longest, rows.lengths[m])
    some = False
    for m in range(len(p.off)):
        rows.group[m] = OUT
        if p.off[m] == 0.0:
            rows.group[m] = STAYS
            if p.loose[m] == 1:
                rows.group[m] = FOLLOWS
                some = True
                if p.trained and rows.lengths[m] < VANISHING * longest:
                    rows.group[m], p.off[m] = OUT, 1.0
    if some:
        take_rows(rows, FOLLOWS, take_rows(rows, STAYS, 0, CLOSED), CLOSED)
        for m in range(len(p.off)):
            if rows.group[m] == FOLLOWS:
                p.off[m] = p.follows[m] = 1.0
        fill_rows(table, p)


@jit
def is_open(table: Any, p: Impulse) -> bool:
    """Whether a row that is to hold has a gap in the state."""
    S = opened(table)
    for m in range(len(p.off)):
        gap = abs(S.space.rhs[0, len(S.state.x) + m])
        # what is no number is none
        if p.off[m] == 0.0 and not gap <= APART * max(p.rows.lengths[m], p.size):
            return True
    return False


@jit
def is_against(table: Any, p: Impulse) -> bool:
    """Whether a row that follows from others has a rate in the state, whose other rows have none."""
    S = opened(table)
    n = len(S.state.x)
    off = S.space.off
    largest = 0.0
    # before the impulse, too: it may have left none
    for i in range(n):
        rate = max(abs(S.state.v[i]), abs(S.state.v[i] - p.change[i]))
        largest = max(largest, rate / p.units[i])
    kernels.copy(off, p.rates)
    for m in range(len(off)):
        off[m] = 1.0 - p.follows[m]
    starting.find_rates(table, 0)
    found = False
    for m in range(len(off)):
        if p.follows[m] == 1.0:
            rate = abs(S.space.rhs[0, n + m])
            found = found or rate > MOVING * largest * p.rows.lengths[m]
    kernels.copy(p.rates, off)
    return found


@jit
def choose_rows(table: Any, p: Impulse) -> int:
    """Switch rows off that depend on the others which hold; how many do not. Phi_y becomes that of
    these.
    """
    off = opened(table).space.off
    for m in range(len(off)):
        p.rows.group[m] = STAYS if p.off[m] == 0.0 else OUT
    count = take_rows(p.rows, STAYS, 0, EXACT)
    for m in range(len(off)):
        off[m] = 1.0 if p.off[m] != 0.0 or p.rows.group[m] == STAYS else 0.0
    evaluation.constrain(table)
    return count


@jit
def are_held(p: Impulse) -> bool:
    """Whether rows that were taken hold all unknowns without mass: the columns of Phi_q are
    independent there.
    """
    columns = p.columns
    kernels.clear_rows(columns.unit)
    for m in range(len(p.off)):
        # orthonormal rows of the same span
        if p.off[m] == 0.0 and p.rows.group[m] != STAYS:
            for k in range(len(p.light)):
                columns.unit[k, m] = p.rows.unit[m, p.light[k]]
    scale_rows(columns)
    for k in range(len(p.light)):
        columns.group[k] = STAYS
    return take_rows(columns, STAYS, 0, EXACT) == len(p.light)


@jit
def change_velocities(table: Any, p: Impulse) -> int:
    """Put the velocities of the state onto the rows that are on, whose Phi_y is current; 0, or
    SINGULAR.
    """
    S = opened(table)
    s, t = S.state, S.space
    n = len(s.x)
    kernels.copy(s.v, p.v)
    kernels.clear(p.change)
    p.loss[0] = 0.0
    closed = 0
    for m in range(len(t.off)):
        closed += 1 if t.off[m] == 0.0 else 0
    if closed == 0:
        return 0
    filtered = starting.has(p.flags, starting.FILTERED)
    rigid = factors.SOFT if starting.has(p.flags, starting.HELD) else factors.MASS
    if starting.factorise(table, factors.ELASTIC if filtered else rigid) != 0:
        return SINGULAR
    starting.find_rates(table, 0)
    for m in range(len(t.off)):
        p.rates[m] = -t.rhs[0, n + m]
    kernels.clear(t.f)
    if solve_for_rates(table, p) != 0:
        return SINGULAR
    kernels.copy(t.f, p.change)
    if filtered:
        # a bar that catches a mass keeps its energy within 5 % so, and loses 8 to 24 % with M d(0)
        # of the bar itself
        kernels.clear(t.f)
        kernels.add_operator(S.arrays.mass, p.change, t.f)
        for i in range(n):
            t.f[i] *= S.method.c * S.method.bh
        if solve_for_rates(table, p) != 0:
            return SINGULAR
        for i in range(n):
            p.change[i] = 2.0 * p.change[i] - t.f[i]
    for i in range(n):
        s.v[i] += p.change[i]
    p.loss[0] = kinetic_energy(table, p.v) - kinetic_energy(table, s.v)
    kernels.copy(s.v, p.v)
    return 0


@jit
def solve_for_rates(table: Any, p: Impulse) -> int:
    """rhs <- KKT^-1 (f, rates), with the forces f that are in rhs; 0, or 1 where that is none."""
    t = opened(table).space
    for m in range(len(p.rates)):
        t.rhs[0, len(t.f) + m] = p.rates[m]
    return starting.solve(table)


@jit
def kinetic_energy(table: Any, v: np.ndarray) -> float:
    """v . M v / 2 [J] of v (n,)."""
    S = opened(table)
    kernels.clear(S.space.f)
    kernels.add_operator(S.arrays.mass, v, S.space.f)
    return 0.5 * kernels.dot(v, S.space.f)


@jit
def share(table: Any, p: Impulse, count: int) -> None:
    """Multipliers of least norm, of the state and of what steps begin with, from those of the
    `count` independent rows alone.
    """
    S = opened(table)
    rows = p.rows
    m = len(rows.group)
    closed = 0
    for i in range(m):
        closed += 1 if p.off[i] == 0.0 else 0
    if closed == count:
        return
    find_weights(rows, count)
    for i in range(m):
        for j in range(i, m):
            total = 1.0 if i == j else 0.0
            # rows that do not depend on others are in no sum
            if rows.group[i] == STAYS and rows.group[j] == STAYS:
                total += kernels.dot(rows.shares[i, :count], rows.shares[j, :count])
            p.half[i, j - i] = total
    factors.factor_cholesky(S.work, p.half)
    spread(p, count, S.state.multipliers)
    spread(p, count, S.state.past[0])


@jit
def spread(p: Impulse, count: int, multipliers: np.ndarray) -> None:
    """Multipliers (m,) of least norm that are as much as those of the `count` independent rows
    alone.
    """
    rows = p.rows
    m = len(multipliers)
    for i in range(m):
        p.rates[i] = 0.0
        if rows.group[i] == STAYS:
            for k in range(count):
                p.rates[i] += rows.shares[i, k] * multipliers[rows.order[k]]
    factors.substitute(p.half, p.rates)
    for i in range(m):
        if rows.group[i] == STAYS:
            multipliers[i] = p.rates[i]
            for k in range(count):
                multipliers[rows.order[k]] -= rows.shares[i, k] * p.rates[i]
