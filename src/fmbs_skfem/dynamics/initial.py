r"""The start of a run: velocities that joints admit, and the space of the iteration; accelerations
and multipliers follow in `compiled_step.starting`.

    Phi(q0, 0) = 0,    Phi_q v0 + Phi_t = 0
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array

from ..bodies.laws import Law
from ..core.algebra import ranks, saddle, supernodes
from ..core.algebra.linalg import Array
from ..core.compiling import lapack, structs
from ..core.errors import Contradiction, Reason, SolverError, say
from ..systems import assembly, evaluation, free_motions, layouts
from ..systems import compiled as compilation
from ..systems.compiled import Compiled, repeatable, signal_table
from ..systems.connections import mechanism
from ..systems.connections.redundancy import (
    notify_projected,
    rows_of,
    scale_of,
    singular_start,
    without_redundant,
)
from ..systems.forces import on_rows as forces
from ..systems.layouts import Storage
from ..systems.prepared import prepare
from ..systems.signals import RATE
from ..systems.system import System, driven_rows, is_linear, keep_constraints, loose_rows
from .compiled_step import (
    beam_points,
    factors,
    impulses,
    large,
    rotated,
    settling,
    starting,
    stepping,
    woodbury,
)
from .compiled_step.impulses import Impulse
from .compiled_step.packing import UNSTORED, PackedStep
from .compiled_step.step import Doors, Levels, Method, State, Step, StepJob, Workspace
from .histories import CURVATURE, DRIFT, finite_signals, signals_at_start
from .names import coordinate_names
from .scheme import GeneralizedAlpha, Newton, Solver, has_dear_factors, method_of

TERMS = 64  #: of a history and of its differences, over their sum
ROUND_OFF = 1e-12  #: of the largest velocity: gaps in velocities that are none, see `least_rate`
# double pendulum in 30 modes, 80 steps of 1 ms: 7 factorisations leave 1.1e-10 of its size; 9 leave
# 2.6e-10 without secants, 7 with half as many 1.1e-10, 6 with twice 1.5e-10
SECANTS = 4  #: kept beside dense factors that cost many corrections; beside others they cost more than they save


Inversion = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]  #: (f, g) -> (a, l)
#: (M, J) -> b -> z
Inverter = Callable[[Array, np.ndarray], Callable[[np.ndarray], np.ndarray] | None]


class Instant(NamedTuple):
    """Where a motion starts, in the order of the system's unknowns."""

    time: float  #: [s]
    x: np.ndarray  #: (n,)
    v: np.ndarray
    off: np.ndarray  #: (m,) bool, constraint rows that do not hold
    memory: np.ndarray | None = None  #: (l,) what forces keep, see `compiled.place`


DRIVEN = "drives begin with rates that their bodies do not have, an impulse: let them begin gently, or give the bodies these rates"


def startable(system: System, scheme: GeneralizedAlpha) -> System:
    """The system without redundant rows; SolverError where a signal is no number at an instant that
    the start reads.
    """
    finite_signals(system, scheme.step * np.outer((DRIFT, CURVATURE), np.arange(5)).ravel())
    return without_redundant(system)


def admissible(system: System, scheme: GeneralizedAlpha) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities at the start that joints admit, as `consistent_start`.

        Phi(x0, 0) = 0,    Phi_q v0 + Phi_t = 0

    SolverError where the former does not hold.

    Of wide systems at rest nothing is solved. Nothing is compiled, but where velocities of flexible
    bodies, or beside forces, jump.
    """
    if (
        system.size >= layouts.WIDE
        and not system.v0.any()
        and not driven_rows(system.constraints).any()
    ):
        jacobian_at_start(system)
        return system.x0, system.v0
    J, gap = velocity_gaps(system, scheme)
    rigid = not system.loads.forces and not system.elastic
    least = least_rate(system.v0, scheme.step)
    if rigid or np.abs(gap).max(initial=0.0) <= least:
        try:
            solve = kkt_solver(system, system.mass, J)
            change = change_of(solve, np.zeros(system.size), gap)
            return system.x0, warned(system, system.v0, change, least)
        except SolverError:
            if rigid:
                raise
    model = compilation.compile_system(system)
    step = first_step(model, system.x0, system.v0, method_of(scheme, Newton(), scheme.step, model))
    return system.x0, settle_velocities(
        PackedStep(model, step, large_of(model)), scheme, start_of(model)
    )


def jacobian_at_start(system: System) -> csr_array:
    """Phi_x (m, n) at the start; Contradiction, by name, where the joints do not hold there:
    Phi(x0) is not zero.
    """
    if not system.constraints.names:
        return csr_array((0, system.size))
    rows, z = rows_of(system)
    phi, J = rows(z)
    J = coo_array(J)
    found = csr_array((J.data, (J.row, rows.used[J.col])), shape=(rows.count, system.size))
    closed(system, phi, found)
    return found


def velocity_gaps(system: System, scheme: GeneralizedAlpha) -> tuple[np.ndarray, np.ndarray]:
    """What velocities break at the start, and the rows by which they do.

        Phi_x (m, n),    Phi_x v + Phi_t (m,)

    of the system at x0, v0 and t = 0.
    """
    J = jacobian_at_start(system).toarray()
    if is_linear(system.constraints).all():
        return J, J @ system.v0
    (rows, z) = rows_of(system)
    d = DRIFT * scheme.step
    table = signal_table(system, d * np.arange(5.0))
    drift = RATE @ np.stack([replace(rows, signals=signals)(z)[0] for signals in table]) / (12 * d)
    return J, J @ system.v0 + drift


def is_filtered(system: System) -> bool:
    """Whether steps begin without the waves that none of them resolves: those of bodies with a
    strain energy.
    """
    return bool(system.elastic)


def has_massless_directors(system: System) -> bool:
    """Whether a body is a beam with directors, the first of which have no mass, or one of matrices
    with nodes that have none: M alone determines no accelerations.
    """
    laws = {part.gather.law for part in system.elastic}
    return any(law.fields > 1 for law in laws) or (
        Law.LINEAR in laws and not system.mass.diagonal().all()
    )


def speed_of(v: np.ndarray) -> float:
    """The largest velocity in v (n,), at least 1."""
    return max(1.0, float(np.abs(v).max(initial=0.0)))


def least_rate(v: np.ndarray, h: float) -> float:
    """Gaps in velocities v (n,) up to this one are none: round-off, also of the differences that
    rates of histories come from, at steps h [s], whose terms may be some times as large as their
    sum.
    """
    return (ROUND_OFF + TERMS * float(np.finfo(float).eps) / (DRIFT * h)) * speed_of(v)


def closed(system: System, phi: np.ndarray, J: Array) -> None:
    """Refuse an initial state that the joints do not hold in: phi (m,) over what large changes make
    of it, by J (m, n).
    """
    # of axes and angles 1, whatever the size of the system
    large = np.sqrt((J * J) @ scale_of(system) ** 2)
    wrong = np.flatnonzero(np.abs(phi) > impulses.APART * np.maximum(large, system.scale))
    if len(wrong):
        worst = tuple(
            (".".join(system.constraints.names[k]), abs(float(phi[k])))
            for k in wrong[np.argsort(-np.abs(phi[wrong]))]
        )
        listed = ", ".join(f"{name} by {gap:.3g}" for name, gap in worst)
        remedy = "draw the bodies where their joints hold, or begin with `start: equilibrium`"
        raise Contradiction(
            say("the initial state does not satisfy the joints", "no gaps", listed, remedy), worst
        )


def start_of(model: Compiled) -> Instant:
    """The start of a motion, in which all rows hold."""
    return Instant(0.0, model.system.x0, model.system.v0, np.zeros(model.constraints, bool))


def large_of(model: Compiled, solver: Solver = "own") -> large.Large | None:
    """The factors of a large model; None of others, which have them in their space."""
    return large.Large(model, solver) if model.pattern else None


def start_step(
    packed: PackedStep, scheme: GeneralizedAlpha, at: Instant, filtered: bool | None = None
) -> np.ndarray:
    """Put a step to where a motion starts: its state shows what balances all forces, and has what
    steps begin with, see `begin_steps` and `starting`. The velocities (n,) that joints admit.

        Phi_q v + Phi_t = 0,    M q'' + Phi_q^T lambda = -f,    Phi'' = 0

    of the rows that hold. Velocities that drives do not have change by `impulses`. By M alone a
    drive would turn one node of a beam, with rates of strain that no step resolves: a damped beam
    driven at 1 mrad/s then began with 0.16 J in place of 6e-7 J.
    """
    model, step = packed.model, packed.step
    system = model.system
    state = step.state
    state.memory[:] = model.memory if at.memory is None else at.memory
    J = closed_rows(model, at)
    v = settle_velocities(packed, scheme, at, J)
    on = ~at.off
    told = flags_of(model, filtered)
    # a kernel that Python called would load numba: no `starting.has`
    if told // starting.HELD % 2 == 1:
        # what neither joints nor a mass hold is an error
        kkt_solver(held(system, on), system.mass, J[on])
    if packed.call(starting.start, told) != 0:
        raise weightless(system, system.mass)
    rows = np.flatnonzero(step.space.off == 0.0)
    if len(rows) < on.sum():
        for part in (state.multipliers, state.past[0]):
            part[on] = ranks.least(J[on].T, J[rows].T @ part[rows], len(rows))
    step.space.off[:] = at.off
    return v


def impulse_of(packed: PackedStep) -> Impulse:
    """What a step needs beside it where its motion changes at once, found once; its address is
    `packed.beside`.
    """
    if packed.impulse is None:
        model = packed.model
        system, order = model.system, model.order
        flags = flags_of(model) + starting.KNOWN
        holds = flags // starting.HELD % 2 == 1
        packed.put_beside(
            impulses.impulse_for(
                flags=flags,
                alone=flags_of(model, alone=True) + starting.KNOWN,
                trained=bool(system.components),
                size=system.scale,
                units=scale_of(system)[order],
                loose=loose_rows(system.constraints).astype(np.int64),
                light=np.flatnonzero(without_mass(system.mass)[order] & holds),
            )
        )
    assert packed.impulse is not None
    return packed.impulse


def call_impulse(
    packed: PackedStep, scheme: GeneralizedAlpha, time: float, what: structs.Routine
) -> int:
    """What a routine of `impulses` returns for the state of a step at a time [s]."""
    impulse_of(packed)
    packed.give(signals_at_start(packed.model.system, time, scheme.step), UNSTORED)
    status = packed.call(what, packed.beside)
    packed.check()
    return status


def begin_anew(
    packed: PackedStep, scheme: GeneralizedAlpha, time: float, before: np.ndarray | None = None
) -> Impulse:
    """Let a motion go on from the state of a step at a time [s], with the rows that are not off in
    its space and without loose ones that follow from others, which are off from then on.

    Accelerations `before` (n,), those of the state by default, are kept, and what has changed is
    filtered, as elastic bodies are. Contradiction where rows do not hold, SolverError where no
    acceleration is determined.
    """
    model, state = packed.model, packed.step.state
    state.a[:] = state.acceleration if before is None else before
    status = call_impulse(packed, scheme, time, impulses.begin_anew)
    if status == impulses.OPEN:
        x = state.x[np.argsort(model.order)]
        closed_rows(model, Instant(time, x, x, packed.step.space.off > 0.0))
    if status == impulses.AGAINST:
        names = model.system.constraints.names
        wrong = np.flatnonzero(impulse_of(packed).follows)
        raise moved_against([".".join(names[k]) for k in wrong], time)
    if status != 0:
        raise weightless(model.system, model.system.mass)
    return impulse_of(packed)


def moved_against(rows: Sequence[str], time: float) -> Contradiction:
    """The error of rows that an event locks, against what drives move at a time [s]."""
    text = say(
        f"joints that an event locks at t = {time:.6g} s",
        "rows that what moves lets hold",
        f"{', '.join(rows)}, against which a drive moves",
        "let an event release the drive or a joint first, or let it stand still by then",
    )
    return Contradiction(text, tuple((name, 0.0) for name in rows))


def balance(
    packed: PackedStep, scheme: GeneralizedAlpha, time: float
) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations (n,) and multipliers (m,) that balance the forces of the state of a step at a
    time [s], in the order of the state; physical ones. The state stays as it is.
    """
    if call_impulse(packed, scheme, time, impulses.balance_known) != 0:
        raise weightless(packed.model.system, packed.model.system.mass)
    found = impulse_of(packed)
    return found.acceleration, found.multipliers / packed.step.method.c


def flags_of(model: Compiled, filtered: bool | None = None, alone: bool = False) -> int:
    """What `starting.start` is told of a model."""
    system = model.system
    massless = has_massless_directors(system)
    # what factors W and the joints in one takes a singular M
    bordered = model.arrays.dense and model.layout.loose
    filtered = massless or (not alone and (is_filtered(system) if filtered is None else filtered))
    return (
        starting.FILTERED * filtered
        + starting.MASSLESS * massless
        + starting.SOFTENED * (not system.components)
        + starting.REACTS * any(force.reacts for force in model.forces)
        + starting.TOUCHES * (not alone and len(model.arrays.forces.judged) > 0)
        + starting.HELD * (not (massless or bordered) and bool(without_mass(system.mass).any()))
    )


def without_mass(M: Array) -> np.ndarray:
    """Unknowns (n,) bool without mass."""
    m = M.diagonal()
    return np.asarray(m <= 1e-12 * m.max(initial=0.0))


def closed_rows(model: Compiled, at: Instant) -> np.ndarray:
    """Phi_x (m, n) of an instant, found once for all numbers; Contradiction where rows that hold are
    not closed there.
    """
    make = partial(compilation.gap, model, at.x, at.time)
    system = model.system
    if repeatable(system) or not system.signals:
        parts = system.constraints, system.probes, system.signals, at.x, at.time
        phi, J = prepare(system).find("gap", parts, make)
    else:
        phi, J = make()
    on = ~at.off
    closed(held(system, on), phi[on], J[on])
    return np.asarray(J)


def settle_velocities(
    packed: PackedStep, scheme: GeneralizedAlpha, at: Instant, J: np.ndarray | None = None
) -> np.ndarray:
    """Velocities (n,) that joints with rows J (m, n) admit where a motion starts; the state has
    them, and its space the independent rows.
    """
    model, state, space = packed.model, packed.step.state, packed.step.space
    J = closed_rows(model, at) if J is None else J
    on = ~at.off
    system = held(model.system, on)
    order = model.order
    state.x[:], state.v[:], state.a[:] = at.x[order], at.v[order], 0.0
    space.off[:] = at.off
    packed.give(signals_at_start(model.system, at.time, scheme.step), UNSTORED)
    packed.call(starting.find_rates)
    packed.check()
    rates = space.rhs[0, len(at.x) :][on].copy()
    space.off[:] = 1.0
    space.off[np.flatnonzero(on)[independent(system, J[on])]] = 0.0

    def leap(v: np.ndarray) -> np.ndarray:
        state.v[:] = v[order]
        if call_impulse(packed, scheme, at.time, impulses.close_rates) != 0:
            raise weightless(system, system.mass)
        return state.v[np.argsort(order)]

    least = least_rate(at.v, scheme.step)
    invert = partial(augmented, model) if model.pattern else None
    v = projected(system, at.v, J[on], rates - J[on] @ at.v, leap, least, invert)
    state.v[:] = v[order]
    return v


def independent(system: System, J: np.ndarray) -> np.ndarray:
    """Numbers of rows of J (m, n), those that a system holds, on which the others depend: in a
    singular position, where they do for an instant, these determine accelerations.

    Contradiction where they do beyond the start.
    """

    def find() -> np.ndarray:
        rows = ranks.independent_rows(J, units=scale_of(system))
        if len(rows) < len(J) and not singular_start(system):
            raise dependent(system, np.setdiff1d(np.arange(len(J)), rows))
        return rows

    parts = system.constraints, system.probes, system.lift, system.x0, J.tobytes()
    return prepare(system).find("independent rows", parts, find)


def change_of(solve: Inversion, f: np.ndarray, gap: np.ndarray) -> np.ndarray:
    """What a push f (n,) and a gap g (m,) make of velocities, (n,).

        [[M, J^T], [J, 0]] (dv, l) = (f, - g)

    0 of a system without joints.
    """
    return solve(f, -gap)[0] if len(gap) else np.zeros(len(f))


def projected(
    system: System,
    v: np.ndarray,
    J: np.ndarray,
    drift: np.ndarray,
    leap: Callable[[np.ndarray], np.ndarray],
    least: float,
    invert: Inverter | None,
) -> np.ndarray:
    """v (n,) at the first instant, and what closes the rates of the joints (m,), of which `drift`
    is the part of time; a warning says so, and rates up to the `least` one stay.

        Phi_x v + Phi_t = 0

    Linear rows that nothing drives change v by the least kinetic energy, as where they are
    eliminated, and all others by `leap`.
    """
    given = v
    fixed = is_linear(system.constraints)
    if np.abs(J[fixed] @ v).max(initial=0.0) > least:
        solve = kkt_solver(
            keep_constraints(system, np.flatnonzero(fixed)),
            assembly.mass_of_speeds(system),
            J[fixed],
            invert,
        )
        v = v + change_of(solve, np.zeros(len(v)), J[fixed] @ v)
    if np.abs(J @ v + drift).max(initial=0.0) > least:
        v = leap(v)
    return warned(system, given, v - given, least, bool(np.abs(drift).max(initial=0.0) > least))


def warned(
    system: System, v: np.ndarray, change: np.ndarray, least: float, driven: bool = False
) -> np.ndarray:
    """v (n,) at the first instant with its change (n,), of which a warning says; round-off, and what
    is at most the `least` rate, is left out.
    """
    if float(np.abs(change).max(initial=0.0)) <= max(1e-9 * speed_of(v), least):
        return v
    notify_projected(system, change, DRIVEN if driven else "")
    return np.asarray(v + change)


def held(system: System, on: np.ndarray) -> System:
    """The system with the rows that hold (m,)."""
    return system if on.all() else keep_constraints(system, np.flatnonzero(on))


def kkt_solver(
    system: System, M: Array, J: np.ndarray, invert: Inverter | None = None
) -> Inversion:
    """What solves for changes of velocities with J (m, n) of the rows that a system holds; redundant
    ones are named in the error.

        [[M, J^T], [J, 0]] (a, l) = (f, g)

    `invert` gives the inverse of this matrix of M and J, if not `saddle`. In a singular position,
    where rows depend on each other for an instant, independent ones determine a, and l has least
    norm.
    """
    size = float(abs(M).max()) or 1.0
    rows = ranks.independent_rows(J, units=scale_of(system))
    if len(rows) < len(J) and not singular_start(system):
        raise dependent(system, np.setdiff1d(np.arange(len(J)), rows))
    inverse = (
        invert(M / size, J[rows]) if invert else saddle.inverse(saddle.matrix(M / size, J[rows]))
    )
    if inverse is None:
        raise weightless(system, M)

    def solve(f: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        z = inverse(np.concatenate([f / size, g[rows]]))
        found = size * z[len(f) :]
        return z[: len(f)], found if len(rows) == len(J) else ranks.least(
            J.T, J[rows].T @ found, len(rows)
        )

    return solve


def dependent(system: System, rows: np.ndarray) -> Contradiction:
    """The error of rows that follow from others and cannot be left out: a drive is among them, or
    they have no common position.
    """
    full = system.full or system
    if driven := mechanism.driven_against(full, mechanism.redundant(full)):
        return mechanism.conflict(driven)
    names = tuple((".".join(system.constraints.names[k]), 0.0) for k in rows)
    listed = ", ".join(name for name, _ in names)
    text = say(
        "joints",
        "rows that do not follow from others, or can be left out",
        listed,
        "remove one of these joints",
    )
    return Contradiction(text, names)


def weightless(system: System, M: Array) -> SolverError:
    """The error of a start whose accelerations are not determined, as of unknowns without mass that
    no joint holds.
    """
    names = [coordinate_names(system)[k] for k in np.flatnonzero(without_mass(M))]
    if not names:
        text = f"no motion starts from this state: {Reason.SINGULAR_TANGENT.value}"
        return SolverError(text, Reason.SINGULAR_TANGENT, 0.0)
    listed = ", ".join(names[:5])
    remedy = "give the body a density or a mass, or hold it by joints (a rim along a straight edge turns freely about it)"
    text = f"neither joints nor a mass determine the motion of {listed}; {remedy}"
    return SolverError(text, Reason.SINGULAR_TANGENT, 0.0, tuple((name, 0.0) for name in names[:5]))


def augmented(model: Compiled, M: Array, J: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """What solves for accelerations of large models, by a matrix that is definite where M is on the
    null space of J.

        [[M, J^T], [J, 0]] (a, l) = (f, g)    by    M + J^T J
    """
    n = M.shape[0]
    m = len(J)
    scale = np.sqrt(M.diagonal().max()) / max(float(np.abs(J).max(initial=0.0)), 1e-300)
    rows = csr_array(scale * J)
    A = csr_array(M + rows.T @ rows)
    approximate = large.inverse(A, free_motions.rigid_motions(model.system))
    spread = large.refined(A, approximate, rows.toarray())
    schur = rows @ spread.T

    def solve(right: np.ndarray) -> np.ndarray:
        f = right[:n]
        g = scale * right[n:]
        x = large.refined(A, approximate, (f + rows.T @ g)[None, :])[0]
        multipliers = np.linalg.solve(schur, rows @ x - g) if m else np.zeros(0)
        return np.concatenate([x - multipliers @ spread, scale * multipliers])

    return solve


def begin_steps(state: State) -> None:
    """Put a state whose motion starts, which shows what balances all forces, to what steps begin
    with; `state` is changed in place.

    The last q'' and multipliers of what predicts the next ones are others than those of the state
    at no other instant.
    """
    if state.known[0] == 1:
        state.acceleration[:], state.multipliers[:] = state.history[0], state.past[0]


def histories_work(system: System) -> bool:
    """Whether histories drive joints, or stand in potentials of forces."""
    return bool(driven_rows(system.constraints).any()) or any(
        map(forces.histories, system.loads.forces)
    )


def first_step(
    model: Compiled, x: np.ndarray, v: np.ndarray, method: Method, stored: int = 1
) -> Step:
    """A step with its space at x and v (n,), before its start, and room for so many states."""
    n = model.system.size
    m = model.constraints
    apart = (woodbury.fill, woodbury.close, woodbury.correct) if columns_apart(model) else ()
    settle = 0 if has_steady_joints(model) else settling.settle.address
    first = evaluation.evaluate, *factors.doors(model.layout.storage)
    last = stepping.take, factors.assemble, *apart
    doors = Doors(*[*(one.address for one in first), settle, *(one.address for one in last)])
    rotations = beam_points.rotations_of(model)
    if len(rotations.groups):
        doors = rotated.behind(doors)
    job = StepJob(
        signals=np.zeros((0, 0)),
        rows=np.zeros(0, np.int64),
        out=np.zeros((3, stored, n)),
        order=model.order,
        multipliers=np.zeros((stored, m)),
        memory=np.zeros((stored, len(model.memory))),
        work=np.zeros(stored),
        counters=np.zeros(4, np.int64),
        done=np.zeros(3, np.int64),
        left=np.zeros(2),
    )
    none = np.zeros(0, np.int64)
    space = compilation.space(model)
    histories = len(model.system.signals) if histories_work(model.system) else 0
    state = State(
        x=x[model.order],
        v=v[model.order],
        a=np.zeros(n),
        acceleration=np.zeros(n),
        multipliers=np.zeros(m),
        history=np.zeros((stepping.HISTORY, n)),
        past=np.zeros((stepping.HISTORY, m)),
        known=np.ones(1, np.int64),
        order=np.zeros(1, np.int64),
        memory=model.memory.copy(),
        speed=np.zeros(1),
        parts=np.zeros(1, np.int64),
        change=np.full(1, np.inf),
        work=np.zeros(2),
        push=np.zeros(n),
        # one memory, so that a step copies them once
        gradients=space.gradients[evaluation.ACCEPTED],
        signals=np.zeros(histories),
    )
    return Step(
        space,
        model.arrays,
        doors,
        state,
        workspace(model),
        rotations,
        method,
        job,
        Levels(none, none, none, 0, none, 0, 0, 0, np.zeros((0, 2)), none),
    )


def has_steady_joints(model: Compiled) -> bool:
    """Whether all constraints are linear in the unknowns and independent of time: Phi_x is
    constant.

    Velocities are then on the joints at the end of a step as they are: two solutions a step for
    nothing, 0.110 for 0.089 s of the reduced double pendulum with points, and a routine more to
    compile (1.2 s).
    """
    A = model.arrays
    return not len(A.laws.records) and bool(((A.terms.j < 0) & (A.terms.signal == -1)).all())


def columns_apart(model: Compiled) -> int:
    """Largest number of columns of derivatives of low rank that are not added to W; 0 where all
    are.
    """
    apart = model.layout.storage in (Storage.BAND, Storage.BLOCKS)
    return (
        sum(force.low.terms for force in model.forces)
        * max([0, *(force.low.rank for force in model.forces)])
        if apart
        else 0
    )


def workspace(model: Compiled) -> Workspace:
    """Space of the solver; without factors where these are kept elsewhere."""
    A = model.arrays
    n = model.system.size
    m = model.constraints
    form, tree = model.layout.storage, model.layout.tree
    stored = 0 if model.pattern else n
    blocks = form is Storage.BLOCKS
    band = stored if form is Storage.BAND else 0
    rank = columns_apart(model)
    # bands keep none: their factors cost as little as secants
    secants = SECANTS if (A.dense or blocks) and has_dear_factors(model) else 0
    bordered = A.dense and model.layout.loose
    dense = (n + m if bordered else n) if A.dense else 0
    closed = 0 if bordered else m
    return Workspace(
        addresses=lapack.ADDRESSES,
        kkt=np.zeros((dense, dense)),
        ends=np.zeros(n if A.dense else 0, np.int64),
        general=np.zeros((band, 3 * model.layout.width + 1)),
        pivots=np.zeros(dense or n, np.int32),
        schur=np.zeros((closed, closed)),
        schur_pivots=np.zeros(closed, np.int32),
        spread=np.zeros((closed, stored)),
        J=np.zeros((m, stored)),
        lower=np.zeros(supernodes.entries(tree)),
        diagonal=np.zeros(n if blocks or A.dense else 0),
        columns=np.zeros((max(1, m), n if blocks else 0)),
        front=np.zeros(supernodes.height(tree)),
        lows=np.zeros((rank, n)),
        inner=np.zeros(min(rank, n) ** 2),
        inner_pivots=np.zeros(min(rank, n), np.int32),
        updates=np.zeros((secants, n + m)),
        shares=np.zeros((secants, n)),
        secants=np.zeros(1, np.int64),
        moved=np.zeros(n),
        pull=np.array([np.inf, float(model.system.mass.diagonal().max(initial=0.0))]),
        rate=np.ones(1),
        kind=np.array([0, len(A.corotation.table) > 0, 0, 0], np.int64),
    )
