r"""What can be measured where a solve stopped, without knowing why.

    A = D [[W, J^T], [J, 0]] D,  W = bh M + gh C + K (dynamics) or K (statics),  J = Phi_x,  D: rows of size 1
    weakest direction    min |A y| / |A|, |y| = 1, by inverse iteration on A^T A
    inertia              eigenvalues of D W D on the null space of J D: negative ones where the equilibrium is unstable or the step
                         is too long for an indefinite start
    dead centre          smallest singular value of the unit rows of J, beside that of the start
    stiffest wave        h omega >= h max_i sqrt(K_ii / M_ii)      (Rayleigh quotients of unit vectors)

Source of the inverse iteration: Golub and Van Loan, Matrix Computations, 4th ed., Johns Hopkins
2013, section 8.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.linalg import eigvalsh
from scipy.sparse import csr_array

from ...bodies.stress_recovery import extreme_strains
from ...core.algebra import ranks, saddle
from ...core.algebra.saddle import Saddle
from ...core.errors import Reason, SolverError
from ...core.storage.records import dataclass
from ...systems import compiled
from ...systems.compiled import Compiled, compile_system, signal_table
from ...systems.system import System
from ...systems.terms import elastic as terms
from ..compiled_step.touching import HALVINGS
from ..histories import signal_names
from ..integration import FailedStep
from ..names import owners
from ..outputs import centre_lines, skins
from ..run import OpenRun, last_residual
from ..scheme import method_of

SHIFT = 1e-13  #: of the balanced matrix, so that its factors exist where it is singular
SPARSE = 20_000  #: unknowns up to which the weakest direction is found
DENSE = 1_500  #: unknowns up to which eigenvalues are found
WINDOW = 32  #: steps before the failure to which a change of a signal is compared
FINE = 4096  #: parts of a step in which a jump of a signal is looked for
AHEAD = 2.0  #: steps over which a dead centre is looked for on the way ahead
PLACES = 16  #: positions there
WAY = (0.25, 0.5, 0.75, 1.0)  #: parts of a step at which loads are looked at
SHORTEST = 1e-9  #: step where none is known [s]
SIZE = 1e-12  #: relative size below which a mass is none


@dataclass(frozen=True)
class StoppedSolve:
    """Last good state and the trial state beyond it, in the order of the system's unknowns.

        W = K + gh C + bh M

    at the trial state, with bh and gh of the `short` step, and J the rows of the joints; in statics
    W = K.
    """

    model: Compiled
    good: float  #: time [s] or load factor of the last good state
    at: float  #: time or load factor that was not reached
    h: float  #: step [s]; 0 in statics
    x: np.ndarray  #: (n,)
    v: np.ndarray
    multipliers: np.ndarray  #: (m,) physical
    trial: np.ndarray  #: (n,) last trial state; the last good one where that is not finite
    residual: np.ndarray  #: (n + m,) forces [N] and gaps of the trial state
    short: tuple[float, float]  #: bh and gh of the shortest step that was tried; 0 in statics
    whole: tuple[float, float]  #: of the whole step
    memory: np.ndarray | None = None  #: (l,) of forces at the last good state, see `compiled.place`

    @property
    def system(self) -> System:
        return self.model.system

    @cached_property
    def matrix(self) -> csr_array:
        """Iteration matrix (n, n) at the trial state.

            W = K + gh C + bh M

        with bh and gh of the step.
        """
        at = self.at if self.h else self.good
        bh, gh = self.short
        return csr_array(
            compiled.tangent(self.model, self.trial, self.multipliers, at, gh, self.memory)
            + bh * csr_array(self.system.mass)
        )

    @cached_property
    def jacobian(self) -> np.ndarray:
        """J at the trial state (m, n)."""
        return compiled.gap(self.model, self.trial, self.at)[1]


def stop_of(error: SolverError) -> StoppedSolve | None:
    """Where a solve stopped; None where it never started.

    Of a time step from its run, else from the motion found so far, `error.partial`; None where that
    is missing.
    """
    if isinstance(error, FailedStep):
        return stop_of_run(error.run, error.time)
    if error.partial is None:
        return None
    last = error.partial
    static = error.partial.statistics.solver == ""
    model = compile_system(last.system)
    x = last.x[-1]
    kept = last.states
    multipliers = last.multipliers[-1]
    memory = compiled.memories(model, kept.times, last.x, last.v, last.a, last.memory)[-1]
    residual = np.full(len(x) + len(multipliers), np.nan)
    if np.isfinite(signal_table(last.system, np.array([error.time]))).all():
        residual = np.concatenate(
            compiled.evaluate(model, x, last.v[-1], error.time, memory, multipliers)
        )
    h = 0.0 if static else float(error.time - last.times[-1])
    if not static and error.reason is not Reason.UNSTABLE:
        h = max(h, float(np.diff(last.times[-2:]).max(initial=SHORTEST)))
    return StoppedSolve(
        model=model,
        good=float(last.times[-1]),
        at=error.time,
        h=h,
        x=x,
        v=last.v[-1],
        multipliers=multipliers,
        trial=x,
        residual=residual,
        short=(0.0, 0.0),
        whole=(0.0, 0.0),
        memory=memory,
    )


def stop_of_run(run: OpenRun, time: float) -> StoppedSolve:
    """The same for a step that was halved in vain."""
    model = run.model
    back = np.argsort(run.model.order)
    method = method_of(run.scheme, run.newton, run.scheme.step / 2**HALVINGS, model)
    rest = last_residual(run, time)
    state = run.step.state
    whole = run.step.method
    x = state.x[back]
    trial = run.step.space.x[back]
    return StoppedSolve(
        model=model,
        good=run.scheme.step * run.done,
        at=time,
        h=run.scheme.step,
        x=x,
        v=state.v[back],
        multipliers=state.multipliers / whole.c,
        trial=trial if np.isfinite(trial).all() else x,
        residual=rest,
        short=(method.bh, method.gh),
        whole=(whole.bh, whole.gh),
        memory=state.memory,
    )


def shares(names: Sequence[str], values: np.ndarray) -> dict[str, float]:
    """Part of the square of a vector v that belongs to every name, largest first.

        sum v_i^2 / |v|^2    over the entries i of a name

    `names` and `values` have the same length.
    """
    total: dict[str, float] = {}
    for name, value in zip(names, values**2 / max(float(values @ values), 1e-300), strict=True):
        total[name] = total.get(name, 0.0) + float(value)
    return dict(sorted(total.items(), key=lambda item: -item[1]))


def saddle_of(stop: StoppedSolve) -> Saddle | None:
    """Factors of the matrix (n + m, n + m) at the trial state, joint rows of length 1, shifted so
    that they exist; None if not.
    """
    size = saddle.scales(stop.matrix)
    scale = np.append(size, 1.0 / ranks.lengths(stop.jacobian * size))
    return saddle.factor(saddle.matrix(stop.matrix, stop.jacobian), SHIFT, scale)


def weakest(stop: StoppedSolve) -> tuple[float, np.ndarray] | None:
    """Smallest singular value of A relative to |A|, and the right vector y (n + m,) in balanced
    unknowns.

        |A y| / |A|,    |y| = 1

    None for more than 20000 unknowns, and where the matrix is not finite or has no factors.
    """
    if stop.system.size > SPARSE or not np.isfinite(stop.matrix.data).all():
        return None
    found = saddle_of(stop)
    if found is None:
        return None
    A = found.balanced
    y = np.cos(np.arange(len(found.scale)))
    for _ in range(4):
        y = found.factors.solve(found.factors.solve(y, trans="T"))
        y = y / np.linalg.norm(y)
    return (
        (float(np.linalg.norm(A @ y) / abs(A).sum(axis=0).max()), y)
        if np.isfinite(y).all()
        else None
    )


def eigenvalues(
    stop: StoppedSolve, x: np.ndarray, multipliers: np.ndarray, t: float
) -> np.ndarray | None:
    """Eigenvalues of the balanced W of the whole step on the null space of the joints, at x (n,)
    and a time, ascending.

        Z^T D W D Z

    with Z the null space of the balanced J. None for more than 1500 unknowns, where W is not
    finite, and where the joints leave no motion.
    """
    if stop.system.size > DENSE:
        return None
    bh, gh = stop.whole
    K = compiled.tangent(stop.model, x, multipliers, t, gh, stop.memory) + bh * csr_array(
        stop.system.mass
    )
    if not np.isfinite(K.data).all():
        return None
    symmetric = csr_array(0.5 * (K + K.T))
    size = saddle.scales(symmetric)
    Z = ranks.null_space(compiled.gap(stop.model, x, t)[1] * size)
    return np.asarray(eigvalsh(Z.T @ (saddle.balance(symmetric, size) @ Z))) if Z.shape[1] else None


def strains(system: System, x: np.ndarray) -> dict[str, tuple[float, float]]:
    """Smallest and largest axial or principal Green strain [-] of every elastic body at x (n,), at
    its quadrature points.

    Loads that follow a surface are left out, and terms that have no position gradients.
    """
    q = system.lift(x)
    found = {}
    for elastic in system.elastic:
        gradients = terms.position_gradients(elastic.gather, x, q)
        if gradients is not None and not elastic.gather.law.follows:
            e = extreme_strains(elastic.gather.law, elastic.gather.section, gradients, system.dim)
            found[elastic.name] = (float(e.min()), float(e.max()))
    return found


def turns(system: System, x: np.ndarray, v: np.ndarray) -> dict[str, float]:
    """Fastest turn of a slope of every line or surface [rad/s].

        |t'| / |t|    of the part of t' normal to t

    by lines and surfaces, at x (n,) and v (n,); those that do not turn are left out.
    """
    parts = np.stack([system.lift(x), np.asarray(system.lift.matrix @ v)])
    pairs = {name: found[:, 1] for name, found in centre_lines(system, parts).items()}
    now, change = (skins(system, part) for part in parts)
    pairs |= {name: np.stack([now[name][1], change[name][1]]) for name in now}
    return {name: rate for name, pair in pairs.items() if (rate := turn_rate(*pair)) > 0.0}


def turn_rate(slope: np.ndarray, change: np.ndarray) -> float:
    """Fastest turn of slopes t with changes t', rows (x, c).

        max |t'| / |t|    of the part of t' normal to t

    [rad/s] of rates.
    """
    square = np.sum(slope**2, axis=1)
    used = square > 0.0
    slope = slope[used]
    change = change[used]
    square = square[used]
    along = np.sum(slope * change, axis=1) / square
    return float(
        (np.linalg.norm(change - along[:, None] * slope, axis=1) / np.sqrt(square)).max(initial=0.0)
    )


def stiffest(stop: StoppedSolve) -> float:
    """h omega of the stiffest wave, a lower bound.

        h max_i sqrt(K_ii / M_ii)

    over unknowns with a mass.
    """
    system = stop.system
    m = csr_array(system.mass).diagonal()
    k = compiled.tangent(
        stop.model, stop.x, stop.multipliers, stop.good, 0.0, stop.memory
    ).diagonal()
    heavy = m > SIZE * m.max(initial=0.0)
    return float(stop.h * np.sqrt(np.maximum(k[heavy] / m[heavy], 0.0).max(initial=0.0)))


def stiffest_force(stop: StoppedSolve) -> tuple[str, float]:
    """Kind and owner of the stiffest force on probe rows, and its h omega; 0 for none.

    omega^2 is the largest eigenvalue of S G of its rows y = P x, with the accelerations a of unit
    forces on these rows that the joints permit.

        S = - dF/dy,    G = P a,    M a + J^T l = P^T,    J a = 0
    """
    system, model = stop.system, stop.model
    if (
        not any(len(force.pairs) or force.low.terms for force in model.forces)
        or system.size > SPARSE
    ):
        return "", 0.0
    factors = saddle.factor(
        saddle.matrix(system.mass, compiled.gap(model, stop.x, stop.good)[1]), SHIFT
    )
    if factors is None:
        return "", 0.0
    names = owners(system)
    P = csr_array(system.probes.matrix)
    found = []
    for force, pairs, slopes in compiled.force_slopes(
        model, stop.x, stop.v, stop.good, stop.memory
    ):
        if not np.isfinite(slopes).all():
            continue
        rows, local = np.unique(pairs, return_inverse=True)
        S, pushed = (
            np.zeros((len(rows), len(rows))),
            np.zeros((system.size + model.constraints, len(rows))),
        )
        np.add.at(S, tuple(local.reshape(-1, 2).T), slopes)
        pushed[: system.size] = P[rows].toarray().T
        squares, modes = np.linalg.eig(S @ (pushed.T @ saddle.solve(factors, pushed)))
        k = int(squares.real.argmax())
        owner = names[int(np.abs(pushed[: system.size] @ modes[:, k]).argmax())]
        found.append(
            (f"{force.name} on {owner}", float(stop.h * np.sqrt(max(squares[k].real, 0.0))))
        )
    return max(found, key=lambda one: one[1], default=("", 0.0))


def closeness(stop: StoppedSolve, x: np.ndarray) -> tuple[float, np.ndarray]:
    """Smallest singular value of the unit rows of J at x, and the combination of rows (m,) that
    nearly vanishes.
    """
    J = ranks.unit_rows(compiled.gap(stop.model, x, stop.at)[1])
    values, vectors = np.linalg.eigh(J @ J.T)
    return float(np.sqrt(max(values[0], 0.0))), vectors[:, 0]


def ahead(stop: StoppedSolve) -> np.ndarray:
    """The position on a straight way in which the unit rows of J are nearest to depend on each
    other.

        x + s h v,    0 <= s <= AHEAD
    """
    from scipy.optimize import minimize_scalar

    if not stop.h or not np.isfinite(stop.v).all():
        return stop.x
    sizes = AHEAD * np.arange(PLACES + 1) / PLACES
    near = [closeness(stop, stop.x + s * stop.h * stop.v)[0] for s in sizes]
    best = int(np.argmin(near))
    ends = sizes[max(best - 1, 0)], sizes[min(best + 1, PLACES)]
    found = minimize_scalar(
        lambda s: closeness(stop, stop.x + s * stop.h * stop.v)[0], bounds=ends, method="bounded"
    )
    return np.asarray(
        stop.x + (found.x if found.fun < near[best] else sizes[best]) * stop.h * stop.v
    )


def broken_signals(stop: StoppedSolve) -> list[str]:
    """Signals that are no finite number where the solve stopped.

    Names as of `signal_names`, at the time that was not reached.
    """
    values = signal_table(stop.system, np.array([stop.at]))[0]
    return [
        name
        for name, value in zip(signal_names(stop.system), values, strict=True)
        if not np.isfinite(value)
    ]


def broken_forces(stop: StoppedSolve) -> list[str]:
    """Bodies on which a load is no finite number in the last good or the trial state, or on the way
    of the last velocities.
    """
    system = stop.system
    found = list[str]()
    v = np.where(np.isfinite(stop.v), stop.v, 0.0)
    places = [stop.x, stop.trial, *(stop.x + s * stop.h * v for s in WAY)]
    names = np.array(owners(system)[: system.size])
    for force in system.loads.forces:
        alone = compile_system(replace(system, loads=replace(system.loads, forces=(force,))))
        pushed = [compiled.forces(alone, x, v, stop.at) for x in places if np.isfinite(x).all()]
        found += names[~np.isfinite(pushed).all(axis=0)].tolist()
    return list(dict.fromkeys(found))


def jumps(stop: StoppedSolve) -> list[tuple[str, float, float]]:
    """Signals that jump in the failed step: name, value before and after.

    A jump is a change far beyond those of the steps before, more than half of it within a small
    part of the step.
    """
    if stop.h <= 0.0 or not stop.system.signals:
        return []
    past = signal_table(stop.system, np.maximum(stop.good + stop.h * np.arange(-WINDOW, 1), 0.0))
    inside = signal_table(stop.system, stop.good + stop.h * np.linspace(0.0, 1.0, FINE + 1))
    change = np.abs(inside[-1] - inside[0])
    usual = np.abs(np.diff(past, axis=0)).max(axis=0)
    sudden = np.abs(np.diff(inside, axis=0)).max(axis=0)
    with np.errstate(invalid="ignore"):
        found = np.flatnonzero((change > 20 * usual) & (sudden > 0.5 * change))
    names = signal_names(stop.system)
    return [(names[k], float(inside[0, k]), float(inside[-1, k])) for k in found]


def push(stop: StoppedSolve) -> tuple[str, float]:
    """Owner that the loads move furthest, and the way [m].

        |dQ_i| h^2 / M_ii    in a step of dynamics,    K^-1 R    in statics

    by the change dQ of loads since the start, and by the tangent.
    """
    names = owners(stop.system)
    n = stop.system.size
    if not stop.h:
        factors = saddle_of(stop)
        way = (
            np.full(n, np.inf)
            if factors is None
            else np.abs(saddle.solve(factors, stop.residual))[:n]
        )
    else:
        m = csr_array(stop.system.mass).diagonal()
        now, then = (
            compiled.forces(stop.model, stop.x, 0.0 * stop.v, t, stop.memory)
            for t in (stop.at, 0.0)
        )
        heavy = m > SIZE * m.max(initial=0.0)
        way = np.where(heavy, np.abs(now - then), 0.0) * stop.h**2 / np.where(heavy, m, 1.0)
    k = int(np.nan_to_num(way, nan=np.inf).argmax())
    return names[k], float(way[k])
