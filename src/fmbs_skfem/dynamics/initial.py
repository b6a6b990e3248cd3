r"""The start of a run: consistent velocities, accelerations and multipliers, and the space of the
iteration.

Phi_q v0 + Phi_t = 0,    [ M      Phi_q^T ] [ q''    ]     [ f                              ]
                         [ Phi_q  0       ] [ lambda ] = - [ d2/dt2 Phi(q0 + t v0, t) at t = 0 ]
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np
from scipy.sparse import coo_array, csr_array

from ..bodies.laws import Law
from ..core.algebra import ranks, saddle, supernodes
from ..core.algebra.linalg import Array
from ..core.compiling import lapack
from ..core.errors import Contradiction, Reason, SolverError, say
from ..systems import assembly, evaluation, layouts
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
from ..systems.system import System, driven_rows, is_linear, keep_constraints
from .compiled_step import (
    beam_points,
    factors,
    large,
    rotated,
    settling,
    starting,
    stepping,
    woodbury,
)
from .compiled_step.step import Doors, Levels, Method, State, Step, StepJob, Workspace
from .histories import finite_signals
from .names import coordinate_names
from .scheme import GeneralizedAlpha, Newton, has_dear_factors, method_of

# first derivatives divide round-off by d, second and third ones by d^2 and d^3, which asks for
# longer ways: accelerations of a heavy top differ by 2e-12 at half and 5e-13 at twice of CURVATURE,
# third derivatives by 3e-9 and 5e-10, at 0.01 by 5e-6
#: distance d of the five instants of the differences for Phi_t and for Phi'' and Phi''', in steps
DRIFT, CURVATURE = (
    1e-3,
    0.25,
)
# the head of a clamped beam: 1e-6 to 1e-10 give the same seven digits of its acceleration
SOFT = 1e-8  #: of the stiffness of the step, which holds what has no mass
ROUND_OFF = 1e-12  #: of the largest velocity: gaps in velocities that are none
# factors of 2000 unknowns of beams take about a megabyte and some milliseconds; of half and twice
# as many, half and twice of both
#: unknowns up to which a system keeps the factors of a start, for other numbers and steps
SHARED = 2000
# double pendulum in 30 modes, 80 steps of 1 ms: 7 factorisations leave 1.1e-10 of its size; 9 leave
# 2.6e-10 without secants, 7 with half as many 1.1e-10, 6 with twice 1.5e-10
SECANTS = 4  #: kept beside dense factors that cost many corrections; beside others they cost more than they save
#: first derivative at the first instant, times 12 d
RATE = np.array([-25.0, 48.0, -36.0, 16.0, -3.0])
BEND = np.array([35.0, -104.0, 114.0, -56.0, 11.0])  #: second, times 12 d^2
JERK = np.array([-5.0, 18.0, -24.0, 14.0, -3.0])  #: third, times 2 d^3


Found = TypeVar("Found")
Solver = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]  #: (f, g) -> (a, l)
#: (M, J) -> b -> z
Inverter = Callable[[Array, np.ndarray], Callable[[np.ndarray], np.ndarray] | None]


class Instant(NamedTuple):
    """Where a motion starts, or goes on after an event, in the order of the system's unknowns."""

    time: float  #: [s]
    x: np.ndarray  #: (n,)
    v: np.ndarray
    off: np.ndarray  #: (m,) bool, constraint rows that do not hold
    memory: np.ndarray | None = None  #: (l,) what forces keep, see `compiled.place`
    #: whether the motion starts there: velocities are projected, and no impulse acts
    first: bool = False


DRIVEN = "drives begin with rates that their bodies do not have, an impulse: let them begin gently, or give the bodies these rates"


class Start(NamedTuple):
    """Consistent initial state that steps go on from, in the order of the system's unknowns."""

    x: np.ndarray  #: (n,)
    v: np.ndarray
    a: np.ndarray  #: q''
    multipliers: np.ndarray  #: (m,) physical
    shift: np.ndarray  #: (2, n) what the first step adds to v, by (4) of `stepping`, and to the algorithmic acceleration
    #: q'' and multipliers that balance all forces, where they are others
    balance: tuple[np.ndarray, np.ndarray] | None = None

    @property
    def shown(self) -> tuple[np.ndarray, np.ndarray]:
        """q'' (n,) and multipliers (m,) of the instant, as outputs show them."""
        return self.balance or (self.a, self.multipliers)


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
    if rigid or np.abs(gap).max(initial=0.0) <= ROUND_OFF * speed_of(system.v0):
        try:
            solve = kkt_solver(system, system.mass, J)
            return system.x0, warned(
                system, system.v0, change_of(solve, np.zeros(system.size), gap)
            )
        except SolverError:
            if rigid:
                raise
    return consistent_start(compilation.compile_system(system), scheme)[:2]


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
    """Whether a body is a beam with directors, the first of which have no mass: M alone determines
    no accelerations.
    """
    return any(part.gather.law is Law.BEAM for part in system.elastic)


def speed_of(v: np.ndarray) -> float:
    """The largest velocity in v (n,), at least 1."""
    return max(1.0, float(np.abs(v).max(initial=0.0)))


def closed(system: System, phi: np.ndarray, J: Array) -> None:
    """Refuse an initial state that the joints do not hold in: phi (m,) over what large changes make
    of it, by J (m, n).
    """
    # of axes and angles 1, whatever the size of the system
    large = np.sqrt((J * J) @ scale_of(system) ** 2)
    wrong = np.flatnonzero(np.abs(phi) > 1e-6 * np.maximum(large, system.scale))
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
    return Instant(
        0.0, model.system.x0, model.system.v0, np.zeros(model.constraints, bool), first=True
    )


def begins_by_jump(model: Compiled) -> bool:
    """Whether a step finds by itself what steps begin with, see `pieces.release`: where joints ask
    for no accelerations.

    It takes 0.1 ms of a beam of 100 cells, where matrices of SciPy take 1.9 ms; runs of 100 steps
    take 3 ms. Forces that depend on the motion are left to those: factors of bands and blocks are
    of the symmetric part of W alone.
    """
    dead = not compilation.reads_slopes(model) and not any(force.reacts for force in model.forces)
    free = not model.pattern and has_steady_joints(model) and dead
    return free and is_filtered(model.system) and not has_massless_directors(model.system)


def consistent_start(
    model: Compiled,
    scheme: GeneralizedAlpha,
    at: Instant | None = None,
    filtered: bool | None = None,
    before: np.ndarray | None = None,
) -> Start:
    """State, accelerations and multipliers at the start, of the rows that hold.

        Phi_q v + Phi_t = 0,    M q'' + Phi_q^T lambda = -f,    Phi'' = 0

    Steps of elastic bodies begin with M + (gh C + K) / bh in place of M: under a load that starts
    as a step M^-1 f is huge in the waves that the step h does not resolve, and the run would carry
    them on. So does whatever is `filtered`; what is said not to be is found by M alone, but of beams
    whose M is singular. Of a motion that goes on, accelerations `before` (n,) are kept, and what has
    changed is filtered. What that leaves out is of second order in h. What is shown, and read
    within steps, balances all forces by M, also where what touches holds the first step. Where nothing holds what begins
    to move, q'' K q'' < 0, steps begin with M. An impulse, of drives that begin with a rate or of
    joints that lock, changes velocities by `jump`. By M alone a drive would turn one node of a
    beam, with rates of strain that no step resolves: a damped beam driven at 1 mrad/s then began
    with 0.16 J in place of 6e-7 J.
    """
    at = at or start_of(model)
    system = model.system
    h = scheme.step
    on = ~at.off
    x = at.x
    v = at.v
    phi, J = (
        part[on]
        for part in of_joints(model, at, "gap", (), lambda: compilation.gap(model, x, at.time))
    )
    closed(held(system, on), phi, J)
    invert = partial(augmented, model) if model.pattern else None
    still = np.zeros(len(x))
    k = np.arange(5.0)[:, None]

    def along(d: float, *rates: np.ndarray) -> np.ndarray:
        """Phi (5, m) at the instants 0, d, ..., 4 d on the path with the given derivatives at its
        start.
        """
        path = x + sum(
            (k * d) ** (order + 1) * rate / (order + 1) for order, rate in enumerate(rates)
        )
        return compilation.gaps(model, path, at.time + k.ravel() * d)[:, on]

    # joints that neither turn nor move have no curvature: two evaluations of paths are left out
    steady = (
        is_linear(system.constraints) | ~on
    ).all()  # straight paths stay on what is linear and independent of time
    d = DRIFT * h
    drift = (
        np.zeros(len(phi))
        if steady
        else of_joints(
            model, at, "drift", (d, on.tobytes()), lambda: RATE @ along(d, still) / (12 * d)
        )
    )
    leap = partial(jump, model, held(system, on), x, J, h=h, invert=invert)
    v = (
        projected(held(system, on), v, J, drift, leap, invert)
        if at.first
        else v + leap(J @ v + drift)
    )
    f = compilation.forces(model, x, v, at.time, at.memory)
    d = CURVATURE * h
    bend = np.zeros(len(phi)) if steady else -BEND @ along(d, v) / (12 * d * d)
    known = still if before is None else before
    am, af, _, beta = scheme.coefficients
    late = am - af  # a is q'' at t + (am - af) h

    def start_by(M: Array) -> Start:
        """The start with a matrix (n, n) in place of the mass."""
        kkt = kkt_solver(held(system, on), M, J, at.first, invert)

        def solve(f: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            change, multipliers = kkt(f - system.mass @ known, g - J @ known)
            return known + change, multipliers

        a, multipliers = solve(-f, bend)
        for _ in range(starting.REACTIONS if any(force.reacts for force in model.forces) else 0):
            pushed = (
                compilation.evaluate(model, x, v, at.time, at.memory, spread(multipliers, on))[0]
                - J.T @ multipliers
            )
            a, multipliers = solve(-pushed, bend)
        change = still if steady else kkt(still, -JERK @ along(d, v, a) / (2 * d**3))[0]
        return Start(
            x,
            v,
            a,
            spread(multipliers, on),
            np.stack([h**2 * (1 / 6 - beta - 0.5 * late) * change, late * h * change]),
        )

    massless = has_massless_directors(system)
    touches = len(model.arrays.forces.judged) > 0
    M = system.mass
    alone = filtered is False
    filtered = massless or (is_filtered(system) if filtered is None else filtered)
    if not filtered and (alone or not touches):
        return start_by(M)
    method = method_of(scheme, Newton(), h, model)
    state = model, x, np.zeros(len(on)), at.time, method.gh, at.memory, v
    if touches:  # what touches at the start is held by it
        M = M + compilation.probe_tangent(*state) / method.bh
    if not filtered:
        return start_by(M)._replace(balance=start_by(system.mass).shown)
    # M^-1 f of a torque that starts as a step: a slider is 1.2e-7 m off after 2 ms, 3.3e-9 m with
    # the step's own matrix
    K = compilation.tangent(*state)
    start = start_by(system.mass + K / method.bh)
    if massless:
        return (
            start
            if system.components
            else start._replace(balance=massive(system, start, start_by, K / method.bh))
        )
    if float(start.a @ (K @ start.a)) < 0.0:
        return start_by(M)
    return start._replace(balance=start_by(system.mass).shown)


def massive(
    system: System, start: Start, start_by: Callable[[Array], Start], K: Array
) -> tuple[np.ndarray, np.ndarray]:
    """q'' (n,) and multipliers (m,) that balance all forces where directors have no mass, which
    follow at once: those of M and SOFT of the stiffness K that filters the `start`.

    The accelerations of what has no mass have no bound there, and are those of the start.
    """
    found = start_by(system.mass + SOFT * K)
    mass = system.mass.diagonal()
    return np.where(mass > 1e-12 * mass.max(initial=0.0), found.a, start.a), found.multipliers


def of_joints(
    model: Compiled, at: Instant, name: str, parts: tuple[Any, ...], make: Callable[[], Found]
) -> Found:
    """What follows from joints and their histories at an instant; where motions start it is found
    once for all numbers.
    """
    system = model.system
    if not at.first or (system.signals and not repeatable(system)):
        return make()
    return prepare(system).find(
        name, (system.constraints, system.probes, system.signals, at.x, at.time, *parts), make
    )


def filtered_start(model: Compiled, scheme: GeneralizedAlpha) -> Start | None:
    """The start of rigid bodies without the waves that its step does not resolve; None where
    nothing holds what begins to move.

    None for elastic bodies, too, which start so anyway.
    """
    start = None if is_filtered(model.system) else consistent_start(model, scheme, filtered=True)
    return start._replace(balance=None) if start and start.balance else None


def jump(
    model: Compiled,
    system: System,
    x: np.ndarray,
    J: np.ndarray,
    gap: np.ndarray,
    h: float,
    invert: Inverter | None,
) -> np.ndarray:
    """Change u (n,) of velocities by an impulse of the rows J (m, n) of joints, which closes a gap
    Phi_x v + Phi_t (m,).

    M u + J^T mu = 0 of rigid bodies. Of strains that vibrate by w [rad/s], with the damping time
    beta, rates keep

        (1 + 2 y) / (1 + y)^2,  y = h beta w^2 + (h w)^2 / 4,    u = 2 d(M d0) - d(M d(M d0)),
        (M + h C + h^2 K / 4) d(f) + J^T mu = f,    J d = J d0 = -gap

    of it: to second order all that a step resolves, and little of what it does not, whose forces
    would be those of no motion.
    """
    M = system.mass
    if not system.elastic:
        return change_of(kkt_solver(system, M, J, False, invert), np.zeros(len(x)), gap)
    # by M alone an arm with 5 ms of damping that catches a mass fails at any step; a bar that does
    # keeps its energy within 5 % so, and loses 8 to 24 % with M
    A = M + 0.25 * h * h * csr_array(compilation.elastic_tangent(model, x, 4.0 / h))  # K + 4 / h C
    solve = kkt_solver(system, csr_array(A), J, False, invert)
    once = change_of(solve, np.zeros(len(x)), gap)  # M d0 is a force of the rows
    return 2.0 * once - change_of(solve, M @ once, gap)


def change_of(solve: Solver, f: np.ndarray, gap: np.ndarray) -> np.ndarray:
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
    invert: Inverter | None,
) -> np.ndarray:
    """v (n,) at the first instant, and what closes the rates of the joints (m,), of which `drift`
    is the part of time; a warning says so, and round-off stays.

        Phi_x v + Phi_t = 0

    Linear rows that nothing drives change v by the least kinetic energy, as where they are
    eliminated, and all others by `leap`.
    """
    given = v
    fixed = is_linear(system.constraints)
    least = ROUND_OFF * speed_of(v)
    if np.abs(J[fixed] @ v).max(initial=0.0) > least:
        solve = kkt_solver(
            keep_constraints(system, np.flatnonzero(fixed)),
            assembly.mass_of_speeds(system),
            J[fixed],
            True,
            invert,
        )
        v = v + change_of(solve, np.zeros(len(v)), J[fixed] @ v)
    if np.abs(gap := J @ v + drift).max(initial=0.0) > least:
        v = v + leap(gap)
    return warned(system, given, v - given, bool(np.abs(drift).max(initial=0.0) > least))


def warned(system: System, v: np.ndarray, change: np.ndarray, driven: bool = False) -> np.ndarray:
    """v (n,) at the first instant with its change (n,), of which a warning says; round-off is left
    out.
    """
    if float(np.abs(change).max(initial=0.0)) <= 1e-9 * speed_of(v):
        return v
    notify_projected(system, change, DRIVEN if driven else "")
    return np.asarray(v + change)


def held(system: System, on: np.ndarray) -> System:
    """The system with the rows that hold (m,)."""
    return system if on.all() else keep_constraints(system, np.flatnonzero(on))


def spread(values: np.ndarray, on: np.ndarray) -> np.ndarray:
    """Values of the rows that hold (i,), and 0 for the others, (m,)."""
    found = np.zeros(len(on))
    found[on] = values
    return found


def kkt_solver(
    system: System, M: Array, J: np.ndarray, first: bool = True, invert: Inverter | None = None
) -> Solver:
    """What solves for accelerations with J (m, n) of the rows that a system holds; redundant ones
    are named in the error.

        [[M, J^T], [J, 0]] (a, l) = (f, g)

    `invert` gives the inverse of this matrix of M and J, if not `saddle`. In a singular position,
    where rows depend on each other for an instant, independent ones determine a, and l has least
    norm; behind the `first` instant of a motion no position is looked at any further. Factors of
    the mass of a system that is not large are found once.
    """
    if M is not system.mass or invert or system.size > SHARED:
        return factored(system, M, J, first, invert)
    parts = M, system.constraints, system.probes, system.lift, system.x0, first, J.tobytes()
    return prepare(system).find("start", parts, lambda: factored(system, M, J, first))


def factored(
    system: System, M: Array, J: np.ndarray, first: bool, invert: Inverter | None = None
) -> Solver:
    """`kkt_solver`, found anew."""
    size = float(abs(M).max()) or 1.0
    rows = ranks.independent_rows(J, units=scale_of(system))
    if len(rows) < len(J) and first and not singular_start(system):
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
    """The error of a start whose accelerations are not determined: unknowns without mass that no
    joint holds.
    """
    m = M.diagonal()
    names = [coordinate_names(system)[k] for k in np.flatnonzero(m <= 1e-12 * m.max(initial=0.0))]
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
    approximate = large.inverse(A, large.rigid_motions(model))
    spread = large.refined(A, approximate, rows.toarray())
    schur = rows @ spread.T

    def solve(right: np.ndarray) -> np.ndarray:
        f = right[:n]
        g = scale * right[n:]
        x = large.refined(A, approximate, (f + rows.T @ g)[None, :])[0]
        multipliers = np.linalg.solve(schur, rows @ x - g) if m else np.zeros(0)
        return np.concatenate([x - multipliers @ spread, scale * multipliers])

    return solve


def first_state(
    model: Compiled, start: Start, c: float, memory: np.ndarray | None = None, time: float = 0.0
) -> State:
    """The state as outputs show it, with what the first step begins with for `begin_steps`, in the
    order of the model.

    `memory` as of `compiled.place`.
    """
    moved = (start.v + start.shift[0], start.a + start.shift[1])
    (shown, multipliers) = start.shown
    xc, vc, ac, early, now = (
        np.ascontiguousarray(part[model.order]) for part in (start.x, *moved, start.a, shown)
    )
    history, past = (np.zeros((stepping.HISTORY, len(part))) for part in (xc, start.multipliers))
    history[0], past[0] = early, start.multipliers * c
    memory = compilation.accepted(model, start.x, start.v) if memory is None else memory
    push, gradients = compilation.working(model, start.x, start.v, time, memory, start.multipliers)
    return State(
        x=xc,
        v=vc,
        a=ac,
        acceleration=now,
        multipliers=multipliers * c,
        history=history,
        past=past,
        known=np.array([1]),
        order=np.array([0]),
        memory=memory,
        speed=np.array([compilation.size(model, start.v)]),
        parts=np.array([0]),
        change=np.array([np.inf]),
        work=np.zeros(2),
        push=push,
        gradients=gradients,
        signals=signal_table(model.system, np.array([time]))[0]
        if histories_work(model.system)
        else np.zeros(0),
    )


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
    model: Compiled, start: Start, method: Method, stored: int, memory: np.ndarray | None = None
) -> Step:
    """A step with its space and room for so many states; `memory` as in `first_state`."""
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
    state = first_state(model, start, method.c, memory)
    space.gradients[evaluation.ACCEPTED] = state.gradients
    # one memory, so that a step copies them once
    state = state._replace(gradients=space.gradients[evaluation.ACCEPTED])
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
