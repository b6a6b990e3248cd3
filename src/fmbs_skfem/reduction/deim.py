r"""Discrete empirical interpolation (DEIM) of the elastic force, as a comparator of ECSW.

    U^T F(U xi + qbar) ~ D P^T F(U xi + qbar),    D = U^T Z (P^T Z)^-1

Z (n, k) holds the POD modes of force snapshots, P picks k of the n coordinates, one a mode, greedily where the interpolation of
the next mode errs most. Unlike that of ECSW this force is the gradient of no energy, and its tangent D P^T K U is not symmetric:
nothing keeps the energy of the reduced model. Here the whole force is evaluated and its rows are picked: accuracy and stability
are those of DEIM, speed is not looked at.

Source: Chaturantabut and Sorensen, SIAM J. Sci. Comput. 32 (2010) 2737-2764, doi 10.1137/090766498, algorithm 1 and lemma 3.2.
"""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from ..core.errors import InputError, Reason, SolverError, say
from ..core.linalg import as_dense
from ..dynamics.scheme import GeneralizedAlpha, Newton, method_of, steps_in
from ..dynamics.stepping import Method
from ..dynamics.trajectory import Statistics, Trajectory
from ..systems import compiled
from ..systems.compiled import Compiled, compile_system
from ..systems.system import Loads, System
from .galerkin import Snapshots, rows_of
from .pod import truncation


@dataclass(frozen=True)
class Interpolation:
    """f ~ modes (P^T modes)^-1 f[rows]."""

    modes: np.ndarray  #: (n, k), orthonormal
    rows: np.ndarray  #: (k,)

    @property
    def amplification(self) -> float:
        """||(P^T Z)^-1||_2: the error is at most so many times that of the best approximation (lemma 3.2)."""
        return float(1.0 / np.linalg.svd(self.modes[self.rows], compute_uv=False)[-1])

    def __call__(self, picked: np.ndarray) -> np.ndarray:
        """The vector from its values at `rows`."""
        return np.asarray(self.modes @ np.linalg.solve(self.modes[self.rows], picked))


@dataclass(frozen=True)
class Interpolated:
    """A reduced system whose elastic force is interpolated."""

    reduced: System
    rest: Compiled  #: the reduced system without its elastic bodies
    bodies: Compiled  #: the full system without loads
    rows: np.ndarray  #: (k,) coordinates of which the force is read
    weights: np.ndarray  #: D (r, k)
    modes: np.ndarray  #: U (n, r)
    parts: Mapping[str, Interpolation]  #: by component

    def force(self, x: np.ndarray) -> np.ndarray:
        """D P^T F (r,)."""
        q = self.reduced.lift(x)
        return np.asarray(self.weights @ compiled.forces(self.bodies, q, 0.0 * q)[self.rows])

    def tangent(self, x: np.ndarray) -> np.ndarray:
        """D P^T K U (r, r), not symmetric."""
        none = np.zeros(self.bodies.constraints)
        K = compiled.tangent(self.bodies, self.reduced.lift(x), none)
        return np.asarray(self.weights @ (K[self.rows] @ self.modes))


def interpolation(modes: np.ndarray) -> Interpolation:
    """The rows of algorithm 1: the largest entry of the first mode, then of what interpolation leaves of the next one."""
    rows = [int(np.abs(modes[:, 0]).argmax())]
    for k in range(1, modes.shape[1]):
        before, mode = modes[:, :k], modes[:, k]
        rest = mode - before @ np.linalg.solve(before[rows], mode[rows])
        rows.append(int(np.abs(rest).argmax()))
    return Interpolation(modes, np.array(rows))


def force_modes(forces: np.ndarray, tolerance: float) -> np.ndarray:
    """POD modes of force snapshots (n, s), not centred, up to the relative energy `tolerance`."""
    left, values, _ = np.linalg.svd(forces, full_matrices=False)
    return np.ascontiguousarray(left[:, : max(1, truncation(values, tolerance))])


def train(
    full: System, reduced: System, components: Mapping[str, Sequence[str]], data: Snapshots, tolerance: float = 1e-12
) -> Interpolated:
    """Interpolation of the elastic forces of every component, from those at the snapshots of the full system."""
    if not reduced.components:
        raise InputError(say("deim.train", "a reduced system", "a full one", "reduce it first"))
    none = np.zeros(0, dtype=np.int64)
    unloaded = replace(full, loads=Loads(np.zeros(full.size), none, np.zeros(0), none))
    bodies = compile_system(unloaded)
    F = np.stack([compiled.forces(bodies, q, 0.0 * q) for q in data.q], axis=1)
    U, picked, weights, parts = as_dense(reduced.lift.matrix), [], [], {}
    for name, members in components.items():
        own = rows_of(full, members)
        part = interpolation(force_modes(F[own], tolerance))
        picked.append(own[part.rows])
        weights.append(U[own].T @ np.linalg.solve(part.modes[part.rows].T, part.modes.T).T)
        parts[name] = part
    rest = compile_system(replace(reduced, elastic=()))
    return Interpolated(reduced, rest, bodies, np.concatenate(picked), np.concatenate(weights, axis=1), U, parts)


def integrate(
    model: Interpolated, scheme: GeneralizedAlpha, duration: float, newton: Newton | None = None, every: int = 1
) -> Trajectory:
    """Motion from rest by the generalized-alpha method of `dynamics`, in dense algebra; a step that fails ends it."""
    newton, system = newton or Newton(), model.reduced
    if np.any(system.v0):
        raise InputError(say("deim.integrate", "a start at rest", f"velocities up to {np.abs(system.v0).max():.3g}"))
    method = method_of(scheme, newton, scheme.step, model.rest)
    begun, x, v = clock.process_time(), system.x0, system.v0
    acceleration, multipliers = start(model)
    a, angles, kept = acceleration, compiled.followed(model.rest, x), [(0.0, x, v, acceleration, multipliers)]
    steps = steps_in(scheme, duration)
    for step in range(1, steps + 1):
        try:
            state = x, v, a, acceleration, multipliers
            x, v, a, acceleration, multipliers = advance(model, method, step * scheme.step, angles, *state)
        except SolverError as error:
            error.partial = gathered(system, kept, clock.process_time() - begun)
            raise
        angles = compiled.followed(model.rest, x, angles)
        if step % every == 0 or step == steps:
            kept.append((step * scheme.step, x, v, acceleration, multipliers))
    return gathered(system, kept, clock.process_time() - begun)


def gathered(system: System, kept: list[tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]], cpu: float) -> Trajectory:
    """Stored states as a Trajectory."""
    times, x, v, a, multipliers = (np.array(part) for part in zip(*kept, strict=True))
    return Trajectory(system, times, x, v, a, multipliers, Statistics(len(kept) - 1, 0, 0, 0, cpu, cpu, "dense LU, interpolated"))


def start(model: Interpolated) -> tuple[np.ndarray, np.ndarray]:
    """q'' and multipliers at rest: M q'' + f + J^T lambda = 0, J q'' = 0."""
    system, x = model.reduced, model.reduced.x0
    f = model.force(x) + compiled.forces(model.rest, x, 0.0 * x)
    J = compiled.gap(model.rest, x)[1]
    found = np.linalg.solve(bordered(as_dense(system.mass), J), np.append(-f, np.zeros(len(J))))
    return found[: len(x)], found[len(x) :]


def bordered(W: np.ndarray, J: np.ndarray) -> np.ndarray:
    """[[W, J^T], [J, 0]]."""
    return np.block([[W, J.T], [J, np.zeros((len(J), len(J)))]])


def advance(
    model: Interpolated,
    method: Method,
    t: float,
    angles: np.ndarray,
    x: np.ndarray,
    v: np.ndarray,
    a: np.ndarray,
    acceleration: np.ndarray,
    multipliers: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """x, v, a, q'' and multipliers after a step to time t; factors are renewed where the iteration contracts badly.

    `angles` are those of springs before the step.
    """
    M, h, guess, n = as_dense(model.reduced.mass), method.h, acceleration, len(x)
    a1 = ((1 - method.af) * guess + method.af * acceleration - method.am * a) / (1 - method.am)
    q = x + h * v + h * h * ((0.5 - method.beta) * a + method.beta * a1)
    rate, factors, last = v + h * ((1 - method.gamma) * a + method.gamma * a1), None, np.inf
    for _ in range(method.iterations):
        phi, J = compiled.gap(model.rest, q, t)
        R = M @ guess + model.force(q) + compiled.forces(model.rest, q, rate, t, angles) + J.T @ multipliers
        if factors is None:
            outer = as_dense(compiled.tangent(model.rest, q, multipliers, t, method.gh, angles))
            W = method.bh * M + model.tangent(q) + outer
            if not np.isfinite(W).all():
                break
            factors = lu_factor(bordered(method.c * W, J), check_finite=False)
        d = lu_solve(factors, np.append(method.c * R, phi), check_finite=False)
        q, rate, guess = q - d[:n], rate - method.gh * d[:n], guess - method.bh * d[:n]
        multipliers, norm = multipliers - d[n:] / method.c, float(np.linalg.norm(d[:n]))
        if not np.isfinite(norm) or norm > 1e3 * last:
            break
        if norm < last and norm * norm / last <= method.tolerance:
            a1 = ((1 - method.af) * guess + method.af * acceleration - method.am * a) / (1 - method.am)
            return q, rate, a1, guess, multipliers
        factors = factors if norm < 0.1 * last else None
        last = norm
    raise SolverError(f"the interpolated model cannot take the step to t = {t:.6g} s", Reason.DIVERGED, t)
