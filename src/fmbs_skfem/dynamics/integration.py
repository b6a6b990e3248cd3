"""Time integration of a System: consistent start, compiled steps in chunks, halving on failure, partial results on errors."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import TypeAlias

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from ..bodies.laws import Law
from ..core import lapack
from ..core.errors import InputError, Reason, SolverError, say
from ..core.linalg import independent_rows
from ..core.notices import notify
from ..systems import compiled as compilation
from ..systems.compiled import Compiled, compile_system, signal_table
from ..systems.quartic import Quartic
from ..systems.redundancy import singular_start, without_redundant
from ..systems.system import System
from . import checkpoint as checkpoints
from . import large, stepping
from .checkpoint import Checkpoint, Moment, Record, Resumed, Rows
from .stepping import Method, State, Work

Advance: TypeAlias = Callable[..., tuple[int, int]]  #: `stepping.advance` after its first argument

REASONS = {
    stepping.NOT_CONVERGED: Reason.NOT_CONVERGED,
    stepping.DIVERGED: Reason.DIVERGED,
    stepping.NOT_FINITE: Reason.NOT_FINITE,
    stepping.SINGULAR: Reason.SINGULAR_TANGENT,
}
PLATES = (Law.MEMBRANE, Law.SHELL)
HALVINGS = 6  #: a failed step is tried with h / 2, ..., h / 2^6
WHOLE = large.REMEASURE  #: steps are taken in multiples of this number, so that a stop between them changes nothing
PACE = 0.2  #: time between two looks at a run that is watched [s]


@dataclass(frozen=True)
class GeneralizedAlpha:
    """Step h [s] and spectral radius rho_inf at infinite frequency, 0 (asymptotic annihilation) to 1 (no damping)."""

    step: float
    rho_inf: float = 0.8

    def __post_init__(self) -> None:
        if not (np.isfinite(self.step) and self.step > 0):
            raise InputError(say("analysis.step", "a positive time [s]", self.step))
        if not 0 <= self.rho_inf <= 1:
            raise InputError(say("analysis.rho_inf", "a number between 0 and 1", self.rho_inf))

    @property
    def coefficients(self) -> tuple[float, float, float, float]:
        """alpha_m, alpha_f, gamma, beta of Arnold and Bruels."""
        rho = self.rho_inf
        am, af = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        gamma = 0.5 + af - am
        return am, af, gamma, (gamma + 0.5) ** 2 / 4


@dataclass(frozen=True)
class Newton:
    """Iteration control; the tolerance is relative to the norm of the reference coordinates."""

    tolerance: float = 1e-10
    iterations: int = 25
    slow: float = 0.05  #: contraction above which the iteration matrix is factored anew

    def __post_init__(self) -> None:
        if not 0 < self.tolerance < 1e-2:
            raise InputError(say("newton.tolerance", "a number between 0 and 0.01", self.tolerance))


@dataclass(frozen=True)
class Statistics:
    """What a run cost."""

    steps: int
    iterations: int
    factorisations: int
    halved: int
    cpu_s: float
    wall_s: float
    solver: str = ""  #: of the linear systems


@dataclass(frozen=True)
class Trajectory:
    """Motion of a system at stored times."""

    system: System
    times: np.ndarray  #: (s,) [s]
    x: np.ndarray  #: (s, n)
    v: np.ndarray  #: (s, n)
    a: np.ndarray  #: (s, n), accelerations q''
    multipliers: np.ndarray  #: (s, m), physical
    statistics: Statistics


def method_of(scheme: GeneralizedAlpha, newton: Newton, h: float, scale: float) -> Method:
    am, af, gamma, beta = scheme.coefficients
    bh, gh = (1 - am) / (h**2 * beta * (1 - af)), gamma / (h * beta)
    return Method(h, am, af, gamma, beta, bh, gh, h**2 * beta, newton.tolerance * scale, newton.iterations, newton.slow)


def workspace(model: Compiled) -> Work:
    A, n, m, j = model.arrays, model.system.size, model.constraints, len(model.arrays.probes_offset)
    width = A.mass.store.shape[1] - 1
    stored = 0 if model.plan else n
    body, work = model.buffers()
    return Work(
        lapack.ADDRESSES,
        np.zeros((stored, width + 1)),
        np.zeros((n + m, n + m) if A.dense else (0, 0)),
        np.zeros((1, 1) if A.dense else (stored, 3 * width + 1)),
        np.zeros(n + m if A.dense else n, np.int32),
        np.zeros((m, m)),
        np.zeros(m, np.int32),
        np.zeros((m, stored)),
        np.zeros((m, stored)),
        np.zeros((m, j)),
        np.zeros((1, n + m)),
        np.zeros(j),
        np.zeros(j),
        np.zeros(A.pairs.size),
        body,
        work,
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(m),
        np.zeros(1, np.int64),
    )


@dataclass
class Run:
    """A run between two steps; its arrays are filled in place."""

    model: Compiled
    scheme: GeneralizedAlpha
    newton: Newton
    method: Method
    kept: np.ndarray  #: (s,) numbers of the steps whose states are stored
    rows: np.ndarray  #: (steps + 1,) row of every step in the trajectory, -1 for none
    state: State
    work: Work
    advance: Advance
    out: np.ndarray  #: (3, s, n) x, v, q'' in the order of the model
    multipliers: np.ndarray  #: (s, m)
    counters: np.ndarray
    cpu: float  #: process time at the start, less what the run took before it was resumed [s]
    wall: float
    done: int = 0  #: steps
    facts: dict[str, str] = field(default_factory=dict)  #: of model and method, found when they are needed

    @property
    def steps(self) -> int:
        return len(self.rows) - 1


def integrate(
    system: System,
    scheme: GeneralizedAlpha,
    duration: float,
    newton: Newton | None = None,
    every: int | np.ndarray = 1,
    progress: Callable[[float], None] | None = None,
    record: Record | None = None,
    resume: Resumed | None = None,
) -> Trajectory:
    """Integrate from t = 0 over `duration` [s]; states are stored every `every` steps, or after the steps listed there.

    The number of steps is duration / step, rounded. Initial velocities are projected onto the constraints with a notice. A step
    that fails is halved; SolverError carries reason, time, worst residuals by name and the partial trajectory.

    `record` sees the run a few times a second and may keep its states and a checkpoint; `resume` goes on from those, and ends in
    the same numbers as a run that was never stopped.
    """
    steps = round(duration / scheme.step)
    if steps < 1:
        raise InputError(say("analysis.duration", f"at least one step of {scheme.step} s", f"{duration} s"))
    run = begun(without_redundant(system), scheme, newton or Newton(), kept_steps(every, steps), steps, resume)
    watched = progress is not None or record is not None
    chunk = WHOLE if watched else steps
    while run.done < steps:
        begin = clock.perf_counter()
        past = run.done % WHOLE
        march(run, min(WHOLE - past if past else chunk, steps - run.done))
        if watched:
            chunk = paced(chunk, clock.perf_counter() - begin)
        if progress:
            progress(run.done / steps)
        if record:
            record(moment(run))
    return trajectory(run)


def begun(
    system: System, scheme: GeneralizedAlpha, newton: Newton, kept: np.ndarray, steps: int, resume: Resumed | None = None
) -> Run:
    """A run at its start, or where it was left."""
    model = compile_system(system)
    n, m = system.size, model.constraints
    start = consistent_start(model, scheme) if resume is None else (system.x0, system.v0, np.zeros(n), np.zeros(m))
    method = method_of(scheme, newton, scheme.step, system.scale)
    rows = np.full(steps + 1, -1)
    rows[kept] = np.arange(len(kept))
    state, counters = first_state(model, start, method.c), np.zeros(4, np.int64)
    out, multipliers = np.zeros((3, len(kept), n)), np.zeros((len(kept), m))
    out[:, 0] = state.x, state.v, state.acceleration
    multipliers[0] = start[3]
    clocks = clock.process_time(), clock.perf_counter()
    stage = (model, scheme, newton, method, kept, rows, state, workspace(model), stepper(model), out, multipliers, counters)
    run = Run(*stage, *clocks)
    if resume is not None:
        take_up(run, resume)
    return run


def take_up(run: Run, resume: Resumed) -> None:
    """Put a run where it was left."""
    held, model = resume.checkpoint, run.model
    run.facts = checkpoints.facts(model, run.method, run.steps, run.kept)
    checkpoints.restore(held, run.facts, run.state, run.work, large_of(run), run.method, run.counters)
    for k, part in enumerate((resume.rows.x, resume.rows.v, resume.rows.a)):
        run.out[k, : held.kept] = part[: held.kept, model.order]
    run.multipliers[: held.kept] = resume.rows.multipliers[: held.kept]
    run.done, run.cpu, run.wall = held.done, run.cpu - held.cpu_s, run.wall - held.wall_s


def large_of(run: Run) -> large.Large | None:
    """The factors of a large model, which are kept outside of the work space."""
    return run.advance.__self__ if run.model.plan else None  # type: ignore[attr-defined]


def paced(chunk: int, seconds: float) -> int:
    """Steps to take at once, in units of WHOLE, so that they take about PACE seconds; results do not depend on it."""
    if seconds < 0.5 * PACE:
        return 2 * chunk
    return max(WHOLE, chunk // 2 // WHOLE * WHOLE) if seconds > 2.0 * PACE else chunk


def march(run: Run, many: int) -> None:
    """Take some steps, the last one possibly halved; SolverError where it cannot be taken."""
    model, scheme, newton, done = run.model, run.scheme, run.newton, run.done
    signals, broken = leading_signals(model.system, scheme.step * (done + 1 + np.arange(many)))
    status, taken = run.advance(
        run.state, run.work, run.method, signals, run.rows[done + 1 :], run.out, run.multipliers, run.counters
    )
    run.done += taken
    if status == stepping.DONE and broken is not None:
        broken.partial = trajectory(run)
        raise broken
    if status == stepping.DONE:
        return
    status, reached = halved_step(model, run.advance, run.state, run.work, scheme, newton, run.done, run.counters)
    if status != stepping.DONE:
        raise failure(model, run.work, status, reached, trajectory(run), scheme, run)
    run.done += 1
    row = run.rows[run.done]
    if row >= 0:
        run.out[:, row] = run.state.x, run.state.v, run.state.acceleration
        run.multipliers[row] = run.state.multipliers / run.method.c


def stored(run: Run) -> int:
    """Number of states stored so far."""
    return int(np.searchsorted(run.kept, run.done, side="right"))


def states(run: Run, first: int, last: int) -> Rows:
    """Stored states from `first` up to `last` in the order of the system's unknowns."""
    inverse = np.argsort(run.model.order)
    x, v, a = (part[first:last] if run.model.plan else part[first:last, inverse] for part in run.out)
    return Rows(run.scheme.step * run.kept[first:last], x, v, a, run.multipliers[first:last])


def trajectory(run: Run) -> Trajectory:
    """The motion so far."""
    found = states(run, 0, stored(run))
    taken, iterations, factorisations, halved = (int(k) for k in run.counters)
    seconds = clock.process_time() - run.cpu, clock.perf_counter() - run.wall
    totals = Statistics(taken, iterations, factorisations, halved, *seconds, solver_of(run.model, run.advance))
    return Trajectory(run.model.system, found.times, found.x, found.v, found.a, found.multipliers, totals)


def moment(run: Run) -> Moment:
    """What `record` sees."""

    def checkpoint() -> Checkpoint:
        run.facts = run.facts or checkpoints.facts(run.model, run.method, run.steps, run.kept)
        arrays = checkpoints.arrays(run.state, run.work, large_of(run), run.counters)
        seconds = clock.process_time() - run.cpu, clock.perf_counter() - run.wall
        return Checkpoint(run.done, stored(run), run.facts, arrays, *seconds)

    size = run.out.itemsize * (3 * run.out.shape[2] + run.multipliers.shape[1])
    return Moment(run.done, run.steps, run.scheme.step * run.done, stored(run), size, partial(states, run), checkpoint)


def kept_steps(every: int | np.ndarray, steps: int) -> np.ndarray:
    """Numbers of the steps after which states are kept, 0 first."""
    if isinstance(every, np.ndarray):
        kept = np.union1d(0, every.astype(np.int64))
        if kept[0] < 0 or kept[-1] > steps:
            raise InputError(say("steps to keep", f"numbers from 0 to {steps}", f"{kept[0]} to {kept[-1]}"))
        return kept
    if every < 1:
        raise InputError(say("analysis.every", "at least 1", every))
    return np.arange(0, steps + 1, every)


def solver_of(model: Compiled, advance: Advance) -> str:
    """Name of the solver of the linear systems, for reports."""
    if model.plan is not None:
        return str(advance.__self__.inverse.label)  # type: ignore[attr-defined]
    return "dense LU" if model.arrays.dense else f"band Cholesky or LU, half width {model.arrays.mass.store.shape[1] - 1}"


def stepper(model: Compiled) -> Advance:
    """The time step of a model: compiled, or for a large one with sparse factors."""
    if model.plan is not None:
        return large.Large(model).advance
    return partial(stepping.advance, model.arrays)


def leading_signals(system: System, times: np.ndarray) -> tuple[np.ndarray, SolverError | None]:
    """Signals at the given times up to the first one where a value is not finite, and the error that belongs there."""
    table = signal_table(system, times)
    bad = np.argwhere(~np.isfinite(table))
    if len(bad) == 0:
        return table, None
    s, k = bad[0]
    text = f"signal {k} of a joint or load is {table[s, k]} at t = {times[s]:.6g} s"
    return table[:s], SolverError(text, Reason.NOT_FINITE, float(times[s]))


def finite_signals(system: System, times: np.ndarray) -> np.ndarray:
    """Signals at the given times; a value that is not finite stops the run with its place."""
    table, broken = leading_signals(system, times)
    if broken is not None:
        raise broken
    return table


def halved_step(
    model: Compiled,
    advance: Advance,
    state: State,
    work: Work,
    scheme: GeneralizedAlpha,
    newton: Newton,
    done: int,
    counters: np.ndarray,
) -> tuple[int, float]:
    """One step of the full size in 2, 4, ... parts; the status and the time of the last failure."""
    full = method_of(scheme, newton, scheme.step, model.system.scale)
    saved = [array.copy() for array in state]
    status, reached = stepping.NOT_CONVERGED, scheme.step * done
    empty, none = np.zeros((3, 1, model.system.size)), np.zeros((1, model.constraints))
    for halving in range(1, HALVINGS + 1):
        parts = 2**halving
        method = method_of(scheme, newton, scheme.step / parts, model.system.scale)
        state.multipliers[:] *= method.c / full.c
        state.known[0], state.order[0], work.kind[0] = 1, 0, 0
        counters[stepping.HALVED] += 1
        times = scheme.step * (done + (np.arange(parts) + 1) / parts)
        signals, nothing = finite_signals(model.system, times), np.full(parts, -1)
        status, taken = advance(state, work, method, signals, nothing, empty, none, counters)
        counters[stepping.STEPS] -= taken
        if status == stepping.DONE:
            state.multipliers[:] *= full.c / method.c
            state.known[0], state.order[0], work.kind[0] = 1, 0, 0
            counters[stepping.STEPS] += 1
            return status, scheme.step * (done + 1)
        reached = scheme.step * (done + taken / parts)
        for array, old in zip(state, saved, strict=True):
            array[:] = old
    return status, reached


class FailedStep(SolverError):
    """A step that could not be taken; `run` stands before it, its work space holds the last trial (see `diagnosis.explain`)."""

    def __init__(self, error: SolverError, run: Run) -> None:
        super().__init__(str(error), error.reason, error.time, error.worst, error.partial)
        self.run = run


def failure(
    model: Compiled,
    work: Work,
    status: int,
    time: float,
    partial: Trajectory,
    scheme: GeneralizedAlpha,
    run: Run | None = None,
) -> SolverError:
    """The error of a step that failed, with the worst residuals by name: forces [N] and gaps."""
    reason, n = REASONS[status], model.system.size
    c = method_of(scheme, Newton(), scheme.step / 2**HALVINGS, model.system.scale).c
    stepping.residual(model.arrays, work, c, finite_signals(model.system, np.array([time]))[0])
    work.rhs[0, :n] /= c
    values = np.abs(np.nan_to_num(work.rhs[0], nan=np.inf))
    names = coordinate_names(model.system)
    labels = [names[k] for k in model.order] + [f"joint {joint}.{label}" for joint, label in model.system.constraints.names]
    worst = tuple((labels[k], float(values[k])) for k in np.argsort(values)[::-1][:5])
    listed = ", ".join(f"{name}: {value:.3g}" for name, value in worst)
    text = f"{reason.value} at t = {time:.6g} s, also with the step divided by {2**HALVINGS}; largest residuals: {listed}"
    error = SolverError(f"{text}; try a smaller step, or look at loads and joints there (n = {n})", reason, time, worst, partial)
    return FailedStep(error, run) if run else error


def coordinate_names(system: System) -> list[str]:
    """A name for every unknown: body and coordinate of a full model, component and mode of a reduced one."""
    if system.components:
        return [f"{name} mode {k + 1}" for name, first, last in system.components for k in range(last - first)]
    names = [f"{body} coordinate {k}" for body, first, last in system.coordinates for k in range(last - first)]
    lead = csr_array(system.lift.matrix).tocsc()
    return [names[lead.indices[lead.indptr[j]]] for j in range(system.size)]


def first_state(model: Compiled, start: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray], c: float) -> State:
    x, v, a, multipliers = start
    xc, vc, ac = (np.ascontiguousarray(part[model.order]) for part in (x, v, a))
    history = np.zeros((stepping.HISTORY, len(x)))
    history[0] = ac
    return State(xc, vc, ac.copy(), ac, multipliers * c, history, np.array([1]), np.array([0]))


def consistent_start(model: Compiled, scheme: GeneralizedAlpha) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """x0, v0 with Phi_q v + Phi_t = 0, q'' and multipliers from M q'' + Phi_q^T lambda = -f, Phi'' = 0.

    Plates take M + (gh C + K) / bh in place of M: under a load that starts as a step M^-1 f is huge in the waves that the step h
    does not resolve, and the run would carry them on.
    """
    system, h = model.system, scheme.step
    x, v = system.x0, system.v0
    phi, J = compilation.gap(model, x)
    wrong = np.flatnonzero(np.abs(phi) > 1e-6 * system.scale)
    if len(wrong):
        worst = tuple((".".join(system.constraints.names[k]), abs(float(phi[k]))) for k in wrong[np.argsort(-np.abs(phi[wrong]))])
        listed = ", ".join(f"{name} by {gap:.3g}" for name, gap in worst)
        raise SolverError(f"the initial state does not satisfy the joints: {listed}", Reason.INCONSISTENT, 0.0, worst)
    M = csr_array(system.mass)
    if any(isinstance(part.gather, Quartic) or part.gather.law in PLATES for part in system.elastic):
        method = method_of(scheme, Newton(), h, system.scale)
        M = M + (compilation.tangent(model, x, np.zeros(len(phi)), 0.0, method.gh)) / method.bh
    solve = kkt_solver(model, csr_array(M), J)
    d = 1e-3 * h
    drift = (
        -25 * phi
        + 48 * gap_at(model, x, d)
        - 36 * gap_at(model, x, 2 * d)
        + 16 * gap_at(model, x, 3 * d)
        - 3 * gap_at(model, x, 4 * d)
    )
    change = solve(np.zeros(len(x)), -(J @ v + drift / (12 * d)))[0] if len(phi) else np.zeros(len(x))
    size = float(np.abs(change).max(initial=0.0))
    if size > 1e-9 * max(1.0, float(np.abs(v).max(initial=0.0))):
        notify(f"initial velocities are projected onto the joints; largest change {size:.3g} m/s")
        v = v + change
    f = compilation.forces(model, x, v)
    d = 0.25 * h
    path = [gap_at(model, x + k * d * v, k * d) for k in range(5)]
    curvature = (35 * path[0] - 104 * path[1] + 114 * path[2] - 56 * path[3] + 11 * path[4]) / (12 * d * d)
    a, multipliers = solve(-f, -curvature)
    return x, v, a, multipliers


def gap_at(model: Compiled, x: np.ndarray, t: float) -> np.ndarray:
    return compilation.gap(model, x, t)[0]


def kkt_solver(model: Compiled, M: csr_array, J: np.ndarray) -> Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Solve [[M, J^T], [J, 0]] (a, l) = (f, g); redundant rows are named in the error.

    In a singular position, where rows depend on each other for an instant, independent ones determine a, and l has least norm.
    """
    system, size = model.system, float(abs(M).max()) or 1.0
    rows = independent_rows(J)
    if len(rows) < len(J) and not singular_start(system):
        names = tuple((".".join(system.constraints.names[k]), 0.0) for k in np.setdiff1d(np.arange(len(J)), rows))
        listed = ", ".join(name for name, _ in names)
        text = f"redundant joints: {listed}; remove one, or let linear ones be eliminated"
        raise SolverError(text, Reason.INCONSISTENT, 0.0, names)
    try:
        bordered = augmented(model, M / size, J[rows]) if model.plan else splu(compilation.kkt(M / size, J[rows]).tocsc()).solve
    except RuntimeError as error:  # SuperLU: exactly singular
        raise weightless(system, M) from error

    def solve(f: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        z = bordered(np.concatenate([f / size, g[rows]]))
        found = size * z[len(f) :]
        return z[: len(f)], found if len(rows) == len(J) else np.linalg.lstsq(J.T, J[rows].T @ found, rcond=None)[0]

    return solve


def weightless(system: System, M: csr_array) -> SolverError:
    """The error of a start whose accelerations are not determined: unknowns without mass that no joint holds."""
    m = M.diagonal()
    names = [coordinate_names(system)[k] for k in np.flatnonzero(m <= 1e-12 * m.max(initial=0.0))]
    listed, remedy = ", ".join(names[:5]), "give the body a density or a mass, or hold it by joints"
    text = f"neither joints nor a mass determine the motion of {listed}; {remedy}"
    return SolverError(text, Reason.SINGULAR_TANGENT, 0.0, tuple((name, 0.0) for name in names[:5]))


def augmented(model: Compiled, M: csr_array, J: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Solve [[M, J^T], [J, 0]] for large models by M + J^T J, which is definite where M is on the null space of J."""
    n, m = M.shape[0], len(J)
    scale = np.sqrt(M.diagonal().max()) / max(float(np.abs(J).max(initial=0.0)), 1e-300)
    rows = csr_array(scale * J)
    A = csr_array(M + rows.T @ rows)
    approximate = large.inverse(A, large.rigid_motions(model))
    spread = large.refined(A, approximate, rows.toarray())
    schur = rows @ spread.T

    def solve(right: np.ndarray) -> np.ndarray:
        f, g = right[:n], scale * right[n:]
        x = large.refined(A, approximate, (f + rows.T @ g)[None, :])[0]
        multipliers = np.linalg.solve(schur, rows @ x - g) if m else np.zeros(0)
        return np.concatenate([x - multipliers @ spread, scale * multipliers])

    return solve
