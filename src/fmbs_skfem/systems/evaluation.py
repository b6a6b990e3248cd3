r"""Compiled evaluation of a system: its residual, its energy, its iteration matrix.

    R = c (M a + C v + K x + sum L^T phi(L x, L v) - Q) + Phi_q^T lambda,    Phi(y),  y = P x + y0                      (1)
    W += sum L^T phi' L

Elastic energy is a sum of terms, of which nothing is known here but the addresses of three routines
and of a record of arrays, on which they act. `Arrays` is one fixed type for full, reduced and
hyper-reduced systems: everything is compiled once. Routines read and write the `Space` of an
evaluation; W is a lower band (n, d + 1), band[j, i - j] = W[i, j], dense (n, n), or the entries of
a sparse pattern (1, z) in the coordinates of the cells.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..core.algebra.supernodes import Tree
from ..core.compiling.jit import jit
from ..core.compiling.structs import Integers, Matrix, Vector, fields, invoke, opener, routine
from . import kernels
from .forces import low_rank
from .forces.low_rank import LowRank
from .kernels import Csr, Operator, Pairs, Terms
from .terms.corotation import CorotationalTangent


class ElasticTerms(NamedTuple):
    """t terms of the elastic energy by address; 0 stands for a routine that a term does not have."""

    force: Integers  #: (t,) routines: f += L^T phi
    tangent: Integers  #: (t,) W += L^T phi' L, with damping times gh
    energy: Integers  #: (t,) 0 for loads that follow
    records: Integers  #: (t,) what these routines take beside the table of the evaluation
    dissipate: Integers  #: (t,) energy += power of damping, 0 for terms that read no velocities
    follow: Integers  #: numbers of the terms that are loads, see `work`
    owners: Integers  #: (t,) the elastic part that each is of
    damped: bool  #: whether one of them reads velocities
    holds: bool  #: whether the tangent of one of them takes stresses of another state, see `Space.holding`


class LiftTerm(NamedTuple):
    """What turns unknowns into coordinates of the cells, by address, see `terms.lifts`; no record
    (0) where there are no cells.
    """

    place: int
    scatter: int
    tangent: int
    record: int


class ConstraintTerms(NamedTuple):
    """Constraint rows by laws, by address, one record a law, see `connections.constraint_laws`."""

    constrain: Integers
    slopes: Integers
    drift: Integers
    records: Integers


class ForceTerms(NamedTuple):
    """Forces on probe rows by address, each routine with the records it acts on, see `forces`."""

    force: Integers
    records: Integers
    slopes: Integers
    sloped: Integers  #: records of these
    accept: Integers
    accepted: Integers  #: records of these
    energy: Integers
    stored: Integers  #: records of these
    judge: Integers
    judged: Integers  #: records of these
    damped: bool  #: whether one of them reads the rates of probe rows
    smooth: bool  #: whether derivatives of all of them jump nowhere


class Arrays(NamedTuple):
    """A system as plain arrays, the n unknowns in the order of its layout: one type for all
    systems.
    """

    elastic: ElasticTerms
    lift: LiftTerm
    mass: Operator
    damping: Operator
    stiffness: Operator
    dense: bool
    tree: Tree  #: of matrices in blocks, see `layouts`
    blocks: Csr  #: the pattern of their upper triangle; no rows in other storages
    probes: Csr  #: (j, n)
    shown: (
        Csr  #: the same without rows that only forces read, by themselves and where they need them
    )
    probes_offset: Vector
    terms: Terms
    laws: ConstraintTerms
    forces: ForceTerms
    pairs: Pairs
    load: Vector  #: (n,) constant generalised force [N]
    corotation: CorotationalTangent  #: of reduced bodies in the plane
    norm: Vector  #: (n,) weights of the unknowns in the norm of a displacement, sqrt(sum norm_n x_n^2) [m]


#: rows of the gradients of a space: of the last evaluation, and of that of the accepted state
NOW, ACCEPTED = range(2)
EXACT = -1  #: tangents take the stresses of the state itself, not those of row ACCEPTED in one of the ways of a law


class Space(NamedTuple):
    """Where routines read a state and write what they find: n unknowns, m constraints, j probe
    rows, p coordinates of cells.
    """

    x: Vector
    v: Vector
    acceleration: Vector  #: q''
    multipliers: Vector  #: (m,) c times the physical ones
    signals: (
        Vector  #: (s,) values of all signals, and of their derivatives where constraints read them
    )
    off: Vector  #: (m,) 1 for rows that do not hold, whose multipliers are zero, 0 for the others
    memory: Vector  #: (l,) what forces keep of the last accepted state, see `forces`
    last: Vector  #: (n,) x when `room` was filled, not a number before
    moved: Vector  #: (2,) Euclidean and largest distance of x from `last`
    room: Vector  #: (b,) what forces have found out about the state `last`: nothing but time depends on it
    c: Vector  #: (1,) factor of forces
    gh: Vector  #: (1,) factor of damping in W
    energy: Vector  #: (1,) [J]
    impulse: Vector  #: (2,) changes of speed by forces, a second of a step, over those allowed; of those that began or ended [m/s2]
    f: Vector  #: (n,) forces, the front of `rhs`
    rhs: Matrix  #: (1, n + m) residual
    W: Matrix
    entries: Vector  #: (z,) where tangents of cells go: all of W, or the lower triangle of K in `lifts`, zeros before and after
    turning: Integers  #: (1,) 1 where terms may turn the tangents that they assembled last
    turned: Vector  #: what they keep for it, see `turned_tangents`
    gradients: Matrix  #: (2, g) of cells and points that hold stresses, and their rates of damped ones: rows NOW and ACCEPTED
    holding: Integers  #: (1,) EXACT, or in which way tangents take the stresses of row ACCEPTED, see `laws.call_modulus`
    way: Vector  #: (n,) of the last step
    span: Vector  #: (1,) its time [s]
    y: Vector  #: (j,) probe rows
    rates: Vector  #: (j,) their rates, current where a force reads them
    g: Vector  #: (j,) forces on them
    H: Vector  #: second derivatives on pairs of them
    paths: Matrix  #: (4, j) rows of `kernels.drift`
    leads: Vector  #: (2,) its factors of D2 and D3
    Jy: Matrix  #: (m, j) dPhi/dy
    cell_x: Vector  #: (p,) coordinates of the cells
    cell_v: Vector  #: (p,) their rates, current where a term reads them
    cell_f: Vector  #: (p,) forces on them
    work: Matrix  #: (3, w) three rooms of a term while it runs
    low: LowRank  #: second derivatives on rows that are others in every state


def space_of(**parts: np.ndarray) -> Space:
    """A space of these arrays alone, by the names of its fields, for routines that read no others;
    all other fields are empty.
    """
    none = {
        name: np.zeros((0,) * kind.ndim, kind.item) for name, kind in fields(Space) if name != "low"
    }
    return Space(**(none | parts), low=low_rank.room([]))


class Evaluation(NamedTuple):
    """A system with the space of its evaluation; other structs for compiled code begin with these
    two.
    """

    space: Space
    arrays: Arrays


evaluation = opener(Evaluation)


@jit
def invoke_all(routines: np.ndarray, records: np.ndarray, table: Any) -> int:
    """Call routines by address (t,), each with its record (t,) but for those that are 0; the sum of
    what they return.
    """
    total = 0
    # by address: what a term is does not matter here, and a first run compiles the terms of its
    # model alone
    for k in range(len(records)):
        if routines[k] != 0:
            total += invoke(routines[k], table, records[k])
    return total


@jit
def place_cells(table: Any) -> None:
    """Coordinates of the cells and, where a term reads them, their rates; no forces yet."""
    lift = evaluation(table).arrays.lift
    # models of rigid bodies and of points in the unknowns have no cells
    if lift.record != 0:
        invoke(lift.place, table, lift.record)


@jit
def following_forces(table: Any) -> None:
    """Forces of the terms that are loads, with their sign in (1): minus the load.

        f = sum L^T phi(L x)

    f (n,) [N].
    """
    E = evaluation(table)
    A, s = E.arrays, E.space
    kernels.clear(s.f)
    # most models have no loads that follow: their cells are not placed for them
    if len(A.elastic.follow) == 0:
        return
    place_cells(table)
    for k in A.elastic.follow:
        invoke(A.elastic.force[k], table, A.elastic.records[k])
    if A.lift.record != 0:
        invoke(A.lift.scatter, table, A.lift.record)


@routine
def elastic_forces(table: Any, _: int = 0) -> int:
    """Elastic forces in the state of the space.

        f = sum L^T phi(L x, L v)

    f (n,) [N]; 0, or the number of terms that failed.
    """
    E = evaluation(table)
    A, s = E.arrays, E.space
    kernels.clear(s.f)
    # coordinates once for all terms of all bodies: blocks of cells read them, none computes them
    place_cells(table)
    failed = invoke_all(A.elastic.force, A.elastic.records, table)
    # one scatter for all terms, whose forces stand side by side in the coordinates of the cells
    if A.lift.record != 0:
        invoke(A.lift.scatter, table, A.lift.record)
    return failed


@routine
def evaluate(table: Any, _: int = 0) -> int:
    """Residual (1) in the state of the space, (1, n + m); 0, or the number of terms that failed.

        rhs = (R, Phi),    R = c (M a + C v + K x + sum L^T phi(L x, L v) - Q) + Phi_q^T lambda

    y, g and dPhi/dy become current; g then holds what R has of probe rows, - c F + Phi_y^T lambda.
    """
    failed = elastic_forces(table)
    E = evaluation(table)
    A = E.arrays
    s = E.space
    c = E.space.c[0]
    # into f, where elastic forces are: no array of a force of its own and no sum of them
    kernels.add_operator(A.mass, s.acceleration, s.f)
    kernels.add_operator(A.damping, s.v, s.f)
    kernels.add_operator(A.stiffness, s.x, s.f)
    for i in range(len(s.f)):
        # times c = beta h^2: residual, matrix and multipliers keep their size as h falls (condition
        # below 2e4 for up to 1e20)
        s.f[i] = c * (s.f[i] - A.load[i])
    # joints and forces on places alone read probe rows: systems without go past all of it
    if len(s.y) > 0:
        failed += read_loads(table)
        constrain(table)
        for j in range(len(s.y)):
            # forces and reactions are added on the probe rows, a few dozen, and go to the unknowns
            # by one product
            total = -c * s.g[j]
            for m in range(len(s.multipliers)):
                total += s.Jy[m, j] * s.multipliers[m]
            s.g[j] = total
        kernels.add_transposed(A.probes, 1.0, s.g, s.f)
    return failed


@jit
def constrain(table: Any) -> None:
    """Gaps Phi (m,), behind the forces in rhs, and dPhi/dy (m, j), with current y.

    In rows that are off lambda = 0 stands for Phi = 0.
    """
    E = evaluation(table)
    A, s = E.arrays, E.space
    # polynomials of degree two in one loop over their terms, all other joints by address
    kernels.constrain(A.terms, s.y, s.signals, s.rhs[0, len(s.f) :], s.Jy)
    invoke_all(A.laws.constrain, A.laws.records, table)
    # released rows stay in the system, so that sizes and compiled code are those of before an event
    for m in range(len(s.off)):
        if s.off[m] != 0.0:
            kernels.clear(s.Jy[m])
            s.rhs[0, len(s.f) + m] = s.multipliers[m]


@routine
def probe_constraints(table: Any, _: Any) -> int:
    """As `constrain`, in the state of the space, whose probe rows are read first."""
    # of a state by itself: a step has read them for its forces
    read_probes(table)
    constrain(table)
    return 0


@jit
def find_drift(table: Any) -> None:
    """Rates of the constraints (m,) behind the forces in rhs, as of `kernels.drift`.

        Phi_y z + D1 + second D2 + third D3

    0 in rows that are off.
    """
    E = evaluation(table)
    A, s = E.arrays, E.space
    kernels.drift(A.terms, s.paths, s.signals, s.leads[0], s.leads[1], s.rhs[0, len(s.f) :])
    invoke_all(A.laws.drift, A.laws.records, table)
    # what a released row is off says nothing of velocities
    for m in range(len(s.off)):
        if s.off[m] != 0.0:
            s.rhs[0, len(s.f) + m] = 0.0


@jit
def read_probes(table: Any) -> None:
    """Probe rows (j,) and, where a force reads them, their rates; how far x is from where forces
    last looked around.

        y = P x + y0,    y' = P v
    """
    E = evaluation(table)
    A, s = E.arrays, E.space
    # without rows that one contact reads by itself: beams and plates have hundreds of them, nearly
    # all far from what they may touch
    kernels.affine(A.shown, A.probes_offset, s.x, s.y)
    # a second product with all rows, for dampers and friction alone
    if A.forces.damped:
        kernels.clear(s.rates)
        kernels.add_product(A.shown, 1.0, s.v, s.rates)
    if len(s.room) > 0:
        # one bound for all contacts: a point that cannot have come near since is not looked at (far
        # contacts cost 17 % of a run)
        s.moved[0], s.moved[1] = kernels.distances(s.x, s.last)


@jit
def read_loads(table: Any) -> int:
    """Probe rows y (j,), and g (j,) the forces on them [N per unit of the row]; 0, or the number of
    forces that failed.
    """
    E = evaluation(table)
    read_probes(table)
    # forces add to g: several may act on one row
    kernels.clear(E.space.g)
    return invoke_all(E.arrays.forces.force, E.arrays.forces.records, table)


@jit
def store_energies(table: Any) -> None:
    """Add all potentials E of forces to the energy [J], with current y: no force of a potential is
    left in g (j,).

        energy += E,    g += dE/dy
    """
    A = evaluation(table).arrays
    # energies are asked for at stored states and where signals change, so that they are routines
    # apart from forces
    invoke_all(A.forces.energy, A.forces.stored, table)


@routine
def take_over(table: Any, _: int = 0) -> int:
    """Forces keep what they need of the state of the space, which is accepted: its memory (l,)
    becomes that of this state.
    """
    E = evaluation(table)
    # most forces remember nothing: their probes are not read a second time in a step
    if len(E.arrays.forces.accepted) > 0:
        read_probes(table)
        invoke_all(E.arrays.forces.accept, E.arrays.forces.accepted, table)
        # from here on distances of contacts are bounded by the motion since
        kernels.copy(E.space.x, E.space.last)
    return 0


@jit
def find_impulse(table: Any) -> float:
    """How fast forces that begin and end change speeds, since the last accepted state, over what
    they allow a step [m/s2].

    It is that of the state of the space, before `take_over`; 0 where no force judges.
    """
    E = evaluation(table)
    kernels.clear(E.space.impulse)
    # contacts, stops and ropes alone begin and end
    if len(E.arrays.forces.judged) > 0:
        read_probes(table)
        invoke_all(E.arrays.forces.judge, E.arrays.forces.judged, table)
    return E.space.impulse[0]


@jit
def add_change(s: Space, force: float, last: float, share: float) -> None:
    """impulse += the change of a force since the last accepted state, whose force was `last`; apart
    where it has begun or ended.
    """
    change = abs(force - max(last, 0.0)) * share
    s.impulse[0] += change
    # both, or what is lost where forces begin is not what is won where they end: a ball between
    # walls would gain 1e-4 at each
    if (last > 0.0) != (force > 0.0):
        s.impulse[1] += change


@routine
def sum_tangents(table: Any, _: int = 0) -> int:
    """Elastic tangent, derivatives by rates times gh [1/s]; 0, or the number of terms that failed.

        W += sum L^T phi' L

    Reduced systems assemble K of their cells first and add V^T K V, see `terms.lifts`.
    """
    A = evaluation(table).arrays
    place_cells(table)
    # terms of full systems write into W, those of reduced ones into K, which the lift then
    # multiplies
    failed = invoke_all(A.elastic.tangent, A.elastic.records, table)
    if A.lift.record != 0:
        invoke(A.lift.tangent, table, A.lift.record)
    return failed


@routine
def part_tangent(table: Any, part: Any) -> int:
    """W = the elastic tangent of one part alone, as of `sum_tangents`, of a dense system; 0, or the
    number of terms that failed.
    """
    E = evaluation(table)
    A = E.arrays
    kernels.clear_rows(E.space.W)
    place_cells(table)
    failed = 0
    for k in range(len(A.elastic.records)):
        if A.elastic.owners[k] == part:
            failed += invoke(A.elastic.tangent[k], table, A.elastic.records[k])
    if A.lift.record != 0:
        invoke(A.lift.tangent, table, A.lift.record)
    return failed


@routine
def sum_energies(table: Any, _: int = 0) -> int:
    """Energy of all elastic terms in the state of the space [J].

        sum U(L x)

    without constant springs and loads that follow.
    """
    E = evaluation(table)
    A, s = E.arrays, E.space
    s.energy[0] = 0.0
    place_cells(table)
    # loads that follow have none: -p V depends on the origin wherever a rim is free
    invoke_all(A.elastic.energy, A.elastic.records, table)
    return 0


@jit
def slopes(table: Any) -> None:
    """Second derivatives H (h,) on pairs of probe rows and of low rank, with current y and y'.

        H = - c dF/dy - c gh dF/dy' + d(Phi_y^T lambda)/dy

    c is the factor of forces, see the module.
    """
    E = evaluation(table)
    A, s = E.arrays, E.space
    kernels.clear(s.H)
    # derivatives of low rank are on the pieces that touch in this state
    s.low.used[0] = 0
    invoke_all(A.forces.slopes, A.forces.sloped, table)
    kernels.constraint_slopes(A.terms, s.y, s.signals, s.multipliers, s.H)
    invoke_all(A.laws.slopes, A.laws.records, table)


@routine
def probe_slopes(table: Any, _: Any) -> int:
    """As `slopes`, in the state of the space, whose probe rows are read first."""
    # of a state by itself, as above
    read_probes(table)
    slopes(table)
    return 0


class Samples(NamedTuple):
    """States of a motion, s of them, with the space that each is placed in and the results `out`
    (s, ...).
    """

    space: Space
    arrays: Arrays
    order: Integers  #: (n,) which of the unknowns in x, v and a, those of the system, are those of the space
    x: Matrix
    v: Matrix
    a: Matrix
    multipliers: Matrix  #: physical
    signals: Matrix
    before: Matrix  #: signals a little earlier, and later
    after: Matrix
    span: Vector  #: time between these [s]
    memory: Matrix
    out: Matrix  #: results


samples_of = opener(Samples)


@jit
def place_sample(table: Any, k: int) -> None:
    """The space in the state of sample k, with c = 1: x, v, a (n,), multipliers (m,), memory (l,)
    and signals.
    """
    S = samples_of(table)
    s = S.space
    for i in range(len(S.order)):
        n = S.order[i]
        s.x[i], s.v[i], s.acceleration[i] = S.x[k, n], S.v[k, n], S.a[k, n]
    kernels.copy(S.multipliers[k], s.multipliers)
    kernels.copy(S.memory[k], s.memory)
    kernels.copy(S.signals[k], s.signals)
    # forces in newtons and physical multipliers: no step stands behind a stored state
    s.c[0] = 1.0


@routine
def residuals(table: Any, _: Any) -> int:
    """out (s, n) = R of (1) [N] of all samples, constraint forces included."""
    S = samples_of(table)
    for k in range(len(S.x)):
        place_sample(table, k)
        # all states in one call: Python is left once for hundreds of them
        evaluate(table)
        kernels.copy(S.space.f, S.out[k])
    return 0


@routine
def pushes(table: Any, _: Any) -> int:
    """out (s, j) = forces on the probe rows of all samples [N per unit of the row]."""
    S = samples_of(table)
    for k in range(len(S.x)):
        place_sample(table, k)
        # friction of what slides reads which rows hold it
        read_probes(table)
        constrain(table)
        # without elastic forces, which outputs of loads do not ask for
        read_loads(table)
        kernels.copy(S.space.g, S.out[k])
    return 0


@routine
def follow(table: Any, _: Any) -> int:
    """Memory (s, l) that forces have in all samples, one after the other, from that of the space."""
    S = samples_of(table)
    for k in range(len(S.x)):
        for i in range(len(S.order)):
            S.space.x[i], S.space.v[i] = S.x[k, S.order[i]], S.v[k, S.order[i]]
        # one after the other: what sticks at a state depends on all before it
        take_over(table)
        kernels.copy(S.space.memory, S.memory[k])
    return 0


@routine
def turn(table: Any, _: Any) -> int:
    """out (s, 3 l) = angles, known but for whole turns, and their differences to those `span` later
    and earlier, from a and v.
    """
    S = samples_of(table)
    s = S.space
    l = S.memory.shape[1]
    for k in range(len(S.x)):
        # angles from zero, known but for whole turns, which `angles.continuous` counts
        kernels.clear(s.memory)
        for part in range(3):
            # neighbours by Taylor's formula from a and v, since stored states may be many turns
            # apart
            h = (0.0, S.span[k], -S.span[k])[part]
            for i in range(len(s.x)):
                n = S.order[i]
                s.x[i] = S.x[k, n] + h * S.v[k, n] + 0.5 * h * h * S.a[k, n]
                s.v[i] = S.v[k, n] + h * S.a[k, n]
            take_over(table)
            kernels.copy(s.memory, S.out[k, part * l : (part + 1) * l])
            kernels.copy(S.out[k, :l], s.memory)
    return 0
