r"""Equilibrium by load stepping, and vibration modes of constrained systems.

    f(x) - s Q + Phi_x^T lambda = 0,  Phi(x) = 0,  s = s1 .. 1          K v = omega^2 M v  on the null space of Phi_x

Source of the eigenproblem on the constraints' null space: Geradin and Rixen, Mechanical Vibrations, 3rd ed., Wiley 2015, ch. 2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh, qr
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from ..core.errors import InputError, Reason, SolverError, say
from ..core.linalg import as_dense
from ..systems import compiled
from ..systems.compiled import Compiled, compile_system
from ..systems.system import System
from .integration import Newton, Statistics, Trajectory, coordinate_names

SHORTER = 0.55  #: factor of a load step that failed; not 1/2, which would come back to the same load factor
SHORTEST = 0.02  #: part of the load step asked for below which the solution is given up


@dataclass(frozen=True)
class Equilibrium:
    """State at the full load."""

    x: np.ndarray  #: (n,)
    multipliers: np.ndarray  #: (m,)
    iterations: int


def scaled_loads(system: System, factor: float) -> System:
    """All loads times a factor."""
    loads = system.loads
    laws = tuple(replace(law, vector=factor * law.vector) for law in loads.laws)
    return replace(
        system, loads=replace(loads, constant=factor * loads.constant, coefficient=factor * loads.coefficient, laws=laws)
    )


def solve_statics(
    system: System,
    steps: int = 10,
    newton: Newton | None = None,
    time: float = 0.0,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Equilibria under the loads times 1/steps, ..., 1, as a Trajectory over the load factor; histories are taken at `time`.

    A load step that does not converge is shortened, several times if need be; then SolverError carries the equilibria found so far.
    """
    newton = newton or Newton()
    if steps < 1:
        raise InputError(say("analysis.load_steps", "at least one", steps))
    base, count = len(system.constraints.names), 0
    x, multipliers = system.x0.copy(), np.zeros(base)
    found = [(0.0, x, multipliers)]
    target, size, done = 1.0 / steps, 1.0 / steps, 0.0
    while done < 1.0 - 1e-12:
        target = min(1.0, done + size)
        model = compile_system(scaled_loads(system, target))
        try:
            state = newton_statics(model, x, multipliers, newton, time, target)
        except SolverError as error:
            size *= SHORTER
            if size < SHORTEST / steps:
                error.partial = load_path(system, found, count)
                raise
            continue
        x, multipliers, done = state.x, state.multipliers, target
        count += state.iterations
        found.append((done, x, multipliers))
        if progress:
            progress(done)
    return load_path(system, found, count)


def load_path(system: System, found: list[tuple[float, np.ndarray, np.ndarray]], iterations: int) -> Trajectory:
    x = np.array([state for _, state, _ in found])
    multipliers = np.array([m for _, _, m in found]).reshape(len(found), -1)
    statistics = Statistics(len(found) - 1, iterations, iterations, 0, 0.0, 0.0)
    return Trajectory(system, np.array([f for f, _, _ in found]), x, np.zeros_like(x), np.zeros_like(x), multipliers, statistics)


def newton_statics(
    model: Compiled, x: np.ndarray, multipliers: np.ndarray, newton: Newton, time: float, factor: float
) -> Equilibrium:
    """Full Newton iteration with the exact tangent; corrections are shortened where they would leave the basin of attraction."""
    n, still = len(x), np.zeros(len(x))
    last, norm = np.inf, np.inf
    for iteration in range(4 * newton.iterations):
        phi, J = compiled.gap(model, x, time)
        R = np.concatenate([compiled.forces(model, x, still, time) + J.T @ multipliers, phi])
        K = compiled.kkt(compiled.tangent(model, x, multipliers, time), J).tocsc()
        try:
            step = splu(K).solve(R)
        except RuntimeError as error:
            raise static_failure(model, Reason.SINGULAR_TANGENT, factor, R) from error
        if not np.isfinite(step).all():
            raise static_failure(model, Reason.SINGULAR_TANGENT, factor, R)
        last, norm = norm, float(np.linalg.norm(step[:n]))
        if iteration > 8 and norm > 1e3 * model.system.scale:
            raise static_failure(model, Reason.DIVERGED, factor, R)
        short = min(1.0, 0.2 * model.system.scale / max(norm, 1e-300))
        x, multipliers = x - short * step[:n], multipliers - short * step[n:]
        floor = 1e-13 * model.system.scale
        if norm <= max(newton.tolerance * model.system.scale * min(1.0, last / max(norm, 1e-300) * 1e-2), floor):
            return Equilibrium(x, multipliers, iteration + 1)
    raise static_failure(model, Reason.NOT_CONVERGED, factor, R)


def static_failure(model: Compiled, reason: Reason, factor: float, R: np.ndarray) -> SolverError:
    """The error of a load step, with the worst residuals by name."""
    joints = [f"joint {joint}.{label}" for joint, label in model.system.constraints.names]
    labels = coordinate_names(model.system) + joints
    values = np.abs(np.nan_to_num(R, nan=np.inf))
    worst = tuple((labels[k], float(values[k])) for k in np.argsort(values)[::-1][:5])
    listed = ", ".join(f"{name}: {value:.3g}" for name, value in worst)
    hint = "a body may be free to move: hold it by joints" if reason is Reason.SINGULAR_TANGENT else "try more load steps"
    return SolverError(f"{reason.value} at load factor {factor:.4g}; largest residuals: {listed}; {hint}", reason, factor, worst)


@dataclass(frozen=True)
class Modes:
    """Vibration modes about a configuration."""

    frequencies: np.ndarray  #: (i,) angular frequencies [rad/s]
    shapes: np.ndarray  #: (n, i) normalised by the mass matrix


def vibration_modes(system: System, count: int = 10, x: np.ndarray | None = None, multipliers: np.ndarray | None = None) -> Modes:
    """Lowest `count` modes about x (the reference by default), on the null space of all constraints."""
    model = compile_system(system)
    x = system.x0 if x is None else x
    multipliers = np.zeros(model.constraints) if multipliers is None else multipliers
    J = compiled.gap(model, x)[1]
    K, M = as_dense(compiled.tangent(model, x, multipliers)), as_dense(csr_array(system.mass))
    if len(J):
        Q, R, _ = qr(J.T, pivoting=True)
        diagonal = np.abs(np.diag(R))
        Z = Q[:, int((diagonal > 1e-10 * diagonal[0]).sum()) :]
        K, M = Z.T @ K @ Z, Z.T @ M @ Z
    else:
        Z = np.eye(len(x))
    if not 1 <= count <= len(K):
        raise InputError(say("analysis.count", f"1 to {len(K)} modes", count))
    squares, vectors = eigh(0.5 * (K + K.T), 0.5 * (M + M.T), subset_by_index=[0, count - 1])
    return Modes(np.sqrt(np.maximum(squares, 0.0)), Z @ vectors)
