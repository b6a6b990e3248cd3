"""A System as the arrays that compiled code reads, with the unknowns in an order of small
bandwidth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from threading import get_ident
from typing import Any

import numpy as np
from scipy.sparse import csr_array, diags_array

from ..core.algebra.linalg import Array, as_csr, is_sparse
from ..core.compiling.structs import Callback, packed
from ..core.storage import container
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from . import evaluation, layouts
from .connections import constraint_laws
from .connections.constraint_laws import Constraint
from .evaluation import (
    ACCEPTED,
    EXACT,
    NOW,
    Arrays,
    ConstraintTerms,
    ElasticTerms,
    Evaluation,
    Samples,
    Space,
)
from .forces import low_rank
from .forces import on_rows as attachments
from .forces.on_rows import Force, Place
from .kernels import Csr, Operator, Pairs, Terms
from .layouts import Layout, Pieces, Storage
from .matrices import constant, permuted, triple
from .measures.angles import continuous
from .prepared import Prepared, prepare, remembered
from .system import Constraints, System
from .terms import cells, corotation, lifts, sparse, turning
from .terms import elastic as storages
from .terms.elastic import Lifts, Piece, Setting, Targets, Term

# a start reads seven tables of up to ten instants: half of FEW, or a quarter of INSTANTS, finds
# them anew at every start
#: instants whose signals are remembered together, and how many tables of them
FEW, INSTANTS = (
    10,
    32,
)
NEARBY = 1e-4  #: distance of the states that rates of angles are taken from, over the time between two stored states


@dataclass(frozen=True)
# unknowns are permuted once: residual, matrix and factors then run over rows that stand side by
# side
class Compiled:
    """Arrays of a system with its unknowns permuted: compiled x = x[order].

    It holds one space (`evaluation.Space`), which evaluations overwrite: a thread needs a model of
    its own, see `compile_system`. Functions of this module take and give arrays in the order of the
    system, unless they say otherwise.
    """

    system: System
    arrays: Arrays
    terms: tuple[Term, ...]  #: what the addresses in `arrays.elastic` belong to
    owners: np.ndarray  #: (t,) number of the elastic part of every term
    lift: Piece | None  #: what the addresses in `arrays.lift` belong to
    laws: tuple[Constraint, ...]  #: what the addresses in `arrays.laws` belong to
    forces: tuple[Force, ...]  #: what the addresses in `arrays.forces` belong to
    pairs: np.ndarray  #: (h, 2) probe rows with second derivatives
    layout: Layout
    pattern: sparse.Pattern | None  #: of the iteration matrix where it is sparse

    @property
    def order(self) -> np.ndarray:
        """(n,) the unknown at every place."""
        return self.layout.order

    @property
    def constraints(self) -> int:
        """Number m of constraint rows."""
        return len(self.system.constraints.names)

    @property
    def pieces(self) -> tuple[Piece, ...]:
        """All that is called by address."""
        return (*self.terms, *((self.lift,) if self.lift else ()), *self.laws, *self.forces)

    def check(self) -> None:
        """Raise what went wrong in terms and forces that are functions of Python: compiled code
        passes no exceptions.
        """
        # an exception cannot pass compiled code: a term keeps it, and it is raised where Python
        # goes on
        for one in self.callbacks:
            one.check()

    @cached_property
    def callbacks(self) -> list[Callback]:
        """Functions of Python in terms and forces: of most models none, whose runs look for them at
        every step that they are given.
        """
        pieces = (*self.terms, *self.forces)
        return [one for piece in pieces for one in piece.callbacks]

    @property
    def memory(self) -> np.ndarray:
        """What forces keep at the start (l,)."""
        return np.concatenate([np.zeros(0), *(force.memory for force in self.forces)])

    @property
    def remembering(self) -> Iterator[tuple[Any, Force, slice]]:
        """The forces of the system, what they are here, and where in the memory (l,) they keep
        theirs.
        """
        last = 0
        for source, force in zip(self.system.loads.forces, self.forces, strict=True):
            first = last
            last = last + len(force.memory)
            yield source, force, slice(first, last)

    @cached_property
    def evaluation(self) -> tuple[Evaluation, np.ndarray]:
        """A space for this model, and the table of both for routines."""
        # apart from those of steps, so that outputs of a run in progress leave its trial state
        # alone
        found = Evaluation(space(self), self.arrays)
        return found, packed(found)


def space(model: Compiled) -> Space:
    """Space of an evaluation at rest, with a signal table of one instant and no factor of forces (c
    = 1, gh = 0).

    x, v, multipliers are zero, the memory of forces is that of the start; in the order of the
    model.
    """
    A = model.arrays
    n = model.system.size
    m = model.constraints
    j = len(model.arrays.probes_offset)
    rhs, W = (
        np.zeros((1, n + m)),
        np.zeros((1, len(model.pattern.indices)) if model.pattern else A.mass.store.shape),
    )
    coordinates, entries, room = lifts.needs(model.lift)
    return Space(
        x=np.zeros(n),
        v=np.zeros(n),
        acceleration=np.zeros(n),
        multipliers=np.zeros(m),
        signals=np.zeros(4 * len(model.system.signals)),
        off=np.zeros(m),
        memory=model.memory,
        # no distance from NaN is small: the first look of a contact is at all points
        last=np.full(n, np.nan),
        moved=np.zeros(2),
        room=np.zeros(sum(force.room for force in model.forces)),
        c=np.ones(1),
        gh=np.zeros(1),
        energy=np.zeros(1),
        impulse=np.zeros(2),
        f=rhs[0, :n],
        rhs=rhs,
        W=W,
        entries=W.reshape(-1) if entries is None else np.zeros(entries),
        turning=np.zeros(1, np.int64),
        holding=np.full(1, EXACT),
        turned=np.zeros(sum(term.turned for term in model.terms)),
        gradients=np.zeros((2, sum(term.kept for term in model.terms))),
        way=np.zeros(n),
        span=np.ones(1),
        y=np.zeros(j),
        rates=np.zeros(j),
        g=np.zeros(j),
        H=np.zeros(A.pairs.size),
        paths=np.zeros((4, j)),
        leads=np.zeros(2),
        Jy=np.zeros((m, j)),
        cell_x=np.zeros(coordinates),
        cell_v=np.zeros(coordinates),
        cell_f=np.zeros(coordinates),
        # terms run one after another in one room, as large as the largest needs: it stays in the
        # cache
        work=np.zeros((3, max([1, room, *(term.work for term in model.terms)]))),
        low=low_rank.room([force.low for force in model.forces]),
    )


@checked
def compile_system(system: System) -> Compiled:
    """A system for compiled code, which it remembers, one for every thread: each has its own space.

    Systems of `layouts.WIDE` unknowns or more are too large to be remembered, and are made anew by
    every call.
    """
    # a run of a wide system needs the memory that a remembered pattern would take
    if system.size >= layouts.WIDE:
        return flatten(system)
    # several studies of one system compile it once; two threads in one space would overwrite each
    # other
    return remembered(
        system, (get_ident(), layouts.DENSE, layouts.WIDE, layouts.BAND), lambda: flatten(system)
    )


def flatten(system: System) -> Compiled:
    """Choose order and storage, and write a system as arrays."""
    parts = split(system)
    (constraints, laws, pushing, pairs) = attached(system)
    layout = layouts.chosen(system, parts, pairs, any(force.skew for force in pushing))
    order = layout.order
    large = layout.storage is Storage.SPARSE
    local = [storages.couplings(one) for one in parts.storages]
    reduced = isinstance(parts.matrix, np.ndarray)
    # K of a reduced model is sparse in the coordinates of the cells, and has a pattern as large
    # models have
    there = large or (reduced and len(parts.offset) > 0)
    pattern = (
        sparse.pattern(len(parts.offset), local, parts.matrix if large else None) if there else None
    )
    lift = lifts.piece(
        parts.matrix if reduced else triple(permuted(parts.matrix, order)),
        parts.offset,
        local,
        pattern,
    )

    def targets(local: np.ndarray) -> Targets:
        return pattern.targets(local) if pattern else cells.targets(local, parts.matrix, layout)

    found = compile_terms(system, parts, targets)
    # systems of one structure, as of a family, share what their parts share: more than half of a
    # call of 1500 reduced steps was preparation
    known = prepare(system) if system.size < layouts.WIDE else Prepared()

    def operator(name: str, A: Array) -> Operator:
        def make() -> Operator:
            moved = permuted(A, order, True)
            return constant(moved, layout.store(A), layout.dense, layout.by_rows, system.dim)

        return known.find(name, (A, layout), make)

    def probes() -> tuple[Csr, Csr]:
        rows = permuted(system.probes.matrix, order)
        found = triple(rows)
        return found, triple(without(rows, alone)) if len(alone) else found

    turns = turning.turning_of(system)
    # rows that one force reads by itself, when something is near, are left out of the product of
    # every step
    alone = np.array([row for force in pushing for row in force.alone], dtype=np.int64)
    read, shown = known.find("probes", (system.probes.matrix, layout, alone.tobytes()), probes)
    arrays = Arrays(
        elastic=sum_of(found, parts.owners),
        lift=lifts.addressed(lift),
        mass=operator("mass", system.mass),
        damping=operator("damping", system.damping),
        stiffness=operator("stiffness", system.stiffness),
        dense=layout.dense,
        tree=layout.tree,
        blocks=known.find("blocks", (layout,), lambda: triple(layout.pattern)),
        probes=read,
        shown=shown,
        probes_offset=np.ascontiguousarray(system.probes.offset),
        terms=constraints,
        laws=ConstraintTerms(*addresses(laws)),
        forces=attachments.addressed(pushing),
        pairs=Pairs(
            np.ascontiguousarray(pairs[:0] if large else pairs),
            len(pairs),
            any(force.skew for force in pushing),
        ),
        load=np.ascontiguousarray(system.loads.constant[order]),
        corotation=turning.room(system, turns),
        norm=np.ascontiguousarray(system.metric.diagonal()[order] / system.weight),
    )
    model = Compiled(
        system,
        arrays,
        tuple(found),
        parts.owners,
        lift,
        laws,
        pushing,
        pairs,
        layout,
        pattern if large else None,
    )
    # tangents at four angles can be compared only when all else is compiled
    if turns:
        alike = turning.fill(model.evaluation[1])
        model.check()
    if turns and not alike:
        model = replace(model, arrays=arrays._replace(corotation=corotation.nothing(system.size)))
    return model


def compile_terms(
    system: System, parts: Pieces, targets: Callable[[np.ndarray], Targets]
) -> list[Term]:
    """The elastic terms of all pieces, each with its places in what a space keeps of gradients and
    tangents.
    """
    found = list[Term]()
    for one, owner in zip(parts.storages, parts.owners, strict=True):
        kept, turned = sum(term.kept for term in found), sum(term.turned for term in found)
        term = storages.compile_term(
            one, Setting(system.dim, system.elastic[owner].beta, targets, kept, turned)
        )
        found.append(replace(term, follows=one.law.follows, holds=one.law.holds and term.kept > 0))
    return found


def without(rows: Array, left_out: np.ndarray) -> csr_array:
    """Rows (j, n) of which those with the numbers `left_out` (i,) are empty."""
    kept = np.ones(rows.shape[0])
    kept[left_out] = 0.0
    found = csr_array(diags_array(kept) @ rows)
    # empty rows cost a product nothing, zeros would be multiplied
    found.eliminate_zeros()
    return found


def split(system: System) -> Pieces:
    """All elastic storages of a system in pieces."""
    places = Lifts(system.lift)
    found = list[Any]()
    owners = list[int]()
    for number, elastic in enumerate(system.elastic):
        # blocks that stay in the cache, see `cells.BLOCK` and `points.ROOM`
        pieces = storages.split(elastic.gather, places)
        found += pieces
        owners += [number] * len(pieces)
    return Pieces(*places.whole(), tuple(found), np.array(owners, dtype=np.int64))


def sum_of(found: Sequence[Term], owners: np.ndarray) -> ElasticTerms:
    """Elastic terms as a table of addresses, t of them of the parts `owners` (t,); the caller keeps
    the terms, whose memory the addresses point to.
    """
    force, tangent, energy, records = addresses(found)
    heat = [
        one.routines.dissipate.address if one.damped and one.routines.dissipate else 0
        for one in found
    ]
    follows = np.array([one.follows for one in found], dtype=bool)
    # their work is counted: a potential -p V depends on the origin where a rim is free
    energy[follows] = 0
    return ElasticTerms(
        force=force,
        tangent=tangent,
        energy=energy,
        records=records,
        dissipate=np.array(heat, dtype=np.int64),
        follow=np.flatnonzero(follows),
        owners=owners,
        damped=any(one.damped for one in found),
        holds=any(one.holds for one in found),
    )


def addresses(found: Sequence[Piece]) -> np.ndarray:
    """Those of the first three routines of every piece, and of its record, (4, t)."""
    # numbers alone, so that one compiled loop serves all kinds of terms
    table = [[*(routine.address for routine in one.routines[:3]), one.address] for one in found]
    return np.array(table, dtype=np.int64).reshape(-1, 4).T.copy()


def storage(system: System) -> Layout:
    """How the iteration matrix of a system is stored, and in which order of the unknowns, see
    `layouts`.

    Nothing is compiled, and nothing else is made of systems of `layouts.WIDE` unknowns or more.
    """
    # known without a pattern, as `check` of a large plate asks
    if is_sparse(system.lift.matrix) and system.size >= layouts.WIDE:
        return Layout(Storage.SPARSE, np.arange(system.size), system.size - 1)
    *_, pushing, pairs = attached(system)
    return layouts.chosen(system, split(system), pairs, any(force.skew for force in pushing))


def attached(system: System) -> tuple[Terms, tuple[Constraint, ...], tuple[Force, ...], np.ndarray]:
    """Constraints and forces of a system for compiled code, and the pairs (h, 2) of probe rows with
    second derivatives.
    """
    own = system.constraints
    found = list[Force]()
    terms, laws, pairs = prepare(system).find(
        "constraints", (own,), lambda: compile_constraints(own)
    )
    place = Place(len(pairs), 0, 0)
    for one in system.loads.forces:
        found.append(attachments.compile_force(one, place))
        last = found[-1]
        # each force knows where its pairs, memory and room begin: none looks for them in a step
        place = Place(
            place.pair + len(last.pairs), place.memory + len(last.memory), place.room + last.room
        )
    return terms, laws, tuple(found), np.concatenate([pairs, *(force.pairs for force in found)])


def compile_constraints(terms: Constraints) -> tuple[Terms, tuple[Constraint, ...], np.ndarray]:
    """Constraints for compiled code, and the pairs (h, 2) of probe rows with second derivatives."""
    laws = list[Constraint]()
    first, pairs = constraint_pairs(terms)
    for own in terms.laws:
        # pairs of laws stand behind those of polynomial terms
        laws.append(constraint_laws.compile_rows(own, len(pairs)))
        pairs = np.concatenate([pairs, laws[-1].pairs])
    return (
        Terms(terms.row, terms.coefficient, terms.signal, terms.i, terms.j, first),
        tuple(laws),
        pairs,
    )


def size(model: Compiled, displacement: np.ndarray) -> float:
    """Root mean square of a displacement u (n,) [m], with the diagonal of the metric W and the
    weight w [kg].

        |u| = sqrt(sum_n W_nn u_n^2 / w)

    `system.sizes` takes all of W.
    """
    # the diagonal alone, as `judge` has it: one product an unknown
    return float(np.sqrt(model.system.metric.diagonal() @ displacement**2 / model.system.weight))


def constraint_pairs(terms: Constraints) -> tuple[np.ndarray, np.ndarray]:
    """First pair of every constraint term, -1 for none, and the pairs (h, 2) of probe rows with
    second derivatives.
    """
    pairs: list[tuple[int, int]] = []
    first = np.full(len(terms.row), -1, dtype=np.int64)
    for k in np.flatnonzero(terms.j >= 0):
        first[k] = len(pairs)
        i, j = int(terms.i[k]), int(terms.j[k])
        # both, as W takes the symmetric part of all pairs by halves
        pairs += [(i, j), (j, i)]
    return first, np.array(pairs, dtype=np.int64).reshape(-1, 2)


def signal_table(system: System, times: np.ndarray) -> np.ndarray:
    """Values of all k signals of a system at times (s,) [s], (s, k), each in its own unit.

    Those of a few instants, as of a start, are remembered where signals are data; the array is the
    caller's own.
    """
    # tables of runs are as long as the run, and asked for once
    if len(times) > FEW or not repeatable(system):
        return tabulated(system, times)
    known = prepare(system).find("signals", (system.signals,), dict[bytes, np.ndarray])
    key = times.tobytes()
    found = known.get(key)
    if found is None:
        # cleared rather than searched for the oldest: starts ask for the same seven again at once
        if len(known) >= INSTANTS:
            known.clear()
        found = known[key] = tabulated(system, times)
    return found.copy()


def tabulated(system: System, times: np.ndarray) -> np.ndarray:
    """Values of all signals, (s, k)."""
    found = np.empty((len(times), len(system.signals)))
    for k, signal in enumerate(system.signals):
        # all instants in one call of a history, which may be a function of Python
        found[:, k] = signal(times)
    return found


def repeatable(system: System) -> bool:
    """Whether there are signals, and all are data: a function of Python may have other values in
    another run.
    """
    signals = system.signals
    # what a file can hold is data, a function of Python may depend on anything
    return bool(signals) and prepare(system).find(
        "data", (signals,), lambda: container.can_hold(signals)
    )


def place(
    model: Compiled,
    x: np.ndarray,
    v: np.ndarray | None = None,
    t: float = 0.0,
    memory: np.ndarray | None = None,
    multipliers: np.ndarray | None = None,
    a: np.ndarray | None = None,
) -> tuple[Evaluation, np.ndarray]:
    """The evaluation of a model, and its table, at a state with c = 1; zeros for what is not given.

    x, v, a (n,) in the order of the system, multipliers (m,), t [s]. `memory` (l,) is that of
    forces in the last accepted state (`accepted`); without it that of the start: angles, for
    example, have turned by less than half a turn.
    """
    found, table = model.evaluation
    s = found.space
    for target, part in zip((s.x, s.v, s.acceleration), (x, v, a), strict=True):
        target[:] = 0.0 if part is None else part[model.order]
    s.multipliers[:] = 0.0 if multipliers is None else multipliers
    s.signals[: len(model.system.signals)] = signal_table(model.system, np.array([t]))[0]
    # c = 1: forces in newtons and physical multipliers
    s.memory[:], s.c[0] = model.memory if memory is None else memory, 1.0
    return found, table


def evaluate(
    model: Compiled,
    x: np.ndarray,
    v: np.ndarray | None = None,
    t: float = 0.0,
    memory: np.ndarray | None = None,
    multipliers: np.ndarray | None = None,
    a: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """R (n,) of (1) in `evaluation` and Phi (m,) in a state as of `place`.

        R = M a + C v + K x + sum L^T phi(L x, L v) - Q + Phi_x^T lambda

    An error in a force that is a function of Python is raised here.
    """
    found, table = place(model, x, v, t, memory, multipliers, a)
    evaluation.evaluate(table)
    # errors of functions of Python are raised here: none can pass compiled code
    model.check()
    out = np.zeros(len(x))
    out[model.order] = found.space.f
    return out, found.space.rhs[0, len(x) :].copy()


def forces(
    model: Compiled, x: np.ndarray, v: np.ndarray, t: float = 0.0, memory: np.ndarray | None = None
) -> np.ndarray:
    """Forces of a system (n,) [N], at x, v (n,) and t [s].

        C v + K x + elastic and damping forces - loads

    Without inertia and constraints; `memory` (l,) as in `place`.
    """
    return evaluate(model, x, v, t, memory)[0]


def residual(
    model: Compiled,
    x: np.ndarray,
    multipliers: np.ndarray,
    t: float = 0.0,
    memory: np.ndarray | None = None,
) -> np.ndarray:
    """Forces [N] and gaps (n + m,) of a state at rest, zero in equilibrium.

        f(x, 0, t) + Phi_x^T lambda,    Phi(x, t)

    x (n,), multipliers (m,), t [s]; `memory` (l,) as in `place`.
    """
    return np.concatenate(evaluate(model, x, None, t, memory, multipliers))


def accepted(
    model: Compiled,
    x: np.ndarray,
    v: np.ndarray | None = None,
    memory: np.ndarray | None = None,
    t: float = 0.0,
) -> np.ndarray:
    """What forces keep of a state x, v (n,) that is accepted at t [s], (l,), after a memory (l,) or
    that of the start.

    Turns of angles, what sticks, largest values: a memory is only right after that of the state
    before.
    """
    if not len(model.memory):
        return model.memory
    found, table = place(model, x, v, t, memory)
    evaluation.take_over(table)
    model.check()
    return found.space.memory.copy()


def memories(
    model: Compiled,
    times: np.ndarray,
    x: np.ndarray,
    v: np.ndarray,
    a: np.ndarray,
    known: np.ndarray | None = None,
) -> np.ndarray:
    """What forces kept of all states of a motion (s, n), (s, l): what is `known`, if it is.

    Else it follows from the states: turns between them from the rates of angles, and what sticks as
    if there were no others.
    """
    # stored memory where there is some: friction of what sticks cannot be told from stored states
    # alone
    start = model.memory
    if known is not None and known.shape == (len(times), len(start)):
        return known
    found = np.zeros((len(times), len(start)))
    if not len(start):
        return found
    # rates of angles are differences of states nearby: two stored ones may be several turns apart
    span = np.full(len(times), NEARBY * (float(np.ptp(times)) / max(len(times) - 1, 1) or 1.0))
    none, out = np.zeros((len(times), 0)), np.zeros((len(times), 3 * len(start)))
    space = model.evaluation[0].space
    space.memory[:] = start
    x, v, a = (np.ascontiguousarray(part) for part in (x, v, a))
    samples = Samples(
        space=space,
        arrays=model.arrays,
        order=model.order,
        x=x,
        v=v,
        a=a,
        multipliers=none,
        signals=none,
        before=none,
        after=none,
        span=span,
        memory=found,
        out=out,
    )
    evaluation.follow(samples)
    evaluation.turn(samples)
    model.check()
    now, later, before = out.reshape(len(times), 3, -1).transpose(1, 2, 0)
    turning = [(force, k) for force in model.forces for k in range(len(force.memory))]
    names = [force.name if k < len(force.turns) and force.turns[k] else "" for force, k in turning]
    for k in np.flatnonzero(names):
        speed, change = (
            (later[k] - before[k]) / (2 * span),
            (later[k] - 2 * now[k] + before[k]) / span**2,
        )
        found[:, k] = continuous(names[k], times, now[k], speed, change)
    return found


def strain_energy(model: Compiled, x: np.ndarray) -> float:
    """Strain energy of all bodies [J] at x (n,), without linear springs and potentials of forces."""
    found, table = model.evaluation
    found.space.x[:] = x[model.order]
    evaluation.sum_energies(table)
    model.check()
    return float(found.space.energy[0])


def gap(model: Compiled, x: np.ndarray, t: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Constraints and their derivatives at x (n,) and t [s], in the order of
    `system.constraints.names`.

        Phi (m,),    Phi_x = Phi_y P (m, n)

    with the probe rows y = P x + y0.
    """
    phi, jacobian = constraints_at(model, x[None, :], np.array([t]))
    return phi[0], np.asarray(jacobian @ model.system.probes.matrix)


def constraints_at(
    model: Compiled, x: np.ndarray, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Phi (s, m) of states x (s, n) at some times (s,) [s], and the derivatives of the last one by
    the probe rows (m, j).

    The second array is that of the space, which the next evaluation overwrites.
    """
    (found, table) = model.evaluation
    signals = signal_table(model.system, times)
    # probes alone: no cell is evaluated for a gap
    phi = np.zeros((len(x), model.constraints))
    s = found.space
    states = x[:, model.order]
    for k in range(len(x)):
        s.x[:], s.signals[: signals.shape[1]] = states[k], signals[k]
        evaluation.probe_constraints(table)
        phi[k] = s.rhs[0, len(s.x) :]
    return phi, s.Jy


def tangent(
    model: Compiled,
    x: np.ndarray,
    multipliers: np.ndarray,
    t: float = 0.0,
    gh: float = 0.0,
    memory: np.ndarray | None = None,
    v: np.ndarray | None = None,
    held: tuple[np.ndarray, int] | None = None,
) -> csr_array:
    """Tangent (n, n) of a state as of `place`: elastic tangent, springs, joints and forces.

        d/dx (f + Phi_x^T lambda) + gh df/dv

    x, v (n,), at rest without v, multipliers (m,), t [s], gh [1/s]; C of the system counts gh
    times. Inertia is not in it. Stresses may be those of another state, as in `elastic_tangent`.
    """
    # exact, for equilibria and modes, where a step may take one that is rotated or old
    K = csr_array(elastic_tangent(model, x, gh, held))
    # sums of sparse arrays take longer than small tangents: most systems have neither springs nor
    # damping by mass
    for part, factor in ((model.system.stiffness, 1.0), (model.system.damping, gh)):
        if factor and as_csr(part).nnz:
            K = K + factor * csr_array(part)
    return (
        csr_array(K + probe_tangent(model, x, multipliers, t, gh, memory, v))
        if reads_slopes(model)
        else K
    )


def reads_slopes(model: Compiled) -> bool:
    """Whether joints or forces on probe rows have second derivatives or slopes."""
    return bool(len(model.pairs)) or any(force.low.terms for force in model.forces)


def probe_tangent(
    model: Compiled,
    x: np.ndarray,
    multipliers: np.ndarray,
    t: float = 0.0,
    gh: float = 0.0,
    memory: np.ndarray | None = None,
    v: np.ndarray | None = None,
) -> csr_array:
    """What joints and forces on probe rows add to the tangent: P^T H P (n, n), H second derivatives
    on pairs of rows.

        H = - dF/dy - gh dF/dy' + d(Phi_y^T lambda)/dy

    State as of `place`, gh [1/s].
    """
    P = csr_array(model.system.probes.matrix)
    # linear joints and constant loads: nothing is evaluated
    if not reads_slopes(model):
        return csr_array((len(x), len(x)))
    found, table = place(model, x, v, t, memory, multipliers)
    found.space.gh[0] = gh
    evaluation.probe_slopes(table)
    model.check()
    pairs, H = row_slopes(model, found.space)
    return csr_array(P.T @ csr_array((H, tuple(pairs.T)), shape=(P.shape[0], P.shape[0])) @ P)


def row_slopes(model: Compiled, space: Space) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (h, 2) of probe rows and H (h,) as `evaluation.slopes` has left them, those of low rank
    behind the others.

    Pairs may come more than once; their H add up.
    """
    pairs, H = low_rank.entries(space.low)
    return np.concatenate([model.pairs, pairs]), np.concatenate([space.H, H])


def force_slopes(
    model: Compiled, x: np.ndarray, v: np.ndarray, t: float, memory: np.ndarray | None
) -> Iterator[tuple[Force, np.ndarray, np.ndarray]]:
    """Forces with derivatives, their pairs of rows (h, 2), and H (h,) on them, in a state as of
    `place`.

        H = - dF/dy

    Derivatives by rates are left out (gh = 0).
    """
    found, table = place(model, x, v, t, memory)
    found.space.gh[0] = 0.0
    evaluation.probe_slopes(table)
    model.check()
    first = len(model.pairs) - sum(len(force.pairs) for force in model.forces)
    (low, more) = low_rank.entries(found.space.low)
    for force in model.forces:
        last = first + len(force.pairs)
        own = np.isin(low[:, 0], force.alone) & (force.low.terms > 0)
        if last > first or own.any():
            yield (
                force,
                np.concatenate([force.pairs, low[own]]),
                np.concatenate([found.space.H[first:last], more[own]]),
            )
        first = last


def elastic_tangent(
    model: Compiled, x: np.ndarray, gh: float, held: tuple[np.ndarray, int] | None = None
) -> csr_array | np.ndarray:
    """Elastic tangent K + gh C (n, n) at x (n,), an array where the system is dense, sparse
    otherwise.

        K + gh C = sum L^T (d2W/du2 + gh beta d2R/dv2) L

    beta [s] are the damping times of the bodies, gh [1/s]; linear springs are not in it. With
    `held`, a state (n,) and in which way, laws that hold stresses take those of it, see
    `laws.call_modulus`.
    """
    found, table = model.evaluation
    W = found.space.W
    space = found.space
    if held is not None and space.gradients.size:
        evaluate(model, held[0])
        space.gradients[ACCEPTED], space.holding[0] = space.gradients[NOW], held[1]
    W[:], space.x[:], space.gh[0] = 0.0, x[model.order], gh
    evaluation.sum_tangents(table)
    space.holding[0] = EXACT
    model.check()
    # of large models W has no rows and columns of its own
    return model.pattern.assembled(W[0]) if model.pattern else model.layout.matrix(W)
