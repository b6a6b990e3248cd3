r"""Velocities after a step of `stepping`: onto the derivatives of the joints.

Velocities put the next q'' onto the joints,

    Phi_q (v + h (1/2 - beta) a) + D1 + h (1/2 - beta) D2 + h^2 (1/6 - beta (1 + am - af)) D3 = 0,
    D_k = d^k Phi / dt^k - Phi_q d^k q / dt^k                                                                                   (4)

at the end of the step, by v <- v - [W^-1 Phi_q^T (Phi_q W^-1 Phi_q^T)^-1] (left side). Without (4)
the normal parts of v and a are carried on by a map with the triple eigenvalue -rho_inf, which a
rotation by w rad a step makes one of about -(rho_inf + 1.3 w): the motion explodes. (4) follows
from q1 = q(t + h) where v, q'' and dq''/dt satisfy the derivatives of Phi = 0: the joints'
positions then say nothing about a that is not so already. It changes v by O(h^3) in a step, so all
stays of second order, and reactions are of second order from the first step on, which begins on (4)
too. See docs/stability.md.

Source: Arnold, Bruels and Cardona, Numer. Math. 129 (2015) 149-179, doi 10.1007/s00211-014-0633-1
(errors of velocities normal to the joints, and of starts).
"""

from __future__ import annotations

from typing import Any

from ...core.compiling.jit import jit
from ...core.compiling.structs import invoke, routine
from ...systems import evaluation, kernels
from .step import FACTORISATIONS, opened

# beams come nowhere near it, at 0.5 and 4 ms any value does; a fast rigid pendulum, whose joints
# turn far between factorisations, errs by 9e-3 in its reaction where more is left, by 4e-5 with it
OLD = 0.01  #: part of (4) that old factors may leave


@routine
def find_drift(table: Any, _: int = 0) -> int:
    """Right-hand side of the velocities that settle on the joints.

        rhs = (0, r),    r what the accepted state is off (4)

    r stands in the trial multipliers as well; the trial v is overwritten.
    """
    S = opened(table)
    s, t, method, A = S.state, S.space, S.method, S.arrays
    # v differs by O(h^2) from Phi_q v + Phi_t = 0 on purpose: on that multipliers are of first
    # order
    n = len(s.x)
    lead = method.h * (0.5 - method.beta)
    t.leads[0], t.leads[1] = (
        lead,
        method.h * method.h * (1.0 / 6.0 - method.beta * (1.0 + method.am - method.af)),
    )
    for i in range(n):
        t.v[i] = s.v[i] + lead * s.a[i]
    # four products with the same rows, which are read once
    kernels.probe_paths(A.shown, A.probes_offset, s.x, t.v, s.v, s.acceleration, t.paths)
    kernels.clear(t.f)
    evaluation.find_drift(table)
    for k in range(len(t.multipliers)):
        # r is needed twice: for the direction of now, and to tell what the factors have left of it
        t.multipliers[k] = t.rhs[0, n + k]
    return 0


@routine
def settle(table: Any, _: Any) -> int:
    """Put the accepted velocities onto (4) with the factors that are there, or with new ones of the
    accepted state.
    """
    S = opened(table)
    # new factors at once where the old ones do not do: the reaction of a fast pendulum is right to
    # 4e-5 of its size, for 9e-3 where velocities were left as they were
    for attempt in range(2):
        settled = try_to_settle(table)
        # a second failure is no error: near a singular position (4) determines nothing, and the
        # motion goes on without
        if settled == 1 or attempt == 1:
            return 0
        # factors are those of the accepted state, not of the trial v that (4) was evaluated with
        restore(table)
        S.job.counters[FACTORISATIONS] += 1
        if invoke(S.doors.factorise, table, 0) != 0:
            # the step itself has converged: the next one factors anew, and reports what it finds
            S.work.kind[0] = 0
            return 0
    return 0


@jit
def try_to_settle(table: Any) -> int:
    """Put the accepted velocities onto (4) with the factors that are there; 1, or 0 where they are
    too old.
    """
    S = opened(table)
    find_drift(table)
    # W^-1 J^T alone: the front of rhs is zero, so that one of two applications of W^-1 is saved
    invoke(S.doors.solve, table, 1)
    turn(table)
    invoke(S.doors.solve, table, 0)
    return move_velocities(table)


@jit
def restore(table: Any) -> None:
    """The trial state of velocities and multipliers is the accepted one."""
    S = opened(table)
    # what `factorise` reads of the trial state and (4) has overwritten; positions and memory are
    # the accepted ones already
    for i in range(len(S.state.x)):
        S.space.v[i] = S.state.v[i]
    for k in range(len(S.state.multipliers)):
        S.space.multipliers[k] = S.state.multipliers[k]


@jit
def turn(table: Any) -> None:
    """rhs for the direction of the joints as they are now, from (d, mu) = KKT^-1 (0, r) with the
    joints J0 of the factors.

        W d' + J^T mu' = 0,    J d' = r
        KKT (d', .) = (- J^T mu, r + r - J d)    up to the square of J - J0
    """
    S = opened(table)
    t = S.space
    probes = S.arrays.shown
    y = S.space.paths[0]
    n = len(S.space.x)
    kernels.clear(t.g)
    kernels.add_combination(t.Jy, t.rhs[0, n:], t.g)
    # the room of the positions of probes, which nothing reads any more in this step
    kernels.clear(y)
    kernels.add_product(probes, 1.0, t.f, y)
    for k in range(len(t.multipliers)):
        # a product a row with probes in place of a new J in the unknowns
        t.rhs[0, n + k] = 2.0 * t.multipliers[k]
        for j in range(len(y)):
            t.rhs[0, n + k] -= t.Jy[k, j] * y[j]
    kernels.clear(t.f)
    kernels.add_transposed(probes, -1.0, t.g, t.f)


@routine
def move_velocities(table: Any, _: int = 0) -> int:
    """v -= d, the front of rhs, where Phi_q d is r; else the factors are too old, as near a
    singular position. 1 where it is.

    A change beyond v itself is left out as well: at a dead centre the joints do not determine it.
    """
    S = opened(table)
    s = S.state
    t = S.space
    norm = S.arrays.norm
    square, change, wanted, missed = 0.0, 0.0, 0.0, 0.0
    for i in range(len(s.x)):
        square += norm[i] * s.v[i] * s.v[i]
        change += norm[i] * t.f[i] * t.f[i]
    kernels.clear(t.g)
    # of the probe rows: Phi_q d without Phi_q in the unknowns
    kernels.add_product(S.arrays.shown, 1.0, t.f, t.g)
    for k in range(len(t.multipliers)):
        rest = t.multipliers[k]
        wanted += rest * rest
        for j in range(len(t.g)):
            rest -= t.Jy[k, j] * t.g[j]
        missed += rest * rest
    # in the sum over all rows: those that old factors meet well do not hide a share of r that they
    # miss
    if missed > OLD * OLD * wanted:
        return 0
    if change <= square:
        for i in range(len(s.x)):
            s.v[i] -= t.f[i]
    return 1
