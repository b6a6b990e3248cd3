r"""The work of all that has no potential: forces and damping on their way, and what histories do at
a standstill.

    d(T + V)/dt = F . v + dG/dt|_(y, lambda),    F = P^T g + f_p - f_d,    G(y, lambda, s) = E(y, s) + lambda . Phi(y, s)

g are forces on probe rows without those of potentials E, f_p pressures that follow, f_d damping, s
histories: a drive works by lambda . Phi_t, a history in a potential by what it changes of the
energy that is stored. In a step, and over all of them,

    W += (F0 + F1) . (x1 - x0) / 2 + (G(y0, l0, s1) - G(y0, l0, s0) + G(y1, l1, s1) - G(y1, l1, s0)) / 2

The way that the step has gone, not its speeds, keeps this right where damping is stiffer than the
step resolves: what it takes of a motion m v0^2 / 2 in one step is F0 . (x1 - x0) / 2, and h F0 . v0
/ 2 would be any multiple of that. Damping of elastic terms takes

    W -= h sum w u'. C(u) u',    C the damping modulus,

with the means of the gradients u and of their rates where forces were evaluated last in this step
and in the one before: that costs no evaluation of forces, and no rotation makes heat.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.compiling.jit import jit
from ..core.compiling.structs import routine
from . import kernels
from .evaluation import (
    constrain,
    elastic_forces,
    evaluation,
    following_forces,
    invoke_all,
    place_sample,
    read_loads,
    read_probes,
    samples_of,
    store_energies,
    sum_energies,
)


@jit
def idle(table: Any) -> bool:
    """Whether F = 0 in all states: no forces on probe rows, no loads that follow, no damping but
    that of elastic terms.
    """
    A = evaluation(table).arrays
    # of the storages of a matrix the one in use has numbers
    undamped = not A.damping.full and len(A.damping.rows.indptr) < 2 and len(A.damping.offsets) == 0
    return undamped and len(A.forces.records) == 0 and len(A.elastic.follow) == 0


@jit
def find_forces(table: Any) -> None:
    """f = F (n,) [N] in the state of the space but for damping of elastic terms; potentials of
    forces are added to its energy.

        F = P^T g + f_p - C v

    with forces g on probe rows without those of potentials, and pressures f_p.
    """
    E = evaluation(table)
    A, s = E.arrays, E.space
    # it clears f, to which all others add
    following_forces(table)
    kernels.add_operator(A.damping, s.v, s.f)
    for i in range(len(s.f)):
        s.f[i] = -s.f[i]
    if len(A.forces.records) > 0:
        # forces with a potential come into g, and go out again by dE/dy: each is asked once, and no
        # list says which they are
        read_loads(table)
        store_energies(table)
        kernels.add_transposed(A.probes, 1.0, s.g, s.f)


@jit
def find_damping(table: Any) -> None:
    """Damping of elastic terms.

        f = f(x, v) - f(x, 0)

    in the state of the space.
    """
    s = evaluation(table).space
    # a difference of whole forces, for reports: the step itself takes `find_heat`
    v = s.v.copy()
    elastic_forces(table)
    damped = s.f.copy()
    kernels.clear(s.v)
    elastic_forces(table)
    for i in range(len(v)):
        s.f[i] = damped[i] - s.f[i]
    kernels.copy(v, s.v)


@jit
def find_heat(table: Any, h: float) -> float:
    """What elastic terms have dissipated in the last step, of h [s], that has led to the state of
    the space [J].

        h sum w u'. C(u) u'

    with means of gradients and rates of the last evaluation in this step and in the one before.
    """
    E = evaluation(table)
    A, s = E.arrays, E.space
    # means of both ends, so that a rigid rotation has no rate of strain
    s.energy[0], s.span[0] = 0.0, h
    invoke_all(A.elastic.dissipate, A.elastic.records, table)
    return h * s.energy[0]


@jit
def held(table: Any, signals: np.ndarray) -> float:
    """G [J] of other values of the signals (s,), which the space takes over, with current y and c
    times the multipliers.
    """
    s = evaluation(table).space
    for k in range(len(signals)):
        s.signals[k] = signals[k]
    # energies of springs with histories, and lambda . Phi of drives: what both change is work
    s.energy[0] = 0.0
    store_energies(table)
    constrain(table)
    return s.energy[0] + kernels.dot(s.multipliers, s.rhs[0, len(s.f) :]) / s.c[0]


@jit
def changed(table: Any, before: np.ndarray, after: np.ndarray) -> float:
    """What a change of the signals (s,) from `before` to `after` changes of G [J].

        G(y, lambda, s) = E + lambda . Phi

    It is that in the state of the space, which keeps the signals `after`.
    """
    read_probes(table)
    # `after` last: the space keeps its signals
    earlier = held(table, before)
    return held(table, after) - earlier


@routine
def forces(table: Any, _: Any) -> int:
    """f = F (n,) [N] in the state of the space but for damping of elastic terms, of which the
    gradients become current.

    A routine for the table of an evaluation: as `find_forces`.
    """
    # at a start no evaluation has left gradients yet
    if evaluation(table).space.gradients.shape[1] > 0:
        elastic_forces(table)
    find_forces(table)
    return 0


@routine
def survey(table: Any, _: Any) -> int:
    """out (s, 3) = kinetic energy, that of strains [J], and the power of drives, other loads and
    damping [W], which is left out where there are two columns.

    The potential E(y, h) of a force counts as stored; what its histories h change of it is power,
    too.
    """
    S = samples_of(table)
    A, s = S.arrays, S.space
    # half of the time, for nothing where steps have summed the work
    power = S.out.shape[1] > 2
    for k in range(len(S.x)):
        place_sample(table, k)
        kernels.clear(s.f)
        kernels.add_operator(A.mass, s.v, s.f)
        S.out[k, 0] = 0.5 * kernels.dot(s.v, s.f)
        sum_energies(table)
        if power or len(A.forces.records) > 0:
            find_forces(table)
        S.out[k, 1] = s.energy[0]
        if not power:
            continue
        S.out[k, 2] = kernels.dot(s.v, s.f) + changed(table, S.before[k], S.after[k]) / S.span[k]
        if A.elastic.damped:
            find_damping(table)
            S.out[k, 2] -= kernels.dot(s.v, s.f)
    return 0
